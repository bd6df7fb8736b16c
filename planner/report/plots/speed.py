"""A picture of what a mission takes over the speed it is flown at."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from planner.report.plots.figures import BLUE, ORANGE, Chart, load_altair
from planner.service.speed import SpeedCurve

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


WIDTH, HEIGHT = 720, 200
"""Of a panel. [px]"""


class SpeedTable(Protocol):
    """Energy and time of a mission over its cruise speed, as columns of one length."""

    @property
    def speed_m_s(self) -> Iterable[float]:
        """Cruise speeds, rising. [m s⁻¹]"""

    @property
    def energy_wh(self) -> Iterable[float]:
        """Energy of the whole flight at each, NaN where it is not known. [Wh]"""

    @property
    def time_s(self) -> Iterable[float]:
        """Time of the whole flight at each. [s]"""


def speed_figure(table: SpeedTable, marks: Mapping[str, float] | None = None) -> Chart:
    """Return energy and time of a mission over its cruise speed.

    Parameters
    ----------
    table : SpeedTable
        Such as `planner.service.speed` makes.
    marks : mapping of str to float, optional
        Speeds worth knowing, by what they are called; default those of a `SpeedCurve`: the present one,
        best endurance, best range, the fastest that fits and the fastest clear of all. [m s⁻¹]

    Raises
    ------
    UsageError
        If Altair is missing.
    """
    alt = load_altair()
    if marks is None and isinstance(table, SpeedCurve):
        marks = {
            name: flown.speed_m_s
            for name, flown in table.marks()
            if flown.speed_m_s is not None  # legs have several
        }
    rows = [
        {
            "speed_m_s": float(speed_m_s),
            "energy_wh": float(energy_wh) if math.isfinite(energy_wh) else None,
            "time_min": float(time_s) / 60.0,
        }
        for speed_m_s, energy_wh, time_s in zip(
            table.speed_m_s, table.energy_wh, table.time_s, strict=True
        )
    ]
    shown = [*map(float, table.speed_m_s), *(marks or {}).values()]
    middle_m_s = 0.5 * (min(shown) + max(shown))
    x = alt.X("speed_m_s:Q").title("Cruise speed [m/s]").scale(zero=False, nice=False)
    panels = (("energy_wh", "Energy [Wh]", ORANGE), ("time_min", "Time [min]", BLUE))
    known = any(row["energy_wh"] is not None for row in rows)
    return alt.vconcat(
        *(
            alt.layer(
                alt.Chart(alt.InlineData(values=rows))
                .mark_line(color=colour, strokeWidth=1.8)
                .encode(x=x, y=alt.Y(f"{column}:Q").title(title).scale(zero=False)),
                *_mark_layers(marks or {}, middle_m_s),
            ).properties(width=WIDTH, height=HEIGHT)
            for column, title, colour in panels
            if known or column != "energy_wh"
        )
    ).properties(description="Energy and time of the mission over its cruise speed")


def _mark_layers(marks: Mapping[str, float], middle_m_s: float) -> list[Chart]:
    """Return a line with a name for each speed, names of equal speeds joined, none beyond an edge."""
    alt = load_altair()
    names: dict[float, list[str]] = {}
    for name, speed_m_s in marks.items():
        names.setdefault(round(speed_m_s, 3), []).append(name)
    layers: list[Chart] = []
    for number, (speed_m_s, several) in enumerate(sorted(names.items())):
        rule = alt.Chart(alt.InlineData(values=[{"speed_m_s": speed_m_s}])).encode(x="speed_m_s:Q")
        layers += [
            rule.mark_rule(strokeDash=[2, 3]),
            rule.mark_text(
                align="left" if speed_m_s < middle_m_s else "right",
                baseline="top",
                dx=3 if speed_m_s < middle_m_s else -3,
            ).encode(y=alt.value(4 + 14 * number), text=alt.value(", ".join(several))),
        ]
    return layers
