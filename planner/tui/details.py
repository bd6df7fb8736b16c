"""What is said about the selected thing: a finding, a segment, an item, or the whole flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import (
    catalogue,
    quantity,
)
from planner.findings import Severity
from planner.report.rule_text import explanation
from planner.report.text import (
    figure_texts,
    label,
    printable,
    said,
)
from planner.service import CheckResult
from planner.tui.rows import MARKS, finding_line
from planner.values import Value

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.service import UnreadableMission


class Details(Value):
    """A heading, and labelled paragraphs under it."""

    title: str
    tone: str = ""
    """``error``, ``warning``, ``info`` or nothing."""
    parts: tuple[tuple[str, str], ...] = ()
    """Label and text; the label may be empty."""


def finding_details(finding: Finding, *, file: str) -> Details:
    """Return a finding with the numbers that made it fire, its way out and its explanation."""
    word = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "assumed"}
    where = printable(file)
    if finding.place is not None:
        where += f":{finding.place.line}:{finding.place.column}"
    parts = [("", said(finding))]
    if finding.fix:
        parts.append(("Do", printable(finding.fix)))
    parts.append(("Where", where))
    if finding.code in catalogue.entries():
        rule = catalogue.rule(finding.code)
        shown = {"Fix"} if finding.fix == rule.fix else set()
        parts += [part for part in explanation(rule) if part[0] not in shown]
    return Details(
        title=f"{MARKS[finding.severity]} {label(finding)} ({word[finding.severity]})",
        tone=finding.severity.label,
        parts=tuple(parts),
    )


def segment_details(result: CheckResult, index: int) -> Details:
    """Return the figures of one segment, and what was found about its item."""
    segment = result.segments[index]
    parts = [
        (
            "Time",
            f"{quantity.duration(segment.duration_s)} from {quantity.duration(segment.start_s)}",
        ),
        ("Distance", quantity.distance(segment.distance_m)),
        ("Climb", quantity.height(segment.climb_m)),
        ("Speed", f"{quantity.speed(segment.speed_m_s)} at most"),
        ("Energy", quantity.energy(segment.energy_wh)),
    ]
    if segment.stopping_distance_m is not None:
        parts.append(("Stop", f"{quantity.distance(segment.stopping_distance_m)} to stop"))
    parts += _found(result, segment.item)
    title = f"Segment {segment.index}: {segment.state}, for item {segment.item}"
    return Details(title=title, parts=tuple(parts))


def item_details(result: CheckResult, number: int) -> Details:
    """Return when an item is reached, and what was found about it."""
    arrival = result.items[number - 1]
    parts = [
        (
            "Reached",
            "not flown"
            if arrival.arrival_s is None
            else f"{quantity.duration(arrival.arrival_s)} after take-off",
        ),
        ("Used", quantity.energy(arrival.energy_used_wh)),
    ]
    if result.assessment is not None:
        item = result.assessment.mission.items[number - 1]
        if item.latitude_deg and item.longitude_deg:
            place = f"{quantity.decimals(item.latitude_deg, 6)}°, "
            parts.append(("Place", place + f"{quantity.decimals(item.longitude_deg, 6)}°"))
        if item.altitude_m is not None:
            parts.append(
                ("Altitude", f"{quantity.height(item.altitude_m)} in the item's own frame")
            )
    parts += _found(result, number)
    return Details(title=f"Item {number}: {arrival.command}", parts=tuple(parts))


def flight_details(result: CheckResult | UnreadableMission) -> Details:
    """Return the whole flight in figures."""
    if not isinstance(result, CheckResult):
        return Details(title="The mission cannot be checked", tone="error")
    return Details(title="The whole flight", parts=tuple(figure_texts(result)))


def _found(result: CheckResult, item: int) -> list[tuple[str, str]]:
    return [("Found", finding_line(one)) for one in result.findings if one.item == item]
