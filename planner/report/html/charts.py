"""The pictures of the page: the charts of `planner.plots`, their data once for all of them.

What the page moves is added as layers without data: the time that is looked at, and the place of a
finding.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.plots.files import still_svg
from planner.plots.mission import mission_panels
from planner.plots.tables import with_data
from planner.plots.theme import ORANGE

if TYPE_CHECKING:
    from planner.plots.places import Row
    from planner.plots.tables import FlightTables

    Spec = dict[str, Any]

_TIME_TITLE = "Time [min]"
TITLES = {
    "map": "Map",
    "altitude": "Altitude",
    "speed": "Ground speed",
    "power": "Power",
    "energy": "Energy and the way home",
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
