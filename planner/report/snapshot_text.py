"""What was read from a vehicle, for reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import numbers

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.link.vehicle import VehicleSnapshot
    from planner.mission.items import Home


def snapshot_text(snapshot: VehicleSnapshot) -> str:
    """Return who a vehicle is and what was read from it, a line for each thing."""
    return "".join(f"{name:<11}{value}\n" for name, value in _rows(snapshot))


def _rows(snapshot: VehicleSnapshot) -> Iterator[tuple[str, str]]:
    identity, state, mission = snapshot.identity, snapshot.state, snapshot.mission
    yield "address", snapshot.address
    yield "vehicle", f"{identity.label}{f', number {identity.uid}' if identity.uid else ''}"
    yield "state", _state(snapshot)
    yield "mission", numbers.count(len(mission.items), "item")
    fence = mission.fence
    yield "fence", numbers.count(0 if fence is None else fence.area_count, "area")
    yield "rally", numbers.count(len(mission.rally), "point")
    yield "parameters", str(len(snapshot.parameters))
    yield "home", _place(mission.home)
    if state.position is not None:
        at = state.position
        heights = f"{at.altitude_amsl_m:.1f} m AMSL, {at.height_above_home_m:.1f} m above home"
        yield "position", f"{at.latitude_deg:.7f}, {at.longitude_deg:.7f}, {heights}"
    if state.battery is not None:
        battery = state.battery
        parts = [
            f"{numbers.percent(battery.remaining_fraction)} full"
            if battery.remaining_fraction is not None
            else "charge not told",
            "" if battery.voltage_v is None else f"{battery.voltage_v:.2f} V",
            "" if battery.capacity_ah is None else f"of {battery.capacity_ah:g} Ah",
        ]
        yield "battery", ", ".join(filter(None, parts))
    if state.wind is not None:
        yield "wind", f"{state.wind.speed_m_s:.1f} m/s from {state.wind.from_deg:.0f}°"


def _state(snapshot: VehicleSnapshot) -> str:
    armed = {None: "not told whether armed", True: "armed", False: "disarmed"}[
        snapshot.state.is_armed
    ]
    landed = {None: "", True: ", on the ground", False: ", in the air"}[snapshot.state.is_landed]
    return armed + landed


def _place(home: Home | None) -> str:
    if home is None:
        return "not known"
    altitude_m = home.altitude_amsl_m
    amsl = "altitude not known" if altitude_m is None else f"{altitude_m:.1f} m AMSL"
    return f"{home.latitude_deg:.7f}, {home.longitude_deg:.7f}, {amsl}"
