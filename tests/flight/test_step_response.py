"""The article's vehicle flown in closed form, against pencil, paper and sampling with ``control``."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sampled_flight import Manoeuvre, SampledVehicle
from thinning import examples

from planner.flight.motion.kinematics import FlightState
from planner.flight.pilot import StepPilot
from planner.flight.prediction import Flight, predict_flight, sample_trace
from planner.geo.geodesy import LocalFrame
from planner.mission.route.stage import Route, Stage, StageKind
from planner.setup import Setup
from planner.vehicle.library import load_vehicle

VEHICLE = load_vehicle("falkowski-2023-quadrotor")
SAMPLED = SampledVehicle()


def route(*stages: Stage) -> Route:
    frame = LocalFrame(latitude_deg=47.0, longitude_deg=8.0)
    return Route(stages=stages, frame=frame, home_amsl_m=400.0)


def stage(
    kind: StageKind,
    east_m: float,
    height_m: float,
    *,
    speed: float | None = None,
    hold: float = 0.0,
) -> Stage:
    return Stage(
        kind=kind,
        item=1,
        east_m=east_m,
        north_m=0.0,
        height_m=height_m,
        speed_m_s=speed,
        hold_s=hold,
    )


def fly(*stages: Stage) -> Flight:
    return predict_flight(route(*stages), Setup(VEHICLE), StepPilot(vehicle=VEHICLE))


def out_and_back() -> Route:
    return route(
        stage(StageKind.TAKEOFF, 0.0, 100.0),
        stage(StageKind.GO, 800.0, 100.0, hold=20.0),
        stage(StageKind.GO, 815.0, 350.0),
        stage(StageKind.GO, 600.0, 60.0, speed=6.0),
        stage(StageKind.RETURN, 0.0, 0.0),
    )


def test_a_takeoff_to_100_m_ends_within_one_metre_when_the_article_says() -> None:
    [takeoff] = fly(stage(StageKind.TAKEOFF, 0.0, 100.0)).segments
    assert takeoff.state is FlightState.TAKEOFF
    assert takeoff.duration_s == pytest.approx(27.309, abs=0.001)  # paper.md: within 1 m from
    assert takeoff.speed_m_s == pytest.approx(7.2438, abs=0.0001)  # paper.md: peak climb rate


def test_a_full_stop_covers_the_articles_stopping_distance() -> None:
    flight = fly(stage(StageKind.TAKEOFF, 0.0, 100.0), stage(StageKind.GO, 500.0, 100.0))
    cruise, brake = flight.segments[-2:]
    assert cruise.state is FlightState.CRUISE
    assert cruise.stopping_distance_m == pytest.approx(31.889, abs=0.001)  # paper.md
    assert brake.state is FlightState.BRAKE
    assert brake.stopping_distance_m == pytest.approx(31.889, abs=0.001)
    assert brake.distance_m == pytest.approx(31.889, abs=0.001)
    # swarm.md: the response passes that point and swings back
    assert cruise.farthest_stop_m == pytest.approx(32.654, abs=0.001)
    assert brake.farthest_stop_m == pytest.approx(32.654, abs=0.001)


def test_accelerating_ends_where_98_percent_of_the_speed_is_reached() -> None:
    flight = fly(stage(StageKind.TAKEOFF, 0.0, 100.0), stage(StageKind.GO, 500.0, 100.0))
    accelerate = flight.segments[1]
    assert accelerate.state is FlightState.ACCELERATE
    assert accelerate.duration_s == pytest.approx(6.623, abs=0.001)  # paper.md


def test_a_level_leg_takes_its_length_over_the_steady_speed_and_the_stop() -> None:
    flight = fly(stage(StageKind.TAKEOFF, 0.0, 100.0), stage(StageKind.GO, 500.0, 100.0))
    level = [s for s in flight.segments if s.state is not FlightState.TAKEOFF]
    # 10 x 10 x 0.03569 / 0.3588 = 9.94705 m/s; the stop takes as long as the start.
    assert sum(s.duration_s for s in level) == pytest.approx(500.0 / 9.94705 + 6.6234, abs=2e-4)


def test_braking_costs_what_the_article_gives_on_top_of_hover() -> None:
    flight = fly(stage(StageKind.TAKEOFF, 0.0, 100.0), stage(StageKind.GO, 500.0, 100.0))
    brake = flight.segments[-1]
    extra_j = brake.energy_wh * 3600.0 - 131.018 * brake.duration_s  # P(100 m) of paper.md
    assert extra_j == pytest.approx(166.372, abs=0.01)  # 0.0005 W of P over 6.6 s


def test_a_climb_costs_hover_along_the_way_and_the_articles_window() -> None:
    [_, climb] = fly(stage(StageKind.TAKEOFF, 0.0, 100.0), stage(StageKind.GO, 0.0, 200.0)).segments
    # Hover power lies between P(100 m) and P(200 m); it differs by 1.4 % over the climb.
    extra_j = climb.energy_wh * 3600.0 - 0.5 * (131.018 + 132.847) * climb.duration_s
    assert extra_j == pytest.approx(823.717, abs=0.5 * 1.83 * climb.duration_s)


def test_a_climb_of_300_m_holds_the_peak_rate_for_the_extra_200_m() -> None:
    takeoff, climb = fly(
        stage(StageKind.TAKEOFF, 0.0, 100.0), stage(StageKind.GO, 0.0, 400.0)
    ).segments
    assert climb.climb_m == 300.0
    assert climb.speed_m_s == pytest.approx(7.2438, abs=0.0001)
    assert climb.duration_s == pytest.approx(27.309 + 200.0 / 7.2438, abs=0.002)
    assert takeoff.climb_m == 100.0


@pytest.mark.parametrize(
    "manoeuvre",
    [
        Manoeuvre("climb", 100.0, 0.0),
        Manoeuvre("climb", 37.0, 120.0),
        Manoeuvre("climb", 260.0, 100.0),
        Manoeuvre("descent", -100.0, 400.0),
        Manoeuvre("descent", -350.0, 390.0),
        Manoeuvre("level", 500.0, 100.0),
        Manoeuvre("level", 120.0, 100.0, speed_m_s=4.0),
        Manoeuvre("level", 20.0, 100.0),
        Manoeuvre("level", 3.0, 100.0),
    ],
    ids=lambda m: f"{m.kind} {m.size:g} m",
)
def test_a_manoeuvre_in_closed_form_is_the_sampled_one(manoeuvre: Manoeuvre) -> None:
    stages = [stage(StageKind.TAKEOFF, 0.0, manoeuvre.height_m)]
    if manoeuvre.kind == "level":
        stages.append(
            stage(StageKind.GO, manoeuvre.size, manoeuvre.height_m, speed=manoeuvre.speed_m_s)
        )
    else:
        stages.append(stage(StageKind.GO, 0.0, manoeuvre.height_m + manoeuvre.size))
    flight = fly(*stages)
    before = 0 if manoeuvre.height_m == 0.0 else 1
    flown = flight.segments[before:]
    expected = SAMPLED.fly(manoeuvre)
    # Sampling at 0.02 s places the ends of windows and segments to one sample.
    assert sum(s.duration_s for s in flown) == pytest.approx(expected.duration_s, abs=0.04)
    assert sum(s.distance_m for s in flown) == pytest.approx(expected.distance_m, abs=0.2)
    energy_j = 3600.0 * sum(s.energy_wh for s in flown)
    assert energy_j == pytest.approx(expected.energy_j, abs=150.0 * 0.04, rel=1e-3)


def test_segments_are_contiguous_and_their_energies_sum_to_the_total() -> None:
    flight = predict_flight(out_and_back(), Setup(VEHICLE), StepPilot(vehicle=VEHICLE))
    end_s = 0.0
    for segment in flight.segments:
        assert segment.start_s == pytest.approx(end_s, abs=1e-9)
        end_s = segment.start_s + segment.duration_s
    assert end_s == pytest.approx(flight.time_s, abs=1e-9)
    total_j = 3600.0 * sum(s.energy_wh for s in flight.segments)
    assert total_j == pytest.approx(flight.energy_j, rel=1e-9)


def test_the_trace_integrates_to_the_energy_of_the_flight() -> None:
    flown = out_and_back()
    flight = predict_flight(flown, Setup(VEHICLE), StepPilot(vehicle=VEHICLE))
    trace = sample_trace(flight, flown)
    energy_j = np.trapezoid(trace.power_w, trace.time_s)
    assert energy_j == pytest.approx(flight.energy_j, rel=1e-3)  # the bound
    # Hover power rises while a transient peaks, so that their sum peaks a moment later.
    assert trace.power_w.max() == pytest.approx(flight.peak_power_w, rel=1e-5)


def test_a_trace_has_ten_samples_a_second_and_fewer_where_asked() -> None:
    flown = out_and_back()
    flight = predict_flight(flown, Setup(VEHICLE), StepPilot(vehicle=VEHICLE))
    for most, step_s in ((200_000, 0.1), (100, flight.time_s / 100)):
        time_s = sample_trace(flight, flown, most_samples=most).time_s
        assert np.diff(time_s).max() <= step_s + 1e-9
        even_s = np.arange(0.0, flight.time_s - step_s, step_s)
        after = np.searchsorted(time_s, even_s - 1e-9)
        assert time_s[after] == pytest.approx(even_s, abs=1e-9)
        # besides them there are the ends of segments
        assert len(time_s) <= len(even_s) + 2 + 2 * len(flight.motion.segments.item)


def test_the_trace_of_a_flight_that_lands_ends_on_the_ground_and_standing() -> None:
    flown = out_and_back()
    flight = predict_flight(flown, Setup(VEHICLE), StepPilot(vehicle=VEHICLE))
    trace = sample_trace(flight, flown)
    assert trace.state[-1] == "land"
    assert trace.height_above_home_m[-1] == 0.0
    assert trace.altitude_amsl_m[-1] == 400.0
    assert trace.climb_rate_m_s[-1] == 0.0
    # From first to last sample it goes down as far as the segments say.
    landing = [one == "land" for one in trace.state].index(True)
    fallen_m = trace.height_above_home_m[landing] - trace.height_above_home_m[-1]
    assert fallen_m == pytest.approx(-flight.motion.segments.climb_m[-1], abs=1.0)


def test_a_flight_that_ends_in_the_air_is_left_there() -> None:
    flown = route(stage(StageKind.TAKEOFF, 0.0, 100.0))
    flight = predict_flight(flown, Setup(VEHICLE), StepPilot(vehicle=VEHICLE))
    # Settled to within one metre, as the article's altitude response is read.
    height_m = sample_trace(flight, flown).height_above_home_m[-1]
    assert height_m != 100.0
    assert height_m == pytest.approx(100.0, abs=1.0 + 1e-6)


def test_the_flown_path_passes_its_waypoints() -> None:
    flight = predict_flight(out_and_back(), Setup(VEHICLE), StepPilot(vehicle=VEHICLE))
    columns = flight.motion.segments
    arrivals = columns.end_s[flight.motion.arrival_segment]
    state = flight.motion.state_at_time(arrivals - 1e-6)
    # A stop ends at 2 % of the speed with the way overshot by 0.7 m; a climb within 1 m.
    assert state.east_m == pytest.approx([0.0, 800.0, 815.0, 600.0, 0.0], abs=0.75)
    assert state.height_m == pytest.approx([100.0, 100.0, 350.0, 60.0, 0.0], abs=1.0 + 1e-3)


@settings(deadline=None, max_examples=examples(40))
@given(st.floats(0.01, 5000.0), st.floats(0.5, 10.0))
def test_a_leg_of_any_length_covers_exactly_its_length(length_m: float, speed_m_s: float) -> None:
    flight = fly(
        stage(StageKind.TAKEOFF, 0.0, 100.0), stage(StageKind.GO, length_m, 100.0, speed=speed_m_s)
    )
    level = [s for s in flight.segments if s.state is not FlightState.TAKEOFF]
    assert sum(s.distance_m for s in level) == pytest.approx(length_m, rel=1e-9)
    assert all(s.duration_s >= 0.0 for s in level)
    assert all(s.energy_wh > 0.0 for s in level if s.duration_s > 0.0)


@settings(deadline=None, max_examples=examples(25))
@given(st.floats(5.0, 800.0), st.floats(5.0, 800.0))
def test_a_longer_leg_never_costs_less(first_m: float, second_m: float) -> None:
    short, long = sorted((first_m, second_m))
    energy_j = [
        fly(stage(StageKind.TAKEOFF, 0.0, 100.0), stage(StageKind.GO, size, 100.0)).energy_j
        for size in (short, long)
    ]
    assert energy_j[0] <= energy_j[1] + 1e-6
