"""A mission on its way to a vehicle: sent, read back, listened to; the old one put back if it breaks."""

from __future__ import annotations

import re
import struct
from dataclasses import astuple
from typing import TYPE_CHECKING

from planner.errors import LinkError, UsageError
from planner.frozen import frozen
from planner.link.mission_items import lists_of_mission, mission_of_lists
from planner.link.mission_kind import MissionKind
from planner.link.mission_transfer import UploadOutcome
from planner.mission.comparison import compare_missions

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.link.mission_transfer import WireItem
    from planner.link.vehicle import StatusText, VehicleLink
    from planner.mission.difference import Difference
    from planner.mission.items import Mission

_ORDER = (MissionKind.FENCE, MissionKind.RALLY, MissionKind.MISSION)
"""PX4 judges a mission by the fence it has when the mission comes."""
_WARNING = 4
"""MAV_SEVERITY_WARNING; greater numbers are less."""
_REJECTION = re.compile(
    r"reject|refus|infeasible|not feasible|mission.*(invalid|denied|fail|unsupported)|"
    r"invalid mission|prearm: .*(mission|waypoint|fence|rally|item)",
    re.IGNORECASE,
)


@frozen
class UploadResult:
    """What became of a mission that was sent."""

    rejection: str = ""
    """Why the vehicle refused it; empty where it did not."""
    differences: tuple[Difference, ...] = ()
    """Between what was sent and what was read back."""
    texts: tuple[StatusText, ...] = ()
    """What the vehicle said to it."""
    restored: bool | None = None
    """Whether the old mission is on the vehicle again, and was read back; ``None``: the new one is."""

    @property
    def is_good(self) -> bool:
        """Whether the mission is on the vehicle as it was meant, and nothing was said against it."""
        return not self.rejection and not any(one.matters for one in self.differences)


class BrokenUploadError(LinkError):
    """The line broke, and what is on the vehicle now is not known to be whole."""


def upload_mission(
    link: VehicleLink,
    mission: Mission,
    *,
    listen_s: float,
    restore_timeout_s: float = 10.0,
) -> UploadResult:
    """Put a mission, its fence and its rally points in place of those on a vehicle.

    Parameters
    ----------
    link : VehicleLink
        Opened for an upload.
    mission : Mission
        What to send.
    listen_s : float
        How long the vehicle is listened to afterwards. [s]
    restore_timeout_s : float
        How long to wait for the vehicle after the line broke. [s]

    Raises
    ------
    LinkError
        If the line breaks; the message says what is on the vehicle then.
    UsageError
        If an item cannot be sent, or the vehicle keeps no list of its kind.
    """
    before = {kind: link.fetch_items(kind) for kind in MissionKind}
    wanted = _lists(link, mission, before)
    touched: list[MissionKind] = []
    link.listen(0.0)  # what was said before is about something else
    try:
        for kind in _ORDER:
            had = before[kind]
            if had is None or (kind is not MissionKind.MISSION and is_same(had, wanted[kind])):
                continue
            touched.append(kind)
            outcome, why = link.upload_items(kind, wanted[kind])
            if outcome is UploadOutcome.REJECTED:
                rejection = f"the vehicle refuses the {kind.label}: {why}"
                restored = _restore(link, before, touched)
                return UploadResult(rejection=rejection, restored=restored)
        back = {kind: link.fetch_items(kind) for kind in MissionKind}
        read = mission_of_lists(back, link.identity, home=mission.home, source=mission.source)
        differences = compare_missions(mission, read, autopilot=link.identity.autopilot)
        if any(one.matters for one in differences):
            restored = _restore(link, before, touched)
            return UploadResult(differences=differences, restored=restored)
    except (LinkError, KeyboardInterrupt) as error:
        sent = {kind: wanted[kind] for kind in touched}
        raise _after_break(link, before, sent, error, restore_timeout_s) from error
    texts = link.listen(listen_s)
    rejections = [one.text for one in texts if is_rejection(one)]
    return UploadResult(
        rejection="; ".join(dict.fromkeys(rejections)), differences=differences, texts=texts
    )


def is_rejection(said: StatusText) -> bool:
    """Return whether a text of the vehicle refuses a mission."""
    return said.severity <= _WARNING and _REJECTION.search(said.text) is not None


def is_same(first: Sequence[WireItem], second: Sequence[WireItem]) -> bool:
    """Return whether two lists are the same on the line; what is no number is so in both."""
    return [_content(one) for one in first] == [_content(one) for one in second]


def _content(item: WireItem) -> tuple[object, ...]:
    return tuple(
        struct.pack("<f", value) if isinstance(value, float) else value for value in astuple(item)
    )


def _lists(
    link: VehicleLink,
    mission: Mission,
    before: Mapping[MissionKind, tuple[WireItem, ...] | None],
) -> dict[MissionKind, tuple[WireItem, ...]]:
    slots = before[MissionKind.MISSION] or ()
    home_slot = slots[0] if link.identity.has_home_slot and slots else None
    wanted = lists_of_mission(mission, link.identity, home_slot=home_slot)
    for kind, items in wanted.items():
        if items and before[kind] is None:
            msg = f"the vehicle keeps no {kind.label}, and the mission has some: it is not sent"
            raise UsageError(msg)
    return wanted


def _restore(
    link: VehicleLink,
    before: Mapping[MissionKind, tuple[WireItem, ...] | None],
    touched: Sequence[MissionKind],
) -> bool:
    """Put the old lists back; return whether they were read back so."""
    skipped = 1 if link.identity.has_home_slot else 0
    for kind in touched:
        old = before[kind] or ()
        back = link.fetch_items(kind) or ()
        start = skipped if kind is MissionKind.MISSION else 0
        if not is_same(back[start:], old[start:]):
            link.upload_items(kind, old)
            back = link.fetch_items(kind) or ()
        if not is_same(back[start:], old[start:]):
            return False
    return True


def _after_break(
    link: VehicleLink,
    before: Mapping[MissionKind, tuple[WireItem, ...] | None],
    sent: Mapping[MissionKind, tuple[WireItem, ...]],
    error: LinkError | KeyboardInterrupt,
    timeout_s: float,
) -> LinkError:
    """Return the error to raise after a break: what is on the vehicle, as far as it is known."""
    why = str(error) or "interrupted"
    if not sent:
        return LinkError(f"{why}; nothing was sent, the vehicle has what it had")
    try:
        if link.is_heard(timeout_s) and _restore(link, before, tuple(sent)):
            return LinkError(f"{why}; the old mission is on the vehicle, it was read back whole")
    except LinkError:
        pass
    lists = ", ".join(kind.label for kind in sent)
    counts = ", ".join(str(len(items)) for items in sent.values())
    return BrokenUploadError(
        f"{why}; the vehicle does not answer any more: it may have the old {lists}, the new "
        f"({counts} items) or, if it is no PX4, a mixture: read it back by mavjoule diff before "
        "anyone arms"
    )
