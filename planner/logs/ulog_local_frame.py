"""PX4's local frame, whose origin may move: positions and references in one frame for good."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.geo.local_frame import LocalFrame
from planner.logs.series import Series

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.logs.record import FloatArray
    from planner.logs.ulog_topics import Topic

_POSITIONS = "vehicle_local_position"
_ORIGIN = ("ref_lat", "ref_lon", "ref_alt")
_REFERENCES = (
    ("trajectory_setpoint", ("position[0]", "position[1]", "position[2]")),
    ("trajectory_setpoint", ("x", "y", "z")),
    ("vehicle_local_position_setpoint", ("x", "y", "z")),
)
"""Where the position told to the controller stands, the best place first."""
_AXES = ("north_m", "east_m", "height_m")


def local_series(topics: Mapping[str, Topic]) -> dict[str, Series]:
    """Return positions and references in the frame of the first origin.

    Parameters
    ----------
    topics : mapping
        The first instance of each topic, by name.

    Returns
    -------
    dict
        ``local_…`` and ``reference_…`` series north, east and up; latitude, longitude and
        altitude by the frame, under ``latitude_deg`` and so on, where it has an origin.
    """
    topic = topics.get(_POSITIONS)
    if topic is None or not {"x", "y", "z"} <= topic.fields.keys():
        return {}
    frame, offsets = _origins(topic)
    series: dict[str, Series] = {}
    for axis, field, valid in zip(
        _AXES, ("x", "y", "z"), ("xy_valid", "xy_valid", "z_valid"), strict=True
    ):
        values = _upwards(topic.fields[field], axis) + offsets[axis]
        if valid in topic.fields:
            values = np.where(topic.fields[valid] != 0.0, values, np.nan)
        series[f"local_{axis}"] = Series.of(topic.time_s, values, f"{_POSITIONS}.{field}")
    origin = {axis: Series.of(topic.time_s, offsets[axis], "", is_event=True) for axis in _AXES}
    series |= _references(topics, origin)
    if frame is not None:
        series |= _global(topic, frame, series)
    return {name: found for name, found in series.items() if len(found)}


def position_jumps(topics: Mapping[str, Topic]) -> tuple[tuple[float, float], ...]:
    """Return time and size in metres of each reset of the estimate."""
    topic = topics.get(_POSITIONS)
    jumps: list[tuple[float, float]] = []
    for counter, deltas in (
        ("xy_reset_counter", ("delta_xy[0]", "delta_xy[1]")),
        ("z_reset_counter", ("delta_z",)),
    ):
        if topic is None or not {counter, *deltas} <= topic.fields.keys():
            continue
        resets = np.flatnonzero(np.diff(topic.fields[counter])) + 1
        squares = [topic.fields[delta][resets] ** 2 for delta in deltas]
        sizes_m = np.sqrt(np.sum(squares, axis=0))
        jumps += zip(topic.time_s[resets].tolist(), sizes_m.tolist(), strict=True)
    return tuple(sorted(jumps))


def _origins(topic: Topic) -> tuple[LocalFrame | None, dict[str, FloatArray]]:
    """Return the frame about the first origin, and where each sample's origin lies in it."""
    offsets = {axis: np.zeros(topic.time_s.shape) for axis in _AXES}
    if not set(_ORIGIN) <= topic.fields.keys():
        return None, offsets
    latitude, longitude, altitude = (topic.fields[field] for field in _ORIGIN)
    known = np.isfinite(latitude) & np.isfinite(longitude) & np.isfinite(altitude)
    known &= (np.abs(latitude) <= 90.0) & ((latitude != 0.0) | (longitude != 0.0))
    if "xy_global" in topic.fields:
        known &= topic.fields["xy_global"] != 0.0
    if not np.any(known):
        return None, offsets
    first = int(np.argmax(known))
    frame = LocalFrame(latitude_deg=float(latitude[first]), longitude_deg=float(longitude[first]))
    moved = known & ((latitude != latitude[first]) | (longitude != longitude[first]))
    offsets["east_m"][moved], offsets["north_m"][moved] = frame.east_north_m(
        latitude[moved], longitude[moved]
    )
    offsets["height_m"][known] = altitude[known] - altitude[first]
    return frame, offsets


def _references(topics: Mapping[str, Topic], origin: Mapping[str, Series]) -> dict[str, Series]:
    for name, fields in _REFERENCES:
        topic = topics.get(name)
        if topic is None or not set(fields) <= topic.fields.keys():
            continue
        series = {}
        for axis, field in zip(_AXES, fields, strict=True):
            offset = np.nan_to_num(origin[axis].at(topic.time_s), nan=0.0)
            values = _upwards(topic.fields[field], axis) + offset
            series[f"reference_{axis}"] = Series.of(topic.time_s, values, f"{name}.{field}")
        if any(len(found) for found in series.values()):
            return series
    return {}


def _global(topic: Topic, frame: LocalFrame, local: Mapping[str, Series]) -> dict[str, Series]:
    """Return global positions from local ones; used where PX4 logs no global position."""
    north, east = local["local_north_m"], local["local_east_m"]
    if len(north) != len(east):
        return {}
    latitude_deg, longitude_deg = frame.latitude_longitude_deg(east.values, north.values)
    altitude = topic.fields["ref_alt"]
    height = local["local_height_m"]
    first_amsl_m = altitude[np.argmax(np.isfinite(altitude))]
    found_in = f"{_POSITIONS}.x, y, ref"
    return {
        "latitude_deg": Series.of(north.time_s, latitude_deg, found_in),
        "longitude_deg": Series.of(north.time_s, longitude_deg, found_in, period=360.0),
        "altitude_amsl_m": Series.of(
            height.time_s, height.values + first_amsl_m, f"{_POSITIONS}.z, ref_alt"
        ),
    }


def _upwards(values: FloatArray, axis: str) -> FloatArray:
    """Return a coordinate positive upwards; the log counts z downwards."""
    return -values if axis == "height_m" else values
