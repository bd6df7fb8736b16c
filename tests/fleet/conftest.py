"""Every swarm of every test: each agent can stop at every step without coming too near to another's stop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from swarm_judge import assert_stops_are_free

from planner.fleet.swarm.simulation import Swarm

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.fleet.swarm.simulation import Meter, Step


@pytest.fixture(autouse=True)
def _stops_are_free(monkeypatch: pytest.MonkeyPatch) -> None:
    run = Swarm.run

    def judged(swarm: Swarm, meter: Meter | None = None) -> Iterator[Step]:
        disobeys = np.zeros(len(swarm.agents), np.bool_)
        for step in run(swarm, meter):
            assert_stops_are_free(swarm, disobeys)
            yield step

    monkeypatch.setattr(Swarm, "run", judged)
