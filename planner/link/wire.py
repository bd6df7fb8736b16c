"""The line itself: bytes to and from a vehicle over UDP, TCP or a serial port."""

from __future__ import annotations

import errno
import os
import select
import socket
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Protocol

from planner.errors import LinkError, UsageError
from planner.link.address import LinkKind
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping
    from types import ModuleType

    from planner.link.address import LinkAddress


_SOCKETS: Mapping[int, str] = {
    errno.EADDRINUSE: "another program has this port: close the other ground station, or listen on "
    "another one",
    errno.EADDRNOTAVAIL: "listened on is an address of this computer, and that is none: listen on "
    "0.0.0.0, or reach a vehicle at that address by udpout or tcp",
    errno.EACCES: "ports below 1024 need more rights: use another one",
    errno.ECONNREFUSED: "nothing listens there: is the vehicle, or its simulator, running?",
    errno.ETIMEDOUT: "nobody answers there: is the host right, does a firewall keep it away?",
    errno.EHOSTUNREACH: "no route to it: is the network up?",
    errno.ENETUNREACH: "no route to it: is the network up?",
}
_SERIAL: Mapping[int, str] = {
    errno.EACCES: "no permission: join the group that owns it (dialout, uucp), and log in again",
    errno.EPERM: "no permission: join the group that owns it (dialout, uucp), and log in again",
    errno.EBUSY: "another program has it open: close the other ground station",
    errno.EAGAIN: "another program has it open: close the other ground station",
    errno.ENOTTY: "that is not a serial device",
    errno.EINVAL: "it does not take that speed, or is not a serial device",
}
_MOST_PORTS = 8


def opening_error(address: LinkAddress, error: OSError) -> LinkError:
    """Return the error to raise where a line cannot be opened."""
    number = error.errno or _wrapped_number(error)
    why = os.strerror(number) if number else str(error)
    if isinstance(error, socket.gaierror):
        why, advice = "no such host", "check its spelling, or give its number"
    elif isinstance(error, TimeoutError):
        why, advice = "no answer", _SOCKETS[errno.ETIMEDOUT]
    elif address.kind is LinkKind.SERIAL:
        advice = "; ".join(filter(None, (_SERIAL.get(number, ""), _serial_ports(number))))
    else:
        advice = _SOCKETS.get(number, "")
    return LinkError(f"{address.text} cannot be opened: {why}" + (f"; {advice}" if advice else ""))


def _wrapped_number(error: OSError) -> int:
    """Return the number of the error that pyserial made a text of; 0 where there was none."""
    number = error.__context__.args[0] if error.__context__ and error.__context__.args else 0
    return number if isinstance(number, int) else 0


def _serial_ports(number: int) -> str:
    """Return which serial devices there are, where another one may be meant."""
    if number in {errno.EACCES, errno.EPERM, errno.EBUSY, errno.EAGAIN}:
        return ""
    from serial.tools import list_ports

    found = sorted(port.device for port in list_ports.comports())[:_MOST_PORTS]
    return f"there are {', '.join(found)}" if found else "there is no serial device: plug it in"


_CHUNK = 1 << 16
_MOST_PEERS = 16
"""Senders remembered on a UDP port; others are passed over."""
_CONNECT_S = 5.0
_SLICE_S = 0.02
"""So long a serial port is waited for at a time: to change it, pyserial sets the port up again. [s]"""


class VehicleLine(Protocol):
    """Something that carries bytes; `planner.errors.LinkError` where it is closed."""

    def now_s(self) -> float:
        """Return the time by the clock that `receive` waits by [s]."""

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return what has come, each with its sender, after at most this time [s]."""

    def send(self, data: bytes, peer: Hashable | None = None) -> None:
        """Send a frame to one sender, or to all that are known."""

    def close(self) -> None:
        """Close it."""


def open_line(address: LinkAddress) -> VehicleLine:
    """Return the open line of an address: `LinkError` where it cannot be opened."""
    try:
        if address.kind is LinkKind.SERIAL:
            return SerialLine(address)
        if address.kind in {LinkKind.UDP_LISTEN, LinkKind.UDP_SEND}:
            return UdpLine(address)
        return TcpLine(address)
    except OSError as error:
        raise opening_error(address, error) from error


def _broken(error: OSError) -> LinkError:
    """Return the error to raise where a line breaks."""
    return LinkError(f"the line broke: {error.strerror or error}")


class _Clocked:
    """All real lines wait by the computer's clock."""

    def now_s(self) -> float:
        """Return a time that only grows [s]."""
        return time.monotonic()


class UdpLine(_Clocked):
    """Datagrams; a listening line answers whoever spoke to it."""

    def __init__(self, address: LinkAddress) -> None:
        family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._peers: list[Any] = []
        try:
            if address.kind is LinkKind.UDP_LISTEN:
                self._socket.bind((address.host, address.port))
                if address.remote is not None:
                    self._peers.append(_resolved(address.remote, family))
            else:
                self._peers.append(_resolved((address.host, address.port), family))
            self._socket.settimeout(0.0)
        except OSError:
            self._socket.close()
            raise

    @property
    def port(self) -> int:
        """The port it has on this side."""
        return int(self._socket.getsockname()[1])

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return the datagrams that have come."""
        if not select.select([self._socket], [], [], max(timeout_s, 0.0))[0]:
            return []
        found: list[tuple[Hashable, bytes]] = []
        while len(found) < 256:
            try:
                data, peer = self._socket.recvfrom(_CHUNK)
            except ConnectionError:  # nobody listens on that port yet
                continue
            except BlockingIOError:
                break
            except OSError as error:
                raise _broken(error) from error
            if peer not in self._peers:
                if len(self._peers) >= _MOST_PEERS:
                    continue
                self._peers.append(peer)
            found.append((peer, data))
        return found

    def send(self, data: bytes, peer: Hashable | None = None) -> None:
        """Send a datagram; one that the network does not take counts as lost."""
        for one in self._peers if peer is None else [peer]:
            with suppress(OSError):
                self._socket.sendto(data, one)  # type: ignore[arg-type] # as recvfrom returned it

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class TcpLine(_Clocked):
    """A stream; a listening line waits for the vehicle to connect."""

    def __init__(self, address: LinkAddress) -> None:
        self._listener: socket.socket | None = None
        self._stream: socket.socket | None = None
        if address.kind is LinkKind.TCP_LISTEN:
            family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
            self._listener = socket.create_server((address.host, address.port), family=family)
        else:
            place = (address.host, address.port)
            self._stream = socket.create_connection(place, timeout=_CONNECT_S)
            self._stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return what has come, once somebody is connected."""
        waited_on = self._stream or self._listener
        assert waited_on is not None
        if not select.select([waited_on], [], [], max(timeout_s, 0.0))[0]:
            return []
        if self._stream is None:
            assert self._listener is not None
            self._stream, _ = self._listener.accept()
            self._stream.settimeout(_CONNECT_S)
            return []
        try:
            data = self._stream.recv(_CHUNK)
        except OSError as error:
            raise _broken(error) from error
        if not data:
            msg = (
                "the other side closed the line: is the vehicle, or its simulator, still running, and "
                "has it another ground station where it takes one only?"
            )
            raise LinkError(msg)
        return [(None, data)]

    def send(self, data: bytes, peer: Hashable | None = None) -> None:  # noqa: ARG002 - one peer
        """Send a frame, where somebody is connected."""
        if self._stream is None:
            return
        try:
            self._stream.sendall(data)
        except OSError as error:
            raise _broken(error) from error

    def close(self) -> None:
        """Close the sockets."""
        for one in (self._stream, self._listener):
            if one is not None:
                one.close()


class SerialLine(_Clocked):
    """A serial port."""

    def __init__(self, address: LinkAddress) -> None:
        try:
            import serial
        except ImportError as error:
            msg = (
                "pyserial is missing, which opens serial lines: install it with "
                "pip install 'mavjoule[link]'"
            )
            raise UsageError(msg) from error
        self._port = serial.Serial(
            address.device,
            address.baud,
            timeout=_SLICE_S,
            write_timeout=_CONNECT_S,
            rtscts=address.flow_control,
            exclusive=True,  # two that read one port get half of it each
        )

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return what has come."""
        until_s = self.now_s() + timeout_s
        try:
            while not (data := self._port.read(max(self._port.in_waiting, 1))):
                if self.now_s() >= until_s:
                    return []
        except OSError as error:  # as pyserial's own errors are
            raise self._broken(error) from error
        return [(None, data)]

    def send(self, data: bytes, peer: Hashable | None = None) -> None:  # noqa: ARG002 - one peer
        """Send a frame."""
        try:
            self._port.write(data)
        except OSError as error:
            raise self._broken(error) from error

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _broken(self, error: OSError) -> LinkError:
        return LinkError(f"the serial line broke: {error}; is the cable in?")


def _resolved(place: tuple[str, int], family: socket.AddressFamily) -> Any:  # noqa: ANN401 - as socket has it
    return socket.getaddrinfo(*place, family, socket.SOCK_DGRAM)[0][4]


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


_HEAD = 10
"""Bytes of a version 2 frame before its content."""


class MessageLayout(Value):
    """The layout of a message in its frame."""

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
    """Fields after those that a dialect knows of a message."""

    start: int
    """Bytes of the content before them."""
    crc_extra: int
    fields: tuple[str, ...]
    """Names; each takes four bytes, 0 where it is not sent."""


LAYOUTS: Mapping[str, MessageLayout] = {
    "EVENT": MessageLayout(
        number=410,
        crc_extra=160,
        fields=(
            *(("id", "I"), ("event_time_boot_ms", "I"), ("sequence", "H")),
            *(("destination_component", "B"), ("destination_system", "B")),
            *(("log_levels", "B"), ("arguments", "40s")),
        ),
    ),
    "CURRENT_EVENT_SEQUENCE": MessageLayout(
        number=411, crc_extra=106, fields=(("sequence", "H"), ("flags", "B"))
    ),
    "REQUEST_EVENT": MessageLayout(
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
    """Return name and fields of a frame; ``None`` where it is no message of `LAYOUTS`, or damaged."""
    if frame[0] != 0xFD or len(frame) < _HEAD + frame[1] + 2:
        return None
    name = _NAMES.get(int.from_bytes(frame[7:10], "little"))
    if name is None:
        return None
    layout, end = LAYOUTS[name], _HEAD + frame[1]
    sent = int.from_bytes(frame[end : end + 2], "little")
    if checksum(frame[1:end] + bytes([layout.crc_extra])) != sent:
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
    """Return a message of `LAYOUTS` as a frame; fields that are missing are 0."""
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
    """Return pymavlink's dialect ardupilotmega, which holds common, in version 2."""
    try:
        from pymavlink.dialects.v20 import ardupilotmega
    except ImportError as error:
        raise UsageError(_MISSING.format(library="pymavlink")) from error
    dialect: ModuleType = ardupilotmega
    return dialect


class Codec:
    """Encodes for one sender, decodes one stream of bytes."""

    def __init__(self, system: int, component: int) -> None:
        self._dialect = load_dialect()
        self._encoder = self._dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        self._decoder = self._new_decoder()

    def encode(self, sent: Message, *, target: tuple[int, int] = (0, 0)) -> bytes:
        """Return a message in bytes: its target is added where it names none, other fields are 0."""
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
