"""The sorties of a fleet simulated as filed: each flies its mission, and the later one gives way."""

from __future__ import annotations

import math
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.fleet.approach import closest_approach
from planner.fleet.fleet import LATEST_S, FaultKind, Separation
from planner.fleet.separation import (
    are_heights_known,
    home_above_m,
    predict_approach,
    predict_conflicts,
)
from planner.fleet.swarm.distances import WITHIN, Approach, Distances, Kept
from planner.fleet.swarm.flights import Record
from planner.fleet.swarm.simulation import TICK_S, AgentPhase
from planner.fleet.swarm.yielding import LateLink, Passage, Traveller, Wait, Yielding
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.service.fleet import SortieChecks, fly_sorties
from planner.service.fleet_separation import fleet_spacing, members
from planner.service.fleet_times import carried_m, carry_s, stands
from planner.service.preflight import UnreadableMission
from planner.service.separation import why_left_out
from planner.service.swarm_carried import Carried, carried_approaches, predict_carried
from planner.service.swarm_sorties import StoppedSorties
from planner.service.swarm_vehicles import PadStay
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.fleet.approach import ClosestApproach
    from planner.fleet.fleet import Fleet
    from planner.fleet.separation import Member
    from planner.fleet.trajectory import Trajectory
    from planner.geo.geodesy import LocalFrame
    from planner.service.fleet import FlownSortie

_MOST_STEPS = 20_000
"""Steps of a record: half a second each in an operation of up to 2.8 hours. [-]"""
_ALONE_M = 10.0
"""Separation of a vehicle alone, which nothing depends on. [m]"""
_STOOD_S = 60.0
"""For so long those that cannot get on are followed when all others have landed. [s]"""
_TAKEOFF, _LAND = STATE_INDEX[FlightState.TAKEOFF], STATE_INDEX[FlightState.LAND]


class FiledFlights(Value, eq=False):
    """The sorties of a fleet as they were flown in a simulation, and how near they came to each other."""

    sorties: tuple[FlownSortie, ...]
    """With the flights and starts they had."""
    too_near: tuple[Kept, ...]
    """Distance required of every two that come too near to each other, and where they do. [m]"""
    incomparable: tuple[str, ...]
    """What is said of pairs whose heights cannot be compared."""
    distances: Distances
    record: Record
    frame: LocalFrame
    waits: tuple[tuple[Wait, ...], ...]
    """Of each, where it did not get on."""
    stops: tuple[int, ...]
    """How often each was told to stop."""
    stays: tuple[PadStay, ...]
    """When each was on the ground, or so low that it counts as on it, before and after its flight."""
    uncharged: tuple[str, ...] = ()
    """What is said of packs that come back later than planned, and are flown again."""
    deadlock: tuple[str, ...] = ()
    """Those that could not get on at the end."""
    is_cut_short: bool = False


def fly_giving_way(
    fleet: Fleet,
    flown: Sequence[FlownSortie],
    *,
    until_s: float,
    seed: int = 0,
    on_event: Callable[[float], None] | None = None,
) -> FiledFlights:
    """Return the sorties of a fleet, each of which stops in time for those that go first.

    The job of higher priority goes first, then who stands first in the file.  Likely gusts are known of the
    weather, so zones are wider by what they carry.
    """
    separation = fleet.separation or Separation(horizontal_m=_ALONE_M)
    carried = predict_carried(fleet, flown, until_s=0.0, seed=seed)
    sorties = StoppedSorties(
        fleet, separation, flown, None if carried is None else carried.error_m.tolist()
    )
    names = list(fleet.sorties)
    order = sorted(
        range(len(flown)),
        key=lambda row: (-fleet.jobs[flown[row].sortie.job].priority, names.index(flown[row].name)),
    )
    last: dict[str, int] = {}
    agents = []
    for row, one in enumerate(flown):
        after = last.get(one.sortie.vehicle)
        away_m = 0.0 if after is None else carried_m(flown[after], one)
        agents.append(
            Traveller(
                sorties.tracks[row],
                one.start_s,
                order.index(row),
                after=after,
                after_s=fleet.swap_s + carry_s(fleet, away_m),
                deaf_s=_deaf_s(fleet, one.sortie.vehicle),
                link=_link(fleet, one.sortie.vehicle),
            )
        )
        last[one.sortie.vehicle] = row
    yielding = Yielding(agents, sorties, sorties.keeps)
    is_cut_short = False
    try:
        yielding.run(until_s, on_event)
    except KeyboardInterrupt:
        is_cut_short = True
    stuck = yielding.stuck
    ends_s = [one.track.time_s[np.isfinite(one.track.time_s)][-1] for one in agents]
    end_s = until_s if until_s < LATEST_S else max(float(max(ends_s)), yielding.time_s) + _STOOD_S
    if is_cut_short:
        end_s = yielding.time_s
    ended, waits = [], []
    for row, agent in enumerate(agents):
        has_started = agent.passage is not Passage.WAITS
        ended.append(
            sorties.ended(
                row,
                agent.start_s if has_started else end_s + 1.0,
                end_s if agent.passage is Passage.STANDS else None,
            )
        )
        last_wait = [Wait(agent.stood_s, end_s)] if row in stuck and agent.stood_s < end_s else []
        waits.append((*agent.waits, *last_wait))
    found = flown_together(
        fleet,
        ended,
        until_s=end_s if stuck or is_cut_short else until_s,
        is_planned=False,
        seed=seed,
    )
    record = found.record
    at_s = record.begin_s[:-1]
    for row, own in enumerate(waits):
        for begin_s, stop_s in own:
            record.waits[(at_s >= begin_s) & (at_s < stop_s), row] = True
    late = [
        (old, new)
        for old, new in zip(flown, ended, strict=True)
        if old.sortie.pack is not None and new.end_s > old.end_s
    ]
    return replace(
        found,
        uncharged=tuple(
            f"{next_.name}: the charge of pack {next_.sortie.pack} is not known, which comes back "
            f"{quantity.duration(new.end_s - old.end_s)} later from {old.name}"
            for old, new in late
            for next_ in flown
            if next_.sortie.pack == old.sortie.pack and next_.start_s > old.start_s
        ),
        waits=tuple(waits),
        stops=tuple(one.stops for one in agents),
        deadlock=tuple(
            flown[row].name
            for row in stuck
            if agents[row].stood_s < end_s and not is_cut_short and end_s < until_s
            if not agents[row].is_deaf(end_s)  # else it waits for nobody
        ),
        is_cut_short=is_cut_short,
    )


def _deaf_s(fleet: Fleet, vehicle: str) -> tuple[float, float]:
    """Return from when until when a vehicle hears no command."""
    for one in fleet.faults.values():
        if one.kind is FaultKind.KEEPS_COMMAND and one.vehicle == vehicle:
            return one.at_s, one.at_s + (math.inf if one.lasts_s is None else one.lasts_s)
    return math.inf, math.inf


def _link(fleet: Fleet, vehicle: str) -> LateLink | None:
    """Return how late a vehicle does what it has to do for others."""
    for one in fleet.faults.values():
        if one.kind is FaultKind.LINK_LATE and one.vehicle == vehicle:
            assert one.late_s is not None  # the table sees to it
            lasts_s = math.inf if one.lasts_s is None else one.lasts_s
            return LateLink(one.at_s, one.at_s + lasts_s, one.late_s)
    return None


def planned_sorties(fleet: Fleet) -> tuple[FlownSortie, ...]:
    """Return every sortie of a fleet with its check.

    Raises UsageError if there is none, or one has nothing to fly.
    """
    if not fleet.sorties:
        msg = (
            f"{fleet.source}: nothing to simulate: it has no table [swarm] and no sortie "
            "(mavjoule fleet plan writes them)"
        )
        raise UsageError(msg)
    flown, _ = fly_sorties(fleet, SortieChecks(fleet))
    for one in flown:
        if one.time_s <= 0.0:
            msg = f"{fleet.source}: sortie.{one.name} {why_left_out(one.result)}"
            if isinstance(one.result, UnreadableMission):
                msg += f": {one.result.file}: {one.result.findings[0].message}"
            raise UsageError(msg)
    return flown


def flown_together(
    fleet: Fleet, flown: Sequence[FlownSortie], *, until_s: float, is_planned: bool, seed: int
) -> FiledFlights:
    """Return how near sorties come to each other.

    Parameters
    ----------
    fleet : Fleet
    flown : sequence of FlownSortie
        With the flights and starts they have.
    until_s : float
        When the simulation ends at the latest. [s]
    is_planned : bool
        Whether starts and times are those of the plan, which may come sooner or later as
        `mavjoule fleet check` has it; else they are what happened.
    seed : int
        Of what carries them off their tracks.
    """
    separation = fleet.separation or Separation(horizontal_m=_ALONE_M)
    all_ = members(fleet, separation, flown)
    spacing = fleet_spacing(separation)
    happened = [replace(one, trajectory=_on_time(one.trajectory), own=None) for one in all_]
    if not is_planned:
        all_, spacing = happened, replace(spacing, start_error_s=0.0)
    conflicts = {
        (one.first, one.second): predict_approach(*one.sides, spacing) or one.approach
        for one in predict_conflicts(all_, spacing)
        if max(all_[one.first].start_s, all_[one.second].start_s) <= until_s
    }
    approaches = {pair: _approach_of(all_, pair, approach) for pair, approach in conflicts.items()}
    within_m = WITHIN * fleet.widest_separation_m
    for pair in combinations(range(len(all_)), 2):
        one, two = (happened[row] for row in pair)
        has_started = max(one.start_s, two.start_s) <= until_s
        if pair in approaches or one.vehicle == two.vehicle or not has_started:
            continue
        near = closest_approach(
            one.trajectory,
            two.trajectory,
            second_later_s=two.start_s - one.start_s,
            second_above_m=home_above_m(one, two),
            within_m=within_m,
        )
        if near is not None:
            approaches[pair] = _approach_of(happened, pair, near)
    too_near = {}
    for pair, conflict in conflicts.items():
        zone = spacing.zone(*(all_[row] for row in pair))
        assert zone is not None  # of a fleet it is a cylinder
        over_m = zone.over_m if conflict.above_m >= 0.0 else zone.under_m
        beside_m = separation.horizontal_m + conflict.grown_m
        too_near[pair] = Kept(approaches[pair], beside_m, over_m)
    carried = predict_carried(fleet, flown, until_s=until_s, seed=seed)
    for pair, met in carried_approaches(happened, carried, spacing, until_s):
        # What the plan alone leads to, at starts sooner or later, may come to pass as well.
        if met.is_too_near or pair not in conflicts:
            approaches[pair] = met.kept.approach
        if met.is_too_near:
            too_near[pair] = met.kept
    record = _record(flown, all_, until_s, carried)
    first = flown[0].assessment
    assert first is not None  # it flies
    return FiledFlights(
        sorties=tuple(flown),
        too_near=tuple(too_near.values()),
        incomparable=tuple(
            f"heights of {one.file} and {two.file} cannot be compared: the altitude of a home is not known"
            for one, two in combinations(all_, 2)
            if one.vehicle != two.vehicle and not are_heights_known(one, two)
        ),
        distances=Distances(
            nearest=tuple(
                sorted(approaches.values(), key=lambda one: (one.distance_m, one.time_s))
            ),
            least_m=_least_m(record, within_m),
        ),
        record=record,
        frame=first.route.frame,
        waits=((),) * len(flown),
        stops=(0,) * len(flown),
        stays=tuple(_stays(fleet, flown, all_, record)),
    )


def _stays(
    fleet: Fleet, flown: Sequence[FlownSortie], all_: Sequence[Member], record: Record
) -> Iterator[PadStay]:
    """Yield when sorties are on the ground, or so low that they count as on it."""
    stand_of = stands(fleet, flown)
    for row, (one, member) in enumerate(zip(flown, all_, strict=True)):
        error_m = fleet.vehicles[one.sortie.vehicle].setup.position_margin_m
        stand, path = stand_of[one.name], member.trajectory
        up = np.flatnonzero(~path.is_low)
        up_s, low_s = (path.start_s[up[0]], path.end_s[up[-1]]) if len(up) else (one.time_s, 0.0)
        starts_s = one.start_s if one.start_s <= record.begin_s[-1] else np.inf
        begin_s = one.start_s - stand.before_s
        at = (one.name, one.sortie.vehicle, record.place_m[0, row])
        yield PadStay(*at, begin_s, starts_s + up_s, starts_s, error_m)
        if record.has_landed[row]:
            at = (one.name, one.sortie.vehicle, record.place_m[-1, row])
            end_s = one.end_s + stand.after_s
            yield PadStay(*at, one.start_s + low_s, end_s, one.end_s, error_m)


def _on_time(flown: Trajectory) -> Trajectory:
    """Return a flight that is neither sooner nor later than planned."""
    return replace(
        flown,
        slack_s=np.zeros_like(flown.slack_s),
        late_s=np.zeros_like(flown.late_s),
        longer_s=np.zeros_like(flown.longer_s),
    )


def _approach_of(all_: Sequence[Member], pair: tuple[int, int], near: ClosestApproach) -> Approach:
    one, two = (all_[row] for row in pair)
    return Approach(
        first=one.file,
        second=two.file,
        distance_m=float(np.hypot(near.beside_m, near.above_m)),
        time_s=one.start_s + near.first_s,
        above_m=abs(near.above_m),
    )


def _record(
    flown: Sequence[FlownSortie], all_: Sequence[Member], until_s: float, carried: Carried | None
) -> Record:
    """Return where all are at even steps."""
    begin_s = min(one.start_s for one in flown)
    end_s = max(min(max(one.end_s for one in flown), until_s), begin_s + TICK_S)
    count = min(int(np.ceil((end_s - begin_s) / TICK_S - 1e-9)), _MOST_STEPS)
    at_s = np.linspace(begin_s, end_s, count + 1, dtype=np.float64)
    places, velocities, phases, flies_s, lands_s = [], [], [], [], []
    for one, member in zip(flown, all_, strict=True):
        assert one.assessment is not None  # it flies
        own_s = at_s - one.start_s
        place_m = member.trajectory.place_m(own_s)
        place_m[:, 2] += home_above_m(all_[0], member)
        places.append(place_m)
        motion = one.assessment.flight.motion
        state = motion.state_at_time(own_s)
        is_up = (own_s >= 0.0) & (own_s < one.time_s)
        velocities.append(np.where(is_up[:, None], state.velocity_m_s[:, :2], 0.0))
        segments = motion.segments
        up_s = float(segments.end_s[np.argmax(np.append(segments.state, -1) != _TAKEOFF) - 1])
        down_s = float(segments.end_s[np.flatnonzero(segments.state != _LAND)[-1]])
        flies_s.append(one.start_s + up_s)
        lands_s.append(one.start_s + down_s if one.lands else np.inf)
        phases.append(_phases(own_s[:-1], (up_s, down_s, one.time_s), lands=one.lands))
    place_m = np.stack(places, axis=1)
    carried_m = against_m_s = np.zeros((*place_m.shape[:2], 2))
    if carried is not None:
        rows = range(len(flown))
        carried_m, against_m_s = (
            np.stack([of(row, at_s) for row in rows], axis=1)
            for of in (carried.off_m, carried.against_m_s)
        )
        place_m[..., :2] += carried_m
    velocity_m_s = np.stack(velocities, axis=1)
    phase = np.stack(phases, axis=1)
    return Record(
        begin_s=at_s,
        place_m=place_m[..., :2],
        velocity_m_s=velocity_m_s,
        command_m_s=velocity_m_s[:-1],
        phase=phase,
        waits=np.zeros(phase.shape, np.bool_),
        flies_s=np.array(flies_s),
        lands_s=np.array(lands_s),
        has_landed=np.array([one.lands and one.end_s <= end_s + 1e-6 for one in flown]),
        height_m=place_m[..., 2],
        carried_m=carried_m,
        against_m_s=against_m_s,
    )


def _phases(own_s: FloatArray, ends_s: tuple[float, float, float], *, lands: bool) -> IntArray:
    """Return the phases at times of a flight, from the ends of its take-off, its way and itself."""
    ended = AgentPhase.LANDED if lands else AgentPhase.FLIES
    landing = AgentPhase.LANDS if lands else AgentPhase.FLIES
    steps = np.searchsorted([0.0, *ends_s], own_s, side="right")
    order = (AgentPhase.WAITS, AgentPhase.CLIMBS, AgentPhase.FLIES, landing, ended)
    return np.array(order, np.intp)[steps]


def _least_m(record: Record, within_m: float) -> FloatArray:
    """Return the least distance of any two in the air at the beginning of each step; NaN. (t,) [m]"""
    flies = (record.phase != AgentPhase.WAITS) & (record.phase != AgentPhase.LANDED)
    assert record.height_m is not None
    place_m = np.dstack((record.place_m, record.height_m))[:-1]
    least_m = np.full(len(flies), np.inf)
    for one, two in combinations(range(flies.shape[1]), 2):
        both = np.flatnonzero(flies[:, one] & flies[:, two])
        apart_m = np.sqrt(((place_m[both, one] - place_m[both, two]) ** 2).sum(axis=1))
        least_m[both] = np.minimum(least_m[both], apart_m)
    return np.where(least_m <= within_m, least_m, np.nan)
