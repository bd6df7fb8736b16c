"""Points of a flight with the ways home from them."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.arrays import FloatArray, IntArray


@frozen(eq=False)
class ReturnNodes:
    """Points of a flight with the way to where the vehicle itself would return from them."""

    segment: IntArray
    """(n,)"""
    share: FloatArray
    """(n,) [-]"""
    destination: IntArray
    """``HOME`` or a rally point. (n,)"""
    used_wh: FloatArray
    way_wh: FloatArray
    """Energy to stop, return and land. (n,) [Wh]"""
    way_s: FloatArray
    home_j: FloatArray
    """Energy by state to return and land, without the stop. (n, states) [J]"""
    slack_wh: FloatArray
    """What the way could cost more for the stop at its beginning. (n,) [Wh]"""
    away_m: FloatArray
    """Horizontal distance of the way, after the stop. (n,) [m]"""
    height_m: FloatArray
    """Height above home where the way begins. (n,) [m]"""

    @property
    def sum_wh(self) -> FloatArray:
        """Energy used by the time the vehicle has landed. (n,) [Wh]"""
        return self.used_wh + self.way_wh

    def at(self, row: int) -> tuple[int, float]:
        """Return the segment and the share of a node."""
        return int(self.segment[row]), float(self.share[row])

    def joined(self, other: ReturnNodes) -> ReturnNodes:
        """Return both in flown order."""
        columns = {
            name: np.concatenate((getattr(self, name), getattr(other, name))) for name in _COLUMNS
        }
        order = np.lexsort((columns["share"], columns["segment"]))
        return ReturnNodes(**{name: column[order] for name, column in columns.items()})


_COLUMNS = tuple(column.name for column in fields(ReturnNodes))
