"""The point of a flight from which the way home is tightest, found between items too.

Used energy never falls, and a way home from a point nearby costs no more than flying there costs more:
between two points at which both are known, their sum is bounded.  Stretches whose bound is no higher
than the best point found are left alone, the others are divided, until no stretch is left that could
hide a tighter point than the one found.

The growth is measured far from home; near it ways are steeper, return heights jump, and another place to
land may be chosen: there the bound is wider, and stretches are divided to a metre.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import (
    STATE_INDEX,
    FlightState,
)
from planner.flight.return_nodes import ReturnNodes
from planner.mission.route.stage import StageKind
from planner.units import wh_from_j

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.homeward import Homeward

_TOLERANCE = 1e-3
"""Share of the highest sum by which a point may be tighter than the one found. [-]"""
_TURN_TOLERANCE = 3e-3
"""Share of an energy by which the last point below it may stay below, or one before it exceed it. [-]"""
_ALIKE = 1e-9
"""Sums that differ by no more than this share are the same. [-]"""
_FINEST_M = 1.0
"""A stretch of no more than this is not divided. [m]"""
_FINEST_S = 0.1
"""Nor is one of no more time. [s]"""
_STAGES_ALONG = 100
"""As many places where returns lead along the mission, and what they cost is no matter of distance."""
_FIRST_STAGES = 24
"""Places looked at before the first bound, spread over the flight."""
_LIKELY_STAGES = 12
"""Places looked at besides, where used energy and a straight way home are most."""
_PARTS = 6
"""Parts a stretch is divided into."""
_MOST_DIVIDED = 24
"""Stretches divided in one round, those with the highest bounds."""
_MOST_FIRST = 48
"""Stretches divided in one round where only the first that matters is looked for."""
_POINTS_AT_ONCE = 60
"""Points looked at in one round at least: so many cost a third more than one."""
_CROSSING = (0.75, 1.0)
"""Energy used where the sum reaches a limit, over that limit: a way home is rarely dearer. [-]"""
_FIRST_CROSSING = 24
"""Places looked at first where a limit is reached."""
_MOST_ROUNDS = 60
"""Far more than any flight takes: a stretch of 100 km is divided to 1 m in eight."""
_LIPSCHITZ_MARGIN = 1.05
"""What the slope of the energy over the way may be above the steepest one measured. [-]"""
_BEARINGS = 8
_NEAR_M = 100.0
"""A way home from nearer may end before its cruise speed is reached. [m]"""
_NEAR_STEEPNESS = 3.0
"""How much more steeply such a way grows: at a third of the speed. [-]"""
_CONE_M = 15.0
"""Nearer than this the height of a return may jump: RTL_MIN_DIST is 10 m, cones end at 5 m. [m]"""
_RISES = 4
"""Heights at which the slope over height is measured."""
_FAR_M = 400.0
"""Distance beyond which a way home is longer at its cruise speed alone. [m]"""
_TAKEOFF = STATE_INDEX[FlightState.TAKEOFF]
_LANDINGS = (StageKind.LAND, StageKind.RETURN)


class ReturnSearch:
    """The points of a flight looked at so far.

    Parameters
    ----------
    homeward : Homeward
        The flight and its ways home.
    *limits_wh : float
        Energies that `last_below` will be asked for: they are looked for together with the tightest
        point, in the same rounds. [Wh]

    Notes
    -----
    Segments of the take-off and of stages that land are left out: there the vehicle stands, or lands
    where it is going anyway, and the energy of the whole flight says whether it can.
    """

    def __init__(self, homeward: Homeward, *limits_wh: float) -> None:
        self.homeward = homeward
        self._limits_wh = limits_wh
        columns = homeward.flight.motion.segments
        stages = homeward.route.stages
        lands = np.array([stage.kind in _LANDINGS for stage in stages])
        judged = ~lands[homeward.segment_stage] & (columns.state != _TAKEOFF)
        home = homeward.destinations.home_of(homeward.segment_stage)
        count = len(judged)
        following = np.append(judged[1:], False)
        # a run ends where the next segment is not judged, or has another home
        self._ends_run = judged & (~following | (home != np.append(home[1:], -1)))
        begins = judged & np.concatenate(([True], self._ends_run[:-1] | ~judged[:-1]))
        lone = (columns.state == _TAKEOFF) & ~lands[homeward.segment_stage] & ~following
        self._judged = judged
        self._length_m = np.concatenate(([0.0], np.cumsum(columns.distance_m)))
        self._rise_m = np.concatenate(([0.0], np.cumsum(np.abs(columns.climb_m))))
        self._duration_s = columns.duration_s
        self._speed_m_s = columns.speed_m_s
        self._per_m, self._per_rise_m, self._windy_per_m = 0.0, 0.0, 0.0
        self._highest_m = 0.0
        last = np.append(np.flatnonzero(np.diff(homeward.segment_stage)), count - 1)
        last = last[judged[last]]
        # Along the mission each corner costs anew, and so does a metre at the speed it commands: slopes
        # measured straight home say nothing of it.
        along = homeward.destinations.knows_mission
        first = np.concatenate(
            (
                np.flatnonzero(self._ends_run | lone),
                self._likely(last),
                _spread(last, _STAGES_ALONG if along else _FIRST_STAGES),
                *(self._crossing(limit_wh) for limit_wh in limits_wh),
            )
        )
        starts = np.flatnonzero(begins)
        segment = np.concatenate((starts, _each_once(first)))
        self.nodes: ReturnNodes | None = None
        if len(segment):
            share = np.where(np.arange(len(segment)) < len(starts), 0.0, 1.0)
            order = np.lexsort((share, segment))
            self.nodes = self._evaluated(segment[order], share[order])

    def tightest(self) -> int | None:
        """Return the node from which the way home is tightest; ``None`` with no point in the air."""
        if self.nodes is None:
            return None
        self._settle(self._limits_wh)
        # Braking to a stop is as tight all along: its end, where the vehicle stands, is told.
        sum_wh = self.nodes.sum_wh
        return int(np.flatnonzero(sum_wh >= sum_wh.max() * (1.0 - _ALIKE))[-1])

    def last_below(self, *limits_wh: float) -> tuple[int | None, ...]:
        """Return for each energy the last node before the first whose sum is above; ``None``: none is.

        Its sum is within 0.3 % of the energy, or the next node at most a metre of way, or a
        tenth of a second, on.
        """
        self._settle(limits_wh)
        return tuple(self._last_row(limit_wh) for limit_wh in limits_wh)

    def _settle(self, limits_wh: tuple[float, ...]) -> None:
        """Look at points until no stretch is left that matters for the tightest, or for a limit."""
        for _ in range(_MOST_ROUNDS):
            left, bound_wh = self._divisible()
            open_ones = [self._open_above(left, bound_wh)]
            open_ones += [self._open_below(left, bound_wh, limit_wh) for limit_wh in limits_wh]
            divided = _each_once(np.concatenate(open_ones))
            if not len(divided):
                break
            self._divide(divided, max(_POINTS_AT_ONCE // len(divided), _PARTS))

    def _open_above(self, left: IntArray, bound_wh: FloatArray) -> IntArray:
        """Return the stretches that may hide a tighter point, those with the highest bounds."""
        assert self.nodes is not None
        best_wh = float(self.nodes.sum_wh.max())
        hides = bound_wh > best_wh * (1.0 + _TOLERANCE)
        highest = np.argsort(-bound_wh[hides], kind="stable")
        return left[hides][highest[:_MOST_DIVIDED]]

    def _last_row(self, limit_wh: float) -> int | None:
        assert self.nodes is not None
        over = np.flatnonzero(self.nodes.sum_wh > limit_wh)
        return max(int(over[0]) - 1, 0) if len(over) else None

    def _open_below(self, left: IntArray, bound_wh: FloatArray, limit_wh: float) -> IntArray:
        """Return the first stretches that may hide where an energy is exceeded first."""
        last = self._last_row(limit_wh)
        if last is None:
            return np.zeros(0, dtype=np.intp)
        assert self.nodes is not None
        hides = (left < last) & (bound_wh > limit_wh * (1.0 + _TURN_TOLERANCE))
        if self.nodes.sum_wh[last] < limit_wh * (1.0 - _TURN_TOLERANCE):
            hides |= left == last
        return left[hides][:_MOST_FIRST]

    def _likely(self, last: IntArray) -> IntArray:
        """Return the ends of stages where used energy and a straight way home are most."""
        if not len(last):
            return last
        stage = self.homeward.segment_stage[last]
        stages = self.homeward.route.stages
        place = np.array([(stages[i].east_m, stages[i].north_m) for i in stage.tolist()])
        homes = self.homeward.destinations.home_of(stage)
        ground = self.homeward.destinations.home_ground_m[homes]
        away = np.hypot(place[:, 0] - ground[:, 0], place[:, 1] - ground[:, 1])
        length_m = float(self._length_m[-1])
        per_m = self.homeward.used_wh[-1] / length_m if length_m > 0.0 else 0.0
        guess = self.homeward.used_wh[last + 1] + per_m * away
        return last[np.argsort(-guess, kind="stable")[:_LIKELY_STAGES]]

    def _crossing(self, limit_wh: float) -> IntArray:
        """Return ends of segments by which an energy may be reached; none where no flight lasts to it."""
        used_wh = self.homeward.used_wh
        if used_wh[-1] <= limit_wh:
            return np.zeros(0, dtype=np.intp)
        begin, end = np.searchsorted(used_wh[1:], [share * limit_wh for share in _CROSSING])
        return _spread(begin + np.flatnonzero(self._judged[begin:end]), _FIRST_CROSSING)

    def _probes_m(self) -> FloatArray:
        """Return places on rays from home and over each other, which slopes are measured at. [m]"""
        extremes = self.homeward.flight.extremes
        low, high = (0.0, 0.0) if extremes is None else (extremes.lowest_m, extremes.highest_m)
        windy = self.homeward.flight.power.wind.speed_m_s > 0.0
        angle = np.arange(_BEARINGS if windy else 1) * 2.0 * np.pi / _BEARINGS
        east, north = np.sin(angle), np.cos(angle)
        ring = [
            np.column_stack((east * away, north * away, np.full(len(angle), high)))
            for away in (_FAR_M, 2.0 * _FAR_M)
        ]
        rises = np.array([[_FAR_M, 0.0, z] for z in (max(low, 0.0), low + 10.0, high, high + 10.0)])
        return np.vstack((*ring, rises))

    def _take_slopes(self, stand_m: FloatArray, energy_wh: FloatArray) -> None:
        """Measure how steeply the energy of a way home grows over its length and height."""
        rays = (len(stand_m) - _RISES) // 2
        near, far = energy_wh[:rays], energy_wh[rays : 2 * rays]
        climbs_m = np.maximum(np.abs(np.diff(stand_m[2 * rays :, 2])), 1.0)
        rising = np.abs(np.diff(energy_wh[2 * rays :])) / climbs_m
        self._per_m = _LIPSCHITZ_MARGIN * float(np.max(far - near)) / _FAR_M
        self._per_rise_m = _LIPSCHITZ_MARGIN * float(rising.max())
        self._windy_per_m = float(np.ptp(far - near)) / _FAR_M
        first, rally = np.zeros(1, dtype=np.intp), self.homeward.destinations.rally_height_m
        ground_m = np.array([[_FAR_M, 0.0, 0.0]])
        targets = self.homeward.destinations.targets(first, 0, ground_m)
        highest_m = float(self.homeward.pilot.return_heights_m(ground_m, targets)[0])
        self._highest_m = highest_m + float(np.abs(rally).max(initial=0.0))

    def _evaluated(self, segment: IntArray, share: FloatArray) -> ReturnNodes:
        """Return nodes; the first time slopes are measured with the same call."""
        points = self.homeward.points(segment, share)
        destination = self.homeward.chosen(points)
        probes_m = self._probes_m() if self.nodes is None else np.zeros((0, 3))
        first, count = np.zeros(len(probes_m), dtype=np.intp), len(probes_m)
        way_s, home_j = self.homeward.way_by_state(
            np.concatenate((probes_m, points.stop_m)),
            np.concatenate((first, points.stage)),
            np.concatenate((first, destination)),
        )
        way_wh = wh_from_j(home_j.sum(axis=1))
        if count:
            self._take_slopes(probes_m, way_wh[:count])
            way_s, way_wh, home_j = way_s[count:], way_wh[count:], home_j[count:]
        away = points.stop_m - points.place_m
        return ReturnNodes(
            segment=segment,
            share=share,
            destination=destination,
            used_wh=points.used_wh,
            way_wh=points.stop_wh + way_wh,
            way_s=points.stop_s + way_s,
            home_j=home_j,
            slack_wh=points.stop_wh + self._per_m * np.hypot(away[:, 0], away[:, 1]),
            away_m=np.hypot(
                *(
                    points.stop_m
                    - self.homeward.destinations.targets(
                        points.stage, destination, points.stop_m
                    ).ground_m
                )[:, :2].T
            ),
            height_m=points.stop_m[:, 2],
        )

    def _divisible(self) -> tuple[IntArray, FloatArray]:
        """Return the first nodes of the stretches that can be divided, and the bounds on them."""
        nodes = self.nodes
        assert nodes is not None
        a, b = np.arange(len(nodes.segment) - 1), np.arange(1, len(nodes.segment))
        in_run = self._judged[nodes.segment[b]] & ~(
            (nodes.share[a] == 1.0) & (self._ends_run | ~self._judged)[nodes.segment[a]]
        )
        follows = (nodes.share[a] == 1.0) & (nodes.segment[a] + 1 == nodes.segment[b])
        one = follows | (nodes.segment[a] == nodes.segment[b])
        way_m = self._between(self._length_m, a, b)
        share = nodes.share[b] - np.where(follows, 0.0, nodes.share[a])
        time_s = self._duration_s[nodes.segment[b]] * share
        way_m = np.where(one, np.minimum(way_m, time_s * self._speed_m_s[nodes.segment[b]]), way_m)
        rise_m = self._between(self._rise_m, a, b)
        fine = one & (
            ((way_m <= _FINEST_M) & (rise_m * share <= _FINEST_M)) | (time_s <= _FINEST_S)
        )
        ways_wh = nodes.way_wh[a] + nodes.way_wh[b]
        slack_wh = np.where(one, share, 1.0) * self._highest_slack(a, b, one)
        nearest_m = np.minimum(nodes.away_m[a], nodes.away_m[b]) - 0.5 * way_m
        steepness = np.where(nearest_m < _NEAR_M, _NEAR_STEEPNESS, 1.0)
        # Only from below the greatest height of a return may one climb, and another not.
        low_m = np.minimum(nodes.height_m[a], nodes.height_m[b]) - rise_m
        climb_m = np.clip(self._highest_m - low_m, 0.0, self._highest_m)
        slack_wh = slack_wh + np.where(nearest_m < _CONE_M, self._per_rise_m * climb_m, 0.0)
        # Another place to land may be dearer, though it is nearer: in its wind, or by its height.
        other_wh = self._per_rise_m * self._highest_m + self._windy_per_m * np.maximum(
            nodes.away_m[a], nodes.away_m[b]
        )
        differs = nodes.destination[a] != nodes.destination[b]
        slack_wh = slack_wh + np.where(differs, other_wh, 0.0)
        more_wh = steepness * self._per_m * way_m + self._per_rise_m * rise_m * np.where(
            one, share, 1.0
        )
        bound_wh = nodes.used_wh[b] + 0.5 * (ways_wh + more_wh) + slack_wh
        left = np.flatnonzero(in_run & ~fine)
        return left, bound_wh[left]

    def _between(self, sums: FloatArray, a: IntArray, b: IntArray) -> FloatArray:
        """Return how much of what adds up over segments lies between nodes, at most."""
        nodes = self.nodes
        assert nodes is not None
        first = np.where(nodes.share[a] == 1.0, nodes.segment[a] + 1, nodes.segment[a])
        last = np.where(nodes.share[b] == 0.0, nodes.segment[b] - 1, nodes.segment[b])
        between: FloatArray = np.maximum(sums[last + 1] - sums[first], 0.0)
        return between

    def _highest_slack(self, a: IntArray, b: IntArray, one: BoolArray) -> FloatArray:
        """Return what stops could add between nodes, beyond those at their ends. [Wh]"""
        nodes = self.nodes
        assert nodes is not None
        steady = one & (
            np.abs(nodes.slack_wh[a] - nodes.slack_wh[b]) <= 1e-6 * nodes.slack_wh.max(initial=1e-9)
        )
        most = float(nodes.slack_wh.max())
        return np.where(steady, 0.0, most)

    def _divide(self, left: IntArray, parts: int) -> None:
        """Look at more points of stretches: at the ends of their segments, and inside of few."""
        nodes = self.nodes
        assert nodes is not None
        segments: list[int] = []
        shares: list[float] = []
        for a in left.tolist():
            first, last = int(nodes.segment[a]), int(nodes.segment[a + 1])
            begin, end = float(nodes.share[a]), float(nodes.share[a + 1])
            if first != last and begin == 1.0:
                first, begin = first + 1, 0.0
            ends = range(first, last)
            if len(ends) > parts:
                ends = _each_once(np.linspace(first, last - 1, parts).astype(np.intp)).tolist()
            segments += ends
            shares += [1.0] * len(ends)
            each = parts // (last - first + 1)
            for segment in range(first, last + 1) if each > 1 else ():
                low, high = begin if segment == first else 0.0, end if segment == last else 1.0
                segments += [segment] * (each - 1)
                shares += [low + (high - low) * part / each for part in range(1, each)]
        more = self._evaluated(np.array(segments, dtype=np.intp), np.array(shares))
        self.nodes = nodes.joined(more)


def _each_once(numbers: IntArray) -> IntArray:
    """Return different numbers, rising; `numpy.unique` would load masked arrays for it."""
    ordered = np.sort(numbers)
    different: IntArray = ordered[np.diff(ordered, prepend=-1) != 0]
    return different


def _spread(places: IntArray, most: int) -> IntArray:
    if len(places) <= most:
        return places
    return places[np.linspace(0, len(places) - 1, most).astype(np.intp)]
