"""The profile of a leg as pieces of motion: turn, ramp, cruise, braking, hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.landing import creeping_half_b_m_s, creeps, settlings
from planner.flight.motion.px4.pieces import (
    BRAKE,
    CRUISE,
    HOLD,
    PAUSE,
    RAMP,
    BrakeLaw,
    Curves,
    Lines,
    Places,
)
from planner.flight.motion.px4.speeds import STILL_M, braking_time_s, ramp_time_s, vertical_limits
from planner.values import replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.legs import FlownMoves, Px4Legs
    from planner.flight.motion.px4.pieces import Px4Pieces, TimeScale
    from planner.vehicle.parameters.px4 import Px4Parameters

BRAKING_FRACTION = 0.98
"""A vehicle brakes from where its speed has fallen to this fraction of the cruise. [-]"""
# Places among the pieces of a move; a take-off has some before.
_TURN, _PAUSE, _RAMP, _CRUISE, _ONSET = 3, 4, 5, 8, 9
_FAR, _HELD, _NEAR, _FINAL, _HOLD, _REST = range(12, 18)


def steep_moves(legs: Px4Legs) -> BoolArray:
    """Return which moves climb or descend more than they advance. (n,)"""
    direction = legs.limits.direction
    return np.abs(direction[:, 2]) > np.hypot(direction[:, 0], direction[:, 1])


def add_legs(
    pieces: Px4Pieces, flown: FlownMoves, parameters: Px4Parameters, *, time_scale: TimeScale
) -> None:
    """Add the pieces of all legs; those of steep ones are one segment."""
    move = np.flatnonzero(flown.planned.is_leg)
    if not len(move):
        return
    legs = flown.legs.select(move)
    steep = steep_moves(legs)
    _add_turns(pieces, move, flown, parameters, time_scale=time_scale)
    cruise_from = _add_changes(pieces, move, legs, steep=steep, time_scale=time_scale)
    _add_steady_parts(pieces, move, legs, cruise_from, steep=steep, time_scale=time_scale)
    _add_brakes(pieces, move, legs, steep=steep, time_scale=time_scale)


def _add_turns(
    pieces: Px4Pieces,
    move: IntArray,
    flown: FlownMoves,
    parameters: Px4Parameters,
    *,
    time_scale: TimeScale,
) -> None:
    """Add turns, and the braking and waiting for a heading."""
    turning = (flown.legs.turn_s[move] > 0.0) & ~flown.planned.is_takeoff[move]
    move = move[turning]
    if not len(move):
        return
    planned, legs = flown.planned.select(move), flown.legs.select(move)
    pausing = planned.pause_s > 0.0
    speed = np.hypot(legs.velocity_m_s[:, 0], legs.velocity_m_s[:, 1])
    braking_s = ramp_time_s(speed, parameters.acceleration_m_s2, parameters.jerk_m_s3)
    turn_s = np.where(pausing, np.minimum(braking_s, legs.turn_s), legs.turn_s)
    straights = legs.straights
    leaving = straights.ramp_from_m_s + 0.5 * legs.limits.ramp_m_s3 * straights.ramp_begun_s**2
    after = legs.limits.direction * leaving[:, None]
    # A turn that fills its leg hands on the velocity it is begun with (``ends_of_moves``).
    after = np.where((legs.limits.length_m > STILL_M)[:, None], after, legs.velocity_m_s)
    after = np.where(pausing[:, None], 0.0, after)
    rises = legs.straight_m[:, 2] > legs.place_m[:, 2]
    curves = Curves.between(
        legs.place_m,
        legs.velocity_m_s,
        legs.straight_m,
        after,
        duration_s=turn_s,
        level_m_s=planned.speed_m_s,
        upright_m_s=vertical_limits(rises, parameters)[0],
    )
    turning_scale = time_scale.lagging(turn_s, speed, np.hypot(after[:, 0], after[:, 1]))
    for duration, coefficients in curves.parts(turn_s):
        slot = np.where(pausing, PAUSE, RAMP)
        pieces.add_cubics(Places.of(move, _TURN, slot, duration, turning_scale), coefficients)
    pieces.add_lines(
        Places.of(move, _PAUSE, PAUSE, legs.turn_s - turn_s), Lines.at_rest(legs.straight_m)
    )


def _add_changes(
    pieces: Px4Pieces, move: IntArray, legs: Px4Legs, *, steep: BoolArray, time_scale: TimeScale
) -> FloatArray:
    """Add ramps and the onsets of braking; return how far along their legs cruises begin. (n,) [m]

    What of an onset keeps 98 % of the speed is still cruise.
    """
    limits, straights = legs.limits, legs.straights
    zero, peak = np.zeros(len(move)), straights.peak_m_s
    ramps = straights.ramps(limits)
    begun, jerk = straights.ramp_begun_s, limits.ramp_m_s3
    sign = np.where(peak < straights.ramp_from_m_s, -1.0, 1.0)
    ramp_jerk = sign * ramps.jerk_m_s3
    first = np.maximum(ramps.jerk_s - begun, 0.0)
    accelerated = ramp_jerk * np.maximum(ramps.jerk_s, begun)
    kept = np.sqrt(2.0 * (1.0 - BRAKING_FRACTION) * peak / jerk)
    kept = np.minimum(kept, straights.onset_s)
    onset = straights.onset_s
    duration = np.stack(
        (first, ramps.steady_s, ramps.back_s, kept, onset - kept, straights.steady_s)
    )
    acceleration = np.stack(
        (ramp_jerk * begun, accelerated, accelerated, zero, -jerk * kept, -jerk * onset)
    )
    jerks = np.stack((ramp_jerk, zero, -ramp_jerk, -jerk, -jerk, zero))
    speed = np.empty_like(duration)
    speed[0] = straights.ramp_from_m_s + 0.5 * ramp_jerk * begun**2
    speed[1] = speed[0] + first * (ramp_jerk * begun + 0.5 * ramp_jerk * first)
    speed[2] = speed[1] + ramps.steady_s * accelerated
    speed[3] = peak
    speed[4] = peak - 0.5 * jerk * kept**2
    speed[5] = peak - 0.5 * jerk * onset**2
    moved = duration * (speed + duration * (0.5 * acceleration + jerks * duration / 6.0))
    moved[3] += straights.cruise_m
    way = np.cumsum(moved, axis=0) - moved
    way[3] += straights.cruise_m
    before = np.where(straights.cruise_m > 0.0, CRUISE, BRAKE)
    slot = np.empty(duration.shape, dtype=np.intp)
    slot[:3], slot[3], slot[4:] = RAMP, before, BRAKE
    level = np.hypot(limits.direction[:, 0], limits.direction[:, 1])
    after = speed + duration * (acceleration + 0.5 * jerks * duration)
    time_scales = time_scale.between(level * speed, level * after)
    lagging = time_scale.lagging(duration[:3], level * speed[:3], level * after[:3])
    # Braking, the vehicle is ahead of its trajectory; what it lags by from standing, it nearly is ahead
    # by at the next stop.
    time_scales[:3] = np.where(steep | (legs.turn_s == 0.0), time_scales[:3], lagging)
    time_scales[:3] = np.where((sign < 0.0) & ~steep, 1.0, time_scales[:3])
    time_scales[4:] = np.where(steep, time_scales[4:], 1.0)
    order = np.array([_RAMP, _RAMP + 1, _RAMP + 2, _ONSET, _ONSET + 1, _ONSET + 2])
    part, row = np.nonzero(duration > 0.0)
    direction = limits.direction[row]
    pieces.add_lines(
        Places.of(
            move[row],
            order[part],
            np.where(steep, RAMP, slot)[part, row],
            duration[part, row],
            time_scales[part, row],
        ),
        Lines(
            place_m=legs.straight_m[row] + direction * way[part, row, None],
            direction=direction,
            speed_m_s=speed[part, row],
            acceleration_m_s2=acceleration[part, row],
            jerk_m_s3=jerks[part, row],
        ),
    )
    cruise_from: FloatArray = moved[:3].sum(axis=0)
    return cruise_from


def _add_steady_parts(
    pieces: Px4Pieces,
    move: IntArray,
    legs: Px4Legs,
    cruise_from_m: FloatArray,
    *,
    steep: BoolArray,
    time_scale: TimeScale,
) -> None:
    """Add what is flown at constant speed: cruises, and between and behind braking."""
    limits, straights = legs.limits, legs.straights
    near_m = straights.near_way_m(limits, straights.crossing_m_s)
    level = np.hypot(limits.direction[:, 0], limits.direction[:, 1])
    held_from_m = limits.length_m + limits.tail_m - near_m - straights.held_m
    final_from_m = limits.length_m - straights.final_m
    for order, slot, speed, way, begins in (
        (_CRUISE, CRUISE, straights.peak_m_s, straights.cruise_m, cruise_from_m),
        (_HELD, BRAKE, straights.crossing_m_s, straights.held_m, held_from_m),
        (_FINAL, BRAKE, straights.end_m_s, straights.final_m, final_from_m),
    ):
        row = np.flatnonzero((way > 0.0) & (speed > 0.0))
        if not len(row):
            continue
        zero, direction = np.zeros(len(row)), limits.direction[row]
        time_scales = time_scale.between(level * speed, level * speed)
        pieces.add_lines(
            Places.of(
                move[row],
                order,
                np.where(steep[row], RAMP, slot),
                way[row] / speed[row],
                np.where(steep[row] | (slot == CRUISE), time_scales[row], 1.0),
            ),
            Lines(
                place_m=legs.straight_m[row] + direction * begins[row, None],
                direction=direction,
                speed_m_s=speed[row],
                acceleration_m_s2=zero,
                jerk_m_s3=zero,
            ),
        )


def _brake_law(
    legs: Px4Legs, law: IntArray, half_b_m_s: FloatArray, beyond_m: FloatArray
) -> BrakeLaw:
    """Return the braking of legs by one of their laws, from their end speeds on."""
    limits = legs.limits
    rows = np.arange(len(law))
    way = limits.length_m + limits.tail_m + beyond_m
    return BrakeLaw(
        aim_m=legs.straight_m + limits.direction * way[:, None],
        direction=limits.direction,
        start_m_s=legs.straights.end_m_s,
        final_m_s=limits.final_m_s[rows, law],
        acceleration_m_s2=limits.brake_m_s2[rows, law],
        half_b_m_s=half_b_m_s,
        rate=np.ones(len(law)),
    )


def _add_brakes(
    pieces: Px4Pieces, move: IntArray, legs: Px4Legs, *, steep: BoolArray, time_scale: TimeScale
) -> None:
    """Add the braking of legs by their laws."""
    straights = legs.straights
    far_half_b, near_half_b = straights.half_b_m_s.T
    crossing = straights.crossing_m_s
    for order, law, half_b, start, end in (
        (_FAR, straights.far, far_half_b, straights.joined_m_s, crossing),
        (_NEAR, straights.near, near_half_b, crossing, straights.end_m_s),
    ):
        rows = np.flatnonzero((start > end) & (end > 0.0))
        if not len(rows):
            continue
        brake = replace(
            _brake_law(legs.select(rows), law[rows], half_b[rows], straights.beyond_m[rows]),
            start_m_s=start[rows],
        )
        a, first, last = brake.acceleration_m_s2, start[rows], end[rows]
        level = np.hypot(brake.direction[:, 0], brake.direction[:, 1])
        time = braking_time_s(first, last, a, brake.half_b_m_s)
        pieces.add_brakes(
            Places.of(
                move[rows],
                order,
                np.where(steep[rows], RAMP, BRAKE),
                time,
                np.where(steep[rows], time_scale.between(level * first, level * last), 1.0),
            ),
            brake,
            (first - last) * (first + last + 2.0 * brake.half_b_m_s) / (2.0 * a),
        )


def add_holds(pieces: Px4Pieces, flown: FlownMoves, parameters: Px4Parameters) -> None:
    """Add holds: going on to brake to the target, or settling on it."""
    planned = flown.planned
    holding = (planned.hold_s > 0.0) & (planned.is_leg | planned.stands)
    creeping = creeps(planned, flown.legs.limits, flown.legs.straights)
    move = np.flatnonzero(creeping)
    if len(move):
        legs = flown.legs.select(move)
        begin = legs.straight_m + legs.limits.direction * legs.limits.length_m[:, None]
        pieces.add_brakes(
            Places.of(move, _HOLD, HOLD, planned.hold_s[move]),
            _brake_law(
                legs,
                legs.straights.near,
                creeping_half_b_m_s(legs.limits, legs.straights),
                np.zeros(len(move)),
            ),
            ((legs.end_m - begin) * legs.limits.direction).sum(axis=1),
        )
    move = np.flatnonzero(holding & ~creeping)
    if not len(move):
        return
    legs, hold_s, target = flown.legs.select(move), planned.hold_s[move], planned.target_m[move]
    length = legs.limits.length_m[:, None]
    leaving = legs.limits.direction * legs.straights.end_m_s[:, None]
    curves = settlings(
        legs.straight_m + legs.limits.direction * length,
        np.where(length > 0.0, leaving, legs.velocity_m_s),
        target,
        parameters,
    )
    for duration, coefficients in curves.parts(hold_s):
        pieces.add_cubics(Places.of(move, _HOLD, HOLD, duration), coefficients)
    pieces.add_lines(
        Places.of(move, _REST, HOLD, hold_s - curves.duration_s.sum(axis=1)), Lines.at_rest(target)
    )
