"""The returns from every moment of a flight, as flights beside others.

A return may begin at any time: times are divided into intervals, each stands for the return from its middle,
grown by how far those from its ends are from it, in place and in time.  Intervals in which something may come
too near are divided again, until a return is found that does, or none is left.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.approach import Meeting, closest_approach, groups_within
from planner.fleet.trajectory import Trajectory, cubics, in_frame
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.fleet.approach import ClosestApproach
    from planner.fleet.trajectory import Pace
    from planner.flight.returns.path import FlownReturns, ReturnPoints, Returns
    from planner.geo.geodesy import LocalFrame

_FIRST_INTERVALS = 48
_DIVIDED_BY = 4
_MOST_ROUNDS = 7
"""The first intervals are of some 20 s: then of a thousandth of a second."""
_NEAR_ENOUGH_M = 0.1
"""Intervals that stand for no more than this are taken for what they stand for. [m]"""
_MARGIN_M = 20.0
"""What is left between returns and others that are not looked at: turns are flown wider than straight ways
have it. [m]"""


class ReturnFlights(Value, eq=False):
    """The returns of one flight, in a common frame."""

    returns: Returns
    frame: LocalFrame
    grown_m: float
    """How wrong the position may be. [m]"""
    time_fraction: float
    """How much of the time of the flight it may be sooner or later. [-]"""
    late_s: FloatArray
    """How much later segments may be flown, as in a trajectory. (s, 2) [s]"""
    longer_s: Callable[[FlownReturns], FloatArray]
    """How much longer returns may take. (n,) [s]"""
    pace: Pace | None
    """That of the flight."""

    def first_intervals(self) -> tuple[FloatArray, FloatArray]:
        """Return beginnings and ends of intervals of the flight in which it may be broken off. (n,) [s]"""
        sample = self.returns.sample
        if sample is None:
            return np.zeros(0), np.zeros(0)
        time_s = np.unique(sample.points.time_s)
        step = max(len(time_s) // _FIRST_INTERVALS, 1)
        kept = np.unique(np.append(time_s[::step], time_s[-1]))
        if len(kept) == 1:
            return kept, kept
        return kept[:-1], kept[1:]

    def reach_m(self, flown: Trajectory) -> tuple[FloatArray, FloatArray] | None:
        """Return the box, east and north, that no return leaves; ``None``: there are none. (2,), (2,) [m]

        Returns stop straight ahead of the flight, and lead from there to homes, rally points and the
        mission's landing, or along it.
        """
        sample = self.returns.sample
        if sample is None:
            return None
        points, targets = sample.points, self.returns.destinations
        corners, paths = self.returns.straight_corners_m(points, sample.destination)
        stages = [stage for path in (*paths, targets.landing) if path for stage in path.stages]
        places = [
            corners.reshape(-1, 3),
            targets.home_ground_m,
            targets.rally_ground_m,
            np.array([(one.east_m, one.north_m, one.height_m) for one in stages]).reshape(-1, 3),
        ]
        place_m = in_frame(np.concatenate(places), self.returns.route, self.frame)
        stop_m = np.hypot(*(points.stop_m - points.place_m)[:, :2].T).max()
        margin_m = 2.0 * float(stop_m) + _MARGIN_M + self.grown_m
        low_m = np.minimum(place_m.min(axis=0), flown.box_m[0])
        high_m = np.maximum(place_m.max(axis=0), flown.box_m[1])
        return low_m[:2] - margin_m, high_m[:2] + margin_m

    def fan(self, begin_s: FloatArray, end_s: FloatArray) -> FlownFan:
        """Return the flights from the middles of intervals. (n,)"""
        count = len(begin_s)
        time_s = np.stack((0.5 * (begin_s + end_s), begin_s, end_s)).ravel()
        points = self.returns.points(*self.returns.at(time_s))
        flown = self.returns.flown(points)
        corners, _ = self.returns.straight_corners_m(points, flown.destination)
        middle, *ends = corners.reshape(3, count, -1, 3)
        away_m = np.abs(np.stack([end - middle for end in ends]))
        over_s = (points.time_s + flown.time_s).reshape(3, count)
        late_s = np.maximum(
            np.abs(time_s.reshape(3, count)[1:] - time_s[:count]), np.abs(over_s[1:] - over_s[0])
        ).max(axis=0)
        piece, start_s, end_of_s, control_m, error_m = cubics(flown.flight.motion)
        row = flown.piece_point[piece]
        begun_s = np.full(3 * count, np.inf)
        np.minimum.at(begun_s, row, start_s)
        later_s = (points.time_s + points.stop_s)[row] - begun_s[row]
        of_middle = row < count
        stopping = np.flatnonzero(points.stop_s[:count] > 0.0)
        stop_m = _stop_control_m(self.returns, points, stopping)
        group = np.concatenate((row[of_middle], stopping))
        control_m = in_frame(
            np.concatenate((control_m[of_middle], stop_m)), self.returns.route, self.frame
        )
        starts_s = np.concatenate(((start_s + later_s)[of_middle], points.time_s[stopping]))
        stopped_s = (points.time_s + points.stop_s)[stopping]
        items = self.returns.flight.motion.segments.item[points.segment]
        low_m, high_m = control_m.min(axis=1), control_m.max(axis=1)
        begun_late_s = self.late_s[points.segment].reshape(3, count, 2)
        trajectory = Trajectory(
            start_s=starts_s,
            end_s=np.concatenate(((end_of_s + later_s)[of_middle], stopped_s)),
            control_m=control_m,
            low_m=low_m,
            high_m=high_m,
            error_m=np.concatenate((error_m[of_middle], np.zeros(len(stopping)))),
            item=items[group],
            is_low=np.zeros(len(group), np.bool_),
            duration_s=np.inf,
            slack_s=self.time_fraction * starts_s,
            late_s=np.stack(
                (begun_late_s[..., 0].min(axis=0), begun_late_s[..., 1].max(axis=0)), 1
            )[group],
            longer_s=self.longer_s(flown).reshape(3, count).max(axis=0)[group],
            grown_m=np.full(len(group), self.grown_m),
            lifted_m=np.zeros(len(group)),
            stop_s=np.zeros(len(group)),
            pace=self.pace,
        )
        return FlownFan(
            trajectory=trajectory,
            group=group,
            away_m=np.hypot(away_m[..., 0], away_m[..., 1]).max(axis=(0, 2)),
            lifted_m=away_m[..., 2].max(axis=(0, 2)),
            late_s=late_s,
            begin_s=begin_s,
            end_s=end_s,
        )


class FlownFan(Value, eq=False):
    """Returns that stand for n intervals."""

    trajectory: Trajectory
    """Of those from the middles, in no order; its times are those of the flight that is broken off."""
    group: IntArray
    """Interval of each part."""
    away_m: FloatArray
    """How far the returns from the ends of each interval are from that of its middle. (n,) [m]"""
    lifted_m: FloatArray
    """How much higher or lower. (n,) [m]"""
    late_s: FloatArray
    """How much sooner or later. (n,) [s]"""
    begin_s: FloatArray
    end_s: FloatArray

    @property
    def whole(self) -> Trajectory:
        """The flights of whole intervals."""
        one = self.trajectory
        return replace(
            one,
            slack_s=one.slack_s + self.late_s[self.group],
            grown_m=one.grown_m + self.away_m[self.group],
            lifted_m=one.lifted_m + self.lifted_m[self.group],
        )

    def kept(self, groups: BoolArray) -> FlownFan:
        """Return it without the parts of other intervals."""
        rows = np.flatnonzero(groups[self.group])
        return replace(self, trajectory=self.trajectory.parts(rows), group=self.group[rows])

    def divided(self, flagged: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Return parts of some of the intervals."""
        begin_s, end_s = self.begin_s[flagged], self.end_s[flagged]
        knots = np.linspace(begin_s, end_s, _DIVIDED_BY + 1)
        return knots[:-1].T.ravel(), knots[1:].T.ravel()


class ReturnConflict(Value):
    """A return that comes too near to another flight."""

    begun_s: float
    """Time of its flight at which it is broken off. [s]"""
    item: int
    approach: ClosestApproach


def return_conflict(own: ReturnFlights, fan: FlownFan, meeting: Meeting) -> ReturnConflict | None:
    """Return the first return found that comes nearer to another flight than it may; ``None``: none does.

    ``fan`` is that of the first intervals; ``meeting`` has the other flight as its second, and a zone.
    """
    for number in range(_MOST_ROUNDS):
        flagged = _near(fan, fan.whole, meeting)
        if not flagged.any():
            return None
        near = fan.kept(flagged)
        found = _near(near, near.trajectory, meeting)
        if found.any():
            first = np.flatnonzero(found)[:1]
            conflict = _first_conflict(fan, near.trajectory, near.group, first, meeting)
            if conflict is not None:
                return conflict
        elif number == _MOST_ROUNDS - 1 or fan.away_m[flagged].max() < _NEAR_ENOUGH_M:
            rows = np.flatnonzero(flagged)
            return _first_conflict(fan, near.whole, near.group, rows, meeting)
        fan = own.fan(*fan.divided(flagged))
    return None


def _first_conflict(
    fan: FlownFan, flown: Trajectory, group: IntArray, rows: IntArray, meeting: Meeting
) -> ReturnConflict | None:
    """Return the conflict of one of some intervals of a fan; ``None``: none has one."""

    def approach_of(some: IntArray) -> ClosestApproach | None:
        return closest_approach(
            flown.parts(np.flatnonzero(np.isin(group, some))),
            meeting.second,
            second_later_s=meeting.later_s,
            shift_s=meeting.shift_s,
            second_above_m=meeting.above_m,
            accuracy_m=_NEAR_ENOUGH_M,
            zone=meeting.zone,
        )

    approach = approach_of(rows)
    while approach is not None and len(rows) > 1:
        half = len(rows) // 2
        for some in (rows[:half], rows[half:]):
            nearer = approach_of(some)
            if nearer is not None:
                rows, approach = some, nearer
                break
        else:
            break
    if approach is None:
        return None
    return ReturnConflict(
        begun_s=float(0.5 * (fan.begin_s[rows[0]] + fan.end_s[rows[0]])),
        item=approach.first_item,
        approach=approach,
    )


def _near(fan: FlownFan, flown: Trajectory, meeting: Meeting) -> BoolArray:
    """Return which intervals of a fan, flown as it is or as a whole, come too near. (n,)"""
    assert meeting.zone is not None
    found = groups_within(replace(meeting, first=flown), fan.group, meeting.zone.horizontal_m)
    return np.pad(found, (0, len(fan.begin_s) - len(found)))


def _stop_control_m(returns: Returns, points: ReturnPoints, rows: IntArray) -> FloatArray:
    """Return the cubics of stops: from the speed where they begin, to standing. (n, 4, 3) [m]"""
    place_m, stop_m = points.place_m[rows], points.stop_m[rows]
    state = returns.flight.motion.state_at_time(points.time_s[rows])
    ahead_m = state.velocity_m_s * (points.stop_s[rows] / 3.0)[:, None]
    return np.stack((place_m, place_m + ahead_m, stop_m, stop_m), axis=1)
