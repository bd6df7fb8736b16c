"""What a vehicle was read to hold, and which of its messages speak of a change."""

from __future__ import annotations

import hashlib
import math
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.guard.authorisation import ARM_AUTHORISATION_REQUEST, ArmRequest
from planner.guard.guard import Asked, Changed, Heard, Part, Read, Unread
from planner.link.exchange import MessageRequest, ParameterHashRequest
from planner.link.mission_transfer import MissionDownload, MissionKind
from planner.mission.items import Home
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.guard.guard import Event, ReadParts
    from planner.link.codec import Message
    from planner.link.exchange import LinkSettings
    from planner.link.mission_transfer import WireItem
    from planner.link.parameters import WireParameter
    from planner.link.pymavlink_link import PymavlinkLink
    from planner.link.snapshot import VehicleReading
    from planner.link.vehicle import VehicleIdentity, VehicleState


KINDS = {
    Part.MISSION: MissionKind.MISSION,
    Part.FENCE: MissionKind.FENCE,
    Part.RALLY: MissionKind.RALLY,
}
_PARTS = {kind: part for part, kind in KINDS.items()}
LIST_IDS = {
    MissionKind.MISSION: "mission_id",
    MissionKind.FENCE: "fence_id",
    MissionKind.RALLY: "rally_points_id",
}
"""By what MISSION_CURRENT tells one list from another, where the vehicle does (PX4)."""
_ACCEPTED = 0
_COUNTERS = ("STAT_", "LND_FLIGHT_T", "COM_FLIGHT_UUID", "_HASH_CHECK", "BARO")
"""Beginnings of parameters that autopilots set themselves, in which no flight differs."""
_METRES_PER_DEGREE = 111_320.0
_MOVED_M = 2.0
"""A home that moves by less is the same. [m]"""
_AWAY_M = 10.0
"""Farther than this from the home it tells, a vehicle will set a new one when it arms. [m]"""


class VehicleWatch:
    """Turns the messages of one vehicle into events, and keeps what was read of it.

    Parameters
    ----------
    identity : VehicleIdentity
        Whose messages.
    own_system : int
        Of this program.
    """

    def __init__(self, identity: VehicleIdentity, *, own_system: int) -> None:
        self._identity = identity
        self._system = identity.system
        self._own_system = own_system
        self._requests = 0
        self._told: Mapping[str, Any] | None = None
        """The latest MISSION_CURRENT."""
        self._charges: dict[str, float] = {}
        self.lists: dict[MissionKind, tuple[WireItem, ...] | None] = {}
        self.parameters: tuple[WireParameter, ...] = ()
        self._content_of: dict[str, bytes] = {}
        self.home: Home | None = None
        """Where the vehicle will return to once it has armed here."""
        self.charge: float | None = None
        """State of charge: as it is on the ground, as it was at arming in the air. [-]"""
        self.fingerprints: dict[Part, str] = {}
        self.is_armed = False

    def take_list(self, kind: MissionKind, items: tuple[WireItem, ...] | None) -> Read:
        """Keep a list that was read."""
        self.lists[kind] = items
        if kind is MissionKind.MISSION and self._identity.has_home_slot and items:
            items = items[1:]  # home is a part of its own, and moves
        return self._read(_PARTS[kind], repr(items))

    def take_parameters(self, parameters: tuple[WireParameter, ...]) -> Read:
        """Keep the parameters that were read."""
        self.parameters = parameters
        self._content_of = {one.name: one.content for one in parameters}
        lasting = sorted(
            (one.name, one.content, one.kind)
            for one in parameters
            if not one.name.startswith(_COUNTERS)
        )
        return self._read(Part.PARAMETERS, repr(lasting))

    def take_home(self, state: VehicleState) -> tuple[Event, ...]:
        """Keep the home that the vehicle tells now, or will set when it arms."""
        home = _home_at_arming(state)
        if home is None:
            return ()
        if self.home is None or _distance_m(self.home, home) > _MOVED_M:
            self.home = home
        return (self._read(Part.HOME, repr(self.home)),)

    def take_charge(self, received: Message) -> tuple[Event, ...]:
        """Keep the charge that a SYS_STATUS or the first battery's BATTERY_STATUS tells."""
        percent = received["battery_remaining"]
        if received.fields.get("id", 0) != 0 or not 0 <= percent <= 100:
            return ()
        self._charges[received.name] = percent / 100.0
        # In the air the charge at the start is what the check is about.
        if self.charge is None or not self.is_armed:
            self.charge = min(self._charges.values())
        return (self._read(Part.BATTERY, repr(self.charge)),)

    def events(self, received: Message) -> tuple[Event, ...]:
        """Return what a message of anybody on the line means."""
        if received.system != self._system:
            return self._others(received)
        events: list[Event] = [Heard()]
        target = received.fields.get("target_system", 0)
        match received.name:
            case "COMMAND_LONG":
                if received["command"] == ARM_AUTHORISATION_REQUEST and target in {
                    0,
                    self._own_system,
                }:
                    self._requests += 1
                    events.append(Asked(request=self._request(received)))
            case "MISSION_ACK" | "MISSION_REQUEST" | "MISSION_REQUEST_INT":
                if target not in {0, self._own_system}:
                    events += _list_changed(received, "the vehicle answers another station")
            case "MISSION_CURRENT":
                events += self._counted(received)
            case "PARAM_VALUE":
                events += self._valued(received)
        return tuple(events)

    def _request(self, received: Message) -> ArmRequest:
        return ArmRequest(
            system=received.system, component=received.component, number=self._requests
        )

    def _others(self, received: Message) -> tuple[Event, ...]:
        """Return what a message of another station to the vehicle means."""
        if received.system == self._own_system:
            return ()
        if received.fields.get("target_system", 0) not in {0, self._system}:
            return ()
        if received.name in {"MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_WRITE_PARTIAL_LIST"}:
            return _list_changed(received, f"system {received.system} sends one")
        if received.name == "PARAM_SET":
            why = f"system {received.system} sets {received['param_id']}"
            return (Changed(part=Part.PARAMETERS, why=why),)
        return ()

    def _counted(self, received: Message) -> tuple[Event, ...]:
        """Return what another number of items, or another list, than before means."""
        told, before = received.fields, self._told
        self._told = told
        if before is None:
            return ()
        changed = [
            Changed(part=_PARTS[kind], why=f"MISSION_CURRENT tells of another {kind.label}")
            for kind, name in LIST_IDS.items()
            if told.get(name, 0) != before.get(name, 0)
        ]
        total = told.get("total", 0)  # autopilots count differently
        if total != before.get("total", 0):
            why = f"MISSION_CURRENT tells of {total} items"
            changed.append(Changed(part=Part.MISSION, why=why))
        return tuple(changed)

    def _valued(self, received: Message) -> tuple[Event, ...]:
        name, known = received["param_id"], self._content_of.get(received["param_id"])
        if known in {None, received["param_bytes"]} or name.startswith(_COUNTERS):
            return ()
        self._content_of[name] = received["param_bytes"]
        return (Changed(part=Part.PARAMETERS, why=f"{name} was set"),)

    def _read(self, part: Part, content: str) -> Read:
        fingerprint = hashlib.sha256(content.encode()).hexdigest()
        self.fingerprints[part] = fingerprint
        return Read(part=part, fingerprint=fingerprint)


def _list_changed(received: Message, why: str) -> tuple[Event, ...]:
    kind = received.fields.get("mission_type", 0)
    if received.name == "MISSION_ACK" and received["type"] != _ACCEPTED:
        return ()
    parts = tuple(_PARTS.values()) if kind == 255 else ()
    if kind in set(MissionKind):
        parts = (_PARTS[MissionKind(kind)],)
    return tuple(Changed(part=part, why=why) for part in parts)


def _home_at_arming(state: VehicleState) -> Home | None:
    """Return the home a vehicle tells, or the place where it will set it when it arms."""
    place = state.position
    if place is None or state.is_armed is not False:
        return state.home
    here = Home(
        latitude_deg=place.latitude_deg,
        longitude_deg=place.longitude_deg,
        altitude_amsl_m=place.altitude_amsl_m,
    )
    if state.home is None or _distance_m(state.home, here) > _AWAY_M:
        return here
    return state.home


def _distance_m(one: Home, other: Home) -> float:
    """Return the distance of places close to each other, heights counted [m]."""
    north_m = (one.latitude_deg - other.latitude_deg) * _METRES_PER_DEGREE
    east_deg = (one.longitude_deg - other.longitude_deg + 180.0) % 360.0 - 180.0
    east_m = east_deg * _METRES_PER_DEGREE * math.cos(math.radians(one.latitude_deg))
    up_m = (one.altitude_amsl_m or 0.0) - (other.altitude_amsl_m or 0.0)
    return math.sqrt(north_m**2 + east_m**2 + up_m**2)


_RETRIES = 5
"""Of what a vehicle may not have."""
_LATE = 3.0
"""An answer so many round trips old is lost. [-]"""
_CURRENT = ("MISSION_CURRENT", 42)


class PartReader:
    """Reads from one vehicle, and remembers by what it can be told that nothing has changed.

    Parameters
    ----------
    link : PymavlinkLink
        The vehicle.
    watch : VehicleWatch
        Given what is read.
    settings : LinkSettings
        How patient to be.
    known : VehicleReading, optional
        What was read of it just now: it is not read again at once.
    """

    def __init__(
        self,
        link: PymavlinkLink,
        watch: VehicleWatch,
        settings: LinkSettings,
        *,
        known: VehicleReading | None = None,
    ) -> None:
        self._link = link
        self._connection = link.connection
        self._watch = watch
        self._settings = settings
        self._lists = {} if known is None else dict(known.lists)
        self._parameters = None if known is None else known.parameters
        self._ids: dict[MissionKind, int] = {}
        """Of the lists as they were read."""
        self._hash: bytes | None = None
        self._has_hash = link.identity.autopilot is Autopilot.PX4
        self._round_trip_s: float | None = None

    def read(self, asked: ReadParts) -> Iterator[Read | Unread]:
        """Yield what became of each part, as it is read."""
        settings = self._settings
        if asked.is_urgent and self._round_trip_s is not None:
            # Someone waits: what is lost is asked for again as soon as it is late.
            late_s = max(_LATE * self._round_trip_s, settings.shortest_timeout_s)
            settings = replace(settings, reply_timeout_s=min(late_s, settings.reply_timeout_s))
        try:
            confirmed = self._confirmed(asked.parts, settings)
        except LinkError as error:
            yield from (Unread(part=part, why=str(error)) for part in asked.parts)
            return
        for part in asked.parts:
            try:
                if part not in KINDS:
                    yield self._read_parameters(settings)
                elif KINDS[part] in confirmed:
                    yield self._watch.take_list(KINDS[part], self._watch.lists[KINDS[part]])
                else:
                    yield self._read_list(KINDS[part], settings)
            except LinkError as error:
                yield Unread(part=part, why=str(error))

    def _confirmed(self, parts: tuple[Part, ...], settings: LinkSettings) -> set[MissionKind]:
        """Return the lists that one message tells to be as they were read."""
        kinds = {KINDS[part] for part in parts if part in KINDS and self._ids.get(KINDS[part])}
        if not kinds:
            return set()
        question = MessageRequest(*_CURRENT, settings, retries=_RETRIES)
        self._connection.run(question)
        told = question.answer
        if told is None:
            return set()
        return {kind for kind in kinds if told[LIST_IDS[kind]] == self._ids[kind]}

    def _read_list(self, kind: MissionKind, settings: LinkSettings) -> Read:
        if kind in self._lists:
            return self._watch.take_list(kind, self._lists.pop(kind))
        download = MissionDownload(kind, settings)
        began_s = self._connection.now_s
        self._connection.run(download)
        took_s = self._connection.now_s - began_s
        round_trip_s = took_s / (1 + len(download.items))
        self._round_trip_s = min(self._round_trip_s or round_trip_s, round_trip_s)
        self._ids[kind] = download.list_id
        return self._watch.take_list(kind, download.items if download.is_supported else None)

    def _read_parameters(self, settings: LinkSettings) -> Read:
        if self._parameters is not None:
            known, self._parameters = self._parameters, None
            return self._watch.take_parameters(known)
        content: bytes | None = None
        if self._has_hash:
            # The hash comes first: what is set while the parameters are read makes it differ.
            question = ParameterHashRequest(settings, retries=_RETRIES)
            self._connection.run(question)
            content = question.content
            self._has_hash = content is not None or self._hash is not None
        if content is None or content != self._hash:
            self._watch.take_parameters(self._link.fetch_parameters())
            self._hash = content
        return self._watch.take_parameters(self._watch.parameters)
