"""Waits of PX4: holds, loiters, delays, and headings waited for."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import go, stage, takeoff
from made_returns import to_home
from px4_flights import fly_px4, px4_returns
from stepped_point import leg_time_s

from planner.flight.motion.kinematics import STATES
from planner.flight.motion.px4.braking import yaw_time_s
from planner.mission.route.stage import Stage, StageKind
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.arrays import FloatArray

PX4 = Px4Parameters()


_AFAR = stage(StageKind.CHANGE_HEIGHT, 0.0, 100.0, 20.0)


def took_s(*stages: Stage, parameters: Px4Parameters = PX4) -> np.ndarray:
    """Return how long each stage took until it was done."""
    motion = fly_px4(stages, parameters)
    return np.diff(np.concatenate(([0.0], motion.segments.end_s[motion.done_segment])))


@pytest.mark.parametrize("kind", [StageKind.GO, StageKind.LOITER])
def test_a_hold_begins_where_the_place_counts_as_reached(kind: StageKind) -> None:
    motion = fly_px4((takeoff(), stage(kind, 0.0, 200.0, hold=30.0), go(200.0, 200.0)), PX4)
    hover = STATES.index("hover")
    held = np.flatnonzero(motion.segments.state == hover)
    assert motion.segments.duration_s[held] == pytest.approx([30.0])
    begin = motion.segments.end_s[held] - 30.0
    reached, left = (motion.state_at_time(time) for time in (begin, begin + 30.0))
    # Still braking 2 m before its target; standing there when it goes on.
    assert reached.north_m == pytest.approx(198.0, abs=0.01)
    assert left.north_m == pytest.approx(200.0, abs=0.01)
    assert left.ground_speed_m_s == pytest.approx(0.0, abs=0.01)


def test_a_loiter_without_time_is_still_a_stop() -> None:
    places = (go(0.0, 200.0), go(0.0, 400.0))
    flown = took_s(takeoff(), *places).sum()
    stopped = took_s(takeoff(), replace(places[0], kind=StageKind.LOITER), places[1]).sum()
    # Passed at 5 m/s or at the 1.2 m/s of a stop 2 m ahead: braking and speeding up again.
    assert stopped > flown + 1.5


@pytest.mark.parametrize("seconds", [3.0, 47.5])
def test_a_delay_takes_its_time_and_is_not_seen_coming(seconds: float) -> None:
    delay = stage(StageKind.DELAY, 0.0, 200.0, hold=seconds)
    without = took_s(takeoff(), go(0.0, 200.0), go(0.0, 400.0))
    with_it = took_s(takeoff(), go(0.0, 200.0), delay, go(0.0, 400.0))
    # The look-ahead sees the waypoint behind it: the place is passed at full speed.
    assert with_it[1] == pytest.approx(without[1], abs=0.01)
    assert with_it[2] == pytest.approx(seconds, abs=1e-6)


ANY_DEG = np.linspace(0.0, 180.0, 10_001)
"""Turns from a heading that nobody knows."""


def turn_s(angle_deg: FloatArray) -> FloatArray:
    """Return the times to within 12° of the end of turns at 20°/s², no faster than 60°/s. [s]

    2 √(θ/20) less the last √(24/20) s; the mean of all turns is
    (4/3 (180^1.5 − 12^1.5)/√20 − 168 √1.2)/180 = 2.909 s.
    """
    return np.where(angle_deg > 12.0, 2.0 * np.sqrt(angle_deg / 20.0) - math.sqrt(1.2), 0.0)


@pytest.mark.parametrize(("radius_m", "reach_m"), [(5.0, 7.0), (-5.0, 7.0), (0.0, 82.0)])
def test_a_change_of_height_begins_within_the_loiter_radius_and_ends_at_its_height(
    radius_m: float, reach_m: float
) -> None:
    # NAV_ACC_RAD 2 m and the second parameter, or NAV_LOITER_RAD 80 m (``is_mission_item_reached``).
    change = replace(stage(StageKind.CHANGE_HEIGHT, 0.0, 200.0, 90.0), radius_m=radius_m)
    motion = fly_px4((takeoff(), change, go(0.0, 400.0, 90.0)), PX4)
    ends = motion.segments.end_s
    time = np.arange(ends[0], ends[motion.done_segment[1]], 0.01)
    state = motion.state_at_time(time)
    # The first 0.05 m are climbed in (6 · 0.05/4)^(1/3) s, in which it flies 2.1 m.
    climbing = np.flatnonzero(state.height_m > 50.05)[0]
    assert 200.0 - state.north_m[climbing] == pytest.approx(reach_m - 1.0, abs=1.2)
    assert state.height_m[-1] == pytest.approx(90.0 - PX4.altitude_acceptance_m, abs=0.05)
    # Both axes are flown at once, on the straight way to the place.
    way_left = 200.0 - state.north_m[-1]
    assert way_left == pytest.approx(reach_m * 0.8 / 40.0, abs=0.3)


def test_a_loiter_wider_than_the_way_to_it_changes_height_from_the_start() -> None:
    change = replace(stage(StageKind.CHANGE_HEIGHT, 0.0, 60.0, 90.0), radius_m=70.0)
    motion = fly_px4((takeoff(), go(0.0, 0.0, hold=9.0), change), PX4)
    begins = motion.segments.end_s[motion.done_segment[1]]
    soon = motion.state_at_time(np.array([begins + 2.0]))
    assert soon.height_m[0] > 51.0


@pytest.mark.parametrize(
    ("distance_m", "change", "wait_s"),
    [
        (0.0, {}, 6.0 - math.sqrt(1.2)),  # half a turn: the heading at arming is not known
        (0.0, {"yaw_timeout_s": 5.0}, 0.0),
        (0.0, {"return_min_distance_m": 0.0}, 0.0),
        (13.1, {}, 0.0),  # beyond RTL_MIN_DIST and 3 m the heading of home is not asked for
    ],
)
def test_a_return_begun_near_home_waits_for_the_heading_of_home(
    distance_m: float, change: dict[str, float], wait_s: float
) -> None:
    anyhow = replace(PX4, **{**change, "yaw_acceptance_rad": math.pi})
    waited_s = home_s(distance_m, replace(PX4, **change)) - home_s(distance_m, anyhow)
    assert waited_s == pytest.approx(wait_s, abs=0.01)


def test_a_return_that_may_begin_within_its_least_distance_waits_as_one_that_does() -> None:
    within = home_s(12.9, replace(PX4, return_min_distance_m=40.0))
    assert home_s(12.9, PX4) == pytest.approx(within)
    assert within > home_s(12.9, replace(PX4, return_min_distance_m=9.8)) + 0.5


def home_s(distance_m: float, parameters: Px4Parameters) -> float:
    stages = (
        *(takeoff(), go(0.0, 200.0), go(0.0, distance_m, hold=20.0)),
        stage(StageKind.RETURN, height_m=0.0),
    )
    motion = fly_px4(stages, parameters)
    return float(motion.segments.end_s[-1] - motion.segments.end_s[motion.done_segment[2]])


@pytest.mark.parametrize(
    ("armed_deg", "wait_s"),
    [
        # It comes home from the north. 20°/s² turn 90° in 2 √(90/20) s, of which the last 12° are not asked.
        (180.0, 0.0),
        (90.0, 2.0 * math.sqrt(4.5) - math.sqrt(1.2)),
        (270.0, 2.0 * math.sqrt(4.5) - math.sqrt(1.2)),
        (0.0, 6.0 - math.sqrt(1.2)),
        (None, 6.0 - math.sqrt(1.2)),
    ],
)
def test_the_heading_of_home_is_that_at_arming(armed_deg: float | None, wait_s: float) -> None:
    stages = (
        *(takeoff(), go(0.0, 200.0), go(0.0, 0.0, hold=20.0)),
        stage(StageKind.RETURN, height_m=0.0),
    )
    heading_rad = None if armed_deg is None else math.radians(armed_deg)
    motion = fly_px4(stages, PX4, heading_rad=heading_rad)
    anyhow = fly_px4(stages, replace(PX4, yaw_acceptance_rad=math.pi))
    waited_s = float(motion.segments.end_s[-1] - anyhow.segments.end_s[-1])
    assert waited_s == pytest.approx(wait_s, abs=0.01)
    told = [one.code for one in motion.findings]
    assert told == (["T119"] if armed_deg is None else [])


@pytest.mark.parametrize(
    ("armed_deg", "is_waited_for"), [(90.0, False), (81.0, False), (0.0, True)]
)
def test_the_first_heading_asked_for_is_turned_to_from_that_at_arming(
    armed_deg: float, *, is_waited_for: bool
) -> None:
    # Straight up, then held there until it looks east, MIS_YAW_ERR 12°.
    asked = replace(go(0.0, 0.0), yaw_deg=90.0)
    known = fly_px4((takeoff(), asked), PX4, heading_rad=math.radians(armed_deg))
    free = fly_px4((takeoff(), go(0.0, 0.0)), PX4)
    waited_s = float(known.segments.end_s[-1] - free.segments.end_s[-1])
    assert waited_s == pytest.approx(3.147 if is_waited_for else 0.0, abs=0.01)


def test_many_returns_know_no_heading_of_each_other() -> None:
    places = np.array([[0.0, 300.0, 40.0], [0.0, 5.0, 40.0], [0.0, 5.0, 40.0]])
    motion = px4_returns(places, to_home(returns=len(places)), PX4)
    of_each = np.bincount(motion.segments.item, motion.segments.duration_s)
    assert of_each[1] == pytest.approx(of_each[2], abs=1e-9)
    at_home = px4_returns(np.array([[0.0, 0.0, 40.0]]), to_home(), PX4)
    assert [STATES[state] for state in at_home.segments.state] == ["hover", "land"]
    assert at_home.segments.duration_s[0] == pytest.approx(6.0 - math.sqrt(1.2))


def test_half_a_turn_takes_six_seconds() -> None:
    # At 20°/s² up to 60°/s: 3 s up, 3 s down; the last 12° of it, 1.1 s, need not be waited for.
    found = yaw_time_s(np.array([math.pi]), PX4)
    assert found == pytest.approx(6.0 - math.sqrt(2.0 * 12.0 / 20.0))


@pytest.mark.parametrize(
    ("change", "expected_s"),
    [
        ({"yaw_rate_rad_s": math.radians(30.0)}, 180.0 / 30.0 + 30.0 / 20.0 - math.sqrt(1.2)),
        ({"yaw_acceleration_rad_s2": math.radians(10.0)}, 2.0 * math.sqrt(18.0) - math.sqrt(2.4)),
        ({"yaw_acceptance_rad": math.radians(45.0)}, 6.0 - math.sqrt(4.5)),
        ({"yaw_acceptance_rad": math.radians(180.0)}, 0.0),
    ],
)
def test_each_parameter_of_yaw_moves_half_a_turn(
    change: dict[str, float], expected_s: float
) -> None:
    changed = replace(PX4, **change)
    assert yaw_time_s(np.array([math.pi]), changed) == pytest.approx(expected_s, abs=1e-9)


def test_a_heading_is_turned_to_on_the_way_and_waited_for_on_a_short_leg() -> None:
    def wait_s(length_m: float, parameters: Px4Parameters = PX4) -> float:
        free = go(0.0, 100.0 + length_m)
        asked = replace(free, yaw_deg=180.0)  # it flies north
        stages = (takeoff(), go(0.0, 100.0, hold=9.0))
        return float(
            took_s(*stages, asked, parameters=parameters)[2]
            - took_s(*stages, free, parameters=parameters)[2]
        )

    assert wait_s(200.0) == 0.0
    # The turn takes 6 s less the last 12°; what the leg does not take of them is waited for.
    turn_s = 6.0 - math.sqrt(1.2)
    assert wait_s(10.0) == pytest.approx(turn_s - leg_time_s(10.0, 5.0), abs=0.1)
    # With a timeout PX4 does not wait for headings at all.
    assert wait_s(10.0, replace(PX4, yaw_timeout_s=5.0)) == 0.0


def test_a_hold_and_a_heading_are_waited_for_together() -> None:
    stages = (takeoff(), go(0.0, 100.0, hold=9.0), go(0.0, 105.0, hold=8.0))
    turned = replace(stages[2], yaw_deg=180.0)
    assert took_s(*stages[:2], turned)[2] == pytest.approx(took_s(*stages)[2], abs=1e-6)


def test_turning_before_each_leg_costs_the_turn() -> None:
    stages = (takeoff(), go(0.0, 200.0, hold=9.0), go(200.0, 200.0, hold=1.0))
    usual, first = (took_s(*stages, parameters=replace(PX4, yaw_mode=mode)) for mode in (0, 4))
    # A right angle within 12°: 2 √(90/20) − √(24/20) = 3.15 s.
    assert first[2] - usual[2] == pytest.approx(3.15, abs=0.05)
    motion = fly_px4(stages, replace(PX4, yaw_mode=4))
    states = [STATES[state] for state in motion.segments.state]
    # The hold, the turn, and the leg after it.
    assert states[-6:] == ["hover", "hover", "accelerate", "cruise", "brake", "hover"]


def test_straight_on_there_is_nothing_to_turn_to() -> None:
    stages = (takeoff(), go(0.0, 200.0), go(0.0, 400.0, hold=1.0))
    usual, first = (took_s(*stages, parameters=replace(PX4, yaw_mode=mode)) for mode in (0, 4))
    assert first[2] == pytest.approx(usual[2], abs=0.01)


@pytest.mark.parametrize(
    ("mode", "turned_deg"),
    [
        (0, 90.0),  # along the leg north before, now to the east
        (1, 90.0),  # to home, south
        (2, 90.0),  # away from home, north
        (3, 90.0),
        (5, None),  # never turned since the take-off: any turn is as likely
    ],
)
def test_a_heading_asked_for_is_turned_to_from_where_the_mode_looks(
    mode: int, turned_deg: float | None
) -> None:
    # 10 m north at 200 m from home: a leg shorter than the turn to a heading of its own, east.
    stages = (takeoff(), go(0.0, 200.0, hold=20.0), go(0.0, 210.0))
    parameters = replace(PX4, yaw_mode=mode)
    asked = replace(stages[2], yaw_deg=90.0)
    free_s = took_s(*stages, parameters=parameters)[2]
    waits_s = took_s(*stages[:2], asked, parameters=parameters)[2] - free_s
    turns_deg = ANY_DEG if turned_deg is None else np.array([turned_deg])
    left_s = turn_s(turns_deg) - leg_time_s(10.0, 5.0)
    assert waits_s == pytest.approx(np.maximum(left_s, 0.0).mean(), abs=0.1)


@pytest.mark.parametrize(("mode", "turned_deg"), [(0, 0.0), (1, 180.0), (2, 0.0)])
def test_modes_about_home_look_there_wherever_the_leg_leads(mode: int, turned_deg: float) -> None:
    # Outward north with a heading north asked for at the end: only looking home it has to turn.
    stages = (takeoff(), go(0.0, 200.0, hold=20.0), go(0.0, 210.0))
    parameters = replace(PX4, yaw_mode=mode)
    asked = replace(stages[2], yaw_deg=0.0)
    waits_s = (
        took_s(*stages[:2], asked, parameters=parameters)[2]
        - took_s(*stages, parameters=parameters)[2]
    )
    needed_s = yaw_time_s(np.radians(np.array([turned_deg])), PX4)[0]
    assert waits_s == pytest.approx(max(needed_s - leg_time_s(10.0, 5.0), 0.0), abs=0.1)


@pytest.mark.parametrize(("heading_deg", "turned_deg"), [(0.0, 90.0), (270.0, 0.0), (None, 180.0)])
def test_a_return_that_turns_first_has_the_heading_of_home_before_it_lands(
    heading_deg: float | None, turned_deg: float
) -> None:
    # From the east the leg home leads west; it was armed looking north, or west, or nobody knows.
    stages = (takeoff(30.0), go(60.0, 0.0, 30.0, hold=20.0), stage(StageKind.RETURN, 0.0, 0.0, 0.0))
    heading_rad = None if heading_deg is None else math.radians(heading_deg)

    def return_s(mode: int) -> float:
        motion = fly_px4(stages, replace(PX4, yaw_mode=mode), heading_rad=heading_rad)
        said = [one for one in motion.findings if one.code == "T119"]
        # To leave, and to land.
        assert len(said) == 2 * (mode == 4 and heading_deg is None)
        return float(motion.segments.end_s[-1] - motion.segments.end_s[motion.done_segment[1]])

    # It turned east to fly out and turns round to fly home; a build stood 3.2 s over home for a right angle.
    needed_s = turn_s(np.array([180.0, turned_deg]))
    assert return_s(4) - return_s(0) == pytest.approx(needed_s.sum(), abs=0.1)


@pytest.mark.parametrize("heading_deg", [0.0, 60.0, 120.0, 180.0])
def test_what_any_heading_takes_lies_within_the_spread(heading_deg: float) -> None:
    stages = (
        *(takeoff(), go(0.0, 200.0), go(0.0, 0.0, hold=20.0)),
        stage(StageKind.RETURN, height_m=0.0),
    )
    anyhow = fly_px4(stages, PX4)
    known = fly_px4(stages, PX4, heading_rad=math.radians(heading_deg))
    assert known.wait_spread_s is None
    spread_s = anyhow.wait_spread_s
    assert spread_s is not None
    # Half a turn to that of home is the most there is; any turn takes 2.909 s in the mean.
    assert spread_s.mean() == pytest.approx(2.909 - (6.0 - math.sqrt(1.2)), abs=0.01)
    later_s = float(known.segments.end_s[-1] - anyhow.segments.end_s[-1])
    # The least and the greatest of twelve turns stand for those up to 15° and from 165° on.
    assert spread_s.min() - 0.01 <= later_s <= spread_s.max() + 0.15


def test_a_return_that_waits_where_it_is_counts_once_it_has_turned() -> None:
    # Flown by a build of PX4 with RTL_DESCEND_ALT 30 and RTL_RETURN_ALT 15: 89.0 s with a delay of 10 s, 84.7
    # where the turn is a part of it; sinking meanwhile, as by default, it turns on the way.
    stages = (
        takeoff(18.0),
        go(0.0, 60.0, 18.0),
        go(60.0, 60.0, 18.0),
        stage(StageKind.RETURN, 0.0, 0.0, 0.0),
    )
    standing = replace(PX4, return_altitude_m=15.0, return_descend_altitude_m=30.0)
    none_s, short_s, long_s = (
        float(
            fly_px4(
                stages, replace(standing, return_land_delay_s=s), heading_rad=0.0
            ).segments.end_s[-1]
        )
        for s in (0.0, 3.0, 10.0)
    )
    assert long_s - short_s == pytest.approx(7.0, abs=1e-6)
    assert short_s - none_s > 3.0 + 2.0  # it turns from 225° to north in more than two seconds


def test_turning_first_comes_before_the_descent_to_wait_too() -> None:
    # Flown on a build: 2.9 s more than without, a right angle before 30 m are left for 10 m.
    stages = (takeoff(30.0), go(60.0, 0.0, 30.0, hold=20.0), stage(StageKind.RETURN, 0.0, 0.0, 0.0))
    waiting = replace(PX4, return_land_delay_s=4.0)
    usual, first = (
        fly_px4(stages, replace(waiting, yaw_mode=mode), heading_rad=0.0).segments
        for mode in (0, 4)
    )
    needed_s = yaw_time_s(np.radians([90.0, 180.0, 90.0]), PX4)
    assert first.end_s[-1] - usual.end_s[-1] == pytest.approx(needed_s.sum(), abs=0.1)


@pytest.mark.parametrize(
    ("first_deg", "then_deg", "needed_s"),
    [
        # At 20°/s, 12° before the first heading: 168° back, 10° of overshoot and the second that takes.
        # A build took 9.8 and 10.0 s for it.
        (180.0, 0.0, 178.0 / 20.0 + 1.0 + 1.0 - math.sqrt(1.2)),
        # 132° on, as if begun 10° and a second before.
        (120.0, 240.0, 142.0 / 20.0 + 1.0 - 1.0 - math.sqrt(1.2)),
    ],
)
def test_a_heading_is_turned_to_from_the_turn_to_the_one_before(
    first_deg: float, then_deg: float, needed_s: float
) -> None:
    slow = replace(PX4, yaw_rate_rad_s=math.radians(20.0))
    stages = [takeoff(), go(0.0, 200.0, hold=20.0), go(0.0, 210.0), go(0.0, 220.0), go(0.0, 420.0)]
    for row, asked_deg in ((2, first_deg), (3, then_deg)):
        stages[row] = replace(stages[row], yaw_deg=asked_deg)
    assert took_s(*stages, parameters=slow)[3] == pytest.approx(needed_s, abs=0.1)


@pytest.mark.parametrize(
    ("radius_m", "tangent_m"),
    # By hand: 98.5 m on a course of 66.0°, so 72.3° before or after it.
    [(-30.0, (20.0, 57.6)), (30.0, (-3.3, 109.8))],
)
def test_a_change_of_height_is_left_by_the_tangent_where_that_is_asked_for(
    radius_m: float, tangent_m: tuple[float, float]
) -> None:
    change = replace(stage(StageKind.CHANGE_HEIGHT, 0.0, 80.0, 40.0), radius_m=radius_m)
    flights = [
        fly_px4(
            (takeoff(20.0), replace(change, leaves_on_tangent=leaves), go(90.0, 120.0, 40.0)), PX4
        )
        for leaves in (False, True)
    ]
    nearest, legs_s = [], []
    for motion in flights:
        begun_s, reached_s = motion.segments.end_s[motion.done_segment][1:]
        flown = motion.state_at_time(np.linspace(begun_s, reached_s, 400))
        off_m = np.hypot(flown.east_m - tangent_m[0], flown.north_m - tangent_m[1])
        nearest.append(off_m.min())
        legs_s.append(reached_s - begun_s)
    # Straight, it stays beyond a quarter of the circle away.
    assert nearest[1] < 1.0
    assert nearest[0] > 20.0
    if radius_m < 0.0:  # flown by a build of PX4
        assert legs_s[1] == pytest.approx(27.9, abs=0.4)
        assert legs_s[1] > legs_s[0] + 4.0


def test_a_vehicle_at_rest_leaves_a_change_of_height_straight() -> None:
    """Flown by a build of PX4: 16.6 s from (40, 60), where it is at rest after 20 m up, to the place asked.

    A radius of 10 m is left within 0.2 m/s.  By the tangent it takes 2.7 s more.
    """
    change = replace(stage(StageKind.CHANGE_HEIGHT, 40.0, 60.0, 40.0), radius_m=10.0)
    leaving = replace(change, leaves_on_tangent=True)
    took = took_s(takeoff(20.0), go(0.0, 60.0, 20.0), leaving, go(0.0, 0.0, 40.0))
    assert took[3] == pytest.approx(16.6, abs=0.4)


def test_a_tangent_is_flown_to_from_where_the_vehicle_is() -> None:
    """Within 82 m of the place already: 50.2 s from there to the next place, flown by a build of PX4.

    By hand, from 2 m before (0, 40) straight to its nearest point of the tangent at (40, 169), and along it
    until 2 m before the next place: 131 m and 106 m at 5 m/s, 47.6 s, and two turns.
    """
    change = replace(stage(StageKind.CHANGE_HEIGHT, 0.0, 100.0, 20.0), leaves_on_tangent=True)
    took = took_s(takeoff(20.0), go(0.0, 40.0, 20.0), change, go(160.0, 100.0, 20.0))
    assert took[3] == pytest.approx(50.2, abs=0.3)


@pytest.mark.parametrize(
    ("stages", "flown_s"),
    [
        # Flown by a build of PX4 (1.17, at rest in the air, noise 0): of a circle of 80 m passed 82 m before
        # its centre, and of a radius of its own of 30 m, it goes on to the place asked for again.
        ((_AFAR, stage(StageKind.LAND, 0.0, 100.0, 0.0)), 63.2),
        (
            (
                _AFAR,
                stage(StageKind.LOITER, 0.0, 100.0, 20.0, hold=10.0),
                stage(StageKind.LAND, 0.0, 100.0, 0.0),
            ),
            73.5,
        ),
    ],
)
def test_a_place_that_counted_as_reached_from_afar_is_flown_to(
    stages: tuple[Stage, ...], flown_s: float
) -> None:
    # Predicted from where it counted as reached: 17 s less.
    assert took_s(takeoff(20.0), *stages).sum() == pytest.approx(flown_s, abs=1.5)


def test_a_place_with_a_radius_of_its_own_is_flown_to_where_it_lands_there() -> None:
    """Flown by a build of PX4: 73.5 s from 30 m, 30 m before the place it counted as reached."""
    wide = replace(go(0.0, 100.0, height_m=30.0), acceptance_radius_m=30.0)
    took = took_s(takeoff(30.0), wide, stage(StageKind.LAND, 0.0, 100.0, 0.0))
    assert took.sum() == pytest.approx(73.5, abs=1.5)


def test_a_return_begins_where_the_vehicle_is_not_where_a_circle_would_be() -> None:
    """Flown by a build of PX4: 72.2 s; by a line from the centre of the circle, 40 m aside, 88.9 s."""
    aside = stage(StageKind.CHANGE_HEIGHT, 40.0, 60.0, 20.0)
    parameters = replace(PX4, return_altitude_m=20.0)
    stages = (
        takeoff(20.0),
        go(0.0, 60.0, height_m=20.0),
        aside,
        stage(StageKind.RETURN, 0.0, 0.0, 0.0),
    )
    assert took_s(*stages, parameters=parameters).sum() == pytest.approx(72.2, abs=1.5)


def wide(north_m: float, radius_m: float, hold_s: float) -> Stage:
    """Return a waypoint 20 m high with a radius of its own."""
    return replace(go(0.0, north_m, hold=hold_s, height_m=20.0), acceptance_radius_m=radius_m)


@pytest.mark.parametrize(
    ("stages", "flown_s"),
    [
        # Flown by a build of PX4: the hold of 0.5 s is over 27 m before the place, at 5 m/s.
        ((wide(60.0, 30.0, 0.5), stage(StageKind.LOITER, 0.0, 60.0, 20.0, hold=10.0)), 94.7),
        ((wide(60.0, 30.0, 0.5), stage(StageKind.LOITER, 0.0, 61.4, 20.0, hold=10.0)), 95.1),
        (
            (
                wide(80.0, 60.0, 0.5),
                replace(stage(StageKind.LOITER, 0.0, 80.0, 20.0, hold=10.0), speed_m_s=0.5),
                replace(go(0.0, 40.0, height_m=20.0), speed_m_s=5.0),
            ),
            193.4,
        ),
        # It turns back 27 m, 30 m and 16 m before the place.
        ((wide(60.0, 30.0, 0.5),), 73.7),
        ((wide(60.0, 30.0, 0.0),), 72.6),
        ((wide(60.0, 30.0, 3.0),), 78.8),
    ],
)
def test_a_hold_counts_from_the_radius_of_the_place(
    stages: tuple[Stage, ...], flown_s: float
) -> None:
    home = stage(StageKind.RETURN, 0.0, 0.0, 0.0)
    assert took_s(takeoff(20.0), *stages, home).sum() == pytest.approx(flown_s, rel=0.025)
