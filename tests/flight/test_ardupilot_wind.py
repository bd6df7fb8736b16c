"""ArduPilot in wind: the ground speed is held up to the lean limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from ardupilot_missions import DEFAULTS, go, stage, takeoff, took_s

from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.flight.motion.kinematics import STATES
from planner.mission.route.stage import Stage, StageKind
from planner.physics.wind import Wind

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import Motion


def windy(wind_m_s: float, limit: float | None, *, speed: float = 10.0) -> tuple[float, list[int]]:
    """Return the speed of a leg, and the items that are flown slower than commanded."""
    motion = fly_ardupilot(
        (takeoff(), stage(StageKind.GO, 1000.0, speed=speed, hold=1.0)),
        DEFAULTS,
        wind=Wind(speed_m_s=wind_m_s, from_deg=90.0),
        airspeed_limit_m_s=limit,
    )
    cruise = [STATES[s].value for s in motion.segments.state].index("cruise")
    return float(motion.segments.speed_m_s[cruise]), slowed_items(motion)


def slowed_items(motion: Motion) -> list[int]:
    return [] if motion.slowed is None else motion.slowed.item.tolist()


def test_ground_speed_is_held_in_wind_until_the_lean_limit() -> None:
    assert windy(8.0, None) == (10.0, [])
    assert windy(8.0, 20.0) == (10.0, [])
    speed, slowed = windy(8.0, 15.0)
    assert speed == pytest.approx(7.0)
    assert slowed == [1]


def test_a_speed_beyond_the_lean_limit_is_not_reached_in_still_air() -> None:
    speed, slowed = windy(0.0, 10.26, speed=15.0)
    assert speed == pytest.approx(10.26)
    assert slowed == [1]


def profiled(*stages: Stage, limit: float = 15.0) -> Motion:
    # 5 m/s from east at 10 m, growing with the root of the height: 10 m/s at 40 m, 15 m/s at 90 m.
    wind = Wind(speed_m_s=5.0, from_deg=90.0, reference_height_m=10.0, shear_exponent=0.5)
    return fly_ardupilot(stages, DEFAULTS, wind=wind, airspeed_limit_m_s=limit)


def test_a_wind_that_grows_with_height_slows_the_higher_leg_more() -> None:
    low = profiled(takeoff(10.0), go(1000.0, height_m=10.0, hold=1.0))
    high = profiled(takeoff(40.0), go(1000.0, height_m=40.0, hold=1.0))
    assert max(low.segments.speed_m_s) == pytest.approx(10.0)
    assert slowed_items(low) == []
    assert high.segments.speed_m_s[1:].max() == pytest.approx(5.0)
    assert slowed_items(high) == [1]


def test_a_leg_through_a_wind_profile_is_flown_at_the_lowest_speed_it_meets() -> None:
    climbing = profiled(takeoff(10.0), go(1000.0, height_m=40.0, hold=1.0))
    # 5 m/s over the ground at its upper end, along a line that rises 30 m on 1,000 m
    assert climbing.segments.speed_m_s[1:].max() == pytest.approx(5.0)


def test_splines_keep_to_the_lean_limit_as_well() -> None:
    spline = stage(StageKind.SPLINE, 1000.0, 0.0, 40.0)
    motion = profiled(takeoff(40.0), spline)
    assert motion.segments.speed_m_s[-1] == pytest.approx(5.0)
    assert slowed_items(motion) == [1]


def test_a_vehicle_at_its_lean_limit_starts_later() -> None:
    def took(limit: float | None) -> float:
        stages = (takeoff(), go(60.0, hold=10.0), go(60.0, 60.0, hold=1.0))
        return took_s(fly_ardupilot(stages, DEFAULTS, airspeed_limit_m_s=limit), 2)

    # 60 m from rest to rest, recorded with a limit of 10.24 m/s: 13.53 s (ArduCopter 4.7.0-dev in SITL).
    assert took(10.24) - 1.0 == pytest.approx(13.53, abs=0.12)
    assert took(10.24) > took(None) + 0.1
    # A hundredth of that drag is forgiven.
    assert took(400.0) == took(None)
