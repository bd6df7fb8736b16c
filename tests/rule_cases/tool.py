"""Cases of the rules about the tool itself: no vehicle, checks that could not be made."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rule_cases.case import ARDUPILOT, PLAIN, PLENTY, RuleCases, found, vehicle_of

from planner.service.preflight import check_mission
from planner.setup import Setup
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.findings import Finding


def _with(*, is_vehicle_named: bool) -> Iterable[Finding]:
    setup = Setup(vehicle=vehicle_of(ARDUPILOT), battery=PLENTY, is_vehicle_named=is_vehicle_named)
    return check_mission(PLAIN, setup).findings


CASES: Mapping[str, RuleCases] = {
    "X903": RuleCases(
        fires=lambda: _with(is_vehicle_named=False),
        silent=lambda: _with(is_vehicle_named=True),
        boundary=lambda: found(PLAIN, ARDUPILOT),
    ),
    # The threshold in a file is watched; ArduPilot's own default of 10.5 V is no wish of anybody's.
    "X904": RuleCases(
        fires=lambda: found(
            PLAIN, ARDUPILOT, "BATT_LOW_VOLT,21\n", battery=Battery(capacity_wh=177.0)
        ),
        silent=lambda: found(PLAIN, ARDUPILOT, "BATT_LOW_VOLT,21\n", battery=None),
        boundary=lambda: found(
            PLAIN, ARDUPILOT, "BATT_LOW_VOLT,0\n", battery=Battery(capacity_wh=177.0)
        ),
    ),
}
