"""Waits on the ground: what idling motors take of the battery before the take-off."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, rtl, takeoff, waypoint

from planner.findings import Severity
from planner.service.preflight import check
from planner.setup import Reserve
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult
    from planner.vehicle.model import VehicleModel

IDLES = load_vehicle("arducopter-sitl-quad")
"""With 28.3 W of idling motors and avionics, measured on the ground between its flights."""


def waiting(wait_s: float, vehicle: VehicleModel = IDLES, *, reserve: float = 0.2) -> CheckResult:
    wait = (item(93, params=(wait_s, -1.0, -1.0, -1.0), frame=2),) * (wait_s > 0.0)
    stays = parameters_from_text(b"DISARM_DELAY 0\nAUTO_OPTIONS 3\n", source="p.param")
    return check(
        mission(*wait, takeoff(20), waypoint(300, 20), rtl()),
        vehicle,
        battery=Battery(capacity_wh=60.0),
        parameters=stays,
        reserve=Reserve(fraction=reserve),
    )


@pytest.mark.parametrize("leaves_wh", [1.0, 20.0])
@pytest.mark.parametrize("has_loads", [True, False])
@pytest.mark.parametrize(("share", "severities"), [(0.99, 1), (1.01, 2)])
def test_idling_before_the_take_off_takes_what_the_flight_leaves_and_a_twentieth_at_most(
    share: float, severities: int, *, has_loads: bool, leaves_wh: float
) -> None:
    vehicle = IDLES if has_loads else replace(IDLES, loads=None)
    flown = waiting(0.0, vehicle).assessment
    assert flown is not None
    reserve = 0.2 + (flown.left_wh - leaves_wh) / 60.0
    # Without loads of its own 0.12 of the power of hover, the most of models/priors/multicopter.toml.
    idle_w = 0.12 * flown.flight.hover_near_home_w
    if has_loads:
        assert vehicle.loads is not None
        idle_w = vehicle.loads.ground_idle_w + vehicle.loads.avionics_w
    least_wh = min(leaves_wh, 0.05 * 60.0)
    result = waiting(share * 3600.0 * least_wh / idle_w, vehicle, reserve=reserve)
    told = [one.severity for one in result.findings if one.code == "T107"]
    assert sorted(told) == [Severity.WARNING, Severity.ERROR][:severities]
