"""Drawn swarms, judged by their traces: `tests/bench/test_swarm_campaign.py` draws a thousand."""

from __future__ import annotations

import pytest
from swarm_judge import judged_swarm


@pytest.mark.parametrize("seed", range(12))
def test_no_drawn_swarm_loses_its_separation(seed: int) -> None:
    assert judged_swarm(seed, most=5) == "landed"
