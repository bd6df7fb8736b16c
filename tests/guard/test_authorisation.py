"""Arm authorisation: the fields of an answer, the vehicle's settings, MAVSDK's server on our line."""

from __future__ import annotations

import math
import queue
import threading
from typing import TYPE_CHECKING

import pytest

from planner.guard.authorisation import (
    ArmAnswer,
    ArmRequest,
    ArmResult,
    DenialReason,
    MavsdkAuthoriser,
    acknowledgement_fields,
    arming_settings,
)
from planner.link.connection import Gate, Purpose
from planner.link.telemetry import VehicleIdentity
from planner.link.wire import Codec, message

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

REQUEST = ArmRequest(system=1, component=1)


def test_an_acceptance_says_how_long_it_holds_where_px4_looks_for_it() -> None:
    accepted = ArmAnswer(result=ArmResult.ACCEPTED, text="go", valid_for_s=30)
    assert acknowledgement_fields(REQUEST, accepted) == {
        "command": 3001,
        "result": 0,
        "progress": 0,
        "result_param2": 30,
        "target_system": 1,
        "target_component": 1,
    }


def test_a_denial_says_the_reason_first_and_then_the_waypoint() -> None:
    denied = ArmAnswer(
        result=ArmResult.DENIED, text="", reason=DenialReason.INVALID_WAYPOINT, extra_info=7
    )
    fields = acknowledgement_fields(REQUEST, denied)
    assert (fields["result"], fields["progress"], fields["result_param2"]) == (2, 2, 7)


def test_a_vehicle_set_to_ask_us_is_known() -> None:
    parameters = {"COM_ARM_AUTH_REQ": 1.0, "COM_ARM_AUTH_ID": 245.0, "COM_ARM_AUTH_TO": 2.0}
    settings = arming_settings(parameters, authoriser=245)
    assert settings.is_asking
    assert settings.wait_s == 2.0
    assert "COM_ARM_AUTH_TO 5" in settings.advice
    patient = arming_settings({**parameters, "COM_ARM_AUTH_TO": 5.0}, authoriser=245)
    assert "COM_ARM_AUTH_TO" not in patient.advice


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({}, "does not ask"),
        (
            {"COM_ARM_AUTH_REQ": 0.0},
            "COM_ARM_AUTH_REQ 1, COM_ARM_AUTH_ID 245 and COM_ARM_AUTH_TO 5",
        ),
        ({"COM_ARM_AUTH_REQ": 1.0, "COM_ARM_AUTH_ID": 10.0}, "set COM_ARM_AUTH_ID 245"),
    ],
)
def test_a_vehicle_that_will_not_ask_us_is_told_of_with_what_to_set(
    parameters: dict[str, float | None], words: str
) -> None:
    settings = arming_settings(parameters, authoriser=245)
    assert not settings.is_asking
    assert words in settings.advice


@pytest.mark.parametrize("name", ["REQ", "ID", "MET", "TO"])
def test_a_setting_that_is_no_number_is_unread(name: str) -> None:
    parameters = {"COM_ARM_AUTH_REQ": 1.0, "COM_ARM_AUTH_ID": 245.0}
    settings = arming_settings({**parameters, f"COM_ARM_AUTH_{name}": math.nan}, authoriser=245)
    assert settings.is_asking is None
    assert "unknown" in settings.advice


class FakeConnection:
    """What MAVSDK reads along on."""

    def __init__(self) -> None:
        self.own_system = 245
        self.vehicle = VehicleIdentity(system=1, component=1, autopilot_number=12, vehicle_type=2)
        self.on_frame: Callable[[bytes], None] | None = None
        self.gate = Gate(Purpose.GUARD)
        self.sent: queue.Queue[bytes] = queue.Queue()
        self.refused: list[bytes] = []

    def send_frame(self, frame: bytes) -> bool:
        self.sent.put(frame)
        is_out = self.gate.lets_out(frame)
        self.refused += [] if is_out else [frame]
        return is_out


@pytest.fixture
def mavsdk_line() -> Iterator[tuple[FakeConnection, MavsdkAuthoriser]]:
    connection = FakeConnection()
    authoriser = MavsdkAuthoriser(connection)  # type: ignore[arg-type] # what it uses of one
    yield connection, authoriser
    authoriser.close()


def requested(authoriser: MavsdkAuthoriser) -> ArmRequest:
    """Return the request that MAVSDK's thread hands over."""
    patience = threading.Event()
    for _ in range(1000):
        if found := authoriser.requests():
            return found[0]
        patience.wait(0.01)
    pytest.fail("MAVSDK heard no request")


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (ArmAnswer(result=ArmResult.ACCEPTED, text="go", valid_for_s=30), (0, None, 30)),
        (
            ArmAnswer(
                result=ArmResult.DENIED, text="", reason=DenialReason.INVALID_WAYPOINT, extra_info=7
            ),
            (2, 2, 7),
        ),
        (
            ArmAnswer(
                result=ArmResult.TEMPORARILY_REJECTED, text="", reason=DenialReason.BAD_WEATHER
            ),
            (1, 5, 0),
        ),
    ],
)
def test_mavsdk_answers_a_pymavlink_request_over_our_line(
    mavsdk_line: tuple[FakeConnection, MavsdkAuthoriser],
    answer: ArmAnswer,
    expected: tuple[int, int | None, int],
) -> None:
    connection, authoriser = mavsdk_line
    assert connection.on_frame is not None
    vehicle = Codec(1, 1)
    heartbeat = message("HEARTBEAT", type=2, autopilot=12, system_status=3, mavlink_version=3)
    connection.on_frame(vehicle.encode(heartbeat))
    asked = message("COMMAND_LONG", target_system=245, command=3001)
    for confirmation in range(2):  # repeated where the answer was lost: each gets its own
        fields = {**asked.fields, "confirmation": confirmation}
        connection.on_frame(vehicle.encode(message("COMMAND_LONG", **fields)))
        assert requested(authoriser).system == 1
        authoriser.answer(answer)
        ack = next_ack(connection, vehicle)
        result, progress, extra = expected
        assert (ack["result"], ack["result_param2"], ack["target_system"]) == (result, extra, 1)
        if progress is not None:  # MAVSDK says 255 in an acceptance: not known
            assert ack["progress"] == progress
    assert not connection.refused


def next_ack(connection: FakeConnection, decoder: Codec) -> dict[str, int]:
    while True:
        for one in decoder.decode(connection.sent.get(timeout=10.0)):
            if one.name == "COMMAND_ACK":
                return dict(one.fields)
