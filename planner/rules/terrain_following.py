"""Where ArduPilot follows the ground, and how low it gets where that rises faster than it climbs."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.flight.pilot import is_of_ardupilot
from planner.mission.commands import TERRAIN_FRAMES, Command
from planner.rules.assessment import numbers
from planner.rules.clearance import PART_M
from planner.rules.declaration import ARDUPILOT
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.path import FlightLines
    from planner.flight.returns.path import ReturnPoints
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

OVER_TERRAIN = 1
"""RTL_ALT_TYPE for heights above terrain."""
_MOST_PLACES = 4000
"""Of a leg at which the ground is looked up."""
_METRES_PER_DEGREE = 111_318.845
"""Of latitude, as ``Location`` has it (LOCATION_SCALING_FACTOR)."""
_EAST_OFF_M = (-15.0, 0.0, 15.0)
"""How far posts may be off to the east: longitudes are scaled at the middle between a whole degree and the
place, or a block of 2.8 km; ground stations fill blocks by their own geodesy. [m]"""
_ROWS = 2**17
"""More posts than there are on a degree, 1 m apart."""
_PART_M = 10.0
"""Ground between posts bends where their rows are crossed: lines are judged in parts so long. [m]"""
_MOST_PARTS = 50_000
"""But in so many at most: the ground of the grid counts at every bend of it all the same."""


def follows_terrain(a: Assessment, number: int) -> bool:
    """Return whether ArduPilot follows the ground to an item, from 1; a return by RTL_ALT_TYPE."""
    by = a.autopilot
    if by is Autopilot.STEP and a.setup.terrain is not None and a.target is not None:
        by = a.target.autopilot
    if by is not Autopilot.ARDUPILOT or number <= 0:
        return False
    item = a.mission.items[number - 1]
    if item.command != Command.NAV_RETURN_TO_LAUNCH:
        return item.frame in TERRAIN_FRAMES
    if not returns_follow_terrain(a):
        return False
    begins = [max(row - 1, 0) for row, stage in enumerate(a.route.stages) if stage.item == number]
    return bool(returns_begun_within_reach(a, stage_ends_m(a)[begins]).all())


def following_parameters(a: Assessment) -> ArduPilotParameters:
    """Return the parameters ArduPilot follows the ground by: a file's, else as it is delivered."""
    from planner.vehicle.parameters.resolve import resolve_parameters

    own = ARDUPILOT.of(a) or resolve_parameters(Autopilot.ARDUPILOT, model=a.vehicle).values
    assert is_of_ardupilot(own)
    return own


def returns_follow_terrain(a: Assessment) -> bool:
    """Return whether returns keep a height above the ground, with terrain data or a rangefinder."""
    own = ARDUPILOT.of(a)
    if own is None or own.return_altitude_type != OVER_TERRAIN:
        return False
    reach_m = reach_down_m(a)
    return bool(own.terrain_enable) if reach_m is None else own.return_altitude_m <= reach_m


def returns_begun_within_reach(a: Assessment, place_m: FloatArray) -> BoolArray:
    """Return whether what they follow the ground by has it in reach where returns begin. (n,)

    A rangefinder may not; else ``ModeRTL::compute_return_target`` counts above home.  Flown: begun above its
    reach, "rangefinder unhealthy, using alt-above-home".  ``place_m``: east, north, height above home (n, 3).
    """
    reach_m = reach_down_m(a)
    if reach_m is None:
        return np.ones(len(place_m), np.bool_)
    known_m = known_above_m(a, place_m)
    return np.where(np.isnan(known_m), place_m[:, 2], known_m) <= reach_m


def stage_ends_m(a: Assessment) -> FloatArray:
    """Return the places at which stages end: east, north, height above home. (n, 3) [m]"""
    return np.array([(one.east_m, one.north_m, one.height_m) for one in a.route.stages])


def known_above_m(a: Assessment, place_m: FloatArray) -> FloatArray:
    """Return the heights of places (n, 3) above the ground; NaN where it is not known. (n,) [m]"""
    if a.setup.terrain is None:
        return np.full(len(place_m), np.nan)
    where = a.route.frame.latitude_longitude_deg(place_m[:, 0], place_m[:, 1])
    ground_m = a.setup.terrain.height_amsl_m(*where).filled(np.nan) - a.route.ground_datum_m
    return np.asarray(place_m[:, 2] - ground_m)


def ends_above_ground_m(a: Assessment) -> FloatArray:
    """Return the heights above the ground at which stages end; above home where it is not known. (n,) [m]"""
    place_m = stage_ends_m(a)
    known_m = known_above_m(a, place_m)
    return np.where(np.isnan(known_m), place_m[:, 2], known_m)


def followed_m(
    a: Assessment, terrain: TerrainGrid, east_m: FloatArray, north_m: FloatArray
) -> FloatArray:
    """Return the height above the first home of the ground that is followed, each way it may be. (k, …) [m]

    By a rangefinder that of ``terrain``, else of its posts, wherever these are.
    """
    where = a.route.frame.latitude_longitude_deg(east_m, north_m)
    if reach_down_m(a) is not None:
        ground_m = terrain.height_amsl_m(*where).filled(np.nan)[None]
    else:
        ground_m = PostedGround.of(a, terrain).each_amsl_m(*where)
    return np.asarray(ground_m - a.route.ground_datum_m)


def least_followed_m(a: Assessment, terrain: TerrainGrid, place_m: FloatArray) -> FloatArray:
    """Return the height of the ground that is followed above home, at least. (n,) [m]"""
    return np.asarray(followed_m(a, terrain, place_m[:, 0], place_m[:, 1]).min(axis=0))


def returns_above_m(
    a: Assessment,
    points: ReturnPoints,
    destination: IntArray,
    *,
    below_m: FloatArray,
    ahead_m: FloatArray,
) -> FloatArray:
    """Return the height above the ground that returns keep which follow it. (n,) [m]

    ``below_m`` and ``ahead_m`` are the heights of the ground above the first home where they set out, and
    where they lead to (n,).  ``ModeRTL::compute_return_target``: as of a return above home, but that the
    fence lowers it by what it is too high over its target.
    """
    from planner.flight.motion.ardupilot.stages import known_ceiling_m, return_height_m

    own = following_parameters(a)
    targets = a.returns.destinations.targets(points.stage, destination, points.stop_m)
    start_m, place_m = points.stop_m.copy(), targets.ground_m.copy()
    start_m[:, 2] -= below_m
    place_m[:, 2] += targets.above_ground_m - ahead_m
    ceiling_m = known_ceiling_m(targets.return_ceiling_m, own) + targets.datum_m - ahead_m
    return return_height_m(start_m, place_m, np.zeros(len(start_m)), ceiling_m, own)


def returns_from_ends_m(a: Assessment, terrain: TerrainGrid) -> tuple[IntArray, FloatArray]:
    """Return the heights above the ground that returns from the ends of stages keep, and these stages. [m]"""
    points = a.returns.end_points(a.returns.stage_ends)
    homeward = a.returns.chosen(points)
    corners_m, _ = a.returns.straight_corners_m(points, homeward)
    below_m, ahead_m = (least_followed_m(a, terrain, corners_m[:, end]) for end in (2, 3))
    return points.stage, returns_above_m(a, points, homeward, below_m=below_m, ahead_m=ahead_m)


def tops_over_terrain_m(a: Assessment, points: ReturnPoints, destination: IntArray) -> FloatArray:
    """Return the greatest height above the first home of returns that may follow the ground of --terrain.

    Where none does, or the ground is not known, −∞. (n,) [m]
    """
    from planner.flight.path import FlightLines

    terrain, tops_m = a.setup.terrain, np.full(len(destination), -np.inf)
    if terrain is None or not len(destination) or not returns_follow_terrain(a):
        return tops_m
    corners_m, _ = a.returns.straight_corners_m(points, destination)
    ways = FlightLines(
        start_m=corners_m[:, 2], end_m=corners_m[:, 3], owner=np.arange(len(corners_m))
    )
    parts = ways.cut(followed_part_m(ways))
    ends_m = [followed_m(a, terrain, *ends[:, :2].T) for ends in (ways.start_m, ways.end_m)]
    ground_m = followed_m(a, terrain, *parts.end_m[:, :2].T)
    follows = returns_begun_within_reach(a, points.place_m)
    for below_m, ahead_m, own_m in zip(*ends_m, ground_m, strict=True):
        above_m = returns_above_m(a, points, destination, below_m=below_m, ahead_m=ahead_m)
        highest_m = below_m.copy()
        np.fmax.at(highest_m, parts.owner, own_m)
        tops_m = np.where(follows, np.fmax(tops_m, highest_m + above_m), tops_m)
    return tops_m


def followed_part_m(lines: FlightLines) -> float:
    """Return how long the parts are in which lines over ground that is followed are judged. [m]"""
    return max(_PART_M, float(lines.length_m.sum()) / _MOST_PARTS)


def reach_down_m(a: Assessment) -> float | None:
    """Return how far the rangefinder reaches that ArduPilot follows the ground by; ``None``: by none. [m]"""
    from planner.rules.arming_checks import rangefinder_reach_m

    return rangefinder_reach_m(numbers(a))


def spacing_m(a: Assessment) -> float:
    """Return how far apart the posts are by which ArduPilot knows the ground. [m]"""
    return max(numbers(a).get("TERRAIN_SPACING", 100.0), 1.0)


class PostedGround(Value, eq=False):
    """The ground as ArduPilot follows it: straight between posts, lifted to be right at home.

    Notes
    -----
    ``AP_Terrain::calculate_grid_info`` and ``height_amsl``: posts TERRAIN_SPACING apart from the next whole
    degrees to the south and west, bilinear between; a ground station sends the ground at the posts.
    ``update_reference_offset`` adds what home is above that, TERRAIN_OFS_MAX at most.  Flown: a hill of
    20 m, 90 m wide, between two posts was flown through at the height of the plain.
    """

    terrain: TerrainGrid
    home_deg: tuple[float, float]
    spacing_m: float
    most_offset_m: float

    @classmethod
    def of(cls, a: Assessment, terrain: TerrainGrid) -> PostedGround:
        """Return the ground that the vehicle of a flight follows."""
        given = numbers(a)
        latitude, longitude = a.route.frame.latitude_longitude_deg(np.zeros(1), np.zeros(1))
        return cls(
            terrain=terrain,
            home_deg=(float(latitude[0]), float(longitude[0])),
            spacing_m=spacing_m(a),
            most_offset_m=max(given.get("TERRAIN_OFS_MAX", 30.0), 0.0),
        )

    def each_amsl_m(self, latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
        """Return the height of the ground that is followed, by each place its posts may be at. (3, …) [m]"""
        known_m = self._known_m(*(np.array([one]) for one in self.home_deg))
        latitude = np.append(
            latitude_deg.ravel(), self.home_deg[0]
        )  # home is the last of the places
        longitude = np.append(longitude_deg.ravel(), self.home_deg[1])
        each = []
        for off_m in _EAST_OFF_M:
            posted_m = self._posted_m(latitude, longitude, off_m)
            above_m = np.nan_to_num(known_m - posted_m[-1:])
            offset_m = np.clip(above_m, -self.most_offset_m, self.most_offset_m)
            each.append(posted_m[:-1].reshape(latitude_deg.shape) + offset_m)
        return np.array(each)

    def _known_m(self, latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
        return np.asarray(self.terrain.height_amsl_m(latitude_deg, longitude_deg).filled(np.nan))

    def _posted_m(
        self, latitude_deg: FloatArray, longitude_deg: FloatArray, off_m: float
    ) -> FloatArray:
        """Return the height between posts at places (n,), before it is lifted. (n,) [m]"""
        south, west = np.floor(latitude_deg), np.floor(longitude_deg)
        north = (latitude_deg - south) * _METRES_PER_DEGREE / self.spacing_m
        east = (longitude_deg - west) * _east_m(south, latitude_deg) + off_m
        east /= self.spacing_m
        row, column = np.floor(north), np.floor(east)
        # Most places share their four posts with those beside them.
        square = ((south + 90.0) * 360.0 + west + 180.0) * _ROWS**2 + row * _ROWS + column
        _, first, of_place = np.unique(square, return_index=True, return_inverse=True)
        corner_deg = [one[first] for one in (south, west)]
        corner = [one[first] for one in (row, column)]
        up, right = np.array(list(product((0.0, 1.0), repeat=2))).T[:, :, None]
        post_deg = corner_deg[0] + (corner[0] + up) * self.spacing_m / _METRES_PER_DEGREE
        post_east_m = (corner[1] + right) * self.spacing_m - off_m
        posts_m = self._known_m(
            post_deg, corner_deg[1] + post_east_m / _east_m(corner_deg[0], post_deg)
        )[:, of_place]
        is_known = ~np.isnan(posts_m)
        if not is_known.all():
            # Beyond the end of the grid a post is as high as the ground here.
            posts_m = np.where(is_known, posts_m, self._known_m(latitude_deg, longitude_deg))
        weights = np.abs(1.0 - up - (north - row)) * np.abs(1.0 - right - (east - column))
        return np.asarray((weights * posts_m).sum(axis=0))


def _east_m(south_deg: FloatArray, latitude_deg: FloatArray) -> FloatArray:
    """Return the length of a degree of longitude, as ``Location::get_distance_NE`` scales it. [m]"""
    return np.asarray(_METRES_PER_DEGREE * np.cos(np.radians(0.5 * (south_deg + latitude_deg))))


class FollowingLegs(Value, eq=False):
    """Straight legs that ArduPilot flies at a height above the ground."""

    start_m: FloatArray
    """East and north. (n, 2) [m]"""
    end_m: FloatArray
    above_m: FloatArray
    """Height above the ground asked for at the beginning and the end. (n, 2) [m]"""
    limits_m_s: tuple[FloatArray, FloatArray, FloatArray]
    """Of horizontal flight, climbs and descents. (n,) each"""
    stage: IntArray
    """Those of consecutive numbers follow each other. (n,)"""

    def least_above_m(
        self, a: Assessment, terrain: TerrainGrid, parameters: ArduPilotParameters
    ) -> FloatArray:
        """Return the least height of each above the ground, as it is flown; NaN: not known. (n,) [m]"""
        from planner.flight.motion.ardupilot.stages import followed_above_m

        length_m = np.hypot(*(self.end_m - self.start_m).T)
        ground_m = []
        for start_m, end_m, long_m in zip(self.start_m, self.end_m, length_m, strict=True):
            count = min(int(long_m / max(terrain.cell_m, PART_M)) + 2, _MOST_PLACES)
            places_m = start_m + np.linspace(0.0, 1.0, count)[:, None] * (end_m - start_m)
            each_m = followed_m(a, terrain, *places_m.T)
            ground_m.append(each_m[len(each_m) // 2])
        is_known = np.array([not np.isnan(own).any() for own in ground_m], np.bool_)
        level = [
            own if known else np.zeros(2) for own, known in zip(ground_m, is_known, strict=True)
        ]
        least_m = followed_above_m(
            self.stage,
            level,
            length_m,
            self.above_m,
            limits_m_s=self.limits_m_s,
            parameters=parameters,
        )
        return np.where(is_known, least_m, np.nan)
