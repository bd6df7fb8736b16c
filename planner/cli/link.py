"""``mavjoule fetch``, ``diff`` and ``logs``; and the options of every command that speaks to a vehicle."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planner import __version__
from planner.cli.options import data_options, format_option, kind_option, path_option
from planner.cli.output import StatusLine, narrate, refuse_output_file, write_data
from planner.errors import ExitCode, UsageError
from planner.setting import Number

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.link.logs import DownloadedLog
    from planner.link.vehicle import LinkRequest

_SYSTEM_ID = click.IntRange(1, 255)
LINK_OPTIONS: dict[str, Callable[[Callable[..., Any]], Callable[..., Any]]] = {
    "baud": click.option(
        "--baud",
        metavar="BD",
        type=click.IntRange(300, 20_000_000),
        help="speed of a serial line whose address names none [default: 57600]",
    ),
    "system_id": click.option(
        "--system-id",
        metavar="N",
        type=_SYSTEM_ID,
        help="the vehicle to speak to [default: the only one on the line]",
    ),
    "own_system_id": click.option(
        "--own-system-id",
        metavar="N",
        type=_SYSTEM_ID,
        default=245,
        help="system id of this program; the vehicle's COM_ARM_AUTH_ID for a guard [default: 245]",
    ),
    "signing_key": path_option(
        "--signing-key",
        help="sign all messages, and take none that is not signed, by the key in a file that only you may "
        "read: 32 bytes or 64 hexadecimal digits; a passphrase's is its SHA-256 [default: unsigned]",
    ),
    "heartbeat_timeout": kind_option(
        "--heartbeat-timeout",
        Number("s", 0.0, 3600.0, is_open=True),
        "how long to wait for the vehicle",
        default=10.0,
    ),
    "reply_timeout": kind_option(
        "--reply-timeout",
        Number("s", 0.0, 600.0, is_open=True),
        "longest wait until a request is repeated, longer for slow radios",
        default=1.5,
    ),
    "retries": click.option(
        "--retries",
        metavar="N",
        type=click.IntRange(0, 1000),
        default=12,
        help="how often a request is repeated until the transfer counts as stalled [default: 12]",
    ),
}
"""By the names of their parameters."""
_SILENCE_S = 5.0
"""Where there is no terminal, progress is reported so often. [s]"""


def link_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the link to a command."""
    for option in reversed(LINK_OPTIONS.values()):
        command = option(command)
    return command


def taken_link(options: dict[str, Any]) -> dict[str, Any]:
    """Take the options of the link out of those of a command."""
    return {key: options.pop(key) for key in LINK_OPTIONS}


def is_vehicle(name: str) -> bool:
    """Return whether an argument names a vehicle on the line, and no file."""
    if not (":" in name or name.startswith("/dev/") or name.upper().startswith("COM")):
        return False  # a file's name in nearly every check: nothing of the link is imported
    from planner.link.address import is_address

    return is_address(name)


def link_request(url: str, options: Mapping[str, Any]) -> LinkRequest:
    """Return the request that the options of the link make; report the normalised address.

    Raises UsageError if the address is none.
    """
    from planner.link.address import read_address
    from planner.link.transfers import LinkSettings
    from planner.link.vehicle import LinkRequest

    address = read_address(url, baud=options["baud"])
    narrate(f"connecting to {address.text}")
    return LinkRequest(
        address=address,
        settings=LinkSettings(
            heartbeat_timeout_s=options["heartbeat_timeout"],
            reply_timeout_s=options["reply_timeout"],
            shortest_timeout_s=min(options["reply_timeout"], 0.1),
            retries=options["retries"],
        ),
        system=options["system_id"],
        own_system=options["own_system_id"],
        signing_key=options["signing_key"],
    )


class TransferProgress(StatusLine):
    """Reports on standard error how far a transfer is: item by item on a terminal, else periodically."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._now_s = now_s
        self._reported_s = now_s()
        self._done: set[str] = set()

    def __call__(self, what: str, done: int, count: int | None) -> None:
        """Take how much of what is done."""
        if what in self._done:
            return
        if count is not None and done >= count:
            self._done.add(what)
            self.narrate(f"{what}: {count} of {count}" if count else f"{what}: none")
            self._reported_s = self._now_s()
            return
        text = f"waiting for {what}" if count is None else f"{what}: {done} of {count}"
        self.show(text)
        if not self.is_terminal and self._now_s() - self._reported_s >= _SILENCE_S:
            self.narrate(text)
            self._reported_s = self._now_s()


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

    refuse_output_file(output, (first, second))
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


def _download_text(one: DownloadedLog) -> str:
    if one.is_confirmed:
        checked = "its checksum is the vehicle's"
    elif one.is_new:
        checked = f"all {one.log.size_bytes} bytes listed; the vehicle gives no checksum"
    else:
        checked = "the same bytes as downloaded now"
    how = "is complete" if one.is_new else "was already here"
    return f"{one.path} {how}: {checked}"
