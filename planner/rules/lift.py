"""Rules on the thrust: whether the vehicle has what it takes to hover, in what air and with what load."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3, standard_density_kg_m3
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT, EXTREMES, POWER, PX4, Need, NotEvaluated, judges
from planner.units import GRAVITY_M_S2
from planner.values import Value
from planner.vehicle.model import NO_LEAN_THRUST
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.flight.power import SteadyPower
    from planner.flight.prediction import Extremes
    from planner.rules.assessment import Assessment
    from planner.vehicle.declared import Interval
    from planner.vehicle.parameters.resolve import FlightParameters

_MOST_HOVER_THRUST = 0.7
"""Fraction of the thrust above which a hover leaves too little for control. [-]"""
_SINKING_THRUST = math.cos(math.radians(30.0))
"""Fraction of the thrust from which on a vehicle that leans by 30°, the greatest lean of ArduPilot's
defaults, sinks. [-]"""
_MOST_LEARNT = 0.6875
"""The highest MOT_THST_HOVER that ArduPilot learns: its AP_MOTORS_THST_HOVER_MAX. [-]"""
_LEAST_SPIN_MAX, _USUAL_SPIN_MAX = 0.9, 0.95
"""MOT_SPIN_MAX: the least of its documented values, and its default. [-]"""
_LEAST_LEAN_RAD = math.radians(10.0)
"""What ArduPilot leaves of the lean however much a hover takes: its AC_ATTITUDE_CONTROL_ANGLE_LIMIT_MIN."""
_SAME_NUMBER = 1e-6
"""Numbers this near are one: files write them in single precision. [-]"""
_AIR_SLACK = 1.02
"""Thrust a little beyond what a data sheet stands for is taken: 2 % of density. [-]"""
_USUAL_AIR = 1.05
"""Thrust over that at sea level up to which a maker's masses are flown all the same: that of 500 m or 29 °C.
[-]"""
_MOST_HOVER = 0.6
"""Fraction of its thrust that a vehicle hovers with as a rule, at most, as the prior thrust_ratio has it:
ArduPilot's guide finds MOT_THST_HOVER between 0.2 and 0.6 (copter/source/docs/ac_throttlemid.rst). [-]"""
_MOST_LIFT = NO_LEAN_THRUST / _MOST_HOVER
"""More thrust, in times of that of the model's flights, is not taken for granted: a vehicle that flew them
with the most that is usual has no lean left beyond it.  As much as those of data sheets may. [-]"""
_SAME_MASS = 1e-9
"""Two masses that are the same but for the arithmetic. [-]"""
_STATE_THRUST = (
    "carry less, fly lower, or state the thrust of its motors (thrust_max_n in the model, mavjoule vehicle "
    "new --motor)"
)

HOVER_POWER_IMPOSSIBLE = Rule(
    "E132 hover-power-impossible",
    Severity.ERROR,
    summary="The model hovers on less power than any multicopter: its energies are too low.",
    why="A hover power read at another voltage, of one battery of two, or of a lighter vehicle makes every "
    "flight look short of its energy, and the vehicle comes down before it is home.",
    how="Of models by momentum theory without flights: 1 / (induced_factor + profile_factor), the power of "
    "the ideal disk over that of the battery in hover, is above 0.75.  The best published multicopter has "
    "0.65; a figure of merit of 0.8 and motors and controllers of 0.9 give 0.72.",
    fix="measure the hover power, the mass and the propellers again, or log a flight and run mavjoule "
    "vehicle refine",
    instead="--vehicle",
)


@judges(HOVER_POWER_IMPOSSIBLE)
def _hover_power_impossible(a: Assessment) -> Iterator[Finding]:
    law, basis = a.vehicle.cruise, a.vehicle.provenance.basis
    if not isinstance(law, MomentumLaw) or (basis is not None and basis.is_flown):
        return
    from planner.vehicle.priors import hover_impossible

    if does := hover_impossible(law.induced_factor + law.profile_factor):
        yield a.finding(HOVER_POWER_IMPOSSIBLE, f"the hover of {a.vehicle.name} {does}")


HOVER_THROTTLE_HIGH = Rule(
    "E116 hover-throttle-high",
    Severity.WARNING,
    summary="The vehicle needs most of its thrust to hover.",
    why="A vehicle that hovers at three quarters of its throttle has little left to climb or to stay "
    "upright with, less still as the battery sags: 77 % at the take-off nearly lost one (ArduPilot "
    "#5244).  From 80 % on ArduPilot leaves it no lean angle but its least "
    "(AC_ATTITUDE_CONTROL_ANGLE_LIMIT_THROTTLE_MAX); from 87 % on, 1/cos 30° below all, it sinks where "
    "it leans by 30°.",
    how="MOT_THST_HOVER, or MPC_THR_HOVER over MPC_THR_MAX, where the parameter file or the model gives it, "
    "or, where it is more, the throttle that the flights of an ArduPilot model hovered with, times the "
    "mass with payload over that without, times the densest air of [valid_for], 1.225 kg/m³ at most, "
    "over the air at the highest point of the flight, if that is thinner; late in the flight also times "
    "(V_full / V)² for the lowest voltage under load at the end of a segment, of the flight or of a "
    "return, where the battery's curve is known.  Or, where it is more, the weight with payload over "
    "thrust_max_n of the model, in the air at the highest point.  With neither it is not checked.  A "
    "warning above 0.7; an error from 0.8 on with a full battery, from 0.87 on late in the flight, and "
    "on ArduPilot where acos(thrust / 0.8), the lean a full battery leaves, does not hold the wind, its "
    "mean and two standard deviations, by the tangents of that and of the greatest lean.  The "
    "autopilot's own default (0.35, 0.5), which a file saved whole has of a vehicle nobody hovered, says "
    "nothing of how the thrust falls with the voltage; with a lower MPC_THR_MAX it is not checked "
    "(X904).  Nor with a MOT_SPIN_MAX below 0.9, the least of its documented values, where the thrust "
    "that it leaves of that with 0.95 does not cover the hover: nobody knows which of the two the hover "
    "was measured with; not above MOT_SPIN_MIN is an error.  Nor with a MOT_THST_HOVER of 0.6875, the "
    "most that ArduPilot learns, where neither a flight of the model nor its thrust_max_n says how much "
    "more it is.",
    fix="carry less, fly lower or shorter, or use a battery that sags less",
    instead="--payload, or the parameters of --params",
)


class _HoverThrust(Value):
    """What a hover takes of the thrust, with the load and in the thinnest air of the flight."""

    fraction: float
    """With a full battery. [-]"""
    is_measured: bool
    """Whether it says how the thrust falls with the voltage: a default does not."""


def _hover_thrust(a: Assessment) -> _HoverThrust | None:
    """Return what a hover takes of the thrust; ``None`` where nothing tells it, or the default alone."""
    parameters, most_n, mass_kg = a.own_parameters, a.vehicle.thrust_max_n, a.flight.power.mass_kg
    fractions = [] if parameters is None else [*_by_throttle(a, parameters)]
    if most_n is not None and mass_kg is not None:
        thinnest_kg_m3 = float(a.flight.power.air_density_kg_m3(float(a.reach.height_m.max())))
        thinner = max(SEA_LEVEL_DENSITY_KG_M3 / thinnest_kg_m3, 1.0)
        fraction = mass_kg * GRAVITY_M_S2 / most_n * thinner
        fractions.append(_HoverThrust(fraction=fraction, is_measured=True))
    return max(fractions, key=lambda one: one.fraction, default=None)


def _by_throttle(a: Assessment, parameters: FlightParameters) -> Iterator[_HoverThrust]:
    """Yield what a hover takes by the throttle in the parameters and by that of the flights of the model."""
    flown, times_more = _flown_throttle(a), _times_heavier(a) * _times_thinner(a)
    if flown is not None:
        yield _HoverThrust(fraction=flown * times_more, is_measured=True)
    origin = parameters.origins.get("hover_throttle")
    if (origin is None or origin.is_default) and _most_throttle(a) >= 1.0:
        return  # the default is of no vehicle in particular; under a lower MPC_THR_MAX it must be known
    is_measured = not _is_default_throttle(parameters, parameters.hover_throttle)
    if is_measured or flown is None:
        fraction = parameters.hover_throttle / max(_most_throttle(a), 1e-9) * times_more
        yield _HoverThrust(fraction=fraction, is_measured=is_measured)


def _is_default_throttle(parameters: FlightParameters, throttle: float) -> bool:
    from planner.vehicle.parameters.table import parameter_table

    untouched = parameter_table(type(parameters))["hover_throttle"].default_si
    return math.isclose(throttle, untouched, rel_tol=_SAME_NUMBER)


def _flown_throttle(a: Assessment) -> float | None:
    """Return the throttle the flights of a model of ArduPilot hovered with; ``None`` where none tells it.

    A parameter file may be older than what ArduPilot learnt in them.
    """
    parameters, basis = ARDUPILOT.of(a), a.vehicle.provenance.basis
    throttle = dict(a.vehicle.parameters).get("MOT_THST_HOVER")
    if parameters is None or throttle is None or basis is None or not basis.is_flown:
        return None
    return None if _is_default_throttle(parameters, throttle) else throttle


def _most_throttle(a: Assessment) -> float:
    return 1.0 if PX4.of(a) is None else numbers(a).get("MPC_THR_MAX", 1.0)


def measured_thrust(a: Assessment) -> _HoverThrust | None:
    """Return what a hover takes of the thrust; ``None`` where nobody measured it."""
    thrust = _hover_thrust(a)
    return thrust if thrust is not None and thrust.is_measured else None


THRUST: Need[_HoverThrust] = Need(
    "the vehicle's thrust: thrust_max_n in the model, or its measured hover throttle by --params",
    measured_thrust,
)


@judges(HOVER_THROTTLE_HIGH, needs=(THRUST,))
def _thrust_is_known(_a: Assessment, _thrust: _HoverThrust) -> Iterator[Finding]:
    return iter(())  # what follows from it is found below; that it is missing stands in the ledger


@judges(HOVER_THROTTLE_HIGH)
def _hover_throttle_capped(a: Assessment) -> Iterator[NotEvaluated]:
    parameters = ARDUPILOT.of(a)
    if parameters is None or a.vehicle.thrust_max_n is not None:
        return
    is_most = math.isclose(parameters.hover_throttle, _MOST_LEARNT, rel_tol=_SAME_NUMBER)
    if is_most and not (_flown_throttle(a) or 0.0) > _MOST_LEARNT * (1.0 + _SAME_NUMBER):
        yield NotEvaluated(
            rule=HOVER_THROTTLE_HIGH,
            needs="the throttle this vehicle hovers at, as CTUN.ThO of its log: ArduPilot learns no more",
            asked_by=f"MOT_THST_HOVER of {_MOST_LEARNT:g}",
        )


@judges(HOVER_THROTTLE_HIGH, needs=(EXTREMES,))
def _hover_throttle_high(a: Assessment, _extremes: Extremes) -> Iterator[Finding | NotEvaluated]:
    parameters, thrust = a.own_parameters, _hover_thrust(a)
    if parameters is not None:
        spins = _thrust_left(numbers(a)) if PX4.of(a) is None else 1.0
        if spins < 1.0 and parameters.hover_throttle >= _SINKING_THRUST * spins:
            yield _spins_slowly(a, parameters.hover_throttle, spins)
            return
    if thrust is None:
        return
    full = thrust.fraction
    if parameters is not None and not thrust.is_measured and full > _MOST_HOVER_THRUST:
        most = _most_throttle(a)
        if most < 1.0:
            yield NotEvaluated(
                rule=HOVER_THROTTLE_HIGH,
                needs="the throttle this vehicle hovers at; MPC_THR_HOVER is PX4's default",
                asked_by=f"MPC_THR_MAX of {most:g}",
            )
            return
    late, lowest = full, None
    voltage = "with a full battery"
    if (
        thrust.is_measured
        and a.discharge is not None
        and a.pack is not None
        and a.pack.ocv_v is not None
    ):
        segment = int(np.argmin(a.discharge.voltage_v))
        lowest, voltage_v = a.item_of(segment), float(a.discharge.voltage_v[segment])
        enough_v = a.pack.ocv_v[-1] * math.sqrt(full / _MOST_HOVER_THRUST)
        if voltage_v > enough_v and a.returns_stay_above(enough_v):
            return
        back, sample = a.return_discharge, a.returns.sample
        if back is not None and sample is not None and back.end_voltage_v.min() < voltage_v:
            point = int(np.argmin(back.end_voltage_v))
            voltage_v = float(back.end_voltage_v[point])
            lowest = a.item_of(sample.points.segment[point])
        late = full * (a.pack.ocv_v[-1] / voltage_v) ** 2
        voltage = f"at {quantity.decimals(voltage_v, 1)} V, {quantity.percent(full)} when full"
    if max(full, late) > _MOST_HOVER_THRUST:
        cannot = full >= NO_LEAN_THRUST or late >= _SINKING_THRUST
        carried_off = "" if cannot else _carried_off(a, full)
        yield a.finding(
            HOVER_THROTTLE_HIGH,
            f"hovering takes {quantity.percent(late)} of the thrust {voltage}"
            + (": it cannot hold its height and place" if cannot else carried_off),
            severity=Severity.ERROR if cannot or carried_off else None,
            item=lowest,
        )


def _carried_off(a: Assessment, hover: float) -> str:
    """Return that ArduPilot keeps too little lean for the wind, with a hover of this much thrust; or nothing.

    Notes
    -----
    ``AC_AttitudeControl_Multi::update_althold_lean_angle_max``: acos(hover / 0.8), of which
    ``get_althold_lean_angle_max`` leaves 10° in any case.
    """
    parameters = ARDUPILOT.of(a)
    if parameters is None:
        return ""
    lean_rad = max(math.acos(min(hover / NO_LEAN_THRUST, 1.0)), _LEAST_LEAN_RAD)
    airspeed_m_s = a.highest_airspeed_m_s
    if airspeed_m_s is None or lean_rad >= parameters.lean_angle_max_rad:
        return ""
    left_m_s = airspeed_m_s * math.tan(lean_rad) / math.tan(parameters.lean_angle_max_rad)
    gust_m_s = float(a.reach.gust_m_s(a.setup.wind).max())
    if gust_m_s <= left_m_s:
        return ""
    return (
        f": that leaves {quantity.decimals(math.degrees(lean_rad), 0)}° of lean, for "
        f"{quantity.speed(left_m_s)} of airspeed, in {quantity.speed(gust_m_s)} of wind"
    )


def _thrust_left(values: Mapping[str, float]) -> float:
    """Return the greatest thrust with MOT_SPIN_MAX over that with its default. [-]

    Notes
    -----
    ``AP_MotorsMulticopter::thrust_to_actuator``: of the range above MOT_SPIN_MIN a share u gives the thrust
    (1 − MOT_THST_EXPO) u + MOT_THST_EXPO u².
    """
    idle = values.get("MOT_SPIN_MIN", 0.15)
    expo = min(max(values.get("MOT_THST_EXPO", 0.65), -1.0), 1.0)
    spins = values.get("MOT_SPIN_MAX", _USUAL_SPIN_MAX)
    if spins >= _LEAST_SPIN_MAX:
        return 1.0
    if spins <= idle:
        return 0.0
    share = (spins - idle) / (_USUAL_SPIN_MAX - idle)
    return (1.0 - expo) * share + expo * share**2


def _spins_slowly(a: Assessment, hover: float, left: float) -> Finding | NotEvaluated:
    """Return that the motors may never lift the vehicle."""
    spins = f"MOT_SPIN_MAX of {numbers(a)['MOT_SPIN_MAX']:g}"
    if left <= 0.0:
        return a.finding(
            HOVER_THROTTLE_HIGH,
            f"{spins} is not above MOT_SPIN_MIN: full throttle spins the motors no faster than idle, the "
            "vehicle does not take off",
            severity=Severity.ERROR,
        )
    return NotEvaluated(
        rule=HOVER_THROTTLE_HIGH,
        asked_by=f"{spins} (leaves {quantity.percent(left)} of the thrust, a hover takes "
        f"{quantity.percent(hover)})",
        needs=f"MOT_SPIN_MAX of {_LEAST_SPIN_MAX:g} or more, or a MOT_THST_HOVER learnt with it that leaves "
        "more thrust",
    )


def _times_heavier(a: Assessment) -> float:
    """Return the mass that flies over that of the model. [-]"""
    if not a.vehicle.mass_kg or not a.flight.power.mass_kg:
        return 1.0
    return a.flight.power.mass_kg / a.vehicle.mass_kg


def _times_thinner(a: Assessment) -> float:
    """Return the air the hover throttle may be known in over the thinnest of the flight, 1 at least. [-]"""
    limit = a.vehicle.valid_for.air_density_kg_m3
    known_kg_m3 = _densest_kg_m3(limit)
    thinnest = a.flight.power.air_density_kg_m3(float(a.reach.height_m.max()))
    return max(known_kg_m3 / float(thinnest), 1.0)


def _densest_kg_m3(known: Interval | None) -> float:
    """Return the densest air a vehicle is held to have flown in: data sheets stand for any cold. [kg m⁻³]"""
    return SEA_LEVEL_DENSITY_KG_M3 if known is None else min(known.high, SEA_LEVEL_DENSITY_KG_M3)


LIFT_UNKNOWN = Rule(
    "E120 lift-unknown",
    Severity.ERROR,
    summary="The flight takes far more thrust than the flights the model was identified on.",
    why="A model's power keeps growing where the vehicle no longer leaves the ground: it has no limit "
    "of thrust (ArduPilot #5244: nearly lost at 77 % of the throttle).",
    how="Mass over air density, at the highest point of the flight with payload, over that of a flight the "
    "model knows: more than 1.33 (thrust falls with air density as weight grows), for a hover with 0.6 of "
    "the thrust, the most that is usual, then takes the 0.8 from which on ArduPilot has no lean left.  Of "
    "the ranges of [valid_for] nobody knows which of both were flown together: it flew the heaviest in its "
    "densest air, 1.225 kg/m³ at most, and the lightest in its thinnest; the more counts.  Without a range "
    "the model's own mass, in 1.225 kg/m³.  Of a model from a data sheet nobody flew anything: it is held to "
    "lift the heaviest of [valid_for], its maker's highest take-off mass or 1.33 times that of the sheet, in "
    "1.225 kg/m³, and its own mass in the thinnest air of it; no more than that, up to 5 % more for the air "
    "a warning (500 m, or 29 °C at sea level).  Where thrust_max_n or a measured hover throttle tells the "
    "thrust E116 judges instead; how heavy one from a data sheet may be, with thrust_max_n alone.  And no "
    "vehicle more than mass_max_kg.",
    fix="carry less, fly lower, or record such a flight and run mavjoule identify",
    instead="--payload",
)


@judges(LIFT_UNKNOWN, needs=(POWER,))
def _heaviest(a: Assessment, power: SteadyPower) -> Iterator[Finding]:
    most_kg = a.vehicle.mass_max_kg
    mass_kg = power.mass_kg
    if most_kg is not None and mass_kg is not None and mass_kg > most_kg * (1.0 + _SAME_MASS):
        yield a.finding(
            LIFT_UNKNOWN,
            f"{quantity.beside(mass_kg, most_kg, quantity.mass)} at take-off; its maker allows "
            f"{quantity.mass(most_kg)} at most",
            fix="carry less",
        )


ABOVE_CEILING = Rule(
    "E133 above-ceiling",
    Severity.WARNING,
    summary="The vehicle takes off from higher than its maker allows.",
    why="In thin air rotors and battery give less than it takes to hold the vehicle up and against the "
    "wind; its maker says up to where it tried that.",
    how="Home above ceiling_amsl_m of the model (mavjoule vehicle new --ceiling).  An error where the air at "
    "home is more than 2 % thinner than standard air at that altitude, and neither thrust_max_n nor a "
    "measured hover throttle tells the thrust, by which E116 judges.",
    fix="take off from lower, or state the thrust of its motors (thrust_max_n in the model)",
    instead="a take-off below the ceiling, or thrust_max_n in the model",
)


@judges(ABOVE_CEILING, needs=(POWER,))
def _above_ceiling(a: Assessment, power: SteadyPower) -> Iterator[Finding]:
    ceiling_m, home_m = a.vehicle.ceiling_amsl_m, a.route.home_amsl_m
    if ceiling_m is None or not a.route.knows_home_amsl or home_m <= ceiling_m:
        return
    allowed_kg_m3, here_kg_m3 = (
        standard_density_kg_m3(ceiling_m),
        float(power.air_density_kg_m3(0.0)),
    )
    is_too_thin = here_kg_m3 * _AIR_SLACK < allowed_kg_m3 and measured_thrust(a) is None
    yield a.finding(
        ABOVE_CEILING,
        f"take-off at {quantity.beside(home_m, ceiling_m, quantity.height)} AMSL; its maker allows it up to "
        f"{quantity.height(ceiling_m)}",
        severity=Severity.ERROR if is_too_thin else None,
    )


@judges(LIFT_UNKNOWN, needs=(EXTREMES, POWER))
def _lift(a: Assessment, extremes: Extremes, power: SteadyPower) -> Iterator[Finding]:
    thin_kg_m3 = float(power.air_density_kg_m3(extremes.highest_m))
    if _is_of_sheet(a):
        yield from _beyond_sheet(a, thin_kg_m3)
    elif is_lift_unknown(a, thin_kg_m3):
        load = "the flight" if power.mass_kg is None else quantity.mass(power.mass_kg)
        lifted = _times_lifted(a, thin_kg_m3)
        yield a.finding(
            LIFT_UNKNOWN,
            f"{load} in air of {quantity.decimals(thin_kg_m3, 2)} kg/m³ needs "
            f"{quantity.beside(lifted, _MOST_LIFT, times_text)} the thrust of the flights the model was "
            "identified on: whether the vehicle has it is unknown",
        )


def is_lift_unknown(a: Assessment, thin_kg_m3: float) -> bool:
    """Return whether a flight takes more thrust in such air than those of the model, and nobody knows it."""
    return _times_lifted(a, thin_kg_m3) > _MOST_LIFT and measured_thrust(a) is None


def _times_lifted(a: Assessment, thin_kg_m3: float) -> float:
    """Return the thrust of a flight in such air over the most of those the model was identified on. [-]"""
    limit = a.vehicle.valid_for.air_density_kg_m3
    densest_kg_m3 = _densest_kg_m3(limit)
    thinner = thinnest_known_kg_m3(a) / thin_kg_m3
    times_heaviest, times_lightest = _times_heavier_than_flown(a)
    at_heaviest = times_heaviest * densest_kg_m3 / thin_kg_m3
    return min(at_heaviest, times_lightest * thinner)


def thinnest_known_kg_m3(a: Assessment) -> float:
    """Return the density of the thinnest air that a model stands for. [kg m⁻³]"""
    limit = a.vehicle.valid_for.air_density_kg_m3
    return SEA_LEVEL_DENSITY_KG_M3 if limit is None else limit.low


def _is_of_sheet(a: Assessment) -> bool:
    """Whether the thrust of the vehicle is known from its data sheet's masses alone."""
    basis, knows = a.vehicle.provenance.basis, a.vehicle.knows_mass and a.vehicle.knows_air_density
    return basis is not None and basis.is_sheet and knows and a.vehicle.thrust_max_n is None


def _beyond_sheet(a: Assessment, thin_kg_m3: float) -> Iterator[Finding]:
    """Find more mass, or thrust, than a data sheet stands for."""
    own_kg, mass_kg, limit = a.vehicle.mass_kg, a.flight.power.mass_kg, a.vehicle.valid_for.mass_kg
    if own_kg is None or mass_kg is None:
        return  # no law that knows the mass
    heaviest_kg = own_kg if limit is None else max(limit.high, own_kg)
    stated_kg = a.vehicle.mass_max_kg
    if mass_kg > heaviest_kg * (1.0 + _SAME_MASS):
        if stated_kg is None or mass_kg <= stated_kg:
            yield a.finding(
                LIFT_UNKNOWN,
                f"{quantity.beside(mass_kg, heaviest_kg, quantity.mass)} at take-off; nobody flew this "
                f"vehicle, and no more than {quantity.mass(heaviest_kg)} is taken for granted of one of "
                f"{quantity.mass(own_kg)}",
                fix=_STATE_THRUST,
            )
        return
    if measured_thrust(a) is not None:
        return  # somebody did fly it: HOVER_THROTTLE_HIGH judges the air by what it hovers with
    known = max(heaviest_kg / own_kg, SEA_LEVEL_DENSITY_KG_M3 / thinnest_known_kg_m3(a))
    lifted = mass_kg / own_kg * SEA_LEVEL_DENSITY_KG_M3 / thin_kg_m3
    if lifted > _AIR_SLACK * known:
        yield a.finding(
            LIFT_UNKNOWN,
            f"{quantity.mass(mass_kg)} in air of {quantity.decimals(thin_kg_m3, 2)} kg/m³ needs "
            f"{quantity.beside(lifted, known, times_text)} the thrust of {quantity.mass(own_kg)} at sea "
            f"level; nobody flew this vehicle, no more than {times_text(known)} is taken for granted",
            severity=Severity.WARNING if lifted <= _USUAL_AIR * known else None,
            fix=_STATE_THRUST,
        )


def _times_heavier_than_flown(a: Assessment) -> tuple[float, float]:
    """Return the mass that flies over the heaviest and the lightest the model was identified with."""
    vehicle, mass_kg = a.vehicle, a.flight.power.mass_kg
    limit, own_kg = vehicle.valid_for.mass_kg, vehicle.mass_kg
    lightest_kg, heaviest_kg = (own_kg, own_kg) if limit is None else (limit.low, limit.high)
    if not vehicle.knows_mass or mass_kg is None or lightest_kg is None or heaviest_kg is None:
        return 1.0, 1.0  # a payload that is not counted is E108's
    return mass_kg / heaviest_kg, mass_kg / lightest_kg


def times_text(ratio: float) -> str:
    """Return a ratio in words."""
    return f"{quantity.decimals(ratio, 1)} times"
