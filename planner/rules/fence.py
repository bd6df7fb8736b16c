"""Rules on the fence: what is wrong with it, and where a flight or a return crosses it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import FlightStretch, Rule, Severity
from planner.flight.fence_schedule import fence_schedule, waits_for_guided
from planner.flight.pilot import is_of_ardupilot
from planner.geo.barrier import make_fence_frame
from planner.geo.fence import INCLUSION_SEMANTICS, INVALID_POLYGON, make_fence_area
from planner.mission.commands import TERRAIN_FRAMES
from planner.mission.items import MissionFormat
from planner.mission.route.stage import FenceAction, StageKind
from planner.rules.assessment import numbers
from planner.rules.declaration import FENCE, NotEvaluated, judges
from planner.rules.energy import destination_name
from planner.rules.fence_height import FENCE_HEIGHT
from planner.rules.fence_settings import inclusions_unite, is_from_file, why_not_enforced
from planner.rules.fenced_flight import straight_legs
from planner.rules.left_open import IN_SIGHT_M
from planner.rules.stop_buffer import STOP_BUFFER, stop_buffer

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding, Place
    from planner.geo.barrier import Barrier
    from planner.geo.fence import Fence, RallyPoint
    from planner.geo.geodesy import LocalFrame
    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment
    from planner.rules.fence_settings import FenceLimits
    from planner.rules.fenced_flight import FencedFlight
    from planner.vehicle.parameters.resolve import FlightParameters

_ONE_PLACE_M = 1e-3
"""Parts of the path no farther from each other continue each other: rounding of sums. [m]"""
_PX4_POINTS = 64
"""Points PX4 stores (``DM_KEY_FENCE_POINTS_MAX``); 16 on small boards."""
_ARDUPILOT_VERTICES = 255
"""ArduPilot counts the vertices of a polygon in one byte."""
_LINES_COMPARED = 100
"""Of a leg flown ten thousand times, the returns that the worst is looked for among, evenly spread."""
_LINES_BETWEEN = 33
"""Of each piece of a leg, with those of its ends."""
_OA_MARGIN_M = 5.0
"""Default of OA_MARGIN_MAX. [m]"""

FENCE_TOO_LARGE = Rule(
    "F112 fence-too-large",
    Severity.WARNING,
    summary="The fence has more points than the autopilot can hold.",
    why="A fence that does not fit is refused or cut, and the vehicle flies without one.",
    how="PX4 stores 64 points (16 on small boards): the vertices of all polygons and one for each "
    "circle.  ArduPilot counts the vertices of a polygon in one byte: 255 at most.",
    fix="draw the fence with fewer vertices",
)


FENCE_OFF = Rule(
    "F111 fence-not-enforced",
    Severity.WARNING,
    summary="The vehicle's parameters or the mission disable the fence.",
    why="A fence that is uploaded but switched off looks like one that protects.",
    how="ArduPilot: FENCE_ENABLE and FENCE_AUTOENABLE are 0; FENCE_AUTOENABLE is 1, or 2 with FENCE_ENABLE "
    "0, which switch the fence on after a take-off in GUIDED, not in AUTO (ModeGuided::takeoff_run; flown: a "
    "return climbs past FENCE_ALT_MAX), and the mission does not; FENCE_TYPE has no bit 4 (polygons and "
    "circles), or FENCE_ACTION is 0 (report only).  PX4: GF_ACTION is 0 or 1 (warning only).  Only for "
    "values in a parameter file; and DO_FENCE_ENABLE 0 on ArduPilot: the parts of the flight after it "
    "are not judged by the fence.",
    fix="enable the fence before the flight; on ArduPilot with FENCE_AUTOENABLE 3",
)


RALLY_OUTSIDE = Rule(
    "F103 rally-outside",
    Severity.ERROR,
    summary="A rally point is outside the fence.",
    why="A return to a rally point outside the fence is a breach: it ended in LAND and a crash "
    "(ArduPilot #7333).",
    how="Each rally point against every area of the fence that is on during the flight, and against the "
    "circle around home where that is on throughout: while it is on, ArduPilot returns to no point beyond "
    "it, and while DO_FENCE_ENABLE has it off that is no breach.",
    fix="move the rally point, or the fence",
    instead="a rally point inside the fence",
)


HOME_OUTSIDE = Rule(
    "F104 home-outside",
    Severity.ERROR,
    summary="Home is outside the fence.",
    why="ArduPilot does not arm outside its fence, PX4 discards a fence that does not contain home "
    "(PX4 #27099), and a return ends in a breach.",
    how="The home of the mission against every area of the fence.",
    fix="move the fence, or the planned home to the place of take-off",
    instead="a fence around home",
)


PATH_CROSSES = Rule(
    "F101 path-crosses",
    Severity.ERROR,
    summary="The flight leaves the fence.",
    why="PX4 checks waypoints only: the leg between two of them may cross an exclusion (PX4 #22255); "
    "a breach ends the mission in the air.",
    how="The whole path as it is flown, corners cut or flown through, splines, take-off and landing, "
    "against every area of the fence and the circle that GF_MAX_HOR_DIST or FENCE_RADIUS draws around "
    "the home that counts (DO_SET_HOME takes it along), wherever the fence is on: by parameters, and by "
    "DO_FENCE_ENABLE in flown order.  Curves are divided until straight pieces are within 5 cm of them; "
    "whole pieces are cut with whole edges, so that no crossing falls between two samples.  ArduPilot's "
    "splines are taken where the lag of the lean (ATC_INPUT_TC) and drag carry the vehicle, beside their "
    "curve.  Legs and edges "
    "are drawn as the autopilot takes them: PX4's edges are straight in degrees and its legs in metres, "
    "ArduPilot's are both straight in its own metres.  A step-response model stops at corners: where the "
    "autopilot of --params cuts one by more than --position-error and passes the fence there, it is not "
    "evaluated (X904), nor are the ground (A102) and the distance a site allows (M122).",
    fix="move the waypoint, or the fence",
    instead="a mission inside its fence",
)


LOITER_CROSSES = Rule(
    "F107 loiter-crosses",
    Severity.ERROR,
    summary="A loiter circle leaves the fence.",
    why="A circle of 200 m with its centre in the clear was flown 28.9 m into an exclusion (PX4 "
    "#28527): only centres are checked on board.",
    how="The circle as it is flown, its arcs divided until chords are within 5 cm of them.",
    fix="move the centre, or make the circle smaller",
    instead="a circle inside the fence",
)


RTL_PATH_CROSSES = Rule(
    "F108 rtl-path-crosses",
    Severity.ERROR,
    summary="A return that the vehicle would fly by itself crosses the fence.",
    why="A return flies straight: from a bay of the fence, or past an exclusion, it breaches the "
    "fence in the middle of another emergency, with nobody to stop it: what is kept out of is flown "
    "over as surely as on a leg of the mission (F101).",
    how="The straight line from every place of the flight, and from where a stop begun there ends, to "
    "where the vehicle itself would return (home, a rally point or the mission's landing), and what it "
    "follows of the mission from there: the triangle between each piece of the path and the target, so "
    "that no place is left out; within --position-error of the fence it crosses, as the flight does "
    "(F102).  The return a mission flies itself is part of its path: F101.",
    fix="add a rally point with a clear return, or move the waypoint",
    instead="a rally point with a clear return",
)


FENCE_IN_PART = Rule(
    "F109 fence-checked-in-part",
    Severity.ERROR,
    summary="The file has no home: the fence is not checked on the way from there and back.",
    why="A circle of the parameters lies about home, the flight begins there and returns lead there; none of "
    "them is where the file says nothing.",
    how="No planned home, and an edge of the fence or a greatest distance from home within 500 m of all the "
    "flight, as far as a small multicopter is seen (a warning for drawings and other makers' missions, which "
    "tell none); limits of height above home where items have altitudes AMSL or above terrain and no "
    "--home-amsl is given.",
    fix="save the mission with its planned home",
    instead="a mission with its home",
)


WAY_AROUND = Rule(
    "F113 way-around-fence",
    Severity.ERROR,
    summary="ArduPilot does not fly the mission's lines: its path planner keeps away from the fence.",
    why="With BendyRuler and waypoints 4 m inside an inclusion polygon ArduCopter 4.7 never reached the "
    "second item: it stopped, sank at 1.5 m/s and hit the ground.  None of that is predicted.",
    how="OA_TYPE of --params other than 0 (BendyRuler, Dijkstra), and a place of the flight nearer than "
    "OA_MARGIN_MAX, 5 m by default, to the edge of an area (AP_OABendyRuler, AP_OADijkstra).  Farther off it "
    "flies the lines, splines too, straight, and stops at every place, which is predicted (8 legs: 215.3 s "
    "flown, 176.0 without), but with bit 4 of OA_OPTIONS: Dijkstra stops nowhere then, BendyRuler at all but "
    "splines.",
    fix="keep so far from the fence, or set OA_TYPE 0",
    instead="OA_TYPE 0, or a mission that keeps OA_MARGIN_MAX from the fence",
)


@judges(WAY_AROUND, needs=(FENCE,))
def _way_around(a: Assessment, _limits: FenceLimits) -> Iterator[Finding]:
    given = numbers(a)
    planner = given.get("OA_TYPE", 0.0)
    if a.autopilot is not Autopilot.ARDUPILOT or not planner:
        return
    margin_m = given.get("OA_MARGIN_MAX", _OA_MARGIN_M)
    flown = a.fenced
    legs = flown.legs(np.arange(len(flown.group)))
    nearest = [
        (float(clearance_m.min()), int(clearance_m.argmin()), barrier)
        for barrier in flown.area.barriers
        if len(clearance_m := barrier.leg_clearance(legs).clearance_m)
    ]
    if not nearest:
        return
    near_m, leg, barrier = min(nearest, key=lambda one: one[0])
    if near_m < margin_m:
        yield a.finding(
            WAY_AROUND,
            f"the vehicle is led away from {barrier.label} by OA_TYPE {planner:g}: the flight comes within "
            f"{quantity.height(max(near_m, 0.0))} of it, OA_MARGIN_MAX is {quantity.height(margin_m)}; "
            "where it flies then is not predicted",
            item=int(flown.path.item[leg]),
        )


@judges(FENCE_TOO_LARGE, FENCE_OFF, INVALID_POLYGON, needs=(FENCE,))
def _fence_itself(a: Assessment, _limits: FenceLimits) -> Iterator[Finding]:
    own = a.own_parameters
    acts = bool(fence_schedule(a.route, own, acts=True).limits.any())
    off = next((one for one in a.route.fence_switches if one.action is FenceAction.OFF), None)
    if a.mission.fence:
        yield from _size(a.autopilot, a.mission.fence)
        yield from _enforcement(own, is_switched_on=acts)
    elif is_of_ardupilot(own) and waits_for_guided(own) and not acts and off is None:
        # Of limits alone the other reasons are what their user has chosen.
        yield from _enforcement(own)
    if off is not None:
        yield a.finding(
            FENCE_OFF,
            "DO_FENCE_ENABLE 0: the mission switches the fence off; what is flown without it is not "
            "judged",
            item=off.item,
            fix="remove the item, or keep to the fence by other means",
        )


@judges(PATH_CROSSES, FENCE_HEIGHT, needs=(FENCE,))
def _switched_on(a: Assessment, _limits: FenceLimits) -> Iterator[NotEvaluated]:
    """Yield that the mission switches on a fence of which nothing is known."""
    on = a.route.fence_switched_on
    if on is not None and not (a.mission.fence or is_from_file(a.own_parameters)):
        yield NotEvaluated(
            rule=PATH_CROSSES,
            asked_by=f"DO_FENCE_ENABLE of item {on.item}",
            needs="the fence: --params with its FENCE_ parameters, or a plan that holds its areas",
            item=on.item,
        )


@judges(
    INVALID_POLYGON,
    INCLUSION_SEMANTICS,
    RALLY_OUTSIDE,
    HOME_OUTSIDE,
    PATH_CROSSES,
    LOITER_CROSSES,
    STOP_BUFFER,
    RTL_PATH_CROSSES,
    FENCE_IN_PART,
    needs=(FENCE,),
)
def _fenced_flight(a: Assessment, limits: FenceLimits) -> Iterator[Finding]:
    yield from flight_in_fence(a)
    if a.mission.home is not None or a.setup.home_amsl_m is not None:
        return
    over_terrain = [
        one.item
        for one in a.route.stages
        if one.item > 0 and a.mission.items[one.item - 1].frame in TERRAIN_FRAMES
    ]
    numbers = sorted({*a.route.amsl_items, *over_terrain})
    if numbers and (limits.ceiling_m, limits.floor_m) != (None, None):
        yield a.finding(
            FENCE_IN_PART,
            "no home in the file: how high above it items with altitudes AMSL or above terrain are is not "
            "checked against the fence",
            item=numbers[0],
            fix="save the mission with its planned home, or give --home-amsl",
        )


def flight_in_fence(a: Assessment) -> Iterator[Finding]:
    """Yield what is wrong with the areas of a fence, and where a flight or its returns leave them."""
    flown = a.fenced
    yield from flown.area.findings
    states_home = a.mission.file_format is not MissionFormat.FOREIGN
    if a.mission.home is None and not all(
        flown.is_clear_of(barrier, beside_m=IN_SIGHT_M) for barrier in flown.area.barriers
    ):
        yield a.finding(
            FENCE_IN_PART,
            "no home in the file: the way from there to the first place, returns and distances from home are "
            "not checked against the fence",
            severity=None if states_home else Severity.WARNING,
        )
    barriers = [barrier for barrier in flown.area.barriers if not flown.is_clear_of(barrier)]
    if not barriers:
        return
    home, rally = a.route.frame, a.mission.rally
    of_start = [barrier for barrier in barriers if not flown.is_of_moved_home(barrier)]
    yield from _home_outside(flown.frame, of_start, (home.latitude_deg, home.longitude_deg))
    yield from _rally_outside(
        flown.frame, [b for b in of_start if flown.keeps_from_rally(b)], rally
    )
    crossing, findings = _crossings(flown, barriers)
    yield from findings
    yield from stop_buffer(flown, barriers, crossing)
    yield from _returns(flown, barriers, crossing)


def fence_alone(
    mission: Mission, autopilot: Autopilot, parameters: FlightParameters | None
) -> Iterator[Finding]:
    """Yield what is wrong with the fence and the rally points of a mission that flies nowhere."""
    fence, home = mission.fence, mission.home
    if not fence:
        return
    home_deg = None if home is None else (home.latitude_deg, home.longitude_deg)
    frame = make_fence_frame(fence, home_deg)
    area = make_fence_area(fence, frame, inclusions_unite=inclusions_unite(parameters))
    yield from _size(autopilot, fence)
    yield from _enforcement(parameters)
    yield from area.findings
    if home_deg is not None:
        yield from _home_outside(frame, area.barriers, home_deg)
    yield from _rally_outside(frame, area.barriers, mission.rally)


def _size(autopilot: Autopilot, fence: Fence) -> Iterator[Finding]:
    for polygon in fence.polygons:
        longitudes_deg = [longitude_deg for _, longitude_deg in polygon.vertices_deg]
        if max(longitudes_deg, default=0.0) - min(longitudes_deg, default=0.0) > 180.0:
            # PX4's Geofence::insidePolygon; ArduPilot's Polygon_outside, on latitudes and longitudes (1e-7°)
            yield INVALID_POLYGON.finding(
                "fence polygon across the 180th meridian: PX4 and ArduPilot take its area to lie the other "
                "way round the Earth",
                place=polygon.place,
                fix="keep the fence and the flight on one side of the meridian, or draw a circle",
            )
    if autopilot is Autopilot.PX4:
        points = sum(len(p.vertices_deg) for p in fence.polygons) + len(fence.circles)
        if points > _PX4_POINTS:
            yield FENCE_TOO_LARGE.finding(f"{points} points in the fence; PX4 holds {_PX4_POINTS}")
    elif autopilot is Autopilot.ARDUPILOT:
        for polygon in fence.polygons:
            if len(polygon.vertices_deg) > _ARDUPILOT_VERTICES:
                yield FENCE_TOO_LARGE.finding(
                    f"fence polygon with {len(polygon.vertices_deg)} vertices; ArduPilot takes "
                    f"{_ARDUPILOT_VERTICES}",
                    place=polygon.place,
                )
                return


def _enforcement(
    parameters: FlightParameters | None, *, is_switched_on: bool = False
) -> Iterator[Finding]:
    if (reason := why_not_enforced(parameters, is_switched_on=is_switched_on)) is not None:
        yield FENCE_OFF.finding(reason)


def _home_outside(
    frame: LocalFrame, barriers: Sequence[Barrier], home_deg: tuple[float, float]
) -> Iterator[Finding]:
    yield from _outside(HOME_OUTSIDE, "home", frame, barriers, degrees=home_deg)


def _rally_outside(
    frame: LocalFrame, barriers: Sequence[Barrier], rally: Sequence[RallyPoint]
) -> Iterator[Finding]:
    for number, point in enumerate(rally, start=1):
        yield from _outside(
            RALLY_OUTSIDE,
            f"rally point {number}",
            frame,
            barriers,
            degrees=(point.latitude_deg, point.longitude_deg),
            place=point.place,
        )


def _outside(
    rule: Rule,
    name: str,
    frame: LocalFrame,
    barriers: Sequence[Barrier],
    *,
    degrees: tuple[float, float],
    place: Place | None = None,
) -> Iterator[Finding]:
    """Yield the finding where a place is outside a barrier."""
    if not barriers:
        return
    point_m = np.column_stack(frame.east_north_m([degrees[0]], [degrees[1]]))
    inside_m = [float(barrier.signed_distance_m(point_m)[0]) for barrier in barriers]
    away_m = -min(inside_m)
    if away_m <= 0.0:
        return
    barrier = barriers[inside_m.index(-away_m)]
    side = "outside" if barrier.keep_inside else "inside"
    there = (round(degrees[0], 7), round(degrees[1], 7))
    yield rule.finding(
        f"{name} is {quantity.distance(away_m)} {side} {barrier.label}",
        place=place,
        stretch=FlightStretch(start_deg=there, end_deg=there, distance_m=away_m),
    )


def _crossings(flown: FencedFlight, barriers: list[Barrier]) -> tuple[set[int], list[Finding]]:
    """Return the groups of legs that are outside somewhere, and the findings on the flight."""
    a = flown.assessment
    crossing: set[int] = set()
    found: list[tuple[int, float, float, int]] = []
    for number, barrier in enumerate(barriers):
        chosen = flown.legs_near(barrier)
        if not len(chosen):
            continue
        pieces = barrier.spans_outside(flown.legs(chosen))
        legs = chosen[pieces.leg].tolist()
        crossing.update(flown.group[legs].tolist())
        starts_m, ends_m = pieces.start_m.tolist(), pieces.end_m.tolist()
        found += zip(legs, starts_m, ends_m, [number] * len(legs), strict=True)
    findings = []
    for rule, what, of_circle in (
        (PATH_CROSSES, "flight", False),
        (LOITER_CROSSES, "loiter circle", True),
    ):
        pieces_of_rule = [one for one in found if flown.path.is_circle[one[0]] == of_circle]
        if not pieces_of_rule:
            continue
        leg, _, _, number = min(pieces_of_rule)
        before_m = flown.along_path_m
        stretch = flown.flown_stretch(
            _joined(
                (before_m[leg] + start, before_m[leg] + end)
                for leg, start, end, _ in pieces_of_rule
            )
        )
        item = int(flown.path.item[leg])
        items = {int(flown.path.item[one[0]]) for one in pieces_of_rule}
        others = len({one[3] for one in pieces_of_rule}) - 1
        barrier = barriers[number]
        does = "leaves" if barrier.keep_inside else "enters"
        findings.append(
            a.finding(
                rule,
                f"{'return' if item in _own_returns(a) else what} {does} {barrier.label}"
                + (f" and later {quantity.count(others, 'other area')}" if others else "")
                + f": {quantity.distance(stretch.distance_m)} flown in breach of the fence"
                + (f", at {quantity.count(len(items), 'item')}" if len(items) > 1 else ""),
                item=item,
                stretch=stretch,
            )
        )
    return crossing, findings


def _own_returns(a: Assessment) -> list[int]:
    """Return the items that are the mission's own return."""
    return [stage.item for stage in a.route.stages_of(StageKind.RETURN)]


def _joined(pieces_m: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return parts of a path in order, those joined that continue over a corner or overlap. [m]"""
    parts: list[tuple[float, float]] = []
    for start_m, end_m in sorted(pieces_m):
        if parts and start_m <= parts[-1][1] + _ONE_PLACE_M:
            parts[-1] = (parts[-1][0], max(parts[-1][1], end_m))
        else:
            parts.append((start_m, end_m))
    return parts


def _returns(flown: FencedFlight, barriers: list[Barrier], crossing: set[int]) -> Iterator[Finding]:
    """Yield a finding where a return crosses the fence.

    Groups of legs that are outside themselves are left out: they have findings already.
    """
    returns, path = flown.returns, flown.path
    judged = ~np.isin(flown.group, list(crossing))
    # The mission's own return is checked as its path already.
    judged &= ~np.isin(path.item, _own_returns(flown.assessment))
    for barrier in barriers:
        is_near = flown.is_path_near(barrier)
        on = flown.is_on(barrier)
        rows = np.flatnonzero((judged & on & ~is_near)[returns.leg])
        # Home or a rally point outside, home near to the fence, are reported once, not for each return.
        away_m = barrier.signed_distance_m(returns.end_m[rows, 0])
        ends = returns.is_end_judged[rows] & (not flown.is_of_moved_home(barrier))
        is_reported = ends & (away_m < flown.position_error_m) & bool(is_near.any())
        margin_m = np.where(is_reported, 0.0, flown.position_error_m)
        open_ends = ~ends | (away_m >= 0.0)
        cut = _cut_off(flown, barrier, rows[open_ends], margin_m[open_ends])
        if len(cut):
            yield _return_crosses(flown, barrier, cut)
            return
        if is_near.any() or crossing or not on.any():
            continue
        along_m = barrier.leg_clearance(returns.along).clearance_m
        if along_m.min(initial=np.inf) < flown.position_error_m:
            yield _along_crosses(flown, barrier, int(along_m.argmin()), float(along_m.min()))
            return


def _cut_off(
    flown: FencedFlight, barrier: Barrier, rows: IntArray, margin_m: FloatArray
) -> IntArray:
    """Return the rows whose returns pass a barrier within a margin of each, or cross it from a stop."""
    returns = flown.returns
    if not len(rows):
        return rows
    most_m = float(margin_m.max())
    _, group = np.unique(flown.group[returns.leg[rows]], return_inverse=True)
    near = returns.areas(rows, group, with_stops=True).near(barrier, most_m)[group]
    rows, margin_m = rows[near], margin_m[near]
    if not len(rows):
        return rows
    cut = np.zeros(len(rows), bool)
    for within_m in sorted({0.0, most_m}):
        asked = np.flatnonzero((margin_m > 0.0) == (within_m > 0.0))
        if len(asked):
            straight = returns.areas(rows[asked], np.arange(len(asked)))
            cut[asked] = straight.near(barrier, within_m)
    swung = np.flatnonzero(~cut)
    if len(swung):
        around = returns.areas(rows[swung], np.arange(len(swung)), with_stops=True)
        swung = swung[around.near(barrier, 0.0)]
    if len(swung):  # a stop that crosses the fence is F102's
        begun, stood = (
            both[rows[swung]].reshape(-1, 2) for both in (returns.place_m, returns.stop_m)
        )
        stands = barrier.leg_clearance(straight_legs(begun, stood)).clearance_m >= 0.0
        cut[swung] = stands.reshape(-1, 2).all(axis=1)
    return rows[cut]


def _return_crosses(flown: FencedFlight, barrier: Barrier, rows: IntArray) -> Finding:
    """Return the finding on the first item from whose legs a barrier is in the way, at its worst."""
    returns, leg = flown.returns, flown.returns.leg
    first = rows[flown.group[leg[rows]] == flown.group[leg[rows[0]]]]
    first = first[:: 1 + len(first) // _LINES_COMPARED]
    shares = np.linspace(0.0, 1.0, _LINES_BETWEEN)[:, None, None]  # of the way along each piece
    starts, ends = (
        (both[:, 0] + shares * (both[:, 1] - both[:, 0])).reshape(-1, 2)
        for both in (
            np.concatenate((returns.place_m[first], returns.stop_m[first])),
            np.tile(returns.end_m[first], (2, 1, 1)),
        )
    )
    clearance_m = barrier.leg_clearance(straight_legs(starts, ends)).clearance_m
    here = len(starts) - 2 * len(first)  # from there on the lines are those from the pieces' ends
    worst = here + int(np.argmin(clearance_m[here:]))
    begun = "from here"
    if clearance_m[worst] >= flown.position_error_m:
        worst, begun = int(np.argmin(clearance_m)), "begun on the way here"
    least_m = float(clearance_m[worst])
    # What lies between lines is crossed by a return that none of them is.
    least_m = least_m if least_m < flown.position_error_m else -1.0
    items = len(np.unique(flown.path.item[leg[rows]]))
    others = f", and from {quantity.count(items - 1, 'more item')}" if items > 1 else ""
    start, end = starts[worst], ends[worst]
    goal = destination_name(int(returns.destination[first[0]]))
    return flown.assessment.finding(
        RTL_PATH_CROSSES,
        f"straight return {goal} {begun} {_passes(flown, barrier, least_m)}{others}",
        item=int(flown.path.item[leg[first[0]]]),
        stretch=flown.stretch(start, end, float(np.hypot(*(end - start)))),
    )


def _along_crosses(flown: FencedFlight, barrier: Barrier, line: int, least_m: float) -> Finding:
    """Return the finding on returns that cross a barrier farther on along the mission."""
    along = flown.returns.along
    return flown.assessment.finding(
        RTL_PATH_CROSSES,
        f"the return along the mission {_passes(flown, barrier, least_m)}",
        stretch=flown.stretch(along.start_m[line], along.end_m[line], float(along.length_m[line])),
    )


def _passes(flown: FencedFlight, barrier: Barrier, least_m: float) -> str:
    if least_m < 0.0:
        return f"crosses {barrier.label}"
    return (
        f"passes {barrier.label} at {quantity.decimals(least_m, 1)} m; the position may be wrong by "
        f"{quantity.decimals(flown.position_error_m, 1)} m"
    )
