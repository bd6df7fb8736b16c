"""Pictures of results, as Altair charts: for notebooks, files and the report alike.

Every function takes a result and returns a chart without a theme; `write_figure` writes it, dressed
for light or dark pages.  Altair and vl-convert come with ``mavjoule[report]``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.report.plots.figures import write_figure, write_figures
    from planner.report.plots.flight import (
        energy_figure,
        mission_figures,
        power_figure,
        profile_figure,
    )
    from planner.report.plots.identification import identification_figures, verification_figure
    from planner.report.plots.site import map_figure
    from planner.report.plots.speed import speed_figure
    from planner.report.plots.split import split_energy_figure, split_map_figure

__all__ = [
    "energy_figure",
    "identification_figures",
    "map_figure",
    "mission_figures",
    "power_figure",
    "profile_figure",
    "speed_figure",
    "split_energy_figure",
    "split_map_figure",
    "verification_figure",
    "write_figure",
    "write_figures",
]

_HOMES = {
    "energy_figure": "planner.report.plots.flight",
    "identification_figures": "planner.report.plots.identification",
    "map_figure": "planner.report.plots.site",
    "mission_figures": "planner.report.plots.flight",
    "power_figure": "planner.report.plots.flight",
    "profile_figure": "planner.report.plots.flight",
    "speed_figure": "planner.report.plots.speed",
    "split_energy_figure": "planner.report.plots.split",
    "split_map_figure": "planner.report.plots.split",
    "verification_figure": "planner.report.plots.identification",
    "write_figure": "planner.report.plots.figures",
    "write_figures": "planner.report.plots.figures",
}


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name not in _HOMES:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOMES[name]), name)
