"""A flight sampled over time, for plots and for programs of others."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import (
    STATES,
    FlightState,
)
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.arrays import FloatArray, IntArray
    from planner.flight.prediction import Flight
    from planner.mission.route.stage import Route

TRACE_STEP_S = 0.1
"""Time between samples. [s]"""
MOST_SAMPLES = 200_000
"""A flight of more than five and a half hours is sampled more coarsely, unless asked otherwise."""


@frozen(eq=False)
class Trace:
    """Samples of a flight as columns of one length, the segment boundaries among them."""

    time_s: FloatArray
    segment: IntArray
    item: IntArray
    state: tuple[str, ...]
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_above_home_m: FloatArray
    altitude_amsl_m: FloatArray
    ground_speed_m_s: FloatArray
    climb_rate_m_s: FloatArray
    power_w: FloatArray

    def columns(self) -> dict[str, FloatArray | IntArray | tuple[str, ...]]:
        """Return the columns by name, in the order they are written."""
        return {column.name: getattr(self, column.name) for column in fields(self)}


def sample_trace(flight: Flight, route: Route, *, most_samples: int = MOST_SAMPLES) -> Trace:
    """Return a flight sampled at even times and at the boundaries of its segments.

    The last sample of a flight that lands is on the ground: a response of reference steps is told up
    to its last metre.  The power at a sample is the sum of every window open there, so that the
    integral of the trace is the energy of the flight, but for a window the landing cuts short.
    """
    segments = flight.motion.segments
    end_s = segments.end_s
    step_s = max(TRACE_STEP_S, flight.time_s / most_samples)
    even_s = np.arange(0.0, flight.time_s, step_s)
    time_s = np.union1d(even_s, np.concatenate(([0.0], end_s)))
    segment = np.minimum(np.searchsorted(end_s, time_s, side="right"), len(end_s) - 1)
    state = flight.motion.state_at_time(time_s)
    height_m, climb_m_s = state.height_m.copy(), state.climb_m_s.copy()
    last = route.stages[-1]
    lands = STATES[segments.state[-1]] is FlightState.LAND and last.return_path is None
    if lands and height_m[-1] > last.height_m:
        height_m[-1], climb_m_s[-1] = last.height_m, 0.0
    latitude_deg, longitude_deg = route.frame.latitude_longitude_deg(state.east_m, state.north_m)
    return Trace(
        time_s=time_s,
        segment=segment,
        item=segments.item[segment],
        state=tuple(STATES[index].value for index in segments.state[segment].tolist()),
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_above_home_m=height_m,
        altitude_amsl_m=height_m + route.home_amsl_m,
        ground_speed_m_s=state.ground_speed_m_s,
        climb_rate_m_s=climb_m_s,
        power_w=flight.power_w(time_s),
    )
