"""MAVSDK's importers, another implementation, read what we write as we read it.

They need a vehicle to be asked for: one that says no more than that it is there.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from generated_plans import FENCES, HOMES, RALLY_POINTS, item_lists
from hypothesis import given, settings
from made_missions import jump, rtl, takeoff, waypoint
from made_missions import mission as made
from mavsdk.plugins.mission_raw import MissionRawError
from plan_text import LANDING, PLAN, plan_of, plan_without, simple_item
from thinning import examples

from planner.autopilot import Autopilot
from planner.fetched import FetchMark
from planner.mission.commands import Frame
from planner.mission.formats.plan import read_plan_text
from planner.mission.formats.writers import plan_text, with_unused_position_zero, wpl_text
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mavsdk.plugins.mission_raw import MissionRaw

    from planner.geo.fence import Fence, RallyPoint
    from planner.mission.items import Home, MissionItem

_WHOLE_DEGREES = 1e7
"""MISSION_ITEM_INT sends positions in units of 1e-7°, rounded: half a unit of difference."""


def import_plan(importer: MissionRaw, text: str) -> Any:  # noqa: ANN401 (MAVSDK is untyped)
    return importer.import_qgroundcontrol_mission_from_string(text)


def compare(ours: tuple[MissionItem, ...], theirs: list[Any]) -> None:
    """Compare items with MAVSDK's, whose numbers have 32 bits and whose positions are whole."""
    assert len(ours) == len(theirs)
    for one, sent in zip(ours, theirs, strict=True):
        assert (sent.command, sent.frame) == (one.command, one.frame)
        assert bool(sent.autocontinue) is one.autocontinue
        values = (sent.param1, sent.param2, sent.param3, sent.param4, sent.z)
        said = (one.param1, one.param2, one.param3, one.param4, one.altitude_m)
        np.testing.assert_array_equal(
            np.array(values, np.float32),
            np.array([np.nan if value is None else value for value in said], np.float32),
        )
        for degrees, whole in ((one.latitude_deg, sent.x), (one.longitude_deg, sent.y)):
            compare_position(degrees, whole, frame=one.frame)


def compare_position(degrees: float | None, whole: int, *, frame: int) -> None:
    if degrees is None:  # MAVSDK says 0 for null
        assert whole == 0
    elif frame == Frame.MISSION:  # no position: MAVSDK sends the number itself, cut off
        assert whole == int(np.float32(degrees))
    else:
        assert abs(degrees * _WHOLE_DEGREES - whole) <= 0.5 + 1e-6


def test_a_plan_as_qgroundcontrol_writes_it_is_imported_as_it_is_read(
    importers: Mapping[Autopilot, MissionRaw],
) -> None:
    text = json.dumps(PLAN)
    mission = read_plan_text(text, source="a.plan")
    data = import_plan(importers[Autopilot.PX4], text)
    compare(mission.items, data.mission_items)
    assert [sent.seq for sent in data.mission_items] == [0, 1, 2, 3, 4, 5]


def test_the_home_of_a_plan_becomes_ardupilots_item_0(
    importers: Mapping[Autopilot, MissionRaw],
) -> None:
    mission = made(takeoff(30.0), waypoint(50.0, 30.0), jump(2, 3.0), rtl())
    home, *sent = import_plan(importers[Autopilot.ARDUPILOT], plan_text(mission)).mission_items
    assert (home.seq, home.x, home.y, home.z) == (0, 470_000_000, 80_000_000, 400.0)
    compare(mission.items, sent)
    assert [each.seq for each in sent] == [1, 2, 3, 4]  # so that DO_JUMP means the same item
    assert sent[2].param1 == sent[1].seq


@given(items=item_lists(), home=HOMES, fence=FENCES, rally=RALLY_POINTS)
@settings(max_examples=examples(60), deadline=None)
def test_any_plan_that_is_written_is_imported_as_it_was(
    importers: Mapping[Autopilot, MissionRaw],
    items: tuple[MissionItem, ...],
    home: Home | None,
    fence: Fence,
    rally: tuple[RallyPoint, ...],
) -> None:
    mark = FetchMark.of("2026-11-22T12:00:00Z", "3f", {})
    mission = replace(made(*items, home=home), fence=fence, rally=rally, fetched=mark)
    data = import_plan(importers[Autopilot.PX4], plan_text(mission))
    compare(items, data.mission_items)
    compare_fence(fence, data.geofence_items)
    assert len(data.rally_items) == len(rally)
    for point, sent in zip(rally, data.rally_items, strict=True):
        compare_position(point.latitude_deg, sent.x, frame=sent.frame)
        compare_position(point.longitude_deg, sent.y, frame=sent.frame)
        assert (sent.z, sent.frame) == (np.float32(point.height_above_home_m), 3)


def compare_fence(fence: Fence, theirs: list[Any]) -> None:
    """Compare a fence with MAVSDK's items of it: polygons first, then circles, as plans have it."""
    ours: list[tuple[int, float, float, float]] = []
    for polygon in fence.polygons:
        command = 5001 if polygon.inclusion else 5002
        count = float(len(polygon.vertices_deg))
        ours += [(command, count, *vertex) for vertex in polygon.vertices_deg]
    for circle in fence.circles:
        command = 5003 if circle.inclusion else 5004
        ours.append((command, circle.radius_m, circle.latitude_deg, circle.longitude_deg))
    assert len(ours) == len(theirs)
    for (command, param1, latitude_deg, longitude_deg), sent in zip(ours, theirs, strict=True):
        assert (sent.command, sent.param1) == (command, np.float32(param1))
        compare_position(latitude_deg, sent.x, frame=Frame.GLOBAL)
        compare_position(longitude_deg, sent.y, frame=Frame.GLOBAL)


@given(items=item_lists(), home=HOMES)
@settings(max_examples=examples(60), deadline=None)
def test_any_text_that_is_written_is_imported_as_it_was(
    importers: Mapping[Autopilot, MissionRaw], items: tuple[MissionItem, ...], home: Home | None
) -> None:
    # MAVSDK makes -214.7° of a position that is not a number, and rounds one without a frame.
    placed = tuple(
        replace(
            one,
            frame=Frame.GLOBAL if one.frame == Frame.MISSION else one.frame,
            latitude_deg=one.latitude_deg or 0.0,
            longitude_deg=one.longitude_deg or 0.0,
            altitude_m=one.altitude_m or 0.0,
        )
        for one in items
    )
    mission = made(*placed, home=home)
    importer = importers[Autopilot.PX4]
    data = importer.import_mission_planner_mission_from_string(wpl_text(mission))
    compare(placed, data.mission_items[1:])


def test_what_a_plan_is_mended_with_makes_it_importable(
    importers: Mapping[Autopilot, MissionRaw],
) -> None:
    text = plan_without("geoFence")
    with pytest.raises(MissionRawError):
        import_plan(importers[Autopilot.PX4], text)
    mission = read_plan_text(text, source="a.plan")
    data = import_plan(importers[Autopilot.PX4], plan_text(mission))
    compare(mission.items, data.mission_items)


def test_a_landing_pattern_that_mavsdk_does_not_know_is_importable_as_text(
    importers: Mapping[Autopilot, MissionRaw],
) -> None:
    start = simple_item(22, 3, 0, 0, 0, 0, 47.4, 8.5, 30, number=1)
    mission = read_plan_text(plan_of(start, LANDING), source="a.plan")
    importer = importers[Autopilot.PX4]
    with pytest.raises(MissionRawError):
        import_plan(importer, plan_text(mission))
    data = importer.import_mission_planner_mission_from_string(wpl_text(mission))
    compare(tuple(map(with_unused_position_zero, mission.items)), data.mission_items[1:])
