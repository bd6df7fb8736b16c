"""Pictures of a simulated swarm: those of a fleet over time, its goal, and numbers of agents."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.fleet.trajectory import thinned
from planner.report.plots.fleet import (
    FleetTables,
    fleet_panels,
    minutes,
    row_names,
    time_axis,
    timeline_tables,
)
from planner.report.plots.flight import HEIGHT
from planner.report.plots.picture_files import GREEN, GREY, ORANGE, SKY, Chart, load_altair
from planner.report.plots.site import WIDTH
from planner.service.fleet_timeline import TRACK_ERROR_M
from planner.service.swarm import GOAL_FRACTIONS
from planner.service.swarm_timeline import EVENTS
from planner.values import field_names, replace

if TYPE_CHECKING:
    from planner.fleet.swarm.coverage import Coverage
    from planner.report.tables import Row
    from planner.service.fleet_timeline import FleetTimeline
    from planner.service.swarm import SwarmResult
    from planner.service.swarm_agents import SwarmNumbers

_MOST_BLOCKS = 2_500
"""Squares of an area on a map: each is a few dots wide."""
_MOST_POINTS = 40_000
"""Of all tracks together: of about 20 bytes each in a page, beside the 1.1 MB of the plotting library."""
_MOST_ROWS = 40
"""Agents in a timeline, which is then three times as high as a map."""


def thinned_timeline(timeline: FleetTimeline) -> tuple[FleetTimeline, float]:
    """Return a timeline whose tracks together have few points, and how far they may be off. [m]"""
    error_m, tracks = TRACK_ERROR_M, timeline.tracks
    while sum(len(one.time_s) for one in tracks) > _MOST_POINTS:
        error_m *= 2.0
        tracks = tuple(
            replace(
                one, time_s=one.time_s[kept], place_m=one.place_m[kept], used_wh=one.used_wh[kept]
            )
            for one in timeline.tracks
            for kept in [thinned(one.time_s, one.place_m, error_m - TRACK_ERROR_M)]
        )
    return replace(timeline, tracks=tracks), error_m


def make_swarm_tables(result: SwarmResult, timeline: FleetTimeline) -> FleetTables:
    """Return the rows of the pictures of a swarm, of which somebody flies."""
    tables = timeline_tables(timeline, result.fleet, EVENTS)
    goal = result.goal
    fraction = goal.fraction_at(timeline.edge_s)
    tables |= {
        "fence": [],
        "goal": [
            {"time_min": minutes(time_s), "percent": round(100.0 * part, 2)}
            for time_s, part in zip(timeline.edge_s.tolist(), fraction.tolist(), strict=True)
        ],
    }
    if result.coverage is not None:
        tables |= {"area": _corners(result.coverage), "seen": _seen_rows(result.coverage)}
    return FleetTables(
        timeline=timeline,
        rows=row_names(timeline),
        tables=tables,
        winds=frozenset(one.setup.wind for one in result.fleet.vehicles.values()),
        has_energy=any(one.energy_wh is not None for one in result.agents),
        is_energy_whole=result.energy_wh is not None,
    )


def _corners(coverage: Coverage) -> list[Row]:
    area = coverage.area
    corners = (
        (area.west_m, area.south_m),
        (area.east_m, area.south_m),
        (area.east_m, area.north_m),
        (area.west_m, area.north_m),
        (area.west_m, area.south_m),
    )
    return [
        {"order": order, "east_m": round(east_m, 1), "north_m": round(north_m, 1)}
        for order, (east_m, north_m) in enumerate(corners)
    ]


def _seen_rows(coverage: Coverage) -> list[Row]:
    """Return blocks of cells: each counts as seen when half of it has been."""
    area, seen_s = coverage.area, coverage.seen_s
    size = max(math.ceil(math.sqrt(seen_s.size / _MOST_BLOCKS)), 1)
    rows, columns = seen_s.shape
    across = (area.east_m - area.west_m) / columns
    along = (area.north_m - area.south_m) / rows
    found: list[Row] = []
    for south in range(0, rows, size):
        for west in range(0, columns, size):
            block = seen_s[south : south + size, west : west + size]
            time_s = float(np.quantile(block, 0.5, method="inverted_cdf"))
            if math.isfinite(time_s):
                high, wide = block.shape
                found.append(
                    {
                        "east_m": round(area.west_m + west * across, 1),
                        "east2_m": round(area.west_m + (west + wide) * across, 1),
                        "north_m": round(area.south_m + south * along, 1),
                        "north2_m": round(area.south_m + (south + high) * along, 1),
                        "seen_min": minutes(time_s),
                    }
                )
    return found


def swarm_panels(tables: FleetTables, result: SwarmResult) -> dict[str, Chart]:
    """Return every picture of a swarm by name, without the rows."""
    panels = fleet_panels(tables) | {"goal": goal_panel(tables, result)}
    if len(tables.rows) > _MOST_ROWS:
        del panels["timeline"]
    return panels


def goal_panel(tables: FleetTables, result: SwarmResult) -> Chart:
    """Return how much of the goal is reached over time."""
    alt = load_altair()
    goal = result.goal
    y = alt.Y("percent:Q").title(f"{goal.what.capitalize()} [%]").scale(domain=[0.0, 100.0])
    x = time_axis(tables)
    chart = alt.Chart(alt.NamedData("goal")).encode(x=x, y=y)
    reached = [
        {
            "time_min": minutes(time_s),
            "percent": 100.0 * part,
            "label": f"{quantity.percent(part)} {quantity.clock(time_s)}",
        }
        for part in GOAL_FRACTIONS
        for time_s in [goal.time_to_s(part)]
        if time_s is not None
    ]
    points = alt.Chart(alt.InlineData(values=reached)).encode(x=x, y=y)
    layers = [
        chart.mark_area(color=GREEN, opacity=0.35, line={"strokeWidth": 1.5, "color": GREEN}),
        points.mark_point(filled=True, size=60, opacity=1.0, color=ORANGE),
        points.mark_text(align="right", dx=-8, dy=-6).encode(text=alt.Text("label:N")),
    ]
    return alt.layer(*layers).properties(
        width=WIDTH,
        height=HEIGHT,
        description=f"How much of the goal, {goal.what}, is reached over time",
    )


_MARKS = {"fewest in time": GREEN, "least energy": ORANGE}
"""Colours of the numbers to choose; of both the first."""
_OF_NUMBERS = {
    "agents-energy": ("energy_wh", "Energy of the group [Wh]", 1.0),
    "agents-makespan": ("makespan_s", "Makespan [min]", 60.0),
    "agents-goal": ("time_to_90_s", "90 % of the goal [min]", 60.0),
}


def numbers_panels(numbers: SwarmNumbers) -> dict[str, Chart]:
    """Return energy and times against the number of agents: means, and what eight of ten runs lie between."""
    return {
        name: _numbers_panel(numbers, *of)
        for name, of in _OF_NUMBERS.items()
        if any(math.isfinite(getattr(row, of[0]).p10) for row in numbers.rows)
    }


def _numbers_panel(numbers: SwarmNumbers, key: str, title: str, unit: float) -> Chart:
    alt = load_altair()
    rows: list[Row] = []
    highest = 0.0
    for row in numbers.rows:
        figure, mark = getattr(row, key), ", ".join(numbers.marks(row))
        known = {
            name: round(value / unit, 2)
            for name in field_names(figure)
            for value in [getattr(figure, name)]
            if math.isfinite(value)
        }
        highest = max(highest, *known.values(), 0.0)
        # where a run never got there, there is no mean
        top = max(known.values()) if "mean" in known else None
        rows.append({"agents": row.agents, "mark": mark or "possible", "top": top, **known})
    found = [*dict.fromkeys(str(row["mark"]) for row in rows)]
    colours = [
        _MARKS.get(mark.split(", ")[0], SKY if mark == "possible" else GREY) for mark in found
    ]
    colour = alt.Color("mark:N").title(None).scale(domain=found, range=colours)
    numbers_of = [row.agents for row in numbers.rows]
    x = alt.X("agents:O").title("Agents").axis(labelAngle=0).scale(domain=numbers_of)
    # room for the figure on the highest
    y = alt.Y("mean:Q").title(title).scale(domain=[0.0, 1.1 * highest or 1.0])
    chart = alt.Chart(alt.InlineData(values=rows)).encode(x=x)
    layers = [
        chart.mark_bar(width={"band": 0.6}).encode(y=y, color=colour),
        chart.transform_filter("isValid(datum.p90)")
        .mark_rule(strokeWidth=2)
        .encode(y=alt.Y("p10:Q"), y2=alt.Y2("p90:Q")),
        chart.transform_filter("isValid(datum.top)")
        .mark_text(baseline="bottom", dy=-3)
        .encode(y=alt.Y("top:Q"), text=alt.Text("mean:Q", format=".1f")),
    ]
    return alt.layer(*layers).properties(
        width=WIDTH // 2, height=HEIGHT, description=f"{title} against the number of agents"
    )
