"""A picture of a mission from above: the path flown, items, home, rally points, fence, wind."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner import quantity
from planner.report.plots.picture_files import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    Chart,
    inline_rows,
    load_altair,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.physics.wind import Wind
    from planner.report.tables import FlightTables, Row


WIDTH, HEIGHT = 720, 540
"""Of every map: of a narrow mission it shows more of the ground beside. [px]"""
_LEAST_M = 20.0
"""Extent of a mission that stays at one place. [m]"""
_FAR_FENCE = 3.0
"""A fence whose extent is more than so many times the mission's is not shown as a whole. [-]"""
_MOST_NUMBERS = 40
"""Items that have their number beside them: more hide each other."""
_NEAR_PX = 12.0
"""Marks nearer to each other have one name together."""
_ROOM = "room to react and stop, position error"
_ROOM_OPACITY = 0.3
_FENCE_DASHES = {"stay inside": [1, 0], "keep out": [5, 3]}
_MOST_NAMES = 3
_CHARACTER_PX = 6.0
"""Width of a character of a name, about."""
_KINDS = {
    "item": ("circle", BLUE),
    "home": ("square", GREEN),
    "rally point": ("triangle-up", ORANGE),
}
"""Shape and colour of each."""


class View(NamedTuple):
    """The part of the ground that a map shows; a metre is as long in both directions."""

    west_m: float
    east_m: float
    south_m: float
    north_m: float


def map_panel(tables: FlightTables) -> Chart:
    """Return the map of tables."""
    alt = load_altair()
    marks = tables.marks
    view = ground_view([*tables.path, *marks, *tables.stretches], tables.fence)
    x, y = ground_axes(view)

    def layer(data: Chart) -> Chart:
        return alt.Chart(data).encode(x=x, y=y)

    layers = []
    if tables.room:
        legend = alt.Legend(
            symbolType="square", symbolStrokeWidth=0, symbolOpacity=_ROOM_OPACITY, labelLimit=400
        )
        fill = alt.Fill("what:N", legend=legend)
        layers.append(
            layer(alt.NamedData("room"))
            .transform_calculate(what=f"'{_ROOM}'")
            .mark_line(
                interpolate="linear-closed", strokeWidth=0, fillOpacity=_ROOM_OPACITY, clip=True
            )
            .encode(
                detail="area:N",
                order="order:Q",
                fill=fill.title("Buffer").scale(domain=[_ROOM], range=[ORANGE]),
            )
        )
    if tables.fence:
        layers.append(fence_layer(layer(alt.NamedData("fence")), tables.fence))
    layers.append(
        layer(alt.NamedData("path"))
        .mark_line(color=BLUE, strokeWidth=1.5, clip=True)
        .encode(order="time_min:Q")
    )
    if tables.stretches:
        found = layer(alt.NamedData("stretches"))
        layers += [
            found.mark_line(
                color=PURPLE, strokeWidth=6, opacity=0.75, strokeCap="round", clip=True
            ).encode(detail=["finding:N", "part:N"], order="order:Q"),
            found.transform_filter("datum.part == 0 && datum.order == 0")
            .mark_text(align="right", baseline="top", dx=-8, dy=6, fontWeight="bold", clip=True)
            .encode(text="code:N"),
        ]
    kinds = [kind for kind in _KINDS if any(row["kind"] == kind for row in marks)]
    shapes, colours = ([_KINDS[kind][index] for kind in kinds] for index in (0, 1))
    crowded = len(marks) > _MOST_NUMBERS
    layers.append(
        layer(alt.NamedData("marks"))
        .mark_point(filled=True, size=18 if crowded else 45, opacity=1.0, clip=True)
        .encode(
            shape=alt.Shape("kind:N").scale(domain=kinds, range=shapes).title("Place"),
            color=alt.Color("kind:N").scale(domain=kinds, range=colours).title("Place"),
            tooltip=[
                alt.Tooltip("label:N").title("place"),
                alt.Tooltip("latitude_deg:Q").title("latitude [°]"),
                alt.Tooltip("longitude_deg:Q").title("longitude [°]"),
            ],
        )
    )
    if not crowded:
        layers.append(
            layer(inline_rows(_label_rows(marks, view)))
            .mark_text(align="left", baseline="bottom", dx=6, dy=-5, clip=True)
            .encode(text="label:N")
        )
    layers += compass_layers(tables.result.setup.wind)
    return alt.layer(*layers).properties(
        width=WIDTH,
        height=HEIGHT,
        description="Map of the path flown, with the items, home, the fence and the findings",
    )


def _label_rows(marks: list[Row], view: View) -> list[Row]:
    """Return the names beside the marks, as far as they do not hide each other.

    Those of marks too near to each other share a place, many of them as the first and the last.
    """
    metres_per_px = (view.east_m - view.west_m) / WIDTH
    together: list[list[Row]] = []
    for mark in marks:
        for group in together:
            east_m, north_m = (group[0][key] - mark[key] for key in ("east_m", "north_m"))
            if np.hypot(east_m, north_m) < _NEAR_PX * metres_per_px:
                group.append(mark)
                break
        else:
            together.append([mark])
    labels: list[Row] = []
    for group in together:
        names = [mark["short"] for mark in group]
        first = group[0]
        label = ", ".join(names) if len(names) <= _MOST_NAMES else f"{names[0]} … {names[-1]}"
        row = {"east_m": first["east_m"], "north_m": first["north_m"], "label": label}
        if not any(_hide_each_other(row, other, metres_per_px) for other in labels):
            labels.append(row)
    return labels


def _hide_each_other(one: Row, other: Row, metres_per_px: float) -> bool:
    left, right = sorted((one, other), key=lambda row: row["east_m"])
    return bool(
        right["east_m"] - left["east_m"]
        < (_CHARACTER_PX * len(left["label"]) + _NEAR_PX) * metres_per_px
        and abs(one["north_m"] - other["north_m"]) < _NEAR_PX * metres_per_px
    )


def ground_axes(view: View, *, origin: str = "home") -> tuple[Chart, Chart]:
    """Return the axes of a map that shows so much, in metres from a place."""
    alt = load_altair()
    x = alt.X("east_m:Q").title(f"East of {origin} [m]").axis(tickCount=8)
    y = alt.Y("north_m:Q").title(f"North of {origin} [m]").axis(tickCount=8)
    return (
        x.scale(domain=[view.west_m, view.east_m], nice=False, zero=False),
        y.scale(domain=[view.south_m, view.north_m], nice=False, zero=False),
    )


def fence_layer(chart: Chart, fence: list[Row]) -> Chart:
    """Return the outlines of a fence on a chart of its rows; dashes say which side to keep."""
    kinds = [kind for kind in _FENCE_DASHES if any(row["kind"] == kind for row in fence)]
    dashes = load_altair().StrokeDash("kind:N").title("Fence")
    dashes = dashes.scale(domain=kinds, range=[_FENCE_DASHES[kind] for kind in kinds])
    lines = chart.mark_line(strokeWidth=1.8, clip=True, color=RED)
    return lines.encode(detail="area:N", order="order:Q", strokeDash=dashes)


def ground_view(places: list[Row], fence: Sequence[Row] = ()) -> View:
    """Return what of the ground is shown: all places, and the fence if it is not far larger."""
    low, high = _bounds(places)
    least = max(float((high - low).max()), _LEAST_M)
    if fence:
        fence_low, fence_high = _bounds(fence)
        wide_low, wide_high = np.minimum(low, fence_low), np.maximum(high, fence_high)
        if float((wide_high - wide_low).max()) <= _FAR_FENCE * least:
            low, high = wide_low, wide_high
    span = 1.15 * np.maximum(high - low, _LEAST_M)
    metres_per_px = float(max(span[0] / WIDTH, span[1] / HEIGHT))
    middle = 0.5 * (low + high)
    half = 0.5 * metres_per_px * np.array([WIDTH, HEIGHT])
    west, south = (middle - half).round(2).tolist()
    east, north = (middle + half).round(2).tolist()
    return View(west, east, south, north)


def _bounds(rows: Sequence[Row]) -> tuple[FloatArray, FloatArray]:
    places = np.array([(row["east_m"], row["north_m"]) for row in rows])
    return places.min(axis=0), places.max(axis=0)


def compass_layers(wind: Wind) -> list[Chart]:
    """Return what says where north is, and where the wind blows to, in the corners of the map."""
    alt = load_altair()
    one = alt.Chart(inline_rows([{}]))
    layers = [
        one.mark_text(align="center", fontSize=13).encode(
            x=alt.value(14), y=alt.value(14), text=alt.value("N ↑")
        )
    ]
    if wind.speed_m_s > 0.0:
        text = f"wind {quantity.speed(wind.speed_m_s)} from {quantity.bearing(wind.from_deg)}"
        layers += [
            one.mark_point(
                shape="arrow",
                filled=True,
                size=700,
                angle=(wind.from_deg + 180.0) % 360.0,
                opacity=1.0,
            ).encode(x=alt.value(48), y=alt.value(16)),
            one.mark_text(align="left").encode(
                x=alt.value(70), y=alt.value(14), text=alt.value(text)
            ),
        ]
    return layers
