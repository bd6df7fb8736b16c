"""What a check writes besides its report: the flight over time, pictures, a baseline."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.cli.output import narrate, write_data
from planner.errors import UsageError
from planner.service import UnreadableMission

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.cli.settings import ReportRequest
    from planner.service import CheckResult

    Results = Sequence[CheckResult | UnreadableMission]


def refuse_attachments(report: ReportRequest, *, missions: int) -> None:
    """Raise ``UsageError`` where what is asked for cannot be written, before anything is checked."""
    for option in ("trace", "plots"):
        if getattr(report, option) is not None and missions > 1:
            msg = f"--{option} takes a single mission: check them one by one"
            raise UsageError(msg)
    if report.output is not None and report.output == report.trace:
        msg = "--output and --trace name the same file: give them one each"
        raise UsageError(msg)
    if report.plots is not None:
        from planner.plots.library import load_altair, load_converter

        load_altair()
        load_converter()


def write_attachments(results: Results, report: ReportRequest) -> None:
    """Write the files that are asked for beside the report.

    Raises
    ------
    OutputError
        If one cannot be written.
    """
    if report.trace is not None:
        _write_trace(results[0], report.trace)
    if report.plots is not None:
        _draw(results[0], report.plots)


def _write_trace(result: CheckResult | UnreadableMission, path: Path) -> None:
    from planner.report.columns_csv import columns_csv

    trace = None if isinstance(result, UnreadableMission) else result.trace
    if trace is None:
        narrate(f"nothing is flown: {path} is not written")
    else:
        write_data(columns_csv(trace.columns()), output=path)


def _draw(result: CheckResult | UnreadableMission, folder: Path) -> None:
    if isinstance(result, UnreadableMission) or result.case is None:
        narrate(f"nothing is flown: nothing is drawn into {folder}")
        return
    from planner.plots import mission_figures, write_figures

    written = write_figures(mission_figures(result), folder)
    narrate(f"{len(written)} pictures drawn into {folder}")


def attach_baseline(results: Results, path: Path) -> None:
    """Write what was found, for later calls not to report it."""
    from planner import numbers
    from planner.checks.baseline import write_baseline

    for result in results:
        if isinstance(result, UnreadableMission):
            narrate(f"{result.file} cannot be read: {path} is not written")
            return
    found = [(result.file, finding) for result in results for finding in result.findings]
    written, refused = write_baseline(path, found)
    text = f"{numbers.count(written, 'finding')} written to {path}"
    if refused:
        text += f"; {numbers.count(refused, 'error')} of energy left out: mend the mission"
    narrate(text)
