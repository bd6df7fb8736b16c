from __future__ import annotations

import pytest

from planner.errors import MissionFileError
from planner.findings import Place
from planner.geo.fence import FencePolygon, RallyPoint
from planner.mission.formats.legacy import read_fence_list, read_rally_list

FENCE = "47.05\t8.05\n47.0\t8.0\n47.0\t8.1\n47.1\t8.1\n47.0\t8.0\n"


def test_a_fence_list_is_a_return_point_and_one_closed_polygon() -> None:
    mission = read_fence_list("# our field\n" + FENCE, source="fence.txt")
    assert mission.fence is not None
    assert mission.fence.polygons == (
        FencePolygon(
            inclusion=True,
            vertices_deg=((47.0, 8.0), (47.0, 8.1), (47.1, 8.1)),
            place=Place(3, 1),
        ),
    )
    assert mission.fence.breach_return_deg_m == (47.05, 8.05, None)
    assert mission.items == ()
    assert [finding.code for finding in mission.findings] == ["L157"]


def test_a_fence_that_is_not_closed_is_told() -> None:
    mission = read_fence_list(FENCE.replace("47.0\t8.0\n", "47.0\t7.9\n", 1), source="f")
    assert mission.fence is not None
    assert len(mission.fence.polygons[0].vertices_deg) == 4
    assert [finding.code for finding in mission.findings] == ["L158", "L157"]


def test_a_fence_of_two_points_is_left_out_and_told() -> None:
    mission = read_fence_list("47 8\n47.1 8.1\n", source="f")
    assert not mission.fence
    assert "L164" in [finding.code for finding in mission.findings]


def test_rally_lines_become_rally_points_above_home() -> None:
    text = "RALLY 47.1\t8.2\t60.0\t40.0\t0.0\t0\nRALLY 47.3\t8.4\t50\t40\t0\t0\n"
    mission = read_rally_list(text, source="r")
    assert mission.rally == (
        RallyPoint(
            latitude_deg=47.1, longitude_deg=8.2, height_above_home_m=60.0, place=Place(1, 1)
        ),
        RallyPoint(
            latitude_deg=47.3, longitude_deg=8.4, height_above_home_m=50.0, place=Place(2, 1)
        ),
    )
    assert [finding.code for finding in mission.findings] == ["L157"]


@pytest.mark.parametrize("line", ["47 8 9", "47 x", "97 8", "47 181", "47 nan"])
def test_a_broken_fence_line_is_refused_with_its_place(line: str) -> None:
    with pytest.raises(MissionFileError) as caught:
        read_fence_list(f"{FENCE}  {line}\n", source="f")
    assert caught.value.place == Place(6, 3)


@pytest.mark.parametrize(
    "line", ["RALLY 47 8 60", "RALLY 47 8 high 40 0 0", "RALLY 97 8 60 40 0 0", "47 8"]
)
def test_a_broken_rally_line_is_refused_with_its_place(line: str) -> None:
    with pytest.raises(MissionFileError) as caught:
        read_rally_list(f"RALLY 47 8 60 40 0 0\n{line}\n", source="r")
    assert caught.value.place == Place(2, 1)


def test_more_points_than_mavlink_can_send_are_refused() -> None:
    with pytest.raises(MissionFileError, match="65,535 points"):
        read_fence_list("47 8\n" * 65_536, source="f")
