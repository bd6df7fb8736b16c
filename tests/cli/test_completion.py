"""What a shell offers after the tabulator."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

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
    with pytest.raises(SystemExit) as ended:
        main([])
    assert ended.value.code == 0
    assert f"_MAVJOULE_COMPLETE={shell}_complete" in capsys.readouterr().out
