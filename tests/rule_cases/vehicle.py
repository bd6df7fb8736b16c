"""Families V and X: the vehicle on the line, and what the tool itself cannot do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from made_terrain import ground
from rule_cases.case import PLAIN, RuleCases, found
from virtual_vehicle import wire_item

from planner.link.mission import MissionKind
from planner.link.parameters import WireParameter
from planner.link.snapshot import VehicleReading, make_snapshot
from planner.link.telemetry import BatteryState, VehicleIdentity, VehicleState
from planner.mission.files import read_mission_bytes
from planner.mission.items import Home
from planner.service.preflight import check_read
from planner.service.upload import check_removal
from planner.service.vehicle import check_vehicle
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding
    from planner.link.mission import WireItem

HOME = Home(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=400.0)
FLIGHT = (wire_item(command=22), wire_item(x=470_010_000), wire_item(command=20, frame=2, x=0, y=0))
_PX4, _ARDUPILOT = 12, 3
LINEAR = Battery(capacity_ah=8.0, cells_in_series=6, ocv_soc=(0.0, 1.0), ocv_v=(19.8, 25.2))
"""90 % at 24.66 V, which 24.416 V are with 1 %."""


def reported(
    *names: str,
    home: Home | None = HOME,
    charge: float | None = None,
    first_x: int = 470_000_000,
    autopilot: int = _PX4,
    given: float | None = None,
    voltage_v: float | None = None,
    setup: Mapping[str, Any] | None = None,
    **without: bool,
) -> tuple[Finding, ...]:
    """Return what is reported of a vehicle with such parameters, home, charge and lists."""
    home_slot = (wire_item(frame=0, x=first_x, y=0 if first_x == 0 else 80_000_000),)
    items = (home_slot if autopilot == _ARDUPILOT else ()) + FLIGHT
    snapshot = make_snapshot(
        VehicleIdentity(system=1, component=1, autopilot_number=autopilot, vehicle_type=2),
        VehicleReading(
            state=VehicleState(
                home=home,
                battery=BatteryState(remaining_fraction=charge, voltage_v=voltage_v),
                is_armed=False,
            ),
            lists={
                kind: None if without.get(kind.name.lower()) else items if not kind else ()
                for kind in MissionKind
            },
            parameters=tuple(
                WireParameter(name=name, value=1.0, content=bytes(4), kind=9) for name in names
            ),
        ),
        address="udpin:127.0.0.1:14550",
    )
    own = Setup(load_vehicle(), charge=1.0 if given is None else given, **(setup or {}))
    return check_vehicle(snapshot, own, is_charge_given=given is not None).findings


def over_terrain(pending: int | None) -> tuple[Finding, ...]:
    """Return what is reported of a vehicle that waits for so many blocks of terrain."""
    items = tuple(replace(item, frame=10) if item.command == 16 else item for item in FLIGHT)
    snapshot = make_snapshot(
        VehicleIdentity(system=1, component=1, autopilot_number=_ARDUPILOT, vehicle_type=2),
        VehicleReading(
            state=VehicleState(),
            lists={kind: (FLIGHT[0], *items) if not kind else () for kind in MissionKind},
            parameters=(),
        ),
        address="udpin:127.0.0.1:14550",
    )
    return check_vehicle(replace(snapshot, terrain_pending=pending), Setup(load_vehicle())).findings


def removed(kind: MissionKind, *areas: WireItem) -> tuple[Finding, ...]:
    """Return what is reported before a mission without areas takes the place of one with them."""
    lists = {one: areas if one is kind else FLIGHT if not one else () for one in MissionKind}
    snapshot = make_snapshot(
        VehicleIdentity(system=1, component=1, autopilot_number=_PX4, vehicle_type=2),
        VehicleReading(state=VehicleState(), lists=lists, parameters=()),
        address="udpin:127.0.0.1:14550",
    )
    return check_removal(replace(snapshot.mission, fence=None, rally=()), snapshot)


def read(data: bytes) -> tuple[Finding, ...]:
    """Return what a check tells of a file that holds these bytes."""
    return check_read(
        lambda: read_mission_bytes(data, source="a.plan"), Setup(load_vehicle()), file="a.plan"
    ).findings


CASES: Mapping[str, RuleCases] = {
    "V101": RuleCases(
        fires=lambda: reported(charge=0.5),
        boundary=lambda: reported(home=None),  # nothing of its own is taken
        silent=lambda: found(PLAIN),
    ),
    "V102": RuleCases(
        fires=reported,
        boundary=lambda: reported(charge=0.0),  # an empty one says so
        silent=lambda: reported(charge=0.5),
    ),
    "V103": RuleCases(
        fires=lambda: reported(home=None, first_x=0, autopilot=_ARDUPILOT),
        boundary=lambda: reported(home=None, first_x=1, autopilot=_ARDUPILOT),
        silent=reported,
    ),
    "V104": RuleCases(
        fires=lambda: reported(rally=True),
        boundary=reported,  # kept and empty
        silent=lambda: reported(charge=0.5),
    ),
    "V105": RuleCases(
        fires=lambda: reported("ABCDEFGHIJKLMNOPQ"),
        boundary=lambda: reported("ABCDEFGHIJKLMNOP"),  # 16 characters
        silent=lambda: reported("RTL_ALT"),
    ),
    "V106": RuleCases(
        fires=lambda: removed(MissionKind.FENCE, wire_item(command=5003, param1=99.0)),
        boundary=lambda: removed(MissionKind.FENCE),  # it keeps a list, and nothing is in it
        silent=reported,
    ),
    "V107": RuleCases(
        fires=lambda: removed(MissionKind.RALLY, wire_item(command=5100)),
        boundary=lambda: removed(MissionKind.RALLY),
        silent=reported,
    ),
    "V108": RuleCases(
        fires=lambda: reported("BATT_CAPACITY", charge=0.5, autopilot=_ARDUPILOT),
        boundary=lambda: reported("BATT2_CAPACITY", charge=0.5, autopilot=_ARDUPILOT),
        silent=reported,
    ),
    "V109": RuleCases(
        fires=lambda: reported(charge=0.79, given=0.9),
        boundary=lambda: reported(charge=0.8, given=0.9),
        silent=lambda: reported(charge=0.79),
    ),
    "V110": RuleCases(
        fires=lambda: reported(setup={"home_amsl_m": 400.51}),
        boundary=lambda: reported(setup={"home_amsl_m": 400.5}),
        silent=lambda: reported(home=None, setup={"home_amsl_m": 500.0}),
    ),
    "V115": RuleCases(
        fires=lambda: reported(charge=1.0, voltage_v=24.41, setup={"battery": LINEAR}),
        boundary=lambda: reported(charge=1.0, voltage_v=24.42, setup={"battery": LINEAR}),
        silent=lambda: reported(charge=0.5, voltage_v=24.41, setup={"battery": LINEAR}),
    ),
    "X901": RuleCases(
        fires=lambda: read(b"{"),
        boundary=lambda: read(b'{"mission": {"items": []}}'),
        silent=lambda: read(
            b"QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1\n1\t0\t3\t22\t0\t0\t0\t0\t47\t8\t30\t1\n"
        ),
    ),
    "X910": RuleCases(
        fires=lambda: over_terrain(1),
        boundary=lambda: over_terrain(0),
        silent=lambda: over_terrain(None),
    ),
    "X902": RuleCases(
        fires=lambda: found(PLAIN),
        boundary=lambda: found(PLAIN, terrain=ground(0.0, rows=112)),  # up to 110 m north of home
        silent=lambda: found(PLAIN, terrain=ground(0.0)),
    ),
}
