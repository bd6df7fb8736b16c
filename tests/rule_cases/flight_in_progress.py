"""Family V, from V111: the energy of a vehicle in flight."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from made_missions import HOME, mission, north, rtl, takeoff, waypoint
from rule_cases.case import ARDUPILOT, RuleCases, vehicle_of

from planner.guard.energy import EnergyState, EnergyWatch, Prediction
from planner.link.telemetry import BatteryState, VehiclePosition
from planner.service.preflight import check
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding
    from planner.flight.returns.path import Returns

BATTERY = Battery(capacity_wh=200.0)
LEFT_WH = 199.0
"""One watt-hour is used: less than predicted, so that nothing is scaled."""


@cache
def returns() -> Returns:
    """Return the predicted flight, 2 km out and back, with its ways home."""
    one = mission(takeoff(50), waypoint(1000, 50), waypoint(2000, 50), rtl())
    assessment = check(one, vehicle_of(ARDUPILOT), battery=BATTERY).assessment
    assert assessment is not None
    return assessment.returns


def state(
    reserve_wh: float, *, warn_before_s: float = 0.0, percentage: float | None = None
) -> EnergyState:
    """Return what is known 500 m out, a minute after the start."""
    prediction = Prediction(
        returns=returns(),
        battery=BATTERY,
        charge=1.0,
        usable_wh=BATTERY.energy_wh,
        reserve_wh=reserve_wh,
        temperature_c=15.0,
    )
    start = BatteryState(consumed_wh=0.0)
    watch = EnergyWatch(prediction, start=start, warn_before_s=warn_before_s)
    place = VehiclePosition(
        altitude_amsl_m=0.0,
        latitude_deg=north(500),
        longitude_deg=HOME.longitude_deg,
        height_above_home_m=50.0,
    )
    reading = BatteryState(consumed_wh=200.0 - LEFT_WH, remaining_fraction=percentage)
    known, _ = watch.take(2, place, reading, 60.0)
    assert known is not None
    return known


def returning(margin_wh: float) -> tuple[Finding, ...]:
    """Return what is said where a return leaves so much above the reserve."""
    return state(LEFT_WH - state(0.0).return_wh - margin_wh).findings


def finishing(margin_wh: float) -> tuple[Finding, ...]:
    """Return what is said where the mission leaves so much above the reserve."""
    return state(LEFT_WH - state(0.0).finish_wh - margin_wh).findings


def turning_back(longer_s: float) -> tuple[Finding, ...]:
    """Return what is said where the point of no return is so much farther off than to be reported."""
    reserve_wh = LEFT_WH - 0.5 * (state(0.0).finish_wh + state(0.0).return_wh)
    lead_s = state(reserve_wh).lead_s
    assert lead_s is not None
    return state(reserve_wh, warn_before_s=lead_s - longer_s).findings


CASES: Mapping[str, RuleCases] = {
    "V111": RuleCases(
        fires=lambda: returning(-0.001),
        boundary=lambda: returning(1e-9),
        silent=lambda: returning(0.001),
    ),
    "V112": RuleCases(
        fires=lambda: turning_back(-0.001),
        boundary=lambda: turning_back(0.0),
        fires_at_boundary=True,
        silent=lambda: turning_back(0.001),
    ),
    "V113": RuleCases(
        fires=lambda: finishing(-0.001),
        boundary=lambda: finishing(1e-9),
        silent=lambda: finishing(0.001),
    ),
    "V114": RuleCases(
        fires=lambda: state(10.0, percentage=0.894).findings,
        boundary=lambda: state(10.0, percentage=0.895).findings,  # 179 for 199 Wh of 200 Wh
        silent=lambda: state(10.0).findings,
    ),
}
