r"""Open-circuit voltage over charge and internal resistance, from voltage, current and charge.

.. math:: V_t = E(s_t) - R\, I_t, \qquad s_t = s_0 - Q_t / C,

with E linear between knots and rising with the state of charge s: linear least squares with bounds.
Slow recovery of the cells is not modelled; it is noise with a memory here, and the error of R counts
it as such.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.frozen import frozen
from planner.identify.estimate import Estimate
from planner.identify.noise import Noise, fit_noise, least_squares_covariance

if TYPE_CHECKING:
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]

KNOTS = 6
"""Points of the curve over the charge that was used."""
_LEAST_CURRENT_VARIATION = 0.02
"""Of the mean current, beside what goes with the charge: less tells no resistance. [-]"""
_LEAST_RISE_V = 1e-3
"""Between two knots: a curve must rise. [V]"""


@frozen
class BatteryFit:
    """What one or more discharges tell about a battery."""

    ocv_soc: tuple[float, ...]
    """States of charge within what was used, rising. [-]"""
    ocv_v: tuple[float, ...]
    """Open-circuit voltage at each, rising. [V]"""
    ocv_error_v: tuple[float, ...]
    """Standard error of each. [V]"""
    internal_resistance_ohm: Estimate
    """Of the whole battery. [Ω]"""
    noise: Noise
    """What was left over. [V]"""


def fit_battery(
    voltage_v: npt.ArrayLike,
    current_a: npt.ArrayLike,
    charge_used_ah: npt.ArrayLike,
    *,
    capacity_ah: float,
    first_state_of_charge: float = 1.0,
    knots: int = KNOTS,
) -> BatteryFit:
    """Fit open-circuit voltage and internal resistance to one discharge.

    Parameters
    ----------
    voltage_v, current_a, charge_used_ah : array_like
        Voltage under load, current, and charge taken since the state of charge was
        ``first_state_of_charge``, evenly sampled. (n,) [V, A, Ah]
    capacity_ah : float
        Charge of the full battery. [Ah]
    first_state_of_charge : float
        State of charge at which no charge had been used. [-]
    knots : int
        Number of points of the curve.

    Returns
    -------
    BatteryFit
        The curve over the charge that was used, no farther, and the resistance.

    Raises
    ------
    IdentificationError
        If too little charge was used, more than the battery holds, or the current hardly varies.
    """
    from scipy.optimize import lsq_linear

    voltage = np.asarray(voltage_v, dtype=np.float64)
    current = np.asarray(current_a, dtype=np.float64)
    soc = first_state_of_charge - np.asarray(charge_used_ah, dtype=np.float64) / capacity_ah
    low, high = float(soc.min()), float(soc.max())
    if low < 0.0:
        msg = f"more charge was used than {capacity_ah:g} Ah hold: the capacity or the current is wrong"
        raise IdentificationError(msg)
    if high - low < 0.02 or voltage.size < 10 * knots:
        msg = f"only {high - low:.1%} of the charge was used: too little for a curve over charge"
        raise IdentificationError(msg)
    at = np.linspace(low, high, knots)
    spacing = at[1] - at[0]
    # columns: voltage at the lowest knot, then the rise over each interval
    rises = np.clip((soc[:, None] - at[:-1]) / spacing, 0.0, 1.0)
    curve = np.concatenate([np.ones((soc.size, 1)), rises], axis=1)
    explained = curve @ np.linalg.lstsq(curve, current)[0]
    if np.std(current - explained) < _LEAST_CURRENT_VARIATION * np.abs(current).mean():
        msg = "the current hardly varies: fly climbs or stops to tell the internal resistance"
        raise IdentificationError(msg)
    design = np.concatenate([curve, -current[:, None]], axis=1)
    bounds = ([-np.inf, *[_LEAST_RISE_V] * (knots - 1), 0.0], np.full(knots + 1, np.inf))
    found = np.asarray(lsq_linear(design, voltage, bounds=bounds).x)
    noise = fit_noise([voltage - design @ found], parameters=found.size)
    covariance = least_squares_covariance([(1.0, design, noise)])
    to_knots = np.tril(np.ones((knots, knots)))
    of_knots = to_knots @ covariance[:knots, :knots] @ to_knots.T
    return BatteryFit(
        ocv_soc=tuple(at.tolist()),
        ocv_v=tuple((to_knots @ found[:knots]).tolist()),
        ocv_error_v=tuple(np.sqrt(np.diagonal(of_knots)).tolist()),
        internal_resistance_ohm=Estimate(
            name="internal_resistance_ohm",
            value=float(found[-1]),
            error=float(np.sqrt(covariance[-1, -1])),
        ),
        noise=noise,
    )
