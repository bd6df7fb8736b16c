"""``mavjoule help``: the long texts, with what is declared in them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from planner import catalogue
from planner.cli import check
from planner.cli.main import main
from planner.report.topics import topic_names
from planner.setup import settings

if TYPE_CHECKING:
    from collections.abc import Callable

    Shown = Callable[..., str]


@pytest.fixture
def shown(capsys: pytest.CaptureFixture[str]) -> Shown:
    """What help prints of a topic."""

    def ask(*topic: str) -> str:
        assert main(["help", *topic]) == 0
        return capsys.readouterr().out

    return ask


def test_the_topics_are_listed_each_with_its_title(shown: Shown) -> None:
    head, *lines = shown().splitlines()
    assert head == "Topics of mavjoule help:"
    assert [line.split()[0] for line in lines] == list(topic_names())
    assert all(len(line.split()) > 1 for line in lines)


@pytest.mark.parametrize("topic", topic_names())
def test_a_topic_is_read_without_signs_of_its_markup(shown: Shown, topic: str) -> None:
    text = shown(topic)
    assert len(text.splitlines()) > 5
    assert not {"{settings}", "{rules}"} & set(text.split())
    prose = [line for line in text.splitlines() if not line.startswith("    ")]
    assert not [line for line in prose if "```" in line or line.startswith(("#", "|", "<!--"))]
    assert max(map(len, prose)) <= 100


def test_every_setting_stands_in_its_topic(shown: Shown) -> None:
    text = " ".join(shown("settings").split())
    for key, setting in settings().items():
        assert f"- {key}, {setting.option}" in text
        assert setting.help in text
        assert ("in a file: " if setting.in_file else "typed only") in text


def test_every_rule_stands_in_its_topic(shown: Shown) -> None:
    words = shown("rules").split()
    assert catalogue.rules().keys() <= set(words)


def test_a_command_is_a_topic_too(shown: Shown, capsys: pytest.CaptureFixture[str]) -> None:
    text = shown("verify")
    assert main(["verify", "--help"]) == 0
    assert text == capsys.readouterr().out


def test_a_slip_is_answered_by_what_is_near(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["help", "setings"]) == 2
    assert "did you mean settings?" in capsys.readouterr().err


def test_the_help_of_a_check_begins_with_what_matters_and_leaves_no_option_out(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["check", "--help"]) == 0
    text = capsys.readouterr().out
    first = text.partition("Most used:")[2].partition("\n\n")[0]
    shown = re.findall(r"^  (--[a-z-]+)", first, re.MULTILINE)
    assert shown[:3] == ["--vehicle", "--battery", "--charge"]
    assert len(shown) == 10
    known = {one.opts[-1] for one in check.command.params if one.opts[-1].startswith("--")}
    assert known <= set(re.findall(r"--[a-z-]+", text))


def test_a_command_that_does_not_exist_is_answered_by_what_is_near(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["chek", "site.plan"]) == 2
    assert capsys.readouterr().err == (
        "mavjoule: no command 'chek'; did you mean check? (see mavjoule --help)\n"
    )


@pytest.mark.parametrize("command", [["models"], ["rules"], ["explain", "E101"], ["check", "x"]])
def test_what_is_printed_goes_to_a_file_where_one_is_named(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    main([*command, "-o", "there.txt"])
    assert capsys.readouterr().out == ""
    assert len(Path("there.txt").read_text(encoding="utf-8").splitlines()) > 3


def test_a_topic_is_written_to_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "names.txt"
    assert main(["help", "names"]) == 0
    printed = capsys.readouterr().out
    assert main(["help", "names", "-o", str(file)]) == 0
    assert capsys.readouterr().out == ""
    assert file.read_text(encoding="utf-8") == printed
