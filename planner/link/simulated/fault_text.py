"""Faults as a text, for the command line: ``loss=20%,delay-in=0.5,silence=12:30,twin,seed=7``."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from planner.errors import UsageError
from planner.frozen import frozen
from planner.link.simulated.faults import DirectionFaults, LineFaults
from planner.link.simulated.setup import Misbehaviour

if TYPE_CHECKING:
    from collections.abc import Callable

_SHARES = ("loss", "duplication", "reordering", "garbage", "truncation")
_BY_DIRECTION = {**dict.fromkeys(_SHARES), "delay": "delay_s"}
_OUTWARDS_ALONE = frozenset({"garbage", "truncation"})
"""What is done to the bytes that the vehicle sends."""
_IN, _OUT = "-in", "-out"
_EVENT = re.compile(r"[a-z][a-z0-9_]*")
_EXAMPLE = "loss=20%,delay=0.2,silence=12:30"
KNOWN = (*_BY_DIRECTION, "silence", "count", "twin", "reject", "event", "seed")


@frozen
class Faults:
    """What goes wrong, on the line and on the vehicle."""

    line: LineFaults = LineFaults()
    vehicle: Misbehaviour = Misbehaviour()


def read_faults(text: str) -> Faults:
    """Return the faults that a text names.

    Parameters
    ----------
    text : str
        Between commas: a share (``loss``, ``duplication``, ``reordering``, ``garbage``,
        ``truncation``) as ``20%`` or ``0.2``; ``delay`` in seconds; ``-in`` or ``-out`` after the
        name for what goes to or comes from the vehicle alone; ``silence=K`` after K messages of
        transfers, ``silence=K:S`` for S seconds; ``count=+2`` for wrong counts; ``twin``;
        ``reject=TEXT`` said after uploads, ``event=NAME`` reported after them; ``seed``.

    Raises
    ------
    UsageError
        If it names none.
    """
    ways: dict[str, dict[str, float]] = {_IN: {}, _OUT: {}}
    line: dict[str, Any] = {}
    vehicle: dict[str, Any] = {}
    for part in (part.strip() for part in text.split(",") if part.strip()):
        name, _, value = part.partition("=")
        try:
            _take(name.strip(), value.strip(), ways, line, vehicle)
        except ValueError as error:
            msg = f"{part!r} is no fault: {error}; known are {', '.join(KNOWN)}, such as {_EXAMPLE}"
            raise UsageError(msg) from error
    try:
        directions = (DirectionFaults(**ways[_IN]), DirectionFaults(**ways[_OUT]))
    except ValueError as error:
        raise UsageError(str(error)) from error
    return Faults(
        line=LineFaults(to_vehicle=directions[0], from_vehicle=directions[1], **line),
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
    others: dict[str, Callable[[], None]] = {
        "count": lambda: vehicle.update(count_error=_whole(value)),
        "twin": lambda: vehicle.update(has_twin=_truth(value)),
        "reject": lambda: vehicle.update(rejection=_given(value)),
        "event": lambda: vehicle.update(event=_event(value)),
        "seed": lambda: line.update(seed=_whole(value)),
        "silence": lambda: line.update(_silence(value)),
    }
    if name in others:
        others[name]()
        return
    stem = name.removesuffix(_IN).removesuffix(_OUT)
    if stem not in _BY_DIRECTION:
        msg = "no such name"
        raise ValueError(msg)
    if name == stem + _IN and stem in _OUTWARDS_ALONE:
        msg = f"{stem} is only of what comes from the vehicle"
        raise ValueError(msg)
    number = _number(value.removesuffix("%")) / (100.0 if value.endswith("%") else 1.0)
    for way, faults in ways.items():
        is_meant = name == stem + way or (
            name == stem and not (way == _IN and stem in _OUTWARDS_ALONE)
        )
        if is_meant:
            faults[_BY_DIRECTION[stem] or stem] = number


def _silence(value: str) -> dict[str, float]:
    after, _, duration_s = value.partition(":")
    found: dict[str, float] = {"silent_after": _whole(after)}
    if found["silent_after"] < 0:
        msg = f"{after} messages cannot pass"
        raise ValueError(msg)
    if duration_s:
        found["silence_s"] = _number(duration_s)
    return found


def _number(text: str) -> float:
    try:
        number = float(text)
    except ValueError as error:
        msg = f"{text!r} is no number" if text else "it says not how much"
        raise ValueError(msg) from error
    if not 0.0 <= number < math.inf:
        msg = f"{text} is less than 0, or without end"
        raise ValueError(msg)
    return number


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError as error:
        msg = f"{text!r} is no whole number" if text else "it says not how many"
        raise ValueError(msg) from error


def _truth(text: str) -> bool:
    """Return that it is so; it is by being named."""
    if text:
        msg = "it takes no value"
        raise ValueError(msg)
    return True


def _given(text: str) -> str:
    if not text:
        msg = "it says not what"
        raise ValueError(msg)
    return text


def _event(text: str) -> str:
    if not _EVENT.fullmatch(text):
        msg = f"{text!r} is no name of an event, such as navigator_mis_geofence_violation"
        raise ValueError(msg)
    return text
