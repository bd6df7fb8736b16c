"""PX4's flight against the measured laws of multicopters on its 1.17 line, by hand calculation.

Figures called measured are of recorded simulated flights; formulas are PX4's own, with the defaults
a = 3 m/s², j = 4 m/s³, an acceptance radius of 2 m and b = 4 a²/j = 9 m/s.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from ardupilot_missions import go, stage, takeoff
from hypothesis import example, given, settings
from hypothesis import strategies as st
from made_returns import to_home
from px4_flights import fly_px4, px4_returns
from thinning import examples

from planner.flight.motion.kinematics import STATES
from planner.flight.motion.px4.braking import (
    allowed_speed_m_s,
    braking_distance_m,
    corner_speed_m_s,
    stopping_distance_m,
)
from planner.mission.route.stage import Stage, StageKind
from planner.physics.wind import Wind
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

PX4 = Px4Parameters()
A, J, R = 3.0, 4.0, 2.0


def times_s(*stages: Stage, parameters: Px4Parameters = PX4) -> np.ndarray:
    """Return how long each stage took until it was reported as reached."""
    motion = fly_px4(stages, parameters)
    end = np.concatenate(([0.0], motion.segments.end_s))
    return np.diff(np.concatenate(([0.0], end[motion.arrival_segment + 1])))


def cruising(speed_m_s: float) -> Px4Parameters:
    return replace(PX4, cruise_speed_m_s=speed_m_s, speed_max_m_s=max(12.0, speed_m_s))


def leg_s(length_m: float, speed_m_s: float, *, a: float = A, j: float = J, r: float = R) -> float:
    """Return the time of a leg from rest to rest, until it is within the acceptance radius."""
    b = 4.0 * a**2 / j
    brake_m = (speed_m_s**2 + b * speed_m_s) / (2.0 * a)  # before the stop, where v is allowed
    last = 0.5 * (-b + math.sqrt(b**2 + 8.0 * a * r))
    braking = (speed_m_s - last) / a + 2.0 * a / j * math.log(speed_m_s / last)
    # Flown is u + u̇²/2j, u̇ = 2 a u/(2 u + b): sooner by the integral of u̇²/2j dt/u.
    braking -= a / (2.0 * j) * math.log((2.0 * speed_m_s + b) / (2.0 * last + b))
    ramp = speed_m_s / (2.0 * a) + a / (2.0 * j)
    return (length_m - r) / speed_m_s + ramp + braking - (brake_m - r) / speed_m_s


@pytest.mark.parametrize(
    ("speed_m_s", "before_m"), [(3.0, 6.0), (5.0, 11.7), (8.0, 22.7), (12.0, 42.0)]
)
def test_braking_begins_where_it_was_measured(speed_m_s: float, before_m: float) -> None:
    found = braking_distance_m(
        np.array(speed_m_s), np.array(0.0), acceleration_m_s2=np.array(A), jerk_m_s3=np.array(J)
    )
    assert found == pytest.approx(before_m, abs=0.05)  # the figures' own rounding


def test_the_allowed_speed_is_the_law_of_the_source() -> None:
    # u² + b u = 2 a d + v_f²: from 20 m with 9 m/s, u = (−9 + √(81 + 480 + 4·4)) / 2 for v_f = 2.
    found = allowed_speed_m_s(
        np.array(20.0), np.array(2.0), acceleration_m_s2=np.array(A), jerk_m_s3=np.array(J)
    )
    assert found == pytest.approx(0.5 * (-9.0 + math.sqrt(81.0 + 4.0 * (120.0 + 4.0))))


@pytest.mark.parametrize(
    ("turn_deg", "speed_m_s"), [(15, 4.77), (30, 3.35), (45, 2.69), (60, 2.28), (90, 1.73)]
)
def test_corners_are_flown_at_the_speed_of_the_source(turn_deg: float, speed_m_s: float) -> None:
    # sqrt(MPC_XY_TRAJ_P a r tan((180° − θ) / 2)) = sqrt(0.5 · 3 · 2 · tan(…)).
    found = corner_speed_m_s(
        np.cos(np.radians(turn_deg)), np.array(R), gain_per_s=0.5, acceleration_m_s2=A
    )
    assert found == pytest.approx(speed_m_s, abs=0.01)


@pytest.mark.parametrize(
    ("speed_m_s", "measured_s"), [(3.0, 101.0), (5.0, 62.2), (8.0, 41.4), (12.0, 30.7)]
)
def test_a_leg_of_300_m_takes_what_was_measured(speed_m_s: float, measured_s: float) -> None:
    took = times_s(takeoff(50), go(300.0, hold=1.0), parameters=cruising(speed_m_s))[1] - 1.0
    assert took == pytest.approx(leg_s(300.0, speed_m_s), rel=0.01)
    assert took == pytest.approx(measured_s, rel=0.015)  # 0.3 s of noise in the flights


@pytest.mark.parametrize(("a", "j", "r"), [(2.0, J, R), (A, 2.0, R), (A, J, 5.0), (5.0, 8.0, 1.0)])
def test_acceleration_jerk_and_radius_move_a_leg_as_the_law_says(
    a: float, j: float, r: float
) -> None:
    changed = replace(PX4, acceleration_m_s2=a, jerk_m_s3=j, acceptance_radius_m=r)
    took = times_s(takeoff(50), go(300.0, hold=1.0), parameters=changed)[1] - 1.0
    assert took == pytest.approx(leg_s(300.0, 5.0, a=a, j=j, r=r), rel=0.01)


@pytest.mark.parametrize(
    ("height_m", "measured_s"), [(15, 15.5), (20, 17.5), (30, 20.9), (50, 27.5), (100, 44.4)]
)
def test_takeoffs_are_done_when_they_were(height_m: float, measured_s: float) -> None:
    assert times_s(takeoff(height_m))[0] == pytest.approx(measured_s, abs=0.5)


@pytest.mark.parametrize(("change_m", "measured_s"), [(100.0, 36.6), (-100.0, 67.7)])
def test_climbs_and_descents_take_what_was_measured(change_m: float, measured_s: float) -> None:
    took = times_s(takeoff(150), go(0.0, 0.0, 150.0 + change_m, hold=1.0))[1] - 1.0
    # Reached within NAV_MC_ALT_RAD, 0.8 m.  1.2 % sooner down than flown: noise, as the flights had.
    assert took == pytest.approx(measured_s, rel=0.015)


def test_the_last_ten_metres_take_what_was_measured() -> None:
    stages = (takeoff(40), stage(StageKind.LAND, height_m=0.0))
    motion = fly_px4(stages, PX4)
    time_s = np.arange(0.0, motion.segments.end_s[-1], 0.01)
    height = motion.state_at_time(time_s).height_m
    begun = time_s[np.flatnonzero(height > 10.0)[-1]]
    touched = time_s[np.flatnonzero(height > 0.01)[-1]]
    assert touched - begun == pytest.approx(13.2, abs=0.4)


def test_a_hold_counts_from_reaching_the_place() -> None:
    short, long = (times_s(takeoff(20), go(100.0, hold=h))[1] for h in (1.0, 21.0))
    assert long - short == pytest.approx(20.0, abs=1e-6)


def test_a_return_climbs_flies_at_its_own_speed_and_lands() -> None:
    low = (takeoff(10), replace(go(400.0), height_m=10.0, speed_m_s=8.0))
    motion = fly_px4((*low, stage(StageKind.RETURN, height_m=0.0)), PX4)
    heights = motion.state_at_time(np.arange(0.0, motion.segments.end_s[-1], 0.1)).height_m
    assert heights.max() == pytest.approx(PX4.return_altitude_m, abs=0.1)
    cruise = motion.segments.state == STATES.index("cruise")
    assert motion.segments.speed_m_s[cruise][-1] == pytest.approx(PX4.cruise_speed_m_s, abs=0.01)
    assert motion.state_at_time(motion.segments.end_s[-1:]).height_m == pytest.approx(0.0, abs=0.05)


def test_ways_home_are_the_returns_flown_one_by_one() -> None:
    places = np.array([[100.0, 0.0, 50.0], [0.0, 300.0, 12.0]])
    homes = px4_returns(places, to_home(returns=len(places)), PX4)
    duration = np.bincount(homes.segments.item, homes.segments.duration_s)
    for index, (east, north, height) in enumerate(places):
        there = stage(StageKind.GO, east, north, height, hold=30.0)
        flown = times_s(takeoff(height), there, stage(StageKind.RETURN, height_m=0.0))
        # Standing anywhere inside the acceptance radius is standing there.
        assert duration[index] == pytest.approx(flown[2], abs=0.8)


@pytest.mark.parametrize("speed_m_s", [3.0, 5.0, 8.0, 12.0])
def test_a_stop_in_mid_leg_takes_the_way_of_a_hold(speed_m_s: float) -> None:
    # PX4 holds where it would be after 0.6 s and a braking at a: v (0.6 + v / 2a).
    expected_m = speed_m_s * (0.6 + speed_m_s / (2.0 * A))
    assert stopping_distance_m(speed_m_s, PX4) == pytest.approx(expected_m)


@pytest.mark.parametrize(("speed_m_s", "flown_m"), [(5.0, 8.35), (8.0, 17.23)])
def test_drag_carries_a_stop_past_its_trajectory(speed_m_s: float, flown_m: float) -> None:
    # Flown by PX4 with a drag of 1/s: HOLD after 150 and 250 m.  The trajectories stopped after 7.28 and
    # 15.19 m.
    assert stopping_distance_m(speed_m_s, PX4, 1.0) == pytest.approx(flown_m, rel=0.05)
    assert stopping_distance_m(speed_m_s, PX4, 1.0) > flown_m
    # A vehicle whose integral takes up its drag as fast as it brakes passes by little; none by none.
    quick = replace(PX4, velocity_integral_gain_per_s2=18.0)
    assert stopping_distance_m(speed_m_s, quick, 1.0) < stopping_distance_m(speed_m_s, PX4) + 0.3
    same = replace(PX4, velocity_integral_gain_per_s2=0.95 * 1.8)  # both rates are one
    near = replace(PX4, velocity_integral_gain_per_s2=0.951 * 1.8)
    assert stopping_distance_m(speed_m_s, same, 1.0) == pytest.approx(
        stopping_distance_m(speed_m_s, near, 1.0), rel=1e-3
    )


def test_at_the_limit_of_the_tilt_the_trajectory_may_be_as_fast_as_it_is_let() -> None:
    # Flown at 1/s, asked for 12 m/s: 9.81 m/s², 9.83 m/s, and 31.2 and 31.8 m for two holds.
    assert 31.8 < stopping_distance_m(9.83, PX4, 1.0) < 1.1 * 31.8
    assert stopping_distance_m(9.0, PX4, 1.0) < 23.0


@pytest.mark.parametrize(
    ("a", "j", "stop_m"),
    [
        (3.0, 4.0, 12.0 * (0.6 + 12.0 / 6.0)),  # 31.2 m; a return needs 6 (4 + 0.75) = 28.5 m
        (3.0, 2.0, 6.0 * (12.0 / 3.0 + 3.0 / 2.0)),  # 33 m: a return, at limited jerk
        (8.0, 4.0, 12.0 * math.sqrt(12.0 / 4.0)),  # 20.8 m: too slow a jerk to reach 8 m/s²
        (6.0, 20.0, 12.0 * (0.6 + 12.0 / 12.0)),
    ],
)
def test_no_stop_is_shorter_than_the_jerk_lets_it(a: float, j: float, stop_m: float) -> None:
    parameters = replace(PX4, acceleration_m_s2=a, jerk_m_s3=j)
    assert stopping_distance_m(12.0, parameters) == pytest.approx(stop_m)


def test_noise_slows_time_and_is_off_by_default() -> None:
    stages = (takeoff(100), go(0.0, 0.0, 200.0, hold=5.0))
    quiet, noisy = (fly_px4(stages, PX4, noise_m=noise).segments.end_s[-1] for noise in (0.0, 0.3))
    # All axes are slowed by 1 − 0.3 / MPC_XY_ERR_MAX, at most.
    assert quiet < noisy < quiet / (1.0 - 0.3 / 2.0)


@pytest.mark.parametrize(
    ("change", "index", "slower"),
    [
        ({"cruise_speed_m_s": 4.0}, 1, True),
        ({"climb_speed_m_s": 2.0}, 0, True),
        ({"takeoff_speed_m_s": 1.0}, 0, True),
        ({"descent_speed_m_s": 1.0}, 2, True),
        ({"land_speed_m_s": 0.5}, 2, True),
    ],
)
def test_each_parameter_moves_its_part_the_right_way(
    change: dict[str, float],
    index: int,
    slower: bool,  # noqa: FBT001 - a table of cases
) -> None:
    stages = (takeoff(50), go(200.0, hold=1.0), stage(StageKind.LAND, 200.0, height_m=0.0))
    before = times_s(*stages)
    after = times_s(*stages, parameters=replace(PX4, **change))
    assert bool(after[index] > before[index]) is slower


def test_a_higher_return_takes_the_climb_and_the_descent_longer() -> None:
    stages = (takeoff(20), go(200.0, height_m=20.0), stage(StageKind.RETURN, height_m=0.0))
    took = [
        times_s(*stages, parameters=replace(PX4, return_altitude_m=height))[2]
        for height in (30.0, 60.0)
    ]
    # 30 m more up at 3 m/s and down at 1.5 m/s.
    assert took[1] - took[0] == pytest.approx(30.0 / 3.0 + 30.0 / 1.5, abs=0.5)


@pytest.mark.parametrize(
    ("from_deg", "ground_m_s"),
    [
        (0.0, 12.0 - 6.0),  # against it
        (180.0, 10.0),  # with it: as commanded
        (90.0, 10.0),  # across: √(12² − 6²) = 10.4 m/s could be held
        (45.0, -6.0 * math.sqrt(0.5) + math.sqrt(144.0 - 18.0)),
    ],
)
def test_against_the_wind_the_tilt_limit_sets_the_speed(from_deg: float, ground_m_s: float) -> None:
    there = replace(go(0.0, 600.0, hold=1.0), speed_m_s=10.0)
    wind = Wind(speed_m_s=6.0, from_deg=from_deg)
    motion = fly_px4((takeoff(50), there), PX4, wind=wind, airspeed_limit_m_s=12.0)
    cruise = motion.segments.state == STATES.index("cruise")
    assert motion.segments.speed_m_s[cruise] == pytest.approx([ground_m_s], rel=1e-6)
    assert (motion.slowed is not None) is (ground_m_s < 10.0)


@st.composite
def wide_missions(draw: st.DrawFn) -> tuple[Stage, ...]:
    """Missions whose legs are long enough to be flown as they are meant."""
    east, north, height, stages = 0.0, 0.0, 40.0, [takeoff(40.0)]
    for _ in range(draw(st.integers(1, 6))):
        course, length = draw(st.floats(0.0, 6.28)), draw(st.floats(80.0, 300.0))
        east, north = east + length * math.cos(course), north + length * math.sin(course)
        height = max(10.0, height + draw(st.sampled_from([0.0, 0.0, 10.0, -10.0])))
        there = go(east, north, height, hold=draw(st.sampled_from([0.0, 0.0, 5.0])))
        stages.append(replace(there, speed_m_s=draw(st.sampled_from([None, 3.0, 8.0, 12.0]))))
    return tuple(stages)


def flown_at(*legs: tuple[float, float, float, float]) -> tuple[Stage, ...]:
    """Return a mission over places, by east, north, height and speed."""
    places = (replace(go(e, n, h), speed_m_s=speed) for e, n, h, speed in legs)
    return takeoff(40.0), *places


@settings(deadline=None, max_examples=examples(60))
@given(wide_missions())
# A climb in which the speed grows, one in which it falls, and a bend of 14°.
@example(flown_at((80.0, 0.0, 40.0, 5.0), (160.0, 0.0, 40.0, 5.0), (240.0, 0.0, 50.0, 8.0)))
@example(flown_at((80.0, 0.0, 40.0, 8.0), (160.0, 0.0, 50.0, 5.0)))
@example(flown_at((77.513, 19.792, 40.0, 3.0), (157.513, 19.792, 40.0, 3.0)))
def test_velocity_never_jumps_and_changes_within_the_limits(stages: tuple[Stage, ...]) -> None:
    motion = fly_px4(stages, PX4)
    begun = np.searchsorted(motion.piece_segment, 1)  # the take-off has its own test
    piece = np.arange(begun, len(motion.piece_duration_s))
    lasts = motion.piece_duration_s[piece][:, None]
    state = motion.state_at(piece[:, None], np.linspace(0.0, 1.0, 17) * lasts)
    place = np.stack((state.east_m, state.north_m, state.height_m), axis=-1)
    velocity = np.stack((state.east_m_s, state.north_m_s, state.climb_m_s), axis=-1)
    assert np.abs(place[1:, 0] - place[:-1, -1]).max(initial=0.0) < 0.03  # what the solver leaves
    # Less than 0.01 m/s is taken at once, on every axis, where a leg begins and where it ends.
    assert np.abs(velocity[1:, 0] - velocity[:-1, -1]).max(initial=0.0) < 0.05
    step = np.maximum(lasts, 1e-3)[..., None] / 16.0
    acceleration = np.diff(velocity, axis=1) / step
    jerk = np.diff(acceleration, axis=1) / step
    before, after = velocity[:, 0], velocity[:, -1]
    straight = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) < 1e-6
    # North and east have the whole of MPC_ACC_HOR each, the height MPC_ACC_UP_MAX; braking laws
    # ask for no more.  A millimetre of rounding in a piece of hundredths of a second is left out.
    lasting = straight & (lasts[:, 0] > 0.02)
    assert np.abs(acceleration[lasting][..., :2]).max(initial=0.0) <= A * 1.01
    assert np.abs(acceleration[lasting][..., 2]).max(initial=0.0) <= 4.0 * 1.01
    assert np.abs(jerk[lasting]).max(initial=0.0) <= J * 1.01
    # A turn is one curve in the time PX4 takes to head for the target, with what is still across the way
    # then dying away at MPC_ACC_HOR: one and a half of that at most, as of a cubic's ends.
    assert np.abs(acceleration[..., :2]).max(initial=0.0) <= 1.5 * A
    assert np.abs(jerk[lasts[:, 0] > 0.02][..., :2]).max(initial=0.0) <= 2.0 * J


@settings(deadline=None, max_examples=examples(30))
@given(
    st.lists(
        st.builds(
            go,
            st.floats(-300.0, 300.0),
            st.floats(-300.0, 300.0),
            st.floats(5.0, 120.0),
            hold=st.sampled_from([0.0, 0.0, 0.0, 4.0]),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_any_mission_is_flown_to_the_ground_in_finite_pieces(places: list[Stage]) -> None:
    stages = (takeoff(30), *places, stage(StageKind.RETURN, height_m=0.0))
    motion = fly_px4(stages, PX4)
    assert (motion.segments.duration_s >= 0.0).all()
    assert motion.piece_duration_s.sum() == pytest.approx(motion.segments.duration_s.sum())
    state = motion.state_at_time(np.linspace(0.0, motion.segments.end_s[-1], 1000))
    for column in (state.east_m, state.north_m, state.height_m, state.ground_speed_m_s):
        assert np.isfinite(column).all()
    assert state.height_m[-1] == pytest.approx(0.0, abs=0.05)
