"""Legs and manoeuvres put one after the other in time: the pieces and segments of a flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.ardupilot.leg_times import (
    INSTANT_S,
    LegTimes,
    Pieces,
    SegmentRows,
)
from planner.flight.motion.ardupilot.legs import SLOTS
from planner.flight.motion.kinematics import CircleLaw, Motion, PolynomialLaw, SegmentColumns
from planner.flight.state import STATE_INDEX, FlightState
from planner.physics.quadrature import unit_quadrature

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.findings import Finding
    from planner.flight.motion.ardupilot.circles import Circles
    from planner.flight.motion.ardupilot.legs import Legs
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.flight.motion.manoeuvres import Manoeuvres

_NODES, _WEIGHTS = unit_quadrature(3)


def make_motion(
    legs: Legs,
    manoeuvres: Sequence[Manoeuvres],
    circles: Circles,
    *,
    item: IntArray,
    scale: tuple[float, float],
    stopping_distance_m: Callable[[FloatArray], FloatArray],
    findings: tuple[Finding, ...],
) -> Motion:
    """Return the motion of legs, manoeuvres and circles in the order of their keys.

    Parameters
    ----------
    legs : Legs
        Straight legs.
    manoeuvres : sequence of Manoeuvres
        Everything else in cubic pieces.
    circles : Circles
        Turns about places.
    item : ndarray of int
        Item of each stage. (stages,)
    scale : tuple of float
        The autopilot's metres per metre, eastward and northward.
    stopping_distance_m : callable
        From speeds to ways to stand still.
    findings : tuple of Finding
        What has to be said of the motion.
    """
    key = np.concatenate((legs.key, *(m.key for m in manoeuvres), circles.key))
    duration = np.concatenate(
        (
            legs.curves.duration_s - 2.0 * legs.half_overlap_s,
            *(m.duration_s.sum(axis=1) for m in manoeuvres),
            circles.duration_s,
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
    timed = LegTimes.of(legs, leg_start)
    sources = [
        timed.pieces(per_metre),
        *(
            _manoeuvre_pieces(m, begin, per_metre)
            for m, begin in zip(manoeuvres, manoeuvre_start, strict=True)
        ),
    ]
    segments = [
        timed.segments(stopping_distance_m),
        *(
            _manoeuvre_segments(m, begin, stopping_distance_m)
            for m, begin in zip(manoeuvres, manoeuvre_start, strict=True)
        ),
    ]
    if len(circles.key):
        segments.append(
            SegmentRows(
                start_s=circle_start,
                stage=circles.key // SLOTS,
                state=np.full(len(circles.key), STATE_INDEX[FlightState.CRUISE]),
                speed_m_s=circles.speed_m_s,
                stopping_distance_m=stopping_distance_m(circles.speed_m_s),
            )
        )
    return _joined(
        sources,
        segments,
        circles,
        circle_start,
        total_s=total_s,
        item=item,
        per_metre=per_metre,
        findings=findings,
    )


def _manoeuvre_pieces(manoeuvres: Manoeuvres, start_s: FloatArray, per_metre: FloatArray) -> Pieces:
    """Return the pieces of manoeuvres that begin at times, in true metres."""
    duration = manoeuvres.duration_s
    end = start_s[:, None] + np.cumsum(duration, axis=1)
    kept = duration > INSTANT_S
    return Pieces(
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
) -> SegmentRows:
    """Return one segment per manoeuvre that lasts."""
    lasting = manoeuvres.duration_s.sum(axis=1) > INSTANT_S
    stopping = manoeuvres.stopping_distance_m
    if manoeuvres.state is FlightState.CRUISE:
        stopping = stopping_distance_m(manoeuvres.speed_m_s)
    return SegmentRows(
        start_s=start_s[lasting],
        stage=(manoeuvres.key // SLOTS)[lasting],
        state=manoeuvres.state_index[lasting],
        speed_m_s=manoeuvres.speed_m_s[lasting],
        stopping_distance_m=stopping[lasting],
    )


def _joined(
    sources: Sequence[Pieces],
    segments: Sequence[SegmentRows],
    circles: Circles,
    circle_start_s: FloatArray,
    *,
    total_s: float,
    item: IntArray,
    per_metre: FloatArray,
    findings: tuple[Finding, ...],
) -> Motion:
    """Return the motion of pieces and segments of several sources, put into order."""
    cubic = np.concatenate([source.columns for source in sources], axis=-1)
    circle = circles.law
    round_law = CircleLaw(
        start_m=circle.start_m * per_metre,
        centre_m=circle.centre_m * per_metre[:2],
        rate_rad_s=circle.rate_rad_s,
    )
    cubics, rounds = cubic.shape[-1], len(circles.key)
    start = np.concatenate([*(source.start_s for source in sources), circle_start_s])
    order = np.argsort(start, kind="stable")
    start = start[order]
    duration = np.diff(start, append=total_s)
    law = np.repeat([0, 1], [cubics, rounds])[order]
    row = np.concatenate((np.arange(cubics), np.arange(rounds)))[order]
    way, height = _ways(
        cubic,
        np.concatenate([source.end_s - source.start_s for source in sources]),
        np.concatenate([source.is_curved for source in sources]),
    )
    idle = np.concatenate([source.is_grounded for source in sources])
    level = np.zeros(rounds)
    distance, rise, grounded = (
        np.concatenate(both)[order]
        for both in (
            (way, circles.speed_m_s * circles.duration_s),
            (height, level),
            (idle, level > 0.0),
        )
    )

    begin = np.concatenate([s.start_s for s in segments])
    sequence = np.lexsort((np.concatenate([s.stage for s in segments]), begin))
    begin = begin[sequence]
    stage, state, speed, stopping = (
        np.concatenate([getattr(s, name) for s in segments])[sequence]
        for name in ("stage", "state", "speed_m_s", "stopping_distance_m")
    )
    piece_segment = np.searchsorted(begin, start + 0.5 * duration, side="right") - 1
    distance_m, climb_m = np.zeros(len(begin)), np.zeros(len(begin))
    distance_m += np.bincount(piece_segment, weights=distance, minlength=len(begin))
    climb_m += np.bincount(piece_segment, weights=rise, minlength=len(begin))
    done = np.searchsorted(stage, np.arange(len(item)), side="right") - 1
    # Braking out of a circle comes after its last turn.
    leaving = (done > 0) & np.isin(np.arange(len(item)), circles.key // SLOTS)
    return Motion(
        segments=SegmentColumns(
            item=item[stage],
            state=state,
            duration_s=np.diff(begin, append=total_s),
            distance_m=distance_m,
            climb_m=climb_m,
            speed_m_s=speed,
            stopping_distance_m=stopping,
        ),
        laws=(PolynomialLaw(coefficients=cubic.transpose(2, 0, 1)), round_law),
        piece_segment=piece_segment,
        piece_law=law,
        piece_row=row,
        piece_offset_s=np.zeros(len(order)),
        piece_duration_s=duration,
        arrival_segment=done - leaving,
        done_segment=done,
        piece_is_grounded=grounded,
        findings=findings,
    )


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
