"""Settling, crossings, peaks: by pencil, and against dense sampling of random responses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_systems import systems

from planner.physics.response import (
    PulseResponse,
    RampResponse,
    Response,
    StepResponse,
)
from planner.physics.settling import first_crossings_s, settling_times_s
from planner.physics.transfer_function import TransferFunction, TransferFunctionStack

LAG = TransferFunction(numerator=(1.0,), denominator=(2.0, 1.0), delay_s=0.5)
SWING = TransferFunction(numerator=(1.0,), denominator=(1.0, 0.2, 1.0), delay_s=0.5)
UNDAMPED = TransferFunction(numerator=(1.0,), denominator=(1.0, 0.0, 1.0))
INTEGRATOR = TransferFunction(numerator=(3.0,), denominator=(2.0, 1.0, 0.0), delay_s=0.5)
GAIN = TransferFunction(numerator=(2.0,), denominator=(1.0,), delay_s=0.5)


def responses_to(system: TransferFunction) -> list[Response]:
    return [
        StepResponse(system=system, amplitude=-2.0),
        PulseResponse(system=system, amplitude=1.5, width_s=1.3),
        RampResponse(system=system, rate_per_s=0.7, duration_s=2.0),
    ]


def test_a_lag_settles_when_its_exponential_says_so() -> None:
    # 10 exp(-(t - T)/τ) = 0.2
    settled = StepResponse(system=LAG, amplitude=10.0).settling_time_s(0.2)
    assert settled == pytest.approx(0.5 + 2.0 * math.log(50.0), rel=1e-13)


def test_settling_and_crossing_of_many_levels_at_once() -> None:
    response = StepResponse(system=LAG, amplitude=10.0)
    tolerances = np.array([[5.0, 0.1], [11.0, 1e-9]])
    times = settling_times_s(response, tolerances)
    assert times.shape == (2, 2)
    # a distance of 11 is never exceeded
    assert times[1, 0] == 0.0
    expected = 0.5 + 2.0 * np.log(10.0 / tolerances)
    near = np.array([[True, True], [False, True]])
    # at 1e-9 of 10 the rounding of the value shifts the time by 2 s · 1e-15 / 1e-9
    assert times[near] == pytest.approx(expected[near], abs=1e-5)
    assert times[0] == pytest.approx(expected[0], rel=1e-13)
    levels = np.array([-1.0, 0.0, 2.5, 9.9, 10.0, 12.0])
    reached = first_crossings_s(response, levels)
    assert reached[[0, 4, 5]].tolist() == [math.inf] * 3
    assert reached[1] == 0.0
    assert reached[2:4] == pytest.approx(0.5 - 2.0 * np.log([0.75, 0.01]), rel=1e-13)


@pytest.mark.parametrize(
    "response", [StepResponse(system=UNDAMPED), StepResponse(system=INTEGRATOR)]
)
def test_what_swings_or_grows_for_ever_never_settles(response: Response) -> None:
    assert response.final_value is None
    assert response.settling_time_s(0.1) is None
    assert settling_times_s(response, [0.1, 0.2]).tolist() == [math.inf, math.inf]


def test_a_response_that_ends_elsewhere_never_stays_near_the_target() -> None:
    response = StepResponse(system=LAG, amplitude=10.0)
    assert response.settling_time_s(0.2, target=10.3) is None
    # 10 exp(-(t - T)/τ) + 0.3 = 0.5
    settled = response.settling_time_s(0.5, target=10.3)
    assert settled == pytest.approx(0.5 + 2.0 * math.log(50.0), rel=1e-13)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan])
def test_a_tolerance_that_is_not_positive_is_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        StepResponse(system=LAG).settling_time_s(tolerance)


def test_a_pulse_into_an_integrator_ends_where_its_area_says() -> None:
    response = PulseResponse(system=INTEGRATOR, amplitude=2.0, width_s=4.0)
    assert response.final_value == pytest.approx(24.0, rel=1e-15)
    # the rate of 6 (1 - exp(-(t - T)/τ)) decays after the pulse; what is left of the way is
    # 6 τ (exp(w/τ) - 1) exp(-(t - T)/τ) with τ = 2 s, w = 4 s
    settled = response.settling_time_s(0.01)
    assert settled is not None
    left = 6.0 * 2.0 * (math.exp(4.0 / 2.0) - 1.0)
    assert settled == pytest.approx(0.5 + 2.0 * math.log(left / 0.01), rel=1e-12)


def test_a_gain_settles_at_its_jump() -> None:
    response = StepResponse(system=GAIN, amplitude=5.0)
    assert response.final_value == 10.0
    assert response.settling_time_s(0.1) == pytest.approx(0.5, rel=1e-15)
    assert response.first_crossing_s(7.0) == pytest.approx(0.5, rel=1e-15)
    assert response.overshoot() is None


def test_a_jump_at_the_start_reaches_the_levels_it_passes() -> None:
    # 1 + exp(-t)
    system = TransferFunction(numerator=(2.0, 1.0), denominator=(1.0, 1.0))
    response = StepResponse(system=system)
    assert response.first_crossing_s(0.5) == 0.0
    assert response.first_crossing_s(2.0) == 0.0
    assert response.first_crossing_s(2.1) is None
    assert response.first_crossing_s(-0.1) is None
    assert response.overshoot() == (0.0, 2.0)


def test_nothing_commanded_is_settled_from_the_start() -> None:
    response = StepResponse(system=SWING, amplitude=0.0)
    assert response.final_value == 0.0
    assert response.settling_time_s(0.1) == 0.0
    assert response.overshoot() is None
    assert response.first_crossing_s(1.0) is None


def test_hardly_damped_settling_far_away_is_found() -> None:
    # ζ = 1e-6, ω = 1: |1 - y| < 0.1 only after ln(10)/1e-6 s, 730 thousand half periods
    system = TransferFunction(numerator=(1.0,), denominator=(1.0, 2e-6, 1.0))
    settled = StepResponse(system=system).settling_time_s(0.1)
    assert settled is not None
    last_turn_s = math.log(10.0) / 1e-6
    assert last_turn_s - math.pi <= settled <= last_turn_s + math.pi
    assert abs(1.0 - float(StepResponse(system=system).value(settled))) == pytest.approx(
        0.1, abs=1e-9
    )


def test_turning_points_of_a_swing_lie_half_a_period_apart() -> None:
    points = StepResponse(system=SWING).extrema(40.0)
    root = math.sqrt(0.99)
    inner = [point for point in points if 0.5 + 1e-6 < point.time_s < 40.0]
    assert len(inner) == math.floor(39.5 * root / math.pi)
    for n, point in enumerate(inner, start=1):
        assert point.time_s == pytest.approx(0.5 + n * math.pi / root, rel=1e-11)
        share = -((-math.exp(-math.pi * 0.1 / root)) ** n)
        assert point.value == pytest.approx(1.0 + share, rel=1e-13)
    assert (points[0].time_s, points[-1].time_s) == (0.0, 40.0)


def test_overshoot_is_none_where_the_answer_creeps_up() -> None:
    assert StepResponse(system=LAG).overshoot() is None
    critical = TransferFunction(numerator=(1.0,), denominator=(1.0, 2.0, 1.0))
    assert StepResponse(system=critical, amplitude=-4.0).overshoot() is None


def test_overshoot_downward_is_beyond_as_well() -> None:
    lowest = StepResponse(system=SWING, amplitude=-2.0).overshoot()
    assert lowest is not None
    share = math.exp(-math.pi * 0.1 / math.sqrt(0.99))
    assert lowest.value == pytest.approx(-2.0 * (1.0 + share), rel=1e-13)


def test_steepest_slope_of_a_critical_answer() -> None:
    # dy/dt = t exp(-t) is largest at 1 s
    critical = TransferFunction(numerator=(1.0,), denominator=(1.0, 2.0, 1.0), delay_s=0.5)
    up = StepResponse(system=critical).peak_slope()
    assert up.time_s == pytest.approx(1.5, rel=1e-11)
    assert up.value == pytest.approx(math.exp(-1.0), rel=1e-14)
    down = StepResponse(system=critical, amplitude=-3.0).peak_slope(10.0)
    assert down.value == pytest.approx(-3.0 * math.exp(-1.0), rel=1e-14)


def test_time_to_cover_a_way_is_the_crossing_of_the_integral() -> None:
    response = StepResponse(system=LAG, amplitude=10.0)
    time_s = response.first_crossing_s(500.0, window_s=100.0, derivative=-1)
    assert time_s is not None
    assert float(response.integral(time_s)) == pytest.approx(500.0, rel=1e-14)
    assert response.first_crossing_s(5000.0, window_s=100.0, derivative=-1) is None


def test_without_an_end_a_window_is_needed() -> None:
    response = StepResponse(system=UNDAMPED)
    for question in (
        response.overshoot,
        response.peak_slope,
        lambda: response.first_crossing_s(0.5),
        lambda: StepResponse(system=LAG).first_crossing_s(5.0, derivative=-1),
    ):
        with pytest.raises(ValueError, match="no final value; give the window"):
            question()
    assert response.first_crossing_s(0.5, window_s=10.0) == pytest.approx(math.pi / 3.0, rel=1e-13)
    assert response.peak_slope(10.0).value == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("window_s", [0.0, -1.0, math.inf, math.nan])
def test_a_window_that_is_none_is_refused(window_s: float) -> None:
    with pytest.raises(ValueError, match="window must be positive and finite"):
        StepResponse(system=LAG).extremum(window_s, highest=True)


def test_a_search_through_millions_of_swings_is_refused() -> None:
    with pytest.raises(ValueError, match="too many oscillations"):
        StepResponse(system=UNDAMPED).extremum(1e8, highest=True)


def test_the_shape_of_a_stack_is_not_analysed() -> None:
    stack = TransferFunctionStack(numerators=np.ones((2, 1)), denominators=np.ones((2, 2)))
    with pytest.raises(ValueError, match="one system and one amplitude"):
        StepResponse(system=stack).settling_time_s(0.1)
    with pytest.raises(ValueError, match="one system and one amplitude"):
        StepResponse(system=LAG, amplitude=np.ones(2)).settling_time_s(0.1)


@settings(max_examples=25, deadline=None)
@given(
    system=systems(largest_order=5),
    share=st.sampled_from([0.3, 0.05, 0.02, 1e-4]),
    which=st.integers(0, 2),
)
def test_a_settled_response_stays_and_was_outside_before(
    system: TransferFunction, share: float, which: int
) -> None:
    response = responses_to(system)[which]
    final = response.final_value
    assert final is not None
    dense = np.concatenate([np.linspace(0.0, 30.0, 6001), np.geomspace(30.0, 3000.0, 6001)])
    away = np.abs(response.value(dense) - final)
    tolerance = share * float(away.max()) + 1e-9
    settled = response.settling_time_s(tolerance)
    assert settled is not None
    later = dense[dense > settled]
    assert np.all(np.abs(response.value(later) - final) <= tolerance * (1.0 + 1e-9))
    if settled > 0.0:
        # at the time it is on the band, or jumps into it
        around = np.abs(response.value([settled - 1e-9, settled, settled + 1e-9]) - final)
        slack = 1e-9 * (1.0 + np.abs(response.slope([settled - 1e-9, settled])).max())
        assert around[0] >= tolerance - slack
        assert around[2] <= tolerance + slack


@settings(max_examples=25, deadline=None)
@given(system=systems(largest_order=5, damped=False), which=st.integers(0, 2))
def test_no_sample_lies_beyond_the_extrema(system: TransferFunction, which: int) -> None:
    response = responses_to(system)[which]
    window_s = 20.0
    dense = np.linspace(0.0, window_s, 5001)
    for derivative in (-1, 0, 1):
        values = response.derivative(dense, derivative)
        size = float(np.abs(values).max())
        highest = response.extremum(window_s, highest=True, derivative=derivative)
        lowest = response.extremum(window_s, highest=False, derivative=derivative)
        # rounding of the closed form, seven digits lost in clusters of five
        assert values.max() <= highest.value + 1e-9 * size
        assert values.min() >= lowest.value - 1e-9 * size
        for point in (highest, lowest):
            assert float(response.derivative(point.time_s, derivative)) == point.value


@settings(max_examples=25, deadline=None)
@given(
    system=systems(largest_order=5, damped=False),
    which=st.integers(0, 2),
    share=st.floats(0.01, 0.99),
)
def test_no_sample_reaches_a_level_before_its_first_crossing(
    system: TransferFunction, which: int, share: float
) -> None:
    response = responses_to(system)[which]
    dense = np.linspace(0.0, 20.0, 5001)
    values = response.value(dense)
    farthest = values[np.argmax(np.abs(values))]
    level = share * float(farthest)
    time_s = response.first_crossing_s(level, window_s=20.0)
    assert time_s is not None
    if level == 0.0:
        assert time_s == 0.0
        return
    earlier = values[dense < time_s] / level
    assert np.all(earlier <= 1.0 + 1e-9)
    around = response.value([time_s - 1e-9, time_s + 1e-9]) / level
    slack = 1e-9 * (1.0 + np.abs(response.slope([time_s - 1e-9, time_s])).max() / abs(level))
    assert around[0] <= 1.0 + slack
    assert around[1] >= 1.0 - slack
