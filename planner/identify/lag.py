"""The air drag that makes a vehicle lag behind the trajectory of PX4, from logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.identify.uncertainty import Estimate, fit_noise, least_squares_covariance
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.logs.record import FlightRecord

_LEAST_MOTION_M_S = 0.3
"""Root mean square of what changes of the velocity: below, in hovers and climbs, nothing tells the drag."""
_LEAST_ERRORS = 3.0
"""Standard errors a drag must be from zero to be told from none. [-]"""
_OFF_ALIKE = 0.02
"""How far times predicted with the right drag are off, relative: 33 flights of PX4's simulation with 0.15,
0.25, 0.4 and 1.0 1/s took -1.9 to +2.4 % of them. [-]"""


def identify_drag(
    records: Sequence[FlightRecord], *, times_heavier: Sequence[float] = ()
) -> Estimate | None:
    """Return the deceleration by the air over airspeed, in 1/s; ``None`` where the logs do not tell it.

    ``times_heavier`` are the masses that flew over that of the model, left out of a mass that is not known.

    Notes
    -----
    The velocity controller asks for a_t + k q + i ∫ q − d v̇ = D v + v̇, q = P e + v_t − v with the error e of
    the position and the velocity v_t and acceleration a_t of the trajectory (``TrackingLag``).  The integral
    follows D v + (1 + d) v̇ − a_t with the time constant k/i, so that what is left of k q and of
    (1 + d) v̇ − a_t is D x, x the velocity less itself smoothed with k/i: a line through zero, for east and
    north alike.  A steady wind leaves both alone.
    """
    times = times_heavier or [1.0] * len(records)
    spans = [
        (motion, asked * own)
        for record, own in zip(records, times, strict=True)
        for motion, asked in _spans(record)
    ]
    if not spans:
        return None
    motion, asked = (np.concatenate(column) for column in zip(*spans, strict=True))
    if np.sqrt((motion**2).mean()) < _LEAST_MOTION_M_S:
        return None
    drag = float(motion @ asked / (motion @ motion))
    noise = fit_noise([y - drag * x for x, y in spans], parameters=1)
    covariance = least_squares_covariance([(1.0, x[:, None], noise) for x, _ in spans])
    error = float(np.sqrt(covariance[0, 0]))
    return (
        Estimate(name="drag_per_s", value=drag, error=error)
        if drag > _LEAST_ERRORS * error
        else None
    )


def times_allow_drag(with_it: Sequence[float], without: Sequence[float]) -> bool:
    """Return whether times flown allow a drag, by their errors relative to predictions with it and without.

    They do unless predictions without it are nearer even where all are off alike by as much as predictions
    with the right drag are: straight legs take one time with it and without, corners and short legs do not.
    Where nothing was compared they do not.
    """
    if not len(with_it):
        return False
    right, other = np.array(with_it), np.array(without)
    nearer = float(np.sum(right**2 - other**2))
    return nearer <= 2.0 * _OFF_ALIKE * abs(float(np.sum(right - other)))


def _spans(record: FlightRecord) -> list[tuple[FloatArray, FloatArray]]:
    """Return x and k q of the longest flight without a gap, to north and to east. (n,) each [m s⁻¹, m s⁻²]"""
    defaults, given = Px4Parameters(), record.parameters
    position = given.get("MPC_XY_P", defaults.position_gain_per_s)
    gain = given.get("MPC_XY_VEL_P_ACC", defaults.velocity_gain_per_s)
    integral = given.get("MPC_XY_VEL_I_ACC", defaults.velocity_integral_gain_per_s2)
    axes = (
        *((record.velocity_north_m_s, record.reference_velocity_north_m_s),),
        *((record.velocity_east_m_s, record.reference_velocity_east_m_s),),
    )
    errors = (record.reference_north_m - record.north_m, record.reference_east_m - record.east_m)
    known = ~record.is_landed & np.isfinite(np.array([*axes[0], *axes[1], *errors])).all(axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False]))))
    if not len(edges) or integral <= 0.0:
        return []
    begins, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - begins))
    flown = slice(begins[longest], ends[longest])
    derivative = given.get("MPC_XY_VEL_D_ACC", defaults.velocity_derivative_gain)
    fading = np.exp(-record.step_s * integral / gain)
    widest = given.get("MPC_XY_ERR_MAX", defaults.position_error_max_m)
    scale = _time_scale(np.array(axes)[:, 1, flown], np.array(errors)[:, flown], widest)
    result = []
    for (velocity, reference), error in zip(axes, errors, strict=True):
        v = velocity[flown]
        gained = (1.0 + derivative) * np.gradient(v, record.step_s)
        gained -= np.gradient(reference[flown], record.step_s) / scale
        asked = gain * (position * error[flown] + reference[flown] - v)
        result.append((v - _smoothed(v, fading), asked - (gained - _smoothed(gained, fading))))
    return result


_LEAST_SCALE = 0.2
"""Of the trajectory's time: where it nearly stands, its acceleration cannot be told from its change. [-]"""


def _time_scale(reference_m_s: FloatArray, error_m: FloatArray, widest_m: float) -> FloatArray:
    """Return seconds of the trajectory's time per second (``PositionSmoothing``); axes are (2, n)."""
    behind = (reference_m_s * error_m).sum(axis=0) >= 0.0
    slowed = 1.0 - np.hypot(*error_m) / widest_m
    return np.where(behind, np.maximum(slowed, _LEAST_SCALE), 1.0)


def _smoothed(values: FloatArray, fading: float) -> FloatArray:
    from scipy.signal import lfilter

    smooth: FloatArray = lfilter([1.0 - fading], [1.0, -fading], values)
    return smooth
