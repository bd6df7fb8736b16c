"""Ways of a vehicle's own autopilot, where its model of reference steps flies others.

The model stops at corners that the autopilot cuts, and climbs in place where that climbs along a leg.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.findings import Finding, Severity
from planner.flight.pilot import CONDITION_NOT_MODELLED, is_of_ardupilot
from planner.mission.route.stage import RETURN_STAGES, StageKind
from planner.rules.declaration import FENCE, PROFILE, Need, NotEvaluated, judges
from planner.rules.lateness import as_its_own_flies, own_flown_of
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Rule
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.resolve import FlightParameters

DELIVERED_RADIUS_M = 2.0
"""WPNAV_RADIUS, and NAV_ACC_RAD of multicopters, as they are delivered. [m]"""
_STRAIGHT = frozenset(
    {
        *RETURN_STAGES,
        *(StageKind.TAKEOFF, StageKind.GO, StageKind.LOITER, StageKind.DELAY, StageKind.LAND),
    }
)
"""Stages that autopilots fly along straight lines, but at their corners."""
_OF_PLACES = frozenset({"A102", "A104", "F101", "F102", "F107", "F108", "F110", "M122"})
"""Codes of rules on where the vehicle is, and would be on a return from there."""


@judges(CONDITION_NOT_MODELLED)
def _own_ways(a: Assessment) -> Iterator[NotEvaluated]:
    """Yield what is wrong with places of the way that the vehicle's own autopilot flies instead.

    Where nothing of the kind is wrong with the flight as predicted.
    """
    if not _may_matter(a):
        return
    # A text says of no autopilot that it is for it: all of them cut corners and climb along legs.
    flown = a.own_flown or own_flown_of(a, otherwise=Autopilot.ARDUPILOT)
    own = as_its_own_flies(a, flown)
    if flown is None or own is None:
        return
    by = flown[0].parameters  # it stops by its laws, too
    found = tuple(_wrong_places(replace(own, parameters=by, own_parameters=by)))
    known = {one.code for _, one in _wrong_places(a)} if found else set()
    for rule, one in found:
        if rule.code not in known:
            known.add(rule.code)
            yield NotEvaluated(
                rule=rule,
                asked_by=f"the way as {own.autopilot.label} flies it ({one.message})",
                needs="a vehicle model that is flown by that autopilot",
                item=one.item,
            )


def _wrong_places(a: Assessment) -> Iterator[tuple[Rule, Finding]]:
    """Yield the errors of rules on places."""
    from planner.rules.registry import SUBJECTS, checks_of

    subjects = ["fence", "site"]
    if a.setup.terrain is not None:
        subjects += ["terrain", "terrain_returns"]
    for subject in subjects:
        if any(need.of(a) is None for need in SUBJECTS[subject]):
            continue
        for check in checks_of(subject):
            rules = {rule.code: rule for rule in check.rules if rule.code in _OF_PLACES}
            found = check(a) if rules else ()
            for one in () if isinstance(found, Need) else found:
                if (
                    isinstance(one, Finding)
                    and one.severity is Severity.ERROR
                    and one.code in rules
                ):
                    yield rules[one.code], one


def _may_matter(a: Assessment) -> bool:
    """Return whether anything may be wrong on another way: its corners are cut by less than their radius."""
    limits, profile = FENCE.of(a), PROFILE.of(a)
    if a.setup.terrain is not None or (profile is not None and profile.max_distance_m is not None):
        return True
    if limits is None:
        return False
    if limits.ceiling_m is not None or limits.floor_m is not None:
        return True
    if not _STRAIGHT.issuperset(stage.kind for stage in a.route.stages):
        return True
    given, fenced = a.own_parameters, a.fenced
    radius_m = DELIVERED_RADIUS_M if given is None else _radius_m(given)
    asked_m = (stage.acceptance_radius_m or 0.0 for stage in a.route.stages)
    # It may fly on there as fast as anywhere, and stop behind it.
    stops_m = float(fenced.room.needed_m(fenced.path.speed_m_s, fenced.tail_wind_m_s).max())
    beside_m = max(radius_m, *asked_m) + stops_m
    return any(not fenced.is_clear_of(one, beside_m=beside_m) for one in fenced.area.barriers)


def _radius_m(given: FlightParameters) -> float:
    return given.waypoint_radius_m if is_of_ardupilot(given) else given.acceptance_radius_m
