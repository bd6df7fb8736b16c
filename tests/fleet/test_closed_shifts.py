"""Starts at which two flights come too near: by hand, and against dense sampling."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_trajectories import place, straight

from planner.fleet.approach import Cylinder, Meeting, closest_approach
from planner.fleet.shifts import ROUND_S, ClosedShifts
from planner.fleet.trajectory import Pace
from planner.values import replace

if TYPE_CHECKING:
    from planner.fleet.trajectory import Trajectory

SPEED_M_S = 9.9470
"""True speed of the article's vehicle at a command of 10 m/s (swarm facts, §6)."""


def through(angle_deg: float, *, length_m: float = 600.0, height_m: float = 30.0) -> Trajectory:
    """Return a straight flight over the origin, half-way, in a direction from east."""
    east, north = (0.5 * length_m * f(math.radians(angle_deg)) for f in (math.cos, math.sin))
    return straight((0.0, -east, -north, height_m), (length_m / SPEED_M_S, east, north, height_m))


@pytest.mark.parametrize(
    ("angle_deg", "delay_s"),
    [(30.0, 1.0408), (60.0, 1.1608), (90.0, 1.4217), (120.0, 2.0106), (150.0, 3.8843)],
)
def test_crossing_tracks_are_clear_from_the_delay_of_their_angle_on(
    angle_deg: float, delay_s: float
) -> None:
    # the least approach at equal speeds is v dt cos(a / 2)
    [(low_s, high_s)] = ClosedShifts(
        Meeting(first=through(0.0), second=through(angle_deg)), within_m=10.0
    )
    assert (low_s, high_s) == pytest.approx((-delay_s, delay_s), abs=1e-4 + 2 * ROUND_S)


# Who may be late reaches into what comes behind it; of two alike only who loses more than the other.
@pytest.mark.parametrize(
    ("are_alike", "before_s", "behind_s"), [(False, 2.0, 5.0), (True, 0.0, 3.0)]
)
def test_starts_are_closed_for_as_long_as_either_may_be_late(
    *, are_alike: bool, before_s: float, behind_s: float
) -> None:
    pace = Pace(flown_by=(), passed_s=np.zeros((2, 1))) if are_alike else None
    one, two = (
        replace(flown, late_s=np.where(flown.is_rest, 0.0, by_s)[:, None].repeat(2, 1), pace=pace)
        for flown, by_s in ((through(0.0), 5.0), (through(90.0), 2.0))
    )
    [(low_s, high_s)] = ClosedShifts(Meeting(first=one, second=two), within_m=10.0)
    delay_s = 1.4217
    expected = (-delay_s - before_s, delay_s + behind_s)
    assert (low_s, high_s) == pytest.approx(expected, abs=1e-4 + 2 * ROUND_S)


def test_head_on_they_are_never_clear_before_one_of_them_is_over() -> None:
    # They rest 600 m apart at their ends: the second, 600 m long, is in the way as long as it takes
    # the first to be past its place of departure, and it that of the first.
    [(low_s, high_s)] = ClosedShifts(
        Meeting(first=through(0.0), second=through(180.0)), within_m=10.0
    )
    # each rests at the other's take-off place: nowhere at all is clear
    assert (low_s, high_s) == (-math.inf, math.inf)


def test_who_joins_and_leaves_a_track_sideways_keeps_more_than_the_separation_on_it() -> None:
    # On the track the second is flown at from 5 s on, which the first reaches after 100 m.
    on_it_s = 5.0 + 400.0 / SPEED_M_S
    joining = straight(
        (0.0, -200.0, 30.0, 30.0),
        (5.0, -200.0, 0.0, 30.0),
        (on_it_s, 200.0, 0.0, 30.0),
        (on_it_s + 5.0, 200.0, 30.0, 30.0),
    )
    # D apart in time, the first passes the one who joins or leaves at 6 m/s square to it at
    # v D 6 / sqrt(v² + 6²), less than the v D they keep on the track.
    apart_s = 10.0 / (SPEED_M_S * 6.0 / math.hypot(SPEED_M_S, 6.0))
    even_s = 100.0 / SPEED_M_S - 5.0
    [found] = ClosedShifts(Meeting(first=through(0.0), second=joining), within_m=10.0)
    assert found == pytest.approx((even_s - apart_s, even_s + apart_s), abs=2 * ROUND_S)


def test_height_kept_apart_closes_no_start() -> None:
    zone = Cylinder(horizontal_m=10.0, over_m=5.0, under_m=5.0)
    above = Meeting(first=through(0.0), second=through(90.0, height_m=35.5), zone=zone)
    assert [*ClosedShifts(above)] == []
    near = Meeting(first=through(0.0), second=through(90.0, height_m=34.5), zone=zone)
    [(low_s, high_s)] = ClosedShifts(near)
    assert (low_s, high_s) == pytest.approx((-1.4217, 1.4217), abs=1e-4 + 2 * ROUND_S)


def test_an_error_of_the_start_widens_it() -> None:
    meeting = Meeting(first=through(0.0), second=through(90.0), shift_s=3.0)
    [(low_s, high_s)] = ClosedShifts(meeting, within_m=10.0)
    assert (low_s, high_s) == pytest.approx((-4.4217, 4.4217), abs=1e-4 + 2 * ROUND_S)


def wandering(rng: np.random.Generator) -> Trajectory:
    """Return a flight over six places within 60 m, from a rest away from all others'."""
    places = rng.uniform(-60.0, 60.0, (6, 2))
    ends = np.array([[rng.uniform(500.0, 900.0) * (1 if rng.random() < 0.5 else -1), 700.0]] * 2)
    ends[1, 1] = -700.0
    ends += rng.uniform(-90.0, 90.0, (2, 2))
    way = np.vstack((ends[:1], places, ends[1:]))
    time_s = np.append(0.0, np.cumsum(np.hypot(*np.diff(way, axis=0).T) / rng.uniform(4.0, 9.0, 7)))
    return straight(
        *((float(t), float(e), float(n), 30.0) for t, (e, n) in zip(time_s, way, strict=True))
    )


@pytest.mark.parametrize("seed", range(4))
def test_outside_nothing_is_near_and_the_ends_cannot_be_moved(seed: int) -> None:
    rng = np.random.default_rng(seed)
    meeting = Meeting(first=wandering(rng), second=wandering(rng))
    found = [*ClosedShifts(meeting, within_m=15.0)]
    assert found
    span_s = meeting.first.duration_s + meeting.second.duration_s
    for later_s in rng.uniform(-span_s, span_s, 40).tolist():
        time_s = np.arange(-span_s, 2.0 * span_s, 0.05)
        gap_m = place(meeting.first, time_s) - place(meeting.second, time_s - later_s)
        nearest_m = float(np.sqrt(np.sum(gap_m**2, axis=1)).min())
        if not any(low_s < later_s < high_s for low_s, high_s in found):
            assert nearest_m >= 15.0 - 1e-9
    for end_s in (one for pair in found for one in pair if math.isfinite(one)):
        within = [
            closest_approach(
                meeting.first, meeting.second, second_later_s=end_s + by_s, within_m=15.0
            )
            for by_s in (-2.0 * ROUND_S, 2.0 * ROUND_S)
        ]
        assert (within[0] is None) != (within[1] is None)
