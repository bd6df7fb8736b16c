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
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion

PATH_TOLERANCE_M = 0.05
"""How far a motion may be from the straight pieces of its path. [m]"""
_BRAKE = STATE_INDEX[FlightState.BRAKE]
_FIRST_PARTS = 4
"""Parts a piece that is no polynomial is divided into at first: its cubics are then good to 1 mm."""
_MOST_PARTS = 4000
_SAME_TIME_S = 1e-9
"""A height that turns within this of an end of a piece turns there. [s]"""
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


_OF_STATE = ("east_m", "north_m", "height_m", "east_m_s", "north_m_s")
_OF_LEGS = ("segment", "item", "is_circle", "is_brake")


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

    def cut(self, motion: Motion, longest_m: float | FloatArray) -> FlownPath:
        """Return the same path, its legs in equal parts of time that at one speed are no longer than asked.

        Parameters
        ----------
        motion : Motion
            That it is the path of.
        longest_m : float or ndarray
            Of all legs, or of each, (n,): climbs and descents as well. [m]
        """
        leg_m = lengths(np.diff((self.east_m, self.north_m, self.height_m)).T)
        parts = np.maximum(np.ceil(leg_m / longest_m), 1.0).astype(np.intp)
        if (parts == 1).all():
            return self
        refuse_endless(int(parts.sum()))
        leg = np.repeat(np.arange(len(parts)), parts)
        number = np.arange(len(leg)) - np.repeat(np.cumsum(parts) - parts, parts)
        owner, share = leg[number > 0], (number / parts[leg])[number > 0]
        time_s = self.time_s[owner] + share * np.diff(self.time_s)[owner]
        return self.with_points(motion, owner, time_s)

    def with_points(self, motion: Motion, owner: IntArray, time_s: FloatArray) -> FlownPath:
        """Return the same path with points between of a motion, each on a leg of it."""
        state = motion.state_at_time(time_s)
        new = {name: getattr(state, name) for name in _OF_STATE} | {"time_s": time_s}
        if motion.beside is not None:
            east_m, north_m = motion.beside.at(time_s)
            new["east_m"], new["north_m"] = new["east_m"] + east_m, new["north_m"] + north_m
        points = {name: np.insert(getattr(self, name), owner + 1, new[name]) for name in new}
        leg = np.sort(np.concatenate((np.arange(len(self.item)), owner)))
        return FlownPath(**points, **{name: getattr(self, name)[leg] for name in _OF_LEGS})

    def beside(self, motion: Motion) -> FlownPath:
        """Return the path of a vehicle that is beside its motion, whose path this is."""
        if motion.beside is None:
            return self
        east_m, north_m = motion.beside.at(self.time_s)
        path = replace(self, east_m=self.east_m + east_m, north_m=self.north_m + north_m)
        time_s = motion.beside.time_s
        owner = np.searchsorted(self.time_s, time_s, side="right") - 1
        within = (owner >= 0) & (owner < len(self.item))
        return path.with_points(motion, owner[within], time_s[within])

    @property
    def is_committed(self) -> BoolArray:
        """Whether the vehicle is not slowing down already at a point. (n + 1,)

        In the middle of a braking there is nothing left to begin too late; its beginning and its
        end are committed.
        """
        energy = 0.5 * self.speed_m_s**2  # v²/2 falls by deceleration times way
        slows = self.is_brake | (energy[:-1] - energy[1:] > _BRAKING_M_S2 * self.length_m)
        return ~(np.append(slows, True) & np.concatenate(([True], slows)))


def flown_path(motion: Motion) -> FlownPath:
    """Return the path of a motion of at least one piece.

    It is within :data:`PATH_TOLERANCE_M` of the motion everywhere, or of the vehicle beside that.  Raises
    `PathTooLongError` where that takes too many points.  A cubic stays within ¾ of the greatest distance of
    its inner control points from its chord, and in k equal parts of time within 1/k² of ¾ of the greatest
    second difference of its control points.
    """
    piece, start_s, end_s = _first_intervals(motion)
    parts, jumps = _parts_and_jumps(motion.control_m(piece, start_s, end_s))
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
    path = FlownPath(
        **{name: getattr(state, name) for name in _OF_STATE},
        time_s=time_s,
        segment=segment,
        item=motion.segments.item[segment],
        is_circle=np.isin(motion.piece_law[piece], circles),
        is_brake=motion.segments.state[segment] == _BRAKE,
    )
    return path.beside(motion)


def _first_intervals(motion: Motion) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return piece, beginning and end of intervals in which a cubic follows the motion."""
    duration_s = motion.piece_duration_s
    parts, turns = np.full(len(duration_s), _FIRST_PARTS), []
    for index, law in enumerate(motion.laws):
        own = np.flatnonzero(motion.piece_law == index)
        if not len(own):
            continue
        if isinstance(law, VerticalStepLaw):
            parts[own] = 1
            turns.append(_turns(motion, law, own))
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
    piece, start_s, end_s = _divided(piece, np.zeros(len(duration_s)), duration_s, parts)
    for turned, turn_s in turns:
        at = np.searchsorted(piece, turned, side="right")
        piece, start_s = np.insert(piece, at, turned), np.insert(start_s, at, turn_s)
        end_s = np.insert(end_s, at - 1, turn_s)
    return piece, start_s, end_s


def _turns(motion: Motion, law: VerticalStepLaw, own: IntArray) -> tuple[IntArray, FloatArray]:
    """Return where heights turn within some pieces of a law: in which of them, and when. (k,), (k,) [s]"""
    begin_s = motion.piece_offset_s[own]
    end_s = begin_s + motion.piece_duration_s[own]
    pause_s = law.pause_s[motion.piece_row[own]]
    answer_s = end_s - np.clip(end_s - law.peak_s, 0.0, pause_s)
    turn_s = law.response.monotone_between(float(answer_s.max()))
    since_s = turn_s + np.where(turn_s > law.peak_s, pause_s[:, None], 0.0) - begin_s[:, None]
    is_within = (since_s > _SAME_TIME_S) & (since_s < (end_s - begin_s)[:, None] - _SAME_TIME_S)
    return own[is_within.nonzero()[0]], since_s[is_within]


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


def _parts_and_jumps(control_m: FloatArray) -> tuple[IntArray, BoolArray]:
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
