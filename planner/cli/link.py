"""The line to a vehicle: its options, and how far a transfer on it is."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planner.cli.options import kind_option, path_option
from planner.cli.output import StatusLine, narrate
from planner.setting import Number

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.link.vehicle import LinkRequest

_SYSTEM_ID = click.IntRange(1, 255)
LINK_OPTIONS: dict[str, Callable[[Callable[..., Any]], Callable[..., Any]]] = {
    "baud": click.option(
        "--baud",
        metavar="BD",
        type=click.IntRange(300, 20_000_000),
        help="speed of a serial line whose address names none [default: 57600]",
    ),
    "system_id": click.option(
        "--system-id",
        metavar="N",
        type=_SYSTEM_ID,
        help="the vehicle to speak to [default: the only one on the line]",
    ),
    "own_system_id": click.option(
        "--own-system-id",
        metavar="N",
        type=_SYSTEM_ID,
        default=245,
        help="system id of this program; the vehicle's COM_ARM_AUTH_ID for a guard [default: 245]",
    ),
    "signing_key": path_option(
        "--signing-key",
        help="sign all messages, and take none that is not signed, by the key in a file that only you may "
        "read: 32 bytes or 64 hexadecimal digits; a passphrase's is its SHA-256 [default: unsigned]",
    ),
    "heartbeat_timeout": kind_option(
        "--heartbeat-timeout",
        Number("s", 0.0, 3600.0, is_open=True),
        "how long to wait for the vehicle",
        default=10.0,
    ),
    "reply_timeout": kind_option(
        "--reply-timeout",
        Number("s", 0.0, 600.0, is_open=True),
        "longest wait until a request is repeated, longer for slow radios",
        default=1.5,
    ),
    "retries": click.option(
        "--retries",
        metavar="N",
        type=click.IntRange(0, 1000),
        default=12,
        help="how often a request is repeated until the transfer counts as stalled [default: 12]",
    ),
}
"""By the names of their parameters."""
_SILENCE_S = 5.0
"""Where there is no terminal, progress is reported so often. [s]"""


def link_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the link to a command."""
    for option in reversed(LINK_OPTIONS.values()):
        command = option(command)
    return command


def taken_link(options: dict[str, Any]) -> dict[str, Any]:
    """Take the options of the link out of those of a command."""
    return {key: options.pop(key) for key in LINK_OPTIONS}


def is_vehicle(name: str) -> bool:
    """Return whether an argument names a vehicle on the line, and no file."""
    if not (":" in name or name.startswith("/dev/") or name.upper().startswith("COM")):
        return False  # a file's name in nearly every check: nothing of the link is imported
    if Path(name).exists() and not Path(name).is_char_device():
        return False  # /dev/stdin, or /dev/fd/63 of <(…)
    from planner.link.address import is_address

    return is_address(name)


def link_request(url: str, options: Mapping[str, Any]) -> LinkRequest:
    """Return the request that the options of the link make; report the normalised address.

    Raises UsageError if the address is none.
    """
    from planner.link.address import read_address
    from planner.link.transfers import LinkSettings
    from planner.link.vehicle import LinkRequest

    address = read_address(url, baud=options["baud"])
    narrate(f"connecting to {address.text}")
    return LinkRequest(
        address=address,
        settings=LinkSettings(
            heartbeat_timeout_s=options["heartbeat_timeout"],
            reply_timeout_s=options["reply_timeout"],
            shortest_timeout_s=min(options["reply_timeout"], 0.1),
            retries=options["retries"],
        ),
        system=options["system_id"],
        own_system=options["own_system_id"],
        signing_key=options["signing_key"],
    )


class TransferProgress(StatusLine):
    """Reports on standard error how far a transfer is: item by item on a terminal, else periodically."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._now_s = now_s
        self._reported_s = now_s()
        self._done: set[str] = set()

    def __call__(self, what: str, done: int, count: int | None) -> None:
        """Take how much of what is done."""
        if what in self._done:
            return
        if count is not None and done >= count:
            self._done.add(what)
            self.narrate(f"{what}: {count} of {count}" if count else f"{what}: none")
            self._reported_s = self._now_s()
            return
        text = f"waiting for {what}" if count is None else f"{what}: {done} of {count}"
        self.show(text)
        if not self.is_terminal and self._now_s() - self._reported_s >= _SILENCE_S:
            self.narrate(text)
            self._reported_s = self._now_s()
