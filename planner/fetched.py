"""The mark by which a plan and a parameter file that were read from a vehicle together know each other."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Self

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping

KEY = "fetched"
"""Of a plan, where QGroundControl and MAVSDK pass over keys that they do not know."""
_COMMENT = "# Fetched: "
"""Begins the line of a parameter file."""
_TEXT = (
    r"(?a)(?P<time>\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ) vehicle (?P<vehicle>[0-9a-f]{1,64}|-) "
    r"parameters (?P<parameters>[0-9a-f]{16})"
)
_SELF_SET = (
    *("STAT_", "LND_FLIGHT_T", "COM_FLIGHT_UUID", "_HASH_CHECK"),
    *("BARO", "INS_", "COMPASS_", "CAL_", "MOT_THST_HOVER"),
)
"""How parameters begin that autopilots set by themselves: counters, and what is calibrated at the start or
learned in flight (ArduPilot's INS_GYR_CAL, COMPASS_LEARN and MOT_HOVER_LEARN, PX4's mag calibration)."""


class FetchMark(Value):
    """When and of which vehicle a file was fetched, and with which parameters."""

    time: str
    """UTC, to the second: ``2026-11-22T20:15:04Z``; times compare as texts do."""
    vehicle: str
    """The autopilot's own number; empty where it sends none."""
    parameters: str
    """Of the values that do not change by themselves, the first 16 digits of their SHA-256."""

    @classmethod
    def of(cls, time: str, vehicle: str, values: Mapping[str, str]) -> Self:
        """Return the mark of what is fetched now."""
        import hashlib

        lasting = sorted(pair for pair in values.items() if not pair[0].startswith(_SELF_SET))
        content = "\n".join(" ".join(pair) for pair in lasting)
        digest = hashlib.sha256(content.encode()).hexdigest()[:16]
        return cls(time=time, vehicle=vehicle, parameters=digest)

    @classmethod
    def read(cls, text: object) -> Self | None:
        """Return the mark in the value of a plan's key; ``None`` where it is none."""
        found = re.fullmatch(_TEXT, text) if isinstance(text, str) else None
        if found is None:
            return None
        return cls(
            time=found["time"],
            vehicle=found["vehicle"].removeprefix("-"),
            parameters=found["parameters"],
        )

    @classmethod
    def read_comment(cls, line: str) -> Self | None:
        """Return the mark in a line of a parameter file; ``None`` where it is none."""
        return cls.read(line.removeprefix(_COMMENT)) if line.startswith(_COMMENT) else None

    @property
    def text(self) -> str:
        """As a plan has it."""
        return f"{self.time} vehicle {self.vehicle or '-'} parameters {self.parameters}"

    @property
    def comment(self) -> str:
        """The line of a parameter file."""
        return f"{_COMMENT}{self.text}"
