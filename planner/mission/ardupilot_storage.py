"""What ArduPilot's mission storage makes of the numbers of an item.

It has 16 bits for the first parameter, which holds a whole number of seconds, or turns and a
radius together (AP_Mission.cpp, ``mavlink_int_to_mission_cmd``).
"""

from __future__ import annotations

LONGEST_HOLD_S = 65_535.0

_MOST = 255
_COARSE_M = 10
_FRACTIONS = 256


def stored_hold_s(hold_s: float) -> float:
    """Return the hold that is kept: whole seconds. [s]

    Parameters
    ----------
    hold_s : float
        Not more than `LONGEST_HOLD_S`. [s]
    """
    return float(int(hold_s))


def stored_turns(turns: float) -> float:
    """Return the turns of a circle that are kept: whole ones, or a part of a single one. [-]

    Parameters
    ----------
    turns : float
        Positive. [-]
    """
    if turns < 1.0:
        return int(turns * _FRACTIONS) / _FRACTIONS
    return float(min(int(turns), _MOST))


def stored_radius_m(radius_m: float) -> float:
    """Return the radius of a circle that is kept: whole metres, or tens of them. [m]

    Parameters
    ----------
    radius_m : float
        Negative for counter-clockwise. [m]
    """
    size_m = abs(radius_m)
    kept_m = int(size_m) if size_m <= _MOST else min(int(size_m) // _COARSE_M, _MOST) * _COARSE_M
    return float(-kept_m if radius_m < 0.0 else kept_m)
