from __future__ import annotations

import pytest
from simulated_vehicles import Bench, named

from planner.autopilot import Autopilot

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])


def _downloaded(bench: Bench, number: int, offset: int, count: int) -> bytes:
    """Return the content of what was asked for, in the order of its offsets."""
    sent = bench.send("LOG_REQUEST_DATA", id=number, ofs=offset, count=count)
    pieces = named("LOG_DATA", sent + bench.wait(10.0))
    assert {piece["id"] for piece in pieces} == {number}
    return b"".join(
        bytes(piece["data"])[: piece["count"]] for piece in sorted(pieces, key=lambda p: p["ofs"])
    )


@BOTH
def test_a_log_is_listed_with_its_size_and_sent_whole(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    (log,) = bench.vehicle.setup.logs
    (entry,) = bench.send("LOG_REQUEST_LIST", start=0, end=65_535)
    assert (entry["size"], entry["num_logs"]) == (len(log.content), 1)
    assert entry["id"] == int(autopilot is ARDUPILOT)  # ArduPilot counts from 1
    assert _downloaded(bench, entry["id"], 0, 0xFFFFFFFF) == log.content


@BOTH
@pytest.mark.parametrize(("offset", "count"), [(0, 90), (90, 45), (450, 1000)])
def test_a_part_of_a_log_is_what_stands_there(
    autopilot: Autopilot, offset: int, count: int
) -> None:
    bench = Bench(autopilot)
    (log,) = bench.vehicle.setup.logs
    number = int(autopilot is ARDUPILOT)
    assert _downloaded(bench, number, offset, count) == log.content[offset : offset + count]


def test_a_download_stops_when_it_is_told_to() -> None:
    bench = Bench(PX4)
    bench.send("LOG_REQUEST_DATA", id=0, ofs=0, count=0xFFFFFFFF)
    bench.send("LOG_REQUEST_END")
    assert bench.wait_for("LOG_DATA") == []


def test_nothing_is_sent_of_a_log_that_is_not_there() -> None:
    assert Bench(PX4).send("LOG_REQUEST_DATA", id=5, ofs=0, count=90) == []
