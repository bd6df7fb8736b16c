"""Times of what ArduPilot flies by default, by pencil: what tests of its motion compare with."""

from __future__ import annotations

import math

RISE_S = 0.3
"""Twice ATC_INPUT_TC of 0.15 s."""
START_S = 0.3
"""What a start from rest loses: twice ATC_INPUT_TC."""
VERTICAL_START_S = 0.37
STEP_S = 0.8 * 8 * (0.01 * RISE_S / 8) ** 0.25
"""The S-curve of what heights are rounded by before landings: t ~ L^(1/4) for L up to a centimetre, on the
mean 4/5 of that of the centimetre."""


def leg_s(length: float, v: float = 10.0, a: float = 2.5, j: float = 1.0) -> float:
    """A stop-to-stop leg with steady acceleration and cruise."""
    return length / v + v / a + a / j + RISE_S + START_S


def landing_s(height: float, v: float = 1.5, slow: float = 0.5, low: float = 10.0) -> float:
    """From standing to touch-down with an acceleration of 1 and a gain of 1."""
    slowing_m = v**2 / 2 + 0.5
    steady = (height - low - slowing_m - v**2 / 2) / v
    return v + steady + (v - 1.0) + math.log(1.0 / slow) + (low + slow) / slow
