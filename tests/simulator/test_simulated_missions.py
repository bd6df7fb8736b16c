from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from simulated_vehicles import Bench, named, out_and_back, texts

from planner.autopilot import Autopilot
from planner.link.mission import MissionKind, MissionResult
from planner.link.telemetry import event_number

if TYPE_CHECKING:
    from planner.link.wire import Message

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
ITEM: dict[str, Any] = {
    "frame": 3,
    "command": 16,
    "current": 0,
    "autocontinue": 1,
    "param1": 0.0,
    "param2": 0.0,
    "param3": 0.0,
    "param4": 0.0,
    "x": 470_010_000,
    "y": 80_000_000,
    "z": 30.0,
    "mission_type": 0,
}
TAKEOFF = {**ITEM, "command": 22}


def _one(messages: list[Message]) -> Message:
    assert len(messages) == 1
    return messages[0]


def _upload(
    bench: Bench, items: list[dict[str, Any]], *, name: str = "MISSION_ITEM_INT", kind: int = 0
) -> list[Message]:
    """Send items as fast as they are asked for, and return the last answers."""
    answers = bench.send("MISSION_COUNT", count=len(items), mission_type=kind)
    for number, item in enumerate(items):
        request = _one(answers)
        assert request.name in {"MISSION_REQUEST", "MISSION_REQUEST_INT"}
        assert request["seq"] == number
        answers = bench.send(name, **{**item, "seq": number, "mission_type": kind})
    return answers


def _held(bench: Bench, kind: MissionKind = MissionKind.MISSION) -> list[float]:
    """Return the height of each item that it has."""
    return [item.z for item in bench.vehicle.missions.lists[kind]]


@BOTH
def test_the_list_is_counted_and_sent_item_by_item(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    count = _one(bench.send("MISSION_REQUEST_LIST", mission_type=0))
    first = int(autopilot is ARDUPILOT)
    assert count["count"] == len(out_and_back().items) + first
    items = [
        _one(bench.send("MISSION_REQUEST_INT", seq=seq, mission_type=0))
        for seq in range(count["count"])
    ]
    assert [item["command"] for item in items[first:]] == [22, 16, 16, 20]
    assert [item["seq"] for item in items] == list(range(count["count"]))
    assert items[first + 1]["x"] == round((47.0 + 500.0 / 111_176.0) * 1e7)


def test_the_first_item_of_ardupilot_is_its_home() -> None:
    bench = Bench(ARDUPILOT)
    bench.send("MISSION_REQUEST_LIST", mission_type=0)
    home = _one(bench.send("MISSION_REQUEST_INT", seq=0, mission_type=0))
    assert (home["command"], home["frame"]) == (16, 0)
    assert (home["x"], home["y"], home["z"]) == (470_000_000, 80_000_000, 400.0)


@BOTH
def test_the_older_request_is_answered_in_degrees(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    bench.send("MISSION_REQUEST_LIST", mission_type=0)
    bench.send("MISSION_REQUEST", seq=0, mission_type=0)  # PX4 sends them in their order
    item = _one(bench.send("MISSION_REQUEST", seq=1, mission_type=0))
    assert item.name == "MISSION_ITEM"
    expected_deg = 47.0 if autopilot is ARDUPILOT else 47.0 + 500.0 / 111_176.0
    assert item["x"] == pytest.approx(expected_deg, abs=1e-7)  # the last of MAVLink's digits


def test_px4_sends_no_item_that_no_list_was_asked_for() -> None:
    assert Bench(PX4).send("MISSION_REQUEST_INT", seq=0, mission_type=0) == []
    assert len(Bench(ARDUPILOT).send("MISSION_REQUEST_INT", seq=0, mission_type=0)) == 1


def test_px4_forgets_a_download_after_five_seconds_of_silence() -> None:
    bench = Bench(PX4)
    bench.send("MISSION_REQUEST_LIST", mission_type=0)
    bench.wait(5.1)
    assert bench.send("MISSION_REQUEST_INT", seq=0, mission_type=0) == []


@pytest.mark.parametrize(
    ("autopilot", "kind", "result"),
    [
        (PX4, MissionKind.MISSION, MissionResult.ERROR),
        (PX4, MissionKind.FENCE, MissionResult.ERROR),
        (ARDUPILOT, MissionKind.MISSION, MissionResult.ERROR),
        (ARDUPILOT, MissionKind.FENCE, MissionResult.INVALID_SEQUENCE),
    ],
)
def test_an_item_beyond_the_list_is_refused(
    autopilot: Autopilot, kind: MissionKind, result: MissionResult
) -> None:
    bench = Bench(autopilot)
    count = _one(bench.send("MISSION_REQUEST_LIST", mission_type=int(kind)))["count"]
    said = bench.send("MISSION_REQUEST_INT", seq=99, mission_type=int(kind))
    assert _one(named("MISSION_ACK", said))["type"] == result
    # ArduPilot says again how many there are of a mission.
    is_told = autopilot is ARDUPILOT and kind is MissionKind.MISSION
    assert [one["count"] for one in named("MISSION_COUNT", said)] == [count] * is_told


def test_px4_takes_no_mission_while_it_sends_one() -> None:
    bench = Bench(PX4)
    bench.send("MISSION_REQUEST_LIST", mission_type=1)
    said = bench.send("MISSION_COUNT", count=2, mission_type=0)
    assert _one(named("MISSION_ACK", said))["type"] == MissionResult.ERROR
    assert texts(said) == ["WPM: IGN MISSION_COUNT: Busy\t"]
    bench.wait(5.1)  # the last word on the download was lost
    assert named("MISSION_REQUEST", bench.send("MISSION_COUNT", count=2, mission_type=0))


def test_px4_sends_one_list_at_a_time() -> None:
    bench = Bench(PX4)
    bench.send("MISSION_REQUEST_LIST", mission_type=0)
    said = bench.send("MISSION_REQUEST_LIST", mission_type=1)
    assert texts(said) == ["Mission download request ignored, already active\t"]
    bench.send("MISSION_ACK", type=0, mission_type=0)
    assert named("MISSION_COUNT", bench.send("MISSION_REQUEST_LIST", mission_type=1))


def test_px4_tells_its_lists_by_numbers_that_change_with_them() -> None:
    bench = Bench(PX4)
    current = bench.wait_for("MISSION_CURRENT", 1.5)[-1]
    count = _one(bench.send("MISSION_REQUEST_LIST", mission_type=1))
    assert current["fence_id"] == count["opaque_id"] != 0
    bench.send("MISSION_ACK", type=0, mission_type=1)
    _upload(bench, [TAKEOFF, ITEM])
    changed = bench.wait_for("MISSION_CURRENT", 1.5)[-1]
    assert changed["mission_id"] not in {0, current["mission_id"]}
    assert changed["fence_id"] == current["fence_id"]
    ardupilot = Bench(ARDUPILOT).wait_for("MISSION_CURRENT", 1.5)[-1]
    assert {ardupilot[f"{name}_id"] for name in ("mission", "fence", "rally_points")} == {0}


def test_px4_has_no_mission_while_it_would_not_fly_it_and_judges_the_same_one_once() -> None:
    bench = Bench(PX4)
    delay = {**ITEM, "command": 112, "frame": 2, "x": 0, "y": 0}
    said = _upload(bench, [TAKEOFF, delay])
    (event,) = named("EVENT", said)
    assert (event["id"], event["arguments"]) == (
        event_number("navigator_mis_unsup_cmd"),
        b"\x02\x00",
    )
    assert bench.wait_for("MISSION_CURRENT", 1.5)[-1]["mission_state"] == 1
    assert texts(_upload(bench, [TAKEOFF, delay])) == []
    assert bench.wait_for("MISSION_CURRENT", 1.5)[-1]["mission_state"] == 1


@BOTH
def test_an_uploaded_mission_is_the_one_it_has(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    ack = _upload(bench, [TAKEOFF, {**ITEM, "z": 31.0}, {**ITEM, "z": 32.0}])[-1]
    assert (ack.name, ack["type"]) == ("MISSION_ACK", MissionResult.ACCEPTED)
    first = 30.0 if autopilot is PX4 else 400.0  # ArduPilot keeps its home in the first place
    assert _held(bench) == [first, 31.0, 32.0]


def test_px4_asks_in_the_newer_way_once_it_was_answered_so() -> None:
    bench = Bench(PX4)
    assert _one(bench.send("MISSION_COUNT", count=2, mission_type=0)).name == "MISSION_REQUEST"
    asked = _one(bench.send("MISSION_ITEM_INT", **{**TAKEOFF, "seq": 0}))
    assert asked.name == "MISSION_REQUEST_INT"


def test_px4_asks_in_the_newer_way_once_it_was_told_that_the_older_is_not_known() -> None:
    bench = Bench(PX4)
    bench.send("MISSION_COUNT", count=2, mission_type=0)
    refusal = {"type": int(MissionResult.UNSUPPORTED), "mission_type": 0}
    assert _one(bench.send("MISSION_ACK", **refusal)).name == "MISSION_REQUEST_INT"


def test_ardupilot_always_asks_in_the_older_way() -> None:
    bench = Bench(ARDUPILOT)
    assert _one(bench.send("MISSION_COUNT", count=2, mission_type=0)).name == "MISSION_REQUEST"
    asked = _one(bench.send("MISSION_ITEM_INT", **{**TAKEOFF, "seq": 0}))
    assert asked.name == "MISSION_REQUEST"


@BOTH
def test_items_in_degrees_are_the_same_items(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    degrees = {**ITEM, "x": 47.001, "y": 8.0}
    _upload(bench, [degrees, degrees], name="MISSION_ITEM")
    item = bench.vehicle.missions.lists[MissionKind.MISSION][1]
    assert (item.x, item.y) == (470_010_000, 80_000_000)


def test_px4_keeps_the_old_mission_when_the_upload_breaks_off() -> None:
    bench = Bench(PX4)
    before = _held(bench)
    bench.send("MISSION_COUNT", count=3, mission_type=0)
    bench.send("MISSION_ITEM_INT", **{**TAKEOFF, "seq": 0})
    bench.send("MISSION_ITEM_INT", **{**ITEM, "seq": 1})
    assert "Operation timeout" in texts(bench.wait(6.0))
    assert _held(bench) == before


def test_ardupilot_is_left_with_a_mixture_when_the_upload_breaks_off() -> None:
    bench = Bench(ARDUPILOT)
    before = _held(bench)
    bench.send("MISSION_COUNT", count=4, mission_type=0)
    bench.send("MISSION_ITEM_INT", **{**ITEM, "seq": 0})
    bench.send("MISSION_ITEM_INT", **{**ITEM, "seq": 1, "z": 77.0})
    acks = bench.wait_for("MISSION_ACK")
    assert [ack["type"] for ack in acks] == [MissionResult.OPERATION_CANCELLED]
    assert _held(bench) == [before[0], 77.0, *before[2:4]]


@pytest.mark.parametrize(("autopilot", "least"), [(PX4, 15), (ARDUPILOT, 6)])
def test_an_item_that_does_not_come_is_asked_for_again(autopilot: Autopilot, least: int) -> None:
    # PX4 every 0.25 s for 5 s, ArduPilot every second for 8 s.
    bench = Bench(autopilot)
    bench.send("MISSION_COUNT", count=3, mission_type=0)
    requests = bench.wait_for("MISSION_REQUEST", 20.0)
    assert least <= len(requests) <= 20
    assert {request["seq"] for request in requests} == {0}


@pytest.mark.parametrize(
    ("autopilot", "result"), [(PX4, MissionResult.ACCEPTED), (ARDUPILOT, MissionResult.ERROR)]
)
def test_a_last_item_that_comes_twice(autopilot: Autopilot, result: MissionResult) -> None:
    # PX4 takes it that its word was lost; ArduPilot waits for no item.
    bench = Bench(autopilot)
    _upload(bench, [TAKEOFF, ITEM])
    ack = _one(bench.send("MISSION_ITEM_INT", **{**ITEM, "seq": 1}))
    assert ack["type"] == result


def test_ardupilot_says_that_an_item_is_out_of_order_and_goes_on() -> None:
    bench = Bench(ARDUPILOT)
    bench.send("MISSION_COUNT", count=2, mission_type=0)
    ack = _one(bench.send("MISSION_ITEM_INT", **{**ITEM, "seq": 1}))
    assert ack["type"] == MissionResult.INVALID_SEQUENCE
    assert _one(bench.send("MISSION_ITEM_INT", **{**ITEM, "seq": 0}))["seq"] == 1


@pytest.mark.parametrize(
    ("changes", "result"),
    [
        ({"command": 82}, MissionResult.UNSUPPORTED),  # NAV_SPLINE_WAYPOINT
        ({"frame": 10}, MissionResult.UNSUPPORTED_FRAME),
    ],
)
def test_px4_refuses_what_it_does_not_know_and_keeps_the_old_mission(
    changes: dict[str, int], result: MissionResult
) -> None:
    bench = Bench(PX4)
    before = _held(bench)
    ack = _upload(bench, [TAKEOFF, {**ITEM, **changes}])[-1]
    assert (ack.name, ack["type"]) == ("MISSION_ACK", result)
    assert _held(bench) == before


def test_too_many_items_have_no_space() -> None:
    ack = _one(Bench(PX4).send("MISSION_COUNT", count=2001, mission_type=0))
    assert ack["type"] == MissionResult.NO_SPACE


@BOTH
@pytest.mark.parametrize("kind", [MissionKind.FENCE, MissionKind.RALLY])
def test_fence_and_rally_points_are_whole_or_as_before(
    autopilot: Autopilot, kind: MissionKind
) -> None:
    bench = Bench(autopilot)
    before = _held(bench, kind)
    assert before
    command = 5003 if kind is MissionKind.FENCE else 5100
    item = {**ITEM, "command": command, "param1": 50.0, "z": 12.0}
    bench.send("MISSION_COUNT", count=2, mission_type=int(kind))
    bench.send("MISSION_ITEM_INT", **{**item, "seq": 0, "mission_type": int(kind)})
    bench.wait(20.0)
    # ArduPilot writes rally points one by one, as the items of a mission.
    is_mixed = autopilot is ARDUPILOT and kind is MissionKind.RALLY
    assert _held(bench, kind) == ([12.0] if is_mixed else before)
    assert _upload(bench, [item, item], kind=int(kind))[-1]["type"] == MissionResult.ACCEPTED
    height_m = 0.0 if autopilot is ARDUPILOT and kind is MissionKind.FENCE else 12.0
    assert _held(bench, kind) == [height_m, height_m]


@BOTH
def test_everything_is_cleared_at_once(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    ack = _one(bench.send("MISSION_CLEAR_ALL", mission_type=255))
    assert ack["type"] == MissionResult.ACCEPTED
    # Of ArduPilot's, home is gone as well: its list has 0 items until one is uploaded.
    assert [len(_held(bench, kind)) for kind in MissionKind] == [0, 0, 0]


def test_ardupilot_takes_a_part_and_px4_does_not_know_it() -> None:
    bench = Bench(ARDUPILOT)
    before = _held(bench)
    part = {"start_index": 2, "end_index": 2, "mission_type": 0}
    assert _one(bench.send("MISSION_WRITE_PARTIAL_LIST", **part))["seq"] == 2
    ack = bench.send("MISSION_ITEM_INT", **{**ITEM, "seq": 2, "z": 55.0})[-1]
    assert ack["type"] == MissionResult.ACCEPTED
    assert _held(bench) == [*before[:2], 55.0, *before[3:]]
    assert Bench(PX4).send("MISSION_WRITE_PARTIAL_LIST", **part) == []


def test_ardupilot_keeps_whole_seconds_and_centimetres() -> None:
    bench = Bench(ARDUPILOT)
    _upload(bench, [ITEM, {**ITEM, "param1": 2.7, "param2": 5.0, "z": 30.126}])
    item = bench.vehicle.missions.lists[MissionKind.MISSION][1]
    assert (item.param1, item.param2, item.z) == (2.0, 0.0, 30.12)


def test_px4_names_its_frames_after_the_message() -> None:
    bench = Bench(PX4)
    _upload(bench, [TAKEOFF, {**ITEM, "frame": 0}])
    frames = [item.frame for item in bench.vehicle.missions.lists[MissionKind.MISSION]]
    assert frames == [6, 5]


@BOTH
def test_a_second_ground_station_has_to_wait(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    bench.send("MISSION_COUNT", count=2, mission_type=0)
    answers = bench.send("MISSION_COUNT", sender=250, count=2, mission_type=0)
    busy = MissionResult.ERROR if autopilot is PX4 else MissionResult.DENIED
    assert _one(named("MISSION_ACK", answers))["type"] == busy


def test_a_mission_that_px4_will_not_fly_is_taken_and_then_spoken_against() -> None:
    bench = Bench(PX4, "reject=Mission rejected: too far")
    answers = _upload(bench, [TAKEOFF, ITEM])
    assert _one(named("MISSION_ACK", answers))["type"] == MissionResult.ACCEPTED
    assert texts(answers) == ["Mission rejected: too far"]
    bench.vehicle.arm_at(bench.now_s)
    assert "Mission rejected: too far" in texts(bench.wait(1.0))
    assert not bench.vehicle.is_flying


def test_px4_takes_a_delay_condition_and_then_will_not_fly_it() -> None:
    bench = Bench(PX4)
    delay = {**ITEM, "command": 112, "frame": 2, "x": 0, "y": 0}  # CONDITION_DELAY
    assert texts(_upload(bench, [TAKEOFF, delay])) == [
        "Mission rejected: item 2: unsupported cmd: 112\t"
    ]


def test_a_count_may_be_wrong() -> None:
    right = _one(Bench(PX4).send("MISSION_REQUEST_LIST", mission_type=0))["count"]
    wrong = _one(Bench(PX4, "count=+3").send("MISSION_REQUEST_LIST", mission_type=0))["count"]
    assert wrong == right + 3


def test_a_long_objection_comes_in_chunks_of_one_text() -> None:
    objection = "Mission rejected: " + "much too far away from home; " * 4
    chunks = named("STATUSTEXT", _upload(Bench(PX4, f"reject={objection}"), [TAKEOFF, ITEM]))
    assert len(chunks) == 3  # 134 bytes, 50 in each
    assert "".join(chunk["text"] for chunk in chunks) == objection.strip()
    assert [chunk["chunk_seq"] for chunk in chunks] == [0, 1, 2]
    assert len({chunk["id"] for chunk in chunks} | {0}) == 2


@pytest.mark.parametrize("place", [float("nan"), float("inf"), 1e30])
def test_a_place_that_is_none_is_refused(place: float) -> None:
    bench = Bench(PX4)
    before = _held(bench)
    ack = _upload(bench, [{**TAKEOFF, "x": place, "y": 8.0}], name="MISSION_ITEM")[-1]
    assert ack["type"] == MissionResult.INVALID_PARAM5_X
    assert _held(bench) == before


def test_ardupilot_refuses_a_value_that_is_no_number() -> None:
    ack = _upload(Bench(ARDUPILOT), [ITEM, {**ITEM, "param2": float("nan")}])[-1]
    assert ack["type"] == MissionResult.INVALID_PARAM2
