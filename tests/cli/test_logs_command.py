from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from file_servers import FileServer, Px4Files, bitwise_crc32
from virtual_vehicle import VirtualLine, VirtualVehicle

from planner.cli.main import main
from planner.link.files import crc32_of
from planner.link.wire import Message, message

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
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: lines.pop(0))
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


class _FilingVehicle(VirtualVehicle):
    """PX4 with its file protocol."""

    files: FileServer

    def _on_file_transfer_protocol(self, one: Message, _: float) -> list[Message]:
        return self.files(one)


NAME = "2026-01-01-12_00_00.ulg"


def _filing(content: bytes, *, has_checksums: bool = True) -> _FilingVehicle:
    vehicle = _FilingVehicle()
    vehicle.files = Px4Files({"/fs/microsd/log/2026-01-01/12_00_00.ulg": content})
    vehicle.files.has_checksums = has_checksums
    return vehicle


def test_the_checksum_of_a_file_is_the_one_that_vehicles_compute(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(CONTENT)
    assert crc32_of(path) == bitwise_crc32(CONTENT)


@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_a_log_that_is_there_is_told_by_its_checksum_and_not_downloaded_again(
    on_line: list[VirtualLine], tmp_path: Path, loss: float, capsys: pytest.CaptureFixture[str]
) -> None:
    on_line += [VirtualLine(_filing(CONTENT), loss=loss), VirtualLine(_filing(CONTENT), loss=loss)]
    for told in (f"{NAME} is complete: its checksum", f"{NAME} was already here: its checksum"):
        assert main(["logs", URL, "--all"]) == 0
        assert told in capsys.readouterr().err
        assert (tmp_path / NAME).read_bytes() == CONTENT
    assert [one.name for one in tmp_path.iterdir()] == [NAME]


@pytest.mark.parametrize("has_checksums", [True, False])
@pytest.mark.parametrize("other", [bytes(len(CONTENT)), CONTENT[::-1], b"notes", CONTENT * 2])
def test_another_file_of_a_logs_name_is_never_lost(
    on_line: list[VirtualLine],
    tmp_path: Path,
    other: bytes,
    has_checksums: bool,  # noqa: FBT001 - a parameter of a test
) -> None:
    (tmp_path / NAME).write_bytes(other)
    on_line += [VirtualLine(_filing(CONTENT, has_checksums=has_checksums)) for _ in range(3)]
    for _ in range(2):
        assert main(["logs", URL, "--all"]) == 0
        assert {one.name: one.read_bytes() for one in tmp_path.iterdir()} == {
            NAME: other,
            NAME.replace(".", "-2."): CONTENT,
        }
    (tmp_path / NAME.replace(".", "-2.")).unlink()
    assert main(["logs", URL, "--all", "--force"]) == 0
    assert {one.name: one.read_bytes() for one in tmp_path.iterdir()} == {NAME: CONTENT}


def test_logs_of_one_name_from_two_vehicles_are_both_kept_without_a_file_protocol(
    on_line: list[VirtualLine], tmp_path: Path
) -> None:
    (tmp_path / "log-00001.ulg").write_bytes(CONTENT[::-1])
    on_line += [VirtualLine(_LoggingVehicle()), VirtualLine(_LoggingVehicle())]
    for _ in range(2):
        assert main(["logs", URL, "--all"]) == 0
        assert {one.name: one.read_bytes() for one in tmp_path.iterdir()} == {
            "log-00001.ulg": CONTENT[::-1],
            "log-00001-2.ulg": CONTENT,
        }


def test_a_part_of_another_log_with_the_same_end_is_found_by_the_checksum(
    on_line: list[VirtualLine], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = b"another vehicle's" + CONTENT[17:]
    (tmp_path / f"{NAME}.part").write_bytes(part)
    on_line.append(VirtualLine(_filing(CONTENT)))
    assert main(["logs", URL, "--all"]) == 3
    assert "another checksum than the vehicle reports" in capsys.readouterr().err
    assert {one.name: one.read_bytes() for one in tmp_path.iterdir()} == {f"{NAME}.part": part}


def test_parts_of_other_logs_are_left_alone(on_line: list[VirtualLine], tmp_path: Path) -> None:
    others = {f"{NAME}.part": b"another" * 100, NAME.replace(".ulg", "-2.ulg.part"): CONTENT * 2}
    for name, content in others.items():
        (tmp_path / name).write_bytes(content)
    on_line.append(VirtualLine(_filing(CONTENT), loss=0.2))
    assert main(["logs", URL, "--all"]) == 0
    assert {one.name: one.read_bytes() for one in tmp_path.iterdir()} == {**others, NAME: CONTENT}
