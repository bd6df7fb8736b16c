from __future__ import annotations

import pytest

from planner.geo.fence import FenceCircle, FencePolygon, RallyPoint
from planner.mission.formats.fence_items import make_fence, make_rally_points
from planner.mission.formats.wpl import read_wpl
from planner.mission.items import Mission, MissionItem

HOME = "0\t1\t0\t16\t0\t0\t0\t0\t47.1\t8.5\t488\t1"


def make_item(
    command: int,
    latitude_deg: float | None = 47.0,
    longitude_deg: float | None = 8.0,
    *,
    param1: float | None = 0.0,
    altitude_m: float | None = 0.0,
    frame: int = 3,
) -> MissionItem:
    return MissionItem(
        command=command,
        frame=frame,
        param1=param1,
        param2=0.0,
        param3=0.0,
        param4=0.0,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_m=altitude_m,
    )


def read(*rows: str) -> Mission:
    return read_wpl("\n".join(["QGC WPL 110", *rows]), source="m")


SQUARE = ((47.0, 8.0), (47.0, 8.1), (47.1, 8.1), (47.1, 8.0))


def test_vertices_become_polygons_by_the_count_they_carry() -> None:
    rows = [make_item(5001, *vertex, param1=4.0) for vertex in SQUARE]
    rows += [make_item(5001, lat + 1.0, lon, param1=4.0) for lat, lon in SQUARE]
    fence, findings = make_fence(rows)
    assert fence is not None
    assert fence.polygons == (
        FencePolygon(inclusion=True, vertices_deg=SQUARE),
        FencePolygon(inclusion=True, vertices_deg=tuple((lat + 1.0, lon) for lat, lon in SQUARE)),
    )
    assert findings == ()


def test_inclusion_exclusion_circles_and_return_point_are_told_apart() -> None:
    rows = [make_item(5002, *vertex, param1=4.0) for vertex in SQUARE]
    rows += [make_item(5003, 47.5, 8.5, param1=100.0), make_item(5004, 47.6, 8.6, param1=20.0)]
    rows += [make_item(5000, 47.05, 8.05, altitude_m=40.0)]
    fence, findings = make_fence(rows)
    assert fence is not None
    assert [polygon.inclusion for polygon in fence.polygons] == [False]
    assert fence.circles == (
        FenceCircle(inclusion=True, latitude_deg=47.5, longitude_deg=8.5, radius_m=100.0),
        FenceCircle(inclusion=False, latitude_deg=47.6, longitude_deg=8.6, radius_m=20.0),
    )
    assert fence.breach_return_deg_m == (47.05, 8.05, 40.0)
    assert findings == ()


def test_a_polygon_with_another_number_of_vertices_than_it_says_is_told() -> None:
    fence, findings = make_fence([make_item(5001, *vertex, param1=5.0) for vertex in SQUARE])
    assert fence is not None
    assert fence.polygons[0].vertices_deg == SQUARE
    assert [finding.code for finding in findings] == ["L164"]


def test_a_polygon_ends_where_another_count_begins() -> None:
    rows = [make_item(5001, *vertex, param1=9.0) for vertex in SQUARE]
    rows += [make_item(5001, lat + 1.0, lon, param1=4.0) for lat, lon in SQUARE]
    fence, findings = make_fence(rows)
    assert fence is not None
    assert [len(polygon.vertices_deg) for polygon in fence.polygons] == [4, 4]
    assert len(findings) == 1


@pytest.mark.parametrize(
    "item",
    [
        make_item(5003, param1=0.0),
        make_item(5004, param1=None),
        make_item(5003, None, 8.0, param1=9.0),
        make_item(5001, param1=1.0),
    ],
)
def test_an_area_without_an_extent_is_left_out_and_told(item: MissionItem) -> None:
    fence, findings = make_fence([item])
    assert fence is not None
    assert not fence
    assert [finding.code for finding in findings] == ["L164"]


def test_items_that_are_no_fence_give_no_fence() -> None:
    assert make_fence([make_item(16), make_item(5100)]) == (None, ())


def test_rally_points_are_above_home_and_amsl_ones_are_reduced_by_it() -> None:
    rows = [make_item(5100, altitude_m=60.0, frame=3), make_item(5100, altitude_m=548.0, frame=0)]
    points, findings = make_rally_points(rows, home_altitude_amsl_m=488.0)
    assert points == (
        RallyPoint(latitude_deg=47.0, longitude_deg=8.0, height_above_home_m=60.0),
        RallyPoint(latitude_deg=47.0, longitude_deg=8.0, height_above_home_m=60.0),
    )
    assert findings == ()


def test_a_rally_altitude_that_cannot_be_reduced_is_told() -> None:
    points, findings = make_rally_points([make_item(5100, frame=0)], home_altitude_amsl_m=None)
    assert len(points) == 1
    assert [finding.code for finding in findings] == ["L159"]


def test_a_rally_point_without_a_place_is_left_out_and_told() -> None:
    points, findings = make_rally_points([make_item(5100, None)], home_altitude_amsl_m=None)
    assert points == ()
    assert [finding.code for finding in findings] == ["L158"]


def test_fence_rows_inside_a_mission_leave_the_items_and_are_told() -> None:
    fence = [
        f"{n}\t0\t3\t5001\t4\t0\t0\t0\t{lat}\t{lon}\t0\t1" for n, (lat, lon) in enumerate(SQUARE, 2)
    ]
    mission = read(
        HOME, "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1", *fence, "6\t0\t0\t177\t1\t2\t0\t0\t0\t0\t0\t1"
    )
    assert [(item.command, item.jump_id) for item in mission.items] == [(22, 1), (177, 6)]
    assert mission.fence is not None
    assert mission.fence.polygons[0].vertices_deg == SQUARE
    assert [finding.code for finding in mission.findings] == ["L156"]


def test_a_file_of_fence_rows_has_no_home_row() -> None:
    fence = [
        f"{n}\t0\t0\t5001\t4\t0\t0\t0\t{lat}\t{lon}\t0\t0" for n, (lat, lon) in enumerate(SQUARE)
    ]
    mission = read(*fence)
    assert mission.items == ()
    assert mission.home is None
    assert mission.fence is not None
    assert mission.fence.polygons[0].vertices_deg == SQUARE
    assert [finding.code for finding in mission.findings] == ["L157"]


def test_a_file_of_rally_rows_gives_rally_points() -> None:
    mission = read("0\t0\t3\t5100\t1\t0\t0\t0\t47\t8\t50\t0")
    assert [point.height_above_home_m for point in mission.rally] == [50.0]
    assert [finding.code for finding in mission.findings] == ["L157"]
