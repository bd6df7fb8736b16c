"""Reads the parts that a guard asks for, or confirms by less that they are as they were."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.link.guarding import Unread
from planner.link.mission_transfer import MissionDownload
from planner.link.question import MessageRequest, ParameterHashRequest
from planner.link.vehicle_watch import KINDS, LIST_IDS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.link.guarding import Part, Read, ReadParts
    from planner.link.mission_kind import MissionKind
    from planner.link.pymavlink_link import PymavlinkLink
    from planner.link.settings import LinkSettings
    from planner.link.snapshot import VehicleReading
    from planner.link.vehicle_watch import VehicleWatch

_RETRIES = 5
"""Of what a vehicle may not have."""
_LATE = 3.0
"""An answer so many round trips old is lost. [-]"""
_CURRENT = ("MISSION_CURRENT", 42)


class PartReader:
    """Reads from one vehicle, and remembers by what it can be told that nothing has changed.

    Parameters
    ----------
    link : PymavlinkLink
        The vehicle.
    watch : VehicleWatch
        Given what is read.
    settings : LinkSettings
        How patient to be.
    known : VehicleReading, optional
        What was read of it just now: it is not read again at once.
    """

    def __init__(
        self,
        link: PymavlinkLink,
        watch: VehicleWatch,
        settings: LinkSettings,
        *,
        known: VehicleReading | None = None,
    ) -> None:
        self._link = link
        self._connection = link.connection
        self._watch = watch
        self._settings = settings
        self._lists = {} if known is None else dict(known.lists)
        self._parameters = None if known is None else known.parameters
        self._ids: dict[MissionKind, int] = {}
        """Of the lists as they were read."""
        self._hash: bytes | None = None
        self._has_hash = link.identity.autopilot is Autopilot.PX4
        self._round_trip_s: float | None = None

    def read(self, asked: ReadParts) -> Iterator[Read | Unread]:
        """Yield what became of each part, as it is read."""
        settings = self._settings
        if asked.is_urgent and self._round_trip_s is not None:
            # Someone waits: what is lost is asked for again as soon as it is late.
            late_s = max(_LATE * self._round_trip_s, settings.shortest_timeout_s)
            settings = replace(settings, reply_timeout_s=min(late_s, settings.reply_timeout_s))
        try:
            confirmed = self._confirmed(asked.parts, settings)
        except LinkError as error:
            yield from (Unread(part=part, why=str(error)) for part in asked.parts)
            return
        for part in asked.parts:
            try:
                if part not in KINDS:
                    yield self._read_parameters(settings)
                elif KINDS[part] in confirmed:
                    yield self._watch.take_list(KINDS[part], self._watch.lists[KINDS[part]])
                else:
                    yield self._read_list(KINDS[part], settings)
            except LinkError as error:
                yield Unread(part=part, why=str(error))

    def _confirmed(self, parts: tuple[Part, ...], settings: LinkSettings) -> set[MissionKind]:
        """Return the lists that one message tells to be as they were read."""
        kinds = {KINDS[part] for part in parts if part in KINDS and self._ids.get(KINDS[part])}
        if not kinds:
            return set()
        question = MessageRequest(*_CURRENT, settings, retries=_RETRIES)
        self._connection.run(question)
        told = question.answer
        if told is None:
            return set()
        return {kind for kind in kinds if told[LIST_IDS[kind]] == self._ids[kind]}

    def _read_list(self, kind: MissionKind, settings: LinkSettings) -> Read:
        if kind in self._lists:
            return self._watch.take_list(kind, self._lists.pop(kind))
        download = MissionDownload(kind, settings)
        began_s = self._connection.now_s
        self._connection.run(download)
        took_s = self._connection.now_s - began_s
        round_trip_s = took_s / (1 + len(download.items))
        self._round_trip_s = min(self._round_trip_s or round_trip_s, round_trip_s)
        self._ids[kind] = download.list_id
        return self._watch.take_list(kind, download.items if download.is_supported else None)

    def _read_parameters(self, settings: LinkSettings) -> Read:
        if self._parameters is not None:
            known, self._parameters = self._parameters, None
            return self._watch.take_parameters(known)
        content: bytes | None = None
        if self._has_hash:
            # The hash comes first: what is set while the parameters are read makes it differ.
            question = ParameterHashRequest(settings, retries=_RETRIES)
            self._connection.run(question)
            content = question.content
            self._has_hash = content is not None or self._hash is not None
        if content is None or content != self._hash:
            self._watch.take_parameters(self._link.fetch_parameters())
            self._hash = content
        return self._watch.take_parameters(self._watch.parameters)
