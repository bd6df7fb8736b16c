"""The line itself: bytes to and from a vehicle over UDP, TCP or a serial port."""

from __future__ import annotations

import errno
import os
import select
import socket
import struct
import time
from contextlib import suppress
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Protocol

from planner.errors import LinkError, libraries_of
from planner.link.address import LinkKind
from planner.link.signing import LINK_ID
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping
    from types import ModuleType

    from planner.link.address import LinkAddress
    from planner.link.signing import Signer


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
    return (
        f"serial devices here: {', '.join(found)}"
        if found
        else "there is no serial device: plug it in"
    )


_CHUNK = 1 << 16
MOST_PEERS = 16
"""Senders remembered on a UDP port: of more, those that spoke last."""
_MOST_DATAGRAMS, _MOST_BYTES = 256, 1 << 16
"""Taken at a time; what is left waits in the system's own buffer, which is bounded.  Garbage takes
1.4 µs a byte, so that a flood never keeps a heartbeat or an answer waiting for more than 0.2 s."""
_CONNECT_S = 5.0
_KEPT_BYTES = 1 << 22
"""For some 30 s of a busy vehicle; of 208 kB, the usual buffer, 700 messages were lost in 30 s. [B]"""
RECONNECT_S = 10.0
"""So long a stream that broke is made again: what restarts between here and there takes seconds. [s]"""
_AGAIN_S = 0.5
"""Between two attempts. [s]"""
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
    return LinkError(f"the line broke: {error.strerror or error}")


class _Clocked:
    """All real lines wait by the computer's clock."""

    def now_s(self) -> float:
        """Return a time that only grows [s]."""
        return time.monotonic()


def _enlarge(one: socket.socket) -> None:
    """Have the system keep what comes while this program is busy, as much as it allows."""
    with suppress(OSError):
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _KEPT_BYTES)


class UdpLine(_Clocked):
    """Datagrams; a listening line answers whoever spoke to it."""

    def __init__(self, address: LinkAddress) -> None:
        family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        _enlarge(self._socket)
        self._named: Any = None
        """The other side, where the address names one."""
        self._heard: dict[Any, None] = {}
        """Who spoke to us, the latest last."""
        try:
            if address.kind is LinkKind.UDP_LISTEN:
                self._socket.bind((address.host, address.port))
                if address.remote is not None:
                    self._named = _resolved(address.remote, family)
            else:
                self._named = _resolved((address.host, address.port), family)
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
        size = 0
        while len(found) < _MOST_DATAGRAMS and size < _MOST_BYTES:
            try:
                data, peer = self._socket.recvfrom(_CHUNK)
            except ConnectionError:  # nobody listens on that port yet
                continue
            except BlockingIOError:
                break
            except OSError as error:
                raise _broken(error) from error
            put_last(self._heard, peer, None, most=MOST_PEERS)
            size += len(data)
            found.append((peer, data))
        return found

    def send(self, data: bytes, peer: Hashable | None = None) -> None:
        """Send a datagram; one that the network does not take counts as lost."""
        known = self._heard if self._named is None else {self._named: None, **self._heard}
        for one in known if peer is None else [peer]:
            with suppress(OSError):
                self._socket.sendto(data, one)  # type: ignore[arg-type] # as recvfrom returned it

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class TcpLine(_Clocked):
    """A stream; a listening line waits for the vehicle to connect.

    A stream that breaks is made again, for some time: what was under way is asked for again.
    """

    def __init__(self, address: LinkAddress) -> None:
        self._place = (address.host, address.port)
        self._listener: socket.socket | None = None
        self._stream: socket.socket | None = None
        self._broken_s: float | None = None
        """Since when nothing has come, once the stream broke. [s]"""
        if address.kind is LinkKind.TCP_LISTEN:
            family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
            self._listener = socket.create_server(self._place, family=family)
        else:
            self._stream = self._connected(_CONNECT_S)

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return what has come, once somebody is connected."""
        if self._stream is None and self._listener is None:
            self._connect_again(timeout_s)
            return []
        waited_on = self._stream or self._listener
        assert waited_on is not None
        if not select.select([waited_on], [], [], max(timeout_s, 0.0))[0]:
            self._refuse_absence()
            return []
        if self._stream is None:
            assert self._listener is not None
            self._stream, _ = self._listener.accept()
            self._stream.settimeout(_CONNECT_S)
            _enlarge(self._stream)
            return []
        try:
            data = self._stream.recv(_CHUNK)
        except OSError as error:
            self._break(error)
            return []
        if not data:
            self._break(None)
            return []
        self._broken_s = None
        return [(None, data)]

    def send(self, data: bytes, peer: Hashable | None = None) -> None:  # noqa: ARG002 - one peer
        """Send a frame, where somebody is connected."""
        if self._stream is None:
            return
        try:
            self._stream.sendall(data)
        except OSError as error:
            self._break(error)

    def close(self) -> None:
        """Close the sockets."""
        for one in (self._stream, self._listener):
            if one is not None:
                one.close()

    def _connected(self, timeout_s: float) -> socket.socket:
        stream = socket.create_connection(self._place, timeout=timeout_s)
        stream.settimeout(_CONNECT_S)
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        _enlarge(stream)
        return stream

    def _break(self, error: OSError | None) -> None:
        """Leave a stream that broke; `LinkError` where none has brought anything for too long."""
        assert self._stream is not None  # it has just been used
        self._stream.close()
        self._stream = None
        if self._broken_s is None:
            self._broken_s = self.now_s()
        self._refuse_absence(error)

    def _connect_again(self, timeout_s: float) -> None:
        began_s = self.now_s()
        if self._broken_s is None:
            self._broken_s = began_s
        try:
            self._stream = self._connected(min(max(timeout_s, _SLICE_S), _CONNECT_S))
        except OSError as error:
            self._refuse_absence(error)
            time.sleep(min(max(timeout_s - (self.now_s() - began_s), 0.0), _AGAIN_S))

    def _refuse_absence(self, error: OSError | None = None) -> None:
        if self._broken_s is None or self.now_s() - self._broken_s < RECONNECT_S:
            return
        self._broken_s = None  # whoever calls again may want to put back what the vehicle had
        if error is not None:
            raise _broken(error) from error
        msg = (
            "the other side closed the line: is the vehicle, or its simulator, still running, and "
            "has it another ground station where it takes one only?"
        )
        raise LinkError(msg)


class SerialLine(_Clocked):
    """A serial port."""

    def __init__(self, address: LinkAddress) -> None:
        with libraries_of("link"):
            import serial
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


def put_last(table: dict[Any, Any], key: Hashable, value: object, *, most: int) -> None:
    """Put a key at the end of a table, which forgets the one at its beginning when it grows too long."""
    table.pop(key, None)
    table[key] = value
    if len(table) > most:
        del table[next(iter(table))]


def _resolved(place: tuple[str, int], family: socket.AddressFamily) -> Any:  # noqa: ANN401 - as socket has it
    return socket.getaddrinfo(*place, family, socket.SOCK_DGRAM)[0][4]


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


class MessageLayout(Value):
    """The layout of a message in its frame."""

    number: int
    crc_extra: int
    """MAVLink's check sum over the definition, which that of a frame includes."""
    fields: tuple[tuple[str, str], ...]
    """Names and formats of `struct`, in the order of the frame."""

    def kind(self, name: str, dialect: Any) -> Any:  # noqa: ANN401 - pymavlink has no types
        """Return the message's class, as pymavlink generates those of its dialects."""
        names = [field for field, _ in self.fields]
        structure = struct.Struct("<" + "".join(form for _, form in self.fields))

        def begin(sent: Any, *values: object) -> None:  # noqa: ANN401 - as above
            dialect.MAVLink_message.__init__(sent, self.number, name)
            sent.__dict__ |= {"_fieldnames": names, **dict(zip(names, values, strict=True))}

        def pack(sent: Any, mav: Any, **how: Any) -> Any:  # noqa: ANN401 - as above
            empty = {field: b"" if "s" in form else 0 for field, form in self.fields}
            values = [getattr(sent, field) or empty[field] for field in names]
            return sent._pack(mav, self.crc_extra, structure.pack(*values), **how)  # noqa: SLF001

        body = {
            "__init__": begin,
            "pack": pack,
            "id": self.number,
            "msgname": name,
            "crc_extra": self.crc_extra,
            "fieldnames": names,
            "ordered_fieldnames": names,
            "native_format": bytearray(structure.format.encode()),
            "unpacker": structure,
            "orders": list(range(len(names))),
            "lengths": [1] * len(names),
            "array_lengths": [0] * len(names),
        }
        return type(f"MAVLink_{name.lower()}_message", (dialect.MAVLink_message,), body)


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
    "RESPONSE_EVENT_ERROR": MessageLayout(
        number=413,
        crc_extra=77,
        fields=(
            *(("sequence", "H"), ("sequence_oldest_available", "H")),
            *(("target_system", "B"), ("target_component", "B"), ("reason", "B")),
        ),
    ),
    "MISSION_CURRENT": MessageLayout(
        number=42,
        crc_extra=28,
        fields=(
            *(("seq", "H"), ("total", "H"), ("mission_state", "B"), ("mission_mode", "B")),
            *(("mission_id", "I"), ("fence_id", "I"), ("rally_points_id", "I")),
        ),
    ),
    "MISSION_COUNT": MessageLayout(
        number=44,
        crc_extra=221,
        fields=(
            *(("count", "H"), ("target_system", "B"), ("target_component", "B")),
            *(("mission_type", "B"), ("opaque_id", "I")),
        ),
    ),
}
"""By name, the messages that pymavlink lacks, or knows without their latest fields."""


def frame_content(frame: bytes) -> bytes:
    """Return the content of a whole frame of either version."""
    head = 10 if frame[0] == 0xFD else 6
    return frame[head : head + frame[1]]


_TEXTS = frozenset({"param_id", "text"})


@cache
def load_dialect() -> ModuleType:
    """Return pymavlink's dialect ardupilotmega, which holds common, in version 2; it reads `LAYOUTS` too."""
    with libraries_of("link"):
        from pymavlink.dialects.v20 import ardupilotmega
    dialect: ModuleType = ardupilotmega
    for name, layout in LAYOUTS.items():
        dialect.mavlink_map[layout.number] = layout.kind(name, dialect)
    return dialect


_MAGIC_1, _MAGIC_2 = 0xFE, 0xFD
_SIGNED, _SIGNATURE = 1, 13


class FrameFilter:
    """Leaves frames of other messages than those used out of a stream: decoding is what takes time.

    Only a frame that another one follows at once is left out; whatever else looks like one is decoded.
    """

    def __init__(self, used: frozenset[int]) -> None:
        self._used = used
        self._rest = b""
        self.skipped = 0
        """Frames left out so far."""

    def take(self, data: bytes) -> bytes:
        """Return what is to be decoded of these bytes, and of those kept before."""
        data = self._rest + data
        kept = bytearray()
        at = 0
        while at < len(data):
            number, size = _frame(data, at)
            if size == 0:  # not the beginning of a frame
                kept.append(data[at])
                at += 1
                continue
            end = at + size
            if end > len(data):
                break
            is_followed = end == len(data) or data[end] in {_MAGIC_1, _MAGIC_2}
            if number in self._used or not is_followed:
                kept += data[at:end]
            else:
                self.skipped += 1
            at = end
        self._rest = data[at:]
        return bytes(kept)


def _frame(data: bytes, at: int) -> tuple[int, int]:
    """Return number of the message and size of a frame; no size where none begins, too much of a part."""
    left = len(data) - at
    if data[at] == _MAGIC_2:
        if left < 10:
            return 0, left + 1
        signature = _SIGNATURE if data[at + 2] & _SIGNED else 0
        return int.from_bytes(data[at + 7 : at + 10], "little"), 12 + data[at + 1] + signature
    if data[at] == _MAGIC_1:
        return (data[at + 5], 8 + data[at + 1]) if left >= 6 else (0, left + 1)
    return 0, 0


@cache
def _numbers(names: frozenset[str]) -> frozenset[int]:
    """Return the numbers of messages by their names."""
    dialect = load_dialect()
    named = {kind.msgname: number for number, kind in dialect.mavlink_map.items()}
    return frozenset(named[name] for name in names)


class Codec:
    """Encodes for one sender, decodes one stream of bytes; signed where there is a signer.

    Of a stream, others than the used messages are left out where these are named.
    """

    def __init__(
        self,
        system: int,
        component: int,
        signer: Signer | None = None,
        *,
        used: frozenset[str] | None = None,
    ) -> None:
        self._dialect = load_dialect()
        self._signer = signer
        self._encoder = self._dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        self.refused = 0
        """Frames that were not signed, or not by the key, or not new."""
        self.filter = None if used is None else FrameFilter(_numbers(used))
        self._decoder = self._new_decoder()

    def encode(self, sent: Message, *, target: tuple[int, int] = (0, 0)) -> bytes:
        """Return a message in bytes: its target is added where it names none, other fields are 0."""
        aimed = {"target_system": target[0], "target_component": target[1], **sent.fields}
        if sent.name in LAYOUTS:
            kind = self._dialect.mavlink_map[LAYOUTS[sent.name].number]
        else:
            kind = getattr(self._dialect, f"MAVLink_{sent.name.lower()}_message")
        values = [aimed.get(name, 0) for name in kind.fieldnames]
        encoded = kind(*[v.encode() if isinstance(v, str) else v for v in values])
        if self._signer is not None:
            signing = self._encoder.signing
            signing.secret_key, signing.link_id = self._signer.key, LINK_ID
            signing.timestamp, signing.sign_outgoing = self._signer.following(), True
        frame = bytes(encoded.pack(self._encoder))
        self._encoder.seq = (self._encoder.seq + 1) % 256
        return frame

    def decode(self, data: bytes) -> list[Message]:
        """Return the messages that are complete with these bytes; what is none is passed over."""
        decoder = self._decoder
        try:
            found = decoder.parse_buffer(data if self.filter is None else self.filter.take(data))
        except (self._dialect.MAVError, struct.error, ValueError, IndexError, TypeError):
            self._decoder = self._new_decoder()  # nothing of it is worth keeping
            return []
        # pymavlink keeps all that came until nothing is pending, which a sender may never let happen.
        del decoder.buf[: decoder.buf_index]
        decoder.buf_index = 0
        return [
            self._message(one)
            for one in found or ()
            if one.get_type() != "BAD_DATA"
            and not one.get_type().startswith("UNKNOWN")
            and self._is_proven(bytes(one.get_msgbuf()))
        ]

    def _is_proven(self, frame: bytes) -> bool:
        if self._signer is None or self._signer.accepts(frame):
            return True
        self.refused += 1
        return False

    def _new_decoder(self) -> Any:  # noqa: ANN401 - pymavlink has no types
        decoder = self._dialect.MAVLink(None)
        decoder.robust_parsing = True
        return decoder

    def _message(self, received: Any) -> Message:  # noqa: ANN401 - pymavlink has no types
        name, frame = received.get_type(), bytes(received.get_msgbuf())
        fields = {field: getattr(received, field) for field in received.fieldnames}
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


class Decoders:
    """Decoders of one line's senders, whose frames may be interleaved; the latest `MOST_PEERS` are kept."""

    def __init__(
        self,
        system: int,
        component: int,
        signer: Signer | None = None,
        *,
        used: frozenset[str] | None = None,
    ) -> None:
        self._new = partial(Codec, system, component, signer, used=used)
        self._of: dict[Hashable, Codec] = {}

    @property
    def refused(self) -> int:
        """Frames that were not signed, or not by the key, or not new, of the senders kept."""
        return sum(one.refused for one in self._of.values())

    @property
    def skipped(self) -> int:
        """Frames of messages that are not used, of the senders kept."""
        return sum(one.filter.skipped for one in self._of.values() if one.filter is not None)

    def decode(self, data: bytes, peer: Hashable) -> list[Message]:
        """Return the messages of a sender that are complete with these bytes."""
        decoder = self._of.get(peer) or self._new()
        put_last(self._of, peer, decoder, most=MOST_PEERS)
        return decoder.decode(data)
