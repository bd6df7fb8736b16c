"""Several missions flown at the same time in one airspace: are they far enough apart?"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.findings import Rule, Severity
from planner.fleet.separation import (
    Member,
    Spacing,
    are_heights_known,
    clearing_delay_s,
    predict_approach,
    predict_conflicts,
    predict_unknown,
)
from planner.fleet.trajectory import Pace, make_trajectory
from planner.mission.commands import Command
from planner.mission.items import MissionFormat
from planner.mission.route.stage import StageKind
from planner.mission.route.walk import WAIT_NOT_COUNTED
from planner.rules.left_open import IN_SIGHT_M
from planner.rules.wind import circles_off_m
from planner.service.preflight import CheckResult, UnreadableMission, verdict
from planner.setting import taking_settings
from planner.setup import Together
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.findings import Finding
    from planner.fleet.approach import ClosestApproach
    from planner.fleet.separation import Conflict
    from planner.fleet.trajectory import Trajectory
    from planner.geo.geodesy import LocalFrame
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.files import ParameterSet

SEPARATION = Rule(
    "S101 separation",
    Severity.ERROR,
    summary="Two missions flown at the same time come too near to each other.",
    why="Checks that sample find no crossing between two samples, that end early none in the last "
    "quarter (EGO-Planner-v2 #60), that look at one time none at another (Swarm-Formation #35), and a "
    "vehicle that has landed is still there (EGO-Planner-v2 #65).",
    how="The closest approach of the predicted flights in continuous time, from the first take-off to "
    "the last landing, at every start within --start-error; before its start a vehicle is at its "
    "take-off place, after its end where it ended.  Not while both are below --min-nav-alt over their "
    "take-off or landing places.  It is found to 1 cm; fires where it is more than that below "
    "--separation.  --start-error also covers the "
    "uncertainty of a flight's times; what a step-response model takes longer by its parameters (E108), "
    "however little, and any for want of airspeed (E105), counts as up to so much later; such a model's "
    "flight is also judged as the autopilot of its parameters, else of the one the mission is for, flies "
    "it: through corners, and climbing along its legs; where two differ in model, parameters or wind, "
    "either may fly as predicted beside the other's own.  Two alike that pass all their segments at the "
    "same times are late by the same at the same place.  The suggested delay is clear in all these "
    "ways.  In a fleet file the zone is an upright cylinder, horizontal_m and the position errors of both "
    "wide, and the spread of times of the models counts as start errors do.",
    fix="start one of them later, or fly them at other heights or places",
    instead="other heights or places, another start, or the separation that is really required",
)

DUPLICATE_SYSTEM_ID = Rule(
    "S102 duplicate-sysid",
    Severity.WARNING,
    summary="Two vehicles that fly at the same time have the same MAVLink system id.",
    why="Ground stations take them for one vehicle (QGroundControl #14812, #3321): what is commanded "
    "to the one may reach the other.",
    how="SYSID_THISMAV, MAV_SYSID or MAV_SYS_ID of different parameter files, in a check with "
    "--separation.",
    fix="give each vehicle its own system id",
)

SEPARATION_UNCHECKED = Rule(
    "S104 separation-unchecked",
    Severity.WARNING,
    summary="A part of the separation from other missions could not be checked.",
    why="A vehicle that was left out is in the air all the same.",
    how="--separation requires it, and another mission could not be read or flies nothing, the flight "
    "never rises to --min-nav-alt, or the altitude of a home is unknown (none, or 0) where homes are "
    "more than 1 m apart: heights are then compared above home.  An error in a fleet file, where such two "
    "come too near to each other seen from above, where a file without a home (but of a drawing) is within "
    "500 m of another's flight at about the time, and where one waits on the ground for what its times do "
    "not count (T107), or flies a spline that a step-response model is predicted to fly straight.",
    fix="correct what is named, and check again",
    instead="a mission that can be read, and the altitude of each home",
    leaves_open=True,
)


_OWN_CODES = frozenset(
    rule.code for rule in (SEPARATION, DUPLICATE_SYSTEM_ID, SEPARATION_UNCHECKED)
)
_SLOWEST_THERE_M_S = 1.0
"""No vehicle flies more slowly from a home that is not known to its first place. [m s⁻¹]"""
_SHOWN_S = 0.5
_SYSTEM_IDS = ("SYSID_THISMAV", "MAV_SYSID", "MAV_SYS_ID")


def keep_apart(
    results: Sequence[CheckResult | UnreadableMission], together: Together
) -> tuple[CheckResult | UnreadableMission, ...]:
    """Judge missions that fly at the same time in one airspace.

    Parameters
    ----------
    results : sequence of CheckResult or UnreadableMission
        As `planner.check` returns them, each of its own mission.
    together : Together
        How far they keep from each other, and when each starts.

    Returns
    -------
    tuple of CheckResult or UnreadableMission
        The same results in the same order, each with what is found about it among the others (S101,
        S102, S104), in place of what an earlier call found, and judged again.

    Raises
    ------
    UsageError
        If a value is of a wrong type or out of its range.

    Notes
    -----
    The place of each vehicle is taken in one flat frame about the home of the first mission: exact to
    0.03 m in 20 km, 0.1 m in 35 km.  Wind, and errors of the position, are those of the predictions.
    """
    starts_s = _starts_s(results, together)
    flown = [
        (position, result.assessment)
        for position, result in enumerate(results)
        if isinstance(result, CheckResult)
        and result.assessment is not None
        and result.assessment.flight.time_s > 0.0
    ]
    cases = [assessment for _, assessment in flown]

    def trajectory(assessment: Assessment) -> Trajectory:
        return trajectory_of(assessment, cases[0].route.frame, together.min_nav_alt_m)

    fleet = [
        Member(
            file=results[position].file,
            trajectory=trajectory(assessment),
            own=None if assessment.own is None else trajectory(assessment.own),
            start_s=starts_s[position],
            home_amsl_m=known_home_amsl_m(assessment),
        )
        for position, assessment in flown
    ]
    spacing = Spacing(separation_m=together.separation_m, start_error_s=together.start_error_s)
    together_flown = _FlownFleet(fleet, spacing)
    added: list[list[Finding]] = [[] for _ in results]
    for number, (position, assessment) in enumerate(flown):
        added[position] += together_flown.too_near(number, assessment)
        added[position] += _samesystem_id(number, cases, fleet)
    waits = [f"{one.file} {wait}" for one in results if (wait := uncounted_wait(one))]
    curves = [f"{one.file} {curve}" for one in results if (curve := uncounted_curve(one))]
    unknown = {flown[number][0] for number in predict_unknown(fleet, spacing)}
    begun = {flown[number][0]: other for number, other in _begun_near(cases, fleet, spacing)}
    for position, reasons in enumerate(_unchecked(results, flown, fleet, together.min_nav_alt_m)):
        if waits:
            reasons.insert(0, f"{waits[0]}{_and_more(waits)}: when it flies is not known")
        if curves:
            reasons.insert(0, f"{curves[0]}{_and_more(curves)}: where it flies is not known")
        if position in unknown:
            reasons.append("seen from above another comes too near")
        if position in begun:
            reasons.insert(0, f"no home in the file: its way from there may pass {begun[position]}")
        if reasons:
            is_error = waits or curves or position in unknown or position in begun
            severity = Severity.ERROR if is_error else None
            message = "; ".join(reasons)
            added[position].append(SEPARATION_UNCHECKED.finding(message, severity=severity))
    return tuple(
        _judged_again(result, found) if isinstance(result, CheckResult) else result
        for result, found in zip(results, added, strict=True)
    )


check_together = taking_settings("check_together", keep_apart, Together)
"""`keep_apart` with each setting as a keyword: ``check_together(results, separation_m=10.0)``."""


def _starts_s(results: Sequence[object], together: Together) -> tuple[float, ...]:
    for result in results:
        if not isinstance(result, (CheckResult, UnreadableMission)):
            msg = f"results must be those of planner.check(…), got a {type(result).__name__}"
            raise UsageError(msg)
    starts = tuple(together.starts_s) or (0.0,) * len(results)
    if len(starts) != len(results):
        missions = quantity.count(len(results), "mission")
        msg = f"{quantity.count(len(starts), 'start')} given for {missions}: give one for each"
        raise UsageError(msg)
    return starts


def _begun_near(
    cases: Sequence[Assessment], fleet: Sequence[Member], spacing: Spacing
) -> Iterator[tuple[int, str]]:
    """Yield the members without a home that another is in sight of, with its file; of none that tell none."""
    reach_m = IN_SIGHT_M + spacing.separation_m
    for number, (a, one) in enumerate(zip(cases, fleet, strict=True)):
        if a.mission.home is not None or a.mission.file_format is MissionFormat.FOREIGN:
            continue
        low_m, high_m = one.reach_box_m
        begin_s, end_s = _flown_between_s(one)
        slack_s = 2.0 * spacing.start_error_s + IN_SIGHT_M / _SLOWEST_THERE_M_S
        for other in fleet:
            other_low_m, other_high_m = other.reach_box_m
            apart_m = np.maximum(other_low_m - high_m, low_m - other_high_m)
            other_begin_s, other_end_s = _flown_between_s(other)
            apart_s = max(other_begin_s - end_s, begin_s - other_end_s)
            if other is not one and (apart_m < reach_m).all() and apart_s < slack_s:
                yield number, other.file
                break


def _flown_between_s(one: Member) -> tuple[float, float]:
    """Return when a member takes off, and when it has landed at the latest. [s]"""
    flown = one.trajectory
    return one.start_s, one.start_s + flown.duration_s + flown.latest_s


def known_home_amsl_m(assessment: Assessment) -> float | None:
    """Return the altitude of home; ``None`` where it is not known. [m AMSL]"""
    route = assessment.route
    return route.home_amsl_m if route.knows_home_amsl else None


def trajectory_of(a: Assessment, frame: LocalFrame, min_nav_alt_m: float) -> Trajectory:
    """Return where a vehicle is over time, with how much later it may be and how far beside that."""
    passed_s = np.stack((a.flight.motion.segments.end_s, a.passed_late_s))
    own = (
        None if a.setup.parameters is None else tuple(sorted(a.setup.parameters.numbers().items()))
    )
    return make_trajectory(
        a.flight.motion,
        a.route,
        frame,
        min_nav_alt_m=min_nav_alt_m,
        late_s=a.lateness.passed_s,
        lost_s=a.lost_s,
        beside_m=circles_off_m(a),
        pace=Pace(flown_by=(a.vehicle, a.setup.wind, a.target, own), passed_s=passed_s),
    )


class _FlownFleet:
    """A fleet as it flies, and who come too near to each other."""

    def __init__(self, fleet: Sequence[Member], spacing: Spacing) -> None:
        self._fleet = fleet
        self._spacing = spacing
        self._conflicts = list(predict_conflicts(fleet, spacing))
        self._details = cache(self._make_details)  # for the finding of each of the two

    def _make_details(self, conflict: Conflict) -> tuple[ClosestApproach, float | None]:
        nearest = predict_approach(*conflict.sides, self._spacing) or conflict.approach
        pair = self._fleet[conflict.first], self._fleet[conflict.second]
        return nearest, clearing_delay_s(*pair, self._spacing)

    def too_near(self, number: int, assessment: Assessment) -> Iterator[Finding]:
        """Yield one finding about all that one member comes too near to: the nearest, and how many."""
        fleet, spacing = self._fleet, self._spacing
        own = [
            conflict for conflict in self._conflicts if number in {conflict.first, conflict.second}
        ]
        if not own:
            return
        worst = min(own, key=lambda conflict: conflict.approach.distance_m)
        approach, delay_s = self._details(worst)
        sides = [
            (worst.first, worst.sides[0], approach.first_s, approach.first_item),
            (worst.second, worst.sides[1], approach.second_s, approach.second_item),
        ]
        if number == worst.second:
            sides.reverse()
        (_, one, own_s, item), (_, other, other_s, other_item) = sides
        message = (
            f"{quantity.beside(approach.distance_m, spacing.separation_m, quantity.height)} from "
            f"{other.file}, {quantity.height(spacing.separation_m)} required by --separation: "
            f"{_when(one, own_s, item)}, {other.file} {_when(other, other_s, other_item)}"
            + flown_text(*worst.sides)
        )
        if spacing.start_error_s > 0.0:
            message += f", where both start within {quantity.duration(spacing.start_error_s)} of their times"
        message += late_text((one, own_s), (other, other_s))
        message += _beside_text((one, own_s), (other, other_s))
        others = [
            fleet[c.first if c.second == number else c.second].file for c in own if c is not worst
        ]
        if others:
            message += f"; too near to {others[0]}{_and_more(others)} as well"
        later = fleet[worst.second]
        fix = (
            f"no later start of {later.file} keeps the two apart: fly them at other heights or places"
            if delay_s is None
            else f"start {later.file} {quantity.duration(delay_s)} later, which keeps the two apart, or "
            "fly them at other heights or places"
        )
        yield assessment.finding(SEPARATION, message, fix=fix, item=item)


def flown_text(*sides: Member) -> str:
    """Return who of two flies as its own autopilot does, in words; empty: both as predicted."""
    own = [one.file for one in sides if one.flies_own]
    if not own:
        return ""
    whom = (
        f" {own[0]}"
        if len(own) < sum(one.flies_own or one.own is not None for one in sides)
        else ""
    )
    return f", as its own autopilot flies{whom}"


def late_text(*sides: tuple[Member, float]) -> str:
    """Return who may be later than predicted at its time, in words; empty: none."""
    late_s = {
        one.file: float(one.trajectory.late_s[one.trajectory.part_at(np.array([time_s]))[0], 1])
        for one, time_s in sides
    }
    return "".join(
        f"; {file} may be up to {quantity.duration(by_s)} later than that (E105, E108)"
        for file, by_s in late_s.items()
        if by_s >= _SHOWN_S
    )


def _beside_text(*sides: tuple[Member, float]) -> str:
    """Return who may be beside its path at its time, and by how much, in words; empty: none."""
    off_m = {
        one.file: float(one.trajectory.grown_m[one.trajectory.part_at(np.array([time_s]))][0])
        for one, time_s in sides
    }
    return "".join(
        f"; {file} may be up to {quantity.height(away_m)} beside its path there: "
        "the wind widens its circle (W105), or it lags behind its spline"
        for file, away_m in off_m.items()
        if away_m
    )


def _and_more(named: Sequence[object]) -> str:
    """Return how many there are after the first, which is named."""
    return f" and {len(named) - 1} more" if len(named) > 1 else ""


def _when(member: Member, time_s: float, item: int) -> str:
    if time_s < 0.0:
        return "before its start"
    if time_s > member.trajectory.duration_s:
        return "after its end"
    return f"at {quantity.duration(time_s)} (item {item})"


def _samesystem_id(
    number: int, cases: Sequence[Assessment], fleet: Sequence[Member]
) -> Iterator[Finding]:
    """Yield that another vehicle, by another file of parameters, has the system id of this one."""
    own = system_id(cases[number].setup.parameters)
    if own is None:
        return
    same = [
        (fleet[position].file, found[1])
        for position, assessment in enumerate(cases)
        if (found := system_id(assessment.setup.parameters)) is not None
        and found[0] == own[0]
        and found[1] != own[1]
    ]
    if same:
        yield DUPLICATE_SYSTEM_ID.finding(
            f"system id {own[0]:g} ({own[1]}) also belongs to {same[0][0]} ({same[0][1]}){_and_more(same)}"
        )


def system_id(given: ParameterSet | None) -> tuple[float, str] | None:
    """Return the system id a vehicle's own parameters give, and their source."""
    if given is None:
        return None
    for name in _SYSTEM_IDS:
        if name in given.values and (value := given.values[name].value) is not None:
            return value, given.source
    return None


def uncounted_wait(result: CheckResult | UnreadableMission) -> str:
    """Return what a flight waits for, where that is not in its times; empty: it waits for nothing else."""
    if not isinstance(result, CheckResult) or result.assessment is None:
        return ""
    items, setup = result.assessment.mission.items, result.assessment.setup
    for one in (*result.findings, *result.suppressed):
        if one.code != WAIT_NOT_COUNTED.code or one.item is None:
            continue
        item = items[one.item - 1]
        # PX4 has no time of day: it does not wait.
        waits = (item.param1 or 0.0) > 0.0 or setup.flown_by is not Autopilot.PX4
        if item.command == Command.NAV_DELAY and waits:
            return one.message
    return ""


def uncounted_curve(result: CheckResult | UnreadableMission) -> str:
    """Return that a flight curves where it is predicted straight; empty: it does not."""
    if not isinstance(result, CheckResult) or result.assessment is None:
        return ""
    a = result.assessment
    curves = [stage.item for stage in a.route.stages if stage.kind is StageKind.SPLINE]
    if a.autopilot is not Autopilot.STEP or not curves:
        return ""
    return f"flies the spline of item {curves[0]} as a curve, predicted as a straight leg"


def why_left_out(result: CheckResult | UnreadableMission) -> str:
    """Return why a mission takes no part in the separation."""
    if isinstance(result, UnreadableMission):
        return "cannot be read" if result.verdict is None else "cannot be checked"
    return "flies nothing"


def _unchecked(
    results: Sequence[CheckResult | UnreadableMission],
    flown: Sequence[tuple[int, Assessment]],
    fleet: Sequence[Member],
    min_nav_alt_m: float,
) -> Iterator[list[str]]:
    """Yield for each result why its separation is not, or not fully, checked."""
    numbered = {position: number for number, (position, _) in enumerate(flown)}
    left_out = [
        f"{result.file} {why_left_out(result)}"
        for position, result in enumerate(results)
        if position not in numbered
    ]
    for position in range(len(results)):
        number = numbered.get(position)
        if number is None:
            yield ["nothing is flown: the separation from the other missions is not checked"]
            continue
        reasons = []
        if left_out:
            reasons.append(f"{left_out[0]}{_and_more(left_out)}: no separation from it is checked")
        if not fleet[number].trajectory.is_ever_flying:
            reasons.append(
                f"the flight never rises to {quantity.height(min_nav_alt_m)}: its separation is "
                "checked only from those that do"
            )
        unknown = [member.file for member in fleet if not are_heights_known(fleet[number], member)]
        if unknown:
            reasons.append(
                "heights are compared above home: the altitude of home is not known here, or not in "
                f"{unknown[0]}{_and_more(unknown)}"
            )
        yield reasons


def _judged_again(result: CheckResult, found: Sequence[Finding]) -> CheckResult:
    known = [
        replace(finding, suppression="")
        for finding in (*result.findings, *result.suppressed)
        if finding.code not in _OWN_CODES
    ]
    reported, suppressed = result.setup.selection.divide((*known, *found), file=result.file)
    return replace(
        result,
        findings=reported,
        suppressed=suppressed,
        verdict=verdict(reported, result.setup.fail_on),
    )
