"""The speed curve: energy and time of a mission over the speed of its level legs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.vehicle.declared import Interval


class FlownSpeed(Value):
    """A mission flown at one speed; everything but time is ``None`` where the power is not known."""

    speed_m_s: float | None
    """Over ground, on every level leg; ``None``: legs have several, as the file commands. [m s⁻¹]"""
    time_s: float
    energy_wh: float | None
    mean_power_w: float | None
    energy_wh_per_km: float | None
    """Over the distance flown. [Wh km⁻¹]"""
    margin_wh: float | None
    """Above the reserve at landing; ``None`` with no battery. [Wh]"""
    return_margin_wh: float | None
    """Above the reserve at home, from the point whose return is tightest. [Wh]"""
    fits: bool | None
    """Whether the battery does for it: no finding of energy makes it a no-go; ``None``: not known."""
    verdict: str
    against: tuple[str, ...]
    """Codes of the findings that make it a no-go, and of those about the fence."""


class SpeedCurve(Value):
    """Energy and time of a mission over the speed of its level legs, and the speeds worth knowing."""

    file: str
    vehicle_name: str
    vehicle_source: str
    points: tuple[FlownSpeed, ...]
    """Rising speeds, evenly over the range."""
    present: FlownSpeed
    """As the file commands it."""
    best_endurance: FlownSpeed | None
    """Least mean power; this and the next are ``None`` where the model knows no power over speed."""
    best_range: FlownSpeed | None
    """Least energy, and so least energy per distance in this wind."""
    fastest_fitting: FlownSpeed | None
    """Fastest the battery does for, above the reserve and on every return; ``None``: none."""
    fastest_clear: FlownSpeed | None
    """Fastest that is a go with room to the fence, too: no finding of it; ``None``: none."""
    identified_m_s: Interval | None
    """Airspeeds the model was identified at. [m s⁻¹]"""
    is_power_over_speed_known: bool
    """Whether the model knows how its power changes with the airspeed."""
    findings: tuple[Finding, ...]
    """Of the mission as the file commands it."""

    @property
    def speed_m_s(self) -> FloatArray:
        """Speeds of the points. (n,) [m s⁻¹]"""
        return _column(self.points, "speed_m_s")

    @property
    def time_s(self) -> FloatArray:
        """Time of the mission at each. (n,) [s]"""
        return _column(self.points, "time_s")

    @property
    def energy_wh(self) -> FloatArray:
        """Energy of the mission at each, NaN where it is not known. (n,) [Wh]"""
        return _column(self.points, "energy_wh")

    @property
    def mean_power_w(self) -> FloatArray:
        """Mean power at each, NaN where it is not known. (n,) [W]"""
        return _column(self.points, "mean_power_w")

    @property
    def margin_wh(self) -> FloatArray:
        """Energy above the reserve at each, NaN where no battery is known. (n,) [Wh]"""
        return _column(self.points, "margin_wh")

    def marks(self) -> tuple[tuple[str, FlownSpeed], ...]:
        """Return the speeds worth knowing by name, those there are."""
        named = (
            ("present", self.present),
            ("best endurance", self.best_endurance),
            ("best range", self.best_range),
            ("fastest that fits", self.fastest_fitting),
            ("fastest clear of all", self.fastest_clear),
        )
        return tuple((name, flown) for name, flown in named if flown is not None)


def _column(points: tuple[FlownSpeed, ...], name: str) -> FloatArray:
    values = [getattr(point, name) for point in points]
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)
