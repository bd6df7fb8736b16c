"""Reader of MAVLink telemetry logs (``.tlog``) to recordings."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.catalogue.flight_log import LOG_DAMAGED
from planner.errors import LogFileError
from planner.logs.ardupilot_modes import AUTO, copter_mode
from planner.logs.clock import Clock
from planner.logs.items_flown import items_flown
from planner.logs.px4_modes import AUTO_MISSION, px4_custom_mode
from planner.logs.record import LoggedHome, LoggedItem
from planner.logs.recording import Recording, carried_over
from planner.logs.series import Series
from planner.logs.tlog_frames import Damage
from planner.logs.tlog_messages import boot_time_s, messages_by_vehicle
from planner.logs.tlog_quantities import quantity_series

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from mmap import mmap

    from planner.findings import Finding
    from planner.logs.record import FloatArray
    from planner.logs.recording import LogFile
    from planner.logs.tlog_messages import Messages

_AUTOPILOTS = {3: Autopilot.ARDUPILOT, 12: Autopilot.PX4}
"""MAV_AUTOPILOT."""
_VEHICLES = {
    2: "quadrotor",
    3: "coaxial helicopter",
    4: "helicopter",
    13: "hexarotor",
    14: "octorotor",
    15: "tricopter",
    29: "dodecarotor",
    35: "decarotor",
}
"""MAV_TYPE of what hovers and is no VTOL."""
_ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""
_ON_GROUND = 1
"""MAV_LANDED_STATE_ON_GROUND."""
_STANDBY = 3
"""MAV_STATE_STANDBY: ArduPilot's while it has landed."""
_INT32 = 6
"""MAV_PARAM_TYPE_INT32, which PX4 sends as the bytes of a float."""
_E7 = 1e-7


def tlog_recordings(data: mmap, file: LogFile) -> tuple[Recording, ...]:
    """Return what a telemetry log tells, a recording for each vehicle and run of its clock.

    Parameters
    ----------
    data : mmap
        The file.
    file : LogFile
        Which it is.

    Returns
    -------
    tuple of Recording
        At least one.

    Raises
    ------
    LogFileError
        If no autopilot is heard in it.
    """
    damage = Damage()
    vehicles = messages_by_vehicle(data, file.source, damage)
    if not vehicles:
        msg = "no autopilot is heard in it: no heartbeat of a vehicle"
        raise LogFileError(msg, source=file.source)
    findings: list[Finding] = []
    if damage.unreadable:
        findings.append(
            LOG_DAMAGED.finding(
                f"{file.source}: {damage.unreadable} of {len(data)} bytes, the first at "
                f"{damage.first_unreadable}, are no messages: left out"
            )
        )
    several = len(vehicles) > 1
    recordings: list[Recording] = []
    for system, tables in vehicles.items():
        mark = f", system {system}" if several else ""
        recordings += carried_over(_runs(tables, file, tuple(findings), mark))
    return tuple(recordings)


def _runs(
    tables: Mapping[str, Messages], file: LogFile, findings: tuple[Finding, ...], mark: str
) -> Iterator[Recording]:
    """Yield a recording for each time the vehicle's clock started."""
    by_table = boot_time_s(tables.values())
    times = {name: by_table[id(table)] for name, table in tables.items()}
    clock = Clock.of(
        np.concatenate([table.places for table in tables.values()]),
        np.concatenate([times[name] for name in tables]),
    )
    findings = (*findings, *clock.findings(file.source))
    for begin, end in clock.runs():
        chosen = {
            name: (table.places >= begin) & (table.places < end) & clock.is_in_time(table.places)
            for name, table in tables.items()
        }
        yield _recording(
            {name: tables[name].rows(rows) for name, rows in chosen.items() if np.any(rows)},
            {name: times[name][rows] for name, rows in chosen.items() if np.any(rows)},
            file,
            findings,
            mark,
        )


def _recording(
    tables: Mapping[str, Messages],
    times: Mapping[str, FloatArray],
    file: LogFile,
    findings: tuple[Finding, ...],
    mark: str,
) -> Recording:
    series, remarks = quantity_series(tables, times)
    every = np.concatenate([np.empty(0), *times.values()])
    autopilot, vehicle = _identity(tables.get("HEARTBEAT"))
    first_item = 0 if autopilot is Autopilot.ARDUPILOT else 1
    modes = _modes(tables, times, autopilot)
    return Recording(
        file=file,
        begin_s=float(np.min(every, initial=np.inf)),
        end_s=float(np.max(every, initial=-np.inf)),
        series=series,
        is_armed=_armed(tables, times),
        is_landed=_landed(tables, times, autopilot),
        modes=modes,
        modes_found_in="HEARTBEAT.custom_mode",
        mission_item=_mission_item(tables, times, modes, autopilot, first_item),
        homes=_homes(tables, times),
        missions=_missions(tables, times, first_item),
        parameters=_parameters(tables, times, autopilot),
        autopilot=autopilot,
        firmware=_firmware(tables),
        vehicle=vehicle + mark,
        position_jumps=(),
        remarks=remarks,
        findings=findings,
    )


def _identity(heartbeats: Messages | None) -> tuple[Autopilot | None, str]:
    if heartbeats is None:
        return None, ""
    autopilot = _AUTOPILOTS.get(int(heartbeats.numbers["autopilot"][-1]))
    kind = int(heartbeats.numbers["type"][-1])
    return autopilot, _VEHICLES.get(kind, f"MAV_TYPE {kind}")


def _firmware(tables: Mapping[str, Messages]) -> str:
    """Return the firmware as ArduPilot's texts or the version message tell it."""
    texts = tables["STATUSTEXT"].texts["text"] if "STATUSTEXT" in tables else ()
    named = next((text for text in texts if "Copter V" in text or "Copter-" in text), "")
    if named or "AUTOPILOT_VERSION" not in tables:
        return named
    version = int(tables["AUTOPILOT_VERSION"].numbers["flight_sw_version"][-1])
    return f"{version >> 24 & 255}.{version >> 16 & 255}.{version >> 8 & 255}"


def _armed(tables: Mapping[str, Messages], times: Mapping[str, FloatArray]) -> Series | None:
    if "HEARTBEAT" not in tables:
        return None
    modes = tables["HEARTBEAT"].numbers["base_mode"].astype(np.int64)
    return Series.of(times["HEARTBEAT"], modes & _ARMED != 0, "HEARTBEAT.base_mode", is_event=True)


def _landed(
    tables: Mapping[str, Messages], times: Mapping[str, FloatArray], autopilot: Autopilot | None
) -> Series | None:
    for name, field, landed, is_told in (
        ("EXTENDED_SYS_STATE", "landed_state", _ON_GROUND, True),
        ("HEARTBEAT", "system_status", _STANDBY, autopilot is Autopilot.ARDUPILOT),
    ):
        if is_told and name in tables:
            states = tables[name].numbers[field]
            known = states > 0.0
            return Series.of(
                times[name][known], states[known] == landed, f"{name}.{field}", is_event=True
            )
    return None


def _modes(
    tables: Mapping[str, Messages], times: Mapping[str, FloatArray], autopilot: Autopilot | None
) -> tuple[tuple[float, str], ...]:
    if "HEARTBEAT" not in tables:
        return ()
    numbers = tables["HEARTBEAT"].numbers["custom_mode"].astype(np.int64)
    entered = np.append([True], numbers[1:] != numbers[:-1])
    return tuple(
        (time_s, _mode_name(number, autopilot))
        for time_s, number in zip(
            times["HEARTBEAT"][entered].tolist(), numbers[entered].tolist(), strict=True
        )
    )


def _mode_name(number: int, autopilot: Autopilot | None) -> str:
    if autopilot is Autopilot.PX4:
        return px4_custom_mode(number)
    return copter_mode(number) if autopilot is Autopilot.ARDUPILOT else f"mode {number}"


def _mission_item(
    tables: Mapping[str, Messages],
    times: Mapping[str, FloatArray],
    modes: tuple[tuple[float, str], ...],
    autopilot: Autopilot | None,
    first_item: int,
) -> Series | None:
    """Return the item flown; ArduPilot's 0 is home, PX4's the first."""
    if "MISSION_CURRENT" not in tables:
        return None
    mode = AUTO_MISSION if autopilot is Autopilot.PX4 else AUTO
    items = tables["MISSION_CURRENT"].numbers["seq"] + first_item
    return items_flown(times["MISSION_CURRENT"], items, modes, mode, "MISSION_CURRENT.seq")


def _homes(
    tables: Mapping[str, Messages], times: Mapping[str, FloatArray]
) -> tuple[tuple[float, LoggedHome], ...]:
    table = tables.get("HOME_POSITION")
    if table is None:
        return ()
    fields = ("latitude", "longitude", "altitude")
    rows = zip(
        times["HOME_POSITION"].tolist(),
        *(table.numbers[field].tolist() for field in fields),
        strict=True,
    )
    return tuple(
        (
            time_s,
            LoggedHome(
                latitude_deg=latitude * _E7,
                longitude_deg=longitude * _E7,
                altitude_amsl_m=altitude * 1e-3,
                found_in="HOME_POSITION",
            ),
        )
        for time_s, latitude, longitude, altitude in rows
        if latitude or longitude
    )


def _missions(
    tables: Mapping[str, Messages], times: Mapping[str, FloatArray], first_item: int
) -> tuple[tuple[float, tuple[LoggedItem, ...]], ...]:
    """Return the missions sent either way; each begins with a count, and is whole or left out."""
    events: list[tuple[float, int, LoggedItem | int]] = []
    for name, unit in (("MISSION_ITEM", 1.0), ("MISSION_ITEM_INT", _E7)):
        table = tables.get(name)
        for row in range(0 if table is None else len(table.places)):
            if table is not None and _is_mission(table, row):
                item = _item(table, row, unit, first_item)
                events.append((float(times[name][row]), int(table.places[row]), item))
    counts = tables.get("MISSION_COUNT")
    for row in range(0 if counts is None else len(counts.places)):
        if counts is not None and _is_mission(counts, row):
            count = int(counts.numbers["count"][row])
            events.append((float(times["MISSION_COUNT"][row]), int(counts.places[row]), count))
    missions: list[tuple[float, tuple[LoggedItem, ...]]] = []
    expected: int | None = None
    held: dict[int, LoggedItem] = {}
    for time_s, _, event in sorted(events, key=lambda event: event[1]):
        if isinstance(event, int):
            expected, held = event, {}
            continue
        held[event.item] = event
        if expected is not None and len(held) == expected:
            # ArduPilot's first is home.
            flown = tuple(held[number] for number in sorted(held) if number > 0)
            missions.append((time_s, flown))
    return tuple(missions)


def _is_mission(table: Messages, row: int) -> bool:
    """Return whether a message is about the mission, not about fence or rally points."""
    kind = table.numbers["mission_type"][row]
    return bool(kind == 0.0 or np.isnan(kind))


def _item(table: Messages, row: int, unit: float, first_item: int) -> LoggedItem:
    def value(field: str, scale: float = 1.0) -> float | None:
        number = float(table.numbers[field][row])
        return number * scale if np.isfinite(number) else None

    return LoggedItem(
        item=int(table.numbers["seq"][row]) + first_item,
        command=int(table.numbers["command"][row]),
        frame=int(table.numbers["frame"][row]),
        param1=value("param1"),
        param2=value("param2"),
        param3=value("param3"),
        param4=value("param4"),
        latitude_deg=value("x", unit),
        longitude_deg=value("y", unit),
        altitude_m=value("z"),
    )


def _parameters(
    tables: Mapping[str, Messages], times: Mapping[str, FloatArray], autopilot: Autopilot | None
) -> tuple[tuple[float, str, float], ...]:
    table = tables.get("PARAM_VALUE")
    if table is None:
        return ()
    parameters: list[tuple[float, str, float]] = []
    for row, time_s in enumerate(times["PARAM_VALUE"].tolist()):
        value = float(table.numbers["param_value"][row])
        if autopilot is Autopilot.PX4 and table.numbers["param_type"][row] == _INT32:
            value = float(struct.unpack("<i", struct.pack("<f", value))[0])
        if np.isfinite(value):
            parameters.append((time_s, table.texts["param_id"][row], value))
    return tuple(parameters)
