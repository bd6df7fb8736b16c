"""Laws of power: of hover over height, or over mass and air density; of level and vertical flight."""

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from planner.units import GRAVITY_M_S2
from planner.values import field_values
from planner.vehicle.declared import (
    NOT_NEGATIVE,
    POSITIVE,
    Annotated,
    Key,
    Part,
    Problems,
    Range,
    curve,
    length_problems,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.arrays import FloatArray
    from planner.physics.rotor import Acceleration

_FACTOR = Range(0.0, 20.0)
_ABOVE_HOVER = Key("steady power minus hover power", "W", count=(2, 1000))


class AltitudeLaw(Part, tag_field="law", tag="altitude-power"):
    """Hover power over height: P = coefficient_w x H^exponent, H the height above home.

    Held constant below lowest_height_m.  Equation 4 of the article.
    """

    coefficient_w: Annotated[float, Key("power at 1 m", "W", POSITIVE)]
    exponent: Annotated[float, Key("exponent of the height", range=Range(-1.0, 1.0))]
    lowest_height_m: Annotated[
        float, Key("height below which the power is held constant", "m", POSITIVE)
    ]

    def power_w(self, height_above_home_m: "npt.ArrayLike") -> "FloatArray":
        """Return the power at heights. [W]

        The bare law gives none at the ground and falls steeply below 1 m, where nothing was measured.
        """
        height = np.maximum(np.asarray(height_above_home_m, np.float64), self.lowest_height_m)
        return np.asarray(self.coefficient_w * height**self.exponent)


class DensityLaw(Part, tag_field="law", tag="density"):
    """Hover power over mass and air density, scaled from one hover that was measured.

    P = hover_power_w x (m / reference_mass_kg)^mass_exponent x (rho /
    reference_density_kg_m3)^density_exponent.  Momentum theory has exponents 1.5 and -0.5.  Needs
    mass_kg at the top of the file.
    """

    hover_power_w: Annotated[float, Key("power at the reference mass and density", "W", POSITIVE)]
    reference_mass_kg: Annotated[float, Key("mass that hovered", "kg", POSITIVE)]
    reference_density_kg_m3: Annotated[
        float, Key("density of the air it hovered in", "kg/m³", Range(0.0, 2.0, excludes_low=True))
    ]
    mass_exponent: Annotated[float, Key("exponent of the mass ratio", range=Range(0.0, 3.0))]
    density_exponent: Annotated[
        float, Key("exponent of the density ratio, not positive", range=Range(-2.0, 0.0))
    ]

    def power_w(self, mass_kg: "npt.ArrayLike", air_density_kg_m3: "npt.ArrayLike") -> "FloatArray":
        """Return the power at masses and densities, which broadcast. [W]

        Momentum theory of the actuator disk, P = T^1.5 / sqrt(2 rho A) (equation 3 of the article
        means this, its exponent 2/3 is a misprint); profile power makes measured exponents differ.
        """
        mass = np.asarray(mass_kg, np.float64) / self.reference_mass_kg
        density = np.asarray(air_density_kg_m3, np.float64) / self.reference_density_kg_m3
        return np.asarray(
            self.hover_power_w * mass**self.mass_exponent * density**self.density_exponent
        )


HoverLaw: TypeAlias = AltitudeLaw | DensityLaw


def hover_power_w(
    law: HoverLaw,
    *,
    height_above_home_m: "npt.ArrayLike",
    mass_kg: "npt.ArrayLike | None",
    air_density_kg_m3: "npt.ArrayLike",
) -> "FloatArray":
    """Return hover power by whichever law a model has, in the shape of what it depends on. [W]

    An altitude law knows the height, a density law the mass with payload and the air density.

    Raises
    ------
    ValueError
        If a density law is asked without a mass.
    """
    if isinstance(law, AltitudeLaw):
        return law.power_w(height_above_home_m)
    if mass_kg is None:
        msg = "a density law needs the mass"
        raise ValueError(msg)
    return law.power_w(mass_kg, air_density_kg_m3)


class CruisePower(Part, tag_field="power", tag="table"):
    """Steady power in level flight over airspeed, as a table.

    Below its first speed in proportion to the speed, from hover power on.
    """

    speed_m_s: Annotated[tuple[float, ...], curve("airspeeds, rising", "m/s", NOT_NEGATIVE)]
    power_above_hover_w: Annotated[tuple[float, ...], _ABOVE_HOVER]

    def inconsistencies(self) -> Problems:
        """Yield what is wrong between the lists."""
        return _curve_problems(self, "speed_m_s")

    def above_hover_w(self, airspeed_m_s: "FloatArray") -> "FloatArray":
        """Return the power above hover at airspeeds. [W]"""
        return _curve_w(airspeed_m_s, self.speed_m_s, self.power_above_hover_w)


class VerticalPower(Part):
    """Steady power in vertical flight over climb rate, as a table, added to that of [cruise].

    Optional, for laws that know no climb: table and not-given.
    """

    climb_rate_m_s: Annotated[
        tuple[float, ...], curve("climb rates, rising, descent negative", "m/s")
    ]
    power_above_hover_w: Annotated[tuple[float, ...], _ABOVE_HOVER]

    def inconsistencies(self) -> Problems:
        """Yield what is wrong between the lists."""
        return _curve_problems(self, "climb_rate_m_s")

    def above_hover_w(self, climb_rate_m_s: "FloatArray") -> "FloatArray":
        """Return the power above hover at climb rates. [W]"""
        return _curve_w(climb_rate_m_s, self.climb_rate_m_s, self.power_above_hover_w)


class MomentumLaw(Part, tag_field="power", tag="momentum"):
    """Steady power by momentum theory, over airspeed, climb rate, mass and air density.

    P = k_i T (v_i + k_r v_r) + k_a T.V + k_p T v_h (1 + k_v (V_p / v_h)^2), thrust T against weight and
    drag, induced velocity v_i (v_h in hover), v_r what a vortex ring adds to it in slow descents, V_p the
    speed in the plane of the disk.  The factors are
    electrical watts for each watt of the ideal disk.  Needs mass_kg at the top.
    """

    disk_area_m2: Annotated[
        float, Key("area of all rotor disks, as the fit sees it", "m²", POSITIVE)
    ]
    drag_area_m2: Annotated[float, Key("drag coefficient times frontal area", "m²", NOT_NEGATIVE)]
    induced_factor: Annotated[float, Key("k_i, induced power", range=_FACTOR)]
    axial_factor: Annotated[float, Key("k_a, power of climb and drag", range=_FACTOR)]
    profile_factor: Annotated[float, Key("k_p, profile power in hover", range=_FACTOR)]
    profile_speed_factor: Annotated[
        float, Key("k_v, growth of profile power with speed", range=_FACTOR)
    ]
    vortex_ring_factor: Annotated[
        float,
        Key(
            "k_r, surplus of a vortex ring in slow descents: 1 as of rotors", range=Range(0.0, 3.0)
        ),
    ] = 0.0

    def inconsistencies(self) -> Problems:
        """Yield the problem of a rotor that needs less than the ideal one."""
        if self.induced_factor + self.profile_factor < 1.0:
            yield "induced_factor", "and profile_factor are less than 1 together: better than ideal"


class LiuLaw(Part, tag_field="power", tag="liu"):
    """Steady power by the five parameters of Liu, Sengupta and Kurzhanskiy.

    ICUAS 2017, equations 14 and 15, over airspeed, climb rate and mass; it knows no air density.  For
    an IRIS+ of 1.28 kg the parameters are quoted as 0.8554, 0.3051, 0.3177, 0.0296, 0.0279.  Needs
    mass_kg at the top.
    """

    k1: Annotated[float, Key("k₁", range=POSITIVE)]
    k2_sqrt_kg_m: Annotated[float, Key("k₂", "√(kg/m)", POSITIVE)]
    c2_sqrt_m_kg: Annotated[float, Key("c₂", "√(m/kg)", NOT_NEGATIVE)]
    c4_kg_m: Annotated[float, Key("c₄, drag", "kg/m", NOT_NEGATIVE)]
    c5_kg_m: Annotated[float, Key("c₅, lift", "kg/m", NOT_NEGATIVE)]

    def power_w(
        self, airspeed_m_s: "npt.ArrayLike", climb_rate_m_s: "npt.ArrayLike", mass_kg: float
    ) -> "FloatArray":
        r"""Return the power at airspeeds V and climb rates w. [W]

        .. math::
           P &= k_1 T \left[\frac{w}{2} + \sqrt{\left(\frac{w}{2}\right)^2 + \frac{T}{k_2^2}}\right]
                + c_2 T^{3/2} + c_4 V^3, \\
           T &= \sqrt{\left(m g - c_5 (V \cos\alpha)^2\right)^2 + \left(c_4 V^2\right)^2},

        without the two parameters the authors found to be zero.  For a planned flight the angle of
        attack α is that of steady flight, where drag tilts the thrust:
        :math:`\cos^2\alpha = 1 / (1 + (c_4 V^2 / m g)^2)`.  The form and the numbers are as two
        independent public implementations give them; the paper was not at hand in full.
        """
        speed_squared = np.square(np.asarray(airspeed_m_s, np.float64))
        half_climb = 0.5 * np.asarray(climb_rate_m_s, np.float64)
        weight_n = mass_kg * GRAVITY_M_S2
        drag_n = self.c4_kg_m * speed_squared
        level_speed_squared = speed_squared / (1.0 + np.square(drag_n / weight_n))
        thrust_n = np.hypot(weight_n - self.c5_kg_m * level_speed_squared, drag_n)
        through_m_s = half_climb + np.sqrt(
            half_climb * half_climb + thrust_n / self.k2_sqrt_kg_m**2
        )
        return np.asarray(
            self.k1 * thrust_n * through_m_s
            + self.c2_sqrt_m_kg * thrust_n**1.5
            + drag_n * np.sqrt(speed_squared)  # c4 V³
        )


class DiFrancoButtazzoLaw(Part, tag_field="power", tag="di-franco-buttazzo"):
    """Steady power by the curve of Di Franco and Buttazzo, J. Intell. Robot. Syst. 83, 2016.

    A polynomial over airspeed, and the power of one climb and of one descent, from which other climb
    rates are counted in proportion.  It knows neither mass nor air density.
    """

    coefficients: Annotated[
        tuple[float, ...],
        Key(
            "of level flight over airspeed, highest power first; the last is hover power",
            "W, W s/m, …",
            count=(1, 9),
        ),
    ]
    climb_power_w: Annotated[float, Key("in the climb", "W", POSITIVE)]
    climb_speed_m_s: Annotated[float, Key("its rate", "m/s", POSITIVE)]
    descent_power_w: Annotated[float, Key("descending", "W", POSITIVE)]
    descent_speed_m_s: Annotated[float, Key("its rate, positive", "m/s", POSITIVE)]

    def inconsistencies(self) -> Problems:
        """Yield the problem of a polynomial that gives no hover power."""
        if not self.coefficients[-1] > 0.0:
            yield "coefficients", "must end with hover power, greater than 0"

    def power_w(
        self, airspeed_m_s: "npt.ArrayLike", climb_rate_m_s: "npt.ArrayLike"
    ) -> "FloatArray":
        """Return the power at airspeeds and climb rates. [W]

        The authors' vehicle climbs and descends straight up and down at one rate each; that the part
        above hover grows in proportion to the rate, so that a metre of height costs the same at any
        rate, is read into it here.  The form is that of github.com/carmelodfr/iris3DR_energy_model;
        the paper's own numbers were not found in readable form.
        """
        climb = np.asarray(climb_rate_m_s, np.float64)
        level = np.polyval(np.asarray(self.coefficients), np.asarray(airspeed_m_s, np.float64))
        hover_w = self.coefficients[-1]
        per_rate = np.where(
            climb >= 0.0,
            (self.climb_power_w - hover_w) / self.climb_speed_m_s,
            (hover_w - self.descent_power_w) / self.descent_speed_m_s,
        )
        return np.asarray(level + per_rate * climb)


WholeLaw: TypeAlias = MomentumLaw | LiuLaw | DiFrancoButtazzoLaw
"""Laws that give all the power of the motors, hover and climb included."""
CruiseLaw: TypeAlias = CruisePower | WholeLaw
MASS_LAWS = (DensityLaw, MomentumLaw, LiuLaw)
"""Laws that depend on the mass."""


def whole_power_w(
    law: WholeLaw,
    *,
    airspeed_m_s: "npt.ArrayLike",
    climb_rate_m_s: "npt.ArrayLike",
    mass_kg: float | None,
    air_density_kg_m3: "npt.ArrayLike",
    acceleration: "Acceleration | None" = None,
) -> "FloatArray":
    """Return the power of the motors by a law that gives all of it. [W]

    Airspeed is horizontal, descent negative, the mass with payload; they, the density and the acceleration
    broadcast.  Only momentum theory knows an acceleration.

    Raises
    ------
    ValueError
        If a law that knows the mass is asked without one.
    """
    if isinstance(law, DiFrancoButtazzoLaw):
        return law.power_w(airspeed_m_s, climb_rate_m_s)
    if mass_kg is None:
        msg = "this law of power needs the mass"
        raise ValueError(msg)
    if isinstance(law, LiuLaw):
        return law.power_w(airspeed_m_s, climb_rate_m_s, mass_kg)
    from planner.physics.rotor import Rotor, momentum_power_w

    return momentum_power_w(
        airspeed_m_s,
        climb_rate_m_s,
        Rotor(**field_values(law)),
        mass_kg=mass_kg,
        air_density_kg_m3=air_density_kg_m3,
        acceleration=acceleration,
    )


def _curve_problems(curve: CruisePower | VerticalPower, rates: str) -> Problems:
    """Yield what is wrong with a curve of power above hover: it is none at rest."""
    problems = list(length_problems(curve, rates, "power_above_hover_w"))
    yield from problems
    at_rest_w = dict(zip(getattr(curve, rates), curve.power_above_hover_w, strict=False)).get(0.0)
    if at_rest_w and not problems:
        problem = f"must be 0 where {rates} is 0, got {at_rest_w:g}: at rest it is hover"
        yield "power_above_hover_w", problem


def _curve_w(at: "FloatArray", rates: "Sequence[float]", powers: "Sequence[float]") -> "FloatArray":
    """Return power above hover by a curve that holds no power at rest.

    Beyond its last point a curve that rises goes on rising; elsewhere the nearest value is held, so
    that nothing is ever counted as saved that was not seen.
    """
    x, y = np.asarray(rates, dtype=np.float64), np.asarray(powers, dtype=np.float64)
    if not (x == 0.0).any():
        place = int(np.searchsorted(x, 0.0))
        x, y = np.insert(x, place, 0.0), np.insert(y, place, 0.0)
    slope = max(float((y[-1] - y[-2]) / (x[-1] - x[-2])), 0.0)
    return np.asarray(np.interp(at, x, y) + slope * np.maximum(at - x[-1], 0.0))
