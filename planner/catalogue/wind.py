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
        "airspeed at the greatest lean angle; fires where it is not above zero."
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
        "the airspeed at the greatest lean angle."
    ),
    example="3 legs from item 7 on are slower than commanded, down to 4.1 m/s of 12.0 m/s",
    fix="command less speed, or allow more lean (ATC_ANGLE_MAX)",
)
