"""``mavjoule review``: the terminal UI."""

from __future__ import annotations

import os
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from planner.cli.configuration import mission_settings
from planner.cli.link import is_vehicle, link_options, link_request, taken_link
from planner.cli.options import (
    CHECK_GROUPS,
    MISSION_PATH,
    GroupedCommand,
    command_text,
    given_settings,
    option_words,
    setting_options,
)
from planner.cli.terminal import end_with_terminal, shows_braille, why_unusable
from planner.errors import ExitCode, LinkError, UsageError
from planner.setup import settings

if TYPE_CHECKING:
    from collections.abc import Mapping


@click.command("review", cls=GroupedCommand)
@click.argument(
    "missions", metavar="[MISSION|FLEET.toml|FOLDER|URL]...", nargs=-1, type=MISSION_PATH
)
@setting_options(*CHECK_GROUPS)
@link_options
@click.option(
    "--ascii/--no-ascii",
    "is_ascii",
    default=None,
    help="draw with ASCII characters [default: where locale or TERM shows no Braille]",
)
def command(missions: tuple[str, ...], *, is_ascii: bool | None, **options: object) -> ExitCode:
    """Review missions on the terminal: why go or no-go, and what if.

    Without a mission, those of the current folder are offered; of several, and of a folder, a list
    with the verdict of each.  Everything it shows, mavjoule check reports too.  URL is the address of a
    vehicle, as for fetch: what is on it, its charge and home are followed, and its flight; nothing
    is ever commanded.  A fleet file is moved in time: timeline, map, vehicles and findings.
    """
    link = taken_link(options)
    is_live = any(is_vehicle(mission) for mission in missions)
    if is_live and len(missions) > 1:
        msg = "a vehicle is reviewed by itself: give its address alone"
        raise UsageError(msg)
    _refuse_terminal(missions, options)
    end_with_terminal()
    try:
        from planner.tui.app import ReviewApp
        from planner.tui.what_if import WhatIf
    except ImportError as error:
        if error.name is None or not error.name.startswith(("textual", "rich")):
            raise
        msg = f"the terminal UI needs textual (pip install textual); {_instead(missions, options)}"
        raise UsageError(msg) from error
    given = given_settings(options)
    _refuse_settings_of_fleets(missions, given)

    def what_if_of(mission: str) -> WhatIf:
        file = "-" if is_live else mission
        return WhatIf(settings=mission_settings(file, given), given=given, changes={})

    for mission in (mission for mission in missions if not Path(mission).is_dir()):
        what_if_of(mission)  # a broken configuration is reported before anything is shown
    request = link_request(missions[0], link) if is_live else None
    if is_ascii is None:
        is_ascii = not shows_braille(os.environ)
    app = ReviewApp(missions or (".",), what_if_of, link=request, is_ascii=is_ascii)
    app.run()
    if app.return_code == ExitCode.INTERRUPTED:
        return ExitCode.INTERRUPTED
    if app.live is not None and app.live.snapshot is None and not app.return_code:
        msg = app.live.lost_by or f"nothing was read of {app.live.file} before it was left"
        raise LinkError(msg)
    return ExitCode.UNUSABLE if app.return_code else ExitCode.GO  # it reports no verdict


def _refuse_terminal(missions: tuple[str, ...], options: Mapping[str, object]) -> None:
    """Raise ``UsageError`` where no terminal UI can be shown, with what to run instead."""
    why = "a mission on standard input cannot be reviewed" if "-" in missions else why_unusable()
    if why:
        msg = f"{why}; {_instead(missions, options)}"
        raise UsageError(msg)


def _is_fleet(mission: str) -> bool:
    return Path(mission).suffix.lower() == ".toml"


def _refuse_settings_of_fleets(missions: tuple[str, ...], given: Mapping[str, object]) -> None:
    """Raise ``UsageError`` where an option is given that each vehicle of a fleet has of its own."""
    from planner.fleet.reader import condition_settings

    fleets = [mission for mission in missions if _is_fleet(mission)]
    own = [key for key in given if key not in condition_settings()]
    if fleets and own:
        msg = f"{settings()[own[0]].option} is not for a fleet: {fleets[0]} says it of each vehicle"
        raise UsageError(msg)


def _instead(missions: tuple[str, ...], options: Mapping[str, object]) -> str:
    command = ["fleet", "check"] if missions and all(map(_is_fleet, missions)) else ["check"]
    given = (option_words(key, value) for key, value in given_settings(options).items())
    words = ["mavjoule", *command, *(missions or ("MISSION",)), *chain.from_iterable(given)]
    return f"run instead: {command_text(words)}"
