"""The list of missions: verdicts in the background, a preview, ways in and out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from reviews import SURVEY, TOO_FAR, missions_shown, review_app, rows_of, settled, text_of
from textual.containers import VerticalScroll

from planner.service.preflight import check_file
from planner.tui.screens.missions import MissionsScreen
from planner.tui.screens.review import ReviewScreen
from planner.tui.widgets.panes import DetailsPane

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult, UnreadableMission
    from planner.setup import Setup

pytestmark = pytest.mark.asyncio


async def test_a_folder_shows_its_missions_with_their_verdicts() -> None:
    async with review_app(".").run_test(size=(100, 30)) as pilot:
        screen = await missions_shown(pilot)
        verdicts = {cells[1]: cells[2] for cells in rows_of(screen, "#missions")}
        assert verdicts == {
            "crossing-too-far.plan": "NO-GO",
            "delivery-fjord.waypoints": "GO",
            "inspection-pylon.plan": "GO",
            "survey-vineyard.plan": "GO",
            "../": "",
        }
        details = screen.query_one(DetailsPane).details
        assert details is not None
        assert any("E102" in text for _, text in details.parts)


async def test_a_mission_is_opened_and_left_again() -> None:
    async with review_app("survey-vineyard.plan", "inspection-pylon.plan").run_test() as pilot:
        await missions_shown(pilot)
        await pilot.press("down", "enter")
        review = await settled(pilot)
        assert review.file == "inspection-pylon.plan"
        await pilot.press("m")
        await pilot.pause()
        assert isinstance(pilot.app.screen, MissionsScreen)


async def test_from_a_single_mission_the_list_of_its_folder_opens() -> None:
    async with review_app("survey-vineyard.plan").run_test() as pilot:
        await settled(pilot)
        await pilot.press("m")
        screen = await missions_shown(pilot)
        assert len(rows_of(screen, "#missions")) == 5


async def test_what_cannot_be_checked_is_no_go_in_words() -> None:
    Path("broken.plan").write_text("{", encoding="utf-8")
    Path("sub").mkdir()
    Path("sub/mavjoule.toml").write_text("nonsense = 1", encoding="utf-8")
    Path("sub/one.plan").write_bytes(Path("survey-vineyard.plan").read_bytes())
    async with review_app("broken.plan", "sub/one.plan").run_test(size=(100, 30)) as pilot:
        screen = await missions_shown(pilot)
        [broken, misconfigured] = rows_of(screen, "#missions")
        assert (broken[0], broken[2]) == ("–", "NOT CHECKED")
        assert misconfigured[2] == "NO-GO"
        assert "nonsense" in misconfigured[3]
        await pilot.press("down", "enter")
        await pilot.pause()
        assert isinstance(pilot.app.screen, MissionsScreen)


async def test_a_folder_is_entered_and_left() -> None:
    Path("sub").mkdir()
    Path("sub/one.plan").write_bytes(Path("survey-vineyard.plan").read_bytes())
    async with review_app(".").run_test() as pilot:
        screen = await missions_shown(pilot)
        await pilot.press("end", "up", "enter")
        await missions_shown(pilot)
        assert [cells[1] for cells in rows_of(screen, "#missions")] == ["one.plan", "../"]
        await pilot.press("backspace")
        await missions_shown(pilot)
        assert len(rows_of(screen, "#missions")) == 6


async def test_a_review_names_the_mission_it_was_opened_for() -> None:
    async with review_app(".").run_test() as pilot:
        await missions_shown(pilot)
        await pilot.press("enter")
        review = await settled(pilot)
        assert isinstance(review, ReviewScreen)
        assert review.file.endswith("crossing-too-far.plan")


async def test_a_bug_of_ours_is_told_of_its_mission_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail_once(file: str, setup: Setup) -> CheckResult | UnreadableMission:
        if file == TOO_FAR:
            raise IndexError
        return check_file(file, setup)

    monkeypatch.setattr("planner.tui.screens.missions.check_file", fail_once)
    async with review_app(TOO_FAR, SURVEY).run_test(size=(100, 30)) as pilot:
        screen = await missions_shown(pilot)
        [wrong, right] = rows_of(screen, "#missions")
        assert wrong[2] == "NO-GO"
        assert "this is a bug in mavjoule" in wrong[3]
        assert right[2] == "GO"


async def test_the_help_fits_a_small_terminal_and_escape_leaves_it() -> None:
    async with review_app(".").run_test(size=(60, 16)) as pilot:
        screen = await missions_shown(pilot)
        await pilot.press("question_mark")
        await pilot.pause()
        page = pilot.app.screen.query_one(VerticalScroll)
        assert page.border_title == "Help: Missions"
        assert "Folder up" in text_of(pilot.app.screen, "#help")
        assert page.region.width <= 60
        assert page.region.height <= 16
        await pilot.press("escape")
        await pilot.pause()
        assert pilot.app.screen is screen


async def test_escape_goes_back_to_the_folder_a_folder_was_entered_from() -> None:
    Path("inner").mkdir()
    async with review_app(".").run_test(size=(80, 24)) as pilot:
        screen = await missions_shown(pilot)
        rows = rows_of(screen, "#missions")
        await pilot.press("home", *["down"] * [row[1] for row in rows].index("inner/"), "enter")
        await missions_shown(pilot)
        assert rows_of(screen, "#missions") != rows
        await pilot.press("escape")
        await missions_shown(pilot)
        assert [row[1] for row in rows_of(screen, "#missions")] == [row[1] for row in rows]
