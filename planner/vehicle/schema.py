"""The schema of model files, version 1: the one place that says what a model file may hold."""

from __future__ import annotations

from planner.autopilot import Autopilot
from planner.vehicle.consistency import (
    battery_problems,
    cruise_problems,
    log_problems,
    validity_problems,
    vertical_problems,
)
from planner.vehicle.keys import Key, Kind, Table
from planner.vehicle.response_schema import RESPONSE_TABLES, RESPONSES

SCHEMA_VERSION = 1

NOT_GIVEN = "not-given"
"""What a model file writes where its source gives no power: said, not left out."""

VERSION = Key(name="schema", kind=Kind.INTEGER, meaning=f"version of this schema: {SCHEMA_VERSION}")
"""Read before everything else: the rest means something only in a known version."""

TOP = Table(
    name="",
    meaning="Top of the file.",
    required=True,
    keys=(
        Key(name="name", kind=Kind.TEXT, meaning="must equal the file name without .toml"),
        Key(name="kind", kind=Kind.TEXT, meaning="kind of vehicle", choices=("multicopter",)),
        Key(
            name="reference",
            kind=Kind.TEXT,
            meaning="who shapes the reference the model answers: step (nobody), px4, ardupilot",
            choices=tuple(Autopilot),
        ),
        Key(name="description", kind=Kind.TEXT, meaning="one or two sentences for a pilot"),
        Key(
            name="mass_kg",
            kind=Kind.NUMBER,
            unit="kg",
            meaning="take-off mass with battery, without payload",
            required=False,
            above=0.0,
        ),
    ),
)

SPEED = Table(
    name="speed",
    meaning=(
        "Speed the vehicle flies at when a mission commands none.  Required with reference = "
        '"step"; refused otherwise, where it is an autopilot parameter.'
    ),
    keys=(Key(name="default_m_s", kind=Kind.NUMBER, unit="m/s", meaning="speed", above=0.0),),
)

ALTITUDE_LAW = Table(
    name="hover",
    meaning=(
        "Hover power over height: P = coefficient_w x H^exponent, H the height above home, held "
        "constant below lowest_height_m."
    ),
    required=True,
    selector=("law", "altitude-power"),
    keys=(
        Key(name="coefficient_w", kind=Kind.NUMBER, unit="W", meaning="power at 1 m", above=0.0),
        Key(
            name="exponent",
            kind=Kind.NUMBER,
            meaning="exponent of the height",
            at_least=-1.0,
            at_most=1.0,
        ),
        Key(
            name="lowest_height_m",
            kind=Kind.NUMBER,
            unit="m",
            meaning="height below which the power is held constant",
            above=0.0,
        ),
    ),
)

DENSITY_LAW = Table(
    name="hover",
    meaning=(
        "Hover power over mass and air density: P = hover_power_w x (m / reference_mass_kg)^"
        "mass_exponent x (rho / reference_density_kg_m3)^density_exponent.  Momentum theory has "
        "exponents 1.5 and -0.5.  Needs mass_kg at the top of the file."
    ),
    required=True,
    selector=("law", "density"),
    keys=(
        Key(
            name="hover_power_w",
            kind=Kind.NUMBER,
            unit="W",
            meaning="power at the reference mass and density",
            above=0.0,
        ),
        Key(name="reference_mass_kg", kind=Kind.NUMBER, unit="kg", meaning="mass", above=0.0),
        Key(
            name="reference_density_kg_m3",
            kind=Kind.NUMBER,
            unit="kg/m³",
            meaning="air density",
            above=0.0,
            at_most=2.0,
        ),
        Key(
            name="mass_exponent",
            kind=Kind.NUMBER,
            meaning="exponent of the mass ratio",
            at_least=0.0,
            at_most=3.0,
        ),
        Key(
            name="density_exponent",
            kind=Kind.NUMBER,
            meaning="exponent of the density ratio, not positive",
            at_least=-2.0,
            at_most=0.0,
        ),
    ),
)

_CURVE_POWER = Key(
    name="power_above_hover_w",
    kind=Kind.NUMBERS,
    unit="W",
    meaning="steady power minus hover power",
    least_count=2,
)

CRUISE = Table(
    name="cruise",
    meaning="Steady power in level flight over airspeed, as a table.",
    required=True,
    selector=("power", "table"),
    keys=(
        Key(
            name="speed_m_s",
            kind=Kind.NUMBERS,
            unit="m/s",
            meaning="airspeeds, rising",
            at_least=0.0,
            least_count=2,
            is_rising=True,
        ),
        _CURVE_POWER,
    ),
    cross_check=cruise_problems,
)

CRUISE_NOT_GIVEN = Table(
    name="cruise",
    meaning=(
        "The source of the model gives no cruise power: the planner takes hover power and says so "
        "in a finding."
    ),
    required=True,
    selector=("power", NOT_GIVEN),
)

VERTICAL = Table(
    name="vertical",
    meaning="Steady power in vertical flight over climb rate, as a table; optional.",
    keys=(
        Key(
            name="climb_rate_m_s",
            kind=Kind.NUMBERS,
            unit="m/s",
            meaning="climb rates, rising, descent negative",
            least_count=2,
            is_rising=True,
        ),
        _CURVE_POWER,
    ),
    cross_check=vertical_problems,
)

BATTERY = Table(
    name="battery",
    meaning=(
        "The battery the vehicle flies with; optional, --battery replaces it.  Give an energy, "
        "or a charge and the nominal voltage; an energy alone leaves the charge unknown."
    ),
    keys=(
        Key(
            name="capacity_ah",
            kind=Kind.NUMBER,
            unit="Ah",
            meaning="charge of the full battery",
            required=False,
            above=0.0,
        ),
        Key(
            name="capacity_wh",
            kind=Kind.NUMBER,
            unit="Wh",
            meaning="energy of the full battery",
            required=False,
            above=0.0,
        ),
        Key(
            name="nominal_voltage_v",
            kind=Kind.NUMBER,
            unit="V",
            meaning="energy over charge of the full battery",
            required=False,
            above=0.0,
        ),
        Key(
            name="cells_in_series",
            kind=Kind.INTEGER,
            meaning="number of cells in series",
            required=False,
            at_least=1,
            at_most=400,
        ),
        Key(
            name="internal_resistance_ohm",
            kind=Kind.NUMBER,
            unit="ohm",
            meaning="resistance of the whole battery",
            required=False,
            at_least=0.0,
        ),
        Key(
            name="ocv_soc",
            kind=Kind.NUMBERS,
            meaning="states of charge, rising from 0 to 1",
            required=False,
            at_least=0.0,
            at_most=1.0,
            least_count=2,
            is_rising=True,
        ),
        Key(
            name="ocv_v",
            kind=Kind.NUMBERS,
            unit="V",
            meaning="open-circuit voltage at each ocv_soc, rising",
            required=False,
            above=0.0,
            least_count=2,
            is_rising=True,
        ),
        Key(
            name="cutoff_voltage_v",
            kind=Kind.NUMBER,
            unit="V",
            meaning="voltage under load at which the battery counts as empty",
            required=False,
            above=0.0,
        ),
    ),
    cross_check=battery_problems,
)

PARAMETERS = Table(
    name="parameters",
    meaning=(
        "Autopilot parameters by their own names and in their own units, for example "
        "WPNAV_SPEED = 1000; used where no parameter file is given.  Only with reference = "
        '"px4" or "ardupilot".'
    ),
    is_free=True,
)

VALID_FOR = Table(
    name="valid_for",
    meaning="The box in which the model holds; outside it the planner says so or refuses.",
    required=True,
    keys=tuple(
        Key(
            name=name,
            kind=Kind.INTERVAL,
            unit=unit,
            meaning=meaning,
            required=False,
            at_least=at_least,
        )
        for name, unit, meaning, at_least in (
            ("speed_m_s", "m/s", "airspeed", 0.0),
            ("height_above_home_m", "m", "height above home", None),
            ("hover_height_above_home_m", "m", "heights at which hover power was measured", None),
            ("altitude_step_m", "m", "altitude change commanded at once", 0.0),
            ("climb_rate_m_s", "m/s", "climb rate, descent negative", None),
            ("mass_kg", "kg", "mass with payload", 0.0),
            ("air_density_kg_m3", "kg/m³", "air density", 0.0),
        )
    ),
    cross_check=validity_problems,
)

PROVENANCE = Table(
    name="provenance",
    meaning="Where the numbers come from.",
    required=True,
    keys=(
        Key(name="source", kind=Kind.TEXT, meaning="article, or whose vehicle and flights"),
        Key(name="method", kind=Kind.TEXT, meaning="how the numbers were found"),
        Key(name="date", kind=Kind.DATE, meaning="day the model file was made"),
        Key(
            name="readings",
            kind=Kind.TEXTS,
            meaning="decisions taken where the source can be read in more than one way",
            required=False,
        ),
        Key(name="logs", kind=Kind.TEXTS, meaning="names of the flight logs used", required=False),
        Key(
            name="logs_sha256",
            kind=Kind.TEXTS,
            meaning="SHA-256 of each log, in hexadecimal",
            required=False,
        ),
    ),
    cross_check=log_problems,
)

FIT = Table(
    name="provenance.fit",
    meaning="Figures of the fit by name, for example power_rmse_w; optional.",
    is_free=True,
)


SCHEMA = (
    TOP,
    SPEED,
    ALTITUDE_LAW,
    DENSITY_LAW,
    RESPONSES,
    *RESPONSE_TABLES.values(),
    CRUISE_NOT_GIVEN,
    CRUISE,
    VERTICAL,
    BATTERY,
    PARAMETERS,
    VALID_FOR,
    PROVENANCE,
    FIT,
)
"""Every table of a model file; tables of one name are variants, of which the file selects one."""
