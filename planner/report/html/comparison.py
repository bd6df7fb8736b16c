"""Two missions, vehicles or conditions side by side, as a section of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from planner import quantity
from planner.report.figures import FIGURES, Figure, figures_at, number_at
from planner.report.html.page import template
from planner.report.json import figures
from planner.report.text import flight_phases, headline, printable
from planner.service.preflight import CheckResult

if TYPE_CHECKING:
    from planner.report.json import Document
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
    """Of both."""


def comparison_section(
    first: Result, second: Result, *, names: tuple[str, str] = ("A", "B"), title: str = "Compared"
) -> Any:  # noqa: ANN401 - Markup of jinja2, loaded late
    """Return a section that sets two results side by side, for `check_html`.

    Parameters
    ----------
    first, second : CheckResult or UnreadableMission
        The results; the difference is the second less the first.
    names : tuple of str
        What they are called in the heads of the table.
    title : str
        Heading of the section.

    Returns
    -------
    markupsafe.Markup
        One ``section`` element, all text escaped.
    """
    tables = compared_tables(first, second)
    made = template("comparison.html.j2").module
    return made.comparison(
        title,
        [
            {
                "name": name,
                "verdict": result.verdict,
                "file": printable(result.file),
                "headline": headline(result),
            }
            for name, result in zip(names, (first, second), strict=True)
        ],
        tables,
    )


def compared_tables(
    first: Result, second: Result
) -> tuple[tuple[str, tuple[ComparedRow, ...]], ...]:
    """Return what two results say, table by table; rows of which neither knows anything left out."""
    documents = figures(first), figures(second)
    tables = [
        (title, _rows(documents[0], documents[1], members))
        for title, members in FIGURES
        if title in _COMPARED
    ]
    tables.append(("Energy by state", _state_rows(first, second)))
    return tuple((title, rows) for title, rows in tables if rows)


def _rows(
    first: Document, second: Document, members: tuple[Figure, ...]
) -> tuple[ComparedRow, ...]:
    rows = []
    for row in members:
        a, b = number_at(first, row.path), number_at(second, row.path)
        if a is not None or b is not None:
            rows.append(_row(row, a, b))
    return tuple(rows)


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
