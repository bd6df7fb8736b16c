"""Values that ArduPilot refuses at upload."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, takeoff

from planner.autopilot import Autopilot
from planner.service.preflight import check
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.mission.items import MissionItem

VEHICLE = load_vehicle("falkowski-2023-quadrotor")


def unset(*items: MissionItem, autopilot: Autopilot) -> list[Finding]:
    made = mission(takeoff(100), *items, rtl(), autopilot=autopilot)
    found = check(made, VEHICLE, battery=Battery(capacity_wh=500.0)).findings
    return [finding for finding in found if finding.code == "M112"]


@pytest.mark.parametrize(
    ("one", "what"),
    [
        # p4 may be NaN in a waypoint; p1 not, nor anything in a delay (AP_Mission's nan_mask).
        (item(16, north(50), 100.0, params=(0.0, 0.0, 0.0, None)), None),
        (item(16, north(50), 100.0, params=(None, 0.0, 0.0, None)), "parameter 1"),
        (item(93, params=(5.0, None, None, None), frame=2), "parameter 2"),
        (item(19, north(50), 100.0, params=(5.0, 0.0, 0.0, None)), "parameter 4"),
        (item(36, north(50), 100.0, params=(0.0, None, None, None)), None),  # an arc
        (item(36, north(50), 100.0, params=(None, None, None, None)), "parameter 1"),
        (item(85, north(50), 0.0, params=(0.0, 0.0, None, None)), None),  # VTOL_LAND
        (item(85, north(50), 0.0, params=(0.0, None, None, None)), "parameter 2"),
        (item(16, north(50), None), "the altitude"),
        (item(206, None, None, params=(5.0, 0.0, 1.0, 0.0), frame=2), "the altitude"),
    ],
)
def test_a_value_that_is_not_set_is_refused_by_ardupilot_alone(
    one: MissionItem, what: str | None
) -> None:
    assert unset(one, autopilot=Autopilot.PX4) == []
    found = unset(one, autopilot=Autopilot.ARDUPILOT)
    assert len(found) == (0 if what is None else 1)
    if what is not None:
        assert f"with {what} not set" in found[0].message
        assert found[0].item == 2


def test_many_values_that_are_not_set_are_one_finding() -> None:
    delay = item(93, params=(5.0, None, None, None), frame=2)
    [finding] = unset(delay, delay, delay, autopilot=Autopilot.ARDUPILOT)
    assert "(and 2 more)" in finding.message
