"""Family E: energy, battery, and how far the prediction can be trusted."""

from __future__ import annotations

from planner.findings import Rule, Severity

BATTERY_UNKNOWN = Rule(
    code="E100",
    name="battery-unknown",
    severity=Severity.ERROR,
    summary="No battery is known, so nothing can be said about the margin.",
    why="A mission without a known battery cannot be judged; a silent guess would be a wrong 'go'.",
    how="Neither --battery nor the vehicle model's [battery] section gives a capacity.",
    example="no battery is known: the flight needs 24.1 Wh, the capacity is not given",
    fix='say what flies, for example --battery "5.2Ah@14.8V" or --battery 77Wh',
)

RESERVE_BELOW_MINIMUM = Rule(
    code="E101",
    name="reserve-below-minimum",
    severity=Severity.ERROR,
    summary="The flight would land with less than the reserve in the battery.",
    why=(
        "Autopilots learn in the air that they cannot get home: low-battery returns that trigger too "
        "late, or far too early, are among the most reported failures (PX4 #17007, ArduPilot #2390)."
    ),
    how=(
        "margin = capacity x charge - capacity x reserve - energy of the whole flight, from the start "
        "of the take-off to disarmed; fires where the margin is negative.  The finding names the item "
        "at which the reserve is first touched, and how far below it a battery starts."
    ),
    example="the flight needs 71.3 Wh, 61.6 Wh are there above the reserve of 20 %: short by 9.70 Wh",
    fix="fly less, split the mission, or take a larger or fuller battery",
)

VOLTAGE_LOW = Rule(
    code="E104",
    name="loaded-voltage-low",
    severity=Severity.ERROR,
    summary="Under load the voltage falls below the cut-off before the energy is used up.",
    why=(
        "A battery with a third of its energy left can be below its cut-off the moment it is asked "
        "for power: a vehicle landed itself at 3.5 V a cell with 30 % left (ArduPilot #5395)."
    ),
    how=(
        "V = (E + sqrt(E² - 4 R P)) / 2 at the highest power of each stretch of the flight, E from "
        "the charge left, R at the temperature and age of the battery; fires where V is below "
        "cutoff_voltage_v, or where no current gives the power."
    ),
    example="13.9 V under load, the battery counts as empty at 14.0 V",
    fix="fly less or slower, start with a fuller battery, or take one of less resistance",
)

MODEL_OUTSIDE_ENVELOPE = Rule(
    code="E105",
    name="model-outside-envelope",
    severity=Severity.WARNING,
    summary="The mission asks for flight outside the range in which the model was identified.",
    why=(
        "A model says nothing about flight it was not identified on.  A longer climb is made of "
        "manoeuvres inside the range and only marked; a speed beyond the range cannot be, and is an "
        "error, as is a climb or descent twice as fast as any.  Where the model's power does not depend "
        "on the airspeed, wind makes it one from 1.6 times the identified speed on."
    ),
    how=(
        "Commanded speeds, altitude steps and heights, and the airspeeds, climb rates, mass and air "
        "density of the predicted flight against [valid_for] and the identified steps of the vehicle "
        "model; 0.5 m of a height, 3 % of a speed flown and 2 % of a density are let pass.  What was "
        "measured higher up, or in other air, is only noted."
    ),
    example=(
        "15.0 m/s is commanded, the model was identified from 0.0 to 10.0 m/s: time and energy of "
        "2 legs cannot be trusted"
    ),
    fix="keep the mission inside the identified range, or identify the vehicle on such flights",
)

RETURN_BELOW_RESERVE = Rule(
    code="E102",
    name="no-return-point",
    severity=Severity.ERROR,
    summary="From some point of the flight, going home at once would eat into the reserve.",
    why=(
        "A mission may end within its reserve and still pass points from which the vehicle cannot get "
        "home with it: a point of no return (QGroundControl #11262, ArduPilot #2390)."
    ),
    how=(
        "margin = energy left at the point - reserve - energy to stop, fly home by the vehicle's own "
        "return rules and land from there.  It is bounded along every leg and the legs are divided "
        "until no tighter point can be left (to 0.1 %); take-off, and stages that land, are left to "
        "E101.  Fires where the least margin is negative and names the last point with a way home; "
        "how much is missing is left to E101 where that is the same (to 5 %).  A return leads where "
        "the vehicle would go: "
        "home, as DO_SET_HOME has moved it, or a rally point."
    ),
    example=(
        "gets home above the reserve only up to item 7, 120 m along its leg: from item 8 the way "
        "takes 18.2 Wh, 3.2 Wh more than is left"
    ),
    fix="bring the far end of the mission nearer, or take a larger or fuller battery",
)

FAILSAFE_BEFORE_END = Rule(
    code="E103",
    name="onboard-failsafe-before-end",
    severity=Severity.ERROR,
    summary="The vehicle's own battery failsafe would end the mission before it is flown.",
    why=(
        "A failsafe is decided on board, by thresholds no ground station compares with the plan: "
        "returns that come far too early are reported again and again (PX4 #17007: at 32 % while set "
        "to 15 %), and one set to land sets the vehicle down wherever it is (ArduPilot #7333)."
    ),
    how=(
        "The charge, voltage and time of the predicted flight against the parameters.  PX4: charge "
        "below BAT_LOW_THR, BAT_CRIT_THR, BAT_EMERGEN_THR with COM_LOW_BAT_ACT, the charge counted from "
        "BAT1_CAPACITY and seen in the open-circuit voltage between BAT1_V_EMPTY and BAT1_V_CHARGED, the "
        "lesser; RTL_TIME_FACTOR x time to return + RTL_TIME_MARGIN against charge over mean current "
        "(50 s, from BAT_AVRG_CURRENT) with COM_FLTT_LOW_ACT, PX4's own estimate: no wind, no braking; "
        "COM_FLT_TIME_MAX.  ArduPilot: BATT_CAPACITY less what is used below BATT_LOW_MAH and "
        "BATT_CRT_MAH, voltage under load (at rest with BATT_FS_VOLTSRC 1) below BATT_LOW_VOLT and "
        "BATT_CRT_VOLT for BATT_LOW_TIMER, with BATT_FS_LOW_ACT and BATT_FS_CRT_ACT.  An error where the "
        "vehicle returns or lands, information where it only warns; silent in the last landing."
    ),
    example=(
        "the vehicle itself returns at item 9, 210 m along its leg: 7 % of the charge is left as "
        "PX4 counts it, BAT_CRIT_THR is 7 %"
    ),
    fix="fly less, start with a fuller battery, or set the failsafe to what the battery can give",
)

RALLY_UNREACHABLE = Rule(
    code="E106",
    name="rally-unreachable",
    severity=Severity.WARNING,
    summary="A rally point is no help: never chosen, or not to be reached above the reserve.",
    why=(
        "A rally point is drawn as the place of safety and taken for one; a vehicle that never goes "
        "there, or cannot, needs the way home after all (ArduPilot #4701: rally in range of the whole "
        "path, #30575)."
    ),
    how=(
        "From the ends of the mission's stages, or 200 of them: where the vehicle's own rules (RTL_TYPE; "
        "RALLY_LIMIT_KM, RALLY_INCL_HOME) never choose the rally point, and where the energy left above "
        "the reserve does not reach it from any place: a warning; the first is only noted."
    ),
    example="rally point 2 is chosen from no item: the vehicle goes home or to another rally point",
    fix="move the rally point to where the mission is far from home, or take it out",
)

ARMING_REFUSED = Rule(
    code="E114",
    name="battery-refused-at-arming",
    severity=Severity.ERROR,
    summary="The vehicle would not arm with the battery as it is at the start.",
    why="What the vehicle refuses on the field costs the day; it is known beforehand.",
    how=(
        "Charge at the start below COM_ARM_BAT_MIN, or BAT_CRIT_THR where that is negative (PX4); "
        "open-circuit voltage at the start below BATT_ARM_VOLT, BATT_CAPACITY below BATT_ARM_MAH "
        "(ArduPilot)."
    ),
    example="PX4 does not arm with 30 % of the charge: COM_ARM_BAT_MIN is 50 %",
    fix="charge the battery, or correct the parameter",
)

HOVER_THROTTLE_HIGH = Rule(
    code="E116",
    name="hover-throttle-high",
    severity=Severity.WARNING,
    summary="Late in the flight the vehicle needs most of its thrust to hover.",
    why=(
        "A vehicle that hovers at three quarters of its throttle has little left to climb or to stay "
        "upright with, less still as the battery sags: 77 % at the take-off nearly lost one "
        "(ArduPilot #5244)."
    ),
    how=(
        "MOT_THST_HOVER, where the parameter file or the model gives it, times the mass with payload "
        "over that without, times (V_full / V)² for the lowest voltage under load at the end of a "
        "segment; fires above 0.7.  Asked where the battery's curve is known; PX4 keeps no hover "
        "throttle that could be told beforehand."
    ),
    example="hovering takes 74 % of the thrust that is there at 20.9 V, 51 % when full",
    fix="carry less, fly less far on one battery, or take a battery that sags less",
)

CRUISE_POWER_ASSUMED = Rule(
    code="E107",
    name="cruise-power-assumed",
    severity=Severity.INFO,
    summary="The model has no cruise power; hover power at the same height is used.",
    why=(
        "Cruise power is not hover power: recorded vehicles spend from 16 % less at 8 m/s to 37 % more "
        "at 15 m/s.  The article behind the shipped model gives no figure, and none is invented."
    ),
    how="Cruise power = hover power at the actual height, wherever the model has no [cruise] table.",
    example="cruise power is taken as hover power over 4.1 km: the model gives none",
    fix="identify the vehicle from its own logs, or add a cruise table to the model file",
)

CONDITION_NOT_MODELLED = Rule(
    code="E108",
    name="condition-not-modelled",
    severity=Severity.WARNING,
    summary="A condition was given that this vehicle model cannot take into account.",
    why=(
        "Users test an estimator by changing payload or wind and watching the answer (bluerobotics "
        "cockpit #2159).  Where the answer cannot change, it has to be said."
    ),
    how=(
        "Wind needs a model whose power depends on airspeed, payload needs a mass, temperature needs "
        "a hover law over air density; the age and temperature of a battery need its resistance and "
        "curves.  A payload that is not counted is an error, as is a wind above 0.6 of the highest "
        "identified speed and air 1.2 times thinner than at sea level: the flight takes more than is said.  "
        "Of a parameter file reference steps use the fence alone; one whose autopilot is not known is an "
        "error where it holds a fence."
    ),
    example="the payload of 0.50 kg is not counted: the model's power knows no mass",
    fix="use a vehicle model that carries the missing quantity",
)

POWER_UNKNOWN = Rule(
    code="E109",
    name="power-not-identified",
    severity=Severity.ERROR,
    summary="The vehicle's power was not identified: time is predicted, energy is not.",
    why="A mission without a known energy cannot be judged against a battery; it is never a 'go'.",
    how='The vehicle model says law = "not-given" under [hover] and [cruise].',
    example="px4-sih-quad has no power model: time and distance are predicted, energy is not",
    fix="identify the vehicle from logs with voltage and current, or fly another model",
)

DISCHARGE_RATE_HIGH = Rule(
    code="E110",
    name="discharge-rate-high",
    severity=Severity.WARNING,
    summary="The flight draws more current than the battery is made for.",
    why="Beyond its rate a battery heats up, sags and ages; what is predicted of it does not hold.",
    how="Highest predicted current over the charge of the new battery, above its max_c_rate.",
    example="up to 62 A, 12.4 times the charge an hour, the battery is made for 10.0",
    fix="take a battery of more charge or of a higher rate, or fly slower and lighter",
)

RESPONSE_NOT_APPLIED = Rule(
    code="E111",
    name="response-not-applied",
    severity=Severity.INFO,
    summary="The model knows how the vehicle follows its references; that is not used.",
    why="Stops are a little longer, and stations reached a little later, than their references say.",
    how=(
        "[responses] of speed or altitude in a model flown by PX4, which is taken to fly exactly what "
        "it asks for, but for the time its trajectory waits for a noisy position (T109); on ArduPilot "
        "stops and waits at waypoints follow the responses."
    ),
    example="PX4 is taken to fly its references without lag: the model's responses are not applied",
    fix="allow for the mean residence time of the responses where a stop matters",
)

RESERVE_AT_RISK = Rule(
    code="E119",
    name="reserve-at-risk",
    severity=Severity.WARNING,
    summary="The prediction keeps the reserve, but the chance that a flight does not is high.",
    why=(
        "No two flights take the same energy: recorded flights differ from their predictions by a few "
        "percent, and the wind is never quite the one forecast.  A margin smaller than that is luck."
    ),
    how=(
        "10,000 draws of the wind, payload, temperature and charge as they were given (5±2@270±20) and "
        "of the errors in the [spread] of the vehicle model; fires where the share that lands, or that "
        "could not get home from some point, below the reserve is above --risk (5 % where not given) "
        "while the prediction itself stays above it.  Not computed where the model has no [spread]."
    ),
    example="12 % chance to land below the reserve of 20 %, more than 5 %",
    fix="leave more margin: fly less, or take a larger or fuller battery",
)

LIFT_UNKNOWN = Rule(
    code="E120",
    name="lift-unknown",
    severity=Severity.ERROR,
    summary="The flight takes far more thrust than the flights the model was identified on.",
    why=(
        "Power goes on growing in a model where the vehicle no longer leaves the ground: nothing in it "
        "says how much the rotors can lift (ArduPilot #5244: nearly lost at 77 % of the throttle)."
    ),
    how=(
        "Mass with payload over the heaviest of [valid_for] (else the model's own), times the thinnest "
        "air of [valid_for] (else 1.225 kg/m³) over the air at the highest point of the flight: more than "
        "1.5.  Thrust falls with the density of the air as weight grows."
    ),
    example=(
        "8.50 kg in air of 1.18 kg/m³ takes 2.4 times the thrust of the flights the model was identified "
        "on: whether the vehicle has it is not known"
    ),
    fix="carry less, fly lower, or identify the vehicle on such flights",
)

BATTERY_VOLTAGE_DIFFERS = Rule(
    code="E121",
    name="battery-voltage-differs",
    severity=Severity.ERROR,
    summary="The battery has another voltage than the one the vehicle flies with.",
    why=(
        "A battery of fewer cells does not turn the rotors fast enough, one of more burns the speed "
        "controllers; mostly the battery of another vehicle was typed."
    ),
    how=(
        "Nominal voltage of the battery over that of the model's own: less than 0.85 or more than 1.18, "
        "so that one cell of six fewer is outside and another chemistry of as many cells is not."
    ),
    example="the battery has 14.8 V, that of arducopter-sitl-quad has 22.2 V",
    fix="give the battery that will fly, or ignore the code where the vehicle is made for both",
)

BATTERY_COLD = Rule(
    code="E122",
    name="battery-cold",
    severity=Severity.WARNING,
    summary="The battery is colder than it is known at.",
    why=(
        "A lithium battery gives less the colder it is, and its voltage breaks down under load; the energy "
        "on a label is that of a warm one."
    ),
    how=(
        "The temperature given for the battery, else for the air, below 0 °C and below the temperatures "
        "at which its resistance is known; an error below −10 °C.  Without a temperature given nothing "
        "is said."
    ),
    example=(
        "the battery, taken to be as cold as the air, has −12 °C: it does not say what it gives in the cold"
    ),
    fix="keep the battery warm and give its temperature with --battery-temperature, or allow for the "
    "cold with --battery-health",
)
