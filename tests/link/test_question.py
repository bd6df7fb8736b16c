from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_vehicles import memory_line

from planner.autopilot import Autopilot
from planner.link.mission import ListIdRequest, MissionKind
from planner.link.transfers import LinkSettings, MessageRequest, ParameterHashRequest
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


@given(st.integers(0, 10_000))
@settings(max_examples=10, deadline=None)
def test_through_loss_a_home_that_the_vehicle_has_is_never_taken_to_be_none(seed: int) -> None:
    # PX4 denies WIND, which is ArduPilot's: words to it must not be taken for words about home.
    link = VehicleLink(
        memory_line(Autopilot.PX4, f"loss=10%,delay=0.9,seed={seed}"), name="simulated"
    )
    for _ in range(3):
        assert link._ask("WIND", 168, retries=6).answer is None
        assert link._ask("HOME_POSITION", 242, retries=12).answer is not None
