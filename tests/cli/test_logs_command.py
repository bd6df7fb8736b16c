from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from virtual_vehicle import VirtualLine, VirtualVehicle

from planner.cli.main import main
from planner.link import pymavlink_link
from planner.link.message import Message, message

if TYPE_CHECKING:
    from pathlib import Path

URL = "udp:127.0.0.1:14550"
CONTENT = bytes(range(256)) * 20


class _LoggingVehicle(VirtualVehicle):
    """It has logs, and no file protocol; like PX4 it sends data of a list that it keeps."""

    logs = 1
    is_listed = False

    def _on_log_request_list(self, _: Message, __: float) -> list[Message]:
        self.is_listed = True
        return [
            message("LOG_ENTRY", id=number, num_logs=self.logs, last_log_num=1, size=len(CONTENT))
            for number in range(1, self.logs + 1)
        ]

    def _on_log_request_end(self, _: Message, __: float) -> list[Message]:
        self.is_listed = False
        return []

    def _on_log_request_data(self, one: Message, _: float) -> list[Message]:
        if not self.is_listed:
            return []
        start, end = one["ofs"], min(one["ofs"] + one["count"], len(CONTENT))
        return [
            message("LOG_DATA", id=one["id"], ofs=at, count=len(part), data=part.ljust(90, b"\0"))
            for at in range(start, end, 90)
            for part in [CONTENT[at : min(at + 90, end)]]
        ]


@pytest.fixture
def on_line(monkeypatch: pytest.MonkeyPatch) -> list[VirtualLine]:
    """What a test puts here is what an address opens."""
    lines: list[VirtualLine] = []
    monkeypatch.setattr(pymavlink_link, "open_line", lambda _: lines.pop(0))
    return lines


def test_logs_are_listed_where_there_is_no_file_protocol(
    on_line: list[VirtualLine], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    on_line.append(VirtualLine(_LoggingVehicle()))
    assert main(["logs", URL]) == 0
    assert capsys.readouterr().out.split() == [str(len(CONTENT)), "log-00001.ulg"]
    assert list(tmp_path.iterdir()) == []


def test_a_download_that_broke_off_goes_on_where_it_ended(
    on_line: list[VirtualLine], tmp_path: Path
) -> None:
    whole = VirtualLine(_LoggingVehicle())
    on_line.append(VirtualLine(_LoggingVehicle(), cut_after=60))
    assert main(["logs", URL, "--all", "--retries", "2"]) == 3
    part = tmp_path / "log-00001.ulg.part"
    assert 0 < part.stat().st_size < len(CONTENT)
    on_line.append(whole)
    assert main(["logs", URL, "log-00001.ulg"]) == 0
    assert (tmp_path / "log-00001.ulg").read_bytes() == CONTENT
    assert not part.exists()


def test_several_logs_come_of_one_list(on_line: list[VirtualLine], tmp_path: Path) -> None:
    vehicle = _LoggingVehicle()
    vehicle.logs = 3
    line = VirtualLine(vehicle, loss=0.2)
    on_line.append(line)
    assert main(["logs", URL, "--all"]) == 0
    assert [path.read_bytes() for path in sorted(tmp_path.iterdir())] == [CONTENT] * 3
    assert line.sent[-1][7] == 122  # LOG_REQUEST_END


def test_a_part_of_another_log_is_not_gone_on_with(
    on_line: list[VirtualLine], tmp_path: Path
) -> None:
    (tmp_path / "log-00001.ulg.part").write_bytes(b"another" * 100)
    on_line.append(VirtualLine(_LoggingVehicle(), loss=0.2))
    assert main(["logs", URL, "--all"]) == 0
    assert (tmp_path / "log-00001.ulg").read_bytes() == CONTENT


def test_a_log_that_is_not_there_ends_in_exit_2(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    on_line.append(VirtualLine(_LoggingVehicle()))
    assert main(["logs", URL, "mine.ulg"]) == 2
    assert "the vehicle has no log mine.ulg" in capsys.readouterr().err
