from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING

import pytest
from generated_plans import made
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavutil, mavwp
from thinning import examples

from planner.errors import MissionFileError
from planner.mission.commands import Command, load_command_table
from planner.mission.files import read_mission_bytes
from planner.mission.formats.wpl import read_wpl
from planner.mission.items import Mission, MissionItem

if TYPE_CHECKING:
    from pathlib import Path

REALISTIC = (
    b"QGC WPL 110\r\n"
    b"0\t1\t0\t16\t0\t0\t0\t0\t47.3977421\t8.5455936\t488.000000\t1\r\n"
    b"1\t0\t3\t22\t0.0\t0\t0\tnan\t47.3977421\t8.5455936\t20\t1\r\n"
    b"2\t0\t3\t16\t5\t2\t0\t90\t47.3987421\t8.5465936\t20.5\t1\r\n"
    b"# turn back\r\n"
    b"3\t0\t0\t177\t1\t2\t0\t0\t0\t0\t0\t1\r\n"
    b"4 0 3 18 2 0 -20 0 47.3957421 8.5465936 3.5e1 1\r\n"
    b"5\t0\t3\t5001\t3\t0\t0\t0\t47.39\t8.54\t0\t1\r\n"
    b"6\t0\t3\t5001\t3\t0\t0\t0\t47.39\t8.55\t0\t1\r\n"
    b"7\t0\t3\t5001\t3\t0\t0\t0\t47.40\t8.55\t0\t1\r\n"
    b"8\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1\r\n"
)
SNIPPETS = [
    b"\t",
    b"\n",
    b"\r",
    b" ",
    b",",
    b"\0",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"nan",
    b"1e999",
    b"-",
    b"9" * 400,
    b"QGC WPL 120",
    b"#",
    b"RALLY ",
    b"{",
    b"<",
    b"\x1f\x8b",
    b"PK\x03\x04",
    "１２".encode(),
    "−1".encode(),
    b"\x0b\x0c\x1c\x85",
]


@given(data=st.data())
@settings(max_examples=examples(300), deadline=None)
def test_a_mutated_file_is_a_mission_or_a_mission_file_error(data: st.DataObject) -> None:
    content = bytearray(REALISTIC)
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(content)))
        end = min(len(content), at + data.draw(st.integers(0, 30)))
        content[at:end] = data.draw(st.one_of(st.sampled_from(SNIPPETS), st.binary(max_size=8)))
    with contextlib.suppress(MissionFileError):
        check_values(read_mission_bytes(bytes(content), source="m"))


@given(content=st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode)))
@settings(max_examples=examples(200), deadline=None)
def test_any_bytes_are_a_mission_or_a_mission_file_error(content: bytes) -> None:
    with contextlib.suppress(MissionFileError):
        read_mission_bytes(content, source="m")


def check_values(mission: Mission) -> None:
    for item in mission.items:
        values = (item.param1, item.param2, item.param3, item.param4, item.altitude_m)
        assert all(value is None or math.isfinite(value) for value in values)
        assert item.place is not None


def numbers(limit: float) -> st.SearchStrategy[float]:
    # Written with %f by pymavlink, that is with six decimals.
    return st.integers(-round(limit * 1e6), round(limit * 1e6)).map(lambda n: n / 1e6)


FENCE_AND_RALLY = {5000, 5001, 5002, 5003, 5004, 5100}
ITEMS = st.builds(
    made(MissionItem),
    command=st.sampled_from(sorted(set(load_command_table().commands) - FENCE_AND_RALLY)),
    frame=st.sampled_from([0, 2, 3, 10]),
    param1=numbers(1000.0),
    param2=numbers(1000.0),
    param3=numbers(1000.0),
    param4=numbers(360.0),
    latitude_deg=numbers(90.0),
    longitude_deg=numbers(180.0),
    altitude_m=numbers(5000.0),
    autocontinue=st.booleans(),
)
HOME = MissionItem(
    command=Command.NAV_WAYPOINT,
    frame=0,
    param1=0.0,
    param2=0.0,
    param3=0.0,
    param4=0.0,
    latitude_deg=47.0,
    longitude_deg=8.0,
    altitude_m=488.0,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("wpl")


@given(items=st.lists(ITEMS, min_size=1, max_size=12))
@settings(max_examples=examples(100), deadline=None)
def test_a_file_that_pymavlink_wrote_is_read_as_pymavlink_reads_it(
    items: list[MissionItem], folder: Path
) -> None:
    writer = mavwp.MAVWPLoader()
    for item in [HOME, *items]:
        writer.add(
            mavutil.mavlink.MAVLink_mission_item_message(
                0,
                0,
                0,
                item.frame,
                int(item.command),
                0,
                int(item.autocontinue),
                item.param1,
                item.param2,
                item.param3,
                item.param4,
                item.latitude_deg,
                item.longitude_deg,
                item.altitude_m,
            )
        )
    path = folder / "m.waypoints"
    writer.save(str(path))
    reader = mavwp.MAVWPLoader()
    reader.load(str(path))
    mission = read_wpl(path.read_text(), source="m")
    assert mission.home is not None
    assert len(mission.items) == reader.count() - 1
    for number, item in enumerate(mission.items, start=1):
        row = reader.wp(number)
        assert (item.command, item.frame, item.jump_id) == (row.command, row.frame, row.seq)
        assert item.autocontinue == bool(row.autocontinue)
        assert (item.param1, item.param2, item.param3, item.param4) == (
            row.param1,
            row.param2,
            row.param3,
            row.param4,
        )
        assert (item.latitude_deg, item.longitude_deg, item.altitude_m) == (row.x, row.y, row.z)
    assert not {"L150", "L151", "L152", "L153", "L155"} & {f.code for f in mission.findings}
