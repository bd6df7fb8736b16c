"""Finding an item or a finding by its number, its code or a word."""

from __future__ import annotations

import pytest
from reviews import TOO_FAR, review_app, rows_of, settled, what_if_of

from planner.findings import Severity
from planner.service.preflight import CheckResult
from planner.tui.checked import checked
from planner.tui.screens.search import SearchScreen, hits
from planner.tui.widgets.panes import DetailsPane, Panes
from planner.tui.widgets.row_list import RowList

WIDE = (160, 48)


@pytest.fixture
def result() -> CheckResult:
    found = checked(TOO_FAR, what_if_of(TOO_FAR)).result
    assert isinstance(found, CheckResult)
    return found


def test_a_number_finds_the_item_and_what_was_found_about_it(result: CheckResult) -> None:
    item, *findings = hits(result, result.findings, " 5 ")
    assert item.item == 5
    assert [result.findings[hit.finding or 0].item for hit in findings] == [5]


def test_a_code_or_its_beginning_finds_findings_in_either_case(result: CheckResult) -> None:
    [one] = hits(result, result.findings, "e101")
    assert one.finding is not None
    assert result.findings[one.finding].code == "E101"
    assert one.severity is Severity.ERROR
    codes = {result.findings[hit.finding or 0].code for hit in hits(result, result.findings, "E10")}
    assert codes == {finding.code for finding in result.findings if finding.code.startswith("E10")}


def test_a_word_finds_commands_and_messages(result: CheckResult) -> None:
    assert [hit.item for hit in hits(result, result.findings, "loiter")] == [5]
    assert any(hit.finding is not None for hit in hits(result, result.findings, "reserve"))


@pytest.mark.parametrize("text", ["", "  ", "no such thing", "0", "9999999999999999999999", "²"])
def test_what_is_not_there_finds_nothing(result: CheckResult, text: str) -> None:
    assert hits(result, result.findings, text) == ()


@pytest.mark.asyncio
async def test_the_item_that_was_found_is_selected_everywhere() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        await pilot.press("slash", "7", "enter")
        await settled(pilot)
        assert screen.query_one("#items", RowList).cursor == 6
        details = screen.query_one(DetailsPane).details
        assert details is not None
        assert details.title.startswith("Item 7")
        assert (
            int(rows_of(screen, "#segments")[screen.query_one("#segments", RowList).cursor][0]) == 7
        )


@pytest.mark.asyncio
async def test_the_list_of_what_was_found_is_gone_through_by_keys() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        await pilot.press("slash", *"e1")
        await pilot.pause()
        assert isinstance(pilot.app.screen, SearchScreen)
        second = rows_of(pilot.app.screen, "#hits")[1][1].split()[0]
        await pilot.press("down", "enter")
        await settled(pilot)
        rows = screen.query_one("#findings", RowList)
        assert rows_of(screen, "#findings")[rows.cursor][1] == second


@pytest.mark.asyncio
async def test_the_map_stays_in_use_and_shows_what_was_found() -> None:
    async with review_app().run_test(size=(80, 24)) as pilot:
        screen = await settled(pilot)
        await pilot.press("3", "slash", "7", "enter")
        await settled(pilot)
        assert screen.query_one(Panes).current == "map"
        assert screen.query_one("#items", RowList).cursor == 6


@pytest.mark.asyncio
async def test_a_search_is_left_without_a_trace() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        before = screen.query_one("#items", RowList).cursor
        await pilot.press("slash", "7", "escape")
        await settled(pilot)
        assert screen.query_one("#items", RowList).cursor == before
        await pilot.press("slash", "enter", "escape")
        await settled(pilot)
