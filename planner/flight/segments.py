"""Segments: a flight cut into states, as columns and one by one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

import numpy as np

from planner.flight.motion.kinematics import STATES
from planner.frozen import frozen
from planner.units import wh_from_j
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy.typing as npt

    from planner.arrays import FloatArray
    from planner.flight.motion.kinematics import (
        FlightState,
        SegmentColumns,
    )
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.resolve import FlightParameters


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


_BISECTIONS = 60


@frozen
class StopRoom:
    """The room a vehicle needs straight ahead to be told to stop, and to stop.

    Notes
    -----
    v t_r + s(v) + max(w, 0) t_r: the way until somebody or something reacts, the way from then to
    standing still, and what the part w of the wind that blows ahead carries it meanwhile.
    """

    vehicle: VehicleModel
    parameters: FlightParameters | None
    """``None``: the vehicle answers reference steps."""
    reaction_time_s: float

    def stopping_distance_m(self, speed_m_s: npt.ArrayLike) -> FloatArray:
        """Return the way from speeds to standing still, told to stop: s(v). [m]

        Parameters
        ----------
        speed_m_s : array_like
            Ground speeds, zero or more. [m s⁻¹]
        """
        speed = np.asarray(speed_m_s, np.float64)
        if self.parameters is None:
            response = self.vehicle.responses.speed
            # A model of step references has one: __post_init__ of the model sees to it.
            residence_s = (
                0.0 if response is None else response.transfer_function.mean_residence_time_s
            )
            way: FloatArray = speed * residence_s
            return way
        if isinstance(self.parameters, Px4Parameters):
            from planner.flight.motion.px4.speeds import stopping_distance_m as px4_way_m

            return px4_way_m(speed, self.parameters)
        from planner.flight.motion.ardupilot.legs import stopping_distance_m as ardupilot_way_m

        return ardupilot_way_m(speed, self.parameters, self.vehicle.responses.speed)

    def needed_m(self, speed_m_s: npt.ArrayLike, tail_wind_m_s: npt.ArrayLike = 0.0) -> FloatArray:
        """Return the room needed straight ahead. [m]

        Parameters
        ----------
        speed_m_s : array_like
            Ground speeds, zero or more. [m s⁻¹]
        tail_wind_m_s : array_like
            Part of the wind that blows ahead; against the flight it helps nothing. [m s⁻¹]
        """
        speed = np.asarray(speed_m_s, np.float64)
        drift = np.maximum(np.asarray(tail_wind_m_s, np.float64), 0.0)
        return (speed + drift) * self.reaction_time_s + self.stopping_distance_m(speed)

    def fitting_speed_m_s(
        self, room_m: float, *, at_most_m_s: float, tail_wind_m_s: float = 0.0
    ) -> float | None:
        """Return the highest speed whose needed room is there, by bisection.

        Parameters
        ----------
        room_m : float
            Room ahead. [m]
        at_most_m_s : float
            A speed that needs more room. [m s⁻¹]
        tail_wind_m_s : float
            Part of the wind that blows ahead. [m s⁻¹]

        Returns
        -------
        float or None
            ``None`` where there is not even room for the drift. [m s⁻¹]
        """
        if self.needed_m(0.0, tail_wind_m_s) > room_m:
            return None
        low, high = 0.0, at_most_m_s
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if self.needed_m(middle, tail_wind_m_s) <= room_m:
                low = middle
            else:
                high = middle
        return low
