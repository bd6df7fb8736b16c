"""What a flight is predicted from: a mission and a setup, with what follows from both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot, Target
from planner.errors import UsageError
from planner.findings import Severity
from planner.flight.pilot import (
    NOISE_ASSUMED,
    flight_parameters,
    habits_of,
    make_queue_pilots,
    own_parameters_of,
    shown_airspeed_m_s,
)
from planner.flight.returns.destination import make_destinations, with_own_returns
from planner.mission.items import Mission
from planner.mission.parts import keeps_load
from planner.mission.route.route import OTHER_VEHICLE, make_route
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding
    from planner.mission.route.queue import Firing
    from planner.mission.route.stage import Route
    from planner.setup import Setup
    from planner.vehicle.parameters.resolve import FlightParameters


class Preparation(Value):
    """What a flight is predicted from: a mission and a setup, with what follows from both."""

    mission: Mission
    setup: Setup
    """With the position noise that counts."""
    target: Target | None
    """Whose rules the mission has to meet: of what flies it, of steps of its parameters or the file."""
    parameters: FlightParameters | None
    """What the autopilot is taken to fly with; ``None`` for reference steps."""
    own_parameters: FlightParameters | None
    """Those of the vehicle itself: ``parameters``, or of reference steps what their file holds."""
    route: Route
    findings: tuple[Finding, ...]


def prepare(mission: Mission, setup: Setup) -> Preparation:
    """Return what the flight of a mission is predicted from."""
    given: object = mission
    if not isinstance(given, Mission):
        msg = f"mission must be planner.read_mission(path): got {given!r:.60}"
        raise UsageError(msg)
    setup, target, found_first = _who_flies(mission, setup)
    parameters, found = flight_parameters(
        setup,
        version=None if setup.target is None else setup.target.version,
        has_rally=bool(mission.rally),
    )
    found += found_first
    own_parameters = parameters
    if setup.flown_by is Autopilot.STEP and setup.parameters is not None:
        own_parameters, noted = own_parameters_of(
            setup.parameters, target, has_rally=bool(mission.rally)
        )
        found += noted
    vehicle = setup.vehicle
    if setup.position_noise_m is None:
        setup = replace(setup, position_noise_m=vehicle.position_noise_m)
        if setup.flown_by is Autopilot.PX4 and vehicle.position_noise_m > 0.0:
            message = (
                f"position noise {vehicle.position_noise_m:g} m, as in the model {vehicle.name}: PX4 "
                "flies more slowly and wanders"
            )
            found.append(NOISE_ASSUMED.finding(message))
    replaced = False

    def laid_out(firings: Mapping[int, Firing]) -> Route:
        nonlocal replaced
        route = make_route(
            mission,
            dialect=None if target is None else target.autopilot,
            is_assumed=target is not None and target.is_assumed,
            home_amsl_m=setup.home_amsl_m,
            terrain=setup.terrain,
            firings=firings,
            habits=habits_of(own_parameters, target),
        )
        if setup.speed_m_s is None:
            return route
        from planner.mission.convert import route_at_speed

        changed = route_at_speed(route, setup.speed_m_s)
        replaced = changed.stages != route.stages
        return changed

    route = laid_out({})
    setup = _with_load_and_air(setup, mission, route)
    if route.held:
        from planner.flight.held_items import QueueFlights, route_with_queue
        from planner.flight.uncounted import late_segments_s

        def laid_home(firings: Mapping[int, Firing]) -> Route:
            own = laid_out(firings)
            places = make_destinations(mission, own, own_parameters, terrain=setup.terrain)
            return with_own_returns(own, places)

        shown_m_s = shown_airspeed_m_s(vehicle, own_parameters, setup.aloft)
        flights = QueueFlights(
            pilots=make_queue_pilots(setup, own_parameters, target),
            late_s=lambda motion: late_segments_s(motion, vehicle, setup.wind, shown_m_s),
        )
        route = route_with_queue(mission, laid_home, flights)
    is_ardupilot = target is not None and target.autopilot is Autopilot.ARDUPILOT
    is_copter = is_ardupilot and _is_of_copter(setup)
    found += [
        replace(one, severity=Severity.WARNING)
        if is_copter and one.code == OTHER_VEHICLE.code and one.severity is Severity.ERROR
        else one
        for one in (*mission.findings, *route.findings)
    ]
    if replaced:
        found.append(_speed_replaced(setup))
    return Preparation(
        mission=mission,
        setup=setup,
        target=target,
        parameters=parameters,
        own_parameters=own_parameters,
        route=route,
        findings=tuple(found),
    )


def _with_load_and_air(setup: Setup, mission: Mission, route: Route) -> Setup:
    """Return a setup with what the lean at an airspeed goes by: what is carried, and the air at home.

    No air of the flight is denser, but in a descent below home.
    """
    setup = replace(setup, keeps_load=keeps_load(mission, route))
    if setup.vehicle.airspeed_limit_air_density_kg_m3 is None:
        return setup
    from planner.flight.prediction import steady_power

    at_home = steady_power(route, setup).air_density_kg_m3(0.0)
    return replace(setup, air_density_kg_m3=float(at_home))


def _who_flies(mission: Mission, setup: Setup) -> tuple[Setup, Target | None, list[Finding]]:
    """Return a setup that is flown by whoever is named, and whose rules the mission has to meet.

    Where the model's autopilot is assumed and ``--autopilot`` states none, its parameters, its target or the
    mission's file name it, which is said.  Those of reference steps name whose rules count.
    """
    given, target, vehicle = setup.parameters, setup.target, setup.vehicle
    named = [
        (None if given is None else given.stack, "its parameters are"),
        (None if target is None else target.autopilot, "the target is"),
        (mission.autopilot, "the mission's file is"),
    ]
    by, whose = next((one for one in named if one[0] not in {None, Autopilot.STEP}), (None, ""))
    is_open = setup.autopilot is None and vehicle.reference_assumed
    found = []
    if is_open and by is not None and by is not vehicle.reference:
        from planner.rules.model import AUTOPILOT_DIFFERS

        message = (
            f"flown by {by.label}, as {whose} for it: the model {vehicle.name} only assumes "
            f"{vehicle.reference.label}; state it with --autopilot"
        )
        found.append(AUTOPILOT_DIFFERS.finding(message))
        setup = replace(setup, autopilot=by)
    if target is not None:
        _refuse_another(target, setup)
        return setup, target, found
    autopilot = by if setup.flown_by is Autopilot.STEP else setup.flown_by
    if autopilot is None:
        return setup, None, found
    version = given.version if given is not None and given.stack is autopilot else None
    return setup, Target(autopilot, version, is_assumed=is_open and by is None), found


def _refuse_another(target: Target, setup: Setup) -> None:
    """Refuse a target of another autopilot than that of the vehicle or of its parameters."""
    flown_by, given = setup.flown_by, setup.parameters
    if flown_by not in {Autopilot.STEP, target.autopilot}:
        msg = f"the rules of {target.label} do not hold for a vehicle flown as {flown_by.label}"
        raise UsageError(msg)
    if given is not None and given.stack not in {None, target.autopilot}:
        msg = (
            f"the rules of {target.label} do not hold for a vehicle with {given.stack.label}'s "
            f"parameters: {given.source}"
        )
        raise UsageError(msg)


def at_speed(prepared: Preparation, speed_m_s: float) -> Preparation:
    """Return what `prepare` makes of a mission at one speed of every level leg from what it made at its own.

    Of a route that holds nothing back: a condition may be met elsewhere at another speed.
    """
    from planner.mission.convert import route_at_speed

    setup = replace(prepared.setup, speed_m_s=speed_m_s)
    route, found = route_at_speed(prepared.route, speed_m_s), prepared.findings
    if route.stages != prepared.route.stages:
        found += (_speed_replaced(setup),)
    return replace(prepared, setup=setup, route=route, findings=found)


def _speed_replaced(setup: Setup) -> Finding:
    from planner.mission.convert import SPEED_REPLACED

    return SPEED_REPLACED.finding(
        f"predicted at {quantity.speed(setup.speed_m_s)} on every level leg: the file commands other "
        "speeds"
    )


_NO_PLANES = frozenset({"FRAME_CLASS", "FS_THR_ENABLE"})
"""Of copters and rovers; planes have Q_FRAME_CLASS and THR_FAILSAFE."""


def _is_of_copter(setup: Setup) -> bool:
    """Return whether ArduCopter is asked for, or parameters are given that no plane has.

    Without parameters what flies it tells: all models are of multicopters.
    """
    if setup.target is not None and setup.target.autopilot is Autopilot.ARDUPILOT:
        return True
    if setup.parameters is None:
        return setup.flown_by is Autopilot.ARDUPILOT
    from planner.vehicle.parameters.resolve import COPTER_ONLY

    return not (COPTER_ONLY | _NO_PLANES).isdisjoint(setup.parameters.values)


def over_its_ground(prepared: Preparation) -> Preparation:
    """Return what a flight is predicted from, with the lowest ground in its wind's profile."""
    setup, route = prepared.setup, prepared.route
    wind, terrain = setup.wind, setup.terrain
    if wind.reference_height_m is None or terrain is None:
        return prepared
    rally = [(point.latitude_deg, point.longitude_deg) for point in prepared.mission.rally]
    places_m = np.array(
        [
            (0.0, 0.0),
            *((stage.east_m, stage.north_m) for stage in route.stages),
            *(route.frame.east_north_m(*place) for place in rally),
        ]
    )
    ends_m = np.stack((places_m.min(axis=0), places_m.max(axis=0)))
    ground_m = terrain.heights_within_amsl_m(*route.frame.latitude_longitude_deg(*ends_m.T))
    below_m = route.ground_datum_m - float(ground_m.filled(np.inf).min())
    if not below_m > 0.0:
        return prepared
    return replace(prepared, setup=replace(setup, wind=replace(wind, ground_below_m=below_m)))
