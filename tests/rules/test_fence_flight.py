"""The flown path against the fence: where it leaves it, home, rally points and ways home."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from fenced_missions import at, box, circle, degrees, findings_of, motion_of, rally
from made_missions import item, north, rtl, takeoff

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.fence import FencePolygon

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

EVERY_AUTOPILOT = pytest.mark.parametrize("autopilot", list(Autopilot))
AROUND = box(-400.0, -400.0, 400.0, 400.0)
METRES_PER_DEGREE_EAST = 76_057.0
"""Length of a degree of longitude at 47° north: N cos 47° π/180, N = 6 389 700 m."""


def loiter(east_m: float, north_m: float, radius_m: float) -> tuple[MissionItem, ...]:
    turn = at(east_m, north_m, command=18, params=(1.0, 0.0, radius_m, None))
    return (takeoff(20), turn, rtl())


@EVERY_AUTOPILOT
def test_a_flight_well_inside_has_nothing_to_tell(autopilot: Autopilot) -> None:
    items = (takeoff(20), at(0, 100), at(100, 100), rtl())
    out = circle(-200.0, 0.0, 50.0, inclusion=False)
    assert findings_of(items, AROUND, out, autopilot=autopilot) == {}


def test_without_a_fence_shapely_is_not_waited_for() -> None:
    code = (
        "import sys; sys.path.insert(0, 'tests');"
        "from fenced_missions import Autopilot, at, findings_of;"
        "from made_missions import rtl, takeoff;"
        "[findings_of((takeoff(20), at(0, 100), rtl()), autopilot=a) for a in Autopilot];"
        "print(*{'shapely', 'planner.flight.path'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    assert done.stdout.split() == []


@EVERY_AUTOPILOT
def test_a_sliver_of_one_metre_across_a_long_leg_is_found(autopilot: Autopilot) -> None:
    sliver = box(-50.0, 1500.0, 50.0, 1501.0, inclusion=False)
    finding = findings_of((takeoff(20), at(0, 3000), rtl()), sliver, autopilot=autopilot)["F101"]
    assert (finding.severity, finding.item) == (Severity.ERROR, 2)
    # One metre on the way out, one on the way back.
    assert "flight enters exclusion polygon 1: 2.0 m flown in breach of the fence, at 2 items" in (
        finding.message
    )
    assert finding.stretch is not None
    assert finding.stretch.distance_m == pytest.approx(2.0, abs=0.01)
    assert finding.stretch.start_deg == pytest.approx(degrees(0.0, 1500.0), abs=1e-6)


def along_the_parallel(off_m: float, *, autopilot: Autopilot, straight: bool) -> tuple[float, bool]:
    """Fly 20 km along 47° north past a square of 10 m; return where its edge is and F101.

    PX4 #28759: the straight line passes L² tan φ / 8R north of the parallel in the middle.
    """
    bow_m = 20_000.0**2 * math.tan(math.radians(47.0)) / (8.0 * 6_389_700.0)
    middle_deg = 8.0 + 13_000.0 / METRES_PER_DEGREE_EAST
    ends_deg = [middle_deg + way / METRES_PER_DEGREE_EAST for way in (-10_000.0, 10_000.0)]
    items = (takeoff(20), *(item(16, 47.0, 20.0, longitude_deg=end) for end in ends_deg))
    middle_m = (bow_m if straight else 0.0) + off_m
    side_deg = 5.0 / METRES_PER_DEGREE_EAST
    square = FencePolygon(
        inclusion=False,
        vertices_deg=tuple(
            (north(middle_m + y), middle_deg + x)
            for x, y in ((-side_deg, -5), (side_deg, -5), (side_deg, 5), (-side_deg, 5))
        ),
    )
    found = findings_of(items, square, autopilot=autopilot, position_error_m=0.0)
    return bow_m, "F101" in found


@pytest.mark.parametrize("autopilot", list(Autopilot))
def test_the_middle_of_a_long_parallel_is_where_the_autopilot_flies_it(
    autopilot: Autopilot,
) -> None:
    straight = autopilot is not Autopilot.ARDUPILOT
    for off_m, crosses in ((0.0, True), (4.9, True), (-4.9, True), (5.1, False), (-5.1, False)):
        bow_m, found = along_the_parallel(off_m, autopilot=autopilot, straight=straight)
        assert bow_m == pytest.approx(8.39, abs=0.01)
        assert found is crosses


@pytest.mark.parametrize("autopilot", [Autopilot.STEP, Autopilot.ARDUPILOT])
def test_the_rim_of_a_loiter_crosses_though_its_centre_is_far(autopilot: Autopilot) -> None:
    # PX4 #28527: a radius of 200 m; the rim passes 10 m into the exclusion.
    keep_out = box(190.0, -20.0, 260.0, 20.0, inclusion=False)
    finding = findings_of(loiter(0.0, 0.0, 200.0), keep_out, autopilot=autopilot)["F107"]
    assert (finding.severity, finding.item) == (Severity.ERROR, 2)
    # 40 m of rim, some curved: 2 · 200 asin(20/200) = 40.07 m.
    assert finding.stretch is not None
    assert finding.stretch.distance_m == pytest.approx(40.07, abs=0.2)


@pytest.mark.parametrize(
    ("autopilot", "clear_m", "crosses"),
    [
        (Autopilot.STEP, 0.5, False),
        (Autopilot.STEP, -0.5, True),
        # ArduPilot's reference is pulled round 2.9 m inside at 10 m/s (`circle_path`).
        (Autopilot.ARDUPILOT, -2.0, False),
        (Autopilot.ARDUPILOT, -4.0, True),
    ],
)
def test_a_loiter_crosses_where_the_circle_does(
    autopilot: Autopilot,
    clear_m: float,
    crosses: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # ArduPilot's metres are up to 0.3 m in 200 m others than those on the ground at 47° north.
    keep_out = box(200.0 + clear_m, -20.0, 260.0, 20.0, inclusion=False)
    found = findings_of(loiter(0.0, 0.0, 200.0), keep_out, autopilot=autopilot)
    assert ("F107" in found) is crosses


def test_rally_points_outside_are_errors_and_those_inside_are_none() -> None:
    items = (takeoff(20), at(0, 100), rtl())
    found = findings_of(items, AROUND, rally_points=(rally(0.0, 50.0), rally(0.0, 435.0)))
    assert set(found) == {"F103"}
    assert found["F103"].severity is Severity.ERROR
    assert "rally point 2 is 35 m outside inclusion polygon 1" in found["F103"].message
    assert findings_of(items, AROUND, rally_points=(rally(0.0, 399.9),)) == {}
    assert set(findings_of(items, AROUND, rally_points=(rally(0.0, 400.1),))) == {"F103"}


@EVERY_AUTOPILOT
@pytest.mark.parametrize(("south_m", "outside"), [(0.1, True), (-0.1, False)])
def test_home_outside_is_an_error(
    autopilot: Autopilot,
    south_m: float,
    outside: bool,  # noqa: FBT001 - a table of cases
) -> None:
    area = box(-200.0, south_m, 200.0, 400.0)
    found = findings_of((takeoff(20), at(0, 100), rtl()), area, autopilot=autopilot)
    assert ("F104" in found) is outside
    if outside:
        assert found["F104"].severity is Severity.ERROR


def test_two_inclusions_apart_are_an_error_unless_ardupilot_unites_them() -> None:
    items = (takeoff(20), at(0, 100), rtl())
    areas = (box(-200.0, -200.0, 200.0, 200.0), box(500.0, -200.0, 900.0, 200.0))
    assert "F106" in findings_of(items, *areas, autopilot=Autopilot.PX4)
    assert "F106" in findings_of(items, *areas, autopilot=Autopilot.ARDUPILOT)
    united = findings_of(
        items, *areas, autopilot=Autopilot.ARDUPILOT, parameters="FENCE_OPTIONS,2\n"
    )
    assert united == {}


@EVERY_AUTOPILOT
@pytest.mark.parametrize(("top_m", "crosses"), [(104.0, True), (99.0, False)])
def test_the_way_home_crosses_an_exclusion_that_the_flight_goes_around(
    autopilot: Autopilot,
    top_m: float,
    crosses: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # From (200, 200) home is a diagonal, at the middle of it a wall ends; ArduPilot turns some metres
    # before the place.
    wall = box(100.0, -300.0, 300.0, top_m, inclusion=False)
    items = (takeoff(20), at(0, 200), at(200, 200), at(0, 200), rtl())
    found = findings_of(items, wall, autopilot=autopilot, position_error_m=0.0)
    assert set(found) == ({"F108"} if crosses else set())
    if crosses:
        assert found["F108"].severity is Severity.ERROR


def test_the_way_home_is_judged_between_waypoints_too() -> None:
    # A pillar of 1 m on the way home from the middle of a leg, from neither of its ends.
    pillar = box(49.5, 99.5, 50.5, 100.5, inclusion=False)
    items = (takeoff(20), at(0, 200), at(200, 200), at(0, 200), rtl())
    finding = findings_of(items, pillar)["F108"]
    assert finding.item == 3
    # From (100, 200) on the line through (50, 100).
    assert finding.stretch is not None
    assert finding.stretch.end_deg == pytest.approx((47.0, 8.0), abs=1e-6)


def test_a_nearer_rally_point_spares_the_way_home_the_fence() -> None:
    wall = box(100.0, -300.0, 300.0, 101.0, inclusion=False)
    items = (takeoff(20), at(0, 200), at(200, 200), at(0, 200), rtl())
    px4: dict[str, Any] = {"autopilot": Autopilot.PX4, "position_error_m": 0.0}
    assert "F108" in findings_of(items, wall, **px4)
    # From the last half of the leg the rally point at its end is nearer than home.
    assert findings_of(items, wall, rally_points=(rally(200.0, 210.0),), **px4) == {}
    # A vehicle of step references knows no rally points: it goes home, as its energy is counted.
    assert "F108" in findings_of(items, wall, rally_points=(rally(200.0, 210.0),))


def test_the_rally_point_that_is_judged_is_the_one_the_vehicle_takes() -> None:
    # Behind a wall; home is nearer from everywhere.
    wall = box(300.0, -300.0, 310.0, 300.0, inclusion=False)
    items = (takeoff(20), at(0, 100), item(21, degrees(0.0, 0.0)[0]))
    behind: dict[str, Any] = {
        "rally_points": (rally(600.0, 0.0),),
        "autopilot": Autopilot.ARDUPILOT,
    }
    assert findings_of(items, wall, parameters="RALLY_INCL_HOME,1\n", **behind) == {}
    given = "RALLY_INCL_HOME,0\nRALLY_LIMIT_KM,0\n"
    finding = findings_of(items, wall, parameters=given, **behind)["F108"]
    assert "straight return to rally point 1 from here" in finding.message


@pytest.mark.parametrize(
    ("inside", "crosses"),
    [((200.0, 300.0), True), ((200.0, 170.0), False)],  # in the first triangle, below it
)
def test_a_return_to_the_landing_leads_straight_to_its_first_place(
    inside: tuple[float, float], *, crosses: bool
) -> None:
    # From the leg north to (0, 400) to (400, 400), where the landing at (500, −50) begins: what returns
    # pass over lies between the diagonal and that leg's end.
    pillar = box(inside[0], inside[1], inside[0] + 5.0, inside[1] + 5.0, inclusion=False)
    begins = item(189, *degrees(400.0, 400.0)[:1], longitude_deg=degrees(400.0, 400.0)[1])
    items = (takeoff(20), at(0, 400), begins, at(400, 400), at(500, -50, 0.0, command=21))
    px4: dict[str, Any] = {"autopilot": Autopilot.PX4, "position_error_m": 0.0}
    found = findings_of(items, pillar, parameters="RTL_TYPE,1\n", **px4)
    assert set(found) == ({"F108"} if crosses else set())


def test_a_return_from_the_middle_of_a_leg_is_told_by_what_it_crosses() -> None:
    # In the triangle of a leg and home: the returns from the leg's ends, at 45°, pass 56 m beside it.
    pillar = circle(100.0, 0.0, 15.0, inclusion=False)
    items = (takeoff(20), at(200, -200), at(250, 250), rtl())
    found = findings_of(items, pillar)["F108"]
    assert found.item == 3
    assert "begun on the way here crosses exclusion circle" in found.message
    # From the middle of the legs to and from (200, 0) it is at the place that it crosses most.
    there = findings_of((takeoff(20), at(200, -200), at(200, 0), at(250, 250), rtl()), pillar)[
        "F108"
    ]
    assert "straight return home from here crosses exclusion circle" in there.message


def test_the_rally_point_that_is_judged_is_the_nearest_far_from_home_too() -> None:
    # 60 km north of home and 200 m to the east a wall bars the way south; a rally point is north of it.
    far_m = 60_000.0
    wall = box(100.0, far_m - 310.0, 300.0, far_m - 300.0, inclusion=False)
    landing = at(0, far_m, 0.0, command=21)
    items = (takeoff(20), at(0, far_m), at(200, far_m), at(0, far_m), landing)
    home, there = rally(0.0, 50.0), rally(-50.0, far_m + 50.0)
    px4: dict[str, Any] = {"autopilot": Autopilot.PX4, "position_error_m": 0.0}
    for points, codes in (((home,), {"F108"}), ((home, there), set()), ((there, home), set())):
        assert set(findings_of(items, wall, rally_points=points, **px4)) == codes


def test_a_home_that_the_mission_moves_is_where_returns_lead() -> None:
    # Out of the fence, though everything that is flown is inside.
    moved = item(179, degrees(0.0, 700.0)[0], 0.0, longitude_deg=degrees(0.0, 700.0)[1])
    items = (takeoff(20), at(0, 100), moved, at(0, 200), item(21, degrees(0.0, 0.0)[0]))
    for autopilot in (Autopilot.PX4, Autopilot.ARDUPILOT):
        assert "F108" not in findings_of((*items[:2], *items[3:]), AROUND, autopilot=autopilot)
        assert "F108" in findings_of(items, AROUND, autopilot=autopilot)


@pytest.mark.parametrize(
    ("autopilot", "cuts"),
    [(Autopilot.PX4, True), (Autopilot.ARDUPILOT, True), (Autopilot.STEP, False)],
)
def test_a_corner_is_judged_as_it_is_flown(
    autopilot: Autopilot,
    cuts: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # Inside a corner of 90°, clear of both legs; ArduPilot passes 1.7 m inside the corner, PX4 leaves
    # the first leg 2 m before it, the article's vehicle stops at it.
    post = box(0.3, 298.0, 2.0, 299.7, inclusion=False)
    items = (takeoff(20), at(0, 300), at(300, 300), at(0, 400))
    found = findings_of(items, post, autopilot=autopilot, position_error_m=0.0)
    assert ("F101" in found) is cuts


@pytest.mark.parametrize(("off_m", "crosses"), [(0.0, True), (2.0, False)])
def test_a_spline_is_judged_as_it_is_flown(
    off_m: float,
    crosses: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # A Hermite spline from (0, 100) to (200, 100) leaves the first place on the way from the one before
    # to the one after, so that it bulges north; where, is asked of the motion itself.
    spline = (at(0, 100, command=82), at(200, 100, command=82), at(200, -100))
    items = (takeoff(20), *spline, rtl())
    motion = motion_of(Autopilot.ARDUPILOT, *items)
    state = motion.state_at_time(np.linspace(0.0, float(motion.segments.duration_s.sum()), 20_000))
    nearest = int(np.argmin(np.hypot(state.east_m - 100.0, state.north_m - 115.0)))
    east_m, north_m = float(state.east_m[nearest]), float(state.north_m[nearest])
    assert north_m > 103.0
    post = box(
        east_m - 0.5, north_m - 0.5 + off_m, east_m + 0.5, north_m + 0.5 + off_m, inclusion=False
    )
    found = findings_of(
        items,
        post,
        autopilot=Autopilot.ARDUPILOT,
        parameters="FENCE_MARGIN,0\n",
        position_error_m=0.0,
    )
    assert ("F101" in found) is crosses


def test_a_flight_that_leaves_twice_is_drawn_as_two_parts_along_its_path() -> None:
    # North out of a square of 400 m half side, along its edge 100 m outside, and in again: one
    # part with two corners; then straight out to the south and back: a part that turns about.
    items = (takeoff(20), at(0, 500), at(200, 500), at(200, 0), at(0, -500), at(0, 0), rtl())
    finding = findings_of(items, AROUND)["F101"]
    stretch = finding.stretch
    assert stretch is not None
    first, second = stretch.parts_deg
    assert (stretch.start_deg, stretch.end_deg) == (first[0], first[-1])
    corners = [(0.0, 400.0), (0.0, 500.0), (200.0, 500.0), (200.0, 400.0)]
    for corner in corners:
        assert any(
            point == pytest.approx(degrees(*corner), abs=2e-5)  # 2 m: the overshoot at corners
            for point in first
        )
    assert second[0] == pytest.approx(degrees(40.0, -400.0), abs=2e-5)
    assert second[-1] == pytest.approx(degrees(0.0, -400.0), abs=2e-5)
    # 100 + 200 + 100 m, and √(100² + 40²) + 100 m, and a metre past and back at corners.
    assert stretch.distance_m == pytest.approx(607.7, abs=8.0)
    for line in (first, second):
        for latitude, longitude in line:  # no chord through the inside
            north_m = (latitude - 47.0) * 111_180.0
            east_m = (longitude - 8.0) * METRES_PER_DEGREE_EAST
            assert max(abs(north_m), abs(east_m)) > 399.0


@pytest.mark.parametrize(("bend_rad", "points"), [(0.0, 0), (0.097, 0), (0.103, 3)])
def test_a_way_outside_is_drawn_with_its_bends_of_a_tenth_of_a_radian_and_more(
    bend_rad: float, points: int
) -> None:
    # Out to the north through the edge at 400 m, on at an angle from 500 m, and down there.
    end = at(300.0 * math.sin(bend_rad), 500.0 + 300.0 * math.cos(bend_rad))
    finding = findings_of((takeoff(20), at(0, 500), end), AROUND, autopilot=Autopilot.ARDUPILOT)
    stretch = finding["F101"].stretch
    assert stretch is not None
    assert [len(part) for part in stretch.parts_deg] == [points] * (points > 0)
    assert stretch.start_deg == pytest.approx(degrees(0.0, 400.0), abs=2e-6)
    assert stretch.end_deg == pytest.approx((end.latitude_deg, end.longitude_deg), abs=2e-6)


@pytest.mark.parametrize("autopilot", [Autopilot.STEP, Autopilot.ARDUPILOT])
@pytest.mark.parametrize(("delay_s", "crosses"), [(20.0, True), (1.0, False)])
def test_a_delay_behind_a_circle_leads_on_round_it(
    autopilot: Autopilot, delay_s: float, *, crosses: bool
) -> None:
    # Flown with ArduCopter: 7 s for the quarter of a circle of 20 m from the south to the west, and by 20 s
    # of NAV_DELAY round it by the north and the east, 19 m from its centre.
    quarter = at(0, 60, command=18, params=(0.25, 0.0, 20.0, None))
    delay = item(93, frame=2, params=(delay_s, -1.0, -1.0, -1.0))
    east = box(15.0, 55.0, 25.0, 65.0, inclusion=False)
    items = (takeoff(20), quarter, delay, at(-60, 60), rtl())
    found = findings_of(items, east, autopilot=autopilot)
    assert ("F107" in found) is crosses
    assert "F107" not in findings_of((*items[:2], *items[3:]), east, autopilot=autopilot)
