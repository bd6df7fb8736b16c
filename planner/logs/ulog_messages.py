"""Reader of PX4's ULog to tables of its messages: one pass over the bytes, whatever they are.

Every step goes forward, every definition is of bounded size, and only rows of what is wanted are kept.
"""

from __future__ import annotations

import re
import struct
from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import LogFileError
from planner.logs.messages import GIVE_UP_BYTES, MessageTable, is_unwritten
from planner.logs.series import LOG_CLOCK, Clock
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from mmap import mmap

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.logs.messages import Damage

MAGIC = b"ULog\x01\x12\x35"
"""The first bytes of a ULog."""
_HEADER_BYTES = 16
_FLAGS = struct.Struct("<8s8s3Q")
_APPENDED = 1
"""DATA_APPENDED, the one flag without which a log cannot be read that this reader knows."""
_KINDS = {
    **{
        f"{sign}int{8 * size}_t": f"<{sign or 'i'}{size}"
        for sign in ("u", "")
        for size in (1, 2, 4, 8)
    },
    "float": "<f4",
    "double": "<f8",
    "bool": "<u1",
    "char": "S1",
}
"""numpy's type by the format's."""
_LONGEST = 65_535
"""A length is two bytes."""
_DEEPEST = 8
"""Types within types; PX4's go two deep."""
_MOST_FORMATS = 4096
"""PX4 has 250 topics."""
_FIELD = re.compile(r"(\w+)(?:\[(\d{1,5})\])? ([\w.]+)")
_NAME = re.compile(r"[\w-]+")
_SIZES = {
    ord("A"): (4, 300),
    ord("B"): (40, 400),
    ord("C"): (11, _LONGEST),
    ord("F"): (3, _LONGEST),
    ord("I"): (4, _LONGEST),
    ord("L"): (9, _LONGEST),
    ord("M"): (5, _LONGEST),
    ord("O"): (2, 2),
    ord("P"): (4, 300),
    ord("Q"): (5, 300),
    ord("R"): (2, 3),
    ord("S"): (8, 8),
}
"""Least and greatest length of a message by its type, but of those with data."""
_DATA = ord("D")
_CANDIDATE = re.compile(rb"[ABCDFILMOPQRS]")

Fields = tuple[tuple[str, int, str], ...]
"""Name, offset and numpy's type of each field that is wanted."""


@dataclass(slots=True)
class _Subscription:
    """What messages of one number hold."""

    topic: str
    instance: int
    least: int
    """Bytes of a message without the padding at its end."""
    most: int
    fields: Fields = ()
    places: array[int] | None = None
    """Where the data begin; ``None`` where nothing of it is wanted."""


class UlogContent(Value, eq=False):
    """What is read of a log."""

    topics: tuple[tuple[int, MessageTable], ...]
    """Tables of the wanted topics, each with its instance; by topic, then by instance."""
    info: Mapping[str, str | int | float]
    parameters: tuple[tuple[float, str, float], ...]
    """Time, −∞ for the values at the start, name and value. [s]"""
    findings: tuple[Finding, ...] = ()
    """What was out of time and is left out."""


def read_ulog(
    data: mmap | bytes, wanted: Mapping[str, Collection[str]], damage: Damage, *, source: str
) -> UlogContent:
    """Return the wanted fields by topic, texts and parameters of a ULog; note what is no message.

    Raises
    ------
    LogFileError
        If it is too short, written in a way that no reader of today knows, or of more than one start
        of the vehicle.
    """
    walk = _UlogWalk(data, wanted, damage, source)
    walk.run()
    content = np.frombuffer(data, np.uint8)
    subscriptions = sorted(
        (one for one in walk.subscriptions.values() if one.places),
        key=lambda one: (one.topic, one.instance),
    )
    tables = [(one.instance, _table(content, one)) for one in subscriptions]
    kept, findings = _in_time(tables, source)
    return UlogContent(
        topics=kept,
        info=walk.info,
        parameters=_timed(walk, [table for _, table in kept]),
        findings=findings,
    )


class _UlogWalk:
    """One pass over the bytes, and what it brings."""

    def __init__(
        self, data: mmap | bytes, wanted: Mapping[str, Collection[str]], damage: Damage, source: str
    ) -> None:
        self.data, self.wanted, self.damage, self.source = data, wanted, damage, source
        self.end = len(data)
        self.formats: dict[str, tuple[tuple[str, int, str], ...]] = {}
        """Type, count (0 of what is no array) and name of each field, by the type they make."""
        self.subscriptions: dict[int, _Subscription] = {}
        self.info: dict[str, str | int | float] = {}
        self.parameters: list[tuple[int, str, float]] = []
        """Place, −1 for the values at the start, name and value."""
        self._sizes: dict[str, int | None] = {}
        self._offsets: list[int] = []
        """Where what was appended begins."""
        self._fields_of: dict[str, Fields] = {}

    def run(self) -> None:
        """Find the messages; this loop sees every one of them, so it does little."""
        if self.end < _HEADER_BYTES:
            msg = "is broken: it ends within the header of a ULog"
            raise LogFileError(msg, source=self.source)
        data, subscriptions = self.data, self.subscriptions
        at, before = _HEADER_BYTES, 0
        end = self.end
        while at + 3 <= end:
            size, kind = data[at] | data[at + 1] << 8, data[at + 2]
            after = at + 3 + size
            if self._offsets and after > self._offsets[0]:
                at = max(self._offsets.pop(0), at)
                before = 0
                continue
            if kind == _DATA and size > 2 and after <= end:
                one = subscriptions.get(data[at + 3] | data[at + 4] << 8)
                if one is not None and one.least <= size - 2 <= one.most:
                    if one.places is not None:
                        one.places.append(at + 5)
                    at = after
                    before = 0  # its length is known to be right
                    continue
            elif after <= end and self._is_message(kind, size, after):
                if not self._take(kind, at + 3, size):
                    self.damage.add(at, after - at)
                at, before = after, at
                continue
            # The length of a message of any size may be what is damaged: others may be inside it.
            begin = before or at
            found = self._next(begin + 1)
            if found is None:
                self._finish(at)
                break
            begin = at if found > at else begin
            self.damage.add(begin, found - begin)
            at, before = found, 0

    def _is_message(self, kind: int, size: int, after: int) -> bool:
        """Return whether a length fits a type; an unknown one where another message follows."""
        known = _SIZES.get(kind)
        if known is not None:
            return known[0] <= size <= known[1]
        return kind != _DATA and 65 <= kind <= 122 and size > 0 and self._after(after) is not None

    def _after(self, at: int) -> int | None:
        """Return where a message ends that begins here by every sign; ``None`` where none does."""
        data, end = self.data, self.end
        if at + 3 > end:
            return end if at == end else None
        size, kind = data[at] | data[at + 1] << 8, data[at + 2]
        if at + 3 + size > end:
            return None
        if kind == _DATA:
            one = self.subscriptions.get(data[at + 3] | data[at + 4] << 8) if size > 2 else None
            fits = one is not None and one.least <= size - 2 <= one.most
        else:
            least, most = _SIZES.get(kind, (1, 0))
            fits = least <= size <= most
        return at + 3 + size if fits else None

    def _next(self, start: int) -> int | None:
        """Return the next place at which two messages follow each other; ``None``: not near."""
        stop = min(self.end, start + GIVE_UP_BYTES)
        for mark in _CANDIDATE.finditer(self.data, start + 2, stop):
            after = self._after(mark.start() - 2)
            if after is not None and self._after(after) is not None:
                return mark.start() - 2
        return None

    def _finish(self, at: int) -> None:
        """Note what is left where no further message is found: a message cut off is no damage."""
        if self.end - at <= _LONGEST + 3 or is_unwritten(self.data, at):
            return
        if self.end - at > GIVE_UP_BYTES:
            self.damage.stopped_by = f"no message within {GIVE_UP_BYTES >> 20} MiB"
        self.damage.add(at, self.end - at)

    def _take(self, kind: int, at: int, size: int) -> bool:
        """Take a message without data; return whether it is what its type says."""
        body = self.data[at : at + size]
        match chr(kind):
            case "F":
                return self._define(body)
            case "A":
                return self._subscribe(body)
            case "I" | "P":
                return self._keyed(body, at, is_parameter=chr(kind) == "P")
            case "B":
                return self._flags(body, at)
        return True

    def _flags(self, body: bytes, at: int) -> bool:
        if at != _HEADER_BYTES + 3:
            return False
        _, incompatible, *offsets = _FLAGS.unpack_from(body)
        if incompatible[0] & ~_APPENDED or any(incompatible[1:]):
            msg = "is a ULog with flags that this program does not know: update mavjoule"
            raise LogFileError(msg, source=self.source)
        if incompatible[0] & _APPENDED:
            self._offsets = sorted(one for one in offsets if at < one < self.end)
        return True

    def _define(self, body: bytes) -> bool:
        name, colon, text = body.decode("utf-8", "replace").partition(":")
        fields = [_FIELD.fullmatch(part) for part in text.split(";") if part]
        if not (colon and _NAME.fullmatch(name) and fields) or len(self.formats) >= _MOST_FORMATS:
            return False
        read = tuple((one[1], int(one[2] or 0), one[3]) for one in fields if one is not None)
        if len(read) != len(fields):
            return False
        return self.formats.setdefault(name, read) == read

    def _subscribe(self, body: bytes) -> bool:
        instance, number = body[0], body[1] | body[2] << 8
        topic = body[3:].decode("utf-8", "replace")
        most = self._size(topic)
        if most is None:
            return False
        known = self.subscriptions.get(number)
        if known is not None:
            return (known.topic, known.instance) == (topic, instance)
        least = most
        for kind, count, name in reversed(self.formats[topic]):
            if not name.startswith("_padding"):
                break
            least -= (self._size(kind) or 0) * max(count, 1)
        one = _Subscription(topic, instance, least, most)
        if topic in self.wanted:
            one.fields = self._fields(topic)
            is_timed = any(entry[0] == "timestamp" and entry[2] == "<u8" for entry in one.fields)
            one.places = array("q") if is_timed else None
        self.subscriptions[number] = one
        return True

    def _size(self, kind: str, depth: int = 0) -> int | None:
        """Return the bytes of a type; ``None`` where it is not defined, or larger than a message."""
        if kind in _KINDS:
            return int(_KINDS[kind][-1])
        if kind in self._sizes or kind not in self.formats or depth > _DEEPEST:
            return self._sizes.get(kind)
        total: int | None = 0
        for inner, count, _ in self.formats[kind]:
            size = self._size(inner, depth + 1)
            total = None if size is None or total is None else total + size * max(count, 1)
            if total is None or total > _LONGEST:
                total = None
                break
        self._sizes[kind] = total
        return total

    def _fields(self, topic: str) -> Fields:
        """Return the wanted fields of a topic whose size is known."""
        if topic not in self._fields_of:
            wanted = {"timestamp", *self.wanted[topic]}
            self._fields_of[topic] = tuple(self._flattened(topic, "", 0, wanted))
        return self._fields_of[topic]

    def _flattened(
        self, kind: str, prefix: str, at: int, wanted: set[str]
    ) -> list[tuple[str, int, str]]:
        found: list[tuple[str, int, str]] = []
        for inner, count, name in self.formats[kind]:
            size = self._size(inner) or 0
            whole = f"{prefix}{name}"
            if any(one.startswith(whole) for one in wanted):
                for index in range(max(count, 1)):
                    label = f"{whole}[{index}]" if count else whole
                    if inner not in _KINDS:
                        found += self._flattened(inner, f"{label}.", at + index * size, wanted)
                    elif label in wanted and inner != "char":
                        found.append((label, at + index * size, _KINDS[inner]))
            at += size * max(count, 1)
        return found

    def _keyed(self, body: bytes, at: int, *, is_parameter: bool) -> bool:
        """Take a text or number with its type and name."""
        length = body[0]
        kind, _, name = body[1 : 1 + length].decode("utf-8", "replace").partition(" ")
        value = body[1 + length :]
        if not name or 1 + length > len(body):
            return False
        if kind.startswith("char["):
            if not is_parameter:
                self.info[name] = value.decode("utf-8", "replace")
            return True
        if kind not in _KINDS or len(value) != int(_KINDS[kind][-1]) or kind == "char":
            return kind.partition("[")[0] in _KINDS
        number = np.frombuffer(value, _KINDS[kind])[0].item()
        if is_parameter:
            self.parameters.append((at if self.subscriptions else -1, name, number))
        else:
            self.info[name] = number
        return True


def _table(content: np.ndarray[tuple[int], np.dtype[np.uint8]], one: _Subscription) -> MessageTable:
    places: IntArray = np.array(one.places, np.int64)
    numbers: dict[str, FloatArray] = {}
    for name, offset, kind in one.fields:
        cells = content[(places + offset)[:, np.newaxis] + np.arange(int(kind[-1]))]
        numbers[name] = cells.view(kind)[:, 0].astype(np.float64)
    time_s = numbers.pop("timestamp") * 1e-6
    return MessageTable(name=one.topic, places=places, time_s=time_s, numbers=numbers)


def _in_time(
    tables: list[tuple[int, MessageTable]], source: str
) -> tuple[tuple[tuple[int, MessageTable], ...], tuple[Finding, ...]]:
    """Return the tables in the order of their times, and what is left out of them.

    A topic's times rise: PX4 starts its clock, and a log, when it starts.  Single messages come with
    time 0 or with one that was damaged, and a topic whose times another computer gives may be set back
    for good; a log most of whose topics are set back is not of one start.
    """
    clocks = [Clock.of(table.places, table.time_s) for _, table in tables]
    turned = sum(bool(clock.restarts) for clock in clocks)
    if turned > sum(clock.is_long and not clock.restarts for clock in clocks):
        first = next(
            table for (_, table), clock in zip(tables, clocks, strict=True) if clock.restarts
        )
        msg = f"the clock of {first.name} goes backwards: no log of one flight of PX4"
        raise LogFileError(msg, source=source)
    kept: list[tuple[int, MessageTable]] = []
    findings: list[Finding] = []
    for (instance, table), clock in zip(tables, clocks, strict=True):
        if clock.restarts:
            message = f"the clock of {table.name} goes backwards: the topic is left out"
            findings.append(LOG_CLOCK.finding(f"{source}: {message}"))
            continue
        if clock.strays:
            message = f"out of time and left out: {quantity.count(clock.strays, 'message')}"
            findings.append(LOG_CLOCK.finding(f"{source}: {table.name}: {message}"))
            table = table.rows(clock.is_in_time(table.places))  # noqa: PLW2901 - as it is now
        kept.append((instance, table.in_order()))
    return tuple(kept), tuple(findings)


def _timed(walk: _UlogWalk, tables: list[MessageTable]) -> tuple[tuple[float, str, float], ...]:
    """Return parameters with the latest time before each; those at the start without one."""
    (begin_us,) = struct.unpack_from("<Q", walk.data, len(MAGIC) + 1)
    places = np.concatenate([np.empty(0, np.int64), *(table.places for table in tables)])
    times = np.concatenate([np.empty(0), *(table.time_s for table in tables)])
    order = np.argsort(places)
    places, latest_s = places[order], np.maximum.accumulate(times[order])
    found = []
    for place, name, value in walk.parameters:
        before = int(np.searchsorted(places, place)) - 1
        time_s = (
            -np.inf if place < 0 else float(latest_s[before]) if before >= 0 else begin_us * 1e-6
        )
        if np.isfinite(value):
            found.append((time_s, name, float(value)))
    return tuple(found)
