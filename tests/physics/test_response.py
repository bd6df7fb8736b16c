"""Responses against the control library, by pencil, and against each other."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_systems import systems

from planner.physics.response import (
    Edge,
    PulseResponse,
    RampResponse,
    Response,
    ShapedResponse,
    StepResponse,
)
from planner.physics.transfer_function import TransferFunction, TransferFunctionStack

if TYPE_CHECKING:
    from planner.physics.modes import FloatArray

STEP_S = 0.05
GRID_S = np.arange(401) * STEP_S
LAG = TransferFunction(numerator=(1.0,), denominator=(2.0, 1.0), delay_s=0.5)


def simulated(system: TransferFunction, order: int, shift_s: float) -> FloatArray:
    """Answer of control to t^order from a shift on the grid, delay included as a shift."""
    plant = control.tf(list(system.numerator), list(system.denominator))
    answer = control.forced_response(plant, T=GRID_S, U=GRID_S**order).outputs
    late = round((shift_s + system.delay_s) / STEP_S)
    return np.concatenate([np.zeros(late), answer[: answer.size - late]])


def agree(ours: FloatArray, theirs: FloatArray) -> bool:
    # control integrates a companion realisation by a matrix exponential from sample to sample:
    # over 400 samples it keeps seven digits of the largest value
    return bool(np.all(np.abs(ours - theirs) <= 1e-7 * np.abs(theirs).max() + 1e-12))


@settings(max_examples=40, deadline=None)
@given(system=systems(largest_order=4, damped=False), amplitude=st.floats(-50.0, 50.0))
def test_step_response_agrees_with_control(system: TransferFunction, amplitude: float) -> None:
    ours = StepResponse(system=system, amplitude=amplitude).value(GRID_S)
    assert agree(ours, amplitude * simulated(system, 0, 0.0))


@settings(max_examples=30, deadline=None)
@given(system=systems(largest_order=4, damped=False), samples=st.integers(0, 200))
def test_pulse_response_agrees_with_control(system: TransferFunction, samples: int) -> None:
    width_s = samples * STEP_S
    # a hair after the grid, so that both see a jump of a feedthrough on the same side
    ours = PulseResponse(system=system, width_s=width_s).value(GRID_S + 1e-12)
    assert agree(ours, simulated(system, 0, 0.0) - simulated(system, 0, width_s))


@settings(max_examples=30, deadline=None)
@given(
    system=systems(largest_order=4, damped=False),
    samples=st.one_of(st.none(), st.integers(0, 200)),
)
def test_ramp_response_agrees_with_control(system: TransferFunction, samples: int | None) -> None:
    duration_s = None if samples is None else samples * STEP_S
    ours = RampResponse(system=system, rate_per_s=1.0, duration_s=duration_s).value(GRID_S)
    theirs = simulated(system, 1, 0.0)
    if duration_s is not None:
        theirs = theirs - simulated(system, 1, duration_s)
    assert agree(ours, theirs)


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


def test_answer_to_a_ramp_lags_by_the_mean_residence_time() -> None:
    response = RampResponse(system=LAG, rate_per_s=4.0)
    assert float(response.value(200.0)) == pytest.approx(4.0 * (200.0 - 2.5), rel=1e-14)
    assert LAG.mean_residence_time_s == 2.5


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
    assert swing.final_value is None


def test_direct_feedthrough_jumps_and_its_impulse_is_left_out() -> None:
    # (2 s + 1)/(s + 1) = 2 - 1/(s + 1): y = 2 - (1 - exp(-t)) after a delay of 1 s
    system = TransferFunction(numerator=(2.0, 1.0), denominator=(1.0, 1.0), delay_s=1.0)
    response = StepResponse(system=system)
    assert response.value([0.999, 1.0, 2.0]) == pytest.approx([0.0, 2.0, 1.0 + math.exp(-1.0)])
    assert response.slope([0.999, 1.0, 2.0]) == pytest.approx([0.0, -1.0, -math.exp(-1.0)])


def test_a_short_leg_covers_its_length_exactly() -> None:
    # with unit steady gain a speed v held for L / v covers L, however short the leg
    system = TransferFunction(numerator=(0.36,), denominator=(1.0, 0.93, 0.36), delay_s=0.6)
    for length_m in (0.1, 3.0, 500.0):
        leg = PulseResponse(system=system, amplitude=10.0, width_s=length_m / 10.0)
        assert float(leg.integral(200.0)) == pytest.approx(length_m, rel=1e-13, abs=1e-12)


def any_response(system: TransferFunction) -> list[Response]:
    return [
        StepResponse(system=system, amplitude=-2.0),
        PulseResponse(system=system, amplitude=1.5, width_s=1.3),
        RampResponse(system=system, rate_per_s=0.7),
        RampResponse(system=system, rate_per_s=0.7, duration_s=2.0),
        ShapedResponse(
            system=system,
            reference=(
                Edge(order=3, amplitude=1.0),
                Edge(start_s=0.8, order=3, amplitude=-2.0),
                Edge(start_s=1.6, order=3, amplitude=1.0),
                Edge(start_s=2.0, order=0, amplitude=-0.3),
            ),
        ),
    ]


@settings(max_examples=25, deadline=None)
@given(system=systems(largest_order=4, damped=False))
def test_slope_and_integral_belong_to_the_value(system: TransferFunction) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(12)
    for response in any_response(system):
        # between the edges, in pieces short beside the fastest mode of 10 rad/s, Gauss is exact
        begins = sorted({0.0, 9.0, *(float(e.start_s) + system.delay_s for e in response.edges)})
        for low, high in pairwise(begins):
            cuts = np.linspace(low, high, math.ceil(4.0 * (high - low)) + 2)
            half = 0.5 * np.diff(cuts)[:, None]
            t = cuts[:-1, None] + half * (1.0 + nodes)
            values, slopes = response.value(t), response.slope(t)
            area = (half * weights * values).sum()
            climb = (half * weights * slopes).sum()
            before_high = np.nextafter(high, low)
            size = np.abs(half * weights * values).sum() + np.abs(response.integral(high))
            assert response.integral(high) - response.integral(low) == pytest.approx(
                area, rel=0.0, abs=1e-9 * float(size) + 1e-12
            )
            size = np.abs(half * weights * slopes).sum() + np.abs(values).max()
            assert response.value(before_high) - response.value(low) == pytest.approx(
                climb, rel=0.0, abs=1e-9 * float(size) + 1e-12
            )


@settings(max_examples=25, deadline=None)
@given(
    system=systems(largest_order=4, damped=False),
    amplitude=st.floats(-10.0, 10.0),
    other=st.floats(-10.0, 10.0),
)
def test_the_answer_is_linear_in_the_input(
    system: TransferFunction, amplitude: float, other: float
) -> None:
    both = ShapedResponse(
        system=system,
        reference=(Edge(amplitude=amplitude), Edge(start_s=1.0, order=1, amplitude=other)),
    )
    unit_step, unit_ramp = StepResponse(system=system), RampResponse(system=system)
    t = np.linspace(0.0, 8.0, 33)
    # 1e-13: the sums are rounded in another order; the times of the ramp as well, by t - 1
    for of in ("value", "slope", "integral"):
        parts = amplitude * getattr(unit_step, of)(t), other * getattr(unit_ramp, of)(t - 1.0)
        size = sum(float(np.abs(part).max()) for part in parts)
        gap = np.abs(getattr(both, of)(t) - parts[0] - parts[1])
        # where a feedthrough jumps or a ramp bends, the rounding of t - 1 - T decides the side
        near_edge = np.abs(t - 1.0 - system.delay_s) < 1e-9
        assert np.all((gap <= 1e-11 * size + 1e-300) | near_edge)


def test_amplitudes_widths_and_times_broadcast() -> None:
    amplitudes = np.array([1.0, -2.0, 30.0])
    widths = np.array([0.5, 2.0, 40.0])
    t = np.linspace(0.0, 60.0, 11)
    together = PulseResponse(system=LAG, amplitude=amplitudes[:, None], width_s=widths[:, None])
    for of in ("value", "slope", "integral"):
        answers = getattr(together, of)(t)
        assert answers.shape == (3, 11)
        for row, amplitude, width in zip(answers, amplitudes, widths, strict=True):
            alone = PulseResponse(system=LAG, amplitude=float(amplitude), width_s=float(width))
            assert np.array_equal(row, getattr(alone, of)(t))


@pytest.mark.parametrize("shape", [(), (1,), (4,), (2, 3), (0,)])
def test_the_answer_has_the_shape_of_the_times(shape: tuple[int, ...]) -> None:
    assert StepResponse(system=LAG).value(np.ones(shape)).shape == shape


@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_a_stack_answers_like_a_loop(data: st.DataObject) -> None:
    spread = st.floats(0.5, 1.5)
    draws = data.draw(st.lists(st.tuples(spread, spread, spread), min_size=1, max_size=6))
    factors = np.array(draws)
    numerators = factors[:, :1] * 0.36
    denominators = np.column_stack([np.ones(len(draws)), 1.1 * factors[:, 1], 0.36 * factors[:, 2]])
    delays = 0.6 * factors[:, 0]
    t = np.array([0.0, 0.7, 2.0, 7.0, 40.0])
    stack = TransferFunctionStack(
        numerators=numerators[:, None, :],
        denominators=denominators[:, None, :],
        delay_s=delays[:, None],
    )
    together = PulseResponse(system=stack, amplitude=7.0, width_s=5.0)
    for row in range(len(draws)):
        system = TransferFunction(
            numerator=tuple(numerators[row]),
            denominator=tuple(denominators[row]),
            delay_s=float(delays[row]),
        )
        alone = PulseResponse(system=system, amplitude=7.0, width_s=5.0)
        for of in ("value", "slope", "integral"):
            assert getattr(together, of)(t)[row] == pytest.approx(
                getattr(alone, of)(t), rel=1e-11, abs=1e-11
            )


def test_a_stack_without_a_times_axis_answers_one_value_each() -> None:
    stack = TransferFunctionStack(
        numerators=np.array([[1.0], [2.0]]), denominators=np.array([[1.0, 1.0], [1.0, 2.0]])
    )
    answers = StepResponse(system=stack).value(1.0)
    assert answers == pytest.approx([1.0 - math.exp(-1.0), 1.0 - math.exp(-2.0)], rel=1e-15)


@pytest.mark.parametrize(
    ("edge", "sentence"),
    [
        (Edge(order=4), "order 0 to 3, not 4"),
        (Edge(order=-1), "order 0 to 3, not -1"),
        (Edge(start_s=-1.0), "finite times from 0 on, not -1.0"),
        (Edge(start_s=math.nan), "finite times from 0 on"),
        (Edge(amplitude=math.inf), "must be finite, got inf"),
    ],
)
def test_an_input_that_is_none_is_refused(edge: Edge, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        ShapedResponse(system=LAG, reference=(edge,))


def test_a_step_of_no_number_is_refused_when_it_is_made() -> None:
    with pytest.raises(ValueError, match="must be finite"):
        StepResponse(system=LAG, amplitude=math.nan)
