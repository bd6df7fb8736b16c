"""Flight states found in a record: the eight of the article's Figure 1, ground time left out.

Climb and descent are told by the motion, and so is horizontal flight, unless the record has the
speed reference that an autopilot shaped: that tells accelerating, cruising and braking apart without
noise.  Thresholds have a hysteresis, those of climbs grow with the wobble of the height; what is shorter
than a second belongs to what was before it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import (
    STATE_INDEX,
    STATES,
    FlightState,
)
from planner.values import Value

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.logs.record import FlightRecord


_VERTICAL_M_S = (0.15, 0.3)
_HORIZONTAL_M_S = (0.5, 1.0)
_ACCELERATION_M_S2 = (0.15, 0.3)
"""Where a motion ends, and where it begins: the hysteresis."""
_LEVEL_M_S = 1.0
"""Climb rates below it are wobble for the most part."""
_QUIET_M_S = 0.1
"""Wobble of the climb rate, a standard deviation, from which on its limits grow in proportion."""
_WIDEST = 3.0
"""Most that they grow: landings are as slow as 1 m/s. [-]"""
_SLOPE_S = 3.0
"""Window of a slope: noise of 0.3 m at 10 Hz leaves 0.06 m/s."""
_SHORTEST_S = 1.0
_GROUND_S = 3.0
"""A climb that begins this soon after the ground is a take-off, a descent that ends there a landing."""
_CONTACT_S = 10.0
"""Spinning up before a take-off and waiting for the ground to be noticed take no longer."""
_STEPPED = 0.5
"""Share of its range by which a reference that is not shaped jumps from sample to sample. [-]"""
_KNOWN = 0.9
"""Share of the flight a column must be known for. [-]"""


class StateSegment(Value):
    """A stretch of one flight state."""

    state: FlightState
    first: int
    """Its first sample in the record."""
    end: int
    """The sample after its last."""
    start_s: float
    """Time of the first sample in the record. [s]"""
    duration_s: float
    """[s]"""

    @property
    def samples(self) -> slice:
        """Its part of every column of the record."""
        return slice(self.first, self.end)


def find_states(record: FlightRecord) -> tuple[StateSegment, ...]:
    """Find the flight states of a record.

    Parameters
    ----------
    record : FlightRecord
        One flight.

    Returns
    -------
    tuple of StateSegment
        In the order flown; time on the ground, and time at which neither height nor speed is known,
        belongs to none.
    """
    step_s = float(record.time_s[1] - record.time_s[0])
    climb, speed, acceleration = _motion(record, step_s)
    flying = ~record.is_landed & np.isfinite(climb) & np.isfinite(speed)
    states = np.full(flying.size, -1, dtype=np.int64)
    states[flying] = STATE_INDEX[FlightState.HOVER]
    horizontal = _with_hysteresis(speed, _HORIZONTAL_M_S)
    states[flying & horizontal] = STATE_INDEX[FlightState.CRUISE]
    gaining = _with_hysteresis(acceleration, _ACCELERATION_M_S2)
    losing = _with_hysteresis(-acceleration, _ACCELERATION_M_S2)
    moving = flying & (horizontal | (speed > _HORIZONTAL_M_S[0]))
    states[moving & gaining] = STATE_INDEX[FlightState.ACCELERATE]
    states[moving & losing] = STATE_INDEX[FlightState.BRAKE]
    limits = _vertical_limits_m_s(climb[flying])
    states[flying & _with_hysteresis(climb, limits)] = STATE_INDEX[FlightState.CLIMB]
    states[flying & _with_hysteresis(-climb, limits)] = STATE_INDEX[FlightState.DESCEND]
    states = _without_short_runs(states, round(_SHORTEST_S / step_s))
    _join_ground_contact(states, record.is_landed, step_s)
    return _segments(record, states, step_s)


def _vertical_limits_m_s(climb_m_s: FloatArray) -> tuple[float, float]:
    """Return where a climb ends and begins: beyond what the height wobbles by in this flight."""
    level = np.abs(climb_m_s)[np.abs(climb_m_s) < _LEVEL_M_S]
    # the median absolute deviation of normal wobble is 0.6745 of its standard deviation
    wobble = float(np.median(level)) / 0.6745 if level.size else 0.0
    scale = min(max(wobble / _QUIET_M_S, 1.0), _WIDEST)
    return scale * _VERTICAL_M_S[0], scale * _VERTICAL_M_S[1]


def _motion(record: FlightRecord, step_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Climb rate, horizontal speed and the acceleration along it."""
    window = round(_SLOPE_S / step_s)
    if _share_known(record.climb_m_s, record.is_landed) >= _KNOWN:
        climb = _mean(record.climb_m_s, window)
    else:
        climb = slope_per_s(record.height_above_home_m, window, step_s)
    if _is_shaped(record.reference_speed_m_s, record.is_landed):
        speed = record.reference_speed_m_s
        acceleration = np.gradient(speed, step_s)
    else:
        measured = record.ground_speed_m_s
        if _share_known(measured, record.is_landed) < _KNOWN:
            measured = record.airspeed_m_s
        speed = _mean(measured, round(window / 3))
        acceleration = slope_per_s(measured, window, step_s)
    return climb, speed, acceleration


def _share_known(column: FloatArray, is_landed: BoolArray) -> float:
    airborne = column[~is_landed]
    return float(np.isfinite(airborne).mean()) if airborne.size else 0.0


def _is_shaped(reference: FloatArray, is_landed: BoolArray) -> bool:
    """Whether a reference is known throughout and changes gradually."""
    if _share_known(reference, is_landed) < _KNOWN:
        return False
    known = reference[np.isfinite(reference) & ~is_landed]
    height = float(np.ptp(known))
    return height > 0.0 and float(np.abs(np.diff(known)).max()) < _STEPPED * height


def slope_per_s(column: FloatArray, window: int, step_s: float) -> FloatArray:
    """Slope of a straight line through the samples around each.

    Parameters
    ----------
    column : ndarray, shape (n,)
        Samples. [unit]
    window : int
        Number of samples of the line; made odd.
    step_s : float
        Sampling step. [s]

    Returns
    -------
    ndarray, shape (n,)
        NaN where a sample is not known; towards the ends as at the last full window. [unit/s]
    """
    half = min(window // 2, (column.size - 1) // 2)
    if half < 1:
        return np.zeros(column.size)
    lags = np.arange(-half, half + 1)
    weights = lags / float(lags @ lags) / step_s
    inner = np.convolve(column, weights[::-1], mode="valid")
    return np.pad(inner, half, mode="edge")


def _mean(column: FloatArray, window: int) -> FloatArray:
    """Mean of the samples around each."""
    half = min(window // 2, (column.size - 1) // 2)
    weights = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    return np.pad(np.convolve(column, weights, mode="valid"), half, mode="edge")


def _with_hysteresis(values: FloatArray, limits: tuple[float, float]) -> BoolArray:
    """Where values are above the lower limit in a stretch that reaches the upper one."""
    low, high = limits
    above = np.nan_to_num(values, nan=-np.inf) > low
    starts, ends = run_bounds(above)
    found = np.zeros(values.size, dtype=np.bool_)
    for start, end in zip(starts, ends, strict=True):
        if above[start] and np.max(values[start:end]) > high:
            found[start:end] = True
    return found


def run_bounds(values: npt.NDArray[np.generic]) -> tuple[IntArray, IntArray]:
    """First samples, and samples after the last, of the runs of equal values."""
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    return np.concatenate([[0], changes]), np.concatenate([changes, [values.size]])


def _without_short_runs(states: IntArray, shortest: int) -> IntArray:
    """Give runs that are too short to what was before them, or after them at the start."""
    cleaned = states.copy()
    starts, ends = run_bounds(states)
    for start, end in zip(starts, ends, strict=True):
        if cleaned[start] < 0 or end - start >= shortest:
            continue
        if start > 0 and cleaned[start - 1] >= 0:
            cleaned[start:end] = cleaned[start - 1]
        elif end < states.size and states[end] >= 0:
            cleaned[start:end] = states[end]
    return cleaned


def _join_ground_contact(states: IntArray, is_landed: BoolArray, step_s: float) -> None:
    """Give the moment of spinning up to the take-off, that of touching down to the landing."""
    near, longest = round(_GROUND_S / step_s), round(_CONTACT_S / step_s)
    hover = STATE_INDEX[FlightState.HOVER]
    starts, ends = run_bounds(states)
    for start, end in zip(starts, ends, strict=True):
        if states[start] != hover or end - start > longest:
            continue
        climbs = end < states.size and states[end] == STATE_INDEX[FlightState.CLIMB]
        descended = start > 0 and states[start - 1] == STATE_INDEX[FlightState.DESCEND]
        if climbs and is_landed[max(start - near, 0) : start].any():
            states[start:end] = states[end]
        elif descended and is_landed[end : end + near].any():
            states[start:end] = states[start - 1]


def _segments(record: FlightRecord, states: IntArray, step_s: float) -> tuple[StateSegment, ...]:
    """Join runs to segments; a climb from the ground is a take-off, a descent to it a landing."""
    near = round(_GROUND_S / step_s)
    found: list[StateSegment] = []
    starts, ends = run_bounds(states)
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        if states[start] < 0:
            continue
        state = STATES[states[start]]
        if state is FlightState.CLIMB and record.is_landed[max(start - near, 0) : start].any():
            state = FlightState.TAKEOFF
        elif state is FlightState.DESCEND and record.is_landed[end : end + near].any():
            state = FlightState.LAND
        found.append(
            StateSegment(
                state=state,
                first=start,
                end=end,
                start_s=float(record.time_s[start]),
                duration_s=(end - start) * step_s,
            )
        )
    return tuple(found)
