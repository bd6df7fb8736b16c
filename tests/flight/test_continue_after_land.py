"""Missions that go on after a landing: ArduPilot's MIS_OPTIONS 4 and returns, PX4's landings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import (
    HOME,
    METRES_PER_DEGREE_NORTH,
    item,
    mission,
    rtl,
    speed,
    takeoff,
    waypoint,
)
from rule_cases.case import vehicle_of
from thinning import examples

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.service.preflight import CheckResult, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.mission.items import Home, MissionItem

ARDUPILOT, PX4, STEP = Autopilot.ARDUPILOT, Autopilot.PX4, Autopilot.STEP
GRIPPER = item(211, frame=2, params=(1.0, 0.0, 0.0, 0.0))
AUXILIARY = item(218, frame=2, params=(300.0, 2.0, 0.0, 0.0))


def wait(seconds: float) -> MissionItem:
    return item(93, frame=2, params=(seconds, -1.0, -1.0, -1.0))


def land(metres_north: float) -> MissionItem:
    return item(21, waypoint(metres_north, 0.0).latitude_deg, 0.0)


def flown(
    *items: MissionItem, options: int = 4, autopilot: Autopilot = ARDUPILOT, home: Home = HOME
) -> CheckResult:
    text = f"MIS_OPTIONS,{options}\nWPNAV_RADIUS,200\n"
    return check(
        mission(*items, home=home, autopilot=ARDUPILOT),
        vehicle_of(autopilot),
        battery=Battery(capacity_wh=5000.0),
        parameters=parameters_from_text(text.encode(), source="p.param"),
    )


def left_out(result: CheckResult) -> list[Severity]:
    return [one.severity for one in result.findings if one.code == "T104"]


THERE = (takeoff(30), waypoint(200, 30), land(200))
BACK = (takeoff(30), waypoint(0, 30), land(0))


@pytest.mark.parametrize("options", [4, 5])
@pytest.mark.parametrize(
    "between",
    [(), (wait(10.0),), (AUXILIARY, wait(10.0)), (GRIPPER,), (GRIPPER, wait(5.0), speed(5.0))],
)
def test_the_flight_goes_on_where_a_take_off_comes_next(
    options: int, between: tuple[MissionItem, ...]
) -> None:
    result = flown(*THERE, *between, *BACK, options=options)
    assert left_out(result) == []
    assert result.items[-1].arrival_s == pytest.approx(result.totals.time_s)
    assert result.totals.distance_m == pytest.approx(400.0, abs=2.0)


@pytest.mark.parametrize(
    ("options", "between"),
    [
        (0, ()),
        (3, ()),
        (4, (waypoint(0, 10),)),
        (4, (item(213, frame=2),)),
        # 16 times it looks for the next navigation command, from one place after the other.
        (4, (*[GRIPPER] * 15, wait(5.0))),
    ],
)
def test_it_ends_where_the_vehicle_disarms(options: int, between: tuple[MissionItem, ...]) -> None:
    result = flown(*THERE, *between, *BACK, options=options)
    assert left_out(result) == [Severity.ERROR]
    assert result.totals.distance_m == pytest.approx(200.0, abs=1.0)


@pytest.mark.parametrize(
    ("autopilot", "end"),
    [(ARDUPILOT, land), (STEP, land), (ARDUPILOT, lambda _: rtl()), (STEP, lambda _: rtl())],
)
@settings(deadline=None, max_examples=examples(2))
@given(
    north_m=st.floats(50.0, 800.0),
    beyond_m=st.floats(50.0, 800.0),
    height_m=st.floats(15.0, 60.0),
    seconds=st.integers(1, 600),
)
def test_its_energy_is_the_sum_of_its_parts_and_of_the_wait(
    autopilot: Autopilot,
    end: Callable[[float], MissionItem],
    north_m: float,
    beyond_m: float,
    height_m: float,
    seconds: int,
) -> None:
    first = (takeoff(height_m), waypoint(north_m, height_m), end(north_m))
    stands_m = north_m if end is land else 0.0
    end_m = stands_m + beyond_m
    up = item(22, waypoint(stands_m, 0.0).latitude_deg, height_m)
    then = (up, waypoint(end_m, height_m), land(end_m))
    whole = flown(*first, wait(seconds), *then, autopilot=autopilot)
    assert left_out(whole) == []
    there = flown(*first, autopilot=autopilot).totals
    moved = replace(HOME, latitude_deg=HOME.latitude_deg + stands_m / METRES_PER_DEGREE_NORTH)
    back = flown(*then, autopilot=autopilot, home=moved).totals
    assert whole.totals.time_s == pytest.approx(there.time_s + seconds + back.time_s, rel=2e-3)
    loads = vehicle_of(autopilot).loads
    parts_wh = there.energy_wh + back.energy_wh
    if loads is None:  # idling is not known of this model: a hover is counted, which is more
        assert whole.totals.energy_wh > parts_wh
        return
    idle_w = loads.ground_idle_w + loads.avionics_w
    assert whole.totals.energy_wh == pytest.approx(parts_wh + idle_w * seconds / 3600.0, rel=2e-3)


def test_a_delivery_by_px4_takes_as_long_as_in_its_simulation() -> None:
    # PX4 1.17 alpha, SIH: armed at 40.3 s, disarmed at 201.6 s; two landings, 26.9 and 25 m on.
    legs = [
        one
        for north_m in (26.9, 51.9)
        for one in (waypoint(north_m, 25.0), land(north_m), waypoint(north_m, 25.0))
    ]
    quiet = replace(load_vehicle("px4-sih-quad"), position_noise_m=0.0)
    made = mission(takeoff(25.0), *legs, rtl(), autopilot=PX4)
    found = check(made, quiet, battery=Battery(capacity_wh=5000.0))
    assert found.totals.time_s == pytest.approx(161.3, abs=3.0)


def test_a_flight_over_two_returns_takes_as_long_as_in_its_simulation() -> None:
    # ArduCopter 4.7.0-dev, SITL: armed at 47.0 s, disarmed at 205.0 s; read at 1 Hz.
    out = (takeoff(20), waypoint(60, 20), rtl())
    made = mission(*out, wait(5.0), *out, autopilot=ARDUPILOT)
    found = check(made, vehicle_of(ARDUPILOT), battery=Battery(capacity_wh=5000.0))
    assert found.totals.time_s == pytest.approx(158.0, abs=3.0)


def test_a_return_that_stays_in_the_air_ends_the_flight() -> None:
    text = b"RTL_ALT_FINAL,500\n"
    found = check(
        mission(takeoff(20), rtl(), *BACK, autopilot=ARDUPILOT),
        vehicle_of(ARDUPILOT),
        battery=Battery(capacity_wh=5000.0),
        parameters=parameters_from_text(text, source="p.param"),
    )
    assert left_out(found) == [Severity.ERROR]
    assert found.totals.distance_m == pytest.approx(0.0, abs=0.5)
