"""Between bytes and messages: pymavlink's dialect, which stops here."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from planner.errors import UsageError
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping
    from types import ModuleType
Checksum = Callable[[bytes], int]


class Message(Value):
    """One message, received or to be sent."""

    name: str
    """As in the dialect: ``MISSION_COUNT``."""
    fields: Mapping[str, Any]
    """By MAVLink's names and in its units; of one to be sent, its target may be left out."""
    system: int = 0
    """Who sent it; 0 for our own."""
    component: int = 0

    def __getitem__(self, field: str) -> Any:  # noqa: ANN401 - numbers, texts and arrays
        return self.fields[field]


def message(name: str, **fields: Any) -> Message:  # noqa: ANN401 - numbers, texts and arrays
    """Return a message to be sent."""
    return Message(name=name, fields=fields)


class Transfer(Protocol):
    """An exchange of messages, without the line: it is fed messages and times.

    Every method returns what is to be sent; `planner.errors.LinkError` is raised where the
    exchange cannot go on.
    """

    @property
    def is_done(self) -> bool:
        """Whether nothing more is waited for."""

    @property
    def deadline_s(self) -> float:
        """When `expire` is to be called, unless something came before. [s]"""

    @property
    def progress(self) -> tuple[int, int | None]:
        """How much is done, and of how much, where that is known."""

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Return the first messages."""

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle, of any kind."""

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Take it that the deadline has passed."""


_HEAD = 10
"""Bytes of a version 2 frame before its content."""


class Layout(Value):
    """How a message stands in its frame."""

    number: int
    crc_extra: int
    """MAVLink's check sum over the definition, which that of a frame includes."""
    fields: tuple[tuple[str, str], ...]
    """Names and formats of `struct`, in the order of the frame."""

    @property
    def structure(self) -> struct.Struct:
        """The content."""
        return struct.Struct("<" + "".join(form for _, form in self.fields))


class Extension(Value):
    """Fields behind those that a dialect knows of a message."""

    start: int
    """Bytes of the content before them."""
    crc_extra: int
    fields: tuple[str, ...]
    """Names; each takes four bytes, 0 where it is not told."""


LAYOUTS: Mapping[str, Layout] = {
    "EVENT": Layout(
        number=410,
        crc_extra=160,
        fields=(
            *(("id", "I"), ("event_time_boot_ms", "I"), ("sequence", "H")),
            *(("destination_component", "B"), ("destination_system", "B")),
            *(("log_levels", "B"), ("arguments", "40s")),
        ),
    ),
    "CURRENT_EVENT_SEQUENCE": Layout(
        number=411, crc_extra=106, fields=(("sequence", "H"), ("flags", "B"))
    ),
    "REQUEST_EVENT": Layout(
        number=412,
        crc_extra=33,
        fields=(
            *(("first_sequence", "H"), ("last_sequence", "H")),
            *(("target_system", "B"), ("target_component", "B")),
        ),
    ),
}
"""By name, the messages that a dialect may lack."""
EXTENSIONS: Mapping[str, Extension] = {
    "MISSION_CURRENT": Extension(
        start=6, crc_extra=28, fields=("mission_id", "fence_id", "rally_points_id")
    ),
    "MISSION_COUNT": Extension(start=5, crc_extra=221, fields=("opaque_id",)),
}
"""By name, the messages of which a dialect may lack fields."""
_NAMES = {layout.number: name for name, layout in LAYOUTS.items()}


def frame_content(frame: bytes) -> bytes:
    """Return the content of a whole frame of either version."""
    head = _HEAD if frame[0] == 0xFD else 6
    return frame[head : head + frame[1]]


def read_newer(frame: bytes, checksum: Checksum) -> tuple[str, dict[str, Any]] | None:
    """Return name and fields of a frame; ``None`` where it is no such message, or damaged.

    Parameters
    ----------
    frame : bytes
        Whole, of a message that the dialect does not know.
    checksum : callable
        MAVLink's, over bytes.
    """
    if frame[0] != 0xFD or len(frame) < _HEAD + frame[1] + 2:
        return None
    name = _NAMES.get(int.from_bytes(frame[7:10], "little"))
    if name is None:
        return None
    layout, end = LAYOUTS[name], _HEAD + frame[1]
    told = int.from_bytes(frame[end : end + 2], "little")
    if checksum(frame[1:end] + bytes([layout.crc_extra])) != told:
        return None
    structure = layout.structure
    content = frame[_HEAD:end][: structure.size].ljust(structure.size, b"\0")
    names = [field for field, _ in layout.fields]
    return name, dict(zip(names, structure.unpack(content), strict=True))


def extension_fields(name: str, frame: bytes) -> dict[str, int]:
    """Return the fields of a frame that the dialect does not know."""
    extension = EXTENSIONS.get(name)
    if extension is None:
        return {}
    size = 4 * len(extension.fields)
    content = frame_content(frame)[extension.start :][:size].ljust(size, b"\0")
    values = struct.unpack(f"<{len(extension.fields)}I", content)
    return dict(zip(extension.fields, values, strict=True))


def newer_frame(
    name: str,
    fields: Mapping[str, Any],
    checksum: Checksum,
    *,
    sender: tuple[int, int],
    number: int,
) -> bytes:
    """Return a message that a dialect may lack as a frame.

    Parameters
    ----------
    name : str
        Of the message.
    fields : mapping
        Those that it lacks are 0.
    checksum : callable
        MAVLink's, over bytes.
    sender : tuple of int
        System and component.
    number : int
        Of the frame.
    """
    layout = LAYOUTS[name]
    content = layout.structure.pack(
        *(fields.get(field, b"" if "s" in form else 0) for field, form in layout.fields)
    )
    head = _head(layout.number, sender, number)
    return _frame(head, content, layout.crc_extra, checksum)


def extended_frame(name: str, frame: bytes, fields: Mapping[str, Any], checksum: Checksum) -> bytes:
    """Return a frame of the dialect's with the fields that it does not know."""
    extension = EXTENSIONS.get(name)
    values = [] if extension is None else [fields.get(field, 0) for field in extension.fields]
    if extension is None or not any(values):
        return frame
    content = frame_content(frame)[: extension.start].ljust(extension.start, b"\0")
    content += struct.pack(f"<{len(values)}I", *values)
    return _frame(frame[:_HEAD], content, extension.crc_extra, checksum)


def _head(message: int, sender: tuple[int, int], number: int) -> bytes:
    return bytes([0xFD, 0, 0, 0, number & 0xFF, *sender]) + message.to_bytes(3, "little")


def _frame(head: bytes, content: bytes, crc_extra: int, checksum: Checksum) -> bytes:
    content = content[:1] + content[1:].rstrip(b"\0")  # version 2 leaves zeros out at the end
    whole = head[:1] + bytes([len(content)]) + head[2:] + content
    return whole + checksum(whole[1:] + bytes([crc_extra])).to_bytes(2, "little")


_MISSING = (
    "{library} is missing, which speaks to vehicles: install it with pip install 'mavjoule[link]'"
)
_TEXTS = frozenset({"param_id", "text"})
_MOST_PENDING = 1 << 16
"""Bytes that are no message yet; a message has at most 280."""


def load_dialect() -> ModuleType:
    """Return pymavlink's dialect ardupilotmega, which holds common, in version 2.

    Raises
    ------
    UsageError
        If pymavlink is not installed.
    """
    try:
        from pymavlink.dialects.v20 import ardupilotmega
    except ImportError as error:
        raise UsageError(_MISSING.format(library="pymavlink")) from error
    dialect: ModuleType = ardupilotmega
    return dialect


class Codec:
    """Encodes for one sender, decodes one stream of bytes.

    Parameters
    ----------
    system, component : int
        Who sends what is encoded.
    """

    def __init__(self, system: int, component: int) -> None:
        self._dialect = load_dialect()
        self._encoder = self._dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        self._decoder = self._new_decoder()

    def encode(self, sent: Message, *, target: tuple[int, int] = (0, 0)) -> bytes:
        """Return a message in bytes.

        Parameters
        ----------
        sent : Message
            Fields that it lacks are 0.
        target : tuple of int
            System and component, for a message that has a target and does not name it.
        """
        aimed = {"target_system": target[0], "target_component": target[1], **sent.fields}
        encoder = self._encoder
        number = encoder.seq
        if sent.name in LAYOUTS:
            encoder.seq = (number + 1) % 256
            sender = encoder.srcSystem, encoder.srcComponent
            return newer_frame(sent.name, aimed, self._checksum, sender=sender, number=number)
        kind = getattr(self._dialect, f"MAVLink_{sent.name.lower()}_message")
        fields: dict[str, Any] = {**dict.fromkeys(kind.fieldnames, 0), **aimed}
        values = [fields[name] for name in kind.fieldnames]
        encoded = kind(*[v.encode() if isinstance(v, str) else v for v in values])
        frame = bytes(encoded.pack(encoder))
        encoder.seq = (number + 1) % 256
        return extended_frame(sent.name, frame, aimed, self._checksum)

    def decode(self, data: bytes) -> list[Message]:
        """Return the messages that are complete with these bytes; what is none is passed over."""
        decoder = self._decoder
        try:
            found = decoder.parse_buffer(data) or []
        except (self._dialect.MAVError, struct.error, ValueError, IndexError, TypeError):
            self._decoder = self._new_decoder()  # nothing of it is worth keeping
            return []
        if decoder.buf_len() > _MOST_PENDING:
            self._decoder = self._new_decoder()
        messages = (self._message(one) for one in found if one.get_type() != "BAD_DATA")
        return [one for one in messages if one is not None]

    def _new_decoder(self) -> Any:  # noqa: ANN401 - pymavlink has no types
        decoder = self._dialect.MAVLink(None)
        decoder.robust_parsing = True
        return decoder

    def _checksum(self, data: bytes) -> int:
        return int(self._dialect.x25crc(data).crc)

    def _message(self, received: Any) -> Message | None:  # noqa: ANN401 - pymavlink has no types
        """Return a message; ``None`` where nobody knows it."""
        name, frame = received.get_type(), bytes(received.get_msgbuf())
        if name.startswith("UNKNOWN"):
            newer = read_newer(frame, self._checksum)
            if newer is None:
                return None
            system, component = frame[5:7]
            return Message(name=newer[0], fields=newer[1], system=system, component=component)
        fields = {field: getattr(received, field) for field in received.fieldnames}
        fields |= extension_fields(name, frame)
        for field in _TEXTS & fields.keys():
            if isinstance(fields[field], bytes):
                fields[field] = fields[field].decode("utf-8", errors="replace")
            fields[field] = fields[field].split("\0", 1)[0]
        if name == "PARAM_VALUE":
            fields["param_bytes"] = frame_content(frame)[:4].ljust(4, b"\0")
        return Message(
            name=name,
            fields=fields,
            system=received.get_srcSystem(),
            component=received.get_srcComponent(),
        )
