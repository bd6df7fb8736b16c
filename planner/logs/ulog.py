"""Reader of PX4's ULog to a recording."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.geo.geodesy import LocalFrame
from planner.logs.record import (
    AUTO_MISSION,
    BATTERIES_LEFT_OUT,
    LOG_DAMAGED,
    LoggedHome,
    LoggedItem,
    Recording,
    px4_mode,
    sources,
)
from planner.logs.series import (
    NO_CURRENT_A,
    Series,
    electrical_series,
    euler_angles_deg,
    items_flown,
)
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.logs.record import LogFile, Source


_RELATIVE_FRAME, _AMSL_FRAME, _MISSION_FRAME = 3, 0, 2
_CHANGE_SPEED = 178
"""MAV_CMD_DO_CHANGE_SPEED."""
_SPEED = "current.cruising_speed"
_SETTLED_S = 0.5
"""A setpoint follows its item within this time. [s]"""


def missions_flown(
    items: Topic | None, setpoints: Topic | None
) -> tuple[tuple[float, tuple[LoggedItem, ...]], ...]:
    """Return the mission as far as it was flown.

    PX4 logs an item with a place when it begins it, and the speed it then flies by: a number left
    out before an item from which on another speed is flown was a change of speed.

    Returns
    -------
    tuple
        Time and items of the only mission; empty where none is logged.
    """
    needed = ("sequence_current", "nav_cmd", "latitude", "longitude", "altitude")
    if items is None or not set(needed) <= items.fields.keys():
        return ()
    found: dict[int, LoggedItem] = {}
    begun_s: dict[int, float] = {}
    for row, time_s in enumerate(items.time_s.tolist()):
        sequence = int(items.fields["sequence_current"][row])
        begun_s.setdefault(sequence, time_s)
        found.setdefault(sequence, _item(items, row, sequence))
    if setpoints is not None and _SPEED in setpoints.fields:
        found |= _speed_changes(begun_s, setpoints)
    return ((float(items.time_s[0]), tuple(found[number] for number in sorted(found))),)


def _item(items: Topic, row: int, sequence: int) -> LoggedItem:
    latitude, longitude, altitude = (
        value if np.isfinite(value) else None
        for value in (
            float(items.fields[name][row]) for name in ("latitude", "longitude", "altitude")
        )
    )
    is_relative = items.fields.get("altitude_is_relative", np.zeros(row + 1))[row] != 0.0
    hold_s = float(items.fields.get("time_inside", np.full(row + 1, np.nan))[row])
    return LoggedItem(
        sequence + 1,
        int(items.fields["nav_cmd"][row]),
        _RELATIVE_FRAME if is_relative else _AMSL_FRAME,
        hold_s if np.isfinite(hold_s) else None,
        None,
        None,
        None,
        latitude,
        longitude,
        altitude,
    )


def _speed_changes(begun_s: dict[int, float], setpoints: Topic) -> dict[int, LoggedItem]:
    """Return a change of speed for each number left out after which another speed is flown."""
    speeds = setpoints.fields[_SPEED]
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


def local_series(topics: Mapping[str, Topic]) -> dict[str, Series]:
    """Return positions and references in the frame of the first origin.

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


TOPICS = (
    *("actuator_armed", "airspeed", "airspeed_validated", "battery_status"),
    *("estimator_wind", "home_position", "mission_result", "navigator_mission_item"),
    *("position_setpoint_triplet", "sensor_gps", "trajectory_setpoint"),
    *("vehicle_attitude", "vehicle_global_position", "vehicle_gps_position"),
    *("vehicle_land_detected", "vehicle_local_position"),
    *("vehicle_local_position_setpoint", "vehicle_status", "wind", "wind_estimate"),
)
"""What is read of a log; the rest stays on the disk."""


class Topic(Value, eq=False):
    """The samples of one instance of a topic."""

    name: str
    instance: int
    time_s: FloatArray
    """Since boot. [s]"""
    fields: Mapping[str, FloatArray]

    def series(
        self,
        field: str,
        *,
        unit: float = 1.0,
        period: float | None = None,
        valid: str | None = None,
    ) -> Series | None:
        """Return a field as a series; ``None`` where it is missing or never known.

        Parameters
        ----------
        valid : str, optional
            Field that marks valid samples, where the topic has it.
        """
        values = self.fields.get(field)
        if values is None:
            return None
        values = values * unit
        if valid is not None and valid in self.fields:
            values = np.where(self.fields[valid] != 0.0, values, np.nan)
        series = Series.of(self.time_s, values, f"{self.name}.{field}", period=period)
        return series if len(series) else None


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

_PERIODS = {"longitude_deg": 360.0}


def quantity_series(topics: Mapping[str, Topic]) -> dict[str, Series]:
    """Return the quantities that topics hold directly."""
    series: dict[str, Series] = {}
    for name, places in _QUANTITIES.items():
        for source in places:
            topic = topics.get(source.message)
            found = topic and topic.series(
                source.field, unit=source.unit, period=_PERIODS.get(name), valid=source.valid
            )
            if found:
                series[name] = found
                break
    return series | _attitude(topics.get("vehicle_attitude"))


def _attitude(topic: Topic | None) -> dict[str, Series]:
    """Return roll, pitch and yaw of a quaternion from body to north-east-down."""
    names = [f"q[{index}]" for index in range(4)]
    if topic is None or not set(names) <= topic.fields.keys():
        return {}
    roll_deg, pitch_deg, yaw_deg = euler_angles_deg(*(topic.fields[name] for name in names))
    found_in = f"{topic.name}.q"
    return {
        "roll_deg": Series.of(topic.time_s, roll_deg, found_in, period=360.0),
        "pitch_deg": Series.of(topic.time_s, pitch_deg, found_in),
        "yaw_deg": Series.of(topic.time_s, yaw_deg, found_in, period=360.0),
    }


MAGIC = b"ULog\x01\x12\x35"
"""The first bytes of a ULog."""

_ARMED = 2
"""ARMING_STATE_ARMED of vehicle_status, the same in every version."""
_BACK_S = 1.0


def ulog_recordings(file: LogFile) -> tuple[Recording, ...]:
    """Return what a ULog holds.

    Returns
    -------
    tuple of Recording
        Exactly one: PX4 begins a new log when it restarts.
    """
    log = _parsed(file.source)
    instances = list(_topics(log))
    topics: dict[str, Topic] = {}
    for topic in sorted(instances, key=lambda topic: topic.instance):
        topics.setdefault(topic.name, topic)
    if not topics:
        program = log.msg_info_dict.get("sys_name") or log.msg_info_dict.get("Application")
        whose = f" of {program}" if isinstance(program, str) else ""
        msg = f"is a ULog{whose} without any of PX4's topics: nothing of a flight is in it"
        raise LogFileError(msg, source=file.source)
    for topic in topics.values():
        if np.any(np.diff(topic.time_s) < -_BACK_S):
            msg = f"the clock of {topic.name} goes backwards: no log of one flight of PX4"
            raise LogFileError(msg, source=file.source)
    electrical, remarks = _electrical(topics.get("battery_status"))
    modes = _modes(topics.get("vehicle_status"))
    return (
        Recording(
            file=file,
            begin_s=min(float(topic.time_s[0]) for topic in topics.values()),
            end_s=max(float(topic.time_s[-1]) for topic in topics.values()),
            series=local_series(topics) | quantity_series(topics) | electrical,
            is_armed=_armed(topics),
            is_landed=_state(topics.get("vehicle_land_detected"), "landed"),
            modes=modes,
            modes_found_in="vehicle_status.nav_state",
            mission_item=_mission_item(topics.get("mission_result"), modes),
            homes=_homes(topics.get("home_position")),
            missions=missions_flown(
                topics.get("navigator_mission_item"), topics.get("position_setpoint_triplet")
            ),
            parameters=_parameters(log),
            autopilot=Autopilot.PX4,
            firmware=_firmware(log),
            vehicle=_vehicle(log),
            position_jumps=position_jumps(topics),
            remarks=remarks,
            findings=tuple(_findings(log, instances, file.source)),
        ),
    )


def _parsed(source: str) -> Any:  # noqa: ANN401 - pyulog has no types
    try:
        from pyulog import ULog
    except ImportError as error:
        msg = "a ULog needs pyulog; install it with: pip install 'mavjoule[identify]'"
        raise LogFileError(msg, source=source) from error
    try:
        # What it prints of broken logs is for its own developers.
        with Path(source).open("rb") as file, contextlib.redirect_stdout(io.StringIO()):
            return ULog(file, list(TOPICS), disable_str_exceptions=True)
    except Exception as error:  # pyulog lets through whatever garbage causes
        msg = f"is broken: {type(error).__name__} while reading it as a ULog"
        raise LogFileError(msg, source=source) from error


def _topics(log: Any) -> Iterator[Topic]:  # noqa: ANN401 - pyulog has no types
    for data in log.data_list:
        columns = {
            name: values
            for name, values in data.data.items()
            if isinstance(values, np.ndarray) and values.dtype.kind in "iufb"
        }
        if data.name in TOPICS and "timestamp" in columns and len(columns["timestamp"]):
            yield Topic(
                name=data.name,
                instance=int(data.multi_id),
                time_s=columns["timestamp"] * 1e-6,
                fields={
                    name: values.astype(np.float64)
                    for name, values in columns.items()
                    if name != "timestamp"
                },
            )


def _electrical(topic: Topic | None) -> tuple[dict[str, Series], dict[str, str]]:
    if topic is None:
        return {}, {}
    return electrical_series(
        topic.time_s,
        topic.fields.get("voltage_v"),
        topic.fields.get("current_a"),
        message=topic.name,
        fields=("voltage_v", "current_a"),
    )


def _state(topic: Topic | None, field: str) -> Series | None:
    if topic is None or field not in topic.fields:
        return None
    states = topic.fields[field] != 0.0
    return Series.of(topic.time_s, states, f"{topic.name}.{field}", is_event=True)


def _armed(topics: Mapping[str, Topic]) -> Series | None:
    """Return arming and disarming; the status comes seldom but has the time of arming."""
    status = topics.get("vehicle_status")
    if status is None or "arming_state" not in status.fields:
        return _state(topics.get("actuator_armed"), "armed")
    is_armed = status.fields["arming_state"] == _ARMED
    since_s = status.fields.get("armed_time", np.zeros(status.time_s.shape)) * 1e-6
    is_reported = is_armed & (since_s > 0.0) & (since_s <= status.time_s)
    begins = np.append([True], is_armed[1:] & ~is_armed[:-1])
    times = np.where(is_reported & begins, since_s, status.time_s)
    return Series.of(times, is_armed, "vehicle_status.arming_state", is_event=True)


def _modes(topic: Topic | None) -> tuple[tuple[float, str], ...]:
    if topic is None or "nav_state" not in topic.fields:
        return ()
    states = topic.fields["nav_state"]
    entered = np.append([True], states[1:] != states[:-1])
    names = [px4_mode(int(state)) for state in states[entered].tolist()]
    return tuple(zip(topic.time_s[entered].tolist(), names, strict=True))


def _mission_item(topic: Topic | None, modes: tuple[tuple[float, str], ...]) -> Series | None:
    """Return the item flown; PX4 counts from 0."""
    if topic is None or "seq_current" not in topic.fields:
        return None
    items = topic.fields["seq_current"] + 1.0
    found_in = "mission_result.seq_current"
    return items_flown(topic.time_s, items, modes, AUTO_MISSION, found_in)


def _homes(topic: Topic | None) -> tuple[tuple[float, LoggedHome], ...]:
    if topic is None or not {"lat", "lon", "alt"} <= topic.fields.keys():
        return ()
    homes: list[tuple[float, LoggedHome]] = []
    for row, time_s in enumerate(topic.time_s.tolist()):
        latitude, longitude, altitude = (
            float(topic.fields[field][row]) for field in ("lat", "lon", "alt")
        )
        if 0.0 < abs(latitude) <= 90.0 and np.isfinite(longitude):
            home = LoggedHome(
                latitude_deg=latitude,
                longitude_deg=longitude,
                altitude_amsl_m=altitude if np.isfinite(altitude) else None,
                found_in=topic.name,
            )
            homes.append((time_s, home))
    return tuple(homes)


def _parameters(log: Any) -> tuple[tuple[float, str, float], ...]:  # noqa: ANN401 - as above
    rows = [(-np.inf, name, value) for name, value in log.initial_parameters.items()]
    rows += [(time_us * 1e-6, name, value) for time_us, name, value in log.changed_parameters]
    return tuple(
        (float(time_s), str(name), float(value))
        for time_s, name, value in rows
        if isinstance(value, int | float) and np.isfinite(value)
    )


def _firmware(log: Any) -> str:  # noqa: ANN401 - as above
    """Return the name and the version that ``ver_sw_release`` packs into its bytes."""
    name = log.msg_info_dict.get("sys_name", "PX4")
    release = log.msg_info_dict.get("ver_sw_release")
    if not isinstance(release, int):
        return str(name)
    major, minor, patch, kind = release.to_bytes(4, "big", signed=release < 0)
    stages = ((255, ""), (192, "-rc"), (128, "-beta"), (64, "-alpha"), (0, "-dev"))
    stage = next(text for least, text in stages if kind >= least)
    return f"{name} {major}.{minor}.{patch}{stage}"


def _vehicle(log: Any) -> str:  # noqa: ANN401 - as above
    airframe = log.initial_parameters.get("SYS_AUTOSTART")
    hardware = log.msg_info_dict.get("ver_hw")
    parts = [f"airframe {airframe}" if airframe else "", str(hardware or "")]
    return ", ".join(part for part in parts if part)


def _findings(log: Any, topics: list[Topic], source: str) -> Iterator[Finding]:  # noqa: ANN401
    if log.file_corruption:
        yield LOG_DAMAGED.finding(
            f"{source}: parts of the log are not messages of a ULog: left out"
        )
    batteries = [
        topic for topic in topics if topic.name == "battery_status" and "current_a" in topic.fields
    ]
    first = min((topic.instance for topic in batteries), default=0)
    for topic in batteries:
        most_a = float(np.nanmax(topic.fields["current_a"], initial=0.0))
        if topic.instance != first and most_a > NO_CURRENT_A:
            yield BATTERIES_LEFT_OUT.finding(
                f"{source}: battery_status of instance {topic.instance} shows up to {most_a:.1f} A; "
                f"only instance {first} is used"
            )
