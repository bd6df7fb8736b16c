"""How agents clear the way of one: of one that hears nothing, or of one whose turn it is in a jam."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.swarm.zones import Capsules, differ, distances_m
from planner.values import replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.fleet.swarm.situation import SwarmSituation

_MIDDLE_M = 1.0
"""Nearer than this to the middle of a way both sides are as near. [m]"""


def clearing(situation: SwarmSituation, one: int, way: Capsules) -> SwarmSituation:
    """Return a situation in which those in the way of one want out of it.

    Parameters
    ----------
    situation : SwarmSituation
    one : int
        Whose way it is.
    way : Capsules
        Its way, in a single row.
    """
    aside_m = _ways_aside_m(situation, one, way)
    evades = differ(aside_m)
    unit = aside_m[evades] / np.hypot(*aside_m[evades].T)[:, None]
    wanted_m_s = situation.wanted_m_s.copy()
    wanted_m_s[evades] = situation.speed_m_s[evades, None] * unit
    return replace(situation, wanted_m_s=wanted_m_s, is_evading=situation.is_evading | evades)


def cleared_m_s(situation: SwarmSituation, command_m_s: FloatArray) -> FloatArray:
    """Return the commands of a policy, but of those that clear a way what they want, where that is free."""
    if not situation.is_evading.any():
        return command_m_s
    tried = np.where(situation.is_evading[:, None], situation.wanted_m_s, command_m_s)
    return np.where(situation.may(tried)[:, None], tried, 0.0)


def enters(
    situation: SwarmSituation, command_m_s: FloatArray, one: int, way: Capsules
) -> BoolArray:
    """Return who comes into the way of one by its command, and is not about to clear it. (n,)"""
    after = situation.granted_zones(command_m_s)
    near = distances_m(after, _repeated(way, len(command_m_s))) < situation.separation_m
    near[one] = False
    return np.asarray(near & situation.is_led & ~situation.is_evading)


def _repeated(way: Capsules, count: int) -> Capsules:
    return way.select(np.zeros(count, np.intp))


def _ways_aside_m(situation: SwarmSituation, one: int, way: Capsules) -> FloatArray:
    """Return how agents get out of a way. (n, 2) [m]

    Who is in it goes to the nearer side; who is in the middle of it to the one where nobody is.  Who is in
    the way of one that goes aside goes ahead of it.
    """
    zones, count = situation.zones, len(situation.rank)
    found = np.zeros((count, 2))
    begin_m, radius_m = way.begin_m[0], way.radius_m[0]
    along = way.end_m[0] - begin_m
    length = float(np.hypot(*along))
    if length <= 0.0:
        return found  # where one stands, coming no nearer is enough
    right = np.array([along[1], -along[0]]) / length
    beside_m = (situation.rest_m - begin_m) @ right
    clear_m = situation.separation_m + radius_m + zones.radius_m
    near = distances_m(zones, _repeated(way, count)) < situation.separation_m
    near &= situation.is_led
    others = situation.is_there.copy()
    others[one] = near[one] = False

    def in_way_of(row: int, aside_m: FloatArray) -> BoolArray:
        begin_m = np.repeat(situation.rest_m[row, None], count, axis=0)
        swept = Capsules.about(begin_m, begin_m + aside_m, np.full(count, zones.radius_m[row]))
        blocks = (distances_m(swept, zones) < situation.separation_m) & others
        blocks[row] = False
        return blocks

    asked = np.flatnonzero(near).tolist()
    for row in asked:
        side = 1.0 if beside_m[row] >= 0.0 else -1.0
        ways_m = [
            side_ * max(clear_m[row] - side_ * beside_m[row], 1.0) * right
            for side_ in (side, -side)
        ]
        is_middle = abs(beside_m[row]) < _MIDDLE_M and in_way_of(row, ways_m[0]).any()
        found[row] = ways_m[int(is_middle and not in_way_of(row, ways_m[1]).any())]
    while asked:
        row = asked.pop()
        blocks = in_way_of(row, found[row]) & situation.is_led & ~differ(found)
        found[blocks] = found[row]
        asked += np.flatnonzero(blocks).tolist()
    return found
