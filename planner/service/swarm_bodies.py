"""The vehicles of a fleet made ready to fly as a swarm."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.fleet.swarm.flights import first_landing
from planner.fleet.swarm.simulation import Agent
from planner.flight.motion.steps import SPEED_TOLERANCE
from planner.flight.pilot import flight_parameters, make_pilot
from planner.flight.prediction import predict_flight
from planner.geo.geodesy import LocalFrame
from planner.mission.route.stage import Route, Stage, StageKind
from planner.physics.response import StepResponse, TransferFunction
from planner.quantity import mean_of
from planner.service.fleet import initial_charge, setup_with
from planner.service.swarm_dynamics import agent_dynamics
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.fleet.fleet import Fleet, FleetVehicle, Pack, SwarmTask
    from planner.flight.prediction import Flight
    from planner.setup import Setup

_LEAST_M = 1.0
"""The plane is no lower above any pad. [m]"""


class SwarmBody(Value, eq=False):
    """One vehicle ready to be simulated."""

    agent: Agent
    setup: Setup
    vertical: Flight
    height_m: float
    """Of the plane above its home. [m]"""
    stop_m: float
    """Farthest it gets when told to stop at its speed. [m]"""


def make_bodies(fleet: Fleet, task: SwarmTask) -> tuple[LocalFrame, list[SwarmBody], list[str]]:
    """Return the vehicles ready to fly, in the frame of the first pad, and who has no pack of the file."""
    without = [one.name for one in fleet.vehicles.values() if one.pad is None]
    if without:
        msg = (
            f"{fleet.source}: vehicle.{without[0]}: pad is missing: a swarm takes off from its pads"
        )
        raise UsageError(msg)
    pads = [fleet.pads[one.pad] for one in fleet.vehicles.values() if one.pad is not None]
    frame = LocalFrame(latitude_deg=pads[0].latitude_deg, longitude_deg=pads[0].longitude_deg)
    plane_m = task.height_m
    assert plane_m is not None  # the table sees to it
    taken: set[str] = set()
    bodies, unpacked = [], []
    for vehicle, pad in zip(fleet.vehicles.values(), pads, strict=True):
        pack = _free_pack(fleet, vehicle, taken)
        if pack is None:
            unpacked.append(vehicle.name)
        charge = 1.0 if pack is None else mean_of(initial_charge(pack))
        setup = setup_with(vehicle.setup, pack, None if pack is None else charge, 0.0)
        rise_m = 0.0
        if pads[0].amsl_m is not None and pad.amsl_m is not None:
            rise_m = pads[0].amsl_m - pad.amsl_m
        if plane_m + rise_m < _LEAST_M:
            msg = (
                f"{fleet.source}: swarm.height_m: {quantity.height(plane_m)} above the first pad is "
                f"{quantity.height(plane_m + rise_m)} above pad {pad.name}: give {quantity.height(_LEAST_M)} "
                "or more above each"
            )
            raise UsageError(msg)
        bodies.append(
            _body(
                vehicle,
                setup,
                frame.east_north_m(pad.latitude_deg, pad.longitude_deg),
                height_m=plane_m + rise_m,
                home_amsl_m=pad.amsl_m or 0.0,
            )
        )
    return frame, bodies, unpacked


def _free_pack(fleet: Fleet, vehicle: FleetVehicle, taken: set[str]) -> Pack | None:
    """Return the pack a vehicle takes of those that are left: the first of those that fit the fewest."""
    free = [
        one
        for one in fleet.packs.values()
        if one.name not in taken and (not one.fits or vehicle.name in one.fits)
    ]
    if not free:
        return None
    pack = min(free, key=lambda one: len(one.fits) or math.inf)
    taken.add(pack.name)
    return pack


def _body(
    vehicle: FleetVehicle,
    setup: Setup,
    place_m: tuple[FloatArray, FloatArray],
    *,
    height_m: float,
    home_amsl_m: float,
) -> SwarmBody:
    """Return one vehicle with its way up and down, and how it answers velocities."""
    parameters, _ = flight_parameters(setup)
    pilot = make_pilot(setup, parameters)
    route = Route(
        stages=(
            Stage(StageKind.TAKEOFF, 1, 0.0, 0.0, height_m),
            Stage(StageKind.LAND, 2, 0.0, 0.0, 0.0),
        ),
        frame=LocalFrame(latitude_deg=0.0, longitude_deg=0.0),
        home_amsl_m=home_amsl_m,
    )
    vertical = predict_flight(route, setup, pilot)
    lands = first_landing(vertical.motion)
    durations = vertical.motion.segments.duration_s
    dynamics, speed_m_s = agent_dynamics(setup, pilot)
    settle_s = None
    if math.isinf(dynamics.acceleration_m_s2):
        settle_s = _settle_s(dynamics.response)
    return SwarmBody(
        agent=Agent(
            name=vehicle.name,
            dynamics=dynamics,
            speed_m_s=speed_m_s,
            east_m=float(place_m[0]),
            north_m=float(place_m[1]),
            start_s=vehicle.available_from_s,
            climb_s=float(durations[:lands].sum()),
            landing_s=float(durations[lands:].sum()),
            settle_s=settle_s,
            error_m=setup.position_margin_m,
        ),
        setup=setup,
        vertical=vertical,
        height_m=height_m,
        stop_m=float(pilot.farthest_stop_m(np.array([speed_m_s]))[0]),
    )


@lru_cache(maxsize=64)
def _settle_s(response: TransferFunction) -> float:
    """Return how long a stop takes until the legs of a mission count it as one. [s]"""
    return float(StepResponse(system=response).settling_times_s(SPEED_TOLERANCE))
