"""What is offered for a no-go really makes it go, by a check of its own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from reviews import SURVEY, TOO_FAR, TOO_SMALL, review_app, rows_of, settled, text_of, what_if_of
from textual.widgets import Input

from planner.notation import read_battery
from planner.service.preflight import CheckResult
from planner.setup import settings
from planner.tui.checked import checked
from planner.tui.screens.save import SplitScreen, save, save_parts
from planner.tui.suggestions import suggestions
from planner.tui.widgets.row_list import RowList

if TYPE_CHECKING:
    from collections.abc import Mapping

    from textual.pilot import Pilot

    from planner.tui.suggestions import Suggestion


MODELS = Path(__file__).parents[2] / "models"


def _offered(file: str, given: Mapping[str, object]) -> dict[str, Suggestion]:
    """Return what is offered, by its first word."""
    return {one.text.split()[0]: one for one in suggestions(checked(file, what_if_of(file, given)))}


def test_a_larger_battery_another_speed_and_a_split_are_offered_and_go() -> None:
    offered = _offered(SURVEY, TOO_SMALL)
    assert list(offered) == ["battery", "saved", "split"]
    assert all(one.is_go for one in offered.values())
    for one in offered.values():
        if one.changes:
            changed = what_if_of(SURVEY, TOO_SMALL).with_changes(dict(one.changes))
            assert checked(SURVEY, changed).result.verdict == "go"


def test_the_mission_at_the_offered_speed_goes_from_its_file_too() -> None:
    what_if = what_if_of(SURVEY, TOO_SMALL).with_changes(
        dict(_offered(SURVEY, TOO_SMALL)["saved"].changes)
    )
    save(checked(SURVEY, what_if), "offered.plan")
    assert checked("offered.plan", what_if_of("offered.plan", TOO_SMALL)).result.verdict == "go"
    assert checked(SURVEY, what_if_of(SURVEY, TOO_SMALL)).result.verdict == "no-go"


def test_no_flight_is_faster_than_the_offered_speed_allows() -> None:
    fastest = float(dict(_offered(SURVEY, TOO_SMALL)["saved"].changes)["speed_m_s"])
    # a tenth faster: past what the model was identified for, or what the battery does for
    faster = what_if_of(SURVEY, TOO_SMALL).changed("speed_m_s", f"{1.1 * fastest:.3f}")
    assert checked(SURVEY, faster).result.verdict == "no-go"


def test_the_parts_of_the_offered_split_go_from_their_files() -> None:
    split = _offered(SURVEY, TOO_SMALL)["split"].split
    assert split is not None
    assert save_parts(split, "parts") == f"{len(split.parts)} parts in parts"
    files = sorted(Path("parts").glob("*.plan"))
    assert len(files) == len(split.parts) > 1
    for file in files:
        result = checked(str(file), what_if_of(str(file), TOO_SMALL)).result
        assert result.verdict == "go"
        assert isinstance(result, CheckResult)


def test_no_battery_beyond_half_as_much_again_is_offered() -> None:
    assert list(_offered(TOO_FAR, {})) == ["battery"]
    # 73.2 Wh and the reserve of 20 % take 92 Wh: more than 1.5 times 60 Wh, which is 90 Wh
    assert _offered(TOO_FAR, {"battery": read_battery("60Wh")}) == {}


def test_no_battery_is_offered_that_the_model_does_not_know_its_vehicle_to_lift() -> None:
    model = (MODELS / "px4-quad-2kg.toml").read_text(encoding="utf-8")
    model = model.replace('name = "px4-quad-2kg"', 'name = "own"')
    Path("own.toml").write_text(model, encoding="utf-8")
    given = {
        "vehicle": "own.toml",
        "battery": read_battery("5Ah@14.8V"),
        "reserve": settings()["reserve"].kind.read("65%"),
    }
    assert "battery" in _offered(SURVEY, given)
    limited = model.replace("mass_kg = [1.6, 2.5]", "mass_kg = [1.6, 2.0]")
    assert limited != model
    Path("own.toml").write_text(limited, encoding="utf-8")
    assert "battery" not in _offered(SURVEY, given)


def test_a_mission_that_no_flight_can_begin_is_offered_no_split() -> None:
    assert list(_offered(TOO_FAR, {})) == ["battery"]


def test_a_go_is_offered_the_reserve_it_still_keeps() -> None:
    offered = _offered(SURVEY, {})
    [one] = offered.values()
    assert one.is_go
    more = f"{int(dict(one.changes)['reserve'].removesuffix('%')) + 1}%"
    assert checked(SURVEY, what_if_of(SURVEY).changed("reserve", more)).result.verdict == "no-go"


def test_nothing_is_offered_where_something_else_than_energy_is_wrong() -> None:
    Path("broken.plan").write_text("{", encoding="utf-8")
    assert _offered("broken.plan", {}) == {}


async def _choose(pilot: Pilot[None], word: str) -> None:
    """Choose what is offered with a word, by keys."""
    screen = pilot.app.screen
    rows = screen.query_one("#suggestions", RowList)
    [at] = [n for n, cells in enumerate(rows_of(screen, "#suggestions")) if word in cells[1]]
    rows.focus()
    await pilot.pause()
    await pilot.press("home", *["down"] * at, "enter")
    await pilot.pause()


@pytest.mark.asyncio
async def test_the_split_is_shown_and_its_parts_saved_by_keys() -> None:
    async with review_app(SURVEY, given=TOO_SMALL).run_test(size=(100, 30)) as pilot:
        review = await settled(pilot)
        await pilot.press("w")
        await settled(pilot)
        await _choose(pilot, "split")
        screen = pilot.app.screen
        assert isinstance(screen, SplitScreen)
        assert "2 flights instead of one" in text_of(screen, "#parts")
        assert screen.query_one("#folder", Input).value == "survey-vineyard-parts"
        await pilot.press("enter")
        await pilot.pause()
        assert pilot.app.screen is review
        await _choose(pilot, "split")
        await pilot.press("enter")
        await pilot.pause()
        assert "press Enter again to overwrite them" in text_of(pilot.app.screen, "#problem")
        await pilot.press("enter")
        await pilot.pause()
        assert pilot.app.screen is review
    names = [path.name for path in sorted(Path("survey-vineyard-parts").iterdir())]
    assert names == ["part-01.plan", "part-02.plan"]


@pytest.mark.asyncio
async def test_the_offered_speed_is_tried_by_keys() -> None:
    async with review_app(SURVEY, given=TOO_SMALL).run_test(size=(160, 48)) as pilot:
        screen = await settled(pilot)
        assert "3 changes would make it a GO" in text_of(screen, "#verdict")
        await _choose(pilot, "level legs")
        await settled(pilot)
        assert text_of(screen, "#verdict").startswith("✔ GO")
        assert "NO-GO → GO" in text_of(screen, "#outcome")
