"""What is written for a value is read back as that value."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.cli.setting_text import option_arguments, setting_text
from planner.cli.settings import SETTINGS
from planner.vehicle.battery import Battery


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("battery", "5.2Ah@14.8V"),
        ("battery", "77Wh"),
        ("wind", "5@270"),
        ("wind", "5±2@270±20"),
        ("wind_profile", "power:0.2@10"),
        ("wind_profile", "log:0.03@10"),
        ("charge", "95%"),
        ("charge", "100%"),
        ("charge", "95±2%"),
        ("reserve", "20%"),
        ("reserve", "12Wh"),
        ("reserve", "3.5min"),
        ("payload_kg", "0.5"),
        ("payload_kg", "0.5±0.1"),
        ("temperature_c", "-5"),
        ("home_amsl_m", "488.25"),
        ("battery_health", "85%"),
        ("risk", "12.5%"),
        ("autopilot", "px4"),
        ("target", "px4-1.16"),
        ("fail_on", "warning"),
        ("vehicle", "models/own.toml"),
        ("params", "vehicle.param"),
        ("select", "E101,F"),
    ],
)
def test_a_value_is_written_so_that_it_reads_back(key: str, text: str) -> None:
    value = SETTINGS[key].read(text)
    assert SETTINGS[key].read(setting_text(key, value)) == value


@given(share=st.floats(0.001, 0.999))
def test_any_share_reads_back_exactly(share: float) -> None:
    assert SETTINGS["charge"].read(setting_text("charge", share)) == share


@given(speed=st.floats(0.01, 100.0), bearing=st.floats(0.0, 360.0))
def test_any_wind_reads_back_exactly(speed: float, bearing: float) -> None:
    wind = SETTINGS["wind"].read(f"{speed!r}@{bearing!r}")
    assert SETTINGS["wind"].read(setting_text("wind", wind)) == wind


def test_a_battery_with_a_curve_has_no_text() -> None:
    with pytest.raises(ValueError, match="no option"):
        setting_text("battery", Battery(capacity_ah=5.0, ocv_soc=(0.0, 1.0), ocv_v=(13.0, 16.8)))


def test_each_of_several_files_gets_its_option() -> None:
    files = (Path("a.tif"), Path("b.tif"))
    words = option_arguments("--terrain", "terrain", files)
    assert words == ["--terrain", "a.tif", "--terrain", "b.tif"]
