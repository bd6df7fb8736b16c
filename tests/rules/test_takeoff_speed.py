"""PX4's speed of take-offs against its limits, by flights of PX4 1.17."""

from __future__ import annotations

import pytest
from made_missions import mission, takeoff, waypoint
from rule_cases.case import PX4, found

from planner.findings import Severity

MISSION = mission(takeoff(20), waypoint(100, 20))


@pytest.mark.parametrize(
    ("text", "is_reported"),
    [
        ("MPC_Z_VEL_MAX_UP,1.15\n", True),  # below 1.5/1.3 = 1.1538
        ("MPC_Z_VEL_MAX_UP,1.154\n", False),
        ("MPC_TKO_SPEED,3.91\n", True),  # above 1.3 times 3 m/s
        ("MPC_TKO_SPEED,3.9\n", False),
    ],
)
def test_a_takeoff_that_stops_again_and_again_is_a_warning(text: str, *, is_reported: bool) -> None:
    said = [f for f in found(MISSION, PX4, text) if f.code == "P107" and f.item == 1]
    assert [f.severity for f in said] == [Severity.WARNING] * is_reported


def test_its_stops_are_told_with_their_speed() -> None:
    """Flown every 2.2 m, at 0.6 m/s."""
    [said] = [f for f in found(MISSION, PX4, "MPC_Z_VEL_MAX_UP,1\n") if f.code == "P107" and f.item]
    assert said.message == (
        "MPC_TKO_SPEED, 1.5 m/s, is more than 1.3 times MPC_Z_VEL_MAX_UP, 1.0 m/s: up to MPC_LAND_ALT1 the "
        "take-off stops every 2.2 m, 0.6 m/s on average"
    )


@pytest.mark.parametrize(
    ("text", "stays"),
    [
        ("MPC_TKO_SPEED,0.3\n", True),  # flown: disarmed on the ground after 11 s
        ("MPC_TKO_SPEED,0.35\n", False),  # flown
        ("MPC_Z_VEL_ALL,0.5\n", True),  # 0.6 of it
        ("MPC_Z_VEL_ALL,0.55\n", False),
    ],
)
def test_px4_does_not_take_off_at_0_3_m_s(text: str, *, stays: bool) -> None:
    said = [f.severity for f in found(MISSION, PX4, text) if f.code == "T110"]
    assert said == [Severity.ERROR] * stays
