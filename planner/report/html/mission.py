"""One mission on the page, ready for the template."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from planner import catalogue, quantity
from planner.findings import Severity
from planner.report.figures import KEY_FIGURES, number_at, shown_figure, shown_figures
from planner.report.json import ITEM_KEYS, SEGMENT_KEYS, mission_document
from planner.report.plots.figures import ORANGE, still_svg
from planner.report.plots.flight import mission_panels
from planner.report.plots.tables import make_tables, with_data
from planner.report.rule_text import explanation
from planner.report.text import (
    caveat,
    closing_line,
    finding_message,
    finding_tally,
    flight_phases,
    headline,
    printable,
)
from planner.service.preflight import CheckResult
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.report.figures import ShownFigure
    from planner.report.json import Document
    from planner.report.plots.tables import FlightTables, Row
    from planner.service.preflight import UnreadableMission
    from planner.vehicle.model import VehicleModel
Spec = dict[str, Any]


SEGMENT_DIGITS = {
    "start_s": 1,
    "duration_s": 1,
    "distance_m": 1,
    "climb_m": 1,
    "speed_m_s": 1,
    "energy_wh": 3,
    "stopping_distance_m": 1,
    "stopping_distance_m_p90": 1,
    "arrival_s": 1,
    "energy_used_wh": 3,
}
"""Decimals of the columns of long tables, whose heads name the unit."""


_TIME_TITLE = "Time [min]"
TITLES = {
    "map": "Map",
    "altitude": "Altitude",
    "speed": "Ground speed",
    "power": "Power",
    "energy": "Energy and return",
}


def page_charts(tables: FlightTables) -> dict[str, object]:
    """Return the charts of a result and their data, as JSON the page's script reads."""
    specs: dict[str, Spec] = {
        name: panel.to_dict(validate=False) for name, panel in mission_panels(tables).items()
    }
    _add_live_layers(specs)
    return {
        "charts": specs,
        "tables": {
            name: {"columns": list(rows[0]), "rows": [list(row.values()) for row in rows]}
            for name, rows in tables.named.items()
        },
        "focus": finding_focus(tables),
    }


def still_charts(tables: FlightTables) -> dict[str, str]:
    """Return the charts of a result as SVG, for readers without JavaScript."""
    return {
        name: still_svg(with_data(panel, tables)) for name, panel in mission_panels(tables).items()
    }


def finding_focus(tables: FlightTables) -> list[Row | None]:
    """Return for each finding what of map and time it is about; ``None`` where it has no place."""
    result = tables.result
    stretches: dict[int, list[Row]] = {}
    for row in tables.stretches:
        stretches.setdefault(row["finding"], []).append(
            {"east_m": row["east_m"], "north_m": row["north_m"], "part": row["part"]}
        )
    motion = tables.assessment.flight.motion.segments
    items = motion.item
    focus: list[Row | None] = []
    for number, finding in enumerate(result.findings):
        about: Row = {"code": finding.code}
        if number in stretches:
            about["stretch"] = stretches[number]
        if finding.item is not None and (items == finding.item).any():
            rows = (items == finding.item).nonzero()[0]
            about["item"] = finding.item
            about["start_min"] = round(
                float(motion.end_s[rows[0]] - motion.duration_s[rows[0]]) / 60.0, 4
            )
            about["end_min"] = round(float(motion.end_s[rows[-1]]) / 60.0, 4)
        focus.append(about if len(about) > 1 else None)
    return focus


def _add_live_layers(specs: dict[str, Spec]) -> None:
    """Add what the page moves: a cursor, what is in focus, and on the map what can be zoomed."""
    for name, spec in specs.items():
        spec["layer"] += _map_layers(spec) if name == "map" else _time_layers()
        spec["datasets"] = spec.get("datasets", {})


def _time_layers() -> list[Spec]:
    def at(field: str) -> Spec:
        return {"field": field, "type": "quantitative", "title": _TIME_TITLE}

    return [
        {
            "name": "focus",
            "data": {"name": "focus_time"},
            "mark": {"type": "rect", "color": ORANGE, "opacity": 0.25, "stroke": ORANGE},
            "encoding": {"x": at("start_min"), "x2": {"field": "end_min"}},
        },
        {
            "name": "cursor",
            "data": {"name": "cursor"},
            "mark": {"type": "rule", "strokeWidth": 1.5},
            "encoding": {"x": at("time_min")},
        },
    ]


def _map_layers(spec: Spec) -> list[Spec]:
    axes = next(layer["encoding"] for layer in spec["layer"] if "east_m" in str(layer["encoding"]))
    place = {key: axes[key] for key in ("x", "y")}
    spec["layer"][0].setdefault("params", []).append(
        {
            "name": "view",
            "select": {"type": "interval", "zoom": "wheel![event.shiftKey]"},
            "bind": "scales",
        }
    )
    return [
        {
            "name": "focus",
            "data": {"name": "focus_place"},
            "mark": {
                "type": "line",
                "color": ORANGE,
                "strokeWidth": 9,
                "opacity": 0.7,
                "strokeCap": "round",
                "clip": True,
            },
            "encoding": {
                **place,
                "order": {"field": "order", "type": "quantitative"},
                "detail": {"field": "part", "type": "nominal"},
            },
        },
        {
            "name": "focus_point",
            "data": {"name": "focus_place"},
            "mark": {"type": "point", "size": 260, "strokeWidth": 3, "color": ORANGE, "clip": True},
            "encoding": place,
        },
        {
            "name": "cursor",
            "data": {"name": "cursor"},
            "mark": {
                "type": "point",
                "shape": "cross",
                "filled": True,
                "size": 120,
                "opacity": 1.0,
                "clip": True,
            },
            "encoding": place,
        },
    ]


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
    "stopping_distance_m": "Stopping distance [m]",
    "stopping_distance_m_p90": "9 of 10 stop within [m]",
    "arrival_s": "Reached [s]",
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


class MissionView(Value):
    """Everything the template asks of one mission."""

    number: int
    name: str
    """What it is called, besides its file; empty: nothing."""
    file: str
    verdict: str
    headline: str
    remark: str
    cards: tuple[ShownFigure, ...]
    figures: tuple[tuple[str, tuple[ShownFigure, ...]], ...]
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
    """Return one mission as the page shows it.

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
        cards=tuple(
            shown for one in KEY_FIGURES if (shown := shown_figure(document, one)) is not None
        ),
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
    return finding_tally(result.findings) or quantity.ABSENT


def finding_view(finding: Finding, number: int, *, has_place: bool) -> FindingView:
    """Return a finding as the page shows it; ``number`` is its place among its like."""
    where = []
    if finding.item is not None:
        where.append(f"item {finding.item}")
    if finding.place is not None:
        where.append(f"line {finding.place.line}, column {finding.place.column}")
    known = finding.code in catalogue.entries()
    rule = catalogue.rule(finding.code) if known else None
    return FindingView(
        number=number,
        finding=finding,
        severity=finding.severity.label,
        message=finding_message(finding),
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
                ("time_s", phase.time_s, quantity.duration(phase.time_s)),
                ("distance_m", phase.distance_m, quantity.distance(phase.distance_m)),
                ("energy_wh", phase.energy_wh, quantity.energy(phase.energy_wh)),
                ("energy_fraction", phase.energy_fraction, quantity.percent(phase.energy_fraction)),
            ),
        )
        for phase in flight_phases(result)
    )


def _vehicle(result: CheckResult) -> tuple[tuple[str, str], ...]:
    rows = [("Model", result.setup.vehicle.name), ("File", result.setup.vehicle.source)]
    if result.assessment is not None:
        rows += _provenance(result.assessment.vehicle)
    return tuple((label, printable(text)) for label, text in rows if text)


def _provenance(vehicle: VehicleModel) -> list[tuple[str, str]]:
    rows = [("Description", vehicle.description), ("Flown as", vehicle.reference.label)]
    origin = vehicle.provenance
    rows += [
        ("Source", origin.source),
        ("Method", origin.method),
        ("Made", origin.date.isoformat()),
        ("Fit", ", ".join(f"{name} {value:.4g}" for name, value in origin.fit)),
        ("Logs", ", ".join(origin.logs)),
    ]
    return rows


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
        return quantity.ABSENT
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
        return quantity.decimals(value, SEGMENT_DIGITS[key])
    return quantity.ABSENT if value is None else printable(str(value))
