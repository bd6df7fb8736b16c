"""A mission at one speed: as a route and as items, which fly the same flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import item, jump, mission, north, rtl, speed, takeoff, waypoint

import planner
from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.mission.convert import (
    mission_at_speed,
    route_at_speed,
)
from planner.mission.route.route import make_route
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import Mission, MissionItem

VEHICLES = {
    None: "falkowski-2023-quadrotor",
    Autopilot.PX4: "px4-sih-quad",
    Autopilot.ARDUPILOT: "arducopter-sitl-quad",
}


def commanded(made: Mission) -> list[tuple[float | None, float | None]]:
    return [(one.param1, one.param2) for one in made.items if one.command == 178]


def test_a_speed_is_inserted_before_the_first_leg_and_jumps_lead_where_they_did() -> None:
    made = mission(takeoff(30.0), waypoint(100.0, 30.0), waypoint(0.0, 30.0), jump(2, 1.0), rtl())
    changed = mission_at_speed(made, 7.0)
    assert [one.command for one in changed.items] == [22, 178, 16, 16, 177, 20]
    assert commanded(changed) == [(1.0, 7.0)]
    assert changed.items[4].param1 == 2.0  # the inserted item, and so the leg behind it
    assert [one.jump_id for one in changed.items] == [1, 2, 3, 4, 5, 6]


def test_commanded_speeds_are_changed_in_place_and_others_left() -> None:
    made = mission(takeoff(30.0), speed(5.0), speed(2.0, kind=2.0), waypoint(100.0, 30.0), rtl())
    assert commanded(mission_at_speed(made, 7.0)) == [(1.0, 7.0), (2.0, 2.0)]


def test_px4_takes_every_speed_for_that_of_level_flight() -> None:
    made = mission(takeoff(30.0), speed(3.0, kind=2.0), waypoint(100.0, 30.0), rtl())
    changed = mission_at_speed(made, 7.0, dialect=Autopilot.PX4)
    assert commanded(changed) == [(1.0, 7.0)]


def test_a_take_off_that_goes_somewhere_is_governed_too() -> None:
    made = mission(item(22, north(50.0), 30.0), waypoint(100.0, 30.0), rtl())
    assert [one.command for one in mission_at_speed(made, 7.0).items] == [178, 22, 16, 20]


def test_a_mission_without_level_legs_stays_as_it_is() -> None:
    made = mission(takeoff(30.0), rtl())
    assert mission_at_speed(made, 7.0) == made


def test_a_return_keeps_the_speed_of_the_vehicle() -> None:
    made = mission(takeoff(30.0), waypoint(100.0, 30.0), rtl())
    stages = route_at_speed(make_route(made), 7.0).stages
    assert [stage.speed_m_s for stage in stages] == [None, 7.0, None]


@pytest.mark.parametrize("wrong", [0.0, -3.0, float("nan"), float("inf"), 2000.0])
def test_a_speed_nothing_flies_at_is_refused(wrong: float) -> None:
    made = mission(takeoff(30.0), waypoint(100.0, 30.0), rtl())
    with pytest.raises(
        UsageError, match=r"a speed must be above 0|speed_m_s must be a finite number"
    ):
        mission_at_speed(made, wrong)
    with pytest.raises(
        UsageError, match=r"a speed must be above 0|speed_m_s must be a finite number"
    ):
        planner.check(made, planner.load_vehicle(VEHICLES[None]), speed_m_s=wrong)


def items() -> st.SearchStrategy[list[MissionItem]]:
    places = st.integers(-40, 40).map(lambda tens: 10.0 * tens)
    one = st.one_of(
        st.builds(waypoint, places, st.sampled_from([20.0, 35.0])),
        st.builds(speed, st.sampled_from([-2.0, 0.0, 3.0, 8.0]), st.sampled_from([0.0, 1.0, 2.0])),
        st.builds(
            lambda place, turns: item(18, north(place), 30.0, params=(turns, 0.0, 15.0, None)),
            places,
            st.sampled_from([1.0, 2.0]),
        ),
        st.builds(lambda target: jump(target, 1.0), st.integers(1, 6)),
    )
    return st.lists(one, min_size=1, max_size=7)


@pytest.mark.parametrize("autopilot", VEHICLES)
@given(body=items(), at=st.sampled_from([2.5, 6.0, 9.0]), away=st.booleans(), lands=st.booleans())
@settings(max_examples=15, deadline=None)
def test_the_saved_mission_flies_what_the_override_flies(
    autopilot: Autopilot | None, body: list[MissionItem], at: float, *, away: bool, lands: bool
) -> None:
    vehicle = planner.load_vehicle(VEHICLES[autopilot])
    start = item(22, north(30.0 if away else 0.0), 20.0)
    end = item(21, north(120.0), 0.0) if lands else rtl()
    made = replace(mission(start, *body, end), autopilot=autopilot)
    asked = planner.check(made, vehicle, speed_m_s=at)
    saved = planner.check(mission_at_speed(made, at), vehicle)
    assert saved.totals.time_s == pytest.approx(asked.totals.time_s, rel=1e-12)
    assert saved.totals.distance_m == pytest.approx(asked.totals.distance_m, rel=1e-12)
    assert saved.totals.energy_wh == pytest.approx(asked.totals.energy_wh, rel=1e-12, nan_ok=True)
    again = planner.check(mission_at_speed(made, at), vehicle, speed_m_s=at)
    assert "T111" not in {one.code for one in again.findings}
