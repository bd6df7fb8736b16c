"""The standard atmosphere against the tables of ISO 2533 (geopotential heights), and a warmer day."""

from __future__ import annotations

import pytest

from planner.physics.atmosphere import air_density_kg_m3, standard_temperature_c


@pytest.mark.parametrize(
    ("altitude_m", "temperature_c", "density_kg_m3"),
    [(0.0, 15.0, 1.2250), (1000.0, 8.5, 1.1116), (5000.0, -17.5, 0.73612), (-500.0, 18.25, 1.2849)],
)
def test_the_standard_day_is_that_of_the_table(
    altitude_m: float, temperature_c: float, density_kg_m3: float
) -> None:
    assert standard_temperature_c(altitude_m) == pytest.approx(temperature_c)
    found = air_density_kg_m3(altitude_m, home_amsl_m=altitude_m, home_temperature_c=temperature_c)
    assert found == pytest.approx(density_kg_m3, rel=1e-4)


def test_it_gets_colder_above_home_and_warmer_below() -> None:
    # at home, 1000 m high, 28.5 °C are 20 K above the standard, and so everywhere else
    found = air_density_kg_m3([0.0, 1000.0, 3000.0], home_amsl_m=1000.0, home_temperature_c=28.5)
    standard_k = [288.15, 281.65, 268.65]
    standard = [1.2250, 1.1116, 0.90913]
    expected = [d * t / (t + 20.0) for d, t in zip(standard, standard_k, strict=True)]
    assert found == pytest.approx(expected, rel=1e-4)


def test_less_pressure_is_less_air_in_proportion() -> None:
    # 1.225 of 990 over 1013.25 hPa: 1.1969
    found = air_density_kg_m3(
        0.0, home_amsl_m=0.0, home_temperature_c=15.0, sea_level_pressure_pa=99_000.0
    )
    assert found == pytest.approx(1.1969, rel=1e-4)
