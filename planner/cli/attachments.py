"""What a check writes besides its report: the flight over time, pictures, a baseline."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.cli.output import narrate, write_data
from planner.errors import UsageError
from planner.service import UnreadableMission

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.cli.requests import ReportRequest
    from planner.service import CheckResult

    Results = Sequence[CheckResult | UnreadableMission]


def refuse_attachments(report: ReportRequest, *, missions: int) -> None:
    """Raise ``UsageError`` where what is asked for cannot be written, before anything is checked."""
    for option in ("trace", "plots"):
        if getattr(report, option) is not None and missions > 1:
            msg = f"--{option} takes a single mission: check them one by one"
            raise UsageError(msg)
    written: dict[Path, str] = {}
    for option in ("output", "trace", "report"):
        if (path := getattr(report, option)) is not None and written.setdefault(
            path, option
        ) != option:
            msg = f"--{written[path]} and --{option} name the same file: give them one each"
            raise UsageError(msg)
    if report.report is not None:
        from planner.report.html.page import refuse_without_libraries

        refuse_without_libraries()
    if report.plots is not None:
        from planner.report.plots.figures import (
            load_altair,
            load_converter,
        )

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
    if report.report is not None:
        write_page(results, report.report)
    if report.plots is not None:
        _draw(results[0], report.plots)


def _write_trace(result: CheckResult | UnreadableMission, path: Path) -> None:
    from planner.report.columns import columns_csv

    trace = None if isinstance(result, UnreadableMission) else result.trace
    if trace is None:
        narrate(f"nothing is flown: {path} is not written")
    else:
        write_data(columns_csv(trace.columns()), output=path)


def write_page(
    results: Results,
    path: Path,
    *,
    sections: Sequence[str] = (),
    title: str = "",
    names: Sequence[str] = (),
) -> None:
    """Write results as a page, with more sections after the overview, or in its place.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    from datetime import UTC, datetime

    from planner import __version__
    from planner.report.html.page import check_html

    made_at = datetime.now(UTC)
    sha256 = {result.file: _sha256(result.file) for result in results}
    page = check_html(
        results,
        version=__version__,
        made_at=made_at,
        sha256=sha256,
        sections=sections,
        title=title,
        names=names,
    )
    write_data(page, output=path)
    narrate(f"the page is in {path}")


def _sha256(file: str) -> str:
    """Return the hash of a file; empty where it cannot be read a second time."""
    import hashlib
    from pathlib import Path

    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return ""


def _draw(result: CheckResult | UnreadableMission, folder: Path) -> None:
    if isinstance(result, UnreadableMission) or result.assessment is None:
        narrate(f"nothing is flown: nothing is drawn into {folder}")
        return
    from planner.report.plots import mission_figures, write_figures

    written = write_figures(mission_figures(result), folder)
    narrate(f"{quantity.count(len(written), 'picture')} drawn into {folder}")


def attach_baseline(results: Results, path: Path) -> None:
    """Write what was found, for later calls not to report it."""
    from planner.selection import write_baseline

    for result in results:
        if isinstance(result, UnreadableMission):
            narrate(f"{result.file} cannot be read: {path} is not written")
            return
    found = [(result.file, finding) for result in results for finding in result.findings]
    written, refused = write_baseline(path, found)
    text = f"{quantity.count(written, 'finding')} written to {path}"
    if refused:
        text += f"; {quantity.count(refused, 'error')} of energy left out: mend the mission"
    narrate(text)
