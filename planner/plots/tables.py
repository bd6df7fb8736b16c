"""Tables behind the pictures: what a flight looks like over time, and where it goes."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.errors import UsageError
from planner.flight.trace import sample_trace
from planner.units import wh_from_j

if TYPE_CHECKING:
    from planner.checks.case import Case
    from planner.flight.motion.kinematics import FloatArray
    from planner.flight.trace import Trace
    from planner.service import CheckResult

Row = dict[str, Any]

MOST_ROWS = 4_000
"""Finer than the dots of a screen; the ends of segments are kept whatever their number."""


def flown_case(result: CheckResult) -> Case:
    """Return the case behind a result.

    Raises
    ------
    UsageError
        If nothing is flown, of which there is no picture.
    """
    if result.case is None:
        msg = f"{result.file}: nothing is flown, so there is nothing to draw"
        raise UsageError(msg)
    return result.case


def flight_rows(result: CheckResult) -> list[Row]:
    """Return the flight over time, a row per sample; energies are ``None`` where not known.

    Raises
    ------
    UsageError
        If nothing is flown.
    """
    case = flown_case(result)
    trace = sample_trace(case.flight, case.route, most_samples=MOST_ROWS)
    powered = case.vehicle.is_power_known
    used_wh = _used_wh(case, trace)
    columns = {
        "time_min": np.round(trace.time_s / 60.0, 4),
        "item": trace.item,
        "altitude_amsl_m": np.round(trace.altitude_amsl_m, 2),
        "speed_m_s": np.round(trace.ground_speed_m_s, 2),
        "power_w": np.round(trace.power_w, 1),
        "used_wh": np.round(used_wh, 3),
        "latitude_deg": np.round(trace.latitude_deg, 7),
        "longitude_deg": np.round(trace.longitude_deg, 7),
    }
    east_m, north_m = case.route.frame.east_north_m(trace.latitude_deg, trace.longitude_deg)
    columns |= {"east_m": np.round(east_m, 1), "north_m": np.round(north_m, 1)}
    if not powered:
        del columns["power_w"], columns["used_wh"]
    names = [*columns, "state"]
    lists = [column.tolist() for column in columns.values()]
    return [dict(zip(names, row, strict=True)) for row in zip(*lists, trace.state, strict=True)]


def state_rows(result: CheckResult) -> list[Row]:
    """Return the stretches of one state over time, neighbours of one state in one row."""
    rows: list[Row] = []
    for state, group in groupby(result.segments, key=lambda segment: segment.state):
        stretch = list(group)
        end_s = stretch[-1].start_s + stretch[-1].duration_s
        rows.append(
            {
                "state": state.value,
                "start_min": round(stretch[0].start_s / 60.0, 4),
                "end_min": round(end_s / 60.0, 4),
            }
        )
    return rows


def _used_wh(case: Case, trace: Trace) -> FloatArray:
    """Return the energy used by each sample: exact where segments end, by the powers between."""
    ends_s = np.concatenate(([0.0], case.flight.motion.segments.end_s))
    ends_wh = np.concatenate(([0.0], np.cumsum(wh_from_j(case.flight.segment_energy_j))))
    steps_j = 0.5 * (trace.power_w[1:] + trace.power_w[:-1]) * np.diff(trace.time_s)
    rough_wh = np.concatenate(([0.0], np.cumsum(wh_from_j(steps_j))))
    rough_at_ends_wh = np.interp(ends_s, trace.time_s, rough_wh)
    missing_wh = np.interp(trace.time_s, ends_s, ends_wh - rough_at_ends_wh)
    used_wh: FloatArray = rough_wh + missing_wh
    return used_wh
