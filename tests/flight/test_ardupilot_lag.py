"""What ArduPilot's time along a track loses to drag, against the control loop in small steps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import DEFAULTS, go, home, stage, takeoff, took_s

from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.flight.motion.ardupilot.track_lag import TrackLag
from planner.flight.motion.s_curve import SpeedLimits, speed_ramps
from planner.mission.route.stage import StageKind
from planner.values import replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.flight.motion.kinematics import Motion

LIMIT_M_S = 10.25
"""Airspeed at 30° of the simulated vehicle that the figures are of."""


def left_s(motion: Motion) -> FloatArray:
    """Return when stages are done, holds included."""
    return np.asarray(motion.segments.end_s[motion.done_segment])


def beyond_m(speed: float, step_s: float = 0.005) -> tuple[float, float]:
    """Stopping point and place beyond a stop: ``AC_PosControl`` with its gains, thrust without a lag."""
    reached = min(2.5, math.sqrt(speed))
    jerk_s, steady_s = reached, max(speed / reached - reached, 0.0)
    ends = np.cumsum([0.0, 0.15, jerk_s, steady_s, jerk_s, 0.15])
    times = np.arange(0.0, ends[-1], step_s)
    acceleration = -np.interp(times, ends, [0.0, 0.0, reached, reached, 0.0, 0.0])

    def drag(v: float) -> float:
        held = 9.80665 * math.tan(math.radians(30.0))
        return math.copysign(held * (abs(v) / LIMIT_M_S) ** 1.5, v)

    target = vehicle = speed
    behind, integral, last = 0.0, drag(speed), 0.0
    error = 0.0
    for a in acceleration.tolist():
        target += a * step_s
        error = target - vehicle + behind
        integral += error * step_s
        pushed = a + 2.0 * error + integral + 0.25 * (error - last) / step_s - drag(vehicle)
        last = error
        vehicle += pushed * step_s
        behind += (target - vehicle) * step_s
    return abs(error), abs(behind)


@pytest.mark.parametrize("speed", [10.0, 7.0, 4.0])
def test_a_vehicle_comes_to_rest_beyond_its_target(speed: float) -> None:
    limits = SpeedLimits(np.array([2.5]), np.array([1.0]), np.array([0.3]))
    ramps = speed_ramps(np.array([speed]), limits)
    lag = TrackLag.of(DEFAULTS, LIMIT_M_S)
    point_m, place_m = beyond_m(speed)
    # In flight 0.42 m from 9.9 m/s; here a vehicle faster than its target has no more drag than that.
    assert lag.beyond_stops_m(ramps) == pytest.approx(point_m, rel=0.2)
    assert lag.past_stops_m(ramps) == pytest.approx(2.0 * place_m, rel=0.2)


def test_a_turn_back_is_flown_later_and_a_slight_bend_is_not() -> None:
    def later_s(east: float, north: float) -> float:
        legs = takeoff(), go(60.0), go(east, north), go(east, north + 1e-3, hold=1.0)
        dragged = fly_ardupilot(legs, DEFAULTS, airspeed_limit_m_s=LIMIT_M_S)
        free = fly_ardupilot(legs, DEFAULTS)
        return took_s(dragged, 2) - took_s(free, 2)

    # Recorded 0.95 s a turn back between legs of 60 m.
    assert later_s(0.0, 0.0) == pytest.approx(0.95, abs=0.3)
    assert later_s(120.0, 5.0) == pytest.approx(0.0, abs=0.05)


def test_a_return_from_over_home_flies_there_from_beyond() -> None:
    legs = takeoff(20.0), go(50.0, 0.0, 20.0), go(0.0, 0.0, 20.0), home()
    dragged = fly_ardupilot(legs, DEFAULTS, airspeed_limit_m_s=LIMIT_M_S)
    free = fly_ardupilot(legs, DEFAULTS)
    # 0.3 to 0.4 m from rest to rest: 4 (t_j + a/J) with 2 a (t_j + a/J)² = L, some 2.6 s.
    assert took_s(dragged, 3) - took_s(free, 3) == pytest.approx(2.6, abs=0.4)
    waited = takeoff(20.0), go(50.0, 0.0, 20.0), go(0.0, 0.0, 20.0, hold=60.0), home()
    waits = fly_ardupilot(waited, DEFAULTS, airspeed_limit_m_s=LIMIT_M_S)
    assert took_s(waits, 3) < took_s(dragged, 3) - 1.0


def test_what_follows_a_minute_of_a_piece_of_a_spline_is_flown_as_that_minute_ended() -> None:
    lag = TrackLag.of(DEFAULTS, LIMIT_M_S)
    before, track = 8.0 + 0.0j, 8.0 + 1.0j
    turning = (track - before) / 300.0
    state, whole_s = lag.steady(before), 0.0
    for minute in range(5):
        begun = before + 60.0 * minute * turning
        state, took = lag.after(60.0, begun, begun + 60.0 * turning, state)
        whole_s += took
    found, found_s = lag.after(300.0, before, track, lag.steady(before))
    # Whoever turns by 7° in five minutes is behind by nothing: 1 mm/s and 1 ms.
    assert found_s == pytest.approx(whole_s, abs=1e-3)
    assert abs(found.velocity_m_s - state.velocity_m_s) < 1e-3


def test_a_vehicle_at_its_greatest_lean_turns_first_and_brakes_with_what_is_left() -> None:
    lag = TrackLag.of(DEFAULTS, LIMIT_M_S)._replace(lean_m_s2=5.0)
    # Northwards: limit_accel_xy leaves 4 of 10 along with 3 across, none with more across than 5.
    assert lag.leant(3.0 + 10.0j, 8.0j) == pytest.approx(3.0 + 4.0j)
    assert lag.leant(-3.0 - 10.0j, 8.0j) == pytest.approx(-3.0 - 4.0j)
    assert lag.leant(7.0 - 10.0j, 8.0j) == pytest.approx(5.0)
    assert lag.leant(6.0 + 8.0j, 0.0j) == pytest.approx(3.0 + 4.0j)


def test_drag_delays_splines_and_lengthens_the_way() -> None:
    legs = takeoff(), *(stage(StageKind.SPLINE, 100.0 * k, 30.0 * (k % 2)) for k in (1, 2, 3))
    slow = fly_ardupilot(legs, DEFAULTS, airspeed_limit_m_s=LIMIT_M_S)
    free = fly_ardupilot(legs, DEFAULTS)
    assert slow.segments.duration_s.sum() > free.segments.duration_s.sum() + 0.3
    # Four legs of 40 m flown in simulation were 4.7 m longer by their log.
    stops = takeoff(), *(go(40.0 * k, hold=5.0) for k in (1, 2, 3, 4))
    past = fly_ardupilot(stops, DEFAULTS, airspeed_limit_m_s=LIMIT_M_S)
    assert past.wander_m == pytest.approx(4.7, rel=0.1)
    assert slow.wander_m > free.wander_m
    assert fly_ardupilot(stops, DEFAULTS).wander_m == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("places", "hold_s", "flown_s"),
    [
        ([30.0 * k for k in range(1, 8)], 1.0, 11.45),
        ([30.0 * k for k in range(1, 8)], 3.0, 13.50),
        ([30.0 * k for k in range(1, 8)], 5.0, 15.60),
        ([30.0 * k for k in range(1, 8)], 10.0, 20.77),
        ([40.0 * (k % 2) for k in range(1, 8)], 2.0, 14.25),
    ],
    ids=["1 s", "3 s", "5 s", "10 s", "there and back"],
)
def test_a_leg_behind_a_short_hold_begins_with_what_the_stop_carried_past(
    places: list[float], hold_s: float, flown_s: float
) -> None:
    """Flown by a build at 8 m/s, holds included; from long standing 0.3 s more, back 0.4 s less."""
    legs = [replace(go(0.0, north, hold=hold_s), speed_m_s=8.0) for north in places]
    motion = fly_ardupilot((takeoff(), *legs, home()), DEFAULTS, airspeed_limit_m_s=LIMIT_M_S)
    assert np.diff(left_s(motion))[2:6] == pytest.approx(flown_s, abs=0.12)


def test_a_leg_behind_a_short_hold_is_as_from_standing_where_it_turns_aside() -> None:
    """Flown by a build: 12.85 s over 30 m and 2 s of hold, and 12.47 s straight on."""
    places = [(0.0, 30.0), (0.0, 60.0), (30.0, 60.0), (60.0, 60.0)]
    legs = [replace(go(*place, hold=2.0), speed_m_s=8.0) for place in places]
    motion = fly_ardupilot((takeoff(), *legs, home()), DEFAULTS, airspeed_limit_m_s=LIMIT_M_S)
    assert np.diff(left_s(motion))[1:4] == pytest.approx([12.47, 12.85, 12.47], abs=0.12)
