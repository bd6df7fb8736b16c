"""Stages as columns of legs, each beginning and ending at rest: what reference steps are made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.state import STATE_INDEX, FlightState
from planner.frozen import frozen
from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.mission.stage import Stage

_LANDINGS = frozenset({StageKind.LAND, StageKind.RETURN})


@frozen(eq=False)
class Legs:
    """Stages as columns, one row per stage; each begins and ends standing still."""

    item: IntArray
    """What the segments of each stage are counted under. (n,)"""
    start_m: FloatArray
    """East, north, height above home. (n, 3) [m]"""
    end_m: FloatArray
    speed_m_s: FloatArray
    hold_s: FloatArray
    centre_m: FloatArray
    """Centre of the circle to fly about, east and north. (n, 2) [m]"""
    circle_m: FloatArray
    """Radius of the circle to fly about, negative for counter-clockwise; 0 for none. (n,) [m]"""
    turns: FloatArray
    climb_state: IntArray
    descent_state: IntArray
    rows: IntArray
    """First and last row that serve each stage of the route. (stages, 2)"""

    @classmethod
    def of(cls, stages: Sequence[Stage], *, default_speed_m_s: float) -> Legs:
        """Return the stages of a route, each beginning where the one before ends.

        Setting down a load takes two rows: down to the level of home, and back up.
        """
        flown = [s for s in stages for _ in range(1 + (s.kind is StageKind.SET_DOWN))]
        end = np.array([(s.east_m, s.north_m, s.height_m) for s in flown])
        last = np.cumsum([1 + (s.kind is StageKind.SET_DOWN) for s in stages]) - 1
        first = np.concatenate(([0], last[:-1] + 1))
        end[first[last > first], 2] = 0.0
        centre = end[:, :2].copy()
        circling = [row for row, s in enumerate(flown) if s.kind is StageKind.CIRCLE]
        for row in circling:
            end[row, :2] = _edge_m(end[row, :2], end[row - 1, :2], abs(flown[row].radius_m))
        landing = np.array([s.kind in _LANDINGS for s in flown])
        takeoff = np.array([s.kind is StageKind.TAKEOFF for s in flown])
        return cls(
            item=np.array([s.item for s in flown]),
            start_m=np.vstack((np.zeros((1, 3)), end[:-1])),
            end_m=end,
            speed_m_s=np.array(
                [default_speed_m_s if s.speed_m_s is None else s.speed_m_s for s in flown]
            ),
            hold_s=np.array([s.hold_s for s in flown]),
            centre_m=centre,
            circle_m=np.array([s.radius_m for s in flown]),
            turns=np.array([s.turns if s.radius_m else 0.0 for s in flown]),
            climb_state=np.where(
                takeoff, STATE_INDEX[FlightState.TAKEOFF], STATE_INDEX[FlightState.CLIMB]
            ),
            descent_state=np.where(
                landing, STATE_INDEX[FlightState.LAND], STATE_INDEX[FlightState.DESCEND]
            ),
            rows=np.column_stack((first, last)),
        )

    @classmethod
    def home_from(cls, points_m: FloatArray, home_m: FloatArray, *, speed_m_s: float) -> Legs:
        """Return level legs from many points (n, 3) to home (n, 3), and landings, each on its own."""
        count = len(points_m)
        rows = np.arange(count)
        return cls(
            item=rows,
            start_m=points_m,
            end_m=np.array(home_m, np.float64),
            speed_m_s=np.full(count, speed_m_s),
            hold_s=np.zeros(count),
            centre_m=np.array(home_m[:, :2], np.float64),
            circle_m=np.zeros(count),
            turns=np.zeros(count),
            climb_state=np.full(count, STATE_INDEX[FlightState.CLIMB]),
            descent_state=np.full(count, STATE_INDEX[FlightState.LAND]),
            rows=np.column_stack((rows, rows)),
        )


def _edge_m(centre_m: FloatArray, from_m: FloatArray, radius_m: float) -> FloatArray:
    """Return the point of a circle that is nearest to where the vehicle comes from."""
    away = from_m - centre_m
    distance = float(np.hypot(*away))
    direction = away / distance if distance > 0.0 else np.array([1.0, 0.0])
    return centre_m + radius_m * direction
