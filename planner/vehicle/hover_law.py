"""Hover laws: how the power to hover depends on height, or on mass and air density."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from planner.frozen import frozen
from planner.physics.hover import altitude_law_hover_power_w, density_law_hover_power_w
from planner.vehicle.power_schema import ALTITUDE_LAW, DENSITY_LAW

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


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
