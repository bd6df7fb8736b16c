"""What heights count from: the home that counts, wherever a return leads and whatever the ground there.

Ground drawn by hand: a plateau 60 m high from 300 m north of home on, all else level with home, 400 m AMSL.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import HOME, item, mission, north, rtl, takeoff, waypoint
from made_terrain import CELL_M, ROWS, SOUTH_M, ground, of_heights
from thinning import examples

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.fence import RallyPoint
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission, MissionItem

ARDUPILOT, PX4 = Autopilot.ARDUPILOT, Autopilot.PX4
OF = {ARDUPILOT: load_vehicle("arducopter-sitl-quad"), PX4: load_vehicle("px4-sih-quad")}
TO_RALLY = {ARDUPILOT: "RALLY_INCL_HOME,0\nRALLY_LIMIT_KM,0\n", PX4: "RTL_TYPE,5\n"}
RETURN_ALTITUDE = {ARDUPILOT: "RTL_ALT,{:.0f}00\n", PX4: "RTL_RETURN_ALT,{}\n"}


def plateau(height_m: float = 60.0, *, from_m: float = 300.0) -> TerrainGrid:
    level = ground(0.0).tiles[0]
    north_m = np.arange(ROWS)[::-1, None] * CELL_M + SOUTH_M
    heights = np.where(north_m >= from_m, 400.0 + height_m, 400.0)
    return of_heights(np.repeat(heights, level.heights_amsl_m.shape[1], axis=1), level)


def findings(
    made: Mission, code: str, autopilot: Autopilot, parameters: str = "", **given: object
) -> list[Finding]:
    read = parameters_from_text(parameters.encode(), source="p.param") if parameters else None
    result = check(
        made,
        OF[autopilot],
        battery=Battery(capacity_wh=170.0),
        parameters=read,
        **given,  # type: ignore[arg-type]
    )
    return [finding for finding in result.findings if finding.code == code]


def rally(north_m: float, height_m: float) -> RallyPoint:
    return RallyPoint(
        latitude_deg=north(north_m), longitude_deg=HOME.longitude_deg, height_above_home_m=height_m
    )


def set_home(north_m: float, altitude_m: float, *, frame: int = 3) -> MissionItem:
    return item(179, north(north_m), altitude_m, frame=frame)


@pytest.mark.parametrize(
    ("autopilot", "altitude_m", "rally_m", "fires"),
    [
        # RTL_ALT counts from home: 66 m clears the plateau of 60 m by the 5 m of --clearance, 64 m not.
        (ARDUPILOT, 64, 5.0, True),
        (ARDUPILOT, 66, 5.0, False),
        # A rally point at 66 m above home is flown to at that height.
        (ARDUPILOT, 15, 64.0, True),
        (ARDUPILOT, 15, 66.0, False),
        # RTL_RETURN_ALT counts from the rally point: 6 m over one at 60 m, 35 m over one at 31 m.
        (PX4, 6, 60.0, False),
        (PX4, 4, 60.0, True),
        (PX4, 30, 31.0, True),
    ],
)
def test_a_return_to_a_rally_point_on_a_plateau_is_judged_at_the_height_it_is_flown(
    autopilot: Autopilot, altitude_m: int, rally_m: float, *, fires: bool
) -> None:
    up = replace(
        mission(takeoff(20), waypoint(150, 20), item(21, north(150), 0.0)),
        rally=(rally(500.0, rally_m),),
    )
    parameters = TO_RALLY[autopilot] + RETURN_ALTITUDE[autopilot].format(altitude_m)
    found = findings(up, "A104", autopilot, parameters, terrain=plateau())
    assert bool(found) == fires


@pytest.mark.parametrize(("altitude_m", "fires"), [(64, True), (66, False)])
def test_a_missions_own_return_to_a_plateau_is_flown_at_rtl_alt_above_home(
    altitude_m: int, *, fires: bool
) -> None:
    up = replace(mission(takeoff(20), waypoint(150, 20), rtl()), rally=(rally(500.0, 5.0),))
    parameters = TO_RALLY[ARDUPILOT] + RETURN_ALTITUDE[ARDUPILOT].format(altitude_m)
    assert bool(findings(up, "A102", ARDUPILOT, parameters, terrain=plateau())) == fires


@pytest.mark.parametrize(("autopilot", "frame"), [(ARDUPILOT, 0), (ARDUPILOT, 3), (PX4, 2)])
@pytest.mark.parametrize(("home_m", "fires"), [(19.0, True), (21.0, False)])
def test_returns_to_a_moved_home_count_from_the_altitude_its_item_gives(
    autopilot: Autopilot, home_m: float, frame: int, *, fires: bool
) -> None:
    """45 m above a home that is put 19 m above the first is 64 m: 4 m over the plateau."""
    altitude_m = home_m + (0.0 if frame == 3 else 400.0)  # PX4 takes it in frame 2 alone
    # Back down to 30 m above the moved home, a little above the first.
    flown = waypoint(150, 30.0 - home_m)
    moved = mission(takeoff(20), waypoint(150, 20), set_home(500, altitude_m, frame=frame), flown)
    up = replace(moved, items=(*moved.items, rtl()))
    parameters = RETURN_ALTITUDE[autopilot].format(45)
    assert bool(findings(up, "A102", autopilot, parameters, terrain=plateau())) == fires


def test_a_home_moved_on_its_own_place_is_landed_at_on_the_ground() -> None:
    for vehicle in OF.values():
        up = mission(takeoff(20), set_home(0, 10.0), waypoint(100, 20), rtl())
        result = check(up, vehicle, battery=Battery(capacity_wh=170.0))
        assert result.assessment is not None
        assert result.assessment.route.stages[-1].height_m == 0.0


@pytest.mark.parametrize(("level_m", "fires"), [(6.1, True), (6.7, False)])
def test_a_spline_that_sags_below_ground_taken_to_be_level_is_found(
    level_m: float, *, fires: bool
) -> None:
    """From 30 m above the level part: it sags by 7.4 m, to -1.3 m or -0.7 m (hand calculation in
    test_fence_of_moved_home); more than 1 m below home is below the ground."""
    heights = (level_m + 30.0, level_m, level_m, level_m + 30.0)
    splines = [item(82, north(100.0 * (n + 1)), h) for n, h in enumerate(heights)]
    made = mission(takeoff(30), *splines, item(21, None, 0.0))
    found = findings(made, "A102", ARDUPILOT)
    assert [finding.item for finding in found] == [4] * fires


def planned(home_m: float, *items: MissionItem) -> Mission:
    return mission(takeoff(30), *items, rtl(), home=replace(HOME, altitude_amsl_m=home_m))


def over_plateau(
    made: Mission,
    height_m: float,
    autopilot: Autopilot = ARDUPILOT,
    home_amsl_m: float | None = None,
) -> dict[str, list[Severity]]:
    """Return the severities of A102 and A115 over a plateau of a height from 100 m north on."""
    ground_there = plateau(height_m, from_m=100.0)
    return {
        code: [
            one.severity
            for one in findings(
                made, code, autopilot, terrain=ground_there, home_amsl_m=home_amsl_m
            )
        ]
        for code in ("A102", "A115")
    }


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize("home_m", [250.0, 392.0, 400.0, 408.0, 700.0])
@pytest.mark.parametrize(("plateau_m", "low"), [(24.0, False), (26.0, True)])
def test_heights_above_home_are_judged_from_the_ground_at_home(
    autopilot: Autopilot, home_m: float, plateau_m: float, *, low: bool
) -> None:
    """30 m above home, 5 m of --clearance: 25 m of ground at most, whatever the file says of home."""
    # PX4 flies over a place up to 0.8 m (NAV_MC_ALT_RAD) lower than told.
    found = over_plateau(planned(home_m, waypoint(200, 30)), plateau_m, autopilot)
    assert found["A102"] == [Severity.ERROR] * low
    assert found["A115"] == [Severity.WARNING] * (abs(home_m - 400.0) > 10.0)


@pytest.mark.parametrize(
    ("home_m", "severities"),
    [
        (415.9, [Severity.WARNING]),
        (416.1, [Severity.ERROR]),
        (383.9, [Severity.ERROR]),
        (409.9, []),
    ],
)
def test_altitudes_from_the_sea_need_a_home_that_the_grid_can_explain(
    home_m: float, severities: list[Severity]
) -> None:
    at_sea = item(16, north(200), home_m + 60.0, frame=0)
    assert over_plateau(planned(home_m, at_sea), 20.0)["A115"] == severities


@pytest.mark.parametrize(
    ("home_m", "altitude_m", "low"),
    [
        # By the grid 434 m are 34 m over its 400 m; 8 m less above a home that is measured at 408 m.
        (408.0, 432.0, True),
        (408.0, 434.0, False),
        # Above a home at 392 m they are more, but the plateau's 420 m are not lower for that.
        (392.0, 424.0, True),
        (392.0, 426.0, False),
    ],
)
def test_altitudes_from_the_sea_are_judged_above_the_grid_or_above_home_whichever_is_less(
    home_m: float, altitude_m: float, *, low: bool
) -> None:
    at_sea = item(16, north(200), altitude_m, frame=0)
    made = planned(home_m, waypoint(50, altitude_m - home_m), at_sea)
    back = replace(made, items=(*made.items[:-1], item(21, north(200), 0.0)))
    assert over_plateau(back, 20.0)["A102"] == [Severity.ERROR] * low


def test_a_ceiling_over_altitudes_from_the_sea_counts_from_the_home_of_the_file() -> None:
    """508 m are 100 m above the file's 408 m, 108 m above the grid's 400 m."""
    made = planned(408.0, item(16, north(200), 508.0, frame=0))
    for ceiling_m, fires in ((103, False), (99, True)):
        parameters = f"FENCE_ENABLE,1\nFENCE_TYPE,1\nFENCE_ALT_MAX,{ceiling_m}\n"
        found = findings(made, "F110", ARDUPILOT, parameters, terrain=plateau(0.0))
        assert bool(found) == fires


@pytest.mark.parametrize(
    ("given_m", "plateau_m", "low", "told"),
    [
        # A little above the grid it may be the grid that is wrong: heights count from its ground.
        (412.0, 24.0, False, False),
        (412.0, 26.0, True, False),
        # 20 m up on a roof, which is told: 45 m of ground at most.
        (420.0, 44.0, False, True),
        (420.0, 46.0, True, True),
    ],
)
def test_a_home_given_above_the_grid_is_a_roof_only_beyond_the_error_of_grids(
    given_m: float, plateau_m: float, *, low: bool, told: bool
) -> None:
    made = planned(given_m, waypoint(200, 30))
    found = over_plateau(made, plateau_m, home_amsl_m=given_m)
    assert found == {"A102": [Severity.ERROR] * low, "A115": [Severity.WARNING] * told}


@pytest.mark.parametrize(("height_m", "told"), [(-15.9, False), (-16.1, True), (16.1, True)])
def test_a_moved_home_off_the_ground_is_told(height_m: float, *, told: bool) -> None:
    up = planned(400.0, waypoint(150, 60), set_home(150, height_m), waypoint(160, 60 - height_m))
    found = findings(up, "A115", ARDUPILOT, terrain=plateau(0.0))
    assert [finding.item for finding in found] == [3] * told


@settings(max_examples=examples(8))
@given(
    home_m=st.integers(-300, 3000).filter(bool).map(float),
    height_m=st.integers(12, 60).map(float),
    plateau_m=st.integers(0, 50).map(float),
)
def test_no_number_for_home_changes_a_verdict_on_heights_above_home(
    home_m: float, height_m: float, plateau_m: float
) -> None:
    said, unsaid = (
        over_plateau(planned(amsl_m, waypoint(200, height_m)), plateau_m)["A102"]
        for amsl_m in (home_m, 0.0)
    )
    assert said == unsaid
