"""Hover laws: how the power to hover depends on height, or on mass and air density."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from planner.frozen import frozen
from planner.physics.rotor import (
    altitude_law_hover_power_w,
    density_law_hover_power_w,
    di_franco_buttazzo_power_w,
    liu_power_w,
    momentum_power_w,
)
from planner.vehicle.power_schema import (
    ALTITUDE_LAW,
    CRUISE,
    DENSITY_LAW,
    DI_FRANCO_BUTTAZZO,
    LIU,
    MOMENTUM,
    VERTICAL,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.arrays import FloatArray


@frozen
class AltitudeLaw:
    """Hover power over height above home, P = K H^z: the article's equation 4."""

    coefficient_w: float
    """K, the power at 1 m. [W]"""
    exponent: float
    """z. [-]"""
    lowest_height_m: float
    """Height above home below which the power is held constant. [m]"""

    def __post_init__(self) -> None:
        ALTITUDE_LAW.refuse(self)


@frozen
class DensityLaw:
    """Hover power over mass and air density, scaled from one measured hover."""

    hover_power_w: float
    """Power at the reference mass and density. [W]"""
    reference_mass_kg: float
    """Mass that hovered. [kg]"""
    reference_density_kg_m3: float
    """Density of the air it hovered in. [kg m⁻³]"""
    mass_exponent: float
    """1.5 by momentum theory. [-]"""
    density_exponent: float
    """-0.5 by momentum theory. [-]"""

    def __post_init__(self) -> None:
        DENSITY_LAW.refuse(self)


HoverLaw: TypeAlias = AltitudeLaw | DensityLaw


def hover_power_w(
    law: HoverLaw,
    *,
    height_above_home_m: npt.ArrayLike,
    mass_kg: npt.ArrayLike | None,
    air_density_kg_m3: npt.ArrayLike,
) -> npt.NDArray[np.float64]:
    """Hover power by whichever law a model has.

    Parameters
    ----------
    law : HoverLaw
        The law; an altitude law knows neither mass nor air density.
    height_above_home_m : array_like
        Height above home, for an altitude law. [m]
    mass_kg : array_like or None
        Mass with payload, for a density law. [kg]
    air_density_kg_m3 : array_like
        Air density, for a density law. [kg m⁻³]

    Returns
    -------
    ndarray
        Hover power, in the broadcast shape of what the law depends on. [W]

    Raises
    ------
    ValueError
        If a density law is asked without a mass.
    """
    match law:
        case AltitudeLaw():
            return altitude_law_hover_power_w(
                height_above_home_m,
                coefficient_w=law.coefficient_w,
                exponent=law.exponent,
                lowest_height_m=law.lowest_height_m,
            )
        case DensityLaw():
            if mass_kg is None:
                msg = "a density law needs the mass"
                raise ValueError(msg)
            return density_law_hover_power_w(
                mass_kg,
                air_density_kg_m3,
                hover_power_w=law.hover_power_w,
                reference_mass_kg=law.reference_mass_kg,
                reference_density_kg_m3=law.reference_density_kg_m3,
                mass_exponent=law.mass_exponent,
                density_exponent=law.density_exponent,
            )


@frozen
class CruisePower:
    """Steady power in level flight above hover power, over airspeed."""

    speed_m_s: tuple[float, ...]
    """Airspeeds, rising. [m/s]"""
    power_above_hover_w: tuple[float, ...]
    """Power minus hover power at each speed. [W]"""

    def __post_init__(self) -> None:
        CRUISE.refuse(self)

    def above_hover_w(self, airspeed_m_s: FloatArray) -> FloatArray:
        """Return the power above hover at airspeeds. [W]"""
        return _curve_w(airspeed_m_s, self.speed_m_s, self.power_above_hover_w)


@frozen
class VerticalPower:
    """Steady power in vertical flight above hover power, over climb rate."""

    climb_rate_m_s: tuple[float, ...]
    """Climb rates, rising, descent negative. [m/s]"""
    power_above_hover_w: tuple[float, ...]
    """Power minus hover power at each climb rate. [W]"""

    def __post_init__(self) -> None:
        VERTICAL.refuse(self)

    def above_hover_w(self, climb_rate_m_s: FloatArray) -> FloatArray:
        """Return the power above hover at climb rates. [W]"""
        return _curve_w(climb_rate_m_s, self.climb_rate_m_s, self.power_above_hover_w)


@frozen
class MomentumLaw:
    """All power of the motors by momentum theory: see `planner.physics.rotor.momentum_power_w`."""

    disk_area_m2: float
    """Area of all rotor disks. [m²]"""
    drag_area_m2: float
    """Drag coefficient times frontal area. [m²]"""
    induced_factor: float
    """Electrical over ideal induced power. [-]"""
    axial_factor: float
    """Electrical power over that of climb and drag. [-]"""
    profile_factor: float
    """Electrical profile power over ideal power in hover. [-]"""
    profile_speed_factor: float
    """Growth of profile power with the square of speed over induced velocity. [-]"""

    def __post_init__(self) -> None:
        MOMENTUM.refuse(self)


@frozen
class LiuLaw:
    """All power by five parameters: see `planner.physics.rotor.liu_power_w`."""

    k1: float
    k2_sqrt_kg_m: float
    """[kg^½ m^−½]"""
    c2_sqrt_m_kg: float
    """[m^½ kg^−½]"""
    c4_kg_m: float
    """[kg m⁻¹]"""
    c5_kg_m: float
    """[kg m⁻¹]"""

    def __post_init__(self) -> None:
        LIU.refuse(self)


@frozen
class DiFrancoButtazzoLaw:
    """All power by a polynomial and two powers.

    See `planner.physics.rotor.di_franco_buttazzo_power_w`.
    """

    coefficients: tuple[float, ...]
    """Of power over airspeed, highest power first. [W, W s m⁻¹, …]"""
    climb_power_w: float
    climb_speed_m_s: float
    descent_power_w: float
    descent_speed_m_s: float
    """Positive. [m s⁻¹]"""

    def __post_init__(self) -> None:
        DI_FRANCO_BUTTAZZO.refuse(self)


WholeLaw: TypeAlias = MomentumLaw | LiuLaw | DiFrancoButtazzoLaw
"""Laws that give all the power of the motors, hover and climb included."""
CruiseLaw: TypeAlias = CruisePower | WholeLaw
MASS_LAWS = (MomentumLaw, LiuLaw)
"""Laws in which the mass stands."""


def whole_power_w(
    law: WholeLaw,
    *,
    airspeed_m_s: npt.ArrayLike,
    climb_rate_m_s: npt.ArrayLike,
    mass_kg: float | None,
    air_density_kg_m3: npt.ArrayLike,
) -> FloatArray:
    """Power by a law that gives all of it.

    Parameters
    ----------
    law : MomentumLaw, LiuLaw or DiFrancoButtazzoLaw
        The law.
    airspeed_m_s : array_like
        Horizontal speed through the air. [m s⁻¹]
    climb_rate_m_s : array_like
        Climb rate, descent negative. [m s⁻¹]
    mass_kg : float or None
        Mass with payload, for the laws that know it. [kg]
    air_density_kg_m3 : array_like
        Air density, for momentum theory. [kg m⁻³]

    Returns
    -------
    ndarray
        Power of the motors, in the broadcast shape of what the law depends on. [W]

    Raises
    ------
    ValueError
        If a law that knows the mass is asked without one.
    """
    if isinstance(law, DiFrancoButtazzoLaw):
        return di_franco_buttazzo_power_w(
            airspeed_m_s,
            climb_rate_m_s,
            coefficients=law.coefficients,
            climb_power_w=law.climb_power_w,
            climb_speed_m_s=law.climb_speed_m_s,
            descent_power_w=law.descent_power_w,
            descent_speed_m_s=law.descent_speed_m_s,
        )
    if mass_kg is None:
        msg = "this law of power needs the mass"
        raise ValueError(msg)
    if isinstance(law, LiuLaw):
        return liu_power_w(
            airspeed_m_s,
            climb_rate_m_s,
            mass_kg=mass_kg,
            k1=law.k1,
            k2_sqrt_kg_m=law.k2_sqrt_kg_m,
            c2_sqrt_m_kg=law.c2_sqrt_m_kg,
            c4_kg_m=law.c4_kg_m,
            c5_kg_m=law.c5_kg_m,
        )
    return momentum_power_w(
        airspeed_m_s,
        climb_rate_m_s,
        mass_kg=mass_kg,
        air_density_kg_m3=air_density_kg_m3,
        disk_area_m2=law.disk_area_m2,
        drag_area_m2=law.drag_area_m2,
        induced_factor=law.induced_factor,
        axial_factor=law.axial_factor,
        profile_factor=law.profile_factor,
        profile_speed_factor=law.profile_speed_factor,
    )


def _curve_w(at: FloatArray, rates: Sequence[float], powers: Sequence[float]) -> FloatArray:
    """Return power above hover by a curve that holds no power at rest.

    Beyond its last point a curve that rises goes on rising; elsewhere the nearest value is held, so
    that nothing is ever counted as saved that was not seen.
    """
    x, y = np.asarray(rates, dtype=np.float64), np.asarray(powers, dtype=np.float64)
    if not (x == 0.0).any():
        place = int(np.searchsorted(x, 0.0))
        x, y = np.insert(x, place, 0.0), np.insert(y, place, 0.0)
    slope = max(float((y[-1] - y[-2]) / (x[-1] - x[-2])), 0.0)
    power: FloatArray = np.interp(at, x, y) + slope * np.maximum(at - x[-1], 0.0)
    return power
