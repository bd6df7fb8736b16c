"""``mavjoule segments``: the decomposition of a flight alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from planner import __version__, service
from planner.cli.configuration import mission_settings
from planner.cli.format_option import data_options
from planner.cli.options import MISSION_PATH, given_settings, setting_options
from planner.cli.output import narrate, refuse_overwriting, write_data
from planner.cli.requests import check_request
from planner.cli.settings import FLIGHT_SETTINGS
from planner.errors import ExitCode
from planner.report.columns import (
    segments_csv,
    segments_text,
)
from planner.report.json import segments_json
from planner.service import UnreadableMission

if TYPE_CHECKING:
    from pathlib import Path


@click.command("segments")
@click.argument("mission", type=MISSION_PATH)
@setting_options(FLIGHT_SETTINGS)
@data_options("text", "json", "csv")
def command(mission: str, *, file_format: str, output: Path | None, **options: object) -> ExitCode:
    """Show a flight cut into states, a row per segment.

    Nothing is judged: the exit code is 0 for every mission that can be read, and 2 otherwise.
    """
    refuse_overwriting(output, (mission,))
    settings = mission_settings(mission, given_settings(options))
    result = service.check_file(mission, check_request(settings))
    if isinstance(result, UnreadableMission):
        narrate(result.findings[0].message)
        return ExitCode.UNUSABLE
    match file_format:
        case "json":
            text = segments_json(result, version=__version__)
        case "csv":
            text = segments_csv(result)
        case _:
            text = segments_text(result)
    write_data(text, output=output)
    return ExitCode.GO
