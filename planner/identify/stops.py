"""Stops of a flight: from which speed to standstill, over which distance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

_LEAST_SPEED_M_S = 1.5
"""Slower is hovering with noise, not flying. [m s⁻¹]"""
_STANDSTILL_M_S = 0.5
_PLATEAU = 0.98
"""A stop begins where the speed falls under this share of what it was. [-]"""
_KNEE = 0.9
"""Braking is well under way at this share of the speed; noise is not. [-]"""
_SMOOTHING_S = 0.5
"""Noise of a speed counts for little in the mean over so long. [s]"""
_STEADY_S = 3.0
"""A speed that has not risen for so long, looking back, is the one braked from. [s]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """A manoeuvre from a horizontal speed to standstill in the air."""

    item: int
    """Mission item flown when it began, from 1; 0 where it is not known."""
    start_s: float
    speed_m_s: float
    """Speed braked from. [m s⁻¹]"""
    distance_m: float
    """Flown from 98 % of that speed to 0.5 m/s. [m]"""


def find_stops(record: FlightRecord) -> tuple[Stop, ...]:
    """Return the stops of a record, in the order flown.

    The speed braked from is the highest looked back to from the standstill until none higher comes
    for 3 s, or the median of the seconds before the knee where that was held; the stop begins where
    98 % of it was flown before the knee.
    """
    step_s = float(record.time_s[1] - record.time_s[0])
    window = round(_STEADY_S / step_s)
    speed = _smoothed(record.ground_speed_m_s, round(_SMOOTHING_S / step_s))
    found: list[Stop] = []
    stood = 0
    fast = False
    for at, value in enumerate(speed.tolist()):
        if value >= _LEAST_SPEED_M_S:
            fast = True
        elif value < _STANDSTILL_M_S and not record.is_landed[at]:
            if fast:
                found.append(_stop(record, speed, stood, at, window))
            fast, stood = False, at
    return tuple(found)


def _smoothed(column: FloatArray, window: int) -> FloatArray:
    """Mean of the samples around each, over fewer towards the ends."""
    weights = np.ones(2 * (window // 2) + 1)
    counts = np.convolve(np.ones(column.size), weights, mode="same")
    return np.convolve(column, weights, mode="same") / counts


def _stop(record: FlightRecord, speed: FloatArray, first: int, end: int, window: int) -> Stop:
    peak = end
    for at in range(end - 1, first - 1, -1):
        if speed[at] > speed[peak]:
            peak = at
        elif peak - at > window and speed[peak] >= _LEAST_SPEED_M_S:
            break
    top = float(speed[peak])
    knee = peak + int(np.flatnonzero(speed[peak : end + 1] >= _KNEE * top)[-1])
    before = speed[max(knee - 2 * window, first) : max(knee - window // 2, first + 1)]
    steady = float(np.median(before))
    if steady >= _KNEE * top:
        # The highest of many noisy samples is higher than the speed that was held.
        top = steady
    start = knee - int(np.argmax(speed[knee::-1] >= _PLATEAU * top))
    braked = record.ground_speed_m_s[start : end + 1]
    return Stop(
        item=int(record.mission_item[start]),
        start_s=float(record.time_s[start]),
        speed_m_s=top,
        distance_m=float(np.trapezoid(braked, record.time_s[start : end + 1])),
    )
