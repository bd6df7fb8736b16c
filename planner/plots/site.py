"""A picture of a mission from above: the path flown, items, home, rally points, fence, wind."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner import numbers
from planner.findings import Severity
from planner.geo.fence import FencePolygon
from planner.plots.library import Chart, load_altair
from planner.plots.tables import make_tables
from planner.plots.theme import BLUE, GREEN, ORANGE, PURPLE, RED

if TYPE_CHECKING:
    from planner.checks.case import Case
    from planner.findings import Finding
    from planner.flight.motion.kinematics import FloatArray
    from planner.geo.fence import FenceCircle
    from planner.geo.local_frame import LocalFrame
    from planner.plots.tables import FlightTables, Row
    from planner.service import CheckResult

WIDTH, HEIGHT = 720, 480
"""What the map fits into. [px]"""
_NARROWEST = 0.4
"""A side of the map over the other, at least. [-]"""
_LEAST_M = 20.0
"""Extent of a mission that stays at one place. [m]"""
_FAR_FENCE = 3.0
"""A fence whose extent is more than so many times the mission's is not shown as a whole. [-]"""
_CIRCLE_POINTS = 72
_EDGE_POINTS = 8
"""Fence edges are straight in degrees, thus bent in metres."""
_MOST_NUMBERS = 40
"""Items that have their number beside them: more hide each other."""
_NEAR_PX = 12.0
"""Marks nearer to each other share one name."""
_KINDS = ("item", "home", "rally point")


class View(NamedTuple):
    """The part of the ground that a map shows; a metre is as long in both directions."""

    west_m: float
    east_m: float
    south_m: float
    north_m: float
    width_px: int
    height_px: int


def map_figure(result: CheckResult) -> Chart:
    """Return the path flown over ground, north up, a metre as long in both directions.

    Raises
    ------
    UsageError
        If nothing is flown, or Altair is missing.
    """
    return map_panel(make_tables(result))


def map_panel(tables: FlightTables) -> Chart:
    """Return the map of tables."""
    alt = load_altair()
    marks = item_rows(tables.case) + place_rows(tables.case)
    fence = fence_rows(tables.case)
    stretches = stretch_rows(tables.result)
    view = map_view(tables, marks, fence, stretches)
    x = alt.X("east_m:Q").title("East of home [m]")
    y = alt.Y("north_m:Q").title("North of home [m]")
    x = x.scale(domain=[view.west_m, view.east_m], nice=False, zero=False)
    y = y.scale(domain=[view.south_m, view.north_m], nice=False, zero=False)

    def layer(rows: list[Row], name: str) -> Chart:
        chart = alt.Chart(alt.InlineData(values=rows, name=name))
        return chart.encode(x=x, y=y)

    layers = []
    if fence:
        layers.append(
            layer(fence, "fence")
            .mark_line(strokeWidth=1.8, clip=True, color=RED)
            .encode(
                detail="area:N",
                order="order:Q",
                strokeDash=alt.StrokeDash("kind:N")
                .scale(domain=["stay inside", "keep out"], range=[[1, 0], [5, 3]])
                .title("Fence"),
            )
        )
    layers.append(
        layer(tables.path, "path")
        .mark_line(color=BLUE, strokeWidth=1.5, clip=True)
        .encode(order="time_min:Q")
    )
    if stretches:
        found = layer(stretches, "stretches")
        layers += [
            found.mark_line(
                color=PURPLE, strokeWidth=6, opacity=0.75, strokeCap="round", clip=True
            ).encode(detail="finding:N", order="order:Q"),
            found.transform_filter("datum.order == 0")
            .mark_text(align="left", dx=8, dy=-10, fontWeight="bold", clip=True)
            .encode(text="code:N"),
        ]
    kinds = [kind for kind in _KINDS if any(row["kind"] == kind for row in marks)]
    shapes = dict(zip(_KINDS, ("circle", "square", "triangle-up"), strict=True))
    colours = dict(zip(_KINDS, (BLUE, GREEN, ORANGE), strict=True))
    crowded = len(marks) > _MOST_NUMBERS
    layers.append(
        layer(marks, "marks")
        .mark_point(filled=True, size=18 if crowded else 45, opacity=1.0, clip=True)
        .encode(
            shape=alt.Shape("kind:N")
            .scale(domain=kinds, range=[shapes[kind] for kind in kinds])
            .title("Place"),
            color=alt.Color("kind:N")
            .scale(domain=kinds, range=[colours[kind] for kind in kinds])
            .title("Place"),
            tooltip=[
                alt.Tooltip("label:N").title("place"),
                alt.Tooltip("latitude_deg:Q").title("latitude [°]"),
                alt.Tooltip("longitude_deg:Q").title("longitude [°]"),
            ],
        )
    )
    if not crowded:
        layers.append(
            layer(_label_rows(marks, view), "labels")
            .mark_text(align="left", dx=6, dy=-6, clip=True)
            .encode(text="label:N")
        )
    layers += _compass_layers(tables.result)
    return alt.layer(*layers).properties(
        width=view.width_px,
        height=view.height_px,
        description="Map of the path flown, with the items, home, the fence and the findings",
    )


def item_rows(case: Case) -> list[Row]:
    """Return the places of the items that are flown, a row each."""
    frame, stages = case.route.frame, {stage.item: stage for stage in case.route.stages}
    latitude_deg, longitude_deg = frame.latitude_longitude_deg(
        np.array([stage.east_m for stage in stages.values()]),
        np.array([stage.north_m for stage in stages.values()]),
    )
    return [
        _place("item", f"item {item}: {stage.kind}", frame, latitude, longitude)
        | {"item": item, "short": str(item)}
        for (item, stage), latitude, longitude in zip(
            stages.items(), latitude_deg.tolist(), longitude_deg.tolist(), strict=True
        )
    ]


def place_rows(case: Case) -> list[Row]:
    """Return home and the rally points, a row each."""
    frame = case.route.frame
    home = _place("home", "home", frame, frame.latitude_deg, frame.longitude_deg)
    rally = [
        _place(
            "rally point", f"rally point {number}", frame, place.latitude_deg, place.longitude_deg
        )
        | {"short": f"R{number}"}
        for number, place in enumerate(case.mission.rally, start=1)
    ]
    return [home | {"short": "H"}, *rally]


def fence_rows(case: Case) -> list[Row]:
    """Return the outlines of the fence's areas, closed, a row per point."""
    fence, frame = case.mission.fence, case.route.frame
    if fence is None:
        return []
    areas: tuple[FencePolygon | FenceCircle, ...] = (*fence.polygons, *fence.circles)
    rows: list[Row] = []
    for number, area in enumerate(areas, start=1):
        east_m, north_m = _outline(area, frame)
        rows += [
            {
                "area": number,
                "kind": "stay inside" if area.inclusion else "keep out",
                "order": order,
                "east_m": round(east, 1),
                "north_m": round(north, 1),
            }
            for order, (east, north) in enumerate(
                zip(east_m.tolist(), north_m.tolist(), strict=True)
            )
        ]
    return rows


def stretch_rows(result: CheckResult) -> list[Row]:
    """Return where over ground findings are, two rows each; ``finding`` counts as in the result."""
    if result.case is None:
        return []
    frame = result.case.route.frame
    return [
        {"finding": number, "code": finding.code, "order": order, **_metres(frame, *end_deg)}
        for number, finding in enumerate(result.findings)
        if finding.severity > Severity.INFO
        for order, end_deg in enumerate(_ends_deg(finding))
    ]


def _ends_deg(finding: Finding) -> tuple[tuple[float, float], ...]:
    stretch = finding.stretch
    return () if stretch is None else (stretch.start_deg, stretch.end_deg)


def _label_rows(marks: list[Row], view: View) -> list[Row]:
    """Return the names beside the marks; those of marks too near to each other share a place."""
    near_m = _NEAR_PX * (view.east_m - view.west_m) / view.width_px
    labels: list[Row] = []
    for mark in marks:
        for row in labels:
            away_m = np.hypot(row["east_m"] - mark["east_m"], row["north_m"] - mark["north_m"])
            if away_m < near_m:
                row["label"] += f", {mark['short']}"
                break
        else:
            labels.append(
                {key: mark[key] for key in ("east_m", "north_m")} | {"label": mark["short"]}
            )
    return labels


def _outline(area: FencePolygon | FenceCircle, frame: LocalFrame) -> tuple[FloatArray, FloatArray]:
    if isinstance(area, FencePolygon):
        corners = np.array([*area.vertices_deg, area.vertices_deg[0]])
        steps = np.linspace(0.0, len(corners) - 1, (len(corners) - 1) * _EDGE_POINTS + 1)
        whole = np.arange(len(corners))
        return frame.east_north_m(
            np.interp(steps, whole, corners[:, 0]), np.interp(steps, whole, corners[:, 1])
        )
    turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_POINTS + 1)
    east_m, north_m = frame.east_north_m(area.latitude_deg, area.longitude_deg)
    return east_m + area.radius_m * np.sin(turn), north_m + area.radius_m * np.cos(turn)


def _metres(frame: LocalFrame, latitude_deg: float, longitude_deg: float) -> Row:
    east_m, north_m = frame.east_north_m(latitude_deg, longitude_deg)
    return {"east_m": round(float(east_m), 1), "north_m": round(float(north_m), 1)}


def _place(
    kind: str, label: str, frame: LocalFrame, latitude_deg: float, longitude_deg: float
) -> Row:
    return {
        "kind": kind,
        "label": label,
        **_metres(frame, latitude_deg, longitude_deg),
        "latitude_deg": round(latitude_deg, 7),
        "longitude_deg": round(longitude_deg, 7),
    }


def map_view(
    tables: FlightTables, marks: list[Row], fence: list[Row], stretches: list[Row]
) -> View:
    """Return what of the ground is shown: the flight, and the fence if it is not far larger."""
    low, high = _bounds([*tables.path, *marks, *stretches])
    least = max(float((high - low).max()), _LEAST_M)
    if fence:
        fence_low, fence_high = _bounds(fence)
        wide_low, wide_high = np.minimum(low, fence_low), np.maximum(high, fence_high)
        if float((wide_high - wide_low).max()) <= _FAR_FENCE * least:
            low, high = wide_low, wide_high
    span = np.maximum(high - low, _LEAST_M)
    span = 1.15 * np.maximum(span, _NARROWEST * span.max())
    scale = min(WIDTH / span[0], HEIGHT / span[1])
    middle = 0.5 * (low + high)
    west, south = (middle - span / 2.0).round(1).tolist()
    east, north = (middle + span / 2.0).round(1).tolist()
    width, height = (round(scale * side) for side in span.tolist())
    return View(west, east, south, north, width, height)


def _bounds(rows: list[Row]) -> tuple[FloatArray, FloatArray]:
    places = np.array([(row["east_m"], row["north_m"]) for row in rows])
    return places.min(axis=0), places.max(axis=0)


def _compass_layers(result: CheckResult) -> list[Chart]:
    """Return what says where north is, and where the wind blows to, in the corners of the map."""
    alt = load_altair()
    one = alt.Chart(alt.InlineData(values=[{}]))
    layers = [
        one.mark_text(align="center", fontSize=13).encode(
            x=alt.value(14), y=alt.value(14), text=alt.value("N ↑")
        )
    ]
    wind = result.conditions.wind
    if wind.speed_m_s > 0.0:
        said = f"wind {numbers.speed(wind.speed_m_s)} from {numbers.bearing(wind.from_deg)}"
        layers += [
            one.mark_point(
                shape="arrow",
                filled=True,
                size=700,
                angle=(wind.from_deg + 180.0) % 360.0,
                opacity=1.0,
            ).encode(x=alt.value(48), y=alt.value(16)),
            one.mark_text(align="left").encode(
                x=alt.value(70), y=alt.value(14), text=alt.value(said)
            ),
        ]
    return layers
