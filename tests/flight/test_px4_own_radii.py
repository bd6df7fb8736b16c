"""PX4's corners at acceptance radii of their own, of about the length of the legs between them: cut."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import go, land, takeoff
from px4_flights import fly_px4

from planner.flight.motion.px4.stepping import stepped
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import Motion
    from planner.mission.route.stage import Stage

PX4 = Px4Parameters()
SLOW = replace(PX4, cruise_speed_m_s=2.0)
Way = list[tuple[float, float, float | None]]


def mission(way: Way) -> tuple[Stage, ...]:
    """Return waypoints by east, north and radius of their own, and the landing at the last."""
    places = [
        replace(go(east_m, north_m, 20.0), acceptance_radius_m=radius_m)
        for east_m, north_m, radius_m in way
    ]
    return takeoff(20.0), *places, land(*way[-1][:2])


def nearest_m(motion: Motion, east_m: float, north_m: float) -> float:
    time_s = np.arange(0.0, float(motion.segments.end_s[-1]), 0.1)
    state = motion.state_at_time(time_s)
    return float(np.hypot(state.east_m - east_m, state.north_m - north_m).min())


def between(first_m: float, second_m: float, length_m: float) -> Way:
    """Return two turns of 90° to the left and right, the legs between them of a length."""
    far_m = 40.0 + length_m
    return [
        (0.0, 40.0, None),
        (length_m, 40.0, first_m),
        (length_m, far_m, second_m),
        (length_m + 40.0, far_m, None),
    ]


@pytest.mark.parametrize(
    ("way", "flown_s", "passed_m"),
    [
        # Flown by a build of PX4 (1.17, noise 0) at 5 m/s: disarmed after, and two places on its track.
        (between(22.0, 25.0, 30.0), 73.1, [(14.4, 40.8), (20.6, 58.6)]),
        (between(20.0, 20.0, 30.0), 72.9, [(20.9, 46.8), (24.1, 66.0)]),
        (between(12.0, 15.0, 20.0), 69.6, [(16.9, 49.8), (17.2, 59.5)]),
        (between(12.0, 12.0, 30.0), 73.4, [(27.5, 49.0), (29.1, 68.7)]),
        (
            [(0.0, 20.0, None), (0.0, 45.0, 22.0), (30.0, 45.0, 25.0), (70.0, 45.0, None)],
            66.4,
            [(12.6, 37.3), (13.2, 46.6)],
        ),
        ([(0.0, 20.0, 17.0), (25.0, 20.0, 20.0), (60.0, 20.0, None)], 59.1, [(12.5, 17.8)]),
        ([(-15.2, -7.7, 14.7), (-28.6, 2.2, 15.9), (-60.0, 2.2, None)], 55.6, [(-24.6, -0.7)]),
    ],
)
def test_corners_with_radii_as_long_as_legs_are_cut(
    way: Way, flown_s: float, passed_m: list[tuple[float, float]]
) -> None:
    motion = fly_px4(mission(way), PX4, heading_rad=0.0)
    assert motion.segments.end_s[-1] == pytest.approx(flown_s, rel=0.01)
    assert not motion.findings
    for place_m in passed_m:
        assert nearest_m(motion, *place_m) < 1.5


def test_a_circle_that_a_cut_corner_leads_into_is_not_clear() -> None:
    # Flown: failsafe at an exclusion circle of 8 m about that place, which was predicted to be 13 m clear.
    motion = fly_px4(mission(between(22.0, 25.0, 30.0)), PX4, heading_rad=0.0)
    assert nearest_m(motion, 15.6, 67.7) < 8.0


@pytest.mark.parametrize(("radius_m", "is_stepped"), [(4.9, False), (5.0, True)])
def test_a_turn_is_stepped_from_the_radius_on_that_shapes_it(
    radius_m: float, *, is_stepped: bool
) -> None:
    # PX4 steers for a point of the leg max(r, 5 m) away.  At 2 m/s it swings round in less.
    stepped.cache_clear()
    fly_px4(mission(between(radius_m, radius_m, 15.0)), SLOW, heading_rad=0.0)
    assert (stepped.cache_info().misses > 0) == is_stepped


@pytest.mark.parametrize(("length_m", "is_stepped"), [(50.0, False), (30.0, True)])
def test_a_turn_is_stepped_where_its_target_is_near(length_m: float, *, is_stepped: bool) -> None:
    # Begun 10 m before the corner: the way left is hypot(10, length), beside four times the 10 m steered for.
    assert (math.hypot(10.0, length_m) < 40.0) == is_stepped
    stepped.cache_clear()
    way: Way = [(0.0, 80.0, 10.0), (length_m, 80.0, 10.0)]
    fly_px4(mission(way), SLOW, heading_rad=0.0)
    assert (stepped.cache_info().misses > 0) == is_stepped


def test_the_corners_of_a_survey_are_stepped_once() -> None:
    lines = [
        (30.0 * line, north_m, 10.0)
        for line in range(50)
        for north_m in ((0.0, 100.0) if line % 2 else (100.0, 0.0))
    ]
    stepped.cache_clear()
    fly_px4(mission(list(lines)), PX4, heading_rad=0.0)
    assert stepped.cache_info().misses < 20
