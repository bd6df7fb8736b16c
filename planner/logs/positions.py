"""Where the vehicle and its references were, from home: positions and heights of one flight."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

from planner.geo.geodesy import LocalFrame
from planner.logs.record import LoggedHome
from planner.logs.series import Series
from planner.values import replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.logs.series import Column, Grid


Longitude = TypeVar("Longitude", float, "FloatArray")

_HOME_AFTER_S = 2.0
"""An autopilot sets home when it is armed; the message may come this much later. [s]"""


def home_of(grid: Grid) -> LoggedHome:
    """Return the home of a flight: as it is logged, completed by where the flight begins.

    Parameters
    ----------
    grid : Grid
        The flight.

    Returns
    -------
    LoggedHome
        The home set last before the flight, or at its beginning; else the place it begins at.
    """
    set_before = [
        home for time_s, home in grid.recording.homes if time_s <= grid.span.begin_s + _HOME_AFTER_S
    ]
    logged = set_before[-1] if set_before else None
    if logged is None:
        latitude_deg = _first(grid.column("latitude_deg"))
        longitude_deg = _first(grid.column("longitude_deg"))
        is_known = latitude_deg is not None and longitude_deg is not None
        logged = LoggedHome(
            latitude_deg=latitude_deg if is_known else None,
            longitude_deg=None
            if longitude_deg is None or not is_known
            else _wrapped(longitude_deg),
            altitude_amsl_m=None,
            found_in="the beginning of the flight",
        )
    if logged.altitude_amsl_m is not None:
        return logged
    altitude, height = grid.column("altitude_amsl_m"), grid.column("height_above_home_m")
    if altitude is not None and height is not None:
        return replace(logged, altitude_amsl_m=_median(altitude.values - height.values))
    return replace(logged, altitude_amsl_m=_first(altitude))


def position_columns(grid: Grid, home: LoggedHome) -> dict[str, Column]:
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


def height_columns(grid: Grid, home: LoggedHome) -> dict[str, Column]:
    """Return altitude and height above home, of the vehicle, and the height of its reference."""
    columns: dict[str, Column] = {}
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


def _global_columns(grid: Grid, frame: LocalFrame | None) -> dict[str, Column]:
    latitude, longitude = grid.column("latitude_deg"), grid.column("longitude_deg")
    if latitude is None or longitude is None:
        return {}
    wrapped = replace(longitude, values=_wrapped(longitude.values))
    columns = {"latitude_deg": latitude, "longitude_deg": wrapped}
    if frame is not None:
        columns["east_m"], columns["north_m"] = _in_frame(frame, latitude, longitude)
    return columns


def _local_columns(grid: Grid, known: Column | None, axis: str) -> dict[str, Column]:
    """Return a coordinate and its reference from the local frame; ``known`` tells its origin."""
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


def _global_reference(grid: Grid, frame: LocalFrame) -> dict[str, Column]:
    latitude, longitude = (
        grid.column(f"reference_{axis}_deg") for axis in ("latitude", "longitude")
    )
    if latitude is None or longitude is None:
        return {}
    east, north = _in_frame(frame, latitude, longitude)
    return {"reference_east_m": east, "reference_north_m": north}


def _in_frame(frame: LocalFrame, latitude: Column, longitude: Column) -> tuple[Column, Column]:
    """Return the columns east and north."""
    east_m, north_m = frame.east_north_m(latitude.values, longitude.values)
    return replace(longitude, values=east_m), replace(latitude, values=north_m)


def _wrapped(longitude_deg: Longitude) -> Longitude:
    return (longitude_deg + 180.0) % 360.0 - 180.0


def _first(column: Column | None) -> float | None:
    """Return the first value that is known."""
    if column is None:
        return None
    known = column.values[np.isfinite(column.values)]
    return float(known[0]) if len(known) else None


def _median(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None


_CALM_M_S = 1e-6
"""An autopilot that estimates no wind logs exactly none. [m s⁻¹]"""


def speed_columns(grid: Grid) -> dict[str, Column]:
    """Return velocities and speeds, of the vehicle, its references and the wind, and the airspeed.

    What is logged directly is taken; a horizontal speed is the length of its velocity where that
    is known; the airspeed is the velocity through the wind where it is not measured.
    """
    names = (
        "velocity_north_m_s",
        "velocity_east_m_s",
        "climb_m_s",
        "ground_speed_m_s",
        "airspeed_m_s",
        "reference_velocity_north_m_s",
        "reference_velocity_east_m_s",
        "reference_climb_m_s",
        "reference_speed_m_s",
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


def _velocity_by_course(grid: Grid, columns: dict[str, Column]) -> dict[str, Column]:
    speed, course = columns.get("ground_speed_m_s"), grid.column("course_deg")
    if speed is None or course is None:
        return {}
    direction = np.radians(course.values)
    found_in = f"{speed.found_in}, {course.found_in}"
    return {
        "velocity_north_m_s": grid.together(
            speed.values * np.cos(direction), found_in, speed, course
        ),
        "velocity_east_m_s": grid.together(
            speed.values * np.sin(direction), found_in, speed, course
        ),
    }


def _length(grid: Grid, columns: dict[str, Column], what: str, name: str) -> dict[str, Column]:
    """Return the length of a horizontal velocity, where both components are known."""
    north, east = columns.get(f"{what}_north_m_s"), columns.get(f"{what}_east_m_s")
    if north is None or east is None:
        return {}
    length = grid.together(np.hypot(north.values, east.values), north.found_in, north, east)
    if not length.is_known:
        return {}
    return {name: length.else_from(columns[name]) if name in columns else length}


def _wind(grid: Grid) -> dict[str, Column]:
    """Return the wind; an estimate of exactly none throughout is no estimate."""
    north, east = grid.column("wind_north_m_s"), grid.column("wind_east_m_s")
    if north is None or east is None:
        return {}
    speeds = np.hypot(north.values, east.values)
    if not np.any(speeds > _CALM_M_S):
        return {}
    return {"wind_north_m_s": north, "wind_east_m_s": east}


def _airspeed(grid: Grid, columns: dict[str, Column]) -> dict[str, Column]:
    names = ("velocity_north_m_s", "velocity_east_m_s", "wind_north_m_s", "wind_east_m_s")
    if not all(name in columns for name in names):
        return {}
    north, east, wind_north, wind_east = (columns[name] for name in names)
    speed = np.hypot(north.values - wind_north.values, east.values - wind_east.values)
    found_in = f"{north.found_in}, {wind_north.found_in}"
    return {"airspeed_m_s": grid.together(speed, found_in, north, wind_north)}


NO_CURRENT_A = 0.2
"""No multirotor flies on less; a sensor that never shows more is none. [A]"""
_NO_VOLTAGE_V = 0.5
"""A monitor that never shows more is not connected. [V]"""


def electrical_series(
    time_s: FloatArray,
    voltage_v: FloatArray | None,
    current_a: FloatArray | None,
    *,
    message: str,
    fields: tuple[str, str],
) -> tuple[dict[str, Series], dict[str, str]]:
    """Return voltage, current and power of one battery message, and what is wrong with them.

    Parameters
    ----------
    time_s : ndarray
        Times of the messages. [s]
    voltage_v, current_a : ndarray, optional
        Voltage and current of each, NaN where not known; ``None`` where the message has none.
    message : str
        Its name; empty for columns of a file.
    fields : tuple of str
        Names of its fields for voltage and current.

    Returns
    -------
    series : dict
        ``voltage_v``, ``current_a`` and ``power_w``, as far as a sensor is there.
    remarks : dict
        Sentences by the same names, where none is.
    """
    of_voltage, of_current = (f"{message}.{field}" if message else field for field in fields)
    series: dict[str, Series] = {}
    remarks: dict[str, str] = {}
    if voltage_v is not None:
        # A monitor that has measured nothing yet shows zero.
        voltage_v = np.where(voltage_v > _NO_VOLTAGE_V, voltage_v, np.nan)
        if np.isfinite(voltage_v).any():
            series["voltage_v"] = Series.of(time_s, voltage_v, of_voltage)
        else:
            remarks["voltage_v"] = (
                f"{of_voltage} never exceeds {_NO_VOLTAGE_V:g} V: no voltage sensor"
            )
    if current_a is not None:
        if np.any(current_a > NO_CURRENT_A):
            series["current_a"] = Series.of(time_s, current_a, of_current)
        else:
            remarks["current_a"] = (
                f"{of_current} never exceeds {NO_CURRENT_A:g} A: no current sensor"
            )
    if voltage_v is not None and current_a is not None and len(series) == 2:
        power = Series.of(time_s, voltage_v * current_a, f"{of_voltage} × {fields[1]}")
        if len(power):
            series["power_w"] = power
    return series, remarks


def euler_angles_deg(
    w: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return roll, pitch and yaw of a rotation from the body to its frame of reference.

    The order of rotation is yaw, pitch, roll, about axes forward, right, down in a frame north,
    east, down (Diebel, "Representing Attitude", 2006, section 8.2).

    Parameters
    ----------
    w, x, y, z : ndarray
        Unit quaternions, scalar first.

    Returns
    -------
    roll_deg, pitch_deg, yaw_deg : ndarray
        Roll and yaw in [−180, 180], pitch in [−90, 90]. [°]
    """
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.degrees(roll), np.degrees(pitch), np.degrees(yaw)
