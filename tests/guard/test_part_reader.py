from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from simulated_vehicles import MemoryLine, memory_line, wire

from planner.autopilot import Autopilot
from planner.guard.decision import PartRead, PartUnread, ReadParts, VehiclePart
from planner.guard.session import PartReader, VehicleWatch
from planner.link.connection import Purpose
from planner.link.mission import MissionKind
from planner.link.snapshot import read_vehicle
from planner.link.transfers import LinkSettings
from planner.link.upload import is_same
from planner.link.vehicle import VehicleLink
from planner.simulator.telemetry import TelemetryServer
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Hashable

    from planner.simulator.wire import PassedMessage

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
ALL = ReadParts(
    parts=(VehiclePart.MISSION, VehiclePart.FENCE, VehiclePart.RALLY, VehiclePart.PARAMETERS)
)


def _reader(
    autopilot: Autopilot, *, is_known: bool = False
) -> tuple[PartReader, VehicleWatch, list[PassedMessage]]:
    """Return a reader, what it reads into, and what is sent to the vehicle."""
    line = memory_line(autopilot, "no-files")
    link = VehicleLink(line, name="simulated")
    watch = VehicleWatch(link.identity, own_system=245)
    known = read_vehicle(link) if is_known else None
    sent: list[PassedMessage] = []
    line._wire.on_message = sent.append
    return PartReader(link, watch, LinkSettings(), known=known), watch, sent


def _names(sent: list[PassedMessage]) -> list[str]:
    return [one.message.name for one in sent if one.is_to_vehicle]


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_what_was_read_just_now_is_not_read_again_at_once(autopilot: Autopilot) -> None:
    reader, watch, sent = _reader(autopilot, is_known=True)
    assert [one.part for one in reader.read(ALL) if isinstance(one, PartRead)] == list(ALL.parts)
    assert _names(sent) == []
    assert len(watch.lists[MissionKind.FENCE] or ()) == 4
    assert watch.parameters
    list(reader.read(ALL))  # but a minute later
    assert _names(sent).count("MISSION_REQUEST_LIST") == 3


def test_px4_is_read_once_and_then_confirmed_by_a_question_for_each_list() -> None:
    reader, watch, sent = _reader(PX4)
    first = {one.part: one for one in reader.read(ALL)}
    sent.clear()
    again = {one.part: one for one in reader.read(ALL)}
    assert again == first
    assert [name for name in _names(sent) if name != "HEARTBEAT"] == [
        *(("TIMESYNC", "MISSION_REQUEST_LIST", "MISSION_ACK") * 3),
        *("TIMESYNC", "PARAM_REQUEST_READ"),
    ]
    assert watch.fingerprints.keys() == set(ALL.parts)


class _LateLine(MemoryLine):
    """What PX4 answered once comes again when it is asked again: it was under way for long."""

    stale: bytes = b""
    is_late = False

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        found = super().receive(timeout_s)
        if not self.stale:
            counts = [one for one in found if one[1][7:10] == b"\x2c\0\0"]  # MISSION_COUNT
            self.stale = counts[0][1] if counts else b""
        return [(peer, self.stale) for peer, _ in found[:1]] + found if self.is_late else found


def test_a_list_is_not_confirmed_by_what_was_under_way_before_it_was_asked_for() -> None:
    made = wire(PX4)
    line = _LateLine(made)
    link = VehicleLink(line, name="simulated")
    watch = VehicleWatch(link.identity, own_system=245)
    reader = PartReader(link, watch, LinkSettings())
    list(reader.read(ALL))
    assert line.stale
    other = tuple(replace(one, z=one.z + 5.0) for one in watch.lists[MissionKind.MISSION] or ())
    VehicleLink(MemoryLine(made), name="other", purpose=Purpose.UPLOAD).upload_items(
        MissionKind.MISSION, other
    )
    line.is_late = True
    list(reader.read(ReadParts(parts=(VehiclePart.MISSION,), is_urgent=True)))
    assert is_same(watch.lists[MissionKind.MISSION] or (), other)


def test_a_vehicle_that_echoes_no_time_is_read_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    reader, _, sent = _reader(PX4)
    monkeypatch.setattr(TelemetryServer, "feed", lambda *_: ())
    for _ in range(2):
        list(reader.read(ALL))
    assert _names(sent).count("PARAM_REQUEST_LIST") == 1  # its hash is of no list
    assert _names(sent).count("MISSION_REQUEST_INT") == 2 * (4 + 4 + 1)


def test_ardupilot_tells_its_lists_by_no_number_and_is_read_again() -> None:
    reader, _, sent = _reader(ARDUPILOT)
    for _ in range(2):
        list(reader.read(ALL))
    assert _names(sent).count("MISSION_REQUEST_LIST") == 6
    assert _names(sent).count("PARAM_REQUEST_LIST") == 2


def test_a_line_that_falls_silent_leaves_every_part_unread() -> None:
    line = memory_line(PX4, "silence=40")
    link = VehicleLink(line, name="simulated")
    reader = PartReader(link, VehicleWatch(link.identity, own_system=245), LinkSettings(retries=2))
    first, second = list(reader.read(ALL)), list(reader.read(ALL))
    assert [one.part for one in first] == [one.part for one in second] == list(ALL.parts)
    assert all(isinstance(one, PartUnread) for one in second)
