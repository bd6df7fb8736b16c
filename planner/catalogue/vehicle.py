"""Family V: the vehicle on the line."""

from __future__ import annotations

from planner.findings import Rule, Severity

CONDITIONS_FROM_VEHICLE = Rule(
    "V101 conditions-from-vehicle",
    Severity.INFO,
    summary="Charge, home and parameters are the vehicle's own.",
    why="The verdict holds for the vehicle as it is now: a battery that is changed or a home that is "
    "set anew make another check necessary.",
    how="Mission, fence, rally points, parameters, battery and home are read over MAVLink.",
    fix="give --charge, --home-amsl or --params to check with other values",
)

CHARGE_NOT_TOLD = Rule(
    "V102 charge-not-told",
    Severity.WARNING,
    summary="The vehicle does not say how full its battery is.",
    why="The check then counts on a full battery, which nobody has measured.",
    how="Neither BATTERY_STATUS nor SYS_STATUS holds a battery_remaining from 0 to 100.",
    fix="measure the battery and give --charge; set the battery's capacity in the autopilot",
)

HOME_NOT_TOLD = Rule(
    "V103 home-not-told",
    Severity.WARNING,
    summary="The vehicle has no home yet.",
    why="Heights above home and the way back are judged from the home of the mission's first place; "
    "the vehicle sets its own when it has a position fix, or when it is armed.",
    how="HOME_POSITION does not come, and ArduPilot's first mission item is at 0°, 0°.",
    fix="wait for a position fix and fetch again",
)

LIST_NOT_KEPT = Rule(
    "V104 list-not-kept",
    Severity.INFO,
    summary="The vehicle keeps no fence, or no rally points.",
    why="A fence that is not on the vehicle does not hold it.",
    how="The vehicle answers MISSION_REQUEST_LIST for this list with UNSUPPORTED.",
    fix="use a firmware that was built with them",
)

PARAMETER_NAMELESS = Rule(
    "V105 parameter-nameless",
    Severity.WARNING,
    summary="Parameters came under names that are none.",
    why="What they hold is not known, and no file can hold them.",
    how="A name has 1 to 16 capital letters, digits and underscores, and begins with a letter.",
    fix="fetch again; where it stays, something else than an autopilot answers",
)

FENCE_REMOVED = Rule(
    "V106 fence-removed",
    Severity.ERROR,
    summary="The vehicle has a fence, and the mission that is to be sent has none.",
    why="A mission is sent with its fence and rally points, as ground stations do: without one, the "
    "vehicle flies without its fence from then on.  Text files hold no fence beside a mission.",
    how="mavjoule upload compares what was read from the vehicle with the mission.",
    fix="give --keep-fence to leave it there, or --ignore V106 to have it removed",
)

RALLY_REMOVED = Rule(
    "V107 rally-removed",
    Severity.WARNING,
    summary="The vehicle has rally points, and the mission that is to be sent has none.",
    why="It returns home from then on, and not to the nearest of them.",
    how="mavjoule upload compares what was read from the vehicle with the mission.",
    fix="give --keep-fence to leave them there, or put them into the mission",
)

CAPACITY_NOT_TAKEN = Rule(
    "V108 capacity-not-taken",
    Severity.INFO,
    summary="The capacity that the vehicle counts from is not taken as the battery's.",
    why="BAT1_CAPACITY and BATT_CAPACITY are settings: the firmware's 3.3 Ah as often as the "
    "battery's, worn or not, and without a voltage no energy.",
    how="No battery is given, the model has none, and the parameter is above 0.",
    fix="give --battery with the label's figures, such as 5.2Ah@14.8V",
)

NO_RETURN_IN_FLIGHT = Rule(
    "V111 no-return-in-flight",
    Severity.ERROR,
    summary="The vehicle in flight cannot get home above the reserve.",
    why="Every second on the mission eats more of what the way home needs.",
    how="energy measured as left - way home by the model, times the measured over the modelled energy "
    "where that is above 1 - reserve < 0, and the rest of the mission is no shorter way to land.",
    fix="turn back now, or land at a rally point that is nearer",
)

RETURN_SOON_IN_FLIGHT = Rule(
    "V112 return-soon-in-flight",
    Severity.WARNING,
    summary="The point of no return is near, and the mission cannot be finished.",
    why="Beyond it the way home eats into the reserve.",
    how="The time until the margin of the way home reaches zero along the mission is 60 s or less.",
    fix="turn back before then",
)

SHORT_IN_FLIGHT = Rule(
    "V113 short-in-flight",
    Severity.ERROR,
    summary="The mission in flight ends below the reserve.",
    why="What was a go on the ground is none when wind, load or battery are not as they were told.",
    how="energy measured as left - rest of the mission by the model, times the measured over the "
    "modelled energy where that is above 1 - reserve < 0.",
    fix="end the mission earlier: skip items, or turn back",
)

MEASURES_DIFFER_IN_FLIGHT = Rule(
    "V114 measures-differ-in-flight",
    Severity.WARNING,
    summary="The measurements of the battery contradict each other.",
    why="Another battery flies than the one that was checked, or one of its measurements is wrong.",
    how="The energies left by charge count, energy count and percentage differ by more than 10 % of "
    "it.",
    fix="check with --battery as it is, and calibrate the power module",
)
