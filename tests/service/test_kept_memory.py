"""Memory that one check is done with is there for the next."""

from __future__ import annotations

import platform
import subprocess
import sys
from pathlib import Path

import pytest

COUNT_FAULTS = """
import resource
from long_missions import plan
from planner.mission.files import read_mission_bytes
from planner.service.preflight import check
from planner.vehicle.library import load_vehicle

mission = read_mission_bytes(plan(1_000).encode(), source="long.plan")
vehicle = load_vehicle("px4-quad-2kg")
faults = []
for _ in range(4):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    check(mission, vehicle)
    faults.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
print(faults[-1])
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of glibc alone")
def test_a_further_check_takes_no_new_pages_of_memory() -> None:
    tests = Path(__file__).parents[1]
    run = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tests)!r})\n{COUNT_FAULTS}"]
    done = subprocess.run(run, capture_output=True, text=True, check=True)
    # 6,000 where each array's pages are given back; a few hundred are the collector's and the objects'
    assert int(done.stdout) < 500
