"""Joins: how legs that need no turn, or are too steep or too short for one, follow on each other."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import (
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
    Px4Ramps,
    allowed_speed_m_s,
    ramp_time_s,
    stopped_m,
    turning_back,
    vertical_limits,
)
from planner.flight.motion.px4.moves import ALIGNED_COS, SLOWEST_TURN_M_S, directions
from planner.flight.motion.px4.straights import limits_along, make_rises
from planner.flight.motion.px4.turns import PEAK_OVER_MEAN, Turns, corner_turns
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.flight.motion.px4.legs import LegStarts


_SHORTEST_JOIN_S = 0.1
"""Changes of velocity that take less are taken at once: 0.01 m/s. [s]"""
_SHORTEST_EASE_S = 0.02
"""Decelerations taken back in less change the speed by less than a millimetre a second. [s]"""
_NEARLY_STRAIGHT = 2.0 * ALIGNED_COS**2 - 1.0
"""Cosine of twice the angle at which a turn counts as done: a turn by less is little more than a join."""
_MOSTLY = 0.999
"""Part of a velocity along a leg that is all of it: 2.6°. [-]"""
_LONGEST_JOIN = 0.5
"""Part of a leg beyond which it is too short to be joined at its speed. [-]"""
_LONGEST_SLOW_JOIN = 0.9
"""The same of joins at less than that. [-]"""
_LEAST_FRACTION = 0.1
"""Of the speed, below which a leg is joined at once. [-]"""


_HALVINGS = 10
"""Of a range of speeds, to a thousandth of it."""
_GROWTH_ROUNDS = 2
"""Each lets the time of a join and the speed reached in it agree more closely."""


def leg_entries(begun: LegStarts) -> Turns:
    """Return the turns onto moves; where a heading is waited for, the braking and the wait."""
    turns, part = corner_turns(begun), begun.planned
    idle, pausing = part.is_takeoff | ~part.is_leg, part.pause_s > 0.0
    still = rows_of(idle | pausing)
    if len(still):
        place = begun.place_m[still]
        rest_m, braking_s = stopped_m(place, begun.velocity_m_s[still], begun.parameters)
        braking_s = np.where(idle[still], 0.0, braking_s)
        turns.end_m[still] = np.where(idle[still, None], place, rest_m)
        waited_s = np.where(idle[still], 0.0, part.pause_s[still])
        turns.duration_s[still] = np.maximum(waited_s, braking_s)
        turns.speed_m_s[still] = turns.acceleration_m_s2[still] = 0.0
    return turns


def slow_turns(begun: LegStarts, turns: Turns) -> FloatArray:
    """Overwrite turns onto legs too steep for the speed they are begun with.

    Return the vertical speeds reached in them.

    Without a turn, the horizontal speed falls to what the vertical limit leaves, or to that of the leg,
    while the vertical one comes to what goes with it, both in the time of the slower; or to less, where
    the leg is too low for that (`_reached_m_s`).  So it does on legs that climb more than they are long,
    or within the acceptance radius, where the height alone is waited for.  Of all other legs the vertical
    speed is 0. [m s⁻¹]
    """
    parameters = begun.parameters
    part, place, velocity = begun.planned, begun.place_m, begun.velocity_m_s
    way = part.target_m - place
    level, height, upward = horizontal(way), np.abs(way[:, 2]), np.sign(way[:, 2])
    limit, vertical = vertical_limits(way[:, 2] > 0.0, parameters)
    left = quotient(limit * level, height, np.inf, above=STILL_M)
    slows = part.is_leg & ~part.is_takeoff & (turns.duration_s == 0.0) & (part.pause_s == 0.0)
    # Within the acceptance radius, as over the waypoint before.
    near = (level < part.reach_m + STILL_M) | (horizontal(part.target_m - part.begins_m) < STILL_M)
    near &= height > parameters.altitude_acceptance_m
    steep = ((height > level) | near) & (horizontal(velocity) > SLOWEST_TURN_M_S)
    slows &= (left < turns.speed_m_s) | steep
    if slows.any():
        sight = _Sight.of(begun, directions(way)[0], turns.speed_m_s, turns.speed_m_s)
        slows &= ~sight.counts | near
    upright_m_s = np.zeros_like(height)
    rows = rows_of(slows)
    if not len(rows):
        return upright_m_s
    level, height, upward = level[rows], height[rows], upward[rows]
    limit, vertical, velocity = limit[rows], vertical[rows], velocity[rows]
    first_m_s, climbing = turns.speed_m_s[rows], np.minimum(upward * velocity[:, 2], limit)
    after = np.minimum(left, part.speed_m_s)[rows]
    whole = np.minimum(limit, quotient(after * height, level, limit, above=STILL_M))
    reached = _reached_m_s(
        height,
        climbing,
        whole,
        part.final_upright_m_s[rows],
        acceleration_m_s2=vertical,
        jerk_m_s3=parameters.jerk_m_s3,
    )
    upright_m_s[rows] = reached
    after = np.minimum(after * quotient(reached, whole), first_m_s)
    time = np.maximum(
        ramp_time_s(first_m_s - after, parameters.acceleration_m_s2, parameters.jerk_m_s3),
        ramp_time_s(np.abs(reached - climbing), vertical, parameters.jerk_m_s3),
    )
    speed = horizontal(velocity)
    along = velocity / np.where(speed > 0.0, speed, 1.0)[:, None]
    end = place[rows] + along * (0.5 * (first_m_s + after) * time)[:, None]
    end[:, 2] = place[rows, 2] + upward * 0.5 * (climbing + reached) * time
    turns.put(
        rows,
        Turns(duration_s=time, end_m=end, speed_m_s=after, acceleration_m_s2=np.zeros_like(time)),
    )
    return upright_m_s


def _reached_m_s(
    height_m: FloatArray,
    begun_m_s: FloatArray,
    limit_m_s: FloatArray,
    final_m_s: FloatArray,
    *,
    acceleration_m_s2: FloatArray,
    jerk_m_s3: float,
) -> FloatArray:
    """Return the vertical speeds that climbs and descents of heights grow to. (n,) [m s⁻¹]

    Their acceleration falls from where it would lead to more than the way left allows
    (``VelocitySmoothing``): the speed it leads to is that allowed there, and more than allowed where it is
    reached.
    """
    least, most = np.minimum(begun_m_s, limit_m_s), limit_m_s
    for _ in range(_HALVINGS):
        middle = 0.5 * (least + most)
        ramps = Px4Ramps.of(
            np.maximum(middle - begun_m_s, 0.0), acceleration_m_s2, np.full_like(middle, jerk_m_s3)
        )
        growing_s = ramps.jerk_s + ramps.steady_s
        way = begun_m_s * growing_s + ramps.gained(growing_s)[0]
        left_m = np.maximum(height_m - way, 0.0)
        allowed = allowed_speed_m_s(left_m, final_m_s, acceleration_m_s2, jerk_m_s3)
        is_allowed = middle < allowed
        least, most = np.where(is_allowed, middle, least), np.where(is_allowed, most, middle)
    return np.asarray(most)


def join_turns(
    begun: LegStarts,
    turns: Turns,
    slowed: BoolArray,
    *,
    fraction: float = 1.0,
    reached_m_s: FloatArray | None = None,
    rounds: int = _GROWTH_ROUNDS,
) -> None:
    """Overwrite turns by which legs that need none are joined: nothing changes its velocity at once.

    What is across the new leg, up to 11.5° of the velocity and what is left of a climb, dies away at
    limited jerk, each axis in the time of the slowest, while the speed along the leg begins to grow.
    A climb that becomes a descent is one change of speed (``VelocitySmoothing::computeDirection``): it
    joins the leg at rest, with the acceleration it has by then.  Legs too short for that are joined at a
    fraction of the speed.
    """
    parameters, part = begun.parameters, begun.planned
    place, velocity = begun.place_m, begun.velocity_m_s
    direction, length = directions(part.ends_m - place)
    sight = _Sight.of(
        begun, direction, turns.speed_m_s, turns.speed_m_s if reached_m_s is None else reached_m_s
    )
    direction, level_m_s = sight.direction, np.minimum(turns.speed_m_s, sight.speed_m_s)
    level, upright = horizontal(direction), np.abs(direction[:, 2])
    shallow = level >= upright
    projected = np.maximum(dot(velocity, direction), 0.0)
    speed = fraction * np.where(shallow, level_m_s / np.where(level > 0.0, level, 1.0), projected)
    aside = velocity - direction * speed[:, None]
    _, vertical = vertical_limits(direction[:, 2] > 0.0, parameters)
    acceleration, jerk = parameters.acceleration_m_s2, parameters.jerk_m_s3
    level_s = ramp_time_s(greatest(np.abs(aside[:, :2])), acceleration, jerk)
    lift = np.where(
        shallow & (fraction == 1.0),
        direction[:, 2] * quotient(np.maximum(sight.speed_m_s, level_m_s), level) - velocity[:, 2],
        aside[:, 2],
    )
    lift_s = ramp_time_s(np.abs(lift), vertical, jerk)
    time = np.maximum(level_s, lift_s)
    straight = (turns.duration_s == 0.0) | (
        (turns.duration_s < time) & (projected > _NEARLY_STRAIGHT * lengths(velocity))
    )
    straight &= (time > _SHORTEST_JOIN_S) & (length > 0.0)
    joins = part.is_leg & ~part.is_takeoff & straight & ~slowed & (part.pause_s == 0.0)
    if not joins.any():
        return
    along_m, after, gained_m_s2 = speed * time, speed.copy(), np.zeros_like(speed)
    rows = rows_of(joins & shallow & (fraction == 1.0))
    if len(rows):
        # A turn holds the whole speed, of which only a part leads along the leg as it begins.
        turned_m_s = quotient(horizontal(velocity), level) * (turns.duration_s > 0.0)
        along_m[rows], after[rows], gained_m_s2[rows] = _headway(
            begun.select(rows),
            (direction * length[:, None])[rows],
            speed_m_s=speed[rows],
            time_s=time[rows],
            held_m_s=np.maximum(speed, turned_m_s)[rows],
            held_s=np.minimum(turns.duration_s, time)[rows],
            is_paced=(lift_s > level_s)[rows],
        )
    end = place + direction * along_m[:, None] + 0.5 * aside * time[:, None]
    # A height that changes its way leaves the speed along the leg as it is.
    lifts = shallow & (lift_s > level_s)
    longest = np.where(lifts | (fraction < 1.0), _LONGEST_SLOW_JOIN, _LONGEST_JOIN)
    fits = (speed * time < longest * length) & (along_m < _LONGEST_SLOW_JOIN * length)
    left_m_s2 = np.where(shallow, gained_m_s2 * level, turns.acceleration_m_s2)
    backward = -dot(velocity, direction)
    back = rows_of(joins & ~shallow & (backward > _MOSTLY * lengths(velocity)))
    if len(back):
        back_m, time[back] = turning_back(backward[back], vertical[back], jerk)
        end[back] = place[back] - direction[back] * back_m[:, None]
        left_m_s2[back] = np.minimum(vertical[back], np.sqrt(2.0 * jerk * backward[back]))
        fits[back] = True
    left_m_s = np.where(shallow, after * level, turns.speed_m_s)
    # A climb that grows with the speed along the leg takes the longer to change.
    grows = fits & lifts & sight.counts & (after > speed) & (rounds > 0) & (fraction == 1.0)
    rows = rows_of(joins & fits & ~grows)
    joined = Turns(
        duration_s=time[rows],
        end_m=end[rows],
        speed_m_s=left_m_s[rows],
        acceleration_m_s2=left_m_s2[rows],
    )
    turns.put(rows, joined)
    growing, short = (
        rows_of(joins & some) for some in (grows, ~fits & (fraction > _LEAST_FRACTION))
    )
    faster = partial(join_turns, reached_m_s=left_m_s[growing], rounds=rounds - 1)
    slower = partial(join_turns, fraction=0.5 * fraction)
    for rows, join in ((growing, faster), (short, slower)):
        if len(rows):
            again = turns.select(rows)
            join(begun.select(rows), again, slowed[rows])
            turns.put(rows, again)


def _headway(
    begun: LegStarts,
    way_m: FloatArray,
    *,
    speed_m_s: FloatArray,
    time_s: FloatArray,
    held_m_s: FloatArray,
    held_s: FloatArray,
    is_paced: BoolArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how far along themselves legs get in the times of joins, and speed and acceleration there.

    (n,) each, for the ways to their ends, (n, 3), begun with speeds along them.  What is across a leg changes
    beside what is along it: there a deceleration that the leg is begun with is taken back, and the speed goes
    on as on a leg that needs no join, once a turn is over that holds it.  ``is_paced`` is where a climb takes
    longer than what is level: it sets the time of all axes.
    """
    part, place, jerk = begun.planned, begun.place_m, begun.parameters.jerk_m_s3
    speed, time, units = held_m_s, time_s, directions(way_m)[0]
    slowing = np.minimum(begun.slowing_m_s2, np.sqrt(2.0 * jerk * speed))
    slowing = np.minimum(slowing, jerk * time)
    slowed_s = slowing / jerk
    slowed_m = slowed_s * (speed - slowing * slowed_s / 3.0)
    begun_m_s = speed - 0.5 * slowing * slowed_s
    slowed_m += begun_m_s * np.maximum(held_s - slowed_s, 0.0)
    slowed_s = np.maximum(slowed_s, held_s)
    limits = limits_along(place + units * slowed_m[:, None], place + way_m, part)
    rises = make_rises(limits, begun_m_s, np.zeros_like(begun_m_s))
    ramps, left_s = rises.ramps(limits), time - slowed_s
    ramp_s = np.minimum(left_s, ramps.duration_s)
    grown_m, grown_m_s, grown_m_s2 = ramps.gained(ramp_s)
    faster = np.sign(rises.peak_m_s - begun_m_s)
    reached = begun_m_s + faster * grown_m_s
    far = slowed_m + begun_m_s * ramp_s + faster * grown_m
    length = lengths(way_m) + part.tail_m
    # From the top of the ramp on it keeps its speed until the way left allows no more.
    kept_m = np.maximum(length - far - limits.laws.reach_m(reached), 0.0)
    kept_s = np.minimum(left_s - ramp_s, quotient(kept_m, reached))
    far, braked_s, last = far + kept_s * reached, left_s - ramp_s - kept_s, reached
    evenly = is_paced & (faster > 0.0) & (ramp_s < left_s)
    far, braked_s = np.where(evenly, slowed_m, far), np.where(evenly, left_s, braked_s)
    before = np.where(evenly, begun_m_s, reached)
    for _ in range(3):
        braked_m = 0.5 * (before + last) * braked_s
        left_m = np.maximum(length - far - braked_m, part.tail_m)
        last = limits.laws.lowest_allowed_m_s(left_m)
        last = np.minimum(last, reached)
    # With what is across, which is half of it in the mean, it is flown as one cubic of time.
    velocity, level = begun.velocity_m_s[:, :2], horizontal(units)
    along = units[:, :2] / level[:, None]
    first = dot(velocity, along)
    # A climb that allows less than the leg is begun with slows it no sooner than it can brake.
    least = first / level - limits.ramp_m_s2 * time
    last = np.maximum(np.where(braked_s > 0.0, last, reached), least)
    dying = 0.5 * (first - speed_m_s * level)
    mean = _cubic_mean_m_s(
        (far + braked_m) / time * level + dying,
        first,
        last * level,
        horizontal(velocity - along * first[:, None]),
        most_m_s=np.maximum(limits.cruise_m_s * level, horizontal(velocity)),
        change_m_s=limits.ramp_m_s2 * level * time,
    )
    gained_m_s2 = np.where((ramp_s < left_s) | (faster < 0.0), 0.0, grown_m_s2)
    return (mean - dying) * time / level, last, gained_m_s2


def _cubic_mean_m_s(
    wanted_m_s: FloatArray,
    first_m_s: FloatArray,
    last_m_s: FloatArray,
    aside_m_s: FloatArray,
    *,
    most_m_s: FloatArray,
    change_m_s: FloatArray,
) -> FloatArray:
    """Return the mean horizontal speed nearest to one wanted with which a cubic keeps to its limits.

    Its velocity is a parabola within the triangle v₀, 3 m − v₀ − v₁, v₁ (Bézier), of which half of what
    is aside is left in the middle.  Its acceleration at the ends is (6 m − 4 v₀ − 2 v₁)/T and
    (2 v₀ + 4 v₁ − 6 m)/T.
    """
    corner = np.sqrt(np.maximum(most_m_s**2 - (0.5 * aside_m_s) ** 2, 0.0))
    ends = 4.0 * first_m_s + 2.0 * last_m_s, 2.0 * first_m_s + 4.0 * last_m_s
    least = (np.maximum(*ends) - change_m_s) / 6.0
    most = (np.minimum(*ends) + change_m_s) / 6.0
    most = np.minimum(np.maximum(most, least), (corner + first_m_s + last_m_s) / 3.0)
    return np.asarray(np.minimum(np.maximum(wanted_m_s, least), most))


class _Sight(Value, eq=False):
    """Directions to targets as they are seen once a climb has changed."""

    direction: FloatArray
    """(n, 3)"""
    speed_m_s: FloatArray
    """Horizontal speed that leads there, no more than asked for. [m s⁻¹]"""
    counts: BoolArray
    """Where a climb changes on a leg that goes farther than it climbs or descends."""

    @classmethod
    def of(
        cls, begun: LegStarts, direction: FloatArray, begun_m_s: FloatArray, after_m_s: FloatArray
    ) -> _Sight:
        """Return the sights for horizontal speeds at the beginning and at the end of the change.

        PX4 points the velocity at the target from where its trajectory is.  In a time t, from the speed
        v₀ to v, the height goes on by (w₀ + w) t/2; what is left of it and of the way L then gives the
        climb, w = v (h − w₀ t/2)/(L − v₀ t/2), and the change from w₀ to w the time.  Where w is beyond
        its limit, v falls to what goes with that.
        """
        counts = (horizontal(direction) > np.abs(direction[:, 2])) & (begun_m_s > SLOWEST_TURN_M_S)
        # The tail of a climb on a level leg dies away by itself.
        counts &= begun.planned.is_leg & (begun.planned.direction[:, 2] != 0.0)
        if not counts.any():
            return cls(direction=direction, speed_m_s=after_m_s, counts=counts)
        parameters = begun.parameters
        climbing_m_s = begun.velocity_m_s[:, 2]
        way = begun.planned.target_m - begun.place_m
        level, height = horizontal(way), way[:, 2]
        along = quotient(direction[:, :2], horizontal(direction)[:, None])
        limit, vertical = vertical_limits(height > 0.0, parameters)
        climb = after_m_s * quotient(height, level, above=STILL_M)
        for _ in range(4):
            time_s = ramp_time_s(
                np.abs(clipped(climb, -limit, limit) - climbing_m_s), vertical, parameters.jerk_m_s3
            )
            left = np.maximum(level - 0.5 * begun_m_s * time_s, 0.25 * level)
            slope = quotient(height - 0.5 * climbing_m_s * time_s, left, above=STILL_M)
            climb = after_m_s * slope
        speed = np.minimum(after_m_s, quotient(limit, np.abs(slope), np.inf))
        climb = speed * slope
        counts &= np.abs(climb) < speed
        seen, _ = directions(np.column_stack((along * speed[:, None], climb)))
        return cls(
            direction=np.where(counts[:, None], seen, direction),
            speed_m_s=np.where(counts, speed, after_m_s),
            counts=counts,
        )


def ease_turns(begun: LegStarts, turns: Turns, slowed: BoolArray) -> None:
    """Overwrite turns by which legs that go straight on take back the deceleration they are begun with.

    The waypoint counts as reached while the vehicle brakes for it: a waypoint after it at once allows
    more, but the deceleration falls at limited jerk, and the speed with it until it has gone.
    """
    part, velocity = begun.planned, begun.velocity_m_s
    speed, jerk = lengths(velocity), begun.parameters.jerk_m_s3
    direction, _ = directions(part.ends_m - begun.place_m)
    eases = part.is_leg & ~part.is_takeoff & ~slowed & (part.pause_s == 0.0)
    eases &= (turns.duration_s == 0.0) & (dot(velocity, direction) > ALIGNED_COS * speed)
    time = np.minimum(begun.slowing_m_s2, np.sqrt(2.0 * jerk * speed)) / jerk
    rows = rows_of(eases & (time > _SHORTEST_EASE_S))
    if not len(rows):
        return
    time, speed = time[rows], speed[rows]
    way, after = time * (speed - jerk * time**2 / 3.0), speed - 0.5 * jerk * time**2
    heading = velocity[rows] / speed[:, None]
    eased = Turns(
        duration_s=time,
        end_m=begun.place_m[rows] + heading * way[:, None],
        speed_m_s=after * horizontal(heading),
        acceleration_m_s2=np.zeros_like(time),
    )
    turns.put(rows, eased)


def cut_short(begun: LegStarts, turns: Turns, ends_m: FloatArray, is_stepped: BoolArray) -> None:
    """Let turns that are not stepped lead no further than their legs, and no leg end before its turn.

    A turn cut to next to nothing still takes the time to bring the vehicle across to its end, and to
    turn its velocity into the leg.
    """
    parameters = begun.parameters
    part, place = begun.planned, begun.place_m
    goal = dot(ends_m - place, part.direction)
    turned = dot(turns.end_m - place, part.direction)
    flies = part.is_leg & ~part.is_takeoff & ~is_stepped
    passed = rows_of(flies & (goal <= 0.0))
    turns.duration_s[passed] = 0.0
    turns.end_m[passed] = ends_m[passed] = place[passed]
    rows = rows_of(flies & (goal > 0.0) & (turned > goal))
    if not len(rows):
        return
    turns.end_m[rows] = ends_m[rows]
    across = np.abs(ends_m - place)[rows]
    slowest = min(parameters.climb_speed_m_s, parameters.descent_speed_m_s)
    least_s = PEAK_OVER_MEAN * np.maximum(
        horizontal(across) / part.speed_m_s[rows], across[:, 2] / slowest
    )
    velocity, direction = begun.velocity_m_s[rows], part.direction[rows]
    along = np.maximum(dot(velocity, direction), 0.0)
    turned_m_s = np.abs(velocity - direction * along[:, None])
    vertical = min(parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2)
    accelerations = np.array([parameters.acceleration_m_s2] * 2 + [vertical])
    least_s = np.maximum(least_s, greatest(turned_m_s / accelerations))
    cut_s = turns.duration_s[rows] * goal[rows] / turned[rows]
    turns.duration_s[rows] = np.maximum(cut_s, least_s)
