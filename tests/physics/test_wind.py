"""The wind as a vector and over height."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.physics.wind import Wind


@pytest.mark.parametrize(
    ("from_deg", "east", "north"),
    [(0.0, 0.0, -5.0), (90.0, -5.0, 0.0), (180.0, 0.0, 5.0), (270.0, 5.0, 0.0)],
)
def test_a_wind_blows_away_from_where_it_comes(from_deg: float, east: float, north: float) -> None:
    wind = Wind(speed_m_s=5.0, from_deg=from_deg)
    assert (wind.east_m_s, wind.north_m_s) == pytest.approx((east, north), abs=1e-12)


def test_without_a_profile_the_wind_is_the_same_at_every_height() -> None:
    assert Wind(speed_m_s=5.0).speed_factor([-10.0, 0.0, 500.0]) == pytest.approx([1.0, 1.0, 1.0])


def test_the_power_law_by_pencil() -> None:
    wind = Wind(speed_m_s=5.0, reference_height_m=10.0, shear_exponent=0.2)
    # 32^0.2 = 2; at home there is no wind, and below it the ground lies lower: 10 m, 320 m, 1/32 of 10 m
    heights_m = [10.0, 320.0, 0.0, -10.0, -320.0, -10.0 / 32.0]
    assert wind.speed_factor(heights_m) == pytest.approx([1.0, 2.0, 0.0, 1.0, 1.0, 0.5])


@pytest.mark.parametrize(
    ("below_m", "expected"),
    [
        # as given from 10 m above the lowest ground, wherever that is: (0.3, 0.8)^0.2
        (145.0, [1.0, 1.0, 1.0, 2.0]),
        (10.0, [1.0, 1.0, 0.96875**0.2, 2.0]),
        (3.0, [0.3**0.2, 0.8**0.2, 1.0, 2.0]),
        (0.0, [0.0, 0.5**0.2, 0.5, 2.0]),
    ],
)
def test_over_lower_ground_the_air_does_not_stand_still_at_the_height_of_home(
    below_m: float, expected: list[float]
) -> None:
    wind = Wind(speed_m_s=5.0, reference_height_m=10.0, shear_exponent=0.2, ground_below_m=below_m)
    heights_m = [0.0, 5.0, -10.0 / 32.0, 320.0]
    if 0.0 < below_m < 10.0:
        heights_m[2] = 7.0
    assert wind.speed_factor(heights_m) == pytest.approx(expected)


def test_the_logarithmic_law_by_pencil() -> None:
    wind = Wind(speed_m_s=5.0, reference_height_m=10.0, roughness_length_m=0.1)
    # ln(h / 0.1) / ln(100)
    heights_m = [10.0, 1000.0, 0.1, 0.0, -1.0, -60.0]
    assert wind.speed_factor(heights_m) == pytest.approx([1.0, 2.0, 0.0, 0.0, 0.5, 1.0])


@pytest.mark.parametrize(
    "profile",
    [
        {"reference_height_m": 10.0},
        {"shear_exponent": 0.2},
        {"roughness_length_m": 0.1},
        {"reference_height_m": 10.0, "shear_exponent": 0.2, "roughness_length_m": 0.1},
        {"reference_height_m": 0.0, "shear_exponent": 0.2},
        {"reference_height_m": math.nan, "shear_exponent": 0.2},
        {"reference_height_m": 10.0, "shear_exponent": 2.0},
        {"reference_height_m": 10.0, "roughness_length_m": 10.0},
        {"reference_height_m": 10.0, "roughness_length_m": math.nan},
    ],
)
def test_half_a_profile_or_an_impossible_one_is_refused(profile: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="wind"):
        Wind(speed_m_s=5.0, **profile)


@pytest.mark.parametrize("name", ["speed_m_s", "speed_sd_m_s", "from_sd_deg"])
@pytest.mark.parametrize("value", [-0.1, math.inf, math.nan])
def test_a_wind_or_a_spread_of_it_is_a_number_and_not_negative(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"wind {name} must be zero or more"):
        Wind(**{name: value})
    assert getattr(Wind(**{name: 0.0}), name) == 0.0


@pytest.mark.parametrize("name", ["from_deg", "ground_below_m"])
@pytest.mark.parametrize("value", [math.inf, math.nan])
def test_a_direction_and_the_ground_below_are_numbers(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"wind {name} must be a number"):
        Wind(**{name: value})


def test_the_profile_never_falls_with_height() -> None:
    heights = np.linspace(0.0, 300.0, 100)
    for wind in (
        Wind(reference_height_m=10.0, shear_exponent=0.14),
        Wind(reference_height_m=10.0, roughness_length_m=0.03),
    ):
        assert (np.diff(wind.speed_factor(heights)) >= 0.0).all()
