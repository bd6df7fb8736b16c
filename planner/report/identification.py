"""What identification found, as text: the report of each state, and the table of a log."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING

from planner import quantity
from planner.identify.segments import FitStatus
from planner.report.text import by_weight, finding_lines, note_lines, printable, table_lines
from planner.setup import home_phrase, wind_phrase

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.identify.assembly import Identification
    from planner.identify.calibration import Calibration
    from planner.identify.segments import SegmentUse, StateOutcome
    from planner.identify.verification import StateComparison, Stop, Verification
    from planner.logs.record import FlightRecord
    from planner.report.text import Medium


_STYLES = {FitStatus.IDENTIFIED: "green", FitStatus.BASE: "yellow", FitStatus.LEFT_OUT: "yellow"}
_COLOURED_NOISE = 0.01
"""Chance of white noise below which residuals are reported as correlated. [-]"""


def identification_text(found: Identification, *, medium: Medium, with_segments: bool) -> str:
    """Return the report of an identification, if asked with every segment."""
    model = found.model
    flights = found.evidence.records
    seconds = sum(record.duration_s for record in flights)
    lines = [
        medium.paint(model.name, "bold"),
        *medium.wrapped(
            f"  {quantity.count(len(flights), 'flight')}, {quantity.duration(seconds)}; "
            f"references: {model.reference}, mass {quantity.mass(model.mass_kg)}"
        ),
    ]
    for outcome in found.states:
        lines += ["", *_state_lines(outcome, medium=medium, with_segments=with_segments)]
    if found.findings:
        lines.append("")
    for finding in found.findings:
        lines += finding_lines(finding, file=model.source, medium=medium)
    return "\n".join(lines) + "\n"


def _state_lines(outcome: StateOutcome, *, medium: Medium, with_segments: bool) -> list[str]:
    status = medium.paint(outcome.status.value, _STYLES[outcome.status])
    lines = [f"{medium.paint(outcome.name, 'bold')}: {status}"]
    lines += medium.wrapped(f"  {printable(outcome.summary)}", indent=2)
    beside = outcome.refined
    if beside is not None:
        lines += _side_by_side(outcome, beside)
    elif outcome.estimates:
        rows = [
            (
                f"  {e.name}",
                f"{e.value:.6g}",
                _error(e.error),
                _fraction(e.value, e.error),
                "not shown" if e.name in outcome.not_shown else "",
            )
            for e in outcome.estimates
        ]
        lines += table_lines(rows, alignment="<>><<")
    if outcome.segments:
        lines.append(f"  {_segments_sentence(outcome)}")
        lines += [f"    {count} refused: {printable(why)}" for why, count in outcome.refusals()]
    if outcome.fit_percent is not None:
        which = "segments held out" if outcome.held_out else "the segments it was fitted to"
        lines.append(f"  fit on {which}: {outcome.fit_percent:.1f} %{_rms(outcome)}")
        if beside is not None and beside.fit_percent is not None:
            lines.append(f"  by output error: {beside.fit_percent:.1f} %{_rms(beside)}")
    elif outcome.rms is not None:
        lines.append(f"  residuals{_rms(outcome)}")
    if outcome.whiteness is not None:
        kind = "are correlated" if outcome.whiteness < _COLOURED_NOISE else "look like white noise"
        lines.append(f"  residuals {kind} (Ljung-Box p = {outcome.whiteness:.2g})")
    if with_segments:
        lines += [f"    {_segment_line(segment)}" for segment in outcome.segments]
    return lines


def _side_by_side(outcome: StateOutcome, beside: StateOutcome) -> list[str]:
    """Return a table of what ARX found and what the default, output error, finds in the same."""
    arx = {e.name: f"{e.value:.6g}" for e in outcome.estimates}
    refined = {e.name: (f"{e.value:.6g}", _error(e.error)) for e in beside.estimates}
    nothing = (quantity.ABSENT, "")
    rows = [("", "ARX", "output error", "")]
    rows += [
        (f"  {name}", arx.get(name, quantity.ABSENT), *refined.get(name, nothing))
        for name in dict.fromkeys((*arx, *refined))
    ]
    return table_lines(rows, alignment="<>>>")


def _segments_sentence(outcome: StateOutcome) -> str:
    text = f"segments: {outcome.used} used"
    if outcome.held_out:
        text += f" ({outcome.held_out} of them held out for the test)"
    refused = len(outcome.segments) - outcome.used
    return f"{text}, {refused} refused" if refused else text


def _segment_line(segment: SegmentUse) -> str:
    mark = "refused" if segment.refusal else "test" if segment.is_held_out else "used"
    fit = "" if segment.fit_percent is None else f", fit {segment.fit_percent:.1f} %"
    why = f": {segment.refusal}" if segment.refusal else ""
    return printable(
        f"{mark:7} {segment.log}#{segment.flight} at {segment.start_s:.1f} s for "
        f"{segment.duration_s:.1f} s, {segment.what}{fit}{why}"
    )


def _error(error: float) -> str:
    return f"± {error:.2g}" if math.isfinite(error) else quantity.ABSENT


def _fraction(value: float, error: float) -> str:
    if not math.isfinite(error) or value == 0.0:
        return ""
    return f"({quantity.percent(abs(error / value))})"


def _rms(outcome: StateOutcome) -> str:
    return "" if outcome.rms is None else f", rms {outcome.rms:.3g} {outcome.unit}".rstrip()


def log_table_text(records: Sequence[FlightRecord], *, medium: Medium) -> str:
    """Return what the flights of a log tell: each quantity, found where, or what its absence costs."""
    lines: list[str] = []
    for record in records:
        ended = f"from {record.begins_with.value} to {record.ends_with.value}"
        about = ", ".join(part for part in (record.firmware, record.vehicle) if part)
        lines += [
            medium.paint(f"{printable(record.source)}, flight {record.number}", "bold"),
            *medium.wrapped(
                printable(
                    f"  {quantity.duration(record.duration_s)} {ended}; {about or 'unknown vehicle'}; "
                    f"{quantity.count(len(record.parameters), 'parameter')}, "
                    f"{quantity.count(len(record.mission_items), 'mission item')}"
                )
            ),
        ]
        rows = [("  quantity", "found in", "rate", "known", "remark")]
        for q in record.quantities:
            cost = q.remark or ("" if q.is_found else q.absence_cost)
            rows.append(
                (
                    f"  {q.name}",
                    printable(q.found_in or "missing"),
                    "" if q.rate_hz is None else f"{q.rate_hz:.1f} Hz",
                    f"{q.coverage:.0%}" if q.is_found else "",
                    printable(cost),
                )
            )
        lines += [*table_lines(rows, alignment="<<>><"), ""]
        for finding in record.findings:
            lines += finding_lines(finding, file=record.source, medium=medium)
    return "\n".join(lines).rstrip("\n") + "\n"


def verification_text(verifications: Sequence[Verification], *, medium: Medium) -> str:
    """Return the report of all flights of a call; several end in a summary."""
    blocks = [_flight_lines(one, medium=medium) for one in verifications]
    if len(verifications) > 1:
        blocks.append(_summary_lines(verifications))
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def error_text(fraction: float | None) -> str:
    """Return a relative error with its sign: ``+1.3 %``."""
    if fraction is None:
        return quantity.ABSENT
    text = quantity.decimals(100.0 * fraction, 1)
    return f"+{text} %" if fraction > 0.0 and text != "0.0" else f"{text} %"


def flight_label(one: Verification) -> str:
    """Return what a flight is called: its log, and its number where it is not the first."""
    name = printable(one.log)
    return name if one.flight == 1 else f"{name} flight {one.flight}"


def flight_errors(one: Verification) -> str:
    """Return how far a flight was from its prediction: ``time +1.3 %, energy -0.4 %``."""
    energy = f", energy {error_text(one.energy_fraction)}"
    if one.energy_fraction is None:
        energy = "; no energy to compare"
    return f"time {error_text(one.time_fraction)}{energy}"


def _flight_lines(one: Verification, *, medium: Medium) -> list[str]:
    lines = [medium.paint(flight_label(one), "bold"), flight_errors(one), ""]
    lines += _figure_lines(one)
    lines += ["", *_verified_state_lines(one.states)]
    if one.stops:
        lines += ["", *_stop_lines(one.stops)]
    problems, notes = by_weight(one.findings)
    if problems:
        lines.append("")
    for finding in problems:
        lines += finding_lines(finding, file=one.mission, medium=medium)
    if notes:
        lines += ["", "Assumptions"]
    for finding in notes:
        lines += note_lines(finding, medium=medium)
    return lines


def _figure_lines(one: Verification) -> list[str]:
    distance_fraction = None
    if one.measured.distance_m and one.predicted.distance_m is not None:
        distance_fraction = one.predicted.distance_m / one.measured.distance_m - 1.0
    sides = one.measured, one.predicted
    rows = [
        ("", "flown", "predicted", "error"),
        ("Time", *(_seconds(side.time_s) for side in sides), error_text(one.time_fraction)),
        (
            "Energy",
            *(quantity.energy(side.energy_wh) for side in sides),
            error_text(one.energy_fraction),
        ),
        (
            "Distance",
            *(quantity.distance(side.distance_m) for side in sides),
            error_text(distance_fraction),
        ),
    ]
    air = f"{wind_phrase(one.setup.wind)}, {home_phrase(one.setup.home_amsl_m)}"
    errors = (
        f"height {quantity.height(one.height_rms_m)}, speed {quantity.speed(one.speed_rms_m_s)}, "
        f"power {quantity.power(one.power_rms_w)}: root mean square in the air"
    )
    lines = [
        *table_lines(rows, alignment="<>>>"),
        "",
        f"Vehicle     {printable(one.vehicle_name)}, {air}",
        f"Mission     {printable(one.mission)}",
        f"Errors      {errors}",
    ]
    if one.parts:
        parts = (
            f"{part.part} {quantity.signed(part.predicted_time_s - part.time_s, _seconds)}"
            for part in one.parts
        )
        lines.append(f"Time split  {', '.join(parts)}: predicted less flown")
    return lines


def _seconds(time_s: float | None) -> str:
    return quantity.ABSENT if time_s is None else f"{quantity.decimals(time_s, 1)} s"


def _verified_state_lines(states: Sequence[StateComparison]) -> list[str]:
    rows = [
        (
            state.state.value,
            f"{state.count}/{state.predicted_count}",
            quantity.duration(state.time_s),
            quantity.duration(state.predicted_time_s),
            quantity.energy(state.energy_wh),
            quantity.energy(state.predicted_energy_wh),
            error_text(state.energy_fraction),
            quantity.ABSENT
            if state.fit_percent is None
            else f"{quantity.decimals(state.fit_percent, 1)} %",
        )
        for state in states
    ]
    heads = ("State", "count", "flown", "predicted", "flown", "predicted", "error", "fit")
    return table_lines([heads, *rows], alignment="<>>>>>>>")


def _stop_lines(stops: Sequence[Stop]) -> list[str]:
    rows = [
        (
            f"at {quantity.duration(stop.start_s)}",
            quantity.speed(stop.speed_m_s),
            *_flown_and_predicted(stop.measured_m, stop.predicted_m),
            *_flown_and_predicted(stop.measured_farthest_m, stop.predicted_farthest_m),
        )
        for stop in stops
    ]
    heads = ("flown", "predicted", "error")
    return table_lines(
        [("Stop", "from", *heads, "reached", *heads[1:]), *rows], alignment="<>>>>>>>"
    )


def _flown_and_predicted(
    measured_m: float | None, predicted_m: float | None
) -> tuple[str, str, str]:
    error = predicted_m / measured_m - 1.0 if measured_m and predicted_m is not None else None
    return quantity.distance(measured_m), quantity.distance(predicted_m), error_text(error)


def _summary_lines(verifications: Sequence[Verification]) -> list[str]:
    rows = [
        (
            flight_label(one),
            _seconds(one.measured.time_s),
            error_text(one.time_fraction),
            quantity.energy(one.measured.energy_wh),
            error_text(one.energy_fraction),
        )
        for one in verifications
    ]
    lines = table_lines([("Flight", "flown", "error", "energy", "error"), *rows], alignment="<>>>>")
    flown = [one for one in verifications if one.is_of_mission]
    if 0 < len(flown) < len(verifications):
        left_out = quantity.count(len(verifications) - len(flown), "flight")
        lines.append(f"without {left_out} not flown by the mission, or not recorded far enough:")
    for name in ("time", "energy"):
        errors = [getattr(one, f"{name}_fraction") for one in flown or verifications]
        sizes = [abs(error) for error in errors if error is not None]
        if sizes:
            lines.append(
                f"{name}: median error {quantity.percent(median(sizes))}, "
                f"largest {quantity.percent(max(sizes))} of {quantity.count(len(sizes), 'flight')}"
            )
    return lines


def calibration_text(sources: Mapping[str, Sequence[Calibration]], *, medium: Medium) -> str:
    """Return how often flights lay in their intervals, a table for each source of these."""
    blocks = []
    for name, rows in sources.items():
        table = [("", "inside", "chance", "of", "half width", "error", "width / error", "chance")]
        table += [
            (
                row.of,
                f"{row.inside}",
                "{} to {}".format(*row.inside_by_chance),
                f"{row.count}",
                quantity.percent(row.half_width),
                quantity.percent(row.median_error),
                quantity.ABSENT if row.sharpness is None else f"{row.sharpness:.1f}",
                "{:.1f} to {:.1f}".format(*row.sharpness_by_chance),
            )
            for row in rows
        ]
        blocks.append(
            [
                medium.paint(f"Intervals from {name}", "bold"),
                *table_lines(table, alignment="<>>>>>>>"),
            ]
        )
    blocks.append(
        medium.wrapped(
            "80 % of many lie between p10 and p90.  Half width and error are medians; their ratio is "
            "1.9 where errors are normal and known, more where an interval is wider than they ask for.  "
            "Chance: what right intervals show in nine draws of ten of as many independent, normal errors."
        )
    )
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"
