"""The conditions of a flight: air, wind, home and load."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from planner.physics.wind import Wind

MOST_NOISE_M = 1.5
"""PX4 stands still at an error of MPC_XY_ERR_MAX, 2 m by default; this is short of it. [m]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """What a flight meets, besides its mission and its vehicle."""

    wind: Wind = field(default_factory=Wind)
    home_amsl_m: float | None = None
    """Altitude of the take-off place; ``None``: the mission's own. [m AMSL]"""
    temperature_c: float | None = None
    """Air temperature at home; ``None``: standard for its altitude. [°C]"""
    payload_kg: float = 0.0
    """Mass carried beyond the model's own. [kg]"""
    position_noise_m: float = 0.0
    """Mean horizontal error of the position in a hover, which slows PX4's time down. [m]"""

    def __post_init__(self) -> None:
        if self.home_amsl_m is not None and not -500.0 <= self.home_amsl_m <= 9000.0:
            msg = f"home_amsl_m must be a place on Earth (−500 to 9000 m), got {self.home_amsl_m}"
            raise ValueError(msg)
        if self.temperature_c is not None and not -90.0 <= self.temperature_c <= 60.0:
            msg = f"temperature_c must be −90 to 60 °C, got {self.temperature_c}"
            raise ValueError(msg)
        if not 0.0 <= self.position_noise_m <= MOST_NOISE_M:
            msg = f"position_noise_m must be 0 to {MOST_NOISE_M:g} m, got {self.position_noise_m}"
            raise ValueError(msg)
        if not (math.isfinite(self.payload_kg) and self.payload_kg >= 0.0):
            msg = f"payload_kg must be zero or more, got {self.payload_kg}"
            raise ValueError(msg)
