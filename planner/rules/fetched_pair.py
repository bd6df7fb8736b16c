"""A plan and parameters that were fetched from a vehicle, and belong together or not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.findings import Rule, Severity
from planner.rules.declaration import FETCHED, judges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.fetched import FetchMark
    from planner.findings import Finding
    from planner.rules.assessment import Assessment

PAIR_MIXED = Rule(
    "X908 pair-mixed",
    Severity.ERROR,
    summary="Plan and parameters were fetched apart, and the parameters changed between.",
    why="Speeds, climbs, the return and its failsafes are predicted from the parameters: with those of "
    "last week, or of another vehicle, the prediction is of a flight that nobody will see.",
    how="mavjoule fetch notes in both files the time, the vehicle and a check sum over the parameters "
    "that a vehicle does not change by itself.  Where the check sums differ: an error where the "
    "parameters are the older, a warning where the plan is, or where they are another vehicle's.  "
    "Files without the note are not compared.",
    fix="fetch both from the vehicle that flies, or give --params the file fetched with the plan",
    leaves_open=True,
)


@judges(PAIR_MIXED, needs=(FETCHED,))
def _pair_mixed(a: Assessment, marks: tuple[FetchMark, FetchMark]) -> Iterator[Finding]:
    plan, parameters = marks
    if plan.parameters == parameters.parameters:
        return
    severity = Severity.WARNING
    if plan.vehicle and parameters.vehicle and plan.vehicle != parameters.vehicle:
        text = (
            f"the parameters are those of autopilot {parameters.vehicle}; the plan was fetched from "
            f"autopilot {plan.vehicle}"
        )
    elif parameters.time > plan.time:
        text = (
            f"the plan is older than the parameters: fetched {plan.time} and {parameters.time}, and "
            "the vehicle's parameters changed between"
        )
    else:
        severity = Severity.ERROR
        text = (
            f"the parameters are older than the plan: fetched {parameters.time} and {plan.time}, and "
            "the vehicle's parameters changed between"
        )
    yield a.finding(PAIR_MIXED, text, severity=severity)
