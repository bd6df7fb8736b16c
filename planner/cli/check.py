"""``mavjoule check`` and ``mavjoule segments``: the pre-flight check, and the decomposition alone."""

from __future__ import annotations

import os
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy  # noqa: F401 - first: typing_extensions, which msgspec loads, slows it down

from planner import __version__, quantity
from planner.cli.check_output import attach_baseline, refuse_output, rendered, write_attachments
from planner.cli.configuration import common_settings, files_read, mission_settings
from planner.cli.link import is_vehicle, link_options, taken_link
from planner.cli.options import (
    CHECK_GROUPS,
    MISSION_PATH,
    GroupedCommand,
    KindType,
    data_options,
    given_settings,
    path_option,
    setting_options,
)
from planner.cli.output import narrate, progress, refuse_output_file, show_traceback, write_data
from planner.errors import ExitCode, UsageError
from planner.files import append_output, refuse_pattern
from planner.report.text import caveat, tally
from planner.service.preflight import (
    CheckResult,
    UnreadableMission,
    check_file,
    shielded,
    surviving,
)
from planner.setting import Group, Kind, declared
from planner.setup import Output, Setup, Together
from planner.values import field_values
from planner.workers import core_count, done_in_order, end_if_stopped

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.service.preflight import Results

SUMMARY_VARIABLE = "GITHUB_STEP_SUMMARY"
_MOST_NAMED = 20
"""Files of a folder that are left out and named; of more are as many."""
_WORTH_WORKERS = 20
"""Fewer missions are checked before another process has started."""
_AT_ONCE = 4
"""Missions another process is given together: what they have in common, their vehicle, travels once."""


class _PathPattern(Kind):
    """A pattern of the paths of missions."""

    def read(self, text: str) -> str:
        """Return the pattern; raise ``ValueError`` where nothing can meet it."""
        refuse_pattern(text)
        return text


@click.command("check", cls=GroupedCommand)
@click.argument("missions", metavar="MISSION...", nargs=-1, required=True, type=MISSION_PATH)
@setting_options(*CHECK_GROUPS, Group.FLEET, Group.REPORT)
@click.option(
    "--exclude",
    type=KindType(_PathPattern()),
    multiple=True,
    metavar="GLOB",
    help="leave out the missions that meet it, such as old/*; repeatable",
)
@path_option(
    "--write-baseline",
    help="write what is found to a file for --baseline, itself judged without any",
)
@link_options
def command(
    missions: tuple[str, ...],
    *,
    exclude: tuple[str, ...],
    write_baseline: Path | None,
    **options: object,
) -> ExitCode:
    """Predict missions and judge each: go or no-go.

    MISSION is a QGroundControl plan or a QGC WPL file, a folder, which stands for the missions in it
    and below, - for standard input, or the address of a vehicle, udpin:0.0.0.0:14550 or
    /dev/ttyUSB0:57600: what is on it is checked with its own parameters, charge and home.  Defaults
    come from mavjoule.toml, or [tool.mavjoule] in pyproject.toml, in the nearest folder of the
    mission upward.

    Exit codes: 0 every mission is a go, 1 one is not, 2 unusable input, usage or
    configuration, 3 a vehicle did not answer.
    """
    link = taken_link(options)
    missions, left_out = _found(missions, exclude)
    if missions.count("-") > 1:
        msg = "standard input can be read once: give - once"
        raise UsageError(msg)
    given = given_settings(options)
    settings = [
        mission_settings("-" if is_vehicle(mission) else mission, given) for mission in missions
    ]
    together = _together(settings, given)
    output = Output.of(common_settings(settings, Output))
    refuse_output(output, missions=len(missions))
    read = files_read(missions, *settings)
    for written in (output.output, output.trace, output.export, output.report):
        refuse_output_file(written, read)
    if write_baseline is not None:
        settings = [values | {"baseline": None} for values in settings]
        refuse_output_file(write_baseline, files_read(missions, *settings))
    is_flight_used = together is not None or any(
        getattr(output, option) is not None for option in ("report", "export", "plots")
    )
    results = _all_checked(missions, settings, link=link, with_flight=is_flight_used)
    if together is not None:
        from planner.service.separation import keep_apart

        results, apart = surviving(results, lambda some: keep_apart(some, together))
        results = results if apart is None else apart
    if write_baseline is not None:
        attach_baseline(results, write_baseline)
    results = _report(results, output, left_out)
    if output.format == "github":
        _add_summary(results)
    if output.output is not None:
        narrate(f"{tally(results)}{caveat(results)}; the report is in {output.output}")
    return _exit_code(results, is_zero=output.exit_zero)


def _found(
    named: tuple[str, ...], exclude: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[str, ...] | None]:
    """Return the missions that are named, of folders those in them, without what is excluded.

    With them the other files of the folders, ``None`` where no folder is named.  What is left out is
    said.  Raises UsageError if no mission is left.
    """
    missions: list[str] = []
    met: set[str] = set()
    others: list[str] | None = None
    for name in named:
        if not is_vehicle(name) and Path(name).is_dir():
            from planner.mission.folder import find_missions

            found = find_missions(Path(name), exclude=exclude)
            # one without any is reported as what it is: no mission file
            missions += map(str, found.files) if found.files or found.excluded else [name]
            met |= found.met
            others = [*(others or ()), *map(str, found.others)]
            left = f", {found.excluded} excluded" if found.excluded else ""
            if found.others:
                names = [str(path.relative_to(name)) for path in found.others[:_MOST_NAMED]]
                more = ", …" if len(found.others) > _MOST_NAMED else ""
                count = quantity.count(len(found.others), "other file")
                left += f", {count} ({', '.join(names)}{more})"
            left += f", {found.hidden} hidden left out" if found.hidden else ""
            if found.links:
                left += f", {quantity.count(found.links, 'link')} to folders not followed"
            narrate(f"{name}: {quantity.count(len(found.files), 'mission')}{left}")
        elif name == "-" or is_vehicle(name):
            missions.append(name)
        elif meets := _patterns_met(name, exclude):
            met |= meets
        else:
            missions.append(name)
    for pattern in exclude:
        if pattern not in met:
            narrate(f"--exclude {pattern} leaves out no mission")
    if not missions:
        msg = f"--exclude {', '.join(exclude)} leaves no mission"
        raise UsageError(msg)
    return tuple(missions), None if others is None else tuple(others)


def _patterns_met(name: str, exclude: tuple[str, ...]) -> set[str]:
    if not exclude:
        return set()
    from planner.mission.folder import patterns_met

    return patterns_met(Path(name), exclude)


def _report(results: Results, output: Output, left_out: tuple[str, ...] | None) -> Results:
    """Write what is asked for of results; return them, of which some may have become failed checks."""

    def text_of(some: Results) -> str:
        code = _exit_code(some, is_zero=output.exit_zero)
        return rendered(some, output, exit_code=code, left_out=left_out)

    results, _ = surviving(results, lambda some: write_attachments(some, output))
    results, text = surviving(results, text_of)
    write_data(text_of(results) if text is None else text, output=output.output)
    for result in results:
        if isinstance(result, UnreadableMission):
            show_traceback(result.failure)
    return results


def _together(
    settings: Sequence[Mapping[str, Any]], given: Mapping[str, object]
) -> Together | None:
    """Return what is asked of the missions together; ``None`` where each stands for itself.

    Raises UsageError if it is asked of one mission alone, or starts are given for others than these
    missions.
    """
    common = common_settings(settings, Together)
    if "separation_m" not in common:
        alone = [setting.option for setting in declared(Together) if setting.key in given]
        if alone:
            msg = f"{alone[0]} goes with --separation"
            raise UsageError(msg)
        return None
    if len(settings) == 1:
        if not {"separation_m", "starts_s"}.isdisjoint(given):
            msg = "--separation is kept from other missions: give those of one flight together"
            raise UsageError(msg)
        return None  # the configuration is for calls of several
    together = Together.of(common)
    if together.starts_s and len(together.starts_s) != len(settings):
        msg = f"--start must give one time for each of the {len(settings)} missions"
        raise UsageError(msg)
    return together


def _workers(missions: Sequence[str]) -> int:
    """Return in how many processes missions are checked: in this one where it alone can read them."""
    if len(missions) < _WORTH_WORKERS or any(one == "-" or is_vehicle(one) for one in missions):
        return 1
    return core_count()


def _all_checked(
    missions: Sequence[str],
    settings: Sequence[Mapping[str, Any]],
    *,
    link: Mapping[str, object],
    with_flight: bool,
) -> Results:
    """Check missions, in several processes where that is worth it."""
    jobs = list(zip(missions, settings, strict=True))
    workers = _workers(missions)
    at_once = 1 if workers == 1 else _AT_ONCE
    batches = [jobs[first : first + at_once] for first in range(0, len(jobs), at_once)]
    work = partial(_checked, link=link, with_flight=with_flight)
    with done_in_order(work, batches, workers=workers, helps=True) as done:
        shipped = progress(chain.from_iterable(done), of=len(jobs), label="checked")
        return [kind(**fields) for kind, fields in shipped]


def _checked(
    jobs: Sequence[tuple[str, Mapping[str, Any]]], *, link: Mapping[str, object], with_flight: bool
) -> list[tuple[type, dict[str, Any]]]:
    """Return what missions come to: type and fields of each, of which the flight is the largest by far."""
    checked = []
    for mission, values in jobs:
        end_if_stopped()
        result = shielded(partial(_check, mission, values, link), file=mission)
        fields = field_values(result)
        if isinstance(result, CheckResult) and not with_flight:
            fields["assessment"] = None
        checked.append((type(result), fields))
    return checked


def _check(
    mission: str, values: Mapping[str, Any], link: Mapping[str, object]
) -> CheckResult | UnreadableMission:
    setup = Setup.of(values)
    if not is_vehicle(mission):
        return check_file(mission, setup)
    from planner.cli.link import TransferProgress, link_request
    from planner.service.vehicle import check_vehicle, fetch_vehicle

    snapshot = fetch_vehicle(link_request(mission, link), on_progress=TransferProgress())
    return check_vehicle(snapshot, setup, is_charge_given="charge" in values)


def _add_summary(results: Results) -> None:
    """Add a table of the missions to the page of a GitHub workflow, where there is one."""
    page = os.environ.get(SUMMARY_VARIABLE)
    if not page:
        return
    from planner.report.github import github_summary

    try:
        append_output(Path(page), github_summary(results, folder=Path.cwd()))
    except OSError as error:  # the annotations are out, and the verdict stands
        narrate(f"{SUMMARY_VARIABLE}: {page} cannot be written: {error.strerror or error}")


def _exit_code(results: Results, *, is_zero: bool) -> ExitCode:
    if any(result.verdict is None for result in results):
        return ExitCode.UNUSABLE
    if any(result.verdict == "no-go" for result in results) and not is_zero:
        return ExitCode.NO_GO
    return ExitCode.GO


@click.command("segments")
@click.argument("mission", type=MISSION_PATH)
@setting_options(Group.FLIGHT)
@data_options("text", "json", "csv")
def segments(mission: str, *, file_format: str, output: Path | None, **options: object) -> ExitCode:
    """Show a flight cut into states, a row per segment.

    Nothing is judged: the exit code is 0 for every mission that can be read, 2 for others, and 1
    where mavjoule itself fails.
    """
    from planner.report.columns import segments_csv, segments_text
    from planner.report.json import segments_json

    settings = mission_settings(mission, given_settings(options))
    refuse_output_file(output, files_read((mission,), settings))
    result = check_file(mission, Setup.of(settings))
    if isinstance(result, UnreadableMission):
        show_traceback(result.failure)
        place = result.findings[0].place
        where = "" if place is None else f":{place.line}:{place.column}"
        narrate(f"{result.file}{where}: {result.findings[0].message}")
        return ExitCode.NO_GO if result.failure else ExitCode.UNUSABLE
    match file_format:
        case "json":
            text = segments_json(result, version=__version__)
        case "csv":
            text = segments_csv(result)
        case _:
            text = segments_text(result)
    write_data(text, output=output)
    return ExitCode.GO
