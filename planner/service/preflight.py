"""The pre-flight check, the main job: predict a mission, then judge it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal, TypeAlias, TypeVar

from planner import catalogue, quantity
from planner.arrays import keep_freed_memory
from planner.autopilot import Autopilot
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
from planner.flight.returns.destination import make_destinations, with_own_returns
from planner.flight.returns.path import make_returns
from planner.flight.returns.tightest import plan_returns, return_limits_wh, sweep_returns_each
from planner.mission.files import read_mission
from planner.mission.items import MissionFormat
from planner.mission.route.route import NOTHING_TO_FLY
from planner.mission.takers import BOTH, unless_named
from planner.physics.atmosphere import standard_temperature_c
from planner.presented import PresentedCheck
from planner.rules.assessment import Assessment
from planner.rules.energy import off_the_mean
from planner.rules.ledger import one_entry_each
from planner.rules.registry import judge, judge_unflown
from planner.service.other_flights import flown_by, off_their_means, other_flights
from planner.service.preparation import over_its_ground, prepare
from planner.setting import taking_settings
from planner.setup import Setup
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
    findings, checked = (
        (_unflown(prepared), ())
        if assessment is None
        else _whoever_flies(prepared, assessment, steps)
    )
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


def _unflown(prepared: Preparation) -> list[Finding]:
    """Return what is found of a mission that does not move the vehicle."""
    return [
        *prepared.findings,
        *((NOTHING_TO_FLY.finding(_STANDS),) if prepared.route.stages else ()),
        *judge_unflown(prepared.mission, prepared.setup, prepared.own_parameters),
    ]


Judged: TypeAlias = "tuple[list[Finding], tuple[LedgerEntry, ...]]"


def _judged(prepared: Preparation, assessment: Assessment, steps: Steps) -> Judged:
    """Return what is found of a mission as one autopilot flies it, and what was checked."""
    found, checked = steps.judge(assessment, prepared.setup.selection)
    findings = [*assessment.findings, *found]
    for other, note in other_flights(prepared, assessment, at_own_speeds=steps.judges_file):
        flown = assess(other)
        if flown is not None:
            findings += _decided_by(flown, findings, note)
    return [*findings, *_at_two_deviations(prepared, assessment, findings)], checked


def _by_others(
    prepared: Preparation, assessment: Assessment, steps: Steps
) -> Iterator[tuple[Autopilot, Judged]]:
    """Yield who may fly a mission too, where nobody is named, and what is found and checked of its flight."""
    mission = prepared.mission
    if assessment.named is not None or mission.file_format is MissionFormat.FOREIGN:
        return
    assumed = None if assessment.target is None else assessment.target.autopilot
    for by in (one for one in BOTH if one in (assessment.may_fly or BOTH) and one is not assumed):
        own = steps.by(by)
        again = own.prepare(mission, flown_by(by, prepared.setup))
        other = own.assess(again) if again.route.stages else None
        yield by, (_unflown(again), ()) if other is None else _judged(again, other, own)


_AT_THE_DESK = frozenset({"M110", "M126"})
"""What shows as a mission is uploaded, where whoever refuses it does not fly it; told of both already."""


def _whoever_flies(prepared: Preparation, assessment: Assessment, steps: Steps) -> Judged:
    """Return what is found of a mission, and what was checked: a go holds whoever flies it.

    Where one autopilot alone flies what is found, it is said which, and that another may be named.
    """
    findings, checked = _judged(prepared, assessment, steps)
    if _is_refused(prepared, findings):
        return findings, checked
    entries = [] if assessment.target is None else [*checked]
    for by, (judged, also) in _by_others(prepared, assessment, steps):
        entries += also
        for one in _further(judged, findings, prepared.setup):
            if one.code not in _AT_THE_DESK:
                said = (
                    one.message
                    if by.label in one.message
                    else f"{one.message} (flown by {by.label})"
                )
                findings.append(replace(one, message=unless_named(said, assessment.may_fly)))
    return findings, one_entry_each(entries) if entries else checked


def _is_refused(prepared: Preparation, found: Sequence[Finding]) -> bool:
    """Return whether an error is reported, that no setting keeps out of the report."""
    reported, _ = prepared.setup.selection.divide(found, file=prepared.mission.source)
    return any(one.severity is Severity.ERROR for one in reported)


_LIMITS = frozenset({"E103", "E104", "E110", "E114", "E116", "E120", "E122", "E133"})
"""What is past these comes down or flies elsewhere, however much energy is left."""
_NOT_COUNTED = frozenset({"E108"})
"""Of what a model does not count: what it counts is drawn (E119, E124)."""


def _at_two_deviations(
    prepared: Preparation, assessment: Assessment, found: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield the errors by the limits of the vehicle and its battery two standard deviations off a mean.

    What conditions take of the energy is drawn (E119, E124) where it can be, what gusts do is judged as they
    are.
    """
    if _is_refused(prepared, found):
        return
    wind, vehicle = prepared.setup.wind, prepared.setup.vehicle
    for setup, note, sds in off_their_means(prepared.setup):
        # Nothing is drawn about these: a model without a spread has nothing to draw by.
        alone = replace(setup, vehicle=replace(vehicle, spread=None))
        again = assess(prepare(prepared.mission, alone))
        if again is None:
            continue
        is_counted = setup.wind is not wind and setup.vehicle.knows_airspeed
        codes = _LIMITS if is_counted else _LIMITS | _NOT_COUNTED
        yield from _decided_by(again, found, note, codes=codes)
        yield from off_the_mean(assessment, again, note, sds=sds)


def _decided_by(
    other: Assessment, found: Sequence[Finding], note: str, *, codes: Container[str] | None = None
) -> Iterator[Finding]:
    """Yield what is found of another flight that decides the verdict as well, of some codes alone."""
    judged, _ = judge(other, other.setup.selection)
    for one in _further((*other.findings, *judged), found, other.setup):
        if codes is None or one.code in codes:
            yield replace(one, message=f"{one.message} ({note})")


def _further(
    judged: Iterable[Finding], found: Sequence[Finding], setup: Setup
) -> Iterator[Finding]:
    """Yield what decides the verdict, and is graver than what is found of its code already."""
    known = {one.code: one.severity for one in sorted(found, key=lambda one: one.severity)}
    yield from (
        one
        for one in judged
        if one.severity >= setup.fail_on
        and (one.code not in known or one.severity > known[one.code])
    )


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
