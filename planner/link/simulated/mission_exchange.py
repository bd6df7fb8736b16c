"""A list of items on its way to or from a simulated vehicle, and how patient each autopilot is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.frozen import frozen
from planner.link.mission_kind import MissionKind

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.message import Message
    from planner.link.mission_transfer import WireItem


@frozen
class Manners:
    """In what two autopilots differ."""

    retry_s: float
    """Until an item is asked for again. [s]"""
    timeout_s: float
    """Of silence, until a transfer is given up. [s]"""
    most_items: Mapping[MissionKind, int]


MANNERS: Mapping[Autopilot, Manners] = {
    Autopilot.PX4: Manners(
        retry_s=0.25,
        timeout_s=5.0,
        most_items={MissionKind.MISSION: 2000, MissionKind.FENCE: 64, MissionKind.RALLY: 20},
    ),
    Autopilot.ARDUPILOT: Manners(
        retry_s=1.0,
        timeout_s=8.0,
        most_items={MissionKind.MISSION: 724, MissionKind.FENCE: 84, MissionKind.RALLY: 17},
    ),
}


class Upload:
    """A list that is coming in."""

    def __init__(self, first: Message, kind: MissionKind, *, start: int, end: int) -> None:
        self.partner = first
        self.kind = kind
        self.next = start
        self.end = end
        self.items: list[WireItem] = []
        self.last_item_s = 0.0


class Download:
    """A list that goes out."""

    def __init__(self, first: Message, kind: MissionKind, until_s: float) -> None:
        self.partner = first
        self.kind = kind
        self.until_s = until_s
        """When it is forgotten, unless it is asked for something before. [s]"""
        self.next = 0

    def is_of(self, received: Message, kind: MissionKind) -> bool:
        """Return whether a message is about it."""
        return (kind, received.system) == (self.kind, self.partner.system)
