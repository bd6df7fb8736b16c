"""Limits that parameters draw around home, and fences that parameters leave without effect."""

from __future__ import annotations

import math
from functools import partial

import pytest
from fenced_missions import at, box, degrees, findings_of, rally
from made_missions import item, mission, rtl, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PLAIN, STEP, found

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.fence import FencePolygon
from planner.mission.items import MissionFormat
from planner.values import replace

SHORT = (takeoff(20), at(0, 100), rtl())
AROUND = box(-400.0, -400.0, 400.0, 400.0)
ARDUPILOT_ON = "FENCE_ENABLE,1\nFENCE_ACTION,1\nFENCE_ALT_MAX,60\nFENCE_RADIUS,120\n"


def test_without_a_fence_anywhere_nothing_is_told() -> None:
    for autopilot in Autopilot:
        assert findings_of(SHORT, autopilot=autopilot) == {}


@pytest.mark.parametrize(("metres", "crosses"), [(119.0, False), (121.0, True)])
@pytest.mark.parametrize(
    ("autopilot", "parameters"),
    [
        (Autopilot.PX4, "GF_MAX_HOR_DIST,120\nMPC_XY_CRUISE,2\n"),
        (Autopilot.ARDUPILOT, ARDUPILOT_ON + "FENCE_TYPE,2\n"),
    ],
)
def test_the_circle_around_home_is_a_fence(
    autopilot: Autopilot,
    parameters: str,
    metres: float,
    crosses: bool,  # noqa: FBT001 - a table of cases
) -> None:
    items = (takeoff(20), at(0, metres), rtl())
    found = findings_of(
        items, autopilot=autopilot, parameters=parameters, reaction_time_s=0.0, position_error_m=0.0
    )
    assert ("F101" in found) is crosses
    if crosses:
        assert "120 m) around home" in found["F101"].message


def test_ardupilots_circle_needs_its_bit_and_the_fence_on() -> None:
    far = (takeoff(20), at(0, 300), rtl())
    flown = partial(findings_of, far, autopilot=Autopilot.ARDUPILOT)
    assert "F101" in flown(parameters=ARDUPILOT_ON + "FENCE_TYPE,2\n")
    assert flown(parameters=ARDUPILOT_ON + "FENCE_TYPE,5\n") == {}
    off = ARDUPILOT_ON.replace("ENABLE,1", "ENABLE,0") + "FENCE_TYPE,2\n"
    assert flown(parameters=off) == {}
    high = (takeoff(20), at(0, 100, 80.0), rtl())
    assert findings_of(high, autopilot=Autopilot.ARDUPILOT, parameters=off) == {}
    assert "F101" in flown(parameters=off + "FENCE_AUTOENABLE,3\n")


@pytest.mark.parametrize(("height_m", "fires"), [(57.9, False), (60.0, True)])
@pytest.mark.parametrize(
    ("autopilot", "parameters"),
    [
        (Autopilot.PX4, "GF_MAX_VER_DIST,60\n"),
        (Autopilot.ARDUPILOT, ARDUPILOT_ON + "FENCE_TYPE,1\n"),
    ],
)
def test_a_ceiling_holds_for_the_flight(
    autopilot: Autopilot,
    parameters: str,
    height_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    items = (takeoff(20), at(0, 100, height_m), rtl())
    found = findings_of(items, autopilot=autopilot, parameters=parameters)
    refused = {"F117"} if autopilot is Autopilot.PX4 else set()
    assert set(found) == ({"F110"} | refused if fires else set())
    if fires:
        assert (found["F110"].severity, found["F110"].item) == (Severity.ERROR, 2)


# ``Location::AltFrame``: 0 above sea level, 1 above home, 2 above the origin, 3 above terrain.
@pytest.mark.parametrize(
    ("given", "is_open"),
    [
        ("FENCE_TYPE,1\nFENCE_ALT_MAX_TP,0\n", True),
        ("FENCE_TYPE,1\nFENCE_ALT_MAX_TP,1\n", False),
        ("FENCE_TYPE,1\nFENCE_ALT_MAX_TP,2\n", False),
        ("FENCE_TYPE,1\nFENCE_ALT_MAX_TP,3\n", True),
        ("FENCE_TYPE,2\nFENCE_ALT_MAX_TP,0\n", False),  # no ceiling
        ("FENCE_TYPE,8\nFENCE_ALT_MIN_TP,3\n", True),
        ("FENCE_TYPE,1\nFENCE_ALT_MIN_TP,3\n", False),  # no floor
        ("FENCE_ENABLE,0\nFENCE_TYPE,1\nFENCE_ALT_MAX_TP,0\n", False),
    ],
)
def test_a_height_that_does_not_count_from_home_is_not_checked(
    given: str,
    is_open: bool,  # noqa: FBT001 - a table of cases
) -> None:
    told = found(mission(*SHORT), ARDUPILOT, f"{ARDUPILOT_ON}{given}")
    assert ("X904" in {one.code for one in told}) is is_open


def test_a_return_above_the_ceiling_is_told() -> None:
    landing = (takeoff(20), at(0, 100), at(0, 100, 0.0, command=21))
    parameters = "GF_MAX_VER_DIST,60\nRTL_RETURN_ALT,{}\n"
    for items in (SHORT, landing):  # flown by the mission, or by a failsafe
        found = findings_of(items, autopilot=Autopilot.PX4, parameters=parameters.format(61))
        assert found["F110"].severity is Severity.ERROR
        assert "61 m above home" in found["F110"].message
        told = findings_of(items, autopilot=Autopilot.PX4, parameters=parameters.format(57.9))
        assert told == {}


def test_a_return_from_a_loiter_that_is_flown_on_from_is_below_the_ceiling_from_there() -> None:
    # Reached 47 m from home, a build of PX4 turned half round on the way to its centre, flew on to 82 m,
    # and climbed to 76.1 m (RTL_CONE_ANG 45).
    loiter = replace(at(0, 97, 20.0, command=31), param2=50.0)
    items = (takeoff(20), at(0, 57, 20.0), at(0, 47, 20.0), loiter, rtl())
    for ceiling_m, fires in ((71.0, True), (85.0, False)):
        given = f"RTL_RETURN_ALT,100\nRTL_MIN_DIST,150\nGF_MAX_VER_DIST,{ceiling_m}\n"
        found = findings_of(items, autopilot=Autopilot.PX4, parameters=given)
        assert ("F110" in found) is fires


@pytest.mark.parametrize(
    ("return_type", "height_m", "fires"),
    [
        (0, 35.0, True),  # 30 m over the 35 m of the rally point
        (0, 27.9, False),
        (2, 35.0, False),  # along the mission it does not climb
    ],
)
def test_a_return_climbs_over_the_place_it_leads_to(
    return_type: int, height_m: float, *, fires: bool
) -> None:
    high = replace(rally(0.0, 70.0), height_above_home_m=height_m)
    given = f"GF_MAX_VER_DIST,60\nRTL_RETURN_ALT,30\nRTL_TYPE,{return_type}\n"
    found = findings_of(SHORT, autopilot=Autopilot.PX4, parameters=given, rally_points=(high,))
    assert set(found) == ({"F110"} if fires else set())


@pytest.mark.parametrize("name", ["RTL_ALT,10000", "RTL_ALT_M,100"])
def test_ardupilots_returns_stay_below_its_ceiling(name: str) -> None:
    # ``ModeRTL::compute_return_target`` lowers them to FENCE_ALT_MAX less FENCE_MARGIN.
    given = ARDUPILOT_ON + f"FENCE_TYPE,1\n{name}\n"
    assert findings_of(SHORT, autopilot=Autopilot.ARDUPILOT, parameters=given) == {}


def test_ardupilots_floor_holds_for_waypoints_and_not_for_landings() -> None:
    parameters = ARDUPILOT_ON + "FENCE_TYPE,8\nFENCE_ALT_MIN,15\n"
    flown = partial(findings_of, autopilot=Autopilot.ARDUPILOT, parameters=parameters)
    assert flown(SHORT) == {}
    low = (takeoff(20), at(0, 100, 14.9), rtl())
    assert set(flown(low)) == {"F110"}
    assert set(flown((takeoff(20), at(0, 100, 15.0), rtl()))) == {"F110"}
    assert flown((takeoff(20), at(0, 100, 17.1), rtl())) == {}


@pytest.mark.parametrize(
    ("autopilot", "parameters", "reason"),
    [
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,0\n", "the fence is off"),
        # A take-off in GUIDED switches it on, none in AUTO.
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,0\nFENCE_AUTOENABLE,1\n", "take-off in AUTO"),
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,1\nFENCE_AUTOENABLE,1\n", "take-off in AUTO"),
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,0\nFENCE_AUTOENABLE,2\n", "take-off in AUTO"),
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,1\nFENCE_AUTOENABLE,2\n", ""),
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,0\nFENCE_AUTOENABLE,3\n", ""),
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,1\nFENCE_TYPE,8\nFENCE_ALT_MIN,1\n", "are off"),
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,1\nFENCE_TYPE,4\n", ""),
        (Autopilot.ARDUPILOT, "FENCE_ENABLE,1\nFENCE_TYPE,4\nFENCE_ACTION,0\n", "only reported"),
        (Autopilot.ARDUPILOT, "WPNAV_SPEED,500\n", ""),
        (Autopilot.PX4, "GF_ACTION,0\n", "does nothing"),
        (Autopilot.PX4, "GF_ACTION,1\n", "only warns"),
        (Autopilot.PX4, "GF_ACTION,2\n", ""),
    ],
)
def test_a_fence_that_is_switched_off_is_told(
    autopilot: Autopilot, parameters: str, reason: str
) -> None:
    # FENCE_AUTOENABLE and FENCE_ENABLE bring the circle of 150 m and the ceiling with them: in bounds.
    found = findings_of(SHORT, AROUND, autopilot=autopilot, parameters=parameters)
    assert set(found) == ({"F111"} if reason else set())
    if reason:
        assert found["F111"].severity is Severity.WARNING
        assert reason in found["F111"].message
        assert "p.param line" in found["F111"].message


@pytest.mark.parametrize(("value", "is_told"), [(0, False), (1, True), (2, True), (3, False)])
def test_limits_that_a_take_off_in_auto_does_not_switch_on_are_told(
    value: int, *, is_told: bool
) -> None:
    given = f"FENCE_ENABLE,0\nFENCE_TYPE,1\nFENCE_ALT_MAX,60\nFENCE_AUTOENABLE,{value}\n"
    flown = partial(findings_of, autopilot=Autopilot.ARDUPILOT, parameters=given)
    assert set(flown(SHORT)) == ({"F111"} if is_told else set())
    switched_on = item(207, frame=2, params=(1.0, 0.0, 0.0, 0.0))
    assert flown((SHORT[0], switched_on, *SHORT[1:])) == {}
    # 1 switches it off again while the vehicle stands (flown).
    assert ("F111" in flown((switched_on, *SHORT))) is (value == 1)


def ring(count: int) -> FencePolygon:
    angles = [2.0 * math.pi * i / count for i in range(count)]
    return FencePolygon(
        inclusion=True,
        vertices_deg=tuple(degrees(400 * math.cos(a), 400 * math.sin(a)) for a in angles),
    )


@pytest.mark.parametrize(("autopilot", "most"), [(Autopilot.PX4, 64), (Autopilot.ARDUPILOT, 255)])
def test_a_fence_with_more_points_than_the_autopilot_holds_is_told(
    autopilot: Autopilot, most: int
) -> None:
    assert findings_of(SHORT, ring(most), autopilot=autopilot) == {}
    assert set(findings_of(SHORT, ring(most + 1), autopilot=autopilot)) == {"F112"}


@pytest.mark.parametrize("autopilot", Autopilot)
@pytest.mark.parametrize("is_inclusion", [True, False])
def test_no_autopilot_has_polygons_across_the_180th_meridian(
    autopilot: Autopilot,
    is_inclusion: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # PX4's Geofence::insidePolygon and ArduPilot's Polygon_outside, in AC_PolyFence_loader::breached, count
    # edges that pass a place's longitude: one at 179.95° has none of 179.9° to -179.9°, one at 0° has all.
    north, south, west, east = -16.9, -17.0, 179.9, -179.9
    corners = ((south, west), (north, west), (north, east), (south, east))
    fiji = FencePolygon(inclusion=is_inclusion, vertices_deg=corners)
    assert "F105" in findings_of(SHORT, fiji, autopilot=autopilot)
    near = FencePolygon(
        inclusion=is_inclusion,
        vertices_deg=tuple((lat, min(lon % 360.0, 180.0)) for lat, lon in corners),
    )
    assert "F105" not in findings_of(SHORT, near, autopilot=autopilot)


@pytest.mark.parametrize(
    ("parameters", "is_open"),
    [
        ("FENCE_TOTAL,6\n", False),
        ("FENCE_TOTAL,6\nFENCE_AUTOENABLE,3\n", True),
        ("FENCE_TOTAL,6\nFENCE_ENABLE,1\nFENCE_TYPE,3\n", False),
        ("FENCE_TOTAL,6\nFENCE_ENABLE,1\nFENCE_ACTION,0\n", False),
        ("FENCE_ENABLE,1\nFENCE_TYPE,4\n", True),
        ("FENCE_ENABLE,1\nFENCE_TYPE,7\n", False),
        ("RALLY_TOTAL,2\n", True),
        ("RALLY_TOTAL,0\n", False),
    ],
)
def test_what_a_text_file_leaves_on_the_vehicle_is_not_checked(
    parameters: str,
    is_open: bool,  # noqa: FBT001 - a table of cases
) -> None:
    wide = f"{parameters}FENCE_RADIUS,1000\nFENCE_ALT_MAX,100\n"
    text = replace(PLAIN, file_format=MissionFormat.WPL)
    assert ("F114" in {one.code for one in found(text, ARDUPILOT, wide)}) is is_open
    assert "F114" not in {one.code for one in found(PLAIN, ARDUPILOT, wide)}


@pytest.mark.parametrize(("away_m", "leaves"), [(280.0, False), (310.0, True)])
def test_a_circle_without_a_radius_in_the_file_is_copters_own(
    away_m: float,
    leaves: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # AC_FENCE_CIRCLE_RADIUS_DEFAULT is 300 m; the 150 m of simulated flights are of the simulator's file.
    one = mission(takeoff(20), waypoint(away_m, 20), rtl())
    told = found(one, STEP, "FENCE_ENABLE,1\nFENCE_TYPE,2\nWPNAV_SPEED,1000\n")
    assert ("F101" in {finding.code for finding in told}) is leaves
