"""``mavjoule upload``: a mission that passes its check, put on a vehicle."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from planner import quantity
from planner.cli.check_output import rendered
from planner.cli.configuration import typed_settings
from planner.cli.link import TransferProgress, link_options, link_request, taken_link
from planner.cli.options import (
    CHECK_GROUPS,
    MISSION_PATH,
    GroupedCommand,
    given_settings,
    kind_option,
    setting_options,
)
from planner.cli.output import narrate, write_data
from planner.errors import ExitCode, LinkError, UsageError
from planner.link.upload import LONGEST_S
from planner.mission.files import read_mission
from planner.report.comparison import difference_lines
from planner.service.upload import UploadOptions, send_mission
from planner.setting import Number
from planner.setup import Output, Setup

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.link.upload import UploadResult
    from planner.service.upload import UploadProposal


@click.command(
    "upload", cls=GroupedCommand, short_help="Check a mission for a vehicle and put it there."
)
@click.argument("file", metavar="FILE", type=MISSION_PATH)
@click.argument("url", metavar="URL")
@click.option(
    "--force",
    is_flag=True,
    help="send it even where it is a no-go, the vehicle armed or in the air",
)
@click.option(
    "--keep-fence",
    is_flag=True,
    help="leave the vehicle's fence and rally points where FILE has none, and check it with them",
)
@click.option("--yes", is_flag=True, help="do not ask before it is sent")
@kind_option(
    "--listen",
    Number("s", 0.0, 600.0),
    "how long to listen for the vehicle's own rejection [default: until it shows that it has taken the "
    f"mission, {LONGEST_S:g} s at most]",
    name="listen_s",
)
@setting_options(*CHECK_GROUPS)
@link_options
def command(
    *,
    file: str,
    url: str,
    force: bool,
    keep_fence: bool,
    yes: bool,
    listen_s: float | None,
    **options: object,
) -> ExitCode:
    """Check a mission for a vehicle and put it there: mission, fence and rally points.

    It is sent only where it is a go with the vehicle's own parameters, charge and home, and after
    a question, to a vehicle that is disarmed and on the ground.  A fence that only the vehicle has
    makes it a no-go.  It is read back and compared, then the vehicle is listened to.  Where the
    transfer breaks or is stopped, the old mission is put back, and what is on the vehicle is reported.

    Exit codes: 0 the mission is on the vehicle, 1 it is a no-go, the answer was no, the vehicle
    refuses it or has something else, 2 unusable input or usage, or a vehicle that is armed or in
    the air, 3 the link failed, 130 interrupted.
    """
    link = taken_link(options)
    if not (yes or _can_ask()):
        msg = "no terminal to confirm on: add --yes to send"
        raise UsageError(msg)
    values = typed_settings(file, given_settings(options), command="upload")
    setup = Setup.of(values)
    setup.require_named("upload")
    mission = read_mission(file)
    is_sending = False

    def may_send(proposal: UploadProposal) -> bool:
        nonlocal is_sending
        what = f"{quantity.count(len(mission.items), 'item')} of {file}"
        is_sending = _is_sendable(proposal, is_forced=force) and _is_confirmed(
            proposal, what, is_sure=yes
        )
        return is_sending

    with _told_if_broken_off(lambda: is_sending):
        upload = send_mission(
            mission,
            link_request(url, link),
            setup,
            may_send=may_send,
            options=UploadOptions(listen_s=listen_s, keeps_areas=keep_fence, is_forced=force),
            is_charge_given="charge" in values,
            on_progress=TransferProgress(),
        )
    if upload.result is None:
        narrate("nothing was sent")
        return ExitCode.NO_GO
    _tell(upload.result)
    took = ", ".join(
        f"{part} {quantity.decimals(span_s, 1)} s" for part, span_s in upload.spans_s.items()
    )
    narrate(f"took: {took}")
    return ExitCode.GO if upload.result.is_good else ExitCode.NO_GO


def _is_sendable(proposal: UploadProposal, *, is_forced: bool) -> bool:
    """Report the check of what is to be sent, and return whether it may be."""
    is_go = proposal.check.verdict == "go"
    exit_code = ExitCode.GO if is_go else ExitCode.NO_GO
    write_data(rendered([proposal.check], Output(), exit_code=exit_code))
    if is_forced or not proposal.objection:
        return True
    if is_go:
        narrate(f"not sent: {proposal.objection}")
    else:
        narrate("a no-go is not sent: correct the mission, or give --force")
    return False


def _is_confirmed(proposal: UploadProposal, what: str, *, is_sure: bool) -> bool:
    """Report what is lost on the vehicle, and ask whether to send."""
    vehicle = proposal.snapshot.identity.label
    if proposal.removed:
        narrate(f"will be removed from {vehicle}: {' and '.join(proposal.removed)}")
    question = f"send {what} to {vehicle}, in place of its {', '.join(proposal.replaced)}?"
    return is_sure or click.confirm(question, err=True)


def _can_ask() -> bool:
    return sys.stdin is not None and sys.stdin.isatty()


@contextmanager
def _told_if_broken_off(is_sending: Callable[[], bool]) -> Iterator[None]:
    """Tell what was sent where an upload ends early; the first Ctrl-C while it is sent does by itself."""
    try:
        yield
    except LinkError:
        if not is_sending():
            narrate("nothing was sent")
        raise
    except (KeyboardInterrupt, click.Abort):
        if sys.stderr is not None and sys.stderr.isatty():
            click.echo(err=True)  # after the question, or the progress
        if is_sending():
            narrate(
                "interrupted: compare what is on the vehicle by mavjoule diff before anyone arms"
            )
        else:
            narrate("interrupted: nothing was sent")
        raise


def _tell(result: UploadResult) -> None:
    for line in difference_lines(result.differences):
        narrate(line)
    for report in result.texts:
        narrate(f"the vehicle reports: {report.text}")
    if result.rejection:
        narrate(f"rejected: {result.rejection}")
    if result.is_unjudged:
        narrate("the vehicle has no position yet: it reports later whether it flies the mission")
    if result.is_good:
        narrate("the mission is on the vehicle, read back and compared")
    elif result.restored:
        narrate("the old mission is on the vehicle again, read back and compared")
    elif result.restored is False:
        narrate("what is on the vehicle is neither the new nor the old mission: do not arm it")
    else:
        narrate("the mission is on the vehicle, which will not fly it")
