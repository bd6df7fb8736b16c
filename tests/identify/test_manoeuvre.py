"""Manoeuvres are what they claim to be, and answers to their references are exact."""

from __future__ import annotations

import control
import numpy as np
import pytest
from made_record import make_record

from planner.identify.manoeuvres import (
    Manoeuvre,
    ReferenceForm,
    ResponseKind,
    cut_manoeuvres,
    simulated_answers,
)
from planner.physics.response import TransferFunction
from planner.values import replace

SYSTEM = TransferFunction(numerator=(0.4, 2.56), denominator=(1.0, 1.9, 2.56), delay_s=0.3)
STEP_S = 0.1


def manoeuvre(
    reference: list[float] | np.ndarray, form: ReferenceForm = ReferenceForm.HELD
) -> Manoeuvre:
    reference = np.asarray(reference, dtype=np.float64)
    return Manoeuvre(
        time_s=5.0 + STEP_S * np.arange(float(reference.size)),
        reference=reference,
        answer=np.arange(float(reference.size)),
        reference_form=form,
    )


def delayed(answer: np.ndarray) -> np.ndarray:
    shift = round(SYSTEM.delay_s / STEP_S)
    return np.concatenate([np.zeros(shift), answer])[: answer.size]


def test_the_answer_to_a_held_reference_is_that_of_control() -> None:
    reference = np.repeat([3.0, 8.0, 7.0, 3.0, -1.0], 40)
    sampled = control.sample_system(control.tf([0.4, 2.56], [1.0, 1.9, 2.56]), STEP_S, "zoh")
    time_s = STEP_S * np.arange(reference.size)
    expected = delayed(control.forced_response(sampled, time_s, reference - 3.0).outputs)
    (found,) = simulated_answers(SYSTEM.modes, SYSTEM.delay_s, [manoeuvre(reference)])
    np.testing.assert_allclose(found, expected, atol=1e-11)


def test_the_answer_to_a_linear_reference_is_that_of_control() -> None:
    # control's forced response of a continuous system goes straight between samples, too
    knots = [3.0, 3.0, 9.0, 9.5, 2.0, 2.0]
    reference = np.interp(np.arange(200), np.arange(6) * 40, knots)
    time_s = STEP_S * np.arange(reference.size)
    system = control.tf([0.4, 2.56], [1.0, 1.9, 2.56])
    expected = delayed(control.forced_response(system, time_s, reference - 3.0).outputs)
    (found,) = simulated_answers(
        SYSTEM.modes, SYSTEM.delay_s, [manoeuvre(reference, ReferenceForm.LINEAR)]
    )
    np.testing.assert_allclose(found, expected, atol=1e-10)


def test_slopes_are_those_of_the_answer() -> None:
    cut = manoeuvre(np.repeat([0.0, 1.0], 300))
    (answer,) = simulated_answers(SYSTEM.modes, SYSTEM.delay_s, [cut])
    (slope,) = simulated_answers(SYSTEM.modes, SYSTEM.delay_s, [cut], derivative=1)
    # the trapezoid rule errs by h³/12 times a third derivative of about 4
    trapezoid = 0.5 * STEP_S * (slope[1:] + slope[:-1])
    after_delay = slice(304, None)
    np.testing.assert_allclose(
        trapezoid[after_delay], np.diff(answer)[after_delay], atol=4.0 * STEP_S**3 / 12.0
    )


def test_manoeuvres_of_several_lengths_and_steps_are_answered_alike() -> None:
    short = manoeuvre([0.0] * 5 + [1.0] * 20)
    long = manoeuvre([0.0] * 5 + [1.0] * 90)
    coarse = long.every(5)
    answers = simulated_answers(SYSTEM.modes, SYSTEM.delay_s, [short, long, coarse])
    np.testing.assert_array_equal(answers[0], answers[1][:25])
    np.testing.assert_allclose(answers[2], answers[1][::5], atol=1e-12)


def test_the_command_and_the_mean_before_it_are_found() -> None:
    cut = manoeuvre([2.0, 2.0, 2.0, 7.0, 7.0, 7.0])
    assert cut.first_change == 3
    assert cut.command_s == pytest.approx(5.3)
    assert cut.answer_before == 1.0  # of 0, 1, 2
    ramp = manoeuvre([2.0, 2.0, 2.0, 7.0, 7.0, 7.0], ReferenceForm.LINEAR)
    assert ramp.first_change == 2  # it leaves from there


def test_a_window_ends_at_its_time_inclusive() -> None:
    cut = manoeuvre([0.0] * 5 + [1.0] * 50).up_to(1.0)
    assert cut.time_s.size == 5 + 11


def test_every_so_manieth_sample_holds_the_command() -> None:
    thinned = manoeuvre([0.0] * 7 + [1.0] * 50).every(5)
    assert thinned.step_s == pytest.approx(0.5)
    assert thinned.command_s == pytest.approx(5.7)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time_s": [0.0, 0.1, 0.2, 0.4]}, "even steps"),
        ({"time_s": [0.3, 0.2, 0.1, 0.0]}, "even steps"),
        ({"reference": [1.0, 1.0, 1.0, 1.0]}, "must change"),
        ({"answer": [0.0, 1.0, float("nan"), 1.0]}, "finite"),
        ({"answer": [0.0, 1.0]}, "one length"),
        (
            {"reference": [0.0, 1.0, 1.0, 1.0], "reference_form": ReferenceForm.LINEAR},
            "at rest before",
        ),
    ],
)
def test_what_is_no_manoeuvre_is_refused(changes: dict[str, object], message: str) -> None:
    values: dict[str, object] = {
        "time_s": [0.0, 0.1, 0.2, 0.3],
        "reference": [0.0, 0.0, 1.0, 1.0],
        "answer": [0.0, 0.0, 0.0, 1.0],
    }
    with pytest.raises(ValueError, match=message):
        Manoeuvre(**{**values, **changes})  # type: ignore[arg-type]  # lists are made arrays


def test_in_wind_the_answer_to_a_command_of_speed_is_over_ground() -> None:
    # commanded from 0 to 8 m/s over ground, against 3 m/s of wind
    speed = np.repeat([0.0, 8.0], 200)
    zero = np.zeros(speed.size)
    record = make_record(
        is_landed=np.zeros(speed.size, np.bool_),
        reference_speed_m_s=speed,
        ground_speed_m_s=speed,
        velocity_north_m_s=speed,
        velocity_east_m_s=zero,
        airspeed_m_s=speed + 3.0,
    )
    for known in (record, replace(record, velocity_north_m_s=np.full(speed.size, np.nan))):
        (cut,) = (one for one in cut_manoeuvres(known) if one.answer is ResponseKind.SPEED)
        assert cut.manoeuvre is not None
        assert cut.manoeuvre.answer[-1] == 8.0


@pytest.mark.parametrize(("held_s", "is_refused"), [(5.0, False), (5.1, True)])
def test_a_speed_held_by_the_lean_is_no_answer_to_its_command(
    held_s: float, *, is_refused: bool
) -> None:
    # ArduCopter's simulator at ANGLE_MAX 15°: 15 m/s commanded, 6 m/s come to
    speed = np.repeat([0.0, 15.0], 200)
    zero, leant = np.zeros(speed.size), np.zeros(speed.size)
    record = make_record(
        is_landed=np.zeros(speed.size, np.bool_),
        reference_speed_m_s=speed,
        ground_speed_m_s=0.4 * speed,
        velocity_north_m_s=0.4 * speed,
        velocity_east_m_s=zero,
    )
    leant[200 : 200 + round(held_s / record.step_s)] = 15.0
    held = replace(record, pitch_deg=-leant, roll_deg=zero, parameters={"ANGLE_MAX": 1500.0})
    cut = next(one for one in cut_manoeuvres(held) if one.answer is ResponseKind.SPEED)
    assert cut.refusal.startswith("held at the greatest lean") == is_refused
