"""Settings as people write them, as they miswrite them, and as they read back."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.cli.options import option_words
from planner.notation import battery_text, read_battery, read_wind, read_wind_profile, wind_text
from planner.physics.wind import Wind
from planner.quantity import Spread, read_fraction
from planner.setup import settings
from planner.vehicle.battery import Battery


def read(key: str, text: str) -> object:
    """Return a text as a setting reads it."""
    return settings()[key].kind.read(text)


def written(key: str, value: object) -> str:
    """Return a value as a setting writes it."""
    return settings()[key].kind.text(value)


@pytest.mark.parametrize(
    ("text", "energy_wh"),
    [
        ("5.2Ah@14.8V", 76.96),  # 5.2 x 14.8
        ("5200mAh@14.8V", 76.96),
        (" 5.2 ah @ 14.8 v ", 76.96),
        ("77Wh", 77.0),
        ("77 wh", 77.0),
        ("520Ah@14.8V", 7696.0),
        ("5.2Ah@4S", 76.96),  # 4 times 3.7 V
        ("5200 mAh @ 4s", 76.96),
    ],
)
def test_a_battery_is_charge_at_a_voltage_or_energy(text: str, energy_wh: float) -> None:
    assert read_battery(text).energy_wh == pytest.approx(energy_wh, rel=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "5.2Ah",
        "5.2",
        "14.8V",
        "nanWh",
        "infWh",
        "-77Wh",
        "0Wh",
        "1e999Wh",
        "5.2Ah@0S",
        "5.2Ah@4.5S",
        "5Ah@40S",
    ],
)
def test_what_is_no_battery_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="battery"):
        read_battery(text)


@pytest.mark.parametrize("text", ["8,0Ah@22,2V", "5,2Ah@4S", "77,5Wh", "5.2Ah@14,8V"])
def test_a_decimal_comma_is_said_to_be_one(text: str) -> None:
    with pytest.raises(ValueError, match="decimals with a point") as raised:
        read_battery(text)
    assert text.replace(",", ".") in str(raised.value)


def test_a_charge_in_the_wrong_unit_is_not_believed() -> None:
    with pytest.raises(ValueError, match="is it mAh"):
        read_battery("5200Ah@14.8V")


def test_energy_and_payload_in_thousandths_are_refused_not_flown() -> None:
    with pytest.raises(ValueError, match="is it mWh"):
        read_battery("77000Wh")
    with pytest.raises(ValueError, match="is it grams"):
        read("payload_kg", "1500")
    assert read("payload_kg", "250") == 250.0


@pytest.mark.parametrize(
    ("text", "fraction"),
    [
        ("20%", 0.2),
        ("20 %", 0.2),
        ("0.2", 0.2),
        (".2", 0.2),
        ("0", 0.0),
        ("100%", 1.0),
        ("1.0", 1.0),
    ],
)
def test_a_share_is_percent_or_a_fraction(text: str, fraction: float) -> None:
    assert read_fraction(text) == fraction


@pytest.mark.parametrize("text", ["1", "20", "1e999", "1.5"])
def test_a_bare_number_from_one_on_is_ambiguous(text: str) -> None:
    with pytest.raises(ValueError, match=f"ambiguous: write {text}%"):
        read_fraction(text)


@pytest.mark.parametrize("text", ["-1%", "-0.2", "101%", "1e999%"])
def test_a_share_outside_nothing_to_all_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        read_fraction(text)


@pytest.mark.parametrize("text", ["", "nan", "inf%", "half", "20%%", "20 percent"])
def test_what_is_no_share_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"such as 20% or 0\.2"):
        read_fraction(text)


@pytest.mark.parametrize(
    ("text", "speed_m_s", "from_deg"),
    [
        ("5@270", 5.0, 270.0),
        ("5m/s@270", 5.0, 270.0),
        ("5 m/s @ 270°", 5.0, 270.0),
        ("10kt@W", 5.144444444444445, 270.0),  # 18.52 km in 3600 s
        ("18km/h@nnw", 5.0, 337.5),
        ("0", 0.0, 0.0),
    ],
)
def test_a_wind_is_speed_at_direction(text: str, speed_m_s: float, from_deg: float) -> None:
    assert read_wind(text) == Wind(speed_m_s=speed_m_s, from_deg=from_deg)


@pytest.mark.parametrize("text", ["", "5", "5@", "@270", "nan@0", "5@west", "5kx@270"])
def test_what_is_no_wind_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="5@270"):
        read_wind(text)


@pytest.mark.parametrize("text", ["-5@270", "101@0", "5@361", "5@-1", "1e999@0"])
def test_a_wind_out_of_range_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        read_wind(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("power:0.2@10", Wind(shear_exponent=0.2, reference_height_m=10.0)),
        ("power: 0.14 @ 20 m", Wind(shear_exponent=0.14, reference_height_m=20.0)),
        ("log:0.03@10", Wind(roughness_length_m=0.03, reference_height_m=10.0)),
        ("LOG:0.1m@10m", Wind(roughness_length_m=0.1, reference_height_m=10.0)),
    ],
)
def test_a_wind_profile_is_a_law_and_the_height_of_the_wind(text: str, expected: Wind) -> None:
    assert read_wind_profile(text) == expected


@pytest.mark.parametrize("text", ["0.2@10", "power:0.2", "power:2@10", "log:20@10", "log:0@10"])
def test_what_is_no_wind_profile_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected power|must be"):
        read_wind_profile(text)


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("payload_kg", "0.5", 0.5),
        ("payload_kg", "0.5kg", 0.5),
        ("payload_kg", "500g", 0.5),
        ("payload_kg", "2lb", 0.90718474),
        ("speed_m_s", "18km/h", 5.0),
        ("home_amsl_m", "300ft", 91.44),
        ("heading_deg", "SW", 225.0),
        ("temperature_c", "-5C", -5.0),
        ("home_amsl_m", "-12 m", -12.0),
        ("home_amsl_m", "488", 488.0),
        ("temperature_c", "-5", -5.0),
        ("temperature_c", "15°C", 15.0),
        ("temperature_c", "59F", 15.0),
        ("battery_temperature_c", "-40 °f", -40.0),
        ("battery_health", "85%", 0.85),
        ("battery_health", "1.0", 1.0),
        ("battery_resistance_factor", "1.5", 1.5),
        ("battery_temperature_c", "-5C", -5.0),
    ],
)
def test_a_number_may_carry_its_unit(key: str, text: str, value: float) -> None:
    assert read(key, text) == value


@pytest.mark.parametrize(
    ("text", "speed_sd_m_s", "from_sd_deg"),
    [
        ("5±2@270±20", 2.0, 20.0),
        ("5~2@270~20", 2.0, 20.0),  # as the terminal UI shows it in ASCII
        ("5+-2@270+-20", 2.0, 20.0),
        ("5+/-2@270+/-20", 2.0, 20.0),
        ("5 ± 2 m/s @ 270° ± 20°", 2.0, 20.0),
        ("5±2@270", 2.0, 0.0),
        ("5@270±20", 0.0, 20.0),
    ],
)
def test_a_wind_may_not_be_known_exactly(
    text: str, speed_sd_m_s: float, from_sd_deg: float
) -> None:
    assert read_wind(text) == Wind(
        speed_m_s=5.0, from_deg=270.0, speed_sd_m_s=speed_sd_m_s, from_sd_deg=from_sd_deg
    )


@pytest.mark.parametrize("text", ["5±@270", "±2@270", "5±2±1@270", "5±2", "5@270±", "5@1@2"])
def test_half_a_spread_is_no_wind(text: str) -> None:
    with pytest.raises(ValueError, match="5±2@270±20"):
        read_wind(text)


@pytest.mark.parametrize("text", ["5±-2@270", "5±200@270", "5@270±400", "5@270±-1"])
def test_a_spread_of_the_wind_out_of_range_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        read_wind(text)


@pytest.mark.parametrize(
    ("key", "text", "mean", "sd"),
    [
        ("charge", "95±2%", 0.95, 0.02),
        ("charge", "95% ± 2%", 0.95, 0.02),
        ("charge", "0.95+-0.02", 0.95, 0.02),
        ("payload_kg", "0.5±0.1", 0.5, 0.1),
        ("payload_kg", "0.5±0.1kg", 0.5, 0.1),
        ("payload_kg", "500±100g", 0.5, 0.1),
        ("payload_kg", "0.5kg±100g", 0.5, 0.1),
        ("payload_kg", "500g±100", 0.5, 0.1),
        ("temperature_c", "59±9F", 15.0, 5.0),
        ("temperature_c", "59 °F ± 9", 15.0, 5.0),
        ("temperature_c", "59F±5C", 15.0, 5.0),
        ("temperature_c", "-5 ± 3 °C", -5.0, 3.0),
        ("temperature_c", "-5+-3", -5.0, 3.0),
    ],
)
def test_a_number_may_have_a_standard_deviation(
    key: str, text: str, mean: float, sd: float
) -> None:
    assert read(key, text) == Spread(mean=mean, sd=sd)


def test_a_standard_deviation_of_nothing_is_a_plain_number() -> None:
    assert read("payload_kg", "0.5±0") == 0.5


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("charge", "95±2"),
        ("charge", "95±%"),
        ("charge", "0.95±2%"),
        ("charge", "95±-2%"),
        ("charge", "150±2%"),
        ("payload_kg", "0.5±-0.1"),
        ("payload_kg", "0.5±0.1±0.1"),
        ("temperature_c", "±5"),
        ("temperature_c", "15±inf"),
    ],
)
def test_a_wrong_standard_deviation_is_refused(key: str, text: str) -> None:
    with pytest.raises(ValueError, match=r"expected|ambiguous"):
        read(key, text)


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("payload_kg", "-0.1"),
        ("payload_kg", "500st"),
        ("payload_kg", "nan"),
        ("payload_kg", "1e999"),
        ("home_amsl_m", "10000"),
        ("home_amsl_m", "1600fm"),
        ("temperature_c", "200F"),
        ("temperature_c", "100"),
        ("temperature_c", "inf"),
        ("battery_health", "0%"),
        ("battery_resistance_factor", "0.9"),
        ("battery_resistance_factor", "30"),
        ("battery_temperature_c", "80"),
    ],
)
def test_a_number_out_of_range_or_in_another_unit_is_refused(key: str, text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        read(key, text)


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
    value = read(key, text)
    assert read(key, written(key, value)) == value


@given(share=st.floats(0.001, 0.999))
def test_any_share_reads_back_exactly(share: float) -> None:
    assert read("charge", written("charge", share)) == share
    around = Spread(mean=share, sd=0.02)
    assert read("charge", written("charge", around)) == around


@given(speed=st.floats(0.01, 100.0), bearing=st.floats(0.0, 360.0))
def test_any_wind_reads_back_exactly(speed: float, bearing: float) -> None:
    wind = read_wind(f"{speed!r}@{bearing!r}")
    assert read_wind(wind_text(wind)) == wind


def test_a_battery_with_a_curve_has_no_text() -> None:
    with pytest.raises(ValueError, match="no option"):
        battery_text(Battery(capacity_ah=5.0, ocv_soc=(0.0, 1.0), ocv_v=(13.0, 16.8)))


def test_each_of_several_files_gets_its_option() -> None:
    files = (Path("a.tif"), Path("b.tif"))
    words = option_words("terrain", files)
    assert words == ["--terrain", "a.tif", "--terrain", "b.tif"]
