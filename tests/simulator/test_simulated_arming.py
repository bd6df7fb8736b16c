from __future__ import annotations

import pytest
from simulated_vehicles import Bench, named, texts

from planner.autopilot import Autopilot

AUTHORISER = 10
REQUEST = 3001
ACCEPTED, TEMPORARILY_REJECTED, DENIED, IN_PROGRESS = 0, 1, 2, 5


def _asking(**given: float) -> Bench:
    """Return a vehicle that has asked its authoriser."""
    bench = Bench(Autopilot.PX4, authoriser=AUTHORISER, given=given)
    bench.vehicle.arm_at(bench.now_s + 1.0)
    (asked,) = named("COMMAND_LONG", bench.wait(1.0))
    assert (asked["command"], asked["target_system"]) == (REQUEST, AUTHORISER)
    assert asked.fields.get("param1", 0.0) == 0.0  # PX4 says no more
    return bench


def _answer(
    bench: Bench, result: int, *, sender: int = AUTHORISER, reason: int = 0, extra: int = 0
) -> list[str]:
    return texts(
        bench.send(
            "COMMAND_ACK",
            sender=sender,
            command=REQUEST,
            result=result,
            progress=reason,
            result_param2=extra,
        )
    )


def test_it_flies_once_its_authoriser_lets_it() -> None:
    bench = _asking()
    assert any("authorised" in text for text in _answer(bench, ACCEPTED, extra=30))
    assert bench.vehicle.is_flying
    assert bench.vehicle.arming.authorised_s == 30.0


@pytest.mark.parametrize(
    ("reason", "extra", "text"),
    [
        (2, 7, "Arming denied: invalid waypoint 7"),
        (5, 0, "Arming denied: bad weather"),
        (0, 120, "Arming denied: generic"),
        (99, 0, "Arming denied: reason 99"),
    ],
)
def test_it_says_why_it_was_not_let(reason: int, extra: int, text: str) -> None:
    bench = _asking()
    assert text in _answer(bench, DENIED, reason=reason, extra=extra)
    assert bench.vehicle.arming.denial == (reason, extra)
    assert not bench.vehicle.is_flying


def test_it_stays_where_it_is_when_told_to_wait() -> None:
    bench = _asking()
    assert "Arming denied by authorizer: wait" in _answer(bench, TEMPORARILY_REJECTED)
    assert not bench.vehicle.is_flying


def test_it_asks_again_every_half_second_and_stays_where_it_is_when_nobody_answers() -> None:
    bench = _asking(COM_ARM_AUTH_TO=5.0)
    said = bench.wait(4.9)
    assert [one["confirmation"] for one in named("COMMAND_LONG", said)] == [1, 2, 3]
    assert texts(said) == []
    assert texts(bench.wait(0.2)) == ["Arming denied: no answer by authorizer"]
    _answer(bench, ACCEPTED)
    assert not bench.vehicle.is_flying


def test_an_answer_that_is_on_its_way_lengthens_nothing() -> None:
    bench = _asking()
    bench.wait(0.4)
    _answer(bench, IN_PROGRESS)
    said = bench.wait(0.7)  # PX4 waits a second in all, and does not ask who is at it again
    assert named("COMMAND_LONG", said) == []
    assert texts(said) == ["Arming denied: no answer by authorizer"]


def test_in_two_steps_the_first_try_asks_and_another_one_arms_as_long_as_it_holds() -> None:
    bench = _asking(COM_ARM_AUTH_MET=1)
    said = _answer(bench, ACCEPTED, extra=10)
    assert said[-1] == "SIMULATED: arming authorised, arm again"
    assert not bench.vehicle.is_flying
    bench.vehicle.arm_at(bench.now_s + 9.0)
    assert named("COMMAND_LONG", bench.wait(9.1)) == []
    assert bench.vehicle.is_flying


def test_in_two_steps_an_approval_that_has_run_out_is_asked_for_again() -> None:
    bench = _asking(COM_ARM_AUTH_MET=1)
    _answer(bench, ACCEPTED, extra=10)
    bench.vehicle.arm_at(bench.now_s + 10.5)
    assert named("COMMAND_LONG", bench.wait(10.6))
    assert not bench.vehicle.is_flying


def test_anybody_on_the_line_can_authorise_it_who_names_it() -> None:
    # PX4 looks at the system that is answered, and not at who answers.
    bench = _asking()
    ack = {"command": REQUEST, "result": ACCEPTED, "progress": 0, "result_param2": 30}
    bench.send("COMMAND_ACK", sender=99, **ack, target_system=0)
    assert not bench.vehicle.is_flying
    _answer(bench, ACCEPTED, sender=99)
    assert bench.vehicle.is_flying


def test_it_asks_again_when_it_tries_again() -> None:
    bench = _asking()
    _answer(bench, DENIED)
    bench.vehicle.arm_at(bench.now_s)
    assert len(named("COMMAND_LONG", bench.wait(0.1))) == 1
    _answer(bench, ACCEPTED)
    assert bench.vehicle.is_flying


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_without_an_authoriser_it_asks_nobody(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    bench.vehicle.arm_at(bench.now_s)
    assert named("COMMAND_LONG", bench.wait(0.1)) == []
    assert bench.vehicle.is_flying


def test_without_a_mission_it_does_not_arm() -> None:
    bench = Bench(Autopilot.PX4)
    bench.send("MISSION_CLEAR_ALL", mission_type=0)
    bench.vehicle.arm_at(bench.now_s)
    assert "Arming denied: no mission that can be flown" in texts(bench.wait(0.1))
    assert not bench.vehicle.is_flying


def test_it_tries_again_until_it_may_and_then_no_more() -> None:
    bench = Bench(Autopilot.PX4, authoriser=AUTHORISER)
    bench.vehicle.arm_at(bench.now_s, retry_s=5.0)
    # Asked at 0, 5 and 10 s; each time nobody answers for 1 s, in which it asks once more.
    asked = named("COMMAND_LONG", bench.wait(10.0))
    assert [one["confirmation"] for one in asked] == [0, 1, 0, 1, 0]
    _answer(bench, ACCEPTED)
    assert bench.vehicle.is_flying
    assert named("COMMAND_LONG", bench.wait(20.0)) == []
