"""MAVLink 2 signing: frames that only who has the key can send, each but once.

A key is 32 bytes.  MAVProxy, Mission Planner and QGroundControl make theirs of a passphrase, by its
SHA-256; ArduPilot and PX4 are given it by SETUP_SIGNING, which this program never sends.  A frame is
signed by the first 6 bytes of the SHA-256 of key, frame, link and time, in units of 10 µs since 2015,
which grows on each link of each sender (https://mavlink.io/en/guide/message_signing.html).
"""

from __future__ import annotations

import hashlib
import hmac
import os
import stat
import time
from contextlib import suppress
from typing import TYPE_CHECKING

import msgspec

from planner.errors import OutputError, UsageError
from planner.files import write_output_bytes
from planner.values import Value, field

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


_KEY_BYTES = 32
_MOST_BYTES = 256
"""Of a key's file: 64 digits and what an editor leaves at the end."""
_OTHERS = 0o077
"""Rights of those who must not read a key."""
_EPOCH_S = 1_420_070_400
"""2015-01-01 UTC. [s since 1970]"""
_UNITS_PER_S = 100_000
_NEW_LINK = 60 * _UNITS_PER_S
"""So old the first frame of a sender may be, as the protocol has it: clocks differ."""
_RESERVED = 2 * _UNITS_PER_S
"""Times are kept on disk so far ahead: none is used twice, however this program ends."""
_MOST_LINKS = 64
"""Senders remembered; autopilots remember 16."""
_SIGNED = 0x01
_SIGNATURE_BYTES = 13
LINK_ID = 0
"""Of this program's frames; autopilots remember few links, so it is always the same."""


def read_signing_key(path: Path) -> bytes:
    """Return the key in a file of 32 bytes, or 64 hexadecimal digits.

    Raises
    ------
    UsageError
        If it cannot be read, others may read it, or it holds no key.
    """
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            data = file.read(_MOST_BYTES + 1)
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror or error}"
        raise UsageError(msg) from error
    if os.name == "posix" and stat.S_IMODE(mode) & _OTHERS:
        msg = (
            f"{path}: others may use this key (mode {stat.S_IMODE(mode):04o}): make it yours alone by "
            f"chmod 600 {path}, or a new key if they did"
        )
        raise UsageError(msg)
    key = data
    if len(data) != _KEY_BYTES:
        with suppress(ValueError):
            key = bytes.fromhex(data.decode("ascii", errors="replace"))
    if len(key) != _KEY_BYTES:
        msg = (
            f"{path}: expected a key of 32 bytes or 64 hexadecimal digits, got {len(data)} bytes; that of "
            "a passphrase is its SHA-256: printf %s 'PASSPHRASE' | sha256sum | cut -c -64"
        )
        raise UsageError(msg)
    if not any(key):
        msg = f"{path}: a key of zeros is none: it switches signing off"
        raise UsageError(msg)
    return key


class _Kept(Value):
    """What is on disk between two calls."""

    own: int = 0
    """No frame of this program has this time yet, or a later one."""
    links: dict[str, int] = field(default_factory=dict)
    """Time of the latest frame by sender: ``link:system:component``."""


class Signer:
    """Signs what goes out, and takes what is signed and newer than all before.

    Times are kept in a file, where one is given, so that no frame of an earlier call is taken again,
    and no clock that was set back makes ours old.

    Raises
    ------
    UsageError, OutputError
        If that file is broken, or cannot be written.
    """

    def __init__(
        self, key: bytes, *, kept: Path | None = None, now_s: Callable[[], float] = time.time
    ) -> None:
        self.key = key
        self._file = kept
        self._now_s = now_s
        found = self._read()
        self._links = dict(found.links)
        self._last = max(found.own, self._clock())
        self._reserved = self._last
        self._save(self._last + _RESERVED)

    def following(self) -> int:
        """Return the time of the next frame: later than any before."""
        self._last = max(self._last + 1, self._clock())
        if self._last >= self._reserved:
            with suppress(OutputError):  # a full disk is no reason to leave a transfer halfway
                self._save(self._last + _RESERVED)
        return self._last

    def accepts(self, frame: bytes) -> bool:
        """Return whether a whole frame is signed by the key and newer than its sender's last one."""
        if frame[0] != 0xFD or not frame[2] & _SIGNED:
            return False
        digest = hashlib.sha256(self.key + frame[:-6]).digest()[:6]
        if not hmac.compare_digest(digest, frame[-6:]):
            return False
        link = f"{frame[-_SIGNATURE_BYTES]}:{frame[5]}:{frame[6]}"
        when = int.from_bytes(frame[-12:-6], "little")
        before = self._links.get(link)
        if before is None:
            is_new = when + _NEW_LINK >= max(self._last, self._clock())
            if not is_new or len(self._links) >= _MOST_LINKS:
                return False
        elif when <= before:
            return False
        self._links[link] = when
        self._last = max(self._last, when)
        return True

    def close(self) -> None:
        """Keep the latest times."""
        with suppress(OutputError):
            self._save(self._last + 1)

    def _clock(self) -> int:
        return int((self._now_s() - _EPOCH_S) * _UNITS_PER_S)

    def _read(self) -> _Kept:
        if self._file is None:
            return _Kept()
        try:
            return msgspec.json.decode(self._file.read_bytes(), type=_Kept)
        except FileNotFoundError:
            return _Kept()
        except OSError as error:
            msg = f"{self._file}: cannot be read: {error.strerror or error}"
            raise UsageError(msg) from error
        except msgspec.DecodeError as error:
            msg = (
                f"{self._file}: holds no times of signed frames: remove it where the clock of this "
                "computer is right"
            )
            raise UsageError(msg) from error

    def _save(self, own: int) -> None:
        """Keep times on disk, and those of another call under way where they are later."""
        self._reserved = own
        if self._file is None:
            return
        other = _Kept()
        with suppress(UsageError):
            other = self._read()
        links = {
            link: max(when, other.links.get(link, 0))
            for link, when in {**other.links, **self._links}.items()
        }
        kept = _Kept(own=own, links=dict(list(links.items())[-_MOST_LINKS:]))
        write_output_bytes(self._file, msgspec.json.encode(kept))


def open_signer(path: Path | None) -> Signer | None:
    """Return what signs by the key in a file, its times in a file beside it; ``None`` of no file."""
    if path is None:
        return None
    return Signer(read_signing_key(path), kept=path.with_name(f"{path.name}.times"))
