"""The battery from the discharges of flights."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record

from planner.identify.battery import PackSettings, charge_used_ah, identify_battery
from planner.identify.segments import FitStatus
from planner.values import replace
from planner.vehicle.reader import load_chemistry

if TYPE_CHECKING:
    from planner.logs.record import FlightRecord

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


def test_without_a_kind_of_cell_the_mean_voltage_stands_for_the_curve() -> None:
    found = identify_battery([discharge(1)], PackSettings(cells_in_series=CELLS))
    assert found.battery is not None
    assert found.battery.ocv_v is None
    assert found.battery.nominal_voltage_v == pytest.approx(CELLS * 3.8, rel=0.05)
    assert "mean" in found.readings[0]


def test_a_flight_that_did_not_begin_full_is_refused() -> None:
    found = identify_battery([discharge(1), discharge(2, full=0.6)], PackSettings())
    assert [s.refusal for s in found.outcome.segments][1].endswith("not full")
    assert found.outcome.used == 1


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
