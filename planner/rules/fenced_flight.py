"""A flight and its fence in one local frame: what the rules on fences look at."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.findings import FlightStretch
from planner.flight.fence_schedule import fence_schedule
from planner.flight.motion.kinematics import lengths
from planner.flight.path import PATH_TOLERANCE_M
from planner.flight.pilot import StopRoom
from planner.flight.returns.destination import HOME
from planner.flight.returns.fan import return_fan
from planner.geo.barrier import CircleBarrier, PathLegs, make_fence_frame, swept_areas
from planner.geo.fence import Fence, make_fence_area
from planner.geo.geodesy import bow_m, straight_length_m
from planner.rules.fence_settings import fence_margin_m, inclusions_unite, limits_in_use
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.fence_schedule import FenceSchedule
    from planner.flight.path import FlownPath
    from planner.geo.barrier import Barrier, SweptAreas
    from planner.geo.fence import FenceArea
    from planner.geo.geodesy import LocalFrame
    from planner.mission.route.stage import Route
    from planner.rules.assessment import Assessment
    from planner.rules.fence_settings import FenceLimits

_STANDING_M_S = 1e-6
"""Slower than this nothing moves ahead. [m s⁻¹]"""
_ENDS = 2
"""Points of a straight line."""
_NO_WAY_M = 1e-6
"""Points no farther apart are one. [m]"""
_BEND_RAD = 0.1
"""Smaller changes of direction are not seen on a map. [rad]"""
_FAR_LEG_M = 1000.0
"""Length of a leg that is straight in any frame. [m]"""


class FencedFlight(Value, eq=False, dict=True):
    """A flight and its fence."""

    assessment: Assessment
    area: FenceArea
    frame: LocalFrame
    path: FlownPath
    """In the frame."""
    room: StopRoom
    """What it takes to stop."""
    schedule: FenceSchedule
    """When the fence is on."""
    around_homes: tuple[Barrier, ...]
    """The circle that parameters draw around each home, the same for the same home; none without them."""
    margin_m: float
    """Distance to keep from the fence, whatever the speed. [m]"""

    @property
    def position_error_m(self) -> float:
        """How far the vehicle may be from where it takes itself to be. [m]"""
        return self.assessment.setup.position_margin_m

    @cached_property
    def points_m(self) -> FloatArray:
        """East and north of the points of the path. (n + 1, 2) [m]"""
        return np.column_stack((self.path.east_m, self.path.north_m))

    def ahead_m(self, reach_m: FloatArray) -> FloatArray:
        """Return the places so far straight ahead of each point; none of a braking begun already.

        Parameters
        ----------
        reach_m : ndarray
            From each point. (n + 1,) [m]

        Returns
        -------
        ndarray
            East and north. (n + 1, 2) [m]
        """
        path = self.path
        speed = path.speed_m_s
        far = np.where(path.is_committed & (speed > _STANDING_M_S), reach_m, 0.0)
        step = far / np.maximum(speed, _STANDING_M_S)
        return self.points_m + np.column_stack((path.east_m_s * step, path.north_m_s * step))

    @cached_property
    def overshoot_m(self) -> FloatArray:
        """How far each point at which a leg stops is overshot, to the east and north. (n + 1, 2) [m]"""
        path, stops = self.path, self.path.speed_m_s[1:] <= _STANDING_M_S
        top_m_s = np.zeros(len(self.group_first) - 1)
        np.maximum.at(top_m_s, self.group, path.speed_m_s[:-1])
        way_m = np.where(stops, self.room.overshoot_m(top_m_s[self.group]), 0.0)
        step = way_m / np.maximum(path.length_m, _NO_WAY_M)
        step = np.where(path.length_m > _NO_WAY_M, step, 0.0)[:, None]
        return np.vstack((np.zeros((1, 2)), np.diff(self.points_m, axis=0) * step))

    @cached_property
    def stopped_m(self) -> FloatArray:
        """Where the vehicle has stopped if it brakes after a reaction, or is carried. (n + 1, 2) [m]"""
        needed_m = self.room.needed_m(self.path.speed_m_s, self.tail_wind_m_s)
        return self.ahead_m(needed_m) + self.overshoot_m

    @cached_property
    def at_once_m(self) -> FloatArray:
        """Where the vehicle has stopped if it brakes at once. (n + 1, 2) [m]"""
        return self.ahead_m(self.room.farthest_stop_m(self.path.speed_m_s))

    @cached_property
    def tail_wind_m_s(self) -> FloatArray:
        """Part of the wind that blows in the direction of motion. (n + 1,) [m s⁻¹]"""
        wind, path = self.assessment.setup.wind, self.path
        along = wind.east_m_s * path.east_m_s + wind.north_m_s * path.north_m_s
        return along / np.maximum(path.speed_m_s, _STANDING_M_S)

    @cached_property
    def group(self) -> IntArray:
        """The group of each leg: legs of one item that follow each other. (n,)"""
        return _groups(self.path.item)

    @cached_property
    def group_first(self) -> IntArray:
        """The first leg of each group, and the number of legs. (groups + 1,)"""
        starts = np.flatnonzero(np.diff(self.group, prepend=-1))
        return np.append(starts, len(self.group))

    @cached_property
    def _group_areas(self) -> SweptAreas:
        """What each group passes over, and would while stopping."""
        last = self.group_first[1:]
        points = [self.points_m, self.stopped_m]
        return swept_areas(
            np.concatenate([p[rows] for p in points for rows in (slice(0, -1), last)]),
            np.tile(np.concatenate((self.group, np.arange(len(last)))), len(points)),
        )

    @cached_property
    def _whole_area(self) -> SweptAreas:
        """What the flight passes over as a whole, and would while stopping or returning."""
        points = np.concatenate(
            (self.points_m, self.stopped_m, *self.returns.ends_m, self._targets_m)
        )
        return swept_areas(points, np.zeros(len(points), np.intp))

    def is_clear_of(self, barrier: Barrier, *, beside_m: float = 0.0) -> bool:
        """Return whether a barrier is beyond all there is, and so far beside it; else there may be room."""
        return not self._whole_area.near(barrier, self.margin_m + beside_m + PATH_TOLERANCE_M)[0]

    def legs_near(self, barrier: Barrier) -> IntArray:
        """Return the legs of groups that may be too near to a barrier while it is on: no other leg is."""
        near = self._group_areas.near(barrier, self.margin_m + PATH_TOLERANCE_M)
        return np.flatnonzero(near[self.group] & self.is_on(barrier))

    def is_on(self, barrier: Barrier) -> BoolArray:
        """Return whether a barrier is on while each leg is flown. (n,)"""
        schedule = self.schedule
        on = schedule.areas
        if barrier in self.around_homes:
            home = self.assessment.returns.destinations.home_of(np.arange(len(schedule.limits)))
            on = schedule.limits & np.array([one == barrier for one in self.around_homes])[home]
        flown: BoolArray = on[self._stage[:-1]]
        return flown

    def is_of_moved_home(self, barrier: Barrier) -> bool:
        """Return whether a barrier is the circle around a home that the mission sets in flight."""
        return barrier in self.around_homes[1:]

    def keeps_from_rally(self, barrier: Barrier) -> bool:
        """Return whether rally points have to be inside a barrier.

        ArduPilot takes none beyond the circle of FENCE_RADIUS while that is on
        (``AP_Rally_Copter::is_valid``), and beyond it none is outside while it is off.
        """
        is_on = self.is_on(barrier)
        if barrier in self.around_homes and self.assessment.autopilot is Autopilot.ARDUPILOT:
            return bool(is_on.all())
        return bool(is_on.any())

    def is_path_near(self, barrier: Barrier) -> BoolArray:
        """Return whether each leg passes a barrier within the position error. (n,)"""
        near = np.zeros(len(self.group), dtype=bool)
        legs = self.legs_near(barrier)
        if len(legs):
            near[legs] = barrier.leg_clearance(self.legs(legs)).clearance_m < self.position_error_m
        return near

    def legs(self, chosen: IntArray) -> PathLegs:
        """Return some legs of the path."""
        points = self.points_m
        return straight_legs(points[chosen], points[chosen + 1])

    def along_m(self, leg: int, way_m: float) -> FloatArray:
        """Return the place so far along a leg. (2,) [m]"""
        row = np.array([leg])
        place: FloatArray = self.legs(row).point_m(np.array([way_m]))[0]
        return place

    @cached_property
    def _targets_m(self) -> FloatArray:
        """East and north of home and of the rally points. (1 + rally points, 2) [m]"""
        home, rally = self.assessment.route.frame, self.assessment.mission.rally
        return np.column_stack(
            self.frame.east_north_m(
                [home.latitude_deg, *(point.latitude_deg for point in rally)],
                [home.longitude_deg, *(point.longitude_deg for point in rally)],
            )
        )

    @cached_property
    def returns(self) -> FencedReturns:
        """Where the vehicle itself would fly home from every leg of the path."""
        a = self.assessment
        time_s, stage = self.path.time_s, self._stage[:-1]
        fan, along = return_fan(a.returns, np.stack((time_s[:-1], time_s[1:]), axis=1), stage)
        first_home = a.returns.destinations.home_of(fan.stage) == 0
        place_m, leg = self._in_frame(fan.corners_m[:, :, 0, :2]), fan.stretch
        # A stop begun at once, as it is judged for the flight (F102), between those from the leg's ends.
        ahead_m = self.at_once_m - self.points_m
        passed_m = lengths(place_m - self.points_m[leg, None])
        share = passed_m / np.maximum(self.path.length_m[leg, None], _NO_WAY_M)
        share = np.clip(share, 0.0, 1.0)[..., None]
        return FencedReturns(
            leg=leg,
            place_m=place_m,
            stop_m=place_m + ahead_m[leg, None] * (1.0 - share) + ahead_m[leg + 1, None] * share,
            end_m=self._in_frame(fan.corners_m[:, :, 3, :2]),
            destination=fan.destination,
            is_end_judged=(fan.destination > HOME) | ((fan.destination == HOME) & first_home),
            along=straight_legs(
                self._in_frame(along.start_m[:, :2]), self._in_frame(along.end_m[:, :2])
            ),
        )

    def _in_frame(self, places_m: FloatArray) -> FloatArray:
        """Return places of the frame of home, east and north, in the fence's. (…, 2) [m]"""
        home = self.assessment.route.frame
        if self.frame == home:
            return places_m
        there = home.latitude_longitude_deg(places_m[..., 0], places_m[..., 1])
        return np.stack(self.frame.east_north_m(*there), axis=-1)

    @cached_property
    def _stage(self) -> IntArray:
        """Stage of the route flown at each point of the path. (n + 1,)"""
        segment = np.append(self.path.segment, self.path.segment[-1])
        stage: IntArray = self.assessment.returns.segment_stage[segment]
        return stage

    def position_deg(self, point_m: FloatArray) -> tuple[float, float]:
        """Return latitude and longitude of a place of the frame. [°]"""
        latitude, longitude = self.frame.latitude_longitude_deg(point_m[0], point_m[1])
        return round(float(latitude), 7), round(float(longitude), 7)

    def stretch(self, start_m: FloatArray, end_m: FloatArray, distance_m: float) -> FlightStretch:
        """Return a stretch over ground."""
        return FlightStretch(
            start_deg=self.position_deg(start_m),
            end_deg=self.position_deg(end_m),
            distance_m=distance_m,
        )

    def flown_stretch(self, parts_m: Sequence[tuple[float, float]]) -> FlightStretch:
        """Return the parts of the path between distances along it, in flown order, each line once. [m]"""
        lines = tuple(dict.fromkeys(self._line_deg(*part) for part in parts_m))
        return FlightStretch(
            start_deg=lines[0][0],
            end_deg=lines[0][-1],
            distance_m=float(sum(end - start for start, end in parts_m)),
            parts_deg=lines if len(lines) > 1 or len(lines[0]) > _ENDS else (),
        )

    @cached_property
    def along_path_m(self) -> FloatArray:
        """Way along the path to its points. (n + 1,) [m]"""
        legs = np.hypot(*np.diff(self.points_m, axis=0).T)
        return np.concatenate(([0.0], np.cumsum(legs)))

    def _line_deg(self, start_m: float, end_m: float) -> tuple[tuple[float, float], ...]:
        """Return latitudes and longitudes along a part of the path: its ends, and where it bends."""
        way = self.along_path_m
        first, end = np.searchsorted(way, [start_m + _NO_WAY_M, end_m - _NO_WAY_M])
        along = np.concatenate(([start_m], way[first:end], [end_m]))
        around = slice(max(first - 1, 0), max(first, end) + 1)
        line = np.column_stack(
            [np.interp(along, way[around], axis[around]) for axis in self.points_m.T]
        )
        course = np.unwrap(np.arctan2(*np.diff(line, axis=0).T)).tolist()
        kept, ahead = [0], course[0]
        for corner in range(1, len(course)):
            if abs(course[corner] - ahead) > _BEND_RAD:
                kept.append(corner)
                ahead = course[corner]
        return tuple(self.position_deg(line[row]) for row in (*kept, len(line) - 1))


class FencedReturns(Value, eq=False):
    """The returns from n parts of a path, in the frame of the fence, east and north. [m]"""

    leg: IntArray
    """Leg of the path each part is of, rising. (n,)"""
    place_m: FloatArray
    """Where the returns from both ends begin, stand still, and are straight to. (n, 2, 2) [m]"""
    stop_m: FloatArray
    end_m: FloatArray
    destination: IntArray
    """As in `planner.flight.returns.destination`. (n,)"""
    is_end_judged: BoolArray
    """Whether they lead to the first home or a rally point, judged themselves. (n,)"""
    along: PathLegs
    """What returns follow along the mission from there on."""

    @property
    def ends_m(self) -> tuple[FloatArray, ...]:
        """Every place returns lead to or stop at. (…, 2) each [m]"""
        along = self.along
        straight = (self.stop_m.reshape(-1, 2), self.end_m.reshape(-1, 2))
        return (*straight, along.start_m, along.end_m)

    def areas(self, rows: IntArray, owner: IntArray, *, with_stops: bool = False) -> SweptAreas:
        """Return what returns from parts pass over, by owner; from where they stop too."""
        points = (self.place_m, self.end_m, *((self.stop_m,) if with_stops else ()))
        every = np.concatenate([own[rows, end] for own in points for end in (0, 1)])
        return swept_areas(every, np.tile(owner, 2 * len(points)))


def straight_legs(start_m: FloatArray, end_m: FloatArray) -> PathLegs:
    """Return legs between points. (n, 2) each [m]"""
    length = np.hypot(*(end_m - start_m).T)
    length = np.where(length > 1e-9, length, 0.0)  # shorter ones have no direction
    return PathLegs(start_m, np.where(length[:, None] > 0.0, end_m, start_m), length)


def make_fenced_flight(a: Assessment) -> FencedFlight:
    """Return the flight and its fence, in a frame near the fence."""
    fence = a.mission.fence or Fence()
    home = a.route.frame
    ardupilot = a.autopilot is Autopilot.ARDUPILOT
    frame = make_fence_frame(fence, (home.latitude_deg, home.longitude_deg))
    area = make_fence_area(
        fence,
        frame,
        inclusions_unite=inclusions_unite(a.own_parameters),
        ardupilot_origin=home if ardupilot else None,
    )
    limit = limits_in_use(a.route, a.own_parameters)
    around_homes = _around_homes(a.route, frame, limit)
    if around_homes:
        area = replace(area, barriers=(*area.barriers, *dict.fromkeys(around_homes)))
    return FencedFlight(
        assessment=a,
        area=area,
        frame=frame,
        schedule=fence_schedule(a.route, a.own_parameters),
        around_homes=around_homes,
        path=_path(a, frame, bends=ardupilot),
        room=StopRoom(
            vehicle=a.vehicle, parameters=a.parameters, reaction_time_s=a.setup.reaction_time_s
        ),
        margin_m=max(a.setup.position_margin_m, fence_margin_m(a.own_parameters)),
    )


def _around_homes(route: Route, frame: LocalFrame, limit: FenceLimits) -> tuple[Barrier, ...]:
    """Return the circle around home, and around each home that the mission sets.

    Notes
    -----
    Both autopilots measure from whichever home counts then: ``AC_Fence::check_fence_circle`` by
    ``get_relative_position_NE_home``, PX4's ``Geofence::isCloserThanMaxDistToHome`` by
    ``get_home_position``.
    """
    if limit.distance_m is None:
        return ()
    homes = route.moved_homes
    names = ["home", *(f"the home of item {one.item}" for one in homes)]
    places = np.array([(0.0, 0.0), *((one.east_m, one.north_m) for one in homes)])
    there = route.frame.latitude_longitude_deg(*places.T)
    return tuple(
        CircleBarrier(
            label=f"the circle of {limit.distance_name} around {name}",
            place=None,
            keep_inside=True,
            east_m=east_m,
            north_m=north_m,
            radius_m=limit.distance_m,
        )
        for name, east_m, north_m in zip(
            names, *np.stack(frame.east_north_m(*there)).tolist(), strict=True
        )
    )


def _path(a: Assessment, frame: LocalFrame, *, bends: bool) -> FlownPath:
    """Return the flown path in a frame, its legs bent as the autopilot bends them."""
    home = a.route.frame
    straight_m = np.inf if frame == home else _FAR_LEG_M
    if bends:
        straight_m = min(straight_m, straight_length_m(PATH_TOLERANCE_M, home.latitude_deg))
    path = a.path.cut(a.flight.motion, straight_m)
    points = np.column_stack((path.east_m, path.north_m))
    if bends and np.hypot(*np.ptp(points, axis=0)) > straight_m:
        points = points + _bow_m(points, path.item, home.latitude_deg)
    if frame != home:
        places = home.latitude_longitude_deg(points[:, 0], points[:, 1])
        points = np.column_stack(frame.east_north_m(*places))
    return replace(path, east_m=points[:, 0], north_m=points[:, 1])


def _bow_m(points_m: FloatArray, item: IntArray, latitude_deg: float) -> FloatArray:
    """Return what ArduPilot's legs are away from straight ones, by the way of each item."""
    group = _groups(item)
    first = np.flatnonzero(np.diff(group, prepend=-1))
    start, end = points_m[first], points_m[np.append(first[1:], len(item))]
    way = (end - start)[group]
    squared = np.maximum(np.sum(way**2, axis=1), 1e-12)
    share = np.clip(np.sum((points_m[:-1] - start[group]) * way, axis=1) / squared, 0.0, 1.0)
    return np.vstack((bow_m(way, share, latitude_deg), np.zeros((1, 2))))


def _groups(item: IntArray) -> IntArray:
    return np.cumsum(np.diff(item, prepend=item[0]) != 0)
