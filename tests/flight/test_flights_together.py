"""Flights that are flown as one motion: each is what it is alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import item, mission, north, rtl, speed, takeoff, waypoint

from planner.flight.pilot import make_pilot
from planner.flight.prediction import predict_costs, predict_flight
from planner.mission.route.route import make_route
from planner.physics.wind import Wind
from planner.setup import Setup
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.vehicle.parameters.resolve import FlightParameters

FLOWN_BY: dict[str, FlightParameters | None] = {
    "dji-matrice-100": None,
    "arducopter-sitl-quad": ArduPilotParameters(),
    "px4-sih-quad": Px4Parameters(),
    "px4-quad-2kg": Px4Parameters(),
}
SPLINE, TURNS, TO_ALTITUDE = 82, 18, 31
MISSIONS = (
    mission(takeoff(20), waypoint(150, 40), speed(4.0), waypoint(300, 40), rtl()),
    mission(
        takeoff(30),
        waypoint(200, 30),
        waypoint(200, 60, hold_s=5.0),
        waypoint(0, 20),
        item(21, north(50)),
    ),
    mission(takeoff(15), *(item(SPLINE, north(60.0 * n), 15.0 + n) for n in range(1, 5)), rtl()),
    mission(takeoff(25), item(TURNS, north(80), 25, params=(2, 0, 20, 0)), waypoint(300, 25)),
    mission(takeoff(25), item(TO_ALTITUDE, north(90), 60, params=(0, 30, 0, 0)), waypoint(5, 9)),
    mission(takeoff(10), speed(12.0), waypoint(900, 10), rtl()),
)


@pytest.mark.parametrize("name", FLOWN_BY)
@pytest.mark.parametrize("wind_m_s", [0.0, 6.0])
def test_a_flight_among_others_is_what_it_is_alone(name: str, wind_m_s: float) -> None:
    """Whatever flight comes before or after, and in whatever order they are."""
    setup = Setup(load_vehicle(name), wind=Wind(speed_m_s=wind_m_s, from_deg=30.0))
    pilot = make_pilot(setup, FLOWN_BY[name])
    routes = [make_route(one) for one in MISSIONS]
    alone = [predict_flight(route, setup, pilot) for route in routes]
    orders = (np.arange(len(routes)), np.arange(len(routes))[::-1], np.array([2, 2, 3, 0]))
    for order in orders:
        energy_j, time_s = predict_costs([routes[n] for n in order], setup, pilot)
        # the same arithmetic; only the times of pieces are counted from the start of the first flight
        np.testing.assert_allclose(time_s, [alone[n].time_s for n in order], rtol=1e-11)
        np.testing.assert_allclose(energy_j, [alone[n].energy_j for n in order], rtol=1e-11)
