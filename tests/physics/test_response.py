"""Responses against 150-digit arithmetic, against the control library, and by pencil."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_systems import denominator, poles, systems
from series_oracle import impulse_integral
from thinning import examples

from planner.physics.response import (
    Edge,
    Extremum,
    ShapedResponse,
    StepResponse,
    TransferFunction,
    make_modes,
)

if TYPE_CHECKING:
    from planner.arrays import FloatArray

STEP_S = 0.05
GRID_S = np.arange(401) * STEP_S
LAG = TransferFunction(numerator=(1.0,), denominator=(2.0, 1.0), delay_s=0.5)
SWING = TransferFunction(numerator=(1.0,), denominator=(1.0, 0.2, 1.0), delay_s=0.5)
UNDAMPED = TransferFunction(numerator=(1.0,), denominator=(1.0, 0.0, 1.0))
INTEGRATOR = TransferFunction(numerator=(3.0,), denominator=(2.0, 1.0, 0.0), delay_s=0.5)
GAIN = TransferFunction(numerator=(2.0,), denominator=(1.0,), delay_s=0.5)
CRITICAL = TransferFunction(numerator=(1.0,), denominator=(1.0, 2.0, 1.0), delay_s=0.5)

# in units of the fastest time constant: before, across and after every change of method
RADIANS = (1e-3, 0.1, 0.9, 1.1, 3.0, 9.0, 30.0)

# numerator, poles
CASES: dict[str, tuple[list[float], list[complex]]] = {
    "one real pole": ([2.0], [-0.5]),
    "two real poles": ([1.0, 3.0], [-0.5, -2.0]),
    "complex pair": ([1.0], [-0.2 + 1j, -0.2 - 1j]),
    "undamped pair": ([1.0, 1.0], [0.5j, -0.5j]),
    "hardly a pair": ([1.0, 2.0], [-1.0 + 1e-4j, -1.0 - 1e-4j]),
    "double pole": ([1.0, 0.3], [-1.0, -1.0]),
    "poles 1e-9 apart": ([1.0], [-1.0, -1.0 - 1e-9]),
    "poles 1e-5 apart": ([1.0], [-1.0, -1.0 - 1e-5]),
    "poles five percent apart": ([1.0], [-1.0, -1.05]),
    "poles twelve percent apart": ([1.0], [-1.0, -1.12]),
    "triple pole": ([1.0, 2.0, 0.5], [-0.7] * 3),
    "pair beside a real pole": ([1.0], [-0.7 + 0.02j, -0.7 - 0.02j, -0.71]),
    "pair far from a real pole": ([1.0, 0.4], [-0.2 + 1j, -0.2 - 1j, -5.0]),
    "undamped pair and a real pole": ([1.0, 0.0, 2.0], [1j, -1j, -0.3]),
    "integrator": ([1.0, 1.0], [0.0, -1.0]),
    "double integrator": ([0.5, 1.0], [0.0, 0.0]),
    "integrator and double pole": ([1.0], [0.0, -1.0, -1.0]),
    "nearly an integrator": ([1.0], [-1e-6]),
    "nearly an integrator beside a fast pole": ([1.0, 1.0], [-1.0, -1e-5]),
    "nearly two integrators": ([1.0], [0.0, -1.0, -1e-5]),
    "stiff": ([1.0], [-1000.0, -1.1]),
    "stiff with a double pole": ([1.0, 2.0], [-1000.0, -1.0, -1.0]),
    "fast pair over a slow pole": ([1.0], [-3.0 + 9.0j, -3.0 - 9.0j, -0.01]),
    "unstable": ([1.0], [0.5, -1.0]),
    "direct feedthrough": ([2.0, 1.0, 1.0], [-0.2 + 1j, -0.2 - 1j]),
}


def largest_error(numerator: list[float], denominator_: list[float], k: int) -> float:
    """Largest error, relative to the largest value so far, over the times of `RADIANS`."""
    modes = make_modes(np.array(numerator), np.array(denominator_))
    times = np.array(RADIANS) / (np.abs(np.roots(denominator_)).max(initial=0.0) or 1.0)
    expected = [impulse_integral(numerator, denominator_, t, k) for t in times]
    so_far = np.maximum.accumulate(np.abs(expected))
    errors = np.abs(modes.impulse_integral(times, k) - expected)
    return float(np.max(np.divide(errors, so_far, out=errors, where=so_far > 0.0)))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("k", range(5))
def test_closed_form_agrees_with_the_power_series(case: str, k: int) -> None:
    numerator, of = CASES[case]
    assert largest_error(numerator, list(denominator(of)), k) < 1e-13


@settings(max_examples=examples(60), deadline=None)
@given(
    of=poles(damped=False),
    numerator=st.lists(st.sampled_from([-1.5, -0.1, 0.0, 0.4, 2.0]), min_size=1, max_size=3),
    k=st.integers(0, 4),
)
def test_random_systems_agree_with_the_power_series(
    of: list[complex], numerator: list[float], k: int
) -> None:
    # a zero near a pole, and a numerator of both signs, cost up to three of sixteen digits
    assert largest_error(numerator[: len(of) + 1], list(denominator(of)), k) < 1e-12


@pytest.mark.parametrize(
    "case", ["two real poles", "complex pair", "double pole", "stiff", "pair beside a real pole"]
)
def test_derivatives_obey_the_differential_equation(case: str) -> None:
    numerator, of = CASES[case]
    a = denominator(of)
    modes = make_modes(np.array(numerator), np.array(a))
    t = np.array([0.01, 0.3, 1.0, 2.0, 5.0])
    # without an input a_n h^(n) + … + a_0 h = 0
    terms = np.array([c * modes.impulse_integral(t, -k) for k, c in enumerate(reversed(a))])
    assert np.all(np.abs(terms.sum(axis=0)) <= 1e-10 * np.abs(terms).max(axis=0))


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


def by_control(system: TransferFunction, order: int, shift_s: float = 0.0) -> FloatArray:
    """Answer of control to t^order / order! from a shift on the grid, delay included as a shift."""
    # control joins the samples of an input by straight lines: what bends is a ramp integrated
    straight = min(order, 1)
    plant = system.to_control() * control.tf([1.0], [1.0, 0.0]) ** (order - straight)
    answer = control.forced_response(plant, T=GRID_S, U=GRID_S**straight).outputs
    late = round((shift_s + system.delay_s) / STEP_S)
    return np.concatenate([np.zeros(late), answer[: answer.size - late]])


def agree(ours: FloatArray, theirs: FloatArray) -> bool:
    # control integrates a companion realisation by a matrix exponential from sample to sample:
    # over 400 samples it keeps seven digits of the largest value
    return bool(np.all(np.abs(ours - theirs) <= 1e-7 * np.abs(theirs).max() + 1e-12))


@settings(max_examples=examples(60), deadline=None)
@given(system=systems(damped=False), amplitude=st.floats(-50.0, 50.0))
def test_step_response_agrees_with_control(system: TransferFunction, amplitude: float) -> None:
    response = StepResponse(system=system, amplitude=amplitude)
    assert agree(response.value(GRID_S), amplitude * by_control(system, 0))
    # the answer to a ramp is the integral of that to a step
    assert agree(response.integral(GRID_S), amplitude * by_control(system, 1))


@settings(max_examples=examples(40), deadline=None)
@given(system=systems(damped=False), samples=st.integers(0, 200), order=st.integers(0, 2))
def test_shaped_response_agrees_with_control(
    system: TransferFunction, samples: int, order: int
) -> None:
    start_s = samples * STEP_S
    shaped = ShapedResponse(system=system, edges=(Edge(2.0), Edge(-3.0, start_s, order=order)))
    # a hair after the grid, so that both see a jump of a feedthrough on the same side
    expected = 2.0 * by_control(system, 0) - 3.0 * by_control(system, order, start_s)
    assert agree(shaped.value(GRID_S + 1e-12), expected)
    ways = 2.0 * by_control(system, 1) - 3.0 * by_control(system, order + 1, start_s)
    assert agree(shaped.integral(GRID_S + 1e-12), ways)


def test_pade_stands_for_the_delay_in_control() -> None:
    # a delay is exp(-s T); the approximation of order n is good to (ω T)^(2n + 1)
    frequency = 2.0j
    exact = complex(SWING.to_control()(frequency)) * np.exp(-frequency * SWING.delay_s)
    assert complex(SWING.to_control(pade_order=4)(frequency)) == pytest.approx(exact, rel=1e-6)
    assert complex(SWING.to_control(pade_order=1)(frequency)) == pytest.approx(exact, rel=0.1)
    assert CRITICAL.to_control().poles() == pytest.approx([-1.0, -1.0], abs=1e-6)


def test_integral_and_slope_of_a_first_order_lag_by_pencil() -> None:
    # y = 3 (1 - exp(-(t - T)/τ)), τ = 2 s, T = 0.5 s
    response = StepResponse(system=LAG, amplitude=3.0)
    t = np.array([0.0, 0.499, 0.5, 1.5, 10.5])
    left = np.exp(-np.maximum(t - 0.5, 0.0) / 2.0)
    begun = t >= 0.5
    assert response.value(t) == pytest.approx(3.0 * (1.0 - left), abs=1e-15)
    assert response.slope(t) == pytest.approx(np.where(begun, 1.5 * left, 0.0), abs=1e-15)
    way = 3.0 * (np.maximum(t - 0.5, 0.0) - 2.0 * (1.0 - left))
    assert response.integral(t) == pytest.approx(way, abs=1e-14)


def test_a_double_integrator_falls_like_a_stone() -> None:
    stone = TransferFunction(numerator=(1.0,), denominator=(1.0, 0.0, 0.0))
    fall = StepResponse(system=stone, amplitude=9.80665)
    assert float(fall.value(3.0)) == pytest.approx(9.80665 * 4.5, rel=1e-15)
    assert float(fall.slope(3.0)) == pytest.approx(9.80665 * 3.0, rel=1e-15)
    assert float(fall.integral(3.0)) == pytest.approx(9.80665 * 4.5, rel=1e-15)


def test_an_undamped_mode_swings_for_ever() -> None:
    swing = StepResponse(system=TransferFunction(numerator=(1.0,), denominator=(1.0, 0.0, 4.0)))
    t = np.linspace(0.0, 1000.0, 777)
    # phase of 2000 rad: its rounding alone is 2e-13
    assert swing.value(t) == pytest.approx((1.0 - np.cos(2.0 * t)) / 4.0, abs=1e-12)


def test_direct_feedthrough_jumps_and_its_impulse_is_left_out() -> None:
    # (2 s + 1)/(s + 1) = 2 - 1/(s + 1): y = 2 - (1 - exp(-t)) after a delay of 1 s
    system = TransferFunction(numerator=(2.0, 1.0), denominator=(1.0, 1.0), delay_s=1.0)
    response = StepResponse(system=system)
    assert response.value([0.999, 1.0, 2.0]) == pytest.approx([0.0, 2.0, 1.0 + math.exp(-1.0)])
    assert response.slope([0.999, 1.0, 2.0]) == pytest.approx([0.0, -1.0, -math.exp(-1.0)])


def test_a_pure_gain_has_only_its_feedthrough() -> None:
    response = StepResponse(system=GAIN, amplitude=5.0)
    assert response.value([0.4, 0.5, 2.5]).tolist() == [0.0, 10.0, 10.0]
    assert response.slope([0.4, 0.5, 2.5]).tolist() == [0.0, 0.0, 0.0]
    assert response.integral([0.5, 2.5]).tolist() == [0.0, 20.0]
    assert response.settling_times_s(0.1) == pytest.approx(0.5, rel=1e-15)
    assert response.first_crossing_s(7.0) == pytest.approx(0.5, rel=1e-15)


def test_a_short_leg_covers_its_length_exactly() -> None:
    # with unit steady gain a speed v held for L / v covers L, however short the leg
    system = TransferFunction(numerator=(0.36,), denominator=(1.0, 0.93, 0.36), delay_s=0.6)
    lengths_m = np.array([0.1, 3.0, 500.0])
    leg = ShapedResponse(system=system, edges=(Edge(10.0), Edge(-10.0, lengths_m / 10.0)))
    assert leg.integral(200.0) == pytest.approx(lengths_m, rel=1e-13, abs=1e-12)


def test_edges_and_times_broadcast() -> None:
    amplitudes = np.array([1.0, -2.0, 30.0])
    starts = np.array([0.5, 2.0, 40.0])
    t = np.linspace(0.0, 60.0, 11)
    edges = (Edge(amplitudes[:, None]), Edge(-amplitudes[:, None], starts[:, None], order=1))
    together = ShapedResponse(system=LAG, edges=edges)
    for of in ("value", "integral"):
        answers = getattr(together, of)(t)
        assert answers.shape == (3, 11)
        for row, amplitude, start in zip(answers, amplitudes, starts, strict=True):
            own = (Edge(float(amplitude)), Edge(-float(amplitude), float(start), order=1))
            alone = ShapedResponse(system=LAG, edges=own)
            assert np.array_equal(row, getattr(alone, of)(t))


@pytest.mark.parametrize("shape", [(), (1,), (4,), (2, 3), (0,)])
def test_the_answer_has_the_shape_of_the_times(shape: tuple[int, ...]) -> None:
    assert StepResponse(system=LAG).value(np.ones(shape)).shape == shape


def test_a_lag_settles_when_its_exponential_says_so() -> None:
    response = StepResponse(system=LAG, amplitude=-10.0)
    tolerances = np.array([[5.0, 0.1], [11.0, 1e-9]])
    times = response.settling_times_s(tolerances)
    assert times.shape == (2, 2)
    # a distance of 11 is never exceeded
    assert times[1, 0] == 0.0
    assert response.settling_times_s([]).shape == (0,)
    expected = 0.5 + 2.0 * np.log(10.0 / tolerances)
    assert times[0] == pytest.approx(expected[0], rel=1e-13)
    # at 1e-9 of 10 the rounding of the value shifts the time by 2 s · 1e-15 / 1e-9
    assert times[1, 1] == pytest.approx(expected[1, 1], abs=1e-5)


def test_a_lag_reaches_what_lies_between_rest_and_its_end() -> None:
    response = StepResponse(system=LAG, amplitude=10.0)
    assert response.first_crossing_s(0.0) == 0.0
    for level in (2.5, 9.9):
        reached = response.first_crossing_s(level)
        assert reached == pytest.approx(0.5 - 2.0 * math.log(1.0 - level / 10.0), rel=1e-13)
    assert [response.first_crossing_s(level) for level in (-1.0, 12.0)] == [None, None]


@pytest.mark.parametrize("zero", [0.94, 1.0, 1.06, 2.9, 3.0, 3.3])
def test_a_zero_beside_a_pole_turns_the_answer_only_where_it_is_the_slower_one(zero: float) -> None:
    # (s + z) / ((s + 1) (s + 3)) has the impulse response ((z − 1) e^−t + (3 − z) e^−3t) / 2: it changes
    # its sign only for z < 1, where the step passes its end z / 3; for z > 3 at a time before 0.
    response = StepResponse(
        system=TransferFunction(numerator=(1.0, zero), denominator=(1.0, 4.0, 3.0))
    )
    times = np.linspace(0.0, 20.0, 2001)
    expected = 0.5 * (
        (zero - 1.0) * (1.0 - np.exp(-times)) + (3.0 - zero) / 3.0 * (1.0 - np.exp(-3.0 * times))
    )
    np.testing.assert_allclose(response.value(times), expected, atol=1e-14)
    overshoot = response.first_crossing_s(zero / 3.0 * 1.0001)
    assert (overshoot is not None) is (zero < 1.0)
    settled = float(response.settling_times_s(1e-3))
    outside = times[np.abs(expected - zero / 3.0) > 1e-3]
    assert outside[-1] <= settled <= outside[-1] + 0.01


@pytest.mark.parametrize("system", [UNDAMPED, INTEGRATOR])
def test_what_swings_or_grows_for_ever_has_no_end(system: TransferFunction) -> None:
    response = StepResponse(system=system)
    for question in (
        lambda: response.final_value,
        lambda: response.settling_times_s(0.1),
        lambda: response.first_crossing_s(0.5),
        response.peak_slope,
    ):
        with pytest.raises(ValueError, match="not stable"):
            question()


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan])
def test_a_tolerance_that_is_not_positive_is_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        StepResponse(system=LAG).settling_times_s(tolerance)


def test_a_jump_at_the_start_reaches_the_levels_it_passes() -> None:
    # 1 + exp(-t)
    system = TransferFunction(numerator=(2.0, 1.0), denominator=(1.0, 1.0))
    response = StepResponse(system=system)
    assert response.first_crossing_s(0.5) == 0.0
    assert response.first_crossing_s(2.0) == 0.0
    assert response.first_crossing_s(2.1) is None
    assert response.first_crossing_s(-0.1) is None


def test_nothing_commanded_is_settled_from_the_start() -> None:
    response = StepResponse(system=SWING, amplitude=0.0)
    assert response.final_value == 0.0
    assert response.settling_times_s(0.1) == 0.0
    assert response.first_crossing_s(1.0) is None


def test_hardly_damped_settling_far_away_is_found() -> None:
    # ζ = 1e-6, ω = 1: |1 - y| < 0.1 only after ln(10)/1e-6 s, 730 thousand half periods
    system = TransferFunction(numerator=(1.0,), denominator=(1.0, 2e-6, 1.0))
    settled = float(StepResponse(system=system).settling_times_s(0.1))
    last_turn_s = math.log(10.0) / 1e-6
    assert last_turn_s - math.pi <= settled <= last_turn_s + math.pi
    away = 1.0 - float(StepResponse(system=system).value(settled))
    assert abs(away) == pytest.approx(0.1, abs=1e-9)


def test_a_swing_turns_every_half_period() -> None:
    root = math.sqrt(0.99)
    shrinking = math.exp(-math.pi * 0.1 / root)
    response = StepResponse(system=SWING, amplitude=-2.0)
    first, second = (0.5 + n * math.pi / root for n in (1, 2))
    lowest = response.extremum(40.0, highest=False)
    assert lowest.time_s == pytest.approx(first, rel=1e-14)
    assert lowest.value == pytest.approx(-2.0 * (1.0 + shrinking), rel=1e-14)
    # the window ends before the first turn, between the first and the second, after it
    assert response.extremum(first - 0.1, highest=False).time_s == first - 0.1
    assert response.extremum(second - 0.1, highest=True) == Extremum(0.0, 0.0)
    # before the delay has passed nothing has happened
    assert response.extremum(0.4, highest=False).value == 0.0


@pytest.mark.parametrize(
    ("numerator", "of"),
    [
        ([1.0], [-0.05 + 1j, -0.05 - 1j, -0.4]),
        ([1.0, 0.4, 2.0], [-0.1 + 2j, -0.1 - 2j, -3.0]),
        ([1.0, 0.0, 1.0], [-0.02 + 0.5j, -0.02 - 0.5j, -0.02]),
        ([3.0, -2.0, 1.0], [-0.2, -0.5, -1.5]),
        ([1.0, -1.0, 0.3], [-0.5, -0.5, -0.5]),
    ],
)
def test_a_third_order_response_is_cut_at_every_turn(
    numerator: list[float], of: list[complex]
) -> None:
    # the last time outside of each of many bands, by samples 10 ms apart
    system = TransferFunction(numerator=tuple(numerator), denominator=denominator(of))
    response = StepResponse(system=system)
    dense = np.arange(0.0, 250.0, 0.01)
    away = np.abs(response.value(dense) - response.final_value)
    tolerances = np.geomspace(0.02, 0.98, 40) * away.max()
    settled = response.settling_times_s(tolerances)
    last = [dense[np.flatnonzero(away > tolerance)[-1]] for tolerance in tolerances]
    assert settled == pytest.approx(np.array(last), abs=0.011)


def test_a_level_before_two_turns_close_to_each_other_is_reached_before_them() -> None:
    # h = (e^-t - 0.5) (e^-t - 0.45) e^-t falls below zero between ln 2 and ln(1/0.45) = 0.7985 s: by the
    # partial fractions 0.225, -0.95 and 1 at the poles -1, -2 and -3.
    system = TransferFunction(
        numerator=(0.275, 0.325, 0.5), denominator=tuple(denominator([-1.0, -2.0, -3.0]))
    )
    response = StepResponse(system=system)

    def value(time_s: float) -> float:
        x = math.exp(-time_s)
        return 0.225 * (1 - x) - 0.475 * (1 - x**2) + (1 - x**3) / 3

    assert response.value([0.3, 0.75, 4.0]) == pytest.approx([value(t) for t in (0.3, 0.75, 4.0)])
    for level in (value(0.68), value(0.74)):  # the second is reached while it rises, too
        reached = response.first_crossing_s(level)
        assert reached is not None
        assert reached < math.log(2.0)
        assert value(reached) == pytest.approx(level, abs=1e-12)


def test_steepest_slope_of_a_critical_answer() -> None:
    # dy/dt = t exp(-t) is largest at 1 s
    for amplitude in (1.0, -3.0):
        steepest = StepResponse(system=CRITICAL, amplitude=amplitude).peak_slope()
        assert steepest.time_s == pytest.approx(1.5, rel=1e-14)
        assert steepest.value == pytest.approx(amplitude * math.exp(-1.0), rel=1e-14)


def test_the_slope_of_a_lag_is_steepest_at_its_delay() -> None:
    assert StepResponse(system=LAG, amplitude=4.0).peak_slope() == Extremum(0.5, 2.0)


@pytest.mark.parametrize("window_s", [0.0, -1.0, math.inf, math.nan])
def test_a_window_that_is_none_is_refused(window_s: float) -> None:
    with pytest.raises(ValueError, match="window must be positive and finite"):
        StepResponse(system=LAG).extremum(window_s, highest=True)


def test_a_search_through_millions_of_swings_is_refused() -> None:
    with pytest.raises(ValueError, match="too many oscillations"):
        StepResponse(system=UNDAMPED).extremum(1e8, highest=True)


DENSE_S = np.concatenate([np.linspace(0.0, 30.0, 1501), np.geomspace(30.0, 3000.0, 501)])


@settings(max_examples=examples(60), deadline=None)
@given(system=systems(), fraction=st.sampled_from([0.3, 0.05, 0.02, 1e-4]))
def test_a_settled_response_stays_and_was_outside_before(
    system: TransferFunction, fraction: float
) -> None:
    response = StepResponse(system=system, amplitude=-2.0)
    final = response.final_value
    away = np.abs(response.value(DENSE_S) - final)
    tolerance = fraction * float(away.max()) + 1e-9
    settled = float(response.settling_times_s(tolerance))
    later = DENSE_S[settled < DENSE_S]
    assert np.all(np.abs(response.value(later) - final) <= tolerance * (1.0 + 1e-9))
    if settled > 0.0:
        # at the time it is on the band, or jumps into it
        around = np.abs(response.value([settled - 1e-9, settled, settled + 1e-9]) - final)
        slack = 1e-9 * (1.0 + np.abs(response.slope([settled - 1e-9, settled])).max())
        assert around[0] >= tolerance - slack
        assert around[2] <= tolerance + slack


@settings(max_examples=examples(60), deadline=None)
@given(system=systems(damped=False), window_s=st.sampled_from([3.0, 20.0]))
def test_no_sample_lies_beyond_the_extrema(system: TransferFunction, window_s: float) -> None:
    response = StepResponse(system=system, amplitude=-2.0)
    values = response.value(np.linspace(0.0, window_s, 1001))
    size = float(np.abs(values).max())
    highest = response.extremum(window_s, highest=True)
    lowest = response.extremum(window_s, highest=False)
    assert values.max() <= highest.value + 1e-12 * size
    assert values.min() >= lowest.value - 1e-12 * size
    for point in (highest, lowest):
        assert 0.0 <= point.time_s <= window_s
        assert float(response.value(point.time_s)) == point.value


@settings(max_examples=examples(60), deadline=None)
@given(system=systems())
def test_no_sample_is_steeper_than_the_peak_slope(system: TransferFunction) -> None:
    response = StepResponse(system=system, amplitude=-2.0)
    steepest = response.peak_slope()
    assert np.abs(response.slope(DENSE_S)).max() <= abs(steepest.value) * (1.0 + 1e-12) + 1e-300
    assert float(response.slope(steepest.time_s)) == steepest.value


@settings(max_examples=examples(60), deadline=None)
@given(system=systems(), fraction=st.floats(0.01, 0.99))
def test_no_sample_reaches_a_level_before_its_first_crossing(
    system: TransferFunction, fraction: float
) -> None:
    response = StepResponse(system=system, amplitude=1.5)
    values = response.value(DENSE_S)
    level = fraction * float(values[np.argmax(np.abs(values))])
    time_s = response.first_crossing_s(level)
    assert time_s is not None
    if level == 0.0:
        assert time_s == 0.0
        return
    assert np.all(values[time_s > DENSE_S] / level <= 1.0 + 1e-9)
    around = response.value([time_s - 1e-9, time_s + 1e-9]) / level
    slack = 1e-9 * (1.0 + np.abs(response.slope([time_s - 1e-9, time_s])).max() / abs(level))
    assert around[0] <= 1.0 + slack
    assert around[1] >= 1.0 - slack


@pytest.mark.parametrize(
    ("numerator", "denominator", "delay_s", "sentence"),
    [
        ((), (1.0,), 0.0, "numerator of a transfer function needs finite coefficients"),
        ((1.0,), (), 0.0, "denominator of a transfer function needs finite coefficients"),
        ((math.nan,), (1.0, 1.0), 0.0, "numerator of a transfer function needs finite"),
        ((1.0,), (1.0, math.inf), 0.0, "denominator of a transfer function needs finite"),
        ((1.0,), (0.0, 1.0), 0.0, "leading denominator coefficient must not be zero"),
        ((1.0, 0.0, 0.0), (1.0, 1.0), 0.0, "degree 2 over degree 1"),
        ((1.0,), (1.0, 1.0, 1.0, 1.0, 1.0), 0.0, "order 3 at most"),
        ((1.0,), (1.0, 1.0), -0.1, "delay_s must be finite and not negative"),
        ((1.0,), (1.0, 1.0), math.nan, "delay_s must be finite and not negative"),
        ((1.0,), (1.0, 1.0), math.inf, "delay_s must be finite and not negative"),
    ],
)
def test_what_is_no_transfer_function_of_low_order_is_refused(
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
        ((5.0, 0.0), (1.0, 2.0), 0.0, True),
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
