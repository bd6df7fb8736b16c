"""Every command whose line is cut at any message of its transfers, or loses a fifth of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import memory_line, out_and_back, vehicle

from planner.autopilot import Autopilot
from planner.cli.main import main
from planner.errors import LinkError
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, mission_of_lists
from planner.link.transfers import LinkSettings
from planner.link.upload import BrokenUploadError, upload_mission
from planner.link.vehicle import VehicleLink
from planner.mission.compare import compare_missions

if TYPE_CHECKING:
    from pathlib import Path

    from simulated_vehicles import MemoryLine

    from planner.mission.items import Mission

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
PROTOCOLS = pytest.mark.parametrize("has_files", [True, False], ids=["files", "log protocol"])
URL = "udpin:127.0.0.1:14550"
NEW = mission(takeoff(35.0), waypoint(300.0, 35.0), waypoint(600.0, 35.0), rtl())
PATIENCE_S = 300.0


def _content(autopilot: Autopilot) -> bytes:
    return vehicle(autopilot).setup.logs[0].content


def _line(autopilot: Autopilot, faults: str, *, has_files: bool = False) -> MemoryLine:
    return memory_line(autopilot, faults if has_files else f"{faults},no-files")


@pytest.fixture
def on_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[MemoryLine]:
    """What a test puts here is what an address opens."""
    lines: list[MemoryLine] = []
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: lines.pop(0))
    monkeypatch.chdir(tmp_path)
    return lines


@BOTH
@PROTOCOLS
@pytest.mark.parametrize("seed", range(2))
def test_a_log_comes_whole_when_a_fifth_is_lost_both_ways(
    on_line: list[MemoryLine], tmp_path: Path, autopilot: Autopilot, *, has_files: bool, seed: int
) -> None:
    line = _line(autopilot, f"loss=20%,seed={seed}", has_files=has_files)
    on_line.append(line)
    assert main(["logs", URL, "--all"]) == 0
    (log,) = tmp_path.iterdir()
    assert log.read_bytes() == _content(autopilot)
    assert line.now_s() < PATIENCE_S


@BOTH
@PROTOCOLS
def test_a_log_that_was_cut_anywhere_is_gone_on_with(
    on_line: list[MemoryLine],
    tmp_path: Path,
    autopilot: Autopilot,
    capsys: pytest.CaptureFixture[str],
    *,
    has_files: bool,
) -> None:
    content = _content(autopilot)
    for position in range(0, 100, 7):
        line = _line(autopilot, f"silence={position}", has_files=has_files)
        on_line.append(line)
        ended = main(["logs", URL, "--all", "--retries", "2"])
        assert ended in {0, 3}, position
        assert line.now_s() < PATIENCE_S
        said = capsys.readouterr().err
        assert (ended == 3) == ("stalled" in said or "could not" in said), (position, said)
        for path in tmp_path.iterdir():
            assert content.startswith(path.read_bytes()), position
            assert path.suffix == ".part" or path.read_bytes() == content
        on_line.append(_line(autopilot, "", has_files=has_files))
        assert main(["logs", URL, "--all"]) == 0
        (log,) = tmp_path.iterdir()
        assert log.read_bytes() == content, position
        log.unlink()


@BOTH
@pytest.mark.parametrize(
    "command", [("fetch", URL, "-o", "cut.plan"), ("check", URL), ("diff", "own.plan", URL)]
)
def test_a_command_that_reads_ends_in_exit_3_wherever_the_line_is_cut(
    on_line: list[MemoryLine],
    tmp_path: Path,
    autopilot: Autopilot,
    command: tuple[str, ...],
    capsys: pytest.CaptureFixture[str],
) -> None:
    on_line.append(memory_line(autopilot))
    assert main(["fetch", URL, "-o", "own.plan"]) == 0
    files = {path.name for path in tmp_path.iterdir()}
    # Three lists of 4 or 5, 4 and 1 items, each a count and the last word besides; then parameters.
    for position in range(0, 30, 4):
        line = memory_line(autopilot, f"silence={position}")
        on_line.append(line)
        ended = main([*command, "--retries", "2"])
        said = capsys.readouterr().err
        is_over = command[0] == "diff" and "stalled" not in said
        assert ended == 3 or is_over, (position, said)
        assert line.now_s() < PATIENCE_S
        assert {path.name for path in tmp_path.iterdir()} == files


def _held(line: MemoryLine) -> Mission:
    made = line._wire.vehicle
    lists = {kind: tuple(items) for kind, items in made.missions.lists.items()}
    return mission_of_lists(lists, made.setup.identity, home=None, source="held")


def _is_as(line: MemoryLine, sent: Mission, autopilot: Autopilot) -> bool:
    differences = compare_missions(sent, _held(line), autopilot=autopilot)
    return not any(one.matters for one in differences)


@BOTH
@pytest.mark.parametrize("seed", range(2))
def test_a_mission_is_put_in_place_when_a_fifth_is_lost_both_ways(
    autopilot: Autopilot, seed: int
) -> None:
    line = memory_line(autopilot, f"loss=20%,seed={seed}")
    link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
    assert upload_mission(link, NEW, listen_s=2.0).is_good
    assert _is_as(line, NEW, autopilot)


@BOTH
def test_an_upload_whose_line_comes_back_leaves_the_old_or_the_new_mission_whole(
    autopilot: Autopilot,
) -> None:
    old = out_and_back()
    for position in range(0, 78, 5):
        line = memory_line(autopilot, f"silence={position}:9")
        settings = LinkSettings(retries=3)  # it gives up within the silence
        link = VehicleLink(line, name="simulated", settings=settings, purpose=Purpose.UPLOAD)
        expected = NEW
        try:
            assert upload_mission(link, NEW, listen_s=1.0).is_good, position
        except BrokenUploadError as error:
            pytest.fail(f"cut at {position}: {error}")
        except LinkError:  # and the message says so
            expected = old
        assert _is_as(line, expected, autopilot), position
        assert line.now_s() < PATIENCE_S
        assert len(_held(line).items) == 4
        assert set(MissionKind) == set(line._wire.vehicle.missions.lists)
