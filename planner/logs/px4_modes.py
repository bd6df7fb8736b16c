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
