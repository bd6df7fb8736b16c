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
from planner.flight.prediction import SPEED_ROUNDING
from planner.flight.reach import SituationKind, climbs_flown_m_s
from planner.flight.returns.destination import SETTING_NOT_FOLLOWED, leads_along
from planner.mission.route.stage import StageKind
from planner.mission.route.state import ITEM_NOT_MODELLED
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3
from planner.quantity import mean_of, sd_of
from planner.rules.clearance import above_text
from planner.rules.declaration import EXTREMES, POWER, PX4, NotEvaluated, judges
from planner.rules.lateness import HEIGHT_SLACK_M, OVERSHOOT
from planner.rules.lift import is_lift_unknown, thinnest_known_kg_m3, times_text
from planner.rules.wind import known_text, shown_airspeed_text
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

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
    "beyond the identified V_k, or what of a limit is certain, the greater of two bounds counts: the power "
    "at V_k times (V / V_k)³, or the longer way at the airspeed V_k (airspeed_limit_m_s where the model has "
    "it, less two of its airspeed_limit_fraction; with the root of what more lean holds, and more weight, as "
    "W101 has it; as for W103 where the parameters let it lean less); an error where that may take the "
    "margin.  Of a model with neither no speed is checked: X904.",
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
    message = f"{what}; {known_text(a.vehicle)} {limits}{so}"
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
        yield a.finding(
            ITEM_NOT_MODELLED,
            f"{name} speed of {quantity.beside(asked, flown, quantity.speed)} not modelled: "
            f"{quantity.count(len(begun), name)} predicted by the step response, here "
            f"{quantity.height(climbs[segment])} at {quantity.speed(flown)} on average"
            + ("; the longer time is counted (E108)" if asked < flown else ""),
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
                f"{above_text(float(heights_m[worst]), 'home')} {reach.where(worst)}",
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
    certain_m_s = a.certain_airspeed_m_s
    assert certain_m_s is not None
    is_leant_less = certain_m_s < limit.high
    fastest = extremes.ground_speed_m_s
    # A response of reference steps overshoots within the flights it was identified on.
    is_step = a.autopilot is Autopilot.STEP
    if fastest.value > over_m_s and not is_step:
        costs = _uncounted(a)
        yield _outside(
            a,
            f"{quantity.speed(fastest.value)} flown",
            up_to,
            so=costs.text or ": time and energy are unreliable",
            of_flight=costs.of_flight,
            severity=Severity.ERROR if costs.is_short or not a.vehicle.knows_airspeed else None,
            item=a.item_of(fastest.segment),
        )
    # Where it holds its place, gusts have to be withstood.
    air_m_s = np.where(
        reach.kind == SituationKind.HOLD, reach.gust_m_s(wind), reach.airspeed_m_s(wind)
    )
    row = int(np.argmax(air_m_s))
    ground_m_s = float(reach.ground_speed_m_s.max()) if is_step else fastest.value
    is_late = is_leant_less and air_m_s[row] > (1.0 + OVERSHOOT) * certain_m_s
    # What flies as fast over ground is told of already.
    if is_late or air_m_s[row] > max(over_m_s, (1.0 + SPEED_ROUNDING) * ground_m_s):
        # A model without an airspeed term counts no wind at all: E108.
        is_counted = a.vehicle.knows_airspeed or is_late
        costs = _uncounted(a) if is_counted else _UncountedCosts()
        yield _outside(
            a,
            f"airspeed of up to {quantity.speed(float(air_m_s[row]))} {reach.where(row)}",
            f"up to {shown_airspeed_text(a)}" if is_leant_less else up_to,
            so=costs.text,
            of_flight=costs.of_flight,
            severity=Severity.ERROR if costs.is_short else None,
            item=int(reach.item[row]),
        )


@judges(MODEL_OUTSIDE_ENVELOPE, needs=(EXTREMES,))
def _climb_rates(a: Assessment, _extremes: Extremes) -> Iterator[Finding]:
    limit = a.vehicle.valid_for.climb_rate_m_s
    if limit is None:
        return
    widest = max(abs(limit.low), abs(limit.high))
    reach = a.reach
    rate_m_s, most_m_s = reach.climb_m_s, OVERSHOOT * widest
    is_beyond = (rate_m_s > limit.high + most_m_s) | (rate_m_s < limit.low - most_m_s)
    if a.flight.motion.climb_lag_s and is_beyond.any():
        flown_m_s = climbs_flown_m_s(a.flight.motion)
        rate_m_s = np.append(flown_m_s, rate_m_s[len(flown_m_s) :])
    for beyond_m_s, edge_m_s in (
        (rate_m_s - limit.high, limit.high),
        (limit.low - rate_m_s, min(limit.low, 0.0)),
    ):
        row = int(np.argmax(beyond_m_s))
        if beyond_m_s[row] > most_m_s:
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


class _UncountedCosts(Value, kw_only=False):
    """What wind and thin air that the model does not count may take, in words."""

    text: str = ""
    is_short: bool = False
    """Whether that is too much."""
    of_flight: str = ""
    """The text, where it would be another for a longer flight."""


def _uncounted(a: Assessment) -> _UncountedCosts:
    """Return what wind and thin air that the model does not count may take."""
    if not a.margins:
        return _UncountedCosts()  # without a battery nothing is a go: E100
    margin = min(a.margins, key=lambda one: one.left_wh)
    most_wh = margin.uncounted_wh
    if most_wh <= 0.0:
        return _UncountedCosts()
    if not math.isfinite(most_wh):
        return _UncountedCosts(f"{_WITH_ALL} it may not come forward at all", is_short=True)
    text, is_short = f"{_WITH_ALL} it may take {quantity.energy(most_wh)} more", False
    if margin.left_wh < 0.0:
        had_wh = max(margin.left_wh + most_wh, 0.0)
        text += f" than the {quantity.energy(had_wh)} above the reserve allow"
        is_short = True
    return _UncountedCosts(text, is_short, text)


def _not_counted(a: Assessment, what: str, term: str) -> Finding:
    """Return that a condition is not counted, for want of a term, and what that may take."""
    costs = _uncounted(a)
    return a.finding(
        CONDITION_NOT_MODELLED,
        f"{what} not counted: this model has no {term} term{costs.text}",
        severity=Severity.ERROR if costs.is_short else None,
        of_flight=costs.of_flight,
    )


@judges(CONDITION_NOT_MODELLED, needs=(EXTREMES, POWER))
def _thin_air(a: Assessment, extremes: Extremes, power: SteadyPower) -> Iterator[Finding]:
    thin_kg_m3 = float(power.air_density_kg_m3(extremes.highest_m))
    thinner = thinnest_known_kg_m3(a) / thin_kg_m3
    # A temperature or a pressure that is not counted is reported already.
    is_reported = a.setup.temperature_c is not None or a.setup.pressure_hpa is not None
    if a.vehicle.knows_air_density or is_reported or thinner <= _THINNER:
        return
    if not is_lift_unknown(a, thin_kg_m3):
        costs = _uncounted(a)
        yield a.finding(
            CONDITION_NOT_MODELLED,
            f"air of {quantity.decimals(thin_kg_m3, 2)} kg/m³, {times_text(thinner)} thinner than at sea "
            f"level, not counted: the model has no air density term{costs.text}",
            severity=Severity.ERROR if costs.is_short else None,
            of_flight=costs.of_flight,
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
            fix="use a model with a mass (mavjoule vehicle new --mass): it counts the payload",
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
    how="The file's firmware type against the autopilot of the prediction.  A model whose autopilot is "
    "assumed (`mavjoule vehicle new` without any, frames sold without or flown by others too) is flown by "
    "that of the parameters, the target or the file.",
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
