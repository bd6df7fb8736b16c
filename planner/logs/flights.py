"""Where the flights of a recording begin and end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.findings import Rule, Severity
from planner.logs.positions import (
    Grid,
    GridColumn,
    height_columns,
    home_of,
    position_columns,
    speed_columns,
)
from planner.logs.record import ABSENCE_COSTS, STEP_S, Boundary, FlightRecord, LoggedQuantity
from planner.logs.series import GAP_INTERVALS, LEAST_GAP_S, Series
from planner.units import SECONDS_PER_HOUR
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.arrays import BoolArray, FloatArray, IntArray, TextArray
    from planner.findings import Finding
    from planner.logs.record import Recording


LONGEST_SILENCE_S = 60.0
"""A longer silence ends a flight: nobody knows what happened in it. [s]"""

_AIRBORNE_M = 1.0
"""Rise that counts as having left the ground. [m]"""
_OFF_GROUND_M = 0.5
"""Rise at which take-off is timed, where only heights are known. [m]"""
_IDLE_FRACTION = 0.15
"""Fraction of the power in flight below which the motors are off, where only power is known. [-]"""
_SHORTEST_PAUSE_S = 5.0
"""Between flights the motors are off, or the vehicle is on the ground, for longer than this. [s]"""
_LONGEST_FLIGHT_S = 43_200.0
"""Twelve hours: a longer run of a log without a silence is a broken clock. [s]"""


class FlightSpan(Value, kw_only=False):
    """One flight on the clock of its recording."""

    begin_s: float
    end_s: float
    begins_with: Boundary
    ends_with: Boundary


FLIGHT_LEFT_OUT = Rule(
    "R105 flight-left-out",
    Severity.INFO,
    summary="The vehicle was armed but did not take off.",
    why="Standing on the ground counted as flying makes the vehicle look efficient.",
    how="From arming to disarming it neither rose by more than 1 m nor was seen in the air.",
    fix="nothing",
)


def flight_spans(recording: Recording) -> tuple[tuple[FlightSpan, ...], tuple[Finding, ...]]:
    """Return the flights of a recording.

    A flight goes from arming to disarming.  Where arming is not logged it goes by the power the
    motors draw, else by the autopilot's landing detector, else by the height.
    """
    if recording.is_armed is not None:
        spans = _armed_spans(recording.is_armed, recording)
        pieces = [piece for span in spans for piece in _pieces(span, recording)]
    else:
        whole = FlightSpan(recording.begin_s, recording.end_s, Boundary.LOG, Boundary.LOG)
        pieces = [
            span for piece in _pieces(whole, recording) for span in _unarmed_spans(recording, piece)
        ]
    flights = tuple(piece for piece in pieces if is_airborne_in(recording, piece))
    findings = tuple(
        FLIGHT_LEFT_OUT.finding(
            f"{recording.file.source}: armed for {piece.end_s - piece.begin_s:.1f} s at "
            f"{piece.begin_s:.1f} s without taking off: no flight"
        )
        for piece in pieces
        if piece not in flights and piece.begins_with is Boundary.ARMING
    )
    return flights, findings


def is_airborne_in(recording: Recording, span: FlightSpan) -> bool:
    """Return whether the vehicle leaves the ground; assumed where nothing is known."""
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
    """Return whether heights of one flight are above the ground: from the first rise of 0.5 m to the last.

    The ground is where the heights begin.  They may end on lower ground, or in the air; landing
    on higher ground looks like ending in the air and is read as it.
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
    """Return from when to when nothing at all was logged, on the recording's clock, (n, 2). [s]"""
    ticks = [
        np.unique(np.floor(series.between(begin_s, end_s).time_s / STEP_S))
        for series in recording.series.values()
        if not series.is_event
    ]
    heard = np.unique(np.concatenate([*ticks, np.floor(np.array([begin_s, end_s]) / STEP_S)]))
    pause = np.flatnonzero(np.diff(heard) * STEP_S > least_s + STEP_S)
    return np.column_stack((heard[pause] + 1.0, heard[pause + 1])) * STEP_S


def _armed_spans(events: Series, recording: Recording) -> list[FlightSpan]:
    """Return the times from arming to disarming, or from or to an end of the log."""
    spans: list[FlightSpan] = []
    begin: tuple[float, Boundary] | None = None
    if len(events) and not events.values[0] and events.time_s[0] > recording.begin_s:
        begin = recording.begin_s, Boundary.LOG
    for time_s, is_armed in zip(events.time_s.tolist(), events.values.tolist(), strict=True):
        if is_armed:
            begin = begin or (time_s, Boundary.ARMING)
        elif begin is not None:
            spans.append(FlightSpan(begin[0], time_s, begin[1], Boundary.ARMING))
            begin = None
    if begin is not None:
        spans.append(FlightSpan(begin[0], recording.end_s, begin[1], Boundary.LOG))
    return spans


def _unarmed_spans(recording: Recording, piece: FlightSpan) -> list[FlightSpan]:
    """Return the flights by power, else the landing detector, else the height."""
    count = int((piece.end_s - piece.begin_s) / STEP_S) + 1
    time_s = piece.begin_s + np.arange(count, dtype=np.float64) * STEP_S
    if "power_w" in recording.series:
        power_w = recording.series["power_w"].mean_at(time_s)
        known = power_w[np.isfinite(power_w)]
        if len(known):
            is_on = power_w > _IDLE_FRACTION * np.percentile(known, 90.0)
            return _runs(is_on, time_s, Boundary.POWER)
    if recording.is_landed is not None:
        return _runs(recording.is_landed.at(time_s) == 0.0, time_s, Boundary.AIR)
    height = height_series(recording)
    is_off = np.zeros(0, np.bool_) if height is None else is_off_ground(height.at(time_s))
    return _runs(is_off, time_s, Boundary.AIR)


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
            float(time_s[begin]),
            float(time_s[end]),
            boundary if begin > 0 else Boundary.LOG,
            boundary if end < len(time_s) - 1 else Boundary.LOG,
        )
        for begin, end in zip(first.tolist(), last.tolist(), strict=True)
        if end > begin
    ]


def _pieces(span: FlightSpan, recording: Recording) -> Iterator[FlightSpan]:
    """Yield a span cut where nothing was logged for too long."""
    quiet = silences(recording, span.begin_s, span.end_s, LONGEST_SILENCE_S).tolist()
    ends = [*((from_s, Boundary.LOG) for from_s, _ in quiet), (span.end_s, span.ends_with)]
    begins = [(span.begin_s, span.begins_with), *((to_s, Boundary.LOG) for _, to_s in quiet)]
    for (begin_s, begins_with), (end_s, ends_with) in zip(begins, ends, strict=True):
        if end_s - begin_s > _LONGEST_FLIGHT_S:
            hours = (end_s - begin_s) / SECONDS_PER_HOUR
            msg = f"lasts {hours:.0f} h without a break: its clock is broken"
            raise LogFileError(msg, source=recording.file.source)
        if end_s > begin_s:
            yield FlightSpan(begin_s, end_s, begins_with, ends_with)


_LIMITS: Mapping[str, float] = {
    "latitude_deg": 90.0,
    "_deg": 720.0,
    "_m_s": 300.0,
    "_amsl_m": 20e3,
    "height_m": 20e3,
    "_home_m": 20e3,
    "_m": 20e6,
    "_v": 2e3,
    "_a": 5e3,
    "_w": 1e6,
    "throttle": 1.0,
}
"""Greatest absolute values by the end of a quantity's name, the first that fits; metres that are
no heights are as far as half around the Earth."""


_PLACE = ("latitude_deg", "longitude_deg")


VALUES_IMPOSSIBLE = Rule(
    "R108 values-impossible",
    Severity.WARNING,
    summary="A log holds values that no multirotor shows.",
    why="Damaged messages pass for sound ones in logs without checksums; one of them ruins a fit.",
    how="Latitudes beyond 90°, heights beyond 20 km, speeds beyond 300 m/s, more than 2 kV, 5 kA or 1 "
    "MW, and angles beyond two turns are left out.",
    fix="mistrust the log",
)


def plausible(recording: Recording) -> Recording:
    """Return a recording without impossible values, and with a finding where there were some."""
    possible = {
        name: np.abs(series.values)
        <= next(limit for end, limit in _LIMITS.items() if name.endswith(end))
        for name, series in recording.series.items()
    }
    findings = []
    for name, series in recording.series.items():
        if np.all(possible[name]):
            continue
        worst = series.values[np.argmax(np.abs(series.values))]
        impossible = quantity.count(int(np.sum(~possible[name])), "impossible value")
        findings.append(
            VALUES_IMPOSSIBLE.finding(
                f"{recording.file.source}: {impossible} of {series.found_in} left out, such as "
                f"{worst:.6g}"
            )
        )
    latitude, longitude = (possible.get(name, np.zeros(0, np.bool_)) for name in _PLACE)
    if len(latitude) == len(longitude):  # half a place is none
        possible |= dict.fromkeys(_PLACE, latitude & longitude)
    kept = {
        name: replace(
            series, time_s=series.time_s[possible[name]], values=series.values[possible[name]]
        )
        for name, series in recording.series.items()
        if np.any(possible[name])
    }
    return replace(recording, series=kept, findings=(*recording.findings, *findings))


_MEANS = ("voltage_v", "current_a", "power_w")
"""Averaged around each sample, so that energy is kept."""
_DIRECT = ("roll_deg", "pitch_deg", "yaw_deg")
_LEAST_JUMP_M = 1.0
"""Smaller resets drown in the noise of the estimate. [m]"""
_EVENTS = ("mode", "is_landed", "mission_item")


def flight_record(
    recording: Recording, span: FlightSpan, number: int, findings: tuple[Finding, ...] = ()
) -> FlightRecord:
    """Return the record of one flight."""
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
        mission_items=next(
            (m for at_s, m in reversed(recording.missions) if at_s <= span.end_s), ()
        ),
        parameters=_parameters(recording, span, _hover_throttle(grid, numbers, is_landed)),
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


_HOVER_THROTTLE = "MOT_THST_HOVER"
_SAVED_S = 3.0
"""After disarming ArduPilot saves the hover throttle it learnt within that: its next loop. [s]"""
_LEAST_HOVER_S = 2.0
"""Hovering that tells the throttle: its noise over so long is 1 %. [s]"""
_HOVERING: Mapping[str, float] = {
    "roll_deg": 5.0,
    "pitch_deg": 5.0,
    "climb_m_s": 0.6,
    "ground_speed_m_s": 2.0,
}
"""What is level and slow enough: ``Copter::update_throttle_hover`` learns at 5° and 0.6 m/s."""


def _hover_throttle(
    grid: Grid, columns: Mapping[str, FloatArray], is_landed: BoolArray
) -> float | None:
    """Return the fraction of its thrust that ArduPilot hovered with; ``None`` where nothing tells it. [-]

    What it learns is no more than 0.6875 (AP_MOTORS_THST_HOVER_MAX), and nothing with MOT_HOVER_LEARN 0.
    """
    series = grid.recording.series.get("throttle")
    if series is None or grid.recording.autopilot is not Autopilot.ARDUPILOT:
        return None
    hovers = ~is_landed
    for name, most in _HOVERING.items():
        hovers &= np.abs(columns[name]) < most
    throttle = series.at(grid.time_s)[hovers]
    throttle = throttle[throttle > 0.0]
    if throttle.size * STEP_S < _LEAST_HOVER_S:
        return None
    return round(float(np.median(throttle)), 4)


def _parameters(
    recording: Recording, span: FlightSpan, hover_throttle: float | None
) -> Mapping[str, float]:
    """Return the last of each parameter up to the end of a flight, and the throttle its hovers took."""
    found = {
        name: value
        for time_s, name, value in recording.parameters
        if time_s <= span.end_s + _SAVED_S * (name == _HOVER_THROTTLE)
    }
    if hover_throttle is not None and _HOVER_THROTTLE in found:
        found[_HOVER_THROTTLE] = hover_throttle
    return found


def _modes(grid: Grid) -> tuple[TextArray, str | None]:
    entered_s = np.array([time_s for time_s, _ in grid.recording.modes], np.float64)
    names = np.array(["", *(name for _, name in grid.recording.modes)], np.str_)
    modes = names[np.searchsorted(entered_s, grid.time_s, side="right")]
    return modes, grid.recording.modes_found_in if np.any(modes != "") else None


def _landed(grid: Grid, height: GridColumn | None) -> tuple[BoolArray, str | None]:
    detector = grid.recording.is_landed
    if detector is not None:
        # Before the first event the opposite holds; a sampled state begins with what it is.
        reported = detector.between(grid.time_s[0], np.inf).values
        values = detector.at(grid.time_s)
        before = bool(reported[0] == 0.0) if len(reported) else True
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


MISSION_CHANGED = Rule(
    "R206 mission-changed",
    Severity.WARNING,
    summary="The mission was changed in flight.",
    why="Only one mission is predicted, the last; what was flown before may be another.",
    how="A log holds a mission from within the flight that differs from the one before.",
    fix="verify with flights whose mission stayed the same",
)


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
    columns: Mapping[str, GridColumn], events: Mapping[str, str | None], remarks: Mapping[str, str]
) -> Iterator[LoggedQuantity]:
    for name, cost in ABSENCE_COSTS.items():
        column = columns.get(name)
        found_in, coverage = events.get(name), 1.0
        if column is not None:
            found_in, coverage = column.found_in, float(np.mean(np.isfinite(column.values)))
        yield LoggedQuantity(
            name=name,
            found_in=found_in,
            rate_hz=None if column is None else column.rate_hz,
            coverage=coverage if found_in is not None else 0.0,
            absence_cost=cost,
            remark=remarks.get(name, ""),
        )


LOG_GAP = Rule(
    "R102 log-gap",
    Severity.WARNING,
    summary="Nothing was logged for a while in flight.",
    why="What happened in the gap is unknown: its energy and its distance are not in the record.",
    how="No message of any kind used for more than 1 s, or three times as long as usual where that is "
    "more.  Nothing is interpolated over it; after 60 s of silence a flight is taken to have ended.",
    fix="use a faster memory card or a smaller logging profile",
)

FLIGHT_INCOMPLETE = Rule(
    "R104 flight-incomplete",
    Severity.WARNING,
    summary="A log begins or ends in the middle of a flight.",
    why="Time, distance and energy of the flight are larger than in the log.",
    how="The vehicle is in the air at the first or the last message of the flight.",
    fix="let the log run from before arming to after disarming",
)

POSITION_RESET = Rule(
    "R107 position-reset",
    Severity.WARNING,
    summary="The autopilot's estimate of position jumped in flight.",
    why="A jump of the estimate looks like flying; stops and distances measured over it are wrong.",
    how="The estimator counts its resets; those of more than 1 m in flight are reported.",
    fix="leave the manoeuvres around the jump out",
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
        more = f", and {quantity.count(len(quiet) - 1, 'shorter gap')}" if len(quiet) > 1 else ""
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
            f"{source}: the position estimate jumped {quantity.count(len(jumps), 'time')} in flight "
            f"{number}, by up to {size_m:.1f} m at {time_s - span.begin_s:.1f} s"
        )
