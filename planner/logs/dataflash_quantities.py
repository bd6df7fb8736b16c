"""Which DataFlash message tells which quantity: names and units of every ArduPilot since 3.1.

Sources: ArduPilot's log documentation and structures (``LogStructure.h`` of the libraries,
``Log.cpp`` of Copter), compared with logs of Copter 3.1, 3.3, 3.4 and 4.7.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.catalogue.flight_log import BATTERIES_LEFT_OUT
from planner.logs.electrical import NO_CURRENT_A, electrical_series
from planner.logs.series import Series
from planner.logs.source import sources

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.logs.dataflash_messages import MessageTable
    from planner.logs.record import BoolArray, FloatArray
    from planner.logs.source import Source


_CM = 1e-2
"""Old navigation messages are in centimetres, climb rates in them to this day."""


_QUANTITIES: Mapping[str, tuple[Source, ...]] = {
    "roll_deg": sources("ATT.Roll"),
    "pitch_deg": sources("ATT.Pitch"),
    "yaw_deg": sources("ATT.Yaw"),
    "airspeed_m_s": sources("ARSP.Airspeed"),
    "altitude_amsl_m": sources("POS.Alt", "GPS.Alt"),
    "height_above_home_m": sources("POS.RelHomeAlt", "POS.RelAlt", "GPS.RelAlt"),
    "local_height_m": (
        *sources("PSCD.PD", unit=-1.0),
        *sources("PSCZ.PZ", "CTUN.Alt"),
    ),
    "reference_height_m": (
        *sources("PSCD.TPD", unit=-1.0),
        *sources("PSCZ.TPZ", "CTUN.DAlt"),
    ),
    "reference_climb_m_s": (
        *sources("PSCD.DVD", unit=-1.0),
        *sources("PSCZ.DVZ"),
        *sources("CTUN.DCRt", unit=_CM),
    ),
    "local_north_m": (*sources("PSCN.PN", "PSC.PX"), *sources("NTUN.PosX", unit=_CM)),
    "local_east_m": (*sources("PSCE.PE", "PSC.PY"), *sources("NTUN.PosY", unit=_CM)),
    "reference_north_m": (*sources("PSCN.TPN", "PSC.TPX"), *sources("NTUN.DPosX", unit=_CM)),
    "reference_east_m": (*sources("PSCE.TPE", "PSC.TPY"), *sources("NTUN.DPosY", unit=_CM)),
    "reference_velocity_north_m_s": (
        *sources("PSCN.DVN", "PSC.TVX"),
        *sources("NTUN.DVelX", unit=_CM),
    ),
    "reference_velocity_east_m_s": (
        *sources("PSCE.DVE", "PSC.TVY"),
        *sources("NTUN.DVelY", unit=_CM),
    ),
    "climb_m_s": (
        *sources("XKF1.VD", "NKF1.VD", "EKF1.VD", "PSCD.VD", unit=-1.0),
        *sources("PSCZ.VZ"),
        *sources("CTUN.CRt", unit=_CM),
        *sources("GPS.VZ", unit=-1.0),
    ),
    "velocity_north_m_s": (
        *sources("XKF1.VN", "NKF1.VN", "EKF1.VN", "PSCN.VN", "PSC.VX"),
        *sources("NTUN.VelX", unit=_CM),
    ),
    "velocity_east_m_s": (
        *sources("XKF1.VE", "NKF1.VE", "EKF1.VE", "PSCE.VE", "PSC.VY"),
        *sources("NTUN.VelY", unit=_CM),
    ),
    "ground_speed_m_s": sources("GPS.Spd"),
    "course_deg": sources("GPS.GCrs"),
    "wind_north_m_s": sources("XKF2.VWN", "NKF2.VWN", "EKF2.VWN"),
    "wind_east_m_s": sources("XKF2.VWE", "NKF2.VWE", "EKF2.VWE"),
}
"""Where each quantity stands, the best place first.

References are the path as it is shaped (D for desired), not with the correction of the position
error on top (T for target), which follows the vehicle as much as it leads it.
"""

_PERIODS = {"yaw_deg": 360.0, "course_deg": 360.0, "longitude_deg": 360.0}
_INSTANCES = ("I", "C", "Inst", "Instance")
"""Fields that number sensors and estimator cores."""
_BATTERIES = ("BAT", "CURR")
_MORE_BATTERIES = ("BAT2", "CUR2")
_FIX_3D = 3


def first_instance(table: MessageTable) -> BoolArray:
    """Return which messages are of the first sensor or estimator core."""
    for field in _INSTANCES:
        if field in table.numbers and len(table.places):
            numbers = table.numbers[field]
            is_first: BoolArray = numbers == numbers.min()
            return is_first
    return np.ones(table.places.shape, np.bool_)


def quantity_series(
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]
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
        Quantities by the names :class:`~planner.logs.recording.Recording` knows.
    remarks : dict
        Sentences by the names of columns.
    """
    valid = {name: first_instance(table) for name, table in tables.items()}
    if "GPS" in tables and "Status" in tables["GPS"].numbers:
        valid["GPS"] = valid["GPS"] & (tables["GPS"].numbers["Status"] >= _FIX_3D)
    series: dict[str, Series] = {}
    for name, places in _QUANTITIES.items():
        for source in places:
            found = _series(source, tables, times, valid, period=_PERIODS.get(name))
            if found is not None:
                series[name] = found
                break
    series |= _place(tables, times, valid)
    electrical, remarks = _electrical(tables, times, valid)
    return series | electrical, remarks


def other_batteries(tables: Mapping[str, MessageTable], source: str) -> Iterator[Finding]:
    """Return a finding where batteries other than the first give current."""
    others: dict[str, float] = {}
    for name in _MORE_BATTERIES:
        if name in tables and "Curr" in tables[name].numbers:
            others[name] = _most(_current_a(tables[name]))
    for name in _BATTERIES:
        if name in tables and "Curr" in tables[name].numbers:
            rest = ~first_instance(tables[name])
            others[f"{name} of another instance"] = _most(_current_a(tables[name])[rest])
    shown = {name: current for name, current in others.items() if current > NO_CURRENT_A}
    if shown:
        name, current_a = max(shown.items(), key=lambda item: item[1])
        yield BATTERIES_LEFT_OUT.finding(
            f"{source}: {name} shows up to {current_a:.1f} A; only the first battery is used"
        )


def _most(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.max(known, initial=0.0))


def _series(
    source: Source,
    tables: Mapping[str, MessageTable],
    times: Mapping[str, FloatArray],
    valid: Mapping[str, BoolArray],
    *,
    period: float | None,
) -> Series | None:
    table = tables.get(source.message)
    if table is None or source.field not in table.numbers:
        return None
    if source.message == "CTUN" and "DAlt" not in table.numbers:
        return None  # a plane's message of the same name
    rows = valid[source.message]
    series = Series.of(
        times[source.message][rows],
        table.numbers[source.field][rows] * source.unit,
        f"{source.message}.{source.field}",
        period=period,
    )
    return series if len(series) else None


def _place(
    tables: Mapping[str, MessageTable],
    times: Mapping[str, FloatArray],
    valid: Mapping[str, BoolArray],
) -> dict[str, Series]:
    """Return latitude and longitude; zero and zero stands for no position."""
    for name in ("POS", "GPS"):
        table = tables.get(name)
        if table is None or not {"Lat", "Lng"} <= table.numbers.keys():
            continue
        latitude, longitude = table.numbers["Lat"], table.numbers["Lng"]
        rows = valid[name] & ((latitude != 0.0) | (longitude != 0.0))
        if np.any(rows):
            return {
                column: Series.of(
                    times[name][rows],
                    values[rows],
                    f"{name}.{field}",
                    period=_PERIODS.get(column),
                )
                for column, values, field in (
                    ("latitude_deg", latitude, "Lat"),
                    ("longitude_deg", longitude, "Lng"),
                )
            }
    return {}


def _current_a(table: MessageTable) -> FloatArray:
    return table.numbers["Curr"] * _electrical_unit(table, "Curr")


def _electrical_unit(table: MessageTable, field: str) -> float:
    """Return the unit of a field: Copter 3 wrote hundredths as plain integers."""
    return _CM if table.letter(field) in "hH" else 1.0


def _electrical(
    tables: Mapping[str, MessageTable],
    times: Mapping[str, FloatArray],
    valid: Mapping[str, BoolArray],
) -> tuple[dict[str, Series], dict[str, str]]:
    for name in _BATTERIES:
        table = tables.get(name)
        if table is None or "Volt" not in table.numbers:
            continue
        rows = valid[name]
        voltage_v = table.numbers["Volt"] * _electrical_unit(table, "Volt")
        current_a = _current_a(table)[rows] if "Curr" in table.numbers else None
        return electrical_series(
            times[name][rows],
            voltage_v[rows],
            current_a,
            message=name,
            fields=("Volt", "Curr"),
        )
    return {}, {}
