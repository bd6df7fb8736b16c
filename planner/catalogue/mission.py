"""Family M: the structure of a mission."""

from __future__ import annotations

from planner.findings import Rule, Severity

TAKEOFF_MISSING = Rule(
    "M101 takeoff-missing",
    Severity.WARNING,
    summary="The mission does not begin with a take-off.",
    why="The vehicle will not leave the ground by itself, or will do so in a way nobody planned.",
    how="The first item with a flight in it is not NAV_TAKEOFF; a climb to its height is assumed.  An "
    "error on PX4 where a take-off comes later: it refuses the mission.",
    fix="add a take-off item at the start",
)

LANDING_MISSING = Rule(
    "M102 land-missing",
    Severity.WARNING,
    summary="The mission does not end on the ground.",
    why="What happens behind the last item, a hover or a return, is not in the plan.",
    how="No LAND or RETURN_TO_LAUNCH is reached, so that the prediction ends at the last item, in the "
    "air; or ArduPilot's RTL_ALT_FINAL is above 0, so that its return does.",
    fix="end the mission with a return or a landing",
)

NOTHING_TO_FLY = Rule(
    "M108 nothing-to-fly",
    Severity.ERROR,
    summary="The mission holds no flight.",
    why="An empty mission is not a 'go'; most likely the wrong file was given.",
    how="No item before the first landing makes the vehicle move.",
    fix="check that this is the file you meant to fly",
)

HOME_UNKNOWN = Rule(
    "M107 home-unknown",
    Severity.WARNING,
    summary="The file does not say where home is.",
    why="The way to the first item and the way home depend on it.",
    how="No planned home; the first item with a position is taken as the take-off place.",
    fix="set the planned home position in the mission",
)

JUMP_TARGET = Rule(
    "M103 jump-target",
    Severity.ERROR,
    summary="A jump leads nowhere.",
    why="A jump to a missing item ends the mission or makes the autopilot refuse it; a jump to itself "
    "once skipped the whole mission (ArduPilot #28604).",
    how="The target of DO_JUMP or DO_JUMP_TAG is no item of the mission, or the jump itself.",
    fix="give the jump the id of an item before or behind it",
)

ZERO_POSITION = Rule(
    "M110 zero-position",
    Severity.WARNING,
    summary="An item lies at 0° north, 0° east, or has no position.",
    why="To ArduPilot this means 'here'; to PX4 it is a place in the Gulf of Guinea.  The same file "
    "means two flights.",
    how="Latitude and longitude of an item the vehicle flies to, or of a home that is set, are both "
    "zero.  Where PX4 flies this is an error: what is predicted is not its flight.",
    fix="give the item the place it should be flown to",
)

OTHER_VEHICLE = Rule(
    "M111 other-vehicle",
    Severity.ERROR,
    summary="The mission may be one for another kind of vehicle.",
    why="A fixed-wing or VTOL mission timed as a multicopter's is wrong in every leg (QGroundControl "
    "#7662); text files do not say what they were written for.",
    how="The vehicle type of the file, else what its commands tell: a take-off pitch of 5° to 45°, a "
    "landing approach, VTOL items, depths.  What is certain is refused; PX4's own checks of landing "
    "patterns, which are for such vehicles, are not repeated.  All 22 public text files that this "
    "fires on are of aircraft.",
    fix="check that this is the file you meant to fly; save it as a plan, which names its vehicle, or "
    "ignore the code where a multicopter flies it",
)

VALUE_STORED_OTHERWISE = Rule(
    "M113 value-stored-otherwise",
    Severity.INFO,
    summary="ArduPilot keeps a value of an item only roughly.",
    why="Its mission storage has 16 bits for it: what it flies is not what the file says.",
    how="Holds of whole seconds; at most 255 whole turns; radii of whole metres up to 255 m, of tens "
    "of metres up to 2550 m (AP_Mission).  What is kept is flown here.",
    fix="write a value that it can keep",
)

HEADING_NORTH = Rule(
    "M114 heading-north",
    Severity.INFO,
    summary="Waypoints ask PX4 for a heading of exactly 0°.",
    why="PX4 takes 0 in the fourth parameter for north, turns there and waits until it has; 'free' is "
    "null.  Text files and scripts write 0 and mean nothing by it.",
    how="NAV_WAYPOINT with a fourth parameter of exactly 0, flown as PX4 would.",
    fix="write null (nan in text) where the heading does not matter",
)

VEHICLE_ASSUMED = Rule(
    "M115 vehicle-assumed",
    Severity.INFO,
    summary="The file does not say for which kind of vehicle it was written.",
    why="QGC WPL text has no place for it, and an aircraft's mission is wrong in every leg.",
    how="No vehicle type is given; take-off pitch, landing approach, VTOL items, depths and the like "
    "are looked for and not found.",
    fix="save the mission as a plan, which names it",
)
