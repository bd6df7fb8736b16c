"""Layout: moves laid out between their waypoints, before anything is known of speeds handed on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.columns import Columns
from planner.flight.motion.px4.headings import pauses_s
from planner.flight.motion.px4.speeds import STILL_M
from planner.flight.motion.px4.vertices import final_speeds_m_s
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.moves import Moves
    from planner.vehicle.parameters.px4 import Px4Parameters


_ON_THE_EDGE_M = 1e-6
"""Rounding by which a place on the edge of an acceptance radius may be outside. [m]"""


@frozen(eq=False)
class Layout(Columns):
    """Moves laid out between their waypoints, before anything is known of speeds handed on."""

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


def lay_out(moves: Moves, parameters: Px4Parameters) -> Layout:
    """Return moves laid out between their waypoints: corner speeds, waits for headings, order."""
    begins = moves.begins_m
    way = moves.target_m - begins
    way = np.where(np.abs(way) < STILL_M, 0.0, way)
    length = np.sqrt((way**2).sum(axis=1))
    direction = np.divide(way, length[:, None], out=np.zeros_like(way), where=length[:, None] > 0.0)
    band = _height_bands_m(moves, way[:, 2], parameters)
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
    return Layout(
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


def _height_bands_m(moves: Moves, climb_m: FloatArray, parameters: Px4Parameters) -> FloatArray:
    """Return the heights from the target within which it counts as reached. (n,) [m]

    NAV_MC_ALT_RAD; half the height of a take-off lower than that
    (``MissionBlock::is_mission_item_reached``).
    """
    band = np.full(len(moves), parameters.altitude_acceptance_m)
    low = moves.is_takeoff & (climb_m > 0.0) & (climb_m < band)
    return np.where(low, 0.5 * climb_m, band)


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
