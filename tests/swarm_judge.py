"""How near agents come to each other, by their traces alone: at 20 Hz, and finer at each least distance.

Nothing of `planner.fleet.swarm.distances`, of zones or of closest approaches is used: places between
the steps of a trace are those of the cubic through places and velocities at both ends.  With steps of 0.5 s
and the fastest drawn answers that is right to 2 cm.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from made_swarm import SEPARATION_M, drawn_swarm

from planner.fleet.fleet import Fault, FaultKind
from planner.fleet.swarm.flights import Record
from planner.fleet.swarm.policies import OrcaStop, StopInTime
from planner.fleet.swarm.simulation import AgentPhase

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.fleet.swarm.simulation import Swarm
    from planner.service.swarm import SwarmResult

JUDGED_TO_M = 0.02
_STEP_S = 0.05
_LOW_M = 2.5
"""Below this height a vehicle stands, takes off or lands. [m]"""


def least_distance_m(record: Record) -> float:
    """Return the least distance of any two in the air. [m]"""
    time_s = np.arange(record.begin_s[0], record.begin_s[-1], _STEP_S)
    place_m = _places_m(record, time_s)
    step = np.searchsorted(record.begin_s, time_s, side="right") - 1
    phase = record.phase[np.minimum(step, len(record.phase) - 1)]
    flies = (phase != AgentPhase.WAITS) & (phase != AgentPhase.LANDED)
    return min(
        (
            _least_m(record, (one, two), time_s, flies[:, one] & flies[:, two], place_m)
            for one, two in combinations(range(flies.shape[1]), 2)
        ),
        default=np.inf,
    )


def _least_m(
    record: Record, pair: tuple[int, int], time_s: FloatArray, both: BoolArray, place_m: FloatArray
) -> float:
    """Return the least distance of two where both fly, looked at closer where it is least."""
    if not both.any():
        return np.inf
    one, two = pair
    away_m = np.where(both, np.hypot(*(place_m[:, one] - place_m[:, two]).T), np.inf)
    at = int(away_m.argmin())
    close_s = np.linspace(time_s[max(at - 1, 0)], time_s[min(at + 1, len(time_s) - 1)], 41)
    close_m = _places_m(record, close_s)
    closer_m = float(np.hypot(*(close_m[:, one] - close_m[:, two]).T).min())
    # what is flown before both are in the air, or after, does not count
    is_inside = 0 < at < len(both) - 1 and both[at - 1] and both[at + 1]
    return min(closer_m, float(away_m[at])) if is_inside else float(away_m[at])


def _places_m(record: Record, time_s: FloatArray) -> FloatArray:
    step = np.clip(
        np.searchsorted(record.begin_s, time_s, side="right") - 1, 0, len(record.begin_s) - 2
    )
    width_s = np.diff(record.begin_s)[step][:, None, None]
    part = (time_s - record.begin_s[step])[:, None, None] / width_s
    begin, end = record.place_m[step], record.place_m[step + 1]
    leaves, comes = record.velocity_m_s[step] * width_s, record.velocity_m_s[step + 1] * width_s
    # Hermite
    return np.asarray(
        (2.0 * part**3 - 3.0 * part**2 + 1.0) * begin
        + (part**3 - 2.0 * part**2 + part) * leaves
        + (3.0 * part**2 - 2.0 * part**3) * end
        + (part**3 - part**2) * comes
    )


def least_of_flights_m(flown: SwarmResult, *, above_m: float) -> float:
    """Return the least level distance of any two flights while neither is so far above the other. [m]

    Taken of the flights themselves, which are those of `planner.check_mission` with holds in them.
    """
    flights = [
        (one.start_s, one.flight, pad_m)
        for one, pad_m in zip(flown.agents, flown.record.place_m[0], strict=True)
        if one.flight is not None  # it never took off
    ]
    end_s = max((start_s + flight.time_s for start_s, flight, _ in flights), default=0.0)
    time_s = np.arange(0.0, end_s, _STEP_S)
    places, is_up = [], []
    for start_s, flight, pad_m in flights:
        place_m = flight.motion.state_at_time(np.clip(time_s - start_s, 0.0, flight.time_s)).place_m
        places.append(place_m + np.append(pad_m, 0.0))
        is_up.append((time_s >= start_s) & (place_m[:, 2] > _LOW_M))
    least_m = np.inf
    for one, two in combinations(range(len(places)), 2):
        away_m = places[one] - places[two]
        near = is_up[one] & is_up[two] & (np.abs(away_m[:, 2]) < above_m)
        if near.any():
            least_m = min(least_m, float(np.hypot(*away_m[near, :2].T).min()))
    return least_m


def judged_swarm(seed: int, *, most: int) -> str:
    """Fly a drawn swarm, every third in gusts; return how it ended. It keeps apart."""
    policy = (StopInTime(), OrcaStop())[seed % 2]
    wind_m_s = float(np.random.default_rng((seed, 1)).uniform(0.0, 5.0))
    gusts = [Fault(kind=FaultKind.GUSTS, wind_m_s=wind_m_s)] if seed % 3 == 0 else []
    swarm = drawn_swarm(seed, policy, *gusts, most=most)
    steps = [*swarm.run()]
    least_m = least_distance_m(Record.of(steps, swarm))
    assert least_m >= SEPARATION_M - JUDGED_TO_M, f"seed {seed}: {least_m:.2f} m apart"
    if swarm.has_landed.all():
        return "landed"
    assert swarm.deadlock, f"seed {seed}: in the air after {swarm.time_s:.0f} s, nobody named"
    return "with a deadlock reported"


def assert_stops_are_free(swarm: Swarm, disobeys: BoolArray) -> None:
    """Assert that every two agents in the air that were told to stop now would keep apart until they stand.

    By their motion itself, told to stop and followed tick by tick, wherever each is on its way when: nothing
    of zones is asked for.  Who keeps its command or is told late has been in ``disobeys`` ever since.

    Parameters
    ----------
    swarm : Swarm
    disobeys : ndarray of bool
        Changed here. (n,)
    """
    if not swarm.keeps_apart:
        return
    disobeys |= swarm.disobeys
    there = np.flatnonzero(swarm.is_there & ~disobeys)
    if len(there) < 2:
        return
    ways = swarm.stop_ways_m()[there]
    middle, size = 0.5 * (ways.min(axis=1) + ways.max(axis=1)), np.ptp(ways, axis=1)
    reach_m = 0.5 * np.hypot(*size.T)
    one, two = np.triu_indices(len(there), 1)
    gap_m = np.hypot(*(middle[one] - middle[two]).T) - reach_m[one] - reach_m[two]
    near = gap_m < SEPARATION_M
    for first, second in zip(one[near].tolist(), two[near].tolist(), strict=True):
        apart = ways[first][:, None] - ways[second][None]
        least_m = float(np.sqrt((apart**2).sum(axis=2).min()))
        names = [swarm.agents[there[row]].name for row in (first, second)]
        assert least_m >= SEPARATION_M - JUDGED_TO_M, f"{names} at {swarm.time_s} s: {least_m} m"
