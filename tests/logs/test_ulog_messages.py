"""The reader of ULog: as pyulog reads what is whole, and further where a card or a hand has damaged it."""

from __future__ import annotations

import random
import struct
from typing import TYPE_CHECKING

import numpy as np
import pytest
from pyulog import ULog
from ulog_writer import UlogWriter, px4_log

from planner.errors import LogFileError
from planner.logs.files import read_log
from planner.logs.messages import GIVE_UP_BYTES, Damage
from planner.logs.ulog import WANTED
from planner.logs.ulog_messages import UlogContent, read_ulog

if TYPE_CHECKING:
    from pathlib import Path

WHOLE = px4_log().content()
SYNC = b"\x08\x00S\x2f\x73\x13\x20\x25\x0c\xbb\x12"


def read(content: bytes) -> tuple[UlogContent, Damage]:
    damage = Damage()
    return read_ulog(content, WANTED, damage, source="a.ulg"), damage


def rows(content: bytes) -> dict[str, int]:
    return {table.name: len(table.time_s) for _, table in read(content)[0].topics}


def message(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<H", len(body)) + kind + body


def places(content: bytes) -> list[int]:
    """Return where each message begins."""
    found, at = [], 16
    while at < len(content):
        found.append(at)
        at += 3 + struct.unpack_from("<H", content, at)[0]
    return found


def test_every_value_is_the_one_that_pyulog_reads(tmp_path: Path) -> None:
    log = px4_log()
    log.add("battery_status", 6.0, 15.0, 3.0, instance=1)
    log.data += message(b"P", b"\x13float MPC_XY_CRUISE" + struct.pack("<f", 7.5)) + SYNC
    path = tmp_path / "a.ulg"
    path.write_bytes(log.content())
    content, damage = read(log.content())
    known = ULog(str(path), list(WANTED))
    theirs = {(one.name, one.multi_id): one.data for one in known.data_list}
    assert {(table.name, instance) for instance, table in content.topics} == theirs.keys()
    for instance, table in content.topics:
        data = theirs[table.name, instance]
        np.testing.assert_array_equal(table.time_s, data["timestamp"] * 1e-6)
        assert table.numbers.keys() == WANTED[table.name] & data.keys()
        for name, values in table.numbers.items():
            np.testing.assert_array_equal(values, data[name].astype(float))
    initial = [(-np.inf, name, value) for name, value in known.initial_parameters.items()]
    changed = [(at_us * 1e-6, name, value) for at_us, name, value in known.changed_parameters]
    assert [*content.parameters] == initial + changed
    assert content.info == known.msg_info_dict
    assert damage.count == 0


def test_padding_at_the_end_of_a_message_may_be_left_out() -> None:
    log = UlogWriter()
    log.define("wind", "float windspeed_north;float windspeed_east;uint8_t[4] _padding0")
    log.add("wind", 5.0, 1.5, -2.5, 1, 2, 3, 4)
    log.data += message(b"D", struct.pack("<HQff", 0, 6_000_000, 2.5, -3.5))
    log.data += message(b"D", struct.pack("<HQf", 0, 7_000_000, 9.0))  # too short for its fields
    content, damage = read(log.content() + SYNC + SYNC)
    [(_, table)] = content.topics
    assert table.numbers["windspeed_north"].tolist() == [1.5, 2.5]
    assert table.numbers["windspeed_east"].tolist() == [-2.5, -3.5]
    assert damage.count == 3 + 14


def test_fields_within_types_have_the_names_that_pyulog_gives_them(tmp_path: Path) -> None:
    log = UlogWriter()
    log.definitions += message(b"F", b"inner:uint8_t valid;float cruising_speed;uint8_t[3] _pad;")
    log.definitions += message(
        b"F",
        b"position_setpoint_triplet:uint64_t timestamp;inner previous;inner current;inner[2] x;",
    )
    log.data += message(b"A", b"\x00\x07\x00position_setpoint_triplet")
    inner = [struct.pack("<Bf3x", 1, speed) for speed in (3.0, 4.0, 5.0, 6.0)]
    log.data += message(b"D", struct.pack("<HQ", 7, 1_000_000) + b"".join(inner))
    content, _ = read(log.content())
    [(_, table)] = content.topics
    assert table.numbers["current.cruising_speed"].tolist() == [4.0]
    path = tmp_path / "a.ulg"
    path.write_bytes(log.content())
    [data] = ULog(str(path)).data_list
    assert data.data["current.cruising_speed"].tolist() == [4.0]


@pytest.mark.parametrize("length", [0, 1, 2, 5_000, 20_000, 65_535])
def test_a_damaged_length_costs_that_message_and_its_neighbours(length: int) -> None:
    whole = rows(WHOLE)
    every = places(WHOLE)
    for place in every[len(every) // 3 :: len(every) // 9]:
        content = WHOLE[:place] + struct.pack("<H", length) + WHOLE[place + 2 :]
        if content == WHOLE:
            continue
        left = rows(content)
        assert sum(whole.values()) - sum(left.values()) <= 2
        assert read(content)[1].count > 0


def test_a_bad_sector_is_told_and_costs_what_lies_in_it() -> None:
    begin, longest = len(WHOLE) // 2, 200
    for sector in (bytes(512), b"\xff" * 512, random.Random(3).randbytes(512)):
        content = WHOLE[:begin] + sector + WHOLE[begin + 512 :]
        left, damage = read(content)
        lost = sum(rows(WHOLE).values()) - sum(len(table.time_s) for _, table in left.topics)
        # The shortest messages with data here have 14 bytes; of one more at each end a part is lost.
        assert 0 < lost <= 512 // 14 + 2
        # Within a message nothing shows that a value is wrong.
        assert 512 - longest <= damage.count <= 512 + 2 * longest
        assert damage.first is not None
        assert begin - longest <= damage.first <= begin + longest


def test_any_damage_ends_with_rows_that_were_there() -> None:
    random_ = random.Random(16)
    known = {table.name: set(table.time_s.tolist()) for _, table in read(WHOLE)[0].topics}
    for _ in range(150):
        content = bytearray(WHOLE)
        for _ in range(random_.randrange(1, 4)):
            content[random_.randrange(16, len(content))] = random_.randrange(256)
        try:
            tables = read(bytes(content))[0].topics
        except LogFileError:
            continue
        for _, table in tables:
            strange = set(table.time_s.tolist()) - known[table.name]
            assert len(strange) <= 3, "a byte of a time itself"


@pytest.mark.parametrize(
    "formats",
    [
        [b"wind:wind x;"],
        [b"wind:a x;", b"a:b y;", b"b:a z;"],
        [b"wind:uint64_t timestamp;a[60000] x;", b"a:b[60000] y;", b"b:uint8_t[60000] z;"],
        [b"wind:uint64_t timestamp;lost x;"],
        [b"wind:float;"],
        [b"wind"],
        [b"wind:" + b"uint8_t x;" * 6000 + b"b y;", b"b:uint64_t[8191] z;"],
    ],
)
def test_a_definition_without_end_is_damage_and_not_followed(formats: list[bytes]) -> None:
    log = UlogWriter()
    for one in formats:
        log.definitions += message(b"F", one)
    log.data += message(b"A", b"\x00\x07\x00wind") + message(b"D", struct.pack("<HQ", 7, 1))
    content, damage = read(log.content())
    assert content.topics == ()
    assert damage.count > 0


def test_what_was_appended_after_a_crash_is_read() -> None:
    content = px4_log().content()
    cut = places(content)[-40]
    begun = b"\x09\x00D\x01\x02"  # what the crash cut off
    flags = message(b"B", struct.pack("<8s8s3Q", b"", b"\x01", cut + 43 + len(begun), 0, 0))
    whole = content[:16] + flags + content[16:cut] + begun + content[cut:]
    assert rows(whole) == rows(content)
    assert read(whole)[1].count == 0


def test_flags_that_nobody_knows_are_refused() -> None:
    flags = message(b"B", struct.pack("<8s8s3Q", b"", b"\x02", 0, 0, 0))
    with pytest.raises(LogFileError, match="flags that this program does not know"):
        read(WHOLE[:16] + flags + WHOLE[16:])


def test_a_header_cut_off_is_refused() -> None:
    with pytest.raises(LogFileError, match="ends within the header"):
        read(WHOLE[:12])


@pytest.mark.parametrize("tail", [b"\x00", b"\xff"])
def test_memory_that_was_never_written_is_no_damage(tail: bytes) -> None:
    assert read(WHOLE + tail * 200_000)[1].count == 0
    assert rows(WHOLE + tail * 200_000) == rows(WHOLE)


def test_a_hole_larger_than_any_sector_ends_the_log_and_is_told(tmp_path: Path) -> None:
    path = tmp_path / "sparse.ulg"
    with path.open("wb") as file:
        file.write(WHOLE)
        file.truncate(len(WHOLE) + 2 * GIVE_UP_BYTES)
        file.seek(0, 2)
        file.write(WHOLE[16:])
    [record] = read_log(path)
    assert record.duration_s == pytest.approx(50.0)
    [finding] = record.findings
    assert "no message within 16 MiB; nothing after it is read" in finding.message
