"""Legs: the moves of a flight planned between their waypoints, and flown one after the other."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns, dot, greatest, horizontal, lengths, quotient
from planner.flight.motion.px4.braking import (
    STILL_M,
    allowed_speed_m_s,
    braking_time_s,
    corner_speed_m_s,
    vertical_limits,
    yaw_time_s,
)
from planner.flight.motion.px4.joins import (
    cut_short,
    eased_turns,
    joined_turns,
    leg_entries,
    slowed_turns,
)
from planner.flight.motion.px4.landing import (
    Takeoffs,
    ends_of_moves,
    make_takeoffs,
    slowing_at_ends_m_s2,
    takeoff_band_m,
)
from planner.flight.motion.px4.moves import SLOWEST_TURN_M_S, Moves, directions
from planner.flight.motion.px4.straights import Limits, Straights, fly_straights, limits_along
from planner.values import field_values, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.turns import Turns
    from planner.vehicle.parameters.px4 import Px4Parameters


_TO_HOME, _FROM_HOME, _TURNS_FIRST, _FIXED = 1, 2, 4, 5
"""MPC_YAW_MODE: look to home, away from it, turn to the target before flying there, do not turn."""


def headings_rad(moves: Moves, direction: FloatArray, yaw_mode: int) -> FloatArray:
    """Return the heading before each move and after the last; NaN where not known. (n + 1,) [rad]

    Along the legs, or to home or away from it as MPC_YAW_MODE has it, unless a waypoint wants its own;
    within the acceptance radius of what is looked at the heading is kept
    (``FlightTaskAuto::_set_heading_from_mode``).
    """
    looks, kept = direction[:, :2], horizontal(direction) == 0.0
    if yaw_mode in {_TO_HOME, _FROM_HOME}:
        place = moves.target_m[:, :2]
        looks = place if yaw_mode == _FROM_HOME else -place
        kept = horizontal(place) <= moves.radius_m
    turned = ~kept & ~moves.is_landing & (yaw_mode != _FIXED)
    along = np.where(turned, np.arctan2(looks[:, 0], looks[:, 1]), np.nan)
    own = np.where(np.isnan(moves.yaw_rad), along, moves.yaw_rad)
    held = np.maximum.accumulate(np.where(np.isnan(own), -1, np.arange(len(own))))
    first = np.maximum.accumulate(np.where(moves.is_first, np.arange(len(own)), 0))
    after = np.where(held >= first, own[held], moves.start_yaw_rad)
    before = np.where(moves.is_first, moves.start_yaw_rad, np.append(np.nan, after[:-1]))
    return np.append(before, after[-1:])


_ANY_TURN_RAD = np.pi * (np.arange(12.0)[:, None] + 0.5) / 12.0
"""Turns between headings of which one is not known, equally likely: what holds for all lies between. [rad]"""


def _turn_times_s(
    before_rad: FloatArray,
    after_rad: FloatArray,
    parameters: Px4Parameters,
    *,
    about: BoolArray | bool = False,
) -> FloatArray:
    """Return the times to turn from headings to others, a row for each turn that is equally likely. (k, n)

    All rows are the same where both headings are known, and where a vehicle is taken to turn about.
    """
    known = np.isfinite(before_rad) & np.isfinite(after_rad)
    angle = np.where(before_rad == after_rad, 0.0, np.abs(_turn_rad(before_rad, after_rad)))
    unknown = np.where(about, np.pi, _ANY_TURN_RAD)
    return yaw_time_s(np.where(known, angle, unknown), parameters)


def pauses_s(moves: Moves, direction: FloatArray) -> FloatArray:
    """Return the waits before moves for the heading: MPC_YAW_MODE 4 turns first. (n,) [s]"""
    parameters = moves.parameters
    if parameters.yaw_mode != _TURNS_FIRST:
        return np.zeros(len(direction))
    before = headings_rad(moves, direction, parameters.yaw_mode)[:-1]
    along = np.arctan2(direction[:, 0], direction[:, 1])
    wanted = np.where(np.isnan(moves.yaw_rad), along, moves.yaw_rad)
    flies = ((horizontal(direction) > 0.0) | ~np.isnan(moves.yaw_rad)) & ~moves.is_landing
    return np.where(flies, _turn_times_s(before, wanted, parameters).mean(axis=0), 0.0)


def yaw_waits_s(legs: Px4Legs) -> FloatArray:
    """Return how long after their arrival waypoints still wait for a heading. (n,) [s]

    That asked for there, and before a landing that of the landing.  Where a heading is not known, the mean
    of all turns; but half a turn to that of home: vehicles are set down looking where they are to fly, and
    come home looking back.
    """
    waits, landing = (of_each.mean(axis=0) for of_each in _waits_s(legs))
    return np.asarray(waits + np.append(landing[1:], 0.0))


def _waits_s(legs: Px4Legs, *, turns_about: bool = True) -> tuple[FloatArray, FloatArray]:
    """Return the waits for the headings that moves ask for, after waypoints and before landings. [s]

    The heading turns while the vehicle flies to a waypoint, and is waited for unless MIS_YAW_TMT is above
    zero (``MissionBlock::is_mission_item_reached``).  That of a landing turns on the way down, but for
    MPC_YAW_MODE 4: no velocity until it is near (``FlightTaskAuto``: ``_yaw_sp_aligned``).  Both are (k, n),
    a row for each turn that is equally likely.
    """
    parameters = legs.parameters
    moves = legs.planned
    asked = ~np.isnan(moves.yaw_rad)
    flown = asked & ~moves.is_landing & (not parameters.yaw_timeout_s > 0.0)
    landed = asked & moves.is_landing & ~moves.is_first & (parameters.yaw_mode == _TURNS_FIRST)
    if not (flown.any() or landed.any()):
        return np.zeros((1, len(asked))), np.zeros((1, len(asked)))
    before = headings_rad(moves, moves.direction, parameters.yaw_mode)[:-1]
    about = moves.is_return & turns_about
    needed = _turn_times_s(before, moves.yaw_rad, parameters, about=about)
    left_s = flight_times_s(legs)
    # A turn that began nobody knows where may be gone on with or turned back from.
    still = flown & np.isfinite(before) & (needed[0] > left_s)
    turns_on = np.append(False, still[:-1]) & ~moves.is_first
    needed = np.where(turns_on, _turned_on_s(before, moves.yaw_rad, parameters), needed)
    waits = np.where(flown, np.maximum(needed - left_s, 0.0), 0.0)
    return waits, np.where(landed, needed, 0.0)


def _turned_on_s(
    before_rad: FloatArray, asked_rad: FloatArray, parameters: Px4Parameters
) -> FloatArray:
    """Return the times to headings asked for while the vehicle still turns to the one before. (n,) [s]

    Notes
    -----
    A waypoint that waits for its heading is reached MIS_YAW_ERR before it, at the rate v that still stops
    there.  The next turn is that from rest over the angle and v²/2a more, v/a shorter where it goes on the
    same way round, and v/a longer where it turns back first.
    """
    a, within = parameters.yaw_acceleration_rad_s2, parameters.yaw_acceptance_rad
    came = np.sign(_turn_rad(np.append(np.nan, before_rad[:-1]), before_rad))
    angle = _turn_rad(before_rad - came * within, asked_rad)
    rate = min(parameters.yaw_rate_rad_s, math.sqrt(2.0 * a * within))
    whole = yaw_time_s(np.abs(angle) + 0.5 * rate**2 / a, parameters)
    return np.asarray(whole - came * np.sign(angle) * rate / a)


def _turn_rad(before_rad: FloatArray, after_rad: FloatArray) -> FloatArray:
    """Return the turns from headings to others the shorter way; half a turn where one is not known. [rad]"""
    known = np.isfinite(before_rad) & np.isfinite(after_rad)
    turn = np.where(known, after_rad, 0.0) - np.where(known, before_rad, 0.0)
    return np.where(known, (turn + np.pi) % (2.0 * np.pi) - np.pi, np.pi)


def waits_unknown(legs: Px4Legs) -> tuple[FloatArray, FloatArray]:
    """Return the waits for headings that are as far away as nobody knows. (k, n), (n,) [s]

    A row for each turn that is equally likely, from the least to the greatest; and what is taken for them.
    """
    parameters = legs.parameters
    moves = legs.planned
    before = headings_rad(moves, moves.direction, parameters.yaw_mode)[:-1]
    known = (np.isfinite(before) & np.isfinite(moves.yaw_rad)) | (before == moves.yaw_rad)
    begun = np.where(
        moves.is_leg & ~np.isfinite(before) & (moves.pause_s > 0.0),
        yaw_time_s(_ANY_TURN_RAD, parameters),
        0.0,
    )
    any_turn, taken = (
        np.where(known, 0.0, sum(_waits_s(legs, turns_about=about))) + begun
        for about in (False, True)
    )
    return any_turn, taken.mean(axis=0)


_SAME_PLACE_M = 0.001
"""Distance below which PX4 takes two places for one (``computeStartXYSpeedFromWaypoints``). [m]"""


def final_speeds_m_s(moves: Moves, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the horizontal and the vertical speed at which targets are to be passed. (n,) [m s⁻¹]

    Zero where the vehicle stops: a hold, a loiter, nothing to follow.  Else the corner speed of the two
    legs, not more than can be brought to a stop at the waypoint after: PX4 looks one ahead
    (``computeXYSpeedFromWaypoints``).  Vertically the same with NAV_MC_ALT_RAD and the angle between
    the legs in the plane of height and distance from the origin, as ``_getMaxZSpeed`` has it.
    """
    parameters = moves.parameters
    count = len(moves.item)
    following = np.where(moves.is_delay | moves.is_return | moves.is_first, count, np.arange(count))
    nearest = np.minimum.accumulate(np.where(moves.is_delay, count, np.arange(count))[::-1])[::-1]
    after = np.concatenate((nearest[1:], [count]))
    follows = after < count
    after = np.where(follows, after, 0)
    follows &= (following[after] == after) & ~moves.is_stop & ~moves.is_delay

    target, following_m = moves.target_m, moves.target_m[after].copy()
    following_m[:, 2] = moves.seen_height_m[after]
    way = following_m[:, :2] - target[:, :2]
    length = horizontal(way)
    corner = corner_speed_m_s(
        _cosine(direction[:, :2], way),
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


def _cosine(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the cosines of angles between vectors, zero where one has no length. (n,)"""
    return quotient(dot(one, other), lengths(one) * lengths(other))


def _vertical_corner_speeds_m_s(
    direction: FloatArray, target_m: FloatArray, following_m: FloatArray, parameters: Px4Parameters
) -> FloatArray:
    """Return the vertical speeds at which targets are to be passed. (n,) [m s⁻¹]"""
    distance, upward = horizontal(target_m), direction[:, 2]
    outward = quotient(
        dot(direction[:, :2], target_m[:, :2]), distance, -horizontal(direction), above=STILL_M
    )
    rise = following_m[:, 2] - target_m[:, 2]
    cosine = _cosine(
        np.column_stack((outward, upward)),
        np.column_stack((horizontal(following_m) - distance, rise)),
    )
    limit, acceleration = vertical_limits(upward > 0.0, parameters)
    speed = corner_speed_m_s(
        np.clip(cosine, -1.0, 1.0),
        acceleration * parameters.altitude_acceptance_m,
        gain_per_s=1.0,
        acceleration_m_s2=1.0,
    )
    return np.where(np.abs(rise) > _SAME_PLACE_M, np.minimum(speed, limit), 0.0)


LEAST_REACH = 0.25
"""Of the distance at which a place counts as reached, what is left of it by a lag. [-]"""
_ON_THE_EDGE_M = 1e-6
"""Rounding by which a place on the edge of an acceptance radius may be outside. [m]"""


class PlannedLegs(Moves, eq=False):
    """Moves planned between their waypoints, before anything is known of speeds handed on."""

    begins_m: FloatArray
    """Waypoint before. (n, 3) [m]"""
    direction: FloatArray
    """From the waypoint before to the target; zero where they are one place. (n, 3)"""
    ends_m: FloatArray
    """Where the target counts as reached. (n, 3) [m]"""
    tail_m: FloatArray
    """From there on to the target. (n,) [m]"""
    final_level_m_s: FloatArray
    final_upright_m_s: FloatArray
    pause_s: FloatArray
    """Wait before the move begins, for the heading. (n,) [s]"""
    is_leg: BoolArray
    """Flown from place to place: no landing, and not reached as soon as it begins."""
    is_wait: BoolArray
    """Nothing but a wait."""
    takeoffs: Takeoffs
    """Of the moves that are take-offs; of no meaning for others."""


def plan_legs(moves: Moves) -> PlannedLegs:
    """Return moves planned between their waypoints: corner speeds, waits for headings, order."""
    begins = moves.beginnings_m()
    direction, tail = _aims(moves, begins)
    ends = moves.target_m - direction * tail[:, None]
    reached = _reached_at_once(moves, begins, ends)
    for _ in range(2 if moves.goes_on.any() else 0):  # one may follow another
        before_m = np.where(reached[:, None], begins, ends)
        begins = np.where(moves.goes_on[:, None], np.roll(before_m, 1, axis=0), begins)
        direction, tail = _aims(moves, begins)
        ends = moves.target_m - direction * tail[:, None]
    is_leg = ~reached & ~moves.is_landing
    is_wait = reached & (moves.hold_s > 0.0)
    first = np.maximum.accumulate(np.where(moves.is_first, np.arange(len(begins)), 0))
    final_level, final_upright = final_speeds_m_s(moves, direction)
    # A flight of its own may begin with moves that are reached at once.
    own = replace(moves, start_m=moves.start_m[first])
    return PlannedLegs(
        **field_values(own),
        begins_m=begins,
        direction=direction,
        ends_m=ends,
        tail_m=tail,
        final_level_m_s=final_level,
        final_upright_m_s=final_upright,
        pause_s=pauses_s(moves, direction),
        is_leg=is_leg,
        is_wait=is_wait,
        takeoffs=make_takeoffs(begins, moves.target_m, moves.late_s, moves.parameters),
    )


def _aims(moves: Moves, begins_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the directions to targets, and how far before them they count as reached. (n, 3), (n,)"""
    parameters = moves.parameters
    way = moves.target_m - begins_m
    way = np.where(np.abs(way) < STILL_M, 0.0, way)
    direction, _ = directions(way)
    band = np.where(
        moves.is_takeoff, takeoff_band_m(way[:, 2], parameters), parameters.altitude_acceptance_m
    )
    band = np.maximum(band + moves.past_m, LEAST_REACH * band)
    tail = np.minimum(
        quotient(moves.reach_m, horizontal(direction), np.inf),
        quotient(band, np.abs(direction[:, 2]), np.inf),
    )
    return direction, np.where(np.isfinite(tail), tail, moves.reach_m)


def _reached_at_once(moves: Moves, begins_m: FloatArray, ends_m: FloatArray) -> BoolArray:
    """Return which moves are reached where they begin. (n,)"""
    parameters = moves.parameters
    way = moves.target_m - begins_m
    near = (horizontal(way) <= moves.reach_m + np.roll(moves.reach_m, 1)) & (
        np.abs(way[:, 2]) <= 2.0 * parameters.altitude_acceptance_m
    )
    reached = np.zeros(len(way), dtype=np.bool_)
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
            np.hypot(off[0], off[1]) <= moves.reach_m[row] + _ON_THE_EDGE_M
            and abs(off[2]) <= parameters.altitude_acceptance_m + _ON_THE_EDGE_M
        )
    return reached


_UNCHANGED = 0.01
"""Change of a place or speed that is none for what follows. [m, m s⁻¹]"""
_ROUNDS = 99
"""Short legs hand on their speed to the next; each round carries it one leg further, ever less of it."""


class Handed(Columns, eq=False):
    """What moves hand on to those after them, as columns of length n."""

    place_m: FloatArray
    """(n, 3) [m]"""
    velocity_m_s: FloatArray
    """(n, 3) [m s⁻¹]"""
    slowing_m_s2: FloatArray
    """Deceleration, zero or more. (n,) [m s⁻²]"""

    def is_moved(self, other: Handed) -> BoolArray:
        """Return which places or velocities are others than those of the same rows. (n,)"""
        moved = greatest(np.abs(self.place_m - other.place_m))
        sped = greatest(np.abs(self.velocity_m_s - other.velocity_m_s))
        return np.asarray(np.maximum(moved, sped) > _UNCHANGED)


class LegStarts(Handed, eq=False):
    """Planned moves with what the moves before hand on to them."""

    planned: PlannedLegs

    @property
    def parameters(self) -> Px4Parameters:
        """Those of the vehicle that flies them."""
        return self.planned.parameters

    @classmethod
    def after(cls, before: IntArray, ends: Handed, planned: PlannedLegs) -> LegStarts:
        """Return moves begun after others, by rows of what these hand on; below 0 flights begin."""
        follows = before >= 0
        return cls(
            planned=planned,
            place_m=np.where(follows[:, None], ends.place_m[before], planned.start_m),
            velocity_m_s=np.where(follows[:, None], ends.velocity_m_s[before], 0.0),
            slowing_m_s2=np.where(follows, ends.slowing_m_s2[before], 0.0),
        )


class Px4Legs(LegStarts, eq=False):
    """Moves as they are flown; of landings only how they begin."""

    turn_s: FloatArray
    """Time of the turn, or of the pause with the braking before it. (n,) [s]"""
    straight_m: FloatArray
    """Where the straight begins. (n, 3) [m]"""
    limits: Limits
    straights: Straights
    end: Handed
    """As the next move begins."""


def fly_legs(moves: Moves, *, waits: BoolArray | bool = True) -> Px4Legs:
    """Return how moves, at least one, are flown, some or all with their waits for headings.

    Notes
    -----
    What waits stops, and is longer underway: the flights of which that is true are flown again.
    """
    legs = _fly_moves(replace(moves, hold_s=moves.hold_s.copy()))  # overwritten below
    flight = np.cumsum(moves.is_first)
    for _ in range(2):
        hold_s = np.maximum(yaw_waits_s(legs) * waits, moves.hold_s)
        again = np.isin(flight, flight[hold_s != legs.planned.hold_s])
        if not again.any():
            break
        legs.put(again, _fly_moves(replace(moves, hold_s=hold_s).select(again)))
    return legs


def _fly_moves(moves: Moves) -> Px4Legs:
    """Return how moves, at least one, are flown.

    Notes
    -----
    A leg is flown alike whatever came before, but for the speed and place it is begun with; only legs
    too short for the speed allowed at their end change those.  So all are flown at once, then those
    after a change again, until nothing changes.
    """
    planned = plan_legs(moves)
    before, guessed = _moves_before(planned), _guessed_ends(planned)
    legs = _flown(LegStarts.after(before, guessed, planned))
    changed = legs.end.is_moved(guessed)
    for _ in range(_ROUNDS):
        active = np.flatnonzero(np.append(changed, False)[before])
        if not len(active):
            break
        begun = LegStarts.after(before[active], legs.end, planned.select(active))
        flown = _flown(begun)
        changed = np.zeros(len(before), dtype=np.bool_)
        changed[active] = flown.end.is_moved(legs.end.select(active))
        legs.put(active, flown)
    return legs


def _moves_before(planned: PlannedLegs) -> IntArray:
    """Return the move flown before each; −1 where a flight begins. (n,)"""
    rows = np.arange(len(planned.item))
    is_flown = planned.is_leg | planned.is_wait | planned.is_landing
    last = np.maximum.accumulate(np.where(is_flown, rows, -1))
    before = np.append(-1, last[:-1])
    first = np.maximum.accumulate(np.where(planned.is_first, rows, 0))
    return np.where((before >= first) & ~planned.is_first, before, -1)


def _guessed_ends(planned: PlannedLegs) -> Handed:
    """Return what is handed on by a vehicle that is never short of way."""
    limits = limits_along(planned.begins_m, planned.target_m, planned)
    end_speed = np.minimum(limits.laws.lowest_allowed_m_s(planned.tail_m), limits.cruise_m_s)
    moving = (planned.is_leg & ~(planned.hold_s > 0.0))[:, None]
    return Handed(
        place_m=np.where(moving, planned.ends_m, planned.target_m),
        velocity_m_s=np.where(moving, planned.direction * end_speed[:, None], 0.0),
        slowing_m_s2=np.zeros_like(end_speed),
    )


def _flown(begun: LegStarts) -> Px4Legs:
    """Return moves as flown, after what those before hand on to them."""
    part = begun.planned
    turns, upright_m_s = slowed_turns(begun, leg_entries(begun))
    slowed = upright_m_s > 0.0
    turns = joined_turns(begun, turns, slowed)
    turns = eased_turns(begun, turns, slowed)
    climbing = part.is_takeoff
    turns.end_m[climbing] = part.takeoffs.place_m[climbing]

    ends = np.where(part.is_leg[:, None], part.ends_m, turns.end_m)
    ends[:, 2] = _end_heights_m(turns.end_m, ends, part)
    way = part.target_m - begun.place_m
    shallow = slowed & (np.abs(way[:, 2]) <= horizontal(way))
    ends = np.where(shallow[:, None], _ends_straight_on_m(turns.end_m, ends, part), ends)
    turns, ends = cut_short(begun, turns, ends)
    limits = limits_along(turns.end_m, ends, part)
    held = climbing & ~part.takeoffs.is_free
    limits.cruise_m_s[held] = part.takeoffs.speed_m_s[held]
    start, acceleration = _starts(limits, turns, begun.velocity_m_s)
    climbed_m_s = quotient(upright_m_s, np.abs(limits.direction[:, 2]), np.inf)
    start = np.where(slowed, np.minimum(climbed_m_s, limits.cruise_m_s), start)
    start[climbing], acceleration[climbing] = part.takeoffs.speed_m_s[climbing], 0.0
    moving = np.flatnonzero(limits.length_m > STILL_M)
    straights = Straights.unmoved(limits, start)
    if len(moving):
        flown_straights = fly_straights(
            limits.select(moving), start_m_s=start[moving], acceleration_m_s2=acceleration[moving]
        )
        straights.put(moving, flown_straights)
    flown = Px4Legs(
        **field_values(begun),
        turn_s=turns.duration_s,
        straight_m=turns.end_m,
        limits=limits,
        straights=straights,
        end=begun,
    )
    end_m, end_m_s = ends_of_moves(flown)
    slowing_m_s2 = slowing_at_ends_m_s2(flown)
    end = Handed(place_m=end_m, velocity_m_s=end_m_s, slowing_m_s2=slowing_m_s2)
    return replace(flown, end=end)


def _end_heights_m(place_m: FloatArray, ends_m: FloatArray, planned: PlannedLegs) -> FloatArray:
    """Return the heights at which legs end that are straight from places. (n,) [m]

    A height that counts as reached already comes closer as the target does, or dies away at j/2a as the
    braking law has it, in the least time the way takes, (6 x/j)^(1/3) or x/v: the tail of a climb or descent
    that goes on beyond a level leg does not slow it.
    """
    parameters = planned.parameters
    way, left = planned.target_m - place_m, planned.target_m - ends_m
    near = np.abs(way[:, 2]) <= parameters.altitude_acceptance_m + _ON_THE_EDGE_M
    near &= planned.is_leg & ~planned.is_takeoff & (planned.direction[:, 2] == 0.0)
    flown_m = np.maximum(horizontal(way) - horizontal(left), 0.0)
    _, vertical = vertical_limits(way[:, 2] > 0.0, parameters)
    jerk = parameters.jerk_m_s3
    least_s = np.maximum(np.cbrt(6.0 * flown_m / jerk), flown_m / planned.speed_m_s)
    part = np.minimum(quotient(horizontal(left), horizontal(way)), 1.0)
    sloped = planned.is_leg & ~planned.is_takeoff & (planned.direction[:, 2] != 0.0)
    sloped &= np.abs(way[:, 2] * part) <= parameters.altitude_acceptance_m
    sloped &= (np.abs(way[:, 2]) <= horizontal(way)) & (horizontal(left) > STILL_M)
    dying = np.minimum(part, np.exp(-0.5 * jerk / vertical * least_s))
    part = np.where(near, dying, part)
    return np.where(near | sloped, planned.target_m[:, 2] - way[:, 2] * part, ends_m[:, 2])


def _ends_straight_on_m(
    place_m: FloatArray, ends_m: FloatArray, planned: PlannedLegs
) -> FloatArray:
    """Return where heights count as reached on the way to targets straight from places. (n, 3) [m]"""
    left = planned.target_m - place_m
    part = quotient((planned.target_m - ends_m)[:, 2], left[:, 2])
    is_ahead = (part > 0.0) & (part < 1.0)
    return np.where(is_ahead[:, None], planned.target_m - left * part[:, None], ends_m)


def _starts(
    limits: Limits, turns: Turns, velocity_m_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return speed and acceleration along straights where these begin."""
    level = horizontal(limits.direction)
    shallow = level >= np.abs(limits.direction[:, 2])
    scale = np.where(shallow & (level > 0.0), level, 1.0)
    projected = np.maximum(dot(velocity_m_s, limits.direction), 0.0)
    start = np.where(shallow, turns.speed_m_s / scale, projected)
    turned = ~shallow & (horizontal(velocity_m_s) > SLOWEST_TURN_M_S)
    return start, np.where(turned, 0.0, turns.acceleration_m_s2 / scale)


def flight_times_s(legs: Px4Legs) -> FloatArray:
    """Return the times from the beginning of moves to their arrival. (n,) [s]"""
    limits, rise, braking = legs.limits, legs.straights.rise, legs.straights.braking
    end, joined = braking.end_m_s, braking.joined_m_s
    brakes = (end > 0.0) & (joined > end)
    braking_s = braking_time_s(
        np.where(brakes, joined, 1.0),
        np.where(brakes, end, 1.0),
        braking.far.acceleration_m_s2,
        braking.far.half_b_m_s,
    )
    total = (
        legs.turn_s
        + rise.ramps(limits).duration_s
        - rise.begun_s
        + quotient(legs.straights.cruise_m, rise.peak_m_s)
        + braking.onset_s
        + braking.steady_s
        + np.where(brakes, braking_s, 0.0)
    )
    return np.where(legs.planned.is_leg & (limits.length_m > 0.0), total, 0.0)
