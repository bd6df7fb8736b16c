"""The queue before a leg of no length: ArduPilot carries out its first item alone.

Flown with ArduCopter 4.7.0-dev: TAKEOFF, speed 1, a place with a hold, a photo, speed 10, then the same place
(or a LOITER_TIME 0, or a TAKEOFF, there): the next leg is flown at 1 m/s.  A NAV_DELAY 0 lasts a second, and
the speed counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import HOME, item, mission, north, rtl, speed, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.mission.route.route import make_route

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

CAMERA = item(203, frame=2)
FENCE_OFF = item(207, frame=2, params=(0.0, 0.0, 0.0, 0.0))
HOME_THERE = item(179, north(50.0), 400.0, frame=0)
LAST = waypoint(500.0, 30.0)


def flown(
    *ahead: MissionItem, dialect: Autopilot | None = Autopilot.ARDUPILOT
) -> tuple[float | None, list[Severity]]:
    """Return the speed of the way to the last place, and how severe what is told of the queue is."""
    route = make_route(
        mission(takeoff(30.0), speed(1.0), waypoint(100.0, 30.0, hold_s=1.0), *ahead, LAST, rtl()),
        dialect=dialect,
    )
    last = next(one for one in route.stages if one.item == 4 + len(ahead))
    told = [found.severity for found in route.findings if found.code == "T115"]
    return last.speed_m_s, told


@pytest.mark.parametrize(
    ("there", "expected_m_s"),
    [
        (waypoint(100.0, 30.0), 1.0),
        (item(19, north(100.0), 30.0), 1.0),
        (item(82, north(100.0), 30.0), 1.0),
        (item(22, HOME.latitude_deg, 30.0), 1.0),
        (item(22, HOME.latitude_deg, 25.0), 1.0),
        (item(92, params=(0.0, 0.0, 0.0, 0.0)), 1.0),
        (waypoint(100.02, 30.0), 10.0),
        (waypoint(100.0, 30.02), 10.0),
        (waypoint(100.0, 30.0, hold_s=1.0), 10.0),
        (item(22, HOME.latitude_deg, 31.0), 10.0),
        (item(93, params=(0.0, -1.0, -1.0, -1.0)), 10.0),
    ],
)
def test_leg_of_no_length_drops_all_but_the_first(there: MissionItem, expected_m_s: float) -> None:
    assert flown(CAMERA, speed(10.0), there) == (
        expected_m_s,
        [Severity.WARNING] if expected_m_s == 1.0 else [],
    )


def test_first_of_the_queue_is_carried_out() -> None:
    assert flown(speed(10.0), CAMERA, waypoint(100.0, 30.0)) == (10.0, [])
    assert flown(waypoint(100.0, 30.0), CAMERA, speed(10.0)) == (10.0, [])


def test_what_follows_a_condition_is_dropped_with_it() -> None:
    yaw = item(115, frame=2, params=(0.0, 0.0, 0.0, 1.0))
    assert flown(yaw, speed(10.0), waypoint(100.0, 30.0)) == (1.0, [Severity.WARNING])


def test_fence_and_home_are_dropped_too() -> None:
    there = waypoint(100.0, 30.0)
    for late, held in ((FENCE_OFF, "fence_switches"), (HOME_THERE, "moved_homes")):
        for queue, count in (((CAMERA, late), 0), ((late, CAMERA), 1)):
            asked = mission(
                takeoff(30.0), waypoint(100.0, 30.0, hold_s=1.0), *queue, there, LAST, rtl()
            )
            route = make_route(asked, dialect=Autopilot.ARDUPILOT)
            assert len(getattr(route, held)) == count


def test_who_flies_counts() -> None:
    queue = (CAMERA, speed(10.0), waypoint(100.0, 30.0))
    assert flown(*queue, dialect=Autopilot.PX4) == (10.0, [])
    assert flown(*queue, dialect=None) == (1.0, [Severity.ERROR])


def test_behind_a_take_off_nothing_is_known_to_the_centimetre() -> None:
    asked = mission(takeoff(30.0), CAMERA, speed(7.0), waypoint(0.0, 30.0), LAST, rtl())
    route = make_route(asked, dialect=Autopilot.ARDUPILOT)
    assert next(one for one in route.stages if one.item == 5).speed_m_s == 7.0
