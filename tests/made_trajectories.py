"""Flights of straight and even parts, as trajectories."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.trajectory import AT_REST_S, Trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray


def trajectory(
    knots_s: Sequence[float], control_m: FloatArray, *, low_ends: bool = False
) -> Trajectory:
    """Return a flight of cubics between knots, at rest before and after."""
    whole = np.concatenate(
        (np.repeat(control_m[:1, :1], 4, 1), control_m, np.repeat(control_m[-1:, -1:], 4, 1))
    )
    is_low = np.zeros(len(whole), bool)
    is_low[[0, -1]] = low_ends
    return Trajectory(
        start_s=np.array([-AT_REST_S, *knots_s]),
        end_s=np.array([*knots_s, knots_s[-1] + AT_REST_S]),
        control_m=whole,
        low_m=whole.min(axis=1),
        high_m=whole.max(axis=1),
        error_m=np.zeros(len(whole)),
        item=np.arange(len(whole)),
        is_low=is_low,
        duration_s=knots_s[-1],
        slack_s=np.zeros(len(whole)),
        late_s=np.zeros((len(whole), 2)),
        longer_s=np.zeros(len(whole)),
        grown_m=np.zeros(len(whole)),
        lifted_m=np.zeros(len(whole)),
        stop_s=np.zeros(len(whole)),
    )


def straight(*places: tuple[float, float, float, float], low_ends: bool = False) -> Trajectory:
    """Return a flight straight and evenly from place to place: time, east, north, height."""
    rows = np.array(places)
    share = np.linspace(0.0, 1.0, 4)[None, :, None]
    control_m = rows[:-1, None, 1:] + share * np.diff(rows[:, 1:], axis=0)[:, None, :]
    return trajectory(rows[:, 0].tolist(), control_m, low_ends=low_ends)


def place(one: Trajectory, time_s: FloatArray) -> FloatArray:
    """Return the place at times since the start, by the Bernstein polynomials. (k, 3)"""
    part = np.clip(np.searchsorted(one.start_s, time_s, side="right") - 1, 0, len(one.start_s) - 1)
    u = ((time_s - one.start_s[part]) / (one.end_s[part] - one.start_s[part]))[:, None]
    a, b, c, d = np.moveaxis(one.control_m[part], 1, 0)
    whole: FloatArray = (
        (1 - u) ** 3 * a + 3 * u * (1 - u) ** 2 * b + 3 * u**2 * (1 - u) * c + u**3 * d
    )
    return whole
