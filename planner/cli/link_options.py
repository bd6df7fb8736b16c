"""The options of every command that speaks to a vehicle, and the progress it tells of."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click

from planner.cli.number_option import FiniteRange
from planner.cli.output import narrate

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.live import LinkRequest

LINK_OPTIONS = (
    click.option(
        "--baud",
        metavar="BD",
        type=click.IntRange(300, 20_000_000),
        help="speed of a serial line whose address names none [default: 57600]",
    ),
    click.option(
        "--system-id",
        metavar="N",
        type=click.IntRange(1, 255),
        help="the vehicle to speak to [default: the only one on the line]",
    ),
    click.option(
        "--own-system-id",
        metavar="N",
        type=click.IntRange(1, 255),
        default=245,
        help="system id of this program; the vehicle's COM_ARM_AUTH_ID for a guard [default: 245]",
    ),
    click.option(
        "--heartbeat-timeout",
        metavar="S",
        type=FiniteRange(min=0.0, min_open=True, max=3600.0),
        default=10.0,
        help="how long to wait for the vehicle [default: 10]",
    ),
    click.option(
        "--reply-timeout",
        metavar="S",
        type=FiniteRange(min=0.0, min_open=True, max=600.0),
        default=1.5,
        help="longest wait until a request is repeated, longer for slow radios [default: 1.5]",
    ),
    click.option(
        "--retries",
        metavar="N",
        type=click.IntRange(0, 1000),
        default=12,
        help="how often a request is repeated until the transfer counts as stalled [default: 12]",
    ),
)
_SILENCE_S = 5.0
"""Where there is no terminal, something is said after so long. [s]"""
LINK_KEYS = (
    *("baud", "system_id", "own_system_id", "heartbeat_timeout", "reply_timeout", "retries"),
)


def link_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the link to a command."""
    for option in reversed(LINK_OPTIONS):
        command = option(command)
    return command


def is_vehicle(name: str) -> bool:
    """Return whether an argument names a vehicle on the line, and no file."""
    if not (":" in name or name.startswith("/dev/") or name.upper().startswith("COM")):
        return False  # a file's name in nearly every check: nothing of the link is imported
    from planner.link.address import is_address

    return is_address(name)


def link_request(url: str, options: Mapping[str, Any]) -> LinkRequest:
    """Return the request that the options of the link make; say the normalised address.

    Raises
    ------
    UsageError
        If the address is none.
    """
    from planner.link.address import read_address
    from planner.link.exchange import LinkSettings
    from planner.live import LinkRequest

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
    )


class TransferProgress:
    """Tells on standard error how far a transfer is: item by item on a terminal, else now and then.

    Parameters
    ----------
    now_s : callable
        The time by any clock. [s]
    """

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._said_s = now_s()
        self._is_terminal = sys.stderr is not None and sys.stderr.isatty()
        self._told: set[str] = set()

    def __call__(self, what: str, done: int, count: int | None) -> None:
        """Take how much of what is done."""
        if what in self._told:
            return
        if count is None:
            self._tell_now_and_then(f"waiting for {what}")
        elif done < count:
            self._tell_now_and_then(f"{what}: {done} of {count}")
        else:
            self._told.add(what)
            self._overwrite("")
            self._narrate(f"{what}: {count} of {count}" if count else f"{what}: none")

    def _tell_now_and_then(self, text: str) -> None:
        self._overwrite(text)
        if not self._is_terminal and self._now_s() - self._said_s >= _SILENCE_S:
            self._narrate(text)

    def _narrate(self, text: str) -> None:
        narrate(text)
        self._said_s = self._now_s()

    def _overwrite(self, text: str) -> None:
        if self._is_terminal:
            with suppress(OSError):
                sys.stderr.write(f"\r\x1b[K{text}")
                sys.stderr.flush()
