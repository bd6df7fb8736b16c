"""``mavjoule sweep``: a mission checked over everything that may vary."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click

from planner import quantity
from planner.cli.configuration import common_settings, files_read, mission_settings
from planner.cli.options import (
    CHECK_GROUPS,
    MISSION_PATH,
    GroupedCommand,
    given_settings,
    path_option,
    setting_options,
)
from planner.cli.output import (
    StatusLine,
    narrate,
    narrate_seldom,
    refuse_output_file,
    refuse_page,
    standard_medium,
    write_data,
)
from planner.errors import ExitCode, UsageError
from planner.mission.files import read_mission
from planner.service.preflight import bugs_of
from planner.service.sweep.axes import MISSION
from planner.setting import Group
from planner.setup import Setup
from planner.setup import settings as settings_by_key

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from planner.fleet.fleet import Fleet
    from planner.mission.items import Mission
    from planner.service.sweep.engines import Engine
    from planner.service.sweep.sweep import Sweep, SweepProgress


@click.command(
    "sweep", cls=GroupedCommand, short_help="Check a mission over weather, load and battery."
)
@click.argument(
    "missions", metavar="MISSION...|FLEET.toml", nargs=-1, required=True, type=MISSION_PATH
)
@click.option(
    "--vary",
    multiple=True,
    metavar="NAME=VALUES",
    help="what varies: wind=0:12:1, wind-from=0:315:45, payload=0,0.25,0.5, charge=normal(90%,5%); any "
    "setting by the name of its option, and gust; repeatable",
)
@click.option(
    "--draws",
    type=click.IntRange(1, 10_000_000),
    metavar="N",
    help="how often normal(MEAN,SD), uniform(LOW,HIGH), triangular(LOW,MODE,HIGH) and "
    "weibull(SHAPE,SCALE) are drawn",
)
@path_option(
    "--weather",
    metavar="FILE.csv",
    help="measured weather, a case for each row: time, wind speed, direction, gust, temperature, units "
    "in the heads",
)
@path_option(
    "-o",
    "--output",
    metavar="FILE.parquet|FILE.csv",
    help="write a row for each case; a sweep that is broken off goes on where it was",
)
@click.option(
    "--workers",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="processes on this machine [default: one for each core]",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS|FILE.json",
    help="work on the Dask cluster of this scheduler (needs mavjoule[cluster])",
)
@path_option(
    "--report",
    metavar="FILE.html",
    help="write maps of GO, limits and what moves the margin as a page as well (needs mavjoule[report])",
)
@path_option(
    "--plots",
    metavar="DIR",
    help="draw the maps into a folder, as SVG and PNG (needs mavjoule[report])",
)
@setting_options(*CHECK_GROUPS)
def command(
    missions: tuple[str, ...],
    *,
    vary: tuple[str, ...],
    draws: int | None,
    weather: Path | None,
    output: Path | None,
    report: Path | None,
    plots: Path | None,
    **options: Any,  # noqa: ANN401 - as click reads them
) -> ExitCode:
    """Check a mission in every case of what varies.

    Every combination of the values is a case, and so is every row of the weather: each is what
    mavjoule check finds with these settings.  Equal conditions are checked once; a calm has no
    direction.  Of gusts the rules take the mean and two standard deviations.

    Several missions are compared with each other; a fleet is judged as a whole.  Exit codes: 0 the
    cases were checked, whatever was found, 2 unusable input or usage, 3 a cluster is lost,
    130 interrupted.
    """
    from planner.report.sweep import progress_text, sweep_text
    from planner.report.sweep_table import write_sweep
    from planner.service.sweep.sweep import sweep

    named, vary = _missions_of(vary)
    missions = tuple(dict.fromkeys((*missions, *named)))
    folder = None if output is None else output.with_name(f"{output.name}.parts")
    engine = _engine(options["workers"], options["scheduler"])
    line = StatusLine()
    with bugs_of(missions[0]):
        subject, read = _subject(missions, given_settings(options))
        others = _files_of(vary, weather, options["scheduler"])
        _refuse_output((*read, *others), output, report, plots)
        try:
            result = sweep(
                *subject,
                vary=vary,
                draws=draws,
                weather=weather,
                folder=folder,
                engine=engine,
                on_progress=_reporter(line, progress_text, folder),
            )
        except KeyboardInterrupt:
            if folder is not None:
                line.narrate(f"what is done is in {folder}: run the same command again to go on")
            raise
        line.show("")
        _narrate_before(result)
        if result.plan.weather is not None and not result.tally.knows_times:
            narrate(
                f"{result.plan.weather.source}: times are not all ISO 8601 (2025-06-01T12:00): nothing is "
                "counted by month and hour"
            )
        write_data(sweep_text(result, medium=standard_medium()))
        _draw(result, report, plots)
        if output is not None:
            write_sweep(result, output)
            result.remove_batches()
            narrate(f"{quantity.count(result.plan.cases.row_count, 'row')} written to {output}")
    return ExitCode.GO


def _missions_of(vary: Sequence[str]) -> tuple[list[str], tuple[str, ...]]:
    """Return the missions that vary by name, which are swept beside those given, and what else varies."""
    is_mission = [one.partition("=")[0].strip() == MISSION.key for one in vary]
    named = [one.partition("=")[2] for one, is_one in zip(vary, is_mission, strict=True) if is_one]
    paths = [path.strip() for one in named for path in one.split(",") if path.strip()]
    others = tuple(one for one, is_one in zip(vary, is_mission, strict=True) if not is_one)
    return paths, others


def _files_of(vary: Sequence[str], weather: Path | None, scheduler: str | None) -> list[str]:
    """Return what may be files of those that say what varies, and where the work is done."""
    values = [value.strip() for one in vary for value in one.partition("=")[2].split(",")]
    return [*values, *(str(one) for one in (weather, scheduler) if one is not None)]


def _subject(
    missions: Sequence[str], given: dict[str, Any]
) -> tuple[tuple[list[Mission], Setup] | tuple[Fleet, None], Sequence[str]]:
    """Return what is swept, missions with their setup or a fleet, which has its own, and what was read.

    Raises UsageError if a fleet is not alone, or a setting is given that its vehicles have of their own.
    """
    if not any(name.endswith(".toml") for name in missions):
        settings = [mission_settings(mission, given) for mission in missions]
        read = [read_mission(mission) for mission in missions]
        setup = Setup.of(common_settings(settings, Setup))
        return (read, setup), files_read(missions, *settings)
    from planner.fleet.reader import read_fleet
    from planner.service.sweep.sweep import OF_VEHICLES

    if len(missions) > 1:
        msg = "a fleet is swept alone: give one FLEET.toml, or missions"
        raise UsageError(msg)
    for key in given:
        if key in OF_VEHICLES or settings_by_key()[key].group is Group.BATTERY:
            msg = (
                f"{settings_by_key()[key].option}: each vehicle, pack or job of a fleet has its own"
            )
            raise UsageError(msg)
    fleet = read_fleet(missions[0], given=given)
    return (fleet, None), fleet.files_read


def _refuse_output(
    inputs: Sequence[str], output: Path | None, report: Path | None, plots: Path | None
) -> None:
    """Raise ``UsageError`` where what is asked for cannot be written."""
    if output is not None:
        from planner.report.sweep_table import refuse_table

        refuse_table(output)
        refuse_output_file(output, inputs)
    refuse_page(report, inputs, output=output)
    if plots is not None:
        from planner.report.html.page import refuse_without_libraries

        refuse_without_libraries()


def _engine(workers: int | None, scheduler: str | None) -> Engine | None:
    """Return where the work is done; ``None``: on every core of this machine, where it is worth it.

    Raises UsageError if a cluster is asked for and processes here.
    """
    from planner.service.sweep.engines import ClusterEngine, CoresEngine

    if scheduler is None:
        return None if workers is None else CoresEngine(workers)
    if workers is not None:
        msg = "--workers are processes here, --scheduler has its own: give one of them"
        raise UsageError(msg)
    return ClusterEngine(scheduler)


def _draw(result: Sweep, report: Path | None, plots: Path | None) -> None:
    """Write the page and the pictures of a sweep, where they are asked for."""
    if report is not None:
        from datetime import UTC, datetime

        from planner import __version__
        from planner.report.html.sweep import sweep_html

        write_data(
            sweep_html(result, version=__version__, made_at=datetime.now(UTC)), output=report
        )
        narrate(f"the page is in {report}")
    if plots is not None:
        from planner.report.plots import write_figures
        from planner.report.plots.sweep import sweep_figures

        for path in write_figures(sweep_figures(result.tally), plots):
            narrate(f"wrote {path}")


def _narrate_before(result: Sweep) -> None:
    """Report what was there of a sweep that was broken off."""
    if result.resumed:
        narrate(f"{quantity.count(result.resumed, 'case')} of before: the others were checked now")


def _reporter(
    line: StatusLine, text_of: Callable[[SweepProgress], str], folder: Path | None
) -> Callable[[SweepProgress], None]:
    """Return what reports progress: in one line on a terminal, else seldom."""
    seldom = narrate_seldom()

    def report(progress: SweepProgress) -> None:
        if progress.changed:
            text = f"{' and '.join(progress.changed)} changed since this sweep was broken off: begun anew"
            if progress.aside is not None:
                text += f"; what was done is in {progress.aside}: as {folder} it goes on"
            line.narrate(text)
            return
        with suppress(OSError):
            if line.is_terminal:
                line.show(text_of(progress))
            else:
                seldom(text_of(progress))

    return report
