"""Family W: wind."""

from __future__ import annotations

from planner.findings import Rule, Severity

NO_HEADWAY = Rule(
    code="W101",
    name="no-headway",
    severity=Severity.ERROR,
    summary="The wind is stronger than the vehicle can fly against.",
    why=(
        "A vehicle that leans as far as it may and still does not advance is blown away from its "
        "mission and from home."
    ),
    how=(
        "Along each leg the ground speed is w_along + sqrt(v_max² − w_across²), v_max being the "
        "airspeed at the greatest lean angle; fires where it is 0.1 m/s or less."
    ),
    example="no headway on 3 legs from item 7 on: 12.0 m/s of wind against 10.3 m/s of airspeed",
    fix="wait for less wind, or fly a faster vehicle",
)

AIRSPEED_LIMIT = Rule(
    code="W102",
    name="airspeed-limit",
    severity=Severity.WARNING,
    summary="Legs are flown slower than commanded: the lean angle limits the airspeed.",
    why=(
        "ArduPilot holds the ground speed until the lean angle reaches its limit; beyond it the "
        "flight runs late without a word: a survey planned for 475 s took 916 s."
    ),
    how=(
        "Along each leg the ground speed is at most w_along + sqrt(v_max² − w_across²), v_max being "
        "the airspeed at the greatest lean angle; fires where that is below what is commanded."
    ),
    example="slower than commanded: 3 legs from item 7 on, down to 4.1 m/s of 12.0 m/s",
    fix="command less speed, or allow more lean (ATC_ANGLE_MAX)",
)

CIRCLE_LEAN = Rule(
    code="W105",
    name="circle-lean",
    severity=Severity.WARNING,
    summary="A circle in this wind asks for more lean than the vehicle may take.",
    why=(
        "ArduPilot turns the target of a circle on at a steady rate and does not wait for the vehicle: "
        "one that cannot lean enough cuts the circle, or is blown off it to leeward, while its turns "
        "are counted."
    ),
    how=(
        "At a ground speed v on a radius R in a wind w: sqrt(v² + (v²/cR)²) + w above the airspeed at "
        "the greatest lean angle U, with c = g tan(ATC_ANGLE_MAX)/U.  The time of the circle stays."
    ),
    example=(
        "1 circle from item 3 on: 5.0 m/s over ground in 6.0 m/s of wind asks for the lean of 11.5 m/s "
        "of airspeed, the vehicle's limit is 10.3 m/s"
    ),
    fix="fly the circle slower or wider, wait for less wind, or allow more lean (ATC_ANGLE_MAX)",
)

WIND_BEYOND_MODEL = Rule(
    code="W103",
    name="wind-beyond-model",
    severity=Severity.ERROR,
    summary="The wind is as fast as the vehicle was ever seen to fly.",
    why=(
        "A vehicle blown along faster than it can fly does not come back (ArduPilot #859).  A model "
        "of reference steps flies every leg as commanded, whatever the wind."
    ),
    how=(
        "Wind speed at or above the highest speed of the model's [valid_for], flown in reference "
        "steps; autopilots are judged by their lean angle (W101)."
    ),
    example="12.0 m/s of wind, the model was identified up to 10.0 m/s: no way against it is known",
    fix="wait for less wind, or identify the vehicle at higher speeds",
)

WIND_LIMIT = Rule(
    code="W104",
    name="wind-limit",
    severity=Severity.WARNING,
    summary="The wind is above the limit set on the vehicle.",
    why="PX4 warns or returns in flight where its wind estimate is above COM_WIND_MAX (PX4 #19578).",
    how="--wind against COM_WIND_MAX, where that is positive.",
    example="9.0 m/s of wind, COM_WIND_MAX is 8.0 m/s",
    fix="wait for less wind, or raise the limit if the vehicle can take it",
)
