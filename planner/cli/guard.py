"""``mavjoule guard``: watch a vehicle, and answer whether it may arm."""

from __future__ import annotations

import re
import shutil
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import click

from planner import __version__
from planner.cli.configuration import files_read, typed_settings
from planner.cli.link import link_options, link_request, taken_link
from planner.cli.options import (
    CHECK_GROUPS,
    GroupedCommand,
    given_settings,
    kind_option,
    path_option,
    setting_options,
)
from planner.cli.output import StatusLine, narrate, refuse_input_file
from planner.errors import OutputError
from planner.files import append_output
from planner.guard.decision import GuardSettings
from planner.quantity import NUMBER
from planner.report.json import decision_json
from planner.report.text import printable
from planner.report.vehicle import decision_text, status_line
from planner.service.guard import GuardRequest, guard_vehicle
from planner.setting import Choice, Number
from planner.setup import Setup

if TYPE_CHECKING:
    from pathlib import Path

    from planner.guard.decision import Decision
    from planner.guard.session import GuardStatus

_UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
_LONGEST_S = 86_400.0
_PLAIN_EVERY_S = 10
"""So often the energy in flight is reported where there is no terminal. [s]"""


class Duration(Number):
    """A duration: ``60s``, ``2min``, ``1h``; seconds where no unit is given."""

    def __init__(self, *, least_s: float = 0.0) -> None:
        super().__init__("s", least_s, _LONGEST_S)
        self.metavar = "TIME"

    def read_one(self, text: str) -> float:
        """Return the seconds."""
        found = re.fullmatch(rf"{NUMBER}\s*(s|min|h)?", text.strip(), re.IGNORECASE)
        if found is None:
            msg = f"expected a duration, such as 60s, 2min or 1h, got {text!r}"
            raise ValueError(msg)
        return float(found[1]) * _UNITS_S[(found[2] or "s").lower()]

    def write_one(self, value: float) -> str:
        """Return the seconds as text."""
        return f"{value:g}s"


_DEFAULTS = GuardSettings()


@click.command(
    "guard", cls=GroupedCommand, short_help="Watch a vehicle and answer its requests to arm."
)
@click.argument("url", metavar="URL")
@setting_options(*CHECK_GROUPS)
@kind_option(
    "--valid-for",
    Duration(least_s=1.0),
    "how long an acceptance holds; PX4 does not ask again until then [default: for the arming that asked, "
    "and 5 s where the pilot has to arm twice, COM_ARM_AUTH_MET 1]",
)
@kind_option(
    "--confirm-within",
    Duration(),
    "accept on what was read so shortly before the request, for radios too slow to be asked after it",
    default=_DEFAULTS.confirmed_s,
)
@kind_option(
    "--reread",
    Duration(least_s=1.0),
    "how often to read again what gave no sign of a change",
    default=_DEFAULTS.oldest_s,
)
@kind_option(
    "--warn-before",
    Duration(),
    "in flight, warn so long before the point of no return",
    default=_DEFAULTS.warn_before_s,
)
@kind_option(
    "--lost-after",
    Duration(least_s=1.0),
    "the link has failed when nothing is heard for so long",
    default=_DEFAULTS.lost_after_s,
)
@click.option("--keep", is_flag=True, help="wait for a vehicle that is lost, instead of ending")
@kind_option(
    "--authoriser",
    Choice({"messages": "messages", "mavsdk": "mavsdk"}),
    "who answers requests: own messages, or MAVSDK's server",
    default="messages",
)
@path_option("--log", help="append every decision to a file, as JSON lines")
@link_options
def command(
    *,
    url: str,
    valid_for: float | None,
    confirm_within: float,
    reread: float,
    warn_before: float,
    lost_after: float,
    keep: bool,
    log: Path | None,
    **options: object,
) -> None:
    """Watch a vehicle and answer its arm-authorisation requests with the verdict.

    URL is the vehicle's address, as for fetch.  Mission, fence, rally points, parameters, home and
    charge are followed and checked whenever they change.  PX4 asks before it arms with
    COM_ARM_AUTH_REQ 1 and COM_ARM_AUTH_ID 245; a vehicle that does not ask is sent the verdict in
    status texts.  In flight the measured energy is held against finishing and returning.
    Nothing is ever commanded.

    Exit codes: 2 unusable usage or configuration, 3 the vehicle was lost, 130 interrupted.
    """
    link = taken_link(options)
    values = typed_settings("-", given_settings(options), command="guard")
    setup = Setup.of(values)
    setup.require_named("guard")
    if log is not None:
        key = link["signing_key"]
        read = files_read(("-",), values)
        refuse_input_file(log, read if key is None else [*read, str(key)])
    request = link_request(url, link)
    show = GuardDisplay()
    journal = None if log is None else DecisionLog(log, address=request.address.text)

    def on_decision(decision: Decision) -> None:
        show.decision(decision)
        if journal is not None:
            journal.add(decision)

    guard_vehicle(
        request,
        setup,
        GuardRequest(
            settings=GuardSettings(
                valid_for_s=None if valid_for is None else int(valid_for),
                confirmed_s=confirm_within,
                oldest_s=reread,
                lost_after_s=lost_after,
                warn_before_s=warn_before,
            ),
            is_charge_given="charge" in values,
            uses_mavsdk=options["authoriser"] == "mavsdk",
            keeps_waiting=keep,
        ),
        on_decision=on_decision,
        on_status=show.status,
        on_lost=show.lost,
    )


class DecisionLog:
    """A file that decisions are appended to, a line each, whole or not at all.

    Raises OutputError if it cannot be written to.
    """

    def __init__(self, path: Path, *, address: str) -> None:
        self._path = path
        self._address = address
        self._is_broken = False
        try:
            with path.open("ab"):
                pass
        except OSError as error:
            msg = f"{path}: cannot be written: {error.strerror or error}"
            raise OutputError(msg) from error

    def add(self, decision: Decision) -> None:
        """Append a decision; a full disk is reported once, and guarding continues."""
        line = decision_json(
            decision, address=self._address, at=datetime.now(UTC), version=__version__
        )
        try:
            append_output(self._path, line)
        except OSError as error:
            if not self._is_broken:
                narrate(f"{self._path}: cannot be written: {error.strerror or error}")
            self._is_broken = True


class GuardDisplay(StatusLine):
    """The status on standard error: one line that changes on a terminal, else a line per change."""

    def __init__(self) -> None:
        super().__init__()
        self._in_flight_s = 0

    def status(self, status: GuardStatus) -> None:
        """Show the status, once a second."""
        if self.is_terminal:
            width = shutil.get_terminal_size().columns - 1
            self.show(printable(status_line(status))[:width])
            return
        if status.is_flying and self._in_flight_s % _PLAIN_EVERY_S == 0:
            narrate(status_line(status))
        self._in_flight_s = self._in_flight_s + 1 if status.is_flying else 0

    def decision(self, decision: Decision) -> None:
        """Report a decision."""
        self.narrate(decision_text(decision))

    def lost(self, why: str) -> None:
        """Report that the vehicle is waited for."""
        self.narrate(f"{why}; waiting for it")
