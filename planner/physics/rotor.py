r"""Momentum theory of lifting rotors, taken together as one actuator disk.

Everything is counted in the induced velocity of hover,

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
.. [3] J. G. Leishman, "Principles of Helicopter Aerodynamics", Cambridge 2006, section 2.13.
.. [4] W. Johnson, "Model for Vortex Ring State Influence on Rotorcraft Flight Dynamics",
   NASA/TP-2005-213477, 2005.
.. [5] P. Foehn et al., "Agilicious: Open-source and open-hardware agile quadrotor for vision-based flight",
   Science Robotics 7 (2022) eabl6259; agilib/simulator/model_propeller_bem.cpp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.units import GRAVITY_M_S2

if TYPE_CHECKING:
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


def hover_induced_velocity_m_s(
    thrust_n: npt.ArrayLike, air_density_kg_m3: npt.ArrayLike, *, disk_area_m2: float
) -> FloatArray:
    r"""Return the induced velocity of an ideal actuator disk in hover. [m s⁻¹]

    .. math:: v_h = \sqrt{T / (2 \rho A)}

    for the thrust T ≥ 0 of all rotors [N], positive air densities ρ and the area A of all their disks;
    they broadcast.

    Examples
    --------
    A 2 kg quadrotor with 0.2 m² of disk at sea level:

    >>> v_h = hover_induced_velocity_m_s(2.0 * 9.80665, 1.225, disk_area_m2=0.2)
    >>> print(f"{v_h:.2f} m/s")
    6.33 m/s
    """
    thrust = np.asarray(thrust_n, dtype=np.float64)
    density = np.asarray(air_density_kg_m3, dtype=np.float64)
    return np.asarray(np.sqrt(thrust / (2.0 * density * disk_area_m2)))


def induced_velocity_ratio(edgewise_ratio: npt.ArrayLike, axial_ratio: npt.ArrayLike) -> FloatArray:
    r"""Return the induced velocity over that of hover, on the branch continuous with hover. [-]

    Solves :math:`u \sqrt{x^2 + (z + u)^2} = 1` (Glauert [2]_) for the speeds x ≥ 0 in the plane of the
    disk and z ≥ −1.5 through it, positive in a climb, both over the induced velocity of hover.  A fixed
    number of Newton steps from the smaller of two upper bounds, the solutions of pure axial flight and of
    fast edgewise flight, 1 / x, falls on the solution without passing it.

    Examples
    --------
    In a climb at the induced velocity of hover, u = (√5 − 1) / 2:

    >>> print(f"{induced_velocity_ratio(0.0, 1.0):.6f}")
    0.618034
    """
    x = np.asarray(edgewise_ratio, dtype=np.float64)
    z = np.asarray(axial_ratio, dtype=np.float64)
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


def vortex_ring_surplus(edgewise_squared: FloatArray, axial_ratio: FloatArray) -> FloatArray:
    """Return what a vortex ring adds to the induced velocity, over that of hover. [-]

    None in a climb or where the speed in the plane of the disk, of which the square is given, is that
    of hover; both speeds over the induced velocity of hover, down to −1.5 through the disk.

    Measured is the quartic for vertical descents that textbooks carry (section 2.13 of [3]_; its constant 1
    of an ideal disk), with the coefficients that a dozen public programs quote from there or from Johnson,
    Helicopter Theory, 1980, among them the simulator of Agilicious [5]_ with the constant 1, others with
    0.974 and 1.15; neither book was at hand.  That it is gone at an edgewise speed of v_h is of
    flight tests reported in [4]_; that it fades with the square up to there is assumed.
    """
    z = np.maximum(-axial_ratio, 0.0)
    measured = 1.0 + z * (1.125 + z * (-1.372 + z * (1.718 - 0.655 * z)))
    ideal = 0.5 * z + np.sqrt(0.25 * z * z + 1.0)
    return np.asarray((measured - ideal) * np.maximum(1.0 - edgewise_squared, 0.0))


class Acceleration(NamedTuple):
    """How the velocity of vehicles changes, seen from the air they fly through; all broadcast."""

    along_m_s2: npt.ArrayLike
    """Along the horizontal airspeed, negative in braking. [m s⁻²]"""
    across_m_s2: npt.ArrayLike
    """Horizontally across it, to either side. [m s⁻²]"""
    up_m_s2: npt.ArrayLike
    """Of the climb rate. [m s⁻²]"""


class Rotor(NamedTuple):
    """What momentum theory knows of a multicopter.

    The factors are electrical watts for each watt of the ideal disk: they hold the losses of the
    flow, the motors and the controllers together, because a flight log cannot tell them apart.
    """

    disk_area_m2: float
    """Area A of all rotor disks. [m²]"""
    drag_area_m2: float
    """Drag coefficient times frontal area of the body, C_d A. [m²]"""
    induced_factor: float
    """k_i. [-]"""
    axial_factor: float
    """k_a. [-]"""
    profile_factor: float
    """k_p, profile power over ideal power in hover. [-]"""
    profile_speed_factor: float
    """k_v. [-]"""
    vortex_ring_factor: float = 0.0
    """k_r: 1 as measured of rotors, 0 for momentum theory alone. [-]"""


def momentum_power_w(
    airspeed_m_s: npt.ArrayLike,
    climb_rate_m_s: npt.ArrayLike,
    rotor: Rotor,
    *,
    mass_kg: float,
    air_density_kg_m3: npt.ArrayLike,
    acceleration: Acceleration | None = None,
) -> FloatArray:
    r"""Return the electrical power of a multicopter by momentum theory. [W]

    The thrust carries the weight, overcomes the drag of the body and accelerates,
    :math:`\vec T = m (g \hat z + \vec a) + \tfrac12 \rho\, C_d A\, V \vec V`, and the disk lies across it.
    The flow is that of steady flight at each moment: it follows within the time the disk moves through
    its own wake.  Then

    .. math::
       P = k_i T (v_i + k_r v_r) + k_a \vec T \cdot \vec V
           + k_p T v_h \left(1 + k_v (V_p / v_h)^2\right),

    induced power with the surplus v_r of a vortex ring (`vortex_ring_surplus`), the power of climb, drag
    and gain of speed, and profile power.  For blades of one tip speed ratio
    textbooks have :math:`k_v (V_p/v_h)^2 = 4.65 \mu^2`.  Airspeed (horizontal), climb rate (descent
    negative), density and acceleration (``None``: none) broadcast; the mass is that with payload.

    Examples
    --------
    An ideal disk in hover takes T v_h, here 19.6 N x 6.33 m/s:

    >>> ideal = Rotor(0.2, 0.02, induced_factor=1.0, axial_factor=1.0, profile_factor=0.0,
    ...               profile_speed_factor=0.0)
    >>> power_w = momentum_power_w(0.0, 0.0, ideal, mass_kg=2.0, air_density_kg_m3=1.225)
    >>> print(f"{power_w:.1f} W")
    124.1 W
    """
    given = (airspeed_m_s, climb_rate_m_s, air_density_kg_m3, *(acceleration or ()))
    pieces = np.nditer(
        [*(np.asarray(one, dtype=np.float64) for one in given), None],
        flags=["external_loop", "buffered", "zerosize_ok"],
        buffersize=_CACHED,
    )
    with pieces:
        for forward, climb, density, *changes, out in pieces:
            speed_squared = forward * forward + climb * climb
            drag_per_speed = (0.5 * rotor.drag_area_m2) * density * np.sqrt(speed_squared)
            thrust_forward = drag_per_speed * forward
            thrust_up = mass_kg * GRAVITY_M_S2 + drag_per_speed * climb
            across_squared: FloatArray | float = 0.0
            if changes:
                along, across, up = changes
                thrust_forward += mass_kg * along
                thrust_up += mass_kg * up
                across_squared = np.square(mass_kg * across)
            thrust = np.sqrt(
                thrust_forward * thrust_forward + thrust_up * thrust_up + across_squared
            )
            useful_w = thrust_forward * forward + thrust_up * climb  # of climb, drag, gain of speed
            hover_velocity = hover_induced_velocity_m_s(
                thrust, density, disk_area_m2=rotor.disk_area_m2
            )
            axial_ratio = useful_w / (thrust * hover_velocity)
            edgewise_squared = np.maximum(
                speed_squared / (hover_velocity * hover_velocity) - axial_ratio * axial_ratio, 0.0
            )
            axial_ratio = np.maximum(axial_ratio, FASTEST_DESCENT_RATIO)
            induced = induced_velocity_ratio(np.sqrt(edgewise_squared), axial_ratio)
            if rotor.vortex_ring_factor:
                ring = vortex_ring_surplus(edgewise_squared, axial_ratio)
                induced = induced + rotor.vortex_ring_factor * ring
            of_flow = np.maximum(
                rotor.induced_factor * induced + rotor.axial_factor * axial_ratio, 0.0
            )
            of_blades = rotor.profile_factor * (1.0 + rotor.profile_speed_factor * edgewise_squared)
            out[...] = thrust * hover_velocity * (of_flow + of_blades)
        power: FloatArray = pieces.operands[-1]
    return power
