"""Rules on wind against what is known of the vehicle; its headway is found while it flies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.catalogue.wind import WIND_BEYOND_MODEL

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.rules.assessment import Assessment


def check_wind(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where reference steps are flown in wind as fast as the vehicle."""
    limit = a.vehicle.valid_for.speed_m_s
    wind_m_s = a.conditions.wind.speed_m_s
    if a.autopilot is not Autopilot.STEP or limit is None or wind_m_s < limit.high:
        return
    yield WIND_BEYOND_MODEL.finding(
        f"{quantity.speed(wind_m_s)} of wind, the model was identified up to "
        f"{quantity.speed(limit.high)}: no way against it is known"
    )
