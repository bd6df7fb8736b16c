"""The lines a flight is judged along: the path it flies, and the returns from anywhere on it.

A path is straight pieces that stay within a tolerance of the motion.

Nothing is left out between two samples: each piece of motion is written as the control points of a
cubic, which the curve stays in the hull of, and is divided until that hull is flat.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import PathTooLongError
from planner.flight.motion.kinematics import (
    STATE_INDEX,
    CircleLaw,
    Columns,
    FlightState,
    PolynomialLaw,
    horizontal,
    lengths,
)
from planner.flight.motion.steps import SpeedPulseLaw, VerticalStepLaw
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion

PATH_TOLERANCE_M = 0.05
"""How far a motion may be from the straight pieces of its path. [m]"""
_BRAKE = STATE_INDEX[FlightState.BRAKE]
_FIRST_PARTS = 4
"""Parts a piece that is no polynomial is divided into at first: its cubics are then good to 1 mm."""
_MOST_PARTS = 4000
_VERTICAL_PART_S = 0.25
"""Heights that answer a step are cubics for so long: good to 1 cm. [s]"""
_SAME_PLACE_M = 1e-3
"""A motion that goes on within this of where it was has not jumped. [m]"""
_BRAKING_M_S2 = 0.25
"""Deceleration from which on a vehicle brakes; overshoots of speed die away more slowly. [m s⁻²]"""


_MOST_POINTS = 1_000_000
"""Of a path: its columns take some 100 MB, and 30,000 km over cells of 30 m have no more."""


def refuse_endless(points: int) -> None:
    """Raise `PathTooLongError` of more points than can be looked at."""
    if points > _MOST_POINTS:
        what = f"a path of {points:,} points"
        raise PathTooLongError(what)


class FlownPath(Value, eq=False):
    """A motion over ground: n + 1 points and the n straight legs between them."""

    east_m: FloatArray
    """Place and velocity at each point. (n + 1,) [m, m s⁻¹]"""
    north_m: FloatArray
    east_m_s: FloatArray
    north_m_s: FloatArray
    height_m: FloatArray
    """Above home, at each point. (n + 1,) [m]"""
    time_s: FloatArray
    """Since the start of the flight, at each point. (n + 1,) [s]"""
    segment: IntArray
    """Segment of the motion each leg is part of. (n,)"""
    item: IntArray
    """Item of each leg, as the segments of the motion have it. (n,)"""
    is_circle: BoolArray
    """Whether a leg is part of a loiter circle. (n,)"""
    is_brake: BoolArray
    """Whether a leg is part of a braking. (n,)"""

    @property
    def speed_m_s(self) -> FloatArray:
        """Ground speed at each point. (n + 1,) [m s⁻¹]"""
        return np.hypot(self.east_m_s, self.north_m_s)

    @property
    def length_m(self) -> FloatArray:
        """Length of each leg. (n,) [m]"""
        return np.hypot(np.diff(self.east_m), np.diff(self.north_m))

    @property
    def is_committed(self) -> BoolArray:
        """Whether the vehicle is not slowing down already at a point. (n + 1,)

        In the middle of a braking there is nothing left to begin too late; its beginning and its
        end are committed.
        """
        energy = 0.5 * self.speed_m_s**2  # v²/2 falls by deceleration times way
        slows = self.is_brake | (energy[:-1] - energy[1:] > _BRAKING_M_S2 * self.length_m)
        return ~(np.append(slows, True) & np.concatenate(([True], slows)))


def flown_path(
    motion: Motion, *, straight_m: float = np.inf, with_heights: bool = False
) -> FlownPath:
    """Return the path of a motion of at least one piece over ground.

    It is within :data:`PATH_TOLERANCE_M` of the motion everywhere, on the map or ``with_heights``; no leg is
    longer than ``straight_m``, for what bends long ones.  Raises `PathTooLongError` where that takes too many
    points.  A cubic stays within ¾ of the greatest distance of
    its inner control points from its chord, and in k equal parts of time within 1/k² of ¾ of the greatest
    second difference of its control points.
    """
    piece, start_s, end_s = _first_intervals(motion, with_heights=with_heights)
    axes = 3 if with_heights else 2
    control_m = motion.control_m(piece, start_s, end_s)[..., :axes]
    parts, jumps = _parts_and_jumps(control_m, straight_m)
    # Where the next piece begins elsewhere, the end of a piece is a point of the path as well.
    ends = np.flatnonzero(jumps)
    last = np.append(piece[ends], piece[-1])
    last_s = np.append(end_s[ends], end_s[-1])
    place = np.append(np.cumsum(parts)[ends], parts.sum())
    if parts.max() > 1:
        piece, start_s, end_s = _divided(piece, start_s, end_s, parts)
    piece, time_s = np.insert(piece, place, last), np.insert(start_s, place, last_s)
    state = motion.state_at(piece, time_s)
    time_s = motion.piece_start_s[piece] + time_s
    piece = piece[:-1]
    segment = motion.piece_segment[piece]
    circles = [i for i, law in enumerate(motion.laws) if isinstance(law, CircleLaw)]
    return FlownPath(
        east_m=state.east_m,
        north_m=state.north_m,
        east_m_s=state.east_m_s,
        north_m_s=state.north_m_s,
        height_m=state.height_m,
        time_s=time_s,
        segment=segment,
        item=motion.segments.item[segment],
        is_circle=np.isin(motion.piece_law[piece], circles),
        is_brake=motion.segments.state[segment] == _BRAKE,
    )


def _first_intervals(
    motion: Motion, *, with_heights: bool
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return piece, beginning and end of intervals in which a cubic follows the motion."""
    duration_s = motion.piece_duration_s
    parts = np.full(len(duration_s), _FIRST_PARTS)
    for index, law in enumerate(motion.laws):
        own = np.flatnonzero(motion.piece_law == index)
        if not len(own):
            continue
        if isinstance(law, VerticalStepLaw):
            vertical = np.ceil(duration_s[own] / _VERTICAL_PART_S) if with_heights else 1
            parts[own] = np.clip(vertical, 1, _MOST_PARTS)
        elif isinstance(law, PolynomialLaw):
            parts[own] = 1
        elif isinstance(law, SpeedPulseLaw):  # straight: only where it stops it may swing back
            braking = motion.segments.state[motion.piece_segment[own]] == _BRAKE
            parts[own] = np.where(braking, _FIRST_PARTS, 1)
        elif isinstance(law, CircleLaw):
            row = motion.piece_row[own]
            radius_m = np.hypot(*(law.start_m[row, :2] - law.centre_m[row]).T)
            angle = np.abs(law.rate_rad_s[row]) * duration_s[own]
            # An arc of angle β is r β²/8 from its chord; an eighth of a turn is the most.
            step = np.sqrt(8.0 * PATH_TOLERANCE_M / np.maximum(radius_m, PATH_TOLERANCE_M))
            wanted = np.ceil(angle / np.minimum(step, 0.25 * np.pi))
            parts[own] = np.clip(wanted, 1, _MOST_PARTS).astype(np.intp)
    piece = np.arange(len(duration_s))
    return _divided(piece, np.zeros(len(duration_s)), duration_s, parts)


def _divided(
    piece: IntArray, start_s: FloatArray, end_s: FloatArray, parts: IntArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return intervals divided into equal parts of time."""
    refuse_endless(int(parts.sum()))
    owner = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    step = (end_s - start_s) / parts
    begin = start_s[owner] + step[owner] * number
    end = np.where(number == parts[owner] - 1, end_s[owner], begin + step[owner])
    return piece[owner], begin, end


def _parts_and_jumps(control_m: FloatArray, straight_m: float) -> tuple[IntArray, BoolArray]:
    """Return into how many straight parts cubics must be divided, and where the next is elsewhere."""
    first, one, two, last = np.moveaxis(control_m, 1, 0)
    chord = last - first
    squared = np.maximum(np.sum(chord**2, axis=1), 1e-12)
    away = np.zeros(len(control_m))
    for control in (one, two):
        along = np.clip(np.sum((control - first) * chord, axis=1) / squared, 0.0, 1.0)
        away = np.maximum(away, lengths(control - first - along[:, None] * chord))
    bend = np.maximum(lengths(first - 2.0 * one + two), lengths(one - 2.0 * two + last))
    curved = 0.75 * away > PATH_TOLERANCE_M
    wanted = np.where(curved, np.ceil(np.sqrt(0.75 * bend / PATH_TOLERANCE_M)), 1.0)
    wanted = np.maximum(wanted, np.ceil(np.sqrt(squared) / straight_m))
    jumps = np.append(lengths(first[1:] - last[:-1]) > _SAME_PLACE_M, False)
    return np.clip(wanted, 1, _MOST_PARTS).astype(np.intp), jumps


class FlightLines(Columns, eq=False):
    """Straight lines the vehicle may fly: n of them, by what they are part of."""

    start_m: FloatArray
    """East, north, height above home. (n, 3) [m]"""
    end_m: FloatArray
    owner: IntArray
    """The leg of the path, or the return, each is part of, rising. (n,)"""

    @property
    def length_m(self) -> FloatArray:
        """Length over ground. (n,) [m]"""
        return horizontal(self.end_m - self.start_m)

    def cut(self, longest_m: float) -> FlightLines:
        """Return the same lines, none longer than asked over ground."""
        parts = np.maximum(np.ceil(self.length_m / longest_m), 1.0).astype(np.intp)
        if (parts == 1).all():
            return self
        line = np.repeat(np.arange(len(parts)), parts)
        number = np.arange(len(line)) - np.repeat(np.cumsum(parts) - parts, parts)
        start, way = self.start_m[line], (self.end_m - self.start_m)[line]
        fractions = [(number + ahead)[:, None] / parts[line, None] for ahead in (0, 1)]
        return FlightLines(
            start_m=start + fractions[0] * way,
            end_m=start + fractions[1] * way,
            owner=self.owner[line],
        )


def flown_lines(path: FlownPath, legs: IntArray) -> FlightLines:
    """Return some legs of a path as lines, each its own."""
    points = np.column_stack((path.east_m, path.north_m, path.height_m))
    return FlightLines(start_m=points[legs], end_m=points[legs + 1], owner=legs)
