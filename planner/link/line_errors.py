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
    errno.EADDRNOTAVAIL: "this computer has no such address: listen on 0.0.0.0, or send with udpout",
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
}
_MOST_PORTS = 8


def opening_error(address: LinkAddress, error: OSError) -> LinkError:
    """Return the error to raise where a line cannot be opened."""
    why = os.strerror(error.errno) if error.errno else str(error)
    if isinstance(error, socket.gaierror):
        why, advice = "there is no such host", "spell it again, or give its number"
    elif isinstance(error, TimeoutError):
        why, advice = "no answer", _SOCKETS[errno.ETIMEDOUT]
    elif address.kind is LinkKind.SERIAL:
        advice = _SERIAL.get(error.errno or 0, "") or _serial_ports()
    else:
        advice = _SOCKETS.get(error.errno or 0, "")
    return LinkError(f"{address.text} cannot be opened: {why}" + (f"; {advice}" if advice else ""))


def _serial_ports() -> str:
    """Return which serial devices there are."""
    from serial.tools import list_ports

    found = sorted(port.device for port in list_ports.comports())[:_MOST_PORTS]
    return f"there are {', '.join(found)}" if found else "there is no serial device: plug it in"
