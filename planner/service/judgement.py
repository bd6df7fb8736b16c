"""The main job: predict a mission and judge it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot, Target
from planner.errors import UsageError
from planner.findings import Severity
from planner.flight.budget import (
    NOTHING_FLOWN,
    Reserve,
    battery_budget,
    flight_totals,
    hover_power_w,
    item_arrivals,
    predict_discharge,
)
from planner.flight.conditions import Conditions, divided
from planner.flight.pilot import fence_parameters_of, flight_parameters, make_pilot
from planner.flight.prediction import predict_flight, sample_trace
from planner.flight.returns.destination import make_destinations, with_own_return
from planner.flight.returns.path import make_returns
from planner.flight.returns.tightest import plan_return, return_limits_wh, sweep_returns
from planner.mission.route.route import make_route
from planner.physics.atmosphere import standard_temperature_c
from planner.physics.wind import Wind
from planner.rules.assessment import Assessment
from planner.rules.registry import judge, judge_unflown
from planner.selection import Selection
from planner.service.arguments import refuse_out_of_range, refuse_wrong_types, reserve_of
from planner.service.result import CheckResult
from planner.values import replace

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.flight.conditions import Spread
    from planner.flight.prediction import Flight, ItemArrival
    from planner.flight.returns.destination import Destinations
    from planner.flight.returns.tightest import ReturnSweep
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission
    from planner.mission.route.stage import Route
    from planner.service.result import Verdict
    from planner.site_profile import SiteProfile
    from planner.vehicle.battery import Battery
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.files import ParameterSet
    from planner.vehicle.parameters.resolve import FlightParameters
    from planner.vehicle.parameters.table import Version


def check(
    mission: Mission,
    vehicle: VehicleModel,
    *,
    battery: Battery | None = None,
    charge: float | Spread = 1.0,
    reserve: float | Reserve = 0.2,
    risk: float = 0.05,
    wind: Wind | None = None,
    payload_kg: float | Spread = 0.0,
    temperature_c: float | Spread | None = None,
    position_noise_m: float | None = None,
    battery_health: float | None = None,
    battery_resistance_factor: float | None = None,
    battery_temperature_c: float | None = None,
    reaction_time_s: float = 1.0,
    position_error_m: float = 2.5,
    home_amsl_m: float | None = None,
    speed_m_s: float | None = None,
    autopilot: Autopilot | None = None,
    parameters: ParameterSet | None = None,
    terrain: TerrainGrid | None = None,
    clearance_m: float = 0.0,
    target: Target | None = None,
    profile: SiteProfile | None = None,
    selection: Selection | None = None,
    fail_on: Severity = Severity.ERROR,
    with_trace: bool = False,
) -> CheckResult:
    """Predict a mission and judge it: the main job.

    Parameters
    ----------
    mission : Mission
        As `planner.read_mission` returns it.
    vehicle : VehicleModel
        As `planner.load_vehicle` returns it.
    battery : Battery, optional
        Default the model's own.
    charge : float or Spread
        State of charge at the start, 0 to 1. [-]
    reserve : float or Reserve
        What must stay in the battery; a number is a share of the capacity, 0 to 1. [-]
    risk : float
        Chance of landing below the reserve above which a finding says so, 0 to 1. [-]
    wind : Wind, optional
        Default calm.
    payload_kg : float or Spread
        Mass carried beyond the model's own. [kg]
    temperature_c : float or Spread, optional
        Air temperature at home; default standard for its altitude. [°C]
    position_noise_m : float, optional
        Mean horizontal error of the position in a hover, which slows PX4's time down; default the
        model's. [m]
    battery_health : float, optional
        Charge of the full battery over that of the new one; default as the battery says. [-]
    battery_resistance_factor : float, optional
        Resistance of the battery over that of the new one; default as the battery says. [-]
    battery_temperature_c : float, optional
        Temperature of the battery; default that of the air at home. [°C]
    reaction_time_s : float
        Time until somebody or something reacts, in the room to stop before a fence. [s]
    position_error_m : float
        How far the vehicle may be from where it takes itself to be, in the same. [m]
    home_amsl_m : float, optional
        Altitude of the take-off place; default the mission's own. [m AMSL]
    speed_m_s : float, optional
        Ground speed of every level leg, in place of what the mission commands. [m s⁻¹]
    autopilot : Autopilot, optional
        Who shapes the references; default the model's own way.
    parameters : ParameterSet, optional
        The vehicle's own autopilot parameters; else the model's, else the autopilot's defaults.
        Of a model of step references only its fence is.
    terrain : TerrainGrid, optional
        Heights of the ground; default level with home.
    clearance_m : float
        Height over the terrain that has to be kept. [m]
    target : Target, optional
        Version of the firmware whose rules count; default that of the parameters, else any.
    profile : SiteProfile, optional
        What a site asks for, as `planner.read_profile` returns it.
    selection : Selection, optional
        Which findings to report; default all.
    fail_on : Severity
        From which severity on a finding makes the mission a no-go.
    with_trace : bool
        Whether to sample the flight over time as well.

    Returns
    -------
    CheckResult
        Verdict, totals, segments and findings.

    Raises
    ------
    MissionFileError
        If an item holds a number no vehicle can fly.
    UsageError
        If the model cannot be flown as asked, or a value is out of its range.
    """
    refuse_wrong_types(locals())
    charge, charge_sd = divided(charge)
    to_stay = reserve_of(reserve)
    refuse_out_of_range(clearance_m=clearance_m, charge=charge, risk=risk)
    given = _conditions(
        payload_kg,
        temperature_c,
        wind=wind or Wind(),
        home_amsl_m=home_amsl_m,
        position_noise_m=position_noise_m,
        reaction_time_s=reaction_time_s,
        position_error_m=position_error_m,
        battery_health=battery_health,
        battery_resistance_factor=battery_resistance_factor,
        battery_temperature_c=battery_temperature_c,
    )
    flown_by = vehicle.reference if autopilot is None else autopilot
    if target is not None and flown_by not in {Autopilot.STEP, target.autopilot}:
        msg = f"the rules of {target.label} do not hold for a vehicle flown as {flown_by.label}"
        raise UsageError(msg)
    judged_by = _target(flown_by, target, mission, parameters)
    flown_with, fence_parameters, findings = _parameters(
        vehicle,
        flown_by,
        parameters,
        judged_by=judged_by,
        version=None if target is None else target.version,
        has_rally=bool(mission.rally),
    )
    if position_noise_m is None:
        given = replace(given, position_noise_m=vehicle.position_noise_m)
        findings += _noise_findings(vehicle, flown_by)
    route, replaced = _route(
        mission, judged_by, home_amsl_m=home_amsl_m, terrain=terrain, speed_m_s=speed_m_s
    )
    conditions = replace(given, home_amsl_m=route.home_amsl_m)
    selection = selection or Selection()
    known = vehicle.battery if battery is None else battery
    if known is not None:
        known = known.aged(health=battery_health, resistance_factor=battery_resistance_factor)
    flight: Flight | None = None
    assessment: Assessment | None = None
    totals, budget, home = NOTHING_FLOWN, None, None
    items: tuple[ItemArrival, ...] = ()
    findings += [*mission.findings, *route.findings, *replaced]
    if route.stages:
        route, destinations = _with_destinations(mission, route, flown_with, terrain)
        pilot = make_pilot(vehicle, flown_with, conditions)
        flight = predict_flight(route, vehicle, conditions, pilot)
        findings += (*flight.motion.findings, *destinations.findings)
        discharge = None
        if known is not None and vehicle.is_power_known:
            discharge = predict_discharge(
                flight,
                known,
                charge=charge,
                temperature_c=(
                    flight.power.home_temperature_c
                    if battery_temperature_c is None
                    else battery_temperature_c
                ),
            )
        totals = flight_totals(flight, known, discharge)
        items = item_arrivals(mission, route, flight)
        returns = make_returns(route, flight, pilot, destinations)
        sweep: ReturnSweep | None = None
        if vehicle.is_power_known:
            if known is not None:
                budget = battery_budget(
                    totals,
                    known,
                    charge=charge,
                    reserve=to_stay,
                    hover_power_w=hover_power_w(flight.power),
                    discharge=discharge,
                )
            sweep = sweep_returns(returns, *return_limits_wh(budget))
            home = None if sweep is None else plan_return(returns, sweep, budget)
        if vehicle.spread is not None:
            from planner.flight.uncertainty import predict_scenarios

            scenarios = predict_scenarios(
                returns,
                conditions,
                spread=vehicle.spread,
                charge=(charge, charge_sd),
                battery=known,
                budget=budget,
                sweep=sweep,
            )
            flight, totals, budget, home = scenarios.added_to(flight, totals, budget, home)
        assessment = Assessment(
            mission=mission,
            route=route,
            vehicle=vehicle,
            autopilot=flown_by,
            parameters=flown_with,
            conditions=conditions,
            flight=flight,
            totals=totals,
            items=items,
            pack=known,
            discharge=discharge,
            battery=budget,
            return_plan=home,
            charge=charge,
            returns=returns,
            target=judged_by,
            fence_parameters=fence_parameters,
            given_parameters=parameters,
            terrain=terrain,
            clearance_m=clearance_m,
            given_home_amsl_m=home_amsl_m,
            profile=profile,
            risk=risk,
            charge_sd=charge_sd,
        )
    findings += (
        judge_unflown(mission, flown_by, fence_parameters)
        if assessment is None
        else judge(assessment, selection)
    )
    reported, suppressed = selection.divide(findings, file=mission.source)
    return CheckResult(
        file=mission.source,
        verdict=verdict(reported, fail_on),
        vehicle_name=vehicle.name,
        vehicle_source=vehicle.source,
        conditions=replace(
            conditions,
            temperature_c=standard_temperature_c(route.home_amsl_m)
            if conditions.temperature_c is None
            else conditions.temperature_c,
        ),
        totals=totals,
        battery=budget,
        return_plan=home,
        segments=() if flight is None else flight.segments,
        items=items,
        findings=reported,
        suppressed=suppressed,
        fail_on=fail_on,
        parameters=flown_with,
        trace=sample_trace(flight, route) if with_trace and flight is not None else None,
        assessment=assessment,
        selection=selection,
    )


def _parameters(
    vehicle: VehicleModel,
    flown_by: Autopilot,
    given: ParameterSet | None,
    *,
    judged_by: Target | None,
    version: Version | None,
    has_rally: bool,
) -> tuple[FlightParameters | None, FlightParameters | None, list[Finding]]:
    """Return the parameters a vehicle flies with and those of its fence, and their findings."""
    flown_with, findings = flight_parameters(
        vehicle, flown_by, given, version=version, has_rally=has_rally
    )
    if flown_by is not Autopilot.STEP or given is None:
        return flown_with, flown_with, findings
    fence, told = fence_parameters_of(given, judged_by)
    return flown_with, fence, [*findings, *told]


def _route(
    mission: Mission,
    judged_by: Target | None,
    *,
    home_amsl_m: float | None,
    terrain: TerrainGrid | None,
    speed_m_s: float | None,
) -> tuple[Route, list[Finding]]:
    """Return the route of a mission, and that it asks for another speed than the one given."""
    route = make_route(
        mission,
        dialect=None if judged_by is None else judged_by.autopilot,
        home_amsl_m=home_amsl_m,
        terrain=terrain,
    )
    if speed_m_s is None:
        return route, []
    from planner import quantity
    from planner.mission.convert import SPEED_REPLACED, route_at_speed

    changed = route_at_speed(route, speed_m_s)
    if changed.stages == route.stages:
        return route, []
    message = (
        f"every level leg is flown at {quantity.speed(speed_m_s)} as asked: "
        "the file does not command that"
    )
    return changed, [SPEED_REPLACED.finding(message)]


def _with_destinations(
    mission: Mission,
    route: Route,
    parameters: FlightParameters | None,
    terrain: TerrainGrid | None,
) -> tuple[Route, Destinations]:
    """Return a route whose return leads where the vehicle's does, and where all of them may lead."""
    destinations = make_destinations(mission, route, parameters, terrain=terrain)
    return with_own_return(route, destinations), destinations


def _conditions(
    payload_kg: float | Spread,
    temperature_c: float | Spread | None,
    **exact: Any,  # noqa: ANN401 - the fields of the conditions by their names
) -> Conditions:
    """Return the conditions that a caller gives.

    Raises
    ------
    UsageError
        If a value is out of its range.
    """
    mean_kg, sd_kg = divided(payload_kg)
    mean_c, sd_c = (None, 0.0) if temperature_c is None else divided(temperature_c)
    try:
        return Conditions(
            payload_kg=mean_kg,
            payload_sd_kg=sd_kg,
            temperature_c=mean_c,
            temperature_sd_c=sd_c,
            **exact,
        )
    except ValueError as error:
        raise UsageError(str(error)) from error


def _target(
    flown_by: Autopilot, target: Target | None, mission: Mission, given: ParameterSet | None
) -> Target | None:
    """Return whose rules a mission has to meet: of what flies it, else of what it is for."""
    if target is not None:
        return target
    autopilot = mission.autopilot if flown_by is Autopilot.STEP else flown_by
    if autopilot is None:
        return None
    is_known = given is not None and given.stack is autopilot
    return Target(autopilot, given.version if given is not None and is_known else None)


def _noise_findings(vehicle: VehicleModel, flown_by: Autopilot) -> list[Finding]:
    """Return what is said of a position noise that is the model's."""
    if flown_by is not Autopilot.PX4 or not vehicle.position_noise_m > 0.0:
        return []
    from planner.flight.pilot import NOISE_ASSUMED

    return [
        NOISE_ASSUMED.finding(
            f"a position noise of {vehicle.position_noise_m:g} m is taken from {vehicle.name}: "
            "PX4 slows down for it and wanders"
        )
    ]


def verdict(findings: tuple[Finding, ...], fail_on: Severity) -> Verdict:
    """Return no-go where a finding is as bad as ``fail_on``, or worse."""
    return "no-go" if any(finding.severity >= fail_on for finding in findings) else "go"
