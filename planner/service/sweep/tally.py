"""What a sweep comes to: shares of GO, limits, and what moves the margin, counted batch by batch.

Nothing grows with the number of cases: counts are kept for each value of each axis and each pair of them.
A calm counts for every direction.
"""

from __future__ import annotations

import datetime as dt
import re
from collections import Counter
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.service.sweep.axes import GUST_M_S, WIND_FROM_DEG, WIND_M_S, number_of
from planner.service.sweep.table import CaseTable, case_places
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.service.sweep.axes import Axis
    from planner.service.sweep.batches import Batch
    from planner.service.sweep.cases import Cases

_MOST_VALUES = 24
"""Values of an axis that are counted one by one; more are put into classes."""
_CLASSES = 10
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Widths of classes, times a power of ten."""
_DIRECTIONS_DEG = 45.0
MONTH, HOUR = "month", "hour"
"""Axes made of the times of measured weather."""
_EVERY = -1
"""Place of a value that stands for every one of its axis."""
_GO, _ALL, _UNCHECKED = 0, 1, 2
LONGEST = 8
"""Characters of a number that is shown as it is."""
_DECIMALS = re.compile(r"\d+\.\d+")


class AxisScale(Value, eq=False):
    """The values of an axis as they are counted: each by itself, or in classes."""

    key: str
    """Of the column."""
    labels: tuple[str, ...]
    """Of its values or classes, in order."""
    numbers: tuple[float, ...] | None
    """Each value, or the upper end of each class; ``None``: they have no order."""
    is_classed: bool = False


class Limit(Value):
    """How far an axis goes with a go: in every case of what else varies, and in the best."""

    key: str
    """What is limited."""
    within: tuple[str, str] | None
    """Key and label of the value of another axis it holds for; ``None``: for all."""
    every: float | None
    """The last value, up or down, with every case a go; ``None``: not even the first."""
    best: float | None
    """The last with any case a go."""
    first: float | None
    """The first of the axis; ``None``: values are in classes."""
    last: float
    """The last of the axis: the vehicle may go farther."""
    is_upper: bool
    """Whether more is worse."""


class Swing(Value):
    """What the mean margin is at the worst and the best value of an axis."""

    key: str
    worst: str
    worst_wh: float
    best: str
    best_wh: float

    @property
    def width_wh(self) -> float:
        """How far the axis moves the margin. [Wh]"""
        return self.best_wh - self.worst_wh


class Tally:
    """The counts of a sweep."""

    def __init__(self, cases: Cases) -> None:
        self.cases = cases
        self.scales: list[AxisScale] = []
        self._place: list[tuple[int, IntArray]] = []
        for number, block in enumerate(cases.blocks):
            for column, axis in enumerate(block.axes):
                scale, place = _scale(axis, [point[column] for point in block.points])
                self.scales.append(scale)
                self._place.append((number, place))
        self._table = CaseTable(cases=cases)
        self._timed = next(
            (n for n, block in enumerate(cases.blocks) if block.times is not None), None
        )
        self._instants = self._time_scales()
        self.counts = np.zeros(3, dtype=np.int64)
        self.counts[[_ALL, _UNCHECKED]] = sum(1 for _ in self._table.rows_without_weather())
        """Rows that are a go, all, and those not checked."""
        self.checks = self.flights = self.case_count = 0
        self.breaks: Counter[str] = Counter()
        """What breaks first, by its code, in rows that are no go."""
        sizes = [len(scale.labels) for scale in self.scales]
        self._pairs = {
            (i, j): np.zeros((3, sizes[i], sizes[j]), dtype=np.int64)
            for i, j in combinations(range(len(sizes)), 2)
        }
        self._single = [np.zeros((3, size), dtype=np.int64) for size in sizes]
        self._margin_wh = [np.zeros((2, size)) for size in sizes]

    def add(self, batch: Batch) -> None:
        """Count the cases of a batch."""
        self.checks += batch.checks
        self.flights += batch.flights
        self.case_count += len(batch.outcomes)
        places = case_places(self.cases, batch.first, len(batch.outcomes))
        row = np.arange(len(batch.outcomes))
        instants: list[IntArray] = []
        if self._timed is not None:
            of_point = places[:, self._timed]
            times = self.cases.blocks[self._timed].times or ()
            repeats = [len(times[point]) for point in of_point]
            row = np.repeat(row, repeats)
            instants = [
                np.concatenate([one[point] for point in of_point]) for one in self._instants
            ]
        verdicts = [batch.outcomes[at].verdict for at in row]
        known = np.array(
            [
                [verdict == "go" for verdict in verdicts],
                [True] * len(verdicts),
                [verdict is None for verdict in verdicts],
            ]
        ).astype(np.int64)
        self.counts += known.sum(axis=1)
        self.breaks.update(
            batch.outcomes[at].breaks_first for at in row if batch.outcomes[at].breaks_first
        )
        margins = [batch.outcomes[at].least_margin_wh for at in row]
        margin_wh = np.array([np.nan if one is None else one for one in margins])
        at = [place[places[row, number]] for number, place in self._place] + instants
        for i, own in enumerate(at):
            _count(self._single[i], known, own)
            _add_margins(self._margin_wh[i], margin_wh, own)
        for (i, j), counts in self._pairs.items():
            _count_pairs(counts, known, at[i], at[j])

    @property
    def knows_times(self) -> bool:
        """Whether what was measured is counted by month and hour."""
        return bool(self._instants)

    @property
    def go_share(self) -> float | None:
        """Rows that are a go, of those that were checked."""
        checked = int(self.counts[_ALL] - self.counts[_UNCHECKED])
        return int(self.counts[_GO]) / checked if checked else None

    def shares(self, key: str) -> Iterator[tuple[str, int, int]]:
        """Yield each value of an axis with its rows that are a go, and those that were checked."""
        at = self._position(key)
        go, every, unchecked = self._single[at]
        for label, one, all_, none in zip(
            self.scales[at].labels, go, every, unchecked, strict=True
        ):
            yield label, int(one), int(all_ - none)

    def share_map(self, across: str, up: str) -> FloatArray:
        """Return the share of go over two axes; NaN where nothing was checked. (up, across)"""
        i, j = self._position(across), self._position(up)
        go, every, unchecked = self._pairs[min(i, j), max(i, j)].astype(np.float64)
        checked = every - unchecked
        with np.errstate(invalid="ignore"):
            share = np.where(checked > 0, go / checked, np.nan)
        return share.T if i < j else share

    def limits(self) -> Iterator[Limit]:
        """Yield how far each axis goes alone, and winds and gusts by each direction they blow from."""
        for i, scale in enumerate(self.scales):
            if (
                scale.numbers is None
                or len(scale.labels) < 2
                or scale.key in {MONTH, HOUR, WIND_FROM_DEG.key}
            ):
                continue
            yield self._limit(scale, self._single[i], None)
            if scale.key not in {WIND_M_S.key, GUST_M_S.key}:
                continue
            for j, other in enumerate(self.scales):
                if other.key == WIND_FROM_DEG.key and i != j:
                    pairs = self._pairs[min(i, j), max(i, j)]
                    for at, label in enumerate(other.labels):
                        counts = pairs[:, :, at] if i < j else pairs[:, at, :]
                        if counts[_ALL].any():
                            yield self._limit(scale, counts, (other.key, label))

    def swings(self) -> list[Swing]:
        """Return how far each axis moves the mean margin, the farthest first."""
        found = []
        for scale, (total_wh, count) in zip(self.scales, self._margin_wh, strict=True):
            known = np.flatnonzero(count)
            if len(known) < 2:
                continue
            mean_wh = total_wh[known] / count[known]
            worst, best = int(np.argmin(mean_wh)), int(np.argmax(mean_wh))
            found.append(
                Swing(
                    key=scale.key,
                    worst=scale.labels[known[worst]],
                    worst_wh=float(mean_wh[worst]),
                    best=scale.labels[known[best]],
                    best_wh=float(mean_wh[best]),
                )
            )
        return sorted(found, key=lambda swing: -swing.width_wh)

    def _limit(self, scale: AxisScale, counts: IntArray, within: tuple[str, str] | None) -> Limit:
        assert scale.numbers is not None  # its limit is asked for
        go, every, _ = counts
        known = np.flatnonzero(every)
        share = go[known] / every[known]
        is_upper = bool(share[0] >= share[-1])
        ordered = known if is_upper else known[::-1]
        numbers = scale.numbers

        def reached(is_go: BoolArray) -> float | None:
            count = int(np.argmin(np.append(is_go[ordered], False)))
            return numbers[ordered[count - 1]] if count else None

        return Limit(
            key=scale.key,
            within=within,
            every=reached(go >= every),
            best=reached(go > 0),
            first=None if scale.is_classed else numbers[ordered[0]],
            last=numbers[ordered[-1]],
            is_upper=is_upper,
        )

    def _position(self, key: str) -> int:
        return next(i for i, scale in enumerate(self.scales) if scale.key == key)

    def _time_scales(self) -> tuple[list[IntArray], ...]:
        """Return the place of each time of each point on the axes of month and hour, which are added.

        Empty where one of them is no time as ISO 8601 writes it: they are in the table alone.
        """
        if self._timed is None:
            return ()
        times = self.cases.blocks[self._timed].times or ()
        read = [[_instant(time) for time in own] for own in times]
        if any(one is None for own in read for one in own):
            return ()
        found = []
        for key, form in ((MONTH, "%Y-%m"), (HOUR, "%H")):
            texts = [[one.strftime(form) for one in own if one is not None] for own in read]
            labels = sorted({text for own in texts for text in own})
            numbers = tuple(float(i) for i in range(len(labels)))
            self.scales.append(AxisScale(key=key, labels=tuple(labels), numbers=numbers))
            place = {label: i for i, label in enumerate(labels)}
            found.append([np.array([place[text] for text in own], dtype=np.intp) for own in texts])
        return tuple(found)


def _instant(text: str) -> dt.datetime | None:
    try:
        return dt.datetime.fromisoformat(text)
    except ValueError:
        return None


def _scale(axis: Axis, values: Sequence[object]) -> tuple[AxisScale, IntArray]:
    """Return how an axis is counted, and the place of the value of each point."""
    different = list(dict.fromkeys(value for value in values if value is not None))
    numbers = [number_of(value) for value in different]
    is_ordered = bool(different) and all(one is not None for one in numbers)
    if is_ordered:
        different.sort(key=lambda value: number_of(value) or 0.0)
    if is_ordered and len(different) > _MOST_VALUES:
        return _classed(axis, [number_of(value) for value in values])
    place = {value: i for i, value in enumerate(different)}
    labels = [axis.shown(value) for value in different]
    scale = AxisScale(
        key=axis.key,
        labels=tuple(_shortened(labels) if is_ordered else labels) or (quantity.ABSENT,),
        numbers=tuple(number_of(value) or 0.0 for value in different) if is_ordered else None,
    )
    return scale, np.array([_EVERY if v is None else place[v] for v in values], dtype=np.intp)


def _shortened(labels: Sequence[str]) -> Sequence[str]:
    """Return numbers, such as of knots in m/s, with as many decimals as tell them from each other."""
    if max(map(len, labels)) <= LONGEST:
        return labels
    for decimals in range(2, 16):
        short = [
            _DECIMALS.sub(lambda one: f"{float(one[0]):.{decimals}f}", text)  # noqa: B023 - called here
            for text in labels
        ]
        if len(set(short)) == len(labels):
            return short
    return labels


def _classed(axis: Axis, values: Sequence[float | None]) -> tuple[AxisScale, IntArray]:
    """Return many values in classes of a round width; directions in the eight of the wind rose."""
    known = np.array([np.nan if value is None else value for value in values])
    if axis.key == WIND_FROM_DEG.key:
        count = round(360.0 / _DIRECTIONS_DEG)
        place = np.round(known / _DIRECTIONS_DEG) % count
        numbers = tuple(_DIRECTIONS_DEG * i for i in range(count))
        labels = tuple(f"{one:g}" for one in numbers)
    else:
        low, high = float(np.nanmin(known)), float(np.nanmax(known))
        rough = (high - low) / _CLASSES
        power = 10.0 ** np.floor(np.log10(rough))
        width = float(next(step * power for step in _STEPS if step * power >= rough * (1.0 - 1e-9)))
        first = np.floor(low / width)
        count = max(int(np.ceil(high / width) - first), 1)
        place = np.minimum(np.floor(known / width) - first, count - 1)
        numbers = tuple(width * (first + i + 1) for i in range(count))
        labels = tuple(f"{one - width:g} to {one:g}" for one in numbers)
    at = np.where(np.isnan(place), _EVERY, np.nan_to_num(place)).astype(np.intp)
    return AxisScale(key=axis.key, labels=labels, numbers=numbers, is_classed=True), at


def _count(counts: IntArray, known: IntArray, at: IntArray) -> None:
    every = at == _EVERY
    for row, own in enumerate(known):
        counts[row] += np.bincount(at[~every], own[~every], counts.shape[1]).astype(np.int64)
        counts[row] += own[every].sum()


def _count_pairs(counts: IntArray, known: IntArray, first: IntArray, second: IntArray) -> None:
    rows, columns = counts.shape[1:]
    flat = counts.reshape(len(counts), -1)
    for i in (*range(rows),) if (first == _EVERY).any() else (None,):
        for j in (*range(columns),) if (second == _EVERY).any() else (None,):
            own = np.ones(len(first), dtype=np.bool_)
            place = np.zeros(len(first), dtype=np.intp)
            place += _placed(first, i, own) * columns
            place += _placed(second, j, own)
            for row, one in enumerate(known):
                flat[row] += np.bincount(place[own], one[own], rows * columns).astype(np.int64)


def _placed(at: IntArray, standing_for: int | None, own: BoolArray) -> IntArray:
    """Return places; where one value is asked for, of it alone and of those that stand for every one."""
    if standing_for is None:
        return at
    own &= (at == _EVERY) | (at == standing_for)
    return np.where(at == _EVERY, standing_for, at)


def _add_margins(totals: FloatArray, margin_wh: FloatArray, at: IntArray) -> None:
    known = np.isfinite(margin_wh)
    every = at == _EVERY
    single = known & ~every
    size = totals.shape[1]
    totals[0] += np.bincount(at[single], margin_wh[single], size) + margin_wh[known & every].sum()
    totals[1] += np.bincount(at[single], minlength=size) + np.count_nonzero(known & every)
