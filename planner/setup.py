"""The setup of a check: everything a user can set besides the mission, each setting declared once.

Beside each field of `Setup` stands its declaration: how it is written and read, its range, its option,
its key, its help and its place in the reports.  To add a setting is to add a field.
"""

import math
import re
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Self

from planner import quantity
from planner.autopilot import TARGETS, Autopilot
from planner.findings import Severity
from planner.physics.wind import Wind
from planner.quantity import NUMBER, PLUS_MINUS, Spread, exact, mean_of, sd_of
from planner.selection import Selection
from planner.setting import (
    Choice,
    Codes,
    CodesByFile,
    Declared,
    File,
    Files,
    Form,
    Fraction,
    Group,
    Kind,
    NameOrFile,
    Number,
    Row,
    Setting,
    SettingValue,
    Switch,
    declared,
    is_finite_number,
)
from planner.units import JOULES_PER_WATT_HOUR, MILLIAMPERE_HOURS_PER_AMPERE_HOUR
from planner.values import Value, replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import DEFAULT_MODEL

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    Shown = Callable[[float | None], str]

    from planner.autopilot import Target
    from planner.geo.terrain import TerrainGrid
    from planner.site_profile import SiteProfile
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.files import ParameterSet

FORMATS = ("text", "json", "json-lines", "sarif", "junit", "github", "gitlab")
"""Formats of a report."""
MOST_NOISE_M = 1.5
"""PX4 stands still at an error of MPC_XY_ERR_MAX, 2 m by default; this is short of it. [m]"""
_FASTEST_M_S = 100.0
"""No multicopter is faster, and in no such wind does one fly."""
_MOST_CHARGE_AH = 1000.0
"""No multicopter carries more; whoever writes 5200Ah means mAh, and would get a GO."""
_MOST_ENERGY_WH = 50_000.0
"""No multicopter carries more, those with a pilot in them included."""
_LATEST_START_S = 86_400.0


class Reserve(Value):
    """What is to stay in a battery at landing; one of the three is given."""

    fraction: float | None = None
    """Of the capacity. [-]"""
    energy_wh: float | None = None
    hover_s: float | None = None
    """Time of hover over home. [s]"""

    def __post_init__(self) -> None:
        given = [one for one in (self.fraction, self.energy_wh, self.hover_s) if one is not None]
        if len(given) != 1 or not (math.isfinite(given[0]) and given[0] >= 0.0):
            msg = "a reserve is one of fraction, energy_wh or hover_s, zero or more"
            raise ValueError(msg)
        if self.fraction is not None and self.fraction > 1.0:
            msg = f"a reserve must be a fraction from 0 to 1, got {self.fraction}"
            raise ValueError(msg)

    def wh(self, *, capacity_wh: float, hover_power_w: float) -> float:
        """Return the energy that is to stay.

        Parameters
        ----------
        capacity_wh : float
            Energy of the full battery. [Wh]
        hover_power_w : float
            Power of the hover its time counts in. [W]
        """
        if self.fraction is not None:
            return self.fraction * capacity_wh
        if self.energy_wh is not None:
            return self.energy_wh
        return (self.hover_s or 0.0) * hover_power_w / JOULES_PER_WATT_HOUR

    def __str__(self) -> str:
        """Return for example ``20 %``, ``12.0 Wh``, ``3 min 00 s of hover``."""
        if self.fraction is not None:
            return quantity.percent(self.fraction)
        if self.energy_wh is not None:
            return quantity.energy(self.energy_wh)
        return f"{quantity.duration(self.hover_s)} of hover"


# Values with a form of their own: each is read and written by the two functions that stand together.


def _matched(pattern: str, text: str) -> re.Match[str] | None:
    return re.fullmatch(pattern, text.strip(), re.IGNORECASE)


def read_battery(text: str) -> Battery:
    """Return the battery of ``5.2Ah@14.8V``, ``5200mAh@14.8V`` or ``77Wh``."""
    if found := _matched(rf"{NUMBER}\s*(m?)Ah\s*@\s*{NUMBER}\s*V", text):
        charge_ah, voltage_v = float(found[1]), float(found[3])
        if found[2]:
            charge_ah /= MILLIAMPERE_HOURS_PER_AMPERE_HOUR
        if charge_ah > _MOST_CHARGE_AH:
            msg = f"expected a battery of at most {_MOST_CHARGE_AH:g} Ah, got {text!r}: is it mAh?"
            raise ValueError(msg)
        if charge_ah > 0.0 and 0.0 < voltage_v < math.inf:
            return Battery(capacity_ah=charge_ah, nominal_voltage_v=voltage_v)
    if found := _matched(rf"{NUMBER}\s*Wh", text):
        energy_wh = float(found[1])
        if energy_wh > _MOST_ENERGY_WH:
            msg = f"expected a battery of at most {_MOST_ENERGY_WH:g} Wh, got {text!r}: is it mWh?"
            raise ValueError(msg)
        if energy_wh > 0.0:
            return Battery(capacity_wh=energy_wh)
    msg = f"expected a battery, such as 5.2Ah@14.8V or 77Wh, got {text!r}"
    raise ValueError(msg)


def battery_text(battery: Battery) -> str:
    """Return ``5.2Ah@14.8V`` or ``77Wh``; raise ``ValueError`` for a battery that says more."""
    if battery.capacity_wh is not None:
        return f"{exact(battery.capacity_wh)}Wh"
    if battery.capacity_ah is None or battery.nominal_voltage_v is None:
        msg = "battery: no option describes this battery"
        raise ValueError(msg)
    return f"{exact(battery.capacity_ah)}Ah@{exact(battery.nominal_voltage_v)}V"


class _ReserveKind(Fraction):
    """A fraction of the capacity, an energy or minutes of hover: ``20%``, ``12Wh``, ``3min``."""

    def read(self, text: str) -> SettingValue:
        """Return the reserve; a number is a fraction."""
        if not (found := _matched(rf"{NUMBER}\s*(Wh|min)", text)):
            try:
                return super().read(text)
            except ValueError as error:
                if _matched(rf"{NUMBER}\s*%?", text):
                    raise
                msg = f"expected 20% of the capacity, 12Wh of energy or 3min of hover, got {text!r}"
                raise ValueError(msg) from error
        given = float(found[1])
        if not 0.0 <= given < math.inf:
            msg = f"expected a reserve of zero or more, got {text!r}"
            raise ValueError(msg)
        is_energy = found[2].lower() == "wh"
        return Reserve(energy_wh=given) if is_energy else Reserve(hover_s=60.0 * given)

    def text(self, value: SettingValue) -> str:
        """Return what reads back as a reserve."""
        if not isinstance(value, Reserve):
            return super().text(value)
        if value.energy_wh is not None:
            return f"{exact(value.energy_wh)}Wh"
        if value.hover_s is not None:
            return f"{exact(value.hover_s / 60.0)}min"
        return super().text(value.fraction or 0.0)


def read_wind(text: str) -> Wind:
    """Return the wind of ``5@270``, 5 m/s from west, or with standard deviations ``5±2@270±20``."""
    if _matched(NUMBER, text) and float(text) == 0.0:
        return Wind()
    sides = text.split("@")
    units = (r"(?:m/s)?", "°?")
    found = [
        [_matched(rf"{NUMBER}\s*{unit}", one) for one in PLUS_MINUS.split(side)]
        for side, unit in zip(sides, units, strict=False)
    ]
    values = [[float(one[1]) for one in side if one] for side in found]
    if len(sides) != 2 or any(None in side or len(side) > 2 for side in found):
        msg = (
            "expected speed in m/s and the direction it blows from, such as 5@270 or 5±2@270±20, "
            f"got {text!r}"
        )
        raise ValueError(msg)
    for side, high, words in zip(
        values,
        (_FASTEST_M_S, 360.0),
        ("a wind of 0 to 100 m/s", "a wind from 0 to 360°"),
        strict=True,
    ):
        if not all(0.0 <= value <= high for value in side):
            msg = f"expected {words}, got {text!r}"
            raise ValueError(msg)
    (speed_m_s, *speed_sd), (from_deg, *from_sd) = values
    return Wind(
        speed_m_s=speed_m_s,
        from_deg=from_deg,
        speed_sd_m_s=speed_sd[0] if speed_sd else 0.0,
        from_sd_deg=from_sd[0] if from_sd else 0.0,
    )


def wind_text(wind: Wind) -> str:
    """Return ``5@270`` or ``5±2@270±20``; its profile is another setting."""
    sides = ((wind.speed_m_s, wind.speed_sd_m_s), (wind.from_deg, wind.from_sd_deg))
    return "@".join(exact(mean) + (f"±{exact(sd)}" if sd else "") for mean, sd in sides)


def read_wind_profile(text: str) -> Wind:
    """Return a still air that has the profile of ``power:0.2@10m`` or ``log:0.03m@10m``."""
    if found := _matched(rf"power\s*:\s*{NUMBER}\s*@\s*{NUMBER}\s*m?", text):
        return Wind(shear_exponent=float(found[1]), reference_height_m=float(found[2]))
    if found := _matched(rf"log\s*:\s*{NUMBER}\s*m?\s*@\s*{NUMBER}\s*m?", text):
        return Wind(roughness_length_m=float(found[1]), reference_height_m=float(found[2]))
    msg = (
        "expected power:EXPONENT@HEIGHT or log:ROUGHNESS@HEIGHT, such as power:0.2@10m or "
        f"log:0.03m@10m, got {text!r}"
    )
    raise ValueError(msg)


def wind_profile_text(wind: Wind) -> str:
    """Return ``power:0.2@10`` or ``log:0.03@10``."""
    height = exact(wind.reference_height_m or 0.0)
    if wind.shear_exponent is not None:
        return f"power:{exact(wind.shear_exponent)}@{height}"
    return f"log:{exact(wind.roughness_length_m or 0.0)}@{height}"


class _Times(Kind):
    """Times from 0 to a day, with commas."""

    _time = Number("s", 0.0, _LATEST_START_S)

    def read(self, text: str) -> tuple[SettingValue, ...]:
        """Return the times."""
        return tuple(map(self._time.read, text.split(",")))

    def refusal(self, value: SettingValue) -> str:
        """Return what each must be."""
        if not all(is_finite_number(one) for one in value):
            return "a finite number for each mission"
        return next(filter(None, map(self._time.refusal, value)), "")


# What a setting does to the field it belongs to.


def _with_profile(wind: Wind, profile: Wind) -> Wind:
    return replace(
        wind,
        reference_height_m=profile.reference_height_m,
        shear_exponent=profile.shear_exponent,
        roughness_length_m=profile.roughness_length_m,
    )


def _selected(name: str) -> "Callable[[Selection, SettingValue], Selection]":
    return lambda selection, value: replace(selection, **{name: value})


def _load_vehicle(name: str) -> "VehicleModel":
    from planner.vehicle.library import load_vehicle

    return load_vehicle(name)


def _load_parameters(path: Path) -> "ParameterSet":
    from planner.vehicle.parameters.files import read_parameters

    return read_parameters(path)


def _load_terrain(paths: tuple[Path, ...]) -> "TerrainGrid":
    from planner.geo.terrain import read_terrain

    return read_terrain(*paths)


def _load_profile(path: Path) -> "SiteProfile":
    from planner.site_profile import read_profile

    return read_profile(path)


def _load_baseline(path: Path) -> SettingValue:
    from planner.selection import read_baseline

    return read_baseline(path)


def _model_names() -> "Iterable[str]":
    from planner.vehicle.library import model_names

    return model_names()


def _codes() -> "Iterable[str]":
    from planner import catalogue

    return catalogue.entries()


# How a setting is shown.


def _plain(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"{value:g}"


def _same(value: float | None) -> float | None:
    return value


def _row(key: str, label: str, shown: "Shown") -> tuple[Row, ...]:
    """Return the row of a setting that is one number."""
    return (Row(key=key, label=label, shown=shown, of=_same),)


def _mean(value: float | Spread | None) -> float | None:
    return None if value is None else mean_of(value)


def _spread_rows(key: str, sd_key: str, label: str, shown: "Shown") -> tuple[Row, ...]:
    """Return the rows of a setting that may not be known exactly."""
    return (
        Row(key=key, label=label, shown=shown, of=_mean),
        Row(key=sd_key, label=f"{label}, standard deviation", shown=shown, of=sd_of),
    )


def _attribute_rows(*rows: "tuple[str, str, Shown, str]") -> tuple[Row, ...]:
    """Return the rows of a setting that has several numbers: key, label, text and attribute."""
    return tuple(
        Row(key=key, label=label, shown=shown, of=attrgetter(name))
        for key, label, shown, name in rows
    )


def _give_or_take(shown: "Shown", mean: float | None, sd: float) -> str:
    """Return a quantity with its standard deviation, where it has one."""
    return f"{shown(mean)} ± {shown(sd)}" if sd else shown(mean)


def _wind_phrase(wind: Wind) -> str:
    if not (wind.speed_m_s or wind.speed_sd_m_s):
        return "no wind"
    speed = _give_or_take(quantity.speed, wind.speed_m_s, wind.speed_sd_m_s)
    text = f"wind {speed} from {quantity.bearing(wind.from_deg)}"
    if wind.from_sd_deg:
        text += f" ± {quantity.decimals(wind.from_sd_deg, 0)}°"
    if wind.reference_height_m is None:
        return text
    text += f" at {quantity.height(wind.reference_height_m)}"
    if wind.shear_exponent is not None:
        return f"{text} (power law, exponent {wind.shear_exponent:g})"
    return f"{text} (logarithmic law, roughness {wind.roughness_length_m:g} m)"


def _payload_phrase(payload_kg: float | Spread) -> str:
    mean_kg, sd_kg = mean_of(payload_kg), sd_of(payload_kg)
    if not (mean_kg or sd_kg):
        return "no payload"
    return f"payload {_give_or_take(quantity.mass, mean_kg, sd_kg)}"


class _Vehicle(Declared, kw_only=False):
    """What flies: the one setting that `planner.check` takes by its position."""

    vehicle: Annotated[
        "VehicleModel",
        Setting(
            kind=NameOrFile("name of a vehicle model or path of its file", ".toml", _model_names),
            group=Group.FLIGHT,
            option="--vehicle",
            metavar="NAME|FILE.toml",
            help="vehicle model: a shipped one by name, or a model file",
            unset="the article's quadrotor",
            label="Vehicle",
            load=_load_vehicle,
            made_by="planner.load_vehicle(name)",
        ),
    ]


class Setup(_Vehicle):
    """Everything a user can set besides the mission."""

    parameters: Annotated[
        "ParameterSet | None",
        Setting(
            key="params",
            kind=File(),
            group=Group.FLIGHT,
            option="--params",
            metavar="FILE",
            help="autopilot parameters: ArduPilot .param or QGroundControl .params",
            label="Parameters",
            example="none; a file",
            load=_load_parameters,
            made_by="planner.vehicle.parameters.files.read_parameters(path)",
        ),
    ] = None
    """The vehicle's own; ``None``: the model's, else the autopilot's defaults."""

    terrain: Annotated[
        "TerrainGrid | None",
        Setting(
            kind=Files(),
            group=Group.FLIGHT,
            option="--terrain",
            metavar="FILE",
            help="heights of the ground, GeoTIFF or .hgt; repeatable (needs mavjoule[terrain])",
            load=_load_terrain,
            made_by="planner.geo.terrain.read_terrain(path)",
        ),
    ] = None
    """``None``: the ground is level with home."""

    autopilot: Annotated[
        Autopilot | None,
        Setting(
            kind=Choice({"auto": "auto"} | {one.value: one for one in Autopilot}),
            group=Group.FLIGHT,
            option="--autopilot",
            metavar="auto|px4|ardupilot|step",
            help="who flies the mission",
            unset="auto, the model's own",
            load=lambda given: None if given == "auto" else given,
            made_by="planner.Autopilot.PX4, for example",
        ),
    ] = None
    """``None``: the model's own way of commanding."""

    target: Annotated[
        "Target | None",
        Setting(
            kind=Choice(TARGETS),
            group=Group.FLIGHT,
            option="--target",
            metavar="px4-1.16|arducopter-4.7|…",
            help="version of the firmware whose rules count",
            unset="that of the parameter file",
            made_by="planner.Target(planner.Autopilot.PX4)",
        ),
    ] = None

    wind: Annotated[
        Wind,
        Setting(
            kind=Form(read_wind, wind_text, holds="text or number"),
            group=Group.FLIGHT,
            option="--wind",
            metavar="SPEED@FROM_DEG",
            help="wind in m/s and where it blows from, 5@270 or 5±2@270±20",
            unset="none",
            label="Wind",
            example="none; 5@270",
            is_none_unset=True,
            made_by="planner.Wind(speed_m_s=…, from_deg=…)",
            phrase=_wind_phrase,
            rows=_attribute_rows(
                ("wind_m_s", "Wind", quantity.speed, "speed_m_s"),
                ("wind_from_deg", "Wind from", quantity.bearing, "from_deg"),
                ("wind_reference_height_m", "Wind given at", quantity.height, "reference_height_m"),
                ("wind_shear_exponent", "Exponent of the wind's growth", _plain, "shear_exponent"),
                ("wind_roughness_length_m", "Roughness length [m]", _plain, "roughness_length_m"),
                ("wind_sd_m_s", "Wind, standard deviation", quantity.speed, "speed_sd_m_s"),
                ("wind_from_sd_deg", "Wind from, standard deviation [°]", _plain, "from_sd_deg"),
            ),
        ),
        Setting(
            key="wind_profile",
            kind=Form(read_wind_profile, wind_profile_text),
            group=Group.FLIGHT,
            option="--wind-profile",
            metavar="power:EXPONENT@M|log:ROUGHNESS_M@M",
            help="how the wind grows with the height above home, and the height --wind is given for, "
            "such as power:0.2@10",
            unset="the same at every height",
            into=_with_profile,
        ),
    ] = Wind()

    home_amsl_m: Annotated[
        float | None,
        Setting(
            kind=Number("m", -500.0, 9000.0),
            group=Group.FLIGHT,
            option="--home-amsl",
            metavar="M",
            help="altitude of the take-off place",
            unset="the mission's own",
            rows=_row("home_amsl_m", "Home above sea level", quantity.height),
            phrase=lambda home_amsl_m: f"home {quantity.height(home_amsl_m)} AMSL",
        ),
    ] = None

    temperature_c: Annotated[
        float | Spread | None,
        Setting(
            kind=Number("C", -90.0, 60.0, with_spread=True),
            group=Group.FLIGHT,
            option="--temperature",
            metavar="C",
            help="air temperature at home, 15 or 15±5",
            unset="standard for its altitude",
            label="Air °C",
            example="standard",
            made_by="a number, or planner.Spread(mean=…, sd=…)",
            rows=_spread_rows(
                "temperature_c", "temperature_sd_c", "Air at home", quantity.temperature
            ),
            phrase=lambda air_c: _give_or_take(quantity.temperature, _mean(air_c), sd_of(air_c)),
        ),
    ] = None

    payload_kg: Annotated[
        float | Spread,
        Setting(
            kind=Number("kg", 0.0, 1000.0, with_spread=True, hint="is it grams?"),
            group=Group.FLIGHT,
            option="--payload",
            metavar="KG",
            help="mass carried beyond the model's own, such as 0.5 or 0.5±0.1",
            unset="0",
            label="Payload kg",
            example="none",
            made_by="a number, or planner.Spread(mean=…, sd=…)",
            rows=_spread_rows("payload_kg", "payload_sd_kg", "Payload", quantity.mass),
            phrase=_payload_phrase,
        ),
    ] = 0.0

    position_noise_m: Annotated[
        float | None,
        Setting(
            kind=Number("m", 0.0, MOST_NOISE_M),
            group=Group.FLIGHT,
            option="--position-noise",
            metavar="M",
            help="mean horizontal error of the position in a hover, which slows PX4 down",
            unset="the model's",
            rows=_row("position_noise_m", "Position noise [m]", _plain),
        ),
    ] = None

    speed_m_s: Annotated[
        float | None,
        Setting(
            kind=Number("m/s", 0.0, _FASTEST_M_S, is_open=True),
            group=Group.FLIGHT,
            option="--speed",
            metavar="M_S",
            help="ground speed of every level leg",
            unset="as the mission commands",
            label="Speed m/s",
            example="the mission's",
        ),
    ] = None

    clearance_m: Annotated[
        float,
        Setting(
            kind=Number("m", 0.0, 1000.0),
            group=Group.JUDGEMENT,
            option="--clearance",
            metavar="M",
            help="height to keep over the ground of --terrain",
            unset="0",
        ),
    ] = 0.0

    profile: Annotated[
        "SiteProfile | None",
        Setting(
            kind=File(),
            group=Group.JUDGEMENT,
            option="--profile",
            metavar="FILE.toml",
            help="what a site asks of parameters, heights, distances and items",
            load=_load_profile,
            made_by="planner.read_profile(path)",
        ),
    ] = None

    reaction_time_s: Annotated[
        float,
        Setting(
            kind=Number("s", 0.0, 100.0),
            group=Group.JUDGEMENT,
            option="--reaction-time",
            metavar="S",
            help="time until a vehicle that goes astray is stopped, for fences",
            unset="1",
            rows=_row("reaction_time_s", "Reaction time", quantity.duration),
        ),
    ] = 1.0

    position_error_m: Annotated[
        float,
        Setting(
            kind=Number("m", 0.0, 100.0),
            group=Group.JUDGEMENT,
            option="--position-error",
            metavar="M",
            help="how wrong the position may be, for fences",
            unset="2.5",
            rows=_row("position_error_m", "Position error", quantity.height),
        ),
    ] = 2.5

    battery: Annotated[
        Battery | None,
        Setting(
            kind=Form(read_battery, battery_text),
            group=Group.BATTERY,
            option="--battery",
            metavar="CHARGE@VOLTAGE|ENERGY",
            help="battery, such as 5.2Ah@14.8V or 77Wh",
            unset="the model's own",
            label="Battery",
            example="the model's; 5.2Ah@14.8V",
            made_by="planner.Battery(capacity_ah=…, nominal_voltage_v=…)",
        ),
    ] = None

    battery_health: Annotated[
        float | None,
        Setting(
            kind=Fraction(is_open=True),
            group=Group.BATTERY,
            option="--battery-health",
            metavar="FRACTION",
            help="charge of the full battery over that of the new one",
            unset="as the battery says, else 100%",
            rows=_row("battery_health", "Battery health", quantity.percent),
            phrase=lambda health: (
                None if health is None else f"battery health {quantity.percent(health)}"
            ),
        ),
    ] = None

    battery_resistance_factor: Annotated[
        float | None,
        Setting(
            kind=Number("times", 1.0, 20.0),
            group=Group.BATTERY,
            option="--battery-resistance",
            metavar="FACTOR",
            help="resistance of the battery over that of the new one",
            unset="as the battery says, else 1",
            rows=_row("battery_resistance_factor", "Battery resistance factor", _plain),
            phrase=lambda factor: (
                None if factor is None else f"battery resistance {factor:g} times the new one's"
            ),
        ),
    ] = None

    battery_temperature_c: Annotated[
        float | None,
        Setting(
            kind=Number("C", -90.0, 60.0),
            group=Group.BATTERY,
            option="--battery-temperature",
            metavar="C",
            help="temperature of the battery, on which its resistance depends",
            unset="that of the air at home",
            rows=_row("battery_temperature_c", "Battery", quantity.temperature),
            phrase=lambda battery_c: (
                None if battery_c is None else f"battery at {quantity.temperature(battery_c)}"
            ),
        ),
    ] = None

    charge: Annotated[
        float | Spread,
        Setting(
            kind=Fraction(with_spread=True),
            group=Group.BATTERY,
            option="--charge",
            metavar="FRACTION",
            help="state of charge at the start, 95% or 95±2%",
            unset="100%",
            label="Charge",
            made_by="a number, or planner.Spread(mean=…, sd=…)",
        ),
    ] = 1.0

    reserve: Annotated[
        float | Reserve,
        Setting(
            kind=_ReserveKind(),
            group=Group.JUDGEMENT,
            option="--reserve",
            metavar="FRACTION|ENERGY|TIME",
            help="what stays in the battery: 20%, 12Wh, or minutes of hover, 3min",
            unset="20%",
            label="Reserve",
            made_by="a number, or planner.Reserve(energy_wh=…)",
        ),
    ] = 0.2
    """A number is a fraction of the capacity."""

    risk: Annotated[
        float,
        Setting(
            kind=Fraction(),
            group=Group.JUDGEMENT,
            option="--risk",
            metavar="FRACTION",
            help="warn if the chance of landing below the reserve exceeds this",
            unset="5%",
        ),
    ] = 0.05

    selection: Annotated[
        Selection,
        Setting(
            key="select",
            kind=Codes(_codes),
            group=Group.JUDGEMENT,
            option="--select",
            metavar="CODES",
            help="report only these codes, or codes that begin so; commas, repeatable",
            is_none_unset=True,
            into=_selected("select"),
            made_by="planner.Selection(ignore=…)",
        ),
        Setting(
            key="extend_select",
            kind=Codes(_codes),
            group=Group.JUDGEMENT,
            option="--extend-select",
            metavar="CODES",
            help="report these codes too, whatever --select and --ignore say",
            into=_selected("extend_select"),
        ),
        Setting(
            key="ignore",
            kind=Codes(_codes),
            group=Group.JUDGEMENT,
            option="--ignore",
            metavar="CODES",
            help="do not report these codes, or codes that begin so; commas, repeatable",
            into=_selected("ignore"),
        ),
        Setting(
            key="baseline",
            kind=File(),
            group=Group.JUDGEMENT,
            option="--baseline",
            metavar="FILE",
            help="do not report the findings in this file, which --write-baseline wrote",
            load=_load_baseline,
            into=_selected("baseline"),
        ),
        Setting(
            key="per_file_ignores",
            kind=CodesByFile(_codes),
            group=Group.JUDGEMENT,
            help="codes not to report of some files, or of an item: 'site.plan#12'",
            into=_selected("exemptions"),
        ),
    ] = Selection()
    """Which findings are reported."""

    fail_on: Annotated[
        Severity,
        Setting(
            kind=Choice({"error": Severity.ERROR, "warning": Severity.WARNING}),
            group=Group.JUDGEMENT,
            option="--fail-on",
            metavar="error|warning",
            help="lowest severity that makes the verdict NO-GO",
            unset="error",
            made_by="planner.Severity.WARNING, for example",
        ),
    ] = Severity.ERROR

    with_trace: Annotated[
        bool,
        Setting(
            key="trace",  # of the output, which names the file
            load=bool,
            kind=Switch(),
            group=Group.REPORT,
            help="whether to sample the flight over time as well",
            in_file=False,
            made_by="True or False",
        ),
    ] = False

    @classmethod
    def of(cls, values: "Mapping[str, SettingValue]") -> Self:
        """Return what settings by key make; the article's quadrotor flies where none is named."""
        return super().of({"vehicle": DEFAULT_MODEL, **values})

    @property
    def flown_by(self) -> Autopilot:
        """Who shapes the references."""
        return self.vehicle.reference if self.autopilot is None else self.autopilot


class Together(Declared):
    """How far missions that are flown at the same time keep from each other."""

    separation_m: Annotated[
        float,
        Setting(
            kind=Number("m", 0.0, 10_000.0, is_open=True),
            group=Group.FLEET,
            option="--separation",
            metavar="M",
            help="the missions are flown at the same time and keep this distance from each other",
            unset="they are not",
        ),
    ]

    min_nav_alt_m: Annotated[
        float,
        Setting(
            kind=Number("m", 0.0, 10_000.0),
            group=Group.FLEET,
            option="--min-nav-alt",
            metavar="M",
            help="with --separation: two are not judged while both are lower above their take-off "
            "or landing places",
            unset="2.5",
        ),
    ] = 2.5

    start_error_s: Annotated[
        float,
        Setting(
            kind=Number("s", 0.0, _LATEST_START_S),
            group=Group.FLEET,
            option="--start-error",
            metavar="S",
            help="with --separation: each may start so much sooner or later",
            unset="0",
        ),
    ] = 0.0

    starts_s: Annotated[
        tuple[float, ...] | list[float],
        Setting(
            kind=_Times(),
            group=Group.FLEET,
            option="--start",
            metavar="S,S,…",
            help="with --separation: when each mission starts, in their order",
            unset="all at once",
            in_file=False,  # it counts the missions of one call
            made_by="a number for each mission",
        ),
    ] = ()


class Output(Declared):
    """Where the report of a call goes, and how."""

    format: Annotated[
        str,
        Setting(
            kind=Choice({name: name for name in FORMATS}),
            group=Group.REPORT,
            option="--format",
            metavar="|".join(FORMATS),
            help="format of the report",
            unset="text",
        ),
    ] = "text"

    output: Annotated[
        Path | None,
        Setting(
            kind=File(),
            group=Group.REPORT,
            option="--output",
            metavar="FILE",
            help="write the report to a file instead of standard output",
            load=lambda path: None if path == Path("-") else path,
        ),
    ] = None

    trace: Annotated[
        Path | None,
        Setting(
            kind=File(),
            group=Group.REPORT,
            option="--trace",
            metavar="FILE.csv",
            help="write the flight of a single mission, sampled over time, to a file",
        ),
    ] = None

    report: Annotated[
        Path | None,
        Setting(
            kind=File(),
            group=Group.REPORT,
            option="--report",
            metavar="FILE.html",
            help="write a page with pictures of all missions that opens in any browser, offline "
            "(needs mavjoule[report])",
        ),
    ] = None

    plots: Annotated[
        Path | None,
        Setting(
            kind=File(),
            group=Group.REPORT,
            option="--plots",
            metavar="DIR",
            help="draw map, altitude, speed, power and energy of a single mission into a folder, as "
            "SVG and PNG (needs mavjoule[report])",
        ),
    ] = None

    statistics: Annotated[
        bool,
        Setting(
            kind=Switch(),
            group=Group.REPORT,
            option="--statistics/--no-statistics",
            help="count the findings by code; with the formats text and json",
            unset="no",
        ),
    ] = False

    exit_zero: Annotated[
        bool,
        Setting(
            kind=Switch(),
            group=Group.REPORT,
            option="--exit-zero/--no-exit-zero",
            help="exit with 0 even where a mission is a no-go",
            unset="no",
        ),
    ] = False


def settings() -> dict[str, Setting]:
    """Return every setting by its key."""
    return {setting.key: setting for cls in (Setup, Together, Output) for setting in declared(cls)}


def conditions(setup: Setup | None) -> "tuple[tuple[Row, float | None], ...]":
    """Return the numbers of a setup that belong into every report; none of them without one."""
    return tuple(
        (row, None if setup is None else row.of(getattr(setup, setting.field)))
        for setting in declared(Setup)
        for row in setting.rows
    )


def conditions_text(setup: Setup) -> str:
    """Return the conditions of a flight in one line: ``no wind, home 488 m AMSL, 15 °C, …``."""
    phrases = (
        setting.phrase(getattr(setup, setting.field))
        for setting in declared(Setup)
        if setting.phrase is not None
    )
    return ", ".join(filter(None, phrases))
