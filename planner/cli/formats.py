"""The formats of a report; each is imported where it is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planner import __version__
from planner.cli.output import standard_medium
from planner.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.cli.requests import ReportRequest
    from planner.errors import ExitCode
    from planner.service import CheckResult, UnreadableMission

    Results = Sequence[CheckResult | UnreadableMission]

_COUNTING_FORMATS = ("text", "json")


def refuse_statistics(report: ReportRequest) -> None:
    """Raise ``UsageError`` where a count is asked for and the format has no room for it."""
    if report.statistics and report.format not in _COUNTING_FORMATS:
        msg = f"--statistics goes with --format {' or '.join(_COUNTING_FORMATS)}"
        raise UsageError(msg)


def rendered(results: Results, report: ReportRequest, *, exit_code: ExitCode) -> str:
    """Return the report of a call in the format asked for."""
    match report.format:
        case "text":
            return _text(results, report)
        case "json" | "json-lines":
            return _json(results, report)
        case "sarif":
            from planner import catalogue
            from planner.report.sarif import check_sarif

            return check_sarif(
                results,
                rules=catalogue.rules(),
                version=__version__,
                exit_code=exit_code,
                folder=Path.cwd(),
            )
        case "junit":
            from planner.report.junit import check_junit

            return check_junit(results, folder=Path.cwd())
        case "github":
            from planner.report.github import check_github

            return check_github(results, folder=Path.cwd())
        case _:  # gitlab, the last of FORMATS
            from planner.report.gitlab import check_gitlab

            return check_gitlab(results, folder=Path.cwd())


def _text(results: Results, report: ReportRequest) -> str:
    from planner.report.text import check_text, statistics_text

    medium = standard_medium(report.output)
    if report.statistics:
        return statistics_text(results, medium=medium)
    return check_text(results, medium=medium)


def _json(results: Results, report: ReportRequest) -> str:
    from planner.report.json import (
        check_json,
        check_json_lines,
    )

    if report.format == "json-lines":
        return check_json_lines(results, version=__version__)
    return check_json(results, version=__version__, with_statistics=report.statistics)
