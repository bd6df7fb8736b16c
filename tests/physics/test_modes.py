"""Integrated impulse responses against their Taylor series in 150-digit arithmetic."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_systems import denominator, poles
from series_oracle import impulse_integral

from planner.physics.modes import make_modes, roots

# in units of the fastest time constant: before, across and after every change of method
RADIANS = (1e-3, 0.1, 0.9, 1.1, 3.0, 9.0, 30.0)


def largest_error(numerator: list[float], denominator_: list[float], k: int) -> float:
    """Largest error, relative to the largest value so far, over the times of `RADIANS`."""
    modes = make_modes(np.array(numerator), np.array(denominator_))
    fastest = max(np.abs(np.roots(denominator_)), default=0.0) or 1.0
    times = np.array(RADIANS) / fastest
    expected = [impulse_integral(numerator, denominator_, t, k) for t in times]
    so_far = np.maximum.accumulate(np.abs(expected))
    errors = np.abs(modes.impulse_integral(times, k) - expected)
    return float(np.max(np.divide(errors, so_far, out=errors, where=so_far > 0.0)))


CASES: dict[str, tuple[list[float], list[complex]]] = {
    "one real pole": ([2.0], [-0.5]),
    "two real poles": ([1.0, 3.0], [-0.5, -2.0]),
    "complex pair": ([1.0], [-0.2 + 1j, -0.2 - 1j]),
    "undamped pair": ([1.0, 1.0], [0.5j, -0.5j]),
    "undamped pair twice": ([1.0], [1j, -1j, 1j, -1j]),
    "double pole": ([1.0, 0.3], [-1.0, -1.0]),
    "poles 1e-9 apart": ([1.0], [-1.0, -1.0 - 1e-9]),
    "poles 1e-5 apart": ([1.0], [-1.0, -1.0 - 1e-5]),
    "poles five percent apart": ([1.0], [-1.0, -1.05]),
    "poles twelve percent apart": ([1.0], [-1.0, -1.12]),
    "triple pole": ([1.0], [-0.7] * 3),
    "sixfold pole": ([1.0], [-0.7] * 6),
    "double complex pair": ([1.0, 0.0, 2.0], [-0.1 + 1j, -0.1 - 1j] * 2),
    "integrator": ([1.0, 1.0], [0.0, -1.0]),
    "double integrator": ([0.5, 1.0], [0.0, 0.0]),
    "double integrator and double pole": ([1.0], [0.0, 0.0, -1.0, -1.0]),
    "nearly an integrator": ([1.0], [-1e-6]),
    "nearly an integrator beside a fast pole": ([1.0, 1.0], [-1.0, -1e-5]),
    "nearly two integrators": ([1.0], [0.0, -1.0, -1e-5]),
    "stiff": ([1.0], [-1000.0, -1.1]),
    "stiff with a double pole": ([1.0, 2.0], [-1000.0, -1.0, -1.0]),
    "fast pair over a slow double pole": ([1.0], [-3.0 + 9.0j, -3.0 - 9.0j, -0.01, -0.01]),
    "unstable": ([1.0], [0.5, -1.0]),
    "direct feedthrough": ([2.0, 1.0, 1.0], [-0.2 + 1j, -0.2 - 1j]),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(
    ("k", "tolerance"),
    [
        # ten thousand roundings, from the sixfold pole and 30 radians of undamped phase
        (0, 2e-12),
        (1, 2e-12),
        (2, 2e-12),
        # about t = 1/|p| the answer is still t^10/10! of the terms it is summed from
        (3, 1e-10),
        (5, 1e-7),
    ],
)
def test_closed_form_agrees_with_the_power_series(case: str, k: int, tolerance: float) -> None:
    numerator, of = CASES[case]
    assert largest_error(numerator, list(denominator(of)), k) < tolerance


@settings(max_examples=60, deadline=None)
@given(
    of=poles(damped=False),
    numerator=st.lists(st.sampled_from([-1.5, -0.1, 0.0, 0.4, 2.0]), min_size=1, max_size=3),
    k=st.integers(0, 3),
)
def test_random_systems_agree_with_the_power_series(
    of: list[complex], numerator: list[float], k: int
) -> None:
    # six poles in and beside clusters lose up to seven of sixteen digits, three poles three
    tolerance = 1e-7 if len(of) > 3 else 1e-11
    numerator = numerator[: len(of) + 1]
    assert largest_error(numerator, list(denominator(of)), k) < tolerance


@pytest.mark.parametrize("case", ["two real poles", "complex pair", "double pole", "stiff"])
def test_derivatives_obey_the_differential_equation(case: str) -> None:
    numerator, of = CASES[case]
    a = denominator(of)
    modes = make_modes(np.array(numerator), np.array(a))
    t = np.array([0.01, 0.3, 1.0, 2.0, 5.0])
    # without an input a_n h^(n) + … + a_0 h = 0
    terms = np.array([c * modes.impulse_integral(t, -k) for k, c in enumerate(reversed(a))])
    assert np.all(np.abs(terms.sum(axis=0)) <= 1e-10 * np.abs(terms).max(axis=0))


def test_nothing_happens_before_the_impulse() -> None:
    modes = make_modes(np.array([1.0, 1.0]), np.array([1.0, 1.0]))
    for k in (-1, 0, 1, 2):
        assert np.array_equal(modes.impulse_integral([-1e300, -1.0, -1e-12], k), np.zeros(3))


def test_a_pure_gain_has_only_its_feedthrough() -> None:
    modes = make_modes(np.array([3.0]), np.array([2.0]))
    assert modes.impulse_integral([0.0, 2.0], 0).tolist() == [0.0, 0.0]
    assert modes.impulse_integral([0.0, 2.0], 1).tolist() == [1.5, 1.5]
    assert modes.impulse_integral([0.0, 2.0], 3).tolist() == [0.0, 3.0]


def test_more_integrations_than_there_are_terms_are_refused() -> None:
    modes = make_modes(np.array([1.0]), np.array([1.0, 1.0]))
    with pytest.raises(ValueError, match="5 times at most, not 6"):
        modes.impulse_integral(1.0, 6)


def test_every_system_of_a_stack_answers_as_it_does_alone() -> None:
    # overdamped, critical, nearly critical, underdamped, undamped, stiff: every method in one stack
    damping = np.array([2.0, 1.0, 1.0 + 1e-9, 0.3, 0.0, 400.0])
    denominators = np.column_stack([np.ones(6), 2.0 * damping, np.ones(6)])
    numerators = np.column_stack([np.linspace(-1.0, 1.0, 6), np.full(6, 2.0)])
    t = np.array([-1.0, 0.0, 0.001, 0.5, 1.5, 4.0, 20.0, 1000.0])
    stack = make_modes(numerators[:, None, :], denominators[:, None, :])
    for k in (-1, 0, 1, 2):
        alone = [
            make_modes(b, a).impulse_integral(t, k)
            for b, a in zip(numerators, denominators, strict=True)
        ]
        together = stack.impulse_integral(t, k)
        assert together.shape == (6, 8)
        # the same sums in another order of operations
        assert together == pytest.approx(np.array(alone), rel=1e-12, abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(of=poles(damped=False))
def test_computed_roots_multiply_out_to_the_polynomial(of: list[complex]) -> None:
    coefficients = np.array(denominator([p for p in of if p]))
    back = np.poly(roots(coefficients)) if coefficients.size > 1 else np.ones(1)
    # against the sum of the moduli of the products that make up each coefficient
    moduli = np.abs(np.poly(-np.abs(roots(coefficients)))) if coefficients.size > 1 else back
    assert np.all(np.abs(back - coefficients) <= 1e-12 * moduli)


def test_conjugate_roots_are_exactly_conjugate() -> None:
    found = roots(np.array(denominator([-0.1 + 1j, -0.1 - 1j, -0.3 + 2j, -0.3 - 2j, -0.7])))
    assert math.fsum(found.imag) == 0.0
    assert set(found) == set(found.conj())
