"""What ArduPilot's storage of missions keeps of the numbers of items, in 16 bits each (``AP_Mission``)."""

from __future__ import annotations

LONGEST_STORED_HOLD_S = 65_535.0

_MOST = 255
_COARSE_M = 10
_FRACTIONS = 256


def stored_hold_s(hold_s: float) -> float:
    """Return the hold that ArduPilot keeps: whole seconds. [s]"""
    return float(int(hold_s))


def stored_turns(turns: float) -> float:
    """Return the turns of a circle that ArduPilot keeps: whole ones, or a part of one. [-]"""
    if turns < 1.0:
        return int(turns * _FRACTIONS) / _FRACTIONS
    return float(min(int(turns), _MOST))


def stored_radius_m(radius_m: float) -> float:
    """Return the radius of a circle that ArduPilot keeps: whole metres, or tens of them. [m]"""
    size_m = abs(radius_m)
    kept_m = int(size_m) if size_m <= _MOST else min(int(size_m) // _COARSE_M, _MOST) * _COARSE_M
    return float(-kept_m if radius_m < 0.0 else kept_m)
