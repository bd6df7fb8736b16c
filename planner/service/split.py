"""Splitting a mission into flights that fit: each closes its energy budget, together they fly it all."""

from __future__ import annotations

import math
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import catalogue, quantity
from planner.errors import SplitError, UsageError
from planner.files import is_among, make_output_folder, write_output_files
from planner.findings import Rule, Severity
from planner.flight.returns.destination import HOME
from planner.mission.commands import command_name
from planner.mission.convert import convert_mission, mission_at_speed
from planner.mission.formats.plan import read_plan_text
from planner.mission.items import MissionFormat
from planner.mission.parts import flown_items, is_output, mission_part, resumption, split_points
from planner.mission.route.stage import LANDED_STAGES
from planner.presented import Presented
from planner.rules.energy import RESERVE_AT_RISK
from planner.service.preflight import check_mission
from planner.setup import Setup
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.mission.items import Mission
    from planner.mission.parts import FlownItems, SplitPoint
    from planner.service.preflight import CheckResult
    from planner.vehicle.model import VehicleModel

    Range = tuple[SplitPoint | None, SplitPoint | None]
    """Where a part begins and ends; ``None``: where the mission does."""


_BOUNDED = frozenset({"E105", "E122", "E127", "E129"})
"""What is not counted and is held against the margin: a shorter flight mends it where it has more of that."""
MENDED = _BOUNDED | {"E101", "E102", "E103", "E104", "E116", "E119", "E124", "E134", "M102", "M126"}
"""What a shorter flight mends, fewer items, or the return that ends each part."""
_MOST_PARTS = 99
_TRIES = 60
"""Earlier places a part is tried to end at, where more than energy is wrong with its longest form."""
_GUESSES = 8
"""Places looked at by what the flight in one piece takes; then the rest is halved."""
_HALVINGS = 40
_TOO_MUCH = 1.02
"""Legs that alone take so much more than there is fit no part, for they are the same in it. [-]"""


class _Trial(Value):
    """The check of one part."""

    fits: bool
    """Nothing is wrong that a shorter one mends."""
    goes: bool
    margin_wh: float | None
    """Least energy above the reserve, at landing or on a return. [Wh]"""


class _Ways(Value, eq=False):
    """What the flight in one piece takes to the end of each stage, and from there home: time, or energy."""

    flown: FlownItems
    done: FloatArray
    home: FloatArray

    def at(self, cut: SplitPoint) -> tuple[float, float]:
        """Return what is taken up to a cut, and for the return from there."""
        stage = self.flown.stages[cut.step]
        assert stage is not None  # cuts are at items that are flown
        place = np.array([1.0 - cut.fraction, cut.fraction])
        rows = slice(stage - 1, stage + 1)
        return float(place @ self.done[rows]), float(place @ self.home[rows])

    def saved(self, start: SplitPoint | None) -> float:
        """Return what a part saves by beginning there, with its way out taken for one home."""
        if start is None:
            return 0.0
        done, home = self.at(start)
        return done - home


class _Forecast:
    """What parts take, by the flight in one piece: where to look first, never what is reported."""

    def __init__(self, ways: _Ways, above_wh: float) -> None:
        self._ways = ways
        self._above_wh = above_wh
        self._needed_wh = np.empty(0)
        """For each place a part may end at, with the return from there. [Wh]"""
        self._off_wh = 0.0
        """What parts take beyond their forecast, by the one checked last."""
        self._short_wh = 0.0
        """What was left of the last part that did not fit, for its risk asks for more."""

    def ending_at(self, cuts: Sequence[SplitPoint]) -> None:
        """Take the places parts may end at."""
        self._needed_wh = np.maximum.accumulate(np.array([sum(self._ways.at(cut)) for cut in cuts]))
        self._off_wh = 0.0

    def reach(self, start: SplitPoint | None) -> int:
        """Return the last place a part should end at; below 0: none."""
        limit_wh = self._above_wh - self._short_wh + self._ways.saved(start) - self._off_wh
        return int(np.searchsorted(self._needed_wh, limit_wh, side="right")) - 1

    def learn(self, start: SplitPoint | None, end: int, margin_wh: float | None) -> None:
        """Take what the check found left of a part."""
        if margin_wh is not None and math.isfinite(margin_wh):
            forecast_wh = float(self._needed_wh[end]) - self._ways.saved(start)
            self._off_wh = self._above_wh - margin_wh - forecast_wh

    def aim(self, margin_wh: float | None) -> None:
        """Take what is left of a part that is just too long to fit."""
        self._short_wh = max(margin_wh or 0.0, 0.0)

    def is_rest_too_much(self, start: SplitPoint | None) -> bool:
        """Return whether the legs from a place to the end alone take more than there is."""
        used_wh = 0.0 if start is None else self._ways.at(start)[0]
        return float(self._ways.done[-1]) - used_wh > _TOO_MUCH * self._above_wh


class PartSearch:
    """The search for the parts of one mission, given its check in one flight."""

    def __init__(
        self, flown: FlownItems, setup: Setup, whole: CheckResult, on_step: Callable[[str], None]
    ) -> None:
        self.refusal = ""
        self._flown = flown
        self._setup = replace(setup, with_trace=False)
        self._on_step = on_step
        self._whole = whole
        self._tried: dict[Range, _Trial] = {}
        battery, assessment = whole.battery, whole.assessment
        self._above_wh = None if battery is None else battery.usable_wh - battery.reserve_wh
        self._whole_wh = whole.totals.energy_wh
        self._forecast = None
        if self._above_wh and assessment is not None and assessment.vehicle.is_power_known:
            self._forecast = _Forecast(self._ways[1], self._above_wh)

    @cached_property
    def _ways(self) -> tuple[_Ways, _Ways]:
        """The time and the energy of the flight in one piece. [s], [Wh]"""
        whole = self._whole.assessment
        assert whole is not None  # as for `ranges`
        returns = whole.returns
        points = returns.end_points(returns.stage_ends)
        way_s, way_wh = returns.fly(points.stop_m, points.stage, HOME)
        every = np.arange(len(whole.route.stages))
        # a stage without a segment is done with the one before
        time, energy = (
            _Ways(
                flown=self._flown,
                done=np.interp(every, points.stage, done),
                home=np.interp(every, points.stage, home),
            )
            for done, home in (
                (points.time_s, points.stop_s + way_s),
                (points.used_wh, points.stop_wh + way_wh),
            )
        )
        return time, energy

    def fewest(self) -> int:
        """Return a number of parts below which the energy of the mission alone does not go."""
        return 1 if self._above_wh is None else math.ceil(self._whole_wh / self._above_wh)

    def fewest_ranges(self) -> list[Range] | None:
        """Return the fewest parts; ``None`` with a `refusal`: there are none."""
        ranges = self.ranges(inside_legs=False)
        if ranges is None or len(ranges) > self.fewest():
            finer = self.ranges(inside_legs=True)
            if finer is not None and (ranges is None or len(finer) < len(ranges)):
                return finer
        return ranges

    def ranges(self, *, inside_legs: bool) -> list[Range] | None:
        """Return where each part begins and ends; ``None`` with a `refusal` where one does not fit."""
        if self.fewest() > _MOST_PARTS:
            self._refuse_so_many()
            return None
        cuts = split_points(self._flown, inside_legs=inside_legs)
        forecast = self._forecast if cuts else None
        if forecast is not None:
            forecast.ending_at(cuts)
        found: list[Range] = []
        start: SplitPoint | None = None
        first = 0
        while True:
            is_last = forecast is None or not forecast.is_rest_too_much(start)
            if is_last and self._trial(start, None).goes:
                return [*found, (start, None)]
            end = self._farthest(start, cuts, first, forecast)
            if end is None:
                self._refuse(start, cuts[first] if first < len(cuts) else None)
                return None
            if len(found) + 1 >= _MOST_PARTS:
                self._refuse_so_many()
                return None
            found.append((start, cuts[end]))
            where = "inside legs too" if inside_legs else "between items"
            self._on_step(
                f"cutting {where}: {quantity.count(len(found), 'part')}, up to item "
                f"{self._flown.numbers[cuts[end].step]} of {len(self._flown.mission.items)}"
            )
            start = resumption(self._flown, cuts[end])
            first = end + 1

    def even(self, count: int) -> list[Range] | None:
        """Return so many parts, as even in time as the places between items allow.

        Fewer where there are not so many places; ``None`` with a `refusal` where one would be no go.
        """
        assessment = self._whole.assessment
        assert assessment is not None  # as for `ranges`
        cuts = split_points(self._flown, inside_legs=False)
        starts = [None, *(resumption(self._flown, cut) for cut in cuts)]
        times = self._ways[0]
        until_s = [sum(times.at(cut)) for cut in cuts]
        ends_s = np.maximum.accumulate([*until_s, assessment.flight.time_s])
        begun_s = np.array([times.saved(start) for start in starts])

        def places(most_s: float) -> list[int]:
            """Return where each part ends, which is as far as the time allows."""
            found: list[int] = []
            at = 0
            while at < len(ends_s):
                reach = int(np.searchsorted(ends_s, most_s + begun_s[at], side="right"))
                at = max(reach, at + 1)
                found.append(at - 1)
            return found

        low_s, high_s = 0.0, float(ends_s[-1])
        for _ in range(_HALVINGS):
            middle_s = 0.5 * (low_s + high_s)
            is_enough = len(places(middle_s)) <= count
            low_s, high_s = (low_s, middle_s) if is_enough else (middle_s, high_s)
        ends = places(high_s)
        ranges = [
            (starts[first], cuts[last] if last < len(cuts) else None)
            for first, last in zip([0, *(end + 1 for end in ends)], ends, strict=False)
        ]
        if not all(self._trial(*one).goes for one in ranges):
            self.refusal = (
                f"{self._flown.mission.source}: cannot be split into {count} even parts: not each of "
                "them is a go"
            )
            return None
        return ranges

    def _farthest(
        self,
        start: SplitPoint | None,
        cuts: list[SplitPoint],
        first: int,
        forecast: _Forecast | None,
    ) -> int | None:
        """Return the last cut that a part may end at; ``None``: none.

        What the flight in one piece takes says where to look, and each check how far that is off.
        """
        low, high = first - 1, len(cuts)
        stride = 1
        for tries in range(len(cuts) - first + 1):
            if high - low <= 1:
                break
            place = (low + high) // 2
            if tries < _GUESSES:
                place = low if forecast is None else forecast.reach(start)
                if low >= first and high < len(cuts) and not low < place < high:
                    place = (low + high) // 2
                elif not low < place < high:
                    place = low + stride if place <= low else high - stride
                    stride *= 2
                place = min(max(place, low + 1), high - 1)
            trial = self._trial(start, cuts[place])
            low, high = (place, high) if trial.fits else (low, place)
            if forecast is not None:
                forecast.learn(start, place, trial.margin_wh)
        if forecast is not None and high < len(cuts):
            forecast.aim(self._trial(start, cuts[high]).margin_wh)
        for end in range(low, max(low - _TRIES, first - 1), -1):
            if self._trial(start, cuts[end]).goes:
                return end
        return None

    def _trial(self, start: SplitPoint | None, end: SplitPoint | None) -> _Trial:
        if (start, end) not in self._tried:
            result = self._check(start, end)
            failing = _failing(result)
            margins_wh = [
                one.margin_wh
                for one in (result.battery, result.return_plan)
                if one is not None and one.margin_wh is not None
            ]
            self._tried[start, end] = _Trial(
                fits=not any(one.code in MENDED for one in failing),
                goes=not failing,
                margin_wh=min(margins_wh, default=None),
            )
        return self._tried[start, end]

    def _check(self, start: SplitPoint | None, end: SplitPoint | None) -> CheckResult:
        part = mission_part(self._flown, start, end, name=self._flown.mission.source)
        return check_mission(part.mission, self._setup)

    def _refuse_so_many(self) -> None:
        self.refusal = (
            f"{self._flown.mission.source}: cannot be split: it takes more than {_MOST_PARTS} flights; "
            "what would help is a larger battery or a smaller reserve"
        )

    def _refuse(self, start: SplitPoint | None, end: SplitPoint | None) -> None:
        result = self._check(start, end)
        battery, totals = result.battery, result.totals
        flying = self._flown.flying
        places = [
            one for one in flying if self._flown.stage(one).kind not in LANDED_STAGES
        ] or flying
        step = end.step if end is not None and end.fraction else places[-1]
        if end is not None and not end.fraction:
            step = max(one for one in flying if one < end.step)
        elif start is not None and end is None:
            step = start.step
        number = self._flown.numbers[step]
        failing = _failing(result)
        others = [one for one in failing if one.code not in MENDED - _BOUNDED]
        why = "".join(f": {one.code} {one.message}" for one in others[:1])
        if battery is not None and not others:
            why = "".join(f": {one.message}" for one in failing[:1])
            if battery.margin_wh < 0.0:
                left_wh = battery.usable_wh - battery.reserve_wh
                why = (
                    ": with the way there and home it takes "
                    f"{quantity.beside(totals.energy_wh, left_wh, quantity.energy)}, the battery has "
                    f"{quantity.energy(left_wh)} above the reserve: "
                    f"{quantity.energy(-battery.margin_wh)} short"
                )
        helps = "a larger battery, a smaller reserve, another speed (mavjoule speed), or a home nearer to it"
        if self._flown.stage(step).hold_s > totals.time_s / 2.0:
            helps = "a shorter hold there, a larger battery, or a smaller reserve"
        self.refusal = (
            f"{self._flown.mission.source}: cannot be split: not even the shortest flight to "
            f"item {number} is a go{why}; what would help is {helps}"
        )


def _failing(result: CheckResult) -> list[Finding]:
    """Return what a part must not have: whatever makes it a no-go, and more than --risk."""
    return [
        one
        for one in result.findings
        if one.severity >= result.setup.fail_on or one.code == RESERVE_AT_RISK.code
    ]


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


class Split(Presented):
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
    mission, vehicle
        As `planner.read_mission` and `planner.load_vehicle` return them.
    folder : Path or str
        Where the parts are to be written, for their names.
    on_step : callable
        Called with how far the search is, in words.
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
    return split_under(mission, Setup(vehicle, **options), folder=folder, on_step=on_step)


def split_under(
    mission: Mission,
    setup: Setup,
    *,
    parts: int | None = None,
    folder: Path | str = "",
    on_step: Callable[[str], None] = lambda _: None,
) -> Split:
    """Return the flights that together fly a mission under a setup; see `split_mission`.

    The fewest, or so many ``parts`` as even in time as they can be.
    """
    if setup.speed_m_s is not None:
        mission = mission_at_speed(mission, setup.speed_m_s)
        setup = replace(setup, speed_m_s=None)
    whole = check_mission(mission, setup)
    _refuse_not_mended(whole)
    assessment = whole.assessment
    assert assessment is not None  # else nothing is flown, an error, and it is refused
    dialect = None if assessment.target is None else assessment.target.autopilot
    flown = flown_items(mission, assessment.route, dialect)
    search = PartSearch(flown, setup, whole, on_step)
    ranges = search.fewest_ranges() if parts is None else search.even(parts)
    if ranges is None:
        raise SplitError(search.refusal)
    before = [None, *(end for _, end in ranges)]
    files = [str(Path(folder) / f"part-{number:02}.plan") for number in range(1, len(ranges) + 1)]
    made = [
        _written(flown, ends, after, file, setup)
        for ends, after, file in zip(ranges, before, files, strict=False)
    ]
    written = [part for part, _ in made]
    losses = {finding.code: finding for _, lost in reversed(made) for finding in lost}
    return Split(
        file=mission.source,
        whole=whole,
        parts=tuple(written),
        findings=(*_remarks(flown, written), *_left_switched(flown, ranges), *losses.values()),
    )


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
    if own := [path for path in paths if is_among(path, [split.file])]:
        msg = f"{own[0]} is the mission that is split: give another folder"
        raise UsageError(msg)
    make_output_folder(folder, holding="parts")
    write_output_files({path: part.text for path, part in zip(paths, split.parts, strict=True)})


def _refuse_not_mended(whole: CheckResult) -> None:
    """Raise where something is wrong that flying less at once does not mend."""
    for finding in whole.findings:
        if finding.severity >= whole.setup.fail_on and finding.code not in MENDED:
            item = "" if finding.item is None else f" (item {finding.item})"
            what = f"{finding.code} {finding.name}{item}: {finding.message}"
            if catalogue.entries()[finding.code].leaves_open:
                msg = f"{whole.file}: cannot be split before it is checked: {what}; {finding.fix}"
            else:
                msg = f"{whole.file}: splitting does not help against {what}; correct that first"
            raise SplitError(msg)


def _written(
    flown: FlownItems, ends: Range, after: SplitPoint | None, file: str, setup: Setup
) -> tuple[SplitPart, tuple[Finding, ...]]:
    """Return a part as it is written, checked once more as it reads back, and what that loses."""
    start, end = ends
    made = mission_part(flown, start, end, name=file)
    conversion = convert_mission(made.mission, MissionFormat.PLAN)
    text = conversion.text
    result = check_mission(read_plan_text(text, source=file), setup)
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


LEFT_SWITCHED = Rule(
    "L214 left-switched",
    Severity.WARNING,
    summary="A part of a split mission leaves the fence or the parachute switched for the next one.",
    why="A vehicle that is not restarted keeps what a mission switched in flight: on its way out the next "
    "part would be without the fence it is checked against, or held to one it is not.",
    how="DO_FENCE_ENABLE or DO_PARACHUTE in what a part but the last flies, other than what the mission "
    "sets before its take-off, which each part sets there too.",
    fix="restart the vehicle between the parts, or switch it back by hand before each",
)


def _left_switched(flown: FlownItems, ranges: Sequence[Range]) -> Iterator[Finding]:
    """Yield the first thing that a part leaves switched for the next."""
    at_takeoff = flown.states[flown.first].items
    for number, (_, end) in enumerate(ranges, start=1):
        if end is None:
            continue
        left = [one for one in flown.states[end.step].protection() if one not in at_takeoff]
        if left:
            yield LEFT_SWITCHED.finding(
                f"{command_name(left[0].command)} {left[0].param1 or 0.0:g} stays in force after part "
                f"{number}: the way out of the next is checked without",
                item=flown.numbers[flown.items.index(left[0])],
            )
            return


def _remarks(flown: FlownItems, parts: list[SplitPart]) -> Iterator[Finding]:
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
        items = zip(flown.numbers, flown.items, strict=True)
        first = next(number for number, item in items if is_output(item))
        yield OUTPUTS_SET_AGAIN.finding(
            f"{quantity.count(len(outputs), 'output')} (servo, relay or the like) set again where the "
            "next part begins; the state is kept on the return",
            item=first,
        )
