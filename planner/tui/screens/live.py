"""The review of what a vehicle on the link holds, kept up to date."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from textual.widgets import Static

from planner import quantity
from planner.errors import ExitCode, MavjouleError
from planner.findings import Severity
from planner.guard.authorisation import Verdict
from planner.report.text import margin_text, printable
from planner.report.vehicle import LATE_S
from planner.tui.checked import checked
from planner.tui.details import Summary
from planner.tui.screens.review import ReviewScreen
from planner.tui.widgets.bars import VerdictStrip
from planner.tui.widgets.ground_map import GroundMap
from planner.tui.widgets.panes import Panes
from planner.tui.widgets.profile_plot import ProfilePlot
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from textual.app import ComposeResult

    from planner.findings import Finding
    from planner.guard.session import GuardStatus
    from planner.link.snapshot import VehicleSnapshot
    from planner.link.vehicle import LinkRequest
    from planner.tui.checked import Checked
    from planner.tui.what_if import WhatIf


def live_line(address: str, status: GuardStatus) -> str:
    """Return ``live udpin:…: battery 78 %, 14.9 V, in flight, item 5, 3 min 12 s into the flight, …``."""
    return f"live {address}: {', '.join(_status_parts(status))}"


def _status_parts(status: GuardStatus) -> Iterator[str]:
    if status.heard_ago_s > LATE_S:
        yield f"NO SIGNAL for {quantity.duration(status.heard_ago_s)}"
    battery = status.state.battery
    charge = None if battery is None else battery.remaining_fraction
    voltage_v = None if battery is None else battery.voltage_v
    yield "battery unknown" if charge is None else f"battery {quantity.percent(charge)}"
    if voltage_v is not None:
        yield quantity.voltage(voltage_v)
    if not status.is_flying:
        if status.state.home is None:
            yield "home unknown"
        yield "armed" if status.is_armed else "on the ground"
        return
    yield "in flight"
    if status.state.position is not None:
        yield f"{quantity.height(status.state.position.height_above_home_m)} above home"
    energy = status.energy
    if energy is None:
        yield "energy not measured"
        return
    yield f"item {energy.progress.item}"
    yield f"{quantity.duration(energy.progress.time_s)} into the flight"
    yield f"{quantity.energy(energy.left.energy_wh)} left"
    yield f"at landing {margin_text(energy.finish_margin_wh, 'the reserve')}"
    yield f"returning now {margin_text(energy.return_margin_wh, 'the reserve')}"
    if energy.lead_s is not None:
        yield f"point of no return in {quantity.duration(energy.lead_s)}"


_STALE_S = 5.0
"""A verdict is unknown after so long without a report. [s]"""


class LiveScreen(ReviewScreen):
    """One look at one vehicle: its mission, battery and home as they change."""

    def __init__(self, link: LinkRequest, what_if_of: Callable[[str], WhatIf]) -> None:
        super().__init__(link.address.text, what_if_of)
        self.link = link
        self.snapshot: VehicleSnapshot | None = None
        """What was read of the vehicle last."""
        self.lost_by = ""
        """Why the vehicle was lost last; empty where it never was."""
        self._unheard = ""
        """Why there is no verdict of the vehicle as it is now; empty where there is one."""
        self._is_over = threading.Event()
        self._received_s: float | None = None
        self._in_flight: tuple[Finding, ...] = ()

    def compose(self) -> ComposeResult:
        """Yield the line about the vehicle above the panes."""
        yield Static(f"live {self.file}: waiting for the vehicle", id="live", markup=False)
        yield from super().compose()

    def on_mount(self) -> None:
        """Begin to watch; a thread that ends with the program, so that nothing waits for a link."""
        self.show_verdict()
        threading.Thread(target=self._watch, name="live vehicle", daemon=True).start()

    def on_unmount(self) -> None:
        """End the watching."""
        self._is_over.set()

    def _watch(self) -> None:
        from planner.service.guard import watch_vehicle

        base = self.what_if.with_changes({})
        try:
            watch_vehicle(
                self.link,
                base.setup(),
                is_over=self._is_over,
                watcher=self,
                is_charge_given="charge" in base.values(),
            )
        except BaseException as error:  # noqa: BLE001 - raised again where it ends the program
            self.call_later(self._break, error)

    # What the thread reports

    def progress(self, what: str, done: int, count: int | None) -> None:
        """Show how far a reading is."""
        text = f"waiting for {what}" if count is None else f"reading {what}, {done} of {count}"
        self.call_later(self._say, text)

    def received(self, snapshot: VehicleSnapshot) -> None:
        """Check everything that was read, or some of it again."""
        self.call_later(self._take_snapshot, snapshot)

    def reported(self, status: GuardStatus) -> None:
        """Show what holds, every second."""
        self.call_later(self._take_status, status)

    def lost(self, why: str) -> None:
        """Show why the vehicle is waited for."""
        self.call_later(self._take_loss, why)

    def _take_snapshot(self, snapshot: VehicleSnapshot) -> None:
        self.snapshot, self.base = snapshot, None
        self.action_recheck()

    def _take_status(self, status: GuardStatus) -> None:
        self._received_s = time.monotonic()
        self.query_one("#live", Static).update(live_line(self.file, status))
        is_unknown = status.view.verdict is Verdict.UNKNOWN
        self._set_unknown(status.view.text if is_unknown else "")
        in_flight = status.energy if status.is_flying else None
        if (found := () if in_flight is None else in_flight.findings) != self._in_flight:
            self._in_flight = found
            self.query_one(Panes).show_urgent(found)
            self.show_verdict()
        position, energy = status.state.position, status.energy
        ground = None if self.now is None else self.now.ground
        self.query_one(GroundMap).show_vehicle(
            None
            if position is None or ground is None
            else ground.at_m(position.latitude_deg, position.longitude_deg)
        )
        self.query_one(ProfilePlot).show_vehicle(None if energy is None else energy.progress.time_s)

    def _take_loss(self, why: str) -> None:
        self.lost_by = why
        self._say(f"LOST, trying again: {why}")
        self._set_unknown("link to the vehicle lost")

    def _break(self, error: BaseException) -> None:
        if not isinstance(error, MavjouleError):
            raise error
        self.app.exit(return_code=ExitCode.UNUSABLE, message=f"mavjoule: {error}")

    def _say(self, text: str) -> None:
        self.query_one("#live", Static).update(f"live {self.file}: {text}")

    def _set_unknown(self, why: str) -> None:
        if why != self._unheard:
            self._unheard = why
            self.show_verdict()

    def show_verdict(self, *notes: str) -> None:
        """Show the verdict; that there is none as long as nothing was read and checked."""
        if self.now is not None:
            super().show_verdict(*notes)
            return
        unread = "vehicle not read yet" if self.snapshot is None else self.unknown()
        none = Summary(
            verdict="NO VERDICT",
            is_go=False,
            file=printable(self.file),
            headline=self._unheard or unread,
            return_plan="",
            closing="",
        )
        self.query_one("#verdict", VerdictStrip).show(none, note="; ".join(notes))

    def command_line(self) -> str:
        """Return the command that says the same of the vehicle."""
        return self.what_if.command_line(self.file)

    def summary(self, now: Checked) -> Summary:
        """Return the summary at the top: no go where the energy in flight does not do."""
        brief = super().summary(now)
        short = [one for one in self._in_flight if one.severity is Severity.ERROR]
        if not short or self.unknown():
            return brief
        headline = f"In flight: {short[0].message}"
        return replace(brief, verdict="NO-GO", is_go=False, headline=headline)

    def unknown(self) -> str:
        """Return why what was read last may hold no longer."""
        if self.now is not None and self.now.snapshot is not self.snapshot:
            return self._unheard or super().unknown() or "checking the change"
        return self._unheard or super().unknown()

    def checked(self, what_if: WhatIf) -> Checked:
        """Return what the vehicle held when it was read last, checked."""
        assert self.snapshot is not None  # nothing is asked for before
        return checked(self.snapshot, what_if)

    def ask(self, base: Checked | None) -> None:
        """Ask for a check of what was read last, if anything was."""
        if self.snapshot is not None:
            super().ask(base)

    def watch_files(self) -> None:
        """Look at whether the vehicle still reports, and at the files."""
        if self._received_s is not None and time.monotonic() - self._received_s > _STALE_S:
            self._set_unknown(f"no report from the vehicle for {_STALE_S:.0f} s")
        super().watch_files()

    def action_missions(self) -> None:
        """Say that a vehicle has no list of missions."""
        self.notify("a vehicle holds one mission: give a folder to review several")
