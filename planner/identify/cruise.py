"""Cruise power over airspeed: a table of steady flights, or momentum theory fitted to them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.frozen import frozen
from planner.identify.estimate import Estimate
from planner.physics.rotor import momentum_power_w

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.identify.steady import SteadyPower

    FloatArray = npt.NDArray[np.float64]

_SAME_SPEED_M_S = 0.5
"""Steady flights closer than this are one point of the table. [m/s]"""
_LEAST_ERROR_W = 1e-3
"""Keeps the weights finite where there is no noise. [W]"""


@frozen
class CruiseCurve:
    """Power above hover over airspeed, falling to one minimum and rising after it."""

    speed_m_s: tuple[float, ...]
    """Airspeeds, rising from 0. [m/s]"""
    power_above_hover_w: tuple[float, ...]
    """Power above hover, 0 at 0. [W]"""
    error_w: tuple[float, ...]
    """Standard error of each mean before smoothing. [W]"""
    smoothing_w: float
    """Most that a mean was moved by to give one minimum. [W]"""


@frozen(eq=False)
class MomentumFit:
    """Parameters of `planner.physics.rotor.momentum_power_w` fitted to steady flights."""

    disk_area_m2: float
    """As given. [m²]"""
    drag_area_m2: float
    """Drag coefficient times frontal area. [m²]"""
    loss_factor: float
    """Electrical over ideal power of induction, climb and drag alike. [-]"""
    profile_factor: float
    """Profile power over ideal power in hover. [-]"""
    profile_speed_factor: float
    """As given. [-]"""
    covariance: FloatArray
    """Of drag area, loss factor and profile factor. (3, 3)"""
    rms_w: float
    """Root mean square of what the steady flights differ from the law by. [W]"""

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """The three fitted numbers with their errors."""
        errors = np.sqrt(np.diagonal(self.covariance))
        names = ("drag_area_m2", "loss_factor", "profile_factor")
        return tuple(
            Estimate(name=name, value=getattr(self, name), error=float(error))
            for name, error in zip(names, errors, strict=True)
        )

    def power_w(
        self,
        airspeed_m_s: npt.ArrayLike,
        *,
        mass_kg: float,
        air_density_kg_m3: npt.ArrayLike,
    ) -> FloatArray:
        """Return the power in level flight. [W]"""
        return _momentum_w(
            np.array([self.drag_area_m2, self.loss_factor, self.profile_factor]),
            airspeed_m_s,
            mass_kg=mass_kg,
            air_density_kg_m3=air_density_kg_m3,
            disk_area_m2=self.disk_area_m2,
            profile_speed_factor=self.profile_speed_factor,
        )


def fit_cruise_curve(
    cruises: Sequence[SteadyPower], hover_powers_w: Sequence[float]
) -> CruiseCurve:
    """Fit a table of cruise power with one minimum.

    Steady flights of nearly one speed are joined by their weighted mean; then the curve is made to
    fall to one minimum and to rise after it, by isotonic regression on both sides of the minimum that
    moves the means least.  Hover, at speed 0, is its first point.

    Parameters
    ----------
    cruises : sequence of SteadyPower
        Steady level flights at one speed or more.
    hover_powers_w : sequence of float
        Hover power at the height, mass and density of each. [W]

    Returns
    -------
    CruiseCurve
        The table.

    Raises
    ------
    IdentificationError
        If there is no steady flight at a speed.
    """
    moving = [
        (c.airspeed_m_s, c.power_w - hover_w, max(c.error_w, _LEAST_ERROR_W))
        for c, hover_w in zip(cruises, hover_powers_w, strict=True)
        if c.airspeed_m_s > _SAME_SPEED_M_S
    ]
    if not moving:
        msg = "no steady level flight at a speed: cruise power cannot be told"
        raise IdentificationError(msg)
    points = [_joined(group) for group in _grouped(sorted(moving))]
    speeds, powers, errors = (np.array(column) for column in zip(*points, strict=True))
    smooth = _with_one_minimum(powers, errors)
    return CruiseCurve(
        speed_m_s=(0.0, *speeds.tolist()),
        power_above_hover_w=(0.0, *smooth.tolist()),
        error_w=(0.0, *errors.tolist()),
        smoothing_w=float(np.abs(smooth - powers).max()),
    )


def fit_momentum_law(
    flights: Sequence[SteadyPower], *, disk_area_m2: float, profile_speed_factor: float = 0.0
) -> MomentumFit:
    """Fit momentum theory to steady level flights, hovers among them.

    Parameters
    ----------
    flights : sequence of SteadyPower
        At three speeds at least, hover counted, each with mass and air density.
    disk_area_m2 : float
        Area of all rotor disks. [m²]
    profile_speed_factor : float
        Growth of profile power with speed; flights seldom tell it from drag. [-]

    Returns
    -------
    MomentumFit
        Drag area, loss factor and profile factor with their covariance.

    Raises
    ------
    IdentificationError
        If mass or density is not known, or the flights do not determine the parameters.
    """
    from scipy.optimize import least_squares

    if any(f.mass_kg is None or f.air_density_kg_m3 is None for f in flights):
        msg = "momentum theory needs mass and air density of every steady flight"
        raise IdentificationError(msg)
    if len(list(_grouped(sorted((f.airspeed_m_s, 0.0, 1.0) for f in flights)))) < 3:
        msg = "momentum theory needs steady flights at three speeds at least, hover counted"
        raise IdentificationError(msg)
    powers = np.array([f.power_w for f in flights])
    errors = np.maximum([f.error_w for f in flights], _LEAST_ERROR_W)

    def residuals(x: FloatArray) -> FloatArray:
        predicted = [
            float(
                _momentum_w(
                    x,
                    f.airspeed_m_s,
                    mass_kg=f.mass_kg or 0.0,
                    air_density_kg_m3=f.air_density_kg_m3 or 0.0,
                    disk_area_m2=disk_area_m2,
                    profile_speed_factor=profile_speed_factor,
                )
            )
            for f in flights
        ]
        return np.asarray((np.array(predicted) - powers) / errors)

    found = least_squares(
        residuals,
        [0.02, 1.0, 0.3],
        bounds=([0.0, 0.1, 0.0], [2.0, 10.0, 10.0]),
        x_scale="jac",
        jac="3-point",
    )
    scale = np.linalg.norm(found.jac, axis=0)
    if not np.all(scale > 0.0) or np.linalg.cond(found.jac / scale) > 1e5:
        msg = "the steady flights do not tell drag, losses and profile power apart: fly more speeds"
        raise IdentificationError(msg)
    covariance = np.linalg.inv(found.jac.T @ found.jac)
    surplus = powers.size - 3
    if surplus > 0:
        covariance *= max(1.0, 2.0 * float(found.cost) / surplus)
    return MomentumFit(
        disk_area_m2=disk_area_m2,
        drag_area_m2=float(found.x[0]),
        loss_factor=float(found.x[1]),
        profile_factor=float(found.x[2]),
        profile_speed_factor=profile_speed_factor,
        covariance=covariance,
        rms_w=float(np.sqrt(np.mean((found.fun * errors) ** 2))),
    )


def _momentum_w(
    parameters: FloatArray,
    airspeed_m_s: npt.ArrayLike,
    *,
    mass_kg: float,
    air_density_kg_m3: npt.ArrayLike,
    disk_area_m2: float,
    profile_speed_factor: float,
) -> FloatArray:
    return momentum_power_w(
        airspeed_m_s,
        0.0,
        mass_kg=mass_kg,
        air_density_kg_m3=air_density_kg_m3,
        disk_area_m2=disk_area_m2,
        drag_area_m2=float(parameters[0]),
        induced_factor=float(parameters[1]),
        axial_factor=float(parameters[1]),
        profile_factor=float(parameters[2]),
        profile_speed_factor=profile_speed_factor,
    )


Point = tuple[float, float, float]


def _grouped(points: Sequence[Point]) -> list[list[Point]]:
    """Neighbours in speed together, none farther from the first of its group than the limit."""
    groups: list[list[Point]] = []
    for point in points:
        if groups and point[0] - groups[-1][0][0] < _SAME_SPEED_M_S:
            groups[-1].append(point)
        else:
            groups.append([point])
    return groups


def _joined(group: Sequence[Point]) -> Point:
    """Weighted mean of speed and power, and its error; by the scatter where that is larger."""
    speeds, powers, errors = (np.array(column) for column in zip(*group, strict=True))
    weights = errors**-2.0
    mean = float(np.average(powers, weights=weights))
    error = float(weights.sum() ** -0.5)
    if len(group) > 1:
        scatter = float(np.average((powers - mean) ** 2, weights=weights)) / (len(group) - 1)
        error = max(error, scatter**0.5)
    return float(np.average(speeds, weights=weights)), mean, error


def _with_one_minimum(powers: FloatArray, errors: FloatArray) -> FloatArray:
    """Nearest curve that falls and then rises."""
    from scipy.optimize import isotonic_regression

    weights = errors**-2.0
    best, least = powers, np.inf
    for split in range(powers.size + 1):
        parts = [
            np.asarray(isotonic_regression(powers[part], weights=weights[part], increasing=rises).x)
            for part, rises in ((slice(split), False), (slice(split, None), True))
            if powers[part].size
        ]
        curve = np.concatenate(parts)
        cost = float(weights @ (curve - powers) ** 2)
        if cost < least:
            best, least = curve, cost
    return best
