"""The wind as a vector."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind:
    """A steady horizontal wind."""

    speed_m_s: float = 0.0
    from_deg: float = 0.0
    """Direction it blows from, clockwise from north. [°]"""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.speed_m_s) and self.speed_m_s >= 0.0):
            msg = f"wind speed_m_s must be zero or more, got {self.speed_m_s}"
            raise ValueError(msg)
        if not math.isfinite(self.from_deg):
            msg = f"wind from_deg must be a number, got {self.from_deg}"
            raise ValueError(msg)

    @property
    def east_m_s(self) -> float:
        """Eastward component of the moving air. [m s⁻¹]"""
        return -self.speed_m_s * math.sin(math.radians(self.from_deg))

    @property
    def north_m_s(self) -> float:
        """Northward component of the moving air. [m s⁻¹]"""
        return -self.speed_m_s * math.cos(math.radians(self.from_deg))
