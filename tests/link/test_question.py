from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_vehicles import memory_line
from thinning import examples

from planner.autopilot import Autopilot
from planner.link.mission import ListIdRequest, MissionKind
from planner.link.transfers import (
    LinkSettings,
    MessageRequest,
    MessageRequests,
    ParameterHashRequest,
)
from planner.link.vehicle import VehicleLink
from planner.link.wire import Message

ACCEPTED, FOR_NOW, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = 0, 1, 2, 3, 4, 5
HOME = Message(name="HOME_POSITION", fields={"latitude": 1}, system=1, component=1)


def _word(result: int, command: int = 512) -> Message:
    return Message(name="COMMAND_ACK", fields={"command": command, "result": result}, system=1)


def _question(*, stray: int = 0, retries: int = 3) -> MessageRequest:
    made = MessageRequest("HOME_POSITION", 242, LinkSettings(), retries=retries, stray=stray)
    (sent,) = made.begin(0.0)
    assert (sent["command"], sent["param1"]) == (512, 242.0)
    return made


@pytest.mark.parametrize("result", [DENIED, UNSUPPORTED, FAILED])
def test_a_vehicle_that_has_no_such_message_is_not_asked_again(result: int) -> None:
    question = _question()
    question.feed(_word(result), 0.1)
    assert question.is_done
    assert question.is_heard
    assert question.answer is None


@pytest.mark.parametrize("result", [ACCEPTED, FOR_NOW, IN_PROGRESS])
def test_a_word_that_promises_it_is_waited_upon(result: int) -> None:
    question = _question()
    question.feed(_word(result), 0.1)
    question.feed(_word(DENIED, command=511), 0.2)
    assert not question.is_done
    question.feed(HOME, 0.3)
    assert question.answer is HOME


def test_a_word_to_an_earlier_question_ends_no_later_one() -> None:
    # Asked twice for what it has not, the vehicle says so twice: the second word comes late.
    question = _question(stray=1)
    question.feed(_word(DENIED), 0.1)
    assert not question.is_done
    question.feed(HOME, 0.2)
    assert question.answer is HOME
    other = _question(stray=1)
    for _ in range(2):
        other.feed(_word(DENIED), 0.1)
    assert other.is_done


def test_who_says_nothing_is_asked_as_often_as_may_be_and_was_not_heard() -> None:
    question = _question(retries=3)
    for _ in range(4):
        question.expire(question.deadline_s)
    assert question.is_done
    assert not question.is_heard
    assert question.stray == 4  # each may still be answered


def test_a_fresh_answer_was_sent_after_the_echo_of_its_question() -> None:
    question = ListIdRequest(MissionKind.FENCE, LinkSettings(), retries=3)
    echoed, asked = question.begin(0.0)
    assert (echoed.name, echoed["tc1"], asked.name) == ("TIMESYNC", 0, "MISSION_REQUEST_LIST")

    def count(number: int, kind: MissionKind = MissionKind.FENCE) -> Message:
        fields = {"count": 3, "mission_type": kind, "opaque_id": number}
        return Message(name="MISSION_COUNT", fields=fields, system=1)

    def echo(token: int) -> Message:
        return Message(name="TIMESYNC", fields={"tc1": 5, "ts1": token}, system=1)

    question.feed(count(1), 0.1)  # under way before
    question.feed(echo(echoed["ts1"] + 1), 0.2)  # of another station
    question.feed(count(1), 0.2)
    assert not question.is_done
    question.feed(echo(echoed["ts1"]), 0.3)
    question.feed(count(7, MissionKind.MISSION), 0.3)
    assert not question.is_done
    question.feed(count(2), 0.3)
    assert question.list_id == 2


def test_a_hash_is_the_four_bytes_of_its_value() -> None:
    question = ParameterHashRequest(LinkSettings(), retries=1)
    question.begin(0.0)
    fields = {"param_id": "MPC_XY_CRUISE", "param_bytes": b"abcd"}
    question.feed(Message(name="PARAM_VALUE", fields=fields), 0.1)
    assert question.content is None
    question.feed(Message(name="PARAM_VALUE", fields={**fields, "param_id": "_HASH_CHECK"}), 0.1)
    assert question.content == b"abcd"


def _requests(*, stray: int = 0) -> MessageRequests:
    wanted = {"HOME_POSITION": 242, "SYS_STATUS": 1, "WIND": 168}
    made = MessageRequests(wanted, LinkSettings(), retries=6, stray=stray)
    assert [one["param1"] for one in made.begin(0.0)] == [242.0, 1.0, 168.0]
    return made


STATUS = Message(name="SYS_STATUS", fields={}, system=1, component=1)


def test_what_is_accepted_and_never_sent_is_not_waited_for_as_long_as_what_is_lost() -> None:
    requests = _requests()
    now_s = 0.01
    for result in (ACCEPTED, ACCEPTED, ACCEPTED):
        requests.feed(_word(result), now_s)
    requests.feed(STATUS, now_s)
    rounds = 1
    while not requests.is_done:
        now_s = requests.deadline_s
        rounds += bool(requests.expire(now_s))
        for _ in requests.missing:
            requests.feed(_word(ACCEPTED), now_s + 0.01)
    assert requests.missing.keys() == {"HOME_POSITION", "WIND"}
    assert rounds == 3
    assert now_s < 2.0  # 0.2, 0.4 and 0.8 s of waiting; four times as long without the word


def test_what_is_refused_twice_is_done_without_at_once() -> None:
    requests = _requests()
    requests.feed(STATUS, 0.01)
    requests.feed(HOME, 0.01)
    for result in (ACCEPTED, ACCEPTED):
        requests.feed(_word(result), 0.01)
    (again,) = requests.feed(_word(FAILED), 0.01)
    assert again["param1"] == 168.0
    requests.feed(_word(FAILED), 0.02)
    assert requests.is_done
    assert requests.missing.keys() == {"WIND"}


def test_refusals_of_an_earlier_round_end_no_later_one() -> None:
    requests = _requests(stray=1)
    requests.feed(_word(DENIED), 0.01)  # to a question before
    requests.feed(STATUS, 0.01)
    assert len(requests.expire(1.5)) == 2  # the three words are under way
    for _ in range(3):
        assert not requests.feed(_word(DENIED), 1.6)
    requests.feed(HOME, 1.7)
    requests.feed(_word(ACCEPTED), 1.7)
    assert len(requests.feed(_word(DENIED), 1.7)) == 1
    requests.feed(_word(DENIED), 1.8)
    assert requests.is_done
    assert requests.missing.keys() == {"WIND"}


def test_who_gives_no_word_is_asked_as_often_as_may_be() -> None:
    requests = _requests()
    asked = 1
    while not requests.is_done:
        asked += bool(requests.expire(requests.deadline_s))
    assert asked == 7


@given(st.integers(0, 10_000))
@settings(max_examples=examples(4), deadline=None)
def test_through_loss_a_state_that_the_vehicle_has_is_read_whole(seed: int) -> None:
    faults = f"loss=10%,duplication=10%,delay=0.4,seed={seed}"
    link = VehicleLink(memory_line(Autopilot.PX4, faults), name="simulated")
    for _ in range(3):
        link.connection.telemetry.forget("HOME_POSITION")
        state = link.fetch_state()
        assert state.home is not None
        assert state.battery is not None
        assert state.is_landed is not None


@given(st.integers(0, 10_000))
@settings(max_examples=examples(10), deadline=None)
def test_through_loss_a_home_that_the_vehicle_has_is_never_taken_to_be_none(seed: int) -> None:
    # PX4 denies WIND, which is ArduPilot's: words to it must not be taken for words about home.
    link = VehicleLink(
        memory_line(Autopilot.PX4, f"loss=10%,delay=0.9,seed={seed}"), name="simulated"
    )
    for _ in range(3):
        assert link._ask("WIND", 168, retries=6).answer is None
        assert link._ask("HOME_POSITION", 242, retries=12).answer is not None
