"""The pre-flight check, the main job: predict a mission, then judge it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import contextmanager
from itertools import product
from typing import TYPE_CHECKING, Literal, TypeAlias, TypeVar

from planner import catalogue, quantity
from planner.arrays import keep_freed_memory
from planner.autopilot import Autopilot, Target
from planner.errors import (
    CheckFailedError,
    MavjouleError,
    MissionFileError,
    NoMissionFileError,
    OtherVehicleError,
    bug_text,
    missing_library,
)
from planner.findings import Rule, Severity
from planner.flight.budget import NOTHING_FLOWN, flight_batteries
from planner.flight.pilot import make_pilot
from planner.flight.prediction import predict_flight, sample_trace
from planner.flight.reach import GUST_SDS
from planner.flight.returns.destination import make_destinations, with_own_returns
from planner.flight.returns.path import make_returns
from planner.flight.returns.tightest import plan_returns, return_limits_wh, sweep_returns_each
from planner.mission.files import read_mission
from planner.mission.route.route import NOTHING_TO_FLY
from planner.mission.takers import BOTH, unless_named
from planner.physics.atmosphere import standard_temperature_c
from planner.presented import PresentedCheck
from planner.quantity import mean_of, sd_of
from planner.rules.assessment import Assessment
from planner.rules.energy import off_the_mean
from planner.rules.registry import judge, judge_unflown
from planner.service.preparation import over_its_ground, prepare
from planner.setting import Number, taking_settings
from planner.setup import Setup, settings
from planner.values import Value, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterable, Iterator
    from pathlib import Path

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget, FlightBattery, Totals
    from planner.flight.pilot import Pilot
    from planner.flight.prediction import ItemArrival, Segment, Trace
    from planner.flight.returns.path import Returns
    from planner.flight.returns.tightest import ReturnPlan, ReturnSweep
    from planner.flight.uncertainty import Scenarios
    from planner.mission.items import Mission
    from planner.rules.ledger import LedgerEntry
    from planner.selection import Selection
    from planner.service.preparation import Preparation
    from planner.vehicle.model import ModelSpread
    from planner.vehicle.parameters.resolve import FlightParameters

Verdict = Literal["go", "no-go"]
VerdictText = Literal["GO", "NO-GO", "NOT CHECKED"]


class CheckResult(PresentedCheck):
    """What the check of one mission comes to: what is predicted, the findings and the verdict."""

    file: str
    verdict: Verdict
    setup: Setup
    """As it was flown: with the altitude of home, the temperature and the position noise."""
    totals: Totals
    battery: BatteryBudget | None
    return_plan: ReturnPlan | None
    segments: Sequence[Segment]
    items: tuple[ItemArrival, ...]
    findings: tuple[Finding, ...]
    """Worst first, then by item."""
    suppressed: tuple[Finding, ...] = ()
    """Findings kept out of the report and of the verdict, each with the reason."""
    parameters: FlightParameters | None = None
    """What the autopilot was taken to fly with, each value with its origin."""
    trace: Trace | None = None
    """The flight sampled over time, where it was asked for and something is flown."""
    assessment: Assessment | None = None
    """Everything the rules looked at; ``None`` where nothing is flown."""
    checked: tuple[LedgerEntry, ...] = ()
    """What became of each rule, by its code; none where nothing is flown."""

    def __reduce__(self) -> tuple[Callable[..., CheckResult], tuple[object, ...]]:
        """Return how it travels to another process: without what is predicted there again."""
        from planner.service.shipment import packed

        return packed(self)

    def __repr__(self) -> str:
        """Return file, verdict, figures and how much was found, in a line."""
        totals = self.totals
        errors, warnings = (
            sum(one.severity is severity for one in self.findings)
            for severity in (Severity.ERROR, Severity.WARNING)
        )
        figures = (
            quantity.duration(totals.time_s),
            quantity.distance(totals.distance_m),
            quantity.energy(totals.energy_wh),
            quantity.count(errors, "error"),
            quantity.count(warnings, "warning"),
        )
        return f"<CheckResult {self.file}: {self.verdict_text}, {', '.join(figures)}>"

    @property
    def verdict_text(self) -> VerdictText:
        """The verdict as it is printed."""
        return verdict_text(self.verdict, self.findings, self.setup.fail_on)


class UnreadableMission(PresentedCheck):
    """A mission that nothing is predicted of, as its file cannot be read or its check failed; never a go."""

    file: str
    findings: tuple[Finding, ...]
    """X901 file-unreadable, or X905 check-failed."""
    verdict: Literal["no-go"] | None = None
    """``None`` where the file cannot be read."""
    verdict_text: VerdictText = "NOT CHECKED"
    failure: str = ""
    """Traceback of a check that failed."""
    suppressed: tuple[Finding, ...] = ()
    """Nothing ever is: that a file cannot be read is always reported."""
    checked: tuple[LedgerEntry, ...] = ()
    """No rule was."""


Results: TypeAlias = Sequence[CheckResult | UnreadableMission]
T = TypeVar("T")


class Steps:
    """The steps of a check; who makes many checks may remember what theirs have come to."""

    judges_file = True
    """Whether a flight at another speed than the mission commands has to be possible at its own as well."""

    def prepare(self, mission: Mission, setup: Setup) -> Preparation:
        """Return what the flight of a mission is predicted from."""
        return prepare(mission, setup)

    def assess(self, prepared: Preparation) -> Assessment | None:
        """Return everything that is predicted of a flight; ``None``: nothing moves."""
        return assess(prepared)

    def counted(self, returns: Returns, setup: Setup) -> CountedPack:
        """Return what a flight and its returns come to with the pack of a setup."""
        [pack] = count_packs(returns, [setup])
        return pack

    def sample(
        self, returns: Returns, setup: Setup, spread: ModelSpread, sweep: ReturnSweep | None
    ) -> Scenarios:
        """Return what many flights of the mission take, whatever they fly on."""
        from planner.flight.uncertainty import sample_flights

        return sample_flights(returns, setup, spread=spread, sweep=sweep)

    def arrivals(self, assessment: Assessment) -> tuple[ItemArrival, ...]:
        """Return when every item is reached, and the energy used by then."""
        return assessment.items

    def judge(
        self, assessment: Assessment, selection: Selection
    ) -> tuple[tuple[Finding, ...], tuple[LedgerEntry, ...]]:
        """Return what every rule finds, and what was checked."""
        return judge(assessment, selection)

    def by(self, autopilot: Autopilot) -> Steps:  # noqa: ARG002 - nothing is remembered
        """Return the steps of the same check with an autopilot named."""
        return self


class WhatIfSteps(Steps):
    """The steps of a check that asks what a mission would come to at another speed, and sends nobody off."""

    judges_file = False


_STEPS = Steps()
_STANDS = "every item is where the vehicle stands: it never moves"


def check_mission(mission: Mission, setup: Setup, *, steps: Steps = _STEPS) -> CheckResult:
    """Predict a mission and judge it: the main job.

    Parameters
    ----------
    mission : Mission
        As `planner.read_mission` returns it.
    setup : Setup
        The vehicle, as `planner.load_vehicle` returns it, and everything else that counts.
    steps : Steps, optional
        Whoever remembers what other checks have come to.

    Returns
    -------
    CheckResult
        Verdict, totals, segments and findings.

    Raises
    ------
    MissionFileError
        If an item holds a number no vehicle can fly.
    UsageError
        If the model cannot be flown as asked, or a value is out of its range.
    """
    keep_freed_memory()
    prepared = steps.prepare(mission, setup)
    route, setup = prepared.route, prepared.setup
    assessment = steps.assess(prepared) if route.stages else None
    checked: tuple[LedgerEntry, ...] = ()
    if assessment is not None:
        findings, checked = _judged(prepared, assessment, steps)
        findings += _by_others(prepared, assessment, findings, steps)
    else:
        findings = [
            *prepared.findings,
            *((NOTHING_TO_FLY.finding(_STANDS),) if route.stages else ()),
            *judge_unflown(mission, setup, prepared.own_parameters),
        ]
    reported, suppressed = setup.selection.divide(findings, file=mission.source)
    temperature_c = setup.temperature_c
    if temperature_c is None:
        temperature_c = standard_temperature_c(route.home_amsl_m)
    return CheckResult(
        file=mission.source,
        verdict=verdict(reported, setup.fail_on),
        setup=replace(
            setup,
            home_amsl_m=route.home_amsl_m if route.knows_home_amsl else None,
            temperature_c=temperature_c,
        ),
        totals=NOTHING_FLOWN if assessment is None else assessment.totals,
        battery=None if assessment is None else assessment.battery,
        return_plan=None if assessment is None else assessment.return_plan,
        segments=() if assessment is None else assessment.flight.segments,
        items=() if assessment is None else steps.arrivals(assessment),
        findings=reported,
        suppressed=suppressed,
        parameters=prepared.parameters,
        trace=(
            sample_trace(assessment.flight, assessment.route)
            if setup.with_trace and assessment is not None
            else None
        ),
        assessment=assessment,
        checked=checked,
    )


def _judged(
    prepared: Preparation, assessment: Assessment, steps: Steps
) -> tuple[list[Finding], tuple[LedgerEntry, ...]]:
    """Return what is found of a mission as one autopilot flies it, and what was checked."""
    found, checked = steps.judge(assessment, prepared.setup.selection)
    findings = [*assessment.findings, *found]
    findings += _by_what_is_held_back(prepared, findings)
    findings += _over_known_terrain(prepared, findings)
    findings += _over_other_ground(prepared, assessment, findings)
    findings += _at_two_deviations(prepared, assessment, findings)
    if steps.judges_file:
        findings += _at_own_speeds(prepared, findings)
    return findings, checked


def _by_what_is_held_back(prepared: Preparation, found: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the errors of a flight only where speeds that may be carried out, or not, are the other way."""
    for other in prepared.route.others:
        yield from _further_errors(replace(prepared, route=other.route), found, other.note)


def _over_known_terrain(prepared: Preparation, found: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the errors of a flight only where ArduPilot knows the terrain, by which it flies to a landing.

    Whether it does no parameter says: TERRAIN_ENABLE allows it.  Both flights have to be possible.
    """
    terrain = prepared.setup.terrain
    if terrain is None or not getattr(prepared.parameters, "terrain_enable", 0):
        return
    from planner.flight.motion.followed_ground import following_to_land

    route = following_to_land(prepared.route, terrain)
    if route is not None:
        note = "with terrain data, by which ArduPilot flies to the landing"
        yield from _further_errors(replace(prepared, route=route), found, note)


def _over_other_ground(
    prepared: Preparation, assessment: Assessment, found: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield the errors of a flight only by those of overlapping terrain files that did not count."""
    terrain, setup = prepared.setup.terrain, prepared.setup
    if terrain is None or len(terrain.tiles) == 1:
        return
    from planner.rules.overlapping_terrain import others_around

    for other in others_around(assessment, terrain):
        again = prepare(prepared.mission, replace(setup, terrain=other.grid))
        yield from _further_errors(again, found, f"by the ground of {other.source}")


def _at_own_speeds(prepared: Preparation, found: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the errors of a mission at the speeds it commands, where it was predicted at another.

    The vehicle flies what is in the file.
    """
    if prepared.setup.speed_m_s is None:
        return
    from planner.mission.convert import SPEED_REPLACED

    if any(one.code == SPEED_REPLACED.code for one in prepared.findings):
        again = prepare(prepared.mission, replace(prepared.setup, speed_m_s=None))
        yield from _further_errors(again, found, "at the speeds of the file, which are flown")


_AT_THE_DESK = frozenset({"M110", "M126"})
"""What shows as a mission is uploaded, where whoever refuses it does not fly it; told of both already."""


def _by_others(
    prepared: Preparation, assessment: Assessment, found: Sequence[Finding], steps: Steps
) -> Iterator[Finding]:
    """Yield the errors of a mission as each autopilot would fly it that may, where nobody is named.

    A go holds whoever flies it.
    """
    setup = prepared.setup
    reported, _ = setup.selection.divide(found, file=prepared.mission.source)
    if assessment.named is not None or any(one.severity is Severity.ERROR for one in reported):
        return
    assumed = None if assessment.target is None else assessment.target.autopilot
    for by in (one for one in BOTH if one in assessment.may_fly and one is not assumed):
        own = steps.by(by)
        again = own.prepare(prepared.mission, flown_by(by, setup))
        other = own.assess(again)
        if other is not None:
            judged, _ = _judged(again, other, own)
            note = unless_named(f"flown by {by.label}", assessment.may_fly)
            further = _further(judged, found, note)
            yield from (one for one in further if one.code not in _AT_THE_DESK)


def flown_by(autopilot: Autopilot, setup: Setup) -> Setup:
    """Return a setup with an autopilot named: whose rules count for reference steps, else who flies."""
    if setup.flown_by is Autopilot.STEP:
        return replace(setup, target=Target(autopilot=autopilot))
    return replace(setup, autopilot=autopilot)


_LIMITS = frozenset({"E103", "E104", "E110", "E114", "E116", "E120", "E122", "E133"})
"""What is past these comes down or flies elsewhere, however much energy is left."""
_NOT_COUNTED = frozenset({"E108"})
"""Of what a model does not count: what it counts is drawn (E119, E124)."""
_BACKWARD_DEG = 180.0


def _at_two_deviations(
    prepared: Preparation, assessment: Assessment, found: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield the errors by the limits of the vehicle and its battery two standard deviations off a mean.

    What conditions take of the energy is drawn (E119, E124) where it can be, what gusts do is judged as they
    are.
    """
    reported, _ = prepared.setup.selection.divide(found, file=prepared.mission.source)
    if any(one.severity is Severity.ERROR for one in reported):
        return
    wind, vehicle = prepared.setup.wind, prepared.setup.vehicle
    for setup, note, sds in _off_their_means(prepared.setup):
        # Nothing is drawn about these: a model without a spread has nothing to draw by.
        alone = replace(setup, vehicle=replace(vehicle, spread=None))
        again = assess(prepare(prepared.mission, alone))
        if again is None:
            continue
        is_counted = setup.wind is not wind and setup.vehicle.knows_airspeed
        codes = _LIMITS if is_counted else _LIMITS | _NOT_COUNTED
        yield from _errors_of(again, found, note, codes=codes)
        yield from off_the_mean(assessment, again, note, sds=sds)


def _off_their_means(setup: Setup) -> Iterator[tuple[Setup, str, float]]:
    """Yield a setup with each uncertain condition off its mean, that in words, and by how many deviations.

    Then with all of them as far as makes two deviations together: limits may be near that no condition
    reaches alone.
    """
    worse = _worse_ends(setup)
    for ends in worse:
        for end in ends:
            other, words = end(setup, GUST_SDS)
            yield other, f"at {words}, two standard deviations from the mean", GUST_SDS
    if len(worse) > 1:
        sds = GUST_SDS / math.sqrt(len(worse))
        for ends_of_all in product(*worse):
            other, said = setup, []
            for end in ends_of_all:
                other, words = end(other, sds)
                said.append(words)
            each = f"each {quantity.decimals(sds, 1)} standard deviations from the mean"
            yield other, f"at {' and '.join(said)}, {each}", GUST_SDS
    wind = setup.wind
    if wind.from_sd_deg and wind.speed_m_s:
        for sds, many in ((1.0, "one standard deviation"), (GUST_SDS, "two standard deviations")):
            for side in (sds, -sds):
                if sds * wind.from_sd_deg <= _BACKWARD_DEG:  # farther off it is another's
                    from_deg = (wind.from_deg + side * wind.from_sd_deg) % 360.0
                    turned = replace(wind, from_deg=from_deg, from_sd_deg=0.0)
                    note = f"at wind from {from_deg:.0f}°, {many} from the mean"
                    yield replace(setup, wind=turned), note, sds


_End: TypeAlias = "Callable[[Setup, float], tuple[Setup, str]]"
"""Moves an uncertain condition so many deviations to one side; with what it is then, in words."""


def _worse_ends(setup: Setup) -> list[tuple[_End, ...]]:
    """Return the sides of each uncertain condition that may be the worse one."""

    def heavier(one: Setup, sds: float) -> tuple[Setup, str]:
        kg = _in_range("payload_kg", mean_of(setup.payload_kg) + sds * sd_of(setup.payload_kg))
        return replace(one, payload_kg=kg), f"{quantity.mass(kg)} of payload"

    def emptier(one: Setup, sds: float) -> tuple[Setup, str]:
        charge = max(mean_of(setup.charge) - sds * sd_of(setup.charge), 0.0)
        return replace(one, charge=charge), f"{quantity.percent(charge)} of the charge"

    def warmer(one: Setup, sds: float) -> tuple[Setup, str]:
        mean_c, sd_c = mean_of(setup.temperature_c or 0.0), sd_of(setup.temperature_c)
        air_c = _in_range("temperature_c", mean_c + sds * sd_c)
        return replace(one, temperature_c=air_c), quantity.temperature(air_c)

    def stronger(one: Setup, sds: float) -> tuple[Setup, str]:
        wind = setup.wind
        speed_m_s = max(wind.speed_m_s + sds * wind.speed_sd_m_s, 0.0)
        other = replace(wind, speed_m_s=speed_m_s, speed_sd_m_s=0.0)
        return replace(one, wind=other), f"{quantity.speed(speed_m_s)} of wind"

    def back(end: _End) -> _End:
        return lambda one, sds: end(one, -sds)

    return [
        ends
        for sd, ends in (
            (sd_of(setup.payload_kg), (heavier,)),
            (sd_of(setup.charge), (emptier,)),
            # thin air, or a cold battery; a wind against it, or from behind that is missed
            (sd_of(setup.temperature_c), (warmer, back(warmer))),
            (setup.wind.speed_sd_m_s, (stronger, back(stronger))),
        )
        if sd
    ]


def _in_range(key: str, number: float) -> float:
    """Return a number of a setting, or the nearest that may be given: no air is warmer than that."""
    kind = settings()[key].kind
    assert isinstance(kind, Number)
    return min(max(number, kind.low), kind.high)


def _further_errors(
    prepared: Preparation, found: Sequence[Finding], note: str
) -> Iterator[Finding]:
    """Yield the errors of another flight of a mission that are none of the first."""
    other = assess(prepared)
    if other is not None:
        yield from _errors_of(other, found, note)


def _errors_of(
    other: Assessment, found: Sequence[Finding], note: str, *, codes: Container[str] | None = None
) -> Iterator[Finding]:
    """Yield the errors of another flight of a mission that are none of the first, of some codes alone."""
    judged, _ = judge(other, other.setup.selection)
    for one in _further((*other.findings, *judged), found, note):
        if codes is None or one.code in codes:
            yield one


def _further(judged: Iterable[Finding], found: Sequence[Finding], note: str) -> Iterator[Finding]:
    """Yield the errors that are none of the first, with a note on when they are."""
    known = {one.code for one in found if one.severity is Severity.ERROR}
    for one in judged:
        if one.severity is Severity.ERROR and one.code not in known:
            yield replace(one, message=f"{one.message} ({note})")


check = taking_settings("check", check_mission, Setup)
"""`check_mission` with each setting as a keyword: ``check(mission, vehicle, charge=0.95)``."""


def assess(prepared: Preparation) -> Assessment | None:
    """Return everything that is predicted of a flight of at least one stage; ``None``: nothing moves."""
    prepared = over_its_ground(prepared)
    returns = fly(prepared)
    return None if returns is None else assess_flown(prepared, returns, _STEPS)


def fly(
    prepared: Preparation,
    *,
    pilot_of: Callable[[Setup, FlightParameters | None], Pilot] = make_pilot,
) -> Returns | None:
    """Return the flight of at least one stage, and how it can be broken off; ``None``: nothing moves.

    It does not depend on what charge the battery has, nor on what is judged.
    """
    setup = prepared.setup
    destinations = make_destinations(
        prepared.mission,
        prepared.route,
        prepared.own_parameters,
        terrain=setup.terrain,
        follows_mission=setup.flown_by is not Autopilot.STEP,
    )
    route = with_own_returns(prepared.route, destinations)
    pilot = pilot_of(setup, prepared.own_parameters)
    flight = predict_flight(route, setup, pilot)
    if not len(flight.motion.segments.item):
        return None
    return make_returns(route, flight, pilot, destinations)


class CountedPack(Value, eq=False):
    """What a flight and its returns come to with the pack it is flown with."""

    battery: FlightBattery
    sweep: ReturnSweep | None
    """``None``: the power is not known, or no point of the flight is in the air."""
    plan: ReturnPlan | None
    """``None`` as for the sweep."""


def count_packs(returns: Returns, setups: Sequence[Setup]) -> Iterator[CountedPack]:
    """Yield what a flight and its returns come to with the packs of setups that differ in these alone."""
    batteries = flight_batteries(returns.flight, setups)
    budgets = [one.budget for one in batteries]
    sweeps: Sequence[ReturnSweep | None] = [None] * len(setups)
    if setups[0].vehicle.is_power_known:
        sweeps = sweep_returns_each(returns, [return_limits_wh(one) for one in budgets])
    plans = plan_returns(returns, sweeps, budgets)
    for battery, sweep, plan in zip(batteries, sweeps, plans, strict=True):
        yield CountedPack(battery=battery, sweep=sweep, plan=plan)


def assess_flown(prepared: Preparation, returns: Returns, steps: Steps) -> Assessment:
    """Return everything that is predicted of a flight, from its motion and its power."""
    setup, flight = prepared.setup, returns.flight
    vehicle = setup.vehicle
    counted = steps.counted(returns, setup)
    battery, plan = counted.battery, counted.plan
    totals, budget = battery.totals, battery.budget
    if vehicle.spread is not None:
        from planner.flight.uncertainty import against_battery, spread_at_airspeeds

        spread = spread_at_airspeeds(vehicle.spread, flight)
        scenarios = against_battery(
            steps.sample(returns, setup, spread, counted.sweep),
            flight,
            setup,
            spread=spread,
            battery=battery.pack,
            budget=budget,
        )
        flight, totals, budget, plan = scenarios.added_to(flight, totals, budget, plan)
    found = (*prepared.findings, *flight.motion.findings, *returns.destinations.findings)
    given = field_values(prepared) | {"route": returns.route, "findings": found}
    return Assessment(
        **given,
        flight=flight,
        totals=totals,
        pack=battery.pack,
        discharge=battery.discharge,
        battery=budget,
        return_plan=plan,
        returns=returns,
    )


def verdict(findings: tuple[Finding, ...], fail_on: Severity) -> Verdict:
    """Return no-go where a finding is at least as severe as ``fail_on``."""
    return "no-go" if any(finding.severity >= fail_on for finding in findings) else "go"


def verdict_text(verdict: Verdict, findings: Iterable[Finding], fail_on: Severity) -> VerdictText:
    """Return a verdict as it is printed: NOT CHECKED where nothing is wrong but what was left open."""
    if verdict == "go":
        return "GO"
    deciding = [finding for finding in findings if finding.severity >= fail_on]
    open_codes = {code for code, entry in catalogue.entries().items() if entry.leaves_open}
    left_open = all(finding.code in open_codes for finding in deciding)
    return "NOT CHECKED" if deciding and left_open else "NO-GO"


def check_file(
    path: Path | str, setup: Setup, *, steps: Steps = _STEPS
) -> CheckResult | UnreadableMission:
    """Read a mission and check it; one that cannot be read is a result too.

    Raises UsageError if the model cannot be flown as asked.
    """
    return check_read(lambda: read_mission(path), setup, file=str(path), steps=steps)


FILE_UNREADABLE = Rule(
    "X901 file-unreadable",
    Severity.ERROR,
    summary="The mission file could not be read.",
    why="A mission that cannot be read cannot be judged; it is never a 'go'.",
    how="The reader refused the file; the message gives where and why.  The exit code is 2.",
    fix="correct the file, or save it again with the program that wrote it",
    instead="a file that can be read",
    leaves_open=True,
)


def check_read(
    read: Callable[[], Mission], setup: Setup, *, file: str, steps: Steps = _STEPS
) -> CheckResult | UnreadableMission:
    """Check a mission wherever it comes from; one that cannot be read is a result too.

    ``read`` returns the mission, or raises ``MissionFileError``; ``file`` is what the result calls the
    mission then.

    Raises UsageError if the model cannot be flown as asked.
    """
    try:
        return shielded(lambda: check_mission(read(), setup, steps=steps), file=file)
    except MissionFileError as error:
        fix = {
            OtherVehicleError: "give a multicopter's mission, or leave the file out (--exclude)",
            NoMissionFileError: "give the path of a mission file that can be read",
        }.get(type(error))
        # The report names the file and the place itself.
        message = str(error) if error.source != file else error.message
        if error.source == file and error.key is not None:
            message = f"{error.key}: {message}"
        finding = FILE_UNREADABLE.finding(message, place=error.place, fix=fix)
        return UnreadableMission(file=file, findings=(finding,))


CHECK_FAILED = Rule(
    "X905 check-failed",
    Severity.ERROR,
    summary="The check of the mission failed: a bug in mavjoule.",
    why="A mission whose check broke off was not judged; it is never a 'go', and never decides about the "
    "other missions of a call.",
    how="Something in the check of this mission, or in the report of it, failed in a way that nobody "
    "foresaw; with MAVJOULE_TRACEBACK=1 standard error has where.",
    fix="report it with the mission and what MAVJOULE_TRACEBACK=1 shows; do not fly on this check",
    instead="a mission that can be checked",
    leaves_open=True,
)


def shielded(
    check: Callable[[], CheckResult | UnreadableMission], *, file: str
) -> CheckResult | UnreadableMission:
    """Return what a check comes to; one that fails in a way that nobody foresaw is a result too."""
    try:
        return check()
    except MavjouleError:
        raise
    except Exception as error:  # noqa: BLE001 - a bug stays with its mission
        _refuse_without_library(error)
        return failed_check(file, error)


@contextmanager
def bugs_of(file: str) -> Iterator[None]:
    """Raise what nobody foresaw within as an error of a mission, which is called ``file``."""
    try:
        yield
    except MavjouleError:
        raise
    except Exception as error:
        _refuse_without_library(error)
        msg = f"{file}: {CHECK_FAILED.title}: {bug_text(error)}"
        raise CheckFailedError(msg) from error


def _refuse_without_library(error: Exception) -> None:
    """Raise what names the extra to install where that is all that is wrong."""
    missing = missing_library(error)
    if missing is not None:
        raise missing from error


def failed_check(file: str, error: Exception) -> UnreadableMission:
    """Return the result of a check that failed in a way that nobody foresaw."""
    from traceback import format_exception

    return UnreadableMission(
        file=file,
        findings=(CHECK_FAILED.finding(bug_text(error)),),
        verdict="no-go",
        failure="".join(format_exception(error)),
    )


def surviving(results: Results, make: Callable[[Results], T]) -> tuple[Results, T | None]:
    """Return what is made of results, and the results: those of which nothing can be made are failed checks.

    ``None`` is made where even failed checks fail.
    """
    try:
        return results, make(results)
    except MavjouleError:
        raise
    except Exception as error:  # noqa: BLE001 - as above
        failed = [_survivor(result, make) for result in results]
        if list(results) == failed:  # none by itself: only together
            failed = [failed_check(result.file, error) for result in results]
    try:
        return failed, make(failed)
    except Exception:  # noqa: BLE001 - as above
        return failed, None


def _survivor(
    result: CheckResult | UnreadableMission, make: Callable[[Results], object]
) -> CheckResult | UnreadableMission:
    try:
        make([result])
    except MavjouleError:
        return result
    except Exception as error:  # noqa: BLE001 - as above
        return failed_check(result.file, error)
    return result
