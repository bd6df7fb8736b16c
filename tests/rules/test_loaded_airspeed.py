"""What a load changes of the airspeed at the greatest lean: it leans less against the same drag."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PX4, found, vehicle_of

from planner.flight.motion.px4.pilot import Px4Pilot
from planner.flight.pilot import airspeed_limit_m_s, make_pilot, shown_airspeed_m_s
from planner.physics.wind import Wind
from planner.quantity import Spread
from planner.service.preflight import check
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import Aloft
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

QUAD = replace(
    vehicle_of(ARDUPILOT),
    mass_kg=3.0,
    airspeed_limit_m_s=10.21,
    airspeed_limit_lean_deg=30.0,
    drag_exponent=1.48,
)
"""As ArduCopter's simulator flies its default quadrotor of 3 kg."""
LINES = (takeoff(60), *(waypoint(280, 60), waypoint(0, 60)) * 2)
GRIPPER, SERVO = 211, 183


@pytest.mark.parametrize(
    ("exponent", "times_heavier", "limit_m_s"),
    [
        (1.0, 4.0 / 3.0, 10.0 * 4.0 / 3.0),
        (2.0, 4.0 / 3.0, 10.0 * math.sqrt(4.0 / 3.0)),
        (None, 4.0 / 3.0, 10.0 * math.sqrt(4.0 / 3.0)),  # the slower of what is possible
        (None, 0.8, 8.0),
        (1.0, 1.0, 10.0),
        (1.0, 1.99, 19.9),
        (1.0, 2.01, 10.0 * math.sqrt(2.01)),  # too far for an exponent found with less drag
    ],
)
def test_weight_leans_against_more_drag(
    exponent: float | None, times_heavier: float, limit_m_s: float
) -> None:
    model = replace(QUAD, airspeed_limit_m_s=10.0, drag_exponent=exponent)
    thirty = replace(ArduPilotParameters(), lean_angle_max_rad=math.radians(30.0))
    found_m_s = airspeed_limit_m_s(model, thirty, Aloft(times_heavier=times_heavier))
    assert found_m_s == pytest.approx(limit_m_s)
    # certain is what drag by the square leaves
    sure_m_s = shown_airspeed_m_s(model, thirty, Aloft(times_heavier=times_heavier))
    assert sure_m_s == pytest.approx(min(limit_m_s, 10.0 * math.sqrt(max(times_heavier, 1.0))))


@pytest.mark.parametrize(
    ("more", "times"),
    [
        ({}, 1.0),
        ({"payload_kg": 1.0}, 4.0 / 3.0),
        (
            {"payload_kg": Spread(mean=1.0, sd=0.2)},
            3.6 / 3.0,
        ),  # two standard deviations less are certain
        ({"payload_kg": Spread(mean=0.3, sd=0.2)}, 1.0),
        ({"payload_kg": 1.0, "keeps_load": False}, 1.0),
        ({"payload_kg": 1.0, "vehicle": load_vehicle("falkowski-2023-quadrotor")}, 1.0),
    ],
)
def test_what_is_certain_to_be_carried_counts(more: dict[str, Any], times: float) -> None:
    assert Setup(**({"vehicle": QUAD} | more)).aloft.times_heavier == pytest.approx(times)


def flown_s(*items: MissionItem, parameters: str = "") -> float:
    given = parameters_from_text(parameters.encode(), source="p.param") if parameters else None
    wind = Wind(speed_m_s=9.3, from_deg=0.0)
    result = check(mission(*items), QUAD, wind=wind, payload_kg=1.0, parameters=given)
    return result.totals.time_s


def test_a_load_is_flown_against_the_wind_as_it_was_flown() -> None:
    """By ArduCopter's simulator with 4 kg: 345 s; 3 kg come forward at 0.9 m/s, in more than twice that."""
    assert flown_s(*LINES, rtl()) == pytest.approx(345.0, rel=0.03)


@pytest.mark.parametrize("command", [GRIPPER, SERVO])
def test_a_load_that_may_be_let_go_holds_nothing_against_the_wind(command: int) -> None:
    assert flown_s(*LINES, item(command, frame=2), rtl()) > 2.0 * 345.0


def test_nor_does_a_load_that_may_stay_where_a_vehicle_lands() -> None:
    stops = (item(21, north(0), 0.0), takeoff(60), rtl())
    onward = "MIS_OPTIONS,4\nWPNAV_SPEED,1000\n"
    assert flown_s(*LINES, *stops, parameters=onward) > 2.0 * 345.0


def test_the_wind_a_load_holds_is_no_error() -> None:
    one = mission(takeoff(60), item(21, north(0), 0.0))
    for wind_m_s, payload_kg, fires in (
        (10.5, 0.0, True),
        # 10.21 (4/3)^(1/1.48) = 12.40; sinking at 1.5 m/s by 30°, v^0.48 (U + 0.866) = 12.40^1.48: 11.8
        (11.7, 1.0, False),
        (12.5, 1.0, True),
    ):
        wind = Wind(speed_m_s=wind_m_s)
        codes = [
            f.code for f in found(one, ARDUPILOT, vehicle=QUAD, wind=wind, payload_kg=payload_kg)
        ]
        assert ("W101" in codes) == fires


def test_in_denser_air_a_vehicle_holds_less_airspeed() -> None:
    """ArduCopter's simulator leaning 30°: 11.32 m/s over 2500 m, 10.21 m/s over 400 m."""
    held = replace(
        QUAD, airspeed_limit_m_s=11.32, airspeed_limit_air_density_kg_m3=0.953, drag_exponent=None
    )
    lean_rad = math.radians(30.0)
    found_m_s = held.airspeed_limit_at(lean_rad, Aloft(air_density_kg_m3=1.176))
    assert found_m_s == pytest.approx(10.21, rel=0.003)
    assert held.airspeed_limit_at(lean_rad, Aloft(air_density_kg_m3=0.953)) == 11.32
    assert held.airspeed_limit_at(lean_rad, Aloft()) == 11.32
    unknown = replace(held, airspeed_limit_air_density_kg_m3=None)
    assert unknown.airspeed_limit_at(lean_rad, Aloft(air_density_kg_m3=1.176)) == 11.32
    # home is 400 m above the sea; sinking at 1.5 m/s takes 0.87 m/s
    one = mission(takeoff(60), item(21, north(0), 0.0))
    for model, wind_m_s, fires in ((held, 9.4, True), (held, 9.3, False), (unknown, 10.4, False)):
        wind = Wind(speed_m_s=wind_m_s)
        codes = [f.code for f in found(one, ARDUPILOT, vehicle=model, wind=wind)]
        assert ("W101" in codes) == fires


def test_px4_lags_less_by_the_drag_of_a_heavier_vehicle() -> None:
    model = replace(vehicle_of(PX4), mass_kg=2.0, drag_per_s=0.6)
    pilot = make_pilot(Setup(vehicle=model, payload_kg=1.0), Px4Parameters())
    assert isinstance(pilot, Px4Pilot)
    assert pilot.drag_per_s == pytest.approx(0.4)
