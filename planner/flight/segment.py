"""Segments: a flight cut into states, as columns and one by one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.flight.state import FlightState


@dataclass(frozen=True, slots=True, kw_only=True)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemArrival:
    """When an item is done, and what it took to get there."""

    item: int
    command: str
    arrival_s: float | None
    """From the start of the take-off; ``None`` where the item is not flown. [s]"""
    energy_used_wh: float | None
