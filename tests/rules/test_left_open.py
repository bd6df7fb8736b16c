"""What a mission's file leaves open: a load that is picked up on the way."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, rtl, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PX4, found

from planner.findings import Severity

if TYPE_CHECKING:
    from planner.autopilot import Autopilot


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize(
    ("does", "late", "parameters", "payload_kg", "is_error"),
    [
        (1.0, True, "", 0.0, True),
        (1.0, True, "", 0.4, False),  # carried all the way: more than is flown
        (0.0, True, "", 0.0, False),  # lets go
        (1.0, False, "", 0.0, False),  # before the take-off: in the take-off mass
        (1.0, True, "GRIP_ENABLE,0\n", 0.0, False),  # has none
    ],
)
def test_a_load_picked_up_on_the_way_needs_its_mass(
    does: float,
    parameters: str,
    payload_kg: float,
    autopilot: Autopilot,
    *,
    late: bool,
    is_error: bool,
) -> None:
    grab = item(211, frame=2, params=(1.0, does, 0.0, 0.0))
    start = takeoff(20)
    items = (start, grab) if late else (grab, start)
    if parameters and autopilot is PX4:
        parameters = "1\t1\tPD_GRIPPER_EN\t0\t6\n"
    flown = found(
        mission(*items, waypoint(100, 20), rtl()), autopilot, parameters, payload_kg=payload_kg
    )
    graver = [one for one in flown if one.code == "T102" and one.severity is Severity.ERROR]
    assert bool(graver) is is_error
