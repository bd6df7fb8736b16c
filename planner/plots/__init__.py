"""Pictures of results, as Altair charts: for notebooks, files and the report alike.

Every function takes a result and returns a chart without a theme; `planner.plots.files` writes it,
`planner.plots.theme` dresses it for light and dark pages.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.plots.files import write_figure
    from planner.plots.flight import energy_figure, power_figure, profile_figure
    from planner.plots.site import map_figure

__all__ = ["energy_figure", "map_figure", "power_figure", "profile_figure", "write_figure"]

_HOMES = {
    "energy_figure": "planner.plots.flight",
    "map_figure": "planner.plots.site",
    "power_figure": "planner.plots.flight",
    "profile_figure": "planner.plots.flight",
    "write_figure": "planner.plots.files",
}


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name not in _HOMES:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOMES[name]), name)
