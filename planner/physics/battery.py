r"""A battery as an open-circuit voltage over charge, and a resistance.

A load of power P at open-circuit voltage E draws the current at which the voltage under load,
:math:`V = E - R I`, gives :math:`P = V I`:

.. math:: V = \tfrac12 \left(E + \sqrt{E^2 - 4 R P}\right), \qquad I = P / V .

Since :math:`P\,dt = V I\,dt = V\,dq`, the energy delivered while the charge falls is the integral of
the voltage under load over the charge: no time is stepped.  How much of a battery can be used thus
depends on the power it is used at (its C-rate), by its resistance alone; there is no Peukert exponent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from planner.physics.quadrature import unit_quadrature
from planner.units import SECONDS_PER_HOUR

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.arrays import FloatArray

    Curve: TypeAlias = Sequence[float] | FloatArray

# The voltage under load is smooth between two points of the curve.
_NODES, _WEIGHTS = unit_quadrature(8)

_CHARGE_PASSES = 6
"""Passes over a flight until its charge stands still: to 1e-6 even where it empties the battery."""


def loaded_voltage_v(
    open_circuit_v: npt.ArrayLike, power_w: npt.ArrayLike, *, resistance_ohm: float
) -> FloatArray:
    r"""Voltage under a load of constant power.

    .. math:: V = \tfrac12 \left(E + \sqrt{E^2 - 4 R P}\right)

    A battery can deliver at most :math:`E^2 / 4 R`; asked for more, its voltage falls to E / 2 and
    beyond, where no current gives the power: the voltage returned is then E / 2.

    Parameters
    ----------
    open_circuit_v : array_like
        Open-circuit voltage E, positive. [V]
    power_w : array_like
        Power P, not negative. [W]
    resistance_ohm : float
        Resistance R of the whole battery, not negative. [Ω]

    Returns
    -------
    ndarray
        Voltage, in the broadcast shape. [V]

    Examples
    --------
    >>> print(f"{loaded_voltage_v(25.0, 500.0, resistance_ohm=0.0245):.2f} V")
    24.50 V
    """
    voltage = np.asarray(open_circuit_v, dtype=np.float64)
    load = (4.0 * resistance_ohm) * np.asarray(power_w, dtype=np.float64)
    loaded: FloatArray = np.asarray(
        0.5 * (voltage + np.sqrt(np.maximum(voltage * voltage - load, 0.0)))
    )
    return loaded


def open_circuit_voltage_v(
    state_of_charge: npt.ArrayLike, *, ocv_soc: Curve, ocv_v: Curve
) -> FloatArray:
    """Open-circuit voltage at states of charge, linear between the points of its curve.

    Parameters
    ----------
    state_of_charge : array_like
        States of charge; outside 0 to 1 the voltage of the nearest end. [-]
    ocv_soc, ocv_v : array_like
        The curve: states of charge rising from 0 to 1, and the voltage at each. [-, V]

    Returns
    -------
    ndarray
        Voltage, in the shape of the states of charge. [V]
    """
    voltage: FloatArray = np.asarray(
        np.interp(np.asarray(state_of_charge, dtype=np.float64), ocv_soc, ocv_v)
    )
    return voltage


def empty_state_of_charge(
    power_w: float, *, cutoff_voltage_v: float, resistance_ohm: float, ocv_soc: Curve, ocv_v: Curve
) -> float:
    r"""State of charge at which the voltage under a load reaches the cut-off.

    There :math:`E = V_c + R P / V_c`; where that is beyond what the battery can deliver, which it is
    for a cut-off below :math:`\sqrt{R P}`, :math:`E = 2 \sqrt{R P}`.

    Parameters
    ----------
    power_w : float
        Load P. [W]
    cutoff_voltage_v : float
        Voltage under load at which the battery counts as empty; 0 for none. [V]
    resistance_ohm : float
        Resistance R. [Ω]
    ocv_soc, ocv_v : array_like
        The open-circuit curve. [-, V]

    Returns
    -------
    float
        State of charge: 0 where the cut-off is never reached, 1 where the full battery is below it.
    """
    lowest_v = max(cutoff_voltage_v, float(np.sqrt(resistance_ohm * power_w)))
    open_circuit_v = lowest_v + (resistance_ohm * power_w / lowest_v if power_w > 0.0 else 0.0)
    return float(np.interp(open_circuit_v, np.asarray(ocv_v), np.asarray(ocv_soc)))


def delivered_energy_wh(
    power_w: float,
    *,
    from_state_of_charge: float,
    to_state_of_charge: float,
    capacity_ah: float,
    resistance_ohm: float,
    ocv_soc: Curve,
    ocv_v: Curve,
) -> float:
    r"""Energy a load of constant power takes out while the charge falls.

    .. math:: W = Q \int_{s_1}^{s_0} V(E(s), P)\, ds

    by Gauss-Legendre quadrature between the points of the open-circuit curve.

    Parameters
    ----------
    power_w : float
        Load P; 0 gives the energy at no current, the most there is. [W]
    from_state_of_charge, to_state_of_charge : float
        States of charge s₀ and s₁. [-]
    capacity_ah : float
        Charge Q of the full battery. [Ah]
    resistance_ohm : float
        Resistance R. [Ω]
    ocv_soc, ocv_v : array_like
        The open-circuit curve. [-, V]

    Returns
    -------
    float
        Energy; 0 where s₀ is not above s₁. [Wh]

    Examples
    --------
    >>> energy_wh = delivered_energy_wh(
    ...     0.0, from_state_of_charge=1.0, to_state_of_charge=0.0, capacity_ah=5.0,
    ...     resistance_ohm=0.0, ocv_soc=[0.0, 1.0], ocv_v=[12.0, 16.0],
    ... )
    >>> print(f"{energy_wh:.1f} Wh")
    70.0 Wh
    """
    if not from_state_of_charge > to_state_of_charge:
        return 0.0
    knots = np.asarray(ocv_soc, dtype=np.float64)
    inside = knots[(knots > to_state_of_charge) & (knots < from_state_of_charge)]
    ends = np.concatenate(([to_state_of_charge], inside, [from_state_of_charge]))
    steps = np.diff(ends)
    at = ends[:-1, None] + steps[:, None] * _NODES
    loaded = loaded_voltage_v(
        open_circuit_voltage_v(at, ocv_soc=knots, ocv_v=ocv_v),
        power_w,
        resistance_ohm=resistance_ohm,
    )
    return capacity_ah * float(steps @ (loaded @ _WEIGHTS))


def state_of_charge_after(
    power_w: npt.ArrayLike,
    power_variance_w2: npt.ArrayLike,
    duration_s: npt.ArrayLike,
    *,
    from_state_of_charge: float,
    capacity_ah: float,
    resistance_ohm: float,
    ocv_soc: Curve,
    ocv_v: Curve,
) -> FloatArray:
    r"""State of charge after each of a row of loads.

    The mean current of a load is that of its mean power at the open-circuit voltage in its middle,
    and a little more for its variance,

    .. math:: \bar I = I(\bar P) + \tfrac12 \frac{d^2 I}{d P^2} \sigma^2
              = I(\bar P) + \frac{R\, \sigma^2}{(E^2 - 4 R \bar P)^{3/2}},

    and the open-circuit voltage follows from the charge: solved by a fixed number of passes over the
    whole row, each of which leaves a few hundredths of the error before it.

    Parameters
    ----------
    power_w : array_like
        Mean power of each load, in order. (n,) [W]
    power_variance_w2 : array_like
        Mean square of the power of each load about its mean. (n,) [W²]
    duration_s : array_like
        Duration of each load. (n,) [s]
    from_state_of_charge : float
        State of charge before the first. [-]
    capacity_ah : float
        Charge of the full battery. [Ah]
    resistance_ohm : float
        Resistance. [Ω]
    ocv_soc, ocv_v : array_like
        The open-circuit curve. [-, V]

    Returns
    -------
    ndarray
        State of charge after each load; negative where more was asked for than there is. (n,) [-]

    Examples
    --------
    An hour at 50 W from a battery of 10 Ah that stays at 10 V takes half of it:

    >>> left = state_of_charge_after(
    ...     [50.0], [0.0], [3600.0], from_state_of_charge=1.0, capacity_ah=10.0,
    ...     resistance_ohm=0.0, ocv_soc=[0.0, 1.0], ocv_v=[10.0, 10.0],
    ... )
    >>> print(f"{left[0]:.2f}")
    0.50
    """
    power = np.asarray(power_w, dtype=np.float64)
    spread = resistance_ohm * np.asarray(power_variance_w2, dtype=np.float64)
    share_per_a = np.asarray(duration_s, dtype=np.float64) / (capacity_ah * SECONDS_PER_HOUR)
    used = np.zeros(power.shape)
    for _ in range(_CHARGE_PASSES):
        taken = np.cumsum(used)
        voltage = open_circuit_voltage_v(
            from_state_of_charge - taken + 0.5 * used, ocv_soc=ocv_soc, ocv_v=ocv_v
        )
        loaded = loaded_voltage_v(voltage, power, resistance_ohm=resistance_ohm)
        drop = 2.0 * loaded - voltage  # the square root of E² − 4 R P
        of_variance = np.divide(spread, drop**3, out=np.zeros(power.shape), where=drop > 0.0)
        used = (power / loaded + of_variance) * share_per_a
    return np.asarray(from_state_of_charge - np.cumsum(used))
