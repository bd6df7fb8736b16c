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
    SKY,
    Chart,
    inline_rows,
    load_altair,
)
from planner.report.tables import EMPTY, LEVELS, NO_RETURN, TIGHTEST

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.arrays import FloatArray
    from planner.physics.wind import Wind
    from planner.report.tables import FlightTables, Row


WIDTH, HEIGHT = 720, 540
"""Of every map: of a narrow mission it shows more of the ground beside. [px]"""
_NARROW_PX, _NARROW = 520, 0.45
"""A map less wide is that of a telephone, whose texts are placed as at such a share of `WIDTH`. [px, -]"""
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
_MOST_DETAILS = 24
"""Places that have times, energies and heights beside them."""
_ARROW_HEAD = "M0,-1.2L0.9,1L0,0.5L-0.9,1Z"
_OCTAGON = "M-0.41,-1L0.41,-1L1,-0.41L1,0.41L0.41,1L-0.41,1L-1,0.41L-1,-0.41Z"
_KINDS = {
    "item": ("circle", BLUE),
    "home": ("square", GREEN),
    "rally point": ("triangle-up", ORANGE),
    TIGHTEST[0]: ("diamond", PURPLE),
    NO_RETURN[0]: (_OCTAGON, RED),
    EMPTY[0]: ("cross", RED),
}
"""Shape and colour of each."""
_LEVELS = dict(
    zip(LEVELS, ((PURPLE, 10.0), (RED, 7.5), (ORANGE, 5.5), (SKY, 3.5), (BLUE, 2.0)), strict=True)
)
"""Colour and width of the path where a return lands with so much.

What is worse is wider and lies below, so that on the way there and back both are seen.
"""


class View(NamedTuple):
    """The part of the ground that a map shows; a metre is as long in both directions."""

    west_m: float
    east_m: float
    south_m: float
    north_m: float


def map_panel(tables: FlightTables) -> Chart:
    """Return the map of tables."""
    alt = load_altair()
    view = ground_view([*tables.path, *tables.marks, *tables.stretches], tables.fence)
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
                detail=alt.Detail("area:N"),
                order=alt.Order("order:Q"),
                fill=fill.title("Buffer").scale(domain=[_ROOM], range=[ORANGE]),
            )
        )
    if tables.fence:
        layers.append(fence_layer(layer(alt.NamedData("fence")), tables.fence))
    layers += _path_layers(layer, tables)
    if tables.stretches:
        layers.append(
            layer(alt.NamedData("stretches"))
            .mark_line(color=PURPLE, strokeWidth=6, opacity=0.75, strokeCap="round", clip=True)
            .encode(
                detail=[alt.Detail("finding:N"), alt.Detail("part:N")], order=alt.Order("order:Q")
            )
        )
    marks = [*tables.marks, *tables.points]
    kinds = [kind for kind in _KINDS if any(row["kind"] == kind for row in marks)]
    shapes, colours = ([_KINDS[kind][index] for kind in kinds] for index in (0, 1))
    crowded = len(tables.marks) > _MOST_NUMBERS
    layers += [
        layer(alt.NamedData(name))
        .mark_point(filled=True, size=size, opacity=1.0, clip=True)
        .encode(
            shape=alt.Shape("kind:N").scale(domain=kinds, range=shapes).title("Place"),
            color=alt.Color("kind:N").scale(domain=kinds, range=colours).title("Place"),
            tooltip=[
                alt.Tooltip("label:N").title("place"),
                alt.Tooltip("latitude_deg:Q").title("latitude [°]"),
                alt.Tooltip("longitude_deg:Q").title("longitude [°]"),
            ],
        )
        for name, size, rows in (
            ("marks", 18 if crowded else 45, tables.marks),
            ("points", 130, tables.points),
        )
        if rows
    ]
    for share, is_shown in ((1.0, f"width >= {_NARROW_PX}"), (_NARROW, f"width < {_NARROW_PX}")):
        layers += _text_layers(layer, tables, view, share, is_shown)
    layers += compass_layers(tables.result.setup.wind)
    return alt.layer(*layers).properties(
        width=WIDTH,
        height=HEIGHT,
        description="Map of the path flown, with the items, home, the fence and the findings",
    )


def _path_layers(layer: Callable[[Chart], Chart], tables: FlightTables) -> list[Chart]:
    """Return the path, by what is left in the battery on a return from there, and its direction."""
    alt = load_altair()
    path = layer(alt.NamedData("path")).encode(order=alt.Order("time_min:Q"))
    levels = [one for one in LEVELS if any(row.get("level") == one for row in tables.path)]
    stroke = alt.Stroke("level:N").title("Return lands with")
    stroke = stroke.scale(domain=levels, range=[_LEVELS[one][0] for one in levels])
    layers = [
        path.transform_filter(f"datum.level === '{one}'")
        .mark_line(clip=True, strokeWidth=_LEVELS[one][1])
        .encode(detail=alt.Detail("run:N"), stroke=stroke)
        for one in levels
    ] or [path.mark_line(color=BLUE, strokeWidth=1.8, clip=True)]
    if tables.arrows:
        arrows = layer(alt.NamedData("arrows")).mark_point(
            shape=_ARROW_HEAD, filled=True, size=45, opacity=1.0, clip=True
        )
        layers.append(arrows.encode(angle=alt.Angle("bearing_deg:Q").scale(None).legend(None)))
    return layers


def _text_layers(
    layer: Callable[[Chart], Chart], tables: FlightTables, view: View, share: float, is_shown: str
) -> list[Chart]:
    """Return the texts of a map that is drawn at a share of `WIDTH`, seen where an expression holds."""
    alt = load_altair()
    labels = _Labels(view, tables.path, share)
    spots = [row for row in tables.stretches if row["part"] == row["order"] == 0]
    texts: list[tuple[list[Row], dict[str, object]]] = [
        (labels.placed(tables.points, "short", _POINT_NAME), {}),
        (labels.placed(spots, "code", _POINT_NAME), {"fontWeight": "bold"}),
    ]
    if len(tables.marks) <= _MOST_NUMBERS:
        texts.append((labels.placed(_together(tables.marks, labels), "short", _NAME), {}))
    if len(tables.marks) <= _MOST_DETAILS and share == 1.0:
        texts.append((labels.placed(tables.marks, "detail", _DETAIL), {"fontSize": _DETAIL_PX}))
    return [
        layer(inline_rows([row for row in rows if (row["side"], row["dy"]) == (side, dy)]))
        .mark_text(
            align="left" if side > 0 else "right",
            baseline="middle",
            dx=_NAME_DX_PX * side,
            dy=dy,
            clip=True,
            **style,
        )
        .encode(
            text=alt.Text("text:N"), opacity=alt.OpacityValue(alt.ExprRef(f"{is_shown} ? 1 : 0"))
        )
        for rows, style in texts
        for side, dy in sorted({(row["side"], row["dy"]) for row in rows})
    ]


def _together(marks: list[Row], labels: _Labels) -> list[Row]:
    """Return marks with one name for those too near to each other: the first and last of many."""
    near_m = _NEAR_PX / labels.px_per_m
    together: list[list[Row]] = []
    for mark in marks:
        for group in together:
            east_m, north_m = (group[0][key] - mark[key] for key in ("east_m", "north_m"))
            if np.hypot(east_m, north_m) < near_m:
                group.append(mark)
                break
        else:
            together.append([mark])
    named: list[Row] = []
    for group in together:
        names = ", ".join(mark["short"] for mark in group).split(", ")
        short = ", ".join(names) if len(names) <= _MOST_NAMES else f"{names[0]} … {names[-1]}"
        named.append(group[0] | {"short": short})
    return named


class _Style(NamedTuple):
    """Where texts of a kind may stand beside their mark, and how large they are."""

    character_px: float
    offsets_px: tuple[tuple[int, int], ...]
    """Side of the mark, right or left, and how far below it; the first free one is taken. [px]"""
    may_cross_path: bool
    """Whether it stands on the path where no place beside that is free."""


_NAME = _Style(6.0, ((1, -7), (-1, -7), (1, -10), (-1, -10)), may_cross_path=True)
_POINT_NAME = _Style(6.0, ((-1, 12), (1, 12), (-1, -10), (1, -10)), may_cross_path=True)
_DETAIL = _Style(5.2, ((1, 6), (-1, 6), (1, 10), (-1, 10), (1, -24), (1, 24)), may_cross_path=False)
"""Also in the table of the items, so that it is left out where it hides the path."""
_DETAIL_PX = 10
_NAME_DX_PX = 6
_TEXT_GAP_PX, _PATH_GAP_PX = 1.0, 3.0
_PATH_STEP_PX = 4.0


class _Labels:
    """Texts on a map: beside the path where there is room, and never one on another."""

    def __init__(self, view: View, path: Sequence[Row], share: float) -> None:
        self._width_px, self._height_px = share * WIDTH, share * HEIGHT
        self.px_per_m = self._width_px / (view.east_m - view.west_m)
        self._view = view
        self._taken: list[tuple[float, float, float, float]] = []
        corners = np.array([self._pixel(row) for row in path]).reshape(-1, 2)
        along = np.concatenate(([0.0], np.hypot(*np.diff(corners, axis=0).T).cumsum()))
        at = np.arange(0.0, along[-1] + _PATH_STEP_PX, _PATH_STEP_PX)
        self._path = np.stack([np.interp(at, along, column) for column in corners.T])

    def _pixel(self, place: Row) -> tuple[float, float]:
        return (
            (place["east_m"] - self._view.west_m) * self.px_per_m,
            (self._view.north_m - place["north_m"]) * self.px_per_m,
        )

    def placed(self, marks: Sequence[Row], key: str, style: _Style) -> list[Row]:
        """Return the texts of marks for which there is room, each with its place and its side."""
        rows: list[Row] = []
        for mark in marks:
            if not (text := mark.get(key, "")):
                continue
            x, y = self._pixel(mark)
            boxes = {}
            for side, dy in style.offsets_px:
                ends = [
                    x + side * away_px
                    for away_px in (_NAME_DX_PX, _NAME_DX_PX + style.character_px * len(text))
                ]
                box = (min(ends), max(ends), y + dy - 6.0, y + dy + 6.0)
                if self._is_free(box):
                    boxes[side, dy] = box
            beside = [place for place, box in boxes.items() if not self._crosses_path(box)]
            if taken := beside or (list(boxes) if style.may_cross_path else []):
                self._taken.append(boxes[taken[0]])
                side, dy = taken[0]
                place = {axis: mark[axis] for axis in ("east_m", "north_m")}
                rows.append(place | {"text": text, "side": side, "dy": dy})
        return rows

    def _is_free(self, box: tuple[float, float, float, float]) -> bool:
        left, right, top, bottom = box
        gap = _TEXT_GAP_PX
        return (
            left >= 0.0
            and right <= self._width_px
            and top >= 0.0
            and bottom <= self._height_px
            and not any(
                left < other[1]
                and right > other[0]
                and top < other[3] + gap
                and bottom > other[2] - gap
                for other in self._taken
            )
        )

    def _crosses_path(self, box: tuple[float, float, float, float]) -> bool:
        left, right, top, bottom = box
        x, y = self._path
        return bool(
            np.any(
                (x > left - _PATH_GAP_PX)
                & (x < right + _PATH_GAP_PX)
                & (y > top - _PATH_GAP_PX)
                & (y < bottom + _PATH_GAP_PX)
            )
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
    alt = load_altair()
    kinds = [kind for kind in _FENCE_DASHES if any(row["kind"] == kind for row in fence)]
    dashes = alt.StrokeDash("kind:N").title("Fence")
    dashes = dashes.scale(domain=kinds, range=[_FENCE_DASHES[kind] for kind in kinds])
    lines = chart.mark_line(strokeWidth=1.8, clip=True, color=RED)
    return lines.encode(detail=alt.Detail("area:N"), order=alt.Order("order:Q"), strokeDash=dashes)


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
    """Return the scale, where north is and where the wind blows to, in the corners of the map."""
    alt = load_altair()
    one = alt.Chart(inline_rows([{}]))
    layers = [
        *_scale_bar(one),
        one.mark_text(align="center", fontSize=13).encode(
            x=alt.XValue(14), y=alt.YValue(14), text=alt.TextValue("N ↑")
        ),
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
            ).encode(x=alt.XValue(48), y=alt.YValue(16)),
            one.mark_text(align="left").encode(
                x=alt.XValue(70), y=alt.YValue(14), text=alt.TextValue(text)
            ),
        ]
    return layers


_BAR_PX = 90
"""Longest a scale bar gets. [px]"""
_PX_PER_M = "abs(width / (domain('x')[1] - domain('x')[0]))"
_POWER = f"pow(10, floor(log({_BAR_PX} / {_PX_PER_M}) / LN10 + 1e-9))"
_BAR_M = (
    f"{_POWER} * ({_BAR_PX} / {_PX_PER_M} / {_POWER} >= 5 ? 5 : "
    f"{_BAR_PX} / {_PX_PER_M} / {_POWER} >= 2 ? 2 : 1)"
)
"""Its length, 1, 2 or 5 times a power of ten: it follows the zoom. [m]"""


def _scale_bar(one: Chart) -> list[Chart]:
    """Return a scale bar in the lower left corner."""
    alt = load_altair()
    px = alt.ExprRef
    end = f"12 + ({_BAR_M}) * {_PX_PER_M}"
    ticks = [
        one.mark_rule(strokeWidth=1.5).encode(
            x=alt.XValue(px(at)), y=alt.YValue(px("height - 16")), y2=alt.Y2Value(px("height - 8"))
        )
        for at in ("12", end)
    ]
    name = f"({_BAR_M}) >= 1000 ? ({_BAR_M}) / 1000 + ' km' : ({_BAR_M}) + ' m'"
    return [
        one.mark_rule(strokeWidth=1.5).encode(
            x=alt.XValue(12), x2=alt.X2Value(px(end)), y=alt.YValue(px("height - 12"))
        ),
        *ticks,
        one.mark_text(align="center", baseline="bottom").encode(
            x=alt.XValue(px(f"12 + 0.5 * ({_BAR_M}) * {_PX_PER_M}")),
            y=alt.YValue(px("height - 16")),
            text=alt.TextValue(px(name)),
        ),
    ]
