"""Jumps to the place right before them: every round takes a turn of the autopilot's loop.

Flown by builds, over the same mission with one round: PX4 400 rounds 19.0 s (of a LOITER_TIME of 0 s 19.8),
5,000 271 s and 9,000 445 s; ArduCopter 400 0.87 s and 5,000 12.4 s.  With a trigger or a second place
between, 400 rounds take PX4 0.5 to 0.9 s, which is not counted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, jump, mission, north, rtl, takeoff, waypoint

from planner.service.preflight import check
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

PLACE = waypoint(40, 15)
LOITER = item(19, north(40), 15.0)
TO_ALTITUDE = item(31, north(40), 15.0)
TRIGGER = item(206, params=(0.0, 0.0, 0.0, None))


def time_s(model: str, *items: MissionItem) -> float:
    found = check(
        mission(takeoff(15), *items, rtl()),
        load_vehicle(model),
        battery=Battery(capacity_wh=500.0),
        position_noise_m=0.0,
    )
    return found.totals.time_s


@pytest.mark.parametrize(
    ("model", "place", "rounds", "flown_s", "within"),
    [
        ("px4-sih-quad", PLACE, 400, 19.0, 0.06),
        ("px4-sih-quad", LOITER, 400, 19.8, 0.06),
        ("px4-sih-quad", PLACE, 5000, 271.0, 0.08),
        ("px4-sih-quad", waypoint(40, 15, hold_s=0.01), 400, 42.7, 0.08),
        ("px4-sih-quad", waypoint(40, 15, hold_s=1.0), 100, 105.4, 0.02),
        ("arducopter-sitl-quad", PLACE, 5000, 12.4, 0.02),
    ],
)
def test_a_round_takes_a_turn_of_the_loop(
    model: str, place: MissionItem, rounds: int, flown_s: float, within: float
) -> None:
    once, often = (time_s(model, PLACE, place, jump(3, count)) for count in (1, rounds))
    assert often - once == pytest.approx(flown_s, rel=within)


@pytest.mark.parametrize(
    ("model", "turn_s"),
    [
        ("px4-sih-quad", 0.05),
        ("arducopter-sitl-quad", 0.0025),
        # Nobody knows who flies it: as long as any of both.
        ("falkowski-2023-quadrotor", 0.05),
    ],
)
@pytest.mark.parametrize("place", [PLACE, LOITER, TO_ALTITUDE])
def test_every_kind_of_place_that_is_over_at_once_counts(
    model: str, turn_s: float, place: MissionItem
) -> None:
    once, often = (time_s(model, PLACE, place, jump(3, count)) for count in (10, 50))
    assert often - once == pytest.approx(40 * turn_s, abs=0.005)


@pytest.mark.parametrize("model", ["px4-sih-quad", "arducopter-sitl-quad"])
@pytest.mark.parametrize(
    "loop", [(PLACE, PLACE, jump(2, 50)), (PLACE, TRIGGER, jump(2, 50)), (PLACE, jump(2, 0))]
)
def test_nothing_is_added_with_something_between_or_without_a_round(
    model: str, loop: tuple[MissionItem, ...]
) -> None:
    assert time_s(model, *loop) == pytest.approx(time_s(model, PLACE), abs=1e-6)


@pytest.mark.parametrize("model", ["px4-sih-quad", "arducopter-sitl-quad"])
def test_less_hold_takes_no_longer(model: str) -> None:
    taken = [
        time_s(model, waypoint(40, 15, hold_s=hold_s), jump(2, 100))
        for hold_s in (0.0, 0.01, 0.05, 0.06, 1.0)
    ]
    assert taken == sorted(taken)


@pytest.mark.parametrize(("rounds", "flown_s"), [(3, 141.3), (20, 142.8)])
def test_a_height_that_is_reached_on_the_way_is_not_flown_back_to(
    rounds: int, flown_s: float
) -> None:
    """It is 100 m from the take-off, and passed without a stop."""
    loops = (takeoff(20), item(31, north(100), 30.0), jump(2, rounds), waypoint(200, 20), rtl())
    found = check(
        mission(*loops),
        load_vehicle("px4-sih-quad"),
        battery=Battery(capacity_wh=500.0),
        position_noise_m=0.0,
    )
    assert found.totals.time_s == pytest.approx(flown_s, rel=0.01)
