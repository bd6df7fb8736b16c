"""Family W: wind."""

from __future__ import annotations

from planner.findings import Rule, Severity

NO_HEADWAY = Rule(
    "W101 no-headway",
    Severity.ERROR,
    summary="The wind is stronger than the vehicle can fly against.",
    why="A vehicle that leans as far as it may and still does not advance is blown away from its "
    "mission and from home.",
    how="Along each leg the ground speed is w_along + sqrt(v_max² − w_across²), v_max being the "
    "airspeed at the greatest lean angle; fires where it is 0.1 m/s or less.",
    fix="wait for less wind, or fly a faster vehicle",
)

AIRSPEED_LIMIT = Rule(
    "W102 airspeed-limit",
    Severity.WARNING,
    summary="Legs are flown slower than commanded: the lean angle limits the airspeed.",
    why="ArduPilot holds the ground speed until the lean angle reaches its limit; beyond it the "
    "flight runs late without a word: a survey planned for 475 s took 916 s.",
    how="Along each leg the ground speed is at most w_along + sqrt(v_max² − w_across²), v_max being "
    "the airspeed at the greatest lean angle; fires where that is below what is commanded.",
    fix="command less speed, or allow more lean (ATC_ANGLE_MAX)",
)

CIRCLE_LEAN = Rule(
    "W105 circle-lean",
    Severity.WARNING,
    summary="A circle in this wind asks for more lean than the vehicle may take.",
    why="ArduPilot turns the target of a circle on at a steady rate and does not wait for the "
    "vehicle: one that cannot lean enough cuts the circle, or is blown off it to leeward, while its "
    "turns are counted.",
    how="At a ground speed v on a radius R in a wind w: sqrt(v² + (v²/cR)²) + w above the airspeed at "
    "the greatest lean angle U, with c = g tan(ATC_ANGLE_MAX)/U.  The time of the circle stays.",
    fix="fly the circle slower or wider, wait for less wind, or allow more lean (ATC_ANGLE_MAX)",
)
