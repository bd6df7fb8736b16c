"""What identification found, as text: the report of each state, and the table of a log."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import numbers
from planner.identify.outcome import Status
from planner.report.finding_text import finding_lines
from planner.report.plain_text import printable
from planner.report.table import table_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.outcome import Identification, SegmentUse, StateOutcome
    from planner.logs.record import FlightRecord
    from planner.report.medium import Medium

_STYLES = {Status.IDENTIFIED: "green", Status.BASE: "yellow", Status.LEFT_OUT: "yellow"}
_COLOURED_NOISE = 0.01
"""Chance of white noise below which residuals are said to have a memory. [-]"""


def identification_text(found: Identification, *, medium: Medium, with_segments: bool) -> str:
    """Return the report of an identification.

    Parameters
    ----------
    found : Identification
        What was found.
    medium : Medium
        What the text is written on.
    with_segments : bool
        Whether every segment is listed.
    """
    model = found.model
    flights = found.evidence.records
    seconds = sum(record.duration_s for record in flights)
    lines = [
        medium.paint(model.name, "bold"),
        *medium.wrapped(
            f"  {numbers.count(len(flights), 'flight')}, {numbers.duration(seconds)}; "
            f"references: {model.reference}, mass {numbers.mass(model.mass_kg)}"
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
    lines += medium.wrapped(f"  {printable(outcome.said)}", indent=2)
    if outcome.estimates:
        rows = [
            (f"  {e.name}", f"{e.value:.6g}", _error(e.error), _share(e.value, e.error))
            for e in outcome.estimates
        ]
        lines += table_lines(rows, alignment="<>><")
    if outcome.segments:
        lines.append(f"  {_segments_sentence(outcome)}")
        lines += [f"    {count} refused: {printable(why)}" for why, count in outcome.refusals()]
    if outcome.fit_percent is not None:
        which = "segments held out" if outcome.held_out else "the segments it was fitted to"
        lines.append(f"  fit on {which}: {outcome.fit_percent:.1f} %{_rms(outcome)}")
    elif outcome.rms is not None:
        lines.append(f"  residuals{_rms(outcome)}")
    if outcome.whiteness is not None:
        kind = "have a memory" if outcome.whiteness < _COLOURED_NOISE else "are like white noise"
        lines.append(f"  residuals {kind} (Ljung-Box p = {outcome.whiteness:.2g})")
    if with_segments:
        lines += [f"    {_segment_line(segment)}" for segment in outcome.segments]
    return lines


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
    return f"± {error:.2g}" if math.isfinite(error) else numbers.ABSENT


def _share(value: float, error: float) -> str:
    if not math.isfinite(error) or value == 0.0:
        return ""
    return f"({numbers.percent(abs(error / value))})"


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
                    f"  {numbers.duration(record.duration_s)} {ended}; {about or 'unknown vehicle'}; "
                    f"{numbers.count(len(record.parameters), 'parameter')}, "
                    f"{numbers.count(len(record.mission_items), 'mission item')}"
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
