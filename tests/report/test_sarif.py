"""SARIF against the official schema, and against what its readers need."""

from __future__ import annotations

import json
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import pytest
from sarif_kit.validate import validation_errors

from planner import catalogue
from planner.errors import ExitCode
from planner.findings import FlightStretch, Place, Severity
from planner.report.sarif import check_sarif
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.service.preflight import CheckResult, UnreadableMission

FOLDER = Path("/repository")


def _log(
    results: Sequence[CheckResult | UnreadableMission], exit_code: ExitCode = ExitCode.GO
) -> dict[str, Any]:
    text = check_sarif(
        results, rules=catalogue.rules(), version="1.2.3", exit_code=exit_code, folder=FOLDER
    )
    log = json.loads(text)
    assert isinstance(log, dict)
    return log


def _results(log: dict[str, Any]) -> list[dict[str, Any]]:
    [run] = log["runs"]
    results = run["results"]
    assert isinstance(results, list)
    return results


@pytest.fixture
def blind(flown: CheckResult) -> CheckResult:
    """The flight with its warning not reported."""
    warning, note = flown.findings
    return replace(flown, findings=(note,), suppressed=(replace(warning, suppression="asked"),))


def test_every_kind_of_result_is_valid_by_the_official_schema(
    flown: CheckResult, blind: CheckResult, unreadable: UnreadableMission
) -> None:
    grounded = replace(flown, verdict="no-go", battery=None, return_plan=None)
    assert validation_errors(_log([flown, blind, grounded, unreadable], ExitCode.UNUSABLE)) == []
    assert validation_errors(_log([])) == []


def test_the_schema_sees_what_it_guards_against(flown: CheckResult) -> None:
    log = _log([flown])
    _results(log)[0]["level"] = "bad"
    assert validation_errors(log) != []


def test_a_result_points_to_its_rule_and_to_its_place(flown: CheckResult) -> None:
    log = _log([flown])
    warning, note = _results(log)
    driver = log["runs"][0]["tool"]["driver"]
    assert driver["version"] == driver["semanticVersion"] == "1.2.3"
    rules = driver["rules"]
    assert [rule["id"] for rule in rules] == list(catalogue.rules())
    assert rules[warning["ruleIndex"]]["id"] == warning["ruleId"] == "E105"
    assert warning["level"] == "warning"
    assert warning["locations"][0]["physicalLocation"] == {
        "artifactLocation": {"uri": "site.plan"},
        "region": {"startLine": 41, "startColumn": 9},
    }
    assert note["level"] == "note"
    assert "region" not in note["locations"][0]["physicalLocation"], "no place is invented"


def test_a_rule_carries_its_severity_and_its_explanation() -> None:
    rules = _log([])["runs"][0]["tool"]["driver"]["rules"]
    by_code = {rule["id"]: rule for rule in rules}
    levels = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
    for code, rule in catalogue.rules().items():
        told = by_code[code]
        assert told["name"] == rule.name
        assert told["defaultConfiguration"]["level"] == levels[rule.severity]
        assert told["shortDescription"]["text"] == rule.summary
        assert rule.fix in told["help"]["text"]
        assert "**Turn off:**" in told["help"]["markdown"]


def test_what_is_not_reported_is_there_as_suppressed(
    flown: CheckResult, blind: CheckResult
) -> None:
    assert not any("suppressions" in result for result in _results(_log([flown])))
    note, warning = _results(_log([blind]))
    assert "suppressions" not in note
    assert warning["suppressions"] == [{"kind": "external", "justification": "asked"}]


@pytest.mark.parametrize(
    ("file", "path"),
    [
        ("/repository/deep/site 1.plan", "deep/site 1.plan"),
        ("a:b%.plan", "a:b%.plan"),
        ("caf\u00e9.plan", "caf\u00e9.plan"),
        ("./site.plan", "site.plan"),
    ],
)
def test_a_path_is_a_relative_uri(flown: CheckResult, file: str, path: str) -> None:
    log = _log([replace(flown, file=file)])
    uri = _results(log)[0]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert uri.isascii()
    assert ":" not in uri, "it would look like a scheme"
    assert unquote(uri) == path
    assert log["runs"][0]["properties"]["missions"][0]["file"] == uri
    assert validation_errors(log) == []


def test_a_path_elsewhere_is_the_uri_of_a_file(flown: CheckResult) -> None:
    file = "/elsewhere/site 1.plan"
    [first, *_] = _results(_log([replace(flown, file=file)]))
    uri = first["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert uri == PurePosixPath(file).as_uri() == "file:///elsewhere/site%201.plan"


def test_the_call_and_its_verdicts_are_told(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    [run] = _log([flown], ExitCode.GO)["runs"]
    assert run["invocations"][0]["executionSuccessful"]
    assert run["invocations"][0]["exitCode"] == 0
    [mission] = run["properties"]["missions"]
    assert (mission["verdict"], mission["totals"]["energy_wh"]) == ("go", 24.06)
    assert mission["battery"]["margin_wh"] == 69.3 - 15.4 - 24.06
    [run] = _log([flown, unreadable], ExitCode.UNUSABLE)["runs"]
    assert not run["invocations"][0]["executionSuccessful"]
    assert run["invocations"][0]["exitCode"] == 2
    assert [one["verdict"] for one in run["properties"]["missions"]] == ["go", None]


def test_a_fingerprint_stays_while_numbers_and_lines_change(flown: CheckResult) -> None:
    warning, note = flown.findings
    later = replace(
        warning, message=warning.message.replace("12.0", "13.5"), place=Place(line=99, column=1)
    )
    before = [one["partialFingerprints"] for one in _results(_log([flown]))]
    after = [
        one["partialFingerprints"]
        for one in _results(_log([replace(flown, findings=(later, note))]))
    ]
    assert before == after
    assert before[0] != before[1]


def test_a_file_cannot_put_signs_of_control_into_the_log(flown: CheckResult) -> None:
    evil = replace(flown.findings[0], message="\x1b[2J\udce9", fix="\x07", suppression="\x00")
    log = _log([replace(flown, file="caf\udce9.plan", findings=(), suppressed=(evil,))])
    text = json.dumps(log, ensure_ascii=False)
    assert validation_errors(log) == []
    assert all(character.isprintable() for character in text)


def test_a_stretch_over_ground_is_among_the_properties(flown: CheckResult) -> None:
    warning, note = flown.findings
    stretch = FlightStretch(start_deg=(47.0, 8.0), end_deg=(47.001, 8.0), distance_m=12.5)
    found = replace(flown, findings=(replace(warning, stretch=stretch), note))
    first, second = _results(_log([found]))
    assert first["properties"]["stretch"] == {
        "start_deg": [47.0, 8.0],
        "end_deg": [47.001, 8.0],
        "distance_m": 12.5,
        "parts_deg": [[[47.0, 8.0], [47.001, 8.0]]],
    }
    assert "stretch" not in second["properties"]
