"""The room to stop on the map: hand-made flights, and what the rule on fences says of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from fenced_missions import at, box
from made_missions import mission, rtl, takeoff

import planner
from planner.geo.fence import Fence
from planner.physics.wind import Wind
from planner.report.plots.picture_files import ORANGE
from planner.report.tables import stop_room_rows
from planner.rules.fenced_flight import make_fenced_flight
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

SURVEYOR = planner.load_vehicle("arducopter-sitl-quad")
ARTICLE = planner.load_vehicle("falkowski-2023-quadrotor")
FENCE = Fence(polygons=(box(-400.0, -400.0, 400.0, 600.0),))


def checked(
    *items: MissionItem,
    fence: Fence | None = FENCE,
    wind: Wind | None = None,
    position_error_m: float = 2.5,
) -> planner.CheckResult:
    made = replace(mission(takeoff(20), *items, rtl()), fence=fence)
    return planner.check(made, SURVEYOR, wind=wind or Wind(), position_error_m=position_error_m)


def area(result: planner.CheckResult) -> shapely.Geometry:
    """Return what the rows fill."""
    assessment = result.assessment
    assert assessment is not None
    lines: dict[int, list[tuple[float, float]]] = {}
    for row in stop_room_rows(assessment):
        lines.setdefault(row["area"], []).append((row["east_m"], row["north_m"]))
    assert lines
    return shapely.union_all([_filled(line) for line in lines.values()])


def _filled(line: list[tuple[float, float]]) -> shapely.Polygon:
    """Return what a line fills that goes round outside, then round each hole from there and back."""
    rings: list[list[tuple[float, float]]] = []
    start = 0
    while start < len(line) - 1:
        end = line.index(line[start], start + 1)
        rings.append(line[start : end + 1])
        start = end + 1 if not rings[1:] else end + 2  # back to where the outside begins
    return shapely.Polygon(rings[0], rings[1:])


def test_everywhere_on_the_way_there_is_room_to_react_and_stop() -> None:
    result = checked(at(0, 300), at(200, 300), at(200, 0))
    assert result.assessment is not None
    flown = make_fenced_flight(result.assessment)
    room = shapely.buffer(area(result), 0.6)  # a thousandth of 300 m, and rounded to 0.1 m
    tight = shapely.buffer(area(result), -0.6)
    path, speed = flown.points_m, flown.path.speed_m_s
    assert shapely.contains_xy(room, path[:, 0], path[:, 1]).all()
    # committed and fast: straight ahead for a second, its stop, and 2.5 m
    fast = np.flatnonzero(flown.path.is_committed & (speed > 5.0))
    assert len(fast) > 4
    stop_m = flown.room.farthest_stop_m(speed[fast])
    ahead = np.column_stack((flown.path.east_m_s, flown.path.north_m_s))[fast] / speed[fast, None]
    for reach_m, inside in ((speed[fast] + stop_m + 2.5, room), (speed[fast] + stop_m, tight)):
        there = path[fast] + ahead * reach_m[:, None]
        assert shapely.contains_xy(inside, there[:, 0], there[:, 1]).all()


def test_a_survey_leaves_the_ground_between_its_lines_free() -> None:
    # once round 200 m by 300 m: the middle is a hole
    filled = area(checked(at(0, 300), at(200, 300), at(200, 0), at(0, 0)))
    assert not shapely.contains_xy(filled, 100.0, 150.0)
    assert shapely.contains_xy(filled, 0.0, 150.0)


def test_the_room_reaches_over_the_fence_exactly_where_a_finding_says_so() -> None:
    # the article's vehicle at 9.947 m/s: 9.947 m of reaction, its stop and 2.5 m
    for beyond_m, is_told in ((5.0, True), (60.0, False)):
        fence = Fence(polygons=(box(-100.0, -100.0, 100.0, 400.0 + beyond_m),))
        made = replace(mission(takeoff(20), at(0, 400), rtl()), fence=fence)
        result = planner.check(made, ARTICLE, battery=planner.Battery(capacity_wh=77.0))
        assert ("F102" in {finding.code for finding in result.findings}) is is_told
        assert (area(result).bounds[3] > 400.0 + beyond_m) is is_told


def test_wind_from_behind_makes_it_longer_and_a_larger_error_wider() -> None:
    places = at(0, 300), at(200, 300)
    plain = area(checked(*places)).bounds
    windy = area(checked(*places, wind=Wind(speed_m_s=5.0, from_deg=180.0))).bounds
    unsure = area(checked(*places, position_error_m=10.0)).bounds
    assert windy[3] > plain[3] + 0.5
    assert unsure[0] == pytest.approx(plain[0] - 7.5, abs=0.5)


def test_without_a_fence_nothing_is_drawn_and_with_one_it_is_on_the_map() -> None:
    from planner.report.plots import map_figure

    without, with_fence = (
        checked(at(0, 300), at(200, 300), fence=fence) for fence in (None, FENCE)
    )
    assert without.assessment is not None
    assert stop_room_rows(without.assessment) == []
    assert "room" not in map_figure(without).to_dict()["datasets"]
    drawn = map_figure(with_fence).to_dict()
    assert drawn["datasets"]["room"]
    assert ORANGE in str(drawn["layer"][0]["encoding"]["fill"])


def test_a_thousand_lines_have_no_more_corners_than_can_be_seen() -> None:
    lines = [
        place
        for number in range(120)
        for place in (at(12 * number, 0), at(12 * number, 400))[:: 1 if number % 2 else -1]
    ]
    fence = Fence(polygons=(box(-3000.0, -3000.0, 3000.0, 3000.0),))
    result = checked(*lines, fence=fence)
    assert result.assessment is not None
    assert 10 < len(stop_room_rows(result.assessment)) <= 2_500
