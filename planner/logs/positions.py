"""The columns of a flight computed from its series: positions, heights and speeds from home."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

from planner.geo.geodesy import LocalFrame
from planner.logs.record import STEP_S, LoggedHome
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.logs.flights import FlightSpan
    from planner.logs.record import Recording


class GridColumn(Value, eq=False):
    """A quantity on the time base of a flight."""

    values: FloatArray
    """NaN where it is not known."""
    found_in: str
    """Message and fields of the log, or what it is computed from."""
    rate_hz: float | None
    """Rate of the samples in the log."""

    @property
    def is_known(self) -> bool:
        """Whether there is a value at all."""
        return bool(np.isfinite(self.values).any())

    def else_from(self, other: GridColumn) -> GridColumn:
        """Return the column with what it does not know filled from another."""
        known = np.isfinite(self.values)
        if not np.any(np.isfinite(other.values[~known])):
            return self
        return replace(
            self,
            values=np.where(known, self.values, other.values),
            found_in=f"{self.found_in}, else {other.found_in}",
        )

    def plus(self, offset: float) -> GridColumn:
        """Return the column with an offset added."""
        return replace(self, values=self.values + offset)


class Grid(Value, eq=False):
    """The times of a record's samples."""

    recording: Recording
    span: FlightSpan
    time_s: FloatArray
    """On the recording's clock, :data:`~planner.logs.record.STEP_S` apart. [s]"""

    @classmethod
    def of(cls, recording: Recording, span: FlightSpan) -> Grid:
        """Return the grid of a flight: from its beginning, as far as it goes."""
        # The nudge keeps the last sample of a flight of whole steps.
        count = int((span.end_s - span.begin_s) / STEP_S + 1e-6) + 1
        return cls(
            recording=recording,
            span=span,
            time_s=span.begin_s + np.arange(count, dtype=np.float64) * STEP_S,
        )

    def column(self, name: str, *, is_mean: bool = False) -> GridColumn | None:
        """Return a series of the recording on the grid; ``None`` where it has nothing here."""
        series = self.recording.series.get(name)
        if series is None:
            return None
        values = series.mean_at(self.time_s) if is_mean else series.at(self.time_s)
        if series.period is not None:
            values %= series.period
        column = GridColumn(values=values, found_in=series.found_in, rate_hz=series.rate_hz)
        return column if column.is_known else None

    def together(self, values: FloatArray, found_in: str, *sources: GridColumn) -> GridColumn:
        """Return a column computed from others; its rate is that of the slowest."""
        rates = [source.rate_hz for source in sources if source.rate_hz is not None]
        return GridColumn(values=values, found_in=found_in, rate_hz=min(rates, default=None))


Longitude = TypeVar("Longitude", float, "FloatArray")

_HOME_AFTER_S = 2.0
"""An autopilot sets home when it is armed; the message may come this much later. [s]"""


def home_of(grid: Grid) -> LoggedHome:
    """Return the home set last before a flight, or at its beginning; else the place it begins at."""
    latest_s = grid.span.begin_s + _HOME_AFTER_S
    logged = next((h for time_s, h in reversed(grid.recording.homes) if time_s <= latest_s), None)
    if logged is None:
        latitude_deg = _first(grid.column("latitude_deg"))
        longitude_deg = _first(grid.column("longitude_deg"))
        is_known = latitude_deg is not None and longitude_deg is not None
        logged = LoggedHome(
            latitude_deg=latitude_deg if is_known else None,
            longitude_deg=_wrapped(longitude_deg)
            if is_known and longitude_deg is not None
            else None,
            altitude_amsl_m=None,
            found_in="the beginning of the flight",
        )
    if logged.altitude_amsl_m is not None:
        return logged
    altitude, height = grid.column("altitude_amsl_m"), grid.column("height_above_home_m")
    if altitude is not None and height is not None:
        return replace(logged, altitude_amsl_m=_median(altitude.values - height.values))
    return replace(logged, altitude_amsl_m=_first(altitude))


def position_columns(grid: Grid, home: LoggedHome) -> dict[str, GridColumn]:
    """Return latitude, longitude, north and east, of the vehicle and of its reference.

    The local frame of the log, in which the references are given, is laid over the global
    positions by the median of the difference.
    """
    frame = None
    if home.latitude_deg is not None and home.longitude_deg is not None:
        frame = LocalFrame(latitude_deg=home.latitude_deg, longitude_deg=home.longitude_deg)
    columns = _global_columns(grid, frame)
    for axis in ("north_m", "east_m"):
        columns |= _local_columns(grid, columns.get(axis), axis)
    if frame is not None and "reference_north_m" not in columns:
        columns |= _global_reference(grid, frame)
    is_local = {"north_m", "east_m"} <= columns.keys()
    if frame is not None and is_local and "latitude_deg" not in columns:
        north = columns["north_m"]
        places = frame.latitude_longitude_deg(columns["east_m"].values, north.values)
        for name, values in zip(("latitude_deg", "longitude_deg"), places, strict=True):
            columns[name] = grid.together(values, f"{north.found_in}, home", north)
    return columns


def height_columns(grid: Grid, home: LoggedHome) -> dict[str, GridColumn]:
    """Return altitude and height above home, of the vehicle, and the height of its reference."""
    columns: dict[str, GridColumn] = {}
    home_amsl_m = home.altitude_amsl_m
    altitude, height = grid.column("altitude_amsl_m"), grid.column("height_above_home_m")
    local = grid.column("local_height_m")
    if height is None and altitude is not None and home_amsl_m is not None:
        height = altitude.plus(-home_amsl_m)
    offset: float | None = None
    if local is not None:
        offset = (
            -(_first(local) or 0.0) if height is None else _median(height.values - local.values)
        )
        if offset is not None:
            lifted = local.plus(offset)
            height = lifted if height is None else height.else_from(lifted)
    if altitude is None and height is not None and home_amsl_m is not None:
        altitude = height.plus(home_amsl_m)
    reference = grid.column("reference_height_m")
    if reference is not None and offset is not None:
        columns["reference_height_m"] = reference.plus(offset)
    else:
        aim = grid.column("reference_altitude_amsl_m")
        if aim is not None and home_amsl_m is not None:
            columns["reference_height_m"] = aim.plus(-home_amsl_m)
        elif reference is not None and local is None:
            columns["reference_height_m"] = reference
    if altitude is not None:
        columns["altitude_amsl_m"] = altitude
    if height is not None:
        columns["height_above_home_m"] = height
    return columns


def _global_columns(grid: Grid, frame: LocalFrame | None) -> dict[str, GridColumn]:
    latitude, longitude = grid.column("latitude_deg"), grid.column("longitude_deg")
    if latitude is None or longitude is None:
        return {}
    wrapped = replace(longitude, values=_wrapped(longitude.values))
    columns = {"latitude_deg": latitude, "longitude_deg": wrapped}
    if frame is not None:
        columns["east_m"], columns["north_m"] = _in_frame(frame, latitude, longitude)
    return columns


def _local_columns(grid: Grid, known: GridColumn | None, axis: str) -> dict[str, GridColumn]:
    """Return a coordinate and its reference from the local frame; ``known`` gives its origin."""
    local, reference = grid.column(f"local_{axis}"), grid.column(f"reference_{axis}")
    if local is None:
        return {}
    offset = _first(local) if known is None else _median(local.values - known.values)
    if offset is None:
        return {}
    position = local.plus(-offset)
    columns = {axis: position if known is None else position.else_from(known)}
    if reference is not None:
        columns[f"reference_{axis}"] = reference.plus(-offset)
    return columns


def _global_reference(grid: Grid, frame: LocalFrame) -> dict[str, GridColumn]:
    latitude = grid.column("reference_latitude_deg")
    longitude = grid.column("reference_longitude_deg")
    if latitude is None or longitude is None:
        return {}
    east, north = _in_frame(frame, latitude, longitude)
    return {"reference_east_m": east, "reference_north_m": north}


def _in_frame(
    frame: LocalFrame, latitude: GridColumn, longitude: GridColumn
) -> tuple[GridColumn, GridColumn]:
    east_m, north_m = frame.east_north_m(latitude.values, longitude.values)
    return replace(longitude, values=east_m), replace(latitude, values=north_m)


def _wrapped(longitude_deg: Longitude) -> Longitude:
    return (longitude_deg + 180.0) % 360.0 - 180.0


def _first(column: GridColumn | None) -> float | None:
    if column is None:
        return None
    known = column.values[np.isfinite(column.values)]
    return float(known[0]) if len(known) else None


def _median(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None


_CALM_M_S = 1e-6
"""An autopilot that estimates no wind logs exactly none. [m s⁻¹]"""


def speed_columns(grid: Grid) -> dict[str, GridColumn]:
    """Return velocities and speeds, of the vehicle, its references and the wind, and the airspeed.

    What is logged directly is taken; a horizontal speed is the length of its velocity where that
    is known; the airspeed is the velocity through the wind where it is not measured.
    """
    names = (
        *("velocity_north_m_s", "velocity_east_m_s", "climb_m_s", "ground_speed_m_s"),
        *("reference_velocity_north_m_s", "reference_velocity_east_m_s", "reference_climb_m_s"),
        *("reference_speed_m_s", "airspeed_m_s"),
    )
    found = {name: grid.column(name) for name in names}
    columns = {name: column for name, column in found.items() if column is not None}
    for name, column in _velocity_by_course(grid, columns).items():
        columns[name] = columns[name].else_from(column) if name in columns else column
    columns |= _length(grid, columns, "velocity", "ground_speed_m_s")
    columns |= _length(grid, columns, "reference_velocity", "reference_speed_m_s")
    columns |= _wind(grid)
    if "airspeed_m_s" not in columns:
        columns |= _airspeed(grid, columns)
    return columns


def _velocity_by_course(grid: Grid, columns: dict[str, GridColumn]) -> dict[str, GridColumn]:
    speed, course = columns.get("ground_speed_m_s"), grid.column("course_deg")
    if speed is None or course is None:
        return {}
    direction = np.radians(course.values)
    found_in = f"{speed.found_in}, {course.found_in}"
    return {
        f"velocity_{axis}_m_s": grid.together(speed.values * part, found_in, speed, course)
        for axis, part in (("north", np.cos(direction)), ("east", np.sin(direction)))
    }


def _length(
    grid: Grid, columns: dict[str, GridColumn], what: str, name: str
) -> dict[str, GridColumn]:
    """Return the length of a horizontal velocity, where both components are known."""
    north, east = columns.get(f"{what}_north_m_s"), columns.get(f"{what}_east_m_s")
    if north is None or east is None:
        return {}
    length = grid.together(np.hypot(north.values, east.values), north.found_in, north, east)
    if not length.is_known:
        return {}
    return {name: length.else_from(columns[name]) if name in columns else length}


def _wind(grid: Grid) -> dict[str, GridColumn]:
    """Return the wind; an estimate of exactly none throughout is no estimate."""
    north, east = grid.column("wind_north_m_s"), grid.column("wind_east_m_s")
    if north is None or east is None:
        return {}
    is_known = np.any(np.hypot(north.values, east.values) > _CALM_M_S)
    return {"wind_north_m_s": north, "wind_east_m_s": east} if is_known else {}


def _airspeed(grid: Grid, columns: dict[str, GridColumn]) -> dict[str, GridColumn]:
    names = ("velocity_north_m_s", "velocity_east_m_s", "wind_north_m_s", "wind_east_m_s")
    if not all(name in columns for name in names):
        return {}
    north, east, wind_north, wind_east = (columns[name] for name in names)
    speed = np.hypot(north.values - wind_north.values, east.values - wind_east.values)
    found_in = f"{north.found_in}, {wind_north.found_in}"
    return {"airspeed_m_s": grid.together(speed, found_in, north, wind_north)}
