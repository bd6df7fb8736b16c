"""Why a line cannot be opened, and what to try, in one sentence."""

from __future__ import annotations

import errno
import os
import socket
from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.link.address import LinkKind

if TYPE_CHECKING:
    from collections.abc import Mapping

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
