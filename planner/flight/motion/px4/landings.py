"""Landings: from over the place, down to the ground, landed and disarmed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.laws import SettlingLaw
from planner.flight.motion.px4.pieces import RAMP, Lines, Places
from planner.flight.motion.px4.ramps import Ramps
from planner.flight.motion.px4.speeds import allowed_speed_m_s
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.pace import Pace
    from planner.flight.motion.px4.pieces import Pieces
    from planner.vehicle.parameters.px4 import Px4Parameters

LANDED_AFTER_S = 3.6
"""From touch-down to the landed flag with a range sensor, which cannot see the ground it stands on:
three times 1 s, and 0.6 s until the thrust has gone (measured; ``MulticopterLandDetector``). [s]"""
LANDED_AFTER_BLIND_S = 1.6
"""The same without a range sensor: three times a third of a second. [s]"""

_STANDS_M = 1e-5
"""Way left that has no direction any more (``matrix::Vector::unit_or_zero``): the trajectory stands. [m]"""
_BEYOND_M_S = 1e-9
"""Velocity that is none. [m s⁻¹]"""
_FINE_M = 2.0
"""Distance from its origin, about home, up to which a trajectory in single precision comes so near; farther
away its steps get lost, and it creeps for ever. [m]"""


@frozen
class DescentProfile:
    """How fast a landing descends, by height over the ground.

    Notes
    -----
    ``FlightTaskAuto::_prepareLandSetpoints``: MPC_LAND_SPEED below MPC_LAND_ALT2, rising in proportion
    to the height to MPC_Z_VEL_MAX_DN at MPC_LAND_ALT1, no more than MPC_Z_V_AUTO_DN; MPC_LAND_CRWL below
    MPC_LAND_ALT3 with a range sensor.
    """

    fast_m_s: float
    slow_m_s: float
    crawl_m_s: float
    high_m: float
    """Height below which the speed falls."""
    low_m: float
    """Height below which it is slow."""
    crawl_height_m: float
    """Height below which it crawls; zero without a range sensor."""
    gain_per_s: float
    """Speed per height in between."""

    @classmethod
    def of(cls, parameters: Px4Parameters, *, has_range_sensor: bool) -> DescentProfile:
        """Return the profile of a vehicle."""
        fast, full = parameters.descent_speed_m_s, parameters.descent_speed_max_m_s
        slow = min(parameters.land_speed_m_s, fast)
        low = parameters.land_slowest_height_m
        high = max(parameters.land_slow_height_m, low)
        gain = (full - slow) / (high - low) if high > low and full > slow else 0.0
        crawls = has_range_sensor and parameters.land_crawl_speed_m_s < slow
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
    pieces: Pieces,
    move: IntArray,
    place_m: FloatArray,
    velocity_m_s: FloatArray,
    ground_m: FloatArray,
    *,
    is_return: BoolArray,
    parameters: Px4Parameters,
    pace: Pace,
    has_range_sensor: bool,
) -> None:
    """Add the pieces of landings.

    Parameters
    ----------
    pieces : Pieces
        To add to.
    move : ndarray of int
        Moves that are landings. (k,)
    place_m, velocity_m_s, ground_m : ndarray
        Where and how fast they begin, and the places landed on. (k, 3) [m, m s⁻¹]
    is_return : ndarray of bool
        Whether a return lands, which disarms COM_DISARM_LAND after it has landed; a mission's landing
        disarms at once. (k,)
    parameters : Px4Parameters
        The vehicle's.
    pace : Pace
        How fast PX4's time passes.
    has_range_sensor : bool
        Whether the vehicle measures its distance to the ground.

    Notes
    -----
    The trajectory creeps to the place landed on.  Once it stands still over it, the vehicle counts as
    behind all of the time: ``PositionSmoothing::_generateTrajectory`` lets time pass freely only where the
    error points backward.  Recorded: so in all of two landings from standing; from 12 s on in one.
    """
    if not len(move):
        return
    descents = _Descents.over(place_m, velocity_m_s, ground_m, parameters)
    profile = DescentProfile.of(parameters, has_range_sensor=has_range_sensor)
    descents.fall(profile, -velocity_m_s[:, 2], parameters)
    descents.add_to(pieces, move, pace)
    landed = LANDED_AFTER_S if has_range_sensor else LANDED_AFTER_BLIND_S
    disarmed = landed + np.where(is_return, max(parameters.disarm_delay_s, 0.0), 0.0)
    zero = np.zeros(len(move))
    pieces.add_lines(
        Places(
            move=move,
            order=np.full(len(move), len(descents.parts)),
            slot=np.full(len(move), RAMP),
            duration_s=disarmed,
            pace=np.ones(len(move)),
        ),
        Lines(
            place_m=descents.touched_m(),
            direction=np.zeros((len(move), 3)),
            speed_m_s=zero,
            acceleration_m_s2=zero,
            jerk_m_s3=zero,
        ),
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
        allowed = allowed_speed_m_s(
            off,
            np.zeros_like(off),
            acceleration_m_s2=np.full_like(off, parameters.acceleration_m_s2),
            jerk_m_s3=np.full_like(off, parameters.jerk_m_s3),
        )
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
        limits = {
            "acceleration_m_s2": np.full_like(self.height_m, parameters.acceleration_down_m_s2),
            "jerk_m_s3": np.full_like(self.height_m, parameters.jerk_m_s3),
        }
        first = profile.speed_m_s(self.height_m)
        change = first - begun_m_s
        ramp = Ramps.of(np.abs(change), **limits)
        # A landing from lower than its ramp is taken at its speed throughout.
        fits = 0.5 * (first + begun_m_s) * ramp.duration_s <= self.height_m
        ramp = Ramps.of(np.where(fits, np.abs(change), 0.0), **limits)
        self._ramp(ramp, begun_m_s, np.sign(change))
        self._steadily(profile.fast_m_s, down_to_m=profile.high_m)
        self._slow_down(profile)
        self._steadily(profile.slow_m_s, down_to_m=profile.crawl_height_m)
        change = np.full_like(first, profile.slow_m_s - profile.crawl_m_s)
        ramp = Ramps.of(np.where(self.height_m > 0.0, np.maximum(change, 0.0), 0.0), **limits)
        braked = 0.5 * (profile.slow_m_s + profile.crawl_m_s) * ramp.duration_s
        fits = (braked <= self.height_m) & (profile.crawl_height_m > 0.0)
        ramp = Ramps.of(np.where(fits, np.maximum(change, 0.0), 0.0), **limits)
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

    def add_to(self, pieces: Pieces, move: IntArray, pace: Pace) -> None:
        """Add the parts as pieces, each at its mean pace."""
        count = len(self.parts)
        rows = np.tile(np.arange(len(move)), count)
        begun = np.concatenate([part[0] for part in self.parts])
        coefficients = np.zeros((len(rows), 3, 4))
        coefficients[:, :, 0] = self.ground_m[rows]
        coefficients[:, 2] += np.concatenate([part[2] for part in self.parts])
        across = self.settling_per_s[rows][:, None, :]
        duration = np.concatenate([part[1] for part in self.parts])
        creeping = np.clip(np.tile(self.standing_from_s(), count) - begun, 0.0, duration)
        flown_s = creeping / pace.upright + (duration - creeping) / pace.standing
        lasts = duration > 0.0
        fading = np.repeat([part[4] for part in self.parts], len(move))
        amplitude, rate = np.zeros((len(rows), 3, 2)), np.zeros((len(rows), 3, 2))
        amplitude[:, :2] = self.settling_m[rows] * np.exp(-across * begun[:, None, None])
        amplitude[:, 2, 0] = np.concatenate([part[3] for part in self.parts])
        rate[:, :2], rate[:, 2, 0] = across, fading
        pieces.add_settlings(
            Places(
                move=move[rows],
                order=np.repeat(np.arange(count), len(move)),
                slot=np.full(len(rows), RAMP),
                duration_s=duration,
                pace=np.divide(duration, flown_s, out=np.ones_like(duration), where=lasts),
            ),
            SettlingLaw(
                coefficients=coefficients,
                amplitude_m=amplitude,
                rate_per_s=rate,
            ),
        )

    def _offset_m(self, time_s: FloatArray) -> FloatArray:
        fading = np.exp(-self.settling_per_s * time_s[:, None])
        offset: FloatArray = (self.settling_m * fading[:, None, :]).sum(axis=-1)
        return offset

    def _ramp(self, ramps: Ramps, from_m_s: FloatArray, sign: FloatArray | float) -> None:
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
