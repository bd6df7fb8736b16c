r"""The wind of a flight that none was logged in, by how the vehicle leans.

In steady level flight the thrust leans against the drag, which goes by a power n of the airspeed, that of
rotors and body together:

.. math:: \frac{\vec T_{\mathrm{level}}}{T_{\mathrm{up}}}
          = k\, |\vec v - \vec w|^{n-1} (\vec v - \vec w), \quad 1 \le n \le 2.

It leans along its airspeed whatever n is, and more against the wind w than with it: legs in two directions
tell the wind.  Of 23 flights of a Matrice 100 that show one so, it is 1.2 m/s off (rms) that of an anemometer
in their hovers, 2.3 to 8.4 m/s (Rodrigues et al., Sci. Data 8, 155, 2021).
"""

from __future__ import annotations

import math
from itertools import compress
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from planner import quantity
from planner.identify.lean import (
    LEANT_WIND,
    LEAST_WIND_M_S,
    MOVING_M_S,
    leant_wind_m_s,
    level_parts,
)
from planner.units import GRAVITY_M_S2
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, FloatArray
    from planner.logs.record import FlightRecord

_LEAN_ERROR = 0.02
"""Of the level thrust over that upwards, by trim, gusts and what the drag is beside its law: 1.1°. [-]"""
_EXPONENT, _EXPONENT_ERROR = 1.5, 0.29
"""Of all that are between 1 and 2, their mean and standard deviation. [-]"""
_ANY_WIND_M_S = 10.0
"""Standard deviation of the winds that multicopters fly in, each way: one that nothing shows is calm."""
_USUAL_DRAG = 0.03
"""Where the search begins: 10° of lean at 3 m/s, 30° at 7 m/s. [-]"""
_ONE_HEIGHT = 1.3
"""Ratio to the height most legs are flown at within which the wind is that of them: the power law of 1/2 of
ArduPilot's simulation changes it by 14 %, that of open land, 1/7, by 4 %. [-]"""
_SURE = 3.0
"""Standard errors from which on a wind is one. [-]"""
_SLOWEST_M_S = 1e-3
"""Airspeed that a power below 1 of it is taken of, at least."""


_SHOWN: WeakKeyDictionary[FlightRecord, tuple[float, float, float] | None] = WeakKeyDictionary()
"""What `_shown_wind` found: each prediction of a flight asks for it, and it takes 8 ms."""


def with_leant_wind(record: FlightRecord) -> FlightRecord:
    """Return a record with the wind that its lean shows, and its airspeed in it.

    As it is where its log holds wind or airspeed, no attitude, or the lean shows no wind of 1 m/s and of
    three standard errors.  The wind is the mean of the legs near the height that most are flown at; at others
    it is not known, nor is an airspeed but where the vehicle hardly moves.
    """
    if np.isfinite(record.airspeed_m_s).any() or np.isfinite(record.wind_north_m_s).any():
        return record
    if record not in _SHOWN:
        _SHOWN[record] = _shown_wind(record)
    shown = _SHOWN[record]
    if shown is None:
        return record
    north, east, usual_m = shown
    through = np.hypot(record.velocity_north_m_s - north, record.velocity_east_m_s - east)
    is_known = _is_near(record.height_above_home_m, usual_m)
    stays = record.ground_speed_m_s < MOVING_M_S
    airspeed = np.where(is_known, through, np.where(stays, record.ground_speed_m_s, np.nan))
    columns = {
        "airspeed_m_s": airspeed,
        "wind_north_m_s": np.where(is_known, north, np.nan),
        "wind_east_m_s": np.where(is_known, east, np.nan),
    }
    known = float(np.isfinite(airspeed).mean())
    rows = [
        replace(row, found_in=LEANT_WIND, rate_hz=None, coverage=known)
        if row.name in columns
        else row
        for row in record.quantities
    ]
    return replace(record, **columns, quantities=tuple(rows))


def _shown_wind(record: FlightRecord) -> tuple[float, float, float] | None:
    """Return the wind to the north and to the east, and the height it is of; ``None``: none is shown."""
    parts = level_parts(record)
    if not parts:
        return None
    heights_m = np.array([np.nanmean(record.height_above_home_m[part]) for part in parts])
    # that of the leg which most are near; of as many the highest, where the wind is strongest
    usual_m = max(heights_m.tolist(), key=lambda one: (_is_near(heights_m, one).sum(), one))
    wind_m_s = _shown_wind_m_s(record, list(compress(parts, _is_near(heights_m, usual_m))))
    return None if wind_m_s is None else (*wind_m_s, usual_m)


def leant_wind_readings(records: Sequence[FlightRecord]) -> list[str]:
    """Return in words the winds of records that their lean shows."""
    told = []
    for record in records:
        if leant_wind_m_s(record) > 0.0:
            north, east = map(float, map(np.nanmean, (record.wind_north_m_s, record.wind_east_m_s)))
            told.append(
                f"{record.source}: no wind in the log: {quantity.speed(math.hypot(north, east))} from "
                f"{quantity.bearing(math.degrees(math.atan2(-east, -north)))} by {LEANT_WIND}"
            )
    return told


def _is_near(height_m: FloatArray, usual_m: float) -> BoolArray:
    return np.asarray((height_m < _ONE_HEIGHT * usual_m) & (usual_m < _ONE_HEIGHT * height_m))


def _shown_wind_m_s(record: FlightRecord, parts: Sequence[slice]) -> tuple[float, float] | None:
    """Return the wind to the north and to the east, by least squares; ``None``: no lean shows one."""
    from scipy.optimize import least_squares

    moved = np.stack([record.velocity_north_m_s, record.velocity_east_m_s])
    leant = np.stack(_level_thrust(record))
    known = [part for part in parts if np.isfinite([moved[:, part], leant[:, part]]).all()]
    if len(known) < 2:
        return None
    velocity = np.array([moved[:, part].mean(axis=1) for part in known])
    lean = np.array([leant[:, part].mean(axis=1) for part in known])
    # of the thrust, what still speeds the vehicle up is no drag
    lean -= [
        np.polyfit(record.time_s[part], moved[:, part].T, 1)[0] / GRAVITY_M_S2 for part in known
    ]

    def errors(unknown: FloatArray) -> FloatArray:
        wind_m_s, log_drag, exponent = unknown[:2], unknown[2], unknown[3]
        through_air = velocity - wind_m_s
        airspeed = np.maximum(np.hypot(*through_air.T), _SLOWEST_M_S)[:, None]
        by_law = math.exp(log_drag) * through_air * airspeed ** (exponent - 1.0)
        usual = [*(wind_m_s / _ANY_WIND_M_S), (exponent - _EXPONENT) / _EXPONENT_ERROR]
        return np.concatenate([((by_law - lean) / _LEAN_ERROR).ravel(), usual])

    # a wind stronger than the vehicle is fast has a minimum of its own: begin from all sides
    begun = [(0.0, 0.0), (5.0, 0.0), (-5.0, 0.0), (0.0, 5.0), (0.0, -5.0)]
    found = min(
        (
            least_squares(errors, [*wind_m_s, math.log(_USUAL_DRAG), _EXPONENT], method="lm")
            for wind_m_s in begun
        ),
        key=lambda one: float(one.cost),
    )
    covariance = np.linalg.pinv(found.jac.T @ found.jac)[:2, :2]
    scatter = max(2.0 * float(found.cost) / max(lean.size - 3, 1), 1.0)
    error_m_s = math.sqrt(scatter * float(np.linalg.eigvalsh(covariance)[-1]))
    north, east = map(float, found.x[:2])
    is_shown = math.hypot(north, east) >= max(LEAST_WIND_M_S, _SURE * error_m_s)
    return (north, east) if is_shown else None


def _level_thrust(record: FlightRecord) -> tuple[FloatArray, FloatArray]:
    """Return the thrust to the north and to the east over that upwards. (n,), (n,)"""
    roll, pitch, yaw = map(np.radians, (record.roll_deg, record.pitch_deg, record.yaw_deg))
    ahead, right = -np.tan(pitch), np.tan(roll) / np.cos(pitch)
    return (ahead * np.cos(yaw) - right * np.sin(yaw), ahead * np.sin(yaw) + right * np.cos(yaw))
