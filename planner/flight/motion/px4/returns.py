"""Returns: the legs PX4 flies home by, for many returns at once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray
    from planner.mission.stage import ReturnWay
    from planner.vehicle.parameters.px4 import Px4Parameters

_CONE_ANGLES_RAD = (np.radians(1.0), np.radians(89.0))
"""Half angles of the cone over home that mean something (``RTL::computeReturnAltitude``). [rad]"""


@frozen(eq=False)
class ReturnLeg:
    """One leg of k returns."""

    target_m: FloatArray
    """East, north, height above home. (k, 3) [m]"""
    is_flown: BoolArray
    """Which returns fly it. (k,)"""
    hold_s: float = 0.0
    is_landing: bool = False


def return_legs(
    places_m: FloatArray,
    home_m: FloatArray,
    parameters: Px4Parameters,
    rally_height_m: FloatArray | float = 0.0,
) -> tuple[ReturnLeg, ...]:
    """Return the legs of returns: up, home, down to wait, to the ground.

    Parameters
    ----------
    places_m, home_m : ndarray
        Where they begin and where they lead, the ground there included. (k, 3) [m]
    parameters : Px4Parameters
        The vehicle's.
    rally_height_m : ndarray
        Heights of rally points above the ground there, which the heights of the return count from;
        0 for home. (k,) [m]

    Notes
    -----
    ``RtlDirect``: at MPC_XY_CRUISE, whatever the mission commanded.  RTL_LAND_DELAY at RTL_DESCEND_ALT,
    if there is one; where it is below zero the vehicle stays there, and the motion ends.
    """
    way = home_m - places_m
    distance, above = np.hypot(way[:, 0], way[:, 1]), -way[:, 2] - rally_height_m
    height = return_heights_m(distance, above, parameters)
    datum = home_m[:, 2] + rally_height_m
    level = datum + height
    every = np.ones(len(places_m), dtype=np.bool_)
    up, home, wait = places_m.copy(), home_m.copy(), home_m.copy()
    up[:, 2] = home[:, 2] = level
    wait[:, 2] = datum + np.minimum(parameters.return_descend_altitude_m, height)
    delay = parameters.return_land_delay_s
    return (
        ReturnLeg(target_m=up, is_flown=level > places_m[:, 2]),
        ReturnLeg(target_m=home, is_flown=every),
        ReturnLeg(target_m=wait, is_flown=every & (delay != 0.0), hold_s=max(delay, 0.0)),
        ReturnLeg(target_m=home_m, is_flown=every & (delay >= 0.0), is_landing=True),
    )


def way_height_m(place_m: FloatArray, way: ReturnWay, parameters: Px4Parameters) -> float:
    """Return the height above home at which a return along the mission sets out. [m]

    Parameters
    ----------
    place_m : ndarray
        East, north, height above home where it begins. (3,) [m]
    way : ReturnWay
        Where it leads.
    parameters : Px4Parameters
        The vehicle's.

    Notes
    -----
    Only a return to the mission's landing climbs first (``RtlDirectMissionLand::on_activation``), to
    what ``RTL::computeReturnAltitude`` says over the altitude of the landing item.
    """
    present = float(place_m[2])
    over = way.climbs_over_m
    if over is None:
        return present
    landing = way.stages[-1]
    distance = math.hypot(landing.east_m - place_m[0], landing.north_m - place_m[1])
    height = return_heights_m(np.array([distance]), np.array([present - over]), parameters)
    return over + float(height[0])


def return_heights_m(
    distance_m: FloatArray, height_m: FloatArray, parameters: Px4Parameters
) -> FloatArray:
    """Return the heights above home at which returns are flown. (k,) [m]

    Parameters
    ----------
    distance_m : ndarray
        Horizontal distances from home. (k,) [m]
    height_m : ndarray
        Heights above home at which the returns begin. (k,) [m]
    parameters : Px4Parameters
        RTL_RETURN_ALT, RTL_CONE_ANG, RTL_MIN_DIST, NAV_ACC_RAD.

    Notes
    -----
    ``RTL::computeReturnAltitude``: never below the present height; nearer than RTL_MIN_DIST no higher
    than the cone over home, but 2 NAV_ACC_RAD at least; within NAV_ACC_RAD twice the distance.
    """
    highest, radius = parameters.return_altitude_m, parameters.acceptance_radius_m
    wanted = np.full_like(distance_m, highest)
    if parameters.return_cone_angle_rad > 0.0:
        angle = np.clip(parameters.return_cone_angle_rad, *_CONE_ANGLES_RAD)
        in_cone = np.minimum(distance_m / np.tan(angle), highest)
        wanted = np.where(distance_m <= parameters.return_min_distance_m, in_cone, wanted)
        wanted = np.where(distance_m <= radius, 2.0 * distance_m, np.maximum(wanted, 2.0 * radius))
    return np.maximum(np.minimum(wanted, highest), height_m)
