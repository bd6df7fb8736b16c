"""What a check puts out: its report in the format asked for, and the files beside it."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from planner import __version__, quantity
from planner.cli.output import (
    narrate,
    refuse_columns,
    refuse_page_name,
    standard_medium,
    write_columns,
    write_data,
)
from planner.errors import UsageError
from planner.service.preflight import UnreadableMission

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.errors import ExitCode
    from planner.geo.tiles import TileServer
    from planner.service.preflight import CheckResult
    from planner.setup import Output

    Results = Sequence[CheckResult | UnreadableMission]

_COUNTING_FORMATS = ("text", "json")


def refuse_output(asked: Output, *, missions: int) -> None:
    """Raise ``UsageError`` where what is asked for cannot be written, before anything is checked."""
    if asked.statistics and asked.format not in _COUNTING_FORMATS:
        msg = f"--statistics goes with --format {' or '.join(_COUNTING_FORMATS)}"
        raise UsageError(msg)
    for option in ("trace", "export", "plots"):
        if getattr(asked, option) is not None and missions > 1:
            msg = f"--{option} takes a single mission: check them one by one"
            raise UsageError(msg)
    written: dict[Path, str] = {}
    for option in ("output", "trace", "export", "report"):
        if (path := getattr(asked, option)) is not None and written.setdefault(
            followed := Path(os.path.realpath(path)), option
        ) != option:
            msg = f"--{written[followed]} and --{option} name the same file: give them one each"
            raise UsageError(msg)
    _refuse_formats(asked)


def _refuse_formats(asked: Output) -> None:
    """Raise ``UsageError`` where a file beside the report has no such format, or lacks its library."""
    if asked.trace is not None:
        refuse_columns(asked.trace)
    if asked.export is not None:
        from planner.report.flight_files import refuse_flight_file

        refuse_flight_file(asked.export)
    if asked.tiles is not None and asked.report is None:
        msg = "--tiles is the base map of a page: give --report too"
        raise UsageError(msg)
    if asked.report is not None:
        from planner.report.html.page import refuse_without_libraries

        refuse_page_name(asked.report)
        refuse_without_libraries()
    if asked.plots is not None:
        from planner.report.plots.picture_files import load_altair, load_converter

        load_altair()
        load_converter()


def rendered(
    results: Results, asked: Output, *, exit_code: ExitCode, left_out: tuple[str, ...] | None = None
) -> str:
    """Return the report of a call in the format asked for, in JSON and SARIF with files left out."""
    match asked.format:
        case "text" | "concise" as name:
            from planner.report.text import check_concise, check_text, statistics_text

            write = statistics_text if asked.statistics else check_text
            medium = standard_medium(asked.output)
            return check_concise(results) if name == "concise" else write(results, medium=medium)
        case "json" | "json-lines" as name:
            from planner.report.json import check_json, check_json_lines

            return (
                check_json_lines(results, version=__version__, left_out=left_out)
                if name == "json-lines"
                else check_json(
                    results,
                    version=__version__,
                    with_statistics=asked.statistics,
                    left_out=left_out,
                )
            )
        case "sarif":
            from planner import catalogue
            from planner.report.sarif import check_sarif

            return check_sarif(
                results,
                rules=catalogue.rules(),
                version=__version__,
                exit_code=exit_code,
                folder=Path.cwd(),
                left_out=left_out or (),
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


def write_attachments(results: Results, asked: Output) -> None:
    """Write the files that are asked for beside the report."""
    if asked.trace is not None:
        _write_trace(results[0], asked.trace)
    if asked.export is not None:
        _export(results[0], asked.export)
    if asked.report is not None:
        write_page(results, asked.report, server=asked.tiles)
    if asked.plots is not None:
        _draw(results[0], asked.plots)


def _write_trace(result: CheckResult | UnreadableMission, path: Path) -> None:
    trace = None if isinstance(result, UnreadableMission) else result.trace
    if trace is None:
        narrate(f"nothing is flown: {path} is not written")
    else:
        write_columns(trace.columns(), path)


def _export(result: CheckResult | UnreadableMission, path: Path) -> None:
    if isinstance(result, UnreadableMission) or result.assessment is None:
        narrate(f"nothing is flown: {path} is not written")
        return
    from planner.report.flight_files import flight_file

    write_data(flight_file(result, path), output=path)
    narrate(f"the flight is in {path}")


def write_page(
    results: Results,
    path: Path,
    *,
    sections: Sequence[str] = (),
    title: str = "",
    names: Sequence[str] = (),
    server: TileServer | None = None,
) -> None:
    """Write results as a page, with more sections after the overview, or in its place."""
    import hashlib
    from datetime import UTC, datetime

    from planner.report.html.page import check_html

    sha256 = dict.fromkeys((result.file for result in results), "")
    for file in sha256:
        with suppress(OSError):  # standard input, or gone meanwhile
            sha256[file] = hashlib.sha256(Path(file).read_bytes()).hexdigest()
    page = check_html(
        results,
        version=__version__,
        made_at=datetime.now(UTC),
        sha256=sha256,
        sections=sections,
        title=title,
        names=names,
        server=server,
    )
    write_data(page, output=path)
    narrate(f"the page is in {path}")


def _draw(result: CheckResult | UnreadableMission, folder: Path) -> None:
    if isinstance(result, UnreadableMission) or result.assessment is None:
        narrate(f"nothing is flown: nothing is drawn into {folder}")
        return
    from planner.report.plots import mission_figures, write_figures

    written = write_figures(mission_figures(result), folder)
    narrate(f"{quantity.count(len(written), 'picture')} drawn into {folder}")


def attach_baseline(results: Results, path: Path) -> None:
    """Write what was found, for later calls not to report it; of missions that could be checked."""
    from planner.selection import write_baseline

    checked = [result for result in results if not isinstance(result, UnreadableMission)]
    if left := [result.file for result in results if isinstance(result, UnreadableMission)]:
        narrate(f"not checked, and not in {path}: {', '.join(left)}")
    if not checked:
        narrate(f"{path} is not written")
        return
    found = [(result.file, finding) for result in checked for finding in result.findings]
    written, refused = write_baseline(path, found)
    text = f"{quantity.count(written, 'finding')} written to {path}"
    if refused:
        errors = quantity.count(refused, "error")
        text += f"; {errors} left out that take part in every verdict: mend the mission"
    narrate(text)
