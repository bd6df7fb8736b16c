"""Rules on the model: flight it was not identified on, conditions it does not know."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.catalogue.energy import (
    CONDITION_NOT_MODELLED,
    CRUISE_POWER_ASSUMED,
    MODEL_OUTSIDE_ENVELOPE,
    POWER_UNKNOWN,
    RESPONSE_NOT_APPLIED,
)
from planner.catalogue.mission import AUTOPILOT_DIFFERS
from planner.catalogue.time import ITEM_NOT_MODELLED
from planner.findings import Severity
from planner.flight.motion.kinematics import (
    STATE_INDEX,
    FlightState,
)
from planner.mission.route.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.prediction import Extreme
    from planner.mission.route.stage import Stage
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.px4 import Px4Parameters

_HEIGHT_SLACK_M = 0.5
"""A height this little outside the identified ones is inside: rounding of files. [m]"""
_OVERSHOOT = 0.03
"""A rate this much over the highest is inside: recorded flights overshoot their commands by it. [-]"""
STRONG_WIND = 0.6
"""Wind over the highest identified speed from which on not to count it is an error: out and back at
10 m/s took 7 % more energy in 5 m/s of wind and 22 % more in 8 m/s. [-]"""
_LANDS = frozenset({StageKind.LAND, StageKind.RETURN})
"""Stages whose vertical speeds are set in the vehicle, not by the mission."""
_FAR = 2.0
"""A climb or descent so many times as fast as any identified is an error. [-]"""
_DENSITY_SLACK = 0.02
"""A density this much outside the identified ones is inside: 2 % of density is 1 % of power. [-]"""


def check_speed(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a speed is commanded that the model was not identified up to."""
    limit = a.vehicle.valid_for.speed_m_s
    if limit is None:
        return
    speeds = [(_commanded_m_s(a, stage), stage) for stage in a.route.stages]
    beyond = [stage for speed, stage in speeds if speed is not None and speed not in limit]
    if not beyond:
        return
    fastest_m_s = max(speed for speed, _ in speeds if speed is not None and speed not in limit)
    yield MODEL_OUTSIDE_ENVELOPE.finding(
        f"{quantity.speed(fastest_m_s)} is commanded, the model was identified from "
        f"{quantity.decimals(limit.low, 1)} to {quantity.speed(limit.high)}: "
        f"time and energy of {quantity.count(len(beyond), 'leg')} cannot be trusted",
        severity=Severity.ERROR,
        item=beyond[0].item,
        place=a.mission.items[beyond[0].item - 1].place,
        fix=f"command {quantity.speed(limit.high)} or less, or identify the vehicle on such flights",
    )


def _commanded_m_s(a: Assessment, stage: Stage) -> float | None:
    """Return the speed commanded on a stage, not above what PX4 flies. [m s⁻¹]"""
    if stage.speed_m_s is None or a.autopilot is not Autopilot.PX4:
        return stage.speed_m_s
    parameters = cast("Px4Parameters", a.parameters)
    return min(stage.speed_m_s, parameters.speed_max_m_s)  # T103 says so


def check_climbs(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a climb or descent is longer than the identified step."""
    response = a.vehicle.responses.altitude
    if response is None:
        return
    columns = a.flight.motion.segments
    beyond = np.flatnonzero(np.abs(columns.climb_m) > response.identified_step_m + _HEIGHT_SLACK_M)
    if not len(beyond):
        return
    item = int(columns.item[beyond[0]])
    longest = float(np.abs(columns.climb_m[beyond]).max())
    yield MODEL_OUTSIDE_ENVELOPE.finding(
        f"{quantity.count(len(beyond), 'climb or descent', 'climbs or descents')} of up to "
        f"{quantity.height(longest)}, longer than the identified "
        f"{quantity.height(response.identified_step_m)}: flown at the peak rate of the identified step",
        item=item,
        place=a.mission.items[item - 1].place,
    )


def check_vertical_speeds(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a climb or descent speed is commanded that reference steps do not fly."""
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
        asked_m_s[[stages[row].kind in _LANDS for row in stage_of]] = np.nan
        begun = np.flatnonzero((climbs > 0.0) & ~np.isnan(asked_m_s))
        if not len(begun):
            continue
        flown_m_s = climbs[begun] / columns.duration_s[begun]
        row = int(np.argmin(asked_m_s[begun] / flown_m_s))
        segment = int(begun[row])
        asked, flown = float(asked_m_s[segment]), float(flown_m_s[row])
        item = int(columns.item[segment])
        slower = asked < flown
        yield ITEM_NOT_MODELLED.finding(
            f"a {name} speed of {quantity.beside(asked, flown, quantity.speed)} is commanded and not "
            f"modelled: {quantity.count(len(begun), name)} flown as the model answers, this one "
            f"{quantity.height(climbs[segment])} at {quantity.speed(flown)} on average"
            + (": time and energy are more than is said" if slower else ""),
            severity=Severity.ERROR if slower else None,
            item=item,
            place=a.mission.items[item - 1].place,
            fix=f"take the {name} speed out of the mission, or use a vehicle model that is flown by "
            "an autopilot",
        )


def check_heights(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the flight is higher than the model knows, or hovers lower."""
    heights = np.array([stage.height_m for stage in a.route.stages])
    box = a.vehicle.valid_for
    limit = box.height_above_home_m
    outside = np.zeros(len(heights), dtype=bool)
    if limit is not None:
        outside = (heights > limit.high + _HEIGHT_SLACK_M) | (heights < limit.low - _HEIGHT_SLACK_M)
        if outside.any():
            worst = int(np.argmax(np.where(outside, np.abs(heights), -1.0)))
            yield MODEL_OUTSIDE_ENVELOPE.finding(
                f"{quantity.count(int(outside.sum()), 'leg')} at heights of up to "
                f"{quantity.height(heights[worst])} above home: the model was identified from "
                f"{quantity.height(limit.low)} to {quantity.height(limit.high)}",
                item=a.route.stages[worst].item,
                place=a.mission.items[a.route.stages[worst].item - 1].place,
            )
    measured = box.hover_height_above_home_m
    if measured is not None and not outside.any():
        low = float(heights.max())
        if low < measured.low:
            yield MODEL_OUTSIDE_ENVELOPE.finding(
                f"the flight goes no higher than {quantity.height(low)}, hover power was measured "
                f"from {quantity.height(measured.low)} up: the hover law is used below its data",
                severity=Severity.INFO,
                fix="",
            )


def check_rates(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where speed, airspeed or climb rate leave the box they were identified in.

    Speeds a mission commands itself are ``check_speed``'s.
    """
    box, extremes = a.vehicle.valid_for, a.flight.extremes
    if extremes is None:
        return
    if (limit := box.speed_m_s) is not None:
        commanded = any((_commanded_m_s(a, stage) or 0.0) > limit.high for stage in a.route.stages)
        identified = f"the model was identified up to {quantity.speed(limit.high)}"
        over = (1.0 + _OVERSHOOT) * limit.high
        ground_m_s = extremes.ground_speed_m_s.value
        # A response of reference steps overshoots within the flights it was identified on.
        if ground_m_s > over and a.autopilot is not Autopilot.STEP:
            if not commanded:
                yield _outside(
                    a,
                    extremes.ground_speed_m_s,
                    f"{quantity.speed(ground_m_s)} is flown, {identified}: "
                    "time and energy cannot be trusted",
                    severity=Severity.ERROR,
                )
        elif (airspeed_m_s := extremes.airspeed_m_s.value) > max(over, ground_m_s):
            # Where the airspeed makes no difference nothing is extrapolated: the wind is not counted.
            is_strong = airspeed_m_s > (1.0 + STRONG_WIND) * limit.high
            yield _outside(
                a,
                extremes.airspeed_m_s,
                f"against the wind up to {quantity.speed(airspeed_m_s)} are flown "
                f"through the air, {identified}",
                severity=Severity.ERROR if a.vehicle.knows_airspeed or is_strong else None,
            )
    if (limit := box.climb_rate_m_s) is not None:
        widest = max(abs(limit.low), abs(limit.high))
        slack = _OVERSHOOT * widest
        for extreme, beyond in (
            (extremes.climb_m_s, extremes.climb_m_s.value - limit.high),
            (extremes.descent_m_s, limit.low - extremes.descent_m_s.value),
        ):
            if beyond > slack:
                edge = limit.high if extreme.value > limit.high else min(limit.low, 0.0)
                yield _outside(
                    a,
                    extreme,
                    f"a climb rate of {quantity.speed(extreme.value)} is flown, the model was "
                    f"identified from {quantity.decimals(limit.low, 1)} to "
                    f"{quantity.speed(limit.high)}",
                    severity=Severity.ERROR
                    if abs(extreme.value) > _FAR * (abs(edge) or widest)
                    else None,
                )


def check_air_and_mass(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the mass, or the density of the air, is one the model was not seen in."""
    vehicle, power, extremes = a.vehicle, a.flight.power, a.flight.extremes
    limit = vehicle.valid_for.mass_kg
    if limit is not None and vehicle.knows_mass and power.mass_kg not in {None, vehicle.mass_kg}:
        mass_kg = power.mass_kg or 0.0
        if mass_kg not in limit:
            yield MODEL_OUTSIDE_ENVELOPE.finding(
                f"{quantity.mass(mass_kg)} fly with the payload, the model was identified "
                f"from {quantity.mass(limit.low)} to {quantity.mass(limit.high)}"
            )
    limit = vehicle.valid_for.air_density_kg_m3
    if limit is None or not vehicle.knows_air_density or extremes is None:
        return
    thin, dense = (
        float(power.air_density_kg_m3(height_m))
        for height_m in (extremes.highest_m, extremes.lowest_m)
    )
    if thin < (1.0 - _DENSITY_SLACK) * limit.low or dense > (1.0 + _DENSITY_SLACK) * limit.high:
        yield MODEL_OUTSIDE_ENVELOPE.finding(
            f"the air has {quantity.decimals(thin, 2)} to {quantity.decimals(dense, 2)} kg/m³, the "
            f"model was identified from {quantity.decimals(limit.low, 2)} to "
            f"{quantity.decimals(limit.high, 2)} kg/m³",
            severity=Severity.INFO,
            fix="",
        )


def _outside(
    a: Assessment, extreme: Extreme, message: str, *, severity: Severity | None = None
) -> Finding:
    item = int(a.flight.motion.segments.item[extreme.segment])
    return MODEL_OUTSIDE_ENVELOPE.finding(
        message, severity=severity, item=item, place=a.mission.items[item - 1].place
    )


def check_power_known(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the model knows no power, or takes hover power for that of a cruise."""
    vehicle = a.vehicle
    if not vehicle.is_power_known:
        yield POWER_UNKNOWN.finding(
            f"{vehicle.name} has no power model: time and distance are predicted, energy is not"
        )
    elif vehicle.cruise is None:
        columns = a.flight.motion.segments
        cruising = columns.state == STATE_INDEX[FlightState.CRUISE]
        if cruising.any():
            yield CRUISE_POWER_ASSUMED.finding(
                "cruise power is taken as hover power over "
                f"{quantity.distance(float(columns.distance_m[cruising].sum()))}: "
                "the model gives none"
            )


def check_conditions(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for each condition the model cannot take into account."""
    conditions, vehicle = a.conditions, a.vehicle
    wind = conditions.wind
    if (wind.speed_m_s > 0.0 or wind.speed_sd_m_s > 0.0) and not vehicle.knows_airspeed:
        limit = vehicle.valid_for.speed_m_s
        is_strong = limit is not None and wind.speed_m_s > STRONG_WIND * limit.high
        yield CONDITION_NOT_MODELLED.finding(
            f"the wind of {quantity.speed(wind.speed_m_s)} is not counted in the energy: "
            "in the model the airspeed makes no difference",
            severity=Severity.ERROR if is_strong else None,
        )
    if (conditions.payload_kg > 0.0 or conditions.payload_sd_kg > 0.0) and not vehicle.knows_mass:
        yield CONDITION_NOT_MODELLED.finding(
            f"the payload of {quantity.mass(conditions.payload_kg)} is not counted: "
            "the model's power knows no mass",
            severity=Severity.ERROR,
            fix="fly a vehicle model that knows its mass, or allow for the load in --reserve and "
            "ignore E108",
        )
    if conditions.temperature_c is not None and not vehicle.knows_air_density:
        yield CONDITION_NOT_MODELLED.finding(
            f"the temperature of {quantity.temperature(conditions.temperature_c)} is not counted: "
            "the model's power knows no air density"
        )
    spread = [
        name
        for name, sd in (
            ("wind", wind.speed_sd_m_s or wind.from_sd_deg),
            ("payload", conditions.payload_sd_kg),
            ("temperature", conditions.temperature_sd_c),
            ("charge", a.charge_sd),
        )
        if sd
    ]
    if spread and vehicle.spread is None:
        yield CONDITION_NOT_MODELLED.finding(
            f"the ± of the {' and the '.join(spread)} is not used: {vehicle.name} does not say how "
            "far flights are from its predictions",
            fix="use a vehicle model with a [spread], as mavjoule identify writes it",
        )
    yield from _battery_conditions(a)


def _battery_conditions(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for what is said of a battery that says too little of itself."""
    conditions, pack = a.conditions, a.pack
    given = [
        name
        for name, value in (
            ("health", conditions.battery_health),
            ("resistance", conditions.battery_resistance_factor),
            ("temperature", conditions.battery_temperature_c),
        )
        if value is not None
    ]
    if pack is None and given:
        yield CONDITION_NOT_MODELLED.finding(
            f"the {' and '.join(given)} of the battery is not counted: no battery is known",
            fix="give the battery with --battery, or use a vehicle model that has one",
        )
        return
    if a.discharge is None and conditions.battery_resistance_factor is not None:
        yield CONDITION_NOT_MODELLED.finding(
            "the resistance of the battery is not counted: the battery gives no voltage over charge "
            "or no resistance",
            fix="use a vehicle model whose battery has both",
        )
    has_curve = pack is not None and pack.resistance_temperature_c is not None
    if conditions.battery_temperature_c is not None and not (has_curve and a.discharge):
        yield CONDITION_NOT_MODELLED.finding(
            "the temperature of the battery is not counted: the battery gives no resistance over "
            "temperature",
            fix="use a vehicle model whose battery does",
        )


def check_responses(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the model's responses of motion are not applied."""
    responses = a.vehicle.responses
    known = responses.speed is not None or responses.altitude is not None
    if known and a.autopilot is Autopilot.PX4:
        yield RESPONSE_NOT_APPLIED.finding(
            "PX4 is taken to fly its references without lag: the model's responses are not applied"
        )


def check_autopilot(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the file was written for another way of commanding."""
    written_for = a.mission.autopilot
    if written_for is None or written_for is a.autopilot:
        return
    flown = (
        "flown in reference steps, stopping at every waypoint"
        if a.autopilot is Autopilot.STEP
        else f"flown as {a.autopilot.label} would"
    )
    yield AUTOPILOT_DIFFERS.finding(
        f"the file was written for {written_for.label}; the prediction is {flown}"
    )
