"""Terrain files that overlap: where they differ, the flight is judged by each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.rules.declaration import SEVERAL_TERRAINS, judges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.geo.terrain import OtherGround, TerrainGrid
    from planner.rules.assessment import Assessment

_AROUND_M = 200.0
"""Curves, position errors and returns stay so near to the box of the flight, home and rally points. [m]"""
_WORTH_SAYING_M = 1.0
"""Whole metres, as SRTM has them, and resampling differ by less. [m]"""

TERRAIN_DIFFERS = Rule(
    "A119 terrain-differs",
    Severity.WARNING,
    summary="Two --terrain files differ where they overlap: the flight is judged by each of them.",
    why="One of them is of another datum, of trees and roofs, or wrong; the order of a command line does not "
    "say which.",
    how="Heights of every file where an earlier one counts, around the flight, home and rally points, at 129 "
    "places each way; fires above 1 m.  Where they differ at all (1 cm) the mission is predicted again with "
    "each such file first, and whatever is an error then is one.",
    fix="give the file that is right there alone, or cut the other one",
)


@judges(TERRAIN_DIFFERS, needs=(SEVERAL_TERRAINS,))
def _terrain_differs(a: Assessment, terrain: TerrainGrid) -> Iterator[Finding]:
    for other in others_around(a, terrain):
        if abs(other.apart_m) > _WORTH_SAYING_M:
            way = "above" if other.apart_m > 0.0 else "below"
            yield a.finding(
                TERRAIN_DIFFERS,
                f"{other.source} has the ground up to {quantity.height(abs(other.apart_m))} {way} that of "
                f"{other.counted}, at {other.latitude_deg:.5f}, {other.longitude_deg:.5f}: judged by both",
            )


def others_around(a: Assessment, terrain: TerrainGrid) -> tuple[OtherGround, ...]:
    """Return the files that know other ground around a flight than those that count there."""
    if len(terrain.tiles) == 1:
        return ()
    rally = [(point.latitude_deg, point.longitude_deg) for point in a.mission.rally]
    rally_m = np.array([a.route.frame.east_north_m(*place) for place in rally]).reshape(-1, 2)
    path_m = np.column_stack((a.path.east_m, a.path.north_m))
    places_m = np.concatenate(([(0.0, 0.0)], path_m, rally_m))
    low_m, high_m = places_m.min(axis=0) - _AROUND_M, places_m.max(axis=0) + _AROUND_M
    corners = a.route.frame.latitude_longitude_deg(
        np.array([low_m[0], high_m[0]]), np.array([low_m[1], high_m[1]])
    )
    return terrain.others(*corners)
