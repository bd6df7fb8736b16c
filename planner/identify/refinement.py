r"""A model from a data sheet, narrowed by what flights tell: a Bayesian update of its power.

What the model assumed is the prior: the logarithm of each of its factors is normal, with the standard
deviation in ``[spread.law_fraction]``.  Mean powers of steady flight are the evidence.  With the factors
:math:`e^{x}` and what a flight as a whole is off by, :math:`b`, the most likely are those that minimise

.. math:: \sum_i \left(\frac{\ln P_i - \ln \hat P_i(x) - b_{f(i)}}{\sigma_i}\right)^2
          + \sum_k \left(\frac{x_k}{s_k}\right)^2 + \sum_f \left(\frac{b_f}{\sigma_b}\right)^2,

and the inverse of the normal matrix there is their covariance.  What no flight shows keeps its prior,
and no evidence makes anything less certain.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import IdentificationError, UsageError
from planner.findings import Finding, Rule, Severity
from planner.identify.flown_mission import flown_parameters
from planner.identify.segments import record_air_density_kg_m3, steady_flight
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3
from planner.physics.rotor import Rotor, momentum_power_w
from planner.values import Value, field_values, replace
from planner.vehicle.data_sheet import STATE_FLIGHTS, STEADY_FLIGHTS, steady_power_w
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.identify.segments import MeasuredPower
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import VehicleModel

_COEFFICIENTS = {
    "hover": ("induced_factor", "profile_factor"),
    "profile_speed_factor": ("profile_speed_factor",),
    "axial_factor": ("axial_factor",),
    "drag_area_m2": ("drag_area_m2",),
}
"""Which coefficients of the law each factor multiplies."""
_THEORY = 0.03
"""How far momentum theory is from the mean power of one steady flight, relative: between 1 and 3 % in
the fits of the shipped models. [-]"""
_FLIGHT = 0.02
"""What a flight as a whole is off by: current calibration, air, propellers of the day. [-]"""
_SPEED_CELL_M_S, _CLIMB_CELL_M_S = 2.0, 1.0
"""Steady flights this much alike are one: theory is off by the same in all of them. [m/s]"""
_STEP = 1e-4
"""Of a logarithm, for a slope. [-]"""
_DISAGREES = 2.0
"""Standard deviations of its prior from which on a factor is worth a word: one in twenty by chance. [-]"""

PRIOR_DISAGREES = Rule(
    "I110 prior-disagrees",
    Severity.WARNING,
    summary="The flights tell something else than the data sheet of the vehicle.",
    why="The data sheet is of another vehicle, battery or load, or the current in the log is not calibrated: "
    "predictions rest on whichever is wrong.",
    how="A factor of the power that the flights put more than two standard deviations from where the model "
    "had it.",
    fix="compare mass, propellers and battery with the data sheet, the current in the log with a charger's",
)


class NarrowedFactor(Value):
    """A factor of the power before and after the flights."""

    name: str
    value: float
    """After, over before. [-]"""
    before: float
    """Standard deviation of its logarithm. [-]"""
    after: float


class Refinement(Value, eq=False):
    """A model narrowed by flights."""

    model: VehicleModel
    factors: tuple[NarrowedFactor, ...]
    flights: int
    steady: tuple[MeasuredPower, ...]
    """What the flights told."""
    findings: tuple[Finding, ...]


def refine_vehicle(
    vehicle: VehicleModel,
    records: Sequence[FlightRecord],
    *,
    payload_kg: Mapping[str, float] | None = None,
    temperature_c: float | None = None,
) -> Refinement:
    """Return a model narrowed by flights.

    Parameters
    ----------
    vehicle : VehicleModel
        By momentum theory, with the spread of its factors: made by ``vehicle new``, or refined before.
    records : sequence of FlightRecord
        Flights of this vehicle, of any kind.
    payload_kg : mapping, optional
        What each log's flights carried, by the source of the log; 0 where none is named. [kg]
    temperature_c : float, optional
        Air at home in the flights; default that of the standard atmosphere. [°C]

    Raises
    ------
    UsageError
        If the model has nothing that a flight could narrow.
    IdentificationError
        If no flight holds power in steady flight.
    """
    law, spread, mass_kg = vehicle.cruise, vehicle.spread, vehicle.mass_kg
    if not isinstance(law, MomentumLaw) or spread is None or not spread.law_fraction or not mass_kg:
        msg = (
            f"{vehicle.name} does not say how uncertain its power is: refine models of mavjoule vehicle new, "
            "identify others from logs"
        )
        raise UsageError(msg)
    if stranger := next((r for r in records if r.autopilot not in {None, vehicle.reference}), None):
        msg = f"{stranger.source} is of {stranger.autopilot}, {vehicle.name} of {vehicle.reference}"
        raise UsageError(msg)
    loads = payload_kg or {}
    steady = [
        one
        for record in records
        for one in steady_flight(
            record,
            air_density_kg_m3=record_air_density_kg_m3(record, home_temperature_c=temperature_c),
            mass_kg=mass_kg + loads.get(record.source, 0.0),
        )
    ]
    if not steady:
        msg = (
            "no flight holds power in steady flight: log battery voltage and current, and hover or fly "
            "straight for 5 s"
        )
        raise IdentificationError(msg)
    update = PowerUpdate(vehicle, steady)
    factors = update.factors
    count = len({one.source for one in steady})
    parameters, differing = flown_parameters(records, vehicle.reference)
    told = ", ".join(_told(one) for one in factors)
    provenance = vehicle.provenance
    model = replace(
        vehicle,
        cruise=MomentumLaw(
            **{
                name: float(f"{value:.4g}")
                for name, value in update.moved(update.narrowed)._asdict().items()
            }
        ),
        parameters=tuple((dict(vehicle.parameters) | dict(parameters)).items()),
        spread=replace(
            spread,
            energy_fraction=round(math.hypot(update.shared_fraction, _FLIGHT), 4),
            energy_state_fraction=tuple(
                (state, round(update.state_fractions[flight], 4))
                for state, flight in STATE_FLIGHTS.items()
            ),
            law_fraction=tuple((one.name, float(f"{one.after:.3g}")) for one in factors),
            n_flights=spread.n_flights + count,
            source=f"{quantity.count(count, 'flight')}, and what was assumed before them",
        ),
        provenance=replace(
            provenance,
            readings=(
                *provenance.readings,
                f"narrowed by {quantity.count(count, 'flight')}: {told}",
            ),
            logs=(*provenance.logs, *dict.fromkeys(record.source for record in records)),
            logs_sha256=(),
        ),
    )
    return Refinement(
        model=model,
        factors=factors,
        flights=count,
        steady=tuple(steady),
        findings=(*differing, *_disagreements(factors)),
    )


def _told(factor: NarrowedFactor) -> str:
    change = quantity.signed(factor.value - 1.0, quantity.percent)
    return (
        f"{factor.name} {change}, standard deviation {quantity.percent(factor.before)} before, "
        f"{quantity.percent(factor.after)} after"
    )


def _disagreements(factors: Sequence[NarrowedFactor]) -> list[Finding]:
    return [
        PRIOR_DISAGREES.finding(
            f"{one.name} is {quantity.signed(one.value - 1.0, quantity.percent)} from where the model had "
            f"it, {abs(math.log(one.value)) / one.before:.1f} of its standard deviations"
        )
        for one in factors
        if abs(math.log(one.value)) > _DISAGREES * one.before
    ]


class PowerUpdate:
    """What steady flights tell of the factors of a law by momentum theory, beside what was known."""

    def __init__(self, vehicle: VehicleModel, steady: Sequence[MeasuredPower]) -> None:
        law, spread = vehicle.cruise, vehicle.spread
        assert isinstance(law, MomentumLaw)
        assert spread is not None
        self.rotor = Rotor(**field_values(law))
        self.mass_kg = vehicle.mass_kg or 0.0
        self.avionics_w = 0.0 if vehicle.loads is None else vehicle.loads.avionics_w
        self.names = tuple(name for name, _ in spread.law_fraction)
        self.prior = np.array([fraction for _, fraction in spread.law_fraction])
        self.steady = steady
        self.cells, self.flights = _cells(steady)
        self.measured = np.log([one.power_w for one in steady])
        errors = np.array([one.error_w / one.power_w for one in steady])
        self.counts = np.bincount(self.cells)
        noise = np.bincount(self.cells, errors**2) / self.counts**2
        self.sigma = np.sqrt(noise + _THEORY**2)
        _, first = np.unique(self.cells, return_index=True)
        self.flight_of = self.flights[first]
        self.narrowed, self.covariance = self._most_likely()

    def moved(self, factors: FloatArray) -> Rotor:
        """Return the rotor with its factors multiplied."""
        changes = {
            coefficient: getattr(self.rotor, coefficient) * math.exp(one)
            for name, one in zip(self.names, factors.tolist(), strict=False)
            for coefficient in _COEFFICIENTS[name]
        }
        return self.rotor._replace(**changes)

    def _log_powers(self, factors: FloatArray) -> FloatArray:
        rotor, powers = self.moved(factors), np.empty(len(self.steady))
        for row, one in enumerate(self.steady):
            powers[row] = momentum_power_w(
                one.airspeed_m_s,
                one.climb_rate_m_s,
                rotor,
                mass_kg=one.mass_kg or 0.0,
                air_density_kg_m3=one.air_density_kg_m3 or SEA_LEVEL_DENSITY_KG_M3,
            )
        return np.log(powers + self.avionics_w)

    def _residuals(self, unknown: FloatArray) -> FloatArray:
        factors, of_flights = unknown[: len(self.names)], unknown[len(self.names) :]
        off = self.measured - self._log_powers(factors)
        of_cells = np.bincount(self.cells, off) / self.counts - of_flights[self.flight_of]
        return np.concatenate((of_cells / self.sigma, factors / self.prior, of_flights / _FLIGHT))

    def _most_likely(self) -> tuple[FloatArray, FloatArray]:
        """Return the most likely logarithms of the factors and their covariance."""
        from scipy.optimize import least_squares

        count = len(self.names)
        start = np.zeros(count + int(self.flights.max()) + 1)
        found = least_squares(self._residuals, start, method="lm")
        covariance = np.linalg.inv(found.jac.T @ found.jac)
        return np.asarray(found.x[:count]), np.asarray(covariance[:count, :count])

    @property
    def factors(self) -> tuple[NarrowedFactor, ...]:
        """The factors before and after."""
        after = np.sqrt(np.diag(self.covariance))
        columns = zip(
            self.names,
            np.exp(self.narrowed).tolist(),
            self.prior.tolist(),
            after.tolist(),
            strict=True,
        )
        return tuple(
            NarrowedFactor(name=name, value=value, before=before, after=narrowed)
            for name, value, before, narrowed in columns
        )

    @property
    def shared_fraction(self) -> float:
        """How uncertain the power of hover is. [-]"""
        [hover] = self._gradient()[list(STEADY_FLIGHTS).index("hover"), np.newaxis]
        return float(np.sqrt(hover @ self.covariance @ hover))

    @property
    def state_fractions(self) -> dict[str, float]:
        """How uncertain the power of each steady flight is besides. [-]"""
        gradient = self._gradient()
        beside = gradient - gradient[list(STEADY_FLIGHTS).index("hover")]
        variances = np.einsum("ij,jk,ik->i", beside, self.covariance, beside)
        return dict(zip(STEADY_FLIGHTS, np.sqrt(variances).tolist(), strict=True))

    def _gradient(self) -> FloatArray:
        """Return how the logarithm of each steady flight's power follows each factor's."""

        def log_powers(factors: FloatArray) -> FloatArray:
            powers = steady_power_w(
                self.moved(factors), mass_kg=self.mass_kg, avionics_w=self.avionics_w
            )
            return np.log(powers)

        columns = [
            log_powers(self.narrowed + _STEP * one) - log_powers(self.narrowed - _STEP * one)
            for one in np.eye(len(self.names))
        ]
        return np.stack(columns, axis=-1) / (2.0 * _STEP)


def _cells(steady: Sequence[MeasuredPower]) -> tuple[IntArray, IntArray]:
    """Return for each steady flight the number of its cell and of its flight."""
    keys = [
        (
            one.source,
            round(one.airspeed_m_s / _SPEED_CELL_M_S),
            round(one.climb_rate_m_s / _CLIMB_CELL_M_S),
        )
        for one in steady
    ]
    cells = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    flights = {name: number for number, name in enumerate(dict.fromkeys(key[0] for key in keys))}
    return np.array([cells[key] for key in keys]), np.array([flights[key[0]] for key in keys])
