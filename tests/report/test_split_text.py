"""Which items a part of a split mission flies, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import pytest

from planner.report.split import flown_text
from planner.service.split import SplitPart

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult


def part(first: int, last: int, begins_m: float | None, ends_m: float | None) -> SplitPart:
    return SplitPart(
        file="1.plan",
        text="",
        result=cast("CheckResult", None),  # the words tell nothing of it
        first_item=first,
        last_item=last,
        begins_m=begins_m,
        ends_m=ends_m,
        flown_twice_m=0.0,
        first_own_item=1,
        last_own_item=1,
    )


@pytest.mark.parametrize(
    ("begins_m", "ends_m", "text"),
    [
        (None, None, "items 7 to 9"),
        (120.0, None, "items 7 (from 120 m) to 9"),
        (120.0, 40.0, "items 7 (from 120 m) to 9 (up to 40 m)"),
        # What an overlap as long as the leg leaves of it, and a rounding of that.
        (0.0, None, "items 7 to 9"),
        (1e-12, 40.0, "items 7 to 9 (up to 40 m)"),
        (0.04, None, "items 7 to 9"),
        (0.06, None, "items 7 (from 0.1 m) to 9"),
    ],
)
def test_a_leg_is_told_from_where_it_is_taken_up(
    begins_m: float | None, ends_m: float | None, text: str
) -> None:
    assert flown_text(part(7, 9, begins_m, ends_m)) == text


def test_one_item_is_told_once() -> None:
    assert flown_text(part(7, 7, 0.0, 30.0)) == "item 7 (up to 30 m)"
