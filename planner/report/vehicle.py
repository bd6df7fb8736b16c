"""What was read from a vehicle, for reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.guard.decision import Decision
    from planner.guard.energy import EnergyState
    from planner.guard.session import GuardStatus
    from planner.link.snapshot import VehicleSnapshot
    from planner.mission.items import Home


def snapshot_text(snapshot: VehicleSnapshot) -> str:
    """Return who a vehicle is and what was read from it, a line for each thing."""
    return "".join(f"{name:<11}{value}\n" for name, value in _rows(snapshot))


def _rows(snapshot: VehicleSnapshot) -> Iterator[tuple[str, str]]:
    identity, state, mission = snapshot.identity, snapshot.state, snapshot.mission
    yield "address", snapshot.address
    yield "vehicle", f"{identity.label}{f', number {identity.uid}' if identity.uid else ''}"
    yield "state", _state(snapshot)
    yield "mission", quantity.count(len(mission.items), "item")
    fence = mission.fence
    yield "fence", quantity.count(0 if fence is None else fence.area_count, "area")
    yield "rally", quantity.count(len(mission.rally), "point")
    yield "parameters", str(len(snapshot.parameters))
    yield "home", _place(mission.home)
    if state.position is not None:
        at = state.position
        heights = f"{at.altitude_amsl_m:.1f} m AMSL, {at.height_above_home_m:.1f} m above home"
        yield "position", f"{at.latitude_deg:.7f}, {at.longitude_deg:.7f}, {heights}"
    if state.battery is not None:
        battery = state.battery
        parts = [
            f"{quantity.percent(battery.remaining_fraction)} full"
            if battery.remaining_fraction is not None
            else "charge unknown",
            "" if battery.voltage_v is None else f"{battery.voltage_v:.2f} V",
            "" if battery.capacity_ah is None else f"of {battery.capacity_ah:g} Ah",
        ]
        yield "battery", ", ".join(filter(None, parts))
    if state.wind is not None:
        yield "wind", f"{state.wind.speed_m_s:.1f} m/s from {state.wind.from_deg:.0f}°"


def _state(snapshot: VehicleSnapshot) -> str:
    armed = {None: "armed or not unknown", True: "armed", False: "disarmed"}[
        snapshot.state.is_armed
    ]
    landed = {None: "", True: ", on the ground", False: ", in the air"}[snapshot.state.is_landed]
    return armed + landed


def _place(home: Home | None) -> str:
    if home is None:
        return "unknown"
    altitude_m = home.altitude_amsl_m
    amsl = "altitude unknown" if altitude_m is None else f"{altitude_m:.1f} m AMSL"
    return f"{home.latitude_deg:.7f}, {home.longitude_deg:.7f}, {amsl}"


LATE_S = 2.0
"""A vehicle not heard for so long is reported. [s]"""


def status_line(status: GuardStatus) -> str:
    """Return ``GO: 31 Wh above the reserve | read 4 s ago | asks before arming``."""
    view = status.view
    if status.is_flying:
        energy = "energy not measured" if status.energy is None else energy_text(status.energy)
        parts = [f"in flight: {energy}"]
    else:
        is_named = view.text.startswith(view.verdict.value)
        parts = [view.text if is_named else f"{view.verdict}: {view.text}"]
        if view.age_s is not None:
            parts.append(f"read {quantity.duration(max(view.age_s, 0.0))} ago")
        if status.arming is not None:
            asks = {True: "asks before arming", False: "does not ask", None: "asks perhaps"}
            parts.append(asks[status.arming.is_asking])
        if status.is_armed:
            parts.append("armed")
    if status.heard_ago_s > LATE_S:
        parts.append(f"not heard for {quantity.duration(status.heard_ago_s)}")
    return " | ".join(parts)


def energy_text(state: EnergyState) -> str:
    """Return what is left, what it takes to finish and to return, and the point of no return."""
    parts = [
        f"item {state.progress.item}",
        f"{quantity.energy(state.left.energy_wh)} left by {state.left.source}",
        f"{quantity.energy(state.finish_wh)} to finish",
        f"{quantity.energy(state.return_wh)} home",
        f"reserve {quantity.energy(state.reserve_wh)}",
    ]
    if state.ratio is not None:
        parts.append(f"{quantity.percent(state.ratio)} of the predicted use so far")
    if state.is_joined:
        parts.append("joined in flight")
    if state.lead_s is not None:
        parts.append(f"point of no return in {quantity.duration(state.lead_s)}")
    return ", ".join(parts)


def decision_text(decision: Decision) -> str:
    """Return a decision in one line."""
    details = decision.details
    match decision.kind:
        case "answer":
            result = str(details["result"]).replace("_", " ")
            valid_s = details.get("valid_for_s")
            held = f" for {valid_s} s" if valid_s else ""
            return f"arm request {result}{held}: {decision.text}"
        case "verdict":
            own = str(decision.verdict)
            why = decision.text.removeprefix(own).removeprefix(", ")
            return f"verdict {own}: {why}" if why else f"verdict {own}"
        case _:
            return f"{decision.kind}: {decision.text}"
