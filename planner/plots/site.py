"""A picture of a mission from above: the path flown, items, home, rally points, fence, wind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.geo.fence import FencePolygon
from planner.plots.tables import flight_rows, flown_case
from planner.plots.theme import BLUE, GREEN, ORANGE, RED

if TYPE_CHECKING:
    import altair

    from planner.geo.local_frame import LocalFrame
    from planner.plots.tables import Row
    from planner.service import CheckResult

SIDE = 480
"""Longer side of the map. [px]"""
_CIRCLE_POINTS = 72
_EDGE_POINTS = 8
"""Fence edges are straight in degrees, thus bent in metres."""


def map_figure(result: CheckResult) -> altair.LayerChart:
    """Return the path flown over ground, north up, a metre as long in both directions.

    Raises
    ------
    UsageError
        If nothing is flown.
    """
    import altair as alt

    path = flight_rows(result)
    fence = fence_rows(result)
    marks = item_rows(result) + place_rows(result)
    everything = [*path, *fence, *marks]
    x, y, size = _equal_axes(everything)

    def layer(rows: list[Row]) -> altair.Chart:
        return alt.Chart(alt.InlineData(values=rows)).encode(x=x, y=y)

    layers = [
        layer(fence)
        .mark_line(strokeWidth=1.5)
        .encode(
            detail="area:N",
            order="order:Q",
            strokeDash=alt.StrokeDash("kind:N")
            .scale(domain=["stay inside", "keep out"])
            .title("Fence"),
            color=alt.value(RED),
            tooltip=["kind:N", "area:N"],
        ),
        layer(path)
        .mark_line(color=BLUE, strokeWidth=1.5)
        .encode(
            order="time_min:Q", tooltip=["time_min:Q", "item:O", "altitude_amsl_m:Q", "state:N"]
        ),
        layer(marks)
        .mark_point(filled=True, size=45, opacity=1.0)
        .encode(
            shape=alt.Shape("kind:N")
            .scale(domain=["item", "home", "rally"], range=["circle", "square", "triangle-up"])
            .title("Place"),
            color=alt.Color("kind:N")
            .scale(domain=["item", "home", "rally"], range=[BLUE, GREEN, ORANGE])
            .title("Place"),
            tooltip=["label:N", "kind:N", "latitude_deg:Q", "longitude_deg:Q"],
        ),
    ]
    return alt.layer(*layers).properties(**size)


def item_rows(result: CheckResult) -> list[Row]:
    """Return the places of the items that are flown, a row each."""
    case = flown_case(result)
    stages = case.route.stages
    latitude_deg, longitude_deg = case.route.frame.latitude_longitude_deg(
        np.array([stage.east_m for stage in stages]), np.array([stage.north_m for stage in stages])
    )
    return [
        _place("item", f"item {stage.item}: {stage.kind}", case.route.frame, lat, lon)
        | {"item": stage.item}
        for stage, lat, lon in zip(
            stages, latitude_deg.tolist(), longitude_deg.tolist(), strict=True
        )
    ]


def place_rows(result: CheckResult) -> list[Row]:
    """Return home and the rally points, a row each."""
    case = flown_case(result)
    frame = case.route.frame
    home = frame.latitude_longitude_deg(np.zeros(1), np.zeros(1))
    rows = [_place("home", "home", frame, float(home[0][0]), float(home[1][0]))]
    rows += [
        _place("rally", f"rally point {number}", frame, point.latitude_deg, point.longitude_deg)
        for number, point in enumerate(case.mission.rally, start=1)
    ]
    return rows


def fence_rows(result: CheckResult) -> list[Row]:
    """Return the outlines of the fence's areas, closed, a row per point."""
    case = flown_case(result)
    fence, frame = case.mission.fence, case.route.frame
    rows: list[Row] = []
    for number, area in enumerate([*fence.polygons, *fence.circles], start=1):
        if isinstance(area, FencePolygon):
            corners = np.array([*area.vertices_deg, area.vertices_deg[0]])
            steps = np.linspace(0.0, len(corners) - 1, (len(corners) - 1) * _EDGE_POINTS + 1)
            whole = np.arange(len(corners))
            east_m, north_m = frame.east_north_m(
                np.interp(steps, whole, corners[:, 0]), np.interp(steps, whole, corners[:, 1])
            )
        else:
            turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_POINTS + 1)
            centre = frame.east_north_m(
                np.array([area.latitude_deg]), np.array([area.longitude_deg])
            )
            east_m = centre[0] + area.radius_m * np.sin(turn)
            north_m = centre[1] + area.radius_m * np.cos(turn)
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


def _place(
    kind: str, label: str, frame: LocalFrame, latitude_deg: float, longitude_deg: float
) -> Row:
    east_m, north_m = frame.east_north_m(np.array([latitude_deg]), np.array([longitude_deg]))
    return {
        "kind": kind,
        "label": label,
        "east_m": round(float(east_m[0]), 1),
        "north_m": round(float(north_m[0]), 1),
        "latitude_deg": round(latitude_deg, 7),
        "longitude_deg": round(longitude_deg, 7),
    }


def _equal_axes(rows: list[Row]) -> tuple[Any, Any, dict[str, int]]:
    """Return axes on which a metre is as long eastwards as northwards, and the size in pixels."""
    import altair as alt

    low = np.array([min(row[axis] for row in rows) for axis in ("east_m", "north_m")])
    high = np.array([max(row[axis] for row in rows) for axis in ("east_m", "north_m")])
    span = np.maximum(high - low, 0.25 * max(float((high - low).max()), 20.0)) * 1.1
    middle = 0.5 * (low + high)
    scale = SIDE / span.max()
    axes = [
        channel(f"{name}:Q")
        .title(title)
        .scale(domain=[float(m - s / 2.0), float(m + s / 2.0)], nice=False)
        for channel, name, title, m, s in zip(
            (alt.X, alt.Y),
            ("east_m", "north_m"),
            ("East of home [m]", "North of home [m]"),
            middle,
            span,
            strict=True,
        )
    ]
    width, height = (int(scale * s) for s in span)
    return axes[0], axes[1], {"width": width, "height": height}
