"""The ways a vehicle is commanded: which firmware shapes the reference, if any."""

from __future__ import annotations

from enum import StrEnum


class Autopilot(StrEnum):
    """Who turns a mission into references.

    ``STEP`` is the article's way: each reference is a step, answered by the identified model.
    """

    STEP = "step"
    PX4 = "px4"
    ARDUPILOT = "ardupilot"

    @property
    def label(self) -> str:
        """The name as its makers write it."""
        return {"step": "step references", "px4": "PX4", "ardupilot": "ArduPilot"}[self.value]
