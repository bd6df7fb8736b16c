"""Family V: the vehicle on the line."""

from __future__ import annotations

from planner.findings import Rule, Severity

CONDITIONS_FROM_VEHICLE = Rule(
    code="V101",
    name="conditions-from-vehicle",
    severity=Severity.INFO,
    summary="Charge, home and parameters are the vehicle's own.",
    why=(
        "The verdict holds for the vehicle as it is now: a battery that is changed or a home that is "
        "set anew make another check necessary."
    ),
    how="Mission, fence, rally points, parameters, battery and home are read over MAVLink.",
    example="taken from PX4 1.16.0 (system 1): charge 87 %, home 488.0 m AMSL, 912 parameters",
    fix="give --charge, --home-amsl or --params to check with other values",
)

CHARGE_NOT_TOLD = Rule(
    code="V102",
    name="charge-not-told",
    severity=Severity.WARNING,
    summary="The vehicle does not say how full its battery is.",
    why="The check then counts on a full battery, which nobody has measured.",
    how="Neither BATTERY_STATUS nor SYS_STATUS holds a battery_remaining from 0 to 100.",
    example="the vehicle does not tell its charge: a full battery is assumed",
    fix="measure the battery and give --charge; set the battery's capacity in the autopilot",
)

HOME_NOT_TOLD = Rule(
    code="V103",
    name="home-not-told",
    severity=Severity.WARNING,
    summary="The vehicle has no home yet.",
    why=(
        "Heights above home and the way back are judged from the home of the mission's first place; "
        "the vehicle sets its own when it has a position fix, or when it is armed."
    ),
    how="HOME_POSITION does not come, and ArduPilot's first mission item is at 0°, 0°.",
    example="the vehicle has no home yet",
    fix="wait for a position fix and fetch again",
)

LIST_NOT_KEPT = Rule(
    code="V104",
    name="list-not-kept",
    severity=Severity.INFO,
    summary="The vehicle keeps no fence, or no rally points.",
    why="A fence that is not on the vehicle does not hold it.",
    how="The vehicle answers MISSION_REQUEST_LIST for this list with UNSUPPORTED.",
    example="the vehicle keeps no rally points: its firmware was built without such a list",
    fix="use a firmware that was built with them",
)

PARAMETER_NAMELESS = Rule(
    code="V105",
    name="parameter-nameless",
    severity=Severity.WARNING,
    summary="Parameters came under names that are none.",
    why="What they hold is not known, and no file can hold them.",
    how="A name has 1 to 16 capital letters, digits and underscores, and begins with a letter.",
    example="left out, for it has no readable name: 2 parameters",
    fix="fetch again; where it stays, something else than an autopilot answers",
)

FENCE_REMOVED = Rule(
    code="V106",
    name="fence-removed",
    severity=Severity.ERROR,
    summary="The vehicle has a fence, and the mission that is to be sent has none.",
    why=(
        "A mission is sent with its fence and rally points, as ground stations do: without one, the "
        "vehicle flies without its fence from then on.  Text files hold no fence beside a mission."
    ),
    how="mavjoule upload compares what was read from the vehicle with the mission.",
    example=(
        "PX4 1.17.0 (system 1) has a fence of 1 area and the mission has none: sending it removes "
        "what is there"
    ),
    fix="give --keep-fence to leave it there, or --ignore V106 to have it removed",
)

RALLY_REMOVED = Rule(
    code="V107",
    name="rally-removed",
    severity=Severity.WARNING,
    summary="The vehicle has rally points, and the mission that is to be sent has none.",
    why="It returns home from then on, and not to the nearest of them.",
    how="mavjoule upload compares what was read from the vehicle with the mission.",
    example=(
        "PX4 1.17.0 (system 1) has 2 rally points and the mission has none: sending it removes what "
        "is there"
    ),
    fix="give --keep-fence to leave them there, or put them into the mission",
)

CAPACITY_NOT_TAKEN = Rule(
    code="V108",
    name="capacity-not-taken",
    severity=Severity.INFO,
    summary="The capacity that the vehicle counts from is not taken as the battery's.",
    why=(
        "BAT1_CAPACITY and BATT_CAPACITY are settings: the firmware's 3.3 Ah as often as the "
        "battery's, worn or not, and without a voltage no energy."
    ),
    how="No battery is given, the model has none, and the parameter is above 0.",
    example=(
        "PX4 1.17.0 (system 1) is set to count from 5.2 Ah, now at 14.8 V: not taken as the battery, "
        "whose voltage it does not tell"
    ),
    fix="give --battery with the label's figures, such as 5.2Ah@14.8V",
)

NO_RETURN_IN_FLIGHT = Rule(
    code="V111",
    name="no-return-in-flight",
    severity=Severity.ERROR,
    summary="The vehicle in flight cannot get home above the reserve.",
    why="Every second on the mission eats more of what the way home needs.",
    how=(
        "energy measured as left - way home by the model, times the measured over the modelled energy "
        "where that is above 1 - reserve < 0, and the rest of the mission is no shorter way to land."
    ),
    example="the way home eats 2.10 Wh of the reserve: 20.1 Wh left by charge count, 12.2 Wh home",
    fix="turn back now, or land at a rally point that is nearer",
)

RETURN_SOON_IN_FLIGHT = Rule(
    code="V112",
    name="return-soon-in-flight",
    severity=Severity.WARNING,
    summary="The point of no return is near, and the mission cannot be finished.",
    why="Beyond it the way home eats into the reserve.",
    how="The time until the margin of the way home reaches zero along the mission is 60 s or less.",
    example="the point of no return is 42 s ahead: 31.0 Wh left by charge count, 14.8 Wh home now",
    fix="turn back before then",
)

SHORT_IN_FLIGHT = Rule(
    code="V113",
    name="short-in-flight",
    severity=Severity.ERROR,
    summary="The mission in flight ends below the reserve.",
    why="What was a go on the ground is none when wind, load or battery are not as they were told.",
    how=(
        "energy measured as left - rest of the mission by the model, times the measured over the "
        "modelled energy where that is above 1 - reserve < 0."
    ),
    example="the mission ends 3.20 Wh below the reserve: 31.0 Wh left by charge count",
    fix="end the mission earlier: skip items, or turn back",
)

MEASURES_DIFFER_IN_FLIGHT = Rule(
    code="V114",
    name="measures-differ-in-flight",
    severity=Severity.WARNING,
    summary="The measurements of the battery contradict each other.",
    why="Another battery flies than the one that was checked, or one of its measurements is wrong.",
    how="The energies left by charge count, energy count and percentage differ by more than 10 % of it.",
    example="the measurements of the battery differ: 31.0 Wh by charge count, 44.0 Wh by energy count",
    fix="check with --battery as it is, and calibrate the power module",
)
