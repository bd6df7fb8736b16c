"""Splitting a mission into flights that fit: each closes its energy budget, together they fly it all."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner import (
    quantity,
    service,
)
from planner.errors import SplitError, UsageError
from planner.files import (
    make_output_folder,
    write_output_files,
)
from planner.findings import Rule, Severity
from planner.fixes.part_search import MENDED, PartSearch
from planner.mission.convert import convert_mission, mission_at_speed
from planner.mission.files import read_mission
from planner.mission.formats.plan import read_plan_text
from planner.mission.items import MissionFormat
from planner.mission.parts import flown_items, is_output, mission_part
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.findings import Finding
    from planner.fixes.part_search import Range
    from planner.mission.items import Mission
    from planner.mission.parts import FlownItems, SplitPoint
    from planner.service import CheckResult
    from planner.vehicle.model import VehicleModel


class SplitPart(Value):
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
    first_own_item: int
    """Item of the part from which on it flies the mission's legs, from 1; those before lead there."""
    last_own_item: int
    """Last item of the part that does; those behind lead home."""


class Split(Value):
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
    on_step: Callable[[str], None] = lambda _: None,
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
    on_step : callable
        Told how far the search is, in words.
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
    Each part goes as far as its budget does among the places the mission can be cut at: looked for by
    what the flight in one piece takes, and found by checks of that part and of the one a cut longer.
    As the energy of a part and of the return from it grow with its length, no split has fewer parts.
    Legs are cut inside only where that saves a part.
    """
    if (speed_m_s := options.pop("speed_m_s", None)) is not None:
        mission = mission_at_speed(mission, speed_m_s)
    whole = service.check(mission, vehicle, **options)
    _refuse_not_mended(whole)
    assessment = whole.assessment
    assert assessment is not None  # else nothing is flown, an error, and it is refused
    dialect = None if assessment.target is None else assessment.target.autopilot
    flown = flown_items(mission, assessment.route, dialect)
    search = PartSearch(flown, vehicle, options, whole, on_step)
    ranges = search.ranges(inside_legs=False)
    if ranges is None or len(ranges) > search.fewest():
        finer = search.ranges(inside_legs=True)
        if finer is not None and (ranges is None or len(finer) < len(ranges)):
            ranges = finer
    if ranges is None:
        raise SplitError(search.refusal)
    parts: list[SplitPart] = []
    losses: dict[str, Finding] = {}

    def check(part: Mission) -> CheckResult:
        return service.check(part, vehicle, **options)

    before = [None, *(end for _, end in ranges)]
    for number, (ends, after) in enumerate(zip(ranges, before, strict=False), start=1):
        file = str(Path(folder) / f"part-{number:02}.plan")
        part, lost = _written(flown, ends, after, file, check)
        parts.append(part)
        losses = {finding.code: finding for finding in lost} | losses
    return Split(
        file=mission.source,
        whole=whole,
        parts=tuple(parts),
        findings=(*_remarks(flown, parts), *losses.values()),
    )


def split_file(
    path: Path | str,
    request: service.CheckRequest,
    *,
    folder: Path,
    on_step: Callable[[str], None] = lambda _: None,
) -> Split:
    """Read a mission and split it; see `split_mission`.

    Raises
    ------
    InputError, UsageError, SplitError
        As `split_mission`, and where the mission, the vehicle or the request is unusable.
    """
    vehicle, options = service.read_request(request)
    return split_mission(read_mission(path), vehicle, folder=folder, on_step=on_step, **options)


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
    make_output_folder(folder, holding="parts")
    write_output_files({path: part.text for path, part in zip(paths, split.parts, strict=True)})


def _refuse_not_mended(whole: CheckResult) -> None:
    """Raise where something is wrong that flying less at once does not mend."""
    for finding in whole.findings:
        if finding.severity >= whole.fail_on and finding.code not in MENDED:
            item = "" if finding.item is None else f" (item {finding.item})"
            msg = (
                f"{whole.file}: splitting does not mend {finding.code} {finding.name}{item}: "
                f"{finding.message}; mend that first"
            )
            raise SplitError(msg)


def _written(
    flown: FlownItems,
    ends: Range,
    after: SplitPoint | None,
    file: str,
    check: Callable[[Mission], CheckResult],
) -> tuple[SplitPart, tuple[Finding, ...]]:
    """Return a part as it is written, checked once more as it reads back, and what that loses."""
    start, end = ends
    made = mission_part(flown, start, end, name=file)
    conversion = convert_mission(made.mission, MissionFormat.PLAN)
    text = conversion.text
    result = check(read_plan_text(text, source=file))
    if result.verdict != "go":
        msg = f"{file}: reads back as a no-go: {result.findings[0].message}"
        raise SplitError(msg)
    flying = flown.flying
    first = flying[0] if start is None else start.step
    last = flying[-1] if end is None else end.step
    if end is not None and not end.fraction:
        last = max(one for one in flying if one < end.step)
    part = SplitPart(
        file=file,
        text=text,
        result=result,
        first_item=flown.numbers[first],
        last_item=flown.numbers[last],
        begins_m=start.fraction * flown.length_m(start.step) if start and start.fraction else None,
        ends_m=end.fraction * flown.length_m(end.step) if end and end.fraction else None,
        flown_twice_m=_way_m(flown, start, after),
        first_own_item=made.first_own,
        last_own_item=made.last_own,
    )
    return part, conversion.findings


def _way_m(flown: FlownItems, start: SplitPoint | None, end: SplitPoint | None) -> float:
    """Return the way from where a part is taken up to where the one before broke off. [m]"""
    if start is None or end is None:
        return 0.0
    legs = [one for one in flown.flying if start.step <= one < end.step]
    way_m = sum(map(flown.length_m, legs)) - start.fraction * flown.length_m(start.step)
    return way_m + end.fraction * flown.length_m(end.step)


LOOPS_WRITTEN_OUT = Rule(
    "L209 loops-written-out",
    Severity.INFO,
    summary="The parts of a split mission hold the items of its loops one after the other.",
    why="A part begins or ends inside a loop, where a jump would lead to what it does not hold.",
    how="DO_JUMP and DO_JUMP_TAG are followed in flown order and left out.",
    fix="nothing: the flight is the same",
)

PART_FLOWN_TWICE = Rule(
    "L210 part-flown-twice",
    Severity.INFO,
    summary="Parts of a split mission begin before the previous one ended, so that no photo is "
    "missing.",
    why="A trigger by distance starts counting again where a flight resumes, and a waypoint counts as "
    "reached some metres before it.",
    how="The distance between two photos plus 10 m, wherever a camera is triggered at the cut.",
    fix="nothing, or leave out the photos taken twice",
)

RETURN_ADDED = Rule(
    "L211 return-added",
    Severity.WARNING,
    summary="The last part of a split mission ends with a return that the mission does not have.",
    why="A part is a go only where its end on the ground is known.",
    how="NAV_RETURN_TO_LAUNCH is added where the mission ends in the air.",
    fix="end the mission with a return or a landing of your own",
)

OUTPUTS_SET_AGAIN = Rule(
    "L212 outputs-set-again",
    Severity.WARNING,
    summary="Servos, relays and the like are set again where a part of a split mission begins.",
    why="The file does not show what an output drives: a pump has to run again, but a hook that "
    "released a load would release the next one too.",
    how="The last setting of each output before the place where a part resumes is sent there again.",
    fix="check the outputs of each part, and remove what must not be done again",
)


def _remarks(flown: FlownItems, parts: list[SplitPart]) -> Iterator[Finding]:
    """Yield what is other in the parts than in the mission."""
    if flown.has_jumps:
        yield LOOPS_WRITTEN_OUT.finding(
            f"jumps are written out: {quantity.count(len(flown.items), 'item')} flown of "
            f"{len(flown.mission.items)} in the file"
        )
    if not flown.ends:
        yield RETURN_ADDED.finding(
            "the mission ends in the air: its last part returns home and lands"
        )
    twice = [part.flown_twice_m for part in parts if part.flown_twice_m > 0.0]
    if twice:
        yield PART_FLOWN_TWICE.finding(
            f"so that no photo is missing, up to {quantity.distance(max(twice))} are flown twice where "
            f"{quantity.count(len(twice), 'part begins', 'parts begin')}"
        )
    if len(parts) > 1 and (outputs := flown.states[-1].outputs()):
        first = next(
            number
            for number, item in zip(flown.numbers, flown.items, strict=True)
            if is_output(item)
        )
        yield OUTPUTS_SET_AGAIN.finding(
            f"{quantity.count(len(outputs), 'output')} (servo, relay or the like) set again where the "
            "next part begins; the state is kept on the return",
            item=first,
        )
