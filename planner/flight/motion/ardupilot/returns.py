"""ArduPilot's returns: how high they are flown, and what has to be said of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.catalogue.altitude import RETURN_OVER_TERRAIN
from planner.catalogue.mission import LANDING_MISSING
from planner.catalogue.time import WAIT_NOT_COUNTED
from planner.findings import Severity
from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.motion.ardupilot.stages import StageColumns
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_LEAST_RETURN_M = 0.3
"""``RTL_ALT_MIN_M``. [m]"""
_CEILING = 1
"""``AC_FENCE_TYPE_ALT_MAX`` among the bits of FENCE_TYPE."""
_SHALLOWEST_CONE = 0.5
"""``RTL_MIN_CONE_SLOPE``: a shallower cone does not count. [-]"""
_OVER_TERRAIN = 1
"""RTL_ALT_TYPE for heights above terrain."""
_HEADING_HELD = 0
"""WP_YAW_BEHAVIOR for a heading that is never changed."""


def return_height_m(
    start_m: FloatArray,
    home_m: FloatArray,
    parameters: ArduPilotParameters,
    rally_height_m: FloatArray | float = 0.0,
) -> FloatArray:
    """Return the height above home at which returns are flown. (n,) [m]

    Parameters
    ----------
    start_m, home_m : ndarray
        East, north, height of where the returns begin and of home. (n, 3) [m]
    parameters : ArduPilotParameters
        The vehicle's parameters.
    rally_height_m : ndarray
        Height of a rally point above its ground; 0 for home. (n,) [m]

    Notes
    -----
    ``ModeRTL::compute_return_target``: RTL_ALT or the rally point's altitude, at least RTL_CLIMB_MIN
    above the present height; with a RTL_CONE_SLOPE of 0.5 or more no higher than the cone over home; no
    higher than FENCE_ALT_MAX less FENCE_MARGIN while that fence is on; never down.
    """
    present = start_m[:, 2] - home_m[:, 2]
    least = np.maximum(present + parameters.return_climb_min_m, _LEAST_RETURN_M)
    height = np.maximum(np.maximum(parameters.return_altitude_m, rally_height_m), least)
    if parameters.return_cone_slope >= _SHALLOWEST_CONE:
        distance = np.hypot(start_m[:, 0] - home_m[:, 0], start_m[:, 1] - home_m[:, 1])
        height = np.minimum(height, np.maximum(distance * parameters.return_cone_slope, least))
    if parameters.fence_enable and parameters.fence_type & _CEILING:
        ceiling = parameters.fence_height_max_m - parameters.fence_margin_m
        height = np.minimum(height, ceiling)
    lifted: FloatArray = home_m[:, 2] + np.maximum(height, present)
    return lifted


def over_home_m(
    stages: StageColumns, home: IntArray, parameters: ArduPilotParameters
) -> FloatArray:
    """Return where returns arrive over home. (n, 3) [m]

    Parameters
    ----------
    stages : StageColumns
        At least one.
    home : ndarray of int
        The returns among them. (n,)
    parameters : ArduPilotParameters
        The vehicle's parameters.
    """
    over_m = stages.place_m[home].copy()
    floor_m = stages.return_floor_m[home]
    over_m[:, 2] = return_height_m(stages.start_m[home], over_m, parameters, floor_m)
    return over_m


def return_findings(stages: StageColumns, parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Yield what of returns is not, or not as the vehicle does it, predicted.

    Notes
    -----
    ``ModeRTL::loiterathome_run`` waits for RTL_LOIT_TIME and then until the vehicle heads within 2° as
    it was armed, unless WP_YAW_BEHAVIOR is 0.  Nowhere else does Copter wait for a heading in a
    mission: ``ModeAuto::verify_command`` asks for none.
    """
    if parameters.return_altitude_type == _OVER_TERRAIN:
        yield RETURN_OVER_TERRAIN.finding(
            "RTL_ALT_TYPE is 1: returns follow the terrain; they are predicted at least "
            f"{numbers.height(parameters.return_altitude_m)} above home"
        )
    home = stages.where(StageKind.RETURN)
    if not len(home):
        return
    item = int(stages.item[home[0]])
    if parameters.return_final_altitude_m > 0.0:
        yield LANDING_MISSING.finding(
            f"RTL_ALT_FINAL: the return ends in the air at {parameters.return_final_altitude_m:.1f} m "
            "above home: the landing is not counted",
            item=item,
        )
    longer_s = math.pi / parameters.yaw_rate_rad_s - parameters.return_loiter_s
    if longer_s > 0.0 and parameters.yaw_behavior != _HEADING_HELD:
        yield WAIT_NOT_COUNTED.finding(
            "the return waits over home until it heads as it was armed: up to "
            f"{numbers.duration(longer_s)} longer than RTL_LOIT_TIME",
            severity=Severity.INFO,
            item=item,
        )
