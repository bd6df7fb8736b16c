"""The line itself: bytes to and from a vehicle over UDP, TCP or a serial port."""

from __future__ import annotations

import errno
import os
import select
import socket
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Protocol

from planner.errors import LinkError, UsageError
from planner.link.address import LinkKind

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping

    from planner.link.address import LinkAddress


_SOCKETS: Mapping[int, str] = {
    errno.EADDRINUSE: "another program has this port: close the other ground station, or listen on "
    "another one",
    errno.EADDRNOTAVAIL: "listened on is an address of this computer, and that is none: listen on "
    "0.0.0.0, or reach a vehicle at that address by udpout or tcp",
    errno.EACCES: "ports below 1024 want more rights: take another one",
    errno.ECONNREFUSED: "nothing listens there: is the vehicle, or its simulator, running?",
    errno.ETIMEDOUT: "nobody answers there: is the host right, does a firewall keep it away?",
    errno.EHOSTUNREACH: "no way leads there: is the network up?",
    errno.ENETUNREACH: "no way leads there: is the network up?",
}
_SERIAL: Mapping[int, str] = {
    errno.EACCES: "this user may not: join the group that owns it (dialout, uucp), and log in again",
    errno.EPERM: "this user may not: join the group that owns it (dialout, uucp), and log in again",
    errno.EBUSY: "another program has it open: close the other ground station",
    errno.EAGAIN: "another program has it open: close the other ground station",
    errno.ENOTTY: "that is no serial device",
    errno.EINVAL: "it does not take that speed, or is no serial device",
}
_MOST_PORTS = 8


def opening_error(address: LinkAddress, error: OSError) -> LinkError:
    """Return the error to raise where a line cannot be opened."""
    number = error.errno or _wrapped_number(error)
    why = os.strerror(number) if number else str(error)
    if isinstance(error, socket.gaierror):
        why, advice = "there is no such host", "spell it again, or give its number"
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
"""So long a serial port is waited for at a time: to change it, pyserial sets the port up anew. [s]"""


class Line(Protocol):
    """Something that carries bytes; `planner.errors.LinkError` where it is closed."""

    def now_s(self) -> float:
        """Return the time by the clock that `receive` waits by [s]."""

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return what has come, each with its sender, after at most this time [s]."""

    def send(self, data: bytes, peer: Hashable | None = None) -> None:
        """Send a frame to one sender, or to all that are known."""

    def close(self) -> None:
        """Close it."""


def open_line(address: LinkAddress) -> Line:
    """Return the open line of an address.

    Raises
    ------
    LinkError
        If it cannot be opened.
    UsageError
        If a serial line is asked for and pyserial is not installed.
    """
    try:
        if address.kind is LinkKind.SERIAL:
            return SerialLine(address)
        if address.kind in {LinkKind.UDP_LISTEN, LinkKind.UDP_SEND}:
            return UdpLine(address)
        return TcpLine(address)
    except OSError as error:
        raise opening_error(address, error) from error


class _Clocked:
    """What all real lines share: they wait by the computer's clock."""

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
            except ConnectionError:  # a port that nobody listens on said so; it may be opened yet
                continue
            except BlockingIOError:
                break
            except OSError as error:
                msg = f"the line broke: {error.strerror or error}"
                raise LinkError(msg) from error
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
            msg = f"the line broke: {error.strerror or error}"
            raise LinkError(msg) from error
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
            msg = f"the line broke: {error.strerror or error}"
            raise LinkError(msg) from error

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
            raise _broken(error) from error
        return [(None, data)]

    def send(self, data: bytes, peer: Hashable | None = None) -> None:  # noqa: ARG002 - one peer
        """Send a frame."""
        try:
            self._port.write(data)
        except OSError as error:
            raise _broken(error) from error

    def close(self) -> None:
        """Close the port."""
        self._port.close()


def _broken(error: Exception) -> LinkError:
    """Return the error to raise where a serial line breaks."""
    return LinkError(f"the serial line broke: {error}; is the cable in?")


def _resolved(place: tuple[str, int], family: socket.AddressFamily) -> Any:  # noqa: ANN401 - as socket has it
    return socket.getaddrinfo(*place, family, socket.SOCK_DGRAM)[0][4]
