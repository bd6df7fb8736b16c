"""Rules on the heights a fence allows: flight, returns, landings and take-offs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.fence_schedule import fence_schedule
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.mission.route.stage import LANDED_STAGES, RETURN_STAGES, StageKind
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT, FENCE, NotEvaluated, judges
from planner.rules.fence_settings import limits_in_use
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.rules.fence_settings import FenceLimits
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_SLACK_M = 0.01
"""Rounding of files. [m]"""
_HEIGHT_ERROR_M = 0.5
"""How far a height may be off with nothing wrong: the vertical hover accuracy DJI states with GNSS; recorded
flights of PX4 rise by 0.4 to 1.6 m over the heights commanded, ArduPilot's by up to 0.2 m. [m]"""
_HEIGHT_MARGIN_M = 2.0
"""What ArduPilot keeps itself where it chooses a height below a ceiling (default of FENCE_MARGIN). [m]"""
_ON_THE_GROUND = {StageKind.LAND, StageKind.DELAY, *RETURN_STAGES}
_PATH_JUDGED = frozenset(StageKind) - RETURN_STAGES
"""Stages whose heights between their ends are judged; the mission's own return is as all others."""
_NOT_AIRBORNE = [STATE_INDEX[state] for state in (FlightState.TAKEOFF, FlightState.LAND)]
_LANDS_ALL_THE_SAME = frozenset({0, 2})
"""Values of FENCE_ACTION: report only, and land."""
_RETURNS = frozenset({1, 3, 5})
"""And return by RTL or SmartRTL, or land where it cannot: at home it lands then."""
_BY_OWN_TRACK = frozenset({3, 5})
"""By SmartRTL."""
_WITHOUT_SMART_RETURN = {3: 1, 5: 2}
"""What they are where SRTL_POINTS 0 switches that off."""
_LEAST_SLOPE = 0.5
"""RTL_CONE_SLOPE from which on a return near home does not climb."""
_AT_HOME_M = 5.0
"""A landing so near to home is one at home to a return. [m]"""
_HEIGHTS = 201
"""At how many heights of a landing it is looked for where the floor is. [-]"""
_HOME_FRAMES = frozenset({1.0, 2.0})
"""FENCE_ALT_MAX_TP and FENCE_ALT_MIN_TP of heights above home, and above the origin, which is there."""

FENCE_HEIGHT = Rule(
    "F110 fence-height",
    Severity.ERROR,
    summary="The flight leaves the heights the fence allows.",
    why="A ceiling is a fence: passing it ends the mission in the air; a return altitude above it "
    "breaches the fence on every return.",
    how="The highest place of the flight above the home that counts then, along the whole path (splines "
    "swing over their items), and the height returns climb to, against GF_MAX_VER_DIST (PX4) or "
    "FENCE_ALT_MAX (ArduPilot, FENCE_TYPE bit 1; legs that follow terrain are as high as that is between its "
    "posts, as in A102; its returns stay below it, but over the hills of --terrain where RTL_ALT_TYPE has "
    "them follow it, or where DO_FENCE_ENABLE 1 stands behind another DO_ item right before the return); the "
    "lowest place between take-off and landing against FENCE_ALT_MIN (bit 8), and take-offs from the ground "
    "and landings where DO_FENCE_ENABLE 1 has switched the floor on, which ArduPilot then leaves on "
    "(FENCE_ACTION 0 and 2 land, those that return land at home, with RTL_CONE_SLOPE, but by a return begun "
    "anew, by SmartRTL up to the height of the take-off: a warning of its time, an error where it ends below "
    "the reserve, or is SmartRTL above the height "
    "of the take-off or beside it, back through all of the flight), or returns of the vehicle's own "
    "meanwhile.  An error from 0.5 m below a ceiling on, the vertical accuracy that makers state, a warning "
    "from 2 m on, the default of ArduPilot's FENCE_MARGIN: PX4 was recorded up to 1.6 m above commanded "
    "heights.  Not checked (X904) where FENCE_ALT_MAX_TP or FENCE_ALT_MIN_TP has a limit that is used count "
    "from sea level (0) or the ground (3).",
    fix="fly lower, or raise the limit",
    instead="a mission within the heights of the fence",
)


@judges(FENCE_HEIGHT, needs=(FENCE,))
def _fence_height(a: Assessment, limits: FenceLimits) -> Iterator[Finding]:
    stages = a.route.stages
    if not stages or (limits.ceiling_m is None and limits.floor_m is None):
        return
    schedule = fence_schedule(a.route, a.own_parameters)
    flown = _flown_heights(a)
    if limits.ceiling_m is not None and schedule.limits.any():
        ceiling = f"{limits.ceiling_name} is {quantity.height(limits.ceiling_m)}"
        under_m = np.where(schedule.limits[flown.stage], flown.highest_m, -np.inf)
        highest_m = float(under_m.max())
        return_m = _highest_return_m(a, schedule.limits)
        if (severity := _height_severity(limits.ceiling_m - highest_m)) is not None and (
            highest_m >= return_m or severity is Severity.ERROR
        ):
            height = quantity.beside(highest_m, limits.ceiling_m, quantity.height)
            first = int((under_m > highest_m - _SLACK_M).argmax())
            yield a.finding(
                FENCE_HEIGHT,
                f"{height} above {flown.home(first)}; {ceiling}",
                severity=severity,
                item=stages[flown.stage[first]].item,
            )
        elif (severity := _height_severity(limits.ceiling_m - return_m)) is not None:
            returns = [
                s.item
                for s, is_on in zip(stages, schedule.limits, strict=True)
                if s.kind is StageKind.RETURN and is_on
            ]
            yield a.finding(
                FENCE_HEIGHT,
                f"a return climbs to {quantity.beside(return_m, limits.ceiling_m, quantity.height)} above "
                f"home; {ceiling}",
                severity=severity,
                item=returns[0] if returns else None,
                fix="lower the return altitude, or raise the limit",
            )
    over_m = np.where(schedule.floor[flown.stage], flown.lowest_m, np.inf)
    lowest_m = float(over_m.min())
    if limits.floor_m is None:
        return
    if (severity := _height_severity(lowest_m - limits.floor_m)) is not None:
        first = int((over_m < lowest_m + _SLACK_M).argmax())
        yield a.finding(
            FENCE_HEIGHT,
            f"{quantity.beside(lowest_m, limits.floor_m, quantity.height)} above {flown.home(first)}; "
            f"{limits.floor_name} is {quantity.height(limits.floor_m)}",
            severity=severity,
            item=stages[flown.stage[first]].item,
            fix="fly higher, or lower the limit",
        )


@judges(FENCE_HEIGHT, needs=(ARDUPILOT,))
def _landings_below_the_floor(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Yield landings that a floor ends which the mission has switched on: ArduPilot leaves it on for them."""
    floor_m, action = limits_in_use(a.route, parameters).floor_m, parameters.fence_action
    if not parameters.smart_return_points:
        action = _WITHOUT_SMART_RETURN.get(action, action)
    if floor_m is None or action in _LANDS_ALL_THE_SAME:
        return
    own_m = parameters.return_altitude_m
    climbs = parameters.return_cone_slope < _LEAST_SLOPE and (
        own_m > floor_m or parameters.return_climb_min_m > 0.0
    )
    by_mission = fence_schedule(a.route, parameters).floor_by_mission
    places, does = a.returns.destinations, "returns" if action in _RETURNS else "stops and hovers"
    does = (
        f"FENCE_ALT_MIN is {quantity.height(floor_m)}: ArduPilot leaves on a floor that DO_FENCE_ENABLE has "
        f"switched on, and {does} there"
    )
    is_told = False
    for row in a.route.rows_of(*LANDED_STAGES):
        stage, home = a.route.stages[row], int(places.home_of(np.array([row]))[0])
        height_m = stage.height_m - float(places.home_datum_m[home])
        if stage.kind is StageKind.RETURN:
            height_m += parameters.return_final_altitude_m
        from_home_m = math.dist((stage.east_m, stage.north_m), places.home_ground_m[home, :2])
        is_home = stage.kind is StageKind.RETURN or from_home_m < _AT_HOME_M
        if not by_mission[row] or height_m > floor_m:
            continue
        severity, ending = Severity.ERROR, ""
        if is_home and action in _RETURNS and not climbs:
            level_m = floor_m + float(places.home_datum_m[home])
            begun_anew = _begun_anew(a, row, level_m, by_own_track=action in _BY_OWN_TRACK)
            if begun_anew is None:
                continue
            severity, ending = begun_anew
        is_told = True
        yield a.finding(
            FENCE_HEIGHT,
            f"lands {quantity.height(height_m)} above home, {does}{ending}",
            item=stage.item,
            severity=severity,
            fix="switch the floor off before the landing: DO_FENCE_ENABLE 2",
        )
    returns_anew = action in _RETURNS and not climbs
    if returns_anew and action in _BY_OWN_TRACK:
        from planner.rules.returns_anew import closes_its_track

        returns_anew = closes_its_track(a, np.array((0.0, 0.0, floor_m)))
    if not is_told and not returns_anew:
        yield from _own_returns_below(a, parameters, floor_m, does)


def _own_returns_below(
    a: Assessment, parameters: ArduPilotParameters, floor_m: float, does: str
) -> Iterator[Finding]:
    """Yield the first stage on which a return of the vehicle's own ends below the floor.

    Nothing switches the floor off meanwhile.
    """
    by_mission = fence_schedule(a.route, parameters).floor_by_mission
    places = a.returns.destinations
    for row in np.flatnonzero(by_mission).tolist():
        stage, home = a.route.stages[row], int(places.home_of(np.array([row]))[0])
        ends_m = float(places.home_ground_m[home, 2] - places.home_datum_m[home])
        ends_m += parameters.return_final_altitude_m
        # A take-off that the floor ends is told below.
        if stage.kind not in {StageKind.TAKEOFF, *_ON_THE_GROUND} and ends_m <= floor_m:
            yield a.finding(
                FENCE_HEIGHT,
                f"a return of the vehicle's own ends {quantity.height(ends_m)} above home, {does}",
                item=stage.item,
                fix="set FENCE_ACTION 1, which lands at home all the same, or leave the floor off",
            )
            return


def _begun_anew(
    a: Assessment, row: int, level_m: float, *, by_own_track: bool
) -> tuple[Severity, str] | None:
    """Return what a return brings that a floor begins anew in a landing at home; ``None``: next to nothing.

    ``ModeRTL::init`` stops, climbs by its cone, and waits over home once more.  Flown with a floor of 5 m:
    9 s later, with RTL_LOIT_TIME 60 s 64 s.
    """
    from planner.rules.returns_anew import (
        closes_its_track,
        later_text,
        return_short_wh,
        up_its_track,
    )

    returns, motion = a.returns, a.flight.motion
    [*_, last] = segments = np.flatnonzero(returns.segment_stage == row).tolist()
    lands_s = float(motion.segments.end_s[last])
    time_s = np.linspace(float(returns.start_s[segments[0]]), lands_s, _HEIGHTS)
    above = time_s[motion.state_at_time(time_s).height_m > level_m]
    points = returns.points(*returns.at(above[-1:] if len(above) else time_s[:1]))
    if by_own_track:
        if not closes_its_track(a, points.place_m[0]):
            return Severity.ERROR, ", by its own track, through all of the flight"
        returns = up_its_track(a)
    short_wh = return_short_wh(a, points, returns)
    if short_wh > 0.0:
        return (
            Severity.ERROR,
            f": the return begun anew ends {quantity.energy(short_wh)} below the reserve",
        )
    later = later_text(a, points, returns, lands_s=lands_s, by_own_track=by_own_track)
    return (Severity.WARNING, f": {later}") if later else None


@judges(FENCE_HEIGHT, needs=(ARDUPILOT,))
def _take_offs_below_the_floor(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Yield take-offs with a floor on already: on the ground ArduPilot does not arm by it, or disarms."""
    floor_m = limits_in_use(a.route, parameters).floor_m
    if floor_m is None or not parameters.fence_action:
        return
    by_mission = fence_schedule(a.route, parameters).floor_by_mission
    places, stages = a.returns.destinations, a.route.stages
    for row in a.route.rows_of(StageKind.TAKEOFF):
        stands = row == 0 or stages[row - 1].kind in LANDED_STAGES
        home = int(places.home_of(np.array([row]))[0])
        height_m = stages[row - 1].height_m if row else 0.0
        height_m -= float(places.home_datum_m[home])
        if by_mission[row] and stands and height_m <= floor_m:
            yield a.finding(
                FENCE_HEIGHT,
                f"DO_FENCE_ENABLE switches a floor on where the vehicle stands {quantity.height(height_m)} "
                f"above home, FENCE_ALT_MIN is {quantity.height(floor_m)}: it does not arm, or disarms",
                item=stages[row].item,
                fix="put DO_FENCE_ENABLE behind the first place above the floor",
            )


@judges(FENCE_HEIGHT, needs=(ARDUPILOT,))
def _fence_height_not_over_home(
    a: Assessment, parameters: ArduPilotParameters
) -> Iterator[NotEvaluated]:
    """Yield the limits of heights that count from sea level or the ground: since 4.7 ArduCopter has them."""
    limits = limits_in_use(a.route, parameters)
    for name, limit_m in (("FENCE_ALT_MAX", limits.ceiling_m), ("FENCE_ALT_MIN", limits.floor_m)):
        counts_from = numbers(a).get(f"{name}_TP", 1.0)
        if limit_m is not None and counts_from not in _HOME_FRAMES:
            yield NotEvaluated(
                rule=FENCE_HEIGHT,
                asked_by=f"{name} with {name}_TP {counts_from:g}",
                needs=f"a height above home: {name}_TP 1",
            )


def _height_severity(left_m: float) -> Severity | None:
    """Return how grave it is to stay so far within a height; ``None``: far enough."""
    if left_m < _HEIGHT_ERROR_M - _SLACK_M:
        return Severity.ERROR
    return Severity.WARNING if left_m < _HEIGHT_MARGIN_M - _SLACK_M else None


class _FlownHeights(Value, eq=False):
    """Heights of a flight above whichever home counts: of its items, then of the path between them."""

    assessment: Assessment
    stage: IntArray
    """Position in the route's stages of each part. (n,)"""
    highest_m: FloatArray
    """(n,) [m]"""
    lowest_m: FloatArray
    """Infinite where it is on the way up from the ground, or down to it. (n,) [m]"""

    def home(self, part: int) -> str:
        """Return which home a part counts from, in words."""
        number = int(self.assessment.returns.destinations.home_of(self.stage[part]))
        moved = self.assessment.route.moved_homes
        return f"the home of item {moved[number - 1].item}" if number else "home"


def _flown_heights(a: Assessment) -> _FlownHeights:
    """Return the heights a flight reaches: as its items ask for, and as they are flown between them.

    Notes
    -----
    ``AC_Fence::check_fence_alt_max`` and ``check_fence_alt_min`` take the height above the home that counts
    then (``get_relative_position_D_home``), ``Geofence::isBelowMaxAltitude`` of PX4 too.  Switched on in
    flight, a limit counts from the height there is then.  How high a return climbs is looked at by itself.
    """
    from planner.rules.terrain_posts import heights_by_posts_m

    stages, returns = a.route.stages, a.returns
    every = np.arange(len(stages))
    end_m = np.array([stage.height_m for stage in stages])
    by_posts, posted_m = heights_by_posts_m(a)
    begins_by_posts = np.isin(every - 1, by_posts)
    start_m = np.where(begins_by_posts, end_m, np.concatenate((end_m[:1], end_m[:-1])))
    flies = np.array([stage.kind not in _ON_THE_GROUND for stage in stages])
    begins_m = np.where(np.concatenate(([False], flies[:-1])), start_m, np.inf)
    least_m = np.where(flies, np.minimum(begins_m, end_m), np.inf)
    most_m = np.maximum(start_m, end_m)

    path = a.path
    stage = returns.segment_stage[path.segment]
    legs_m = np.stack((path.height_m[:-1], path.height_m[1:]))
    is_level = ~np.isin(a.flight.motion.segments.state[path.segment], _NOT_AIRBORNE)
    # A return that began while the fence was off climbs past a ceiling that is switched on meanwhile.
    judged = [s.kind in _PATH_JUDGED or s.return_ceiling_m == math.inf for s in stages]
    kept = np.array(judged)[stage] & ~np.isin(stage, by_posts)
    every = every[~np.isin(every, by_posts)]
    parts = np.concatenate((every, stage[kept], by_posts))
    datum_m = returns.destinations.home_datum_m[returns.destinations.home_of(parts)]
    least_leg_m = np.where(is_level, legs_m.min(axis=0), np.inf)
    return _FlownHeights(
        assessment=a,
        stage=parts,
        highest_m=np.concatenate((most_m[every], legs_m.max(axis=0)[kept], posted_m[1])) - datum_m,
        lowest_m=np.concatenate((least_m[every], least_leg_m[kept], posted_m[0])) - datum_m,
    )


def _highest_return_m(a: Assessment, is_on: BoolArray) -> float:
    """Return the greatest height above home that the vehicle's own returns climb to, as it flies them.

    Only from stages ``is_on``; home's without any.

    ArduPilot's stay below its fence; PX4's count from the place they lead to.
    """
    from planner.rules.terrain_following import tops_over_terrain_m

    returns = a.returns
    points = [returns.end_points(returns.stage_ends)]
    if returns.sample is not None:
        points.append(returns.sample.points)
    places = returns.destinations
    heights_m = []
    for own in points:
        homeward = returns.chosen(own)
        corners_m, _ = returns.straight_corners_m(own, homeward)
        top_m = np.maximum(corners_m[:, 2, 2], tops_over_terrain_m(a, own, homeward))
        top_m -= places.home_datum_m[places.home_of(own.stage)]
        heights_m.append(top_m[is_on[own.stage]])
    # Those of the mission as they are flown: PX4 may begin one farther off than its stage.
    stage = returns.segment_stage[a.path.segment]
    flown_m = np.maximum(a.path.height_m[:-1], a.path.height_m[1:])
    flown_m = flown_m - places.home_datum_m[places.home_of(stage)]
    is_return = np.isin(stage, a.route.rows_of(StageKind.RETURN)) & is_on[stage]
    heights_m.append(flown_m[is_return])
    return float(np.concatenate(heights_m).max(initial=0.0))
