"""The messages of a telemetry log as columns, by vehicle, on the vehicle's own clock."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.errors import LogFileError
from planner.frozen import frozen
from planner.logs.tlog_frames import Damage, frames

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from mmap import mmap

    from planner.logs.record import BoolArray, FloatArray, IntArray

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
"""Messages about a vehicle that its ground station may have sent."""
_TEXTS = frozenset(("text", "param_id"))
_NO_VOLTAGE_MV = 65535
_GROUND_STATION, _NO_AUTOPILOT = 6, 8
"""MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID."""
_AUTOPILOT_COMPONENT = 1


@dataclass(slots=True)
class _Rows:
    """The messages of one kind so far."""

    places: array[int] = field(default_factory=lambda: array("q"))
    stamps_s: array[float] = field(default_factory=lambda: array("d"))
    numbers: dict[str, array[float]] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)


@frozen(eq=False)
class Messages:
    """The messages of one kind, as columns."""

    places: IntArray
    stamps_s: FloatArray
    """By the ground station's clock. [s]"""
    numbers: Mapping[str, FloatArray]
    """Fields as they are sent, NaN where a message of an old version lacks them."""
    texts: Mapping[str, tuple[str, ...]]

    def rows(self, chosen: BoolArray) -> Messages:
        """Return some of the messages."""
        return Messages(
            places=self.places[chosen],
            stamps_s=self.stamps_s[chosen],
            numbers={name: values[chosen] for name, values in self.numbers.items()},
            texts={
                name: tuple(text for text, is_in in zip(texts, chosen, strict=True) if is_in)
                for name, texts in self.texts.items()
            },
        )


def messages_by_vehicle(data: mmap, source: str, damage: Damage) -> dict[int, dict[str, Messages]]:
    """Return the messages of each vehicle in a telemetry log, by its system id and their name.

    Parameters
    ----------
    data : mmap
        The file.
    source : str
        What errors call it.
    damage : Damage
        Filled with what is no frame.

    Returns
    -------
    dict of dict
        Systems with a heartbeat of an autopilot; mission items sent to a vehicle are among its own.

    Raises
    ------
    LogFileError
        If pymavlink is not installed.
    """
    try:
        from pymavlink.dialects.v20 import ardupilotmega as mavlink
    except ImportError as error:
        msg = "telemetry needs pymavlink; install it with: pip install 'mavjoule[identify]'"
        raise LogFileError(msg, source=source) from error
    names = {kind.id: kind.msgname for kind in mavlink.mavlink_map.values()}
    wanted = frozenset(number for number, name in names.items() if name in WANTED)
    decoder = mavlink.MAVLink(None)
    found: dict[int, dict[str, _Rows]] = {}
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
        system: {name: _messages(rows) for name, rows in tables.items()}
        for system, tables in found.items()
        if system in vehicles
    }


def boot_time_s(tables: Iterable[Messages]) -> dict[int, FloatArray]:
    """Return the times of messages on the vehicle's clock, by the identity of their table.

    Messages that carry no time of their own came as much after the last one that does as the
    ground station's clock says.  Where none does, the ground station's clock is all there is.

    Parameters
    ----------
    tables : iterable of Messages
        All messages of one vehicle.

    Returns
    -------
    dict
        Times of each table, by its ``id``. [s]
    """
    every = list(tables)
    timed = [table for table in every if "time_boot_ms" in table.numbers]
    if not timed:
        return {id(table): table.stamps_s for table in every}
    places = np.concatenate([table.places for table in timed])
    order = np.argsort(places)
    lag_s = np.concatenate(
        [table.stamps_s - table.numbers["time_boot_ms"] * 1e-3 for table in timed]
    )[order]
    places = places[order]
    times: dict[int, FloatArray] = {}
    for table in every:
        if "time_boot_ms" in table.numbers:
            times[id(table)] = table.numbers["time_boot_ms"] * 1e-3
        else:
            before = np.searchsorted(places, table.places, side="right") - 1
            times[id(table)] = table.stamps_s - lag_s[np.maximum(before, 0)]
    return times


def _is_vehicle(heartbeat: Any) -> bool:  # noqa: ANN401 - pymavlink has no types
    return bool(heartbeat.type != _GROUND_STATION and heartbeat.autopilot != _NO_AUTOPILOT)


def _add(
    tables: dict[str, _Rows],
    name: str,
    place: int,
    stamp_s: float,
    message: Any,  # noqa: ANN401 - pymavlink has no types
) -> None:
    rows = tables.get(name)
    if rows is None:
        fields = WANTED[name]
        rows = tables[name] = _Rows(
            numbers={field: array("d") for field in fields if field not in _TEXTS},
            texts={field: [] for field in fields if field in _TEXTS},
        )
    rows.places.append(place)
    rows.stamps_s.append(stamp_s)
    for field_name, values in rows.numbers.items():
        if field_name == "voltages":
            values.append(_sum_mv(message.voltages))
        else:
            values.append(getattr(message, field_name, np.nan))
    for field_name, texts in rows.texts.items():
        texts.append(str(getattr(message, field_name)))


def _sum_mv(cells: Iterable[int]) -> float:
    """Return the voltage of all cells; NaN where none is told."""
    told = [cell for cell in cells if cell != _NO_VOLTAGE_MV]
    return float(sum(told)) if told else np.nan


def _messages(rows: _Rows) -> Messages:
    return Messages(
        places=np.array(rows.places, np.int64),
        stamps_s=np.array(rows.stamps_s, np.float64),
        numbers={name: np.array(values, np.float64) for name, values in rows.numbers.items()},
        texts={name: tuple(texts) for name, texts in rows.texts.items()},
    )
