"""When items are reached and left: an item with a hold is not done when the hold begins."""

from __future__ import annotations

import pytest
from made_missions import mission, rtl, speed, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.service.preflight import check
from planner.vehicle.library import load_vehicle

HOLD_S = 120.0


@pytest.mark.parametrize("autopilot", [Autopilot.STEP, Autopilot.PX4, Autopilot.ARDUPILOT])
def test_a_hold_lies_between_reaching_and_leaving(autopilot: Autopilot) -> None:
    vehicles = {"px4": "px4-sih-quad", "ardupilot": "arducopter-sitl-quad"}
    vehicle = load_vehicle(vehicles.get(autopilot.value, "falkowski-2023-quadrotor"))
    held, plain = (
        check(
            mission(
                takeoff(50), waypoint(300, 50, hold_s=hold_s), speed(8.0), waypoint(600, 50), rtl()
            ),
            vehicle,
        ).items
        for hold_s in (HOLD_S, 1.0)
    )
    reached, passed = held[1], plain[1]
    assert reached.arrival_s is not None
    assert reached.left_s is not None
    assert reached.left_s - reached.arrival_s == pytest.approx(HOLD_S, abs=3.0)
    assert reached.arrival_s == pytest.approx(passed.arrival_s, abs=0.1)
    assert reached.energy_used_wh == pytest.approx(passed.energy_used_wh, nan_ok=True)
    # The speed is set once the hold is over; a place that is flown through is left when it is reached.
    assert held[2].arrival_s == held[2].left_s == reached.left_s
    assert all((one.left_s or 0.0) >= (one.arrival_s or 0.0) for one in held)
