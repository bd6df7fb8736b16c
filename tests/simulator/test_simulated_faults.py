from __future__ import annotations

import re

import pytest
from hostile_frames import hostile_frames
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_vehicles import MemoryLine, memory_line, request, vehicle, wire
from thinning import examples

from planner.autopilot import Autopilot
from planner.errors import LinkError, UsageError
from planner.link.connection import Purpose
from planner.link.mission import MissionKind
from planner.link.vehicle import VehicleLink
from planner.link.wire import Codec, Message, message
from planner.service.simulation import make_simulated_wire
from planner.simulator.faults import Direction, DirectionFaults, read_faults
from planner.simulator.wire import PassedMessage, is_transfer
from planner.values import replace

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
REQUEST_LIST = message("MISSION_REQUEST_LIST", target_system=1, target_component=1)


def _heard(line: MemoryLine, duration_s: float) -> list[tuple[float, bytes]]:
    """Return the frames that arrive in a time, and when."""
    until_s = line.now_s() + duration_s
    frames: list[tuple[float, bytes]] = []
    while line.now_s() < until_s:
        came = line.receive(until_s - line.now_s())
        frames += [(line.now_s(), data) for _, data in came]
    return frames


def _decoded(frames: list[tuple[float, bytes]]) -> list[Message]:
    codec = Codec(0, 0)
    return [one for _, data in frames for one in codec.decode(data)]


@pytest.mark.parametrize(
    "faults", ["loss=0.3", "duplication=0.3,reordering=0.3", "garbage=0.3,delay=0.1"]
)
def test_the_same_seed_gives_the_same_faults_and_another_gives_others(faults: str) -> None:
    runs = [_heard(memory_line(PX4, f"{faults},seed={seed}"), 15.0) for seed in (5, 5, 6)]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


@given(
    st.builds(
        DirectionFaults,
        loss=st.floats(0.0, 1.0),
        duplication=st.floats(0.0, 1.0),
        reordering=st.floats(0.0, 1.0),
        delay_s=st.floats(0.0, 10.0),
    ),
    st.integers(0, 2**32),
)
@settings(deadline=None, max_examples=examples(50))
def test_nothing_arrives_before_it_was_sent_or_more_than_twice(
    faults: DirectionFaults, seed: int
) -> None:
    direction = Direction(faults, seed)
    for sent_s in range(20):
        arrivals_s = list(direction.arrivals_s(float(sent_s)))
        assert len(arrivals_s) <= 2
        assert all(sent_s + faults.delay_s <= arrival_s for arrival_s in arrivals_s)


def test_the_shares_are_what_is_asked_for() -> None:
    direction = Direction(DirectionFaults(loss=0.2, duplication=0.1), 1)
    counts = [len(list(direction.arrivals_s(0.0))) for _ in range(10_000)]
    # Three standard deviations of a share p of 10,000 are 3 sqrt(p (1 - p) / 10,000).
    assert counts.count(0) / 10_000 == pytest.approx(0.2, abs=0.012)
    assert counts.count(2) / 8_000 == pytest.approx(0.1, abs=0.011)


def test_a_delay_is_how_long_every_message_is_on_its_way() -> None:
    line = memory_line(PX4, "delay=0.5")
    line.send(Codec(245, 190).encode(REQUEST_LIST), None)
    codec = Codec(0, 0)
    counted_s = [
        at_s
        for at_s, data in _heard(line, 3.0)
        for one in codec.decode(data)
        if one.name == "MISSION_COUNT"
    ]
    assert counted_s == [pytest.approx(1.0)]  # half a second there, half back


def test_reordering_lets_later_frames_overtake() -> None:
    times_ms = [
        one["time_boot_ms"]
        for one in _decoded(_heard(memory_line(PX4, "reordering=0.5"), 60.0))
        if one.name in {"ATTITUDE", "GLOBAL_POSITION_INT"}
    ]
    assert times_ms != sorted(times_ms)
    assert len(times_ms) >= 470  # none is lost


@given(st.integers(0, 1000))
@settings(deadline=None, max_examples=examples(10))
def test_garbage_costs_at_most_the_frames_it_stands_before(seed: int) -> None:
    clean = _decoded(_heard(memory_line(PX4), 5.0))
    spoilt = _decoded(_heard(memory_line(PX4, f"garbage=0.3,seed={seed}"), 5.0))
    assert len(spoilt) <= len(clean)
    assert {one.name for one in spoilt} <= {one.name for one in clean}
    assert len(spoilt) > 0.3 * len(clean)


@BOTH
def test_items_that_are_cut_short_are_asked_for_again(autopilot: Autopilot) -> None:
    line = memory_line(autopilot, "truncation=0.4")
    items = VehicleLink(line, name="simulated").fetch_items(MissionKind.MISSION)
    assert items is not None
    assert [item.command for item in items][-4:] == [22, 16, 16, 20]


@BOTH
@pytest.mark.parametrize("seed", range(2))
def test_everything_is_fetched_over_a_bad_line(autopilot: Autopilot, seed: int) -> None:
    faults = f"loss=20%,duplication=5%,reordering=10%,delay=0.1,garbage=2%,seed={seed}"
    line = memory_line(autopilot, faults)
    link = VehicleLink(line, name="simulated")
    expected = vehicle(autopilot)
    for kind in MissionKind:
        items = link.fetch_items(kind)
        held = expected.missions.lists[kind]
        assert items is not None
        assert [(i.command, i.x, i.y, i.z) for i in items] == [
            (i.command, i.x, i.y, i.z) for i in held
        ]
    assert len(link.fetch_parameters()) == len(expected.setup.parameters)


@pytest.mark.parametrize("after", range(10))
def test_after_so_many_messages_of_transfers_nothing_passes(after: int) -> None:
    # A mission of 4 items is 1 request, 1 count, and 4 times a request and an item.
    made = wire(PX4, f"silence={after}")
    passed: list[PassedMessage] = []
    made.on_message = passed.append
    line = MemoryLine(made)
    link = VehicleLink(line, name="simulated")
    with pytest.raises(LinkError):
        link.fetch_items(MissionKind.MISSION)
    answered = [one for one in passed if is_transfer(one.message) and not one.is_to_vehicle]
    assert len(answered) == (after + 1) // 2  # each comes after a request, the last is lost
    assert _heard(line, 10.0) == []


def test_a_silence_may_end() -> None:
    line = memory_line(PX4, "silence=3:5")
    items = VehicleLink(line, name="simulated").fetch_items(MissionKind.MISSION)
    assert items is not None
    assert len(items) == 4
    assert line.now_s() > 5.0


def test_a_twin_has_the_same_system_id_and_another_number() -> None:
    line = memory_line(PX4, "twin")
    ask = message("COMMAND_LONG", target_system=1, target_component=1, command=512, param1=148.0)
    line.send(Codec(245, 190).encode(ask), None)
    versions = [one for one in _decoded(_heard(line, 1.0)) if one.name == "AUTOPILOT_VERSION"]
    assert {one.system for one in versions} == {1}
    assert len({tuple(one["uid2"]) for one in versions}) == 2


def test_a_client_of_ours_notices_the_wrong_count() -> None:
    link = VehicleLink(memory_line(ARDUPILOT, "count=+2,no-files"), name="simulated")
    with pytest.raises(LinkError):
        link.fetch_items(MissionKind.MISSION)


def test_nothing_that_a_fetch_sends_would_do_anything() -> None:
    made = vehicle(PX4)
    link = VehicleLink(MemoryLine(make_simulated_wire(made, request(PX4))), name="simulated")
    link.fetch_items(MissionKind.MISSION)
    link.fetch_parameters()
    link.fetch_state()
    assert not made.acts


@given(st.binary(max_size=400))
@settings(deadline=None, max_examples=examples(20))
def test_bytes_that_are_no_message_change_nothing(data: bytes) -> None:
    line = memory_line(PX4)
    line.send(data, None)
    assert _heard(line, 1.0)


@pytest.mark.parametrize(
    "text",
    [
        "loss",
        "loss=2",
        "loss=-1%",
        "delay=-1",
        "garbage-in=0.1",
        "nonsense=1",
        "silence=x",
        "count=",
    ],
)
def test_a_fault_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(UsageError):
        read_faults(text)


def test_faults_are_of_both_ways_unless_one_is_named() -> None:
    faults = read_faults("loss=20%, delay-in=0.5, duplication-out=0.1, twin, count=-1, seed=7").line
    assert (faults.to_vehicle.loss, faults.from_vehicle.loss) == (0.2, 0.2)
    assert (faults.to_vehicle.delay_s, faults.from_vehicle.delay_s) == (0.5, 0.0)
    assert (faults.to_vehicle.duplication, faults.from_vehicle.duplication) == (0.0, 0.1)
    assert faults.seed == 7


_HOSTILE = (
    *("MISSION_REQUEST_LIST", "MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_COUNT"),
    *("MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_ACK", "MISSION_CLEAR_ALL"),
    *("MISSION_WRITE_PARTIAL_LIST", "MISSION_SET_CURRENT", "PARAM_REQUEST_READ", "PARAM_SET"),
    *("PARAM_REQUEST_LIST", "LOG_REQUEST_LIST", "LOG_REQUEST_DATA", "LOG_REQUEST_END"),
    *("COMMAND_LONG", "COMMAND_INT", "COMMAND_ACK", "TIMESYNC", "PING", "HEARTBEAT"),
    *("REQUEST_DATA_STREAM", "REQUEST_EVENT"),
)


@BOTH
@given(frames=st.lists(hostile_frames(_HOSTILE, sender=(245, 190)), max_size=30))
@settings(deadline=None, max_examples=examples(30))
def test_no_message_breaks_it(autopilot: Autopilot, frames: list[bytes]) -> None:
    made = vehicle(autopilot, authoriser=245)
    line = MemoryLine(make_simulated_wire(made, request(autopilot, authoriser=245)))
    made.arm_at(0.1)
    for frame in frames:
        line.send(frame, None)
        _heard(line, 0.05)
    assert any(one.name == "HEARTBEAT" for one in _decoded(_heard(line, 2.0)))


@BOTH
@pytest.mark.parametrize("after", [0, 1, 2, 5, 6, 9, 10, 11])
def test_an_upload_that_is_cut_anywhere_leaves_px4_with_the_old_or_the_new(
    autopilot: Autopilot, after: int
) -> None:
    # 4 items (5 with ArduPilot's home): a count, then 4 or 5 times a request and an item, a word.
    made = vehicle(autopilot)
    old = list(made.missions.lists[MissionKind.MISSION])
    new = [replace(item, z=item.z + 5.0) for item in old]
    asked = request(autopilot, f"silence={after}")
    link = VehicleLink(
        MemoryLine(make_simulated_wire(made, asked)), name="simulated", purpose=Purpose.UPLOAD
    )
    is_whole = after >= 2 * len(old) + 2
    try:
        link.upload_items(MissionKind.MISSION, new)
    except LinkError:
        assert not is_whole
    heights = [item.z for item in made.missions.lists[MissionKind.MISSION]][-4:]
    wholes = [[item.z for item in one][-4:] for one in (old, new)]
    if autopilot is PX4:
        assert heights in wholes
    if autopilot is ARDUPILOT and after == 6:  # count, request, home, request, first item, …
        assert heights not in wholes


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("garbage", "'garbage' is not a fault: how much is missing"),
        ("loss=much", "'loss=much' is not a fault: 'much' is not a number"),
        ("delay=inf", "without end"),
        ("delay=-1", "less than 0"),
        ("count=two", "'two' is not a whole number"),
        ("silence", "how many is missing"),
        ("silence=-4", "-4 messages cannot pass"),
        ("silence=4:-1", "less than 0"),
        ("twin=maybe", "it takes no value"),
        ("reject", "its value is missing"),
        ("event=No Such!", "is not the name of an event"),
        ("seed=x", "is not a whole number"),
    ],
)
def test_what_is_no_fault_is_refused_with_why_and_an_example(text: str, why: str) -> None:
    with pytest.raises(UsageError, match=re.escape(why)) as refused:
        read_faults(text)
    assert "such as loss=20%" in str(refused.value)
