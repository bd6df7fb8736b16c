"""Where ArduPilot follows the ground, and how low it gets where that rises faster than it climbs."""

from __future__ import annotations

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
    from planner.arrays import FloatArray, IntArray
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

OVER_TERRAIN = 1
"""RTL_ALT_TYPE for heights above terrain."""
_MOST_PLACES = 4000
"""Of a leg at which the ground is looked up."""


def follows_terrain(a: Assessment, number: int) -> bool:
    """Return whether ArduPilot follows the ground to an item, from 1; a return by RTL_ALT_TYPE."""
    by = a.autopilot
    if by is Autopilot.STEP and a.setup.terrain is not None and a.target is not None:
        by = a.target.autopilot
    if by is not Autopilot.ARDUPILOT or number <= 0:
        return False
    item = a.mission.items[number - 1]
    if item.command == Command.NAV_RETURN_TO_LAUNCH:
        return returns_follow_terrain(a)
    return item.frame in TERRAIN_FRAMES


def following_parameters(a: Assessment) -> ArduPilotParameters:
    """Return the parameters ArduPilot follows the ground by: a file's, else as it is delivered."""
    from planner.vehicle.parameters.resolve import resolve_parameters

    own = ARDUPILOT.of(a) or resolve_parameters(Autopilot.ARDUPILOT, model=a.vehicle).values
    assert is_of_ardupilot(own)
    return own


def returns_follow_terrain(a: Assessment) -> bool:
    """Return whether returns keep a height above the ground.

    ``ModeRTL::compute_return_target``: with terrain data or a rangefinder, else above home as ever.  Flown:
    begun above the reach of that, "rangefinder unhealthy, using alt-above-home".
    """
    own = ARDUPILOT.of(a)
    if own is None or own.return_altitude_type != OVER_TERRAIN:
        return False
    reach_m = reach_down_m(a)
    if reach_m is not None:  # out of its reach ModeRTL begins again, above home
        highest_m = float(np.nan_to_num(ends_above_ground_m(a)).max(initial=0.0))
        return own.return_altitude_m <= reach_m and highest_m <= reach_m
    return bool(own.terrain_enable)


def ends_above_ground_m(a: Assessment) -> FloatArray:
    """Return the heights above the ground at which stages end; above home where it is not known. (n,) [m]"""
    place_m = np.array([(one.east_m, one.north_m, one.height_m) for one in a.route.stages])
    if a.setup.terrain is None:
        return place_m[:, 2]
    where = a.route.frame.latitude_longitude_deg(place_m[:, 0], place_m[:, 1])
    ground_m = a.setup.terrain.height_amsl_m(*where).filled(np.nan) - a.route.ground_datum_m
    return np.asarray(place_m[:, 2] - np.nan_to_num(ground_m))


def tops_over_terrain_m(a: Assessment, corners_m: FloatArray) -> FloatArray:
    """Return the greatest height above the first home of returns that may follow the ground of --terrain.

    Where none does, or the ground is not known, −∞.  ``corners_m`` are those of `Returns.straight_corners_m`.
    (n,) [m]
    """
    terrain, tops_m = a.setup.terrain, np.full(len(corners_m), -np.inf)
    own = ARDUPILOT.of(a)
    if terrain is None or own is None or not returns_follow_terrain(a):
        return tops_m
    ways_m = corners_m[:, 2:4, :2]
    ground = terrain.under(*a.route.frame.latitude_longitude_deg(ways_m[..., 0], ways_m[..., 1]))
    ground_m = ground.ground_amsl_m.max(axis=1) - a.route.ground_datum_m
    begins = np.flatnonzero(np.diff(ground.line, prepend=-1))
    below_m = ground.ground_amsl_m[begins, 0] - a.route.ground_datum_m
    above_m = np.fmax(corners_m[:, 1, 2] - below_m, own.return_altitude_m)
    np.fmax.at(tops_m, ground.line, ground_m + above_m[ground.line])
    return tops_m


def reach_down_m(a: Assessment) -> float | None:
    """Return how far the rangefinder reaches that ArduPilot follows the ground by; ``None``: by none. [m]"""
    from planner.rules.arming_checks import rangefinder_reach_m

    return rangefinder_reach_m(numbers(a))


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
            where = a.route.frame.latitude_longitude_deg(*places_m.T)
            ground_m.append(terrain.height_amsl_m(*where).filled(np.nan))
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
