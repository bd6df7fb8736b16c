"""Where the vehicle and its references were, from home: positions and heights of one flight."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from planner.geo.local_frame import LocalFrame
from planner.logs.record import LoggedHome

if TYPE_CHECKING:
    from planner.logs.grid import Column, Grid
    from planner.logs.record import FloatArray

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
