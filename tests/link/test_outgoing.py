"""What may go out, read from the table itself and from every line a test opened."""

from __future__ import annotations

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from planner.link.connection import COMMANDS, FILE_OPERATIONS, MESSAGES, Gate, Purpose
from planner.link.wire import LAYOUTS, Codec, message

FORBIDDEN = {
    *("SET_MODE", "PARAM_SET", "PARAM_EXT_SET", "COMMAND_INT", "MANUAL_CONTROL"),
    *("RC_CHANNELS_OVERRIDE", "MISSION_SET_CURRENT", "MISSION_CLEAR_ALL", "MISSION_ITEM"),
    *("SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT", "SET_ATTITUDE_TARGET"),
    *("SET_HOME_POSITION", "SET_GPS_GLOBAL_ORIGIN", "LOG_ERASE", "SERIAL_CONTROL", "PLAY_TUNE"),
}


@pytest.mark.parametrize("purpose", Purpose)
def test_the_table_names_messages_as_mavlink_does_and_none_that_acts(purpose: Purpose) -> None:
    for number, name in MESSAGES[purpose].items():
        known = dialect.mavlink_map.get(number)
        # pymavlink does not know PX4's events: test_newer_messages holds them against MAVSDK.
        assert (LAYOUTS[name].number if known is None else known.msgname) in {name, number}
    assert not FORBIDDEN & set(MESSAGES[purpose].values())


def test_every_command_of_the_table_only_asks_for_messages() -> None:
    commands = dialect.enums["MAV_CMD"]
    for number, name in COMMANDS.items():
        assert commands[number].name == f"MAV_CMD_{name}"
        assert name.startswith(("GET_", "REQUEST_", "SET_MESSAGE_INTERVAL"))


def test_no_file_operation_of_the_table_writes() -> None:
    from pymavlink import mavftp

    writing = {
        *(mavftp.OP_CreateFile, mavftp.OP_WriteFile, mavftp.OP_RemoveFile, mavftp.OP_Rename),
        *(mavftp.OP_CreateDirectory, mavftp.OP_RemoveDirectory, mavftp.OP_TruncateFile),
        *(mavftp.OP_OpenFileWO,),
    }
    assert not writing & FILE_OPERATIONS.keys()


@pytest.mark.parametrize("purpose", Purpose)
@pytest.mark.parametrize("number", sorted(dialect.mavlink_map))
def test_the_gate_lets_out_what_the_table_names_and_nothing_else(
    purpose: Purpose, number: int
) -> None:
    kind = dialect.mavlink_map[number]
    # A COMMAND_LONG of zeros is command 0, which is none of the table's.
    expected = number in MESSAGES[purpose] and kind.msgname != "COMMAND_LONG"
    assert Gate(purpose).lets_out(_frame(number)) is expected


@pytest.mark.parametrize("command", sorted(dialect.enums["MAV_CMD"]))
def test_the_gate_lets_out_no_command_that_acts(command: int) -> None:
    if command > 65_535:
        return
    gate = Gate(Purpose.GUARD)
    frame = Codec(245, 190).encode(message("COMMAND_LONG", command=command), target=(1, 1))
    assert gate.lets_out(frame) is (command in COMMANDS)


@pytest.mark.parametrize("operation", range(256))
def test_the_gate_lets_out_no_file_operation_that_writes(operation: int) -> None:
    payload = bytearray(251)
    payload[3] = operation
    frame = Codec(245, 190).encode(
        message("FILE_TRANSFER_PROTOCOL", payload=payload), target=(1, 1)
    )
    assert Gate(Purpose.READ).lets_out(frame) is (operation in FILE_OPERATIONS)


@given(st.binary(max_size=300))
def test_the_gate_holds_back_what_is_no_frame(data: bytes) -> None:
    gate = Gate(Purpose.UPLOAD)
    if gate.lets_out(data):
        assert data[0] in {0xFD, 0xFE}
        assert int.from_bytes(data[7:10], "little") in MESSAGES[Purpose.UPLOAD] or data[0] == 0xFE


def test_the_second_version_is_spoken_whatever_the_environment_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("MAVLINK20", raising=False)
    frame = Codec(245, 190).encode(message("HEARTBEAT", type=6, autopilot=8, mavlink_version=3))
    assert frame[0] == 0xFD
    assert "MAVLINK20" not in os.environ  # it is other programs' as well


def _frame(number: int) -> bytes:
    """Return a frame of a message that holds zeros; nobody looks at its checksum on the way out."""
    head = bytes([0xFD, 40, 0, 0, 0, 245, 190]) + number.to_bytes(3, "little")
    return head + bytes(40) + bytes(2)
