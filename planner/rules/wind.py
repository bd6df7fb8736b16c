"""Rules on the wind: whether the vehicle holds its own against it wherever it may be."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypedDict

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.motion.headway import SLOWEST_M_S, headway_m_s
from planner.flight.pilot import RATED_WIND
from planner.flight.reach import GUST_SDS, SituationKind
from planner.mission.route.stage import LANDED_STAGES
from planner.physics.drift import held_wind_m_s, level_airspeed_m_s
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT, PX4, NotEvaluated, judges
from planner.setup import ASSUMED_POSITION_ERROR_M
from planner.units import GRAVITY_M_S2
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray
    from planner.findings import Finding
    from planner.flight.motion.kinematics import CirclesAtRate
    from planner.physics.wind import Wind
    from planner.rules.assessment import Assessment
    from planner.rules.declaration import Found
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters
    from planner.vehicle.parameters.resolve import FlightParameters

_LEAST_ACTION = 2
"""COM_WIND_MAX_ACT and COM_POS_LOW_ACT from which on PX4 breaks the mission off; 1 warns
(``commander_params.c``; the second in missions and loiters alone, ``failsafe.cpp``)."""
_ACTIONS = {2: "holds its position", 3: "returns", 4: "cuts its motors", 5: "lands where it is"}
_ROUNDING = 1e-9
_JUDGED_ACTIONS = frozenset({1, 3})
"""To warn changes nothing, and a return from any point is judged by its own rules."""


NO_HEADWAY = Rule(
    "W101 no-headway",
    Severity.ERROR,
    summary="The wind is stronger than the vehicle can fly against.",
    why="A vehicle that leans as far as it may and still does not advance, or does not hold its "
    "place in a hover, a climb or a landing, is blown away from its mission and from home.",
    how="The airspeed at the greatest lean angle, airspeed_limit_m_s of the model, wherever the "
    "vehicle may be: on the mission, holding at any point of it, on the return from there.  What is heavier "
    "than the model leans less: as the drag goes by drag_exponent; of a payload that no gripper, winch, "
    "servo, relay or landing on the way may take, less two standard deviations.  Fires "
    "where the wind, its mean and two standard deviations, is stronger; where it is stronger than what is "
    "held while the vehicle sinks, as the drag then carries weight: U with v^(n-1) (U + w tan θ) = limitⁿ, w "
    "the rate of descent, v = hypot(U, w), θ the greatest lean angle (of a model that tells neither that nor "
    "parameters 45°, the steepest as delivered), n drag_exponent, else of 1 to 2 the one that leaves least "
    "(flown, 10.24 m/s by 30°, sinking at 1.5 m/s: 9.6 m/s just drifts, 10.1 m/s lands 27 m beside); and "
    "where the ground speed "
    "along the course, w_along + sqrt(v_max² − w_across²), is 0.1 m/s or less.  Of a model with "
    "neither that airspeed nor identified ones no wind is checked: X904.",
    fix="wait for less wind, or fly a faster vehicle",
    instead="--wind",
)
WIND_BEYOND_MODEL = Rule(
    "W103 wind-beyond-model",
    Severity.ERROR,
    summary="The wind is too strong for the highest speed the vehicle was recorded at.",
    why="A vehicle blown along faster than it can fly does not come back (ArduPilot #859).  How fast "
    "it can fly nobody has stated; it was seen to fly no faster than this.  Makers rate their vehicles "
    "for less wind than they can fly: DJI for 0.50 to 0.67 of the top speed (10 of 20 m/s Phantom 4 Pro, "
    "12 of 21 Mavic 3, 15 of 23 Matrice 300, 10.7 of 16 Mini 4 Pro).",
    how="As W101, in a model without airspeed_limit_m_s: the mean wind above 0.7 of the highest speed "
    "of the model's [valid_for], or with two standard deviations at that speed; where its maker "
    "allows a wind (wind_max_m_s), above that, and its highest speed is taken to be 1/0.7 of it at least.  "
    "Where the parameters let it lean less than in those flights, that speed times the ratio of the "
    "tangents of both angles, or g tan(θ) over the model's drag_per_s.",
    fix="wait for less wind, or identify the vehicle at higher speeds",
    instead="--wind",
)


@judges(NO_HEADWAY, WIND_BEYOND_MODEL)
def _no_headway(a: Assessment) -> Iterator[Found]:
    if a.airspeed_limit_m_s is not None:
        yield from _beyond_limit(a, a.airspeed_limit_m_s)
        return
    strongest_m_s = float(a.reach.gust_m_s(a.setup.wind).max())
    if not strongest_m_s > 0.0:
        return
    if a.vehicle.valid_for.speed_m_s is None:
        yield NotEvaluated(
            rule=NO_HEADWAY,
            needs="a vehicle model with airspeed_limit_m_s, or with speed_m_s under [valid_for]",
            asked_by=f"wind of {quantity.speed(strongest_m_s)}",
        )
        return
    yield from _beyond_model(a)


def _beyond_limit(a: Assessment, limit_m_s: float) -> Iterator[Finding]:
    """Yield where the wind is too strong for a known airspeed limit: first what even level flight lacks."""
    reach, gust_m_s = a.reach, a.reach.gust_m_s(a.setup.wind)
    blown = gust_m_s > limit_m_s
    blown |= _stuck(a, limit_m_s, blown)
    asks_m_s = level_airspeed_m_s(gust_m_s, -reach.climb_m_s, **_lean_of_limit(a))
    sinks = (asks_m_s > limit_m_s) & (gust_m_s > 0.0)
    limit = quantity.speed(limit_m_s)
    if blown.any():
        first = int(np.argmax(blown))
        strongest_m_s = float(gust_m_s[blown].max())
        blows = _blows(a.setup.wind, quantity.speed(strongest_m_s))
        message = f"{blows} against an airspeed limit of {limit}"
    elif sinks.any():
        first = int(np.argmax(sinks))
        # Of the descents for that item the one that asks most.
        there = sinks & (reach.item == reach.item[first]) & (reach.kind == reach.kind[first])
        worst = int(np.argmax(np.where(there, asks_m_s, -np.inf)))
        sink_m_s = -float(reach.climb_m_s[worst])
        held_m_s = held_wind_m_s(limit_m_s, sink_m_s, **_lean_of_limit(a))
        gust = quantity.beside(float(gust_m_s[worst]), held_m_s, quantity.speed)
        message = (
            f"{_blows(a.setup.wind, gust)}; it holds {quantity.speed(held_m_s)} while it sinks at "
            f"{quantity.speed(sink_m_s)}, of an airspeed limit of {limit}"
        )
    else:
        return
    model_m_s = a.vehicle.airspeed_limit_m_s or limit_m_s
    of_model = quantity.speed(model_m_s)
    if limit_m_s < model_m_s and of_model != limit and a.own_parameters is not None:
        message += f": {of_model} less what {_lean_limit(a.own_parameters)} takes"
    item = int(reach.item[first])
    yield a.finding(
        NO_HEADWAY, f"cannot hold its position {reach.where(first)}: {message}", item=item
    )


def _beyond_model(a: Assessment) -> Iterator[Finding]:
    """Yield where the wind is too strong for what the flights of a model show."""
    reach, wind, limit_m_s = a.reach, a.setup.wind, a.shown_airspeed_m_s
    assert limit_m_s is not None
    gust_m_s = reach.gust_m_s(wind)
    rated_m_s = RATED_WIND * limit_m_s
    if a.vehicle.wind_max_m_s is not None:
        rated_m_s = min(rated_m_s, a.vehicle.wind_max_m_s)
    mean_m_s = wind.speed_m_s * wind.speed_factor(reach.height_m)
    blown = (gust_m_s >= limit_m_s) | (mean_m_s > (1.0 + _ROUNDING) * rated_m_s)
    blown |= _stuck(a, limit_m_s, blown)
    if not blown.any():
        return
    first = int(np.argmax(blown))
    strongest = quantity.speed(float(gust_m_s[blown].max()))
    yield a.finding(
        WIND_BEYOND_MODEL,
        f"no headway is certain {reach.where(first)}: {_blows(wind, strongest)}; {known_text(a.vehicle)} "
        f"up to {shown_airspeed_text(a)}, good for {quantity.speed(rated_m_s)}",
        item=int(reach.item[first]),
    )


def _stuck(a: Assessment, limit_m_s: float, blown: BoolArray) -> BoolArray:
    """Return where an airspeed limit leaves no headway on the course; not looked at where it need not be."""
    reach, wind = a.reach, a.setup.wind
    stuck = np.zeros_like(blown)
    mean_m_s = wind.speed_m_s * wind.speed_factor(reach.height_m)
    # At an airspeed v in a wind w < v the ground speed is nowhere below v − w, that of flight upwind.
    if limit_m_s - float(mean_m_s.max()) > SLOWEST_M_S and not blown.any():
        return stuck
    moves = np.flatnonzero(reach.ground_speed_m_s > 0.0)
    stuck[moves] = (
        headway_m_s(
            np.stack((reach.east_m_s, reach.north_m_s), axis=1)[moves],
            reach.height_m[moves, None],
            wind=wind,
            airspeed_limit_m_s=limit_m_s,
        )
        <= SLOWEST_M_S
    )
    return stuck


def _blows(wind: Wind, strongest: str) -> str:
    gusts = " (mean + 2 sd)" if wind.speed_sd_m_s > 0.0 else ""
    return f"{strongest} of wind{gusts}{_profile(wind)}"


class _LeanOfLimit(TypedDict):
    lean_rad: float
    exponent: float | None


def _lean_of_limit(a: Assessment) -> _LeanOfLimit:
    """Return how what a vehicle holds depends on its rate of descent."""
    return {"lean_rad": a.limit_lean_rad, "exponent": a.vehicle.drag_exponent}


def known_text(vehicle: VehicleModel) -> str:
    """Return what a model is known by, with the verb: of flights, or what its data sheet holds for."""
    basis = vehicle.provenance.basis
    is_flown = basis is None or basis.is_flown
    return "the model was identified" if is_flown else "the model of a data sheet holds"


def shown_airspeed_text(a: Assessment) -> str:
    """Return up to what airspeed the model of a flight was identified, and what its lean leaves of that."""
    identified, shown_m_s = a.vehicle.valid_for.speed_m_s, a.certain_airspeed_m_s
    assert identified is not None
    text = quantity.speed(identified.high)
    if a.vehicle.wind_max_m_s is not None:
        text = f"{text} and its maker allows {quantity.speed(a.vehicle.wind_max_m_s)} of wind"
    if a.own_parameters is None or shown_m_s is None or shown_m_s >= identified.high:
        return text
    return f"{text}, {_lean_limit(a.own_parameters)} leaves {quantity.speed(shown_m_s)} for certain"


def _lean_limit(parameters: FlightParameters) -> str:
    return f"a lean of {quantity.decimals(math.degrees(parameters.lean_angle_max_rad), 0)}° at most"


def _profile(wind: Wind) -> str:
    return "" if wind.reference_height_m is None else " with its profile"


AIRSPEED_LIMIT = Rule(
    "W102 airspeed-limit",
    Severity.WARNING,
    summary="Legs are flown slower than commanded: the lean angle limits the airspeed.",
    why="ArduPilot holds the ground speed until the lean angle reaches its limit; beyond it the "
    "flight runs late without a message: a survey planned for 475 s took 916 s.",
    how="Along each leg of the mission, and of the returns from anywhere on it, the ground speed is at most "
    "w_along + sqrt(v_max² − w_across²), v_max being the airspeed at the greatest lean angle; fires where "
    "that is below what is commanded.",
    fix="command less speed, or allow more lean (ATC_ANGLE_MAX, PSC_ANGLE_MAX)",
)


@judges(AIRSPEED_LIMIT)
def _airspeed_limit(a: Assessment) -> Iterator[Finding]:
    slowed = a.returns.slowed
    if slowed is None:
        return
    parts, items = [], []
    for kind in (SituationKind.MISSION, SituationKind.RETURN):
        rows = np.flatnonzero(slowed.kind == kind)
        if not len(rows):
            continue
        item = int(slowed.item[rows[0]])
        what = "returns" if kind is SituationKind.RETURN else quantity.count(len(rows), "leg")
        row = rows[np.argmin(slowed.held_m_s[rows])]
        items.append(item)
        parts.append(
            f"{what} from item {item} on, down to {slowed.held_m_s[row]:.1f} m/s of "
            f"{slowed.commanded_m_s[row]:.1f} m/s"
        )
    yield a.finding(AIRSPEED_LIMIT, f"slower than commanded: {'; '.join(parts)}", item=items[0])


CIRCLE_LEAN = Rule(
    "W105 circle-lean",
    Severity.WARNING,
    summary="A circle in this wind asks for more lean than the vehicle may take.",
    why="ArduPilot turns the target of a circle on at a steady rate and does not wait for the "
    "vehicle: one that cannot lean enough cuts the circle, or is blown off it to leeward, while its "
    "turns are counted.",
    how="At a ground speed v on a radius R in a wind w: sqrt(v² + (v²/cR)²) + w above the airspeed at "
    "the greatest lean angle U, with c = g tan(ATC_ANGLE_MAX)/U; of a model without airspeed_limit_m_s the "
    "highest airspeed it shows.  The time of the circle stays.  ArduCopter 4.7 flew circles of 30 m that "
    "asked 1.4 times as much 15 m too wide and 22 m too narrow: with an area of the fence, ground of "
    "--terrain that comes as near to its height as --clearance, or max_distance_m of the site within 0.75 "
    "radii of such a circle F107, A102 and M122 are not checked (X904); separations take it so much nearer.",
    fix="fly the circle slower or wider, wait for less wind, or allow more lean (ATC_ANGLE_MAX, "
    "PSC_ANGLE_MAX)",
)


@judges(CIRCLE_LEAN, needs=(ARDUPILOT,))
def _circle_lean(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Found]:
    r"""Yield where circles ask for more lean than ATC_ANGLE_MAX.

    Notes
    -----
    ``AC_Circle::update_ms`` moves the target on by its rate and counts the turns by it; unlike along a
    leg nothing waits for the vehicle.  So a circle takes its time in any wind, and a vehicle that cannot
    lean enough cuts inside or is blown off.  At a ground speed v on a radius R it leans for v²/R across
    and, with c the drag per airspeed, for c v along and c w against the wind.  Somewhere on the circle
    both add up: with c U = g tan(ATC_ANGLE_MAX) at the airspeed limit U it needs

    .. math:: \sqrt{v^2 + (v^2 / c R)^2} + w \le U .
    """
    limit_m_s = a.highest_airspeed_m_s
    circles = a.flight.motion.circles
    if circles is None or limit_m_s is None:
        return
    strength_m_s, needed_m_s = _needed_m_s(a, parameters, circles, limit_m_s)
    # A wind as strong as the limit is W101's.
    some = (needed_m_s > limit_m_s) & (strength_m_s < limit_m_s)
    if not some.any():
        return
    worst = int(np.argmax(np.where(some, needed_m_s, 0.0)))
    first = int(circles.item[some][0])
    yield a.finding(
        CIRCLE_LEAN,
        f"{quantity.count(int(some.sum()), 'circle')} from item {first} on: "
        f"{circles.speed_m_s[worst]:.1f} m/s over ground in {strength_m_s[worst]:.1f} m/s of wind needs the "
        f"lean of {needed_m_s[worst]:.1f} m/s of airspeed; the limit is {limit_m_s:.1f} m/s",
        item=first,
    )
    from planner.rules.fence import LOITER_CROSSES
    from planner.rules.site import TOO_FAR_FOR_SITE
    from planner.rules.terrain import BELOW_TERRAIN

    for rule, is_near, what in (
        (LOITER_CROSSES, _is_fenced, "an area of the fence"),
        (BELOW_TERRAIN, _is_beside_ground, "ground as high"),
        (TOO_FAR_FOR_SITE, _is_at_the_limit, "the site's max_distance_m"),
    ):
        for number in np.flatnonzero(some).tolist():
            item, off_m = int(circles.item[number]), float(_off_m(circles)[number])
            if is_near(a, item, off_m):
                yield NotEvaluated(
                    rule=rule,
                    asked_by=f"{what} within {quantity.distance(off_m)} of a circle that this wind widens or "
                    "narrows (W105)",
                    needs="less wind, a slower circle or one farther from it",
                    item=item,
                )
                break


_WIDE_OR_NARROW = 0.75
"""Of its radius, how far from a circle a vehicle was seen to fly that could not lean enough. [-]"""


def _needed_m_s(
    a: Assessment, parameters: ArduPilotParameters, circles: CirclesAtRate, limit_m_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return the wind on circles, and the airspeed whose lean they ask for. (n,) [m s⁻¹]"""
    from planner.flight.motion.ardupilot.legs import drag_per_s

    strength_m_s = a.setup.wind.speed_m_s * a.setup.wind.speed_factor(circles.height_m)
    across_m_s = circles.turn_m_s2 / drag_per_s(parameters, limit_m_s)
    return strength_m_s, np.hypot(circles.speed_m_s, across_m_s) + strength_m_s


def _off_m(circles: CirclesAtRate) -> FloatArray:
    """Return how far from circles a vehicle may be that cannot lean enough. (n,) [m]"""
    return _WIDE_OR_NARROW * circles.speed_m_s**2 / circles.turn_m_s2


def circles_off_m(a: Assessment) -> FloatArray | None:
    """Return how far beside its segments a vehicle may be where the wind widens or narrows its circles.

    ``None``: nowhere. (s,) [m]
    """
    parameters, circles = ARDUPILOT.of(a), a.flight.motion.circles
    if parameters is None or circles is None:
        return None
    limit_m_s = a.highest_airspeed_m_s
    if limit_m_s is None:
        return None
    _, needed_m_s = _needed_m_s(a, parameters, circles, limit_m_s)
    item = a.flight.motion.segments.item
    off_m = np.zeros(len(item))
    for number in np.flatnonzero(needed_m_s > limit_m_s).tolist():
        own = item == circles.item[number]
        off_m[own] = np.maximum(off_m[own], _off_m(circles)[number])
    return off_m


def _is_fenced(a: Assessment, item: int, within_m: float) -> bool:
    """Return whether the circle of an item is so near to the edge of an area of the fence, on either side."""
    if not a.mission.fence:
        return False
    flown = a.fenced
    rows = np.flatnonzero((flown.path.item == item) & flown.path.is_circle)
    legs = flown.legs(rows)
    return any(
        bool((barrier.leg_clearance(legs).clearance_m[flown.is_on(barrier)[rows]] < within_m).any())
        for barrier in flown.area.barriers
    )


def _is_beside_ground(a: Assessment, item: int, within_m: float) -> bool:
    """Return whether ground so near to the circle of an item is too high for it, or is not known."""
    terrain, frame = a.setup.terrain, a.route.frame
    if terrain is None:
        return False
    import shapely

    path = a.path
    rows = np.flatnonzero((path.item == item) & path.is_circle)
    if not len(rows):
        return False
    points = np.unique(np.concatenate((rows, rows + 1)))
    line = shapely.linestrings(path.east_m[points], path.north_m[points])
    around = line.buffer(within_m)
    low_m = float(path.height_m[points].min()) - a.setup.clearance_m + a.route.ground_datum_m
    west_m, south_m, east_m, north_m = around.bounds
    corners_deg = frame.latitude_longitude_deg(
        np.array([west_m, east_m, west_m, east_m]), np.array([south_m, south_m, north_m, north_m])
    )
    latitude, longitude, _ = terrain.peaks_above(low_m, *corners_deg)
    peaks_m = np.column_stack(frame.east_north_m(latitude, longitude))
    if len(peaks_m) and bool(shapely.dwithin(line, shapely.points(peaks_m), within_m).any()):
        return True
    # Ground is highest at the centre of a cell inside, or on the edge.
    edge_m = shapely.get_coordinates(around.boundary.segmentize(0.5 * terrain.cell_m))
    ground_m = terrain.height_amsl_m(*frame.latitude_longitude_deg(*edge_m.T))
    return bool(np.ma.getmaskarray(ground_m).any() or (ground_m > low_m).any())


def _is_at_the_limit(a: Assessment, item: int, within_m: float) -> bool:
    """Return whether the circle of an item is so near to the distance that the profile of the site allows."""
    profile = a.setup.profile
    if profile is None or profile.max_distance_m is None:
        return False
    from planner.rules.site import path_distances_m

    is_there = (a.path.item == item) & a.path.is_circle
    away_m = path_distances_m(a, profile)[1:][is_there]
    return float(away_m.max(initial=0.0)) + within_m > profile.max_distance_m


_NEAR_GROUND_LEAN_RAD = math.radians(7.0)
"""The most that ``Mode::land_run_horizontal_control`` leans below WP_NAVALT_MIN."""
LEAN_NEAR_GROUND = Rule(
    "W106 lean-near-ground",
    Severity.WARNING,
    summary="Near the ground ArduPilot may not lean enough for this wind.",
    why="Below WP_NAVALT_MIN a landing leans 7° at most, so that nothing tips over after the touch-down: in "
    "the wind the vehicle is carried off until it is down, and touches down moving.",
    how="The wind at WP_NAVALT_MIN, its mean and two standard deviations, above what 7° leave of the highest "
    "airspeed (of W101 and W103) for certain, by the ratio of the tangents of both leans; an error where it "
    "is above the most they leave, by the root of that ratio, as drag has it that grows with the square.",
    fix="wait for less wind, or set WP_NAVALT_MIN to 0",
    instead="--wind, or the parameters of --params",
)


@judges(LEAN_NEAR_GROUND, needs=(ARDUPILOT,))
def _lean_near_ground(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    height_m = numbers(a).get("WP_NAVALT_MIN", 0.0)
    highest_m_s = a.highest_airspeed_m_s
    if not height_m > 0.0 or highest_m_s is None:
        return
    wind = replace(a.setup.wind, ground_below_m=0.0)  # over the ground where it lands
    gust_m_s = (wind.speed_m_s + GUST_SDS * wind.speed_sd_m_s) * float(wind.speed_factor(height_m))
    left = min(math.tan(_NEAR_GROUND_LEAN_RAD) / math.tan(parameters.lean_angle_max_rad), 1.0)
    if gust_m_s <= (1.0 + _ROUNDING) * left * highest_m_s:
        return
    certain, most = (quantity.speed(one * highest_m_s) for one in (left, math.sqrt(left)))
    yield a.finding(
        LEAN_NEAR_GROUND,
        f"landing in {quantity.speed(gust_m_s)} of wind: below {quantity.height(height_m)}, WP_NAVALT_MIN, "
        f"it leans 7° at most, which holds {certain} for certain and {most} at most",
        severity=Severity.ERROR if gust_m_s > math.sqrt(left) * highest_m_s else None,
    )


_LANDED_LEAN_RAD = math.radians(15.0)
"""``LAND_CHECK_LARGE_ANGLE_CD``: asked for more lean ArduCopter does not take itself for landed."""
_ON_THE_GROUND_M = 1.0
"""How high above the ground the wind counts that the position controller leans against as it lands."""
STAYS_ARMED = Rule(
    "W107 stays-armed",
    Severity.WARNING,
    summary="In this wind ArduPilot may stay armed after it has landed.",
    why="It takes itself for landed only while it is asked for a lean of 15° or less "
    "(Copter::update_land_detector); standing on the ground it goes on to lean against the wind, and ever "
    "more for the centimetres it is off its place.  It stands there with its motors turning, takes more "
    "time and energy than predicted, and flies no further mission.",
    how="The lean that the wind asks for where it lands, its mean and two standard deviations 1 m above the "
    "ground, above 15°: by the balance of W101 at the speed of landing, with airspeed_limit_m_s, less two of "
    "its airspeed_limit_fraction, and drag_exponent, else 1; of a model without it by drag_per_s, of one "
    "with neither not at all.  Flown with ArduCopter 4.7, where that is 5.7 m/s: with as much wind down to "
    "the ground disarmed 2 s after the touch-down at 5.5 m/s, not within 3 minutes at 5.8, 6.1, 6.4, 7.8, "
    "8.6 and 9.4 m/s, nor at 8.6 m/s with WP_NAVALT_MIN 1; with a wind that falls to nothing over the last "
    "metre after 2 s up to 8.2 m/s, after 4 minutes at 8.6 and 9.2 m/s.  PX4 does not ask for the lean.",
    fix="wait for less wind, or be ready to disarm by hand",
    instead="--wind, or the parameters of --params",
)


@judges(STAYS_ARMED, needs=(ARDUPILOT,))
def _stays_armed(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    wind = replace(a.setup.wind, ground_below_m=0.0)  # over the ground where it lands
    strongest_m_s = wind.speed_m_s + GUST_SDS * wind.speed_sd_m_s
    gust_m_s = strongest_m_s * float(wind.speed_factor(_ON_THE_GROUND_M))
    lean_rad = min(
        _lean_against(a, gust_m_s, parameters.land_speed_m_s), parameters.lean_angle_max_rad
    )
    rounded_rad = (1.0 + _ROUNDING) * _LANDED_LEAN_RAD
    if lean_rad <= rounded_rad:
        return
    landings = a.route.rows_of(*LANDED_STAGES)
    lean = quantity.beside(
        math.degrees(lean_rad), 15.0, lambda deg: f"{quantity.decimals(deg, 0)}°"
    )
    yield a.finding(
        STAYS_ARMED,
        f"lands in {quantity.speed(gust_m_s)} of wind, leaning {lean}: asked for more than 15° ArduPilot "
        "does not take itself for landed, and may stay armed",
        item=a.route.stages[landings[0]].item if landings else None,
    )


def _lean_against(a: Assessment, wind_m_s: float, sink_m_s: float) -> float:
    """Return how far a vehicle leans to hold its place in a wind while it sinks; 0: not known. [rad]"""
    limit_m_s, drag_per_s = a.airspeed_limit_m_s, a.vehicle.drag_per_s
    if limit_m_s is None:
        share_s_m = (drag_per_s or 0.0) / (GRAVITY_M_S2 * a.setup.aloft.times_heavier)
    else:
        exponent = a.vehicle.drag_exponent or 1.0
        sure_m_s = limit_m_s * (1.0 - GUST_SDS * (a.vehicle.airspeed_limit_fraction or 0.0))
        speed = (math.hypot(wind_m_s, sink_m_s) / sure_m_s) ** (exponent - 1.0)
        share_s_m = math.tan(a.limit_lean_rad) * speed / sure_m_s
    # Of the drag over the weight and the airspeed: what is horizontal over what the rotors hold up.
    return math.atan2(share_s_m * wind_m_s, 1.0 - share_s_m * sink_m_s)


WIND_LIMIT = Rule(
    "W104 wind-limit",
    Severity.WARNING,
    summary="The wind is above the limit set on the vehicle.",
    why="PX4 returns, lands or cuts its motors in flight where its wind estimate exceeds "
    "COM_WIND_MAX, and does not arm then (PX4 #19578).",
    how="--wind, its mean and two standard deviations, anywhere the vehicle may be, against "
    "COM_WIND_MAX, where that is positive.  An error where COM_WIND_MAX_ACT is 2 (hold), 3 (return), "
    "4 (terminate) or 5 (land), a warning where PX4 only warns or does nothing.",
    fix="wait for less wind, or raise the limit if the vehicle can take it",
    instead="--wind, or the parameters of --params",
)


@judges(WIND_LIMIT, needs=(PX4,))
def _wind_limit(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    limit_m_s = parameters.wind_max_m_s
    if not limit_m_s > 0.0:
        return
    gust_m_s = a.reach.gust_m_s(a.setup.wind)
    first = int(np.argmax(gust_m_s > limit_m_s))
    strongest_m_s = float(gust_m_s.max())
    if strongest_m_s > limit_m_s:
        does, severity = _reaction(parameters.wind_max_action)
        yield a.finding(
            WIND_LIMIT,
            f"wind of {quantity.beside(strongest_m_s, limit_m_s, quantity.speed)}; COM_WIND_MAX is "
            f"{quantity.speed(limit_m_s)}{does}",
            severity=severity,
            item=int(a.reach.item[first]),
        )


def _reaction(action: int) -> tuple[str, Severity | None]:
    """Return what PX4 does at an action, and how severe that is."""
    if action < _LEAST_ACTION:
        return "", None
    return f": the vehicle itself {_ACTIONS.get(action, 'warns')}", Severity.ERROR


POSITION_ACCURACY_LOW = Rule(
    "T114 position-accuracy-low",
    Severity.WARNING,
    summary="The position may be less accurate than the vehicle accepts on a mission.",
    why="PX4 breaks a mission off, by default with a return, where the accuracy of its position is "
    "worse than COM_POS_LOW_EPH.",
    how="The greater of --position-error and the position noise against COM_POS_LOW_EPH, where that "
    "is positive.  An error where COM_POS_LOW_ACT is 2 (hold), 3 (return), 4 (terminate) or 5 (land), "
    "a warning where PX4 only warns.  The 2.5 m assumed of fences are no statement about the vehicle: "
    "where none is made, a limit below that is a warning with 3, a return like those that are judged, "
    "and not checked (X904) with 2, 4 and 5.",
    fix="fly with a better position, or raise COM_POS_LOW_EPH",
    instead="--position-error, or the parameters of --params",
)


@judges(POSITION_ACCURACY_LOW, needs=(PX4,))
def _position_accuracy_low(a: Assessment, parameters: Px4Parameters) -> Iterator[Found]:
    limit_m, action = parameters.position_error_limit_m, parameters.position_error_action
    if not limit_m > 0.0 or action <= 0:
        return
    assumed_m, noise_m = ASSUMED_POSITION_ERROR_M, a.setup.position_noise_m or 0.0
    stated_m = a.setup.position_error_m  # None: what is assumed says nothing about the vehicle
    error_m = max(stated_m or 0.0, noise_m)
    does, severity = _reaction(action)
    limit = quantity.height(limit_m)
    if limit_m < error_m:
        yield a.finding(
            POSITION_ACCURACY_LOW,
            f"position error of {quantity.beside(error_m, limit_m, quantity.height)}; COM_POS_LOW_EPH "
            f"is {limit}{does}",
            severity=severity,
        )
    elif stated_m is None and limit_m < assumed_m:
        if action in _JUDGED_ACTIONS:
            yield a.finding(
                POSITION_ACCURACY_LOW,
                f"position error not stated; COM_POS_LOW_EPH is {limit}{does} where it is worse",
                fix="state it with --position-error",
            )
        else:
            yield NotEvaluated(
                rule=POSITION_ACCURACY_LOW,
                needs="the accuracy of the position: --position-error",
                asked_by=f"COM_POS_LOW_EPH of {limit}",
            )
