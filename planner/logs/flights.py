"""Where the flights of a recording begin and end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.catalogue.flight_log import FLIGHT_LEFT_OUT
from planner.errors import LogFileError
from planner.frozen import frozen
from planner.logs.record import STEP_S, Boundary
from planner.units import SECONDS_PER_HOUR

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.findings import Finding
    from planner.logs.record import BoolArray, FloatArray
    from planner.logs.recording import Recording
    from planner.logs.series import Series

LONGEST_SILENCE_S = 60.0
"""A longer silence ends a flight: nobody knows what happened in it. [s]"""

_AIRBORNE_M = 1.0
"""Rise that counts as having left the ground. [m]"""
_OFF_GROUND_M = 0.5
"""Rise at which take-off is timed, where only the heights tell. [m]"""
_IDLE_SHARE = 0.15
"""Share of the power in flight under which the motors stand still, where only power tells. [-]"""
_SHORTEST_PAUSE_S = 5.0
"""The motors stand still, or the vehicle on the ground, for longer than this between flights. [s]"""
_LONGEST_FLIGHT_S = 43_200.0
"""Twelve hours: a longer run of a log without a silence is a broken clock. [s]"""


@frozen
class FlightSpan:
    """One flight on the clock of its recording."""

    begin_s: float
    end_s: float
    begins_with: Boundary
    ends_with: Boundary


def flight_spans(recording: Recording) -> tuple[tuple[FlightSpan, ...], tuple[Finding, ...]]:
    """Return the flights of a recording.

    A flight goes from arming to disarming.  Where arming is not logged it goes by the power the
    motors draw, else by the autopilot's landing detector, else by the height.

    Parameters
    ----------
    recording : Recording
        A log between two restarts of its clock.

    Returns
    -------
    spans : tuple of FlightSpan
        In the order of time; empty where nothing took off.
    findings : tuple of Finding
        Armings that did not lead to a flight.

    Raises
    ------
    LogFileError
        If it goes on for longer than anything flies.
    """
    if recording.is_armed is not None:
        spans = _spans_of(recording.is_armed, recording, Boundary.ARMING)
        pieces = [piece for span in spans for piece in _pieces(span, recording)]
    else:
        whole = FlightSpan(
            begin_s=recording.begin_s,
            end_s=recording.end_s,
            begins_with=Boundary.LOG,
            ends_with=Boundary.LOG,
        )
        pieces = [
            span for piece in _pieces(whole, recording) for span in _unarmed_spans(recording, piece)
        ]
    flights = tuple(piece for piece in pieces if is_airborne_in(recording, piece))
    source = recording.file.source
    findings = tuple(
        FLIGHT_LEFT_OUT.finding(
            f"{source}: armed for {piece.end_s - piece.begin_s:.1f} s at {piece.begin_s:.1f} s "
            "without taking off: no flight"
        )
        for piece in pieces
        if piece not in flights and piece.begins_with is Boundary.ARMING
    )
    return flights, findings


def is_airborne_in(recording: Recording, span: FlightSpan) -> bool:
    """Return whether the vehicle leaves the ground; it is believed where nothing tells."""
    landed = recording.is_landed
    if landed is not None and np.any(landed.between(span.begin_s, span.end_s).values == 0.0):
        return True
    height = height_series(recording)
    if height is not None:
        heights = height.between(span.begin_s, span.end_s).values
        if len(heights):
            return bool(np.ptp(heights) > _AIRBORNE_M)
    return landed is None


def height_series(recording: Recording) -> Series | None:
    """Return the best of the heights that a recording has, whatever their origin."""
    for name in ("height_above_home_m", "local_height_m", "altitude_amsl_m"):
        if name in recording.series:
            return recording.series[name]
    return None


def is_off_ground(height_m: FloatArray) -> BoolArray:
    """Return whether heights are above the ground, from take-off to landing as the heights tell.

    The ground is where the heights begin.  They may end on lower ground, or in the air; landing
    on higher ground looks like ending in the air and is taken for it.

    Parameters
    ----------
    height_m : ndarray
        Heights of one flight; NaN where they are not known. [m]

    Returns
    -------
    ndarray of bool
        True from the first rise of 0.5 m to the last.
    """
    off = np.zeros(height_m.shape, np.bool_)
    known = np.flatnonzero(np.isfinite(height_m))
    if not len(known):
        return off
    heights = height_m[known]
    up = np.flatnonzero(heights > heights[0] + _OFF_GROUND_M)
    if len(up):
        down = np.flatnonzero(heights > min(heights[0], heights[-1]) + _OFF_GROUND_M)
        off[known[up[0]] : known[down[-1]] + 1] = True
    return off


def silences(recording: Recording, begin_s: float, end_s: float, least_s: float) -> FloatArray:
    """Return beginnings and ends of the times when nothing at all was logged.

    Returns
    -------
    ndarray
        A row for each silence: from when to when, on the recording's clock, shape (n, 2). [s]
    """
    ticks = [
        np.unique(np.floor(series.between(begin_s, end_s).time_s / STEP_S))
        for series in recording.series.values()
        if not series.is_event
    ]
    heard = np.unique(np.concatenate([*ticks, np.floor(np.array([begin_s, end_s]) / STEP_S)]))
    pause = np.flatnonzero(np.diff(heard) * STEP_S > least_s + STEP_S)
    return np.column_stack((heard[pause] + 1.0, heard[pause + 1])) * STEP_S


def _spans_of(events: Series, recording: Recording, boundary: Boundary) -> list[FlightSpan]:
    """Return the times between an event that is not zero and the next that is."""
    spans: list[FlightSpan] = []
    begin_s: float | None = None
    begins_with = boundary
    for number, (time_s, value) in enumerate(zip(events.time_s, events.values, strict=True)):
        if value and begin_s is None:
            begin_s, begins_with = float(time_s), boundary
        elif not value:
            if begin_s is None and number == 0 and time_s > recording.begin_s:
                begin_s, begins_with = recording.begin_s, Boundary.LOG
            if begin_s is not None:
                spans.append(
                    FlightSpan(
                        begin_s=begin_s,
                        end_s=float(time_s),
                        begins_with=begins_with,
                        ends_with=boundary,
                    )
                )
                begin_s = None
    if begin_s is not None:
        spans.append(
            FlightSpan(
                begin_s=begin_s,
                end_s=recording.end_s,
                begins_with=begins_with,
                ends_with=Boundary.LOG,
            )
        )
    return spans


def _unarmed_spans(recording: Recording, piece: FlightSpan) -> list[FlightSpan]:
    """Return the flights as power tells them, else the landing detector, else the height."""
    count = int((piece.end_s - piece.begin_s) / STEP_S) + 1
    time_s = piece.begin_s + np.arange(count, dtype=np.float64) * STEP_S
    if "power_w" in recording.series:
        power_w = recording.series["power_w"].mean_at(time_s)
        known = power_w[np.isfinite(power_w)]
        if len(known):
            is_on = power_w > _IDLE_SHARE * np.percentile(known, 90.0)
            return _runs(is_on, time_s, Boundary.POWER)
    if recording.is_landed is not None:
        inverted = recording.is_landed.at(time_s)
        return _runs(inverted == 0.0, time_s, Boundary.AIR)
    height = height_series(recording)
    if height is None:
        return []
    return _runs(is_off_ground(height.at(time_s)), time_s, Boundary.AIR)


def _runs(is_on: BoolArray, time_s: FloatArray, boundary: Boundary) -> list[FlightSpan]:
    """Return the runs of truth; shorter pauses than five seconds are no pauses."""
    on = np.flatnonzero(is_on)
    if not len(on):
        return []
    pause = np.flatnonzero(np.diff(time_s[on]) > _SHORTEST_PAUSE_S)
    first = on[np.concatenate(([0], pause + 1))]
    last = on[np.concatenate((pause, [len(on) - 1]))]
    return [
        FlightSpan(
            begin_s=float(time_s[begin]),
            end_s=float(time_s[end]),
            begins_with=boundary if begin > 0 else Boundary.LOG,
            ends_with=boundary if end < len(time_s) - 1 else Boundary.LOG,
        )
        for begin, end in zip(first.tolist(), last.tolist(), strict=True)
        if end > begin
    ]


def _pieces(span: FlightSpan, recording: Recording) -> Iterable[FlightSpan]:
    """Yield a span cut where nothing was logged for too long."""
    for piece in _between_silences(span, recording):
        if piece.end_s - piece.begin_s > _LONGEST_FLIGHT_S:
            hours = (piece.end_s - piece.begin_s) / SECONDS_PER_HOUR
            msg = f"goes on for {hours:.0f} h without a break: its clock is broken"
            raise LogFileError(msg, source=recording.file.source)
        yield piece


def _between_silences(span: FlightSpan, recording: Recording) -> Iterable[FlightSpan]:
    begin_s, begins_with = span.begin_s, span.begins_with
    for quiet_from_s, quiet_to_s in silences(
        recording, span.begin_s, span.end_s, LONGEST_SILENCE_S
    ).tolist():
        if quiet_from_s > begin_s:
            yield FlightSpan(
                begin_s=begin_s,
                end_s=quiet_from_s,
                begins_with=begins_with,
                ends_with=Boundary.LOG,
            )
        begin_s, begins_with = quiet_to_s, Boundary.LOG
    if span.end_s > begin_s:
        yield FlightSpan(
            begin_s=begin_s, end_s=span.end_s, begins_with=begins_with, ends_with=span.ends_with
        )
