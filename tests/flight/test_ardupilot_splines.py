"""ArduPilot's splines: lines where they do not bend, joined by legs at speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import DEFAULTS, fly, go, home, land, stage, takeoff, time_s, took_s
from ardupilot_times import leg_s
from made_missions import item, mission, north, rtl
from made_missions import takeoff as takeoff_to

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.mission.route.route import make_route
from planner.mission.route.stage import StageKind
from planner.values import replace
from planner.vehicle.parameters.ardupilot import ArduPilotParameters

if TYPE_CHECKING:
    from planner.mission.route.stage import Stage


def test_a_spline_through_points_on_a_line_is_a_leg_with_half_the_acceleration() -> None:
    points = [stage(StageKind.SPLINE, 200.0 * k) for k in (1, 2, 3)]
    motion = fly(takeoff(), *points)
    # From rest to rest over 600 m at 10 m/s with 1.25 m/s².
    assert time_s(motion) - time_s(fly(takeoff())) == pytest.approx(60.0 + 10.0 / 1.25, rel=0.03)
    assert motion.segments.distance_m.sum() == pytest.approx(600.0, rel=1e-3)


def test_splines_keep_their_speed_where_they_hardly_bend() -> None:
    points = [stage(StageKind.SPLINE, 200.0 * k, 10.0 * (k % 2)) for k in range(1, 6)]
    motion = fly(takeoff(), *points)
    piece = np.arange(len(motion.piece_duration_s))
    begins = motion.piece_start_s
    speed = motion.state_at(piece, 0.5 * motion.piece_duration_s).ground_speed_m_s
    first, last = (motion.segments.end_s[motion.arrival_segment[k]] for k in (1, 4))
    assert speed[(begins > first) & (begins < last)].min() > 9.0


def test_a_spline_that_continues_a_faster_one_is_flown_faster_than_commanded() -> None:
    # From 9 to 3 m/s by half of 2.5 m/s² takes (81 − 9)/2.5 = 28.8 m: a short one is never at 3 m/s.
    def found(length_m: float, *speeds: float) -> list[str]:
        splines = [
            replace(stage(StageKind.SPLINE, 100.0 + length_m * k), speed_m_s=speed)
            for k, speed in enumerate(speeds)
        ]
        findings = fly(takeoff(), *splines, go(100.0 + 4.0 * length_m)).findings
        return [finding.message for finding in findings if finding.code == "E126"]

    (message,) = found(60.0, 9.0, 3.0)
    assert "9.0 m/s where 3.0 m/s is commanded" in message
    assert "to the end" not in message
    (message,) = found(20.0, 9.0, 3.0)
    assert ": 1 leg from item " in message
    assert ", to the end, up to " in message
    assert not found(60.0, 9.0, 9.0)
    assert not found(60.0, 3.0, 9.0)


def test_a_leg_before_a_slower_spline_ends_at_the_speed_it_was_planned_for() -> None:
    legs = (stage(StageKind.GO, 100.0, speed=9.0), stage(StageKind.SPLINE, 300.0, speed=3.0))
    motion = fly(takeoff(), *legs, go(400.0))
    # From rest to 9 m/s in 9/2.5 + 2.5 + 0.3 s, which costs half of it, and the start.
    assert took_s(motion, 1) == pytest.approx(100.0 / 9.0 + 3.2 + 0.3, abs=0.1)


@pytest.mark.parametrize(("from_m", "severity"), [(195.0, Severity.ERROR), (150.0, None)])
def test_a_speed_lowered_just_before_a_spline_carries_the_target_beyond_its_place(
    from_m: float, severity: Severity | None
) -> None:
    # Within 5 m 2 m/s speed up to 2.78 m/s, in 2.1 s: so much is taken off 8 m/s, on a way of 15.9 m.
    part = replace(stage(StageKind.GO, from_m, speed=8.0), is_underway=True)
    splines = [stage(StageKind.SPLINE, east, speed=2.0) for east in (260.0, 320.0)]
    motion = fly(takeoff(), part, stage(StageKind.GO, 200.0, speed=2.0), *splines)
    found = [one for one in motion.findings if one.code == "T102"]
    assert [one.severity for one in found] == [severity] * (severity is not None)
    assert all("its target by 11 m" in one.message for one in found)


def test_straight_legs_join_splines_at_speed() -> None:
    motion = fly(takeoff(), go(300.0), stage(StageKind.SPLINE, 600.0), go(900.0, hold=1.0))
    stopped = 3 * leg_s(300.0)
    assert motion.segments.duration_s[1:].sum() < stopped - 2 * 5.0


def stepped_s(*points: tuple[float, float], step_s: float = 0.01) -> float:
    """Time over splines from rest to rest, stepped as ``SplineCurve::advance_target_along_track``."""
    places = [np.array(point) for point in ((0.0, 0.0), *points)]
    legs, leaving = [], np.zeros(2)
    for k in range(1, len(places)):
        start, end = places[k - 1], places[k]
        after = places[k + 1] if k + 1 < len(places) else None
        arriving = np.zeros(2) if after is None else after - start
        scale = min(
            1.0,
            4.0
            * float(np.linalg.norm(end - start))
            / float(np.linalg.norm(leaving) + np.linalg.norm(arriving)),
        )
        a, b = leaving * scale, arriving * scale
        legs.append((start, a, 3 * (end - start) - 2 * a - b, 2 * (start - end) + a + b, end))
        leaving = arriving

    def bend(leg: tuple[np.ndarray, ...], u: float) -> tuple[np.ndarray, np.ndarray, float]:
        c0, c1, c2, c3, _ = leg
        slope, curve = c1 + u * (2 * c2 + 3 * u * c3), 2 * c2 + 6 * u * c3
        size = float(np.linalg.norm(slope))
        if size < 1e-9:
            return c0 + u * (c1 + u * (c2 + u * c3)), slope, 10.0
        across = curve - slope * float(curve @ slope) / size**2
        most = size * np.sqrt(1.25 / max(float(np.linalg.norm(across)), 1e-12))
        return c0 + u * (c1 + u * (c2 + u * c3)), slope, min(10.0, float(most))

    ends: list[float] = [0.0]  # speeds that the ends are braked to, from the last
    for leg, before in zip(legs[::-1], legs[-2::-1], strict=False):
        chord = float(np.linalg.norm(leg[4] - leg[0]))
        most = float(np.sqrt(ends[0] ** 2 + 2 * 1.25 * chord))
        ends.insert(0, min(bend(before, 1.0)[2], bend(leg, 0.0)[2], most))
    time = speed = 0.0
    for leg, destination in zip(legs, ends, strict=True):
        last = leg is legs[-1]
        u = 0.0
        while u < 1.0:
            place, slope, limit = bend(leg, u)
            away = float(np.linalg.norm(leg[4] - place))
            limit = min(limit, float(np.sqrt(destination**2 + 2 * 1.25 * away)))
            size = float(np.linalg.norm(slope))
            way = speed * step_s
            u += way / size if size > 1e-6 else np.sqrt(way / float(np.linalg.norm(leg[2])))
            speed = min(max(limit, speed - 1.25 * step_s), speed + 1.25 * step_s)
            time += step_s
            if last and away < 0.05:
                break
    return time


@pytest.mark.parametrize(
    "points",
    [
        ((80.0, 0.0), (100.0, 40.0), (160.0, 60.0)),
        ((60.0, 0.0), (60.0, 20.0), (0.0, 20.0), (0.0, 60.0)),  # bends that are come to too fast
        ((100.0, 0.0), (110.0, 3.0), (100.0, 20.0), (20.0, 20.0)),
    ],
)
def test_bends_are_not_braked_for(points: tuple[tuple[float, float], ...]) -> None:
    # With next to no jerk the time along the track is next to never slowed: the target alone.
    motion = fly(
        takeoff(),
        *(stage(StageKind.SPLINE, *point) for point in points),
        parameters=ArduPilotParameters(jerk_m_s3=1e-6),
    )
    flown = time_s(motion) - time_s(fly(takeoff()))
    # 24 pieces a spline against steps of a hundredth of a second, which are long in a cusp.
    assert flown == pytest.approx(stepped_s(*points), rel=0.02)


def spline(
    north_m: float, east_m: float, *, speed: float | None = None, hold: float = 0.0
) -> Stage:
    return stage(StageKind.SPLINE, east_m, north_m, 20.0, speed=speed, hold=hold)


def test_splines_take_the_time_recorded() -> None:
    # ArduCopter 4.7.0-dev in SITL, lean limit at 10.24 m/s: arrivals since the take-off was over.
    places = ((60.0, 30.0), (100.0, -20.0), (140.0, 30.0), (180.0, -20.0), (120.0, -80.0))
    splines = [spline(*place, speed=12.0) for place in places]
    stages = (takeoff(20.0), *splines, spline(0.0, -60.0, speed=12.0), land(0.0, 0.0))
    motion = fly_ardupilot(stages, DEFAULTS, airspeed_limit_m_s=10.24)
    since = motion.segments.end_s[motion.arrival_segment] - motion.segments.end_s[0]
    recorded = np.array([27.65, 38.23, 49.37, 60.31, 71.59, 86.66, 128.73]) - 14.36
    assert since[1:] == pytest.approx(recorded, rel=0.02)


def test_a_spline_is_flown_through_towards_a_landing_elsewhere() -> None:
    # ``get_spline_from_cmd`` asks for the place of the next command, whichever it is; a waypoint stops.
    for first, passes in ((StageKind.SPLINE, True), (StageKind.GO, False)):
        motion = fly(takeoff(20.0), stage(first, 0.0, 100.0, 20.0), land(0.0, 200.0))
        reached_s = float(motion.segments.end_s[motion.arrival_segment[1]])
        speed = motion.state_at_time(np.array([reached_s])).ground_speed_m_s[0]
        assert bool(speed > 5.0) is passes


def test_a_leg_behind_a_spline_speeds_up_within_half_its_length() -> None:
    # ``set_origin_speed_max``: of 80 m in line with the spline, which is left at 5 m/s; up to V with
    # (5 + V)/2 ((V − 5)/2.5 + 1/0.4 + 0.3) = 40.
    first = replace(spline(0.0, 100.0), speed_m_s=5.0)
    motion = fly(takeoff(20.0), first, go(180.0, 0.0, 20.0, hold=1.0), home())
    peak = max(np.roots([0.2, 1.4, 5.0 * 1.4 - 5.0 - 40.0]).real)
    speeds = motion.segments.speed_m_s[motion.done_segment[1] + 1 : motion.done_segment[2] + 1]
    assert speeds.max() == pytest.approx(min(peak, 10.0), abs=0.02)


@pytest.mark.parametrize("kind", [StageKind.CHANGE_HEIGHT, StageKind.CIRCLE])
def test_a_spline_dives_before_it_is_led_straight_up(kind: StageKind) -> None:
    # Flown by ArduCopter 4.7.0-dev: 60 m at 25 m, before LOITER_TO_ALT or LOITER_TURNS there at 60 m: down to
    # 19.8 m, as a cubic from rest with a tangent of 35 m: 4/27 of that.
    above = replace(stage(kind, 0.0, 60.0, 60.0), radius_m=20.0, turns=1.0)
    motion = fly(takeoff(25.0), stage(StageKind.SPLINE, 0.0, 60.0, 25.0), above, home())
    first_s, last_s = motion.segments.end_s[motion.done_segment[:2]]
    heights_m = motion.state_at_time(np.linspace(first_s, last_s, 200)).height_m
    assert heights_m.min() == pytest.approx(25.0 - 35.0 * 4.0 / 27.0, abs=0.05)


@pytest.mark.parametrize(("command", "longer_s"), [(16, 26.9), (82, 33.4)])
def test_places_above_home_and_above_terrain_in_turn_are_stopped_at(
    command: int, longer_s: float
) -> None:
    # Flown by ArduCopter 4.7.0-dev: five places 60 m apart and the return, by waypoints 159.3 s in turn and
    # 132.4 s in one frame, by splines 165.8 s for 132.4 s.
    def flight_s(*frames: int) -> float:
        places = [
            item(command, north(60.0 * n), 25.0, frame=f) for n, f in enumerate(frames, start=1)
        ]
        made = mission(takeoff_to(25), *places, rtl())
        return time_s(fly(*make_route(made, dialect=Autopilot.ARDUPILOT).stages))

    assert flight_s(10, 3, 10, 3, 10) - flight_s(3, 3, 3, 3, 3) == pytest.approx(longer_s, abs=3.0)


@pytest.mark.parametrize(
    ("command", "params", "flown_s"),
    [(92, (0.0, 0.0, 0.0, 0.0), 103.5), (93, (0.0, -1.0, -1.0, -1.0), 105.1)],
)
@pytest.mark.parametrize("place", [16, 82])
def test_the_place_before_what_is_over_at_once_is_stopped_at(
    place: int, command: int, params: tuple[float, float, float, float], flown_s: float
) -> None:
    # Flown by ArduCopter 4.7.0-dev, behind a spline 103.6 s; flown through it would take 5 s less.
    over = item(command, frame=2, params=params)
    near, next_to_it, far = item(16, north(30), 25.0), item(place, north(60), 25.0), north(120)
    made = mission(takeoff_to(25), near, next_to_it, over, item(16, far, 25.0), rtl())
    stages = make_route(made, dialect=Autopilot.ARDUPILOT).stages
    flown = fly_ardupilot(stages, DEFAULTS, airspeed_limit_m_s=10.24)
    assert time_s(flown) == pytest.approx(flown_s, abs=1.5)
