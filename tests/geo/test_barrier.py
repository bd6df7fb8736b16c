"""Hulls of points, and whether they come near a barrier: whole areas against whole edges."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.errors import PathTooLongError
from planner.geo.barrier import Barrier, CircleBarrier, path_legs, polygon_barrier, swept_areas

TRIANGLE = np.array([(0.0, 0.0), (100.0, 0.0), (0.0, 100.0)])
LINE = np.array([(200.0, 0.0), (300.0, 0.0)])


def rectangle(
    west: float, south: float, east: float, north: float, *, keep_inside: bool
) -> Barrier:
    return polygon_barrier(
        shapely.box(west, south, east, north), keep_inside=keep_inside, label="area"
    )


def circle(east: float, north: float, radius: float, *, keep_inside: bool) -> CircleBarrier:
    return CircleBarrier(
        label="area",
        place=None,
        keep_inside=keep_inside,
        east_m=east,
        north_m=north,
        radius_m=radius,
    )


def near(barrier: Barrier, margin_m: float = 0.0) -> list[bool]:
    """Whether the triangle and the line are near, their points given mixed."""
    points = np.concatenate((LINE[:1], TRIANGLE, LINE[1:]))
    areas = swept_areas(points, np.array([1, 0, 0, 0, 1]))
    found: list[bool] = areas.near(barrier, margin_m).tolist()
    return found


@pytest.mark.parametrize(
    ("barrier", "expected"),
    [
        # An island in the triangle, touched by none of its sides.
        (rectangle(20.0, 20.0, 30.0, 30.0, keep_inside=False), [True, False]),
        (circle(25.0, 25.0, 5.0, keep_inside=False), [True, False]),
        # Beside the long side, which passes (50, 50): 10/√2 m away.
        (rectangle(60.0, 50.0, 70.0, 70.0, keep_inside=False), [False, False]),
        # All of the triangle inside an exclusion, all of the line outside an inclusion.
        (rectangle(-10.0, -10.0, 110.0, 110.0, keep_inside=False), [True, False]),
        (rectangle(-10.0, -10.0, 110.0, 110.0, keep_inside=True), [False, True]),
        (circle(0.0, 0.0, 101.0, keep_inside=True), [False, True]),
        (circle(250.0, 0.0, 51.0, keep_inside=True), [True, False]),
        # A sliver of a metre across the line between its ends.
        (rectangle(240.0, -5.0, 241.0, 5.0, keep_inside=False), [False, True]),
    ],
)
def test_an_area_is_near_what_it_holds_or_leaves(barrier: Barrier, expected: list[bool]) -> None:
    assert near(barrier) == expected


def test_places_that_are_one_but_for_rounding_have_a_hull_to_be_away_from() -> None:
    """A vehicle that settles comes nearer by a factor each time: GEOS divides by squares of steps."""
    points = np.array([(-1e-200, -1e-200), (1e-200, -2e-200), *TRIANGLE[1:]])
    areas = swept_areas(points, np.zeros(4, np.intp))
    with np.errstate(divide="raise", invalid="raise"):
        found = areas.near(circle(100.0, 100.0, 70.0, keep_inside=False), 0.0)  # 50 √2 away
    assert found.tolist() == [False]


@pytest.mark.parametrize("keep_inside", [False, True])
def test_more_legs_and_edges_than_can_be_cut_are_refused(
    monkeypatch: pytest.MonkeyPatch, *, keep_inside: bool
) -> None:
    """Of 4 edges and 3 legs, of which 2 pass: 8 pairs."""
    barrier = rectangle(0.0, 0.0, 10.0, 10.0, keep_inside=keep_inside)
    legs = path_legs([-5.0, 5.0, 15.0, 15.0], [5.0, 5.0, 5.0, 6.0])
    if keep_inside:
        legs = path_legs([5.0, 15.0, 5.0, 5.0], [5.0, 5.0, 5.0, 6.0])
    monkeypatch.setattr("planner.geo.barrier._MOST_CUTS", 8)
    assert barrier.spans_outside(legs).leg.tolist() == [0, 1]
    monkeypatch.setattr("planner.geo.barrier._MOST_CUTS", 7)
    with pytest.raises(PathTooLongError, match="2 legs that pass an area of 4 edges"):
        barrier.spans_outside(legs)


def test_the_margin_decides_at_its_boundary() -> None:
    away_m = 10.0 / np.sqrt(2.0)
    beside = rectangle(60.0, 50.0, 70.0, 70.0, keep_inside=False)
    assert near(beside, away_m - 0.01) == [False, False]
    assert near(beside, away_m + 0.01) == [True, False]
    around = circle(0.0, 0.0, 101.0, keep_inside=True)
    assert near(around, 0.99)[0] is False
    assert near(around, 1.01)[0] is True


@given(
    st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=3, max_size=6),
    st.tuples(st.floats(-60, 60), st.floats(-60, 60)),
    st.floats(1.0, 30.0),
    st.booleans(),
    st.booleans(),
)
@settings(max_examples=examples(60), deadline=None)
def test_no_place_of_an_area_is_nearer_than_it_says(
    points: list[tuple[float, float]],
    centre: tuple[float, float],
    size_m: float,
    keep_inside: bool,  # noqa: FBT001 - drawn
    is_circle: bool,  # noqa: FBT001 - drawn
) -> None:
    made = circle if is_circle else rectangle
    east, north = centre
    corners = (east, north, size_m) if is_circle else (east, north, east + size_m, north + size_m)
    barrier = made(*corners, keep_inside=keep_inside)
    corner = np.array(points)
    areas = swept_areas(corner, np.zeros(len(corner), np.intp))
    share = np.random.default_rng(0).dirichlet(np.full(len(corner), 0.4), size=400)
    least_m = float(barrier.signed_distance_m(share @ corner).min())
    if not areas.near(barrier, 2.0)[0]:
        assert least_m > 2.0 - 1e-6
