r"""Power of steady flight over airspeed, climb rate, mass and air density: momentum theory fitted.

The six numbers of `planner.physics.rotor.momentum_power_w` are positive; their logarithms are fitted by
least squares to the mean powers of steady flight.  Flights of nearly one airspeed and climb rate make up
one cell, and each cell counts once, however long it was flown: an hour of hover must not drown a minute
of cruise.

Few flights tell all six apart.  Weak priors on the logarithms, wide enough for any multirotor, hold what
the flights leave open; the errors say which those are.

.. math:: \min_x \sum_c \frac{1}{n_c} \sum_{i \in c}
          \frac{(P(x; V_i, \dots) - P_i)^2}{\sigma_i^2 + (\epsilon P_i)^2}
          + \sum_k \frac{(x_k - \mu_k)^2}{\tau_k^2},

with ε the share to which momentum theory describes a multirotor at all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.identify.estimate import Estimate
from planner.physics.rotor import momentum_power_w
from planner.units import GRAVITY_M_S2
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt

    from planner.identify.steady import SteadyPower

    FloatArray = npt.NDArray[np.float64]

NAMES = (
    "disk_area_m2",
    "drag_area_m2",
    "induced_factor",
    "axial_factor",
    "profile_factor",
    "profile_speed_factor",
)
_DISK_LOADING_N_M2 = 70.0
"""Of multirotors from 30 to 160: centre of the prior of the disk area. [N m⁻²]"""
_DRAG_AREA_AT_1_KG_M2 = 0.015
"""Of a body of 1 kg, growing with the mass to the power 2/3: centre of its prior. [m²]"""
_FACTORS = (1.6, 1.4, 0.35, 0.2)
"""Centres of the priors of the factors: electrical over ideal watts. [-]"""
_SPREADS = (0.5, 0.8, 0.3, 0.3, 0.6, 1.0)
"""Standard deviations of the priors, of the logarithms. [-]"""
_MODEL_SHARE = 0.01
"""To which momentum theory describes a multirotor. [-]"""
_LEAST_CELLS = 3
"""Of level flight, hover counted: fewer tell nothing about the power over speed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SteadyMap:
    """Momentum theory fitted to steady flight."""

    law: MomentumLaw
    estimates: tuple[Estimate, ...]
    """The six numbers with their errors."""
    from_prior: tuple[str, ...]
    """Those of which the flights tell next to nothing."""
    rms_w: float
    """Root mean square of what the cells differ from the law by. [W]"""
    cells: int
    """Number of different airspeeds and climb rates."""
    beyond_kg: Mapping[str, float]
    """Mass of each flight beyond the one given, by source, where it was fitted. [kg]"""

    def residuals_w(self, flights: Sequence[SteadyPower]) -> FloatArray:
        """Return predicted less measured power of steady flights, (n,) [W]."""
        values = np.array([getattr(self.law, name) for name in NAMES])
        measured: FloatArray = np.array([f.power_w for f in flights])
        beyond_kg = np.array([self.beyond_kg.get(f.source, 0.0) for f in flights])
        return _powers_w(values, flights, beyond_kg) - measured


def cell_of(flight: SteadyPower) -> tuple[int, int]:
    """Return the cell of the map that a steady flight belongs to: 1 m/s by 0.5 m/s."""
    return round(flight.airspeed_m_s), round(2.0 * flight.climb_rate_m_s)


def fit_steady_map(flights: Sequence[SteadyPower], *, mass_deviation_kg: float = 0.0) -> SteadyMap:
    """Fit momentum theory to steady flights.

    Parameters
    ----------
    flights : sequence of SteadyPower
        With mass and air density, in three cells of level flight at least.
    mass_deviation_kg : float
        Standard deviation of the mass from flight to flight, where the payload is not known: each
        flight then has a mass of its own, fitted beside the law. [kg]

    Returns
    -------
    SteadyMap
        The law, its errors, and what came from the priors.

    Raises
    ------
    IdentificationError
        If a mass or a density is not known, or there are too few airspeeds.
    """
    from scipy.optimize import least_squares

    if any(f.mass_kg is None or f.air_density_kg_m3 is None for f in flights):
        msg = "momentum theory needs the mass and the air density of every steady flight"
        raise IdentificationError(msg)
    cells = [cell_of(f) for f in flights]
    level = {speed for speed, climb in cells if climb == 0}
    if len(level) < _LEAST_CELLS:
        msg = (
            f"momentum theory needs level flight at {_LEAST_CELLS} airspeeds, hover counted, "
            f"the flights have {len(level)}"
        )
        raise IdentificationError(msg)
    powers = np.array([f.power_w for f in flights])
    errors = np.hypot([f.error_w for f in flights], _MODEL_SHARE * powers)
    counts = np.array([cells.count(cell) for cell in cells])
    scale = errors * np.sqrt(counts)
    mass_kg = float(np.mean([f.mass_kg or 0.0 for f in flights]))
    centre = np.log(
        [
            mass_kg * GRAVITY_M_S2 / _DISK_LOADING_N_M2,
            _DRAG_AREA_AT_1_KG_M2 * mass_kg ** (2.0 / 3.0),
            *_FACTORS,
        ]
    )
    spreads = np.array(_SPREADS)

    sources = sorted({f.source for f in flights}) if mass_deviation_kg > 0.0 else []
    flight_of = [sources.index(f.source) for f in flights] if sources else []

    def residuals(x: FloatArray) -> FloatArray:
        own, beyond = x[: len(NAMES)], x[len(NAMES) :]
        beyond_kg = mass_deviation_kg * beyond[flight_of] if sources else 0.0
        data = (_powers_w(np.exp(own), flights, beyond_kg) - powers) / scale
        return np.concatenate([data, (own - centre) / spreads, beyond])

    start = np.concatenate([centre, np.zeros(len(sources))])
    size = np.concatenate([spreads, np.ones(len(sources))])
    found = least_squares(residuals, start, jac="3-point", x_scale=size)
    if not found.success:
        msg = "the fit of momentum theory to the steady flights did not end"
        raise IdentificationError(msg)
    data = found.fun[: powers.size]
    surplus = len(set(cells)) - len(NAMES)
    scatter = max(1.0, float(data @ data) / surplus) if surplus > 0 else 1.0
    of_data = found.jac[: powers.size]
    information = of_data.T @ of_data / scatter + np.diag(size**-2.0)
    deviations = np.sqrt(np.diagonal(np.linalg.inv(information)))
    values = np.exp(found.x[: len(NAMES)])
    law = MomentumLaw(**{name: _rounded(v) for name, v in zip(NAMES, values, strict=True)})
    return SteadyMap(
        law=law,
        estimates=tuple(
            Estimate(name=name, value=getattr(law, name), error=_rounded(float(v * d)))
            for name, v, d in zip(NAMES, values, deviations[: len(NAMES)], strict=True)
        ),
        from_prior=tuple(
            name
            for name, d, spread in zip(NAMES, deviations[: len(NAMES)], spreads, strict=True)
            if d > 0.8 * spread
        ),
        rms_w=float(np.sqrt(np.average((data * scale) ** 2, weights=1.0 / counts))),
        cells=len(set(cells)),
        beyond_kg={
            source: mass_deviation_kg * float(x)
            for source, x in zip(sources, found.x[len(NAMES) :], strict=True)
        },
    )


def _powers_w(
    values: FloatArray, flights: Sequence[SteadyPower], beyond_kg: FloatArray | float = 0.0
) -> FloatArray:
    """Return the power of steady flights by the six numbers, (n,) [W]."""
    powers = np.empty(len(flights))
    masses = np.array([f.mass_kg or 0.0 for f in flights]) + beyond_kg
    speed = np.array([f.airspeed_m_s for f in flights])
    climb = np.array([f.climb_rate_m_s for f in flights])
    density = np.array([f.air_density_kg_m3 or 0.0 for f in flights])
    for mass_kg in np.unique(masses):
        own = masses == mass_kg
        powers[own] = momentum_power_w(
            speed[own],
            climb[own],
            mass_kg=float(mass_kg),
            air_density_kg_m3=density[own],
            **dict(zip(NAMES, values.tolist(), strict=True)),
        )
    return powers


def _rounded(value: float) -> float:
    """Six digits: far more than flights tell, and short enough for people to compare."""
    return float(f"{value:.6g}") if math.isfinite(value) else value
