"""``mavjoule logs``: the flight logs of a vehicle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from planner import live
from planner.cli.link_options import TransferProgress, link_options, link_request
from planner.cli.output import narrate, write_data

if TYPE_CHECKING:
    from planner.link.logs import DownloadedLog


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
def command(
    *,
    url: str,
    names: tuple[str, ...],
    every: bool,
    output: Path,
    force: bool,
    **link: object,
) -> None:
    """List the flight logs of a vehicle, or download those that are named.

    They come by MAVLink's file protocol, or where the vehicle knows none, by its log protocol.  A
    download that broke off goes on where it ended: what is not whole is kept as NAME.part.  No file is
    replaced: a log of a name that is taken gets a number, unless it is the very same.

    Exit codes: 0 done, 2 unusable input or usage, 3 the vehicle did not answer, or broke off.
    """
    request = link_request(url, link)
    progress = TransferProgress()
    found = live.fetch_logs(
        request,
        names=names,
        is_all=every,
        folder=output,
        is_replacing=force,
        on_progress=progress,
    )
    if not names and not every:
        write_data("".join(f"{log.size_bytes:>12}  {log.name}\n" for log in found.listed))
    for one in found.downloaded:
        narrate(_told(one))


def _told(one: DownloadedLog) -> str:
    if one.is_confirmed:
        checked = "it has the checksum that the vehicle tells"
    elif one.is_new:
        checked = f"all {one.log.size_bytes} bytes of its list came; its checksum is not known"
    else:
        checked = "byte by byte what was downloaded now"
    how = "is whole" if one.is_new else "was there already"
    return f"{one.path} {how}: {checked}"
