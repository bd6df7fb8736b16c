"""``mavjoule split``: a mission as flights that fit."""

from __future__ import annotations

from pathlib import Path

import click

from planner import __version__, quantity
from planner.cli.configuration import files_read, mission_settings
from planner.cli.options import (
    CHECK_GROUPS,
    MISSION_PATH,
    GroupedCommand,
    format_option,
    given_settings,
    page_option,
    path_option,
    setting_options,
)
from planner.cli.output import narrate, narrate_seldom, refuse_page, standard_medium, write_data
from planner.errors import ExitCode, UsageError
from planner.mission.files import read_mission
from planner.service.preflight import bugs_of
from planner.service.split import split_under, write_split
from planner.setup import Setup


@click.command(
    "split",
    cls=GroupedCommand,
    short_help="Split a mission into flights that each fit the battery.",
)
@click.argument("mission", type=MISSION_PATH)
@path_option(
    "-o",
    "--output",
    "folder",
    metavar="DIR",
    help="where the parts are written [default: the mission's name, with -parts]",
)
@click.option("--force", is_flag=True, help="write over parts that are there already")
@setting_options(*CHECK_GROUPS)
@format_option("text", "json")
@page_option("the parts")
def command(
    mission: str,
    *,
    folder: Path | None,
    force: bool,
    file_format: str,
    report: Path | None,
    **options: object,
) -> ExitCode:
    """Split a mission into the fewest flights that each fit the battery.

    Writes part-01.plan and so on: take-off, way to where the part before ended, its legs, return.
    Speed, camera, gimbal, place to look at and outputs are set again there; triggers and video are
    stopped before the return.  Long legs are cut where that saves a flight, with an overlap where a
    camera is triggered.  Every part is checked as it is written; all are written, or none.

    Exit codes: 0 every part is a go, 1 it cannot be split, 2 unusable input, usage or configuration.
    """
    if folder is None:
        folder = Path(f"{'mission' if mission == '-' else Path(mission).stem}-parts")
    settings = mission_settings(mission, given_settings(options))
    refuse_page(report, files_read((mission,), settings), made=(folder,))
    with bugs_of(mission):
        split = split_under(
            read_mission(mission), Setup.of(settings), folder=folder, on_step=narrate_seldom()
        )
        if report in {Path(part.file) for part in split.parts}:
            msg = f"{report} is one of the parts: give another file to write to"
            raise UsageError(msg)
        write_split(split, folder, force=force)
        from planner.report.split import flights_text, split_json, split_text

        is_json = file_format == "json"
        write_data(
            split_json(split, version=__version__)
            if is_json
            else split_text(split, medium=standard_medium())
        )
        if report is not None:
            from planner.cli.check_output import write_page
            from planner.report.html.split import split_section

            results = [part.result for part in split.parts]
            write_page(
                results,
                report,
                sections=[split_section(split)],
                title=flights_text(split),
                names=[f"Part {number}" for number in range(1, len(results) + 1)],
            )
    narrate(f"{quantity.count(len(split.parts), 'part')} written to {folder}")
    return ExitCode.GO
