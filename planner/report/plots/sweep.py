"""Pictures of a sweep: where over two axes it is a GO, and what moves the margin."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.report.plots.picture_files import GREEN, RED, SKY, Chart, inline_rows, load_altair
from planner.report.sweep import name_of, unit_of, value_text
from planner.service.sweep.tally import HOUR, MONTH

if TYPE_CHECKING:
    from planner.service.sweep.tally import AxisScale, Tally

_WIDTH, _CELL_PX, _BAR_PX = 640, 26, 26
_MOST_MAPS = 3
_MIDDLE = "#F3ECD8"
"""Of the shares from red to green; ink is read on all of them."""
_INK = "#000000"


def sweep_figures(tally: Tally) -> dict[str, Chart]:
    """Return the pictures of a sweep by name: maps over the axes that matter most, and the tornado."""
    pairs = _pairs(tally)
    figures = {f"map-{i}": map_figure(tally, *pair) for i, pair in enumerate(pairs, start=1)}
    if tally.swings():
        figures["tornado"] = tornado_figure(tally)
    return figures


def _pairs(tally: Tally) -> list[tuple[str, str]]:
    """Return the axes of the maps, across and up: months first, then what moves the margin most."""
    several = [scale.key for scale in tally.scales if len(scale.labels) > 1]
    order = [one.key for one in tally.swings() if one.key in several]
    order += [key for key in several if key not in order]
    listed = [
        axis.key for block in tally.cases.blocks if block.times is None for axis in block.axes
    ]
    if MONTH in order:
        others = [key for key in order if key in listed] + [
            key for key in (HOUR,) if key in several
        ]
        return [(MONTH, other) for other in others[:_MOST_MAPS]]
    if {"wind_m_s", "wind_from_deg"} <= set(several):
        order = ["wind_from_deg", "wind_m_s", *(k for k in order if not k.startswith("wind_"))]
    return list(combinations(order, 2))[:_MOST_MAPS]


def axis_title(key: str) -> str:
    """Return what varies with its unit, as the title of an axis."""
    name, unit = name_of(key), unit_of(key)
    title = f"{name} [{unit}]" if unit else name
    return title[:1].upper() + title[1:]


def map_title(across: str, up: str) -> str:
    """Return what a map shows."""
    return f"Share of GO over {name_of(across)} and {name_of(up)} [%]"


def map_figure(tally: Tally, across: str, up: str) -> Chart:
    """Return the share of GO over two axes, each cell with its figure."""
    alt = load_altair()
    share = tally.share_map(across, up)
    columns, rows = _scale(tally, across).labels, _scale(tally, up).labels
    cells = [
        {
            "x": x,
            "y": y,
            "share": float(share[j, i]),
            "text": quantity.percent(float(share[j, i])).removesuffix(" %"),
        }
        for j, y in enumerate(rows)
        for i, x in enumerate(columns)
        if np.isfinite(share[j, i])
    ]
    colour = (
        alt.Color("share:Q")
        .title("Share of GO")
        .scale(domain=[0.0, 0.5, 1.0], range=[RED, _MIDDLE, GREEN])
        .legend(format="%")
    )
    base = alt.Chart(inline_rows(cells)).encode(
        x=alt.X("x:N")
        .title(axis_title(across))
        .sort(list(columns))
        .axis(labelAngle=0, labelOverlap=True),
        y=alt.Y("y:N").title(axis_title(up)).sort(list(reversed(rows))),
    )
    is_wide = len(columns) <= 14
    layers = [base.mark_rect().encode(color=colour)]
    if is_wide:  # else the figures would not fit into their cells
        layers.append(base.mark_text(color=_INK, fontSize=11).encode(text=alt.Text("text:N")))
    return alt.layer(*layers).properties(
        width=_WIDTH, height=_CELL_PX * len(rows), description=map_title(across, up)
    )


def tornado_figure(tally: Tally) -> Chart:
    """Return the mean margin at the worst and the best value of each axis, the widest first."""
    alt = load_altair()
    swings = tally.swings()
    rows = [
        {
            "name": name_of(one.key),
            "worst_wh": one.worst_wh,
            "best_wh": one.best_wh,
            "worst": value_text(one.key, one.worst),
            "best": value_text(one.key, one.best),
        }
        for one in swings
    ]
    base = alt.Chart(inline_rows(rows)).encode(
        y=alt.Y("name:N").title(None).sort([row["name"] for row in rows])
    )
    title = "Mean margin above the reserve [Wh]"
    x = alt.X("worst_wh:Q").title(title).scale(zero=False, padding=90)
    layers = [
        base.mark_bar(color=SKY, height=0.6 * _BAR_PX).encode(x=x, x2=alt.X2("best_wh:Q")),
        base.mark_text(align="right", dx=-4).encode(
            x=alt.X("worst_wh:Q"), text=alt.Text("worst:N")
        ),
        base.mark_text(align="left", dx=4).encode(x=alt.X("best_wh:Q"), text=alt.Text("best:N")),
    ]
    return alt.layer(*layers).properties(
        width=_WIDTH,
        height=_BAR_PX * len(rows),
        description="Mean margin at the worst and the best value of each axis",
    )


def _scale(tally: Tally, key: str) -> AxisScale:
    return next(scale for scale in tally.scales if scale.key == key)
