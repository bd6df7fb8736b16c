"""The wind of flights that none was logged in, by the lean of legs made from the law of drag."""

from __future__ import annotations

import math
import weakref
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record

from planner.identify.lean import LEANT_WIND, level_parts
from planner.identify.leant_wind import leant_wind_readings, with_leant_wind
from planner.logs.record import LoggedQuantity
from planner.values import replace

if TYPE_CHECKING:
    from planner.logs.record import FlightRecord

SPAN = 200
"""Samples of each leg: 20 s."""
SQUARE = ((8.0, 0.0), (0.0, 8.0), (-8.0, 0.0), (0.0, -8.0))


def flight(
    *legs: tuple[float, float],
    wind: tuple[float, float],
    exponent: float = 1.4,
    yaw_deg: float = 0.0,
) -> FlightRecord:
    """Return level legs with velocities to the north and to the east, leaning 30° at 10 m/s of airspeed.

    ``wind`` is where it blows to.
    """
    yaw = math.radians(yaw_deg)
    rows = []
    for north, east in legs:
        through = (north - wind[0], east - wind[1])
        airspeed = math.hypot(*through)
        drag = math.tan(math.radians(30.0)) * (airspeed / 10.0) ** exponent
        # rotated by the heading into the frame of the body: ahead, right
        ahead = drag * (through[0] * math.cos(yaw) + through[1] * math.sin(yaw)) / airspeed
        right = drag * (through[1] * math.cos(yaw) - through[0] * math.sin(yaw)) / airspeed
        pitch = -math.atan(ahead)
        rows.append(
            (north, east, math.degrees(math.atan(right * math.cos(pitch))), math.degrees(pitch))
        )
    north_m_s, east_m_s, roll, pitch_deg = np.repeat(np.array(rows), SPAN, axis=0).T
    zero = np.zeros(north_m_s.size)
    return make_record(
        is_landed=np.zeros(zero.size, np.bool_),
        ground_speed_m_s=np.hypot(north_m_s, east_m_s),
        velocity_north_m_s=north_m_s,
        velocity_east_m_s=east_m_s,
        climb_m_s=zero,
        height_above_home_m=zero + 50.0,
        roll_deg=roll,
        pitch_deg=pitch_deg,
        yaw_deg=zero + yaw_deg,
    )


def blown(record: FlightRecord) -> tuple[float, float]:
    found = with_leant_wind(record)
    return float(found.wind_north_m_s[0]), float(found.wind_east_m_s[0])


@pytest.mark.parametrize("yaw_deg", [0.0, 120.0])
@pytest.mark.parametrize("exponent", [1.0, 1.4, 2.0])
@pytest.mark.parametrize("legs", [SQUARE, SQUARE[::2]])
def test_the_lean_of_legs_tells_the_wind(
    legs: tuple[tuple[float, float], ...], exponent: float, yaw_deg: float
) -> None:
    # two legs alone do not tell the exponent: with 1.5, drags of 11 and 5 m/s are those in 2.06 m/s
    off_m_s = 0.2 if len(legs) == 4 or exponent == 1.4 else 1.0
    record = flight(*legs, wind=(3.0, -1.5), exponent=exponent, yaw_deg=yaw_deg)
    assert blown(record) == pytest.approx((3.0, -1.5), abs=off_m_s)


def test_airspeeds_are_those_in_the_wind_that_the_lean_tells() -> None:
    found = with_leant_wind(flight(*SQUARE, wind=(3.0, 0.0)))
    against, with_it = found.airspeed_m_s[2 * SPAN + 100], found.airspeed_m_s[100]
    assert (against, with_it) == pytest.approx((11.0, 5.0), abs=0.2)
    assert found.wind_north_m_s.shape == found.airspeed_m_s.shape


@pytest.mark.parametrize(
    ("legs", "wind"),
    [
        (SQUARE, (0.0, 0.0)),
        (SQUARE, (0.9, 0.0)),  # of trims as well
        (SQUARE[:1], (4.0, 0.0)),
        (((8.0, 0.0), (6.0, 0.0)), (4.0, 0.0)),  # one direction: more drag, or wind
    ],
)
def test_what_the_lean_does_not_show_stays_unknown(
    legs: tuple[tuple[float, float], ...], wind: tuple[float, float]
) -> None:
    record = flight(*legs, wind=wind)
    assert with_leant_wind(record) is record


def test_a_wind_or_an_airspeed_of_the_log_is_kept() -> None:
    record = flight(*SQUARE, wind=(3.0, 0.0))
    for name in ("airspeed_m_s", "wind_north_m_s"):
        logged = replace(record, **{name: np.full(record.time_s.size, 1.0)})
        assert with_leant_wind(logged) is logged


def test_without_a_heading_there_is_no_wind() -> None:
    record = flight(*SQUARE, wind=(3.0, 0.0))
    record = replace(record, yaw_deg=np.full(record.time_s.size, np.nan))
    assert with_leant_wind(record) is record


def test_a_record_is_asked_once_and_let_go(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[FlightRecord] = []

    def counted(record: FlightRecord) -> list[slice]:
        asked.append(record)
        return level_parts(record)

    monkeypatch.setattr("planner.identify.leant_wind.level_parts", counted)
    calm, windy = flight(*SQUARE, wind=(0.0, 0.0)), flight(*SQUARE, wind=(3.0, 0.0))
    for _ in range(2):
        assert with_leant_wind(calm) is calm
        assert blown(windy) == pytest.approx((3.0, 0.0), abs=0.2)
    assert asked == [calm, windy]
    asked.clear()
    gone = weakref.ref(calm)
    del calm
    assert gone() is None


def test_where_the_wind_comes_from_is_told() -> None:
    row = LoggedQuantity(
        name="wind_north_m_s", found_in=None, rate_hz=None, coverage=0.0, absence_cost="calm"
    )
    record = replace(flight(*SQUARE, wind=(0.0, 4.0)), quantities=(row,))
    assert leant_wind_readings([record]) == []
    found = with_leant_wind(record)
    assert found.quantity("wind_north_m_s").found_in == LEANT_WIND
    (reading,) = leant_wind_readings([found])
    assert reading.startswith(
        "made: no wind in the log: 4.0 m/s from 270° by how the vehicle leans"
    )


def test_of_two_heights_with_as_many_legs_the_wind_is_that_of_the_higher() -> None:
    # ArduCopter's simulator, 6 m/s at 60 m: two legs at 20 m and two at 50 m showed no wind between them
    record = flight((5.0, 0.0), (-5.0, 0.0), (8.0, 0.0), (-8.0, 0.0), wind=(4.0, 0.0))
    height_m = np.repeat([20.0, 20.0, 50.0, 50.0], SPAN)
    found = with_leant_wind(replace(record, height_above_home_m=height_m))
    assert np.isnan(found.wind_north_m_s[height_m < 30.0]).all()
    assert found.wind_north_m_s[height_m > 30.0] == pytest.approx(4.0, abs=0.3)


def test_the_wind_is_that_of_the_height_most_legs_are_flown_at() -> None:
    # four legs at 50 m in 4 m/s, one at 90 m: there nobody knows it, nor an airspeed
    record = flight(*SQUARE, (8.0, 0.0), wind=(4.0, 0.0))
    height_m = np.repeat([50.0, 50.0, 50.0, 50.0, 90.0], SPAN)
    found = with_leant_wind(replace(record, height_above_home_m=height_m))
    high = height_m > 60.0
    assert np.isnan(found.wind_north_m_s[high]).all()
    assert found.wind_north_m_s[~high] == pytest.approx(4.0, abs=0.2)
    assert np.isnan(found.airspeed_m_s[high]).all()
    # what hovers there does so in calm
    slow = replace(record, ground_speed_m_s=np.where(high, 0.1, record.ground_speed_m_s))
    hovering = with_leant_wind(replace(slow, height_above_home_m=height_m))
    assert hovering.airspeed_m_s[high] == pytest.approx(0.1)
