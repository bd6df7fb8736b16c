"""Stops as recorded, and of a vehicle that lags behind its reference, by control.forced_response."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import control
import numpy as np
import pytest
from ardupilot_missions import DEFAULTS, fly, go, home, stage, states, takeoff, time_s, took_s
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.findings import Severity
from planner.flight.motion.ardupilot.legs import stopping_distance_m
from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.mission.route.stage import StageKind
from planner.values import replace
from planner.vehicle.model import AltitudeResponse, ManoeuvreResponse, Responses, SpeedResponse
from planner.vehicle.parameters.ardupilot import ArduPilotParameters

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.flight.motion.kinematics import Motion
    from planner.mission.route.stage import Stage

STEP_S = 1e-3


def following(denominator: tuple[float, ...], delay_s: float = 0.0) -> SpeedResponse:
    """A response of steady gain 1."""
    return SpeedResponse(
        numerator=(denominator[-1],),
        denominator=denominator,
        delay_s=delay_s,
        input_gain=1.0,
        identified_speed_m_s=10.0,
    )


LAG = following((0.5, 1.0))
RINGING = following((1.0, 1.2, 2.0), delay_s=0.2)


def sampled(response: ManoeuvreResponse, time: FloatArray, reference: FloatArray) -> FloatArray:
    """The answer to a sampled reference that begins where the system rests, by python-control."""
    system = response.transfer_function
    answer = control.forced_response(
        control.tf(list(system.numerator), list(system.denominator)), time, reference - reference[0]
    )
    late = round(system.delay_s / STEP_S)
    shifted = np.concatenate((np.zeros(late), np.asarray(answer.outputs)))[: len(time)]
    return np.asarray(shifted + reference[0], np.float64)


def braking(speed: float) -> tuple[FloatArray, FloatArray]:
    """The reference of the last stop of a flight, 20 s of cruise before and standing after."""
    motion = fly(takeoff(), stage(StageKind.GO, 3000.0, speed=speed, hold=60.0))
    brake = int(np.flatnonzero(motion.segments.state == STATE_INDEX[FlightState.BRAKE])[-1])
    begin = motion.segments.end_s[brake] - motion.segments.duration_s[brake]
    time = np.arange(0.0, 20.0 + motion.segments.duration_s[brake] + 30.0, STEP_S)
    return time, motion.state_at_time(begin - 20.0 + time).ground_speed_m_s


@pytest.mark.parametrize("response", [LAG, RINGING])
@pytest.mark.parametrize("speed", [3.0, 10.0, 15.0])
def test_stops_are_those_of_the_sampled_answer(response: ManoeuvreResponse, speed: float) -> None:
    time, reference = braking(speed)
    answer = sampled(response, time, reference)
    begun = int(np.argmax(answer <= 0.97 * speed))
    expected = float(np.trapezoid(answer[begun:], dx=STEP_S))
    [found] = stopping_distance_m(np.array([speed]), DEFAULTS, response)
    # A sample is 1 ms: 1.5 cm at 15 m/s.
    assert found == pytest.approx(expected, abs=0.03)


def test_a_pointed_peak_is_rounded_by_the_lag_of_a_start() -> None:
    # 30 m from rest to rest: no cruise.  2 ATC_INPUT_TC = 0.3 s take 1 · 0.3²/2 off the peak.
    motion = fly(takeoff(), go(30.0, hold=1.0))
    brake = motion.segments.state.tolist().index(STATE_INDEX[FlightState.BRAKE])
    peak = motion.segments.speed_m_s[brake]
    rounded = stopping_distance_m(np.array([peak - 0.045]), DEFAULTS)
    assert motion.segments.stopping_distance_m[brake] == pytest.approx(rounded[0], abs=1e-9)


def test_a_response_without_lag_leaves_stops_as_they_are() -> None:
    speeds = np.array([0.0, 2.0, 10.0, 10.0])
    quick = following((1e-6, 1.0))
    assert stopping_distance_m(speeds, DEFAULTS, quick) == pytest.approx(
        stopping_distance_m(speeds, DEFAULTS), abs=1e-3
    )


def flown(*stages: Stage, responses: Responses) -> Motion:
    return fly_ardupilot(stages, DEFAULTS, responses=responses)


def test_a_quick_vehicle_waits_nowhere_and_a_slow_one_until_it_is_within_the_radius() -> None:
    stages = (takeoff(), go(200.0, hold=1.0))
    plain = fly(*stages)
    assert time_s(flown(*stages, responses=Responses(speed=LAG))) == pytest.approx(
        time_s(plain), abs=1e-9
    )
    slow = following((3.0, 1.0))
    waiting = flown(*stages, responses=Responses(speed=slow))
    # The reference of the leg, from rest, and what is left of its 200 m when 2 m are.
    end = plain.segments.end_s[plain.arrival_segment]
    time = np.arange(0.0, end[1] - end[0] + 30.0, STEP_S)
    reference = plain.state_at_time(np.minimum(end[0] + time, end[1])).ground_speed_m_s
    way = np.cumsum(sampled(slow, time, reference)) * STEP_S
    expected = float(time[np.argmax(way >= 198.0)]) + 1.0
    assert took_s(waiting, 1) == pytest.approx(expected, abs=0.01)
    assert waiting.segments.stopping_distance_m[3] > plain.segments.stopping_distance_m[3]


def test_vertical_legs_wait_for_the_altitude() -> None:
    stages = (takeoff(), go(0.0, height_m=120.0, hold=1.0))
    slow = following((6.0, 1.0))
    climbing = AltitudeResponse(
        numerator=slow.numerator,
        denominator=slow.denominator,
        delay_s=slow.delay_s,
        input_gain=1.0,
        identified_step_m=50.0,
    )
    plain = took_s(fly(*stages), 1)
    assert took_s(flown(*stages, responses=Responses(speed=slow)), 1) == pytest.approx(plain)
    assert took_s(flown(*stages, responses=Responses(altitude=climbing)), 1) > plain + 1.0


def test_corners_are_passed_without_waiting() -> None:
    stages = (takeoff(), go(200.0), go(200.0, 200.0))
    slow = Responses(speed=following((3.0, 1.0)))
    late = flown(*stages, responses=slow)
    assert took_s(late, 1) == pytest.approx(took_s(fly(*stages), 1), abs=1e-9)
    assert took_s(late, 2) > took_s(fly(*stages), 2) + 0.5


@pytest.mark.parametrize(
    ("speed", "recorded"),
    [(3.0, 4.0), (5.0, 8.7), (8.0, 17.5), (10.0, 25.0), (12.0, 35.0), (15.0, 51.0)],
)
def test_stops_are_as_long_as_recorded(speed: float, recorded: float) -> None:
    assert stopping_distance_m(np.array([speed]), DEFAULTS)[0] == pytest.approx(
        recorded, abs=max(0.5, 0.05 * recorded)
    )


def test_standing_still_needs_no_way() -> None:
    assert stopping_distance_m(np.array([0.0]), DEFAULTS)[0] == 0.0


def test_cruise_and_brake_know_their_stop() -> None:
    motion = fly(takeoff(), go(500.0), go(500.0, 500.0, hold=1.0), home())
    stop = float(stopping_distance_m(np.array([10.0]), DEFAULTS)[0])
    for state, way in zip(states(motion), motion.segments.stopping_distance_m, strict=True):
        if state in {"cruise", "brake"}:
            assert way == pytest.approx(stop)
        else:
            assert math.isnan(way)


@given(speed=st.floats(0.5, 20.0), acceleration=st.floats(0.5, 6.0), jerk=st.floats(0.5, 10.0))
@settings(max_examples=examples(60), deadline=None)
def test_stops_grow_with_speed_and_shrink_with_acceleration(
    speed: float, acceleration: float, jerk: float
) -> None:
    some = ArduPilotParameters(acceleration_m_s2=acceleration, jerk_m_s3=jerk)
    more = ArduPilotParameters(acceleration_m_s2=1.2 * acceleration, jerk_m_s3=jerk)
    slow, fast = stopping_distance_m(np.array([speed, 1.1 * speed]), some)
    assert 0.0 < slow < fast
    assert stopping_distance_m(np.array([speed]), more)[0] <= slow + 1e-9
    assert slow > 0.5 * speed**2 / acceleration * 0.97**2


def test_a_stop_waits_until_what_the_drag_carried_past_is_within_the_radius() -> None:
    # Recorded in SITL, limit 10.24 m/s: legs of 60 m to a WP_RADIUS of 0.3 m take 1.53 s longer, and
    # 2 m are never left.
    def took(radius_m: float) -> float:
        stages = (takeoff(20.0), go(60.0, 0.0, 20.0, hold=2.0), go(60.0, 60.0, 20.0, hold=5.0))
        parameters = ArduPilotParameters(waypoint_radius_m=radius_m)
        return took_s(fly_ardupilot(stages, parameters, airspeed_limit_m_s=10.24), 2)

    assert took(0.3) - took(2.0) == pytest.approx(1.53, abs=0.15)
    assert took(5.0) == took(2.0)


def test_a_place_to_stay_that_names_none_is_flown_to_all_the_same() -> None:
    # Recorded in SITL: a LOITER_TIME of 15 s without coordinates takes 16.68 s, twice.
    stay = stage(StageKind.LOITER, 60.0, hold=15.0)
    for here, more in ((True, 1.68), (False, 0.0)):
        motion = fly(takeoff(), go(60.0, hold=1.0), replace(stay, is_here=here))
        assert took_s(motion, 2) == pytest.approx(15.0 + more, abs=0.1)


@pytest.mark.parametrize(
    ("jerk_m_s3", "reported"),
    [
        (2.38, []),
        (2.40, [Severity.WARNING]),
        (3.20, [Severity.WARNING]),
        (3.25, [Severity.ERROR]),
        (11.8, [Severity.ERROR]),
    ],
)
def test_a_target_may_stand_still_on_its_way_to_what_is_here(
    jerk_m_s3: float, reported: list[Severity]
) -> None:
    # 1.86 cm take 8 (0.0186 m 0.3 s/8 J)^(1/4): 1.047 s for 2.38 m/s³, 1.045 s for 2.40, 0.972 s for 3.20,
    # 0.969 s for 3.25; A/J is 1.050, 1.042, 0.781 and 0.769 s.  Flown 0.5 s late at 2.5 m/s³, up to 1.7 s
    # at 3, 3 to 17 s from 3.5 on, and beyond 160 s.
    stages = takeoff(), go(60.0), replace(stage(StageKind.GO, 60.0), is_here=True), home()
    motion = fly(*stages, parameters=ArduPilotParameters(jerk_m_s3=jerk_m_s3))
    # Of the return behind it another finding tells.
    found = [one.severity for one in motion.findings if "a return" not in one.message]
    assert found == reported
    there = *stages[:2], stage(StageKind.GO, 60.0), home()
    hasty = fly(*there, parameters=ArduPilotParameters(jerk_m_s3=20.0))
    assert ["a return" in one.message for one in hasty.findings] == [True]


def test_a_height_to_loiter_to_is_reached_within_the_radius_of_its_place() -> None:
    # Flown by ArduCopter 4.7.0-dev: ten LOITER_TO_ALT 30 m to and fro take 8.5 s each, waypoints with a stop
    # 11.3 s; 60 m, a turn aside and 85 m 26.7 s, and with a WP_RADIUS of 10 m 25.7 s.
    def flown_s(*stages: Stage, radius_m: float = 2.0) -> list[float]:
        own = ArduPilotParameters(waypoint_radius_m=radius_m)
        motion = fly_ardupilot((takeoff(15.0), *stages), own, airspeed_limit_m_s=10.24)
        return [took_s(motion, at) for at in range(1, len(stages) + 1)]

    def loiter(east_m: float, height_m: float = 15.0) -> Stage:
        return stage(StageKind.CHANGE_HEIGHT, 0.0, east_m, height_m)

    to_and_fro = flown_s(*(loiter(30.0 * (n % 2)) for n in range(1, 11)))
    assert to_and_fro[3:8] == pytest.approx([8.5] * 5, abs=0.3)
    for radius_m, there_s in ((2.0, 26.7), (10.0, 25.7)):
        aside = flown_s(loiter(60.0), go(60.0, 0.0, 15.0, hold=1.0), radius_m=radius_m)
        assert sum(aside) - 1.0 == pytest.approx(there_s, abs=1.0)
    # At another height by more than 5 cm it comes to rest.
    near, off = (flown_s(loiter(60.0, up_m), loiter(0.0, up_m))[0] for up_m in (15.04, 15.06))
    assert off - near > 1.0


def test_a_turn_back_costs_what_was_recorded() -> None:
    # SITL, legs of 60 m to and fro at 10 m/s: 10.0 s each; of 40 m at 5 m/s: 9.52 s.
    for speed, length, recorded in ((10.0, 60.0, 10.0), (5.0, 40.0, 9.52)):
        there = [stage(StageKind.GO, 0.0, length * (n % 2), 20.0, speed=speed) for n in range(1, 6)]
        motion = fly_ardupilot((takeoff(20.0), *there, home()), DEFAULTS, airspeed_limit_m_s=10.24)
        assert took_s(motion, 3) == pytest.approx(recorded, abs=0.1)
