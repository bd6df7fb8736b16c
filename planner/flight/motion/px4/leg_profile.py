"""The profile of a leg as pieces of motion: turn, ramp, cruise, braking, hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import horizontal, quotient, rows_of
from planner.flight.motion.px4.braking import STILL_M, braking_time_s, ramp_time_s, vertical_limits
from planner.flight.motion.px4.landing import creeps, settlings
from planner.flight.motion.px4.laws import Brakes
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
_TURN, _PAUSE, _FIRST = 3, 4, 5
_FAR, _HELD, _NEAR, _FINAL, _HOLD, _REST = range(12, 18)
_PHASES = np.array([*range(_FIRST, _FAR), _HELD, _FINAL])
"""Three of the ramp, the cruise, three of the onset of braking, and what is held between and after laws."""
_RISEN, _CRUISED, _KEPT, _AT_CROSSING, _AT_END = 3, 3, 4, 7, 8


def steep_moves(legs: Px4Legs) -> BoolArray:
    """Return which moves climb or descend more than they advance. (n,)"""
    direction = legs.limits.direction
    return np.abs(direction[:, 2]) > horizontal(direction)


def add_legs(pieces: Px4Pieces, flown: Px4Legs) -> None:
    """Add the pieces of all legs; those of steep ones are one segment."""
    if not flown.planned.is_leg.any():
        return
    steep = steep_moves(flown)
    _add_turns(pieces, flown)
    _add_phases(pieces, flown, steep=steep)
    _add_brakes(pieces, flown, steep=steep)


def _add_turns(pieces: Px4Pieces, legs: Px4Legs) -> None:
    """Add turns, and the braking and waiting for a heading."""
    parameters, planned, limits = legs.parameters, legs.planned, legs.limits
    turning = planned.is_leg & (legs.turn_s > 0.0) & ~planned.is_takeoff & ~legs.weaves.is_stepped
    move = rows_of(turning)
    if not len(move):
        return
    pausing, whole_s = planned.pause_s[move] > 0.0, legs.turn_s[move]
    begins, velocity, end = legs.place_m[move], legs.velocity_m_s[move], legs.straight_m[move]
    speed = horizontal(velocity)
    braking_s = ramp_time_s(speed, parameters.acceleration_m_s2, parameters.jerk_m_s3)
    turn_s = np.where(pausing, np.minimum(braking_s, whole_s), whole_s)
    rise = legs.straights.rise
    leaving = rise.from_m_s[move] + 0.5 * limits.ramp_m_s3[move] * rise.begun_s[move] ** 2
    after = limits.direction[move] * leaving[:, None]
    # A turn that fills its leg hands on the velocity it is begun with (``ends_of_moves``).
    after = np.where((limits.length_m[move] > STILL_M)[:, None], after, velocity)
    after = np.where(pausing[:, None], 0.0, after)
    curves = Curves.between(
        begins,
        velocity,
        end,
        after,
        duration_s=turn_s,
        level_m_s=planned.speed_m_s[move],
        upright_m_s=vertical_limits(end[:, 2] > begins[:, 2], parameters)[0],
    )
    turning_scale = pieces.time_scale.lagging(turn_s, speed, horizontal(after))
    slot = np.where(pausing, PAUSE, RAMP)
    pieces.add_curves(Places(move, _TURN, slot, turn_s, turning_scale), curves)
    pieces.add_lines(Places(move, _PAUSE, PAUSE, whole_s - turn_s), end)


def _add_phases(pieces: Px4Pieces, legs: Px4Legs, *, steep: BoolArray) -> None:
    """Add the phases of constant jerk along legs: ramps, cruises, onsets of braking, what is held.

    What of an onset keeps 98 % of the speed is still cruise.
    """
    limits, straights = legs.limits, legs.straights
    rise, braking = straights.rise, straights.braking
    ramps, begun, jerk = rise.ramps(limits), rise.begun_s, limits.ramp_m_s3
    slows = rise.peak_m_s < rise.from_m_s
    ramp_jerk = np.where(slows, -1.0, 1.0) * ramps.jerk_m_s3
    kept = np.sqrt(2.0 * (1.0 - BRAKING_FRACTION) * rise.peak_m_s / jerk)
    kept = np.minimum(kept, braking.onset_s)
    duration, speed, acceleration, jerks, way = np.zeros((5, len(_PHASES), len(steep)))
    duration[:_RISEN] = np.maximum(ramps.jerk_s - begun, 0.0), ramps.steady_s, ramps.back_s
    duration[_CRUISED] = quotient(straights.cruise_m, rise.peak_m_s)
    duration[_KEPT:_AT_CROSSING] = kept, braking.onset_s - kept, braking.steady_s
    duration[_AT_CROSSING] = quotient(braking.held_m, braking.crossing_m_s)
    duration[_AT_END] = quotient(braking.final_m, braking.end_m_s)
    jerks[0], jerks[2], jerks[4:6] = ramp_jerk, -ramp_jerk, -jerk
    acceleration[0] = ramp_jerk * begun
    acceleration[1:_RISEN] = ramp_jerk * np.maximum(ramps.jerk_s, begun)
    acceleration[5:_AT_CROSSING] = -jerk * kept, -jerk * braking.onset_s
    speed[0] = rise.from_m_s + 0.5 * ramp_jerk * begun**2
    speed[1] = speed[0] + duration[0] * (acceleration[0] + 0.5 * ramp_jerk * duration[0])
    speed[2] = speed[1] + ramps.steady_s * acceleration[1]
    speed[_CRUISED : _KEPT + 1] = rise.peak_m_s
    speed[5] = rise.peak_m_s - 0.5 * jerk * kept**2
    speed[6] = rise.peak_m_s - 0.5 * jerk * braking.onset_s**2
    speed[_AT_CROSSING], speed[_AT_END] = braking.crossing_m_s, braking.end_m_s
    moved = duration * (speed + duration * (0.5 * acceleration + jerks * duration / 6.0))
    way[1:_AT_CROSSING] = np.cumsum(moved, axis=0)[: _AT_CROSSING - 1]
    way[_AT_CROSSING] = limits.length_m + limits.tail_m - braking.held_m
    way[_AT_CROSSING] -= braking.near.way_m(braking.crossing_m_s)
    way[_AT_END] = limits.length_m - braking.final_m
    slot = np.full(duration.shape, BRAKE)
    slot[:_RISEN], slot[_CRUISED] = RAMP, CRUISE
    slot[_KEPT, straights.cruise_m > 0.0] = CRUISE
    slot[:, steep] = RAMP

    level = horizontal(limits.direction)
    after = speed + duration * (acceleration + 0.5 * jerks * duration)
    time_scales = pieces.time_scale.between(level * speed, level * after)
    lagging = pieces.time_scale.lagging(
        duration[:_RISEN], level * speed[:_RISEN], level * after[:_RISEN]
    )
    # Braking, the vehicle is ahead of its trajectory; what it lags by from standing, it nearly is ahead
    # by at the next stop.
    rising = np.where(legs.turn_s == 0.0, time_scales[:_RISEN], lagging)
    time_scales[:_RISEN] = np.where(steep, time_scales[:_RISEN], np.where(slows, 1.0, rising))
    time_scales[_KEPT + 1 :] = np.where(steep, time_scales[_KEPT + 1 :], 1.0)
    phase, move = np.nonzero((duration > 0.0) & legs.planned.is_leg)
    at, direction = (phase, move), limits.direction[move]
    pieces.add_lines(
        Places(move, _PHASES[phase], slot[at], duration[at], time_scales[at]),
        legs.straight_m[move] + direction * way[at][:, None],
        direction,
        speed[at],
        acceleration[at],
        jerks[at],
    )


def _braked(
    legs: Px4Legs, rows: IntArray, law: BrakingLaw, start_m_s: FloatArray
) -> tuple[FloatArray, Brakes]:
    """Return to where some legs are braked, and how, by a law of each of them from speeds on. (k, 3, 4)"""
    direction = legs.limits.direction[rows]
    way = legs.limits.length_m[rows] + legs.limits.tail_m[rows] + law.beyond_m
    aims = np.zeros((len(rows), 3, 4))
    aims[..., 0] = legs.straight_m[rows] + direction * way[:, None]
    return aims, Brakes(
        direction=direction,
        start_m_s=start_m_s,
        final_m_s=law.final_m_s,
        acceleration_m_s2=law.acceleration_m_s2,
        half_b_m_s=law.half_b_m_s,
        rate=np.ones(len(rows)),
    )


def _add_brakes(pieces: Px4Pieces, legs: Px4Legs, *, steep: BoolArray) -> None:
    """Add the braking of legs by their laws."""
    straights = legs.straights
    crossing = straights.braking.crossing_m_s
    for order, law, start, end in (
        (_FAR, straights.braking.far, straights.braking.joined_m_s, crossing),
        (_NEAR, straights.braking.near, crossing, straights.braking.end_m_s),
    ):
        move = rows_of(legs.planned.is_leg & (start > end) & (end > 0.0))
        first, last = start[move], end[move]
        aims, brakes = _braked(legs, move, law.select(move), first)
        level = horizontal(brakes.direction)
        between = pieces.time_scale.between(level * first, level * last)
        pieces.add(
            Places(
                move,
                order,
                np.where(steep[move], RAMP, BRAKE),
                braking_time_s(first, last, brakes.acceleration_m_s2, brakes.half_b_m_s),
                np.where(steep[move], between, 1.0),
            ),
            aims,
            brakes,
        )


def add_weaves(pieces: Px4Pieces, flown: Px4Legs) -> None:
    """Add legs that are stepped, as cubics from one place that was kept to the next."""
    planned = flown.planned
    stepped = flown.weaves.is_stepped & (planned.is_leg | planned.is_wait)
    for move in rows_of(stepped).tolist():
        swung = flown.weaves.swung[move]
        time_s, place, velocity = np.diff(swung.time_s), swung.place_m, swung.velocity_m_s
        if not len(time_s):
            continue
        t, way = time_s[:, None], np.diff(place, axis=0)
        first, last = velocity[:-1], velocity[1:]
        cubics = np.stack(
            (
                place[:-1],
                first,
                (3.0 * way / t - 2.0 * first - last) / t,
                (first + last - 2.0 * way / t) / t**2,
            ),
            axis=-1,
        )
        is_turn = swung.time_s[1:] <= swung.reached_s
        scale = pieces.time_scale.between(horizontal(first), horizontal(last))
        order, slot = np.where(is_turn, _TURN, _HOLD), np.where(is_turn, RAMP, HOLD)
        pieces.add(Places(np.full(len(time_s), move), order, slot, time_s, scale), cubics)


def add_holds(pieces: Px4Pieces, flown: Px4Legs) -> None:
    """Add holds: going on to brake to the target, or settling on it."""
    planned = flown.planned
    holding = (planned.hold_s > 0.0) & (planned.is_leg | planned.is_wait)
    move, half_b = creeps(flown)
    holding[move] = False
    holding &= ~flown.weaves.is_held
    if len(move):
        braking = flown.straights.braking
        law = replace(braking.near.select(move), half_b_m_s=half_b, beyond_m=0.0 * half_b)
        pieces.add(
            Places(move, _HOLD, HOLD, planned.hold_s[move]),
            *_braked(flown, move, law, braking.end_m_s[move]),
        )
    move = rows_of(holding)
    if not len(move):
        return
    hold_s, target = planned.hold_s[move], planned.target_m[move]
    curves = settlings(flown, move)
    pieces.add_curves(Places(move, _HOLD, HOLD, hold_s), curves)
    rest_s = hold_s - curves.duration_s.sum(axis=1)
    pieces.add_lines(Places(move, _REST, HOLD, rest_s), target)
