"""Off the ground and back to it: take-offs, settling on a place, landings until disarmed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from planner.flight.motion.kinematics import (
    Columns,
    clipped,
    dot,
    greatest,
    horizontal,
    lengths,
    quotient,
    rows_of,
)
from planner.flight.motion.px4.braking import (
    STILL_M,
    Px4Ramps,
    allowed_speed_m_s,
    braking_distance_m,
    half_b_m_s,
    vertical_limits,
)
from planner.flight.motion.px4.laws import Settlings, braked_speed_m_s
from planner.flight.motion.px4.lift_off import lift_off, takeoff_acceleration_m_s2
from planner.flight.motion.px4.pieces import RAMP, Curves, Places
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.legs import Px4Legs
    from planner.flight.motion.px4.pieces import Px4Pieces
    from planner.vehicle.parameters.px4 import Px4Parameters


LANDED_AFTER_S = 3.45
"""From touch-down to the landed flag: three times 1 s, and 0.45 s until the thrust has gone (3.43 to 3.46 s
measured in six landings; ``MulticopterLandDetector``).  That is with a range sensor, which cannot see the
ground below its feet: ``LandDetector::Run`` then waits three times as long. [s]"""
LANDED_SOONER_S = 2.0
"""By which it is sooner without such a sensor; no parameter states whether there is one. [s]"""
LANDED_LATER_S = 8.0
"""How long PX4 asks for the least thrust besides, where its estimate of the height is not to be relied on
(``_minimum_thrust_8s_hysteresis``).  1.3 to 12 s after touch-down were recorded. [s]"""

RANGE_LATE_S = 0.11
"""Age of the distance to the ground, by which a landing slows down: the estimator's, delayed as much as GPS
is (``Ekf::getHagl``, EKF2_GPS_DELAY; 0.11 s measured). [s]"""

_RESTS_M = 1e-5
"""Way left that has no direction any more (``matrix::Vector::unit_or_zero``): the trajectory rests. [m]"""
_OVER_M = 1e-9
"""Way left that is the rounding of the place landed on: its law has no rate, but noise. [m]"""
_BEYOND_M_S = 1e-9
"""Velocity that is none. [m s⁻¹]"""
_ROUNDED_M_S = 1e-4
"""Speed over what is allowed, below which the square root of it does not grow with the rounding. [m s⁻¹]"""
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
        # Seen late, the ground is nearer than it seems: v = slow + g (h + v late − low).
        low = max(parameters.land_slowest_height_m - slow * RANGE_LATE_S, 0.0)
        high = max(parameters.land_slow_height_m - full * RANGE_LATE_S, low)
        gain = (full - slow) / (high - low) if high > low and full > slow else 0.0
        crawls = parameters.land_crawl_speed_m_s < slow
        crawl_m = max(parameters.land_crawl_height_m - slow * RANGE_LATE_S, 0.0)
        return cls(
            fast_m_s=fast,
            slow_m_s=slow,
            crawl_m_s=parameters.land_crawl_speed_m_s,
            high_m=min(low + (fast - slow) / gain, high) if gain > 0.0 else low,
            low_m=low,
            crawl_height_m=min(crawl_m, low) if crawls else 0.0,
            gain_per_s=gain,
        )

    def speed_m_s(self, height_m: FloatArray) -> FloatArray:
        """Return the speeds at heights over the ground, downwards. [m s⁻¹]"""
        falling = self.slow_m_s + self.gain_per_s * (height_m - self.low_m)
        speed = np.where(height_m >= self.high_m, self.fast_m_s, falling)
        return clipped(speed, self.slow_m_s, self.fast_m_s)


def add_landings(
    pieces: Px4Pieces, legs: Px4Legs, *, lands: BoolArray, is_return: BoolArray
) -> None:
    """Add the pieces of moves that are landings, of missions or of returns.

    Below home they are slow from where they would be over it: without a range sensor, of which no parameter
    tells, the ground is taken to be there (``FlightTaskAuto``: ``_dist_to_ground``).  A mission's landing
    disarms as it has landed, or waits to take off again; that of a return disarms
    COM_DISARM_LAND later.

    Notes
    -----
    The trajectory creeps to the place landed on.  Once it stands still over it, the vehicle counts as
    behind all of the time: ``PositionSmoothing::_generateTrajectory`` lets time pass freely only where the
    error points backward.  Recorded: so in all of two landings from standing; from 12 s on in one.
    """
    parameters = legs.parameters
    move = rows_of(lands)
    if not len(move):
        return
    descents = _Descents.over(legs, move)
    lower_m = np.maximum(-descents.ground_m[:, 2], 0.0)
    descents.fall(DescentProfile.of(parameters), -legs.velocity_m_s[move, 2], parameters, lower_m)
    descents.add_to(pieces, move)
    disarm_s = np.where(is_return[move], max(parameters.disarm_delay_s, 0.0), 0.0)
    grounded_s = LANDED_AFTER_S + disarm_s + legs.planned.hold_s[move]
    order = len(descents.parts)
    pieces.add_lines(Places(move, order, RAMP, grounded_s, is_grounded=True), descents.touched_m())


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
    def over(cls, legs: Px4Legs, move: IntArray) -> _Descents:
        """Return landings, which some moves are, about to begin.

        The offset from the place landed on dies away at the rate r of the speed allowed at its beginning.
        What the velocity has beyond that, Δ, does so besides at s = r + a/|Δ|, which asks for the
        acceleration a about: −Δ/(s − r) e^(−s t), taken from the amplitude of the other.
        """
        parameters, ground = legs.parameters, legs.planned.target_m[move]
        above = legs.place_m[move] - ground
        offset = above[:, :2]
        off = horizontal(offset)
        allowed = allowed_speed_m_s(off, 0.0, parameters.acceleration_m_s2, parameters.jerk_m_s3)
        allowed = np.minimum(allowed, legs.planned.speed_m_s[move])
        rate = quotient(allowed, off, 1.0, above=_OVER_M)
        beyond = legs.velocity_m_s[move, :2] + rate[:, None] * offset
        faster = parameters.acceleration_m_s2 / np.maximum(horizontal(beyond), _BEYOND_M_S)
        passing = -beyond / faster[:, None]
        return cls(
            ground_m=ground,
            settling_m=np.stack((offset - passing, passing), axis=-1),
            settling_per_s=np.column_stack((rate, rate + faster)),
            height_m=np.maximum(above[:, 2], 0.0),
            elapsed_s=np.zeros_like(off),
            parts=[],
        )

    def fall(
        self,
        profile: DescentProfile,
        begun_m_s: FloatArray,
        parameters: Px4Parameters,
        lower_m: FloatArray,
    ) -> None:
        """Descend from speeds downwards to the ground, so far below that which decides how fast."""
        a = np.full_like(self.height_m, parameters.acceleration_down_m_s2)
        j = np.full_like(self.height_m, parameters.jerk_m_s3)
        first = profile.speed_m_s(self.height_m - lower_m)
        change = first - begun_m_s
        ramp_s = Px4Ramps.of(np.abs(change), a, j).duration_s
        # A landing from lower than its ramp is taken at its speed throughout.
        fits = 0.5 * (first + begun_m_s) * ramp_s <= self.height_m
        ramps = Px4Ramps.of(np.where(fits, np.abs(change), 0.0), a, j)
        self._ramp(ramps, begun_m_s, np.sign(change))
        self._steadily(profile.fast_m_s, down_to_m=profile.high_m + lower_m)
        self._slow_down(profile, profile.low_m + lower_m)
        slow, crawl = profile.slow_m_s, profile.crawl_m_s
        self._steadily(slow, down_to_m=profile.crawl_height_m)
        change = np.where(self.height_m > 0.0, max(slow - crawl, 0.0), 0.0)
        braked = 0.5 * (slow + crawl) * Px4Ramps.of(change, a, j).duration_s
        fits = (braked <= self.height_m) & (profile.crawl_height_m > 0.0)
        ramps = Px4Ramps.of(np.where(fits, max(slow - crawl, 0.0), 0.0), a, j)
        self._ramp(ramps, np.full_like(first, slow), -1.0)
        self._steadily(crawl, down_to_m=0.0)

    def touched_m(self) -> FloatArray:
        """Return where landings touch the ground. (k, 3) [m]"""
        place = self.ground_m.copy()
        fading = np.exp(-self.settling_per_s * self.elapsed_s[:, None])
        place[:, :2] += dot(self.settling_m, fading[:, None, :])
        return place

    def resting_from_s(self) -> FloatArray:
        """Return from when trajectories rest over the place landed on. (k,) [s]"""
        off = horizontal(self.settling_m[:, :, 0])
        left = np.log(np.maximum(off / _RESTS_M, 1.0))
        creeping_s = np.divide(left, self.settling_per_s[:, 0], out=0.0 * off, where=left > 0.0)
        fine = greatest(np.abs(self.ground_m[:, :2])) <= _FINE_M
        return np.where(fine, creeping_s, np.inf)

    def add_to(self, pieces: Px4Pieces, move: IntArray) -> None:
        """Add the parts as pieces, each at its mean time scale."""
        count = len(self.parts)
        rows = np.tile(np.arange(len(move)), count)
        begun, duration, height, amplitude = (
            np.concatenate(column) for column in list(zip(*self.parts, strict=True))[:4]
        )
        coefficients = np.zeros((len(rows), 3, 4))
        coefficients[:, :, 0] = self.ground_m[rows]
        coefficients[:, 2] += height
        creeping = clipped(np.tile(self.resting_from_s(), count) - begun, 0.0, duration)
        time_scale = pieces.time_scale
        flown_s = creeping / time_scale.upright + (duration - creeping) / time_scale.standing
        across = self.settling_per_s[rows]
        order = np.repeat(np.arange(count), len(move))
        pieces.add(
            Places(move[rows], order, RAMP, duration, quotient(duration, flown_s, 1.0)),
            coefficients,
            Settlings(
                level_m=self.settling_m[rows] * np.exp(-across * begun[:, None])[:, None],
                level_per_s=across,
                height_m=amplitude,
                height_per_s=np.repeat([part[4] for part in self.parts], len(move)),
            ),
        )

    def _ramp(self, ramps: Px4Ramps, from_m_s: FloatArray, sign: FloatArray | float) -> None:
        """Change the speed downwards."""
        speed, acceleration = from_m_s, np.zeros_like(from_m_s)
        jerk = sign * ramps.jerk_m_s3
        for duration, j in ((ramps.jerk_s, jerk), (ramps.steady_s, 0.0), (ramps.back_s, -jerk)):
            self._go_on(duration, speed, acceleration, j)
            speed = speed + duration * (acceleration + 0.5 * j * duration)
            acceleration = acceleration + j * duration

    def _steadily(self, speed_m_s: float, *, down_to_m: FloatArray | float) -> None:
        self._go_on(np.maximum(self.height_m - down_to_m, 0.0) / speed_m_s, speed_m_s)

    def _go_on(
        self,
        duration_s: FloatArray,
        speed_m_s: FloatArray | float,
        acceleration_m_s2: FloatArray | float = 0.0,
        jerk_m_s3: FloatArray | float = 0.0,
    ) -> None:
        """Add a part at constant jerk."""
        cubic = np.empty((len(duration_s), 4))
        powers = (self.height_m, -speed_m_s, -0.5 * acceleration_m_s2, -jerk_m_s3 / 6.0)
        for power, column in enumerate(powers):
            cubic[:, power] = column
        self.parts.append((self.elapsed_s, duration_s, cubic, np.zeros_like(duration_s), 0.0))
        t = duration_s
        way = t * (speed_m_s + t * (0.5 * acceleration_m_s2 + jerk_m_s3 * t / 6.0))
        self.height_m = self.height_m - way
        self.elapsed_s = self.elapsed_s + t

    def _slow_down(self, profile: DescentProfile, low: FloatArray) -> None:
        """Let the speed fall in proportion to the height above the slow part, an exponential of time."""
        gain = profile.gain_per_s
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


_LEAST_PART = 0.5
"""Of b, that of a braking law which leads to a stop: below it the vehicle is too fast. [-]"""
_ASTRAY_M = 0.1
"""Distance from its target at which a straight may pass and yet lead to it. [m]"""


def arrivals(legs: Px4Legs) -> tuple[FloatArray, FloatArray]:
    """Return where straights end, and the velocities there. (n, 3) each [m], [m s⁻¹]"""
    limits, speed = legs.limits, legs.straights.braking.end_m_s
    moving = (limits.length_m > STILL_M)[:, None]
    place = legs.straight_m + limits.direction * limits.length_m[:, None]
    stepped = legs.weaves.is_stepped[:, None]
    begun = np.where(stepped, legs.weaves.end_m_s, legs.velocity_m_s)
    return place, np.where(moving, limits.direction * speed[:, None], begun)


def creeps(legs: Px4Legs) -> tuple[IntArray, FloatArray]:
    """Return the k moves that end in a hold which goes on braking to a stop at the target. (k,)

    And b'/2 of the braking laws that lead there from where the legs end, at the speeds they end with.
    """
    part, limits, braking = legs.planned, legs.limits, legs.straights.braking
    moves = part.is_leg & (limits.length_m > STILL_M) & (braking.end_m_s > 0.0)
    rows = rows_of(moves & (part.hold_s > 0.0) & (braking.near.final_m_s == 0.0))
    a, j = braking.near.acceleration_m_s2[rows], braking.near.jerk_m_s3[rows]
    speed = np.maximum(braking.end_m_s[rows], _BEYOND_M_S)
    half_b = a * limits.tail_m[rows] / speed - 0.5 * speed
    fraction = half_b / half_b_m_s(a, j)
    astray_m = lengths(limits.direction[rows] - part.direction[rows]) * part.tail_m[rows]
    leads = (fraction > _LEAST_PART) & (fraction < 1.0 + STILL_M) & (astray_m < _ASTRAY_M)
    return rows[leads], half_b[leads]


def settlings(legs: Px4Legs, rows: IntArray) -> Curves:
    """Return how vehicles in motion settle, in some moves, on the targets near by.

    They take the time to stop and turn back, and for twice the way at the speed allowed at its
    beginning; but no longer than a cubic that does not pass the target, if they can stop in that.
    """
    parameters = legs.parameters
    begin, velocity = (of_each[rows] for of_each in arrivals(legs))
    target, speed = legs.planned.target_m[rows], legs.planned.speed_m_s[rows]
    way = lengths(target - begin)
    toward = quotient(dot(velocity, target - begin), way)
    a, j = parameters.acceleration_m_s2, parameters.jerk_m_s3
    allowed = np.minimum(allowed_speed_m_s(way, 0.0, a, j), speed)
    vertical_m_s, _ = vertical_limits(target[:, 2] > begin[:, 2], parameters)
    stop_s = lengths(velocity) / a + a / j
    straight_s = np.maximum(quotient(3.0 * way, toward, np.inf, above=STILL_M), stop_s)
    return Curves.between(
        begin,
        velocity,
        target,
        np.zeros_like(begin),
        duration_s=np.minimum(quotient(2.0 * way, allowed) + 2.0 * stop_s, straight_s),
        level_m_s=allowed,
        upright_m_s=np.minimum(allowed, vertical_m_s),
    )


def ends_of_moves(legs: Px4Legs) -> tuple[FloatArray, FloatArray]:
    """Return where and how fast moves end, holds included. (n, 3) each [m], [m s⁻¹]"""
    part, limits = legs.planned, legs.limits
    end, velocity = arrivals(legs)
    rows, b = creeps(legs)
    settles = (part.hold_s > 0.0) & (part.is_leg | part.is_wait)
    settles[rows] = False
    held = legs.weaves.is_held
    settles &= ~held
    end[held] = legs.weaves.end_m[held]
    if len(rows):
        direction = limits.direction[rows]
        a = legs.straights.braking.near.acceleration_m_s2[rows]
        left = braked_speed_m_s(legs.straights.braking.end_m_s[rows], part.hold_s[rows], a, b)
        way = left * (left + 2.0 * b) / (2.0 * a)
        end[rows] += direction * (part.tail_m[rows] - way)[:, None]
        velocity[rows] = direction * left[:, None]
    rows = rows_of(settles)
    if len(rows):
        curves, hold = settlings(legs, rows), part.hold_s[rows]
        settle_s = curves.duration_s.sum(axis=1)
        over = (hold >= settle_s)[:, None]
        place, left_m_s = curves.state_at(np.minimum(hold, settle_s))
        end[rows] = np.where(over, part.target_m[rows], place)
        velocity[rows] = np.where(over, 0.0, left_m_s)
    landed = ~part.is_leg & ~part.is_wait
    end[landed], velocity[landed] = part.target_m[landed], 0.0
    return end, velocity


def slowing_at_ends_m_s2(legs: Px4Legs) -> FloatArray:
    """Return the decelerations moves end with and hand on, zero or more. (n,) [m s⁻²]

    That of the braking law flown last, −u̇ = a u/(u + b/2), or what its onset has grown to; none where the
    final speed is reached before the end.
    """
    limits, straights, part = legs.limits, legs.straights, legs.planned
    end = straights.braking.end_m_s
    law = straights.braking.near
    braking = quotient(law.acceleration_m_s2 * end, end + law.half_b_m_s)
    onset = limits.ramp_m_s3 * straights.braking.onset_s
    slowing = np.where(straights.braking.joined_m_s > end + _BEYOND_M_S, braking, onset)
    # Taken back, it leaves no less than what is allowed there: v − a²/2j.
    above = np.maximum(end - limits.laws.lowest_allowed_m_s(limits.tail_m), 0.0)
    most = above * np.sqrt(2.0 * limits.ramp_m_s3 / (above + _ROUNDED_M_S))
    slowing = np.minimum(slowing, most)
    moving = part.is_leg & ~(part.hold_s > 0.0) & (limits.length_m > STILL_M)
    return np.where(moving & (straights.braking.final_m <= STILL_M), slowing, 0.0)


_LEFT_TO_LEG_M = 0.001
"""Least height left to the leg a take-off ends as, which hands on its speed. [m]"""

_TAKEOFF_PHASES = 4
"""Idle, the rest of the thrust ramp, speeding up, and steadily on."""
IDLE_FRACTION = 0.5
"""Part of the thrust ramp that counts as waiting with idle motors: thrust grows evenly to that of the
hover. [-]"""


class Takeoffs(Columns, eq=False):
    """Take-offs as columns of length k."""

    speed_m_s: FloatArray
    """Climb speed near the ground."""
    rise_s: FloatArray
    """Time in which the climb reaches it, at constant acceleration."""
    place_m: FloatArray
    """Where the climb becomes a leg. (k, 3) [m]"""
    is_free: BoolArray
    """Whether that is climbed at MPC_Z_V_AUTO_UP; else MPC_TKO_SPEED holds to the end."""

    @classmethod
    def none(cls, count: int) -> Self:
        """Return those of moves that are none."""
        return cls(
            speed_m_s=np.zeros(count),
            rise_s=np.zeros(count),
            place_m=np.zeros((count, 3)),
            is_free=np.zeros(count, dtype=np.bool_),
        )


def takeoff_band_m(height_m: FloatArray, parameters: Px4Parameters) -> FloatArray:
    """Return how far below their height take-offs count as reached. [m]

    NAV_MC_ALT_RAD; half the height of a take-off lower than that (``is_mission_item_reached``).
    """
    band = np.full_like(height_m, parameters.altitude_acceptance_m)
    return np.where((height_m > 0.0) & (height_m < band), 0.5 * height_m, band)


def make_takeoffs(
    ground_m: FloatArray, target_m: FloatArray, late_s: FloatArray, parameters: Px4Parameters
) -> Takeoffs:
    """Return the beginnings of take-offs from the ground to the heights of targets. (k, 3) each

    Climbs are late by ``late_s`` (k,), as of `LiftOff`.

    Notes
    -----
    COM_SPOOLUP_TIME, then thrust ramps up over MPC_TKO_RAMP_T (``TakeoffHandling``); MPC_TKO_SPEED up to
    MPC_LAND_ALT1 over ground, then the climb speed of missions (``FlightTaskAuto::
    _updateTrajConstraints``).  A low take-off is climbed no faster than it can be braked again, which
    below MPC_LAND_ALT1 is at MPC_TKO_SPEED/MPC_TKO_RAMP_T.
    """
    height = np.maximum(target_m[:, 2] - ground_m[:, 2], 0.0)
    a, j = takeoff_acceleration_m_s2(parameters), parameters.jerk_m_s3
    most = lift_off(parameters).speed_m_s
    rising = most / (2.0 * late_s)
    # The highest speed v with v²/2 rising for the rise, and its braking distance, within the height.
    half, both = half_b_m_s(a, j) / a, 1.0 / rising + 1.0 / a
    fitting = (np.sqrt(half**2 + 2.0 * both * height) - half) / both
    speed = np.minimum(most, fitting)
    risen = 0.5 * speed**2 / rising
    kept = braking_distance_m(speed, 0.0, a, j)
    slow = np.maximum(parameters.land_slow_height_m, risen)
    is_free = height - kept > slow
    upper = np.where(is_free, slow, np.maximum(height - kept, risen))
    # Never above where the take-off counts as reached.
    band = takeoff_band_m(height, parameters)
    upper = np.minimum(upper, np.maximum(height - band - _LEFT_TO_LEG_M, 0.0))
    risen = np.minimum(risen, upper)
    speed = np.sqrt(2.0 * rising * risen)
    place = ground_m.copy()
    place[:, 2] += upper
    return Takeoffs(speed_m_s=speed, rise_s=speed / rising, place_m=place, is_free=is_free)


def add_takeoffs(pieces: Px4Pieces, legs: Px4Legs) -> None:
    """Add the pieces of take-offs.

    Noise does not slow them: the height of the trajectory is kept at the vehicle's, which climbs at the
    speed ordered however far the trajectory's time has come (``_updateTrajConstraints``,
    ``forceSetPosition``).
    """
    parameters = legs.parameters
    move = rows_of(legs.planned.is_takeoff)
    if not len(move):
        return
    takeoffs, up = legs.planned.takeoffs.select(move), np.array([0.0, 0.0, 1.0])
    ground_m, speed_m_s = legs.planned.begins_m[move], takeoffs.speed_m_s
    risen_m = 0.5 * speed_m_s * takeoffs.rise_s
    steady_m = takeoffs.place_m[:, 2] - ground_m[:, 2] - risen_m
    ramp_s = parameters.takeoff_ramp_s
    duration, height, speed, acceleration = np.zeros((4, _TAKEOFF_PHASES, len(move)))
    duration[0] = parameters.spool_up_s + IDLE_FRACTION * ramp_s
    duration[1] = np.maximum(lift_off(parameters).after_s - IDLE_FRACTION * ramp_s, 0.0)
    duration[2], duration[3] = takeoffs.rise_s, quotient(steady_m, speed_m_s)
    height[3], speed[3] = risen_m, speed_m_s
    acceleration[2] = quotient(speed_m_s, takeoffs.rise_s)
    order, row = np.divmod(np.arange(duration.size), len(move))
    pieces.add_lines(
        Places(move[row], order, RAMP, duration.ravel(), is_grounded=order == 0),
        ground_m[row] + height.ravel()[:, None] * up,
        up,
        speed.ravel(),
        acceleration.ravel(),
    )
