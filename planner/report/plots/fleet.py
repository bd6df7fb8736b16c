"""Pictures of a fleet over time: who has what, where all are, what it takes, how far all keep apart."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.report.plots.flight import HEIGHT
from planner.report.plots.picture_files import (
    COLOURS,
    GREEN,
    GREY,
    ON_COLOURS,
    ORANGE,
    RED,
    SKY,
    YELLOW,
    Chart,
    load_altair,
)
from planner.report.plots.site import HEIGHT as MAP_HEIGHT
from planner.report.plots.site import WIDTH, compass_layers, fence_layer, ground_axes, ground_view
from planner.report.tables import fleet_outlines, outline_rows
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from planner.fleet.fleet import Fleet
    from planner.physics.wind import Wind
    from planner.report.tables import Row
    from planner.service.fleet import FleetResult
    from planner.service.fleet_plan import FleetPlan
    from planner.service.fleet_timeline import FleetTimeline, Track

USES = {
    "flight": ("in flight", SKY),
    "swap": ("pack change", YELLOW),
    "charge": ("charging", GREEN),
    "stand": ("on the pad", GREY),
    "yield": ("gives way", ORANGE),
}
"""What is done in a span: its words and its colour."""
_ROW_PX = 22
_CHARACTER_PX = 6.2
_MOST_CODES = 12
"""Marks of findings that have their code beside them: more hide each other."""
_MOST_NAMES = 24
"""Vehicles in a legend, which has three colours for each of eight: more cannot be told apart."""
_HIGHEST = 4.0
"""A picture of distances goes up to so many times what is required: what is farther is in no danger. [-]"""
_ROOM = 1.5
ORIGIN = "the first home"
NOW = "now_min"
"""Name of the time that a map shows, where it shows what has been seen by then."""


class FleetTables(Value, eq=False):
    """A fleet over time, as rows of its pictures."""

    timeline: FleetTimeline
    rows: list[str]
    """What the timeline is of, from the top."""
    tables: Mapping[str, list[Row]]
    winds: frozenset[Wind]
    """That sorties fly in."""
    has_energy: bool
    """Whether the energy of a sortie is known."""
    is_energy_whole: bool
    """Whether that of all is."""

    @property
    def end_min(self) -> float:
        """End of the time axis. [min]"""
        return minutes(self.timeline.end_s)


def make_fleet_tables(result: FleetResult, timeline: FleetTimeline) -> FleetTables:
    """Return the rows of the pictures of a fleet, of which something is flown."""
    assert timeline.frame is not None  # something is flown
    return FleetTables(
        timeline=timeline,
        rows=row_names(timeline),
        tables=timeline_tables(timeline, result.fleet)
        | {"fence": outline_rows(fleet_outlines(result, timeline.frame))},
        winds=frozenset(
            one.assessment.setup.wind for one in result.sorties if one.assessment is not None
        ),
        has_energy=result.totals.energy_wh is not None,
        is_energy_whole=result.totals.is_energy_whole,
    )


def row_names(timeline: FleetTimeline) -> list[str]:
    """Return what each row of a timeline is of."""
    return [f"{one.kind} {one.name}" for one in timeline.rows]


def timeline_tables(
    timeline: FleetTimeline, fleet: Fleet, events: Mapping[int, str] | None = None
) -> dict[str, list[Row]]:
    """Return the rows of the pictures of a timeline; ``events`` are words for what stands for items."""
    rows = row_names(timeline)
    assert timeline.frame is not None  # something is flown
    pads = [
        {"name": one.name}
        | _place(*map(float, timeline.frame.east_north_m(one.latitude_deg, one.longitude_deg)))
        for one in fleet.pads.values()
    ]
    homes = {
        one.vehicle: {"name": f"home of {one.vehicle}", **_place(*one.place_m[0, :2])}
        for one in timeline.tracks
        if not pads
    }
    return {
        "spans": [
            {
                "row": row,
                "use": USES[span.use][0],
                "name": span.name,
                "start_min": minutes(span.start_s),
                "end_min": minutes(span.end_s),
            }
            for row, one in zip(rows, timeline.rows, strict=True)
            for span in one.spans
        ],
        "marks": [
            {"row": rows[at], "code": mark.finding.code, "time_min": minutes(mark.at_s)}
            for mark in timeline.marks
            for at in mark.rows
        ],
        "tracks": [row for one in timeline.tracks for row in _track_rows(one)],
        "items": [
            {
                "sortie": one.sortie,
                "time_s": round(time_s, 1),
                "item": item if events is None else events[item],
            }
            for one in timeline.tracks
            for time_s, item in zip(one.item_s.tolist(), one.item.tolist(), strict=True)
        ],
        "pads": [*pads, *homes.values()],
        "conflicts": [
            {
                "code": mark.finding.code,
                "what": f"{mark.finding.code} {', '.join(mark.sorties)} "
                f"at {quantity.clock(mark.at_s)}",
                **_place(*mark.place_m),
            }
            for mark in timeline.marks
            if mark.place_m is not None
        ],
        "group": [
            {"time_min": minutes(time_s), "power_w": round(power_w, 1), "used_wh": round(wh, 2)}
            for time_s, power_w, wh in zip(
                timeline.edge_s.tolist(),
                [*timeline.power_w.tolist(), 0.0],
                timeline.used_wh.tolist(),
                strict=True,
            )
        ],
        "pairs": [
            {
                "pair": _pair_name(pair.first, pair.second),
                "part": part,
                "time_min": minutes(time_s),
                "may_m": round(may_m, 1),
                "planned_m": round(planned_m, 1),
            }
            for pair in timeline.pairs
            for part, time_s, may_m, planned_m in zip(
                pair.part.tolist(),
                pair.time_s.tolist(),
                pair.may_m.tolist(),
                pair.planned_m.tolist(),
                strict=True,
            )
        ],
    }


def _track_rows(one: Track) -> list[Row]:
    known = bool(np.isfinite(one.used_wh).all())
    rows = []
    for time_s, place_m, wh in zip(
        one.time_s.tolist(), one.place_m.tolist(), one.used_wh.tolist(), strict=True
    ):
        row: Row = {"sortie": one.sortie, "vehicle": one.vehicle, "time_s": round(time_s, 1)}
        row |= {**_place(*place_m[:2]), "height_m": round(place_m[2], 1)}
        rows.append(row | {"used_wh": round(wh, 1) if known else None})
    return rows


def _place(east_m: float, north_m: float) -> Row:
    return {"east_m": round(float(east_m), 1), "north_m": round(float(north_m), 1)}


def minutes(time_s: float) -> float:
    """Return a time as pictures have it. [min]"""
    return round(time_s / 60.0, 3)


def _pair_name(first: str, second: str) -> str:
    return f"{first}, {second}"


def fleet_panels(tables: FleetTables) -> dict[str, Chart]:
    """Return every picture of a fleet by name, without the rows."""
    panels = {"timeline": timeline_panel(tables), "map": fleet_map_panel(tables)}
    if tables.has_energy:
        panels |= {
            "power": _group_panel(tables, "power_w"),
            "energy": _group_panel(tables, "used_wh"),
        }
    if tables.timeline.pairs:
        panels["separation"] = separation_panel(tables)
    return panels


def timeline_panel(tables: FleetTables) -> Chart:
    """Return vehicles, packs, chargers and pads over time, with what is found of them."""
    alt = load_altair()
    axis = alt.Axis(labelLimit=170, title=None, domain=False, ticks=False)
    y = alt.Y("row:N", sort=None, axis=axis).scale(domain=tables.rows)
    used = [
        words
        for words, _ in USES.values()
        if any(r["use"] == words for r in tables.tables["spans"])
    ]
    colours = dict(USES.values())
    spans = alt.Chart(alt.NamedData("spans")).encode(y=y, x=time_axis(tables, "start_min"))
    has_room = alt.ExprRef(
        f"(datum.end_min - datum.start_min) / {max(tables.end_min, 1e-3)} * width"
        f" > {_CHARACTER_PX} * length(datum.name) ? 1 : 0"
    )
    marks = alt.Chart(alt.NamedData("marks")).encode(y=y, x=time_axis(tables))
    layers = [
        spans.mark_bar(height={"band": 0.75}).encode(
            x2=alt.X2("end_min:Q"),
            color=alt.Color("use:N")
            .title(None)
            .scale(domain=used, range=[colours[words] for words in used]),
            tooltip=[
                alt.Tooltip("row:N").title("of"),
                alt.Tooltip("use:N").title("what"),
                alt.Tooltip("name:N").title("name"),
                alt.Tooltip("start_min:Q").title("from [min]"),
                alt.Tooltip("end_min:Q").title("to [min]"),
            ],
        ),
        spans.mark_text(
            align="left", baseline="middle", dx=4, color=ON_COLOURS, fillOpacity=has_room
        ).encode(text=alt.Text("name:N")),
        marks.mark_point(
            shape="cross", angle=45, filled=True, size=130, opacity=1.0, color=RED
        ).encode(tooltip=alt.Tooltip("code:N")),
    ]
    return alt.layer(*layers).properties(
        width=WIDTH,
        height=_ROW_PX * max(len(tables.rows), 1),
        description="Timeline of vehicles, packs, chargers and pads, a cross where a finding is",
    )


def fleet_map_panel(tables: FleetTables) -> Chart:
    """Return all tracks over ground, with pads, fences and where two come too near to each other."""
    alt = load_altair()
    rows = tables.tables
    area = rows.get("area", [])
    view = ground_view([*rows["tracks"], *rows["pads"], *area], rows["fence"])
    x, y = ground_axes(view, origin=ORIGIN)

    def layer(name: str) -> Chart:
        return alt.Chart(alt.NamedData(name)).encode(x=x, y=y)

    layers = _area_layers(layer) if area else []
    if rows["fence"]:
        layers.append(fence_layer(layer("fence"), rows["fence"]))
    layers += [
        layer("tracks")
        .mark_line(strokeWidth=1.6, clip=True, strokeJoin="round")
        .encode(
            detail=alt.Detail("sortie:N"), order=alt.Order("time_s:Q"), color=vehicle_colour(tables)
        ),
        layer("pads").mark_point(filled=True, size=60, shape="square", opacity=1.0, color=GREEN),
        layer("pads")
        .mark_text(align="right", dx=-8, dy=8, clip=True)
        .encode(text=alt.Text("name:N")),
    ]
    if conflicts := rows["conflicts"]:
        crosses = layer("conflicts")
        layers.append(
            crosses.mark_point(
                shape="cross", angle=45, filled=True, size=200, opacity=1.0, color=RED, clip=True
            ).encode(tooltip=alt.Tooltip("what:N").title("finding"))
        )
        if len(conflicts) <= _MOST_CODES:
            layers.append(
                crosses.mark_text(align="left", dx=10, fontWeight="bold", clip=True).encode(
                    text=alt.Text("code:N")
                )
            )
    layers += compass_layers(*tables.winds) if len(tables.winds) == 1 else []
    if area:
        layers[0] = layers[0].add_params(alt.param(NOW, value=tables.end_min))
    return alt.layer(*layers).properties(
        width=WIDTH,
        height=MAP_HEIGHT,
        description="Map of the tracks of all sorties, with the pads, the fences and what is found",
    )


def _area_layers(layer: Callable[[str], Chart]) -> list[Chart]:
    """Return an area that is searched, and what of it has been seen by then."""
    alt = load_altair()
    seen = layer("seen").transform_filter(f"datum.seen_min <= {NOW}")
    return [
        seen.mark_rect(color=GREEN, opacity=0.3, clip=True).encode(
            x2=alt.X2("east2_m:Q"), y2=alt.Y2("north2_m:Q")
        ),
        layer("area")
        .mark_line(strokeWidth=1.5, strokeDash=[6, 4], color=GREY, clip=True)
        .encode(order=alt.Order("order:Q")),
    ]


def vehicle_colour(tables: FleetTables) -> Chart:
    """Return the colour of each vehicle; of many there is no legend."""
    names = [*dict.fromkeys(one.vehicle for one in tables.timeline.tracks)]
    colours = [colour for _, colour in zip(names, cycle(COLOURS), strict=False)]
    colour = load_altair().Color("vehicle:N").title("Vehicle").scale(domain=names, range=colours)
    return colour if len(names) <= _MOST_NAMES else colour.legend(None)


def _group_panel(tables: FleetTables, column: str) -> Chart:
    """Return what the group takes over time: its power, or its energy by then."""
    alt = load_altair()
    of_power = column == "power_w"
    partly = "" if tables.is_energy_whole else ", of the sorties whose energy is known"
    title = "Power [W]" if of_power else "Energy [Wh]"
    y = alt.Y(f"{column}:Q").title(title).scale(zero=True)
    mark = {"interpolate": "step-after"} if of_power else {}
    colour = RED if of_power else ORANGE
    chart = alt.Chart(alt.NamedData("group")).mark_area(
        color=colour, opacity=0.35, line={"strokeWidth": 1.5, "color": colour}, **mark
    )
    what = "Mean power of the group" if of_power else "Energy of the group"
    return alt.layer(chart.encode(x=time_axis(tables), y=y)).properties(
        width=WIDTH, height=HEIGHT, description=f"{what} over time{partly}"
    )


def separation_panel(tables: FleetTables) -> Chart:
    """Return how far the pairs that come nearest are apart, against what is required."""
    alt = load_altair()
    timeline = tables.timeline
    required_m = timeline.separation_m or 0.0
    least_m = max(pair.least_m for pair in timeline.pairs)
    top_m = round(max(_HIGHEST * required_m, _ROOM * least_m), 1)
    names = [_pair_name(pair.first, pair.second) for pair in timeline.pairs]
    legend = alt.Legend(labelLimit=300, columns=2, symbolType="stroke")
    colour = alt.Color("pair:N", legend=legend).title("Pair")
    colour = colour.scale(domain=names, range=list(COLOURS[: len(names)]))
    lines = alt.Chart(alt.NamedData("pairs")).encode(
        x=time_axis(tables), color=colour, detail=alt.Detail("part:N")
    )
    y = alt.Y("may_m:Q").title("Apart [m]").scale(domain=[0.0, top_m], nice=False)
    points = [
        {
            "pair": name,
            "time_min": minutes(pair.least_s),
            "may_m": round(pair.least_m, 1),
            "label": quantity.height(pair.least_m),
        }
        for name, pair in zip(names, timeline.pairs, strict=True)
    ]
    nearest = alt.Chart(alt.InlineData(values=points)).encode(
        x=time_axis(tables), y=y, color=colour
    )
    limit = alt.Chart(
        alt.InlineData(
            values=[{"may_m": required_m, "label": f"required, {quantity.height(required_m)}"}]
        )
    ).encode(y=y)
    layers = [
        lines.mark_line(strokeWidth=1.0, strokeDash=[3, 3], clip=True).encode(
            y=alt.Y("planned_m:Q")
        ),
        lines.mark_line(strokeWidth=1.8, clip=True).encode(y=y),
        nearest.mark_point(shape="diamond", filled=True, size=70, opacity=1.0),
        limit.mark_rule(strokeWidth=1.5, color=RED),
        limit.mark_text(align="left", baseline="bottom", dx=4, dy=-2).encode(
            x=alt.XValue(0), text=alt.Text("label:N")
        ),
    ]
    return alt.layer(*layers).properties(
        width=WIDTH,
        height=int(1.25 * HEIGHT),
        description="How far the pairs that come nearest to each other are apart over time",
    )


def time_axis(tables: FleetTables, column: str = "time_min") -> Chart:
    """Return the axis of all pictures over time."""
    axis = load_altair().X(f"{column}:Q").title("Time [min]")
    return axis.scale(domain=[0.0, max(tables.end_min, 1e-3)], nice=False)


_OUTCOMES = {
    "fewest in time": GREEN,
    "least energy": ORANGE,
    "too late": GREY,
    "returns not clear": RED,
    "": SKY,
}


def numbers_figures(plan: FleetPlan) -> dict[str, Chart]:
    """Return energy and makespan against the number of vehicles, with those to choose marked."""
    rows = []
    for row in plan.rows:
        marks = plan.marks(row)
        rows.append(
            {
                "vehicles": row.vehicles,
                "energy_wh": round(row.energy_wh, 2),
                "least_wh": row.least_energy_wh and round(row.least_energy_wh, 2),
                "makespan_min": round(row.makespan_s / 60.0, 2),
                "what": ", ".join(marks),
                "mark": marks[0] if marks else "",
            }
        )
    latest_s = plan.fleet.operation.latest_s
    return {
        "numbers-energy": _numbers_panel(rows, "energy_wh", "Energy of the group [Wh]", None),
        "numbers-makespan": _numbers_panel(
            rows, "makespan_min", "Makespan [min]", None if latest_s is None else latest_s / 60.0
        ),
    }


def _numbers_panel(rows: Sequence[Row], column: str, title: str, latest: float | None) -> Chart:
    alt = load_altair()
    x = alt.X("vehicles:O").title("Vehicles").axis(labelAngle=0)
    y = alt.Y(f"{column}:Q").title(title).scale(zero=True)
    marks = [mark for mark in _OUTCOMES if any(row["mark"] == mark for row in rows)]
    colour = alt.Color("mark:N").legend(None)
    colour = colour.scale(domain=marks, range=[_OUTCOMES[mark] for mark in marks])
    bars = alt.Chart(alt.InlineData(values=list(rows))).encode(x=x, y=y)
    layers = [
        bars.mark_bar(width={"band": 0.6}).encode(color=colour),
        bars.mark_text(baseline="bottom", dy=-3).encode(text=alt.Text(f"{column}:Q", format=".1f")),
        bars.mark_text(angle=270, align="left", baseline="middle", dx=6, color=ON_COLOURS).encode(
            y=alt.YValue(HEIGHT), text=alt.Text("what:N")
        ),
    ]
    if column == "energy_wh" and any(row["least_wh"] for row in rows):
        bars = bars.transform_filter("isValid(datum.least_wh)")
        layers.append(
            bars.mark_tick(thickness=2, width={"band": 0.8}).encode(y=alt.Y("least_wh:Q"))
        )
    if latest is not None:
        limit = alt.Chart(alt.InlineData(values=[{column: round(latest, 2)}])).encode(y=y)
        layers += [
            limit.mark_rule(strokeWidth=1.5, color=RED),
            limit.mark_text(align="left", baseline="bottom", dx=4, dy=-2).encode(
                x=alt.XValue(0), text=alt.TextValue("all have to have landed")
            ),
        ]
    return alt.layer(*layers).properties(
        width=WIDTH // 2, height=HEIGHT, description=f"{title} against the number of vehicles"
    )
