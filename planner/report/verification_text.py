"""Verifications as a person reads them: the errors first, then where they come from."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING

from planner import numbers
from planner.findings import Severity
from planner.report.finding_text import finding_lines, note_lines
from planner.report.plain_text import printable
from planner.report.table import table_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.comparison import StateComparison, StopComparison
    from planner.identify.verification import Verification
    from planner.report.medium import Medium


def verification_text(verifications: Sequence[Verification], *, medium: Medium) -> str:
    """Return the report of all flights of a call; several end in a summary."""
    blocks = [_flight_lines(one, medium=medium) for one in verifications]
    if len(verifications) > 1:
        blocks.append(_summary_lines(verifications))
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def error_text(fraction: float | None) -> str:
    """Return a relative error with its sign: ``+1.3 %``."""
    if fraction is None:
        return numbers.ABSENT
    text = numbers.decimals(100.0 * fraction, 1)
    return f"+{text} %" if fraction > 0.0 and text != "0.0" else f"{text} %"


def flight_label(one: Verification) -> str:
    """Return what a flight is called: its log, and its number where it is not the first."""
    name = printable(one.log)
    return name if one.flight == 1 else f"{name} flight {one.flight}"


def flight_errors(one: Verification) -> str:
    """Return how far a flight was from its prediction: ``time +1.3 %, energy -0.4 %``."""
    energy = (
        f", energy {error_text(one.energy_fraction)}"
        if one.energy_fraction is not None
        else "; no energy to compare"
    )
    return f"time {error_text(one.time_fraction)}{energy}"


def _flight_lines(one: Verification, *, medium: Medium) -> list[str]:
    lines = [medium.paint(flight_label(one), "bold"), flight_errors(one), ""]
    lines += _figure_lines(one)
    lines += ["", *_state_lines(one.states)]
    if one.stops:
        lines += ["", *_stop_lines(one.stops)]
    graver = [finding for finding in one.findings if finding.severity > Severity.INFO]
    notes = [finding for finding in one.findings if finding.severity is Severity.INFO]
    if graver:
        lines.append("")
    for finding in graver:
        lines += finding_lines(finding, file=one.mission, medium=medium)
    if notes:
        lines += ["", "Assumed"]
    for finding in notes:
        lines += note_lines(finding, medium=medium)
    return lines


def _figure_lines(one: Verification) -> list[str]:
    measured, predicted = one.measured, one.predicted
    distance_fraction = None
    if measured.distance_m and predicted.distance_m is not None:
        distance_fraction = predicted.distance_m / measured.distance_m - 1.0
    rows = [
        ("", "flown", "predicted", "error"),
        (
            "Time",
            f"{numbers.decimals(measured.time_s, 1)} s",
            f"{numbers.decimals(predicted.time_s, 1)} s",
            error_text(one.time_fraction),
        ),
        (
            "Energy",
            numbers.energy(measured.energy_wh),
            numbers.energy(predicted.energy_wh),
            error_text(one.energy_fraction),
        ),
        (
            "Distance",
            numbers.distance(measured.distance_m),
            numbers.distance(predicted.distance_m),
            error_text(distance_fraction),
        ),
    ]
    wind = one.conditions.wind
    air = (
        f"wind {numbers.speed(wind.speed_m_s)} from {numbers.bearing(wind.from_deg)}"
        if wind.speed_m_s
        else "no wind"
    )
    return [
        *table_lines(rows, alignment="<>>>"),
        "",
        (
            f"Vehicle     {printable(one.vehicle_name)}, {air}, "
            f"home {numbers.height(one.conditions.home_amsl_m)} AMSL"
        ),
        f"Mission     {printable(one.mission)}",
        (
            f"Errors      height {numbers.height(one.height_rms_m)}, "
            f"speed {numbers.speed(one.speed_rms_m_s)}, power {numbers.power(one.power_rms_w)}: "
            "root mean square in the air"
        ),
    ]


def _state_lines(states: Sequence[StateComparison]) -> list[str]:
    rows = [
        (
            state.state.value,
            f"{state.count}/{state.predicted_count}",
            numbers.duration(state.time_s),
            numbers.duration(state.predicted_time_s),
            numbers.energy(state.energy_wh),
            numbers.energy(state.predicted_energy_wh),
            error_text(state.energy_fraction),
            numbers.ABSENT
            if state.fit_percent is None
            else f"{numbers.decimals(state.fit_percent, 1)} %",
        )
        for state in states
    ]
    heads = ("State", "count", "flown", "predicted", "flown", "predicted", "error", "fit")
    return table_lines([heads, *rows], alignment="<>>>>>>>")


def _stop_lines(stops: Sequence[StopComparison]) -> list[str]:
    rows = [
        (
            f"at {numbers.duration(stop.start_s)}",
            numbers.speed(stop.speed_m_s),
            numbers.distance(stop.measured_m),
            numbers.distance(stop.predicted_m),
            error_text(
                None if stop.predicted_m is None else stop.predicted_m / stop.measured_m - 1
            ),
        )
        for stop in stops
    ]
    return table_lines([("Stop", "from", "flown", "predicted", "error"), *rows], alignment="<>>>>")


def _summary_lines(verifications: Sequence[Verification]) -> list[str]:
    rows = [
        (
            flight_label(one),
            f"{numbers.decimals(one.measured.time_s, 1)} s",
            error_text(one.time_fraction),
            numbers.energy(one.measured.energy_wh),
            error_text(one.energy_fraction),
        )
        for one in verifications
    ]
    lines = table_lines([("Flight", "flown", "error", "energy", "error"), *rows], alignment="<>>>>")
    for name in ("time", "energy"):
        errors = [getattr(one, f"{name}_fraction") for one in verifications]
        sizes = [abs(error) for error in errors if error is not None]
        if sizes:
            lines.append(
                f"{name}: median error {numbers.percent(median(sizes))}, "
                f"largest {numbers.percent(max(sizes))} of {numbers.count(len(sizes), 'flight')}"
            )
    return lines
