"""Rules on the way home and the fence: the straight line home from every place of a flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.catalogue.fence import FENCE_IN_PART, RTL_PATH_CROSSES
from planner.geo.path import swept_areas
from planner.mission.route.stage import StageKind
from planner.rules.energy import destination_name
from planner.rules.fenced_flight import straight_legs

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.geo.path import Barrier, SweptAreas
    from planner.rules.assessment import Assessment
    from planner.rules.fenced_flight import FencedFlight


def own_return(a: Assessment, item: int) -> bool:
    """Return whether an item is the mission's own return."""
    return any(s.item == item and s.kind is StageKind.RETURN for s in a.route.stages)


def unchecked_returns(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where it is not known where home is."""
    if a.mission.home is None:
        yield FENCE_IN_PART.finding(
            "the file says no home: ways home, and distances from home, are taken from where the "
            "flight starts",
            fix="save the mission with its planned home",
        )


def check_returns(
    flown: FencedFlight, barriers: list[Barrier], crossing: set[int]
) -> Iterator[Finding]:
    """Yield a finding where the straight way home crosses the fence.

    Parameters
    ----------
    flown, barriers, crossing
        As in `planner.rules.stop_buffer.check_stop_buffer`.
    """
    target = flown.return_ends_m
    judged = ~np.isin(flown.group, list(crossing))
    # That home or a rally point itself is outside is said of it, not of each way there.
    outside = flown.is_end_judged & ~flown.area.is_inside(*target.T)
    judged &= ~(outside[:-1] | outside[1:])
    # The own return of a mission flies what is checked as its path already.
    judged &= ~np.isin(
        flown.path.item,
        [s.item for s in flown.assessment.route.stages if s.kind is StageKind.RETURN],
    )
    for barrier in barriers:
        legs = _legs_cut_off(flown, barrier, target, judged)
        if len(legs):
            yield _finding(flown, barrier, target, legs)
            return


def _legs_cut_off(
    flown: FencedFlight, barrier: Barrier, target_m: FloatArray, judged: BoolArray
) -> IntArray:
    """Return the legs from somewhere on which the way home crosses a barrier."""
    chosen = np.flatnonzero(judged)
    if not len(chosen):
        return chosen
    _, group = np.unique(flown.group[chosen], return_inverse=True)
    whole = _triangles(flown, target_m, chosen, group)
    chosen = chosen[whole.near(barrier, 0.0)[group]]
    if not len(chosen):
        return chosen
    return chosen[_triangles(flown, target_m, chosen, np.arange(len(chosen))).near(barrier, 0.0)]


def _triangles(
    flown: FencedFlight, target_m: FloatArray, legs: IntArray, owner: IntArray
) -> SweptAreas:
    """Return what ways home from legs pass over, by owner."""
    return swept_areas(
        np.concatenate([p[rows] for p in (flown.points_m, target_m) for rows in (legs, legs + 1)]),
        np.tile(owner, 4),
    )


def _finding(
    flown: FencedFlight, barrier: Barrier, target_m: FloatArray, legs: IntArray
) -> Finding:
    """Return the finding on the first item from whose legs a barrier is in the way, at its worst."""
    first = legs[flown.group[legs] == flown.group[legs[0]]]
    ends = np.unique(np.concatenate((first, first + 1)))
    ways = straight_legs(flown.points_m[ends], target_m[ends])
    point = ends[int(np.argmin(barrier.leg_clearance(ways).clearance_m))]
    item = int(flown.path.item[first[0]])
    items = len(np.unique(flown.path.item[legs]))
    start, end = flown.points_m[point], target_m[point]
    others = f", as from {quantity.count(items, 'item')} in all" if items > 1 else ""
    goal = destination_name(int(flown.destination[point]))
    return RTL_PATH_CROSSES.finding(
        f"the straight way {goal} from here crosses {barrier.label}{others}",
        item=item,
        place=flown.place(item),
        stretch=flown.stretch(start, end, float(np.hypot(*(end - start)))),
    )
