"""Legs on the clock of a flight: the pieces of motion and the segments they make, corners included."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.ardupilot.legs import SLOTS
from planner.flight.state import STATE_INDEX, FlightState
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.flight.motion.ardupilot.legs import Legs
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray

STEADY_FRACTION = 0.98
"""A corner passed at this fraction of the cruise is no braking and accelerating. [-]"""
INSTANT_S = 1e-9
"""Shorter pieces are rounding. [s]"""


@frozen(eq=False)
class Pieces:
    """Pieces of motion of one source."""

    start_s: FloatArray
    end_s: FloatArray
    columns: FloatArray
    """Rising powers of the piece's own time for east, north, height, in true metres. (3, 4, p)"""
    is_curved: BoolArray
    is_grounded: BoolArray


@frozen(eq=False)
class SegmentRows:
    """Segments of one source."""

    start_s: FloatArray
    stage: IntArray
    state: IntArray
    speed_m_s: FloatArray
    stopping_distance_m: FloatArray


@frozen(eq=False)
class LegTimes:
    """Legs on the clock of the flight."""

    legs: Legs
    phases: FloatArray
    """Way, speed, half the acceleration, a sixth of the jerk at the beginning of each phase. (n, k, 4)"""
    breaks_s: FloatArray
    """Beginning of each phase. (n, k) [s]"""
    end_s: FloatArray
    begun_s: FloatArray
    """When the leg is the current one: half-way through the corner before. (n,) [s]"""
    reached_s: FloatArray
    """When its end is announced: half-way through the corner after. (n,) [s]"""

    @classmethod
    def of(cls, legs: Legs, start_s: FloatArray) -> LegTimes:
        """Return legs that begin at times. (n,) [s]"""
        phases = legs.curves.phases()
        end = start_s + legs.curves.duration_s
        before = np.zeros(len(end))
        before[1:] = legs.half_overlap_s[:-1]
        return cls(
            legs=legs,
            phases=np.stack(
                (
                    phases.way_m,
                    phases.speed_m_s,
                    0.5 * phases.acceleration_m_s2,
                    phases.jerk_m_s3 / 6.0,
                ),
                axis=-1,
            ),
            breaks_s=start_s[:, None] + phases.start_s,
            end_s=end,
            begun_s=start_s + before,
            reached_s=end - legs.half_overlap_s,
        )

    def pieces(self, per_metre: FloatArray) -> Pieces:
        """Return the sum of the legs under way between any two breaks.

        Parameters
        ----------
        per_metre : ndarray
            True metres in one of the autopilot's, on each axis. (3,)
        """
        legs = self.legs
        direction, begin_m = (legs.direction * per_metre).T, (legs.start_m * per_metre).T
        accelerated, braked = self._cruise()
        leads = legs.direction.any(axis=1)
        # Where legs overlap, one rests yet at its beginning, and already at its end.
        passed = legs.half_overlap_s > 0.0
        entered = np.zeros_like(passed)
        entered[1:] = passed[:-1]
        times = np.sort(
            np.concatenate(
                (
                    self.breaks_s[leads, 1:].ravel(),
                    self.breaks_s[~entered, 0],
                    self.end_s[~passed],
                    self.begun_s,
                    self.reached_s,
                    accelerated,
                    braked,
                )
            ),
            kind="stable",  # merges what is in order already
        )
        kept = np.diff(times, append=np.inf) > INSTANT_S
        times = times[kept]
        start, end = times[:-1], times[1:]
        middle = 0.5 * (start + end)
        latest = np.searchsorted(self.breaks_s[:, 0], middle, side="right") - 1
        flying = middle < self.end_s[latest] if len(times) else np.zeros(0, np.bool_)
        start, end, middle = start[flying], end[flying], middle[flying]
        latest = latest[flying]
        columns = self._along(direction, latest, start, middle)
        columns[:, 0] += np.ascontiguousarray(begin_m).take(latest, axis=1)
        before = np.maximum(latest - 1, 0)
        curved = (latest > 0) & (middle < self.end_s[before])
        if curved.any():
            leg = before[curved]
            share = self._along(direction, leg, start[curved], middle[curved])
            # The way still to go to the waypoint that the leg after counts from.
            share[:, 0] -= direction[:, leg] * legs.curves.length_m[leg]
            columns[..., curved] += share
        return Pieces(
            start_s=start,
            end_s=end,
            columns=columns,
            is_curved=curved,
            is_grounded=np.zeros(len(start), np.bool_),
        )

    def _along(
        self, direction: FloatArray, leg: IntArray, time_s: FloatArray, middle_s: FloatArray
    ) -> FloatArray:
        """Return cubics from ``time_s`` on along legs (3, n), counted from their start. (3, 4, p)"""
        count = self.breaks_s.shape[1]
        begun = np.ascontiguousarray(self.breaks_s.T).take(leg, axis=1) <= middle_s
        phase = np.add.reduce(begun, axis=0, dtype=np.intp) - 1
        at = leg * count + phase
        t = time_s - self.breaks_s.ravel()[at]
        s, v, a, j = self.phases.reshape(-1, 4)[at].T.copy()
        along = np.empty((3, 4, len(leg)))
        powers = (
            s + t * (v + t * (a + t * j)),
            v + t * (2.0 * a + 3.0 * t * j),
            a + 3.0 * t * j,
            j,
        )
        for axis in range(3):
            here = direction[axis, leg]
            for power, value in enumerate(powers):
                np.multiply(here, value, out=along[axis, power])
        return along

    def _cruise(self) -> tuple[FloatArray, FloatArray]:
        """Return when accelerating ends and when braking begins; one moment without a cruise."""
        accelerated, braked = self.breaks_s[:, -5], self.breaks_s[:, -4]
        middle = braked - self.legs.curves.down.rest_s
        cruising = self.legs.curves.cruise_s > INSTANT_S
        return np.where(cruising, accelerated, middle), np.where(cruising, braked, middle)

    def segments(self, stopping_distance_m: Callable[[FloatArray], FloatArray]) -> SegmentRows:
        """Return the segments of the legs: accelerate, cruise, brake; climb or descend; hover."""
        legs = self.legs
        count = len(legs.key)
        level = np.hypot(legs.direction[:, 0], legs.direction[:, 1])
        upward = legs.direction[:, 2]
        peak = legs.curves.peak_m_s
        entered = legs.curves.start_m_s.copy()
        entered[1:] = np.maximum(entered[1:], legs.corner_speed_m_s[:-1])
        steady = STEADY_FRACTION * peak
        accelerated, braked = self._cruise()
        single = level <= np.abs(upward)
        accelerated = np.where(single | (entered >= steady), self.begun_s, accelerated)
        braked = np.where(single | (legs.corner_speed_m_s >= steady), self.reached_s, braked)
        only = np.select(
            [upward > 0.0, upward < 0.0],
            [STATE_INDEX[FlightState.CLIMB], STATE_INDEX[FlightState.DESCEND]],
            STATE_INDEX[FlightState.HOVER],
        )
        start = np.concatenate((self.begun_s, accelerated, braked))
        end = np.concatenate((accelerated, braked, self.reached_s))
        states = [
            STATE_INDEX[s] for s in (FlightState.ACCELERATE, FlightState.CRUISE, FlightState.BRAKE)
        ]
        state = np.repeat(states, count)
        state[count : 2 * count][single] = only[single]
        speed = peak * np.where(single, np.abs(upward), level)
        stopping = np.full((3, count), np.nan)
        stopping[1:] = np.where(single, np.nan, stopping_distance_m(legs.flown_peak_m_s * level))
        lasting = end - start > INSTANT_S
        return SegmentRows(
            start_s=start[lasting],
            stage=np.tile(legs.key // SLOTS, 3)[lasting],
            state=state[lasting],
            speed_m_s=np.tile(speed, 3)[lasting],
            stopping_distance_m=stopping.ravel()[lasting],
        )
