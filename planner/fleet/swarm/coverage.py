"""Which part of an area the agents of a simulation have seen, and when."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.fleet.swarm.simulation import AgentPhase
from planner.fleet.trajectory import thinned
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.fleet.swarm.flights import Record

_CELL = 0.1
"""Size of a cell over the radius: the edge of what is seen is wrong by half of it, a twentieth. [-]"""
_MOST_CELLS = 10**6
_TRACK = 0.02
"""How far a thinned track may be from the one flown, over the radius. [-]"""
_PIECE = 4.0
"""Longer pieces of a track are cut, over the radius: the box about a slanting one is mostly empty. [-]"""


class SearchArea(Value):
    """A rectangle to be seen, and how far each agent sees about it."""

    west_m: float
    south_m: float
    east_m: float
    north_m: float
    radius_m: float

    @property
    def cell_m(self) -> float:
        """Side of the cells it is counted in. [m]"""
        size_m2 = (self.east_m - self.west_m) * (self.north_m - self.south_m)
        return max(_CELL * self.radius_m, math.sqrt(size_m2 / _MOST_CELLS))

    def refuse_too_fine(self) -> None:
        """Raise ``UsageError`` where cells are larger than what a vehicle sees at once."""
        least_m = 0.5 * self.cell_m
        if self.radius_m < least_m:
            msg = (
                f"sensor_radius_m: {quantity.distance(self.radius_m)} is too little for this area, of which "
                f"at most {_MOST_CELLS:,} cells are counted: give {quantity.distance(least_m)} or more (half "
                "of lane_m counts where it is not given), or a smaller area"
            )
            raise UsageError(msg)


class Coverage(Value, eq=False):
    """When each cell of an area was first seen: one seen twice counts once."""

    area: SearchArea
    seen_s: FloatArray
    """By the middle of the cell, from the south-west corner on; infinite: never. (rows, columns) [s]"""

    @property
    def cell_m(self) -> float:
        """Longer side of a cell. [m]"""
        rows, columns = self.seen_s.shape
        area = self.area
        width_m, height_m = area.east_m - area.west_m, area.north_m - area.south_m
        return float(max(width_m / columns, height_m / rows))


class Goal(Value, eq=False):
    """What a swarm is to reach, in equal parts: cells of an area, or agents that are home again."""

    what: str
    """``area seen`` or ``agents home``."""
    reached_s: FloatArray
    """When each part was reached, rising; infinite: never. (parts,) [s]"""

    @classmethod
    def of(cls, what: str, reached_s: FloatArray) -> Goal:
        """Return a goal of parts in any order."""
        return cls(what=what, reached_s=np.sort(reached_s, axis=None))

    @property
    def fraction(self) -> float:
        """Reached at the end. [-]"""
        return float(np.isfinite(self.reached_s).mean()) if len(self.reached_s) else 0.0

    def fraction_at(self, time_s: FloatArray) -> FloatArray:
        """Return which fraction is reached by times. (n,)"""
        found = np.searchsorted(self.reached_s, time_s, side="right")
        return np.asarray(found / max(len(self.reached_s), 1))

    def time_to_s(self, fraction: float) -> float | None:
        """Return when so much is reached; ``None``: never."""
        part = math.ceil(fraction * len(self.reached_s) - 1e-9) - 1
        if part < 0 or not math.isfinite(self.reached_s[part]):
            return None
        return float(self.reached_s[part])


def predict_coverage(record: Record, area: SearchArea) -> Coverage:
    """Return when agents saw the cells of an area: those that fly in the plane, in a circle about them."""
    radius_m = area.radius_m
    width_m, height_m = area.east_m - area.west_m, area.north_m - area.south_m
    side_m = area.cell_m
    columns, rows = (max(math.ceil(one / side_m - 1e-9), 1) for one in (width_m, height_m))
    east = area.west_m + (np.arange(columns) + 0.5) * (width_m / columns)
    north = area.south_m + (np.arange(rows) + 0.5) * (height_m / rows)
    seen_s = np.full((rows, columns), np.inf)
    flies = record.phase == AgentPhase.FLIES
    for agent in np.flatnonzero(flies.any(axis=0)).tolist():
        flown = np.flatnonzero(flies[:, agent])
        for part in np.split(flown, np.flatnonzero(np.diff(flown) > 1) + 1):
            span = np.append(part, part[-1] + 1)
            time_s, place_m = _pieces(record.begin_s[span], record.place_m[span, agent], radius_m)
            low, high = (
                one(place_m[:-1], place_m[1:]) + sign * radius_m
                for one, sign in ((np.minimum, -1.0), (np.maximum, 1.0))
            )
            bounds = [
                np.searchsorted(axis, edge[:, column])
                for column, axis in enumerate((east, north))
                for edge in (low, high)
            ]
            for piece, (west, right, south, top) in enumerate(zip(*bounds, strict=True)):
                if west < right and south < top:
                    box = seen_s[south:top, west:right]
                    offset = (
                        east[None, west:right] - place_m[piece, 0],
                        north[south:top, None] - place_m[piece, 1],
                    )
                    way = place_m[piece + 1] - place_m[piece]
                    part_seen = _first_seen(offset, way, radius_m)
                    begin_s, end_s = time_s[piece : piece + 2]
                    np.minimum(box, begin_s + part_seen * (end_s - begin_s), out=box)
    return Coverage(area=area, seen_s=seen_s)


def _pieces(
    time_s: FloatArray, place_m: FloatArray, radius_m: float
) -> tuple[FloatArray, FloatArray]:
    """Return a track thinned and cut into short straight pieces: (n,) [s], (n, 2) [m]."""
    kept = thinned(time_s, place_m, _TRACK * radius_m)
    time_s, place_m = time_s[kept], place_m[kept]
    length_m = np.hypot(*np.diff(place_m, axis=0).T)
    count = np.maximum(np.ceil(length_m / (_PIECE * radius_m)), 1.0)
    rows = np.append(0.0, np.cumsum(count))
    every = np.arange(rows[-1] + 1.0)
    east, north = (np.interp(every, rows, column) for column in place_m.T)
    return np.interp(every, rows, time_s), np.stack((east, north), axis=1)


def _first_seen(
    offset: tuple[FloatArray, FloatArray], way: FloatArray, radius_m: float
) -> FloatArray:
    """Return after which part of a straight way a circle reaches places; infinite: it does not.

    It does where :math:`|o - p w| = r`, a quadratic equation of the part :math:`p`.
    """
    square = float(way @ way)
    along = offset[0] * way[0] + offset[1] * way[1]
    outside = offset[0] ** 2 + offset[1] ** 2 - radius_m**2
    if square <= 0.0:
        return np.where(outside <= 0.0, 0.0, np.inf)
    root = along**2 - square * outside
    part = (along - np.sqrt(np.maximum(root, 0.0))) / square
    enters = (root >= 0.0) & (part >= 0.0) & (part <= 1.0)
    return np.where(outside <= 0.0, 0.0, np.where(enters, part, np.inf))
