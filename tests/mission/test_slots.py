"""Values made many at once are those made one by one."""

from __future__ import annotations

import pytest

from planner.frozen import frozen
from planner.mission.slots import make_many


@frozen
class Point:
    east_m: float
    north_m: float
    height_m: float = 5.0
    name: str | None = None


def test_values_made_at_once_equal_those_made_one_by_one() -> None:
    made = make_many(Point, ([1.0, 2.0], [3.0, 4.0], [6.0, 7.0], ["a", None]))
    assert made == [
        Point(east_m=1.0, north_m=3.0, height_m=6.0, name="a"),
        Point(east_m=2.0, north_m=4.0, height_m=7.0),
    ]


def test_fields_without_a_column_have_their_defaults() -> None:
    assert make_many(Point, ([1.0], [3.0])) == [Point(east_m=1.0, north_m=3.0)]


def test_no_column_makes_no_value() -> None:
    assert make_many(Point, ()) == []


def test_a_field_without_a_default_needs_its_column() -> None:
    with pytest.raises(TypeError, match="Point needs a column for north_m"):
        make_many(Point, ([1.0],))
