"""Family R, from R201: what stands between a recorded flight and its prediction."""

from __future__ import annotations

from planner.findings import Rule, Severity

MISSION_LEFT = Rule(
    "R201 mission-left",
    Severity.WARNING,
    summary="Part of a flight was not flown by its mission.",
    why="A pilot who takes over, or a failsafe in the middle of a mission, cannot be predicted from "
    "the mission: the errors of such a flight say nothing about the model.",
    how="The vehicle was in the air for more than 2 s in a mode that flies no mission; a return is "
    "part of a mission that asks for one.",
    fix="verify with flights that kept to their missions",
)

MISSION_UNTOLD = Rule(
    "R202 mission-untold",
    Severity.WARNING,
    summary="A log tells part of its mission only.",
    why="Items that are not logged may change speeds, wait or jump; the prediction lacks them.",
    how="PX4 logs the items with a place when it begins them; numbers left out in between are others, "
    "of which changes of speed are read from the speeds it then flies by.  ArduPilot before 4.0 logs "
    "no altitude frames; heights above home are assumed.",
    fix="give the mission with --mission",
)

ENERGY_IN_PART = Rule(
    "R203 energy-measured-in-part",
    Severity.WARNING,
    summary="Power was not measured throughout a flight.",
    why="The energy over a gap is a straight line between its ends, whatever was flown there.",
    how="Power is known for less than 95 % of the flight.",
    fix="compare energies of other flights",
)

CONDITIONS_ASSUMED = Rule(
    "R204 conditions-assumed",
    Severity.INFO,
    summary="A log does not tell the conditions of its flight.",
    why="Wind and density of the air change the power; an error may be theirs, not the model's.",
    how="The log holds no wind, or no altitude of home, and none was given.",
    fix="give --wind or --home-amsl",
)

FLIGHT_CUT = Rule(
    "R205 flight-cut",
    Severity.INFO,
    summary="Only part of the time armed is compared with the prediction.",
    why="Waiting on the ground before a mission, and what follows one that ends in the air, is none.",
    how="The flight begins where the mission begins if that is on the ground, and ends with it if the "
    "mission does not land; told from more than 2 s on.",
    fix="nothing",
)

MISSION_CHANGED = Rule(
    "R206 mission-changed",
    Severity.WARNING,
    summary="The mission was changed in flight.",
    why="Only one mission is predicted, the last; what was flown before may be another.",
    how="A log holds a mission from within the flight that differs from the one before.",
    fix="verify with flights whose mission stayed the same",
)

BEGUN_IN_AIR = Rule(
    "R207 mission-begun-in-air",
    Severity.WARNING,
    summary="A mission was begun in the air.",
    why="The prediction takes off from the ground: times and energies are not of the same flight.",
    how="The vehicle is in the air when the mode that flies missions is entered first.",
    fix="verify with flights whose mission takes off",
)
