"""What the absence of each quantity of a record costs."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

_NO_TRACK = "no track: distances and the places of stops are unknown"
_NO_HEIGHT = "climbs, descents and the hover power over height cannot be identified"
_NO_SPEED = "accelerating, cruise and braking cannot be identified"
_NO_AIR = "the air is taken to be calm: power over speed is that over ground"
_NO_LEAN = "wind cannot be estimated from how the vehicle leans"
_NO_POSITION_REFERENCE = "position errors cannot be told from the path commanded"
_NO_SPEED_REFERENCE = (
    "the speed response can only be identified against the steps the speed itself suggests"
)
_NO_POWER = "no power and no energy model can be identified, only the motion"

ABSENCE_COSTS: Mapping[str, str] = {
    "latitude_deg": _NO_TRACK,
    "longitude_deg": _NO_TRACK,
    "altitude_amsl_m": "air density is that of the standard atmosphere at the height above home",
    "north_m": _NO_TRACK,
    "east_m": _NO_TRACK,
    "height_above_home_m": _NO_HEIGHT,
    "velocity_north_m_s": "turns and the direction of flight against the wind are unknown",
    "velocity_east_m_s": "turns and the direction of flight against the wind are unknown",
    "climb_m_s": _NO_HEIGHT,
    "ground_speed_m_s": _NO_SPEED,
    "airspeed_m_s": _NO_AIR,
    "wind_north_m_s": _NO_AIR,
    "wind_east_m_s": _NO_AIR,
    "roll_deg": _NO_LEAN,
    "pitch_deg": _NO_LEAN,
    "yaw_deg": _NO_LEAN,
    "reference_north_m": _NO_POSITION_REFERENCE,
    "reference_east_m": _NO_POSITION_REFERENCE,
    "reference_height_m": (
        "the height response can only be identified against the steps the height itself suggests"
    ),
    "reference_velocity_north_m_s": _NO_SPEED_REFERENCE,
    "reference_velocity_east_m_s": _NO_SPEED_REFERENCE,
    "reference_climb_m_s": "the climb rate commanded is known from the height reference only",
    "reference_speed_m_s": _NO_SPEED_REFERENCE,
    "voltage_v": _NO_POWER,
    "current_a": _NO_POWER,
    "power_w": _NO_POWER,
    "mode": "flights by hand cannot be told from missions",
    "is_landed": "take-off and landing are told from the heights, to about a second",
    "mission_item": "states cannot be matched with the mission's items",
}
"""Cost by the name of the column, in the order of the columns of a record."""
