"""Fleets judged again by samples of all tracks: ``make bench`` looks at many, the tests at a few."""

from __future__ import annotations

import pytest
from sampled_fleet import drawn_fleet, misjudged

pytestmark = pytest.mark.bench

FLEETS = 200


def test_no_separation_of_drawn_fleets_is_missed_by_a_centimetre() -> None:
    conflicts = 0
    for seed in range(FLEETS):
        result = drawn_fleet(seed)
        conflicts += any(one.finding.code in {"S101", "S114"} for one in result.findings)
        assert misjudged(result) == [], seed
    print(f"\n{FLEETS} fleets at 20 Hz, {conflicts} of them with conflicts: none judged otherwise")
