"""Family A: altitudes and their references."""

from __future__ import annotations

from planner.findings import Rule, Severity

FRAME_NOT_RESOLVED = Rule(
    "A103 frame-not-resolved",
    Severity.ERROR,
    summary="An item's altitude reference cannot be resolved.",
    why="Every ground station has lost a frame once; crashes followed (QGroundControl #10596).",
    how="The item's frame is none of those resolved to a height above home.",
    fix="use altitudes relative to home or AMSL",
)

HOME_ALTITUDE_UNKNOWN = Rule(
    "A105 home-altitude-unknown",
    Severity.ERROR,
    summary="The altitude of home is not known but needed.",
    why="AMSL altitudes mean nothing for a flight that starts at an unknown height; a guess would be "
    "a wrong 'go': scripts write 15 m AMSL for places 600 m up.",
    how="The file gives no home altitude and --home-amsl is not given; 0 m AMSL is assumed.",
    fix="give the altitude of the take-off place with --home-amsl",
)

AMSL_SUSPECT = Rule(
    "A107 amsl-suspect",
    Severity.ERROR,
    summary="An altitude looks as if the other reference was meant, home or the sea.",
    why="Scripts, and Mission Planner before Copter 3.4 (#953), wrote heights above home in frame 0, "
    "which means AMSL: the vehicle would fly into the ground, or is refused.  The other way round it "
    "climbs by the altitude of home too high (MissionPlanner #1741, a crash).",
    how="An item in frame 0 or 5 is not above home's altitude, nor above the ground at its place "
    "where a terrain grid knows it: an error.  A warning where one in frame 3 or 6 is more than 500 m "
    "above home, or more than 150 m and up to 300 m above home's own altitude, home being more than 30 "
    "m AMSL.",
    fix="write the altitude relative to home (frame 3), or give the terrain with --terrain",
)

ZERO_TAKEOFF = Rule(
    "A106 zero-takeoff",
    Severity.ERROR,
    summary="The take-off altitude is not above home.",
    why="A take-off to zero is refused or flown to a height nobody chose (ArduPilot #33792).",
    how="The take-off item's altitude, resolved to a height above home, is 0 m or less.  PX4 refuses "
    "it, ArduPilot does not arm with it from 4.8 on.",
    fix="give the take-off item an altitude above home",
)

TERRAIN_ASSUMED_LEVEL = Rule(
    "A108 terrain-assumed-level",
    Severity.WARNING,
    summary="Altitudes above terrain are flown without knowing the terrain.",
    why="A height above ground in a terrain frame is an altitude only with a terrain grid.",
    how="Items in frame 10 or 11 and no terrain grid: the ground is taken to be level with home.",
    fix="give the terrain with --terrain",
)

ALTITUDE_UNKNOWN = Rule(
    "A109 altitude-unknown",
    Severity.ERROR,
    summary="An item has no altitude.",
    why="QGroundControl writes null where it has not yet worked out a height above terrain; such an "
    "item cannot be flown as it is.",
    how="The seventh parameter of an item the vehicle flies to is null or NaN.",
    fix="open the mission in the program that wrote it, wait for the terrain, and save it again",
)

ALTITUDE_FROM_TERRAIN = Rule(
    "A110 altitude-from-terrain",
    Severity.WARNING,
    summary="An altitude that the file leaves open was computed from the terrain grid.",
    why="QGroundControl writes null for an altitude above terrain that it has not worked out yet: the "
    "prediction can fly the height meant, the vehicle cannot.",
    how="AltitudeMode 3, the seventh parameter null: ground of --terrain plus 'Altitude'.",
    fix="open the mission in QGroundControl, wait for the terrain, and save it again",
)

ZERO_ALTITUDE = Rule(
    "A111 zero-altitude",
    Severity.WARNING,
    summary="An item the vehicle flies to has the altitude 0.",
    why="To ArduPilot 0 means 'as before', in any frame; PX4 flies to the level of home or of the "
    "sea.  The same file means two flights.",
    how="The altitude of an item in the air is 0, and it is not flown as ArduPilot would.",
    fix="write the altitude that is meant",
)

TERRAIN_NOT_FOLLOWED = Rule(
    "A112 terrain-not-followed",
    Severity.WARNING,
    summary="ArduPilot follows the ground between two items; a straight line is predicted.",
    why="Heights above terrain are kept all along a leg: over hills the vehicle climbs and descends "
    "more than its items say.  That it slows down where the ground rises faster than it can climb "
    "(AC_WPNav, WP_TER_MARGIN) is predicted for models flown by ArduPilot, what the climbs take is not.",
    how="Legs to items in a terrain frame, flown by ArduPilot over known ground (--terrain) that lies "
    "more than 2 m off the line between the ground at both ends.",
    fix="put items where the ground bends, so that the legs lie along it",
)

RETURN_OVER_TERRAIN = Rule(
    "A113 return-over-terrain",
    Severity.WARNING,
    summary="The vehicle returns at a height above terrain; one above home is predicted.",
    why="Over ground higher than home such a return climbs more and flies higher than predicted.",
    how="ArduPilot's RTL_ALT_TYPE is 1; RTL_ALT is counted from home.",
    fix="set RTL_ALT_TYPE to 0, or allow for the ground on the way home",
)
