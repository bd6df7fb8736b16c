"""``mavjoule fetch``: what is on a vehicle, as files."""

from __future__ import annotations

from pathlib import Path

import click

from planner import __version__, live
from planner.cli.link_options import TransferProgress, link_options, link_request
from planner.cli.output import narrate, write_data
from planner.errors import UsageError
from planner.report.medium import Medium
from planner.report.text import finding_lines


@click.command("fetch", short_help="Read mission, parameters and state from a vehicle.")
@click.argument("url", metavar="URL")
@click.option(
    "-o",
    "--output",
    metavar="MISSION.plan",
    type=click.Path(path_type=Path),
    required=True,
    help="the plan to write: mission, fence, rally points and home",
)
@click.option(
    "--params",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="the parameter file to write [default: MISSION.params]",
)
@click.option("--force", is_flag=True, help="replace files that are there already")
@click.option(
    "--format",
    "form",
    type=click.Choice(("text", "json")),
    default="text",
    help="how to tell what was read [default: text]",
)
@link_options
def command(
    *, url: str, output: Path, params: Path | None, force: bool, form: str, **link: object
) -> None:
    """Read mission, fence, rally points, home, parameters and battery from a vehicle.

    URL is the vehicle's address as pymavlink, MAVSDK, MAVProxy or MAVROS spell it:
    udpin:0.0.0.0:14550, tcp:127.0.0.1:5760, /dev/ttyUSB0:57600.  Both files are written, or none.

    Exit codes: 0 both files are written, 2 they cannot be, 3 the vehicle did not answer, or broke
    off.
    """
    if output.suffix.lower() not in {".plan", ".json"}:
        msg = f"{output}: give a name that ends in .plan"
        raise UsageError(msg)
    params = output.with_suffix(".params") if params is None else params
    if not force:
        live.refuse_existing(output, params)
    snapshot = live.fetch_vehicle(link_request(url, link), on_progress=TransferProgress())
    live.write_snapshot(snapshot, output, params)
    for finding in (*snapshot.findings, *snapshot.mission.findings):
        for line in finding_lines(finding, file=snapshot.address, medium=Medium()):
            narrate(line)
    if form == "json":
        from planner.report.json import snapshot_json

        write_data(snapshot_json(snapshot, __version__))
    else:
        from planner.report.vehicle import snapshot_text

        write_data(snapshot_text(snapshot))
    narrate(f"the mission is in {output}, the parameters are in {params}")
