"""Drag by how far a vehicle leans, and the airspeed it holds at its greatest lean angle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.identify.segments import is_steady, run_bounds, speed_through_air_m_s
from planner.identify.uncertainty import rounded
from planner.values import Value
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.logs.record import FlightRecord
    from planner.vehicle.model import VehicleModel

_NEAR_RAD = math.radians(0.5)
"""A mean lean within this of the limit is at it: the limit is one of the target, which the vehicle
follows without a steady error; recorded within 0.05°."""
_HELD_BACK = 0.97
"""Below this fraction of the speed commanded the vehicle does not come to it. [-]"""
_LEVEL_M_S = 0.3
"""Climb rate below which flight is level: a climb tilts the thrust by what it does not take of drag."""
_MOVING_M_S = 2.0
"""Below it the lean is that of the trim, not of the drag. [m s⁻¹]"""
_APART = 1.3
"""An exponent takes airspeeds at least so far apart: half a degree of lean is then 0.1 of it. [-]"""
_SHORTEST_S = 5.0
"""Of steady flight; the airspeed is that of its second half, for it is approached exponentially. [s]"""


class LeanFlight(Value):
    """What flights show of how a vehicle leans against its drag."""

    airspeed_limit_m_s: float | None
    """Lowest airspeed held at the greatest lean angle; ``None``: it never was."""
    limit_lean_deg: float | None
    """That angle, by the parameters of the flight. [°]"""
    drag_exponent: float | None
    """Power of the airspeed that the drag goes by; ``None``: not shown. [-]"""


class _Lean(NamedTuple):
    """Steady level flight."""

    airspeed_m_s: float
    lean_rad: float
    limit_rad: float | None
    is_held_back: bool

    @property
    def is_at_limit(self) -> bool:
        return (
            self.limit_rad is not None
            and self.is_held_back
            and abs(self.lean_rad - self.limit_rad) < _NEAR_RAD
        )


def identified_lean(
    records: Sequence[FlightRecord], base: VehicleModel | None = None
) -> LeanFlight:
    """Return what flights show of lean and drag; where they show no limit, all that a base model gives.

    The limit is the lowest airspeed at it: without a known wind it is over ground, and a headwind takes
    off it what a tailwind adds.
    """
    steady = [one for record in records for one in _steady(record)]
    held = min((one for one in steady if one.is_at_limit), default=None)
    if held is None or held.limit_rad is None:
        return LeanFlight(
            airspeed_limit_m_s=None if base is None else base.airspeed_limit_m_s,
            limit_lean_deg=None if base is None else base.airspeed_limit_lean_deg,
            drag_exponent=None if base is None else base.drag_exponent,
        )
    exponent = _drag_exponent(steady)
    return LeanFlight(
        airspeed_limit_m_s=rounded(held.airspeed_m_s, 4),
        limit_lean_deg=rounded(math.degrees(held.limit_rad), 4),
        drag_exponent=None if exponent is None else rounded(exponent, 3),
    )


def _drag_exponent(steady: Sequence[_Lean]) -> float | None:
    """Return the exponent by least squares of logarithms.

    The rotors' part of the drag goes by the airspeed, that of the body by its square.
    """
    speed = np.array([one.airspeed_m_s for one in steady])
    if not len(speed) or speed.max() < _APART * speed.min():
        return None
    drag = np.tan([one.lean_rad for one in steady])
    return float(np.clip(np.polyfit(np.log(speed), np.log(drag), 1)[0], 1.0, 2.0))


def _steady(record: FlightRecord) -> Iterator[_Lean]:
    limit_rad = _lean_angle_max_rad(record)
    roll, pitch = np.radians(record.roll_deg), np.radians(record.pitch_deg)
    lean_rad = np.arccos(np.cos(roll) * np.cos(pitch))
    airspeed = speed_through_air_m_s(record)
    commanded, ground_speed = record.reference_speed_m_s, record.ground_speed_m_s
    steady = (
        is_steady(record)
        & np.isfinite(lean_rad)
        & (airspeed > _MOVING_M_S)
        & (np.abs(record.climb_m_s) < _LEVEL_M_S)
    )
    for start, end in zip(*run_bounds(steady), strict=True):
        if not steady[start] or (end - start) * record.step_s < _SHORTEST_S:
            continue
        part = slice((start + end) // 2, end)
        yield _Lean(
            airspeed_m_s=float(airspeed[part].mean()),
            lean_rad=float(lean_rad[part].mean()),
            limit_rad=limit_rad,
            is_held_back=bool(ground_speed[part].mean() < _HELD_BACK * commanded[part].mean()),
        )


def _lean_angle_max_rad(record: FlightRecord) -> float | None:
    """Return the greatest lean angle of a flight by its parameters."""
    table = parameter_table(ArduPilotParameters)
    for row in (table["lean_angle_max_rad"], table["attitude_lean_max_rad"]):
        for spelling in row.spellings:
            if record.parameters.get(spelling.name, 0.0) > 0.0:
                return spelling.si(record.parameters[spelling.name])
    return None
