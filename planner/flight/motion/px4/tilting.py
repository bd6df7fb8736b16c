"""What the greatest tilt leaves of a trajectory's accelerations, and what PX4's trajectory waits for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import quotient
from planner.flight.motion.px4.braking import tilted_m_s2

if TYPE_CHECKING:
    from planner.flight.motion.px4.pieces import Ordered
    from planner.vehicle.parameters.px4 import Px4Parameters

_EDGES = np.linspace(0.0, 1.0, 5)
"""Where pieces are cut: over a part the acceleration counts as constant. [-]"""


def held_back(ordered: Ordered, parameters: Px4Parameters) -> Ordered:
    """Return pieces in the time a vehicle takes that tilts no farther than MPC_TILTMAX_AIR.

    Notes
    -----
    The trajectory changes its speed by up to MPC_ACC_HOR on each axis, the vehicle by A = g tan(tilt)
    altogether.  Where that is less, the trajectory waits for it (``PositionSmoothing::_generateTrajectory``):
    a change of speed takes as long as at A.

    Twelve flights at a drag of 0.15/s, A from 0.45 to 0.91 of MPC_ACC_HOR, took 3.0 % less to 1.8 % more than
    this, and where the drag is not known 1.0 % less to 4.7 % more, 3.4 % more where the tilt limits nothing.
    """
    most_m_s2 = tilted_m_s2(parameters)
    if math.sqrt(2.0) * parameters.acceleration_m_s2 <= most_m_s2:
        return ordered
    edges_m_s = ordered.velocities_m_s(_EDGES, 2)
    part_s = ordered.duration_s / (len(_EDGES) - 1)
    least_s = np.hypot(*np.diff(edges_m_s, axis=1)) / most_m_s2
    flown_s = np.maximum(least_s, part_s).sum(axis=0)
    return ordered.slowed(quotient(ordered.duration_s, flown_s, 1.0))
