"""Two checks side by side, as text and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.report.json import envelope, figures, finding_document, json_text, value, values
from planner.report.text import finding_lines, printable, table_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.mission.compare import Difference
    from planner.report.medium import Medium
    from planner.service import CheckResult
    from planner.service.comparison import Comparison
    from planner.service.vehicle import MissionComparison


_STATE_KEYS = ("count", "time_s", "distance_m", "energy_wh")
_DIFFERENCES = ("time_s", "distance_m", "energy_wh", "margin_wh", "return_margin_wh")


def comparison_text(
    comparison: Comparison, *, options: tuple[str, str] = ("", ""), medium: Medium
) -> str:
    """Return both checks side by side, each with the options that are its own."""
    a, b = comparison.a, comparison.b
    lines = [
        f"{letter}  {printable(f'{result.file} {own}'.rstrip())}"
        for letter, result, own in (("A", a, options[0]), ("B", b, options[1]))
    ]
    rows = [
        ("", "A", "B", "B - A"),
        ("verdict", a.verdict.upper(), b.verdict.upper(), ""),
        ("vehicle", printable(a.setup.vehicle.name), printable(b.setup.vehicle.name), ""),
        _row("time", comparison, quantity.duration, "time_s", lambda one: one.totals.time_s),
        _row(
            "distance",
            comparison,
            quantity.distance,
            "distance_m",
            lambda one: one.totals.distance_m,
        ),
        _row("energy", comparison, quantity.energy, "energy_wh", lambda one: one.totals.energy_wh),
        _row(
            "above the reserve",
            comparison,
            quantity.energy,
            "margin_wh",
            lambda one: None if one.battery is None else one.battery.margin_wh,
        ),
        _row(
            "on the return",
            comparison,
            quantity.energy,
            "return_margin_wh",
            lambda one: None if one.return_plan is None else one.return_plan.margin_wh,
        ),
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
            _signed(
                quantity.energy,
                None
                if one.energy_wh is None or other.energy_wh is None
                else other.energy_wh - one.energy_wh,
            ),
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
                {
                    "state": str(state),
                    "a": values(one, _STATE_KEYS),
                    "b": values(other, _STATE_KEYS),
                }
                for state, one, other in comparison.states
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
        "vehicle": {
            "name": value(result.setup.vehicle, "name"),
            "source": value(result.setup.vehicle, "source"),
        },
        **figures(result),
    }


def _row(
    name: str,
    comparison: Comparison,
    shown: Callable[[float | None], str],
    difference: str,
    of: Callable[[CheckResult], float | None],
) -> tuple[str, ...]:
    apart: float | None = getattr(comparison, difference)
    return (name, shown(of(comparison.a)), shown(of(comparison.b)), _signed(shown, apart))


def _signed(shown: Callable[[float | None], str], apart: float | None) -> str:
    """Return a difference with its sign, on both sides of nothing."""
    return f"{'+' if apart is not None and apart > 0.0 else ''}{shown(apart)}"


def mission_comparison_text(comparison: MissionComparison) -> str:
    """Return every difference, a line for each, and how many matter."""
    lines = difference_lines(comparison.differences)
    matter = sum(one.matters for one in comparison.differences)
    pair = f"{comparison.first} and {comparison.second}"
    if matter:
        lines.append(f"{quantity.count(matter, 'difference')} between {pair}")
    else:
        lines.append(f"{pair} are the same mission")
    return "".join(f"{line}\n" for line in lines)


def difference_lines(differences: Sequence[Difference]) -> list[str]:
    """Return a line for each difference, those that matter first."""
    ordered = sorted(differences, key=lambda one: not one.matters)
    return [printable(f"{one.kind.value}: {one.message}") for one in ordered]
