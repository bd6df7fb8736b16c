"""Names of PX4's flight modes: ``NAVIGATION_STATE_…`` of the message ``VehicleStatus``."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

AUTO_MISSION = "AUTO_MISSION"
"""The mode that flies missions."""

PX4_MODES: Mapping[int, str] = {
    0: "MANUAL",
    1: "ALTCTL",
    2: "POSCTL",
    3: AUTO_MISSION,
    4: "AUTO_LOITER",
    5: "AUTO_RTL",
    6: "POSITION_SLOW",
    8: "ALTITUDE_CRUISE",
    10: "ACRO",
    12: "DESCEND",
    13: "TERMINATION",
    14: "OFFBOARD",
    15: "STAB",
    17: "AUTO_TAKEOFF",
    18: "AUTO_LAND",
    19: "AUTO_FOLLOW_TARGET",
    20: "AUTO_PRECLAND",
    21: "ORBIT",
    22: "AUTO_VTOL_TAKEOFF",
}


def px4_mode(number: int) -> str:
    """Return the name of a mode; its number where it has none here."""
    return PX4_MODES.get(number, f"mode {number}")


_MAIN_MODES: Mapping[int, str] = {
    1: "MANUAL",
    2: "ALTCTL",
    3: "POSCTL",
    5: "ACRO",
    6: "OFFBOARD",
    7: "STAB",
}
_AUTO = 4
_SUB_MODES: Mapping[int, str] = {
    2: "AUTO_TAKEOFF",
    3: "AUTO_LOITER",
    4: AUTO_MISSION,
    5: "AUTO_RTL",
    6: "AUTO_LAND",
    8: "AUTO_FOLLOW_TARGET",
    9: "AUTO_PRECLAND",
    10: "AUTO_VTOL_TAKEOFF",
}


def px4_custom_mode(number: int) -> str:
    """Return the name of a mode as a heartbeat tells it.

    The third byte is the main mode, the fourth the sub mode of the automatic ones
    (``px4_custom_mode.h``).
    """
    main, sub = number >> 16 & 255, number >> 24 & 255
    names = _SUB_MODES if main == _AUTO else _MAIN_MODES
    return names.get(sub if main == _AUTO else main, f"mode {main}.{sub}")
