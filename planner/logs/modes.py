"""Names of ArduCopter's flight modes, from the ``Mode::Number`` of its source."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


AUTO = "AUTO"
"""The mode that flies missions."""

COPTER_MODES: Mapping[int, str] = {
    0: "STABILIZE",
    1: "ACRO",
    2: "ALT_HOLD",
    3: AUTO,
    4: "GUIDED",
    5: "LOITER",
    6: "RTL",
    7: "CIRCLE",
    8: "POSITION",
    9: "LAND",
    10: "OF_LOITER",
    11: "DRIFT",
    13: "SPORT",
    14: "FLIP",
    15: "AUTOTUNE",
    16: "POSHOLD",
    17: "BRAKE",
    18: "THROW",
    19: "AVOID_ADSB",
    20: "GUIDED_NOGPS",
    21: "SMART_RTL",
    22: "FLOWHOLD",
    23: "FOLLOW",
    24: "ZIGZAG",
    25: "SYSTEMID",
    26: "AUTOROTATE",
    27: "AUTO_RTL",
    28: "TURTLE",
}


def copter_mode(number: int) -> str:
    """Return the name of a mode; its number where it has none here."""
    return COPTER_MODES.get(number, f"mode {number}")


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
