"""How the time of ArduPilot's track slows down where the vehicle falls behind its target."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.flight.motion.kinematics import clipped, dot, is_nonzero, lengths, quotient, rows_of
from planner.flight.motion.s_curve import SpeedRamps
from planner.units import GRAVITY_M_S2
from planner.values import field_names, field_values

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import ComplexArray, FloatArray
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

ATTITUDE_LAG_FACTOR = 2.0
"""Time lost at a start from rest in time constants of the attitude, see :func:`_start_delay_s`. [-]"""
_ATTITUDE_LOOP_S = 0.05
"""Of the attitude behind its shaped target: as recorded on 16 splines, beside ATC_INPUT_TC of 0.15 s. [s]"""
VELOCITY_GAIN_PER_S = 2.0
"""PSC_NE_VEL_P, its default. [s⁻¹]"""
VELOCITY_INTEGRAL_PER_S2 = 1.0
"""PSC_NE_VEL_I, its default. [s⁻²]"""
VELOCITY_DERIVATIVE = 0.25
"""PSC_NE_VEL_D, its default. [-]"""
POSITION_GAIN_PER_S = 1.0
"""PSC_NE_POS_P, its default. [s⁻¹]"""
CLIMB_LAG_S = 0.2
"""1/PSC_D_VEL_P, its default of 5 s⁻¹: splines tell the controller no acceleration. [s]"""
_TIME_BUFFER = 0.05
"""``advance_wp_target_along_track`` forgives so much of the speed. [-]"""
CORRECTED_S = 2.0
"""After so long the velocity controller has taken in what drag has become: its mean residence time,
(k_v k_p + k_I)/(k_I k_p) − 1/k_p with the gains at their defaults, see :class:`TrackLag`. [s]"""


_DRAG_EXPONENT = 1.5
"""Drag of rotors goes by the airspeed, that of a body by its square; 1.4 and 1.3 as recorded. [-]"""
_CORNER_STEP_S = 0.08
"""Of following a vehicle through a corner at most: of steps of 0.02 s the losses are 8 % less to more."""
_ALIKE_PLACES = 3
"""Corners alike to a millimetre per second, a millisecond and so on are followed once."""
_CORNER_STEPS = 48
"""At least so many for a corner: those of low speeds and high accelerations are soon over."""
_BEFORE_S = 2.0 * CORRECTED_S
"""So long before the middle of a corner nothing was behind. [s]"""
_FORGOTTEN_S = 3.0 * CORRECTED_S
"""A corner is forgotten so long after the target has its speed. [s]"""
_LONGER = 4
"""So many times the time of its target's a vehicle is followed through a corner."""
_START_STEPS = 24
"""Of speeding up behind a start."""
_REST_STEPS = 40
"""Of standing where it stopped: 0.4 s at most."""
_LEANING_STEPS = 60
"""Of speeding up while the lean follows: some 0.1 s, half its lag."""
_STOP_STEPS = 150
"""Steps of braking to a stop: some 40 ms."""
_SLOWEST_PACE = 0.05
"""Time along the track passes at least so fast here: where it stands still the filter counts. [-]"""

SETTLED_S = 15.0
"""Seven times `CORRECTED_S`: no vehicle is off by a thousandth of what it was. [s]"""
_SETTLING_STEP_S = 0.05
_FROM_MOTION_S = 12.0
"""So long after a turn a leg is as far behind as it will be: six times `CORRECTED_S`. [s]"""
_FROM_MOTION_STEP_S = 0.05
_SPLINE_STEP_S = 0.05
_LONGEST_FOLLOWED_S = 60.0
"""Of a piece of a spline so much is followed step by step: thirty times `CORRECTED_S`.  [s]"""


def drag_m_s2(drag: float, speed_m_s: float) -> float:
    """Return the deceleration by drag at a speed."""
    return float(drag * speed_m_s**_DRAG_EXPONENT)


class Behind(NamedTuple):
    """How a vehicle follows a spline, seen from above: east + i north."""

    gap_m: complex = 0j
    """From the vehicle to its target."""
    velocity_m_s: complex = 0j
    """Of the vehicle."""
    held_m_s2: complex = 0j
    """What the integral of its controller holds."""
    pushed_m_s2: complex = 0j
    """What its lean pushes with, which follows what the controller asks for."""
    pace: float = 1.0
    """Time along the track over time."""
    flown_m: float = 0.0
    """Way of the vehicle so far."""
    is_chance: bool = False
    """Whether it has leant fully behind a target that stood still: its direction, a few degrees, decides how
    much of the lean brakes the vehicle."""


class TrackLag(NamedTuple):
    r"""How the time along a track slows down where the vehicle falls behind.

    Notes
    -----
    ``advance_wp_target_along_track`` lets time pass by 0.05 + (v_vehicle − k_p e)/v, at most 1, filtered
    by A/J: by 1.05 − E/v, where E = v − v_vehicle + k_p e, v being the target's speed and e how far the
    vehicle is behind.  E is the very input of the velocity controller, whose integral has to hold the
    drag F(v): with the gains k_v, k_I, k_d

    .. math:: E = \frac{s + k_p}{(1 + k_d) s^3 + (k_v + k_d k_p) s^2 + (k_v k_p + k_I) s + k_I k_p}
        \frac{dF}{dt}.

    Along splines it is a lag of first order with that gain and mean residence time.
    """

    drag: float
    """Deceleration by drag over the airspeed to the power ``_DRAG_EXPONENT``."""
    lean_m_s2: float
    """Acceleration of the greatest lean."""
    filter_s: float
    attitude_s: float
    """Lag of the lean behind what the controller asks for. [s]"""

    @classmethod
    def of(cls, parameters: ArduPilotParameters, airspeed_limit_m_s: float | None) -> TrackLag:
        """Return the lag of a vehicle; without an airspeed limit its drag is not known, and left out."""
        lean = GRAVITY_M_S2 * math.tan(parameters.lean_angle_max_rad)
        return cls(
            drag=0.0 if airspeed_limit_m_s is None else lean / airspeed_limit_m_s**_DRAG_EXPONENT,
            lean_m_s2=lean,
            filter_s=parameters.acceleration_m_s2 / parameters.jerk_m_s3,
            attitude_s=parameters.attitude_time_constant_s + _ATTITUDE_LOOP_S,
        )

    def after(
        self, time_s: float, before: complex, track: complex, behind: Behind
    ) -> tuple[Behind, float]:
        """Return how a vehicle follows a time of its target's later, and the time that takes.

        ``before`` and ``track`` are the target's velocities.  Splines tell the controller no acceleration
        (``SplineCurve`` has none): its gains and its integral alone push the vehicle.
        """
        gap, velocity, held, pushed, pace, flown, is_chance = behind
        change = (track - before) / time_s
        done, real = 0.0, 0.0
        followed = min(time_s, _LONGEST_FOLLOWED_S)
        while done < followed:
            step = min(_SPLINE_STEP_S, (followed - done) / pace)
            done = followed if step < _SPLINE_STEP_S else done + pace * step
            real += step
            target = before + change * done
            closing = pace * target - velocity
            error = target - velocity + POSITION_GAIN_PER_S * gap
            drag = self.drag * velocity * math.sqrt(abs(velocity))
            asked = pace * change + POSITION_GAIN_PER_S * closing + drag
            asked = VELOCITY_GAIN_PER_S * error + held + VELOCITY_DERIVATIVE * asked
            asked /= 1.0 + VELOCITY_DERIVATIVE
            grown = held + VELOCITY_INTEGRAL_PER_S2 * error * step
            if abs(asked) > self.lean_m_s2:
                is_chance |= pace <= _SLOWEST_PACE
                if (error * asked.conjugate()).real > 0.0 and abs(grown) > abs(held):
                    grown *= abs(held) / abs(grown)
                asked = self.leant(asked, target)
            held = grown
            pushed += (asked - pushed) * step / (self.attitude_s + 0.5 * step)
            velocity += (pushed - drag) * step
            flown += abs(velocity) * step
            gap += (pace * target - velocity) * step
            squared = target.real * target.real + target.imag * target.imag
            along = (error * target.conjugate()).real / squared if squared > 0.0 else 0.0
            wanted = min(max(1.0 + _TIME_BUFFER - along, 0.0), 1.0)
            pace = max(pace + (wanted - pace) * min(step / self.filter_s, 1.0), _SLOWEST_PACE)
        if followed < time_s:  # and the rest as it was at the end of that
            flown += abs(track) * (time_s - done)
            settled = self.steady(track)._replace(
                gap_m=gap, pace=pace, flown_m=flown, is_chance=is_chance
            )
            return settled, real + (time_s - done) / pace
        return Behind(gap, velocity, held, pushed, pace, flown, is_chance), real

    def leant(self, asked_m_s2: complex, along: complex) -> complex:
        """Return what the greatest lean gives of an acceleration: what is across a direction first.

        ``limit_accel_xy`` with the desired velocity: a vehicle too fast in a bend brakes last.
        """
        unit = along / abs(along) if along else asked_m_s2 / abs(asked_m_s2)
        turned = asked_m_s2 * unit.conjugate()
        across = min(max(turned.imag, -self.lean_m_s2), self.lean_m_s2)
        left = math.sqrt(self.lean_m_s2**2 - across**2)
        return complex(min(max(turned.real, -left), left), across) * unit

    def steady(self, track: complex) -> Behind:
        """Return a vehicle that has followed a velocity for long."""
        held = self.drag * track * math.sqrt(abs(track))
        return Behind(velocity_m_s=track, held_m_s2=held, pushed_m_s2=held)

    def held(self, velocity_m_s: FloatArray) -> FloatArray:
        """Return the drag of velocities. (n, 3) [m s⁻²]"""
        size = lengths(velocity_m_s)
        return np.asarray((self.drag * size ** (_DRAG_EXPONENT - 1.0))[:, None] * velocity_m_s)

    def lost_in_corners_s(
        self,
        ramps: SpeedRamps,
        half_s: FloatArray,
        *,
        before: FloatArray,
        after: FloatArray,
        cruise_s: FloatArray,
    ) -> FloatArray:
        """Return the time lost behind the middles of corners. (n,) [s]

        ``ramps`` are those of braking before a corner and of speeding up after it (2, n); the directions
        of the legs are (n, 3).  The lean follows what the controller asks for with a lag, so the vehicle is
        late in turning; and what the drag was while braking still pushes it along its old direction: the
        sharper the corner, the more it is missing from the new one.  Up and down nothing leans.

        Each is followed from its braking on until its target brakes again, after a time of cruise (n,), or
        nothing more is waited for.  What the greatest lean does not give is not counted.
        """
        lost = np.zeros(len(half_s))
        led = rows_of(is_nonzero(before))
        if not len(led):
            return lost
        # Wherever corners turn the same way they lose the same, and those of a survey are all alike.
        come, go = before[:, 0] + 1j * before[:, 1], after[:, 0] + 1j * after[:, 1]
        go *= np.exp(-1j * np.angle(come))
        own = (np.abs(come), go.real, go.imag, dot(before, after), half_s)
        columns = np.vstack(
            (*own, np.minimum(cruise_s, _FORGOTTEN_S), *field_values(ramps).values())
        )
        alike: dict[bytes, int] = {}
        rows = map(bytes, np.round(columns.T[led], _ALIKE_PLACES))
        place = [alike.setdefault(row, len(alike)) for row in rows]
        corners = _LedCorners.of(np.array([np.frombuffer(row) for row in alike]).T)
        lost[led] = corners.lost_s(self)[place]
        return lost

    def lost_at_starts_s(self, ramps: SpeedRamps, direction: FloatArray) -> FloatArray:
        """Return the time lost to drag where legs begin at rest. (n,) [s]"""
        if self.drag == 0.0:
            return np.zeros(len(direction))
        times = _times(np.zeros(len(direction)), ramps.duration_s, _START_STEPS)
        steps = ((step, ramps.speed_after(then)[:, None] * direction) for step, then in times)
        return self._lost_s(_Following.along(np.zeros_like(direction)), steps)

    def spared_behind_stops_s(
        self,
        ramps: SpeedRamps,
        direction: FloatArray,
        *,
        stops: SpeedRamps,
        came: FloatArray,
        since_s: FloatArray,
    ) -> FloatArray:
        """Return the time that legs from rest lose less than from long standing; below 0, more. (n,) [s]

        Their targets came to rest some time before, in directions (n, 3).  The vehicle, carried past by the
        drag its controller still holds, is ahead of its target then: straight on it has so much less to
        catch up with while it leans, and nothing where it turns aside.  Recorded at 30 m and 2 s: legs
        straight on take 0.38 s less than those after a turn.
        """
        if self.drag == 0.0 or not len(direction):
            return np.zeros(len(direction))
        left, rest_s = self._stopped(stops), np.minimum(since_s, SETTLED_S) / _REST_STEPS
        for _ in range(_REST_STEPS):
            left = left.after(rest_s, np.zeros_like(left.velocity_m_s), self)
        # From long standing, and with what is left along the leg: across it nothing is waited for.
        straight = dot(came, direction)[:, None]
        begun = _Following(*(np.concatenate((0.0 * field, straight * field)) for field in left))
        times = _times(np.zeros_like(since_s), ramps.duration_s, _LEANING_STEPS)
        steps = ((np.tile(s, 2), np.tile(ramps.speed_after(then), 2)[:, None]) for s, then in times)
        long_s, short_s = np.split(self._lost_s(begun, steps, lean_s=self.attitude_s), 2)
        return np.asarray(long_s - short_s)

    def _lost_s(
        self,
        followed: _Following,
        steps: Iterator[tuple[FloatArray, FloatArray]],
        *,
        lean_s: float = 0.0,
    ) -> FloatArray:
        """Return the time lost while targets speed up, by the lengths of steps and velocities then. (n,) [s]

        With a lag of the lean, what it is behind the acceleration asked for is missing as drag is.
        """
        velocity = followed.velocity_m_s
        lost, pace = np.zeros(len(velocity)), np.ones(len(velocity))
        given, missing = np.zeros_like(velocity), np.zeros_like(velocity)
        for step, then in steps:
            slowed = np.maximum(pace, _SLOWEST_PACE)
            real, was = step / slowed, followed.velocity_m_s
            if lean_s:
                asked_m_s2 = (then - was) / real[:, None]
                kept = np.exp(-real / lean_s)[:, None]
                later = (
                    missing * kept + (asked_m_s2 - given) * (1.0 - kept) * lean_s / real[:, None]
                )
                uncovered = followed.uncovered_m_s2 + later - missing
                followed = followed._replace(uncovered_m_s2=uncovered)
                given, missing = asked_m_s2, later
            followed = followed.after(real, then, self, slowed[:, None])
            mean = 0.5 * (was + followed.velocity_m_s)
            behind = quotient(dot(followed.error_m_s, mean), dot(mean, mean))
            asked = np.clip(1.0 + _TIME_BUFFER - behind, 0.0, 1.0)
            pace = asked + (pace - asked) * np.exp(-real / self.filter_s)
            lost += (1.0 - asked) * real
        return lost

    def lost_from_motion_s(
        self,
        ramps: SpeedRamps,
        direction: FloatArray,
        *,
        still_s: FloatArray,
        ahead_m: FloatArray,
        velocity_m_s: FloatArray,
        asked_m_s2: FloatArray,
    ) -> FloatArray:
        """Return the time lost on legs begun from stopping points ahead of vehicles in motion. (n,) [s]

        The targets rest at first (n,), ``ahead_m`` of the vehicles (n, 3), which have velocities (n, 3) and
        hold what was asked of them for a turn and for their drag (n, 3): the controller's integral begins
        with it (``NE_init_controller``).
        """
        speed_up_s, pace = np.zeros(len(still_s)), np.ones(len(still_s))
        gap, velocity, held = ahead_m, velocity_m_s, asked_m_s2
        for step in range(round(_FROM_MOTION_S / _FROM_MOTION_STEP_S)):
            moving = step * _FROM_MOTION_STEP_S >= still_s
            early, late = ramps.speed_after(
                np.stack((speed_up_s, speed_up_s + _FROM_MOTION_STEP_S))
            )
            speed = early[:, None]
            push = pace * (late - early) / _FROM_MOTION_STEP_S
            target = speed * direction
            closing = pace[:, None] * target - velocity
            error = target - velocity + POSITION_GAIN_PER_S * gap
            asked = (1.0 + VELOCITY_DERIVATIVE) * push[:, None] * direction + held
            asked = asked + VELOCITY_GAIN_PER_S * error
            asked += VELOCITY_DERIVATIVE * POSITION_GAIN_PER_S * closing
            change = (asked - self.held(velocity)) / (1.0 + VELOCITY_DERIVATIVE)
            gap = gap + (closing - 0.5 * change * _FROM_MOTION_STEP_S) * _FROM_MOTION_STEP_S
            velocity = velocity + change * _FROM_MOTION_STEP_S
            held = held + VELOCITY_INTEGRAL_PER_S2 * error * _FROM_MOTION_STEP_S
            behind = quotient(dot(error, target), early * early)
            wanted = np.clip(1.0 + _TIME_BUFFER - behind, 0.0, 1.0)
            pace = pace + (wanted - pace) * _FROM_MOTION_STEP_S / self.filter_s
            speed_up_s = speed_up_s + np.where(moving, pace * _FROM_MOTION_STEP_S, 0.0)
        return np.asarray(_FROM_MOTION_S - np.maximum(still_s, 0.0) - speed_up_s)

    def beyond_stops_m(self, ramps: SpeedRamps) -> FloatArray:
        """Return how far beyond the end of braking the vehicle's stopping point is. (n,) [m]

        Notes
        -----
        ``get_stopping_point_NE_m``: slow as it is there, v/k_p ahead of the vehicle, which is as far ahead
        of its target as its controller's input E is.
        """
        return np.asarray(np.abs(self._stopped(ramps).error_m_s[:, 0]))

    def past_stops_m(self, ramps: SpeedRamps) -> FloatArray:
        """Return the way that vehicles fly past their stops, and back. (n,) [m]"""
        return np.asarray(2.0 * lengths(self._stopped(ramps).behind_m))

    def settling_s(self, ramps: SpeedRamps, radius_m: float) -> FloatArray:
        """Return how long after the end of braking a vehicle is within a radius of its target. (n,) [s]

        The drag that the controller still holds against carries it past.
        """
        waits = np.zeros_like(ramps.duration_s)
        # No change of drag carries farther than this part of it: the peak of the step's answer.
        fast = np.flatnonzero(
            drag_m_s2(self.drag, 1.0) * ramps.change_m_s**_DRAG_EXPONENT > 3.0 * radius_m
        )
        if not len(fast):
            return waits
        followed = self._stopped(ramps.select(fast))
        still, step = np.zeros_like(followed.velocity_m_s), np.full(len(fast), _SETTLING_STEP_S)
        for _ in range(round(SETTLED_S / _SETTLING_STEP_S)):
            is_off = lengths(followed.behind_m) > radius_m
            if not is_off.any():
                break
            waits[fast] += is_off * _SETTLING_STEP_S
            followed = followed.after(step, still, self)
        return waits

    def _stopped(self, ramps: SpeedRamps) -> _Following:
        """Return vehicles that have followed their targets to a stop, along their ways. (n, 1)"""
        braking = ramps.duration_s

        def velocity(time_s: FloatArray) -> FloatArray:
            return ramps.speed_after(-time_s)[:, None]

        followed = _Following.along(velocity(-braking))
        if self.drag > 0.0 and len(braking):
            for step, then in _times(-braking, np.zeros_like(braking), _STOP_STEPS):
                followed = followed.after(step, velocity(then), self)
        return followed


def _times(
    begin_s: FloatArray, end_s: FloatArray, count: int
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield length and end of each of so many equal steps."""
    step = (end_s - begin_s) / count
    for number in range(1, count + 1):
        yield step, begin_s + number * step


class _LedCorners(NamedTuple):
    """Corners that vehicles are followed through, seen from above."""

    come: FloatArray
    """Level part of the direction of the leg before. (n,) [-]"""
    go: ComplexArray
    """Direction of the leg after: along the one before + i to its left. (n,) [-]"""
    cosine: FloatArray
    """Of the angle between them in space. (n,)"""
    half_s: FloatArray
    cruise_s: FloatArray
    ramps: SpeedRamps
    """Of the legs before and after. (2, n)"""

    @classmethod
    def of(cls, columns: FloatArray) -> _LedCorners:
        """Return corners by what tells them apart. (18, n)"""
        come, along, left, cosine, half_s, cruise_s = columns[:6]
        both = columns[6:].reshape(-1, 2, columns.shape[1])
        ramps = SpeedRamps(**dict(zip(field_names(SpeedRamps), both, strict=True)))
        return cls(come, along + 1j * left, cosine, half_s, cruise_s, ramps)

    def lost_s(self, lag: TrackLag) -> FloatArray:
        """Return the time lost behind the middle of each. (n,) [s]"""
        braking, speeding = self.ramps.duration_s
        begin = np.minimum(braking, self.half_s + _BEFORE_S)
        end = begin + speeding - 2.0 * self.half_s + self.cruise_s
        count = np.maximum(np.ceil(end / _CORNER_STEP_S), _CORNER_STEPS).astype(int)
        step = end / count
        number = np.minimum(np.arange(count.max() + 1)[:, None], count)
        targets, _ = self._target_m_s(number * step - begin)
        middle, square = self._target_m_s((number + 0.5) * step - begin)
        steps = np.diff(targets, axis=0, append=targets[-1:])
        # What of an error is along the target's velocity, over its speed; behind the end nothing is lost.
        along = np.where(number < count, np.conj(middle) * quotient(1.0, square), 0.0)
        settled = (end - self.cruise_s) / step
        leaning = step / (lag.attitude_s + 0.5 * step)
        pacing = step / (lag.filter_s + 0.5 * step)
        told, every = (1.0 + VELOCITY_DERIVATIVE) / step, np.arange(len(end))

        velocity, gap = targets[0], np.zeros_like(self.go)
        held = pushed = lag.drag * np.sqrt(np.abs(velocity)) * velocity
        passed, pace = np.zeros(len(end)), np.ones(len(end))
        paces: list[FloatArray] = []
        ways, is_over = [passed], np.zeros(len(end), np.bool_)
        for _ in range(_LONGER * int(count.max())):
            row = np.minimum(passed.astype(int), count)
            at = row * len(end) + every
            faster = steps.take(at)
            now = targets.take(at) + (passed - row) * faster
            drag = lag.drag * np.sqrt(np.abs(velocity))
            closing = pace * now - velocity
            growing = POSITION_GAIN_PER_S * closing - pushed + drag * velocity
            # In the middle of the step.
            error = now - velocity + POSITION_GAIN_PER_S * gap
            error += 0.5 * (step * growing + pace * faster)
            behind = (error * along.take(at)).real
            wanted = np.minimum(np.maximum(1.0 + _TIME_BUFFER - behind, 0.0), 1.0)
            asked = (
                told * faster + VELOCITY_GAIN_PER_S * error + held + VELOCITY_DERIVATIVE * growing
            )
            pushed = pushed + (asked - pushed) * leaning
            # The drag of the speed there will be: however great, it does not turn a vehicle round.
            velocity = (velocity + pushed * step) / (1.0 + drag * step)
            held = held + VELOCITY_INTEGRAL_PER_S2 * step * error
            change = (wanted - pace) * pacing
            gap = gap + (closing + 0.5 * change * now) * step
            passed = passed + pace + 0.5 * change
            pace = pace + change
            paces.append(np.where(is_over, 1.0, wanted))
            ways.append(passed)
            # Each by itself, and only when what is left of it does not come back.
            left = (np.abs(error) + np.abs(growing)) * np.abs(along.take(at))
            is_over |= (passed >= count) | ((passed >= settled) & (left < _TIME_BUFFER))
            if is_over.all():
                break
        counted = clipped(np.array(ways[1:]) - (begin - self.half_s) / step, 0.0, 1.0)
        return np.asarray(((1.0 - np.array(paces)) * counted).sum(axis=0) * step)

    def _target_m_s(self, time_s: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Return velocities of targets from above, and the squares of their speeds. (k, n)

        Times are (k, n), after the ends of the legs before.
        """
        both = np.stack((-time_s, time_s + 2.0 * self.half_s), axis=1)
        come, go = self.ramps.speed_after(both).transpose(1, 0, 2)
        return (
            come * self.come + go * self.go,
            come * come + go * go + 2.0 * come * go * self.cosine,
        )


class _Following(NamedTuple):
    """How vehicles follow the velocities of their targets. (n, 3) each, or (n, 1) along a way"""

    velocity_m_s: FloatArray
    """Of the target."""
    behind_m: FloatArray
    slower_m_s: FloatArray
    """Velocity that is missing."""
    uncovered_m_s2: FloatArray
    """Drag that the integral of the controller does not hold yet."""

    @property
    def error_m_s(self) -> FloatArray:
        """Input of the velocity controller."""
        return self.slower_m_s + POSITION_GAIN_PER_S * self.behind_m

    @classmethod
    def along(cls, velocity_m_s: FloatArray) -> _Following:
        """Return vehicles that have followed for long."""
        none = np.zeros_like(velocity_m_s)
        return cls(velocity_m_s, none, none, none)

    def after(
        self,
        time_s: FloatArray,
        velocity_m_s: FloatArray,
        lag: TrackLag,
        pace: FloatArray | float = 1.0,
    ) -> _Following:
        """Return them a time later, when the targets' velocities are others.

        Where the time along the track passes by ``pace``, targets move on by so much of their velocity
        only, and the acceleration that the vehicle is told of is not reached so soon.
        """
        time, change = time_s[:, None], velocity_m_s - self.velocity_m_s
        drag = lag.held(velocity_m_s) - lag.held(self.velocity_m_s)
        missed = (1.0 - pace) * (self.velocity_m_s + 0.5 * change)
        error = self.error_m_s
        uncovered = self.uncovered_m_s2 + drag - VELOCITY_INTEGRAL_PER_S2 * error * time
        push = 0.5 * (uncovered + self.uncovered_m_s2) - VELOCITY_GAIN_PER_S * error
        push -= VELOCITY_DERIVATIVE * POSITION_GAIN_PER_S * (self.slower_m_s - missed)
        told = (1.0 / pace - 1.0) * change
        slower = self.slower_m_s + (push * time - told) / (1.0 + VELOCITY_DERIVATIVE)
        behind = self.behind_m + (0.5 * (slower + self.slower_m_s) - missed) * time
        return _Following(velocity_m_s, behind, slower, uncovered)
