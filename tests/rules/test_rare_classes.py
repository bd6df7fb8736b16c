"""Rules on what few vehicles have, over random missions: each against a plain statement of its source."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from fenced_missions import at, degrees
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from made_missions import item, mission, north, rtl, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PX4, STEP, found
from thinning import examples

from planner.geo.fence import Fence, FencePolygon
from planner.values import replace

if TYPE_CHECKING:
    from planner.autopilot import Autopilot
    from planner.mission.items import Mission

FEW = settings(max_examples=examples(6), deadline=None)
metres = st.floats(-200.0, 200.0)
heights = st.floats(10.0, 60.0)
flown_by = st.sampled_from((ARDUPILOT, STEP))


def codes(one: Mission, autopilot: Autopilot, parameters: str = "") -> set[str]:
    return {finding.code for finding in found(one, autopilot, parameters)}


@FEW
@given(
    by=flown_by,
    places=st.lists(st.floats(100.0, 900.0), min_size=1, max_size=3),
    height_m=heights,
    left_mah=st.floats(1000.0, 7900.0),
    action=st.integers(0, 2),
)
def test_a_second_monitor_of_the_battery_acts_as_the_first_would(
    by: Autopilot, places: list[float], height_m: float, left_mah: float, action: int
) -> None:
    one = mission(takeoff(height_m), *(waypoint(place, height_m) for place in places), rtl())
    common = "BATT_MONITOR,4\nBATT_CAPACITY,8000\n"
    watched = f"LOW_MAH,{left_mah:.0f}\n", f"FS_LOW_ACT,{action}\n"
    first = common + "".join(f"BATT_{row}" for row in watched)
    second = "BATT2_MONITOR,4\nBATT2_CAPACITY,8000\n" + "".join(f"BATT2_{row}" for row in watched)
    own = codes(one, by, first) & {"E103", "E114"}
    assert codes(one, by, common + second) & {"E103", "E114", "E128"} == own | {"E128"}


@FEW
@given(
    places=st.lists(st.tuples(metres, metres), min_size=1, max_size=3),
    half_m=st.floats(205.0, 260.0),
    margin_m=st.floats(2.0, 40.0),
    oa_type=st.sampled_from((0, 1, 2, 3)),
)
def test_a_path_planner_leads_away_wherever_a_place_is_within_its_margin(
    places: list[tuple[float, float]], half_m: float, margin_m: float, oa_type: int
) -> None:
    # Between places in a square none of a straight flight is nearer to its edge than the nearest place.
    room_m = half_m - max(abs(metre) for place in places for metre in place)
    assume(abs(room_m - margin_m) > 2.0)  # stops overshoot, curves cut corners
    corners = tuple(
        degrees(half_m * east, half_m * up) for east, up in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    )
    fence = Fence(polygons=(FencePolygon(inclusion=True, vertices_deg=corners),), circles=())
    one = mission(takeoff(20), *(at(east, up, 20.0) for east, up in places), rtl())
    text = f"OA_TYPE,{oa_type}\nOA_MARGIN_MAX,{margin_m}\nFENCE_ENABLE,1\nFENCE_TYPE,4\n"
    told = codes(replace(one, fence=fence), ARDUPILOT, text)
    assert ("F113" in told) is (oa_type > 0 and room_m < margin_m)


@FEW
@given(
    climb_m=st.floats(0.5, 7.0),
    radius_m=st.floats(0.5, 5.0),
    is_amsl=st.booleans(),
    by=st.sampled_from((PX4, ARDUPILOT)),
)
def test_px4_refuses_every_take_off_lower_than_its_radius_and_a_metre(
    climb_m: float,
    radius_m: float,
    is_amsl: bool,  # noqa: FBT001 - drawn
    by: Autopilot,
) -> None:
    assume(abs(climb_m - radius_m - 1.0) > 0.01)
    first = item(22, north(0), 400.0 + climb_m, frame=0) if is_amsl else takeoff(climb_m)
    one = mission(first, waypoint(100, 20), rtl())
    text = f"NAV_ACC_RAD,{radius_m}\n" if by is PX4 else ""
    assert ("M128" in codes(one, by, text)) is (by is PX4 and climb_m < radius_m + 1.0)


@FEW
@given(
    by=flown_by,
    places=st.lists(st.tuples(heights, st.booleans()), min_size=1, max_size=3),
    has_data=st.booleans(),
    reach_m=st.none() | st.floats(20.0, 50.0),
)
def test_terrain_that_nothing_measures_is_an_error_wherever_an_item_counts_from_it(
    by: Autopilot,
    places: list[tuple[float, bool]],
    has_data: bool,  # noqa: FBT001 - drawn
    reach_m: float | None,
) -> None:
    legs = [
        item(16, north(100.0 * number), height_m, frame=10 if follows else 3)
        for number, (height_m, follows) in enumerate(places, start=1)
    ]
    text = f"TERRAIN_ENABLE,{int(has_data)}\n"
    if reach_m is not None:
        text += f"RNGFND1_TYPE,8\nRNGFND1_ORIENT,25\nRNGFND1_MAX_CM,{100.0 * reach_m}\n"
    over = [height_m for height_m, follows in places if follows]
    begun = [20.0, *(height_m for height_m, _ in places)]
    from_m = [begin_m for begin_m, (_, follows) in zip(begun, places, strict=False) if follows]
    is_off = bool(over) and not has_data
    if over and reach_m is not None:
        highest_m = max(*over, *from_m)
        assume(abs(highest_m - reach_m) > 0.02)
        is_off = highest_m > reach_m
    assert ("A118" in codes(mission(takeoff(20), *legs, rtl()), by, text)) is is_off


@pytest.mark.parametrize(
    ("from_m", "more", "is_off"),
    [
        # Flown by a build of ArduPilot, from 20 m to 8 m above terrain with 12 m of reach: "Failsafe: Terrain
        # Rangefinder Unhealthy", for a waypoint, a circle, a loiter and a spline alike; from 10 m it flies.
        (20.0, "", True),
        (12.5, "", True),
        (12.0, "", False),
        (10.0, "", False),
        (20.0, "WPNAV_RFND_USE,0\n", False),
    ],
)
def test_a_leg_above_terrain_begins_within_the_reach_of_the_rangefinder(
    from_m: float, more: str, *, is_off: bool
) -> None:
    text = f"RNGFND1_TYPE,20\nRNGFND1_ORIENT,25\nRNGFND1_MAX_CM,1200\n{more}"
    made = mission(takeoff(from_m), item(16, north(200), 8.0, frame=10), rtl())
    assert ("A118" in codes(made, ARDUPILOT, text)) is is_off
