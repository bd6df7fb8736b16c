"""What a shell offers after the tabulator."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import planner
from planner import catalogue
from planner.cli.main import COMMANDS, main
from planner.setup import FORMATS
from planner.vehicle.library import model_names

if TYPE_CHECKING:
    from collections.abc import Callable

    Complete = Callable[[str], list[str]]


@pytest.fixture
def complete(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Complete:
    """Return what bash is offered for a line, the last word being begun; files as ``<file>``."""

    def ask(line: str) -> list[str]:
        monkeypatch.setenv("_MAVJOULE_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", line)
        monkeypatch.setenv("COMP_CWORD", str(len(line.split(" ")) - 1))
        with pytest.raises(SystemExit) as ended:
            main([])
        assert ended.value.code == 0
        offers = [one.partition(",") for one in capsys.readouterr().out.split()]
        return ["<file>" if kind == "file" else text for kind, _, text in offers]

    return ask


def test_commands_are_offered(complete: Complete) -> None:
    assert complete("mavjoule ") == list(COMMANDS)
    assert complete("mavjoule ru") == ["rules"]


def test_models_and_files_are_offered_for_a_vehicle(complete: Complete) -> None:
    assert complete("mavjoule check --vehicle ") == ["<file>", *model_names()]
    assert complete("mavjoule check --vehicle falk") == ["<file>", "falkowski-2023-quadrotor"]
    assert complete("mavjoule check --vehicle zzz") == ["<file>"]


@pytest.mark.parametrize("option", ["--select", "--extend-select", "--ignore"])
def test_codes_are_offered_one_after_the_other(complete: Complete, option: str) -> None:
    codes = [code for code in catalogue.rules() if code.startswith("E10")]
    assert codes
    assert complete(f"mavjoule check {option} e10") == codes
    assert complete(f"mavjoule check {option} F,E10") == [f"F,{code}" for code in codes]


def test_every_choice_of_an_option_is_offered(complete: Complete) -> None:
    assert complete("mavjoule check --format ") == list(FORMATS)
    assert complete("mavjoule check --fail-on ") == ["error", "warning"]
    assert complete("mavjoule check --autopilot p") == ["px4"]


def test_files_are_offered_for_missions_and_other_files(complete: Complete) -> None:
    for line in ("check ", "check --params ", "check --baseline k", "segments ", "check a.plan "):
        assert complete(f"mavjoule {line}") == ["<file>"]


def test_nothing_is_offered_where_nothing_is_known(complete: Complete) -> None:
    assert complete("mavjoule check --battery ") == []


def test_codes_and_names_are_offered_to_be_explained(complete: Complete) -> None:
    assert complete("mavjoule explain E101") == ["E101"]
    assert complete("mavjoule explain reserve-b") == ["reserve-below-minimum"]


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_a_shell_gets_the_script_that_asks(
    shell: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("_MAVJOULE_COMPLETE", f"{shell}_source")
    assert f"_MAVJOULE_COMPLETE={shell}_complete" in _script(shell, monkeypatch, capsys)


def _script(shell: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> str:
    monkeypatch.setenv("_MAVJOULE_COMPLETE", f"{shell}_source")
    with pytest.raises(SystemExit) as ended:
        main([])
    monkeypatch.delenv("_MAVJOULE_COMPLETE")
    assert ended.value.code == 0
    return capsys.readouterr().out


_ASKING = {
    "bash": """
        COMP_WORDS=({line}) COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 ))
        _mavjoule_completion mavjoule; printf '%s\\n' "${{COMPREPLY[@]}}"
    """,
    "zsh": """
        compadd() {{ print -l -- $completions }}
        words=({line}) CURRENT=$#words
        _mavjoule_completion
    """,
    "fish": "complete -C '{line}'",
}
"""What has a shell complete a line by the script sourced before; without a terminal."""


@pytest.mark.parametrize("shell", _ASKING)
def test_each_shell_offers_codes_after_a_comma(
    shell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    program = shutil.which(shell)
    if program is None:
        pytest.skip(f"{shell} is not installed")
    own = tmp_path / "mavjoule"
    start = "import sys; from planner.cli.main import main; sys.exit(main())"
    own.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "{start}" "$@"\n', encoding="utf-8")
    own.chmod(0o755)
    script = tmp_path / "script"
    text = _script(shell, monkeypatch, capsys)
    asking = _ASKING[shell].format(line="mavjoule check --ignore F,E100")
    stub = "compdef() {}\n" if shell == "zsh" else ""  # what compinit defines on a terminal
    script.write_text(f"{stub}{text}\n{asking}\n", encoding="utf-8")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setenv("PYTHONPATH", str(Path(planner.__file__).parents[1]))
    monkeypatch.setenv("HOME", str(tmp_path))
    done = subprocess.run([program, str(script)], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["F,E100"], done.stderr
