"""S-curves against pencil and paper, and their limits at every moment."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.flight.motion.s_curve import PlannedCurves, SCurves, SpeedLimits, s_curves, speed_ramps

RISES = st.sampled_from([0.0, 0.2, 0.3, 0.6])
SPEEDS = st.floats(0.2, 20.0)
ACCELERATIONS = st.floats(0.2, 8.0)
JERKS = st.floats(0.3, 20.0)


def curve(
    length: float,
    speed: float = 10.0,
    acceleration: float = 2.5,
    jerk: float = 1.0,
    rise: float = 0.0,
    start: float = 0.0,
    end: float = 0.0,
    first: float = np.inf,
    changed: float = 0.0,
) -> SCurves:
    return s_curves(
        np.array([length]),
        SpeedLimits(np.array([acceleration]), np.array([jerk]), np.array([rise])),
        speed_m_s=np.array([speed]),
        start_m_s=np.array([start]),
        end_m_s=np.array([end]),
        planned=PlannedCurves(np.array([first]), np.array([changed]), np.isfinite([first])),
    )


def duration(*args: float, **limits: float) -> float:
    return float(curve(*args, **limits).duration_s[0])


def at_end(some: SCurves) -> tuple[float, float, float]:
    """Way, speed and acceleration at the end, from the last phase on."""
    phases = some.phases()
    t = float(some.duration_s[0] - phases.start_s[0, -1])
    j, a, v, s = (
        float(column[0, -1])
        for column in (phases.jerk_m_s3, phases.acceleration_m_s2, phases.speed_m_s, phases.way_m)
    )
    return s + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j


def test_a_long_leg_takes_l_over_v_plus_v_over_a_plus_a_over_j() -> None:
    assert duration(600.0) == pytest.approx(600 / 10 + 10 / 2.5 + 2.5 / 1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("length", "expected"), [(10.0, 6.8), (20.0, 8.6), (50.0, 11.8), (100.0, 16.5)]
)
def test_short_legs_take_the_times_of_the_source(length: float, expected: float) -> None:
    # Derived by hand from SCurve.cpp with the jerk rising at once; given to a tenth.
    assert duration(length) == pytest.approx(expected, abs=0.05)


def test_ten_metres_a_second_take_six_and_a_half_seconds_and_32_and_a_half_metres() -> None:
    ramp = curve(600.0).up
    assert ramp.duration_s[0] == pytest.approx(6.5, abs=1e-12)
    assert 0.5 * 10.0 * ramp.duration_s[0] == pytest.approx(32.5, abs=1e-12)


def test_65_metres_are_just_enough_for_ten_metres_a_second() -> None:
    # V (V/A + A/J) = 10 (4 + 2.5).
    assert curve(65.0).peak_m_s[0] == pytest.approx(10.0, abs=1e-9)
    assert curve(64.0).peak_m_s[0] < 10.0


def test_a_rise_of_the_jerk_lengthens_a_leg_by_itself() -> None:
    assert duration(600.0, rise=0.3) - duration(600.0) == pytest.approx(0.3, abs=1e-12)


def test_three_metres_a_second_are_reached_without_steady_acceleration() -> None:
    # 3 = a (0.3 + a): a = 1.588; two ramps of 2 (a + 0.3) each, of which each goes 1.5 m a second.
    a = -0.15 + (0.15**2 + 3.0) ** 0.5
    assert duration(150.0, 3.0, rise=0.3) == pytest.approx(50.0 + 2 * (a + 0.3), abs=1e-9)


def test_a_centimetre_takes_eight_shortened_rises() -> None:
    # t_j = (L t_j0 / 8 J)^¼ and a way of two ramps of four rises each.
    assert duration(0.01, rise=0.3) == pytest.approx(8 * (0.01 * 0.3 / 8) ** 0.25, rel=1e-6)


def test_a_lower_first_speed_is_reached_first() -> None:
    # 5 m/s in 2 sqrt(5) s, then 5 more in as much again; braking as always in 6.5 s.
    some = curve(400.0, first=5.0)
    again = 2.0 * 5.0**0.5
    ways = 2.5 * again + 7.5 * again + 32.5
    assert some.duration_s[0] == pytest.approx(2 * again + 6.5 + (400.0 - ways) / 10.0, abs=1e-9)


def test_a_first_speed_stays_where_there_is_no_room_for_a_second() -> None:
    # 5 m/s take 2 · 11.9 m of ramps with the rise of 0.3 s; 12 rises at 5 m/s are 18 m more.
    assert curve(41.0, rise=0.3, first=5.0).peak_m_s[0] == 5.0
    assert curve(43.0, rise=0.3, first=5.0).peak_m_s[0] > 5.0


def test_a_leg_between_moving_ends_only_pays_for_what_it_changes() -> None:
    some = curve(300.0, start=10.0, end=4.0)
    # Braking from 10 to 4: 6 < A²/J, a = sqrt(6), T = 2 sqrt(6), at 7 m/s in the mean.
    braking = 2.0 * 6.0**0.5
    assert some.duration_s[0] == pytest.approx(braking + (300 - 7 * braking) / 10, abs=1e-9)


def test_a_short_leg_between_moving_ends_peaks_where_its_ramps_fill_it() -> None:
    # 6 to 7 m/s in 2 s at 6.5 m/s in the mean, 7 to 4 m/s in 2 sqrt(3) s at 5.5 m/s.
    some = curve(2.0 * 6.5 + 2.0 * 3.0**0.5 * 5.5, start=6.0, end=4.0)
    assert some.peak_m_s[0] == pytest.approx(7.0, rel=1e-9)
    assert some.cruise_s[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("end", "braking_m"), [(0.0, 2.0 * 5.0**0.5 * 2.5), (4.0, 2.0 * 4.5)])
@pytest.mark.parametrize(("speed", "mean", "reached"), [(9.0, 6.0, 7.0), (1.0, 2.0, 3.0)])
def test_a_speed_is_changed_within_half_of_what_was_to_be_the_cruise(
    speed: float, mean: float, reached: float, end: float, braking_m: float
) -> None:
    # 0 to 5 m/s in 2 sqrt(5) s; by 2 m/s more or less in 2 sqrt(2) s.  The source plans slowing down
    # as speeding up from the lower speed, so at 1 + 2/2 m/s in the mean.
    length = 2.0 * 5.0**0.5 * 2.5 + 2.0 * (2.0 * 2.0**0.5 * mean) + braking_m
    some = curve(length, speed=speed, first=5.0, end=end)
    assert some.first_m_s[0] == pytest.approx(5.0, rel=1e-9)
    assert some.peak_m_s[0] == pytest.approx(reached, rel=1e-6)


@pytest.mark.parametrize(
    ("changed", "first"),
    # 2.8 s of jerk (two rises and 2.2 s), then 0.4 s at 2.5 m/s².
    [(0.0, 7.0), (2.8, 7.0), (3.0, 7.5), (3.1, 7.75), (3.2, 8.0), (5.0, 8.0)],
)
def test_only_what_is_left_of_the_steady_acceleration_is_cut_short(
    changed: float, first: float
) -> None:
    some = curve(60.0, speed=2.0, rise=0.3, first=8.0, changed=changed)
    assert some.first_m_s[0] == pytest.approx(first, abs=1e-9)


def test_a_short_line_keeps_the_speed_it_was_planned_with() -> None:
    # 8 m/s take 8/2.5 + 2.5 + 0.3 = 6 s and 24 m twice: 12 m are left, 1.5 s of the 3.6 s asked for.
    some = curve(60.0, speed=2.0, rise=0.3, first=8.0, changed=5.0)
    assert some.peak_m_s[0] == some.first_m_s[0] == 8.0
    assert curve(77.0, speed=2.0, rise=0.3, first=8.0, changed=5.0).peak_m_s[0] < 8.0
    assert curve(76.0, speed=2.0, rise=0.3, first=8.0, changed=5.0).peak_m_s[0] == 8.0


@given(
    length=st.floats(0.01, 3000.0), speed=SPEEDS, acceleration=ACCELERATIONS, jerk=JERKS, rise=RISES
)
@settings(max_examples=examples(150), deadline=None)
def test_every_leg_ends_at_its_end_at_rest_and_keeps_its_limits(
    length: float, speed: float, acceleration: float, jerk: float, rise: float
) -> None:
    some = curve(length, speed, acceleration, jerk, rise)
    way, last, remaining = at_end(some)
    assert way == pytest.approx(length, rel=1e-9, abs=1e-9)
    assert (last, remaining) == pytest.approx((0.0, 0.0), abs=1e-6)
    phases = some.phases()
    assert phases.speed_m_s.max() <= speed * (1 + 1e-9)
    assert np.abs(phases.acceleration_m_s2).max() <= acceleration * (1 + 1e-9)
    assert np.abs(phases.jerk_m_s3).max() <= jerk * (1 + 1e-9)
    assert (np.diff(phases.start_s) >= -1e-12).all()


@given(
    length=st.floats(50.0, 3000.0),
    speed=SPEEDS,
    start=st.floats(0.0, 1.0),
    end=st.floats(0.0, 1.0),
    rise=RISES,
)
@settings(max_examples=examples(80), deadline=None)
def test_a_leg_between_moving_ends_is_flown_to_its_end(
    length: float, speed: float, start: float, end: float, rise: float
) -> None:
    some = curve(length, speed, 2.5, 2.0, rise, start * min(speed, 8.0), end * min(speed, 8.0))
    way, last, remaining = at_end(some)
    assert way == pytest.approx(length, rel=1e-8)
    assert last == pytest.approx(float(some.end_m_s[0]), abs=1e-6)
    assert remaining == pytest.approx(0.0, abs=1e-6)


@given(change=st.floats(0.01, 20.0), acceleration=ACCELERATIONS, jerk=JERKS, rise=RISES)
@settings(max_examples=examples(80), deadline=None)
def test_the_first_half_of_a_ramp_is_half_of_its_change(
    change: float, acceleration: float, jerk: float, rise: float
) -> None:
    ramp = speed_ramps(
        np.array([change]),
        SpeedLimits(np.array([acceleration]), np.array([jerk]), np.array([rise])),
    )
    _, speed, reached = ramp.begun(0.5 * ramp.duration_s)
    assert speed[0] == pytest.approx(0.5 * change, rel=1e-9)
    # "Nearly all there" where the jerk has not quite fallen yet.
    assert reached[0] == pytest.approx(ramp.acceleration_m_s2[0], rel=1e-5)
