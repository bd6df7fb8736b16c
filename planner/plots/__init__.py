"""Pictures of results, as Altair charts: for notebooks, files and the report alike.

Every function takes a result and returns a chart without a theme; `write_figure` writes it, dressed
for light or dark pages.  Altair and vl-convert come with ``mavjoule[report]``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.plots.files import write_figure, write_figures
    from planner.plots.flight import energy_figure, power_figure, profile_figure
    from planner.plots.identification import identification_figures
    from planner.plots.mission import mission_figures
    from planner.plots.site import map_figure
    from planner.plots.speed import speed_figure
    from planner.plots.split import split_energy_figure, split_map_figure
    from planner.plots.verification import verification_figure

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
    "energy_figure": "planner.plots.flight",
    "identification_figures": "planner.plots.identification",
    "map_figure": "planner.plots.site",
    "mission_figures": "planner.plots.mission",
    "power_figure": "planner.plots.flight",
    "profile_figure": "planner.plots.flight",
    "speed_figure": "planner.plots.speed",
    "split_energy_figure": "planner.plots.split",
    "split_map_figure": "planner.plots.split",
    "verification_figure": "planner.plots.verification",
    "write_figure": "planner.plots.files",
    "write_figures": "planner.plots.files",
}


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name not in _HOMES:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOMES[name]), name)
