"""A stage before its place is laid into the frame of home."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.mission.stage import StageKind


@dataclass(slots=True)
class Draft:
    """A stage whose place is still in degrees.

    Its fields are those of `planner.mission.stage.Stage`, in their order: latitude and longitude stand
    for east and north.
    """

    kind: StageKind
    item: int
    latitude_deg: float
    longitude_deg: float
    height_m: float
    speed_m_s: float | None = None
    climb_speed_m_s: float | None = None
    descent_speed_m_s: float | None = None
    hold_s: float = 0.0
    acceptance_radius_m: float | None = None
    yaw_deg: float | None = None
    turns: float = 0.0
    radius_m: float = 0.0
    followed_ground_m: tuple[float, ...] = ()
