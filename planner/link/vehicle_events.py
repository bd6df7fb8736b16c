"""PX4's events interface: what a vehicle reports by number, and is asked for again where it got lost.

The number of an event is the 32-bit FNV-1a hash of its name in 24 bits, above them the component
that defines it, 1 for the autopilot (``events::ID``).  What its arguments mean stands in no message.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.catalogue.px4_events import PX4_EVENTS
from planner.frozen import frozen
from planner.link.exchange import Exchange
from planner.link.message import message

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.message import Message
    from planner.link.settings import LinkSettings

_OFFSET_BASIS, _PRIME = 0x811C9DC5, 0x01000193
_AUTOPILOT = 1 << 24
_MOST_KEPT = 200
_MOST_MISSING = 100
"""PX4 keeps fewer."""
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


@frozen
class VehicleEvent:
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
        """The item it is about, from 1, where it tells one."""
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
            and (sequence - self._latest) & 0xFFFF not in range(1, 0x8000)
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
        if ahead >= 0x8000:
            return  # late
        if ahead > _MOST_MISSING:  # it was restarted, or counts in its own way
            self._missing.clear()
            ahead = 0
        self._missing |= {(sequence - step) & 0xFFFF for step in range(ahead)}
        self._latest = sequence


class EventRequest(Exchange):
    """Asks for the events that are missing; one that cannot be had is done without.

    Parameters
    ----------
    record : EventRecord
        Told every event by others.
    settings : LinkSettings
        How patient to be.
    retries : int
        How often to ask again.
    """

    def __init__(self, record: EventRecord, settings: LinkSettings, *, retries: int) -> None:
        super().__init__(settings, retries=retries)
        self._record = record
        self._wanted = len(record.missing)
        self.is_done = not record.missing

    @property
    def progress(self) -> tuple[int, int | None]:
        """Events that came, and how many were missing."""
        return self._wanted - len(self._record.missing), self._wanted

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:  # noqa: ARG002 - as every transfer
        """Take a message of the vehicle, which the record has taken before."""
        self.is_done = not self._record.missing
        return ()

    def _give_up(self, now_s: float) -> None:  # noqa: ARG002 - it does without
        self._record.give_up()
        self.is_done = True

    def _requests(self) -> tuple[Message, ...]:
        return tuple(
            message("REQUEST_EVENT", first_sequence=sequence, last_sequence=sequence)
            for sequence in self._record.missing
        )
