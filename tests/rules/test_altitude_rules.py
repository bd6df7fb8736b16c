"""What altitudes count from: mixed references, AMSL written as height above home, home itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import HOME, item, mission, north, rtl, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.mission.items import Mission

VEHICLE = load_vehicle("falkowski-2023-quadrotor")


def of(code: str, one: Mission, *, home_amsl_m: float | None = None) -> list[Finding]:
    result = check(one, VEHICLE, battery=Battery(capacity_wh=170.0), home_amsl_m=home_amsl_m)
    return [finding for finding in result.findings if finding.code == code]


@pytest.mark.parametrize(
    ("frames", "severity"),
    [
        ((3, 3, 3), None),
        ((3, 6, 3), None),  # the same reference
        ((3, 10, 3), Severity.INFO),
        ((3, 0, 3), Severity.WARNING),
        ((5, 0, 0), None),
        ((10, 0, 10), Severity.WARNING),
    ],
)
def test_references_that_differ_are_told(
    frames: tuple[int, ...], severity: Severity | None
) -> None:
    made = [
        item(16, north(100.0 * n), 430.0 if frame in {0, 5} else 30.0, frame=frame)
        for n, frame in enumerate(frames, start=1)
    ]
    found = of("A101", mission(takeoff(30), *made, rtl(), autopilot=Autopilot.ARDUPILOT))
    assert [finding.severity for finding in found] == ([] if severity is None else [severity])


def test_a_landing_or_an_altitude_of_zero_makes_no_mix() -> None:
    ends = item(21, north(100), 400.0, frame=0)
    keeps = item(16, north(200), 0.0, frame=0)
    made = mission(takeoff(30), waypoint(100, 30), keeps, ends, autopilot=Autopilot.ARDUPILOT)
    assert of("A101", made) == []


@pytest.mark.parametrize(
    ("home_m", "height_m", "fires"),
    [
        # Up to 300 m above home's own altitude, from 150 m on.
        (400.0, 399.0, False),
        (400.0, 400.0, True),
        (200.0, 500.0, True),
        (190.0, 491.0, False),
        (140.0, 150.0, False),
        (140.0, 151.0, True),
        # Home so low that both references are one.
        (30.0, 200.0, False),
        (31.0, 200.0, True),
        # Nobody flies so high above home.
        (0.0, 500.0, False),
        (0.0, 501.0, True),
    ],
)
def test_a_height_above_home_that_looks_like_amsl_is_warned_of(
    home_m: float,
    height_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    made = mission(
        takeoff(50), waypoint(100, height_m), rtl(), home=replace(HOME, altitude_amsl_m=home_m)
    )
    found = of("A107", made)
    assert [(f.severity, f.item) for f in found] == ([(Severity.WARNING, 2)] if fires else [])


@pytest.mark.parametrize(
    ("given_m", "fires"), [(None, False), (403.0, False), (403.1, True), (396.9, True)]
)
def test_a_home_at_another_altitude_than_planned_is_warned_of(
    given_m: float | None,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    made = mission(takeoff(50), waypoint(100, 50), rtl())
    found = of("A115", made, home_amsl_m=given_m)
    assert [finding.severity for finding in found] == [Severity.WARNING] * fires


def test_a_home_without_a_planned_altitude_cannot_differ() -> None:
    for planned_m in (None, 0.0):  # 0: programs write it where they do not know
        home = replace(HOME, altitude_amsl_m=planned_m)
        made = mission(takeoff(50), waypoint(100, 50), rtl(), home=home)
        assert of("A115", made, home_amsl_m=900.0) == []


@pytest.mark.parametrize(
    ("height_m", "fires"), [(-400.0, True), (-1.1, True), (-0.9, False), (20.0, False)]
)
def test_a_place_under_ground_that_is_taken_to_be_level_is_an_error(
    height_m: float,
    fires: bool,  # noqa: FBT001 - a parameter of the test
) -> None:
    found = of("A102", mission(takeoff(30), waypoint(100, height_m), waypoint(200, 30), rtl()))
    assert [finding.severity for finding in found] == ([Severity.ERROR] if fires else [])


@pytest.mark.parametrize("model", ["px4-quad-2kg", "arducopter-sitl-quad"])
@pytest.mark.parametrize(
    ("takeoff_m", "leg_m", "is_open"), [(5, 5, False), (4.9, 5, True), (5, 4.9, True)]
)
def test_a_flight_at_the_clearance_over_unknown_ground_is_high_enough(
    model: str, takeoff_m: float, leg_m: float, *, is_open: bool
) -> None:
    # PX4 takes a take-off for ended within 0.8 m, NAV_MC_ALT_RAD, and climbs the rest along the leg.
    one = mission(takeoff(takeoff_m), waypoint(100, leg_m), waypoint(200, 30), rtl())
    found = check(one, load_vehicle(model), battery=Battery(capacity_wh=170.0)).findings
    assert any("not known" in finding.message for finding in found) is is_open


def test_a_landing_lower_than_home_is_not_under_the_ground() -> None:
    ends = item(21, north(200), -30.0)
    assert of("A102", mission(takeoff(30), waypoint(100, 30), ends)) == []
