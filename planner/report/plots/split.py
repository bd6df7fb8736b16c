"""Pictures of a mission split into flights: who flies what, and what each takes of its battery."""

from __future__ import annotations

from itertools import cycle, pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.flight.prediction import sample_trace
from planner.report.plots.picture_files import (
    COLOURS,
    GREEN,
    GREY,
    ON_COLOURS,
    RED,
    SKY,
    Chart,
    inline_rows,
    load_altair,
)
from planner.report.plots.site import HEIGHT, WIDTH, fence_layer, ground_axes, ground_view
from planner.report.tables import fence_rows, path_rows, place_rows

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.report.plots.site import View
    from planner.report.tables import Row
    from planner.service.split import Split


_BAR_PX = 24
_LABEL_PLACES = 41
"""Looked at for the number of a part, evenly along its way."""
_OWN = 1
"""Of the stretches of a part: the way there, its own legs, the return."""


def split_map_figure(split: Split) -> Chart:
    """Return the parts of a mission over ground, north up, each with its number and its colour.

    The legs of the mission are wide, the ways there and home thin.
    """
    alt = load_altair()
    assessment = split.parts[0].result.assessment
    assert assessment is not None  # a part that is a go is flown
    legs = [row for number in range(len(split.parts)) for row in _leg_rows(split, number)]
    marks = place_rows(assessment)
    view = ground_view([*legs, *marks])
    fence = _seen(fence_rows(assessment), view)
    x, y = ground_axes(view)

    def layer(rows: list[Row]) -> Chart:
        return alt.Chart(inline_rows(rows)).encode(x=x, y=y)

    layers = []
    if fence:
        layers.append(fence_layer(layer(fence), fence))
    layers.append(
        layer([row for row in legs if not row["is_own"]])
        .mark_line(strokeWidth=1.0, clip=True, color=GREY, strokeDash=[3, 3])
        .encode(detail=alt.Detail("stretch:N"), order=alt.Order("time_min:Q"))
    )
    own = [row for row in legs if row["is_own"]]
    names = [str(number) for number in range(1, len(split.parts) + 1)]
    colours = [colour for _, colour in zip(names, cycle(COLOURS), strict=False)]
    colour = alt.Color("part:N").legend(None).scale(domain=names, range=colours)
    labels = _label_rows(own)
    layers += [
        layer(own)
        .mark_line(strokeWidth=2.6, clip=True, strokeJoin="round")
        .encode(detail=alt.Detail("stretch:N"), order=alt.Order("time_min:Q"), color=colour),
        layer(labels)
        .mark_point(shape="circle", filled=True, size=330, opacity=1.0, clip=True)
        .encode(color=colour),
        layer(labels)
        .mark_text(fontWeight="bold", clip=True, color=ON_COLOURS)
        .encode(text=alt.Text("part:N")),
        layer(marks).mark_point(filled=True, size=60, shape="square", opacity=1.0, color=GREEN),
        # Left of the place, clear of the number of a part that begins there.
        layer(marks).mark_text(align="right", dx=-13, clip=True).encode(text=alt.Text("short:N")),
    ]
    return alt.layer(*layers).properties(
        width=WIDTH,
        height=HEIGHT,
        description=f"Map of the {quantity.count(len(names), 'part')} of the mission, each numbered "
        "where it takes up its legs, with the ways there and home",
    )


def split_energy_figure(split: Split) -> Chart:
    """Return what each part takes of its battery, and where the reserve begins."""
    alt = load_altair()
    rows = []
    for number, part in enumerate(split.parts, start=1):
        totals, battery = part.result.totals, part.result.battery
        row: Row = {"part": number, "energy_wh": round(totals.energy_wh, 3)}
        row["label"] = quantity.energy(totals.energy_wh)
        if totals.energy_wh_p10 is not None and totals.energy_wh_p90 is not None:
            row |= {
                "p10_wh": round(totals.energy_wh_p10, 3),
                "p90_wh": round(totals.energy_wh_p90, 3),
            }
        if battery is not None:
            row["limit_wh"] = round(battery.usable_wh - battery.reserve_wh, 3)
        rows.append(row)
    y = alt.Y("part:O").title("Part")
    marked = "; mark: the reserve begins" if any("limit_wh" in row for row in rows) else ""
    x = alt.X("energy_wh:Q").title(f"Energy [Wh]{marked}").scale(zero=True)
    bars = alt.Chart(inline_rows(rows)).encode(y=y)
    layers = [
        bars.mark_bar(color=SKY, height={"band": 0.7}).encode(x=x),
        bars.mark_text(align="left", baseline="middle", dx=5, color=ON_COLOURS).encode(
            x=alt.XValue(0), text=alt.Text("label:N")
        ),
    ]
    if any("p10_wh" in row for row in rows):
        layers.append(
            bars.mark_rule(strokeWidth=2).encode(x=alt.X("p10_wh:Q"), x2=alt.X2("p90_wh:Q"))
        )
    if marked:
        layers.append(
            bars.mark_tick(thickness=3, color=RED, height={"band": 1.0}, opacity=1.0).encode(
                x=alt.X("limit_wh:Q")
            )
        )
    return alt.layer(*layers).properties(
        width=WIDTH,
        height=_BAR_PX * len(rows),
        description="Energy of each part, a mark where its battery's reserve begins",
    )


def _seen(fence: list[Row], view: View) -> list[Row]:
    """Return the outlines of the areas of a fence that cross what is shown of the ground."""
    import shapely

    window = shapely.box(view.west_m, view.south_m, view.east_m, view.north_m)
    outlines: dict[int, list[tuple[float, float]]] = {}
    for row in fence:
        outlines.setdefault(row["area"], []).append((row["east_m"], row["north_m"]))
    seen = {area for area, line in outlines.items() if window.intersects(shapely.LineString(line))}
    return [row for row in fence if row["area"] in seen]


def _leg_rows(split: Split, number: int) -> list[Row]:
    """Return the way of a part over ground; its own legs and the ways there and home apart."""
    part = split.parts[number]
    assessment = part.result.assessment
    assert assessment is not None  # a part that is a go is flown
    trace = sample_trace(assessment.flight, assessment.route)
    first = np.searchsorted(trace.item, part.first_own_item)
    after = np.searchsorted(trace.item, part.last_own_item, side="right")
    ends = [0, int(first), int(after), len(trace.item) - 1]
    return [
        {"part": str(number + 1), "stretch": 3 * number + stage, "is_own": stage == _OWN}
        | {key: row[key] for key in ("time_min", "east_m", "north_m")}
        for stage, (start, end) in enumerate(pairwise(ends))
        for row in path_rows(assessment, trace, slice(start, end + 1))
    ]


def _label_rows(own: list[Row]) -> list[Row]:
    """Return the places of the numbers: on each part's own way, apart from other parts and numbers."""
    ways = {
        name: np.array([(row["east_m"], row["north_m"]) for row in own if row["part"] == name])
        for name in dict.fromkeys(row["part"] for row in own)
    }
    placed: dict[str, FloatArray] = {}
    for name, way in ways.items():
        along_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
        looked_at_m = np.linspace(0.0, along_m[-1], _LABEL_PLACES)
        places = np.column_stack([np.interp(looked_at_m, along_m, column) for column in way.T])
        others = [*(way for other, way in ways.items() if other != name), *placed.values()]
        if others:
            apart = places[:, None] - np.concatenate(others)
            chosen = int(np.hypot(apart[..., 0], apart[..., 1]).min(axis=1).argmax())
        else:
            chosen = _LABEL_PLACES // 2
        placed[name] = places[[chosen]]
    return [
        {"part": name, "east_m": round(float(east_m), 1), "north_m": round(float(north_m), 1)}
        for name, [[east_m, north_m]] in placed.items()
    ]
