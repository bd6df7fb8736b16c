"""What a mission's file leaves open: a load that is picked up on the way."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import HOME, item, mission, north, rtl, takeoff, waypoint
from made_terrain import ground, of_heights, slope, wide
from rule_cases.case import ARDUPILOT, PX4, found

from planner import quantity
from planner.findings import Severity
from planner.mission.items import MissionFormat
from planner.physics.wind import Wind
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import MissionItem


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize(
    ("does", "late", "parameters", "payload_kg", "is_error"),
    [
        (1.0, True, "", 0.0, True),
        (1.0, True, "", 0.4, False),  # carried all the way: more than is flown
        (0.0, True, "", 0.0, False),  # lets go
        (1.0, False, "", 0.0, False),  # before the take-off: in the take-off mass
        (1.0, True, "GRIP_ENABLE,0\n", 0.0, False),  # has none
    ],
)
def test_a_load_picked_up_on_the_way_needs_its_mass(
    does: float,
    parameters: str,
    payload_kg: float,
    autopilot: Autopilot,
    *,
    late: bool,
    is_error: bool,
) -> None:
    grab = item(211, frame=2, params=(1.0, does, 0.0, 0.0))
    start = takeoff(20)
    items = (start, grab) if late else (grab, start)
    if parameters and autopilot is PX4:
        parameters = "1\t1\tPD_GRIPPER_EN\t0\t6\n"
    flown = found(
        mission(*items, waypoint(100, 20), rtl()), autopilot, parameters, payload_kg=payload_kg
    )
    graver = [one for one in flown if one.code == "T102" and one.severity is Severity.ERROR]
    assert bool(graver) is is_error


@pytest.mark.parametrize(
    ("parameters", "codes"),
    [
        ("TKOFF_RPM_MIN,500\nTKOFF_RPM_MAX,400\n", {"M131"}),
        ("TKOFF_RPM_MIN,500\nTKOFF_RPM_MAX,500\nSERIAL5_PROTOCOL,16\n", {"M131"}),
        ("TKOFF_RPM_MIN,500\nSERIAL5_PROTOCOL,23\n", {"M131"}),
        ("TKOFF_RPM_MIN,500\nSERIAL5_PROTOCOL,23\nSERVO_BLH_BDMASK,15\n", {"M131"}),
        ("TKOFF_RPM_MIN,500\nSERIAL5_PROTOCOL,23\nCAN_P1_DRIVER,1\n", {"M131"}),
        ("TKOFF_RPM_MIN,0\n", set()),
        (
            "MOT_SPOOL_TIME,10\n",
            {"M131"},
        ),  # DISARM_DELAY is 10 s; flown with 30 s: disarmed after 10.6 s
        ("MOT_SPOOL_TIME,9.9\n", {"M131"}),  # unless the throttle is raised before
        ("MOT_SPOOL_TIME,7\n", set()),
        ("MOT_SPOOL_TIME,30\nDISARM_DELAY,0\n", set()),
        ("TKOFF_RPM_MIN,500\n", {"X904"}),  # names no port: not known
    ],
)
def test_motors_whose_speed_nobody_tells_are_held_at_idle(parameters: str, codes: set[str]) -> None:
    flown = found(mission(takeoff(20), waypoint(100, 20), rtl()), ARDUPILOT, parameters)
    assert {one.code for one in flown if one.code in {"M131", "X904"}} == codes


def test_motors_that_may_turn_too_slowly_for_the_take_off_are_a_warning() -> None:
    # Flown with SIM_ESC_TELEM 1 and 1500: "Takeoff blocked: ESC RPM out of range", disarmed.
    flown = found(
        mission(takeoff(20), waypoint(100, 20), rtl()),
        ARDUPILOT,
        "TKOFF_RPM_MIN,1500\nSIM_ESC_TELEM,1\n",
    )
    told = next(one for one in flown if one.code == "M131")
    assert told.severity is Severity.WARNING
    assert "1500" in told.message


@pytest.mark.parametrize(
    ("delay_s", "spools_s", "more", "severity"),
    [
        # Flown by ArduCopter 4.7 (8264a9b4), AUTO_OPTIONS 3, DISARM_DELAY and MOT_SPOOL_TIME: disarmed on the
        # ground with 1 and 0.5, 2 and 0.5, 3 and 1 (after 2.95 s), 3 and 1.5, 4 and 2 (3.94), 5 and 3 (4.92).
        (1, 0.5, "", Severity.ERROR),
        (2, 0.5, "", Severity.ERROR),
        (3, 1, "", Severity.ERROR),
        (3, 1.5, "", Severity.ERROR),
        (4, 2, "", Severity.ERROR),
        (5, 3, "", Severity.ERROR),
        # Took off with a tenth of a second less, too near to rely on.
        (3, 0.9, "", Severity.ERROR),
        (4, 1.9, "", Severity.ERROR),
        (5, 2.9, "", Severity.ERROR),
        # Took off.
        (3, 0.5, "", Severity.WARNING),
        (3, 0.5, "TKOFF_SLEW_TIME,10\n", Severity.WARNING),
        (4, 1.5, "", Severity.WARNING),
        (5, 2.5, "", Severity.WARNING),
        (5, 2, "", None),
        (10, 2, "", None),
        (10, 5, "", None),
        # Outputs that are silent while it is disarmed stay so for MOT_SAFE_TIME: disarmed after 2.94 and 4.0
        # s, took off with 5.
        (3, 0.5, "MOT_SAFE_DISARM,1\nMOT_SAFE_TIME,4\n", Severity.ERROR),
        (4, 0.5, "MOT_SAFE_DISARM,1\nMOT_SAFE_TIME,4\n", Severity.ERROR),
        (5, 0.5, "MOT_SAFE_DISARM,1\nMOT_SAFE_TIME,4\n", Severity.WARNING),
        (4, 0.5, "MOT_SAFE_DISARM,0\nMOT_SAFE_TIME,4\n", None),
        (4, 0.5, "MOT_SAFE_DISARM,1\n", None),
        # By the stick: a throttle that is raised keeps it armed.
        (2, 0.5, "AUTO_OPTIONS,0\n", Severity.WARNING),
        (2, 2, "AUTO_OPTIONS,0\n", Severity.ERROR),
        (0, 3, "", None),
    ],
)
def test_a_delay_of_disarming_shorter_than_the_spin_up_keeps_it_on_the_ground(
    delay_s: float, spools_s: float, more: str, severity: Severity | None
) -> None:
    options = "" if "AUTO_OPTIONS" in more else "AUTO_OPTIONS,3\n"
    text = f"DISARM_DELAY,{delay_s}\nMOT_SPOOL_TIME,{spools_s}\n{options}{more}"
    flown = found(mission(takeoff(20), waypoint(100, 20), rtl()), ARDUPILOT, text)
    assert [one.severity for one in flown if one.code == "M131"] == [severity] * bool(severity)


@pytest.mark.parametrize(("value", "stands"), [(0, False), (1, True)])
def test_px4_that_is_to_be_thrown_does_not_take_off_by_itself(value: int, *, stands: bool) -> None:
    # Flown: 160 s on the ground with the mission begun.
    flown = found(mission(takeoff(20), waypoint(100, 20), rtl()), PX4, f"COM_THROW_EN,{value}\n")
    assert ("M131" in {one.code for one in flown}) is stands


@pytest.mark.parametrize(
    ("least_m", "heights_m", "items"),
    [
        (12.0, (30.0, 5.0), [3]),  # flown: no lower than 10.7 m
        (4.9, (30.0, 5.0), []),
        (-1.0, (30.0, 5.0), []),
        (25.0, (20.0, 22.0), []),  # climbs: only descents are stopped
    ],
)
def test_px4_sinks_no_lower_than_its_least_distance_from_the_ground(
    least_m: float, heights_m: tuple[float, float], items: list[int]
) -> None:
    first, second = heights_m
    made = mission(takeoff(first), waypoint(100, first), waypoint(100, second), rtl())
    told = found(made, PX4, f"NAV_MIN_GND_DIST,{least_m}\n")
    assert [one.item for one in told if "NAV_MIN_GND_DIST" in one.message] == items


@pytest.mark.parametrize(("wind_m_s", "is_error"), [(0.0, False), (4.0, True)])
def test_px4_without_an_integral_flies_in_calm_alone(wind_m_s: float, *, is_error: bool) -> None:
    flown = found(
        mission(takeoff(20), waypoint(100, 20), rtl()),
        PX4,
        "MPC_XY_VEL_I_ACC,0\n",
        wind=Wind(speed_m_s=wind_m_s, from_deg=0.0),
    )
    codes = {one.code for one in flown if one.severity is Severity.ERROR}
    assert ("M130" in codes) is is_error
    assert "P105" not in codes


def test_of_an_unknown_home_it_is_told_from_how_far_away_the_battery_lasts() -> None:
    flight = mission(takeoff(20), waypoint(0, 20, hold_s=600.0), waypoint(100, 20), rtl())
    told = [f for f in found(replace(flight, home=None)) if f.code == "M107"]
    assert [one.severity for one in told] == [Severity.WARNING] * 2
    [away] = [float(one[1]) for f in told if (one := re.search(r"up to ([\d.]+) km", f.message))]

    def is_short(away_m: float) -> bool:
        there = replace(HOME, latitude_deg=north(-away_m))
        codes = {one.code for one in found(replace(flight, home=there))}
        return not codes.isdisjoint({"E101", "E102"})

    # The article's quadrotor takes as much in cruise as in a hover; 5 % for stops and rounding.
    assert not is_short(950.0 * away)
    assert is_short(1050.0 * away)


@pytest.mark.parametrize(
    ("reserve", "severity"), [(0.95, Severity.WARNING), (0.965, Severity.ERROR)]
)
def test_a_margin_that_does_not_hold_500_m_more_is_an_error_without_a_home(
    reserve: float, severity: Severity
) -> None:
    flight = replace(mission(takeoff(20), waypoint(0, 20), waypoint(100, 20), rtl()), home=None)
    told = [f for f in found(flight, reserve=reserve) if f.code == "M107"]
    assert max(one.severity for one in told) is severity


CLEARANCE_M = 5.0


@pytest.mark.parametrize(("home_amsl_m", "reach_m"), [(None, 1000.0), (400.0, 500.0)])
@pytest.mark.parametrize(("beyond_m", "is_error"), [(1.0, True), (-1.0, False)])
def test_ground_that_falls_away_about_an_unknown_home_is_an_error(
    home_amsl_m: float | None, reach_m: float, beyond_m: float, *, is_error: bool
) -> None:
    # From 500 m down the slope the way to the first place leads over ground as high as 500 m up the slope;
    # by an altitude of home that is given no height is lower.
    angle_deg = math.degrees(math.atan((30.0 - CLEARANCE_M + beyond_m) / reach_m))
    one = replace(mission(takeoff(30), waypoint(100, 30), rtl()), home=None)
    sloping = wide(slope(angle_deg))
    told = found(one, terrain=sloping, clearance_m=CLEARANCE_M, home_amsl_m=home_amsl_m)
    errors = [f for f in told if f.severity is Severity.ERROR]
    assert [f.code for f in errors if f.code == "M107"] == ["M107"] * is_error
    known = found(replace(one, home=HOME), terrain=sloping, clearance_m=CLEARANCE_M)
    assert "M107" not in {f.code for f in known}


@pytest.mark.parametrize(("frame", "is_error"), [(3, True), (0, False), (10, False)])
def test_altitudes_that_do_not_count_from_an_unknown_home_are_as_high_wherever_it_is(
    frame: int, *, is_error: bool
) -> None:
    # A slope of 25 m in 500 m and 30 m above it; 530 m AMSL are 105 m above the highest.
    sloping = wide(slope(math.degrees(math.atan(0.05))))
    height_m = 530.0 if frame == 0 else 30.0
    legs = [item(command, north(100), height_m, frame=frame) for command in (22, 16)]
    one = replace(mission(*legs, rtl()), home=None)
    told = found(one, ARDUPILOT, "RTL_ALT,6000\n", terrain=sloping)
    errors = [f.message for f in told if f.code == "M107" and f.severity is Severity.ERROR]
    assert any("the flight may be" in one for one in errors) is is_error


@pytest.mark.parametrize(
    ("last_m", "return_altitude_m", "is_error"),
    [(40.0, 15.0, True), (60.0, 15.0, False), (40.0, 60.0, False)],
)
def test_a_way_back_over_a_hill_in_sight_of_an_unknown_home_is_an_error(
    last_m: float, return_altitude_m: float, *, is_error: bool
) -> None:
    # A ridge of 50 m 400 m south of the first place, where home may be behind.
    ridge = wide(ground(50.0, at_m=-400.0))
    legs = (takeoff(100), waypoint(100, 100), waypoint(200, last_m), waypoint(100, last_m), rtl())
    given = f"RTL_ALT,{100.0 * return_altitude_m:g}\n"
    told = found(replace(mission(*legs), home=None), ARDUPILOT, given, terrain=ridge)
    errors = [f.code for f in told if f.severity is Severity.ERROR]
    assert errors == ["M107"] * is_error


def unknown_home_errors(
    legs: Sequence[MissionItem], autopilot: Autopilot, given: str, terrain: TerrainGrid
) -> list[str]:
    told = found(replace(mission(*legs), home=None), autopilot, given, terrain=terrain)
    return [f.code for f in told if f.severity is Severity.ERROR and f.code != "E109"]


@pytest.mark.parametrize(("first_m", "is_error"), [(54.0, True), (56.0, False)])
def test_a_way_out_over_a_hill_goes_down_to_the_first_place(
    first_m: float, *, is_error: bool
) -> None:
    # A ridge of 50 m behind which home may be; the return keeps 60 m.
    ridge = wide(ground(50.0, at_m=-400.0))
    legs = (takeoff(100), waypoint(100, first_m), waypoint(200, 60), rtl())
    told = unknown_home_errors(legs, ARDUPILOT, "RTL_ALT,6000\n", ridge)
    assert told == ["M107"] * is_error


@pytest.mark.parametrize(("returns_m", "is_error"), [(54.0, True), (56.0, False)])
def test_px4_returns_to_an_unknown_home_at_its_own_height(
    returns_m: float, *, is_error: bool
) -> None:
    ridge = wide(ground(50.0, at_m=-400.0))
    legs = (takeoff(100), waypoint(100, 60), waypoint(200, 40), rtl())
    told = unknown_home_errors(legs, PX4, f"RTL_RETURN_ALT,{returns_m}\n", ridge)
    assert told == ["M107"] * is_error


def trench_and_ridge(trench: tuple[float, float], ridge: tuple[float, float]) -> TerrainGrid:
    """Return ground with a trench and a ridge, each of a depth or height at a place."""
    level = ground(0.0).tiles[0]
    heights = [
        np.asarray(ground(rise, at_m=at).tiles[0].heights_amsl_m) for rise, at in (trench, ridge)
    ]
    return wide(of_heights(heights[0] + heights[1] - np.asarray(level.heights_amsl_m), level))


@pytest.mark.parametrize(("returns_m", "is_error"), [(61.0, True), (63.0, False)])
def test_the_height_of_a_return_counts_from_the_lowest_home_in_sight(
    returns_m: float, *, is_error: bool
) -> None:
    # Home may be 35 m down; a ridge of 22 m is between, and AMSL items are 50 m and 10 m above the ground.
    uneven = trench_and_ridge((-35.0, -400.0), (22.0, -200.0))
    there = (item(16, north(100), 450.0, frame=0), item(16, north(200), 410.0, frame=0))
    told = unknown_home_errors(
        (takeoff(100), *there, rtl()), ARDUPILOT, f"RTL_ALT,{100.0 * returns_m:g}\n", uneven
    )
    assert told == ["M107"] * is_error


@pytest.mark.parametrize(("returns_m", "is_error"), [(64.0, True), (66.0, False)])
def test_returns_over_a_hill_out_of_sight_count_from_the_lowest_home(
    returns_m: float, *, is_error: bool
) -> None:
    # Home may be 20 m down; a ridge of 40 m is between home and the only place so low that RTL_ALT decides.
    uneven = trench_and_ridge((-20.0, -300.0), (40.0, 700.0))
    high = waypoint(100, 90), waypoint(1000, 90)
    legs = (takeoff(90), *high, waypoint(1100, 50), waypoint(1000, 90), waypoint(100, 90), rtl())
    told = unknown_home_errors(legs, ARDUPILOT, f"RTL_ALT,{100.0 * returns_m:g}\n", uneven)
    assert told == ["M107"] * is_error


def test_ground_in_sight_of_an_unknown_home_that_is_not_known_is_an_error() -> None:
    one = replace(mission(takeoff(30), waypoint(100, 30), rtl()), home=None)
    errors = [f for f in found(one, terrain=ground(0.0)) if f.severity is Severity.ERROR]
    assert ["is not all known" in f.message for f in errors] == [True]
    assert not [f for f in found(one, terrain=wide(ground(0.0))) if f.severity is Severity.ERROR]


@pytest.mark.parametrize(
    ("parameters", "is_error"),
    [
        ("FENCE_ENABLE,1\nFENCE_TYPE,1\nFENCE_ALT_MAX,100\n", False),
        # The flight's 100 m, 500 m in sight, its position error.
        ("FENCE_ENABLE,1\nFENCE_TYPE,2\nFENCE_RADIUS,590\n", True),
        ("FENCE_ENABLE,1\nFENCE_TYPE,2\nFENCE_RADIUS,615\n", False),
        ("FENCE_ENABLE,0\nFENCE_TYPE,2\nFENCE_RADIUS,590\n", False),
    ],
)
def test_a_fence_about_an_unknown_home_is_an_error(parameters: str, *, is_error: bool) -> None:
    one = replace(mission(takeoff(20), waypoint(100, 20), rtl()), home=None)
    told = found(one, ARDUPILOT, parameters)
    assert [f.severity for f in told if f.code == "F109"] == [Severity.ERROR] * is_error
    # No drawing, and no other maker's mission, tells a home.
    drawn = found(replace(one, file_format=MissionFormat.FOREIGN), ARDUPILOT, parameters)
    assert [f.severity for f in drawn if f.code == "F109"] == [Severity.WARNING] * is_error


@pytest.mark.parametrize(
    ("home_amsl_m", "frame", "is_error"),
    [(None, 0, True), (400.0, 0, False), (None, 3, False), (None, 10, True), (400.0, 10, False)],
)
def test_a_ceiling_above_an_unknown_home_is_an_error_for_items_not_above_home(
    home_amsl_m: float | None, frame: int, *, is_error: bool
) -> None:
    height_m = 420.0 if frame == 0 else 20.0
    there = item(16, north(100), height_m, frame=frame)
    one = replace(mission(takeoff(20), there, rtl()), home=None)
    ceiling = "FENCE_ENABLE,1\nFENCE_TYPE,1\nFENCE_ALT_MAX,100\n"
    told = found(one, ARDUPILOT, ceiling, terrain=ground(0.0), home_amsl_m=home_amsl_m)
    assert [f.severity for f in told if f.code == "F109"] == [Severity.ERROR] * is_error


@pytest.mark.parametrize(
    ("tangent", "hold_s", "is_error"), [(1.0, 12.0, True), (0.0, 12.0, False), (1.0, 0.0, False)]
)
def test_px4_that_waits_behind_a_loiter_left_on_its_tangent_flies_on_there(
    tangent: float, hold_s: float, *, is_error: bool
) -> None:
    loiter = item(31, north(155.0), 20.0, params=(0.0, 0.0, 0.0, tangent))
    delay = item(93, 0.0, 0.0, frame=2, params=(hold_s, 0.0, 0.0, 0.0))
    one = mission(takeoff(20), waypoint(100, 20), loiter, delay, waypoint(50, 20), rtl())
    for autopilot in (PX4, ARDUPILOT):
        told = [f for f in found(one, autopilot) if "flies on to its tangent" in f.message]
        expected = [Severity.ERROR] * (is_error and autopilot is PX4)
        assert [f.severity for f in told if f.code == "T102"] == expected


@pytest.mark.parametrize(
    ("radius_m", "heading_deg", "fence", "severities"),
    [
        (80.0, None, "", [Severity.WARNING]),
        (80.0, None, "GF_MAX_HOR_DIST,500\nGF_ACTION,3\n", [Severity.ERROR]),
        (80.0, None, "GF_MAX_VER_DIST,120\nGF_ACTION,3\n", [Severity.WARNING]),
        (80.0, 0.0, "", []),
        (5.0, None, "", []),
    ],
)
def test_px4_that_turns_at_a_loiter_passed_from_afar_flies_on_meanwhile(
    radius_m: float, heading_deg: float | None, fence: str, severities: list[Severity]
) -> None:
    # Behind the take-off, at its height; flown 26 m beside.
    loiter = item(31, north(58.0), 20.0, params=(0.0, radius_m, 0.0, None))
    made = mission(takeoff(20), loiter, waypoint(-60, 20), rtl())
    told = found(made, PX4, fence, heading_deg=heading_deg)
    assert [f.severity for f in told if "while it turns" in f.message] == severities


def test_a_waypoint_near_a_loiter_passed_from_afar_is_not_reached_from_there() -> None:
    # 12 m from the place of the LOITER_TO_ALT, which counts as reached from 60 m: T126 at 12 m before.
    loiter = item(31, north(160.0), 20.0, params=(0.0, 80.0, 0.0, None))
    near = item(16, north(172.0), 20.0, params=(0.0, 15.0, 0.0, None))
    made = mission(takeoff(20), waypoint(100, 20), loiter, near, waypoint(50, 20), rtl())
    assert "T126" not in [one.code for one in found(made, PX4)]
    straight = mission(takeoff(20), waypoint(160, 20), near, waypoint(50, 20), rtl())
    assert "T126" in [one.code for one in found(straight, PX4)]


@pytest.mark.parametrize("is_limited", [False, True])
def test_px4_that_may_fly_either_way_is_an_error_where_one_is_not_checked(
    *, is_limited: bool
) -> None:
    # Flown straight; with 0.04 s more it would have been by the line behind the LOITER_TO_ALT.
    east_deg = HOME.longitude_deg + 50.0 / 76_000.0
    loiter = item(31, north(0.0), 20.6, params=(0.0, 60.0, 0.0, None), longitude_deg=east_deg)
    made = mission(takeoff(20), waypoint(0, 20, hold_s=9.0), loiter, waypoint(60, 25), rtl())
    told = found(made, PX4, heading_deg=0.0, terrain=ground(0.0) if is_limited else None)
    assert [one.severity for one in told if one.code == "T125"] == [Severity.WARNING]
    severities = [one.severity for one in told if "in two ways" in one.message]
    assert severities == [Severity.ERROR] * is_limited


# Three searches of 10 s, the defaults, of 100 s, and none; at some 270 W of hover 2.3 and 23 Wh.
@pytest.mark.parametrize(
    ("radius_m", "yaw_mode", "fence", "severities"),
    [
        (5.1, 4, "", [Severity.WARNING]),
        (5.1, 4, "GF_MAX_HOR_DIST,500\nGF_ACTION,3\n", [Severity.ERROR]),
        (0.0, 4, "", [Severity.WARNING]),  # NAV_LOITER_RAD, 80 m
        (5.0, 4, "", []),
        (5.1, 0, "", []),
    ],
)
def test_px4_that_turns_first_leaves_a_loiter_beside_what_is_predicted(
    radius_m: float, yaw_mode: int, fence: str, severities: list[Severity]
) -> None:
    loiter = item(31, north(160.0), 20.0, params=(0.0, radius_m, 0.0, None))
    made = mission(takeoff(20), waypoint(100, 20), loiter, waypoint(200, 20), rtl())
    told = found(made, PX4, f"MPC_YAW_MODE,{yaw_mode}\n{fence}")
    assert [f.severity for f in told if "turns to the next heading" in f.message] == severities


@pytest.mark.parametrize(
    ("parameters", "asked", "severities"),
    [
        ("RTL_PLD_MD,0\n", 0.0, []),
        ("RTL_PLD_MD,1\n", 1.0, []),
        # Flown with 15 m: on the ground 13 m short of its place; with 0 on it.
        ("NAV_ACC_RAD,3.1\n", 1.0, [Severity.WARNING]),
        ("NAV_ACC_RAD,3\n", 1.0, []),
        ("NAV_ACC_RAD,15\n", 0.0, []),
        ("RTL_PLD_MD,2\n", 0.0, [Severity.WARNING]),
        ("RTL_PLD_MD,0\n", 2.0, [Severity.WARNING]),
        ("RTL_PLD_MD,2\nPLD_SRCH_TOUT,100\n", 0.0, [Severity.ERROR]),
        ("RTL_PLD_MD,2\nPLD_SRCH_TOUT,100\nPLD_MAX_SRCH,0\n", 0.0, [Severity.WARNING]),
    ],
)
def test_a_landing_that_searches_for_its_target_is_told(
    parameters: str, asked: float, severities: list[Severity]
) -> None:
    lands = item(21, north(100), 0.0, params=(0.0, asked, 0.0, None))
    made = mission(takeoff(20), waypoint(100, 20), lands)
    flown = found(
        made,
        PX4,
        parameters,
        battery=Battery(capacity_wh=25.0),
        vehicle=load_vehicle("px4-quad-2kg"),
    )
    assert [one.severity for one in flown if one.code == "T110"] == severities


@pytest.mark.parametrize(
    ("search_m", "ceiling_m", "more_s", "is_open"),
    [
        (10.0, 120.0, 30.0, False),  # where RTL_DESCEND_ALT is already
        (40.0, 120.0, 50.0, False),  # 30 m down again at 1.5 m/s
        (400.0, 120.0, 90.0, False),  # 90 m up at 3 m/s in the time of the search
        (400.0, 99.0, 90.0, True),
    ],
)
def test_a_search_for_a_target_climbs(
    search_m: float, ceiling_m: float, more_s: float, *, is_open: bool
) -> None:
    """``PrecLand::switch_to_state_search``: to PLD_SRCH_ALT, and down from there."""
    given = f"RTL_PLD_MD,2\nPLD_SRCH_ALT,{search_m}\nGF_MAX_VER_DIST,{ceiling_m}\n"
    reported = found(
        mission(takeoff(20), waypoint(100, 20), rtl()),
        PX4,
        given,
        vehicle=load_vehicle("px4-quad-2kg"),
    )
    [told] = [one.message for one in reported if one.code == "T110"]
    assert f"up to {quantity.duration(more_s)} and" in told
    left_open = [one for one in reported if one.code == "X904" and "PLD_SRCH_ALT" in one.message]
    assert bool(left_open) is is_open


@pytest.mark.parametrize(
    ("parameters", "severities"),
    [
        ("PLND_ENABLED,0\nPLND_STRICT,2\n", []),
        ("PLND_ENABLED,1\nPLND_STRICT,0\n", []),
        ("PLND_ENABLED,1\n", [Severity.WARNING]),
        ("PLND_ENABLED,1\nPLND_STRICT,2\n", [Severity.ERROR]),
    ],
)
def test_a_landing_that_waits_for_its_target_is_told(
    parameters: str, severities: list[Severity]
) -> None:
    flown = found(mission(takeoff(20), waypoint(100, 20), rtl()), ARDUPILOT, parameters)
    assert [one.severity for one in flown if one.code == "T110"] == severities


def test_a_landing_that_sees_no_target_stands_for_seven_seconds() -> None:
    # Flown with ArduCopter 4.7.0-dev: 78.3 s for 71.3, from its message at 44.1 s to 51.1 s at one height.
    made = mission(takeoff(20), waypoint(100, 20), rtl())

    def told(battery_wh: float) -> list[Finding]:
        own = found(made, ARDUPILOT, "PLND_ENABLED,1\n", battery=Battery(capacity_wh=battery_wh))
        return [one for one in own if one.code in {"T110", "E101", "E102"}]

    [enough] = told(100.0)
    assert "stands in the air for 7.0 s" in enough.message
    assert enough.severity is Severity.WARNING
    margins = {wh: [one.severity for one in told(wh)] for wh in range(5, 30)}
    assert [Severity.ERROR] in margins.values()  # where what is predicted is held, and that is not


@pytest.mark.parametrize(
    ("parameters", "severity"),
    [
        ("MOT_BAT_CURR_MAX,0\n", None),
        ("MOT_BAT_CURR_MAX,5\n", Severity.ERROR),
        ("MOT_BAT_CURR_MAX,5\nBATT_MONITOR,3\n", None),
        ("MOT_BAT_CURR_MAX,500\n", None),
    ],
)
def test_a_limit_of_current_below_that_of_a_hover_takes_its_thrust(
    parameters: str, severity: Severity | None
) -> None:
    told = found(mission(takeoff(20), waypoint(100, 20), rtl()), ARDUPILOT, parameters)
    limited = [one.severity for one in told if "MOT_BAT_CURR_MAX" in one.message]
    assert limited == ([] if severity is None else [severity])


def test_a_limit_of_current_is_one_between_hover_and_climb() -> None:
    made = mission(takeoff(20), waypoint(100, 20), rtl())
    at = {}
    for limit_a in range(5, 60):
        told = found(made, ARDUPILOT, f"MOT_BAT_CURR_MAX,{limit_a}\n")
        own = [one for one in told if "MOT_BAT_CURR_MAX" in one.message]
        at[limit_a] = own[0].severity if own else None
    changes = [limit_a for limit_a in range(6, 60) if at[limit_a] is not at[limit_a - 1]]
    assert [at[limit_a] for limit_a in changes] == [Severity.WARNING, None]


@pytest.mark.parametrize(
    ("parameters", "severities"),
    [
        # Defaults are 2, 1 and 1; flown with 1 and 0.3: 8 % longer.
        ("PSC_NE_VEL_P,1.6\nPSC_NE_VEL_I,0.8\nPSC_NE_POS_P,0.8\n", []),
        ("PSC_NE_VEL_P,1.59\n", [Severity.WARNING]),
        ("PSC_VELXY_I,0.79\n", [Severity.WARNING]),
        ("PSC_NE_POS_P,0.79\n", [Severity.WARNING]),
        # Of the height; flown with 0.3, 1.5 and 0.5: 3.5, 2.2 and 1.4 % longer.
        ("PSC_D_POS_P,0.8\nPSC_D_VEL_P,4\nPSC_JERK_D,4\n", []),
        ("PSC_D_POS_P,0.79\n", [Severity.WARNING]),
        ("PSC_VELZ_P,3.99\n", [Severity.WARNING]),
        ("PSC_JERK_Z,3.9\n", [Severity.WARNING]),
        # Flown with 219 and TUNE_MIN 100: 140.4 s for 78.6; without 219: 78.6.
        ("TUNE,10\nRC6_OPTION,219\nTUNE_MIN,100\nTUNE_MAX,300\n", [Severity.ERROR]),
        ("TUNE,10\n", [Severity.WARNING]),
        ("TUNE,25\nRC6_OPTION,219\n", []),
    ],
)
def test_gains_that_are_not_read_are_told(parameters: str, severities: list[Severity]) -> None:
    flown = found(mission(takeoff(20), waypoint(100, 20), rtl()), ARDUPILOT, parameters)
    assert [one.severity for one in flown if one.code == "T110"] == severities
