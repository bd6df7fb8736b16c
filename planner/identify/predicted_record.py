"""A predicted flight in the form of a recorded one, so that both are measured by one ruler."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.logs.record import STEP_S

if TYPE_CHECKING:
    from planner.flight.prediction import Flight
    from planner.logs.record import FlightRecord

_ON_GROUND_M = 0.05
"""Height under which a vehicle that does not climb stands on the ground. [m]"""
_TOUCHED_DOWN_M = 2.0
"""Height under which a flight that ends has landed: step responses settle within 1 m. [m]"""
_STILL_M_S = 0.1


def predicted_record(flight: Flight, flown: FlightRecord) -> FlightRecord:
    """Return a predicted flight as the record a logger would make of it.

    Parameters
    ----------
    flight : Flight
        The prediction.
    flown : FlightRecord
        The flight it predicts: references are known where they are known of that one.

    Returns
    -------
    FlightRecord
        Sampled every 0.1 s; what a prediction does not tell is NaN.
    """
    motion = flight.motion
    time_s = np.arange(0.0, flight.time_s, STEP_S)
    state = motion.state_at_time(time_s)
    segment = np.minimum(
        np.searchsorted(motion.segments.end_s, time_s, side="right"),
        len(motion.segments.duration_s) - 1,
    )
    speed = state.ground_speed_m_s
    still = (np.abs(state.climb_m_s) < _STILL_M_S) & (speed < _STILL_M_S)
    is_landed = (np.abs(state.height_m) < _ON_GROUND_M) & still
    # A landing that ends as the flight does, or creeps to its end, leaves no time on the ground.
    is_down = (np.abs(state.height_m) < _TOUCHED_DOWN_M) & still
    is_down[-1] = abs(state.height_m[-1]) < _TOUCHED_DOWN_M
    is_landed |= np.logical_and.accumulate(is_down[::-1])[::-1]
    known = {
        "time_s": time_s,
        "north_m": state.north_m,
        "east_m": state.east_m,
        "height_above_home_m": state.height_m,
        "velocity_north_m_s": state.north_m_s,
        "velocity_east_m_s": state.east_m_s,
        "climb_m_s": state.climb_m_s,
        "ground_speed_m_s": speed,
        "power_w": flight.power_w(time_s),
        "mode": np.full(time_s.size, ""),
        "is_landed": is_landed,
        "mission_item": motion.segments.item[segment],
    }
    if np.isfinite(flown.reference_speed_m_s).any():
        known["reference_speed_m_s"] = speed
    unknown = dict.fromkeys(flown.columns(), np.full(time_s.size, np.nan))
    return replace(
        flown,
        **{**unknown, **known},  # type: ignore[arg-type]  # all of them are columns
        duration_s=flight.time_s,
        quantities=(),
        findings=(),
    )
