"""Destinations: where a return leads from each point of a flight, by the vehicle's own rules."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen
from planner.mission.route.stage import StageKind
from planner.mission.route.walk import ground_amsl_m

if TYPE_CHECKING:
    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.mission_way import MissionWays
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission
    from planner.mission.route.stage import (
        ReturnWay,
        Route,
    )
    from planner.vehicle.parameters.resolve import FlightParameters

HOME = 0
"""Home among destinations; rally point n of the mission is n."""
LANDING = -1
"""The mission's landing, straight to where it begins."""
ALONG = -2
"""Along the mission: on to its landing, or back to where it began."""
HERE = -3
"""Down where the vehicle is."""
_NEARER_M = 2.0
"""A place this much nearer than home is taken: ``MIN_DIST_THRESHOLD`` of PX4's rtl.cpp. [m]"""
_AT_HOME_M = 10.0
"""A rally point this near to home is home: ``MAX_DIST_FROM_HOME_FOR_LAND_APPROACHES``. [m]"""
_PX4_RALLY_TYPES = frozenset({0, 1, 3, 5})
"""RTL_TYPE that looks at rally points; 2 and 4 follow the mission, 6 goes home if it can."""
_PX4_NOT_HOME = frozenset({1, 5})
"""RTL_TYPE that leads home only where there is nothing else; 5 not even then."""
_PX4_RALLY_ONLY = 5


@frozen(eq=False)
class Targets:
    """Where each of n returns leads."""

    ground_m: FloatArray
    """East, north, height of the ground above the first home. (n, 3) [m]"""
    rally_height_m: FloatArray
    """Height of a rally point above that ground; 0 for home. (n,) [m]"""
    ways: tuple[ReturnWay | None, ...] = ()
    """Of those that lead along the mission; empty where none does. (n,)"""


@frozen(eq=False)
class Destinations:
    """Home, as it moves along a route, and the rally points of a mission."""

    home_first_stage: IntArray
    """Stage from which each home counts, rising from 0. (h,)"""
    home_ground_m: FloatArray
    """East, north, height of the ground there. (h, 3) [m]"""
    rally_ground_m: FloatArray
    """(r, 3) [m]"""
    rally_height_m: FloatArray
    """Height of each rally point above its ground. (r,) [m]"""
    parameters: FlightParameters | None
    mission_ways: MissionWays | None = None
    """Of an autopilot whose returns may have to do with the mission."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What of the vehicle's returns is not predicted as it flies them."""
        return () if self.mission_ways is None else self.mission_ways.findings

    @property
    def follows_mission(self) -> bool:
        """Whether returns lead along the mission."""
        return self.mission_ways is not None and bool(self.mission_ways.along)

    @property
    def knows_mission(self) -> bool:
        """Whether returns lead along the mission, or to its landing."""
        ways = self.mission_ways
        return self.follows_mission or (ways is not None and ways.landing is not None)

    def home_of(self, stage: IntArray) -> IntArray:
        """Return which home counts while stages are flown, as positions among the homes. (n,)"""
        return np.searchsorted(self.home_first_stage, stage, side="right") - 1

    def targets(self, stage: IntArray, destination: IntArray | int, place_m: FloatArray) -> Targets:
        """Return the targets of returns. (n,)

        Parameters
        ----------
        stage : ndarray of int
            Stages flown when they begin, which say what home is. (n,)
        destination : ndarray of int
            ``HOME``, rally points, ``LANDING``, ``ALONG`` or ``HERE``. (n,)
        place_m : ndarray
            East, north, height above home where they begin. (n, 3) [m]
        """
        destination = np.broadcast_to(np.asarray(destination, dtype=np.intp), stage.shape)
        ground_m = self.home_ground_m[self.home_of(stage)]
        height_m = np.zeros(len(stage))
        rally = destination > HOME
        if rally.any():
            ground_m[rally] = self.rally_ground_m[destination[rally] - 1]
            height_m[rally] = self.rally_height_m[destination[rally] - 1]
        if not (destination < HOME).any():
            return Targets(ground_m=ground_m, rally_height_m=height_m)
        ground_m[destination == HERE, :2] = place_m[destination == HERE, :2]
        ways = tuple(map(self._way, stage.tolist(), destination.tolist()))
        for row, way in enumerate(ways):
            if way is not None:
                landing = way.stages[-1]
                ground_m[row] = (landing.east_m, landing.north_m, landing.height_m)
        return Targets(ground_m=ground_m, rally_height_m=height_m, ways=ways)

    def _way(self, stage: int, destination: int) -> ReturnWay | None:
        ways = self.mission_ways
        if ways is None or destination not in {LANDING, ALONG}:
            return None
        return ways.landing if destination == LANDING else ways.along[stage]

    def chosen(self, point_m: FloatArray, stage: IntArray) -> IntArray:
        """Return the destination the vehicle itself chooses. (n,)

        Parameters
        ----------
        point_m : ndarray
            East, north, height above home where it decides to return. (n, 3) [m]
        stage : ndarray of int
            Stages flown there. (n,)

        Notes
        -----
        PX4 (``RTL::findRtlDestination``): with RTL_TYPE 0 the nearest of home and the rally points; 3
        looks at the mission's landing too, 1 at that and the rally points, 5 at rally points alone, and
        lands where it is without; 2 and 4 lead along the mission.  ArduPilot
        (``AP_Rally::find_nearest_rally_point``): the nearest rally point, unless home is nearer and
        RALLY_INCL_HOME is set or the rally point is beyond RALLY_LIMIT_KM.  References by steps know
        home alone.
        """
        home = np.full(len(stage), HOME, dtype=np.intp)
        if self.follows_mission:
            return np.full_like(home, ALONG)
        if self.parameters is None:
            return home
        from planner.vehicle.parameters.ardupilot import ArduPilotParameters

        to_home = self.home_ground_m[self.home_of(stage), :2] - point_m[:, :2]
        home_m = np.hypot(to_home[:, 0], to_home[:, 1])
        away = point_m[:, None, :2] - self.rally_ground_m[None, :, :2]
        rally_m = np.hypot(away[..., 0], away[..., 1])
        if self.mission_ways is not None:
            return self._chosen_by_px4(point_m, home_m, rally_m, self.home_of(stage))
        parameters = self.parameters
        if not len(self.rally_ground_m) or not isinstance(parameters, ArduPilotParameters):
            return home
        nearest, nearest_m = rally_m.argmin(axis=1), rally_m.min(axis=1)
        limit_m = parameters.rally_limit_m
        far = (limit_m > 0.0) & (nearest_m > limit_m)
        taken = ~((home_m < nearest_m) & (far | bool(parameters.rally_includes_home)))
        return np.where(taken, nearest + 1, home)

    def _chosen_by_px4(
        self, point_m: FloatArray, home_m: FloatArray, rally_m: FloatArray, home: IntArray
    ) -> IntArray:
        """Return the destination PX4 chooses among home, the landing and the rally points. (n,)"""
        from planner.vehicle.parameters.px4 import Px4Parameters

        ways, parameters = self.mission_ways, self.parameters
        assert isinstance(parameters, Px4Parameters)
        kind = parameters.return_type
        least_m = np.full(len(home_m), np.inf) if kind in _PX4_NOT_HOME else home_m
        chosen = np.full(len(home_m), HERE if kind == _PX4_RALLY_ONLY else HOME, dtype=np.intp)
        if ways is not None and ways.landing is not None:
            landing = ways.landing.stages[-1]
            landing_m = np.hypot(landing.east_m - point_m[:, 0], landing.north_m - point_m[:, 1])
            nearer = landing_m + _NEARER_M < least_m
            chosen, least_m = (
                np.where(nearer, LANDING, chosen),
                np.where(nearer, landing_m, least_m),
            )
        if not len(self.rally_ground_m) or kind not in _PX4_RALLY_TYPES:
            return chosen
        if kind != _PX4_RALLY_ONLY:
            away = self.home_ground_m[home, None, :2] - self.rally_ground_m[None, :, :2]
            rally_m = np.where(np.hypot(away[..., 0], away[..., 1]) > _AT_HOME_M, rally_m, np.inf)
        nearest = rally_m.argmin(axis=1)
        taken = rally_m[np.arange(len(nearest)), nearest] + _NEARER_M < least_m
        return np.where(taken, nearest + 1, chosen)


def make_destinations(
    mission: Mission,
    route: Route,
    parameters: FlightParameters | None,
    *,
    terrain: TerrainGrid | None = None,
) -> Destinations:
    """Return the places the returns of a flight may lead to.

    Parameters
    ----------
    mission : Mission
        Its rally points.
    route : Route
        Its homes.
    parameters : FlightParameters or None
        Of the autopilot that chooses; ``None`` for reference steps.
    terrain : TerrainGrid, optional
        Ground under rally points; default level with home.
    """
    homes = route.moved_homes
    rally = mission.rally
    east, north = route.frame.east_north_m(
        [point.latitude_deg for point in rally], [point.longitude_deg for point in rally]
    )
    ground = np.zeros(len(rally))
    if terrain is not None and rally:
        known = terrain.height_amsl_m(
            np.array([point.latitude_deg for point in rally]),
            np.array([point.longitude_deg for point in rally]),
        )
        ground = np.ma.filled(known - route.home_amsl_m, 0.0)
    height = np.array([point.height_above_home_m for point in rally], dtype=np.float64)
    plain = Destinations(
        home_first_stage=np.array([0, *(home.first_stage for home in homes)], dtype=np.intp),
        home_ground_m=np.array(
            [(0.0, 0.0, 0.0), *((home.east_m, home.north_m, home.ground_m) for home in homes)]
        ),
        rally_ground_m=np.column_stack((east, north, ground)),
        rally_height_m=height - ground,
        parameters=parameters,
    )
    if parameters is None:
        return plain
    from planner.vehicle.parameters.px4 import Px4Parameters

    if not isinstance(parameters, Px4Parameters):
        return plain
    from planner.flight.mission_way import make_mission_ways

    def home_of(stage: int) -> tuple[float, float, float]:
        east_m, north_m, ground_m = plain.home_ground_m[plain.home_of(np.array([stage]))[0]]
        return float(east_m), float(north_m), float(ground_m)

    def ground_m(latitude_deg: float, longitude_deg: float) -> float:
        amsl_m = None if terrain is None else ground_amsl_m(terrain, latitude_deg, longitude_deg)
        return 0.0 if amsl_m is None else amsl_m - route.home_amsl_m

    ways = make_mission_ways(
        mission, route, parameters.return_type, home_of=home_of, ground_m=ground_m
    )
    return replace(plain, mission_ways=ways)


def with_own_return(route: Route, destinations: Destinations) -> Route:
    """Return a route whose own return leads where the vehicle itself would return to.

    Parameters
    ----------
    route : Route
        Its return, if it has one, is its last stage, and leads straight home.
    destinations : Destinations
        Of the route.
    """
    number = len(route.stages) - 1
    if number < 1 or route.stages[number].kind is not StageKind.RETURN:
        return route
    before = route.stages[number - 1]
    place_m = np.array([[before.east_m, before.north_m, before.height_m]])
    stage = np.array([number])
    chosen = destinations.chosen(place_m, stage)
    if chosen[0] == HOME:
        return route
    targets = destinations.targets(stage, chosen, place_m)
    east_m, north_m, ground_m = targets.ground_m[0].tolist()
    returning = replace(
        route.stages[number],
        east_m=east_m,
        north_m=north_m,
        height_m=ground_m,
        rally_height_m=float(targets.rally_height_m[0]),
        way=targets.ways[0] if targets.ways else None,
    )
    return replace(route, stages=(*route.stages[:number], returning))
