"""The packs of a fleet on its chargers: which is charged when, and how full it is when it is taken.

Nothing is planned here: a free charger takes, of the packs that wait, the one that is needed next, and
keeps it until it is full or taken.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import TYPE_CHECKING

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from planner.fleet.fleet import Charger, Pack
    from planner.vehicle.battery import Battery

_FULL = 1.0 - 1e-9


class Charge(Value):
    """One pack on a charger."""

    pack: str
    charger: str
    start_s: float
    end_s: float
    """When it is full or taken. [s]"""
    begin: float
    """State of charge. [-]"""
    end: float


class _Socket:
    """A place of a charger, and what is on it."""

    def __init__(self, charger: Charger) -> None:
        self.charger = charger
        self.free_s = 0.0


class PackDay:
    """The packs of a fleet over its operation; asked in the order of time.

    Parameters
    ----------
    packs : mapping
        By name.
    batteries : callable
        The battery of a pack; ``None`` where it is not known.
    chargers : sequence
        Those that may charge in the temperature there is.
    needs_s : mapping
        When each pack is taken, rising. [s]
    """

    def __init__(
        self,
        packs: Mapping[str, Pack],
        batteries: Callable[[Pack], Battery | None],
        chargers: Sequence[Charger],
        needs_s: Mapping[str, Sequence[float]],
    ) -> None:
        self._packs = packs
        self._batteries = batteries
        self._needs_s = needs_s
        self._sockets = [_Socket(one) for one in chargers for _ in range(one.count)]
        self._waiting: dict[str, tuple[float, float]] = {}
        """Since when each pack waits for a charger, and its charge. [s], [-]"""
        self._charging: dict[str, tuple[Charge, _Socket]] = {}
        self._charge: dict[str, float] = {}
        self.charges: list[Charge] = []

    def put_down(self, pack: str, at_s: float, charge: float) -> None:
        """Take note that a pack has come from a vehicle, or is there at the beginning."""
        self._charge[pack] = charge
        if charge < _FULL:
            self._waiting[pack] = (at_s, charge)

    def take(self, pack: str, at_s: float) -> float:
        """Return how full a pack is when it is taken. [-]"""
        self._advance(at_s)
        self._waiting.pop(pack, None)
        found = self._charging.pop(pack, None)
        if found is None:
            return self._charge[pack]
        charge, socket = found
        battery = self._batteries(self._packs[pack])
        full = charge.end
        if charge.end_s > at_s and battery is not None:
            full = socket.charger.charge_after(battery, charge.begin, at_s - charge.start_s)
            socket.free_s = at_s
        self.charges.append(
            Charge(
                pack=pack,
                charger=charge.charger,
                start_s=charge.start_s,
                end_s=min(charge.end_s, at_s),
                begin=charge.begin,
                end=full,
            )
        )
        self._charge[pack] = full
        return full

    def finish(self) -> tuple[Charge, ...]:
        """Return every charge of the operation, in the order of time; those begun are finished."""
        self._advance(math.inf)
        self.charges += [charge for charge, _ in self._charging.values()]
        self._charging.clear()
        return tuple(sorted(self.charges, key=lambda one: (one.start_s, one.charger, one.pack)))

    def full_s(self, pack: str) -> float | None:
        """Return when a pack that charges is full; ``None``: it does not charge. [s]"""
        found = self._charging.get(pack)
        return None if found is None else found[0].end_s

    def _advance(self, until_s: float) -> None:
        """Put packs on chargers as they become free, up to a time."""
        while (chosen := self._next(until_s)) is not None:
            at_s, pack, socket = chosen
            begin = self._waiting.pop(pack)[1]
            battery = self._batteries(self._packs[pack])
            assert battery is not None  # others find no socket
            end_s = at_s + socket.charger.charge_time_s(battery, begin)
            charge = Charge(
                pack=pack,
                charger=socket.charger.name,
                start_s=at_s,
                end_s=end_s,
                begin=begin,
                end=1.0,
            )
            socket.free_s = end_s
            self._charging[pack] = (charge, socket)

    def _next(self, until_s: float) -> tuple[float, str, _Socket] | None:
        """Return the next pack that finds a charger before a time: when, which, where."""
        found = []
        for pack, (since_s, _) in self._waiting.items():
            if self._batteries(self._packs[pack]) is None:
                continue
            for number, socket in enumerate(self._sockets):
                at_s = max(since_s, socket.free_s)
                if at_s < until_s and socket.charger.charges(self._packs[pack]):
                    found.append((at_s, self._needed_s(pack, at_s), since_s, pack, number))
        if not found:
            return None
        at_s, _, _, pack, number = min(found)
        return at_s, pack, self._sockets[number]

    def _needed_s(self, pack: str, at_s: float) -> float:
        needs_s = self._needs_s.get(pack, ())
        place = bisect_left(needs_s, at_s)
        return needs_s[place] if place < len(needs_s) else math.inf
