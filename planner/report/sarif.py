"""Results as SARIF 2.1.0, which code scanning and editors read.

Every finding names its file and, where it is known, line and column; one that is not reported is
there too, as suppressed.
"""

from __future__ import annotations

import os
from pathlib import PurePath
from typing import TYPE_CHECKING
from urllib.parse import quote

from planner.findings import Severity
from planner.report.github import escaped
from planner.report.json import checks_document, figures, json_text, stretch_document
from planner.report.pipeline import fingerprints, pipeline_path
from planner.report.rule_text import explanation
from planner.report.text import finding_message, left_unchecked, printable
from planner.service.preflight import CheckResult

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from planner.errors import ExitCode
    from planner.findings import Finding, Rule
    from planner.report.json import Document
    from planner.service.preflight import UnreadableMission

_SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}


def check_sarif(
    results: Sequence[CheckResult | UnreadableMission],
    *,
    rules: Mapping[str, Rule],
    version: str,
    exit_code: ExitCode,
    folder: Path,
    left_out: Sequence[str] = (),
) -> str:
    """Return all missions of a call, which ends in an exit code, as one SARIF log of one run.

    ``rules`` is the catalogue by code; paths are from the folder the call runs in; ``left_out`` are files of
    folders that are no missions.
    """
    indices = {code: index for index, code in enumerate(rules)}
    driver = {
        "name": "mavjoule",
        "version": version,
        "semanticVersion": version,
        "rules": [_rule(rule) for rule in rules.values()],
    }
    invocation: Document = {
        "executionSuccessful": all(isinstance(result, CheckResult) for result in results),
        "exitCode": int(exit_code),
        "exitCodeDescription": exit_code.name.lower().replace("_", "-"),
        "toolConfigurationNotifications": [
            one for result in results for one in _notifications(result, indices, folder=folder)
        ],
    }
    if left_out:
        invocation["toolExecutionNotifications"] = [
            _left_out(path, folder=folder) for path in left_out
        ]
    run = {
        "tool": {"driver": driver},
        "invocations": [invocation],
        "columnKind": "unicodeCodePoints",
        "results": [
            finding for result in results for finding in _results(result, indices, folder=folder)
        ],
        "properties": {"missions": [_mission(result, folder=folder) for result in results]},
    }
    return json_text({"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2)


def _rule(rule: Rule) -> Document:
    parts = explanation(rule)
    return {
        "id": rule.code,
        "name": rule.name,
        "shortDescription": {"text": rule.summary},
        "fullDescription": {"text": rule.why},
        "help": {
            "text": "\n".join(f"{title}: {text}" for title, text in parts),
            "markdown": "\n\n".join(f"**{title}:** {escaped(text)}" for title, text in parts),
        },
        "defaultConfiguration": {"level": _LEVELS[rule.severity]},
    }


def _results(
    result: CheckResult | UnreadableMission, indices: Mapping[str, int], *, folder: Path
) -> list[Document]:
    findings = (*result.findings, *result.suppressed)
    path = pipeline_path(result.file, folder=folder)
    marks = fingerprints(findings, path=path)
    return [
        _result(finding, mark, indices[finding.code], uri=_uri(path))
        for finding, mark in zip(findings, marks, strict=True)
    ]


def _left_out(path: str, *, folder: Path) -> Document:
    return {
        "descriptor": {"id": "left-out"},
        "level": "note",
        "message": {"text": f"{printable(path)}: no mission, not checked"},
        "locations": [
            {
                "physicalLocation": {
                    "artifactLocation": {"uri": _uri(pipeline_path(path, folder=folder))}
                }
            }
        ],
    }


def _notifications(
    result: CheckResult | UnreadableMission, indices: Mapping[str, int], *, folder: Path
) -> list[Document]:
    """Return a notification for each rule that was not checked, with what it needs."""
    uri = _uri(pipeline_path(result.file, folder=folder))
    return [
        {
            "descriptor": {"id": "not-checked"},
            "associatedRule": {"id": entry.code, "index": indices[entry.code]},
            "level": "warning",
            "message": {"text": f"{entry.code} {entry.name} not checked: needs {entry.needs}"},
            "locations": [{"physicalLocation": {"artifactLocation": {"uri": uri}}}],
        }
        for entry in left_unchecked(result.checked)
    ]


def _result(finding: Finding, mark: str, rule_index: int, *, uri: str) -> Document:
    location: Document = {"artifactLocation": {"uri": uri}}
    fix = f". Fix: {printable(finding.fix)}" if finding.fix else ""
    if finding.place is not None:
        location["region"] = {"startLine": finding.place.line, "startColumn": finding.place.column}
    document: Document = {
        "ruleId": finding.code,
        "ruleIndex": rule_index,
        "level": _LEVELS[finding.severity],
        "message": {"text": f"{finding_message(finding)}{fix}"},
        "locations": [{"physicalLocation": location}],
        "partialFingerprints": {"mavjoule/v1": mark},
        "properties": {"item": finding.item} | stretch_document(finding),
    }
    if finding.suppression:
        justification = printable(finding.suppression)
        document["suppressions"] = [{"kind": "external", "justification": justification}]
    return document


def _mission(result: CheckResult | UnreadableMission, *, folder: Path) -> Document:
    return {
        "file": _uri(pipeline_path(result.file, folder=folder)),
        "verdict": result.verdict,
        **figures(result),
        "checks": checks_document(result.checked),
    }


def _uri(path: str) -> str:
    """Return a path as a URI: relative, or of a file where the path is absolute."""
    try:
        name = os.fsencode(path)
    except UnicodeEncodeError:  # a lone surrogate, which no file system has
        name = path.encode("utf-8", "replace")
    if PurePath(path).is_absolute():
        return PurePath(os.fsdecode(name)).as_uri()
    return quote(name)
