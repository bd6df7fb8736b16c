"""Places and DO_ items in the order ArduPilot carries them out, against a reading of its own source.

More missions: ``MAVJOULE_EXAMPLES=50 pytest tests/mission/test_mission_queue.py``, in hundreds.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from ardupilot_mission_queue import MissionQueue, Row
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import HOME, item, jump, mission, rtl, speed, takeoff, waypoint
from thinning import examples

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.mission.route.route import make_route
from planner.mission.route.state import VehicleHabits

if TYPE_CHECKING:
    from planner.mission.items import MissionItem
    from planner.mission.route.stage import Route

EXAMPLES = examples(100) * int(os.environ.get("MAVJOULE_EXAMPLES", "1"))
CAMERA, DELAY, TAG = (
    item(206, frame=2),
    item(112, frame=2, params=(9999.0, 0.0, 0.0, 0.0)),
    item(600, frame=2, params=(1.0, 0.0, 0.0, 0.0)),
)
"""One holds back what is behind it until the leg is over, the others change nothing."""
RETURN = 20
"""It has a speed of its own, not compared."""
Told = tuple[int, float | None, float | None]
"""Item of a place, the speed and the fence's state in force on the way to it; ``None``: never commanded."""


def fence(state: int) -> MissionItem:
    return item(207, frame=2, params=(float(state), 0.0, 0.0, 0.0))


def jump_tag(repeats: int) -> MissionItem:
    return item(601, frame=2, params=(1.0, float(repeats), 0.0, 0.0))


@st.composite
def looped(draw: st.DrawFn) -> tuple[MissionItem, ...]:
    """Draw a mission whose jumps lead to other items of it, or to its tag where it has one."""
    count = draw(st.integers(3, 10))
    places = st.builds(
        lambda metres, hold_s: waypoint(metres, 30.0, hold_s=hold_s),
        st.integers(20, 900),
        st.sampled_from((0.0, 1.0)),
    )
    speeds, fences = (
        st.builds(speed, st.integers(1, 9).map(float)),
        st.builds(fence, st.integers(0, 1)),
    )
    other = st.sampled_from((CAMERA, DELAY, TAG))
    items = [draw(st.one_of(places, places, speeds, fences, other)) for _ in range(count)]
    for _ in range(draw(st.integers(1, 3))):
        at, repeats = draw(st.integers(1, count - 1)), draw(st.integers(-1, 3))
        target = draw(st.sampled_from([n for n in range(2, count + 3) if n != at + 2]))
        items[at] = (
            jump(target, repeats) if draw(st.booleans()) or TAG not in items else jump_tag(repeats)
        )
    return (takeoff(30.0), *items, rtl())


def rows(items: tuple[MissionItem, ...]) -> list[Row]:
    return [
        Row(
            one.command,
            int(one.param1 or 0.0),
            int(one.param2 or 0.0) * (one.command != 600),
            spot=one.latitude_deg if one.command == 16 else None,
            holds=one.command == 16 and bool(one.param1),
        )
        for one in items
    ]


def flown_by_ardupilot(
    items: tuple[MissionItem, ...], most: int, *, keeps_counts: bool
) -> list[Told] | None:
    """Return each place with what is in force on the way to it; ``None``: now this, now that."""
    told: list[Told] = []
    speed_m_s: float | None = None
    fence_state: float | None = None
    queue = MissionQueue(rows(items), starts_anew=not keeps_counts)
    for number, carried_out, again in queue.flown(most):
        circling = [items[one - 1] for one in again]
        speeds = {one.param2 for one in circling if one.command == 178}
        states = {one.param1 for one in circling if one.command == 207}
        if len(speeds) > 1 or len(states) > 1:
            return None
        for one in [*(items[one - 1] for one in carried_out), *circling]:
            if one.command == 178:
                speed_m_s = one.param2
            elif one.command == 207:
                fence_state = one.param1
        told.append(
            (number, None if items[number - 1].command == RETURN else speed_m_s, fence_state)
        )
    return told


def planned(route: Route, items: tuple[MissionItem, ...]) -> list[Told]:
    """Return the same of a route; no leg of these missions is divided."""
    told: list[Told] = []
    for at, stage in enumerate(route.stages):
        switched = [float(one.action) for one in route.fence_switches if one.first_stage <= at]
        speed_m_s = None if items[stage.item - 1].command == RETURN else stage.speed_m_s
        told.append((stage.item, speed_m_s, switched[-1] if switched else None))
    return told


def test_the_reading_of_the_source_is_what_a_flight_logged() -> None:
    # ArduPilot #30376, 4.7.0-dev: "5 Jump 2/2, 2 WP, 6 AuxFunction", at the end "4 AuxFunction, 7 LoitTurns".
    lap = (waypoint(50, 30.0), waypoint(90, 30.0), CAMERA, jump(2, 2))
    items = (takeoff(30.0), *lap, CAMERA, item(18, HOME.latitude_deg, 30.0), rtl())
    flown = [(place.item, place.carried_out) for place in MissionQueue(rows(items)).flown(100)]
    laps = [(2, ()), (3, ()), (2, (4,)), (3, ()), (2, (4, 6)), (3, ())]
    assert flown == [(1, ()), *laps, (7, (4,)), (8, ())]


@settings(max_examples=EXAMPLES)
@given(looped(), st.booleans())
def test_places_speeds_and_fences_follow_each_other_as_ardupilot_carries_them_out(
    items: tuple[MissionItem, ...],
    keeps_counts: bool,  # noqa: FBT001
) -> None:
    route = make_route(
        mission(*items),
        dialect=Autopilot.ARDUPILOT,
        habits=VehicleHabits(keeps_counts=keeps_counts),
    )
    if any(f.severity is Severity.ERROR and f.code != "T101" for f in route.findings):
        return
    told = planned(route, items)
    # An endless loop is planned once round and once more, of any other mission all.
    most = 10_000 if route.lap is None else len(told)
    assert told == flown_by_ardupilot(items, most, keeps_counts=keeps_counts)
