"""Cases of the rules about the tool itself: no vehicle, checks that could not be made."""

from __future__ import annotations

from typing import TYPE_CHECKING

from made_missions import HOME
from rule_cases.case import ARDUPILOT, PLAIN, PLENTY, RuleCases, found, vehicle_of
from rule_cases.energy import NEED_WH, OUT_AND_BACK

from planner.errors import MissionFileError
from planner.fetched import FetchMark
from planner.service.preflight import check_mission, check_read
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.findings import Finding
    from planner.mission.items import Mission


def _with(*, is_vehicle_named: bool) -> Iterable[Finding]:
    setup = Setup(vehicle=vehicle_of(ARDUPILOT), battery=PLENTY, is_vehicle_named=is_vehicle_named)
    return check_mission(PLAIN, setup).findings


def _fetched_apart(plan: FetchMark, parameters: FetchMark) -> tuple[Finding, ...]:
    one = replace(PLAIN, fetched=FetchMark.read(plan.text))
    return found(one, ARDUPILOT, f"{parameters.comment}\nWPNAV_SPEED,500\n")


def _mark(time: str, speed: str, vehicle: str = "3f") -> FetchMark:
    values = {"WPNAV_SPEED": speed, "STAT_RUNTIME": time}  # a counter
    return FetchMark.of(f"2026-11-{time}T08:00:00Z", vehicle, values)


def _home_unknown(share_of_need: float) -> tuple[Finding, ...]:
    """Return what is reported from a home of unknown altitude with so much of the energy needed."""
    made = replace(OUT_AND_BACK, home=replace(HOME, altitude_amsl_m=0.0))  # a placeholder
    return found(made, battery=Battery(capacity_wh=1.25 * NEED_WH * share_of_need))


def _watched(parameters: str) -> tuple[Finding, ...]:
    """Return what is reported of a battery of unknown cells under failsafes."""
    bare = replace(vehicle_of(ARDUPILOT), battery=None)
    return found(PLAIN, ARDUPILOT, parameters, battery=Battery(capacity_wh=177.0), vehicle=bare)


def _read(error: Exception) -> tuple[Finding, ...]:
    """Return what is reported of a mission whose reader raises an error."""

    def fail() -> Mission:
        raise error

    return check_read(fail, Setup(vehicle=vehicle_of(ARDUPILOT)), file="a.plan").findings


CASES: Mapping[str, RuleCases] = {
    "X903": RuleCases(
        fires=lambda: _with(is_vehicle_named=False),
        silent=lambda: _with(is_vehicle_named=True),
        boundary=lambda: found(PLAIN, ARDUPILOT),
    ),
    # The threshold in a file is watched; ArduPilot's own default of 10.5 V is no wish of anybody's.
    "X904": RuleCases(
        fires=lambda: _watched("BATT_LOW_VOLT,21\nBATT_FS_LOW_ACT,2\n"),
        silent=lambda: found(PLAIN, ARDUPILOT, "BATT_LOW_VOLT,21\n", battery=None),
        boundary=lambda: _watched("BATT_LOW_VOLT,0\nBATT_FS_LOW_ACT,2\n"),
    ),
    "X909": RuleCases(
        # Air is at 2500 m 1.1314 times as hard on the power as at sea level, at 4500 m 1.2556 times; 100 m up
        # 1.0048 times, which the model does not count.
        fires=lambda: _home_unknown(1.131),
        boundary=lambda: _home_unknown(1.256 * 1.0048),
        silent=lambda: found(OUT_AND_BACK, battery=Battery(capacity_wh=1.25 * NEED_WH * 1.131)),
    ),
    "X908": RuleCases(
        fires=lambda: _fetched_apart(_mark("22", "500.0"), _mark("15", "1000.0")),
        silent=lambda: _fetched_apart(_mark("22", "500.0"), _mark("22", "500.0")),
        boundary=lambda: _fetched_apart(_mark("22", "500.0"), _mark("15", "500.0")),
    ),
    # What a reader refuses with a sentence is no bug, but X901.
    "X905": RuleCases(
        fires=lambda: _read(IndexError("list index out of range")),
        silent=lambda: found(PLAIN, ARDUPILOT),
        boundary=lambda: _read(MissionFileError("is empty", source="a.plan")),
    ),
}
