"""Take-offs: from armed on the ground to the height from which a climb is a leg like any other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.columns import Columns
from planner.flight.motion.px4.pieces import RAMP, Lines, Places
from planner.flight.motion.px4.speeds import braking_distance_m, half_b_m_s
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.pieces import Pieces
    from planner.vehicle.parameters.px4 import Px4Parameters

LIFT_OFF_AFTER_S = 0.2
"""From the end of the thrust ramp to lift-off: 4.2 s after arming with 1 s of spool-up and 3 s of ramp
(measured). [s]"""
CLIMB_BEHIND_S = 0.83
"""Time the climb is behind one at full speed from lift-off on: 10 m at 1.5 m/s are reached 11.7 s after
arming, not 10.9 s (measured).  PX4 only begins to raise the speed while the thrust ramps up. [s]"""

IDLE_SHARE = 0.5
"""Share of the thrust ramp that counts as standing with idle motors: thrust grows evenly to that of the
hover. [-]"""


@frozen(eq=False)
class Takeoffs(Columns):
    """Take-offs as columns of length k."""

    ground_m: FloatArray
    """Where each begins. (k, 3) [m]"""
    grounded_s: FloatArray
    """Time on the ground: spool-up and ramp."""
    speed_m_s: FloatArray
    """Climb speed near the ground."""
    rise_s: FloatArray
    """Time in which the climb reaches it, at constant acceleration."""
    steady_s: FloatArray
    """Time at it."""
    place_m: FloatArray
    """Where the climb becomes a leg. (k, 3) [m]"""
    is_free: BoolArray
    """Whether that is climbed at MPC_Z_V_AUTO_UP; else MPC_TKO_SPEED holds to the end."""


def make_takeoffs(
    ground_m: FloatArray, target_m: FloatArray, parameters: Px4Parameters
) -> Takeoffs:
    """Return the beginnings of take-offs.

    Parameters
    ----------
    ground_m, target_m : ndarray
        Where they begin, and the heights they lead to. (k, 3) [m]
    parameters : Px4Parameters
        The vehicle's.

    Notes
    -----
    COM_SPOOLUP_TIME, then thrust ramps up over MPC_TKO_RAMP_T (``TakeoffHandling``); MPC_TKO_SPEED up to
    MPC_LAND_ALT1 over ground, then the climb speed of missions (``FlightTaskAuto::
    _updateTrajConstraints``).  A low take-off is climbed no faster than it can be braked again.
    """
    height = np.maximum(target_m[:, 2] - ground_m[:, 2], 0.0)
    limits = {
        "acceleration_m_s2": np.full_like(height, parameters.acceleration_up_m_s2),
        "jerk_m_s3": np.full_like(height, parameters.jerk_m_s3),
    }
    a = limits["acceleration_m_s2"]
    half = half_b_m_s(**limits) + a * CLIMB_BEHIND_S
    # The highest speed v with v · 0.83 s for the rise and its braking distance within the height.
    fitting = np.sqrt(half**2 + 2.0 * a * height) - half
    speed = np.minimum(parameters.takeoff_speed_m_s, fitting)
    risen = speed * CLIMB_BEHIND_S
    kept = braking_distance_m(speed, np.zeros_like(speed), **limits)
    is_free = height - kept > np.maximum(parameters.land_slow_height_m, risen)
    upper = np.where(
        is_free, np.maximum(parameters.land_slow_height_m, risen), np.maximum(height - kept, risen)
    )
    place = ground_m.copy()
    place[:, 2] += upper
    flies = speed > 0.0
    return Takeoffs(
        ground_m=ground_m,
        grounded_s=np.full_like(
            height, parameters.spool_up_s + parameters.takeoff_ramp_s + LIFT_OFF_AFTER_S
        ),
        speed_m_s=speed,
        rise_s=np.where(flies, 2.0 * CLIMB_BEHIND_S, 0.0),
        steady_s=np.divide(upper - risen, speed, out=np.zeros_like(speed), where=flies),
        place_m=place,
        is_free=is_free,
    )


def add_takeoffs(
    pieces: Pieces, move: IntArray, takeoffs: Takeoffs, parameters: Px4Parameters
) -> None:
    """Add the pieces of take-offs, which are these moves.

    Noise does not slow them: the height of the trajectory is kept at the vehicle's, which climbs at the
    speed ordered however far the trajectory's time has come (``_updateTrajConstraints``,
    ``forceSetPosition``).
    """
    if not len(move):
        return
    count, zero = len(move), np.zeros(len(move))
    idle = np.full(count, parameters.spool_up_s + IDLE_SHARE * parameters.takeoff_ramp_s)
    speed = takeoffs.speed_m_s
    risen = 0.5 * speed * takeoffs.rise_s
    rising = np.divide(speed, takeoffs.rise_s, out=zero.copy(), where=takeoffs.rise_s > 0.0)
    for order, (duration, height, v, a) in enumerate(
        (
            (idle, zero, zero, zero),
            (takeoffs.grounded_s - idle, zero, zero, zero),
            (takeoffs.rise_s, zero, zero, rising),
            (takeoffs.steady_s, risen, speed, zero),
        )
    ):
        place = takeoffs.ground_m.copy()
        place[:, 2] += height
        pieces.add_lines(
            Places(
                move=move,
                order=np.full(count, order),
                slot=np.full(count, RAMP),
                duration_s=duration,
                pace=np.ones(count),
            ),
            Lines(
                place_m=place,
                direction=np.broadcast_to(np.array([0.0, 0.0, 1.0]), (count, 3)),
                speed_m_s=v,
                acceleration_m_s2=a,
                jerk_m_s3=zero,
            ),
            is_grounded=order == 0,
        )
