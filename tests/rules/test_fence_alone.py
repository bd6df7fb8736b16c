"""Files with a fence and rally points, and nothing to fly: judged by what needs no flight."""

from __future__ import annotations

import pytest
from fenced_missions import VEHICLES, box, circle, degrees, findings_of, rally
from made_missions import mission

from planner.autopilot import Autopilot
from planner.geo.fence import Fence, FenceCircle, FencePolygon
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.library import load_vehicle

AROUND = box(-100.0, -100.0, 100.0, 100.0)
FAR = box(300.0, -100.0, 500.0, 100.0)
BESIDE = box(50.0, -100.0, 250.0, 100.0)


@pytest.mark.parametrize(
    ("areas", "rally_m", "codes"),
    [
        ((AROUND,), None, set()),
        ((AROUND,), (90.0, 0.0), set()),
        ((AROUND,), (120.0, 0.0), {"F103"}),
        ((BESIDE,), None, {"F104"}),
        ((AROUND, circle(0.0, 0.0, 30.0, inclusion=False)), None, {"F104"}),
        ((AROUND, FAR), None, {"F104", "F106"}),
    ],
)
def test_home_rally_points_and_areas_are_judged_without_a_flight(
    areas: tuple[FencePolygon | FenceCircle, ...],
    rally_m: tuple[float, float] | None,
    codes: set[str],
) -> None:
    points = () if rally_m is None else (rally(*rally_m),)
    assert set(findings_of((), *areas, rally_points=points)) == codes


def test_how_far_a_rally_point_is_outside_is_told() -> None:
    finding = findings_of((), AROUND, rally_points=(rally(120.0, 0.0),))["F103"]
    assert finding.message == "rally point 1 is 20 m outside inclusion polygon 1"
    assert finding.stretch is not None
    assert finding.stretch.start_deg == pytest.approx(degrees(120.0, 0.0), abs=1e-7)
    assert finding.stretch.distance_m == pytest.approx(20.0, abs=0.01)


def test_how_far_a_rally_point_is_inside_a_forbidden_area_is_told() -> None:
    forbidden = circle(0.0, 0.0, 30.0, inclusion=False)
    finding = findings_of((), forbidden, rally_points=(rally(10.0, 0.0),))["F103"]
    assert finding.message == "rally point 1 is 20 m inside exclusion circle 1"


def test_a_polygon_that_encloses_nothing_is_told_without_a_flight() -> None:
    line = FencePolygon(
        inclusion=True, vertices_deg=(degrees(-10.0, 0.0), degrees(0.0, 0.0), degrees(10.0, 0.0))
    )
    assert "F105" in findings_of((), line)


def test_a_fence_that_px4_cannot_hold_is_told_without_a_flight() -> None:
    many = tuple(circle(0.0, 0.0, 500.0 + n) for n in range(65))
    assert set(findings_of((), *many, autopilot=Autopilot.PX4)) == {"F112"}


def test_without_a_home_only_the_fence_itself_is_judged() -> None:
    alone = replace(mission(), home=None, fence=Fence(polygons=(BESIDE,)))
    findings = check(alone, load_vehicle(VEHICLES[Autopilot.STEP])).findings
    assert [f.code for f in findings if f.code.startswith("F")] == []
