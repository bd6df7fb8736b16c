"""Family E: energy, battery, and how far the prediction can be trusted."""

from __future__ import annotations

from planner.findings import Rule, Severity

CONDITION_NOT_MODELLED = Rule(
    "E108 condition-not-modelled",
    Severity.WARNING,
    summary="A condition was given that this vehicle model cannot take into account.",
    why="Users test an estimator by changing payload or wind and watching the answer (bluerobotics "
    "cockpit #2159).  Where the answer cannot change, it has to be said.",
    how="Wind needs a model whose power depends on airspeed, payload needs a mass, temperature needs "
    "a hover law over air density; the age and temperature of a battery need its resistance and "
    "curves.  A payload that is not counted is an error, as is a wind above 0.6 of the highest "
    "identified speed and air 1.2 times thinner than at sea level: the flight takes more than is said. "
    " Of a parameter file reference steps use the fence alone; one whose autopilot is not known is an "
    "error where it holds a fence.",
    fix="use a vehicle model that carries the missing quantity",
)
