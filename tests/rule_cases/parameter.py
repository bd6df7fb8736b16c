"""Family P: parameters of the autopilot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rule_cases.case import ARDUPILOT, PLAIN, PX4, RuleCases, found, vehicle_of

from planner.autopilot import TARGETS
from planner.site_profile import ExpectedValue, SiteProfile
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding


def without(*names: str) -> tuple[Finding, ...]:
    """Return what is reported where a file gives PX4's defaults of all a flight depends on but some."""
    rows = parameter_table(Px4Parameters).values()
    text = "".join(f"{row.now.name},{row.default}\n" for row in rows if row.now.name not in names)
    return found(PLAIN, PX4, text, vehicle=vehicle_of(ARDUPILOT))


def expecting(value: float) -> tuple[Finding, ...]:
    """Return what a profile that asks for RTL_ALT from 2000 to 3000 cm tells of a value."""
    expected = ExpectedValue(name="RTL_ALT", low=2000.0, high=3000.0)
    profile = SiteProfile(source="site.toml", expected=(expected,))
    return found(PLAIN, ARDUPILOT, f"RTL_ALT,{value!r}\n", profile=profile)


CASES: Mapping[str, RuleCases] = {
    "P101": RuleCases(
        fires=lambda: without("MPC_XY_CRUISE"), boundary=without, silent=lambda: found(PLAIN)
    ),
    "P102": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "WPNAV_SPEED,500\nWP_SPD,10\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "WPNAV_SPEED,500\nWP_SPD,5\n"),
        fires_at_boundary=True,  # as a warning: they mean the same
        silent=lambda: found(PLAIN, ARDUPILOT, "WPNAV_SPEED,500\n"),
    ),
    "P103": RuleCases(
        fires=lambda: expecting(3001.0),
        boundary=lambda: expecting(3000.0),
        silent=lambda: expecting(2500.0),
    ),
    "P104": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT,1500\nRTL_ALT,3000\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT,1500\nRTL_ALT,1500\n"),
        silent=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT,1500\n"),
    ),
    "P105": RuleCases(
        fires=lambda: found(PLAIN, PX4, "MPC_XY_CRUISE,50.1\n"),
        boundary=lambda: found(PLAIN, PX4, "MPC_XY_CRUISE,50\n"),
        silent=lambda: found(PLAIN, PX4, "MPC_XY_CRUISE,12\n"),
    ),
    "P106": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "MPC_XY_CRUISE,8\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "SERVO1_MIN,1100\n"),  # could be of either
        silent=lambda: found(PLAIN, PX4, "MPC_XY_CRUISE,8\n"),
    ),
    "P107": RuleCases(
        fires=lambda: found(PLAIN, PX4, "MPC_XY_CRUISE,12.1\nMPC_XY_VEL_MAX,12\n"),
        boundary=lambda: found(PLAIN, PX4, "MPC_XY_CRUISE,12\nMPC_XY_VEL_MAX,12\n"),
        silent=lambda: found(PLAIN, PX4, "MPC_XY_CRUISE,11.9\nMPC_XY_VEL_MAX,12\n"),
    ),
    "P108": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT_M,450.1\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT_M,450\n"),  # 30 times the 15 m of default
        silent=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT_M,100\n"),
    ),
    "P109": RuleCases(
        fires=lambda: found(
            PLAIN, ARDUPILOT, "WPNAV_SPEED,500\n", target=TARGETS["arducopter-4.8"]
        ),
        boundary=lambda: found(
            PLAIN, ARDUPILOT, "WPNAV_SPEED,500\n", target=TARGETS["arducopter-4.7"]
        ),
        fires_at_boundary=True,  # renamed in 4.7
        silent=lambda: found(
            PLAIN, ARDUPILOT, "WPNAV_SPEED,500\n", target=TARGETS["arducopter-4.6"]
        ),
    ),
    "P110": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "WPNAV_SPEEED,500\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "WPNAV_SPEEEED,500\n"),  # two letters away
        silent=lambda: found(PLAIN, ARDUPILOT, "WPNAV_SPEED,500\n"),
    ),
}
