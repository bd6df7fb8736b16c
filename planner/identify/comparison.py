"""A recorded flight against its prediction: energy, states and stops, by one ruler for both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.state import STATES, FlightState
from planner.identify.states import find_states
from planner.identify.stops import find_stops
from planner.units import wh_from_j

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.identify.states import StateSegment
    from planner.identify.stops import Stop
    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

_VERTICAL = frozenset(
    (FlightState.TAKEOFF, FlightState.CLIMB, FlightState.DESCEND, FlightState.LAND)
)
_STEADY = frozenset((FlightState.HOVER, FlightState.CRUISE))


@dataclass(frozen=True, slots=True, kw_only=True)
class StateComparison:
    """Everything flown in one state, against everything predicted in it."""

    state: FlightState
    count: int
    """Stretches flown in it."""
    predicted_count: int
    time_s: float
    predicted_time_s: float
    energy_wh: float | None
    predicted_energy_wh: float | None
    fit_percent: float | None
    """Of ``fit_of``, each item's flight laid on the moment it began; of a steady state, where there
    is no change to describe, relative to the value itself. [%]"""
    fit_of: str | None
    """Column of the record that is fitted: height, speed, or power in hover."""

    @property
    def energy_fraction(self) -> float | None:
        """Predicted energy over flown energy, less one. [-]"""
        if not self.energy_wh or self.predicted_energy_wh is None:
            return None
        return self.predicted_energy_wh / self.energy_wh - 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class StopComparison:
    """A stop flown, and the one predicted for it."""

    item: int
    start_s: float
    speed_m_s: float
    measured_m: float
    predicted_m: float | None
    """``None`` where none is predicted at this item."""
    predicted_speed_m_s: float | None


def energy_wh(record: FlightRecord, part: slice = slice(None)) -> float | None:
    """Return the energy of part of a record: trapezoids over the power that is known. [Wh]"""
    power_w, time_s = record.power_w[part], record.time_s[part]
    known = np.isfinite(power_w)
    if known.sum() < 2:
        return None
    return wh_from_j(float(np.trapezoid(power_w[known], time_s[known])))


def track_length_m(record: FlightRecord) -> float | None:
    """Return the horizontal length of the track, ``None`` where no position is known. [m]"""
    known = np.isfinite(record.north_m) & np.isfinite(record.east_m)
    if known.sum() < 2:
        return None
    north, east = np.diff(record.north_m[known]), np.diff(record.east_m[known])
    return float(np.hypot(north, east).sum())


def predicted_times_s(flown: FlightRecord, predicted: FlightRecord) -> FloatArray:
    """Return the time of the prediction that each sample of a flight is compared with.

    Each item's flight is laid on the moment it was begun, so that a second lost early is not counted
    again ever after; where an item took longer than predicted, its end is held.

    Parameters
    ----------
    flown, predicted : FlightRecord
        The flight and its prediction.

    Returns
    -------
    ndarray, shape (n,)
        Not falling within an item. [s]
    """
    begun, foreseen = _items_begun(flown), _items_begun(predicted)
    anchors = [(0.0, 0.0)]
    for key, at_s in begun.items():
        if key in foreseen and at_s > anchors[-1][0] and foreseen[key] > anchors[-1][1]:
            anchors.append((at_s, foreseen[key]))
    starts, origins = (np.array(column) for column in zip(*anchors, strict=True))
    ends = np.append(origins[1:], predicted.time_s[-1])
    leg = np.searchsorted(starts, flown.time_s, side="right") - 1
    own_s: FloatArray = np.minimum(origins[leg] + flown.time_s - starts[leg], ends[leg])
    return own_s


def _items_begun(record: FlightRecord) -> dict[tuple[int, int], float]:
    """Return when each item was begun, by its number and how often it had been."""
    items = record.mission_item
    changes = np.flatnonzero(np.diff(items, prepend=0))
    begun: dict[tuple[int, int], float] = {}
    times: dict[int, int] = {}
    for at in changes.tolist():
        number = int(items[at])
        if number:
            times[number] = times.get(number, 0) + 1
            begun[number, times[number]] = float(record.time_s[at])
    return begun


def compare_states(flown: FlightRecord, predicted: FlightRecord) -> tuple[StateComparison, ...]:
    """Return a row for every state that was flown or predicted, in the order of the states."""
    segments, foreseen = find_states(flown), find_states(predicted)
    at_s = predicted_times_s(flown, predicted)
    rows = []
    for state in STATES:
        own = [segment for segment in segments if segment.state is state]
        other = [segment for segment in foreseen if segment.state is state]
        if own or other:
            fit, fit_of = _fit(state, own, flown, predicted, at_s)
            rows.append(
                StateComparison(
                    state=state,
                    count=len(own),
                    predicted_count=len(other),
                    time_s=sum(segment.duration_s for segment in own),
                    predicted_time_s=sum(segment.duration_s for segment in other),
                    energy_wh=_sum_wh(flown, own),
                    predicted_energy_wh=_sum_wh(predicted, other),
                    fit_percent=fit,
                    fit_of=fit_of,
                )
            )
    return tuple(rows)


def _sum_wh(record: FlightRecord, segments: Sequence[StateSegment]) -> float | None:
    """Return the energy of stretches, each up to the first sample of what follows."""
    if not np.isfinite(record.power_w).any():
        return None
    parts = (
        energy_wh(record, slice(segment.first, segment.end + 1)) or 0.0 for segment in segments
    )
    return sum(parts)


def _fit(
    state: FlightState,
    segments: Sequence[StateSegment],
    flown: FlightRecord,
    predicted: FlightRecord,
    at_s: FloatArray,
) -> tuple[float | None, str | None]:
    """Return the fit over all stretches of a state, each about its own mean, and its column."""
    column = "ground_speed_m_s"
    if state in _VERTICAL:
        column = "height_above_home_m"
    elif state is FlightState.HOVER:
        column = "power_w"
    error, spread = 0.0, 0.0
    for segment in segments:
        measured = getattr(flown, column)[segment.samples]
        told = np.interp(at_s[segment.samples], predicted.time_s, getattr(predicted, column))
        known = np.isfinite(measured) & np.isfinite(told)
        measured, told = measured[known], told[known]
        if measured.size:
            level = 0.0 if state in _STEADY else measured.mean()
            error += float(np.sum((measured - told) ** 2))
            spread += float(np.sum((measured - level) ** 2))
    if spread == 0.0:
        return None, None
    return 100.0 * (1.0 - float(np.sqrt(error / spread))), column


def compare_stops(flown: FlightRecord, predicted: FlightRecord) -> tuple[StopComparison, ...]:
    """Return the stops flown, each with the one predicted at the same item, in order."""
    stops, foreseen = find_stops(flown), list(find_stops(predicted))
    is_in_order = len(stops) == len(foreseen)
    rows = []
    for stop in stops:
        told = _counterpart(stop, foreseen, is_in_order=is_in_order)
        if told is not None:
            foreseen.remove(told)
        rows.append(
            StopComparison(
                item=stop.item,
                start_s=stop.start_s,
                speed_m_s=stop.speed_m_s,
                measured_m=stop.distance_m,
                predicted_m=None if told is None else told.distance_m,
                predicted_speed_m_s=None if told is None else told.speed_m_s,
            )
        )
    return tuple(rows)


def _counterpart(stop: Stop, foreseen: Sequence[Stop], *, is_in_order: bool) -> Stop | None:
    """Return the first predicted stop at the item of one flown; by order where items are unknown."""
    if is_in_order and foreseen:
        return foreseen[0]
    return next((told for told in foreseen if told.item == stop.item and stop.item), None)


def rms_difference(
    flown: FlightRecord, predicted: FlightRecord, column: str, at_s: FloatArray
) -> float | None:
    """Return the root mean square difference of a column in the air. [unit of the column]"""
    measured = getattr(flown, column)
    told = np.interp(at_s, predicted.time_s, getattr(predicted, column))
    known = np.isfinite(measured) & np.isfinite(told) & ~flown.is_landed
    if not known.any():
        return None
    return float(np.sqrt(np.mean((measured[known] - told[known]) ** 2)))
