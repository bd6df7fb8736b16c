"""The sweep: one mission, or several, checked in every case of what varies."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import msgspec

from planner.errors import OutputError, UsageError
from planner.fleet.fleet import Fleet
from planner.mission.files import read_mission
from planner.mission.items import Mission
from planner.presented import Shown, data_frame
from planner.service.sweep.axes import MISSION, Axis, make_axis, read_axis
from planner.service.sweep.batches import Batch, BatchFolder, Jobs
from planner.service.sweep.cases import make_cases, refuse_undirected
from planner.service.sweep.engines import CoresEngine
from planner.service.sweep.plan import SweepPlan
from planner.service.sweep.table import CaseTable
from planner.service.sweep.tally import Tally
from planner.service.sweep.weather import MeasuredWeather, read_weather
from planner.setting import Group
from planner.setup import Setup
from planner.values import Value
from planner.workers import core_count

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from planner.presented import FrameLibrary
    from planner.service.sweep.engines import Engine

OF_VEHICLES = frozenset({"vehicle", "params", "autopilot", "target", "home_amsl_m", "payload_kg"})
"""Settings that each vehicle, pad and job of a fleet has of its own."""
_FEW = 200
"""Cases for which no process is started."""


class SweepProgress(Value):
    """How far a sweep is."""

    done: int
    total: int
    seconds: float
    """Since it began."""
    begun: int
    """Cases that were done before."""
    changed: tuple[str, ...] = ()
    """What has changed since a sweep that was broken off; told once, before anything is done anew."""
    aside: Path | None = None
    """Where what was done of that one is now."""

    @property
    def rate(self) -> float:
        """Cases a second."""
        return (self.done - self.begun) / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def left_s(self) -> float | None:
        """What it takes yet; ``None``: not known. [s]"""
        return (self.total - self.done) / self.rate if self.rate > 0.0 else None


class Sweep(Shown, eq=False):
    """What a sweep comes to."""

    plan: SweepPlan
    tally: Tally
    seconds: float
    """That this call took."""
    resumed: int
    """Cases that were done before this call."""
    changed: tuple[str, ...]
    """What had changed since a sweep that was broken off, for which this one started anew."""
    folder: BatchFolder | None
    done: Mapping[int, int]
    """How many cases each batch holds, by the number of its first."""
    in_memory: tuple[Batch, ...] = ()

    @property
    def table(self) -> CaseTable:
        """How its rows follow from its cases."""
        return CaseTable(cases=self.plan.cases)

    def rows(self) -> Iterator[list[Any]]:
        """Yield the rows of the table, in the order of the cases."""
        table = self.table
        for batch in self.batches():
            yield from table.rows(batch.first, batch.outcomes)
        yield from table.rows_without_weather()

    def columns(self) -> dict[str, list[Any]]:
        """Return the table by columns."""
        names = self.table.columns.names
        rows = list(self.rows())
        return {name: [row[i] for row in rows] for i, name in enumerate(names)}

    def to_dataframe(self, *, library: FrameLibrary | None = None) -> Any:  # noqa: ANN401 - pandas.DataFrame or polars.DataFrame
        """Return the table as a data frame, a row for each case.

        Parameters
        ----------
        library : {"pandas", "polars"}, optional
            Whose data frame; by default of the first that is installed.

        Raises
        ------
        MissingLibraryError
            If neither is installed, or not the one asked for.
        """
        columns = self.table.columns
        numbers = [n for n, is_one in zip(columns.names, columns.is_number, strict=True) if is_one]
        return data_frame(self.columns(), numbers=numbers, library=library)

    def batches(self) -> Iterator[Batch]:
        """Yield the batches, in the order of the cases."""
        if self.folder is None:
            yield from self.in_memory
            return
        for first, count in sorted(self.done.items()):
            batch = self.folder.read(first, count)
            if batch is None:
                msg = (
                    f"{self.folder}: a batch was lost since the sweep ended: run it again to go on"
                )
                raise OutputError(msg)
            yield batch

    def remove_batches(self) -> None:
        """Take the batches away that are kept in a folder: what is asked for after that is not there."""
        if self.folder is not None:
            with self.folder.held():
                self.folder.remove()


def sweep(
    mission: Mission | Sequence[Mission] | Fleet,
    setup: Setup | None = None,
    *,
    vary: Mapping[str, str | Sequence[object]] | Iterable[str] = (),
    draws: int | None = None,
    weather: Path | str | MeasuredWeather | None = None,
    folder: Path | str | None = None,
    engine: Engine | None = None,
    on_progress: Callable[[SweepProgress], None] | None = None,
) -> Sweep:
    """Check a mission, or several, in every case of what varies.

    Parameters
    ----------
    mission : Mission, sequence of Mission or Fleet
        As `planner.read_mission` and `planner.read_fleet` return them.
    setup : Setup
        Vehicle, battery and everything else that all cases have in common; a fleet has its own.
    vary : mapping or iterable of str
        What varies, ``{"wind": "0:12:1", "payload": [0, 0.25]}`` or ``["wind=0:12:1"]``: settings by the
        names of their options, the parts of the wind ``wind``, ``wind-from`` and ``gust``.
    draws : int, optional
        How often what has a distribution, such as ``weibull(2,5)``, is drawn.
    weather : Path, str or MeasuredWeather, optional
        Measured weather, as `read_weather` reads it.
    folder : Path or str, optional
        Where finished batches are kept, from which a sweep goes on that was broken off.
    engine : Engine, optional
        Where the work is done: `CoresEngine` or `ClusterEngine`; by default on every core here.
    on_progress : callable, optional
        Called after each batch, and first of all where something changed since a sweep was broken off.

    Returns
    -------
    Sweep
        Its rows, and what they come to together.

    Raises
    ------
    UsageError
        If nothing of a name varies, or a value is out of its range.
    InputError
        If a file that is named cannot be used.
    """
    plan = make_plan(mission, setup, vary=vary, draws=draws, weather=weather)
    kept = None if folder is None else BatchFolder(Path(folder), plan)
    began_s = perf_counter()
    in_memory: list[Batch] = []
    with nullcontext() if kept is None else kept.held():
        changed = () if kept is None else kept.open()
        done = {} if kept is None else _whole(kept)
        if kept is not None and changed and on_progress is not None:
            start = SweepProgress(
                done=0,
                total=len(plan.cases),
                seconds=0.0,
                begun=0,
                changed=changed,
                aside=kept.aside,
            )
            on_progress(start)
        jobs, begun = Jobs(plan.cases, done), sum(done.values())
        if engine is None:
            engine = CoresEngine(core_count() if jobs.left >= _FEW else 1)
        finished = begun
        for first, count, data, took_s in engine.run(plan, jobs):
            jobs.took(count, took_s)
            if kept is None:
                in_memory.append(msgspec.json.decode(data, type=Batch))
            else:
                kept.write(data, first, count)
            done[first] = count
            finished += count
            if on_progress is not None:
                on_progress(
                    SweepProgress(
                        done=finished,
                        total=len(plan.cases),
                        seconds=perf_counter() - began_s,
                        begun=begun,
                    )
                )
        result = Sweep(
            plan=plan,
            tally=Tally(plan.cases),
            seconds=perf_counter() - began_s,
            resumed=begun,
            changed=changed,
            folder=kept,
            done=done,
            in_memory=tuple(sorted(in_memory, key=lambda batch: batch.first)),
        )
        for batch in result.batches():
            result.tally.add(batch)
    return result


def make_plan(
    mission: Mission | Sequence[Mission] | Fleet,
    setup: Setup | None,
    *,
    vary: Mapping[str, str | Sequence[object]] | Iterable[str] = (),
    draws: int | None = None,
    weather: Path | str | MeasuredWeather | None = None,
) -> SweepPlan:
    """Return the plan of a sweep, as for `sweep`."""
    fleet = mission if isinstance(mission, Fleet) else None
    missions = _missions_of(mission)
    axes = (
        [make_axis(name, values) for name, values in vary.items()]
        if isinstance(vary, Mapping)
        else [one if isinstance(one, Axis) else read_axis(str(one)) for one in vary]
    )
    if fleet is not None:
        _refuse_of_vehicles(axes)
        setup = fleet.group_setup
    if not isinstance(setup, Setup):
        msg = "setup must be planner.Setup(vehicle=…): which vehicle flies the mission?"
        raise UsageError(msg)
    if fleet is None and any(axis.key == MISSION.key for axis in axes):
        msg = "missions vary where several are given: sweep([read_mission(path), ...])"
        raise UsageError(msg)
    if fleet is None and len(missions) > 1:
        axes.append(Axis(key=MISSION.key, name="mission", values=tuple(missions)))
    if weather is not None and not isinstance(weather, MeasuredWeather):
        weather = read_weather(Path(weather))
    cases = make_cases(axes, draws=draws, weather=weather)
    refuse_undirected(cases, setup)
    loaded = {
        axis.key: {value: axis.setting.loaded(value) for value in axis.values}
        for axis in axes
        if axis.setting.load is not None
    }
    return SweepPlan(
        missions=missions, setup=setup, cases=cases, loaded=loaded, weather=weather, fleet=fleet
    )


def _missions_of(mission: Mission | Sequence[Mission] | Fleet) -> dict[str, Mission]:
    """Return what is flown, by its names.

    Raises UsageError where that is no mission, or one twice.
    """
    if isinstance(mission, Fleet):
        paths = [mission.mission_of(one) for one in mission.sorties.values()]
        return {path: read_mission(path) for path in dict.fromkeys(paths)}
    several = [mission] if isinstance(mission, Mission) else list(mission)
    if not several or not all(isinstance(one, Mission) for one in several):
        msg = f"mission must be planner.read_mission(path), or several: got {mission!r:.60}"
        raise UsageError(msg)
    by_name = {one.source: one for one in several}
    if len(by_name) < len(several):
        msg = "each mission is given once"
        raise UsageError(msg)
    return by_name


def _refuse_of_vehicles(axes: Iterable[Axis]) -> None:
    """Raise ``UsageError`` where what varies is of each vehicle, pack or job of a fleet."""
    for axis in axes:
        if (
            axis.key in OF_VEHICLES
            or axis.setting.group is Group.BATTERY
            or axis.key == MISSION.key
        ):
            msg = f"--vary {axis.name}: each vehicle, pack or job of a fleet has its own: vary its file"
            raise UsageError(msg)


def _whole(folder: BatchFolder) -> dict[int, int]:
    """Return the batches that are there and whole; those that are not are taken away."""
    done = {}
    end = 0
    for first, count in sorted(folder.done().items()):
        if first >= end and folder.read(first, count) is not None:
            done[first], end = count, first + count
    return done
