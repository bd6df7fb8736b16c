"""Waits of PX4 to look at regions of interest, by flights of PX4 1.17 begun with the heading north."""

from __future__ import annotations

import math

import numpy as np
import pytest
from ardupilot_missions import go, stage, takeoff
from px4_flights import fly_px4

from planner.flight.motion.px4.braking import yaw_time_s
from planner.flight.motion.px4.looking import STEP_S, Look
from planner.mission.route.stage import Stage, StageKind
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

PX4 = Px4Parameters()
SLOW = Px4Parameters(yaw_acceleration_rad_s2=math.radians(10.0))
ACC_DEG_S2, ERR_DEG = 20.0, 12.0
"""MPC_YAWRAUTO_ACC and MIS_YAW_ERR as PX4 has them."""


def looking(place: Stage, east_m: float, north_m: float) -> Stage:
    """Return the flight to a place on which the vehicle looks at a region of interest."""
    off = east_m - place.east_m, north_m - place.north_m
    return replace(place, yaw_deg=math.degrees(math.atan2(*off)), looks_m=off)


def took_s(*stages: Stage, parameters: Px4Parameters = PX4, heading_deg: float = 0.0) -> np.ndarray:
    """Return how long each stage took until it was done."""
    motion = fly_px4(stages, parameters, heading_rad=math.radians(heading_deg))
    return np.diff(np.concatenate(([0.0], motion.segments.end_s[motion.done_segment])))


def ring(radius_m: float, points: int, speed_m_s: float | None = None, **own: float) -> list[Stage]:
    """Return waypoints round a tower 16 m east of the take-off, looked at all the way."""
    angles = -1.85 + 2.0 * math.pi * np.arange(points + 1) / points
    places = [
        go(16.0 + radius_m * math.cos(t), 1.0 + radius_m * math.sin(t), 20.0)
        for t in angles.tolist()
    ]
    return [looking(replace(one, speed_m_s=speed_m_s, **own), 16.0, 1.0) for one in places]


@pytest.mark.parametrize(
    ("places", "flown_s"),
    [
        (ring(12.0, 8, 6.0), 6.45),
        (ring(12.0, 8, 6.0, acceptance_radius_m=3.0), 6.51),
        (ring(20.0, 12, 6.0), 6.16),
    ],
)
def test_a_ring_s_first_waypoint_waits_for_the_turn_begun_the_wrong_way(
    places: list[Stage], flown_s: float
) -> None:
    # From the take-off the tower is east, from the first waypoint north, where the vehicle looks already.
    assert took_s(takeoff(20.0), *places)[1] == pytest.approx(flown_s, abs=0.35)
    free = [replace(one, yaw_deg=None, looks_m=None) for one in places]
    assert took_s(takeoff(20.0), *free)[1] < flown_s - 0.4


def test_a_vehicle_that_waits_swings_past_its_waypoint() -> None:
    places = ring(12.0, 8, 6.0)
    first, second = took_s(takeoff(20.0), *places)[1:3]
    assert second == pytest.approx(3.89, abs=0.4)
    # Later ones are passed as without a tower: 3.0 s each.
    assert took_s(takeoff(20.0), *places)[6] == pytest.approx(3.0, abs=0.15)
    assert first > second


@pytest.mark.parametrize(
    ("stages", "flown_s"),
    [
        # Right beside a tower at half the yaw acceleration: it is passed, then behind the vehicle.
        (
            (go(30.0, 0.0, 20.0), looking(go(75.0, 8.0, 20.0), 62.0, 5.0), go(90.0, 30.0, 20.0)),
            13.2,
        ),
        (
            (
                go(40.0, 0.0, 20.0, hold=5.0),
                looking(go(54.0, 12.0, 20.0), 50.0, 6.0),
                go(20.0, 30.0, 20.0),
            ),
            9.24,
        ),
    ],
)
def test_a_tower_passed_close_is_turned_to_at_the_end(
    stages: tuple[Stage, ...], flown_s: float
) -> None:
    assert took_s(takeoff(20.0), *stages, parameters=SLOW)[2] == pytest.approx(flown_s, abs=0.35)


def test_a_square_begun_straight_on_waits_beyond_its_first_corner() -> None:
    corners = ((13.0, -2.0), (37.0, -2.0), (37.0, 22.0))
    places = [looking(go(*corner, 12.0), 25.0, 10.0) for corner in corners]
    took = took_s(takeoff(12.0), *places)
    assert took[1:3] == pytest.approx([5.3, 5.75], abs=0.4)


def test_no_heading_is_waited_for_where_a_time_ends_the_wait() -> None:
    places = ring(12.0, 8, 6.0)
    free = [replace(one, yaw_deg=None, looks_m=None) for one in places]
    timed = replace(PX4, yaw_timeout_s=5.0)
    looked = took_s(takeoff(20.0), *places, parameters=timed)
    assert looked == pytest.approx(took_s(takeoff(20.0), *free, parameters=timed))


def test_a_heading_not_known_is_any_and_their_mean_is_taken() -> None:
    places = ring(12.0, 8, 6.0)
    motion = fly_px4((takeoff(20.0), *places), PX4)
    assert motion.wait_spread_s is not None
    assert motion.wait_spread_s.min() < 0.0 < motion.wait_spread_s.max()


def test_a_vehicle_looks_on_while_it_is_delayed() -> None:
    delay = stage(StageKind.DELAY, 54.0, 12.0, 20.0, hold=30.0)
    first, second = (looking(go(*one, 20.0), 50.0, 6.0) for one in ((54.0, 12.0), (54.5, 12.5)))
    took = took_s(takeoff(20.0), go(40.0, 0.0, 20.0), first, delay, second, parameters=SLOW)
    assert took[3:] == pytest.approx([30.0, 0.0], abs=0.1)


def follow(look: Look, bearings_deg: np.ndarray) -> Look:
    return look.followed(np.radians(bearings_deg).tolist(), PX4)


@pytest.mark.parametrize("turn_deg", [30.0, 90.0, 170.0, -170.0])
def test_a_region_that_stands_still_is_turned_to_as_any_heading(turn_deg: float) -> None:
    steps = math.ceil(float(yaw_time_s(np.array(math.radians(abs(turn_deg))), PX4)) / STEP_S)
    bearing = math.radians(turn_deg)
    before, after = (follow(Look(0.0, 0.0), np.full(n, turn_deg)) for n in (steps - 3, steps + 2))
    assert before.is_off(bearing, PX4)
    assert not after.is_off(bearing, PX4)


@pytest.mark.parametrize("faster", [False, True])
def test_a_heading_lags_behind_a_region_that_turns(*, faster: bool) -> None:
    # v²/2a: at 21.9°/s as much as MIS_YAW_ERR.
    rate_deg_s = math.sqrt(2.0 * ACC_DEG_S2 * ERR_DEG) * (1.1 if faster else 0.9)
    bearings = rate_deg_s * STEP_S * np.arange(400.0)
    look = follow(Look(0.0, 0.0), bearings)
    assert look.is_off(math.radians(bearings[-1]), PX4) is faster
    lag_deg = bearings[-1] - math.degrees(look.heading_rad)
    assert lag_deg == pytest.approx(rate_deg_s**2 / (2.0 * ACC_DEG_S2), abs=1.5)


def test_of_a_long_way_its_end_alone_is_looked_along() -> None:
    # a turn round takes 42 s at most: where it looked minutes before does not tell where it looks then
    def waits_s(north_m: float) -> float:
        there, on = go(0.0, north_m, 20.0), go(30.0, north_m + 20.0, 20.0)
        passing = looking(there, 3.0, north_m - 13.0)
        looked, free = (
            took_s(takeoff(20.0), one, on, parameters=SLOW).sum() for one in (passing, there)
        )
        return float(looked - free)

    near_s = waits_s(280.0)  # 56 s at 5 m/s: all of the way
    assert near_s > 0.5
    # of ways beyond 10 km it is not stepped how the waypoint is swung over
    assert [waits_s(2e3), waits_s(2e4)] == pytest.approx([near_s] * 2, abs=0.5)
