"""Pictures of a flight over time: heights and speed, power with its states, energy and the return."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.plots.tables import flight_rows, flown_case, state_rows
from planner.plots.theme import BLUE, GREEN, ORANGE, RED, STATE_COLOURS

if TYPE_CHECKING:
    import altair

    from planner.plots.tables import Row
    from planner.service import CheckResult

WIDTH, HEIGHT = 720, 180
"""Of a panel. [px]"""
_TIME = "Time [min]"


def profile_figure(result: CheckResult) -> altair.VConcatChart:
    """Return altitude and ground speed over time, with the item flown.

    Raises
    ------
    UsageError
        If nothing is flown.
    """
    import altair as alt

    rows = _table(flight_rows(result))
    return alt.vconcat(
        _line(rows, "altitude_amsl_m", "Altitude [m AMSL]", BLUE),
        _line(rows, "speed_m_s", "Ground speed [m/s]", GREEN),
    ).resolve_scale(x="shared")


def power_figure(result: CheckResult) -> altair.LayerChart:
    """Return the electrical power over time, on bands that name the states.

    Raises
    ------
    UsageError
        If nothing is flown.
    """
    import altair as alt

    bands = (
        alt.Chart(_table(state_rows(result)))
        .mark_rect(opacity=0.35)
        .encode(
            x=alt.X("start_min:Q").title(_TIME),
            x2="end_min:Q",
            color=alt.Color("state:N")
            .title("State")
            .scale(domain=[str(s) for s in STATE_COLOURS], range=list(STATE_COLOURS.values())),
            tooltip=["state:N", alt.Tooltip("start_min:Q"), alt.Tooltip("end_min:Q")],
        )
    )
    if not flown_case(result).vehicle.is_power_known:
        return bands.properties(width=WIDTH, height=HEIGHT)
    return (bands + _line(_table(flight_rows(result)), "power_w", "Power [W]", RED)).properties(
        width=WIDTH, height=HEIGHT
    )


def energy_figure(result: CheckResult) -> altair.LayerChart:
    """Return the energy used over time, and what it would be at home when turning back there.

    Raises
    ------
    UsageError
        If nothing is flown.
    """
    import altair as alt

    layers = [_line(_table(flight_rows(result)), "used_wh", "Energy [Wh]", ORANGE)]
    if result.battery is not None:
        reserve_wh = result.battery.reserve_fraction * result.battery.capacity_wh
        limits = [
            {"limit": "battery", "energy_wh": result.battery.usable_wh},
            {"limit": "above the reserve", "energy_wh": result.battery.usable_wh - reserve_wh},
        ]
        lines = alt.Chart(_table(limits)).encode(y="energy_wh:Q")
        layers += [
            lines.mark_rule(strokeDash=[6, 4]),
            lines.mark_text(align="left", dx=4, dy=-5, x=0).encode(text="limit:N"),
        ]
    return alt.layer(*layers).properties(width=WIDTH, height=HEIGHT)


def _table(rows: list[Row]) -> Any:  # noqa: ANN401 - Altair's union of data
    import altair as alt

    return alt.InlineData(values=rows)


def _line(rows: Any, name: str, title: str, colour: str) -> altair.Chart:  # noqa: ANN401
    import altair as alt

    return (
        alt.Chart(rows)
        .mark_line(color=colour, strokeWidth=1.5)
        .encode(
            x=alt.X("time_min:Q").title(_TIME),
            y=alt.Y(f"{name}:Q").title(title),
            tooltip=["time_min:Q", "item:O", alt.Tooltip(f"{name}:Q").title(title)],
        )
        .properties(width=WIDTH, height=HEIGHT)
    )
