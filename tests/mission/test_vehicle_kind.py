from __future__ import annotations

import pytest
from made_missions import mission, rtl, takeoff, waypoint

from planner.findings import Severity
from planner.mission.items import MissionItem, VehicleEvidence, VehicleKind
from planner.mission.route.route import make_route
from planner.mission.vehicle_kind import vehicle_evidence
from planner.values import replace


def make_item(
    command: int,
    *,
    param1: float = 0.0,
    altitude_m: float = 20.0,
    frame: int = 3,
    latitude_deg: float = 47.0,
) -> MissionItem:
    return MissionItem(
        command=command,
        frame=frame,
        param1=param1,
        param2=0.0,
        param3=0.0,
        param4=None,
        latitude_deg=latitude_deg,
        longitude_deg=8.0,
        altitude_m=altitude_m,
    )


def tell(*items: MissionItem, home_altitude_amsl_m: float | None = None) -> VehicleEvidence | None:
    return vehicle_evidence(items, home_altitude_amsl_m=home_altitude_amsl_m)


TAKEOFF, WAYPOINT, RTL = (make_item(command) for command in (22, 16, 20))
LAND = make_item(21, latitude_deg=47.0005)  # 56 m from the waypoint
LAND_HERE = make_item(21, latitude_deg=47.0004)  # 44 m
PITCHED = make_item(22, param1=15.0)
LAND_START = make_item(189)


@pytest.mark.parametrize(
    ("vehicle_type", "kind"),
    [
        (1, VehicleKind.FIXED_WING),
        (2, VehicleKind.MULTICOPTER),
        (10, VehicleKind.ROVER),
        (11, VehicleKind.BOAT),
        (12, VehicleKind.SUBMARINE),
        (13, VehicleKind.MULTICOPTER),
        (14, VehicleKind.MULTICOPTER),
        (15, VehicleKind.MULTICOPTER),
        (19, VehicleKind.VTOL),
        (25, VehicleKind.VTOL),
        (7, VehicleKind.OTHER),
    ],
)
def test_the_plans_own_word_is_certain(vehicle_type: int, kind: VehicleKind) -> None:
    evidence = vehicle_evidence([make_item(84)], vehicle_type=vehicle_type)
    assert evidence is not None
    assert (evidence.kind, evidence.is_certain) == (kind, True)
    assert f"vehicleType {vehicle_type}" in evidence.reason


@pytest.mark.parametrize("vehicle_type", [3, 4])
def test_a_helicopter_is_flown_with_a_warning(vehicle_type: int) -> None:
    # MAV_TYPE 3 and 4: the autopilots fly its missions alike, the power is another.
    plan = replace(mission(takeoff(20), waypoint(100, 20), rtl()), vehicle=None)
    evidence = vehicle_evidence(plan.items, vehicle_type=vehicle_type)
    found = make_route(replace(plan, vehicle=evidence)).findings
    assert [f.severity for f in found if f.code == "M111"] == [Severity.WARNING]


def test_a_generic_vehicle_type_says_nothing() -> None:
    assert vehicle_evidence([TAKEOFF, WAYPOINT], vehicle_type=0) is None


@pytest.mark.parametrize(
    ("command", "kind"),
    [
        (84, VehicleKind.VTOL),
        (85, VehicleKind.VTOL),
        (3000, VehicleKind.VTOL),
        (30, VehicleKind.FIXED_WING),
        (83, VehicleKind.FIXED_WING),
        (191, VehicleKind.FIXED_WING),
        (210, VehicleKind.FIXED_WING),
        (194, VehicleKind.ROVER),
        (213, VehicleKind.ROVER),
    ],
)
def test_a_command_that_only_one_kind_knows_is_certain(command: int, kind: VehicleKind) -> None:
    evidence = tell(WAYPOINT, make_item(command), WAYPOINT)
    assert evidence is not None
    assert (evidence.kind, evidence.is_certain) == (kind, True)
    assert evidence.reason.startswith("item 2 is ")


def test_a_pitched_takeoff_and_a_landing_approach_together_are_a_fixed_wing() -> None:
    evidence = tell(PITCHED, WAYPOINT, LAND_START, WAYPOINT, LAND)
    assert evidence is not None
    assert (evidence.kind, evidence.is_certain) == (VehicleKind.FIXED_WING, True)


def test_a_take_off_pitch_alone_is_weak_evidence() -> None:
    alone, approach = tell(PITCHED, WAYPOINT, LAND), tell(TAKEOFF, LAND_START, WAYPOINT, LAND)
    assert alone is not None
    assert approach is not None
    assert (alone.is_weak, approach.is_weak) == (True, False)


@pytest.mark.parametrize(
    "items", [(PITCHED, WAYPOINT), (PITCHED, WAYPOINT, LAND), (TAKEOFF, LAND_START, WAYPOINT, LAND)]
)
def test_one_of_the_two_is_probable_only(items: tuple[MissionItem, ...]) -> None:
    evidence = tell(*items)
    assert evidence is not None
    assert (evidence.kind, evidence.is_certain) == (VehicleKind.FIXED_WING, False)


@pytest.mark.parametrize(
    "items",
    [
        (TAKEOFF, WAYPOINT, RTL),
        (TAKEOFF, WAYPOINT, LAND),
        (PITCHED, WAYPOINT, RTL),
        (PITCHED, WAYPOINT, LAND_HERE),
        (make_item(22, param1=20.0, altitude_m=30.0), WAYPOINT),
        (make_item(22, param1=1.0), WAYPOINT, LAND),
        (TAKEOFF, LAND_START, WAYPOINT, RTL),
        (TAKEOFF, make_item(18), make_item(31), LAND),
        (TAKEOFF, make_item(16, altitude_m=0.0), make_item(16, altitude_m=0.0)),
        (TAKEOFF, make_item(16, altitude_m=-5.0), make_item(16, altitude_m=-5.0), RTL),
        (WAYPOINT, WAYPOINT),
        (make_item(16, altitude_m=0.0),),
        (),
    ],
)
def test_what_a_multicopter_may_fly_tells_nothing(items: tuple[MissionItem, ...]) -> None:
    assert tell(*items) is None


def test_places_on_the_ground_without_a_takeoff_are_a_rover() -> None:
    ground = make_item(16, altitude_m=0.0)
    evidence = tell(ground, ground)
    assert evidence is not None
    assert (evidence.kind, evidence.is_certain) == (VehicleKind.ROVER, True)


def test_places_below_home_without_a_takeoff_are_a_submarine() -> None:
    evidence = tell(make_item(16, altitude_m=-5.0), make_item(16, altitude_m=0.0))
    assert evidence is not None
    assert (evidence.kind, evidence.is_certain) == (VehicleKind.SUBMARINE, True)


def test_amsl_altitudes_below_the_sea_and_home_are_a_submarine() -> None:
    dive = make_item(16, altitude_m=-25.0, frame=0)
    evidence = tell(dive, dive, home_altitude_amsl_m=0.0)
    assert evidence is not None
    assert evidence.kind is VehicleKind.SUBMARINE


@pytest.mark.parametrize(
    ("altitude_amsl_m", "home_altitude_amsl_m"), [(50.0, 386.0), (-380.0, -430.0), (200.0, 200.0)]
)
def test_amsl_altitudes_over_land_tell_nothing(
    altitude_amsl_m: float, home_altitude_amsl_m: float
) -> None:
    item = make_item(16, altitude_m=altitude_amsl_m, frame=0)
    assert tell(item, item, home_altitude_amsl_m=home_altitude_amsl_m) is None
