r"""Published curves of multicopter power, as alternatives to a table or to momentum theory.

References
----------
.. [1] Z. Liu, R. Sengupta, A. Kurzhanskiy, "A power consumption model for multi-rotor small unmanned
   aircraft systems", ICUAS 2017, doi 10.1109/ICUAS.2017.7991310, equations 14 and 15.
.. [2] C. Di Franco, G. Buttazzo, "Coverage Path Planning for UAVs Photogrammetry with Energy and
   Resolution Constraints", J. Intell. Robot. Syst. 83 (2016) 445, doi 10.1007/s10846-016-0348-x, as
   in the first author's own code, github.com/carmelodfr/iris3DR_energy_model.

Neither paper was at hand in full.  The form of [1]_ and its numbers are as two independent public
implementations give them; the numbers of [2]_ were not found in readable form, so none are given.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from planner.units import GRAVITY_M_S2

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    FloatArray: TypeAlias = npt.NDArray[np.float64]


def liu_power_w(
    airspeed_m_s: npt.ArrayLike,
    climb_rate_m_s: npt.ArrayLike,
    *,
    mass_kg: float,
    k1: float,
    k2_sqrt_kg_m: float,
    c2_sqrt_m_kg: float,
    c4_kg_m: float,
    c5_kg_m: float,
) -> FloatArray:
    r"""Power by the five parameters of Liu, Sengupta and Kurzhanskiy.

    .. math::
       P &= k_1 T \left[\frac{w}{2} + \sqrt{\left(\frac{w}{2}\right)^2 + \frac{T}{k_2^2}}\right]
            + c_2 T^{3/2} + c_4 V^3, \\
       T &= \sqrt{\left(m g - c_5 (V \cos\alpha)^2\right)^2 + \left(c_4 V^2\right)^2},

    equations 14 and 15 of [1]_ (module references) without the two parameters the authors found to be
    zero.  For a planned flight the angle of attack α is that of steady flight, where drag tilts the
    thrust: :math:`\cos^2\alpha = 1 / (1 + (c_4 V^2 / m g)^2)`.

    Parameters
    ----------
    airspeed_m_s : array_like
        Horizontal speed V through the air. [m s⁻¹]
    climb_rate_m_s : array_like
        Climb rate w, descent negative. [m s⁻¹]
    mass_kg : float
        Mass m with payload, positive. [kg]
    k1 : float
        k₁. [-]
    k2_sqrt_kg_m : float
        k₂, positive. [kg^½ m^−½]
    c2_sqrt_m_kg : float
        c₂. [m^½ kg^−½]
    c4_kg_m : float
        c₄. [kg m⁻¹]
    c5_kg_m : float
        c₅, lift of the body. [kg m⁻¹]

    Returns
    -------
    ndarray
        Electrical power, in the broadcast shape. [W]

    Examples
    --------
    Hover of 1.5 kg with the figures quoted for an IRIS+:

    >>> power_w = liu_power_w(
    ...     0.0, 0.0, mass_kg=1.5, k1=0.8554, k2_sqrt_kg_m=0.3051, c2_sqrt_m_kg=0.3177,
    ...     c4_kg_m=0.0296, c5_kg_m=0.0279,
    ... )
    >>> print(f"{power_w:.1f} W")
    176.1 W
    """
    speed_squared = np.square(np.asarray(airspeed_m_s, dtype=np.float64))
    half_climb = 0.5 * np.asarray(climb_rate_m_s, dtype=np.float64)
    weight_n = mass_kg * GRAVITY_M_S2
    drag_n = c4_kg_m * speed_squared
    level_speed_squared = speed_squared / (1.0 + np.square(drag_n / weight_n))
    thrust_n = np.hypot(weight_n - c5_kg_m * level_speed_squared, drag_n)
    through_m_s = half_climb + np.sqrt(half_climb * half_climb + thrust_n / k2_sqrt_kg_m**2)
    power: FloatArray = np.asarray(
        k1 * thrust_n * through_m_s
        + c2_sqrt_m_kg * thrust_n**1.5
        + drag_n * np.sqrt(speed_squared)  # c4 V³
    )
    return power


def di_franco_buttazzo_power_w(
    airspeed_m_s: npt.ArrayLike,
    climb_rate_m_s: npt.ArrayLike,
    *,
    coefficients: Sequence[float],
    climb_power_w: float,
    climb_speed_m_s: float,
    descent_power_w: float,
    descent_speed_m_s: float,
) -> FloatArray:
    r"""Power by the measured curve of Di Franco and Buttazzo.

    .. math::
       P = P(V) + \begin{cases}
         (P_c - P(0))\, w / w_c & w \ge 0 \\
         (P_d - P(0))\, |w| / w_d & w < 0
       \end{cases}

    with P(V) a polynomial fitted to level flight at constant speed, and one measured power for the
    climb and one for the descent, each at one rate ([2]_, module references).  Their vehicle climbs
    and descends straight up and down at these rates only; that the part above hover grows in
    proportion to the rate, so that a metre of height costs the same at any rate, is read into it here.

    Parameters
    ----------
    airspeed_m_s : array_like
        Horizontal speed V through the air. [m s⁻¹]
    climb_rate_m_s : array_like
        Climb rate w, descent negative. [m s⁻¹]
    coefficients : sequence of float
        Coefficients of P(V), highest power of V first. [W, W m⁻¹ s, …]
    climb_power_w, climb_speed_m_s : float
        Power of the climb and its rate, both positive. [W, m s⁻¹]
    descent_power_w, descent_speed_m_s : float
        Power of the descent and its rate, both positive. [W, m s⁻¹]

    Returns
    -------
    ndarray
        Electrical power, in the broadcast shape. [W]

    Examples
    --------
    Half the climb rate costs half the power above hover:

    >>> power_w = di_franco_buttazzo_power_w(
    ...     0.0, 1.0, coefficients=(1.0, -4.0, 200.0), climb_power_w=240.0, climb_speed_m_s=2.0,
    ...     descent_power_w=190.0, descent_speed_m_s=1.0,
    ... )
    >>> print(f"{power_w:.1f} W")
    220.0 W
    """
    climb = np.asarray(climb_rate_m_s, dtype=np.float64)
    level = np.polyval(np.asarray(coefficients), np.asarray(airspeed_m_s, dtype=np.float64))
    hover_w = coefficients[-1]
    per_rate = np.where(
        climb >= 0.0,
        (climb_power_w - hover_w) / climb_speed_m_s,
        (hover_w - descent_power_w) / descent_speed_m_s,
    )
    power: FloatArray = np.asarray(level + per_rate * climb)
    return power
