"""One flight by pencil, for logs of every kind: what happened is known without any reader.

On the ground until 8 s, up at 2 m/s to 20 m (18 s), standing, north at 5 m/s from 22 to 32 s
(50 m), standing, down from 40 s at 2 m/s, landed at 50 s.  Armed from 5 to 55 s.  160 W from 6 to
52 s, nothing before and after: 7360 J.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from made_missions import METRES_PER_DEGREE_NORTH

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

LATITUDE_DEG, LONGITUDE_DEG, GROUND_AMSL_M = 47.0, 8.0, 400.0
BEGIN_S, END_S = 0.0, 60.0
ARMED_S, DISARMED_S = 5.0, 55.0
TAKEOFF_S, LANDED_S = 8.0, 50.0
POWER_ON_S, POWER_OFF_S = 6.0, 52.0
VOLTAGE_V, CURRENT_A = 16.0, 10.0
ENERGY_J = 7360.0
"""160 W for 46 s."""
DISTANCE_M = 50.0
HEIGHT_M = 20.0
CLIMB_M_S, CRUISE_M_S = 2.0, 5.0


class Moment(Value):
    """What is true at one time."""

    time_s: float
    height_m: float
    climb_m_s: float
    north_m: float
    speed_m_s: float
    current_a: float

    @property
    def latitude_deg(self) -> float:
        """Where the vehicle is. [°]"""
        return LATITUDE_DEG + self.north_m / METRES_PER_DEGREE_NORTH

    @property
    def is_airborne(self) -> bool:
        """Whether it is off the ground."""
        return TAKEOFF_S <= self.time_s < LANDED_S


def moment(time_s: float) -> Moment:
    """Return what is true at a time."""
    is_climbing, is_sinking = 8.0 <= time_s < 18.0, 40.0 <= time_s < 50.0
    return Moment(
        time_s=time_s,
        height_m=float(np.interp(time_s, [8.0, 18.0, 40.0, 50.0], [0.0, 20.0, 20.0, 0.0])),
        climb_m_s=CLIMB_M_S if is_climbing else -CLIMB_M_S if is_sinking else 0.0,
        north_m=float(np.interp(time_s, [22.0, 32.0], [0.0, 50.0])),
        speed_m_s=CRUISE_M_S if 22.0 <= time_s < 32.0 else 0.0,
        current_a=CURRENT_A if POWER_ON_S <= time_s < POWER_OFF_S else 0.0,
    )


def moments(rate_hz: float = 10.0) -> Iterator[Moment]:
    """Yield the moments of the log, at an even rate."""
    for number in range(int((END_S - BEGIN_S) * rate_hz) + 1):
        yield moment(BEGIN_S + number / rate_hz)
