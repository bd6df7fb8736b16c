"""What a vehicle reports of itself, gathered as it comes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.catalogue import PX4_EVENTS
from planner.geo.geodesy import distance_m
from planner.link.transfers import Question, Transfer
from planner.link.wire import message
from planner.mission.items import Home
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.link.transfers import LinkSettings
    from planner.link.wire import Message


AUTOPILOTS = {3: Autopilot.ARDUPILOT, 12: Autopilot.PX4}
"""By MAV_AUTOPILOT."""
_BYTEWISE, _CAST = 1 << 4, 1 << 17
"""MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE and _C_CAST."""
_RELEASES = {0: "dev", 64: "alpha", 128: "beta", 192: "rc", 255: ""}
"""FIRMWARE_VERSION_TYPE."""


class VehicleIdentity(Value):
    """Who is on the line."""

    system: int
    component: int
    autopilot_number: int
    """MAV_AUTOPILOT."""
    vehicle_type: int
    """MAV_TYPE."""
    firmware_version: tuple[int, int, int] | None = None
    firmware_release: str = ""
    """``dev``, ``rc`` and the like; empty for a release."""
    firmware_hash: str = ""
    uid: str = ""
    """The autopilot's own number in hexadecimal digits; empty where it sends none."""
    capabilities: int | None = None
    """MAV_PROTOCOL_CAPABILITY; ``None`` where it was not reported."""

    @property
    def autopilot(self) -> Autopilot | None:
        """Its firmware; ``None`` where it is none that missions are predicted for."""
        return AUTOPILOTS.get(self.autopilot_number)

    @property
    def is_bytewise(self) -> bool:
        """Whether whole parameters are bytewise in their messages."""
        encoding = (self.capabilities or 0) & (_BYTEWISE | _CAST)
        if encoding in {_BYTEWISE, _CAST}:
            return encoding == _BYTEWISE
        return self.autopilot is Autopilot.PX4

    @property
    def has_home_slot(self) -> bool:
        """Whether the first item of its mission is home, as ArduPilot has it."""
        return self.autopilot is Autopilot.ARDUPILOT

    @property
    def label(self) -> str:
        """As in a message: ``PX4 1.17.0 (system 1)``."""
        name = f"MAV_AUTOPILOT {self.autopilot_number}"
        if self.autopilot is not None:
            name = self.autopilot.label
        if self.firmware_version is not None:
            name += f" {'.'.join(map(str, self.firmware_version))}{self.firmware_release}"
        return f"{name} (system {self.system})"


def firmware_release(kind: int) -> str:
    """Return ``rc`` for 192; the number where it is between two kinds."""
    return _RELEASES.get(kind, f"type {kind}")


class BatteryState(Value):
    """The first battery, as the vehicle measures it."""

    remaining_fraction: float | None = None
    """State of charge, 0 to 1. [-]"""
    voltage_v: float | None = None
    current_a: float | None = None
    temperature_c: float | None = None
    consumed_ah: float | None = None
    """Since it was switched on. [Ah]"""
    consumed_wh: float | None = None
    """Likewise. [Wh]"""
    capacity_ah: float | None = None
    """By the autopilot's parameters. [Ah]"""


class VehiclePosition(Value):
    """Where the vehicle is."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    height_above_home_m: float
    heading_deg: float | None = None
    """Clockwise from north. [°]"""


class WindEstimate(Value):
    """The wind, as the vehicle takes it to be."""

    speed_m_s: float
    from_deg: float
    """Where it blows from. [°]"""


class StatusText(Value):
    """One STATUSTEXT, its chunks put together."""

    severity: int
    """MAV_SEVERITY: 0 emergency to 7 debug."""
    text: str


class VehicleState(Value):
    """What a vehicle reports of itself at one time."""

    home: Home | None = None
    battery: BatteryState | None = None
    position: VehiclePosition | None = None
    wind: WindEstimate | None = None
    is_armed: bool | None = None
    """``None`` where no heartbeat was heard."""
    is_landed: bool | None = None
    """``None`` where it is not reported."""
    before_arming: BatteryState | None = None
    """The battery when it was last seen disarmed, of a vehicle that is followed."""

    @property
    def battery_at_rest(self) -> BatteryState | None:
        """The battery while the motors stand; ``None`` where that was not seen."""
        if self.before_arming is None and self.is_armed is False:
            return self.battery
        return self.before_arming

    @property
    def home_at_arming(self) -> Home | None:
        """The home that it reports, or away from that where it stands: autopilots set theirs as they arm."""
        place = self.position
        if place is None or self.is_armed is not False:
            return self.home
        here = Home(
            latitude_deg=place.latitude_deg,
            longitude_deg=place.longitude_deg,
            altitude_amsl_m=place.altitude_amsl_m,
        )
        return here if self.home is None or homes_apart_m(self.home, here) > _AWAY_M else self.home

    @property
    def hazard(self) -> str:
        """Why nothing on it may be changed now, such as ``it is armed``; empty where it may."""
        if self.is_armed is None:
            return "it does not report whether it is armed"
        found = ["armed"] * self.is_armed + ["in the air"] * (self.is_landed is False)
        return f"it is {' and '.join(found)}" if found else ""


def homes_apart_m(one: Home, other: Home) -> float:
    """Return the distance of two places, heights counted [m]."""
    way_m = distance_m(one.latitude_deg, one.longitude_deg, other.latitude_deg, other.longitude_deg)
    return math.hypot(float(way_m), (one.altitude_amsl_m or 0.0) - (other.altitude_amsl_m or 0.0))


_NO_HEADING = 0xFFFF
"""As GLOBAL_POSITION_INT says that it has none."""
_AWAY_M = 10.0
"""So far from its home a vehicle was carried; its position wanders by less. [m]"""
_OFFSET_BASIS, _PRIME = 0x811C9DC5, 0x01000193
_AUTOPILOT = 1 << 24
_MOST_KEPT = 200
_MOST_MISSING = 100
"""PX4 keeps fewer."""
_HALF = 0x8000
"""Of the numbers: what is farther ahead is behind."""
_ITEM_FIRST = frozenset(
    {
        *("navigator_mis_no_home_rel_alt", "navigator_mis_unsup_cmd"),
        *("navigator_mis_geofence_violation", "navigator_mis_geofence_path_violation"),
        *("navigator_mis_geofence_loiter_breach", "navigator_mis_geofence_jump_breach"),
        *("navigator_mis_do_jump_invalid", "navigator_mis_dm_read_fail"),
    }
)
"""Events whose first argument is the number of an item, from 1, in two bytes."""


def event_number(name: str) -> int:
    """Return the number of an autopilot's event."""
    value = _OFFSET_BASIS
    for byte in name.encode("ascii"):
        value = (value ^ byte) * _PRIME & 0xFFFFFFFF
    return value & 0xFFFFFF | _AUTOPILOT


MISSION_EVENTS: Mapping[int, str] = {event_number(name): name for name in PX4_EVENTS}
"""By number, the names of the events about missions."""


class VehicleEvent(Value):
    """One EVENT."""

    number: int
    severity: int
    """As that of a text: 0 emergency to 7 debug."""
    arguments: bytes = b""

    @property
    def name(self) -> str:
        """Its name, where it is about missions; else empty."""
        return MISSION_EVENTS.get(self.number, "")

    @property
    def item(self) -> int | None:
        """The item it is about, from 1, where it names one."""
        if self.name not in _ITEM_FIRST:
            return None
        return int.from_bytes(self.arguments[:2], "little") or None


class EventRecord:
    """The events of one vehicle in their order, and which are missing."""

    def __init__(self) -> None:
        self._latest: int | None = None
        """Number in the sequence of the latest event that is known of."""
        self._missing: set[int] = set()
        self._events: list[VehicleEvent] = []

    @property
    def next(self) -> int | None:
        """Number of the event that is to come next; ``None`` before any was known of."""
        return None if self._latest is None else (self._latest + 1) & 0xFFFF

    @property
    def missing(self) -> tuple[int, ...]:
        """What is known to have been sent and did not come, by its number in the sequence."""
        return tuple(sorted(self._missing))

    def take(self, received: Message) -> None:
        """Take an EVENT or a CURRENT_EVENT_SEQUENCE."""
        sequence: int = received["sequence"]
        if received.name == "CURRENT_EVENT_SEQUENCE":
            self._hear_of(sequence)
            return
        is_repeated = (
            self._latest is not None
            and (sequence - self._latest) & 0xFFFF not in range(1, _HALF)
            and sequence not in self._missing
        )
        if is_repeated:
            return
        if self._latest is None:
            self._latest = (sequence - 1) & 0xFFFF
        self._hear_of(sequence)
        self._missing.discard(sequence)
        if len(self._events) < _MOST_KEPT:
            event = VehicleEvent(
                number=received["id"],
                severity=received["log_levels"] & 0xF,
                arguments=bytes(received["arguments"]),
            )
            self._events.append(event)

    def take_events(self) -> tuple[VehicleEvent, ...]:
        """Return what came since this was asked."""
        events = tuple(self._events)
        self._events.clear()
        return events

    def give_up(self) -> None:
        """Wait no more for what is missing."""
        self._missing.clear()

    def _hear_of(self, sequence: int) -> None:
        """Take it that everything up to a number was sent."""
        if self._latest is None:
            self._latest = sequence
        ahead = (sequence - self._latest) & 0xFFFF
        if ahead >= _HALF:
            return  # late
        if ahead > _MOST_MISSING:  # it was restarted, or counts in its own way
            self._missing.clear()
            ahead = 0
        self._missing |= {(sequence - step) & 0xFFFF for step in range(ahead)}
        self._latest = sequence


class EventRequest(Transfer):
    """Asks for the events that are missing in a record; one that cannot be had is done without."""

    def __init__(self, record: EventRecord, settings: LinkSettings, *, retries: int) -> None:
        super().__init__(settings, retries=retries)
        self._record = record
        self.is_done = not record.missing

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:  # noqa: ARG002 - as every transfer
        """Take a message of the vehicle, which the record has taken before."""
        self.is_done = not self._record.missing
        return ()

    def _stalled(self, waited_s: float) -> str:  # noqa: ARG002 - it does without
        self._record.give_up()
        return ""

    def _requests(self) -> tuple[Message, ...]:
        return tuple(
            message("REQUEST_EVENT", first_sequence=sequence, last_sequence=sequence)
            for sequence in self._record.missing
        )


class NextEventRequest(Question):
    """Asks for the event after the latest that is known of: a vehicle without one says that it has none.

    PX4 does so by RESPONSE_EVENT_ERROR, with the first that it has from there on, or round to the oldest
    (``SendProtocol::handle_request_event``).
    """

    def __init__(self, record: EventRecord, settings: LinkSettings, *, retries: int) -> None:
        assert record.next is not None  # nobody asks before
        self._number = record.next
        request = message("REQUEST_EVENT", first_sequence=self._number, last_sequence=self._number)
        super().__init__(request, settings, retries=retries)

    @property
    def is_last(self) -> bool:
        """Whether the vehicle said that there is none from there on."""
        if self.answer is None or self.answer.name == "EVENT":
            return False
        oldest: int = self.answer["sequence_oldest_available"]
        return (oldest - self._number) & 0xFFFF >= _HALF

    def _is_answer(self, received: Message) -> bool:
        is_named = received.name in {"EVENT", "RESPONSE_EVENT_ERROR"}
        return is_named and received["sequence"] == self._number


_NO_VOLTAGE_MV = 65_535
_NO_CURRENT_CA = -1
_NO_TEMPERATURE_CC = 32_767
_HECTOJOULES_PER_WH = 36.0
_ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""
_LANDED_STATES = {1: True, 2: False, 3: False, 4: False}
"""By MAV_LANDED_STATE; 0 is unknown."""
_MOST_CHUNKS = 16
_MOST_TEXTS = 200
"""Texts kept of one vehicle."""


def _cells_v(status: Message) -> float | None:
    cells_mv = [mv for mv in status["voltages"] if mv != _NO_VOLTAGE_MV]
    cells_mv += [mv for mv in status.fields.get("voltages_ext", ()) if mv]
    return sum(cells_mv) / 1e3 if any(cells_mv) else None


def _current_a(received: Message) -> float | None:
    current_ca: int = received["current_battery"]
    return None if current_ca == _NO_CURRENT_CA else current_ca / 1e2


def _fraction(received: Message) -> float | None:
    percent: int = received["battery_remaining"]
    return percent / 100.0 if 0 <= percent <= 100 else None


_BATTERY: Mapping[str, Mapping[str, Callable[[Message], float | None]]] = {
    "SYS_STATUS": {
        "remaining_fraction": _fraction,
        "voltage_v": lambda m: (
            m["voltage_battery"] / 1e3 if 0 < m["voltage_battery"] < _NO_VOLTAGE_MV else None
        ),
        "current_a": _current_a,
    },
    "BATTERY_STATUS": {
        "remaining_fraction": _fraction,
        "voltage_v": _cells_v,
        "current_a": _current_a,
        "temperature_c": lambda m: (
            None if m["temperature"] == _NO_TEMPERATURE_CC else m["temperature"] / 1e2
        ),
        "consumed_ah": lambda m: (
            m["current_consumed"] / 1e3 if m["current_consumed"] >= 0 else None
        ),
        "consumed_wh": lambda m: (
            m["energy_consumed"] / _HECTOJOULES_PER_WH if m["energy_consumed"] >= 0 else None
        ),
    },
}
"""By message, what it measures of a battery; the second counts more."""


class Telemetry:
    """The latest of each message that reports the vehicle's state."""

    def __init__(self) -> None:
        self._latest: dict[str, Message] = {}
        self._chunks: dict[int, dict[int, str]] = {}
        self._texts: list[StatusText] = []
        self.text_count = 0
        self.events = EventRecord()
        """What PX4 reports by number."""

    def take(self, received: Message) -> None:
        """Take a message of the vehicle's autopilot."""
        if received.name == "STATUSTEXT":
            self._take_text(received)
        elif received.name in {"EVENT", "CURRENT_EVENT_SEQUENCE"}:
            self.events.take(received)
        elif received.name == "BATTERY_STATUS" and received["id"] != 0:
            return
        else:
            self._latest[received.name] = received

    def latest(self, name: str) -> Message | None:
        """Return the latest message of a name."""
        return self._latest.get(name)

    def forget(self, name: str) -> None:
        """Forget the latest message of a name, so that the next one is known to be new."""
        self._latest.pop(name, None)

    def take_texts(self) -> tuple[StatusText, ...]:
        """Return the texts that came since the last call, in their order."""
        texts = tuple(self._texts)
        self._texts.clear()
        return texts

    def texts_after(self, count: int) -> tuple[StatusText, ...]:
        """Return the texts that came after so many, of those not taken yet."""
        number = min(self.text_count - count, len(self._texts))
        return tuple(self._texts[len(self._texts) - number :])

    def state(self) -> VehicleState:
        """Return what is known now."""
        heartbeat = self._latest.get("HEARTBEAT")
        landed = self._latest.get("EXTENDED_SYS_STATE")
        return VehicleState(
            home=self._home(),
            battery=self._battery(),
            position=self._position(),
            wind=self._wind(),
            is_armed=None if heartbeat is None else bool(heartbeat["base_mode"] & _ARMED),
            is_landed=None if landed is None else _LANDED_STATES.get(landed["landed_state"]),
        )

    def _home(self) -> Home | None:
        home = self._latest.get("HOME_POSITION")
        if home is None or not _is_place(home["latitude"], home["longitude"]):
            return None
        return Home(
            latitude_deg=home["latitude"] / 1e7,
            longitude_deg=home["longitude"] / 1e7,
            altitude_amsl_m=home["altitude"] / 1e3,
        )

    def _position(self) -> VehiclePosition | None:
        position = self._latest.get("GLOBAL_POSITION_INT")
        if position is None or not _is_place(position["lat"], position["lon"]):
            return None
        return VehiclePosition(
            latitude_deg=position["lat"] / 1e7,
            longitude_deg=position["lon"] / 1e7,
            altitude_amsl_m=position["alt"] / 1e3,
            height_above_home_m=position["relative_alt"] / 1e3,
            heading_deg=None if position["hdg"] == _NO_HEADING else position["hdg"] / 1e2,
        )

    def _battery(self) -> BatteryState | None:
        if not self._latest.keys() & _BATTERY.keys():
            return None
        found: dict[str, float | None] = {}
        for name, fields in _BATTERY.items():
            if (received := self._latest.get(name)) is not None:
                values = {field: read(received) for field, read in fields.items()}
                found |= {field: value for field, value in values.items() if value is not None}
        return BatteryState(**found)

    def _wind(self) -> WindEstimate | None:
        wind, estimate = self._latest.get("WIND_COV"), self._latest.get("WIND")
        if wind is not None and math.isfinite(wind["wind_x"]) and math.isfinite(wind["wind_y"]):
            # WIND_COV is where the air goes, north and east.
            from_deg = math.degrees(math.atan2(-wind["wind_y"], -wind["wind_x"])) % 360.0
            return WindEstimate(
                speed_m_s=math.hypot(wind["wind_x"], wind["wind_y"]), from_deg=from_deg
            )
        if estimate is None:
            return None
        speed_m_s, direction_deg = estimate["speed"], estimate["direction"]
        if not (math.isfinite(direction_deg) and math.isfinite(speed_m_s) and speed_m_s >= 0.0):
            return None
        # ArduPilot's WIND is where it comes from.
        return WindEstimate(speed_m_s=speed_m_s, from_deg=direction_deg % 360.0)

    def _take_text(self, received: Message) -> None:
        text: str = received["text"]
        number, chunk = received.fields.get("id", 0), received.fields.get("chunk_seq", 0)
        if number and (len(text) == 50 or chunk):
            chunks = self._chunks.setdefault(number, {})
            chunks[chunk] = text
            if len(text) == 50 and len(chunks) < _MOST_CHUNKS:
                return
            text = "".join(chunks[key] for key in sorted(chunks))
            del self._chunks[number]
        # A tab at the end is PX4's sign that the same comes as an event.
        report = StatusText(severity=received["severity"], text=text.rstrip())
        if len(self._texts) < _MOST_TEXTS:
            self.text_count += 1
            self._texts.append(report)


def _is_place(latitude: int, longitude: int) -> bool:
    """Return whether degrees times 10⁷ are a place; 0, 0 means none."""
    is_known = latitude != 0 or longitude != 0
    return is_known and abs(latitude) <= 900_000_000 and abs(longitude) <= 1_800_000_000
