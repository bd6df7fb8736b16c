"""Regions of interest and needed headings, by flights of PX4 1.17 that turn at 60°/s and 20°/s²."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PX4, found

from planner.findings import Severity
from planner.mission.route.route import make_route
from planner.mission.route.state import VehicleHabits
from planner.service.preflight import check
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

AHEAD = item(195, north(60), 0.0)
"""Behind a vehicle that flies south."""
EAST = item(195, north(-30), 0.0, longitude_deg=8.001)
NONE = item(197, frame=2)
HALF_TURN_S = 6.0 - math.sqrt(1.2)
"""180° in 6 s, of which the last 12° are not asked for."""


def loiter(metres_north: float, needs: float = 0.0, yaw: float | None = None) -> MissionItem:
    return item(19, north(metres_north), 15.0, params=(0.0, needs, 0.0, yaw))


def to_height(height_m: float) -> MissionItem:
    return item(31, north(-30), height_m, params=(1.0, 0.0, 0.0, None))


def headings(*items: MissionItem, **more: object) -> list[float | None]:
    route = make_route(mission(takeoff(15), *items), **{"dialect": PX4, **more})  # type: ignore[arg-type]
    return [None if one.yaw_deg is None else round(one.yaw_deg) % 360 for one in route.stages]


def test_px4_looks_at_a_region_of_interest_from_where_it_leads() -> None:
    south, further = waypoint(-30, 15), waypoint(-60, 15)
    assert headings(south, AHEAD, further, NONE, south) == [None, None, 0, None]
    assert headings(EAST, south) == [None, 90]
    assert headings(south, AHEAD, further, dialect=ARDUPILOT) == [None, None, None]


def test_a_stage_knows_where_the_region_of_interest_is() -> None:
    route = make_route(
        mission(takeoff(15), EAST, waypoint(-30, 15), NONE, waypoint(-60, 15)), dialect=PX4
    )
    off_m = [one.looks_m for one in route.stages]
    assert off_m[::2] == [None, None]
    # 0.001° of longitude at 47°, where 1° is 76.06 km.
    assert off_m[1] == pytest.approx((76.06, 0.0), abs=0.3)


def test_px4_takes_the_place_of_one_command_alone() -> None:
    """Flown: DO_SET_ROI with a place looks at 0°, 0°, from 8° east to the south and a little west."""
    region = item(201, north(60), 0.0, params=(3.0, 0.0, 0.0, 0.0))
    assert headings(region, waypoint(-30, 15)) == [None, 191]
    off = item(201, north(60), 0.0, params=(0.0, 0.0, 0.0, 0.0))
    assert headings(AHEAD, off, waypoint(-30, 15)) == [None, None]


@pytest.mark.parametrize(("radius_m", "heading"), [(9.9, 0), (10.1, None)])
def test_a_region_within_the_acceptance_radius_asks_for_no_heading(
    radius_m: float, heading: float | None
) -> None:
    habits = VehicleHabits(looks_from_m=radius_m)
    assert headings(AHEAD, waypoint(50, 15), habits=habits) == [None, heading]


@pytest.mark.parametrize(
    ("items", "timeout", "is_given_up"),
    [
        ((AHEAD, loiter(-30, 1)), -1.0, False),
        ((AHEAD, loiter(-30, 1)), 2.0, True),
        ((AHEAD, loiter(-30, 1)), 4.0, True),  # half a turn in 4.7 s
        ((AHEAD, loiter(-30, 1)), 5.0, False),
        ((AHEAD, loiter(-30, 0)), 2.0, False),
        ((EAST, loiter(-30, 1)), 2.9, True),  # a quarter in 3 s: PX4 waits whole seconds
        ((EAST, loiter(-30, 1)), 4.0, False),
        ((loiter(-30, 1, yaw=0.0),), 2.0, True),  # its own
        ((AHEAD, loiter(-40, 1)), 2.0, False),  # 10 m on the way, in which it turns
        ((AHEAD, to_height(10.0)), 3.0, False),  # as it descends 5 m
        ((AHEAD, to_height(15.0)), 3.0, True),
    ],
)
def test_px4_gives_the_mission_up_where_a_heading_is_not_reached_in_time(
    items: tuple[MissionItem, ...], timeout: float, *, is_given_up: bool
) -> None:
    one = mission(takeoff(15), waypoint(-30, 15), *items, item(21, north(-30), 0.0))
    said = [f for f in found(one, PX4, f"MIS_YAW_TMT,{timeout}\n") if f.code == "T110"]
    assert [f.severity for f in said] == [Severity.ERROR] * is_given_up


@pytest.mark.parametrize(
    ("parameters", "is_given_up"),
    [
        (
            "MIS_YAW_TMT,2\nMPC_YAWRAUTO_ACC,10\n",
            True,
        ),  # flown: "Mission cannot be completed" at 37 s
        ("MIS_YAW_TMT,5\nMPC_YAWRAUTO_ACC,10\n", False),  # flown to its end
        ("MIS_YAW_TMT,2\nMPC_YAWRAUTO_ACC,20\n", False),  # flown to its end
    ],
)
def test_a_region_passed_close_swings_behind_at_the_end(
    parameters: str, *, is_given_up: bool
) -> None:
    def east(metres: float) -> float:
        return 8.0 + metres / 76060.0

    beside = item(195, north(62), 0.0, longitude_deg=east(-5))
    needs = item(19, north(75), 20.0, params=(0.0, 1.0, 0.0, None), longitude_deg=east(-8))
    one = mission(takeoff(20), waypoint(30, 20), beside, needs, NONE, waypoint(90, 20))
    said = [f for f in found(one, PX4, parameters) if f.code == "T110"]
    assert [f.severity for f in said] == [Severity.ERROR] * is_given_up


@pytest.mark.parametrize(
    ("then", "longer_s"),
    [
        ((loiter(-30),), HALF_TURN_S),  # flown 4.6 s
        # 4 m, from rest to rest within 2 m, in which it turns: flown 3.0 s.
        ((waypoint(-34, 15), waypoint(-38, 15)), 3.1),
        ((waypoint(-60, 15),), 0.0),
    ],
)
def test_a_region_of_interest_is_turned_to_before_the_flight_goes_on(
    then: tuple[MissionItem, ...], longer_s: float
) -> None:
    def takes_s(*items: MissionItem) -> float:
        end = item(21, then[-1].latitude_deg, 0.0)
        result = check(
            mission(takeoff(15), waypoint(-30, 15), *items, *then, end),
            load_vehicle("px4-sih-quad"),
            autopilot=PX4,
            battery=Battery(capacity_wh=100.0),
            parameters=parameters_from_text(b"MIS_YAW_TMT,-1\n", source="p.param"),
        )
        assert result.totals is not None
        return result.totals.time_s

    assert takes_s(AHEAD) - takes_s() == pytest.approx(longer_s, abs=0.3)
