"""Family P: the autopilot parameters a prediction rests on."""

from __future__ import annotations

from planner.findings import Rule, Severity

PARAMETERS_ASSUMED = Rule(
    "P101 parameters-assumed",
    Severity.INFO,
    summary="Autopilot parameters the flight depends on are not given; defaults are assumed.",
    why="Speeds, accelerations and return heights are set on every vehicle; a plan checked against "
    "the defaults is a plan for another vehicle.",
    how="A parameter is taken from the parameter file, else from the model's [parameters], else the "
    "autopilot's multicopter default is assumed; the finding names those assumed.",
    fix="give the vehicle's own parameters with --params",
)

PARAMETER_RENAMED = Rule(
    "P102 parameter-renamed",
    Severity.ERROR,
    summary="A parameter is given under its old and its new name.",
    why="ArduPilot 4.7 renamed its parameters and went from centimetres to metres; a file with both "
    "names does not say which of them flies (ArduPilot #31562, MissionPlanner #3678).",
    how="Both names of one quantity are present.  The one the file's firmware version knows is used, "
    "the new one where no version is given.  Only a warning where both mean the same.",
    fix="save the parameters again from the vehicle, or delete the name its firmware does not know",
)

PARAMETER_REPEATED = Rule(
    "P104 parameter-repeated",
    Severity.WARNING,
    summary="A parameter stands in the file more than once, with different values.",
    why="Which of them is on the vehicle, the file does not say.",
    how="Names are counted; the last value is used, as by the programs that load such files.",
    fix="delete the value that is not on the vehicle",
)

PARAMETER_IMPOSSIBLE = Rule(
    "P105 parameter-impossible",
    Severity.ERROR,
    summary="A parameter has a value it cannot have; the default is assumed.",
    why="A value in the unit of another firmware version is off by a factor of 100: WP_SPD = 500 "
    "would be 500 m/s, WPNAV_SPEED = 5 would be 5 cm/s (ArduPilot #31562).",
    how="The value in SI is outside what a multicopter can mean, or is no number.",
    fix="correct the value; look at the unit first",
)

PARAMETERS_OF_ANOTHER_AUTOPILOT = Rule(
    "P106 parameters-of-another-autopilot",
    Severity.ERROR,
    summary="The parameter file belongs to another autopilot than the one predicted.",
    why="None of its names means anything to the other: the prediction would rest on defaults.",
    how="The file's header, or else the names in it, say whose it is.",
    fix="give the file of this vehicle, or choose the autopilot with --autopilot",
)

PARAMETER_OVERRULED = Rule(
    "P107 parameter-overruled",
    Severity.WARNING,
    summary="A parameter is overruled by another one, as it will be on the vehicle.",
    why="The vehicle will not fly at the value that was set.",
    how="PX4 keeps design values inside its absolute limits (MPC_XY_CRUISE inside MPC_XY_VEL_MAX), "
    "and overwrites them where MPC_XY_VEL_ALL, MPC_Z_VEL_ALL or SYS_VEHICLE_RESP is not negative.",
    fix="raise the limit on the vehicle, or lower the value",
)

PARAMETER_UNIT_SUSPECT = Rule(
    "P108 parameter-unit-suspect",
    Severity.ERROR,
    summary="A parameter has a value that looks as if it was meant in its other unit.",
    why="ArduPilot 4.7 went from centimetres to metres: RTL_ALT_M = 1500 is 1500 m, RTL_ALT = 15 is "
    "15 cm, and both are possible values (ArduPilot #31562, MissionPlanner #3678).",
    how="The value is more than 30 times larger or smaller than usual, and a hundredth or hundred "
    "times of it is not.  Usual is the default, or what it stands for where that is 0.",
    fix="correct the value, or ignore the code where it is meant",
)

PARAMETER_UNKNOWN_TO_TARGET = Rule(
    "P109 parameter-unknown-to-target",
    Severity.WARNING,
    summary="A parameter has a name that this version of the firmware does not know.",
    why="A vehicle ignores a name it does not know and keeps what it had: a file of ArduPilot 4.6 "
    "loaded into 4.7 sets none of the renamed parameters (ArduPilot #31970).",
    how="The version of --target against the version in which the parameter was renamed.  The value "
    "is used all the same.",
    fix="save the parameters again from the vehicle",
)

PARAMETER_MISSPELT = Rule(
    "P110 parameter-misspelt",
    Severity.ERROR,
    summary="A parameter's name is known to no version, and is a letter away from one that counts.",
    why="A vehicle ignores a name it does not know and keeps what it had, and the prediction takes "
    "the default: neither is what was written.",
    how="Names of the parameter file that are not known here, against those the flight depends on and "
    "the file does not hold: one letter too many, too few or wrong, or two that changed places.  A "
    "digit makes another parameter (BATT2_CAPACITY).",
    fix="correct the name, or delete the line",
)
