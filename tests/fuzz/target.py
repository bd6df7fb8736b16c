"""A fuzz target: what is fed with inputs, and what counts as a finding."""

from __future__ import annotations

import atexit
import hashlib
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from fuzz.mutation import mutated

from planner.errors import MavjouleError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

CRASHERS = Path(__file__).parent / "crashers"
"""Every input that was once a finding, by target: replayed for ever."""
_MEMORY = Path("/dev/shm")
_KEPT = TemporaryDirectory(prefix="mavjoule-fuzz-", dir=_MEMORY if _MEMORY.is_dir() else None)
atexit.register(_KEPT.cleanup)
FOLDER = Path(_KEPT.name)
"""In memory where the computer has such a place: a disk is ten times slower than most readers."""
LONGEST_S = 60.0
"""An input that takes longer is a finding: it may never end.  The largest have 1 MB; the slowest past
finding takes 9 s, and the slowest machine that was seen 2.5 times as long."""


class TooSlowError(Exception):
    """An input took longer than any may."""


@dataclass(frozen=True)
class Target:
    """Something that reads what it is given."""

    name: str
    seeds: Sequence[bytes]
    run: Callable[[bytes], object]
    """Fails in any way but with one of our own errors: a finding."""
    make: Callable[[Random], bytes] | None = None
    """Makes an input; by default a seed is damaged."""
    damaged_seeds: float = 0.0
    """So many inputs of a target that makes its own are damaged seeds all the same."""

    def inputs(self, seed: int) -> Iterator[bytes]:
        """Yield inputs without end, the same for the same seed."""
        draw = Random(f"{self.name} {seed}")
        while True:
            is_made = self.make is not None and draw.random() >= self.damaged_seeds
            yield self.make(draw) if self.make and is_made else mutated(self.seeds, draw)

    def try_one(self, data: bytes) -> None:
        """Feed one input; raise what is a finding."""
        began_s = time.process_time()
        with suppress(MavjouleError):
            self.run(data)
        taken_s = time.process_time() - began_s
        if taken_s > LONGEST_S:
            msg = f"{taken_s:.1f} s for {len(data)} bytes"
            raise TooSlowError(msg)

    def crashers(self) -> list[Path]:
        """Return the inputs that once were findings."""
        return sorted((CRASHERS / self.name).glob("*"))

    def keep(self, data: bytes) -> Path:
        """Write an input that is a finding where it is replayed from."""
        folder = CRASHERS / self.name
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / hashlib.sha256(data).hexdigest()[:16]
        path.write_bytes(data)
        return path
