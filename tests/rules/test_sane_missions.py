"""Missions as people fly them, an ordinary pack, an ordinary breeze: a go on both autopilots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, speed, takeoff, waypoint
from px4_quad import PX4_QUAD

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.notation import read_battery
from planner.physics.wind import Wind
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.mission.items import Mission, MissionItem

METRES_PER_DEGREE_EAST = 75_900.0
"""At 47° north."""


def at(east_m: float, north_m: float, height_m: float, hold_s: float = 0.0) -> MissionItem:
    there = waypoint(north_m, height_m, hold_s=hold_s)
    return replace(there, longitude_deg=8.0 + east_m / METRES_PER_DEGREE_EAST)


def survey() -> Mission:
    """Six lines of 250 m, 30 m apart."""
    ends_m = ((60.0, 310.0), (310.0, 60.0))
    lines = [at(30.0 * line, end, 50.0) for line in range(6) for end in ends_m[line % 2]]
    return mission(takeoff(50), speed(6.0), *lines, rtl())


def delivery() -> Mission:
    """700 m out, down to 8 m for the parcel, back by a return."""
    drop = (waypoint(700, 30), waypoint(700, 8, hold_s=15.0), waypoint(700, 30))
    return mission(takeoff(30), *drop, rtl())


def inspection() -> Mission:
    """Slowly around a mast 120 m away, standing at four places."""
    places = ((20.0, 120.0), (0.0, 140.0), (-20.0, 120.0), (0.0, 100.0))
    stops = [at(*place, 25.0 + 5.0 * n, hold_s=8.0) for n, place in enumerate(places)]
    return mission(takeoff(25), speed(3.0), *stops, rtl())


def one_way() -> Mission:
    """Lands 900 m away."""
    return mission(takeoff(30), waypoint(900, 30), item(21, north(900), 0.0))


FLOWN = {
    Autopilot.PX4: (
        PX4_QUAD,
        "5Ah@14.8V",
        "MPC_XY_CRUISE,8\nRTL_RETURN_ALT,60\nCOM_LOW_BAT_ACT,3\nGF_ACTION,3\nGF_MAX_HOR_DIST,1500\n",
    ),
    Autopilot.ARDUPILOT: (
        load_vehicle("arducopter-sitl-quad"),
        "8Ah@22.2V",
        "WPNAV_SPEED,800\nRTL_ALT,4000\nBATT_FS_LOW_ACT,2\nBATT_LOW_VOLT,21\nFENCE_ENABLE,1\nFENCE_RADIUS,1500\n",
    ),
}


@pytest.mark.parametrize("autopilot", FLOWN)
@pytest.mark.parametrize("make", [survey, delivery, inspection, one_way])
def test_an_ordinary_mission_is_a_go(autopilot: Autopilot, make: Callable[[], Mission]) -> None:
    vehicle, label, text = FLOWN[autopilot]
    parameters = parameters_from_text(text.encode(), source="p.param")
    one = replace(make(), autopilot=autopilot)
    for given in (
        {"wind": Wind(speed_m_s=5.0, from_deg=230.0), "battery": read_battery(label)},
        {"wind": Wind(speed_m_s=5.0, from_deg=20.0), "parameters": parameters},
    ):
        result = check(one, vehicle, **given)  # type: ignore[arg-type]  # each of its own type
        assert [
            f"{f.code} {f.message}" for f in result.findings if f.severity is Severity.ERROR
        ] == []
        assert result.verdict == "go"


@pytest.mark.parametrize("autopilot", FLOWN)
def test_the_same_survey_ten_times_as_long_is_none(autopilot: Autopilot) -> None:
    vehicle, _, _ = FLOWN[autopilot]
    once = survey()
    lines = once.items[2:-1] * 10
    long = mission(*once.items[:2], *(replace(one, jump_id=None) for one in lines), rtl())
    result = check(replace(long, autopilot=autopilot), vehicle)
    assert {"E101", "E104"} & {one.code for one in result.findings}
    assert result.verdict == "no-go"
