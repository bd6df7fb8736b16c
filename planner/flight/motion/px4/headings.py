"""Headings: which way the vehicle looks, and how long it is waited for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.speeds import yaw_time_s

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray
    from planner.flight.motion.px4.moves import Moves
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
