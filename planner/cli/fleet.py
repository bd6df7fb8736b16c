"""``mavjoule fleet``: several vehicles, packs and jobs, judged together."""

from __future__ import annotations

import datetime as dt
import os
import signal
from contextlib import contextmanager
from functools import partial
from threading import Event
from typing import TYPE_CHECKING, Any

import click

from planner import __version__
from planner.cli.options import (
    MISSION_PATH,
    data_options,
    format_option,
    given_settings,
    kind_option,
    path_option,
    setting_options,
)
from planner.cli.output import (
    narrate,
    narrate_seldom,
    refuse_columns,
    refuse_output_file,
    refuse_page,
    show_traceback,
    standard_medium,
    write_columns,
    write_data,
)
from planner.errors import ExitCode, FleetFileError, UsageError
from planner.setting import Form, Group, Number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from planner.cli.options import Command
    from planner.fleet.fleet import Fleet
    from planner.service.fleet import FleetResult
    from planner.service.fleet_plan import FleetPlan
    from planner.service.swarm import SwarmResult

_OF_VEHICLES = (
    "vehicle",
    "params",
    "autopilot",
    "target",
    "home_amsl_m",
    "payload_kg",
    "per_file_ignores",
)
"""Settings that each vehicle, pad and job has of its own."""
_SEEDS = 20
"""Runs of each number of agents, where not given."""
_OF_AGENTS = {
    "--seeds": "seeds",
    "--deadline": "deadline_s",
    "--goal": "reach_percent",
    "--workers": "workers",
}
"""Options that only count where numbers of agents are compared, by name."""
_MOST_AGENTS = 1000
"""As many as a simulation is built for."""


_REPORT = path_option(
    "--report",
    metavar="FILE.html",
    help="write the fleet as a page as well: timeline, map over time, energy, distances",
)


def _read_instant(text: str) -> dt.datetime:
    try:
        instant = dt.datetime.fromisoformat(text)
    except ValueError:
        instant = None
    if instant is None or instant.tzinfo is None:
        msg = (
            f"expected a date and time with its offset, such as 2026-05-12T08:00:00Z, got {text!r}"
        )
        raise ValueError(msg)
    return instant


def _read_numbers(text: str) -> tuple[int, ...]:
    """Return numbers of agents: ranges such as 1:12 or 2:12:2, and single ones, with commas between."""
    found: list[int] = []
    for part in text.split(","):
        try:
            first, *more = (int(one) for one in part.split(":"))
            last, step, *none = (*more, *(first, 1)[len(more) :])
        except ValueError:
            first, last, step, none = 0, 0, 0, []
        if none or not 0 < first <= last or step < 1 or last > _MOST_AGENTS:
            most = f"expected numbers of agents up to {_MOST_AGENTS}"
            msg = f"{most}, such as 1:12, 2:12:2 or 2,4,8, got {text!r}"
            raise ValueError(msg)
        found += range(first, last + 1, step)
    return tuple(found)


def _export_options(command: Command) -> Command:
    """Add the options of the files for other programs."""
    for option in reversed(
        (
            path_option(
                "--export",
                "tracks",
                multiple=True,
                help="write the tracks: to a .geojson, .kml or .czml",
            ),
            path_option(
                "--volumes", help="write the volumes other operators keep clear of, ASTM F3548-21"
            ),
            kind_option(
                "--start-time",
                Form(_read_instant, dt.datetime.isoformat),
                "when the operation begins, such as 2026-05-12T08:00:00Z [default: start in [operation]]",
                metavar="DATE-TIME",
            ),
            kind_option(
                "--geoid-height",
                Number("m", -110.0, 90.0),
                "height of the geoid (sea level) above the WGS 84 ellipsoid, for .czml and volumes "
                "[default: geoid_height_m in [operation]]",
                name="geoid_height_m",
            ),
        )
    ):
        command = option(command)
    return command


@click.group("fleet", short_help="Judge several vehicles, packs and jobs together.")
def command() -> None:
    """Judge several vehicles, packs and jobs together."""


@command.command("check", short_help="Judge a whole fleet: go or no-go.")
@click.argument("fleet", metavar="FLEET.toml", type=MISSION_PATH)
@setting_options(Group.FLIGHT, Group.JUDGEMENT, without=_OF_VEHICLES)
@data_options("text", "json")
@click.option(
    "--what-if",
    is_flag=True,
    help="judge contingencies too: each vehicle out, pack weak, sortie late, return from anywhere",
)
@_REPORT
@_export_options
@click.option("--exit-zero", is_flag=True, help="exit with 0 even where the fleet is a no-go")
def check(
    fleet: str,
    *,
    file_format: str,
    output: Path | None,
    what_if: bool,
    report: Path | None,
    exit_zero: bool,
    **options: object,
) -> ExitCode:
    """Judge a whole fleet: go or no-go.

    Every sortie of FLEET.toml is checked as mavjoule check does, on its vehicle, pack, payload and
    weather; then packs, chargers, pads and times that clash, and how far all keep apart: in the air,
    on the ground and on every return.  The keys of the file are in missions/README.md; options count
    before what it says of every vehicle.

    Exit codes: 0 the fleet is a go, 1 a no-go, 2 a file, usage or configuration is unusable.
    """
    from planner.report.fleet import fleet_json, fleet_text
    from planner.service.fleet import check_fleet

    refuse_page(report, (fleet,), output=output)
    read = _read(fleet, options)
    if read is None:
        return ExitCode.UNUSABLE
    refuse_output_file(output, read.files_read)
    refuse_page(report, read.files_read, output=output)
    _refuse_exports(read, options)
    result = check_fleet(read, what_if=what_if)
    for one in result.sorties:
        show_traceback(getattr(one.result, "failure", ""))
    _write_exports(result, options)
    is_json = file_format == "json"
    write_data(
        fleet_json(result, version=__version__)
        if is_json
        else fleet_text(result, medium=standard_medium(output)),
        output=output,
    )
    _write_report(result, report)
    if not result.is_readable:
        return ExitCode.UNUSABLE
    return ExitCode.GO if result.verdict == "go" or exit_zero else ExitCode.NO_GO


@command.command("plan", short_help="Plan who flies what when, on which pack.")
@click.argument("fleet", metavar="FLEET.toml", type=MISSION_PATH)
@path_option(
    "-o", "--output", "folder", metavar="DIR", help="where the plan is written", required=True
)
@click.option(
    "--minimize",
    type=click.Choice(["energy", "makespan", "vehicles", "batteries"]),
    default="makespan",
    show_default=True,
    help="what there should be least of; what is equal in it is told apart by the rest",
)
@kind_option(
    "--effort",
    Number("s", 0.01, 86_400.0),
    "seconds for each schedule, in the solver's own time: the same on every machine",
    name="effort_s",
    default=1.0,
)
@kind_option(
    "--time-limit",
    Number("s", 0.1, 86_400.0),
    "seconds of the clock after which the best plan so far is made whole; it then says so",
    name="time_limit_s",
)
@click.option("--force", is_flag=True, help="write over files that are there already")
@setting_options(Group.FLIGHT, Group.JUDGEMENT, without=_OF_VEHICLES)
@format_option("text", "json")
@_REPORT
@_export_options
def plan(
    fleet: str,
    *,
    folder: Path,
    minimize: str,
    effort_s: float,
    time_limit_s: float | None,
    force: bool,
    file_format: str,
    report: Path | None,
    **options: object,
) -> ExitCode:
    """Plan who flies what when, on which pack.

    Jobs of FLEET.toml that may be split are divided into sorties, which are given to vehicles and packs
    and started so that all keep apart.  Shows what one vehicle takes, two, and so on, with the fewest
    that are in time and those of least energy.  Writes DIR/fleet.toml, which mavjoule fleet check
    passes, and the mission of each sortie: its job's, a part of it, or lifted to one of the [layers].

    The same file gives the same plan, unless --time-limit or Ctrl-C cut the search short: the best plan
    so far is then made whole, checked and written.  Ctrl-C once more ends without one.

    Exit codes: 0 there is a plan, 1 there is none, 2 a file, usage or configuration is unusable.
    """
    from planner.fleet.schedule import Patience
    from planner.report.fleet import plan_json, plan_text
    from planner.service.fleet_plan import plan_fleet, write_plan

    refuse_page(report, (fleet,), made=(folder,))
    read = _read(fleet, options)
    if read is None:
        return ExitCode.UNUSABLE
    refuse_page(report, read.files_read, made=(folder,))
    _refuse_exports(read, options, made=(folder,))
    patience = Patience() if time_limit_s is None else Patience(time_limit_s)
    with interrupting(patience.stop, "the best plan so far is made whole"):
        made = plan_fleet(
            read,
            minimize=minimize,
            folder=folder,
            effort_s=effort_s,
            patience=patience,
            on_step=narrate_seldom(),
        )
    file = write_plan(made, folder, force=force)
    write_data(
        plan_json(made, version=__version__)
        if file_format == "json"
        else plan_text(made, medium=standard_medium())
    )
    narrate(f"the plan is in {file}")
    _write_exports(made.result, options)
    _write_report(made.result, report, made)
    return ExitCode.GO


def _write_report(result: FleetResult, report: Path | None, plan: FleetPlan | None = None) -> None:
    """Write a fleet as a page, where that is asked for."""
    if report is not None:
        from planner.report.html.fleet import fleet_html

        _write_page(partial(fleet_html, plan=plan), result, report)


def _write_page(made: Callable[..., str], of: object, report: Path) -> None:
    """Write a page."""
    write_data(made(of, version=__version__, made_at=dt.datetime.now(dt.UTC)), output=report)
    narrate(f"the page is in {report}")


def _refuse_exports(fleet: Fleet, options: Mapping[str, Any], *, made: Sequence[Path] = ()) -> None:
    """Raise where an export could not be written, before anything is checked."""
    for file in (*options["tracks"], options["volumes"]):
        refuse_output_file(file, fleet.files_read, made=made)


def _write_exports(result: FleetResult, options: Mapping[str, Any]) -> None:
    """Write the files for other programs that are asked for."""
    if not options["tracks"] and options["volumes"] is None:
        return
    from planner.report.fleet_exports import write_exports

    write_exports(
        result,
        tracks=options["tracks"],
        volumes=options["volumes"],
        start=options["start_time"],
        geoid_height_m=options["geoid_height_m"],
    )


@contextmanager
def interrupting(cut_short: Callable[[], object], rest: str) -> Iterator[None]:
    """Let the first Ctrl-C cut a search or a simulation short, and the next one end the program.

    ``rest`` says what is done yet after the first.
    """

    def stop(*_: object) -> None:
        signal.signal(signal.SIGINT, before)
        narrate(f"stopping: {rest}; Ctrl-C once more ends without that")
        cut_short()

    before = signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@command.command("simulate", short_help="Fly a fleet as a swarm that avoids each other.")
@click.argument("fleet", metavar="FLEET.toml", type=MISSION_PATH)
@click.option(
    "--policy",
    type=click.Choice(["none", "stop", "orca-stop"]),
    default=None,
    help="how agents avoid each other  [default: orca-stop; stop of missions as filed]",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, metavar="N")
@click.option(
    "--faults",
    metavar="NAMES",
    help="faults of the file that happen, such as one,two, or none  [default: all]",
)
@kind_option(
    "--until",
    Number("s", 1.0, 86_400.0),
    "seconds after which the simulation ends at the latest [default: 3600; of missions as filed the "
    "last landing]",
    name="until_s",
)
@path_option(
    "--trace",
    metavar="FILE.csv|FILE.parquet",
    help="write where every agent is at every step, and what it takes (.parquet needs mavjoule[parquet])",
)
@kind_option(
    "--agents",
    Form(_read_numbers, str),
    "compare numbers of agents, such as 1:12 or 2,4,8: so many of the first vehicles",
    metavar="NUMBERS",
)
@click.option(
    "--seeds",
    type=click.IntRange(1, 10_000),
    metavar="N",
    help="runs of each of the --agents, from --seed on; one where nothing is drawn [default: 20]",
)
@kind_option(
    "--deadline",
    Number("s", 0.0, 604_800.0),
    "when all --agents are to have landed [default: latest_s in [operation]]",
    name="deadline_s",
)
@click.option(
    "--goal",
    "reach_percent",
    type=click.Choice(["50", "90", "100"]),
    help="percentage of the goal that nine of ten runs of --agents must reach to be chosen",
)
@click.option(
    "--workers",
    type=click.IntRange(1),
    metavar="N",
    help="processes for --agents; the result does not depend on them [default: the cores]",
)
@path_option(
    "--report",
    metavar="FILE.html",
    help="write it as a page as well: all agents over time, or the numbers of --agents",
)
@setting_options(Group.FLIGHT, Group.JUDGEMENT, without=_OF_VEHICLES)
@data_options("text", "json")
def simulate(
    fleet: str,
    *,
    policy: str | None,
    seed: int,
    until_s: float | None,
    trace: Path | None,
    file_format: str,
    output: Path | None,
    report: Path | None,
    **options: object,
) -> ExitCode:
    """Fly a fleet as a swarm that avoids each other.

    Every vehicle of FLEET.toml answers commands by its own model, at one height, and does what [swarm]
    says; without that table the sorties fly their missions as filed.  Whatever the policy stop or orca-stop
    has it do, each can always stop without coming too near to where any other flies or stops.  Says whether
    all come home, apart and above their reserves, which is no verdict on flying it: fences, ground and
    limits of the wind are for mavjoule fleet check.

    Tables [fault.NAME] say what goes wrong: a command that is kept, a position that is lost, a battery that
    drops, a link that is late, gusts.  It then says who is hit, and whether everyone else is still safe.

    With --agents it is flown by so many of the first vehicles of the file, each number by --seeds: energy of
    the group and time to the goal of each, the number of least energy, and the fewest that are in time.

    Ctrl-C reports what there is by then, marked as cut short.

    Exit codes: 0 clear, 1 not clear, 2 a file, usage or configuration is unusable, 130 interrupted.
    """
    from planner.report.swarm import swarm_json, swarm_text
    from planner.service.swarm import simulate_fleet

    _refuse_files((fleet,), output, report, trace)
    _refuse_without_agents(options)
    read = _read(fleet, options)
    if read is None:
        return ExitCode.UNUSABLE
    _refuse_files(read.files_read, output, report, trace)
    read = _with_faults(read, options["faults"])
    asked = Event()
    with interrupting(asked.set, "what is simulated so far is reported"):
        if options["agents"] is not None:
            code = _simulate_numbers(
                read,
                policy=policy or "orca-stop",
                seed=seed,
                until_s=3600.0 if until_s is None else until_s,
                file_format=file_format,
                output=output,
                options={**options, "report": report, "trace": trace},
                on_step=_until(asked),
            )
            return ExitCode.INTERRUPTED if asked.is_set() else code
        result = simulate_fleet(
            read, policy=policy, seed=seed, until_s=until_s, on_step=_until(asked)
        )
        _write_trace(result, trace)
        write_data(
            swarm_json(result, version=__version__)
            if file_format == "json"
            else swarm_text(result, medium=standard_medium(output)),
            output=output,
        )
        if report is not None:
            from planner.report.html.swarm import swarm_html

            _write_page(swarm_html, result, report)
    if asked.is_set():
        return ExitCode.INTERRUPTED
    return ExitCode.GO if result.is_clear else ExitCode.NO_GO


def _refuse_without_agents(options: Mapping[str, Any]) -> None:
    """Raise ``UsageError`` where an option is given that only counts beside ``--agents``."""
    for option, key in _OF_AGENTS.items():
        if options["agents"] is None and options[key] is not None:
            msg = f"{option} counts where numbers of agents are compared: give --agents too, such as 1:12"
            if key == "deadline_s":
                msg += ", or latest_s in [operation] of the file"
            raise UsageError(msg)


def _until(asked: Event) -> Callable[[str], None]:
    """Return what shows steps, and ends a simulation after the step in which that is asked for."""
    show_step = narrate_seldom()

    def show(text: str) -> None:
        show_step(text)
        if asked.is_set():
            raise KeyboardInterrupt

    return show


def _with_faults(fleet: Fleet, names: Any) -> Fleet:  # noqa: ANN401 -- of click
    """Return a fleet with the faults that are asked for."""
    from planner.errors import nearest_hint
    from planner.values import replace

    if names is None:
        return fleet
    asked = [] if names == "none" else names.split(",")
    for name in asked:
        if name not in fleet.faults:
            hint = nearest_hint(name, fleet.faults)
            msg = f"--faults: {fleet.source} has no [fault.{name}]{hint}"
            raise UsageError(msg)
    return replace(fleet, faults={name: fleet.faults[name] for name in asked})


def _refuse_files(
    inputs: Sequence[str], output: Path | None, report: Path | None, trace: Path | None
) -> None:
    """Raise where report, page or trace could not be written, before anything is simulated."""
    refuse_page(report, inputs, output=output)
    refuse_output_file(output, inputs)
    refuse_output_file(trace, inputs)
    if trace is not None:
        refuse_columns(trace)


def _write_trace(result: SwarmResult, trace: Path | None) -> None:
    """Write every step of a simulation, where that is asked for."""
    if trace is None:
        return
    from planner.report.swarm import swarm_trace

    write_columns(swarm_trace(result), trace)


def _simulate_numbers(
    fleet: Fleet,
    *,
    policy: str,
    seed: int,
    until_s: float,
    file_format: str,
    output: Path | None,
    options: Mapping[str, Any],
    on_step: Callable[[str], None],
) -> ExitCode:
    """Report what numbers of agents take."""
    if options["trace"] is not None:
        msg = "--trace is of one simulation: leave out --agents"
        raise UsageError(msg)
    from planner.report.swarm import numbers_json, numbers_text
    from planner.service.preflight import verdict
    from planner.service.swarm_agents import NumbersLimits, simulate_numbers

    numbers = simulate_numbers(
        fleet,
        options["agents"],
        seeds=range(seed, seed + (options["seeds"] or _SEEDS)),
        policy=policy,
        limits=NumbersLimits(
            until_s=until_s,
            deadline_s=options["deadline_s"],
            reach_percent=None
            if options["reach_percent"] is None
            else int(options["reach_percent"]),
        ),
        workers=options["workers"] or os.cpu_count() or 1,
        on_step=on_step,
    )
    write_data(
        numbers_json(numbers, version=__version__)
        if file_format == "json"
        else numbers_text(numbers, medium=standard_medium(output)),
        output=output,
    )
    if options["report"] is not None:
        from planner.report.html.swarm import numbers_html

        _write_page(numbers_html, numbers, options["report"])
    is_clear = verdict(numbers.findings, fleet.group_setup.fail_on) == "go"
    return ExitCode.GO if is_clear else ExitCode.NO_GO


def _read(fleet: str, options: Mapping[str, object]) -> Fleet | None:
    """Return a fleet; ``None`` where its problems have been told."""
    from planner.fleet.reader import read_fleet

    try:
        return read_fleet(fleet, given=given_settings(options))
    except FleetFileError as error:
        for problem in error.problems:
            narrate(problem)
        return None
