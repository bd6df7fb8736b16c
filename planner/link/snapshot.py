"""Everything of a vehicle at once: read, and written as a plan and a parameter file."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.fetched import FetchMark
from planner.findings import Rule, Severity
from planner.link.mission import MissionKind, mission_of_lists, shortest
from planner.mission.commands import TERRAIN_FRAMES
from planner.values import Value, replace
from planner.vehicle.parameters.files import ParameterSet, ParameterValue

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from planner.findings import Finding
    from planner.link.mission import WireItem
    from planner.link.parameters import WireParameter
    from planner.link.telemetry import BatteryState, VehicleIdentity, VehicleState
    from planner.link.vehicle import VehicleLink
    from planner.mission.items import Mission, MissionItem

_LONG_MISSION = 160
"""Items that the smallest storage holds beside home."""
_CAPACITIES_MAH = ("BATT_CAPACITY", "BAT1_CAPACITY", "BAT_CAPACITY")
_NAME = re.compile(r"[A-Z][A-Z0-9_]{0,15}", re.ASCII)
_STACKS = {Autopilot.PX4: "PX4 Pro", Autopilot.ARDUPILOT: "ArduPilot"}
"""As QGroundControl names them in a parameter file."""


class VehicleReading(Value):
    """What was read of a vehicle, as it came."""

    state: VehicleState
    lists: Mapping[MissionKind, tuple[WireItem, ...] | None]
    """Items by kind, ``None`` where the vehicle keeps no such list."""
    parameters: tuple[WireParameter, ...]


class VehicleSnapshot(Value):
    """Everything that was read from a vehicle."""

    address: str
    """The normalised address."""
    identity: VehicleIdentity
    state: VehicleState
    mission: Mission
    """Mission, fence and rally points, home as the vehicle has it."""
    parameters: tuple[WireParameter, ...]
    storage_b: int | None = None
    """Storage of ArduPilot's for parameters and lists, where it was asked for. [B]"""
    terrain_pending: int | None = None
    """Blocks of terrain that ArduPilot waits for; ``None`` where it was not asked, or has none. [-]"""
    findings: tuple[Finding, ...] = ()


def read_vehicle(link: VehicleLink) -> VehicleReading:
    """Return everything that a vehicle reports; `LinkError` names where a transfer stalls."""
    return VehicleReading(
        state=link.fetch_state(),
        lists={kind: link.fetch_items(kind) for kind in MissionKind},
        parameters=link.fetch_parameters(),
    )


def fetch_snapshot(link: VehicleLink, mission: Mission | None = None) -> VehicleSnapshot:
    """Return everything that a vehicle reports, put together.

    Of ArduPilot, also what matters to a mission, by default its own: whether it has the terrain that
    heights are counted from, and where the mission is long, room for it.
    """
    snapshot = make_snapshot(link.identity, read_vehicle(link), address=link.connection.name)
    return with_limits(snapshot, link, (snapshot.mission if mission is None else mission).items)


def with_limits(
    snapshot: VehicleSnapshot, link: VehicleLink, items: Sequence[MissionItem]
) -> VehicleSnapshot:
    """Return a snapshot with what it takes to hold and to fly such items, of ArduPilot's vehicles."""
    if not link.identity.has_home_slot:
        return snapshot
    storage_b = link.fetch_storage_b() if len(items) >= _LONG_MISSION else None
    is_over_terrain = any(item.frame in TERRAIN_FRAMES for item in items)
    terrain_pending = link.fetch_terrain_pending() if is_over_terrain else None
    return replace(snapshot, storage_b=storage_b, terrain_pending=terrain_pending)


HOME_NOT_TOLD = Rule(
    "V103 home-not-told",
    Severity.WARNING,
    summary="The vehicle has no home yet.",
    why="Heights above home and the way back are judged from the home of the mission's first place; "
    "the vehicle sets its own when it has a position fix, or when it is armed.",
    how="HOME_POSITION does not come, and ArduPilot's first mission item is at 0°, 0°.",
    fix="wait for a position fix and fetch again",
)

LIST_NOT_KEPT = Rule(
    "V104 list-not-kept",
    Severity.INFO,
    summary="The vehicle keeps no fence, or no rally points.",
    why="A fence that is not on the vehicle does not hold it.",
    how="The vehicle answers MISSION_REQUEST_LIST for this list with UNSUPPORTED.",
    fix="use a firmware that was built with them",
)

PARAMETER_NAMELESS = Rule(
    "V105 parameter-nameless",
    Severity.WARNING,
    summary="Parameters were received under invalid names.",
    why="Their meaning is unknown, and no file can hold them.",
    how="A name has 1 to 16 capital letters, digits and underscores, and begins with a letter.",
    fix="fetch again; if it stays so, something other than an autopilot answers",
)


def make_snapshot(
    identity: VehicleIdentity, reading: VehicleReading, *, address: str
) -> VehicleSnapshot:
    """Return what was read of a vehicle, put together; `MavjouleError` where it is no mission."""
    state, lists, fetched = reading.state, reading.lists, reading.parameters
    parameters = tuple(one for one in fetched if _NAME.fullmatch(one.name))
    home = None if state.home is None else state.home_at_arming
    mission = mission_of_lists(lists, identity, home=home, source=address)
    findings: list[Finding] = [
        LIST_NOT_KEPT.finding(f"the vehicle stores no {kind.label}: its firmware lacks such a list")
        for kind, items in lists.items()
        if items is None
    ]
    if len(parameters) < len(fetched):
        nameless = len(fetched) - len(parameters)
        message = f"without a readable name, left out: {quantity.count(nameless, 'parameter')}"
        findings.append(PARAMETER_NAMELESS.finding(message))
    if mission.home is None:
        findings.append(HOME_NOT_TOLD.finding("the vehicle has no home yet"))
    battery = _with_capacity(state.battery, identity, parameters)
    return VehicleSnapshot(
        address=address,
        identity=identity,
        state=replace(state, home=state.home or mission.home, battery=battery),
        mission=mission,
        parameters=parameters,
        findings=tuple(findings),
    )


def parameter_set(snapshot: VehicleSnapshot) -> ParameterSet:
    """Return a vehicle's parameters as a check takes them."""
    identity = snapshot.identity
    version = identity.firmware_version
    return ParameterSet(
        source=snapshot.address,
        values={
            one.name: ParameterValue(shortest(one.number(is_bytewise=identity.is_bytewise)))
            for one in snapshot.parameters
        },
        stack=identity.autopilot,
        storage_b=snapshot.storage_b,
        version=None if version is None else version[:2],
        is_development=identity.firmware_release == "dev",
    )


def fetch_mark(snapshot: VehicleSnapshot, time: str) -> FetchMark:
    """Return the mark of what was read at a time, in UTC."""
    return FetchMark.of(time, snapshot.identity.uid, dict(_shown(snapshot)))


def parameter_text(snapshot: VehicleSnapshot, mark: FetchMark) -> str:
    """Return a vehicle's parameters as QGroundControl writes them to a file."""
    identity = snapshot.identity
    lines = [f"# Onboard parameters for Vehicle {identity.system}", "#"]
    if identity.autopilot is not None:
        lines.append(f"# Stack: {_STACKS[identity.autopilot]}")
    if identity.firmware_version is not None:
        number = ".".join(map(str, identity.firmware_version))
        lines.append(f"# Version: {number} {identity.firmware_release}".rstrip())
    if identity.firmware_hash.strip("0"):
        lines.append(f"# Git Revision: {identity.firmware_hash}")
    lines += [mark.comment, "#", "# Vehicle-Id Component-Id Name Value Type"]
    for one, (name, shown) in zip(snapshot.parameters, _shown(snapshot), strict=True):
        lines.append(f"{identity.system}\t{identity.component}\t{name}\t{shown}\t{one.kind}")
    return "\n".join(lines) + "\n"


def _shown(snapshot: VehicleSnapshot) -> Iterator[tuple[str, str]]:
    """Yield name and value of each parameter as a file has them."""
    for one in snapshot.parameters:
        value = shortest(one.number(is_bytewise=snapshot.identity.is_bytewise))
        shown = "nan" if value is None else repr(int(value) if one.is_whole else value)
        yield one.name, shown


def _with_capacity(
    battery: BatteryState | None, identity: VehicleIdentity, parameters: tuple[WireParameter, ...]
) -> BatteryState | None:
    if battery is None:
        return None
    values = {one.name: one.number(is_bytewise=identity.is_bytewise) for one in parameters}
    for name in _CAPACITIES_MAH:
        if values.get(name, 0.0) > 0.0:
            return replace(battery, capacity_ah=values[name] / 1e3)
    return battery
