"""Drawn swarms and missions: no separation lost, every deadlock resolved or reported: ``make bench``."""

from __future__ import annotations

import os

import numpy as np
import pytest
from made_swarm import SEPARATION_M, drawn_missions, drawn_swarm, least_m, simulated

from planner.fleet.swarm.policies import OrcaStop, StopInTime

pytestmark = pytest.mark.bench

COUNT = int(os.environ.get("SCENARIOS", "40"))
"""A thousand take two hours on one core."""


def test_drawn_missions_keep_apart_and_land_or_are_reported() -> None:
    deadlocks = 0
    for seed in range(COUNT):
        tables, missions = drawn_missions(seed)
        flown = simulated(tables, policy="stop", **missions)
        simulated.cache_clear()
        codes = {one.code for one in flown.findings}
        assert "S128" not in codes, seed
        assert all(one.has_landed for one in flown.agents) or "S129" in codes, seed
        deadlocks += "S129" in codes
    print(f"{COUNT} fleets as filed: {deadlocks} with a deadlock, all reported")


def test_drawn_swarms_keep_apart() -> None:
    deadlocks = 0
    for seed in range(COUNT):
        policy = (StopInTime(), OrcaStop())[seed % 2]
        swarm = drawn_swarm(seed, policy, most=30)
        places_m, zones_m = least_m(swarm)
        assert places_m >= SEPARATION_M - 1e-9, seed
        assert zones_m >= SEPARATION_M - 1e-9, seed
        assert swarm.has_landed.all() or swarm.deadlock or np.isclose(swarm.time_s, 900.0), seed
        deadlocks += bool(swarm.deadlock)
    print(f"{COUNT} drawn swarms: {deadlocks} with a deadlock, all reported")
