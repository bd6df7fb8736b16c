"""How long autopilots take for the last part of a landing, which they fly slowly, by their own parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.vehicle.parameters.resolve import FlightParameters

_STEP_M = 0.1
"""Heights at which the speed is looked at: a landing slows down over metres. [m]"""


class SlowLanding(Value, eq=False):
    """The time a landing takes below the height at which it is as fast as any descent."""

    height_m: FloatArray
    """Above what the autopilot takes for the ground, from 0 to where it begins to slow down."""
    time_s: FloatArray
    """From each height down to 0."""
    touchdown_m_s: float

    @classmethod
    def of(cls, parameters: FlightParameters) -> SlowLanding:
        """Return that of a vehicle: PX4's ``DescentProfile``, ArduPilot's ``landing_speed_m_s``."""
        from planner.vehicle.parameters.px4 import Px4Parameters

        highest_m = parameters.land_slow_height_m
        if isinstance(parameters, Px4Parameters):
            from planner.flight.motion.px4.landing import DescentProfile

            profile = DescentProfile.of(parameters)
            height_m = np.arange(0.0, max(highest_m, profile.high_m) + _STEP_M, _STEP_M)
            speed_m_s = profile.speed_m_s(height_m)
            crawls = height_m < profile.crawl_height_m
            speed_m_s = np.where(crawls, profile.crawl_m_s, speed_m_s)
        else:
            from planner.flight.motion.ardupilot.vertical import landing_speed_m_s

            # It slows down along v = √(2 a h) above that height.
            fast = parameters.land_high_speed_m_s
            way_m = fast**2 / parameters.vertical_acceleration_m_s2 + fast
            height_m = np.arange(0.0, highest_m + way_m + _STEP_M, _STEP_M)
            speed_m_s = landing_speed_m_s(height_m, parameters)
        slow = speed_m_s < speed_m_s[-1]
        height_m, pace = height_m[: slow.sum() + 1], 1.0 / speed_m_s[: slow.sum() + 1]
        spent_s = np.concatenate(([0.0], np.cumsum(0.5 * (pace[1:] + pace[:-1]) * _STEP_M)))
        return cls(height_m=height_m, time_s=spent_s, touchdown_m_s=float(1.0 / pace[0]))

    @property
    def highest_m(self) -> float:
        """Where it begins to slow down; 0 where it never does. [m]"""
        return float(self.height_m[-1])

    def down_s(self, height_m: FloatArray) -> FloatArray:
        """Return the time down to 0 from heights not above the highest, negative from below 0. [s]"""
        below_s = np.minimum(height_m, 0.0) / self.touchdown_m_s
        return np.asarray(np.interp(height_m, self.height_m, self.time_s) + below_s)
