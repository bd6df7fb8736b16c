"""Results of checks on their way to another process: small, as what is predicted is predicted again.

A result is 99 parts in a hundred its flight, which follows from mission and setup to the last bit.  What
travels is the verdict with its figures and findings, and what the flight was predicted from.
"""

from __future__ import annotations

import pickle
import zlib
from functools import cached_property
from itertools import starmap
from typing import TYPE_CHECKING, Any, TypeAlias

import msgspec
from msgspec.structs import astuple

from planner.findings import Place
from planner.flight.pilot import NOISE_ASSUMED
from planner.flight.prediction import sample_trace
from planner.mission.items import Mission, MissionItem
from planner.service.preflight import CheckResult, assess
from planner.service.preparation import prepare
from planner.values import Value, field_names, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.flight.prediction import ItemArrival, Segment, Trace
    from planner.rules.assessment import Assessment
    from planner.setup import Setup

_PREDICTED = frozenset({"segments", "items", "trace", "assessment"})
_No: TypeAlias = float | None
_Row: TypeAlias = tuple[
    int, int, _No, _No, _No, _No, _No, _No, _No, bool, int | None, Place | None, _No
]
"""The fields of a mission's item, in their order."""


class Recipe(Value, eq=False):
    """What a flight was predicted from."""

    mission: Mission
    """Without its items, and without its file: it is flown again, not written back."""
    items: bytes
    setup: Setup


class ShippedResult(CheckResult, eq=False, dict=True):
    """A result from another process: flown again where its segments, items or assessment are looked at."""

    recipe: Recipe

    @cached_property
    def _again(self) -> Assessment:
        rows = msgspec.msgpack.decode(self.recipe.items, type=list[_Row])
        mission = replace(self.recipe.mission, items=tuple(starmap(MissionItem, rows)))
        assessment = assess(prepare(mission, self.recipe.setup))
        assert assessment is not None  # only what was flown has a recipe
        return assessment

    def __reduce__(self) -> tuple[Callable[..., CheckResult], tuple[object, ...]]:
        """Return how it travels on, with nothing predicted for that."""
        return _unpacked, (_packed_fields(self, recipe=self.recipe),)

    @property  # type: ignore[misc] # stands for the field
    def segments(self) -> Sequence[Segment]:
        """As of `CheckResult`."""
        return self._again.flight.segments

    @property  # type: ignore[misc] # stands for the field
    def items(self) -> tuple[ItemArrival, ...]:
        """As of `CheckResult`."""
        return self._again.items

    @property  # type: ignore[misc] # stands for the field
    def assessment(self) -> Assessment:
        """As of `CheckResult`."""
        return self._again

    @property  # type: ignore[misc] # stands for the field
    def trace(self) -> Trace | None:
        """As of `CheckResult`."""
        again = self._again
        return sample_trace(again.flight, again.route) if self.setup.with_trace else None


def packed(result: CheckResult) -> tuple[Callable[..., CheckResult], tuple[object, ...]]:
    """Return how a result travels, as of ``object.__reduce__``."""
    assessment = result.assessment
    if assessment is None:
        return _whole, (field_values(result),)
    setup = assessment.setup
    if any(one.code == NOISE_ASSUMED.code for one in assessment.findings):
        setup = replace(setup, position_noise_m=None)  # it is assumed, and said to be, again
    recipe = Recipe(
        mission=replace(assessment.mission, items=(), document=None),
        items=msgspec.msgpack.encode([*map(astuple, assessment.mission.items)], enc_hook=float),
        setup=setup,
    )
    return _unpacked, (_packed_fields(result, recipe=recipe),)


def _packed_fields(result: CheckResult, *, recipe: Recipe) -> bytes:
    names = [name for name in field_names(CheckResult) if name not in _PREDICTED]
    found = {name: getattr(result, name) for name in names} | {"recipe": recipe}
    # At its lowest level: a higher one takes five times as long for a fifth less.
    return zlib.compress(pickle.dumps(found, pickle.HIGHEST_PROTOCOL), 1)


def _whole(fields: dict[str, Any]) -> CheckResult:
    return CheckResult(**fields)


def _unpacked(data: bytes) -> ShippedResult:
    predicted: dict[str, Any] = dict.fromkeys(_PREDICTED)  # its properties stand for them
    return ShippedResult(**predicted, **pickle.loads(zlib.decompress(data)))
