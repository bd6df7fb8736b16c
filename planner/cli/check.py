"""``mavjoule check``: the pre-flight check."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from planner import service
from planner.cli.attachments import attach_baseline, refuse_attachments, write_attachments
from planner.cli.configuration import mission_settings
from planner.cli.formats import refuse_statistics, rendered
from planner.cli.link_options import LINK_KEYS, is_vehicle, link_options
from planner.cli.options import MISSION_PATH, given_settings, setting_options
from planner.cli.output import narrate, progress, refuse_overwriting, write_data
from planner.cli.requests import check_request, report_request
from planner.cli.settings import BUDGET_SETTINGS, FLIGHT_SETTINGS, REPORT_SETTINGS
from planner.errors import ExitCode, UsageError
from planner.report.text import caveat, tally
from planner.service import UnreadableMission

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.service import CheckResult

    Results = Sequence[CheckResult | UnreadableMission]

SUMMARY_VARIABLE = "GITHUB_STEP_SUMMARY"
_READ = ("vehicle", "params", "profile")
"""Settings that name a file that is read."""


@click.command("check")
@click.argument("missions", metavar="MISSION...", nargs=-1, required=True, type=MISSION_PATH)
@setting_options((*FLIGHT_SETTINGS, *BUDGET_SETTINGS, *REPORT_SETTINGS))
@click.option(
    "--write-baseline",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="write what is found to a file for --baseline, itself judged without any",
)
@link_options
def command(
    missions: tuple[str, ...], *, write_baseline: Path | None, **options: object
) -> ExitCode:
    """Predict missions and judge each: go or no-go.

    MISSION is a QGroundControl plan or a QGC WPL file, or - for standard input, or the address of a
    vehicle, udpin:0.0.0.0:14550 or /dev/ttyUSB0:57600: what is on it is checked with its own
    parameters, charge and home.  Defaults come from mavjoule.toml, or [tool.mavjoule] in
    pyproject.toml, in the nearest folder of the mission upward.

    Exit codes: 0 every mission is a go, 1 one is a no-go, 2 unusable input, usage or
    configuration, 3 a vehicle did not answer.
    """
    link = {key: options.pop(key) for key in LINK_KEYS}
    if missions.count("-") > 1:
        msg = "standard input can be read once: give - once"
        raise UsageError(msg)
    given = given_settings(options)
    settings = [
        mission_settings("-" if is_vehicle(mission) else mission, given) for mission in missions
    ]
    report = report_request(settings)
    refuse_statistics(report)
    refuse_attachments(report, missions=len(missions))
    read = [*missions, *(str(v[k]) for v in settings for k in _READ if k in v)]
    for written in (report.output, report.trace, report.report, write_baseline):
        refuse_overwriting(written, read)
    if write_baseline is not None:
        settings = [values | {"baseline": None} for values in settings]
    with progress(list(zip(missions, settings, strict=True)), label="Checking") as jobs:
        results = [_checked(mission, values, link) for mission, values in jobs]
    write_attachments(results, report)
    if write_baseline is not None:
        attach_baseline(results, write_baseline)
    exit_code = _exit_code(results, is_zero=report.exit_zero)
    write_data(rendered(results, report, exit_code=exit_code), output=report.output)
    if report.format == "github":
        _add_summary(results)
    if report.output is not None:
        narrate(f"{tally(results)}{caveat(results)}; the report is in {report.output}")
    return exit_code


def _checked(
    mission: str, values: Mapping[str, object], link: Mapping[str, object]
) -> CheckResult | UnreadableMission:
    request = check_request(values)
    if not is_vehicle(mission):
        return service.check_file(mission, request)
    from planner import live
    from planner.cli.link_options import TransferProgress, link_request

    snapshot = live.fetch_vehicle(link_request(mission, link), on_progress=TransferProgress())
    return live.check_vehicle(snapshot, request, is_charge_given="charge" in values)


def _add_summary(results: Results) -> None:
    """Add a table of the missions to the page of a GitHub workflow, where there is one."""
    page = os.environ.get(SUMMARY_VARIABLE)
    if not page:
        return
    from planner.report.github import github_summary

    try:
        with Path(page).open("a", encoding="utf-8", newline="") as file:
            file.write(github_summary(results, folder=Path.cwd()))
    except OSError as error:  # the annotations are out, and the verdict stands
        narrate(f"{SUMMARY_VARIABLE}: {page} cannot be written: {error.strerror or error}")


def _exit_code(results: Results, *, is_zero: bool) -> ExitCode:
    if any(isinstance(result, UnreadableMission) for result in results):
        return ExitCode.UNUSABLE
    if any(result.verdict == "no-go" for result in results) and not is_zero:
        return ExitCode.NO_GO
    return ExitCode.GO
