"""Reader of PX4's ULog to a recording."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.autopilot import Autopilot
from planner.catalogue.flight_log import BATTERIES_LEFT_OUT, LOG_DAMAGED
from planner.errors import LogFileError
from planner.logs.electrical import NO_CURRENT_A, electrical_series
from planner.logs.items_flown import items_flown
from planner.logs.px4_modes import AUTO_MISSION, px4_mode
from planner.logs.record import LoggedHome
from planner.logs.recording import Recording
from planner.logs.series import Series
from planner.logs.ulog_local_frame import local_series, position_jumps
from planner.logs.ulog_mission import missions_flown
from planner.logs.ulog_topics import TOPICS, Topic, quantity_series

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.logs.recording import LogFile

MAGIC = b"ULog\x01\x12\x35"
"""The first bytes of a ULog."""

_ARMED = 2
"""ARMING_STATE_ARMED of vehicle_status, the same in every version."""
_BACK_S = 1.0


def ulog_recordings(file: LogFile) -> tuple[Recording, ...]:
    """Return what a ULog tells.

    Parameters
    ----------
    file : LogFile
        Which file it is.

    Returns
    -------
    tuple of Recording
        Exactly one: PX4 begins a new log when it restarts.

    Raises
    ------
    LogFileError
        If it is broken, or no log of PX4.
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
    """Return arming and disarming; the status comes seldom but says since when it is armed."""
    status = topics.get("vehicle_status")
    if status is None or "arming_state" not in status.fields:
        return _state(topics.get("actuator_armed"), "armed")
    is_armed = status.fields["arming_state"] == _ARMED
    since_s = status.fields.get("armed_time", np.zeros(status.time_s.shape)) * 1e-6
    is_told = is_armed & (since_s > 0.0) & (since_s <= status.time_s)
    begins = np.append([True], is_armed[1:] & ~is_armed[:-1])
    times = np.where(is_told & begins, since_s, status.time_s)
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
        yield LOG_DAMAGED.finding(f"{source}: parts of the log are no messages of a ULog: left out")
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
