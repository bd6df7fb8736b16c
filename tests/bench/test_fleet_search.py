"""Long searches for what is wrong with plans: ``make bench`` runs them; a few of each are tests."""

from __future__ import annotations

import math

import numpy as np
import pytest
from made_schedules import brute_force, faults, random_fleet

from planner.fleet.schedule import Objective, best_schedule

pytestmark = pytest.mark.bench

FLEETS = 200
ALL = 3
"""Sorties of which every order is tried; of more, so many of them. """
DRAWS = 4000


def test_no_drawn_order_of_a_small_fleet_is_better_than_the_schedule() -> None:
    """The issue asks for 200 fleets of up to 6 sorties, 3 vehicles and 4 packs."""
    better = 0
    for seed in range(FLEETS):
        rng = np.random.default_rng(seed)
        sorties = 1 + seed % 6
        tasks, means, conflicts = random_fleet(rng, sorties=sorties)
        draws = None if sorties <= ALL else (rng, DRAWS)
        least = brute_force(tasks, means, conflicts, draws=draws)
        for objective in Objective:
            made = best_schedule(tasks, means, conflicts, minimize=objective)
            if made is None:
                assert objective not in least, (seed, objective)
                continue
            assert faults(made, tasks, means, conflicts) == [], (seed, objective)
            assert made.amount(objective) <= least.get(objective, math.inf) + 1e-6, seed
            assert made.bound <= made.amount(objective) + 1e-6, seed
            better += made.amount(objective) < least.get(objective, math.inf) - 1e-6
    print(f"\n{FLEETS} fleets: never worse than brute force, better in {better} of {4 * FLEETS}")
