"""Every file that decides a verdict is watched, and none of them is trusted to be whole."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from reviews import TOO_FAR, missions_shown, review_app, rows_of, settled, text_of, what_if_of

from planner.tui.checked import FileWatch, deciding_files
from planner.tui.screens.checklist import ChecklistScreen
from planner.values import replace
from planner.vehicle.library import load_vehicle, model_names
from planner.vehicle.writer import write_vehicle

if TYPE_CHECKING:
    from textual.pilot import Pilot

    from planner.tui.screens.review import ReviewScreen

GOOD = "survey-vineyard.plan"
VEHICLE = 'vehicle = "falkowski-2023-quadrotor"\n'
WIDE = (160, 48)


async def _looked(pilot: Pilot[None], screen: ReviewScreen) -> str:
    """Let the review look at its files, and return the verdict it then shows."""
    screen.watch_files()
    await settled(pilot)
    return text_of(screen, "#verdict")


def test_mission_model_parameters_profile_terrain_and_configurations_decide() -> None:
    given: dict[str, object] = {
        "vehicle": "mine.toml",
        "params": Path("mine.param"),
        "profile": Path("site.toml"),
        "terrain": (Path("hill.tif"),),
    }
    names = {path.name for path in deciding_files("sub/a.plan", what_if_of("a.plan", given))}
    assert names == {
        "a.plan",
        "mine.toml",
        "mine.param",
        "site.toml",
        "hill.tif",
        "mavjoule.toml",
        "pyproject.toml",
    }


def test_a_model_by_its_name_is_no_file() -> None:
    [name, *_] = model_names()
    files = deciding_files("a.plan", what_if_of("a.plan", {"vehicle": name}))
    assert Path(name) not in files


def test_a_file_is_told_once_for_each_time_it_changes() -> None:
    file = Path("watched.txt")
    watch = FileWatch()
    watch.follow([file])
    assert watch.changed() == ()
    file.write_text("a", encoding="utf-8")
    watch.follow([file, Path("other.txt")])  # what was seen before is kept
    assert watch.changed() == (file,)
    assert watch.changed() == ()
    os.utime(file, ns=(1, 1))
    assert watch.changed() == (file,)
    file.unlink()
    assert watch.changed() == (file,)


@pytest.mark.asyncio
async def test_another_configuration_counts_and_one_that_is_broken_leaves_no_verdict() -> None:
    async with review_app(GOOD).run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        assert text_of(screen, "#verdict").startswith("✔ GO")
        own = Path("mavjoule.toml")
        whole = own.read_text(encoding="utf-8")
        own.write_text(f'{VEHICLE}battery = "1Ah@14.8V"\n', encoding="utf-8")
        verdict = await _looked(pilot, screen)
        assert verdict.startswith("✖ NO-GO")
        assert "mavjoule.toml changed" in verdict
        own.write_text('battery = "1Ah@', encoding="utf-8")  # half written
        verdict = await _looked(pilot, screen)
        assert verdict.startswith("– NO VERDICT")
        assert "is not TOML" in verdict
        own.write_text(whole, encoding="utf-8")
        assert (await _looked(pilot, screen)).startswith("✔ GO")
        own.unlink()
        verdict = await _looked(pilot, screen)
        assert verdict.startswith("– NOT CHECKED")  # neither battery nor vehicle
        assert "battery unknown" in verdict


@pytest.mark.asyncio
async def test_a_model_is_checked_again_and_half_of_one_leaves_no_verdict() -> None:
    model = Path("mine.toml")
    write_vehicle(model, replace(load_vehicle("falkowski-2023-quadrotor"), name="mine"))
    whole = model.read_text(encoding="utf-8")
    async with review_app(GOOD, given={"vehicle": "mine.toml"}).run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        assert text_of(screen, "#verdict").startswith("✔ GO")
        model.write_text(whole[: len(whole) // 2], encoding="utf-8")
        verdict = await _looked(pilot, screen)
        assert verdict.startswith("– NO VERDICT")
        assert "mine.toml" in verdict
        model.unlink()
        assert (await _looked(pilot, screen)).startswith("– NO VERDICT")
        model.write_text(whole, encoding="utf-8")
        verdict = await _looked(pilot, screen)
        assert verdict.startswith("✔ GO")
        assert "mine.toml changed" in verdict


@pytest.mark.asyncio
@pytest.mark.parametrize(
    ("key", "name", "text"),
    [("params", "mine.param", "WPNAV_SPEED,500\n"), ("profile", "site.toml", "[manual]\n")],
)
async def test_parameters_and_profile_are_checked_again(key: str, name: str, text: str) -> None:
    file = Path(name)
    file.write_text(text, encoding="utf-8")
    async with review_app(GOOD, given={key: file}).run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        file.write_text(text + "\n", encoding="utf-8")
        assert f"{name} changed" in await _looked(pilot, screen)
        file.unlink()
        verdict = await _looked(pilot, screen)
        assert verdict.startswith("– NO VERDICT")
        assert name in verdict


@pytest.mark.asyncio
async def test_a_lost_mission_is_no_go_in_words_until_it_is_back() -> None:
    whole = Path(GOOD).read_bytes()
    async with review_app(GOOD).run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        Path(GOOD).unlink()
        assert (await _looked(pilot, screen)).startswith("– NOT CHECKED")
        assert rows_of(screen, "#findings")[0][1] == "X901"
        Path(GOOD).write_bytes(whole[: len(whole) // 2])
        assert (await _looked(pilot, screen)).startswith("– NOT CHECKED")
        Path(GOOD).write_bytes(whole)
        assert (await _looked(pilot, screen)).startswith("✔ GO")


@pytest.mark.asyncio
async def test_a_checklist_shows_no_go_of_a_mission_that_has_changed() -> None:
    whole = Path(GOOD).read_bytes()
    async with review_app(GOOD).run_test(size=WIDE) as pilot:
        await settled(pilot)
        await pilot.press("c")
        await pilot.pause()
        checklist = pilot.app.screen
        assert isinstance(checklist, ChecklistScreen)
        checklist.watch_files()
        assert text_of(checklist, "#verdict").startswith("✔ GO")
        Path(GOOD).write_bytes(whole[: len(whole) // 2])
        checklist.watch_files()
        await pilot.pause()
        verdict = text_of(checklist, "#verdict")
        assert verdict.startswith("– NO VERDICT")
        assert f"{GOOD} changed" in verdict
        assert checklist.query_one("#who").border_title == "Nothing to sign"


@pytest.mark.asyncio
async def test_a_list_of_missions_takes_up_new_files_and_another_configuration() -> None:
    async with review_app(".").run_test(size=(100, 30)) as pilot:
        screen = await missions_shown(pilot)
        Path("new.plan").write_bytes(Path(TOO_FAR).read_bytes())
        screen.watch_files()
        await missions_shown(pilot)
        verdicts = {cells[1]: cells[2] for cells in rows_of(screen, "#missions")}
        assert verdicts["new.plan"] == "NO-GO"
        assert verdicts[GOOD] == "GO"
        Path("mavjoule.toml").write_text(f'{VEHICLE}battery = "1Ah@14.8V"\n', encoding="utf-8")
        screen.watch_files()
        await missions_shown(pilot)
        verdicts = {cells[1]: cells[2] for cells in rows_of(screen, "#missions")}
        assert verdicts[GOOD] == "NO-GO"
