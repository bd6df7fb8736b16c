"""PX4's own returns to the mission's landing, by flights of PX4 1.17 with its defaults.

RTL_RETURN_ALT 30 m, MPC_XY_CRUISE 5 m/s, MPC_Z_V_AUTO_DN 1.5 m/s: 20 s and 100 m to sink 30 m.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint
from made_terrain import ground
from rule_cases.case import PX4, found

from planner.findings import Severity

if TYPE_CHECKING:
    from planner.mission.items import Mission, MissionItem

E, W = Severity.ERROR, Severity.WARNING


def land(metres_north: float) -> MissionItem:
    return item(21, north(metres_north), 0.0)


def told(one: Mission, parameters: str) -> list[Severity]:
    return [f.severity for f in found(one, PX4, parameters) if f.code == "T110"]


FAR = mission(takeoff(10), waypoint(450, 10), land(110))
"""Flown with RTL_TYPE 1, returning 336 m from the landing: on the ground 207 m short of it."""


@pytest.mark.parametrize(
    ("parameters", "severities"),
    [
        ("", []),
        ("RTL_TYPE,0\n", []),
        ("RTL_TYPE,1\n", [E]),
        ("RTL_TYPE,2\n", []),
        ("RTL_TYPE,3\n", [E]),
        ("RTL_TYPE,4\n", []),
        # No return climbs from 10 m.
        ("RTL_TYPE,1\nRTL_RETURN_ALT,5\n", []),
    ],
)
def test_a_return_that_climbs_sinks_on_its_way_to_a_far_landing(
    parameters: str, severities: list[Severity]
) -> None:
    assert told(FAR, parameters) == severities


def test_a_landing_nearer_than_home_counts_with_type_3() -> None:
    # Flown: 44 m short.
    assert told(mission(takeoff(10), waypoint(250, 10), land(60)), "RTL_TYPE,3\n") == [E]


@pytest.mark.parametrize("start", [(item(189),), ()])
def test_a_place_before_the_landing_is_flown_to_level(start: tuple[MissionItem, ...]) -> None:
    # Flown with DO_LAND_START and a waypoint: as predicted.  Without DO_LAND_START it is none of its part.
    one = mission(takeoff(10), waypoint(300, 10), *start, waypoint(140, 15), land(110))
    assert told(one, "RTL_TYPE,1\n") == ([] if start else [E])


@pytest.mark.parametrize(("north_m", "severity"), [(99.0, W), (101.0, E)])
def test_how_far_it_flies_while_it_sinks_decides(north_m: float, severity: Severity) -> None:
    one = mission(takeoff(10), waypoint(60, 10), land(north_m))
    assert told(one, "RTL_TYPE,1\n") == [severity]
    over_ground = found(one, PX4, "RTL_TYPE,1\n", terrain=ground(0.0))
    left_open = [f for f in over_ground if f.code == "X904" and "sinks on its way" in f.message]
    assert bool(left_open) is (severity is W)


@pytest.mark.parametrize(("height_m", "severities"), [(30.0, [E]), (32.0, [])])
def test_a_return_above_its_height_is_level(height_m: float, severities: list[Severity]) -> None:
    one = mission(takeoff(height_m), waypoint(450, height_m), land(110))
    assert told(one, "RTL_TYPE,1\n") == severities


def test_the_mission_s_own_return_sinks_so_too() -> None:
    assert told(mission(takeoff(10), waypoint(500, 10), rtl(), land(700)), "RTL_TYPE,1\n") == [E]
