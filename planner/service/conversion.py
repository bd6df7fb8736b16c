"""Missions written in another file format."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.mission.convert import mission_at_speed
from planner.mission.files import read_mission, write_mission
from planner.values import Value

if TYPE_CHECKING:
    from pathlib import Path

    from planner.findings import Finding


class ConversionResult(Value):
    """A mission written to another file."""

    file: str
    target: str
    items: int
    """How many items were written, home not counted."""
    findings: tuple[Finding, ...]
    """What reading the mission brought to light."""
    losses: tuple[Finding, ...]
    """What the target does not hold, and what reading it brings to light."""


def convert_file(
    source: Path | str, target: Path | str, *, speed_m_s: float | None = None
) -> ConversionResult:
    """Read a mission and write it in the format that the target's suffix names.

    Raises MissionFileError if the mission cannot be read.
    Raises UsageError if the suffix names no format, or nothing flies at the speed.
    Raises OutputError if the format cannot hold the mission, or the file cannot be written.
    """
    mission = read_mission(source)
    if speed_m_s is not None:
        mission = mission_at_speed(mission, speed_m_s)
    return ConversionResult(
        file=mission.source,
        target=str(target),
        items=len(mission.items),
        findings=mission.findings,
        losses=write_mission(mission, target),
    )
