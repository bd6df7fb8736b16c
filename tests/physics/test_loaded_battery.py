"""The battery under load by pencil, by its own energy, and against small steps of time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.physics.battery import BatteryCircuit, joined, loaded_voltage_v
from planner.values import replace

SOC = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
OCV_V = (21.0, 21.42, 21.78, 22.26, 23.58, 24.48, 25.14)
"""Six cells of the chemistry lipo."""
CAPACITY_AH, RESISTANCE_OHM = 8.0, 0.05
BATTERY = BatteryCircuit(
    capacity_ah=CAPACITY_AH, resistance_ohm=RESISTANCE_OHM, ocv_soc=SOC, ocv_v=OCV_V
)
STRAIGHT = BatteryCircuit(capacity_ah=5.0, ocv_soc=(0.0, 1.0), ocv_v=(12.0, 16.0))


def test_the_voltage_under_load_gives_the_power_and_the_drop() -> None:
    # 25² − 4 x 0.0245 x 500 = 576 = 24²
    voltage_v = float(loaded_voltage_v(25.0, 500.0, resistance_ohm=0.0245))
    assert voltage_v == pytest.approx(24.5)
    current_a = 500.0 / voltage_v
    assert 25.0 - 0.0245 * current_a == pytest.approx(voltage_v)


def test_no_battery_delivers_more_than_its_matched_load() -> None:
    # E² / 4 R = 100 / 0.4 = 250 W at E / 2
    assert loaded_voltage_v(10.0, 250.0, resistance_ohm=0.1) == pytest.approx(5.0)
    assert loaded_voltage_v(10.0, 400.0, resistance_ohm=0.1) == pytest.approx(5.0)


def test_the_cut_off_is_reached_where_the_curve_says_so() -> None:
    # E = 12.5 + 0.02 x 250 / 12.5 = 12.9 V, which is 22.5 % on a curve from 12 to 16 V
    empty = replace(STRAIGHT, resistance_ohm=0.02).empty_state_of_charge(250.0, 12.5)
    assert empty == pytest.approx(0.225)


def test_without_a_cut_off_a_battery_ends_where_it_cannot_deliver() -> None:
    # 2 sqrt(R P) = 2 sqrt(0.2 x 245) = 14 V, half of the curve
    empty = replace(STRAIGHT, resistance_ohm=0.2).empty_state_of_charge(245.0, 0.0)
    assert empty == pytest.approx(0.5)


def test_without_a_load_or_a_cut_off_a_battery_ends_empty() -> None:
    assert replace(STRAIGHT, resistance_ohm=0.2).empty_state_of_charge(0.0, 0.0) == 0.0
    # Without a resistance and without a cut-off it is used down to the end of its curve.
    assert replace(STRAIGHT, resistance_ohm=0.0).empty_state_of_charge(250.0, 0.0) == 0.0


def test_at_no_current_all_the_energy_of_the_curve_is_there() -> None:
    # Q times the mean of 12 and 16 V; from three quarters, 5 x (15 + 12) / 2 x 0.75
    for start, energy_wh in ((1.0, 70.0), (0.75, 50.625)):
        battery = replace(STRAIGHT, resistance_ohm=0.3)
        assert battery.delivered_wh(0.0, start, 0.0) == pytest.approx(energy_wh)


def test_a_load_without_resistance_takes_its_energy_from_the_curve() -> None:
    # 5 Ah from 12 to 16 V, half an hour at 70 W: 12 (1 − s) + 2 (1 − s²) = 7, s = (√200 − 12) / 4
    [left] = STRAIGHT.state_of_charge_after([70.0], [0.0], [1800.0], from_soc=1.0)
    # One load is one step of the middle rule: E changes by 13 % over it.
    assert left == pytest.approx((math.sqrt(200.0) - 12.0) / 4.0, abs=5e-4)


def _stepped(power_w: np.ndarray, duration_s: np.ndarray, steps: int) -> float:
    """Return the charge left by Heun's method in small steps of time."""

    def rate(soc: float, load_w: float) -> float:
        volts = float(np.interp(soc, SOC, OCV_V))
        root = math.sqrt(volts * volts - 4.0 * RESISTANCE_OHM * load_w)
        return -(volts - root) / (2.0 * RESISTANCE_OHM) / (3600.0 * CAPACITY_AH)

    soc = 1.0
    for load_w, lasting_s in zip(power_w.tolist(), duration_s.tolist(), strict=True):
        step_s = lasting_s / steps
        for _ in range(steps):
            first = rate(soc, load_w)
            soc += 0.5 * step_s * (first + rate(soc + step_s * first, load_w))
    return soc


def test_a_row_of_loads_ends_where_small_steps_of_time_end() -> None:
    random = np.random.default_rng(5)
    power_w, duration_s = random.uniform(150.0, 500.0, 90), random.uniform(5.0, 20.0, 90)
    left = BATTERY.state_of_charge_after(power_w, np.zeros(90), duration_s, from_soc=1.0)
    assert left[-1] == pytest.approx(_stepped(power_w, duration_s, 20), abs=2e-5)
    assert (np.diff(left) < 0.0).all()


def test_rows_of_loads_and_several_batteries_are_each_as_alone() -> None:
    random = np.random.default_rng(7)
    shape = 12, 40  # loads of each row, rows
    power_w, duration_s = random.uniform(0.0, 900.0, shape), random.uniform(0.0, 60.0, shape)
    variance_w2, begun = random.uniform(0.0, 1e3, shape), random.uniform(0.2, 1.0, (3, shape[1]))
    batteries = [
        replace(BATTERY, resistance_ohm=ohm, capacity_ah=ah)
        for ohm, ah in (
            (RESISTANCE_OHM, 5.0),
            (0.1, 4.0),
            (0.3, 3.0),
        )  # the last cannot give it all
    ]
    loads = (one[:, None] for one in (power_w, variance_w2, duration_s))
    together = joined(batteries).over_an_axis().state_of_charge_after(*loads, from_soc=begun)
    assert together.shape == (12, 3, 40)
    for number, battery in enumerate(batteries):
        for row in range(shape[1]):
            alone = battery.state_of_charge_after(
                power_w[:, row],
                variance_w2[:, row],
                duration_s[:, row],
                from_soc=begun[number, row],
            )
            assert np.array_equal(together[:, number, row], alone)


def test_a_load_that_varies_takes_the_charge_of_its_parts() -> None:
    after = replace(BATTERY, ocv_soc=(0.0, 1.0), ocv_v=(24.0, 24.0 + 1e-9)).state_of_charge_after
    # 200 and 400 W in turns: 300 W in the mean, with a variance of 100² W²
    [mixed] = after([300.0], [1e4], [600.0], from_soc=1.0)
    parts = after([200.0, 400.0], [0.0, 0.0], [300.0, 300.0], from_soc=1.0)
    assert 1.0 - mixed == pytest.approx(1.0 - parts[-1], rel=2e-5)
    [even] = after([300.0], [0.0], [600.0], from_soc=1.0)
    assert mixed < even  # the losses of the high half weigh more


@given(
    power_w=st.floats(min_value=10.0, max_value=900.0),
    start=st.floats(min_value=0.3, max_value=1.0),
    hours=st.floats(min_value=0.01, max_value=0.2),
)
@settings(max_examples=examples(60), deadline=None)
def test_the_energy_delivered_is_power_times_time(
    power_w: float, start: float, hours: float
) -> None:
    count = 60
    every_s = np.full(count, 3600.0 * hours / count)
    left = BATTERY.state_of_charge_after(
        np.full(count, power_w), np.zeros(count), every_s, from_soc=start
    )
    if left[-1] > 0.0:
        energy_wh = BATTERY.delivered_wh(power_w, start, float(left[-1]))
        # Sixty middle-rule steps over kinks of the curve.
        assert energy_wh == pytest.approx(power_w * hours, rel=2e-4)


@given(
    power_w=st.floats(min_value=50.0, max_value=800.0),
    more_ohm=st.floats(min_value=0.0, max_value=0.1),
    more_w=st.floats(min_value=0.0, max_value=300.0),
)
@settings(max_examples=examples(60), deadline=None)
def test_more_resistance_and_a_higher_rate_never_leave_more_to_use(
    power_w: float, more_ohm: float, more_w: float
) -> None:
    def usable_wh(load_w: float, resistance_ohm: float) -> float:
        battery = replace(BATTERY, resistance_ohm=resistance_ohm)
        return battery.delivered_wh(load_w, 1.0, battery.empty_state_of_charge(load_w, 21.0))

    new = usable_wh(power_w, RESISTANCE_OHM)
    assert usable_wh(power_w, RESISTANCE_OHM + more_ohm) <= new + 1e-9
    assert usable_wh(power_w + more_w, RESISTANCE_OHM) <= new + 1e-9
