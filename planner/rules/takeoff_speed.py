"""The speed of PX4's take-offs: what it never takes off with, and what the limit of climbs makes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Severity
from planner.flight.motion.px4.lift_off import lift_off
from planner.flight.returns.destination import SETTING_NOT_FOLLOWED
from planner.mission.route.stage import StageKind
from planner.rules.declaration import PX4, judges
from planner.vehicle.parameters.resolve import PARAMETER_OVERRULED

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.px4 import Px4Parameters


_STAYS_M_S = 0.3
"""Speed above which PX4 wants to take off (``FlightTaskAuto::update``, ``_want_takeoff``)."""


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _never_takes_off(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Report a speed of take-offs with which PX4 stays on the ground, until it disarms."""
    takeoff = next(iter(a.route.stages_of(StageKind.TAKEOFF)), None)
    if takeoff is not None and parameters.takeoff_speed_m_s <= _STAYS_M_S:
        yield a.finding(
            SETTING_NOT_FOLLOWED,
            f"PX4 does not take off at {quantity.speed(parameters.takeoff_speed_m_s)} (MPC_TKO_SPEED): it "
            "needs more than 0.3 m/s",
            item=takeoff.item,
            severity=Severity.ERROR,
            fix="raise MPC_TKO_SPEED on the vehicle",
        )


@judges(PARAMETER_OVERRULED, needs=(PX4,))
def _takeoff_beyond_the_limit(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Report take-offs whose speed the limit of climbs brakes to full stops, again and again."""
    begins = lift_off(parameters)
    takeoff = next(iter(a.route.stages_of(StageKind.TAKEOFF)), None)
    if takeoff is None or not begins.stops_every_m:
        return
    asked_m_s, most_m_s = parameters.takeoff_speed_m_s, parameters.climb_speed_max_m_s
    yield a.finding(
        PARAMETER_OVERRULED,
        f"MPC_TKO_SPEED, {quantity.speed(asked_m_s)}, is more than 1.3 times MPC_Z_VEL_MAX_UP, "
        f"{quantity.speed(most_m_s)}: up to MPC_LAND_ALT1 the take-off stops every "
        f"{quantity.distance(begins.stops_every_m)}, {quantity.speed(begins.speed_m_s)} on average",
        item=takeoff.item,
        fix="lower MPC_TKO_SPEED on the vehicle",
    )
