"""Sorties that are told to stop: their missions with holds, flown again by their models."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.fleet.approach import ACCURACY_M, Cylinder
from planner.fleet.separation import are_heights_known, home_above_m
from planner.fleet.swarm.tracks import PART_M, REST_M, ZoneTrack
from planner.fleet.trajectory import make_trajectory
from planner.flight.budget import flight_battery
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.prediction import predict_flight
from planner.mission.route.stage import Stage, StageKind
from planner.service.fleet_separation import fleet_spacing, members
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.fleet.fleet import Fleet, Separation
    from planner.flight.motion.kinematics import Motion
    from planner.flight.pilot import Pilot
    from planner.geo.geodesy import LocalFrame
    from planner.mission.route.stage import Route
    from planner.rules.assessment import Assessment
    from planner.service.fleet import FlownSortie

SHORTEST_HOLD_S = 1.0
"""A stop is a hold of at least that: autopilots fly through a place without one. [s]"""
_TOUCH_M = 0.002
"""Stops are told so much before zones touch, that no flight is nearer than it may for rounding. [m]"""
_SHAPED_M = 1.5
"""An autopilot stood up to 1.15 m from where the track before had the stop, in those of a few drawn fleets:
by so much more, rounded up, its zone is wider. [m]"""
_SAME_M = 0.5
"""A stop so near to the end of a stage is one there. [m]"""
_PART_S, _MOST_PARTS = 0.25, 8.0
"""While it sets out, what it is commanded to grows before it moves: parts no longer than that. [s], [-]"""
_RESTS = 0.03
"""Part of its greatest speed below which a vehicle that ends a segment stands: stops end at 2 %. [-]"""
_SLOW_M_S = 0.05
_MOVES_M_S = 1.0
_STOPPABLE = {
    StageKind.GO,
    StageKind.LOITER,
    StageKind.LAND,
    StageKind.TAKEOFF,
    StageKind.CHANGE_HEIGHT,
    StageKind.SET_DOWN,
    StageKind.DELAY,
}
"""Stages with a straight level leg, which a stop divides in two; a return once begun is flown to its end."""
_ACCELERATE, _CRUISE, _BRAKE, _HOVER, _CLIMB, _DESCEND = (
    STATE_INDEX[FlightState(name)]
    for name in ("accelerate", "cruise", "brake", "hover", "climb", "descend")
)


class _Knots(Value, eq=False):
    """Where a flight is at knots of its track."""

    time_s: FloatArray
    """Since its start. (k,) [s]"""
    stage: IntArray
    """Of the route, between two knots. (k - 1,)"""


class StoppedSorties:
    """The sorties of a fleet, with the stops they were told.

    Parameters
    ----------
    fleet : Fleet
    separation : Separation
    flown : sequence of FlownSortie
        As planned.
    more_m : sequence of float, optional
        How far likely gusts carry each. [m]
    """

    def __init__(
        self,
        fleet: Fleet,
        separation: Separation,
        flown: Sequence[FlownSortie],
        more_m: Sequence[float] | None = None,
    ) -> None:
        self.flown = list(flown)
        self._separation = separation
        self._members = members(fleet, separation, flown)
        self._spacing = fleet_spacing(separation)
        self._assessments = [_assessed(one) for one in flown]
        self._frame = self._assessments[0].route.frame
        self._pilots = [one.returns.pilot for one in self._assessments]
        self._errors_m = [
            one.setup.position_margin_m + more
            for one, more in zip(self._assessments, more_m or [0.0] * len(flown), strict=True)
        ]
        self._shaped_m = [
            0.0 if one.autopilot is Autopilot.STEP else _SHAPED_M for one in self._assessments
        ]
        self._hold_stage: list[int | None] = [None] * len(flown)
        self.hold_begins_s = [0.0] * len(flown)
        """When each came to its last stop, since its start. [s]"""
        self._knots: list[_Knots] = []
        self.tracks: list[ZoneTrack] = []
        for row, assessment in enumerate(self._assessments):
            track, knots = self._track(row, assessment)
            self.tracks.append(track)
            self._knots.append(knots)

    def keeps(self, first: int, second: int) -> Cylinder | None:
        """Return what two keep apart by; ``None``: they are of one vehicle."""
        one, two = self._members[first], self._members[second]
        if one.vehicle == two.vehicle:
            return None
        zone = self._spacing.zone(one, two)
        assert zone is not None  # of a fleet it is a cylinder
        is_known = are_heights_known(one, two)
        return Cylinder(
            horizontal_m=self._separation.horizontal_m
            + self._errors_m[first]
            + self._errors_m[second]
            + self._shaped_m[first]
            + self._shaped_m[second]
            + _TOUCH_M,
            over_m=zone.over_m + ACCURACY_M if is_known else np.inf,
            under_m=zone.under_m + ACCURACY_M if is_known else np.inf,
        )

    def stopped(
        self, agent: int, rest_m: float, knot: int, start_s: float
    ) -> tuple[ZoneTrack, int] | None:
        """Return the track of a flight that stops so far along its last one; see `Sorties`."""
        assessment, track, knots = self._assessments[agent], self.tracks[agent], self._knots[agent]
        if rest_m >= track.arc_m[-1] - REST_M:
            return None
        # One that holds at a place is at it from one knot to the next, or the one after.
        part = max(int(np.searchsorted(track.arc_m, rest_m - 1e-6, side="right")) - 1, knot)
        begin_m, end_m = track.arc_m[part], track.arc_m[part + 1]
        share = (rest_m - begin_m) / (end_m - begin_m) if end_m > begin_m else 0.0
        at_s = knots.time_s[part] + max(share, 0.0) * (knots.time_s[part + 1] - knots.time_s[part])
        place_m = assessment.flight.motion.state_at_time(np.array([at_s])).place_m[0]
        at = min(int(knots.stage[part]), len(assessment.route.stages) - 1)
        route, hold = _with_hold(assessment.route, at, place_m)
        flown = self._reflown(agent, route)
        if flown is None:
            return None
        self._assessments[agent], self._hold_stage[agent] = flown, hold
        found, self._knots[agent] = self._track(agent, flown)
        self.tracks[agent] = found
        motion = flown.flight.motion
        end_s = float(motion.segments.end_s[motion.done_segment[hold]])
        self.hold_begins_s[agent] = end_s - SHORTEST_HOLD_S
        knot = int(np.searchsorted(self._knots[agent].time_s, end_s - 1e-6))
        return found.moved(0, start_s), knot

    def resumed(self, agent: int, later_s: float, start_s: float) -> ZoneTrack | None:
        """Return the track of a flight that stands for so much longer; see `Sorties`.

        One of reference steps has settled before it holds; an autopilot may still come nearer to the place
        while it does, and sets out from another speed.
        """
        assessment, at = self._assessments[agent], self._hold_stage[agent]
        assert at is not None  # it stands
        stages = list(assessment.route.stages)
        stages[at] = replace(stages[at], hold_s=stages[at].hold_s + later_s)
        route = replace(assessment.route, stages=tuple(stages))
        if assessment.autopilot is Autopilot.STEP:
            # Flown again where the next stop, or the end, asks for it.
            self._assessments[agent] = replace(assessment, route=route)
            return None
        flown = self._reflown(agent, route)
        assert flown is not None  # it was flown before
        self._assessments[agent] = flown
        self.tracks[agent], self._knots[agent] = self._track(agent, flown)
        return self.tracks[agent].moved(0, start_s)

    def ended(self, agent: int, start_s: float, stands_until_s: float | None) -> FlownSortie:
        """Return a sortie as it was flown, from its start; one that still stands until a time."""
        one, assessment = self.flown[agent], self._assessments[agent]
        at = self._hold_stage[agent]
        if at is not None:
            route = assessment.route
            if stands_until_s is not None:
                hold_s = max(stands_until_s - start_s - self.hold_begins_s[agent], SHORTEST_HOLD_S)
                stands = replace(route.stages[at], hold_s=hold_s)
                route = replace(route, stages=(*route.stages[:at], stands))
            flown = self._reflown(agent, route)
            assert flown is not None  # it was flown before
            counted = flight_battery(flown.flight, flown.setup)
            assessment = replace(
                flown,
                totals=counted.totals,
                battery=counted.budget,
                pack=counted.pack,
                discharge=counted.discharge,
            )
        result = replace(
            one.result, assessment=assessment, totals=assessment.totals, battery=assessment.battery
        )
        return replace(one, sortie=replace(one.sortie, start_s=start_s), result=result)

    def _reflown(self, agent: int, route: Route) -> Assessment | None:
        assessment = self._assessments[agent]
        flight = predict_flight(route, assessment.setup, self._pilots[agent])
        if not len(flight.motion.segments.item):
            return None
        return replace(assessment, route=route, flight=flight)

    def _track(self, agent: int, assessment: Assessment) -> tuple[ZoneTrack, _Knots]:
        """Return the track of a flight, from 0 s."""
        above_m = home_above_m(self._members[0], self._members[agent])
        return _zone_track(
            assessment,
            self._pilots[agent],
            self._frame,
            min_nav_alt_m=self._separation.min_nav_alt_m,
            above_m=above_m,
        )


def _assessed(one: FlownSortie) -> Assessment:
    assert one.assessment is not None  # it flies
    return one.assessment


def _with_hold(route: Route, at: int, place_m: FloatArray) -> tuple[Route, int]:
    """Return a route with the shortest hold at a place on the way of a stage, and the stage that holds."""
    stages = route.stages
    stage = stages[at]
    if stage.kind is not StageKind.LAND and _is_at(place_m, stage):
        at += 1
    before = stages[at - 1] if at else None
    east_m, north_m, height_m = place_m.tolist()
    if before is not None and _is_at(place_m, before):
        hold = Stage(
            StageKind.DELAY,
            before.item,
            before.east_m,
            before.north_m,
            before.height_m,
            hold_s=SHORTEST_HOLD_S,
        )
    elif stage.kind is StageKind.TAKEOFF:
        hold = replace(
            stage, east_m=east_m, north_m=north_m, height_m=height_m, hold_s=SHORTEST_HOLD_S
        )
        stages = (*stages[:at], hold, replace(stage, kind=StageKind.GO), *stages[at + 1 :])
        return replace(route, stages=stages), at
    else:
        hold = Stage(
            StageKind.GO,
            stage.item,
            east_m,
            north_m,
            height_m,
            speed_m_s=stage.speed_m_s,
            climb_speed_m_s=stage.climb_speed_m_s,
            descent_speed_m_s=stage.descent_speed_m_s,
            hold_s=SHORTEST_HOLD_S,
        )
    return replace(route, stages=(*stages[:at], hold, *stages[at:])), at


def _is_at(place_m: FloatArray, stage: Stage) -> bool:
    away_m = place_m - (stage.east_m, stage.north_m, stage.height_m)
    return bool(np.hypot(*away_m[:2]) <= _SAME_M and abs(away_m[2]) <= _SAME_M)


def _zone_track(
    assessment: Assessment, pilot: Pilot, frame: LocalFrame, *, min_nav_alt_m: float, above_m: float
) -> tuple[ZoneTrack, _Knots]:
    """Return the track of a flight, and what its zone reaches."""
    motion, route = assessment.flight.motion, assessment.route
    whole = make_trajectory(motion, route, frame, min_nav_alt_m=min_nav_alt_m)
    own = np.flatnonzero(~whole.is_rest)
    start_s, end_s = whole.start_s[own], whole.end_s[own]
    steps_m = np.sqrt((np.diff(whole.control_m[own], axis=1) ** 2).sum(axis=2)).sum(axis=1)
    short = np.minimum(np.ceil((end_s - start_s) / _PART_S), _MOST_PARTS)
    parts = np.maximum(np.maximum(np.ceil(steps_m / PART_M), short), 1.0).astype(np.intp)
    row = np.repeat(np.arange(len(own)), parts)
    number = np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)
    time_s = np.append(start_s[row] + number / parts[row] * (end_s - start_s)[row], end_s[-1])
    place_m = whole.place_m(time_s)
    place_m[:, 2] += above_m
    is_low = whole.is_low[own][row]
    middle_s = 0.5 * (time_s[1:] + time_s[:-1])
    segments = motion.segments
    segment = np.minimum(np.searchsorted(segments.end_s, middle_s), len(segments.item) - 1)
    stage = motion.segment_stage[segment]
    reaches = _Reaches(assessment, pilot, _Knots(time_s=time_s, stage=stage), place_m, segment)
    if motion.segments.state[-1] != STATE_INDEX[FlightState.LAND]:
        # It stays in the air, where it is.
        time_s, stage = np.append(time_s, np.inf), np.append(stage, stage[-1])
        place_m, is_low = np.vstack((place_m, place_m[-1:])), np.append(is_low, is_low[-1])
    rest_m, tip_m, begins_run = reaches.along(len(time_s))
    return (
        ZoneTrack(
            place_m=place_m,
            is_low=is_low,
            time_s=time_s,
            rest_m=rest_m,
            tip_m=tip_m,
            begins_run=begins_run,
        ),
        _Knots(time_s=time_s, stage=stage),
    )


class _Reaches:
    """What the zone of a flight reaches at each knot of its track."""

    def __init__(
        self,
        assessment: Assessment,
        pilot: Pilot,
        knots: _Knots,
        place_m: FloatArray,
        segment: IntArray,
    ) -> None:
        motion, time_s, stage = assessment.flight.motion, knots.time_s, knots.stage
        self._motion, self._segment, self._time_s, self._pilot = motion, segment, time_s, pilot
        self._arc_m = np.concatenate(
            ([0.0], np.cumsum(np.sqrt((np.diff(place_m, axis=0) ** 2).sum(axis=1))))
        )
        state = motion.state_at_time(time_s)
        self._speed = state.ground_speed_m_s
        speed = np.sqrt((state.velocity_m_s**2).sum(axis=1))
        changes = np.append(True, segment[1:] != segment[:-1])
        hovers = motion.segments.state[segment] == _HOVER
        self._is_rest = np.append(changes, True) & (
            (speed <= _RESTS * float(speed.max(initial=0.0)) + _SLOW_M_S)
            | np.append(hovers, False)
            | np.append(False, hovers)
        )
        self._is_rest[-1] = True
        self._is_free = _is_stoppable(assessment, motion, segment, stage, time_s)
        vehicle = assessment.setup.vehicle
        self._is_linear = assessment.autopilot is Autopilot.STEP and vehicle.ramps is None

    def along(self, count: int) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return where it rests, what it reaches, and which knots begin what cannot be stopped."""
        arc_m, is_free, last = self._arc_m, self._is_free, len(self._arc_m) - 1
        rests = np.flatnonzero(self._is_rest)
        next_rest = rests[
            np.minimum(np.searchsorted(rests, np.arange(last), side="right"), len(rests) - 1)
        ]
        ends = np.flatnonzero(np.append(is_free, True) | self._is_rest)
        run_end = ends[
            np.minimum(np.searchsorted(ends, np.arange(last), side="right"), len(ends) - 1)
        ]
        runs = np.flatnonzero(~is_free)
        limit_m = arc_m[next_rest]
        rest_m, tip_m = (np.minimum(one, limit_m) for one in self._told_m(limit_m))
        begins = np.zeros(last, np.bool_)
        for reached_m in (rest_m, tip_m):
            following = np.searchsorted(runs, np.arange(last), side="left")
            run = runs[np.minimum(following, max(len(runs) - 1, 0))] if len(runs) else runs
            if len(runs):
                enters = (following < len(runs)) & (arc_m[run] < reached_m - 1e-6) & is_free
                reached_m[enters] = np.maximum(reached_m, np.minimum(arc_m[run_end[run]], limit_m))[
                    enters
                ]
        held = ~is_free
        begins[held] = self._is_rest[:-1][held]
        inside_m = arc_m[run_end]
        for reached_m in (rest_m, tip_m):
            reached_m[held] = np.where(begins, arc_m[:-1], inside_m)[held]
        jumps = np.append(np.diff(tip_m) > 2.0 * PART_M, False) & is_free
        pad = count - last
        rest_m = np.concatenate((rest_m, np.full(pad, arc_m[-1])))
        tip_m = np.concatenate((tip_m, np.full(pad, arc_m[-1])))
        return (
            rest_m,
            np.maximum.accumulate(tip_m),
            np.concatenate((begins | jumps, np.zeros(pad, np.bool_))),
        )

    def _told_m(self, limit_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where it rests and how far it gets by its speed alone, told at each knot to stop. [m]

        A vehicle of reference steps has been commanded to somewhere already: that is where it rests.  One
        that accelerates by an autopilot's shape stops as from the speed it accelerates to.
        """
        arc_m = self._arc_m[:-1]
        segments, segment = self._motion.segments, self._segment
        state = segments.state[segment]
        moves = np.isin(state, (_ACCELERATE, _CRUISE, _BRAKE, _CLIMB, _DESCEND))
        if not self._is_linear:
            speed = np.where(
                state == _ACCELERATE,
                np.maximum(segments.speed_m_s[segment], self._speed[:-1]),
                self._speed[:-1],
            )
            speed = np.where(moves & ~self._is_rest[:-1], speed, 0.0)
            return arc_m + self._pilot.stop(speed)[0], arc_m + self._pilot.farthest_stop_m(speed)
        rest_m, tip_m = arc_m.copy(), arc_m.copy()
        start_s, states = segments.start_s, segments.state
        for begin in np.flatnonzero(states == _ACCELERATE).tolist():
            brake = begin + 1 + int(states[begin + 1 : begin + 2].tolist() == [_CRUISE])
            if brake >= len(states) or states[brake] != _BRAKE:
                continue
            own = np.flatnonzero((segment >= begin) & (segment < brake))
            if not len(own):
                continue
            length_m = float(segments.distance_m[begin : brake + 1].sum())
            lasts_s = float(start_s[brake] - start_s[begin])
            speed = np.array([length_m / lasts_s])
            over_m = float((self._pilot.farthest_stop_m(speed) - self._pilot.stop(speed)[0])[0])
            part = np.clip((self._time_s[own] - start_s[begin]) / lasts_s, 0.0, 1.0)
            rest_m[own] = arc_m[own[0]] + part * length_m
            tip_m[own] = rest_m[own] + over_m
            braking = segment == brake
            rest_m[braking] = tip_m[braking] = limit_m[braking]
        return np.maximum(rest_m, arc_m), np.maximum(tip_m, arc_m)


def _is_stoppable(
    assessment: Assessment, motion: Motion, segment: IntArray, stage: IntArray, time_s: FloatArray
) -> BoolArray:
    """Return where a stop divides a straight leg into two, between knots; or it stands anyway."""
    stages = assessment.route.stages
    is_straight = np.array(
        [one.kind in _STOPPABLE and not one.followed_ground_m for one in stages] + [False], np.bool_
    )[np.minimum(stage, len(stages))]
    state = motion.segments.state[segment]
    speed = motion.state_at_time(0.5 * (time_s[1:] + time_s[:-1])).ground_speed_m_s
    is_level = np.isin(state, (_ACCELERATE, _CRUISE, _BRAKE)) | (
        np.isin(state, (_CLIMB, _DESCEND)) & (speed > _MOVES_M_S)
    )
    return np.asarray(is_straight & (is_level | (state == _HOVER)))
