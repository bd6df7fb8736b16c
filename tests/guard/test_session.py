"""A guard on a line in virtual time: what it reads, what it answers, what it sends at all."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import pytest
from guarded_vehicle import ASKING, HASH, OUT_AND_BACK, GuardedVehicle, guarded
from virtual_vehicle import ARDUPILOT, VirtualLine, wire_item

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.guard.decision import Decision, GuardSettings
from planner.guard.session import GuardSession, GuardStatus
from planner.link.connection import Purpose
from planner.link.mission import MissionKind
from planner.link.transfers import LinkSettings
from planner.link.vehicle import VehicleLink
from planner.link.wire import message
from planner.report.vehicle import status_line
from planner.service.guard import judge_vehicle
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.guard.authorisation import Judgement
    from planner.guard.energy import Prediction
    from planner.link.snapshot import VehicleSnapshot
    from planner.link.wire import Message

ACCEPTED, FOR_NOW, DENIED = 0, 1, 2
CHECK = Setup(load_vehicle(), battery=Battery(capacity_wh=77.0), autopilot=Autopilot.STEP)
FOUR_CELLS = replace(CHECK, battery=Battery(capacity_ah=5.2, nominal_voltage_v=14.8))
FAR = (OUT_AND_BACK[0], wire_item(x=502_000_000, y=200_000_000, z=100.0), OUT_AND_BACK[2])
"""22 km away: no battery of this size comes back."""


class OverError(Exception):
    """The time of a test is up."""


class LateParameters(GuardedVehicle):
    """Its parameters do not come in the first minute."""

    def _on_param_request_list(self, one: Message, now_s: float) -> list[Message]:
        return super()._on_param_request_list(one, now_s) if now_s > 60.0 else []


class RareHeartbeats(GuardedVehicle):
    """It says every 3 s whether it is armed, and the rest as often as others."""

    def _state(self) -> list[Message]:
        said = super()._state()
        return said if self.state_s % 3.0 < 0.5 else said[1:]


@dataclass
class Run:
    vehicle: GuardedVehicle
    line: VirtualLine
    decisions: list[Decision] = field(default_factory=list)
    statuses: list[GuardStatus] = field(default_factory=list)
    checks: int = 0

    def decided(self, kind: str) -> list[Decision]:
        return [one for one in self.decisions if one.kind == kind]


def guard(
    vehicle: GuardedVehicle,
    *,
    until_s: float,
    settings: GuardSettings | None = None,
    check: Setup = CHECK,
    predictions: list[Prediction] | None = None,
    **chances: float,
) -> Run:
    """Guard a vehicle in virtual time, until a time."""
    line = VirtualLine(vehicle, **chances)  # type: ignore[arg-type] # loss, seed and the like
    run = Run(vehicle, line)
    link_settings = LinkSettings()
    link = VehicleLink(line, name="virtual", settings=link_settings, purpose=Purpose.GUARD)

    def judge(snapshot: VehicleSnapshot) -> tuple[Judgement, Prediction | None]:
        run.checks += 1
        judgement, prediction = judge_vehicle(snapshot, check)
        if predictions is not None and prediction is not None:
            predictions.append(prediction)
        return judgement, prediction

    def on_status(status: GuardStatus) -> None:
        run.statuses.append(status)
        if line.time_s >= until_s:
            raise OverError

    session = GuardSession(
        link,
        settings or GuardSettings(),
        judge=judge,
        on_decision=run.decisions.append,
        on_status=on_status,
    )
    with pytest.raises(OverError):
        session.run()
    return run


def at(time_s: float, *whats: object) -> list[tuple[float, object]]:
    return [(time_s, what) for what in whats]


def test_a_vehicle_with_a_good_mission_may_arm() -> None:
    vehicle = guarded(script=at(20.0, GuardedVehicle.ask))
    run = guard(vehicle, until_s=25.0, settings=GuardSettings(valid_for_s=60))
    ((answered_s, answer),) = vehicle.answers
    assert answered_s < 20.5
    assert answer["command"] == 3001
    assert answer["result"] == ACCEPTED
    assert answer["result_param2"] == 60
    assert answer["target_system"] == 1  # PX4 takes no other
    assert run.checks == 1
    assert run.statuses[-1].view.verdict == "go"


def test_a_vehicle_whose_parameters_do_not_come_is_not_said_not_to_ask() -> None:
    made = guarded(script=at(50.0, GuardedVehicle.ask))
    vehicle = LateParameters(**{one.name: getattr(made, one.name) for one in fields(made)})
    run = guard(vehicle, until_s=90.0)
    first, second = (one.text for one in run.decided("arming"))
    assert "unknown" in first
    assert "asks before arming" in second
    assert vehicle.results() == [FOR_NOW]
    before = [
        one for one in run.statuses if one.arming is not None and one.arming.is_asking is None
    ]
    assert "asks perhaps" in status_line(before[-1])


@pytest.mark.parametrize("counts_charge", [True, False])
def test_a_battery_of_other_cells_is_denied_once_it_is_measured(*, counts_charge: bool) -> None:
    def swap(vehicle: GuardedVehicle) -> None:
        vehicle.voltage_mv = 12_600  # three cells, full, where four have some 16.6 V at 95 %

    script = at(20.0, GuardedVehicle.ask) + at(30.0, swap) + at(40.0, GuardedVehicle.ask)
    vehicle = guarded(script=script, voltage_mv=16_600)
    settings = GuardSettings(counts_charge=counts_charge)
    run = guard(vehicle, until_s=45.0, settings=settings, check=FOUR_CELLS)
    assert vehicle.results() == [ACCEPTED, DENIED]
    assert run.decided("verdict")[-1].details["code"] == "E121"


def test_a_voltage_that_breaks_down_in_flight_is_no_other_battery() -> None:
    def fly(vehicle: GuardedVehicle) -> None:
        vehicle.is_armed, vehicle.voltage_mv = True, 13_000

    vehicle = guarded(script=at(20.0, fly), voltage_mv=16_600)
    run = guard(vehicle, until_s=40.0, check=FOUR_CELLS)
    assert run.statuses[-1].view.verdict == "go"
    assert run.checks == 1


@pytest.mark.parametrize(
    ("voltage_mv", "charge"),
    [(16_200, 0.95), (14_800, 0.469)],  # 3.7 V a cell: 25 % at 3.63 V, 50 % at 3.71 V
)
def test_a_flight_begins_with_the_charge_that_the_voltage_had_before_it_armed(
    voltage_mv: int, charge: float
) -> None:
    """Under load 13 V, 3.25 V a cell, say nothing; what is judged anew in flight began as before."""
    predictions: list[Prediction] = []

    def arm(vehicle: GuardedVehicle) -> None:
        vehicle.is_armed = True

    def fly(vehicle: GuardedVehicle) -> None:
        vehicle.voltage_mv, vehicle.battery_remaining = 13_000, 90

    def change(vehicle: GuardedVehicle) -> None:
        vehicle.parameters["MPC_XY_CRUISE"] = (6.0, 9)

    script = at(20.0, arm) + at(24.0, fly) + at(30.0, change)
    vehicle = guarded(script=script, voltage_mv=voltage_mv)
    run = guard(vehicle, until_s=110.0, check=FOUR_CELLS, predictions=predictions)
    assert run.checks == 2
    assert [one.charge for one in predictions] == pytest.approx([charge] * 2, abs=0.001)


def test_a_voltage_counts_once_it_is_known_whether_the_motors_stand() -> None:
    """ArduPilot SITL tells its battery before its second heartbeat: the full one it claimed was a go."""
    made = guarded(voltage_mv=14_800)
    vehicle = RareHeartbeats(**{one.name: getattr(made, one.name) for one in fields(made)})
    predictions: list[Prediction] = []
    guard(vehicle, until_s=20.0, check=FOUR_CELLS, predictions=predictions)
    assert [one.charge for one in predictions] == pytest.approx([0.469], abs=0.001)


def test_a_mission_that_is_no_go_is_denied_with_the_finding() -> None:
    vehicle = guarded(script=at(30.0, GuardedVehicle.ask))
    vehicle.lists[MissionKind.MISSION] = FAR
    run = guard(vehicle, until_s=35.0)
    ((_, answer),) = vehicle.answers
    assert answer["result"] == DENIED
    assert (answer["progress"], answer["result_param2"]) == (0, 101)  # generic, E101
    assert run.decided("answer")[0].text.startswith("E101 reserve-below-minimum")
    assert [text for _, _, text in vehicle.texts] == ["mavjoule: NO-GO E101 item 2 (+1)"]


def test_a_mission_sent_by_another_station_just_before_arming_is_what_is_judged() -> None:
    def send_far(vehicle: GuardedVehicle) -> None:
        vehicle.lists[MissionKind.MISSION] = FAR  # without any sign on this line

    vehicle = guarded(script=at(30.0, send_far, GuardedVehicle.ask))
    guard(vehicle, until_s=35.0)
    assert vehicle.results() == [DENIED]


def test_a_parameter_set_just_before_arming_is_what_is_judged() -> None:
    def set_speed(vehicle: GuardedVehicle) -> None:
        vehicle.parameters["MPC_XY_CRUISE"] = (3.0, 9)

    vehicle = guarded(script=at(30.0, set_speed, GuardedVehicle.ask))
    run = guard(vehicle, until_s=35.0)
    assert run.checks == 2
    assert vehicle.results() == [ACCEPTED]


def test_the_lower_of_two_charges_counts() -> None:
    def disagree(vehicle: GuardedVehicle) -> None:
        vehicle.outbox.append(message("SYS_STATUS", battery_remaining=21))

    vehicle = guarded(script=at(20.0, disagree) + at(22.0, GuardedVehicle.ask))
    guard(vehicle, until_s=25.0)
    assert vehicle.results() == [DENIED]


def test_an_empty_battery_is_no_go_once_it_is_told() -> None:
    def drain(vehicle: GuardedVehicle) -> None:
        vehicle.battery_remaining = 21

    vehicle = guarded(script=at(20.0, drain) + at(30.0, GuardedVehicle.ask))
    guard(vehicle, until_s=35.0)
    assert vehicle.results() == [DENIED]


def test_a_vehicle_that_does_not_tell_its_charge_is_never_a_go() -> None:
    vehicle = guarded(script=at(30.0, GuardedVehicle.ask), battery_remaining=-1)
    guard(vehicle, until_s=35.0)
    assert vehicle.results() == [FOR_NOW]


def test_a_vehicle_without_home_and_place_is_never_a_go() -> None:
    vehicle = guarded(script=at(30.0, GuardedVehicle.ask), home=None, place=(0, 0, 0))
    guard(vehicle, until_s=35.0)
    assert vehicle.results() == [FOR_NOW]


def test_a_request_before_everything_was_read_is_rejected_for_the_moment() -> None:
    vehicle = guarded(script=at(1.5, GuardedVehicle.ask))
    guard(vehicle, until_s=10.0)
    assert all(result != ACCEPTED for result in vehicle.results()[:1])


def test_after_a_silence_the_vehicle_is_read_again_before_a_go() -> None:
    def fall_silent(vehicle: GuardedVehicle) -> None:
        vehicle.is_silent = True

    def come_back(vehicle: GuardedVehicle) -> None:
        vehicle.is_silent = False
        vehicle.lists[MissionKind.MISSION] = FAR
        vehicle.ask()

    vehicle = guarded(script=at(20.0, fall_silent) + at(32.0, come_back))
    vehicle.script += at(60.0, GuardedVehicle.ask)  # type: ignore[arg-type] # what happens
    run = guard(vehicle, until_s=65.0)
    assert ACCEPTED not in vehicle.results()
    assert vehicle.results()[-1] == DENIED
    assert run.decided("link")


def test_a_vehicle_that_stays_silent_is_lost() -> None:
    vehicle = guarded()
    vehicle.script += at(20.0, lambda one: setattr(one, "is_silent", True))  # type: ignore[arg-type] # what happens
    line = VirtualLine(vehicle)
    link = VehicleLink(line, name="virtual", purpose=Purpose.GUARD)
    session = GuardSession(
        link,
        GuardSettings(lost_after_s=30.0),
        judge=lambda snapshot: judge_vehicle(snapshot, CHECK),
        on_decision=lambda _: None,
        on_status=lambda _: None,
    )
    with pytest.raises(LinkError, match=r"not heard for 3\d s on virtual"):
        session.run()
    assert line.time_s < 60.0


def test_a_vehicle_that_falls_silent_in_a_transfer_is_lost_as_soon() -> None:
    vehicle = guarded()
    line = VirtualLine(vehicle)
    link = VehicleLink(line, name="virtual", purpose=Purpose.GUARD)

    ask = vehicle._on_mission_request_int

    def fall_silent(one: Message, now_s: float) -> list[Message]:
        vehicle.is_silent = True
        return ask(one, now_s)

    vehicle._on_mission_request_int = fall_silent  # type: ignore[method-assign] # amid the items
    session = GuardSession(
        link,
        GuardSettings(lost_after_s=5.0),
        judge=lambda snapshot: judge_vehicle(snapshot, CHECK),
        on_decision=lambda _: None,
        on_status=lambda _: None,
    )
    with pytest.raises(LinkError, match="not heard for 5 s on virtual"):
        session.run()
    assert line.time_s < 15.0


def test_a_vehicle_that_does_not_ask_is_told_the_verdict() -> None:
    parameters = {name: value for name, value in ASKING.items() if "AUTH" not in name}
    vehicle = guarded(parameters=parameters)
    vehicle.script += at(  # type: ignore[arg-type] # what happens
        40.0,
        lambda one: one.lists.update({MissionKind.MISSION: FAR}),
        lambda one: setattr(one, "sequence", 0),
    )
    run = guard(vehicle, until_s=150.0)
    texts = [(severity, text) for _, severity, text in vehicle.texts]
    assert [severity for severity, _ in texts] == [5, 3]
    assert texts[0][1].startswith("mavjoule: GO, ")
    assert texts[1][1].startswith("mavjoule: NO-GO E101")
    assert "does not ask" in run.decided("arming")[0].text


def test_an_ardupilot_vehicle_is_told_the_verdict() -> None:
    home_row = wire_item(frame=0, x=500_000_000, y=200_000_000, z=200.0)
    vehicle = guarded(autopilot=ARDUPILOT, parameters={"WPNAV_SPEED": (700.0, 9)})
    vehicle.lists[MissionKind.MISSION] = (home_row, *OUT_AND_BACK)
    guard(vehicle, until_s=60.0)
    assert [text.startswith("mavjoule: GO") for _, _, text in vehicle.texts] == [True]
    assert not any(one.fields.get("param_id") == HASH for one in vehicle.received)  # PX4's alone


def test_a_vehicle_that_asks_another_system_is_told_what_to_set() -> None:
    parameters = {**ASKING, "COM_ARM_AUTH_ID": (10.0, 6)}
    run = guard(guarded(parameters=parameters), until_s=15.0)
    (told,) = run.decided("arming")
    assert "asks system 10" in told.text
    assert "COM_ARM_AUTH_ID 245" in told.text


@pytest.mark.parametrize("seed", range(3))
def test_with_a_fifth_lost_both_ways_a_vehicle_that_asks_again_gets_its_answer(seed: int) -> None:
    vehicle = guarded()
    for turn in range(12):
        vehicle.script += at(60.0 + 3.0 * turn, GuardedVehicle.ask)  # type: ignore[arg-type] # what happens
    guard(vehicle, until_s=100.0, loss=0.2, seed=seed)
    assert ACCEPTED in vehicle.results()
    assert DENIED not in vehicle.results()


@pytest.mark.parametrize("seed", range(3))
def test_with_a_fifth_lost_both_ways_a_no_go_is_never_accepted(seed: int) -> None:
    vehicle = guarded()
    vehicle.script += at(40.0, lambda one: one.lists.update({MissionKind.MISSION: FAR}))  # type: ignore[arg-type] # what happens
    for turn in range(30):
        vehicle.script += at(40.0 + turn, GuardedVehicle.ask)  # type: ignore[arg-type] # what happens
    guard(vehicle, until_s=75.0, loss=0.2, seed=seed)
    assert ACCEPTED not in vehicle.results()
    assert DENIED in vehicle.results()


def test_nothing_goes_out_but_requests_answers_and_texts() -> None:
    vehicle = guarded(script=at(20.0, GuardedVehicle.ask) + at(40.0, GuardedVehicle.ask))
    run = guard(vehicle, until_s=60.0)
    names = {one.name for one in vehicle.received}
    assert names <= {
        "COMMAND_ACK",
        "COMMAND_LONG",
        "MISSION_ACK",
        "MISSION_REQUEST_INT",
        "MISSION_REQUEST_LIST",
        "PARAM_REQUEST_LIST",
        "PARAM_REQUEST_READ",
        "STATUSTEXT",
    }
    commands = {one["command"] for one in vehicle.received if one.name == "COMMAND_LONG"}
    assert commands <= {511, 512}  # SET_MESSAGE_INTERVAL, REQUEST_MESSAGE
    assert {one["command"] for one in vehicle.received if one.name == "COMMAND_ACK"} == {3001}
    assert len(run.line.sent) > 20


def test_parameters_are_read_once_where_the_vehicle_has_a_hash_of_them() -> None:
    vehicle = guarded(script=at(20.0, GuardedVehicle.ask) + at(40.0, GuardedVehicle.ask))
    guard(vehicle, until_s=100.0)
    names = [one.name for one in vehicle.received]
    assert names.count("PARAM_REQUEST_LIST") == 1
    assert any(one.fields.get("param_id") == HASH for one in vehicle.received)
    assert vehicle.results() == [ACCEPTED, ACCEPTED]


def test_in_flight_the_pilot_is_warned_before_the_way_home_eats_the_reserve() -> None:
    vehicle = guarded(energy_consumed_hj=0, script=at(20.0, GuardedVehicle.ask))
    vehicle.lists[MissionKind.MISSION] = (
        OUT_AND_BACK[0],
        wire_item(x=500_150_000, y=200_000_000, z=100.0),
        OUT_AND_BACK[2],
    )

    def fly(one: GuardedVehicle, time_s: float) -> None:
        # 1.67 km north at 7 m/s, taking far more than the model has it
        one.is_armed = True
        metres = min(7.0 * time_s, 1600.0)
        one.place = (500_000_000 + round(metres / 111.2e3 * 1e7), 200_000_000, 100_000)
        one.sequence = 1
        one.energy_consumed_hj = round(0.25 * time_s * 36.0)  # 0.25 Wh a second, 900 W
        one.battery_remaining = max(95 - round(0.25 * time_s / 0.77), 0)

    for second in range(1, 230):
        vehicle.script.append((30.0 + second, lambda one, s=second: fly(one, float(s))))  # type: ignore[misc] # bound now
    run = guard(vehicle, until_s=255.0)
    warned = [str(one.details["concern"]) for one in run.decided("energy")]
    assert warned.index("return-soon") < warned.index("no-return")
    assert sorted(set(warned)) == sorted(warned)
    flying = [status for status in run.statuses if status.is_flying]
    assert flying[-1].energy is not None
    assert flying[-1].energy.ratio is not None
    assert flying[-1].energy.ratio > 1.5
    texts = [text for _, severity, text in vehicle.texts if severity <= 3]
    assert any("no return in" in text for text in texts)
    assert not run.decided("withdrawn")
