"""A mission on its way to a vehicle: sent, read back, listened to; the old one put back if it breaks."""

from __future__ import annotations

import re
import struct
from typing import TYPE_CHECKING

from planner.errors import (
    CheckFailedError,
    ExitCode,
    LinkError,
    MavjouleError,
    UsageError,
    bug_text,
)
from planner.link.mission import MissionKind, UploadOutcome, lists_of_mission, mission_of_lists
from planner.link.transfers import LinkSettings
from planner.mission.compare import compare_missions
from planner.values import Value, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from typing import ClassVar

    from planner.link.mission import WireItem
    from planner.link.telemetry import StatusText, VehicleEvent
    from planner.link.vehicle import VehicleLink
    from planner.mission.compare import Difference
    from planner.mission.items import Mission


_ERROR, _WARNING = 3, 4
"""MAV_SEVERITY; greater numbers are less."""
_REJECTION = re.compile(
    r"reject|refus|infeasible|not feasible|mission.*(invalid|denied|fail|unsupported)|"
    r"invalid mission|prearm: .*(mission|waypoint|fence|rally|item)|"
    # PX4's feasibility check names no mission in these.
    r"geofence (violation|breach|requires|invalid)|first waypoint too far|"
    r"waypoint and gate too close",
    re.IGNORECASE,
)
_ADVICE = frozenset({"navigator_mis_correct_glide_slope"})
"""What comes after a rejection, to mend it."""


def objections(texts: Sequence[StatusText], events: Sequence[VehicleEvent]) -> tuple[str, ...]:
    """Return what a vehicle reports against a mission, each once; PX4 sends most as text and as event."""
    reports = [one.text for one in texts if is_rejection(one)]
    if not reports:
        reports = [_event_text(one) for one in events if is_event_rejection(one)]
    return tuple(dict.fromkeys(reports))


def is_rejection(report: StatusText) -> bool:
    """Return whether a text of the vehicle refuses a mission."""
    return report.severity <= _WARNING and _REJECTION.search(report.text) is not None


def is_event_rejection(event: VehicleEvent) -> bool:
    """Return whether an event refuses a mission: PX4's warnings leave it accepted."""
    return event.severity <= _ERROR and event.name not in {"", *_ADVICE}


def _event_text(event: VehicleEvent) -> str:
    where = "" if event.item is None else f" at item {event.item}"
    return f"{event.name}{where} (mavjoule explain {event.name})"


_ORDER = (MissionKind.FENCE, MissionKind.RALLY, MissionKind.MISSION)
"""PX4 judges a mission by the fence it has when the mission comes."""


def sending_order(lists: Mapping[MissionKind, Sequence[WireItem]]) -> tuple[MissionKind, ...]:
    """Return the kinds of lists in the order in which they replace those of a vehicle.

    What is there comes first, what is removed goes last, the mission before its fence: wherever this
    program is killed, no mission is without the fence that it came with.
    """
    there = tuple(kind for kind in _ORDER if lists[kind])
    return there + tuple(kind for kind in reversed(_ORDER) if not lists[kind])


_SETTLED_S = 1.0
"""In which PX4's navigator has judged what it was sent. [s]"""
LONGEST_S = 3.0
"""How long a vehicle is listened to that does not show that it would fly its mission: so often PX4 says \
which its latest report is, and a lost one is known by then. [s]"""
_LOOKS = 3
_RESTORE_S = 20.0
"""How long the vehicle is waited for after the line broke. [s]"""
_RESTORE_TRIES = 3
_FORGOTTEN_S = 6.0
"""A vehicle that was left in a transfer is busy: PX4 forgets it after 5 s, ArduPilot after 8 s. [s]"""


class UploadResult(Value):
    """What became of a mission that was sent."""

    rejection: str = ""
    """Why the vehicle refused it; empty where it did not."""
    differences: tuple[Difference, ...] = ()
    """Between what was sent and what was read back."""
    texts: tuple[StatusText, ...] = ()
    is_unjudged: bool = False
    """Whether the vehicle has not judged it yet, for want of a place that it is at."""
    restored: bool | None = None
    """Whether the old mission is on the vehicle again, and was read back; ``None``: the new one is."""
    spans_s: Mapping[str, float] = {}
    """How long each part of it took, in their order. [s]"""

    @property
    def is_good(self) -> bool:
        """Whether the mission is on the vehicle as it was meant, without an objection."""
        return not self.rejection and not any(one.matters for one in self.differences)


class BrokenUploadError(LinkError):
    """The line broke, and what is on the vehicle now is not known to be whole."""


class InterruptedUploadError(LinkError):
    """Somebody stopped it; the message names what is on the vehicle."""

    exit_code: ClassVar[ExitCode] = ExitCode.INTERRUPTED


def upload_mission(
    link: VehicleLink,
    mission: Mission,
    *,
    listen_s: float | None = None,
    kept: Collection[MissionKind] = (),
    has_home: bool = True,
) -> UploadResult:
    """Put a mission, its fence and its rally points in place of those on a vehicle.

    The vehicle is listened to for ``listen_s`` afterwards, by default until it shows that it would fly
    the mission and has reported nothing else, `LONGEST_S` at most.  Lists that are kept stay as it has
    them, and the mission has the same.  PX4 judges no mission before it has a home.

    Raises LinkError if the line breaks, or somebody stops it, and CheckFailedError of a bug; the message
    names what is on the vehicle then.
    Raises UsageError if an item cannot be sent, or the vehicle keeps no list of its kind.
    """
    began_s = link.connection.now_s
    before = {kind: link.fetch_items_again(kind) for kind in MissionKind}
    wanted = _lists(link, mission, before)
    touched: list[MissionKind] = []
    is_new = any(one.matters for one in _differences(link, mission, before))
    link.listen(0.0)  # earlier reports are about something else
    link.fetch_events()
    try:
        for kind in sending_order(wanted):
            had = before[kind]
            if had is None or kind in kept:
                continue
            if kind is not MissionKind.MISSION and is_same(had, wanted[kind]):
                continue
            is_rejudged = is_new if kind is MissionKind.MISSION else kind is MissionKind.FENCE
            if touched and is_rejudged and not link.identity.has_home_slot:
                # What PX4 has against the old mission in the new fence, or the new one in the old: each
                # other mission or fence has it judge again (``MissionBase::updateMavlinkMission``).
                link.listen(_SETTLED_S)
                link.fetch_events()
            touched.append(kind)
            outcome, why = link.upload_items(kind, wanted[kind])
            if outcome is UploadOutcome.REJECTED:
                rejection = f"the vehicle refuses the {kind.label}: {why}"
                restored = not _put_back(link, before, touched)
                return UploadResult(rejection=rejection, restored=restored)
        sent_s = link.connection.now_s
        back = {kind: link.fetch_items(kind) for kind in MissionKind}
        differences = _differences(link, mission, back)
        if any(one.matters for one in differences):
            restored = not _put_back(link, before, touched)
            return UploadResult(differences=differences, restored=restored)
    except (Exception, KeyboardInterrupt) as error:  # a bug too leaves nothing half done
        sent = {kind: wanted[kind] for kind in touched}
        raise _after_break(link, before, sent, error) from error
    back_s = link.connection.now_s
    result = UploadResult(differences=differences)
    listening_s = _listening_s(link, listen_s, back_s - sent_s)
    try:
        result = _judged(
            link, result, listening_s, has_items=bool(mission.items), has_home=has_home
        )
    except (Exception, KeyboardInterrupt) as error:
        left = "the mission is on the vehicle, but its reports on it were not heard"
        raise _break_error(error, left) from error
    spans_s = {
        "sent": sent_s - began_s,
        "read back": back_s - sent_s,
        "listened": link.connection.now_s - back_s,
    }
    return replace(result, spans_s=spans_s)


def _differences(
    link: VehicleLink, mission: Mission, lists: Mapping[MissionKind, tuple[WireItem, ...] | None]
) -> tuple[Difference, ...]:
    read = mission_of_lists(lists, link.identity, home=mission.home, source=mission.source)
    return compare_missions(mission, read, autopilot=link.identity.autopilot)


def _judged(
    link: VehicleLink,
    result: UploadResult,
    listen_s: tuple[float, float],
    *,
    has_items: bool,
    has_home: bool,
) -> UploadResult:
    """Return a result with what the vehicle reports on the mission, in a time that may end early. [s]"""
    first_s, longest_s = listen_s
    texts, events = link.listen(first_s, "the vehicle's objections"), link.fetch_events()
    is_taken = (
        first_s < longest_s
        and not objections(texts, events)
        and link.would_fly_mission()
        and link.has_every_event()
    )
    texts += link.listen(0.0 if is_taken else longest_s - first_s)
    reports = objections(texts, events + link.fetch_events())
    is_unjudged = False
    if has_items and not reports and not is_taken and _has_none_after_all(link):
        # PX4 takes what it has already without a report, and objects to it no more.
        is_unjudged = not has_home
        late = objections(link.listen(0.0), link.fetch_events())  # lost at first, and asked for
        reports = late or (
            () if is_unjudged else ("the vehicle reports no mission that it would fly",)
        )
    return replace(result, rejection="; ".join(reports), texts=texts, is_unjudged=is_unjudged)


def _listening_s(link: VehicleLink, listen_s: float | None, since_s: float) -> tuple[float, float]:
    """Return how long a vehicle is listened to, at least and at most, some time after the last list. [s]

    ArduPilot judges each item and each fence before it accepts it.  PX4's navigator judges afterwards.
    """
    if listen_s is not None:
        return listen_s, listen_s
    if link.identity.has_home_slot:
        return 0.0, 0.0
    return max(_SETTLED_S - since_s, 0.0), LONGEST_S


def _has_none_after_all(link: VehicleLink) -> bool:
    """Return whether a vehicle still reports no mission, some time after it got one."""
    for _ in range(_LOOKS):
        if not link.has_no_mission():
            return False
        link.listen(_SETTLED_S)
    return True


def is_same(first: Sequence[WireItem], second: Sequence[WireItem]) -> bool:
    """Return whether two lists are the same on the line, NaN included."""
    return [_content(one) for one in first] == [_content(one) for one in second]


def _content(item: WireItem) -> tuple[object, ...]:
    return tuple(
        struct.pack("<f", value) if isinstance(value, float) else value
        for value in field_values(item).values()
    )


def _lists(
    link: VehicleLink, mission: Mission, before: Mapping[MissionKind, tuple[WireItem, ...] | None]
) -> dict[MissionKind, tuple[WireItem, ...]]:
    slots = before[MissionKind.MISSION] or ()
    home_slot = slots[0] if link.identity.has_home_slot and slots else None
    wanted = lists_of_mission(mission, link.identity, home_slot=home_slot)
    for kind, items in wanted.items():
        if items and before[kind] is None:
            msg = f"the vehicle keeps no {kind.label}, and the mission has some: it is not sent"
            raise UsageError(msg)
    return wanted


def _put_back(
    link: VehicleLink,
    before: Mapping[MissionKind, tuple[WireItem, ...] | None],
    touched: Sequence[MissionKind],
) -> str:
    """Put the old lists back; return why they were not read back so, empty where they were.

    It is tried as long as heartbeats come, and never less patiently than by default.  `LinkError` where
    the vehicle falls silent.
    """
    usual, given = LinkSettings(), link.settings
    link.settings = replace(
        given,
        reply_timeout_s=max(given.reply_timeout_s, usual.reply_timeout_s),
        retries=max(given.retries, usual.retries),
    )
    link.connection.is_restoring = True
    why = ""
    for attempt in range(_RESTORE_TRIES):
        if attempt:
            link.listen(_FORGOTTEN_S)
        if not link.connection.hears_vehicle(_RESTORE_S):
            msg = "the vehicle does not answer any more"
            raise LinkError(msg)
        try:
            why = _restore(link, before, touched)
        except LinkError as error:
            why = str(error)
        if not why:
            return ""
    return why


def _restore(
    link: VehicleLink,
    before: Mapping[MissionKind, tuple[WireItem, ...] | None],
    touched: Sequence[MissionKind],
) -> str:
    """Put the old lists back; return why one was not read back so, empty where all were."""
    skipped = 1 if link.identity.has_home_slot else 0
    for kind in sending_order({kind: before[kind] or () for kind in MissionKind}):
        if kind not in touched:
            continue
        old, why = before[kind] or (), ""
        back = link.fetch_items(kind) or ()
        start = skipped if kind is MissionKind.MISSION else 0
        if not is_same(back[start:], old[start:]):
            _, why = link.upload_items(kind, old)
            back = link.fetch_items(kind) or ()
        if not is_same(back[start:], old[start:]):
            return f"the old {kind.label}: {why or 'something else was read back'}"
    return ""


def _after_break(
    link: VehicleLink,
    before: Mapping[MissionKind, tuple[WireItem, ...] | None],
    sent: Mapping[MissionKind, tuple[WireItem, ...]],
    error: Exception | KeyboardInterrupt,
) -> MavjouleError:
    """Return the error to raise after a break: what is on the vehicle, as far as it is known."""
    if not sent:
        return _break_error(error, "nothing was sent, the vehicle has what it had")
    try:
        try:
            why = _put_back(link, before, tuple(sent))
        except KeyboardInterrupt:
            if isinstance(error, KeyboardInterrupt):
                raise
            # The first: whoever stops it wants what the vehicle had, as before.
            error = KeyboardInterrupt()
            why = _put_back(link, before, tuple(sent))
        if not why:
            left = "the old mission is on the vehicle, it was read back whole"
            return _break_error(error, left)
        silence = f"the vehicle is busy and did not take back what it had ({why})"
    except Exception as silent:  # noqa: BLE001 - whatever it is, what the vehicle has is unknown
        silence = str(silent)
    except KeyboardInterrupt:
        silence = "putting back what it had was interrupted too"
    lists = ", ".join(kind.label for kind in sent)
    counts = ", ".join(str(len(items)) for items in sent.values())
    left = (
        f"{silence}: it may have the old {lists}, the new ({counts} items) or, if it is no PX4, a "
        "mixture: read it back by mavjoule diff before anyone arms"
    )
    return _break_error(error, left, kind=BrokenUploadError)


def _break_error(
    error: Exception | KeyboardInterrupt, left: str, *, kind: type[LinkError] = LinkError
) -> MavjouleError:
    """Return the error with why it broke, and what is on the vehicle now."""
    if isinstance(error, KeyboardInterrupt):
        return InterruptedUploadError(f"interrupted; {left}")
    if not isinstance(error, MavjouleError):
        return CheckFailedError(f"{bug_text(error)}; {left}")
    return kind(f"{error}; {left}")
