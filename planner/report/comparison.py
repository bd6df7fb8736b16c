"""Two checks side by side, as text and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.report.figures import figures_at, number_at
from planner.report.json import (
    checks_document,
    envelope,
    figures,
    finding_document,
    json_text,
    setup_document,
    value,
    values,
)
from planner.report.text import (
    example_remark,
    finding_lines,
    given_text,
    headline,
    ledger_lines,
    printable,
    settings_lines,
    table_lines,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.mission.compare import Difference
    from planner.report.figures import Figure
    from planner.report.json import Document
    from planner.report.text import Medium
    from planner.service.comparison import Comparison
    from planner.service.preflight import CheckResult
    from planner.service.vehicle import MissionComparison


_COMPARED = figures_at(
    "totals.time_s",
    "totals.distance_m",
    "totals.energy_wh",
    "battery.margin_wh",
    "return.margin_wh",
)
_STATE_KEYS = ("count", "time_s", "distance_m", "energy_wh")
_DIFFERENCES = ("time_s", "distance_m", "energy_wh", "margin_wh", "return_margin_wh")


def comparison_text(
    comparison: Comparison, *, options: tuple[str, str] = ("", ""), medium: Medium
) -> str:
    """Return both checks side by side, each with the options that are its own."""
    a, b = comparison.a, comparison.b
    lines = []
    for letter, result, own in (("A", a, options[0]), ("B", b, options[1])):
        lines.append(
            f"{letter}  {printable(f'{result.file} {own}'.rstrip())}{example_remark(result)}"
        )
        lines.append(f"   {given_text(result)}")
        lines += [f"   {line}" for line in settings_lines(result.setup)]
    rows = [
        ("", "A", "B", "B - A"),
        ("verdict", a.verdict_text, b.verdict_text, ""),
        ("vehicle", _vehicle(a), _vehicle(b), ""),
        *(_row(one, figures(a), figures(b)) for one in _COMPARED),
    ]
    lines += ["", *table_lines(rows, alignment="<>>>"), ""]
    heads = ("", "time A", "time B", "energy A", "energy B", "B - A")
    states = [
        (
            str(state),
            quantity.duration(one.time_s),
            quantity.duration(other.time_s),
            quantity.energy(one.energy_wh),
            quantity.energy(other.energy_wh),
            quantity.signed(_apart(one.energy_wh, other.energy_wh), quantity.energy),
        )
        for state, one, other in comparison.states
    ]
    lines += table_lines([heads, *states], alignment="<>>>>>")
    for title, result, findings in (
        ("Only in A", a, comparison.lost),
        ("Only in B", b, comparison.gained),
    ):
        if findings:
            lines += ["", title]
        for finding in findings:
            lines += finding_lines(finding, file=result.file, medium=medium)
    for letter, result in (("A", a), ("B", b)):
        first, *missing = ledger_lines(result.checked, medium=medium) or [headline(result)]
        lines += ["", f"{letter}  {first}", *missing]
    return "\n".join(lines) + "\n"


def comparison_json(
    comparison: Comparison, *, options: tuple[str, str] = ("", ""), version: str
) -> str:
    """Return both checks side by side as a JSON document."""
    return json_text(
        envelope(version)
        | {
            "a": _document(comparison.a, options[0]),
            "b": _document(comparison.b, options[1]),
            "difference": values(comparison, _DIFFERENCES),
            "states": [
                {"state": str(state), "a": values(a, _STATE_KEYS), "b": values(b, _STATE_KEYS)}
                for state, a, b in comparison.states
            ],
            "gained": [finding_document(finding) for finding in comparison.gained],
            "lost": [finding_document(finding) for finding in comparison.lost],
        },
        indent=2,
    )


def _document(result: CheckResult, options: str) -> dict[str, object]:
    return {
        "file": value(result, "file"),
        "options": options,
        "verdict": result.verdict,
        "vehicle": values(result.setup.vehicle, ("name", "source")),
        **setup_document(result),
        **figures(result),
        "checks": checks_document(result.checked),
    }


def _vehicle(result: CheckResult) -> str:
    name = printable(result.setup.vehicle.name)
    return name if result.setup.is_vehicle_named else f"{name} (none named)"


def _row(figure: Figure, a: Document, b: Document) -> tuple[str, ...]:
    first, second = number_at(a, figure.path), number_at(b, figure.path)
    return (
        figure.label.lower(),
        figure.text(first),
        figure.text(second),
        quantity.signed(_apart(first, second), figure.text),
    )


def _apart(first: float | None, second: float | None) -> float | None:
    return None if first is None or second is None else second - first


def mission_comparison_text(comparison: MissionComparison) -> str:
    """Return every difference, a line for each, and how many matter."""
    matter = sum(one.matters for one in comparison.differences)
    pair = f"{comparison.first} and {comparison.second}"
    last = f"{quantity.count(matter, 'difference')} between {pair}"
    lines = difference_lines(comparison.differences)
    return "\n".join([*lines, last if matter else f"{pair} are the same mission"]) + "\n"


def difference_lines(differences: Sequence[Difference]) -> list[str]:
    """Return a line for each difference, those that matter first."""
    ordered = sorted(differences, key=lambda one: not one.matters)
    return [printable(f"{one.kind.value}: {one.message}") for one in ordered]
