"""The battery along a flight: charge, voltage under load and current, where its curve is known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.prediction import QUADRATURE_WEIGHTS
from planner.frozen import frozen
from planner.physics.battery import (
    delivered_energy_wh,
    empty_state_of_charge,
    loaded_voltage_v,
    open_circuit_voltage_v,
    state_of_charge_after,
)

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray
    from planner.flight.prediction import Flight
    from planner.vehicle.battery import Battery


@frozen(eq=False)
class Discharge:
    """What a flight takes out of a battery, as columns over its segments and in figures."""

    state_of_charge: FloatArray
    """At the end of each segment; negative where the battery is empty before. (n,) [-]"""
    voltage_v: FloatArray
    """Under load, at the end of each segment. (n,) [V]"""
    current_a: FloatArray
    """At the end of each segment. (n,) [A]"""
    lowest_voltage_v: float
    """Under the highest load near each moment of the flight. [V]"""
    lowest_voltage_segment: int
    can_deliver: bool
    """Whether the battery has the power for every moment of the flight."""
    highest_current_a: float
    highest_current_segment: int
    charge_ah: float
    """Charge the flight takes. [Ah]"""
    usable_wh: float
    """Energy from the charge at the start down to the cut-off, at the mean power. [Wh]"""


def predict_discharge(
    flight: Flight, battery: Battery, *, charge: float, temperature_c: float
) -> Discharge | None:
    """Return what a flight takes out of a battery whose curve and resistance are known.

    Parameters
    ----------
    flight : Flight
        With known power.
    battery : Battery
        Any; the energy of a mere label says nothing about voltages.
    charge : float
        State of charge at the start. [-]
    temperature_c : float
        Temperature of the battery: that of the air, as at take-off. [°C]

    Returns
    -------
    Discharge or None
        ``None`` where the charge, the open-circuit curve or the resistance of the battery is not
        known, and where nothing is flown.
    """
    capacity_ah = battery.charge_ah
    resistance_ohm = battery.resistance_ohm(temperature_c)
    curve_soc, curve_v = battery.ocv_soc, battery.ocv_v
    motion, node_w = flight.motion, flight.node_power_w
    if capacity_ah is None or resistance_ohm is None or curve_soc is None or curve_v is None:
        return None
    if not len(node_w):
        return None
    mean_w = node_w @ QUADRATURE_WEIGHTS
    variance_w2 = np.square(node_w - mean_w[:, None]) @ QUADRATURE_WEIGHTS
    left = state_of_charge_after(
        mean_w,
        variance_w2,
        motion.piece_duration_s,
        from_state_of_charge=charge,
        capacity_ah=capacity_ah,
        resistance_ohm=resistance_ohm,
        ocv_soc=curve_soc,
        ocv_v=curve_v,
    )
    # The charge at the end of a piece is its lowest: what the peak of the piece meets is no less.
    open_v = open_circuit_voltage_v(left, ocv_soc=curve_soc, ocv_v=curve_v)
    peak_w = node_w.max(axis=1)
    peak_v = loaded_voltage_v(open_v, peak_w, resistance_ohm=resistance_ohm)
    lowest, strongest = int(np.argmin(peak_v)), int(np.argmax(peak_w / peak_v))

    count = len(motion.segments.item)
    last = np.searchsorted(motion.piece_segment, np.arange(count), side="right") - 1
    end_v = loaded_voltage_v(open_v[last], node_w[last, -1], resistance_ohm=resistance_ohm)
    used_w = flight.energy_j / flight.time_s if flight.time_s > 0.0 else 0.0
    return Discharge(
        state_of_charge=left[last],
        voltage_v=end_v,
        current_a=node_w[last, -1] / end_v,
        lowest_voltage_v=float(peak_v[lowest]),
        lowest_voltage_segment=int(motion.piece_segment[lowest]),
        can_deliver=bool((open_v * open_v >= 4.0 * resistance_ohm * peak_w).all()),
        highest_current_a=float(peak_w[strongest] / peak_v[strongest]),
        highest_current_segment=int(motion.piece_segment[strongest]),
        charge_ah=capacity_ah * (charge - float(left[-1])),
        usable_wh=delivered_energy_wh(
            used_w,
            from_state_of_charge=charge,
            to_state_of_charge=empty_state_of_charge(
                used_w,
                cutoff_voltage_v=battery.cutoff_voltage_v or 0.0,
                resistance_ohm=resistance_ohm,
                ocv_soc=curve_soc,
                ocv_v=curve_v,
            ),
            capacity_ah=capacity_ah,
            resistance_ohm=resistance_ohm,
            ocv_soc=curve_soc,
            ocv_v=curve_v,
        ),
    )
