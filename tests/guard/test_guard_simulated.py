"""A guard against the simulated vehicle, in virtual time: PX4 that asks, Copter that does not."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pytest
from made_missions import mission, rtl, takeoff, waypoint
from made_terrain import ground
from simulated_vehicles import BATTERY, WIND, MemoryLine, memory_line, wire

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.guard.authorisation import Verdict
from planner.guard.decision import Decision, GuardSettings
from planner.guard.session import GuardSession, GuardStatus
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, lists_of_mission
from planner.link.transfers import LinkSettings
from planner.link.vehicle import VehicleLink
from planner.mission.commands import Frame
from planner.report.vehicle import energy_text, status_line
from planner.service.guard import judge_vehicle
from planner.setup import Setup
from planner.simulator.arming import ArmingState
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Mapping

    from planner.simulator.vehicle import SimulatedVehicle
    from planner.simulator.wire import PassedMessage, SimulatedWire

CHECK = Setup(load_vehicle("arducopter-sitl-quad"), battery=BATTERY, wind=WIND)
STRICT = replace(CHECK, reserve=0.95)
PARAM_VALUE = b"\x16\0\0"
"""Its number in a frame, from the seventh byte on."""


class OverError(Exception):
    """The time of a test is up."""


class _SievedLine(MemoryLine):
    """Frames of the vehicle do not arrive that are lost at a time."""

    def __init__(self, wire: SimulatedWire, is_lost: Callable[[bytes, float], bool]) -> None:
        super().__init__(wire)
        self._is_lost = is_lost

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        found = super().receive(timeout_s)
        return [one for one in found if not self._is_lost(one[1], self.now_s())]


@dataclass
class Run:
    line: MemoryLine
    vehicle: SimulatedVehicle
    passed: list[PassedMessage] = field(default_factory=list)
    decisions: list[Decision] = field(default_factory=list)
    statuses: list[GuardStatus] = field(default_factory=list)

    def decided(self, kind: str) -> list[Decision]:
        return [one for one in self.decisions if one.kind == kind]

    def sent(self, name: str) -> list[PassedMessage]:
        return [one for one in self.passed if one.is_to_vehicle and one.message.name == name]


def guard(
    autopilot: Autopilot,
    faults: str = "",
    *,
    until_s: float,
    arm_at_s: tuple[float, ...] = (),
    check: Setup = CHECK,
    speed_up: float = 1.0,
    own_system: int = 245,
    given: Mapping[str, float] | None = None,
    before: Callable[[SimulatedVehicle, float], None] = lambda *_: None,
    is_lost: Callable[[bytes, float], bool] = lambda *_: False,
) -> Run:
    """Guard a simulated vehicle that tries to arm at times."""
    authoriser = own_system if autopilot is Autopilot.PX4 else None
    made = wire(autopilot, faults, given, authoriser=authoriser, speed_up=speed_up)
    line = _SievedLine(made, is_lost)
    vehicle = line._wire.vehicle
    run = Run(line, vehicle)
    line._wire.on_message = run.passed.append
    flown_as = replace(check, autopilot=autopilot)
    left = list(arm_at_s)

    def on_status(status: GuardStatus) -> None:
        run.statuses.append(status)
        before(vehicle, line.now_s())
        if left and line.now_s() >= left[0] - 2.0 and not vehicle.is_flying:
            vehicle.arm_at(left.pop(0))
        if line.now_s() >= until_s:
            raise OverError

    settings = LinkSettings()
    link = VehicleLink(
        line, name="simulated", settings=settings, purpose=Purpose.GUARD, own_system=own_system
    )
    session = GuardSession(
        link,
        GuardSettings(),
        judge=lambda snapshot: judge_vehicle(snapshot, flown_as),
        on_decision=run.decisions.append,
        on_status=on_status,
    )
    with pytest.raises(OverError):
        session.run()
    return run


def test_px4_flies_once_it_is_let_and_its_energy_is_followed_to_the_end() -> None:
    run = guard(Autopilot.PX4, until_s=120.0, arm_at_s=(20.0,), speed_up=6.0)
    assert [one.details["result"] for one in run.decided("answer")] == ["accepted"]
    assert run.vehicle.arming.authorised_s == 0.0  # COM_ARM_AUTH_MET 0: the arming waits for it
    flying = [status for status in run.statuses if status.is_flying]
    assert flying
    ratios = [s.energy.ratio for s in flying if s.energy is not None and s.energy.ratio is not None]
    # it flies, and its battery falls, as the same model predicts; percent are whole ones
    assert ratios[-1] == pytest.approx(1.0, abs=0.1)
    assert not run.decided("energy")
    assert not run.decided("withdrawn")
    assert not run.vehicle.acts


def test_a_guard_may_have_the_system_id_that_the_vehicle_asks() -> None:
    run = guard(Autopilot.PX4, until_s=30.0, arm_at_s=(20.0,), own_system=10)
    assert [one.details["result"] for one in run.decided("answer")] == ["accepted"]
    assert {one.message.system for one in run.passed if one.is_to_vehicle} == {10}


def test_px4_that_is_armed_in_two_steps_flies_at_the_second() -> None:
    given = {"COM_ARM_AUTH_MET": 1.0}
    run = guard(Autopilot.PX4, until_s=35.0, arm_at_s=(20.0, 24.0), given=given)
    assert [one.details["result"] for one in run.decided("answer")] == ["accepted"]
    assert run.vehicle.is_flying
    assert "arm twice: the first time asks" in run.decided("arming")[0].text


@pytest.mark.parametrize("lost", [b"", b"COM_ARM_AUTH_REQ"])
def test_px4_whose_parameters_were_not_read_is_not_said_not_to_ask(lost: bytes) -> None:
    """All of them are lost for two minutes, or that one alone that tells whether it asks."""

    def is_lost(frame: bytes, now_s: float) -> bool:
        return now_s < 120.0 and frame[7:10] == PARAM_VALUE and lost in frame

    run = guard(Autopilot.PX4, until_s=200.0, arm_at_s=(100.0,), is_lost=is_lost)
    unread, read = (one.text for one in run.decided("arming"))
    assert unread.startswith("whether the vehicle asks before arming is unknown")
    assert read.startswith("the vehicle asks before arming")
    before = [one for one in run.statuses if one.arming and one.arming.is_asking is None]
    assert len(before) > 30
    assert all("asks perhaps" in status_line(one) for one in before)
    assert {one.view.verdict for one in before} == {Verdict.UNKNOWN}
    assert [one.details["result"] for one in run.decided("answer")] == ["temporarily_rejected"]
    assert not any("not ask" in one.message["text"] for one in run.sent("STATUSTEXT"))
    assert not run.vehicle.is_flying


def test_what_was_read_of_arming_is_kept_where_it_cannot_be_read_again() -> None:
    def is_lost(frame: bytes, now_s: float) -> bool:
        return now_s > 30.0 and frame[7:10] == PARAM_VALUE

    run = guard(Autopilot.PX4, until_s=200.0, arm_at_s=(190.0,), is_lost=is_lost)
    (said,) = run.decided("arming")
    assert said.text.startswith("the vehicle asks before arming")
    assert run.statuses[-1].view.verdict is Verdict.UNKNOWN
    assert [one.details["result"] for one in run.decided("answer")] == ["temporarily_rejected"]


def test_px4_is_confirmed_by_the_numbers_of_its_lists_instead_of_their_items() -> None:
    run = guard(Autopilot.PX4, until_s=40.0, arm_at_s=(30.0,))
    assert [one.details["result"] for one in run.decided("answer")] == ["accepted"]
    assert all(one.time_s < 30.0 for one in run.sent("MISSION_REQUEST_INT"))  # read once, before
    late = [one for one in run.sent("MISSION_REQUEST_LIST") if one.time_s >= 30.0]
    assert [one.message["mission_type"] for one in late] == [0, 1, 2]
    assert all(one.time_s < 30.2 for one in late)


def test_a_fence_that_px4_got_just_before_arming_is_what_is_judged() -> None:
    def change(vehicle: SimulatedVehicle, now_s: float) -> None:
        # By another of its links, without any sign on this one.
        if now_s >= 29.9 and vehicle.missions.changes[MissionKind.FENCE] == 0:
            vehicle.missions._replace(MissionKind.FENCE, [])

    run = guard(Autopilot.PX4, until_s=40.0, arm_at_s=(30.0,), before=change)
    asked = [one for one in run.sent("MISSION_REQUEST_LIST") if one.time_s >= 30.0]
    # the fence's number is another, so it is read again: it has no item now; the others are not
    kinds = [one.message["mission_type"] for one in asked]
    assert kinds.count(1) > 1
    assert kinds.count(0) == kinds.count(2) == 1
    assert [one.details["result"] for one in run.decided("answer")] == ["accepted"]


def test_px4_that_is_no_go_is_denied_and_stays_on_the_ground() -> None:
    run = guard(Autopilot.PX4, until_s=40.0, arm_at_s=(20.0, 30.0), check=STRICT)
    assert [one.details["result"] for one in run.decided("answer")] == ["denied", "denied"]
    assert run.vehicle.arming.state is ArmingState.DENIED
    assert run.vehicle.arming.denial == (0, 101)  # generic, E101


@pytest.mark.parametrize("seed", range(3))
def test_with_a_fifth_lost_both_ways_px4_gets_off_the_ground_at_last(seed: int) -> None:
    tries = tuple(40.0 + 8.0 * turn for turn in range(12))
    waits = {
        "COM_ARM_AUTH_TO": 5.0
    }  # as the guard advises: in its usual second one in forty gets through
    faults = f"loss=20%,seed={seed}"
    run = guard(Autopilot.PX4, faults, until_s=140.0, arm_at_s=tries, given=waits)
    results = {one.details["result"] for one in run.decided("answer")}
    assert "accepted" in results
    assert results <= {"accepted", "temporarily_rejected"}


@pytest.mark.parametrize("seed", range(2))
def test_with_a_fifth_lost_both_ways_a_no_go_stays_on_the_ground(seed: int) -> None:
    tries = tuple(30.0 + 3.0 * turn for turn in range(12))
    faults = f"loss=20%,duplication=10%,reordering=10%,seed={seed}"
    run = guard(Autopilot.PX4, faults, until_s=70.0, arm_at_s=tries, check=STRICT)
    results = {one.details["result"] for one in run.decided("answer")}
    assert "accepted" not in results
    assert not run.vehicle.is_flying


@pytest.mark.parametrize("faults", ["garbage=20%", "truncation=20%", "count=+2", "silence=9:20"])
def test_a_vehicle_that_talks_nonsense_is_no_go_or_read_rightly(faults: str) -> None:
    run = guard(Autopilot.PX4, faults, until_s=60.0, arm_at_s=(30.0, 50.0), check=STRICT)
    assert "accepted" not in {one.details["result"] for one in run.decided("answer")}
    assert not run.vehicle.is_flying


def test_two_vehicles_with_one_system_id_are_no_ground_for_a_verdict() -> None:
    with pytest.raises(LinkError, match="answer"):
        guard(Autopilot.PX4, "twin", until_s=60.0, arm_at_s=(30.0,))


def test_copter_does_not_ask_and_is_told() -> None:
    run = guard(Autopilot.ARDUPILOT, until_s=60.0, check=replace(CHECK, battery=None))
    texts = [one.message["text"] for one in run.sent("STATUSTEXT")]
    assert len(texts) == 1
    assert texts[0].startswith("mavjoule: GO, ")
    assert not run.sent("COMMAND_ACK")


def test_nothing_that_a_guard_sends_would_move_set_or_arm_a_vehicle() -> None:
    run = guard(Autopilot.PX4, "loss=10%", until_s=60.0, arm_at_s=(20.0, 40.0))
    assert not run.vehicle.acts
    assert {one.message.name for one in run.passed if one.is_to_vehicle} <= {
        "HEARTBEAT",
        "COMMAND_ACK",
        "COMMAND_LONG",
        "MISSION_ACK",
        "MISSION_REQUEST_INT",
        "MISSION_REQUEST_LIST",
        "PARAM_REQUEST_LIST",
        "PARAM_REQUEST_READ",
        "STATUSTEXT",
        "TIMESYNC",  # whose number comes back
    }


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_a_flight_that_is_joined_is_held_against_the_model_from_there_on(
    autopilot: Autopilot,
) -> None:
    line = memory_line(autopilot, speed_up=2.0)
    flying = line._wire.vehicle
    flying.arm_at(2.0)
    while line.now_s() < 45.0:  # a minute and a half of the flight goes by unseen
        line.receive(1.0)
    assert flying.is_flying
    statuses: list[GuardStatus] = []

    def on_status(status: GuardStatus) -> None:
        statuses.append(status)
        if line.now_s() >= 130.0 or (statuses[0].is_flying and not status.is_flying):
            raise OverError

    session = GuardSession(
        VehicleLink(line, name="simulated", purpose=Purpose.GUARD),
        GuardSettings(),
        judge=lambda snapshot: judge_vehicle(snapshot, replace(CHECK, autopilot=autopilot)),
        on_decision=lambda _: None,
        on_status=on_status,
    )
    with pytest.raises(OverError):
        session.run()
    followed = [one.energy for one in statuses if one.energy is not None]
    assert all(one.is_joined for one in followed)
    assert followed[0].ratio is None
    assert "of the predicted use" not in energy_text(followed[0])
    assert "joined in flight" in energy_text(followed[0])
    ratios = [one.ratio for one in followed if one.ratio is not None]
    assert ratios[-1] == pytest.approx(1.0, abs=0.15)  # whole percents of a part of the flight


@pytest.mark.parametrize(("storage_b", "is_too_long"), [(4_096, True), (16_384, False)])
def test_a_long_mission_is_judged_by_the_storage_of_the_guarded_vehicle(
    monkeypatch: pytest.MonkeyPatch, storage_b: int, *, is_too_long: bool
) -> None:
    monkeypatch.setattr("planner.simulator.vehicle._STORAGE_B", storage_b)
    near = [waypoint(float(n % 10), 30.0) for n in range(170)]  # 4 kB hold 161, 16 kB 650

    def lengthen(vehicle: SimulatedVehicle, _: float) -> None:
        if len(vehicle.missions.lists[MissionKind.MISSION]) < len(near):
            long = lists_of_mission(mission(takeoff(30.0), *near, rtl()), vehicle.setup.identity)
            vehicle.missions._replace(MissionKind.MISSION, list(long[MissionKind.MISSION]))

    run = guard(Autopilot.ARDUPILOT, until_s=30.0, before=lengthen)
    *_, last = run.decided("verdict")
    assert ("172 items; ArduPilot holds" in str(last)) == is_too_long, last


def test_a_guarded_vehicle_that_waits_for_terrain_is_no_go_until_it_has_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    home, to_north, back = takeoff(30.0), waypoint(100.0, 30.0), rtl()
    over = mission(home, replace(to_north, frame=Frame.GLOBAL_TERRAIN_ALT), back)

    def change(vehicle: SimulatedVehicle, time_s: float) -> None:
        items = lists_of_mission(over, vehicle.setup.identity)[MissionKind.MISSION]
        if [one.frame for one in vehicle.missions.lists[MissionKind.MISSION]] != [
            one.frame for one in items
        ]:
            vehicle.missions._replace(MissionKind.MISSION, list(items))
        if time_s >= 30.0:  # a ground station has sent it
            monkeypatch.setattr("planner.simulator.telemetry._TERRAIN_BLOCKS", 0)

    level = replace(CHECK, terrain=ground(0.0))
    run = guard(Autopilot.ARDUPILOT, "no-terrain", until_s=60.0, before=change, check=level)
    *_, waiting, ready = run.decided("verdict")
    assert waiting.details["code"] == "X910", waiting
    assert ready.verdict is Verdict.GO, ready


def test_px4_accepted_and_disarmed_does_not_arm_a_second_later_with_a_mission_that_is_no_go() -> (
    None
):
    """Tried with a build: a no-go armed by the acceptance of the mission before, which held 30 s."""
    done: list[str] = []

    def change(vehicle: SimulatedVehicle, now_s: float) -> None:
        # It is let fly, disarmed at once, and gets by another of its links a mission 40 km out.
        if vehicle.is_flying and not done:
            vehicle.arming.disarm()
            vehicle._took_off_s = None
            items = vehicle.missions.lists[MissionKind.MISSION]
            far = [replace(one, x=one.x + 3_600_000) if one.x else one for one in items]
            vehicle.missions._replace(MissionKind.MISSION, far)
            vehicle.arm_at(now_s + 1.0)
            done.append("changed")

    run = guard(Autopilot.PX4, until_s=40.0, arm_at_s=(20.0,), before=change)
    assert done
    assert [one.details["result"] for one in run.decided("answer")] == ["accepted", "denied"]
    assert not run.vehicle.is_flying
