from __future__ import annotations

import math

import numpy as np
import pytest

from planner.physics.response import StepResponse
from planner.physics.transfer_function import TransferFunction, TransferFunctionStack


@pytest.mark.parametrize(
    ("numerator", "denominator", "delay_s", "sentence"),
    [
        ((), (1.0,), 0.0, "numerator of a transfer function needs at least one coefficient"),
        ((1.0,), (), 0.0, "denominator of a transfer function needs at least one coefficient"),
        ((math.nan,), (1.0, 1.0), 0.0, "numerator of a transfer function must be finite"),
        ((1.0,), (1.0, math.inf), 0.0, "denominator of a transfer function must be finite"),
        ((1.0,), (0.0, 1.0), 0.0, "leading denominator coefficient must not be zero"),
        ((1.0, 0.0, 0.0), (1.0, 1.0), 0.0, "improper: numerator of degree 2 over .* degree 1"),
        ((1.0,), (1.0, 1.0), -0.1, "delay_s must be finite and not negative"),
        ((1.0,), (1.0, 1.0), math.nan, "delay_s must be finite and not negative"),
        ((1.0,), (1.0, 1.0), math.inf, "delay_s must be finite and not negative"),
    ],
)
def test_what_is_no_proper_transfer_function_is_refused(
    numerator: tuple[float, ...], denominator: tuple[float, ...], delay_s: float, sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        TransferFunction(numerator=numerator, denominator=denominator, delay_s=delay_s)


def test_leading_zeros_of_a_numerator_do_not_count() -> None:
    padded = TransferFunction(numerator=(0.0, 0.0, 0.0, 2.0), denominator=(1.0, 4.0))
    assert padded == TransferFunction(numerator=(2.0,), denominator=(1.0, 4.0))
    zero = TransferFunction(numerator=(0.0, 0.0, 0.0), denominator=(1.0, 4.0))
    assert zero.numerator == (0.0,)


def test_properties_of_a_second_order_system_by_pencil() -> None:
    # 2 s² + 1.2 s + 2: ω_n = 1, 2 ζ ω_n = 0.6, poles -0.3 ± j √0.91
    system = TransferFunction(numerator=(3.0, 8.0), denominator=(2.0, 1.2, 2.0), delay_s=0.25)
    assert system.order == 2
    assert system.dc_gain == 4.0
    assert system.natural_frequency_rad_s == pytest.approx(1.0, rel=1e-15)
    assert system.damping_ratio == pytest.approx(0.3, rel=1e-15)
    assert system.damped_period_s == pytest.approx(2.0 * math.pi / math.sqrt(0.91), rel=1e-15)
    upper, lower = system.poles
    assert upper == pytest.approx(-0.3 + 1j * math.sqrt(0.91), rel=1e-15)
    assert lower == upper.conjugate()
    assert system.is_stable
    # T + a_1/a_0 - b_1/b_0 = 0.25 + 0.6 - 0.375
    assert system.mean_residence_time_s == pytest.approx(0.475, rel=1e-15)


@pytest.mark.parametrize(
    ("denominator", "damping"), [((1.0, 2.0, 1.0), 1.0), ((1.0, 5.0, 4.0), 1.25)]
)
def test_a_system_that_does_not_swing_has_no_period(
    denominator: tuple[float, ...], damping: float
) -> None:
    system = TransferFunction(numerator=(1.0,), denominator=denominator)
    assert system.damping_ratio == damping
    assert system.damped_period_s is None


@pytest.mark.parametrize("denominator", [(1.0, 1.0), (1.0, 3.0, 3.0, 1.0), (1.0, 0.0, -1.0)])
def test_only_a_second_order_system_that_can_swing_has_frequency_and_damping(
    denominator: tuple[float, ...],
) -> None:
    system = TransferFunction(numerator=(1.0,), denominator=denominator)
    assert system.natural_frequency_rad_s is None
    assert system.damping_ratio is None
    assert system.damped_period_s is None


@pytest.mark.parametrize(
    ("numerator", "denominator", "gain", "stable"),
    [
        ((2.0,), (4.0,), 0.5, True),
        ((5.0,), (1.0, 0.0), None, False),
        ((5.0,), (1.0, 1.0, 0.0, 0.0), None, False),
        ((5.0, 0.0), (1.0, 2.0, 0.0), 2.5, False),
        ((5.0, 0.0), (1.0, 2.0), 0.0, True),
        ((0.0,), (1.0, 0.0), 0.0, False),
        ((1.0,), (1.0, 0.0, 0.25), 4.0, False),
        ((1.0,), (1.0, -1.0), -1.0, False),
        # (s² + 1)(s + 1): the rounding of its roots must not make it stable
        ((1.0,), (1.0, 1.0, 1.0, 1.0), 1.0, False),
    ],
)
def test_gain_and_stability_by_pencil(
    *,
    numerator: tuple[float, ...],
    denominator: tuple[float, ...],
    gain: float | None,
    stable: bool,
) -> None:
    system = TransferFunction(numerator=numerator, denominator=denominator)
    assert system.dc_gain == gain
    assert system.is_stable is stable


def test_poles_of_a_cubic_with_integrators_are_known() -> None:
    # s² (s + 1)(s + 2)(s + 3)
    system = TransferFunction(numerator=(1.0,), denominator=(1.0, 6.0, 11.0, 6.0, 0.0, 0.0))
    assert sorted(p.real for p in system.poles) == pytest.approx([-3, -2, -1, 0, 0], abs=1e-13)
    assert all(p.imag == 0.0 for p in system.poles)


def test_a_small_root_beside_a_large_one_keeps_its_digits() -> None:
    # s² + 1e8 s + 1: the small root is -1e-8 (1 + 1e-16 + …)
    small = TransferFunction(numerator=(1.0,), denominator=(1.0, 1e8, 1.0)).poles[1]
    assert small == pytest.approx(-1e-8, rel=1e-15)


@pytest.mark.parametrize(
    ("numerator", "denominator"),
    [((1.0,), (1.0, 0.0)), ((1.0, 0.0), (1.0, 1.0)), ((1.0,), (1.0, 0.0, 1.0))],
)
def test_without_a_steady_answer_there_is_no_mean_residence_time(
    numerator: tuple[float, ...], denominator: tuple[float, ...]
) -> None:
    system = TransferFunction(numerator=numerator, denominator=denominator)
    with pytest.raises(ValueError, match="only a stable system with a steady gain"):
        _ = system.mean_residence_time_s


@pytest.mark.parametrize(
    ("numerators", "denominators", "delay_s", "sentence"),
    [
        (np.ones((2, 1)), np.ones((3, 2)), 0.0, "same leading shape"),
        (np.ones((2, 3)), np.ones((2, 2)), 0.0, "improper"),
        (np.ones((2, 0)), np.ones((2, 2)), 0.0, "empty"),
        (np.array([[1.0], [np.nan]]), np.ones((2, 2)), 0.0, "must be finite"),
        (np.ones((2, 1)), np.array([[1.0, 1.0], [0.0, 1.0]]), 0.0, "leading denominator"),
        (np.ones((2, 1)), np.array([[1.0, 1.0], [1.0, 0.0]]), 0.0, "poles at the origin"),
        (np.ones((2, 1)), np.ones((2, 2)), np.array([0.0, -1.0]), "delays of a stack"),
    ],
)
def test_a_stack_that_does_not_fit_together_is_refused(
    numerators: np.ndarray, denominators: np.ndarray, delay_s: float | np.ndarray, sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        TransferFunctionStack(numerators=numerators, denominators=denominators, delay_s=delay_s)


def test_equal_systems_are_equal_and_hash_alike() -> None:
    one = TransferFunction(numerator=(1.0,), denominator=(1.0, 2.0))
    other = TransferFunction(numerator=(0.0, 1.0), denominator=(1.0, 2.0), delay_s=0.0)
    assert {one, other} == {one}
    assert StepResponse(system=one) == StepResponse(system=other)
