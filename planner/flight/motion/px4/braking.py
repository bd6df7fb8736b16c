"""The speeds PX4 allows itself: before waypoints, in corners, and what it takes to stop.

Lengths in m, speeds in m/s; a is an acceleration, j a jerk, and b/2 = 2 a²/j.  Functions broadcast.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import clipped, horizontal, quotient
from planner.units import GRAVITY_M_S2
from planner.values import Value

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray
    from planner.vehicle.parameters.px4 import Px4Parameters


def ramp_time_s(
    change_m_s: FloatArray,
    acceleration_m_s2: FloatArray | float,
    jerk_m_s3: FloatArray | float,
    *,
    is_cut: bool = False,
) -> FloatArray:
    """Return the time of a change of speed from and to no acceleration. [s]

    Δ/a + a/j, or 2 √(Δ/j) where the acceleration is not reached (``VelocitySmoothing``); cut off before
    the acceleration is taken back Δ/a + a/2j, or √(2Δ/j).
    """
    part = 0.5 if is_cut else 1.0
    full = change_m_s >= part * acceleration_m_s2**2 / jerk_m_s3
    return np.where(
        full,
        change_m_s / acceleration_m_s2 + part * acceleration_m_s2 / jerk_m_s3,
        np.sqrt(4.0 * part * change_m_s / jerk_m_s3),
    )


def stopped_m(
    place_m: FloatArray, velocity_m_s: FloatArray, parameters: Px4Parameters
) -> tuple[FloatArray, FloatArray]:
    """Return where vehicles come to rest that are to stop at once, and the times that takes. (n, 3), (n,)

    A forced velocity of zero (``PositionSmoothing::_generateSetpoints``) brakes what is horizontal.
    """
    braking_s = ramp_time_s(
        horizontal(velocity_m_s), parameters.acceleration_m_s2, parameters.jerk_m_s3
    )
    level_m_s = velocity_m_s * (1.0, 1.0, 0.0)
    return np.asarray(place_m + 0.5 * braking_s[:, None] * level_m_s), braking_s


class Px4Ramps(Value, eq=False):
    """Changes of speed: jerk, steady acceleration, jerk back; one per row."""

    jerk_m_s3: FloatArray
    """Zero or more; the change may as well be one downwards. (n,) [m s⁻³]"""
    jerk_s: FloatArray
    """Time of the jerk at the beginning. (n,) [s]"""
    steady_s: FloatArray
    """Time of steady acceleration. (n,) [s]"""
    back_s: FloatArray
    """Time of the jerk at the end: as long as that at the beginning, or none. (n,) [s]"""

    @classmethod
    def of(
        cls,
        change_m_s: FloatArray,
        acceleration_m_s2: FloatArray,
        jerk_m_s3: FloatArray,
        *,
        is_cut: BoolArray | bool = False,
    ) -> Px4Ramps:
        """Return the fastest changes of zero or more within limits, some cut off at their acceleration."""
        part = np.where(is_cut, 0.5, 1.0)
        peak = np.minimum(acceleration_m_s2, np.sqrt(jerk_m_s3 * change_m_s / part))
        jerk_s = peak / jerk_m_s3
        return cls(
            jerk_m_s3=jerk_m_s3,
            jerk_s=jerk_s,
            steady_s=np.maximum(quotient(change_m_s, peak) - part * jerk_s, 0.0),
            back_s=np.where(is_cut, 0.0, jerk_s),
        )

    @property
    def duration_s(self) -> FloatArray:
        """Duration of each ramp. (n,) [s]"""
        return self.jerk_s + self.steady_s + self.back_s

    @property
    def change_m_s(self) -> FloatArray:
        """Change of speed of each ramp. (n,) [m s⁻¹]"""
        return self.jerk_m_s3 * self.jerk_s * (0.5 * (self.jerk_s + self.back_s) + self.steady_s)

    def time_at_s(self, fraction: FloatArray) -> FloatArray:
        """Return when a fraction (0 to 1) of the change of whole ramps is reached. (n,) [s]"""
        total = self.change_m_s
        soon, late = fraction * total, (1.0 - fraction) * total
        in_jerk = 0.5 * self.jerk_m_s3 * self.jerk_s**2
        peak = np.where(self.jerk_s > 0.0, self.jerk_m_s3 * self.jerk_s, 1.0)
        return np.select(
            [soon <= in_jerk, late <= in_jerk],
            [
                np.sqrt(2.0 * soon / self.jerk_m_s3),
                self.duration_s - np.sqrt(2.0 * late / self.jerk_m_s3),
            ],
            0.5 * self.jerk_s + soon / peak,
        )

    def gained(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return way, speed and acceleration gained from rest by a time. (n,) [m, m s⁻¹, m s⁻²]"""
        first = np.minimum(time_s, self.jerk_s)
        steady = clipped(time_s - self.jerk_s, 0.0, self.steady_s)
        last = clipped(time_s - self.jerk_s - self.steady_s, 0.0, self.back_s)
        jerk = self.jerk_m_s3
        peak = jerk * first
        speed_1 = 0.5 * peak * first
        speed_2 = speed_1 + peak * steady
        way = peak * first**2 / 6.0 + steady * (speed_1 + 0.5 * peak * steady)
        way += last * (speed_2 + last * (0.5 * peak - jerk * last / 6.0))
        speed = speed_2 + last * (peak - 0.5 * jerk * last)
        return way, speed, peak - jerk * last


STILL_M = 1e-6
"""Way that is none. [m]"""
CLAMPED_M_S = 0.5
"""Speed below which one axis is slowed alone (``clampToXYNorm``, ``clampToZNorm``). [m s⁻¹]"""
HOLD_DELAY_S = 0.6
"""Time for which PX4 expects a vehicle that is to hold to keep its speed
(``Navigator::preproject_stop_point``). [s]"""


def half_b_m_s(acceleration_m_s2: FloatArray | float, jerk_m_s3: FloatArray | float) -> FloatArray:
    """Return 2 a²/j, half the b of the braking law. [m s⁻¹]"""
    half: FloatArray = np.divide(2.0 * acceleration_m_s2**2, jerk_m_s3)
    return half


def allowed_speed_m_s(
    distance_m: FloatArray,
    final_m_s: FloatArray | float,
    acceleration_m_s2: FloatArray | float,
    jerk_m_s3: FloatArray | float,
) -> FloatArray:
    """Return the speed allowed at a distance from a point to be passed at a final speed. [m s⁻¹]

    Notes
    -----
    u² + b u = 2 a d + v_f², never below v_f (``TrajMath.hpp``, ``computeMaxSpeedFromDistance``): PX4
    keeps 2 a/j s in hand to turn its acceleration round, so it brakes early, with a long tail.
    """
    half_b = half_b_m_s(acceleration_m_s2, jerk_m_s3)
    square = half_b**2 + 2.0 * acceleration_m_s2 * distance_m + final_m_s**2
    return np.maximum(np.sqrt(square) - half_b, final_m_s)


def braking_distance_m(
    speed_m_s: FloatArray,
    final_m_s: FloatArray | float,
    acceleration_m_s2: FloatArray | float,
    jerk_m_s3: FloatArray | float,
) -> FloatArray:
    """Return how far before a point braking begins; zero where nothing is to be braked. [m]

    The inverse of :func:`allowed_speed_m_s`.
    """
    half_b = half_b_m_s(acceleration_m_s2, jerk_m_s3)
    way = (speed_m_s * (speed_m_s + 2.0 * half_b) - final_m_s**2) / (2.0 * acceleration_m_s2)
    return np.where(speed_m_s > final_m_s, way, 0.0)


def braking_time_s(
    speed_m_s: FloatArray,
    final_m_s: FloatArray,
    acceleration_m_s2: FloatArray,
    half_b_m_s: FloatArray,
) -> FloatArray:
    """Return the time from one speed to a lower one along a braking law with this b/2. [s]

    Notes
    -----
    t = (u₀ − u₁)/a + (b/2a) ln(u₀/u₁), the integral of −du (2u + b)/(2 a u).  Both speeds are greater
    than zero.
    """
    slowing = speed_m_s - final_m_s + half_b_m_s * np.log(speed_m_s / final_m_s)
    return np.asarray(slowing / acceleration_m_s2)


def vertical_limits(rising: BoolArray, parameters: Px4Parameters) -> tuple[FloatArray, FloatArray]:
    """Return the greatest vertical speed and acceleration, upwards or downwards. [m s⁻¹], [m s⁻²]"""
    return (
        np.where(rising, parameters.climb_speed_m_s, parameters.descent_speed_m_s),
        np.where(rising, parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2),
    )


def corner_speed_m_s(
    cos_turn: FloatArray, radius_m: FloatArray, *, gain_per_s: float, acceleration_m_s2: float
) -> FloatArray:
    """Return the speed at which a corner is passed, for the cosine of its turn (1: straight on). [m s⁻¹]

    Notes
    -----
    √(MPC_XY_TRAJ_P a r tan(α/2)), α = 180° − turn: the circle that touches both legs at the acceptance
    radius r (``computeMaxSpeedInWaypoint``); tan²(α/2) = (1 + cos turn)/(1 − cos turn).
    """
    tangent = np.sqrt(np.maximum(1.0 + cos_turn, 0.0) / np.maximum(1.0 - cos_turn, 1e-12))
    return np.asarray(np.sqrt(gain_per_s * acceleration_m_s2 * radius_m * tangent))


def tilted_m_s2(parameters: Px4Parameters) -> float:
    """Return the greatest level acceleration MPC_TILTMAX_AIR leaves, g tan(tilt). [m s⁻²]"""
    return GRAVITY_M_S2 * math.tan(parameters.lean_angle_max_rad)


def flown_acceleration_m_s2(parameters: Px4Parameters) -> float:
    """Return MPC_ACC_HOR, or what the tilt leaves of it. [m s⁻²]"""
    return min(parameters.acceleration_m_s2, tilted_m_s2(parameters))


def stopping_distance_m(
    speed_m_s: npt.ArrayLike, parameters: Px4Parameters, drag_per_s: float | None = None
) -> FloatArray:
    """Return the distance in which a vehicle that is to hold or to return in mid-leg stops. [m]

    Notes
    -----
    A hold: v (v/2a + 0.6 s), where PX4 puts the point it then keeps (``Navigator::preproject_stop_point``,
    ``computeBrakingDistanceFromVelocity``); 31.2 m from 12 m/s, about 30 m measured.  A return turns
    round at limited jerk, in v/2 (v/a + a/j): 28.5 m, 28 m measured.  The longer counts; nothing stops
    in less than the second.  A vehicle with drag comes past that (``passed_m``): at 1/s 17.2 m from 8 m/s
    and 8.4 m from 5 m/s measured, 17.9 and 8.6 m by this.  Held back by its greatest tilt it is slower than
    its trajectory, which may be as fast as MPC_XY_VEL_MAX.  It brakes no harder than its tilt allows.
    """
    speed = np.asarray(speed_m_s, dtype=np.float64)
    acceleration_m_s2 = flown_acceleration_m_s2(parameters)
    passed = 0.0 * speed
    if drag_per_s:
        braking_s = ramp_time_s(speed, acceleration_m_s2, parameters.jerk_m_s3)
        passed = passed_m(speed, braking_s, parameters, drag_per_s)
        is_tilted = drag_per_s * speed >= _AT_LIMIT * tilted_m_s2(parameters)
        speed = np.where(is_tilted, np.maximum(speed, parameters.speed_max_m_s), speed)
    hold = speed * (0.5 * speed / acceleration_m_s2 + HOLD_DELAY_S)
    reversing_s = ramp_time_s(speed, acceleration_m_s2, parameters.jerk_m_s3)
    return np.maximum(hold, 0.5 * speed * reversing_s) + passed


_AT_LIMIT = 0.98
"""Part of the greatest horizontal acceleration at which it is held back. [-]"""
_APART = 1e-6
"""Least difference of two rates, by the greater: of two that are the same a quotient has no value. [-]"""


def passed_m(
    speed_m_s: FloatArray, braking_s: FloatArray, parameters: Px4Parameters, drag_per_s: float
) -> FloatArray:
    """Return how far past its trajectory a vehicle with drag is as this has braked to a stop. [m]

    Notes
    -----
    The integral of the velocity controller holds the drag D v, which is no longer there: braking evenly in
    a time T leaves f = D v τ/T (1 − e^(−t/τ)) of it, τ = MPC_XY_VEL_P_ACC/MPC_XY_VEL_I_ACC, and the vehicle
    gets to f/(k P) at P = MPC_XY_P (``TrackingLag``).
    """
    p = parameters.position_gain_per_s
    rate = parameters.velocity_integral_gain_per_s2 / parameters.velocity_gain_per_s
    rate = max(rate, _APART)
    rate = rate if abs(rate - p) > _APART * p else p * (1.0 - _APART)
    time = np.maximum(braking_s, _APART)
    fading, settling = np.exp(-rate * time), np.exp(-p * time)
    gets_there = 1.0 - settling - p * (fading - settling) / (p - rate)
    force = drag_per_s * speed_m_s / (rate * time)
    return np.asarray(force * gets_there / (parameters.velocity_gain_per_s * p))


def turning_back(
    speed_m_s: FloatArray, acceleration_m_s2: FloatArray | float, jerk_m_s3: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Return distance and time until a vehicle that is to fly the other way turns back. [m], [s]

    Notes
    -----
    It stands for no longer than an instant: its acceleration grows at limited jerk, and is not taken back
    before the vehicle speeds up again.  From 12 m/s, to return, 28.4 m and 4.375 s; 28 m and 4.3 s
    measured.
    """
    a, j = acceleration_m_s2, jerk_m_s3
    jerk_s = np.minimum(a / j, np.sqrt(2.0 * speed_m_s / j))
    left = np.maximum(speed_m_s - 0.5 * j * jerk_s**2, 0.0)
    way = jerk_s * (speed_m_s - j * jerk_s**2 / 6.0) + 0.5 * left**2 / a
    return way, ramp_time_s(speed_m_s, a, j, is_cut=True)


def yaw_time_s(angle_rad: FloatArray, parameters: Px4Parameters) -> FloatArray:
    """Return the time from rest until a turn of the heading is within MIS_YAW_ERR of its end. [s]

    Notes
    -----
    Constant yaw acceleration and deceleration, MPC_YAWRAUTO_MAX between them: 180° in 6 s at 60°/s and
    20°/s² (measured).
    """
    rate, acceleration = parameters.yaw_rate_rad_s, parameters.yaw_acceleration_rad_s2
    whole = np.where(
        angle_rad > rate**2 / acceleration,
        angle_rad / rate + rate / acceleration,
        2.0 * np.sqrt(np.minimum(angle_rad, rate**2 / acceleration) / acceleration),
    )
    tail = np.sqrt(2.0 * parameters.yaw_acceptance_rad / acceleration)
    return np.where(angle_rad > parameters.yaw_acceptance_rad, np.maximum(whole - tail, 0.0), 0.0)
