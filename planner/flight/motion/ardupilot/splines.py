"""Splines as ArduPilot flies them: Hermite curves, slow where they bend.

After ``AP_Math/SplineCurve.cpp`` and ``AC_WPNav::set_spline_destination_NED_m``.  Along the curve the
vehicle speeds up and slows down with half its acceleration, towards the speed that half its acceleration
allows across a bend; it looks ahead to the end of the curve alone, so it comes to bends too fast.  The
curve is cut into short pieces of constant acceleration along it, and flown as cubics between their ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.flight.motion.ardupilot.legs import faster_findings, is_another_speed, limits_along
from planner.flight.motion.ardupilot.stages import is_kind, last_parts
from planner.flight.motion.ardupilot.track_lag import CLIMB_LAG_S, SETTLED_S, Behind, TrackLag
from planner.flight.motion.headway import SLOWEST_M_S, headway_m_s, slowed_legs
from planner.flight.motion.kinematics import (
    Beside,
    FlightState,
    dot,
    lengths,
    make_manoeuvres,
    quotient,
)
from planner.mission.route.stage import StageKind
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.motion.ardupilot.stages import StageColumns
    from planner.flight.motion.kinematics import Manoeuvres, Motion, SlowedLegs
    from planner.physics.wind import Wind
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_PIECES = 24
"""Pieces of a spline: a bend of 90° is then flown as ten of 9°."""
_LONGEST_TANGENTS = 4.0
"""``SPLINE_FACTOR``: both tangents together are at most so many times the way between the ends."""
_TAIL_STEP_S = 0.2
"""Of following the vehicle behind a spline: the lag of its lean. [s]"""
_SETTLED_M = 0.1
"""So near to its target a vehicle is on its way. [m]"""
_ACCELERATION_PART = 0.5
"""``TANGENTIAL_ACCEL_SCALER`` and ``LATERAL_ACCEL_SCALER``."""


class Splines(Value, eq=False):
    """The splines of a route, one per row, cut into pieces at k + 1 nodes."""

    stage: IntArray
    """Stage of each spline. (n,)"""
    position_m: FloatArray
    """(n, k + 1, 3) [m]"""
    tangent: FloatArray
    """Direction of flight. (n, k + 1, 3) [-]"""
    piece_m: FloatArray
    """Length of each piece. (n, k) [m]"""
    limit_m_s: FloatArray
    """Speed limit at the nodes. (n, k + 1) [m s⁻¹]"""
    acceleration_m_s2: FloatArray
    """Acceleration along each piece. (n, k) [m s⁻²]"""
    destination_m_s: FloatArray
    """Speed that the end of each is braked to. (n,) [m s⁻¹]"""
    to_end_m: FloatArray
    """Straight distance of the nodes to the end of their spline. (n, k + 1) [m]"""
    joins_before: BoolArray
    """Whether a spline continues the one in the row before. (n,)"""
    lag: TrackLag
    speed_at_start_m_s: FloatArray
    """For each stage of the route the highest speed its spline can begin with. (stages,) [m s⁻¹]"""
    speed_at_end_m_s: FloatArray
    """For each stage of the route the highest speed its spline can end with. (stages,) [m s⁻¹]"""
    slowed: SlowedLegs | None
    findings: tuple[Finding, ...]

    def flown(self, key: IntArray, start_m_s: FloatArray, end_m_s: FloatArray) -> FlownSplines:
        """Return the splines flown between speeds at their ends."""
        destination = np.minimum(self.destination_m_s, end_m_s)
        speed = _target_speeds_m_s(self, start_m_s, destination)
        followed = _followed(self, speed)
        pace, duration, flown_m = followed.pace, followed.duration_s, followed.flown_m
        # The leg behind a spline is flown at its whole speed: what its time still lags is counted here.
        ends = np.append(~self.joins_before[1:], True)
        duration[ends, -1] += (1.0 - pace[ends, -1]) * self.lag.filter_s * (speed[ends, -1] > 0.0)
        pace[ends, -1] = 1.0
        level_m = (self.piece_m * lengths(self.tangent[:, :-1, :2])).sum()
        manoeuvres = make_manoeuvres(
            key,
            FlightState.CRUISE,
            position_m=self.position_m,
            velocity_m_s=(speed * pace)[..., None] * self.tangent,
            duration_s=duration,
        )
        return FlownSplines(
            manoeuvres=manoeuvres,
            wide_m=max(flown_m - float(level_m), 0.0),
            stage=self.stage,
            ways=followed.ways,
        )


class FlownSplines(NamedTuple):
    """Splines as they are flown."""

    manoeuvres: Manoeuvres
    wide_m: float
    """The vehicle's way beyond that of the splines. [m]"""
    stage: IntArray
    """Of each spline. (n,)"""
    ways: list[_FollowedWay]
    """Of each spline. (n,)"""

    def counted(self, motion: Motion, scale: tuple[float, float]) -> Motion:
        """Return the motion that the splines are part of, with where the vehicle is beside it.

        ``scale`` is the autopilot's metres per metre, eastward and northward.
        """
        return replace(
            motion,
            wander_m=motion.wander_m + self.wide_m,
            beside=self._beside(motion, scale),
            climb_lag_s=CLIMB_LAG_S,
        )

    def _beside(self, motion: Motion, scale: tuple[float, float]) -> Beside:
        """Return where the vehicle is beside the motion that the splines are part of."""
        before = np.where(self.stage > 0, motion.done_segment[self.stage - 1], -1)
        begun_s = motion.segments.start_s[before + 1]
        times, gaps = [], []
        for begin_s, following_s, way in zip(
            begun_s, [*begun_s[1:], np.inf], self.ways, strict=True
        ):
            time_s = begin_s + np.array(way.time_s)
            own = time_s < following_s  # the tail ends where the next spline begins
            times.append(time_s[own])
            gaps.append(-np.array(way.gap_m)[own])
        time_s, gap_m = np.concatenate(times), np.concatenate(gaps)
        way_m = np.column_stack((gap_m.real / scale[0], gap_m.imag / scale[1]))
        chance = [way.is_chance for way in self.ways]
        return Beside(time_s=time_s, east_north_m=way_m, chance_s=begun_s[chance])


class _FollowedWay(NamedTuple):
    """Where a vehicle is behind its target on a spline and, if no other follows, after it."""

    time_s: list[float]
    """Since the beginning of the spline."""
    gap_m: list[complex]
    """To the target, seen from above: east + i north."""
    is_chance: bool = False
    """Whether it is not certain: see :class:`Behind`."""


class _Followed(NamedTuple):
    """How vehicles follow splines."""

    pace: FloatArray
    """Of the target's time at the nodes. (n, k + 1) [-]"""
    duration_s: FloatArray
    """(n, k) [s]"""
    flown_m: float
    """Way of the vehicle, from above."""
    ways: list[_FollowedWay]
    """Of each spline. (n,)"""


def _target_speeds_m_s(
    splines: Splines, start_m_s: FloatArray, destination_m_s: FloatArray
) -> FloatArray:
    """Return the speeds of the target at the nodes. (n, k + 1) [m s⁻¹]

    Notes
    -----
    ``SplineCurve::advance_target_along_track`` changes the speed by at most ±a dt towards the limit
    where the target is: that of the bend there, and sqrt(v_d² + 2 a d) for the straight distance d to
    the end, passed with v_d.  Nothing brakes ahead of a bend.
    """
    room = 2.0 * splines.acceleration_m_s2 * splines.piece_m
    last = np.concatenate((splines.acceleration_m_s2, splines.acceleration_m_s2[:, -1:]), axis=1)
    braked = destination_m_s[:, None] ** 2 + 2.0 * last * splines.to_end_m
    limit = np.minimum(splines.limit_m_s**2, braked)
    limit[:, -1] = np.minimum(limit[:, -1], destination_m_s**2)
    squares = np.empty(limit.shape)
    squares[:, 0] = start_m_s**2
    rows = zip(limit.tolist(), room.tolist(), splines.joins_before.tolist(), strict=True)
    now = 0.0
    for row, (limits, rooms, joins) in enumerate(rows):
        now = now if joins else float(squares[row, 0])
        found = [now]
        for most, by in zip(limits[1:], rooms, strict=True):
            now = min(max(most, now - by), now + by)
            found.append(now)
        squares[row] = found
    return np.sqrt(squares)


def _followed(splines: Splines, speed_m_s: FloatArray) -> _Followed:
    """Return how vehicles follow splines."""
    tangent = splines.tangent[..., 0] + 1j * splines.tangent[..., 1]
    mean = 0.5 * (speed_m_s[:, 1:] + speed_m_s[:, :-1])
    time_s = quotient(splines.piece_m, mean)
    pace, real_s = np.ones(speed_m_s.shape), np.zeros(time_s.shape)
    joins = splines.joins_before.tolist()
    rows = zip((speed_m_s * tangent).tolist(), time_s.tolist(), joins, strict=True)
    behind, lag = Behind(), splines.lag
    flown_m = 0.0
    ways: list[_FollowedWay] = []
    followed = {}  # what a jump repeats is followed in the same way again
    for row, (velocities, times, is_joined) in enumerate(rows):
        joined = behind._replace(flown_m=0.0, is_chance=False)
        behind = joined if is_joined else lag.steady(velocities[0])
        begun = (behind, *velocities, *times)
        if begun not in followed:
            pace[row, 0] = behind.pace
            way = _FollowedWay([0.0], [behind.gap_m])
            for node, time in enumerate(times):
                if time > 0.0:
                    behind, real_s[row, node] = lag.after(
                        time, velocities[node], velocities[node + 1], behind
                    )
                pace[row, node + 1] = behind.pace
                way.time_s.append(way.time_s[-1] + float(real_s[row, node]))
                way.gap_m.append(behind.gap_m)
            followed[begun] = row, behind, way._replace(is_chance=behind.is_chance)
        same, behind, way = followed[begun]
        pace[row], real_s[row] = pace[same], real_s[same]
        flown_m += behind.flown_m
        if not any(joins[row + 1 : row + 2]):
            way = _tail(lag, way, behind, velocities[-1])
        ways.append(way)
    return _Followed(pace, real_s, flown_m, ways)


def _tail(lag: TrackLag, way: _FollowedWay, behind: Behind, onward: complex) -> _FollowedWay:
    """Return a way and what follows it, until the vehicle is where its target is.

    The target goes on with the velocity of the end of the spline, or stands.
    """
    times, gaps = list(way.time_s), list(way.gap_m)
    while abs(gaps[-1]) > _SETTLED_M and times[-1] < way.time_s[-1] + SETTLED_S:
        behind, real_s = lag.after(_TAIL_STEP_S, onward, onward, behind)
        times.append(times[-1] + real_s)
        gaps.append(behind.gap_m)
    return _FollowedWay(times, gaps, way.is_chance)


def plan_splines(
    stages: StageColumns,
    parameters: ArduPilotParameters,
    *,
    wind: Wind | None,
    airspeed_limit_m_s: float | None,
) -> Splines | None:
    """Return the splines among the stages, if there are any."""
    is_spline = is_kind(stages.kind, StageKind.SPLINE)
    moves = (stages.place_m != stages.start_m).any(axis=1)
    row = np.flatnonzero(is_spline & moves)
    if not len(row):
        return None
    origin, end = stages.start_m[row], stages.place_m[row]
    leaving, arriving = _tangents(stages, row, is_spline)
    length = lengths(leaving) + lengths(arriving)
    most = _LONGEST_TANGENTS * lengths(end - origin)
    scale = np.divide(most, length, out=np.ones_like(most), where=length > most)[:, None]
    leaving, arriving = leaving * scale, arriving * scale
    cubic = (
        origin,
        leaving,
        3.0 * (end - origin) - 2.0 * leaving - arriving,
        2.0 * (origin - end) + leaving + arriving,
    )
    nodes = np.linspace(0.0, 1.0, _PIECES + 1)
    position, slope, bend = _cubic_at(cubic, nodes)
    tangent = _directions(slope, bend)
    middle = _cubic_at(cubic, nodes[:-1] + 0.5 / _PIECES)[1]
    slope_size = lengths(slope)
    # Simpson's rule for the length of each piece.
    piece = (slope_size[:, :-1] + 4.0 * lengths(middle) + slope_size[:, 1:]) / (6 * _PIECES)
    across = _bend_limit_m_s(tangent, bend, slope_size, parameters)

    def limits_by(commanded: IntArray) -> tuple[FloatArray, SlowedLegs | None]:
        """Return the speed limits at the nodes by the speeds of stages, and what wind slows down."""
        held, slowed = _held_speeds_m_s(
            stages.speed_m_s[commanded],
            tangent,
            position[..., 2],
            stages.item[row],
            wind=wind,
            airspeed_limit_m_s=airspeed_limit_m_s,
        )
        limit = np.minimum(limits_along(tangent, held, vertical_by(commanded)), across)
        limit[slope_size == 0.0] = 0.0  # without a tangent a spline ends, or begins, at rest
        return limit, slowed

    def vertical_by(commanded: IntArray) -> FloatArray:
        climb, descent = stages.climb_m_s[commanded, None], stages.descent_m_s[commanded, None]
        return np.where(tangent[..., 2] > 0.0, climb, descent)

    limit, slowed = limits_by(row)
    acceleration = _ACCELERATION_PART * limits_along(
        tangent, parameters.acceleration_m_s2, parameters.vertical_acceleration_m_s2
    )
    joins = np.zeros(len(row), np.bool_)
    joins[1:] = (row[1:] == row[:-1] + 1) & stages.is_passed[row[:-1]]
    acceleration = np.minimum(acceleration[:, 1:], acceleration[:, :-1])
    # The speed of DO_CHANGE_SPEED at a waypoint is not known when the end before it is planned.
    entry = np.where(joins, across[:, 0], np.inf)

    def destinations_by(limit: FloatArray) -> FloatArray:
        destination = np.where(stages.is_passed[row], limit[:, -1], 0.0)
        destination[:-1] = np.minimum(destination[:-1], entry[1:])
        return destination

    destination = destinations_by(limit)
    splines = Splines(
        stage=row,
        position_m=position,
        tangent=tangent,
        piece_m=piece,
        limit_m_s=limit,
        acceleration_m_s2=acceleration,
        destination_m_s=destination,
        to_end_m=lengths(position[:, -1:] - position),
        joins_before=joins,
        lag=TrackLag.of(parameters, airspeed_limit_m_s),
        speed_at_start_m_s=np.zeros(len(stages.kind)),
        speed_at_end_m_s=np.zeros(len(stages.kind)),
        slowed=slowed,
        findings=(),
    )
    begins = (row > 0) & stages.is_passed[np.maximum(row - 1, 0)]
    planned = _planned_stage(stages, row, is_spline)
    first = limits_by(planned)[0] if is_another_speed(stages, row, planned).any() else limit
    room = 2.0 * acceleration[:, 0] * splines.to_end_m[:, 0]
    start = np.minimum(first[:, 0], np.sqrt(destinations_by(first) ** 2 + room))
    start = np.where(begins, start, 0.0)
    splines.speed_at_start_m_s[row] = start
    speed = _target_speeds_m_s(splines, start, destination)
    splines.speed_at_end_m_s[row] = np.where(stages.is_passed[row], speed[:, -1], 0.0)
    commanded = limits_along(tangent, stages.speed_m_s[row, None], vertical_by(row))
    found = _faster_findings(speed, commanded, stages, row)
    return replace(splines, findings=found)


def _faster_findings(
    speed_m_s: FloatArray, commanded_m_s: FloatArray, stages: StageColumns, row: IntArray
) -> tuple[Finding, ...]:
    """Return where splines are flown faster than commanded, whatever bends and wind take off that."""
    share = speed_m_s / commanded_m_s
    every, worst = np.arange(len(row)), np.argmax(share, axis=1)
    meant = commanded_m_s[every, worst]
    return faster_findings(
        speed_m_s[every, worst], share[:, -1] * meant, meant, stages=stages, stage=row
    )


def _planned_stage(stages: StageColumns, row: IntArray, is_spline: BoolArray) -> IntArray:
    """Return by whose speed it is planned how fast splines begin: of that of the leg which leads there.

    Notes
    -----
    ``set_spline_destination_next`` sets the speed at the end of a straight leg as that begins, by what is
    commanded then; ``SCurve::set_speed_max`` lowers it where the leg is no faster, and raises it never.
    """
    first, _ = _whole_legs(stages)
    before = np.maximum(row - 1, 0)
    leg = first[before]
    leg = np.where(stages.is_speed_late[leg] & (leg > 0), leg - 1, leg)
    leads = (row > 0) & stages.is_passed[before] & ~is_spline[before]
    return np.where(leads, leg, row)


def _held_speeds_m_s(
    speed_m_s: FloatArray,
    tangent: FloatArray,
    height_m: FloatArray,
    item: IntArray,
    *,
    wind: Wind | None,
    airspeed_limit_m_s: float | None,
) -> tuple[FloatArray, SlowedLegs | None]:
    """Return the ground speeds that can be held at nodes of splines, and the slowed. (n, k + 1) [m s⁻¹]"""
    speed = np.repeat(speed_m_s[:, None], tangent.shape[1], axis=1)
    level = (tangent[..., :2] != 0.0).any(axis=-1)
    if airspeed_limit_m_s is None or not level.any():
        return speed, None
    limit = speed.copy()
    limit[level] = headway_m_s(
        tangent[level][:, :2],
        height_m[level][:, None],
        wind=wind,
        airspeed_limit_m_s=airspeed_limit_m_s,
    )
    slowed = slowed_legs(speed_m_s, limit.min(axis=1), item, moves=level.any(axis=1))
    return np.minimum(speed, np.maximum(limit, SLOWEST_M_S)), slowed


def _tangents(
    stages: StageColumns, row: IntArray, is_spline: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return the vectors with which splines leave and arrive; zero at rest. (n, 3) each [m]

    They leave along the straight leg before, or as the spline before arrives; they arrive towards the
    end of the straight leg after, or, before a spline, parallel to the line from their beginning to
    that spline's end.
    """
    after = np.minimum(row + 1, len(stages.kind) - 1)
    passed = stages.is_passed[row][:, None]
    from_m = np.where(is_spline[after][:, None], stages.start_m[row], stages.place_m[row])
    # A circle is named by its centre; a landing keeps the height.
    first, last = _whole_legs(stages)
    to_m = stages.place_m[last[after]].copy()
    level = is_kind(stages.kind[after], StageKind.LAND, StageKind.SET_DOWN)
    to_m[level, 2] = stages.place_m[row[level], 2]
    arriving = np.where(passed, to_m - from_m, 0.0)
    before = np.maximum(row - 1, 0)
    whole = np.zeros((len(stages.kind), 3))
    whole[row] = arriving
    leaving = np.where(
        is_spline[before][:, None],
        whole[before],
        stages.place_m[before] - stages.start_m[first[before]],
    )
    return np.where((stages.is_passed[before] & (row > 0))[:, None], leaving, 0.0), arriving


def _whole_legs(stages: StageColumns) -> tuple[IntArray, IntArray]:
    """Return for each stage the first and the last that are one leg with it to the autopilot. (stages,)"""
    begins = np.append(True, ~stages.is_underway[:-1])
    first = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))
    return first, last_parts(stages.is_underway)


def _cubic_at(
    cubic: tuple[FloatArray, ...], u: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return value, first and second derivative of cubics at parameters. (n, len(u), 3) each"""
    c0, c1, c2, c3 = (c[:, None] for c in cubic)
    u = u[None, :, None]
    return (
        c0 + u * (c1 + u * (c2 + u * c3)),
        c1 + u * (2.0 * c2 + 3.0 * u * c3),
        2.0 * c2 + 6.0 * u * c3,
    )


def _directions(slope: FloatArray, bend: FloatArray) -> FloatArray:
    """Return unit vectors along curves; at rest ends the slope vanishes and the bend shows the way."""
    ways = slope.copy()
    still = (slope == 0.0).all(axis=-1)
    toward = bend.copy()
    toward[:, -1] *= -1.0
    ways[still] = toward[still]
    return quotient(ways, lengths(ways)[..., None])


def _bend_limit_m_s(
    tangent: FloatArray, bend: FloatArray, slope_size: FloatArray, parameters: ArduPilotParameters
) -> FloatArray:
    """Return the speed at which bends need half the acceleration across. (n, k + 1) [m s⁻¹]"""
    across = bend - dot(bend, tangent)[..., None] * tangent
    size = lengths(across)
    allowed = _ACCELERATION_PART * limits_along(
        across, parameters.acceleration_m_s2, parameters.vertical_acceleration_m_s2
    )
    bent = (size > 0.0) & (slope_size > 0.0)
    limit = np.full(size.shape, np.inf)
    limit[bent] = slope_size[bent] * np.sqrt(allowed[bent] / size[bent])
    return limit
