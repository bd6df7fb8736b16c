"""Every rule that judges a flight, found where it is declared, and the list of what was checked."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from planner import catalogue
from planner.findings import Finding, Rule, Severity
from planner.rules.declaration import (
    ARDUPILOT_TARGET,
    BUDGET,
    DRAWN,
    FENCE,
    FETCHED,
    OTHER_WAYS,
    PACK,
    PARAMETERS,
    PROFILE,
    SEVERAL_TERRAINS,
    TARGET,
    TERRAIN,
    Check,
    Need,
    NotEvaluated,
)
from planner.rules.ledger import LedgerEntry, ledger_entry, one_entry_each

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment
    from planner.rules.declaration import Found
    from planner.selection import Selection
    from planner.setup import Setup
    from planner.vehicle.parameters.resolve import FlightParameters

SUBJECTS: Mapping[str, tuple[Need[Any], ...]] = {
    "energy": (),
    "battery": (PACK,),
    "model": (),
    "fetched_pair": (FETCHED,),
    "lift": (),
    "wind": (),
    "structure": (),
    "altitude": (),
    "left_open": (),
    "fence": (FENCE,),
    "fence_height": (FENCE,),
    "px4_fence": (FENCE,),
    "drawn_areas": (DRAWN,),
    "feasibility": (TARGET,),
    "payload_place": (ARDUPILOT_TARGET,),
    "failsafe": (PARAMETERS, BUDGET),
    "further_monitors": (PARAMETERS, BUDGET),
    "battery_arming": (PARAMETERS, BUDGET),
    "rally": (PARAMETERS,),
    "mission_landing": (PARAMETERS,),
    "way_back": (PARAMETERS,),
    "takeoff_speed": (PARAMETERS,),
    "needed_heading": (PARAMETERS,),
    "acceptance_radius": (PARAMETERS,),
    "arming": (PARAMETERS,),
    "ground_wait": (),
    "control": (PARAMETERS,),
    "terrain": (),
    "terrain_returns": (),
    "terrain_posts": (TERRAIN,),
    "landing_ground": (TERRAIN,),
    "touchdown": (PARAMETERS,),
    "overlapping_terrain": (SEVERAL_TERRAINS,),
    "followed_ground": (BUDGET,),
    "own_ways": (OTHER_WAYS,),
    "site": (PROFILE,),
}
"""The modules with rules, each with what all of them need: it is imported only where that is there."""

RULE_NOT_EVALUATED = Rule(
    "X904 rule-not-evaluated",
    Severity.ERROR,
    summary="A parameter or an item in use asks for a check that could not be made.",
    why="A rule that cannot be evaluated says nothing, and silence reads as approval: voltage "
    "failsafes went unchecked because the battery was given by its energy alone.",
    how="A rule meets a parameter of --params, or an item of the mission, that it cannot judge with "
    "what is known.  What was checked and what was not is listed in every report.",
    fix="give what is missing",
    instead="what the message names",
    leaves_open=True,
)


def judge(
    a: Assessment, selection: Selection
) -> tuple[tuple[Finding, ...], tuple[LedgerEntry, ...]]:
    """Return what every rule finds, those off by default where selected, and what was checked."""
    findings: list[Finding] = []
    entries: list[LedgerEntry] = []
    for subject, needs in SUBJECTS.items():
        missing = next((need for need in needs if need.of(a) is None), None)
        if missing is not None:
            entries += _unjudged_entries(subject, missing)
            continue
        for check in checks_of(subject):
            if not is_asked(check, selection):
                entries += _unasked_entries(check)
            elif found := check(a):
                entries += _entries_of(check, found)
                findings += reported(a, found)
            else:
                entries += _check_entries(check, None)
    return tuple(findings), one_entry_each(entries)


def is_asked(check: Check, selection: Selection) -> bool:
    """Return whether a check is made: one that is off by default where it is selected."""
    return _is_default(check) or any(selection.asks_for(rule.code) for rule in check.rules)


def reported(a: Assessment, found: Need[Any] | tuple[Found, ...]) -> tuple[Finding, ...]:
    """Return what a check comes to as findings: that it could not be made is one."""
    if isinstance(found, Need):
        return ()
    return tuple(_not_evaluated(a, one) if isinstance(one, NotEvaluated) else one for one in found)


@cache
def checks_of(subject: str) -> tuple[Check, ...]:
    """Return the checks of a module, in the order of the module."""
    # At once: a warning of numpy in another thread adds to what a module holds (__warningregistry__).
    declared = tuple(vars(import_module(f"planner.rules.{subject}")).values())
    return tuple(one for one in declared if isinstance(one, Check))


@cache
def _is_default(check: Check) -> bool:
    return any(rule.is_default for rule in check.rules)


def _entries_of(check: Check, found: Need[Any] | tuple[Found, ...]) -> tuple[LedgerEntry, ...]:
    """Return the entries of a check by what it has come to."""
    if isinstance(found, Need):
        return _check_entries(check, found)
    lacks = [one for one in found if isinstance(one, NotEvaluated)]
    return _check_entries(check, None) + tuple(
        ledger_entry(rule.code, rule.name, one) for one in lacks for rule in (one.rule, *one.also)
    )


@cache
def _check_entries(check: Check, missing: Need[Any] | None) -> tuple[LedgerEntry, ...]:
    return tuple(ledger_entry(rule.code, rule.name, missing) for rule in check.rules)


@cache
def _unasked_entries(check: Check) -> tuple[LedgerEntry, ...]:
    return tuple(
        ledger_entry(rule.code, rule.name, f"--extend-select {rule.code}") for rule in check.rules
    )


@cache
def _unjudged_entries(subject: str, missing: Need[Any]) -> tuple[LedgerEntry, ...]:
    """Return the entries of the rules of a module, which is not imported: all lack the same."""
    return tuple(
        ledger_entry(code, one.name, missing)
        for code, one in catalogue.entries().items()
        if one.module == f"planner.rules.{subject}"
    )


def _not_evaluated(a: Assessment, lack: NotEvaluated) -> Finding:
    return a.finding(
        RULE_NOT_EVALUATED,
        f"{lack.asked_by} cannot be checked ({lack.rule.title}): needs {lack.needs}",
        item=lack.item,
        about=lack.rule.code,
    )


def judge_unflown(
    mission: Mission, setup: Setup, parameters: FlightParameters | None
) -> Iterator[Finding]:
    """Yield what is found in a mission that flies nowhere: that no vehicle is named, and in its fence."""
    from planner.rules.model import unnamed_vehicle

    yield from unnamed_vehicle(setup)
    if mission.fence:
        from planner.rules.fence import fence_alone

        yield from fence_alone(mission, setup.flown_by, parameters)
