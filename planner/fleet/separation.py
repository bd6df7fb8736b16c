"""Which flights of a fleet come too near to each other, and which later start clears them."""

from __future__ import annotations

from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.approach import ACCURACY_M, Cylinder, closest_approach
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import FloatArray
    from planner.fleet.approach import ClosestApproach
    from planner.fleet.trajectory import Trajectory

SAME_HOME_M = 1.0
"""Homes within this stand on the same ground, whatever altitude either file gives. [m]"""
_FINE_DELAYS_S = 10
"""Delays up to this are tried second by second; later ones in growing steps, then between. [s]"""
_DELAY_GROWTH = 1.15
_ROUGHLY = 0.05
"""To what part of the separation it is first found how near two come that come too near. [-]"""


class Member(Value, eq=False, dict=True):
    """One vehicle of a fleet."""

    file: str
    """Of its mission, as messages call it."""
    trajectory: Trajectory
    start_s: float
    """When its mission starts, on a clock of all. [s]"""
    home_amsl_m: float | None
    """``None``: not known. [m AMSL]"""
    above_m: float = 0.0
    """Height kept free above it, where a cylinder is kept. [m]"""
    below_m: float = 0.0
    """Height kept free below it. [m]"""
    vehicle: str = ""
    """Two flights of one vehicle are not in each other's way; empty: each is of its own."""
    own: Trajectory | None = None
    """As its own autopilot flies, where its model does otherwise; ``None``: that is not known."""
    flies_own: bool = False
    """Whether that is its trajectory."""

    @cached_property
    def reach_box_m(self) -> FloatArray:
        """Box, east and north, that it does not leave, however it flies. (2, 2) [m]"""
        ways = [one.reach for one in (self.trajectory, self.own) if one is not None]
        low_m = np.min([one.box_m[0][:2] - one.widest_m for one in ways], axis=0)
        high_m = np.max([one.box_m[1][:2] + one.widest_m for one in ways], axis=0)
        return np.stack((low_m, high_m))


class Spacing(Value):
    """What two members have to keep."""

    separation_m: float
    """Distance; more than :data:`planner.fleet.approach.ACCURACY_M` less is too near. [m]"""
    start_error_s: float = 0.0
    """How much sooner or later than planned each may start. [s]"""
    height_error_m: float | None = None
    """How wrong the height of each may be; ``None``: the distance is one in space, and no cylinder. [m]"""

    def zone(self, first: Member, second: Member) -> Cylinder | None:
        """Return what two members keep apart by; ``None``: a distance in space."""
        if self.height_error_m is None:
            return None
        more_m = 2.0 * self.height_error_m
        return Cylinder(
            horizontal_m=max(self.separation_m - ACCURACY_M, ACCURACY_M),
            over_m=max(max(first.above_m, second.below_m) + more_m - ACCURACY_M, ACCURACY_M),
            under_m=max(max(first.below_m, second.above_m) + more_m - ACCURACY_M, ACCURACY_M),
        )


class Conflict(Value):
    """Two members, by their positions in the fleet, that come too near to each other."""

    first: int
    second: int
    approach: ClosestApproach
    sides: tuple[Member, Member]
    """As these fly then: as predicted, or as their own autopilots do."""


def as_flown(first: Member, second: Member) -> Iterator[tuple[Member, Member]]:
    """Yield in what ways two members may fly beside each other: as predicted, and as their own autopilots do.

    Whether these fly as their models do is one question for two alike; of others each may.
    """
    ways = [*product(_ways(first), _ways(second))]
    yield ways[0]
    if _are_alike(first, second):
        yield ways[-1]
    else:
        yield from ways[1:]


def _ways(one: Member) -> list[Member]:
    """Return a member as predicted, and as its own autopilot flies where that is known."""
    if one.own is None:
        return [one]
    return [one, replace(one, trajectory=one.own, own=None, flies_own=True)]


def _are_alike(first: Member, second: Member) -> bool:
    if first.own is None or second.own is None:
        return False
    one, two = first.own.pace, second.own.pace
    return one is not None and two is not None and one.flown_by == two.flown_by


def predict_conflicts(fleet: Sequence[Member], spacing: Spacing) -> Iterator[Conflict]:
    """Yield every two members, of trajectories in one frame, that come nearer to each other than they may.

    In the first way that does, at whatever starts, to 5 % of the separation.
    """
    for first, second in sorted(near_pairs(fleet, spacing)):
        for sides in as_flown(fleet[first], fleet[second]):
            approach = rough_approach(*sides, spacing)
            if approach is not None:
                yield Conflict(first=first, second=second, approach=approach, sides=sides)
                break


def predict_unknown(fleet: Sequence[Member], spacing: Spacing) -> frozenset[int]:
    """Return the members that come nearer to another than they may at heights that cannot be compared."""
    pairs = [
        (first, second)
        for first, second in near_pairs(fleet, spacing)
        if not are_heights_known(fleet[first], fleet[second])
    ]
    return frozenset(
        number
        for pair in pairs
        for sides in as_flown(*(_seen_from_above(fleet[number]) for number in pair))
        if rough_approach(*sides, spacing) is not None
        for number in pair
    )


def _seen_from_above(one: Member) -> Member:
    own = None if one.own is None else one.own.at_no_height
    return replace(one, trajectory=one.trajectory.at_no_height, own=own)


def rough_approach(first: Member, second: Member, spacing: Spacing) -> ClosestApproach | None:
    """Return the closest approach at whatever starts, to 5 % of the separation; ``None``: not too near."""
    return _approach(first, second, spacing, accuracy_m=_ROUGHLY * spacing.separation_m)


def near_pairs(fleet: Sequence[Member], spacing: Spacing) -> Iterator[tuple[int, int]]:
    """Yield the pairs of members of two vehicles whose boxes in space and time are not too far apart."""
    if len(fleet) < 2:
        return
    low, high = np.array([one.reach_box_m for one in fleet]).swapaxes(0, 1)
    low, high = low - 0.5 * spacing.separation_m, high + 0.5 * spacing.separation_m
    order = np.argsort(low[:, 0], kind="stable")
    ends = np.searchsorted(low[order, 0], high[order, 0], side="right")
    for place, first in enumerate(order.tolist()):
        later = order[place + 1 : ends[place]]
        beside = (low[later, 1] < high[first, 1]) & (low[first, 1] < high[later, 1])
        for second in later[beside].tolist():
            if not fleet[first].vehicle or fleet[first].vehicle != fleet[second].vehicle:
                yield min(first, second), max(first, second)


def predict_approach(first: Member, second: Member, spacing: Spacing) -> ClosestApproach | None:
    """Return the closest approach of two members at whatever starts; ``None``: not too near."""
    return _approach(first, second, spacing)


def clearing_delay_s(first: Member, second: Member, spacing: Spacing) -> float | None:
    """Return the smallest later start of the second found that keeps apart two members too near now.

    In whole seconds, tried in every way they may fly; ``None`` where waiting until the first has ended does
    not help.
    """
    ways = [*as_flown(first, second)]

    def clears(delay_s: int) -> bool:
        return all(
            _approach(*sides, spacing, delay_s=float(delay_s), accuracy_m=np.inf) is None
            for sides in ways
        )

    lasts_s = [one.trajectory.duration_s + one.trajectory.latest_s for one, _ in ways]
    ended_s = first.start_s + max(lasts_s) - second.start_s
    ended_s += 2.0 * spacing.start_error_s
    longest_s = max(int(np.ceil(ended_s)), 0) + 1
    if not clears(longest_s):
        return None
    near_s, delay_s = 0, 1
    while delay_s < longest_s and not clears(delay_s):
        near_s = delay_s
        delay_s = max(
            delay_s + 1, int(delay_s * (_DELAY_GROWTH if delay_s >= _FINE_DELAYS_S else 1))
        )
    delay_s = min(delay_s, longest_s)
    while delay_s - near_s > 1:
        middle_s = (near_s + delay_s) // 2
        near_s, delay_s = (near_s, middle_s) if clears(middle_s) else (middle_s, delay_s)
    return float(delay_s)


def are_heights_known(first: Member, second: Member) -> bool:
    """Return whether heights of two members can be compared, in one place or above sea level."""
    is_known = first.home_amsl_m is not None and second.home_amsl_m is not None
    return is_known or _have_one_home(first, second)


def home_above_m(first: Member, second: Member) -> float:
    """Return how far the home of the second is above that of the first; 0 where it is not known. [m]"""
    if _have_one_home(first, second) or first.home_amsl_m is None or second.home_amsl_m is None:
        return 0.0
    return second.home_amsl_m - first.home_amsl_m


def _have_one_home(first: Member, second: Member) -> bool:
    one, two = (member.trajectory.control_m[0, 0, :2] for member in (first, second))
    return float(np.hypot(*(one - two))) <= SAME_HOME_M


def _approach(
    first: Member,
    second: Member,
    spacing: Spacing,
    *,
    delay_s: float = 0.0,
    accuracy_m: float = ACCURACY_M,
) -> ClosestApproach | None:
    """Return the closest approach where it is too close."""
    return closest_approach(
        first.trajectory.reach,
        second.trajectory.reach,
        second_later_s=second.start_s - first.start_s + delay_s,
        shift_s=2.0 * spacing.start_error_s,
        second_above_m=home_above_m(first, second),
        accuracy_m=accuracy_m,
        within_m=max(spacing.separation_m - ACCURACY_M, 0.0),
        zone=spacing.zone(first, second),
    )
