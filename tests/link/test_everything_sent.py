"""Every message that every command sends to both simulated vehicles, read: nothing arms, moves or sets."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from simulated_vehicles import memory_line

from planner.autopilot import Autopilot
from planner.cli.main import main
from planner.link.address import read_address
from planner.link.vehicle import LinkRequest
from planner.link.wire import LAYOUTS, Codec
from planner.service.guard import watch_vehicle
from planner.setup import Setup
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from simulated_vehicles import MemoryLine

    from planner.guard.session import GuardStatus
    from planner.link.snapshot import VehicleSnapshot
    from planner.link.wire import Message

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
URL = "udpin:127.0.0.1:14550"
READING = {
    *("HEARTBEAT", "COMMAND_LONG", "PARAM_REQUEST_LIST", "PARAM_REQUEST_READ"),
    *("MISSION_REQUEST_LIST", "MISSION_REQUEST_INT", "MISSION_ACK", "REQUEST_EVENT"),
    *("FILE_TRANSFER_PROTOCOL", "LOG_REQUEST_LIST", "LOG_REQUEST_DATA", "LOG_REQUEST_END"),
    "TIMESYNC",
}
"""What asks, and the word that a list has come; a TIMESYNC asks for its own number back."""
MORE = {"upload": {"MISSION_COUNT", "MISSION_ITEM_INT"}, "guard": {"COMMAND_ACK", "STATUSTEXT"}}
ASKING = {"MAV_CMD_SET_MESSAGE_INTERVAL", "MAV_CMD_REQUEST_MESSAGE"}
READING_FILES = {1, 2, 3, 4, 5, 14, 15}
"""TerminateSession, ResetSessions, ListDirectory, OpenFileRO, ReadFile, CalcFileCRC32,
BurstReadFile."""


class _Recorded:
    """A line that keeps what is sent, and is over after a time."""

    def __init__(self, line: MemoryLine, until_s: float) -> None:
        self._line = line
        self._until_s = until_s
        self.sent: list[bytes] = []

    def now_s(self) -> float:
        return self._line.now_s()

    def receive(self, timeout_s: float) -> object:
        if self.now_s() > self._until_s:
            raise KeyboardInterrupt
        return self._line.receive(timeout_s)

    def send(self, data: bytes, peer: object = None) -> None:  # noqa: ARG002 - one vehicle
        self.sent.append(data)
        self._line.send(data, None)

    def close(self) -> None:
        self._line.close()


def _recorded(autopilot: Autopilot, faults: str = "loss=10%", until_s: float = 900.0) -> _Recorded:
    authoriser = 245 if autopilot is PX4 else None
    line = memory_line(autopilot, faults, authoriser=authoriser)
    line._wire.vehicle.arm_at(30.0, retry_s=15.0)
    return _Recorded(line, until_s)


def _messages(recorded: _Recorded) -> list[Message]:
    codec = Codec(0, 0)
    messages = [one for frame in recorded.sent for one in codec.decode(frame)]
    assert len(messages) == len(recorded.sent)  # each of them is understood
    return messages


def _refuse_acts(recorded: _Recorded, allowed: set[str]) -> None:
    """Fail where anything went out that would do something."""
    commands = dialect.enums["MAV_CMD"]
    for one in _messages(recorded):
        assert one.name in allowed, one
        assert one.name in LAYOUTS or hasattr(dialect, f"MAVLINK_MSG_ID_{one.name}")
        if one.name == "COMMAND_LONG":
            assert commands[one["command"]].name in ASKING, one
        if one.name == "COMMAND_ACK":
            assert commands[one["command"]].name == "MAV_CMD_ARM_AUTHORIZATION_REQUEST"
        if one.name == "FILE_TRANSFER_PROTOCOL":
            assert bytes(one["payload"])[3] in READING_FILES, one
        assert one.name != "TIMESYNC" or one["tc1"] == 0, one
    assert not recorded._line._wire.vehicle.acts


@BOTH
@pytest.mark.parametrize("command", ["fetch", "check", "diff", "logs", "upload", "guard"])
def test_no_command_sends_anything_that_arms_moves_or_sets(
    command: str, autopilot: Autopilot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    lines: list[_Recorded] = []
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: lines[-1])
    lines.append(_recorded(autopilot, faults=""))
    assert main(["fetch", URL, "-o", "own.plan"]) == 0
    model = ("--vehicle", "arducopter-sitl-quad", "--battery", "177Wh")
    arguments = {
        "fetch": (URL, "-o", "again.plan"),
        "check": (URL, *model),
        "diff": ("own.plan", URL),
        "logs": (URL, "--all"),
        "upload": ("own.plan", URL, "--yes", "--force", *model),
        "guard": (URL, *model),
    }
    lines.append(_recorded(autopilot, until_s=100.0))
    ended = main([command, *arguments[command]])
    assert ended == (130 if command == "guard" else 0) or command in {"check", "upload"}
    _refuse_acts(lines[-1], READING | MORE.get(command, set()))
    names = {one.name for one in _messages(lines[-1])}
    if command == "upload":
        assert names >= MORE["upload"]
    if command == "guard":
        assert names & MORE["guard"]


@BOTH
def test_a_review_sends_nothing_that_arms_moves_or_sets(
    autopilot: Autopilot, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorded, is_over = _recorded(autopilot), threading.Event()
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: recorded)

    class _Watcher:
        snapshots = 0

        def progress(self, what: str, done: int, count: int | None) -> None: ...

        def received(self, snapshot: VehicleSnapshot) -> None:
            assert snapshot.mission.items
            self.snapshots += 1

        def reported(self, _: GuardStatus) -> None:
            if recorded.now_s() > 100.0:
                is_over.set()

        def lost(self, why: str) -> None:
            pytest.fail(why)

    watcher = _Watcher()
    check = Setup(load_vehicle("arducopter-sitl-quad"))
    request = LinkRequest(address=read_address(URL))
    watch_vehicle(request, check, is_over=is_over, watcher=watcher)
    assert watcher.snapshots
    _refuse_acts(recorded, READING)
