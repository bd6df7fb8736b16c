"""Family P: the autopilot parameters a prediction rests on."""

from __future__ import annotations

from planner.findings import Rule, Severity

PARAMETERS_ASSUMED = Rule(
    code="P101",
    name="parameters-assumed",
    severity=Severity.INFO,
    summary="Autopilot parameters the flight depends on are not given; defaults are assumed.",
    why=(
        "Speeds, accelerations and return heights are set on every vehicle; a plan checked against "
        "the defaults is a plan for another vehicle."
    ),
    how=(
        "A parameter is taken from the parameter file, else from the model's [parameters], else "
        "the autopilot's multicopter default is assumed; the finding names those assumed."
    ),
    example="ArduPilot's defaults are assumed for WP_SPD, WP_ACC and 58 more parameters",
    fix="give the vehicle's own parameters with --params",
)

PARAMETER_RENAMED = Rule(
    code="P102",
    name="parameter-renamed",
    severity=Severity.ERROR,
    summary="A parameter is given under its old and its new name.",
    why=(
        "ArduPilot 4.7 renamed its parameters and went from centimetres to metres; a file with "
        "both names does not say which of them flies (ArduPilot #31562, MissionPlanner #3678)."
    ),
    how=(
        "Both names of one quantity are present.  The one the file's firmware version knows is "
        "used, the new one where no version is given.  Only a warning where both mean the same."
    ),
    example="WPNAV_SPEED = 500 cm/s (line 3) and WP_SPD = 10 m/s (line 9) disagree: WP_SPD is used",
    fix="save the parameters again from the vehicle, or delete the name its firmware does not know",
)

PARAMETER_REPEATED = Rule(
    code="P104",
    name="parameter-repeated",
    severity=Severity.WARNING,
    summary="A parameter stands in the file more than once, with different values.",
    why="Which of them is on the vehicle, the file does not say.",
    how="Names are counted; the last value is used, as by the programs that load such files.",
    example="vehicle.param: RTL_ALT is 1500 in line 12 and 3000 in line 40: the last value is used",
    fix="delete the value that is not on the vehicle",
)

PARAMETER_IMPOSSIBLE = Rule(
    code="P105",
    name="parameter-impossible",
    severity=Severity.ERROR,
    summary="A parameter has a value it cannot have; the default is assumed.",
    why=(
        "A value in the unit of another firmware version is off by a factor of 100: WP_SPD = 500 "
        "would be 500 m/s, WPNAV_SPEED = 5 would be 5 cm/s (ArduPilot #31562)."
    ),
    how="The value in SI is outside what a multicopter can mean, or is no number.",
    example="WP_SPD = 500 m/s (line 9) cannot be meant: 10 m/s, the default, is assumed",
    fix="correct the value; look at the unit first",
)

PARAMETERS_OF_ANOTHER_AUTOPILOT = Rule(
    code="P106",
    name="parameters-of-another-autopilot",
    severity=Severity.ERROR,
    summary="The parameter file belongs to another autopilot than the one predicted.",
    why="None of its names means anything to the other: the prediction would rest on defaults.",
    how="The file's header, or else the names in it, say whose it is.",
    example="vehicle.params holds parameters of PX4, the flight is predicted for ArduPilot",
    fix="give the file of this vehicle, or choose the autopilot with --autopilot",
)

PARAMETER_OVERRULED = Rule(
    code="P107",
    name="parameter-overruled",
    severity=Severity.WARNING,
    summary="A parameter is overruled by another one, as it will be on the vehicle.",
    why="The vehicle will not fly at the value that was set.",
    how=(
        "PX4 keeps design values inside its absolute limits (MPC_XY_CRUISE inside MPC_XY_VEL_MAX), "
        "and overwrites them where MPC_XY_VEL_ALL, MPC_Z_VEL_ALL or SYS_VEHICLE_RESP is not "
        "negative."
    ),
    example=(
        "MPC_XY_CRUISE, vehicle.params line 80: MPC_XY_CRUISE = 15 m/s is overruled, 12 m/s is "
        "flown"
    ),
    fix="raise the limit on the vehicle, or lower the value",
)

PARAMETER_UNIT_SUSPECT = Rule(
    code="P108",
    name="parameter-unit-suspect",
    severity=Severity.ERROR,
    summary="A parameter has a value that looks as if it was meant in its other unit.",
    why=(
        "ArduPilot 4.7 went from centimetres to metres: RTL_ALT_M = 1500 is 1500 m, RTL_ALT = 15 is "
        "15 cm, and both are possible values (ArduPilot #31562, MissionPlanner #3678)."
    ),
    how=(
        "The value is more than 30 times larger or smaller than usual, and a hundredth or hundred "
        "times of it is not.  Usual is the default, or what it stands for where that is 0."
    ),
    example="RTL_ALT_M = 1500 m (line 7) is flown as given; in the unit of RTL_ALT it were 15 m",
    fix="correct the value, or ignore the code where it is meant",
)

PARAMETER_UNKNOWN_TO_TARGET = Rule(
    code="P109",
    name="parameter-unknown-to-target",
    severity=Severity.WARNING,
    summary="A parameter has a name that this version of the firmware does not know.",
    why=(
        "A vehicle ignores a name it does not know and keeps what it had: a file of ArduPilot 4.6 "
        "loaded into 4.7 sets none of the renamed parameters (ArduPilot #31970)."
    ),
    how=(
        "The version of --target against the version in which the parameter was renamed.  The value "
        "is used all the same."
    ),
    example="ArduCopter 4.7 does not know WPNAV_SPEED (line 3), it is WP_SPD there",
    fix="save the parameters again from the vehicle",
)

PARAMETER_MISSPELT = Rule(
    code="P110",
    name="parameter-misspelt",
    severity=Severity.ERROR,
    summary="A parameter's name is known to no version, and is a letter away from one that counts.",
    why=(
        "A vehicle ignores a name it does not know and keeps what it had, and the prediction takes the "
        "default: neither is what was written."
    ),
    how=(
        "Names of the parameter file that are not known here, against those the flight depends on and "
        "the file does not hold: one letter too many, too few or wrong, or two that changed "
        "places.  A digit makes another parameter (BATT2_CAPACITY)."
    ),
    example="WPNAV_SPEEED = 500 (line 3) is no parameter: is it WPNAV_SPEED?",
    fix="correct the name, or delete the line",
)
