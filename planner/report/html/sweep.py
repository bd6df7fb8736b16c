"""The page of a sweep: its maps, limits, what breaks first and what moves the margin."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.report.html.page import page_json, page_text, template
from planner.report.plots.picture_files import still_svg
from planner.report.plots.sweep import axis_title, sweep_figures
from planner.report.sweep import break_rows, headline, limit_lines, remarks

if TYPE_CHECKING:
    from datetime import datetime

    from planner.service.sweep.sweep import Sweep


def sweep_html(sweep: Sweep, *, version: str, made_at: datetime) -> str:
    """Return what a sweep comes to as a page.

    Raises
    ------
    UsageError
        If a library of ``mavjoule[report]`` is missing.
    """
    tally = sweep.tally
    figures = sweep_figures(tally)
    payload = {name: figure.to_dict(validate=False) for name, figure in figures.items()}
    tables = {
        axis_title(scale.key): [
            (label, quantity.percent(go / checked if checked else None), go, checked)
            for label, go, checked in tally.shares(scale.key)
        ]
        for scale in tally.scales
        if len(scale.labels) > 1
    }
    section = template("sweep.html.j2").module.sweep(
        lines=remarks(sweep),
        charts={name: str(figure.description) for name, figure in figures.items()},
        stills={name: still_svg(spec) for name, spec in payload.items()},
        payload=page_json(payload),
        tables=tables,
        limits=limit_lines(tally),
        breaks=break_rows(tally),
    )
    return page_text(
        title=f"Sweep: {headline(sweep)}",
        version=version,
        made_at=made_at,
        has_charts=bool(figures),
        is_one=False,
        sections=[section],
    )
