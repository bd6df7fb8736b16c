"""The mission protocol: a list of items to or from a vehicle, whatever the line loses.

Down: MISSION_REQUEST_LIST, MISSION_COUNT, then for each item MISSION_REQUEST_INT and
MISSION_ITEM_INT, at last MISSION_ACK.  Up: MISSION_COUNT, then the vehicle asks for each item, at
last its MISSION_ACK.
"""

from __future__ import annotations

import math
import struct
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.errors import LinkError, UsageError
from planner.link.transfers import Question, Transfer
from planner.link.wire import message
from planner.mission.commands import UNSET_YAW, Command, Frame, command_name, load_command_table
from planner.mission.formats.fence_items import (
    fence_items,
    make_fence,
    make_rally_points,
    rally_items,
)
from planner.mission.items import (
    MOST_ITEMS,
    Home,
    Mission,
    MissionFormat,
    MissionItem,
    numbered_in_order,
)
from planner.mission.vehicle_kind import vehicle_evidence
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.link.telemetry import VehicleIdentity
    from planner.link.transfers import LinkSettings
    from planner.link.wire import Message


class MissionKind(IntEnum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2

    @property
    def label(self) -> str:
        """As in a message: ``rally points``."""
        return ("mission", "fence", "rally points")[self.value]


class MissionResult(IntEnum):
    """MAV_MISSION_RESULT."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


BUSY = frozenset({MissionResult.ERROR, MissionResult.DENIED, MissionResult.OPERATION_CANCELLED})
"""Answers that may be another one when asked again."""


def result_name(number: int) -> str:
    """Return ``INVALID_PARAM4`` for 9; the number itself where MAVLink knows none."""
    try:
        return MissionResult(number).name
    except ValueError:
        return f"MAV_MISSION_RESULT {number}"


_FORGOTTEN_S = 6.0
"""PX4 forgets a transfer after 5 s of silence and then wants it from the start."""
_BARREN_RESTARTS, _BARREN_ITEMS = 5, 3
"""How often a list is begun of which no more than so many items ever come."""
_LEAST_PAUSE_S, _LONGEST_PAUSE_S = 0.02, 0.5
"""Between one item and the request for the next, once the vehicle has refused one. [s]"""
_CLOSING_RETRIES = 6
"""How often the last item is sent again where only the vehicle's answer is missing."""
ITEM_FIELDS = (
    *("frame", "command", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z"),
)


class WireItem(Value):
    """One MISSION_ITEM_INT, in MAVLink's own units."""

    frame: int
    command: int
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    x: int = 0
    y: int = 0
    z: float = 0.0
    autocontinue: int = 1


LIST_FILES = {
    MissionKind.MISSION: "@MISSION/mission.dat",
    MissionKind.FENCE: "@MISSION/fence.dat",
    MissionKind.RALLY: "@MISSION/rally.dat",
}
"""What ArduPilot packs its lists into when they are read (``AP_Filesystem_Mission.cpp``)."""
LIST_HEAD, LIST_MAGIC = struct.Struct("<HHHHH"), 0x763D
"""Magic number, MAV_MISSION_TYPE, options, first item, items."""
PACKED_ITEM = struct.Struct("<4f2if2H6B")
"""A MISSION_ITEM_INT as it is in its frame."""


def read_packed_items(data: bytes, kind: MissionKind) -> tuple[WireItem, ...]:
    """Return the items of a file that ArduPilot packs a list into; `LinkError` where it is not whole."""
    number = -1
    if len(data) >= LIST_HEAD.size:
        magic, packed_kind, _, start, count = LIST_HEAD.unpack_from(data)
        if (magic, packed_kind, start) == (LIST_MAGIC, kind, 0):
            number = count
    if len(data) != LIST_HEAD.size + number * PACKED_ITEM.size:
        msg = f"{LIST_FILES[kind]} is not whole: {len(data)} bytes for {max(number, 0)} items"
        raise LinkError(msg)
    rows = enumerate(PACKED_ITEM.iter_unpack(data[LIST_HEAD.size :]))
    return tuple(_packed_item(row, kind, number) for number, row in rows)


def _packed_item(row: tuple[Any, ...], kind: MissionKind, number: int) -> WireItem:
    *params, x, y, z, seq, command, _, _, frame, _, autocontinue, packed_kind = row
    if seq != number or packed_kind not in {0, kind}:
        msg = f"{LIST_FILES[kind]} is damaged at item {number}"
        raise LinkError(msg)
    names = ("param1", "param2", "param3", "param4")
    return WireItem(
        frame=frame,
        command=command,
        x=x,
        y=y,
        z=z,
        autocontinue=autocontinue,
        **dict(zip(names, params, strict=True)),
    )


class MissionDownload(Transfer):
    """A list of items that a vehicle is asked for."""

    def __init__(self, kind: MissionKind, settings: LinkSettings) -> None:
        super().__init__(settings)
        self._kind = kind
        self._count: int | None = None
        self._items: list[WireItem] = []
        self._restarts = 0
        self._furthest = 0
        self._refusal = ""
        self._last_progress_s = 0.0
        self._pause_s = 0.0
        self._due_s: float | None = None
        """When the next item is to be asked for, where that is put off."""
        self.is_supported = True
        self.list_id = 0
        """The vehicle's own number of this list; 0 where it has none."""

    @property
    def progress(self) -> tuple[int, int | None]:
        """Items so far, and how many there are."""
        return len(self._items), self._count

    @property
    def items(self) -> tuple[WireItem, ...]:
        """The list, once it is done."""
        return tuple(self._items)

    @property
    def deadline_s(self) -> float:
        """When to ask again, or for the next item. [s]"""
        return self._timer.deadline_s if self._due_s is None else self._due_s

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Ask for the number of items."""
        self._last_progress_s = now_s
        return super().begin(now_s)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle; others than of this list are passed over."""
        if self.is_done or received.fields.get("mission_type") != self._kind:
            return ()
        if received.name == "MISSION_COUNT":
            self.list_id = received.fields.get("opaque_id", 0)
            return self._take_count(received["count"], now_s)
        if received.name == "MISSION_ITEM_INT":
            return self._take_item(received, now_s)
        if received.name == "MISSION_ACK":
            return self._take_refusal(received["type"], now_s)
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask again, or give up."""
        if self._due_s is not None:
            self._due_s = None
            self._timer.sent(now_s)
            return self._requests()
        is_forgotten = now_s - self._last_progress_s > _FORGOTTEN_S
        if self._count is not None and is_forgotten and not self._timer.is_used_up:
            return self._restart(now_s, "no answer came", is_slow=True)
        return super().expire(now_s)

    def _requests(self) -> tuple[Message, ...]:
        kind = int(self._kind)
        if self._count is None:
            return (message("MISSION_REQUEST_LIST", mission_type=kind),)
        return (message("MISSION_REQUEST_INT", seq=len(self._items), mission_type=kind),)

    def _take_count(self, count: int, now_s: float) -> tuple[Message, ...]:
        if self._count is not None:
            if count == self._count:
                return ()  # a repetition
            # The list has changed under our hands, or one of the two numbers was wrong.
            return self._restart(now_s, f"it reported {self._count} items, then {count}")
        self._count = count
        return self._next(now_s)

    def _take_item(self, received: Message, now_s: float) -> tuple[Message, ...]:
        if self._count is None or received["seq"] != len(self._items):
            return ()  # a repetition, or out of order
        self._items.append(WireItem(**{name: received[name] for name in ITEM_FIELDS}))
        return self._next(now_s)

    def _next(self, now_s: float) -> tuple[Message, ...]:
        self._timer.answered(now_s)
        self._last_progress_s = now_s
        if len(self._items) == self._count:
            self.is_done = True
            return (message("MISSION_ACK", type=0, mission_type=int(self._kind)),)
        if self._pause_s:
            self._due_s = now_s + self._pause_s
            return ()
        self._timer.sent(now_s)
        return self._requests()

    def _take_refusal(self, result: int, now_s: float) -> tuple[Message, ...]:
        if result == MissionResult.ACCEPTED:
            return ()
        if self._count is None and result == MissionResult.UNSUPPORTED:
            self.is_supported = False
            self.is_done = True
            return ()
        self._refusal = result_name(result)
        if self._count is None or result == MissionResult.INVALID_SEQUENCE:
            return ()  # asked again when the time has come
        return self._restart(now_s, f"it answered {self._refusal}")

    def _restart(self, now_s: float, why: str, *, is_slow: bool = False) -> tuple[Message, ...]:
        if len(self._items) > self._furthest:  # PX4 starts again for one late request
            self._furthest = len(self._items)
            self._restarts = 0
        self._restarts += 1
        most = max(self._settings.retries, 1)
        if is_slow and self._furthest <= _BARREN_ITEMS:
            most = min(most, _BARREN_RESTARTS)
        if self._restarts > most:
            got, count = self.progress
            advice = (
                "the line is too slow or loses too much, PX4 forgets a transfer after 5 s: bring the "
                "radio closer, or give a longer --reply-timeout"
                if is_slow
                else "is another ground station sending one, or the list on the vehicle broken?"
            )
            msg = (
                f"the {self._kind.label} could not be read: begun {self._restarts} times, after "
                f"{got} of {count} items {why}; {advice}"
            )
            raise LinkError(msg)
        self._count = self._due_s = None
        self._items = []
        self._last_progress_s = now_s
        if not is_slow:
            # PX4 ends a transfer for a request that comes late: the line may take them out of order.
            self._pause_s = min(max(2.0 * self._pause_s, _LEAST_PAUSE_S), _LONGEST_PAUSE_S)
        # A busy vehicle is left a moment; the attempts since it last made progress still count.
        self._timer.repeated(now_s)
        return self._requests()

    def _stalled(self, waited_s: float) -> str:
        got, count = self.progress
        what = "its number of items" if count is None else f"item {got + 1} of {count}"
        refused = f" (it answered {self._refusal})" if self._refusal else ""
        return (
            f"the {self._kind.label} stalled: {what} did not come in {self._timer.attempts} "
            f"requests and {waited_s:.0f} s{refused}; bring the radio closer, "
            "or give a longer --reply-timeout or more --retries"
        )


class ListIdRequest(Question):
    """A vehicle's own number of a list, which it sends before the items of it (PX4).

    Whoever asks ends the transfer by `ended`.
    """

    def __init__(self, kind: MissionKind, settings: LinkSettings, *, retries: int) -> None:
        request = message("MISSION_REQUEST_LIST", mission_type=int(kind))
        super().__init__(request, settings, retries=retries, is_fresh=True)
        self._kind = kind
        cancelled = int(MissionResult.OPERATION_CANCELLED)
        self.ended = message("MISSION_ACK", type=cancelled, mission_type=int(kind))

    @property
    def list_id(self) -> int:
        """The number; 0 where none came."""
        return 0 if self.answer is None else self.answer.fields.get("opaque_id", 0)

    def _is_answer(self, received: Message) -> bool:
        return received.name == "MISSION_COUNT" and received["mission_type"] == self._kind


class UploadOutcome(Enum):
    """What a vehicle made of a list that it was sent."""

    ACCEPTED = "accepted"
    UNCONFIRMED = "unconfirmed"
    """It asked for every item, and its last answer was lost."""
    REJECTED = "rejected"


class MissionUpload(Transfer):
    """A list of items that is sent to a vehicle; none clears it."""

    def __init__(
        self, kind: MissionKind, items: Sequence[WireItem], settings: LinkSettings
    ) -> None:
        super().__init__(settings)
        self._kind = kind
        self._sent = tuple(items)
        self._most_answers = (len(items) + 1) * (settings.retries + 2)
        self._answers = 0
        self._asked: set[int] = set()
        self._last_asked: int | None = None
        self._busy = 0
        self._closing = 0
        self._doubt: int | None = None
        """What the vehicle answered last that it may not answer again."""
        self.outcome: UploadOutcome | None = None
        self.rejection = ""
        """In a rejection: what the vehicle answered, and to which item."""

    @property
    def progress(self) -> tuple[int, int | None]:
        """Items asked for so far, and how many there are."""
        return len(self._asked), len(self._sent)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle; others than of this list are passed over."""
        if self.is_done or received.fields.get("mission_type") != self._kind:
            return ()
        if received.name in {"MISSION_REQUEST_INT", "MISSION_REQUEST"}:
            return self._answer(received["seq"], now_s)
        if received.name == "MISSION_ACK":
            self._take_result(received["type"])
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send the last thing again; give up unless the vehicle asked for everything."""
        if self._doubt is not None and self._timer.is_used_up:
            self._reject(self._doubt)
            return ()
        if self._has_sent_all:
            self._closing += 1
            if self._closing > _CLOSING_RETRIES or self._timer.is_used_up:
                self._finish(UploadOutcome.UNCONFIRMED)
                return ()
        return super().expire(now_s)

    def _requests(self) -> tuple[Message, ...]:
        if self._last_asked is None:
            kind = int(self._kind)
            return (message("MISSION_COUNT", count=len(self._sent), mission_type=kind),)
        return (self._item(self._last_asked),)

    @property
    def _has_sent_all(self) -> bool:
        return bool(self._sent) and len(self._asked) == len(self._sent)

    def _item(self, seq: int) -> Message:
        item = self._sent[seq]
        fields = {name: getattr(item, name) for name in ITEM_FIELDS}
        # Where no item is the current one, PX4 begins the new mission at the item that the last one had
        # come to (1.17's ``MissionBase::updateMavlinkMission``): after a flight, at its end.
        is_current = seq == 0 and self._kind is MissionKind.MISSION
        return message(
            "MISSION_ITEM_INT",
            seq=seq,
            current=int(is_current),
            mission_type=int(self._kind),
            **fields,
        )

    def _answer(self, seq: int, now_s: float) -> tuple[Message, ...]:
        if not 0 <= seq < len(self._sent):
            return ()  # it is asking for another ground station's list
        # A busy computer answers late, and PX4 asks four times a second: a loop brings no new item.
        self._answers = 0 if seq not in self._asked else self._answers + 1
        if self._answers > self._most_answers:
            msg = (
                f"the vehicle asks for the items of the {self._kind.label} without end: {self._answers} "
                f"times for some of {len(self._sent)} that it has; is another ground station sending one?"
            )
            raise LinkError(msg)
        if seq not in self._asked:
            self._timer.answered(now_s)
            self._busy, self._doubt = 0, None
        self._asked.add(seq)
        self._last_asked = seq
        self._timer.sent(now_s)
        return (self._item(seq),)

    def _take_result(self, result: int) -> None:
        if result == MissionResult.ACCEPTED:
            if self._has_sent_all or not self._sent:
                self._finish(UploadOutcome.ACCEPTED)
            return  # else the answer about an earlier list, late
        if result == MissionResult.INVALID_SEQUENCE:
            return  # ArduPilot's answer to a repeated item: it continues to ask
        if self._has_sent_all and result in BUSY:
            # To a vehicle that is through, a repeated last item comes out of the blue, ours or one
            # that the line repeats; what it holds is read back.
            if self._closing or result == MissionResult.ERROR:
                self._finish(UploadOutcome.UNCONFIRMED)
                return
        elif result in BUSY and not self._timer.is_used_up:
            # It may be about an earlier request that the line repeats: sent again when the time has come.
            self._busy += 1
            self._doubt = result
            if self._busy <= _CLOSING_RETRIES:
                return
        self._reject(result)

    def _reject(self, result: int) -> None:
        asked = self._last_asked
        where = "" if asked is None else f" to item {asked + 1} of {len(self._sent)}"
        self.rejection = f"{result_name(result)}{where}"
        self._finish(UploadOutcome.REJECTED)

    def _finish(self, outcome: UploadOutcome) -> None:
        self.outcome = outcome
        self.is_done = True

    def _stalled(self, waited_s: float) -> str:
        asked = self._last_asked
        what = "its answer" if asked is None else f"what follows item {asked + 1}"
        return (
            f"sending the {self._kind.label} stalled: {what} of {len(self._sent)} items did not "
            f"come in {waited_s:.0f} s"
        )


_FRAMES: Mapping[int, int] = {
    Frame.GLOBAL_INT: int(Frame.GLOBAL),
    Frame.GLOBAL_RELATIVE_ALT_INT: int(Frame.GLOBAL_RELATIVE_ALT),
    Frame.GLOBAL_TERRAIN_ALT_INT: int(Frame.GLOBAL_TERRAIN_ALT),
}
"""Frames that mean the same: files have the second of each pair."""
_SCALE = 1e7
"""Degrees in MISSION_ITEM_INT."""
_NO_PLACE = frozenset({2**31 - 1, -(2**31)})
"""What a value that is not a number becomes as a 32-bit one."""


def mission_of_lists(
    lists: Mapping[MissionKind, tuple[WireItem, ...] | None],
    identity: VehicleIdentity,
    *,
    home: Home | None,
    source: str,
) -> Mission:
    """Return the mission that a vehicle's lists hold; one that it does not know is ``None``.

    Where the vehicle reports no home, ArduPilot's first item is it.
    """
    rows = lists.get(MissionKind.MISSION) or ()
    if identity.has_home_slot and rows:
        home = home or _home(rows[0])
        rows = rows[1:]
    items = tuple(
        read_item(row, identity=identity, number=number) for number, row in enumerate(rows, 1)
    )
    altitude_m = None if home is None else home.altitude_amsl_m
    fence_rows = lists.get(MissionKind.FENCE) or ()
    fence, about_fence = make_fence([read_item(row, identity=identity) for row in fence_rows])
    rally, about_rally = make_rally_points(
        [read_item(row, identity=identity) for row in lists.get(MissionKind.RALLY) or ()],
        home_altitude_amsl_m=altitude_m,
    )
    return Mission(
        source=source,
        file_format=MissionFormat.PLAN,
        items=items,
        home=home,
        autopilot=identity.autopilot,
        vehicle=vehicle_evidence(
            items, vehicle_type=identity.vehicle_type, home_altitude_amsl_m=altitude_m
        ),
        fence=fence,
        rally=rally,
        findings=(*about_fence, *about_rally),
    )


def lists_of_mission(
    mission: Mission, identity: VehicleIdentity, *, home_slot: WireItem | None = None
) -> dict[MissionKind, tuple[WireItem, ...]]:
    """Return the lists that a vehicle is sent for a mission, its items numbered again.

    ArduPilot puts its own home into the first place, whatever is sent: best what it has there.
    `UsageError` where an item cannot be sent as it is.
    """
    rows = [
        wire_item(item, identity=identity, number=number)
        for number, item in enumerate(numbered_in_order(mission.items), 1)
    ]
    if identity.has_home_slot:
        rows.insert(0, home_slot or home_row(mission.home))
    if len(rows) > MOST_ITEMS:
        msg = f"{len(rows)} items cannot be sent: MAVLink counts to {MOST_ITEMS}"
        raise UsageError(msg)
    fence = () if mission.fence is None else fence_items(mission.fence)
    return {
        MissionKind.MISSION: tuple(rows),
        MissionKind.FENCE: tuple(wire_item(item, identity=identity) for item in fence),
        MissionKind.RALLY: tuple(
            wire_item(item, identity=identity) for item in rally_items(mission.rally)
        ),
    }


def read_item(
    row: WireItem, *, identity: VehicleIdentity, number: int | None = None
) -> MissionItem:
    """Return a mission's item for one of the line; PX4 counts the targets of jumps from 0."""
    param1 = shortest(row.param1)
    if row.command == Command.DO_JUMP and param1 is not None and not identity.has_home_slot:
        param1 += 1.0
    divisor = _SCALE if _is_scaled(row.command, row.frame) else 1.0
    latitude, longitude = (
        None if value in _NO_PLACE else value / divisor for value in (row.x, row.y)
    )
    return MissionItem(
        command=row.command,
        frame=_FRAMES.get(row.frame, row.frame),
        param1=param1,
        param2=shortest(row.param2),
        param3=shortest(row.param3),
        param4=shortest(row.param4),
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=shortest(row.z),
        autocontinue=bool(row.autocontinue),
        jump_id=number,
    )


def wire_item(
    item: MissionItem, *, identity: VehicleIdentity, number: int | None = None
) -> WireItem:
    """Return an item, numbered in order, as it goes over the line.

    ArduPilot takes 0 where a value is not specified.  `UsageError` where it has no place, or one that
    MISSION_ITEM_INT cannot hold.
    """
    what = f"item {number} ({command_name(item.command)})" if number else "an area's item"
    is_ardupilot = identity.autopilot is Autopilot.ARDUPILOT
    param1 = item.param1
    if item.command == Command.DO_JUMP and param1 is not None and not identity.has_home_slot:
        param1 -= 1.0
    unset_yaw = math.nan if not is_ardupilot or item.command in UNSET_YAW else 0.0
    unset = 0.0 if is_ardupilot else math.nan
    is_scaled = _is_scaled(item.command, item.frame)
    place: list[int] = []
    for value in (item.latitude_deg, item.longitude_deg):
        if value is None and is_scaled and not is_ardupilot:
            msg = f"{what} has no place: PX4 would take it to be at 0°, 0°"
            raise UsageError(msg)
        scaled = round((value or 0.0) * (_SCALE if is_scaled else 1.0))
        if not -(2**31) <= scaled < 2**31:
            msg = f"{what} cannot be sent: {value} does not fit into MISSION_ITEM_INT"
            raise UsageError(msg)
        place.append(scaled)
    if item.altitude_m is None and is_scaled:
        msg = f"{what} has no altitude: open the plan in QGroundControl with terrain, and save it"
        raise UsageError(msg)
    return WireItem(
        frame=item.frame,
        command=item.command,
        param1=single(unset if param1 is None else param1),
        param2=single(unset if item.param2 is None else item.param2),
        param3=single(unset if item.param3 is None else item.param3),
        param4=single(unset_yaw if item.param4 is None else item.param4),
        x=place[0],
        y=place[1],
        z=single(unset if item.altitude_m is None else item.altitude_m),
        autocontinue=int(item.autocontinue),
    )


def single(value: float) -> float:
    """Return what is left of a number in the four bytes that MAVLink has for it."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def shortest(value: float) -> float | None:
    """Return the shortest number that four bytes hold as this one, 2.1 for 2.0999999; ``None`` of NaN."""
    if not math.isfinite(value):
        return None
    for digits in range(6, 10):
        short = float(f"{value:.{digits}g}")
        if single(short) == value:
            return short
    return value


def _is_scaled(command: int, frame: int) -> bool:
    """Return whether the fifth and sixth parameter are degrees times 10⁷.

    In the frame without a place, and in commands without one, they are not scaled.
    """
    if frame == Frame.MISSION:
        return False
    definition = load_command_table().commands.get(command)
    return definition is None or definition.has_location


def _home(row: WireItem) -> Home | None:
    """Return the home of ArduPilot's first item; 0, 0 means that it has none yet."""
    if row.x == 0 and row.y == 0:
        return None
    return Home(
        latitude_deg=row.x / _SCALE, longitude_deg=row.y / _SCALE, altitude_amsl_m=shortest(row.z)
    )


def home_row(home: Home | None) -> WireItem:
    """Return ArduPilot's first item, which it puts its own home into."""
    nowhere = WireItem(frame=0, command=int(Command.NAV_WAYPOINT))
    if home is None:
        return nowhere
    return replace(
        nowhere,
        x=round(home.latitude_deg * _SCALE),
        y=round(home.longitude_deg * _SCALE),
        z=single(home.altitude_amsl_m or 0.0),
    )
