"""Flights that end in the air, that do not begin, and what says so: never a go."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import item, jump, mission, north, rtl, speed, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PLENTY, PX4, STEP, found, vehicle_of
from thinning import examples

from planner.findings import Severity
from planner.selection import Selection
from planner.service.preflight import check

if TYPE_CHECKING:
    from planner.autopilot import Autopilot
    from planner.mission.items import MissionItem

FLYING = st.lists(
    st.one_of(
        st.builds(waypoint, st.floats(-400.0, 400.0), st.floats(10.0, 60.0)),
        st.builds(speed, st.floats(2.0, 9.0)),
        st.builds(
            lambda s: item(19, north(50), 30.0, params=(s, 0.0, 0.0, 0.0)), st.floats(1.0, 60.0)
        ),
        st.builds(lambda s: item(93, params=(s, -1.0, -1.0, -1.0)), st.floats(1.0, 60.0)),
    ),
    min_size=1,
    max_size=6,
)


def codes_of_errors(items: list[MissionItem], autopilot: Autopilot) -> set[str]:
    result = check(
        mission(takeoff(20), *items), vehicle_of(autopilot), autopilot=autopilot, battery=PLENTY
    )
    errors = {one.code for one in result.findings if one.severity is Severity.ERROR}
    assert (result.verdict == "no-go") == bool(errors)
    return errors


@pytest.mark.parametrize("autopilot", [STEP, PX4, ARDUPILOT])
@settings(deadline=None, max_examples=examples(12))
@given(items=FLYING)
def test_a_mission_that_nothing_lands_is_never_go_and_a_return_at_its_end_mends_that(
    autopilot: Autopilot, items: list[MissionItem]
) -> None:
    in_air = codes_of_errors(items, autopilot)
    assert "M102" in in_air
    assert codes_of_errors([*items, rtl()], autopilot) == in_air - {"M102"}


@pytest.mark.parametrize("autopilot", [STEP, PX4, ARDUPILOT])
@pytest.mark.parametrize(
    "end",
    [
        [item(178, params=(1.0, 5.0, -1.0, 0.0), frame=2)],  # a DO_ item
        [item(112, params=(5.0, 0.0, 0.0, 0.0), frame=2)],  # CONDITION_DELAY
        [item(17, north(50), 30.0)],  # LOITER_UNLIM
        [jump(2, -1.0)],
        [jump(5, 1.0), rtl(), waypoint(80, 20)],  # over the landing
    ],
)
def test_no_end_in_the_air_is_go(autopilot: Autopilot, end: list[MissionItem]) -> None:
    errors = codes_of_errors([waypoint(100, 20), *end], autopilot)
    assert errors & {"M102", "T101"}


# A return lands unless RTL_ALT_FINAL ends it in the air; action 5 cuts the motors.
@pytest.mark.parametrize(
    ("parameters", "until"),
    [
        ("BATT_FS_LOW_ACT,0\nBATT_FS_CRT_ACT,0\n", "no failsafe lands it"),
        ("BATT_FS_LOW_ACT,2\nBATT_LOW_MAH,1000\nBATT_CAPACITY,5000\n", "until BATT_LOW_MAH"),
        ("BATT_FS_LOW_ACT,7\nBATT_LOW_MAH,1000\nBATT_CAPACITY,5000\n", "no failsafe lands it"),
        ("BATT_FS_LOW_ACT,5\nBATT_LOW_MAH,1000\nBATT_CAPACITY,5000\n", "no failsafe lands it"),
        (
            "BATT_FS_LOW_ACT,2\nBATT_LOW_MAH,1000\nBATT_CAPACITY,5000\nRTL_ALT_FINAL,500\n",
            "no failsafe lands it",
        ),
        (
            (
                "BATT_FS_LOW_ACT,2\nBATT_LOW_MAH,1000\nBATT_CAPACITY,5000\nRTL_ALT_FINAL,500\n"
                "BATT_FS_CRT_ACT,1\nBATT_CRT_MAH,500\n"
            ),
            "until BATT_CRT_MAH",
        ),
    ],
)
def test_what_ends_the_hover_is_a_failsafe_that_lands(parameters: str, until: str) -> None:
    findings = found(mission(takeoff(20), waypoint(100, 20)), ARDUPILOT, parameters)
    [reported] = [one for one in findings if one.code == "M102"]
    assert until in reported.message


LANDS = mission(takeoff(20), waypoint(100, 20), item(21, north(100)))


@pytest.mark.parametrize(
    ("autopilot", "parameters", "severity"),
    [
        (ARDUPILOT, "RTL_ALT_FINAL,0\n", None),
        (ARDUPILOT, "RTL_ALT_FINAL,1\n", Severity.ERROR),
        # Low returns, which hovers; critical lands, unless nothing measures the battery.
        (ARDUPILOT, "RTL_ALT_FINAL,500\nBATT_FS_LOW_ACT,2\nBATT_LOW_VOLT,21\n", Severity.ERROR),
        (ARDUPILOT, "RTL_ALT_FINAL,500\nBATT_FS_CRT_ACT,1\nBATT_CRT_VOLT,20\n", Severity.WARNING),
        (
            ARDUPILOT,
            "RTL_ALT_FINAL,500\nBATT_FS_CRT_ACT,1\nBATT_CRT_VOLT,20\nBATT_MONITOR,0\n",
            Severity.ERROR,
        ),
        (PX4, "RTL_LAND_DELAY,0\n", None),
        (PX4, "RTL_LAND_DELAY,-1\nCOM_LOW_BAT_ACT,0\n", Severity.ERROR),
        (PX4, "RTL_LAND_DELAY,-1\nCOM_LOW_BAT_ACT,1\n", Severity.ERROR),  # returns, even when empty
        (PX4, "RTL_LAND_DELAY,-1\nCOM_LOW_BAT_ACT,3\n", Severity.WARNING),
        (PX4, "RTL_LAND_DELAY,-1\nRTL_TYPE,1\n", None),  # its returns lead to the landing
    ],
)
def test_a_mission_that_lands_says_that_its_returns_would_not(
    autopilot: Autopilot, parameters: str, severity: Severity | None
) -> None:
    one = [f for f in found(LANDS, autopilot, parameters) if f.code == "M102"]
    assert [f.severity for f in one] == ([] if severity is None else [severity])
    assert all("a return of the vehicle ends in the air" in f.message for f in one)


CIRCLES = [item(18, north(100), 30.0, params=(2.0, 0.0, 20.0, 0.0)), rtl()]


@pytest.mark.parametrize("autopilot", [STEP, ARDUPILOT])
@pytest.mark.parametrize(("rate", "endless"), [("0", True), ("0.1", False), ("-5", False)])
def test_circles_without_a_rate_never_end(
    autopilot: Autopilot,
    rate: str,
    endless: bool,  # noqa: FBT001 - a table of cases
) -> None:
    reported = found(mission(takeoff(20), *CIRCLES), autopilot, f"CIRCLE_RATE,{rate}\n")
    assert ("T101" in {one.code for one in reported}) == endless


def test_no_circle_waits_for_no_turns() -> None:
    none = item(18, north(100), 30.0, params=(0.0, 0.0, 20.0, 0.0))
    reported = found(mission(takeoff(20), none, rtl()), ARDUPILOT, "CIRCLE_RATE,0\n")
    assert "T101" not in {one.code for one in reported}


@pytest.mark.parametrize(
    ("parameters", "heading_deg", "endless"),
    [
        ("MIS_YAW_ERR,0\n", 90.0, True),
        ("MIS_YAW_ERR,0\n", None, False),
        ("MIS_YAW_ERR,0.1\n", 90.0, False),
        ("MIS_YAW_ERR,0\nMIS_YAW_TMT,0\n", 90.0, True),
        ("MIS_YAW_ERR,0\nMIS_YAW_TMT,3\n", 90.0, False),
    ],
)
def test_a_heading_that_px4_never_takes_is_waited_for_without_end(
    parameters: str, heading_deg: float | None, *, endless: bool
) -> None:
    there = item(16, north(100), 20.0, params=(0.0, 0.0, 0.0, heading_deg))
    reported = found(mission(takeoff(20), there, rtl()), PX4, parameters)
    assert ("T101" in {one.code for one in reported}) == endless


@pytest.mark.parametrize(
    ("code", "items"),
    [
        ("T101", [item(17, north(50), 30.0)]),
        ("T101", [waypoint(100, 20), jump(2, -1)]),
        ("T108", [item(92, frame=2, params=(1.0, 0.0, 0.0, 0.0)), rtl()]),
        ("T107", [waypoint(100, 20), item(93, params=(0.0, 23.0, 59.0, 0.0)), rtl()]),
        ("M121", [item(178, params=(1.0, 5.0, -1.0, 0.0), frame=2), jump(2, -1)]),
        ("M102", [waypoint(100, 20)]),
    ],
)
def test_no_setting_hides_that_a_flight_never_ends(code: str, items: list[MissionItem]) -> None:
    selection = Selection(ignore=(code[0],))
    result = check(
        mission(takeoff(20), *items), vehicle_of(ARDUPILOT), battery=PLENTY, selection=selection
    )
    assert code in {one.code for one in result.findings}
    assert result.verdict == "no-go"
