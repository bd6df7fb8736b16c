"""Power to hover: the article's law over height, and the momentum-theory scaling over density.

References
----------
.. [1] K. Falkowski, M. Duda, "Dynamic Models Identification for Kinematics and Energy Consumption
   of Rotary-Wing UAVs during Different Flight States", Sensors 2023, 23(23), 9378.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt


def altitude_law_hover_power_w(
    height_above_home_m: npt.ArrayLike,
    *,
    coefficient_w: float,
    exponent: float,
    lowest_height_m: float,
) -> npt.NDArray[np.float64]:
    r"""Hover power over height above home, as fitted in the article.

    .. math:: P(H) = K \max(H, H_0)^z

    equation 4 of [1]_, held constant below the lowest height: the bare law gives no power at all
    at H = 0 and falls steeply below 1 m, where nothing was measured.

    Parameters
    ----------
    height_above_home_m : array_like
        Height H above home. [m]
    coefficient_w : float
        Coefficient K, the power at 1 m. [W]
    exponent : float
        Exponent z. [-]
    lowest_height_m : float
        Height H0 below which the power is held constant, positive. [m]

    Returns
    -------
    ndarray
        Hover power, in the shape of the heights. [W]

    Examples
    --------
    The quadrotor of the article at 100 m:

    >>> power_w = altitude_law_hover_power_w(
    ...     100.0, coefficient_w=119.49, exponent=0.02, lowest_height_m=1.0
    ... )
    >>> print(f"{power_w:.3f} W")
    131.018 W
    """
    height = np.maximum(np.asarray(height_above_home_m, dtype=np.float64), lowest_height_m)
    # Sensors 2023, 23(23), 9378, equation 4
    power: npt.NDArray[np.float64] = np.asarray(coefficient_w * height**exponent)
    return power


def density_law_hover_power_w(
    mass_kg: npt.ArrayLike,
    air_density_kg_m3: npt.ArrayLike,
    *,
    hover_power_w: float,
    reference_mass_kg: float,
    reference_density_kg_m3: float,
    mass_exponent: float,
    density_exponent: float,
) -> npt.NDArray[np.float64]:
    r"""Hover power over mass and air density, scaled from one measured hover.

    .. math:: P = P_0 \left(\frac{m}{m_0}\right)^a \left(\frac{\rho}{\rho_0}\right)^b

    Momentum theory of the actuator disk, :math:`P = T^{3/2} / \sqrt{2 \rho A}` with T = m g, gives
    a = 3/2 and b = -1/2 (equation 3 of [1]_ means this, its exponent 2/3 is a misprint); the share
    of profile power makes the measured exponents differ.

    Parameters
    ----------
    mass_kg : array_like
        Mass m that hovers, payload included, positive. [kg]
    air_density_kg_m3 : array_like
        Air density, positive; broadcasts against ``mass_kg``. [kg m⁻³]
    hover_power_w : float
        Hover power P0 at the reference mass and density. [W]
    reference_mass_kg : float
        Mass m0. [kg]
    reference_density_kg_m3 : float
        Air density ρ0. [kg m⁻³]
    mass_exponent : float
        Exponent a. [-]
    density_exponent : float
        Exponent b, negative where thin air costs power. [-]

    Returns
    -------
    ndarray
        Hover power, in the broadcast shape of mass and density. [W]

    Examples
    --------
    Four times the mass in the same air costs eight times the ideal power:

    >>> power_w = density_law_hover_power_w(
    ...     4.0, 1.225, hover_power_w=100.0, reference_mass_kg=1.0,
    ...     reference_density_kg_m3=1.225, mass_exponent=1.5, density_exponent=-0.5,
    ... )
    >>> print(f"{power_w:.1f} W")
    800.0 W
    """
    mass_ratio = np.asarray(mass_kg, dtype=np.float64) / reference_mass_kg
    density_ratio = np.asarray(air_density_kg_m3, dtype=np.float64) / reference_density_kg_m3
    power: npt.NDArray[np.float64] = np.asarray(
        hover_power_w * mass_ratio**mass_exponent * density_ratio**density_exponent
    )
    return power
