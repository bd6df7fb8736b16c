"""When a take-off of PX4's leaves the ground, and how it climbs from there."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.units import GRAVITY_M_S2
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.vehicle.parameters.px4 import Px4Parameters

RECORDED_DRAG_PER_S = 0.15
"""Deceleration by the air over airspeed of the vehicle whose climbs were measured. [s⁻¹]"""
_ON_THE_GROUND_M_S = -0.7
"""Upwards, the speed that the trajectory has on the ground (``FlightTaskAuto::reActivate``)."""
_BRAKES_BEYOND = 1.3
"""Times the limit of the speed: there it brakes to a full stop (``_checkEmergencyBraking``)."""
_BRAKING_M_S3 = GRAVITY_M_S2
"""Its jerk then (``_updateTrajConstraints``)."""
_MOTORS_S = 0.48
"""From thrust beyond that of a hover to 2 cm above the ground: 0.35 to 0.5 s in eleven take-offs. [s]"""
_SOONER_S = 0.108
"""By which the climb is sooner all the same: 10 m at 1.5 m/s were reached 11.7 s after arming. [s]"""
_SOONEST_S = 0.05
"""Least time that a climb is late. [s]"""
_LOW_THRUST = 0.3
"""Of the way from the least thrust to that of a hover, up to where a vehicle counts as landed. [-]"""
_STEP_S = 0.004


class LiftOff(Value):
    """How a take-off begins.

    Notes
    -----
    On the ground the trajectory stands at 0.7 m/s down.  As thrust begins to ramp up it accelerates upwards
    by MPC_TKO_SPEED/MPC_TKO_RAMP_T to MPC_TKO_SPEED, which only the controller keeps below
    MPC_Z_VEL_MAX_UP (``MulticopterPositionControl::parameters_update`` sets a copy of its own).  Beyond 1.3
    times that it brakes to a full stop, and begins again.

    The controller takes the lesser u of it and of a limit that rises from −g/k to MPC_Z_VEL_MAX_UP over
    MPC_TKO_RAMP_T (``TakeoffHandling::updateRamp``).  The vehicle lifts off when k u + z > 0, ż = i u:
    what went down on the ground has to be made good first.  In a steady climb the integral is that of the
    drag, z = D v, so from lift-off on ∫(u − v) dt = (D v − z)/i.
    """

    after_s: float
    """From where thrust begins to ramp up."""
    late_s: float
    """By which the climb is late against one at full speed from lift-off on."""
    speed_m_s: float
    """Of the climb near the ground, on average."""
    stops_every_m: float
    """Way between full stops; 0: it climbs steadily."""


def takeoff_acceleration_m_s2(parameters: Px4Parameters) -> float:
    """Return the greatest vertical acceleration of a take-off near the ground, braking included. [m s⁻²]

    ``FlightTaskAuto::_updateTrajConstraints``.
    """
    ramp_s = parameters.takeoff_ramp_s
    most = parameters.acceleration_up_m_s2
    return min(most, parameters.takeoff_speed_m_s / ramp_s) if ramp_s > 0.0 else most


@lru_cache(maxsize=64)  # asked for every motion again
def lift_off(
    parameters: Px4Parameters,
    drag_per_s: float = RECORDED_DRAG_PER_S,
    *,
    is_behind_landing: bool = False,
) -> LiftOff:
    """Return how take-offs begin, or the climb to a waypoint from where the vehicle has landed."""
    p, most_m_s = parameters, parameters.climb_speed_max_m_s
    gain, integral = p.vertical_velocity_gain_per_s, p.vertical_integral_gain_per_s2
    ordered, built, pulse = _ordered_m_s(p, is_behind_landing=is_behind_landing)
    mean_m_s = float(np.minimum(pulse, most_m_s).mean())
    lifts = int(np.argmax(gain * ordered + built > 0.0))
    missing_m = _STEP_S * float((mean_m_s - ordered[lifts:]).sum())
    settling_m = (drag_per_s * mean_m_s - float(built[lifts])) / integral
    late_s = (missing_m + settling_m) / mean_m_s - _MOTORS_S - _SOONER_S
    return LiftOff(
        after_s=_STEP_S * lifts + _MOTORS_S,
        late_s=max(late_s, _SOONEST_S),
        speed_m_s=mean_m_s,
        stops_every_m=_STEP_S * float(pulse.sum()) if len(pulse) > 1 else 0.0,
    )


def noticed_s(parameters: Px4Parameters, least_thrust: float, hover_thrust: float) -> float:
    """Return the time from where thrust begins to ramp up until a vehicle counts as no longer landed. [s]

    As soon as it gives more thrust than three tenths of the way from the least to that of a hover
    (``MulticopterLandDetector::_get_ground_contact_state``).
    """
    p = parameters
    ordered, built, _ = _ordered_m_s(p, is_behind_landing=False)
    thrust = 1.0 + (p.vertical_velocity_gain_per_s * ordered + built) / GRAVITY_M_S2
    low = least_thrust / (max(hover_thrust, least_thrust) or 1.0)
    return _STEP_S * int(np.argmax(thrust > low + _LOW_THRUST * (1.0 - low)))


def relaunch_s(parameters: Px4Parameters, drag_per_s: float = RECORDED_DRAG_PER_S) -> float:
    """Return the time from a waypoint's beginning on the ground to where its climb begins from rest. [s]

    Behind a landing the motors run, and a waypoint is no take-off: thrust ramps up over MPC_TKO_RAMP_T, but
    neither COM_SPOOLUP_TIME nor MPC_TKO_SPEED counts (``TakeoffHandling::updateTakeoffState``,
    ``FlightTaskAuto::_updateTrajConstraints``).  Of its lateness the climb from rest has its own.
    """
    begun = lift_off(parameters, drag_per_s, is_behind_landing=True)
    speed_m_s, jerk = begun.speed_m_s, parameters.jerk_m_s3
    most = min(parameters.acceleration_up_m_s2, math.sqrt(speed_m_s * jerk))
    own_s = 0.5 * (speed_m_s / most + most / jerk)
    return max(begun.after_s + begun.late_s - own_s, 0.0)


def _ordered_m_s(
    parameters: Px4Parameters, *, is_behind_landing: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the speed ordered and what the integral has of it, step by step, and the speed in the end.

    In m s⁻¹, m s⁻² and m s⁻¹, upwards.
    """
    p, most_m_s = parameters, parameters.climb_speed_max_m_s
    gain, integral = p.vertical_velocity_gain_per_s, p.vertical_integral_gain_per_s2
    ramp_s, slowest_m_s = max(p.takeoff_ramp_s, _STEP_S), -GRAVITY_M_S2 / gain
    trajectory, pulse = _trajectory_m_s(p, is_behind_landing=is_behind_landing)
    mean_m_s = float(np.minimum(pulse, most_m_s).mean())
    # What went down is made good at the speed of the climb, at most.
    rising_s = len(trajectory) * _STEP_S
    lasts_s = 2.0 * rising_s + (rising_s * -_ON_THE_GROUND_M_S - ramp_s * slowest_m_s) / mean_m_s
    pulses = math.ceil(lasts_s / (_STEP_S * len(pulse)))
    trajectory = np.concatenate((trajectory, np.tile(pulse, pulses)))
    time_s = _STEP_S * np.arange(len(trajectory))
    ordered = np.minimum(trajectory, np.interp(time_s, (0.0, ramp_s), (slowest_m_s, most_m_s)))
    # No integral while there is no thrust to take away (``PositionControl::_velocityControl``).
    counted = np.where(ordered > slowest_m_s, ordered, 0.0)
    return ordered, np.maximum(integral * _STEP_S * counted.cumsum(), -GRAVITY_M_S2), pulse


def _trajectory_m_s(
    parameters: Px4Parameters, *, is_behind_landing: bool
) -> tuple[FloatArray, FloatArray]:
    """Return the speed of the trajectory, step by step: as it begins, and what it repeats from there."""
    p, most = parameters, takeoff_acceleration_m_s2(parameters)
    limit_m_s, speed_m_s = _BRAKES_BEYOND * p.climb_speed_max_m_s, p.takeoff_speed_m_s
    if is_behind_landing:
        most, speed_m_s = p.acceleration_up_m_s2, min(p.climb_speed_m_s, p.climb_speed_max_m_s)
    jerk = p.jerk_m_s3
    if speed_m_s > limit_m_s:
        return (
            _to_a_stop(_ON_THE_GROUND_M_S, limit_m_s, most, jerk),
            _to_a_stop(0.0, limit_m_s, most, jerk),
        )
    rising, _ = _risen(_ON_THE_GROUND_M_S, speed_m_s, most, jerk)
    return np.minimum(rising, speed_m_s), np.array([speed_m_s])


def _risen(
    from_m_s: float, to_m_s: float, most_m_s2: float, jerk_m_s3: float
) -> tuple[FloatArray, float]:
    """Return the speed until it is at a higher one, step by step, and the acceleration there."""
    lasts_s = (to_m_s - from_m_s) / most_m_s2 + most_m_s2 / jerk_m_s3
    rising = np.minimum(jerk_m_s3 * np.arange(0.0, lasts_s + _STEP_S, _STEP_S), most_m_s2)
    speed = from_m_s + _STEP_S * rising.cumsum()
    reached = int(np.argmax(speed > to_m_s)) or len(speed) - 1
    return speed[: reached + 1], float(rising[reached])


def _to_a_stop(from_m_s: float, to_m_s: float, most_m_s2: float, jerk_m_s3: float) -> FloatArray:
    """Return the speed as it rises to where it brakes, and brakes to a full stop, step by step."""
    speed, rising = _risen(from_m_s, to_m_s, most_m_s2, jerk_m_s3)
    top_m_s = speed[-1] + rising**2 / (2.0 * _BRAKING_M_S3)
    most = math.sqrt(_BRAKING_M_S3 * top_m_s)
    time_s = np.arange(0.0, (rising + 2.0 * most) / _BRAKING_M_S3, _STEP_S)
    braking = np.abs(_BRAKING_M_S3 * time_s - rising - most) - most
    return np.concatenate((speed, speed[-1] + _STEP_S * braking.cumsum()))
