"""Where a vehicle answers, in every spelling that MAVLink programs use.

======================  ===========================================================================
pymavlink, MAVProxy     ``udpin:0.0.0.0:14550`` ``udpout:HOST:PORT`` ``tcp:HOST:PORT``
                        ``tcpin:HOST:PORT`` ``/dev/ttyUSB0`` ``/dev/ttyUSB0,57600`` ``COM3,57600``
MAVSDK                  ``udpin://0.0.0.0:14540`` ``udpout://HOST:PORT`` ``tcpout://HOST:PORT``
                        ``tcpin://HOST:PORT`` ``serial:///dev/ttyUSB0:57600``
MAVROS                  ``udp://:14540@HOST:14557`` ``tcp://HOST:PORT`` ``tcp-l://:5760``
bare                    ``127.0.0.1:14550`` (pymavlink: listen on UDP)
======================  ===========================================================================
"""

from __future__ import annotations

import ipaddress
import re
from enum import StrEnum
from typing import NoReturn

from planner.errors import UsageError
from planner.values import Value

DEFAULT_BAUD = 57_600
"""What telemetry radios and MAVProxy start with. [Bd]"""
_MOST_BAUD = 20_000_000
_MOST_PORT = 65_535
_EVERYWHERE = "0.0.0.0"
_EXAMPLES = "udpin:0.0.0.0:14550, tcp:127.0.0.1:5760 or /dev/ttyUSB0:57600"


class LinkKind(StrEnum):
    """How the line to a vehicle is opened; the values are those of the normalised form."""

    UDP_LISTEN = "udpin"
    UDP_SEND = "udpout"
    TCP_CONNECT = "tcp"
    TCP_LISTEN = "tcpin"
    SERIAL = "serial"


_SCHEMES = {
    "udp": LinkKind.UDP_LISTEN,
    "udpin": LinkKind.UDP_LISTEN,
    "udpout": LinkKind.UDP_SEND,
    "tcp": LinkKind.TCP_CONNECT,
    "tcpout": LinkKind.TCP_CONNECT,
    "tcpin": LinkKind.TCP_LISTEN,
    "tcp-l": LinkKind.TCP_LISTEN,
    "serial": LinkKind.SERIAL,
    "serial_flowcontrol": LinkKind.SERIAL,
    "serial-hwfc": LinkKind.SERIAL,
}
_LISTENING = frozenset({LinkKind.UDP_LISTEN, LinkKind.TCP_LISTEN})
_SCHEME = re.compile(r"(?P<scheme>[a-z][a-z0-9_+-]*):(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
_DEVICE = re.compile(
    r"(?P<device>/dev/[^\s:,?]+|COM\d{1,3})(?:[:,](?P<baud>\d{1,9}))?", re.IGNORECASE
)
_DEVICE_BEGUN = re.compile(r"(?:/dev/[^\s:,?]+|COM\d{1,3})(?=[:,])", re.IGNORECASE)
_HOST = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9_.-]*[A-Za-z0-9_])?", re.ASCII)


class LinkAddress(Value):
    """One way to a vehicle."""

    kind: LinkKind
    host: str = ""
    """Interface to listen on, or the other side; empty for a serial line."""
    port: int = 0
    device: str = ""
    """Of a serial line."""
    baud: int = DEFAULT_BAUD
    """Of a serial line. [Bd]"""
    flow_control: bool = False
    """Whether a serial line has RTS and CTS."""
    remote: tuple[str, int] | None = None
    """Host and port that a listening UDP line speaks to before it was spoken to."""

    @property
    def text(self) -> str:
        """The normalised form, which `read_address` reads back."""
        if self.kind is LinkKind.SERIAL:
            scheme = "serial_flowcontrol" if self.flow_control else "serial"
            return f"{scheme}:{self.device}:{self.baud}"
        if self.remote is not None:
            own = f"{self.kind}:{_bracketed(self.host)}:{self.port}"
            return f"{own}@{_bracketed(self.remote[0])}:{self.remote[1]}"
        return f"{self.kind}:{_bracketed(self.host)}:{self.port}"


def is_address(text: str) -> bool:
    """Return whether a text is meant as an address of a vehicle, and not as the name of a file."""
    if _DEVICE.fullmatch(text):
        return True
    scheme = _SCHEME.fullmatch(text)
    if scheme is not None and scheme["scheme"].lower() in _SCHEMES:
        return True
    host, colon, port = text.rpartition(":")
    return bool(colon) and port.isdecimal() and (host == "localhost" or _is_ip(host))


def read_address(text: str, *, baud: int | None = None) -> LinkAddress:
    """Return the address that a text names; the speed [Bd] is that of one which names none."""
    given = text.strip()
    if device := _DEVICE.fullmatch(given):
        return _serial(given, device["device"], device["baud"], baud)
    scheme = _SCHEME.fullmatch(given)
    name = "" if scheme is None else scheme["scheme"].lower()
    if scheme is None or name not in _SCHEMES:
        if is_address(given):
            return _socket(given, LinkKind.UDP_LISTEN, given)
        if given.isdecimal():
            _refuse(
                given, f"a port alone is ambiguous: udpin:{_EVERYWHERE}:{given} to listen on it"
            )
        if device := _DEVICE_BEGUN.match(given):
            speed = given[device.end() + 1 :]
            _refuse(
                given, f"{speed!r} is not a speed of {device.group()}: write {device.group()}:57600"
            )
        _refuse(given, f"it begins with none of {', '.join(_SCHEMES)} and is not a serial device")
    kind = _SCHEMES[name]
    rest = scheme["rest"].removeprefix("//").partition("?")[0]
    if kind is LinkKind.SERIAL:
        device_match = _DEVICE.fullmatch(rest)
        if device_match is None:
            _refuse(given, "it names no serial device such as /dev/ttyUSB0 or COM3")
        flow_control = name != "serial"
        return _serial(
            given, device_match["device"], device_match["baud"], baud, flow_control=flow_control
        )
    own, at, other = rest.rstrip("/").partition("@")
    if at and kind is LinkKind.UDP_LISTEN:
        return _mavros_udp(given, own, other)
    return _socket(given, kind, rest.rstrip("/"))


def _serial(
    given: str, device: str, written: str | None, baud: int | None, *, flow_control: bool = False
) -> LinkAddress:
    speed = int(written) if written is not None else baud or DEFAULT_BAUD
    if not 300 <= speed <= _MOST_BAUD:
        _refuse(given, f"no serial line has {speed} Bd")
    return LinkAddress(kind=LinkKind.SERIAL, device=device, baud=speed, flow_control=flow_control)


def _mavros_udp(given: str, own: str, other: str) -> LinkAddress:
    """Return the address of MAVROS' ``udp://[bind]:port@[remote]:port``."""
    bind = _host_and_port(given, own or ":14555", default_host=_EVERYWHERE)
    if not other:
        return LinkAddress(kind=LinkKind.UDP_LISTEN, host=bind[0], port=bind[1])
    remote = _host_and_port(given, other if ":" in other else f"{other}:14550", default_host="")
    return LinkAddress(kind=LinkKind.UDP_LISTEN, host=bind[0], port=bind[1], remote=remote)


def _socket(given: str, kind: LinkKind, rest: str) -> LinkAddress:
    default_host = _EVERYWHERE if kind in _LISTENING else ""
    host, port = _host_and_port(given, rest, default_host=default_host)
    if kind is LinkKind.UDP_SEND and host == _EVERYWHERE:
        _refuse(given, f"nothing can be sent to {_EVERYWHERE}: name the vehicle's host")
    return LinkAddress(kind=kind, host=host, port=port)


def _host_and_port(given: str, text: str, *, default_host: str) -> tuple[str, int]:
    host, colon, digits = text.rpartition(":")
    if not colon and digits.isdecimal() and default_host:
        _refuse(given, f"it names a port and no interface, write {default_host}:{digits}")
    if not colon:
        _refuse(given, "it names no port")
    if not re.fullmatch(r"\d{1,5}", digits, re.ASCII) or not 1 <= int(digits) <= _MOST_PORT:
        _refuse(given, f"{digits!r} is not a port from 1 to {_MOST_PORT}")
    host = host.removeprefix("[").removesuffix("]") or default_host
    if not host:
        _refuse(given, "it names no host")
    if not (_is_ip(host) or _HOST.fullmatch(host)):
        _refuse(given, f"{host!r} is not a host")
    return host, int(digits)


def _is_ip(host: str) -> bool:
    try:
        ipaddress.ip_address(host.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _refuse(given: str, why: str) -> NoReturn:
    msg = f"{given!r} is not an address of a vehicle: {why}; such as {_EXAMPLES}"
    raise UsageError(msg)
