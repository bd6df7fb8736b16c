"""Rules on the heights a fence of parameters allows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.catalogue.fence import FENCE_HEIGHT
from planner.findings import Severity
from planner.mission.route.stage import StageKind
from planner.rules.fence_settings import limits_from_parameters

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.rules.assessment import Assessment

_SLACK_M = 0.01
"""Rounding of files. [m]"""
_MOST_RETURNS = 200
"""Places looked at, spread over the flight."""
_ON_THE_GROUND = {StageKind.LAND, StageKind.RETURN, StageKind.DELAY}


def check_fence_heights(a: Assessment) -> Iterator[Finding]:
    """Yield findings where the flight, or a return, leaves the heights the parameters allow."""
    limit, stages = limits_from_parameters(a.fence_parameters), a.route.stages
    if not stages:
        return
    if limit.ceiling_m is not None:
        highest = max(stages, key=lambda stage: stage.height_m)
        if highest.height_m > limit.ceiling_m + _SLACK_M:
            yield FENCE_HEIGHT.finding(
                f"{quantity.beside(highest.height_m, limit.ceiling_m, quantity.height)} above home "
                f"are flown, {limit.ceiling_name} is {quantity.height(limit.ceiling_m)}",
                item=highest.item,
                place=a.mission.items[highest.item - 1].place,
            )
        elif (return_m := _highest_return_m(a)) > limit.ceiling_m + _SLACK_M:
            climbs = quantity.beside(return_m, limit.ceiling_m, quantity.height)
            returns = [s.item for s in stages if s.kind is StageKind.RETURN]
            yield FENCE_HEIGHT.finding(
                f"a return climbs to {climbs} above home, "
                f"{limit.ceiling_name} is {quantity.height(limit.ceiling_m)}",
                severity=Severity.ERROR if returns else Severity.WARNING,
                item=returns[0] if returns else None,
                place=a.mission.items[returns[0] - 1].place if returns else None,
                fix="lower the return altitude, or raise the limit",
            )
    if limit.floor_m is not None:
        flying = [stage for stage in stages if stage.kind not in _ON_THE_GROUND]
        lowest = min(flying, key=lambda stage: stage.height_m, default=None)
        if lowest is not None and lowest.height_m < limit.floor_m - _SLACK_M:
            yield FENCE_HEIGHT.finding(
                f"{quantity.beside(lowest.height_m, limit.floor_m, quantity.height)} above home are flown, "
                f"{limit.floor_name} is "
                f"{quantity.height(limit.floor_m)}",
                item=lowest.item,
                place=a.mission.items[lowest.item - 1].place,
                fix="fly higher, or lower the limit",
            )


def _highest_return_m(a: Assessment) -> float:
    """Return the greatest height above home that the vehicle's own returns climb to, as it flies them.

    ArduPilot's stay below its fence; PX4's count from the place they lead to.
    """
    returns = a.returns
    ends = returns.stage_ends
    if len(ends) > _MOST_RETURNS:
        ends = ends[np.linspace(0, len(ends) - 1, _MOST_RETURNS).astype(np.intp)]
    paths = returns.corners_m(returns.points(ends, np.ones(len(ends))))
    return max(float(corners[:, 2].max()) for corners in paths)
