"""What a simulated vehicle says of itself: each message made of the state it is in."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.frozen import frozen
from planner.link.message import message

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.link.message import Message
    from planner.link.simulated.flown import FlownState
    from planner.link.simulated.setup import VehicleSetup

NUMBERS: Mapping[str, int] = {
    "HEARTBEAT": 0,
    "SYS_STATUS": 1,
    "GPS_RAW_INT": 24,
    "ATTITUDE": 30,
    "GLOBAL_POSITION_INT": 33,
    "MISSION_CURRENT": 42,
    "BATTERY_STATUS": 147,
    "AUTOPILOT_VERSION": 148,
    "WIND": 168,
    "WIND_COV": 231,
    "HOME_POSITION": 242,
    "EXTENDED_SYS_STATE": 245,
}
"""Of the messages that can be asked for."""

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
_RELEASE = 255
"""FIRMWARE_VERSION_TYPE_OFFICIAL."""
_SENSORS = 0b10_1111
"""Gyroscope, accelerometer, magnetometer, barometer, GPS (MAV_SYS_STATUS_SENSOR)."""
_BATTERY_SENSOR = 1 << 25
_UNKNOWN_U16, _MOST_CELL_MV = 65_535, 65_534
_UNKNOWN_TEMPERATURE = 32_767
_J_PER_WH, _J_PER_HJ = 3600.0, 100.0
_SCALE = 1e7


@frozen
class Situation:
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
    """Items of the mission."""
    list_ids: tuple[int, int, int] = (0, 0, 0)
    """Of mission, fence and rally points, as MISSION_CURRENT has them."""
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
    maker = _MAKERS.get(name)
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
    return message(
        "SYS_STATUS",
        onboard_control_sensors_present=sensors,
        onboard_control_sensors_enabled=sensors,
        onboard_control_sensors_health=sensors,
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
        for index in range(10):  # what does not fit into one cell goes on in the next
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


def _autopilot_version(at: Situation) -> Message:
    major, minor, patch = at.setup.version
    return message(
        "AUTOPILOT_VERSION",
        capabilities=_CAPABILITIES[at.setup.autopilot],
        flight_sw_version=major << 24 | minor << 16 | patch << 8 | _RELEASE,
        flight_custom_version=[0] * 8,
        middleware_custom_version=[0] * 8,
        os_custom_version=[0] * 8,
        uid=int.from_bytes(at.setup.uid[:8], "little"),
        uid2=list(at.setup.uid),
    )


_MAKERS: Mapping[str, Callable[[Situation], Message | None]] = {
    "HEARTBEAT": _heartbeat,
    "SYS_STATUS": _sys_status,
    "GPS_RAW_INT": _gps,
    "ATTITUDE": _attitude,
    "GLOBAL_POSITION_INT": _global_position,
    "MISSION_CURRENT": _mission_current,
    "BATTERY_STATUS": _battery_status,
    "AUTOPILOT_VERSION": _autopilot_version,
    "WIND": _wind,
    "WIND_COV": _wind_covariance,
    "HOME_POSITION": _home,
    "EXTENDED_SYS_STATE": _extended_state,
}


def _course_deg(state: FlownState) -> float:
    return math.degrees(math.atan2(state.east_m_s, state.north_m_s)) % 360.0


def _millivolts(voltage_v: float | None, *, most: int) -> int:
    return _UNKNOWN_U16 if voltage_v is None else min(round(voltage_v * 1e3), most)


def _centiamperes(current_a: float | None) -> int:
    return -1 if current_a is None else min(round(current_a * 1e2), 32_767)


def _percent(fraction: float | None) -> int:
    return -1 if fraction is None else round(fraction * 1e2)
