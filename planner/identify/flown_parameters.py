"""The autopilot's parameters as the logs hold them: those that predictions depend on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.catalogue.identification import PARAMETERS_DIFFER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.logs.record import FlightRecord

_NAMED = 5


def flown_parameters(
    records: Sequence[FlightRecord], autopilot: Autopilot
) -> tuple[tuple[tuple[str, float], ...], tuple[Finding, ...]]:
    """Return the parameters the flights have in common, of those a prediction depends on.

    Parameters
    ----------
    records : sequence of FlightRecord
        The flights.
    autopilot : Autopilot
        PX4 or ArduPilot.

    Returns
    -------
    parameters : tuple of (str, float)
        By their own names and in their own units.
    findings : tuple of Finding
        What differs from flight to flight, and is left to the parameter file of the day.
    """
    from planner.vehicle.parameters.resolve import PARAMETERS_OF
    from planner.vehicle.parameters.table import parameter_table

    common: list[tuple[str, float]] = []
    differing: list[str] = []
    for row in parameter_table(PARAMETERS_OF[autopilot]).values():
        for spelling in row.spellings:
            told = [r.parameters[spelling.name] for r in records if spelling.name in r.parameters]
            if not told or not row.is_possible(spelling.si(told[-1])):
                continue
            if len(set(told)) > 1:
                differing.append(spelling.name)
            elif len(told) == len(records):
                common.append((spelling.name, float(f"{float(np.float32(told[0])):.7g}")))
    if not differing:
        return tuple(common), ()
    more = f" and {len(differing) - _NAMED} more" if len(differing) > _NAMED else ""
    return tuple(common), (
        PARAMETERS_DIFFER.finding(
            "not the same in every flight, and left out of the model: "
            f"{', '.join(differing[:_NAMED])}{more}"
        ),
    )
