"""What varies in a sweep, and the cases that makes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner.errors import UsageError
from planner.notation import read_battery
from planner.physics.wind import Wind
from planner.service.sweep.axes import WIND_PARTS, read_axis, varying, varying_names
from planner.service.sweep.cases import case_setup, make_cases
from planner.service.sweep.weather import WeatherFileError, read_weather
from planner.setup import RestVoltage, Setup
from planner.values import field_names
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(
    ("text", "key", "values"),
    [
        ("wind=0:12:3", "wind_m_s", (0.0, 3.0, 6.0, 9.0, 12.0)),
        ("wind=2m/s,0.5", "wind_m_s", (2.0, 0.5)),
        ("wind-from=270,90", "wind_from_deg", (270.0, 90.0)),
        ("wind-from=N,SW", "wind_from_deg", (0.0, 225.0)),
        ("gust=0:0.3:0.1", "gust_m_s", (0.0, 0.1, 0.2, 0.3)),
        ("wind=5@270,8±1@90", "wind", None),
        ("payload=0,0.25kg", "payload_kg", (0.0, 0.25)),
        ("payload_kg=0.5", "payload_kg", (0.5,)),
        ("health=1,0.8", "battery_health", (1.0, 0.8)),
        ("charge=100%:60%:20%", "charge", (1.0, 0.8, 0.6)),
        ("temperature=-10:10:10", "temperature_c", (-10.0, 0.0, 10.0)),
        ("battery=5.2Ah@14.8V,77Wh", "battery", None),
        ("reserve=20%,12Wh", "reserve", None),
        ("vehicle=px4-quad-2kg,dji-matrice-100", "vehicle", ("px4-quad-2kg", "dji-matrice-100")),
        ("mission=a.plan,b.plan", "mission", ("a.plan", "b.plan")),
    ],
)
def test_values_are_read_as_the_option_reads_them(
    text: str, key: str, values: tuple[object, ...] | None
) -> None:
    axis = read_axis(text)
    assert axis.key == key
    assert values is None or axis.values == values
    assert read_axis(axis.text).values == axis.values, "what is written reads back"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("wind", "expected NAME=VALUES"),
        ("wnid=3", "no setting of a check has this name; did you mean wind"),
        ("wind=0:12:5", "steps of 5.0 from 0.0 lead to 10.0, not to 12.0"),
        ("wind=0:12:0", "the step of 0:12:0 is 0"),
        ("wind=0:12", "a range is FROM:TO:STEP, such as 0:12:1, got '0:12'"),
        ("wind=99@", "expected .*, got"),
        ("wind=3,3", "3 is given twice"),
        ("wind=300", "expected 0 to 100 m/s"),
        ("payload=5kg,7x", "expected a number in kg, g, lb, oz, got '7x'"),
        ("wind=normal(5)", r"expected normal\(MEAN,SD\)"),
        ("wind=gauss(5,2)", r"expected normal\(MEAN,SD\), uniform"),
        ("health=1", "is ambiguous"),
        ("charge=90%,,80%", "a value is missing beside a comma"),
        ("ignore=M115", "no setting of a check has this name"),
    ],
)
def test_what_does_not_vary_is_refused_with_a_sentence(text: str, sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        read_axis(text)


def test_every_setting_of_a_check_varies_but_what_is_reported() -> None:
    names = set(varying_names())
    assert {"wind", "wind-from", "gust", "mission", "vehicle", "params", "risk", "speed"} <= names
    assert {"wind_profile", "clearance_m", "autopilot"} <= varying().keys()
    assert not {"select", "ignore", "baseline"} & names


VALUES = {
    "vehicle": "px4-quad-2kg,dji-matrice-100",
    "params": "{params}",
    "terrain": "{terrain}",
    "autopilot": "auto,px4,step",
    "target": "px4-1.16,arducopter-4.7",
    "wind": "5@270,8±1@90",
    "wind_profile": "power:0.2@10m,log:0.03m@10m",
    "home_amsl_m": "0,488m",
    "temperature_c": "15,50F,20±5",
    "pressure_hpa": "990:1010:10",
    "payload_kg": "0.25,500g,0.5±0.1",
    "position_noise_m": "0,1",
    "heading_deg": "N,90",
    "speed_m_s": "5,36km/h,10kn",
    "clearance_m": "5,10",
    "profile": "{profile}",
    "reaction_time_s": "1,2",
    "position_error_m": "0,5",
    "battery": "5.2Ah@14.8V,4S6200,77Wh",
    "battery_health": "100%,80%",
    "battery_resistance_factor": "1,2",
    "battery_temperature_c": "0,68F",
    "charge": "95%,95±2%,16.2V",
    "reserve": "20%,12Wh,3min",
    "risk": "1%,5%",
    "fail_on": "error,warning",
}
"""Of every setting that varies, by its key."""


def test_every_setting_varies_as_its_option_sets_it(tmp_path: Path) -> None:
    import rasterio

    files = {"params": tmp_path / "a.param", "profile": tmp_path / "site.toml"}
    files["params"].write_text("WPNAV_SPEED 500\n", encoding="utf-8")
    files["profile"].write_text("[expect.params]\nWPNAV_SPEED = 500\n", encoding="utf-8")
    files["terrain"] = tmp_path / "ground.tif"
    grid = {"driver": "GTiff", "width": 2, "height": 2, "count": 1, "dtype": "float32"}
    at = rasterio.Affine(0.1, 0.0, 8.0, 0.0, -0.1, 47.1)
    with rasterio.open(files["terrain"], "w", crs="EPSG:4326", transform=at, **grid) as ground:
        ground.write(np.full((2, 2), 400.0, dtype=np.float32), 1)
    given = {"vehicle": "px4-quad-2kg", "battery": Battery(capacity_ah=5.2, nominal_voltage_v=14.8)}
    base = Setup.of(given)
    for key, setting in varying().items():
        if setting.field != key and setting.key in {part.key for part in WIND_PARTS.values()}:
            continue
        if key == "mission":
            continue
        axis = read_axis(f"{key}={VALUES[key].format(**files)}")
        assert axis.key == key
        for value in axis.values:
            loaded = setting.loaded(value)
            varied = case_setup(base, {key: loaded})
            expected = Setup.of({**given, key: value})
            for name in field_names(Setup):
                is_new = name in {"terrain", "profile", "parameters"}  # read anew, and not compared
                own, other = getattr(varied, name), getattr(expected, name)
                assert (own is None) == (other is None) if is_new else own == other, (key, name)


def test_only_numbers_are_numbers_in_a_table() -> None:
    severities, speeds = read_axis("fail-on=error,warning"), read_axis("speed=5,36km/h")
    assert [severities.cell(value) for value in severities.values] == ["error", "warning"]
    assert [speeds.cell(value) for value in speeds.values] == [5.0, 10.0]


def test_a_voltage_is_the_charge_of_the_battery_it_is_measured_at() -> None:
    given = {"vehicle": "px4-quad-2kg", "battery": read_battery("5Ah@4S")}
    base = Setup.of({**given, "charge": RestVoltage(voltage_v=15.4)})
    other = read_battery("9Ah@4S")
    varied = case_setup(base, {"battery": other})
    assert varied == Setup.of({**given, "battery": other, "charge": RestVoltage(voltage_v=15.4)})
    full = case_setup(base, {"charge": 1.0})
    assert (full.charge, full.rest_voltage_v) == (1.0, None)


def test_a_calm_has_one_direction() -> None:
    """5 winds x 8 directions x 3 x 3 x 2 = 720; of 40 winds 8 are calm, so 33 x 18 = 594 differ."""
    cases = make_cases(
        [
            read_axis("health=1,0.8"),
            read_axis("wind=0:12:3"),
            read_axis("payload=0,0.25,0.5"),
            read_axis("wind-from=0:315:45"),
            read_axis("temperature=-5,15,30"),
        ]
    )
    assert (cases.combination_count, len(cases)) == (720, 594)
    every = {tuple(cases.values(number).items()) for number in range(594)}
    assert len(every) == 594
    calm = [one for one in every if dict(one)["wind_m_s"] == 0.0]
    assert len(calm) == 18
    assert all(dict(one)["wind_from_deg"] is None for one in calm)


def test_what_changes_a_flight_most_changes_slowest() -> None:
    texts = ["charge=0.9,0.8", "wind=1,2", "mission=a,b", "reserve=20%,30%", "speed=4,5"]
    keys = [axis.key for axis in make_cases([read_axis(text) for text in texts]).axes]
    assert keys == ["mission", "speed_m_s", "wind_m_s", "charge", "reserve"]


def test_draws_are_those_of_their_axis() -> None:
    wind, load = read_axis("wind=weibull(2,5)"), read_axis("payload=uniform(0,0.5)")
    both = make_cases([load, wind], draws=400)
    alone = make_cases([wind], draws=400)
    drawn = [both.values(n)["wind_m_s"] for n in range(400)]
    assert drawn == [alone.values(n)["wind_m_s"] for n in range(400)]
    # The mean of Weibull's law of shape 2 is the scale times √π / 2, its deviation 0.463 of the scale.
    assert np.mean(drawn) == pytest.approx(5.0 * np.sqrt(np.pi) / 2.0, abs=4 * 0.463 * 5 / 20)
    assert make_cases([wind], draws=40).values(39)["wind_m_s"] == drawn[39]


def test_draws_stay_inside_what_the_setting_allows() -> None:
    cases = make_cases([read_axis("charge=normal(95%,5%)")], draws=300)
    assert all(0.0 <= cases.values(number)["charge"] <= 1.0 for number in range(300))
    with pytest.raises(UsageError, match="less than 1 % of it is 0 to 100 m/s"):
        make_cases([read_axis("wind=normal(300,1)")], draws=3)


@pytest.mark.parametrize(
    ("texts", "draws", "sentence"),
    [
        ([], None, "nothing varies"),
        (["wind=normal(5,1)"], None, "say how often with --draws"),
        (["wind=1,2"], 5, "--draws needs something to draw"),
        (["wind=1,2", "wind_m_s=3"], None, "varies what --vary wind varies already"),
        (["wind=1@90", "wind-from=3"], None, "varies what --vary wind varies already"),
    ],
)
def test_axes_that_do_not_go_together_are_refused(
    texts: list[str], draws: int | None, sentence: str
) -> None:
    with pytest.raises(UsageError, match=sentence):
        make_cases([read_axis(text) for text in texts], draws=draws)


def test_a_case_changes_only_what_varies() -> None:
    base = Setup.of({"vehicle": "px4-quad-2kg", "wind": Wind(speed_m_s=4.0, from_deg=90.0)})
    varied = case_setup(base, {"wind_from_deg": 180.0, "gust_m_s": 10.0, "payload_kg": 0.3})
    assert varied.wind == Wind(speed_m_s=4.0, from_deg=180.0, speed_sd_m_s=3.0)
    assert varied.payload_kg == 0.3
    assert case_setup(base, {"gust_m_s": 2.0}).wind.speed_sd_m_s == 0.0, (
        "less than the mean is none"
    )
    assert case_setup(base, {}) == base


WEATHER = """\
time,wind_speed (km/h),wind_direction (°),gust [kn],temperature (°C),pressure_msl (inHg),station (hPa)
2025-01-01T00:00,36,270,40,-3,30,930
2025-01-01T01:00,0,120,0,50,29,930
2025-01-01T02:00,0,200,0,50,29,931
2025-01-01T03:00,18,,10,4,30,931
"""


def test_weather_is_read_in_its_units(tmp_path: Path) -> None:
    (tmp_path / "year.csv").write_text(WEATHER, encoding="utf-8")
    weather = read_weather(tmp_path / "year.csv")
    assert weather.keys == (
        "wind_m_s",
        "wind_from_deg",
        "gust_m_s",
        "temperature_c",
        "pressure_hpa",
    )
    assert weather.unused == ("station (hPa)",), "of a station at some altitude"
    # 36 km/h are 10 m/s, 40 kn of 1852 m an hour 20.577..., 30 inHg 1015.9 hPa
    assert weather.rows[0] == pytest.approx((10.0, 270.0, 40 * 1852 / 3600, -3.0, 1015.917))
    cases = make_cases([], weather=weather)
    assert len(cases) == 2, "two calms are one condition, an hour without direction is none"
    assert cases.blocks[0].times == (
        ("2025-01-01T00:00",),
        ("2025-01-01T01:00", "2025-01-01T02:00"),
    )
    assert cases.unchecked_times == ("2025-01-01T03:00",)
    assert cases.row_count == 4


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "holds no weather"),
        ("time,temperature [C]\n1,2\n", "holds no wind"),
        ("time,wind_speed\n1,2\n", "'wind_speed': name its unit in brackets: m/s"),
        ("time,wind [m/s]\n1,x\n", r"year.csv:2:1: wind \[m/s\]: expected a number, got 'x'"),
        ("time,wind [m/s]\n1,400\n", "expected 0 to 100 m/s, got '400'"),
        ("time,wind [m/s],wind_m_s\n1,4,4\n", "two columns give wind_m_s"),
        ("time,wind [m/s]\n1,4,270\n", "year.csv:2:1: 3 fields under 2 heads"),
        ("time,wind [m/s],wind to direction [deg]\n1,4,400\n", "got '400'"),
    ],
)
def test_weather_that_cannot_be_read_is_refused(tmp_path: Path, text: str, sentence: str) -> None:
    (tmp_path / "year.csv").write_text(text, encoding="utf-8")
    with pytest.raises(WeatherFileError, match=sentence):
        read_weather(tmp_path / "year.csv")


@pytest.mark.parametrize(
    ("head", "from_deg"),
    [
        ("wind direction [deg]", 90.0),
        ("wind from [deg]", 90.0),
        ("wind_from_direction_deg", 90.0),
        ("wind to direction [deg]", 270.0),  # the name of CF conventions: wind_to_direction
        ("wind_to_direction_deg", 270.0),
        ("blowing towards [deg]", 270.0),
    ],
)
def test_a_direction_the_wind_blows_to_is_turned_round(
    tmp_path: Path, head: str, from_deg: float
) -> None:
    path = tmp_path / "year.csv"
    path.write_text(f"time,wind [m/s],{head},\n1,4,90,\n", encoding="utf-8")
    weather = read_weather(path)
    assert dict(zip(weather.keys, weather.rows[0], strict=True))["wind_from_deg"] == from_deg
