"""What the page tells of one mission, ready for the template."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from planner import catalogue, numbers
from planner.findings import Severity
from planner.frozen import frozen
from planner.plots.tables import make_tables
from planner.report.finding_text import closing_line, said
from planner.report.finding_text import tally as finding_tally
from planner.report.html.charts import TITLES, page_charts, still_charts
from planner.report.html.quantities import (
    SEGMENT_DIGITS,
    Quantity,
    Shown,
    number_at,
    shown_figures,
    shown_number,
)
from planner.report.json_report import ITEM_KEYS, SEGMENT_KEYS, mission_document
from planner.report.phases import flight_phases
from planner.report.plain_text import printable
from planner.report.rule_text import explanation
from planner.report.text import caveat, headline
from planner.service import CheckResult

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.report.json_document import Document
    from planner.service import UnreadableMission
    from planner.vehicle.model import VehicleModel

_CARDS = (
    Quantity("totals.time_s", "Time", numbers.duration),
    Quantity("totals.distance_m", "Distance", numbers.distance),
    Quantity("totals.energy_wh", "Energy", numbers.energy),
    Quantity("battery.used_fraction", "Of the battery", numbers.percent),
    Quantity("battery.margin_wh", "Above the reserve", numbers.energy),
    Quantity("return.margin_wh", "Tightest way home", numbers.energy),
)
_HEADS = {
    "index": "No.",
    "item": "Item",
    "state": "State",
    "command": "Command",
    "start_s": "Start [s]",
    "duration_s": "Time [s]",
    "distance_m": "Distance [m]",
    "climb_m": "Climb [m]",
    "speed_m_s": "Speed [m/s]",
    "energy_wh": "Energy [Wh]",
    "stopping_distance_m": "Room to stop [m]",
    "stopping_distance_m_p90": "9 of 10 stop within [m]",
    "arrival_s": "Done at [s]",
    "energy_used_wh": "Energy used [Wh]",
}


class FindingView(NamedTuple):
    """A finding as the page shows it."""

    number: int
    """Its place in the result."""
    finding: Finding
    severity: str
    message: str
    fix: str
    where: str
    explanation: tuple[tuple[str, str], ...]
    has_place: bool
    """Whether the map has something to show."""


class PhaseView(NamedTuple):
    """A state of the flight, or the whole."""

    state: str
    numbers: tuple[tuple[str, float | None, str], ...]
    """Column, value and text of each."""


@frozen
class MissionView:
    """Everything the template asks of one mission."""

    number: int
    name: str
    """What it is called, besides its file; empty: nothing."""
    file: str
    verdict: str
    headline: str
    remark: str
    cards: tuple[Shown, ...]
    figures: tuple[tuple[str, tuple[Shown, ...]], ...]
    phases: tuple[PhaseView, ...]
    graver: tuple[FindingView, ...]
    notes: tuple[FindingView, ...]
    suppressed: tuple[tuple[FindingView, str], ...]
    closing: str
    vehicle: tuple[tuple[str, str], ...]
    readings: tuple[str, ...]
    """Decisions taken where the model's source can be read in more than one way."""
    parameters: tuple[tuple[str, str, float | None, str], ...]
    """Name, text, value and origin of each."""
    charts: tuple[tuple[str, str], ...]
    """Name and title of each."""
    stills: dict[str, str]
    """SVG of each by name, for readers without JavaScript; empty where there are too many to make."""
    counts: dict[str, int]
    """Rows of the long tables."""
    sha256: str
    payload: dict[str, Any]
    """What the script of the page draws."""


def mission_view(
    result: CheckResult | UnreadableMission,
    *,
    number: int,
    sha256: str,
    most_rows: int,
    has_stills: bool = False,
    name: str = "",
) -> MissionView:
    """Return what the page tells of a mission.

    Parameters
    ----------
    result : CheckResult or UnreadableMission
        The mission.
    number : int
        Its place in the report.
    sha256 : str
        Of its file; empty where that is not known.
    most_rows : int
        Of each table behind a picture.
    has_stills : bool
        Whether its pictures are made for readers without JavaScript, too.
    name : str
        What it is called, besides its file.
    """
    document = mission_document(result)
    flown = result if isinstance(result, CheckResult) and result.assessment is not None else None
    tables = None if flown is None else make_tables(flown, most_rows=most_rows)
    payload: dict[str, Any] = {} if tables is None else page_charts(tables)
    payload["long"] = {
        name: _long_table(document, name, keys)
        for name, keys in (("segments", SEGMENT_KEYS), ("items", ITEM_KEYS))
    }
    focus: Sequence[object] = payload.get("focus", [None] * len(result.findings))
    views = [
        finding_view(finding, index, has_place=focus[index] is not None)
        for index, finding in enumerate(result.findings)
    ]
    return MissionView(
        number=number,
        name=name,
        file=printable(result.file),
        verdict=result.verdict,
        headline=headline(result),
        remark=caveat([result]).strip(),
        cards=tuple(shown for one in _CARDS if (shown := shown_number(document, one)) is not None),
        figures=shown_figures(document),
        phases=_phases(result) if isinstance(result, CheckResult) else (),
        graver=tuple(view for view in views if view.finding.severity > Severity.INFO),
        notes=tuple(view for view in views if view.finding.severity is Severity.INFO),
        suppressed=tuple(
            (finding_view(finding, -1, has_place=False), printable(finding.suppression))
            for finding in result.suppressed
        ),
        closing=closing_line(result.findings, suppressed=result.suppressed),
        vehicle=_vehicle(result) if isinstance(result, CheckResult) else (),
        readings=()
        if flown is None or flown.assessment is None
        else _readings(flown.assessment.vehicle),
        parameters=_parameters(document),
        charts=tuple((name, TITLES[name]) for name in payload.get("charts", ())),
        stills=still_charts(tables) if has_stills and tables is not None else {},
        counts={name: len(table["text"]) for name, table in payload["long"].items()},
        sha256=sha256,
        payload=payload,
    )


def badness(result: CheckResult | UnreadableMission) -> tuple[float, ...]:
    """Return what missions are sorted by, worst first: verdict, errors, what is left, warnings."""
    counts = [
        sum(finding.severity is severity for finding in result.findings)
        for severity in (Severity.ERROR, Severity.WARNING)
    ]
    margin_wh = number_at(mission_document(result), "battery.margin_wh")
    return (
        0.0 if not isinstance(result, CheckResult) else 1.0,
        0.0 if result.verdict == "no-go" else 1.0,
        -counts[0],
        float("inf") if margin_wh is None else margin_wh,
        -counts[1],
    )


def tally_text(result: CheckResult | UnreadableMission) -> str:
    """Return how many findings a mission has of each severity."""
    return finding_tally(result.findings) or numbers.ABSENT


def finding_view(finding: Finding, number: int, *, has_place: bool) -> FindingView:
    """Return a finding as the page shows it; ``number`` is its place among its like."""
    where = []
    if finding.item is not None:
        where.append(f"item {finding.item}")
    if finding.place is not None:
        where.append(f"line {finding.place.line}, column {finding.place.column}")
    rule = catalogue.rules().get(finding.code)
    return FindingView(
        number=number,
        finding=finding,
        severity=finding.severity.label,
        message=said(finding),
        fix=printable(finding.fix),
        where=", ".join(where),
        explanation=() if rule is None else (("What", rule.summary), *explanation(rule)),
        has_place=has_place,
    )


def _phases(result: CheckResult) -> tuple[PhaseView, ...]:
    return tuple(
        PhaseView(
            phase.state,
            (
                ("segments", phase.segments, str(phase.segments)),
                ("time_s", phase.time_s, numbers.duration(phase.time_s)),
                ("distance_m", phase.distance_m, numbers.distance(phase.distance_m)),
                ("energy_wh", phase.energy_wh, numbers.energy(phase.energy_wh)),
                ("energy_fraction", phase.energy_fraction, numbers.percent(phase.energy_fraction)),
            ),
        )
        for phase in flight_phases(result)
    )


def _vehicle(result: CheckResult) -> tuple[tuple[str, str], ...]:
    told = [("Model", result.vehicle_name), ("File", result.vehicle_source)]
    if result.assessment is not None:
        told += _provenance(result.assessment.vehicle)
    return tuple((label, printable(text)) for label, text in told if text)


def _provenance(vehicle: VehicleModel) -> list[tuple[str, str]]:
    told = [("What it is", vehicle.description), ("Flown as", vehicle.reference.label)]
    origin = vehicle.provenance
    told += [
        ("Source", origin.source),
        ("Method", origin.method),
        ("Made", origin.date.isoformat()),
        ("Fit", ", ".join(f"{name} {value:.4g}" for name, value in origin.fit)),
        ("Logs", ", ".join(origin.logs)),
    ]
    return told


def _readings(vehicle: VehicleModel) -> tuple[str, ...]:
    return tuple(printable(reading) for reading in vehicle.provenance.readings)


def _parameters(document: Document) -> tuple[tuple[str, str, float | None, str], ...]:
    found = document["parameters"]
    assert isinstance(found, dict)  # by the contract of the JSON report
    return tuple(
        (name, _plain(one["value"]), one["value"], printable(one["origin"]))
        for name, one in found.items()
    )


def _plain(value: object) -> str:
    if value is None:
        return numbers.ABSENT
    return f"{value:g}" if isinstance(value, float) else printable(str(value))


def _long_table(document: Document, name: str, keys: tuple[str, ...]) -> dict[str, Any]:
    """Return a table of thousands of rows, each with its texts and the numbers of the document."""
    rows = document[name]
    assert isinstance(rows, list)  # by the contract of the JSON report
    return {
        "keys": keys,
        "heads": [_HEADS.get(key, key) for key in keys],
        "text": [[_cell(key, row[key]) for key in keys] for row in rows],
        "value": [[row[key] for key in keys] for row in rows],
    }


def _cell(key: str, value: Any) -> str:  # noqa: ANN401 - a number, a text or nothing
    if key in SEGMENT_DIGITS:
        return numbers.decimals(value, SEGMENT_DIGITS[key])
    return numbers.ABSENT if value is None else printable(str(value))
