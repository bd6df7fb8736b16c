"""What goes wrong on a line: each fault by chance, but the same for the same seed."""

from __future__ import annotations

import math
import random
import re
from typing import TYPE_CHECKING, Any

from planner.errors import UsageError
from planner.simulator.setup import Misbehaviour
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator


_LONGEST_HOLD_S = 0.3
"""A frame that is to be overtaken is held back for up to this. [s]"""
_DUPLICATE_S = 0.01
_MOST_GARBAGE = 40
_FRACTIONS = ("loss", "duplication", "reordering", "garbage", "truncation")
ITEMS = frozenset({"MISSION_ITEM_INT", "MISSION_ITEM"})
"""Messages that are cut short."""


class DirectionFaults(Value):
    """What happens to frames on their way in one direction."""

    loss: float = 0.0
    """Fraction of the frames that do not arrive. [-]"""
    duplication: float = 0.0
    """Fraction that arrive twice. [-]"""
    reordering: float = 0.0
    """Fraction that later ones overtake. [-]"""
    delay_s: float = 0.0
    """How long every frame is on its way. [s]"""
    garbage: float = 0.0
    """Fraction with garbage before them. [-]"""
    truncation: float = 0.0
    """Fraction of the mission items whose frame is cut short. [-]"""


class LineFaults(Value):
    """What goes wrong on a line, in both directions."""

    to_vehicle: DirectionFaults = DirectionFaults()
    from_vehicle: DirectionFaults = DirectionFaults()
    silent_after: int | None = None
    """So many messages of transfers pass, either way, then nothing does; ``None``: it never ends."""
    silence_s: float = float("inf")
    """How long nothing passes. [s]"""
    seed: int = 0


class Direction:
    """Frames on their way in one direction."""

    def __init__(self, faults: DirectionFaults, seed: int) -> None:
        self._faults = faults
        self._random = random.Random(seed)

    def arrivals_s(self, now_s: float) -> Iterator[float]:
        """Yield when a frame that is sent now arrives: never, once or twice. [s]"""
        # Every chance is drawn for every frame: one fault does not change when another one strikes.
        lost, doubled, overtaken, held = (self._random.random() for _ in range(4))
        faults = self._faults
        if lost < faults.loss:
            return
        arrival_s = now_s + faults.delay_s
        if overtaken < faults.reordering:
            arrival_s += held * _LONGEST_HOLD_S
        yield arrival_s
        if doubled < faults.duplication:
            yield arrival_s + _DUPLICATE_S

    def damaged(self, frame: bytes, *, is_item: bool) -> bytes:
        """Return a frame as it arrives: cut short, or with garbage before it."""
        spoilt, cut, length, where = (self._random.random() for _ in range(4))
        if is_item and cut < self._faults.truncation:
            frame = frame[: 1 + int(where * (len(frame) - 1))]
        if spoilt < self._faults.garbage:
            garbage = self._random.randbytes(1 + int(length * _MOST_GARBAGE))
            frame = garbage + frame
        return frame


_BY_DIRECTION = {**dict.fromkeys(_FRACTIONS), "delay": "delay_s"}
_OUTWARDS_ALONE = frozenset({"garbage", "truncation"})
"""What is done to the bytes that the vehicle sends."""
_IN, _OUT = "-in", "-out"
_EVENT = re.compile(r"[a-z][a-z0-9_]*")
_EXAMPLE = "loss=20%,delay=0.2,silence=12:30"
KNOWN = (
    *_BY_DIRECTION,
    "silence",
    "count",
    "twin",
    "no-files",
    "no-terrain",
    "reject",
    "event",
    "seed",
)


class Faults(Value):
    """What goes wrong, on the line and on the vehicle."""

    line: LineFaults = LineFaults()
    vehicle: Misbehaviour = Misbehaviour()


def read_faults(text: str) -> Faults:
    """Return the faults that a text names; `UsageError` where one is none.

    Between commas: a fraction (``loss``, ``duplication``, ``reordering``, ``garbage``, ``truncation``) as
    ``20%`` or ``0.2``; ``delay`` in seconds; ``-in`` or ``-out`` after the name for what goes to or comes
    from the vehicle alone; ``silence=K`` after K messages of transfers, ``silence=K:S`` for S seconds;
    ``count=+2`` for wrong counts; ``twin``; ``no-files`` without the file protocol,
    ``no-terrain`` without terrain; ``reject=TEXT`` sent after uploads, ``event=NAME`` reported after
    them; ``seed``.
    """
    ways: dict[str, dict[str, float]] = {_IN: {}, _OUT: {}}
    line: dict[str, Any] = {}
    vehicle: dict[str, Any] = {}
    for part in (part.strip() for part in text.split(",") if part.strip()):
        name, _, value = part.partition("=")
        try:
            _take(name.strip(), value.strip(), ways, line, vehicle)
        except ValueError as error:
            msg = f"{part!r} is not a fault: {error}; known are {', '.join(KNOWN)}, such as {_EXAMPLE}"
            raise UsageError(msg) from error
    to_vehicle, from_vehicle = DirectionFaults(**ways[_IN]), DirectionFaults(**ways[_OUT])
    return Faults(
        line=LineFaults(to_vehicle=to_vehicle, from_vehicle=from_vehicle, **line),
        vehicle=Misbehaviour(**vehicle),
    )


def _take(
    name: str,
    value: str,
    ways: dict[str, dict[str, float]],
    line: dict[str, Any],
    vehicle: dict[str, Any],
) -> None:
    """Note one fault; ``ValueError`` where it is none."""
    match name:
        case "count":
            vehicle["count_error"] = _whole(value)
        case "no-files" | "no-terrain":
            _refuse_if("it takes no value", is_wrong=bool(value))
            vehicle[f"has_{name.removeprefix('no-')}"] = False
        case "twin":
            _refuse_if("it takes no value", is_wrong=bool(value))
            vehicle["has_twin"] = True
        case "reject":
            _refuse_if("its value is missing", is_wrong=not value)
            vehicle["rejection"] = value
        case "event":
            why = f"{value!r} is not the name of an event, such as navigator_mis_geofence_violation"
            _refuse_if(why, is_wrong=not _EVENT.fullmatch(value))
            vehicle["event"] = value
        case "seed":
            line["seed"] = _whole(value)
        case "silence":
            after, _, duration_s = value.partition(":")
            line["silent_after"] = _whole(after)
            _refuse_if(f"{after} messages cannot pass", is_wrong=line["silent_after"] < 0)
            if duration_s:
                line["silence_s"] = _number(duration_s)
        case _:
            _take_by_direction(name, value, ways)


def _take_by_direction(name: str, value: str, ways: dict[str, dict[str, float]]) -> None:
    stem = name.removesuffix(_IN).removesuffix(_OUT)
    _refuse_if("no such name", is_wrong=stem not in _BY_DIRECTION)
    meant = [way for way in ways if name in {stem, stem + way}]
    if stem in _OUTWARDS_ALONE:
        _refuse_if(f"{stem} is only of what comes from the vehicle", is_wrong=meant == [_IN])
        meant = [_OUT]
    number = _number(value.removesuffix("%")) / (100.0 if value.endswith("%") else 1.0)
    is_too_much = stem in _FRACTIONS and number > 1.0
    _refuse_if(f"{stem} is a fraction from 0 to 1, got {number}", is_wrong=is_too_much)
    for way in meant:
        ways[way][_BY_DIRECTION[stem] or stem] = number


def _refuse_if(why: str, *, is_wrong: bool) -> None:
    if is_wrong:
        raise ValueError(why)


def _number(text: str) -> float:
    try:
        number = float(text)
    except ValueError as error:
        msg = f"{text!r} is not a number" if text else "how much is missing"
        raise ValueError(msg) from error
    _refuse_if(f"{text} is less than 0, or without end", is_wrong=not 0.0 <= number < math.inf)
    return number


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError as error:
        msg = f"{text!r} is not a whole number" if text else "how many is missing"
        raise ValueError(msg) from error
