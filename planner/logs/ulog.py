"""Reader of PX4's ULog to a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.geo.geodesy import LocalFrame
from planner.logs.messages import (
    NO_CURRENT_A,
    Damage,
    MessageTable,
    battery_series,
    begin_and_end_s,
    items_flown,
    logged_homes,
    modes_entered,
    quantity_series,
    source_fields,
    sources,
)
from planner.logs.record import AUTO_MISSION, BATTERIES_LEFT_OUT, LoggedItem, Recording, px4_mode
from planner.logs.series import Series, euler_angles_deg
from planner.logs.ulog_messages import read_ulog

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from mmap import mmap

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.logs.messages import Source, Tables
    from planner.logs.record import LogFile
    from planner.logs.ulog_messages import UlogContent


_RELATIVE_FRAME, _AMSL_FRAME, _MISSION_FRAME = 3, 0, 2
_CHANGE_SPEED = 178
"""MAV_CMD_DO_CHANGE_SPEED."""
_LAND = 21
"""MAV_CMD_NAV_LAND."""
_SPEED = "current.cruising_speed"
_ITEM = ("sequence_current", "nav_cmd", "latitude", "longitude", "altitude")
_SETTLED_S = 0.5
"""A setpoint follows its item within this time. [s]"""


def missions_flown(
    items: MessageTable | None,
    setpoints: MessageTable | None,
    modes: tuple[tuple[float, str], ...] = (),
) -> tuple[tuple[float, tuple[LoggedItem, ...]], ...]:
    """Return the mission as far as it was flown, with its time; empty where none is logged.

    PX4 logs an item with a place when it begins it, and the speed it then flies by: a number left
    out before an item from which on another speed is flown was a change of speed.  A place to land at is
    flown to as to a waypoint first, under the number of the landing (``do_need_move_to_land``).  Other modes
    number items of their own.
    """
    if items is None or not items.has(*_ITEM):
        return ()
    found: dict[int, LoggedItem] = {}
    begun_s: dict[int, float] = {}
    entered_s = np.array([time_s for time_s, _ in modes])
    is_mission = np.array([True, *(name == AUTO_MISSION for _, name in modes)])
    rows = np.flatnonzero(is_mission[np.searchsorted(entered_s, items.time_s, side="right")])
    for row in rows.tolist():
        sequence = int(items.numbers["sequence_current"][row])
        begun_s.setdefault(sequence, float(items.time_s[row]))
        if sequence not in found or items.numbers["nav_cmd"][row] == _LAND:
            found[sequence] = _item(items, row, sequence)
    if not found:
        return ()
    if setpoints is not None and setpoints.has(_SPEED):
        found |= _speed_changes(begun_s, setpoints)
    return ((float(items.time_s[0]), tuple(found[number] for number in sorted(found))),)


def _item(items: MessageTable, row: int, sequence: int) -> LoggedItem:
    is_relative = bool(items.value("altitude_is_relative", row))
    return LoggedItem(
        sequence + 1,
        int(items.numbers["nav_cmd"][row]),
        _RELATIVE_FRAME if is_relative else _AMSL_FRAME,
        *(items.value("time_inside", row), None, None, None),
        *(items.value("latitude", row), items.value("longitude", row)),
        items.value("altitude", row),
    )


def _speed_changes(begun_s: dict[int, float], setpoints: MessageTable) -> dict[int, LoggedItem]:
    """Return a change of speed for each number left out after which another speed is flown."""
    speeds = setpoints.numbers[_SPEED]
    changes: dict[int, LoggedItem] = {}
    flown: float | None = None
    for sequence in sorted(begun_s):
        row = int(np.searchsorted(setpoints.time_s, begun_s[sequence] + _SETTLED_S, "right")) - 1
        speed = max(float(speeds[row]), -1.0) if row >= 0 and np.isfinite(speeds[row]) else None
        is_other = speed is not None and speed != (-1.0 if flown is None else flown)
        if is_other and sequence - 1 not in begun_s and sequence > 0:
            changes[sequence - 1] = LoggedItem(
                sequence, _CHANGE_SPEED, _MISSION_FRAME, 1.0, speed, -1.0, None, None, None, None
            )
        flown = flown if speed is None else speed
    return changes


_POSITIONS = "vehicle_local_position"
_ORIGIN = ("ref_lat", "ref_lon", "ref_alt")
_REFERENCES = (
    ("trajectory_setpoint", ("position[0]", "position[1]", "position[2]")),
    ("trajectory_setpoint", ("x", "y", "z")),
    ("vehicle_local_position_setpoint", ("x", "y", "z")),
)
"""Where the commanded position is found, the best place first."""
_AXES = ("north_m", "east_m", "height_m")


def local_series(topics: Tables) -> dict[str, Series]:
    """Return positions and references in the frame of the first origin.

    ``local_…`` and ``reference_…`` series are north, east and up; latitude, longitude and altitude
    are there by the frame where it has an origin.
    """
    topic = topics.get(_POSITIONS)
    if topic is None or not topic.has("x", "y", "z"):
        return {}
    frame, offsets = _origins(topic)
    series: dict[str, Series] = {}
    for axis, field, valid in zip(
        _AXES, ("x", "y", "z"), ("xy_valid", "xy_valid", "z_valid"), strict=True
    ):
        values = _upwards(topic.numbers[field], axis) + offsets[axis]
        if valid in topic.numbers:
            values = np.where(topic.numbers[valid] != 0.0, values, np.nan)
        series[f"local_{axis}"] = Series.of(topic.time_s, values, f"{_POSITIONS}.{field}")
    origin = {axis: Series.of(topic.time_s, offsets[axis], "", is_event=True) for axis in _AXES}
    series |= _references(topics, origin)
    if frame is not None:
        series |= _global(topic, frame, series)
    return {name: found for name, found in series.items() if len(found)}


def position_jumps(topic: MessageTable | None) -> tuple[tuple[float, float], ...]:
    """Return time and size in metres of each reset of the estimate."""
    jumps: list[tuple[float, float]] = []
    for counter, deltas in (
        ("xy_reset_counter", ("delta_xy[0]", "delta_xy[1]")),
        ("z_reset_counter", ("delta_z",)),
    ):
        if topic is not None and topic.has(counter, *deltas):
            resets = np.flatnonzero(np.diff(topic.numbers[counter])) + 1
            squares = [topic.numbers[delta][resets] ** 2 for delta in deltas]
            sizes_m = np.sqrt(np.sum(squares, axis=0))
            jumps += zip(topic.time_s[resets].tolist(), sizes_m.tolist(), strict=True)
    return tuple(sorted(jumps))


def _origins(topic: MessageTable) -> tuple[LocalFrame | None, dict[str, FloatArray]]:
    """Return the frame about the first origin, and where each sample's origin lies in it."""
    offsets = {axis: np.zeros(topic.time_s.shape) for axis in _AXES}
    if not topic.has(*_ORIGIN):
        return None, offsets
    latitude, longitude, altitude = (topic.numbers[field] for field in _ORIGIN)
    known = np.isfinite(latitude) & np.isfinite(longitude) & np.isfinite(altitude)
    known &= (np.abs(latitude) <= 90.0) & ((latitude != 0.0) | (longitude != 0.0))
    if "xy_global" in topic.numbers:
        known &= topic.numbers["xy_global"] != 0.0
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


def _references(topics: Tables, origin: Mapping[str, Series]) -> dict[str, Series]:
    for name, fields in _REFERENCES:
        topic = topics.get(name)
        if topic is None or not topic.has(*fields):
            continue
        series = {}
        for axis, field in zip(_AXES, fields, strict=True):
            offset = np.nan_to_num(origin[axis].at(topic.time_s), nan=0.0)
            values = _upwards(topic.numbers[field], axis) + offset
            series[f"reference_{axis}"] = Series.of(topic.time_s, values, f"{name}.{field}")
        if any(len(found) for found in series.values()):
            return series
    return {}


def _global(
    topic: MessageTable, frame: LocalFrame, local: Mapping[str, Series]
) -> dict[str, Series]:
    """Return global positions from local ones; used where PX4 logs no global position."""
    north, east = local["local_north_m"], local["local_east_m"]
    if len(north) != len(east):
        return {}
    latitude_deg, longitude_deg = frame.latitude_longitude_deg(east.values, north.values)
    altitude = topic.numbers["ref_alt"]
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


_DEG_E7 = 1e-7
_MM = 1e-3
_GPS = "vehicle_gps_position", "sensor_gps"
_WINDS = "wind", "estimator_wind", "wind_estimate"


def _of(topics: tuple[str, ...], field: str) -> tuple[str, ...]:
    return tuple(f"{topic}.{field}" for topic in topics)


_QUANTITIES: Mapping[str, tuple[Source, ...]] = {
    "latitude_deg": (
        *sources("vehicle_global_position.lat", valid="lat_lon_valid"),
        *sources(*_of(_GPS, "latitude_deg")),
        *sources(*_of(_GPS, "lat"), unit=_DEG_E7),
    ),
    "longitude_deg": (
        *sources("vehicle_global_position.lon", valid="lat_lon_valid"),
        *sources(*_of(_GPS, "longitude_deg")),
        *sources(*_of(_GPS, "lon"), unit=_DEG_E7),
    ),
    "altitude_amsl_m": (
        *sources("vehicle_global_position.alt", valid="alt_valid"),
        *sources(*_of(_GPS, "altitude_msl_m")),
        *sources(*_of(_GPS, "alt"), unit=_MM),
    ),
    "velocity_north_m_s": (
        *sources("vehicle_local_position.vx", valid="v_xy_valid"),
        *sources(*_of(_GPS, "vel_n_m_s"), valid="vel_ned_valid"),
    ),
    "velocity_east_m_s": (
        *sources("vehicle_local_position.vy", valid="v_xy_valid"),
        *sources(*_of(_GPS, "vel_e_m_s"), valid="vel_ned_valid"),
    ),
    "climb_m_s": (
        *sources("vehicle_local_position.vz", unit=-1.0, valid="v_z_valid"),
        *sources(*_of(_GPS, "vel_d_m_s"), unit=-1.0, valid="vel_ned_valid"),
    ),
    "reference_velocity_north_m_s": sources(
        "trajectory_setpoint.velocity[0]",
        "trajectory_setpoint.vx",
        "vehicle_local_position_setpoint.vx",
    ),
    "reference_velocity_east_m_s": sources(
        "trajectory_setpoint.velocity[1]",
        "trajectory_setpoint.vy",
        "vehicle_local_position_setpoint.vy",
    ),
    "reference_climb_m_s": sources(
        "trajectory_setpoint.velocity[2]",
        "trajectory_setpoint.vz",
        "vehicle_local_position_setpoint.vz",
        unit=-1.0,
    ),
    "airspeed_m_s": sources("airspeed_validated.true_airspeed_m_s", "airspeed.true_airspeed_m_s"),
    "wind_north_m_s": sources(*_of(_WINDS, "windspeed_north")),
    "wind_east_m_s": sources(*_of(_WINDS, "windspeed_east")),
}
"""Where each quantity is found, the best place first.

References are the path as it is shaped (trajectory_setpoint); the local setpoint has the
correction of the position error on top, and is taken only where the other is not logged.
"""
_XYZ = ("x", "y", "z")
_FURTHER_FIELDS: Mapping[str, tuple[str, ...]] = {
    "actuator_armed": ("armed",),
    "battery_status": ("voltage_v", "current_a"),
    "home_position": ("lat", "lon", "alt"),
    "mission_result": ("seq_current",),
    "navigator_mission_item": (*_ITEM, "altitude_is_relative", "time_inside"),
    "position_setpoint_triplet": (_SPEED,),
    "trajectory_setpoint": (*_XYZ, *(f"position[{axis}]" for axis in range(3))),
    "vehicle_attitude": tuple(f"q[{index}]" for index in range(4)),
    "vehicle_land_detected": ("landed",),
    _POSITIONS: (
        *_XYZ,
        *_ORIGIN,
        *("xy_valid", "z_valid", "xy_global"),
        *("xy_reset_counter", "delta_xy[0]", "delta_xy[1]", "z_reset_counter", "delta_z"),
    ),
    "vehicle_local_position_setpoint": _XYZ,
    "vehicle_status": ("arming_state", "armed_time", "nav_state"),
}
_VALID = {
    (place.message, place.valid)
    for places in _QUANTITIES.values()
    for place in places
    if place.valid
}
_OF_QUANTITIES = source_fields(_QUANTITIES)
WANTED: Mapping[str, frozenset[str]] = {
    topic: frozenset(
        (
            *_OF_QUANTITIES.get(topic, ()),
            *_FURTHER_FIELDS.get(topic, ()),
            *(name for message, name in _VALID if message == topic),
        )
    )
    for topic in {*_OF_QUANTITIES, *_FURTHER_FIELDS}
}
"""The fields read, by topic; the rest stays on the disk."""


def _attitude(topic: MessageTable | None) -> dict[str, Series]:
    names = [f"q[{index}]" for index in range(4)]
    if topic is None or not topic.has(*names):
        return {}
    angles_deg = euler_angles_deg(*(topic.numbers[name] for name in names))
    return {
        name: Series.of(topic.time_s, values, f"{topic.name}.q", period=period)
        for name, values, period in zip(
            ("roll_deg", "pitch_deg", "yaw_deg"), angles_deg, (360.0, None, 360.0), strict=True
        )
    }


_ARMED = 2
"""ARMING_STATE_ARMED of vehicle_status, the same in every version."""


def ulog_recordings(data: mmap, file: LogFile) -> tuple[Recording, ...]:
    """Return the one recording that a ULog holds: PX4 begins a new log when it restarts."""
    damage = Damage()
    log = read_ulog(data, WANTED, damage, source=file.source)
    topics: Tables = {}
    for _, topic in sorted(log.topics, key=lambda row: row[0]):
        topics.setdefault(topic.name, topic)
    if not topics:
        program = log.info.get("sys_name") or log.info.get("Application")
        whose = f" of {program}" if isinstance(program, str) else ""
        msg = f"is a ULog{whose} without any of PX4's topics: nothing of a flight is in it"
        raise LogFileError(msg, source=file.source)
    series = local_series(topics) | quantity_series(topics, _QUANTITIES)
    series |= _attitude(topics.get("vehicle_attitude"))
    electrical, remarks = battery_series(topics.get("battery_status"), "voltage_v", "current_a")
    modes: tuple[tuple[float, str], ...] = ()
    status = topics.get("vehicle_status")
    if status is not None and status.has("nav_state"):
        names = [px4_mode(int(state)) for state in status.numbers["nav_state"].tolist()]
        modes = modes_entered(status.time_s, names)
    begin_s, end_s = begin_and_end_s(topics)
    return (
        Recording(
            file=file,
            begin_s=begin_s,
            end_s=end_s,
            series=series | electrical,
            is_armed=_armed(topics),
            is_landed=_state(topics.get("vehicle_land_detected"), "landed"),
            modes=modes,
            modes_found_in="vehicle_status.nav_state",
            mission_item=items_flown(
                topics.get("mission_result"), "seq_current", 1, modes, AUTO_MISSION
            ),
            homes=logged_homes(topics.get("home_position"), ("lat", "lon", "alt")),
            missions=missions_flown(
                topics.get("navigator_mission_item"), topics.get("position_setpoint_triplet"), modes
            ),
            parameters=log.parameters,
            autopilot=Autopilot.PX4,
            firmware=_firmware(log),
            vehicle=_vehicle(log),
            position_jumps=position_jumps(topics.get(_POSITIONS)),
            remarks=remarks,
            findings=(
                *damage.findings(file.source, len(data), "bytes"),
                *log.findings,
                *_other_batteries(log.topics, file.source),
            ),
        ),
    )


def _state(topic: MessageTable | None, field: str) -> Series | None:
    if topic is None or not topic.has(field):
        return None
    return topic.events(field, topic.numbers[field] != 0.0)


def _armed(topics: Tables) -> Series | None:
    """Return arming and disarming; the status comes seldom but has the time of arming."""
    status = topics.get("vehicle_status")
    if status is None or not status.has("arming_state"):
        return _state(topics.get("actuator_armed"), "armed")
    is_armed = status.numbers["arming_state"] == _ARMED
    since_s = status.numbers.get("armed_time", np.zeros(status.time_s.shape)) * 1e-6
    is_reported = is_armed & (since_s > 0.0) & (since_s <= status.time_s)
    begins = np.append([True], is_armed[1:] & ~is_armed[:-1])
    times = np.where(is_reported & begins, since_s, status.time_s)
    return Series.of(times, is_armed, "vehicle_status.arming_state", is_event=True)


def _firmware(log: UlogContent) -> str:
    """Return the name and the version that ``ver_sw_release`` packs into its bytes."""
    name = log.info.get("sys_name", "PX4")
    release = log.info.get("ver_sw_release")
    if not isinstance(release, int):
        return str(name)
    major, minor, patch, kind = (release & 0xFFFF_FFFF).to_bytes(4, "big")
    stages = ((255, ""), (192, "-rc"), (128, "-beta"), (64, "-alpha"), (0, "-dev"))
    stage = next(text for least, text in stages if kind >= least)
    return f"{name} {major}.{minor}.{patch}{stage}"


def _vehicle(log: UlogContent) -> str:
    first = {name: value for time_s, name, value in log.parameters if time_s == -np.inf}
    airframe, hardware = first.get("SYS_AUTOSTART"), log.info.get("ver_hw")
    parts = [f"airframe {airframe:.0f}" if airframe else "", str(hardware or "")]
    return ", ".join(part for part in parts if part)


def _other_batteries(
    topics: tuple[tuple[int, MessageTable], ...], source: str
) -> Iterator[Finding]:
    currents_a = {
        instance: topic.numbers["current_a"]
        for instance, topic in topics
        if topic.name == "battery_status" and topic.has("current_a")
    }
    first = min(currents_a, default=0)
    for instance, current_a in currents_a.items():
        most_a = float(np.nanmax(current_a, initial=0.0))
        if instance != first and most_a > NO_CURRENT_A:
            yield BATTERIES_LEFT_OUT.finding(
                f"{source}: battery_status of instance {instance} shows up to {most_a:.1f} A; "
                f"only instance {first} is used"
            )
