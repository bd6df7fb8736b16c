"""A voltage without load is read on the curve of the flights or of the cells, whatever a label says."""

from __future__ import annotations

import pytest
from flown_battery import FLOWN

from planner.errors import UsageError
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.pack import flown_pack, rest_curve


@pytest.mark.parametrize("label_v", [None, 10.8, 11.1, 11.34, 11.4, 11.55])
@pytest.mark.parametrize("charge_ah", [4.0, 8.0])
def test_a_label_does_not_change_what_a_voltmeter_means(
    label_v: float | None, charge_ah: float
) -> None:
    """0.5 and (11.299 - 11.129) / (11.789 - 11.129) of the quarter above it: 56.4 %."""
    label = Battery(capacity_ah=charge_ah, nominal_voltage_v=label_v) if label_v else None
    pack = flown_pack(label, FLOWN)
    assert pack.charge_at_rest(11.299) == pytest.approx(0.564, abs=0.0005)
    assert pack.charge_at_rest(11.129) == pytest.approx(0.5)


def test_a_label_scales_what_the_battery_holds() -> None:
    pack = flown_pack(Battery(capacity_ah=8.0, nominal_voltage_v=11.1), FLOWN).battery
    assert pack is not None
    assert pack.energy_wh == pytest.approx(88.8)
    circuit = pack.circuit(20.0)
    assert circuit is not None
    assert circuit.delivered_wh(0.0, 1.0, 0.0) == pytest.approx(88.8)


@pytest.mark.parametrize("label_v", [10.8, 11.1, 11.55])
def test_full_and_empty_are_those_of_the_flights_beside_a_label(label_v: float) -> None:
    """12.569 V and 1 % of it, 12.695 V; 10.499 V."""
    pack = flown_pack(Battery(capacity_ah=8.0, nominal_voltage_v=label_v), FLOWN)
    assert pack.charge_at_rest(12.69) == 1.0
    assert pack.charge_at_rest(10.499) == pytest.approx(0.0)
    for voltage_v in (12.70, 10.49):
        with pytest.raises(UsageError, match=r"10\.5 V when empty and 12\.6 V when full"):
            pack.charge_at_rest(voltage_v)


def test_age_changes_nothing_of_it() -> None:
    pack = flown_pack(Battery(capacity_ah=8.0, nominal_voltage_v=11.1), FLOWN).battery
    assert pack is not None
    curve = rest_curve(pack.aged(health=0.8, resistance_factor=2.0))
    assert curve is not None
    assert curve.voltage_v.tolist() == pytest.approx(FLOWN.ocv_v)


def test_a_label_of_fewer_cells_beside_a_model_that_does_not_say_how_many_is_of_as_many_less() -> (
    None
):
    """Eight cells from 3.5 to 4.2 V, 30.8 V in the mean: 26.95 V are seven, full at 29.4 V."""
    eight = Battery(capacity_ah=8.0, ocv_soc=(0.0, 1.0), ocv_v=(28.0, 33.6))
    pack = flown_pack(Battery(capacity_ah=8.0, nominal_voltage_v=26.95), eight)
    assert pack.charge_at_rest(29.4) == pytest.approx(1.0)
    assert pack.charge_at_rest(26.95) == pytest.approx(0.5)
    stated = flown_pack(
        Battery(capacity_ah=8.0, nominal_voltage_v=29.6), replace(eight, cells_in_series=8)
    )
    assert stated.charge_at_rest(30.8) == pytest.approx(0.5)
