"""A fleet over time: who is where, who has which pack, what it all takes, and how far all keep apart.

What pages and the terminal UI show of a fleet is made here, once, of the check of it.
"""

from __future__ import annotations

import math
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.fleet import Separation
from planner.fleet.trajectory import thinned
from planner.flight.prediction import used_energy_wh
from planner.service.fleet_pairs import APART_CODES, closest_pairs
from planner.service.fleet_separation import RETURN_CROSSES, members
from planner.service.fleet_times import pad_stays
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.fleet.charging import Charge
    from planner.fleet.separation import Member
    from planner.flight.prediction import Flight
    from planner.geo.geodesy import LocalFrame
    from planner.service.fleet import FleetFinding, FleetResult, FlownSortie
    from planner.service.fleet_pairs import PairDistance
    from planner.service.fleet_times import Stay

    Energy = tuple[FloatArray, FloatArray]

TRACK_ERROR_M = 1.0
"""How far a vehicle may be from its thinned track at any time: two fifths of the position error of a
common receiver, 2.5 m. [m]"""
TRACK_ERROR_ENERGY = 0.005
"""How far its energy may be, over that of its flight: half of what a display of the charge shows. [-]"""
_BEND, _THINNED = 0.1, 0.8
"""What of the error samples and thinning may take; a tenth is left to rounding. [-]"""
_SAMPLES = 3000
"""Of the power of a flight; of more than that many seconds they are farther apart."""
_SPANS = 360
"""Of the power of the group: two dots of a picture each."""
_ALONE = Separation(horizontal_m=1.0)
"""Stands in where none is given: a single vehicle has tracks too."""


class Span(Value):
    """What a vehicle, pack, charger or pad is used for, for a time."""

    use: str
    """``flight``, ``swap``, ``charge`` or ``stand``."""
    start_s: float
    end_s: float
    name: str
    """Of the sortie; of a charge that of the pack, of a pad that of the vehicle."""


class TimelineRow(Value):
    """A vehicle, pack, charger or pad over time."""

    kind: str
    name: str
    spans: tuple[Span, ...]


class Track(Value, eq=False):
    """Where a sortie is, thinned: straight and even between its points."""

    sortie: str
    vehicle: str
    time_s: FloatArray
    """Of the operation. (n,) [s]"""
    place_m: FloatArray
    """East and north in the frame of all, height above the home of the flight. (n, 3) [m]"""
    used_wh: FloatArray
    """Energy by then; NaN: not known. (n,) [Wh]"""
    item_s: FloatArray
    """When each item begins. (m,) [s]"""
    item: IntArray

    @property
    def start_s(self) -> float:
        """When it starts. [s]"""
        return float(self.time_s[0])

    @property
    def end_s(self) -> float:
        """When it ends. [s]"""
        return float(self.time_s[-1])

    def is_flying(self, time_s: float) -> bool:
        """Return whether it is in the air."""
        return self.start_s <= time_s < self.end_s

    def place_at(self, time_s: float) -> tuple[float, float, float]:
        """Return east, north and height at a time; before and after the flight where it stands. [m]"""
        east_m, north_m, height_m = (
            float(np.interp(time_s, self.time_s, column)) for column in self.place_m.T
        )
        return east_m, north_m, height_m

    def used_at(self, time_s: float) -> float | None:
        """Return the energy used by a time; ``None``: not known. [Wh]"""
        used_wh = float(np.interp(time_s, self.time_s, self.used_wh))
        return None if math.isnan(used_wh) else used_wh

    def item_at(self, time_s: float) -> int:
        """Return the item flown at a time."""
        return int(self.item[max(int(np.searchsorted(self.item_s, time_s, side="right")) - 1, 0)])


class TimelineMark(Value):
    """A finding about a moment."""

    finding: Finding
    at_s: float
    sorties: tuple[str, ...]
    rows: tuple[int, ...]
    """Those it is in."""
    place_m: tuple[float, float] | None
    """East and north, of what happens in the air or on a pad. [m]"""


class FleetTimeline(Value, eq=False):
    """A fleet over time; times count from the beginning of the operation."""

    end_s: float
    """When the last has landed and its pack is changed, in whole seconds. [s]"""
    frame: LocalFrame | None
    """Of all places; ``None``: nothing is flown."""
    rows: tuple[TimelineRow, ...]
    tracks: tuple[Track, ...]
    marks: tuple[TimelineMark, ...]
    """In the order of time."""
    edge_s: FloatArray
    """Of the spans of the power. (k + 1,) [s]"""
    used_wh: FloatArray
    """Energy of the group by then, of the sorties whose energy is known. (k + 1,) [Wh]"""
    pairs: tuple[PairDistance, ...]
    """The closest, in conflict first."""
    separation_m: float | None
    """What they keep."""

    @property
    def power_w(self) -> FloatArray:
        """Mean power of the group in each span. (k,) [W]"""
        return np.asarray(np.diff(self.used_wh) / np.diff(self.edge_s) * 3600.0)

    def group_at(self, time_s: float) -> tuple[float, float]:
        """Return the mean power of the group about a time, and its energy by then. [W], [Wh]"""
        span = int(np.clip(np.searchsorted(self.edge_s, time_s, side="right") - 1, 0, _SPANS - 1))
        return float(self.power_w[span]), float(np.interp(time_s, self.edge_s, self.used_wh))

    def vehicles_at(self, time_s: float) -> Iterator[Track]:
        """Yield of each vehicle the track it is on at a time: flown, last flown, or first to be flown."""
        for name in dict.fromkeys(one.vehicle for one in self.tracks):
            own = [one for one in self.tracks if one.vehicle == name]
            begun = [one for one in own if one.start_s <= time_s]
            yield begun[-1] if begun else own[0]


def fleet_timeline(result: FleetResult) -> FleetTimeline:
    """Return a fleet over time.

    Parameters
    ----------
    result : FleetResult
        As `planner.check_fleet` returns it.
    """
    fleet = result.fleet
    flown = [one for one in result.sorties if one.time_s > 0.0]
    all_ = members(fleet, fleet.separation or _ALONE, flown) if flown else []
    first = flown[0].assessment if flown else None
    ready_s = max((one.end_s for one in flown), default=0.0) + fleet.swap_s
    end_s = float(math.ceil(ready_s))
    energies = [
        None
        if one.assessment is None or one.energy_wh is None
        else energy_by_time(one.assessment.flight)
        for one in flown
    ]
    edge_s, used_wh = group_energy(
        end_s, list(zip((one.start_s for one in flown), energies, strict=True))
    )
    tracks = tuple(
        _track(one, member, energy)
        for one, member, energy in zip(flown, all_, energies, strict=True)
    )
    rows = tuple(_rows(result, flown, ready_s))
    return FleetTimeline(
        end_s=end_s,
        frame=None if first is None else first.route.frame,
        rows=rows,
        tracks=tracks,
        marks=tuple(_marks(result.findings, rows, tracks, flown)),
        edge_s=edge_s,
        used_wh=used_wh,
        pairs=closest_pairs(result, all_),
        separation_m=None if fleet.separation is None else fleet.separation.horizontal_m,
    )


def energy_by_time(flight: Flight) -> Energy:
    """Return times of a flight and the energy by then. (n,) [s], [Wh]"""
    even_s = np.linspace(0.0, flight.time_s, min(int(flight.time_s) + 2, _SAMPLES))
    time_s = np.union1d(even_s, np.minimum(flight.motion.segments.end_s, flight.time_s))
    return time_s, used_energy_wh(flight, time_s, flight.power_w(time_s))


def group_energy(
    end_s: float, flights: Sequence[tuple[float, Energy | None]]
) -> tuple[FloatArray, FloatArray]:
    """Return the edges of the spans of the power, and the energy of the group by then. (k + 1,) [s], [Wh]"""
    edge_s = np.linspace(0.0, end_s or 1.0, _SPANS + 1)
    used_wh = np.zeros(len(edge_s))
    for start_s, energy in flights:
        if energy is not None:
            used_wh += np.interp(edge_s - start_s, *energy)
    return edge_s, used_wh


def _track(one: FlownSortie, member: Member, energy: Energy | None) -> Track:
    flown = member.trajectory
    own = ~flown.is_rest
    start_s, end_s = flown.start_s[own], flown.end_s[own]
    # A cubic is off its chord by its bend, a part of it by that of a square less.
    control_m = flown.control_m[own]
    inner_m = control_m[:, 1:3] - (
        control_m[:, :1] + np.array([1 / 3, 2 / 3])[:, None] * np.diff(control_m[:, ::3], axis=1)
    )
    bend_m = 0.75 * np.sqrt(np.sum(inner_m**2, axis=2)).max(axis=1)
    parts = np.maximum(np.ceil(np.sqrt(bend_m / (_BEND * TRACK_ERROR_M))), 1.0).astype(np.int64)
    part = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(part)) - np.repeat(np.cumsum(parts) - parts, parts)
    time_s = np.append(
        start_s[part] + number / parts[part] * (end_s - start_s)[part], flown.duration_s
    )
    item = flown.item[own]
    begins = np.flatnonzero(np.diff(item, prepend=-1))
    return thinned_track(
        time_s + one.start_s,
        flown.place_m(time_s),
        np.full(len(time_s), np.nan) if energy is None else np.interp(time_s, *energy),
        names=(one.name, one.sortie.vehicle),
        items=(start_s[begins] + one.start_s, item[begins]),
    )


def thinned_track(
    time_s: FloatArray,
    place_m: FloatArray,
    used_wh: FloatArray,
    *,
    names: tuple[str, str],
    items: tuple[FloatArray, IntArray],
) -> Track:
    """Return the track of samples, those of them that are needed.

    Parameters
    ----------
    time_s, place_m, used_wh : ndarray
        As of a `Track`.
    names : tuple of str
        Of the sortie and of the vehicle.
    items : tuple of ndarray
        When each item begins, and which it is.
    """
    columns = place_m
    if used_wh[-1] > 0.0:
        scaled = used_wh * (TRACK_ERROR_M / (TRACK_ERROR_ENERGY * used_wh[-1]))
        columns = np.column_stack((place_m, scaled))
    kept = thinned(time_s, columns, _THINNED * TRACK_ERROR_M)
    return Track(
        sortie=names[0],
        vehicle=names[1],
        time_s=time_s[kept],
        place_m=place_m[kept],
        used_wh=used_wh[kept],
        item_s=items[0],
        item=items[1],
    )


def _rows(result: FleetResult, flown: Sequence[FlownSortie], end_s: float) -> Iterator[TimelineRow]:
    """Yield what is used in the operation, over time."""
    fleet, charges = result.fleet, result.charges
    for name in fleet.vehicles:
        own = [one for one in flown if one.sortie.vehicle == name]
        if own:
            yield TimelineRow(kind="vehicle", name=name, spans=tuple(_flights(own, fleet.swap_s)))
    for name in fleet.packs:
        own = [one for one in flown if one.sortie.pack == name]
        charged = _cut("charge", [one for one in charges if one.pack == name], end_s)
        if spans := sorted((*_flights(own, fleet.swap_s), *charged), key=lambda one: one.start_s):
            yield TimelineRow(kind="pack", name=name, spans=tuple(spans))
    for charger in fleet.chargers.values():
        sockets = _sockets([one for one in charges if one.charger == charger.name])
        for number, on_it in enumerate(sockets, start=1):
            name = charger.name if charger.count == 1 else f"{charger.name} {number}"
            yield TimelineRow(kind="charger", name=name, spans=_cut("charge", on_it, end_s))
    stays_of = pad_stays(fleet, flown)
    for name, stays in ((name, stays_of[name]) for name in fleet.pads if name in stays_of):
        yield TimelineRow(kind="pad", name=name, spans=tuple(_stood(stays, end_s)))


def _flights(flown: Sequence[FlownSortie], swap_s: float) -> Iterator[Span]:
    """Yield the flights of a vehicle or a pack, and what is done after each."""
    next_s = [*(one.start_s for one in flown[1:]), math.inf]  # one of none flown is left over
    for one, until_s in zip(flown, next_s, strict=False):
        yield Span(use="flight", start_s=one.start_s, end_s=one.end_s, name=one.name)
        ready_s = min(one.end_s + swap_s, until_s)
        if ready_s > one.end_s:
            yield Span(use="swap", start_s=one.end_s, end_s=ready_s, name=one.name)


def _stood(stays: Sequence[Stay], end_s: float) -> Iterator[Span]:
    """Yield who stands on a pad: what a vehicle stands after a flight and before the next is one."""
    by_vehicle = sorted(stays, key=lambda one: (one.flown.sortie.vehicle, one.from_s))
    for name, own in groupby(by_vehicle, key=lambda one: one.flown.sortie.vehicle):
        until_s = -math.inf
        for one in own:
            from_s = max(one.from_s, until_s, 0.0)
            until_s = max(until_s, min(one.until_s, end_s))
            if until_s > from_s:
                yield Span(use="stand", start_s=from_s, end_s=until_s, name=name)


def _sockets(charges: Sequence[Charge]) -> list[list[Charge]]:
    """Return charges of one kind of charger by the places they take."""
    sockets: list[list[Charge]] = []
    for one in charges:
        free = next((on_it for on_it in sockets if on_it[-1].end_s <= one.start_s), None)
        if free is None:
            sockets.append([one])
        else:
            free.append(one)
    return sockets


def _cut(use: str, charges: Sequence[Charge], end_s: float) -> tuple[Span, ...]:
    """Return charges, as far as they are in the operation."""
    return tuple(
        Span(use=use, start_s=one.start_s, end_s=min(one.end_s, end_s), name=one.pack)
        for one in charges
        if one.start_s < end_s
    )


def _marks(
    findings: Sequence[FleetFinding],
    rows: Sequence[TimelineRow],
    tracks: Sequence[Track],
    flown: Sequence[FlownSortie],
) -> list[TimelineMark]:
    vehicles = {one.name: one.sortie.vehicle for one in flown}
    track_of = {one.sortie: one for one in tracks}
    found = []
    for one in findings:
        if one.at_s is None or not one.sorties:
            continue
        at_s, own = one.at_s, {vehicles.get(name) for name in one.sorties}
        inside = []
        for number, row in enumerate(rows):
            there = {
                span.name
                for span in row.spans
                if (span.name in one.sorties or span.name in own)
                and span.start_s <= at_s <= span.end_s
            }
            if (row.kind == "vehicle" and row.name in own) or len(there) > 1:
                inside.append(number)
        # The time is that of the first, of a return of which the other one alone is where it is planned.
        whose = one.sorties[-1 if one.finding.code == RETURN_CROSSES.code else 0]
        place_m = None
        if one.finding.code in APART_CODES and whose in track_of:
            place_m = track_of[whose].place_at(at_s)[:2]
        found.append(
            TimelineMark(
                finding=one.finding,
                at_s=at_s,
                sorties=one.sorties,
                rows=tuple(inside),
                place_m=place_m,
            )
        )
    return sorted(found, key=lambda mark: mark.at_s)
