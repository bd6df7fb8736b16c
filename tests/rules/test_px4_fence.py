"""PX4's fence where it asks for more than the way that is flown: what it predicts, and its waypoints.

By hand, with MPC_ACC_HOR 3, MPC_ACC_HOR_MAX 5, MPC_JERK_AUTO 4: at 10 m/s 15.10 m until the 5 m/s² are gone
(1.25 s, up to 13.125 m/s), 33.63 m to stop from there (3 m/s² and 0.75 s of jerk), 2 m in 0.2 s: 50.74 m.
Its own braking begins 31.67 m before a place: 760 m²/s² over 24 m/s².
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from fenced_missions import at, box, circle, findings_of
from made_missions import item, rtl, takeoff

from planner.autopilot import Autopilot
from planner.rules import fenced_flight
from planner.rules.px4_fence import predicted_m

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.geo.fence import FenceCircle, FencePolygon
    from planner.mission.items import MissionItem
    from planner.rules.assessment import Assessment
    from planner.rules.fenced_flight import FencedFlight

PREDICTS = "GF_PREDICT,1\nGF_ACTION,3\nMPC_XY_CRUISE,10\n"
NORTH = (takeoff(20), at(0, 200), rtl())
FLOWN_M = 200.0 - 31.67 + 50.74
OUTSIDE = at(0, 300)


def of_px4(
    *items: MissionItem,
    areas: tuple[FencePolygon | FenceCircle, ...] = (),
    parameters: str = "GF_ACTION,3\n",
    position_error_m: float = 0.0,
) -> dict[str, Finding]:
    """Return what is found in a mission that PX4 flies, its position without noise."""
    return findings_of(
        items,
        *areas,
        autopilot=Autopilot.PX4,
        parameters=parameters,
        position_error_m=position_error_m,
        position_noise_m=0.0,
    )


@pytest.mark.parametrize(
    ("speed_m_s", "begins", "brakes", "expected_m"),
    [
        (10.0, 5.0, 3.0, 50.74),
        (8.0, 5.0, 3.0, 39.00),
        (0.0, 5.0, 3.0, 5.40),
        (3.0, 4.0, 3.0, 10.98),
        (0.0, 4.0, 3.0, 2.75),
    ],
)
def test_distance_predicted_is_that_of_the_source(
    speed_m_s: float, begins: float, brakes: float, expected_m: float
) -> None:
    # Flown: 48.5 m, 37 m and upwards 10.5 m, seen up to 0.2 s after the first of them was too far.
    given = predicted_m(
        np.array([speed_m_s]), begins_m_s2=begins, brakes_m_s2=brakes, jerk_m_s3=4.0
    )
    assert given == pytest.approx([expected_m], abs=0.02)


@pytest.mark.parametrize(("more_m", "fires"), [(-0.5, True), (0.5, False)])
@pytest.mark.parametrize("kind", ["distance", "circle", "polygon", "exclusion"])
def test_place_predicted_has_to_be_inside(kind: str, more_m: float, fires: bool) -> None:  # noqa: FBT001 - a table
    room_m = FLOWN_M + more_m
    kinds: dict[str, tuple[FencePolygon | FenceCircle, ...]] = {
        "distance": (),
        "circle": (circle(0.0, 0.0, room_m),),
        "polygon": (box(-400.0, -400.0, 400.0, room_m),),
        "exclusion": (box(-50.0, room_m, 50.0, room_m + 50.0, inclusion=False),),
    }
    areas = kinds[kind]
    given = PREDICTS + (f"GF_MAX_HOR_DIST,{room_m}\n" if kind == "distance" else "")
    told = of_px4(*NORTH, areas=areas, parameters=given)
    assert ("F116" in told) is fires
    if fires:
        assert told["F116"].item == 2
        assert "51 m ahead" in told["F116"].message
        assert told["F116"].message.endswith("it returns")


@pytest.mark.parametrize("given", ["GF_PREDICT,0\nGF_ACTION,3\n", "GF_PREDICT,1\nGF_ACTION,1\n"])
def test_without_a_prediction_that_acts_there_is_none(given: str) -> None:
    given += "MPC_XY_CRUISE,10\nGF_MAX_HOR_DIST,210\nGF_MAX_VER_DIST,23\n"
    assert "F116" not in of_px4(*NORTH, parameters=given)


def test_a_vehicle_at_rest_looks_to_all_sides() -> None:
    for side_m, fires in ((5.3, True), (5.5, False)):
        area = box(-side_m, -400.0, 400.0, 400.0)
        told = of_px4(*NORTH, areas=(area,), parameters=PREDICTS)
        assert ("F116" in told) is fires


@pytest.mark.parametrize(("action", "fires"), [(3, False), (5, True)])
def test_a_return_of_the_mission_need_not_be_told_to_return(action: int, fires: bool) -> None:  # noqa: FBT001
    # Flown: an edge 12 m behind home, RTL at 5 m/s: with 3 it lands at home, with 5 it lands on the way.
    area = box(-400.0, -12.0, 400.0, 400.0)
    given = f"GF_PREDICT,1\nGF_ACTION,{action}\n"
    told = of_px4(takeoff(30), at(0, 120, 30.0), rtl(), areas=(area,), parameters=given)
    assert ("F116" in told) is fires


@pytest.mark.parametrize(("ceiling_m", "fires"), [(50.0, True), (54.0, False)])
def test_a_climb_that_answers_a_step_is_looked_at_on_its_way(ceiling_m: float, fires: bool) -> None:  # noqa: FBT001
    # At its top it is at rest; 0.7 m below it still climbs at 0.8 m/s and looks 14 m up, and 2 m are kept.
    told = findings_of(
        (takeoff(36.8), at(0, 100, 36.8), rtl()),
        autopilot=Autopilot.STEP,
        parameters=f"{PREDICTS}MPC_JERK_AUTO,2\nGF_MAX_VER_DIST,{ceiling_m}\n",
        position_error_m=0.0,
        position_noise_m=0.0,
    )
    assert ("F116" in told) is fires


@pytest.mark.parametrize(("ceiling_m", "fires"), [(43.8, True), (44.3, False)])
def test_height_predicted_has_to_be_below_the_limit(ceiling_m: float, fires: bool) -> None:  # noqa: FBT001
    # It brakes from 3 m/s 7.1 m before 38 m (228 m²/s² over 32 m/s²), looks 10.98 m up, and 2 m are kept.
    told = of_px4(
        takeoff(38), at(0, 50, 38.0), rtl(), parameters=f"{PREDICTS}GF_MAX_VER_DIST,{ceiling_m}\n"
    )
    assert ("F116" in told) is fires


@pytest.mark.parametrize(
    "items",
    [
        (takeoff(20), at(0, 100), rtl(), OUTSIDE),
        (takeoff(20), item(177, params=(4.0, 1.0, 0.0, 0.0), frame=2), OUTSIDE, at(0, 100), rtl()),
    ],
)
@pytest.mark.parametrize("action", [0, 3])
def test_an_item_outside_is_refused_though_it_is_not_flown(
    items: tuple[MissionItem, ...], action: int
) -> None:
    number = items.index(OUTSIDE) + 1
    given = f"GF_ACTION,{action}\n"
    for areas, more, how in (
        ((box(-200.0, -200.0, 200.0, 299.0),), "", "1.0 m outside inclusion polygon 1"),
        ((circle(0.0, 310.0, 20.0, inclusion=False),), "", "10 m inside exclusion circle 1"),
        ((), "GF_MAX_HOR_DIST,299\n", "GF_MAX_HOR_DIST"),
    ):
        told = of_px4(*items, areas=areas, parameters=given + more)
        assert told["F117"].item == number
        assert how in told["F117"].message
    wide = (box(-200.0, -200.0, 200.0, 301.0),)
    assert "F117" not in of_px4(*items, areas=wide, parameters=given)


def test_a_wide_radius_does_not_bring_an_item_inside() -> None:
    wide = at(0, 220, params=(0.0, 30.0, 0.0, None))
    area = box(-400.0, -400.0, 400.0, 200.0)
    slow = "GF_ACTION,3\nMPC_XY_CRUISE,3\n"
    assert "F117" in of_px4(takeoff(20), wide, at(0, 0), rtl(), areas=(area,), parameters=slow)


def test_height_limit_counts_for_items_that_are_not_flown() -> None:
    for height_m, fires in ((59.9, False), (60.0, True)):
        items = (takeoff(20), at(0, 100), rtl(), at(0, 100, height_m))
        told = of_px4(*items, parameters="GF_MAX_VER_DIST,60\n")
        assert ("F117" in told) is fires


@pytest.mark.parametrize(
    ("items", "codes"),
    [
        ((takeoff(20), at(0, 100), OUTSIDE, rtl()), {"F101"}),
        ((takeoff(20), at(0, 100), rtl(), OUTSIDE), {"F117"}),
        ((takeoff(20), at(0, 100), rtl()), set()),
    ],
)
def test_a_place_outside_is_told_once_where_nobody_is_named(
    items: tuple[MissionItem, ...], codes: set[str]
) -> None:
    area, both = box(-200.0, -200.0, 200.0, 250.0), {"F101", "F117"}
    assert findings_of(items, area).keys() & both == codes
    px4 = of_px4(*items, areas=(area,))
    assert px4.keys() & both == (codes and codes | {"F117"})
    assert len({px4[code].fix for code in both & px4.keys()}) == len(codes)


def test_the_fenced_flight_is_laid_out_once_for_each_who_may_fly(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: list[FencedFlight] = []
    make = fenced_flight.make_fenced_flight

    def count(a: Assessment) -> FencedFlight:
        made.append(make(a))
        return made[-1]

    monkeypatch.setattr(fenced_flight, "make_fenced_flight", count)
    behind = (takeoff(20), at(0, 100), rtl(), OUTSIDE)
    assert "F117" in findings_of(behind, box(-200.0, -200.0, 200.0, 250.0))
    assert len(made) == 3  # by the model of reference steps, PX4 and ArduPilot


def test_ardupilot_and_places_that_are_none_are_left_alone() -> None:
    area = (box(-200.0, -200.0, 200.0, 299.0),)
    looks_at = (takeoff(20), at(0, 100), at(0, 300, command=195), rtl())
    assert "F117" not in of_px4(*looks_at, areas=area)
    behind = (takeoff(20), at(0, 100), rtl(), OUTSIDE)
    assert "F117" not in findings_of(behind, *area, autopilot=Autopilot.ARDUPILOT)
