"""The circle and the heights of a fence around whichever home counts, and heights between two items."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from fenced_missions import at, findings_of, rally
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import item, rtl, takeoff
from thinning import examples

from planner.autopilot import Autopilot

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

ARDUPILOT, PX4 = Autopilot.ARDUPILOT, Autopilot.PX4
CIRCLE = {
    ARDUPILOT: "FENCE_ENABLE,1\nFENCE_TYPE,2\nFENCE_RADIUS,600\n",
    PX4: "GF_ACTION,3\nGF_MAX_HOR_DIST,600\n",
}
CEILING = {
    ARDUPILOT: "FENCE_ENABLE,1\nFENCE_TYPE,1\nFENCE_ALT_MAX,{}\n",
    PX4: "GF_ACTION,3\nGF_MAX_VER_DIST,{}\nRTL_RETURN_ALT,15\n",
}
BOTH = pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])


def set_home(north_m: float, height_m: float = 0.0, *, frame: int = 2) -> MissionItem:
    """Return DO_SET_HOME; in frame 2, the only one PX4 takes it in, its altitude is AMSL."""
    altitude_m = height_m if frame == 3 else 400.0 + height_m
    return at(0.0, north_m, altitude_m, command=179, frame=frame)


def land(north_m: float) -> MissionItem:
    return at(0.0, north_m, 0.0, command=21)


@BOTH
@pytest.mark.parametrize(
    ("home_m", "place_m", "where"),
    [
        # 1 km north of the first home: within 600 m of the second, reached inside of both.
        (450.0, 1000.0, None),
        # 400 m north: inside the first circle, 710 m from a home moved 310 m south.
        (-310.0, 400.0, "the home of item 3"),
        # 3 m inside the circle of the new home: kept free for the position error, not crossed.
        (450.0, 1047.0, None),
        (450.0, 1053.0, "the home of item 3"),
    ],
)
def test_the_circle_goes_with_home(
    autopilot: Autopilot, home_m: float, place_m: float, where: str | None
) -> None:
    flown = (takeoff(20), at(0.0, 250.0), set_home(home_m), at(0.0, place_m), land(home_m))
    found = findings_of(flown, autopilot=autopilot, parameters=CIRCLE[autopilot])
    assert ("F101" in found) == (where is not None)
    if where is not None:
        assert f"around {where}: " in found["F101"].message
        assert found["F101"].item == 4
    assert "F104" not in found  # the first home need not be near the second


@BOTH
def test_before_home_is_moved_its_first_circle_counts(autopilot: Autopilot) -> None:
    flown = (takeoff(20), at(0.0, 650.0), set_home(450.0), at(0.0, 1000.0), land(450.0))
    found = findings_of(flown, autopilot=autopilot, parameters=CIRCLE[autopilot])
    assert found["F101"].item == 2
    assert "around home: " in found["F101"].message


@BOTH
def test_a_vehicle_left_outside_by_a_moved_home_is_outside_without_flying_on(
    autopilot: Autopilot,
) -> None:
    flown = (takeoff(20), at(0.0, 400.0), set_home(-300.0), land(400.0))
    found = findings_of(flown, autopilot=autopilot, parameters=CIRCLE[autopilot])
    assert found.keys() & {"F101", "F102"}


def test_a_rally_point_need_not_be_within_the_circle_of_a_home_set_later() -> None:
    flown = (takeoff(20), at(0.0, 400.0), set_home(500.0), at(0.0, 900.0), land(500.0))
    found = findings_of(
        flown, autopilot=ARDUPILOT, parameters=CIRCLE[ARDUPILOT], rally_points=(rally(0.0, -200.0),)
    )
    assert "F103" not in found


def switch(is_on: float) -> MissionItem:
    return item(207, frame=2, params=(is_on, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("switched", "is_outside"),
    [
        ((), True),
        ((switch(0.0), takeoff(20), at(0.0, 300.0), rtl()), False),
        (
            (takeoff(20), switch(0.0), at(0.0, 300.0), rtl()),
            False,
        ),  # on while it climbs: it flies home
        ((takeoff(20), at(0.0, 300.0), rtl(), switch(0.0)), True),  # never reached
    ],
)
def test_a_rally_point_beyond_a_circle_that_the_mission_has_off_is_not_outside(
    switched: tuple[MissionItem, ...], *, is_outside: bool
) -> None:
    """``AP_Rally_Copter::is_valid`` asks the fences that are enabled then."""
    flown = switched or (takeoff(20), at(0.0, 300.0), rtl())
    for north_m, beyond in ((-599.0, False), (-601.0, True)):
        found = findings_of(
            flown,
            autopilot=ARDUPILOT,
            parameters=CIRCLE[ARDUPILOT],
            rally_points=(rally(0.0, north_m),),
        )
        assert ("F103" in found) is (is_outside and beyond)


def test_px4_returns_to_a_rally_point_beyond_its_circle() -> None:
    flown = (takeoff(20), at(0.0, 400.0), set_home(-100.0), at(0.0, 300.0), land(-100.0))
    found = findings_of(
        flown, autopilot=PX4, parameters=CIRCLE[PX4], rally_points=(rally(0.0, 610.0),)
    )
    assert "F103" in found


@settings(max_examples=examples(10))
@given(
    homes_m=st.lists(st.integers(-500, 500).map(float), min_size=1, max_size=3),
    places_m=st.lists(st.integers(-900, 900).map(float), min_size=4, max_size=4),
)
def test_a_flight_is_outside_where_it_is_far_from_the_home_that_counts(
    homes_m: list[float], places_m: list[float]
) -> None:
    """All on one line to the north: a leg is outside where one of its ends is."""
    homes = [0.0, *homes_m]
    flown = [takeoff(20), at(0.0, places_m[0])]
    far = [abs(places_m[0])]
    for before, place, home in zip(places_m, places_m[1:], homes_m, strict=False):
        flown += [set_home(home), at(0.0, place)]
        far += [abs(before - home), abs(place - home)]
    last = places_m[len(homes_m)]
    flown.append(land(last))
    assert len(far) == 2 * len(homes) - 1
    found = findings_of(tuple(flown), autopilot=ARDUPILOT, parameters=CIRCLE[ARDUPILOT])
    away = np.array(far)
    if (
        np.abs(away - 600.0) > 1.0
    ).all():  # 0.13 % between metres of ArduPilot's and the ellipsoid's
        assert ("F101" in found) == bool((away > 600.0).any())


@BOTH
@pytest.mark.parametrize(("down_m", "fires"), [(37.5, False), (40.5, True)])
def test_a_ceiling_counts_from_the_home_that_counts(
    autopilot: Autopilot, down_m: float, *, fires: bool
) -> None:
    """At 50 m above the first home, 90 m above one that is put 40 m lower."""
    flown = (takeoff(50), set_home(100.0, -down_m), at(0.0, 200.0, 50.0 + down_m), land(100.0))
    found = findings_of(flown, autopilot=autopilot, parameters=CEILING[autopilot].format(90))
    assert ("F110" in found) == fires
    if fires:
        assert "just over 90 m above the home of item 2" in found["F110"].message


def test_a_floor_counts_from_the_home_that_counts() -> None:
    flown = (
        takeoff(50),
        set_home(0.0, 22.0, frame=3),
        at(0.0, 200.0, 28.0),
        at(0.0, 300.0, 28.0),
        rtl(),
    )
    for floor_m, fires in ((25.9, False), (29, True)):
        parameters = f"FENCE_ENABLE,1\nFENCE_TYPE,8\nFENCE_ALT_MIN,{floor_m}\n"
        found = findings_of(flown, autopilot=ARDUPILOT, parameters=parameters)
        assert ("F110" in found) == fires


def spline(north_m: float, height_m: float) -> MissionItem:
    return at(0.0, north_m, height_m, command=82)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_a_spline_that_swings_over_its_items_is_held_against_the_limits(up: float) -> None:
    """From 60 to 90 m, level for 100 m, and back.

    A tangent of SplineCurve is what lies between the neighbours of an item, (200, 30) m; both together are
    at most 4 of the leg's 100 m long: shortened to 400 / (2 · 202.2) = 0.989.  At its middle a Hermite
    curve is an eighth of their difference off: (29.7 + 29.7) / 8 = 7.4 m.
    """
    level = (60.0, 60.0 + 30.0 * up)
    heights = (level[0], level[1], level[1], level[0])
    flown = tuple(spline(100.0 * (1 + n), h) for n, h in enumerate(heights))
    kind, name = (1, "MAX") if up > 0.0 else (8, "MIN")

    def fires(limit_m: float) -> bool:
        parameters = (
            f"FENCE_ENABLE,1\nFENCE_TYPE,{kind}\nFENCE_ALT_{name},{limit_m}\nRTL_ALT,1000\n"
        )
        mission = (takeoff(60), *flown, item(21, None, 0.0))
        return "F110" in findings_of(mission, autopilot=ARDUPILOT, parameters=parameters)

    peak_m = level[1] + (7.4 + 2.0) * up  # 2 m less are warned of
    assert fires(peak_m - 0.3 * up)
    assert not fires(peak_m + 0.3 * up)
