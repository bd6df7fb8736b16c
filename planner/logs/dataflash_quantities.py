"""Which DataFlash message holds which quantity: names and units of every ArduPilot since 3.1.

Sources: ArduPilot's log documentation and structures (``LogStructure.h`` of the libraries,
``Log.cpp`` of Copter), compared with logs of Copter 3.1, 3.3, 3.4 and 4.7.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from planner.logs.record import (
    AUTO,
    BATTERIES_LEFT_OUT,
    LoggedHome,
    LoggedItem,
    copter_mode,
    sources,
)
from planner.logs.series import NO_CURRENT_A, Series, electrical_series

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.arrays import BoolArray, FloatArray
    from planner.findings import Finding
    from planner.logs.dataflash import DataflashTable
    from planner.logs.record import Source


_CM = 1e-2
"""Old navigation messages are in centimetres, climb rates in them to this day."""


_QUANTITIES: Mapping[str, tuple[Source, ...]] = {
    "roll_deg": sources("ATT.Roll"),
    "pitch_deg": sources("ATT.Pitch"),
    "yaw_deg": sources("ATT.Yaw"),
    "airspeed_m_s": sources("ARSP.Airspeed"),
    "altitude_amsl_m": sources("POS.Alt", "GPS.Alt"),
    "height_above_home_m": sources("POS.RelHomeAlt", "POS.RelAlt", "GPS.RelAlt"),
    "local_height_m": (*sources("PSCD.PD", unit=-1.0), *sources("PSCZ.PZ", "CTUN.Alt")),
    "reference_height_m": (*sources("PSCD.TPD", unit=-1.0), *sources("PSCZ.TPZ", "CTUN.DAlt")),
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
"""Where each quantity is found, the best place first.

References are the path as it is shaped (D for desired), not with the correction of the position
error on top (T for target), which follows the vehicle as much as it leads it.
"""

_PERIODS = {"yaw_deg": 360.0, "course_deg": 360.0, "longitude_deg": 360.0}
_INSTANCES = ("I", "C", "Inst", "Instance")
"""Fields that number sensors and estimator cores."""
_BATTERIES = ("BAT", "CURR")
_MORE_BATTERIES = ("BAT2", "CUR2")
_FIX_3D = 3


def first_instance(table: DataflashTable) -> BoolArray:
    """Return which messages are of the first sensor or estimator core."""
    for field in _INSTANCES:
        if field in table.numbers and len(table.places):
            numbers = table.numbers[field]
            is_first: BoolArray = numbers == numbers.min()
            return is_first
    return np.ones(table.places.shape, np.bool_)


def quantity_series(
    tables: Mapping[str, DataflashTable], times: Mapping[str, FloatArray]
) -> tuple[dict[str, Series], dict[str, str]]:
    """Return every quantity in the messages, and what is wrong with some."""
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


def other_batteries(tables: Mapping[str, DataflashTable], source: str) -> Iterator[Finding]:
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
    tables: Mapping[str, DataflashTable],
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
    tables: Mapping[str, DataflashTable],
    times: Mapping[str, FloatArray],
    valid: Mapping[str, BoolArray],
) -> dict[str, Series]:
    """Return latitude and longitude; zero and zero means no position."""
    for name in ("POS", "GPS"):
        table = tables.get(name)
        if table is None or not {"Lat", "Lng"} <= table.numbers.keys():
            continue
        latitude, longitude = table.numbers["Lat"], table.numbers["Lng"]
        rows = valid[name] & ((latitude != 0.0) | (longitude != 0.0))
        if np.any(rows):
            return {
                column: Series.of(
                    times[name][rows], values[rows], f"{name}.{field}", period=_PERIODS.get(column)
                )
                for column, values, field in (
                    ("latitude_deg", latitude, "Lat"),
                    ("longitude_deg", longitude, "Lng"),
                )
            }
    return {}


def _current_a(table: DataflashTable) -> FloatArray:
    return table.numbers["Curr"] * _electrical_unit(table, "Curr")


def _electrical_unit(table: DataflashTable, field: str) -> float:
    """Return the unit of a field: Copter 3 wrote hundredths as plain integers."""
    return _CM if table.letter(field) in "hH" else 1.0


def _electrical(
    tables: Mapping[str, DataflashTable],
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
            times[name][rows], voltage_v[rows], current_a, message=name, fields=("Volt", "Curr")
        )
    return {}, {}


# Event numbers of EV: LogEvent in AP_Logger.h
_ARMED, _DISARMED = 10, 11
_LANDED, _NOT_LANDED = 18, 28
_AHRS_HOME = 1
"""Type of ORGN that is home, not the origin of the estimator."""
_FIRMWARE = re.compile(r"\S*(Copter|Plane|Rover|Sub|Heli|Blimp|Tracker)\S* V\d\S*.*")
_FRAME = "Frame: "


def armed_events(
    tables: Mapping[str, DataflashTable], times: Mapping[str, FloatArray]
) -> Series | None:
    """Return when the motors were armed and disarmed; ``None`` where that is not logged."""
    for name, field in (("ARM", "ArmState"), ("EV", "Id"), ("STAT", "Armed")):
        table = tables.get(name)
        if table is None or field not in table.numbers:
            continue
        values = table.numbers[field]
        found_in = f"{name}.{field}"
        if name == "EV":
            events = _two_events(times[name], values, _ARMED, _DISARMED, found_in)
        else:
            events = Series.of(times[name], values != 0.0, found_in, is_event=True)
        if len(events):
            return events
    return None


def landed_events(
    tables: Mapping[str, DataflashTable], times: Mapping[str, FloatArray]
) -> Series | None:
    """Return when the landing detector saw landing and take-off; ``None`` where it is not logged."""
    table = tables.get("EV")
    if table is None or "Id" not in table.numbers:
        return None
    events = _two_events(times["EV"], table.numbers["Id"], _LANDED, _NOT_LANDED, "EV.Id")
    return events if len(events) else None


def firmware_and_frame(tables: Mapping[str, DataflashTable]) -> tuple[str, str]:
    """Return the firmware's name and version, and the frame, empty where they are not logged."""
    messages = tables["MSG"].texts.get("Message", ()) if "MSG" in tables else ()
    firmware = next((text for text in messages if _FIRMWARE.fullmatch(text)), "")
    frame = next((text for text in messages if text.startswith(_FRAME)), "")
    return firmware, frame.removeprefix(_FRAME)


def modes(
    tables: Mapping[str, DataflashTable], times: Mapping[str, FloatArray], firmware: str
) -> tuple[tuple[float, str], ...]:
    """Return times and names of the modes; those of other vehicles than copters stay numbers."""
    table = tables.get("MODE")
    if table is None:
        return ()
    is_copter = not firmware or "Copter" in firmware
    names: list[str] = []
    if "Mode" in table.texts and "ModeNum" not in table.numbers:
        names = [_mode_name(text, is_copter=is_copter) for text in table.texts["Mode"]]
    else:
        field = "ModeNum" if "ModeNum" in table.numbers else "Mode"
        numbers = table.numbers.get(field, np.empty(0)).astype(np.int64).tolist()
        names = [copter_mode(number) if is_copter else f"mode {number}" for number in numbers]
    return tuple(zip(times["MODE"].tolist(), names, strict=False))


def missions(
    tables: Mapping[str, DataflashTable], times: Mapping[str, FloatArray]
) -> tuple[tuple[float, tuple[LoggedItem, ...]], ...]:
    """Return the missions that were on board, each from when its list was logged."""
    table = tables.get("CMD")
    if table is None or "CNum" not in table.numbers:
        return ()
    numbers = table.numbers["CNum"].astype(np.int64)
    lists: list[tuple[float, tuple[LoggedItem, ...]]] = []
    for begin, end in _lists(numbers):
        items = tuple(_item(table, row) for row in range(begin + 1, end))
        if items:
            lists.append((float(times["CMD"][begin]), items))
    return tuple(lists)


def mission_item_events(
    tables: Mapping[str, DataflashTable],
    times: Mapping[str, FloatArray],
    entered: tuple[tuple[float, str], ...],
) -> Series | None:
    """Return when which item was begun; 0 where the vehicle leaves the mission for another mode.

    Firmware from 4.6 logs MISE for each item begun, older ones CMD; both may send
    ``Mission: 3 WP`` as text besides.  What is begun before the log begins is not logged: the
    item before the first one is assumed to have been flown until then.
    """
    found_in, begun_s, items = _begun(tables, times)
    if not len(items):
        return None
    mode_s = np.array([time_s for time_s, _ in entered])
    is_auto = np.array([name == AUTO for _, name in entered], np.bool_)
    if len(is_auto) and is_auto[0] and mode_s[0] < begun_s[0] and items[0] > 1:
        begun_s, items = np.append(mode_s[0], begun_s), np.append(items[0] - 1.0, items)
    left_s = mode_s[~is_auto]
    return Series.of(
        np.append(left_s, begun_s),
        np.append(np.zeros(left_s.shape), items),
        found_in,
        is_event=True,
    )


def homes(
    tables: Mapping[str, DataflashTable], times: Mapping[str, FloatArray]
) -> tuple[tuple[float, LoggedHome], ...]:
    """Return the homes set: ORGN, else the row before the first of the mission."""
    found: list[tuple[float, LoggedHome]] = []
    for name, field, number in (("ORGN", "Type", _AHRS_HOME), ("CMD", "CNum", 0)):
        table = tables.get(name)
        if table is None or not {field, "Lat", "Lng", "Alt"} <= table.numbers.keys():
            continue
        for row in np.flatnonzero(table.numbers[field] == number).tolist():
            latitude, longitude, altitude = (
                float(table.numbers[column][row]) for column in ("Lat", "Lng", "Alt")
            )
            if not 0.0 < abs(latitude) <= 90.0:
                continue
            home = LoggedHome(
                latitude_deg=latitude,
                longitude_deg=longitude,
                altitude_amsl_m=altitude or None,  # Copter before 3.3 wrote zero
                found_in=name,
            )
            found.append((float(times[name][row]), home))
        if found:
            break
    return tuple(found)


def parameters(
    tables: Mapping[str, DataflashTable], times: Mapping[str, FloatArray]
) -> tuple[tuple[float, str, float], ...]:
    """Return time, name and value of each parameter reported."""
    table = tables.get("PARM")
    if table is None or "Name" not in table.texts or "Value" not in table.numbers:
        return ()
    values = table.numbers["Value"].tolist()
    return tuple(
        row
        for row in zip(times["PARM"].tolist(), table.texts["Name"], values, strict=True)
        if np.isfinite(row[2])
    )


def _two_events(
    time_s: FloatArray, numbers: FloatArray, one: int, zero: int, found_in: str
) -> Series:
    chosen = (numbers == one) | (numbers == zero)
    return Series.of(time_s[chosen], numbers[chosen] == one, found_in, is_event=True)


def _mode_name(text: str, *, is_copter: bool) -> str:
    if not text.isdigit():
        return text
    return copter_mode(int(text)) if is_copter else f"mode {text}"


def _lists(numbers: np.ndarray[tuple[int], np.dtype[np.int64]]) -> list[tuple[int, int]]:
    """Return the rows of whole missions: each begins at 0, home, and counts on."""
    found: list[tuple[int, int]] = []
    row = 0
    while row < len(numbers):
        begin = row
        row += 1
        if numbers[begin] == 0:
            while row < len(numbers) and numbers[row] == numbers[row - 1] + 1:
                row += 1
            found.append((begin, row))
    return found


def _begun(
    tables: Mapping[str, DataflashTable], times: Mapping[str, FloatArray]
) -> tuple[str, FloatArray, FloatArray]:
    """Return the message found, times and numbers of the items begun."""
    if "MISE" in tables and "CNum" in tables["MISE"].numbers:
        return "MISE.CNum", times["MISE"], tables["MISE"].numbers["CNum"]
    if "CMD" in tables and "CNum" in tables["CMD"].numbers:
        numbers = tables["CMD"].numbers["CNum"]
        is_begun = np.ones(numbers.shape, np.bool_)
        for begin, end in _lists(numbers.astype(np.int64)):
            is_begun[begin:end] = False
        if np.any(is_begun):
            return "CMD.CNum", times["CMD"][is_begun], numbers[is_begun]
    begun: list[tuple[float, float]] = []
    if "MSG" in tables:
        for time_s, text in zip(
            times["MSG"].tolist(), tables["MSG"].texts.get("Message", ()), strict=False
        ):
            if begun_item := re.match(r"Mission: (\d{1,5}) ", text):
                begun.append((time_s, float(begun_item[1])))
    return (
        "MSG.Message",
        np.array([time_s for time_s, _ in begun], np.float64),
        np.array([item for _, item in begun], np.float64),
    )


def _item(table: DataflashTable, row: int) -> LoggedItem:
    def value(field: str) -> float | None:
        values = table.numbers.get(field)
        known = None if values is None else float(values[row])
        return known if known is not None and np.isfinite(known) else None

    frame = value("Frame")
    return LoggedItem(
        int(table.numbers["CNum"][row]),
        int(value("CId") or 0),
        None if frame is None else int(frame),
        *(value("Prm1"), value("Prm2"), value("Prm3"), value("Prm4")),
        latitude_deg=value("Lat"),
        longitude_deg=value("Lng"),
        altitude_m=value("Alt"),
    )
