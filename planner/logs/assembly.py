"""A flight of a recording on the common time base: from native samples to the record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.catalogue.flight_log import FLIGHT_INCOMPLETE, LOG_GAP, POSITION_RESET
from planner.catalogue.verification import MISSION_CHANGED
from planner.logs.flights import is_off_ground, silences
from planner.logs.grid import Column, Grid
from planner.logs.positions import height_columns, home_of, position_columns
from planner.logs.quantities import ABSENCE_COSTS
from planner.logs.record import Boundary, FlightRecord, Quantity
from planner.logs.series import GAP_INTERVALS, LEAST_GAP_S
from planner.logs.speeds import speed_columns

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.logs.flights import FlightSpan
    from planner.logs.record import BoolArray, FloatArray, IntArray, LoggedItem, TextArray
    from planner.logs.recording import Recording

_MEANS = ("voltage_v", "current_a", "power_w")
"""Averaged around each sample, so that energy is kept."""
_DIRECT = ("roll_deg", "pitch_deg", "yaw_deg")
_LEAST_JUMP_M = 1.0
"""Smaller resets drown in the noise of the estimate. [m]"""
_EVENTS = ("mode", "is_landed", "mission_item")


def flight_record(
    recording: Recording, span: FlightSpan, number: int, findings: tuple[Finding, ...] = ()
) -> FlightRecord:
    """Return the record of one flight.

    Parameters
    ----------
    recording : Recording
        The log the flight is in.
    span : FlightSpan
        From when to when.
    number : int
        Which flight of the log it is, from 1.
    findings : tuple of Finding
        What else is to be said about its log.

    Returns
    -------
    FlightRecord
        Columns every 0.1 s from the beginning, and the table of what was found where.
    """
    grid = Grid.of(recording, span)
    home = home_of(grid)
    columns = position_columns(grid, home) | height_columns(grid, home) | speed_columns(grid)
    for name in (*_DIRECT, *_MEANS):
        column = grid.column(name, is_mean=name in _MEANS)
        if column is not None:
            columns[name] = column
    mode, mode_found = _modes(grid)
    is_landed, landed_found = _landed(grid, columns.get("height_above_home_m"))
    mission_item, item_found = _mission_item(grid)
    events = dict(zip(_EVENTS, (mode_found, landed_found, item_found), strict=True))
    unknown = np.full(grid.time_s.shape, np.nan)
    unknown.flags.writeable = False
    numbers: dict[str, FloatArray] = {
        name: columns[name].values if name in columns else unknown
        for name in ABSENCE_COSTS
        if name not in _EVENTS
    }
    return FlightRecord(
        time_s=grid.time_s - span.begin_s,
        **numbers,
        mode=mode,
        is_landed=is_landed,
        mission_item=mission_item,
        duration_s=span.end_s - span.begin_s,
        begins_with=span.begins_with,
        ends_with=span.ends_with,
        number=number,
        begins_in_log_s=span.begin_s,
        home=home,
        mission_items=_mission_at(recording, span),
        parameters={
            name: value for time_s, name, value in recording.parameters if time_s <= span.end_s
        },
        autopilot=recording.autopilot,
        firmware=recording.firmware,
        vehicle=recording.vehicle,
        source=recording.file.source,
        sha256=recording.file.sha256,
        log_format=recording.file.log_format,
        quantities=tuple(_quantities(columns, events, recording.remarks)),
        findings=(
            *recording.findings,
            *findings,
            *_gaps(recording, span, number, is_landed),
            *_mission_changes(recording, span, number),
        ),
    )


def _modes(grid: Grid) -> tuple[TextArray, str | None]:
    """Return the mode at each time, empty before the first is told."""
    entered_s = np.array([time_s for time_s, _ in grid.recording.modes], np.float64)
    names = np.array(["", *(name for _, name in grid.recording.modes)], np.str_)
    modes = names[np.searchsorted(entered_s, grid.time_s, side="right")]
    return modes, grid.recording.modes_found_in if np.any(modes != "") else None


def _landed(grid: Grid, height: Column | None) -> tuple[BoolArray, str | None]:
    """Return whether the vehicle stands on the ground, as the detector or the heights tell."""
    detector = grid.recording.is_landed
    if detector is not None:
        # Before the first event the opposite holds; a sampled state begins with what it is.
        told = detector.between(grid.time_s[0], np.inf).values
        values = detector.at(grid.time_s)
        before = bool(told[0] == 0.0) if len(told) else True
        return np.where(np.isnan(values), before, values != 0.0), detector.found_in
    if height is None:
        return np.zeros(grid.time_s.shape, np.bool_), None
    return ~is_off_ground(height.values), f"heights of {height.found_in}"


def _mission_item(grid: Grid) -> tuple[IntArray, str | None]:
    series = grid.recording.mission_item
    if series is None:
        return np.zeros(grid.time_s.shape, np.int64), None
    items = np.nan_to_num(series.at(grid.time_s), nan=0.0).astype(np.int64)
    return items, series.found_in if np.any(items) else None


def _mission_at(recording: Recording, span: FlightSpan) -> tuple[LoggedItem, ...]:
    """Return the mission that was on board at the end of a flight."""
    held = [items for time_s, items in recording.missions if time_s <= span.end_s]
    return held[-1] if held else ()


def _mission_changes(recording: Recording, span: FlightSpan, number: int) -> Iterator[Finding]:
    """Return that another mission was sent to the vehicle during a flight."""
    before = [items for time_s, items in recording.missions if time_s <= span.begin_s]
    held = before[-1] if before else None
    for time_s, items in recording.missions:
        if span.begin_s < time_s <= span.end_s:
            if held is not None and items != held:
                yield MISSION_CHANGED.finding(
                    f"{recording.file.source}: the mission was changed at "
                    f"{time_s - span.begin_s:.1f} s of flight {number}"
                )
                return
            held = items


def _quantities(
    columns: Mapping[str, Column],
    events: Mapping[str, str | None],
    remarks: Mapping[str, str],
) -> Iterator[Quantity]:
    for name, cost in ABSENCE_COSTS.items():
        column = columns.get(name)
        found_in, coverage = events.get(name), 1.0
        if column is not None:
            found_in, coverage = column.found_in, float(np.mean(np.isfinite(column.values)))
        yield Quantity(
            name=name,
            found_in=found_in,
            rate_hz=None if column is None else column.rate_hz,
            coverage=coverage if found_in is not None else 0.0,
            absence_cost=cost,
            remark=remarks.get(name, ""),
        )


def _gaps(
    recording: Recording, span: FlightSpan, number: int, is_landed: BoolArray
) -> Iterator[Finding]:
    """Return what is missing of a flight: its beginning, its end, times in between."""
    source = recording.file.source
    for boundary, verb, is_on_ground in (
        (span.begins_with, "begins", is_landed[0]),
        (span.ends_with, "ends", is_landed[-1]),
    ):
        if boundary is Boundary.LOG and not is_on_ground:
            yield FLIGHT_INCOMPLETE.finding(
                f"{source}: the log {verb} in the middle of flight {number}"
            )
    # A log of few messages is not full of gaps.
    usual_s = min(
        (series.interval_s for series in recording.series.values() if series.interval_s),
        default=LEAST_GAP_S,
    )
    least_s = max(LEAST_GAP_S, GAP_INTERVALS * usual_s)
    quiet = silences(recording, span.begin_s, span.end_s, least_s)
    if len(quiet):
        lengths_s = quiet[:, 1] - quiet[:, 0]
        longest = int(np.argmax(lengths_s))
        more = f", and {numbers.count(len(quiet) - 1, 'shorter gap')}" if len(quiet) > 1 else ""
        yield LOG_GAP.finding(
            f"{source}: nothing was logged for {lengths_s[longest]:.1f} s at "
            f"{quiet[longest, 0] - span.begin_s:.1f} s of flight {number}{more}"
        )
    jumps = [
        (size_m, time_s)
        for time_s, size_m in recording.position_jumps
        if span.begin_s <= time_s <= span.end_s and size_m > _LEAST_JUMP_M
    ]
    if jumps:
        size_m, time_s = max(jumps)
        yield POSITION_RESET.finding(
            f"{source}: the position estimate jumped {numbers.count(len(jumps), 'time')} in flight "
            f"{number}, by up to {size_m:.1f} m at {time_s - span.begin_s:.1f} s"
        )
