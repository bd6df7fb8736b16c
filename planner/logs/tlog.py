"""Reader of MAVLink telemetry logs (``.tlog``) to recordings."""

from __future__ import annotations

import re
import struct
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planner.autopilot import Autopilot
from planner.errors import LogFileError, libraries_of
from planner.logs.messages import (
    GIVE_UP_BYTES,
    Damage,
    MessageColumns,
    MessageTable,
    Tables,
    begin_and_end_s,
    electrical_series,
    items_flown,
    logged_homes,
    logged_item,
    modes_entered,
    quantity_series,
    source_fields,
    sources,
    table_clock,
    table_runs,
)
from planner.logs.record import (
    AUTO,
    AUTO_MISSION,
    LoggedItem,
    Recording,
    carried_over,
    copter_mode,
    px4_custom_mode,
)
from planner.logs.series import Series, wind_north_east_m_s
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from mmap import mmap

    from planner.findings import Finding
    from planner.logs.messages import Source
    from planner.logs.record import LogFile


_STAMP = 8
_V1, _V2 = 0xFE, 0xFD
_SIGNED = 1
"""Bit of a version 2 frame's incompatibility flags: 13 bytes of signature follow."""
_EARLIEST_S, _LATEST_S = 946_684_800.0, 4_102_444_800.0
"""The years 2000 and 2100."""


class TelemetryFrame(NamedTuple):
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


def is_tlog(data: mmap) -> bool:
    """Return whether a file begins with two frames after plausible times."""
    first = _frame_end(data, 0)
    if first is None or not _EARLIEST_S < _stamp_s(data, 0) < _LATEST_S:
        return False
    return first == len(data) or _frame_end(data, first) is not None


def frames(data: mmap, wanted: frozenset[int], damage: Damage) -> Iterator[TelemetryFrame]:
    """Yield the frames of wanted messages, in the order of the log, and note what is no frame."""
    at = 0
    while at < len(data):
        end = _frame_end(data, at)
        if end is None:
            if len(data) - at < _STAMP + 280:
                return  # the last frame, cut off
            after = _next_frame(data, at + 1)
            if after is None:
                damage.stopped_by = f"no frame within {GIVE_UP_BYTES >> 20} MiB"
                after = len(data)
            damage.add(at, after - at)
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


_MARKERS = re.compile(rb"[\xfe\xfd]")


def _next_frame(data: mmap, at: int) -> int | None:
    """Return the next place where two frames follow each other; ``None``: not near."""
    stop = min(len(data), at + GIVE_UP_BYTES)
    for marker in _MARKERS.finditer(data, at + _STAMP, stop):
        place = marker.start() - _STAMP
        end = _frame_end(data, place)
        if end is not None and (end == len(data) or _frame_end(data, end) is not None):
            return place
    return None


def _stamp_s(data: mmap, at: int) -> float:
    return int.from_bytes(data[at : at + _STAMP], "big") * 1e-6


_POSITION, _LOCAL = "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"
_TARGET, _LOCAL_TARGET = "POSITION_TARGET_GLOBAL_INT", "POSITION_TARGET_LOCAL_NED"
_E7, _MM, _CM = 1e-7, 1e-3, 1e-2
_DEG = float(np.degrees(1.0))


def _velocity_target(field: str, unit: float = 1.0) -> tuple[Source, ...]:
    return sources(
        f"{_LOCAL_TARGET}.{field}", f"{_TARGET}.{field}", unit=unit, valid="has_velocity"
    )


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
    "throttle": sources("VFR_HUD.throttle", unit=1e-2),
    "local_north_m": sources(f"{_LOCAL}.x"),
    "local_east_m": sources(f"{_LOCAL}.y"),
    "local_height_m": sources(f"{_LOCAL}.z", unit=-1.0),
    "roll_deg": sources("ATTITUDE.roll", unit=_DEG),
    "pitch_deg": sources("ATTITUDE.pitch", unit=_DEG),
    "yaw_deg": (*sources("ATTITUDE.yaw", unit=_DEG), *sources("VFR_HUD.heading")),
    "latitude_deg": sources(f"{_POSITION}.lat", unit=_E7),
    "longitude_deg": sources(f"{_POSITION}.lon", unit=_E7),
    "wind_north_m_s": sources("WIND_COV.wind_x"),
    "wind_east_m_s": sources("WIND_COV.wind_y"),
    "reference_latitude_deg": sources(f"{_TARGET}.lat_int", unit=_E7, valid="has_place"),
    "reference_longitude_deg": sources(f"{_TARGET}.lon_int", unit=_E7, valid="has_place"),
    "reference_altitude_amsl_m": sources(f"{_TARGET}.alt", valid="is_amsl"),
    "reference_north_m": sources(f"{_LOCAL_TARGET}.x", valid="is_local"),
    "reference_east_m": sources(f"{_LOCAL_TARGET}.y", valid="is_local"),
    "reference_height_m": (
        *sources(f"{_LOCAL_TARGET}.z", unit=-1.0, valid="is_local"),
        *sources(f"{_TARGET}.alt", valid="is_relative"),
    ),
    "reference_velocity_north_m_s": _velocity_target("vx"),
    "reference_velocity_east_m_s": _velocity_target("vy"),
    "reference_climb_m_s": _velocity_target("vz", unit=-1.0),
}
"""Where each quantity is found, the best place first.

The airspeed of VFR_HUD is not used: without a sensor it is the ground speed under another name.
"""

_NO_POSITION, _NO_VELOCITY = 0b000_111, 0b111_000
"""Bits of POSITION_TARGET_TYPEMASK: fields to be ignored."""
_AMSL_FRAMES, _RELATIVE_FRAMES, _LOCAL_FRAMES = (0, 5), (3, 6), (1,)


def _with_marks(target: MessageTable) -> MessageTable:
    """Return the references of the controller with what each of them gives."""
    ignored = target.numbers["type_mask"].astype(np.int64)
    frame, has_place = target.numbers["coordinate_frame"], ignored & _NO_POSITION == 0
    marks = {
        "has_place": has_place,
        "is_amsl": has_place & np.isin(frame, _AMSL_FRAMES),
        "is_relative": has_place & np.isin(frame, _RELATIVE_FRAMES),
        "is_local": has_place & np.isin(frame, _LOCAL_FRAMES),
        "has_velocity": ignored & _NO_VELOCITY == 0,
    }
    numbers = {name: mark.astype(np.float64) for name, mark in marks.items()}
    return replace(target, numbers={**target.numbers, **numbers})


_ITEM = "seq command frame param1 param2 param3 param4 x y z"
_ITEM_FIELDS = f"{_ITEM} target_system mission_type"
_FURTHER_FIELDS = {
    "ATTITUDE": "time_boot_ms",
    "AUTOPILOT_VERSION": "flight_sw_version",
    "BATTERY_STATUS": "id current_battery voltages",
    "EXTENDED_SYS_STATE": "landed_state",
    _POSITION: "time_boot_ms",
    "HEARTBEAT": "type autopilot base_mode custom_mode system_status",
    "HOME_POSITION": "latitude longitude altitude",
    _LOCAL: "time_boot_ms",
    "MISSION_COUNT": "count target_system mission_type",
    "MISSION_CURRENT": "seq",
    "MISSION_ITEM": _ITEM_FIELDS,
    "MISSION_ITEM_INT": _ITEM_FIELDS,
    "PARAM_VALUE": "param_value param_type",
    _TARGET: "time_boot_ms coordinate_frame type_mask",
    _LOCAL_TARGET: "time_boot_ms coordinate_frame type_mask",
    "SYS_STATUS": "voltage_battery current_battery",
    "WIND": "direction speed",
}
_TEXTS = {"PARAM_VALUE": ("param_id",), "STATUSTEXT": ("text",)}
_OF_QUANTITIES = source_fields(_QUANTITIES)
WANTED: Mapping[str, tuple[str, ...]] = {
    name: (*_OF_QUANTITIES.get(name, ()), *_FURTHER_FIELDS.get(name, "").split())
    for name in {*_OF_QUANTITIES, *_FURTHER_FIELDS, *_TEXTS}
}
"""The numbers used, by message."""

_UPLOADED = frozenset(("MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT"))
"""Messages about a vehicle that its ground station may have sent."""
_NO_VOLTAGE_MV = 65535
_GROUND_STATION, _NO_AUTOPILOT = 6, 8
"""MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID."""
_AUTOPILOT_COMPONENT = 1


def messages_by_vehicle(data: mmap, damage: Damage) -> dict[int, Tables]:
    """Return the messages of each vehicle in a telemetry log, by its system id, on its own clock.

    Vehicles are systems with a heartbeat of an autopilot; mission items sent to one are among its
    own messages.  What is no frame is noted as damage.
    """
    with libraries_of("identify"):
        from pymavlink.dialects.v20 import ardupilotmega as mavlink
    names = {kind.id: kind.msgname for kind in mavlink.mavlink_map.values()}
    wanted = frozenset(number for number, name in names.items() if name in WANTED)
    decoder = mavlink.MAVLink(None)
    found: dict[int, dict[str, MessageColumns]] = {}
    vehicles: set[int] = set()
    for frame in frames(data, wanted, damage):
        try:
            message = decoder.decode(bytearray(frame.content))
        except mavlink.MAVError:
            damage.add(frame.place, len(frame.content))
            continue
        name = names[frame.message]
        system, is_its_own = frame.system, frame.component == _AUTOPILOT_COMPONENT
        if name == "HEARTBEAT":
            is_vehicle = message.type != _GROUND_STATION and message.autopilot != _NO_AUTOPILOT
            vehicles |= {system} if is_vehicle else set()
        if name in _UPLOADED and message.target_system and not is_its_own:
            system, is_its_own = message.target_system, True
        if is_its_own:
            _add(found.setdefault(system, {}), name, frame, message)
    return {
        system: _on_boot_clock({name: rows.table(name) for name, rows in columns.items()})
        for system, columns in found.items()
        if system in vehicles
    }


def _add(
    tables: dict[str, MessageColumns],
    name: str,
    frame: TelemetryFrame,
    message: Any,  # noqa: ANN401 - pymavlink has no types
) -> None:
    rows = tables.get(name)
    if rows is None:
        rows = tables[name] = MessageColumns(("stamp_s", *WANTED[name]), _TEXTS.get(name, ()))
    rows.places.append(frame.place)
    for field_name, values in rows.numbers.items():
        if field_name == "stamp_s":  # by the ground station's clock
            values.append(frame.stamp_s)
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


def _on_boot_clock(tables: Tables) -> Tables:
    """Return tables with the times of the vehicle's clock.

    Messages that carry no time of their own came as much after the last one that does by the
    ground station's clock.  Where none does, the ground station's clock is all there is.
    """
    timed = [table for table in tables.values() if "time_boot_ms" in table.numbers]
    places = np.concatenate([np.empty(0), *(table.places for table in timed)])
    lags = (t.numbers["stamp_s"] - t.numbers["time_boot_ms"] * 1e-3 for t in timed)
    order = np.argsort(places)
    places, lag_s = places[order], np.concatenate([np.empty(0), *lags])[order]
    found: Tables = {}
    for name, table in tables.items():
        if "time_boot_ms" in table.numbers:
            time_s = table.numbers["time_boot_ms"] * 1e-3
        else:
            before = np.searchsorted(places, table.places, side="right") - 1
            time_s = table.numbers["stamp_s"]
            time_s = time_s - lag_s[np.maximum(before, 0)] if timed else time_s
        found[name] = replace(table, time_s=time_s)
    return found


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
_UNKNOWN_CA = -1


def tlog_recordings(data: mmap, file: LogFile) -> tuple[Recording, ...]:
    """Return what a telemetry log holds, a recording for each vehicle and run of its clock."""
    damage = Damage()
    vehicles = messages_by_vehicle(data, damage)
    if not vehicles:
        msg = "no autopilot is heard in it: no heartbeat of a vehicle"
        raise LogFileError(msg, source=file.source)
    recordings: list[Recording] = []
    for system, tables in vehicles.items():
        mark = f", system {system}" if len(vehicles) > 1 else ""
        clock = table_clock(tables.values())
        findings = (*damage.findings(file.source, len(data), "bytes"), *clock.findings(file.source))
        runs = table_runs(tables, clock)
        recordings += carried_over(_recording(run, file, findings, mark) for run in runs)
    return tuple(recordings)


def _recording(
    tables: Tables, file: LogFile, findings: tuple[Finding, ...], mark: str
) -> Recording:
    heartbeats = tables.get("HEARTBEAT")
    autopilot, vehicle = _identity(heartbeats)
    is_px4 = autopilot is Autopilot.PX4
    first_item = 0 if autopilot is Autopilot.ARDUPILOT else 1  # ArduPilot's 0 is home
    modes: tuple[tuple[float, str], ...] = ()
    is_armed: Series | None = None
    if heartbeats is not None:
        numbers = heartbeats.numbers["custom_mode"].astype(np.int64).tolist()
        names = [_mode_name(number, autopilot) for number in numbers]
        modes = modes_entered(heartbeats.time_s, names)
        base_modes = heartbeats.numbers["base_mode"].astype(np.int64)
        is_armed = heartbeats.events("base_mode", base_modes & _ARMED != 0)
    series, remarks = _series(tables, autopilot)
    begin_s, end_s = begin_and_end_s(tables)
    return Recording(
        file=file,
        begin_s=begin_s,
        end_s=end_s,
        series=series,
        is_armed=is_armed,
        is_landed=_landed(tables, autopilot),
        modes=modes,
        modes_found_in="HEARTBEAT.custom_mode",
        mission_item=items_flown(
            tables.get("MISSION_CURRENT"),
            "seq",
            first_item,
            modes,
            AUTO_MISSION if is_px4 else AUTO,
        ),
        homes=logged_homes(
            tables.get("HOME_POSITION"), ("latitude", "longitude", "altitude"), (_E7, _MM)
        ),
        missions=_missions(tables, first_item),
        parameters=_parameters(tables.get("PARAM_VALUE"), is_px4=is_px4),
        autopilot=autopilot,
        firmware=_firmware(tables),
        vehicle=vehicle + mark,
        remarks=remarks,
        findings=findings,
    )


def _identity(heartbeats: MessageTable | None) -> tuple[Autopilot | None, str]:
    if heartbeats is None:
        return None, ""
    autopilot = _AUTOPILOTS.get(int(heartbeats.numbers["autopilot"][-1]))
    kind = int(heartbeats.numbers["type"][-1])
    return autopilot, _VEHICLES.get(kind, f"MAV_TYPE {kind}")


def _firmware(tables: Tables) -> str:
    texts = tables["STATUSTEXT"].texts["text"] if "STATUSTEXT" in tables else ()
    named = next((text for text in texts if "Copter V" in text or "Copter-" in text), "")
    if named or "AUTOPILOT_VERSION" not in tables:
        return named
    version = int(tables["AUTOPILOT_VERSION"].numbers["flight_sw_version"][-1])
    return f"{version >> 24 & 255}.{version >> 16 & 255}.{version >> 8 & 255}"


def _landed(tables: Tables, autopilot: Autopilot | None) -> Series | None:
    for name, field, landed, is_reported in (
        ("EXTENDED_SYS_STATE", "landed_state", _ON_GROUND, True),
        ("HEARTBEAT", "system_status", _STANDBY, autopilot is Autopilot.ARDUPILOT),
    ):
        if is_reported and name in tables:
            states = tables[name].numbers[field]
            return tables[name].events(field, states == landed, states > 0.0)
    return None


def _mode_name(number: int, autopilot: Autopilot | None) -> str:
    if autopilot is Autopilot.PX4:
        return px4_custom_mode(number)
    return copter_mode(number) if autopilot is Autopilot.ARDUPILOT else f"mode {number}"


def _missions(tables: Tables, first_item: int) -> tuple[tuple[float, tuple[LoggedItem, ...]], ...]:
    """Return the missions sent either way; each begins with a count, and is whole or left out."""
    events: list[tuple[int, float, LoggedItem | int]] = []
    for name, unit in (("MISSION_ITEM", 1.0), ("MISSION_ITEM_INT", _E7), ("MISSION_COUNT", 1.0)):
        table = tables.get(name)
        for row, time_s in enumerate(() if table is None else table.time_s.tolist()):
            assert table is not None
            if table.value("mission_type", row):
                continue  # fence or rally points
            event = (
                int(table.numbers["count"][row])
                if name == "MISSION_COUNT"
                else logged_item(table, row, _ITEM, added=first_item, unit=unit)
            )
            events.append((int(table.places[row]), time_s, event))
    missions: list[tuple[float, tuple[LoggedItem, ...]]] = []
    expected: int | None = None
    held: dict[int, LoggedItem] = {}
    for _, time_s, event in sorted(events, key=lambda event: event[0]):
        if isinstance(event, int):
            expected, held = event, {}
            continue
        held[event.item] = event
        if len(held) == expected:
            # ArduPilot's first is home.
            missions.append((time_s, tuple(held[n] for n in sorted(held) if n > 0)))
    return tuple(missions)


def _parameters(
    table: MessageTable | None, *, is_px4: bool
) -> tuple[tuple[float, str, float], ...]:
    if table is None:
        return ()
    parameters: list[tuple[float, str, float]] = []
    for row, time_s in enumerate(table.time_s.tolist()):
        value = float(table.numbers["param_value"][row])
        if is_px4 and table.numbers["param_type"][row] == _INT32:
            value = float(struct.unpack("<i", struct.pack("<f", value))[0])
        if np.isfinite(value):
            parameters.append((time_s, table.texts["param_id"][row], value))
    return tuple(parameters)


def _series(
    tables: Tables, autopilot: Autopilot | None
) -> tuple[dict[str, Series], dict[str, str]]:
    marked = {
        name: _with_marks(table) if name in {_TARGET, _LOCAL_TARGET} else table
        for name, table in tables.items()
    }
    if autopilot is Autopilot.ARDUPILOT:
        # the waypoint it flies to, not what its controller follows (GCS_MAVLink_Copter.cpp,
        # send_position_target_global_int)
        marked.pop(_TARGET, None)
    if _POSITION in marked:
        marked[_POSITION] = marked[_POSITION].without_null_places("lat", "lon")
    series = quantity_series(marked, _QUANTITIES)
    climb = series.get("climb_m_s")
    if climb is not None and climb.found_in == f"{_POSITION}.vz" and _is_up(tables[_POSITION]):
        series["climb_m_s"] = replace(
            climb, values=-climb.values, found_in=f"{_POSITION}.vz, up as the heights say"
        )
    if "WIND" in tables:
        wind = tables["WIND"]
        north, east = wind_north_east_m_s(wind.numbers["speed"], wind.numbers["direction"])
        for name, values in (("wind_north_m_s", north), ("wind_east_m_s", east)):
            series[name] = Series.of(wind.time_s, values, "WIND.speed, direction")
    electrical, remarks = _electrical(tables)
    return series | electrical, remarks


_NEXT_S = 2.0
"""Heights of a link farther apart do not tell a climb. [s]"""


def _is_up(position: MessageTable) -> bool:
    """Return whether a position's vz is positive in climbs, against its definition: as of ArduCopter 3.5."""
    step_s = np.diff(position.time_s)
    climbed = np.diff(position.numbers["relative_alt"])
    down = 0.5 * (position.numbers["vz"][1:] + position.numbers["vz"][:-1])
    near = step_s < _NEXT_S
    return float(np.sum((climbed * down * step_s)[near])) > 0.0


def _electrical(tables: Tables) -> tuple[dict[str, Series], dict[str, str]]:
    table, field = tables.get("SYS_STATUS"), "voltage_battery"
    if table is None or np.all(table.numbers[field] == _NO_VOLTAGE_MV):
        table, field = tables.get("BATTERY_STATUS"), "voltages"
        if table is None:
            return {}, {}
        table = table.rows(table.numbers["id"] == np.min(table.numbers["id"]))
    voltage_mv, current_ca = table.numbers[field], table.numbers["current_battery"]
    return electrical_series(
        table.time_s,
        np.where(voltage_mv == _NO_VOLTAGE_MV, np.nan, voltage_mv * _MM),
        np.where(current_ca == _UNKNOWN_CA, np.nan, current_ca * _CM),
        message=table.name,
        fields=(field, "current_battery"),
    )
