"""The mission protocol on the vehicle's side, in the manners of PX4 and of ArduPilot.

PX4 keeps the old list until the new one is whole, answers nothing it was not asked for in order,
and asks with MISSION_REQUEST until it was sent a MISSION_ITEM_INT (MavlinkMissionManager).
ArduPilot writes each item of a mission to its place as soon as it comes, has home in the first
place, and always asks with MISSION_REQUEST (MissionItemProtocol).
"""

from __future__ import annotations

import math
import zlib
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.link.mission import (
    LIST_HEAD,
    LIST_MAGIC,
    PACKED_ITEM,
    MissionKind,
    MissionResult,
    WireItem,
)
from planner.mission.commands import (
    AMSL_FRAMES,
    NEEDS_ALTITUDE,
    RELATIVE_FRAMES,
    ROIS_BY_MODE,
    TERRAIN_FRAMES,
    UNSET_YAW,
    Command,
    Frame,
    Support,
    has_location,
    px4_takes_roi,
    support,
)
from planner.mission.formats.fence_items import FENCE_COMMANDS
from planner.mission.storage import (
    LONGEST_STORED_HOLD_S,
    stored_hold_s,
    stored_radius_m,
    stored_turns,
)
from planner.simulator.servers import NEVER_S, answer
from planner.values import Value, field_names, replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.wire import Message
    from planner.simulator.setup import VehicleSetup
    from planner.vehicle.parameters.table import Version


class Manners(Value):
    """In what two autopilots differ."""

    retry_s: float
    """Until an item is asked for again. [s]"""
    timeout_s: float
    """Of silence, until a transfer is given up. [s]"""
    most_items: Mapping[MissionKind, int]


MANNERS: Mapping[Autopilot, Manners] = {
    Autopilot.PX4: Manners(
        retry_s=0.25,
        timeout_s=5.0,
        most_items={MissionKind.MISSION: 2000, MissionKind.FENCE: 64, MissionKind.RALLY: 20},
    ),
    Autopilot.ARDUPILOT: Manners(
        retry_s=1.0,
        timeout_s=8.0,
        most_items={MissionKind.MISSION: 650, MissionKind.FENCE: 84, MissionKind.RALLY: 17},
    ),
}


class IncomingList:
    """A list that is coming in."""

    def __init__(self, first: Message, kind: MissionKind, *, start: int, end: int) -> None:
        self.partner = first
        self.kind = kind
        self.next = start
        self.end = end
        self.items: list[WireItem] = []
        self.current: int | None = None
        """The item that is marked as the current one; ``None``: none is."""
        self.last_item_s = 0.0


class OutgoingList:
    """A list that goes out."""

    def __init__(self, first: Message, kind: MissionKind, until_s: float) -> None:
        self.partner = first
        self.kind = kind
        self.until_s = until_s
        """When it is forgotten, unless it is asked for something before. [s]"""
        self.next = 0

    def is_of(self, received: Message, kind: MissionKind) -> bool:
        """Return whether a message is about it."""
        return (kind, received.system) == (self.kind, self.partner.system)


_PX4_FRAMES = ((AMSL_FRAMES, Frame.GLOBAL_INT), (RELATIVE_FRAMES, Frame.GLOBAL_RELATIVE_ALT_INT))
"""PX4 sends MISSION_ITEM_INT in the frames that are named after it."""
_ARDUPILOT_FRAMES = (
    (AMSL_FRAMES, Frame.GLOBAL),
    (RELATIVE_FRAMES, Frame.GLOBAL_RELATIVE_ALT),
    (TERRAIN_FRAMES, Frame.GLOBAL_TERRAIN_ALT),
)
_CENTIMETRES = 100.0
"""ArduPilot keeps altitudes as whole centimetres."""


_PARAMETERS = ("param1", "param2", "param3", "param4")
_PX4_PARAMETERS: Mapping[int, tuple[str, ...]] = {
    Command.NAV_WAYPOINT: ("param1", "param2", "param4"),
    Command.NAV_LOITER_UNLIM: ("param3", "param4"),
    Command.NAV_LOITER_TIME: _PARAMETERS,
    Command.NAV_LAND: ("param2", "param4"),
    Command.NAV_TAKEOFF: ("param4",),
    Command.NAV_LOITER_TO_ALT: ("param1", "param2", "param4"),
    Command.NAV_VTOL_TAKEOFF: ("param4",),
    Command.NAV_VTOL_LAND: ("param4",),
    **dict.fromkeys(FENCE_COMMANDS, ("param1",)),
}
"""By command of a place, the parameters that come back (format_mavlink_mission_item)."""
_PX4_FLAGS: Mapping[int, tuple[str, ...]] = {
    Command.NAV_LOITER_TIME: ("param2", "param4"),
    Command.NAV_LOITER_TO_ALT: ("param1", "param4"),
}
"""Parameters that PX4 keeps as yes or no."""


def refusal(
    item: WireItem, kind: MissionKind, autopilot: Autopilot, version: Version
) -> MissionResult | None:
    """Return with what an autopilot refuses an item at upload; ``None`` if it takes it."""
    if autopilot is Autopilot.ARDUPILOT and (wrong := _no_number(item)) is not None:
        return wrong
    if kind is not MissionKind.MISSION:
        return _refused_area(item, kind, autopilot)
    known = support(item.command, autopilot, frame=item.frame, version=version)
    if autopilot is Autopilot.PX4 and has_location(item.command) and item.frame in TERRAIN_FRAMES:
        return MissionResult.UNSUPPORTED_FRAME
    if known is Support.REFUSED:
        return MissionResult.UNSUPPORTED
    return _refused_roi(item) if autopilot is Autopilot.PX4 else None


def _refused_area(item: WireItem, kind: MissionKind, autopilot: Autopilot) -> MissionResult | None:
    if kind is MissionKind.FENCE:
        return None if item.command in FENCE_COMMANDS else MissionResult.UNSUPPORTED
    if item.command != Command.NAV_RALLY_POINT:
        return MissionResult.UNSUPPORTED
    is_taken = autopilot is Autopilot.PX4 or item.frame in RELATIVE_FRAMES  # above home alone
    return None if is_taken else MissionResult.UNSUPPORTED_FRAME


def _refused_roi(item: WireItem) -> MissionResult | None:
    is_taken = item.command not in ROIS_BY_MODE or px4_takes_roi(item.param1, item.frame)
    return None if is_taken else MissionResult.INVALID_PARAM1


def _no_number(item: WireItem) -> MissionResult | None:
    """Return which value of an item is not a number, as ArduPilot minds (sanity_check_params)."""
    values = {
        MissionResult.INVALID_PARAM1: item.param1,
        MissionResult.INVALID_PARAM2: item.param2,
        MissionResult.INVALID_PARAM3: item.param3,
        MissionResult.INVALID_PARAM4: 0.0 if item.command in UNSET_YAW else item.param4,
        MissionResult.INVALID_PARAM7: item.z if item.command in NEEDS_ALTITUDE else 0.0,
    }
    return next((wrong for wrong, value in values.items() if not math.isfinite(value)), None)


def stored_item(item: WireItem, kind: MissionKind, autopilot: Autopilot) -> WireItem:
    """Return an item as the vehicle sends it back."""
    if autopilot is Autopilot.PX4:
        return _stored_by_px4(item, kind)
    if kind is not MissionKind.MISSION:
        return _stored_area(item, kind)
    item = replace(_with_frame(item, _ARDUPILOT_FRAMES), autocontinue=1)
    if has_location(item.command):
        item = replace(item, z=int(item.z * _CENTIMETRES) / _CENTIMETRES)
    match item.command:
        case Command.NAV_WAYPOINT | Command.NAV_LOITER_TIME:
            hold_s = stored_hold_s(min(max(item.param1, 0.0), LONGEST_STORED_HOLD_S))
            return replace(item, param1=hold_s, param2=0.0, param3=0.0, param4=0.0)
        case Command.NAV_LOITER_TURNS if item.param1 > 0.0:
            return replace(
                item, param1=stored_turns(item.param1), param3=stored_radius_m(item.param3)
            )
    return item


def _stored_area(item: WireItem, kind: MissionKind) -> WireItem:
    """Return what ArduPilot keeps of a fence's item or a rally point (MissionItemProtocol_*)."""
    kept = replace(item, param1=0.0, param2=0.0, param3=0.0, param4=0.0, autocontinue=0)
    if kind is MissionKind.FENCE:
        return replace(kept, frame=int(Frame.GLOBAL), param1=item.param1, z=0.0)
    return replace(kept, frame=int(Frame.GLOBAL_RELATIVE_ALT), z=float(int(item.z)))


def _stored_by_px4(item: WireItem, kind: MissionKind) -> WireItem:
    """Return what PX4 keeps: of an item with a place, what it knows of its command alone."""
    item = _with_frame(item, _PX4_FRAMES)
    if item.frame == Frame.MISSION:
        return item
    if kind is MissionKind.FENCE:
        item = replace(item, frame=int(Frame.GLOBAL_INT), autocontinue=0)
    known = _PX4_PARAMETERS.get(item.command, ())
    kept: dict[str, Any] = {
        name: getattr(item, name) if name in known else 0.0 for name in _PARAMETERS
    }
    for name in _PX4_FLAGS.get(item.command, ()):
        kept[name] = float(kept[name] > 0.0)
    if item.command in UNSET_YAW and "param4" in known:
        kept["param4"] = kept["param4"] % 360.0  # NaN stays what it is
    return replace(item, **kept)


def _with_frame(item: WireItem, frames: tuple[tuple[frozenset[Frame], Frame], ...]) -> WireItem:
    for same, frame in frames:
        if item.frame in same:
            return replace(item, frame=int(frame))
    return item


_EVERY_KIND = 255
_ITEM_FIELDS = field_names(WireItem)
_SCALE = 1e7
_LARGEST_INT = 2**31 - 1


_ANSWERED = frozenset(
    {"MISSION_REQUEST_LIST", "MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_COUNT"}
)
"""What is answered about a list that no vehicle has, too."""


class MissionServer:
    """The three lists of a vehicle, up and down."""

    def __init__(self, setup: VehicleSetup) -> None:
        self._setup = setup
        self._is_px4 = setup.autopilot is Autopilot.PX4
        self._manners = MANNERS[setup.autopilot]
        self._upload: IncomingList | None = None
        self._sending: OutgoingList | None = None
        """What PX4 knows of a list that goes out; ArduPilot sends any item at any time."""
        self._asks_for_int = False
        self._finished: tuple[int, int] | None = None
        self.lists = {kind: list(setup.lists[kind]) for kind in MissionKind}
        self.current = 0
        """Sequence number of the item that is flown, or will be first."""
        self.changes = dict.fromkeys(MissionKind, 0)
        """How often each list was replaced or cleared."""
        self.deadline_s = NEVER_S
        self._ids = {kind: _list_id(self.lists[kind]) for kind in MissionKind}

    def list_id(self, kind: MissionKind) -> int:
        """Return PX4's number of a list; 0 of ArduPilot, and of none."""
        return self._ids[kind] if self._is_px4 else 0

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        kind = self._kind(received)
        if kind is None and received.name in _ANSWERED:
            return (self._ack(received, MissionResult.UNSUPPORTED, received["mission_type"]),)
        if received.name == "MISSION_CLEAR_ALL":
            return self._clear(received)
        if received.name == "MISSION_SET_CURRENT":
            if received["seq"] < len(self.lists[MissionKind.MISSION]):
                self.current = received["seq"]
            return ()
        handler = {
            "MISSION_REQUEST_LIST": self._send_count,
            "MISSION_REQUEST_INT": self._send_item,
            "MISSION_REQUEST": self._send_item,
            "MISSION_COUNT": self._begin_upload,
            "MISSION_WRITE_PARTIAL_LIST": self._begin_partial_upload,
            "MISSION_ITEM_INT": self._take_item,
            "MISSION_ITEM": self._take_item,
            "MISSION_ACK": self._take_ack,
        }.get(received.name)
        return () if handler is None or kind is None else handler(received, kind, now_s)

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask again for the item that does not come, or give up."""
        upload = self._upload
        if upload is None:
            self.deadline_s = NEVER_S
            return ()
        if now_s - upload.last_item_s < self._manners.timeout_s:
            return (self._request(now_s),)
        self._upload = None
        self.deadline_s = NEVER_S
        if self._is_px4:
            return (self._setup.text(4, "Operation timeout"),)
        return (self._ack(upload.partner, MissionResult.OPERATION_CANCELLED, upload.kind),)

    def _kind(self, received: Message) -> MissionKind | None:
        number = received.fields.get("mission_type", 0)
        return MissionKind(number) if number in set(MissionKind) else None

    def _ack(self, to: Message, result: MissionResult, kind: int) -> Message:
        return answer(to, "MISSION_ACK", type=int(result), mission_type=int(kind))

    def _send_count(
        self, received: Message, kind: MissionKind, now_s: float
    ) -> tuple[Message, ...]:
        if self._is_px4:
            sending = self._sending_at(now_s)
            is_again = sending is not None and sending.is_of(received, kind)
            is_over = sending is None or sending.next >= len(self.lists[sending.kind])
            if self._upload is not None or not (is_again or is_over):
                return (self._setup.text(6, "Mission download request ignored, already active\t"),)
            until_s = now_s + self._manners.timeout_s
            self._sending = OutgoingList(received, kind, until_s)
        elif self._upload is not None:
            return (self._ack(received, MissionResult.DENIED, kind),)
        return (self._count(received, kind),)

    def _count(self, received: Message, kind: MissionKind) -> Message:
        count = max(0, len(self.lists[kind]) + self._setup.misbehaviour.count_error)
        fields = {"count": count, "mission_type": int(kind), "opaque_id": self.list_id(kind)}
        return answer(received, "MISSION_COUNT", **fields)

    def _send_item(self, received: Message, kind: MissionKind, now_s: float) -> tuple[Message, ...]:
        items, number = self.lists[kind], received["seq"]
        if self._is_px4:
            refused = self._objection(received, kind, now_s)
            if refused is not None:
                return refused
        elif self._upload is not None:
            return (self._ack(received, MissionResult.DENIED, kind),)
        elif number >= len(items) and kind is MissionKind.MISSION:
            return (self._count(received, kind), self._ack(received, MissionResult.ERROR, kind))
        elif number >= len(items):
            return (self._ack(received, MissionResult.INVALID_SEQUENCE, kind),)
        values = {name: getattr(items[number], name) for name in _ITEM_FIELDS}
        name = "MISSION_ITEM_INT"
        if received.name == "MISSION_REQUEST":
            name = "MISSION_ITEM"
            scale = _SCALE if _is_scaled(items[number]) else 1.0
            values |= {"x": values["x"] / scale, "y": values["y"] / scale}
        is_current = kind is MissionKind.MISSION and number == self.current
        values |= {"seq": number, "mission_type": int(kind), "current": int(is_current)}
        return (answer(received, name, **values),)

    def _objection(
        self, received: Message, kind: MissionKind, now_s: float
    ) -> tuple[Message, ...] | None:
        """Return what PX4 sends instead of an item; ``None`` where it sends it.

        It sends items in order, each perhaps twice; asked without a list, or too late, it sends nothing.
        """
        if self._upload is not None:
            return (self._setup.text(2, "WPM: REJ. CMD: Busy\t"),)
        sending = self._sending_at(now_s)
        if sending is None:
            return ()
        if sending.partner.system != received.system:
            return (self._setup.text(2, "WPM: REJ. CMD: partner id mismatch\t"),)
        if sending.kind is not kind:
            return ()
        sending.until_s = now_s + self._manners.timeout_s
        number = received["seq"]
        if number == sending.next < len(self.lists[kind]):
            sending.next += 1
        elif number != sending.next - 1:
            self._sending = None
            text = self._setup.text(2, "WPM: REJ. CMD: Req. WP was unexpected\t")
            return (self._ack(received, MissionResult.ERROR, kind), text)
        return None

    def _sending_at(self, now_s: float) -> OutgoingList | None:
        if self._sending is not None and now_s > self._sending.until_s:
            self._sending = None
        return self._sending

    def _take_ack(self, received: Message, kind: MissionKind, now_s: float) -> tuple[Message, ...]:
        """End a download; or change the way to ask, for a sender that does not know this one."""
        upload = self._upload
        if self._sending is not None and self._sending.is_of(received, kind):
            self._sending = None
        if (
            upload is None
            or not self._is_px4
            or (kind, received.system) != (upload.kind, upload.partner.system)
            or received["type"] != MissionResult.UNSUPPORTED
        ):
            return ()
        self._asks_for_int = not self._asks_for_int
        return (self._request(now_s),)

    def _begin_upload(
        self, received: Message, kind: MissionKind, now_s: float
    ) -> tuple[Message, ...]:
        count = received["count"]
        if self._upload is not None and self._upload.partner.system != received.system:
            busy = MissionResult.ERROR if self._is_px4 else MissionResult.DENIED
            return (self._ack(received, busy, kind),)
        if self._sending_at(now_s) is not None:
            text = self._setup.text(2, "WPM: IGN MISSION_COUNT: Busy\t")
            return (self._ack(received, MissionResult.ERROR, kind), text)
        if count > self._manners.most_items[kind]:
            return (self._ack(received, MissionResult.NO_SPACE, kind),)
        if count == 0:
            self._upload = None
            self.deadline_s = NEVER_S
            self._replace(kind, [])
            return (self._ack(received, MissionResult.ACCEPTED, kind),)
        if self._is_written_at_once(kind):
            del self.lists[kind][count:]
        return self._begin(IncomingList(received, kind, start=0, end=count), now_s)

    def _begin_partial_upload(
        self, received: Message, kind: MissionKind, now_s: float
    ) -> tuple[Message, ...]:
        if self._is_px4 or kind is not MissionKind.MISSION:
            return ()  # PX4 does not know it
        start, end = received["start_index"], received["end_index"] + 1
        if not 0 <= start < end <= len(self.lists[kind]):
            return (self._ack(received, MissionResult.ERROR, kind),)
        return self._begin(IncomingList(received, kind, start=start, end=end), now_s)

    def _begin(self, upload: IncomingList, now_s: float) -> tuple[Message, ...]:
        self._upload = upload
        upload.last_item_s = now_s
        self._finished = None
        self._asks_for_int = False
        return (self._request(now_s),)

    def _request(self, now_s: float) -> Message:
        upload = self._upload
        assert upload is not None  # asked only while a list comes in
        self.deadline_s = now_s + self._manners.retry_s
        name = "MISSION_REQUEST_INT" if self._asks_for_int else "MISSION_REQUEST"
        return answer(upload.partner, name, seq=upload.next, mission_type=int(upload.kind))

    def _take_item(self, received: Message, kind: MissionKind, now_s: float) -> tuple[Message, ...]:
        upload = self._upload
        if upload is None:
            # Nobody waits for it: the answer that it was the last may be lost.
            is_again = self._is_px4 and self._finished == (received.system, received["seq"])
            result = MissionResult.ACCEPTED if is_again else MissionResult.ERROR
            return (self._ack(received, result, kind),)
        if kind is not upload.kind or received.system != upload.partner.system:
            return ()
        self._asks_for_int = self._is_px4 and received.name == "MISSION_ITEM_INT"
        if received["seq"] != upload.next:
            if self._is_px4:
                return ()  # it was asked for again, or will be
            return (self._ack(received, MissionResult.INVALID_SEQUENCE, kind),)
        item = _wire_item(received)
        is_home = not self._is_px4 and kind is MissionKind.MISSION and upload.next == 0
        refused = self._refusal(item, kind, is_home=is_home)
        if item is None or refused is not MissionResult.ACCEPTED:
            self._upload = None
            self.deadline_s = NEVER_S
            return (self._ack(received, refused, kind),)
        upload.last_item_s = now_s
        if received["current"]:
            upload.current = upload.next
        self._keep(upload, stored_item(item, kind, self._setup.autopilot), is_home=is_home)
        upload.next += 1
        return (self._request(now_s),) if upload.next < upload.end else self._end_upload(received)

    def _refusal(self, item: WireItem | None, kind: MissionKind, *, is_home: bool) -> MissionResult:
        """Return the answer to an item; what ArduPilot is sent as its home, it does not use."""
        setup = self._setup
        if item is None:
            return MissionResult.INVALID_PARAM5_X
        if is_home:
            return MissionResult.ACCEPTED
        found = refusal(item, kind, setup.autopilot, setup.version[:2])
        return MissionResult.ACCEPTED if found is None else found

    def _end_upload(self, received: Message) -> tuple[Message, ...]:
        upload = self._upload
        assert upload is not None  # it has just got its last item
        kind = upload.kind
        self._upload = None
        self.deadline_s = NEVER_S
        self._finished = (received.system, received["seq"])
        is_kept = self._is_written_at_once(kind)
        current = upload.current if self._is_px4 else None
        self._replace(kind, self.lists[kind] if is_kept else upload.items, current=current)
        return (self._ack(received, MissionResult.ACCEPTED, kind),)

    def _is_written_at_once(self, kind: MissionKind) -> bool:
        return not self._is_px4 and kind is not MissionKind.FENCE

    def _keep(self, upload: IncomingList, item: WireItem, *, is_home: bool) -> None:
        if not self._is_written_at_once(upload.kind):
            upload.items.append(item)
            return
        items = self.lists[upload.kind]
        if is_home:
            item = self._setup.home_slot
        items[upload.next : upload.next + 1] = [item]

    def _clear(self, received: Message) -> tuple[Message, ...]:
        number = received.fields.get("mission_type", 0)
        if self._upload is not None:
            if self._is_px4:
                return (self._setup.text(2, "WPM: IGN CLEAR CMD: Busy\t"),)
            return (self._ack(received, MissionResult.ERROR, number),)
        if number == _EVERY_KIND:
            kinds = tuple(MissionKind)
        elif number in set(MissionKind):
            kinds = (MissionKind(number),)
        else:
            return (self._ack(received, MissionResult.UNSUPPORTED, number),)
        for kind in kinds:
            self._replace(kind, [])
        return (self._ack(received, MissionResult.ACCEPTED, number),)

    def packed(self, kind: MissionKind) -> bytes:
        """Return a list as ArduPilot packs it into a file."""
        items = self.lists[kind]
        rows = (
            PACKED_ITEM.pack(
                *(one.param1, one.param2, one.param3, one.param4, one.x, one.y, one.z),
                *(number, one.command, 0, 0, one.frame, 0, one.autocontinue, int(kind)),
            )
            for number, one in enumerate(items)
        )
        return LIST_HEAD.pack(LIST_MAGIC, int(kind), 0, 0, len(items)) + b"".join(rows)

    def _replace(
        self, kind: MissionKind, items: list[WireItem], *, current: int | None = None
    ) -> None:
        before, self._ids[kind] = self._ids[kind], _list_id(items)
        if self._is_px4 and items and self._ids[kind] == before:
            return  # it has this one, and judges it no more
        self.lists[kind] = items
        self.changes[kind] += 1
        if kind is MissionKind.MISSION:
            # PX4 goes on where it was in the last mission, unless an item is marked.
            kept = min(self.current, max(len(items) - 1, 0)) if self._is_px4 else 0
            self.current = kept if current is None else current


def _list_id(items: list[WireItem]) -> int:
    """Return a number that differs with the items (PX4: a CRC over them); 0 where there is none."""
    return zlib.crc32(repr(items).encode()) if items else 0


def _is_scaled(item: WireItem) -> bool:
    return item.frame != Frame.MISSION and has_location(item.command)


def _wire_item(received: Message) -> WireItem | None:
    """Return the item of a message; ``None`` where its place is none."""
    values = {name: received[name] for name in _ITEM_FIELDS}
    item = WireItem(**values)
    if received.name == "MISSION_ITEM_INT":
        return item
    scale = _SCALE if _is_scaled(item) else 1.0
    scaled = (item.x * scale, item.y * scale)
    if not all(abs(value) < _LARGEST_INT for value in scaled):  # nor is NaN
        return None
    return replace(item, x=round(scaled[0]), y=round(scaled[1]))
