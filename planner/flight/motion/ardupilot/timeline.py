"""Legs and manoeuvres put one after the other in time: the pieces and segments of a flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.ardupilot.legs import SLOTS
from planner.flight.motion.kinematics import (
    STATE_INDEX,
    CircleLaw,
    Columns,
    FlightState,
    Motion,
    PolynomialLaw,
    SegmentColumns,
    horizontal,
    is_nonzero,
    summed,
)
from planner.physics.quadrature import unit_quadrature
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.motion.ardupilot.circles import Circles
    from planner.flight.motion.ardupilot.legs import ArduPilotLegs
    from planner.flight.motion.kinematics import Manoeuvres


STEADY_FRACTION = 0.98
"""A corner passed at this fraction of the cruise is no braking and accelerating. [-]"""
INSTANT_S = 1e-9
"""Shorter pieces are rounding. [s]"""


class ArduPilotPieces(Value, eq=False):
    """Cubic pieces of the legs, or of one kind of manoeuvre, one per column."""

    start_s: FloatArray
    end_s: FloatArray
    columns: FloatArray
    """Rising powers of the piece's own time for east, north, height, in true metres. (3, 4, p)"""
    is_curved: BoolArray
    is_grounded: BoolArray


class FlownSegments(Columns, eq=False):
    """Segments of the legs, or of one kind of manoeuvre, one per row."""

    start_s: FloatArray
    stage: IntArray
    state: IntArray
    speed_m_s: FloatArray
    stopping_distance_m: FloatArray


class LegTimes(Value, eq=False):
    """Legs on the clock of the flight."""

    legs: ArduPilotLegs
    phases: FloatArray
    """Way, speed, half the acceleration, a sixth of the jerk at the beginning of each phase. (n, k, 4)"""
    breaks_s: FloatArray
    """Beginning of each phase. (n, k) [s]"""
    end_s: FloatArray
    begun_s: FloatArray
    """When the leg is the current one: half-way through the corner before, or out of a circle. (n,) [s]"""
    reached_s: FloatArray
    """When its end is announced: half-way through the corner after. (n,) [s]"""

    @classmethod
    def of(cls, legs: ArduPilotLegs, start_s: FloatArray) -> LegTimes:
        """Return legs that begin at times. (n,) [s]"""
        phases, end = legs.curves.phases(), start_s + legs.curves.duration_s
        acceleration, jerk = 0.5 * phases.acceleration_m_s2, phases.jerk_m_s3 / 6.0
        before = np.concatenate((np.zeros(1), legs.half_overlap_s))[: len(end)]
        reached_s = end - legs.half_overlap_s
        begun_s = start_s + np.maximum(before, legs.hidden_s)
        return cls(
            legs=legs,
            phases=np.stack((phases.way_m, phases.speed_m_s, acceleration, jerk), axis=-1),
            breaks_s=start_s[:, None] + phases.start_s,
            end_s=end,
            begun_s=np.where(legs.early_s > legs.hidden_s, reached_s, begun_s),
            reached_s=reached_s,
        )

    def braking_s(self) -> FloatArray:
        """Return when the autopilot begins to brake for the end of each leg, and when it has. (n, 2) [s]"""
        return np.column_stack((self.end_s - self.legs.curves.down.duration_s, self.end_s))

    def pieces(self, per_metre: FloatArray) -> ArduPilotPieces:
        """Return the sum of the legs under way between any two breaks, in true metres."""
        legs = self.legs
        direction, begin_m = (legs.direction * per_metre).T, (legs.start_m * per_metre).T
        accelerated, braked = self._cruise()
        flown = is_nonzero(legs.direction)
        # Where legs overlap, one rests yet at its beginning, and already at its end.
        passed = legs.half_overlap_s > 0.0
        entered = np.zeros_like(passed)
        entered[1:] = passed[:-1]
        is_shown = self.breaks_s > np.where(legs.hidden_s > 0.0, self.begun_s, -np.inf)[:, None]
        entered |= legs.hidden_s > 0.0
        times = np.sort(
            np.concatenate(
                (
                    self.breaks_s[flown, 1:][is_shown[flown, 1:]],
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
        shown_s = self.breaks_s[:, 0] + legs.hidden_s
        flying = (middle > shown_s[latest]) & (middle < self.end_s[latest])
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
        return ArduPilotPieces(
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
        phase = np.add.reduce(begun, axis=0, dtype=np.int8) - 1  # of a dozen
        at = leg * count + phase
        t = time_s - self.breaks_s.ravel()[at]
        s, v, a, j = self.phases.reshape(-1, 4)[at].T.copy()
        powers = np.stack(
            (s + t * (v + t * (a + t * j)), v + t * (2.0 * a + 3.0 * t * j), a + 3.0 * t * j, j)
        )
        return np.asarray(direction[:, None, leg] * powers)

    def _cruise(self) -> tuple[FloatArray, FloatArray]:
        """Return when accelerating ends and when braking begins; one moment without a cruise."""
        accelerated, braked = self.breaks_s[:, -5], self.breaks_s[:, -4]
        middle = braked - self.legs.curves.down.rest_s
        cruising = self.legs.curves.cruise_s > INSTANT_S
        return np.where(cruising, accelerated, middle), np.where(cruising, braked, middle)

    def segments(self, stopping_distance_m: Callable[[FloatArray], FloatArray]) -> FlownSegments:
        """Return the segments of the legs: accelerate, cruise, brake; climb or descend; hover."""
        legs = self.legs
        count = len(legs.key)
        level, upward = horizontal(legs.direction), legs.direction[:, 2]
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
        return FlownSegments(
            start_s=start,
            stage=np.tile(legs.key // SLOTS, 3),
            state=state,
            speed_m_s=np.tile(speed, 3),
            stopping_distance_m=stopping.ravel(),
        ).select(end - start > INSTANT_S)


_NODES, _WEIGHTS = unit_quadrature(3)


def make_motion(
    legs: ArduPilotLegs,
    manoeuvres: Sequence[Manoeuvres],
    circles: Circles,
    *,
    item: IntArray,
    scale: tuple[float, float],
    stopping_distance_m: Callable[[FloatArray], FloatArray],
    findings: tuple[Finding, ...],
) -> Motion:
    """Return the motion of legs, manoeuvres and circles in the order of their keys.

    ``scale`` is the autopilot's metres per metre, eastward and northward.
    """
    steady = np.flatnonzero(circles.steady_s > INSTANT_S)
    key = np.concatenate(
        (legs.key, *(m.key for m in manoeuvres), circles.stage[steady] * SLOTS + 2)
    )
    duration = np.concatenate(
        (
            legs.curves.duration_s - 2.0 * legs.half_overlap_s - legs.hidden_s,
            *(summed(m.duration_s) for m in manoeuvres),
            circles.steady_s[steady],
        )
    )
    order = np.argsort(key, kind="stable")
    start = np.empty(len(key))
    end = np.cumsum(duration[order])
    start[order] = end - duration[order]
    total_s = float(end[-1]) if len(end) else 0.0
    counts = np.cumsum([len(legs.key), *(len(m.key) for m in manoeuvres)])
    leg_start, *manoeuvre_start, circle_start = np.split(start, counts)

    per_metre = np.array([1.0 / scale[0], 1.0 / scale[1], 1.0])
    timed = LegTimes.of(legs, leg_start - legs.early_s)
    sources, segments = [timed.pieces(per_metre)], [timed.segments(stopping_distance_m)]
    for manoeuvre, begin in zip(manoeuvres, manoeuvre_start, strict=True):
        sources.append(_manoeuvre_pieces(manoeuvre, begin, per_metre))
        segments.append(_manoeuvre_segments(manoeuvre, begin, stopping_distance_m))
    flown = FlownSegments.joined(segments)
    flown = flown.select(np.lexsort((flown.stage, flown.start_s)))
    begin, stage = flown.start_s, flown.stage

    cubic = np.concatenate([source.columns for source in sources], axis=-1)
    rows = [cubic.shape[-1], len(steady)]
    start = np.concatenate([*(source.start_s for source in sources), circle_start])
    order = np.argsort(start, kind="stable")
    start = start[order]
    duration = np.diff(start, append=total_s)
    piece_segment = np.searchsorted(begin, start + 0.5 * duration, side="right") - 1
    way, rise = _ways(
        cubic,
        np.concatenate([source.end_s - source.start_s for source in sources]),
        np.concatenate([source.is_curved for source in sources]),
    )
    distance_m, climb_m = (
        np.bincount(piece_segment, np.concatenate(both)[order], len(begin)).astype(np.float64)
        for both in ((way, circles.way_m[steady]), (rise, np.zeros(len(steady))))
    )
    idle = [*(source.is_grounded for source in sources), np.zeros(len(steady), np.bool_)]
    done = np.searchsorted(stage, np.arange(len(item)), side="right") - 1
    # Braking out of a circle comes after its last turn.
    leaving = np.zeros(len(item), np.bool_)
    leaving[circles.stage] = done[circles.stage] > 0
    circle = circles.law.select(steady)
    braking_s = np.full((len(item), 2), np.nan)
    braking_s[legs.key // SLOTS] = timed.braking_s()
    return Motion(
        segments=SegmentColumns(
            item=item[stage],
            state=flown.state,
            duration_s=np.diff(begin, append=total_s),
            distance_m=distance_m,
            climb_m=climb_m,
            speed_m_s=flown.speed_m_s,
            stopping_distance_m=flown.stopping_distance_m,
        ),
        laws=(
            PolynomialLaw(coefficients=cubic.transpose(2, 0, 1)),
            CircleLaw(
                start_m=circle.start_m * per_metre,
                centre_m=circle.centre_m * per_metre[:2],
                rate_rad_s=circle.rate_rad_s,
            ),
        ),
        piece_segment=piece_segment,
        piece_law=np.repeat([0, 1], rows)[order],
        piece_row=np.concatenate([np.arange(count) for count in rows])[order],
        piece_offset_s=np.zeros(len(order)),
        piece_duration_s=duration,
        arrival_segment=done - leaving,
        done_segment=done,
        braking_s=braking_s,
        piece_is_grounded=np.concatenate(idle)[order],
        findings=findings,
    )


def _manoeuvre_pieces(
    manoeuvres: Manoeuvres, start_s: FloatArray, per_metre: FloatArray
) -> ArduPilotPieces:
    """Return the pieces of manoeuvres that begin at times, in true metres."""
    duration = manoeuvres.duration_s
    end = start_s[:, None] + np.cumsum(duration, axis=1)
    kept = duration > INSTANT_S
    return ArduPilotPieces(
        start_s=(end - duration)[kept],
        end_s=end[kept],
        columns=(manoeuvres.coefficients[kept] * per_metre[:, None]).transpose(1, 2, 0),
        is_curved=np.ones(kept.sum(), np.bool_),
        is_grounded=np.broadcast_to(manoeuvres.is_grounded, kept.shape)[kept],
    )


def _manoeuvre_segments(
    manoeuvres: Manoeuvres,
    start_s: FloatArray,
    stopping_distance_m: Callable[[FloatArray], FloatArray],
) -> FlownSegments:
    """Return one segment per manoeuvre that lasts."""
    lasting = summed(manoeuvres.duration_s) > INSTANT_S
    stopping = manoeuvres.stopping_distance_m
    if manoeuvres.state is FlightState.CRUISE:
        stopping = stopping_distance_m(manoeuvres.speed_m_s)
    return FlownSegments(
        start_s=start_s,
        stage=manoeuvres.key // SLOTS,
        state=np.full(len(lasting), STATE_INDEX[manoeuvres.state]),
        speed_m_s=manoeuvres.speed_m_s,
        stopping_distance_m=stopping,
    ).select(lasting)


def _ways(
    cubic: FloatArray, duration_s: FloatArray, is_curved: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return horizontal way and rise of cubic pieces, (3, 4, p). (p,) each [m]

    A straight piece's way is the distance of its ends; a curved one's is integrated by Gauss-Legendre
    quadrature, exact to a millimetre for the short pieces of a corner.
    """
    t = duration_s
    east, north, rise = (t * (c1 + t * (c2 + t * c3)) for _, c1, c2, c3 in cubic)
    way = np.sqrt(east**2 + north**2)
    bent = cubic[:2, 1:, is_curved]
    mean = np.zeros(bent.shape[-1])
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        t = node * duration_s[is_curved]
        east, north = (c1 + t * (2.0 * c2 + 3.0 * t * c3) for c1, c2, c3 in bent)
        mean += weight * np.sqrt(east**2 + north**2)
    way[is_curved] = mean * duration_s[is_curved]
    return way, rise
