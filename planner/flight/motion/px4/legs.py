"""Legs: the moves of a flight planned between their waypoints, and flown one after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns
from planner.flight.motion.px4.landing import Takeoffs, ends_of_moves, make_takeoffs
from planner.flight.motion.px4.moves import directions
from planner.flight.motion.px4.speeds import (
    STILL_M,
    allowed_speed_m_s,
    braking_time_s,
    corner_speed_m_s,
    vertical_limits,
    yaw_time_s,
)
from planner.flight.motion.px4.straights import Limits, Straights, fly_straights, limits_along
from planner.flight.motion.px4.turns import cut_short, joined_turns, leg_entries, slowed_turns
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.moves import Moves
    from planner.flight.motion.px4.turns import Turns
    from planner.vehicle.parameters.px4 import Px4Parameters


_TO_HOME, _FROM_HOME, _TURNS_FIRST, _FIXED = 1, 2, 4, 5
"""MPC_YAW_MODE: look to home, away from it, turn to the target before flying there, do not turn."""


def headings_rad(moves: Moves, direction: FloatArray, yaw_mode: int) -> FloatArray:
    """Return the heading before each move and behind the last; NaN where not known. (n + 1,) [rad]

    Along the legs, or to home or away from it as MPC_YAW_MODE has it, unless a waypoint wants its own;
    within the acceptance radius of what is looked at the heading is kept
    (``FlightTaskAuto::_set_heading_from_mode``).
    """
    level = np.hypot(direction[:, 0], direction[:, 1])
    looks, kept = direction[:, :2], level == 0.0
    if yaw_mode in {_TO_HOME, _FROM_HOME}:
        place = moves.target_m[:, :2]
        looks = place if yaw_mode == _FROM_HOME else -place
        kept = np.hypot(place[:, 0], place[:, 1]) <= moves.radius_m
    elif yaw_mode == _FIXED:
        kept = np.ones(len(level), dtype=np.bool_)
    turned = ~kept & ~moves.is_landing
    along = np.where(turned, np.arctan2(looks[:, 0], looks[:, 1]), np.nan)
    own = np.where(np.isnan(moves.yaw_rad), along, moves.yaw_rad)
    held = np.maximum.accumulate(np.where(np.isnan(own), -1, np.arange(len(own))))
    after = np.where(held >= 0, own[held], np.nan)
    return np.concatenate(([np.nan], after))


def heading_changes_rad(before_rad: FloatArray, after_rad: FloatArray) -> FloatArray:
    """Return the angles between headings; half a turn where one is not known. [rad]"""
    change = np.abs((after_rad - before_rad + np.pi) % (2.0 * np.pi) - np.pi)
    return np.where(np.isnan(change), np.pi, change)


def pauses_s(moves: Moves, direction: FloatArray, parameters: Px4Parameters) -> FloatArray:
    """Return the waits before moves for the heading: MPC_YAW_MODE 4 turns first. (n,) [s]"""
    pauses = np.zeros(len(moves))
    if parameters.yaw_mode != _TURNS_FIRST:
        return pauses
    flies = (np.hypot(direction[:, 0], direction[:, 1]) > 0.0) & ~moves.is_landing
    before = headings_rad(moves, direction, parameters.yaw_mode)[:-1]
    along = np.arctan2(direction[:, 0], direction[:, 1])
    wanted = np.where(np.isnan(moves.yaw_rad), along, moves.yaw_rad)
    return np.where(flies, yaw_time_s(heading_changes_rad(before, wanted), parameters), pauses)


def yaw_waits_s(
    moves: Moves, direction: FloatArray, flight_s: FloatArray, parameters: Px4Parameters
) -> FloatArray:
    """Return how long after their arrival waypoints still wait for their heading. (n,) [s]

    ``flight_s`` is the time from the beginning of each move to its arrival. [s]

    The heading turns while the vehicle flies there, and is waited for unless MIS_YAW_TMT is above zero
    (``MissionBlock::is_mission_item_reached``).
    """
    waits = np.zeros(len(moves))
    asked = ~np.isnan(moves.yaw_rad) & ~moves.is_landing
    if not asked.any() or parameters.yaw_timeout_s > 0.0:
        return waits
    before = headings_rad(moves, direction, parameters.yaw_mode)[:-1]
    needed = yaw_time_s(heading_changes_rad(before, moves.yaw_rad), parameters)
    return np.where(asked, np.maximum(needed - flight_s, 0.0), waits)


_SAME_PLACE_M = 0.001
"""Distance below which PX4 takes two places for one (``computeStartXYSpeedFromWaypoints``). [m]"""


def final_speeds_m_s(
    moves: Moves, direction: FloatArray, parameters: Px4Parameters
) -> tuple[FloatArray, FloatArray]:
    """Return the horizontal and the vertical speed at which targets are to be passed. (n,) [m s⁻¹]

    Zero where the vehicle stops: a hold, a loiter, nothing to follow.  Else the corner speed of the two
    legs, not more than can be brought to a stop at the waypoint after: PX4 looks one ahead
    (``computeXYSpeedFromWaypoints``).  Vertically the same with NAV_MC_ALT_RAD and the angle between
    the legs in the plane of height and distance from the origin, as ``_getMaxZSpeed`` has it.
    """
    count = len(moves)
    following = np.where(moves.is_delay | moves.is_return | moves.is_first, count, np.arange(count))
    nearest = np.minimum.accumulate(np.where(moves.is_delay, count, np.arange(count))[::-1])[::-1]
    after = np.concatenate((nearest[1:], [count]))
    follows = after < count
    after = np.where(follows, after, 0)
    follows &= (following[after] == after) & ~moves.is_stop & ~moves.is_delay

    target, following_m = moves.target_m, moves.target_m[after].copy()
    following_m[:, 2] = moves.seen_height_m[after]
    way = following_m[:, :2] - target[:, :2]
    length = np.hypot(way[:, 0], way[:, 1])
    come = np.hypot(direction[:, 0], direction[:, 1])
    scale = length * come
    cosine = np.divide(
        (direction[:, :2] * way).sum(axis=1), scale, out=np.zeros(count), where=scale > 0.0
    )
    corner = corner_speed_m_s(
        cosine,
        moves.radius_m,
        gain_per_s=parameters.trajectory_gain_per_s,
        acceleration_m_s2=parameters.acceleration_m_s2,
    )
    leaving = allowed_speed_m_s(length, 0.0, parameters.acceleration_m_s2, parameters.jerk_m_s3)
    passed = follows & (length >= np.maximum(moves.radius_m, _SAME_PLACE_M))
    level = np.where(passed, np.minimum(np.minimum(corner, leaving), moves.speed_m_s), 0.0)
    return level, np.where(
        follows, _vertical_corner_speeds_m_s(direction, target, following_m, parameters), 0.0
    )


def _vertical_corner_speeds_m_s(
    direction: FloatArray, target_m: FloatArray, following_m: FloatArray, parameters: Px4Parameters
) -> FloatArray:
    """Return the vertical speeds at which targets are to be passed. (n,) [m s⁻¹]"""
    distance = np.hypot(target_m[:, 0], target_m[:, 1])
    outward = np.divide(
        (direction[:, :2] * target_m[:, :2]).sum(axis=1),
        distance,
        out=-np.hypot(direction[:, 0], direction[:, 1]),
        where=distance > STILL_M,
    )
    come = np.column_stack((outward, direction[:, 2]))
    leave = np.column_stack(
        (
            np.hypot(following_m[:, 0], following_m[:, 1]) - distance,
            following_m[:, 2] - target_m[:, 2],
        )
    )
    scale = np.hypot(come[:, 0], come[:, 1]) * np.hypot(leave[:, 0], leave[:, 1])
    cosine = np.divide(
        (come * leave).sum(axis=1), scale, out=np.zeros(len(scale)), where=scale > 0.0
    )
    limit, acceleration = vertical_limits(direction[:, 2] > 0.0, parameters)
    speed = corner_speed_m_s(
        np.clip(cosine, -1.0, 1.0),
        acceleration * parameters.altitude_acceptance_m,
        gain_per_s=1.0,
        acceleration_m_s2=1.0,
    )
    differs = np.abs(leave[:, 1]) > _SAME_PLACE_M
    return np.where(differs, np.minimum(speed, limit), 0.0)


_ON_THE_EDGE_M = 1e-6
"""Rounding by which a place on the edge of an acceptance radius may be outside. [m]"""


class PlannedLegs(Columns, eq=False):
    """Moves planned between their waypoints, before anything is known of speeds handed on."""

    begins_m: FloatArray
    """Waypoint before. (n, 3) [m]"""
    target_m: FloatArray
    direction: FloatArray
    """From the waypoint before to the target; zero where they are one place. (n, 3)"""
    ends_m: FloatArray
    """Where the target counts as reached. (n, 3) [m]"""
    tail_m: FloatArray
    """From there on to the target. (n,) [m]"""
    radius_m: FloatArray
    speed_m_s: FloatArray
    final_level_m_s: FloatArray
    final_upright_m_s: FloatArray
    hold_s: FloatArray
    pause_s: FloatArray
    """Wait before the move begins, for the heading. (n,) [s]"""
    before: IntArray
    """Move flown before; −1 where a flight begins. (n,)"""
    is_leg: BoolArray
    """Flown from place to place: no landing, and not reached as soon as it begins."""
    stands: BoolArray
    """Nothing but a wait."""
    is_takeoff: BoolArray


def plan_legs(moves: Moves, parameters: Px4Parameters) -> PlannedLegs:
    """Return moves planned between their waypoints: corner speeds, waits for headings, order."""
    begins = moves.begins_m
    way = moves.target_m - begins
    way = np.where(np.abs(way) < STILL_M, 0.0, way)
    direction, _ = directions(way)
    # NAV_MC_ALT_RAD; half the height of a take-off lower than that (``is_mission_item_reached``).
    band = np.full(len(moves), parameters.altitude_acceptance_m)
    low = moves.is_takeoff & (way[:, 2] > 0.0) & (way[:, 2] < band)
    band = np.where(low, 0.5 * way[:, 2], band)
    level = np.hypot(direction[:, 0], direction[:, 1])
    tail = np.minimum(
        np.divide(moves.radius_m, level, out=np.full_like(level, np.inf), where=level > 0.0),
        np.divide(
            band,
            np.abs(direction[:, 2]),
            out=np.full_like(level, np.inf),
            where=direction[:, 2] != 0.0,
        ),
    )
    tail = np.where(np.isfinite(tail), tail, moves.radius_m)
    ends = moves.target_m - direction * tail[:, None]
    reached = _reached_at_once(moves, begins, ends, parameters)
    is_leg = ~reached & ~moves.is_landing
    stands = reached & (moves.hold_s > 0.0)
    counts = is_leg | stands | moves.is_landing
    last = np.maximum.accumulate(np.where(counts, np.arange(len(moves)), -1))
    before = np.concatenate(([-1], last[:-1]))
    before[moves.is_first] = -1
    first_of_flight = np.maximum.accumulate(np.where(moves.is_first, np.arange(len(moves)), 0))
    before = np.where(before >= first_of_flight, before, -1)
    final_level, final_upright = final_speeds_m_s(moves, direction, parameters)
    return PlannedLegs(
        begins_m=begins,
        target_m=moves.target_m,
        direction=direction,
        ends_m=ends,
        tail_m=tail,
        radius_m=moves.radius_m,
        speed_m_s=moves.speed_m_s,
        final_level_m_s=final_level,
        final_upright_m_s=final_upright,
        hold_s=moves.hold_s.copy(),
        pause_s=pauses_s(moves, direction, parameters),
        before=before,
        is_leg=is_leg,
        stands=stands,
        is_takeoff=moves.is_takeoff,
    )


def _reached_at_once(
    moves: Moves, begins_m: FloatArray, ends_m: FloatArray, parameters: Px4Parameters
) -> BoolArray:
    """Return which moves are reached where they begin. (n,)"""
    way = moves.target_m - begins_m
    distance = np.hypot(way[:, 0], way[:, 1])
    wide = np.concatenate(([0.0], moves.radius_m[:-1]))
    near = (distance <= moves.radius_m + wide) & (
        np.abs(way[:, 2]) <= 2.0 * parameters.altitude_acceptance_m
    )
    reached = np.zeros(len(moves), dtype=np.bool_)
    candidates = near & ~moves.is_takeoff & ~moves.is_landing
    place = begins_m.copy()
    for row in np.flatnonzero(candidates).tolist():
        if not moves.is_first[row]:
            if reached[row - 1] and not moves.hold_s[row - 1] > 0.0:
                place[row] = place[row - 1]
            elif not (moves.is_landing[row - 1] or moves.hold_s[row - 1] > 0.0):
                place[row] = ends_m[row - 1]
        off = moves.target_m[row] - place[row]
        reached[row] = (
            np.hypot(off[0], off[1]) <= moves.radius_m[row] + _ON_THE_EDGE_M
            and abs(off[2]) <= parameters.altitude_acceptance_m + _ON_THE_EDGE_M
        )
    return reached


_UNCHANGED = 0.01
"""Change of a place or speed that is none for what follows. [m, m s⁻¹]"""
_ROUNDS = 100
"""Short legs hand on their speed to the next; each round carries it one leg further, ever less of it."""


class Px4Legs(Columns, eq=False):
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


class FlownMoves(Value, eq=False):
    """All there is to know of the moves of a flight."""

    planned: PlannedLegs
    legs: Px4Legs
    takeoffs: Takeoffs
    """Of the moves that are take-offs, in their order."""


def fly_legs(moves: Moves, parameters: Px4Parameters) -> FlownMoves:
    """Return how moves, at least one, are flown.

    Notes
    -----
    A leg is flown alike whatever came before, but for the speed and place it is begun with; only legs
    too short for the speed allowed at their end change those.  So all are flown at once, then those
    after a change again, until nothing changes.
    """
    planned = plan_legs(moves, parameters)
    takeoffs = make_takeoffs(
        planned.begins_m[moves.is_takeoff], planned.target_m[moves.is_takeoff], parameters
    )
    legs = _guessed(planned, moves, parameters)
    active = np.arange(len(moves))
    for _ in range(_ROUNDS):
        flown = _flown(active, planned, legs, takeoffs, moves=moves, parameters=parameters)
        moved = np.abs(flown.end_m - legs.end_m[active]).max(axis=1)
        sped = np.abs(flown.end_m_s - legs.end_m_s[active]).max(axis=1)
        changed = np.zeros(len(moves) + 1, dtype=np.bool_)
        changed[active] = np.maximum(moved, sped) > _UNCHANGED
        legs.put(active, flown)
        active = np.flatnonzero(changed[planned.before])
        if not len(active):
            break
    return FlownMoves(planned=planned, legs=legs, takeoffs=takeoffs)


def _guessed(planned: PlannedLegs, moves: Moves, parameters: Px4Parameters) -> Px4Legs:
    """Return legs as flown by a vehicle that is never short of way."""
    count = len(moves)
    straight = limits_along(planned.begins_m, planned.target_m, planned, parameters)
    end_speed = np.minimum(straight.lowest_allowed_m_s(planned.tail_m), straight.cruise_m_s)
    moving = planned.is_leg & ~(planned.hold_s > 0.0)
    end_speed = np.where(moving, end_speed, 0.0)
    zero = np.zeros(count)
    return Px4Legs(
        place_m=planned.begins_m.copy(),
        velocity_m_s=np.zeros((count, 3)),
        turn_s=zero.copy(),
        straight_m=planned.begins_m.copy(),
        limits=straight,
        straights=_unmoved(zero),
        end_m=np.where(moving[:, None], planned.ends_m, planned.target_m),
        end_m_s=planned.direction * end_speed[:, None],
    )


def _flown(
    rows: IntArray,
    planned: PlannedLegs,
    legs: Px4Legs,
    takeoffs: Takeoffs,
    *,
    moves: Moves,
    parameters: Px4Parameters,
) -> Px4Legs:
    """Return some of the moves as flown, after what is known of the moves before them."""
    part = planned.select(rows)
    place, velocity = _beginnings(rows, part, legs, moves)
    turns = leg_entries(part, place, velocity, parameters)
    turns, slowed = slowed_turns(part, place, velocity, turns, parameters)
    turns = joined_turns(part, place, velocity, turns, slowed, parameters=parameters)
    climbing = np.flatnonzero(part.is_takeoff)
    which = np.cumsum(moves.is_takeoff)[rows[climbing]] - 1
    turns.end_m[climbing] = takeoffs.place_m[which]

    ends = np.where(part.stands[:, None] | ~part.is_leg[:, None], turns.end_m, part.ends_m)
    turns, ends = cut_short(part, place, velocity, turns, ends, parameters=parameters)
    limits = limits_along(turns.end_m, ends, part, parameters)
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
            limits.select(moving), start_m_s=start[moving], acceleration_m_s2=acceleration[moving]
        ),
    )
    end, end_speed = ends_of_moves(
        part, turns.end_m, velocity, limits, straights, parameters=parameters
    )
    return Px4Legs(
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
    rows: IntArray, part: PlannedLegs, legs: Px4Legs, moves: Moves
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
        limits.brake_m_s2[rows, straights.far],
        straights.half_b_m_s[:, 0],
    )
    moving = flown.planned.is_leg & (limits.length_m > 0.0)
    braking_s = np.where(brakes, braking_s, 0.0) + straights.onset_s + straights.steady_s
    total = legs.turn_s + ramp_s - straights.ramp_begun_s + cruise_s + braking_s
    return np.where(moving, total, 0.0)
