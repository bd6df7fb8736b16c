"""Returns along the mission and to its landing: RTL_TYPE 1 to 5 of PX4, and a mission's own return.

Expected figures are of PX4's defaults: 5 m/s, RTL_RETURN_ALT 30 m; the rules are those of the 1.16
sources (``RTL::setRtlTypeAndDestination``, ``RtlMissionFast``, ``RtlMissionFastReverse``,
``RtlDirectMissionLand``, ``RtlDirect``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import HOME, item, jump, mission, north, rtl, speed, takeoff, waypoint

import planner
from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.flight.returns.destination import ALONG, HERE, LANDING
from planner.flight.returns.path import return_profile
from planner.flight.returns.tightest import sweep_returns
from planner.geo.fence import RallyPoint
from planner.values import replace
from planner.vehicle.parameters.files import ParameterSet, ParameterValue

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.mission.items import Mission, MissionItem
    from planner.rules.assessment import Assessment
    from planner.service.preflight import CheckResult

VEHICLE = replace(planner.load_vehicle("arducopter-sitl-quad"), battery=None)
METRES_PER_DEGREE_EAST = 76_057.0
"""Length of a degree of longitude at 47° north: N cos 47° π/180, N = 6 389 700 m."""
BATTERY = planner.Battery(capacity_wh=1000.0)


def at(east_m: float, north_m: float, height_m: float, *, hold_s: float = 0.0) -> MissionItem:
    east_deg = HOME.longitude_deg + east_m / METRES_PER_DEGREE_EAST
    params = (hold_s, 0.0, 0.0, None)
    return item(16, north(north_m), height_m, params=params, longitude_deg=east_deg)


def land(metres_north: float, altitude_m: float = 0.0) -> MissionItem:
    return item(21, north(metres_north), altitude_m)


def checked(flown: Mission, autopilot: Autopilot = Autopilot.PX4, **values: float) -> CheckResult:
    given = ParameterSet(
        source="made.params",
        values={name: ParameterValue(value) for name, value in values.items()},
        stack=autopilot,
    )
    return planner.check(
        flown, VEHICLE, autopilot=autopilot, battery=BATTERY, reserve=0.0, parameters=given
    )


def case_of(flown: Mission, autopilot: Autopilot = Autopilot.PX4, **values: float) -> Assessment:
    assessment = checked(flown, autopilot, **values).assessment
    assert assessment is not None
    return assessment


def chosen(assessment: Assessment, place: tuple[float, float, float], stage: int) -> int:
    return int(assessment.returns.destinations.chosen(np.array([place]), np.array([stage]))[0])


def way_s(assessment: Assessment, place: tuple[float, float, float], stage: int) -> float:
    stages = np.array([stage])
    places = np.array([place])
    destination = assessment.returns.destinations.chosen(places, stages)
    return float(assessment.returns.fly(places, stages, destination)[0][0])


def flown_for(assessment: Assessment, item_number: int) -> FloatArray:
    """Return east and north of what is flown for an item, every half second. (n, 2) [m]"""
    motion = assessment.flight.motion
    own = motion.segments.item == item_number
    end_s = motion.segments.end_s[own]
    begin_s = float(end_s[0] - motion.segments.duration_s[own][0])
    state = motion.state_at_time(np.arange(begin_s, float(end_s[-1]), 0.5))
    return np.column_stack((state.east_m, state.north_m))


ROUND_THE_CORNER = mission(takeoff(40), waypoint(500, 40), at(500, 500, 40), rtl())
"""500 m north, 500 m east; straight home 707 m."""
ON_TO_LAND = mission(
    takeoff(40), waypoint(500, 40), waypoint(1000, 40, hold_s=60), waypoint(1500, 40), land(2000)
)


def test_a_mission_s_own_return_leads_back_along_it() -> None:
    straight, along = (case_of(ROUND_THE_CORNER, RTL_TYPE=kind) for kind in (0, 2))
    to_corner_m = np.hypot(*(flown_for(along, 4) - (0.0, 500.0)).T)
    assert to_corner_m.min() < 3.0  # NAV_ACC_RAD is 2 m
    assert np.hypot(*(flown_for(straight, 4) - (0.0, 500.0)).T).min() > 300.0
    lengths_m = [
        assessment.flight.motion.segments.distance_m[
            assessment.flight.motion.segments.item == 4
        ].sum()
        for assessment in (straight, along)
    ]
    assert lengths_m == pytest.approx([707.1, 1000.0], abs=8.0)
    # 293 m more at 5 m/s and a right angle of 2.5 s, at 307 W.
    more_wh = along.totals.energy_wh - straight.totals.energy_wh
    assert more_wh == pytest.approx((293.0 / 5.0 + 2.5) * 307.0 / 3600.0, rel=0.1)


def test_without_a_landing_a_return_leads_back_from_wherever_it_begins() -> None:
    assessment = case_of(ROUND_THE_CORNER, RTL_TYPE=2)
    places = ((250.0, 500.0, 40.0), (500.0, 500.0, 40.0))
    assert {chosen(assessment, place, 2) for place in places} == {ALONG}
    near_s, far_s = (way_s(assessment, place, 2) for place in places)
    assert far_s - near_s == pytest.approx(250.0 / 5.0, abs=0.5)
    # 750 m at 5 m/s; start and stop cost 2.3 s, a right angle 2.5 s; 30 m down at 1.5 m/s, 13 s from
    # 10 m, 6 s to disarmed.
    assert near_s == pytest.approx(150.0 + 4.8 + 39.0, abs=3.0)


def test_the_tightest_way_back_along_a_mission_is_from_its_far_end() -> None:
    found = checked(ROUND_THE_CORNER, RTL_TYPE=2).return_plan
    assert found is not None
    assert (found.tightest_item, found.destination) == (3, ALONG)
    assert found.tightest is not None
    assert found.tightest.along_m == pytest.approx(500.0, abs=5.0)


def test_with_a_landing_a_return_leads_on_without_the_holds() -> None:
    assessment = case_of(ON_TO_LAND, RTL_TYPE=2)
    start = (0.0, 500.0, 40.0)
    assert chosen(assessment, start, 2) == ALONG
    # Flown from standing at item 2 to the end, without the 60 s of item 3.
    stops = mission(
        takeoff(40),
        waypoint(500, 40, hold_s=10),
        waypoint(1000, 40),
        waypoint(1500, 40),
        land(2000),
    )
    whole = case_of(stops)
    held = np.flatnonzero(whole.flight.motion.segments.item == 2)[-1]
    rest_s = whole.flight.time_s - float(whole.flight.motion.segments.end_s[held])
    # A return disarms 2 s later than a landing of the mission.
    assert way_s(assessment, start, 2) == pytest.approx(rest_s, abs=2.5)


def test_the_speed_last_commanded_is_that_of_the_way_along() -> None:
    fast = mission(takeoff(40), speed(10.0), waypoint(1000, 40), rtl())
    slow = mission(takeoff(40), waypoint(1000, 40), rtl())
    at_end = (0.0, 1000.0, 40.0)
    slow_s, fast_s = (
        way_s(case_of(one, RTL_TYPE=2), at_end, stage) for one, stage in ((slow, 1), (fast, 1))
    )
    # 1000 m at 5 and at 10 m/s; start and stop cost 2.3 s, and about 5 s.
    assert slow_s - fast_s == pytest.approx(200.0 - 100.0 - 2.7, abs=1.0)
    # Straight home the vehicle's own speed counts.
    assert way_s(case_of(fast), at_end, 1) == pytest.approx(way_s(case_of(slow), at_end, 1))


@pytest.mark.parametrize(("stage", "ends_north_m"), [(1, 0.0), (2, 0.0), (3, 2000.0)])
def test_type_4_takes_the_way_of_fewer_items(stage: int, ends_north_m: float) -> None:
    # The landing is item 4 counted from 0: 4 − 2 is not less than 2, 4 − 3 is less than 3.
    assessment = case_of(ON_TO_LAND, RTL_TYPE=4)
    points = np.array([[0.0, 700.0, 40.0]])
    targets = assessment.returns.destinations.targets(np.array([stage]), ALONG, points)
    assert targets.ground_m[0, 1] == pytest.approx(ends_north_m, abs=1.0)


def test_type_1_never_leads_home_where_there_is_a_landing_or_a_rally_point() -> None:
    assessment = case_of(ON_TO_LAND, RTL_TYPE=1)
    assert chosen(assessment, (0.0, 50.0, 40.0), 1) == LANDING
    rally = RallyPoint(
        latitude_deg=north(-900.0), longitude_deg=HOME.longitude_deg, height_above_home_m=0.0
    )
    with_rally = case_of(replace(ON_TO_LAND, rally=(rally,)), RTL_TYPE=1)
    # 950 m to the rally point against 1950 m to the landing.
    assert chosen(with_rally, (0.0, 50.0, 40.0), 1) == 1
    assert chosen(with_rally, (0.0, 600.0, 40.0), 1) == LANDING
    neither = mission(takeoff(40), waypoint(500, 40), rtl())
    assert chosen(case_of(neither, RTL_TYPE=1), (0.0, 500.0, 40.0), 1) == 0


@pytest.mark.parametrize(("north_m", "leads"), [(998.9, 0), (1001.1, LANDING)])
def test_type_3_takes_what_is_nearer_by_two_metres(north_m: float, leads: int) -> None:
    assessment = case_of(ON_TO_LAND, RTL_TYPE=3)
    assert chosen(assessment, (0.0, north_m, 40.0), 2) == leads


def test_a_return_to_the_landing_climbs_over_its_altitude_and_follows_its_approach() -> None:
    start = item(189)
    flown = mission(
        takeoff(10), waypoint(500, 10), start, at(300, 1000, 20), land(1000, 12.0), rtl()
    )
    assessment = case_of(flown, RTL_TYPE=1)
    segment = np.flatnonzero(assessment.returns.segment_stage == 1)
    [corners] = assessment.returns.corners_m(
        assessment.returns.points(segment[-1:], np.array([1.0]))
    )
    # RTL_RETURN_ALT of 30 m over the 12 m of the landing item, then its approach at 20 m.
    assert corners[2:, 2].tolist() == pytest.approx([42.0, 20.0, 20.0, 0.0])
    assert corners[3, :2].tolist() == pytest.approx([300.0, 1000.0], abs=1.0)
    assert corners[-1, :2].tolist() == pytest.approx([0.0, 1000.0], abs=1.0)


def test_type_5_without_a_rally_point_lands_where_it_is_and_says_so() -> None:
    flown = mission(takeoff(40), waypoint(500, 40), rtl())
    result = checked(flown, RTL_TYPE=5)
    assert [f.severity for f in result.findings if f.code == "T113"] == [Severity.ERROR]
    assert result.assessment is not None
    assert chosen(result.assessment, (0.0, 500.0, 40.0), 1) == HERE
    # 30 m at 1.5 m/s, 13 s from 10 m, 6 s to disarmed; 4.9 s for the heading of home before.
    assert way_s(result.assessment, (0.0, 500.0, 40.0), 1) == pytest.approx(43.9, abs=4.0)
    assert flown_for(result.assessment, 3)[-1, 1] == pytest.approx(500.0, abs=1.0)


@pytest.mark.parametrize("kind", [2, 4])
def test_a_way_along_items_that_jump_is_no_go(kind: int) -> None:
    flown = mission(takeoff(40), waypoint(500, 40), waypoint(600, 40), jump(2, 1), rtl())
    result = checked(flown, RTL_TYPE=kind)
    said = [(f.severity, f.item) for f in result.findings if f.code == "T110"]
    assert said == [(Severity.ERROR, 5)]
    assert result.verdict == "no-go"
    assert not [f for f in checked(flown, RTL_TYPE=3).findings if f.code == "T110"]


def test_a_jump_of_no_repetition_is_none() -> None:
    """``MissionBase::getNonJumpItem`` passes it over: a count of 0 is reached."""
    flown = mission(takeoff(40), waypoint(500, 40), waypoint(600, 40), jump(2, 0), rtl())
    assert not [f for f in checked(flown, RTL_TYPE=4).findings if f.code == "T110"]


def test_a_mission_s_own_return_leads_to_the_rally_point_the_vehicle_takes() -> None:
    rally = RallyPoint(
        latitude_deg=north(-600.0), longitude_deg=HOME.longitude_deg, height_above_home_m=0.0
    )
    flown = replace(mission(takeoff(40), waypoint(100, 40), rtl()), rally=(rally,))
    # Home is nearer; told to leave it out, ArduPilot flies past it.
    past = case_of(flown, Autopilot.ARDUPILOT, RALLY_INCL_HOME=0, RALLY_LIMIT_KM=0)
    home = case_of(flown, Autopilot.ARDUPILOT, RALLY_INCL_HOME=1, RALLY_LIMIT_KM=0)
    assert flown_for(past, 3)[-1, 1] == pytest.approx(-600.0, abs=2.0)
    assert flown_for(home, 3)[-1, 1] == pytest.approx(0.0, abs=2.0)
    assert past.totals.distance_m - home.totals.distance_m == pytest.approx(600.0, abs=4.0)
    assert past.totals.energy_wh > home.totals.energy_wh + 3.0
    only = case_of(flown, RTL_TYPE=5)
    assert flown_for(only, 3)[-1, 1] == pytest.approx(-600.0, abs=2.0)


def test_a_landing_behind_the_return_is_where_types_1_and_3_go() -> None:
    flown = mission(takeoff(40), waypoint(500, 40), rtl(), land(700))
    ends = [flown_for(case_of(flown, RTL_TYPE=kind), 3)[-1, 1] for kind in (0, 1, 3)]
    assert ends == pytest.approx([0.0, 700.0, 700.0], abs=2.0)


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
@pytest.mark.parametrize("speed_m_s", [2.0, 10.0])
def test_the_tightest_point_is_no_less_tight_than_any_other(kind: int, speed_m_s: float) -> None:
    """A tour whose landing is far from home, at a speed that is not the vehicle's own."""
    tour = [at(300, 300, 40), at(900, 200, 60), at(800, -400, 30), at(100, -500, 80)]
    flown = mission(takeoff(40), speed(speed_m_s), *tour, item(189), at(0, 400, 30), land(600))
    returns = case_of(flown, RTL_TYPE=kind).returns
    sweep = sweep_returns(returns)
    assert sweep is not None
    profile = return_profile(returns)
    judged = (profile.item > 1) & (profile.item < len(flown.items))
    highest = float((profile.used_wh + profile.return_wh)[judged].max())
    # Along the mission a way begun on the edge of an acceptance radius takes up to 15 s longer than from
    # half a metre beside it: such needles are not looked for.
    slack = 1e-3 if kind in {1, 3} else 0.04
    assert sweep.sum_wh[sweep.tightest] >= highest * (1.0 - slack)
