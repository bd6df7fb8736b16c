"""Curves of PX4's turns: begun and ended as told, and no faster than allowed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.flight.motion.px4.pieces import Curves


def curve(
    velocity: tuple[float, float, float],
    way: tuple[float, float, float],
    end: tuple[float, float, float],
    *,
    duration_s: float,
    level_m_s: float = 5.0,
    upright_m_s: float = 3.0,
) -> Curves:
    """Return one curve from the origin."""
    return Curves.between(
        np.zeros((1, 3)),
        np.array([velocity]),
        np.array([way]),
        np.array([end]),
        duration_s=np.array([duration_s]),
        level_m_s=np.array([level_m_s]),
        upright_m_s=np.array([upright_m_s]),
    )


def test_a_slow_curve_is_one_cubic() -> None:
    # From rest to rest the speed is 6 s (1 − s) of the mean in the middle: 1.5 · 2 m/s.
    made = curve((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 0.0), duration_s=2.0, level_m_s=6.0)
    assert made.duration_s[0].tolist() == [2.0, 0.0, 0.0]
    _, speed = made.state_at(np.array([1.0]))
    assert speed[0, 0] == pytest.approx(3.0)


def test_a_curve_that_would_be_too_fast_keeps_its_limit() -> None:
    # 8 m in 2 s with 5 m/s at most: m = (1 − α) L, so α = 1/5, at 5 m/s from 0.4 s to 1.6 s.
    made = curve((0.0, 0.0, 0.0), (8.0, 0.0, 0.0), (0.0, 0.0, 0.0), duration_s=2.0)
    assert made.duration_s[0] == pytest.approx([0.4, 1.2, 0.4])
    place, speed = made.state_at(np.array([1.0]))
    assert (place[0, 0], speed[0, 0]) == pytest.approx((4.0, 5.0))


def test_a_vertical_limit_bends_a_curve_as_well() -> None:
    # 2.4 m up in 1 s from rest to rest, at 3 m/s at most: α = 1/5 again.
    made = curve((4.0, 0.0, 0.0), (4.0, 0.0, 2.4), (4.0, 0.0, 0.0), duration_s=1.0)
    assert made.duration_s[0] == pytest.approx([0.2, 0.6, 0.2])
    _, speed = made.state_at(np.array([0.5]))
    assert speed[0] == pytest.approx([4.0, 0.0, 3.0])


SPEEDS = st.floats(-5.0, 5.0)


@settings(deadline=None, max_examples=examples(60))
@given(
    st.tuples(SPEEDS, SPEEDS, st.floats(-3.0, 3.0)),
    st.tuples(SPEEDS, SPEEDS, st.floats(-3.0, 3.0)),
    st.tuples(SPEEDS, SPEEDS, st.floats(-2.5, 2.5)),
    st.floats(0.1, 8.0),
)
def test_curves_join_what_they_are_given_within_the_limits(
    begin: tuple[float, float, float],
    end: tuple[float, float, float],
    mean: tuple[float, float, float],
    duration_s: float,
) -> None:
    way = tuple(duration_s * speed for speed in mean)
    made = curve(begin, way, end, duration_s=duration_s, level_m_s=8.0)  # type: ignore[arg-type]  # three each
    assert made.duration_s.sum() == pytest.approx(duration_s)
    time = np.linspace(0.0, duration_s, 200)
    states = [made.state_at(np.array([t])) for t in time]
    place = np.array([state[0][0] for state in states])
    speed = np.array([state[1][0] for state in states])
    assert speed[0] == pytest.approx(np.array(begin), abs=1e-9)
    assert place[-1] == pytest.approx(np.array(way), abs=1e-6)
    assert speed[-1] == pytest.approx(np.array(end), abs=1e-6)
    assert np.hypot(speed[:, 0], speed[:, 1]).max() <= 8.0 * 1.0026
    assert np.abs(speed[:, 2]).max() <= 3.0 * 1.0026
    # Position is the integral of velocity: nothing jumps inside.
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)[:, None]
    assert np.cumsum(steps, axis=0)[-1] == pytest.approx(np.array(way), abs=0.02 * duration_s)
