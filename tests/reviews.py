"""Reviews of missions for tests of the terminal UI."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from textual.widgets import Input, Static

from planner.cli.configuration import mission_settings
from planner.notation import read_battery
from planner.tui.app import ReviewApp
from planner.tui.screens.missions import MissionsScreen
from planner.tui.screens.review import ReviewScreen
from planner.tui.what_if import WhatIf
from planner.tui.widgets.row_list import RowList

if TYPE_CHECKING:
    from collections.abc import Mapping

    from textual.pilot import Pilot
    from textual.screen import Screen

TOO_FAR = "crossing-too-far.plan"
SURVEY = "survey-vineyard.plan"
TOO_SMALL = {"battery": read_battery("1.3Ah@14.8V")}
"""Too small for the survey in one flight at its speed."""


def what_if_of(file: str, given: Mapping[str, object] | None = None) -> WhatIf:
    """Return the settings of a mission as the command line makes them."""
    given = given or {}
    return WhatIf(settings=mission_settings(file, given), given=given, changes={})


def review_app(
    *files: str, given: Mapping[str, object] | None = None, is_ascii: bool = False
) -> ReviewApp:
    """Return the application for some missions."""
    return ReviewApp(files or (TOO_FAR,), lambda file: what_if_of(file, given), is_ascii=is_ascii)


async def checked(pilot: Pilot[None]) -> Screen[Any]:
    """Wait until every check is done and shown; return the screen."""
    await pilot.pause()
    await pilot.app.workers.wait_for_complete()
    await pilot.pause()
    await pilot.app.workers.wait_for_complete()
    await pilot.pause()
    return pilot.app.screen


async def settled(pilot: Pilot[None]) -> ReviewScreen:
    """Wait until every check is done and shown; return the review."""
    screen = await checked(pilot)
    assert isinstance(screen, ReviewScreen)
    return screen


async def typed(pilot: Pilot[None], key: str, text: str) -> ReviewScreen:
    """Type a change, as if Enter were pressed after it, and wait until it is checked."""
    field = pilot.app.screen.query_one(f"#set-{key}", Input)
    field.focus()
    field.value = text
    await pilot.press("enter")
    return await settled(pilot)


def text_of(screen: Screen[Any], selector: str) -> str:
    """Return the text that is shown."""
    return str(screen.query_one(selector, Static).content)


def rows_of(screen: Screen[Any], selector: str) -> list[tuple[str, ...]]:
    """Return all rows of a list."""
    rows = screen.query_one(selector, RowList).rows
    return [rows.row(index)[0] for index in range(len(rows))]


async def missions_shown(pilot: Pilot[None]) -> MissionsScreen:
    """Wait until every mission of the list is checked; return the list."""
    await pilot.pause()
    await pilot.app.workers.wait_for_complete()
    await pilot.pause()
    screen = pilot.app.screen
    assert isinstance(screen, MissionsScreen)
    return screen
