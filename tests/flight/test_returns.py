"""Returns from any point of a flight: stopping, destinations, and the tightest point."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import (
    METRES_PER_DEGREE_NORTH,
    item,
    mission,
    north,
    rtl,
    speed,
    takeoff,
    waypoint,
)

from planner.flight.motion.kinematics import STATE_INDEX, FlightState, KinematicState
from planner.flight.pilot import make_pilot
from planner.flight.prediction import predict_flight
from planner.flight.returns.destination import make_destinations
from planner.flight.returns.path import Returns, make_returns, return_profile
from planner.flight.returns.sample import spread_up_to
from planner.flight.returns.tightest import sweep_returns
from planner.geo.fence import RallyPoint
from planner.mission.route.route import make_route
from planner.physics.wind import Wind
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.mission.items import Mission
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.resolve import FlightParameters

SURVEY_QUAD = load_vehicle("arducopter-sitl-quad")
ARTICLE = load_vehicle("falkowski-2023-quadrotor")
ARDUPILOT = ArduPilotParameters()
FLOWN_BY: dict[str, tuple[VehicleModel, FlightParameters | None]] = {
    "steps": (ARTICLE, None),
    "ramps": (load_vehicle("dji-matrice-100"), None),
    "ardupilot": (SURVEY_QUAD, ARDUPILOT),
    "px4": (SURVEY_QUAD, Px4Parameters()),
}


def returns_of(
    flown: Mission,
    parameters: FlightParameters | None = ARDUPILOT,
    *,
    wind: Wind | None = None,
    vehicle: VehicleModel | None = None,
) -> Returns:
    if vehicle is None:
        vehicle = ARTICLE if parameters is None else SURVEY_QUAD
    setup = Setup(vehicle, wind=wind or Wind())
    pilot = make_pilot(setup, parameters)
    route = make_route(flown)
    flight = predict_flight(route, setup, pilot)
    return make_returns(route, flight, pilot, make_destinations(flown, route, parameters))


def dense_points(home: Returns, per_segment: int = 40) -> tuple[FloatArray, FloatArray]:
    """Return times and sums of used energy and return over many even points. [s], [Wh]"""
    stages = home.route.stages
    judged = [
        s
        for s in range(len(home.start_s))
        if stages[home.segment_stage[s]].kind not in {"land", "return"}
        and home.flight.motion.segments.state[s] != 0
    ]
    segment = np.repeat(judged, per_segment + 1)
    fraction = np.tile(np.linspace(0.0, 1.0, per_segment + 1), len(judged))
    points = home.points(segment, fraction)
    _, way_wh = home.fly(points.stop_m, points.stage, home.chosen(points))
    return points.time_s, points.used_wh + points.stop_wh + way_wh


def rally(north_m: float, height_m: float = 0.0) -> RallyPoint:
    return RallyPoint(
        latitude_deg=47.0 + north_m / METRES_PER_DEGREE_NORTH,
        longitude_deg=8.0,
        height_above_home_m=height_m,
    )


MISSIONS = {
    "out and back": mission(takeoff(50), waypoint(800, 50), waypoint(0, 50), rtl()),
    "past two rally points": replace(
        mission(takeoff(50), waypoint(3000, 50), rtl()), rally=(rally(1000.0), rally(3000.0))
    ),
    "near home": replace(
        mission(takeoff(8), waypoint(14, 20), waypoint(-9, 5), waypoint(40, 5), rtl()),
        rally=(rally(12.0, 30.0),),
    ),
    "steps of height": mission(takeoff(20), waypoint(300, 120), waypoint(600, 20), rtl()),
    "zigzag": mission(takeoff(30), *(waypoint(200.0 * (i % 3), 30) for i in range(1, 30)), rtl()),
}


@pytest.mark.parametrize("wind", [Wind(), Wind(speed_m_s=6.0, from_deg=20.0)])
@pytest.mark.parametrize("name", MISSIONS)
@pytest.mark.parametrize(
    "parameters", [None, ARDUPILOT, Px4Parameters()], ids=["steps", "ardupilot", "px4"]
)
def test_no_point_of_a_flight_is_tighter_than_the_one_found(
    name: str, parameters: FlightParameters | None, wind: Wind
) -> None:
    home = returns_of(MISSIONS[name], parameters, wind=wind)
    sweep = sweep_returns(home)
    assert sweep is not None
    # 0.1 %: what the sweep leaves open.
    assert sweep.sum_wh[sweep.tightest] >= dense_points(home)[1].max() * (1.0 - 1e-3)


def drawn_mission(draw: random.Random) -> Mission:
    """Return a mission about home, or away from it, at any height and speed, perhaps with rally points."""
    extent_m = draw.choice((60.0, 400.0, 3000.0))

    def place_m() -> float:
        return draw.uniform(-extent_m, extent_m)

    items = [takeoff(draw.uniform(5.0, 60.0))]
    for _ in range(draw.randint(1, 8)):
        east_deg = 8.0 + place_m() / METRES_PER_DEGREE_NORTH
        height_m, hold_s = draw.uniform(3.0, 120.0), draw.choice((0.0, 0.0, 40.0))
        place = north(place_m())
        items.append(item(16, place, height_m, longitude_deg=east_deg, params=(hold_s, 0, 0, 0)))
        if draw.random() < 0.5:
            items.append(speed(draw.uniform(1.0, 15.0)))
    points = [rally(place_m(), draw.uniform(0.0, 80.0)) for _ in range(draw.randint(0, 2))]
    return replace(mission(*items, rtl()), rally=tuple(points))


# The same missions every time: of others, drawn on until one did, one hid a point 0.5 % tighter.
@pytest.mark.parametrize("seed", range(50))
def test_no_point_of_any_flight_is_tighter_than_the_one_found(seed: int) -> None:
    draw = random.Random(seed)
    flown, name = drawn_mission(draw), draw.choice(sorted(FLOWN_BY))
    wind = Wind(speed_m_s=draw.choice((0.0, 4.0, 8.0)), from_deg=draw.uniform(0.0, 360.0))
    vehicle, parameters = FLOWN_BY[name]
    home = returns_of(flown, parameters, wind=wind, vehicle=vehicle)
    sweep = sweep_returns(home)
    assert sweep is not None
    assert sweep.sum_wh[sweep.tightest] >= dense_points(home)[1].max() * (1.0 - 1e-3)


@pytest.mark.parametrize("name", MISSIONS)
@pytest.mark.parametrize(
    "parameters", [None, ARDUPILOT, Px4Parameters()], ids=["steps", "ardupilot", "px4"]
)
def test_the_last_point_below_an_energy_comes_before_all_that_exceed_it(
    name: str, parameters: FlightParameters | None
) -> None:
    home = returns_of(MISSIONS[name], parameters)
    time_s, sum_wh = dense_points(home)
    limits_wh = (0.75 * sum_wh.max(), 0.9 * sum_wh.max())
    sweep = sweep_returns(home, *limits_wh)
    assert sweep is not None
    for limit_wh in limits_wh:
        row = sweep.last_below(limit_wh)
        assert row is not None
        # 0.1 %: what the sweep leaves open.
        before_wh = sum_wh[time_s < sweep.time_s[row]].max(initial=0.0)
        assert before_wh <= limit_wh * (1.0 + 1e-3)
        assert sweep.sum_wh[row + 1] > limit_wh
        assert sweep.time_s[row + 1] - sweep.time_s[row] < 0.01 * home.flight.time_s
        if sweep.sum_wh[0] <= limit_wh:
            assert sweep.sum_wh[row] <= limit_wh


@pytest.mark.parametrize("flown_by", FLOWN_BY)
def test_a_sample_flown_with_further_returns_is_as_flown_alone(flown_by: str) -> None:
    vehicle, parameters = FLOWN_BY[flown_by]
    alone, joined = (
        returns_of(MISSIONS["zigzag"], parameters, vehicle=vehicle, wind=Wind(speed_m_s=4.0))
        for _ in range(2)
    )
    assert alone.sample is not None
    sweep_returns(joined, 0.2 * float(joined.used_wh[-1]))
    both = joined.sample
    assert both is not None
    assert both.points.segment.tolist() == alone.sample.points.segment.tolist()
    assert both.destination.tolist() == alone.sample.destination.tolist()
    assert both.energy_wh == pytest.approx(alone.sample.energy_wh, rel=1e-12)
    assert both.time_s == pytest.approx(alone.sample.time_s, rel=1e-12)
    one, other = both.flight, alone.sample.flight
    assert one.node_power_w == pytest.approx(other.node_power_w, rel=1e-9)
    assert one.motion.segments.item.tolist() == other.motion.segments.item.tolist()
    assert one.motion.nodes.state.east_m == pytest.approx(other.motion.nodes.state.east_m, abs=1e-9)


def test_no_point_is_the_last_below_an_energy_that_nothing_exceeds() -> None:
    sweep = sweep_returns(returns_of(MISSIONS["out and back"]))
    assert sweep is not None
    assert sweep.last_below(1e6) is None


def test_between_home_and_a_rally_point_the_middle_is_tightest_for_the_way() -> None:
    # From 0 to 3 km with a rally point at the far end: the way is longest half-way.
    flown = replace(mission(takeoff(50), waypoint(3000, 50), rtl()), rally=(rally(3000.0),))
    home = returns_of(flown, replace(ARDUPILOT, rally_limit_m=0.0))
    cruise = int(np.argmax(home.flight.motion.segments.distance_m))
    fraction = np.linspace(0.0, 1.0, 21)
    points = home.points(np.full(21, cruise), fraction)
    destination = home.chosen(points)
    assert destination[0] == 0
    assert destination[-1] == 1
    _, way_wh = home.fly(points.stop_m, points.stage, destination)
    middle = points.place_m[np.argmax(way_wh), 1]
    assert middle == pytest.approx(1500.0, abs=150.0)


def test_a_rally_point_beyond_its_limit_is_not_taken_though_home_is_farther() -> None:
    """``AP_Rally::find_nearest_rally_point``: RALLY_LIMIT_KM is 0.3."""
    flown = replace(mission(takeoff(50), waypoint(2500, 50), rtl()), rally=(rally(2000.0),))
    points_m = np.array([[0.0, metres, 50.0] for metres in (900.0, 1100.0, 1690.0, 1710.0, 2310.0)])
    stage = np.ones(len(points_m), dtype=np.intp)
    for parameters in (ARDUPILOT, replace(ARDUPILOT, rally_includes_home=0)):
        chosen = returns_of(flown, parameters).destinations.chosen(points_m, stage)
        assert chosen.tolist() == [0, 0, 0, 1, 0]


@pytest.mark.parametrize(
    ("given", "height_m", "taken"),
    [
        ({"fence_type": 1, "fence_height_max_m": 60.0}, 60.0, True),
        ({"fence_type": 1, "fence_height_max_m": 60.0}, 60.1, False),
        ({"fence_type": 8, "fence_height_max_m": 60.0}, 60.1, True),
        ({"fence_type": 8, "fence_height_min_m": 30.0}, 30.0, True),
        ({"fence_type": 8, "fence_height_min_m": 30.0}, 29.9, False),
        ({"fence_type": 2, "fence_radius_m": 2001.0}, 20.0, True),
        ({"fence_type": 2, "fence_radius_m": 1999.0}, 20.0, False),
    ],
)
@pytest.mark.parametrize(
    ("enable", "switched", "is_on"),
    [(1, None, True), (0, None, False), (1, 0.0, False), (0, 1.0, True)],
)
def test_a_rally_point_beyond_the_limits_of_the_fence_is_not_taken(
    given: dict[str, float],
    height_m: float,
    enable: int,
    switched: float | None,
    *,
    taken: bool,
    is_on: bool,
) -> None:
    """``AP_Rally_Copter::is_valid`` asks what is on as the return begins."""
    items = [] if switched is None else [item(207, frame=2, params=(switched, 0.0, 0.0, 0.0))]
    flown = mission(takeoff(50), *items, waypoint(2500, 50), rtl())
    flown = replace(flown, rally=(rally(2000.0, height_m),))
    parameters = replace(ARDUPILOT, fence_enable=enable, **given)
    destinations = returns_of(flown, parameters).destinations
    chosen = destinations.chosen(np.array([[0.0, 2000.0, 50.0]]), np.array([1]))
    assert chosen.tolist() == [int(taken or not is_on)]


@pytest.mark.parametrize(
    ("kind", "chosen"), [(0, 1), (1, 1), (2, -2), (3, 1), (4, -2), (5, 1), (6, 0)]
)
def test_px4_looks_at_rally_points_as_its_return_type_says(kind: int, chosen: int) -> None:
    flown = replace(mission(takeoff(50), waypoint(2000, 50), rtl()), rally=(rally(1000.0),))
    home = returns_of(flown, replace(Px4Parameters(), return_type=kind))
    found = home.destinations.chosen(np.array([[0.0, 900.0, 50.0]]), np.array([1]))
    assert found.tolist() == [chosen]


def test_px4_takes_a_rally_point_only_where_it_is_nearer_by_two_metres() -> None:
    flown = replace(mission(takeoff(50), waypoint(2000, 50), rtl()), rally=(rally(1000.0),))
    home = returns_of(flown, Px4Parameters())
    points_m = np.array([[0.0, 500.9, 50.0], [0.0, 501.1, 50.0]])
    assert home.destinations.chosen(points_m, np.array([1, 1])).tolist() == [0, 1]


@pytest.mark.parametrize(("north_m", "kind", "chosen"), [(9.9, 0, 0), (10.1, 0, 1), (9.9, 5, 1)])
def test_a_rally_point_at_home_is_home_to_px4_unless_it_returns_to_rally_points_alone(
    north_m: float, kind: int, chosen: int
) -> None:
    flown = replace(mission(takeoff(50), waypoint(2000, 50), rtl()), rally=(rally(north_m),))
    home = returns_of(flown, replace(Px4Parameters(), return_type=kind))
    found = home.destinations.chosen(np.array([[0.0, 900.0, 50.0]]), np.array([1]))
    assert found.tolist() == [chosen]


def test_home_is_where_do_set_home_has_moved_it() -> None:
    moved = item(179, 47.0 + 1000.0 / METRES_PER_DEGREE_NORTH, 0.0)
    flown = mission(takeoff(50), waypoint(1000, 50), moved, waypoint(1500, 50), rtl())
    home = returns_of(flown)
    # By the straight way: 1500 m from the first home before, 500 m from the second behind it.
    points_m = np.array([[0.0, 1000.0, 50.0], [0.0, 1500.0, 50.0]])
    time_s, _ = home.fly(points_m, np.array([1, 2]), 0)
    # 10 m/s over the 500 m that are missing.
    assert time_s[0] - time_s[1] == pytest.approx(50.0, abs=0.2)


def test_a_return_stands_still_first_then_climbs_goes_home_and_lands() -> None:
    flown = mission(takeoff(10), waypoint(2000, 10), rtl())
    home = returns_of(flown)
    outward = home.segment_stage == 1
    cruise = int(np.argmax(outward * home.flight.motion.segments.distance_m))
    points = home.points(np.array([cruise]), np.array([0.5]))
    [corners] = home.corners_m(points)
    # From 10 m/s, 35 m were measured; RTL_ALT is 15 m.
    assert corners[1, 1] - corners[0, 1] == pytest.approx(25.0, abs=12.0)
    assert corners[2].tolist() == [corners[1, 0], corners[1, 1], 15.0]
    assert corners[3].tolist() == [0.0, 0.0, 15.0]
    assert corners[4].tolist() == [0.0, 0.0, 0.0]


def test_the_energy_of_a_stop_is_that_of_braking_evenly() -> None:
    home = returns_of(MISSIONS["out and back"])
    cruise = int(np.argmax(home.flight.motion.segments.distance_m))
    points = home.points(np.array([cruise]), np.array([0.5]))
    speed_m_s = np.linspace(10.0, 0.0, 1000)
    zero = np.zeros_like(speed_m_s)
    state = KinematicState(
        east_m=zero,
        north_m=zero,
        height_m=zero + 50.0,
        east_m_s=zero,
        north_m_s=speed_m_s,
        climb_m_s=zero,
    )
    brakes = np.full(len(zero), STATE_INDEX[FlightState.BRAKE])
    slowing = np.stack((zero, zero - 10.0 / points.stop_s[0], zero))
    mean_w = float(
        home.flight.power.power_w(state, brakes, zero + 10.0, acceleration_m_s2=slowing).mean()
    )
    # The power bends over the speed: Simpson's three points are within a percent of its mean.
    assert points.stop_wh[0] == pytest.approx(mean_w * points.stop_s[0] / 3600.0, rel=0.01)
    assert np.hypot(*(points.stop_m - points.place_m)[0, :2]) == pytest.approx(
        0.5 * 10.0 * points.stop_s[0], rel=2e-3
    )


def test_a_leg_into_a_stop_stops_where_and_when_the_leg_does() -> None:
    home = returns_of(MISSIONS["out and back"], None)
    columns = home.flight.motion.segments
    brake = int(np.flatnonzero(columns.state == STATE_INDEX[FlightState.BRAKE])[0])
    fraction = np.linspace(0.0, 1.0, 5)
    braking = home.points(np.full(5, brake), fraction)
    assert braking.time_s + braking.stop_s == pytest.approx(columns.end_s[brake])
    assert braking.used_wh + braking.stop_wh == pytest.approx(home.used_wh[brake + 1])
    cruising = home.points(np.full(5, brake - 1), fraction)
    ahead_m = np.hypot(*(cruising.stop_m - cruising.place_m)[:, :2].T)
    assert ahead_m == pytest.approx(columns.distance_m[brake])
    assert cruising.stop_s == pytest.approx(columns.duration_s[brake])


def test_reference_steps_stop_at_half_their_speed_on_average() -> None:
    speed_m_s = np.array([ARTICLE.default_speed_m_s or 0.0])
    length_m, stop_s = make_pilot(Setup(ARTICLE), None).stop(speed_m_s)
    assert length_m == pytest.approx(0.5 * speed_m_s * stop_s)


def test_a_straight_return_takes_its_cruise_power_over_its_cruise_time() -> None:
    # The difference of two long ways: level flight at 10 m/s alone.
    home = returns_of(MISSIONS["out and back"])
    points_m = np.array([[0.0, 1000.0, 50.0], [0.0, 2000.0, 50.0]])
    time_s, energy_wh = home.fly(points_m, np.array([1, 1]), 0)
    assert np.diff(time_s) == pytest.approx(100.0, rel=2e-3)  # ArduPilot's metres: 0.13 % shorter
    # 322 W at 10 m/s as recorded; the model was fitted to within a few percent.
    assert np.diff(energy_wh) == pytest.approx(322.0 * 100.0 / 3600.0, rel=0.04)


def test_a_return_against_the_wind_costs_more_than_with_it_at_10_m_s() -> None:
    # The survey quad has its least power at 8 m/s: 10 m/s into 5 m/s of wind is 15 m/s of airspeed.
    points_m = np.array([[0.0, 2000.0, 50.0]])
    stage = np.array([1])
    found = [
        float(returns_of(MISSIONS["out and back"], wind=wind).fly(points_m, stage, 0)[1][0])
        for wind in (Wind(speed_m_s=5.0, from_deg=180.0), Wind(), Wind(speed_m_s=5.0, from_deg=0.0))
    ]
    assert found[0] > found[1]
    assert found[0] > found[2]


def test_px4_counts_the_heights_of_a_return_from_its_rally_point() -> None:
    flown = replace(mission(takeoff(20), waypoint(2000, 20), rtl()), rally=(rally(1500.0, 40.0),))
    home = returns_of(flown, Px4Parameters())
    points = home.points(np.array([len(home.start_s) // 2]), np.array([0.0]))
    targets = home.destinations.targets(points.stage, 1, points.stop_m)
    # RTL_RETURN_ALT 30 m over the 40 m of the rally point.
    assert home.pilot.return_heights_m(points.stop_m, targets) == pytest.approx(70.0)
    # ArduPilot flies at the rally point's own height, if that is above RTL_ALT.
    pilot = returns_of(flown).pilot
    assert pilot.return_heights_m(points.stop_m, targets) == pytest.approx(40.0)


def test_a_profile_holds_the_return_to_home_and_to_each_rally_point() -> None:
    home = returns_of(MISSIONS["past two rally points"])
    profile = return_profile(home)
    count = len(profile.time_s)
    assert profile.rally_wh.shape == (count, 2)
    assert (np.diff(profile.time_s) >= 0.0).all()
    assert (np.diff(profile.used_wh) >= 0.0).all()
    # The vehicle's own choice is one of the ways, and at 3 km the rally point there.
    far = int(np.argmax(np.where(profile.item == 2, profile.time_s, 0.0)))
    assert profile.destination[far] == 2
    assert profile.return_wh[far] == profile.rally_wh[far, 1]
    assert profile.along_m[far] == pytest.approx(3000.0, rel=2e-3)
    # 3 km at 10 m/s and 322 W are 26.8 Wh; the landings are alike.
    assert profile.home_wh[far] - profile.rally_wh[far, 1] == pytest.approx(26.8, rel=0.05)


@pytest.mark.parametrize(("parameters", "codes"), [(None, ["T112"]), (ARDUPILOT, [])])
def test_a_return_at_a_height_nobody_gave_is_told(
    parameters: FlightParameters | None, codes: list[str]
) -> None:
    vehicle = ARTICLE if parameters is None else SURVEY_QUAD
    pilot = make_pilot(Setup(vehicle), parameters)
    motion, _ = pilot.fly(make_route(mission(takeoff(50), waypoint(300, 35), rtl())))
    assert [one.code for one in motion.findings] == codes
    assert all(one.item == 3 and "35 m above home" in one.message for one in motion.findings)


def test_a_landing_needs_no_height_to_return_at() -> None:
    flown = mission(takeoff(50), waypoint(300, 35), item(21, 47.0, 0.0))
    assert make_pilot(Setup(ARTICLE), None).fly(make_route(flown))[0].findings == ()


@pytest.mark.parametrize("name", ["out and back", "zigzag"])
@pytest.mark.parametrize("parameters", [ARDUPILOT, Px4Parameters()], ids=["ardupilot", "px4"])
def test_returns_are_flown_from_the_same_points_in_any_wind_and_for_any_limit(
    name: str, parameters: FlightParameters
) -> None:
    """What a flight that moves alike takes decides nothing about from where returns are flown."""
    calm = returns_of(MISSIONS[name], parameters)
    windy = returns_of(MISSIONS[name], parameters, wind=Wind(speed_m_s=0.5, from_deg=200.0))
    assert calm.sample is not None
    assert windy.sample is not None
    assert calm.flight.energy_j != windy.flight.energy_j
    for own, other in (
        (calm.sample.points.segment, windy.sample.points.segment),
        (calm.sample.points.fraction, windy.sample.points.fraction),
    ):
        np.testing.assert_array_equal(own, other)
    # limits in the same half, quarter, … of the flight have the same points; in its last half none
    time_s = np.array([0.20, 0.21, 0.95]) * calm.flight.time_s
    limits_wh = np.interp(time_s, calm.start_s, calm.used_wh[:-1]).tolist()
    (segment, fraction), near, late = (spread_up_to(calm, limit_wh) for limit_wh in limits_wh)
    np.testing.assert_array_equal(segment, near[0])
    np.testing.assert_array_equal(fraction, near[1])
    assert len(segment)
    assert not len(late[0])


def test_pieces_of_no_duration_take_no_power() -> None:
    # the ramps of the Matrice brake by 2 m/s² or so; rounding over a piece of 1e-16 s was hundreds of m/s²
    legs = takeoff(40), speed(8.0), waypoint(300, 40), waypoint(0, 40), waypoint(310, 40), rtl()
    returns = returns_of(mission(*legs), None, vehicle=load_vehicle("dji-matrice-100"))
    assert returns.sample is not None
    motion = returns.sample.flight.motion
    assert motion.piece_duration_s[motion.piece_duration_s > 0.0].min() < 1e-12
    assert np.abs(motion.node_acceleration_m_s2).max() < 9.81
