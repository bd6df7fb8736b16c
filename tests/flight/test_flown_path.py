"""The path of a motion: straight pieces within a tolerance of it, and nothing between two samples."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from fenced_missions import at, motion_of
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import mission, rtl, speed, takeoff
from thinning import examples

from planner.autopilot import Autopilot
from planner.flight.path import PATH_TOLERANCE_M, FlownPath, flown_path
from planner.flight.pilot import make_pilot
from planner.mission.route.route import make_route
from planner.service.preflight import check_file
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import Motion

SPACING_S = 0.05


def farthest_m(motion: Motion, path: FlownPath) -> float:
    """Return how far the motion, sampled closely, is from its path at most."""
    time_s = np.arange(0.0, float(motion.segments.duration_s.sum()), SPACING_S)
    state = motion.state_at_time(time_s)
    place_m = np.stack((state.east_m, state.north_m))
    if motion.beside is not None:
        place_m = place_m + motion.beside.at(time_s)
    line = shapely.LineString(np.column_stack((path.east_m, path.north_m)))
    shapely.prepare(line)
    return float(shapely.distance(line, shapely.points(*place_m)).max())


@given(
    st.sampled_from(list(Autopilot)),
    st.lists(
        st.tuples(st.floats(-80.0, 80.0), st.floats(-80.0, 80.0), st.floats(10.0, 40.0)),
        min_size=1,
        max_size=4,
    ),
    st.sampled_from([16, 82, 18]),
    st.floats(2.0, 12.0),
)
@settings(max_examples=examples(20), deadline=None)
def test_a_motion_never_leaves_its_path(
    autopilot: Autopilot, places: list[tuple[float, float, float]], command: int, speed_m_s: float
) -> None:
    if autopilot is not Autopilot.ARDUPILOT:
        command = 16
    params = (1.5, 0.0, 15.0, None) if command == 18 else (0.0, 0.0, 0.0, None)
    turns = [at(*place, command=command, params=params) for place in places]
    motion = motion_of(autopilot, takeoff(20), speed(speed_m_s), *turns, at(0, 120), rtl())
    path = flown_path(motion)
    # A circle's chords and a law that is followed by cubics are good to a little more.
    assert farthest_m(motion, path) <= 1.1 * PATH_TOLERANCE_M
    assert len(path.item) == len(path.east_m) - 1 == len(path.is_circle)


def test_a_circle_is_divided_until_its_chords_are_near_it() -> None:
    whole = at(0, 0, command=18, params=(2.0, 0.0, 100.0, None))
    path = flown_path(motion_of(Autopilot.STEP, takeoff(20), whole, rtl()))
    on_circle = np.flatnonzero(path.is_circle)
    # Chords whose middle is 5 cm inside of 100 m have a half angle of acos(0.9995) = 1.812°.
    assert len(on_circle) == pytest.approx(2 * 180.0 / 1.812, abs=2)
    assert np.hypot(path.east_m, path.north_m)[on_circle] == pytest.approx(100.0, abs=1e-6)
    assert path.length_m[on_circle].sum() == pytest.approx(400.0 * np.pi, rel=1e-3)


def test_straight_flight_takes_no_more_pieces_than_its_motion() -> None:
    motion = motion_of(Autopilot.ARDUPILOT, takeoff(20), at(0, 3000), rtl())
    assert len(flown_path(motion).item) == len(motion.piece_segment)


def test_a_path_that_is_cut_is_the_same_and_passes_where_the_motion_does() -> None:
    motion = motion_of(Autopilot.ARDUPILOT, takeoff(20), at(0, 3000), at(0, 3000, 140.0), rtl())
    whole = flown_path(motion)
    cut = whole.cut(motion, 100.0)
    assert cut.length_m.max() <= 100.0 + 1e-6
    assert np.abs(np.diff(cut.height_m)).max() <= 100.0 + 1e-6
    assert cut.length_m.sum() == pytest.approx(whole.length_m.sum(), abs=1e-6)
    assert set(whole.time_s.tolist()) < set(cut.time_s.tolist())
    assert np.all(np.diff(cut.time_s) > 0.0)
    then = motion.state_at_time(cut.time_s)
    assert cut.east_m_s == pytest.approx(then.east_m_s, abs=1e-9)
    assert cut.north_m == pytest.approx(then.north_m, abs=1e-9)
    assert np.unique(cut.item).tolist() == np.unique(whole.item).tolist()
    assert whole.cut(motion, 1e6) is whole


def test_a_climb_that_answers_a_step_turns_where_the_answer_does() -> None:
    vehicle = load_vehicle("falkowski-2023-quadrotor")
    assert vehicle.responses.altitude is not None
    swings = replace(vehicle.responses.altitude, denominator=(1.0, 0.07, 0.03071))
    swinging = replace(vehicle, responses=replace(vehicle.responses, altitude=swings))
    motion = make_pilot(Setup(swinging), None).fly(
        make_route(mission(takeoff(20), at(0, 100), rtl()))
    )[0]
    path = flown_path(motion)
    # Damped by ζ = 0.07 / (2 √0.03071) = 0.1997: it swings over by exp(−π ζ / √(1 − ζ²)) = 0.5271 of 20 m.
    assert path.height_m.max() == pytest.approx(20.0 * 1.5271, abs=1e-3)
    # Three pieces, the swings over and back half a period of 18.3 s apart, and no points between.
    climb = np.flatnonzero(path.item == 1)
    assert len(climb) <= 3 + path.time_s[climb[-1] + 1] / (0.5 * 18.3)


@pytest.mark.parametrize("autopilot", list(Autopilot))
def test_a_vehicle_is_committed_up_to_its_braking_and_not_within(autopilot: Autopilot) -> None:
    motion = motion_of(autopilot, takeoff(20), speed(8.0), at(0, 400), at(0, 400.0, 30.0), rtl())
    path = flown_path(motion)
    out = np.flatnonzero(path.item == 3)
    fast = path.is_committed[out] & (path.speed_m_s[out] > 7.5)
    assert fast.any()
    # No place on the way is committed between full speed and standing still but in accelerating.
    last = out[fast][-1]
    within = np.arange(last + 1, out[-1])
    assert not np.any(path.is_committed[within] & (path.speed_m_s[within] > 0.5))


@pytest.mark.parametrize(("slowing_m_s2", "committed"), [(0.249, True), (0.251, False)])
def test_a_quarter_of_a_metre_per_second_squared_is_a_braking(
    slowing_m_s2: float,
    committed: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # Five legs of 8 m; along the three in the middle v² falls by 2 a s.
    fallen = np.array([0.0, 0.0, 8.0, 16.0, 24.0, 24.0])
    speed_m_s = np.sqrt(100.0 - 2.0 * slowing_m_s2 * fallen)
    zeros, no = np.zeros(6), np.zeros(5, np.bool_)
    path = FlownPath(
        east_m=8.0 * np.arange(6.0),
        north_m=zeros,
        east_m_s=speed_m_s,
        north_m_s=zeros,
        height_m=zeros,
        time_s=np.arange(6.0),
        segment=np.zeros(5, np.intp),
        item=np.ones(5, np.intp),
        is_circle=no,
        is_brake=no,
    )
    assert path.is_committed.tolist() == [True, True, committed, committed, True, True]


def test_rules_that_would_need_too_many_points_are_not_evaluated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("planner.flight.path._MOST_POINTS", 3)
    sample = Path(__file__).parents[2] / "missions" / "survey-vineyard.plan"
    result = check_file(sample, Setup(vehicle=load_vehicle("falkowski-2023-quadrotor")))
    lacks = [one.message for one in result.findings if one.code == "X904"]
    assert any("F101" in one and "fewer repeats" in one for one in lacks)
    assert result.verdict == "no-go"
