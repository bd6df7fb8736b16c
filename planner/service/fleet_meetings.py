"""When two sorties of a plan must not start: where they, or their returns, come too near to each other."""

from __future__ import annotations

from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.approach import Meeting
from planner.fleet.return_flights import return_conflict
from planner.fleet.separation import as_flown, home_above_m
from planner.fleet.shifts import ClosedShifts
from planner.service.fleet_separation import common_frame, fleet_spacing, members, returns_of
from planner.service.fleet_times import carries_m, carry_s, landing_pads
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.fleet.fleet import Fleet, Separation
    from planner.fleet.separation import Member
    from planner.service.fleet import FlownSortie
    from planner.service.fleet_separation import Encounters, ReturnsOfOne

    Closed = dict[tuple[tuple[int, int], tuple[int, int]], tuple[tuple[float, float], ...]]
    """Of two flights, each by task and option: open intervals that the start of the second after that of
    the first must not be in. [s]"""

_RETURNS_ROUND_S = 1.0
"""To what starts are found that keep the returns of another clear; each try looks at all of them. [s]"""


def pad_shifts(fleet: Fleet, flights: Sequence[Sequence[FlownSortie]]) -> Closed:
    """Return when two that start from one pad need a pad at once, by task and option.

    A vehicle is put on a pad that several use as long before its start as a swap takes, and cleared away
    as long after its landing.
    """
    ways = [
        ((task, option), way) for task, own in enumerate(flights) for option, way in enumerate(own)
    ]
    pads = [None if (pad := fleet.pad_of(way.sortie)) is None else pad.name for _, way in ways]
    used = {(pad, way.sortie.vehicle) for pad, (_, way) in zip(pads, ways, strict=True) if pad}
    shared = {pad for pad, _ in used if sum(pad == other for other, _ in used) > 1}
    time_s = fleet.swap_s
    if not shared or not time_s:
        return {}
    landings = landing_pads(fleet, [way for _, way in ways])
    stays = {
        at: [
            (pad, -time_s, 0.0),
            (landing, way.lands_s - way.start_s, way.landed_s - way.start_s + time_s),
        ]
        for (at, way), pad, landing in zip(ways, pads, landings, strict=True)
        if pad in shared
    }
    by_at = dict(ways)
    found: Closed = {}
    for one, two in combinations(stays, 2):
        if one[0] == two[0] or by_at[one].sortie.vehicle == by_at[two].sortie.vehicle:
            continue
        if stays[one][0][0] == stays[two][0][0]:
            found[one, two] = tuple(
                (from_s - other_until_s, until_s - other_from_s)
                for pad, from_s, until_s in stays[one]
                for other, other_from_s, other_until_s in stays[two]
                if pad is not None and pad == other
            )
    return found


def carry_shifts(fleet: Fleet, flights: Sequence[Sequence[FlownSortie]]) -> Closed:
    """Return when a vehicle that lands elsewhere is not there for another flight, by task and option."""
    ways = [
        ((task, option), way) for task, own in enumerate(flights) for option, way in enumerate(own)
    ]
    away_m = carries_m([way for _, way in ways])
    found: Closed = {}
    for row, column in np.argwhere((away_m > 0.0) | (away_m.T > 0.0)).tolist():
        (one, first), (two, second) = ways[row], ways[column]
        if row < column and one[0] != two[0] and first.sortie.vehicle == second.sortie.vehicle:
            after_s, before_s = (
                way.time_s + way.late_s + fleet.swap_s + carry_s(fleet, float(away))
                for way, away in ((first, away_m[row, column]), (second, away_m[column, row]))
            )
            found[one, two] = ((-before_s, after_s),)
    return found


class Meetings:
    """At which differences of their starts two sorties come too near to each other."""

    def __init__(
        self,
        fleet: Fleet,
        separation: Separation,
        flown: tuple[FlownSortie, FlownSortie],
        known: Encounters,
    ) -> None:
        self._spacing = fleet_spacing(separation)
        # Vehicles of one name never meet; packs and starts count for nothing here.
        self._one, self._two = members(fleet, separation, flown, known)
        frame = common_frame(flown, known)
        self._backs = [returns_of(fleet, separation, one, frame, known) for one in flown]

    def about(self, later_s: float, *, with_returns: bool) -> list[tuple[float, float]]:
        """Return the intervals that a difference is in. [s]"""
        found = [one.around(later_s) for one in self._flights]
        if with_returns:
            first, second = self._returns
            found += [one.around(later_s) for one in first]
            for back in second:
                turned = back.around(-later_s)
                found.append(None if turned is None else (-turned[1], -turned[0]))
        return [one for one in found if one is not None]

    @cached_property
    def _flights(self) -> list[ClosedShifts]:
        return [ClosedShifts(self._meeting(*sides)) for sides in as_flown(self._one, self._two)]

    @cached_property
    def _returns(self) -> tuple[list[ClosedShifts], list[ClosedShifts]]:
        """Of the returns of the first with the second, and the other way round."""
        first, second = self._backs
        return (
            self._of_returns(first, self._one, self._two),
            self._of_returns(second, self._two, self._one),
        )

    def _of_returns(
        self, backs: Sequence[ReturnsOfOne], one: Member, two: Member
    ) -> list[ClosedShifts]:
        sides = ((backs[first.flies_own], first, second) for first, second in as_flown(one, two))
        return [self._of_way(*each) for each in sides if each[0].box_m is not None]

    def _of_way(self, back: ReturnsOfOne, one: Member, two: Member) -> ClosedShifts:
        flights, fan = back.flights, back.fine_fan
        meeting = replace(self._meeting(one, two), first=fan.whole)

        def is_clear(low_s: float, high_s: float) -> bool:
            between_s = 0.5 * (high_s - low_s)
            at = replace(meeting, later_s=low_s + between_s, shift_s=meeting.shift_s + between_s)
            return return_conflict(flights, fan, at) is None

        return ClosedShifts(meeting, is_clear=is_clear, round_s=_RETURNS_ROUND_S)

    def _meeting(self, one: Member, two: Member) -> Meeting:
        return Meeting(
            first=one.trajectory.reach,
            second=two.trajectory.reach,
            shift_s=2.0 * self._spacing.start_error_s,
            above_m=home_above_m(one, two),
            zone=self._spacing.zone(one, two),
        )
