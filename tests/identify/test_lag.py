"""The drag that makes a vehicle lag, from records of flights with a drag that is known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record

from planner.autopilot import Autopilot
from planner.identify.flown_mission import flown_position_noise_m
from planner.identify.lag import identify_drag
from planner.values import replace

if TYPE_CHECKING:
    from planner.logs.record import FlightRecord

STEP_S = 0.1


def flown(
    drag_per_s: float, *, legs: int = 8, wind_m_s: float = 0.0, noise_m_s: float = 0.0
) -> FlightRecord:
    """Return a flight to and fro at 6 m/s, its controller and drag integrated at 100 Hz.

    v' = a − D (v − w), a = a_t + k q + i ∫ q, q = P e + v_t − v; the trajectory's speed changes at 2 m/s²,
    in a time of its own that runs at 1 − |e|/2 m while the vehicle is behind.
    """
    count, part = 1500 * legs, 0.01
    speed = np.tile(np.concatenate((np.full(1500, 6.0), np.full(1500, -6.0))), legs)[:count]
    planned = np.empty(count)
    now = 0.0
    for k in range(count):
        now += float(np.clip(speed[k] - now, -2.0 * part, 2.0 * part))
        planned[k] = now
    place, velocity, built, aim, passed = 0.0, 0.0, drag_per_s * -wind_m_s, 0.0, 0.0
    rows, reference = np.empty((count, 3)), np.empty(count)
    slopes = np.gradient(planned, part)
    for k in range(count):
        at = round(passed)
        reference[k], behind = planned[at], aim - place
        scale = 1.0 - min(abs(behind) / 2.0, 0.9) if behind * reference[k] >= 0.0 else 1.0
        passed = min(passed + scale, count - 1)
        aim += scale * reference[k] * part
        rows[k] = aim, place, velocity
        q = 0.95 * (aim - place) + reference[k] - velocity
        built += 0.4 * q * part
        rate = 1.8 * q + built + slopes[at] - drag_per_s * (velocity - wind_m_s)
        velocity += rate * part
        place += velocity * part
    some = slice(None, None, 10)
    still = np.zeros(count)[some]
    noise = noise_m_s * np.random.default_rng(1).standard_normal(still.size)
    return make_record(
        is_landed=np.zeros(still.size, dtype=np.bool_),
        reference_north_m=rows[some, 0],
        reference_east_m=still,
        reference_velocity_north_m_s=reference[some],
        reference_velocity_east_m_s=still,
        north_m=rows[some, 1],
        east_m=still,
        velocity_north_m_s=rows[some, 2] + noise,
        velocity_east_m_s=still + noise[::-1],
    )


@pytest.mark.parametrize("drag_per_s", [0.15, 0.4, 1.0])
@pytest.mark.parametrize("wind_m_s", [0.0, 4.0])
def test_the_drag_is_found(drag_per_s: float, wind_m_s: float) -> None:
    found = identify_drag([flown(drag_per_s, wind_m_s=wind_m_s, noise_m_s=0.1)])
    assert found is not None
    assert found.value == pytest.approx(drag_per_s, rel=0.06, abs=0.02)
    assert found.error < 0.1 * drag_per_s


def test_logs_that_do_not_tell_leave_it_out() -> None:
    known = flown(0.4, legs=2)
    unknown = np.full(known.time_s.size, np.nan)
    assert identify_drag([replace(known, reference_north_m=unknown)]) is None
    still = np.zeros(known.time_s.size)
    hover = replace(known, velocity_north_m_s=still, reference_velocity_north_m_s=still)
    assert identify_drag([hover]) is None
    assert identify_drag([replace(known, is_landed=np.ones(still.size, dtype=np.bool_))]) is None
    assert identify_drag([flown(0.0, noise_m_s=0.3)]) is None


def test_the_gains_of_the_log_count() -> None:
    other = replace(flown(0.4), parameters={"MPC_XY_VEL_P_ACC": 3.6, "MPC_XY_VEL_I_ACC": 0.8})
    found = identify_drag([other])
    assert found is not None
    assert found.value == pytest.approx(0.8, rel=0.06)  # twice the gain says twice the force


def test_the_noise_is_that_of_hovers_and_not_of_places_overshot() -> None:
    """Normal errors of 0.2 m on either axis are 0.2 √(π/2) m long in the mean."""
    count = 4000
    random, still = np.random.default_rng(3), np.zeros(count)
    east, north = 0.2 * random.standard_normal((2, count))
    east[:200] += 1.5  # coming back to a place, 5 % of the time: the median is 4 % greater
    record = make_record(
        is_landed=np.zeros(count, dtype=np.bool_),
        height_above_home_m=np.full(count, 30.0),
        ground_speed_m_s=still,
        climb_m_s=still,
        reference_north_m=still,
        reference_east_m=still,
        reference_velocity_north_m_s=still,
        reference_velocity_east_m_s=still,
        north_m=north,
        east_m=east,
        velocity_north_m_s=still,
        velocity_east_m_s=still,
    )
    flown = replace(record, autopilot=Autopilot.PX4)
    assert flown_position_noise_m(flown) == pytest.approx(0.2 * np.sqrt(np.pi / 2.0), rel=0.07)
    assert flown_position_noise_m(replace(record, autopilot=Autopilot.ARDUPILOT)) == 0.0


def test_a_load_is_slowed_down_less_by_the_same_drag() -> None:
    record = flown(0.4)
    alone, loaded = identify_drag([record]), identify_drag([record], times_heavier=[1.2])
    assert alone is not None
    assert loaded is not None
    assert loaded.value == pytest.approx(1.2 * alone.value)
