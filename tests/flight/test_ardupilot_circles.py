"""Circles of ArduPilot in wind: the lean they ask for against the greatest, by hand."""

from __future__ import annotations

import math

import pytest
from ardupilot_missions import DEFAULTS, go, stage, takeoff, time_s

from planner.flight.motion.ardupilot.flight import fly_ardupilot
from planner.mission.stage import StageKind
from planner.physics.wind import Wind

LIMIT_M_S = 15.0
LEAN_M_S2 = 9.80665 * math.tan(math.radians(30.0))
"""5.66 m/s²: what a lean of 30° pushes with; at 15 m/s drag takes all of it."""


def circling(
    wind_m_s: float, *, speed: float = 10.0, radius: float = 20.0
) -> tuple[float, list[str]]:
    """Return the time of a flight with a circle, and what is said of it."""
    circle = stage(StageKind.CIRCLE, 0.0, 0.0, 20.0, speed=speed, turns=2, radius=radius)
    motion = fly_ardupilot(
        (takeoff(20.0), circle),
        DEFAULTS,
        wind=Wind(speed_m_s=wind_m_s, from_deg=90.0),
        airspeed_limit_m_s=LIMIT_M_S,
    )
    return time_s(motion), [f.code for f in motion.findings if f.code in {"W101", "W105"}]


@pytest.mark.parametrize(
    ("speed", "radius"),
    [
        (10.0, 20.0),  # flown at sqrt(0.5 · 2.5 · 20) = 5 m/s, 1.25 m/s² to the centre
        (4.0, 20.0),  # 0.8 m/s² to the centre
        (10.0, 60.0),  # sqrt(0.5 · 2.5 · 60) = 8.7 m/s
    ],
)
def test_a_circle_leans_for_its_turn_its_speed_and_the_wind_together(
    speed: float, radius: float
) -> None:
    flown = min(speed, math.sqrt(0.5 * 2.5 * radius))
    # Drag per airspeed is 5.66/15 per second: what pushes to the centre counts as so much airspeed.
    across = flown**2 / radius / (LEAN_M_S2 / LIMIT_M_S)
    most_m_s = LIMIT_M_S - math.hypot(flown, across)
    assert circling(most_m_s - 0.01, speed=speed, radius=radius)[1] == []
    assert circling(most_m_s + 0.01, speed=speed, radius=radius)[1] == ["W105"]


def test_a_circle_takes_its_time_in_any_wind() -> None:
    # Its target turns on at its rate: nothing waits for the vehicle.
    calm, windy = circling(0.0), circling(9.5)
    assert windy[1] == ["W105"]
    assert windy[0] == pytest.approx(calm[0], abs=0.1)  # the way to its edge is flown as before


def test_no_circle_is_held_in_a_wind_faster_than_the_vehicle() -> None:
    assert "W101" in circling(15.0)[1]


def test_without_a_circle_or_a_known_limit_nothing_is_said_of_circles() -> None:
    wind = Wind(speed_m_s=12.0, from_deg=90.0)
    circle = stage(StageKind.CIRCLE, 0.0, 0.0, 20.0, turns=2, radius=20.0)
    for stages, limit in (((takeoff(20.0), circle), None), ((takeoff(20.0), go(0.0, 99.0)), 15.0)):
        motion = fly_ardupilot(stages, DEFAULTS, wind=wind, airspeed_limit_m_s=limit)
        assert "W105" not in [f.code for f in motion.findings]
