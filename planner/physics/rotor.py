r"""Power to stay in the air and to move through it: hover laws, momentum theory, published curves.

Momentum theory takes the rotors together as one actuator disk.  Everything is counted in the induced
velocity of hover,

.. math:: v_h = \sqrt{T / (2 \rho A)},

and the induced velocity of a disk moving through the air is Glauert's [2]_

.. math:: v_i \sqrt{V_p^2 + (V_a + v_i)^2} = v_h^2,

with :math:`V_p` the speed in the plane of the disk and :math:`V_a` the speed through it, positive in
a climb.  In hover and in pure climb this is the exact solution (equation 3 of [1]_ is its hover, with
a misprinted exponent).

Descent.  Between hover and a descent at :math:`2 v_h` the flow has no stream tube (vortex ring and
turbulent wake states) and momentum theory has no valid solution.  The branch of the solution that is
continuous with hover is followed down to :math:`V_a = -1.5\,v_h`, beyond which it is not the only one
any more; a faster descent is counted like that one.  No power is ever won back from the air: what
induction and descent take together is held at zero.  How fast a vehicle was seen to descend, its model
says in ``valid_for.climb_rate_m_s``.

References
----------
.. [1] K. Falkowski, M. Duda, "Dynamic Models Identification for Kinematics and Energy Consumption
   of Rotary-Wing UAVs during Different Flight States", Sensors 2023, 23(23), 9378.
.. [2] H. Glauert, "A General Theory of the Autogyro", ARC R&M 1111, 1926.
.. [3] Z. Liu, R. Sengupta, A. Kurzhanskiy, "A power consumption model for multi-rotor small unmanned
   aircraft systems", ICUAS 2017, doi 10.1109/ICUAS.2017.7991310, equations 14 and 15.
.. [4] C. Di Franco, G. Buttazzo, "Coverage Path Planning for UAVs Photogrammetry with Energy and
   Resolution Constraints", J. Intell. Robot. Syst. 83 (2016) 445, doi 10.1007/s10846-016-0348-x, as
   in the first author's own code, github.com/carmelodfr/iris3DR_energy_model.

Neither [3]_ nor [4]_ was at hand in full.  The form of [3]_ and its numbers are as two independent
public implementations give them; the numbers of [4]_ were not found in readable form.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.units import GRAVITY_M_S2

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.arrays import FloatArray


FASTEST_DESCENT_RATIO = -1.5
"""Speed through the disk over the induced velocity of hover down to which there is one solution. [-]"""
_CACHED = 4096
"""Values computed at a time, so that what lies between them stays in the cache."""
_NEWTON_STEPS = 4
"""From the bounds below, four steps leave an error below 1e-10 over the whole domain."""
_STANDSTILL = 1e-9
"""Speed over induced velocity below which a disk stands still: keeps a bound finite. [-]"""


def altitude_law_hover_power_w(
    height_above_home_m: npt.ArrayLike,
    *,
    coefficient_w: float,
    exponent: float,
    lowest_height_m: float,
) -> FloatArray:
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
    power: FloatArray = np.asarray(coefficient_w * height**exponent)
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
) -> FloatArray:
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
    power: FloatArray = np.asarray(
        hover_power_w * mass_ratio**mass_exponent * density_ratio**density_exponent
    )
    return power


def hover_induced_velocity_m_s(
    thrust_n: npt.ArrayLike, air_density_kg_m3: npt.ArrayLike, *, disk_area_m2: float
) -> FloatArray:
    r"""Induced velocity of an ideal actuator disk in hover.

    .. math:: v_h = \sqrt{T / (2 \rho A)}

    Parameters
    ----------
    thrust_n : array_like
        Thrust T of all rotors, not negative. [N]
    air_density_kg_m3 : array_like
        Air density, positive. [kg m⁻³]
    disk_area_m2 : float
        Area A of all rotor disks, positive. [m²]

    Returns
    -------
    ndarray
        Induced velocity, in the broadcast shape. [m s⁻¹]

    Examples
    --------
    A 2 kg quadrotor with 0.2 m² of disk at sea level:

    >>> v_h = hover_induced_velocity_m_s(2.0 * 9.80665, 1.225, disk_area_m2=0.2)
    >>> print(f"{v_h:.2f} m/s")
    6.33 m/s
    """
    thrust = np.asarray(thrust_n, dtype=np.float64)
    density = np.asarray(air_density_kg_m3, dtype=np.float64)
    velocity: FloatArray = np.asarray(np.sqrt(thrust / (2.0 * density * disk_area_m2)))
    return velocity


def induced_velocity_ratio(edgewise_ratio: npt.ArrayLike, axial_ratio: npt.ArrayLike) -> FloatArray:
    r"""Induced velocity over that of hover, on the branch continuous with hover.

    Solves :math:`u \sqrt{x^2 + (z + u)^2} = 1` (Glauert [2]_) by a fixed number of
    Newton steps from the smaller of two upper bounds: the solution of pure axial flight, and that of
    fast edgewise flight, 1 / x.  From there the steps fall on the solution without passing it.

    Parameters
    ----------
    edgewise_ratio : array_like
        Speed in the plane of the disk over the induced velocity of hover, x ≥ 0. [-]
    axial_ratio : array_like
        Speed through the disk over the induced velocity of hover, z ≥ −1.5, positive in a climb. [-]

    Returns
    -------
    ndarray
        Ratio u, in the broadcast shape. [-]

    Examples
    --------
    In a climb at the induced velocity of hover, u = (√5 − 1) / 2:

    >>> print(f"{induced_velocity_ratio(0.0, 1.0):.6f}")
    0.618034
    """
    x, z = np.broadcast_arrays(
        np.asarray(edgewise_ratio, dtype=np.float64), np.asarray(axial_ratio, dtype=np.float64)
    )
    x_squared = x * x
    axial_bound = np.sqrt(0.25 * z * z + 1.0) - 0.5 * z
    u: FloatArray = np.asarray(np.minimum(axial_bound, 1.0 / np.maximum(x, _STANDSTILL)))
    through, step = np.empty_like(u), np.empty_like(u)
    for _ in range(_NEWTON_STEPS):
        # With q = z + u, r² = x² + q²: u − (u r − 1) / (r + u q / r) = (u² q + r) / (r² + u q).
        np.add(z, u, out=through)
        resultant_squared = x_squared + through * through
        through *= u
        np.multiply(u, through, out=step)
        np.sqrt(resultant_squared, out=u)
        u += step
        resultant_squared += through
        u /= resultant_squared
    return u


def momentum_power_w(
    airspeed_m_s: npt.ArrayLike,
    climb_rate_m_s: npt.ArrayLike,
    *,
    mass_kg: float,
    air_density_kg_m3: npt.ArrayLike,
    disk_area_m2: float,
    drag_area_m2: float,
    induced_factor: float,
    axial_factor: float,
    profile_factor: float,
    profile_speed_factor: float,
) -> FloatArray:
    r"""Electrical power of a multicopter in steady flight, by momentum theory.

    The thrust carries the weight and overcomes the drag of the body,
    :math:`\vec T = m g \hat z + \tfrac12 \rho\, C_d A\, V \vec V`, and the disk lies across it.  Then

    .. math::
       P = k_i T v_i + k_a \vec T \cdot \vec V
           + k_p T v_h \left(1 + k_v (V_p / v_h)^2\right),

    induced power, the power of climb and drag, and profile power.  The factors are electrical watts
    for each watt of the ideal disk: they hold the losses of the flow, the motors and the
    controllers together, because a flight log cannot tell them apart.  For blades of one tip speed
    ratio textbooks have :math:`k_v (V_p/v_h)^2 = 4.65 \mu^2`.

    Parameters
    ----------
    airspeed_m_s : array_like
        Horizontal speed through the air. [m s⁻¹]
    climb_rate_m_s : array_like
        Climb rate through the air, descent negative. [m s⁻¹]
    mass_kg : float
        Mass m with payload, positive. [kg]
    air_density_kg_m3 : array_like
        Air density ρ, positive. [kg m⁻³]
    disk_area_m2 : float
        Area A of all rotor disks, positive. [m²]
    drag_area_m2 : float
        Drag coefficient times frontal area of the body. [m²]
    induced_factor : float
        k_i. [-]
    axial_factor : float
        k_a. [-]
    profile_factor : float
        k_p, profile power over ideal power in hover. [-]
    profile_speed_factor : float
        k_v. [-]

    Returns
    -------
    ndarray
        Electrical power of the motors, in the broadcast shape. [W]

    Examples
    --------
    An ideal disk in hover takes T v_h, here 19.6 N x 6.33 m/s:

    >>> power_w = momentum_power_w(
    ...     0.0, 0.0, mass_kg=2.0, air_density_kg_m3=1.225, disk_area_m2=0.2, drag_area_m2=0.02,
    ...     induced_factor=1.0, axial_factor=1.0, profile_factor=0.0, profile_speed_factor=0.0,
    ... )
    >>> print(f"{power_w:.1f} W")
    124.1 W
    """
    pieces = np.nditer(
        [
            np.asarray(airspeed_m_s, dtype=np.float64),
            np.asarray(climb_rate_m_s, dtype=np.float64),
            np.asarray(air_density_kg_m3, dtype=np.float64),
            None,
        ],
        flags=["external_loop", "buffered", "zerosize_ok"],
        buffersize=_CACHED,
    )
    with pieces:
        for forward, climb, density, out in pieces:
            speed_squared = forward * forward + climb * climb
            drag_per_speed = (0.5 * drag_area_m2) * density * np.sqrt(speed_squared)
            thrust_forward = drag_per_speed * forward
            thrust_up = mass_kg * GRAVITY_M_S2 + drag_per_speed * climb
            thrust = np.sqrt(thrust_forward * thrust_forward + thrust_up * thrust_up)
            useful_w = thrust_forward * forward + thrust_up * climb  # of climb and drag
            hover_velocity = hover_induced_velocity_m_s(thrust, density, disk_area_m2=disk_area_m2)
            axial_ratio = useful_w / (thrust * hover_velocity)
            edgewise_squared = np.maximum(
                speed_squared / (hover_velocity * hover_velocity) - axial_ratio * axial_ratio, 0.0
            )
            axial_ratio = np.maximum(axial_ratio, FASTEST_DESCENT_RATIO)
            induced = induced_velocity_ratio(np.sqrt(edgewise_squared), axial_ratio)
            of_flow = np.maximum(induced_factor * induced + axial_factor * axial_ratio, 0.0)
            of_blades = profile_factor * (1.0 + profile_speed_factor * edgewise_squared)
            out[...] = thrust * hover_velocity * (of_flow + of_blades)
        power: FloatArray = pieces.operands[3]
    return power


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

    equations 14 and 15 of [3]_ without the two parameters the authors found to be
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
    climb and one for the descent, each at one rate [4]_.  Their vehicle climbs
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
