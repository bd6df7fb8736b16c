"""Loads that ArduPilot does not set down: tried on ArduCopter 4.7.0-dev in simulation, but for their fix."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.link.snapshot import VehicleReading, make_snapshot, parameter_set
from planner.link.telemetry import VehicleIdentity, VehicleState
from planner.service.preflight import check
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.mission.items import MissionItem
    from planner.service.preflight import CheckResult

COPTER = load_vehicle("arducopter-sitl-quad")
BUILD = "# Version: 4.7.0 dev\n"
"""As QGroundControl and ``mavjoule fetch`` write it."""


def place(metres_north: float, altitude_m: float = 0.0, most_m: float = 0.0) -> MissionItem:
    return item(94, north(metres_north), altitude_m, params=(most_m, 0.0, 0.0, 0.0))


def gripper(action: float) -> MissionItem:
    return item(211, frame=2, params=(1.0, action, 0.0, 0.0))


RELEASE, GRAB = gripper(0.0), gripper(1.0)


def checked(*items: MissionItem, parameters: str = "") -> CheckResult:
    return check(
        mission(takeoff(20), *items, rtl(), autopilot=Autopilot.ARDUPILOT),
        COPTER,
        battery=Battery(capacity_wh=170.0),
        parameters=parameters_from_text(parameters.encode(), source="p.param")
        if parameters
        else None,
    )


def found(*items: MissionItem, parameters: str = "") -> list[Finding]:
    return [one for one in checked(*items, parameters=parameters).findings if one.code == "T122"]


def test_a_load_is_set_down_where_the_ground_is_near_enough() -> None:
    assert found(place(60)) == found(place(60, 10.0, 25.0)) == found(place(60, 20.0, 20.5)) == []


@pytest.mark.parametrize("altitude_m", [0.0, 20.0])
def test_a_vehicle_gives_up_by_its_own_height_whatever_the_item_s(altitude_m: float) -> None:
    # Flown: "Reached maximum descent" 5.0 m below the 20 m it was at, with the item at 0 m as at 20 m.
    result = checked(place(60, altitude_m, 5.0))
    [error] = [one for one in result.findings if one.code == "T122"]
    assert (error.severity, error.item) == (Severity.ERROR, 2)
    assert "gives up 5.0 m down, where the ground is 20 m below" in error.message
    assert result.verdict == "no-go"
    # LAND_SPEED 0.5 m/s, reached after 0.5 s at 1 m/s² in 0.125 m; nothing to wait for.
    placing = [
        one for one in result.segments if one.item == 2 and one.state in {"descend", "hover"}
    ]
    assert placing[0].duration_s == pytest.approx(0.5 + 4.875 / 0.5)
    assert placing[0].climb_m == pytest.approx(-5.0)
    assert sum(one.duration_s for one in placing[1:]) == 0.0


def test_a_load_is_let_go_at_the_ground_half_a_second_after_it_stands() -> None:
    # Flown: 47.22 s from the place 20 m before to the ground, by 0.5 m/s from 20 m, and 0.52 s later
    # "payload release"; the corner into the leg is announced in its middle.
    segments = [one for one in checked(waypoint(40, 20), place(60)).segments if one.item == 3]
    (hover,) = [one for one in segments if one.state == "hover"]
    assert hover.duration_s == pytest.approx(0.5)
    assert hover.start_s - segments[0].start_s == pytest.approx(47.22, abs=0.3)


def test_pldp_rng_max_asks_for_a_rangefinder() -> None:
    # Flown: "PLDP_RNG_MAX set and rangefinder not enabled" at the ground, and nothing is released.
    [error] = found(place(60), parameters="PLDP_RNG_MAX,2")
    assert error.severity is Severity.ERROR
    assert "no rangefinder looks down" in error.message
    assert found(place(60), parameters="PLDP_RNG_MAX,0\nRNGFND1_TYPE,0") == []
    assert found(place(60), parameters="PLDP_RNG_MAX,2\nRNGFND1_TYPE,10") == []
    assert found(place(60), parameters="PLDP_RNG_MAX,2\nRNGFND1_TYPE,10\nRNGFND1_ORIENT,24")


@pytest.mark.parametrize(
    ("items", "skipped"),
    [
        # Flown: with the gripper never moved, and grabbed, it is let go at the ground; released before,
        # "Abort: Gripper Open", and the next item begins.
        ((place(60),), []),
        ((GRAB, place(60)), []),
        ((waypoint(40, 20), RELEASE, place(60)), [4]),
        ((RELEASE, GRAB, place(60)), []),
        ((place(60), place(90)), [3]),
        ((place(60), GRAB, place(90), place(120)), [5]),
    ],
)
def test_an_open_gripper_has_nothing_to_place(
    items: tuple[MissionItem, ...], skipped: list[int]
) -> None:
    errors = found(*items, parameters="GRIP_ENABLE,1")
    assert [one.item for one in errors] == skipped
    assert all(one.severity is Severity.ERROR for one in errors)
    assert found(*items, parameters="GRIP_ENABLE,0") == []
    assert found(*items, parameters="GRIP_ENABLE,1\nGRIP_AUTOCLOSE,5") == []
    perhaps = found(*items)
    assert [one.item for one in perhaps] == skipped
    assert all(one.severity is Severity.WARNING for one in perhaps)


def test_builds_on_the_way_to_4_7_are_not_checked() -> None:
    # Flown: it hit the ground at 1.5 m/s from 15 m, and disarmed there.
    [error] = found(place(60), parameters=f"{BUILD}WPNAV_SPEED,1000")
    assert error.severity is Severity.ERROR
    assert "not checked" in error.message
    for header in ("# Version: 4.7.0\n", "# Version: 4.8.0 dev\n", "# Version: 4.7.0 rc\n", ""):
        assert found(place(60), parameters=f"{header}WP_SPD,10") == [], header
    assert found(waypoint(60, 20), parameters=f"{BUILD}WPNAV_SPEED,1000") == []


@pytest.mark.parametrize("release", ["dev", "rc", ""])
def test_a_build_on_the_line_says_whether_it_is_one(release: str) -> None:
    identity = VehicleIdentity(
        system=1,
        component=1,
        autopilot_number=3,
        vehicle_type=2,
        firmware_version=(4, 7, 0),
        firmware_release=release,
    )
    reading = VehicleReading(state=VehicleState(), lists={}, parameters=())
    parameters = parameter_set(make_snapshot(identity, reading, address="tcp:127.0.0.1:5760"))
    assert (parameters.is_development, parameters.version) == (release == "dev", (4, 7))
