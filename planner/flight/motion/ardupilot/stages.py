"""Stages as ArduPilot's Copter takes them: columns of where each begins and ends, and how fast."""

from __future__ import annotations

import math
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.motion.ardupilot.circle_path import CircleTask, circle_path
from planner.flight.motion.ardupilot.vertical import BRAKING_SHARE, height_gain_per_s
from planner.flight.motion.kinematics import horizontal, is_nonzero
from planner.geo.geodesy import FLATTENING, SEMI_MAJOR_AXIS_M
from planner.mission.route.stage import LANDED_STAGES, RETURN_STAGES, StageKind
from planner.values import Value, field_names, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from planner.arrays import BoolArray, ComplexArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.returns.destination import ReturnTargets
    from planner.mission.route.stage import Stage
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters


KINDS = tuple(StageKind)
KIND_INDEX = {kind: index for index, kind in enumerate(KINDS)}
"""Columns of stages hold positions in ``KINDS``."""

_AUTOPILOT_EARTH_RADIUS_M = 6_378_100.0
"""``RADIUS_OF_EARTH`` of AP_Math/definitions.h: metres per degree for both axes. [m]"""
_EDGE_NEAR_M = 3.0
"""``ModeAuto::circle_movetoedge_start`` flies to the edge from farther away only. [m]"""
_LOWEST_TAKEOFF_M = 1.0
"""``ModeAuto::takeoff_start`` climbs this high at least. [m]"""

_NEXT_MAY_BE = (StageKind.GO, StageKind.SPLINE, StageKind.LOITER, StageKind.SET_DOWN)
"""``ModeAuto::set_next_wp``: a waypoint is flown through only towards one of these."""

_SPLINES_LEAD_TO = (StageKind.CIRCLE, StageKind.CHANGE_HEIGHT)
"""``ModeAuto::get_spline_from_cmd``: a spline is flown through towards the place of any command, straight up
or down too; of a landing, whose height is not known here, only to another place."""


class StageColumns(Value, eq=False):
    """Stages, one per row; places in the autopilot's own metres."""

    kind: IntArray
    """Positions in ``KINDS``. (n,)"""
    item: IntArray
    start_m: FloatArray
    """East, north, height above home where each begins. (n, 3) [m]"""
    place_m: FloatArray
    """East and north of the place it names, its height. (n, 3) [m]"""
    end_m: FloatArray
    """Where it ends. (n, 3) [m]"""
    edge_m: FloatArray
    """Where a circle begins; the place of all others. (n, 3) [m]"""
    speed_m_s: FloatArray
    """Horizontal speed as commanded, or less where ground is followed. (n,) [m s⁻¹]"""
    commanded_m_s: FloatArray
    climb_m_s: FloatArray
    descent_m_s: FloatArray
    lands_at_m_s: FloatArray
    """Descent speed commanded when a landing has begun; NaN: the vehicle's own. (n,) [m s⁻¹]"""
    hold_s: FloatArray
    turns: FloatArray
    radius_m: FloatArray
    """Radius of a circle, negative for counter-clockwise. (n,) [m]"""
    circles: dict[int, CircleTask]
    """What circles are flown with, by their rows."""
    is_passed: BoolArray
    """Whether the end is flown through. (n,)"""
    leads_straight_on: BoolArray
    """Whether the end would be but for the path planner, straight to the next place. (n,)"""
    is_speed_late: BoolArray
    """Whether the speed is commanded when the first leg has begun already. (n,)"""
    next_early_s: FloatArray
    """How long before its end, braked for already, the speed of the next is commanded; 0: there. (n,) [s]"""
    is_underway: BoolArray
    """Whether the end is only a place on the way: one leg to the autopilot. (n,)"""
    is_first_leg: BoolArray
    """Whether the stage before was a take-off, whose end no file's coordinates meet exactly. (n,)"""
    is_here: BoolArray
    """Whether a stage names no place of its own. (n,)"""
    from_ground: BoolArray
    """Whether a take-off leaves the ground. (n,)"""
    above_ground_m: FloatArray
    """Height above its ground of the place a return leads to, as the autopilot has it, and of where a load
    is set down from. (n,) [m]"""
    lowered_m: FloatArray
    """How far a load is lowered. (n,) [m]"""
    datum_m: FloatArray
    """Height above the first home of the home that counts during a return. (n,) [m]"""
    named_ground_m: FloatArray
    """Height above the first home of the ground of a landing by the altitude of its item; NaN: that does not
    count. (n,) [m]"""
    lands_by_name: BoolArray
    """Whether that alone counts, where there is one. (n,)"""
    return_ceiling_m: FloatArray
    """Height above that home at which the fence keeps a return; NaN: as the parameters have it. (n,) [m]"""
    rise_m: FloatArray
    """How much higher than it begins the leg to a landing, or to where a load is set down, ends: the ground
    that it follows. (n,) [m]"""

    @classmethod
    def of_flights(cls, several: Sequence[StageColumns]) -> StageColumns:
        """Return the stages of several flights, one after the other; items are the positions of flights."""
        columns = {
            name: np.concatenate([getattr(one, name) for one in several])
            for name in field_names(cls)
            if name != "circles"
        }
        counts = [len(one.kind) for one in several]
        columns["item"] = np.repeat(np.arange(len(several)), counts)
        before = np.cumsum(counts) - counts
        circles = {
            row + first: circle
            for one, first in zip(several, before.tolist(), strict=True)
            for row, circle in one.circles.items()
        }
        return cls(**columns, circles=circles)

    def where(self, *kinds: StageKind) -> IntArray:
        """Return the rows of some kinds."""
        return np.flatnonzero(is_kind(self.kind, *kinds))


def last_parts(is_underway: BoolArray) -> IntArray:
    """Return for each stage the last that is one leg with it to the autopilot. (n,)"""
    number = np.arange(len(is_underway))
    last = np.where(is_underway, number[-1], number)
    return np.minimum.accumulate(last[::-1])[::-1]


def is_kind(kind: IntArray, *kinds: StageKind) -> BoolArray:
    """Return whether columns of kinds hold some of them. (n,)"""
    return _are_among(kinds)[kind]


@cache
def _are_among(kinds: tuple[StageKind, ...]) -> BoolArray:
    """Return which of all kinds are among some."""
    return np.array([kind in kinds for kind in KINDS])


def metres_of_autopilot(latitude_deg: float | None) -> tuple[float, float]:
    """Return the autopilot's metres per metre, eastward and northward.

    Without a latitude of home metres are the autopilot's own.

    Notes
    -----
    ArduPilot's degrees of latitude are all 111,318.8 m long, and its degrees of longitude that times
    the cosine of the latitude (``Location::get_vector_xy_from_origin_NE``).  On the WGS 84 ellipsoid
    they are M π/180 and N cos φ π/180.  At 47° a leg to the north is 0.13 % longer for ArduPilot, and
    takes so much longer.
    """
    if latitude_deg is None:
        return 1.0, 1.0
    eccentricity_squared = FLATTENING * (2.0 - FLATTENING)
    root = 1.0 - eccentricity_squared * math.sin(math.radians(latitude_deg)) ** 2
    transverse_m = SEMI_MAJOR_AXIS_M / math.sqrt(root)
    meridional_m = transverse_m * (1.0 - eccentricity_squared) / root
    return _AUTOPILOT_EARTH_RADIUS_M / transverse_m, _AUTOPILOT_EARTH_RADIUS_M / meridional_m


_NUMBERS = (
    *("east_m", "north_m", "height_m"),
    *("speed_m_s", "climb_speed_m_s", "descent_speed_m_s", "lands_at_m_s"),
    *(
        "hold_s",
        "next_early_s",
        "turns",
        "radius_m",
        "above_ground_m",
        "datum_m",
        "return_ceiling_m",
    ),
    *("named_ground_m", "lands_by_name"),
    *("is_speed_late", "is_next_unseen", "is_underway", "is_here", "may_slow_landing"),
)
"""What is taken of stages as it is; what is absent is no number."""


def stage_columns(
    stages: Sequence[Stage],
    parameters: ArduPilotParameters,
    *,
    scale: tuple[float, float],
    drag: float,
) -> StageColumns:
    """Return the stages of a route, each beginning where the one before ends; the first at home.

    ``drag`` is that of `TrackLag`.
    """
    is_spline = np.array([stage.kind is StageKind.SPLINE for stage in stages])
    if parameters.plans_legs_anew:
        stages = [_planned_anew(stage) for stage in stages]
    rows_of_numbers = np.array([*map(attrgetter(*_NUMBERS), stages)], dtype=np.float64)
    numbers = dict(zip(_NUMBERS, rows_of_numbers.T.copy(), strict=True))

    def column(name: str, default: float = 0.0) -> FloatArray:
        return np.where(np.isnan(numbers[name]), default, numbers[name])

    kind = np.array([KIND_INDEX[stage.kind] for stage in stages], dtype=np.intp)
    place = np.column_stack((column("east_m"), column("north_m"), column("height_m")))
    place[:, :2] *= scale
    speed = column("speed_m_s", parameters.cruise_speed_m_s)
    climb = column("climb_speed_m_s", parameters.climb_speed_m_s)
    descent = column("descent_speed_m_s", parameters.descent_speed_m_s)
    home = is_kind(kind, *RETURN_STAGES)
    speed[home] = column("speed_m_s", parameters.return_speed_m_s)[home]
    hold, turns, radius = column("hold_s"), column("turns"), column("radius_m")
    rise, lowered = np.zeros((2, len(stages)))
    for row in np.flatnonzero(is_kind(kind, *_LOWERS)).tolist():
        rise[row], lowered[row] = _rise_m(stages[row]), stages[row].lowered_m
    start, end, edge, circles = _chained(
        stages, kind, place, parameters, turns=turns, radius_m=radius, speed_m_s=speed, drag=drag
    )
    followed = [
        row
        for row, each in enumerate(stages)
        if each.followed_ground_m and each.kind not in {StageKind.CIRCLE, *RETURN_STAGES}
    ]
    commanded = speed.copy()
    if followed:
        rows = np.array(followed)
        speed[rows] = followed_speed_m_s(
            rows,
            [np.array(stages[row].followed_ground_m) for row in followed],
            horizontal(place[rows] - start[rows]),
            speed[rows],
            climb_m_s=climb[rows],
            descent_m_s=descent[rows],
            parameters=parameters,
        )
    takeoff = kind == KIND_INDEX[StageKind.TAKEOFF]
    landed = np.concatenate(([True], is_kind(kind[:-1], *LANDED_STAGES)))
    through = is_kind(kind, StageKind.GO, StageKind.SPLINE, StageKind.RETURN_LEG) & (hold == 0.0)
    underway = numbers["is_underway"] > 0.0
    whole = last_parts(underway)
    leads, way_m = kind[whole], place[whole] - start
    onward = is_kind(leads, *_NEXT_MAY_BE)
    onward[1:] |= underway[:-1]
    # Splines ask for the place of the next command alone.
    elsewhere = is_kind(leads, StageKind.LAND) & is_nonzero(way_m[:, :2])
    elsewhere |= is_kind(leads, *_SPLINES_LEAD_TO) & is_nonzero(way_m)
    onward[1:] |= elsewhere[1:] & is_kind(kind[:-1], StageKind.SPLINE)
    unseen = numbers["is_next_unseen"] > 0.0
    lands_at, may_slow = numbers["lands_at_m_s"], numbers["may_slow_landing"] > 0.0
    lands_at[may_slow & (lands_at > parameters.descent_speed_m_s)] = np.nan
    changes, way = is_kind(kind, StageKind.CHANGE_HEIGHT), horizontal(place - start)
    # Within WP_RADIUS of the place it is no leg (ModeAuto::loiter_to_alt_run), flown at other speeds.
    within_m = parameters.waypoint_radius_m
    there = within_m / np.maximum(way, within_m)
    for along, own in (
        (climb, parameters.climb_speed_m_s),
        (descent, parameters.descent_speed_m_s),
    ):
        then = np.where(np.isnan(lands_at), own, lands_at)
        along[changes] = (1.0 / ((1.0 - there) / along + there / then))[changes]
    passed = through & ~unseen & np.concatenate((onward[1:], [False]))
    may_pass = underway | is_kind(kind, StageKind.SPLINE) | (not parameters.stops_at_waypoints)
    return StageColumns(
        kind=kind,
        item=np.array([stage.item for stage in stages]),
        start_m=start,
        place_m=place,
        end_m=end,
        edge_m=edge,
        speed_m_s=speed,
        commanded_m_s=commanded,
        climb_m_s=climb,
        descent_m_s=descent,
        lands_at_m_s=lands_at,
        hold_s=hold,
        turns=turns,
        radius_m=radius,
        circles=circles,
        is_passed=passed & may_pass,
        leads_straight_on=passed & ~np.concatenate((is_spline[1:], [False])),
        is_speed_late=numbers["is_speed_late"] > 0.0,
        next_early_s=numbers["next_early_s"],
        is_underway=underway,
        is_here=numbers["is_here"] > 0.0,
        is_first_leg=np.concatenate(([False], takeoff[:-1])),
        from_ground=takeoff & landed,
        above_ground_m=column("above_ground_m"),
        lowered_m=lowered,
        datum_m=column("datum_m"),
        named_ground_m=numbers["named_ground_m"],
        lands_by_name=numbers["lands_by_name"] > 0.0,
        return_ceiling_m=numbers["return_ceiling_m"],
        rise_m=rise,
    )


_LOWERS = (StageKind.LAND, StageKind.SET_DOWN)


def _rise_m(stage: Stage) -> float:
    ground_m = stage.followed_ground_m
    return ground_m[-1] - ground_m[0] if ground_m else 0.0


def _planned_anew(stage: Stage) -> Stage:
    """Return a stage as it is flown where its leg is planned anew behind its beginning.

    Splines are straight, and ``AC_WPNav::wp_and_spline_init_m`` takes the vehicle's own speeds of climbing
    and descending, not those commanded (2.5 m/s flown for 4).
    """
    if stage.kind is StageKind.TAKEOFF:  # which is no leg
        return stage
    kind = StageKind.GO if stage.kind is StageKind.SPLINE else stage.kind
    return replace(stage, kind=kind, climb_speed_m_s=None, descent_speed_m_s=None)


def return_columns(
    points_m: FloatArray,
    targets: ReturnTargets,
    parameters: ArduPilotParameters,
    *,
    scale: tuple[float, float],
) -> StageColumns:
    """Return a return from each of n points, standing there; item i is point i."""
    count = len(points_m)
    zero, never = np.zeros(count), np.zeros(count, np.bool_)
    start, home = points_m * (*scale, 1.0), targets.ground_m * (*scale, 1.0)
    return StageColumns(
        kind=np.full(count, KIND_INDEX[StageKind.RETURN]),
        item=np.arange(count),
        start_m=start,
        place_m=home,
        end_m=_return_end_m(home, targets.datum_m, parameters),
        edge_m=home,
        speed_m_s=np.full(count, parameters.return_speed_m_s),
        commanded_m_s=np.full(count, parameters.return_speed_m_s),
        climb_m_s=np.full(count, parameters.climb_speed_m_s),
        descent_m_s=np.full(count, parameters.descent_speed_m_s),
        lands_at_m_s=np.full(count, np.nan),
        hold_s=zero,
        turns=zero,
        radius_m=zero,
        circles={},
        is_passed=never,
        leads_straight_on=never,
        is_underway=never,
        is_here=never,
        is_speed_late=never,
        next_early_s=zero,
        is_first_leg=never,
        from_ground=never,
        above_ground_m=np.asarray(targets.above_ground_m, np.float64),
        lowered_m=zero,
        datum_m=np.asarray(targets.datum_m, np.float64),
        named_ground_m=np.full(count, np.nan),
        lands_by_name=never,
        return_ceiling_m=targets.return_ceiling_m,
        rise_m=zero,
    )


def _chained(
    stages: Sequence[Stage],
    kind: IntArray,
    place_m: FloatArray,
    parameters: ArduPilotParameters,
    *,
    turns: FloatArray,
    radius_m: FloatArray,
    speed_m_s: FloatArray,
    drag: float,
) -> tuple[FloatArray, FloatArray, FloatArray, dict[int, CircleTask]]:
    """Return where each stage begins, ends, where its circle begins (n, 3) [m], and the circles by row.

    Most end at their place; only the others are looked at one by one.
    """
    end, edge = place_m.copy(), place_m.copy()
    circles: dict[int, CircleTask] = {}
    straight = is_kind(kind, StageKind.GO, StageKind.LOITER, StageKind.SPLINE)
    before = np.zeros(3)
    for row in np.flatnonzero(~straight).tolist():
        before = end[row - 1] if row else before
        match stages[row].kind:
            case StageKind.TAKEOFF:
                stands = row == 0 or stages[row - 1].kind in LANDED_STAGES
                end[row, :2] = before[:2]
                end[row, 2] = max(place_m[row, 2], before[2] + _LOWEST_TAKEOFF_M * stands)
            case StageKind.DELAY:
                end[row] = before
            case StageKind.SET_DOWN:
                end[row, 2] = before[2] + _rise_m(stages[row])
            case StageKind.RETURN_LEG:
                if stages[row - 1].kind is StageKind.RETURN_LEG:
                    end[row, 2] = before[2]
                    continue
                last = next(
                    at for at, s in enumerate(stages) if at > row and s.kind is StageKind.RETURN
                )
                home, datum_m = place_m[[last]], np.array([stages[last].datum_m])
                home[:, 2] += stages[last].above_ground_m
                ceiling_m = np.array([stages[last].return_ceiling_m], np.float64)
                end[row, 2] = return_height_m(before[None], home, datum_m, ceiling_m, parameters)[0]
            case StageKind.RETURN:
                datum_m = np.array([stages[row].datum_m])
                end[row] = _return_end_m(place_m[row : row + 1], datum_m, parameters)[0]
            case StageKind.CIRCLE:
                radius, place = float(radius_m[row]), place_m[row]
                end[row] = edge[row] = _circle_edge_m(before, place, radius)
                circles[row] = CircleTask.of(
                    radius,
                    float(turns[row]),
                    start_m=math.dist(edge[row, :2], place[:2]),
                    speed_m_s=float(speed_m_s[row]),
                    parameters=parameters,
                    drag=drag,
                    hold_s=stages[row].hold_s,
                )
                if circles[row].leads_round:
                    stop_m = np.array([[circle_path(circles[row]).stop_m]])
                    about = edge[[row]], place_m[[row]], radius_m[[row]]
                    end[row] = places_about_m(stop_m, *about)[0, 0]
    return np.vstack((np.zeros((1, 3)), end[:-1])), end, edge, circles


def _circle_edge_m(before_m: FloatArray, place_m: FloatArray, radius_m: float) -> FloatArray:
    """Return where a circle begins: nearest to where the vehicle comes from, or there if it is near."""
    away = before_m[:2] - place_m[:2]
    distance = math.hypot(*away)
    # At the centre ArduPilot takes the point at the back of the vehicle; the heading is not known here.
    direction = away / distance if distance >= 0.5 else np.array([0.0, -1.0])
    edge = np.array([*(place_m[:2] + abs(radius_m) * direction), place_m[2]])
    return before_m.copy() if math.dist(edge, before_m) <= _EDGE_NEAR_M else edge


def places_about_m(
    places: ComplexArray, edge_m: FloatArray, centre_m: FloatArray, radius_m: FloatArray
) -> FloatArray:
    """Return places (n, k) on the ways round n circles from their edges, level with these. (n, k, 3) [m]"""
    found = vectors_about(places, edge_m, centre_m, radius_m)
    found[..., :2] += centre_m[:, None, :2]
    found[..., 2] = edge_m[:, None, 2]
    return found


def vectors_about(
    vectors: ComplexArray, edge_m: FloatArray, centre_m: FloatArray, radius_m: FloatArray
) -> FloatArray:
    """Return vectors (n, k) on the ways round n circles, clockwise for a positive radius. (n, k, 3)"""
    away = edge_m[:, 0] - centre_m[:, 0] + 1j * (edge_m[:, 1] - centre_m[:, 1])
    away = np.where(away == 0.0, -1j, away)
    vectors = np.where(radius_m[:, None] > 0.0, vectors.conj(), vectors)
    vectors = vectors * (away / np.abs(away))[:, None]
    return np.stack((vectors.real, vectors.imag, np.zeros(vectors.shape)), axis=-1)


def _return_end_m(
    ground_m: FloatArray, datum_m: FloatArray, parameters: ArduPilotParameters
) -> FloatArray:
    """Return where a return ends: on the ground, or at RTL_ALT_FINAL above home. (n, 3) [m]"""
    end = ground_m.copy()
    if parameters.return_final_altitude_m > 0.0:
        end[:, 2] = datum_m + parameters.return_final_altitude_m
    return end


_LEAST_RETURN_M = 0.3
"""``RTL_ALT_MIN_M``. [m]"""
_CEILING = 1
"""``AC_FENCE_TYPE_ALT_MAX`` among the bits of FENCE_TYPE."""
_SHALLOWEST_CONE = 0.5
"""``RTL_MIN_CONE_SLOPE``: a shallower cone does not count. [-]"""
_OVER_TERRAIN = 1
"""RTL_ALT_TYPE for heights above terrain."""
_TURNS_BACK = frozenset({1, 3})
"""WP_YAW_BEHAVIOR of which a return turns to the heading of its arming (``AutoYaw::default_mode``)."""


def return_height_m(
    start_m: FloatArray,
    place_m: FloatArray,
    datum_m: FloatArray,
    ceiling_m: FloatArray,
    parameters: ArduPilotParameters,
) -> FloatArray:
    """Return the height above the first home at which returns are flown. (n,) [m]

    ``place_m`` is where they lead to, at its altitude as the autopilot has it (n, 3); ``datum_m`` the
    height of the home that counts above the first (n,); ``ceiling_m`` as of `StageColumns` (n,).

    Notes
    -----
    ``ModeRTL::compute_return_target``: all heights count from home, whatever the ground where the return
    leads to.  RTL_ALT or the rally point's altitude, at least RTL_CLIMB_MIN above the present height; with
    a RTL_CONE_SLOPE of 0.5 or more no higher than that over the way to go; no higher than FENCE_ALT_MAX
    less FENCE_MARGIN while that fence is on; never down.
    """
    present = start_m[:, 2] - datum_m
    least = np.maximum(present + parameters.return_climb_min_m, _LEAST_RETURN_M)
    height = np.maximum(np.maximum(parameters.return_altitude_m, place_m[:, 2] - datum_m), least)
    if parameters.return_cone_slope >= _SHALLOWEST_CONE:
        cone = horizontal(start_m - place_m) * parameters.return_cone_slope
        height = np.minimum(height, np.maximum(cone, least))
    height = np.minimum(height, known_ceiling_m(ceiling_m, parameters))
    return np.asarray(datum_m + np.maximum(height, present))


def known_ceiling_m(ceiling_m: FloatArray, parameters: ArduPilotParameters) -> FloatArray:
    """Return the ceilings of returns (n,), that of the parameters where one is NaN. (n,) [m]"""
    is_on = parameters.fence_enable and parameters.fence_type & _CEILING
    own_m = parameters.fence_height_max_m - parameters.fence_margin_m if is_on else math.inf
    return np.where(np.isnan(ceiling_m), own_m, ceiling_m)


def over_home_m(
    stages: StageColumns, home: IntArray, parameters: ArduPilotParameters
) -> FloatArray:
    """Return where returns arrive over home; on the way they keep their height. (n, 3) [m]"""
    start_m, over_m = stages.start_m[home], stages.place_m[home].copy()
    over_m[:, 2] += stages.above_ground_m[home]
    height_m = return_height_m(
        start_m, over_m, stages.datum_m[home], stages.return_ceiling_m[home], parameters
    )
    over_m[:, 2] = np.where(continues_return(stages, home), start_m[:, 2], height_m)
    return over_m


def continues_return(stages: StageColumns, home: IntArray) -> BoolArray:
    """Return whether rows of returns begin on the way home. (n,)"""
    return is_kind(stages.kind[home - 1], StageKind.RETURN_LEG)


RETURN_OVER_TERRAIN = Rule(
    "A113 return-over-terrain",
    Severity.WARNING,
    summary="The vehicle returns at a height above terrain; one above home is predicted.",
    why="Over ground higher than home such a return climbs more and flies higher than predicted.",
    how="ArduPilot's RTL_ALT_TYPE is 1; RTL_ALT is counted from home.  E129 holds the energy of what it "
    "climbs beyond that against the margin.",
    fix="set RTL_ALT_TYPE to 0, or allow for the ground under the return",
)


def return_findings(parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Yield what of returns is not predicted as the vehicle does it."""
    if parameters.return_altitude_type == _OVER_TERRAIN:
        yield RETURN_OVER_TERRAIN.finding(
            "RTL_ALT_TYPE is 1: returns follow the terrain; they are predicted at least "
            f"{quantity.height(parameters.return_altitude_m)} above home"
        )


def return_wait_s(parameters: ArduPilotParameters) -> float:
    """Return how long a return waits over the place it leads to, at most. [s]

    ``ModeRTL::loiterathome_run`` waits for RTL_LOIT_TIME, and until it heads as it was armed where it
    turns to that: half a turn at most.  Nowhere else does Copter wait for a heading in a mission:
    ``ModeAuto::verify_command`` asks for none.
    """
    turn_s = math.pi / parameters.yaw_rate_rad_s if parameters.yaw_behavior in _TURNS_BACK else 0.0
    return max(parameters.return_loiter_s, turn_s)


_STEP_S = 0.05
_HARMLESS_M_S = 1.0
"""Ground that rises and falls no faster than this is followed without slowing down. [m s⁻¹]"""
_SLOWEST = 0.01
"""``pos_terrain_U_scaler_m`` leaves so much of the speed. [-]"""


def followed_speed_m_s(
    stage: IntArray,
    ground_m: Iterable[FloatArray],
    length_m: FloatArray,
    speed_m_s: FloatArray,
    *,
    climb_m_s: FloatArray,
    descent_m_s: FloatArray,
    parameters: ArduPilotParameters,
) -> FloatArray:
    """Return the mean horizontal speeds of legs that follow the ground.

    Legs of consecutive ``stage`` follow each other; ``ground_m`` are heights of the ground, evenly spaced
    from the beginning of each leg to its end (n), and the limits those commanded, all else (n,).
    """
    found = speed_m_s.copy()
    if parameters.terrain_margin_m == 0.0:
        return found
    level_m = np.zeros((len(found), 2))
    limits = (speed_m_s, climb_m_s, descent_m_s)
    legs = _flown_legs(stage, ground_m, length_m, limits, level_m, parameters=parameters)
    for row, leg, flown in legs:
        found[row] = min(leg.length_m / flown.duration_s, leg.speed_m_s)
    return found


def followed_above_m(
    stage: IntArray,
    ground_m: Iterable[FloatArray],
    length_m: FloatArray,
    above_m: FloatArray,
    *,
    limits_m_s: tuple[FloatArray, FloatArray, FloatArray],
    parameters: ArduPilotParameters,
) -> FloatArray:
    """Return the least heights above the ground of legs that follow it. (n,) [m]

    As of `followed_speed_m_s`, asked to fly ``above_m`` at the beginning and the end of each (n, 2), at
    horizontal, climb and descent speeds (n,) each.  ArduCopter looks at the ground below alone: where that
    rises faster than it climbs it gets lower, and slows down only then (``AC_WPNav`` by WPNAV_TER_MARGIN).
    """
    found: FloatArray = above_m.min(axis=1)
    legs = _flown_legs(stage, ground_m, length_m, limits_m_s, above_m, parameters=parameters)
    for row, _, flown in legs:
        found[row] = flown.least_m
    return found


def _flown_legs(
    stage: IntArray,
    ground_m: Iterable[FloatArray],
    length_m: FloatArray,
    limits_m_s: tuple[FloatArray, FloatArray, FloatArray],
    above_m: FloatArray,
    *,
    parameters: ArduPilotParameters,
) -> Iterator[tuple[int, _Leg, _FlownLeg]]:
    """Yield the legs over ground that is steep for them, each begun as the one before was left."""
    ground = list(ground_m)
    slope = np.array([np.abs(np.diff(own)).max() * (len(own) - 1) for own in ground])
    steep = (slope * limits_m_s[0] > _HARMLESS_M_S * length_m) & (length_m > 0.0)
    before: int | None = None
    motion = _LEVEL
    for row in np.flatnonzero(steep).tolist():
        follows = before is not None and stage[row] == stage[before] + 1
        numbers = (float(c[row]) for c in (length_m, *limits_m_s))
        leg = _Leg(ground[row].tolist(), *numbers, *above_m[row].tolist())
        flown = leg.flown(motion if follows else _LEVEL, parameters)
        yield row, leg, flown
        motion, before = flown.left, row


class _Motion(NamedTuple):
    """How a vehicle comes to a leg or leaves it."""

    error_m: float
    """Of its height against that of the ground. [m]"""
    rate_m_s: float
    """Vertical speed. [m s⁻¹]"""
    speed_fraction: float
    """Horizontal speed over the commanded one. [-]"""


_LEVEL = _Motion(0.0, 0.0, 1.0)


class _FlownLeg(NamedTuple):
    """How a leg over steep ground is flown."""

    duration_s: float
    least_m: float
    """Least height above the ground. [m]"""
    left: _Motion


class _Leg(NamedTuple):
    """A leg over ground that may slow it down."""

    ground_m: list[float]
    length_m: float
    speed_m_s: float
    climb_m_s: float
    descent_m_s: float
    begins_m: float
    """Asked to fly so far above the ground at its beginning and its end. [m]"""
    ends_m: float

    def flown(self, begin: _Motion, parameters: ArduPilotParameters) -> _FlownLeg:
        """Return how the leg is flown, slowed down where the ground is too steep."""
        half_m = 0.5 * parameters.terrain_margin_m
        most_up = parameters.vertical_acceleration_m_s2 * _STEP_S
        most_on = parameters.acceleration_m_s2 / self.speed_m_s * _STEP_S
        braking = BRAKING_SHARE * parameters.vertical_acceleration_m_s2
        gain = height_gain_per_s(parameters)
        linear_m = braking / gain**2
        spaces = len(self.ground_m) - 1
        error, rate, speed_fraction = begin
        height = self.ground_m[0] - error
        share, duration, least_m = 0.0, 0.0, math.inf  # of the way, of the time
        while share < 1.0:
            at = share * spaces
            below = min(int(at), spaces - 1)
            low, high = self.ground_m[below], self.ground_m[below + 1]
            error = low + (at - below) * (high - low) - height
            size = abs(error)
            least_m = min(least_m, self.begins_m + share * (self.ends_m - self.begins_m) - error)
            wanted = math.sqrt(2.0 * braking * max(size - 0.5 * linear_m, 0.0))
            wanted = gain * size if size < linear_m else wanted
            wanted = min(wanted, self.climb_m_s) if error > 0.0 else -min(wanted, self.descent_m_s)
            slowed = min(max(2.0 - size / half_m, _SLOWEST), 1.0) if half_m > 0.0 else 1.0
            rate += min(max(wanted - rate, -most_up), most_up)
            speed_fraction += min(max(slowed - speed_fraction, -most_on), most_on)
            way = speed_fraction * self.speed_m_s / self.length_m
            step = min(_STEP_S, (1.0 - share) / way)  # the last step ends where the leg does
            share = share + way * step if step == _STEP_S else 1.0
            height += rate * step
            duration += step
        return _FlownLeg(duration, least_m, _Motion(error, rate, speed_fraction))
