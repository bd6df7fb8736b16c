"""Responses of a vehicle, state by state: cut from all flights, fitted, and tested on some held out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import IdentificationError
from planner.identify.manoeuvres import (
    POWERS,
    ManoeuvreCut,
    ResponseKind,
    hold_out,
    simulated_answers,
)
from planner.identify.output_error import (
    FOLLOWING,
    MOTION,
    POWER,
    POWER_WITHOUT_ZERO,
    response_window_s,
    select_response,
)
from planner.identify.segments import SegmentUse, StateOutcome
from planner.identify.uncertainty import Estimate, fit_percent, rounded, whiteness
from planner.values import Value, replace
from planner.vehicle.declared import declared
from planner.vehicle.model import ManoeuvreResponse, Responses

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.manoeuvres import Manoeuvre
    from planner.identify.output_error import Structure
    from planner.physics.response import TransferFunction


class ResponseEvidence(Value, eq=False):
    """Manoeuvres beside the model that was fitted to them: what a figure shows."""

    name: str
    manoeuvres: tuple[Manoeuvre, ...]
    transfer_function: TransferFunction
    window_s: float | None


class Quality(Value):
    """How one manoeuvre is described by a model."""

    fit_percent: float
    """100 for a perfect model, 0 for one no better than the mean, negative for a worse one. [%]"""
    rms: float
    """Root mean square of the residuals. [output]"""
    whiteness: float
    """Chance that white noise has residuals of such a memory; small where the model leaves
    something over. [-]"""


def evaluate_model(
    system: TransferFunction, manoeuvres: Sequence[Manoeuvre]
) -> tuple[Quality, ...]:
    """Describe each manoeuvre by a model; its offset is the mean answer before the command."""
    found = []
    answers = simulated_answers(system.modes, system.delay_s, manoeuvres)
    for manoeuvre, answer in zip(manoeuvres, answers, strict=True):
        predicted = manoeuvre.answer_before + answer
        residuals = manoeuvre.answer - predicted
        found.append(
            Quality(
                fit_percent=fit_percent(manoeuvre.answer, predicted),
                rms=float(np.sqrt(np.mean(residuals**2))),
                whiteness=whiteness(residuals),
            )
        )
    return tuple(found)


_HEIGHTS = (ResponseKind.ALTITUDE, ResponseKind.CLIMB_POWER, ResponseKind.DESCENT_POWER)
_LONGEST_DELAY_S = 10.0
_MOTION_S = 60.0
"""After a command of motion: a vehicle that takes longer does not follow. [s]"""
_LEAST_FIT_PERCENT = 20.0
"""A model that describes no more than this of what it was fitted to is none. [%]"""
_MOST_SAMPLES = 6000
"""Of all manoeuvres of an answer together: beyond, every second one is fitted, or third …"""
_FIRST_WINDOWS = (1.0, 0.8, 0.6)
"""Of how long a power takes to be that of a hover: noise may take it for longer, and a fit to more than the
window is another model. [-]"""
_LEAST_WINDOW_S = 5.0
_WINDOW_PASSES = 5
_SAME_WINDOW_S = 0.25
_QUIET = 3.0
"""Mean over a second in standard errors, below which a power is hover power again. [-]"""
_ERROR_DIGITS = 3
_LEAST_DAMPING = 0.01
"""Of a response: what swings longer, for fifteen periods to a third, is noise. [-]"""
_GAIN_TOLERANCE = 0.05
"""The model file holds motion to this: a vehicle arrives where it is sent. [-]"""


class FittedResponse(Value, eq=False):
    """A model of one answer."""

    transfer_function: TransferFunction
    estimates: tuple[Estimate, ...]
    window_s: float | None
    """For powers. [s]"""
    coefficient_errors: tuple[tuple[float, ...], tuple[float, ...], float] | None = None
    """Standard errors of numerator, denominator and delay; ``None`` where the method gives none."""


class ResponseIdentification(Value, eq=False):
    """A response for the model file, if there is one, and what was found."""

    response: ManoeuvreResponse | None
    outcome: StateOutcome
    evidence: ResponseEvidence | None = None


def identify_response(
    answer: ResponseKind,
    cuts: Sequence[ManoeuvreCut],
    *,
    use_arx: bool = False,
    is_shaped: bool = False,
) -> ResponseIdentification:
    """Fit one answer to all of its manoeuvres, and test the method on some held out.

    The model is fitted to every manoeuvre.  Its fit percentage is that of a second model, made the
    same way without the manoeuvres held out, on those.

    ``is_shaped``: an autopilot shaped the reference, so it is followed to the end. ``use_arx`` fits
    by ARX alone, as the article does, and by the default for the report beside it.
    """
    if use_arx:
        found = _identified(answer, cuts, use_arx=True, is_shaped=is_shaped)
        refined = _identified(answer, cuts, use_arx=False, is_shaped=is_shaped)
        return replace(found, outcome=replace(found.outcome, refined=refined.outcome))
    return _identified(answer, cuts, use_arx=False, is_shaped=is_shaped)


def _identified(
    answer: ResponseKind, cuts: Sequence[ManoeuvreCut], *, use_arx: bool, is_shaped: bool
) -> ResponseIdentification:
    own = hold_out([cut for cut in cuts if cut.answer is answer])
    manoeuvres = [_prepared(c.manoeuvre, answer) for c in own if c.manoeuvre is not None]
    if not manoeuvres:
        why = "no manoeuvre can be used" if own else "no such manoeuvre in the flights"
        if len(reasons := {cut.refusal for cut in own}) == 1:
            why += f": {reasons.pop()}"
        return _nothing(answer, why, own)
    is_power = answer in POWERS
    # ARX tries slower samplings itself, and finds delays to a sample
    sampled = manoeuvres if use_arx else _thinned(manoeuvres)
    kept = [m for m in sampled if not m.is_held_out]
    try:
        fitted = _fit(sampled, is_power=is_power, use_arx=use_arx, is_shaped=is_shaped)
        tested = fitted
        if len(kept) < len(sampled):
            tested = _fit(kept, is_power=is_power, use_arx=use_arx, is_shaped=is_shaped)
    except IdentificationError as error:
        return _nothing(answer, str(error), own)
    if why := _undetermined(fitted, is_power=is_power):
        return _nothing(answer, why, own)
    fitted, not_shown = _without_what_is_not_shown(fitted)
    gain = fitted.transfer_function.numerator[-1] / fitted.transfer_function.denominator[-1]
    if not is_power and not abs(gain - 1.0) <= _GAIN_TOLERANCE:
        why = f"a command of 1 ends at {gain:.3g}: the vehicle does not arrive where it is sent"
        return _nothing(answer, why, own)
    windowed = [m if fitted.window_s is None else m.up_to(fitted.window_s) for m in manoeuvres]
    of_all = evaluate_model(fitted.transfer_function, windowed)
    best = float(np.median([q.fit_percent for q in of_all]))
    if best < _LEAST_FIT_PERCENT:
        why = f"the best model describes {best:.0f} % of the manoeuvres: no model"
        return _nothing(answer, why, own)
    held = [m for m in windowed if m.is_held_out]
    judged = evaluate_model(tested.transfer_function, held) if held else ()
    return ResponseIdentification(
        response=_model_response(answer, own, fitted),
        outcome=replace(_outcome(answer, own, fitted, of_all, judged), not_shown=not_shown),
        evidence=ResponseEvidence(
            name=answer.value,
            manoeuvres=tuple(windowed),
            transfer_function=fitted.transfer_function,
            window_s=fitted.window_s,
        ),
    )


def _undetermined(fitted: FittedResponse, *, is_power: bool) -> str:
    """Return why a fit shows nothing: its own error exceeds what every response has; else nothing.

    That is how fast it is, the last coefficient of the denominator, and how much, any of the numerator.
    Nor is a motion one that hardly comes to rest; a power, used over its window alone, may ring.
    """
    poles = () if is_power else fitted.transfer_function.poles
    if any(-pole.real < _LEAST_DAMPING * abs(pole) for pole in poles):
        return "the best model hardly comes to rest"
    if fitted.coefficient_errors is None:
        return ""
    system, (of_numerator, of_denominator, _) = fitted.transfer_function, fitted.coefficient_errors
    b_shown = [e < abs(b) for b, e in zip(system.numerator, of_numerator, strict=True)]
    if not any(b_shown):
        name, value, error = "b0", system.numerator[-1], of_numerator[-1]
    elif not of_denominator[-1] < abs(system.denominator[-1]):
        name, value, error = "a0", system.denominator[-1], of_denominator[-1]
    else:
        return ""
    return f"{name} would be {value:.3g} ± {error:.2g}: the manoeuvres do not show it"


def _without_what_is_not_shown(fitted: FittedResponse) -> tuple[FittedResponse, tuple[str, ...]]:
    """Return a fit whose coefficients of the numerator and delay are 0 where their errors exceed them."""
    if fitted.coefficient_errors is None:
        return fitted, ()
    system, errors = fitted.transfer_function, fitted.coefficient_errors
    of_numerator, of_denominator, of_delay_s = errors
    numerator = [
        b if e < abs(b) else 0.0 for b, e in zip(system.numerator, of_numerator, strict=True)
    ]
    delay_s = system.delay_s if of_delay_s < system.delay_s else 0.0
    names = (*(f"b{n}" for n in range(len(numerator) - 1, -1, -1)), "delay_s")
    found = (*system.numerator, system.delay_s)
    gone = tuple(
        name
        for name, was, now in zip(names, found, (*numerator, delay_s), strict=True)
        if was != now
    )
    if not gone:
        return fitted, ()
    plain = replace(system, numerator=tuple(numerator), delay_s=delay_s)
    left = of_numerator[-len(plain.numerator) :]  # a leading 0 is none
    errors = (left, of_denominator, of_delay_s)
    return replace(fitted, transfer_function=plain, coefficient_errors=errors), gone


def _prepared(manoeuvre: Manoeuvre, answer: ResponseKind) -> Manoeuvre:
    return manoeuvre if answer in POWERS else manoeuvre.up_to(_command_s(manoeuvre) + _MOTION_S)


def _command_s(manoeuvre: Manoeuvre) -> float:
    moving = np.flatnonzero(np.diff(manoeuvre.reference))
    return float(manoeuvre.time_s[moving[-1] + 1]) - manoeuvre.command_s


def _thinned(manoeuvres: Sequence[Manoeuvre]) -> list[Manoeuvre]:
    count = -(-sum(m.time_s.size for m in manoeuvres) // _MOST_SAMPLES)
    return list(manoeuvres) if count == 1 else [m.every(count) for m in manoeuvres]


def _fit(
    manoeuvres: Sequence[Manoeuvre], *, is_power: bool, use_arx: bool, is_shaped: bool
) -> FittedResponse:
    if not is_power:
        structures: tuple[Structure, ...] = (MOTION,)
        if is_shaped:
            structures = tuple(replace(s, steady_gain=1.0) for s in (MOTION, FOLLOWING))
        motion = _fit_once(manoeuvres, structures, use_arx=use_arx)
        return replace(motion, window_s=None)
    return _fit_over_window(manoeuvres, use_arx=use_arx)


def _fit_over_window(manoeuvres: Sequence[Manoeuvre], *, use_arx: bool) -> FittedResponse:
    """Return the fit to part of manoeuvres that, used over its own window, describes the whole of them best.

    A fit to more than that window is another model, so windows are sought from several on, each next one
    that of the fit to the last.
    """
    longest_s = min(float(m.time_s[-1]) - m.command_s for m in manoeuvres)
    quiet_s = _quiet_after_s(manoeuvres)

    found: dict[float, FittedResponse] = {}

    def fit_up_to(window_s: float) -> None:
        windowed = [m.up_to(window_s) for m in manoeuvres]
        fitted = _fit_once(windowed, (POWER, POWER_WITHOUT_ZERO), use_arx=use_arx)
        found[window_s] = replace(fitted, window_s=min(fitted.window_s or window_s, longest_s))

    def best() -> FittedResponse:
        return min(found.values(), key=lambda one: _squares(one, manoeuvres))

    for fraction in _FIRST_WINDOWS:
        fit_up_to(max(fraction * quiet_s, _LEAST_WINDOW_S))
    for _ in range(_WINDOW_PASSES):
        window_s = best().window_s
        assert window_s is not None
        if any(abs(window_s - fitted_s) < _SAME_WINDOW_S for fitted_s in found):
            break
        fit_up_to(window_s)
    return best()


def _squares(fitted: FittedResponse, manoeuvres: Sequence[Manoeuvre]) -> float:
    """Return the sum of the squares that a power used over its window leaves of whole manoeuvres."""
    windowed = [m.up_to(fitted.window_s or math.inf) for m in manoeuvres]
    left = 0.0
    for whole, part, quality in zip(
        manoeuvres, windowed, evaluate_model(fitted.transfer_function, windowed), strict=True
    ):
        after = whole.answer[part.time_s.size :] - whole.answer_before
        left += part.time_s.size * quality.rms**2 + float(after @ after)
    return left


def _fit_once(
    manoeuvres: Sequence[Manoeuvre], structures: Sequence[Structure], *, use_arx: bool
) -> FittedResponse:
    span_s = min(float(m.time_s[-1]) - m.command_s for m in manoeuvres)
    longest_delay_s = min(_LONGEST_DELAY_S, 0.5 * span_s)
    if use_arx:
        return _fit_by_arx(manoeuvres, structures, longest_delay_s)
    fit = select_response(manoeuvres, structures, longest_delay_s=longest_delay_s)
    errors = np.sqrt(np.maximum(np.diagonal(fit.covariance), 0.0))
    size = fit.structure.numerator_size
    return FittedResponse(
        transfer_function=fit.transfer_function,
        estimates=fit.estimates,
        window_s=fit.window_s,
        coefficient_errors=(
            tuple(errors[:size].tolist()),
            (0.0, *errors[size:-1].tolist()),
            float(errors[-1]),
        ),
    )


def _fit_by_arx(
    manoeuvres: Sequence[Manoeuvre], structures: Sequence[Structure], longest_delay_s: float
) -> FittedResponse:
    """Fit as the article does: it gives no errors."""
    from planner.identify.arx import select_arx

    system = select_arx(
        manoeuvres,
        longest_delay_s=longest_delay_s,
        poles=structures[0].denominator_degree,
        zeros=structures[0].numerator_degree,
    )
    *_, a1, a0 = system.denominator
    names = (f"b{power}" for power in range(len(system.numerator) - 1, -1, -1))
    rows = dict(zip(names, system.numerator, strict=True)) | {
        "a1": a1,
        "a0": a0,
        "delay_s": system.delay_s,
        "steady_gain": system.numerator[-1] / a0,
        "natural_frequency_rad_s": math.sqrt(a0),
        "damping_ratio": 0.5 * a1 / math.sqrt(a0),
    }
    return FittedResponse(
        transfer_function=system,
        estimates=tuple(Estimate(name=n, value=v, error=float("nan")) for n, v in rows.items()),
        window_s=response_window_s(system),
    )


def _quiet_after_s(manoeuvres: Sequence[Manoeuvre]) -> float:
    """Return after which time a power is hover power again, by the mean of the manoeuvres.

    What is known is the noise at rest before the command: the last second whose mean leaves it ends
    the manoeuvre.
    """
    step_s = manoeuvres[0].step_s
    second = max(1, round(1.0 / step_s))
    shortest = min(m.time_s.size - m.first_change for m in manoeuvres)
    total, noise = np.zeros(shortest), 0.0
    for m in manoeuvres:
        change = float(m.reference[-1] - m.reference[0])
        answer = (m.answer - m.answer_before) / change
        total += answer[m.first_change : m.first_change + shortest]
        noise += float(answer[: m.first_change].var())
    smooth = np.convolve(total, np.full(second, 1.0 / second), mode="valid")
    # white noise, averaged over a second, and over the rest that the offset was taken from
    limit = _QUIET * np.sqrt(noise / second) + 0.02 * float(np.abs(smooth).max())
    loud = np.flatnonzero(np.abs(smooth) > limit)
    last = (int(loud[-1]) if loud.size else shortest - 1) * step_s
    return float(np.clip(last, _LEAST_WINDOW_S, (shortest - 1) * step_s))


def _model_response(
    answer: ResponseKind, cuts: Sequence[ManoeuvreCut], fitted: FittedResponse
) -> ManoeuvreResponse:
    system = fitted.transfer_function
    size = rounded(float(np.median([abs(c.change) for c in cuts if c.is_used])), 4)
    is_height = answer in _HEIGHTS
    of_numerator, of_denominator, of_delay_s = fitted.coefficient_errors or (None, None, None)
    [kind] = declared(Responses)[answer.value].parts
    own = {"identified_step_m" if is_height else "identified_speed_m_s": size}
    if answer in POWERS:
        own["window_s"] = rounded(fitted.window_s or 0.0, 8)
    response = kind(
        numerator=tuple(rounded(b, 8) for b in system.numerator),
        denominator=tuple(rounded(a, 8) for a in system.denominator),
        delay_s=rounded(system.delay_s, 8),
        input_gain=1.0,
        numerator_standard_error=_rounded_errors(of_numerator),
        denominator_standard_error=_rounded_errors(of_denominator),
        delay_standard_error_s=None if of_delay_s is None else rounded(of_delay_s, _ERROR_DIGITS),
        **own,
    )
    assert isinstance(response, ManoeuvreResponse)
    return response


def _outcome(
    answer: ResponseKind,
    cuts: Sequence[ManoeuvreCut],
    fitted: FittedResponse,
    of_all: Sequence[Quality],
    judged: Sequence[Quality],
) -> StateOutcome:
    used = sum(c.is_used for c in cuts)
    tested = judged or of_all
    window = "" if answer not in POWERS else f", used for {fitted.window_s or 0.0:.1f} s"
    beside = "" if judged else "; none could be held out"
    order = "first" if len(fitted.transfer_function.denominator) == 2 else "second"
    return StateOutcome(
        name=answer.value,
        summary=f"{order} order with a delay, from {quantity.count(used, 'manoeuvre')}{window}{beside}",
        unit="W" if answer in POWERS else "m" if answer is ResponseKind.ALTITUDE else "m/s",
        estimates=fitted.estimates,
        segments=_segments(cuts, of_all),
        fit_percent=float(np.median([q.fit_percent for q in tested])),
        rms=float(np.sqrt(np.mean([q.rms**2 for q in tested]))),
        whiteness=float(np.median([q.whiteness for q in tested])),
    )


def _segments(
    cuts: Sequence[ManoeuvreCut], qualities: Sequence[Quality] = ()
) -> tuple[SegmentUse, ...]:
    left = iter(qualities)
    rows = []
    for cut in cuts:
        quality = next(left, None) if cut.is_used else None
        unit = "m" if cut.answer in _HEIGHTS else "m/s"
        rows.append(
            SegmentUse.of(
                cut,
                f"{cut.answer.value} {cut.change:+.4g} {unit}",
                refusal=cut.refusal,
                is_held_out=cut.manoeuvre is not None and cut.manoeuvre.is_held_out,
                fit_percent=None if quality is None else quality.fit_percent,
            )
        )
    return tuple(rows)


def _nothing(
    answer: ResponseKind, why: str, cuts: Sequence[ManoeuvreCut]
) -> ResponseIdentification:
    return ResponseIdentification(
        response=None, outcome=StateOutcome.left_out(answer.value, why, _segments(cuts))
    )


def _rounded_errors(errors: tuple[float, ...] | None) -> tuple[float, ...] | None:
    return None if errors is None else tuple(rounded(error, _ERROR_DIGITS) for error in errors)
