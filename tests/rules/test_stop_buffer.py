"""Room to stop before the fence: speed, reaction, stopping distance, position error, wind."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

import pytest
from fenced_missions import at, box, findings_of
from made_missions import METRES_PER_DEGREE_NORTH, rtl, speed, takeoff

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.physics.wind import Wind

if TYPE_CHECKING:
    from planner.findings import Finding

FINAL = 0.9947
"""Flown over commanded speed of the article's quadrotor: the gain of its speed response."""
BEYOND = 10.0 * FINAL * (3.28278 - 3.20591)
"""How far its stop from 10 m/s passes the place where it ends (swarm.md). [m]"""


def ahead(
    gap_m: float,
    *,
    speed_m_s: float = 10.0,
    **more: Any,  # noqa: ANN401 - whatever findings_of takes
) -> dict[str, Finding]:
    """Fly 400 m north, stop there, and have the fence so far behind it."""
    items = (takeoff(20), speed(speed_m_s), at(0, 400), rtl())
    return findings_of(items, box(-100.0, -100.0, 100.0, 400.0 + gap_m), **more)


# Where braking begins the waypoint is as far as the way to stand still: what is needed beyond is
# the way of the reaction time, v · 1 s, the overshoot, and the position error, 2.5 m.
@pytest.mark.parametrize(("gap_m", "fires"), [(13.0, True), (13.4, False)])
def test_a_stop_at_a_waypoint_needs_the_way_of_the_reaction_behind_it(
    gap_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    assert pytest.approx(13.212, abs=1e-3) == 10.0 * FINAL + BEYOND + 2.5
    found = ahead(gap_m)
    assert ("F102" in found) is fires
    if fires:
        assert found["F102"].severity is Severity.WARNING
        assert found["F102"].item == 3


@pytest.mark.parametrize(
    ("conditions", "needed_m"),
    [
        ({"reaction_time_s": 2.0}, 20.0 * FINAL + 2.5),
        ({"position_error_m": 4.0}, 10.0 * FINAL + 4.0),
        ({"wind": Wind(speed_m_s=5.0, from_deg=180.0)}, 10.0 * FINAL + 5.0 + 2.5),
        ({"wind": Wind(speed_m_s=5.0, from_deg=0.0)}, 10.0 * FINAL + 2.5),
        ({"wind": Wind(speed_m_s=5.0, from_deg=90.0)}, 10.0 * FINAL + 2.5),
    ],
)
def test_every_part_of_the_buffer_counts(conditions: dict[str, Any], needed_m: float) -> None:
    assert "F102" in ahead(needed_m + BEYOND - 0.2, **conditions)
    assert "F102" not in ahead(needed_m + BEYOND + 0.2, **conditions)


@pytest.mark.parametrize(
    ("autopilot", "gap_m"),
    [(Autopilot.PX4, 0.2), (Autopilot.ARDUPILOT, 1.2), (Autopilot.STEP, 1.0)],
)
def test_without_reaction_and_error_a_stop_right_at_the_fence_is_allowed(
    autopilot: Autopilot, gap_m: float
) -> None:
    # The article's vehicle overshoots its waypoint by 0.7 m, ArduPilot by 1.15 m from 10 m/s.
    caution = {"reaction_time_s": 0.0, "position_error_m": 0.0}
    parameters = "FENCE_MARGIN,0\n" if autopilot is Autopilot.ARDUPILOT else ""
    assert ahead(gap_m, autopilot=autopilot, parameters=parameters, **caution) == {}


def test_the_overshoot_of_a_stop_is_part_of_the_flight() -> None:
    assert set(ahead(0.2, reaction_time_s=0.0, position_error_m=0.0)) == {"F101"}


def test_px4_needs_the_way_its_hold_takes_and_names_the_speed_that_fits() -> None:
    message = ahead(2.6, speed_m_s=12.0, autopilot=Autopilot.PX4)["F102"].message
    # With the model's noise of 0.31 m, 12 m/s are 12 (1 − 0.0775/(1 + 12/1.21)) = 11.915 m/s:
    # v · 1 s + v (v/6 + 0.6 s) + 2.5 m; braking begins 42 m before the waypoint.
    for part in ("takes 45.2 m", "11.9 m reaction", "30.8 m braking", "2.5 m position error"):
        assert part in message
    [room_m] = re.findall(r"is ([\d.]+) m ahead", message)
    assert float(room_m) == pytest.approx(44.6, abs=0.5)
    # v²/6 + 1.6 v + 2.5 = 44.6 has the root 3 (√(2.56 + 42.1/1.5) − 1.6) = 11.8 m/s.
    [fits_m_s] = re.findall(r"([\d.]+) m/s or less", message)
    assert float(fits_m_s) == pytest.approx(11.8, abs=0.15)


def test_ardupilot_has_its_own_way_to_stop() -> None:
    message = ahead(2.6, autopilot=Autopilot.ARDUPILOT)["F102"].message
    # 25 m from 10 m/s were measured on recorded flights.
    [stop_m] = re.findall(r"([\d.]+) m braking", message)
    assert float(stop_m) == pytest.approx(25.0, abs=0.5)


@pytest.mark.parametrize(
    ("gap_m", "speed_m_s", "expected"),
    [
        # Flown by a build, at 10 m/s to a stop 0.5 m before FENCE_RADIUS: 1.0 m beyond it, and a breach.
        (0.5, 10.0, Severity.ERROR),
        (1.1, 10.0, Severity.ERROR),
        (1.2, 10.0, Severity.WARNING),  # 0.0115 · 10² = 1.15 m
        (0.5, 6.0, Severity.WARNING),  # 0.41 m
    ],
)
def test_ardupilot_is_carried_beyond_a_full_stop(
    gap_m: float, speed_m_s: float, expected: Severity
) -> None:
    given: dict[str, Any] = {"position_error_m": 0.1, "autopilot": Autopilot.ARDUPILOT}
    finding = ahead(gap_m, speed_m_s=speed_m_s, parameters="FENCE_MARGIN 0.1", **given)["F102"]
    assert finding.severity is expected
    assert ("beyond the place it stops at" in finding.message) is (expected is Severity.ERROR)


@pytest.mark.parametrize(("gap_m", "fires"), [(1.1, True), (1.3, False)])
def test_without_a_reaction_the_stop_itself_is_told(gap_m: float, *, fires: bool) -> None:
    caution = {"position_error_m": 0.0, "reaction_time_s": 0.0}
    found = ahead(gap_m, autopilot=Autopilot.ARDUPILOT, parameters="FENCE_MARGIN 0.1", **caution)
    assert ("F102" in found) is fires
    if fires:
        assert "passes the place it stops at by 1.1 m" in found["F102"].message


@pytest.mark.parametrize(("clear_m", "fires"), [(2.3, True), (2.7, False)])
@pytest.mark.parametrize("autopilot", list(Autopilot))
def test_a_leg_along_the_fence_keeps_the_position_error_off_it(
    autopilot: Autopilot,
    clear_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    items = (takeoff(20), at(0, 400), rtl())
    area = box(-100.0, -100.0, clear_m, 500.0)
    found = findings_of(items, area, autopilot=autopilot)
    assert set(found) == ({"F102"} if fires else set())
    if fires:
        assert "at 2.3 m; the position may be wrong by 2.5 m" in found["F102"].message
        assert found["F102"].severity is Severity.ERROR


@pytest.mark.parametrize("autopilot", list(Autopilot))
def test_a_corner_of_an_exclusion_beside_the_middle_of_a_leg_is_told_with_its_place(
    autopilot: Autopilot,
) -> None:
    items = (takeoff(20), at(0, 2000), rtl())
    beside = box(1.5, 990.0, 40.0, 1010.0, inclusion=False)
    finding = findings_of(items, beside, autopilot=autopilot)["F102"]
    assert finding.item == 2
    assert (
        "passes exclusion polygon 1 at 1.5 m; the position may be wrong by 2.5 m" in finding.message
    )
    # Rounded up, so that it helps: the legs of autopilots are bent by a part of a millimetre.
    assert re.match(r"keep 1\.[01] m farther", finding.fix)
    assert finding.stretch is not None
    north_m = (finding.stretch.start_deg[0] - 47.0) * METRES_PER_DEGREE_NORTH
    assert 989.0 < north_m < 1011.0


def test_ardupilots_own_margin_is_kept_where_it_is_wider() -> None:
    items = (takeoff(20), at(0, 400), rtl())
    area = box(-100.0, -100.0, 4.0, 500.0)
    assert findings_of(items, area, autopilot=Autopilot.ARDUPILOT) == {}
    found = findings_of(items, area, autopilot=Autopilot.ARDUPILOT, parameters="FENCE_MARGIN,5\n")
    assert set(found) == {"F102"}


def test_where_a_stop_begun_at_once_passes_the_fence_it_is_an_error() -> None:
    # PX4 flies through a bend of 15° at 4.8 m/s, which takes 4.8²/6 + 0.6 · 4.8 = 6.7 m to stop; the
    # turn begins 2 m before the waypoint, and 1 m before it the vehicle still flies straight on.  3 m
    # behind it, left of the turn, an exclusion begins.
    bend = (at(0, 300), at(77.6, 589.8))
    items = (takeoff(20), speed(12.0), *bend, rtl())
    wall = box(-1.0, 303.0, 0.3, 305.0, inclusion=False)
    finding = findings_of(items, wall, autopilot=Autopilot.PX4, position_error_m=0.0)["F102"]
    assert finding.severity is Severity.ERROR
    beyond = box(-1.0, 306.5, 0.3, 308.5, inclusion=False)
    finding = findings_of(items, beyond, autopilot=Autopilot.PX4, position_error_m=0.0)["F102"]
    assert finding.severity is Severity.WARNING
    clear = box(-1.0, 312.0, 0.3, 314.0, inclusion=False)
    assert findings_of(items, clear, autopilot=Autopilot.PX4, position_error_m=0.0) == {}


@pytest.mark.parametrize("autopilot", [Autopilot.STEP, Autopilot.ARDUPILOT])
def test_a_circle_is_left_along_its_tangent(autopilot: Autopilot) -> None:
    circle = at(0, 0, command=18, params=(1.0, 0.0, 50.0, None))
    items = (takeoff(20), speed(4.0), circle, rtl())
    # An island of 1 m, 6 m ahead on the tangent and 0.36 m outside the circle; both far from legs.
    east_m, north_m = 50.0, 6.0
    island = box(east_m + 0.5, north_m - 0.5, east_m + 1.5, north_m + 0.5, inclusion=False)
    found = findings_of(items, island, autopilot=autopilot)
    assert set(found) == {"F102"}


def test_a_flight_around_a_fence_is_told_its_nearest_place_and_how_far_to_keep_off() -> None:
    # A square of 300 m with the fence 1 m outside it; what is said to help is done, and helps.
    items = (takeoff(20), at(0, 300), at(300, 300), at(300, 0), at(0, 0), rtl())

    def around(clear_m: float) -> dict[str, Finding]:
        area = box(-clear_m, -clear_m, 300.0 + clear_m, 300.0 + clear_m)
        return findings_of(items, area, autopilot=Autopilot.ARDUPILOT)

    finding = around(1.0)["F102"]
    assert (
        "passes inclusion polygon 1 at 1.0 m; the position may be wrong by 2.5 m" in finding.message
    )
    [farther_m] = re.findall(r"keep ([\d.]+) m farther", finding.fix)
    assert around(1.0 + float(farther_m)) == {}
    # No more than needed: half a metre less is too little.
    assert "F102" in around(0.5 + float(farther_m))


@cache
def gap_that_leaves(left_m: float) -> float:
    """Return the gap behind a stop from 10 m/s of which a vehicle that goes straight on leaves so much."""
    least, most = 0.0, 30.0
    while most - least > 1e-4:
        middle = 0.5 * (least + most)
        fires = "F102" in ahead(middle, position_error_m=left_m)
        least, most = (middle, most) if fires else (least, middle)
    return most


@pytest.mark.parametrize(("more_m", "is_told"), [(-0.003, True), (0.003, False)])
def test_beside_the_fence_a_stop_a_decimetre_nearer_than_the_path_is_told(
    more_m: float,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # Along an edge 2 m to the east, to a stop that would leave 1.9 m to the edge in the north.
    area = box(-100.0, -100.0, 2.0, 400.0 + gap_that_leaves(1.9) + more_m)
    message = findings_of((takeoff(20), speed(10.0), at(0, 400), rtl()), area)["F102"].message
    assert message.startswith("passes inclusion polygon 1 at 2.0 m")
    assert ("; straight on it stops 1.9 m before it" in message) is is_told


@pytest.mark.parametrize(("more_m", "is_told"), [(-0.003, True), (0.003, False)])
def test_elsewhere_too_a_stop_a_decimetre_nearer_than_the_path_is_told_besides(
    more_m: float,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # The stop leaves 1.9 m to an exclusion in the north; the way on passes it in the west at 2 m.
    south = 400.0 + gap_that_leaves(1.9) + more_m
    area = box(-50.0, south, 100.0, south + 50.0, inclusion=False)
    ends = (at(0, 400), at(-52, 400), at(-52, 600), at(-52, 600, 0.0, command=21))
    message = findings_of((takeoff(20), speed(10.0), *ends), area)["F102"].message
    assert message.startswith("passes exclusion polygon 1 at 2.0 m")
    assert ("straight on it stops 1.9 m before it" in message) is is_told


@pytest.mark.parametrize(("nearer_m", "item"), [(0.097, 1), (0.103, 3)])
def test_of_places_as_near_within_a_decimetre_the_first_is_told(nearer_m: float, item: int) -> None:
    stops = (5.0, 0.0, 0.0, None)
    ends = tuple(
        at(east_m, north_m, params=stops)
        for east_m, north_m in ((0.0, 200.0), (nearer_m, 210.0), (nearer_m, 400.0))
    )
    items = (takeoff(20), *ends, at(nearer_m, 400, 0.0, command=21))
    area = box(-100.0, -100.0, 2.0, 500.0)
    finding = findings_of(items, area, autopilot=Autopilot.ARDUPILOT)["F102"]
    assert finding.item == item
