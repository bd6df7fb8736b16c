"""The simulation of a swarm over time: as of a fleet, with what each agent is about."""

from __future__ import annotations

import math
from itertools import groupby, islice, pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.swarm.simulation import AgentPhase
from planner.service.fleet_pairs import MOST_PAIRS, PairDistance, shown_samples
from planner.service.fleet_timeline import (
    FleetTimeline,
    Span,
    TimelineMark,
    TimelineRow,
    energy_by_time,
    group_energy,
    thinned_track,
)
from planner.service.swarm_faults import SWARM_FAULT_HITS
from planner.service.swarm_findings import SWARM_SEPARATION

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.service.fleet_timeline import Energy, Track
    from planner.service.swarm import SwarmAgent, SwarmResult

_MOMENT_S = 5.0
"""A dot of a picture of half an hour, in which half-second decisions cannot be told apart. [s]"""
HELD = len(AgentPhase)
"""What an agent is about that flies, but not as it wants: beside its phases."""
EVENTS = {
    AgentPhase.WAITS: "waits on the ground",
    AgentPhase.CLIMBS: "climbs",
    AgentPhase.FLIES: "flies",
    AgentPhase.LANDS: "lands",
    AgentPhase.LANDED: "has landed",
    HELD: "gives way",
}
"""What an agent is about, in words."""
_USES = {AgentPhase.WAITS: "stand", HELD: "yield"}
"""Uses of spans that are no flight."""


def swarm_timeline(result: SwarmResult) -> FleetTimeline:
    """Return a simulation over time: tracks, power, distances of the closest pairs.

    Each agent is a vehicle with one sortie of the same name; the items of its track are its phases, and
    one beyond them while it gives way.

    Parameters
    ----------
    result : SwarmResult
        As `planner.simulate_fleet` returns it.
    """
    flown = [
        (row, one, one.flight) for row, one in enumerate(result.agents) if one.flight is not None
    ]
    energies = [
        None if one.energy_wh is None else energy_by_time(flight) for _, one, flight in flown
    ]
    end_s = float(math.ceil(max((one.start_s + one.time_s for _, one, _ in flown), default=0.0)))
    edge_s, used_wh = group_energy(
        end_s, list(zip((one.start_s for _, one, _ in flown), energies, strict=True))
    )
    tracks = tuple(
        _track(result, row, one, energy)
        for (row, one, _), energy in zip(flown, energies, strict=True)
    )
    rows = tuple(
        TimelineRow(kind="agent", name=one.name, spans=tuple(_spans(result, row, one)))
        for row, one, _ in flown
    )
    return FleetTimeline(
        end_s=end_s,
        frame=result.frame if flown else None,
        rows=rows,
        tracks=tracks,
        marks=tuple(_marks(result, rows, tracks)),
        edge_s=edge_s,
        used_wh=used_wh,
        pairs=tuple(islice(_pairs(result), MOST_PAIRS)),
        separation_m=result.separation_m,
    )


def _held(result: SwarmResult, row: int) -> tuple[FloatArray, IntArray]:
    """Return when what an agent is about changes, and to what. (n,) [s]

    Who gets what it wants for a moment, between two times it does not, gives way all the while.
    """
    record = result.record
    waits = record.waits[:, row].copy()
    edges = np.flatnonzero(np.diff(waits.astype(np.int8)))  # the last step before each change
    for begin, end in pairwise(edges.tolist()):
        if waits[begin] and record.begin_s[end + 1] - record.begin_s[begin + 1] < _MOMENT_S:
            waits[begin + 1 : end + 1] = True
    about = np.where(waits, HELD, record.phase[:, row])
    if record.has_landed[row]:
        about = np.append(about, AgentPhase.LANDED)
    changes = np.flatnonzero(np.diff(about, prepend=-1))
    return record.begin_s[changes], about[changes]


def _track(result: SwarmResult, row: int, agent: SwarmAgent, energy: Energy | None) -> Track:
    """Return where an agent was, thinned: beside its place in the plane by the steps of the simulation."""
    record, flight = result.record, agent.flight
    assert flight is not None  # it has flown
    end_s = agent.start_s + agent.time_s
    steps_s = record.begin_s[(record.begin_s > agent.start_s) & (record.begin_s < end_s)]
    segments_s = agent.start_s + np.minimum(flight.motion.segments.end_s, flight.time_s)
    time_s = np.unique(np.concatenate(([agent.start_s, end_s], steps_s, segments_s)))
    level_m = [np.interp(time_s, record.begin_s, one) for one in record.place_m[:, row].T]
    height_m = flight.motion.state_at_time(time_s - agent.start_s).height_m
    used_wh = np.full(len(time_s), np.nan)
    if energy is not None:
        used_wh = np.interp(time_s - agent.start_s, *energy)
    return thinned_track(
        time_s,
        np.column_stack((*level_m, height_m)),
        used_wh,
        names=(agent.name, agent.name),
        items=_held(result, row),
    )


def _spans(result: SwarmResult, row: int, agent: SwarmAgent) -> Iterator[Span]:
    """Yield when an agent flies, gives way, or waits on the ground until it may take off."""
    begins_s, about = _held(result, row)
    end_s = agent.start_s + agent.time_s
    uses = [
        (float(begin_s), _USES.get(kind, "flight"))
        for begin_s, kind in zip(begins_s, about.tolist(), strict=True)
        if kind != AgentPhase.LANDED
    ]
    parts = [next(same) for _, same in groupby(uses, key=lambda one: one[1])]
    nexts_s = [*(begin_s for begin_s, _ in parts[1:]), end_s]
    for (begin_s, use), until_s in zip(parts, nexts_s, strict=True):
        if until_s > begin_s:
            yield Span(use=use, start_s=begin_s, end_s=until_s, name="")  # the row has it


def _marks(
    result: SwarmResult, rows: tuple[TimelineRow, ...], tracks: tuple[Track, ...]
) -> Iterator[TimelineMark]:
    """Yield where agents came too near to each other."""
    approaches = {f"{one.first} and {one.second}: ": one for one in result.distances.nearest}
    found = [
        (finding, approaches[names])
        for finding in result.findings
        if finding.code in {SWARM_SEPARATION.code, SWARM_FAULT_HITS.code}
        for names in approaches
        if finding.message.startswith(names)
    ]
    track_of = {one.vehicle: one for one in tracks}
    for finding, approach in sorted(found, key=lambda pair: pair[1].time_s):
        names = approach.first, approach.second
        yield TimelineMark(
            finding=finding,
            at_s=approach.time_s,
            sorties=names,
            rows=tuple(number for number, one in enumerate(rows) if one.name in names),
            place_m=track_of[names[0]].place_at(approach.time_s)[:2],
        )


def _pairs(result: SwarmResult) -> Iterator[PairDistance]:
    """Yield how far agents are apart over time, both in the air, the nearest first."""
    record = result.record
    row_of = {one.name: row for row, one in enumerate(result.agents)}
    flies = (record.phase > AgentPhase.WAITS) & (record.phase < AgentPhase.LANDED)
    for approach in result.distances.nearest:
        first, second = row_of[approach.first], row_of[approach.second]
        there = flies[:, first] & flies[:, second]
        if not there.any():  # one stood where the other began or ended
            continue
        there = np.append(there, False) | np.append(False, there)
        between_m = record.place_m[:, first] - record.place_m[:, second]
        if record.height_m is not None:
            above_m = record.height_m[:, first] - record.height_m[:, second]
            between_m = np.column_stack((between_m, above_m))
        away_m = np.linalg.norm(between_m, axis=1)
        chosen, part = shown_samples(np.where(there, away_m, np.nan))
        yield PairDistance(
            first=approach.first,
            second=approach.second,
            time_s=record.begin_s[chosen],
            planned_m=away_m[chosen],
            may_m=away_m[chosen],
            part=part,
            least_s=approach.time_s,
            least_m=approach.distance_m,
        )
