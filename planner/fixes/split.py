"""Splitting a mission into flights that fit: each closes its energy budget, together they fly it all."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner import numbers, service
from planner.catalogue.loader_writer import (
    LOOPS_WRITTEN_OUT,
    OUTPUTS_SET_AGAIN,
    PART_FLOWN_TWICE,
    RETURN_ADDED,
)
from planner.errors import OutputError, SplitError, UsageError
from planner.frozen import frozen
from planner.mission.carried_state import is_output
from planner.mission.conversion import convert_mission
from planner.mission.files import read_mission
from planner.mission.items import MissionFormat
from planner.mission.one_speed import mission_at_speed
from planner.mission.parts import make_steps, part_of, possible_cuts, resumption
from planner.mission.plan import read_plan_text
from planner.output_file import write_output_file

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.mission.items import Mission
    from planner.mission.parts import Cut, Steps
    from planner.service import CheckResult
    from planner.vehicle.model import VehicleModel

_MENDED = frozenset({"E101", "E102", "E103", "E104", "E119"})
"""What a shorter flight mends."""
_MOST_PARTS = 99
_TRIES = 60
"""Earlier places a part is tried to end at, where more than energy is wrong with its longest form."""


@frozen
class SplitPart:
    """One of the flights a mission is split into."""

    file: str
    text: str
    """The plan as it is written."""
    result: CheckResult
    """Of the plan read back: a go."""
    first_item: int
    """Item of the whole mission that it flies to first, from 1."""
    last_item: int
    """Item of the whole mission that it flies to last, or part of the way."""
    begins_m: float | None
    """How far along the leg to its first item it takes up; ``None``: where the item before is. [m]"""
    ends_m: float | None
    """How far along the leg to its last item it breaks off; ``None``: it flies all of it. [m]"""
    flown_twice_m: float
    """Way that the part before has flown already. [m]"""


@frozen
class Split:
    """A mission split into flights that fit."""

    file: str
    whole: CheckResult
    """The check of the mission in one flight."""
    parts: tuple[SplitPart, ...]
    findings: tuple[Finding, ...]
    """What is other than in the mission, and what has to be looked at."""


def split_mission(
    mission: Mission,
    vehicle: VehicleModel,
    *,
    folder: Path | str = "",
    **options: Any,  # noqa: ANN401 - those of `planner.check`
) -> Split:
    """Return the fewest flights that together fly a mission, each a go by `planner.check`.

    Parameters
    ----------
    mission : Mission
        As `planner.read_mission` returns it.
    vehicle : VehicleModel
        As `planner.load_vehicle` returns it.
    folder : Path or str
        Where the parts are to be written, for their names.
    **options
        Battery, reserve, conditions and the rest, as `planner.check` takes them; a ``speed_m_s`` is
        written into the parts.

    Returns
    -------
    Split
        Nothing is written yet: `write_split` does.

    Raises
    ------
    SplitError
        If not even one leg fits, if something else than energy is wrong with the mission, or if parts
        of it would not mean what they do in it.
    MissionFileError
        If an item holds a number no vehicle can fly.
    UsageError
        If a value is out of its range.

    Notes
    -----
    Each part goes as far as its budget does, by bisection among the places the mission can be cut at.
    As the energy of a part and of the way home from it grow with its length, no split has fewer parts.
    Legs are cut inside only where that saves a part.
    """
    if (speed_m_s := options.pop("speed_m_s", None)) is not None:
        mission = mission_at_speed(mission, speed_m_s)
    whole = service.check(mission, vehicle, **options)
    _refuse_not_mended(whole)
    case = whole.case
    assert case is not None  # else nothing is flown, an error, and it is refused
    meaning = None if case.target is None else case.target.autopilot
    steps = make_steps(mission, case.route, meaning)
    search = _Search(steps, vehicle, options, Path(folder))
    ranges = search.ranges(inside_legs=False)
    if ranges is None or len(ranges) > search.fewest(whole):
        finer = search.ranges(inside_legs=True)
        if finer is not None and (ranges is None or len(finer) < len(ranges)):
            ranges = finer
    if ranges is None:
        raise SplitError(search.refusal)
    parts: list[SplitPart] = []
    losses: dict[str, Finding] = {}
    for number, (start, end) in enumerate(ranges, start=1):
        after = ranges[number - 2][1] if number > 1 else None
        part, lost = search.written(number, start, end, after=after)
        parts.append(part)
        losses = {finding.code: finding for finding in lost} | losses
    return Split(
        file=mission.source,
        whole=whole,
        parts=tuple(parts),
        findings=(*_remarks(steps, parts), *losses.values()),
    )


def split_file(path: Path | str, request: service.CheckRequest, *, folder: Path) -> Split:
    """Read a mission and split it; see `split_mission`.

    Raises
    ------
    InputError, UsageError, SplitError
        As `split_mission`, and where the mission, the vehicle or the request is unusable.
    """
    vehicle, options = service.read_request(request)
    return split_mission(read_mission(path), vehicle, folder=folder, **options)


def write_split(split: Split, folder: Path, *, force: bool = False) -> None:
    """Write every part of a split, or none.

    Parameters
    ----------
    split : Split
        As `split_mission` returns it.
    folder : Path
        Made where it is not there.
    force : bool
        Write over parts that are there already.

    Raises
    ------
    UsageError
        If there are such files already; parts that would be left over from another split are never
        left beside the new ones.
    OutputError
        If a file cannot be written.
    """
    paths = [folder / Path(part.file).name for part in split.parts]
    there = sorted(folder.glob("part-[0-9][0-9].plan"))
    left_over = [path for path in there if path not in paths]
    if left_over:
        msg = f"{left_over[0]} is left from another split: remove it, or give another folder"
        raise UsageError(msg)
    if there and not force:
        msg = f"{there[0]} exists already: give another folder, or --force"
        raise UsageError(msg)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"{folder}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error
    before = {path: path.read_text(encoding="utf-8") for path in there}
    try:
        for path, part in zip(paths, split.parts, strict=True):
            write_output_file(path, part.text)
    except OutputError:
        for path in paths:
            if path in before:
                write_output_file(path, before[path])
            else:
                path.unlink(missing_ok=True)
        raise


def _refuse_not_mended(whole: CheckResult) -> None:
    """Raise where something is wrong that flying less at once does not mend."""
    for finding in whole.findings:
        if finding.severity >= whole.fail_on and finding.code not in _MENDED:
            item = "" if finding.item is None else f" (item {finding.item})"
            msg = (
                f"{whole.file}: splitting does not mend {finding.code} {finding.name}{item}: "
                f"{finding.message}; mend that first"
            )
            raise SplitError(msg)


class _Search:
    """The search for the parts of one mission."""

    def __init__(
        self, steps: Steps, vehicle: VehicleModel, options: dict[str, Any], folder: Path
    ) -> None:
        self.refusal = ""
        self._steps = steps
        self._vehicle = vehicle
        self._options = options | {"with_trace": False}
        self._folder = folder

    def fewest(self, whole: CheckResult) -> int:
        """Return a number of parts below which the energy of the mission alone does not go."""
        battery = whole.battery
        if battery is None:
            return 1
        return math.ceil(whole.totals.energy_wh / (battery.usable_wh - battery.reserve_wh))

    def ranges(self, *, inside_legs: bool) -> list[tuple[Cut | None, Cut | None]] | None:
        """Return where each part begins and ends; ``None`` with a `refusal` where one does not fit."""
        cuts = possible_cuts(self._steps, inside_legs=inside_legs)
        found: list[tuple[Cut | None, Cut | None]] = []
        start: Cut | None = None
        first = 0
        while True:
            if self._goes(start, None):
                return [*found, (start, None)]
            end = self._farthest(start, cuts, first)
            if end is None or len(found) + 1 >= _MOST_PARTS:
                self._refuse(start, cuts[first] if first < len(cuts) else None)
                return None
            found.append((start, cuts[end]))
            start = resumption(self._steps, cuts[end])
            first = end + 1

    def _farthest(self, start: Cut | None, cuts: list[Cut], first: int) -> int | None:
        """Return the last cut that a part may end at; ``None``: none."""
        low, high = first - 1, len(cuts)
        step = 1
        while low + step < high:  # in growing strides, as a part is short against the whole
            if not self._fits(start, cuts[low + step]):
                high = low + step
                break
            low, step = low + step, 2 * step
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self._fits(start, cuts[middle]) else (low, middle)
        for end in range(low, max(low - _TRIES, first - 1), -1):
            if self._goes(start, cuts[end]):
                return end
        return None

    def _check(self, start: Cut | None, end: Cut | None) -> CheckResult:
        part = part_of(self._steps, start, end, name=self._steps.mission.source)
        return service.check(part, self._vehicle, **self._options)

    def _fits(self, start: Cut | None, end: Cut | None) -> bool:
        result = self._check(start, end)
        return not any(
            finding.code in _MENDED and finding.severity >= result.fail_on
            for finding in result.findings
        )

    def _goes(self, start: Cut | None, end: Cut | None) -> bool:
        return self._check(start, end).verdict == "go"

    def _refuse(self, start: Cut | None, end: Cut | None) -> None:
        result = self._check(start, end)
        battery, totals = result.battery, result.totals
        flying = self._steps.flying
        step = end.step if end is not None and end.share else flying[-1]
        if end is not None and not end.share:
            step = max(one for one in flying if one < end.step)
        elif start is not None and end is None:
            step = start.step
        number = self._steps.numbers[step]
        others = [
            one
            for one in result.findings
            if one.severity >= result.fail_on and one.code not in _MENDED
        ]
        why = "".join(f": {one.code} {one.message}" for one in others[:1])
        if battery is not None and not others:
            left_wh = battery.usable_wh - battery.reserve_wh
            why = (
                f": with the way there and home it takes {numbers.energy(totals.energy_wh)}, the "
                f"battery has {numbers.energy(left_wh)} above the reserve"
            )
        self.refusal = (
            f"{self._steps.mission.source}: cannot be split: not even the shortest flight to "
            f"item {number} is a go{why}; what would help is a larger battery, a smaller reserve, "
            "another speed (mavjoule speed), or a home nearer to it"
        )

    def written(
        self, number: int, start: Cut | None, end: Cut | None, *, after: Cut | None
    ) -> tuple[SplitPart, tuple[Finding, ...]]:
        """Return a part as it is written, checked once more as it reads back, and what that loses."""
        steps = self._steps
        file = str(self._folder / f"part-{number:02}.plan")
        conversion = convert_mission(part_of(steps, start, end, name=file), MissionFormat.PLAN)
        text = conversion.text
        result = service.check(read_plan_text(text, source=file), self._vehicle, **self._options)
        if result.verdict != "go":
            msg = f"{file}: reads back as a no-go: {result.findings[0].message}"
            raise SplitError(msg)
        flying = steps.flying
        first = flying[0] if start is None else start.step
        last = flying[-1] if end is None else end.step
        if end is not None and not end.share:
            last = max(one for one in flying if one < end.step)
        part = SplitPart(
            file=file,
            text=text,
            result=result,
            first_item=steps.numbers[first],
            last_item=steps.numbers[last],
            begins_m=start.share * steps.length_m(start.step) if start and start.share else None,
            ends_m=end.share * steps.length_m(end.step) if end and end.share else None,
            flown_twice_m=_way_m(steps, start, after),
        )
        return part, conversion.findings


def _way_m(steps: Steps, start: Cut | None, end: Cut | None) -> float:
    """Return the way from where a part is taken up to where the one before broke off. [m]"""
    if start is None or end is None:
        return 0.0
    legs = [one for one in steps.flying if start.step <= one < end.step]
    way_m = sum(map(steps.length_m, legs)) - start.share * steps.length_m(start.step)
    return way_m + end.share * steps.length_m(end.step)


def _remarks(steps: Steps, parts: list[SplitPart]) -> Iterator[Finding]:
    """Yield what is other in the parts than in the mission."""
    if steps.has_jumps:
        yield LOOPS_WRITTEN_OUT.finding(
            f"jumps are written out: {numbers.count(len(steps.items), 'item')} flown of "
            f"{len(steps.mission.items)} in the file"
        )
    if not steps.ends:
        yield RETURN_ADDED.finding(
            "the mission ends in the air: its last part returns home and lands"
        )
    twice = [part.flown_twice_m for part in parts if part.flown_twice_m > 0.0]
    if twice:
        yield PART_FLOWN_TWICE.finding(
            f"{numbers.count(len(twice), 'part')} begin up to {numbers.distance(max(twice))} before "
            "the one before ended: no photo is missing"
        )
    if len(parts) > 1 and (outputs := steps.states[-1].outputs()):
        first = next(
            number
            for number, item in zip(steps.numbers, steps.items, strict=True)
            if is_output(item)
        )
        yield OUTPUTS_SET_AGAIN.finding(
            f"{numbers.count(len(outputs), 'output')} of servos, relays or the like keep their "
            "state on the way home, and are set again where the next part begins",
            item=first,
        )
