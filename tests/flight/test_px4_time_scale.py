"""How fast PX4's time passes with a noisy position, and how far the vehicle wanders meanwhile."""

from __future__ import annotations

import math

import numpy as np
import pytest
from ardupilot_missions import go, stage, takeoff
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import mission, rtl, waypoint
from made_missions import takeoff as takeoff_item
from px4_flights import fly_px4
from scipy.stats import norm
from thinning import examples

from planner.autopilot import Autopilot
from planner.flight.motion.px4.pieces import TimeScale
from planner.mission.route.stage import StageKind
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.px4 import Px4Parameters

PX4 = Px4Parameters()
P, E = 0.95, 2.0  # MPC_XY_P and MPC_XY_ERR_MAX


def steady(speed_m_s: float, noise_m: float = 0.32, parameters: Px4Parameters = PX4) -> float:
    """Return the time scale at a constant horizontal speed."""
    speed = np.array([speed_m_s])
    return float(TimeScale.of(noise_m, parameters).between(speed, speed)[0])


@pytest.mark.parametrize(
    ("speed_m_s", "time_scale"),
    # v0 = 2 · 0.95 · 2/π = 1.2096 m/s; 1 − 0.08/(1 + v/v0).
    [(0.0, 0.92), (1.2096, 0.96), (5.0, 0.98442), (12.0, 0.99267)],
)
def test_the_faster_the_less_time_slows_down(speed_m_s: float, time_scale: float) -> None:
    assert steady(speed_m_s) == pytest.approx(time_scale, abs=1e-5)


def test_speeding_up_passes_time_as_fast_as_the_speeds_in_between() -> None:
    # 1 − 0.08 · 1.2096/10 · ln((10 + 1.2096)/1.2096).
    whole = TimeScale.of(0.32, PX4).between(np.array([0.0]), np.array([10.0]))
    assert whole[0] == pytest.approx(1.0 - 0.021545, abs=1e-6)
    many = np.linspace(0.0, 10.0, 10001)
    assert np.mean([steady(v) for v in many[::10]]) == pytest.approx(whole[0], abs=1e-4)


@settings(deadline=None, max_examples=examples(50))
@given(st.floats(0.0, 20.0), st.floats(0.0, 20.0), st.floats(0.0, 1.9))
def test_the_time_scale_of_a_change_of_speed_lies_between_those_at_its_ends(
    first_m_s: float, last_m_s: float, noise_m: float
) -> None:
    ends = sorted((steady(first_m_s, noise_m), steady(last_m_s, noise_m)))
    time_scale = TimeScale.of(noise_m, PX4).between(np.array([first_m_s]), np.array([last_m_s]))[0]
    assert ends[0] - 1e-9 <= time_scale <= ends[1] + 1e-9


@pytest.mark.parametrize("speed_m_s", [0.5, 1.0, 3.0, 5.0, 8.0, 12.0])
@pytest.mark.parametrize("gain_per_s", [0.5, 0.95, 1.5])
def test_the_lost_speed_is_about_what_the_balance_of_a_slow_disturbance_takes(
    speed_m_s: float, gain_per_s: float
) -> None:
    """Solved for each disturbance: w = P x + v √(x² + c²)/E behind, or standing still at x = 0.

    w and the error c across are normal with P σ and σ, σ = ē √(2/π).
    """
    noise_m = 0.32
    sd_m = noise_m * math.sqrt(2.0 / math.pi)
    share = (np.arange(200) + 0.5) / 200.0
    w, c = np.meshgrid(gain_per_s * sd_m * norm.ppf(share), sd_m * norm.ppf(0.5 + 0.5 * share))
    behind, ahead = np.zeros_like(w), np.full_like(w, 10.0)
    for _ in range(60):
        middle = 0.5 * (behind + ahead)
        under = gain_per_s * middle + speed_m_s * np.hypot(middle, c) / E < w
        behind, ahead = np.where(under, middle, behind), np.where(under, ahead, middle)
    # What is not pushed behind loses what the disturbance takes, or nothing where it leads.
    lost = np.minimum(np.maximum(w, 0.0), speed_m_s * np.hypot(behind, c) / E).mean()
    law = speed_m_s * (
        1.0 - steady(speed_m_s, noise_m, replace(PX4, position_gain_per_s=gain_per_s))
    )
    # The law is the hyperbola through both ends.
    assert law == pytest.approx(lost, rel=0.2)
    assert law < lost


def test_cruises_lose_what_was_recorded() -> None:
    """Four flights at 0.32 m: how far trajectories fell behind their speeds, by speed and time."""
    speed_m_s = np.array([3.0, 5.0, 8.0, 10.0, 12.0])
    lasted_s = np.array([198.0, 130.9, 66.3, 90.2, 39.0])
    lost_m_s = np.array([0.056, 0.079, 0.040, 0.060, 0.189])
    law = np.array([v * (1.0 - steady(v)) for v in speed_m_s])
    # A figure of a hundred seconds is uncertain by 0.04 m/s: noise has a memory of 5 s.
    mean = (lost_m_s * lasted_s).sum() / lasted_s.sum()
    assert (law * lasted_s).sum() / lasted_s.sum() == pytest.approx(mean, abs=0.02)


def test_speeding_up_behind_a_turn_is_lagged_in() -> None:
    # 0.1 s · ln((1.9 + 8)/(1.9 + 2)) = 0.0932 s, at a noise above the lag of 0.1 · 3/0.95 = 0.316 m.
    two, eight = np.array([2.0]), np.array([8.0])
    for noise_m, lag_s in ((0.4, 0.09316), (0.158, 0.04658), (0.0, 0.0)):
        time_scale = TimeScale.of(noise_m, PX4)
        lost_s = 2.0 / time_scale.lagging(two, two, eight) - 2.0 / time_scale.between(two, eight)
        # Without noise braking has put the vehicle as far ahead.
        assert lost_s == pytest.approx(lag_s, abs=1e-4)


def landing_s(east_m: float, hold_s: float, noise_m: float) -> float:
    """Return the time from the end of a hold 60 m over a landing place to disarmed."""
    high = go(east_m, 0.0, 60.0, hold=hold_s)
    ground = stage(StageKind.LAND, east_m, 0.0, 0.0)
    motion = fly_px4((takeoff(60.0), high, ground), PX4, noise_m=noise_m)
    return float(motion.segments.duration_s[-1])


def test_a_landing_at_home_from_standing_waits_for_all_noise_elsewhere_for_half() -> None:
    grounded_s = 3.6
    for east_m, share in ((0.0, 0.16), (200.0, 0.08)):
        quiet, noisy = (landing_s(east_m, 60.0, noise) - grounded_s for noise in (0.0, 0.32))
        assert noisy == pytest.approx(quiet / (1.0 - share), rel=1e-3)


def test_a_landing_that_still_creeps_to_its_place_waits_for_half_of_the_noise() -> None:
    # From 2 m off at 0.59/s, the rate at 2 m: ln(2e5)/0.59 = 20.7 s of PX4's time, at 0.92; the
    # rest, of what it takes without noise, at 0.84.
    near = (takeoff(60.0), go(30.0, 0.0, 60.0), stage(StageKind.LAND, 0.0, 0.0, 0.0))
    quiet, noisy = (
        float(fly_px4(near, PX4, noise_m=noise).segments.duration_s[-1]) - 3.6
        for noise in (0.0, 0.32)
    )
    assert noisy == pytest.approx(20.7 / 0.92 + (quiet - 20.7) / 0.84, abs=0.15)


def test_a_hover_wanders_at_seven_tenths_of_what_the_controller_asks_for() -> None:
    # 0.7 · 0.95/s · 0.3 m = 0.1995 m/s: for 100 s; at 5 m/s √(500² + 19.95²) − 500.
    time_scale = TimeScale.of(0.3, PX4)
    wandered = time_scale.wandered_m(np.array([100.0, 100.0]), np.array([0.0, 500.0]))
    assert wandered == pytest.approx([19.95, 0.398], abs=1e-3)


def test_a_vertical_flight_covers_the_ground_it_was_recorded_to() -> None:
    # Up to 300 m and down again at 0.33 m of noise: 112 m over the ground in 499 s in the air.
    stages = (
        takeoff(100.0),
        *(go(0.0, 0.0, height, hold=30.0) for height in (100.0, 200.0, 300.0, 200.0, 100.0)),
        stage(StageKind.LAND, 0.0, 0.0, 0.0),
    )
    assert fly_px4(stages, PX4, noise_m=0.33).wander_m == pytest.approx(112.2, rel=0.05)
    assert fly_px4(stages, PX4).wander_m == 0.0


def test_the_distance_holds_what_is_wandered_and_says_how_much() -> None:
    flown = mission(takeoff_item(20), waypoint(100, 20), rtl(), autopilot=Autopilot.PX4)
    vehicle = load_vehicle("px4-sih-quad")
    quiet, noisy = (check(flown, vehicle, position_noise_m=noise).totals for noise in (0.0, 0.31))
    assert quiet is not None
    assert noisy is not None
    assert quiet.wander_m == 0.0
    assert noisy.wander_m > 1.0
    assert noisy.distance_m - noisy.wander_m == pytest.approx(quiet.distance_m, abs=0.01)
