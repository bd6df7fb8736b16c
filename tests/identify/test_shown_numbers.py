"""What a fit does not show is not written as identified."""

from __future__ import annotations

import datetime as dt

import numpy as np
import pytest
from made_record import make_record

from planner.identify.assembly import IdentificationSettings, _reported, made_remarks
from planner.identify.battery import PackSettings, identify_battery
from planner.identify.responses import FittedResponse, _undetermined, _without_what_is_not_shown
from planner.identify.segments import FitStatus, StateOutcome
from planner.identify.uncertainty import Estimate
from planner.physics.response import TransferFunction
from planner.report.identification import _state_lines
from planner.report.text import Medium


def fitted(
    numerator: tuple[float, ...],
    errors: tuple[float, ...],
    *,
    a0_error: float = 0.01,
    delay: tuple[float, float] = (0.5, 0.1),
) -> FittedResponse:
    delay_s, delay_error_s = delay
    system = TransferFunction(numerator=numerator, denominator=(1.0, 0.2, 0.05), delay_s=delay_s)
    return FittedResponse(
        transfer_function=system,
        estimates=(),
        window_s=None,
        coefficient_errors=(errors, (0.0, 0.05, a0_error), delay_error_s),
    )


@pytest.mark.parametrize(
    ("fit", "why"),
    [
        (fitted((4.31,), (44.0,)), "b0 would be 4.31 ± 44"),
        (fitted((0.05,), (0.001,), a0_error=0.05), "a0 would be 0.05 ± 0.05"),
        (fitted((0.02, 0.3), (0.03, 0.4)), "b0 would be 0.3 ± 0.4"),
        (fitted((0.02, 0.3), (0.03, 0.2)), ""),
        (fitted((0.05,), (0.049,)), ""),
    ],
)
def test_a_response_without_size_or_time_is_none(fit: FittedResponse, why: str) -> None:
    found = _undetermined(fit, is_power=False)
    assert found.startswith(why)
    assert bool(found) is bool(why)


def test_a_delay_or_a_zero_within_its_own_error_is_none() -> None:
    found, gone = _without_what_is_not_shown(fitted((0.02, 0.3), (0.03, 0.2), delay=(0.003, 0.04)))
    assert found.transfer_function.numerator == (0.3,)
    assert found.coefficient_errors == ((0.2,), (0.0, 0.05, 0.01), 0.04)
    assert found.transfer_function.delay_s == 0.0
    assert gone == ("b1", "delay_s")
    whole = fitted((0.02, 0.3), (0.01, 0.2))
    assert _without_what_is_not_shown(whole) == (whole, ())


@pytest.mark.parametrize(
    ("summary", "advice"),
    [
        ("no power in the log", "log battery current"),
        ("battery capacity unknown: give --capacity", "--capacity"),
        ("no steady climb or descent", "record a flight with the missing manoeuvre"),
    ],
)
def test_a_missing_sensor_has_its_own_advice(summary: str, advice: str) -> None:
    settings = IdentificationSettings(name="m", date=dt.date(2026, 1, 1), version="0")
    outcome = StateOutcome.left_out("hover", summary)
    [finding] = _reported([outcome], settings, 2.0)
    assert advice in finding.fix


def test_a_number_not_shown_is_marked_where_it_stands() -> None:
    outcome = StateOutcome(
        name="climb_power",
        summary="made",
        estimates=(
            Estimate(name="b1", value=0.5, error=0.1),
            Estimate(name="b0", value=0.01, error=0.02),
        ),
        not_shown=("b0",),
    )
    settings = IdentificationSettings(name="m", date=dt.date(2026, 1, 1), version="0")
    record = make_record(is_landed=np.zeros(10, dtype=np.bool_))
    *_, shown, not_shown = made_remarks([record], settings, [outcome])
    assert shown == "    b1 = 0.5 +- 0.1"
    assert not_shown == "    b0 = 0.01 +- 0.02, not shown"
    found = _state_lines(outcome, medium=Medium(), with_segments=False)
    assert [line.endswith("not shown") for line in found if " b" in line] == [False, True]


def test_a_resistance_within_its_own_error_is_left_out() -> None:
    generator = np.random.default_rng(3)
    samples = 3000
    current = np.where(np.arange(samples) % 100 < 50, 10.0, 11.0)
    charge = np.cumsum(current) * 0.1 / 3600.0
    for noise_v, is_shown in ((0.0, True), (3.0, False)):
        voltage = (
            16.0 - 0.4 * charge - 0.02 * current + noise_v * generator.standard_normal(samples)
        )
        record = make_record(
            is_landed=np.zeros(samples, dtype=np.bool_), current_a=current, voltage_v=voltage
        )
        found = identify_battery([record], PackSettings(capacity_ah=5.0))
        assert found.battery is not None
        assert found.outcome.status is FitStatus.IDENTIFIED
        assert (found.battery.internal_resistance_ohm is not None) is is_shown
        assert bool(found.outcome.not_shown) is not is_shown


@pytest.mark.parametrize(("damping", "is_one"), [(0.02, True), (0.005, False), (-0.1, False)])
def test_a_motion_that_hardly_comes_to_rest_is_none_and_a_power_may_ring(
    damping: float, *, is_one: bool
) -> None:
    # one radian per second, and the damping ratio
    system = TransferFunction(numerator=(1.0,), denominator=(1.0, 2.0 * damping, 1.0), delay_s=0.0)
    fit = FittedResponse(transfer_function=system, estimates=(), window_s=None)
    assert (_undetermined(fit, is_power=False) == "") is is_one
    assert _undetermined(fit, is_power=True) == ""
