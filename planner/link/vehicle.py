"""A vehicle by its messages: pymavlink's dialect, our own transfers."""

from __future__ import annotations

import random
from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.link.connection import OWN_SYSTEM, Connection, Purpose, TwoVehiclesError, uid_text
from planner.link.files import FileDownload, FileNumbers, FileRefusedError
from planner.link.mission import (
    LIST_FILES,
    ListIdRequest,
    MissionDownload,
    MissionKind,
    MissionUpload,
    read_packed_items,
)
from planner.link.parameters import (
    PARAMETER_FILE,
    STORAGE_FILE,
    ParameterDownload,
    read_packed_parameters,
)
from planner.link.signing import open_signer
from planner.link.telemetry import EventRequest, NextEventRequest, firmware_release
from planner.link.transfers import EchoRequest, LinkSettings, MessageRequest, MessageRequests
from planner.link.wire import open_line
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.link.address import LinkAddress
    from planner.link.mission import UploadOutcome, WireItem
    from planner.link.parameters import WireParameter
    from planner.link.signing import Signer
    from planner.link.telemetry import StatusText, VehicleEvent, VehicleIdentity, VehicleState
    from planner.link.transfers import Transfer
    from planner.link.wire import Message, VehicleLine
OnProgress = Callable[[str, int, int | None], None]


_IDENTITY = ("AUTOPILOT_VERSION", 148)
_HAZARD = {"EXTENDED_SYS_STATE": 245}
_STATE = {
    "HOME_POSITION": 242,
    "SYS_STATUS": 1,
    "BATTERY_STATUS": 147,
    "GLOBAL_POSITION_INT": 33,
    **_HAZARD,
}
_PX4_WIND, _ARDUPILOT_WIND = {"WIND_COV": 231}, {"WIND": 168}
_LATEST_WORD_S = 10.0
"""A reply that comes later than this is lost. [s]"""
_WARNING = 4
"""MAV_SEVERITY_WARNING; greater numbers are less."""
_UNKNOWN_STATE, _NO_MISSION = 0, 1
"""MISSION_STATE."""
_HAS_FILES = 1 << 5
"""MAV_PROTOCOL_CAPABILITY_FTP."""
_FILE_RETRIES = 5
"""Of a request for a piece of what can be asked for otherwise."""
_OPTIONAL_RETRIES = 6
"""Of a message that a vehicle may not have."""
_ID_RETRIES = 5
"""Of a question about a list that can be read instead."""
_CURRENT_S = 4.5
"""In which a message that is sent every second comes, however many in a row get lost on a bad radio. [s]"""
_EVENT_RETRIES = 3
"""Of a question whose answer can be waited for instead."""
_MOST_LATER = 20
"""Events that come one after the other: PX4 keeps no more."""


class LinkRequest(Value):
    """Which vehicle to speak to, and how patiently."""

    address: LinkAddress
    settings: LinkSettings = LinkSettings()
    system: int | None = None
    """System id; ``None``: the only vehicle on the line."""
    own_system: int = OWN_SYSTEM
    """System id of this program; COM_ARM_AUTH_ID names that of a guard."""
    signing_key: Path | None = None
    """File with the key that all messages are signed by, both ways; ``None``: none is."""


def silent(what: str, done: int, count: int | None) -> None:
    """Take progress and show nothing."""


class VehicleLink:
    """The messages of a vehicle, over an open line, which is closed with it.

    Each transfer raises `LinkError` where it stalls, with its place and what the vehicle reports.
    """

    def __init__(
        self,
        line: VehicleLine,
        *,
        name: str,
        settings: LinkSettings | None = None,
        purpose: Purpose = Purpose.READ,
        system: int | None = None,
        own_system: int = OWN_SYSTEM,
        signer: Signer | None = None,
        on_progress: OnProgress = silent,
    ) -> None:
        self.settings = settings or LinkSettings()
        self._on_progress = on_progress
        self._stray = 0
        self._stray_until_s = 0.0
        self._unpacked: set[str] = set()
        """Files that the vehicle does not make up."""
        self._storage_b: int | None = None
        self._read: dict[MissionKind, tuple[tuple[WireItem, ...] | None, int]] = {}
        """Lists as they were read last, and the vehicle's own numbers of them."""
        self.has_echo: bool | None = None
        """Whether the vehicle answers TIMESYNC; ``None`` before it was tried."""
        self.opened_s = line.now_s()
        """By the line's clock. [s]"""
        self.file_numbers = FileNumbers(random.randrange(1 << 16))
        """Of the requests of its file protocol."""
        self.connection = Connection(
            line,
            name=name,
            settings=self.settings,
            purpose=purpose,
            system=system,
            own_system=own_system,
            signer=signer,
        )
        try:
            self.connection.wait_for_vehicle(
                lambda: self._on_progress("the vehicle's heartbeat", 0, None)
            )
            self.identity = self._fetch_identity()
        except BaseException:
            self.connection.close()
            raise

    def close(self) -> None:
        """Close the line."""
        self.connection.close()

    def fetch_items(self, kind: MissionKind) -> tuple[WireItem, ...] | None:
        """Return one list of items; ``None`` where the vehicle knows no such list."""
        return self.fetch_list(kind, self.settings)[0]

    def fetch_items_again(self, kind: MissionKind) -> tuple[WireItem, ...] | None:
        """Return a list as it is now, without its items where it is known to be what was read."""
        items, list_id = self._read.get(kind, (None, 0))
        if list_id and self.answers_echo() and self.has_list(kind, list_id, self.settings):
            return items
        return self.fetch_items(kind)

    def list_id(self, kind: MissionKind) -> int:
        """Return the vehicle's own number of a list as it was read last; 0 where it has none."""
        return self._read.get(kind, (None, 0))[1]

    def answers_echo(self) -> bool:
        """Return whether an answer of the vehicle can be told from what was under way before."""
        if self.has_echo is None:
            echo = EchoRequest(self.settings, retries=_ID_RETRIES)
            self.connection.run(echo)
            self.has_echo = echo.answer is not None
        return self.has_echo

    def has_list(self, kind: MissionKind, list_id: int, settings: LinkSettings) -> bool:
        """Return whether the vehicle has the list of its own number still; it has to answer echoes."""
        question = ListIdRequest(kind, settings, retries=_ID_RETRIES)
        self.connection.run(question)
        self.connection.send(question.ended)
        return question.list_id == list_id

    def fetch_list(
        self, kind: MissionKind, settings: LinkSettings
    ) -> tuple[tuple[WireItem, ...] | None, int]:
        """Return one list of items, and the vehicle's own number of it; 0 where it has none."""
        self._read.pop(kind, None)
        self._read[kind] = self._fetched_list(kind, settings)
        return self._read[kind]

    def _fetched_list(
        self, kind: MissionKind, settings: LinkSettings
    ) -> tuple[tuple[WireItem, ...] | None, int]:
        packed = self._fetch_packed(LIST_FILES[kind], kind.label, settings)
        if packed is not None:
            try:
                return read_packed_items(packed, kind), 0
            except LinkError:
                self._unpacked.add(LIST_FILES[kind])
        download = MissionDownload(kind, settings)
        self.run(download, kind.label)
        return (download.items if download.is_supported else None), download.list_id

    def upload_items(
        self, kind: MissionKind, items: Sequence[WireItem]
    ) -> tuple[UploadOutcome, str]:
        """Replace one list of items; return what became of it, and why the vehicle refused it."""
        self._read.pop(kind, None)
        upload = MissionUpload(kind, items, self.settings)
        self.run(upload, f"{kind.label}, to the vehicle")
        assert upload.outcome is not None  # a transfer that is done has one
        return upload.outcome, upload.rejection

    def fetch_parameters(self) -> tuple[WireParameter, ...]:
        """Return every parameter, in the vehicle's order."""
        packed = self._fetch_packed(PARAMETER_FILE, "parameters", self.settings)
        if packed is not None:
            try:
                return read_packed_parameters(packed)
            except LinkError:
                self._unpacked.add(PARAMETER_FILE)
        download = ParameterDownload(self.settings)
        self.run(download, "parameters")
        return download.parameters

    def fetch_storage_b(self) -> int | None:
        """Return the size of ArduPilot's storage for parameters and lists; ``None`` where unknown. [B]"""
        if self._storage_b is None:
            storage = self._fetch_packed(STORAGE_FILE, "storage", self.settings)
            self._storage_b = len(storage) if storage else None
        return self._storage_b

    def fetch_terrain_pending(self) -> int | None:
        """Return how many blocks of terrain ArduPilot waits for; ``None`` where it uses no terrain."""
        report = self._ask("TERRAIN_REPORT", 136, retries=_OPTIONAL_RETRIES).answer
        return None if report is None else report["pending"]

    def _fetch_packed(self, path: str, what: str, settings: LinkSettings) -> bytes | None:
        """Return a file that ArduPilot makes up of what it has: a burst in place of a question for each.

        ``None`` where the vehicle offers none, or it did not come: then each is asked for.
        """
        capabilities = self.identity.capabilities or 0
        if not (self.identity.has_home_slot and capabilities & _HAS_FILES):
            return None
        if path in self._unpacked:
            return None
        content = bytearray()
        download = FileDownload(
            path,
            0,
            content.extend,
            settings,
            self.file_numbers,
            retries=min(settings.retries, _FILE_RETRIES),
            has_size=False,
        )
        try:
            self.connection.run(download, lambda: self._on_progress(what, 0, None))
        except TwoVehiclesError:
            raise
        except FileRefusedError:
            self._unpacked.add(path)
        except LinkError:
            if (
                not content
            ):  # nobody answers: the line may have broken, which the next question shows
                self._unpacked |= {PARAMETER_FILE, *LIST_FILES.values()}
        return bytes(content) if download.is_done else None

    def fetch_state(self, *, is_whole: bool = True) -> VehicleState:
        """Return what the vehicle reports of itself now; each part but its arming may be missing.

        Of one that is not whole, it is asked again only whether it is armed or in the air.  `LinkError`
        where no heartbeat comes, which alone reports whether it is armed.
        """
        wind = _ARDUPILOT_WIND if self.identity.has_home_slot else _PX4_WIND
        self.connection.telemetry.forget("HEARTBEAT")
        wanted = {**_STATE, **wind} if is_whole else _HAZARD
        requests = MessageRequests(
            wanted, self.settings, retries=_OPTIONAL_RETRIES, stray=self._stray_now
        )
        self.connection.run(requests, lambda: self._on_progress("the vehicle's state", 0, None))
        self._note_stray(requests.stray)
        if self.connection.awaited("HEARTBEAT", self.settings.heartbeat_timeout_s) is None:
            msg = (
                f"{self.identity.label} sent no heartbeat in "
                f"{self.settings.heartbeat_timeout_s:g} s: whether it is armed is not known; bring "
                "the radio closer, or give a longer --heartbeat-timeout"
            )
            raise LinkError(msg)
        return self.connection.telemetry.state()

    def listen(self, duration_s: float, what: str = "") -> tuple[StatusText, ...]:
        """Return the texts that the vehicle sends in a time [s], and those not taken before."""
        if what:
            self._on_progress(what, 0, None)
        self.connection.listen(duration_s)
        return self.connection.telemetry.take_texts()

    def fetch_events(self) -> tuple[VehicleEvent, ...]:
        """Return the events that the vehicle reported and that were not taken before."""
        record = self.connection.telemetry.events
        self.connection.run(EventRequest(record, self.settings, retries=_OPTIONAL_RETRIES))
        return record.take_events()

    def has_every_event(self) -> bool:
        """Return whether the vehicle says that it reported nothing beyond the events that came (PX4)."""
        record = self.connection.telemetry.events
        for _ in range(_MOST_LATER):
            if record.next is None:
                return False
            question = NextEventRequest(record, self.settings, retries=_EVENT_RETRIES)
            self.connection.run(question)
            if question.is_last:
                return not record.missing
            if question.answer is None or question.answer.name != "EVENT":
                return False
        return False

    def has_no_mission(self) -> bool:
        """Return whether the vehicle reports that it has no mission it would fly.

        PX4 reports it of a mission that its feasibility check rejects (``update_mission_state``),
        versions before 2025 do not.
        """
        current = self._current_mission()
        return current is not None and current["mission_state"] == _NO_MISSION

    def would_fly_mission(self) -> bool:
        """Return whether the vehicle reports that it would fly the mission that was read of it last.

        No where it does not name the mission, or its state: versions of PX4 before 2025.
        """
        current, known = self._current_mission(), self.list_id(MissionKind.MISSION)
        if current is None or not known or current.fields.get("mission_id", 0) != known:
            return False
        return current["mission_state"] not in {_UNKNOWN_STATE, _NO_MISSION}

    def _current_mission(self) -> Message | None:
        """Return the next MISSION_CURRENT, which PX4 sends every second and refuses to send when asked."""
        self.connection.telemetry.forget("MISSION_CURRENT")
        asked = self._ask("MISSION_CURRENT", 42, retries=_OPTIONAL_RETRIES).answer
        return asked or self.connection.awaited("MISSION_CURRENT", _CURRENT_S)

    def _fetch_identity(self) -> VehicleIdentity:
        identity = self.connection.vehicle
        question = self._ask(*_IDENTITY, retries=self.settings.retries)
        version = question.answer
        if identity.autopilot is not None and not question.is_heard:
            own = self.connection.own_system
            msg = (
                f"{identity.label} is heard on {self.connection.name} and answers nothing: does the "
                "line carry both ways (a radio's power, the way back through a router), and may "
                f"system {own} speak to it (ArduPilot's SYSID_ENFORCE and MAV_OPTIONS let the "
                "pilot's station alone: give --own-system-id 255; one that wants signed messages "
                "needs --signing-key)?"
            )
            raise LinkError(msg)
        if version is None:
            return identity
        number = version["flight_sw_version"]
        firmware = (number >> 24 & 255, number >> 16 & 255, number >> 8 & 255)
        return replace(
            identity,
            firmware_version=firmware if number else None,
            firmware_release=firmware_release(number & 255) if number else "",
            firmware_hash=_revision(bytes(version["flight_custom_version"]), identity),
            uid=uid_text(version),
            capabilities=version["capabilities"],
        )

    def _ask(self, name: str, number: int, *, retries: int) -> MessageRequest:
        question = MessageRequest(
            name, number, self.settings, retries=retries, stray=self._stray_now
        )
        self.connection.run(question, lambda: self._on_progress(name, 0, None))
        self._note_stray(question.stray)
        return question

    @property
    def _stray_now(self) -> int:
        """Replies to earlier questions that may still come."""
        return self._stray if self.connection.now_s < self._stray_until_s else 0

    def _note_stray(self, stray: int) -> None:
        self._stray = stray
        self._stray_until_s = self.connection.now_s + _LATEST_WORD_S

    def run(self, transfer: Transfer, what: str) -> None:
        """Run a transfer to its end, reporting its progress."""
        telemetry = self.connection.telemetry
        before = telemetry.text_count
        try:
            self.connection.run(transfer, lambda: self._on_progress(what, *transfer.progress))
        except LinkError as error:
            texts = telemetry.texts_after(before)
            reports = [one.text for one in texts if one.severity <= _WARNING]
            if not reports:
                raise
            msg = f"{error}; the vehicle reports: {reports[-1]}"
            raise type(error)(msg) from error


def _revision(content: bytes, identity: VehicleIdentity) -> str:
    """Return the Git revision of a firmware, as far as it sends it; empty where it does not.

    ArduPilot sends its first characters, PX4 its first bytes, the last of them first (and so does
    QGroundControl read them).
    """
    if identity.has_home_slot:
        return content.split(b"\0", 1)[0].decode("ascii", errors="replace")
    return content[::-1].hex()


def open_link(
    request: LinkRequest, *, purpose: Purpose = Purpose.READ, on_progress: OnProgress = silent
) -> closing[VehicleLink]:
    """Return the vehicle of a request, once it was heard, to be closed.

    `LinkError` where the line cannot be opened, no vehicle is heard in time, or several are;
    `UsageError` where a library is missing, or the key cannot be used.
    """
    signer = open_signer(request.signing_key)
    return closing(
        VehicleLink(
            open_line(request.address),
            name=request.address.text,
            settings=request.settings,
            purpose=purpose,
            system=request.system,
            own_system=request.own_system,
            signer=signer,
            on_progress=on_progress,
        )
    )
