r"""Laws of power fitted to mean powers: hover, cruise, and momentum theory for all steady flight.

The article's law of hover is :math:`P(H) = K H^z` (its equation 4), fitted to the mean power at each level.
The density form, :math:`P = P_0 (m/m_0)^a (\rho/\rho_0)^b`, takes the exponents of momentum theory, 3/2 and
-1/2, where the hovers do not differ enough in mass or density to show their own.
"""

from __future__ import annotations

import math
from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

import numpy as np

from planner.errors import IdentificationError
from planner.identify.lean import UNTOLD_WIND_M_S, winds_of
from planner.identify.uncertainty import Estimate, rounded
from planner.physics.rotor import Acceleration, Rotor, momentum_power_w
from planner.units import GRAVITY_M_S2
from planner.values import Value, field_values
from planner.vehicle.power import AltitudeLaw, DensityLaw, MomentumLaw

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.identify.segments import MeasuredPower


MASS_EXPONENT = 1.5
"""Of momentum theory, P = T^(3/2) / sqrt(2 ρ A). [-]"""
DENSITY_EXPONENT = -0.5
"""Of momentum theory. [-]"""
_LARGEST_EXPONENT_ERROR = 0.15
"""Standard error above which an exponent of the density form is taken from theory. [-]"""
_NO_MORE_THAN_SCATTER = 0.01
"""Fraction of the power: flights of one mission differ by ±0.6 %, so what an exponent no rotor has changes
by less between the hovers is no law. [-]"""
_LEAST_RELATIVE_ERROR = 1e-6
"""Of a mean power: keeps the weights finite where there is no noise. [-]"""
LOWEST_HEIGHT_M = 1.0
"""Height below which a law over height is held constant. [m]"""


Law = TypeVar("Law", AltitudeLaw, DensityLaw)


class HoverFit(Value, Generic[Law]):
    """A law of hover power fitted to hovers."""

    law: Law
    estimates: tuple[Estimate, ...]
    """The numbers of the law that were measured."""
    exponents_from_theory: tuple[str, ...] = ()
    """Names of the exponents the hovers do not show."""


def fit_altitude_law(hovers: Sequence[MeasuredPower]) -> HoverFit[AltitudeLaw]:
    """Fit P(H) = K H^z to hovers; equation 4 of the article.

    Weighted nonlinear least squares.  Where the levels scatter more than their own errors explain,
    the covariance grows with the scatter.

    Hovers below a metre are counted there.

    Raises IdentificationError if the hovers are at one height only, or the power changes faster
    than with the height.
    """
    from scipy.optimize import least_squares

    heights = np.maximum([h.height_above_home_m for h in hovers], LOWEST_HEIGHT_M)
    if not heights.size or np.ptp(np.log(heights)) < 0.01:
        msg = "hovers at two heights at least are needed for a law over height"
        raise IdentificationError(msg)
    powers, errors = _powers_and_errors(hovers)
    logs = np.log(heights)
    slope, intercept = np.polyfit(logs, np.log(powers), 1, w=powers / errors)

    # about the middle of the levels K and z hardly influence each other
    middle = float(np.average(logs, weights=(powers / errors) ** 2))

    def residuals(x: FloatArray) -> FloatArray:
        return np.asarray((x[0] * np.exp(x[1] * (logs - middle)) - powers) / errors)

    found = least_squares(residuals, [math.exp(intercept + slope * middle), slope], x_scale="jac")
    level, exponent = (float(x) for x in found.x)
    if not (level > 0.0 and abs(exponent) <= 1.0):
        msg = f"hover power over height follows no usable law: its exponent would be {exponent:.3g}"
        raise IdentificationError(msg)
    covariance = np.linalg.inv(found.jac.T @ found.jac)
    surplus = heights.size - 2
    if surplus > 0:
        covariance *= max(1.0, 2.0 * float(found.cost) / surplus)
    coefficient = level * math.exp(-exponent * middle)
    chain = np.array([[coefficient / level, -coefficient * middle], [0.0, 1.0]])
    errors = np.sqrt(np.diagonal(chain @ covariance @ chain.T)).tolist()
    numbers = {"coefficient_w": coefficient, "exponent": exponent}
    return HoverFit(
        law=AltitudeLaw(**numbers, lowest_height_m=LOWEST_HEIGHT_M),
        estimates=tuple(
            Estimate(name=name, value=value, error=error)
            for (name, value), error in zip(numbers.items(), errors, strict=True)
        ),
    )


def fit_density_law(hovers: Sequence[MeasuredPower]) -> HoverFit[DensityLaw]:
    """Fit the density form to hovers with known mass and air density.

    The law is at the mean mass and density of the hovers, with exponents measured where the hovers
    show them within 0.15, else of momentum theory; so is one of the density that no rotor has, where it
    changes the power by less than flights differ.

    Raises IdentificationError if there is no hover, mass or density is not known, or a measured
    exponent makes no sense.
    """
    if not hovers:
        msg = "there is no hover to fit a law to"
        raise IdentificationError(msg)
    powers, errors = _powers_and_errors(hovers)
    relative = errors / powers
    ratios, means = [], []
    for name in ("mass_kg", "air_density_kg_m3"):
        values = [getattr(h, name) for h in hovers]
        if None in values:
            msg = f"a hover law over mass and air density needs {name} of every hover"
            raise IdentificationError(msg)
        means.append(float(np.exp(np.average(np.log(values), weights=relative**-2.0))))
        ratios.append(np.log(np.array(values) / means[-1]))
    logs = np.log(powers)
    measured = _measured_exponents(ratios, relative)
    exponents, intercept, deviations = _fitted_exponents(measured, ratios, logs, relative)
    density = exponents[1]
    beyond = max(density, -2.0 - density, 0.0)
    if 1 in measured and beyond > 0.0 and beyond * np.ptp(ratios[1]) < _NO_MORE_THAN_SCATTER:
        measured = [i for i in measured if i != 1]
        exponents, intercept, deviations = _fitted_exponents(measured, ratios, logs, relative)
    power = float(np.exp(intercept))
    names = ("mass_exponent", "density_exponent")
    estimates = [
        Estimate(name="hover_power_w", value=power, error=power * float(deviations[0])),
        *(
            Estimate(name=names[i], value=exponents[i], error=float(deviation))
            for i, deviation in zip(measured, deviations[1:], strict=True)
        ),
    ]
    if not (0.0 <= exponents[0] <= 3.0 and -2.0 <= exponents[1] <= 0.0):
        msg = (
            f"hover power over mass and air density follows no usable law: exponents "
            f"{exponents[0]:.3g} and {exponents[1]:.3g}; look for wind or a wrong mass"
        )
        raise IdentificationError(msg)
    return HoverFit(
        law=DensityLaw(
            hover_power_w=power,
            reference_mass_kg=means[0],
            reference_density_kg_m3=means[1],
            mass_exponent=exponents[0],
            density_exponent=exponents[1],
        ),
        estimates=tuple(estimates),
        exponents_from_theory=tuple(names[i] for i in (0, 1) if i not in measured),
    )


def _fitted_exponents(
    measured: Sequence[int],
    ratios: Sequence[FloatArray],
    log_power: FloatArray,
    relative: FloatArray,
) -> tuple[list[float], float, FloatArray]:
    """Return both exponents, the logarithm of the power, and the errors of what is fitted."""
    exponents = [MASS_EXPONENT, DENSITY_EXPONENT]
    known = sum(
        (exponents[i] * ratios[i] for i in (0, 1) if i not in measured), np.zeros(relative.size)
    )
    design = np.stack([np.ones(relative.size), *(ratios[i] for i in measured)], axis=-1)
    weighted = design / relative[:, None]
    solution = np.linalg.lstsq(weighted, (log_power - known) / relative)[0]
    covariance = np.linalg.inv(weighted.T @ weighted)
    left = (log_power - known - design @ solution) / relative
    surplus = relative.size - design.shape[1]
    if surplus > 0:
        covariance *= max(1.0, float(left @ left) / surplus)
    for position, i in enumerate(measured, start=1):
        exponents[i] = float(solution[position])
    return exponents, float(solution[0]), np.sqrt(np.diagonal(covariance))


def _powers_and_errors(hovers: Sequence[MeasuredPower]) -> tuple[FloatArray, FloatArray]:
    powers = np.array([h.power_w for h in hovers])
    errors = np.array([h.error_w for h in hovers])
    if not np.all(powers > 0.0):
        msg = "hover power must be positive: a hover without power is no hover"
        raise IdentificationError(msg)
    return powers, np.maximum(errors, _LEAST_RELATIVE_ERROR * powers)


def _measured_exponents(ratios: Sequence[FloatArray], relative: FloatArray) -> list[int]:
    """Positions of the exponents that the hovers show well enough: both, one, or none."""
    for candidate in ([0, 1], [0], [1]):
        design = np.stack([np.ones(relative.size), *(ratios[i] for i in candidate)], axis=-1)
        if relative.size <= design.shape[1]:
            continue
        weighted = design / relative[:, None]
        normal = weighted.T @ weighted
        if np.linalg.cond(normal) > 1e12:
            continue
        if np.all(np.sqrt(np.diagonal(np.linalg.inv(normal))[1:]) < _LARGEST_EXPONENT_ERROR):
            return candidate
    return []


_SAME_SPEED_M_S = 0.5
"""Steady flights closer than this are one point of the table. [m/s]"""
_LEAST_ERROR_W = 1e-3
"""Keeps the weights finite where there is no noise. [W]"""


class CruiseCurve(Value):
    """Power above hover over airspeed, falling to one minimum and rising after it."""

    speed_m_s: tuple[float, ...]
    """Airspeeds, rising from 0. [m/s]"""
    power_above_hover_w: tuple[float, ...]
    """Power above hover, 0 at 0. [W]"""
    error_w: tuple[float, ...]
    """Standard error of each mean before smoothing. [W]"""
    smoothing_w: float
    """Most that a mean was moved by to give one minimum. [W]"""


def fit_cruise_curve(
    cruises: Sequence[MeasuredPower], hover_powers_w: Sequence[float]
) -> CruiseCurve:
    """Fit a table of cruise power with one minimum.

    Steady flights of nearly one speed are joined by their weighted mean; then the curve is made to
    fall to one minimum and to rise after it, by isotonic regression on both sides of the minimum that
    moves the means least.  Hover, at speed 0, is its first point.

    ``hover_powers_w`` are at the height, mass and density of each.

    Raises IdentificationError if there is no steady flight at a speed.
    """
    moving = [
        (c.airspeed_m_s, c.power_w - hover_w, max(c.error_w, _LEAST_ERROR_W))
        for c, hover_w in zip(cruises, hover_powers_w, strict=True)
        if c.airspeed_m_s > _SAME_SPEED_M_S
    ]
    if not moving:
        msg = "no steady level flight at a speed: cruise power unknown"
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


_DISK_LOADING_N_M2 = 70.0
"""Of multirotors from 30 to 160: centre of the prior of the disk area. [N m⁻²]"""
_DRAG_AREA_AT_1_KG_M2 = 0.015
"""Of a body of 1 kg, growing with the mass to the power 2/3: centre of its prior. [m²]"""
_FACTORS = (1.6, 1.4, 0.35, 0.2)
"""Centres of the priors of the factors: electrical over ideal watts. [-]"""
_SPREADS = (0.5, 0.8, 0.3, 0.3, 0.6, 1.0)
"""Standard deviations of the priors, of the logarithms. [-]"""
_MODEL_FRACTION = 0.01
"""To which momentum theory describes a multirotor. [-]"""
_FITTED = Rotor._fields[: len(_SPREADS)]
"""All but whether there is a vortex ring in descents: there is, or there is not."""
LEAST_AIRSPEEDS = 3
"""Of level flight, hover counted: fewer show nothing of the power over speed."""


class SteadyMap(Value, eq=False):
    """Momentum theory fitted to steady flight."""

    law: MomentumLaw
    estimates: tuple[Estimate, ...]
    """The six numbers with their errors."""
    from_prior: tuple[str, ...]
    """Those of which the flights show next to nothing."""
    cells: int
    """Number of different airspeeds and climb rates."""
    beyond_kg: Mapping[str, float]
    """Mass of each flight beyond the one given, by source, where it was fitted. [kg]"""
    behind_m_s: Mapping[str, float]
    """Wind behind each flight one way in a wind that nothing tells, by source. [m s⁻¹]"""
    log_covariance: FloatArray
    """Of the logarithms of the six numbers, in the order of `Rotor`. (6, 6) [-]"""

    def residuals_w(self, flights: Sequence[MeasuredPower]) -> FloatArray:
        """Return predicted less measured power of steady flights, (n,) [W]."""
        values = np.array(Rotor(**field_values(self.law)))
        measured: FloatArray = np.array([f.power_w for f in flights])
        beyond_kg = np.array([self.beyond_kg.get(f.source, 0.0) for f in flights])
        names, wind_of = winds_of(flights)
        behind_m_s = np.array([*(self.behind_m_s.get(one, 0.0) for one in names), 0.0])[wind_of]
        return _powers_w(values, _conditions(flights), beyond_kg, behind_m_s) - measured


def cell_of(flight: MeasuredPower) -> tuple[int, int]:
    """Return the cell of the map that a steady flight belongs to: 1 m/s by 0.5 m/s."""
    return round(flight.airspeed_m_s), round(2.0 * flight.climb_rate_m_s)


def fit_steady_map(
    flights: Sequence[MeasuredPower],
    *,
    mass_deviation_kg: float = 0.0,
    least: int = LEAST_AIRSPEEDS,
) -> SteadyMap:
    """Fit momentum theory to steady flights.

    Where the payload is not known, ``mass_deviation_kg`` is the standard deviation of the mass from
    flight to flight: each flight then has a mass of its own, fitted beside the law.  So have flights one
    way in a wind that nothing tells a wind along their way, of `UNTOLD_WIND_M_S`.

    Raises IdentificationError if a mass or a density is not known, or there are fewer airspeeds than
    the ``least``.
    """
    if any(f.mass_kg is None or f.air_density_kg_m3 is None for f in flights):
        msg = "momentum theory needs the mass and the air density of every steady flight"
        raise IdentificationError(msg)
    cells = [cell_of(f) for f in flights]
    level = {speed for speed, climb in cells if climb == 0}
    if len(level) < least:
        msg = (
            f"momentum theory needs level flight at {least} airspeeds, hover counted, "
            f"the flights have {len(level)}"
        )
        raise IdentificationError(msg)
    mass_kg = float(np.mean([f.mass_kg or 0.0 for f in flights]))
    centre = np.log(
        [
            mass_kg * GRAVITY_M_S2 / _DISK_LOADING_N_M2,
            _DRAG_AREA_AT_1_KG_M2 * mass_kg ** (2.0 / 3.0),
            *_FACTORS,
        ]
    )
    sources = sorted({f.source for f in flights}) if mass_deviation_kg > 0.0 else []
    blown, wind_of = winds_of(flights)
    further = len(sources) + len(blown)
    data = _MapData(
        flights=flights,
        cells=cells,
        centre=np.concatenate([centre, np.zeros(further)]),
        deviations=np.concatenate([_SPREADS, np.ones(further)]),
        flight_of=[sources.index(f.source) for f in flights] if sources else [],
        mass_deviation_kg=mass_deviation_kg,
        wind_of=wind_of,
    )
    start = data.centre.copy()
    start[len(start) - len(blown) :] = 0.5  # at no wind its magnitude has no slope
    first = data.fit(start, scatter=0.0)
    scatter = data.scatter_in_cells(first)
    with_ring = (0.0, 1.0) if any(climb < 0 for _, climb in cells) else (0.0,)
    found = min(
        (data.fit(first.x, scatter=scatter, ring=r) for r in with_ring), key=lambda f: f.cost
    )
    size_of_law = len(_FITTED)
    covariance = np.asarray(np.linalg.inv(found.information)[:size_of_law, :size_of_law])
    deviations = np.sqrt(np.diagonal(covariance)).tolist()
    values = np.exp(found.x[:size_of_law]).tolist()
    numbers = {name: rounded(v) for name, v in zip(_FITTED, values, strict=True)}
    if numbers["induced_factor"] + numbers["profile_factor"] < 1.0:
        msg = "the powers of the flights contradict each other: hovering would be better than ideal"
        raise IdentificationError(msg)
    law = MomentumLaw(**numbers, vortex_ring_factor=found.ring)
    return SteadyMap(
        law=law,
        estimates=tuple(
            Estimate(name=name, value=getattr(law, name), error=rounded(v * d))
            for name, v, d in zip(_FITTED, values, deviations, strict=True)
        ),
        from_prior=tuple(
            name
            for name, d, spread in zip(_FITTED, deviations, _SPREADS, strict=True)
            if d > 0.8 * spread
        ),
        cells=len(set(cells)),
        beyond_kg={
            source: mass_deviation_kg * float(x)
            for source, x in zip(
                sources, found.x[size_of_law : size_of_law + len(sources)], strict=True
            )
        },
        behind_m_s={
            source: UNTOLD_WIND_M_S * abs(float(x))
            for source, x in zip(blown, found.x[size_of_law + len(sources) :], strict=True)
        },
        log_covariance=covariance,
    )


class _MapFit(NamedTuple):
    x: FloatArray
    """Logarithms of the six numbers, then the masses beyond and the winds behind in their deviations."""
    ring: float
    cost: float
    information: FloatArray


class _MapData(Value, eq=False, dict=True):
    """Steady flights, and what is taken of the law before they are seen."""

    flights: Sequence[MeasuredPower]
    cells: Sequence[tuple[int, int]]
    centre: FloatArray
    deviations: FloatArray
    flight_of: Sequence[int]
    mass_deviation_kg: float
    wind_of: IntArray
    """As of `winds_of`."""

    @cached_property
    def powers_w(self) -> FloatArray:
        """Measured power. [W]"""
        return np.array([f.power_w for f in self.flights])

    @cached_property
    def conditions(self) -> _Conditions:
        """What they were flown in."""
        return _conditions(self.flights)

    def errors_w(self, x: FloatArray, ring: float) -> FloatArray:
        """Return predicted less measured power. [W]"""
        own, further = x[: len(_FITTED)], x[len(_FITTED) :]
        beyond_kg = self.mass_deviation_kg * further[self.flight_of] if self.flight_of else 0.0
        winds = int(self.wind_of.max()) + 1
        # as in a refinement: one against it would tell a drag below that of calm air
        shares = np.abs(np.append(further[len(further) - winds :], 0.0))
        behind_m_s = UNTOLD_WIND_M_S * shares[self.wind_of]
        values = np.append(np.exp(own), ring)
        return _powers_w(values, self.conditions, beyond_kg, behind_m_s) - self.powers_w

    def scatter_in_cells(self, fit: _MapFit) -> float:
        """Return by what the power of like spans differs, beside what the law explains. [-]

        Of flights of one vehicle a few percent in wind, next to nothing in simulations.
        """
        left = self.errors_w(fit.x, fit.ring) / self.powers_w
        of_cell: dict[tuple[int, int], list[float]] = {}
        for cell, error in zip(self.cells, left.tolist(), strict=True):
            of_cell.setdefault(cell, []).append(error)
        squares = sum(float(np.var(own)) * len(own) for own in of_cell.values())
        return math.sqrt(squares / max(len(left) - len(of_cell), 1))

    def fit(self, start: FloatArray, *, scatter: float, ring: float = 0.0) -> _MapFit:
        """Fit the law; what it errs by in a cell is one error, however often that was flown.

        What spans of a cell differ by is each span's own: many of them tell more than one.

        Raises IdentificationError if the fit does not end.
        """
        from scipy.optimize import least_squares

        powers = self.powers_w
        times = Counter(self.cells)
        counts = np.array([times[cell] for cell in self.cells])
        own = np.square([f.error_w for f in self.flights])
        of_law, of_span = np.square(_MODEL_FRACTION * powers) + own, np.square(scatter * powers)
        scale = np.sqrt(counts * of_law + of_span)

        def residuals(x: FloatArray) -> FloatArray:
            data = self.errors_w(x, ring) / scale
            return np.concatenate([data, (x - self.centre) / self.deviations])

        found = least_squares(residuals, start, jac="3-point", x_scale=self.deviations)
        if not found.success:
            msg = "the fit of momentum theory to the steady flights did not end"
            raise IdentificationError(msg)
        data, of_data = found.fun[: powers.size], found.jac[: powers.size]
        of_prior, told = np.diag(self.deviations**-2.0), of_data.T @ of_data
        # What the data fit of the numbers, which the prior holds too: one that it holds is not fitted.
        fitted = float(np.trace(np.linalg.solve(told + of_prior, told)))
        surplus = float(np.sum((of_law + of_span) / scale**2)) - fitted
        inflation = max(1.0, float(data @ data) / surplus) if surplus > 0.0 else 1.0
        information = told / inflation + of_prior
        return _MapFit(x=found.x, ring=ring, cost=float(found.cost), information=information)


class _Conditions(NamedTuple):
    """What flights or the seconds of manoeuvres were flown in, in the order of the flights."""

    of_parts: FloatArray
    """Mass, airspeed, climb rate, density, acceleration along, across and up. (7, m)"""
    first: IntArray
    """First part of each flight. (n,)"""
    counts: IntArray


def _conditions(flights: Sequence[MeasuredPower]) -> _Conditions:
    rows = [
        (one.mass_kg or 0.0, airspeed, climb, one.air_density_kg_m3 or 0.0, *changes)
        for one in flights
        for airspeed, climb, *changes in one.parts
        or [(one.airspeed_m_s, one.climb_rate_m_s, 0.0, 0.0, 0.0)]
    ]
    counts = np.array([max(len(one.parts), 1) for one in flights], dtype=np.intp)
    return _Conditions(
        of_parts=np.array(rows, dtype=np.float64).reshape(-1, 7).T,
        first=np.cumsum(counts) - counts,
        counts=counts,
    )


def mean_powers_w(rotor: Rotor, flights: Sequence[MeasuredPower]) -> FloatArray:
    """Return the mean power of flights by momentum theory, along what was flown of manoeuvres. (n,) [W]"""
    return _powers_w(np.array(rotor), _conditions(flights))


def _powers_w(
    values: FloatArray,
    conditions: _Conditions,
    beyond_kg: FloatArray | float = 0.0,
    behind_m_s: FloatArray | float = 0.0,
) -> FloatArray:
    """Return the mean power of flights by the numbers of a rotor, (n,) [W]."""
    masses, speed, climb, density, *changes = conditions.of_parts
    powers = np.empty(masses.size)
    beyond, behind = (
        np.repeat(np.broadcast_to(one, conditions.counts.shape), conditions.counts)
        for one in (beyond_kg, behind_m_s)
    )
    masses, speed = masses + beyond, np.maximum(speed - behind, 0.0)
    for mass_kg in np.unique(masses):
        own = masses == mass_kg
        powers[own] = momentum_power_w(
            speed[own],
            climb[own],
            Rotor(*values.tolist()),
            mass_kg=float(mass_kg),
            air_density_kg_m3=density[own],
            acceleration=Acceleration(*(change[own] for change in changes)),
        )
    return np.asarray(np.add.reduceat(powers, conditions.first) / conditions.counts)
