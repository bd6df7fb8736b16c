"""``mavjoule review``: the terminal UI."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import click

from planner.cli.configuration import mission_settings
from planner.cli.link import is_vehicle, link_options, link_request, taken_link
from planner.cli.options import (
    CHECK_GROUPS,
    MISSION_PATH,
    command_text,
    given_settings,
    setting_options,
)
from planner.errors import ExitCode, LinkError, UsageError

LEAST_COLUMNS, LEAST_ROWS = 60, 16
"""A smaller terminal cannot show one pane."""


@click.command("review")
@click.argument("missions", metavar="[MISSION|FOLDER|URL]...", nargs=-1, type=MISSION_PATH)
@setting_options(*CHECK_GROUPS)
@link_options
def command(missions: tuple[str, ...], **options: object) -> ExitCode:
    """Review missions on the terminal: why go or no-go, and what if.

    Without a mission, those of the current folder are offered; of several, and of a folder, a list
    with the verdict of each.  Everything it shows, mavjoule check reports too.  URL is the address of a
    vehicle, as for fetch: what is on it, its charge and home are followed, and its flight; nothing
    is ever commanded.
    """
    link = taken_link(options)
    is_live = any(is_vehicle(mission) for mission in missions)
    if is_live and len(missions) > 1:
        msg = "a vehicle is reviewed by itself: give its address alone"
        raise UsageError(msg)
    _refuse_terminal(missions)
    try:
        from planner.tui.app import ReviewApp
        from planner.tui.what_if import WhatIf
    except ImportError as error:
        if error.name is None or not error.name.startswith(("textual", "rich")):
            raise
        msg = f"the terminal UI needs textual (pip install textual); {_instead(missions)}"
        raise UsageError(msg) from error
    given = given_settings(options)

    def what_if_of(mission: str) -> WhatIf:
        file = "-" if is_live else mission
        return WhatIf(settings=mission_settings(file, given), given=given, changes={})

    for mission in (mission for mission in missions if not Path(mission).is_dir()):
        what_if_of(mission)  # a broken configuration is reported before anything is shown
    request = link_request(missions[0], link) if is_live else None
    app = ReviewApp(missions or (".",), what_if_of, link=request)
    app.run()
    if app.live is not None and app.live.snapshot is None and not app.return_code:
        msg = app.live.lost_by or f"nothing was read of {app.live.file} before it was left"
        raise LinkError(msg)
    return ExitCode.UNUSABLE if app.return_code else ExitCode.GO  # it reports no verdict


def _refuse_terminal(missions: tuple[str, ...]) -> None:
    """Raise ``UsageError`` where no terminal UI can be shown, with what to run instead."""
    size = shutil.get_terminal_size()
    streams = (sys.stdin, sys.stdout, sys.stderr)  # Textual draws on the last
    if "-" in missions:
        why = "a mission on standard input cannot be reviewed"
    elif not all(stream is not None and stream.isatty() for stream in streams):
        why = "the terminal UI needs a terminal"
    elif os.environ.get("TERM") in {"dumb", "unknown"}:
        why = f"the terminal UI cannot be shown on TERM={os.environ['TERM']}"
    elif size.columns < LEAST_COLUMNS or size.lines < LEAST_ROWS:
        why = (
            f"the terminal has {size.columns} × {size.lines} characters, the terminal UI needs "
            f"{LEAST_COLUMNS} × {LEAST_ROWS}"
        )
    else:
        return
    msg = f"{why}; {_instead(missions)}"
    raise UsageError(msg)


def _instead(missions: tuple[str, ...]) -> str:
    return f"run instead: {command_text(['mavjoule', 'check', *(missions or ('MISSION',))])}"
