"""Legs: the moves of a flight planned between their waypoints, and flown one after the other."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from planner.flight.motion.kinematics import (
    Columns,
    clipped,
    dot,
    greatest,
    horizontal,
    lengths,
    quotient,
    rows_of,
)
from planner.flight.motion.px4.braking import (
    STILL_M,
    allowed_speed_m_s,
    corner_speed_m_s,
    vertical_limits,
)
from planner.flight.motion.px4.headings import flown_pauses_s, pauses_s, yaw_waits_s
from planner.flight.motion.px4.joins import (
    cut_short,
    ease_turns,
    join_turns,
    leg_entries,
    slow_turns,
)
from planner.flight.motion.px4.landing import (
    Takeoffs,
    ends_of_moves,
    make_takeoffs,
    slowing_at_ends_m_s2,
    takeoff_band_m,
)
from planner.flight.motion.px4.moves import (
    SHORTEST_L1_M,
    SLOWEST_TURN_M_S,
    Moves,
    directions,
    left_m,
)
from planner.flight.motion.px4.straights import Limits, Straights, fly_straights, limits_along
from planner.flight.motion.px4.weaving import Weaves, weave
from planner.values import field_values, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.turns import Turns
    from planner.vehicle.parameters.px4 import Px4Parameters


ColumnT = TypeVar("ColumnT", "FloatArray", "BoolArray")
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
    if not follows.any():
        return np.zeros(count), np.zeros(count)
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


def _back_m_s(moves: Moves, direction: FloatArray, swings: BoolArray) -> FloatArray:
    """Return the horizontal speeds at which targets are to be passed from beyond, back and then on. (n,)"""
    back_m_s = np.zeros(len(swings))
    rows = rows_of(swings)
    if len(rows):
        p, way = moves.parameters, (moves.target_m[rows + 1] - moves.target_m[rows])[:, :2]
        corner = corner_speed_m_s(
            _cosine(-direction[rows, :2], way),
            moves.radius_m[rows],
            gain_per_s=p.trajectory_gain_per_s,
            acceleration_m_s2=p.acceleration_m_s2,
        )
        leaving = allowed_speed_m_s(horizontal(way), 0.0, p.acceleration_m_s2, p.jerk_m_s3)
        back_m_s[rows] = np.minimum(np.minimum(corner, leaving), moves.speed_m_s[rows])
    return back_m_s


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
        clipped(cosine, -1.0, 1.0),
        acceleration * parameters.altitude_acceptance_m,
        gain_per_s=1.0,
        acceleration_m_s2=1.0,
    )
    return np.where(np.abs(rise) > _SAME_PLACE_M, np.minimum(speed, limit), 0.0)


LEAST_REACH = 0.25
"""Of the distance at which a place counts as reached, what is left of it by a lag. [-]"""
_SWINGS_S = 0.5
"""Wait over a waypoint that is to be passed, after which it swings past it. [s]"""
_ON_THE_EDGE_M = 1e-6
"""Rounding by which a place on the edge of an acceptance radius may be outside. [m]"""


class PlannedLegs(Columns, eq=False):
    """Moves planned between their waypoints, before anything is known of speeds handed on."""

    parameters: Px4Parameters
    target_m: FloatArray
    """As of `Moves`, like what follows. (n, 3) [m]"""
    speed_m_s: FloatArray
    radius_m: FloatArray
    reach_m: FloatArray
    hold_s: FloatArray
    is_takeoff: BoolArray
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
    before_m_s: FloatArray
    """Horizontal speed at which the place before is to be passed. (n,) [m s⁻¹]"""
    cruise_before_m_s: FloatArray
    """Horizontal speed of the move before. (n,) [m s⁻¹]"""
    pause_s: FloatArray
    """Wait before the move begins, for the heading. (n,) [s]"""
    is_leg: BoolArray
    """Flown from place to place: no landing, and not reached as soon as it begins."""
    is_wait: BoolArray
    """Nothing but a wait."""
    circles: BoolArray
    stands: BoolArray
    """Circles once it has waited for its heading at rest (MPC_YAW_MODE 4)."""
    leaves_circle: BoolArray
    """Follows one that circles; a return begins anew."""
    swings: BoolArray
    """Ends in a wait for the heading to a region of interest at a waypoint that is passed, not stopped at."""
    back_m_s: FloatArray
    """Horizontal speed at its target when that is behind. (n,) [m s⁻¹]"""
    leaves_swing: BoolArray
    """Follows one that does."""
    is_from_ground: BoolArray
    """Of a flight from the ground at home, not of a return."""
    takeoffs: Takeoffs
    """Of the moves that are take-offs; of no meaning for others."""


def plan_legs(
    moves: Moves, pause_s: FloatArray | None = None, stood_m: FloatArray | None = None
) -> PlannedLegs:
    """Return moves planned between their waypoints: corner speeds, waits for headings, order.

    Waits before moves, and where these begin, as far as they are known from a flight; NaN where they are not.
    """
    if stood_m is None:
        stood_m = np.full_like(moves.target_m, np.nan)
    begins = moves.beginnings_m()
    direction, tail = _aims(moves, begins)
    ends = _flown_to_m(moves, direction, tail)
    reached, place = _reached_at_once(moves, begins, ends, stood_m)
    for _ in range(1 + _longest_run(moves.goes_on) if moves.goes_on.any() else 0):
        before_m = np.where(reached[:, None], place, ends)
        begins = np.where(moves.goes_on[:, None], _of_those_before(before_m), begins)
        direction, tail = _aims(moves, begins)
        ends = _flown_to_m(moves, direction, tail)
    # To a place that counted as reached from afar, not from beside it, it flies straight from where it is.
    before_m = _of_those_before(np.where(reached[:, None], begins, ends))
    is_same = ~(reached | moves.is_first | moves.is_landing | moves.is_takeoff)
    is_same &= (np.abs(moves.target_m - begins) < STILL_M).all(axis=1)
    is_same &= horizontal(moves.target_m - before_m) > 2.0 * moves.reach_m
    if is_same.any():
        begins = np.where(is_same[:, None], before_m, begins)
        direction, tail = _aims(moves, begins)
    is_leg = ~reached & ~moves.is_landing
    afar_m = np.maximum(moves.radius_m, SHORTEST_L1_M)
    is_afar = moves.circles & (horizontal(moves.target_m - place) > afar_m)
    is_wait = reached & ((moves.hold_s > 0.0) | is_afar)
    final_level, final_upright = final_speeds_m_s(moves, direction)
    if pause_s is None:
        turned = np.where((reached & ~(moves.hold_s > 0.0))[:, None], 0.0, direction)
        pause_s = pauses_s(moves, turned)
    swings = moves.looks & is_leg & (moves.hold_s > _SWINGS_S) & (final_level > 0.0)
    return PlannedLegs(
        parameters=moves.parameters,
        target_m=moves.target_m,
        speed_m_s=moves.speed_m_s,
        radius_m=moves.radius_m,
        reach_m=moves.reach_m,
        hold_s=moves.hold_s.copy(),
        is_takeoff=moves.is_takeoff,
        begins_m=begins,
        direction=direction,
        ends_m=moves.target_m - direction * tail[:, None],
        tail_m=tail,
        final_level_m_s=final_level,
        final_upright_m_s=final_upright,
        before_m_s=np.append(0.0, final_level[:-1]),
        cruise_before_m_s=_of_those_before(moves.speed_m_s),
        pause_s=pause_s,
        is_leg=is_leg,
        is_wait=is_wait,
        circles=moves.circles,
        stands=moves.circles & is_wait & (moves.hold_s > 0.0) & (pause_s > 0.0),
        leaves_circle=_of_those_before(moves.circles) & ~moves.is_first & ~moves.is_return,
        swings=swings,
        back_m_s=_back_m_s(moves, direction, swings),
        leaves_swing=np.append(False, swings[:-1]) & ~moves.is_first & is_leg,
        is_from_ground=(moves.start_m == 0.0).all(axis=1),
        takeoffs=_takeoffs(moves, begins),
    )


def _takeoffs(moves: Moves, begins_m: FloatArray) -> Takeoffs:
    """Return the take-offs among moves. (n,)"""
    takeoffs, rows = Takeoffs.none(len(begins_m)), rows_of(moves.is_takeoff)
    if len(rows):
        late_s = moves.late_s[rows]
        made = make_takeoffs(begins_m[rows], moves.target_m[rows], late_s, moves.parameters)
        takeoffs.put(rows, made)
    return takeoffs


def _of_those_before(rows: ColumnT) -> ColumnT:
    """Return rows each in the place of the next, the last in that of the first."""
    return np.concatenate((rows[-1:], rows[:-1]))


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


def _flown_to_m(moves: Moves, direction: FloatArray, tail_m: FloatArray) -> FloatArray:
    """Return where the vehicle is when the next move begins. (n, 3) [m]"""
    left = left_m(moves.parameters, tail_m, moves.speed_m_s, moves.hold_s)
    return np.asarray(moves.target_m - direction * left[:, None])


def _longest_run(is_one: BoolArray) -> int:
    """Return how many that are follow one another."""
    ends = np.flatnonzero(np.append(~is_one, True))
    return int(np.diff(ends, prepend=-1).max()) - 1


def _reached_at_once(
    moves: Moves, begins_m: FloatArray, ends_m: FloatArray, stood_m: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """Return which moves are reached where they begin, as those that are not end, and where. (n,), (n, 3)

    Where it is known that is where the vehicle was; a wait that nothing is known of ends at its place, but
    that of a LOITER_TO_ALT where it began.
    """
    parameters = moves.parameters
    way = moves.target_m - begins_m
    near = (horizontal(way) <= moves.reach_m + _of_those_before(moves.reach_m)) & (
        np.abs(way[:, 2]) <= 2.0 * parameters.altitude_acceptance_m
    )
    reached = np.zeros(len(way), dtype=np.bool_)
    candidates = near & ~moves.is_takeoff & ~moves.is_landing
    place = begins_m.copy()
    for row in rows_of(candidates).tolist():
        if not moves.is_first[row]:
            stays = moves.circles[row - 1] or not moves.hold_s[row - 1] > 0.0
            if math.isfinite(stood_m[row, 0]):
                place[row] = stood_m[row]
            elif reached[row - 1] and stays:
                place[row] = place[row - 1]
            elif not (moves.is_landing[row - 1] or reached[row - 1]):
                place[row] = ends_m[row - 1]
        off = moves.target_m[row] - place[row]
        reached[row] = (
            np.hypot(off[0], off[1]) <= moves.reach_m[row] + _ON_THE_EDGE_M
            and abs(off[2]) <= parameters.altitude_acceptance_m + _ON_THE_EDGE_M
        )
    return reached, place


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
    acceleration_m_s2: FloatArray
    """What stepping ends with; zero of others. (n, 3) [m s⁻²]"""

    def is_moved(self, other: Handed) -> BoolArray:
        """Return which places or velocities are others than those of the same rows. (n,)"""
        moved = greatest(np.abs(self.place_m - other.place_m))
        sped = greatest(np.abs(self.velocity_m_s - other.velocity_m_s))
        return np.asarray(np.maximum(moved, sped) > _UNCHANGED)

    @classmethod
    def after(cls, before: IntArray, ends: Handed, start_m: FloatArray) -> Handed:
        """Return what rows of others hand on; below 0 a flight begins, standing at its start."""
        follows = before >= 0
        return Handed(
            place_m=np.where(follows[:, None], ends.place_m[before], start_m),
            velocity_m_s=np.where(follows[:, None], ends.velocity_m_s[before], 0.0),
            slowing_m_s2=np.where(follows, ends.slowing_m_s2[before], 0.0),
            acceleration_m_s2=np.where(follows[:, None], ends.acceleration_m_s2[before], 0.0),
        )


class LegStarts(Handed, eq=False):
    """Planned moves with what the moves before hand on to them."""

    planned: PlannedLegs

    @property
    def parameters(self) -> Px4Parameters:
        """Those of the vehicle that flies them."""
        return self.planned.parameters

    def at_rest(self, place_m: FloatArray) -> LegStarts:
        """Return them begun standing at other places. (n, 3) [m]"""
        none = np.zeros_like(place_m)
        still = {"velocity_m_s": none, "slowing_m_s2": none[:, 0], "acceleration_m_s2": none}
        return replace(self, place_m=place_m, **still)


class Px4Legs(LegStarts, eq=False):
    """Moves as they are flown; of landings only how they begin."""

    turn_s: FloatArray
    """Time of the turn, or of the pause with the braking before it. (n,) [s]"""
    weaves: Weaves
    straight_m: FloatArray
    """Where the straight begins. (n, 3) [m]"""
    limits: Limits
    straights: Straights
    end: Handed
    """As the next move begins."""


_LOOKING_ROUNDS = 4
"""Rounds of flights that wait to look at a region of interest: they see it from where they wait."""
_SAME_PAUSE_S = 0.01
"""Difference of waits before moves that is none. [s]"""


def fly_legs(moves: Moves, *, waits: BoolArray | bool = True) -> Px4Legs:
    """Return how moves, at least one, are flown, some or all with their waits for headings.

    Notes
    -----
    What waits stops, and is longer underway: the flights of which that is true are flown again.
    """
    legs = _fly_moves(moves)
    flight = moves.is_first.cumsum()
    is_long = moves.looks.any() or moves.circles.any()
    for _ in range(_LOOKING_ROUNDS if is_long else 2):
        turned_s = yaw_waits_s(moves, legs) * waits
        # A return that is there already begins to turn with its wait, and counts that once it has turned.
        is_late = moves.is_return & ~legs.planned.is_leg
        hold_s = np.where(is_late, turned_s + moves.hold_s, np.maximum(turned_s, moves.hold_s))
        pause_s = flown_pauses_s(moves, legs)
        is_other = hold_s != legs.planned.hold_s
        is_other |= np.abs(pause_s - legs.planned.pause_s) > _SAME_PAUSE_S
        held, stood_m = replace(moves, hold_s=hold_s), _stood_m(legs)
        if np.isfinite(stood_m).any():
            is_other |= plan_legs(held, pause_s, stood_m).is_leg != legs.planned.is_leg
        waiting = flight[is_other]
        if not len(waiting):
            break
        again = (np.bincount(waiting, minlength=int(flight[-1]) + 1) > 0)[flight]
        legs.put(again, _fly_moves(held.select(again), pause_s[again], stood_m[again]))
    return legs


def _stood_m(legs: Px4Legs) -> FloatArray:
    """Return where moves begin behind what is not flown straight to its end; NaN for others. (n, 3) [m]"""
    is_known = _of_those_before(legs.weaves.is_stepped | legs.planned.is_wait)
    return np.where(is_known[:, None], legs.place_m, np.nan)


def _fly_moves(
    moves: Moves, pause_s: FloatArray | None = None, stood_m: FloatArray | None = None
) -> Px4Legs:
    """Return how moves, at least one, are flown, with what is known of their beginnings from a flight.

    Notes
    -----
    A leg is flown alike whatever came before, but for the speed and place it is begun with; only legs
    too short for the speed allowed at their end change those.  So all are flown at once, then those
    after a change again, until nothing changes.  A landing ends where it does, however it is begun.
    """
    planned = plan_legs(moves, pause_s, stood_m)
    rows, is_landing = np.arange(len(moves.item)), moves.is_landing
    first = np.maximum.accumulate(np.where(moves.is_first, rows, 0))
    # A flight of its own may begin with moves that are reached at once.
    start_m = moves.start_m[first]
    is_flown = planned.is_leg | planned.is_wait | is_landing
    last = np.maximum.accumulate(np.where(is_flown, rows, -1))
    before = np.append(-1, last[:-1])
    before = np.where((before >= first) & ~moves.is_first, before, -1)
    guessed = _guessed_ends(planned)
    begun = Handed.after(before, guessed, start_m)
    legs = _flown(LegStarts(**field_values(begun), planned=planned))
    changed = legs.end.is_moved(guessed)
    for _ in range(_ROUNDS):
        active = rows_of(changed[before] & (before >= 0))
        begun = Handed.after(before[active], legs.end, start_m[active])
        if is_landing[active].all():
            Handed.put(legs, active, begun)
            break
        flown = _flown(LegStarts(**field_values(begun), planned=planned.select(active)))
        changed = np.zeros(len(before), dtype=np.bool_)
        changed[active] = flown.end.is_moved(legs.end.select(active))
        legs.put(active, flown)
    return legs


def _guessed_ends(planned: PlannedLegs) -> Handed:
    """Return what is handed on by a vehicle that is never short of way."""
    limits = limits_along(planned.begins_m, planned.target_m, planned)
    end_speed = np.minimum(limits.laws.lowest_allowed_m_s(planned.tail_m), limits.cruise_m_s)
    moving = (planned.is_leg & ~(planned.hold_s > 0.0))[:, None]
    return Handed(
        place_m=np.where(moving, planned.ends_m, planned.target_m),
        velocity_m_s=np.where(moving, planned.direction * end_speed[:, None], 0.0),
        slowing_m_s2=np.zeros_like(end_speed),
        acceleration_m_s2=np.zeros_like(planned.target_m),
    )


def _flown(begun: LegStarts) -> Px4Legs:
    """Return moves as flown, after what those before hand on to them."""
    part = begun.planned
    turns = leg_entries(begun)
    upright_m_s = slow_turns(begun, turns)
    slowed = upright_m_s > 0.0
    join_turns(begun, turns, slowed)
    ease_turns(begun, turns, slowed)
    weaves = weave(begun, turns)
    slowed &= ~weaves.is_stepped
    climbing = part.is_takeoff
    turns.end_m[climbing] = part.takeoffs.place_m[climbing]

    ends = np.where(part.is_leg[:, None], part.ends_m, turns.end_m)
    ends[:, 2] = _end_heights_m(turns.end_m, ends, part)
    rows = rows_of(weaves.is_stepped)
    if len(rows):
        ends[rows] = _ends_of_stepped_m(turns.end_m[rows], part.select(rows))
    rows = rows_of(slowed)
    if len(rows):
        way = (part.target_m - begun.place_m)[rows]
        level = rows[np.abs(way[:, 2]) <= horizontal(way)]
        ends[level] = _ends_straight_on_m(turns.end_m[level], ends[level], part.target_m[level])
    cut_short(begun, turns, ends, weaves.is_stepped)
    limits = limits_along(turns.end_m, ends, part)
    held = climbing & ~part.takeoffs.is_free
    limits.cruise_m_s[held] = part.takeoffs.speed_m_s[held]
    start, acceleration = _starts(limits, turns, begun.velocity_m_s)
    along_m_s = quotient(upright_m_s[rows], np.abs(limits.direction[rows, 2]), np.inf)
    start[rows] = np.minimum(along_m_s, limits.cruise_m_s[rows])
    start[climbing], acceleration[climbing] = part.takeoffs.speed_m_s[climbing], 0.0
    moving = rows_of(limits.length_m > STILL_M)
    if len(moving) == len(start):
        straights = fly_straights(limits, start, acceleration)
    else:
        straights, some = Straights.unmoved(limits, start), (start[moving], acceleration[moving])
        if len(moving):
            straights.put(moving, fly_straights(limits.select(moving), *some))
    flown = Px4Legs(
        **field_values(begun),
        turn_s=turns.duration_s,
        weaves=weaves,
        straight_m=turns.end_m,
        limits=limits,
        straights=straights,
        end=begun,
    )
    end_m, end_m_s = ends_of_moves(flown)
    slowing_m_s2 = slowing_at_ends_m_s2(flown)
    ends_so = weaves.is_stepped & (limits.length_m <= STILL_M)
    end = Handed(
        place_m=end_m,
        velocity_m_s=end_m_s,
        slowing_m_s2=slowing_m_s2,
        acceleration_m_s2=np.where(ends_so[:, None], weaves.end_m_s2, 0.0),
    )
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
    place_m: FloatArray, ends_m: FloatArray, target_m: FloatArray
) -> FloatArray:
    """Return where heights count as reached on the way to targets straight from places. (n, 3) [m]"""
    left = target_m - place_m
    part = quotient((target_m - ends_m)[:, 2], left[:, 2])
    is_ahead = (part > 0.0) & (part < 1.0)
    return np.where(is_ahead[:, None], target_m - left * part[:, None], ends_m)


def _ends_of_stepped_m(place_m: FloatArray, planned: PlannedLegs) -> FloatArray:
    """Return where targets count as reached straight from places. (k, 3) [m]"""
    left = planned.target_m - place_m
    parts = (
        quotient(planned.reach_m, horizontal(left), np.inf),
        quotient(planned.parameters.altitude_acceptance_m, np.abs(left[:, 2]), np.inf),
    )
    return np.asarray(planned.target_m - left * np.minimum(np.minimum(*parts), 1.0)[:, None])


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
