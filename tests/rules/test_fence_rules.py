"""The fence of a mission is judged wherever a mission with one is checked."""

from __future__ import annotations

import pytest
from made_missions import mission, north, rtl, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.findings import Finding, Severity
from planner.geo.fence import Fence, FenceCircle, FencePolygon
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

SQUARE = ((46.99, 7.99), (46.99, 8.01), (47.01, 8.01), (47.01, 7.99))
BOW_TIE = (SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3])
FAR_SQUARE = tuple((latitude + 1.0, longitude) for latitude, longitude in SQUARE)
AWAY = FenceCircle(inclusion=True, latitude_deg=47.5, longitude_deg=8.0, radius_m=500.0)


def polygon(*vertices_deg: tuple[float, float], inclusion: bool = True) -> FencePolygon:
    return FencePolygon(inclusion=inclusion, vertices_deg=vertices_deg)


def judged(fence: Fence | None, autopilot: Autopilot, parameters: str = "") -> list[Finding]:
    """What the fence's own rules have to say about a flight of 100 m inside all sane areas."""
    vehicle = load_vehicle("px4-sih-quad" if autopilot is Autopilot.PX4 else "arducopter-sitl-quad")
    made = replace(mission(takeoff(20), waypoint(100, 20), rtl(), autopilot=autopilot), fence=fence)
    result = check(
        made,
        vehicle,
        battery=Battery(capacity_wh=100.0),
        parameters=parameters_from_text(parameters.encode(), source="p.param")
        if parameters
        else None,
    )
    return [finding for finding in result.findings if finding.code in {"F105", "F106"}]


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_a_sane_fence_is_nothing_to_tell(autopilot: Autopilot) -> None:
    assert judged(None, autopilot) == []
    keep_out = FenceCircle(
        inclusion=False, latitude_deg=north(-300), longitude_deg=8.0, radius_m=30.0
    )
    fence = Fence(polygons=(polygon(*SQUARE),), circles=(keep_out,))
    assert judged(fence, autopilot) == []


@pytest.mark.parametrize("vertices_deg", [BOW_TIE, BOW_TIE[:2] * 2])
def test_a_polygon_that_encloses_nothing_is_an_error(
    vertices_deg: tuple[tuple[float, float], ...],
) -> None:
    [finding] = judged(Fence(polygons=(polygon(*vertices_deg),)), Autopilot.PX4)
    assert (finding.code, finding.severity) == ("F105", Severity.ERROR)
    assert "inclusion polygon 1" in finding.message


def test_a_fence_is_judged_where_it_lies_and_not_at_home() -> None:
    assert judged(Fence(polygons=(polygon(*FAR_SQUARE, inclusion=False),)), Autopilot.PX4) == []


def test_inclusions_apart_are_an_error_where_all_of_them_must_hold() -> None:
    fence = Fence(polygons=(polygon(*SQUARE),), circles=(AWAY,))
    for autopilot in (Autopilot.PX4, Autopilot.ARDUPILOT):
        [finding] = judged(fence, autopilot)
        assert (finding.code, finding.severity) == ("F106", Severity.ERROR)


def test_ardupilot_unites_inclusions_where_its_parameters_say_so() -> None:
    fence = Fence(polygons=(polygon(*SQUARE),), circles=(AWAY,))
    assert judged(fence, Autopilot.ARDUPILOT, "FENCE_OPTIONS,2\n") == []
    assert [f.code for f in judged(fence, Autopilot.ARDUPILOT, "FENCE_OPTIONS,1\n")] == ["F106"]


def crossings(fence: Fence, metres_north: float) -> list[Finding]:
    made = mission(takeoff(20), waypoint(metres_north, 20), rtl())
    flown = check(
        replace(made, fence=fence),
        load_vehicle("falkowski-2023-quadrotor"),
        battery=Battery(capacity_wh=500.0),
    )
    return [finding for finding in flown.findings if finding.code == "F101"]


@pytest.mark.parametrize(("metres_north", "leaves"), [(1000.0, False), (1200.0, True)])
def test_a_leg_out_of_an_inclusion_is_an_error(
    metres_north: float,
    leaves: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # The square ends 0.01° north of home: 1111.8 m.
    found = crossings(Fence(polygons=(polygon(*SQUARE),)), metres_north)
    assert bool(found) is leaves
    if leaves:
        assert found[0].item == 2
        # 88 m out and 88 m back, and the metre by which the article's vehicle overshoots.
        assert found[0].stretch is not None
        assert found[0].stretch.distance_m == pytest.approx(177.2, abs=1.5)


def test_a_sliver_between_two_waypoints_is_found() -> None:
    sliver = polygon(
        (north(500), 7.999),
        (north(500), 8.001),
        (north(501), 8.001),
        (north(501), 7.999),
        inclusion=False,
    )
    [finding] = crossings(Fence(polygons=(sliver,)), 1000.0)
    assert finding.severity is Severity.ERROR
    assert "exclusion polygon 1" in finding.message
