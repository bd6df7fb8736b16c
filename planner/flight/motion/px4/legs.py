"""Legs: the moves of a flight, flown one after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.columns import Columns
from planner.flight.motion.px4.holds import ends_of_moves
from planner.flight.motion.px4.layout import Layout, lay_out
from planner.flight.motion.px4.limits import Limits, limits_along
from planner.flight.motion.px4.onto_legs import (
    cut_short,
    joined_turns,
    slowed_turns,
    turns_onto_moves,
)
from planner.flight.motion.px4.speeds import STILL_M, braking_time_s
from planner.flight.motion.px4.straights import Straights, fly_straights
from planner.flight.motion.px4.takeoffs import Takeoffs, make_takeoffs
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.flight.motion.px4.moves import Moves
    from planner.flight.motion.px4.turns import Turns
    from planner.vehicle.parameters.px4 import Px4Parameters


_UNCHANGED = 0.01
"""Change of a place or speed that is none for what follows. [m, m s⁻¹]"""
_ROUNDS = 100
"""Short legs hand on their speed to the next; each round carries it one leg further, ever less of it."""


@frozen(eq=False)
class Legs(Columns):
    """Moves as they are flown, as columns of length n; of landings only how they begin."""

    place_m: FloatArray
    """Where each begins. (n, 3) [m]"""
    velocity_m_s: FloatArray
    """Velocity there. (n, 3) [m s⁻¹]"""
    turn_s: FloatArray
    """Time of the turn, or of the pause with the braking before it. (n,) [s]"""
    straight_m: FloatArray
    """Where the straight begins. (n, 3) [m]"""
    limits: Limits
    straights: Straights
    end_m: FloatArray
    """Where the vehicle is when the next move begins. (n, 3) [m]"""
    end_m_s: FloatArray
    """Its velocity then. (n, 3) [m s⁻¹]"""


@frozen(eq=False)
class FlownMoves:
    """All there is to know of the moves of a flight."""

    layout: Layout
    legs: Legs
    takeoffs: Takeoffs
    """Of the moves that are take-offs, in their order."""


def fly_legs(moves: Moves, parameters: Px4Parameters) -> FlownMoves:
    """Return how moves are flown.

    Parameters
    ----------
    moves : Moves
        At least one.
    parameters : Px4Parameters
        The vehicle's.

    Notes
    -----
    A leg is flown alike whatever came before, but for the speed and place it is begun with; only legs
    too short for the speed allowed at their end change those.  So all are flown at once, then those
    behind a change again, until nothing changes.
    """
    layout = lay_out(moves, parameters)
    takeoffs = make_takeoffs(
        layout.begins_m[moves.is_takeoff], layout.target_m[moves.is_takeoff], parameters
    )
    legs = _guessed(layout, moves, parameters)
    active = np.arange(len(moves))
    for _ in range(_ROUNDS):
        flown = _flown(active, layout, legs, takeoffs, moves=moves, parameters=parameters)
        moved = np.abs(flown.end_m - legs.end_m[active]).max(axis=1)
        sped = np.abs(flown.end_m_s - legs.end_m_s[active]).max(axis=1)
        changed = np.zeros(len(moves) + 1, dtype=np.bool_)
        changed[active] = np.maximum(moved, sped) > _UNCHANGED
        legs.put(active, flown)
        active = np.flatnonzero(changed[layout.before])
        if not len(active):
            break
    return FlownMoves(layout=layout, legs=legs, takeoffs=takeoffs)


def _guessed(layout: Layout, moves: Moves, parameters: Px4Parameters) -> Legs:
    """Return legs as flown by a vehicle that is never short of way."""
    count = len(moves)
    straight = limits_along(
        layout.begins_m,
        layout.target_m,
        tail_m=layout.tail_m,
        speed_m_s=layout.speed_m_s,
        final_level_m_s=layout.final_level_m_s,
        final_upright_m_s=layout.final_upright_m_s,
        parameters=parameters,
    )
    end_speed = np.minimum(straight.lowest_allowed_m_s(layout.tail_m), straight.cruise_m_s)
    moving = layout.is_leg & ~(layout.hold_s > 0.0)
    end_speed = np.where(moving, end_speed, 0.0)
    zero = np.zeros(count)
    return Legs(
        place_m=layout.begins_m.copy(),
        velocity_m_s=np.zeros((count, 3)),
        turn_s=zero.copy(),
        straight_m=layout.begins_m.copy(),
        limits=straight,
        straights=_unmoved(zero),
        end_m=np.where(moving[:, None], layout.ends_m, layout.target_m),
        end_m_s=layout.direction * end_speed[:, None],
    )


def _flown(
    rows: IntArray,
    layout: Layout,
    legs: Legs,
    takeoffs: Takeoffs,
    *,
    moves: Moves,
    parameters: Px4Parameters,
) -> Legs:
    """Return some of the moves as flown, after what is known of the moves before them."""
    part = layout.select(rows)
    place, velocity = _beginnings(rows, part, legs, moves)
    turns = turns_onto_moves(part, place, velocity, parameters)
    turns, slowed = slowed_turns(part, place, velocity, turns, parameters)
    turns = joined_turns(part, place, velocity, turns, slowed, parameters=parameters)
    climbing = np.flatnonzero(part.is_takeoff)
    which = np.cumsum(moves.is_takeoff)[rows[climbing]] - 1
    turns.end_m[climbing] = takeoffs.place_m[which]

    ends = np.where(part.stands[:, None] | ~part.is_leg[:, None], turns.end_m, part.ends_m)
    turns, ends = cut_short(part, place, velocity, turns, ends, parameters=parameters)
    limits = limits_along(
        turns.end_m,
        ends,
        tail_m=part.tail_m,
        speed_m_s=part.speed_m_s,
        final_level_m_s=part.final_level_m_s,
        final_upright_m_s=part.final_upright_m_s,
        parameters=parameters,
    )
    held = climbing[~takeoffs.is_free[which]]
    limits.cruise_m_s[held] = takeoffs.speed_m_s[which[~takeoffs.is_free[which]]]
    start, acceleration = _starts(limits, turns, velocity)
    start = np.where(slowed, limits.cruise_m_s, start)
    start[climbing], acceleration[climbing] = takeoffs.speed_m_s[which], 0.0
    moving = np.flatnonzero(limits.length_m > STILL_M)
    straights = _unmoved(start)
    straights.put(
        moving,
        fly_straights(
            limits.select(moving),
            start_m_s=start[moving],
            acceleration_m_s2=acceleration[moving],
        ),
    )
    end, end_speed = ends_of_moves(
        part, turns.end_m, velocity, limits, straights, parameters=parameters
    )
    return Legs(
        place_m=place,
        velocity_m_s=velocity,
        turn_s=turns.duration_s,
        straight_m=turns.end_m,
        limits=limits,
        straights=straights,
        end_m=end,
        end_m_s=end_speed,
    )


def _beginnings(
    rows: IntArray, part: Layout, legs: Legs, moves: Moves
) -> tuple[FloatArray, FloatArray]:
    """Return where and how fast moves begin."""
    begun = (part.before >= 0)[:, None]
    place = np.where(begun, legs.end_m[part.before], part.begins_m)
    velocity = np.where(begun, legs.end_m_s[part.before], 0.0)
    # A flight of its own may begin with moves that are reached at once.
    fresh = np.maximum.accumulate(np.where(moves.is_first, np.arange(len(moves)), 0))[rows]
    place = np.where(begun, place, moves.start_m[fresh])
    return place, velocity


def _starts(
    limits: Limits, turns: Turns, velocity_m_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return speed and acceleration along straights where these begin."""
    level = np.hypot(limits.direction[:, 0], limits.direction[:, 1])
    shallow = level >= np.abs(limits.direction[:, 2])
    scale = np.where(shallow & (level > 0.0), level, 1.0)
    projected = np.maximum((velocity_m_s * limits.direction).sum(axis=1), 0.0)
    start = np.where(shallow, turns.speed_m_s / scale, projected)
    return start, np.where(shallow, turns.acceleration_m_s2 / scale, 0.0)


def _unmoved(speed_m_s: FloatArray) -> Straights:
    """Return straights of no length, left at the speed they are begun with."""
    zero, index = np.zeros_like(speed_m_s), np.zeros(len(speed_m_s), dtype=np.intp)
    return Straights(
        ramp_from_m_s=speed_m_s.copy(),
        ramp_begun_s=zero.copy(),
        is_cut=np.zeros(len(speed_m_s), dtype=np.bool_),
        peak_m_s=speed_m_s.copy(),
        cruise_m=zero.copy(),
        onset_s=zero.copy(),
        steady_s=zero.copy(),
        joined_m_s=speed_m_s.copy(),
        far=index.copy(),
        near=index.copy(),
        crossing_m_s=speed_m_s.copy(),
        held_m=zero.copy(),
        end_m_s=speed_m_s.copy(),
        final_m=zero.copy(),
        half_b_m_s=np.ones((len(speed_m_s), 2)),
        beyond_m=zero.copy(),
    )


def flight_times_s(flown: FlownMoves) -> FloatArray:
    """Return the times from the beginning of moves to their arrival. (n,) [s]"""
    legs, straights = flown.legs, flown.legs.straights
    limits = legs.limits
    peak, end, joined = straights.peak_m_s, straights.end_m_s, straights.joined_m_s
    rows = np.arange(len(peak))
    ramp_s = straights.ramps(limits).duration_s
    cruise_s = np.divide(straights.cruise_m, peak, out=np.zeros_like(peak), where=peak > 0.0)
    brakes = (end > 0.0) & (joined > end)
    braking_s = braking_time_s(
        np.where(brakes, joined, 1.0),
        np.where(brakes, end, 1.0),
        acceleration_m_s2=limits.brake_m_s2[rows, straights.far],
        half_b_m_s=straights.half_b_m_s[:, 0],
    )
    moving = flown.layout.is_leg & (limits.length_m > 0.0)
    braking_s = np.where(brakes, braking_s, 0.0) + straights.onset_s + straights.steady_s
    total = legs.turn_s + ramp_s - straights.ramp_begun_s + cruise_s + braking_s
    return np.where(moving, total, 0.0)
