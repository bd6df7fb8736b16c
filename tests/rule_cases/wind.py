"""Family W: wind."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from made_missions import mission, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PLAIN, PX4, STEP, RuleCases, found, vehicle_of

from planner.physics.wind import Wind
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.autopilot import Autopilot
    from planner.findings import Finding


def against(wind_m_s: float, airspeed_m_s: float) -> tuple[Finding, ...]:
    """Return what is reported of a flight at 10 m/s north against the wind."""
    return found(
        mission(takeoff(20), waypoint(200, 20)),
        ARDUPILOT,
        "WP_SPD,10\n",
        vehicle=replace(vehicle_of(ARDUPILOT), airspeed_limit_m_s=airspeed_m_s),
        wind=Wind(speed_m_s=wind_m_s, from_deg=0.0),
    )


def in_wind(
    wind_m_s: float, autopilot: Autopilot = STEP, parameters: str = ""
) -> tuple[Finding, ...]:
    """Return what is reported of the plain flight in wind."""
    return found(PLAIN, autopilot, parameters, wind=Wind(speed_m_s=wind_m_s))


def circling(wind_m_s: float) -> tuple[Finding, ...]:
    """Return what is reported of a circle of 20 m at 5 m/s, by a vehicle that can lean for 15 m/s."""
    there = replace(waypoint(0, 20), command=18, param1=2.0, param3=20.0)
    return found(
        mission(takeoff(20), there),
        ARDUPILOT,
        vehicle=replace(vehicle_of(ARDUPILOT), airspeed_limit_m_s=15.0),
        wind=Wind(speed_m_s=wind_m_s),
    )


def landing_in(wind_m_s: float) -> tuple[Finding, ...]:
    """Return what is reported of a flight in wind that leans 7° below 2 m."""
    return found(
        PLAIN,
        ARDUPILOT,
        "WP_NAVALT_MIN,2\n",
        vehicle=replace(vehicle_of(ARDUPILOT), airspeed_limit_m_s=15.0),
        wind=Wind(speed_m_s=wind_m_s),
    )


# 15 m/s at 30° of lean; 7° leave 3.19 m/s by the tangents, 6.92 m/s by their root.
NEAR_GROUND_M_S = 15.0 * math.tan(math.radians(7.0)) / math.tan(math.radians(30.0))

# sqrt(0.5 · 2.5 · 20) = 5 m/s, 1.25 m/s² across; at 30° of lean drag is 5.66/15 per second.
CIRCLE_WIND_M_S = 15.0 - math.hypot(5.0, 1.25 * 15.0 / (9.80665 * math.tan(math.radians(30.0))))


def asked_to_lean(lean_deg: float) -> tuple[Finding, ...]:
    """Return what is reported of a landing in a wind that asks for a lean, by 15 m/s at 30°."""
    # U tan 30° / 15 m/s is the drag over the weight, and w tan 30° / 15 m/s of 1 what it carries of that.
    lean, limit = math.tan(math.radians(lean_deg)), math.tan(math.radians(30.0)) / 15.0
    wind_m_s = lean / limit * (1.0 - 0.5 * limit)
    vehicle = replace(vehicle_of(ARDUPILOT), airspeed_limit_m_s=15.0)
    return found(PLAIN, ARDUPILOT, vehicle=vehicle, wind=Wind(speed_m_s=wind_m_s))


CASES: Mapping[str, RuleCases] = {
    "W101": RuleCases(
        fires=lambda: against(15.0, 15.0),
        boundary=lambda: against(0.0, 0.1),
        fires_at_boundary=True,
        silent=lambda: against(14.0, 15.0),
    ),
    "W102": RuleCases(
        fires=lambda: against(5.1, 15.0),
        boundary=lambda: against(5.0, 15.0),
        silent=lambda: against(4.9, 15.0),
    ),
    "W103": RuleCases(
        fires=lambda: in_wind(7.1),
        boundary=lambda: in_wind(7.0),  # the article's vehicle was identified up to 10 m/s
        silent=lambda: in_wind(6.9),
    ),
    "W105": RuleCases(
        fires=lambda: circling(CIRCLE_WIND_M_S + 0.1),
        boundary=lambda: circling(CIRCLE_WIND_M_S),
        silent=lambda: circling(CIRCLE_WIND_M_S - 0.1),
    ),
    "W106": RuleCases(
        fires=lambda: landing_in(3.3),
        boundary=lambda: landing_in(NEAR_GROUND_M_S),
        silent=lambda: landing_in(3.1),
    ),
    "W107": RuleCases(
        fires=lambda: asked_to_lean(15.1),
        boundary=lambda: asked_to_lean(15.0),
        silent=lambda: asked_to_lean(14.9),
    ),
    "T114": RuleCases(
        fires=lambda: found(PLAIN, PX4, "COM_POS_LOW_EPH,2.4\n"),
        boundary=lambda: found(PLAIN, PX4, "COM_POS_LOW_EPH,2.5\n"),  # --position-error's default
        silent=lambda: found(PLAIN, PX4, "COM_POS_LOW_EPH,2.6\n"),
    ),
    "W104": RuleCases(
        fires=lambda: in_wind(8.1, PX4, "COM_WIND_MAX,8\n"),
        boundary=lambda: in_wind(8.0, PX4, "COM_WIND_MAX,8\n"),
        silent=lambda: in_wind(8.1, PX4, "COM_WIND_MAX,-1\n"),
    ),
}
