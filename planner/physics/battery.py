r"""A battery as an open-circuit voltage over charge, and a resistance.

A load of power P at open-circuit voltage E draws the current at which the voltage under load,
:math:`V = E - R I`, gives :math:`P = V I`:

.. math:: V = \tfrac12 \left(E + \sqrt{E^2 - 4 R P}\right), \qquad I = P / V .

Since :math:`P\,dt = V I\,dt = V\,dq`, the energy delivered while the charge falls is the integral of
the voltage under load over the charge: no time is stepped.  How much of a battery can be used thus
depends on the power it is used at (its C-rate), by its resistance alone; there is no Peukert exponent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.physics.quadrature import unit_quadrature
from planner.units import SECONDS_PER_HOUR
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray

# The voltage under load is smooth between two points of the curve.
_NODES, _WEIGHTS = unit_quadrature(8)

_CHARGE_PASSES = 6
"""Passes over a flight until its charge stands still: to 1e-6 even where it empties the battery."""


def loaded_voltage_v(
    open_circuit_v: npt.ArrayLike, power_w: npt.ArrayLike, *, resistance_ohm: npt.ArrayLike
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
    resistance_ohm : array_like
        Resistance R of the whole battery, not negative. [Ω]

    Examples
    --------
    >>> print(f"{loaded_voltage_v(25.0, 500.0, resistance_ohm=0.0245):.2f} V")
    24.50 V
    """
    voltage = np.asarray(open_circuit_v, dtype=np.float64)
    load = (4.0 * np.asarray(resistance_ohm)) * np.asarray(power_w, dtype=np.float64)
    return np.asarray(0.5 * (voltage + np.sqrt(np.maximum(voltage * voltage - load, 0.0))))


class BatteryCircuit(Value):
    """A charge, a resistance and an open-circuit voltage, linear between the points of its curve.

    Of one battery, or of several with one curve, see `joined`.
    """

    capacity_ah: float | FloatArray
    """Charge Q of the full battery. [Ah]"""
    resistance_ohm: float | FloatArray = 0.0
    """Of the whole battery, not negative. [Ω]"""
    ocv_soc: tuple[float, ...]
    """States of charge, rising from 0 to 1. [-]"""
    ocv_v: tuple[float, ...]
    """Open-circuit voltage at each; outside 0 to 1 that of the nearest end. [V]"""

    def over_an_axis(self) -> BatteryCircuit:
        """Return several batteries, each of which is used in several ways: an axis behind theirs. (k, 1)"""
        return replace(
            self,
            capacity_ah=np.asarray(self.capacity_ah)[:, None],
            resistance_ohm=np.asarray(self.resistance_ohm)[:, None],
        )

    def open_circuit_v(self, state_of_charge: npt.ArrayLike) -> FloatArray:
        """Return the voltage without load at states of charge. [V]"""
        return np.asarray(
            np.interp(np.asarray(state_of_charge, np.float64), self.ocv_soc, self.ocv_v)
        )

    def loaded_v(self, open_circuit_v: npt.ArrayLike, power_w: npt.ArrayLike) -> FloatArray:
        """Return the voltage under loads, as `loaded_voltage_v`. [V]"""
        return loaded_voltage_v(open_circuit_v, power_w, resistance_ohm=self.resistance_ohm)

    def can_deliver(self, open_circuit_v: FloatArray, power_w: FloatArray) -> BoolArray:
        """Return whether there is a current for each of the loads along the first axis. (...)"""
        load_v2 = 4.0 * self.resistance_ohm * power_w
        return np.asarray((open_circuit_v * open_circuit_v >= load_v2).all(axis=0))

    def empty_state_of_charge(self, power_w: float, cutoff_voltage_v: float) -> float:
        r"""Return the state of charge at which the voltage under a load reaches the cut-off. [-]

        There :math:`E = V_c + R P / V_c`; where that is beyond what the battery can deliver, which it
        is for a cut-off below :math:`\sqrt{R P}`, :math:`E = 2 \sqrt{R P}`.  0 where the cut-off is
        never reached, 1 where the full battery is below it.
        """
        load_v2 = self.resistance_ohm * power_w
        lowest_v = max(cutoff_voltage_v, float(np.sqrt(load_v2)))
        drop_v = load_v2 / lowest_v if load_v2 > 0.0 else 0.0
        return float(np.interp(lowest_v + drop_v, self.ocv_v, self.ocv_soc))

    def delivered_wh(self, power_w: float, from_soc: float, to_soc: float) -> float:
        r"""Return the energy a load of constant power takes out while the charge falls. [Wh]

        .. math:: W = Q \int_{s_1}^{s_0} V(E(s), P)\, ds

        by Gauss-Legendre quadrature between the points of the curve; 0 where s₀ is not above s₁.  A
        load of 0 W gives the energy at no current, the most there is.

        Examples
        --------
        >>> battery = BatteryCircuit(capacity_ah=5.0, ocv_soc=(0.0, 1.0), ocv_v=(12.0, 16.0))
        >>> print(f"{battery.delivered_wh(0.0, 1.0, 0.0):.1f} Wh")
        70.0 Wh
        """
        if not from_soc > to_soc:
            return 0.0
        inside = [soc for soc in self.ocv_soc if to_soc < soc < from_soc]
        ends = np.array([to_soc, *inside, from_soc])
        steps = np.diff(ends)
        at = ends[:-1, None] + steps[:, None] * _NODES
        loaded = self.loaded_v(self.open_circuit_v(at), power_w)
        return float(self.capacity_ah * (steps @ (loaded @ _WEIGHTS)))

    def state_of_charge_after(
        self,
        power_w: npt.ArrayLike,
        power_variance_w2: npt.ArrayLike,
        duration_s: npt.ArrayLike,
        *,
        from_soc: npt.ArrayLike,
    ) -> FloatArray:
        r"""Return the state of charge after each of a row of loads. (n,) [-]

        The mean current of a load is that of its mean power at the open-circuit voltage in its middle,
        and a little more for its variance,

        .. math:: \bar I = I(\bar P) + \tfrac12 \frac{d^2 I}{d P^2} \sigma^2
                  = I(\bar P) + \frac{R\, \sigma^2}{(E^2 - 4 R \bar P)^{3/2}},

        and the open-circuit voltage follows from the charge: solved by a fixed number of passes over
        the whole row, each of which leaves a few hundredths of the error before it.  The result is
        negative where more is asked for than there is.

        Parameters
        ----------
        power_w, power_variance_w2, duration_s : array_like
            Mean power of each load, mean square about it, duration, in order. (n,) [W, W², s]
            Of several rows, or for several batteries, (n, ...): loads follow one another along the first
            axis, and those behind it broadcast with the charge and the resistance.
        from_soc : array_like
            State of charge before the first, of each row and battery. (...) [-]

        Examples
        --------
        An hour at 50 W from a battery of 10 Ah that stays at 10 V takes half of it:

        >>> battery = BatteryCircuit(capacity_ah=10.0, ocv_soc=(0.0, 1.0), ocv_v=(10.0, 10.0))
        >>> left = battery.state_of_charge_after([50.0], [0.0], [3600.0], from_soc=1.0)
        >>> print(f"{left[0]:.2f}")
        0.50
        """
        power = np.asarray(power_w, dtype=np.float64)
        load = 4.0 * self.resistance_ohm * power
        spread = self.resistance_ohm * np.asarray(power_variance_w2, dtype=np.float64)
        fraction_per_a = np.asarray(duration_s, np.float64) / (self.capacity_ah * SECONDS_PER_HOUR)
        twice, from_soc = (
            np.ascontiguousarray(np.broadcast_to(2.0 * power, load.shape)),
            np.asarray(from_soc, np.float64),
        )
        curve = np.array(self.ocv_soc), np.array(self.ocv_v)
        after, of_variance = np.empty(load.shape), np.empty(load.shape)
        middle: FloatArray = from_soc
        # In place: memory is most of what it costs.
        for _ in range(_CHARGE_PASSES):
            voltage = np.interp(middle, *curve)
            # The square root of E² − 4 R P; with it 2 P / (E + √) is the current.
            drop = voltage * voltage - load
            is_too_much = not np.min(drop, initial=np.inf) > 0.0
            if is_too_much:
                np.maximum(drop, 0.0, out=drop)
            np.sqrt(drop, out=drop)
            np.multiply(drop, drop, out=of_variance)
            of_variance *= drop
            if is_too_much:
                of_variance[drop <= 0.0] = np.inf
            np.divide(spread, of_variance, out=of_variance)
            drop += voltage
            used = np.divide(twice, drop, out=drop)
            used += of_variance
            used *= fraction_per_a
            np.subtract(from_soc, _summed(used, out=after), out=after)
            used *= 0.5
            middle = np.add(after, used, out=used)
        return after


def joined(circuits: Sequence[BatteryCircuit]) -> BatteryCircuit:
    """Return circuits of one curve as one, along an axis. (k,)"""
    return replace(
        circuits[0],
        capacity_ah=np.array([one.capacity_ah for one in circuits]),
        resistance_ohm=np.array([one.resistance_ohm for one in circuits]),
    )


def _summed(rows: FloatArray, *, out: FloatArray) -> FloatArray:
    """Return sums of all rows up to each, as ``np.cumsum`` has them along the first axis."""
    if len(rows) > rows[:1].size:
        return np.cumsum(rows, axis=0, out=out)
    out[:1] = rows[:1]
    for number in range(1, len(rows)):  # a quarter of its time where rows are few and long
        np.add(out[number - 1], rows[number], out=out[number])
    return out
