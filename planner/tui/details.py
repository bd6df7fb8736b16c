"""In words: the verdict, what a change makes of it, and the details of the selected thing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import catalogue, quantity
from planner.findings import Severity
from planner.report.figures import figures_at, number_at
from planner.report.json import figures
from planner.report.rule_text import explanation
from planner.report.text import (
    caveat,
    checked_text,
    closing_line,
    figure_texts,
    finding_message,
    given_text,
    headline,
    label,
    left_unchecked,
    margin_text,
    not_checked,
    printable,
    tightest_text,
)
from planner.service.preflight import CheckResult
from planner.tui.rows import LEFT_OPEN, MARKS, finding_line
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.flight.returns.tightest import ReturnPlan
    from planner.rules.ledger import LedgerEntry
    from planner.service.preflight import UnreadableMission
    from planner.tui.checked import Checked


class Details(Value):
    """A heading, and labelled paragraphs under it."""

    title: str
    tone: str = ""
    """``error``, ``warning``, ``info`` or nothing."""
    parts: tuple[tuple[str, str], ...] = ()
    """Label and text; the label may be empty."""


def finding_details(finding: Finding, *, file: str) -> Details:
    """Return a finding with the numbers that made it fire, its way out and its explanation."""
    word = "assumption" if finding.severity is Severity.INFO else finding.severity.label
    where = printable(file)
    if finding.place is not None:
        where += f":{finding.place.line}:{finding.place.column}"
    parts = [("", finding_message(finding))]
    if finding.fix:
        parts.append(("Do", printable(finding.fix)))
    parts.append(("Where", where))
    if finding.code in catalogue.entries():
        rule = catalogue.rule(finding.code)
        shown = {"Fix"} if finding.fix == rule.fix else set()
        parts += [part for part in explanation(rule) if part[0] not in shown]
    return Details(
        title=f"{MARKS[finding.severity]} {label(finding)} ({word})",
        tone=finding.severity.label,
        parts=tuple(parts),
    )


def left_open_details(entry: LedgerEntry) -> Details:
    """Return a rule that was not checked with what it needs, and its explanation."""
    rule = catalogue.rule(entry.code)
    return Details(
        title=f"{LEFT_OPEN} {entry.code} {entry.name} (not checked)",
        tone="warning",
        parts=(("Needs", entry.needs), ("What", rule.summary), *explanation(rule)),
    )


def segment_details(result: CheckResult, index: int) -> Details:
    """Return the figures of one segment, and what was found about its item."""
    segment = result.segments[index]
    parts = [
        ("Time", " from ".join(map(quantity.duration, (segment.duration_s, segment.start_s)))),
        ("Distance", quantity.distance(segment.distance_m)),
        ("Climb", quantity.height(segment.climb_m)),
        ("Speed", f"{quantity.speed(segment.speed_m_s)} at most"),
        ("Energy", quantity.energy(segment.energy_wh)),
    ]
    if segment.stopping_distance_m is not None:
        stop_m, farthest_m = segment.stopping_distance_m, segment.farthest_stop_m
        beyond = "" if farthest_m == stop_m else f", gets as far as {quantity.distance(farthest_m)}"
        parts.append(("Stops in", f"{quantity.distance(stop_m)}{beyond}"))
    parts += _found(result, segment.item)
    title = f"Segment {segment.index}: {segment.state}, for item {segment.item}"
    return Details(title=title, parts=tuple(parts))


def item_details(result: CheckResult, number: int) -> Details:
    """Return when an item is reached, and what was found about it."""
    arrival = result.items[number - 1]
    reached = "not flown"
    if arrival.arrival_s is not None:
        reached = f"{quantity.duration(arrival.arrival_s)} after take-off"
    parts = [("Reached", reached), ("Used", quantity.energy(arrival.energy_used_wh))]
    if result.assessment is not None:
        item = result.assessment.mission.items[number - 1]
        if item.latitude_deg and item.longitude_deg:
            degrees = (item.latitude_deg, item.longitude_deg)
            parts.append(("Place", ", ".join(f"{quantity.decimals(one, 6)}°" for one in degrees)))
        if item.altitude_m is not None:
            altitude = f"{quantity.height(item.altitude_m)} in the item's own frame"
            parts.append(("Altitude", altitude))
    parts += _found(result, number)
    return Details(title=f"Item {number}: {arrival.command}", parts=tuple(parts))


def flight_details(result: CheckResult | UnreadableMission) -> Details:
    """Return the whole flight in figures."""
    if not isinstance(result, CheckResult):
        return Details(title="The mission cannot be checked", tone="error")
    parts = [*figure_texts(result), *ledger_parts(result)]
    return Details(title="The whole flight", parts=tuple(parts))


def ledger_parts(result: CheckResult | UnreadableMission) -> tuple[tuple[str, str], ...]:
    """Return how much was checked, and what is missing for the rest, as labelled paragraphs."""
    checked = checked_text(result.checked)
    return (
        *((("Checked", checked),) if checked else ()),
        *(
            ("Not checked", f"{rules} (needs {needs})")
            for needs, rules in not_checked(result.checked)
        ),
    )


def _found(result: CheckResult, item: int) -> list[tuple[str, str]]:
    return [("Found", finding_line(one)) for one in result.findings if one.item == item]


_CHANGED = tuple(
    zip(
        ("Time", "Energy", "Margin", "Return"),
        figures_at("totals.time_s", "totals.energy_wh", "battery.margin_wh", "return.margin_wh"),
        strict=True,
    )
)
"""What a change is judged by, with labels that fit a narrow pane."""


class Summary(Value):
    """The verdict and the figures at the top."""

    verdict: str
    """``GO``, ``NO-GO`` or ``NOT CHECKED``."""
    is_go: bool
    file: str
    headline: str
    """What the flight takes and leaves."""
    return_plan: str
    """The tightest return; empty where none is known."""
    closing: str
    """How much was found."""
    given: str = ""
    """Vehicle, battery and wind; empty where nothing is flown."""
    not_checked: str = ""
    """How many rules were not checked; empty where all were."""

    def without_verdict(self, why: str) -> Summary:
        """Return it where its verdict no longer holds, and why."""
        return replace(self, verdict="NO VERDICT", is_go=False, file=f"{self.file}  {why}")


def left_open_text(checked: Sequence[LedgerEntry]) -> str:
    """Return how many rules were not checked; nothing where all were."""
    count = len(left_unchecked(checked))
    return f"{quantity.count(count, 'rule')} not checked" if count else ""


def summary(result: CheckResult | UnreadableMission) -> Summary:
    """Return the verdict and the figures of a flight in words."""
    way = result.return_plan if isinstance(result, CheckResult) else None
    return Summary(
        verdict="NO VERDICT" if getattr(result, "failure", "") else result.verdict_text,
        is_go=result.verdict == "go",
        file=printable(result.file) + caveat([result]),
        given=given_text(result) if isinstance(result, CheckResult) else "",
        headline=headline(result),
        return_plan="" if way is None else _tightest(way),
        closing=closing_line(result.findings, suppressed=result.suppressed),
        not_checked=left_open_text(result.checked),
    )


def checked_summary(checked: Checked) -> Summary:
    """Return the summary of a check, and of which mission it is: the file, or the file at a speed tried."""
    brief = summary(checked.result)
    speed = checked.tried_speed
    return replace(brief, file=f"{brief.file}, once it is saved at {speed}") if speed else brief


def _tightest(way: ReturnPlan) -> str:
    text = f"Tightest return: {tightest_text(way, ', ')}"
    return text if way.margin_wh is None else f"{text}, {margin_text(way.margin_wh, 'the reserve')}"


def differences(
    base: CheckResult | UnreadableMission, now: CheckResult | UnreadableMission
) -> tuple[tuple[str, str], ...]:
    """Return label, the figures before and after a change, and their difference."""
    lines = [("Verdict", _arrow([base.verdict_text, now.verdict_text]))]
    if not (isinstance(base, CheckResult) and isinstance(now, CheckResult)):
        return tuple(lines)
    before, after = figures(base), figures(now)
    for name, figure in _CHANGED:
        was, then = number_at(before, figure.path), number_at(after, figure.path)
        text = _arrow([figure.text(was), figure.text(then)])
        if was is not None and then is not None:
            changed = "no change" if was == then else quantity.signed(then - was, figure.text)
            text += f" ({changed})"
        lines.append((name, text))
    return tuple(lines)


def _arrow(texts: Sequence[str]) -> str:
    return texts[0] if texts[0] == texts[1] else " → ".join(texts)
