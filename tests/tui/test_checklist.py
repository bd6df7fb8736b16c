"""The checklist and its sign-off."""

from __future__ import annotations

import hashlib
import json
from datetime import UTC, datetime
from pathlib import Path

import pytest
from reviews import TOO_FAR, review_app, rows_of, settled, text_of, what_if_of
from textual.widgets import Input

from planner.errors import OutputError, UsageError
from planner.physics.wind import Wind
from planner.report.sign_off import sign_off_paths
from planner.tui.checked import checked
from planner.tui.screens.checklist import checklist_table, sign
from planner.tui.screens.review import ReviewScreen
from planner.tui.screens.save import save

PROFILE = '[manual]\nAirframe = ["Propellers tight", "Battery strapped"]\nSite = ["Notices read"]\n'
GOOD = "survey-vineyard.plan"
AT = datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC)
ALL = frozenset({0, 1, 2})
MODELS = Path(__file__).parents[2] / "models"


@pytest.fixture
def profile() -> dict[str, object]:
    Path("site.toml").write_text(PROFILE, encoding="utf-8")
    return {"profile": Path("site.toml")}


def test_a_speed_tried_is_signed_only_once_the_mission_is_saved_at_it() -> None:
    tried = checked(GOOD, what_if_of(GOOD).changed("speed_m_s", "7.5"))
    with pytest.raises(UsageError, match=r"save the mission at 7\.5 m/s and sign that"):
        sign(tried, done=frozenset(), who="Ada", at=AT)
    assert not sign_off_paths(GOOD)
    save(tried, "slower.plan")
    slower = checked("slower.plan", what_if_of("slower.plan"))
    assert sign(slower, done=frozenset(), who="Ada", at=AT).exists()


def test_only_what_failed_is_spread_out() -> None:
    rows = checklist_table(
        checked(TOO_FAR, what_if_of(TOO_FAR)), done=frozenset(), opened=frozenset()
    )
    texts = [line.text for line in rows.entries]
    assert any("E101" in text for text in texts)  # energy failed
    assert not any("M109" in text for text in texts)  # structure has assumptions only


def test_only_what_was_looked_at_is_ticked() -> None:
    def lines(**given: object) -> dict[str, str]:
        rows = checklist_table(
            checked(GOOD, what_if_of(GOOD, given)), done=frozenset(), opened=frozenset()
        )
        return {
            row.text.partition(":")[0]: f"{row.sign.strip()} {row.text}" for row in rows.entries
        }

    without = lines()
    assert without["Wind"] == "– Wind: not given, calm assumed"
    assert without["Parameters"].startswith("– ")
    assert without["Terrain"].startswith("– ")
    assert without["parameters"].startswith("– ")  # the family: no rule of it could look at any
    assert without["wind"].startswith("– ")
    assert without["wind"].endswith("no wind given")
    assert without["Vehicle"] == "✔ Vehicle: falkowski-2023-quadrotor"
    assert without["Fence"].startswith("✔ Fence: 1 area")
    Path("own.param").write_text("WPNAV_SPEED,500\n", encoding="utf-8")
    given = lines(wind=Wind(speed_m_s=4.0, from_deg=90.0), params=Path("own.param"))
    assert given["Wind"] == "✔ Wind: 4@90"
    assert given["wind"].startswith("✔ ")
    assert given["Parameters"] == "✔ Parameters: own.param"


def test_a_family_is_opened_and_closed() -> None:
    one = checked(TOO_FAR, what_if_of(TOO_FAR))
    texts = [
        line.text for line in checklist_table(one, done=frozenset(), opened=frozenset("EM")).entries
    ]
    assert not any("E101" in text for text in texts)
    assert any("M109" in text for text in texts)


def test_a_sign_off_says_who_when_what_and_the_verdict(profile: dict[str, object]) -> None:
    one = checked(GOOD, what_if_of(GOOD, profile))
    path = sign(one, done=ALL, who=" Ada ", at=AT)
    document = json.loads(path.read_text(encoding="utf-8"))
    assert {one["input"]: one["sha256"] for one in document["inputs"]} == {
        name: hashlib.sha256(file.read_bytes()).hexdigest()
        for name, file in {
            "mission": Path(GOOD),
            "settings": Path("mavjoule.toml"),
            "vehicle": MODELS / "falkowski-2023-quadrotor.toml",
            "profile": Path("site.toml"),
        }.items()
    }
    assert (document["verdict"], document["decision"]) == ("go", "released")
    assert document["signed_by"] == "Ada"
    assert document["signed_at"] == "2026-05-04T03:02:01+00:00"
    assert [item["prompt"] for item in document["manual"]] == [
        "Propellers tight",
        "Battery strapped",
        "Notices read",
    ]
    assert document["command"] == f"mavjoule check {GOOD} --profile site.toml"


def test_a_no_go_is_signed_only_as_refused_and_its_items_may_stay_open(
    profile: dict[str, object],
) -> None:
    one = checked(TOO_FAR, what_if_of(TOO_FAR, profile))
    path = sign(one, done=frozenset({1}), who="Ada", at=AT)
    document = json.loads(path.read_text(encoding="utf-8"))
    assert (document["verdict"], document["decision"]) == ("no-go", "refused")
    assert [item["done"] for item in document["manual"]] == [False, True, False]
    assert {"E101", "E102"} <= {finding["code"] for finding in document["findings"]}


def test_a_second_sign_off_leaves_the_first_as_it_is() -> None:
    one = checked(GOOD, what_if_of(GOOD))
    first = sign(one, done=frozenset(), who="Ada", at=AT)
    before = first.read_bytes()
    second = sign(one, done=frozenset(), who="Grace", at=AT)
    third = sign(one, done=frozenset(), who="Ada", at=AT)
    assert first.read_bytes() == before
    assert sign_off_paths(GOOD) == (first, second, third)
    signed = [json.loads(path.read_text("utf-8"))["signed_by"] for path in sign_off_paths(GOOD)]
    assert signed == ["Ada", "Grace", "Ada"]


def test_a_sign_off_that_cannot_be_written_leaves_no_empty_file(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(path: Path, text: str) -> None:
        msg = f"{path}: cannot be written: {len(text)} bytes are too many"
        raise OutputError(msg)

    monkeypatch.setattr("planner.report.sign_off.write_output_file", fail)
    with pytest.raises(OutputError):
        sign(checked(GOOD, what_if_of(GOOD)), done=frozenset(), who="Ada", at=AT)
    assert sign_off_paths(GOOD) == ()


def test_nothing_is_signed_while_an_item_is_open(profile: dict[str, object]) -> None:
    one = checked(GOOD, what_if_of(GOOD, profile))
    with pytest.raises(UsageError, match="Battery strapped"):
        sign(one, done=frozenset({0, 2}), who="Ada", at=AT)
    assert not list(Path().glob("*.signoff.json"))


def test_nothing_is_signed_by_nobody() -> None:
    with pytest.raises(UsageError, match="who"):
        sign(checked(GOOD, what_if_of(GOOD)), done=frozenset(), who=" ", at=AT)


def test_another_file_than_the_one_checked_is_not_signed() -> None:
    one = checked(GOOD, what_if_of(GOOD))
    Path(GOOD).write_bytes(Path(TOO_FAR).read_bytes())
    with pytest.raises(UsageError, match="check it again"):
        sign(one, done=frozenset(), who="Ada", at=AT)


@pytest.mark.asyncio
async def test_a_pilot_ticks_off_and_signs(profile: dict[str, object]) -> None:
    async with review_app(GOOD, given=profile).run_test(size=(80, 24)) as pilot:
        await settled(pilot)
        await pilot.press("c")
        await pilot.pause()
        screen = pilot.app.screen
        assert [cells[0] for cells in rows_of(screen, "#checklist")][:3] == ["[ ]"] * 3
        who = screen.query_one("#who", Input)
        assert who.placeholder == "n to sign"
        await pilot.press("n")
        await pilot.pause()
        assert who.placeholder == "your name, then Enter"
        await pilot.press(*"Ada", "enter")
        await pilot.pause()
        assert "not ticked off" in text_of(screen, "#problem")
        await pilot.press("escape", "space", "down", "space", "down", "enter", "n", "enter")
        await pilot.pause()
        assert isinstance(pilot.app.screen, ReviewScreen)
    assert json.loads(Path(f"{GOOD}.signoff.json").read_text(encoding="utf-8"))["verdict"] == "go"
