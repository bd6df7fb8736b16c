"""What a case comes to: one row of figures, from the check of its mission."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Self

from planner.errors import MavjouleError
from planner.service.preflight import CheckResult, Steps, check_mission, shielded
from planner.service.sweep.cases import case_setup
from planner.service.sweep.memory import CASES_AHEAD
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.fleet.fleet import Fleet
    from planner.mission.items import Mission
    from planner.service.preflight import UnreadableMission
    from planner.service.sweep.memory import RememberingSteps
    from planner.service.sweep.plan import SweepPlan
    from planner.setup import Setup


class CaseOutcome(Value, array_like=True):
    """The check of one case in figures; ``None`` where one is not known."""

    verdict: str | None
    """``go`` or ``no-go``; ``None``: not checked."""
    codes: str = ""
    """Of every finding reported, each once, worst first."""
    breaks_first: str = ""
    """Code of the first finding that decides: the worst, of these the one soonest along the mission."""
    breaks_first_item: int | None = None
    time_s: float | None = None
    distance_m: float | None = None
    energy_wh: float | None = None
    energy_wh_p10: float | None = None
    energy_wh_p90: float | None = None
    usable_wh: float | None = None
    margin_wh: float | None = None
    """Left above the reserve at the landing. [Wh]"""
    return_margin_wh: float | None = None
    """Left above the reserve after the tightest return. [Wh]"""
    below_reserve_probability: float | None = None
    lowest_voltage_v: float | None = None
    refused: str = ""
    """Why it could not be checked."""

    @property
    def least_margin_wh(self) -> float | None:
        """The less of the margins at the landing and after the tightest return. [Wh]"""
        known = [one for one in (self.margin_wh, self.return_margin_wh) if one is not None]
        return min(known, default=None)


def check_case(plan: SweepPlan, number: int, steps: Steps) -> CaseOutcome:
    """Return what the case of a number comes to; one that cannot be flown as asked is not checked."""
    return _check(plan, _Case.of(plan, number), steps)


def check_cases(plan: SweepPlan, numbers: range, steps: RememberingSteps) -> Iterator[CaseOutcome]:
    """Yield what cases that follow one another come to, as `check_case`."""
    for first in numbers[::CASES_AHEAD]:
        cases = [
            _Case.of(plan, number)
            for number in range(first, min(first + CASES_AHEAD, numbers.stop))
        ]
        steps.foresee([one.setup for one in cases if one.setup is not None])
        for one in cases:
            yield _check(plan, one, steps)


class _Case(Value, eq=False):
    """A case as it is to be checked."""

    mission: str
    """Its name."""
    values: Mapping[str, Any]
    """What varies, by the keys of settings."""
    setup: Setup | None = None
    """``None``: it is refused, or of a fleet, whose vehicles have setups of their own."""
    refused: str = ""

    @classmethod
    def of(cls, plan: SweepPlan, number: int) -> Self:
        """Return the case of a number."""
        values = plan.cases.values(number)
        name = values.pop("mission", None) or next(iter(plan.missions))
        for key, known in plan.loaded.items():
            values[key] = known[values[key]]
        if plan.fleet is not None:
            return cls(mission=name, values=values)
        try:
            return cls(mission=name, values=values, setup=case_setup(plan.setup, values))
        except MavjouleError as error:
            return cls(mission=name, values=values, refused=str(error))


def _check(plan: SweepPlan, case: _Case, steps: Steps) -> CaseOutcome:
    name, setup = case.mission, case.setup
    try:
        if plan.fleet is not None:
            return _check_fleet(plan.fleet, plan.missions, case.values)
        if setup is None:
            return CaseOutcome(verdict=None, refused=case.refused)
        # What a mission comes to at other speeds is asked where they vary; at one that is given it is judged.
        steps.judges_file = "speed_m_s" not in case.values
        return outcome_of(
            shielded(lambda: check_mission(plan.missions[name], setup, steps=steps), file=name)
        )
    except MavjouleError as error:
        return CaseOutcome(verdict=None, refused=str(error))


def _check_fleet(
    fleet: Fleet, missions: Mapping[str, Mission], values: Mapping[str, Any]
) -> CaseOutcome:
    """Return what a fleet comes to in the conditions of a case: its group, and its tightest sortie."""
    from planner.service.fleet import SortieChecks, check_fleet

    vehicles = {
        name: replace(one, setup=case_setup(one.setup, values))
        for name, one in fleet.vehicles.items()
    }
    flown = replace(fleet, vehicles=vehicles)
    result = check_fleet(flown, checks=SortieChecks(flown, missions))
    findings = result.all_findings
    fail_on = flown.group_setup.fail_on
    sorties = [outcome_of(one.result) for one in result.sorties]

    def least(name: str) -> float | None:
        return min((v for one in sorties if (v := getattr(one, name)) is not None), default=None)

    return CaseOutcome(
        verdict=result.verdict if result.is_readable else None,
        codes=",".join(dict.fromkeys(one.code for one in findings)),
        breaks_first=next((one.code for one in findings if one.severity >= fail_on), ""),
        time_s=result.totals.makespan_s,
        energy_wh=_known(result.totals.energy_wh) if result.totals.is_energy_whole else None,
        margin_wh=least("margin_wh"),
        return_margin_wh=least("return_margin_wh"),
        lowest_voltage_v=least("lowest_voltage_v"),
    )


def outcome_of(result: CheckResult | UnreadableMission) -> CaseOutcome:
    """Return the figures of a check."""
    findings = result.findings
    codes = ",".join(dict.fromkeys(one.code for one in findings))
    if not isinstance(result, CheckResult):
        return CaseOutcome(
            verdict=result.verdict,
            codes=codes,
            breaks_first=findings[0].code,
            refused=findings[0].message,
        )
    totals, budget, way_home = result.totals, result.battery, result.return_plan
    deciding = next((one for one in findings if one.severity >= result.setup.fail_on), None)
    return CaseOutcome(
        verdict=result.verdict,
        codes=codes,
        breaks_first="" if deciding is None else deciding.code,
        breaks_first_item=None if deciding is None else deciding.item,
        time_s=totals.time_s,
        distance_m=totals.distance_m,
        energy_wh=_known(totals.energy_wh),
        energy_wh_p10=_known(totals.energy_wh_p10),
        energy_wh_p90=_known(totals.energy_wh_p90),
        usable_wh=None if budget is None else _known(budget.usable_wh),
        margin_wh=None if budget is None else _known(budget.margin_wh),
        return_margin_wh=None if way_home is None else _known(way_home.margin_wh),
        below_reserve_probability=None
        if budget is None
        else _known(budget.below_reserve_probability),
        lowest_voltage_v=None if budget is None else _known(budget.lowest_voltage_v),
    )


def _known(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else value
