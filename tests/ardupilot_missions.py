"""Stages for tests of ArduPilot's motion, and what tests read off a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.flight.motion.kinematics import STATES
from planner.mission.route.stage import Stage, StageKind
from planner.vehicle.parameters.ardupilot import ArduPilotParameters

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.flight.motion.kinematics import Motion

DEFAULTS = ArduPilotParameters()


def stage(
    kind: StageKind,
    east_m: float = 0.0,
    north_m: float = 0.0,
    height_m: float = 50.0,
    *,
    speed: float | None = None,
    climb: float | None = None,
    descent: float | None = None,
    hold: float = 0.0,
    turns: float = 0.0,
    radius: float = 0.0,
) -> Stage:
    return Stage(
        kind=kind,
        item=1,
        east_m=east_m,
        north_m=north_m,
        height_m=height_m,
        speed_m_s=speed,
        climb_speed_m_s=climb,
        descent_speed_m_s=descent,
        hold_s=hold,
        turns=turns,
        radius_m=radius,
    )


def takeoff(height_m: float = 50.0) -> Stage:
    return stage(StageKind.TAKEOFF, height_m=height_m)


def go(east_m: float, north_m: float = 0.0, height_m: float = 50.0, *, hold: float = 0.0) -> Stage:
    return stage(StageKind.GO, east_m, north_m, height_m, hold=hold)


def land(east_m: float = 0.0, north_m: float = 0.0) -> Stage:
    return stage(StageKind.LAND, east_m, north_m, 0.0)


def home() -> Stage:
    return stage(StageKind.RETURN, 0.0, 0.0, 0.0)


def fly(*stages: Stage, parameters: ArduPilotParameters = DEFAULTS) -> Motion:
    return fly_ardupilot(stages, parameters)


def took_s(motion: Motion, index: int) -> float:
    """Time from the arrival at one stage to that at the next, ``index``."""
    end = np.concatenate(([0.0], motion.segments.end_s))
    return float(
        end[motion.arrival_segment[index] + 1] - end[motion.arrival_segment[index - 1] + 1]
    )


def time_s(motion: Motion) -> float:
    return float(motion.segments.duration_s.sum())


def states(motion: Motion) -> list[str]:
    return [STATES[state].value for state in motion.segments.state]


def ends(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Position and velocity at both ends of every piece: (2, p, 3) each."""
    piece = np.arange(len(motion.piece_duration_s))
    both = [motion.state_at(piece, t) for t in (np.zeros(len(piece)), motion.piece_duration_s)]
    position = np.stack([np.column_stack((s.east_m, s.north_m, s.height_m)) for s in both])
    velocity = np.stack([np.column_stack((s.east_m_s, s.north_m_s, s.climb_m_s)) for s in both])
    return position, velocity
