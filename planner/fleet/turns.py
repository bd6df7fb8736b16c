"""A first schedule of a fleet: each sortie in turn is flown as it ends first, beside those before it.

On the pack that is full first, which the charger then takes that has it full again first.  It is a place for
the solver to begin: with dozens of sorties on few packs it finds nothing nearly as good by itself.
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import TYPE_CHECKING

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.fleet.schedule import Conflicts, Means, Option, Task

MS = 1000
_EVER = 10**15
"""Some 30,000 years. [ms]"""


class Turn(Value):
    """How one sortie is flown, in whole milliseconds."""

    way: int
    """Place of its option."""
    start: int
    end: int
    packs: str | None = None
    """``None``: on a pack of its own."""
    on: int = 0
    """When its pack is put on a charger."""
    full: int = 0
    """When that is full again."""


class FirstSchedule(Value):
    """The first schedule."""

    of_tasks: Mapping[int, Turn]
    first: Mapping[str, Sequence[tuple[int, int]]]
    """When each used pack of a group that is not full at the beginning is put on a charger, and full."""
    packs: Mapping[str, int]
    """How many packs of each group are used."""


def ms(time_s: float) -> int:
    """Return a time in whole milliseconds, rounded up."""
    return math.ceil(time_s * MS - 1e-6)


def closed_ms(begin_s: float, end_s: float) -> tuple[int, int]:
    """Return an open interval in whole milliseconds, rounded to where it is wider."""
    low = -_EVER if begin_s == -math.inf else math.floor(begin_s * MS)
    return low, _EVER if end_s == math.inf else math.ceil(end_s * MS)


def first_turns(
    tasks: Sequence[Task], means: Means, conflicts: Conflicts, *, most_vehicles: int | None
) -> FirstSchedule | None:
    """Return the first schedule; ``None`` where a sortie has no turn in its hours.

    Those of higher priority come first, then those that have to be back first.
    """
    field = _Standing(tasks, means, conflicts, most_vehicles)
    order = sorted(range(len(tasks)), key=lambda one: (-tasks[one].priority, tasks[one].latest_s))
    if not all(map(field.flies, order)):
        return None
    return FirstSchedule(
        of_tasks=field.turns,
        first=field.first,
        packs={name: len(used) for name, used in field.used.items()},
    )


class _Standing:
    """Who and what is where, as sorties are given their turns."""

    def __init__(
        self, tasks: Sequence[Task], means: Means, conflicts: Conflicts, most_vehicles: int | None
    ) -> None:
        self._tasks = tasks
        self._means = means
        self._most_vehicles = len(means.vehicles) if most_vehicles is None else most_vehicles
        self.turns: dict[int, Turn] = {}
        self.first: dict[str, list[tuple[int, int]]] = defaultdict(list)
        self.used: dict[str, set[int]] = defaultdict(set)
        self._flown: dict[str, list[tuple[int, int]]] = defaultdict(list)
        self._free = {name: [0] * count for name, count in means.chargers.items()}
        self._full: dict[str, list[int]] = {}
        for name, group in means.packs.items():
            charged = [self._charged(group.charge_first_s, 0) for _ in range(group.count)]
            self._full[name] = [full for _, full in charged]
            if group.charge_first_s:
                self.first[name] = charged
        self._closed: dict[tuple[int, int], list[tuple[tuple[int, int], int, int]]] = defaultdict(
            list
        )
        for (one, two), closed in conflicts.items():
            for low, high in (closed_ms(*each) for each in closed):
                self._closed[two].append((one, low, high))
                self._closed[one].append((two, -high, -low))

    def flies(self, place: int) -> bool:
        """Give a task its turn; ``False``: it has none."""
        task, swap = self._tasks[place], ms(self._means.swap_s)
        latest_s = min(task.latest_s, self._means.latest_s)
        found: list[tuple[int, int, int, str | None]] = []
        for way, option in enumerate(task.options):
            if option.vehicle not in self._flown and len(self._flown) >= self._most_vehicles:
                continue
            until_s = min(latest_s, self._means.vehicles[option.vehicle][1])
            groups: list[str | None] = [use.packs for use in option.packs]
            for packs in groups or [None]:
                ready = 0 if packs is None else min(self._full[packs])
                start = self._start(place, way, option, ready)
                end = start + ms(option.duration_s)
                if end <= min(until_s * MS, _EVER - 1):
                    found.append((end, start, way, packs))
        if not found:
            return False
        end, start, way, packs = min(found, key=lambda one: one[:3])
        option = task.options[way]
        self._flown[option.vehicle].append((start, end + swap))
        on = full = 0
        if packs is not None:
            number = self._full[packs].index(min(self._full[packs]))
            self.used[packs].add(number)
            use = next(one for one in option.packs if one.packs == packs)
            on, full = self._charged(use.charge_s, end + swap, is_put_on=True)
            self._full[packs][number] = full
        self.turns[place] = Turn(way=way, start=start, end=end, packs=packs, on=on, full=full)
        return True

    def _start(self, place: int, way: int, option: Option, ready: int) -> int:
        """Return when a task can first be flown one way. [ms]"""
        lasts, swap = ms(option.duration_s), ms(self._means.swap_s)
        flown = self._flown.get(option.vehicle, ())
        closed = [(low - lasts - swap, high) for low, high in flown]
        for (other, other_way), low, high in self._closed[place, way]:
            turn = self.turns.get(other)
            if turn is not None and turn.way == other_way:
                closed.append((turn.start + low, turn.start + high))
        from_s = self._means.vehicles[option.vehicle][0]
        start = max(math.ceil(max(self._tasks[place].earliest_s, from_s) * MS), ready)
        for low, high in sorted(closed):
            start = high if low < start < high else start
        return start

    def _charged(
        self, charge_s: Mapping[str, float], ready: int, *, is_put_on: bool = False
    ) -> tuple[int, int]:
        """Return when a pack is put on the charger that has it full first, and full. [ms]"""
        if not charge_s:
            return ready, _EVER if is_put_on else ready
        full, on, name = min(
            (
                max(ready, min(self._free[name])) + ms(time_s),
                max(ready, min(self._free[name])),
                name,
            )
            for name, time_s in charge_s.items()
        )
        places = self._free[name]
        places[places.index(min(places))] = full
        return on, full
