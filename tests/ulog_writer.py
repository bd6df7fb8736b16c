"""A writer of ULog files, from the description of the format, for the tests of the reader."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import made_flight as made
from made_missions import METRES_PER_DEGREE_NORTH

_MAGIC = b"ULog\x01\x12\x35\x00"
_KINDS = {"uint64_t": "Q", "float": "f", "double": "d", "uint8_t": "B", "bool": "?", "int32_t": "i"}
_KINDS |= {"uint16_t": "H"}


@dataclass(slots=True)
class UlogWriter:
    """The messages of a log so far."""

    definitions: bytearray = field(default_factory=bytearray)
    data: bytearray = field(default_factory=bytearray)
    _layouts: dict[str, str] = field(default_factory=dict)
    _numbers: dict[tuple[str, int], int] = field(default_factory=dict)

    def text(self, key: str, text: str) -> None:
        """Write a text about the log."""
        self._keyed(b"I", f"char[{len(text)}] {key}", text.encode())

    def version(self, number: int) -> None:
        """Write the packed version of the firmware."""
        self._keyed(b"I", "uint32_t ver_sw_release", struct.pack("<I", number))

    def parameter(self, name: str, value: float) -> None:
        """Write a parameter."""
        self._keyed(b"P", f"float {name}", struct.pack("<f", value))

    def define(self, topic: str, fields: str) -> None:
        """Write the definition of a topic: ``float x;float y``; the time comes first by itself."""
        kinds = [entry.split()[0] for entry in fields.split(";")]
        self._layouts[topic] = "<Q" + "".join(
            _KINDS[kind] if "[" not in kind else _array(kind) for kind in kinds
        )
        text = f"{topic}:uint64_t timestamp;{fields};"
        self.definitions += _message(b"F", text.encode())

    def add(self, topic: str, time_s: float, *values: float, instance: int = 0) -> None:
        """Write a sample."""
        key = topic, instance
        if key not in self._numbers:
            self._numbers[key] = len(self._numbers)
            body = struct.pack("<BH", instance, self._numbers[key]) + topic.encode()
            self.data += _message(b"A", body)
        sample = struct.pack(self._layouts[topic], round(time_s * 1e6), *values)
        self.data += _message(b"D", struct.pack("<H", self._numbers[key]) + sample)

    def content(self) -> bytes:
        """Return the log."""
        return _MAGIC + struct.pack("<Q", 0) + bytes(self.definitions + self.data)

    def _keyed(self, kind: bytes, key: str, value: bytes) -> None:
        self.definitions += _message(kind, bytes([len(key)]) + key.encode() + value)


def _array(kind: str) -> str:
    name, count = kind.rstrip("]").split("[")
    return count + _KINDS[name]


def _message(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<H", len(body)) + kind + body


def px4_log(
    log: UlogWriter | None = None,
    *,
    current_a: float | None = None,
    reference: tuple[str, ...] = ("position", "velocity"),
    origin_moves_s: float | None = None,
    jump_s: float | None = None,
    jump_m: tuple[float, float] = (3.0, -4.0),
) -> UlogWriter:
    """Return the made flight as PX4 logs it by default.

    Parameters
    ----------
    log : UlogWriter, optional
        What it is written by.
    current_a : float, optional
        What the current sensor always shows, instead of what flows.
    reference : tuple of str, optional
        Names of the arrays of trajectory_setpoint; empty for the names before 1.14.
    origin_moves_s : float, optional
        When the origin of the local frame moves 100 m north and 10 m up.
    jump_s : float, optional
        When the estimate is reset.
    jump_m : tuple of float
        By how much, north and east. [m]
    """
    log = UlogWriter() if log is None else log
    log.text("sys_name", "PX4")
    log.version(0x01_0F_03_FF)
    log.parameter("SYS_AUTOSTART", 4001.0)
    log.parameter("MPC_XY_CRUISE", 5.0)
    log.define("vehicle_status", "uint64_t armed_time;uint8_t arming_state;uint8_t nav_state")
    log.define("vehicle_land_detected", "bool landed")
    log.define("home_position", "double lat;double lon;float alt")
    log.define("mission_result", "uint16_t seq_current")
    log.define("battery_status", "float voltage_v;float current_a")
    log.define("vehicle_attitude", "float[4] q")
    log.define("vehicle_global_position", "double lat;double lon;float alt")
    log.define(
        "vehicle_local_position",
        "float x;float y;float z;float vx;float vy;float vz;double ref_lat;double ref_lon;"
        "float ref_alt;bool xy_valid;bool z_valid;bool v_xy_valid;bool v_z_valid;bool xy_global;"
        "uint8_t xy_reset_counter;float[2] delta_xy",
    )
    arrays = ";".join(f"float[3] {name}" for name in reference)
    log.define(
        "trajectory_setpoint", arrays or "float x;float y;float z;float vx;float vy;float vz"
    )
    log.add("home_position", 0.0, made.LATITUDE_DEG, made.LONGITUDE_DEG, made.GROUND_AMSL_M)
    for moment in made.moments():
        _add_moment(log, moment, current_a, origin_moves_s, (jump_s, jump_m))
    return log


def _add_moment(
    log: UlogWriter,
    moment: made.Moment,
    current_a: float | None,
    origin_moves_s: float | None,
    jump: tuple[float | None, tuple[float, float]],
) -> None:
    now = moment.time_s
    is_armed = made.ARMED_S <= now < made.DISARMED_S
    if now % 0.5 < 0.05:
        log.add(
            *("vehicle_status", now, round(made.ARMED_S * 1e6) if is_armed else 0),
            *(2 if is_armed else 1, 3),
        )
        log.add("vehicle_land_detected", now, not moment.is_airborne)
    if now in {0.0, 10.0, 40.0}:
        log.add("mission_result", now, {0.0: 0, 10.0: 1, 40.0: 2}[now])
    shown_a = moment.current_a if current_a is None else current_a
    log.add("battery_status", now, made.VOLTAGE_V, shown_a)
    # Heading north, nose 4° down: pitch −4°.
    log.add("vehicle_attitude", now, 0.99939083, 0.0, -0.03489950, 0.0)
    log.add(
        *("vehicle_global_position", now, moment.latitude_deg, made.LONGITUDE_DEG),
        made.GROUND_AMSL_M + moment.height_m,
    )
    moved = origin_moves_s is not None and now >= origin_moves_s
    north = moment.north_m - (100.0 if moved else 0.0)
    down = -moment.height_m + (10.0 if moved else 0.0)
    origin = made.LATITUDE_DEG + (100.0 / METRES_PER_DEGREE_NORTH if moved else 0.0)
    jump_s, jump_m = jump
    has_jumped = jump_s is not None and now >= jump_s
    log.add(
        *("vehicle_local_position", now, north, 0.0, down),
        *(moment.speed_m_s, 0.0, -moment.climb_m_s),
        *(origin, made.LONGITUDE_DEG, made.GROUND_AMSL_M + (10.0 if moved else 0.0)),
        *(True, True, True, True, True),
        *((1, *jump_m) if has_jumped else (0, 0.0, 0.0)),
    )
    log.add(
        *("trajectory_setpoint", now, north + 0.5, 0.0, down - 0.25),
        *(moment.speed_m_s, 0.0, -moment.climb_m_s),
    )
