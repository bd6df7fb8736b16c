"""Uploads over lines that lose, delay, reorder, repeat and are cut anywhere, each drawn from a number.

What is claimed is held against what the simulated vehicle holds when all has come to rest: nothing is
claimed that is not so, and where the line comes back the vehicle has the old mission whole or the new.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fenced_missions import box, rally
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import MemoryLine, request, vehicle

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.geo.fence import Fence
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, mission_of_lists
from planner.link.transfers import LinkSettings
from planner.link.upload import upload_mission
from planner.link.vehicle import VehicleLink
from planner.mission.compare import compare_missions
from planner.service.simulation import make_simulated_wire
from planner.simulator.faults import Direction, DirectionFaults
from planner.simulator.vehicle import SimulatedVehicle
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping

    from planner.mission.items import Mission
    from planner.simulator.wire import SimulatedWire

_REST_S = 20.0
"""In which what is under way has arrived, and every autopilot has given up what it waited for. [s]"""
_COMES_BACK_S = 15.0
"""A line that is silent for less is waited for: 20 s until a heartbeat. [s]"""
_LONGEST_S = 2000.0
_ITEMS = (1, 2, 3, 5, 8, 13, 30)


@dataclass
class CutUpload:
    """One upload, and what it left."""

    number: int
    how: str
    """What was wrong with the line."""
    claim: str
    """What was claimed to be on the vehicle: ``old``, ``new``, or nothing."""
    held: str
    """What was there in the end: ``old``, ``new`` or ``mixture``."""
    is_back: bool
    """Whether the line came back."""
    text: str
    """What was said."""
    took_s: float

    @property
    def fault(self) -> str:
        """What is wrong with it; empty where nothing is."""
        if self.claim and self.claim != self.held:
            return f"claimed {self.claim}, held {self.held}"
        if self.is_back and self.held == "mixture":
            return "a mixture, though the line came back"
        return "" if self.took_s < _LONGEST_S else "it took too long"


class _CutLine(MemoryLine):
    """Cut in either direction, or both, after so many frames of an upload, for a time."""

    after: int | None = None
    cuts_in = cuts_out = is_interrupted = False
    silence_s = 0.0
    until_s: float | None = None

    def send(self, data: bytes, peer: Hashable | None = None) -> None:
        if not (self._is_cut() and self.cuts_out):
            super().send(data, peer)

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        found = super().receive(timeout_s)
        if self._is_cut(len(found)) and self.cuts_in:
            return []
        return found

    def _is_cut(self, frames: int = 1) -> bool:
        if self.after is None:
            return False
        self.after -= frames
        if self.after > 0:
            return False
        if self.until_s is None:
            self.until_s = self.now_s() + self.silence_s
            if self.is_interrupted:
                raise KeyboardInterrupt
        return self.now_s() < self.until_s


def cut_upload(number: int) -> CutUpload:
    """Return what became of the upload that a number draws."""
    drawn = random.Random(number)
    autopilot = drawn.choice([Autopilot.PX4, Autopilot.ARDUPILOT])
    made = _still(autopilot)
    line = _CutLine(made)
    link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
    before = {kind: tuple(items) for kind, items in made.vehicle.missions.lists.items()}
    ways = [_faults(drawn), _faults(drawn)]
    made._inwards, made._outwards = (Direction(one, number) for one in ways)
    line.cuts_in, line.cuts_out = drawn.choice([(True, True), (True, False), (False, True)])
    line.silence_s = drawn.choice([0.0, drawn.uniform(0.0, _COMES_BACK_S), 1e9])
    line.is_interrupted = drawn.random() < 0.3
    line.after = (
        int(drawn.expovariate(1 / drawn.choice([40, 150, 400]))) if drawn.random() < 0.9 else None
    )
    link.settings = drawn.choice(
        [LinkSettings(), LinkSettings(reply_timeout_s=0.8, retries=4), LinkSettings(retries=3)]
    )
    sent = _mission(drawn)
    claim, text = _claimed(link, sent)
    how = f"{autopilot} {ways} cut after {line.after} for {line.silence_s:.1f} s"
    is_back = line.until_s is None or line.silence_s < _COMES_BACK_S
    line.after = None
    took_s = line.now_s()
    until_s = took_s + _REST_S
    while line.now_s() < until_s:
        line.receive(until_s - line.now_s())
    return CutUpload(
        number, how, claim, _held(line, before, sent, autopilot), is_back, text, took_s
    )


def _still(autopilot: Autopilot) -> SimulatedWire:
    """Return a vehicle that holds missions and never flies them: a prediction takes most of the time."""
    return make_simulated_wire(
        SimulatedVehicle(vehicle(autopilot).setup, lambda _: None), request(autopilot)
    )


def _faults(drawn: random.Random) -> DirectionFaults:
    return DirectionFaults(
        loss=drawn.choice([0.0, 0.05, 0.2]),
        duplication=drawn.choice([0.0, 0.0, 0.1, 0.3]),
        reordering=drawn.choice([0.0, 0.0, 0.1, 0.3]),
        delay_s=drawn.choice([0.0, 0.02, 0.1, 0.4]),
    )


def _mission(drawn: random.Random) -> Mission:
    height_m = drawn.choice([30.0, 35.0])
    count = drawn.choice(_ITEMS)
    ways = (waypoint(60.0 * one, height_m) for one in range(1, count + 1))
    flown = mission(takeoff(height_m), *ways, rtl())
    if drawn.random() < 0.5:
        side_m = drawn.choice([500.0, 600.0])
        flown = replace(flown, fence=Fence(polygons=(box(-side_m, -side_m, side_m, 2500.0),)))
    if drawn.random() < 0.5:
        places = (rally(15.0 * one, 20.0) for one in range(1, drawn.choice([1, 3]) + 1))
        flown = replace(flown, rally=tuple(places))
    return flown


def _claimed(link: VehicleLink, sent: Mission) -> tuple[str, str]:
    try:
        result = upload_mission(link, sent, listen_s=1.0)
    except LinkError as error:
        text = str(error)
        if "the old mission is on the vehicle" in text or "nothing was sent" in text:
            return "old", text
        return ("new", text) if "; the mission is on the vehicle" in text else ("", text)
    except KeyboardInterrupt:
        return "", "interrupted before anything was sent"
    if result.restored is not None:
        return ("old" if result.restored else "", repr(result))
    return "new", repr(result)


def _held(
    line: MemoryLine,
    before: Mapping[MissionKind, tuple[object, ...]],
    sent: Mission,
    autopilot: Autopilot,
) -> str:
    vehicle = line._wire.vehicle
    lists = {kind: tuple(items) for kind, items in vehicle.missions.lists.items()}
    skipped = int(autopilot is Autopilot.ARDUPILOT)  # home is the vehicle's own
    if all(repr(lists[kind][skipped:]) == repr(before[kind][skipped:]) for kind in MissionKind):
        return "old"
    read = mission_of_lists(lists, vehicle.setup.identity, home=sent.home, source=sent.source)
    differences = compare_missions(sent, read, autopilot=autopilot)
    return "mixture" if any(one.matters for one in differences) else "new"
