"""What goes wrong on a line: each fault by chance, but the same for the same seed."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterator

_LONGEST_HOLD_S = 0.3
"""A frame that is to be overtaken is held back for up to this. [s]"""
_DUPLICATE_S = 0.01
_MOST_GARBAGE = 40
_SHARES = ("loss", "duplication", "reordering", "garbage", "truncation")
ITEMS = frozenset({"MISSION_ITEM_INT", "MISSION_ITEM"})
"""Messages that are cut short."""


@frozen
class DirectionFaults:
    """What happens to frames on their way in one direction."""

    loss: float = 0.0
    """Share of the frames that do not arrive. [-]"""
    duplication: float = 0.0
    """Share that arrive twice. [-]"""
    reordering: float = 0.0
    """Share that later ones overtake. [-]"""
    delay_s: float = 0.0
    """How long every frame is on its way. [s]"""
    garbage: float = 0.0
    """Share that have bytes before them that are none of theirs. [-]"""
    truncation: float = 0.0
    """Share of the mission items whose frame is cut short. [-]"""

    def __post_init__(self) -> None:
        for name in _SHARES:
            if not 0.0 <= getattr(self, name) <= 1.0:
                msg = f"{name} is a share from 0 to 1, got {getattr(self, name)}"
                raise ValueError(msg)
        if not self.delay_s >= 0.0:
            msg = f"a delay cannot be {self.delay_s} s"
            raise ValueError(msg)


@frozen
class LineFaults:
    """What goes wrong on a line, in both directions."""

    to_vehicle: DirectionFaults = DirectionFaults()
    from_vehicle: DirectionFaults = DirectionFaults()
    silent_after: int | None = None
    """So many messages of transfers pass, either way, then nothing does; ``None``: it never ends."""
    silence_s: float = float("inf")
    """How long nothing passes. [s]"""
    seed: int = 0


class Direction:
    """Frames on their way in one direction.

    Parameters
    ----------
    faults : DirectionFaults
        What happens to them.
    seed : int
        Of the chance by which it does.
    """

    def __init__(self, faults: DirectionFaults, seed: int) -> None:
        self._faults = faults
        self._random = random.Random(seed)

    def arrivals_s(self, now_s: float) -> Iterator[float]:
        """Yield when a frame that is sent now arrives: never, once or twice. [s]"""
        # Every chance is drawn for every frame: one fault does not change when another one strikes.
        lost, doubled, overtaken, held = (self._random.random() for _ in range(4))
        faults = self._faults
        if lost < faults.loss:
            return
        arrival_s = now_s + faults.delay_s
        if overtaken < faults.reordering:
            arrival_s += held * _LONGEST_HOLD_S
        yield arrival_s
        if doubled < faults.duplication:
            yield arrival_s + _DUPLICATE_S

    def damaged(self, frame: bytes, *, is_item: bool) -> bytes:
        """Return a frame as it arrives: cut short, or with garbage before it."""
        spoilt, cut, length, where = (self._random.random() for _ in range(4))
        if is_item and cut < self._faults.truncation:
            frame = frame[: 1 + int(where * (len(frame) - 1))]
        if spoilt < self._faults.garbage:
            garbage = self._random.randbytes(1 + int(length * _MOST_GARBAGE))
            frame = garbage + frame
        return frame
