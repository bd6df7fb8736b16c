"""Family L, from L201: what a mission loses on the way into another file."""

from __future__ import annotations

from planner.findings import Rule, Severity

AREAS_NOT_WRITTEN = Rule(
    "L201 areas-not-written",
    Severity.WARNING,
    summary="The fence or the rally points are not in the written file.",
    why="A QGC WPL file is one list of items.  Fence and rally rows among the items of a mission make "
    "an autopilot refuse the upload, so a mission in this format flies without them unless they are "
    "loaded from elsewhere.",
    how="Text is written without fence and rally points wherever there are items to fly.",
    fix="write a .plan, or load fence and rally points from a file of their own",
)

COMPLEX_ITEMS_WRITTEN_OUT = Rule(
    "L202 complex-items-written-out",
    Severity.INFO,
    summary="Surveys and other complex items are written as the items they stand for.",
    why="The same is flown, but the area can no longer be edited as one.",
    how="Counts the complex items that the file held and the written one does not.",
    fix="keep the plan to edit it",
)

COMPLEX_ITEM_NOT_WRITTEN = Rule(
    "L203 complex-item-not-written",
    Severity.ERROR,
    summary="A complex item that cannot be expanded is not in the written file.",
    why="Part of the mission is missing from the file, and nothing in it shows that.",
    how="Counts the complex items that stand for no items and that the written file does not hold.",
    fix="open the plan in QGroundControl, save it, and convert what it saved",
)

KEYS_NOT_WRITTEN = Rule(
    "L204 keys-not-written",
    Severity.INFO,
    summary="Text has no room for some of what a plan says.",
    why="QGC WPL text names no firmware and no kind of vehicle, so a check of it cannot tell that the "
    "mission was meant for another one.",
    how="Lists the keys at the top of the plan and of its mission that have no counterpart.",
    fix="name the autopilot when you check the text, as with --autopilot px4",
)

HOME_NOT_KNOWN = Rule(
    "L205 home-not-known",
    Severity.INFO,
    summary="The home row says less than it seems to.",
    why="The first row of a QGC WPL file has to be home, with numbers.  Autopilots replace it with "
    "their own home, but ground stations show it and judge AMSL altitudes by it.",
    how="An unknown home is written as 0, 0 as Mission Planner does; where only its altitude is not "
    "known, as 0 m above itself.",
    fix="set the planned home in a ground station",
)

COMMENTS_NOT_WRITTEN = Rule(
    "L206 comments-not-written",
    Severity.INFO,
    summary="The comments of a text file are not in the written file.",
    why="JSON has no comments, and QGroundControl refuses text with any.",
    how="Counts lines that begin with '#' or '//' and rows with '#' behind them.",
    fix="keep the file they stand in",
)

WRITTEN_DIFFERENTLY = Rule(
    "L207 written-differently",
    Severity.ERROR,
    summary="The written file does not say the same as the mission.",
    why="It would not be flown as the one that was checked.",
    how="What is written is read back and compared value by value: items with their jumps, home, "
    "fence, rally points.",
    fix="write the other format, and do not fly this file",
)

JUMP_NOT_WRITTEN = Rule(
    "L208 jump-not-written",
    Severity.WARNING,
    summary="A jump leads to an item that is not there.",
    why="QGroundControl refuses a plan with such a jump; ArduPilot ends the mission at it.",
    how="The target of DO_JUMP is compared with the numbers of the items.",
    fix="give the jump the number of an item",
)

LOOPS_WRITTEN_OUT = Rule(
    "L209 loops-written-out",
    Severity.INFO,
    summary="The parts of a split mission hold the items of its loops one after the other.",
    why="A part begins or ends inside a loop, where a jump would lead to what it does not hold.",
    how="DO_JUMP and DO_JUMP_TAG are followed in flown order and left out.",
    fix="nothing: the flight is the same",
)

PART_FLOWN_TWICE = Rule(
    "L210 part-flown-twice",
    Severity.INFO,
    summary="Parts of a split mission begin before the one before ended, so that no photo is missing.",
    why="A trigger by distance begins to count anew where a flight is taken up, and a waypoint counts "
    "as reached some metres before it.",
    how="The way between two photos and 10 m, wherever a camera is triggered at the cut.",
    fix="nothing, or leave out the photos that are there twice",
)

RETURN_ADDED = Rule(
    "L211 return-added",
    Severity.WARNING,
    summary="The last part of a split mission ends with a return that the mission does not have.",
    why="A part is a go only where it is known how it ends on the ground.",
    how="NAV_RETURN_TO_LAUNCH is added where the mission ends in the air.",
    fix="end the mission with a return or a landing of your own",
)

OUTPUTS_SET_AGAIN = Rule(
    "L212 outputs-set-again",
    Severity.WARNING,
    summary="Servos, relays and the like are set again where a part of a split mission begins.",
    why="What hangs on an output is not in the file: a pump has to run again, but a hook that let a "
    "load go would let go the next one too.",
    how="The last setting of each output before the place where a part is taken up is sent there "
    "again.",
    fix="look at the outputs of each part, and take out what must not be done again",
)
