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

from fenced_missions import box
from fuzz.target import Target
from guarded_vehicle import ASKING, HOME, OUT_AND_BACK, GuardedVehicle
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import MemoryLine, request, vehicle
from virtual_vehicle import ARDUPILOT, PX4, VirtualLine, VirtualVehicle, waypoints

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.geo.fence import Fence
from planner.guard.authorisation import ARM_AUTHORISATION_REQUEST, go_judgement, unknown_judgement
from planner.guard.decision import GuardSettings
from planner.guard.session import GuardSession
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, UploadOutcome, mission_of_lists
from planner.link.snapshot import fetch_snapshot
from planner.link.transfers import LinkSettings
from planner.link.upload import BrokenUploadError, InterruptedUploadError, upload_mission
from planner.link.vehicle import VehicleLink
from planner.link.wire import Message
from planner.mission.compare import compare_missions
from planner.service.simulation import make_simulated_wire
from planner.simulator.vehicle import SimulatedVehicle
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.guard.authorisation import Judgement
    from planner.link.snapshot import VehicleSnapshot
    from planner.mission.items import Mission

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


_SHARES = (0.0, 0.0, 0.05, 0.2)
_RETURNS_S = 12.0
"""A line that is silent for no longer, and loses no more than a fifth of its frames, comes back while the old
mission is put back: three tries, each of which waits for 20 s."""


def _any_faults(draw: Random) -> tuple[str, float]:
    """Return what goes wrong on a line, and for how long nothing passes. [s]"""
    faults = [
        f"{name}{way}={draw.choice(_SHARES)}"
        for name in ("loss", "duplication", "reordering")
        for way in ("-in", "-out")
    ]
    faults += [f"delay{way}={draw.choice((0.0, 0.0, 0.05, 0.2))}" for way in ("-in", "-out")]
    silence_s = draw.choice((0.5, 4.0, 9.0, _RETURNS_S, 60.0, 1e6))
    faults.append(f"silence={draw.randrange(110)}:{silence_s}")
    return ",".join([*faults, f"seed={draw.randrange(1 << 30)}"]), silence_s


def _uploaded(data: bytes) -> None:
    """Put mission, fence and rally points in place of others, cut and stopped anywhere: what is claimed is
    so, and where the line comes back the old are whole or the new."""
    draw = Random(data)
    autopilot = draw.choice((Autopilot.PX4, Autopilot.ARDUPILOT))
    faults, silence_s = _any_faults(draw)
    made = SimulatedVehicle(vehicle(autopilot).setup, lambda _: None)  # one that never flies
    line = MemoryLine(make_simulated_wire(made, request(autopilot, faults)))
    legs = [waypoint(100.0 * one, 35.0) for one in range(1, draw.choice((2, 4, 9)))]
    new = replace(mission(takeoff(35.0), *legs, rtl()), fence=draw.choice((None, *_FENCES)))
    link = VehicleLink(line, name="cut", purpose=Purpose.UPLOAD)
    link.settings = draw.choice((LinkSettings(), LinkSettings(retries=2)))
    if draw.random() < 0.3:
        _stop_after(link, draw.randrange(100))
    old = _held(line)
    try:
        result = upload_mission(link, new, listen_s=1.0)
        expected = old if result.restored else new if result.restored is None else None
        assert expected is not None or silence_s > _RETURNS_S, "neither old nor new"
    except BrokenUploadError:
        assert silence_s > _RETURNS_S, "the line came back, the old mission did not"
        expected = None
    except KeyboardInterrupt:  # before anything was sent
        expected = old
    except InterruptedUploadError as error:
        known = {"read back whole": old, "what it had": old, "the mission is on the vehicle": new}
        expected = next((one for text, one in known.items() if text in str(error)), None)
    except LinkError as error:
        expected = new if "the mission is on the vehicle" in str(error) else old
    held = _held(line)
    if expected is not None:
        assert not _differ(expected, held, autopilot), "not what was claimed"
    elif autopilot is Autopilot.PX4:  # which takes a list as a whole or not at all
        assert held.items in {old.items, new.items} or not (
            _differ(replace(old, fence=held.fence, rally=held.rally), held, autopilot)
            and _differ(replace(new, fence=held.fence, rally=held.rally), held, autopilot)
        ), "half a mission"


_FENCES = (
    Fence(polygons=(box(-400.0, -400.0, 400.0, 1600.0),)),
    Fence(polygons=(box(-500.0, -500.0, 500.0, 1500.0), box(-300.0, -300.0, 300.0, 1200.0))),
)


def _stop_after(link: VehicleLink, count: int) -> None:
    """Have somebody press Ctrl-C once, when so many messages were sent."""
    send, left = link.connection.send, [count]

    def sent(one: Message) -> None:
        left[0] -= 1
        if left[0] == 0:
            raise KeyboardInterrupt
        send(one)

    link.connection.send = sent  # type: ignore[method-assign, assignment] # Ctrl-C


def _held(line: MemoryLine) -> Mission:
    made = line._wire.vehicle
    lists = {kind: tuple(items) for kind, items in made.missions.lists.items()}
    return mission_of_lists(lists, made.setup.identity, home=None, source="held")


def _differ(first: Mission, second: Mission, autopilot: Autopilot) -> bool:
    return any(one.matters for one in compare_missions(first, second, autopilot=autopilot))


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
