"""Flight states, steady powers and commands found in records of the simulated experiment."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record, record_of
from simulated_experiment import FIRST_S, LEVEL_S, STEP_S, fly_horizontally, fly_vertically

from planner.flight.motion.kinematics import FlightState
from planner.identify.manoeuvres import ReferenceForm, ResponseKind, cut_manoeuvres, hold_out
from planner.identify.output_error import MOTION, POWER, fit_response
from planner.identify.power_laws import fit_altitude_law
from planner.identify.segments import find_states, steady_spans
from planner.values import replace
from planner.vehicle.power import hover_power_w

if TYPE_CHECKING:
    from planner.identify.manoeuvres import Manoeuvre
    from planner.logs.record import FlightRecord

S = FlightState


@cache
def vertical() -> FlightRecord:
    return record_of(fly_vertically(np.random.default_rng(71)), is_vertical=True)


@cache
def level() -> FlightRecord:
    return record_of(fly_horizontally(np.random.default_rng(72)), is_vertical=False)


def test_the_vertical_experiment_is_take_off_climbs_hovers_descents_and_landing() -> None:
    found = [segment.state for segment in find_states(vertical())]
    expected = [S.TAKEOFF, S.HOVER, *[S.CLIMB, S.HOVER] * 3, *[S.DESCEND, S.HOVER] * 3, S.LAND]
    assert found == expected


def test_ground_time_is_no_flight() -> None:
    segments = find_states(vertical())
    assert segments[0].start_s >= FIRST_S
    landed = vertical().is_landed
    assert not any(landed[segment.samples].any() for segment in segments)
    flown_s = sum(segment.duration_s for segment in segments)
    assert flown_s == pytest.approx(STEP_S * np.count_nonzero(~landed), abs=5.0)


def test_climbs_last_from_the_command_until_the_vehicle_has_arrived() -> None:
    climbs = [s for s in find_states(vertical()) if s.state is S.CLIMB]
    for number, climb in enumerate(climbs, start=1):
        # 2.9 s of delay and then some; within 2 % of 100 m after 26 s, slow at the end
        after_command_s = climb.start_s - (FIRST_S + LEVEL_S * number)
        assert 1.5 < after_command_s < 5.0
        assert 18.0 < climb.duration_s < 35.0


def test_the_horizontal_experiment_is_accelerate_cruise_brake_and_hover_twice() -> None:
    found = [segment.state for segment in find_states(level())]
    assert found == [S.HOVER, *[S.ACCELERATE, S.CRUISE, S.BRAKE, S.HOVER] * 2]


def test_a_shaped_speed_reference_tells_the_states_without_noise() -> None:
    # up to 8 m/s in 4 s, 20 s there, down in 4 s; the measurement is useless
    reference = np.interp(
        np.arange(0.0, 60.0, STEP_S), [10.0, 14.0, 34.0, 38.0], [0.0, 8.0, 8.0, 0]
    )
    noise = 2.0 * np.random.default_rng(73).standard_normal(reference.size)
    record = make_record(
        is_landed=np.zeros(reference.size, dtype=np.bool_),
        height_above_home_m=np.full(reference.size, 50.0),
        climb_m_s=np.zeros(reference.size),
        ground_speed_m_s=np.abs(reference + noise),
        reference_speed_m_s=reference,
    )
    segments = find_states(record)
    assert [s.state for s in segments] == [S.HOVER, S.ACCELERATE, S.CRUISE, S.BRAKE, S.HOVER]
    assert [s.duration_s for s in segments] == pytest.approx([10.2, 3.9, 20.0, 3.8, 22.1], abs=0.5)


def test_a_height_that_wobbles_in_level_flight_is_no_climb() -> None:
    # up 20 m at 2 m/s amid level flight at 5 m/s; the height wobbles by ±1 m in 15 s, at up to 0.4 m/s
    time_s = np.arange(0.0, 240.0, STEP_S)
    height = 50.0 + np.interp(time_s, [100.0, 110.0], [0.0, 20.0])
    wobble = np.sin(2.0 * np.pi * time_s / 15.0)
    for size in (0.0, 1.0):
        record = make_record(
            is_landed=np.zeros(time_s.size, dtype=np.bool_),
            height_above_home_m=height + size * wobble,
            ground_speed_m_s=np.full(time_s.size, 5.0),
        )
        found = find_states(record)
        assert [s.state for s in found] == [S.CRUISE, S.CLIMB, S.CRUISE]
        # the slope over 3 s blurs both ends, the wobble moves them
        assert found[1].duration_s == pytest.approx(10.0, abs=3.5)


def test_time_at_which_nothing_is_known_has_no_state() -> None:
    speed = np.zeros(600)
    speed[200:230] = np.nan
    record = make_record(
        is_landed=np.zeros(600, dtype=np.bool_),
        height_above_home_m=np.full(600, 50.0),
        climb_m_s=np.zeros(600),
        ground_speed_m_s=speed,
    )
    first, second = find_states(record)
    # the mean over a second reaches half a second into the known
    assert (first.end, second.first) == (195, 235)


def test_hovers_give_their_mean_power_and_the_law() -> None:
    stretches = steady_spans(vertical(), find_states(vertical()), settling_s=35.0)
    powers = [s.power for s in stretches if s.power is not None]
    assert len(powers) == 7
    assert [p.height_above_home_m for p in powers] == pytest.approx(
        [100.0, 200.0, 300.0, 400.0, 300.0, 200.0, 100.0], abs=1.0
    )
    exponent = fit_altitude_law(powers).estimates[1]
    assert abs(exponent.value - 0.02) < 3.5 * exponent.error


def test_stretches_that_are_not_steady_are_refused_with_their_reason() -> None:
    samples = 900
    height = np.full(samples, 50.0)
    height[:300] += np.linspace(0.0, 4.0, 300)  # 0.13 m/s: too slow for a climb
    height[300:] += 4.0
    power = np.full(samples, 200.0)
    power[500] = np.nan
    speed = np.zeros(samples)
    speed[600:640] = np.linspace(0.0, 8.0, 40)
    speed[640:] = 8.0
    record = make_record(
        is_landed=np.zeros(samples, dtype=np.bool_),
        height_above_home_m=height,
        climb_m_s=np.zeros(samples),
        ground_speed_m_s=speed,
        power_w=power,
    )
    hover, cruise = steady_spans(record, find_states(record))
    assert "power" in hover.refusal
    assert cruise.power is not None
    assert cruise.power.airspeed_m_s == pytest.approx(8.0)
    short = steady_spans(record, find_states(record), settling_s=58.0)[0]
    assert "too short" in short.refusal


def test_every_step_is_cut_from_the_ground_and_to_it() -> None:
    record = vertical()
    cuts = cut_manoeuvres(record)
    assert [cut.answer for cut in cuts] == [ResponseKind.ALTITUDE] * 8
    assert [cut.change for cut in cuts] == [100.0] * 4 + [-100.0] * 4
    manoeuvres = [cut.manoeuvre for cut in cuts if cut.manoeuvre is not None]
    assert len(manoeuvres) == 8
    for cut, manoeuvre in zip(cuts, manoeuvres, strict=True):
        assert manoeuvre.reference_form is ReferenceForm.HELD
        assert manoeuvre.command_s == pytest.approx(cut.start_s + STEP_S)
    # 10 s of rest are kept, on the ground too; the last ends where it has landed, 40 s after its step
    assert manoeuvres[0].time_s[0] == pytest.approx(cuts[0].start_s - 10.0)
    assert manoeuvres[-1].time_s[-1] == pytest.approx(cuts[-1].start_s + 40.0, abs=2.0 * STEP_S)


def test_who_leaves_the_ground_later_has_drawn_no_power_of_a_climb_before() -> None:
    record = vertical()
    late = np.array(record.is_landed)
    late[np.flatnonzero(~late)[0] :][:20] = True  # 2 s of spinning up after the step
    answers = cut_manoeuvres(
        replace(record, is_landed=late, power_w=np.full(late.size, 150.0)),
        hover_power_w=np.full(late.size, 120.0),
    )
    climb = next(cut for cut in answers if cut.answer is ResponseKind.CLIMB_POWER)
    assert climb.manoeuvre is not None
    lifted = climb.manoeuvre.first_change + 20
    assert set(climb.manoeuvre.answer[:lifted]) == {0.0}
    assert set(climb.manoeuvre.answer[lifted:]) == {30.0}


def test_a_shaped_reference_from_the_ground_is_refused() -> None:
    samples = 900
    rising = np.interp(np.arange(samples) * STEP_S, [20.0, 60.0], [0.0, 80.0])
    [cut] = cut_manoeuvres(
        make_record(
            is_landed=rising <= 0.0,
            height_above_home_m=rising,
            ground_speed_m_s=np.zeros(samples),
            reference_height_m=rising,
        )
    )
    assert cut.refusal == "begins or ends on the ground"


def test_a_record_without_power_has_no_power_cuts_and_one_without_references_none() -> None:
    answers = {cut.answer for cut in cut_manoeuvres(level())}
    assert answers == {ResponseKind.SPEED}
    silent = make_record(
        is_landed=np.zeros(300, dtype=np.bool_),
        height_above_home_m=np.linspace(0.0, 50.0, 300),
        ground_speed_m_s=np.zeros(300),
    )
    assert cut_manoeuvres(silent) == ()


def test_commands_at_the_same_time_and_without_rest_are_refused() -> None:
    samples = 1200
    time_s = np.arange(samples) * STEP_S
    height = np.interp(time_s, [20.0, 40.0], [50.0, 90.0])
    speed = np.where((time_s > 30.0) & (time_s < 80.0), 5.0, 0.0)
    speed[time_s > 83.0] = 9.0
    record = make_record(
        is_landed=np.zeros(samples, dtype=np.bool_),
        height_above_home_m=height,
        ground_speed_m_s=speed,
        reference_height_m=height,
        reference_speed_m_s=speed,
    )
    refusals = [cut.refusal for cut in cut_manoeuvres(record)]
    assert refusals == [
        "another reference changes before this one has arrived",
        "another reference changes at the same time",
        "",
        "",
    ]
    height_cut = cut_manoeuvres(record)[0]
    assert height_cut.manoeuvre is None
    hurried = make_record(
        is_landed=np.zeros(samples, dtype=np.bool_),
        ground_speed_m_s=speed,
        reference_speed_m_s=np.where(time_s > 81.0, speed, np.where(speed > 0.0, 5.0, 0.0)),
        reference_height_m=np.where(time_s > 79.0, 60.0, 50.0),
        height_above_home_m=height,
    )
    by_time = {round(cut.start_s): cut.refusal for cut in cut_manoeuvres(hurried)}
    assert by_time[80] == "less than 2 s of rest before the command"


def test_every_fourth_manoeuvre_of_a_kind_is_held_out() -> None:
    cuts = hold_out(2 * cut_manoeuvres(vertical()))
    marked = [cut.manoeuvre.is_held_out for cut in cuts if cut.manoeuvre is not None]
    # four climbs and four descents, and again
    assert np.flatnonzero(marked).tolist() == [3, 7, 11, 15]
    assert len(marked) == 16


def test_from_record_to_models() -> None:
    record = vertical()
    stretches = steady_spans(record, find_states(record), settling_s=35.0)
    law = fit_altitude_law([s.power for s in stretches if s.power is not None]).law
    hover_w = hover_power_w(
        law, height_above_home_m=record.height_above_home_m, mass_kg=None, air_density_kg_m3=1.2
    )
    cuts = cut_manoeuvres(record, hover_power_w=hover_w)
    of: dict[ResponseKind, list[Manoeuvre]] = {answer: [] for answer in ResponseKind}
    for cut in cuts:
        if cut.manoeuvre is not None:
            of[cut.answer].append(cut.manoeuvre)
    altitude = fit_response([m.up_to(60.0) for m in of[ResponseKind.ALTITUDE]], MOTION)
    assert altitude.transfer_function.natural_frequency_rad_s == pytest.approx(0.175243, rel=0.03)
    assert altitude.transfer_function.delay_s == pytest.approx(2.9, rel=0.03)
    climb = fit_response([m.up_to(24.0) for m in of[ResponseKind.CLIMB_POWER]], POWER)
    gain = climb.estimate("steady_gain")
    assert abs(gain.value - 0.342533) < 3.5 * gain.error
