"""How much later than its model of reference steps a vehicle is, by the file of its own autopilot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot, Target
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.pilot import make_own_pilot, step_speeds_m_s
from planner.mission.route.stage import LEVEL_FIRST, RETURN_STAGES, StageKind
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from typing_extensions import TypeIs

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion, SegmentColumns
    from planner.flight.motion.px4.pilot import Px4Pilot
    from planner.flight.pilot import ArduPilotPilot
    from planner.flight.power import Transients
    from planner.flight.returns.path import FlownReturns
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.px4 import Px4Parameters
    from planner.vehicle.parameters.resolve import FlightParameters

HEIGHT_SLACK_M = 0.5
"""A height this little outside the identified ones is inside: rounding of files. [m]"""
OVERSHOOT = 0.03
"""A rate this much over the highest is inside: recorded flights overshoot their commands by it. [-]"""
_LOW_M = 10.0
"""Height below which autopilots take off and land at a speed of their own (MPC_LAND_ALT1, LAND_ALT_LOW)."""


class Lateness(Value, eq=False):
    """How much longer segments take than a model of reference steps has it, by cause. (s,) [s]"""

    climbs_s: FloatArray
    """Slower climbs, descents and landings, by its parameters and the mission."""
    circles_s: FloatArray
    ways_s: FloatArray
    """As its own autopilot flies from place to place."""
    passed_s: FloatArray
    """How much later each may be passed: what is lost, however little, by the end of the stage before it, at
    least of two alike, and by that of its own, at most. (s, 2) [s]"""
    slowest: Slower | None = None
    circled_by: str = ""
    shaped_by: str = ""

    @property
    def in_all_s(self) -> FloatArray:
        """Of all causes. (s,) [s]"""
        return self.climbs_s + self.circles_s + self.ways_s


class LateReturns(Value, eq=False):
    """How much longer returns from n points take, stopped there, than a model of reference steps has them."""

    climbs_s: FloatArray
    """Slower climbs, descents and landings, of each segment of the returns. (s,) [s]"""
    point: IntArray
    """Row of the point each segment is flown from. (s,)"""
    ways_s: FloatArray
    """As its own autopilot flies home. (n,) [s]"""
    slowest: Slower | None = None
    shaped_by: str = ""

    @property
    def in_all_s(self) -> FloatArray:
        """Of all causes. (n,) [s]"""
        climbs_s = np.bincount(self.point, self.climbs_s, len(self.ways_s))
        return np.asarray(climbs_s + self.ways_s, np.float64)


def lateness_of(a: Assessment) -> Lateness:
    """Return how much longer the vehicle takes than its model of reference steps."""
    given, motion = a.own_parameters, a.flight.motion
    none_s = np.zeros(len(motion.segments.item))
    circles = a.route.rows_of(StageKind.CIRCLE)
    is_calm = given is None and not circles and not _commands_climbs(a) and not _lands_high(a)
    if a.autopilot is not Autopilot.STEP or is_calm:
        passed_s = np.zeros((len(none_s), 2))
        return Lateness(climbs_s=none_s, circles_s=none_s, ways_s=none_s, passed_s=passed_s)
    if given is None:
        from planner.vehicle.parameters.resolve import resolve_parameters

        # Nobody else flies circles: no faster than ArduPilot does as it is delivered.
        delivered = resolve_parameters(Autopilot.ARDUPILOT, model=a.vehicle).values
        circles_s, circled_by = _circling_longer_s(a, delivered, least=1.0 + OVERSHOOT)
        climbs_s, slowest = _asked_longer_s(a, delivered, none_s, least=1.0 + OVERSHOOT)
        little_s = _circling_longer_s(a, delivered, least=1.0)[0]
        little_s += _asked_longer_s(a, delivered, none_s, least=1.0)[0]
        return Lateness(
            climbs_s=climbs_s,
            circles_s=circles_s,
            ways_s=none_s,
            passed_s=_passed_s(motion, little_s),
            slowest=slowest,
            circled_by=circled_by,
        )
    homeward = [stage.item for stage in a.route.stages_of(StageKind.RETURN)]
    returning = np.isin(motion.segments.item, homeward)
    own = a.own_motion

    def longer(least: float) -> tuple[FloatArray, FloatArray, FloatArray, Slower | None, str]:
        climbs_s, slowest = _longer(a, given, motion, returning, least=least)
        asked_s, slower = _asked_longer_s(a, given, climbs_s, least=least)
        climbs_s = climbs_s + asked_s
        if slower is not None and (slowest is None or slower.added_s > slowest.added_s):
            slowest = slower
        circles_s, circled_by = _circling_longer_s(a, given, least=least)
        ways_s = _shaped_longer_s(a, own, climbs_s + circles_s, least=least)
        ways_s += _homeward_longer_s(a, given, least=least)
        return climbs_s, circles_s, ways_s, slowest, circled_by

    climbs_s, circles_s, ways_s, slowest, circled_by = longer(1.0 + OVERSHOOT)
    return Lateness(
        climbs_s=climbs_s,
        circles_s=circles_s,
        ways_s=ways_s,
        passed_s=_passed_s(motion, sum(longer(1.0)[:3], none_s)),
        slowest=slowest,
        circled_by=circled_by,
        shaped_by=_shaping(a, given),
    )


def _passed_s(motion: Motion, little_s: FloatArray) -> FloatArray:
    """Return how much later each segment may be passed, by the ends of stages. (s, 2) [s]"""
    by_end_s = np.append(np.cumsum(little_s), 0.0)[motion.done_segment]
    by_end_s = np.append(np.maximum.accumulate(by_end_s), 0.0)
    before_s, by_then_s = by_end_s[motion.segment_stage - 1], by_end_s[motion.segment_stage]
    return np.stack((before_s, np.maximum(by_then_s, np.cumsum(little_s))), axis=1)


def own_flown_of(
    a: Assessment, *, otherwise: Autopilot | None = None
) -> tuple[ArduPilotPilot | Px4Pilot, tuple[Motion, Transients]] | None:
    """Return by whose laws a vehicle of reference steps really flies, and how; ``None``: it is not known.

    Through corners at which the model stops, and up and down along legs: those of the parameter file, else of
    the autopilot whose rules the mission has to meet, as it is delivered, ``otherwise`` of another one.
    """
    if a.autopilot is not Autopilot.STEP:
        return None
    given, target = a.own_parameters, a.target
    if target is None and otherwise is not None:
        target = Target(otherwise)
    if given is None and target is not None:
        from planner.vehicle.parameters.resolve import resolve_parameters

        given = resolve_parameters(target.autopilot, version=target.version).values
    if given is None:
        return None
    pilot = make_own_pilot(a.vehicle, given, terrain=a.setup.terrain)
    return pilot, pilot.fly(a.route)


def as_its_own_flies(
    a: Assessment, own_flown: tuple[ArduPilotPilot | Px4Pilot, tuple[Motion, Transients]] | None
) -> Assessment | None:
    """Return a flight of a model of reference steps as its own autopilot flies it; ``None``: not known.

    With its own returns; nothing of it is later by its parameters.
    """
    if own_flown is None or a.holds_for_others:
        return None
    from planner.flight.prediction import make_flight
    from planner.flight.returns.path import make_returns

    pilot, flown = own_flown
    flight = make_flight(*flown, a.flight.power)
    by = Autopilot.PX4 if _is_px4(pilot.parameters) else Autopilot.ARDUPILOT
    return replace(
        a,
        setup=replace(a.setup, autopilot=by),
        flight=flight,
        returns=make_returns(a.route, flight, pilot, a.returns.destinations),
    )


def late_returns_of(
    a: Assessment, flown: FlownReturns | None, *, least: float = 1.0 + OVERSHOOT
) -> LateReturns:
    """Return how much longer returns take; ``None``: there are none.

    ``least`` is the time over that predicted from which on it counts. [-]
    """
    if flown is None:
        return LateReturns(climbs_s=np.zeros(0), point=np.zeros(0, np.intp), ways_s=np.zeros(0))
    given, motion, count = a.own_parameters, flown.flight.motion, len(flown.points.segment)
    back = motion.segments
    if a.autopilot is not Autopilot.STEP or given is None:
        return LateReturns(
            climbs_s=np.zeros(len(back.item)), point=back.item, ways_s=np.zeros(count)
        )
    always = np.ones(len(back.item), np.bool_)
    climbs_s, slowest = _longer(a, given, motion, always, least=least)
    return LateReturns(
        climbs_s=climbs_s,
        point=back.item,
        ways_s=_way_longer_s(given, back, count, least=least),
        slowest=slowest,
        shaped_by=_shaping(a, given),
    )


class Slower(Value, kw_only=False):
    """The setting that takes the most time of a flight."""

    added_s: float
    origin: str
    limit_m_s: float
    flown_m_s: float


def _longer(
    a: Assessment, given: FlightParameters, motion: Motion, returning: BoolArray, *, least: float
) -> tuple[FloatArray, Slower | None]:
    """Return how much longer each segment takes at the vehicle's own speeds, and what takes the most.

    From ``least`` times as fast as they let it on. [-]
    """
    longer_s = np.zeros(len(motion.segments.duration_s))
    slowest: Slower | None = None
    limits = _speed_limits(a, given, motion, returning)
    for name, limit_m_s, way_m, spent_s in limits:
        flown_m_s = way_m / np.maximum(spent_s, 1e-9)
        is_slower = limit_m_s * least < flown_m_s
        added_s = np.where(is_slower, way_m / limit_m_s - spent_s, 0.0)
        longer_s += added_s
        total_s = float(np.sum(added_s))
        if total_s > 0.0 and (slowest is None or total_s > slowest.added_s):
            most = int(np.argmax(added_s))
            slowest = Slower(
                total_s,
                str(given.origins[name]),
                float(np.broadcast_to(limit_m_s, way_m.shape)[most]),
                float(flown_m_s[most]),
            )
    return longer_s, slowest


def _commands_climbs(a: Assessment) -> bool:
    """Return whether the mission commands a speed of climbing or descending."""
    return any(
        stage.climb_speed_m_s or stage.descent_speed_m_s or stage.lands_at_m_s
        for stage in a.route.stages
    )


def _commanded_longer_s(
    a: Assessment, counted_s: FloatArray, *, least: float
) -> tuple[FloatArray, Slower | None]:
    """Return how much longer each segment takes at the climb and descent speeds that the mission commands.

    Than ``counted_s`` has it besides; and what takes the most.  A landing is no slower than LAND_SPD.
    """
    motion, stages = a.flight.motion, a.route.stages
    columns = motion.segments
    if not _commands_climbs(a):
        return np.zeros(len(counted_s)), None

    def asked_m_s(name: str) -> FloatArray:
        every = [getattr(stage, name) or math.nan for stage in stages]
        return np.array([*every, math.nan])[motion.segment_stage]

    is_landing = columns.state == STATE_INDEX[FlightState.LAND]
    # ArduPilot's PayloadPlace descends at the vehicle's own speed, as its landings do.
    is_level = np.array([*(stage.kind in LEVEL_FIRST for stage in stages), False])
    slow_m_s = 0.5 if a.own_parameters is None else a.own_parameters.land_speed_m_s
    down_m_s = np.where(
        is_landing,
        np.maximum(asked_m_s("lands_at_m_s"), slow_m_s),
        np.where(is_level[motion.segment_stage], math.nan, asked_m_s("descent_speed_m_s")),
    )
    limit_m_s = np.where(columns.climb_m > 0.0, asked_m_s("climb_speed_m_s"), down_m_s)
    way_m = np.abs(columns.climb_m)
    flown_m_s = way_m / np.maximum(columns.duration_s, 1e-9)
    is_slower = limit_m_s * least < flown_m_s
    takes_s = np.where(is_slower, way_m / limit_m_s, 0.0)
    added_s = np.maximum(takes_s - columns.duration_s - counted_s, 0.0) * is_slower
    if not added_s.any():
        return added_s, None
    most = int(np.argmax(added_s))
    total_s = float(added_s.sum())
    return added_s, Slower(
        total_s, "DO_CHANGE_SPEED", float(limit_m_s[most]), float(flown_m_s[most])
    )


def _asked_longer_s(
    a: Assessment, given: FlightParameters, counted_s: FloatArray, *, least: float
) -> tuple[FloatArray, Slower | None]:
    """Return how much longer each segment takes for speeds and altitudes that the mission asks for."""
    commanded_s, commanded = _commanded_longer_s(a, counted_s, least=least)
    landing_s, landing = _high_landing_longer_s(a, given, counted_s + commanded_s, least=least)
    slower = (one for one in (commanded, landing) if one is not None)
    return commanded_s + landing_s, max(slower, key=lambda one: one.added_s, default=None)


def _lands_high(a: Assessment) -> bool:
    """Return whether ArduCopter may take the ground of a landing to be higher than it is."""
    return any(
        stage.named_ground_m is not None and stage.named_ground_m > stage.height_m
        for stage in a.route.stages
    )


def _high_landing_longer_s(
    a: Assessment, given: FlightParameters, counted_s: FloatArray, *, least: float
) -> tuple[FloatArray, Slower | None]:
    """Return how much longer each segment takes of landings that are slow from above their own altitude.

    Than ``counted_s`` has it besides; as ``landing_level_m`` has it of ArduCopter from 4.7 on.
    """
    from planner.flight.slow_landing import SlowLanding

    motion = a.flight.motion
    columns, none_s = motion.segments, np.zeros(len(counted_s))
    if _is_px4(given) or not _lands_high(a):
        return none_s, None
    every = [
        math.nan if one.named_ground_m is None else one.named_ground_m for one in a.route.stages
    ]
    named_m = np.array([*every, math.nan])[motion.segment_stage]
    lands = (columns.state == STATE_INDEX[FlightState.LAND]) & (columns.climb_m < 0.0)
    lands &= ~np.isnan(named_m)
    slow = SlowLanding.of(given)
    bottom_m = np.where(lands, motion.state_at_time(columns.end_s).height_m - named_m, 0.0)
    top_m = np.where(lands, bottom_m - columns.climb_m, 0.0)
    top_m, bottom_m = np.minimum(top_m, slow.highest_m), np.minimum(bottom_m, slow.highest_m)
    way_m, took_s = top_m - bottom_m, slow.down_s(top_m) - slow.down_s(bottom_m)
    spent_s = way_m * columns.duration_s / np.where(lands, -columns.climb_m, 1.0)
    added_s = np.where(took_s > spent_s * least, np.maximum(took_s - spent_s - counted_s, 0.0), 0.0)
    if not added_s.any():
        return none_s, None
    most = int(np.argmax(added_s))
    limit_m_s, flown_m_s = (float(way_m[most] / one[most]) for one in (took_s, spent_s))
    return added_s, Slower(float(added_s.sum()), "altitude of NAV_LAND", limit_m_s, flown_m_s)


def _circling_longer_s(
    a: Assessment, given: FlightParameters, *, least: float
) -> tuple[FloatArray, str]:
    """Return how much longer ArduPilot's circles take, by the segment that ends each, and for what. (s,)"""
    longer_s, why = np.zeros(len(a.flight.motion.segments.duration_s)), "circle_rate_rad_s"
    if _is_px4(given):
        return longer_s, ""
    from planner.flight.motion.ardupilot.circle_path import CircleTask

    speeds = step_speeds_m_s(a.vehicle, a.own_parameters)
    for stage, done in zip(a.route.stages, a.flight.motion.done_segment.tolist(), strict=True):
        if stage.kind is not StageKind.CIRCLE:
            continue
        size_m = abs(stage.radius_m)
        speed_m_s = speeds.of(stage)
        own = CircleTask.of(
            size_m, stage.turns, start_m=size_m, speed_m_s=speed_m_s, parameters=given, drag=0.0
        )
        counted_s = stage.turns * 2.0 * math.pi * size_m / speed_m_s
        if own.duration_s > least * counted_s:
            longer_s[done] += own.duration_s - counted_s
            if own.rate_rad_s < abs(given.circle_rate_rad_s):
                why = "acceleration_m_s2"
    return longer_s, str(given.origins[why])


_SHAPING = (
    "acceleration_m_s2",
    "jerk_m_s3",
    "corner_acceleration_m_s2",
    "yaw_rate_rad_s",
    "yaw_acceleration_rad_s2",
    "responsiveness",
    "yaw_mode",
)
"""What shapes the way from place to place beside speeds."""
_BY_MODEL = frozenset({*RETURN_STAGES, StageKind.TAKEOFF, StageKind.LAND, StageKind.CIRCLE})
"""What is counted apart, or as the model has it."""


def _shaped_longer_s(
    a: Assessment, own: Motion | None, longer_s: FloatArray, *, least: float
) -> FloatArray:
    """Return how much longer the ways of its own autopilot take, beyond what is counted already.

    By the segment that ends each stage: how much later than the model it is there as the autopilot flies, at
    most so far; where it is later than ``least`` times what moves. (s,) [s]
    """
    motion, more_s = a.flight.motion, np.zeros(len(longer_s))
    if own is None:
        return more_s
    own_longer_s, moving_s = _own_longer_s(a, own, longer_s)
    late_s = np.cumsum(own_longer_s)
    if late_s.max() > (least - 1.0) * moving_s:
        latest_s = np.maximum.accumulate(np.maximum(late_s, 0.0))
        np.add.at(more_s, motion.done_segment, np.diff(latest_s, prepend=0.0))
    return more_s


def _own_longer_s(a: Assessment, own: Motion, longer_s: FloatArray) -> tuple[FloatArray, float]:
    """Return how much longer each stage takes as its own autopilot flies, and the time that moves.

    Than the model has it and ``longer_s`` besides.  (stages,) [s], [s]
    """
    motion = a.flight.motion
    counts = np.array([stage.kind not in _BY_MODEL for stage in a.route.stages])
    counted_s = _stage_sums_s(motion, motion.segments.duration_s + longer_s)
    held_s = np.array([stage.hold_s for stage in a.route.stages])
    own_longer_s = np.where(counts, _stage_sums_s(own, own.segments.duration_s) - counted_s, 0.0)
    return own_longer_s, float((counted_s - held_s)[counts].sum())


def _homeward_longer_s(a: Assessment, given: FlightParameters, *, least: float) -> FloatArray:
    """Return how much longer the level ways of the mission's own returns take, by what ends each. (s,) [s]"""
    motion, stages = a.flight.motion, a.route.stages
    by_stage = replace(motion.segments, item=motion.segment_stage)
    longer_s = _way_longer_s(given, by_stage, len(stages), least=least)
    returns = np.array([stage.kind in RETURN_STAGES for stage in stages])
    more_s = np.zeros(len(by_stage.item))
    np.add.at(more_s, motion.done_segment, np.where(returns, longer_s, 0.0))
    return more_s


def _shaping(a: Assessment, given: FlightParameters) -> str:
    """Return what of its file shapes the ways of its own autopilot, in words."""
    stated = [str(given.origins[name]) for name in _SHAPING if _is_stated(given, name)]
    source = "" if a.setup.parameters is None else a.setup.parameters.source
    return " and ".join(stated[:2]) or f"{source}, as its autopilot flies"


def _stage_sums_s(motion: Motion, duration_s: FloatArray) -> FloatArray:
    """Return the time of each stage, by that of the segments up to the one that ends it. (stages,) [s]"""
    end_s = np.append(np.cumsum(duration_s), 0.0)[motion.done_segment]  # -1: none ends it
    return np.diff(np.maximum.accumulate(end_s), prepend=0.0)


def _way_longer_s(
    given: FlightParameters, back: SegmentColumns, count: int, *, least: float
) -> FloatArray:
    """Return how much longer the level ways of returns take, from rest to rest. (count,) [s]

    v/a + a/J beyond d/v, a way too short for the speed no longer than 2 √(d/a) + a/J.
    """
    acceleration_m_s2 = given.acceleration_m_s2
    takes_s = np.where(back.distance_m > 0.0, back.duration_s, 0.0)
    way_m, flown_s = (np.bincount(back.item, one, count) for one in (back.distance_m, takes_s))
    speed_m_s = np.full(count, 1e-9)
    np.maximum.at(speed_m_s, back.item, back.speed_m_s)
    ramp_s = speed_m_s / acceleration_m_s2
    own_s = np.where(
        way_m < speed_m_s * ramp_s,
        2.0 * np.sqrt(way_m / acceleration_m_s2),
        way_m / speed_m_s + ramp_s,
    )
    own_s += acceleration_m_s2 / given.jerk_m_s3
    return np.where((way_m > 0.0) & (own_s > flown_s * least), own_s - flown_s, 0.0)


def _is_px4(given: FlightParameters) -> TypeIs[Px4Parameters]:
    from planner.vehicle.parameters.px4 import Px4Parameters

    return isinstance(given, Px4Parameters)


def _is_stated(given: FlightParameters, name: str) -> bool:
    origin = given.origins.get(name)
    return origin is not None and origin.is_file


def _speed_limits(
    a: Assessment, given: FlightParameters, motion: Motion, returning: BoolArray
) -> Iterator[tuple[str, FloatArray | float, FloatArray, FloatArray]]:
    """Yield what limits a speed, to what, the way it limits in each segment and the time spent on it.

    A default counts only where the model says nothing: in climbs and descents of returns longer than the
    step it was identified on.
    """
    columns = motion.segments
    slow_up, slow_up_m_s = _slow_climb(given)
    altitude = a.vehicle.responses.altitude
    longest_m = math.inf if altitude is None else altitude.identified_step_m + HEIGHT_SLACK_M
    unknown = returning & (np.abs(columns.climb_m) > longest_m)
    up_m, down_m = np.maximum(columns.climb_m, 0.0), np.maximum(-columns.climb_m, 0.0)
    s_per_m = columns.duration_s / np.maximum(np.abs(columns.climb_m), 1e-9)
    takes_off = columns.state == STATE_INDEX[FlightState.TAKEOFF]
    low_m = np.where(takes_off, np.minimum(up_m, _LOW_M), 0.0)
    slow_m, slow_m_s, name = _slow_landing(given, motion, unknown)
    yield name, slow_m_s, slow_m, slow_m * s_per_m
    lands = columns.state == STATE_INDEX[FlightState.LAND]
    fast = "descent_speed_m_s"
    for name, way_m in (
        (slow_up, low_m),
        ("climb_speed_m_s", up_m - low_m),
        (fast, np.where(lands, 0.0, down_m)),
        (_fast_landing(given) or fast, np.where(lands, down_m - slow_m, 0.0)),
    ):
        limit_m_s = slow_up_m_s if name == slow_up else float(getattr(given, name))
        if name == _FAST_LANDING:  # "Don't speed up for landing": no slower than its last part
            limit_m_s = max(limit_m_s, given.land_speed_m_s)
        counted_m = way_m if _is_stated(given, name) else np.where(unknown, way_m, 0.0)
        yield name, limit_m_s, counted_m, counted_m * s_per_m


def _slow_climb(given: FlightParameters) -> tuple[str, float]:
    """Return what limits the first part of a take-off, and to what. [m/s]"""
    if not _is_px4(given):
        return "climb_speed_m_s", given.climb_speed_m_s
    from planner.flight.motion.px4.lift_off import lift_off

    beyond = given.takeoff_speed_m_s > given.climb_speed_max_m_s
    governs = beyond and not _is_stated(given, "takeoff_speed_m_s")
    name = "climb_speed_max_m_s" if governs else "takeoff_speed_m_s"
    return name, lift_off(given).speed_m_s


_FAST_LANDING = "land_high_speed_m_s"
_SLOW_LANDING = (
    "land_speed_m_s",
    "land_crawl_speed_m_s",
    "land_slow_height_m",
    "land_slowest_height_m",
)
"""What makes the last part of a landing slow: two speeds, then the heights they begin at."""


def _fast_landing(given: FlightParameters) -> str:
    """Return what limits the first part of a landing; empty: what limits any descent."""
    own = getattr(given, _FAST_LANDING, given.descent_speed_m_s)
    return "" if own == given.descent_speed_m_s else _FAST_LANDING


def _slow_landing(
    given: FlightParameters, motion: Motion, unknown: BoolArray
) -> tuple[FloatArray, FloatArray, str]:
    """Return how far each segment is the slow part of a landing, how fast that is flown, and by what.

    With a height stated and no speed, only what lies above the 10 m of the defaults counts.
    ArduPilot without a rangefinder takes the level of its home for the ground, where that is lower.
    """
    from planner.flight.slow_landing import SlowLanding

    columns = motion.segments
    slow = SlowLanding.of(given)
    stated = [
        name
        for name in _SLOW_LANDING
        if _is_stated(given, name) and (name.endswith("speed_m_s") or getattr(given, name) > _LOW_M)
    ]
    moved_m = np.where(
        columns.state == STATE_INDEX[FlightState.LAND], np.maximum(-columns.climb_m, 0.0), 0.0
    )
    counts = unknown | bool(stated)
    bottom_m = np.zeros(len(moved_m))
    if not _is_px4(given) and not given.rangefinder_type:
        bottom_m = np.minimum(motion.state_at_time(columns.end_s).height_m, 0.0)
    top_m = np.minimum(bottom_m + moved_m, slow.highest_m)
    if not any(name.endswith("speed_m_s") for name in stated):
        bottom_m = np.where(unknown, bottom_m, np.maximum(bottom_m, _LOW_M))
    way_m = np.where(counts, np.maximum(top_m - bottom_m, 0.0), 0.0)
    took_s = slow.down_s(bottom_m + way_m) - slow.down_s(bottom_m)
    slow_m_s = np.where(way_m > 0.0, way_m / np.maximum(took_s, 1e-9), math.inf)
    return way_m, slow_m_s, (stated or _SLOW_LANDING)[0]
