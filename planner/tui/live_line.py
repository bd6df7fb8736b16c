"""The state of a vehicle on the link, in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.report.text import against

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.guard.session import GuardStatus

_LATE_S = 2.0
"""A vehicle not heard for so long is reported. [s]"""


def live_line(address: str, status: GuardStatus) -> str:
    """Return ``live udpin:…: battery 78 %, 14.9 V, in flight, item 5, 3 min 12 s into the flight, …``."""
    return f"live {address}: {', '.join(_parts(status))}"


def _parts(status: GuardStatus) -> Iterator[str]:
    if status.heard_ago_s > _LATE_S:
        yield f"NO SIGNAL for {quantity.duration(status.heard_ago_s)}"
    battery = status.state.battery
    charge = None if battery is None else battery.remaining_fraction
    voltage_v = None if battery is None else battery.voltage_v
    yield "battery unknown" if charge is None else f"battery {quantity.percent(charge)}"
    if voltage_v is not None:
        yield f"{voltage_v:.1f} V"
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
    yield f"at landing {against(energy.finish_margin_wh, 'the reserve')}"
    yield f"returning now {against(energy.return_margin_wh, 'the reserve')}"
    if energy.lead_s is not None:
        yield f"point of no return in {quantity.duration(energy.lead_s)}"
