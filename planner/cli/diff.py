"""``mavjoule diff``: what a transfer changed or lost of a mission."""

from __future__ import annotations

import click

from planner import __version__, live
from planner.cli.link_options import TransferProgress, is_vehicle, link_options, link_request
from planner.cli.output import write_data
from planner.errors import ExitCode
from planner.mission.files import read_mission


@click.command("diff", short_help="Compare a mission with a vehicle's, or another file's.")
@click.argument("first", metavar="FILE")
@click.argument("second", metavar="URL|FILE")
@click.option(
    "--format",
    "form",
    type=click.Choice(("text", "json")),
    default="text",
    help="format of the output [default: text]",
)
@link_options
def command(*, first: str, second: str, form: str, **link: object) -> ExitCode:
    """Compare a mission with the one on a vehicle, or in another file, item by item.

    Frames that say the same count as one, places and numbers are rounded as MAVLink sends them.
    What an autopilot stores in its own way, or does not fly by, is shown and counts as the same.
    Home is left out: a vehicle has its own.

    Exit codes: 0 the same flight comes of both, 1 they differ, 2 unusable input or usage, 3 the
    vehicle did not answer, or broke off.
    """
    mission = read_mission(first)
    if is_vehicle(second):
        request = link_request(second, link)
        comparison = live.compare_with_vehicle(mission, request, on_progress=TransferProgress())
    else:
        comparison = live.compare_files(mission, read_mission(second))
    if form == "json":
        from planner.report.json import comparison_json

        write_data(comparison_json(comparison, __version__))
    else:
        from planner.report.comparison import mission_comparison_text

        write_data(mission_comparison_text(comparison))
    return ExitCode.GO if comparison.is_same else ExitCode.NO_GO
