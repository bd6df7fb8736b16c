"""Two checks side by side: two missions, or one with two vehicles or under two conditions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.flight.motion.kinematics import STATES
from planner.mission.files import read_mission
from planner.presented import Presented
from planner.service.preflight import bugs_of, check_mission
from planner.values import Value

if TYPE_CHECKING:
    from pathlib import Path

    from planner.findings import Finding
    from planner.flight.motion.kinematics import FlightState
    from planner.service.preflight import CheckResult
    from planner.setup import Setup


class StateShare(Value):
    """What one state takes of a flight."""

    count: int
    time_s: float
    distance_m: float
    energy_wh: float | None
    """``None`` where the power is not known. [Wh]"""


class Comparison(Presented):
    """Two checks side by side; every difference is the second less the first."""

    a: CheckResult
    b: CheckResult
    states: tuple[tuple[FlightState, StateShare, StateShare], ...]
    """Each state that one of them flies, with what it takes of the first and of the second."""
    gained: tuple[Finding, ...]
    """Findings of the second whose code, as bad, the first does not have."""
    lost: tuple[Finding, ...]
    """Findings of the first whose code, as bad, the second does not have."""

    @property
    def time_s(self) -> float:
        """Difference of the times. [s]"""
        return self.b.totals.time_s - self.a.totals.time_s

    @property
    def distance_m(self) -> float:
        """Difference of the distances. [m]"""
        return self.b.totals.distance_m - self.a.totals.distance_m

    @property
    def energy_wh(self) -> float | None:
        """Difference of the energies; ``None`` where one is not known. [Wh]"""
        return _difference(self.a.totals.energy_wh, self.b.totals.energy_wh)

    @property
    def margin_wh(self) -> float | None:
        """Difference of what is left above the reserve; ``None`` with no battery. [Wh]"""
        a, b = self.a.battery, self.b.battery
        return None if a is None or b is None else _difference(a.margin_wh, b.margin_wh)

    @property
    def return_margin_wh(self) -> float | None:
        """Difference of what is left above the reserve on the tightest return. [Wh]"""
        a, b = self.a.return_plan, self.b.return_plan
        return None if a is None or b is None else _difference(a.margin_wh, b.margin_wh)


def compare_results(a: CheckResult, b: CheckResult) -> Comparison:
    """Return two results of `planner.check` side by side."""
    states = [(state, _share(a, state), _share(b, state)) for state in STATES]
    known, kept = ({(one.code, one.severity) for one in result.findings} for result in (a, b))
    return Comparison(
        a=a,
        b=b,
        states=tuple(row for row in states if row[1].count or row[2].count),
        gained=tuple(one for one in b.findings if (one.code, one.severity) not in known),
        lost=tuple(one for one in a.findings if (one.code, one.severity) not in kept),
    )


def compare_files(
    path_a: Path | str, setup_a: Setup, path_b: Path | str, setup_b: Setup
) -> Comparison:
    """Read two missions, check each under its own setup, and return both side by side.

    Raises InputError or UsageError if a mission or a setup is unusable.
    """
    results = []
    for path, setup in ((path_a, setup_a), (path_b, setup_b)):
        with bugs_of(str(path)):
            results.append(check_mission(read_mission(path), setup))
    return compare_results(*results)


def _share(result: CheckResult, state: FlightState) -> StateShare:
    segments = [segment for segment in result.segments if segment.state is state]
    energy_wh = math.fsum(segment.energy_wh for segment in segments)
    return StateShare(
        count=len(segments),
        time_s=math.fsum(segment.duration_s for segment in segments),
        distance_m=math.fsum(segment.distance_m for segment in segments),
        energy_wh=energy_wh if math.isfinite(energy_wh) else None,
    )


def _difference(a: float | None, b: float | None) -> float | None:
    if a is None or b is None or not math.isfinite(b - a):
        return None
    return b - a
