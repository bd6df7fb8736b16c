"""Circles of ArduPilot: how fast they are flown, and the lean they ask for in wind, by hand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import DEFAULTS, ends, fly, go, home, stage, states, takeoff, time_s, took_s
from ardupilot_times import leg_s
from made_missions import item, mission, north
from made_missions import takeoff as takeoff_to

from planner.autopilot import Autopilot, Target
from planner.findings import Severity
from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.flight.pilot import habits_of
from planner.mission.route.route import make_route
from planner.mission.route.stage import StageKind
from planner.mission.route.state import VehicleHabits
from planner.physics.wind import Wind
from planner.values import replace
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.resolve import resolve_parameters

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import Motion

LIMIT_M_S = 15.0


def circling_s(wind_m_s: float) -> float:
    """Return the time of a flight with a circle."""
    circle = stage(StageKind.CIRCLE, 0.0, 0.0, 20.0, speed=10.0, turns=2, radius=20.0)
    motion = fly_ardupilot(
        (takeoff(20.0), circle),
        DEFAULTS,
        wind=Wind(speed_m_s=wind_m_s, from_deg=90.0),
        airspeed_limit_m_s=LIMIT_M_S,
    )
    return time_s(motion)


def test_a_circle_takes_its_time_in_any_wind() -> None:
    # Its target turns on at its rate: nothing waits for the vehicle.
    # The way to its edge is flown as before.
    assert circling_s(9.5) == pytest.approx(circling_s(0.0), abs=0.1)


def circle_s(parameters: ArduPilotParameters, *, speed: float = 10.0, turns: float = 2.0) -> float:
    """The circle alone: it begins where the vehicle is, on its edge."""
    motion = fly(
        takeoff(),
        stage(StageKind.GO, 20.0, hold=1.0),
        stage(StageKind.CIRCLE, turns=turns, radius=20.0, speed=speed),
        parameters=parameters,
    )
    return took_s(motion, 2)


def test_a_circle_of_20_m_at_4_m_s_takes_31_seconds_a_turn() -> None:
    # 2π 20/4 = 31.4 s; recorded 31 to 32 s.
    assert circle_s(DEFAULTS, speed=4.0, turns=3) - circle_s(
        DEFAULTS, speed=4.0, turns=2
    ) == pytest.approx(2 * math.pi * 5.0, abs=1e-6)


@pytest.mark.parametrize(
    ("parameters", "rate"),
    [
        (DEFAULTS, (0.5 * 2.5 * 20) ** 0.5 / 20),
        (ArduPilotParameters(acceleration_m_s2=1.6), 4.0 / 20),
        (ArduPilotParameters(circle_rate_rad_s=0.1), 0.1),
    ],
    ids=["half the acceleration", "WP_ACC", "CIRCLE_RATE"],
)
def test_circles_are_as_fast_as_their_rate_and_half_the_acceleration_allow(
    parameters: ArduPilotParameters, rate: float
) -> None:
    speeding_up = 0.5 * rate / (parameters.acceleration_m_s2 / 20)
    assert circle_s(parameters) == pytest.approx(4 * math.pi / rate + speeding_up, abs=1e-6)


def test_circles_turn_clockwise_and_the_other_way_for_a_negative_radius() -> None:
    for radius, way in ((20.0, -1.0), (-20.0, 1.0)):
        motion = fly(takeoff(), go(20.0, hold=1.0), stage(StageKind.CIRCLE, turns=1, radius=radius))
        begun = float(motion.segments.end_s[motion.done_segment[1]])
        state = motion.state_at_time(np.array([begun + 1.0]))
        assert np.sign(state.north_m_s[0]) == way  # east of the centre, northwards or southwards


def radius_m(motion: Motion, time_s: float) -> float:
    """Distance from the centre, which is home, at a time."""
    state = motion.state_at_time(np.array([time_s]))
    return float(np.hypot(state.east_m[0], state.north_m[0]))


@pytest.mark.parametrize(("radius", "speed"), [(20.0, 10.0), (60.0, 10.0), (20.0, 2.0)])
def test_the_reference_is_pulled_round_inside_the_circle_that_its_target_describes(
    radius: float, speed: float
) -> None:
    circle = stage(StageKind.CIRCLE, 100.0, turns=3, radius=radius, speed=speed)
    motion = fly(takeoff(), replace(circle, east_m=0.0, north_m=0.0), home())
    end_s = float(motion.segments.end_s[motion.arrival_segment[1]])
    r = radius_m(motion, end_s - 1.0)
    # Steady: acceleration −ω² r = 2 (w − i ω r), so w = (i ω − ω²/2) r is the speed asked for; it is
    # sqrt(2.5 e − 1.5625) at e from the target, or e below 1.25 m, and leads there: |r + e w/|w|| = R.
    rate = min(speed, math.sqrt(0.5 * 2.5 * radius)) / radius
    asked = r * rate * math.hypot(1.0, rate / 2.0)
    error = asked if asked < 1.25 else (asked**2 + 1.5625) / 2.5
    inward = (rate / 2.0) / math.hypot(1.0, rate / 2.0)
    target = math.sqrt(r**2 + error**2 - 2.0 * r * error * inward)
    # The autopilot's steps of 2.5 ms are 20 here: the target is so much farther on.
    assert target == pytest.approx(radius, abs=0.02 * rate * radius)
    assert r < radius


def test_a_circle_of_15_m_is_flown_as_recorded() -> None:
    # ArduCopter 4.7.0-dev in SITL, whose lean limit is 10.24 m/s: 14.42 m at 4.14 m/s.
    circle = stage(StageKind.CIRCLE, 0.0, 0.0, 20.0, turns=2, radius=15.0)
    motion = fly_ardupilot((takeoff(20.0), circle), DEFAULTS, airspeed_limit_m_s=10.24)
    end_s = float(motion.segments.end_s[motion.arrival_segment[1]])
    assert radius_m(motion, end_s - 2.0) == pytest.approx(14.42, abs=0.05)
    state = motion.state_at_time(np.array([end_s - 2.0]))
    assert state.ground_speed_m_s[0] == pytest.approx(4.14, abs=0.03)


def test_the_leg_behind_a_circle_begins_at_once_as_recorded() -> None:
    # Flown in SITL: circles of 10 m twice and 30 m counter-clockwise once, and a waypoint behind.
    circles = (
        stage(StageKind.CIRCLE, 0.0, 60.0, 20.0, turns=2, radius=10.0),
        stage(StageKind.CIRCLE, 60.0, 60.0, 20.0, turns=1, radius=-30.0),
    )
    motion = fly_ardupilot(
        (takeoff(20.0), *circles, go(80.0, 0.0, 20.0), home()), DEFAULTS, airspeed_limit_m_s=10.24
    )
    arrivals = motion.segments.end_s[motion.arrival_segment]
    assert arrivals[1:] == pytest.approx([63.86, 107.82, 123.37, 174.89], abs=0.5)
    assert motion.segments.distance_m.sum() == pytest.approx(523.6, rel=0.02)
    # The motion is one: no piece begins where, or otherwise than, the one before ended.
    position, velocity = ends(motion)
    assert np.abs(position[1, :-1] - position[0, 1:]).max() < 0.02
    assert np.abs(velocity[1, :-1] - velocity[0, 1:])[:, :2].max() < 0.05


def test_a_circle_is_flown_to_from_more_than_three_metres() -> None:
    motion = fly(takeoff(), stage(StageKind.CIRCLE, 100.0, turns=1, radius=20.0))
    assert motion.segments.duration_s[1:4].sum() == pytest.approx(leg_s(80.0), abs=1e-6)


@pytest.mark.parametrize("off_m", [0.8, 1.5])
def test_a_circle_with_its_edge_within_three_metres_is_begun_where_the_vehicle_is(
    off_m: float,
) -> None:
    # Its target goes round 2 m from the centre all the same, and draws the vehicle out there.
    motion = fly(
        takeoff(),
        go(off_m, hold=1.0),
        stage(StageKind.CIRCLE, turns=3, radius=2.0),
        parameters=ArduPilotParameters(circle_rate_rad_s=0.1),
    )
    begun_s = float(motion.segments.end_s[motion.done_segment[1]])
    assert radius_m(motion, begun_s) == pytest.approx(off_m, abs=1e-6)
    assert radius_m(motion, begun_s + 20.0) == pytest.approx(2.0, abs=0.02)


def test_a_circle_of_no_turns_ends_at_its_edge() -> None:
    motion = fly(takeoff(), stage(StageKind.CIRCLE, 100.0, turns=0, radius=20.0), go(100.0))
    assert motion.segments.distance_m.sum() == pytest.approx(100.0, abs=1e-6)


def test_a_circle_at_no_rate_ends_at_its_edge() -> None:
    still = ArduPilotParameters(circle_rate_rad_s=0.0)
    motion = fly(
        takeoff(),
        stage(StageKind.CIRCLE, 100.0, turns=0.5, radius=20.0),
        go(0.0, hold=1.0),
        parameters=still,
    )
    assert motion.segments.distance_m.sum() == pytest.approx(80.0 + 80.0, abs=1e-6)


def test_a_circle_without_any_radius_is_a_turn_on_the_spot() -> None:
    motion = fly(
        takeoff(),
        stage(StageKind.CIRCLE, turns=2),
        parameters=ArduPilotParameters(circle_rate_rad_s=0.5),
    )
    assert states(motion)[-1] == "hover"
    # The rate of 0.5 is reached within a second: half a second more.
    assert motion.segments.duration_s[-1] == pytest.approx(4 * math.pi / 0.5 + 0.5, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "version", "radius_m"),
    [
        ("CIRCLE_RADIUS,3000\n", (4, 6), 30.0),
        ("CIRCLE_RADIUS_M,30\n", (4, 7), 0.0),
        ("CIRCLE_RADIUS_M,30\n", (4, 8), 30.0),
        ("", (4, 6), 10.0),
    ],
)
def test_circle_radius_is_used_where_the_item_has_none_but_by_4_7(
    text: str, version: tuple[int, int], radius_m: float
) -> None:
    target = Target(Autopilot.ARDUPILOT, version)
    file = parameters_from_text(text.encode(), source="p.param") if text else None
    given = resolve_parameters(Autopilot.ARDUPILOT, file=file, version=version).values
    circle = item(18, north(100), 30.0, params=(1.0, 0.0, 0.0, 0.0))
    habits = habits_of(given, target)
    route = make_route(mission(takeoff_to(20), circle), dialect=Autopilot.ARDUPILOT, habits=habits)
    assert route.stages[1].radius_m == radius_m


@pytest.mark.parametrize("rate_deg_s", [15, -15])
def test_circles_of_4_7_go_round_by_the_sign_of_circle_rate(rate_deg_s: int) -> None:
    target = Target(Autopilot.ARDUPILOT, (4, 7))
    file = parameters_from_text(b"CIRCLE_RATE,%d\n" % rate_deg_s, source="p.param")
    given = resolve_parameters(Autopilot.ARDUPILOT, file=file, version=(4, 7)).values
    circle = item(18, north(100), 30.0, params=(1.0, 0.0, -20.0 if rate_deg_s > 0 else 20.0, 0.0))
    habits = habits_of(given, target)
    route = make_route(mission(takeoff_to(20), circle), dialect=Autopilot.ARDUPILOT, habits=habits)
    assert route.stages[1].radius_m == math.copysign(20.0, rate_deg_s)


def test_a_delay_behind_a_circle_is_flown_on_it() -> None:
    # Flown with 4.7.0-dev: a quarter of a turn is over after 7.3 s, the delay of 20 s 20 s later.
    delay = item(93, frame=2, params=(20.0, -1.0, -1.0, -1.0))
    circle = item(18, north(60), 20.0, params=(0.25, 0.0, 20.0, None))
    found = make_route(mission(takeoff_to(20), circle, delay), dialect=Autopilot.ARDUPILOT)
    alone = make_route(mission(takeoff_to(20), circle), dialect=Autopilot.ARDUPILOT)
    longer_s = time_s(fly(*found.stages)) - time_s(fly(*alone.stages))
    assert longer_s == pytest.approx(20.0, abs=0.5)
    spot = item(18, north(60), 20.0, params=(0.25, 0.0, 0.0, None))
    still = VehicleHabits(circles_by_rate=True)
    turned = make_route(
        mission(takeoff_to(20), spot, delay), dialect=Autopilot.ARDUPILOT, habits=still
    )
    assert [one.kind for one in turned.stages[1:]] == [StageKind.CIRCLE, StageKind.DELAY]


@pytest.mark.parametrize("is_speed_held", [False, True])
def test_a_delay_on_a_circle_is_refused_for_what_is_held_back_alone(*, is_speed_held: bool) -> None:
    # Flown: circle, CONDITION_YAW, NAV_DELAY, waypoint, RTL take 167.8 s; predicted were 167 s.
    turn = item(115, frame=2, params=(90.0, 20.0, 0.0, 0.0))
    speed = item(178, frame=2, params=(1.0, 2.0, -1.0, 0.0))
    circle = item(18, north(100), 20.0, params=(1.0, 0.0, 20.0, 0.0))
    delay = item(93, frame=2, params=(20.0, -1.0, -1.0, -1.0))
    items = (takeoff_to(20), circle, turn, *[speed] * is_speed_held, delay)
    found = make_route(mission(*items), dialect=Autopilot.ARDUPILOT).findings
    told = [f for f in found if "what conditions hold back" in f.message]
    assert [one.severity for one in told] == [Severity.ERROR] * is_speed_held


@pytest.mark.parametrize(("is_delayed", "is_told"), [(True, True), (False, False)])
def test_here_behind_a_delay_on_a_circle_is_no_go(*, is_delayed: bool, is_told: bool) -> None:
    circle = item(18, north(100), 20.0, params=(1.0, 0.0, 40.0, 0.0))
    delay = item(93, frame=2, params=(20.0, -1.0, -1.0, -1.0))
    here = item(21, 0.0, 0.0, longitude_deg=0.0)
    items = (takeoff_to(20), circle, *[delay] * is_delayed, here)
    for dialect in (Autopilot.ARDUPILOT, None):
        told = [
            f
            for f in make_route(mission(*items), dialect=dialect).findings
            if "circles on" in f.message
        ]
        assert [one.severity for one in told] == [Severity.ERROR] * is_told
