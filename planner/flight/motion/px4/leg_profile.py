"""The profile of a leg as pieces of motion: turn, ramp, cruise, braking, hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import dot, horizontal
from planner.flight.motion.px4.braking import STILL_M, braking_time_s, ramp_time_s, vertical_limits
from planner.flight.motion.px4.landing import creeps, settlings
from planner.flight.motion.px4.laws import BrakeLaw
from planner.flight.motion.px4.pieces import BRAKE, CRUISE, HOLD, PAUSE, RAMP, Curves, Places
from planner.values import replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.legs import Px4Legs
    from planner.flight.motion.px4.pieces import Px4Pieces
    from planner.flight.motion.px4.straights import BrakingLaw

BRAKING_FRACTION = 0.98
"""A vehicle brakes from where its speed has fallen to this fraction of the cruise. [-]"""
# Places among the pieces of a move; a take-off has some before.
_TURN, _PAUSE, _RAMP, _CRUISE, _ONSET = 3, 4, 5, 8, 9
_FAR, _HELD, _NEAR, _FINAL, _HOLD, _REST = range(12, 18)


def steep_moves(legs: Px4Legs) -> BoolArray:
    """Return which moves climb or descend more than they advance. (n,)"""
    direction = legs.limits.direction
    return np.abs(direction[:, 2]) > horizontal(direction)


def add_legs(pieces: Px4Pieces, flown: Px4Legs) -> None:
    """Add the pieces of all legs; those of steep ones are one segment."""
    move = np.flatnonzero(flown.planned.is_leg)
    if not len(move):
        return
    legs = flown.select(move)
    steep = steep_moves(legs)
    _add_turns(pieces, move, legs)
    cruise_from = _add_changes(pieces, move, legs, steep=steep)
    _add_steady_parts(pieces, move, legs, cruise_from, steep=steep)
    _add_brakes(pieces, move, legs, steep=steep)


def _add_turns(pieces: Px4Pieces, move: IntArray, legs: Px4Legs) -> None:
    """Add turns, and the braking and waiting for a heading."""
    parameters = legs.parameters
    turning = (legs.turn_s > 0.0) & ~legs.planned.is_takeoff
    if not turning.any():
        return
    move, legs = move[turning], legs.select(turning)
    planned, straights = legs.planned, legs.straights
    pausing = planned.pause_s > 0.0
    speed = horizontal(legs.velocity_m_s)
    braking_s = ramp_time_s(speed, parameters.acceleration_m_s2, parameters.jerk_m_s3)
    turn_s = np.where(pausing, np.minimum(braking_s, legs.turn_s), legs.turn_s)
    rise = straights.rise
    leaving = rise.from_m_s + 0.5 * legs.limits.ramp_m_s3 * rise.begun_s**2
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
    turning_scale = pieces.time_scale.lagging(turn_s, speed, horizontal(after))
    slot = np.where(pausing, PAUSE, RAMP)
    for duration, coefficients in curves.parts(turn_s):
        pieces.add_cubics(Places(move, _TURN, slot, duration, turning_scale), coefficients)
    pieces.add_lines(Places(move, _PAUSE, PAUSE, legs.turn_s - turn_s), legs.straight_m)


def _add_changes(
    pieces: Px4Pieces, move: IntArray, legs: Px4Legs, *, steep: BoolArray
) -> FloatArray:
    """Add ramps and the onsets of braking; return how far along their legs cruises begin. (n,) [m]

    What of an onset keeps 98 % of the speed is still cruise.
    """
    limits, straights = legs.limits, legs.straights
    rise = straights.rise
    zero, peak = np.zeros(len(move)), rise.peak_m_s
    ramps = rise.ramps(limits)
    begun, jerk = rise.begun_s, limits.ramp_m_s3
    sign = np.where(peak < rise.from_m_s, -1.0, 1.0)
    ramp_jerk = sign * ramps.jerk_m_s3
    first = np.maximum(ramps.jerk_s - begun, 0.0)
    accelerated = ramp_jerk * np.maximum(ramps.jerk_s, begun)
    kept = np.sqrt(2.0 * (1.0 - BRAKING_FRACTION) * peak / jerk)
    kept = np.minimum(kept, straights.braking.onset_s)
    onset = straights.braking.onset_s
    duration = np.stack(
        (first, ramps.steady_s, ramps.back_s, kept, onset - kept, straights.braking.steady_s)
    )
    acceleration = np.stack(
        (ramp_jerk * begun, accelerated, accelerated, zero, -jerk * kept, -jerk * onset)
    )
    jerks = np.stack((ramp_jerk, zero, -ramp_jerk, -jerk, -jerk, zero))
    speed = np.empty_like(duration)
    speed[0] = rise.from_m_s + 0.5 * ramp_jerk * begun**2
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
    level = horizontal(limits.direction)
    after = speed + duration * (acceleration + 0.5 * jerks * duration)
    time_scale = pieces.time_scale
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
        Places(
            move[row],
            order[part],
            np.where(steep, RAMP, slot)[part, row],
            duration[part, row],
            time_scales[part, row],
        ),
        legs.straight_m[row] + direction * way[part, row, None],
        direction,
        speed[part, row],
        acceleration[part, row],
        jerks[part, row],
    )
    return np.asarray(moved[:3].sum(axis=0))


def _add_steady_parts(
    pieces: Px4Pieces, move: IntArray, legs: Px4Legs, cruise_from_m: FloatArray, *, steep: BoolArray
) -> None:
    """Add what is flown at constant speed: cruises, and between and after braking."""
    limits, straights = legs.limits, legs.straights
    level = horizontal(limits.direction)
    held_from_m = (
        limits.length_m
        + limits.tail_m
        - straights.braking.near.way_m(straights.braking.crossing_m_s)
    )
    held_from_m -= straights.braking.held_m
    final_from_m = limits.length_m - straights.braking.final_m
    for order, slot, speed, way, begins in (
        (_CRUISE, CRUISE, straights.rise.peak_m_s, straights.cruise_m, cruise_from_m),
        (_HELD, BRAKE, straights.braking.crossing_m_s, straights.braking.held_m, held_from_m),
        (_FINAL, BRAKE, straights.braking.end_m_s, straights.braking.final_m, final_from_m),
    ):
        row = np.flatnonzero((way > 0.0) & (speed > 0.0))
        v, direction = speed[row], limits.direction[row]
        time_scales = pieces.time_scale.between(level[row] * v, level[row] * v)
        pieces.add_lines(
            Places(
                move[row],
                order,
                np.where(steep[row], RAMP, slot),
                way[row] / v,
                np.where(steep[row] | (slot == CRUISE), time_scales, 1.0),
            ),
            legs.straight_m[row] + direction * begins[row, None],
            direction,
            v,
        )


def _brake_law(legs: Px4Legs, rows: IntArray, law: BrakingLaw, start_m_s: FloatArray) -> BrakeLaw:
    """Return the braking of some legs by a law of each of them, from speeds on."""
    limits = legs.limits
    direction = limits.direction[rows]
    way = limits.length_m[rows] + limits.tail_m[rows] + law.beyond_m
    return BrakeLaw.to(
        legs.straight_m[rows] + direction * way[:, None],
        direction=direction,
        start_m_s=start_m_s,
        final_m_s=law.final_m_s,
        acceleration_m_s2=law.acceleration_m_s2,
        half_b_m_s=law.half_b_m_s,
    )


def _add_brakes(pieces: Px4Pieces, move: IntArray, legs: Px4Legs, *, steep: BoolArray) -> None:
    """Add the braking of legs by their laws."""
    straights = legs.straights
    crossing = straights.braking.crossing_m_s
    for order, law, start, end in (
        (_FAR, straights.braking.far, straights.braking.joined_m_s, crossing),
        (_NEAR, straights.braking.near, crossing, straights.braking.end_m_s),
    ):
        rows = np.flatnonzero((start > end) & (end > 0.0))
        first, last = start[rows], end[rows]
        brake = _brake_law(legs, rows, law.select(rows), first)
        a, b, level = brake.acceleration_m_s2, brake.half_b_m_s, horizontal(brake.direction)
        between = pieces.time_scale.between(level * first, level * last)
        pieces.add_brakes(
            Places(
                move[rows],
                order,
                np.where(steep[rows], RAMP, BRAKE),
                braking_time_s(first, last, a, b),
                np.where(steep[rows], between, 1.0),
            ),
            brake,
            (first - last) * (first + last + 2.0 * b) / (2.0 * a),
        )


def add_holds(pieces: Px4Pieces, flown: Px4Legs) -> None:
    """Add holds: going on to brake to the target, or settling on it."""
    planned = flown.planned
    holding = (planned.hold_s > 0.0) & (planned.is_leg | planned.is_wait)
    creeping, half_b = creeps(flown)
    move = np.flatnonzero(creeping)
    if len(move):
        direction, straights = flown.limits.direction[move], flown.straights
        law = replace(straights.braking.near.select(move), half_b_m_s=half_b[move])
        law = replace(law, beyond_m=np.zeros(len(move)))
        begin = flown.straight_m[move] + direction * flown.limits.length_m[move, None]
        pieces.add_brakes(
            Places(move, _HOLD, HOLD, planned.hold_s[move]),
            _brake_law(flown, move, law, straights.braking.end_m_s[move]),
            dot(flown.end.place_m[move] - begin, direction),
        )
    move = np.flatnonzero(holding & ~creeping)
    if not len(move):
        return
    hold_s, target = planned.hold_s[move], planned.target_m[move]
    curves = settlings(flown.select(move))
    for duration, coefficients in curves.parts(hold_s):
        pieces.add_cubics(Places(move, _HOLD, HOLD, duration), coefficients)
    rest_s = hold_s - curves.duration_s.sum(axis=1)
    pieces.add_lines(Places(move, _REST, HOLD, rest_s), target)
