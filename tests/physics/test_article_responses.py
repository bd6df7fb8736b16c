"""The five models of the source article and the figures worked out from them, to their last digit.

K. Falkowski, M. Duda, Sensors 2023, 23(23), 9378, equations 6 to 10.  What each figure means is
said at its test.
"""

from __future__ import annotations

import math

import pytest

from planner.physics.response import StepResponse, TransferFunction

G1 = TransferFunction(numerator=(0.03071,), denominator=(1.0, 0.2923, 0.03071), delay_s=2.9)
G2 = TransferFunction(
    numerator=(0.07023, 0.02383), denominator=(1.0, 0.006887, 0.06957), delay_s=0.2
)
G3 = TransferFunction(
    numerator=(0.09489, -0.00001339), denominator=(1.0, 0.228, 0.05344), delay_s=0.5
)
G4 = TransferFunction(numerator=(0.03569,), denominator=(1.0, 0.935, 0.3588), delay_s=0.6)
G5 = TransferFunction(
    numerator=(0.02583, -0.3294), denominator=(1.0, 1.905e-10, 0.2492), delay_s=0.6
)

CLIMB_100_M = StepResponse(system=G1, amplitude=100.0)
CLIMB_POWER_100_M = StepResponse(system=G2, amplitude=100.0)
DESCENT_POWER_100_M = StepResponse(system=G3, amplitude=-100.0)
# G4 answers a tenth of what is commanded: with its input gain of 10 a command of 10 m/s enters
# as 100.  The power models have no such gain.
SPEED_10_M_S = StepResponse(system=G4, amplitude=100.0)
BRAKE_POWER_10_M_S = StepResponse(system=G5, amplitude=-10.0)


def printed(value: float, digits: int) -> object:
    """The value as printed with some decimals: half a unit of the last one either way."""
    return pytest.approx(value, rel=0.0, abs=0.5000001 * 10.0**-digits)


@pytest.mark.parametrize(
    ("model", "frequency", "damping", "gain"),
    [
        (G1, (0.175243, 6), (0.83399, 5), (1.0, 6)),
        (G2, (0.263761, 6), (0.013055, 6), (0.342533, 6)),
        (G3, (0.231171, 6), (0.493142, 6), (-0.00025056, 8)),
        (G4, (0.598999, 6), (0.780469, 6), (0.0994705, 7)),
        (G5, (0.499199, 6), (1.9e-10, 11), (-1.32183, 5)),
    ],
)
def test_frequency_damping_and_gain_of_the_models(
    model: TransferFunction,
    frequency: tuple[float, int],
    damping: tuple[float, int],
    gain: tuple[float, int],
) -> None:
    assert model.natural_frequency_rad_s == printed(*frequency)
    assert model.damping_ratio == printed(*damping)
    assert model.dc_gain == printed(*gain)


def test_peak_climb_rate_of_a_100_m_climb() -> None:
    steepest = CLIMB_100_M.peak_slope()
    assert steepest.value == printed(7.2438, 4)
    assert steepest.time_s == printed(8.945, 3)


@pytest.mark.parametrize(("within_m", "last_outside_s"), [(2.0, 25.963), (1.0, 27.309)])
def test_a_100_m_climb_has_settled(within_m: float, last_outside_s: float) -> None:
    # the figures are the last whole millisecond at which the altitude is still outside:
    # the exact times are 25.96353 s and 27.30980 s
    settled_s = float(CLIMB_100_M.settling_times_s(within_m))
    assert math.floor(settled_s * 1000.0) == round(last_outside_s * 1000.0)
    # exact by the textbook step response of a second-order system without zeros
    zeta, omega = 0.2923 / 2.0 / math.sqrt(0.03071), math.sqrt(0.03071)
    root = math.sqrt(1.0 - zeta**2)
    angle = omega * root * (settled_s - 2.9)
    decay = math.exp(-zeta * omega * (settled_s - 2.9))
    distance_m = 100.0 * decay * (math.cos(angle) + zeta / root * math.sin(angle))
    assert distance_m == pytest.approx(within_m, rel=1e-12)


def test_overshoot_of_a_100_m_climb() -> None:
    highest = CLIMB_100_M.extremum(100.0, highest=True)
    assert highest.value - 100.0 == printed(0.867, 3)
    assert highest.time_s == printed(35.39, 2)
    # exp(-π ζ / √(1 - ζ²)), half a damped period after the delay
    zeta, period_s = G1.damping_ratio, G1.damped_period_s
    assert zeta is not None
    assert period_s is not None
    share = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
    assert highest.value == pytest.approx(100.0 * (1.0 + share), rel=1e-13)
    assert highest.time_s == pytest.approx(2.9 + period_s / 2.0, rel=1e-11)


def test_climb_power_peak_and_energy_over_the_window_of_one_period() -> None:
    assert G2.damped_period_s is not None
    window_s = G2.delay_s + G2.damped_period_s
    assert window_s == printed(24.0235, 4)
    peak = CLIMB_POWER_100_M.extremum(window_s, highest=True)
    assert peak.value == printed(75.99, 2)
    assert peak.time_s == printed(9.588, 3)
    assert float(CLIMB_POWER_100_M.integral(window_s)) == printed(823.717, 3)


def test_descent_power_dips_and_rises_again() -> None:
    lowest = DESCENT_POWER_100_M.extremum(60.0, highest=False)
    highest = DESCENT_POWER_100_M.extremum(60.0, highest=True)
    assert lowest.value == printed(-22.559, 3)
    assert lowest.time_s == printed(5.744, 3)
    assert highest.value == printed(3.830, 3)
    assert highest.time_s == printed(21.365, 3)


def test_descent_energy_over_a_minute_and_in_the_limit() -> None:
    # 60 s from the command, delay included, of the whole of G3
    assert float(DESCENT_POWER_100_M.integral(60.0)) == printed(-176.078, 3)
    # the limit is that of the term in s alone, 0.09489 / 0.05344 W·s per metre: the whole of G3
    # ends at 0.025 W, and its energy has no limit
    term = TransferFunction(numerator=(0.09489, 0.0), denominator=G3.denominator, delay_s=0.5)
    settled = StepResponse(system=term, amplitude=-100.0)
    assert float(settled.integral(1000.0)) == printed(-177.564, 3)
    assert DESCENT_POWER_100_M.final_value == printed(0.025056, 6)


def test_stopping_distance_from_a_10_m_s_command() -> None:
    steady_m_s = SPEED_10_M_S.final_value
    assert steady_m_s == printed(9.947, 3)
    # v (delay + 2 ζ / ω_n)
    assert steady_m_s * G4.mean_residence_time_s == printed(31.889, 3)
    assert 10.0 * G4.mean_residence_time_s == printed(32.059, 3)
    # the same from the motion: way covered in 200 s after the command drops at 300 s
    way_m = 100.0 * (
        StepResponse(system=G4).integral(500.0)
        - StepResponse(system=G4).integral(200.0)
        - StepResponse(system=G4).integral(300.0)
    )
    assert float(way_m) == printed(31.889, 3)


def test_time_to_98_percent_of_the_speed_is_of_the_steady_speed() -> None:
    steady_m_s = SPEED_10_M_S.final_value
    assert SPEED_10_M_S.first_crossing_s(0.98 * steady_m_s) == printed(6.623, 3)
    # 98 % of the 10 m/s that were commanded is reached 0.12 s later
    later_s = SPEED_10_M_S.first_crossing_s(9.8)
    assert later_s is not None
    assert later_s > 6.623 + 0.1


def test_braking_power_peak_and_energy_over_the_window_of_one_period() -> None:
    assert G5.damped_period_s is not None
    window_s = G5.delay_s + G5.damped_period_s
    assert window_s == printed(13.1865, 4)
    # undamped, the peak is twice the steady gain times the command, and a little for the zero
    assert BRAKE_POWER_10_M_S.extremum(window_s, highest=True).value == printed(26.45, 2)
    assert float(BRAKE_POWER_10_M_S.integral(window_s)) == printed(166.372, 3)
