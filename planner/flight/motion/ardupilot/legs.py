"""The straight legs ArduPilot flies between stages: S-curves that overlap where corners are passed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.ardupilot.corners import Corners, half_overlap_s
from planner.flight.motion.ardupilot.limits import drag_per_s, limits_along
from planner.flight.motion.ardupilot.returns import return_height_m
from planner.flight.motion.ardupilot.stages import is_kind
from planner.flight.motion.ardupilot.stops import jerk_rise_s
from planner.flight.motion.headway import held_speeds_m_s
from planner.flight.motion.s_curve import s_curves
from planner.frozen import frozen
from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.flight.motion.ardupilot.splines import Splines
    from planner.flight.motion.ardupilot.stages import StageColumns
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.flight.motion.s_curve import SCurves
    from planner.physics.wind import Wind
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

SLOTS = 8
"""A stage's manoeuvres are numbered from SLOTS times its position."""

_ATTITUDE_LAG_FACTOR = 2.0
"""Time lost at a start from rest in time constants of the attitude, see :func:`_start_delay_s`. [-]"""
_VERTICAL_LAG_S = 0.37
"""Hover throttle over gravity and PSC_D_ACC_I, both at their defaults: 0.36 / (9.81 · 0.1). [s]"""
_VELOCITY_GAIN_PER_S = 2.0
"""PSC_NE_VEL_P, its default. [s⁻¹]"""
_VELOCITY_INTEGRAL_PER_S2 = 1.0
"""PSC_NE_VEL_I, its default. [s⁻²]"""
_TIME_BUFFER = 0.05
"""``advance_wp_target_along_track`` forgives so much of the speed. [-]"""
_COORDINATE_M = 1e-7 * math.radians(6_378_100.0)
"""Coordinates are whole 1e-7 degrees: 1.1 cm. [m]"""
_HEIGHT_STEP_M = 0.01
"""Altitudes of locations are whole centimetres. [m]"""


@frozen(eq=False)
class Legs:
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
    flown_peak_m_s: FloatArray
    """Highest speed of the vehicle itself: a pointed peak is rounded by its lag. (n,) [m s⁻¹]"""
    findings: tuple[Finding, ...]


def plan_legs(
    stages: StageColumns,
    splines: Splines,
    parameters: ArduPilotParameters,
    *,
    wind: Wind | None,
    airspeed_limit_m_s: float | None,
) -> Legs:
    """Return the legs of stages, with their corners.

    Parameters
    ----------
    stages : StageColumns
        At least one.
    splines : Splines
        The splines among them; legs join them at speed.
    parameters : ArduPilotParameters
        The vehicle's parameters.
    wind : Wind, optional
        Default none.
    airspeed_limit_m_s : float, optional
        Airspeed at the greatest lean angle; default none. [m s⁻¹]
    """
    key, start, way = _ways(stages, parameters)
    length = np.sqrt((way**2).sum(axis=1))
    shortest = _shortest_m(stages, key)
    flown = (length > 0.0) | (shortest > 0.0)
    key, start, way, length, shortest = (
        column[flown] for column in (key, start, way, length, shortest)
    )
    leads = length > shortest
    direction = np.divide(way, length[:, None], out=np.zeros_like(way), where=leads[:, None])
    stage = key // SLOTS
    level, upward = np.hypot(direction[:, 0], direction[:, 1]), np.abs(direction[:, 2])
    held, findings = held_speeds_m_s(
        stages.speed_m_s[stage],
        direction[:, :2],
        stages.item[stage],
        height_m=np.stack((start[:, 2], start[:, 2] + way[:, 2]), axis=1),
        wind=wind,
        airspeed_limit_m_s=airspeed_limit_m_s,
    )
    speed = _speed_along(stages, stage, held, direction)
    acceleration = limits_along(
        direction, parameters.acceleration_m_s2, parameters.vertical_acceleration_m_s2
    )
    rows = _corner_rows(stages, key, leads)
    # A spline ends where a leg begins, and the other way round; both at speed.
    is_spline = is_kind(stages.kind, StageKind.SPLINE)
    is_first = (key % SLOTS == 0) & leads
    before, after = np.maximum(stage - 1, 0), np.minimum(stage + 1, len(stages.kind) - 1)
    leaves = is_first & (stage > 0) & is_spline[before] & stages.is_passed[before]
    joins = is_first & (after > stage) & is_spline[after] & stages.is_passed[stage]
    entered = rows + 1
    from_rest = ~leaves
    from_rest[entered] = ~leads[rows]
    # A corner is entered before DO_CHANGE_SPEED is carried out at its middle.
    first = np.full(len(key), np.inf)
    first[entered] = _speed_along(stages, stage[rows], held[entered], direction[entered])
    delay = _start_delay_s(
        speed,
        acceleration,
        level=level,
        upward=upward,
        parameters=parameters,
        airspeed_limit_m_s=airspeed_limit_m_s,
    )
    curves = s_curves(
        np.maximum(length, shortest),
        speed_m_s=speed,
        acceleration_m_s2=acceleration,
        jerk_m_s3=np.full(len(key), parameters.jerk_m_s3),
        jerk_rise_s=np.full(len(key), jerk_rise_s(parameters)),
        start_m_s=np.where(leaves, splines.speed_at_end_m_s[before], 0.0),
        end_m_s=np.where(joins, splines.speed_at_start_m_s[after], 0.0),
        first_m_s=first,
        wait_s=np.where(from_rest & (leads | (shortest != _HEIGHT_STEP_M)), delay, 0.0),
    )
    half, corner_speed = np.zeros(len(key)), np.where(joins, curves.end_m_s, 0.0)
    if len(rows):
        corners = Corners(
            before=direction[rows],
            after=direction[entered],
            slowing=curves.down.select(rows),
            speeding=curves.up.select(entered),
            speed_limit_m_s=np.minimum(speed[rows], np.minimum(speed, first)[entered]),
        )
        half[rows] = half_overlap_s(
            corners,
            radius_m=parameters.waypoint_radius_m,
            corner_acceleration_m_s2=parameters.corner_acceleration_m_s2,
            vertical_acceleration_m_s2=parameters.vertical_acceleration_m_s2,
        )
        corner_speed[rows] = corners.speed_m_s(half[rows])
    return Legs(
        key=key,
        start_m=start,
        direction=direction,
        curves=curves,
        half_overlap_s=half,
        corner_speed_m_s=corner_speed,
        flown_peak_m_s=_flown_peak_m_s(curves, parameters),
        findings=findings,
    )


def _ways(
    stages: StageColumns, parameters: ArduPilotParameters
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return key, start and way of every leg in flown order, those of no length too."""
    straight = stages.where(StageKind.GO, StageKind.LOITER)
    height = stages.where(StageKind.CHANGE_HEIGHT)
    moved = (stages.place_m[height, :2] != stages.start_m[height, :2]).any(axis=1)
    level = stages.where(StageKind.LAND, StageKind.SET_DOWN)
    circle = stages.where(StageKind.CIRCLE)
    home = stages.where(StageKind.RETURN)
    end = stages.place_m.copy()
    end[level, 2] = stages.start_m[level, 2]
    end[circle] = stages.edge_m[circle]
    single = np.sort(np.concatenate((straight, height[moved], level, circle)))
    top, over = stages.start_m[home].copy(), stages.place_m[home].copy()
    if len(home):
        top[:, 2] = over[:, 2] = return_height_m(
            stages.start_m[home], stages.place_m[home], parameters, stages.return_floor_m[home]
        )
    key = np.concatenate((single * SLOTS, home * SLOTS, home * SLOTS + 1))
    start = np.concatenate((stages.start_m[single], stages.start_m[home], top))
    way = np.concatenate((end[single], top, over)) - start
    order = np.argsort(key, kind="stable")
    return key[order], start[order], way[order]


def _shortest_m(stages: StageColumns, key: IntArray) -> FloatArray:
    """Return the length that even legs to where the vehicle stands have. (n,) [m]

    After a take-off the vehicle stands up to a step of the coordinates beside what a file can name; the
    altitude that a landing or a return begins with is rounded to the centimetre.  Both cost the S-curve
    of that step, a good second.
    """
    stage = key // SLOTS
    rounded = is_kind(stages.kind[stage], StageKind.LAND, StageKind.RETURN)
    step = np.where(stages.is_first_leg[stage], _COORDINATE_M, 0.0)
    return np.where(key % SLOTS == 0, np.where(rounded, _HEIGHT_STEP_M, step), 0.0)


def _corner_rows(stages: StageColumns, key: IntArray, leads: BoolArray) -> IntArray:
    """Return the legs whose end is flown through towards the next."""
    stage, slot = key // SLOTS, key % SLOTS
    onward = (stage[1:] == stage[:-1] + 1) & (slot[1:] == 0) & stages.is_passed[stage[:-1]]
    returning = (stage[1:] == stage[:-1]) & (slot[1:] == 1)
    return np.flatnonzero(((onward & leads[:-1]) | returning) & leads[1:])


def _speed_along(
    stages: StageColumns,
    stage: IntArray,
    held_m_s: FloatArray,
    direction: FloatArray,
) -> FloatArray:
    """Return the speed along legs by the speeds commanded for stages and held in wind. (n,) [m s⁻¹]"""
    vertical = np.where(direction[:, 2] > 0.0, stages.climb_m_s[stage], stages.descent_m_s[stage])
    horizontal = np.minimum(stages.speed_m_s[stage], held_m_s)
    return limits_along(direction, horizontal, vertical)


def _flown_peak_m_s(curves: SCurves, parameters: ArduPilotParameters) -> FloatArray:
    """Return the highest speed of the vehicle itself along curves. (n,) [m s⁻¹]

    Where there is no cruise the reference has a peak of V − J t²/2 on either side; a lag τ of first
    order, twice ATC_INPUT_TC as at a start, takes J τ²/2 off it.  Recorded for V = 5.82 m/s and
    J = 1 m/s³: 5.79 m/s.
    """
    lag_s = _ATTITUDE_LAG_FACTOR * parameters.attitude_time_constant_s
    pointed = (curves.cruise_s == 0.0) & (curves.down.jerk_s >= lag_s)
    peak: FloatArray = curves.peak_m_s - np.where(
        pointed, 0.5 * curves.down.jerk_m_s3 * lag_s**2, 0.0
    )
    return peak


def _start_delay_s(
    speed_m_s: FloatArray,
    acceleration_m_s2: FloatArray,
    *,
    level: FloatArray,
    upward: FloatArray,
    parameters: ArduPilotParameters,
    airspeed_limit_m_s: float | None,
) -> FloatArray:
    r"""Return the time a start from rest loses because the vehicle follows with a lag. (n,) [s]

    ``advance_wp_target_along_track`` lets time pass slower by 0.95 − (v − k e)/v_target, v the vehicle's
    speed and e its position error, filtered; what a filter of gain one takes away in all is the integral
    of its input.  With the controller's default gains

    - a lag τ of the attitude (ATC_INPUT_TC) costs about 2 τ: 0.25 to 0.35 s of the default 0.15 s, at
      any speed, acceleration and jerk, for all errors scale with the jerk;
    - vertically the thrust follows through the integral of PSC_D_ACC alone, with a lag of 0.37 s;
    - drag c v is made up for by the integral of PSC_NE_VEL: v_target − v = c a / k_I, two seconds
      (k_P/k_I) late.  Over v = a t this is (c/k_I) ln(T/2 s), less the 5 % forgiven: nothing below
      c = 0.2 s⁻¹, 0.4 s at 10 m/s for a vehicle at its lean limit there.
    """
    still = (level == 0.0) & (upward == 0.0)
    lag = _ATTITUDE_LAG_FACTOR * parameters.attitude_time_constant_s
    delay = lag * np.where(still, 1.0, level**2) + _VERTICAL_LAG_S * upward**2
    if airspeed_limit_m_s is None:
        return delay
    drag = drag_per_s(parameters, airspeed_limit_m_s)
    late_s = _VELOCITY_GAIN_PER_S / _VELOCITY_INTEGRAL_PER_S2
    speeding_s = np.maximum(
        speed_m_s / acceleration_m_s2 + acceleration_m_s2 / parameters.jerk_m_s3, late_s
    )
    lost = drag / _VELOCITY_INTEGRAL_PER_S2 * np.log(speeding_s / late_s)
    forgiven = _TIME_BUFFER * (speeding_s - late_s)
    return delay + level**2 * np.maximum(lost - forgiven, 0.0)
