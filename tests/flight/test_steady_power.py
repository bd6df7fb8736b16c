"""Power where a vehicle is and moves: wind, ground, loads, and what responses already describe."""

from __future__ import annotations

import numpy as np
import pytest

from planner.flight.motion.kinematics import STATE_INDEX, STATES, FlightState, KinematicState
from planner.flight.motion.ramps import fly_ramps
from planner.flight.motion.steps import StepLegs, StepSpeeds
from planner.flight.power import NO_TRANSIENTS, SteadyPower
from planner.flight.prediction import make_flight
from planner.mission.route.stage import Stage, StageKind
from planner.physics.rotor import Acceleration, Rotor, momentum_power_w
from planner.physics.wind import Wind
from planner.values import field_values, replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import Loads, VehicleModel
from planner.vehicle.power import CruisePower, MomentumLaw, VerticalPower

SURVEY = load_vehicle("arducopter-sitl-quad")
ARTICLE = load_vehicle("falkowski-2023-quadrotor")
TABLE = CruisePower(speed_m_s=(5.0, 10.0, 15.0), power_above_hover_w=(-10.0, 20.0, 90.0))


def state(
    east_m_s: float = 0.0, north_m_s: float = 0.0, climb_m_s: float = 0.0, height_m: float = 50.0
) -> KinematicState:
    return KinematicState(
        east_m=np.zeros(1),
        north_m=np.zeros(1),
        height_m=np.array([height_m]),
        east_m_s=np.array([east_m_s]),
        north_m_s=np.array([north_m_s]),
        climb_m_s=np.array([climb_m_s]),
    )


def power_w(
    vehicle: VehicleModel,
    moving: KinematicState,
    *,
    phase: FlightState = FlightState.CRUISE,
    commanded_m_s: float = 10.0,
    wind: Wind | None = None,
    is_grounded: bool | None = None,
    payload_kg: float = 0.0,
    home_amsl_m: float = 488.0,
    acceleration_m_s2: tuple[float, float, float] | None = None,
) -> float:
    power = SteadyPower(
        vehicle=vehicle,
        mass_kg=None if vehicle.mass_kg is None else vehicle.mass_kg + payload_kg,
        home_amsl_m=home_amsl_m,
        home_temperature_c=15.0 - 0.0065 * home_amsl_m,
        wind=wind or Wind(),
    )
    [watts] = power.power_w(
        moving,
        np.array([STATE_INDEX[phase]]),
        np.array([commanded_m_s]),
        None if is_grounded is None else np.array([is_grounded]),
        None if acceleration_m_s2 is None else np.array(acceleration_m_s2)[:, None],
    )
    return float(watts)


@pytest.mark.parametrize(
    ("speed_m_s", "climb_m_s", "recorded_w"),
    [
        (0.0, 0.0, 353.0),
        (3.0, 0.0, 331.0),
        (5.0, 0.0, 307.0),
        (8.0, 0.0, 298.0),
        (10.0, 0.0, 322.0),
        (12.0, 0.0, 370.0),
        (15.0, 0.0, 482.0),
        (0.0, 2.5, 458.0),
        (0.0, -1.5, 302.0),
    ],
)
def test_the_survey_quad_takes_what_was_recorded(
    speed_m_s: float, climb_m_s: float, recorded_w: float
) -> None:
    # The recorded figures are means over tens of metres of height, a watt or so each.
    watts = power_w(SURVEY, state(east_m_s=speed_m_s, climb_m_s=climb_m_s))
    assert watts == pytest.approx(recorded_w, abs=1.6)


def test_hover_high_in_the_mountains_takes_what_was_recorded() -> None:
    # 393 W were recorded 200 m over a home at 2500 m, 355 W over one at 488 m.
    high, low = (
        power_w(SURVEY, state(height_m=200.0), home_amsl_m=home_m) for home_m in (2500.0, 488.0)
    )
    assert [high, low] == pytest.approx([393.0, 355.0], abs=1.5)


def test_a_headwind_adds_to_the_airspeed_and_a_tailwind_takes_from_it() -> None:
    wind = Wind(speed_m_s=5.0, from_deg=90.0)  # from the east
    east, west = state(east_m_s=10.0), state(east_m_s=-10.0)
    assert power_w(SURVEY, east, wind=wind) == pytest.approx(power_w(SURVEY, state(east_m_s=15.0)))
    assert power_w(SURVEY, west, wind=wind) == pytest.approx(power_w(SURVEY, state(east_m_s=5.0)))


def test_hover_in_wind_is_flight_at_its_speed() -> None:
    wind = Wind(speed_m_s=8.0, from_deg=33.0)
    assert power_w(SURVEY, state(), wind=wind) == pytest.approx(
        power_w(SURVEY, state(north_m_s=8.0))
    )


def test_the_wind_of_a_profile_is_that_of_the_height() -> None:
    # An exponent of one half: twice the wind at four times the height.
    wind = Wind(speed_m_s=4.0, from_deg=0.0, reference_height_m=10.0, shear_exponent=0.5)
    calm = power_w(SURVEY, state(north_m_s=8.0, height_m=40.0))
    assert power_w(SURVEY, state(height_m=40.0), wind=wind) == pytest.approx(calm)


def test_on_the_ground_only_the_loads_draw_power() -> None:
    loaded = replace(SURVEY, loads=Loads(avionics_w=9.0, ground_idle_w=4.0))
    flying = power_w(SURVEY, state(), is_grounded=False)
    assert power_w(loaded, state(), is_grounded=True) == pytest.approx(13.0)
    assert power_w(loaded, state(), is_grounded=False) == pytest.approx(flying + 9.0)


def test_without_known_loads_turning_rotors_on_the_ground_cost_hover_power() -> None:
    unknown = replace(SURVEY, loads=None)
    assert power_w(unknown, state(), is_grounded=True) == power_w(unknown, state())


def test_a_power_that_was_not_identified_is_no_number() -> None:
    assert np.isnan(power_w(load_vehicle("px4-sih-quad"), state()))


def test_a_table_of_the_articles_vehicle_counts_the_wind() -> None:
    model = replace(ARTICLE, cruise=TABLE)
    hover = power_w(ARTICLE, state())
    cruising = state(east_m_s=10.0)
    assert power_w(model, cruising) == pytest.approx(hover + 20.0)
    headwind = Wind(speed_m_s=5.0, from_deg=90.0)
    assert power_w(model, cruising, wind=headwind) == pytest.approx(hover + 90.0)
    standing = power_w(model, state(), phase=FlightState.HOVER, wind=headwind)
    assert standing == pytest.approx(hover - 10.0)


def test_accelerating_the_power_grows_in_proportion_to_the_speed() -> None:
    model = replace(ARTICLE, cruise=TABLE)
    hover = power_w(ARTICLE, state())
    halfway = state(east_m_s=5.0)
    # Half of the 20 W of the cruise it leads to, whatever the table has for 5 m/s.
    assert power_w(model, halfway, phase=FlightState.ACCELERATE) == pytest.approx(hover + 10.0)
    # From standing in 5 m/s of wind, −10 W, to cruising against it, 90 W.
    wind = Wind(speed_m_s=5.0, from_deg=90.0)
    grown = power_w(model, halfway, phase=FlightState.ACCELERATE, wind=wind)
    assert grown == pytest.approx(hover + 40.0)


def test_what_a_response_describes_is_not_counted_again() -> None:
    vertical = VerticalPower(climb_rate_m_s=(-2.0, 3.0), power_above_hover_w=(-20.0, 60.0))
    model = replace(ARTICLE, cruise=TABLE, vertical=vertical)
    hover = power_w(ARTICLE, state())
    # The article has responses for braking, climb and descent.
    assert power_w(model, state(east_m_s=10.0), phase=FlightState.BRAKE) == pytest.approx(hover)
    for climb_m_s in (3.0, -2.0):
        climbing = state(climb_m_s=climb_m_s)
        assert power_w(model, climbing, phase=FlightState.CLIMB) == pytest.approx(hover)
    bare = replace(
        model,
        responses=replace(model.responses, brake_power=None, climb_power=None, descent_power=None),
    )
    braking = power_w(bare, state(east_m_s=10.0), phase=FlightState.BRAKE)
    assert braking == pytest.approx(hover + 20.0)
    climbing_w = power_w(bare, state(climb_m_s=3.0), phase=FlightState.CLIMB)
    assert climbing_w == pytest.approx(hover + 60.0)


def test_a_whole_law_may_stand_on_another_hover_law() -> None:
    # Hover by the article's altitude law, what moving adds by momentum theory.
    model = replace(ARTICLE, cruise=SURVEY.cruise, mass_kg=SURVEY.mass_kg)
    added = power_w(SURVEY, state(east_m_s=12.0)) - power_w(SURVEY, state())
    hover = power_w(ARTICLE, state())
    assert power_w(model, state(east_m_s=12.0)) == pytest.approx(hover + added)


def test_accelerations_count_along_and_across_the_airspeed() -> None:
    # Over ground to the north, through the air to the south-east: 3 m/s² to the east gain and turn alike.
    wind = Wind(speed_m_s=10.0 * np.sqrt(2.0), from_deg=135.0)
    east_then_north = [
        power_w(SURVEY, state(), wind=wind, acceleration_m_s2=one)
        for one in ((3.0, 0.0, 0.0), (0.0, -3.0, 0.0))
    ]
    assert east_then_north[0] == pytest.approx(east_then_north[1], rel=1e-9)
    gaining = 3.0 / np.sqrt(2.0)
    same = power_w(
        SURVEY, state(north_m_s=10.0 * np.sqrt(2.0)), acceleration_m_s2=(gaining, gaining, 0.0)
    )
    assert east_then_north[0] == pytest.approx(same, rel=1e-9)


def test_what_a_response_describes_does_not_accelerate_either() -> None:
    model = replace(ARTICLE, cruise=SURVEY.cruise, mass_kg=SURVEY.mass_kg)
    braking = state(east_m_s=10.0)
    calm = power_w(model, braking, phase=FlightState.BRAKE)
    slowing = (-3.0, 0.0, 0.0)
    assert power_w(model, braking, phase=FlightState.BRAKE, acceleration_m_s2=slowing) == calm
    rising, faster = state(climb_m_s=3.0), (0.0, 0.0, 2.0)
    calm = power_w(model, rising, phase=FlightState.CLIMB)
    assert power_w(model, rising, phase=FlightState.CLIMB, acceleration_m_s2=faster) == calm


def test_a_predicted_leg_takes_the_power_of_its_acceleration() -> None:
    # From rest at 2 m/s², 4 m/s at half of 16 m: by the law at that speed and acceleration
    vehicle = replace(load_vehicle("dji-matrice-100"), loads=None)
    assert vehicle.ramps is not None
    assert isinstance(vehicle.cruise, MomentumLaw)
    assert vehicle.mass_kg is not None
    ramps = replace(vehicle.ramps, acceleration_m_s2=2.0, braking_m_s2=4.0)
    stages = (
        Stage(kind=StageKind.TAKEOFF, item=1, east_m=0.0, north_m=0.0, height_m=30.0),
        Stage(kind=StageKind.GO, item=2, east_m=200.0, north_m=0.0, height_m=30.0, speed_m_s=8.0),
    )
    motion = fly_ramps(StepLegs.of(stages, speeds=StepSpeeds(8.0, 8.0)), ramps)
    power = SteadyPower(
        vehicle=vehicle,
        mass_kg=vehicle.mass_kg,
        home_amsl_m=0.0,
        home_temperature_c=15.0,
        wind=Wind(),
    )
    flight = make_flight(motion, NO_TRANSIENTS, power)
    names = [STATES[index] for index in motion.segments.state.tolist()]
    rotor = Rotor(**field_values(vehicle.cruise))
    for phase, along_m_s2 in ((FlightState.ACCELERATE, 2.0), (FlightState.BRAKE, -4.0)):
        segment = names.index(phase)
        start_s, end_s = (
            float(motion.segments.start_s[segment]),
            float(motion.segments.end_s[segment]),
        )
        expected = momentum_power_w(
            4.0,
            0.0,
            rotor,
            mass_kg=vehicle.mass_kg,
            air_density_kg_m3=power.air_density_kg_m3(30.0),
            acceleration=Acceleration(along_m_s2, 0.0, 0.0),
        )
        [watts] = flight.power_w(np.array([0.5 * (start_s + end_s)]))
        assert watts == pytest.approx(float(expected), rel=1e-9)
        # four nodes against 2,000 trapezoids: 1e-4, as the power is no polynomial
        times = np.linspace(start_s, end_s, 2001)[1:-1]
        mean_w = float(np.trapezoid(flight.power_w(times), times)) / float(np.ptp(times))
        joules = mean_w * (end_s - start_s)
        assert flight.segment_energy_j[segment] == pytest.approx(joules, rel=1e-3)


def test_the_rounding_of_a_speed_in_a_piece_of_no_length_is_no_acceleration() -> None:
    # A return that begins in flight has pieces of 1e-17 s: 402 m/s² were found in one at 5.9 m/s.
    vehicle = load_vehicle("dji-matrice-100")
    assert vehicle.ramps is not None
    stages = (
        Stage(kind=StageKind.TAKEOFF, item=1, east_m=0.0, north_m=0.0, height_m=30.0),
        Stage(kind=StageKind.GO, item=2, east_m=200.0, north_m=0.0, height_m=30.0, speed_m_s=8.0),
    )
    motion = fly_ramps(StepLegs.of(stages, speeds=StepSpeeds(8.0, 8.0)), vehicle.ramps)
    least = min(vehicle.ramps.acceleration_m_s2, vehicle.ramps.braking_m_s2)
    cruise = int(np.argmax(motion.segments.state == STATE_INDEX[FlightState.CRUISE]))
    piece = int(np.argmax(motion.piece_segment == cruise))
    durations = motion.piece_duration_s.copy()
    durations[piece] = 1e-17
    node_time_s, speed_m_s = motion.nodes.time_s[piece], motion.nodes.state.ground_speed_m_s[piece]
    assert node_time_s[-1] > 1.0
    assert speed_m_s == pytest.approx(8.0)
    short = replace(motion, piece_duration_s=durations)
    assert np.abs(short.node_acceleration_m_s2[:, piece]).max() == 0.0
    assert np.abs(short.node_acceleration_m_s2).max() > least
