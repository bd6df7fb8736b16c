"""Rules on the vehicle model: flight it was not identified on, conditions it does not model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.pilot import CONDITION_NOT_MODELLED, step_speeds_m_s
from planner.flight.reach import SituationKind
from planner.flight.returns.destination import SETTING_NOT_FOLLOWED, leads_along
from planner.mission.route.stage import StageKind
from planner.mission.route.walk import ITEM_NOT_MODELLED
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3, standard_density_kg_m3
from planner.quantity import mean_of, sd_of
from planner.rules.declaration import EXTREMES, FETCHED, POWER, PX4, NotEvaluated, judges
from planner.rules.lateness import HEIGHT_SLACK_M, OVERSHOOT
from planner.rules.lift import measured_thrust
from planner.rules.wind import known_text, shown_airspeed_text
from planner.vehicle.model import NO_LEAN_THRUST

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.fetched import FetchMark
    from planner.findings import Finding
    from planner.flight.power import SteadyPower
    from planner.flight.prediction import Extremes
    from planner.rules.assessment import Assessment
    from planner.rules.declaration import Found
    from planner.setup import Setup
    from planner.vehicle.parameters.px4 import Px4Parameters

_WITH_ALL = "; with all that is not counted"
_FAR = 2.0
"""A climb or descent so many times as fast as any identified is an error. [-]"""
_DENSITY_SLACK = 0.02
"""A density this much outside the identified ones is inside: 2 % of density is 1 % of power. [-]"""
_AIR_SLACK = 1.02
"""Thrust a little beyond what a data sheet stands for is taken: 2 % of density. [-]"""
_MOST_HOVER = 0.6
"""Fraction of its thrust that a vehicle hovers with as a rule, at most, as the prior thrust_ratio has it:
ArduPilot's guide finds MOT_THST_HOVER between 0.2 and 0.6 (copter/source/docs/ac_throttlemid.rst). [-]"""
_MOST_LIFT = NO_LEAN_THRUST / _MOST_HOVER
"""More thrust, in times of that of the model's flights, is not taken for granted: a vehicle that flew them
with the most that is usual has no lean left beyond it.  As much as those of data sheets may. [-]"""
_THINNER = 1.1
"""Thinness of air from which on it is said that it is not counted: 5 % of the power of a hover, the error
assumed of a model without a [spread] (E124); nor is it known in what air such a model flew. [-]"""

MODEL_OUTSIDE_ENVELOPE = Rule(
    "E105 model-outside-envelope",
    Severity.WARNING,
    summary="The flight leaves the range in which the model was identified.",
    why="A model is no evidence of flight it was not identified on.  A longer climb consists of "
    "manoeuvres inside the range and is only marked; a speed commanded beyond the range of a step-response "
    "model does not and is an error, as is a climb or descent twice as fast as any.  What an autopilot flies "
    "faster than any identified airspeed, over ground or for the wind, costs margin: power grows with the "
    "cube of the airspeed at most, or the vehicle is at the limit of its lean and arrives later.",
    how="Speeds commanded of step-response models, altitude steps and heights, and the airspeeds, climb "
    "rates, mass and air density of the predicted flight, of holds at any point of it (in the mean wind and "
    "two standard deviations) and of the returns from there against [valid_for] and the identified steps of "
    "the vehicle model; tolerances: 0.5 m of height, 3 % of a flown speed, 2 % of density.  Power measured "
    "higher up, or in other air, is only noted, so is air where the model states none.  At an airspeed V "
    "beyond the identified V_k the greater of two bounds counts: the power at V_k times (V / V_k)³, or the "
    "longer way at the airspeed V_k "
    "(airspeed_limit_m_s where the model has it; as for W103 where the parameters let it lean less); an "
    "error where that may take the margin.  Of a model with neither no speed is checked: X904.",
    fix="keep the mission inside the range, or log a flight beyond it and run mavjoule identify, or mavjoule "
    "vehicle refine for a model of a data sheet",
    instead="a model identified there with --vehicle",
)


def _outside(
    a: Assessment,
    what: str,
    limits: str,
    *,
    so: str = "",
    stay: str = "keep the mission inside the range",
    **given: Any,  # noqa: ANN401 - as `Assessment.finding` takes them
) -> Finding:
    """Return what is outside of a model: of the flights in it, or of what its data sheet holds for."""
    from planner.vehicle.law_factors import is_narrowable

    command = "vehicle refine" if is_narrowable(a.vehicle) else "identify"
    fix = f"{stay}, or log a flight beyond it and run mavjoule {command}"
    message = f"{what}; {known_text(a)} {limits}{so}"
    return a.finding(MODEL_OUTSIDE_ENVELOPE, message, **({"fix": fix} | given))


@judges(MODEL_OUTSIDE_ENVELOPE)
def _commanded_speeds(a: Assessment) -> Iterator[Found]:
    limit = a.vehicle.valid_for.speed_m_s
    if limit is None:
        fastest_m_s = float(a.reach.ground_speed_m_s.max())
        if a.vehicle.airspeed_limit_m_s is None and fastest_m_s > 0.0:
            yield NotEvaluated(
                rule=MODEL_OUTSIDE_ENVELOPE,
                needs="a vehicle model with speed_m_s under [valid_for], or with airspeed_limit_m_s",
                asked_by=f"a flight at {quantity.speed(fastest_m_s)}",
            )
        return
    if a.autopilot is not Autopilot.STEP:
        return  # judged as it is flown
    speeds, own_m_s = step_speeds_m_s(a.vehicle, a.own_parameters), a.vehicle.default_speed_m_s
    others = {*a.route.rows_of(StageKind.TAKEOFF, StageKind.DELAY)}
    level = (stage for row, stage in enumerate(a.route.stages) if row not in others)
    beyond = [
        (stage.speed_m_s, speed, stage.item)
        for stage in level
        if (speed := speeds.of(stage)) not in limit
        and (stage.speed_m_s is not None or speed != own_m_s)
    ]
    back_m_s = speeds.returning_m_s
    if not beyond and (back_m_s in limit or back_m_s == own_m_s):
        return
    highest = quantity.speed(limit.high)
    asked, fastest_m_s, _ = max(beyond, key=lambda one: one[1], default=(None, back_m_s, 0))
    by = "commanded" if asked is not None else "by the parameters"
    legs = quantity.count(len(beyond), "leg") if beyond else "returns"
    yield _outside(
        a,
        f"{quantity.speed(fastest_m_s)} {by}",
        f"from {quantity.decimals(limit.low, 1)} to {highest}",
        so=f": time and energy of {legs} are unreliable",
        stay=f"command {highest} or less",
        severity=Severity.ERROR,
        item=beyond[0][2] if beyond else None,
    )


@judges(ITEM_NOT_MODELLED)
def _vertical_speeds(a: Assessment) -> Iterator[Finding]:
    stages = a.route.stages
    if a.autopilot is not Autopilot.STEP or not any(
        stage.climb_speed_m_s or stage.descent_speed_m_s for stage in stages
    ):
        return
    columns = a.flight.motion.segments
    stage_of = a.returns.segment_stage
    for name, commanded, climbs in (
        ("climb", [stage.climb_speed_m_s for stage in stages], columns.climb_m),
        ("descent", [stage.descent_speed_m_s for stage in stages], -columns.climb_m),
    ):
        asked_m_s = np.array([np.nan if v is None else v for v in commanded])[stage_of]
        asked_m_s[[stages[row].kind is StageKind.LAND for row in stage_of]] = np.nan
        begun = np.flatnonzero((climbs > 0.0) & ~np.isnan(asked_m_s))
        if not len(begun):
            continue
        flown_m_s = climbs[begun] / columns.duration_s[begun]
        row = int(np.argmin(asked_m_s[begun] / flown_m_s))
        segment = int(begun[row])
        asked, flown = float(asked_m_s[segment]), float(flown_m_s[row])
        slower = asked < flown
        yield a.finding(
            ITEM_NOT_MODELLED,
            f"{name} speed of {quantity.beside(asked, flown, quantity.speed)} not modelled: "
            f"{quantity.count(len(begun), name)} predicted by the step response, here "
            f"{quantity.height(climbs[segment])} at {quantity.speed(flown)} on average"
            + ("; the flight takes more time and energy than predicted" if slower else ""),
            severity=Severity.ERROR if slower else None,
            item=a.item_of(segment),
            fix=f"remove the {name} speed from the mission, or use a model that an autopilot flies",
        )


@judges(MODEL_OUTSIDE_ENVELOPE)
def _climb_heights(a: Assessment) -> Iterator[Finding]:
    response = a.vehicle.responses.altitude
    if response is None:
        return
    climb_m = np.abs(a.flight.motion.segments.climb_m)
    beyond = np.flatnonzero(climb_m > response.identified_step_m + HEIGHT_SLACK_M)
    if len(beyond):
        yield a.finding(
            MODEL_OUTSIDE_ENVELOPE,
            f"{quantity.count(len(beyond), 'climb or descent', 'climbs or descents')} of up to "
            f"{quantity.height(float(climb_m[beyond].max()))}, longer than the identified step of "
            f"{quantity.height(response.identified_step_m)}: predicted at the step's peak rate",
            item=a.item_of(beyond[0]),
        )


@judges(MODEL_OUTSIDE_ENVELOPE)
def _heights(a: Assessment) -> Iterator[Finding]:
    reach, box = a.reach, a.vehicle.valid_for
    heights_m = reach.height_m
    limit, measured = box.height_above_home_m, box.hover_height_above_home_m
    if limit is not None:
        # Heights overshoot their commands as speeds do.
        beyond_m = np.maximum(heights_m / (1.0 + OVERSHOOT) - limit.high, limit.low - heights_m)
        worst = int(np.argmax(beyond_m))
        if beyond_m[worst] > HEIGHT_SLACK_M:
            yield _outside(
                a,
                f"{quantity.height(float(heights_m[worst]))} above home {reach.where(worst)}",
                f"from {quantity.height(limit.low)} to {quantity.height(limit.high)}",
                item=int(reach.item[worst]),
            )
            return
    highest_m = float(heights_m.max())
    if measured is not None and highest_m < measured.low:
        yield a.finding(
            MODEL_OUTSIDE_ENVELOPE,
            f"hover power is extrapolated: measured at {quantity.height(measured.low)} and above, this "
            f"flight reaches {quantity.height(highest_m)}",
            severity=Severity.INFO,
            fix="",
        )


@judges(MODEL_OUTSIDE_ENVELOPE, needs=(EXTREMES,))
def _flown_speeds(a: Assessment, extremes: Extremes) -> Iterator[Finding]:
    # Speeds that the mission itself commands are those of ``_commanded_speeds``.
    limit, wind = a.vehicle.valid_for.speed_m_s, a.setup.wind
    if limit is None:
        return
    reach = a.reach
    up_to = f"up to {quantity.speed(limit.high)}"
    over_m_s = (1.0 + OVERSHOOT) * limit.high
    shown_m_s = a.shown_airspeed_m_s
    assert shown_m_s is not None
    is_leant_less = a.vehicle.airspeed_limit_m_s is None and shown_m_s < limit.high
    fastest = extremes.ground_speed_m_s
    # A response of reference steps overshoots within the flights it was identified on.
    is_step = a.autopilot is Autopilot.STEP
    if fastest.value > over_m_s and not is_step:
        costs, is_short = _uncounted(a)
        yield _outside(
            a,
            f"{quantity.speed(fastest.value)} flown",
            up_to,
            so=costs or ": time and energy are unreliable",
            severity=Severity.ERROR if is_short or not a.vehicle.knows_airspeed else None,
            item=a.item_of(fastest.segment),
        )
    # Where it holds its place, gusts have to be withstood.
    air_m_s = np.where(
        reach.kind == SituationKind.HOLD, reach.gust_m_s(wind), reach.airspeed_m_s(wind)
    )
    row = int(np.argmax(air_m_s))
    ground_m_s = float(reach.ground_speed_m_s.max()) if is_step else fastest.value
    is_late = is_leant_less and air_m_s[row] > (1.0 + OVERSHOOT) * shown_m_s
    if is_late or air_m_s[row] > max(over_m_s, ground_m_s):
        # A model without an airspeed term counts no wind at all: E108.
        is_counted = a.vehicle.knows_airspeed or is_late
        costs, is_short = _uncounted(a) if is_counted else ("", False)
        yield _outside(
            a,
            f"airspeed of up to {quantity.speed(float(air_m_s[row]))} {reach.where(row)}",
            f"up to {shown_airspeed_text(a)}" if is_leant_less else up_to,
            so=costs,
            severity=Severity.ERROR if is_short else None,
            item=int(reach.item[row]),
        )


@judges(MODEL_OUTSIDE_ENVELOPE, needs=(EXTREMES,))
def _climb_rates(a: Assessment, _extremes: Extremes) -> Iterator[Finding]:
    limit = a.vehicle.valid_for.climb_rate_m_s
    if limit is None:
        return
    widest = max(abs(limit.low), abs(limit.high))
    reach = a.reach
    for rate_m_s, beyond_m_s, edge_m_s in (
        (reach.climb_m_s, reach.climb_m_s - limit.high, limit.high),
        (reach.climb_m_s, limit.low - reach.climb_m_s, min(limit.low, 0.0)),
    ):
        row = int(np.argmax(beyond_m_s))
        if beyond_m_s[row] > OVERSHOOT * widest:
            is_far = abs(rate_m_s[row]) > _FAR * (abs(edge_m_s) or widest)
            yield _outside(
                a,
                f"climb rate of {quantity.speed(float(rate_m_s[row]))} flown {reach.where(row)}",
                f"from {quantity.decimals(limit.low, 1)} to {quantity.speed(limit.high)}",
                severity=Severity.ERROR if is_far else None,
                item=int(reach.item[row]),
            )


@judges(MODEL_OUTSIDE_ENVELOPE)
def _mass(a: Assessment) -> Iterator[Finding]:
    vehicle, mass_kg = a.vehicle, a.flight.power.mass_kg
    limit = vehicle.valid_for.mass_kg
    if limit is None or not vehicle.knows_mass or mass_kg in {None, vehicle.mass_kg}:
        return
    mass_kg = mass_kg or 0.0
    if mass_kg not in limit:
        yield _outside(
            a,
            f"{quantity.mass(mass_kg)} with payload",
            f"from {quantity.mass(limit.low)} to {quantity.mass(limit.high)}",
        )


@judges(MODEL_OUTSIDE_ENVELOPE, needs=(EXTREMES,))
def _air_density(a: Assessment, extremes: Extremes) -> Iterator[Finding]:
    limit = a.vehicle.valid_for.air_density_kg_m3
    if not a.vehicle.knows_air_density:
        return
    thin, dense = (
        float(a.flight.power.air_density_kg_m3(height_m))
        for height_m in (extremes.highest_m, extremes.lowest_m)
    )
    if limit is None:
        if thin < (1.0 - _DENSITY_SLACK) * SEA_LEVEL_DENSITY_KG_M3:
            yield a.finding(
                MODEL_OUTSIDE_ENVELOPE,
                f"air of {quantity.decimals(thin, 2)} kg/m³: what it takes there is theory, the model states "
                "no air it was measured in",
                severity=Severity.INFO,
                fix="state the air of its flights: air_density_kg_m3 under [valid_for]",
            )
        return
    if thin < (1.0 - _DENSITY_SLACK) * limit.low or dense > (1.0 + _DENSITY_SLACK) * limit.high:
        yield _outside(
            a,
            f"air of {quantity.decimals(thin, 2)} to {quantity.decimals(dense, 2)} kg/m³",
            f"from {quantity.decimals(limit.low, 2)} to {quantity.decimals(limit.high, 2)} kg/m³",
            severity=Severity.INFO,
            fix="",
        )


NO_VEHICLE = Rule(
    "X903 no-vehicle",
    Severity.ERROR,
    summary="No vehicle was named: this is the prediction for the article's quadrotor.",
    why="A prediction with a model that nobody named says nothing about the vehicle that flies: a "
    "130 W quadrotor's GO was taken for any drone.",
    how="Neither --vehicle nor a settings file names a vehicle model.",
    fix="name the vehicle that flies with --vehicle (mavjoule models lists those that are shipped)",
    instead="--vehicle",
    leaves_open=True,
)


@judges(NO_VEHICLE)
def _no_vehicle(a: Assessment) -> Iterator[Finding]:
    return unnamed_vehicle(a.setup)


def unnamed_vehicle(setup: Setup) -> Iterator[Finding]:
    """Yield that nobody has named what flies."""
    if not setup.is_vehicle_named:
        yield NO_VEHICLE.finding(
            f"no vehicle named: predicted for {setup.vehicle.name}, which is not your drone"
        )


PAIR_MIXED = Rule(
    "X908 pair-mixed",
    Severity.ERROR,
    summary="Plan and parameters were fetched apart, and the parameters changed between.",
    why="Speeds, climbs, the return and its failsafes are predicted from the parameters: with those of "
    "last week, or of another vehicle, the prediction is of a flight that nobody will see.",
    how="mavjoule fetch notes in both files the time, the vehicle and a check sum over the parameters "
    "that a vehicle does not change by itself.  Where the check sums differ: an error where the "
    "parameters are the older, a warning where the plan is, or where they are another vehicle's.  "
    "Files without the note are not compared.",
    fix="fetch both from the vehicle that flies, or give --params the file fetched with the plan",
    leaves_open=True,
)


@judges(PAIR_MIXED, needs=(FETCHED,))
def _pair_mixed(a: Assessment, marks: tuple[FetchMark, FetchMark]) -> Iterator[Finding]:
    plan, parameters = marks
    if plan.parameters == parameters.parameters:
        return
    severity = Severity.WARNING
    if plan.vehicle and parameters.vehicle and plan.vehicle != parameters.vehicle:
        text = (
            f"the parameters are those of autopilot {parameters.vehicle}; the plan was fetched from "
            f"autopilot {plan.vehicle}"
        )
    elif parameters.time > plan.time:
        text = (
            f"the plan is older than the parameters: fetched {plan.time} and {parameters.time}, and "
            "the vehicle's parameters changed between"
        )
    else:
        severity = Severity.ERROR
        text = (
            f"the parameters are older than the plan: fetched {parameters.time} and {plan.time}, and "
            "the vehicle's parameters changed between"
        )
    yield a.finding(PAIR_MIXED, text, severity=severity)


POWER_UNKNOWN = Rule(
    "E109 power-not-identified",
    Severity.ERROR,
    summary="The model has no power: time is predicted, energy is not.",
    why="Without energy a mission cannot be judged against a battery; it is never a 'go'.",
    how='law = "not-given" under [hover] and [cruise] of the vehicle model.',
    fix="identify the vehicle from logs with voltage and current, or use another model",
    instead="a vehicle model with [hover]",
    leaves_open=True,
)


@judges(POWER_UNKNOWN)
def _power_unknown(a: Assessment) -> Iterator[Finding]:
    if not a.vehicle.is_power_known:
        yield a.finding(
            POWER_UNKNOWN, f"{a.vehicle.name} has no power model: time and distance only, no energy"
        )


CRUISE_POWER_ASSUMED = Rule(
    "E107 cruise-power-assumed",
    Severity.INFO,
    summary="The model has no cruise power: hover power at the same height is used.",
    why="Cruise power is not hover power: recorded vehicles use from 16 % less at 8 m/s to 37 % more "
    "at 15 m/s.  The article on which the shipped model is based gives no figure, and none is invented.",
    how="Cruise power = hover power at the actual height, wherever the model has no [cruise] table.",
    fix="identify the vehicle from its own logs, or add a cruise table to the model file",
)


@judges(CRUISE_POWER_ASSUMED, needs=(POWER,))
def _cruise_power_assumed(a: Assessment, _power: SteadyPower) -> Iterator[Finding]:
    columns = a.flight.motion.segments
    cruising = columns.state == STATE_INDEX[FlightState.CRUISE]
    if a.vehicle.cruise is None and cruising.any():
        cruise_m = float(columns.distance_m[cruising].sum())
        yield a.finding(
            CRUISE_POWER_ASSUMED,
            f"no cruise power in the model: hover power used for {quantity.distance(cruise_m)}",
        )


_SAME_MASS = 1e-9
"""Two masses that are the same but for the arithmetic. [-]"""
_STATE_THRUST = (
    "carry less, fly lower, or state the thrust of its motors (thrust_max_n in the model, mavjoule vehicle "
    "new --motor)"
)

LIFT_UNKNOWN = Rule(
    "E120 lift-unknown",
    Severity.ERROR,
    summary="The flight takes far more thrust than the flights the model was identified on.",
    why="A model's power keeps growing where the vehicle no longer leaves the ground: it has no limit "
    "of thrust (ArduPilot #5244: nearly lost at 77 % of the throttle).",
    how="Mass over air density, at the highest point of the flight with payload, over that of a flight the "
    "model knows: more than 1.33 (thrust falls with air density as weight grows), for a hover with 0.6 of "
    "the thrust, the most that is usual, then takes the 0.8 from which on ArduPilot has no lean left.  "
    "Of the ranges of [valid_for] nobody knows which of both were flown together: it flew the heaviest in "
    "its densest air, 1.225 kg/m³ at most, and the lightest in its thinnest; the more counts.  Without a "
    "range the model's "
    "own mass, in 1.225 kg/m³.  Of a model from a data sheet nobody flew anything: it is held to lift the "
    "heaviest of [valid_for], its maker's highest take-off mass or 1.33 times that of the sheet, in 1.225 "
    "kg/m³, and its own mass in the thinnest air of it; no more than that.  Where thrust_max_n, or of a "
    "flown model the hover throttle, tells the thrust E116 judges instead.  And no vehicle more than "
    "mass_max_kg.",
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


@judges(LIFT_UNKNOWN, CONDITION_NOT_MODELLED, needs=(EXTREMES, POWER))
def _lift(a: Assessment, extremes: Extremes, power: SteadyPower) -> Iterator[Finding]:
    vehicle, limit = a.vehicle, a.vehicle.valid_for.air_density_kg_m3
    thin = float(power.air_density_kg_m3(extremes.highest_m))
    sea_level = SEA_LEVEL_DENSITY_KG_M3
    thinnest, densest = (sea_level, sea_level) if limit is None else (limit.low, limit.high)
    thinner = thinnest / thin
    air = f"air of {quantity.decimals(thin, 2)} kg/m³"
    if _is_of_sheet(a):
        yield from _beyond_sheet(a, thin, thinnest)
        return
    times_heaviest, times_lightest = _times_heavier(a)
    lifted = min(times_heaviest * min(sea_level, densest) / thin, times_lightest * thinner)
    if lifted > _MOST_LIFT and measured_thrust(a) is None:
        load = "the flight" if power.mass_kg is None else quantity.mass(power.mass_kg)
        yield a.finding(
            LIFT_UNKNOWN,
            f"{load} in {air} needs {quantity.beside(lifted, _MOST_LIFT, _times)} the thrust of the "
            "flights the model was identified on: whether the vehicle has it is unknown",
        )
        return
    # A temperature or a pressure that is not counted is reported already.
    is_reported = a.setup.temperature_c is not None or a.setup.pressure_hpa is not None
    if not vehicle.knows_air_density and thinner > _THINNER and not is_reported:
        costs, is_short = _uncounted(a)
        yield a.finding(
            CONDITION_NOT_MODELLED,
            f"{air}, {_times(thinner)} thinner than at sea level, not counted: the model has no air "
            f"density term{costs}",
            severity=Severity.ERROR if is_short else None,
        )


def _is_of_sheet(a: Assessment) -> bool:
    """Whether the thrust of the vehicle is known from its data sheet's masses alone."""
    basis, knows = a.vehicle.provenance.basis, a.vehicle.knows_mass and a.vehicle.knows_air_density
    return basis is not None and basis.is_sheet and knows and a.vehicle.thrust_max_n is None


def _beyond_sheet(a: Assessment, thin_kg_m3: float, thinnest_kg_m3: float) -> Iterator[Finding]:
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
    known = max(heaviest_kg / own_kg, SEA_LEVEL_DENSITY_KG_M3 / thinnest_kg_m3)
    lifted = mass_kg / own_kg * SEA_LEVEL_DENSITY_KG_M3 / thin_kg_m3
    if lifted > _AIR_SLACK * known:
        yield a.finding(
            LIFT_UNKNOWN,
            f"{quantity.mass(mass_kg)} in air of {quantity.decimals(thin_kg_m3, 2)} kg/m³ needs "
            f"{quantity.beside(lifted, known, _times)} the thrust of {quantity.mass(own_kg)} at sea level; "
            f"nobody flew this vehicle, no more than {_times(known)} is taken for granted",
            fix=_STATE_THRUST,
        )


def _uncounted(a: Assessment) -> tuple[str, bool]:
    """Return what wind and thin air that the model does not count may take, and whether it is too much."""
    if not a.margins:
        return "", False  # without a battery nothing is a go: E100
    margin = min(a.margins, key=lambda one: one.left_wh)
    most_wh = margin.uncounted_wh
    if most_wh <= 0.0:
        return "", False
    if not math.isfinite(most_wh):
        return f"{_WITH_ALL} it may not come forward at all", True
    text = f"{_WITH_ALL} it may take {quantity.energy(most_wh)} more"
    if margin.left_wh >= 0.0:
        return text, False
    had_wh = max(margin.left_wh + most_wh, 0.0)
    return f"{text} than the {quantity.energy(had_wh)} above the reserve allow", True


def _times_heavier(a: Assessment) -> tuple[float, float]:
    """Return the mass that flies over the heaviest and the lightest the model was identified with."""
    vehicle, mass_kg = a.vehicle, a.flight.power.mass_kg
    limit, own_kg = vehicle.valid_for.mass_kg, vehicle.mass_kg
    lightest_kg, heaviest_kg = (own_kg, own_kg) if limit is None else (limit.low, limit.high)
    if not vehicle.knows_mass or mass_kg is None or lightest_kg is None or heaviest_kg is None:
        return 1.0, 1.0  # a payload that is not counted is E108's
    return mass_kg / heaviest_kg, mass_kg / lightest_kg


def _times(ratio: float) -> str:
    return f"{quantity.decimals(ratio, 1)} times"


def _not_counted(a: Assessment, what: str, term: str) -> Finding:
    """Return that a condition is not counted, for want of a term, and what that may take."""
    costs, is_short = _uncounted(a)
    return a.finding(
        CONDITION_NOT_MODELLED,
        f"{what} not counted: this model has no {term} term{costs}",
        severity=Severity.ERROR if is_short else None,
    )


@judges(CONDITION_NOT_MODELLED)
def _conditions(a: Assessment) -> Iterator[Finding]:
    given, vehicle = a.setup, a.vehicle
    wind, payload_kg = given.wind, mean_of(given.payload_kg)
    if (wind.speed_m_s > 0.0 or wind.speed_sd_m_s > 0.0) and not vehicle.knows_airspeed:
        yield _not_counted(a, f"wind of {quantity.speed(wind.speed_m_s)}", "airspeed")
    if (payload_kg > 0.0 or sd_of(given.payload_kg) > 0.0) and not vehicle.knows_mass:
        yield a.finding(
            CONDITION_NOT_MODELLED,
            f"payload of {quantity.mass(payload_kg)} not counted: this model has no mass term",
            severity=Severity.ERROR,
            fix="use a model with a mass, or allow for the payload in --reserve and ignore E108",
        )
    if given.temperature_c is not None and not vehicle.knows_air_density:
        temperature = quantity.temperature(mean_of(given.temperature_c))
        yield _not_counted(a, f"temperature of {temperature}", "air density")
    if given.pressure_hpa is not None and not vehicle.knows_air_density:
        yield _not_counted(a, f"pressure of {given.pressure_hpa:g} hPa", "air density")
    spread = [
        name
        for name, sd in (
            ("wind", wind.speed_sd_m_s or wind.from_sd_deg),
            ("payload", sd_of(given.payload_kg)),
            ("temperature", sd_of(given.temperature_c)),
            ("charge", sd_of(given.charge)),
        )
        if sd
    ]
    if spread and vehicle.spread is None:
        yield a.finding(
            CONDITION_NOT_MODELLED,
            f"± of {' and '.join(spread)} not drawn: {vehicle.name} has no [spread]; each alone is looked at "
            "two standard deviations off",
            fix="use a vehicle model with a [spread], as mavjoule identify writes it",
        )


@judges(CONDITION_NOT_MODELLED)
def _slower_parameters(a: Assessment) -> Iterator[Finding]:
    """Count what its own slower climbs, landings, accelerations and circles take a step-response model."""
    late, back = a.lateness, a.late_returns
    in_all_s, home_s = float(late.in_all_s.sum()), float(back.in_all_s.max(initial=0.0))
    if not (in_all_s > 0.0 or home_s > 0.0):
        return
    # What wind and thin air may take comes on top: each alone may fit.
    had_wh, left_wh = math.inf, a.left_wh
    if not math.isfinite(a.uncounted.flown_wh):
        return  # an error of its own
    if a.battery is not None:
        had_wh = a.battery.margin_wh  # below 0 it is E101's
    slowest, shaped_back_s = late.slowest, 0.0
    told_s = in_all_s
    if not in_all_s and (back.slowest is not None or left_wh < 0.0):
        slowest, shaped_back_s, told_s = back.slowest, float(back.ways_s.max(initial=0.0)), home_s
    added = f"{_and_energy(a, told_s)} more than predicted"
    if 0.0 < told_s < home_s:
        added += f"; returns up to {_and_energy(a, home_s)} more"
    added += f"; {quantity.energy(-left_wh)} short of the reserve" * (left_wh < 0.0)
    causes = [
        (
            float(late.ways_s.sum()),
            f"{late.shaped_by}: the vehicle takes longer from place to place",
        ),
        (shaped_back_s, f"{back.shaped_by}: returns take longer"),
        (float(late.circles_s.sum()), f"{late.circled_by}: circles take longer"),
    ]
    if slowest is not None:
        said = (
            f"{slowest.origin}: the vehicle flies at most {quantity.speed(slowest.limit_m_s)}, predicted "
            f"at {quantity.speed(slowest.flown_m_s)}"
        )
        causes.insert(0, (slowest.added_s, said))
    most_s, said = max(causes, key=lambda cause: cause[0])
    if not most_s > 0.0:
        return
    yield a.finding(
        CONDITION_NOT_MODELLED,
        f"{said}: {added}",
        severity=Severity.ERROR if left_wh < 0.0 <= had_wh else None,
        fix="use a vehicle model that this autopilot flies",
    )


def _and_energy(a: Assessment, time_s: float) -> str:
    return f"{quantity.duration(time_s)} and {quantity.energy(a.hovered_wh(time_s))}"


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _returns_along_the_mission(a: Assessment, parameters: Px4Parameters) -> Iterator[NotEvaluated]:
    if a.autopilot is Autopilot.STEP and leads_along(a.mission, parameters.return_type):
        yield NotEvaluated(
            rule=SETTING_NOT_FOLLOWED,
            asked_by=f"RTL_TYPE of {parameters.return_type}",
            needs="a vehicle model that PX4 flies: steps do not return along the mission",
        )


@judges(CONDITION_NOT_MODELLED)
def _battery_conditions(a: Assessment) -> Iterator[Finding]:
    temperature_c = a.setup.battery_temperature_c
    if a.pack is None:
        named = {
            "health": a.setup.battery_health,
            "resistance": a.setup.battery_resistance_factor,
            "temperature": temperature_c,
        }
        given = [name for name, value in named.items() if value is not None]
        if given:
            yield a.finding(
                CONDITION_NOT_MODELLED,
                f"battery {' and '.join(given)} not counted: no battery given",
                fix="give --battery, or use a vehicle model with a [battery]",
            )
        return
    has_curve = a.pack.resistance_temperature_c is not None and a.discharge is not None
    if temperature_c is not None and not has_curve:
        yield a.finding(
            CONDITION_NOT_MODELLED,
            "battery temperature not counted: the battery has no resistance over temperature",
            fix="use a vehicle model whose battery has one",
        )


RESPONSE_NOT_APPLIED = Rule(
    "E111 response-not-applied",
    Severity.INFO,
    summary="The model has responses of the vehicle to its setpoints, which are not used.",
    why="Stops take a little longer, and waypoints are reached a little later, than their setpoints.",
    how="[responses] of speed or altitude in a model flown by PX4, which is predicted to fly exactly "
    "its setpoints, but for the time its trajectory waits for a noisy position (T109); on ArduPilot "
    "stops and waits at waypoints follow the responses.",
    fix="allow for the mean residence time of the responses where a stop matters",
)


@judges(RESPONSE_NOT_APPLIED, needs=(PX4,))
def _response_not_applied(a: Assessment, _parameters: Px4Parameters) -> Iterator[Finding]:
    responses = a.vehicle.responses
    if a.autopilot is Autopilot.STEP:
        return
    if responses.speed is not None or responses.altitude is not None:
        yield a.finding(
            RESPONSE_NOT_APPLIED,
            "the model's responses are not applied: PX4 is predicted to fly its setpoints without lag",
        )


AUTOPILOT_DIFFERS = Rule(
    "M109 autopilot-differs",
    Severity.INFO,
    summary="The mission was written for another autopilot than the model's.",
    why="PX4 and ArduPilot fly the same items differently; so does a step-response model.",
    how="The file's firmware type against the autopilot of the prediction.",
    fix="choose with --vehicle the model of the vehicle that will fly",
)


@judges(AUTOPILOT_DIFFERS)
def _autopilot_differs(a: Assessment) -> Iterator[Finding]:
    written_for = a.mission.autopilot
    if written_for is None or written_for is a.autopilot:
        return
    if a.autopilot is Autopilot.STEP:
        message = (
            "predicted with a stop at each waypoint (step-response model); "
            f"{written_for.label}, which the file was written for, flies through them"
        )
    else:
        message = (
            f"predicted as {a.autopilot.label} flies; the file was written for {written_for.label}"
        )
    yield a.finding(AUTOPILOT_DIFFERS, message)
