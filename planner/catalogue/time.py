"""Family T: time, and items whose effect is not or not exactly known."""

from __future__ import annotations

from planner.findings import Rule, Severity

ENDLESS = Rule(
    code="T101",
    name="endless-jump",
    severity=Severity.ERROR,
    summary="The mission never ends: an endless jump or an unlimited loiter.",
    why="Time and energy of an endless mission have no value; only those of one lap have.",
    how="A DO_JUMP with an endless count, or LOITER_UNLIM, is reached in flown order.",
    example=(
        "jumps back for ever: one lap takes 3 min 10 s and 7.20 Wh; the totals hold the way to it "
        "and one more lap"
    ),
    fix="give the jump a count, or end the mission with a return or a landing",
)

ITEM_NOT_MODELLED = Rule(
    code="T102",
    name="item-not-modelled",
    severity=Severity.WARNING,
    summary="An item's effect on time and energy is not predicted.",
    why=(
        "Planners that count such items as nothing do so in silence (QGroundControl #6445 asks at "
        "least for a warning)."
    ),
    how=(
        "The command is not among those whose flight is predicted; the message says what is assumed.  An "
        "error where the vehicle may fly elsewhere, wait or stop for it: arcs, scripts, parachutes, "
        "commands that are not known; where reference steps fly a climb or descent faster on average than "
        "DO_CHANGE_SPEED allows; where they fly a spline straight and there is a fence or a terrain."
    ),
    example=(
        "NAV_PAYLOAD_PLACE: the load is taken to touch the ground at home's level and to weigh "
        "nothing"
    ),
    fix="allow for the item yourself, or replace it by one that is modelled",
)

ITEMS_NOT_FLOWN = Rule(
    code="T104",
    name="items-not-flown",
    severity=Severity.INFO,
    summary="Items after the landing or return are not flown.",
    why="What stands behind the end of a mission is reached by a jump or a failsafe only, or never.",
    how=(
        "Items behind the first LAND or RETURN_TO_LAUNCH in flown order are left out.  An error where a "
        "take-off is among them: a vehicle that goes on after the landing (ArduPilot's MIS_OPTIONS), or is "
        "started again, flies what is not counted."
    ),
    example="4 items from 9 on behind the end of the flight at item 8: not flown",
    fix="move the items before the landing, or delete them",
)

JUMPS_TOO_LONG = Rule(
    code="T106",
    name="jumps-too-long",
    severity=Severity.ERROR,
    summary="The jumps of the mission lead past too many items to predict.",
    why="A count mistaken by a digit makes a mission of days; it is said, not waited for.",
    how="Items are followed in flown order, up to 20,000 more than there are in the file.",
    example=(
        "the jumps lead past more than 20,000 items again: the prediction ends there, the mission "
        "goes on"
    ),
    fix="give the jumps smaller counts",
)

WAIT_NOT_COUNTED = Rule(
    code="T107",
    name="wait-not-counted",
    severity=Severity.WARNING,
    summary="A wait whose length is not in the file is not counted.",
    why=(
        "A wait until a time of day lasts as long as the clock says (QGroundControl counts -1 s for "
        "it); a wait on the ground before the take-off costs next to nothing."
    ),
    how=(
        "NAV_DELAY with a time of day (an error in the air), or before the take-off; ArduPilot's return "
        "where RTL_LOIT_TIME is shorter than half a turn at ATC_RATE_WPY_MAX (ModeRTL, which waits for the "
        "heading it was armed with)."
    ),
    example="waits in the air until 14:30:00 UTC: not counted",
    fix="use a delay in seconds, or allow for the wait yourself",
)

NOISE_ASSUMED = Rule(
    code="T109",
    name="position-noise-assumed",
    severity=Severity.INFO,
    summary="How noisy the vehicle's position is was taken from its model.",
    why=(
        "PX4 slows its trajectory down while the vehicle is off it: flights of one vehicle took up to "
        "6 % longer with a noisy position than with a quiet one, and wandered 0.2 m/s in a hover."
    ),
    how=(
        "With e the mean horizontal error in a hover, E = MPC_XY_ERR_MAX and P = MPC_XY_P time passes "
        "by e/2E more slowly in climbs and descents, by (e/2E)/(1 + v/v0), v0 = 2PE/π, at a speed v, and by "
        "e/E in a landing once it stands over its place at home; speeding up behind a turn takes up to "
        "0.1 s ln((PE + v2)/(PE + v1)) longer.  The distance holds 0.7 P e a second of wandering "
        "(totals.wander_m)."
    ),
    example="a position noise of 0.31 m is taken from px4-sih-quad: PX4 slows down for it and wanders",
    fix="give the mean position error of a hover from a log of the vehicle with --position-noise",
)

SETTING_NOT_FOLLOWED = Rule(
    code="T110",
    name="setting-not-followed",
    severity=Severity.WARNING,
    summary="A setting of the vehicle makes it fly other than predicted.",
    why="A return that stays in the air, or leads elsewhere, takes other time and energy than predicted.",
    how=(
        "PX4's RTL_LAND_DELAY or COM_DISARM_LAND is negative, or RTL_TYPE above 5.  An error where "
        "RTL_TYPE 1 to 4 leads along items that jump: the returns of PX4 1.16 do not count the jumps "
        "they take (MissionBase::getNextPositionItems), and go round without end."
    ),
    example="RTL_LAND_DELAY -1 s keeps the vehicle over home: time and energy end with its arrival there",
    fix="set the parameter so that the vehicle returns and lands as predicted, or allow for it yourself",
)

WAITS_FOR_EVER = Rule(
    code="T108",
    name="waits-for-ever",
    severity=Severity.ERROR,
    summary="The vehicle waits at an item until somebody tells it to go on.",
    why=(
        "With autoContinue off PX4 holds at the item; ArduPilot goes on.  At NAV_GUIDED_ENABLE "
        "ArduPilot waits for a companion computer."
    ),
    how=(
        "An item with autoContinue off is reached in flown order on PX4, or NAV_GUIDED_ENABLE on "
        "ArduPilot.  A warning where it is not known which of them flies."
    ),
    example="autoContinue is off: PX4 holds here; the flight is taken to go on",
    fix="set autoContinue, unless a pilot will continue the mission",
)

SPEED_CLAMPED = Rule(
    code="T103",
    name="speed-clamped",
    severity=Severity.WARNING,
    summary="A commanded speed is beyond the vehicle's limit and is not flown.",
    why=(
        "The autopilot says nothing and takes longer than planned (PX4 #11764, #18598, ArduPilot "
        "#7741)."
    ),
    how=(
        "DO_CHANGE_SPEED against MPC_XY_VEL_MAX on PX4.  ArduPilot flies what is commanded down to "
        "0.1 m/s, and as fast as its lean angle allows (W102)."
    ),
    example="15.0 m/s is commanded, MPC_XY_VEL_MAX allows 12.0 m/s: 12.0 m/s is flown",
    fix="command a speed within the limit, or raise the limit on the vehicle",
)

SPEED_REPLACED = Rule(
    code="T111",
    name="speed-replaced",
    severity=Severity.WARNING,
    summary="The flight is predicted at another speed than the mission commands.",
    why="The verdict is that of a mission which is not in the file: flown as it is, it may be another.",
    how="A speed is given that some leg of the mission is not flown at.",
    example="every level leg is flown at 6.0 m/s as asked: the file does not command that",
    fix="write the mission with this speed (mavjoule convert --speed) and check that file",
)

RETURN_HEIGHT_ASSUMED = Rule(
    code="T112",
    name="return-height-assumed",
    severity=Severity.INFO,
    summary="A return is flown at the height it begins at: nothing says how high the vehicle returns.",
    why=(
        "Autopilots climb to a height of their own before they return; a climb that is not counted "
        "takes energy that is not there."
    ),
    how=(
        "The mission ends in RETURN_TO_LAUNCH and the model answers steps of the reference: it has no "
        "RTL_RETURN_ALT or RTL_ALT, and ways home from anywhere are flown level as well."
    ),
    example="the return is flown level, 40 m above home: the vehicle has no return height of its own",
    fix="put a waypoint at the height of the return before it, or use a model of an autopilot",
)

RETURN_LANDS_HERE = Rule(
    code="T113",
    name="return-lands-here",
    severity=Severity.WARNING,
    summary="A return of the vehicle lands wherever it is at that moment.",
    why="Its failsafes would bring it down in the water, in the trees or among people.",
    how="PX4's RTL_TYPE is 5, which knows rally points alone, and there are none (rtl.cpp).",
    example="RTL_TYPE is 5 and there is no rally point: a return lands where the vehicle is",
    fix="put a rally point into the mission, or set RTL_TYPE to 0",
)
