"""The setup of a check: everything a user can set besides the mission, each setting declared once.

To add a setting is to add a field: its declaration says how it is written and read, its range, its
help and its place in the reports; option, key and metavar follow unless they are given.
"""

from __future__ import annotations

import math
import re
from functools import cache
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from planner import quantity
from planner.autopilot import TARGETS, TARGETS_SHOWN, Autopilot
from planner.errors import UsageError
from planner.findings import Severity
from planner.notation import (
    battery_text,
    read_battery,
    read_wind,
    read_wind_profile,
    wind_profile_text,
    wind_text,
)
from planner.physics.wind import Wind
from planner.quantity import NUMBER, Spread, exact, mean_of, number_before, sd_of
from planner.selection import Selection, read_baseline
from planner.setting import (
    Bearing,
    Choice,
    Codes,
    CodesByFile,
    Declared,
    File,
    Files,
    Form,
    Fraction,
    Group,
    IgnoredCodes,
    Kind,
    NameOrFile,
    Number,
    Row,
    Setting,
    SettingValue,
    Switch,
    Temperature,
    declared,
    is_finite_number,
    setting,
)
from planner.units import FASTEST_M_S, JOULES_PER_WATT_HOUR
from planner.values import Value, brief, replace
from planner.vehicle.library import DEFAULT_MODEL, load_vehicle, model_names
from planner.vehicle.model import Aloft
from planner.vehicle.pack import FlownPack, flown_pack

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    Shown = Callable[[float | None], str]

    from planner.autopilot import Target
    from planner.geo.terrain import TerrainGrid
    from planner.geo.tiles import TileServer
    from planner.site_profile import SiteProfile
    from planner.vehicle.battery import Battery
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.files import ParameterSet

FORMATS = ("text", "concise", "json", "json-lines", "sarif", "junit", "github", "gitlab")
"""Formats of a report."""
ASSUMED_POSITION_ERROR_M = 2.5
"""How wrong a position may be where nobody states it, for fences and terrain."""


def _position_margin_m(stated_m: float | None) -> float:
    return ASSUMED_POSITION_ERROR_M if stated_m is None else stated_m


MOST_NOISE_M = 1.5
"""PX4 stands still at an error of MPC_XY_ERR_MAX, 2 m by default; this is short of it. [m]"""
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


class _ReserveKind(Fraction):
    """A fraction of the capacity, an energy or minutes of hover: ``20%``, ``12Wh``, ``3min``."""

    def read(self, text: str) -> SettingValue:
        """Return the reserve; a number is a fraction."""
        energy_wh, hover_min = number_before(text, "Wh"), number_before(text, "min")
        given = hover_min if energy_wh is None else energy_wh
        if given is None:
            try:
                return super().read(text)
            except ValueError as error:
                if re.fullmatch(rf"{NUMBER}\s*%?", text.strip()):
                    raise
                msg = f"expected 20% of the capacity, 12Wh of energy or 3min of hover, got {text!r}"
                raise ValueError(msg) from error
        if not 0.0 <= given < math.inf:
            msg = f"expected a reserve of zero or more, got {text!r}"
            raise ValueError(msg)
        return Reserve(hover_s=60.0 * given) if energy_wh is None else Reserve(energy_wh=energy_wh)

    def text(self, value: SettingValue) -> str:
        """Return what reads back as a reserve."""
        if not isinstance(value, Reserve):
            return super().text(value)
        if value.energy_wh is not None:
            return f"{exact(value.energy_wh)}Wh"
        if value.hover_s is not None:
            return f"{exact(value.hover_s / 60.0)}min"
        return super().text(value.fraction or 0.0)


class RestVoltage(Value):
    """A battery's voltage without load, from which its charge follows."""

    voltage_v: float


class _ChargeKind(Fraction):
    """A fraction of the full charge, or the voltage at rest: ``95%``, ``16.2V``."""

    def read(self, text: str) -> SettingValue:
        """Return the fraction or the voltage."""
        voltage_v = number_before(text, "V")
        return super().read(text) if voltage_v is None else RestVoltage(voltage_v=voltage_v)

    def text(self, value: SettingValue) -> str:
        """Return what reads back as a charge."""
        return (
            f"{exact(value.voltage_v)}V" if isinstance(value, RestVoltage) else super().text(value)
        )


class _TimeList(Kind):
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


def _selected(name: str) -> Callable[[Selection, SettingValue], Selection]:
    return lambda selection, value: replace(selection, **{name: value})


def _lazy(module: str, name: str) -> Callable[..., Any]:
    """Return a function that is imported at its first call."""

    def call(*given: SettingValue) -> SettingValue:
        return getattr(import_module(module), name)(*given)

    return call


# How a setting is shown.


def _plain(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"{value:g}"


def _metres(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"{value:g} m"


def _spread_text(shown: Shown, value: float | Spread) -> str:
    sd = sd_of(value)
    return shown(mean_of(value)) + (f" ± {shown(sd)}" if sd else "")


def home_phrase(home_amsl_m: float | None) -> str:
    """Return the altitude of home in words: ``home 488 m AMSL``."""
    if home_amsl_m is None:
        return "altitude of home unknown"
    return f"home {quantity.height(home_amsl_m)} AMSL"


def wind_phrase(wind: Wind) -> str:
    """Return a wind in words: ``no wind``, ``wind 5.0 m/s from 270°``."""
    if not (wind.speed_m_s or wind.speed_sd_m_s):
        return "no wind"
    speed = _spread_text(quantity.speed, Spread(mean=wind.speed_m_s, sd=wind.speed_sd_m_s))
    text = f"wind {speed} from {quantity.bearing(wind.from_deg)}"
    if wind.from_sd_deg:
        text += f" ± {quantity.decimals(wind.from_sd_deg, 0)}°"
    if wind.reference_height_m is None:
        return text
    text += f" at {quantity.height(wind.reference_height_m)}"
    if wind.shear_exponent is not None:
        return f"{text} (power law, exponent {wind.shear_exponent:g})"
    return f"{text} (logarithmic law, roughness {wind.roughness_length_m:g} m)"


_CODES = _lazy("planner.catalogue", "entries")
_KEPT_ON = _lazy("planner.catalogue", "kept_on")


class SettingsFile(Value):
    """What a configuration file has set for one mission, for the reports to name it."""

    path: str
    values: tuple[tuple[str, str], ...]
    """By key, as text; without what the command line gave."""

    def without(self, keys: Iterable[str]) -> SettingsFile | None:
        """Return what remains where some are set by something else; ``None``: nothing."""
        left = tuple(one for one in self.values if one[0] not in keys)
        return replace(self, values=left) if left else None

    def __str__(self) -> str:
        """Return ``from /site/mavjoule.toml: battery 4000Wh, ignore M109``."""
        return f"from {self.path}: {', '.join(' '.join(one) for one in self.values)}"


SETTINGS_FILE = "settings_file"
"""Key of the `SettingsFile` among the settings of a mission by key."""


class _Vehicle(Declared, kw_only=False):
    """What flies: the one setting that `planner.check` takes by its position."""

    vehicle: VehicleModel = setting(
        NameOrFile("name of a vehicle model or path of its file", ".toml", model_names),
        Group.FLIGHT,
        "vehicle model: a shipped one by name, or a model file",
        metavar="NAME|FILE.toml",
        unset="none: the article's quadrotor as an example, and X903",
        label="Vehicle",
        load=load_vehicle,
        made_by="planner.load_vehicle(name)",
    )


class Setup(_Vehicle):
    """Everything a user can set besides the mission."""

    __repr__ = brief

    parameters: ParameterSet | None = setting(
        File(),
        Group.FLIGHT,
        "autopilot parameters: ArduPilot .param or QGroundControl .params",
        default=None,
        key="params",
        label="Parameters",
        example="none; a file",
        load=_lazy("planner.vehicle.parameters.files", "read_parameters"),
        made_by="planner.vehicle.parameters.files.read_parameters(path)",
    )
    """The vehicle's own; ``None``: the model's, else the autopilot's defaults."""

    terrain: TerrainGrid | None = setting(
        Files(),
        Group.FLIGHT,
        "heights of the ground, GeoTIFF or .hgt; repeatable (needs mavjoule[terrain])",
        default=None,
        load=lambda paths: _lazy("planner.geo.terrain", "read_terrain")(*paths),
        made_by="planner.geo.terrain.read_terrain(path)",
    )
    """``None``: the ground is level with home."""

    autopilot: Autopilot | None = setting(
        Choice({"auto": "auto"} | {one.value: one for one in Autopilot}),
        Group.FLIGHT,
        "who flies the mission",
        default=None,
        metavar="auto|px4|ardupilot|step",
        unset="auto, the model's own",
        load=lambda given: None if given == "auto" else given,
        made_by="planner.Autopilot.PX4, for example",
    )
    """``None``: the model's own way of commanding."""

    target: Target | None = setting(
        Choice(TARGETS),
        Group.FLIGHT,
        "version of the firmware whose rules count",
        default=None,
        metavar="|".join((*TARGETS_SHOWN, "…")),
        unset="that of the parameter file",
        made_by="planner.Target(planner.Autopilot.PX4)",
    )

    wind: Wind = setting(
        Form(read_wind, wind_text, holds="text or number"),
        Group.FLIGHT,
        "wind and where it blows from, 5@270 in m/s, 10kt@W or 5±2@270±20",
        default=Wind(),
        metavar="SPEED@FROM_DEG",
        unset="none",
        label="Wind",
        example="none; 5@270",
        is_none_unset=True,
        made_by="planner.Wind(speed_m_s=…, from_deg=…)",
        phrase=wind_phrase,
        rows=tuple(
            Row(key, label, shown, attrgetter(name))
            for key, label, shown, name in (
                ("wind_m_s", "Wind", quantity.speed, "speed_m_s"),
                ("wind_from_deg", "Wind from", quantity.bearing, "from_deg"),
                ("wind_reference_height_m", "Wind given at", quantity.height, "reference_height_m"),
                ("wind_shear_exponent", "Exponent of the wind's growth", _plain, "shear_exponent"),
                ("wind_roughness_length_m", "Roughness length", _metres, "roughness_length_m"),
                ("wind_sd_m_s", "Wind, standard deviation", quantity.speed, "speed_sd_m_s"),
                ("wind_from_sd_deg", "Wind from, standard deviation [°]", _plain, "from_sd_deg"),
            )
        ),
        also=(
            Setting(
                Form(read_wind_profile, wind_profile_text),
                Group.FLIGHT,
                "how the wind grows with the height above home, and the height --wind is given for, "
                "such as power:0.2@10; below home, and over ground that --terrain has lower, at least --wind",
                key="wind_profile",
                metavar="power:EXPONENT@M|log:ROUGHNESS_M@M",
                unset="the same at every height",
                into=_with_profile,
            ),
        ),
    )

    home_amsl_m: float | None = setting(
        Number("m", -500.0, 9000.0),
        Group.FLIGHT,
        "altitude of the take-off place",
        default=None,
        unset="the mission's own",
        rows=(Row("home_amsl_m", "Home above sea level", quantity.height),),
        phrase=home_phrase,
    )

    temperature_c: float | Spread | None = setting(
        Temperature(with_spread=True),
        Group.FLIGHT,
        "air temperature at home, 15, 15±5 or 59F",
        default=None,
        unset="standard for its altitude",
        label="Air °C",
        example="standard",
        rows=(
            Row("temperature_c", "Air at home", quantity.temperature, mean_of),
            Row("temperature_sd_c", "Air at home, standard deviation", quantity.temperature, sd_of),
        ),
        phrase=lambda air_c: _spread_text(quantity.temperature, air_c),
    )

    pressure_hpa: float | None = setting(
        Number("hPa", 850.0, 1100.0, hint="is it reduced to sea level (QNH)?"),
        Group.FLIGHT,
        "air pressure reduced to sea level (QNH), as weather reports give it",
        default=None,
        unset="standard, 1013.25 hPa",
        rows=(Row("pressure_hpa", "Pressure at sea level [hPa]", _plain),),
        phrase=lambda pressure_hpa: f"QNH {pressure_hpa:g} hPa",
    )

    payload_kg: float | Spread = setting(
        Number("kg", 0.0, 1000.0, with_spread=True, hint="is it grams?"),
        Group.FLIGHT,
        "mass carried beyond the model's own, such as 0.5, 500g or 0.5±0.1",
        default=0.0,
        unset="0",
        label="Payload kg",
        example="none",
        rows=(
            Row("payload_kg", "Payload", quantity.mass, mean_of),
            Row("payload_sd_kg", "Payload, standard deviation", quantity.mass, sd_of),
        ),
        phrase=lambda payload_kg: (
            f"payload {_spread_text(quantity.mass, payload_kg)}"
            if mean_of(payload_kg) or sd_of(payload_kg)
            else "no payload"
        ),
    )

    position_noise_m: float | None = setting(
        Number("m", 0.0, MOST_NOISE_M),
        Group.FLIGHT,
        "mean horizontal error of the position in a hover, which slows PX4 down",
        default=None,
        unset="the model's",
        rows=(Row("position_noise_m", "Position noise", _metres),),
    )

    heading_deg: float | None = setting(
        Bearing(),
        Group.FLIGHT,
        "heading the vehicle is armed with, clockwise from north, which PX4 turns from and returns to",
        default=None,
        unset="half a turn away where it matters",
        rows=(Row("heading_deg", "Heading at arming", quantity.bearing),),
    )

    speed_m_s: float | None = setting(
        Number("m/s", 0.0, FASTEST_M_S, is_open=True),
        Group.FLIGHT,
        "ground speed of every level leg",
        default=None,
        unset="as the mission commands",
        label="Speed m/s",
        example="the mission's",
    )

    clearance_m: float = setting(
        Number("m", 0.0, 1000.0),
        Group.JUDGEMENT,
        "height to keep over the ground of --terrain",
        default=5.0,
        unset="5",
    )
    """5 m: heights above home drift by 2 to 3 m in a flight (a barometer by 0.1 m per 0.01 hPa of weather,
    satellites by 1.5 times the 2.5 m of the plane), and 9 of 10 places of the Copernicus grid of 30 m are
    within 4 m (Copernicus DEM Product Handbook, absolute vertical accuracy): 5 m taken together."""

    profile: SiteProfile | None = setting(
        File(),
        Group.JUDGEMENT,
        "what a site asks of parameters, heights, distances and items",
        default=None,
        metavar="FILE.toml",
        load=_lazy("planner.site_profile", "read_profile"),
        made_by="planner.read_profile(path)",
    )

    reaction_time_s: float = setting(
        Number("s", 0.0, 100.0),
        Group.JUDGEMENT,
        "time until a vehicle that goes astray is stopped, for fences",
        default=1.0,
        unset="1",
        rows=(Row("reaction_time_s", "Reaction time", quantity.duration),),
    )

    position_error_m: float | None = setting(
        Number("m", 0.0, 100.0),
        Group.JUDGEMENT,
        "how wrong the position may be, for fences and terrain",
        default=None,
        unset="2.5",
        rows=(Row("position_error_m", "Position error", quantity.height, _position_margin_m),),
    )

    battery: Battery | None = setting(
        Form(read_battery, battery_text),
        Group.BATTERY,
        "battery, such as 5.2Ah@14.8V, 5.2Ah@4S or 77Wh",
        default=None,
        metavar="CHARGE@VOLTAGE|ENERGY",
        unset="the model's own",
        label="Battery",
        example="the model's; 5.2Ah@14.8V",
        made_by="planner.Battery(capacity_ah=…, nominal_voltage_v=…)",
    )

    battery_health: float | None = setting(
        Fraction(is_open=True),
        Group.BATTERY,
        "charge of the full battery over that of the new one",
        default=None,
        unset="as the battery says, else 100%",
        rows=(Row("battery_health", "Battery health", quantity.percent),),
        phrase=lambda health: f"battery health {quantity.percent(health)}",
    )

    battery_resistance_factor: float | None = setting(
        Number("times", 1.0, 20.0),
        Group.BATTERY,
        "resistance of the battery over that of the new one",
        default=None,
        option="--battery-resistance",
        metavar="FACTOR",
        unset="as the battery says, else 1",
        rows=(Row("battery_resistance_factor", "Battery resistance factor", _plain),),
        phrase=lambda factor: f"battery resistance {factor:g} times the new one's",
    )

    battery_temperature_c: float | None = setting(
        Temperature(),
        Group.BATTERY,
        "temperature of the battery, on which its resistance depends",
        default=None,
        unset="that of the air at home",
        rows=(Row("battery_temperature_c", "Battery", quantity.temperature),),
        phrase=lambda battery_c: f"battery at {quantity.temperature(battery_c)}",
    )

    charge: float | Spread = setting(
        _ChargeKind(with_spread=True),
        Group.BATTERY,
        "state of charge at the start: 95%, 95±2%, or the voltage without load, 16.2V",
        default=1.0,
        unset="100%",
        label="Charge",
    )

    reserve: float | Reserve = setting(
        _ReserveKind(),
        Group.JUDGEMENT,
        "what stays in the battery: 20%, 12Wh, or minutes of hover, 3min",
        default=0.2,
        metavar="FRACTION|ENERGY|TIME",
        unset="20%",
        label="Reserve",
        made_by="a number, or planner.Reserve(energy_wh=…)",
    )
    """A number is a fraction of the capacity."""

    risk: float = setting(
        Fraction(),
        Group.JUDGEMENT,
        "warn if the chance of landing below the reserve exceeds this",
        default=0.05,
        unset="5%",
    )

    selection: Selection = setting(
        Codes(_CODES),
        Group.JUDGEMENT,
        "report only these codes, or codes that begin so; commas, repeatable",
        default=Selection(),
        key="select",
        is_none_unset=True,
        into=_selected("select"),
        made_by="planner.Selection(ignore=…)",
        also=(
            Setting(
                Codes(_CODES),
                Group.JUDGEMENT,
                "report these codes too, whatever --select and --ignore say",
                key="extend_select",
                into=_selected("extend_select"),
            ),
            Setting(
                IgnoredCodes(_CODES, _KEPT_ON),
                Group.JUDGEMENT,
                "do not report these codes, or codes that begin so; commas, repeatable",
                key="ignore",
                into=_selected("ignore"),
            ),
            Setting(
                File(),
                Group.JUDGEMENT,
                "do not report the findings in this file, which --write-baseline wrote",
                key="baseline",
                load=read_baseline,
                into=_selected("baseline"),
            ),
            Setting(
                CodesByFile(_CODES, _KEPT_ON),
                Group.JUDGEMENT,
                "codes not to report of some files, or of an item: 'site.plan#12'",
                key="per_file_ignores",
                into=_selected("exemptions"),
                is_option=False,
            ),
        ),
    )
    """Which findings are reported."""

    fail_on: Severity = setting(
        Choice({"error": Severity.ERROR, "warning": Severity.WARNING}),
        Group.JUDGEMENT,
        "lowest severity that makes the verdict NO-GO",
        default=Severity.ERROR,
        unset="error",
        made_by="planner.Severity.WARNING, for example",
    )

    with_trace: bool = setting(
        Switch(),
        Group.REPORT,
        "whether to sample the flight over time as well",
        default=False,
        key="trace",
        load=bool,
        in_file=False,
        made_by="True or False",
        is_option=False,
    )

    rest_voltage_v: float | None = None
    """Voltage without load that the charge was taken from; ``None``: it was given. [V]"""
    is_vehicle_named: bool = True
    """Whether somebody said what flies; else the article's quadrotor is only an example."""
    settings_file: SettingsFile | None = None
    """What a file has set of it; ``None``: nothing."""
    keeps_load: bool = True
    """Whether what is carried is carried all the way, by the items of the mission."""
    air_density_kg_m3: float | None = None
    """That at home, where the model asks for it; ``None``: not known, or not asked for."""

    @classmethod
    def of(
        cls,
        values: Mapping[str, SettingValue],
        *,
        loaded: Callable[[Setting, Any], Any] = Setting.loaded,
    ) -> Self:
        """Return what settings by key make; the article's quadrotor flies where none is named."""
        named = {key: value for key, value in values.items() if value is not None}
        at_rest = named.pop("charge") if isinstance(named.get("charge"), RestVoltage) else None
        setup = super().of({"vehicle": DEFAULT_MODEL} | named, loaded=loaded)
        setup = replace(
            setup, is_vehicle_named="vehicle" in named, settings_file=values.get(SETTINGS_FILE)
        )
        return setup if at_rest is None else setup.charged_to(at_rest.voltage_v)

    def charged_to(self, rest_voltage_v: float) -> Self:
        """Return the setup with the charge that its battery has at a voltage without load. [V]"""
        charge = self.flown_pack.charge_at_rest(rest_voltage_v)
        return replace(self, charge=charge, rest_voltage_v=rest_voltage_v)

    def require_named(self, command: str) -> None:
        """Raise ``UsageError`` where vehicle or battery are not named, or another speed is given."""
        battery = self.battery or (self.vehicle.battery if self.is_vehicle_named else None)
        missing = {"vehicle": self.is_vehicle_named, "battery": battery is not None}
        names = [name for name, is_known in missing.items() if not is_known]
        if names:
            options = " and ".join(f"--{name}" for name in names)
            needed = " and ".join(f"a {name}" for name in names)
            msg = f"{command} does not start without {needed}: give {options}"
            raise UsageError(msg)
        if self.speed_m_s is not None:
            msg = (
                f"{command} judges the mission at its own speeds: leave out --speed and speed_m_s, or write "
                "the mission with that speed (mavjoule convert --speed)"
            )
            raise UsageError(msg)

    @property
    def flown_pack(self) -> FlownPack:
        """The battery that flies: the one given, completed from the model's, or the model's."""
        return flown_pack(self.battery, self.vehicle.battery)

    @property
    def flown_mass_kg(self) -> float | None:
        """The mass with battery and payload; ``None`` where the model does not know its own. [kg]"""
        own_kg = self.vehicle.mass_kg
        if own_kg is None:
            return None
        return own_kg + self.flown_pack.added_kg + mean_of(self.payload_kg)

    @property
    def aloft(self) -> Aloft:
        """What is certain to fly, and in what air.

        Less two standard deviations of the payload, and without one that is set down on the way.
        """
        own_kg, air_kg_m3 = self.vehicle.mass_kg, self.air_density_kg_m3
        if own_kg is None:
            return Aloft(air_density_kg_m3=air_kg_m3)
        carried_kg = mean_of(self.payload_kg) - 2.0 * sd_of(self.payload_kg)
        if not self.keeps_load:
            carried_kg = 0.0
        flown_kg = own_kg + self.flown_pack.added_kg + max(carried_kg, 0.0)
        return Aloft(times_heavier=flown_kg / own_kg, air_density_kg_m3=air_kg_m3)

    @property
    def position_margin_m(self) -> float:
        """How wrong the position may be: as stated, or as assumed of fences and terrain. [m]"""
        return _position_margin_m(self.position_error_m)

    @property
    def flown_by(self) -> Autopilot:
        """Who shapes the references."""
        return self.vehicle.reference if self.autopilot is None else self.autopilot


class Together(Declared):
    """How far missions that are flown at the same time keep from each other."""

    separation_m: float = setting(
        Number("m", 0.0, 10_000.0, is_open=True),
        Group.FLEET,
        "the missions are flown at the same time and keep this distance from each other",
        unset="they are not",
    )

    min_nav_alt_m: float = setting(
        Number("m", 0.0, 10_000.0),
        Group.FLEET,
        "with --separation: two are not judged while both are lower above their take-off "
        "or landing places",
        default=2.5,
        unset="2.5",
    )

    start_error_s: float = setting(
        Number("s", 0.0, _LATEST_START_S),
        Group.FLEET,
        "with --separation: each may start so much sooner or later",
        default=0.0,
        unset="0",
    )

    starts_s: tuple[float, ...] | list[float] = setting(
        _TimeList(),
        Group.FLEET,
        "with --separation: when each mission starts, in their order",
        default=(),
        option="--start",
        metavar="S,S,…",
        unset="all at once",
        in_file=False,
        made_by="a number for each mission",
    )


class Output(Declared):
    """Where the report of a call goes, and how.

    Files are named by whoever calls: a settings file comes with the missions, from anybody.
    """

    format: str = setting(
        Choice({name: name for name in FORMATS}),
        Group.REPORT,
        "format of the report",
        default="text",
        unset="text",
    )

    output: Path | None = setting(
        File(),
        Group.REPORT,
        "write the report to a file instead of standard output",
        default=None,
        in_file=False,
        load=lambda path: None if path == Path("-") else path,
    )

    trace: Path | None = setting(
        File(),
        Group.REPORT,
        "write the flight of a single mission, sampled over time, to a file: CSV, or Parquet by its suffix "
        "(needs mavjoule[parquet])",
        default=None,
        metavar="FILE.csv|.parquet",
        in_file=False,
    )

    export: Path | None = setting(
        File(),
        Group.REPORT,
        "write the flight of a single mission, with times and energy, to a file for maps: KML, GeoJSON, "
        "GPX or CZML by its suffix (KML and GPX need mavjoule[export])",
        default=None,
        metavar="FILE.kml|.geojson|.gpx|.czml",
        in_file=False,
    )

    report: Path | None = setting(
        File(),
        Group.REPORT,
        "write a page with pictures of all missions that opens in any browser, offline "
        "(needs mavjoule[report])",
        default=None,
        metavar="FILE.html",
        in_file=False,
    )

    tiles: TileServer | None = setting(
        Form(
            _lazy("planner.geo.tiles", "read_tile_server"),
            _lazy("planner.geo.tiles", "tile_server_text"),
        ),
        Group.REPORT,
        "base map of the page's map, fetched by whoever opens the page and not before: the address of "
        "its tiles with {z}, {x} and {y}, then # and whom to name for it",
        default=None,
        metavar="URL",
        in_file=False,
    )

    plots: Path | None = setting(
        File(),
        Group.REPORT,
        "draw map, altitude, speed, power and energy of a single mission into a folder, as "
        "SVG and PNG (needs mavjoule[report])",
        default=None,
        metavar="DIR",
        in_file=False,
    )

    statistics: bool = setting(
        Switch(),
        Group.REPORT,
        "count the findings by code; with the formats text and json",
        default=False,
        unset="no",
    )

    exit_zero: bool = setting(
        Switch(),
        Group.REPORT,
        "exit with 0 even where a mission is a no-go",
        default=False,
        unset="no",
        in_file=False,
    )
    """Typed only: a file that comes with a mission turns no verdict into success."""


@cache
def settings() -> Mapping[str, Setting]:
    """Return every setting by its key."""
    return {setting.key: setting for cls in (Setup, Together, Output) for setting in declared(cls)}


def files_named(values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the files that settings by key name to be read, the file of the settings among them.

    A model's name is yielded as it is: it is no file, unless someone has one of that name.
    """
    for key, one in settings().items():
        value = values.get(key)
        if value is not None and one.kind.is_file and one.group is not Group.REPORT:
            yield from map(str, value if isinstance(value, tuple) else (value,))
    file = values.get(SETTINGS_FILE)
    if file is not None:
        yield file.path


def conditions(setup: Setup | None) -> tuple[tuple[Row, float | None], ...]:
    """Return the numbers of a setup that belong into every report; none of them without one."""
    return tuple(
        (row, None if setup is None else row.of(getattr(setup, setting.field)))
        for setting in declared(Setup)
        for row in setting.rows
    )


UNNAMED = "no vehicle named, predicted for the article's quadrotor"
"""What a prediction is, of which nobody said what flies."""


def basis_text(setup: Setup, *, capacity_wh: float | None) -> str:
    """Return what a verdict holds for: ``my-quad, battery 77.0 Wh at 95 %, wind 5.0 m/s from 270°``.

    Parameters
    ----------
    capacity_wh : float or None
        Energy of the full battery that flies; ``None`` where none is known. [Wh]
    """
    vehicle = setup.vehicle.name if setup.is_vehicle_named else UNNAMED
    pack = "battery unknown" if capacity_wh is None else f"battery {quantity.energy(capacity_wh)}"
    charge = mean_of(setup.charge)
    at = "" if capacity_wh is None or charge == 1.0 else f" at {quantity.percent(charge)}"
    return f"{vehicle}, {pack}{at}, {wind_phrase(setup.wind)}"


def conditions_text(setup: Setup) -> str:
    """Return the conditions of a checked flight in one line: ``no wind, home 488 m AMSL, 15 °C, …``."""
    given = ((setting.phrase, getattr(setup, setting.field)) for setting in declared(Setup))
    phrases = [phrase(value) for phrase, value in given if phrase and value is not None]
    if setup.home_amsl_m is None:
        phrases.append(home_phrase(None))
    return ", ".join(phrases)
