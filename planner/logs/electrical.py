"""Voltage, current and power, from whichever message they come."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.logs.series import Series

if TYPE_CHECKING:
    from planner.logs.record import FloatArray

NO_CURRENT_A = 0.2
"""No multirotor flies on less; a sensor that never shows more is none. [A]"""
_NO_VOLTAGE_V = 0.5
"""A monitor that never shows more is not connected. [V]"""


def electrical_series(
    time_s: FloatArray,
    voltage_v: FloatArray | None,
    current_a: FloatArray | None,
    *,
    message: str,
    fields: tuple[str, str],
) -> tuple[dict[str, Series], dict[str, str]]:
    """Return voltage, current and power of one battery message, and what is wrong with them.

    Parameters
    ----------
    time_s : ndarray
        Times of the messages. [s]
    voltage_v, current_a : ndarray, optional
        Voltage and current of each, NaN where not known; ``None`` where the message has none.
    message : str
        Its name; empty for columns of a file.
    fields : tuple of str
        Names of its fields for voltage and current.

    Returns
    -------
    series : dict
        ``voltage_v``, ``current_a`` and ``power_w``, as far as a sensor is there.
    remarks : dict
        Sentences by the same names, where none is.
    """
    of_voltage, of_current = (f"{message}.{field}" if message else field for field in fields)
    series: dict[str, Series] = {}
    remarks: dict[str, str] = {}
    if voltage_v is not None:
        # A monitor that has measured nothing yet shows zero.
        voltage_v = np.where(voltage_v > _NO_VOLTAGE_V, voltage_v, np.nan)
        if np.isfinite(voltage_v).any():
            series["voltage_v"] = Series.of(time_s, voltage_v, of_voltage)
        else:
            remarks["voltage_v"] = (
                f"{of_voltage} never exceeds {_NO_VOLTAGE_V:g} V: no voltage sensor"
            )
    if current_a is not None:
        if np.any(current_a > NO_CURRENT_A):
            series["current_a"] = Series.of(time_s, current_a, of_current)
        else:
            remarks["current_a"] = (
                f"{of_current} never exceeds {NO_CURRENT_A:g} A: no current sensor"
            )
    if voltage_v is not None and current_a is not None and len(series) == 2:
        power = Series.of(time_s, voltage_v * current_a, f"{of_voltage} × {fields[1]}")
        if len(power):
            series["power_w"] = power
    return series, remarks
