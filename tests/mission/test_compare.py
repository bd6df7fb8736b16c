"""What counts as another mission, and what is only another way of storing it."""

from __future__ import annotations

import pytest

from planner.autopilot import Autopilot
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.mission.compare import DifferenceKind, compare_missions
from planner.mission.items import Mission, MissionFormat, MissionItem
from planner.values import replace

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT


def _item(command: int = 16, frame: int = 3, **changes: float | None) -> MissionItem:
    fields: dict[str, float | None] = {
        **{f"param{n}": 0.0 for n in (1, 2, 3, 4)},
        "latitude_deg": 47.0,
        "longitude_deg": 8.0,
        "altitude_m": 30.0,
    }
    return MissionItem(command=command, frame=frame, **(fields | changes))  # type: ignore[arg-type] # names of its fields


def _mission(*items: MissionItem, **changes: object) -> Mission:
    mission = Mission(
        source="x",
        file_format=MissionFormat.PLAN,
        items=items,
        home=None,
        autopilot=None,
        vehicle=None,
    )
    return replace(mission, **changes)


def _kinds(
    first: MissionItem, second: MissionItem, autopilot: Autopilot | None
) -> list[tuple[str, DifferenceKind]]:
    found = compare_missions(_mission(first), _mission(second), autopilot=autopilot)
    return [(one.field, one.kind) for one in found]


def test_a_mission_is_the_same_as_itself() -> None:
    mission = _mission(
        _item(),
        _item(20, 2),
        rally=(RallyPoint(latitude_deg=47.0, longitude_deg=8.0, height_above_home_m=20.0),),
    )
    for autopilot in (None, PX4, ARDUPILOT):
        assert compare_missions(mission, mission, autopilot=autopilot) == ()


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (_item(frame=3), _item(frame=6)),
        (_item(latitude_deg=47.00000001), _item(latitude_deg=47.0)),
        (_item(altitude_m=0.1), _item(altitude_m=0.10000000149011612)),
        (_item(param4=270.0), _item(param4=-90.0)),
    ],
)
def test_what_means_the_same_is_no_difference(first: MissionItem, second: MissionItem) -> None:
    assert _kinds(first, second, PX4) == []


@pytest.mark.parametrize(
    ("first", "second", "field"),
    [
        (_item(frame=3), _item(frame=0), "frame"),
        (_item(latitude_deg=47.0000002), _item(latitude_deg=47.0), "latitude_deg"),
        (_item(altitude_m=30.1), _item(altitude_m=30.0), "altitude_m"),
        (_item(param4=None), _item(param4=0.0), "param4"),
        (_item(param1=2.0), _item(param1=0.0), "param1"),
        (_item(16), _item(82), "command"),
    ],
)
def test_what_flies_otherwise_matters(first: MissionItem, second: MissionItem, field: str) -> None:
    found = compare_missions(_mission(first), _mission(second), autopilot=PX4)
    assert [(one.field, one.matters) for one in found] == [(field, True)]
    assert "item 1 (NAV_WAYPOINT)" in found[0].message


def test_ardupilot_keeps_whole_seconds_and_no_yaw_of_a_waypoint() -> None:
    # ArduPilot's mission storage: p1 is 16 bits of whole seconds, p2 to p4 are not kept.
    meant = _item(param1=2.5, param2=3.0, param4=90.0)
    stored = _item(param1=2.0, param2=0.0, param4=0.0)
    assert _kinds(meant, stored, ARDUPILOT) == [
        ("param1", DifferenceKind.STORED),
        ("param2", DifferenceKind.UNUSED),
        ("param4", DifferenceKind.UNUSED),
    ]
    assert ("param1", DifferenceKind.CHANGED) in _kinds(meant, stored, PX4)


def test_a_hold_that_is_lost_matters_to_ardupilot_too() -> None:
    assert _kinds(_item(param1=5.0), _item(), ARDUPILOT) == [("param1", DifferenceKind.CHANGED)]


def test_an_item_lost_in_the_middle_is_named_alone() -> None:
    items = [_item(latitude_deg=47.0 + n / 1000) for n in range(5)]
    found = compare_missions(_mission(*items), _mission(*items[:2], *items[3:]), autopilot=PX4)
    assert [(one.number, one.kind) for one in found] == [(3, DifferenceKind.MISSING)]
    back = compare_missions(_mission(*items[:2], *items[3:]), _mission(*items), autopilot=PX4)
    assert [(one.number, one.kind) for one in back] == [(3, DifferenceKind.ADDED)]


def test_a_jump_that_leads_elsewhere_matters() -> None:
    there = replace(_item(177, 2, param1=1.0, param2=3.0), jump_id=2)
    first = (replace(_item(), jump_id=1), there)
    found = compare_missions(
        _mission(*first), _mission(first[0], replace(there, param1=2.0)), autopilot=PX4
    )
    assert [(one.field, one.matters) for one in found] == [("param1", True)]


def test_a_fence_that_lost_an_area_matters() -> None:
    triangle = FencePolygon(inclusion=True, vertices_deg=((47.0, 8.0), (47.1, 8.0), (47.0, 8.1)))
    circle = FenceCircle(inclusion=False, latitude_deg=47.0, longitude_deg=8.0, radius_m=20.0)
    whole = _mission(fence=Fence(polygons=(triangle,), circles=(circle,)))
    less = _mission(fence=Fence(polygons=(triangle,)))
    found = compare_missions(whole, less, autopilot=PX4)
    assert [one.message for one in found] == ["area 2 of the fence (keep out, circle) is missing"]
    assert compare_missions(less, _mission(), autopilot=PX4)[0].matters


def test_rally_heights_are_whole_metres_on_ardupilot() -> None:
    point = RallyPoint(latitude_deg=47.0, longitude_deg=8.0, height_above_home_m=25.7)
    meant, kept = (
        _mission(rally=(point,)),
        _mission(rally=(replace(point, height_above_home_m=25.0),)),
    )
    assert [one.kind for one in compare_missions(meant, kept, autopilot=ARDUPILOT)] == [
        DifferenceKind.STORED
    ]
    assert [one.kind for one in compare_missions(meant, kept, autopilot=PX4)] == [
        DifferenceKind.CHANGED
    ]
