"""Results as GitLab's code quality report."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING

from planner.findings import Severity
from planner.report.pipeline import fingerprints, pipeline_path
from planner.report.text import finding_message, label, not_checked, well_formed

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.service.preflight import CheckResult, UnreadableMission

_SEVERITIES = {Severity.ERROR: "blocker", Severity.WARNING: "major", Severity.INFO: "info"}


def check_gitlab(results: Sequence[CheckResult | UnreadableMission], *, folder: Path) -> str:
    """Return the findings of a call as a list of issues; paths are from the folder it runs in.

    A place is required: a finding about the whole file is put at its first line.
    """
    issues: list[dict[str, object]] = []
    for result in results:
        path = pipeline_path(result.file, folder=folder)
        marks = fingerprints(result.findings, path=path)
        for finding, mark in zip(result.findings, marks, strict=True):
            line = 1 if finding.place is None else finding.place.line
            issues.append(
                {
                    "description": well_formed(f"{label(finding)}: {finding_message(finding)}"),
                    "check_name": finding.code,
                    "fingerprint": mark,
                    "severity": _SEVERITIES[finding.severity],
                    "location": {"path": well_formed(path), "lines": {"begin": line}},
                }
            )
        issues += _not_checked(result, path=path)
    return json.dumps(issues, ensure_ascii=True, indent=2) + "\n"


def _not_checked(result: CheckResult | UnreadableMission, *, path: str) -> list[dict[str, object]]:
    """Return an issue for each thing that is missing for rules that were not checked."""
    return [
        {
            "description": well_formed(f"not checked (needs {needs}): {rules}"),
            "check_name": "not-checked",
            "fingerprint": hashlib.sha256(f"{path}:{needs}".encode(errors="replace")).hexdigest()[
                :32
            ],
            "severity": "minor",
            "location": {"path": well_formed(path), "lines": {"begin": 1}},
        }
        for needs, rules in not_checked(result.checked)
    ]
