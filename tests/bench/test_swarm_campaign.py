"""Drawn swarms and missions: no separation lost, every deadlock resolved or reported: ``make bench``.

Separation is judged by the traces alone (`tests/swarm_judge.py`).
"""

from __future__ import annotations

import os
from collections import Counter

import pytest
from made_swarm import drawn_missions, simulated
from swarm_judge import JUDGED_TO_M, judged_swarm, least_of_flights_m

pytestmark = pytest.mark.bench

COUNT = int(os.environ.get("SCENARIOS", "40"))
"""A thousand drawn swarms take 25 min on one core, as many drawn missions two hours."""


def test_drawn_missions_keep_apart_and_land_or_are_reported() -> None:
    deadlocks = 0
    for seed in range(COUNT):
        tables, missions = drawn_missions(seed)
        flown = simulated(tables, policy="stop", **missions)
        simulated.cache_clear()
        codes = {one.code for one in flown.findings}
        assert "S128" not in codes, seed
        # 10 m, and 2.5 m of each
        assert least_of_flights_m(flown, above_m=10.0) >= 15.0 - JUDGED_TO_M, seed
        assert all(one.has_landed for one in flown.agents) or "S129" in codes, seed
        deadlocks += "S129" in codes
    print(f"{COUNT} fleets as filed: {deadlocks} with a deadlock, all reported")


def test_drawn_swarms_keep_apart_and_land_or_are_reported() -> None:
    ends = Counter(judged_swarm(seed, most=30) for seed in range(COUNT))
    print(f"{COUNT} drawn swarms: {', '.join(f'{count} {end}' for end, count in ends.items())}")
