"""Vehicles of a fleet that are told to stop, against the closed form of the article's vehicle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import checked, pad, place, sortie, up, vehicles
from made_missions import item, mission
from made_trajectories import straight, trajectory

from planner.fleet.approach import Cylinder, closest_approach
from planner.fleet.separation import Member, Spacing, predict_conflicts
from planner.flight.motion import steps
from planner.flight.pilot import make_pilot
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.vehicle.model import ManoeuvreResponse

ARTICLE = "falkowski-2023-quadrotor"
V_M_S = 9.9470
"""True speed of the article's vehicle at a command of 10 m/s."""
STOP_M, FARTHEST_M = 31.889, 32.654
"""From there: where it ends, and where it turns back."""
FARTHEST_S = FARTHEST_M / V_M_S
EXACT = "[conditions]\nposition_error_m = 0\nreaction_time_s = 0\n"
KEPT = EXACT + "[separation]\nhorizontal_m = 10\nheight_error_m = 0\n"
MAY_STOP = KEPT + "may_stop = true\n"
LAND = item(21, None, 0.0)


def told(tables: str, *ways: tuple[float, list[tuple[float, float]]], model: str = ARTICLE) -> str:
    """What is told of two at 60 m, each from a place so far east by places east and north; empty: clear.

    The last place is landed at; one that has but this hovers there for two minutes.
    """
    names = ("a", "b")
    jobs = {
        name: mission(
            up(60),
            *(place(north, east, 60, 120.0 * (len(places) == 1)) for east, north in places),
            LAND,
        )
        for name, (_, places) in zip(names, ways, strict=True)
    }
    tables += "".join(
        pad(name, 0, east) + sortie(f"s{name}", name, 0.0, job=name)
        for name, (east, _) in zip(names, ways, strict=True)
    )
    result = checked(tables, vehicles(*names, model=model), **jobs)
    return "".join(one.finding.message for one in result.findings if one.finding.code == "S101")


@pytest.mark.parametrize("speed_m_s", [0.5 * V_M_S, V_M_S])
def test_a_stop_gets_farther_than_where_it_ends(speed_m_s: float) -> None:
    pilot = make_pilot(Setup(load_vehicle(ARTICLE)), None)
    speeds = np.array([speed_m_s])
    assert pilot.farthest_stop_m(speeds)[0] == pytest.approx(FARTHEST_S * speed_m_s, abs=1e-3)
    assert pilot.stop(speeds)[0][0] == pytest.approx(STOP_M / V_M_S * speed_m_s, abs=1e-3)


@pytest.mark.parametrize("tables", [KEPT, MAY_STOP])
@pytest.mark.parametrize(("command_m", "is_clear"), [(75.08, False), (75.53, True)])
def test_two_head_on_are_told_75_m_apart(tables: str, command_m: float, *, is_clear: bool) -> None:
    """75.308 m apart in closed form, to 0.3 %, what legs that end within a metre are good to."""
    between_m = command_m - 2.0 * STOP_M
    ways = (0.0, [(300.0, 0.0)]), (600.0 + between_m, [(300.0 + between_m, 0.0)])
    assert (told(tables, *ways) == "") is is_clear


@pytest.mark.parametrize("ulps", [-2, -1, 1, 2])
@pytest.mark.parametrize(("command_m", "is_clear"), [(75.08, False), (76.0, True), (78.0, True)])
def test_two_head_on_are_told_the_same_whatever_the_last_bit_of_the_time_of_their_stops(
    monkeypatch: pytest.MonkeyPatch, ulps: int, command_m: float, *, is_clear: bool
) -> None:
    """A unit in the last place less, and what follows the stop seemed to be flown at 0.2 m/s."""
    answer = steps._speed_answer

    def nudged(response: ManoeuvreResponse) -> object:
        found = answer(response)
        off_s = ulps * np.spacing(found.stop_s)
        return replace(found, reached_s=found.reached_s + off_s, stop_s=found.stop_s + off_s)

    monkeypatch.setattr(steps, "_speed_answer", nudged)
    between_m = command_m - 2.0 * STOP_M
    ways = (0.0, [(300.0, 0.0)]), (600.0 + between_m, [(300.0 + between_m, 0.0)])
    assert (told(MAY_STOP, *ways) == "") is is_clear


@pytest.mark.parametrize("tables", [KEPT, MAY_STOP])
@pytest.mark.parametrize(("command_m", "is_clear"), [(42.53, False), (42.78, True)])
def test_one_is_told_43_m_before_another_that_hovers(
    tables: str, command_m: float, *, is_clear: bool
) -> None:
    """42.654 m in closed form."""
    hovers_m = 300.0 - STOP_M + command_m
    ways = (0.0, [(150.0, 0.0), (300.0, 0.0)]), (hovers_m, [(hovers_m, 0.0)])
    assert (told(tables, *ways) == "") is is_clear


@pytest.mark.parametrize(("gap_m", "is_clear"), [(20.08, False), (20.80, True)])
def test_who_is_told_a_second_after_its_leader_does_not_touch_it_swinging_back(
    gap_m: float, *, is_clear: bool
) -> None:
    """20.141 m behind in closed form, where the leader swings back slowly.

    A check has it back at once when it turns, 0.71 m before the follower turns: that much more is asked
    for.  The second in between is flown: the follower's way is so much longer.
    """
    ways = (0.0, [(300.0, 0.0)]), (-gap_m, [(300.0 + V_M_S - gap_m, 0.0)])
    assert (told(KEPT, *ways) == "") is is_clear


def test_who_passes_another_may_stop_there_too() -> None:
    """A stop leads on, not aside: 11.5 m beside one that hovers is enough, with half a metre of rounding."""
    ways = (0.0, [(300.0, 0.0), (600.0, 0.0)]), (450.0, [(450.0, 11.5)])
    assert told(MAY_STOP, *ways) == ""


def test_who_is_told_to_stop_in_a_turn_goes_straight_on() -> None:
    """ArduPilot flies round the corner: a stop before it ends beyond, where another hovers."""
    ways = (0.0, [(300.0, 0.0), (300.0, 300.0)]), (320.0, [(320.0, 0.0)])
    model = "arducopter-sitl-quad"
    assert told(KEPT, *ways, model=model) == ""
    message = told(MAY_STOP, *ways, model=model)
    assert message.startswith("sa (a) and sb (b), told to stop: ")
    assert message.endswith("10 m beside or 10 m above each other required")


def flying(from_m: float, to_m: float) -> Member:
    """A vehicle that flies for 10 s, may be told to stop, and is gone."""
    flown = straight((0, from_m, 0, 60), (10, to_m, 0, 60))
    start_s, end_s = flown.start_s.copy(), flown.end_s.copy()
    start_s[0], end_s[-1] = -1e-6, 10.0 + 1e-6
    stop_s = np.full(len(start_s), FARTHEST_S)
    return Member(
        file="",
        trajectory=replace(flown, start_s=start_s, end_s=end_s, stop_s=stop_s),
        start_s=0.0,
        home_amsl_m=0.0,
        above_m=10.0,
        below_m=10.0,
    )


@pytest.mark.parametrize(("gap_m", "other_m_s"), [(75.308, V_M_S), (42.654, 0.0)])
@pytest.mark.parametrize(("more_m", "conflicts"), [(-0.02, 1), (0.02, 0)])
def test_before_full_speed_is_left_the_farthest_points_are_kept_apart(
    gap_m: float, other_m_s: float, more_m: float, conflicts: int
) -> None:
    """Head-on, and before one that hovers: nearest at the end, when both are gone."""
    far_m = gap_m + more_m
    pair = flying(-10.0 * V_M_S, 0.0), flying(far_m + 10.0 * other_m_s, far_m)
    spacing = Spacing(separation_m=10.0, height_error_m=0.0)
    assert len([*predict_conflicts(pair, spacing)]) == conflicts


@pytest.mark.parametrize("side_m", [3.0, 8.0, 14.0])
def test_no_drawn_stop_is_outside_of_what_is_kept_apart(side_m: float) -> None:
    """Against every stop by samples: of a curved flight, past one that hovers at its side."""
    control_m = np.array([[[0, 0, 60], [30, 5, 60], [60, 40, 60], [60, 90, 60]]], float)
    flown = trajectory([0.0, 12.0], control_m)
    flown = replace(flown, stop_s=np.array([0.0, 2.5, 0.0]))
    time_s = np.linspace(0.0, 12.0, 2401)
    place_m, stop_m = flown.place_and_stop_m(time_s)
    shares = np.linspace(0.0, 1.0, 201)
    passed_m = place_m[:, None, :2] + shares[None, :, None] * stop_m[:, None]
    hover_m = np.array([60.0 + side_m, 45.0])
    least_m = float(np.hypot(*np.moveaxis(passed_m - hover_m, -1, 0)).min())
    hover = straight((0, *hover_m, 60), (12, *hover_m, 60))
    zone = Cylinder(horizontal_m=100.0, over_m=100.0, under_m=100.0)
    found = closest_approach(flown.reach, hover, zone=zone)
    assert found is not None
    # discs half a metre wide at most reach beyond the way by no more than that
    assert least_m - 0.5 - 0.02 <= found.distance_m <= least_m + 1e-3
