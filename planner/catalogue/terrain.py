"""Family A: heights over the ground of a terrain grid.

Apart from the rest of the family, because only a check with ``--terrain`` needs them.
"""

from __future__ import annotations

from planner.findings import Rule, Severity

BELOW_TERRAIN = Rule(
    code="A102",
    name="below-terrain",
    severity=Severity.ERROR,
    summary="The flight meets the ground, or comes nearer to it than asked for.",
    why=(
        "Waypoints above the ground do not keep the way between them above a ridge; height above "
        "ground is asked for again and again (MissionPlanner #706, QGroundControl #4007)."
    ),
    how=(
        "Height of the predicted flight minus the ground of --terrain, in steps of half a cell along "
        "the whole flight without take-off and landing; fires below --clearance, which is 0 m.  "
        "Without --terrain the ground is level with home, and places more than 1 m under it fire.  Legs "
        "that follow terrain on ArduPilot are not judged."
    ),
    example="12 m below the ground, 340 m before item 5; 210 m of the way are too low",
    fix="fly higher there, or put a waypoint before the ridge",
)

RETURN_BELOW_TERRAIN = Rule(
    code="A104",
    name="rtl-below-terrain",
    severity=Severity.ERROR,
    summary="The vehicle's own return would meet the ground.",
    why=(
        "The height of a return counts from home and knows no hills: vehicles flew into what stood "
        "between (QGroundControl #5524, ArduPilot #12170, PX4 #20003)."
    ),
    how=(
        "From places along the flight to where the vehicle itself would return, home or a rally point "
        "or by the mission, at the height it returns at: PX4 the higher of its own and RTL_RETURN_ALT "
        "over that place, below it inside RTL_MIN_DIST; ArduPilot the higher of its own and RTL_ALT, in "
        "its cone; against --terrain plus --clearance.  Not asked where RTL_ALT_TYPE follows terrain."
    ),
    example="a return from here at 30 m above home is 45 m below the ground, 800 m from home",
    fix="raise RTL_RETURN_ALT (PX4) or RTL_ALT (ArduPilot) above the highest ground, or go round",
)

GROUND_CLEARANCE = Rule(
    code="A116",
    name="ground-clearance",
    severity=Severity.INFO,
    summary="The least and the greatest height over the ground.",
    why="Limits of the law count from the ground, not from home (MissionPlanner #706).",
    how="As for A102; what of the way lies outside of the grid is said.",
    example="23 m over the ground at item 7 to 118 m at item 3",
    fix="",
)
