"""What carries sorties off the tracks of their missions: gusts, and positions that are wrong."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.fleet.fleet import FaultKind
from planner.fleet.separation import home_above_m
from planner.fleet.swarm.distances import Approach, Kept, closest_of_chords
from planner.fleet.swarm.dynamics import DynamicsStack
from planner.fleet.swarm.faults import SwarmFaults
from planner.fleet.swarm.simulation import TICK_S
from planner.flight.pilot import make_pilot
from planner.service.swarm_dynamics import agent_dynamics
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import FloatArray
    from planner.fleet.fleet import Fleet
    from planner.fleet.separation import Member, Spacing
    from planner.service.fleet import FlownSortie

_CARRIES = {FaultKind.LOSES_POSITION, FaultKind.GUSTS}
_LOOK_S = 0.1
"""Between two looks places are taken to be on a straight line: at 4 m/s² they are within 1 cm of it. [s]"""


class Carried(Value, eq=False):
    """How far sorties are carried off the places they report, tick by tick."""

    time_s: FloatArray
    """(t,) [s]"""
    carried_m: FloatArray
    """(t, n, 2) [m]"""
    answered_m_s: FloatArray
    """The gusts that each flies against by then. (t, n, 2) [m s⁻¹]"""
    error_m: FloatArray
    """How far likely gusts carry each, which is known of the weather. (n,) [m]"""

    def off_m(self, row: int, time_s: FloatArray) -> FloatArray:
        """Return how far one is carried at times. (t, 2) [m]"""
        return _interpolated(time_s, self.time_s, self.carried_m[:, row])

    def against_m_s(self, row: int, time_s: FloatArray) -> FloatArray:
        """Return the gusts that one flies against at times. (t, 2) [m s⁻¹]"""
        return _interpolated(time_s, self.time_s, self.answered_m_s[:, row])


class CarriedApproach(NamedTuple):
    """Where two come nearest as they are carried."""

    kept: Kept
    is_too_near: bool


def _interpolated(at_s: FloatArray, time_s: FloatArray, columns: FloatArray) -> FloatArray:
    return np.column_stack([np.interp(at_s, time_s, one) for one in columns.T])


def predict_carried(
    fleet: Fleet, flown: Sequence[FlownSortie], *, until_s: float, seed: int
) -> Carried | None:
    """Return how far sorties with the starts they have are carried; ``None``: by nothing.

    Each from its take-off on, or since its fault began; on the ground afterwards it stays where it is.
    """
    faults = [one for one in fleet.faults.values() if one.kind in _CARRIES]
    if not faults:
        return None
    assessments = [one.assessment for one in flown]
    dynamics, heights_m = [], []
    for one in assessments:
        assert one is not None  # it flies
        dynamics.append(agent_dynamics(one.setup, make_pilot(one.setup, one.own_parameters))[0])
        flight = one.flight
        even_s = np.arange(0.0, flight.time_s, TICK_S)
        heights_m.append(float(np.median(flight.motion.state_at_time(even_s).height_m)))
    stack = DynamicsStack(dynamics, TICK_S)
    swarm = SwarmFaults(
        faults,
        [one.sortie.vehicle for one in flown],
        stack,
        height_m=np.array(heights_m),
        seed=seed,
        begins_s=np.array([one.start_s for one in flown]),
    )
    ends_s = np.array([one.end_s if one.lands else until_s for one in flown])
    count = int(np.ceil(min(float(ends_s.max()), until_s) / TICK_S)) + 1
    carried_m, answered_m_s = np.zeros((2, count + 1, len(flown), 2))
    for tick in range(1, count + 1):
        swarm.go_on(tick * TICK_S)
        is_up = (ends_s > (tick - 1) * TICK_S)[:, None]
        carried_m[tick] = np.where(is_up, swarm.carried_m, carried_m[tick - 1])
        answered_m_s[tick] = np.where(is_up, swarm.answered_m_s, 0.0)
    return Carried(
        time_s=np.asarray(TICK_S * np.arange(count + 1), np.float64),
        carried_m=carried_m,
        answered_m_s=answered_m_s,
        error_m=swarm.gust_error_m,
    )


def carried_approaches(
    members: Sequence[Member], carried: Carried | None, spacing: Spacing, until_s: float
) -> Iterator[tuple[tuple[int, int], CarriedApproach]]:
    """Yield where every two come nearest as they are carried, of those that are there while one flies."""
    if carried is None:
        return
    for pair in combinations(range(len(members)), 2):
        if members[pair[0]].vehicle == members[pair[1]].vehicle:
            continue
        found = _approach(members, pair, carried, spacing, until_s)
        if found is not None:
            yield pair, found


def _approach(
    members: Sequence[Member],
    pair: tuple[int, int],
    carried: Carried,
    spacing: Spacing,
    until_s: float,
) -> CarriedApproach | None:
    """Return where two come nearest as they are carried.

    Looked at every tenth of a second, and along straight lines between.  Who stands is in the way of one
    in the air; both near the ground are not compared, as by `mavjoule fleet check`.  ``None``: they are
    never there while one of them flies.
    """
    one, two = (members[row] for row in pair)
    begin_s, end_s = -np.inf, until_s
    for each in (one, two):
        begin_s = max(begin_s, each.start_s + each.trajectory.start_s[0])
        end_s = min(end_s, each.start_s + each.trajectory.end_s[-1])
    looks = [
        np.arange(np.floor(from_s / _LOOK_S), np.ceil(to_s / _LOOK_S) + 1.0)
        for each in (one, two)
        for from_s in [max(begin_s, each.start_s)]
        for to_s in [min(end_s, each.start_s + each.trajectory.duration_s)]
        if to_s > from_s
    ]
    if not looks:
        return None
    look = np.union1d(looks[0], looks[-1])
    time_s = _LOOK_S * look
    places, lows, errors_m = [], [], []
    for row, each in zip(pair, (one, two), strict=True):
        own_s = time_s - each.start_s
        place_m = each.trajectory.place_m(own_s)
        place_m[:, :2] += carried.off_m(row, time_s)
        at = each.trajectory.part_at(own_s)
        places.append(place_m)
        lows.append(each.trajectory.is_low[at])
        errors_m.append(each.trajectory.grown_m[at])
    away_m = places[1] - places[0]
    away_m[:, 2] += home_above_m(one, two)
    zone = spacing.zone(one, two)
    assert zone is not None  # of a fleet it is a cylinder
    required_m = zone.horizontal_m + errors_m[0] + errors_m[1]
    apart_m, part = closest_of_chords(away_m[:-1, :2], away_m[1:, :2])
    above_m = np.where(
        np.abs(away_m[:-1, 2]) < np.abs(away_m[1:, 2]), away_m[:-1, 2], away_m[1:, 2]
    )
    is_up = ~(lows[0] & lows[1])[:-1] & (np.diff(look) == 1.0)
    if not is_up.any():
        return None
    is_beside = is_up & (above_m < zone.over_m) & (-above_m < zone.under_m)
    is_near = is_beside & (apart_m < required_m[:-1])
    size_m = np.hypot(apart_m, above_m)
    chosen = is_near if is_near.any() else is_up
    least = int(np.where(chosen, size_m, np.inf).argmin())
    approach = Approach(
        first=one.file,
        second=two.file,
        distance_m=float(size_m[least]),
        time_s=float(time_s[least] + part[least] * (time_s[least + 1] - time_s[least])),
        above_m=abs(float(above_m[least])),
    )
    over_m = zone.over_m if above_m[least] >= 0.0 else zone.under_m
    return CarriedApproach(
        Kept(approach, float(required_m[least]), float(over_m)), bool(is_near.any())
    )
