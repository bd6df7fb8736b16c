"""Family S: several vehicles in one airspace."""

from __future__ import annotations

from planner.findings import Rule, Severity

SEPARATION = Rule(
    "S101 separation",
    Severity.ERROR,
    summary="Two missions flown at the same time come too near to each other.",
    why="Checks that sample find no crossing between two samples, that end early none in the last "
    "quarter (EGO-Planner-v2 #60), that look at one time none at another (Swarm-Formation #35), and a "
    "vehicle that has landed is still there (EGO-Planner-v2 #65).",
    how="The closest approach of the predicted flights in continuous time, from the first take-off to "
    "the last landing, at every start within --start-error; who has not begun stands at the take-off "
    "place, who has ended where it ended.  Not while both are below --min-nav-alt over their take-off "
    "or landing places.  It is found to 1 cm; fires where it is more than that below --separation.  "
    "The delay told is tried by the same search.  What the times of a flight are uncertain by is for "
    "--start-error.",
    fix="start one of them later, or fly them at other heights or places",
)

DUPLICATE_SYSTEM_ID = Rule(
    "S102 duplicate-sysid",
    Severity.WARNING,
    summary="Two vehicles that fly at the same time have the same MAVLink system id.",
    why="Ground stations take them for one vehicle (QGroundControl #14812, #3321): what is commanded "
    "to the one may reach the other.",
    how="SYSID_THISMAV, MAV_SYSID or MAV_SYS_ID of different parameter files, in a check with "
    "--separation.",
    fix="give each vehicle its own system id",
)

SEPARATION_UNCHECKED = Rule(
    "S104 separation-unchecked",
    Severity.WARNING,
    summary="A part of the separation from other missions could not be checked.",
    why="A vehicle that was left out is in the air all the same.",
    how="--separation asks for it, and another mission could not be read or flies nothing, the flight "
    "never rises to --min-nav-alt, or the altitude of a home is not known (none, or 0) where homes are "
    "more than 1 m apart: heights are then compared above home.",
    fix="mend what is named, and check again",
)
