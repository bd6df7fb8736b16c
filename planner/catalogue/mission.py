"""Family M: the structure of a mission."""

from __future__ import annotations

from planner.findings import Rule, Severity

TAKEOFF_MISSING = Rule(
    code="M101",
    name="takeoff-missing",
    severity=Severity.WARNING,
    summary="The mission does not begin with a take-off.",
    why="The vehicle will not leave the ground by itself, or will do so in a way nobody planned.",
    how=(
        "The first item with a flight in it is not NAV_TAKEOFF; a climb to its height is assumed.  "
        "An error on PX4 where a take-off comes later: it refuses the mission."
    ),
    example="the flight begins with NAV_WAYPOINT: a vertical take-off to 50 m is assumed",
    fix="add a take-off item at the start",
)

LANDING_MISSING = Rule(
    code="M102",
    name="land-missing",
    severity=Severity.WARNING,
    summary="The mission does not end on the ground.",
    why="What happens behind the last item, a hover or a return, is not in the plan.",
    how=(
        "No LAND or RETURN_TO_LAUNCH is reached, so that the prediction ends at the last item, in the "
        "air; or ArduPilot's RTL_ALT_FINAL is above 0, so that its return does."
    ),
    example="the mission ends in the air: the way home and the landing are not counted",
    fix="end the mission with a return or a landing",
)

NOTHING_TO_FLY = Rule(
    code="M108",
    name="nothing-to-fly",
    severity=Severity.ERROR,
    summary="The mission holds no flight.",
    why="An empty mission is not a 'go'; most likely the wrong file was given.",
    how="No item before the first landing makes the vehicle move.",
    example="no flight in 2 items",
    fix="check that this is the file you meant to fly",
)

HOME_UNKNOWN = Rule(
    code="M107",
    name="home-unknown",
    severity=Severity.WARNING,
    summary="The file does not say where home is.",
    why="The way to the first item and the way home depend on it.",
    how="No planned home; the first item with a position is taken as the take-off place.",
    example="the file does not say where home is: the flight is taken to start at the place of item 1",
    fix="set the planned home position in the mission",
)

AUTOPILOT_DIFFERS = Rule(
    code="M109",
    name="autopilot-differs",
    severity=Severity.INFO,
    summary="The mission was written for another autopilot than the model flies.",
    why="PX4 and ArduPilot fly the same items differently; so does a vehicle of step references.",
    how="The file's firmware type is compared with the way of commanding of the prediction.",
    example="the file was written for PX4; the prediction is flown as ArduPilot would",
    fix="choose with --vehicle the model of the vehicle that will fly",
)

JUMP_TARGET = Rule(
    code="M103",
    name="jump-target",
    severity=Severity.ERROR,
    summary="A jump leads nowhere.",
    why=(
        "A jump to a missing item ends the mission or makes the autopilot refuse it; a jump to "
        "itself once skipped the whole mission (ArduPilot #28604)."
    ),
    how="The target of DO_JUMP or DO_JUMP_TAG is no item of the mission, or the jump itself.",
    example="DO_JUMP: there is no item 12; the flight is taken to go on",
    fix="give the jump the id of an item before or behind it",
)

COMMAND_UNSUPPORTED = Rule(
    code="M105",
    name="unsupported-command",
    severity=Severity.ERROR,
    summary="The autopilot refuses or skips an item.",
    why=(
        "PX4 refuses the whole mission for one item it does not know; ArduPilot skips such items "
        "in flight.  Upload tools report success all the same (MAVSDK #2103)."
    ),
    how=(
        "The command, and for PX4 its frame (0, 3, 5 and 6 for places, 2 for what has none), "
        "against what the autopilot's source accepts, in the version of --target."
    ),
    example="PX4 refuses NAV_SPLINE_WAYPOINT at upload, and the whole mission with it",
    fix="use commands the autopilot flies",
)

ZERO_POSITION = Rule(
    code="M110",
    name="zero-position",
    severity=Severity.WARNING,
    summary="An item lies at 0° north, 0° east, or has no position.",
    why=(
        "To ArduPilot this means 'here'; to PX4 it is a place in the Gulf of Guinea.  The same file "
        "means two flights."
    ),
    how=(
        "Latitude and longitude of an item the vehicle flies to, or of a home that is set, are both zero.  "
        "Where PX4 flies this is an error: what is predicted is not its flight."
    ),
    example="NAV_LAND at 0°, 0°: PX4 takes this for a place; taken as 'here'",
    fix="give the item the place it should be flown to",
)

OTHER_VEHICLE = Rule(
    code="M111",
    name="other-vehicle",
    severity=Severity.ERROR,
    summary="The mission may be one for another kind of vehicle.",
    why=(
        "A fixed-wing or VTOL mission timed as a multicopter's is wrong in every leg "
        "(QGroundControl #7662); text files do not say what they were written for."
    ),
    how=(
        "The vehicle type of the file, else what its commands tell: a take-off pitch of 5° to 45°, a "
        "landing approach, VTOL items, depths.  What is certain is refused; PX4's own checks of landing "
        "patterns, which are for such vehicles, are not repeated.  All 22 public text files that this "
        "fires on are of aircraft."
    ),
    example=(
        "this may be a fixed-wing mission (item 1 takes off with a pitch of 15°); it is predicted "
        "as a multicopter's"
    ),
    fix="check that this is the file you meant to fly; save it as a plan, which names its vehicle, or "
    "ignore the code where a multicopter flies it",
)

VALUE_NOT_SET = Rule(
    code="M112",
    name="value-not-set",
    severity=Severity.WARNING,
    summary="ArduPilot refuses items with a parameter that is not a number.",
    why=(
        "QGroundControl sends null as NaN.  PX4 reads it as 'not specified', ArduPilot refuses the "
        "item and with it the upload."
    ),
    how=(
        "Parameters 1 to 4 and the altitude of every item; only a heading may be unset, in "
        "NAV_WAYPOINT, LOITER_UNLIM, LAND, TAKEOFF, ARC_WAYPOINT, VTOL_TAKEOFF and VTOL_LAND."
    ),
    example="ArduPilot refuses NAV_DELAY with parameter 2 not set (and 3 more)",
    fix="write 0 for it",
)

VALUE_STORED_OTHERWISE = Rule(
    code="M113",
    name="value-stored-otherwise",
    severity=Severity.INFO,
    summary="ArduPilot keeps a value of an item only roughly.",
    why="Its mission storage has 16 bits for it: what it flies is not what the file says.",
    how=(
        "Holds of whole seconds; at most 255 whole turns; radii of whole metres up to 255 m, of "
        "tens of metres up to 2550 m (AP_Mission).  What is kept is flown here."
    ),
    example="NAV_WAYPOINT: ArduPilot keeps a hold of 2.5 s as 2 s",
    fix="write a value that it can keep",
)

HEADING_NORTH = Rule(
    code="M114",
    name="heading-north",
    severity=Severity.INFO,
    summary="Waypoints ask PX4 for a heading of exactly 0°.",
    why=(
        "PX4 takes 0 in the fourth parameter for north, turns there and waits until it has; "
        "'free' is null.  Text files and scripts write 0 and mean nothing by it."
    ),
    how="NAV_WAYPOINT with a fourth parameter of exactly 0, flown as PX4 would.",
    example="NAV_WAYPOINT asks for heading 0°: PX4 turns north before it goes on (and 11 more)",
    fix="write null (nan in text) where the heading does not matter",
)

VEHICLE_ASSUMED = Rule(
    code="M115",
    name="vehicle-assumed",
    severity=Severity.INFO,
    summary="The file does not say for which kind of vehicle it was written.",
    why="QGC WPL text has no place for it, and an aircraft's mission is wrong in every leg.",
    how=(
        "No vehicle type is given; take-off pitch, landing approach, VTOL items, depths and the "
        "like are looked for and not found."
    ),
    example="the file does not name a vehicle: nothing in it speaks against a multicopter",
    fix="save the mission as a plan, which names it",
)

JUMP_WITHOUT_FLIGHT = Rule(
    code="M121",
    name="jump-without-flight",
    severity=Severity.ERROR,
    summary="An endless jump leads round without a place to fly to.",
    why="The autopilot goes round such a loop and never finds what to fly next (ArduPilot #4701).",
    how="No item between the target of an endless jump and the jump is a flight or a wait.",
    example="jumps back for ever, and nothing on the way round is flown: the mission never goes on",
    fix="put a waypoint or a wait into the loop, or give the jump a count",
)

LANDING_ALTITUDE = Rule(
    code="M120",
    name="landing-altitude",
    severity=Severity.WARNING,
    summary="A landing names an altitude that is not that of home.",
    why=(
        "Multicopters land where the ground is and ignore it; other vehicles and other programs do "
        "not.  ArduPilot's users ask for it and ask to be able to turn it off (#4701)."
    ),
    how="NAV_LAND in a frame above home with an altitude that is not 0.",
    example="lands at an altitude of 12 m above home",
    fix="write 0, where the ground is level with home",
    is_default=False,
)

HOME_FAR = Rule(
    code="M124",
    name="home-far",
    severity=Severity.WARNING,
    summary="Home is nowhere near the mission.",
    why=(
        "The planned home was left from another site, and the way there is counted in silence: surveys "
        "of hundreds of kilometres come of it (MissionPlanner #1947)."
    ),
    how=(
        "Distance from home to the nearest place of the mission, take-off and return not counted: "
        "10 km or more, an error from 100 km on.  On PX4 M104 tells of less."
    ),
    example="home is 12040 km from the nearest place of the mission: the way there is counted",
    fix="set the planned home to the place of take-off",
)
