"""JUnit XML as the servers that read it expect it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import pytest

from planner.findings import Severity
from planner.report.junit import check_junit
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.service.preflight import CheckResult, UnreadableMission

# What the schema of Jenkins allows: the children of each element, and its attributes.
CHILDREN = {
    "testsuites": {"testsuite"},
    "testsuite": {"properties", "testcase", "system-out", "system-err"},
    "testcase": {"skipped", "error", "failure", "system-out", "system-err"},
}
ATTRIBUTES = {
    "testsuites": {"name", "time", "tests", "failures", "disabled", "errors"},
    "testsuite": {"name", "tests", "failures", "errors", "time", "skipped", "file"},
    "testcase": {"name", "classname", "time", "file", "line"},
    "failure": {"type", "message"},
    "error": {"type", "message"},
    "skipped": {"type", "message"},
}


def _suites(results: Sequence[CheckResult | UnreadableMission]) -> list[ET.Element]:
    root = ET.fromstring(check_junit(results, folder=Path("/repository")))
    for element in root.iter():
        assert {child.tag for child in element} <= CHILDREN.get(element.tag, set())
        assert set(element.attrib) <= ATTRIBUTES.get(element.tag, set())
    for element in (root, *root):
        for attribute, tag in (("tests", "testcase"), ("failures", "failure"), ("errors", "error")):
            assert int(element.attrib[attribute]) == len(list(element.iter(tag)))
    for case in root.iter("testcase"):
        assert case.attrib["name"]
        assert case.attrib["classname"]
    return list(root)


def _outcomes(suite: ET.Element) -> dict[str, str]:
    return {
        case.attrib["name"]: next((child.tag for child in case if child.tag != "system-out"), "")
        for case in suite.iter("testcase")
    }


def test_a_go_is_a_passed_verdict_and_its_remarks_pass(flown: CheckResult) -> None:
    [suite] = _suites([flown])
    assert suite.attrib["name"] == "site.plan"
    assert _outcomes(suite) == {
        "verdict": "",
        "E105 model-outside-envelope item 2": "",
        "E107 cruise-power-assumed": "",
    }


@pytest.mark.parametrize(
    ("fail_on", "outcome"), [(Severity.WARNING, "failure"), (Severity.ERROR, "")]
)
def test_a_finding_fails_from_the_severity_on_that_makes_a_no_go(
    flown: CheckResult, fail_on: Severity, outcome: str
) -> None:
    [suite] = _suites([replace(flown, setup=replace(flown.setup, fail_on=fail_on))])
    assert _outcomes(suite)["E105 model-outside-envelope item 2"] == outcome
    assert _outcomes(suite)["E107 cruise-power-assumed"] == ""


def test_a_no_go_fails_its_verdict(flown: CheckResult) -> None:
    [suite] = _suites([replace(flown, verdict="no-go")])
    assert _outcomes(suite)["verdict"] == "failure"


def test_a_failure_tells_where_what_and_what_to_do(flown: CheckResult) -> None:
    warning = flown.findings[0]
    [suite] = _suites([replace(flown, setup=replace(flown.setup, fail_on=Severity.WARNING))])
    [case] = [case for case in suite.iter("testcase") if case.find("failure") is not None]
    assert (case.attrib["file"], case.attrib["line"]) == ("site.plan", "41")
    failure = case.find("failure")
    assert failure is not None
    assert failure.attrib == {"type": "E105", "message": f"item 2: {warning.message}"}
    assert failure.text == warning.fix


def test_what_is_not_reported_is_skipped_with_its_reason_and_counted(flown: CheckResult) -> None:
    warning, note = flown.findings
    blind = replace(flown, findings=(note,), suppressed=(replace(warning, suppression="asked"),))
    [suite] = _suites([blind])
    assert suite.attrib["skipped"] == "1"
    [skipped] = suite.iter("skipped")
    assert skipped.attrib["message"].startswith("asked: item 2: 12.0 m/s")
    totals = suite.find("system-out")
    assert totals is not None
    assert totals.text is not None
    assert totals.text.startswith("GO (1 warning suppressed): 11 min 32 s, 4.32 km, 24.1 Wh")


def test_a_file_that_cannot_be_read_is_an_error(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    good, bad = _suites([flown, unreadable])
    assert good.attrib["errors"] == "0"
    assert _outcomes(bad) == {"verdict": "failure", "X901 file-unreadable": "error"}


def test_signs_that_no_xml_may_hold_are_shown_as_escapes(flown: CheckResult) -> None:
    evil = replace(flown.findings[0], message="\x1b[2J \x00 \ufffe \udce9 <&\"'>", fix="\x08")
    [suite] = _suites([replace(flown, file="a\x01\udce9.plan", findings=(evil,))])
    assert suite.attrib["name"] == r"a\x01\udce9.plan"
    assert r"\x1b[2J \x00 \ufffe \udce9 <&" in check_junit(
        [replace(flown, findings=(evil,))], folder=Path("/")
    ).replace("&lt;", "<").replace("&amp;", "&")
