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
        (item(195, north(50), None, params=(0.0, 0.0, 0.0, 0.0)), "the altitude"),
        # hover and capture, as QGroundControl writes it; ArduCopter 4.7.0-dev takes them all
        (item(2000, None, None, params=(0.0, 0.0, 1.0, 0.0), frame=2), None),
        (item(206, None, None, params=(5.0, 0.0, 1.0, 0.0), frame=2), None),
        (item(178, None, None, params=(1.0, 5.0, -1.0, 0.0), frame=2), None),
        (item(2000, None, None, params=(0.0, 0.0, 1.0, None), frame=2), "parameter 4"),
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


@pytest.mark.parametrize("command", [80, 201])
@pytest.mark.parametrize(
    ("frame", "mode", "is_refused"),
    [
        # PX4 1.17 answers INVALID_PARAM1 (6) to 1, 2 and 4 with a place, ACCEPTED to 0 and 3
        *((3, mode, mode not in {0.0, 3.0}) for mode in (0.0, 1.0, 2.0, 3.0, 4.0)),
        # and ACCEPTED without one to 0 and 1
        *((2, mode, mode > 2.0) for mode in (0.0, 1.0, 2.0, 3.0, 4.0)),
        (0, 3.9, False),  # a whole number is made of it
    ],
)
def test_px4_refuses_a_region_of_interest_by_its_mode_and_frame(
    command: int, frame: int, mode: float, *, is_refused: bool
) -> None:
    place = north(50) if frame != 2 else None
    look = item(command, place, 0.0, params=(mode, 0.0, 0.0, 0.0), frame=frame)
    made = mission(takeoff(30), look, rtl(), autopilot=Autopilot.PX4)
    found = check(made, load_vehicle("px4-quad-2kg"), battery=Battery(capacity_wh=500.0)).findings
    refused = [one.message for one in found if one.code == "M105"]
    assert len(refused) == is_refused
    if refused:
        assert f"with {mode:g} for parameter 1 in frame {frame}" in refused[0]
