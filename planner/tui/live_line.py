"""What is said of a vehicle on the line: one line, and what is wrong in flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.catalogue.vehicle import (
    MEASURES_DIFFER_IN_FLIGHT,
    NO_RETURN_IN_FLIGHT,
    RETURN_SOON_IN_FLIGHT,
    SHORT_IN_FLIGHT,
)
from planner.guard.energy import Concern
from planner.report.text import against

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.guard.session import GuardStatus

_LATE_S = 2.0
"""A vehicle that was not heard for so long is told of. [s]"""

_RULES = {
    Concern.NO_RETURN: NO_RETURN_IN_FLIGHT,
    Concern.RETURN_SOON: RETURN_SOON_IN_FLIGHT,
    Concern.NO_FINISH: SHORT_IN_FLIGHT,
    Concern.MEASURES_DIFFER: MEASURES_DIFFER_IN_FLIGHT,
}


def flight_findings(status: GuardStatus) -> tuple[Finding, ...]:
    """Return what is wrong with the energy of a vehicle in flight, worst first."""
    energy = status.energy if status.is_flying else None
    if energy is None:
        return ()
    found = [
        _RULES[warning.concern].finding(warning.text, item=energy.progress.item)
        for warning in energy.warnings
    ]
    return tuple(sorted(found, key=lambda finding: -finding.severity))


def live_line(address: str, status: GuardStatus) -> str:
    """Return ``live udpin:…: battery 78 %, 14.9 V, in flight, item 5, 3 min 12 s along, …``."""
    return f"live {address}: {', '.join(_parts(status))}"


def _parts(status: GuardStatus) -> Iterator[str]:
    if status.heard_ago_s > _LATE_S:
        yield f"NOT HEARD for {quantity.duration(status.heard_ago_s)}"
    battery = status.state.battery
    charge = None if battery is None else battery.remaining_fraction
    voltage_v = None if battery is None else battery.voltage_v
    yield "battery not told" if charge is None else f"battery {quantity.percent(charge)}"
    if voltage_v is not None:
        yield f"{voltage_v:.1f} V"
    if not status.is_flying:
        if status.state.home is None:
            yield "home not told"
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
    yield f"{quantity.duration(energy.progress.time_s)} along"
    yield f"{quantity.energy(energy.left.energy_wh)} left"
    yield f"at the end {against(energy.finish_margin_wh, 'the reserve')}"
    yield f"home from here {against(energy.return_margin_wh, 'the reserve')}"
    if energy.lead_s is not None:
        yield f"no return in {quantity.duration(energy.lead_s)}"
