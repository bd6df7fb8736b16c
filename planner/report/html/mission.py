"""One mission on the page, ready for the template."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planner import catalogue, quantity
from planner.findings import Severity
from planner.geo.tiles import tiles_over
from planner.report.columns import cell_text
from planner.report.figures import KEY_FIGURES, shown_figure, shown_figures
from planner.report.json import ITEM_KEYS, SEGMENT_KEYS, mission_document
from planner.report.plots.flight import mission_panels
from planner.report.plots.picture_files import ORANGE, still_svg
from planner.report.rule_text import explanation
from planner.report.tables import make_tables, named_rows
from planner.report.text import (
    caveat,
    checked_text,
    closing_line,
    example_remark,
    finding_message,
    flight_phases,
    given_text,
    headline,
    not_checked,
    printable,
)
from planner.service.preflight import CheckResult
from planner.service.separation import known_home_amsl_m

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from planner.findings import Finding
    from planner.geo.geodesy import LocalFrame
    from planner.geo.tiles import TileServer
    from planner.report.json import Document
    from planner.report.tables import FlightTables, Row
    from planner.service.preflight import UnreadableMission
Spec = dict[str, Any]


_TIME_TITLE = "Time [min]"
TITLES = {
    "map": "Map",
    "altitude": "Altitude",
    "speed": "Ground speed",
    "power": "Power",
    "energy": "Energy and return",
}


def page_charts(
    tables: FlightTables, specs: dict[str, Spec], server: TileServer | None = None
) -> dict[str, object]:
    """Return the charts of a result and their data, as JSON the page's script reads.

    The specifications are taken over: each gets the layers that the script moves, the map a base map
    where there is one.
    """
    for name, spec in specs.items():
        if name == "map":
            spec["layer"] += _map_layers(spec)
            if server is not None:
                spec["layer"].insert(0, _base_map(spec, tables.assessment.route.frame, server))
        else:
            add_time_layers(spec)
        spec["datasets"] = spec.get("datasets", {})
    home_m = known_home_amsl_m(tables.assessment)
    return {
        "charts": specs,
        "tables": page_tables(tables.named),
        "focus": finding_focus(tables),
        "home_amsl_m": None if home_m is None else round(home_m, 2),
    }


def page_tables(tables: Mapping[str, Sequence[Row]]) -> dict[str, object]:
    """Return rows as the page's script reads them: the names of the columns once."""
    return {
        name: {"columns": list(rows[0]), "rows": [list(row.values()) for row in rows]}
        for name, rows in tables.items()
        if rows
    }


def still_charts(tables: FlightTables, specs: dict[str, Spec]) -> dict[str, str]:
    """Return the charts of a result as SVG, for readers without JavaScript."""
    rows = tables.named
    return {
        name: still_svg(spec | {"datasets": named_rows(spec, rows)}) for name, spec in specs.items()
    }


def finding_focus(tables: FlightTables) -> list[Row | None]:
    """Return for each finding what of map and time it is about; ``None`` where it has no place."""
    result = tables.result
    motion = tables.assessment.flight.motion.segments
    focus: list[Row | None] = []
    for number, finding in enumerate(result.findings):
        about: Row = {"code": finding.code}
        if stretch := [row for row in tables.stretches if row["finding"] == number]:
            keys = ("east_m", "north_m", "part")
            about["stretch"] = [{key: row[key] for key in keys} for row in stretch]
        is_own = motion.item == finding.item
        rows = [] if finding.item is None else is_own.nonzero()[0].tolist()
        if rows:
            start_s = motion.end_s[rows[0]] - motion.duration_s[rows[0]]
            about["item"] = finding.item
            about["start_min"] = round(float(start_s) / 60.0, 4)
            about["end_min"] = round(float(motion.end_s[rows[-1]]) / 60.0, 4)
        focus.append(about if len(about) > 1 else None)
    return focus


def add_time_layers(spec: Spec) -> None:
    """Add what the page moves on a picture over time: what is in focus, and a cursor.

    The picture can be zoomed along its time; all stays within it.
    """

    def at(field: str) -> Spec:
        return {"field": field, "type": "quantitative", "title": _TIME_TITLE}

    for layer in spec["layer"]:
        layer["mark"] = {**layer["mark"], "clip": True}
    spec["layer"] += [
        {
            "name": "focus",
            "data": {"name": "focus_time"},
            "mark": {
                "type": "rect",
                "color": ORANGE,
                "opacity": 0.25,
                "stroke": ORANGE,
                "clip": True,
            },
            "encoding": {"x": at("start_min"), "x2": {"field": "end_min"}},
        },
        {
            "name": "cursor",
            "data": {"name": "cursor"},
            "mark": {"type": "rule", "strokeWidth": 1.5},
            "encoding": {"x": at("time_min")},
            "params": [_zoom("span", encodings=["x"])],
        },
    ]


def _map_layers(spec: Spec) -> list[Spec]:
    """Return what the page moves on the map, and let the map be zoomed."""
    place = zoomable(spec)
    line = {"type": "line", "color": ORANGE, "strokeWidth": 9, "opacity": 0.7, "strokeCap": "round"}
    along = {
        "order": {"field": "order", "type": "quantitative"},
        "detail": {"field": "part", "type": "nominal"},
    }
    point = {"type": "point", "size": 260, "strokeWidth": 3, "color": ORANGE}
    cross = {"type": "point", "shape": "cross", "filled": True, "size": 120, "opacity": 1.0}
    return [
        {
            "name": name,
            "data": {"name": data},
            "mark": {**mark, "clip": True},
            "encoding": {**place, **encoding},
        }
        for name, data, mark, encoding in (
            ("focus", "focus_place", line, along),
            ("focus_point", "focus_place", point, {}),
            ("cursor", "cursor", cross, {}),
        )
    ]


def _base_map(spec: Spec, frame: LocalFrame, server: TileServer) -> Spec:
    """Return the layer of a base map below a map: an image for each tile of what is shown at first."""
    axes = next(layer["encoding"] for layer in spec["layer"] if "east_m" in str(layer["encoding"]))
    (west_m, east_m), (south_m, north_m) = (axes[key]["scale"]["domain"] for key in ("x", "y"))
    corners_deg = zip(
        *(
            one.tolist()
            for one in frame.latitude_longitude_deg(
                np.array([west_m, east_m]), np.array([south_m, north_m])
            )
        ),
        strict=True,
    )
    rows = []
    for tile in tiles_over(*corners_deg, most=_MOST_TILES):
        west, north = frame.east_north_m(*tile.north_west_deg)
        east, south = frame.east_north_m(*tile.south_east_deg)
        ends = (west, east, south, north)
        keys = ("east_m", "east_end_m", "north_m", "north_end_m")
        rows.append(
            {"url": tile.at(server)}
            | {key: round(float(end), 1) for key, end in zip(keys, ends, strict=True)}
        )
    return {
        "name": "base_map",
        "data": {"values": rows},
        "mark": {"type": "image", "aspect": False, "clip": True, "opacity": 0.75},
        "encoding": {
            "x": axes["x"],
            "y": axes["y"],
            "x2": {"field": "east_end_m"},
            "y2": {"field": "north_end_m"},
            "url": {"field": "url", "type": "nominal"},
        },
    }


_MOST_TILES = 36


def zoomable(spec: Spec) -> Spec:
    """Let a map be zoomed; return how its layers place things."""
    axes = next(layer["encoding"] for layer in spec["layer"] if "east_m" in str(layer["encoding"]))
    spec["layer"][0].setdefault("params", []).append(_zoom("view"))
    return {key: axes[key] for key in ("x", "y")}


def _zoom(name: str, **select: object) -> Spec:
    """Return the parameter by which a picture is moved and zoomed."""
    interval = {"type": "interval", "zoom": "wheel![event.shiftKey]", **select}
    return {"name": name, "select": interval, "bind": "scales"}


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
    "farthest_stop_m": "A stop gets as far as [m]",
    "stopping_distance_m_p90": "9 of 10 stop within [m]",
    "arrival_s": "Reached [s]",
    "energy_used_wh": "Energy used [Wh]",
    "left_s": "Left [s]",
    "pass": "Pass",
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


def mission_view(
    result: CheckResult | UnreadableMission,
    *,
    number: int,
    sha256: str,
    most_rows: int,
    has_stills: bool = False,
    name: str = "",
    server: TileServer | None = None,
) -> dict[str, Any]:
    """Return everything the template asks of one mission.

    ``number`` is its place in the report, ``sha256`` is empty where that of its file is not known,
    ``most_rows`` are those of each table behind a picture, stills are for readers without
    JavaScript, ``name`` is what it is called besides its file, and ``server`` that of a base map.
    """
    document = mission_document(result)
    assessment = result.assessment if isinstance(result, CheckResult) else None
    stills: dict[str, str] = {}
    payload: dict[str, Any] = {}
    if isinstance(result, CheckResult) and assessment is not None:
        tables = make_tables(result, most_rows=most_rows)
        specs = {
            name: panel.to_dict(validate=False) for name, panel in mission_panels(tables).items()
        }
        stills = still_charts(tables, specs) if has_stills else {}
        payload = page_charts(tables, specs, server)
    payload["long"] = {
        name: _long_table(document, name, keys)
        for name, keys in (("segments", SEGMENT_KEYS), ("items", ITEM_KEYS))
    }
    focus: Sequence[object] = payload.get("focus", [None] * len(result.findings))
    views = [
        finding_view(finding, index, has_place=focus[index] is not None)
        for index, finding in enumerate(result.findings)
    ]
    return {
        "number": number,
        "name": name,
        "file": printable(result.file),
        "called": ": ".join(filter(None, (name, printable(result.file)))),
        "verdict": result.verdict_text,
        "basis": given_text(result) if isinstance(result, CheckResult) else "",
        "headline": headline(result),
        "remark": " ".join(filter(None, (caveat([result]).strip(), _example(result)))),
        "cards": [*filter(None, (shown_figure(document, one) for one in KEY_FIGURES))],
        "figures": shown_figures(document),
        "phases": _phases(result) if isinstance(result, CheckResult) else (),
        "problems": [view for view in views if view.finding.severity > Severity.INFO],
        "notes": [view for view in views if view.finding.severity is Severity.INFO],
        "suppressed": [
            (finding_view(finding, -1, has_place=False), printable(finding.suppression))
            for finding in result.suppressed
        ],
        "closing": closing_line(result.findings, suppressed=result.suppressed),
        "checked": checked_text(result.checked),
        "not_checked": not_checked(result.checked),
        "ledger": result.checked,
        "vehicle": _vehicle(result) if isinstance(result, CheckResult) else (),
        "readings": ()
        if assessment is None
        else [*map(printable, assessment.vehicle.provenance.readings)],
        "parameters": _parameters(document),
        "charts": [(name, TITLES[name]) for name in payload.get("charts", ())],
        "stills": stills,
        "base_map": "" if server is None else printable(server.attribution),
        "counts": {name: len(table["text"]) for name, table in payload["long"].items()},
        "sha256": sha256,
        "payload": payload,
    }


def _example(result: CheckResult | UnreadableMission) -> str:
    remark = example_remark(result).removeprefix(": ")
    return f"{remark[:1].upper()}{remark[1:]}." if remark else ""


def finding_view(finding: Finding, number: int, *, has_place: bool) -> FindingView:
    """Return a finding as the page shows it; ``number`` is its place among its like."""
    where = []
    if finding.item is not None:
        where.append(f"item {finding.item}")
    if finding.place is not None:
        where.append(f"line {finding.place.line}, column {finding.place.column}")
    rule = catalogue.rule(finding.code) if finding.code in catalogue.entries() else None
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


def _phases(result: CheckResult) -> list[dict[str, Any]]:
    """Return each state of the flight and the whole: column, value and text of each number."""
    shown: dict[str, Callable[[Any], str]] = {
        "segments": str,
        "time_s": quantity.duration,
        "distance_m": quantity.distance,
        "energy_wh": quantity.energy,
        "energy_fraction": quantity.percent,
    }
    return [
        {
            "state": phase.state,
            "numbers": [
                (key, getattr(phase, key), text(getattr(phase, key))) for key, text in shown.items()
            ],
        }
        for phase in flight_phases(result)
    ]


def _vehicle(result: CheckResult) -> list[tuple[str, str]]:
    rows = [("Model", result.setup.vehicle.name), ("File", result.setup.vehicle.source)]
    if (file := result.setup.settings_file) is not None:
        rows.append(("Settings", str(file)))
    if result.assessment is not None:
        vehicle = result.assessment.vehicle
        origin = vehicle.provenance
        rows += [
            ("Description", vehicle.description),
            ("Flown as", result.assessment.autopilot.label),
            ("Source", origin.source),
            ("Method", origin.method),
            ("Made", origin.date.isoformat()),
            ("Fit", ", ".join(f"{name} {value:.4g}" for name, value in origin.fit)),
            ("Logs", ", ".join(origin.logs)),
        ]
    return [(label, printable(text)) for label, text in rows if text]


def _parameters(document: Document) -> tuple[tuple[str, str, float | None, str], ...]:
    found = document["parameters"]
    assert isinstance(found, dict)  # by the contract of the JSON report
    return tuple(
        (name, _plain(one["value"]), one["value"], printable(one["origin"]))
        for name, one in found.items()
    )


def _plain(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else cell_text("", value, quantity.ABSENT)


def _long_table(document: Document, name: str, keys: tuple[str, ...]) -> dict[str, Any]:
    """Return a table of thousands of rows, each with its texts and the numbers of the document."""
    rows = document[name]
    assert isinstance(rows, list)  # by the contract of the JSON report
    return {
        "keys": keys,
        "heads": [_HEADS.get(key, key) for key in keys],
        "text": [[cell_text(key, row[key], quantity.ABSENT) for key in keys] for row in rows],
        "value": [[row[key] for key in keys] for row in rows],
    }
