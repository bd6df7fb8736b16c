"""What a simulated vehicle reports: each message made of the state it is in."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.wire import message
from planner.simulator.servers import answer
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.link.wire import Message
    from planner.simulator.flown import FlownState
    from planner.simulator.setup import VehicleSetup


_QUADROTOR = 2
_STANDBY, _ACTIVE = 3, 4
"""MAV_STATE."""
_CUSTOM, _AUTO, _GUIDED, _STABILISED, _ARMED = 1, 4, 8, 16, 128
"""MAV_MODE_FLAG."""
_PX4_LOITER, _PX4_MISSION = 4 << 16 | 3 << 24, 4 << 16 | 4 << 24
"""Main mode AUTO with sub modes LOITER and MISSION."""
_COPTER_STABILIZE, _COPTER_AUTO = 0, 3
_ON_GROUND, _IN_AIR = 1, 2
"""MAV_LANDED_STATE."""
_NO_MISSION, _NOT_STARTED, _MISSION_ACTIVE, _COMPLETE = 1, 2, 3, 5
"""MISSION_STATE."""
_CAPABILITIES: Mapping[Autopilot, int] = {
    # MISSION_FLOAT, MISSION_INT, COMMAND_INT, FTP, MAVLINK2, MISSION_FENCE, MISSION_RALLY; PX4 has
    # PARAM_FLOAT and PARAM_ENCODE_BYTEWISE, ArduPilot PARAM_FLOAT and PARAM_ENCODE_C_CAST
    Autopilot.PX4: 0xE02F | 1 << 4,
    Autopilot.ARDUPILOT: 0xE02F | 1 << 17,
}
_FILES = 1 << 5
"""MAV_PROTOCOL_CAPABILITY_FTP."""
_TERRAIN_BLOCKS = 504
"""Of 4 by 4 heights that ArduPilot keeps around it."""
_RELEASE = 255
"""FIRMWARE_VERSION_TYPE_OFFICIAL."""
_SENSORS = 0b10_1111
"""Gyroscope, accelerometer, magnetometer, barometer, GPS (MAV_SYS_STATUS_SENSOR)."""
_FENCE_SENSOR, _BATTERY_SENSOR, _PREARM_CHECK = 1 << 20, 1 << 25, 1 << 28
_UNKNOWN_U16, _MOST_CELL_MV = 65_535, 65_534
_UNKNOWN_TEMPERATURE = 32_767
_J_PER_WH, _J_PER_HJ = 3600.0, 100.0
_SCALE = 1e7


class Situation(Value):
    """Everything that telemetry is made of, at one time."""

    setup: VehicleSetup
    state: FlownState
    boot_s: float
    """Since it was switched on. [s]"""
    is_armed: bool
    is_flying: bool
    is_complete: bool
    """Whether the mission was flown to its end."""
    current: int
    """Sequence number of the mission's item."""
    total: int
    list_ids: tuple[int, int, int] = (0, 0, 0)
    """Of mission, fence and rally points, as MISSION_CURRENT has them."""
    has_fence: bool = False
    is_rejected: bool = False
    """Whether the vehicle will not fly the mission it holds (PX4)."""

    @property
    def boot_ms(self) -> int:
        """Since it was switched on. [ms]"""
        return int(self.boot_s * 1e3)

    @property
    def boot_us(self) -> int:
        """Since it was switched on. [µs]"""
        return int(self.boot_s * 1e6)


def make_telemetry(name: str, at: Situation) -> Message | None:
    """Return a message of a name; ``None`` where this vehicle has none of it."""
    maker = _BY_NAME.get(name)
    return None if maker is None else maker(at)


def _heartbeat(at: Situation) -> Message:
    is_px4 = at.setup.autopilot is Autopilot.PX4
    modes = (_PX4_LOITER, _PX4_MISSION) if is_px4 else (_COPTER_STABILIZE, _COPTER_AUTO)
    base = _CUSTOM | _STABILISED
    if is_px4 or at.is_flying:
        base |= _GUIDED | _AUTO
    return message(
        "HEARTBEAT",
        type=_QUADROTOR,
        autopilot=at.setup.identity.autopilot_number,
        base_mode=base | (_ARMED if at.is_armed else 0),
        custom_mode=modes[at.is_flying],
        system_status=_ACTIVE if at.is_armed else _STANDBY,
        mavlink_version=3,
    )


def _sys_status(at: Situation) -> Message:
    state = at.state
    sensors = _SENSORS | (0 if state.state_of_charge is None else _BATTERY_SENSOR)
    sensors |= _FENCE_SENSOR if at.has_fence else 0
    if at.setup.autopilot is Autopilot.ARDUPILOT:
        sensors |= _PREARM_CHECK
    return message(
        "SYS_STATUS",
        onboard_control_sensors_present=sensors,
        onboard_control_sensors_enabled=sensors,
        onboard_control_sensors_health=sensors & ~(_PREARM_CHECK if at.is_rejected else 0),
        load=300,
        voltage_battery=_millivolts(state.voltage_v, most=_MOST_CELL_MV),
        current_battery=_centiamperes(state.current_a),
        battery_remaining=_percent(state.state_of_charge),
    )


def _battery_status(at: Situation) -> Message | None:
    state = at.state
    if state.state_of_charge is None:
        return None
    voltages = [_UNKNOWN_U16] * 10
    if state.voltage_v is not None:
        left_mv = round(state.voltage_v * 1e3)
        for index in range(10):  # what does not fit into one cell continues in the next
            voltages[index] = min(left_mv, _MOST_CELL_MV)
            left_mv -= voltages[index]
            if not left_mv:
                break
    used_ah = state.charge_used_ah
    return message(
        "BATTERY_STATUS",
        battery_function=1,
        type=1,
        temperature=_UNKNOWN_TEMPERATURE,
        voltages=voltages,
        voltages_ext=[0] * 4,
        current_battery=_centiamperes(state.current_a),
        current_consumed=-1 if used_ah is None else round(used_ah * 1e3),
        energy_consumed=round(state.energy_used_wh * _J_PER_WH / _J_PER_HJ),
        battery_remaining=_percent(state.state_of_charge),
        charge_state=1,
    )


def _global_position(at: Situation) -> Message:
    state = at.state
    return message(
        "GLOBAL_POSITION_INT",
        time_boot_ms=at.boot_ms,
        lat=round(state.latitude_deg * _SCALE),
        lon=round(state.longitude_deg * _SCALE),
        alt=round(state.altitude_amsl_m * 1e3),
        relative_alt=round(state.height_above_home_m * 1e3),
        vx=round(state.north_m_s * 1e2),
        vy=round(state.east_m_s * 1e2),
        vz=round(-state.climb_m_s * 1e2),
        hdg=round(_course_deg(state) * 1e2) % 36_000,
    )


def _gps(at: Situation) -> Message:
    state = at.state
    return message(
        "GPS_RAW_INT",
        time_usec=at.boot_us,
        fix_type=3,
        lat=round(state.latitude_deg * _SCALE),
        lon=round(state.longitude_deg * _SCALE),
        alt=round(state.altitude_amsl_m * 1e3),
        eph=70,
        epv=90,
        vel=round(math.hypot(state.north_m_s, state.east_m_s) * 1e2),
        cog=round(_course_deg(state) * 1e2) % 36_000,
        satellites_visible=14,
    )


def _attitude(at: Situation) -> Message:
    return message("ATTITUDE", time_boot_ms=at.boot_ms, yaw=math.radians(_course_deg(at.state)))


def _extended_state(at: Situation) -> Message:
    return message("EXTENDED_SYS_STATE", landed_state=_IN_AIR if at.is_flying else _ON_GROUND)


def _home(at: Situation) -> Message:
    home = at.setup.home
    return message(
        "HOME_POSITION",
        latitude=round(home.latitude_deg * _SCALE),
        longitude=round(home.longitude_deg * _SCALE),
        altitude=round((home.altitude_amsl_m or 0.0) * 1e3),
        q=[1.0, 0.0, 0.0, 0.0],
        time_usec=at.boot_us,
    )


def _wind(at: Situation) -> Message | None:
    wind = at.setup.wind
    if wind is None or at.setup.autopilot is not Autopilot.ARDUPILOT:
        return None
    return message("WIND", direction=wind.from_deg, speed=wind.speed_m_s)


def _wind_covariance(at: Situation) -> Message | None:
    wind = at.setup.wind
    if wind is None or at.setup.autopilot is not Autopilot.PX4:
        return None
    from_rad = math.radians(wind.from_deg)
    return message(
        "WIND_COV",
        time_usec=at.boot_us,
        wind_x=-wind.speed_m_s * math.cos(from_rad),
        wind_y=-wind.speed_m_s * math.sin(from_rad),
        wind_alt=at.state.altitude_amsl_m,
    )


def _mission_current(at: Situation) -> Message:
    flown = at.total - at.setup.first_item
    is_px4 = at.setup.autopilot is Autopilot.PX4
    if flown <= 0 or at.is_rejected:
        progress = _NO_MISSION
    elif at.is_flying:
        progress = _MISSION_ACTIVE
    else:
        progress = _COMPLETE if at.is_complete else _NOT_STARTED
    return message(
        "MISSION_CURRENT",
        seq=at.current,
        total=_UNKNOWN_U16 if is_px4 and flown <= 0 else max(flown, 0),
        mission_state=progress,
        mission_mode=1 if at.is_flying else 2,
        mission_id=at.list_ids[0],
        fence_id=at.list_ids[1],
        rally_points_id=at.list_ids[2],
    )


def _terrain_report(at: Situation) -> Message | None:
    if at.setup.autopilot is not Autopilot.ARDUPILOT:
        return None
    has_terrain = at.setup.misbehaviour.has_terrain
    return message(
        "TERRAIN_REPORT",
        lat=round(at.state.latitude_deg * _SCALE),
        lon=round(at.state.longitude_deg * _SCALE),
        spacing=100 if has_terrain else 0,
        terrain_height=at.setup.home.altitude_amsl_m or 0.0,
        current_height=at.state.height_above_home_m,
        pending=0 if has_terrain else _TERRAIN_BLOCKS,
        loaded=_TERRAIN_BLOCKS if has_terrain else 0,
    )


def _autopilot_version(at: Situation) -> Message:
    major, minor, patch = at.setup.version
    return message(
        "AUTOPILOT_VERSION",
        capabilities=_CAPABILITIES[at.setup.autopilot]
        & (-1 if at.setup.misbehaviour.has_files else ~_FILES),
        flight_sw_version=major << 24 | minor << 16 | patch << 8 | _RELEASE,
        flight_custom_version=[0] * 8,
        middleware_custom_version=[0] * 8,
        os_custom_version=[0] * 8,
        uid=int.from_bytes(at.setup.uid[:8], "little"),
        uid2=list(at.setup.uid),
    )


_MAKERS: Mapping[int, tuple[str, Callable[[Situation], Message | None]]] = {
    0: ("HEARTBEAT", _heartbeat),
    1: ("SYS_STATUS", _sys_status),
    24: ("GPS_RAW_INT", _gps),
    30: ("ATTITUDE", _attitude),
    33: ("GLOBAL_POSITION_INT", _global_position),
    42: ("MISSION_CURRENT", _mission_current),
    136: ("TERRAIN_REPORT", _terrain_report),
    147: ("BATTERY_STATUS", _battery_status),
    148: ("AUTOPILOT_VERSION", _autopilot_version),
    168: ("WIND", _wind),
    231: ("WIND_COV", _wind_covariance),
    242: ("HOME_POSITION", _home),
    245: ("EXTENDED_SYS_STATE", _extended_state),
}
"""By the number they are asked for by."""
_BY_NAME = dict(_MAKERS.values())
_NAMES = {number: name for number, (name, _) in _MAKERS.items()}


def _course_deg(state: FlownState) -> float:
    return math.degrees(math.atan2(state.east_m_s, state.north_m_s)) % 360.0


def _millivolts(voltage_v: float | None, *, most: int) -> int:
    return _UNKNOWN_U16 if voltage_v is None else min(round(voltage_v * 1e3), most)


def _centiamperes(current_a: float | None) -> int:
    return -1 if current_a is None else min(round(current_a * 1e2), 32_767)


def _percent(fraction: float | None) -> int:
    return -1 if fraction is None else round(fraction * 1e2)


_STREAMS: Mapping[str, float] = {
    "HEARTBEAT": 1.0,
    "GLOBAL_POSITION_INT": 0.25,
    "ATTITUDE": 0.25,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 1.0,
    "EXTENDED_SYS_STATE": 1.0,
    "GPS_RAW_INT": 1.0,
    "MISSION_CURRENT": 1.0,
    "HOME_POSITION": 2.0,
    "WIND_COV": 1.0,
    "WIND": 1.0,
}
"""Seconds between messages."""
_UNASKED: Mapping[Autopilot, frozenset[str]] = {
    Autopilot.PX4: frozenset(_STREAMS) - {"WIND"},
    Autopilot.ARDUPILOT: frozenset({"HEARTBEAT"}),
}
"""What is sent at no one's request: of ArduPilot's streams, all rates are 0 at first."""
_PX4_REFUSES = frozenset({"MISSION_CURRENT"})
"""What it sends by itself alone: its mission manager does, and no stream (tried on a build)."""
_DATA_STREAMS = frozenset(_STREAMS) - {"HEARTBEAT", "HOME_POSITION", "WIND_COV"}
"""What REQUEST_DATA_STREAM begins, in one or another of its groups (ArduPilot)."""
_FASTEST_S = 0.02
GET_HOME_POSITION, SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 410, 511, 512
REQUEST_AUTOPILOT_CAPABILITIES = 520
_ACCEPTED, _DENIED, _UNSUPPORTED, _FAILED = 0, 2, 3, 4
"""MAV_RESULT."""
_MOST_ACTS = 1000
_ACTS = frozenset(
    {
        *("COMMAND_LONG", "COMMAND_INT", "PARAM_SET", "SET_MODE", "MISSION_SET_CURRENT"),
        *("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "SET_POSITION_TARGET_GLOBAL_INT"),
        *("SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET", "SET_HOME_POSITION"),
    }
)
"""Messages that would do something to a real vehicle."""
_QUESTIONS = frozenset(
    {GET_HOME_POSITION, SET_MESSAGE_INTERVAL, REQUEST_MESSAGE, REQUEST_AUTOPILOT_CAPABILITIES}
)


class TelemetryServer:
    """Sends what is due, and what is asked for, by the situation at a time [s]."""

    def __init__(self, situation: Callable[[float], Situation], autopilot: Autopilot) -> None:
        self._situation = situation
        self._autopilot = autopilot
        self._intervals_s = {name: _STREAMS[name] for name in _UNASKED[autopilot]}
        self._due_s = dict.fromkeys(self._intervals_s, -1.0)
        self.acts: deque[Message] = deque(maxlen=_MOST_ACTS)
        """What ground stations sent that would move, set or arm a real vehicle: none of it is done."""

    @property
    def deadline_s(self) -> float:
        """When the next message is due. [s]"""
        return min(self._due_s.values())

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        if received.name in _ACTS and received.fields.get("command") not in _QUESTIONS:
            self.acts.append(received)
        match received.name:
            case "COMMAND_LONG" | "COMMAND_INT":
                return self._command(received, now_s)
            case "REQUEST_DATA_STREAM" if self._autopilot is Autopilot.ARDUPILOT:
                self._set_streams(received, now_s)
            case "TIMESYNC" if received["tc1"] == 0:
                boot_ns = round(self._situation(now_s).boot_s * 1e9)
                return (message("TIMESYNC", tc1=boot_ns, ts1=received["ts1"]),)
            case "PING" if received["target_system"] == 0:
                values = {name: received[name] for name in ("time_usec", "seq")}
                return (answer(received, "PING", **values),)
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send what is due."""
        at = self._situation(now_s)
        sent = []
        for name, due_s in self._due_s.items():
            if due_s <= now_s:
                # A late clock does not make up for what was left out.
                self._due_s[name] = now_s + self._intervals_s[name]
                sent.append(make_telemetry(name, at))
        return tuple(one for one in sent if one is not None)

    def _command(self, received: Message, now_s: float) -> tuple[Message, ...]:
        result, sent = _ACCEPTED, None
        match received["command"]:
            case command if command == GET_HOME_POSITION:
                sent = make_telemetry("HOME_POSITION", self._situation(now_s))
            case command if command == REQUEST_AUTOPILOT_CAPABILITIES:
                sent = make_telemetry("AUTOPILOT_VERSION", self._situation(now_s))
            case command if command == REQUEST_MESSAGE:
                name = _asked_name(received)
                is_refused = self._autopilot is Autopilot.PX4 and name in _PX4_REFUSES
                sent = None if is_refused else make_telemetry(name, self._situation(now_s))
                unknown = _DENIED if self._autopilot is Autopilot.PX4 else _FAILED
                result = unknown if sent is None else _ACCEPTED
            case command if command == SET_MESSAGE_INTERVAL:
                result = self._set_interval(received, now_s)
            case _:
                result = _DENIED
        ack = answer(received, "COMMAND_ACK", command=received["command"], result=result)
        return (ack,) if sent is None else (ack, sent)

    def _set_streams(self, received: Message, now_s: float) -> None:
        """Begin or end what ArduPilot sends in groups, here all of them together."""
        rate_hz = received["req_message_rate"] if received["start_stop"] else 0
        for name in _DATA_STREAMS:
            self._set_stream(name, 1.0 / rate_hz if rate_hz else -1.0, now_s)

    def _set_interval(self, received: Message, now_s: float) -> int:
        name, interval_us = _asked_name(received), received["param2"]
        if not name:
            return _UNSUPPORTED
        if not math.isfinite(interval_us):
            return _DENIED
        self._set_stream(name, interval_us / 1e6 or _STREAMS.get(name, 1.0), now_s)
        return _ACCEPTED

    def _set_stream(self, name: str, interval_s: float, now_s: float) -> None:
        """Send a message at an interval from now on; below 0 no more. [s]"""
        self._intervals_s.pop(name, None)
        self._due_s.pop(name, None)
        if interval_s > 0.0:
            self._intervals_s[name] = max(interval_s, _FASTEST_S)
            self._due_s[name] = now_s


def _asked_name(received: Message) -> str:
    """Return the name of the message whose number is the first parameter; empty for none."""
    number = received["param1"]
    return _NAMES.get(round(number), "") if math.isfinite(number) else ""
