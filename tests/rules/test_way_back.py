"""The speed of PX4's ways back along the mission, RTL_TYPE 2 and 4, by flights of PX4 1.17."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, speed, takeoff, waypoint
from rule_cases.case import PX4, found

from planner.findings import Severity
from planner.service.preflight import check
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

E, W = Severity.ERROR, Severity.WARNING
CAMERA = item(206, frame=2)


@pytest.mark.parametrize(
    ("items", "severities"),
    [
        # Flown home at 1 m/s, predicted at 10 m/s.
        ((waypoint(30, 20), speed(1), waypoint(60, 20), speed(10), waypoint(300, 20)), [E]),
        # Flown home at 10 m/s, predicted at 2 m/s.
        ((waypoint(60, 20), speed(10), waypoint(100, 20), speed(2), waypoint(120, 20)), [E]),
        # The speed is commanded two items before the last place.
        ((speed(10), CAMERA, waypoint(200, 20)), [W]),
        ((speed(10), waypoint(200, 20)), [E]),
        ((speed(5), waypoint(200, 20)), []),  # MPC_XY_CRUISE
        ((waypoint(100, 20), waypoint(200, 20)), []),
    ],
)
def test_a_mission_s_own_way_back_is_at_a_speed_that_is_known(
    items: tuple[MissionItem, ...], severities: list[Severity]
) -> None:
    one = mission(takeoff(20), *items, rtl())
    for kind, expected in ((0, []), (2, severities), (4, severities)):
        flown = found(one, PX4, f"RTL_TYPE,{kind}\n")
        assert [f.severity for f in flown if f.code == "T110"] == expected


def test_a_speed_for_the_whole_mission_is_that_of_the_way_back() -> None:
    one = mission(speed(10), takeoff(20), waypoint(200, 20), rtl())
    assert not [f for f in found(one, PX4, "RTL_TYPE,2\n") if f.code == "T110"]


def test_a_way_on_to_the_landing_is_at_the_speed_commanded() -> None:
    one = mission(takeoff(20), speed(10), waypoint(200, 20), item(21, north(300), 0.0))
    assert not [f for f in found(one, PX4, "RTL_TYPE,2\n") if f.code == "T110"]


@pytest.mark.parametrize(("capacity_wh", "severity"), [(96.0, W), (92.0, E)])
def test_a_return_from_the_way_is_no_go_where_the_margin_does_not_hold_the_slower_way(
    capacity_wh: float, severity: Severity
) -> None:
    slow = (waypoint(500, 20), speed(1), waypoint(510, 20), speed(10), waypoint(500, 20))
    one = mission(takeoff(20), *slow, waypoint(400, 20), rtl())
    given = parameters_from_text(b"RTL_TYPE,2\n", source="p.param")
    result = check(
        one,
        load_vehicle("px4-quad-2kg"),
        autopilot=PX4,
        battery=Battery(capacity_wh=capacity_wh),
        reserve=0.0,
        parameters=given,
    )
    assert [f.severity for f in result.findings if f.code == "T110"] == [severity]
    flown = result.assessment
    assert flown is not None
    # 525 m at 1 m/s where 10 m/s are predicted: it turns back 15 m past 510 m.
    later_wh = flown.flight.hover_near_home_w * 525.0 * (1.0 - 0.1) / 3600.0
    assert (flown.left_wh < later_wh) is (severity is E)
