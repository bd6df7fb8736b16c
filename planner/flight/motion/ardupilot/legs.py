"""The straight legs ArduPilot flies between stages: S-curves that overlap where corners are passed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.motion.ardupilot.stages import continues_return, is_kind, over_home_m
from planner.flight.motion.ardupilot.track_lag import (
    ATTITUDE_LAG_FACTOR,
    CORRECTED_S,
    SETTLED_S,
    TrackLag,
)
from planner.flight.motion.headway import held_speeds_m_s
from planner.flight.motion.kinematics import dot, horizontal, is_nonzero, lengths, quotient
from planner.flight.motion.s_curve import (
    PlannedCurves,
    SpeedLimits,
    bisected,
    peak_speed_from_rest_m_s,
    peak_speed_from_start_m_s,
    s_curves,
    speed_after_m_s,
    speed_ramps,
)
from planner.mission.route.stage import StageKind
from planner.mission.route.state import ITEM_NOT_MODELLED
from planner.units import GRAVITY_M_S2
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.motion.ardupilot.splines import Splines
    from planner.flight.motion.ardupilot.stages import StageColumns
    from planner.flight.motion.kinematics import SlowedLegs
    from planner.flight.motion.s_curve import SCurves, SpeedRamps
    from planner.physics.response import TransferFunction
    from planner.physics.wind import Wind
    from planner.vehicle.model import ManoeuvreResponse, Responses
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters


_BISECTIONS = 16
"""Halvings of a few seconds: to a tenth of a millisecond, where ArduPilot steps by 2.5 ms."""
_MANY = 200
"""Corners whose numbers take longer than the calls."""
_BELOW = 1.0 - 1e-9
"""What is below a limit."""


class Corners(Value, eq=False):
    """Waypoints between two straight legs; the leg before and the one after are asked at once."""

    ramps: SpeedRamps
    """At the end of the leg before, at the beginning of the leg after. (2, n)"""
    level: FloatArray
    """Horizontal parts of both directions. (2, n) [-]"""
    upward: FloatArray
    """Vertical parts of both directions. (2, n) [-]"""
    cosines: FloatArray
    """Of the angle between the legs, that of their sum, and as seen from above. (3, n) [-]"""
    speed_limit_m_s: FloatArray
    """Lower of the two legs' speed limits. (n,) [m s⁻¹]"""

    @classmethod
    def of(
        cls,
        before: FloatArray,
        after: FloatArray,
        *,
        slowing: SpeedRamps,
        speeding: SpeedRamps,
        speed_limit_m_s: FloatArray,
    ) -> Corners:
        """Return corners by the directions of their legs (n, 3) and the ramps about them."""
        level = np.stack((horizontal(before), horizontal(after)))
        cosine = dot(before, after)
        from_above = quotient(dot(before[:, :2], after[:, :2]), level[0] * level[1])
        return cls(
            ramps=slowing.beside(speeding),
            level=level,
            upward=np.stack((before[:, 2], after[:, 2])),
            cosines=np.stack((cosine, -cosine, from_above)),
            speed_limit_m_s=speed_limit_m_s,
        )

    def speed_m_s(self, half_s: FloatArray) -> FloatArray:
        """Return the speed half-way through overlaps of twice ``half_s``. (n,) [m s⁻¹]"""
        _, (before, after), _ = self.ramps.begun(half_s)
        return _length(after, before, self.cosines[1])

    def allow(self, half_s: FloatArray, parameters: ArduPilotParameters) -> BoolArray:
        """Return whether overlaps of twice ``half_s`` keep within all four limits. (…, n)"""
        way, speed, acceleration = self.ramps.begun(half_s[..., None, :])
        climb = acceleration * self.upward
        both = np.array((way, speed, acceleration * self.level))
        cosines = self.cosines.reshape(3, *(1,) * (half_s.ndim - 1), -1)
        distance, together, level = _length(both[..., 1, :], both[..., 0, :], cosines)
        most_climb = parameters.vertical_acceleration_m_s2 * _BELOW
        return np.asarray(
            (distance < parameters.waypoint_radius_m)
            & (together <= self.speed_limit_m_s * _BELOW)
            & (level <= parameters.corner_acceleration_m_s2 * _BELOW)
            & (np.abs(climb[..., 1, :] - climb[..., 0, :]) <= most_climb)
        )


def half_overlap_s(corners: Corners, parameters: ArduPilotParameters) -> FloatArray:
    """Return half the time by which the legs about each corner overlap. (n,) [s]

    The corner is announced as reached half-way through.  Within half a ramp ways, speeds and
    accelerations only grow: each limit is crossed once.
    """
    most: FloatArray = 0.5 * corners.ramps.duration_s.min(axis=0) * _BELOW
    is_most = corners.allow(most, parameters)
    if is_most.all():  # as on returns
        return most
    half, _ = bisected(
        lambda time: corners.allow(time, parameters),
        np.zeros_like(most),
        most,
        _BISECTIONS,
        at_once=4 if len(most) < _MANY else 1,
    )
    return np.where(is_most, most, half)


def _length(one: FloatArray, other: FloatArray, cosine: FloatArray) -> FloatArray:
    """Return the length of the difference of two vectors: the law of cosines."""
    return np.sqrt(np.maximum(one * one + other * other - 2.0 * one * other * cosine, 0.0))


def limits_along(
    direction: FloatArray, level: FloatArray | float, vertical: FloatArray | float
) -> FloatArray:
    """Return speed or acceleration limits along directions: ``kinematic_limit`` of AP_Math.

    Directions (…, 3) are of any length; the horizontal limit holds where it is zero.
    """
    size = lengths(direction)
    limit = np.minimum(
        quotient(level * size, lengths(direction[..., :2]), np.inf),
        quotient(vertical * size, np.abs(direction[..., 2]), np.inf),
    )
    return np.where(size > 0.0, limit, level)


def drag_per_s(parameters: ArduPilotParameters, airspeed_limit_m_s: float) -> float:
    """Return the deceleration by drag over the airspeed: at the limit the greatest lean holds it. [s⁻¹]"""
    return GRAVITY_M_S2 * math.tan(parameters.lean_angle_max_rad) / airspeed_limit_m_s


BRAKING_FRACTION = 0.97
"""A stop counts from where the speed has fallen to this fraction of the cruise. [-]"""
_STOP_BISECTIONS = 30
"""Halvings of some ten seconds: to a hundred-millionth of one."""
_RESIDENCES = 20.0
"""After so many mean residence times a response has ended. [-]"""


def _level_limits(shape: tuple[int, ...], parameters: ArduPilotParameters) -> SpeedLimits:
    """Return the limits of level flight, in a shape."""
    limits = (parameters.acceleration_m_s2, parameters.jerk_m_s3, parameters.jerk_rise_s)
    return SpeedLimits(*(np.full(shape, limit) for limit in limits))


def braking_distance_m(speed_m_s: FloatArray, parameters: ArduPilotParameters) -> FloatArray:
    """Return the whole way of the S-curve's braking from a speed, its command included. (n,) [m]"""
    speed = np.asarray(speed_m_s, np.float64)
    ramps = speed_ramps(speed, _level_limits(speed.shape, parameters))
    return np.asarray(0.5 * speed * ramps.duration_s)


def stopping_distance_m(
    speed_m_s: FloatArray,
    parameters: ArduPilotParameters,
    response: ManoeuvreResponse | None = None,
) -> FloatArray:
    """Return the way from 97 % of a speed to standing still, as stops are measured. (n,) [m]

    ``response`` is how the speed follows its reference; default without any lag.

    Notes
    -----
    The S-curve's braking from v lasts T and takes v T/2.  The speed has fallen by 3 % after
    t = t_j/2 + sqrt(0.06 v/J), the way by then is v t − J (t − t_j/2)³/6.
    """
    speed = np.asarray(speed_m_s, np.float64)
    if response is not None:
        different, where = np.unique(speed, return_inverse=True)
        return _followed_stop_m(different, parameters, response)[where]
    ramps = speed_ramps(speed, _level_limits(speed.shape, parameters))
    lost = (1.0 - BRAKING_FRACTION) * speed
    since = np.sqrt(2.0 * lost / np.where(ramps.jerk_m_s3 > 0.0, ramps.jerk_m_s3, 1.0))
    before = speed * (ramps.rest_s + since) - ramps.jerk_m_s3 * since**3 / 6.0
    return np.asarray(0.5 * speed * ramps.duration_s - before)


def _followed_stop_m(
    speed: FloatArray, parameters: ArduPilotParameters, response: ManoeuvreResponse
) -> FloatArray:
    """Return the ways of a vehicle that follows its braking reference with a lag. (n,) [m]"""
    from planner.physics.response import Edge, ShapedResponse

    system = response.transfer_function
    ramps = speed_ramps(speed, _level_limits(speed.shape, parameters))
    jerk = ramps.jerk_m_s3 / (system.dc_gain or 1.0)  # the vehicle arrives where it is sent
    begun, steady = ramps.rest_s, ramps.rest_s + ramps.jerk_s
    eased = steady + ramps.steady_s
    lost = ShapedResponse(
        system=system,
        edges=(
            Edge(jerk, begun, order=2),
            Edge(-jerk, steady, order=2),
            Edge(-jerk, eased, order=2),
            Edge(jerk, eased + ramps.jerk_s, order=2),
        ),
    )
    late_s = system.mean_residence_time_s
    _, high = bisected(
        lambda time: lost.value(time) < (1.0 - BRAKING_FRACTION) * speed,
        np.zeros_like(speed),
        ramps.duration_s + _RESIDENCES * late_s,
        _STOP_BISECTIONS,
    )
    return np.asarray(speed * (0.5 * ramps.duration_s + late_s - high) + lost.integral(high))


def settling_waits_s(
    legs: ArduPilotLegs, responses: Responses | None, parameters: ArduPilotParameters, lag: TrackLag
) -> FloatArray:
    """Return how long after its reference the vehicle is within WP_RADIUS of where legs stop. (n,) [s]

    Level legs wait for the speed, and for what the drag carries past, steep ones for the altitude;
    nothing waits where the end is passed, or for a response that was not identified.

    Notes
    -----
    ``AC_WPNav``: a waypoint that is no corner is reached when the S-curve has ended and the vehicle is
    within the radius.
    """
    waits = np.zeros(len(legs.key))
    stops, steep = _stops(legs)
    level = np.flatnonzero(stops & ~steep)
    waits[level] = lag.settling_s(legs.curves.down.select(level), parameters.waypoint_radius_m)
    if responses is None:
        return waits
    for response, some in ((responses.speed, ~steep), (responses.altitude, steep)):
        rows = np.flatnonzero(stops & some & is_nonzero(legs.direction))
        if response is not None and len(rows):
            followed_s = _waits_s(
                legs, rows, response.transfer_function, parameters.waypoint_radius_m
            )
            waits[rows] = np.maximum(waits[rows], followed_s)
    return waits


def past_stops_m(legs: ArduPilotLegs, lag: TrackLag) -> float:
    """Return the way that the vehicle flies past the ends of level legs, and back, in all [m]."""
    if lag.drag == 0.0:
        return 0.0
    stops, steep = _stops(legs)
    return float(lag.past_stops_m(legs.curves.down.select(np.flatnonzero(stops & ~steep))).sum())


def _stops(legs: ArduPilotLegs) -> tuple[BoolArray, BoolArray]:
    """Return which legs end at rest, and which are more up or down than level. (n,) each"""
    stops = (legs.half_overlap_s == 0.0) & (legs.corner_speed_m_s == 0.0)
    return stops, np.abs(legs.direction[:, 2]) > horizontal(legs.direction)


def _waits_s(
    legs: ArduPilotLegs, rows: IntArray, system: TransferFunction, radius_m: float
) -> FloatArray:
    """Return the waits of some legs that stop, each begun at rest. (rows,) [s]"""
    from planner.physics.response import Edge, ShapedResponse

    curves = legs.curves
    phases = curves.phases()
    start, jerk = phases.start_s[rows], phases.jerk_m_s3[rows]
    steps = np.diff(jerk, axis=1, prepend=0.0) / (
        system.dc_gain or 1.0
    )  # the vehicle arrives where it is sent
    followed = ShapedResponse(
        system=system,
        edges=(
            Edge(curves.start_m_s[rows]),
            *(Edge(step, begin, order=2) for begin, step in zip(start.T, steps.T, strict=True)),
        ),
    )
    length, end = curves.length_m[rows], curves.duration_s[rows]
    high, late = end, np.abs(length - followed.integral(end)) > radius_m
    if late.any():
        _, high = bisected(
            lambda time: np.abs(length - followed.integral(time)) > radius_m,
            end,
            end + _RESIDENCES * system.mean_residence_time_s,
            _STOP_BISECTIONS,
        )
    return np.where(late, high - end, 0.0)


SLOTS = 8
"""A stage's manoeuvres are numbered from SLOTS times its position."""

_VERTICAL_LAG_S = 0.37
"""Hover throttle over gravity and PSC_D_ACC_I, both at their defaults: 0.36 / (9.81 · 0.1). [s]"""
_COORDINATE_M = 1e-7 * math.radians(6_378_100.0)
"""Coordinates are whole 1e-7 degrees: 1.1 cm. [m]"""
_HEIGHT_STEP_M = 0.01
"""Altitudes of locations are whole centimetres. [m]"""
_MEAN_STEP_M = 0.8**4 * _HEIGHT_STEP_M
"""An S-curve so short takes a time by the fourth root of its length: on the mean of all lengths up to a
centimetre 4/5 of that of the centimetre. [m]"""
_HERE_M = math.hypot(_COORDINATE_M, _COORDINATE_M, _HEIGHT_STEP_M)
"""``ModeAuto::loc_from_cmd`` makes a location of where the vehicle is sent to: each of its three whole
numbers is cut off by one as recorded.  A leg leads there. [m]"""


class ArduPilotLegs(Value, eq=False):
    """Straight legs, one per row, in flown order."""

    key: IntArray
    """Place in the order of the flight: SLOTS times the stage, plus the slot. (n,)"""
    start_m: FloatArray
    """East, north, height above home. (n, 3) [m]"""
    direction: FloatArray
    """East, north, up; zero where a leg leads nowhere. (n, 3) [-]"""
    curves: SCurves
    half_overlap_s: FloatArray
    """Half the time by which the next leg begins before this one ends. (n,) [s]"""
    corner_speed_m_s: FloatArray
    """Speed with which the end is passed; zero for a stop. (n,) [m s⁻¹]"""
    hidden_s: FloatArray
    """Time from the beginning during which the vehicle still comes out of a circle. (n,) [s]"""
    early_s: FloatArray
    """Time for which the leg is under way before the vehicle is out of that circle. (n,) [s]"""
    flown_peak_m_s: FloatArray
    """Highest speed of the vehicle itself: a pointed peak is rounded by its lag. (n,) [m s⁻¹]"""
    slowed: SlowedLegs | None
    findings: tuple[Finding, ...]


class _Plan(Value, eq=False):
    """Straight legs as they are planned, one per row, before any is rounded into the next."""

    direction: FloatArray
    length_m: FloatArray
    limits: SpeedLimits
    speed_m_s: FloatArray
    """Speed limit in the end. (n,) [m s⁻¹]"""
    planned_m_s: FloatArray
    """Speed limit each is planned with. (n,) [m s⁻¹]"""
    is_changed: BoolArray
    """Whether that is another, changed under way. (n,)"""
    start_m_s: FloatArray
    end_m_s: FloatArray
    wait_s: FloatArray

    def curves(self, changed_s: FloatArray) -> SCurves:
        """Return the curves where speeds are changed so long after they begin. (n,) [s]"""
        return s_curves(
            self.length_m,
            self.limits,
            speed_m_s=self.speed_m_s,
            start_m_s=self.start_m_s,
            end_m_s=self.end_m_s,
            planned=PlannedCurves(self.planned_m_s, changed_s, self.is_changed),
            wait_s=self.wait_s,
        )

    def corners(self, rows: IntArray, curves: SCurves) -> Corners:
        """Return the corners at the ends of some legs."""
        speeding, entered = curves.up, rows + 1
        if self.is_changed.any():
            from_rest = peak_speed_from_rest_m_s(self.length_m, self.limits)
            reached = np.minimum(self.planned_m_s, from_rest)
            speeding = speed_ramps(
                np.where(self.is_changed, reached, curves.first_m_s), self.limits
            )
        return Corners.of(
            self.direction[rows],
            self.direction[entered],
            slowing=curves.down.select(rows),
            speeding=speeding.select(entered),
            speed_limit_m_s=np.minimum(self.speed_m_s[rows], self.planned_m_s[entered]),
        )

    def rounded(
        self,
        rows: IntArray,
        parameters: ArduPilotParameters,
        *,
        early_s: FloatArray,
        longest_s: FloatArray | None,
    ) -> tuple[FloatArray, SCurves, Corners]:
        """Return half the overlaps of legs with the next (n,), their curves, and their corners.

        ``early_s`` is how long before the end of each of ``rows`` the speed of the next is commanded; 0:
        half-way through the corner.  ``longest_s`` is the longest half of their overlaps.
        """
        half, changed_s = np.zeros((2, len(self.length_m)))

        def halved(corners: Corners) -> FloatArray:
            most = half_overlap_s(corners, parameters) if len(rows) else np.zeros(0)
            return most if longest_s is None else np.minimum(most, longest_s)

        curves = self.curves(changed_s)
        corners = self.corners(rows, curves)
        half[rows] = halved(corners)
        if len(rows) and self.is_changed.any():
            # What is left of speeding up by then decides how fast the leg ends.
            since_s = np.maximum(2.0 * half[rows] - early_s, 0.0)
            changed_s[rows + 1] = np.where(early_s > 0.0, since_s, half[rows])
            curves = self.curves(changed_s)
            corners = self.corners(rows, curves)
            half[rows] = halved(corners)
        return half, curves, corners


def plan_legs(
    stages: StageColumns,
    splines: Splines | None,
    parameters: ArduPilotParameters,
    *,
    wind: Wind | None,
    airspeed_limit_m_s: float | None,
) -> ArduPilotLegs:
    """Return the legs of stages, with their corners; legs join splines at speed."""
    lag = TrackLag.of(parameters, airspeed_limit_m_s)
    key, start, way, shortest = _flown_ways(stages, parameters, lag)
    leads = (length := lengths(way)) > shortest
    direction = np.divide(way, length[:, None], out=np.zeros_like(way), where=leads[:, None])
    stage = key // SLOTS
    ends_m = np.stack((start[:, 2], start[:, 2] + way[:, 2]), axis=1)

    def speeds_along(commanded: IntArray) -> tuple[FloatArray, SlowedLegs | None]:
        held, slowed = held_speeds_m_s(
            stages.speed_m_s[commanded],
            direction[:, :2],
            stages.item[stage],
            height_m=ends_m,
            wind=wind,
            airspeed_limit_m_s=airspeed_limit_m_s,
        )
        return _speed_along(stages, commanded, held, direction), slowed

    speed, slowed = speeds_along(stage)
    acceleration = limits_along(
        direction, parameters.acceleration_m_s2, parameters.vertical_acceleration_m_s2
    )
    rows = _corner_rows(stages, key, leads, stops=parameters.stops_at_waypoints)
    limits = _level_limits(key.shape, parameters)._replace(acceleration_m_s2=acceleration)
    start_m_s, end_m_s = _speeds_of_splines(stages, splines, key, leads)
    under, rows = _parted(stages, stage, rows)
    if splines is not None:
        speed = np.where(
            (start_m_s > 0.0) | (end_m_s > 0.0),
            peak_speed_from_start_m_s(_whole_m(length, under), start_m_s, speed, limits),
            speed,
        )
    if len(under):
        start_m_s[under + 1] = end_m_s[under] = _speeds_under_way(
            speed, length, limits, under, start_m_s=start_m_s[under], end_m_s=end_m_s[under + 1]
        )
    entered = rows + 1
    from_rest = start_m_s == 0.0
    from_rest[entered] = ~leads[rows]
    # A corner is entered before DO_CHANGE_SPEED is carried out at its middle.
    commanded = _planned_stage(stages, stage, from_rest)
    commanded[entered], commanded[under + 1] = stage[rows], stage[under]

    # From its stopping point the vehicle moves back already.
    waits = from_rest & (leads | (shortest == _COORDINATE_M) | (shortest == _HERE_M))
    wait_s = np.where(waits, start_delay_s(direction, parameters), 0.0)

    def plan_by(commanded: IntArray) -> _Plan:
        is_changed = is_another_speed(stages, stage, commanded)
        return _Plan(
            direction=direction,
            length_m=np.maximum(length, shortest),
            limits=limits,
            speed_m_s=speed,
            planned_m_s=speeds_along(commanded)[0] if is_changed.any() else speed,
            is_changed=is_changed,
            start_m_s=start_m_s,
            end_m_s=end_m_s,
            wait_s=wait_s,
        )

    plan, early_s, longest_s = plan_by(commanded), stages.next_early_s[stage[rows]], None
    if early_s.any():
        longest_s = np.full(len(rows), np.inf)
        old_s = half_overlap_s(plan.corners(rows, plan.curves(np.zeros(len(key)))), parameters)
        # Where the next leg has not begun as its speed is commanded, it is planned anew.
        anew = np.flatnonzero((early_s > 0.0) & (early_s >= 2.0 * old_s))
        commanded[entered[anew]], longest_s[anew] = stage[entered[anew]], 0.5 * early_s[anew]
        plan = plan_by(commanded)
    half, curves, corners = plan.rounded(rows, parameters, early_s=early_s, longest_s=longest_s)
    corner_speed, lost_s = curves.end_m_s.copy(), np.zeros(len(key))
    if len(rows):
        corner_speed[rows] = corners.speed_m_s(half[rows])
        lost_s[entered] = lag.lost_in_corners_s(
            corners.ramps,
            half[rows],
            before=direction[rows],
            after=direction[entered],
            cruise_s=curves.cruise_s[entered],
        )
    starts = np.flatnonzero(from_rest & leads)
    lost_s[starts] = _lost_at_starts_s(
        stages, stage, starts, curves, direction=direction, parameters=parameters, lag=lag
    )
    cut = _cut_rows(stages, key, way)
    half[cut], corner_speed[cut] = _cut_short(curves, cut, parameters.waypoint_radius_m)
    wait_s[cut + 1] = 0.0  # begun in motion
    if parameters.plans_legs_anew:
        knows_next = stages.leads_straight_on | is_kind(stages.kind, StageKind.RETURN)
        knows_next = knows_next[stage] & (key % SLOTS == 0)
        wait_s += np.where(from_rest, np.where(knows_next, *_PLANNED_ANEW_S), 0.0)
    return ArduPilotLegs(
        key=key,
        start_m=start,
        direction=direction,
        curves=replace(curves, wait_s=wait_s + lost_s),
        half_overlap_s=half,
        corner_speed_m_s=corner_speed,
        hidden_s=np.zeros(len(key)),
        early_s=np.zeros(len(key)),
        flown_peak_m_s=_flown_peak_m_s(curves, parameters),
        slowed=slowed,
        findings=(
            *faster_findings(curves.first_m_s, curves.peak_m_s, speed, stages=stages, stage=stage),
            *_beyond_findings(curves, stages.item[stage], parameters),
            *_standing_findings(
                curves.duration_s - wait_s,
                stages.item[stage],
                is_here=~leads & (shortest == _HERE_M),
                filter_s=lag.filter_s,
            ),
        ),
    )


def _lost_at_starts_s(
    stages: StageColumns,
    stage: IntArray,
    starts: IntArray,
    curves: SCurves,
    *,
    direction: FloatArray,
    parameters: ArduPilotParameters,
    lag: TrackLag,
) -> FloatArray:
    """Return the time legs lose that begin at rest: less shortly behind the stop of the one before. [s]"""
    if lag.drag == 0.0:
        return np.zeros(len(starts))
    lost_s = lag.lost_at_starts_s(curves.up.select(starts), direction[starts])
    came = np.maximum(starts - 1, 0)
    rests_s = stages.hold_s[stage[came]]
    rows = np.flatnonzero((stage[came] == stage[starts] - 1) & (rests_s < SETTLED_S))
    starts, came, stops = starts[rows], came[rows], curves.down.select(came[rows])
    lost_s[rows] -= lag.spared_behind_stops_s(
        curves.up.select(starts),
        direction[starts],
        stops=stops,
        came=direction[came],
        since_s=rests_s[rows] + lag.settling_s(stops, parameters.waypoint_radius_m),
    )
    return lost_s


def _planned_stage(stages: StageColumns, stage: IntArray, from_rest: BoolArray) -> IntArray:
    """Return by whose speed each leg is planned: a stage whose own comes late begins with that before."""
    is_first = np.diff(stage, prepend=-1) > 0
    is_late = from_rest & is_first & stages.is_speed_late[stage] & (stage > 0)
    return np.where(is_late, stage - 1, stage)


FASTER_THAN_COMMANDED = Rule(
    "E126 faster-than-commanded",
    Severity.WARNING,
    summary="A leg is flown faster than commanded.",
    why="A slower DO_CHANGE_SPEED at a waypoint that is flown through, or behind another DO_ item, comes "
    "when the next leg has begun: ArduPilot keeps the old speed on a short leg and slows down late on a "
    "long one.  Photos of such a leg are too far apart or blurred, and its time and energy are not those of "
    "the speed in the file.",
    how="``SCurve::set_speed_max``: what is left of the steady acceleration is cut short; the rest is "
    "taken off in the cruise, if that lasts longer than 12 jerk rises.  A spline that continues another "
    "slows down by half the acceleration, from its beginning on.  Fires where the speed reached is "
    "more than 2 % above the commanded one, which is no cruise at it any more.",
    fix="put DO_CHANGE_SPEED a leg earlier, or let the vehicle stop at the waypoint (a hold of 1 s) and put "
    "it before other DO_ items",
)
_CRUISING = 0.98
"""A speed is that of a cruise from this fraction of it on, as for a corner. [-]"""


def faster_findings(
    first_m_s: FloatArray,
    kept_m_s: FloatArray,
    speed_m_s: FloatArray,
    *,
    stages: StageColumns,
    stage: IntArray,
) -> tuple[Finding, ...]:
    """Return where legs of stages are flown faster than commanded, first and to the end, in one finding.

    What the ground slows down, nothing commands.
    """
    item, is_slowed = stages.item[stage], (stages.speed_m_s < stages.commanded_m_s)[stage]
    rows = np.flatnonzero((_CRUISING * first_m_s > speed_m_s) & ~is_slowed)
    if not len(rows):
        return ()
    kept = int((_CRUISING * kept_m_s[rows] > speed_m_s[rows]).sum())
    worst = rows[np.argmax(first_m_s[rows] / speed_m_s[rows])]
    count = quantity.count(len(rows), "leg")
    whole = {0: "", len(rows): ", to the end"}.get(kept, f", {kept} of them to the end")
    message = (
        f"faster than commanded: {count} from item {int(item[rows[0]])} on{whole}, up to "
        f"{quantity.speed(float(first_m_s[worst]))} where "
        f"{quantity.speed(float(speed_m_s[worst]))} is commanded (item {int(item[worst])})"
    )
    return (FASTER_THAN_COMMANDED.finding(message, item=int(item[rows[0]])),)


_BEYOND_M = 1.0
"""A target that flies on no farther beyond the end of its leg is where its vehicle may be. [m]"""


def _beyond_findings(
    curves: SCurves, item: IntArray, parameters: ArduPilotParameters
) -> tuple[Finding, ...]:
    """Return where targets fly on beyond the ends of their legs, in one finding: an error beyond WP_RADIUS.

    Notes
    -----
    Flown, 5 m before a spline from 8 to 2 m/s: on for 11 m, then the target is back at the place at 7 m/s,
    and the vehicle 9 m beside; on it flies at up to 8.8 m/s.
    """
    rows = np.flatnonzero(curves.beyond_m > _BEYOND_M)
    if not len(rows):
        return ()
    farthest_m = float(curves.beyond_m[rows].max())
    message = (
        "DO_CHANGE_SPEED so near to a place that ArduPilot flies on beyond it, its target by "
        f"{quantity.distance(farthest_m)}, and comes back, which is not predicted; put it farther before"
    )
    severity = Severity.ERROR if farthest_m > parameters.waypoint_radius_m else None
    return (ITEM_NOT_MODELLED.finding(message, severity=severity, item=int(item[rows[0]])),)


_AS_LIKELY = np.linspace(-1.0, 1.0, 41)
"""Half of the returns wait for nothing, the others for any part of the most."""
_PLANNED_ANEW_S = (1.4, 0.35)
"""How much longer than without its path planner the vehicle stands before a leg, where the one behind it is
known, and where not.  Twice, or once, it is made to stop for 0.1 s, still moving back from the stop before;
the target of the leg stands until that is over.  Flown: 1.1 to 1.9 s in 18 starts, 0.0 to 1.0 s in 12. [s]"""
_ANEW_WITHIN_S = 0.7
"""Half the width of the uniform distribution with their deviation, 0.4 s. [s]"""
_STANDS = 0.8
"""With an A/J of 0.75 of their time legs to what is here took up to 3 s more, of 0.84 with 1.7 s. [-]"""


def _standing_findings(
    duration_s: FloatArray, item: IntArray, *, is_here: BoolArray, filter_s: float
) -> tuple[Finding, ...]:
    """Return where a target may stand still on its way to what is here, in one finding.

    Notes
    -----
    ``advance_wp_target_along_track``: however far off the vehicle is, its filter lets A/J of the track's time
    pass.  A leg that takes longer stands still until the vehicle is off by no more than it is fast, some
    centimetres a second.  Flown behind a stop: 10 to 17 s, and with altitude 0 beyond 160 s.
    """
    rows = np.flatnonzero(is_here & (duration_s > filter_s))
    if not len(rows):
        return ()
    stands = bool((_STANDS * duration_s[rows] > filter_s).any())
    message = (
        f"WPNAV_JERK is too high for {quantity.count(len(rows), 'item')} without a place: ArduPilot may "
        f"{'stand still there, for 10 s or for ever' if stands else 'take 2 s longer there'}, which is not "
        "predicted; write coordinates and altitude"
    )
    severity = Severity.ERROR if stands else None
    return (ITEM_NOT_MODELLED.finding(message, severity=severity, item=int(item[rows[0]])),)


class StuckReturns(NamedTuple):
    """Returns that may stand still where they begin."""

    stage: IntArray
    """(n,)"""
    most_s: FloatArray
    """How long. (n,) [s]"""

    @classmethod
    def of(
        cls, legs: ArduPilotLegs, stages: StageColumns, parameters: ArduPilotParameters
    ) -> StuckReturns:
        """Return those whose first leg is a rounded centimetre, begun shortly behind a stop.

        Notes
        -----
        As of what is here, see :func:`_standing_findings`: its target stands until the vehicle is off by no
        more than it is fast.  The stop is reached within WP_RADIUS, the vehicle moving past it; it comes
        back by :data:`CORRECTED_S`, to the speed of that leg.  Whether the rounding leads on or back, where
        nothing is waited for, is not known.  Recorded with WPNAV_JERK 12: none in 13 of 23, up to 9 s.
        """
        stage = legs.key // SLOTS
        curves, before = legs.curves, np.maximum(stage - 1, 0)
        filter_s = parameters.acceleration_m_s2 / parameters.jerk_m_s3
        is_short = (legs.key % SLOTS == 0) & (curves.length_m == _MEAN_STEP_M)
        is_slow = curves.duration_s - curves.wait_s > filter_s
        comes = is_kind(stages.kind[before], StageKind.GO, StageKind.SPLINE) & (stage > 0)
        begins = is_kind(stages.kind[stage], StageKind.RETURN)
        rows = np.flatnonzero(begins & is_short & is_slow & comes)
        off = parameters.waypoint_radius_m / curves.peak_m_s[rows]
        most_s = CORRECTED_S * np.log(off) - stages.hold_s[before[rows]]
        return cls(stage[rows][most_s > 0.0], most_s[most_s > 0.0])

    def spread_s(self) -> FloatArray | None:
        """Return by how much they may be longer, each as likely as another; ``None``: by nothing. (k,) [s]"""
        if not len(self.stage):
            return None
        return np.asarray(np.maximum(_AS_LIKELY, 0.0) * self.most_s.sum())

    def findings(self, item: IntArray) -> tuple[Finding, ...]:
        """Return them in one finding, by the items of stages."""
        if not len(self.stage):
            return ()
        message = (
            "WPNAV_JERK is too high for a return begun behind a stop: ArduPilot may stand still there for up "
            f"to {quantity.duration(float(self.most_s.max()))}"
        )
        return (ITEM_NOT_MODELLED.finding(message, item=int(item[self.stage[0]])),)


def _flown_ways(
    stages: StageColumns, parameters: ArduPilotParameters, lag: TrackLag
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """Return key, start, way and shortest length of every leg that takes time, in flown order."""
    key, start, way = _ways(stages, parameters)
    shortest = _shortest_m(stages, key, parameters, lag)
    flown = is_nonzero(way) | (shortest > 0.0)
    return key[flown], start[flown], way[flown], shortest[flown]


def _ways(
    stages: StageColumns, parameters: ArduPilotParameters
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return key, start and way of every leg in flown order, those of no length too."""
    straight = stages.where(StageKind.GO, StageKind.LOITER)
    height = stages.where(StageKind.CHANGE_HEIGHT)
    moved = is_nonzero(stages.place_m[height, :2] - stages.start_m[height, :2])
    level = stages.where(StageKind.LAND, StageKind.SET_DOWN)
    circle = stages.where(StageKind.CIRCLE)
    leg, home = stages.where(StageKind.RETURN_LEG), stages.where(StageKind.RETURN)
    end = stages.place_m.copy()
    end[level, 2] = stages.start_m[level, 2] + stages.rise_m[level]
    end[circle] = stages.edge_m[circle]
    end[leg], end[home] = stages.end_m[leg], over_home_m(stages, home, parameters)
    home = np.sort(np.concatenate((leg, home)))
    begins = ~continues_return(stages, home)
    single = np.sort(np.concatenate((straight, height[moved], level, circle, home[~begins])))
    home = home[begins]
    top, over = stages.start_m[home].copy(), end[home]
    top[:, 2] = over[:, 2]
    key = np.concatenate((single * SLOTS, home * SLOTS, home * SLOTS + 1))
    start = np.concatenate((stages.start_m[single], stages.start_m[home], top))
    way = np.concatenate((end[single], top, over)) - start
    order = np.argsort(key, kind="stable")
    return key[order], start[order], way[order]


def _shortest_m(
    stages: StageColumns, key: IntArray, parameters: ArduPilotParameters, lag: TrackLag
) -> FloatArray:
    """Return the length that even legs to where the vehicle stands have. (n,) [m]

    After a take-off the vehicle stands up to a step of the coordinates beside what a file can name, and
    what names no place of its own is made a location all the same; the altitude that a landing or a
    return begins with is rounded to the centimetre.  All cost the S-curve of that step, about a second.
    A return flies home from the stopping point, which is beyond the place that the vehicle has come to
    (``ModeRTL::build_path``).
    """
    stage = key // SLOTS
    rounded = is_kind(stages.kind[stage], StageKind.LAND, StageKind.RETURN)
    step = np.where(stages.is_first_leg[stage], _COORDINATE_M, 0.0)
    step[stages.is_here[stage]] = _HERE_M
    shortest = np.where(key % SLOTS == 0, np.where(rounded, _MEAN_STEP_M, step), 0.0)
    if lag.drag == 0.0:  # it stops where its target does
        return shortest
    home = np.flatnonzero((key % SLOTS == 1) & (stage > 0))
    came = stage[home] - 1
    way = lengths(stages.end_m[came] - stages.start_m[came])
    speed = np.minimum(
        stages.speed_m_s[came], peak_speed_from_rest_m_s(way, _level_limits(way.shape, parameters))
    )
    ramps = speed_ramps(speed, _level_limits(way.shape, parameters))
    since_s = stages.hold_s[came] + lag.settling_s(ramps, parameters.waypoint_radius_m)
    shortest[home] = lag.beyond_stops_m(ramps) * np.exp(-since_s / CORRECTED_S)
    return shortest


def _corner_rows(stages: StageColumns, key: IntArray, leads: BoolArray, *, stops: bool) -> IntArray:
    """Return the legs whose end is flown through towards the next; returns may stop at their height."""
    stage, slot = key // SLOTS, key % SLOTS
    onward = (stage[1:] == stage[:-1] + 1) & (slot[1:] == 0) & stages.is_passed[stage[:-1]]
    returning = (stage[1:] == stage[:-1]) & (slot[1:] == 1) & (not stops)
    return np.flatnonzero((onward & leads[1:]) | returning)


_LEVEL_M = 0.05
"""``loiter_to_alt_run`` is done so near to its height. [m]"""


def _cut_rows(stages: StageColumns, key: IntArray, way_m: FloatArray) -> IntArray:
    """Return the level legs to LOITER_TO_ALT that are cut short by the next.

    Notes
    -----
    ``ModeAuto::loiter_to_alt_run`` is there as soon as the vehicle is within WP_RADIUS, still braking
    (``reached_wp_destination_NE``).
    """
    stage, slot = key // SLOTS, key % SLOTS
    is_level = is_kind(stages.kind[stage], StageKind.CHANGE_HEIGHT) & (
        np.abs(way_m[:, 2]) < _LEVEL_M
    )
    onward = (stage[1:] == stage[:-1] + 1) & (slot[1:] == 0) & is_nonzero(way_m)[1:]
    leads = is_kind(stages.kind[stage], StageKind.GO, StageKind.LOITER, StageKind.CHANGE_HEIGHT)
    return np.flatnonzero(is_level[:-1] & onward & leads[1:])


def _cut_short(curves: SCurves, cut: IntArray, radius_m: float) -> tuple[FloatArray, FloatArray]:
    """Return half the time by which the next begins while legs brake within a radius, and their speed then.

    No sooner than half-way through the braking. (cut,) each [s], [m s⁻¹]
    """
    slowing, speeding = curves.down.select(cut), curves.up.select(cut + 1)
    most_s = np.minimum(0.5 * slowing.duration_s, speeding.duration_s)
    within_s, _ = bisected(
        lambda time: slowing.begun(time)[0] < radius_m, np.zeros_like(most_s), most_s, _BISECTIONS
    )
    return 0.5 * within_s, slowing.begun(0.5 * within_s)[1]


def _parted(stages: StageColumns, stage: IntArray, rows: IntArray) -> tuple[IntArray, IntArray]:
    """Return of legs flown through those that are one leg with the next to the autopilot, and the others."""
    is_under = stages.is_underway[stage[rows]] & (stage[rows + 1] > stage[rows])
    return rows[is_under], rows[~is_under]


def _speed_along(
    stages: StageColumns, stage: IntArray, held_m_s: FloatArray, direction: FloatArray
) -> FloatArray:
    """Return the speed along legs by the speeds commanded for stages and held in wind. (n,) [m s⁻¹]"""
    vertical = np.where(direction[:, 2] > 0.0, stages.climb_m_s[stage], stages.descent_m_s[stage])
    return limits_along(direction, held_m_s, vertical)


def _whole_m(length_m: FloatArray, under: IntArray) -> FloatArray:
    """Return for each leg the length of all that are one leg with it to the autopilot. (n,) [m]

    ``under`` are those that are one with the next.
    """
    begins = np.ones(len(length_m), np.bool_)
    begins[under + 1] = False
    whole = np.cumsum(begins) - 1
    return np.asarray(np.bincount(whole, length_m)[whole])


def _speeds_under_way(
    speed: FloatArray,
    length: FloatArray,
    limits: SpeedLimits,
    under: IntArray,
    *,
    start_m_s: FloatArray,
    end_m_s: FloatArray,
) -> FloatArray:
    """Return the speeds at the ends of legs that are one leg with the next to the autopilot. (under,)

    As fast as the first allows, and as is reached along it, begun with a speed behind a spline, and can be
    braked along the next, which ends with one before a spline.
    """
    some, most, onward_m = limits.select(under), speed[under], length[under + 1]
    reached = peak_speed_from_rest_m_s(2.0 * np.minimum(length[under], onward_m), some)
    moving = np.flatnonzero((start_m_s > 0.0) | (end_m_s > 0.0))
    if len(moving):
        own, most_m_s = some.select(moving), most[moving]
        reached[moving] = np.minimum(
            speed_after_m_s(length[under][moving], start_m_s[moving], most_m_s, own),
            speed_after_m_s(onward_m[moving], end_m_s[moving], most_m_s, own),
        )
    return np.minimum(most, reached)


def _speeds_of_splines(
    stages: StageColumns, splines: Splines | None, key: IntArray, leads: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return the speeds at which legs begin behind splines and end before them; else zero. (n,) each"""
    if splines is None:
        return np.zeros(len(key)), np.zeros(len(key))
    stage, is_spline = key // SLOTS, is_kind(stages.kind, StageKind.SPLINE)
    is_first = (key % SLOTS == 0) & leads
    before, after = np.maximum(stage - 1, 0), np.minimum(stage + 1, len(stages.kind) - 1)
    leaves = is_first & (stage > 0) & is_spline[before] & stages.is_passed[before]
    joins = is_first & (after > stage) & is_spline[after] & stages.is_passed[stage]
    return (
        np.where(leaves, splines.speed_at_end_m_s[before], 0.0),
        np.where(joins, splines.speed_at_start_m_s[after], 0.0),
    )


def is_another_speed(stages: StageColumns, one: IntArray, other: IntArray) -> BoolArray:
    """Return whether another speed is commanded for one stage than for the other. (n,)"""
    speeds = (stages.speed_m_s, stages.climb_m_s, stages.descent_m_s)
    return np.asarray(np.logical_or.reduce([speed[one] != speed[other] for speed in speeds]))


def _flown_peak_m_s(curves: SCurves, parameters: ArduPilotParameters) -> FloatArray:
    """Return the highest speed of the vehicle itself along curves. (n,) [m s⁻¹]

    Where there is no cruise the reference has a peak of V − J t²/2 on either side; a lag τ of first
    order, twice ATC_INPUT_TC as at a start, takes J τ²/2 off it.  Recorded for V = 5.82 m/s and
    J = 1 m/s³: 5.79 m/s.
    """
    lag_s = ATTITUDE_LAG_FACTOR * parameters.attitude_time_constant_s
    pointed = (curves.cruise_s == 0.0) & (curves.down.jerk_s >= lag_s)
    rounded = np.where(pointed, 0.5 * curves.down.jerk_m_s3 * lag_s**2, 0.0)
    return np.asarray(curves.peak_m_s - rounded)


def planned_anew_spread_s(
    legs: ArduPilotLegs, parameters: ArduPilotParameters
) -> FloatArray | None:
    """Return by how much they may all wait longer for their path planner; ``None``: none does. (k,) [s]"""
    if not parameters.plans_legs_anew or not len(legs.key):
        return None
    return np.asarray(_AS_LIKELY * _ANEW_WITHIN_S * math.sqrt(len(legs.key)))


def start_delay_s(direction: FloatArray, parameters: ArduPilotParameters) -> FloatArray:
    r"""Return the time a start from rest loses because the vehicle follows with a lag. (n,) [s]

    ``advance_wp_target_along_track`` lets time pass slower by 0.95 − (v − k e)/v_target, v the vehicle's
    speed and e its position error, filtered; what a filter of gain one takes away in all is the integral
    of its input.  With the controller's default gains

    - a lag τ of the attitude (ATC_INPUT_TC) costs about 2 τ: 0.25 to 0.35 s of the default 0.15 s, at
      any speed, acceleration and jerk, for all errors scale with the jerk;
    - vertically the thrust follows through the integral of PSC_D_ACC alone, with a lag of 0.37 s.

    What the drag costs is :class:`TrackLag`'s.
    """
    level, still = horizontal(direction), ~is_nonzero(direction)
    lag = ATTITUDE_LAG_FACTOR * parameters.attitude_time_constant_s
    return lag * np.where(still, 1.0, level**2) + _VERTICAL_LAG_S * direction[:, 2] ** 2
