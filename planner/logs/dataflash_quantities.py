"""Which DataFlash message holds which quantity: names and units of every ArduPilot since 3.1.

Sources: ArduPilot's log documentation and structures (``LogStructure.h`` of the libraries,
``Log.cpp`` of Copter), compared with logs of Copter 3.1, 3.3, 3.4 and 4.7.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.logs.messages import (
    NO_CURRENT_A,
    battery_series,
    begin_and_end_s,
    logged_homes,
    logged_item,
    modes_entered,
    quantity_series,
    source_fields,
    sources,
)
from planner.logs.record import AUTO, BATTERIES_LEFT_OUT, LoggedItem, Recording, copter_mode
from planner.logs.series import Series
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.arrays import BoolArray, FloatArray
    from planner.findings import Finding
    from planner.logs.messages import MessageTable, Source, Tables
    from planner.logs.record import LogFile, LoggedHome


_CM = 1e-2
"""Old navigation messages are in centimetres, climb rates in them to this day."""


_QUANTITIES: Mapping[str, tuple[Source, ...]] = {
    "roll_deg": sources("ATT.Roll"),
    "pitch_deg": sources("ATT.Pitch"),
    "yaw_deg": sources("ATT.Yaw"),
    "airspeed_m_s": sources("ARSP.Airspeed"),
    "throttle": sources("CTUN.ThO"),
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
    "latitude_deg": sources("POS.Lat", "GPS.Lat"),
    "longitude_deg": sources("POS.Lng", "GPS.Lng"),
}
"""Where each quantity is found, the best place first.

References are the path as it is shaped (D for desired), not with the correction of the position
error on top (T for target), which follows the vehicle as much as it leads it.
"""

_INSTANCES = ("I", "C", "Inst", "Instance")
"""Fields that number sensors and estimator cores."""
_BATTERIES = ("BAT", "CURR")
_MORE_BATTERIES = ("BAT2", "CUR2")
_FIX_3D = 3

_COMMAND = "CTot CNum CId Frame Lat Lng Alt Prm1 Prm2 Prm3 Prm4"
_FURTHER_FIELDS = {
    "ARM": "ArmState",
    "EV": "Id",
    "STAT": "Armed",
    "GPS": "T Status",
    "CTUN": "DAlt",
    "CMD": _COMMAND,
    "MISE": _COMMAND,
    "ORGN": "Type Lat Lng Alt",
    "MODE": "Mode ModeNum",
    "MSG": "Message",
    "PARM": "Name Value",
    **dict.fromkeys((*_BATTERIES, *_MORE_BATTERIES), "Volt Curr"),
}
_OF_QUANTITIES = source_fields(_QUANTITIES)
WANTED: Mapping[str, frozenset[str]] = {
    name: frozenset(
        (
            *("TimeUS", "TimeMS", *_INSTANCES),
            *_OF_QUANTITIES.get(name, ()),
            *_FURTHER_FIELDS.get(name, "").split(),
        )
    )
    for name in {*_OF_QUANTITIES, *_FURTHER_FIELDS}
}
"""The fields used, by message; all names any firmware has had."""


def dataflash_recording(tables: Tables, file: LogFile, findings: tuple[Finding, ...]) -> Recording:
    """Return what one run of the clock holds."""
    series, remarks = _series(tables)
    firmware, frame = _firmware_and_frame(tables)
    entered = _modes(tables.get("MODE"), firmware)
    begin_s, end_s = begin_and_end_s(tables)
    return Recording(
        file=file,
        begin_s=begin_s,
        end_s=end_s,
        series=series,
        is_armed=_armed_events(tables),
        is_landed=_two_events(tables.get("EV"), _LANDED, _NOT_LANDED),
        modes=entered,
        modes_found_in="MODE.Mode",
        mission_item=_mission_item_events(tables, entered),
        homes=_homes(tables),
        missions=_missions(tables.get("CMD")),
        parameters=_parameters(tables.get("PARM")),
        autopilot=Autopilot.ARDUPILOT,
        firmware=firmware,
        vehicle=frame,
        remarks=remarks,
        findings=(*findings, *_other_batteries(tables, file.source)),
    )


def _is_first_instance(table: MessageTable) -> BoolArray:
    number = next((table.numbers[name] for name in _INSTANCES if name in table.numbers), None)
    return np.ones(table.places.shape, np.bool_) if number is None else number == number.min()


def _series(tables: Tables) -> tuple[dict[str, Series], dict[str, str]]:
    first = {name: table.rows(_is_first_instance(table)) for name, table in tables.items()}
    if "GPS" in first and "Status" in first["GPS"].numbers:
        first["GPS"] = first["GPS"].rows(first["GPS"].numbers["Status"] >= _FIX_3D)
    if "CTUN" in first and "DAlt" not in first["CTUN"].numbers:
        del first["CTUN"]  # a plane's message of the same name
    for name in {"POS", "GPS"} & first.keys():
        first[name] = first[name].without_null_places("Lat", "Lng")
    battery = next((first[n] for n in _BATTERIES if n in first and first[n].has("Volt")), None)
    electrical, remarks = battery_series(battery, "Volt", "Curr")
    return quantity_series(first, _QUANTITIES) | electrical, remarks


def _other_batteries(tables: Tables, source: str) -> Iterator[Finding]:
    others: dict[str, FloatArray] = {}
    for name in (*_MORE_BATTERIES, *_BATTERIES):
        if name in tables and tables[name].has("Curr"):
            current_a = tables[name].numbers["Curr"]
            if name in _MORE_BATTERIES:
                others[name] = current_a
            else:
                rest = ~_is_first_instance(tables[name])
                others[f"{name} of another instance"] = current_a[rest]
    most_a = {
        name: float(np.max(current_a[np.isfinite(current_a)], initial=0.0))
        for name, current_a in others.items()
    }
    name = max(most_a, key=most_a.__getitem__, default="")
    if name and most_a[name] > NO_CURRENT_A:
        yield BATTERIES_LEFT_OUT.finding(
            f"{source}: {name} shows up to {most_a[name]:.1f} A; only the first battery is used"
        )


# Event numbers of EV: LogEvent in AP_Logger.h
_ARMED, _DISARMED = 10, 11
_LANDED, _NOT_LANDED = 18, 28
_AHRS_HOME = 1
"""Type of ORGN that is home, not the origin of the estimator."""
_FIRMWARE = re.compile(r"\S*(Copter|Plane|Rover|Sub|Heli|Blimp|Tracker)\S* V\d\S*.*")
_FRAME = "Frame: "
_ITEM = "CNum CId Frame Prm1 Prm2 Prm3 Prm4 Lat Lng Alt"


def _armed_events(tables: Tables) -> Series | None:
    """Return when the motors were armed and disarmed; ``None`` where that is not logged."""
    for name, field in (("ARM", "ArmState"), ("EV", "Id"), ("STAT", "Armed")):
        table = tables.get(name)
        if table is None or not table.has(field):
            continue
        if name == "EV":
            events = _two_events(table, _ARMED, _DISARMED)
        else:
            events = table.events(field, table.numbers[field] != 0.0)
        if events is not None:
            return events
    return None


def _two_events(table: MessageTable | None, one: int, zero: int) -> Series | None:
    if table is None or not table.has("Id"):
        return None
    numbers = table.numbers["Id"]
    return table.events("Id", numbers == one, (numbers == one) | (numbers == zero))


def _firmware_and_frame(tables: Tables) -> tuple[str, str]:
    messages = tables["MSG"].texts.get("Message", ()) if "MSG" in tables else ()
    firmware = next((text for text in messages if _FIRMWARE.fullmatch(text)), "")
    frame = next((text for text in messages if text.startswith(_FRAME)), "")
    return firmware, frame.removeprefix(_FRAME)


def _modes(table: MessageTable | None, firmware: str) -> tuple[tuple[float, str], ...]:
    """Return times and names of the modes; those of other vehicles than copters stay numbers."""
    if table is None:
        return ()
    if "Mode" in table.texts and not table.has("ModeNum"):
        texts = list(table.texts["Mode"])
    else:
        numbers = table.numbers.get("ModeNum", table.numbers.get("Mode", np.empty(0)))
        texts = [str(number) for number in numbers.astype(np.int64).tolist()]
    is_copter = not firmware or "Copter" in firmware
    named = copter_mode if is_copter else "mode {}".format
    names = [named(int(text)) if text.isdigit() else text for text in texts]
    return modes_entered(table.time_s, names)


def _missions(table: MessageTable | None) -> tuple[tuple[float, tuple[LoggedItem, ...]], ...]:
    """Return the missions that were on board, each from when its list was logged."""
    if table is None or not table.has("CNum"):
        return ()
    lists = (
        (
            float(table.time_s[begin]),
            tuple(logged_item(table, row, _ITEM) for row in range(begin + 1, end)),
        )
        for begin, end in _lists(table.numbers["CNum"])
    )
    return tuple((time_s, items) for time_s, items in lists if items)


def _mission_item_events(tables: Tables, entered: tuple[tuple[float, str], ...]) -> Series | None:
    """Return when which item was begun; 0 where the vehicle leaves the mission for another mode.

    Firmware from 4.6 logs MISE for each item begun, older ones CMD; both may send
    ``Mission: 3 WP`` as text besides.  What is begun before the log begins is not logged: the
    item before the first one is assumed to have been flown until then.
    """
    found_in, begun_s, items = _begun(tables)
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


def _homes(tables: Tables) -> tuple[tuple[float, LoggedHome], ...]:
    """Return the homes set: ORGN, else the row before the first of the mission."""
    found: tuple[tuple[float, LoggedHome], ...] = ()
    for name, field, number in (("ORGN", "Type", _AHRS_HOME), ("CMD", "CNum", 0)):
        table = tables.get(name)
        if not found and table is not None and table.has(field, "Alt"):
            altitude = table.numbers["Alt"]  # Copter before 3.3 wrote zero
            known = {"Alt": np.where(altitude == 0.0, np.nan, altitude)}
            table = replace(table, numbers={**table.numbers, **known})
            rows = table.rows(table.numbers[field] == number)
            found = logged_homes(rows, ("Lat", "Lng", "Alt"))
    return found


def _parameters(table: MessageTable | None) -> tuple[tuple[float, str, float], ...]:
    if table is None or "Name" not in table.texts or not table.has("Value"):
        return ()
    rows = zip(
        table.time_s.tolist(), table.texts["Name"], table.numbers["Value"].tolist(), strict=True
    )
    return tuple(row for row in rows if np.isfinite(row[2]))


def _lists(numbers: FloatArray) -> list[tuple[int, int]]:
    """Return the rows of whole missions: each begins at 0, home, and counts on."""
    ends = np.append(np.flatnonzero(np.diff(numbers) != 1.0) + 1, numbers.size)
    begins = np.flatnonzero(numbers == 0.0)
    return list(
        zip(begins.tolist(), ends[np.searchsorted(ends, begins, "right")].tolist(), strict=True)
    )


def _begun(tables: Tables) -> tuple[str, FloatArray, FloatArray]:
    """Return the message found, times and numbers of the items begun."""
    for name in ("MISE", "CMD"):
        if name in tables and tables[name].has("CNum"):
            table, numbers = tables[name], tables[name].numbers["CNum"]
            is_begun = np.ones(numbers.shape, np.bool_)
            for begin, end in _lists(numbers) if name == "CMD" else ():
                is_begun[begin:end] = False
            if name == "MISE" or np.any(is_begun):
                return f"{name}.CNum", table.time_s[is_begun], numbers[is_begun]
    rows: Iterator[tuple[float, str]] = iter(())
    if "MSG" in tables:
        messages = tables["MSG"]
        rows = zip(messages.time_s.tolist(), messages.texts.get("Message", ()), strict=False)
    begun = [
        (time_s, float(item[1]))
        for time_s, text in rows
        if (item := re.match(r"Mission: (\d{1,5}) ", text))
    ]
    times, items = np.array(begun, np.float64).reshape(-1, 2).T
    return "MSG.Message", times, items
