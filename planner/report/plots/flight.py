"""Pictures of a flight over time: heights and speed, power with its states, energy and the return."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.report.plots.picture_files import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    STATE_COLOURS,
    Chart,
    inline_rows,
    load_altair,
    styled,
)
from planner.report.plots.site import map_panel
from planner.report.tables import NO_RETURN, make_tables, with_data
from planner.service.separation import known_home_amsl_m

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.flight.budget import BatteryBudget
    from planner.report.tables import FlightTables, Row
    from planner.service.preflight import CheckResult


WIDTH, HEIGHT = 720, 200
"""Of a panel. [px]"""
_HEIGHTS = ("altitude_amsl_m", "ground_amsl_m")
_TIME = "Time [min]"
_LABELLED_BAND = 0.055
"""Fraction of the flight that a band of a state takes at least to hold the state's name. [-]"""
_CHARACTER_PX = 6.2
"""Width of a character of a state's name, about."""
_SPREAD = "8 of 10 flights"
_BAND_OPACITY = 0.35
_USED, _NEEDED = "used so far", "used once home, turning back here"


def profile_figure(result: CheckResult) -> Chart:
    """Return altitude, over the ground where it is known, and ground speed over time.

    As every figure of a result it raises ``UsageError`` if nothing is flown, or Altair is missing.
    """
    tables = make_tables(result)
    panels = load_altair().vconcat(altitude_panel(tables), speed_panel(tables))
    return with_data(panels.properties(description="Altitude and ground speed over time"), tables)


def power_figure(result: CheckResult) -> Chart:
    """Return the electrical power over time, on bands that name the states."""
    return _with_rows(power_panel, result)


def energy_figure(result: CheckResult) -> Chart:
    """Return the energy used over time, and what it would be at home when turning back there."""
    return _with_rows(energy_panel, result)


def map_figure(result: CheckResult) -> Chart:
    """Return the path flown over ground, north up, a metre as long in both directions."""
    return _with_rows(map_panel, result)


def _with_rows(panel: Callable[[FlightTables], Chart], result: CheckResult) -> Chart:
    tables = make_tables(result)
    return with_data(panel(tables), tables)


def altitude_panel(tables: FlightTables) -> Chart:
    """Return the altitude over time, over the ground or, where that is not known, over home.

    Where nobody knows the altitude of home, the height above it.
    """
    alt = load_altair()
    home_m, terrain = tables.assessment.route.home_amsl_m, tables.assessment.setup.terrain
    is_known = known_home_amsl_m(tables.assessment) is not None
    flight = alt.Chart(alt.NamedData("flight"))
    x = _time_axis(tables)
    y = alt.Y("altitude_amsl_m:Q").title("Altitude [m AMSL]" if is_known else "Above home [m]")
    y = y.scale(zero=False, domain=_heights_m(tables), nice=False)
    home = alt.Chart(inline_rows([{"home_amsl_m": round(home_m, 2)}]))
    above = alt.Axis(
        title="Above home [m]",
        orient="right",
        grid=False,
        values=_heights_above_home(tables),
        labelExpr=f"format(datum.value - {home_m:.2f}, '~r')",
    )
    layers = [
        home.mark_rule(strokeDash=[2, 3]).encode(
            y=alt.Y("home_amsl_m:Q").axis(above if is_known else None)
        ),
        home.mark_text(dy=-6).encode(
            x=alt.XValue(alt.ExprRef("width / 2")),
            y=alt.Y("home_amsl_m:Q").axis(None),
            text=alt.TextValue(
                f"home, {quantity.height(home_m) if is_known else 'altitude unknown'}"
            ),
        ),
        flight.mark_line(color=BLUE, strokeWidth=1.8).encode(x=x, y=y),
    ]
    if terrain is not None:
        ground = flight.encode(x=x, y=alt.Y("ground_amsl_m:Q").axis(None))
        layers = [
            ground.mark_area(color=GREY, opacity=0.35, line=False).encode(
                y2=alt.Y2(datum=_heights_m(tables)[0])
            ),
            ground.mark_line(color=GREY, strokeWidth=1.2),
            *layers,
        ]
    what = "Altitude of the flight over time, with the altitude of home"
    if not is_known:
        what = "Height of the flight above home over time"
    elif terrain is not None:
        what = "Altitude of the flight over time, over the ground"
    return _panel(alt.layer(*layers).resolve_axis(y="independent"), what)


def speed_panel(tables: FlightTables) -> Chart:
    """Return the ground speed over time."""
    alt = load_altair()
    top_m_s = max(round(1.1 * max(row["speed_m_s"] for row in tables.flight), 2), 1.0)
    y = alt.Y("speed_m_s:Q").title("Ground speed [m/s]").scale(domain=[0.0, top_m_s])
    line = alt.Chart(alt.NamedData("flight")).mark_line(color=GREEN, strokeWidth=1.5)
    return _panel(alt.layer(line.encode(x=_time_axis(tables), y=y)), "Ground speed over time")


def power_panel(tables: FlightTables) -> Chart:
    """Return the power over time on bands of the states."""
    alt = load_altair()
    bands = alt.Chart(alt.NamedData("states"))
    present = [state for state in STATE_COLOURS if any(r["state"] == state for r in tables.states)]
    layers = [
        bands.mark_rect(opacity=0.35).encode(
            x=_time_axis(tables, "start_min"),
            x2=alt.X2("end_min:Q"),
            color=alt.Color("state:N")
            .title("State")
            .scale(domain=list(map(str, present)), range=[STATE_COLOURS[s] for s in present]),
        )
    ]
    whole_min = tables.states[-1]["end_min"]
    named = [
        {
            "middle_min": round(0.5 * (row["start_min"] + row["end_min"]), 4),
            "fraction": round((row["end_min"] - row["start_min"]) / whole_min, 4),
            "state": row["state"],
        }
        for row in tables.states
        if row["end_min"] - row["start_min"] > _LABELLED_BAND * whole_min
    ]
    has_room = alt.ExprRef(
        f"datum.fraction * width > {_CHARACTER_PX} * length(datum.state) ? 1 : 0"
    )
    if tables.assessment.vehicle.is_power_known:
        layers.append(
            alt.Chart(alt.NamedData("flight"))
            .mark_line(color=RED, strokeWidth=1.5)
            .encode(x=_time_axis(tables), y=alt.Y("power_w:Q").title("Power [W]"))
        )
    layers.append(
        alt.Chart(inline_rows(named))
        .mark_text(baseline="top", dy=4, fillOpacity=has_room)
        .encode(x=alt.X("middle_min:Q"), y=alt.YValue(0), text=alt.Text("state:N"))
    )
    return _panel(alt.layer(*layers), "Electrical power over time, on bands of the flight's states")


_EARLY = 0.4
"""A point of no return before this fraction of the flight has the texts on its right. [-]"""


def energy_panel(tables: FlightTables) -> Chart:
    """Return the energy over time, with the return, the battery and the reserve."""
    alt = load_altair()
    x = _time_axis(tables)
    battery = tables.result.battery
    highest_wh = [row["needed_wh"] for row in tables.returns] + [tables.result.totals.energy_wh]
    highest_wh += [row["p90_wh"] for row in tables.band[-1:]]
    top_wh = round(1.1 * max([*highest_wh, 0.0 if battery is None else battery.usable_wh]), 3)
    styles = {_USED: (ORANGE, [1, 0]), _NEEDED: (BLUE, [6, 3])}
    legend = alt.Legend(labelLimit=400, columns=1)

    def curve(rows: Chart, column: str, name: str) -> Chart:
        return (
            alt.Chart(rows)
            .transform_calculate(curve=f"'{name}'")
            .mark_line(strokeWidth=1.8)
            .encode(
                x=x,
                y=alt.Y(f"{column}:Q").title("Energy [Wh]").scale(domain=[0.0, top_wh]),
                **styled("curve:N", "Energy", styles, legend=legend),
            )
        )

    layers = []
    if tables.band:
        spread = alt.Fill(
            "spread:N", legend=alt.Legend(symbolType="square", symbolOpacity=_BAND_OPACITY)
        )
        layers.append(
            alt.Chart(alt.NamedData("band"))
            .transform_calculate(spread=f"'{_SPREAD}'")
            .mark_area(opacity=_BAND_OPACITY)
            .encode(
                x=x,
                y=alt.Y("p10_wh:Q"),
                y2=alt.Y2("p90_wh:Q"),
                fill=spread.title("Used so far").scale(domain=[_SPREAD], range=[ORANGE]),
            )
        )
    if tables.assessment.vehicle.is_power_known:
        layers += [
            curve(alt.NamedData("flight"), "used_wh", _USED),
            curve(alt.NamedData("returns"), "needed_wh", _NEEDED),
        ]
    if (tightest := tightest_row(tables)) is not None:
        point = alt.Chart(inline_rows([tightest])).encode(x=x, y=alt.Y("needed_wh:Q"))
        layers += [
            point.mark_point(shape="diamond", filled=True, size=70, color=BLUE, opacity=1.0),
            point.mark_text(align="right", dx=-8, dy=-6).encode(text=alt.TextValue("tightest")),
        ]
    turns = [row for row in tables.points if row["kind"] == NO_RETURN[0]]
    flown_min = tables.assessment.flight.time_s / 60.0
    is_early = any(row["time_min"] < _EARLY * flown_min for row in turns)
    if turns:
        turn = alt.Chart(inline_rows(turns)).encode(x=x)
        layers += [
            turn.mark_rule(color=RED, strokeWidth=1.5),
            turn.mark_text(
                align="left" if is_early else "right",
                baseline="top",
                dx=4 if is_early else -4,
                dy=4,
            ).encode(y=alt.YValue(0), text=alt.TextValue(NO_RETURN[0])),
        ]
    if battery is not None:
        side = ("right", alt.ExprRef("width"), -4) if is_early else ("left", 0, 4)
        drawn = (
            ([1, 0], "bottom", -2),
            ([2, 3], "top", 3),
        )  # the battery's above, the reserve's below
        for row, (dashes, baseline, dy) in zip(limit_rows(battery), drawn, strict=True):
            limit = alt.Chart(inline_rows([row])).encode(y=alt.Y("energy_wh:Q"))
            layers += [
                limit.mark_rule(strokeWidth=1.2, strokeDash=dashes),
                limit.mark_text(align=side[0], baseline=baseline, dx=side[2], dy=dy).encode(
                    x=alt.XValue(side[1]), text=alt.Text("label:N")
                ),
            ]
    return _panel(
        alt.layer(*layers),
        "Energy used over time, and what would be used once home by turning back at each time",
    )


def tightest_row(tables: FlightTables) -> Row | None:
    """Return the point from which the return is tightest."""
    way = tables.result.return_plan
    if way is None or way.tightest is None:
        return None
    returns, time_s = tables.assessment.returns, way.tightest.time_s
    ends_s = np.append(returns.start_s, returns.flight.time_s)
    used_wh = float(np.interp(time_s, ends_s, returns.used_wh))
    return {
        "time_min": round(time_s / 60.0, 4),
        "needed_wh": round(used_wh + way.energy_home_wh, 3),
    }


def limit_rows(battery: BatteryBudget) -> list[Row]:
    """Return what the battery holds, and where its reserve begins."""
    above_wh = battery.usable_wh - battery.reserve_wh
    limits = (("battery", "battery", battery.usable_wh), ("reserve", "reserve begins", above_wh))
    return [
        {"limit": limit, "energy_wh": round(wh, 3), "label": f"{words}, {quantity.energy(wh)}"}
        for limit, words, wh in limits
    ]


def _heights_m(tables: FlightTables) -> list[float]:
    """Return the lowest and the highest height to draw, with some room about them. [m AMSL]"""
    heights = [tables.assessment.route.home_amsl_m]
    for row in tables.flight:
        heights += [row[key] for key in _HEIGHTS if row.get(key) is not None]
    low, high = min(heights), max(heights)
    room = 0.06 * max(high - low, 10.0)
    return [round(low - room, 1), round(high + room, 1)]


def _heights_above_home(tables: FlightTables) -> list[float]:
    """Return the altitudes that are round heights above home, for the second axis. [m AMSL]"""
    home_m, (low_m, high_m) = tables.assessment.route.home_amsl_m, _heights_m(tables)
    rough_m = (high_m - low_m) / _TICKS
    power_m = 10.0 ** math.floor(math.log10(rough_m))
    step_m = next(power_m * times for times in (1.0, 2.0, 5.0, 10.0) if power_m * times >= rough_m)
    first, last = math.ceil((low_m - home_m) / step_m), math.floor((high_m - home_m) / step_m)
    return [round(home_m + number * step_m, 2) for number in range(first, last + 1)]


_TICKS = 6


def _time_axis(tables: FlightTables, column: str = "time_min") -> Chart:
    whole_min = tables.flight[-1]["time_min"]
    axis = load_altair().X(f"{column}:Q").title(_TIME)
    return axis.scale(domain=[0.0, whole_min], nice=False)


def _panel(chart: Chart, description: str) -> Chart:
    return chart.properties(width=WIDTH, height=HEIGHT, description=description)


def mission_figures(result: CheckResult) -> dict[str, Chart]:
    """Return every picture of a result by name; the tables behind them are made once.

    They are ``map``, ``altitude``, ``speed``, ``power`` and, where it is known, ``energy``.
    """
    tables = make_tables(result)
    return {name: with_data(panel, tables) for name, panel in mission_panels(tables).items()}


def mission_panels(tables: FlightTables) -> dict[str, Chart]:
    """Return every picture of tables by name, without the rows."""
    panels = {
        "map": map_panel(tables),
        "altitude": altitude_panel(tables),
        "speed": speed_panel(tables),
        "power": power_panel(tables),
    }
    if tables.returns:
        panels["energy"] = energy_panel(tables)
    return panels
