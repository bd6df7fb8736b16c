"""The settings of a check: each is an option of the command line and a key of the configuration."""

from __future__ import annotations

from pathlib import Path

from planner import catalogue
from planner.autopilot import TARGETS, Autopilot, Target
from planner.cli import quantities
from planner.cli.setting import Kind, Setting
from planner.errors import nearest_hint
from planner.findings import Severity
from planner.vehicle.library import model_names

AUTOPILOTS = ("auto", *Autopilot)
SEVERITIES = ("error", "warning")
FORMATS = ("text", "json", "json-lines", "sarif", "junit", "github", "gitlab")


def _autopilot(text: str) -> Autopilot | str:
    return text if text == "auto" else Autopilot(_one_of(text, AUTOPILOTS))


def _target(text: str) -> Target:
    if text not in TARGETS:
        msg = f"{text!r} is none of {', '.join(TARGETS)}{nearest_hint(text, TARGETS)}"
        raise ValueError(msg)
    return TARGETS[text]


def _severity(text: str) -> Severity:
    return Severity[_one_of(text, SEVERITIES).upper()]


def _format(text: str) -> str:
    return _one_of(text, FORMATS)


def _one_of(text: str, choices: tuple[str, ...]) -> str:
    if text not in choices:
        msg = f"{text!r} is none of {', '.join(choices)}"
        raise ValueError(msg)
    return text


def _codes(text: str) -> tuple[str, ...]:
    codes = tuple(code.strip().upper() for code in text.split(",") if code.strip())
    known = catalogue.entries()
    for code in codes:
        if not any(rule.startswith(code) for rule in known):
            msg = f"{code!r} begins no code of a rule{nearest_hint(code, known)} (mavjoule rules)"
            raise ValueError(msg)
    return codes


FLIGHT_SETTINGS = (
    Setting(
        key="vehicle",
        option="--vehicle",
        metavar="NAME|FILE.toml",
        meaning="vehicle model: a shipped one by name, or a model file "
        "[default: the article's quadrotor]",
        read=str,
        kind=Kind.MODEL,
        choices=model_names,
    ),
    Setting(
        key="params",
        option="--params",
        metavar="FILE",
        meaning="autopilot parameters: ArduPilot .param or QGroundControl .params",
        read=Path,
        kind=Kind.PATH,
    ),
    Setting(
        key="terrain",
        option="--terrain",
        metavar="FILE",
        meaning="heights of the ground, GeoTIFF or .hgt; repeatable (needs mavjoule[terrain])",
        read=lambda text: (Path(text),),
        kind=Kind.PATHS,
    ),
    Setting(
        key="autopilot",
        option="--autopilot",
        metavar="auto|px4|ardupilot|step",
        meaning="who flies the mission [default: auto, the model's own]",
        read=_autopilot,
        choices=lambda: AUTOPILOTS,
    ),
    Setting(
        key="target",
        option="--target",
        metavar="px4-1.16|arducopter-4.7|…",
        meaning="version of the firmware whose rules count [default: that of the parameter file]",
        read=_target,
        choices=lambda: TARGETS,
    ),
    Setting(
        key="speed_m_s",
        option="--speed",
        metavar="M_S",
        meaning="ground speed of every level leg [default: as the mission commands]",
        read=quantities.speed_m_s,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="payload_kg",
        option="--payload",
        metavar="KG",
        meaning="mass carried beyond the model's own, such as 0.5 or 0.5±0.1 [default: 0]",
        read=quantities.payload_kg,
        kind=Kind.QUANTITY,
    ),
    Setting(
        key="wind",
        option="--wind",
        metavar="SPEED@FROM_DEG",
        meaning="wind in m/s and where it blows from, 5@270 or 5±2@270±20 [default: none]",
        read=quantities.wind,
        kind=Kind.QUANTITY,
    ),
    Setting(
        key="wind_profile",
        option="--wind-profile",
        metavar="power:EXPONENT@M|log:ROUGHNESS_M@M",
        meaning="how the wind grows with the height above home, and the height --wind is given for, "
        "such as power:0.2@10 [default: the same at every height]",
        read=quantities.wind_profile,
    ),
    Setting(
        key="home_amsl_m",
        option="--home-amsl",
        metavar="M",
        meaning="altitude of the take-off place [default: the mission's own]",
        read=quantities.home_amsl_m,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="temperature_c",
        option="--temperature",
        metavar="C",
        meaning="air temperature at home, 15 or 15±5 [default: standard for its altitude]",
        read=quantities.temperature_c,
        kind=Kind.QUANTITY,
    ),
    Setting(
        key="position_noise_m",
        option="--position-noise",
        metavar="M",
        meaning="mean error of the position in a hover; slows PX4 down [default: the model's]",
        read=quantities.position_noise_m,
        kind=Kind.NUMBER,
    ),
)
"""What decides how a mission is flown."""

BUDGET_SETTINGS = (
    Setting(
        key="clearance_m",
        option="--clearance",
        metavar="M",
        meaning="height to keep over the ground of --terrain [default: 0]",
        read=quantities.clearance_m,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="profile",
        option="--profile",
        metavar="FILE.toml",
        meaning="what a site asks of parameters, heights, distances and items",
        read=Path,
        kind=Kind.PATH,
    ),
    Setting(
        key="battery",
        option="--battery",
        metavar="CHARGE@VOLTAGE|ENERGY",
        meaning="battery, such as 5.2Ah@14.8V or 77Wh [default: the model's own]",
        read=quantities.battery,
    ),
    Setting(
        key="battery_health",
        option="--battery-health",
        metavar="SHARE",
        meaning="charge the battery still holds when full, of that of the new one "
        "[default: as the battery says, else 100%]",
        read=quantities.battery_health,
        kind=Kind.QUANTITY,
    ),
    Setting(
        key="battery_resistance_factor",
        option="--battery-resistance",
        metavar="FACTOR",
        meaning="resistance of the battery over that of the new one "
        "[default: as the battery says, else 1]",
        read=quantities.battery_resistance_factor,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="battery_temperature_c",
        option="--battery-temperature",
        metavar="C",
        meaning="temperature of the battery, on which its resistance depends "
        "[default: that of the air at home]",
        read=quantities.battery_temperature_c,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="charge",
        option="--charge",
        metavar="SHARE",
        meaning="how full the battery is at the start, 95% or 95±2% [default: 100%]",
        read=quantities.charge,
        kind=Kind.QUANTITY,
    ),
    Setting(
        key="reserve",
        option="--reserve",
        metavar="SHARE|ENERGY|TIME",
        meaning="what stays in the battery: 20%, 12Wh, or minutes of hover, 3min [default: 20%]",
        read=quantities.reserve,
        kind=Kind.QUANTITY,
    ),
    Setting(
        key="reaction_time_s",
        option="--reaction-time",
        metavar="S",
        meaning="time until a vehicle going astray is told to stop, for fences [default: 1]",
        read=quantities.reaction_time_s,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="position_error_m",
        option="--position-error",
        metavar="M",
        meaning="how wrong the position may be, for fences [default: 2.5]",
        read=quantities.position_error_m,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="risk",
        option="--risk",
        metavar="SHARE",
        meaning="chance of landing below the reserve to be told of [default: 5%]",
        read=quantities.fraction,
        kind=Kind.QUANTITY,
    ),
    Setting(
        key="select",
        option="--select",
        metavar="CODES",
        meaning="report only these codes, or codes that begin so; commas, repeatable",
        read=_codes,
        kind=Kind.TEXTS,
        choices=catalogue.entries,
    ),
    Setting(
        key="extend_select",
        option="--extend-select",
        metavar="CODES",
        meaning="report these codes too, whatever --select and --ignore say",
        read=_codes,
        kind=Kind.TEXTS,
        choices=catalogue.entries,
    ),
    Setting(
        key="ignore",
        option="--ignore",
        metavar="CODES",
        meaning="do not report these codes, or codes that begin so; commas, repeatable",
        read=_codes,
        kind=Kind.TEXTS,
        choices=catalogue.entries,
    ),
    Setting(
        key="baseline",
        option="--baseline",
        metavar="FILE",
        meaning="do not report the findings in this file, which --write-baseline wrote",
        read=Path,
        kind=Kind.PATH,
    ),
    Setting(
        key="fail_on",
        option="--fail-on",
        metavar="error|warning",
        meaning="how bad a finding makes a no-go [default: error]",
        read=_severity,
        choices=lambda: SEVERITIES,
    ),
)
"""What decides whether a mission is a go."""

FLEET_SETTINGS = (
    Setting(
        key="separation_m",
        option="--separation",
        metavar="M",
        meaning="the missions fly at the same time and keep this distance from each other "
        "[default: they do not]",
        read=quantities.separation_m,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="min_nav_alt_m",
        option="--min-nav-alt",
        metavar="M",
        meaning="with --separation: two are not judged while both are lower above their take-off or "
        "landing places [default: 2.5]",
        read=quantities.min_nav_alt_m,
        kind=Kind.NUMBER,
    ),
    Setting(
        key="start_error_s",
        option="--start-error",
        metavar="S",
        meaning="with --separation: each may start so much sooner or later [default: 0]",
        read=quantities.start_s,
        kind=Kind.NUMBER,
    ),
)
"""What holds for the missions of a call that fly at the same time."""

START = Setting(
    key="starts_s",
    option="--start",
    metavar="S,S,…",
    meaning="with --separation: when each mission starts, in their order [default: all at once]",
    read=quantities.starts_s,
)
"""What only the command line gives, because it counts the missions of the call."""

REPORT_SETTINGS = (
    Setting(
        key="format",
        option="--format",
        metavar="|".join(FORMATS),
        meaning="format of the report [default: text]",
        read=_format,
        choices=lambda: FORMATS,
    ),
    Setting(
        key="output",
        option="--output",
        metavar="FILE",
        meaning="write the report to a file instead of standard output",
        read=Path,
        kind=Kind.PATH,
    ),
    Setting(
        key="trace",
        option="--trace",
        metavar="FILE.csv",
        meaning="write the flight of a single mission, sampled over time, to a file",
        read=Path,
        kind=Kind.PATH,
    ),
    Setting(
        key="report",
        option="--report",
        metavar="FILE.html",
        meaning="write a page with pictures of all missions that opens in any browser, offline "
        "(needs mavjoule[report])",
        read=Path,
        kind=Kind.PATH,
    ),
    Setting(
        key="plots",
        option="--plots",
        metavar="DIR",
        meaning="draw map, altitude, speed, power and energy of a single mission into a folder, as SVG "
        "and PNG (needs mavjoule[report])",
        read=Path,
        kind=Kind.PATH,
    ),
    Setting(
        key="statistics",
        option="--statistics/--no-statistics",
        metavar="",
        meaning="count the findings by code; with the formats text and json [default: no]",
        read=bool,
        kind=Kind.SWITCH,
    ),
    Setting(
        key="exit_zero",
        option="--exit-zero/--no-exit-zero",
        metavar="",
        meaning="exit with 0 even where a mission is a no-go [default: no]",
        read=bool,
        kind=Kind.SWITCH,
    ),
)
"""What holds for a whole call: where its report goes, and how."""

FILE_SETTINGS = (
    Setting(
        key="per_file_ignores",
        option="",
        metavar="",
        meaning="codes not to report of some files, or of an item: 'site.plan#12'",
        read=_codes,
        kind=Kind.TABLE,
    ),
)
"""What only a configuration holds."""

SETTINGS = {
    setting.key: setting
    for setting in (
        *FLIGHT_SETTINGS,
        *BUDGET_SETTINGS,
        *FLEET_SETTINGS,
        *REPORT_SETTINGS,
        *FILE_SETTINGS,
    )
}
