"""What tests of missions share: MAVSDK's importers, made once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from mavsdk_importers import mavsdk_importers

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from mavsdk.plugins.mission_raw import MissionRaw

    from planner.autopilot import Autopilot


@pytest.fixture(scope="session")
def importers() -> Iterator[Mapping[Autopilot, MissionRaw]]:
    """An importer for a vehicle of each autopilot."""
    with mavsdk_importers() as made:
        yield made
