"""Open-circuit voltage and internal resistance from a simulated discharge."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import IdentificationError
from planner.identify.battery import fit_battery

CAPACITY_AH = 5.0
RESISTANCE_OHM = 0.03
SOC = (0.0, 0.2, 0.8, 1.0)
OCV_V = (13.0, 14.6, 15.8, 16.8)


def discharge(noise_v: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voltage, current and charge of ten minutes at 10 Hz, 10 A in hover and 20 A in climbs."""
    time_s = np.arange(0.0, 600.0, 0.1)
    current = np.where(time_s % 60.0 < 15.0, 20.0, 10.0)
    charge = np.cumsum(current) * 0.1 / 3600.0
    ocv = np.interp(1.0 - charge / CAPACITY_AH, SOC, OCV_V)
    noise = noise_v * np.random.default_rng(41).standard_normal(time_s.size)
    return ocv - RESISTANCE_OHM * current + noise, current, charge


def test_a_discharge_gives_back_curve_and_resistance() -> None:
    fit = fit_battery(*discharge(), capacity_ah=CAPACITY_AH, knots=20)
    assert fit.internal_resistance_ohm.value == pytest.approx(RESISTANCE_OHM, rel=0.01)
    # between knots the true curve has a bend, off by a hundredth of a volt at most
    np.testing.assert_allclose(fit.ocv_v, np.interp(fit.ocv_soc, SOC, OCV_V), atol=0.02)
    assert fit.ocv_soc[0] == pytest.approx(1.0 - 12.5 / 6.0 / CAPACITY_AH, abs=1e-3)


def test_noise_is_within_the_errors() -> None:
    fit = fit_battery(*discharge(noise_v=0.05), capacity_ah=CAPACITY_AH)
    resistance = fit.internal_resistance_ohm
    assert abs(resistance.value - RESISTANCE_OHM) < 3.5 * resistance.error
    # 0.05 V over 6000 samples of a current that scatters by 4.3 A, if white; the bends of the curve
    # between six knots are left over, too, and remember
    white = 0.05 / (4.3 * np.sqrt(6000))
    assert white < resistance.error < 3.0 * white
    assert all(np.diff(fit.ocv_v) > 0.0)


def test_a_steady_current_tells_no_resistance() -> None:
    charge = np.linspace(0.0, 2.0, 3000)
    with pytest.raises(IdentificationError, match="hardly varies"):
        fit_battery(16.0 - charge, np.full(3000, 10.0), charge, capacity_ah=CAPACITY_AH)


def test_a_wrong_capacity_is_noticed() -> None:
    with pytest.raises(IdentificationError, match="2 Ah hold"):
        fit_battery(*discharge(), capacity_ah=2.0)


def test_little_charge_gives_no_curve() -> None:
    voltage, current, charge = (column[:200] for column in discharge())
    with pytest.raises(IdentificationError, match="too little"):
        fit_battery(voltage, current, charge, capacity_ah=CAPACITY_AH)
