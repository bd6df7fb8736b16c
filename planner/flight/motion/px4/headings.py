"""Headings: where vehicles look as they fly, and how long they wait until they have turned."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import horizontal, quotient
from planner.flight.motion.px4.braking import STILL_M, braking_time_s, stopped_m, yaw_time_s
from planner.flight.motion.px4.looking import Courses, looking_waits_s
from planner.flight.motion.px4.moves import directions

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.flight.motion.px4.legs import Px4Legs
    from planner.flight.motion.px4.moves import Moves
    from planner.vehicle.parameters.px4 import Px4Parameters


_TO_HOME, _FROM_HOME, TURNS_FIRST, _FIXED = 1, 2, 4, 5
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
    turned = ~kept & ~moves.is_landing & ~moves.is_delay & (yaw_mode != _FIXED)
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
    unknown = np.where(about, np.pi, _ANY_TURN_RAD[:1] if np.all(about) else _ANY_TURN_RAD)
    return yaw_time_s(np.where(known, angle, unknown), parameters)


def pauses_s(moves: Moves, direction: FloatArray) -> FloatArray:
    """Return the waits before moves for the heading, as planned: MPC_YAW_MODE 4 turns first. (n,) [s]"""
    parameters = moves.parameters
    if parameters.yaw_mode != TURNS_FIRST:
        return np.zeros(len(direction))
    before = headings_rad(moves, direction, parameters.yaw_mode)[:-1]
    waits, wanted = _pausing(moves, direction)
    return np.where(waits, _turn_times_s(before, wanted, parameters).mean(axis=0), 0.0)


def flown_pauses_s(moves: Moves, legs: Px4Legs) -> FloatArray:
    """Return them as flown: the vehicle turns to the target from where it stands. (n,) [s]

    From where it looks as it arrives; after a LOITER_TO_ALT that it stood at until it looked north, from that
    turn.  Within the acceptance radius of its target it keeps its heading.
    """
    parameters, planned, limits = legs.parameters, legs.planned, legs.limits
    if parameters.yaw_mode != TURNS_FIRST:
        return planned.pause_s
    rest_m, _ = stopped_m(legs.place_m, legs.velocity_m_s, parameters)
    way = planned.target_m - rest_m
    is_far = planned.is_leg & (horizontal(way) > planned.radius_m)
    way[~is_far] = 0.0
    arrives = np.where((is_far & (limits.length_m > STILL_M))[:, None], limits.direction, way)
    before = headings_rad(moves, arrives, parameters.yaw_mode)[:-1]
    waits, wanted = _pausing(moves, way)
    needed = _turn_times_s(before, wanted, parameters).mean(axis=0)
    stood = planned.stands & np.isfinite(before)
    turns_on = np.append(False, stood[:-1]) & ~moves.is_first
    turned_s = np.maximum(_turned_on_s(before, wanted, parameters), 0.0)
    return np.where(waits, np.where(turns_on, turned_s, needed), 0.0)


def _pausing(moves: Moves, way: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Return which moves may wait for their heading, and that, by the ways to where they look. [rad]"""
    along, asked = np.arctan2(way[:, 0], way[:, 1]), ~np.isnan(moves.yaw_rad)
    waits = ((horizontal(way) > 0.0) | asked) & ~moves.is_landing & ~moves.is_delay
    return waits, np.where(asked, moves.yaw_rad, along)


def yaw_waits_s(moves: Moves, legs: Px4Legs) -> FloatArray:
    """Return how long after their arrival waypoints still wait for a heading. (n,) [s]

    That asked for there, and before a landing that of the landing.  Where a heading is not known, the mean
    of all turns; but half a turn to that of home: vehicles are set down looking where they are to fly, and
    come home looking back.
    """
    waits, landing = (of_each.mean(axis=0) for of_each in _waits_s(moves, legs))
    return np.asarray(waits + np.append(landing[1:], 0.0))


def _waits_s(
    moves: Moves, legs: Px4Legs, *, turns_about: bool = True
) -> tuple[FloatArray, FloatArray]:
    """Return the waits for the headings that moves ask for, after waypoints and before landings. [s]

    The heading turns while the vehicle flies to a waypoint, and is waited for where MIS_YAW_TMT is not above
    zero or the item needs it (``MissionBlock::is_mission_item_reached``).  That of a landing turns on the way
    down, but for MPC_YAW_MODE 4: no velocity until it is near (``FlightTaskAuto``: ``_yaw_sp_aligned``).
    Both are (k, n), a row for each turn that is equally likely.
    """
    parameters = moves.parameters
    asked = ~np.isnan(moves.yaw_rad)
    waits_on = moves.needs_heading | (not parameters.yaw_timeout_s > 0.0)
    flown = asked & ~moves.is_landing & waits_on
    landed = asked & moves.is_landing & ~moves.is_first & (parameters.yaw_mode == TURNS_FIRST)
    if not (flown.any() or landed.any()):
        return np.zeros((1, len(asked))), np.zeros((1, len(asked)))
    before = headings_rad(moves, _looks(legs), parameters.yaw_mode)[:-1]
    about = moves.is_return & turns_about
    needed = _turn_times_s(before, moves.yaw_rad, parameters, about=about)
    left_s = _flight_times_s(legs)
    # A turn that began nobody knows where may be gone on with or turned back from.
    still = flown & np.isfinite(before) & (needed[0] > left_s)
    turns_on = np.append(False, still[:-1]) & ~moves.is_first
    needed = np.where(turns_on, _turned_on_s(before, moves.yaw_rad, parameters), needed)
    waits = np.where(flown, np.maximum(needed - left_s, 0.0), 0.0)
    if moves.looks.any() and parameters.yaw_mode != TURNS_FIRST:
        sides = _ANY_TURN_RAD * np.where(np.arange(len(_ANY_TURN_RAD)) % 2, -1.0, 1.0)[:, None]
        begun = np.where(np.isfinite(before), before, np.nan_to_num(moves.yaw_rad) + sides)
        courses = Courses(legs, np.maximum(left_s, legs.turn_s))
        looking = looking_waits_s(moves, courses, begun, flown)
        waits = np.where(moves.looks & ~moves.is_first, looking, waits)
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


def waits_unknown(moves: Moves, legs: Px4Legs) -> tuple[FloatArray, FloatArray]:
    """Return the waits for headings that are as far away as nobody knows. (k, n), (n,) [s]

    A row for each turn that is equally likely, from the least to the greatest; and what is taken for them.
    """
    parameters = moves.parameters
    before = headings_rad(moves, _looks(legs), parameters.yaw_mode)[:-1]
    known = (np.isfinite(before) & np.isfinite(moves.yaw_rad)) | (before == moves.yaw_rad)
    begun = np.where(
        legs.planned.is_leg & ~np.isfinite(before) & (legs.planned.pause_s > 0.0),
        yaw_time_s(_ANY_TURN_RAD, parameters),
        0.0,
    )
    any_turn, taken = (
        np.where(known, 0.0, sum(_waits_s(moves, legs, turns_about=about))) + begun
        for about in (False, True)
    )
    return any_turn, taken.mean(axis=0)


def _looks(legs: Px4Legs) -> FloatArray:
    """Return the directions moves are flown in; of those begun beside their legs to the target. (n, 3)

    Zero of those that are reached at once: nothing turns to what is within the acceptance radius.
    """
    planned = legs.planned
    left_m = planned.target_m - legs.place_m
    looks = np.where(legs.weaves.is_stepped[:, None], directions(left_m)[0], planned.direction)
    is_far = planned.is_leg | (planned.is_wait & (horizontal(left_m) > planned.radius_m))
    return np.where(is_far[:, None], looks, 0.0)


def _flight_times_s(legs: Px4Legs) -> FloatArray:
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
    total = np.where(legs.weaves.is_held | (limits.length_m == 0.0), legs.turn_s, total)
    return np.where(legs.planned.is_leg | legs.weaves.is_held, total, 0.0)
