"""Rally points that a vehicle holds in frames its return does not know."""

from __future__ import annotations

import pytest

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.link.mission import MissionKind, WireItem, mission_of_lists
from planner.link.telemetry import VehicleIdentity


@pytest.mark.parametrize(
    ("autopilot", "frame", "is_error"),
    [
        # Flown by PX4 1.17: "RTL: unsupported MAV_FRAME" in frame 6, it hovers where the return began.
        (Autopilot.PX4, 6, True),
        (Autopilot.PX4, 5, True),
        (Autopilot.PX4, 10, True),
        (Autopilot.PX4, 3, False),
        (Autopilot.ARDUPILOT, 6, False),
    ],
)
def test_a_rally_point_in_a_frame_that_px4_does_not_return_to_is_an_error(
    autopilot: Autopilot, frame: int, *, is_error: bool
) -> None:
    point = WireItem(command=5100, frame=frame, x=473977420, y=85455940, z=20.0)
    number = {Autopilot.PX4: 12, Autopilot.ARDUPILOT: 3}[autopilot]  # MAV_AUTOPILOT
    identity = VehicleIdentity(system=1, component=1, autopilot_number=number, vehicle_type=2)
    read = mission_of_lists({MissionKind.RALLY: (point,)}, identity, home=None, source="held")
    assert len(read.rally) == 1
    told = [one for one in read.findings if "stays in the air" in one.message]
    assert [(one.code, one.severity) for one in told] == [("L159", Severity.ERROR)] * is_error
