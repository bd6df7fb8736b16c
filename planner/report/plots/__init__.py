"""Pictures of results, as Altair charts: for notebooks, files and the report alike.

Every function takes a result and returns a chart without a theme; `write_figure` writes it, dressed
for light or dark pages.  Without the libraries of ``mavjoule[report]``, Altair and vl-convert, they
raise ``UsageError``.
"""

from planner.report.plots.endurance import endurance_figures
from planner.report.plots.flight import (
    energy_figure,
    map_figure,
    mission_figures,
    power_figure,
    profile_figure,
)
from planner.report.plots.identification import (
    calibration_figure,
    identification_figures,
    verification_figure,
)
from planner.report.plots.picture_files import write_figure, write_figures
from planner.report.plots.speed import speed_figure
from planner.report.plots.split import split_energy_figure, split_map_figure

__all__ = [
    "calibration_figure",
    "endurance_figures",
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
