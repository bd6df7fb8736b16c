"""The airspeed a vehicle holds at its greatest lean angle, where its flights show it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.identify.segments import is_steady, run_bounds, speed_through_air_m_s
from planner.values import Value
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.logs.record import FlightRecord

_NEAR_RAD = math.radians(0.5)
"""A mean lean within this of the limit is at it: the limit is one of the target, which the vehicle
follows without a steady error; recorded within 0.05°."""
_HELD_BACK = 0.97
"""Below this fraction of the speed commanded the vehicle does not come to it. [-]"""
_SHORTEST_S = 5.0
"""Of steady flight; the airspeed is that of its second half, for it is approached exponentially. [s]"""


class LeanLimit(Value):
    """An airspeed, and the lean angle it was held at."""

    airspeed_m_s: float
    lean_deg: float
    """Greatest lean angle by the parameters of the flight. [°]"""


def identified_lean_limit(records: Sequence[FlightRecord]) -> LeanLimit | None:
    """Return the lowest airspeed held at the greatest lean angle; ``None`` where it was never held.

    The lowest: without a known wind it is over ground, and a headwind takes off it what a tailwind adds.
    """
    found = [limit for record in records for limit in _held(record)]
    return min(found, key=lambda limit: limit.airspeed_m_s, default=None)


def _held(record: FlightRecord) -> Iterator[LeanLimit]:
    limit_rad = _lean_angle_max_rad(record)
    if limit_rad is None:
        return
    roll, pitch = np.radians(record.roll_deg), np.radians(record.pitch_deg)
    lean_rad = np.arccos(np.cos(roll) * np.cos(pitch))
    airspeed = speed_through_air_m_s(record)
    commanded, ground_speed = record.reference_speed_m_s, record.ground_speed_m_s
    steady = is_steady(record) & np.isfinite(airspeed + lean_rad + commanded + ground_speed)
    for start, end in zip(*run_bounds(steady), strict=True):
        if not steady[start] or (end - start) * record.step_s < _SHORTEST_S:
            continue
        part = slice((start + end) // 2, end)
        at_limit = abs(float(lean_rad[part].mean()) - limit_rad) < _NEAR_RAD
        if at_limit and ground_speed[part].mean() < _HELD_BACK * commanded[part].mean():
            yield LeanLimit(
                airspeed_m_s=float(airspeed[part].mean()), lean_deg=math.degrees(limit_rad)
            )


def _lean_angle_max_rad(record: FlightRecord) -> float | None:
    """Return the greatest lean angle of a flight by its parameters."""
    for spelling in parameter_table(ArduPilotParameters)["lean_angle_max_rad"].spellings:
        if spelling.name in record.parameters:
            return spelling.si(record.parameters[spelling.name])
    return None
