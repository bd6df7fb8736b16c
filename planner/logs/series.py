"""Series: one quantity as a log has it, samples at their own times; and the clock of a log."""

from __future__ import annotations

import itertools
from array import array
from typing import TYPE_CHECKING, Self

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.logs.record import STEP_S
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding


LEAST_GAP_S = 1.0
"""A silence shorter than this is bridged by a straight line, whatever the rate. [s]"""
GAP_INTERVALS = 3.0
"""Nor is a silence a gap before it is this many times the usual time between samples. [-]"""


class Series(Value, eq=False):
    """Samples of one quantity, finite and in the order of time."""

    time_s: FloatArray
    """On the log's own clock, rising. [s]"""
    values: FloatArray
    """In the unit of the column it becomes."""
    found_in: str
    """Message and fields of the log."""
    period: float | None = None
    """360 for angles, which are interpolated the short way round."""
    is_event: bool = False
    """Whether a value holds until the next one, instead of moving there on a straight line."""

    @classmethod
    def of(
        cls,
        time_s: npt.ArrayLike,
        values: npt.ArrayLike,
        found_in: str,
        *,
        period: float | None = None,
        is_event: bool = False,
    ) -> Self:
        """Return a series of what is finite of the samples, sorted, the last of equal times kept."""
        times, samples = np.asarray(time_s, np.float64), np.asarray(values, np.float64)
        known = np.isfinite(times) & np.isfinite(samples)
        times, samples = times[known], samples[known]
        order = np.argsort(times, kind="stable")
        times, samples = times[order], samples[order]
        last = np.append(times[1:] > times[:-1], [True])[: len(times)]
        return cls(
            time_s=times[last],
            values=samples[last],
            found_in=found_in,
            period=period,
            is_event=is_event,
        )

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def interval_s(self) -> float | None:
        """Usual time between samples; ``None`` where there are not two."""
        return float(np.median(np.diff(self.time_s))) if len(self) > 1 else None

    @property
    def rate_hz(self) -> float | None:
        """Usual rate of the samples; ``None`` for events, and where there are not two samples."""
        return None if self.is_event or self.interval_s is None else 1.0 / self.interval_s

    def between(self, begin_s: float, end_s: float) -> Self:
        """Return the samples from one time to another, both included."""
        chosen = slice(
            np.searchsorted(self.time_s, begin_s), np.searchsorted(self.time_s, end_s, "right")
        )
        return replace(self, time_s=self.time_s[chosen], values=self.values[chosen])

    def at(self, time_s: FloatArray) -> FloatArray:
        """Return the values at other times, NaN where there are no samples.

        Events hold until the next.  Everything else moves on straight lines between neighbours,
        but not across a gap: a silence of more than :data:`GAP_INTERVALS` usual intervals and of
        more than :data:`LEAST_GAP_S`.  A value before the first or after the last sample is
        theirs for the usual interval.
        """
        if not len(self):
            return np.full(time_s.shape, np.nan)
        if self.is_event:
            before = np.searchsorted(self.time_s, time_s, side="right") - 1
            return np.where(before >= 0, self.values[np.maximum(before, 0)], np.nan)
        usual_s = self.interval_s or 0.0
        path = self.values if self.period is None else np.unwrap(self.values, period=self.period)
        values = np.interp(time_s, self.time_s, path)
        after = np.searchsorted(self.time_s, time_s, side="left")
        before = np.searchsorted(self.time_s, time_s, side="right") - 1
        last = len(self) - 1
        silence_s = self.time_s[np.minimum(after, last)] - self.time_s[np.maximum(before, 0)]
        is_unknown = silence_s > max(LEAST_GAP_S, GAP_INTERVALS * usual_s)
        is_unknown |= time_s < self.time_s[0] - usual_s
        is_unknown |= time_s > self.time_s[-1] + usual_s
        return np.where(is_unknown, np.nan, values)

    def mean_at(self, time_s: FloatArray) -> FloatArray:
        """Return the mean around each of even times, so that the integral of a fast signal is kept.

        Where the log has fewer than two samples a step, this is :meth:`at`.

        Parameters
        ----------
        time_s : ndarray
            Times on the log's clock, :data:`~planner.logs.record.STEP_S` apart. [s]
        """
        values = self.at(time_s)
        if self.interval_s is None or self.interval_s > STEP_S / 2.0 or not len(time_s):
            return values
        cell = np.floor((self.time_s - time_s[0]) / STEP_S + 0.5)
        inside = (cell >= 0) & (cell < len(time_s))
        cells = cell[inside].astype(np.int64)
        counts = np.bincount(cells, minlength=len(time_s))
        sums = np.bincount(cells, weights=self.values[inside], minlength=len(time_s))
        filled = counts > 0
        values[filled] = sums[filled] / counts[filled]
        return values


class MessageTable(Value, eq=False):
    """All messages of one kind, as columns of the fields used."""

    places: IntArray
    """Where in the log, rising: byte or line."""
    numbers: Mapping[str, FloatArray]
    """NaN where a message lacks the field."""
    texts: Mapping[str, tuple[str, ...]]

    def rows(self, chosen: BoolArray) -> Self:
        """Return some of the messages."""
        return replace(
            self,
            places=self.places[chosen],
            numbers={name: values[chosen] for name, values in self.numbers.items()},
            texts={
                name: tuple(text for text, is_in in zip(texts, chosen, strict=True) if is_in)
                for name, texts in self.texts.items()
            },
        )


class MessageColumns:
    """The messages of one kind read so far."""

    def __init__(self, numbers: Iterable[str], texts: Iterable[str]) -> None:
        self.places = array("q")
        self.numbers = {name: array("d") for name in numbers}
        self.texts: dict[str, list[str]] = {name: [] for name in texts}

    def table(self) -> MessageTable:
        """Return them as a table."""
        return MessageTable(
            places=np.array(self.places, np.int64),
            numbers={name: np.array(values, np.float64) for name, values in self.numbers.items()},
            texts={name: tuple(texts) for name, texts in self.texts.items()},
        )


_BACK_S = 1.0
"""Messages are written in the order of time but for less than this. [s]"""
_MOST_STRAYS = 5
"""So many messages in a row may be out of time; more of them are another run of the clock."""


LOG_CLOCK = Rule(
    "R103 log-clock",
    Severity.WARNING,
    summary="The clock of a log goes backwards.",
    why="Times before and after cannot be compared: speeds and energies over the jump are wrong.",
    how="A message is more than 1 s older than the one before.  Where the clock continues from there "
    "the log is cut in two; single messages out of time are left out.",
    fix="nothing, if the autopilot was restarted; else mistrust the log",
)


class Clock(Value, eq=False):
    """Places and times of the timed messages of a log, strays left out."""

    places: IntArray
    """Where in the log, rising: byte, line or number of the message."""
    time_s: FloatArray
    restarts: tuple[int, ...]
    """Places at which the clock restarts."""
    strays: int
    """Messages out of time, left out."""

    @classmethod
    def of(cls, places: IntArray, time_s: FloatArray) -> Self:
        """Return the clock that timed messages show.

        A few messages that are more than a second ahead of those after them, or after those before
        them, are strays; where there are many on both sides the clock has restarted.
        """
        order = np.argsort(places, kind="stable")
        places, time_s = places[order], time_s[order]
        kept = np.isfinite(time_s)
        places, time_s = places[kept], time_s[kept]
        is_stray = np.zeros(time_s.shape, np.bool_)
        restarts: list[int] = []
        for drop in np.flatnonzero(np.diff(time_s) < -_BACK_S).tolist():
            ahead = time_s[max(drop - _MOST_STRAYS, 0) : drop + 1] > time_s[drop + 1] + _BACK_S
            after = time_s[drop + 1 : drop + 2 + _MOST_STRAYS] < time_s[drop] - _BACK_S
            if not np.all(ahead):
                is_stray[drop - int(np.argmin(ahead[::-1])) + 1 : drop + 1] = True
            elif not np.all(after) or len(after) <= _MOST_STRAYS:
                count = int(np.argmin(after)) if not np.all(after) else len(after)
                is_stray[drop + 1 : drop + 1 + count] = True
            else:
                restarts.append(int(places[drop + 1]))
        return cls(
            places=places[~is_stray],
            time_s=time_s[~is_stray],
            restarts=tuple(restarts),
            strays=int(np.sum(is_stray)),
        )

    def runs(self) -> Iterator[tuple[int, int]]:
        """Return first place and place after the last of each run, all places in one of them."""
        yield from itertools.pairwise((0, *self.restarts, np.iinfo(np.int64).max))

    def is_in_time(self, places: IntArray) -> BoolArray:
        """Return which of timed messages are no strays."""
        return np.isin(places, self.places)

    def time_at_s(self, places: IntArray) -> FloatArray:
        """Return the time of the last timed message before each place; the first one's before it."""
        before = np.searchsorted(self.places, places, side="right") - 1
        return self.time_s[np.maximum(before, 0)]

    def findings(self, source: str) -> Iterator[Finding]:
        """Return what is odd about the clock."""
        if self.restarts:
            first = np.searchsorted(self.places, self.restarts[0]) - 1
            yield LOG_CLOCK.finding(
                f"{source}: the clock restarts after {self.time_s[first]:.1f} s: the log is read as "
                f"{len(self.restarts) + 1} recordings"
            )
        if self.strays:
            yield LOG_CLOCK.finding(
                f"{source}: out of time and left out: {quantity.count(self.strays, 'message')}"
            )


def items_flown(
    reported_s: FloatArray,
    items: FloatArray,
    modes: tuple[tuple[float, str], ...],
    mission_mode: str,
    found_in: str,
) -> Series:
    """Return the items flown, from those current: an item stays current in other modes too.

    Returns
    -------
    Series
        Events; 0 outside the mission mode.
    """
    current = Series.of(reported_s, items, found_in, is_event=True)
    entered_s = np.array([time_s for time_s, _ in modes])
    is_mission = np.array([False, *(name == mission_mode for _, name in modes)])
    times = np.union1d(reported_s, entered_s)
    is_flown = is_mission[np.searchsorted(entered_s, times, side="right")]
    flown = np.where(is_flown, np.nan_to_num(current.at(times), nan=0.0), 0.0)
    return Series.of(times, flown, found_in, is_event=True)


NO_CURRENT_A = 0.2
"""No multirotor flies on less; a sensor that never shows more is none. [A]"""
_NO_VOLTAGE_V = 0.5
"""A monitor that never shows more is not connected. [V]"""


def electrical_series(
    time_s: FloatArray,
    voltage_v: FloatArray | None,
    current_a: FloatArray | None,
    *,
    message: str,
    fields: tuple[str, str],
) -> tuple[dict[str, Series], dict[str, str]]:
    """Return voltage, current and power of one battery message, and what is wrong with them.

    Parameters
    ----------
    voltage_v, current_a : ndarray, optional
        Voltage and current of each, NaN where not known; ``None`` where the message has none.
    message : str
        Its name; empty for columns of a file.
    fields : tuple of str
        Names of its fields for voltage and current.

    Returns
    -------
    series : dict
        ``voltage_v``, ``current_a`` and ``power_w``, as far as a sensor is there.
    remarks : dict
        Sentences by the same names, where none is.
    """
    of_voltage, of_current = (f"{message}.{field}" if message else field for field in fields)
    series: dict[str, Series] = {}
    remarks: dict[str, str] = {}
    if voltage_v is not None:
        # A monitor that has measured nothing yet shows zero.
        voltage_v = np.where(voltage_v > _NO_VOLTAGE_V, voltage_v, np.nan)
        if np.isfinite(voltage_v).any():
            series["voltage_v"] = Series.of(time_s, voltage_v, of_voltage)
        else:
            remarks["voltage_v"] = (
                f"{of_voltage} never exceeds {_NO_VOLTAGE_V:g} V: no voltage sensor"
            )
    if current_a is not None:
        if np.any(current_a > NO_CURRENT_A):
            series["current_a"] = Series.of(time_s, current_a, of_current)
        else:
            remarks["current_a"] = (
                f"{of_current} never exceeds {NO_CURRENT_A:g} A: no current sensor"
            )
    if voltage_v is not None and current_a is not None and len(series) == 2:
        power = Series.of(time_s, voltage_v * current_a, f"{of_voltage} × {fields[1]}")
        if len(power):
            series["power_w"] = power
    return series, remarks


def euler_angles_deg(
    w: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return roll, pitch and yaw of a rotation from the body to its frame of reference.

    The order of rotation is yaw, pitch, roll, about axes forward, right, down in a frame north,
    east, down (Diebel, "Representing Attitude", 2006, section 8.2).

    Parameters
    ----------
    w, x, y, z : ndarray
        Unit quaternions, scalar first.

    Returns
    -------
    roll_deg, pitch_deg, yaw_deg : ndarray
        Roll and yaw in [−180, 180], pitch in [−90, 90]. [°]
    """
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.degrees(roll), np.degrees(pitch), np.degrees(yaw)
