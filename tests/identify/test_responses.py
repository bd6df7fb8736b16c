"""Responses of vehicles that are not the article's: their windows and speeds come back through noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record
from simulated_experiment import STEP_S, Model

from planner.identify.manoeuvres import Manoeuvre, ManoeuvreCut, ResponseKind, cut_manoeuvres
from planner.identify.responses import identify_response

if TYPE_CHECKING:
    from planner.logs.record import FlightRecord

BEFORE, AFTER = 150, 750
"""Samples before and after a command."""
STEPS = (60.0, 60.0, 60.0)
NOISE_W = 1.9


def power_model(gain: float, frequency: float, damping: float, delay_s: float) -> Model:
    """Return a power used over its delay and one damped period, as the article's are read."""
    square = frequency**2
    period_s = 2.0 * math.pi / (frequency * math.sqrt(1.0 - damping**2))
    return Model(
        (0.3, gain * square),
        (1.0, 2.0 * damping * frequency, square),
        delay_s,
        window_s=delay_s + period_s,
    )


@pytest.mark.parametrize(
    ("gain", "frequency", "damping", "delay_s", "seed"),
    [(0.6, 0.45, 0.3, 0.3, 0), (0.3, 0.49, 0.38, 0.5, 1), (0.25, 0.34, 0.19, 0.5, 2)],
)
def test_a_power_that_ends_abruptly_comes_back_with_its_window(
    gain: float, frequency: float, damping: float, delay_s: float, seed: int
) -> None:
    """A fit to a second more than the window took it for one of twice to three times the damping."""
    truth = power_model(gain, frequency, damping, delay_s)
    random = np.random.default_rng(seed)
    cuts = []
    for size in STEPS:
        steps = np.zeros(BEFORE + AFTER + 1)
        steps[BEFORE] = size
        noise = NOISE_W * random.standard_normal(steps.size)
        manoeuvre = Manoeuvre(
            time_s=STEP_S * np.arange(float(steps.size)),
            reference=np.cumsum(steps),
            answer=truth.answer(steps) + noise,
            source="made",
        )
        cut = ManoeuvreCut(
            log="made",
            flight=1,
            start_s=0.0,
            duration_s=STEP_S,
            answer=ResponseKind.CLIMB_POWER,
            change=size,
            manoeuvre=manoeuvre,
        )
        cuts.append(cut)
    found = identify_response(ResponseKind.CLIMB_POWER, cuts)
    estimates = {one.name: one for one in found.outcome.estimates}
    for name in ("natural_frequency_rad_s", "damping_ratio"):
        one = estimates[name]
        # four standard errors; at the edge of a window one sample more or less is fitted besides
        assert one.value == pytest.approx(truth.figures[name], abs=4.0 * one.error, rel=0.02)
    assert found.evidence is not None
    assert found.evidence.window_s == pytest.approx(truth.window_s, rel=0.03)


def climb(power_w: float) -> FlightRecord:
    """Return a climb of 20 m at one power, logged with its reference."""
    height = np.repeat([50.0, 70.0], 300)
    return make_record(
        is_landed=np.zeros(height.size, dtype=np.bool_),
        reference_height_m=height,
        height_above_home_m=height,
        reference_speed_m_s=np.zeros(height.size),
        power_w=np.full(height.size, power_w),
    )


@pytest.mark.parametrize(
    ("power_w", "hover_w", "why"),
    [
        (math.nan, 200.0, "no power in the log"),
        (math.nan, math.nan, "no power in the log"),
        (260.0, math.nan, "no hover power to count from"),
    ],
)
def test_a_power_nobody_measured_is_no_missing_manoeuvre(
    power_w: float, hover_w: float, why: str
) -> None:
    record = climb(power_w)
    cuts = cut_manoeuvres(record, hover_power_w=np.full(record.time_s.size, hover_w))
    found = identify_response(ResponseKind.CLIMB_POWER, cuts)
    assert found.response is None
    assert found.outcome.summary == f"no manoeuvre can be used: {why}"


def test_noise_at_rest_does_not_delay_a_speed() -> None:
    """The length of a noisy velocity is never 0: by it a delay of 0.4 s was found as 0.51 s."""
    frequency, damping, delay_s = 0.9, 0.7, 0.4
    truth = Model((frequency**2,), (1.0, 2.0 * damping * frequency, frequency**2), delay_s)
    reference = np.repeat([0.0, 8.0, 0.0, 8.0, 0.0], 600)
    speed = truth.answer(np.diff(reference, prepend=0.0))
    # out to the north-east and back
    ahead = np.where(np.arange(reference.size) < 1790, 1.0, -1.0) / math.sqrt(2.0)
    random = np.random.default_rng(8)
    north, east = (ahead * speed + 0.1 * random.standard_normal(speed.size) for _ in range(2))
    record = make_record(
        is_landed=np.zeros(speed.size, dtype=np.bool_),
        velocity_north_m_s=north,
        velocity_east_m_s=east,
        ground_speed_m_s=np.hypot(north, east),
        reference_speed_m_s=reference,
        reference_height_m=np.full(speed.size, 50.0),
        height_above_home_m=np.full(speed.size, 50.0),
    )
    found = identify_response(ResponseKind.SPEED, cut_manoeuvres(record))
    estimates = {one.name: one for one in found.outcome.estimates}
    for name, expected in truth.figures.items():
        one = estimates[name]
        assert one.value == pytest.approx(expected, abs=4.0 * one.error)


def test_a_speed_that_turns_is_the_length_of_its_velocity() -> None:
    """Around a corner there is no one way ahead: projected on it a constant speed would fall."""
    reference = np.repeat([0.0, 8.0], [300, 600])
    turn = np.arange(reference.size) < 600
    speed = np.where(reference > 0.0, 8.0, 0.0)
    north, east = np.where(turn, speed, 0.0), np.where(turn, 0.0, speed)
    record = make_record(
        is_landed=np.zeros(speed.size, dtype=np.bool_),
        velocity_north_m_s=north,
        velocity_east_m_s=east,
        ground_speed_m_s=speed,
        reference_speed_m_s=reference,
        reference_height_m=np.full(speed.size, 50.0),
    )
    [cut] = [one for one in cut_manoeuvres(record) if one.answer is ResponseKind.SPEED]
    assert cut.manoeuvre is not None
    np.testing.assert_array_equal(cut.manoeuvre.answer[-600:], 8.0)
