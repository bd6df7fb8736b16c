"""What wind a vehicle holds while it sinks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.physics.drift import held_wind_m_s, level_airspeed_m_s

LEAN_RAD = math.radians(30.0)


@pytest.mark.parametrize(
    ("sink_m_s", "exponent", "expected_m_s"),
    [
        (0.0, 1.4, 10.24),
        (-3.0, 1.4, 10.24),  # a climb counts as level
        (1.5, 1.0, 9.374),  # 10.24 - 1.5 tan 30°
        (1.5, 1.4, 9.594),  # 9.710^0.4 (9.594 + 0.866) = 2.4825 * 10.460 = 25.97 = 10.24^1.4
        (3.0, 1.4, 8.878),  # 9.371^0.4 (8.878 + 1.732) = 2.4474 * 10.610 = 25.97
        (5.0, 2.0, 8.115),  # 9.531 (8.115 + 2.887) = 104.86 = 10.24²
        (1.5, None, 9.374),
        (9.5, None, 4.493),  # 10.509 (4.493 + 5.485) = 104.86; with 1: 10.24 - 5.485 = 4.755
        (20.0, None, 0.0),
    ],
)
def test_what_a_descent_leaves_by_pencil(
    sink_m_s: float, exponent: float | None, expected_m_s: float
) -> None:
    held_m_s = held_wind_m_s(10.24, sink_m_s, lean_rad=LEAN_RAD, exponent=exponent)
    assert held_m_s == pytest.approx(expected_m_s, abs=0.002)


@given(
    limit_m_s=st.floats(3.0, 30.0),
    sink_m_s=st.floats(0.0, 6.0),
    lean_deg=st.floats(5.0, 60.0),
    exponent=st.floats(1.0, 2.0),
)
def test_at_what_is_held_the_forces_balance(
    limit_m_s: float, sink_m_s: float, lean_deg: float, exponent: float
) -> None:
    lean_rad = math.radians(lean_deg)
    held_m_s = held_wind_m_s(limit_m_s, sink_m_s, lean_rad=lean_rad, exponent=exponent)
    assert held_m_s <= limit_m_s
    if held_m_s > 0.01:
        speed_m_s = math.hypot(held_m_s, sink_m_s)
        drag = math.tan(lean_rad) * (speed_m_s / limit_m_s) ** exponent  # over the weight
        pull = math.tan(lean_rad) * (1.0 - drag * sink_m_s / speed_m_s)
        assert pull == pytest.approx(drag * held_m_s / speed_m_s, rel=1e-6)
    unknown_m_s = held_wind_m_s(limit_m_s, sink_m_s, lean_rad=lean_rad, exponent=None)
    assert unknown_m_s <= held_m_s + 1e-9


def test_winds_and_descents_of_many_places_are_asked_for_at_once() -> None:
    asked = level_airspeed_m_s(
        np.array([5.0, 6.0]), np.array([1.0, -1.0]), lean_rad=math.radians(45.0), exponent=1.0
    )
    assert asked == pytest.approx([6.0, 6.0])
