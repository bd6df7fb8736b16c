"""Between bytes and messages: pymavlink's dialect, which stops here."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from planner.errors import UsageError
from planner.link.message import Message
from planner.link.newer_messages import (
    LAYOUTS,
    extended_frame,
    extension_fields,
    frame_content,
    newer_frame,
    read_newer,
)

if TYPE_CHECKING:
    from types import ModuleType

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
