"""A fleet over time: where everything is when, against the closed forms and other implementations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_fleet import PACK, SEPARATION, SWAP, checked, pad, sortie, vehicles
from made_trajectories import place as place_at
from thinning import examples

from planner.fleet.approach import ACCURACY_M
from planner.fleet.separation import predict_approach
from planner.fleet.trajectory import thinned
from planner.service.fleet_separation import fleet_spacing, members
from planner.service.fleet_timeline import TRACK_ERROR_ENERGY, TRACK_ERROR_M, fleet_timeline

if TYPE_CHECKING:
    from planner.service.fleet import FleetResult

WIDE = "[separation]\nhorizontal_m = 60\n"


def result_of_two(*, second_s: float = 20.0, separation: str = SEPARATION) -> FleetResult:
    """Two vehicles from pads 40 m apart to the same place 100 m north, and back."""
    return checked(
        pad("one", 0, 0),
        pad("two", 0, 40),
        vehicles("one", "two"),
        separation,
        sortie("first", "one", 0.0),
        sortie("second", "two", second_s),
    )


def test_a_thinned_track_is_as_near_as_it_says_at_every_time() -> None:
    result = result_of_two()
    timeline = fleet_timeline(result)
    assert timeline.frame is not None
    for track, one in zip(timeline.tracks, result.sorties, strict=True):
        assessment = one.assessment
        assert assessment is not None
        time_s = np.linspace(0.0, one.time_s, 2001)
        flown = assessment.flight.motion.state_at_time(time_s)
        east_m, north_m = timeline.frame.east_north_m(
            *assessment.route.frame.latitude_longitude_deg(flown.east_m, flown.north_m)
        )
        there = np.array([track.place_at(t) for t in time_s + one.start_s])
        away_m = there - np.column_stack((east_m, north_m, flown.height_m))
        assert np.sqrt(np.sum(away_m**2, axis=1)).max() < TRACK_ERROR_M
        assert len(track.time_s) < 40
        used_wh = np.interp(time_s + one.start_s, track.time_s, track.used_wh)
        whole_wh = np.cumsum(assessment.flight.power_w(time_s)) * np.diff(time_s)[0] / 3600.0
        assert one.energy_wh is not None
        # the sum of 2,001 powers is itself wrong by a step of the highest one
        error_wh = TRACK_ERROR_ENERGY * one.energy_wh + assessment.flight.peak_power_w / 3600.0
        assert np.abs(used_wh - whole_wh).max() < error_wh
        assert [track.item_at(t) for t in (one.start_s, one.end_s)] == [1, 3]
    assert timeline.used_wh[-1] == pytest.approx(result.totals.energy_wh, rel=1e-9)
    joules = np.sum(timeline.power_w * np.diff(timeline.edge_s))
    assert joules / 3600.0 == pytest.approx(result.totals.energy_wh, rel=1e-9)


@given(st.integers(0, 1000), st.floats(0.1, 5.0))
@settings(max_examples=examples(20), deadline=None)
def test_what_is_thinned_out_is_within_the_tolerance_at_its_own_time(
    seed: int, tolerance: float
) -> None:
    draws = np.random.default_rng(seed)
    time_s = np.cumsum(draws.uniform(0.1, 1.0, 60))
    places = np.cumsum(draws.normal(0.0, 1.0, (60, 4)), axis=0)
    kept = thinned(time_s, places, tolerance)
    assert (kept[0], kept[-1]) == (0, 59)
    between = np.stack([np.interp(time_s, time_s[kept], column[kept]) for column in places.T], 1)
    assert np.linalg.norm(between - places, axis=1).max() <= tolerance + 1e-9
    straight = time_s[:, None] * np.array([1.0, -2.0])
    assert thinned(time_s, straight, tolerance).tolist() == [0, 59]


@pytest.mark.parametrize("more", ["", "start_error_s = 2\n", "above_m = 10\nmay_stop = true\n"])
@pytest.mark.parametrize("second_s", [0.0, 9.0])
def test_the_closest_a_pair_may_come_is_that_of_the_exact_search(
    more: str, second_s: float
) -> None:
    result = result_of_two(second_s=second_s, separation=f"{WIDE}{more}")
    [pair] = fleet_timeline(result).pairs
    assert result.fleet.separation is not None
    one, two = members(result.fleet, result.fleet.separation, result.sorties)
    exact = predict_approach(one, two, fleet_spacing(result.fleet.separation))
    assert exact is not None
    # the search is no more than a centimetre below what there is, and never above
    assert exact.distance_m - 1e-9 <= pair.least_m <= exact.distance_m + ACCURACY_M + 0.01
    assert (pair.may_m >= pair.least_m).all()
    assert (pair.may_m <= pair.planned_m).all()


def test_of_the_pairs_those_too_near_come_first_and_six_are_enough() -> None:
    names = [f"v{number}" for number in range(5)]
    result = checked(
        *(pad(name, 0, 60.0 * number) for number, name in enumerate(names)),
        vehicles(*names),
        SEPARATION,
        *(
            sortie(f"s{number}", name, 0.0 if number in {0, 3} else 500.0 * (number + 1))
            for number, name in enumerate(names)
        ),
    )
    pairs = fleet_timeline(result).pairs
    assert {pairs[0].first, pairs[0].second} == {"s0", "s3"}
    assert len(pairs) == 6


def test_rows_say_who_has_what_and_when() -> None:
    """Two packs on two places of a charger, one after the other in the only one of another kind."""
    tables = (
        pad("one", 0, 0),
        pad("two", 0, 40),
        vehicles("one", "two"),
        "[separation]\nhorizontal_m = 5\n",
        SWAP,
        '[pack.P]\nbattery = "170Wh"\ncount = 2\n',
        "[charger.van]\ncount = 2\nc_rate = 1\n",
        sortie("first", "one", 0.0, more='pack = "P-1"'),
        sortie("second", "two", 300.0, more='pack = "P-2"'),
        sortie("third", "one", 3000.0, more='pack = "P-1"'),
    )
    result = checked(*tables)
    timeline = fleet_timeline(result)
    first, second, third = result.sorties
    rows = {(row.kind, row.name): row.spans for row in timeline.rows}
    assert timeline.end_s == math.ceil(third.end_s + 60.0)
    assert [(one.use, one.start_s, one.end_s, one.name) for one in rows["vehicle", "one"]] == [
        ("flight", 0.0, first.end_s, "first"),
        ("swap", first.end_s, first.end_s + 60.0, "first"),
        ("flight", 3000.0, third.end_s, "third"),
        ("swap", third.end_s, third.end_s + 60.0, "third"),
    ]
    assert [one.use for one in rows["pack", "P-1"]] == [
        "flight",
        "swap",
        "charge",
        "flight",
        "swap",
    ]
    [charge] = rows["charger", "van 1"]
    assert (charge.name, charge.start_s) == ("P-1", first.end_s + 60.0)
    assert [one.name for one in rows["charger", "van 2"]] == ["P-2"]
    assert [one.start_s for one in rows["pad", "two"]] == [0.0, second.end_s]
    assert [one.sortie for one in timeline.vehicles_at(0.0)] == ["first", "second"]
    assert [one.sortie for one in timeline.vehicles_at(3000.0)] == ["third", "second"]


def test_a_finding_is_marked_when_and_where_it_happens() -> None:
    result = checked(
        pad("one", 0, 0),
        pad("two", 0, 40),
        vehicles("one", "two"),
        "[separation]\nhorizontal_m = 30\n",
        SWAP,
        PACK,
        sortie("first", "one", 0.0, more='pack = "P"'),
        sortie("second", "two", 10.0, more='pack = "P"'),
    )
    timeline = fleet_timeline(result)
    marks = {one.finding.code: one for one in timeline.marks}
    assert [timeline.rows[at].name for at in marks["S105"].rows] == ["one", "two", "P"]
    assert (marks["S105"].at_s, marks["S105"].place_m) == (10.0, None)
    near = marks["S101"]
    [pair] = timeline.pairs
    assert near.at_s == pytest.approx(pair.least_s, abs=1.0)
    assert near.place_m == timeline.tracks[0].place_at(near.at_s)[:2]


def test_places_of_a_trajectory_are_those_of_its_bernstein_polynomials() -> None:
    result = result_of_two()
    assert result.fleet.separation is not None
    one, _ = members(result.fleet, result.fleet.separation, result.sorties)
    time_s = np.linspace(-5.0, one.trajectory.duration_s + 5.0, 777)
    assert one.trajectory.place_m(time_s) == pytest.approx(
        place_at(one.trajectory, time_s), abs=1e-9
    )


def test_a_fleet_that_flies_nothing_has_no_tracks() -> None:
    timeline = fleet_timeline(checked(pad("one", 0, 0), vehicles("one")))
    assert (timeline.tracks, timeline.rows, timeline.pairs, timeline.end_s) == ((), (), (), 0.0)
    assert timeline.used_wh[-1] == 0.0
