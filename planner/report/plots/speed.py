"""A picture of what a mission takes over the speed it is flown at."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.report.plots.picture_files import BLUE, ORANGE, Chart, inline_rows, load_altair

if TYPE_CHECKING:
    from planner.service.speed import SpeedCurve

WIDTH, HEIGHT = 720, 200
"""Of a panel. [px]"""


def speed_figure(curve: SpeedCurve) -> Chart:
    """Return energy and time of a mission over its cruise speed, with the speeds worth knowing.

    They are the present one, best endurance, best range, the fastest that fits and the fastest clear
    of all.
    """
    alt = load_altair()
    names: dict[float, list[str]] = {}  # of equal speeds, joined
    for name, flown in curve.marks():
        if flown.speed_m_s is not None:  # legs have several
            names.setdefault(round(flown.speed_m_s, 3), []).append(name)
    columns = zip(curve.speed_m_s, curve.energy_wh, curve.time_s, strict=True)
    rows = [
        {
            "speed_m_s": float(speed_m_s),
            "energy_wh": float(energy_wh) if math.isfinite(energy_wh) else None,
            "time_min": float(time_s) / 60.0,
        }
        for speed_m_s, energy_wh, time_s in columns
    ]
    shown = [*(row["speed_m_s"] or 0.0 for row in rows), *names]
    middle_m_s = 0.5 * (min(shown) + max(shown))
    x = alt.X("speed_m_s:Q").title("Cruise speed [m/s]").scale(zero=False, nice=False)
    marks: list[Chart] = []
    for number, (speed_m_s, several) in enumerate(sorted(names.items())):
        rule = alt.Chart(inline_rows([{"speed_m_s": speed_m_s}])).encode(x=alt.X("speed_m_s:Q"))
        align, dx = ("left", 3) if speed_m_s < middle_m_s else ("right", -3)  # none beyond an edge
        marks += [
            rule.mark_rule(strokeDash=[2, 3]),
            rule.mark_text(align=align, baseline="top", dx=dx).encode(
                y=alt.YValue(4 + 14 * number), text=alt.TextValue(", ".join(several))
            ),
        ]
    panels = (("energy_wh", "Energy [Wh]", ORANGE), ("time_min", "Time [min]", BLUE))
    known = any(row["energy_wh"] is not None for row in rows)
    return alt.vconcat(
        *(
            alt.layer(
                alt.Chart(inline_rows(rows))
                .mark_line(color=colour, strokeWidth=1.8)
                .encode(x=x, y=alt.Y(f"{column}:Q").title(title).scale(zero=False)),
                *marks,
            ).properties(width=WIDTH, height=HEIGHT)
            for column, title, colour in panels
            if known or column != "energy_wh"
        )
    ).properties(description="Energy and time of the mission over its cruise speed")
