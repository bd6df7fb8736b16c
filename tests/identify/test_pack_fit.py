"""The battery from discharges: one simulated, and those of whole flights."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record

from planner.errors import IdentificationError
from planner.identify.battery import (
    ChargeAtStart,
    PackSettings,
    charge_used_ah,
    fit_battery,
    identify_battery,
)
from planner.identify.segments import FitStatus
from planner.values import replace
from planner.vehicle.reader import load_chemistry

if TYPE_CHECKING:
    from planner.logs.record import FlightRecord

FULL_AH = 5.0
INNER_OHM = 0.03
SOC = (0.0, 0.2, 0.8, 1.0)
OCV_V = (13.0, 14.6, 15.8, 16.8)


def simulated_discharge(noise_v: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voltage, current and charge of ten minutes at 10 Hz, 10 A in hover and 20 A in climbs."""
    time_s = np.arange(0.0, 600.0, 0.1)
    current = np.where(time_s % 60.0 < 15.0, 20.0, 10.0)
    charge = np.cumsum(current) * 0.1 / 3600.0
    ocv = np.interp(1.0 - charge / FULL_AH, SOC, OCV_V)
    noise = noise_v * np.random.default_rng(41).standard_normal(time_s.size)
    return ocv - INNER_OHM * current + noise, current, charge


def test_a_discharge_gives_back_curve_and_resistance() -> None:
    fit = fit_battery(*simulated_discharge(), capacity_ah=FULL_AH, knots=20)
    assert fit.internal_resistance_ohm.value == pytest.approx(INNER_OHM, rel=0.01)
    # between knots the true curve has a bend, off by a hundredth of a volt at most
    np.testing.assert_allclose(fit.ocv_v, np.interp(fit.ocv_soc, SOC, OCV_V), atol=0.02)
    assert fit.ocv_soc[0] == pytest.approx(1.0 - 12.5 / 6.0 / FULL_AH, abs=1e-3)


def test_noise_is_within_the_errors() -> None:
    fit = fit_battery(*simulated_discharge(noise_v=0.05), capacity_ah=FULL_AH)
    resistance = fit.internal_resistance_ohm
    assert abs(resistance.value - INNER_OHM) < 3.5 * resistance.error
    # 0.05 V over 6000 samples of a current that scatters by 4.3 A, if white; the bends of the curve
    # between six knots are left over, too, and remember
    white = 0.05 / (4.3 * np.sqrt(6000))
    assert white < resistance.error < 3.0 * white
    assert all(np.diff(fit.ocv_v) > 0.0)


def test_a_steady_current_tells_no_resistance() -> None:
    charge = np.linspace(0.0, 2.0, 3000)
    with pytest.raises(IdentificationError, match="hardly varies"):
        fit_battery(16.0 - charge, np.full(3000, 10.0), charge, capacity_ah=FULL_AH)


def test_a_wrong_capacity_is_noticed() -> None:
    with pytest.raises(IdentificationError, match="2 Ah hold"):
        fit_battery(*simulated_discharge(), capacity_ah=2.0)


def test_little_charge_gives_no_curve() -> None:
    voltage, current, charge = (column[:200] for column in simulated_discharge())
    with pytest.raises(IdentificationError, match="too little"):
        fit_battery(voltage, current, charge, capacity_ah=FULL_AH)


SHAPE = load_chemistry("lipo").ocv_soc, load_chemistry("lipo").cell_ocv_v
CELLS, CAPACITY_AH, RESISTANCE_OHM = 4, 2.0, 0.05


def discharge(seed: int, *, full: float = 1.0) -> FlightRecord:
    """Ten minutes at about 6 A from a lipo pack, 10 mV of noise."""
    generator = np.random.default_rng(seed)
    time_s = np.arange(6000) * 0.1
    current = 6.0 + 2.0 * np.sign(np.sin(0.1 * time_s))
    record = make_record(is_landed=np.zeros(6000, dtype=np.bool_), current_a=current)
    cell = load_chemistry("lipo")
    left = full - charge_used_ah(record) / CAPACITY_AH
    open_v = np.interp(left, cell.ocv_soc, CELLS * np.array(cell.cell_ocv_v))
    voltage = open_v - RESISTANCE_OHM * current + 0.01 * generator.standard_normal(6000)
    return replace(record, voltage_v=voltage, parameters={"BATT_CAPACITY": 1000.0 * CAPACITY_AH})


def test_charge_is_the_integral_of_current_and_a_gap_draws_nothing() -> None:
    record = make_record(
        is_landed=np.zeros(3601, dtype=np.bool_),
        current_a=np.where(np.arange(3601) < 1800, 10.0, np.nan),
    )
    assert charge_used_ah(record)[-1] == pytest.approx(0.5, rel=1e-3)


def test_resistance_and_curve_come_back_from_several_flights() -> None:
    found = identify_battery(
        [discharge(1), discharge(2)], PackSettings(cells_in_series=CELLS, chemistry="lipo")
    )
    assert found.battery is not None
    assert found.battery.capacity_ah == CAPACITY_AH
    assert found.battery.internal_resistance_ohm == pytest.approx(RESISTANCE_OHM, rel=0.02)
    assert found.battery.ocv_v is not None
    full_v = CELLS * load_chemistry("lipo").cell_ocv_v[-1]
    assert found.battery.ocv_v[-1] == pytest.approx(full_v, rel=1e-3)
    assert found.outcome.rms == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize(
    ("kind", "whole_v"),
    [
        # by the trapezoids of its curve, from 3.50 V at nothing to 4.19 V of a full cell
        ("lipo", CELLS * (0.3535 + 0.54 + 0.9175 + 0.955 + 0.60075 + 0.4135)),
        # of lithium-polymer down to half; below, as lithium-ion, which falls more: 1.735 V of trapezoids from
        # nothing to its 3.743 V there
        (None, CELLS * (0.955 + 0.60075 + 0.4135 + 3.71 / 3.743 * 1.735)),
    ],
)
def test_the_voltage_below_what_was_used_falls_as_that_of_cells(
    kind: str | None, whole_v: float
) -> None:
    """The flight ends at half of the charge: its mean alone would promise 4 % more."""
    found = identify_battery([discharge(1)], PackSettings(chemistry=kind))
    assert found.battery is not None
    assert found.battery.ocv_soc is not None
    assert (found.battery.ocv_soc[0], found.battery.ocv_soc[-1]) == (0.0, 1.0)
    assert found.battery.energy_wh / CAPACITY_AH == pytest.approx(whole_v, rel=4e-3)
    assert "49% of the charge only" in found.readings[0]


def test_a_flight_that_did_not_begin_full_is_refused() -> None:
    found = identify_battery([discharge(1), discharge(2, full=0.6)], PackSettings())
    assert [s.refusal for s in found.outcome.segments][1].endswith("not full")
    assert found.outcome.used == 1


@pytest.mark.parametrize(
    "settings",
    [
        PackSettings(),
        PackSettings(cells_in_series=CELLS),
        PackSettings(cells_in_series=CELLS, chemistry="lipo"),
    ],
)
def test_a_log_that_begins_with_half_a_battery_is_no_full_one(settings: PackSettings) -> None:
    half = discharge(1, full=0.7)
    rest_v = CELLS * float(np.interp(0.7, *SHAPE))
    voltage = half.voltage_v.copy()
    voltage[0] = rest_v  # at arming, without load: 3.89 V a cell
    found = identify_battery([replace(half, voltage_v=voltage)], settings)
    assert found.battery is not None
    assert found.battery.ocv_v is not None
    assert found.battery.ocv_soc is not None
    assert [one.code for one in found.findings] == ["I113"]
    for charge in (0.4, 0.7, 1.0):
        open_v = CELLS * float(np.interp(charge, *SHAPE))
        read = np.interp(open_v, found.battery.ocv_v, found.battery.ocv_soc)
        assert read == pytest.approx(charge, abs=0.06)
    full = identify_battery([discharge(1)], settings)
    assert full.findings == ()


@pytest.mark.parametrize(
    ("volts", "cells", "charge"),
    [
        (11.52, None, 0.648),  # ArduPilot's simulator at 61 %: 3.84 V of three cells
        (23.4, 6, 0.716),  # 3.90 V
        (12.6, None, None),
        (16.2, None, None),  # as PX4 simulates its full battery
        (17.4, None, None),  # 4.35 V
        (25.2, 6, None),
        (24.0, 6, None),
        (23.9, 6, 0.803),
        (13.0, 4, None),  # 3.25 V: of another kind of cell, or a wrong number of them
    ],
)
def test_a_full_battery_is_told_by_the_voltage_of_its_cells(
    volts: float, cells: int | None, charge: float | None
) -> None:
    found = ChargeAtStart.of(volts, cells, "lipo")
    assert (None if found is None else found.charge) == (
        None if charge is None else pytest.approx(charge, abs=2e-3)
    )


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"parameters": {}}, "--capacity"),
        ({"current_a": np.full(6000, np.nan)}, "no flight has voltage and current"),
        ({"current_a": np.full(6000, 6.0)}, "the current hardly varies"),
    ],
)
def test_what_is_not_logged_leaves_the_battery_out(change: dict[str, object], why: str) -> None:
    record = replace(discharge(1), **change)
    found = identify_battery([record], PackSettings())
    assert found.battery is None
    assert found.outcome.status is FitStatus.LEFT_OUT
    assert why in found.outcome.summary
