"""Fuzz targets of the line: a vehicle that says anything, and a sound one over a line that does anything.

Both run in virtual time; an input is what the draws are made from.
"""

from __future__ import annotations

import struct
from random import Random
from typing import TYPE_CHECKING, Any

from fuzz.target import Target
from virtual_vehicle import ARDUPILOT, PX4, VirtualLine, VirtualVehicle, waypoints

from planner.errors import LinkError
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, UploadOutcome
from planner.link.snapshot import fetch_snapshot
from planner.link.transfers import LinkSettings
from planner.link.vehicle import VehicleLink
from planner.link.wire import Message

if TYPE_CHECKING:
    from collections.abc import Callable

_LONGEST_VIRTUAL_S = 3600.0
_NUMBERS = (0, 1, -1, 2, 3, 5, 9, 127, 128, 200, 255, 256, 65_535, 2**31 - 1, -(2**31), 2**32 - 1)
_REALS = (0.0, -1.0, 1e38, float("nan"), float("inf"), 0.5, 33.0, 512.0, 3000.0)
_IMPATIENT = LinkSettings(heartbeat_timeout_s=3.0, reply_timeout_s=0.3, retries=2)


class _LiarLine(VirtualLine):
    """A line behind which one vehicle in every message may say anything."""

    def __init__(self, vehicle: VirtualVehicle, draw: Random) -> None:
        super().__init__(vehicle, loss=draw.choice((0.0, 0.2)), seed=draw.randrange(1 << 30))
        self._draw, self._lies = draw, draw.choice((0.02, 0.2, 0.6))

    def _say(self, index: int, messages: list[Message]) -> None:
        told = list[Message]()
        for one in messages:
            if one.name != "HEARTBEAT" and self._draw.random() < self._lies:
                told += self._lie(one)
            else:
                told.append(one)
        for one in told:
            try:
                super()._say(index, [one])
            except (struct.error, TypeError, ValueError, OverflowError):
                super()._say(index, [])  # no frame holds this

    def _lie(self, one: Message) -> list[Message]:
        fields: dict[str, Any] = dict(one.fields)
        name = self._draw.choice(tuple(fields))
        match fields[name]:
            case bool() | int():
                fields[name] = self._draw.choice(_NUMBERS)
            case float():
                fields[name] = self._draw.choice(_REALS)
            case str():
                fields[name] = self._draw.choice(("", "A" * 16, "\x00", "RTL_ALT", "é"))
            case list() as several:
                fields[name] = [self._draw.choice(_NUMBERS) for _ in several]
        lie = Message(name=one.name, fields=fields)
        return self._draw.choice(([lie], [lie, one], [one, lie], [lie] * 3, []))

    def receive(self, timeout_s: float) -> list[tuple[Any, bytes]]:
        assert self.time_s < _LONGEST_VIRTUAL_S, "it goes on without end"
        return super().receive(timeout_s)


def _vehicle(draw: Random) -> VirtualVehicle:
    vehicle = VirtualVehicle(autopilot=draw.choice((PX4, ARDUPILOT)))
    vehicle.lists = {
        MissionKind.MISSION: waypoints(draw.choice((0, 1, 2, 12))),
        MissionKind.FENCE: waypoints(draw.choice((0, 3))),
        MissionKind.RALLY: waypoints(draw.choice((0, 1))),
    }
    vehicle.parameters = {f"P{n}": (float(n), 9) for n in range(draw.choice((0, 1, 15)))}
    return vehicle


def _hostile(data: bytes) -> None:
    """Fetch everything from a vehicle that lies, or put a mission on it: it ends, with a word."""
    draw = Random(data)
    vehicle = _vehicle(draw)
    purpose = draw.choice((Purpose.READ, Purpose.UPLOAD))
    link = VehicleLink(_LiarLine(vehicle, draw), name="liar", settings=_IMPATIENT, purpose=purpose)
    if purpose is Purpose.UPLOAD:
        link.upload_items(draw.choice(tuple(MissionKind)), waypoints(draw.choice((0, 1, 7))))
    else:
        fetch_snapshot(link)


def _cut(data: bytes) -> None:
    """Put a mission on a sound vehicle over any line: what is claimed is so, and what is there is whole."""
    draw = Random(data)
    vehicle = VirtualVehicle(autopilot=draw.choice((PX4, ARDUPILOT)))
    old, new = waypoints(draw.choice((1, 3, 9))), waypoints(draw.choice((2, 4, 11)))
    vehicle.lists[MissionKind.MISSION] = old
    line = VirtualLine(
        vehicle,
        loss=draw.choice((0.0, 0.1, 0.4)),
        repeated=draw.choice((0.0, 0.2)),
        late=draw.choice((0.0, 0.1, 0.5)),
        seed=draw.randrange(1 << 30),
        cut_after=draw.choice((None, draw.randrange(1, 60))),
        cut_s=draw.choice((2.0, 10.0, 1e9)),
    )
    try:
        link = VehicleLink(line, name="cut", settings=_IMPATIENT, purpose=Purpose.UPLOAD)
        outcome, _ = link.upload_items(MissionKind.MISSION, new)
    except LinkError:
        return
    if outcome is UploadOutcome.ACCEPTED:
        assert vehicle.lists[MissionKind.MISSION] == new


def _drawn(draw: Random) -> bytes:
    return draw.randbytes(8)


def targets() -> tuple[Target, ...]:
    """Return the targets."""
    ways: dict[str, Callable[[bytes], object]] = {"vehicle": _hostile, "line": _cut}
    return tuple(Target(name, [b"1"], run, make=_drawn) for name, run in ways.items())
