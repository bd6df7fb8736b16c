"""Results as annotations of a GitHub workflow, and its summary in Markdown.

GitHub shows ten annotations of each severity and drops the rest without a word: they come worst
first, and what is beyond is counted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Severity
from planner.report.pipeline import pipeline_path
from planner.report.text import (
    caveat,
    finding_message,
    given_text,
    headline,
    label,
    not_checked,
    printable,
    tally,
)
from planner.service.preflight import CheckResult, UnreadableMission

if TYPE_CHECKING:
    from pathlib import Path

    from planner.findings import Finding
Results = Sequence[CheckResult | UnreadableMission]
_ESCAPES = str.maketrans(
    {character: f"\\{character}" for character in "\\`*_[]<>|#~"} | {"&": "&amp;"}
)


def escaped(text: str) -> str:
    """Return the text with every sign that Markdown or HTML would take for its own escaped."""
    return text.translate(_ESCAPES)


_COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}
_MOST_OF_A_SEVERITY = 10
_MOST_ROWS = 500
"""A summary of more than 1 MiB is refused whole."""


def check_github(results: Results, *, folder: Path) -> str:
    """Return the findings of a call as workflow commands, worst first, and a tally.

    Paths are from the folder the call runs in.
    """
    lines = []
    shown: Counter[Severity] = Counter()
    for path, finding in _worst_first(results, folder=folder):
        shown[finding.severity] += 1
        if shown[finding.severity] <= _MOST_OF_A_SEVERITY:
            lines.append(_command(finding, path=path))
    more = sum(shown.values()) - len(lines)
    lines.append(f"{tally(results)}{caveat(results)}")
    if more:
        lines.append(f"{quantity.count(more, 'more finding')}, without annotation")
    for path, needs, rules in _not_checked(results, folder=folder):
        lines.append(f"not checked in {printable(path)} (needs {needs}): {rules}")
    return "\n".join(lines) + "\n"


def github_summary(results: Results, *, folder: Path) -> str:
    """Return a call as Markdown: a table of the missions, and one of what was found."""
    lines = [
        f"### mavjoule: {tally(results)}",
        "",
        "| verdict | mission | flight | vehicle, battery, wind |",
        "|---|---|---|---|",
    ]
    for result in results[:_MOST_ROWS]:
        path = pipeline_path(result.file, folder=folder)
        verdict = f"{result.verdict_text}{caveat([result])}"
        given = given_text(result) if isinstance(result, CheckResult) else ""
        lines.append(_row(verdict, path, headline(result), given))
    lines += _more(len(results))
    found = _worst_first(results, folder=folder)
    if found:
        lines += ["", "| severity | where | code | finding |", "|---|---|---|---|"]
    for path, finding in found[:_MOST_ROWS]:
        where = path if finding.place is None else f"{path}:{finding.place.line}"
        lines.append(_row(finding.severity.label, where, label(finding), finding_message(finding)))
    lines += _more(len(found))
    if left := _not_checked(results, folder=folder):
        lines += ["", "| not checked in | needs | rules |", "|---|---|---|"]
    lines += [_row(*cells) for cells in left[:_MOST_ROWS]]
    lines += _more(len(left))
    return "\n".join(lines) + "\n\n"


def _not_checked(results: Results, *, folder: Path) -> list[tuple[str, str, str]]:
    """Return for each mission what is missing, and the rules that were not checked without it."""
    return [
        (pipeline_path(result.file, folder=folder), needs, rules)
        for result in results
        for needs, rules in not_checked(result.checked)
    ]


def _worst_first(results: Results, *, folder: Path) -> list[tuple[str, Finding]]:
    found = [
        (pipeline_path(result.file, folder=folder), finding)
        for result in results
        for finding in result.findings
    ]
    return sorted(found, key=lambda pair: -pair[1].severity)


def _command(finding: Finding, *, path: str) -> str:
    properties = {"title": f"mavjoule {label(finding)}", "file": printable(path)}
    if finding.place is not None:
        properties |= {"line": str(finding.place.line), "col": str(finding.place.column)}
    listed = ",".join(f"{name}={_property(text)}" for name, text in properties.items())
    fix = f"\nfix: {printable(finding.fix)}" if finding.fix else ""
    text = _data(f"{finding_message(finding)}{fix}")
    return f"::{_COMMANDS[finding.severity]} {listed}::{text}"


def _data(text: str) -> str:
    # The percent sign first, or it would escape the escapes.
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


def _row(*cells: str) -> str:
    return "| " + " | ".join(escaped(printable(cell)) for cell in cells) + " |"


def _more(number: int) -> list[str]:
    return ["", f"{number - _MOST_ROWS} more"] if number > _MOST_ROWS else []
