from __future__ import annotations

import json
import queue

import mavsdk
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mavsdk import Configuration, Mavsdk
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage
from thinning import examples

from planner.link.connection import Gate, Purpose
from planner.link.wire import LAYOUTS, Codec, load_dialect, message

_TYPES = {"I": "uint32_t", "H": "uint16_t", "B": "uint8_t"}
NEWER = {
    "MISSION_CURRENT": ("mission_id", "fence_id", "rally_points_id"),
    "MISSION_COUNT": ("opaque_id",),
}
DEADLINE_S = 10.0


def _checksum(data: bytes, crc: int = 0xFFFF) -> int:
    """Return CRC-16/MCRF4XX, bit by bit."""
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_check_sums_follow_from_the_definitions(name: str) -> None:
    # MAVLink's rule: name and fields in the frame's order, arrays with their length.
    defined = f"{name} ".encode()
    for field, form in LAYOUTS[name].fields:
        is_array = form.endswith("s")
        defined += f"{'uint8_t' if is_array else _TYPES[form]} {field} ".encode()
        defined += bytes([int(form[:-1])]) if is_array else b""
    crc = _checksum(defined)
    known = getattr(load_dialect(), f"MAVLink_{name.lower()}_message", None)
    if known is not None:  # fields that came later are not in the check sum
        assert LAYOUTS[name].crc_extra == known.crc_extra
        assert {field for field, _ in LAYOUTS[name].fields} > set(known.fieldnames)
        return
    assert LAYOUTS[name].crc_extra == (crc & 0xFF) ^ (crc >> 8)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**16 - 1),
    st.integers(0, 255),
    st.binary(min_size=40, max_size=40),
)
@settings(deadline=None, max_examples=examples(50))
def test_an_event_is_read_as_it_was_sent(
    number: int, sequence: int, levels: int, arguments: bytes
) -> None:
    sent = message("EVENT", id=number, sequence=sequence, log_levels=levels, arguments=arguments)
    frame = Codec(1, 1).encode(sent)
    (read,) = Codec(0, 0).decode(frame)
    assert (read.name, read.system, read.component) == ("EVENT", 1, 1)
    padded = read["arguments"].ljust(40, b"\0")
    assert {field: read[field] for field in sent.fields} | {"arguments": padded} == sent.fields
    damaged = bytearray(frame)
    damaged[12] ^= 1
    assert Codec(0, 0).decode(bytes(damaged)) == []


@pytest.mark.parametrize("name", NEWER)
def test_fields_that_the_dialect_does_not_know_are_read(name: str) -> None:
    told = {field: 0xA0B0C0D0 + n for n, field in enumerate(NEWER[name])}
    (read,) = Codec(0, 0).decode(Codec(1, 1).encode(message(name, mission_type=1, **told)))
    assert {field: read[field] for field in told} == told
    (untold,) = Codec(0, 0).decode(Codec(1, 1).encode(message(name)))
    assert {untold[field] for field in told} == {0}


def test_only_the_one_that_asks_for_events_goes_out() -> None:
    codec = Codec(245, 190)
    sent = {name: codec.encode(message(name)) for name in LAYOUTS}
    assert [name for name, frame in sent.items() if Gate(Purpose.READ).lets_out(frame)] == [
        "REQUEST_EVENT"
    ]


def test_mavsdk_sends_and_reads_the_same_bytes() -> None:
    mavsdk.log_subscribe(lambda *_: True)
    said: queue.Queue[bytes] = queue.Queue()
    heard: queue.Queue[MavlinkMessage] = queue.Queue()
    vehicle = Codec(1, 1)
    beat = message("HEARTBEAT", type=2, autopilot=12, system_status=3, mavlink_version=3)
    with Mavsdk(Configuration.create_manual(246, 190, False)) as sdk:  # noqa: FBT003 - positional there
        sdk.add_any_connection("raw://")
        sdk.pass_received_raw_bytes(vehicle.encode(beat))
        system = sdk.first_autopilot(DEADLINE_S)
        direct = MavlinkDirect(system)
        direct.subscribe_message("EVENT", heard.put)
        sent = message("EVENT", id=0x1ABCDEF, sequence=7, log_levels=0x63, arguments=b"\x05")
        sdk.pass_received_raw_bytes(vehicle.encode(sent))
        fields = json.loads(heard.get(timeout=DEADLINE_S).fields_json)
        assert (fields["id"], fields["sequence"], fields["log_levels"]) == (0x1ABCDEF, 7, 0x63)
        assert fields["arguments"][:2] == [5, 0]
        sdk.subscribe_raw_bytes_to_be_sent(said.put)
        direct.send_message(
            MavlinkMessage(
                message_name="MISSION_CURRENT",
                system_id=246,
                component_id=190,
                target_system_id=0,
                target_component_id=0,
                fields_json=json.dumps(
                    {"seq": 3, "total": 9, "mission_state": 2, "mission_mode": 1}
                    | {"mission_id": 11, "fence_id": 2**31, "rally_points_id": 13}
                ),
            )
        )
        codec = Codec(0, 0)
        while not (
            found := [
                m for m in codec.decode(said.get(timeout=DEADLINE_S)) if "fence_id" in m.fields
            ]
        ):
            pass
        (read,) = found
        assert (read["seq"], read["total"], read["mission_state"]) == (3, 9, 2)
        assert [read[name] for name in NEWER["MISSION_CURRENT"]] == [11, 2**31, 13]


def _stream(*names: str) -> bytes:
    sender = Codec(1, 1)
    return b"".join(sender.encode(message(name)) for name in names)


@pytest.mark.parametrize("size", [1, 7, 40, 1000])
def test_what_nobody_looks_at_is_not_decoded_however_the_stream_is_cut(size: int) -> None:
    data = _stream("ATTITUDE", "HEARTBEAT", "VFR_HUD", "HEARTBEAT", "ATTITUDE")
    codec = Codec(0, 0, used=frozenset({"HEARTBEAT"}))
    found = [
        one
        for start in range(0, len(data), size)
        for one in codec.decode(data[start : start + size])
    ]
    assert [one.name for one in found] == ["HEARTBEAT", "HEARTBEAT"]
    assert codec.filter is not None
    assert codec.filter.skipped == 3


def test_garbage_that_looks_like_a_frame_nobody_looks_at_hides_no_message() -> None:
    """It claims 20 bytes more, which are of the message behind it: no other frame follows it."""
    garbage = bytes([0xFD, 30, 0, 0, 0, 1, 1, 30, 0, 0]) + b"nothing"
    codec = Codec(0, 0, used=frozenset({"HEARTBEAT"}))
    plain = Codec(0, 0)
    stream = garbage + _stream(*["HEARTBEAT"] * 9)
    assert [one.name for one in codec.decode(stream)] == [one.name for one in plain.decode(stream)]
    assert len(codec.decode(_stream("HEARTBEAT"))) == 1
