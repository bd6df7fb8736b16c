"""Family T: time, and items whose effect is not or not exactly known."""

from __future__ import annotations

from planner.findings import Rule, Severity

ENDLESS = Rule(
    "T101 endless-jump",
    Severity.ERROR,
    summary="The mission never ends: an endless jump or an unlimited loiter.",
    why="Time and energy of an endless mission have no value; only those of one lap have.",
    how="A DO_JUMP with an endless count, or LOITER_UNLIM, is reached in flown order.",
    fix="give the jump a count, or end the mission with a return or a landing",
)

ITEM_NOT_MODELLED = Rule(
    "T102 item-not-modelled",
    Severity.WARNING,
    summary="An item's effect on time and energy is not predicted.",
    why="Planners that count such items as nothing do so in silence (QGroundControl #6445 asks at "
    "least for a warning).",
    how="The command is not among those whose flight is predicted; the message says what is assumed.  "
    "An error where the vehicle may fly elsewhere, wait or stop for it: arcs, scripts, parachutes, "
    "commands that are not known; where reference steps fly a climb or descent faster on average than "
    "DO_CHANGE_SPEED allows; where they fly a spline straight and there is a fence or a terrain.",
    fix="allow for the item yourself, or replace it by one that is modelled",
)

ITEMS_NOT_FLOWN = Rule(
    "T104 items-not-flown",
    Severity.INFO,
    summary="Items after the landing or return are not flown.",
    why="What stands behind the end of a mission is reached by a jump or a failsafe only, or never.",
    how="Items behind the first LAND or RETURN_TO_LAUNCH in flown order are left out.  An error where "
    "a take-off is among them: a vehicle that goes on after the landing (ArduPilot's MIS_OPTIONS), or "
    "is started again, flies what is not counted.",
    fix="move the items before the landing, or delete them",
)

JUMPS_TOO_LONG = Rule(
    "T106 jumps-too-long",
    Severity.ERROR,
    summary="The jumps of the mission lead past too many items to predict.",
    why="A count mistaken by a digit makes a mission of days; it is said, not waited for.",
    how="Items are followed in flown order, up to 20,000 more than there are in the file.",
    fix="give the jumps smaller counts",
)

WAIT_NOT_COUNTED = Rule(
    "T107 wait-not-counted",
    Severity.WARNING,
    summary="A wait whose length is not in the file is not counted.",
    why="A wait until a time of day lasts as long as the clock says (QGroundControl counts -1 s for "
    "it); a wait on the ground before the take-off costs next to nothing.",
    how="NAV_DELAY with a time of day (an error in the air), or before the take-off; ArduPilot's "
    "return where RTL_LOIT_TIME is shorter than half a turn at ATC_RATE_WPY_MAX (ModeRTL, which waits "
    "for the heading it was armed with).",
    fix="use a delay in seconds, or allow for the wait yourself",
)

NOISE_ASSUMED = Rule(
    "T109 position-noise-assumed",
    Severity.INFO,
    summary="How noisy the vehicle's position is was taken from its model.",
    why="PX4 slows its trajectory down while the vehicle is off it: flights of one vehicle took up to "
    "6 % longer with a noisy position than with a quiet one, and wandered 0.2 m/s in a hover.",
    how="With e the mean horizontal error in a hover, E = MPC_XY_ERR_MAX and P = MPC_XY_P time passes "
    "by e/2E more slowly in climbs and descents, by (e/2E)/(1 + v/v0), v0 = 2PE/π, at a speed v, and "
    "by e/E in a landing once it stands over its place at home; speeding up behind a turn takes up to "
    "0.1 s ln((PE + v2)/(PE + v1)) longer.  The distance holds 0.7 P e a second of wandering "
    "(totals.wander_m).",
    fix="give the mean position error of a hover from a log of the vehicle with --position-noise",
)

SETTING_NOT_FOLLOWED = Rule(
    "T110 setting-not-followed",
    Severity.WARNING,
    summary="A setting of the vehicle makes it fly other than predicted.",
    why="A return that stays in the air, or leads elsewhere, takes other time and energy than "
    "predicted.",
    how="PX4's RTL_LAND_DELAY or COM_DISARM_LAND is negative, or RTL_TYPE above 5.  An error where "
    "RTL_TYPE 1 to 4 leads along items that jump: the returns of PX4 1.16 do not count the jumps they "
    "take (MissionBase::getNextPositionItems), and go round without end.",
    fix="set the parameter so that the vehicle returns and lands as predicted, or allow for it "
    "yourself",
)

WAITS_FOR_EVER = Rule(
    "T108 waits-for-ever",
    Severity.ERROR,
    summary="The vehicle waits at an item until somebody tells it to go on.",
    why="With autoContinue off PX4 holds at the item; ArduPilot goes on.  At NAV_GUIDED_ENABLE "
    "ArduPilot waits for a companion computer.",
    how="An item with autoContinue off is reached in flown order on PX4, or NAV_GUIDED_ENABLE on "
    "ArduPilot.  A warning where it is not known which of them flies.",
    fix="set autoContinue, unless a pilot will continue the mission",
)

SPEED_REPLACED = Rule(
    "T111 speed-replaced",
    Severity.WARNING,
    summary="The flight is predicted at another speed than the mission commands.",
    why="The verdict is that of a mission which is not in the file: flown as it is, it may be another.",
    how="A speed is given that some leg of the mission is not flown at.",
    fix="write the mission with this speed (mavjoule convert --speed) and check that file",
)

RETURN_HEIGHT_ASSUMED = Rule(
    "T112 return-height-assumed",
    Severity.INFO,
    summary="A return is flown at the height it begins at: nothing says how high the vehicle returns.",
    why="Autopilots climb to a height of their own before they return; a climb that is not counted "
    "takes energy that is not there.",
    how="The mission ends in RETURN_TO_LAUNCH and the model answers steps of the reference: it has no "
    "RTL_RETURN_ALT or RTL_ALT, and ways home from anywhere are flown level as well.",
    fix="put a waypoint at the height of the return before it, or use a model of an autopilot",
)

RETURN_LANDS_HERE = Rule(
    "T113 return-lands-here",
    Severity.WARNING,
    summary="A return of the vehicle lands wherever it is at that moment.",
    why="Its failsafes would bring it down in the water, in the trees or among people.",
    how="PX4's RTL_TYPE is 5, which knows rally points alone, and there are none (rtl.cpp).",
    fix="put a rally point into the mission, or set RTL_TYPE to 0",
)
