r"""What wind a vehicle holds while it sinks: less than in level flight.

Leaning by θ at most its rotors pull with T sin θ, and hold with T cos θ what the drag leaves of its weight.
Coming down at a rate w in a wind U, at an airspeed v = hypot(U, w), the drag D carries D w/v of that, so

.. math:: D(v) \, U/v = \tan\theta \, (m g - D(v) \, w/v) .

With U_max the highest airspeed of level flight, D(U_max) = m g tan θ, and a drag that grows with vⁿ:

.. math:: v^{n-1} (U + w \tan\theta) = U_\mathrm{max}^n ,

whatever the weight.  Of n = 1 this holds for the drag of rotors too, which is in the plane of their discs:
k (U cos θ + w sin θ) = m g sin θ.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

_STEPS = 60
"""Halvings: to the last digits of any speed."""


def level_airspeed_m_s(
    wind_m_s: npt.ArrayLike, sink_m_s: npt.ArrayLike, *, lean_rad: float, exponent: float | None
) -> npt.NDArray[np.float64]:
    """Return what airspeed a vehicle must hold in level flight to hold winds while it sinks. [m s⁻¹]

    Parameters
    ----------
    wind_m_s, sink_m_s : array_like
        The winds, and the rates of descent; what climbs counts as level.
    lean_rad : float
        The greatest lean angle.
    exponent : float, optional
        Power of the airspeed that the drag goes by; ``None``: not known, of 1 to 2 the one that asks most.

    Examples
    --------
    Leaning 45° and sinking at 2 m/s each m/s of that counts as one of wind:

    >>> import math
    >>> print(f"{level_airspeed_m_s(8.0, 2.0, lean_rad=math.radians(45.0), exponent=1.0):.1f}")
    10.0
    """
    wind = np.asarray(wind_m_s, np.float64)
    sink = np.maximum(sink_m_s, 0.0)
    speed, pull = np.hypot(wind, sink), wind + sink * math.tan(lean_rad)
    # In between it grows or falls steadily with the exponent: the most is met at an end.
    several = [
        (speed ** (power - 1.0) * pull) ** (1.0 / power)
        for power in ((1.0, 2.0) if exponent is None else (exponent,))
    ]
    return np.asarray(np.maximum.reduce(several))


def held_wind_m_s(
    limit_m_s: float, sink_m_s: float, *, lean_rad: float, exponent: float | None
) -> float:
    """Return the strongest wind a vehicle holds while it sinks, of its airspeed limit in level flight.

    None where even in calm air it could not sink like that and hold its place. [m s⁻¹]
    """
    low_m_s, high_m_s = 0.0, limit_m_s
    for _ in range(_STEPS):
        middle_m_s = 0.5 * (low_m_s + high_m_s)
        asks_m_s = level_airspeed_m_s(middle_m_s, sink_m_s, lean_rad=lean_rad, exponent=exponent)
        if asks_m_s > limit_m_s:
            high_m_s = middle_m_s
        else:
            low_m_s = middle_m_s
    return low_m_s
