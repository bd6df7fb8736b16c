"""Headings that PX4 needs at an item before MIS_YAW_TMT is over."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.motion.px4.braking import yaw_time_s
from planner.flight.returns.destination import SETTING_NOT_FOLLOWED
from planner.rules.declaration import PX4, judges
from planner.rules.structure import TAKES_ANY_HEADING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.mission.route.stage import Stage
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.px4 import Px4Parameters

_ALONG_THE_WAY = (0, 3, 4)
"""MPC_YAW_MODE."""


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _not_turned_in_time(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Report the first item that needs a heading which is not reached in time: the mission is given up.

    ``MissionBlock::is_mission_item_reached_or_completed``, ``set_mission_failure_heading_timeout``: counted
    from the arrival, in whole seconds.
    """
    longest_s = math.floor(parameters.yaw_timeout_s)
    if parameters.yaw_timeout_s <= 0.0:
        return
    motion = a.flight.motion
    hovers = motion.segments.state == STATE_INDEX[FlightState.HOVER]
    flying_s = np.append(0.0, np.cumsum(np.where(hovers, 0.0, motion.segments.duration_s)))
    done_s = flying_s[motion.done_segment + 1]
    hover_s = np.where(hovers, motion.segments.duration_s, 0.0)
    stood_s = np.bincount(motion.segment_stage, hover_s, len(a.route.stages))
    stages = a.route.stages
    for row, stage in enumerate(stages):
        if not stage.needs_heading or stage.yaw_deg is None:
            continue
        turn_s = float(yaw_time_s(np.array(_turn_rad(stages[: row + 1], parameters)), parameters))
        wait_s = turn_s - float(done_s[row] - (done_s[row - 1] if row else 0.0))
        if stage.looks_m is not None and stood_s[row] > stage.hold_s:
            # Turned to where that was seen from on the way, it waits as predicted.
            wait_s = max(wait_s, float(stood_s[row]))
        if wait_s > longest_s:
            yield a.finding(
                SETTING_NOT_FOLLOWED,
                f"MIS_YAW_TMT {parameters.yaw_timeout_s:g} s: the heading that this item needs is reached "
                f"{quantity.duration(wait_s)} after it arrives: PX4 gives the mission up, holds and returns",
                item=stage.item,
                severity=Severity.ERROR,
                fix="set MIS_YAW_TMT longer, or need no heading",
            )
            return


def _turn_rad(stages: tuple[Stage, ...], parameters: Px4Parameters) -> float:
    """Return the turn to the heading of the last stage; half a turn where that before is not known. [rad]"""
    asked_deg = stages[-1].yaw_deg
    assert asked_deg is not None
    for row in range(len(stages) - 2, 0, -1):
        stage, before = stages[row], stages[row - 1]
        if stage.yaw_deg is not None and stage.kind not in TAKES_ANY_HEADING:
            return _between_rad(stage.yaw_deg, asked_deg)
        east_m, north_m = stage.east_m - before.east_m, stage.north_m - before.north_m
        if math.hypot(east_m, north_m) > parameters.acceptance_radius_m:
            if parameters.yaw_mode not in _ALONG_THE_WAY:
                break
            return _between_rad(math.degrees(math.atan2(east_m, north_m)), asked_deg)
    return math.pi


def _between_rad(from_deg: float, to_deg: float) -> float:
    return abs(math.radians(math.remainder(to_deg - from_deg, 360.0)))
