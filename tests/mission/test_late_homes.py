"""Homes that ArduPilot moves once the next item has begun, or right before one that keeps its height.

Flown with ArduCopter 4.7.0-dev: a home moved by 3, 8, 20 or 50 m behind a photo, right before a return, and
the vehicle hovered over the old home for as long as it was watched; by 0 or 1 m it landed.  40 m down before
a LOITER_TO_ALT of 30 m it flew into the ground.  60 m up before LOITER_TURNS here, altitude 0: it climbed by
60 m; before a waypoint of altitude 0 behind one it held at: it kept its height.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.mission.route.route import make_route

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

CAMERA = item(203, frame=2)
HELD = waypoint(100.0, 30.0, hold_s=2.0)
DELAY = item(93, params=(1.0, -1.0, -1.0, -1.0), frame=2)
TO_HEIGHT = item(31, north(200.0), 30.0)


def home(up_m: float) -> MissionItem:
    return item(179, north(0.0), up_m)


def wrong(*items: MissionItem, dialect: Autopilot = Autopilot.ARDUPILOT) -> list[str]:
    """Return the codes of the errors that name a home."""
    route = make_route(mission(takeoff(30.0), *items), dialect=dialect)
    return [
        found.code
        for found in route.findings
        if found.severity is Severity.ERROR and "DO_SET_HOME" in found.message
    ]


@pytest.mark.parametrize(
    ("up_m", "fires"), [(1.0, False), (1.1, True), (-1.0, False), (-3.0, True)]
)
def test_a_return_does_not_end_where_home_moves_as_it_begins(up_m: float, *, fires: bool) -> None:
    assert wrong(HELD, CAMERA, home(up_m), rtl()) == (["T101"] if fires else [])
    assert wrong(HELD, CAMERA, home(up_m), DELAY, rtl()) == []
    assert wrong(HELD, CAMERA, home(up_m), rtl(), dialect=Autopilot.PX4) == []


def test_a_home_above_the_sea_counts_by_its_height_above_the_one_before() -> None:
    for altitude_m, fires in ((400.0, False), (408.0, True)):
        there = item(179, north(0.0), altitude_m, frame=0)
        assert wrong(HELD, CAMERA, there, rtl()) == (["T101"] if fires else [])


def test_a_height_flown_to_counts_from_the_home_that_moves_meanwhile() -> None:
    assert wrong(HELD, CAMERA, home(-40.0), TO_HEIGHT, rtl()) == ["T102"]
    assert wrong(HELD, CAMERA, home(-0.4), TO_HEIGHT, rtl()) == []
    assert wrong(HELD, home(-40.0), TO_HEIGHT, rtl()) == []
    assert wrong(HELD, CAMERA, home(-40.0), DELAY, TO_HEIGHT, rtl()) == []


@pytest.mark.parametrize(
    ("there", "fires"),
    [
        (item(18, 0.0, 0.0, longitude_deg=0.0, params=(1.0, 0.0, 30.0, None)), True),
        (item(18, 0.0, 90.0, longitude_deg=0.0, params=(1.0, 0.0, 30.0, None)), False),
        (item(19, 0.0, 0.0, longitude_deg=0.0, params=(5.0, 0.0, 0.0, None)), True),
        (item(16, north(200.0), 0.0), False),
        (item(19, north(200.0), 0.0, params=(5.0, 0.0, 0.0, None)), True),
        (item(21, 0.0, 0.0, longitude_deg=0.0), False),
        (DELAY, False),
    ],
)
def test_altitude_0_is_that_by_the_home_before_but_of_a_waypoint_behind_a_waypoint(
    there: MissionItem, *, fires: bool
) -> None:
    behind = (waypoint(300.0, 90.0), rtl()) if there.command != 21 else ()
    assert wrong(HELD, home(60.0), there, *behind) == (["T102"] if fires else [])
    if there.command == 16:  # behind a take-off there is no waypoint before
        assert wrong(home(60.0), there, *behind) == ["T102"]
