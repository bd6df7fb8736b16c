"""How a vehicle of reference steps moves: its altitude and speed responses along a path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import KinematicState
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.physics.response import StepResponse


@frozen(eq=False)
class VerticalStepLaw:
    """Answer of the altitude response to steps, pausing at the peak rate where a step is long."""

    response: StepResponse
    """Unit step of the altitude reference. [m/m]"""
    east_m: FloatArray
    north_m: FloatArray
    height_m: FloatArray
    """Height above home before the step. (rows,) [m]"""
    step_m: FloatArray
    """Size of the step as the response sees it, negative downwards. (rows,) [m]"""
    peak_s: float
    """Time of the peak rate. [s]"""
    peak_rate: float
    """The peak rate of the unit step. [(m/s)/m]"""
    pause_s: FloatArray

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        paused = np.clip(time_s - self.peak_s, 0.0, self.pause_s[row])
        own = time_s - paused
        rate = self.step_m[row] * self.response.slope(own)
        zero = np.zeros(row.shape)
        return KinematicState(
            east_m=self.east_m[row],
            north_m=self.north_m[row],
            height_m=self.height_m[row]
            + self.step_m[row] * self.response.value(own)
            + self.step_m[row] * self.peak_rate * paused,
            east_m_s=zero,
            north_m_s=zero,
            climb_m_s=rate,
        )


@frozen(eq=False)
class SpeedPulseLaw:
    """Answer of the speed response to pulses of the speed reference, along straight level legs."""

    response: StepResponse
    """Unit step of the speed reference, input gain included. [(m/s)/(m/s)]"""
    east_m: FloatArray
    north_m: FloatArray
    height_m: FloatArray
    east: FloatArray
    """Eastward part of the direction. (rows,) [-]"""
    north: FloatArray
    speed_m_s: FloatArray
    """Commanded speed. (rows,) [m s⁻¹]"""
    pulse_s: FloatArray
    """Length of the pulse. (rows,) [s]"""

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        after = time_s - self.pulse_s[row]
        speed = self.speed_m_s[row]
        rate = speed * (self.response.value(time_s) - self.response.value(after))
        way = speed * (self.response.integral(time_s) - self.response.integral(after))
        return KinematicState(
            east_m=self.east_m[row] + way * self.east[row],
            north_m=self.north_m[row] + way * self.north[row],
            height_m=self.height_m[row],
            east_m_s=rate * self.east[row],
            north_m_s=rate * self.north[row],
            climb_m_s=np.zeros(row.shape),
        )
