"""``mavjoule logs``: the flight logs of a vehicle."""

from __future__ import annotations

from pathlib import Path

import click

from planner import live
from planner.cli.link_options import TransferProgress, link_options, link_request
from planner.cli.output import narrate, write_data


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
@link_options
def command(*, url: str, names: tuple[str, ...], every: bool, output: Path, **link: object) -> None:
    """List the flight logs of a vehicle, or download those that are named.

    They come by MAVLink's file protocol, or where the vehicle knows none, by its log protocol.  A
    download that broke off goes on where it ended: what is not whole is kept as NAME.part.

    Exit codes: 0 done, 2 unusable input or usage, 3 the vehicle did not answer, or broke off.
    """
    request = link_request(url, link)
    progress = TransferProgress()
    found = live.fetch_logs(request, names=names, is_all=every, folder=output, on_progress=progress)
    if not names and not every:
        write_data("".join(f"{log.size_bytes:>12}  {log.name}\n" for log in found.listed))
    for path in found.downloaded:
        narrate(f"{path} is whole")
