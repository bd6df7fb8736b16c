"""All pictures of a checked mission."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.plots.flight import altitude_panel, energy_panel, power_panel, speed_panel
from planner.plots.site import map_panel
from planner.plots.tables import make_tables, with_data

if TYPE_CHECKING:
    from planner.plots.library import Chart
    from planner.plots.tables import FlightTables
    from planner.service import CheckResult


def mission_figures(result: CheckResult) -> dict[str, Chart]:
    """Return every picture of a result by name; the tables behind them are made once.

    Parameters
    ----------
    result : CheckResult
        As `planner.check` returns it.

    Returns
    -------
    dict
        Altair charts: ``map``, ``altitude``, ``speed``, ``power`` and, where it is known, ``energy``.

    Raises
    ------
    UsageError
        If nothing is flown, or Altair is missing.
    """
    tables = make_tables(result)
    return {name: with_data(panel, tables) for name, panel in mission_panels(tables).items()}


def mission_panels(tables: FlightTables) -> dict[str, Chart]:
    """Return every picture of tables by name, without the rows."""
    panels = {
        "map": map_panel(tables),
        "altitude": altitude_panel(tables),
        "speed": speed_panel(tables),
        "power": power_panel(tables),
    }
    if tables.returns:
        panels["energy"] = energy_panel(tables)
    return panels
