"""The way of a vehicle round a circle: ArduPilot shapes the turning target, and the vehicle follows.

``AC_Circle::update_ms`` turns a target on the circle and counts the turns by its angle, but hands it on
without a speed: ``AC_PosControl::input_pos_vel_accel_NE_m`` pulls the reference after it, which cuts
inside.  The vehicle in turn is carried outside by the drag that its controller has not taken in yet.
"""

from __future__ import annotations

import cmath
import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from planner.flight.motion.ardupilot.track_lag import (
    POSITION_GAIN_PER_S,
    VELOCITY_DERIVATIVE,
    VELOCITY_GAIN_PER_S,
    VELOCITY_INTEGRAL_PER_S2,
    drag_m_s2,
)

if TYPE_CHECKING:
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_SHAPING_JERK_M_S3 = 5.0
"""PSC_JERK_NE (before 4.7 PSC_JERK_XY), its default. [m s⁻³]"""
_LEAST_ANGULAR_ACCELERATION_RAD_S2 = math.radians(2.0)
"""``AC_CIRCLE_ANGULAR_ACCEL_MIN``. [rad s⁻²]"""
_STEP_S = 0.02
"""The autopilot's is 2.5 ms; the gains are some 1 and 2 per second."""
_NODE_STEPS = 25
"""Steps between places that are kept."""
_STEADY = 3e-3
"""A circle counts as steady where this part of its speed is not yet that of the turn. [-]"""
_LONGEST_ENTRY_S = 60.0


def stopping_point_m(speed_m_s: float, acceleration_m_s2: float) -> float:
    """Return how far ahead the position controller puts its stopping point. [m]

    Notes
    -----
    ``stopping_distance`` of AP_Math/control.cpp, the inverse of its square-root controller.
    """
    linear = acceleration_m_s2 / POSITION_GAIN_PER_S
    if speed_m_s <= linear:
        return speed_m_s / POSITION_GAIN_PER_S
    return 0.5 * (linear / POSITION_GAIN_PER_S + speed_m_s**2 / acceleration_m_s2)


class CircleTask(NamedTuple):
    """What a circle is flown with; equal ones are flown alike."""

    radius_m: float
    rate_rad_s: float
    """Of the target, once it is reached. [rad s⁻¹]"""
    rise_rad_s2: float
    start_m: float
    """Distance from the centre where it begins. [m]"""
    duration_s: float
    speed_m_s: float
    """Highest speed. [m s⁻¹]"""
    acceleration_m_s2: float
    drag: float
    """As in `TrackLag`."""

    @property
    def leads_round(self) -> bool:
        """Whether it is a way at all, and takes time."""
        return self.radius_m > 0.0 and self.duration_s > 0.0

    @classmethod
    def of(
        cls,
        radius_m: float,
        turns: float,
        *,
        start_m: float,
        speed_m_s: float,
        parameters: ArduPilotParameters,
        drag: float,
        hold_s: float = 0.0,
    ) -> CircleTask:
        """Return the task of a circle; one of no turns or at no rate takes no time but that it is held for.

        Notes
        -----
        ``AC_Circle::calc_velocities``: CIRCLE_RATE, at most v/R with v the speed or sqrt(A R / 2); it is
        reached by A/R, 2°/s² at least.
        """
        size, acceleration = abs(radius_m), parameters.acceleration_m_s2
        fastest = min(speed_m_s, math.sqrt(0.5 * acceleration * size))
        rate = min(abs(parameters.circle_rate_rad_s), fastest / size if size else math.inf)
        rise = max(acceleration / size if size else rate, _LEAST_ANGULAR_ACCELERATION_RAD_S2)
        angle = 2.0 * math.pi * turns
        turns_s = angle / rate + 0.5 * rate / rise if angle * rate > 0.0 else 0.0
        return cls(
            radius_m=size,
            rate_rad_s=rate,
            rise_rad_s2=rise,
            start_m=round(start_m, 6),
            duration_s=turns_s + hold_s * (rate > 0.0),
            speed_m_s=speed_m_s,
            acceleration_m_s2=acceleration,
            drag=drag,
        )


class CirclePath(NamedTuple):
    """The way round a circle about zero, from the right, counter-clockwise; complex numbers are places."""

    time_s: tuple[float, ...]
    """Of the nodes, until the way is steady or over. [s]"""
    place_m: tuple[complex, ...]
    velocity_m_s: tuple[complex, ...]
    last_m: complex
    """Where the last turn ends. [m]"""
    last_m_s: complex
    asked_m_s2: complex
    """Acceleration asked of the vehicle there, which the next controller begins with. [m s⁻²]"""
    stop_m: complex
    """The stopping point there. [m]"""


class _Reference(NamedTuple):
    """What the position controller is to follow."""

    place_m: complex
    velocity_m_s: complex
    acceleration_m_s2: complex

    def after(self, target_m: complex, task: CircleTask) -> _Reference:
        """Return the reference a step later, pulled after a target.

        Notes
        -----
        ``shape_pos_vel_accel_xy``: towards the target by the square root of the way that half the
        acceleration A stops on, J/2A its gain; ``shape_vel_accel_xy`` with the gain J/A, across first;
        ``shape_accel_xy`` by no more than the jerk J.
        """
        most, jerk = task.acceleration_m_s2, _SHAPING_JERK_M_S3
        at, speed, push = self
        at += _STEP_S * (speed + 0.5 * _STEP_S * push)
        speed += _STEP_S * push
        to_target = target_m - at
        pull = min(_root(abs(to_target), 0.5 * jerk / most, 0.5 * most), task.speed_m_s)
        wanted = _scaled(to_target, pull)
        missing = wanted - speed
        asked = _scaled(missing, _root(abs(missing), jerk / most, jerk))
        if abs(asked) > most:
            way = _scaled(wanted, 1.0)
            along, across = (way.conjugate() * asked).real, (way.conjugate() * asked).imag
            across = min(max(across, -most), most)
            room = math.sqrt(most**2 - across**2)
            asked = way * complex(min(max(along, -room), room), across)
        change = asked - push
        if abs(change) > jerk * _STEP_S:
            change = _scaled(change, jerk * _STEP_S)
        return _Reference(at, speed, push + change)


class _Follower(NamedTuple):
    """A vehicle behind its reference, as `TrackLag` has it."""

    behind_m: complex = 0j
    slower_m_s: complex = 0j
    integral_m_s2: complex = 0j

    def after(self, reference: _Reference, drag: float) -> _Follower:
        """Return the vehicle a step later."""
        behind, slower, integral = self
        error = slower + POSITION_GAIN_PER_S * behind
        integral += VELOCITY_INTEGRAL_PER_S2 * error * _STEP_S
        velocity = reference.velocity_m_s - slower
        push = _scaled(velocity, drag_m_s2(drag, abs(velocity))) - integral
        push -= VELOCITY_GAIN_PER_S * error + VELOCITY_DERIVATIVE * POSITION_GAIN_PER_S * slower
        slower += push * _STEP_S / (1.0 + VELOCITY_DERIVATIVE)
        return _Follower(behind + slower * _STEP_S, slower, integral)


@lru_cache(maxsize=1024)
def circle_path(task: CircleTask) -> CirclePath:
    """Return the way of a vehicle round a circle, by steps until it is steady."""
    reference, vehicle = _Reference(complex(task.start_m), 0j, 0j), _Follower()
    time, rate, angle, steps = 0.0, 0.0, 0.0, 0
    times, places, velocities = [0.0], [reference.place_m], [0j]
    at, velocity = reference.place_m, 0j
    while time < task.duration_s:
        rate = min(rate + task.rise_rad_s2 * _STEP_S, task.rate_rad_s)
        angle += rate * _STEP_S
        reference = reference.after(cmath.rect(task.radius_m, angle), task)
        vehicle = vehicle.after(reference, task.drag)
        before = velocity
        at = reference.place_m - vehicle.behind_m
        velocity = reference.velocity_m_s - vehicle.slower_m_s
        time += _STEP_S
        steps += 1
        if steps % _NODE_STEPS == 0:
            times.append(time)
            places.append(at)
            velocities.append(velocity)
            straying = abs(velocity - 1j * task.rate_rad_s * at)
            if straying < _STEADY * abs(velocity) or time > _LONGEST_ENTRY_S:
                break
    push = (velocity - before) / _STEP_S
    over_s = time - task.duration_s
    if over_s >= 0.0:
        at, time = at - over_s * velocity, task.duration_s
        if times[-1] >= time:
            del times[-1], places[-1], velocities[-1]
        times.append(time)
        places.append(at)
        velocities.append(velocity)
    turned = cmath.exp(1j * task.rate_rad_s * (task.duration_s - time))
    at, velocity, push = at * turned, velocity * turned, push * turned
    speed = abs(velocity)
    ahead_m = stopping_point_m(min(speed, task.speed_m_s), task.acceleration_m_s2)
    return CirclePath(
        time_s=tuple(times),
        place_m=tuple(places),
        velocity_m_s=tuple(velocities),
        last_m=at,
        last_m_s=velocity,
        asked_m_s2=push + _scaled(velocity, drag_m_s2(task.drag, speed)),
        stop_m=at + _scaled(velocity, ahead_m),
    )


def _scaled(direction: complex, size: float) -> complex:
    """Return a complex number of a size in a direction; zero has none."""
    whole = abs(direction)
    return direction * (size / whole) if whole > 0.0 else 0j


def _root(error: float, gain: float, limit: float) -> float:
    """Return the rate that takes an error away: ``sqrt_controller`` of AP_Math/control.cpp."""
    linear = limit / gain**2
    rate = math.sqrt(2.0 * limit * (error - 0.5 * linear)) if error > linear else error * gain
    return min(rate, error / _STEP_S)
