"""What is asked of an identification: what no log tells, and how to go about it."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

from planner.identify.discharges import PackSettings

if TYPE_CHECKING:
    import datetime as dt

    from planner.autopilot import Autopilot
    from planner.vehicle.model import VehicleModel


class Method(StrEnum):
    """How responses are fitted."""

    OUTPUT_ERROR = "output-error"
    """In continuous time, by output error: consistent."""
    ARX = "arx"
    """As the article does: noise biases it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentificationSettings:
    """What no log tells, and how to go about it."""

    name: str
    """Of the model; also the stem of its file."""
    date: dt.date
    """Day the model is made."""
    version: str
    """Of this program."""
    description: str | None = None
    readings: tuple[str, ...] = ()
    """What whoever uses the numbers has to know besides."""
    reference: Autopilot | None = None
    """Who shapes the reference; ``None``: as the logs say, step references where they do not."""
    mass_kg: float | None = None
    """Take-off mass with battery, without payload. [kg]"""
    payload_kg: float = 0.0
    """Carried in the flights beyond it. [kg]"""
    payload_deviation_kg: float = 0.0
    """Standard deviation of a payload that is not known from flight to flight. [kg]"""
    temperature_c: float | None = None
    """Air temperature at home in the flights; ``None``: of the standard atmosphere. [°C]"""
    position_noise_m: float = 0.0
    """What the model assumes of the position in a hover. [m]"""
    pack: PackSettings = field(default_factory=PackSettings)
    method: Method = Method.OUTPUT_ERROR
    base: VehicleModel | None = None
    """Gives what the flights do not tell."""
