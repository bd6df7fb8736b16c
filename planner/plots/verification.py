"""Pictures of a verification: power, height and speed, flown and predicted, as the article's Fig. 10."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.plots.library import Chart, load_altair
from planner.plots.theme import BLUE, GREY

if TYPE_CHECKING:
    from planner.identify.verification import Verification
    from planner.logs.record import FlightRecord
    from planner.plots.places import Row

WIDTH, HEIGHT = 720, 160
"""Of a panel. [px]"""
MOST_ROWS = 2_000
"""Of each flight."""
_PANELS = (
    ("power_w", "Power [W]"),
    ("height_above_home_m", "Height above home [m]"),
    ("ground_speed_m_s", "Ground speed [m/s]"),
)
_FLOWN, _PREDICTED = "flown", "predicted"


def verification_figure(one: Verification, *, title: str = "") -> Chart:
    """Return a flight and its prediction, one over the other, over the time since they began.

    Parameters
    ----------
    one : Verification
        What to draw.
    title : str
        Above the panels.

    Raises
    ------
    UsageError
        If Altair is missing.
    """
    alt = load_altair()
    rows = _rows(one.flown, _FLOWN) + _rows(one.foreseen, _PREDICTED)
    domain = [_FLOWN, _PREDICTED]
    panels = [
        alt.Chart(alt.InlineData(values=rows, name="flights"))
        .mark_line(strokeWidth=1.5)
        .encode(
            x=alt.X("time_s:Q").title("Time [s]").scale(nice=False),
            y=alt.Y(f"{column}:Q").title(label),
            color=alt.Color("flight:N").title("Flight").scale(domain=domain, range=[GREY, BLUE]),
            strokeDash=alt.StrokeDash("flight:N")
            .title("Flight")
            .scale(domain=domain, range=[[1, 0], [6, 2]]),
        )
        .properties(width=WIDTH, height=HEIGHT)
        for column, label in _PANELS
    ]
    named = {"title": title} if title else {}
    return alt.vconcat(*panels, **named).properties(
        description="Power, height and ground speed over time, flown and predicted"
    )


def _rows(record: FlightRecord, flight: str) -> list[Row]:
    """Return some samples of a flight, evenly chosen; ``None`` where the record knows nothing."""
    count = len(record.time_s)
    chosen = np.linspace(0, count - 1, min(count, MOST_ROWS)).round().astype(np.intp)
    time_s = np.round(record.time_s[chosen], 2).tolist()
    columns = [_column(getattr(record, name), chosen) for name, _ in _PANELS]
    names = ("flight", "time_s", *(name for name, _ in _PANELS))
    return [
        dict(zip(names, row, strict=True))
        for row in zip([flight] * len(time_s), time_s, *columns, strict=True)
    ]


def _column(values: Any, chosen: Any) -> list[float | None]:  # noqa: ANN401 - arrays of a record
    return [
        round(value, 2) if np.isfinite(value) else None
        for value in np.asarray(values, np.float64)[chosen].tolist()
    ]
