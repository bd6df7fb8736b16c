"""Everything a simulated vehicle is and holds before it begins to speak."""

from __future__ import annotations

import struct
import zlib
from itertools import takewhile
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.mission import home_row, lists_of_mission
from planner.link.parameters import PACKED_HEAD, PACKED_KINDS, PACKED_MAGIC
from planner.link.telemetry import AUTOPILOTS, VehicleIdentity
from planner.link.wire import message
from planner.mission.items import Home
from planner.simulator.missions import stored_item
from planner.values import Value, field, replace
from planner.vehicle.parameters.resolve import PARAMETERS_OF
from planner.vehicle.parameters.table import SI_PER_UNIT, parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.link.mission import MissionKind, WireItem
    from planner.link.wire import Message
    from planner.mission.items import Mission
    from planner.physics.wind import Wind
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.table import Parameter, Version


_LONGEST_TEXT = 50
"""Bytes of a STATUSTEXT without chunks."""
QUADROTOR = 2
"""MAV_TYPE_QUADROTOR."""
FIRMWARE = {Autopilot.PX4: (1, 16, 0), Autopilot.ARDUPILOT: (4, 6, 0)}
"""What it reports, where nothing else is asked for."""
SIMULATED_PLACE = Home(latitude_deg=47.397742, longitude_deg=8.545594, altitude_amsl_m=488.0)
"""PX4's usual simulated home, for a mission without one."""


class Misbehaviour(Value):
    """What is wrong with the vehicle itself, and not with the line."""

    count_error: int = 0
    """Added to every MISSION_COUNT that it sends."""
    has_files: bool = True
    """Whether it knows the file protocol."""
    has_terrain: bool = True
    """Whether it has the terrain around it and its mission (ArduPilot)."""
    has_twin: bool = False
    """Whether a second vehicle with the same system id, but another uid, is on the line."""
    rejection: str = ""
    """Sent as STATUSTEXT after every upload that was accepted: the mission is not flown."""
    event: str = ""
    """The same as the event of a name (PX4)."""


class StoredLog(Value):
    """A log file on the vehicle."""

    path: str
    """Where MAVFTP has it: ``/APM/LOGS/00000001.BIN``."""
    content: bytes
    time_utc_s: int
    """When it was written, since 1970. [s]"""


class VehicleSetup(Value):
    """A vehicle at its home."""

    autopilot: Autopilot
    """PX4 or ArduPilot's Copter."""
    lists: Mapping[MissionKind, tuple[WireItem, ...]]
    """As it sends them."""
    home: Home
    parameters: tuple[VehicleParameter, ...] = ()
    logs: tuple[StoredLog, ...] = ()
    """The first is the oldest."""
    wind: Wind | None = None
    """What it takes the wind to be; ``None``: it sends no estimate."""
    system: int = 1
    component: int = 1
    version: tuple[int, int, int] = (1, 16, 0)
    uid: bytes = field(default=b"mavjoule simulated")
    """The 18 bytes of ``uid2``."""
    misbehaviour: Misbehaviour = field(default_factory=Misbehaviour)

    @property
    def home_slot(self) -> WireItem:
        """The first item of an ArduPilot mission."""
        return home_row(self.home)

    @property
    def first_item(self) -> int:
        """Sequence number of the first item that is flown."""
        return int(self.autopilot is Autopilot.ARDUPILOT)

    @property
    def identity(self) -> VehicleIdentity:
        """What a ground station makes of it."""
        return identity_of(self.autopilot, self.system, self.version)

    def text(self, severity: int, text: str) -> Message:
        """Return a STATUSTEXT of at most 50 bytes, which is all that one has room for."""
        return self.texts(severity, text)[0]

    def texts(self, severity: int, text: str) -> tuple[Message, ...]:
        """Return a text of any length, in as many chunks as it takes."""
        content = text.encode("ascii", errors="replace").decode()
        chunks = [
            content[start : start + _LONGEST_TEXT]
            for start in range(0, max(len(content), 1), _LONGEST_TEXT)
        ]
        # The same number makes one text of several chunks; 0 means that there is only one.
        number = 0 if len(chunks) == 1 else zlib.crc32(text.encode()) % 65_535 + 1
        return tuple(
            message("STATUSTEXT", severity=severity, text=chunk, id=number, chunk_seq=sequence)
            for sequence, chunk in enumerate(chunks)
        )


def identity_of(
    autopilot: Autopilot, system: int = 1, version: tuple[int, int, int] | None = None
) -> VehicleIdentity:
    """Return what a ground station makes of a simulated vehicle."""
    numbers = {known: number for number, known in AUTOPILOTS.items()}
    return VehicleIdentity(
        system=system,
        component=1,
        autopilot_number=numbers[autopilot],
        vehicle_type=QUADROTOR,
        firmware_version=version,
    )


def make_setup(
    mission: Mission,
    autopilot: Autopilot,
    *,
    home: Home | None = None,
    parameters: tuple[VehicleParameter, ...] = (),
    system: int = 1,
    version: tuple[int, int, int] | None = None,
) -> VehicleSetup:
    """Return a vehicle onto which a mission was uploaded.

    It is at its home: the one given, else the mission's own, else the mission's first place.
    `UsageError` where an item cannot be sent as it is.
    """
    place = home or mission.home or _first_place(mission) or SIMULATED_PLACE
    if place.altitude_amsl_m is None:
        place = replace(place, altitude_amsl_m=0.0)
    version = version or FIRMWARE[autopilot]
    lists = lists_of_mission(replace(mission, home=place), identity_of(autopilot, system, version))
    return VehicleSetup(
        autopilot=autopilot,
        lists={
            kind: tuple(stored_item(item, kind, autopilot) for item in items)
            for kind, items in lists.items()
        },
        home=place,
        parameters=parameters,
        system=system,
        version=version,
        uid=_uid(autopilot, system),
    )


def _first_place(mission: Mission) -> Home | None:
    for item in mission.items:
        if item.latitude_deg and item.longitude_deg:
            return Home(item.latitude_deg, item.longitude_deg, None)
    return None


def _uid(autopilot: Autopilot, system: int) -> bytes:
    """Return 18 bytes that are the same for every run, and different for every vehicle."""
    seed = f"mavjoule {autopilot} {system}".encode()
    words = b"".join(zlib.crc32(seed, start).to_bytes(4, "little") for start in range(5))
    return words[:18]


INT16, INT32, REAL32 = 4, 6, 9
"""MAV_PARAM_TYPE."""
_MAH_PER_AH = 1000.0
_EXTRAS: Mapping[Autopilot, Mapping[str, float]] = {
    Autopilot.PX4: {
        "MAV_SYS_ID": 1,
        "SYS_AUTOSTART": 4001,
        # Whether arming is asked for, of whom, how, and how long it waits for the answer [s].
        "COM_ARM_AUTH_REQ": 0,
        "COM_ARM_AUTH_ID": 10,
        "COM_ARM_AUTH_MET": 0,
        "COM_ARM_AUTH_TO": 1.0,
    },
    Autopilot.ARDUPILOT: {"SYSID_THISMAV": 1, "FRAME_CLASS": 1, "FRAME_TYPE": 1},
}
"""Parameters beyond those of missions, whole where their value is."""
_SYSTEM_ID = {Autopilot.PX4: "MAV_SYS_ID", Autopilot.ARDUPILOT: "SYSID_THISMAV"}


class VehicleParameter(Value):
    """One parameter, in the unit of its autopilot."""

    name: str
    value: float
    kind: int = REAL32
    """MAV_PARAM_TYPE."""

    def sent_value(self, autopilot: Autopilot) -> float:
        """Return the value as PARAM_VALUE has it: PX4 sends whole numbers byte for byte."""
        if autopilot is Autopilot.PX4 and self.kind == INT32:
            content = struct.pack("<i", int(self.value))
            return float(struct.unpack("<f", content)[0])
        return self.value


def make_parameters(
    autopilot: Autopilot,
    version: Version,
    *,
    given: Mapping[str, float] | None = None,
    battery: Battery | None = None,
    system: int = 1,
    authoriser: int | None = None,
) -> tuple[VehicleParameter, ...]:
    """Return an autopilot's parameters, sorted by name.

    Names and units differ by the version of the firmware.  What is given are values other than the
    defaults, and parameters beyond those of missions.  The authoriser is the system id of who is asked
    before it arms; default nobody (PX4 alone).
    """
    rows = parameter_table(PARAMETERS_OF[autopilot]).values()
    whole = INT32 if autopilot is Autopilot.PX4 else INT16
    defaults = (_default(row, version, whole=whole) for row in rows)
    found = {one.name: one for one in defaults}
    for name, value in _EXTRAS[autopilot].items():
        kind = whole if isinstance(value, int) else REAL32
        found[name] = VehicleParameter(name=name, value=value, kind=kind)
    values: dict[str, float] = {
        _SYSTEM_ID[autopilot]: system,
        **_battery_values(autopilot, battery),
    }
    if authoriser is not None and autopilot is Autopilot.PX4:
        values |= {"COM_ARM_AUTH_REQ": 1, "COM_ARM_AUTH_ID": authoriser}
    for name, value in {**values, **(given or {})}.items():
        known = found.get(name, VehicleParameter(name=name, value=value))
        found[name] = replace(known, value=value)
    return tuple(found[name] for name in sorted(found))


_PACKET = 239
"""A value is never cut by the end of a packet that is read. [B]"""


def packed_parameters(parameters: tuple[VehicleParameter, ...]) -> bytes:
    """Return the parameters as ArduPilot packs them into a file."""
    kinds = {kind: (number, layout) for number, (kind, layout) in PACKED_KINDS.items()}
    count, before = len(parameters), b""
    content = bytearray(PACKED_HEAD.pack(PACKED_MAGIC, count, count))
    for one in parameters:
        name, (number, layout) = one.name.encode(), kinds[one.kind]
        same = takewhile(lambda pair: pair[0] == pair[1], zip(name, before, strict=False))
        common = min(sum(1 for _ in same), len(name) - 1)
        size = struct.calcsize(layout)
        over = (len(content) + 2 + len(name) - common + size) % _PACKET
        content += bytes(size - over if 0 < over < size else 0)
        content += bytes([number, common | (len(name) - common - 1) << 4]) + name[common:]
        content += struct.pack(layout, one.value if layout == "<f" else int(one.value))
        before = name
    return bytes(content)


def parameter_values(parameters: Iterable[VehicleParameter]) -> dict[str, float]:
    """Return the values by name."""
    return {one.name: one.value for one in parameters}


def _default(row: Parameter, version: Version, *, whole: int) -> VehicleParameter:
    spelling = row.spelling_of(version)
    value = row.default_of(version) * SI_PER_UNIT[row.now.unit] / SI_PER_UNIT[spelling.unit]
    kind = whole if row.is_choice else REAL32
    return VehicleParameter(name=spelling.name, value=round(value, 6), kind=kind)


def _battery_values(autopilot: Autopilot, battery: Battery | None) -> dict[str, float]:
    if battery is None or battery.charge_ah is None:
        return {}
    capacity_mah = round(battery.charge_ah * _MAH_PER_AH)
    if autopilot is Autopilot.ARDUPILOT:
        return {"BATT_CAPACITY": capacity_mah}
    cells = {} if battery.cells_in_series is None else {"BAT1_N_CELLS": battery.cells_in_series}
    return {"BAT1_CAPACITY": capacity_mah, **cells}
