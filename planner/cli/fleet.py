"""``mavjoule fleet``: several vehicles, packs and jobs, judged together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from planner import __version__
from planner.cli.options import MISSION_PATH, data_options, given_settings, setting_options
from planner.cli.output import (
    narrate,
    refuse_overwriting,
    show_traceback,
    standard_medium,
    write_data,
)
from planner.errors import ExitCode, FleetFileError
from planner.setting import Group

if TYPE_CHECKING:
    from pathlib import Path

_OF_VEHICLES = (
    "vehicle",
    "params",
    "autopilot",
    "target",
    "home_amsl_m",
    "payload_kg",
    "per_file_ignores",
)
"""Settings that each vehicle, pad and job has of its own."""


@click.group("fleet", short_help="Judge several vehicles, packs and jobs together.")
def command() -> None:
    """Judge several vehicles, packs and jobs together."""


@command.command("check", short_help="Judge a whole fleet: go or no-go.")
@click.argument("fleet", metavar="FLEET.toml", type=MISSION_PATH)
@setting_options(Group.FLIGHT, Group.JUDGEMENT, without=_OF_VEHICLES)
@data_options("text", "json")
@click.option("--exit-zero", is_flag=True, help="exit with 0 even where the fleet is a no-go")
def check(
    fleet: str, *, file_format: str, output: Path | None, exit_zero: bool, **options: object
) -> ExitCode:
    """Judge a whole fleet: go or no-go.

    Every sortie of FLEET.toml is checked as mavjoule check does, on its vehicle, pack, payload and
    weather; then packs, chargers, pads and times that clash, and how far all keep apart: in the air,
    on the ground and on every return.  The keys of the file are in missions/README.md; options count
    before what it says of every vehicle.

    Exit codes: 0 the fleet is a go, 1 a no-go, 2 a file, usage or configuration is unusable.
    """
    from planner.fleet.reader import read_fleet
    from planner.report.fleet import fleet_json, fleet_text
    from planner.service.fleet import check_fleet

    refuse_overwriting(output, (fleet,))
    try:
        read = read_fleet(fleet, given=given_settings(options))
    except FleetFileError as error:
        for problem in error.problems:
            narrate(problem)
        return ExitCode.UNUSABLE
    result = check_fleet(read)
    for one in result.sorties:
        show_traceback(getattr(one.result, "failure", ""))
    is_json = file_format == "json"
    write_data(
        fleet_json(result, version=__version__)
        if is_json
        else fleet_text(result, medium=standard_medium(output)),
        output=output,
    )
    if not result.is_readable:
        return ExitCode.UNUSABLE
    return ExitCode.GO if result.verdict == "go" or exit_zero else ExitCode.NO_GO
