"""PX4's own returns to the mission's landing, by flights of PX4 1.17 with its defaults.

RTL_RETURN_ALT 30 m, MPC_XY_CRUISE 5 m/s; down at 1.5 m/s, from 10 to 5 m in 4.8 s, at 0.7 m/s: 25.2 s in
all, and 126 m.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from fenced_missions import rally
from made_missions import item, mission, north, rtl, takeoff, waypoint
from made_terrain import ground
from rule_cases.case import PLENTY, PX4, found, vehicle_of

from planner.findings import Severity
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.mission.items import Mission, MissionItem
    from planner.vehicle.model import VehicleModel

E, W = Severity.ERROR, Severity.WARNING


def land(metres_north: float) -> MissionItem:
    return item(21, north(metres_north), 0.0)


def told(
    one: Mission,
    parameters: str,
    about: str = "then sinks",
    battery: Battery = PLENTY,
    vehicle: VehicleModel | None = None,
) -> list[Severity]:
    flown = found(one, PX4, parameters, battery=battery, vehicle=vehicle, reserve=0.0)
    return [f.severity for f in flown if f.code == "T110" and about in f.message]


FAR = mission(takeoff(10), waypoint(450, 10), land(110))
"""Flown with RTL_TYPE 1, returning 336 m from the landing: on the ground 207 m short of it."""


@pytest.mark.parametrize(
    ("parameters", "severities"),
    [
        ("", []),
        ("RTL_TYPE,0\n", []),
        ("RTL_TYPE,1\n", [E]),
        ("RTL_TYPE,2\n", []),
        ("RTL_TYPE,3\n", [E]),
        ("RTL_TYPE,4\n", []),
        # No return climbs from 10 m.
        ("RTL_TYPE,1\nRTL_RETURN_ALT,5\n", []),
    ],
)
def test_a_return_that_climbs_sinks_on_its_way_to_a_far_landing(
    parameters: str, severities: list[Severity]
) -> None:
    assert told(FAR, parameters) == severities


def test_a_landing_nearer_than_home_counts_with_type_3() -> None:
    # Flown: 44 m short.
    assert told(mission(takeoff(10), waypoint(250, 10), land(60)), "RTL_TYPE,3\n") == [E]


@pytest.mark.parametrize("start", [(item(189),), ()])
def test_a_place_before_the_landing_is_flown_to_level(start: tuple[MissionItem, ...]) -> None:
    # Flown with DO_LAND_START and a waypoint: as predicted.  Without DO_LAND_START it is none of its part.
    one = mission(takeoff(10), waypoint(300, 10), *start, waypoint(140, 15), land(110))
    assert told(one, "RTL_TYPE,1\n") == ([] if start else [E])


@pytest.mark.parametrize(("north_m", "severity"), [(99.0, W), (101.0, E)])
def test_how_far_it_flies_while_it_sinks_decides(north_m: float, severity: Severity) -> None:
    one = mission(takeoff(10), waypoint(60, 10), land(north_m))
    assert told(one, "RTL_TYPE,1\n") == [severity]
    over_ground = found(one, PX4, "RTL_TYPE,1\n", terrain=ground(0.0))
    left_open = [f for f in over_ground if f.code == "X904" and "sinks on its way" in f.message]
    assert bool(left_open) is (severity is W)


@pytest.mark.parametrize(
    ("north_m", "ridge_m", "is_left_open"),
    [
        # 60 m at 5 m/s, or 0.8 of that, sink 18 to 22.5 m from 30 m at 1.5 m/s: 7.5 m above home.
        (60.0, 0.0, False),
        (60.0, 2.4, False),  # 5.1 m above the ground, of which --clearance asks 5 m
        (60.0, 2.6, True),
        (66.0, 0.0, False),
        (67.0, 0.0, True),  # 25.1 m sunk, 4.9 m above the ground
    ],
)
def test_a_return_that_sinks_is_judged_by_how_low_it_gets(
    north_m: float,
    ridge_m: float,
    is_left_open: bool,  # noqa: FBT001 - a table of cases
) -> None:
    one = mission(takeoff(20), waypoint(2, 20), land(north_m))
    flown = found(one, PX4, "RTL_TYPE,1\n", terrain=ground(ridge_m, at_m=30.0))
    left_open = [f for f in flown if f.code == "X904" and "sinks on its way" in f.message]
    assert bool(left_open) is is_left_open


@pytest.mark.parametrize(
    ("height_m", "north_m", "severity"),
    [
        # 2 m at 1.5 m/s, 4.8 s, 7.1 s: 66 m, of which 0.8 are 53 m.
        (12, 51.0, W),
        (12, 55.0, E),
        (5.5, 9.0, W),  # nearer than 10 m
    ],
)
def test_from_low_down_it_does_not_fly_as_far(
    height_m: float, north_m: float, severity: Severity
) -> None:
    one = mission(takeoff(5), waypoint(8, 5), land(north_m))
    speed_m_s = 1 if north_m < 10.0 else 5
    given = f"RTL_TYPE,1\nRTL_RETURN_ALT,{height_m}\nRTL_MIN_DIST,5\nMPC_XY_CRUISE,{speed_m_s}\n"
    assert told(one, given) == [severity]


@pytest.mark.parametrize(("height_m", "severities"), [(30.0, [E]), (32.0, [])])
def test_a_return_above_its_height_is_level(height_m: float, severities: list[Severity]) -> None:
    one = mission(takeoff(height_m), waypoint(450, height_m), land(110))
    assert told(one, "RTL_TYPE,1\n") == severities


def test_the_mission_s_own_return_sinks_so_too() -> None:
    assert told(mission(takeoff(10), waypoint(500, 10), rtl(), land(700)), "RTL_TYPE,1\n") == [E]


@pytest.mark.parametrize(
    ("landing_m", "settings", "height_m"),
    [
        (5.0, "", 10.0),  # flown: level at 9.8 m
        (9.0, "", 10.0),  # in the cone of 45 degrees over it: up to 9 m
        (11.0, "", 30.0),
        # Flown from within RTL_MIN_DIST in a cone of 80 degrees: all of RTL_RETURN_ALT.
        (70.0, "RTL_MIN_DIST,50\nRTL_CONE_ANG,80\n", 30.0),
    ],
)
def test_type_1_chooses_its_height_standing_at_home(
    landing_m: float, settings: str, height_m: float
) -> None:
    one = mission(takeoff(10), waypoint(60, 10), land(landing_m))
    given = parameters_from_text(f"RTL_TYPE,1\n{settings}".encode(), source="p.param")
    assessment = check(one, vehicle_of(PX4), autopilot=PX4, parameters=given).assessment
    assert assessment is not None
    returns = assessment.returns
    segment = np.flatnonzero(returns.segment_stage == 1)[-1:]
    [corners] = returns.corners_m(returns.points(segment, np.ones(1)))
    assert corners[2, 2] == pytest.approx(height_m, abs=0.1)


LOW = mission(takeoff(10), waypoint(60, 10), land(60))
"""With RTL_TYPE 3 the height is chosen half way there, 30 m; at the landing 10 m are predicted."""


@pytest.mark.parametrize(("capacity_wh", "severity"), [(13.0, W), (12.0, E)])
def test_a_height_chosen_in_flight_is_told(capacity_wh: float, severity: Severity) -> None:
    model, just = load_vehicle("px4-quad-2kg"), Battery(capacity_wh=capacity_wh)
    given = parameters_from_text(b"RTL_TYPE,3\n", source="p.param")
    flown = check(LOW, model, autopilot=PX4, battery=just, reserve=0.0, parameters=given).assessment
    assert flown is not None
    # 20 m up at 3 m/s, with twice the power of a hover at most, and down at 1.5 m/s.
    climb_wh = flown.flight.hover_near_home_w * (2.0 * 20.0 / 3.0 + 20.0 / 1.5) / 3600.0
    assert (flown.left_wh < climb_wh) is (severity is E)
    assert told(LOW, "RTL_TYPE,3\n", "chose the height", just, model) == [severity]


@pytest.mark.parametrize(("high_m", "severities"), [(32.0, []), (60.0, [W])])
def test_a_height_chosen_from_above_stays(high_m: float, severities: list[Severity]) -> None:
    """``computeReturnAltitude``: no lower than the vehicle is where the landing becomes the nearest."""
    down = [waypoint(100, high_m), waypoint(110, 10)]
    one = mission(takeoff(high_m), *down, item(189), waypoint(150, 20), land(160))
    assert told(one, "RTL_TYPE,3\n", "flown at 60 m") == severities


@pytest.mark.parametrize(("rally_m", "is_open"), [(20.0, True), (-500.0, False)])
def test_a_height_chosen_in_the_cone_leaves_the_ground_unchecked(
    rally_m: float, *, is_open: bool
) -> None:
    """The landing becomes nearest 20 m away, in the cone, or at home, out of it."""
    one = mission(takeoff(10), waypoint(100, 10), land(60))
    rallied = replace(one, rally=(rally(0.0, rally_m),))
    given = "RTL_TYPE,1\nRTL_MIN_DIST,24\n"
    over_ground = found(rallied, PX4, given, terrain=ground(0.0))
    said = [f for f in over_ground if f.code == "X904" and "lower than predicted" in f.message]
    assert bool(said) is is_open
