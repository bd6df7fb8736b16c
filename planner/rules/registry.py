"""Every rule that judges a flight, found where it is declared."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from planner.rules.declaration import (
    BUDGET,
    FENCE,
    PARAMETERS,
    PROFILE,
    TARGET,
    TERRAIN,
    Check,
    Need,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment
    from planner.selection import Selection
    from planner.vehicle.parameters.resolve import FlightParameters

SUBJECTS: Mapping[str, tuple[Need[Any], ...]] = {
    "energy": (),
    "model": (),
    "structure": (),
    "altitude": (),
    "fence": (FENCE,),
    "feasibility": (TARGET,),
    "failsafe": (PARAMETERS, BUDGET),
    "terrain": (TERRAIN,),
    "site": (PROFILE,),
}
"""The modules with rules, each with what all of them need: it is imported only where that is there."""


def judge(a: Assessment, selection: Selection) -> tuple[Finding, ...]:
    """Return what every rule finds, those off by default where selected."""
    return tuple(
        finding
        for subject, needs in SUBJECTS.items()
        if all(need.of(a) is not None for need in needs)
        for check in checks_of(subject)
        if any(rule.is_default or selection.asks_for(rule.code) for rule in check.rules)
        for finding in check(a)
    )


def checks_of(subject: str) -> Iterator[Check]:
    """Yield the checks of a module, in the order of the module."""
    for value in vars(import_module(f"planner.rules.{subject}")).values():
        if isinstance(value, Check):
            yield value


def judge_unflown(
    mission: Mission, autopilot: Autopilot, parameters: FlightParameters | None
) -> tuple[Finding, ...]:
    """Return what is found in a mission that flies nowhere: in its fence."""
    if not mission.fence:
        return ()
    from planner.rules.fence import fence_alone

    return tuple(fence_alone(mission, autopilot, parameters))
