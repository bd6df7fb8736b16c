"""The drag that makes a vehicle lag, from records of flights with a drag that is known."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record

from planner.autopilot import Autopilot
from planner.identify import assembly
from planner.identify.assembly import IdentificationSettings
from planner.identify.flown_mission import flown_position_noise_m
from planner.identify.identification import identify_vehicle
from planner.identify.lag import identify_drag, times_allow_drag
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


# relative, with 0.386 and 0.227 1/s and without, of simulated vehicles with 0.4 and 0.25 1/s: to and fro, a
# survey, and hovers with short legs
FLOWN_ERRORS = [
    ([-0.018, -0.0132, -0.007], [0.0037, 0.0189, -0.0038]),
    ([-0.0152, -0.0098, -0.0035], [-0.0035, 0.0068, -0.0027]),
]


@pytest.mark.parametrize(("with_it", "without"), FLOWN_ERRORS)
def test_straight_legs_do_not_take_a_drag_back(with_it: list[float], without: list[float]) -> None:
    assert times_allow_drag(with_it, without)
    # one of them alone, and without that one
    assert times_allow_drag(with_it[:1], without[:1])
    assert times_allow_drag(with_it[1:], without[1:])


def test_times_take_a_drag_back_that_makes_them_too_long_by_more_than_any_prediction() -> None:
    # 2 % off alike, -3.9 % is 1.9 % from what was flown and 0 then 2 %; -4.1 % is 2.1 %
    assert times_allow_drag([-0.039], [0.0])
    assert not times_allow_drag([-0.041], [0.0])
    # the other way round a drag that is less than the one known
    assert times_allow_drag([0.039], [0.0])
    assert not times_allow_drag([0.041], [0.0])
    # a flight that takes one time with it and without says nothing, however far off
    assert times_allow_drag([-0.039, -0.07], [0.0, -0.07])
    assert not times_allow_drag([-0.041, 0.07], [0.0, 0.07])
    assert not times_allow_drag([], [])


@pytest.mark.parametrize(
    ("errors", "drag_per_s", "said"),
    [
        ([[-0.018], [0.004]], 0.4, "-1.8 % and +0.4 %"),
        ([[-0.06], [0.004]], None, "-6.0 % and +0.4 %"),
        ([], None, "no flight of a mission"),
    ],
)
def test_a_model_says_why_it_has_a_drag(
    errors: list[list[float]], drag_per_s: float | None, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    still = np.zeros(flown(0.4).time_s.size)
    record = replace(
        flown(0.4),
        autopilot=Autopilot.PX4,
        height_above_home_m=still + 30.0,
        reference_height_m=still + 30.0,
        climb_m_s=still,
    )
    monkeypatch.setattr(assembly, "time_errors", lambda *_: errors)
    settings = IdentificationSettings(name="lagging", date=dt.date(2026, 1, 2), version="1")
    model = identify_vehicle([record], settings).model
    assert model.drag_per_s == (None if drag_per_s is None else pytest.approx(drag_per_s, rel=0.06))
    assert any(
        "drag_per_s is 0." in one
        and said in one
        and one.startswith("left out") is (drag_per_s is None)
        for one in model.provenance.readings
    )
