"""PX4's LOITER_TO_ALT passed by its radius, far from its centre: the line to the next place begins there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from ardupilot_missions import land, stage
from made_returns import to_home
from px4_flights import fly_px4, px4_returns

from planner.findings import Severity
from planner.mission.route.stage import ReturnPath, Stage, StageKind
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

PX4 = Px4Parameters()
Place = tuple[float, float, float]


def takeoff(east_m: float, north_m: float) -> Stage:
    return stage(StageKind.TAKEOFF, east_m, north_m, 20.0)


def circle(place_m: Place, radius_m: float = 60.0) -> Stage:
    return replace(stage(StageKind.CHANGE_HEIGHT, *place_m, radius=radius_m), yaw_deg=0.0)


def onward(place_m: Place) -> tuple[Stage, ...]:
    return stage(StageKind.GO, *place_m), land(*place_m[:2])


# Flown by a build of PX4 (1.17, noise 0), armed looking north: disarmed after, and farthest east or north.
FLOWN = [
    # Accelerating towards the centre it turns to the line behind that, across it and back.
    ((0, 0), [(30, -12, 20.6)], (60, -41, 22), 63.3, (1, 5.7)),
    ((0, 0), [(30, -12, 20.6)], (60, -41, 35), 70.8, (1, 1.2)),
    # The line to a lower place is higher behind the centre: it climbs onto that.
    ((0, 0), [(30, -12, 20.6)], (60, -41, 12), 56.7, (2, 26.1)),
    ((0, 0), [(50, 0, 20.6)], (0, 60, 25), 66.2, (0, 33.7)),
    # As high already, it flies on for its heading; the place beyond is at another height.
    ((-20, 20), [(30, -12, 20.6)], (60, -41, 22), 72.5, (1, 20.0)),
    ((-20, 20), [(30, -12, 20.6)], (60, -41, 30), 77.8, (1, 20.0)),
    ((-20, 20), [(30, -12, 22)], (-60, -41, 22), 80.5, (1, 20.0)),
    # Two in a row: of the second it flies away from the first as soon as it has its height.
    ((0, 0), [(7.2, 42.6, 20), (-62, 14.5, 19.6)], (-13.9, 56.9, 19.6), 56.2, (1, 56.9)),
]


@pytest.mark.parametrize(("start_m", "circles", "next_m", "flown_s", "farthest"), FLOWN)
def test_a_circle_passed_from_afar_leads_to_the_line_behind_its_centre(
    start_m: tuple[float, float],
    circles: list[Place],
    next_m: Place,
    flown_s: float,
    farthest: tuple[int, float],
) -> None:
    stages = (takeoff(*start_m), *(circle(one) for one in circles), *onward(next_m))
    parameters = PX4
    if len(circles) > 1:
        parameters = replace(PX4, climb_speed_m_s=1.6)
    motion = fly_px4(stages, parameters, heading_rad=0.0)
    assert motion.segments.end_s[-1] == pytest.approx(flown_s, rel=0.02)
    assert not motion.findings
    state = motion.state_at_time(np.linspace(0.0, float(motion.segments.end_s[-1]), 2000))
    axis, most_m = farthest
    along = (state.east_m, state.north_m, state.height_m)[axis]
    assert along.max() == pytest.approx(most_m, abs=2.0)


@pytest.mark.parametrize(
    ("circle_m", "next_m", "flown_s", "open_s"),
    [
        # Flown: a tenth of a second towards the centre was enough to steer for the line behind it.
        ((50.0, 0.0, 20.6), (40.0, 60.0, 25.0), 76.4, 0.0),
        # Flown straight; with 0.04 s more it would not have been.
        ((50.0, 0.0, 20.6), (0.0, 60.0, 25.0), 67.8, 5.7),
        ((50.0, 0.0, 20.6), (-40.0, 60.0, 20.6), 67.3, 5.2),
    ],
)
def test_a_circle_reached_at_once_is_flown_to_until_the_navigator_goes_on(
    circle_m: Place, next_m: Place, flown_s: float, open_s: float
) -> None:
    waits = stage(StageKind.GO, height_m=20.0, hold=9.0)
    stages = (takeoff(0, 0), waits, circle(circle_m), *onward(next_m))
    motion = fly_px4(stages, PX4, heading_rad=0.0)
    assert motion.segments.end_s[-1] == pytest.approx(flown_s + open_s, abs=0.8)
    assert [(one.code, one.severity) for one in motion.findings] == [("T125", Severity.WARNING)]


def test_a_circle_left_at_8_m_s_is_a_matter_of_chance() -> None:
    # Flown from the waypoint 100 m north: 105 s, 16 m beside what 3 % less or more of the speed leads to.
    fast = replace(stage(StageKind.GO, 0.0, 100.0, 20.0), speed_m_s=8.0)
    after = [
        replace(one, speed_m_s=8.0) for one in (circle((30, 20, 20), 40.0), *onward((90, 20, 24)))
    ]
    motion = fly_px4((takeoff(0, 0), fast, *after), PX4, heading_rad=0.0)
    assert [one.code for one in motion.findings] == ["T125"]


@pytest.mark.parametrize(
    ("speed_m_s", "mode", "flown_s", "west_m", "codes"),
    [
        # Flown: from rest to the line behind the loiter, and across it to and fro.
        (8.0, 4, 67.7, -14.2, ["T125"]),
        (5.0, 4, 75.5, -12.9, []),
    ],
)
def test_a_circle_left_at_rest_once_it_looks_ahead_leads_to_its_line_too(
    speed_m_s: float, mode: int, flown_s: float, west_m: float, codes: list[str]
) -> None:
    parameters = replace(
        PX4,
        yaw_mode=mode,
        cruise_speed_m_s=speed_m_s,
        acceptance_radius_m=2.0,
        loiter_radius_m=80.0,
    )
    stages = (
        takeoff(0, 0),
        stage(StageKind.GO, -7.0, 90.0, 20.0),
        circle((-6.0, 68.0, 20.0), 80.0),
        stage(StageKind.GO, 111.0, 18.0, 20.0, hold=0.5),
    )
    motion = fly_px4(stages, parameters, heading_rad=0.0)
    assert [one.code for one in motion.findings] == codes
    lasts_s = float(motion.segments.end_s[-1])
    assert lasts_s == pytest.approx(flown_s, abs=1.0)
    east_m = motion.state_at_time(np.linspace(0.0, lasts_s, 2000)).east_m
    assert east_m.min() == pytest.approx(west_m, abs=0.5)


SLOW_YAW = math.radians(20.0)


@pytest.mark.parametrize(
    ("places", "change", "flown_s", "passed_m", "codes"),
    [
        # Flown by a build of PX4 that turns first, armed looking north: from the waypoint before it looks
        # south, and stands until it looks north; then it turns to the place behind, and flies by the line.
        ([(0, -60), (45, -40), (60, 40)], {}, 138.0, (43.3, -62.8), []),
        (
            [(0, -60), (45, -40), (60, 40)],
            {"cruise_speed_m_s": 8.0},
            167.6,
            (49.4, -62.4),
            ["T125"],
        ),
        (
            [(0, -60), (45, -40), (60, 40)],
            {"cruise_speed_m_s": 8.0, "yaw_rate_rad_s": SLOW_YAW},
            186.9,
            (49.4, -62.6),
            ["T125"],
        ),
        ([(80, 20), (60, 60), (0, 120, 35)], {"cruise_speed_m_s": 8.0}, 121.0, (75.2, 24.1), []),
        (
            [(70, 0), (40, -30), (10, -90)],
            {"cruise_speed_m_s": 6.0, "yaw_rate_rad_s": 1.5 * SLOW_YAW},
            129.6,
            (52.3, -9.6),
            [],
        ),
        # It looks north already; not along the line to the place behind, but from where it stands to that.
        ([(0, 60), (30, 62), (30, 80), (30, 80, 32)], {}, 111.4, (14.7, 69.4), []),
        (
            [(0, 60), (30, 62), (30, 80), (30, 80, 32)],
            {"yaw_rate_rad_s": SLOW_YAW},
            118.4,
            (14.7, 69.4),
            [],
        ),
        # Two metres higher: it flies on looking north, and only brakes while it turns to the place behind.
        (
            [(0, -60), (45, -40, 22), (60, 40, 22)],
            {"cruise_speed_m_s": 8.0},
            158.6,
            (36.9, -43.6),
            ["T125"],
        ),
    ],
)
def test_a_circle_is_left_from_where_a_vehicle_that_turns_first_stands(
    places: list[tuple[float, ...]],
    change: dict[str, float],
    flown_s: float,
    passed_m: tuple[float, float],
    codes: list[str],
) -> None:
    parameters = replace(PX4, **{"yaw_mode": 4, "cruise_speed_m_s": 5.0, **change})
    before, around, *behind = ((one[0], one[1], (*one, 20.0)[2]) for one in places)
    stages = (
        *(takeoff(0, 0), stage(StageKind.GO, *before), circle(around, 80.0)),
        *(stage(StageKind.GO, *one) for one in behind),
        stage(StageKind.RETURN, 0.0, 0.0, 0.0),
    )
    motion = fly_px4(stages, parameters, heading_rad=0.0)
    assert [one.code for one in motion.findings] == codes
    lasts_s = float(motion.segments.end_s[-1])
    assert lasts_s == pytest.approx(flown_s, rel=0.03)
    state = motion.state_at_time(np.linspace(0.0, lasts_s, 4000))
    off_m = np.hypot(state.east_m - passed_m[0], state.north_m - passed_m[1])
    assert off_m.min() < (2.5 if codes else 1.0)


def test_a_return_along_a_wide_circle_is_flown_as_the_mission_is() -> None:
    # In steps five times as long, from standing where the mission waits before it.
    wide = replace(circle((50.0, 0.0, 20.6)), yaw_deg=None)
    legs = (wide, *onward((40.0, 60.0, 25.0)))
    waits = stage(StageKind.GO, height_m=20.0, hold=9.0)
    flown = fly_px4((takeoff(0, 0), waits, *legs), PX4, heading_rad=0.0)
    targets = replace(to_home(), paths=(ReturnPath(stages=legs),))
    returned = px4_returns(np.array([[0.0, 0.0, 20.0]]), targets, PX4, heading_rad=0.0)
    begun_s = float(flown.segments.end_s[flown.done_segment[1]])
    time_s = np.linspace(0.0, 20.0, 50)
    place, same = flown.state_at_time(begun_s + time_s), returned.state_at_time(time_s)
    assert place.east_m.max() > 20.0
    assert same.east_m == pytest.approx(place.east_m, abs=1.5)
    assert same.north_m == pytest.approx(place.north_m, abs=1.5)


def delay(hold_s: float) -> Stage:
    return stage(StageKind.DELAY, hold=hold_s)


def go(*place_m: float, hold: float = 0.0) -> Stage:
    return stage(StageKind.GO, *(*place_m, 20.0)[:3], hold=hold)


_BACK = stage(StageKind.RETURN, 0.0, 0.0, 0.0)
_AROUND = circle((41.0, 2.0, 20.0), 25.0)
_NEAR_BY, _FAR_ON = circle((70.0, -5.0, 20.0), 30.0), circle((-40.0, -30.0, 20.0), 40.0)
# Flown by a build of PX4 (1.17), armed looking north: disarmed after, and where it passed.
FROM_WHERE_IT_IS = [
    # Twice more round a jump: it still stands where it did, beside the line to the next place.
    (
        [go(26, 20), _AROUND, _AROUND, delay(0.1), go(78, 0), go(98, 42), _BACK],
        {"yaw_mode": 4},
        135.1,
        (25.2, 6.5),
        [],
    ),
    (
        [go(40, -30), _NEAR_BY, _NEAR_BY, delay(0.15), go(60, 40), go(0, 20), _BACK],
        {"yaw_mode": 4, "cruise_speed_m_s": 8.0},
        142.0,
        (81.0, -5.0),
        ["T125"],
    ),
    # The waypoint is near the circle's centre, but the vehicle is not.
    (
        [
            go(60, 0, hold=2.0),
            go(0, 0, hold=2.0),
            circle((0, 60, 20), 80.0),
            go(0, 66),
            land(-30, 0),
        ],
        {"acceptance_radius_m": 10.0},
        96.2,
        (-1.0, 61.5),
        [],
    ),
    # It flies on to the place of the LOITER_TO_ALT in a delay, and a return begins where it is then.
    (
        [go(-40, 20), circle((-60, 70, 12), 80.0), delay(10.0), go(10, 60, 12), land(40, 30)],
        {"cruise_speed_m_s": 7.0},
        85.8,
        (-54.0, 69.0),
        [],
    ),
    (
        [go(30, 50), circle((60, 80, 20), 60.0), delay(5.0), _BACK],
        {"yaw_mode": 4},
        104.0,
        (49.0, 69.0),
        [],
    ),
    # A circle of 52 m is within reach of where the waypoint 53 m away counts as reached.
    (
        [
            *(go(0, -37), circle((28, -79, 15), 30.0), delay(3.0), go(-32, -75, 15)),
            *(circle((21, -77, 15), 50.0), _BACK),
        ],
        {"yaw_mode": 4, "cruise_speed_m_s": 8.0},
        120.6,
        (24.0, -78.0),
        [],
    ),
    # A waypoint that is reached at once is not looked to: it does not turn back from there.
    (
        [
            *(go(-8, -36), go(-8, -97, hold=2.0), circle((36, -97, 20), 80.0)),
            *(go(-8, -97, hold=2.0), circle((36, -97, 20), 80.0), go(5, -58, hold=2.0), _BACK),
        ],
        {"yaw_mode": 4, "cruise_speed_m_s": 6.0},
        None,
        (20.9, -69.9),
        [],
    ),
    (
        [
            *(go(-45, 0), _FAR_ON, go(-75, -50), _FAR_ON, go(-75, -50)),
            *(circle((-40, -80, 20), 80.0), delay(4.0), circle((0, -60, 26), 80.0)),
            *(go(20, -30, 26), land(30, 0)),
        ],
        {"yaw_mode": 4, "cruise_speed_m_s": 6.0, "acceptance_radius_m": 3.0},
        119.3,
        (-40.0, -86.0),
        [],
    ),
]


@pytest.mark.parametrize(("stages", "change", "flown_s", "passed_m", "codes"), FROM_WHERE_IT_IS)
def test_all_behind_a_wide_circle_begins_where_the_vehicle_is(
    stages: list[Stage],
    change: dict[str, float],
    flown_s: float | None,
    passed_m: tuple[float, float],
    codes: list[str],
) -> None:
    parameters = replace(PX4, **{"cruise_speed_m_s": 5.0, **change})
    speed_m_s = parameters.cruise_speed_m_s
    stages = [replace(one, speed_m_s=speed_m_s) for one in stages]
    motion = fly_px4((takeoff(0, 0), *stages), parameters, heading_rad=0.0)
    assert [one.code for one in motion.findings] == codes
    lasts_s = float(motion.segments.end_s[-1])
    assert flown_s is None or lasts_s == pytest.approx(flown_s, rel=0.035)
    state = motion.state_at_time(np.linspace(0.0, lasts_s, 4000))
    off_m = np.hypot(state.east_m - passed_m[0], state.north_m - passed_m[1])
    assert off_m.min() < 2.0


def _faster(one: Stage, speed_m_s: float) -> Stage:
    return replace(one, speed_m_s=speed_m_s)


def by_tangent(place_m: Place, radius_m: float) -> Stage:
    return replace(circle(place_m, radius_m), leaves_on_tangent=True)


# Flown by a build of PX4 (1.17), armed looking north or south: disarmed after, and where it passed.
LEFT_BY_TANGENT = [
    # It turns half round first, and flies on to the centre meanwhile.
    (math.pi, [by_tangent((0, 58, 20), 80.0), go(0, -60)], 102.0, (23.1, 4.0)),
    (0.0, [go(0, 60), go(0, 3), by_tangent((0, 60, 20), 80.0), go(0, -60)], 132.0, (20.1, 10.1)),
    (0.0, [go(0, 60), go(0, 3), by_tangent((0, 60, 20), 80.0), go(-60, -60)], 141.0, (13.3, 2.8)),
    # It turns into the line without slowing down.
    (0.0, [go(0, -100), by_tangent((0, 60, 20), 80.0), go(60, -60)], 138.0, (65.6, -27.0)),
    (0.0, [go(0, -100), by_tangent((0, 0, 20), 20.0), go(60, -60)], 140.4, (27.2, -1.7)),
    (0.0, [go(0, -120), by_tangent((0, 10, 20), 40.0), go(90, 10)], 152.0, (38.6, 39.2)),
    # What is commanded behind it counts once it has turned.
    (
        0.0,
        [go(0, 100), by_tangent((100, 100, 20), 50.0), _faster(go(180, 0), 8.0)],
        168.0,
        (149, 110),
    ),
    (
        0.0,
        [go(0, 150), by_tangent((150, 150, 20), 50.0), _faster(go(150, -50), 12.0)],
        184.0,
        (187, 94),
    ),
    # Another behind it is flown to from the tangent, and a return begins where that counts as reached.
    (
        0.0,
        [go(0, 100), by_tangent((100, 100, 20), 50.0), by_tangent((100, -20, 20), 50.0)],
        145.0,
        (86, 18),
    ),
    (0.0, [go(0, 100), by_tangent((100, 100, 20), 50.0)], 115.0, (41, 84)),
    # Within its reach already it flies none of the line; else straight at it, or square to the line first.
    (0.0, [go(0, 150), by_tangent((0, 50, 20), -50.0), circle((50, 0, 20), 120.0)], 123.0, (0, 95)),
    (
        0.0,
        [go(0, 100), by_tangent((100, 100, 20), 50.0), circle((100, 0, 20), 120.0)],
        115.0,
        (48, 96),
    ),
    (
        0.0,
        [go(0, 100), by_tangent((100, 100, 20), 50.0), circle((180, 100, 20), 80.0)],
        131.0,
        (104, 100),
    ),
    (
        0.0,
        [go(0, 120), by_tangent((0, 60, 20), -50.0), circle((60, 0, 20), 80.0)],
        112.0,
        (-11.4, 36.2),
    ),
    # It climbs, or descends, and turns at the speed it has by then.
    (0.0, [go(0, 100), by_tangent((150, 100, 30), 80.0), go(200, 0, 30)], 189.0, (218, 74)),
    (0.0, [go(0, 100), by_tangent((100, 100, 30), 30.0), go(40, 180, 30)], 178.0, (77, 92)),
    (0.0, [go(0, 150), by_tangent((200, 190, 23), -50.0), go(230, 110, 23)], 208.0, (171, 152)),
    # Looking there already it is past the circle at once.
    (0.0, [by_tangent((0, 58, 20), 80.0), go(0, -60)], 83.0, (-0.2, -51.6)),
]


@pytest.mark.parametrize(("heading_rad", "stages", "flown_s", "passed_m"), LEFT_BY_TANGENT)
def test_a_circle_is_left_by_a_line_from_its_tangent_from_where_the_vehicle_is(
    heading_rad: float, stages: list[Stage], flown_s: float, passed_m: tuple[float, float]
) -> None:
    motion = fly_px4((takeoff(0, 0), *stages, _BACK), PX4, heading_rad=heading_rad)
    lasts_s = float(motion.segments.end_s[-1])
    assert lasts_s == pytest.approx(flown_s, rel=0.03)
    state = motion.state_at_time(np.linspace(0.0, lasts_s, 4000))
    assert np.hypot(state.east_m - passed_m[0], state.north_m - passed_m[1]).min() < 2.0


# As above: whether it came back, or flew on by 1.5 to 2.5 km until it was cut off.
LED_PAST = [
    ((0, 10), by_tangent((0, 100, 20), 50.0), (50, 77), 5.0, True),
    ((0, 10), by_tangent((0, 100, 20), -50.0), (50, 77), 5.0, False),
    ((0, 10), by_tangent((0, 100, 20), -50.0), (52, 60), 5.0, False),
    # No tangent leads to what is within the circle.
    ((0, 10), by_tangent((0, 100, 20), 50.0), (30, 77), 5.0, True),
    ((0, 10), by_tangent((0, 100, 20), -50.0), (40, 120), 5.0, True),
    ((-26.6, -4.3), by_tangent((58.4, -43.5, 20), 0.0), (-5.9, -28.6), 5.0, False),
    ((-26.6, -4.3), by_tangent((58.4, -43.5, 20), 0.0), (-5.9, -28.6), 6.0, False),
    ((-26.6, -4.3), by_tangent((58.4, -43.5, 20), 0.0), (-5.9, -28.6), 8.0, True),
]


@pytest.mark.parametrize(("first_m", "loiter", "next_m", "speed_m_s", "is_told"), LED_PAST)
def test_a_line_that_leads_away_from_its_place_far_beside_it_is_told_of(
    first_m: tuple[float, float],
    loiter: Stage,
    next_m: tuple[float, float],
    speed_m_s: float,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    parameters = replace(PX4, cruise_speed_m_s=speed_m_s)
    stages = (takeoff(0, 0), go(*first_m), loiter, go(*next_m), _BACK)
    motion = fly_px4(stages, parameters, heading_rad=0.0)
    told = [(one.code, one.severity) for one in motion.findings if "for ever" in one.message]
    assert told == [("T125", Severity.ERROR)] * is_told


def test_a_short_leg_behind_a_wide_radius_is_no_tangent() -> None:
    # As above: 5 m back from where a radius of 10 m is entered at 5 m/s, disarmed after 119.0 s.
    wide = replace(go(-3, -150), acceptance_radius_m=10.0)
    motion = fly_px4((takeoff(0, 0), wide, go(-1, -146), _BACK), PX4, heading_rad=0.0)
    assert not motion.findings
    assert motion.segments.end_s[-1] == pytest.approx(119.0, rel=0.03)


# As above: disarmed after.  Reached 2 or 3 m from home, it is beyond RTL_MIN_DIST once it has turned.
RETURNED = [
    (math.pi, [circle((0, 58, 20), 80.0)], 30.0, 67.0),
    (math.pi, [circle((0, 58, 20), 80.0)], 60.0, 97.0),
    (0.0, [go(0, 60), go(0, 3), circle((0, 60, 20), 80.0)], 60.0, 125.0),
    (0.0, [go(0, 60), go(0, 3), circle((0, 60, 20), 80.0)], 30.0, 96.1),
    # Flown into from outside it looks at the centre already, and turns nowhere.
    (0.0, [go(0, 30), circle((0, 100, 20), 50.0)], 30.0, 80.0),
    # A wait is over where it has flown on for as long.
    (0.0, [go(0, 60), go(0, 3), circle((0, 60, 20), 80.0), delay(5.0)], 60.0, 136.0),
]


@pytest.mark.parametrize(("heading_rad", "stages", "return_m", "flown_s"), RETURNED)
def test_a_return_from_a_circle_climbs_from_where_the_vehicle_is_once_it_has_turned(
    heading_rad: float, stages: list[Stage], return_m: float, flown_s: float
) -> None:
    parameters = replace(PX4, return_altitude_m=return_m)
    motion = fly_px4((takeoff(0, 0), *stages, _BACK), parameters, heading_rad=heading_rad)
    assert motion.segments.end_s[-1] == pytest.approx(flown_s, rel=0.03)
    state = motion.state_at_time(np.linspace(0.0, motion.segments.end_s[-1], 4000))
    assert state.height_m.max() == pytest.approx(return_m, abs=0.1)


def test_two_ways_far_apart_are_told_of() -> None:
    # Flown straight, 14 m from the way by the line, which is 3.4 s longer.
    parameters = replace(PX4, yaw_mode=4, cruise_speed_m_s=3.0, acceptance_radius_m=10.0)
    stages = (go(43, 0), circle((43, 13, 20), 50.0), go(72, 31), circle((72, 50, 20), 30.0))
    behind = (circle((38, 91, 20), 30.0), go(38, 95), _BACK)
    motion = fly_px4((takeoff(0, 0), *stages, *behind), parameters, heading_rad=0.0)
    told = [one for one in motion.findings if one.severity is Severity.ERROR]
    assert [one.code for one in told] == ["T125"]
    assert "may fly straight" in told[0].message
