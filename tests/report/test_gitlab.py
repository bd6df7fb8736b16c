"""The code quality report as GitLab reads it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from planner.findings import Severity
from planner.report.gitlab import check_gitlab
from planner.values import replace

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult, UnreadableMission

FOLDER = Path("/repository")


def test_an_issue_has_what_gitlab_requires(flown: CheckResult) -> None:
    warning, note = json.loads(check_gitlab([flown], folder=FOLDER))
    assert warning.pop("fingerprint") != note.pop("fingerprint")
    assert warning == {
        "description": "E105 model-outside-envelope: item 2: 12.0 m/s is commanded, "
        "the model was identified up to 10.0 m/s",
        "check_name": "E105",
        "severity": "major",
        "location": {"path": "site.plan", "lines": {"begin": 41}},
    }
    assert note["severity"] == "info"
    assert note["location"]["lines"] == {"begin": 1}, "a line is required"


def test_every_severity_is_one_of_gitlab_s(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    grave = replace(flown.findings[0], severity=Severity.ERROR)
    issues = json.loads(
        check_gitlab([replace(flown, findings=(grave,)), unreadable], folder=FOLDER)
    )
    assert [issue["severity"] for issue in issues] == ["blocker", "blocker"]


def test_no_two_issues_share_a_fingerprint(flown: CheckResult) -> None:
    twice = replace(flown, findings=flown.findings[:1] * 2)
    other = replace(twice, file="other.plan")
    issues = json.loads(check_gitlab([twice, other], folder=FOLDER))
    assert len({issue["fingerprint"] for issue in issues}) == 4


def test_what_is_not_reported_is_no_issue(flown: CheckResult) -> None:
    blind = replace(flown, findings=(), suppressed=flown.findings)
    assert json.loads(check_gitlab([blind], folder=FOLDER)) == []


def test_a_path_counts_from_the_top_of_the_repository(flown: CheckResult) -> None:
    here = replace(flown, file="/repository/deep/site.plan")
    [first, _] = json.loads(check_gitlab([here], folder=FOLDER))
    assert first["location"]["path"] == "deep/site.plan"


def test_a_file_name_that_is_no_text_still_makes_valid_json(flown: CheckResult) -> None:
    text = check_gitlab([replace(flown, file="caf\udce9.plan")], folder=FOLDER)
    assert text.isascii()
    assert json.loads(text)[0]["location"]["path"] == "caf\N{REPLACEMENT CHARACTER}.plan"
