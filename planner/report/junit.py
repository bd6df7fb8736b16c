"""Results as JUnit XML, which servers that run tests show: a suite per mission.

The first case of a suite is the verdict, so that a mission without findings shows as passed; then
a case per finding, failed from the severity on that makes a no-go.  A rule that was not checked is
skipped, with what it needs; one that found nothing has no case: it may not have applied, and would
look passed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from planner.report.pipeline import pipeline_path
from planner.report.text import (
    caveat,
    checked_text,
    finding_message,
    headline,
    label,
    left_unchecked,
    printable,
)
from planner.service.preflight import CheckResult

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.findings import Finding
    from planner.service.preflight import UnreadableMission

_COUNTED = {"tests": "testcase", "failures": "failure", "errors": "error", "skipped": "skipped"}
"""The elements that an attribute counts."""


def check_junit(results: Sequence[CheckResult | UnreadableMission], *, folder: Path) -> str:
    """Return all missions of a call as one document; paths are from the folder it runs in."""
    suites = ET.Element("testsuites", name="mavjoule")
    for result in results:
        suites.append(_suite(result, path=printable(pipeline_path(result.file, folder=folder))))
    _count(suites, "tests", "failures", "errors")
    ET.indent(suites)
    text = ET.tostring(suites, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _suite(result: CheckResult | UnreadableMission, *, path: str) -> ET.Element:
    suite = ET.Element("testsuite", name=path)
    verdict = ET.SubElement(suite, "testcase", classname=path, name="verdict", file=path)
    if result.verdict != "go":
        kind = result.verdict_text.lower().replace(" ", "-")
        ET.SubElement(verdict, "failure", type=kind, message=headline(result))
    for finding in (*result.findings, *result.suppressed):
        case = ET.SubElement(suite, "testcase", classname=path, name=_name(finding), file=path)
        if finding.place is not None:
            case.set("line", str(finding.place.line))
        _judge(case, finding, result)
    for entry in left_unchecked(result.checked):
        name = f"{entry.code} {entry.name} not checked"
        case = ET.SubElement(suite, "testcase", classname=path, name=name, file=path)
        ET.SubElement(case, "skipped", message=f"not checked: needs {entry.needs}")
    said_last = f"{result.verdict_text}{caveat([result])}: {headline(result)}"
    if checked := checked_text(result.checked):
        said_last += f"; {checked}"
    ET.SubElement(suite, "system-out").text = said_last
    _count(suite, "tests", "failures", "errors", "skipped")
    return suite


def _judge(case: ET.Element, finding: Finding, result: CheckResult | UnreadableMission) -> None:
    message = printable(finding_message(finding))
    if finding.suppression:
        ET.SubElement(case, "skipped", message=printable(f"{finding.suppression}: {message}"))
    elif not isinstance(result, CheckResult):
        broken = ET.SubElement(case, "error", type=finding.code, message=message)
        broken.text = printable(finding.fix)
    elif finding.severity >= result.setup.fail_on:
        failure = ET.SubElement(case, "failure", type=finding.code, message=message)
        failure.text = printable(finding.fix)
    else:
        ET.SubElement(case, "system-out").text = f"{finding.severity.label}: {message}"


def _name(finding: Finding) -> str:
    return label(finding) if finding.item is None else f"{label(finding)} item {finding.item}"


def _count(element: ET.Element, *attributes: str) -> None:
    for attribute in attributes:
        element.set(attribute, str(sum(1 for _ in element.iter(_COUNTED[attribute]))))
