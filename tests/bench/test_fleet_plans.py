"""Plans of drawn fleets judged by other code: ``make bench`` looks at many, the tests at a few."""

from __future__ import annotations

import pytest
from judged_plans import faults, planned_fleet

from planner.fleet.schedule import Objective

pytestmark = pytest.mark.bench

FLEETS = 100


def test_nothing_is_wrong_with_the_plans_of_drawn_fleets() -> None:
    none = []
    for seed in range(FLEETS):
        for minimize in Objective:
            result = planned_fleet(seed, minimize)
            if isinstance(result, str):
                none.append((seed, result))
            else:
                assert faults(result) == [], (seed, minimize)
    print(f"\n{FLEETS} fleets, four objectives: nothing wrong; no plan of {len(none)}: {none}")
