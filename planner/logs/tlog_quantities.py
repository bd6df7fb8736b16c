"""Which MAVLink message tells which quantity of a flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.logs.positions import electrical_series
from planner.logs.record import sources
from planner.logs.series import Series

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.arrays import BoolArray, FloatArray
    from planner.logs.record import Source
    from planner.logs.tlog import Messages

_E7, _MM, _CM = 1e-7, 1e-3, 1e-2
_DEG = float(np.degrees(1.0))
_UNKNOWN_MV, _UNKNOWN_CA = 65535, -1
_NO_POSITION, _NO_VELOCITY = 0b000_111, 0b111_000
"""Bits of POSITION_TARGET_TYPEMASK: fields to be ignored."""
_AMSL_FRAMES, _RELATIVE_FRAMES, _LOCAL_FRAME = (0, 5), (3, 6), 1


_POSITION, _LOCAL = "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"
_QUANTITIES: Mapping[str, tuple[Source, ...]] = {
    "altitude_amsl_m": sources(f"{_POSITION}.alt", unit=_MM),
    "height_above_home_m": sources(f"{_POSITION}.relative_alt", unit=_MM),
    "velocity_north_m_s": (*sources(f"{_POSITION}.vx", unit=_CM), *sources(f"{_LOCAL}.vx")),
    "velocity_east_m_s": (*sources(f"{_POSITION}.vy", unit=_CM), *sources(f"{_LOCAL}.vy")),
    "climb_m_s": (
        *sources(f"{_POSITION}.vz", unit=-_CM),
        *sources(f"{_LOCAL}.vz", unit=-1.0),
        *sources("VFR_HUD.climb"),
    ),
    "ground_speed_m_s": sources("VFR_HUD.groundspeed"),
    "local_north_m": sources(f"{_LOCAL}.x"),
    "local_east_m": sources(f"{_LOCAL}.y"),
    "local_height_m": sources(f"{_LOCAL}.z", unit=-1.0),
    "roll_deg": sources("ATTITUDE.roll", unit=_DEG),
    "pitch_deg": sources("ATTITUDE.pitch", unit=_DEG),
    "yaw_deg": (*sources("ATTITUDE.yaw", unit=_DEG), *sources("VFR_HUD.heading")),
    "wind_north_m_s": sources("WIND_COV.wind_x"),
    "wind_east_m_s": sources("WIND_COV.wind_y"),
}
"""Where each quantity stands, the best place first.

The airspeed of VFR_HUD is not used: without a sensor it is the ground speed under another name.
"""


def quantity_series(
    tables: Mapping[str, Messages], times: Mapping[str, FloatArray]
) -> tuple[dict[str, Series], dict[str, str]]:
    """Return every quantity that the messages tell, and what is wrong with some.

    Parameters
    ----------
    tables : mapping
        Messages by name.
    times : mapping
        Their times, by the same names. [s]

    Returns
    -------
    series : dict
        Quantities by the names :class:`~planner.logs.record.Recording` knows.
    remarks : dict
        Sentences by the names of columns.
    """
    series: dict[str, Series] = {}
    for name, places in _QUANTITIES.items():
        for source in places:
            table = tables.get(source.message)
            if table is not None and name not in series:
                series[name] = Series.of(
                    times[source.message],
                    table.numbers[source.field] * source.unit,
                    f"{source.message}.{source.field}",
                    period=360.0 if name == "yaw_deg" else None,
                )
    series |= _place(tables, times) | _wind(tables, times) | _references(tables, times)
    electrical, remarks = _electrical(tables, times)
    series |= electrical
    return {name: found for name, found in series.items() if len(found)}, remarks


def _place(tables: Mapping[str, Messages], times: Mapping[str, FloatArray]) -> dict[str, Series]:
    """Return latitude and longitude; zero and zero stands for no position."""
    table = tables.get(_POSITION)
    if table is None:
        return {}
    latitude, longitude = table.numbers["lat"], table.numbers["lon"]
    known = (latitude != 0.0) | (longitude != 0.0)
    time_s = times[_POSITION][known]
    return {
        "latitude_deg": Series.of(time_s, latitude[known] * _E7, f"{_POSITION}.lat"),
        "longitude_deg": Series.of(
            time_s, longitude[known] * _E7, f"{_POSITION}.lon", period=360.0
        ),
    }


def _wind(tables: Mapping[str, Messages], times: Mapping[str, FloatArray]) -> dict[str, Series]:
    """Return ArduPilot's wind, told by speed and the direction it comes from."""
    table = tables.get("WIND")
    if table is None:
        return {}
    speed, origin = table.numbers["speed"], np.radians(table.numbers["direction"])
    found_in = "WIND.speed, direction"
    return {
        "wind_north_m_s": Series.of(times["WIND"], -speed * np.cos(origin), found_in),
        "wind_east_m_s": Series.of(times["WIND"], -speed * np.sin(origin), found_in),
    }


def _references(
    tables: Mapping[str, Messages], times: Mapping[str, FloatArray]
) -> dict[str, Series]:
    """Return what the controller was told, from the local form if it is there, else the global."""
    series: dict[str, Series] = {}
    name = "POSITION_TARGET_GLOBAL_INT"
    if name in tables:
        numbers = tables[name].numbers
        frame, is_told = numbers["coordinate_frame"], _is_told(tables[name], _NO_POSITION)
        for column, field, unit, rows in (
            ("reference_latitude_deg", "lat_int", _E7, is_told),
            ("reference_longitude_deg", "lon_int", _E7, is_told),
            ("reference_altitude_amsl_m", "alt", 1.0, is_told & np.isin(frame, _AMSL_FRAMES)),
            ("reference_height_m", "alt", 1.0, is_told & np.isin(frame, _RELATIVE_FRAMES)),
        ):
            series[column] = Series.of(
                times[name][rows], numbers[field][rows] * unit, f"{name}.{field}"
            )
        series |= _reference_velocity(name, tables, times)
    name = "POSITION_TARGET_LOCAL_NED"
    if name in tables:
        numbers = tables[name].numbers
        rows = _is_told(tables[name], _NO_POSITION) & (numbers["coordinate_frame"] == _LOCAL_FRAME)
        for column, field, unit in (
            ("reference_north_m", "x", 1.0),
            ("reference_east_m", "y", 1.0),
            ("reference_height_m", "z", -1.0),
        ):
            series[column] = Series.of(
                times[name][rows], numbers[field][rows] * unit, f"{name}.{field}"
            )
        series |= _reference_velocity(name, tables, times)
    return series


def _reference_velocity(
    name: str, tables: Mapping[str, Messages], times: Mapping[str, FloatArray]
) -> dict[str, Series]:
    rows = _is_told(tables[name], _NO_VELOCITY)
    if not np.any(rows):
        return {}
    return {
        column: Series.of(
            times[name][rows], tables[name].numbers[field][rows] * unit, f"{name}.{field}"
        )
        for column, field, unit in (
            ("reference_velocity_north_m_s", "vx", 1.0),
            ("reference_velocity_east_m_s", "vy", 1.0),
            ("reference_climb_m_s", "vz", -1.0),
        )
    }


def _is_told(table: Messages, ignored: int) -> BoolArray:
    is_told: BoolArray = table.numbers["type_mask"].astype(np.int64) & ignored == 0
    return is_told


def _electrical(
    tables: Mapping[str, Messages], times: Mapping[str, FloatArray]
) -> tuple[dict[str, Series], dict[str, str]]:
    name, voltage_field = "SYS_STATUS", "voltage_battery"
    table = tables.get(name)
    if table is None or np.all(table.numbers[voltage_field] == _UNKNOWN_MV):
        name, voltage_field = "BATTERY_STATUS", "voltages"
        table = tables.get(name)
        if table is None:
            return {}, {}
    numbers = table.numbers
    rows = numbers["id"] == np.min(numbers["id"]) if "id" in numbers else slice(None)
    voltage_mv, current_ca = numbers[voltage_field][rows], numbers["current_battery"][rows]
    return electrical_series(
        times[name][rows],
        np.where(voltage_mv == _UNKNOWN_MV, np.nan, voltage_mv * 1e-3),
        np.where(current_ca == _UNKNOWN_CA, np.nan, current_ca * _CM),
        message=name,
        fields=(voltage_field, "current_battery"),
    )
