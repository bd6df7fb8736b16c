"""Family A: altitudes, terrain, heights of a site."""

from __future__ import annotations

from typing import TYPE_CHECKING

from made_missions import HOME, item, mission, north, rtl, takeoff, waypoint
from made_terrain import ground, slope
from rule_cases.case import ARDUPILOT, PLAIN, PX4, RuleCases, found

from planner.geo.terrain import TerrainGrid
from planner.site_profile import SiteProfile
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.mission.items import Mission

LEVEL = ground(0.0)
LOW_SITE = SiteProfile(source="site.toml", max_height_above_home_m=60.0)


def at(altitude_m: float | None, *, frame: int = 3, home_m: float | None = 400.0) -> Mission:
    """Return a flight to 100 m and to 200 m north, the farther one at an altitude in a frame."""
    there = item(16, north(200), altitude_m, frame=frame)
    home = replace(HOME, altitude_amsl_m=home_m)
    return mission(takeoff(20), waypoint(100, 20), there, rtl(), home=home)


def left_open(agl_m: float | None) -> Mission:
    """Return a flight to an item without altitude that is meant so high above terrain."""
    there = replace(item(16, north(200), None), unresolved_agl_m=agl_m)
    return mission(takeoff(20), there, rtl())


def behind_a_ridge(height_m: float) -> Mission:
    """Return a flight around a ridge in the height, that ends low behind it."""
    over = [waypoint(200, 300), waypoint(300, 300), waypoint(500, height_m)]
    return mission(takeoff(300), *over, item(21, north(480), 0.0))


OVER_TERRAIN = mission(takeoff(20), item(16, north(200), 30.0, frame=10), rtl())


def landing_at(metres: float) -> Mission:
    """Return a flight that lands so far north, at the height of a slope that rises from home there."""
    return mission(takeoff(60), waypoint(metres, 60), item(21, north(metres), 0.0))


def both(first: TerrainGrid, second: TerrainGrid) -> TerrainGrid:
    """Return two grids of one place."""
    return TerrainGrid(tiles=(*first.tiles, *second.tiles))


CASES: Mapping[str, RuleCases] = {
    "A118": RuleCases(
        fires=lambda: found(OVER_TERRAIN, ARDUPILOT, "TERRAIN_ENABLE,0\n"),
        boundary=lambda: found(
            OVER_TERRAIN, ARDUPILOT, "TERRAIN_ENABLE,0\nRNGFND1_TYPE,8\nRNGFND1_MAX_CM,3000\n"
        ),
        silent=lambda: found(OVER_TERRAIN, ARDUPILOT, "TERRAIN_ENABLE,1\n"),
    ),
    "A119": RuleCases(  # 1 m, less what is lost between cells of single precision
        fires=lambda: found(PLAIN, terrain=both(LEVEL, ground(1.01))),
        boundary=lambda: found(PLAIN, terrain=both(LEVEL, ground(0.9999))),
        silent=lambda: found(PLAIN, terrain=ground(1.01)),
    ),
    "A101": RuleCases(
        fires=lambda: found(at(430.0, frame=0)),
        boundary=lambda: found(at(0.0, frame=0), ARDUPILOT),  # "as before" counts from nothing
        silent=lambda: found(at(30.0, frame=6)),
    ),
    "A102": RuleCases(
        fires=lambda: found(at(-1.01)),
        boundary=lambda: found(at(-1.0)),
        silent=lambda: found(at(-1.01), terrain=ground(-2.0, at_m=200.0), clearance_m=0.0),
    ),
    "A103": RuleCases(
        fires=lambda: found(at(30.0, frame=1)),
        boundary=lambda: found(at(430.0, frame=2), ARDUPILOT),  # AMSL to it
        silent=lambda: found(at(30.0, frame=6)),
    ),
    "A104": RuleCases(
        fires=lambda: found(behind_a_ridge(60), PX4, "RTL_RETURN_ALT,80\n", terrain=ground(75.1)),
        boundary=lambda: found(
            behind_a_ridge(60), PX4, "RTL_RETURN_ALT,80\n", terrain=ground(75.0)
        ),
        silent=lambda: found(behind_a_ridge(60), PX4, "RTL_RETURN_ALT,80\n", terrain=ground(74.9)),
    ),
    "A105": RuleCases(
        fires=lambda: found(at(15.0, frame=0, home_m=None)),
        boundary=lambda: found(at(15.0, frame=0, home_m=0.0)),
        fires_at_boundary=True,
        silent=lambda: found(at(15.0, frame=3, home_m=None)),
    ),
    "A106": RuleCases(
        fires=lambda: found(mission(takeoff(-1), waypoint(100, 20), rtl())),
        boundary=lambda: found(mission(takeoff(0), waypoint(100, 20), rtl())),
        fires_at_boundary=True,
        silent=lambda: found(mission(takeoff(0.1), waypoint(100, 20), rtl())),
    ),
    "A107": RuleCases(
        fires=lambda: found(at(30.0, frame=0)),
        boundary=lambda: found(at(400.0, frame=0)),
        fires_at_boundary=True,
        silent=lambda: found(at(400.1, frame=0)),
    ),
    "A108": RuleCases(
        fires=lambda: found(at(30.0, frame=10)),
        boundary=lambda: found(at(30.0, frame=10), terrain=LEVEL),
        silent=lambda: found(at(30.0)),
    ),
    "A109": RuleCases(
        fires=lambda: found(left_open(None)),
        boundary=lambda: found(at(0.0), PX4),
        silent=lambda: found(at(20.0)),
    ),
    "A110": RuleCases(
        fires=lambda: found(left_open(30.0), terrain=LEVEL),
        boundary=lambda: found(left_open(30.0)),
        silent=lambda: found(at(30.0), terrain=LEVEL),
    ),
    "A111": RuleCases(
        fires=lambda: found(at(0.0), PX4),
        boundary=lambda: found(at(0.001), PX4),
        silent=lambda: found(at(0.0), ARDUPILOT),
    ),
    "A112": RuleCases(  # 2 m, less what is lost between two cells of single precision
        fires=lambda: found(at(30.0, frame=10), ARDUPILOT, terrain=ground(2.1, at_m=150.0)),
        boundary=lambda: found(at(30.0, frame=10), ARDUPILOT, terrain=ground(1.9999, at_m=150.0)),
        silent=lambda: found(at(30.0), ARDUPILOT, terrain=ground(2.1, at_m=150.0)),
    ),
    "A113": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT_TYPE,1\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT_TYPE,0\n"),
        silent=lambda: found(PLAIN, ARDUPILOT),
    ),
    "A114": RuleCases(
        fires=lambda: found(at(60.1), PX4, profile=LOW_SITE),
        boundary=lambda: found(at(60.0), PX4, profile=LOW_SITE),
        silent=lambda: found(at(60.1), PX4),
    ),
    "A115": RuleCases(
        fires=lambda: found(PLAIN, home_amsl_m=403.1),
        boundary=lambda: found(PLAIN, home_amsl_m=403.0),
        silent=lambda: found(PLAIN),
    ),
    "A116": RuleCases(
        fires=lambda: found(PLAIN, terrain=LEVEL),
        boundary=lambda: found(PLAIN, terrain=ground(0.0, at_m=-900.0, rows=20)),
        silent=lambda: found(PLAIN),
    ),
    "A117": RuleCases(  # up to what single precision makes of it
        fires=lambda: found(landing_at(100), terrain=slope(15.1)),
        boundary=lambda: found(landing_at(100), terrain=slope(6.999)),
        silent=lambda: found(landing_at(100), terrain=slope(5.0)),
    ),
}
