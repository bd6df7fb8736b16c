"""The published power curves by pencil."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner.physics.power_curves import di_franco_buttazzo_power_w, liu_power_w

IRIS: dict[str, Any] = {
    "k1": 0.8554,
    "k2_sqrt_kg_m": 0.3051,
    "c2_sqrt_m_kg": 0.3177,
    "c4_kg_m": 0.0296,
    "c5_kg_m": 0.0279,
}
"""Of an IRIS+, as public implementations quote table 3 of Liu et al. (2017)."""
CURVE: dict[str, Any] = {
    "coefficients": (2.0, -12.0, 220.0),
    "climb_power_w": 250.0,
    "climb_speed_m_s": 2.0,
    "descent_power_w": 200.0,
    "descent_speed_m_s": 1.0,
}


@pytest.mark.parametrize(
    ("airspeed_m_s", "climb_m_s", "by_pencil_w"),
    [
        # T = 1.5 x 9.80665 = 14.710 N, T^1.5 = 56.419: 0.8554 x 56.419 / 0.3051 + 0.3177 x 56.419
        (0.0, 0.0, 158.18 + 17.92),
        # through the disk 1 + sqrt(1 + 14.710 / 0.093086) = 13.610 m/s: 0.8554 x 14.710 x 13.610
        (0.0, 2.0, 171.26 + 17.92),
        # drag 2.96 N, cos² = 1 / (1 + (2.96 / 14.710)²) = 0.96109, lift 2.79 x 0.96109 = 2.6814 N,
        # T = sqrt(12.0286² + 2.96²) = 12.3874 N, T^1.5 = 43.598, and 2.96 x 10 of drag
        (10.0, 0.0, 122.24 + 13.85 + 29.60),
    ],
)
def test_liu_by_pencil(airspeed_m_s: float, climb_m_s: float, by_pencil_w: float) -> None:
    power_w = liu_power_w(airspeed_m_s, climb_m_s, mass_kg=1.5, **IRIS)
    assert power_w == pytest.approx(by_pencil_w, abs=0.03)  # the pencil has two decimals


def test_liu_hovers_on_the_power_of_three_halves_of_the_mass() -> None:
    light, heavy = (liu_power_w(0.0, 0.0, mass_kg=mass_kg, **IRIS) for mass_kg in (1.5, 3.0))
    assert heavy / light == pytest.approx(2.0**1.5)


def test_the_curve_of_di_franco_and_buttazzo_by_pencil() -> None:
    power_w = di_franco_buttazzo_power_w(
        np.array([0.0, 3.0, 0.0, 0.0, 3.0]), np.array([0.0, 0.0, 2.0, -0.5, 1.0]), **CURVE
    )
    # 2 v² − 12 v + 220; the climb adds 15 W for each m/s, the descent takes 20 W off
    assert power_w == pytest.approx([220.0, 202.0, 250.0, 210.0, 217.0])


def test_a_metre_of_height_costs_the_same_at_any_rate() -> None:
    rates = np.array([0.5, 1.0, 4.0])
    above_w = di_franco_buttazzo_power_w(np.zeros(3), rates, **CURVE) - 220.0
    assert above_w / rates == pytest.approx([15.0, 15.0, 15.0])
