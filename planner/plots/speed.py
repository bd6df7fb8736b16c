"""A picture of what a mission takes over the speed it is flown at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from planner.plots.library import Chart, load_altair
from planner.plots.theme import BLUE, ORANGE

if TYPE_CHECKING:
    from collections.abc import Sequence

WIDTH, HEIGHT = 720, 200
"""Of a panel. [px]"""


class SpeedTable(Protocol):
    """Energy and time of a mission over its cruise speed, as columns of one length."""

    @property
    def speed_m_s(self) -> Sequence[float]:
        """Cruise speeds, rising. [m s⁻¹]"""

    @property
    def energy_wh(self) -> Sequence[float]:
        """Energy of the whole flight at each. [Wh]"""

    @property
    def time_s(self) -> Sequence[float]:
        """Time of the whole flight at each. [s]"""


def speed_figure(table: SpeedTable) -> Chart:
    """Return energy and time of a mission over its cruise speed; the lowest energy is marked.

    Raises
    ------
    UsageError
        If Altair is missing.
    """
    alt = load_altair()
    rows = [
        {"speed_m_s": float(speed), "energy_wh": float(energy), "time_min": float(time) / 60.0}
        for speed, energy, time in zip(table.speed_m_s, table.energy_wh, table.time_s, strict=True)
    ]
    least = min(rows, key=lambda row: row["energy_wh"])
    x = alt.X("speed_m_s:Q").title("Cruise speed [m/s]").scale(zero=False, nice=False)

    def panel(column: str, title: str, colour: str) -> Chart:
        line = alt.Chart(alt.InlineData(values=rows, name="speeds"))
        return line.mark_line(color=colour, strokeWidth=1.8).encode(
            x=x, y=alt.Y(f"{column}:Q").title(title).scale(zero=False)
        )

    best = alt.Chart(alt.InlineData(values=[least])).encode(x=x, y="energy_wh:Q")
    energy = alt.layer(
        panel("energy_wh", "Energy [Wh]", ORANGE),
        best.mark_point(shape="diamond", filled=True, size=70, color=ORANGE, opacity=1.0),
        best.mark_text(dy=-12).encode(text=alt.value("least energy")),
    )
    return alt.vconcat(
        energy.properties(width=WIDTH, height=HEIGHT),
        panel("time_min", "Time [min]", BLUE).properties(width=WIDTH, height=HEIGHT),
    ).properties(description="Energy and time of the mission over its cruise speed")
