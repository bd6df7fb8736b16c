"""Workflow commands and the summary as GitHub reads them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from planner.findings import Finding, Place, Severity
from planner.report.github import check_github, github_summary
from planner.values import replace

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult, UnreadableMission

FOLDER = Path("/repository")
COMMAND = re.compile(r"::(?P<kind>error|warning|notice) (?P<properties>[^:]*)::(?P<message>.*)")


def _unescaped(text: str) -> str:
    """Return what the runner of a workflow makes of an escaped property, in its own order."""
    for escape, sign in (("%0D", "\r"), ("%0A", "\n"), ("%3A", ":"), ("%2C", ","), ("%25", "%")):
        text = text.replace(escape, sign)
    return text


def _commands(text: str) -> list[tuple[str, dict[str, str], str]]:
    found = []
    for line in text.splitlines():
        if match := COMMAND.fullmatch(line):
            pairs = (pair.split("=", 1) for pair in match["properties"].split(","))
            properties = {name: _unescaped(value) for name, value in pairs}
            found.append((match["kind"], properties, _unescaped(match["message"])))
    return found


def _finding(severity: Severity, number: int) -> Finding:
    return Finding(code="Z1", name="made-up", severity=severity, message=f"number {number}")


def test_a_finding_is_a_command_with_its_place(flown: CheckResult) -> None:
    warning, note = flown.findings
    assert _commands(check_github([flown], folder=FOLDER)) == [
        (
            "warning",
            {
                "title": "mavjoule E105 model-outside-envelope",
                "file": "site.plan",
                "line": "41",
                "col": "9",
            },
            f"item 2: {warning.message}\nfix: {warning.fix}",
        ),
        (
            "notice",
            {"title": "mavjoule E107 cruise-power-assumed", "file": "site.plan"},
            f"{note.message}\nfix: {note.fix}",
        ),
    ]


def test_signs_that_steer_the_runner_are_escaped(flown: CheckResult) -> None:
    awkward = Finding(
        code="Z1",
        name="made-up",
        severity=Severity.ERROR,
        message="100 %, %0A is no line",
        place=Place(line=1, column=1),
    )
    name = "a,line=7: 100 %25::.plan"
    text = check_github([replace(flown, file=name, findings=(awkward,))], folder=FOLDER)
    [(_, properties, message)] = _commands(text)
    assert properties["file"] == name
    assert properties["line"] == "1"
    assert message == "100 %, %0A is no line"
    assert text.splitlines()[0] == (
        "::error title=mavjoule Z1 made-up,file=a%2Cline=7%3A 100 %2525%3A%3A.plan,line=1,col=1"
        "::100 %25, %250A is no line"
    )


def test_a_message_cannot_begin_a_command_of_its_own(flown: CheckResult) -> None:
    evil = replace(flown.findings[0], message="x\n::stop-commands::y\r\x1b[2J", fix="\n::debug::z")
    text = check_github([replace(flown, file="\n::error::q", findings=(evil,))], folder=FOLDER)
    assert len(text.splitlines()) == 2, "the finding and the tally"
    assert "\x1b" not in text
    assert not text.splitlines()[1].startswith("::")


def test_the_worst_of_all_missions_come_first(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    kinds = [kind for kind, _, _ in _commands(check_github([flown, unreadable], folder=FOLDER))]
    assert kinds == ["error", "warning", "notice"]


@pytest.mark.parametrize(
    ("number", "last"), [(10, None), (11, "1 more finding,"), (25, "15 more findings,")]
)
def test_ten_of_a_severity_are_shown_and_the_rest_is_counted(
    flown: CheckResult, number: int, last: str | None
) -> None:
    many = tuple(_finding(Severity.WARNING, one) for one in range(number))
    other = (_finding(Severity.ERROR, 0), _finding(Severity.INFO, 0))
    text = check_github([replace(flown, findings=many + other)], folder=FOLDER)
    kinds = [kind for kind, _, _ in _commands(text)]
    assert kinds == ["error", *["warning"] * 10, "notice"]
    if last is None:
        assert text.splitlines()[-1] == "1 mission: 1 GO, 0 NO-GO"
    else:
        assert text.splitlines()[-1].startswith(last)


def test_a_call_without_findings_says_so(flown: CheckResult) -> None:
    clean = replace(flown, findings=())
    assert check_github([clean], folder=FOLDER) == "1 mission: 1 GO, 0 NO-GO\n"
    blind = replace(clean, suppressed=(_finding(Severity.ERROR, 0),))
    assert check_github([blind], folder=FOLDER) == (
        "1 mission: 1 GO, 0 NO-GO (1 error suppressed)\n"
    )


def test_the_summary_has_a_row_per_mission_and_per_finding(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    lines = github_summary([flown, unreadable], folder=FOLDER).splitlines()
    assert lines[0] == "### mavjoule: 2 missions: 1 GO, 0 NO-GO, 1 NOT CHECKED"
    assert lines[4].startswith("| GO | site.plan | 11 min 32 s, 4.32 km, 24.1 Wh")
    assert lines[5] == "| NOT CHECKED | broken.plan | the mission cannot be checked |  |"
    assert lines[9].startswith("| error | broken.plan:3 | X901 file-unreadable |")
    assert [line.split(" | ")[0] for line in lines[9:12]] == ["| error", "| warning", "| info"]


def test_the_summary_shows_a_file_s_name_as_it_is(flown: CheckResult) -> None:
    name = "a|b_<img src=x>[c](d)`e`&.plan"
    row = github_summary([replace(flown, file=name)], folder=FOLDER).splitlines()[4]
    assert r"a\|b\_\<img src=x\>\[c\](d)\`e\`&amp;.plan" in row
    assert len(re.findall(r"(?<!\\)\|", row)) == 5, "four cells"


def test_a_long_summary_is_cut_and_says_so(flown: CheckResult) -> None:
    many = tuple(_finding(Severity.WARNING, one) for one in range(600))
    text = github_summary([replace(flown, findings=many)], folder=FOLDER)
    assert text.count("| warning |") == 500
    assert text.rstrip().endswith("\n100 more")
    assert "more" not in github_summary([flown], folder=FOLDER)
