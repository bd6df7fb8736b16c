"""How far the sorties of a fleet keep apart: in the air, on the ground, and on every return."""

from __future__ import annotations

import math
from functools import cached_property, partial
from itertools import combinations
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.fleet.approach import ACCURACY_M, Cylinder, Meeting, closest_approach
from planner.fleet.return_flights import FlownFan, ReturnConflict, ReturnFlights, return_conflict
from planner.fleet.separation import (
    Member,
    Spacing,
    are_heights_known,
    as_flown,
    clearing_delay_s,
    home_above_m,
    near_pairs,
    predict_approach,
    rough_approach,
)
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.rules.lateness import late_returns_of
from planner.service.fleet import FleetFinding
from planner.service.fleet_times import at, stands
from planner.service.separation import (
    DUPLICATE_SYSTEM_ID,
    SEPARATION,
    SEPARATION_UNCHECKED,
    flown_text,
    known_home_amsl_m,
    late_text,
    system_id,
    trajectory_of,
    uncounted_curve,
    why_left_out,
)
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.fleet.approach import ClosestApproach
    from planner.fleet.fleet import Fleet, Separation, Sortie
    from planner.fleet.trajectory import Trajectory
    from planner.flight.returns.path import FlownReturns
    from planner.geo.geodesy import LocalFrame
    from planner.rules.assessment import Assessment
    from planner.service.fleet import FlownSortie
    from planner.service.fleet_times import Stand

_Found = TypeVar("_Found")
_SHOWN_M = 0.05
_STANDS_M_S = 1e-3
_AFTER_S = 1e-6
"""So long after a braking has ended what follows it is flown, however its end is rounded; nothing sets out
in it. [s]"""
_BRAKE = STATE_INDEX[FlightState.BRAKE]
_MOST_PAIRS = 50
"""Pairs reported one by one; then how many more there are."""
_FINER = 4
"""Parts of the intervals in which returns are looked at first, where all starts are asked for."""
_MOST_DELAYS = 10
"""Pairs of which a clearing delay is looked for: that takes many times as long as the conflict."""

DOWNWASH = Rule(
    "S114 downwash",
    Severity.ERROR,
    summary="One vehicle flies over another without the height it has to keep above it.",
    why="The air below a multicopter falls at some 10 m/s: 0.6 to 1 m below another was not enough for "
    "vehicles of 30 g (Crazyswarm #97), and what spacing beside each other clears, it does not.",
    how="As S101 in a fleet: an upright cylinder about each vehicle, below_m of the upper or above_m of the "
    "lower, whichever is more, and the height errors of both; fires where they are more above than beside "
    "each other.",
    fix="fly them at heights farther apart, or one after the other",
    instead="other heights, another start, or the separation that is really required",
)

RETURN_CROSSES = Rule(
    "S115 return-crosses",
    Severity.ERROR,
    summary="A return of one vehicle comes too near to another that flies on.",
    why="A failsafe brings a vehicle home at any moment, at its own height and across whatever is there; "
    "the others do not know.",
    how="The returns from every moment of a flight, by the vehicle's own rules, against every other sortie "
    "as planned, with the separation of [separation].  A warning where the other stands on the ground and "
    "is met nowhere else.  After 50 pairs at fault no further one is looked for.  "
    "Returns of two vehicles at once are not judged.",
    fix="give the vehicles return heights that differ by more than the separation, fly them at other places, "
    "or one after the other",
)

GROUND_SEPARATION = Rule(
    "S116 ground-separation",
    Severity.ERROR,
    summary="Two vehicles stand, take off or land too near to each other.",
    why="A landing is as wrong as its position, and rotor wash moves what stands beside it.",
    how="The level distance while both are below min_nav_alt_m, one of them moving: ground_m, or the "
    "position errors of both.",
    fix="move the pads apart, or land one after the other is cleared away",
    instead="pads farther apart, another start, or the separation that is really required",
)


class Encounters:
    """What was found of flights of one fleet beside each other, by all that it depends on."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], object] = {}

    def once(self, key: tuple[object, ...], find: Callable[[], _Found]) -> _Found:
        """Return what was found already, else what is found now."""
        if key not in self._known:
            self._known[key] = find()
        return cast("_Found", self._known[key])


def separation_findings(
    fleet: Fleet, flown: Sequence[FlownSortie], known: Encounters | None = None
) -> Iterator[FleetFinding]:
    """Yield what is found of the distances between the sorties of several vehicles.

    Of the same vehicles and separation, ``known`` spares what other sorties left as it was.
    """
    separation = fleet.separation
    yield from _same_system_ids(fleet, flown)
    if separation is None or len({one.sortie.vehicle for one in flown}) < 2:
        return
    yield from _left_out(flown)
    flying = [one for one in flown if one.time_s > 0.0]
    pairs = _Pairs(fleet, separation, flying, known or Encounters())
    yield from pairs.unknown_heights()
    yield from pairs.conflicts()
    yield from pairs.ground_conflicts()
    yield from pairs.return_conflicts()


def _left_out(flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    for one in flown:
        if one.time_s > 0.0 and not uncounted_curve(one.result):
            continue
        why = "flies nothing" if one.assessment is not None else why_left_out(one.result)
        why = uncounted_curve(one.result) or why
        message = f"{one.name} {why}: no separation from it is checked"
        yield FleetFinding(
            finding=SEPARATION_UNCHECKED.finding(message, severity=Severity.ERROR),
            sorties=(one.name,),
        )


def members(
    fleet: Fleet,
    separation: Separation,
    flown: Sequence[FlownSortie],
    known: Encounters | None = None,
) -> list[Member]:
    """Return what is flown, in the frame of the first home, with its errors."""
    known = known or Encounters()
    stand_of = stands(fleet, flown)
    found = []
    for one in flown:
        assessment, vehicle = one.assessment, fleet.vehicles[one.sortie.vehicle]
        assert assessment is not None  # something is flown
        frame, stand = common_frame(flown, known), stand_of[one.name]
        ways = [
            _standing(
                _alone(fleet, separation, one.sortie, way, frame, known=known), one, stand, known
            )
            for way in one.ways
        ]
        above_m, below_m = vehicle.heights_m(separation)
        found.append(
            Member(
                file=one.name,
                trajectory=ways[0],
                own=ways[1] if len(ways) > 1 else None,
                start_s=one.start_s,
                home_amsl_m=known_home_amsl_m(assessment),
                above_m=above_m,
                below_m=below_m,
                vehicle=one.sortie.vehicle,
            )
        )
    return found


def common_frame(flown: Sequence[FlownSortie], known: Encounters) -> LocalFrame:
    """Return the frame of the first home there was."""
    first = flown[0].assessment
    assert first is not None  # something is flown
    return known.once(("frame",), lambda: first.route.frame)


def _alone(
    fleet: Fleet,
    separation: Separation,
    sortie: Sortie,
    assessment: Assessment,
    frame: LocalFrame,
    *,
    known: Encounters,
) -> Trajectory:
    """Return a flight with its errors, whatever the vehicle does before and after.

    It is one and the same for flights that are alike, as on another charge of the pack.
    """

    def find() -> Trajectory:
        whole = trajectory_of(assessment, frame, separation.min_nav_alt_m)
        made = replace(
            whole,
            slack_s=_time_fraction(assessment) * np.clip(whole.end_s, 0.0, whole.duration_s),
            grown_m=whole.grown_m
            + np.where(whole.is_rest & whole.is_low, 0.0, assessment.setup.position_margin_m),
            stop_s=_stop_s(assessment, whole) if separation.may_stop else whole.stop_s,
        )
        pad = fleet.pad_of(sortie)
        flight = (
            sortie.job,
            fleet.mission_of(sortie),
            sortie.vehicle,
            None if pad is None else pad.name,
        )
        times_s = made.start_s, made.end_s, made.slack_s, made.late_s
        columns = (*times_s, made.stop_s, made.grown_m, made.control_m)
        return known.once((*flight, *(each.tobytes() for each in columns)), lambda: made)

    # The assessment is kept with it: another one in its place would have its id.
    return known.once((id(assessment),), lambda: (assessment, find()))[1]


def _standing(alone: Trajectory, one: FlownSortie, stand: Stand, known: Encounters) -> Trajectory:
    """Return a flight with how long the vehicle stands there before and after."""

    def find() -> Trajectory:
        start_s, end_s = alone.start_s.copy(), alone.end_s.copy()
        start_s[0] = -stand.before_s
        end_s[-1] = max(one.time_s + stand.after_s, alone.duration_s)
        return replace(alone, start_s=start_s, end_s=end_s)

    return known.once((alone, stand, one.time_s), find)


def _time_fraction(assessment: Assessment) -> float:
    """Return how much of its time a flight may be sooner or later, by the spread of its model. [-]"""
    totals = assessment.totals
    if totals.time_s_p10 is None or totals.time_s_p90 is None or not totals.time_s:
        return 0.0
    away_s = max(totals.time_s - totals.time_s_p10, totals.time_s_p90 - totals.time_s)
    return max(away_s, 0.0) / totals.time_s


def _stop_s(assessment: Assessment, flown: Trajectory) -> FloatArray:
    """Return how far stops get, reaction and all, over the highest level speed of each part. (n,) [s]

    Slower, it gets no farther for its speed.  One that brakes to a stand anyway is as told by then.
    """
    setup = assessment.setup
    width_s = np.maximum(flown.end_s - flown.start_s, 1e-9)
    steps_m = np.diff(flown.control_m[..., :2], axis=1)
    fastest_m_s = 3.0 * np.hypot(steps_m[..., 0], steps_m[..., 1]).max(axis=1) / width_s
    stop_m = assessment.returns.pilot.farthest_stop_m(fastest_m_s)
    stop_s = stop_m / np.maximum(fastest_m_s, _STANDS_M_S) + setup.reaction_time_s
    segments = assessment.flight.motion.segments
    after = assessment.flight.motion.state_at_time(segments.end_s + _AFTER_S).velocity_m_s
    stands = (segments.state == _BRAKE) & (np.hypot(after[:, 0], after[:, 1]) < _STANDS_M_S)
    middle_s = 0.5 * (flown.start_s + flown.end_s)
    own = np.searchsorted(segments.end_s, middle_s).clip(max=len(stands) - 1)
    return np.where((fastest_m_s > _STANDS_M_S) & ~stands[own], stop_s, 0.0)


def fleet_spacing(separation: Separation) -> Spacing:
    """Return what all keep apart by."""
    return Spacing(
        separation_m=separation.horizontal_m,
        start_error_s=separation.start_error_s,
        height_error_m=separation.height_error_m,
    )


class _Pairs:
    """The sorties that fly, in pairs of several vehicles."""

    def __init__(
        self, fleet: Fleet, separation: Separation, flown: Sequence[FlownSortie], known: Encounters
    ) -> None:
        self._fleet = fleet
        self._flown = flown
        self._known = known
        self._separation = separation
        self._members = members(fleet, separation, flown, known)
        self._spacing = fleet_spacing(separation)

    def _once(self, what: str, one: Member, two: Member, find: Callable[[], _Found]) -> _Found:
        """Return what is found of two flights, whatever the clock says."""
        later_s = two.start_s - one.start_s
        return self._known.once((what, one.trajectory, two.trajectory, later_s), find)

    def unknown_heights(self) -> Iterator[FleetFinding]:
        """Yield pairs whose heights cannot be compared."""
        pairs = [
            (one, two)
            for one, two in combinations(self._members, 2)
            if one.vehicle != two.vehicle and not are_heights_known(one, two)
        ]
        if not pairs:
            return
        one, two = pairs[0]
        more = f", and of {quantity.count(len(pairs) - 1, 'more pair')}" if len(pairs) > 1 else ""
        message = (
            f"heights of {one.file} and {two.file} cannot be compared{more}: the altitude of a home is "
            "not known"
        )
        yield FleetFinding(
            finding=SEPARATION_UNCHECKED.finding(
                message,
                fix="give the pads their amsl_m, or the conditions a terrain",
                severity=Severity.ERROR,
            ),
            sorties=(one.file, two.file),
        )

    def conflicts(self) -> Iterator[FleetFinding]:
        """Yield every two sorties that come too near to each other in the air."""
        found = [
            (pair, sides, approach)
            for pair in sorted(near_pairs(self._members, self._spacing))
            for sides, approach in self._roughly(*pair)
        ]
        for number, (pair, sides, roughly) in enumerate(found[:_MOST_PAIRS]):
            approach = self._once("nearest", *sides, partial(self._nearest, *sides)) or roughly
            delay_s, is_tried = None, number < _MOST_DELAYS
            if is_tried:
                one, two = (self._members[each] for each in pair)
                clear = partial(clearing_delay_s, one, two, self._spacing)
                delay_s = self._once("delay", one, two, clear)
            yield self._too_near(*sides, approach, delay_s, is_tried=is_tried)
        if len(found) > _MOST_PAIRS:
            more = quantity.count(len(found) - _MOST_PAIRS, "more pair")
            message = f"{more} of sorties come too near to each other"
            yield FleetFinding(finding=SEPARATION.finding(message))

    def _roughly(
        self, first: int, second: int
    ) -> Iterator[tuple[tuple[Member, Member], ClosestApproach]]:
        """Yield in what way two come too near to each other, the first that does."""
        for sides in as_flown(self._members[first], self._members[second]):
            approach = self._once("rough", *sides, partial(rough_approach, *sides, self._spacing))
            if approach is not None:
                yield sides, approach
                return

    def _nearest(self, one: Member, two: Member) -> ClosestApproach | None:
        """Return how near two come that are not told to stop, else told to."""
        return predict_approach(
            _unstopped(one), _unstopped(two), self._spacing
        ) or predict_approach(one, two, self._spacing)

    def _too_near(
        self,
        one: Member,
        two: Member,
        approach: ClosestApproach,
        delay_s: float | None,
        *,
        is_tried: bool,
    ) -> FleetFinding:
        is_over = abs(approach.above_m) > approach.beside_m
        rule = DOWNWASH if is_over else SEPARATION
        errors_m = sum(
            _error_m(*side) for side in ((one, approach.first_s), (two, approach.second_s))
        )
        stops_m = approach.grown_m - errors_m
        told = ", told to stop" if stops_m else ""
        near = replace(approach, beside_m=max(approach.beside_m - stops_m, 0.0), grown_m=errors_m)
        message = (
            f"{one.file} ({one.vehicle}) and {two.file} ({two.vehicle}){told}: {_apart(near)} each other "
            f"{at(one.start_s + approach.first_s)}, items {approach.first_item} and "
            f"{approach.second_item}{flown_text(one, two)}; {self._required(one, two, near)}"
            + late_text((one, approach.first_s), (two, approach.second_s))
        )
        fix = "fly them at other heights or places, or one after the other"
        if is_tried and delay_s is None:
            fix = f"no later start of {two.file} keeps the two apart: fly them at other heights or places"
        elif delay_s is not None:
            fix = (
                f"start {two.file} {quantity.duration(delay_s)} later, which keeps these two apart "
                "(perhaps not from a third), or fly them at other heights or places"
            )
        return FleetFinding(
            finding=rule.finding(message, fix=fix),
            sorties=(one.file, two.file),
            at_s=one.start_s + approach.first_s,
        )

    def _required(self, one: Member, two: Member, approach: ClosestApproach) -> str:
        zone = self._spacing.zone(one, two)
        assert zone is not None  # of a fleet it is a cylinder
        height_m = zone.over_m if approach.above_m >= 0.0 else zone.under_m
        errors_m = approach.grown_m
        beside_m = self._separation.horizontal_m + errors_m
        text = (
            f"{quantity.height(beside_m)} beside or {quantity.height(height_m)} above each other "
            "required"
        )
        if errors_m:
            text += f" ({quantity.height(errors_m)} of it for position errors)"
        return text

    def ground_conflicts(self) -> Iterator[FleetFinding]:
        """Yield every two that are too near to each other while both are near the ground."""
        widest_m = max(self._spacing.separation_m, self._separation.ground_m or 0.0)
        spacing = replace(self._spacing, separation_m=widest_m)
        low = [self._parts("low", _near_ground, one) for one in self._members]
        for first, second in sorted(near_pairs(low, spacing)):
            one, two = low[first], low[second]
            least_m = self._separation.ground_m
            if least_m is None:
                least_m = sum(
                    assessment.setup.position_margin_m
                    for place in (first, second)
                    if (assessment := self._flown[place].assessment) is not None
                )
            if least_m <= ACCURACY_M:
                continue
            zone = Cylinder(
                horizontal_m=least_m - ACCURACY_M, over_m=np.inf, under_m=np.inf, is_on_ground=True
            )
            found = (self._on_ground(*sides, zone) for sides in as_flown(one, two))
            approach = next((each for each in found if each is not None), None)
            if approach is None:
                continue
            # It stands there since long before, maybe: nothing happens before the operation begins.
            at_s = max(one.start_s + approach.first_s, 0.0)
            message = (
                f"{one.file} ({one.vehicle}) and {two.file} ({two.vehicle}) are "
                f"{quantity.height(approach.beside_m)} apart near the ground {at(at_s)}; "
                f"{quantity.height(least_m)} required"
            )
            yield FleetFinding(
                finding=GROUND_SEPARATION.finding(message), sorties=(one.file, two.file), at_s=at_s
            )

    def return_conflicts(self) -> Iterator[FleetFinding]:
        """Yield the returns that come too near to what another vehicle flies as planned.

        No more are looked for after so many: those make it a no-go, and all of a hundred flights that
        cross take minutes.
        """
        left = _MOST_PAIRS
        for one, flown in zip(self._members, self._flown, strict=True):
            backs = self._backs(flown)
            for two in self._beside_returns(backs, one):
                if not left:
                    message = (
                        f"after {_MOST_PAIRS} pairs in which a return comes too near, no further one is "
                        f"looked for: neither of {one.file} and {two.file}, nor of those after them"
                    )
                    yield FleetFinding(finding=RETURN_CROSSES.finding(message))
                    return
                found = self._return_conflict(backs, one, two)
                if found is None:
                    continue
                is_low = _stands_low(found[1][1], found[0].approach)
                if is_low:
                    # That it stands in the way does not tell whether it is also met in the air.
                    in_air = self._return_conflict(backs, one, self._parts("aloft", _aloft, two))
                    found, is_low = in_air or found, in_air is None
                left -= not is_low
                yield self._crossed(*found, is_low=is_low)

    def _backs(self, flown: FlownSortie) -> list[ReturnsOfOne]:
        """Return the returns of a sortie: as predicted, and as its own autopilot flies if known."""
        frame = common_frame(self._flown, self._known)
        return returns_of(self._fleet, self._separation, flown, frame, self._known)

    def _parts(self, what: str, of: Callable[[Trajectory], Trajectory], one: Member) -> Member:
        """Return a member with some parts of its flight alone."""
        some, own = (
            None if flown is None else self._known.once((what, flown), partial(of, flown))
            for flown in (one.trajectory, one.own)
        )
        assert some is not None
        return replace(one, trajectory=some, own=own)

    def _on_ground(self, one: Member, two: Member, zone: Cylinder) -> ClosestApproach | None:
        """Return how near two come near the ground; ``None``: not too near."""
        find = partial(
            closest_approach,
            one.trajectory,
            two.trajectory,
            second_later_s=two.start_s - one.start_s,
            shift_s=2.0 * self._spacing.start_error_s,
            zone=zone,
        )
        return self._once("ground", one, two, find)

    def _return_conflict(
        self, backs: Sequence[ReturnsOfOne], one: Member, two: Member
    ) -> tuple[ReturnConflict, tuple[Member, Member]] | None:
        """Return a return of one that comes too near to another, and in what way both fly then."""
        later_s = two.start_s - one.start_s

        def find(back: ReturnsOfOne, other: Member) -> ReturnConflict | None:
            meeting = Meeting(
                first=back.fan.trajectory,
                second=other.trajectory.reach,
                later_s=later_s,
                shift_s=2.0 * self._spacing.start_error_s,
                above_m=home_above_m(one, two),
                zone=self._spacing.zone(one, two),
            )
            return return_conflict(back.flights, back.fan, meeting)

        for sides in as_flown(one, two):
            back, other = backs[sides[0].flies_own], sides[1]
            found = self._known.once((back, other.trajectory, later_s), partial(find, back, other))
            if found is not None:
                return found, sides
        return None

    def _crossed(
        self, found: ReturnConflict, sides: tuple[Member, Member], *, is_low: bool
    ) -> FleetFinding:
        (one, two), approach = sides, found.approach
        doing = "which stands on the ground" if is_low else f"item {approach.second_item}"
        message = (
            f"a return of {one.file} ({one.vehicle}) begun {at(one.start_s + found.begun_s)} at item "
            f"{found.item} comes within {_apart(approach)} {two.file} ({two.vehicle}), {doing}, "
            f"{at(one.start_s + approach.first_s)}{flown_text(one, two)}; "
            f"{self._required(one, two, approach)}"
        )
        if self._separation.may_stop:
            message += f", whether {two.file} is told to stop or not"
        severity = Severity.WARNING if is_low else None
        return FleetFinding(
            finding=RETURN_CROSSES.finding(message, severity=severity),
            sorties=(one.file, two.file),
            at_s=one.start_s + approach.first_s,
        )

    def _beside_returns(self, backs: Sequence[ReturnsOfOne], one: Member) -> list[Member]:
        """Return the flights of other vehicles that returns of one flight may come near to."""
        boxes = [box for back in backs if (box := back.box_m) is not None]
        if not boxes:
            return []
        low_m, high_m = self._boxes_m
        is_beside = np.any(
            [((low_m < box[1]) & (box[0] < high_m)).all(axis=1) for box in boxes], axis=0
        )
        near = (self._members[place] for place in np.flatnonzero(is_beside).tolist())
        return [two for two in near if two.vehicle != one.vehicle]

    @cached_property
    def _boxes_m(self) -> FloatArray:
        """Boxes that the vehicles do not leave, as far as others keep from them. (2, n, 2) [m]"""
        low_m, high_m = np.array([one.reach_box_m for one in self._members]).swapaxes(0, 1)
        away_m = self._spacing.separation_m
        return np.stack((low_m - away_m, high_m + away_m))


class ReturnsOfOne:
    """The returns of one flight."""

    def __init__(self, flights: ReturnFlights, flown: Trajectory) -> None:
        self.flights = flights
        self._flown = flown

    @cached_property
    def box_m(self) -> tuple[FloatArray, FloatArray] | None:
        """Box that none leaves; ``None``: there are none."""
        return self.flights.reach_m(self._flown)

    @cached_property
    def fan(self) -> FlownFan:
        """Those of the first intervals."""
        return self.flights.fan(*self.flights.first_intervals())

    @cached_property
    def fine_fan(self) -> FlownFan:
        """Those of parts of them, for where all starts are asked for."""
        begin_s, end_s = self.flights.first_intervals()
        cuts_s = np.linspace(begin_s, end_s, _FINER + 1)
        return self.flights.fan(cuts_s[:-1].T.ravel(), cuts_s[1:].T.ravel())


def returns_of(
    fleet: Fleet, separation: Separation, one: FlownSortie, frame: LocalFrame, known: Encounters
) -> list[ReturnsOfOne]:
    """Return the returns of a sortie, in a common frame; those of flights that are alike once.

    As predicted, and as its own autopilot flies where that is known.
    """

    def returns(assessment: Assessment) -> ReturnsOfOne:
        alone = _alone(fleet, separation, one.sortie, assessment, frame, known=known)
        return known.once(
            ("returns", alone),
            lambda: ReturnsOfOne(return_flights(assessment, alone, frame), alone),
        )

    return [returns(way) for way in one.ways]


def return_flights(assessment: Assessment, flown: Trajectory, frame: LocalFrame) -> ReturnFlights:
    """Return the returns of a flight, in a common frame."""
    lost_s = np.cumsum(assessment.lost_s)
    begun_s = np.stack((lost_s - assessment.lost_s, lost_s), axis=1)
    return ReturnFlights(
        returns=assessment.returns,
        frame=frame,
        grown_m=assessment.setup.position_margin_m,
        time_fraction=_time_fraction(assessment),
        late_s=assessment.lateness.passed_s + begun_s,
        longer_s=partial(_returns_longer_s, assessment),
        pace=flown.pace,
    )


def _returns_longer_s(assessment: Assessment, flown: FlownReturns) -> FloatArray:
    """Return how much longer returns may take than predicted, at most. (n,) [s]"""
    back_s = late_returns_of(assessment, flown, least=1.0).in_all_s
    longer = assessment.uncounted.returns_longer
    return back_s + longer * flown.time_s if math.isfinite(longer) else back_s


def _stands_low(two: Member, approach: ClosestApproach) -> bool:
    """Return whether the second of an approach stands on the ground then."""
    flown = two.trajectory
    if 0.0 < approach.second_s < flown.duration_s:
        return False
    return bool(flown.is_low[0 if approach.second_s <= 0.0 else -1])


def _unstopped(one: Member) -> Member:
    """Return a flight that is not told to stop."""
    flown = one.trajectory
    return replace(one, trajectory=replace(flown, stop_s=np.zeros_like(flown.stop_s)))


def _error_m(one: Member, time_s: float) -> float:
    """Return how wrong the position of a vehicle may be. [m]"""
    flown = one.trajectory
    return float(flown.grown_m[flown.part_at(np.array([time_s]))][0])


def _aloft(one: Trajectory) -> Trajectory:
    """Return a flight without the times in which it stands on the ground."""
    return one.parts(np.flatnonzero(~(one.is_rest & one.is_low)))


def _near_ground(one: Trajectory) -> Trajectory:
    """Return the parts of a flight near the ground, without errors of the position."""
    low = one.parts(np.flatnonzero(one.is_low))
    return replace(low, grown_m=np.zeros_like(low.grown_m))


def _apart(approach: ClosestApproach) -> str:
    above_m = abs(approach.above_m)
    above = f" and {quantity.height(above_m)} above" if above_m >= _SHOWN_M else ""
    return f"{quantity.height(approach.beside_m)} beside{above}"


def _same_system_ids(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    ids: dict[int, str] = {}
    for name, given in known_system_ids(fleet, flown).items():
        if given in ids:
            message = f"{name} and {ids[given]} both have system id {given}"
            yield FleetFinding(finding=DUPLICATE_SYSTEM_ID.finding(message))
        ids.setdefault(given, name)


def known_system_ids(fleet: Fleet, flown: Sequence[FlownSortie]) -> Mapping[str, int]:
    """Return the system id of each vehicle that flies, as the fleet file or its parameters give it."""
    ids = {}
    for name in dict.fromkeys(one.sortie.vehicle for one in flown):
        vehicle = fleet.vehicles[name]
        found = system_id(vehicle.setup.parameters)
        given = vehicle.system_id or (None if found is None else int(found[0]))
        if given is not None:
            ids[name] = given
    return ids
