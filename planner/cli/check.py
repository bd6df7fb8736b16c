"""``mavjoule check``: the pre-flight check."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planner import service
from planner.cli.attachments import attach_baseline, refuse_attachments, write_attachments
from planner.cli.configuration import mission_settings
from planner.cli.formats import refuse_statistics, rendered
from planner.cli.link_options import LINK_KEYS, is_vehicle, link_options
from planner.cli.options import MISSION_PATH, given_settings, setting_options
from planner.cli.output import narrate, progress, refuse_overwriting, write_data
from planner.cli.requests import check_request, fleet_request, report_request
from planner.cli.settings import (
    BUDGET_SETTINGS,
    FLEET_SETTINGS,
    FLIGHT_SETTINGS,
    REPORT_SETTINGS,
    START,
)
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
@setting_options((*FLIGHT_SETTINGS, *BUDGET_SETTINGS, *FLEET_SETTINGS, START, *REPORT_SETTINGS))
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
    starts_s = options.pop(START.key)
    if missions.count("-") > 1:
        msg = "standard input can be read once: give - once"
        raise UsageError(msg)
    given = given_settings(options)
    settings = [
        mission_settings("-" if is_vehicle(mission) else mission, given) for mission in missions
    ]
    fleet = _fleet_request(settings, given, starts_s)
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
    if fleet is not None:
        results = list(service.check_together(results, **fleet))
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


def _fleet_request(
    settings: Sequence[Mapping[str, object]], given: Mapping[str, object], starts_s: object
) -> Mapping[str, Any] | None:
    """Return what is asked of the missions together; ``None`` where each stands for itself.

    Raises
    ------
    UsageError
        If it is asked of one mission alone, or starts are given for others than these missions.
    """
    fleet = fleet_request(settings)
    if fleet is None:
        lonely = [setting.option for setting in FLEET_SETTINGS if setting.key in given]
        if starts_s is not None or lonely:
            msg = f"{(lonely or [START.option])[0]} goes with --separation"
            raise UsageError(msg)
        return None
    if len(settings) == 1:
        if starts_s is not None or "separation_m" in given:
            msg = "--separation is kept from other missions: give those of one flight together"
            raise UsageError(msg)
        return None  # the configuration is for calls of several
    if isinstance(starts_s, tuple) and len(starts_s) != len(settings):
        msg = f"{START.option} must give one time for each of the {len(settings)} missions"
        raise UsageError(msg)
    return {**fleet, "starts_s": starts_s or ()}


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
