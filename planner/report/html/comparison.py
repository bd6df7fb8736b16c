"""Two missions, vehicles or conditions side by side, as a section of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from planner import quantity
from planner.report.figures import FIGURES, Figure, figures_at, number_at
from planner.report.html.page import template
from planner.report.json import figures
from planner.report.text import flight_phases, given_text, headline, printable
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
    return template("comparison.html.j2").module.comparison("Compared", sides, tables)


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
    tables.append(("Energy by state", _state_rows(first, second)))
    return tuple((title, rows) for title, rows in tables if rows)


def _row(row: Figure, a: float | None, b: float | None) -> ComparedRow:
    is_place = row.path.endswith(_WITHOUT_DIFFERENCE)
    difference = None if a is None or b is None or is_place else b - a
    # a difference may be none, and below nothing, as no chance is
    shown = quantity.percent if row.text is quantity.chance else row.text
    text = "" if difference is None else quantity.signed(difference, shown)
    texts = row.text(a), row.text(b), text
    return ComparedRow(row.label, *texts, difference, row.path, (a, b))


def _state_rows(first: Result, second: Result) -> tuple[ComparedRow, ...]:
    energies = [
        {phase.state: phase.energy_wh for phase in flight_phases(result)}
        if isinstance(result, CheckResult)
        else {}
        for result in (first, second)
    ]
    [energy] = figures_at("totals.energy_wh")
    states = {**energies[0], **energies[1]}
    return tuple(
        _row(
            energy._replace(label=state, path=f"states.{state}.energy_wh"),
            *(found.get(state) for found in energies),
        )
        for state in sorted(states, key=lambda state: (state == "total", list(states).index(state)))
    )
