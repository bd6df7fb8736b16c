"""The place of a vehicle at every time, on the ground before and after its flight too."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import STATE_INDEX, FlightState, PolynomialLaw, lengths
from planner.values import Value, field_names, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion
    from planner.geo.geodesy import LocalFrame
    from planner.mission.route.stage import Route

CUBIC_TOLERANCE_M = 1.5e-3
"""How far a motion that is no polynomial may be from its cubics. [m]"""
AT_REST_S = 1e6
"""Time for which a vehicle is known to stand before and after its flight: 11 days. [s]"""
_FIRST_PARTS = 4
_MOST_ROUNDS = 16
_STOP_M, _MOST_OF_STOP = 0.5, 64
"""Radius of the discs that the way of a stop is made of, which are so much wider than it: a fifth of the
position error of a common receiver; and how many there are at most. [m]"""
_PROBES = np.array([0.25, 0.5, 0.75])
"""Fractions of a cubic at which its error is looked at. [-]"""
_BERNSTEIN = np.stack(
    (
        (1.0 - _PROBES) ** 3,
        3.0 * _PROBES * (1.0 - _PROBES) ** 2,
        3.0 * _PROBES**2 * (1.0 - _PROBES),
        _PROBES**3,
    ),
    axis=1,
)
"""Parts of the control points at these."""


_LATER_S, _MOST_OF_LATER = 0.5, 256
"""How much later the end of a part may be flown than its beginning, of which more are made; and how many, at
most. [s]"""
_STRAIGHT_M = 0.5
"""A way so little longer than straight is straight: a fifth of the position error of a receiver. [m]"""
_ALIKE_S = 0.1
"""What is passed within this of each other is passed at the same time: 1 m at 10 m/s, less than errors of
positions. [s]"""
_CRUISE = STATE_INDEX[FlightState.CRUISE]
_LAND = STATE_INDEX[FlightState.LAND]


class Pace(Value, eq=False):
    """What tells when a flight is where, and by how much later: of two alike the same at each place."""

    flown_by: tuple[object, ...]
    """The model, the parameters of its autopilot, and the wind."""
    passed_s: FloatArray
    """When each segment ends, and how much later it may, at most. (2, s) [s]"""

    def is_that_of(self, other: Pace) -> bool:
        """Return whether another flight passes all its segments at these times, and as late as this one."""
        return (
            self.passed_s.shape == other.passed_s.shape
            and bool(np.abs(self.passed_s - other.passed_s).max(initial=0.0) <= _ALIKE_S)
            and self.flown_by == other.flown_by
        )


class Trajectory(Value, eq=False, dict=True):
    """A flight as cubics of time (n of them), between two rests; times count from its start."""

    start_s: FloatArray
    """Beginning of each cubic; each lasts until the next begins. (n,) [s]"""
    end_s: FloatArray
    """(n,) [s]"""
    control_m: FloatArray
    """Bézier control points: east, north, height above home. (n, 4, 3) [m]"""
    low_m: FloatArray
    """Lowest coordinates of the control points of each cubic. (n, 3) [m]"""
    high_m: FloatArray
    """Highest coordinates of them. (n, 3) [m]"""
    error_m: FloatArray
    """How far the motion is from each cubic. (n,) [m]"""
    item: IntArray
    """Mission item of each cubic. (n,)"""
    is_low: BoolArray
    """Whether the vehicle stands on the ground, takes off or lands, below the height from which it
    counts as flying. (n,)"""
    duration_s: float
    """Duration of the flight. [s]"""
    slack_s: FloatArray
    """How much sooner or later each part may be flown, by the spread of times. (n,) [s]"""
    late_s: FloatArray
    """How much later each part may be flown besides, for what its prediction does not fly: where it begins,
    at least of two alike, and where it ends, at most. (n, 2) [s]"""
    longer_s: FloatArray
    """How much later than that, whatever one alike does. (n,) [s]"""
    grown_m: FloatArray
    """How much farther beside it the vehicle may be, by the error of its position, or where the wind widens
    or narrows a circle. (n,) [m]"""
    lifted_m: FloatArray
    """How much higher or lower than it. (n,) [m]"""
    stop_s: FloatArray
    """So many seconds of its level speed it gets straight on where it may be told to stop. (n,) [s]"""
    pace: Pace | None = None
    """``None``: no flight is known to be alike."""

    @property
    def at_no_height(self) -> Trajectory:
        """As seen from above: whatever its heights, what it comes near to it comes near to beside it."""
        flat = np.array([1.0, 1.0, 0.0])
        return replace(
            self,
            control_m=self.control_m * flat,
            low_m=self.low_m * flat,
            high_m=self.high_m * flat,
        )

    @cached_property
    def reach(self) -> Trajectory:
        """Where it flies and, told to stop at any time, gets to: parts beside parts, ever further ahead."""
        if not self.stop_s.any():
            return self
        width_s = np.maximum(self.end_s - self.start_s, 1e-9)[:, None, None]
        q0, q1, q2 = np.moveaxis(3.0 * np.diff(self.control_m[..., :2], axis=1) / width_s, 1, 0)
        fastest_m_s = np.sqrt(np.max([np.sum(q**2, axis=1) for q in (q0, q1, q2)], axis=0))
        stop_m = self.stop_s * fastest_m_s
        count = np.clip(np.ceil(stop_m / (2.0 * _STOP_M)), 1, _MOST_OF_STOP).astype(np.intp)
        rows = np.repeat(np.arange(len(count)), count)
        number = np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
        ahead_s = (self.stop_s / count)[rows] * (number + 0.5)
        speed_m_s = np.stack((q0, (q0 + 2.0 * q1) / 3.0, (2.0 * q1 + q2) / 3.0, q2), axis=1)
        whole = self.parts(rows)
        control_m = whole.control_m.copy()
        control_m[..., :2] += ahead_s[:, None, None] * speed_m_s[rows]
        return replace(
            whole,
            control_m=control_m,
            low_m=control_m.min(axis=1),
            high_m=control_m.max(axis=1),
            grown_m=whole.grown_m + (0.5 * stop_m / count)[rows],
            stop_s=np.zeros(len(rows)),
        )

    @cached_property
    def is_rest(self) -> BoolArray:
        """Whether the flight has not begun, or is over. (n,)"""
        return (self.end_s <= 0.0) | (self.start_s >= self.duration_s)

    @cached_property
    def box_m(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest coordinates of all. (3,), (3,) [m]"""
        return self.low_m.min(axis=0), self.high_m.max(axis=0)

    @cached_property
    def latest_s(self) -> float:
        """The most that any part may be flown later. [s]"""
        return float((self.late_s[:, 1] + self.longer_s).max())

    @cached_property
    def widest_m(self) -> float:
        """The most that a part is grown by. [m]"""
        return float(self.grown_m.max())

    def parts(self, rows: IntArray) -> Trajectory:
        """Return some of its parts; where the vehicle is between them is not told."""
        columns = (name for name in field_names(self) if name not in {"duration_s", "pace"})
        return replace(self, **{name: getattr(self, name)[rows] for name in columns})

    @property
    def is_ever_flying(self) -> bool:
        """Whether the vehicle rises to the height from which it counts as flying."""
        return not bool(self.is_low.all())

    def part_at(self, time_s: FloatArray) -> IntArray:
        """Return which cubic is flown at times; before the first rest and after the last those. (n,)"""
        part = np.searchsorted(self.start_s, time_s, side="right") - 1
        return np.asarray(np.clip(part, 0, None))

    def place_m(self, time_s: FloatArray) -> FloatArray:
        """Return east, north and height above home at times. (n, 3) [m]"""
        return self.place_and_stop_m(time_s)[0]

    def place_and_stop_m(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return its places at times, and how far east and north stops from there get. (n, 3), (n, 2) [m]"""
        part = self.part_at(time_s)
        width_s = np.maximum(self.end_s[part] - self.start_s[part], 1e-12)
        fraction = np.clip((time_s - self.start_s[part]) / width_s, 0.0, 1.0)[:, None]
        points = self.control_m[part]
        for _ in range(2):  # de Casteljau
            points = points[:, :-1] + fraction[..., None] * (points[:, 1:] - points[:, :-1])
        along_m = points[:, 1] - points[:, 0]
        stop_m = (3.0 * self.stop_s[part] / width_s)[:, None] * along_m[:, :2]
        return points[:, 0] + fraction * along_m, stop_m


def make_trajectory(
    motion: Motion,
    route: Route,
    frame: LocalFrame,
    *,
    min_nav_alt_m: float,
    late_s: FloatArray | None = None,
    lost_s: FloatArray | None = None,
    beside_m: FloatArray | None = None,
    pace: Pace | None = None,
) -> Trajectory:
    """Return the place of a vehicle over time.

    The flight counts from 0, the take-off place before it and the last place after it.  A flight that does
    not end with a landing stays in the air.

    Parameters
    ----------
    motion, route
        The flight, in the frame of its own home.
    frame : LocalFrame
        Common frame of all vehicles.
    min_nav_alt_m : float
        Height above the take-off place, and above a landing place, from which it counts as flying. [m]
    late_s : ndarray, optional
        How much later segments may be flown, at least of two alike, and at most; default not at all.
        (s, 2) [s]
    lost_s : ndarray, optional
        How much longer each may last besides, at most; default none does. (s,) [s]
    beside_m : ndarray, optional
        How far beside them the vehicle may be, at most, beside what its motion tells; default not at all.
        (s,) [m]
    pace : Pace, optional
        That of the flight.
    """
    piece, start_s, end_s, control_m, error_m = cubics(motion)
    control_m = in_frame(control_m, route, frame)
    segment = motion.piece_segment[piece]
    if lost_s is not None and lost_s.any():
        part, begin, end = _evenly_late(motion, segment, start_s, end_s, lost_s)
        width_s = (end_s - start_s)[part]
        control_m = part_of_cubic(control_m[part], begin, end)
        start_s, end_s = start_s[part] + begin * width_s, start_s[part] + end * width_s
        error_m, segment = error_m[part], segment[part]
    lands = bool(motion.segments.state[motion.piece_segment[piece[-1]]] == _LAND)
    last = np.repeat(control_m[-1:, -1:], 4, axis=1)
    if lands and route.stages[-1].return_path is None:
        # A response of reference steps ends at its last metre: the vehicle stands on the ground.
        last[..., 2] = np.minimum(last[..., 2], route.stages[-1].height_m)
    flying_s, low_again_s = _flying_between_s(
        start_s,
        end_s,
        control_m,
        landed_m=float(last[0, 0, 2]) if lands else None,
        above_m=min_nav_alt_m,
    )
    for limit_s in (flying_s, low_again_s):
        inside = np.flatnonzero((start_s < limit_s) & (limit_s < end_s))
        if len(inside):
            at = int(inside[0])
            fraction = (limit_s - start_s[at]) / (end_s[at] - start_s[at])
            parts = part_of_cubic(
                control_m[[at, at]], np.array([0.0, fraction]), np.array([fraction, 1.0])
            )
            control_m = np.concatenate((control_m[:at], parts, control_m[at + 1 :]))
            start_s, end_s = np.insert(start_s, at + 1, limit_s), np.insert(end_s, at, limit_s)
            error_m = np.insert(error_m, at, error_m[at])
            segment = np.insert(segment, at, segment[at])
    is_low = (end_s <= flying_s) | (start_s >= low_again_s)
    first = np.repeat(control_m[:1, :1], 4, axis=1)
    control_m = np.concatenate((first, control_m, last))
    duration_s = float(end_s[-1])
    item = motion.segments.item[segment]
    own_late_s = np.zeros((len(segment), 2)) if late_s is None else late_s[segment]
    if lost_s is not None and lost_s.any():
        own_late_s = own_late_s + _lost_by_s(motion, segment, start_s, end_s, lost_s)
    own_beside_m = np.zeros(len(segment)) if beside_m is None else beside_m[segment]
    if motion.beside is not None:
        own_beside_m = own_beside_m + motion.beside.greatest_m(start_s, end_s)
    return Trajectory(
        start_s=np.concatenate(([-AT_REST_S], start_s, [duration_s])),
        end_s=np.concatenate(([0.0], end_s, [duration_s + AT_REST_S])),
        control_m=control_m,
        low_m=control_m.min(axis=1),
        high_m=control_m.max(axis=1),
        error_m=np.concatenate(([0.0], error_m, [0.0])),
        item=np.concatenate((item[:1], item, item[-1:])),
        is_low=np.concatenate(([True], is_low, [lands or bool(is_low.all())])),
        duration_s=duration_s,
        slack_s=np.zeros(len(control_m)),
        # It stands there as soon as it may have landed, and until it sets out.
        late_s=np.pad(own_late_s, ((1, 1), (0, 0))),
        longer_s=np.zeros(len(control_m)),
        grown_m=np.concatenate(([0.0], own_beside_m, [0.0])),
        lifted_m=np.zeros(len(control_m)),
        stop_s=np.zeros(len(control_m)),
        pace=pace,
    )


def _evenly_late(
    motion: Motion, segment: IntArray, start_s: FloatArray, end_s: FloatArray, lost_s: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return cubics again, those of straight cruises in parts none of which is much later at its end.

    Which each is of, and its fractions of that. (k,)
    """
    late_s = np.diff(_lost_by_s(motion, segment, start_s, end_s, lost_s), axis=1)[:, 0]
    is_even = _is_even(motion)[segment]
    count = np.where(is_even, np.clip(np.ceil(late_s / _LATER_S), 1, _MOST_OF_LATER), 1)
    count = count.astype(np.intp)
    part = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(part)) - np.repeat(np.cumsum(count) - count, count)
    return part, number / count[part], (number + 1) / count[part]


def _lost_by_s(
    motion: Motion, segment: IntArray, start_s: FloatArray, end_s: FloatArray, lost_s: FloatArray
) -> FloatArray:
    """Return how much later parts of segments begin and end: evenly in straight cruises. (k, 2) [s]"""
    begun_s = motion.segment_start_s[segment]
    duration_s = np.maximum(motion.segments.duration_s[segment], 1e-12)
    is_even = _is_even(motion)[segment]
    passed = (np.stack((start_s, end_s), axis=1) - begun_s[:, None]) / duration_s[:, None]
    passed = np.where(is_even[:, None], np.clip(passed, 0.0, 1.0), [0.0, 1.0])
    before_s = (np.cumsum(lost_s) - lost_s)[segment]
    return np.asarray(before_s[:, None] + passed * lost_s[segment, None])


def _is_even(motion: Motion) -> BoolArray:
    """Return which segments are straight, level and at one speed. (s,)"""
    columns = motion.segments
    begin_m, end_m = (
        motion.state_at_time(time_s).place_m for time_s in (motion.segment_start_s, columns.end_s)
    )
    is_straight = np.hypot(*(end_m - begin_m)[:, :2].T) > columns.distance_m - _STRAIGHT_M
    is_level = np.abs(columns.climb_m) < _STRAIGHT_M
    return np.asarray((columns.state == _CRUISE) & is_straight & is_level)


def in_frame(control_m: FloatArray, route: Route, frame: LocalFrame) -> FloatArray:
    """Return places of a route's own frame in another one. (…, 3) [m]"""
    if route.frame == frame:
        return control_m
    there = route.frame.latitude_longitude_deg(control_m[..., 0], control_m[..., 1])
    return np.stack((*frame.east_north_m(*there), control_m[..., 2]), axis=-1)


def part_of_cubic(control_m: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Return the control points of parts of cubics (n, 4, 3), from fractions of them to others (n,).

    The polar form of the cubic at (begin, begin, begin) … (end, end, end): de Casteljau's scheme with
    another parameter in each step.
    """
    first, last = begin[:, None, None], end[:, None, None]

    def step(points: FloatArray, fraction: FloatArray) -> FloatArray:
        return points[:, :-1] + fraction * (points[:, 1:] - points[:, :-1])

    from_first, from_last = step(control_m, first), step(control_m, last)
    twice = step(from_first, first)
    return np.concatenate(
        (
            step(twice, first),
            step(twice, last),
            step(step(from_first, last), last),
            step(step(from_last, last), last),
        ),
        axis=1,
    )


def cubics(motion: Motion) -> tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return piece, beginning, end, control points and error of cubics that follow a motion."""
    flown = np.flatnonzero(motion.piece_duration_s > 0.0)
    begun_s = motion.piece_start_s
    laws = [i for i, law in enumerate(motion.laws) if isinstance(law, PolynomialLaw)]
    is_cubic = np.isin(motion.piece_law, laws)
    parts = np.where(is_cubic[flown], 1, _FIRST_PARTS)
    piece = np.repeat(flown, parts)
    number = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    width_s = motion.piece_duration_s[piece] / np.repeat(parts, parts)
    start_s = number * width_s
    done: list[tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray]] = []
    for round_number in range(_MOST_ROUNDS):
        control_m = motion.control_m(piece, start_s, start_s + width_s)
        error_m = _errors(motion, piece, start_s, width_s, control_m, is_cubic=is_cubic)
        rough = error_m > CUBIC_TOLERANCE_M
        if round_number == _MOST_ROUNDS - 1:
            rough[:] = False
        fine = ~rough
        done.append((piece[fine], start_s[fine], width_s[fine], control_m[fine], error_m[fine]))
        if not rough.any():
            break
        width_s = np.repeat(0.5 * width_s[rough], 2)
        start_s = np.repeat(start_s[rough], 2)
        start_s[1::2] += width_s[1::2]
        piece = np.repeat(piece[rough], 2)
    piece, start_s, width_s, control_m, error_m = (
        np.concatenate(columns) for columns in zip(*done, strict=True)
    )
    order = np.lexsort((start_s, piece))
    start_s = (begun_s[piece] + start_s)[order]
    # Each ends where the next begins: no gap by rounding.
    end_s = np.append(start_s[1:], float(motion.piece_duration_s.sum()))
    return piece[order], start_s, end_s, control_m[order], error_m[order]


def _errors(
    motion: Motion,
    piece: IntArray,
    start_s: FloatArray,
    width_s: FloatArray,
    control_m: FloatArray,
    *,
    is_cubic: BoolArray,
) -> FloatArray:
    """Return how far a motion is from its cubics, at three places of each. [m]"""
    error_m = np.zeros(len(piece))
    own = np.flatnonzero(~is_cubic[piece])
    if len(own):
        time_s = start_s[own, None] + width_s[own, None] * _PROBES
        state = motion.state_at(piece[own, None], time_s)
        gap = np.einsum("fk,nkx->nfx", _BERNSTEIN, control_m[own]) - state.place_m
        error_m[own] = lengths(gap).max(axis=1)
    return error_m


def _flying_between_s(
    start_s: FloatArray,
    end_s: FloatArray,
    control_m: FloatArray,
    *,
    landed_m: float | None,
    above_m: float,
) -> tuple[float, float]:
    """Return from when until when a vehicle counts as flying. [s]

    A place lower than where it took off, or where it lands, does not make it land in between.
    """
    first_s = _first_above_s(start_s, end_s, control_m, float(control_m[0, 0, 2]) + above_m)
    if landed_m is None:
        return first_s, np.inf
    over_s = float(end_s[-1])
    left_s = _first_above_s(
        over_s - end_s[::-1], over_s - start_s[::-1], control_m[::-1, ::-1], landed_m + above_m
    )
    if first_s == left_s == np.inf:
        return np.inf, np.inf
    return (0.0 if first_s == np.inf else first_s, over_s if left_s == np.inf else over_s - left_s)


def _first_above_s(
    start_s: FloatArray, end_s: FloatArray, control_m: FloatArray, above_m: float
) -> float:
    """Return when cubics first rise above a height; infinity: never. [s]"""
    height_m = control_m[..., 2] - above_m
    for at in np.flatnonzero((height_m > 0.0).any(axis=1)).tolist():
        a, b, c, d = height_m[at].tolist()
        if a > 0.0:
            return float(start_s[at])
        roots = np.roots([d - 3 * c + 3 * b - a, 3 * c - 6 * b + 3 * a, 3 * b - 3 * a, a])
        fractions = roots.real[np.isreal(roots) & (roots.real >= 0.0) & (roots.real <= 1.0)]
        if len(fractions):
            return float(start_s[at] + fractions.min() * (end_s[at] - start_s[at]))
        if d > 0.0:  # the crossing is lost in rounding
            return float(start_s[at])
    return np.inf


def thinned(time_s: FloatArray, columns: FloatArray, tolerance: float) -> IntArray:
    """Return which samples to keep so that at every other one's own time the rest are so near to it.

    Douglas and Peucker's scheme with distances at equal times (Meratnia and de By 2004).
    """
    kept = {0, len(time_s) - 1}
    spans = [(0, len(time_s) - 1)]
    while spans:
        low, high = spans.pop()
        if high - low < 2:
            continue
        inside = slice(low + 1, high)
        fraction = (time_s[inside] - time_s[low]) / max(time_s[high] - time_s[low], 1e-12)
        straight = columns[low] + fraction[:, None] * (columns[high] - columns[low])
        away = np.sqrt(np.sum((columns[inside] - straight) ** 2, axis=1))
        farthest = int(away.argmax())
        if away[farthest] > tolerance:
            middle = low + 1 + farthest
            kept.add(middle)
            spans += [(low, middle), (middle, high)]
    return np.array(sorted(kept))
