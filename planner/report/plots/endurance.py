"""Pictures of what a vehicle can do: its range over the airspeed, its hover over the payload."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.report.plots.picture_files import BLUE, ORANGE, Chart, inline_rows, load_altair
from planner.units import SECONDS_PER_MINUTE

if TYPE_CHECKING:
    from planner.service.endurance import Endurance

WIDTH, HEIGHT = 720, 260
"""Of a picture. [px]"""


def endurance_figures(shown: Endurance) -> dict[str, Chart]:
    """Return range over airspeed and hover over payload, each where the model knows it."""
    ranges = [
        (one.speed_m_s, 1e-3 * one.range_m) for one in shown.speeds if one.range_m is not None
    ]
    hovers = [
        (one.payload_kg, one.flight.endurance_s / SECONDS_PER_MINUTE)
        for one in shown.loads
        if one.flight.endurance_s is not None
    ]
    figures = {}
    if len(ranges) > 1:
        figures["range"] = _curve(ranges, ("Airspeed [m/s]", "Range [km]"), ORANGE)
    if hovers:
        figures["hover"] = _curve(hovers, ("Payload [kg]", "Hover [min]"), BLUE)
    return figures


def _curve(points: list[tuple[float, float]], titles: tuple[str, str], colour: str) -> Chart:
    alt = load_altair()
    x_title, y_title = titles
    rows = [{"x": x, "y": y} for x, y in points]
    return (
        alt.Chart(inline_rows(rows))
        .mark_line(color=colour, strokeWidth=1.8, point={"color": colour})
        .encode(x=alt.X("x:Q").title(x_title).scale(nice=False), y=alt.Y("y:Q").title(y_title))
        .properties(width=WIDTH, height=HEIGHT, description=f"{y_title} over {x_title.lower()}")
    )
