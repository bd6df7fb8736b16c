"""Quantities as people write them, and as they miswrite them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from planner.cli import quantities
from planner.flight.conditions import Spread
from planner.physics.wind import Wind

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.mark.parametrize(
    ("text", "energy_wh"),
    [
        ("5.2Ah@14.8V", 76.96),  # 5.2 x 14.8
        ("5200mAh@14.8V", 76.96),
        (" 5.2 ah @ 14.8 v ", 76.96),
        ("77Wh", 77.0),
        ("77 wh", 77.0),
        ("520Ah@14.8V", 7696.0),
    ],
)
def test_a_battery_is_charge_at_a_voltage_or_energy(text: str, energy_wh: float) -> None:
    assert quantities.battery(text).energy_wh == pytest.approx(energy_wh, rel=1e-12)


@pytest.mark.parametrize(
    "text",
    ["", "5.2Ah", "5.2", "14.8V", "nanWh", "infWh", "-77Wh", "0Wh", "1e999Wh", "5,2Ah@14.8V"],
)
def test_what_is_no_battery_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="battery"):
        quantities.battery(text)


def test_a_charge_in_the_wrong_unit_is_not_believed() -> None:
    with pytest.raises(ValueError, match="is it mAh"):
        quantities.battery("5200Ah@14.8V")


def test_energy_and_payload_in_thousandths_are_refused_not_flown() -> None:
    with pytest.raises(ValueError, match="is it mWh"):
        quantities.battery("77000Wh")
    with pytest.raises(ValueError, match="is it grams"):
        quantities.payload_kg("1500")
    assert quantities.payload_kg("250") == 250.0


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
    assert quantities.fraction(text) == fraction


@pytest.mark.parametrize("text", ["1", "20", "1e999", "1.5"])
def test_a_bare_number_from_one_on_is_ambiguous(text: str) -> None:
    with pytest.raises(ValueError, match=f"ambiguous: write {text}%"):
        quantities.fraction(text)


@pytest.mark.parametrize("text", ["-1%", "-0.2", "101%", "1e999%"])
def test_a_share_outside_nothing_to_all_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="out of range"):
        quantities.fraction(text)


@pytest.mark.parametrize("text", ["", "nan", "inf%", "half", "20%%", "20 percent"])
def test_what_is_no_share_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"write 20% or 0\.2"):
        quantities.fraction(text)


@pytest.mark.parametrize(
    ("text", "speed_m_s", "from_deg"),
    [
        ("5@270", 5.0, 270.0),
        ("5m/s@270", 5.0, 270.0),
        ("5 m/s @ 270°", 5.0, 270.0),
        ("0", 0.0, 0.0),
    ],
)
def test_a_wind_is_speed_at_direction(text: str, speed_m_s: float, from_deg: float) -> None:
    assert quantities.wind(text) == Wind(speed_m_s=speed_m_s, from_deg=from_deg)


@pytest.mark.parametrize("text", ["", "5", "5@", "@270", "nan@0", "5@west", "5kn@270"])
def test_what_is_no_wind_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="5@270"):
        quantities.wind(text)


@pytest.mark.parametrize("text", ["-5@270", "101@0", "5@361", "5@-1", "1e999@0"])
def test_a_wind_out_of_range_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="out of range"):
        quantities.wind(text)


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
    assert quantities.wind_profile(text) == expected


@pytest.mark.parametrize("text", ["0.2@10", "power:0.2", "power:2@10", "log:20@10", "log:0@10"])
def test_what_is_no_wind_profile_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"no wind profile|must be"):
        quantities.wind_profile(text)


@pytest.mark.parametrize(
    ("reader", "text", "value"),
    [
        (quantities.payload_kg, "0.5", 0.5),
        (quantities.payload_kg, "0.5kg", 0.5),
        (quantities.home_amsl_m, "-12 m", -12.0),
        (quantities.home_amsl_m, "488", 488.0),
        (quantities.temperature_c, "-5", -5.0),
        (quantities.temperature_c, "15°C", 15.0),
        (quantities.battery_health, "85%", 0.85),
        (quantities.battery_health, "1.0", 1.0),
        (quantities.battery_resistance_factor, "1.5", 1.5),
        (quantities.battery_temperature_c, "-5C", -5.0),
    ],
)
def test_a_number_may_carry_its_unit(
    reader: Callable[[str], object], text: str, value: float
) -> None:
    assert reader(text) == value


@pytest.mark.parametrize(
    ("text", "speed_sd_m_s", "from_sd_deg"),
    [
        ("5±2@270±20", 2.0, 20.0),
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
    assert quantities.wind(text) == Wind(
        speed_m_s=5.0, from_deg=270.0, speed_sd_m_s=speed_sd_m_s, from_sd_deg=from_sd_deg
    )


@pytest.mark.parametrize("text", ["5±@270", "±2@270", "5±2±1@270", "5±2", "5@270±", "5@1@2"])
def test_half_a_spread_is_no_wind(text: str) -> None:
    with pytest.raises(ValueError, match="5±2@270±20"):
        quantities.wind(text)


@pytest.mark.parametrize("text", ["5±-2@270", "5±200@270", "5@270±400", "5@270±-1"])
def test_a_spread_of_the_wind_out_of_range_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="out of range"):
        quantities.wind(text)


@pytest.mark.parametrize(
    ("reader", "text", "mean", "sd"),
    [
        (quantities.charge, "95±2%", 0.95, 0.02),
        (quantities.charge, "95% ± 2%", 0.95, 0.02),
        (quantities.charge, "0.95+-0.02", 0.95, 0.02),
        (quantities.payload_kg, "0.5±0.1", 0.5, 0.1),
        (quantities.payload_kg, "0.5±0.1kg", 0.5, 0.1),
        (quantities.temperature_c, "-5 ± 3 °C", -5.0, 3.0),
        (quantities.temperature_c, "-5+-3", -5.0, 3.0),
    ],
)
def test_a_number_may_have_a_standard_deviation(
    reader: Callable[[str], float | Spread], text: str, mean: float, sd: float
) -> None:
    assert reader(text) == Spread(mean=mean, sd=sd)


def test_a_standard_deviation_of_nothing_is_a_plain_number() -> None:
    assert quantities.payload_kg("0.5±0") == 0.5


@pytest.mark.parametrize(
    ("reader", "text"),
    [
        (quantities.charge, "95±2"),
        (quantities.charge, "95±%"),
        (quantities.charge, "95±-2%"),
        (quantities.charge, "150±2%"),
        (quantities.payload_kg, "0.5±-0.1"),
        (quantities.payload_kg, "0.5±0.1±0.1"),
        (quantities.temperature_c, "±5"),
        (quantities.temperature_c, "15±inf"),
    ],
)
def test_a_wrong_standard_deviation_is_refused(reader: Callable[[str], object], text: str) -> None:
    with pytest.raises(ValueError, match=r"±|must be|ambiguous|out of range|no number|no share"):
        reader(text)


@pytest.mark.parametrize(
    ("reader", "text"),
    [
        (quantities.payload_kg, "-0.1"),
        (quantities.payload_kg, "500g"),
        (quantities.payload_kg, "nan"),
        (quantities.payload_kg, "1e999"),
        (quantities.home_amsl_m, "10000"),
        (quantities.home_amsl_m, "1600ft"),
        (quantities.temperature_c, "90F"),
        (quantities.temperature_c, "100"),
        (quantities.temperature_c, "inf"),
        (quantities.battery_health, "0%"),
        (quantities.battery_resistance_factor, "0.9"),
        (quantities.battery_resistance_factor, "30"),
        (quantities.battery_temperature_c, "80"),
    ],
)
def test_a_number_out_of_range_or_in_another_unit_is_refused(
    reader: Callable[[str], object], text: str
) -> None:
    with pytest.raises(ValueError, match=r"must be|is no number"):
        reader(text)
