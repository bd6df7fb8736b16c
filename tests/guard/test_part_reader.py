from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from simulated_vehicles import memory_line

from planner.autopilot import Autopilot
from planner.guard.decision import PartRead, PartUnread, ReadParts, VehiclePart
from planner.guard.session import PartReader, VehicleWatch
from planner.link.mission import MissionKind
from planner.link.snapshot import read_vehicle
from planner.link.transfers import LinkSettings
from planner.link.vehicle import VehicleLink

if TYPE_CHECKING:
    from planner.simulator.wire import PassedMessage

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
ALL = ReadParts(
    parts=(VehiclePart.MISSION, VehiclePart.FENCE, VehiclePart.RALLY, VehiclePart.PARAMETERS)
)


def _reader(
    autopilot: Autopilot, *, is_known: bool = False
) -> tuple[PartReader, VehicleWatch, list[PassedMessage]]:
    """Return a reader, what it reads into, and what is sent to the vehicle."""
    line = memory_line(autopilot)
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


def test_px4_is_read_once_and_then_confirmed_by_two_messages() -> None:
    reader, watch, sent = _reader(PX4)
    first = {one.part: one for one in reader.read(ALL)}
    sent.clear()
    again = {one.part: one for one in reader.read(ALL)}
    assert again == first
    assert [name for name in _names(sent) if name != "HEARTBEAT"] == [
        "COMMAND_LONG",
        "PARAM_REQUEST_READ",
    ]
    assert watch.fingerprints.keys() == set(ALL.parts)


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
