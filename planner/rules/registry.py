"""Every rule that judges a flight, in the order they are asked."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.catalogue.mission import LANDING_ALTITUDE
from planner.rules.altitude import (
    check_frames,
    check_home,
    check_level_ground,
    check_relative_altitudes,
)
from planner.rules.energy import (
    check_battery,
    check_discharge_rate,
    check_return,
    check_risk,
    check_voltage,
)
from planner.rules.envelope import (
    check_air_and_mass,
    check_autopilot,
    check_climbs,
    check_conditions,
    check_heights,
    check_power_known,
    check_rates,
    check_responses,
    check_speed,
    check_vertical_speeds,
)
from planner.rules.fence import check_fence
from planner.rules.lift import check_lift
from planner.rules.pack import check_cold, check_pack_voltage
from planner.rules.structure import (
    check_curves,
    check_endless,
    check_home_place,
    check_landing_altitude,
    check_loops,
    check_support,
    check_unset_values,
)
from planner.rules.wind import check_wind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.findings import Finding, Rule
    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment
    from planner.selection import Selection
    from planner.vehicle.parameters.resolve import FlightParameters

    Check = Callable[[Assessment], Iterator[Finding]]

CHECKS: tuple[Check, ...] = (
    check_battery,
    check_return,
    check_risk,
    check_voltage,
    check_discharge_rate,
    check_speed,
    check_vertical_speeds,
    check_climbs,
    check_heights,
    check_rates,
    check_air_and_mass,
    check_power_known,
    check_lift,
    check_conditions,
    check_pack_voltage,
    check_cold,
    check_responses,
    check_autopilot,
    check_endless,
    check_support,
    check_unset_values,
    check_curves,
    check_loops,
    check_frames,
    check_relative_altitudes,
    check_level_ground,
    check_home,
    check_home_place,
    check_wind,
    check_fence,
)
"""What is asked of every flight."""

OPTIONAL_CHECKS: tuple[tuple[Rule, Check], ...] = ((LANDING_ALTITUDE, check_landing_altitude),)
"""What is asked only where the rule is selected."""


def check_case(a: Assessment, selection: Selection) -> tuple[Finding, ...]:
    """Return what every rule has to say about a flight, those off by default where selected."""
    checks = [*CHECKS, *_further_checks(a)]
    checks += [check for rule, check in OPTIONAL_CHECKS if selection.asks_for(rule.code)]
    return tuple(finding for check in checks for finding in check(a))


def check_unflown(
    mission: Mission, autopilot: Autopilot, parameters: FlightParameters | None
) -> tuple[Finding, ...]:
    """Return what can be said about a file in which nothing is flown: about its fence."""
    if not mission.fence:
        return ()
    from planner.rules.fence_alone import check_fence_alone

    return tuple(check_fence_alone(mission, autopilot, parameters))


def _further_checks(a: Assessment) -> Iterator[Check]:
    """Yield what is asked of flights with an autopilot, a terrain, a profile: imported only then."""
    if a.target is not None and a.target.autopilot is Autopilot.PX4:
        from planner.rules.px4_mission import PX4_CHECKS

        yield from PX4_CHECKS
    if a.target is not None and a.target.autopilot is Autopilot.ARDUPILOT:
        from planner.rules.ardupilot_mission import ARDUPILOT_CHECKS

        yield from ARDUPILOT_CHECKS
    if a.parameters is not None and a.battery is not None:
        from planner.rules.failsafe import FAILSAFE_CHECKS

        yield from FAILSAFE_CHECKS
    if a.terrain is not None:
        from planner.rules.terrain import TERRAIN_CHECKS

        yield from TERRAIN_CHECKS
    if a.profile is not None:
        from planner.rules.site import SITE_CHECKS

        yield from SITE_CHECKS
