"""The guard in virtual time: what it accepts, what it rejects and why, what it announces."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.findings import Finding, Severity
from planner.guard.authorisation import (
    ArmRequest,
    ArmResult,
    DenialReason,
    Judgement,
    Verdict,
    arming_settings,
    go_judgement,
    no_go_judgement,
    unknown_judgement,
)
from planner.guard.decision import (
    READ_PARTS,
    Action,
    Announce,
    AnswerRequest,
    ArmingStatus,
    ArmRequested,
    CheckVehicle,
    Decision,
    Event,
    Guard,
    GuardSettings,
    Judged,
    MessageHeard,
    PartChanged,
    PartRead,
    PartUnread,
    ReadParts,
    TimePassed,
    VehiclePart,
    Withdraw,
)

TOLD_PARTS = (VehiclePart.HOME, VehiclePart.BATTERY)
GO = go_judgement(margin_wh=12.0)
NO_GO = no_go_judgement(
    [
        Finding(
            code="M105", name="unsupported-command", severity=Severity.ERROR, message="…", item=7
        )
    ],
    fail_on=Severity.ERROR,
)
REQUEST = ArmRequest(system=1, component=1)


@dataclass
class Bench:
    """A guard with a vehicle that does as it is asked, at once unless told otherwise."""

    settings: GuardSettings = field(default_factory=GuardSettings)
    judgement: Judgement = GO
    is_reading: bool = True
    """Whether what is asked for is read."""
    is_checking: bool = True
    now_s: float = 100.0
    contents: dict[VehiclePart, str] = field(
        default_factory=lambda: dict.fromkeys(VehiclePart, "a")
    )
    actions: list[Action] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.guard = Guard(self.settings, now_s=self.now_s)

    def feed(self, event: Event) -> None:
        for action in self.guard.take(event, self.now_s):
            self.actions.append(action)
            if isinstance(action, ReadParts) and self.is_reading:
                for part in action.parts:
                    self.feed(PartRead(part=part, fingerprint=self.contents[part]))
            elif isinstance(action, CheckVehicle) and self.is_checking:
                self.feed(Judged(fingerprints=dict(self.contents), judgement=self.judgement))

    def run(self, duration_s: float, *, is_heard: bool = True, step_s: float = 0.25) -> None:
        until_s = self.now_s + duration_s
        while self.now_s < until_s - 1e-9:
            self.now_s += step_s
            if is_heard:
                self.feed(MessageHeard())
                for part in TOLD_PARTS:
                    self.feed(PartRead(part=part, fingerprint=self.contents[part]))
            self.feed(TimePassed())

    def ask(self) -> None:
        self.feed(ArmRequested(request=REQUEST))

    def answers(self) -> list[AnswerRequest]:
        return [action for action in self.actions if isinstance(action, AnswerRequest)]

    def announcements(self) -> list[Announce]:
        return [action for action in self.actions if isinstance(action, Announce)]

    def decisions(self, kind: str) -> list[Decision]:
        return [a for a in self.actions if isinstance(a, Decision) and a.kind == kind]


def ready(**changes: object) -> Bench:
    bench = Bench(**changes)  # type: ignore[arg-type] # fields by their names
    bench.feed(ArmingStatus(is_asking=True, wait_s=1.0))
    bench.run(5.0)
    return bench


def test_a_vehicle_that_was_read_and_checked_is_accepted_for_the_time_stated() -> None:
    bench = ready(settings=GuardSettings(valid_for_s=60))
    bench.ask()
    (given_answer,) = bench.answers()
    assert given_answer.request == REQUEST
    assert given_answer.answer.result is ArmResult.ACCEPTED
    assert given_answer.answer.valid_for_s == 60


def test_a_request_makes_it_read_the_vehicle_once_more_before_it_accepts() -> None:
    bench = ready()
    bench.actions.clear()
    bench.ask()
    kinds = [type(action).__name__ for action in bench.actions]
    assert kinds.index("ReadParts") < kinds.index("AnswerRequest")
    (read,) = (action for action in bench.actions if isinstance(action, ReadParts))
    assert read.parts == READ_PARTS
    assert read.is_urgent


def test_a_mission_changed_without_a_sign_is_found_at_the_request() -> None:
    bench = ready()
    bench.contents[VehiclePart.MISSION] = "another"
    bench.judgement = NO_GO
    bench.ask()
    (given_answer,) = bench.answers()
    assert given_answer.answer.result is ArmResult.DENIED
    assert given_answer.answer.reason is DenialReason.INVALID_WAYPOINT
    assert given_answer.answer.extra_info == 7


def test_a_request_that_cannot_be_confirmed_in_time_is_rejected_for_the_moment() -> None:
    bench = ready()
    bench.is_reading = False
    bench.ask()
    bench.run(0.5)
    assert not bench.answers()  # 0.7 of the second that the vehicle waits are not over
    bench.run(0.5)
    (given_answer,) = bench.answers()
    assert given_answer.answer.result is ArmResult.TEMPORARILY_REJECTED
    assert "arm once more" in given_answer.answer.text


def test_a_slow_link_may_be_confirmed_before_the_request_where_that_is_asked_for() -> None:
    bench = ready(settings=GuardSettings(confirmed_s=30.0))
    bench.is_reading = False
    bench.ask()
    assert bench.answers()[0].answer.is_accepted


def test_a_no_go_is_denied_at_once() -> None:
    bench = ready(judgement=NO_GO)
    bench.is_reading = False
    bench.ask()
    assert bench.answers()[0].answer.result is ArmResult.DENIED


def test_without_a_verdict_a_request_is_rejected_for_the_moment_with_the_reason() -> None:
    bench = ready(judgement=unknown_judgement("the model file cannot be read"))
    bench.ask()
    (given_answer,) = bench.answers()
    assert given_answer.answer.result is ArmResult.TEMPORARILY_REJECTED
    assert given_answer.answer.text == "the model file cannot be read"


def test_a_part_that_cannot_be_read_is_named_and_tried_again() -> None:
    bench = ready()
    bench.is_reading = False
    bench.feed(PartChanged(part=VehiclePart.FENCE, why="another station sent one"))
    bench.run(0.75)
    bench.feed(PartUnread(part=VehiclePart.FENCE, why="item 3 of 9 did not come"))
    bench.ask()
    (given_answer,) = bench.answers()
    assert given_answer.answer.result is ArmResult.TEMPORARILY_REJECTED
    assert given_answer.answer.text == "the fence could not be read: item 3 of 9 did not come"
    bench.actions.clear()
    bench.is_reading = True
    bench.run(5.0)
    assert any(isinstance(a, ReadParts) and VehiclePart.FENCE in a.parts for a in bench.actions)
    bench.ask()
    assert bench.answers()[-1].answer.is_accepted


def test_a_change_is_looked_at_once_the_changes_have_ceased() -> None:
    bench = ready()
    bench.actions.clear()
    for _ in range(4):
        bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
        bench.run(0.25)
    assert not any(isinstance(action, ReadParts) for action in bench.actions)
    bench.run(0.5)
    reads = [action for action in bench.actions if isinstance(action, ReadParts)]
    assert [read.parts for read in reads] == [(VehiclePart.MISSION,)]


def test_changes_that_never_cease_are_looked_at_all_the_same() -> None:
    bench = ready()
    bench.actions.clear()
    for _ in range(16):
        bench.feed(PartChanged(part=VehiclePart.PARAMETERS, why="PARAM_VALUE"))
        bench.run(0.25)
    assert any(isinstance(action, ReadParts) for action in bench.actions)


def test_a_request_within_a_change_waits_for_it_to_be_read() -> None:
    bench = ready()
    bench.judgement = NO_GO
    bench.contents[VehiclePart.MISSION] = "b"
    bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
    bench.ask()
    assert bench.answers()[0].answer.result is ArmResult.DENIED


def test_a_change_told_of_while_the_part_is_being_confirmed_is_read_once_more() -> None:
    bench = ready()
    bench.is_reading = False
    bench.ask()
    bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
    bench.actions.clear()
    for part in READ_PARTS:
        bench.feed(PartRead(part=part, fingerprint="a"))  # as it was before the change
    assert not bench.answers()
    assert [a.parts for a in bench.actions if isinstance(a, ReadParts)] == [(VehiclePart.MISSION,)]
    bench.feed(PartRead(part=VehiclePart.MISSION, fingerprint="a"))
    assert bench.answers()[0].answer.is_accepted


def test_after_a_silence_everything_is_read_again() -> None:
    bench = ready()
    bench.run(20.0, is_heard=False)
    assert bench.guard.view(bench.now_s).verdict is Verdict.UNKNOWN
    bench.actions.clear()
    bench.is_reading = False
    bench.feed(MessageHeard())
    assert bench.decisions("link")
    bench.ask()
    bench.run(1.0)
    assert not bench.answers()[0].answer.is_accepted
    assert any(isinstance(a, ReadParts) and a.parts == READ_PARTS for a in bench.actions)


def test_a_battery_that_is_no_longer_told_of_is_no_ground_for_a_go() -> None:
    bench = ready()
    for _ in range(130):
        bench.now_s += 1.0
        bench.feed(MessageHeard())
        bench.feed(PartRead(part=VehiclePart.HOME, fingerprint="a"))
    bench.ask()
    bench.run(1.0, is_heard=False)
    answer = bench.answers()[0].answer
    assert answer.result is ArmResult.TEMPORARILY_REJECTED
    assert "battery" in answer.text


def test_every_request_is_answered_and_answered_once() -> None:
    bench = ready()
    bench.is_reading = False
    requests = [ArmRequest(system=1, component=1, number=n) for n in range(40)]
    for request in requests:
        bench.feed(ArmRequested(request=request))
    bench.run(2.0)
    assert sorted(a.request.number for a in bench.answers()) == list(range(40))


def test_an_acceptance_that_no_longer_holds_is_withdrawn_aloud() -> None:
    bench = ready()
    bench.ask()
    assert bench.answers()[0].answer.is_accepted
    bench.actions.clear()
    bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
    (said,) = bench.announcements()
    assert said.severity == 2  # MAV_SEVERITY_CRITICAL
    assert said.text == "mavjoule: DO NOT ARM, go withdrawn"
    assert bench.decisions("withdrawn")


def test_an_acceptance_is_withdrawn_on_the_ground_and_not_in_the_air() -> None:
    bench = ready()
    bench.ask()
    bench.feed(ArmingStatus(is_asking=True, wait_s=1.0, is_armed=True))
    bench.actions.clear()
    bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
    assert not bench.announcements()
    # PX4 would arm again by it: it keeps an approval for its time, whatever has flown since.
    bench.feed(ArmingStatus(is_asking=True, wait_s=1.0, is_armed=False))
    assert [one.text for one in bench.announcements()] == ["mavjoule: DO NOT ARM, go withdrawn"]


def test_a_battery_that_drains_by_a_step_withdraws_nothing() -> None:
    bench = ready()
    bench.ask()
    bench.actions.clear()
    bench.contents[VehiclePart.BATTERY] = "99 %"
    bench.run(1.0)
    assert any(isinstance(action, CheckVehicle) for action in bench.actions)
    assert not bench.announcements()


def test_a_vehicle_that_does_not_ask_is_told_the_verdict_once_for_each_change() -> None:
    bench = Bench()
    bench.feed(ArmingStatus(is_asking=False, wait_s=1.0))
    bench.run(30.0)
    assert [said.text for said in bench.announcements()] == [GO.headline]
    bench.judgement = NO_GO
    bench.contents[VehiclePart.MISSION] = "b"
    bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
    bench.run(30.0)
    texts = [(said.severity, said.text) for said in bench.announcements()]
    assert texts == [(5, GO.headline), (3, "mavjoule: NO-GO M105 unsupported-command item 7")]


def test_verdicts_that_flap_are_announced_no_more_often_than_every_ten_seconds() -> None:
    bench = Bench()
    bench.feed(ArmingStatus(is_asking=False, wait_s=1.0))
    for turn in range(60):
        bench.judgement = NO_GO if turn % 2 else GO
        bench.contents[VehiclePart.BATTERY] = str(turn)
        bench.run(1.0)
    assert 1 <= len(bench.announcements()) <= 7


def test_a_vehicle_that_asks_is_told_the_reason_of_a_rejection() -> None:
    bench = ready(judgement=NO_GO)
    assert not bench.announcements()
    bench.ask()
    bench.ask()
    assert [said.text for said in bench.announcements()] == [NO_GO.headline]


def test_what_is_announced_fits_into_one_message() -> None:
    long = unknown_judgement("something that takes many more words than a status text can hold")
    assert len(long.headline.encode()) <= 50
    assert len(NO_GO.headline.encode()) <= 50


STEPS = st.one_of(
    st.tuples(st.just("wait"), st.sampled_from([0.1, 0.4, 1.0, 4.0, 7.0, 70.0])),
    st.tuples(st.just("change"), st.sampled_from(READ_PARTS), st.integers(0, 2), st.booleans()),
    st.tuples(st.just("tell"), st.sampled_from(TOLD_PARTS), st.integers(0, 2)),
    st.tuples(st.just("finish"), st.sampled_from(READ_PARTS), st.booleans()),
    st.tuples(st.just("fail"), st.sampled_from(READ_PARTS)),
    st.tuples(st.just("check")),
    st.tuples(st.just("hear")),
    st.tuples(st.just("ask")),
    st.tuples(st.just("settle")),
    st.tuples(st.just("confirm")),
)


class World:
    """A vehicle whose parts hold numbers; 2 is what no check lets pass."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.guard = Guard(GuardSettings(), now_s=0.0)
        self.true = dict.fromkeys(VehiclePart, 0)
        self.known: dict[VehiclePart, int] = {}
        self.read_began_s: dict[VehiclePart, float] = {}
        self.signed_s = dict.fromkeys(VehiclePart, -1.0)
        self.reading: dict[VehiclePart, tuple[float, int]] = {}
        self.check_wanted = False
        self.judged: dict[VehiclePart, int] = {}
        self.asked_s: dict[int, float] = {}
        self.accepted = 0
        self.answered: list[int] = []

    def feed(self, event: Event) -> None:
        for action in self.guard.take(event, self.now_s):
            if isinstance(action, ReadParts):
                for part in action.parts:
                    assert part not in self.reading, "asked for while it is being read"
                    self.reading[part] = (self.now_s, self.true[part])
            elif isinstance(action, CheckVehicle):
                self.check_wanted = True
            elif isinstance(action, AnswerRequest):
                self.answered.append(action.request.number)
                if action.answer.is_accepted:
                    self.accepted += 1
                    self.check_acceptance(self.asked_s[action.request.number])

    def check_acceptance(self, asked_s: float) -> None:
        assert set(self.judged) == set(VehiclePart)
        assert self.judged == self.known, "what was judged is not what was read last"
        assert 2 not in self.judged.values(), "what was judged is no go"
        for part in READ_PARTS:
            assert self.read_began_s[part] >= asked_s, "not read after the request"
            assert self.read_began_s[part] >= self.signed_s[part], "a change was told since"

    def wait(self, duration_s: float) -> None:
        self.now_s += duration_s
        self.feed(TimePassed())

    def change(self, part: VehiclePart, value: int, is_told: object) -> None:
        self.now_s += 1e-3
        self.true[part] = value
        if is_told:
            self.signed_s[part] = self.now_s
            self.now_s += 1e-3
            self.feed(PartChanged(part=part, why="told"))

    def tell(self, part: VehiclePart, value: int) -> None:
        self.true[part] = self.known[part] = value
        self.feed(PartRead(part=part, fingerprint=str(value)))

    def finish(self, part: VehiclePart, is_early: object = None) -> None:
        if part in self.reading:
            self.now_s += 1e-3
            began_s, early = self.reading.pop(part)
            self.read_began_s[part] = began_s
            self.known[part] = early if is_early else self.true[part]
            self.feed(PartRead(part=part, fingerprint=str(self.known[part])))

    def fail(self, part: VehiclePart) -> None:
        if self.reading.pop(part, None) is not None:
            self.feed(PartUnread(part=part, why="it stalled"))

    def check(self) -> None:
        if not self.check_wanted:
            return
        self.check_wanted = False
        self.judged = dict(self.known)
        self.feed(
            Judged(
                fingerprints={part: str(value) for part, value in self.judged.items()},
                judgement=NO_GO if 2 in self.judged.values() else GO,
            )
        )

    def hear(self) -> None:
        self.feed(MessageHeard())

    def ask(self) -> None:
        self.now_s += 1e-3
        number = len(self.asked_s)
        self.asked_s[number] = self.now_s
        self.feed(ArmRequested(request=ArmRequest(system=1, component=1, number=number)))

    def settle(self) -> None:
        """Do what was asked for, once."""
        self.hear()
        for part in TOLD_PARTS:
            self.tell(part, self.true[part])
        for part in READ_PARTS:
            self.finish(part)
        self.check()

    def confirm(self) -> None:
        self.ask()
        self.settle()


@settings(max_examples=examples(300), deadline=None)
@given(steps=st.lists(STEPS, max_size=40))
def test_nothing_is_accepted_but_what_was_judged_a_go_and_not_changed_since(
    steps: list[tuple[str, *tuple[object, ...]]],
) -> None:
    world = World()
    world.settle()
    for name, *values in steps:
        getattr(world, name)(*values)
    world.wait(10.0)
    assert sorted(world.answered) == sorted(world.asked_s)


def test_the_world_of_the_property_accepts_at_all() -> None:
    world = World()
    world.settle()
    world.settle()
    world.confirm()
    assert world.accepted == 1


@pytest.mark.parametrize(
    ("code", "item", "reason", "extra"),
    [
        ("M105", 7, DenialReason.INVALID_WAYPOINT, 7),
        ("F101", 3, DenialReason.INVALID_WAYPOINT, 3),
        ("A102", 4, DenialReason.INVALID_WAYPOINT, 4),
        ("F104", None, DenialReason.AIRSPACE_IN_USE, 0),
        ("W101", 5, DenialReason.BAD_WEATHER, 101),
        ("E102", 9, DenialReason.GENERIC, 102),
        ("M116", None, DenialReason.GENERIC, 116),
    ],
)
def test_a_denial_has_the_reason_that_fits(
    code: str, item: int | None, reason: DenialReason, extra: int
) -> None:
    finding = Finding(code=code, name="x", severity=Severity.ERROR, message="y", item=item)
    judgement = no_go_judgement([finding], fail_on=Severity.ERROR)
    assert (judgement.reason, judgement.extra_info) == (reason, extra)


@pytest.mark.parametrize(("method", "holds_s"), [(0.0, 0), (1.0, 5)])
def test_an_acceptance_holds_no_longer_than_arming_takes(method: float, holds_s: int) -> None:
    asking = {"COM_ARM_AUTH_REQ": 1.0, "COM_ARM_AUTH_ID": 245.0, "COM_ARM_AUTH_MET": method}
    arming = arming_settings(asking, authoriser=245)
    bench = ready()
    bench.feed(
        ArmingStatus(is_asking=bool(arming.is_asking), wait_s=arming.wait_s, holds_s=arming.holds_s)
    )
    bench.ask()
    assert [one.answer.valid_for_s for one in bench.answers()] == [holds_s]


def test_a_withdrawn_acceptance_is_answered_anew_and_said_until_it_is_over() -> None:
    bench = ready(settings=GuardSettings(valid_for_s=3))
    bench.ask()
    bench.actions.clear()
    bench.is_reading = False
    bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
    (withdrawn,) = (one for one in bench.actions if isinstance(one, Withdraw))
    assert withdrawn.request == REQUEST
    assert withdrawn.answer.result is ArmResult.TEMPORARILY_REJECTED
    bench.run(10.0)
    # PX4 had it within the second it waits, and holds it for three: at 0, 1, 2, 3 and 4 s.
    assert [one.text for one in bench.announcements()] == ["mavjoule: DO NOT ARM, go withdrawn"] * 5
    assert len(bench.answers()) == 0


def test_a_vehicle_that_arms_by_a_withdrawn_acceptance_is_told_of_at_once() -> None:
    bench = ready()
    bench.ask()
    bench.judgement = NO_GO
    bench.contents[VehiclePart.MISSION] = "another"
    bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
    bench.run(1.0)
    bench.actions.clear()
    bench.feed(ArmingStatus(is_asking=True, wait_s=1.0, is_armed=True))
    (said,) = bench.announcements()
    assert (said.severity, said.text) == (1, "mavjoule: ARMED ON A WITHDRAWN GO, DISARM")
    (decision,) = bench.decisions("withdrawn")
    assert decision.verdict is Verdict.NO_GO


def test_a_vehicle_that_arms_long_after_a_withdrawal_armed_by_something_else() -> None:
    bench = ready()
    bench.ask()
    bench.feed(PartChanged(part=VehiclePart.MISSION, why="MISSION_ACK"))
    bench.run(5.0)  # it waited for 1 s, the go held for 1 s, heartbeats come within 2 s
    bench.actions.clear()
    bench.feed(ArmingStatus(is_asking=True, wait_s=1.0, is_armed=True))
    assert not bench.announcements()
