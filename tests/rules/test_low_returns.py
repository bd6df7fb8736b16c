"""Returns from landings away from home, from climbs behind them, and from where a load is set down.

Flown by a build of ArduCopter: RTL commanded 14 m up in the mission's LAND, 250 m from home and with RTL_ALT
3000, climbs to 30.0 m and flies home at that, whatever is in between.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint
from made_terrain import CELL_M, ROWS, SOUTH_M, ground, of_heights

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.fence import RallyPoint
from planner.rules.terrain_returns import RETURN_BELOW_TERRAIN
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission
    from planner.vehicle.model import VehicleModel

OF = {
    Autopilot.STEP: load_vehicle("falkowski-2023-quadrotor"),
    Autopilot.PX4: load_vehicle("px4-sih-quad"),
    Autopilot.ARDUPILOT: load_vehicle("arducopter-sitl-quad"),
}
LAND = item(21, north(480), 0.0)
DELIVERY = mission(takeoff(90), waypoint(480, 90), LAND)
AGAIN = mission(*DELIVERY.items, item(22, north(480), 90.0), waypoint(0, 90), item(21, north(0)))
SET_DOWN = mission(
    takeoff(90), waypoint(480, 90), item(94, north(480), 90.0), waypoint(0, 90), item(21, north(0))
)
"""Everything 90 m up, and home at that, but where it lands or sets a load down behind the ridge."""


def told(
    one: Mission,
    terrain: TerrainGrid,
    model: VehicleModel,
    parameters: str,
    clearance_m: float = 5.0,
) -> list[Finding]:
    """Return what is found of the ground under returns: too low, or not known."""
    given = parameters_from_text(parameters.encode(), source="p.param") if parameters else None
    found = check(
        one,
        model,
        battery=Battery(capacity_wh=500.0),
        terrain=terrain,
        clearance_m=clearance_m,
        parameters=given,
    ).findings
    own = RETURN_BELOW_TERRAIN.code
    return [one for one in found if own in {one.code, one.about}]


@pytest.mark.parametrize(("return_m", "is_low"), [(60, False), (59, True), (30, True)])
@pytest.mark.parametrize(
    ("one", "autopilot", "parameters"),
    [
        (DELIVERY, Autopilot.ARDUPILOT, "RTL_ALT,{return_m}00\n"),
        (DELIVERY, Autopilot.PX4, "RTL_RETURN_ALT,{return_m}\n"),
        (DELIVERY, Autopilot.STEP, "RTL_ALT,{return_m}00\n"),
        (AGAIN, Autopilot.ARDUPILOT, "RTL_ALT,{return_m}00\nMIS_OPTIONS,4\n"),
        (SET_DOWN, Autopilot.ARDUPILOT, "RTL_ALT,{return_m}00\n"),
    ],
)
def test_a_return_from_behind_a_ridge_flies_home_at_its_own_height(
    one: Mission, autopilot: Autopilot, parameters: str, return_m: int, *, is_low: bool
) -> None:
    """The ridge is 55 m high: 5 m below 60."""
    given = parameters.format(return_m=return_m)
    found = told(one, ground(55.0), OF[autopilot], given)
    assert [(one.severity, one.item) for one in found] == [(Severity.ERROR, 3)] * is_low
    for low in found:
        over_m = return_m - 55
        where = f"{over_m}.0 m above" if over_m > 0 else f"{-over_m} m below"
        assert (
            f"a return from here, begun 5.0 m above home, {return_m} m above home, is {where}"
            in (low.message)
        )


def plateau(bump_m: float) -> TerrainGrid:
    """Return ground that is 40 m higher from 300 m north on, and 400 m north a wall of some metres more."""
    level = ground(bump_m, at_m=400.0)
    heights = np.array(level.tiles[0].heights_amsl_m, np.float64)
    rows = np.arange(ROWS)[::-1, None] * CELL_M + SOUTH_M
    return of_heights(heights + np.where(rows >= 300.0, 40.0, 0.0), level.tiles[0])


@pytest.mark.parametrize(
    ("bump_m", "low"),
    [
        (1.9, None),
        (2.1, "begun 42 m above home, 42 m above home, is 0.1 m below the ground"),
        (4.9, "begun 42 m above home, 42 m above home, is 2.9 m below the ground"),
        (5.1, "begun 50 m above home, 50 m above home, is 4.9 m above the ground"),
    ],
)
@pytest.mark.parametrize(
    ("autopilot", "parameters"),
    [(Autopilot.ARDUPILOT, "RTL_ALT,1500\n"), (Autopilot.PX4, "RTL_RETURN_ALT,30\n")],
)
def test_what_rises_over_a_landing_above_the_return_height_is_in_the_way_from_2_m_on(
    autopilot: Autopilot, parameters: str, bump_m: float, low: str | None
) -> None:
    """Higher than the return height it flies home at the height it has.

    Flown by a build of ArduCopter, RTL at 2.98 m in the LAND and RTL_ALT 200: 2.9 m all the way home.
    """
    found = told(DELIVERY, plateau(bump_m), OF[autopilot], parameters)
    assert [one.severity for one in found] == [Severity.ERROR] * (low is not None)
    assert all((low or "") in one.message for one in found)


@pytest.mark.parametrize("clearance_m", [0.0, 0.3, 1.0, 5.0])
def test_no_smaller_clearance_asks_for_more(clearance_m: float) -> None:
    level = plateau(0.5)
    assert told(DELIVERY, level, OF[Autopilot.ARDUPILOT], "RTL_ALT,1500\n", clearance_m) == []


@pytest.mark.parametrize(("return_m", "is_low"), [(44, True), (45, False)])
def test_a_return_that_climbs_within_the_clearance_misses_the_ground(
    return_m: int, *, is_low: bool
) -> None:
    """The wall ends 44.5 m above home, and 4.5 m above where it lands."""
    found = told(DELIVERY, plateau(4.5), OF[Autopilot.ARDUPILOT], f"RTL_ALT,{return_m}00\n")
    assert [one.severity for one in found] == [Severity.ERROR] * is_low
    for low in found:
        assert "begun 42 m above home, 44 m above home, is 0.5 m below the ground" in low.message


@pytest.mark.parametrize(("return_m", "is_low"), [(49, True), (50, False)])
def test_a_return_that_climbs_a_little_above_a_landing_is_judged_at_that(
    return_m: int, *, is_low: bool
) -> None:
    """The wall ends 45 m above home: it is in the way of 49 m, no lower than 9 m above the landing."""
    found = told(DELIVERY, plateau(5.0), OF[Autopilot.ARDUPILOT], f"RTL_ALT,{return_m}00\n")
    assert [one.severity for one in found] == [Severity.ERROR] * is_low


BY_RALLY = "RALLY_INCL_HOME,0\nRALLY_LIMIT_KM,1\n"


@pytest.mark.parametrize(
    ("autopilot", "given", "is_low"),
    [
        (Autopilot.ARDUPILOT, f"RTL_ALT,6000\n{BY_RALLY}", False),
        (Autopilot.ARDUPILOT, f"RTL_ALT,5900\n{BY_RALLY}", True),
        (Autopilot.STEP, f"RTL_ALT,6000\n{BY_RALLY}", False),
        (Autopilot.STEP, f"RTL_ALT,5900\n{BY_RALLY}", True),
        # above the rally point, which is 20 m above home
        (Autopilot.PX4, "RTL_RETURN_ALT,40\nRTL_TYPE,5\n", False),
        (Autopilot.PX4, "RTL_RETURN_ALT,39\nRTL_TYPE,5\n", True),
    ],
)
def test_a_return_from_a_take_off_to_a_rally_point_counts(
    autopilot: Autopilot, given: str, *, is_low: bool
) -> None:
    """It goes up and down alone; the rally point is behind the ridge."""
    rally = RallyPoint(latitude_deg=north(480), longitude_deg=8.0, height_above_home_m=20.0)
    hop = replace(mission(takeoff(90), item(21, north(0))), rally=(rally,))
    found = told(hop, ground(55.0), OF[autopilot], given)
    assert [one.severity for one in found] == [Severity.ERROR] * is_low


@pytest.mark.parametrize(
    ("ridge_m", "opens"), [(9.9, False), (10.1, True), (60.0, True), (0.0, False)]
)
@pytest.mark.parametrize("model", ["falkowski-2023-quadrotor", "dji-matrice-300-rtk"])
def test_where_no_height_of_returns_is_known_none_behind_a_ridge_is_green(
    model: str, ridge_m: float, *, opens: bool
) -> None:
    """No lower than 15 m, which ArduPilot is delivered with: 4.9 m above the ridge."""
    found = told(DELIVERY, ground(ridge_m), load_vehicle(model), "")
    assert [(one.code, one.severity) for one in found] == [("X904", Severity.ERROR)] * opens


def test_a_height_of_returns_that_the_file_states_counts() -> None:
    stated = replace(DELIVERY, return_height_m=60.0)
    for high_m, is_low in ((55.0, False), (56.0, True)):
        codes = [one.code for one in told(stated, ground(high_m), OF[Autopilot.STEP], "")]
        assert ("A104" in codes) is is_low


@pytest.mark.parametrize("one", [DELIVERY, SET_DOWN])
@pytest.mark.parametrize(("ridge_m", "is_low"), [(9.0, False), (11.0, True)])
def test_what_stands_between_posts_is_in_the_way_of_returns_from_the_ground(
    one: Mission, ridge_m: float, *, is_low: bool
) -> None:
    """By posts 100 m apart the ridge may not be known: from 90 m up it is passed, at RTL_ALT it is not."""
    given = "RTL_ALT,1500\nRTL_ALT_TYPE,1\nTERRAIN_ENABLE,1\n"
    found = told(one, ground(ridge_m), OF[Autopilot.ARDUPILOT], given)
    assert [one.severity for one in found] == [Severity.ERROR] * is_low
    for low in found:
        assert "by posts 100 m apart" in low.message


def test_what_lands_at_home_or_is_a_return_itself_has_no_way_home() -> None:
    """A wall of 8 m stands 30 m from home; everything else is level."""
    for last in (item(21, north(0)), rtl()):
        one = mission(takeoff(30), waypoint(200, 30), last)
        for autopilot, parameters in (
            (Autopilot.ARDUPILOT, "RTL_ALT,0\n"),
            (Autopilot.PX4, "RTL_RETURN_ALT,30\n"),
            (Autopilot.STEP, ""),
        ):
            assert told(one, ground(8.0, at_m=30.0), OF[autopilot], parameters) == []
