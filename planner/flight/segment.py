"""Segments: a flight cut into states, as columns and one by one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

import numpy as np

from planner.flight.state import STATES
from planner.frozen import frozen
from planner.units import wh_from_j

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.flight.motion.kinematics import FloatArray, SegmentColumns
    from planner.flight.state import FlightState


@frozen
class Segment:
    """One stretch of flight in one state."""

    index: int
    item: int
    """Mission item from 1 that asks for it, home not counted."""
    state: FlightState
    start_s: float
    duration_s: float
    distance_m: float
    """Horizontal distance flown. [m]"""
    climb_m: float
    """Change of height, negative downwards. [m]"""
    speed_m_s: float
    """Highest horizontal speed in the segment; vertical speed where it is only vertical. [m s⁻¹]"""
    energy_wh: float
    stopping_distance_m: float | None
    """Distance to stand still from its speed, for cruise and brake. [m]"""
    stopping_distance_m_p90: float | None = None
    """Exceeded by one flight of ten; ``None`` while the model carries no spread of it. [m]"""


class Segments(Sequence[Segment]):
    """The segments of a flight, made one by one where they are looked at.

    A survey of 10,000 items has 70,000 of them; its verdict needs only their columns.
    """

    __slots__ = ("_columns", "_energy_j", "_start_s", "_stopping_factor_p90")

    def __init__(
        self,
        columns: SegmentColumns,
        energy_j: FloatArray,
        *,
        stopping_factor_p90: float | None = None,
    ) -> None:
        self._columns = columns
        self._energy_j = energy_j
        self._stopping_factor_p90 = stopping_factor_p90
        self._start_s = columns.end_s - columns.duration_s

    def __len__(self) -> int:
        return len(self._energy_j)

    @overload
    def __getitem__(self, index: int) -> Segment: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Segment, ...]: ...
    def __getitem__(self, index: int | slice) -> Segment | tuple[Segment, ...]:
        if isinstance(index, slice):
            return tuple(self[i] for i in range(*index.indices(len(self))))
        index = range(len(self))[index]
        columns = self._columns
        stopping_m = float(columns.stopping_distance_m[index])
        stops, factor_p90 = not np.isnan(stopping_m), self._stopping_factor_p90
        return Segment(
            index=index,
            item=int(columns.item[index]),
            state=STATES[columns.state[index]],
            start_s=float(self._start_s[index]),
            duration_s=float(columns.duration_s[index]),
            distance_m=float(columns.distance_m[index]),
            climb_m=float(columns.climb_m[index]),
            speed_m_s=float(columns.speed_m_s[index]),
            energy_wh=float(wh_from_j(self._energy_j[index])),
            stopping_distance_m=stopping_m if stops else None,
            stopping_distance_m_p90=(
                stopping_m * factor_p90 if stops and factor_p90 is not None else None
            ),
        )

    def __iter__(self) -> Iterator[Segment]:
        return (self[index] for index in range(len(self)))


@frozen
class ItemArrival:
    """When an item is done, and what it took to get there."""

    item: int
    command: str
    arrival_s: float | None
    """From the start of the take-off; ``None`` where the item is not flown. [s]"""
    energy_used_wh: float | None
