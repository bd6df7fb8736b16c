"""Everything a simulated vehicle is and holds before it begins to speak."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.codec import message
from planner.link.mission_items import lists_of_mission
from planner.link.mission_transfer import WireItem
from planner.link.vehicle import AUTOPILOTS, VehicleIdentity
from planner.mission.items import Home
from planner.simulator.mission_server import stored_item
from planner.values import Value, field, replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.codec import Message
    from planner.link.mission_transfer import MissionKind
    from planner.mission.items import Mission
    from planner.physics.wind import Wind
    from planner.simulator.parameters import VehicleParameter


_LONGEST_TEXT = 50
"""Bytes of a STATUSTEXT without chunks."""
QUADROTOR = 2
"""MAV_TYPE_QUADROTOR."""
FIRMWARE = {Autopilot.PX4: (1, 16, 0), Autopilot.ARDUPILOT: (4, 6, 0)}
"""What it says it flies with, where nothing else is asked for."""
SIMULATED_PLACE = Home(latitude_deg=47.397742, longitude_deg=8.545594, altitude_amsl_m=488.0)
"""PX4's usual simulated home, for a mission that says nothing of home."""


class Misbehaviour(Value):
    """What is wrong with the vehicle itself, and not with the line."""

    count_error: int = 0
    """Added to every MISSION_COUNT that it sends."""
    has_twin: bool = False
    """Whether a second vehicle with the same system id, but another uid, is on the line."""
    rejection: str = ""
    """Said as STATUSTEXT after every upload that was accepted: the mission is not flown."""
    event: str = ""
    """The same as the event of a name (PX4)."""


class VehicleLog(Value):
    """A log file on the vehicle."""

    path: str
    """Where MAVFTP has it: ``/APM/LOGS/00000001.BIN``."""
    content: bytes
    time_utc_s: int
    """When it was written, since 1970. [s]"""


class VehicleSetup(Value):
    """A vehicle as it stands at its home."""

    autopilot: Autopilot
    """PX4 or ArduPilot's Copter."""
    lists: Mapping[MissionKind, tuple[WireItem, ...]]
    """As it sends them."""
    home: Home
    parameters: tuple[VehicleParameter, ...] = ()
    logs: tuple[VehicleLog, ...] = ()
    wind: Wind | None = None
    """``None``: it sends no estimate."""
    system: int = 1
    component: int = 1
    version: tuple[int, int, int] = (1, 16, 0)
    uid: bytes = field(default=b"mavjoule simulated")
    """The 18 bytes of ``uid2``."""
    misbehaviour: Misbehaviour = field(default_factory=Misbehaviour)

    @property
    def home_slot(self) -> WireItem:
        """The first item of an ArduPilot mission."""
        return WireItem(
            frame=0,
            command=16,
            param1=0.0,
            param2=0.0,
            param3=0.0,
            param4=0.0,
            x=round(self.home.latitude_deg * 1e7),
            y=round(self.home.longitude_deg * 1e7),
            z=self.home.altitude_amsl_m or 0.0,
        )

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
        # The same number makes one text of several chunks; 0 says that there is only one.
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
    logs: tuple[VehicleLog, ...] = (),
    wind: Wind | None = None,
    system: int = 1,
    version: tuple[int, int, int] | None = None,
    misbehaviour: Misbehaviour | None = None,
) -> VehicleSetup:
    """Return a vehicle onto which a mission was uploaded.

    Parameters
    ----------
    mission : Mission
        Its items, fence and rally points are what the vehicle holds.
    autopilot : Autopilot
        PX4 or ArduPilot.
    home : Home, optional
        Where the vehicle stands; default the mission's own home, else its first place.
    parameters : tuple of VehicleParameter
        In the vehicle's order.
    logs : tuple of VehicleLog
        The first is the oldest.
    wind : Wind, optional
        What it takes the wind to be; default it sends none.
    system : int
        MAVLink's system id.
    version : tuple of int, optional
        Of the firmware; default 1.16.0 of PX4, 4.6.0 of Copter.
    misbehaviour : Misbehaviour, optional
        What is wrong with it; default nothing.

    Raises
    ------
    UsageError
        If an item cannot be sent as it is.
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
        logs=logs,
        wind=wind,
        system=system,
        version=version,
        uid=_uid(autopilot, system),
        misbehaviour=misbehaviour or Misbehaviour(),
    )


def _first_place(mission: Mission) -> Home | None:
    for item in mission.items:
        if item.latitude_deg and item.longitude_deg:
            return Home(
                latitude_deg=item.latitude_deg,
                longitude_deg=item.longitude_deg,
                altitude_amsl_m=None,
            )
    return None


def _uid(autopilot: Autopilot, system: int) -> bytes:
    """Return 18 bytes that are the same for every run, and different for every vehicle."""
    seed = f"mavjoule {autopilot} {system}".encode()
    words = b"".join(zlib.crc32(seed, start).to_bytes(4, "little") for start in range(5))
    return words[:18]
