"""``mavjoule fetch``, ``diff`` and ``logs``: what is read from a vehicle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planner import __version__
from planner.cli.link import TransferProgress, is_vehicle, link_options, link_request
from planner.cli.options import data_options, format_option, path_option
from planner.cli.output import narrate, refuse_output_file, write_data
from planner.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.logs import DownloadedLog


@click.command("fetch", short_help="Read mission, parameters and state from a vehicle.")
@click.argument("url", metavar="URL")
@path_option(
    "-o",
    "--output",
    metavar="MISSION.plan",
    required=True,
    help="the plan to write: mission, fence, rally points and home",
)
@path_option("--params", help="the parameter file to write [default: MISSION.params]")
@click.option("--force", is_flag=True, help="replace existing files")
@format_option("text", "json")
@link_options
def fetch(
    *, url: str, output: Path, params: Path | None, force: bool, file_format: str, **link: object
) -> None:
    """Read mission, fence, rally points, home, parameters and battery from a vehicle.

    URL is the vehicle's address as pymavlink, MAVSDK, MAVProxy or MAVROS spell it:
    udpin:0.0.0.0:14550, tcp:127.0.0.1:5760, /dev/ttyUSB0:57600.  Both files are written, or none.

    Exit codes: 0 both files are written, 2 they cannot be, 3 the vehicle did not answer, or broke
    off.
    """
    from planner.report.text import Medium, finding_lines
    from planner.service.vehicle import fetch_vehicle, refuse_existing, write_snapshot

    if output.suffix.lower() not in {".plan", ".json"}:
        msg = f"{output}: give a name that ends in .plan"
        raise UsageError(msg)
    params = output.with_suffix(".params") if params is None else params
    for file in (output, params):
        refuse_output_file(file, _keys(link))
    if not force:
        refuse_existing(output, params)
    snapshot = fetch_vehicle(link_request(url, link), on_progress=TransferProgress())
    write_snapshot(snapshot, output, params)
    for finding in (*snapshot.findings, *snapshot.mission.findings):
        for line in finding_lines(finding, file=snapshot.address, medium=Medium()):
            narrate(line)
    from planner.report.json import snapshot_json
    from planner.report.vehicle import snapshot_text

    is_json = file_format == "json"
    write_data(snapshot_json(snapshot, __version__) if is_json else snapshot_text(snapshot))
    narrate(f"the mission is in {output}, the parameters are in {params}")


@click.command("diff", short_help="Compare a mission with a vehicle's, or another file's.")
@click.argument("first", metavar="FILE")
@click.argument("second", metavar="URL|FILE")
@data_options("text", "json")
@link_options
def diff(
    *, first: str, second: str, file_format: str, output: Path | None, **link: object
) -> ExitCode:
    """Compare a mission with the one on a vehicle, or in another file, item by item.

    Frames that mean the same count as one, places and numbers are rounded as MAVLink sends them.
    What an autopilot stores in its own way, or does not fly by, is shown and counts as the same.
    Home is left out: a vehicle has its own.

    Exit codes: 0 the same flight comes of both, 1 they differ, 2 unusable input or usage, 3 the
    vehicle did not answer, or broke off.
    """
    from planner.mission.files import read_mission
    from planner.service.preflight import bugs_of
    from planner.service.vehicle import compare_files, compare_with_vehicle

    refuse_output_file(output, (first, second, *_keys(link)))
    with bugs_of(first):
        mission = read_mission(first)
        if is_vehicle(second):
            request = link_request(second, link)
            comparison = compare_with_vehicle(mission, request, on_progress=TransferProgress())
        else:
            comparison = compare_files(mission, read_mission(second))
        from planner.report.comparison import mission_comparison_text
        from planner.report.json import comparison_json

        is_json = file_format == "json"
        write_data(
            comparison_json(comparison, __version__)
            if is_json
            else mission_comparison_text(comparison),
            output=output,
        )
    return ExitCode.GO if comparison.is_same else ExitCode.NO_GO


@click.command("logs", short_help="List or download the flight logs of a vehicle.")
@click.argument("url", metavar="URL")
@click.argument("names", metavar="[NAME...]", nargs=-1)
@click.option("--all", "every", is_flag=True, help="download every log")
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path(),
    help="the folder to keep them in [default: the current one]",
)
@click.option("--force", is_flag=True, help="replace files of the same name")
@link_options
def logs(
    *, url: str, names: tuple[str, ...], every: bool, output: Path, force: bool, **link: object
) -> None:
    """List the flight logs of a vehicle, or download those that are named.

    They come by MAVLink's file protocol, or where the vehicle knows none, by its log protocol.
    Partial downloads stay as NAME.part and resume.  No file is replaced: a log whose name is taken
    gets a number, unless it is the very same.

    Exit codes: 0 done, 2 unusable input or usage, 3 the vehicle did not answer, or broke off.
    """
    from planner.service.vehicle import fetch_logs

    request = link_request(url, link)
    progress = TransferProgress()
    found = fetch_logs(
        request, names=names, is_all=every, folder=output, is_replacing=force, on_progress=progress
    )
    if not names and not every:
        write_data("".join(f"{log.size_bytes:>12}  {log.name}\n" for log in found.listed))
    for one in found.downloaded:
        narrate(_download_text(one))


def _keys(link: Mapping[str, Any]) -> list[str]:
    """Return the file of the key that messages are signed by, where there is one."""
    return [] if link["signing_key"] is None else [str(link["signing_key"])]


def _download_text(one: DownloadedLog) -> str:
    if one.is_confirmed:
        checked = "its checksum is the vehicle's"
    elif one.is_new:
        checked = f"all {one.log.size_bytes} bytes listed; the vehicle gives no checksum"
    else:
        checked = "the same bytes as downloaded now"
    how = "is complete" if one.is_new else "was already here"
    return f"{one.path} {how}: {checked}"
