"""The part of the schema that describes power: hover, cruise, climb, what else is switched on."""

from __future__ import annotations

from planner.vehicle.consistency import (
    cruise_problems,
    momentum_problems,
    polynomial_problems,
    vertical_problems,
)
from planner.vehicle.keys import Key, Kind, Table

NOT_GIVEN = "not-given"
"""What a model file writes where its source gives no power: said, not left out."""


def _factor(name: str, meaning: str) -> Key:
    return Key(name=name, kind=Kind.NUMBER, meaning=meaning, at_least=0.0, at_most=20.0)


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

HOVER_OF_CRUISE = Table(
    name="hover",
    meaning=(
        "Hover power is that of the [cruise] law at rest: for a law that knows it, which are "
        "momentum, liu and di-franco-buttazzo."
    ),
    required=True,
    selector=("law", "of-cruise"),
)

HOVER_NOT_GIVEN = Table(
    name="hover",
    meaning=(
        "The power of the vehicle was not identified: time and distance are predicted, energy is not, "
        'and no mission is a go (E109).  Needs power = "not-given" under [cruise].'
    ),
    required=True,
    selector=("law", NOT_GIVEN),
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
    meaning=(
        "Steady power in level flight over airspeed, as a table; below its first speed in proportion "
        "to the speed, from hover power on."
    ),
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

MOMENTUM = Table(
    name="cruise",
    meaning=(
        "Steady power by momentum theory, over airspeed, climb rate, mass and air density: "
        "P = k_i T v_i + k_a T.V + k_p T v_h (1 + k_v (V_p / v_h)^2), thrust T against weight and "
        "drag, induced velocity v_i (v_h in hover), V_p the speed in the plane of the disk.  The "
        "factors are electrical watts for each watt of the ideal disk.  Needs mass_kg at the top."
    ),
    required=True,
    selector=("power", "momentum"),
    keys=(
        Key(
            name="disk_area_m2",
            kind=Kind.NUMBER,
            unit="m²",
            meaning="area of all rotor disks, as the fit sees it",
            above=0.0,
        ),
        Key(
            name="drag_area_m2",
            kind=Kind.NUMBER,
            unit="m²",
            meaning="drag coefficient times frontal area",
            at_least=0.0,
        ),
        _factor("induced_factor", "k_i, induced power"),
        _factor("axial_factor", "k_a, power of climb and drag"),
        _factor("profile_factor", "k_p, profile power in hover"),
        _factor("profile_speed_factor", "k_v, growth of profile power with speed"),
    ),
    cross_check=momentum_problems,
)

LIU = Table(
    name="cruise",
    meaning=(
        "Steady power by the five parameters of Liu, Sengupta and Kurzhanskiy (ICUAS 2017, equations "
        "14 and 15), over airspeed, climb rate and mass; it knows no air density.  For an IRIS+ of "
        "1.28 kg the parameters are quoted as 0.8554, 0.3051, 0.3177, 0.0296, 0.0279.  Needs mass_kg "
        "at the top."
    ),
    required=True,
    selector=("power", "liu"),
    keys=(
        Key(name="k1", kind=Kind.NUMBER, meaning="k₁", above=0.0),
        Key(name="k2_sqrt_kg_m", kind=Kind.NUMBER, unit="√(kg/m)", meaning="k₂", above=0.0),
        Key(name="c2_sqrt_m_kg", kind=Kind.NUMBER, unit="√(m/kg)", meaning="c₂", at_least=0.0),
        Key(name="c4_kg_m", kind=Kind.NUMBER, unit="kg/m", meaning="c₄, drag", at_least=0.0),
        Key(name="c5_kg_m", kind=Kind.NUMBER, unit="kg/m", meaning="c₅, lift", at_least=0.0),
    ),
)

DI_FRANCO_BUTTAZZO = Table(
    name="cruise",
    meaning=(
        "Steady power by the curve of Di Franco and Buttazzo (J. Intell. Robot. Syst. 83, 2016): a "
        "polynomial over airspeed, and the power of one climb and of one descent, from which other "
        "climb rates are counted in proportion.  It knows neither mass nor air density."
    ),
    required=True,
    selector=("power", "di-franco-buttazzo"),
    keys=(
        Key(
            name="coefficients",
            kind=Kind.NUMBERS,
            unit="W, W s/m, …",
            meaning="of level flight over airspeed, highest power first; the last is hover power",
            least_count=1,
            most_count=9,
        ),
        Key(name="climb_power_w", kind=Kind.NUMBER, unit="W", meaning="in the climb", above=0.0),
        Key(name="climb_speed_m_s", kind=Kind.NUMBER, unit="m/s", meaning="its rate", above=0.0),
        Key(name="descent_power_w", kind=Kind.NUMBER, unit="W", meaning="descending", above=0.0),
        Key(
            name="descent_speed_m_s",
            kind=Kind.NUMBER,
            unit="m/s",
            meaning="its rate, positive",
            above=0.0,
        ),
    ),
    cross_check=polynomial_problems,
)

VERTICAL = Table(
    name="vertical",
    meaning=(
        "Steady power in vertical flight over climb rate, as a table, added to that of [cruise]; "
        "optional, for laws that know no climb: table and not-given."
    ),
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

LOADS = Table(
    name="loads",
    meaning=(
        "What draws power besides flying; optional.  Without this table nothing is added in the air, "
        "and the seconds on the ground with turning rotors cost hover power."
    ),
    keys=(
        Key(
            name="avionics_w",
            kind=Kind.NUMBER,
            unit="W",
            meaning="avionics and payload electronics, added to every power of this file",
            at_least=0.0,
        ),
        Key(
            name="ground_idle_w",
            kind=Kind.NUMBER,
            unit="W",
            meaning="motors before lift-off and after touch-down, avionics not counted",
            at_least=0.0,
        ),
    ),
)
