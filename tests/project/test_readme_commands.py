"""Every command that the README shows runs as it is written, in a fresh clone."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import click
import pytest
from dataflash_writer import copter_log
from simulated_vehicles import MemoryLine

import planner
from planner.autopilot import Autopilot
from planner.cli.main import cli, main
from planner.report.text import Medium
from planner.report.topics import topic_names, topic_text
from planner.service.simulation import (
    SimulationRequest,
    make_simulated_vehicle,
    make_simulated_wire,
)
from planner.setup import Setup

if TYPE_CHECKING:
    from collections.abc import Hashable

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
TYPED = re.sub(r"<!-- begin.*?<!-- end -->", "", README, flags=re.DOTALL)
COMMANDS = re.findall(r"^\$ mavjoule (.*)$", TYPED, re.MULTILINE)
INTERRUPTED_AFTER_S = 30.0


class InterruptedLine(MemoryLine):
    """A line to a simulated vehicle on which someone types Ctrl-C after a while."""

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return the frames that come first, or none."""
        if self.now_s() > INTERRUPTED_AFTER_S:
            raise KeyboardInterrupt
        return super().receive(timeout_s)


def _simulated_line(line: type[MemoryLine]) -> MemoryLine:
    """Return a line to what the README simulates."""
    vehicle = planner.load_vehicle("my-quad.toml")
    asked = SimulationRequest(autopilot=Autopilot.ARDUPILOT, setup=Setup(vehicle))
    mission = planner.read_mission("missions/survey-vineyard.plan")
    return line(make_simulated_wire(make_simulated_vehicle(mission, asked), asked))


def _words(command: str) -> list[str]:
    """Return the words of a command as a shell hands them over."""
    return [
        path
        for word in shlex.split(command)
        for path in (sorted(map(str, Path().glob(word))) if "*" in word else [word])
    ]


def test_every_command_runs_as_it_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("missions", "models"):
        shutil.copytree(ROOT / folder, folder)
    for log in ("hover.BIN", "cruise.BIN"):
        Path(log).write_bytes(copter_log().content())
    monkeypatch.setattr("planner.cli.review._refuse_terminal", lambda *_: None)
    monkeypatch.setattr("planner.tui.app.ReviewApp.run", lambda _: None)
    ended = {}
    for command in COMMANDS:
        is_guard = command.startswith("guard")
        line = InterruptedLine if is_guard else MemoryLine
        monkeypatch.setattr(
            "planner.link.vehicle.open_line", lambda _, line=line: _simulated_line(line)
        )
        code = main(_words(command))
        out, err = capsys.readouterr()
        is_no_go = "NO-GO" in out and command.startswith("check missions ")
        if code != (130 if is_guard else int(is_no_go)):
            ended[command] = (code, err)
    assert ended == {}
    assert len(COMMANDS) > 25


def _shown(text: str) -> list[str]:
    """Return the commands in the blocks of a text, each a line."""
    blocks = re.findall(r"^(?:    .*\n)+", text, re.MULTILINE)
    return re.findall(r"^\s+\$? ?mavjoule (.*)$", "".join(blocks), re.MULTILINE)


@pytest.mark.parametrize("topic", topic_names())
def test_every_command_of_a_topic_has_options_that_exist(topic: str) -> None:
    for command in _shown(topic_text(topic, medium=Medium())):
        name, *words = shlex.split(command)
        with click.Context(cli, info_name="mavjoule") as parent:
            found = cli.get_command(parent, name)
            assert found is not None, command
            found.make_context(name, words, parent=parent)
