"""The schema of model files, version 1: the one place that says what a model file may hold."""

from __future__ import annotations

from planner.autopilot import Autopilot
from planner.vehicle.battery_schema import BATTERY
from planner.vehicle.consistency import log_problems, validity_problems
from planner.vehicle.keys import Key, Kind, Table
from planner.vehicle.power_schema import (
    ALTITUDE_LAW,
    CRUISE,
    CRUISE_NOT_GIVEN,
    DENSITY_LAW,
    DI_FRANCO_BUTTAZZO,
    HOVER_NOT_GIVEN,
    HOVER_OF_CRUISE,
    LIU,
    LOADS,
    MOMENTUM,
    VERTICAL,
)
from planner.vehicle.ramp_schema import RAMPS
from planner.vehicle.response_schema import RESPONSE_TABLES, RESPONSES
from planner.vehicle.spread_schema import SPREAD, STATE_SPREAD

SCHEMA_VERSION = 1

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
        Key(
            name="airspeed_limit_m_s",
            kind=Kind.NUMBER,
            unit="m/s",
            meaning="highest airspeed the vehicle can hold, at its lean limit; never inferred",
            required=False,
            above=0.0,
        ),
        Key(
            name="position_noise_m",
            kind=Kind.NUMBER,
            unit="m",
            meaning="mean error of the position in a hover, where none is given; slows PX4 down",
            required=False,
            at_least=0.0,
            at_most=1.5,
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
    HOVER_OF_CRUISE,
    HOVER_NOT_GIVEN,
    RESPONSES,
    *RESPONSE_TABLES.values(),
    RAMPS,
    CRUISE_NOT_GIVEN,
    CRUISE,
    MOMENTUM,
    LIU,
    DI_FRANCO_BUTTAZZO,
    VERTICAL,
    LOADS,
    BATTERY,
    PARAMETERS,
    VALID_FOR,
    SPREAD,
    STATE_SPREAD,
    PROVENANCE,
    FIT,
)
"""Every table of a model file; tables of one name are variants, of which the file selects one."""
