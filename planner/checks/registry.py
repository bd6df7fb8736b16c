"""Every rule that judges a case, in the order they are asked."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.checks.energy import (
    check_battery,
    check_discharge_rate,
    check_voltage,
    check_way_home,
)
from planner.checks.envelope import (
    check_air_and_mass,
    check_autopilot,
    check_climbs,
    check_conditions,
    check_heights,
    check_power_known,
    check_rates,
    check_speed,
)
from planner.checks.fence import check_fence
from planner.checks.structure import (
    check_curves,
    check_endless,
    check_support,
    check_unset_values,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.checks.case import Case
    from planner.findings import Finding

CHECKS: tuple[Callable[[Case], Iterator[Finding]], ...] = (
    check_battery,
    check_way_home,
    check_voltage,
    check_discharge_rate,
    check_speed,
    check_climbs,
    check_heights,
    check_rates,
    check_air_and_mass,
    check_power_known,
    check_conditions,
    check_autopilot,
    check_endless,
    check_support,
    check_unset_values,
    check_curves,
    check_fence,
)


def check_case(case: Case) -> tuple[Finding, ...]:
    """Return what every rule has to say about a case."""
    return tuple(finding for check in CHECKS for finding in check(case))
