"""Reader of MAVLink telemetry logs (``.tlog``) to recordings."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.logs.record import (
    AUTO,
    AUTO_MISSION,
    LOG_DAMAGED,
    LoggedHome,
    LoggedItem,
    Recording,
    carried_over,
    copter_mode,
    px4_custom_mode,
    sources,
)
from planner.logs.series import (
    Clock,
    MessageColumns,
    MessageTable,
    Series,
    electrical_series,
    items_flown,
)
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from mmap import mmap

    from planner.arrays import BoolArray, FloatArray
    from planner.findings import Finding
    from planner.logs.record import LogFile, Source


_STAMP = 8
_V1, _V2 = 0xFE, 0xFD
_SIGNED = 1
"""Bit of a version 2 frame's incompatibility flags: 13 bytes of signature follow."""
_EARLIEST_S, _LATEST_S = 946_684_800.0, 4_102_444_800.0
"""The years 2000 and 2100."""


class TelemetryFrame(Value, kw_only=False):
    """One frame: where it is, when it came, whose it is."""

    place: int
    """First byte of its time in the log."""
    stamp_s: float
    """Since 1970, by the ground station's clock. [s]"""
    system: int
    component: int
    message: int
    """Number of the message."""
    content: bytes
    """The frame, from its marker to its checksum or signature."""


@dataclass(slots=True)
class Damage:
    """What of a log is no frame."""

    unreadable: int = 0
    first_unreadable: int | None = None


def is_tlog(data: mmap) -> bool:
    """Return whether a file begins with two frames after plausible times."""
    first = _frame_end(data, 0)
    if first is None or not _EARLIEST_S < _stamp_s(data, 0) < _LATEST_S:
        return False
    return first == len(data) or _frame_end(data, first) is not None


def frames(data: mmap, wanted: frozenset[int], damage: Damage) -> Iterator[TelemetryFrame]:
    """Yield the frames of wanted messages, in the order of the log.

    Parameters
    ----------
    damage : Damage
        Filled with what is no frame.
    """
    at = 0
    while at < len(data):
        end = _frame_end(data, at)
        if end is None:
            if len(data) - at < _STAMP + 280:
                return  # the last frame, cut off
            after = _next_frame(data, at + 1)
            damage.unreadable += after - at
            if damage.first_unreadable is None:
                damage.first_unreadable = at
            at = after
            continue
        start = at + _STAMP
        if data[start] == _V1:
            system, component, message = data[start + 3], data[start + 4], data[start + 5]
        else:
            system, component = data[start + 5], data[start + 6]
            message = int.from_bytes(data[start + 7 : start + 10], "little")
        if message in wanted:
            yield TelemetryFrame(
                at, _stamp_s(data, at), system, component, message, data[start:end]
            )
        at = end


def _frame_end(data: mmap, at: int) -> int | None:
    """Return where the frame at a place ends; ``None`` where there is none, or not all of it."""
    start = at + _STAMP
    if start + 3 > len(data):
        return None
    if data[start] == _V1:
        end = start + 6 + data[start + 1] + 2
    elif data[start] == _V2:
        end = start + 10 + data[start + 1] + 2 + (13 if data[start + 2] & _SIGNED else 0)
    else:
        return None
    return end if end <= len(data) else None


def _next_frame(data: mmap, at: int) -> int:
    """Return the next place where two frames follow each other, else the end."""
    while at < len(data):
        markers = [
            place
            for marker in (_V1, _V2)
            if (place := data.find(bytes([marker]), at + _STAMP)) >= 0
        ]
        if not markers:
            return len(data)
        at = min(markers) - _STAMP
        end = _frame_end(data, at)
        if end is not None and (end == len(data) or _frame_end(data, end) is not None):
            return at
        at += 1
    return len(data)


def _stamp_s(data: mmap, at: int) -> float:
    return int.from_bytes(data[at : at + _STAMP], "big") * 1e-6


_ITEM = (
    *("seq", "frame", "command", "param1", "param2", "param3", "param4", "x", "y", "z"),
    *("target_system", "mission_type"),
)

WANTED: Mapping[str, tuple[str, ...]] = {
    "ATTITUDE": ("time_boot_ms", "roll", "pitch", "yaw"),
    "AUTOPILOT_VERSION": ("flight_sw_version",),
    "BATTERY_STATUS": ("id", "current_battery", "voltages"),
    "EXTENDED_SYS_STATE": ("landed_state",),
    "GLOBAL_POSITION_INT": (
        *("time_boot_ms", "lat", "lon", "alt", "relative_alt"),
        *("vx", "vy", "vz"),
    ),
    "HEARTBEAT": ("type", "autopilot", "base_mode", "custom_mode", "system_status"),
    "HOME_POSITION": ("latitude", "longitude", "altitude"),
    "LOCAL_POSITION_NED": ("time_boot_ms", "x", "y", "z", "vx", "vy", "vz"),
    "MISSION_COUNT": ("count", "target_system", "mission_type"),
    "MISSION_CURRENT": ("seq",),
    "MISSION_ITEM": _ITEM,
    "MISSION_ITEM_INT": _ITEM,
    "PARAM_VALUE": ("param_id", "param_value", "param_type"),
    "POSITION_TARGET_GLOBAL_INT": (
        *("time_boot_ms", "coordinate_frame", "type_mask", "lat_int", "lon_int", "alt"),
        *("vx", "vy", "vz"),
    ),
    "POSITION_TARGET_LOCAL_NED": (
        *("time_boot_ms", "coordinate_frame", "type_mask", "x", "y", "z"),
        *("vx", "vy", "vz"),
    ),
    "STATUSTEXT": ("text",),
    "SYS_STATUS": ("voltage_battery", "current_battery"),
    "VFR_HUD": ("groundspeed", "heading", "climb"),
    "WIND": ("direction", "speed"),
    "WIND_COV": ("time_usec", "wind_x", "wind_y"),
}
"""The fields used, by message."""

_UPLOADED = frozenset(("MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT"))
"""MessageTable about a vehicle that its ground station may have sent."""
_TEXTS = frozenset(("text", "param_id"))
_NO_VOLTAGE_MV = 65535
_GROUND_STATION, _NO_AUTOPILOT = 6, 8
"""MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID."""
_AUTOPILOT_COMPONENT = 1


def messages_by_vehicle(
    data: mmap, source: str, damage: Damage
) -> dict[int, dict[str, MessageTable]]:
    """Return the messages of each vehicle in a telemetry log, by its system id and their name.

    Parameters
    ----------
    damage : Damage
        Filled with what is no frame.

    Returns
    -------
    dict of dict
        Systems with a heartbeat of an autopilot; mission items sent to a vehicle are among its own.
    """
    try:
        from pymavlink.dialects.v20 import ardupilotmega as mavlink
    except ImportError as error:
        msg = "telemetry needs pymavlink; install it with: pip install 'mavjoule[identify]'"
        raise LogFileError(msg, source=source) from error
    names = {kind.id: kind.msgname for kind in mavlink.mavlink_map.values()}
    wanted = frozenset(number for number, name in names.items() if name in WANTED)
    decoder = mavlink.MAVLink(None)
    found: dict[int, dict[str, MessageColumns]] = {}
    vehicles: set[int] = set()
    for frame in frames(data, wanted, damage):
        try:
            message = decoder.decode(bytearray(frame.content))
        except mavlink.MAVError:
            damage.unreadable += len(frame.content)
            if damage.first_unreadable is None:
                damage.first_unreadable = frame.place
            continue
        name = names[frame.message]
        if name == "HEARTBEAT" and _is_vehicle(message):
            vehicles.add(frame.system)
        if name in _UPLOADED and message.target_system and frame.component != _AUTOPILOT_COMPONENT:
            _add(
                found.setdefault(message.target_system, {}),
                name,
                frame.place,
                frame.stamp_s,
                message,
            )
        elif frame.component == _AUTOPILOT_COMPONENT:
            _add(found.setdefault(frame.system, {}), name, frame.place, frame.stamp_s, message)
    return {
        system: {name: rows.table() for name, rows in tables.items()}
        for system, tables in found.items()
        if system in vehicles
    }


def boot_time_s(tables: Iterable[MessageTable]) -> dict[int, FloatArray]:
    """Return the times of messages on the vehicle's clock, by the identity of their table.

    MessageTable that carry no time of their own came as much after the last one that does by the
    ground station's clock.  Where none does, the ground station's clock is all there is.

    Returns
    -------
    dict
        Times of each table, by its ``id``. [s]
    """
    every = list(tables)
    timed = [table for table in every if "time_boot_ms" in table.numbers]
    if not timed:
        return {id(table): table.numbers["stamp_s"] for table in every}
    places = np.concatenate([table.places for table in timed])
    order = np.argsort(places)
    lag_s = np.concatenate(
        [table.numbers["stamp_s"] - table.numbers["time_boot_ms"] * 1e-3 for table in timed]
    )[order]
    places = places[order]
    times: dict[int, FloatArray] = {}
    for table in every:
        if "time_boot_ms" in table.numbers:
            times[id(table)] = table.numbers["time_boot_ms"] * 1e-3
        else:
            before = np.searchsorted(places, table.places, side="right") - 1
            times[id(table)] = table.numbers["stamp_s"] - lag_s[np.maximum(before, 0)]
    return times


def _is_vehicle(heartbeat: Any) -> bool:  # noqa: ANN401 - pymavlink has no types
    return bool(heartbeat.type != _GROUND_STATION and heartbeat.autopilot != _NO_AUTOPILOT)


def _add(
    tables: dict[str, MessageColumns],
    name: str,
    place: int,
    stamp_s: float,
    message: Any,  # noqa: ANN401 - pymavlink has no types
) -> None:
    rows = tables.get(name)
    if rows is None:
        fields = WANTED[name]
        rows = tables[name] = MessageColumns(
            ("stamp_s", *(field for field in fields if field not in _TEXTS)),
            (field for field in fields if field in _TEXTS),
        )
    rows.places.append(place)
    for field_name, values in rows.numbers.items():
        if field_name == "stamp_s":  # by the ground station's clock
            values.append(stamp_s)
        elif field_name == "voltages":
            values.append(_sum_mv(message.voltages))
        else:
            values.append(getattr(message, field_name, np.nan))
    for field_name, texts in rows.texts.items():
        texts.append(str(getattr(message, field_name)))


def _sum_mv(cells: Iterable[int]) -> float:
    """Return the voltage of all cells; NaN where none is reported."""
    known = [cell for cell in cells if cell != _NO_VOLTAGE_MV]
    return float(sum(known)) if known else np.nan


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


def tlog_recordings(data: mmap, file: LogFile) -> tuple[Recording, ...]:
    """Return what a telemetry log holds, a recording for each vehicle and run of its clock."""
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
                f"{damage.first_unreadable}, are not messages: left out"
            )
        )
    several = len(vehicles) > 1
    recordings: list[Recording] = []
    for system, tables in vehicles.items():
        mark = f", system {system}" if several else ""
        recordings += carried_over(_runs(tables, file, tuple(findings), mark))
    return tuple(recordings)


def _runs(
    tables: Mapping[str, MessageTable], file: LogFile, findings: tuple[Finding, ...], mark: str
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
    tables: Mapping[str, MessageTable],
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


def _identity(heartbeats: MessageTable | None) -> tuple[Autopilot | None, str]:
    if heartbeats is None:
        return None, ""
    autopilot = _AUTOPILOTS.get(int(heartbeats.numbers["autopilot"][-1]))
    kind = int(heartbeats.numbers["type"][-1])
    return autopilot, _VEHICLES.get(kind, f"MAV_TYPE {kind}")


def _firmware(tables: Mapping[str, MessageTable]) -> str:
    """Return the firmware from ArduPilot's texts or the version message."""
    texts = tables["STATUSTEXT"].texts["text"] if "STATUSTEXT" in tables else ()
    named = next((text for text in texts if "Copter V" in text or "Copter-" in text), "")
    if named or "AUTOPILOT_VERSION" not in tables:
        return named
    version = int(tables["AUTOPILOT_VERSION"].numbers["flight_sw_version"][-1])
    return f"{version >> 24 & 255}.{version >> 16 & 255}.{version >> 8 & 255}"


def _armed(tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]) -> Series | None:
    if "HEARTBEAT" not in tables:
        return None
    modes = tables["HEARTBEAT"].numbers["base_mode"].astype(np.int64)
    return Series.of(times["HEARTBEAT"], modes & _ARMED != 0, "HEARTBEAT.base_mode", is_event=True)


def _landed(
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray], autopilot: Autopilot | None
) -> Series | None:
    for name, column, landed, is_reported in (
        ("EXTENDED_SYS_STATE", "landed_state", _ON_GROUND, True),
        ("HEARTBEAT", "system_status", _STANDBY, autopilot is Autopilot.ARDUPILOT),
    ):
        if is_reported and name in tables:
            states = tables[name].numbers[column]
            known = states > 0.0
            return Series.of(
                times[name][known], states[known] == landed, f"{name}.{column}", is_event=True
            )
    return None


def _modes(
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray], autopilot: Autopilot | None
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
    tables: Mapping[str, MessageTable],
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
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]
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
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray], first_item: int
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


def _is_mission(table: MessageTable, row: int) -> bool:
    """Return whether a message is about the mission, not about fence or rally points."""
    kind = table.numbers["mission_type"][row]
    return bool(kind == 0.0 or np.isnan(kind))


def _item(table: MessageTable, row: int, unit: float, first_item: int) -> LoggedItem:
    def value(field: str, scale: float = 1.0) -> float | None:
        number = float(table.numbers[field][row])
        return number * scale if np.isfinite(number) else None

    return LoggedItem(
        int(table.numbers["seq"][row]) + first_item,
        int(table.numbers["command"][row]),
        int(table.numbers["frame"][row]),
        *(value("param1"), value("param2"), value("param3"), value("param4")),
        latitude_deg=value("x", unit),
        longitude_deg=value("y", unit),
        altitude_m=value("z"),
    )


def _parameters(
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray], autopilot: Autopilot | None
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


_E7, _MM, _CM = 1e-7, 1e-3, 1e-2
_DEG = float(np.degrees(1.0))
_UNKNOWN_CA = -1
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
"""Where each quantity is found, the best place first.

The airspeed of VFR_HUD is not used: without a sensor it is the ground speed under another name.
"""


def quantity_series(
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]
) -> tuple[dict[str, Series], dict[str, str]]:
    """Return every quantity in the messages, and what is wrong with some."""
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


def _place(
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]
) -> dict[str, Series]:
    """Return latitude and longitude; zero and zero means no position."""
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


def _wind(tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]) -> dict[str, Series]:
    """Return ArduPilot's wind, from speed and the direction it comes from."""
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
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]
) -> dict[str, Series]:
    """Return the references of the controller, from the local form if it is there, else the global."""
    series: dict[str, Series] = {}
    name = "POSITION_TARGET_GLOBAL_INT"
    if name in tables:
        numbers = tables[name].numbers
        frame, is_reported = numbers["coordinate_frame"], _is_reported(tables[name], _NO_POSITION)
        for column, field, unit, rows in (
            ("reference_latitude_deg", "lat_int", _E7, is_reported),
            ("reference_longitude_deg", "lon_int", _E7, is_reported),
            ("reference_altitude_amsl_m", "alt", 1.0, is_reported & np.isin(frame, _AMSL_FRAMES)),
            ("reference_height_m", "alt", 1.0, is_reported & np.isin(frame, _RELATIVE_FRAMES)),
        ):
            series[column] = Series.of(
                times[name][rows], numbers[field][rows] * unit, f"{name}.{field}"
            )
        series |= _reference_velocity(name, tables, times)
    name = "POSITION_TARGET_LOCAL_NED"
    if name in tables:
        numbers = tables[name].numbers
        rows = _is_reported(tables[name], _NO_POSITION) & (
            numbers["coordinate_frame"] == _LOCAL_FRAME
        )
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
    name: str, tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]
) -> dict[str, Series]:
    rows = _is_reported(tables[name], _NO_VELOCITY)
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


def _is_reported(table: MessageTable, ignored: int) -> BoolArray:
    is_reported: BoolArray = table.numbers["type_mask"].astype(np.int64) & ignored == 0
    return is_reported


def _electrical(
    tables: Mapping[str, MessageTable], times: Mapping[str, FloatArray]
) -> tuple[dict[str, Series], dict[str, str]]:
    name, voltage_field = "SYS_STATUS", "voltage_battery"
    table = tables.get(name)
    if table is None or np.all(table.numbers[voltage_field] == _NO_VOLTAGE_MV):
        name, voltage_field = "BATTERY_STATUS", "voltages"
        table = tables.get(name)
        if table is None:
            return {}, {}
    numbers = table.numbers
    rows = numbers["id"] == np.min(numbers["id"]) if "id" in numbers else slice(None)
    voltage_mv, current_ca = numbers[voltage_field][rows], numbers["current_battery"][rows]
    return electrical_series(
        times[name][rows],
        np.where(voltage_mv == _NO_VOLTAGE_MV, np.nan, voltage_mv * 1e-3),
        np.where(current_ca == _UNKNOWN_CA, np.nan, current_ca * _CM),
        message=name,
        fields=(voltage_field, "current_battery"),
    )
