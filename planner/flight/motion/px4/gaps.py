"""Gaps: what PX4 would do that its motion here leaves out, as findings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.mission.stage import Stage
    from planner.vehicle.parameters.px4 import Px4Parameters


def gap_findings(stages: Sequence[Stage], parameters: Px4Parameters) -> tuple[Finding, ...]:
    """Return a finding for each setting that the motion of these stages does not follow."""
    lands = parameters.return_land_delay_s >= 0.0 and parameters.disarm_delay_s >= 0.0
    if lands:
        return ()
    returning = next((stage for stage in stages if stage.kind is StageKind.RETURN), None)
    item = None if returning is None else returning.item
    gaps = []
    if returning is not None and parameters.return_land_delay_s < 0.0:
        gaps.append(
            f"RTL_LAND_DELAY {parameters.return_land_delay_s:g} s keeps the vehicle over home: time "
            "and energy end with its arrival there"
        )
    if returning is not None and parameters.disarm_delay_s < 0.0:
        gaps.append(
            f"COM_DISARM_LAND {parameters.disarm_delay_s:g} s does not disarm: the flight is taken to "
            "end as it has landed"
        )
    if not gaps:
        return ()
    from planner.catalogue.time import SETTING_NOT_FOLLOWED

    return tuple(SETTING_NOT_FOLLOWED.finding(gap, item=item) for gap in gaps)
