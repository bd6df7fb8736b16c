"""The ways a vehicle is commanded: which firmware shapes the reference, if any."""

from __future__ import annotations

from enum import StrEnum

from planner.values import Value


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


class Target(Value, kw_only=False):
    """A version of a firmware, whose rules count."""

    autopilot: Autopilot
    version: tuple[int, int] | None = None
    """Major and minor version; ``None`` where it is not known."""
    is_assumed: bool = False
    """Whether it is only what the vehicle's model assumes: nobody named it."""

    @property
    def label(self) -> str:
        """The name as its makers write it, with the version: ``ArduCopter 4.7``."""
        if self.version is None:
            return self.autopilot.label
        name = "ArduCopter" if self.autopilot is Autopilot.ARDUPILOT else self.autopilot.label
        return f"{name} {self.version[0]}.{self.version[1]}"


TARGETS = {
    "px4-1.15": Target(Autopilot.PX4, (1, 15)),
    "px4-1.16": Target(Autopilot.PX4, (1, 16)),
    "px4-1.17": Target(Autopilot.PX4, (1, 17)),
    "arducopter-4.5": Target(Autopilot.ARDUPILOT, (4, 5)),
    "arducopter-4.6": Target(Autopilot.ARDUPILOT, (4, 6)),
    "arducopter-4.7": Target(Autopilot.ARDUPILOT, (4, 7)),
    "arducopter-4.8": Target(Autopilot.ARDUPILOT, (4, 8)),
}
"""The versions whose differences are known, by the names users give them."""
TARGETS_SHOWN = ("px4-1.16", "arducopter-4.7")
"""One of each autopilot, where there is no room for all."""
