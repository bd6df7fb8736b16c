"""Destinations: where a return leads from each point of a flight, by the vehicle's own rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission
    from planner.mission.stage import Route
    from planner.vehicle.parameters import FlightParameters

HOME = 0
"""Home among destinations; rally point n of the mission is n."""
_NEARER_M = 2.0
"""A rally point this much nearer than home is taken: ``MIN_DIST_THRESHOLD`` of PX4's rtl.cpp. [m]"""
_PX4_RALLY_TYPES = frozenset({0, 1, 3, 5})
"""RTL_TYPE that looks at rally points; 2 and 4 follow the mission, 6 goes home if it can."""
_PX4_RALLY_ONLY = frozenset({1, 5})
"""RTL_TYPE that leads home only where there is nothing else."""


@frozen(eq=False)
class Targets:
    """Where each of n returns leads."""

    ground_m: FloatArray
    """East, north, height of the ground above the first home. (n, 3) [m]"""
    rally_height_m: FloatArray
    """Height of a rally point above that ground; 0 for home. (n,) [m]"""

    def __getitem__(self, rows: IntArray) -> Targets:
        return Targets(ground_m=self.ground_m[rows], rally_height_m=self.rally_height_m[rows])


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

    def home_of(self, stage: IntArray) -> IntArray:
        """Return which home counts while stages are flown, as positions among the homes. (n,)"""
        return np.searchsorted(self.home_first_stage, stage, side="right") - 1

    def targets(self, stage: IntArray, destination: IntArray | int) -> Targets:
        """Return the targets of returns: ``HOME`` as of their stages, or rally points. (n,)"""
        destination = np.broadcast_to(np.asarray(destination, dtype=np.intp), stage.shape)
        ground_m = self.home_ground_m[self.home_of(stage)]
        height_m = np.zeros(len(stage))
        rally = destination > HOME
        if rally.any():
            ground_m[rally] = self.rally_ground_m[destination[rally] - 1]
            height_m[rally] = self.rally_height_m[destination[rally] - 1]
        return Targets(ground_m=ground_m, rally_height_m=height_m)

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
        PX4 (``RTL::findRtlDestination``): the nearest of home and the rally points; RTL_TYPE 1 and 5
        leave out home, 2, 4 and 6 the rally points.  ArduPilot
        (``AP_Rally::find_nearest_rally_point``): the nearest rally point, unless home is nearer and
        RALLY_INCL_HOME is set or the rally point is beyond RALLY_LIMIT_KM.  References by steps know
        home alone.
        """
        home = np.full(len(stage), HOME, dtype=np.intp)
        if not len(self.rally_ground_m) or self.parameters is None:
            return home
        from planner.vehicle.px4_parameters import Px4Parameters

        to_home = self.home_ground_m[self.home_of(stage), :2] - point_m[:, :2]
        home_m = np.hypot(to_home[:, 0], to_home[:, 1])
        away = point_m[:, None, :2] - self.rally_ground_m[None, :, :2]
        rally_m = np.hypot(away[..., 0], away[..., 1])
        nearest = rally_m.argmin(axis=1)
        nearest_m = rally_m[np.arange(len(stage)), nearest]
        parameters = self.parameters
        if isinstance(parameters, Px4Parameters):
            if parameters.return_type not in _PX4_RALLY_TYPES:
                return home
            only = parameters.return_type in _PX4_RALLY_ONLY
            taken = only | (nearest_m + _NEARER_M < home_m)
        else:
            limit_m = parameters.rally_limit_m
            far = (limit_m > 0.0) & (nearest_m > limit_m)
            taken = ~((home_m < nearest_m) & (far | bool(parameters.rally_includes_home)))
        return np.where(taken, nearest + 1, home)


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
    return Destinations(
        home_first_stage=np.array([0, *(home.first_stage for home in homes)], dtype=np.intp),
        home_ground_m=np.array(
            [(0.0, 0.0, 0.0), *((home.east_m, home.north_m, home.ground_m) for home in homes)]
        ),
        rally_ground_m=np.column_stack((east, north, ground)),
        rally_height_m=height - ground,
        parameters=parameters,
    )
