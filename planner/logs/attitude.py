"""Attitude as quaternions and as angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.logs.record import FloatArray


def euler_angles_deg(
    w: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return roll, pitch and yaw of a rotation from the body to its frame of reference.

    The order of rotation is yaw, pitch, roll, about axes forward, right, down in a frame north,
    east, down (Diebel, "Representing Attitude", 2006, section 8.2).

    Parameters
    ----------
    w, x, y, z : ndarray
        Unit quaternions, scalar first.

    Returns
    -------
    roll_deg, pitch_deg, yaw_deg : ndarray
        Roll and yaw in [−180, 180], pitch in [−90, 90]. [°]
    """
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.degrees(roll), np.degrees(pitch), np.degrees(yaw)
