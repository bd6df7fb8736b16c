"""The conditions of a flight: air, wind, home and load."""

from __future__ import annotations

import math

from planner.physics.wind import Wind
from planner.values import Value, field


class Spread(Value):
    """A normally distributed quantity, for example a payload of 0.5 ± 0.1 kg."""

    mean: float
    sd: float
    """Standard deviation. [unit of the mean]"""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and math.isfinite(self.sd) and self.sd >= 0.0):
            msg = f"a spread is a number ± zero or more, got {self.mean} ± {self.sd}"
            raise ValueError(msg)


def divided(value: float | Spread) -> tuple[float, float]:
    """Return the mean and the standard deviation, zero for what is known exactly."""
    return (value.mean, value.sd) if isinstance(value, Spread) else (value, 0.0)


def joined(mean: float, sd: float) -> float | Spread:
    """Return a quantity of a mean and a standard deviation, a number where it is known exactly."""
    return Spread(mean=mean, sd=sd) if sd else mean


MOST_NOISE_M = 1.5
"""PX4 stands still at an error of MPC_XY_ERR_MAX, 2 m by default; this is short of it. [m]"""

MOST_RESISTANCE_FACTOR = 20.0
"""A battery with more is not flown: a resistance was given, not a factor. [-]"""

MOST_CAUTION = 100.0
"""More seconds, or metres, to keep from a fence were mistyped."""


class Conditions(Value):
    """What a flight meets, besides its mission and its vehicle."""

    wind: Wind = field(default_factory=Wind)
    home_amsl_m: float | None = None
    """Altitude of the take-off place; ``None``: the mission's own. [m AMSL]"""
    temperature_c: float | None = None
    """Air temperature at home; ``None``: standard for its altitude. [°C]"""
    payload_kg: float = 0.0
    """Mass carried beyond the model's own. [kg]"""
    position_noise_m: float | None = None
    """Mean horizontal error of the position in a hover, which slows PX4's time down; ``None``: the
    vehicle's own. [m]"""
    battery_health: float | None = None
    """Charge of the battery over that of the new one; ``None``: as the battery says. [-]"""
    battery_resistance_factor: float | None = None
    """Resistance of the battery over that of the new one; ``None``: as the battery says. [-]"""
    battery_temperature_c: float | None = None
    """Temperature of the battery; ``None``: that of the air at home. [°C]"""
    reaction_time_s: float = 1.0
    """Time until somebody or something reacts to a vehicle that goes where it should not. [s]"""
    position_error_m: float = 2.5
    """How far the vehicle may be from where it takes itself to be. [m]"""
    payload_sd_kg: float = 0.0
    """Standard deviation of the payload; this and the next for the spread of a prediction. [kg]"""
    temperature_sd_c: float = 0.0
    """Standard deviation of the air temperature. [°C]"""

    def __post_init__(self) -> None:
        if self.home_amsl_m is not None and not -500.0 <= self.home_amsl_m <= 9000.0:
            msg = f"home_amsl_m must be a place on Earth (−500 to 9000 m), got {self.home_amsl_m}"
            raise ValueError(msg)
        for name in ("temperature_c", "battery_temperature_c"):
            degrees_c = getattr(self, name)
            if degrees_c is not None and not -90.0 <= degrees_c <= 60.0:
                msg = f"{name} must be −90 to 60 °C, got {degrees_c}"
                raise ValueError(msg)
        self._refuse_battery()
        noise_m = self.position_noise_m
        if noise_m is not None and not 0.0 <= noise_m <= MOST_NOISE_M:
            msg = f"position_noise_m must be 0 to {MOST_NOISE_M:g} m, got {noise_m}"
            raise ValueError(msg)
        for name, value in (
            ("reaction_time_s", self.reaction_time_s),
            ("position_error_m", self.position_error_m),
        ):
            if not 0.0 <= value <= MOST_CAUTION:
                msg = f"{name} must be 0 to {MOST_CAUTION:g}, got {value}"
                raise ValueError(msg)
        for name, value in (
            ("payload_kg", self.payload_kg),
            ("payload_sd_kg", self.payload_sd_kg),
            ("temperature_sd_c", self.temperature_sd_c),
        ):
            if not 0.0 <= value < math.inf:
                msg = f"{name} must be zero or more, got {value}"
                raise ValueError(msg)

    def _refuse_battery(self) -> None:
        if self.battery_health is not None and not 0.0 < self.battery_health <= 1.0:
            msg = f"battery_health must be above 0 and at most 1, got {self.battery_health}"
            raise ValueError(msg)
        factor = self.battery_resistance_factor
        if factor is not None and not 1.0 <= factor <= MOST_RESISTANCE_FACTOR:
            msg = f"battery_resistance_factor must be 1 to {MOST_RESISTANCE_FACTOR:g}, got {factor}"
            raise ValueError(msg)

    @property
    def payload_spread_kg(self) -> float | Spread:
        """Payload, as a number where it is known exactly. [kg]"""
        return joined(self.payload_kg, self.payload_sd_kg)

    @property
    def temperature_spread_c(self) -> float | Spread | None:
        """Air temperature, as a number where it is known exactly. [°C]"""
        return (
            None
            if self.temperature_c is None
            else joined(self.temperature_c, self.temperature_sd_c)
        )
