"""Which flights of a fleet come too near to each other, and which later start clears them."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.approach import ACCURACY_M, closest_approach
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.fleet.approach import ClosestApproach
    from planner.fleet.trajectory import Trajectory

SAME_HOME_M = 1.0
"""Homes within this stand on the same ground, whatever altitude either file gives. [m]"""
_FINE_DELAYS_S = 10
"""Delays up to this are tried second by second; later ones in growing steps, then between. [s]"""
_DELAY_GROWTH = 1.15
_ROUGHLY = 0.05
"""To what part of the separation it is first found how near two come that come too near. [-]"""


class Member(Value, eq=False):
    """One vehicle of a fleet."""

    file: str
    """Of its mission, as messages call it."""
    trajectory: Trajectory
    start_s: float
    """When its mission starts, on a clock of all. [s]"""
    home_amsl_m: float | None
    """``None``: not known. [m AMSL]"""


class Spacing(Value):
    """What two members have to keep."""

    separation_m: float
    """Distance; more than :data:`planner.fleet.approach.ACCURACY_M` less is too near. [m]"""
    start_error_s: float = 0.0
    """How much sooner or later than planned each may start. [s]"""


class Conflict(Value):
    """Two members, by their positions in the fleet, that come too near to each other."""

    first: int
    second: int
    approach: ClosestApproach


def predict_conflicts(fleet: Sequence[Member], spacing: Spacing) -> Iterator[Conflict]:
    """Yield every two members, of trajectories in one frame, that come nearer to each other than they may.

    The closest approach is that at whatever starts, to 5 % of the separation.
    """
    for (first, one), (second, two) in combinations(enumerate(fleet), 2):
        approach = _approach(one, two, spacing, accuracy_m=_ROUGHLY * spacing.separation_m)
        if approach is not None:
            yield Conflict(first=first, second=second, approach=approach)


def predict_approach(first: Member, second: Member, spacing: Spacing) -> ClosestApproach | None:
    """Return the closest approach of two members at whatever starts; ``None``: not too near."""
    return _approach(first, second, spacing)


def clearing_delay_s(first: Member, second: Member, spacing: Spacing) -> float | None:
    """Return the smallest later start of the second found that keeps apart two members too near now.

    In whole seconds, tried as :func:`predict_conflicts` does; ``None`` where waiting until the first has
    ended does not help.
    """

    def clears(delay_s: int) -> bool:
        return _approach(first, second, spacing, delay_s=float(delay_s), accuracy_m=np.inf) is None

    ended_s = (
        first.start_s + first.trajectory.duration_s - second.start_s + 2.0 * spacing.start_error_s
    )
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
    above_m = 0.0
    if not _have_one_home(first, second):
        above_m = (
            0.0
            if first.home_amsl_m is None or second.home_amsl_m is None
            else second.home_amsl_m - first.home_amsl_m
        )
    return closest_approach(
        first.trajectory,
        second.trajectory,
        second_later_s=second.start_s - first.start_s + delay_s,
        shift_s=2.0 * spacing.start_error_s,
        second_above_m=above_m,
        accuracy_m=accuracy_m,
        within_m=max(spacing.separation_m - ACCURACY_M, 0.0),
    )
