"""What ArduPilot packs into files when they are read: parameters and lists, or each asked for."""

from __future__ import annotations

import struct

import pytest
from simulated_vehicles import memory_line

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.link.mission import MissionKind, read_packed_items
from planner.link.parameters import read_packed_parameters
from planner.link.upload import is_same
from planner.link.vehicle import VehicleLink

ARDUPILOT = Autopilot.ARDUPILOT
# As ArduCopter 4.7.0-dev sends it, counts cut to three: FORMAT_VERSION, PILOT_THR_FILT and a byte.
PARAMETERS = bytes.fromhex(
    "1b6703000300"
    "02d0464f524d41545f56455253494f4e7800"
    "04d050494c4f545f5448525f46494c5400000000"
    "0000"  # a pad
    "0146" + b"KOFF_ALT"[:5].hex() + "fd"
)
MISSION = struct.pack("<HHHHH", 0x763D, 0, 0, 0, 2) + b"".join(
    struct.pack("<4f2if2H6B", 0, 2, 0, 0, 473977420, 85455940, 20.0, number, 16, 0, 0, 3, 0, 1, 0)
    for number in range(2)
)


def test_parameters_are_unpacked_with_their_types() -> None:
    first, second, third = read_packed_parameters(PARAMETERS)
    assert (first.name, first.value, first.kind) == ("FORMAT_VERSION", 120.0, 4)
    assert first.content == struct.pack("<f", 120.0)  # as PARAM_VALUE has it
    assert (second.name, second.value, second.kind) == ("PILOT_THR_FILT", 0.0, 9)
    assert (third.name, third.value, third.kind) == ("PILOT_KOFF_", -3.0, 2)


@pytest.mark.parametrize(
    "damaged",
    [
        b"",
        PARAMETERS[:-1],
        PARAMETERS[:30],
        b"\x1c" + PARAMETERS[1:],  # with the defaults, which nobody asked for
        PARAMETERS[:2] + b"\4" + PARAMETERS[3:],
        PARAMETERS + PARAMETERS[6:24],  # one twice
        PARAMETERS.replace(b"\4\xd0", b"\7\xd0"),
    ],
)
def test_parameters_that_are_not_whole_are_not_taken(damaged: bytes) -> None:
    with pytest.raises(LinkError):
        read_packed_parameters(damaged)


def test_items_are_unpacked() -> None:
    first, second = read_packed_items(MISSION, MissionKind.MISSION)
    assert first == second
    assert (first.command, first.frame, first.param2, first.z) == (16, 3, 2.0, 20.0)
    assert (first.x, first.y) == (473977420, 85455940)


@pytest.mark.parametrize(
    "damaged",
    [
        b"",
        MISSION[:9],
        MISSION[:-1],
        MISSION + bytes(38),
        b"\0" + MISSION[1:],
        MISSION[:10] + MISSION[48:] + MISSION[10:48],  # out of order
    ],
)
def test_items_that_are_not_whole_are_not_taken(damaged: bytes) -> None:
    with pytest.raises(LinkError):
        read_packed_items(damaged, MissionKind.MISSION)
    with pytest.raises(LinkError):
        read_packed_items(MISSION, MissionKind.FENCE)


@pytest.mark.parametrize("faults", ["", "loss=20%,delay=0.05,duplication=10%,seed=3"])
def test_what_is_read_from_files_is_what_is_asked_for_one_by_one(faults: str) -> None:
    packed, single = (
        VehicleLink(memory_line(ARDUPILOT, one), name="simulated")
        for one in (faults, f"{faults},no-files")
    )
    began_s = [link.connection.now_s for link in (packed, single)]
    assert packed.fetch_parameters() == single.fetch_parameters()
    for kind in MissionKind:
        first, second = packed.fetch_items(kind), single.fetch_items(kind)
        assert first is not None
        assert is_same(first, second or ())
    took_s = [
        link.connection.now_s - start_s
        for link, start_s in zip((packed, single), began_s, strict=True)
    ]
    if faults:
        assert took_s[0] < took_s[1]


def test_a_vehicle_that_serves_no_such_files_is_asked_for_each() -> None:
    line = memory_line(ARDUPILOT)
    link = VehicleLink(line, name="simulated")
    (files,) = (one for one in line._wire.vehicle._servers if type(one).__name__ == "FileServer")
    files._files = {}  # type: ignore[attr-defined] # one of another build
    assert len(link.fetch_items(MissionKind.FENCE) or ()) == 4
    assert link.fetch_parameters()
    sent = len(link._unpacked)
    assert link.fetch_parameters()
    assert len(link._unpacked) == sent == 2  # neither is asked for again
