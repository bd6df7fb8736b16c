"""Values behave as frozen, slotted, keyword-only dataclasses do: the standard library tells how."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from typing import Any

import pytest

from planner.frozen import frozen


@frozen
class Point:
    """A place."""

    east_m: float
    north_m: float = 0.0
    names: list[str] = dataclasses.field(default_factory=list)
    note: str = dataclasses.field(default="", compare=False, repr=False)
    far_m: float = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        if self.east_m < 0.0:
            msg = "west"
            raise ValueError(msg)
        object.__setattr__(self, "far_m", self.east_m + self.north_m)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class StandardPoint:
    """The same by the standard library."""

    east_m: float
    north_m: float = 0.0
    names: list[str] = dataclasses.field(default_factory=list)
    note: str = dataclasses.field(default="", compare=False, repr=False)
    far_m: float = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "far_m", self.east_m + self.north_m)


@frozen(eq=False)
class Column:
    """Something that is equal to itself alone."""

    metres: tuple[float, ...] = ()


@frozen
class Key:
    """Something hashable."""

    name: str
    number: int = 1


def test_a_value_is_shown_as_a_dataclass_is() -> None:
    shown = repr(StandardPoint(east_m=1.0, names=["a"]))
    assert repr(Point(east_m=1.0, names=["a"])) == shown.removeprefix("Standard")


def test_equal_fields_are_equal_values_with_one_hash() -> None:
    assert Key(name="a") == Key(name="a", number=1)
    assert hash(Key(name="a")) == hash(Key(name="a", number=1))
    assert Key(name="a") != Key(name="a", number=2)
    other: object = ("a", 1)
    assert Key(name="a") != other


def test_a_field_that_is_not_compared_makes_no_difference() -> None:
    assert Point(east_m=1.0, note="here") == Point(east_m=1.0, note="there")


def test_a_list_in_a_value_makes_it_unhashable() -> None:
    with pytest.raises(TypeError, match="unhashable"):
        hash(Point(east_m=1.0))


def test_without_equality_a_value_is_equal_to_itself_alone() -> None:
    column = Column()
    assert column == column  # noqa: PLR0124 - that is the point
    assert column != Column()
    assert hash(column) == hash(column)


@pytest.mark.parametrize("name", ["east_m", "anything"])
def test_nothing_can_be_assigned_or_deleted(name: str) -> None:
    point = Point(east_m=1.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(point, name, 2.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        delattr(point, name)
    assert not hasattr(point, "__dict__")


def test_a_default_made_anew_is_not_shared() -> None:
    assert Point(east_m=1.0).names is not Point(east_m=1.0).names


def test_what_follows_from_the_fields_is_computed_once_made() -> None:
    assert Point(east_m=3.0, north_m=4.0).far_m == 7.0
    with pytest.raises(ValueError, match="west"):
        Point(east_m=-1.0)


@pytest.mark.parametrize("wrong", [{}, {"east_m": 1.0, "up_m": 2.0}])
def test_missing_and_unknown_fields_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(TypeError, match=r"Point.__init__\(\)"):
        Point(**wrong)


def test_fields_are_given_by_name_only() -> None:
    with pytest.raises(TypeError, match="positional"):
        Key("a")  # type: ignore[call-arg] # what is refused


def test_it_can_be_replaced_taken_apart_copied_and_stored() -> None:
    point = Point(east_m=1.0, names=["a"], note="here")
    assert dataclasses.replace(point, east_m=2.0).names == ["a"]
    assert [each.name for each in dataclasses.fields(Point)] == [
        each.name for each in dataclasses.fields(StandardPoint)
    ]
    assert dataclasses.asdict(point)["note"] == "here"
    for twin in (copy.copy(point), copy.deepcopy(point), pickle.loads(pickle.dumps(point))):
        assert twin == point
        assert twin.note == "here"
