"""Off the ground and back to it: take-offs, settling on a place, landings until disarmed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns
from planner.flight.motion.px4.pieces import RAMP, Curves, Lines, Places, SettlingLaw, wright_omega
from planner.flight.motion.px4.speeds import (
    STILL_M,
    Px4Ramps,
    allowed_speed_m_s,
    braking_distance_m,
    half_b_m_s,
    vertical_limits,
)
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.legs import FlownMoves, PlannedLegs
    from planner.flight.motion.px4.moves import Moves
    from planner.flight.motion.px4.pieces import Px4Pieces, TimeScale
    from planner.flight.motion.px4.straights import Limits, Straights
    from planner.vehicle.parameters.px4 import Px4Parameters


LANDED_AFTER_S = 3.6
"""From touch-down to the landed flag: three times 1 s, and 0.6 s until the thrust has gone (measured;
``MulticopterLandDetector``).  That is with a range sensor, which cannot see the ground it stands on; no
parameter tells whether there is one, and without it is 2 s sooner. [s]"""

_STANDS_M = 1e-5
"""Way left that has no direction any more (``matrix::Vector::unit_or_zero``): the trajectory stands. [m]"""
_BEYOND_M_S = 1e-9
"""Velocity that is none. [m s⁻¹]"""
_FINE_M = 2.0
"""Distance from its origin, about home, up to which a trajectory in single precision comes so near; farther
away its steps get lost, and it creeps for ever. [m]"""


class DescentProfile(Value):
    """How fast a landing descends, by height over the ground.

    Notes
    -----
    ``FlightTaskAuto::_prepareLandSetpoints``: MPC_LAND_SPEED below MPC_LAND_ALT2, rising in proportion
    to the height to MPC_Z_VEL_MAX_DN at MPC_LAND_ALT1, no more than MPC_Z_V_AUTO_DN; MPC_LAND_CRWL below
    MPC_LAND_ALT3, as with a range sensor.
    """

    fast_m_s: float
    slow_m_s: float
    crawl_m_s: float
    high_m: float
    """Height below which the speed falls."""
    low_m: float
    """Height below which it is slow."""
    crawl_height_m: float
    """Height below which it crawls; zero where it does not."""
    gain_per_s: float
    """Speed per height in between."""

    @classmethod
    def of(cls, parameters: Px4Parameters) -> DescentProfile:
        """Return the profile of a vehicle."""
        fast, full = parameters.descent_speed_m_s, parameters.descent_speed_max_m_s
        slow = min(parameters.land_speed_m_s, fast)
        low = parameters.land_slowest_height_m
        high = max(parameters.land_slow_height_m, low)
        gain = (full - slow) / (high - low) if high > low and full > slow else 0.0
        crawls = parameters.land_crawl_speed_m_s < slow
        return cls(
            fast_m_s=fast,
            slow_m_s=slow,
            crawl_m_s=parameters.land_crawl_speed_m_s,
            high_m=min(low + (fast - slow) / gain, high) if gain > 0.0 else low,
            low_m=low,
            crawl_height_m=min(parameters.land_crawl_height_m, low) if crawls else 0.0,
            gain_per_s=gain,
        )

    def speed_m_s(self, height_m: FloatArray) -> FloatArray:
        """Return the speeds at heights over the ground, downwards. [m s⁻¹]"""
        falling = self.slow_m_s + self.gain_per_s * (height_m - self.low_m)
        speed = np.where(height_m >= self.high_m, self.fast_m_s, falling)
        return np.clip(speed, self.slow_m_s, self.fast_m_s)


def add_landings(
    pieces: Px4Pieces,
    moves: Moves,
    flown: FlownMoves,
    parameters: Px4Parameters,
    *,
    time_scale: TimeScale,
) -> None:
    """Add the pieces of landings.

    A mission's landing disarms as it has landed, that of a return COM_DISARM_LAND later.

    Notes
    -----
    The trajectory creeps to the place landed on.  Once it stands still over it, the vehicle counts as
    behind all of the time: ``PositionSmoothing::_generateTrajectory`` lets time pass freely only where the
    error points backward.  Recorded: so in all of two landings from standing; from 12 s on in one.
    """
    move = np.flatnonzero(moves.is_landing)
    if not len(move):
        return
    velocity = flown.legs.velocity_m_s[move]
    descents = _Descents.over(flown.legs.place_m[move], velocity, moves.target_m[move], parameters)
    descents.fall(DescentProfile.of(parameters), -velocity[:, 2], parameters)
    descents.add_to(pieces, move, time_scale)
    disarmed = np.where(moves.is_return[move], max(parameters.disarm_delay_s, 0.0), 0.0)
    pieces.add_lines(
        Places.of(move, len(descents.parts), RAMP, LANDED_AFTER_S + disarmed),
        Lines.at_rest(descents.touched_m()),
        is_grounded=True,
    )


@dataclass(slots=True, kw_only=True)
class _Descents:
    """Landings while they are put together from above; heights count from the ground, upwards."""

    ground_m: FloatArray
    settling_m: FloatArray
    """East and north of the place landed on, as two exponentials of time. (k, 2, 2) [m]"""
    settling_per_s: FloatArray
    """Rates at which they die away. (k, 2) [s⁻¹]"""
    height_m: FloatArray
    """Height left. (k,) [m]"""
    elapsed_s: FloatArray
    parts: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]]
    """Start, duration, cubic of the height, amplitude and rate of its exponential."""

    @classmethod
    def over(
        cls,
        place_m: FloatArray,
        velocity_m_s: FloatArray,
        ground_m: FloatArray,
        parameters: Px4Parameters,
    ) -> _Descents:
        """Return landings about to begin.

        The offset from the place landed on dies away at the rate r of the speed allowed at its beginning.
        What the velocity has beyond that, Δ, does so besides at s = r + a/|Δ|, which asks for the
        acceleration a about: −Δ/(s − r) e^(−s t), taken from the amplitude of the other.
        """
        offset = (place_m - ground_m)[:, :2]
        off = np.hypot(offset[:, 0], offset[:, 1])
        allowed = allowed_speed_m_s(off, 0.0, parameters.acceleration_m_s2, parameters.jerk_m_s3)
        rate = np.divide(allowed, off, out=np.ones_like(off), where=off > 0.0)
        beyond = velocity_m_s[:, :2] + rate[:, None] * offset
        faster = np.maximum(np.hypot(beyond[:, 0], beyond[:, 1]), _BEYOND_M_S)
        faster = parameters.acceleration_m_s2 / faster
        passing = -beyond / faster[:, None]
        return cls(
            ground_m=ground_m,
            settling_m=np.stack((offset - passing, passing), axis=-1),
            settling_per_s=np.column_stack((rate, rate + faster)),
            height_m=np.maximum(place_m[:, 2] - ground_m[:, 2], 0.0),
            elapsed_s=np.zeros_like(off),
            parts=[],
        )

    def fall(
        self, profile: DescentProfile, begun_m_s: FloatArray, parameters: Px4Parameters
    ) -> None:
        """Go down to the ground from speeds downwards."""
        a = np.full_like(self.height_m, parameters.acceleration_down_m_s2)
        j = np.full_like(self.height_m, parameters.jerk_m_s3)
        first = profile.speed_m_s(self.height_m)
        change = first - begun_m_s
        ramp = Px4Ramps.of(np.abs(change), a, j)
        # A landing from lower than its ramp is taken at its speed throughout.
        fits = 0.5 * (first + begun_m_s) * ramp.duration_s <= self.height_m
        ramp = Px4Ramps.of(np.where(fits, np.abs(change), 0.0), a, j)
        self._ramp(ramp, begun_m_s, np.sign(change))
        self._steadily(profile.fast_m_s, down_to_m=profile.high_m)
        self._slow_down(profile)
        self._steadily(profile.slow_m_s, down_to_m=profile.crawl_height_m)
        change = np.full_like(first, profile.slow_m_s - profile.crawl_m_s)
        ramp = Px4Ramps.of(np.where(self.height_m > 0.0, np.maximum(change, 0.0), 0.0), a, j)
        braked = 0.5 * (profile.slow_m_s + profile.crawl_m_s) * ramp.duration_s
        fits = (braked <= self.height_m) & (profile.crawl_height_m > 0.0)
        ramp = Px4Ramps.of(np.where(fits, np.maximum(change, 0.0), 0.0), a, j)
        self._ramp(ramp, np.full_like(first, profile.slow_m_s), -1.0)
        self._steadily(profile.crawl_m_s, down_to_m=0.0)

    def touched_m(self) -> FloatArray:
        """Return where landings touch the ground. (k, 3) [m]"""
        place = self.ground_m.copy()
        place[:, :2] += self._offset_m(self.elapsed_s)
        return place

    def standing_from_s(self) -> FloatArray:
        """Return from when trajectories stand still over the place landed on. (k,) [s]"""
        off = np.hypot(self.settling_m[:, 0, 0], self.settling_m[:, 1, 0])
        moves = off > _STANDS_M
        creeping_s = np.divide(
            np.log(np.maximum(off / _STANDS_M, 1.0)),
            self.settling_per_s[:, 0],
            out=np.zeros_like(off),
            where=moves,
        )
        fine = np.abs(self.ground_m[:, :2]).max(axis=1) <= _FINE_M
        return np.where(fine, creeping_s, np.inf)

    def add_to(self, pieces: Px4Pieces, move: IntArray, time_scale: TimeScale) -> None:
        """Add the parts as pieces, each at its mean time scale."""
        count = len(self.parts)
        rows = np.tile(np.arange(len(move)), count)
        begun = np.concatenate([part[0] for part in self.parts])
        coefficients = np.zeros((len(rows), 3, 4))
        coefficients[:, :, 0] = self.ground_m[rows]
        coefficients[:, 2] += np.concatenate([part[2] for part in self.parts])
        across = self.settling_per_s[rows][:, None, :]
        duration = np.concatenate([part[1] for part in self.parts])
        creeping = np.clip(np.tile(self.standing_from_s(), count) - begun, 0.0, duration)
        flown_s = creeping / time_scale.upright + (duration - creeping) / time_scale.standing
        lasts = duration > 0.0
        fading = np.repeat([part[4] for part in self.parts], len(move))
        amplitude, rate = np.zeros((len(rows), 3, 2)), np.zeros((len(rows), 3, 2))
        amplitude[:, :2] = self.settling_m[rows] * np.exp(-across * begun[:, None, None])
        amplitude[:, 2, 0] = np.concatenate([part[3] for part in self.parts])
        rate[:, :2], rate[:, 2, 0] = across, fading
        pieces.add_settlings(
            Places.of(
                move[rows],
                np.repeat(np.arange(count), len(move)),
                RAMP,
                duration,
                np.divide(duration, flown_s, out=np.ones_like(duration), where=lasts),
            ),
            SettlingLaw(coefficients=coefficients, amplitude_m=amplitude, rate_per_s=rate),
        )

    def _offset_m(self, time_s: FloatArray) -> FloatArray:
        fading = np.exp(-self.settling_per_s * time_s[:, None])
        offset: FloatArray = (self.settling_m * fading[:, None, :]).sum(axis=-1)
        return offset

    def _ramp(self, ramps: Px4Ramps, from_m_s: FloatArray, sign: FloatArray | float) -> None:
        """Change the speed downwards."""
        speed, acceleration = from_m_s, np.zeros_like(from_m_s)
        for duration, jerk in (
            (ramps.jerk_s, sign * ramps.jerk_m_s3),
            (ramps.steady_s, np.zeros_like(from_m_s)),
            (ramps.back_s, -sign * ramps.jerk_m_s3),
        ):
            self._go_on(duration, speed, acceleration, jerk)
            speed = speed + duration * (acceleration + 0.5 * jerk * duration)
            acceleration = acceleration + jerk * duration

    def _steadily(self, speed_m_s: float, *, down_to_m: float) -> None:
        duration = np.maximum(self.height_m - down_to_m, 0.0) / speed_m_s
        zero = np.zeros_like(duration)
        self._go_on(duration, np.full_like(duration, speed_m_s), zero, zero)

    def _go_on(
        self,
        duration_s: FloatArray,
        speed_m_s: FloatArray,
        acceleration_m_s2: FloatArray,
        jerk_m_s3: FloatArray,
    ) -> None:
        cubic = np.column_stack(
            (self.height_m, -speed_m_s, -0.5 * acceleration_m_s2, -jerk_m_s3 / 6.0)
        )
        self.parts.append((self.elapsed_s, duration_s, cubic, np.zeros_like(duration_s), 0.0))
        t = duration_s
        way = t * (speed_m_s + t * (0.5 * acceleration_m_s2 + jerk_m_s3 * t / 6.0))
        self.height_m = self.height_m - way
        self.elapsed_s = self.elapsed_s + t

    def _slow_down(self, profile: DescentProfile) -> None:
        """Let the speed fall in proportion to the height, an exponential of time."""
        gain, low = profile.gain_per_s, profile.low_m
        if gain <= 0.0:
            return
        rest = profile.slow_m_s / gain
        above = np.maximum(self.height_m - low, 0.0)
        duration = np.log1p(above / rest) / gain
        cubic = np.zeros((len(above), 4))
        cubic[:, 0] = low - rest
        self.parts.append((self.elapsed_s, duration, cubic, above + rest, gain))
        self.height_m = np.where(above > 0.0, low, self.height_m)
        self.elapsed_s = self.elapsed_s + duration


_LEAST_SHARE = 0.5
"""Of b, that of a braking law which leads to a stop: below it the vehicle is too fast. [-]"""
_ASTRAY_M = 0.1
"""Distance from its target at which a straight may pass and yet lead to it. [m]"""


def creeps(planned: PlannedLegs, limits: Limits, straights: Straights) -> BoolArray:
    """Return which moves end in a hold that goes on braking to a stop at the target. (n,)

    They arrive at the speed the braking law has there.
    """
    return planned.is_leg & (planned.hold_s > 0.0) & _leads_to_target(planned, limits, straights)


def creeping_half_b_m_s(limits: Limits, straights: Straights) -> FloatArray:
    """Return b'/2 of the braking laws that lead from where legs end to a stop at the target. (n,)"""
    rows = np.arange(len(limits.tail_m))
    a, speed = limits.brake_m_s2[rows, straights.near], straights.end_m_s
    half_b: FloatArray = 0.5 * (2.0 * a * limits.tail_m / np.maximum(speed, 1e-9) - speed)
    return half_b


def _leads_to_target(planned: PlannedLegs, limits: Limits, straights: Straights) -> BoolArray:
    """Return which straights go on to their targets by a braking law that stops there. (n,)"""
    rows = np.arange(len(limits.tail_m))
    near = straights.near
    share = creeping_half_b_m_s(limits, straights) / half_b_m_s(
        limits.brake_m_s2[rows, near], limits.brake_m_s3[rows, near]
    )
    stops = (limits.final_m_s[rows, near] == 0.0) & limits.binds[rows, near]
    creeping: BoolArray = (
        stops
        & (limits.length_m > STILL_M)
        & (straights.end_m_s > 0.0)
        & (share > _LEAST_SHARE)
        & (share < 1.0 + STILL_M)
        & (
            np.sqrt(((limits.direction - planned.direction) ** 2).sum(axis=1)) * planned.tail_m
            < _ASTRAY_M
        )
    )
    return creeping


def settlings(
    begin_m: FloatArray, velocity_m_s: FloatArray, target_m: FloatArray, parameters: Px4Parameters
) -> Curves:
    """Return how vehicles in motion settle on places near by.

    They take the time to stop and turn back, and for twice the way at the speed allowed at its
    beginning.  (n rows)
    """
    way = np.sqrt(((target_m - begin_m) ** 2).sum(axis=1))
    speed = np.sqrt((velocity_m_s**2).sum(axis=1))
    a, j = parameters.acceleration_m_s2, parameters.jerk_m_s3
    allowed = allowed_speed_m_s(way, 0.0, a, j)
    back = np.divide(2.0 * way, allowed, out=np.zeros_like(way), where=allowed > 0.0)
    duration = back + 2.0 * (speed / a + a / j)
    rises = target_m[:, 2] > begin_m[:, 2]
    return Curves.between(
        begin_m,
        velocity_m_s,
        target_m,
        np.zeros_like(begin_m),
        duration_s=duration,
        level_m_s=allowed,
        upright_m_s=np.minimum(allowed, vertical_limits(rises, parameters)[0]),
    )


def ends_of_moves(
    part: PlannedLegs,
    place_m: FloatArray,
    velocity_m_s: FloatArray,
    limits: Limits,
    straights: Straights,
    *,
    parameters: Px4Parameters,
) -> tuple[FloatArray, FloatArray]:
    """Return where and how fast moves end, holds included."""
    rows = np.arange(len(place_m))
    speed = straights.end_m_s
    begin = place_m + limits.direction * limits.length_m[:, None]
    moving = limits.length_m > STILL_M
    velocity = np.where(moving[:, None], limits.direction * speed[:, None], velocity_m_s)
    end = begin.copy()
    holds = part.hold_s > 0.0
    creeping = part.is_leg & holds & _leads_to_target(part, limits, straights)
    settling = np.flatnonzero(holds & ~creeping & (part.is_leg | part.stands))
    if creeping.any():
        near = straights.near
        half_b = np.where(creeping, creeping_half_b_m_s(limits, straights), 1.0)
        a = limits.brake_m_s2[rows, near]
        begun = np.where(creeping, speed / half_b, 1.0)
        left = half_b * wright_omega(begun + np.log(begun) - part.hold_s * a / half_b)
        way = left * (left + 2.0 * half_b) / (2.0 * a)
        aim = begin + limits.direction * (part.tail_m - way)[:, None]
        end = np.where(creeping[:, None], aim, end)
        velocity = np.where(creeping[:, None], limits.direction * left[:, None], velocity)
    if len(settling):
        target = part.target_m[settling]
        curves = settlings(begin[settling], velocity[settling], target, parameters)
        settle_s = curves.duration_s.sum(axis=1)
        over = (part.hold_s[settling] >= settle_s)[:, None]
        place, left_m_s = curves.state_at(np.minimum(part.hold_s[settling], settle_s))
        end[settling] = np.where(over, target, place)
        velocity[settling] = np.where(over, 0.0, left_m_s)
    landed = ~part.is_leg & ~part.stands
    end = np.where(landed[:, None], part.target_m, end)
    return end, np.where(landed[:, None], 0.0, velocity)


LIFT_OFF_AFTER_S = 0.2
"""From the end of the thrust ramp to lift-off: 4.2 s after arming with 1 s of spool-up and 3 s of ramp
(measured). [s]"""
CLIMB_BEHIND_S = 0.83
"""Time the climb is behind one at full speed from lift-off on: 10 m at 1.5 m/s are reached 11.7 s after
arming, not 10.9 s (measured).  PX4 only begins to raise the speed while the thrust ramps up. [s]"""

IDLE_SHARE = 0.5
"""Share of the thrust ramp that counts as standing with idle motors: thrust grows evenly to that of the
hover. [-]"""


class Takeoffs(Columns, eq=False):
    """Take-offs as columns of length k."""

    ground_m: FloatArray
    """Where each begins. (k, 3) [m]"""
    grounded_s: FloatArray
    """Time on the ground: spool-up and ramp."""
    speed_m_s: FloatArray
    """Climb speed near the ground."""
    rise_s: FloatArray
    """Time in which the climb reaches it, at constant acceleration."""
    steady_s: FloatArray
    """Time at it."""
    place_m: FloatArray
    """Where the climb becomes a leg. (k, 3) [m]"""
    is_free: BoolArray
    """Whether that is climbed at MPC_Z_V_AUTO_UP; else MPC_TKO_SPEED holds to the end."""


def make_takeoffs(
    ground_m: FloatArray, target_m: FloatArray, parameters: Px4Parameters
) -> Takeoffs:
    """Return the beginnings of take-offs from the ground to the heights of targets. (k, 3) each

    Notes
    -----
    COM_SPOOLUP_TIME, then thrust ramps up over MPC_TKO_RAMP_T (``TakeoffHandling``); MPC_TKO_SPEED up to
    MPC_LAND_ALT1 over ground, then the climb speed of missions (``FlightTaskAuto::
    _updateTrajConstraints``).  A low take-off is climbed no faster than it can be braked again.
    """
    height = np.maximum(target_m[:, 2] - ground_m[:, 2], 0.0)
    a, j = parameters.acceleration_up_m_s2, parameters.jerk_m_s3
    half = half_b_m_s(a, j) + a * CLIMB_BEHIND_S
    # The highest speed v with v · 0.83 s for the rise and its braking distance within the height.
    fitting = np.sqrt(half**2 + 2.0 * a * height) - half
    speed = np.minimum(parameters.takeoff_speed_m_s, fitting)
    risen = speed * CLIMB_BEHIND_S
    kept = braking_distance_m(speed, 0.0, a, j)
    is_free = height - kept > np.maximum(parameters.land_slow_height_m, risen)
    upper = np.where(
        is_free, np.maximum(parameters.land_slow_height_m, risen), np.maximum(height - kept, risen)
    )
    place = ground_m.copy()
    place[:, 2] += upper
    flies = speed > 0.0
    return Takeoffs(
        ground_m=ground_m,
        grounded_s=np.full_like(
            height, parameters.spool_up_s + parameters.takeoff_ramp_s + LIFT_OFF_AFTER_S
        ),
        speed_m_s=speed,
        rise_s=np.where(flies, 2.0 * CLIMB_BEHIND_S, 0.0),
        steady_s=np.divide(upper - risen, speed, out=np.zeros_like(speed), where=flies),
        place_m=place,
        is_free=is_free,
    )


def add_takeoffs(
    pieces: Px4Pieces, move: IntArray, takeoffs: Takeoffs, parameters: Px4Parameters
) -> None:
    """Add the pieces of take-offs, which are these moves.

    Noise does not slow them: the height of the trajectory is kept at the vehicle's, which climbs at the
    speed ordered however far the trajectory's time has come (``_updateTrajConstraints``,
    ``forceSetPosition``).
    """
    if not len(move):
        return
    count, zero = len(move), np.zeros(len(move))
    idle = np.full(count, parameters.spool_up_s + IDLE_SHARE * parameters.takeoff_ramp_s)
    speed = takeoffs.speed_m_s
    risen = 0.5 * speed * takeoffs.rise_s
    rising = np.divide(speed, takeoffs.rise_s, out=zero.copy(), where=takeoffs.rise_s > 0.0)
    for order, (duration, height, v, a) in enumerate(
        (
            (idle, zero, zero, zero),
            (takeoffs.grounded_s - idle, zero, zero, zero),
            (takeoffs.rise_s, zero, zero, rising),
            (takeoffs.steady_s, risen, speed, zero),
        )
    ):
        place = takeoffs.ground_m.copy()
        place[:, 2] += height
        pieces.add_lines(
            Places.of(move, order, RAMP, duration),
            Lines(
                place_m=place,
                direction=np.broadcast_to(np.array([0.0, 0.0, 1.0]), (count, 3)),
                speed_m_s=v,
                acceleration_m_s2=a,
                jerk_m_s3=zero,
            ),
            is_grounded=order == 0,
        )
