"""How often each rule fired."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from planner.findings import Finding, Severity
from planner.report.json import check_json
from planner.report.text import Medium, count_codes, statistics_lines, statistics_text
from planner.values import replace

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult, UnreadableMission


def _finding(code: str, severity: Severity) -> Finding:
    return Finding(code=code, name=f"name-of-{code}", severity=severity, message="so it is")


def _results(flown: CheckResult) -> list[CheckResult]:
    often = _finding("A1", Severity.WARNING)
    seldom = _finding("A2", Severity.WARNING)
    note = _finding("B1", Severity.INFO)
    grave = _finding("C1", Severity.ERROR)
    return [
        replace(flown, findings=(often, often, note, note, note), suppressed=(grave,)),
        replace(flown, findings=(often, seldom, note), suppressed=()),
    ]


def test_codes_are_counted_worst_first_then_most(flown: CheckResult) -> None:
    counts = count_codes(_results(flown))
    assert [(one.code, one.count, one.suppressed, one.missions) for one in counts] == [
        ("C1", 0, 1, 1),
        ("A1", 3, 0, 2),
        ("A2", 1, 0, 1),
        ("B1", 4, 0, 2),
    ]


def test_a_rule_of_two_severities_is_counted_twice(flown: CheckResult) -> None:
    both = (_finding("A1", Severity.ERROR), _finding("A1", Severity.WARNING))
    counts = count_codes([replace(flown, findings=both)])
    assert [(one.severity, one.count) for one in counts] == [
        (Severity.ERROR, 1),
        (Severity.WARNING, 1),
    ]


def test_counts_stand_aligned_under_their_heads(flown: CheckResult) -> None:
    assert statistics_lines(count_codes(_results(flown))) == [
        "count  not reported  missions  code  severity  name",
        "    0             1         1  C1    error     name-of-C1",
        "    3             0         2  A1    warning   name-of-A1",
        "    1             0         1  A2    warning   name-of-A2",
        "    4             0         2  B1    info      name-of-B1",
    ]


def test_where_nothing_was_found_that_is_said(flown: CheckResult) -> None:
    assert statistics_lines(count_codes([replace(flown, findings=())])) == ["Nothing was found."]


def test_the_text_keeps_the_verdict_of_every_mission(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    lines = statistics_text([*_results(flown), unreadable], medium=Medium()).splitlines()
    assert lines[0] == "3 missions: 2 GO, 0 NO-GO, 1 NOT CHECKED"
    assert lines[1] == "  NOT CHECKED  broken.plan: X901 broken.plan:3:7: this is not JSON"
    assert lines[2].startswith("  GO           site.plan (1 error suppressed): ")
    assert [line.split()[3] for line in lines[6:]] == ["X901", "C1", "A1", "A2", "B1"]


def test_json_has_the_counts_where_they_are_asked_for(flown: CheckResult) -> None:
    results = _results(flown)
    document = json.loads(check_json(results, version="1", with_statistics=True))
    assert document["statistics"][1] == {
        "code": "A1",
        "name": "name-of-A1",
        "severity": "warning",
        "count": 3,
        "suppressed": 0,
        "missions": 2,
    }
    assert "statistics" not in json.loads(check_json(results, version="1"))
