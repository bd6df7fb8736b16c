"""Two missions, vehicles or conditions side by side, as a section of the page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from planner import quantity
from planner.report.figures import FIGURES, Figure, figures_at, number_at
from planner.report.html.mission import FindingView, finding_view
from planner.report.html.page import template
from planner.report.json import figures
from planner.report.text import flight_phases, given_text, headline, printable
from planner.service.comparison import compare_results
from planner.service.preflight import CheckResult

if TYPE_CHECKING:
    from planner.service.preflight import UnreadableMission

    Result = CheckResult | UnreadableMission

_COMPARED = ("Flight", "Energy", "Battery", "Return")
_WITHOUT_DIFFERENCE = ("item", "destination", "latitude_deg", "longitude_deg")


class ComparedRow(NamedTuple):
    """A number of both, as text, and how much more it is in the second."""

    label: str
    first: str
    second: str
    difference: str
    value: float | None
    """Of the difference."""
    path: str
    """Keys of the number in the document of each, joined by a dot."""
    values: tuple[float | None, float | None]


def comparison_section(
    first: Result, second: Result, *, options: tuple[str, str] = ("", "")
) -> Any:  # noqa: ANN401 - Markup of jinja2, loaded late
    """Return a ``section`` that sets two results side by side, for `check_html`; its text is escaped.

    The difference is the second less the first; ``options`` are what each was asked for besides.
    """
    sides = [
        {
            "name": name,
            "verdict": result.verdict_text,
            "file": printable(result.file),
            "headline": headline(result),
            "basis": given_text(result) if isinstance(result, CheckResult) else "",
            "options": printable(own),
        }
        for name, result, own in (("A", first, options[0]), ("B", second, options[1]))
    ]
    tables = compared_tables(first, second)
    only = _only_in_one(first, second)
    return template("comparison.html.j2").module.comparison("Compared", sides, tables, only)


def _only_in_one(first: Result, second: Result) -> list[tuple[str, list[FindingView]]]:
    """Return what is found in one alone, under the name of each that has some."""
    if not (isinstance(first, CheckResult) and isinstance(second, CheckResult)):
        return []
    comparison = compare_results(first, second)
    return [
        (name, [finding_view(one, -1, has_place=False) for one in findings])
        for name, findings in (("A", comparison.lost), ("B", comparison.gained))
        if findings
    ]


def compared_tables(
    first: Result, second: Result
) -> tuple[tuple[str, tuple[ComparedRow, ...]], ...]:
    """Return the figures of two results, table by table; what neither knows is left out."""
    documents = figures(first), figures(second)
    tables = [
        (
            title,
            tuple(
                _row(member, a, b)
                for member in members
                for a, b in [[number_at(document, member.path) for document in documents]]
                if a is not None or b is not None
            ),
        )
        for title, members in FIGURES
        if title in _COMPARED
    ]
    tables.append(("Time by state", _state_rows(first, second, "time_s")))
    tables.append(("Energy by state", _state_rows(first, second, "energy_wh")))
    return tuple((title, rows) for title, rows in tables if rows)


def _row(row: Figure, a: float | None, b: float | None) -> ComparedRow:
    is_place = row.path.endswith(_WITHOUT_DIFFERENCE)
    difference = None
    if a is not None and b is not None and not is_place:
        # of a charge that is overdrawn as it is shown: none is left
        least = 0.0 if row.text is quantity.charge_left else -math.inf
        difference = max(b, least) - max(a, least)
    # a difference may be none, and below nothing, as no chance and no charge is
    shown = quantity.percent if row.text in {quantity.chance, quantity.charge_left} else row.text
    text = "" if difference is None else quantity.signed(difference, shown)
    texts = row.text(a), row.text(b), text
    return ComparedRow(row.label, *texts, difference, row.path, (a, b))


def _state_rows(first: Result, second: Result, key: str) -> tuple[ComparedRow, ...]:
    """Return what each state takes of a quantity of both, and at the end all of them."""
    found = [
        {phase.state: getattr(phase, key) for phase in flight_phases(result)}
        if isinstance(result, CheckResult)
        else {}
        for result in (first, second)
    ]
    [total] = figures_at(f"totals.{key}")
    states = {**found[0], **found[1]}
    return tuple(
        _row(
            total._replace(label=state, path=f"states.{state}.{key}"),
            *(own.get(state) for own in found),
        )
        for state in sorted(states, key=lambda state: (state == "total", list(states).index(state)))
    )
