"""Rules on the ground between the posts that ArduPilot knows it by, where it follows them."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.mission.route.stage import StageKind
from planner.rules.assessment import numbers
from planner.rules.clearance import (
    ROUNDING_M,
    SAME_PLACE_M,
    STEEPEST_RISE,
    STRAIGHT_M,
    sides_of,
    too_near_text,
)
from planner.rules.declaration import ARDUPILOT, TERRAIN, judges
from planner.rules.terrain import BELOW_TERRAIN, IN_THE_AIR
from planner.rules.terrain_following import (
    following_parameters,
    follows_terrain,
    reach_down_m,
    returns_follow_terrain,
)
from planner.rules.terrain_returns import RETURN_BELOW_TERRAIN
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.path import FlightLines
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_METRES_PER_DEGREE = 111_318.845
"""Of latitude, as ``Location`` has it (LOCATION_SCALING_FACTOR)."""
_EAST_OFF_M = (-15.0, 0.0, 15.0)
"""How far posts may be off to the east: longitudes are scaled at the middle between a whole degree and the
place, or a block of 2.8 km; ground stations fill blocks by their own geodesy. [m]"""
_PART_M = 10.0
"""Ground between posts bends where their rows are crossed: lines are judged in parts so long. [m]"""
_MOST_PARTS = 50_000
"""But in so many at most: the ground of the grid counts at every bend of it all the same."""
_ROWS = 2**17
"""More posts than there are on a degree, 1 m apart."""
_FIX = "fly higher there, or set TERRAIN_SPACING to the cells of the grid"


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
            spacing_m=max(given.get("TERRAIN_SPACING", 100.0), 1.0),
            most_offset_m=max(given.get("TERRAIN_OFS_MAX", 30.0), 0.0),
        )

    def lowest_amsl_m(self, latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
        """Return the height of the ground that is followed, at least, wherever its posts are. [m]"""
        home_deg = np.array([self.home_deg[0]]), np.array([self.home_deg[1]])
        each = []
        for off_m in _EAST_OFF_M:
            above_m = self._known_m(*home_deg) - self._posted_m(*home_deg, off_m)
            offset_m = np.clip(np.nan_to_num(above_m), -self.most_offset_m, self.most_offset_m)
            each.append(self._posted_m(latitude_deg, longitude_deg, off_m) + offset_m)
        return np.asarray(np.min(each, axis=0))

    def _known_m(self, latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
        return np.asarray(self.terrain.height_amsl_m(latitude_deg, longitude_deg).filled(np.nan))

    def _posted_m(
        self, latitude_deg: FloatArray, longitude_deg: FloatArray, off_m: float
    ) -> FloatArray:
        south, west = np.floor(latitude_deg), np.floor(longitude_deg)
        north = (latitude_deg - south) * _METRES_PER_DEGREE / self.spacing_m
        east = (longitude_deg - west) * _east_m(south, latitude_deg) + off_m
        east /= self.spacing_m
        row, column = np.floor(north), np.floor(east)
        # Most places share their four posts with those beside them.
        square = ((south + 90.0) * 360.0 + west + 180.0) * _ROWS**2 + row * _ROWS + column
        _, first, of_place = np.unique(square, return_index=True, return_inverse=True)
        of_place = of_place.reshape(square.shape)
        corner_deg = [one.ravel()[first] for one in (south, west)]
        corner = [one.ravel()[first] for one in (row, column)]
        height_m = np.zeros(north.shape)
        for up, right in product((0.0, 1.0), repeat=2):
            weight = np.abs(1.0 - up - (north - row)) * np.abs(1.0 - right - (east - column))
            post_deg = corner_deg[0] + (corner[0] + up) * self.spacing_m / _METRES_PER_DEGREE
            post_east_m = (corner[1] + right) * self.spacing_m - off_m
            post_m = self._known_m(
                post_deg, corner_deg[1] + post_east_m / _east_m(corner_deg[0], post_deg)
            )[of_place]
            is_known = ~np.isnan(post_m)
            if not is_known.all():
                # Beyond the end of the grid a post is as high as the ground here.
                post_m = np.where(is_known, post_m, self._known_m(latitude_deg, longitude_deg))
            height_m += weight * post_m
        return height_m


def _east_m(south_deg: FloatArray, latitude_deg: FloatArray) -> FloatArray:
    """Return the length of a degree of longitude, as ``Location::get_distance_NE`` scales it. [m]"""
    return np.asarray(_METRES_PER_DEGREE * np.cos(np.radians(0.5 * (south_deg + latitude_deg))))


@judges(BELOW_TERRAIN, needs=(TERRAIN,))
def _follows_posts(a: Assessment, terrain: TerrainGrid) -> Iterator[Finding]:
    """Yield a finding where a leg that follows the ground passes too near to what is between its posts."""
    if reach_down_m(a) is not None:  # a rangefinder sees the ground itself
        return
    stages = a.route.stages
    rows = [
        row
        for row, stage in enumerate(stages)
        if row and stage.kind in IN_THE_AIR | {StageKind.RETURN} and follows_terrain(a, stage.item)
    ]
    if not rows:
        return
    from planner.flight.path import FlightLines

    ground = PostedGround.of(a, terrain)
    lines = _followed_lines(a, ground, rows)
    sides = sides_of(lines, a.setup.position_margin_m)
    lowest = _lowest(a, ground, FlightLines.joined([lines, *sides]))
    if lowest is not None:
        clearance_m, row = lowest
        yield a.finding(
            BELOW_TERRAIN, _text(a, ground, clearance_m), item=stages[row].item, fix=_FIX
        )


@judges(RETURN_BELOW_TERRAIN, needs=(ARDUPILOT, TERRAIN))
def _returns_follow_posts(
    a: Assessment, parameters: ArduPilotParameters, terrain: TerrainGrid
) -> Iterator[Finding]:
    sample = a.returns.sample
    if sample is None or not returns_follow_terrain(a) or reach_down_m(a) is not None:
        return
    from planner.flight.path import FlightLines

    ground = PostedGround.of(a, terrain)
    corners_m, _ = a.returns.straight_corners_m(sample.points, sample.destination)
    ways_m = corners_m[:, 2:4].copy()
    above_m = corners_m[:, 1, 2] - _followed_m(a, ground, corners_m[:, 1])
    ways_m[..., 2] = np.fmax(above_m, parameters.return_altitude_m)[:, None]
    lines = FlightLines(start_m=ways_m[:, 0], end_m=ways_m[:, 1], owner=np.arange(len(ways_m)))
    lowest = _lowest(a, ground, lines)
    if lowest is not None:
        clearance_m, row = lowest
        yield a.finding(
            RETURN_BELOW_TERRAIN,
            f"a return from here {_text(a, ground, clearance_m)}",
            item=a.route.stages[int(sample.points.stage[row])].item,
            fix=_FIX,
        )


def _text(a: Assessment, ground: PostedGround, clearance_m: float) -> str:
    return (
        f"follows the ground by posts {quantity.distance(ground.spacing_m)} apart (TERRAIN_SPACING): "
        f"{too_near_text(a, clearance_m)} between them"
    )


def _followed_m(a: Assessment, ground: PostedGround, place_m: FloatArray) -> FloatArray:
    """Return the height of the ground that is followed, above home. (n,) [m]"""
    where = a.route.frame.latitude_longitude_deg(place_m[:, 0], place_m[:, 1])
    return ground.lowest_amsl_m(*where) - a.route.ground_datum_m


def _followed_lines(a: Assessment, ground: PostedGround, rows: list[int]) -> FlightLines:
    """Return the way of stages that follow the ground, at the height above it that is asked for.

    That changes evenly from item to item; on circles and returns it stays.
    """
    from planner.flight.path import FlightLines, flown_lines, flown_path

    stages = a.route.stages
    place_m = np.array([(one.east_m, one.north_m, one.height_m) for one in stages])
    where = a.route.frame.latitude_longitude_deg(place_m[:, 0], place_m[:, 1])
    known_m = ground.terrain.height_amsl_m(*where).filled(np.nan) - a.route.ground_datum_m
    follows = np.isin(np.arange(len(stages)), rows)
    above_m = place_m[:, 2] - np.where(follows, known_m, _followed_m(a, ground, place_m))
    return_m = following_parameters(a).return_altitude_m
    path = flown_path(a.flight.motion, straight_m=STRAIGHT_M)
    of_stage: IntArray = a.returns.segment_stage[path.segment]
    found = []
    for row in rows:
        legs = np.flatnonzero((of_stage == row) & (path.length_m > SAME_PLACE_M))
        if not len(legs):
            continue
        lines, way_m = flown_lines(path, legs), np.cumsum(path.length_m[legs])
        begins, ends = above_m[row - 1], above_m[row]
        if stages[row].kind is StageKind.CIRCLE:
            begins = ends
        elif stages[row].kind is StageKind.RETURN:
            begins = ends = max(begins, return_m)
        asked_m = begins + (ends - begins) * np.append(0.0, way_m) / way_m[-1]
        start_m, end_m = lines.start_m.copy(), lines.end_m.copy()
        start_m[:, 2], end_m[:, 2] = asked_m[:-1], asked_m[1:]
        found.append(FlightLines(start_m=start_m, end_m=end_m, owner=np.full(len(legs), row)))
    return FlightLines.joined(found)


def _lowest(a: Assessment, ground: PostedGround, lines: FlightLines) -> tuple[float, int] | None:
    """Return how high lines above the ground that is followed pass over the ground, and the lowest's owner.

    ``None`` where everything is as high as asked for.
    """
    lines = lines.cut(max(_PART_M, float(lines.length_m.sum()) / _MOST_PARTS))
    ends_m = np.stack((lines.start_m, lines.end_m), axis=1)
    where = a.route.frame.latitude_longitude_deg(ends_m[..., 0], ends_m[..., 1])
    followed_m = ground.lowest_amsl_m(*where)
    under = ground.terrain.under(*where)
    along = np.stack((under.start, under.end), axis=1)
    of_line = followed_m[under.line]
    height_m = of_line[:, :1] + along * (of_line[:, 1:] - of_line[:, :1]) - under.ground_amsl_m
    along = along[..., None]
    place_m = ends_m[under.line, :1] + along * (ends_m[under.line, 1:] - ends_m[under.line, :1])
    height_m += place_m[..., 2]
    from_home_m = np.hypot(place_m[..., 0], place_m[..., 1])
    asked_m = np.minimum(a.setup.clearance_m, STEEPEST_RISE * from_home_m) - ROUNDING_M
    # What was asked for as low is told as that.
    is_low = (height_m < asked_m) & (place_m[..., 2] >= asked_m)
    if not is_low.any():
        return None
    part, end = np.unravel_index(int(np.where(is_low, height_m, np.inf).argmin()), is_low.shape)
    return float(height_m[part, end]), int(lines.owner[under.line[part]])
