r"""What multicopters have in common that nobody has logged: ranges, each with its source.

The numbers are data, in ``models/priors``: a table of ranges, and one of published multicopters
(`planner.vehicle.drones`).  From those with a flight time follows what hovering costs,

.. math:: k = \frac{P}{T v_h} = a + b / d, \qquad T v_h = \frac{(m g)^{3/2}}{\sqrt{2 \rho A}},

electrical watts for each watt of the ideal disk, over the diameter d of the propellers: small blades
fly at low Reynolds numbers, and what the electronics take weighs more.  The fit is by least squares of
the relative errors.  How far a vehicle may be off that is not in the table is how far those of each size of
propeller are from the fit to all others.
"""

import math
import tomllib
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from planner import quantity
from planner.arrays import FloatArray
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3
from planner.physics.rotor import hover_induced_velocity_m_s
from planner.units import GRAVITY_M_S2, JOULES_PER_WATT_HOUR, SECONDS_PER_MINUTE
from planner.values import Value
from planner.vehicle.declared import Annotated, Key, Part, Problems
from planner.vehicle.drones import PublishedDrone, drone_table
from planner.vehicle.figures import HoverKind
from planner.vehicle.reader import Reading, models_root

OF_MIDDLE_80_PERCENT = 2.0 * 1.2815515655446004
"""Width of the middle 80 % of a normal distribution over its standard deviation. [-]"""

BEST_HOVER_EFFICIENCY = 0.75
"""Power of the ideal disk over that of the battery, which no multicopter hovers at: the best of the published
ones has 0.65; a figure of merit of 0.8 and motors and controllers of 0.9 are 0.72. [-]"""


def hover_impossible(cost: float) -> str | None:
    """Return what no multicopter does that hovers at such a cost; ``None`` where some may."""
    if cost * BEST_HOVER_EFFICIENCY >= 1.0:
        return None
    shown = quantity.beside(1.0 / cost, BEST_HOVER_EFFICIENCY, quantity.percent)
    return (
        f"turns {shown} of the battery's power into lift; no multicopter reaches "
        f"{quantity.percent(BEST_HOVER_EFFICIENCY)}"
    )


class Prior(Part):
    """A quantity nobody measured on this vehicle: its likeliest value, and where 80 % lie."""

    name: Annotated[str, Key("what it is, as the models that assume it say")]
    value: Annotated[float, Key("likeliest value")]
    low: Annotated[float, Key("below it lie 10 % of multicopters")]
    high: Annotated[float, Key("above it lie 10 %")]
    source: Annotated[str, Key("who says so, or why")]
    unit: Annotated[str | None, Key("of the values")] = None

    def __str__(self) -> str:
        """Return value, range and source as a pilot reads them."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{self.name}: {self.value:g}{unit}, 8 of 10 multicopters have {self.low:g} to {self.high:g}; "
            f"{self.source}"
        )

    def inconsistencies(self) -> Problems:
        """Yield the problem of a value outside its own range."""
        if not 0.0 < self.low <= self.value <= self.high:
            yield "value", "must lie between low and high, all above 0"

    @property
    def fraction(self) -> float:
        """Standard deviation of the logarithm. [-]"""
        return math.log(self.high / self.low) / OF_MIDDLE_80_PERCENT


class HoverCost(Value):
    """Electrical watts for each watt of the ideal disk in hover, over the diameter of the propellers."""

    constant: float
    per_diameter_m: float
    fraction: float
    """How far a vehicle is from it that it was not found from: standard deviation of the logarithm. [-]"""
    count: int
    """Published flight times it was found from."""
    sizes: int
    """Sizes of propellers among them."""

    def at(self, propeller_m: float) -> float:
        """Return the cost with propellers of a diameter. [-]"""
        return self.constant + self.per_diameter_m / propeller_m


def disk_area_m2(rotors: int, propeller_m: float) -> float:
    """Return the area of all rotor disks; two on one arm count twice. [m²]"""
    return rotors * math.pi / 4.0 * propeller_m**2


def ideal_hover_w(mass_kg: float, rotors: int, propeller_m: float) -> float:
    """Return the power of an ideal disk that carries a mass at sea level: no rotor takes less. [W]

    Examples
    --------
    2 kg on four rotors of 10 inches, T v_h = 19.6 N x 6.28 m/s:

    >>> print(f"{ideal_hover_w(2.0, 4, 0.254):.0f} W")
    123 W
    """
    thrust_n = mass_kg * GRAVITY_M_S2
    area_m2 = disk_area_m2(rotors, propeller_m)
    velocity = hover_induced_velocity_m_s(thrust_n, SEA_LEVEL_DENSITY_KG_M3, disk_area_m2=area_m2)
    return float(thrust_n * velocity)


@lru_cache(maxsize=1)
def multicopter_priors() -> dict[str, Prior]:
    """Return the ranges by the names of their quantities.

    Raises
    ------
    ValueError
        If their file is not as it must be: a mistake in what is shipped.
    """
    path = models_root() / "priors" / "multicopter.toml"
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    document.pop("schema", None)
    reading = Reading()
    held = {name: reading.part(Prior, raw, f"{name}.") for name, raw in document.items()}
    if reading.problems:
        msg = f"{path.name}: {reading.problems}"
        raise ValueError(msg)
    return {name: one for name, one in held.items() if isinstance(one, Prior)}


class PublishedHover(Value):
    """What hovering costs by one published flight time."""

    name: str
    propeller_m: float
    cost: float
    """Electrical watts for each ideal watt. [-]"""


@lru_cache(maxsize=1)
def published_hovers() -> tuple[PublishedHover, ...]:
    """Return what hovering costs by each published flight time."""
    return tuple(filter(None, map(_published_hover, drone_table().drones)))


def _published_hover(drone: PublishedDrone) -> PublishedHover | None:
    """Return what hovering costs a drone; ``None`` where no flight time says so."""
    figure, mass_kg, propeller_m = drone.figure, drone.mass_kg, drone.propeller_m
    if figure is None or mass_kg is None or propeller_m is None:
        return None
    if figure.kind not in {HoverKind.TIME, HoverKind.LONGEST}:
        return None
    off = multicopter_priors()[figure.prior].value
    taken_w = off * timed_power_w(drone.battery.energy_wh, figure.value)
    ideal_w = ideal_hover_w(mass_kg, drone.rotors, propeller_m)
    return PublishedHover(name=drone.name, propeller_m=propeller_m, cost=taken_w / ideal_w)


def timed_power_w(energy_wh: float, minutes: float) -> float:
    """Return the power that takes an energy in a time. [W]"""
    return energy_wh * JOULES_PER_WATT_HOUR / (SECONDS_PER_MINUTE * minutes)


@lru_cache(maxsize=1)
def hover_cost() -> HoverCost:
    """Return what hovering costs, by those multicopters."""
    return fit_hover_cost(published_hovers())


def fit_hover_cost(hovers: Sequence[PublishedHover]) -> HoverCost:
    """Return what hovering costs by some multicopters, of three sizes of propellers at least.

    A size counts once, however many drones have it: those of one are built alike.
    """
    sizes = sorted({one.propeller_m for one in hovers})
    squares = [np.mean(np.square(_errors_of_size(hovers, one))) for one in sizes]
    constant, per_diameter_m = _fit(hovers).tolist()
    return HoverCost(
        constant=constant,
        per_diameter_m=per_diameter_m,
        fraction=float(np.sqrt(np.mean(squares))),
        count=len(hovers),
        sizes=len(sizes),
    )


def _errors_of_size(hovers: Sequence[PublishedHover], propeller_m: float) -> FloatArray:
    """Return how far the hovers with one size of propeller are from the fit to all others. (n,) [-]"""
    own = [one for one in hovers if one.propeller_m == propeller_m]
    design, cost = _design(own)
    others = [one for one in hovers if one.propeller_m != propeller_m]
    return np.asarray(np.log(cost / (design @ _fit(others))))


def _fit(hovers: Sequence[PublishedHover]) -> FloatArray:
    design, cost = _design(hovers)
    return np.asarray(
        np.linalg.lstsq(design / cost[:, np.newaxis], np.ones_like(cost), rcond=None)[0]
    )


def _design(hovers: Sequence[PublishedHover]) -> tuple[FloatArray, FloatArray]:
    """Return what the cost of each is made of, (n, 2), and the cost, (n,)."""
    design = np.array([[1.0, 1.0 / one.propeller_m] for one in hovers])
    return design, np.array([one.cost for one in hovers])
