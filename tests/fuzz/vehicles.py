"""Fuzz targets of the line: a vehicle that says anything, a sound one over a line that does anything, and
one that asks a guard whether it may arm while what is on it changes.

All run in virtual time; an input is what the draws are made from.
"""

from __future__ import annotations

import struct
from contextlib import suppress
from dataclasses import dataclass, field
from random import Random
from typing import TYPE_CHECKING, Any

from cut_uploads import cut_upload
from fuzz.target import Target
from guarded_vehicle import ASKING, HOME, OUT_AND_BACK, GuardedVehicle
from virtual_vehicle import ARDUPILOT, PX4, VirtualLine, VirtualVehicle, waypoints

from planner.errors import LinkError
from planner.guard.authorisation import ARM_AUTHORISATION_REQUEST, go_judgement, unknown_judgement
from planner.guard.decision import GuardSettings
from planner.guard.session import GuardSession
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, UploadOutcome
from planner.link.snapshot import fetch_snapshot
from planner.link.transfers import LinkSettings
from planner.link.vehicle import VehicleLink
from planner.link.wire import Message
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.guard.authorisation import Judgement
    from planner.link.snapshot import VehicleSnapshot

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


def _uploaded(data: bytes) -> None:
    """Put a mission, its fence and its rally points on a vehicle over a line that is cut anywhere."""
    done = cut_upload(int.from_bytes(data, "big"))
    assert not done.fault, done


_GUARDED_S = 30.0
_ANSWERED_S = 8.0
"""A request is answered in so long, or the vehicle has given up waiting: it waits for 2 s, and what is late
on the line is late by less than a second."""


class _OverError(Exception):
    """The time of an input is up."""


@dataclass
class _HonestVehicle(GuardedVehicle):
    """A vehicle that asks, whose mission and parameters change; it keeps what was true when."""

    asked: list[float] = field(default_factory=list)
    sound: list[tuple[float, bool]] = field(default_factory=list)
    """From when on what is on it was sound, or not. [s]"""

    def tick(self, now_s: float) -> list[Message]:
        said = super().tick(now_s)
        if any(one.name == "COMMAND_LONG" for one in said):
            self.asked.append(now_s)
        self.sound.append((now_s, self._is_sound()))
        return said

    def _is_sound(self) -> bool:
        cruise, _ = self.parameters["MPC_XY_CRUISE"]
        return self.lists[MissionKind.MISSION] == OUT_AND_BACK and cruise == _CRUISE_M_S

    def was_sound(self, begin_s: float, end_s: float) -> bool:
        """Return whether what is on it was sound at any time between two."""
        return any(is_sound for now_s, is_sound in self.sound if begin_s <= now_s <= end_s)


_CRUISE_M_S, _ = ASKING["MPC_XY_CRUISE"]
_MOVED = (OUT_AND_BACK[0], replace(OUT_AND_BACK[1], z=101.0), OUT_AND_BACK[2])
_LONGER = (*OUT_AND_BACK[:2], OUT_AND_BACK[1], OUT_AND_BACK[2])
_MISSIONS = (OUT_AND_BACK, OUT_AND_BACK, _MOVED, _LONGER, ())


def _happening(draw: Random) -> Callable[[GuardedVehicle], None]:
    mission, cruise = draw.choice(_MISSIONS), draw.choice((_CRUISE_M_S, _CRUISE_M_S, 3.0))
    is_silent, sequence, charge = draw.random() < 0.5, draw.randrange(4), draw.choice((95, 94, 60))

    def change(vehicle: GuardedVehicle) -> None:
        if kind == "mission":
            vehicle.lists[MissionKind.MISSION] = mission
        elif kind == "parameter":
            vehicle.parameters["MPC_XY_CRUISE"] = cruise, 9
        elif kind == "silence":
            vehicle.is_silent = is_silent
        elif kind == "state":
            vehicle.sequence, vehicle.battery_remaining = sequence, charge
        else:
            vehicle.ask()

    kind = draw.choice(("ask", "ask", "ask", "mission", "mission", "parameter", "silence", "state"))
    return change


def _judged(snapshot: VehicleSnapshot) -> tuple[Judgement, None]:
    """Judge by what makes a vehicle sound here; a check of its energy would take most of the time."""
    cruise = {one.name: one.value for one in snapshot.parameters}.get("MPC_XY_CRUISE")
    heights = [item.altitude_m for item in snapshot.mission.items]
    if heights[:2] == [100.0, 100.0] and len(heights) == 3 and cruise == _CRUISE_M_S:
        return go_judgement(margin_wh=1.0), None
    return unknown_judgement("it is not sound"), None


def _guarded(data: bytes) -> None:
    """Guard a vehicle whose content changes, over any line: it never arms on what was not sound."""
    draw = Random(data)
    times = sorted(
        draw.uniform(5.0, _GUARDED_S - _ANSWERED_S) for _ in range(draw.randrange(1, 14))
    )
    vehicle = _HonestVehicle(
        home=HOME,
        parameters=dict(ASKING),
        battery_remaining=95,
        script=[(time_s, _happening(draw)) for time_s in times],
        has_hash=draw.random() < 0.7,
    )
    vehicle.lists[MissionKind.MISSION] = draw.choice(_MISSIONS)
    line = VirtualLine(
        vehicle,
        loss=draw.choice((0.0, 0.0, 0.1)),
        repeated=draw.choice((0.0, 0.2)),
        late=draw.choice((0.0, 0.1, 0.5)),
        seed=draw.randrange(1 << 30),
    )

    def stop(_: object) -> None:
        if line.time_s >= _GUARDED_S:
            raise _OverError

    link = VehicleLink(line, name="guarded", settings=_IMPATIENT, purpose=Purpose.GUARD)
    settings = GuardSettings(valid_for_s=draw.choice((None, 1, 10)))
    session = GuardSession(
        link, settings, judge=_judged, on_decision=lambda _: None, on_status=stop
    )
    with suppress(LinkError, _OverError):
        session.run()
    for answered_s, answer in vehicle.answers:
        if answer["command"] != ARM_AUTHORISATION_REQUEST or answer["result"] != 0:
            continue
        asked = [one for one in vehicle.asked if answered_s - _ANSWERED_S <= one <= answered_s]
        assert asked, "an answer that nobody asked for"
        assert vehicle.was_sound(asked[0], answered_s), "authorised for what was not sound"


def _drawn(draw: Random) -> bytes:
    return draw.randbytes(8)


def targets() -> tuple[Target, ...]:
    """Return the targets."""
    ways: dict[str, Callable[[bytes], object]] = {
        "vehicle": _hostile,
        "line": _cut,
        "upload": _uploaded,
        "guard": _guarded,
    }
    return tuple(Target(name, [b"1"], run, make=_drawn) for name, run in ways.items())
