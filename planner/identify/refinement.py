r"""A model from a data sheet, narrowed by what flights tell: a Bayesian update of its power.

What the model assumed is the prior: the logarithm of each of its factors is normal, with the standard
deviation in ``[spread.law_fraction]``.  Mean powers of steady flight are the evidence.  With the factors
:math:`e^{x}`, what a flight as a whole is off by, :math:`b`, and the wind that a flight may have had behind
it, :math:`w`, the most likely are those that minimise

.. math:: \sum_i \left(\frac{\ln P_i - \ln \hat P_i(x, w_{f(i)}) - b_{f(i)}}{\sigma_i}\right)^2
          + \sum_k \left(\frac{x_k}{s_k}\right)^2 + \sum_f \left(\frac{b_f}{\sigma_b}\right)^2
          + \sum_f \left(\frac{w_f}{\sigma_w}\right)^2,

and the inverse of the normal matrix there is their covariance.  Only flights that head one way in a wind that
nothing tells have a :math:`w`, of 0 or more: of those to and fro, what it takes from one leg it adds to
another.  What no flight shows keeps its prior, and no evidence makes anything less certain.

What flights of one vehicle differ by, :math:`\sigma_b`, is known from many vehicles as from one flight, and
from each of its own flights besides: one flight narrows the vehicle, not how far its next one is from it.
Where the minimum, of n cells of steady flight, is above n, sheet, theory and flights contradict each other
by more than they are said to be off; then all are taken to be off by :math:`\sqrt{\min / n}` times that
(R. T. Birge, Phys. Rev. 40 (1932) 207).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import IdentificationError, UsageError
from planner.findings import Finding, Rule, Severity
from planner.identify.battery import PackSettings, capacity_set_ah, identify_battery
from planner.identify.flown_mission import flown_parameters, loads_let_go
from planner.identify.lean import (
    UNTOLD_WIND_M_S,
    identified_lean,
    is_one_way_in_unknown_wind,
    one_way_findings,
    winds_of,
)
from planner.identify.leant_wind import leant_wind_readings, with_leant_wind
from planner.identify.log_table import LogTable
from planner.identify.segments import (
    mean_air_density_kg_m3,
    record_air_density_kg_m3,
    steady_flight,
)
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3
from planner.physics.rotor import Rotor, momentum_power_w
from planner.values import Value, brief, field_values, replace
from planner.vehicle.declared import Interval
from planner.vehicle.law_factors import (
    THEORY_FRACTION,
    EnergyFractions,
    LawSpread,
    energy_fractions,
    is_narrowable,
    moved_rotor,
)
from planner.vehicle.model import LAW_FACTORS, Basis
from planner.vehicle.parameters.resolve import kept_parameters
from planner.vehicle.power import MomentumLaw
from planner.vehicle.repeatability import DAY_FRACTION

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.identify.lean import LeanFlight
    from planner.identify.log_table import LogConditions
    from planner.identify.segments import MeasuredPower
    from planner.identify.uncertainty import Estimate
    from planner.logs.record import FlightRecord
    from planner.vehicle.battery import Battery
    from planner.vehicle.model import ModelSpread, Provenance, ValidFor, VehicleModel

_PACK = 0.2
"""How far the resistance that a flight shows is from that of the next one's battery, relative: 44 % more
at 5 °C than at 20 °C (models/chemistries/lipo.toml), and packs of one kind differ. [-]"""
_RESISTANCE = "internal_resistance_ohm"
_SPEED_CELL_M_S, _CLIMB_CELL_M_S = 2.0, 1.0
"""Steady flights this much alike are one: theory is off by the same in all of them. [m/s]"""
_ROUNDS = 5
"""After which the scatter of flights changes by less than a hundredth."""
_DISAGREES = 2.0
"""Standard deviations of its prior from which on a factor is worth a word: one in twenty by chance. [-]"""
_LEAST_CHARGE = 0.1
"""With less nobody begins a flight. [-]"""
_HIGHEST_FULL = 1.08
"""Highest voltage of a flight over that of the full battery: cells of 4.35 V have 1.06 times the
4.10 V of the curve assumed, and voltages are read within 2 %. [-]"""
_OTHER_VEHICLE = 5.0
"""From which on no chance explains it: one in a million. [-]"""
_SHOWN = 0.8
"""Of the standard deviation before, up to which a factor is one that flights show. [-]"""

_SHOWN_RATIO = 1.05
"""Birge ratio from which on it is worth a word. [-]"""

PRIOR_DISAGREES = Rule(
    "I110 prior-disagrees",
    Severity.WARNING,
    summary="The flights tell something else than the data sheet of the vehicle.",
    why="The data sheet is of another vehicle, battery or load, or the current in the log is not calibrated: "
    "predictions rest on whichever is wrong.",
    how="A factor of the power that the flights put more than two standard deviations from where the model "
    "had it.  What contradicts itself is spread wider: all deviations by the Birge ratio.",
    fix="compare mass, propellers and battery with the data sheet, the current in the log with a charger's",
)


LOG_COUNTED = Rule(
    "I111 log-counted",
    Severity.INFO,
    summary="A log has narrowed the model before: it is not counted again.",
    why="The same flight twice tells nothing new; counted twice it would make the model look more certain "
    "than it is.",
    how="The SHA-256 of each log is compared with those in the model's [provenance].",
    fix="none needed; give the logs of new flights",
)


class NarrowedFactor(Value):
    """A factor of the power before and after the flights."""

    name: str
    value: float
    """After, over before. [-]"""
    before: float
    """Standard deviation of its logarithm. [-]"""
    after: float

    @property
    def label(self) -> str:
        """What it is, in words."""
        return LAW_FACTORS[self.name]

    @property
    def is_shown(self) -> bool:
        """Whether the flights show it: they narrow it by a fifth at least."""
        return self.after <= _SHOWN * self.before


class NarrowedPower(Value, eq=False):
    """The power of a model narrowed by flights."""

    law: MomentumLaw
    spread: ModelSpread
    battery: Battery | None
    """The model's, with the resistance that the flights show."""
    factors: tuple[NarrowedFactor, ...]
    steady: tuple[MeasuredPower, ...]
    """What the flights told."""
    residuals_w: FloatArray
    """Power of each by the law, less what was measured. [W]"""
    birge_ratio: float
    """By how much more sheet, theory and flights are apart than each is said to be off, at least 1. [-]"""
    findings: tuple[Finding, ...]

    @property
    def flights(self) -> int:
        """Number of flights that told something."""
        return len({one.source for one in self.steady})

    @property
    def text(self) -> str:
        """What became of each factor."""
        return ", ".join(map(_told, self.factors))


class Refinement(Value, eq=False):
    """A model narrowed by flights."""

    __repr__ = brief

    model: VehicleModel
    power: NarrowedPower
    findings: tuple[Finding, ...]


def refine_vehicle(
    vehicle: VehicleModel, records: Sequence[FlightRecord], *, logs: LogTable | None = None
) -> Refinement:
    """Return a model narrowed by flights.

    Parameters
    ----------
    vehicle : VehicleModel
        By momentum theory, with the spread of its factors: made by ``vehicle new``, or refined before.
    records : sequence of FlightRecord
        Flights of this vehicle, of any kind; what narrowed the model before is not counted again.
    logs : LogTable, optional
        Mass, payload and temperature of the flights; default those of the model, none, and the standard
        atmosphere's.

    Raises
    ------
    UsageError
        If the model has nothing that a flight could narrow, or the flights have all narrowed it before.
    IdentificationError
        If no flight holds power in steady flight, or its mass cannot be carried by that.
    """
    if not is_narrowable(vehicle):
        msg = (
            f"{vehicle.name} does not say how uncertain its power is: refine models by momentum theory, of "
            "mavjoule vehicle new or identify"
        )
        raise UsageError(msg)
    if stranger := next((r for r in records if r.autopilot not in {None, vehicle.reference}), None):
        msg = f"{stranger.source} is of {stranger.autopilot}, {vehicle.name} of {vehicle.reference}"
        raise UsageError(msg)
    for record in records:
        refuse_other_cells(record, vehicle)
    records = [with_leant_wind(record) for record in records]
    known = LogTable() if logs is None else logs
    conditions = [known.of(record.source) for record in records]
    steady: list[MeasuredPower] = []
    times_heavier: list[float] = []
    air_kg_m3: list[float] = []
    for record, own in zip(records, conditions, strict=True):
        density = record_air_density_kg_m3(record, home_temperature_c=own.temperature_c)
        mass_kg = (own.mass_kg or vehicle.mass_kg or 0.0) + (own.payload_kg or 0.0)
        times_heavier.append(mass_kg / vehicle.mass_kg if vehicle.mass_kg else 1.0)
        air_kg_m3.append(mean_air_density_kg_m3(density))
        steady += steady_flight(
            record,
            air_density_kg_m3=density,
            mass_kg=mass_kg,
            is_one_way=is_one_way_in_unknown_wind(record),
        )
    if not steady:
        msg = (
            "no flight holds power in steady flight: log battery voltage and current, and hover or fly "
            "straight for 5 s"
        )
        raise IdentificationError(msg)
    power = narrowed_power(vehicle, records, conditions, steady)
    parameters = vehicle.parameters
    differing: tuple[Finding, ...] = ()
    if vehicle.reference is not Autopilot.STEP:
        flown, differing = flown_parameters(records, vehicle.reference, times_heavier)
        parameters = kept_parameters(vehicle.reference, dict(vehicle.parameters), dict(flown))
    lean = identified_lean(records, vehicle, times_heavier=times_heavier, air_kg_m3=air_kg_m3)
    model = replace(
        vehicle,
        airspeed_limit_m_s=lean.airspeed_limit_m_s,
        airspeed_limit_lean_deg=lean.limit_lean_deg,
        airspeed_limit_air_density_kg_m3=lean.limit_air_kg_m3,
        airspeed_limit_fraction=lean.limit_fraction,
        drag_exponent=lean.drag_exponent,
        cruise=power.law,
        battery=power.battery,
        parameters=parameters,
        valid_for=shown_box(vehicle.valid_for, power.steady, lean),
        spread=power.spread,
        provenance=narrowed_provenance(vehicle.provenance, records, power),
    )
    let_go = [
        finding
        for record, own in zip(records, conditions, strict=True)
        for finding in loads_let_go(record, own.payload_kg)
    ]
    return Refinement(
        model=model,
        power=power,
        findings=(*differing, *let_go, *one_way_findings(records), *power.findings),
    )


def narrowed_power(
    vehicle: VehicleModel,
    records: Sequence[FlightRecord],
    conditions: Sequence[LogConditions],
    steady: Sequence[MeasuredPower],
) -> NarrowedPower:
    """Return the power of a model that `is_narrowable`, narrowed by the steady flight of some records.

    With it the resistance of its battery.

    Raises UsageError if all of it has narrowed the model before.
    Raises IdentificationError for a mass that nothing lifts on the power of the hovers.
    """
    counted = {
        f"{one.source}#{one.number}"
        for one in records
        if one.sha256 in vehicle.provenance.logs_sha256
    }
    fresh = [one for one in steady if one.source not in counted]
    again = ", ".join(
        dict.fromkeys(one.source.rpartition("#")[0] for one in steady if one.source in counted)
    )
    if not fresh:
        msg = f"{vehicle.name} was narrowed by {again} before: give other logs"
        raise UsageError(msg)
    refuse_impossible_mass(fresh)
    update = PowerUpdate(vehicle, fresh)
    rotor, factors, battery = update.moved(update.narrowed), update.factors, vehicle.battery
    energy = update.energy
    resistance = _narrowed_resistance(
        vehicle,
        [
            (record, own)
            for record, own in zip(records, conditions, strict=True)
            if f"{record.source}#{record.number}" not in counted
        ],
    )
    if battery is not None and resistance is not None:
        factors = (*factors, resistance)
        ohm = resistance.value * (battery.internal_resistance_ohm or 0.0)
        battery = replace(battery, internal_resistance_ohm=float(f"{ohm:.3g}"))
    _refuse_better_than_ideal(rotor, vehicle)
    _refuse_other_vehicle(factors, vehicle)
    rounded = {name: float(f"{value:.4g}") for name, value in rotor._asdict().items()}
    spread, narrowed = vehicle.spread, [(one.name, one.after) for one in factors]
    assert spread is not None
    of_states = dict(spread.energy_state_fraction)
    flights = quantity.count(len({one.source for one in fresh}), "flight")
    findings = _disagreements(factors, update.birge_ratio)
    if again:
        message = f"{again}: {vehicle.name} was narrowed by it before; not counted again"
        findings.append(LOG_COUNTED.finding(message))
    return NarrowedPower(
        law=MomentumLaw(**rounded),
        spread=replace(
            spread,
            energy_fraction=min(
                round(math.hypot(energy.shared, update.birge_ratio * update.day_fraction), 4),
                spread.energy_fraction or math.inf,
            ),
            energy_state_fraction=tuple(
                (state, min(fraction, of_states[state]))
                for state, fraction in energy.of_states(update.birge_ratio * THEORY_FRACTION)
                if state in of_states
            ),
            law_fraction=tuple(
                (
                    dict(spread.law_fraction) | {n: float(f"{after:.3g}") for n, after in narrowed}
                ).items()
            ),
            law_correlation=update.law.law_correlation,
            n_flights=spread.n_flights + len({one.source for one in fresh}),
            source=f"{flights}, and what was assumed before them",
        ),
        battery=battery,
        factors=factors,
        steady=tuple(fresh),
        residuals_w=update.residuals_w,
        birge_ratio=update.birge_ratio,
        findings=tuple(findings),
    )


def _narrowed_resistance(
    vehicle: VehicleModel, flown: Sequence[tuple[FlightRecord, LogConditions]]
) -> NarrowedFactor | None:
    """Return what the sag of the voltage tells of the battery's resistance; ``None``: nothing.

    Prior and measurement are normal in the logarithm, so that their mean is by the inverse variances.  Flown
    on a battery of another capacity, it is that of as many more or fewer of its cells beside each other.
    """
    battery, spread = vehicle.battery, vehicle.spread
    before = 0.0 if spread is None else dict(spread.law_fraction).get(_RESISTANCE, 0.0)
    if battery is None or not battery.internal_resistance_ohm or not before:
        return None
    own_ah = battery.new_charge_ah
    of_capacity: dict[float | None, list[tuple[FlightRecord, LogConditions]]] = {}
    for record, own in flown:
        of_capacity.setdefault(capacity_set_ah(record) or own_ah, []).append((record, own))
    shown: list[Estimate] = []
    for flown_ah, alike in of_capacity.items():
        pack = PackSettings(
            capacity_ah=flown_ah,
            cells_in_series=battery.cells_in_series,
            chemistry=battery.chemistry,
        )
        outcome = identify_battery(
            [one for one, _ in alike], pack, [own for _, own in alike]
        ).outcome
        larger = flown_ah / own_ah if flown_ah and own_ah else 1.0
        shown += [
            replace(one, value=one.value * larger, error=one.error * larger)
            for one in outcome.estimates
            if one.name == _RESISTANCE and one.error < one.value
        ]
    if not shown:
        return None
    best = min(shown, key=lambda one: one.error / one.value)
    variance = (best.error / best.value) ** 2 + _PACK**2
    weight = before**2 / (before**2 + variance)
    return NarrowedFactor(
        name=_RESISTANCE,
        value=(best.value / battery.internal_resistance_ohm) ** weight,
        before=before,
        after=before * math.sqrt(1.0 - weight),
    )


def refuse_other_cells(record: FlightRecord, vehicle: VehicleModel) -> None:
    """Raise ``IdentificationError`` where the battery of a flight cannot be that of the model."""
    battery, measured_v = vehicle.battery, record.voltage_v[np.isfinite(record.voltage_v)]
    if battery is None or battery.ocv_v is None or battery.ocv_soc is None or not measured_v.size:
        return
    highest_v, full_v = float(measured_v.max()), battery.ocv_v[-1]
    least_v = float(np.interp(_LEAST_CHARGE, battery.ocv_soc, battery.ocv_v))
    if not least_v <= highest_v <= _HIGHEST_FULL * full_v:
        msg = (
            f"{record.source} has {quantity.voltage(highest_v)} at most, the battery of {vehicle.name} "
            f"{quantity.voltage(least_v)} at {quantity.percent(_LEAST_CHARGE)} and "
            f"{quantity.voltage(full_v)} full: the flight is of another vehicle, or its battery of "
            "other cells"
        )
        raise IdentificationError(msg)


def _refuse_other_vehicle(factors: Sequence[NarrowedFactor], vehicle: VehicleModel) -> None:
    """Raise IdentificationError where flights hover on what the vehicle of the model cannot."""
    for one in factors:
        deviations = abs(math.log(one.value)) / one.before
        if one.name == "hover" and deviations > _OTHER_VEHICLE:
            msg = (
                f"the flights hover on {quantity.percent(one.value)} of the power that {vehicle.name} has, "
                f"{deviations:.1f} of its standard deviations away: they are of another vehicle, or its data "
                "sheet, the current in the logs or the mass that flew is wrong"
            )
            raise IdentificationError(msg)


def _refuse_better_than_ideal(rotor: Rotor, vehicle: VehicleModel) -> None:
    """Raise IdentificationError where flights say of a rotor what none can do."""
    of_ideal = rotor.induced_factor + rotor.profile_factor
    if of_ideal < 1.0:
        msg = (
            f"the flights hover on {quantity.percent(of_ideal)} of what {rotor.disk_area_m2:.3g} m² of "
            f"propellers, as in {vehicle.name}, need without any loss: the mass or payload of the flights is "
            "too large, the propellers of the model too small, or the current in the logs too low"
        )
        raise IdentificationError(msg)


def narrowed_provenance(
    provenance: Provenance, records: Sequence[FlightRecord], power: NarrowedPower
) -> Provenance:
    """Return where a model comes from that flights have narrowed."""
    used = {one.source for one in power.steady}
    logs = dict(zip(provenance.logs_sha256, provenance.logs, strict=True))
    logs |= {one.sha256: one.source for one in records if f"{one.source}#{one.number}" in used}
    flights = quantity.count(power.flights, "flight")
    return replace(
        provenance,
        basis=Basis.REFINED,
        readings=(
            *provenance.readings,
            *leant_wind_readings(records),
            f"narrowed by {flights}: {power.text}",
        ),
        logs=tuple(logs.values()),
        logs_sha256=tuple(logs),
    )


def shown_box(box: ValidFor, steady: Sequence[MeasuredPower], lean: LeanFlight) -> ValidFor:
    """Return a box in which a model holds with the airspeeds and climb rates that flights have shown.

    A data sheet's airspeeds are assumed: where flights leant so much that its highest is not sure to be
    held, by drag that may go by the square, it ends where that is.
    """
    shown = {
        "speed_m_s": [lean.shown_m_s(one.airspeed_m_s) for one in steady],
        "climb_rate_m_s": [one.climb_rate_m_s for one in steady],
    }
    sure = {} if lean.sure_airspeed_m_s is None else {"speed_m_s": lean.sure_airspeed_m_s}
    wider = {}
    for name, values in shown.items():
        own = getattr(box, name)
        if own is not None:
            wider[name] = Interval(
                low=min(own.low, math.ceil(10.0 * min(values)) / 10.0),
                high=max(
                    min(own.high, sure.get(name, math.inf)), math.floor(10.0 * max(values)) / 10.0
                ),
            )
    return replace(box, **wider)


_LEAST_W_KG = 40.0
"""No multicopter hovers on less: two thirds of its mass in batteries of 380 Wh/kg for the record of
4 h 21 min are 58 W/kg. [W/kg]"""
_HOVERS_M_S, _LEVEL_M_S = 1.0, 0.3
"""Airspeed and climb rate below which steady flight is a hover. [m/s]"""


def refuse_impossible_mass(steady: Sequence[MeasuredPower]) -> None:
    """Raise IdentificationError for a mass that nothing lifts on the power of the hovers."""
    hovers = [
        (one.power_w, one.mass_kg)
        for one in steady
        if one.airspeed_m_s < _HOVERS_M_S
        and abs(one.climb_rate_m_s) < _LEVEL_M_S
        and one.mass_kg is not None
    ]
    if not hovers:
        return
    hover_w, mass_kg = (float(np.median(column)) for column in zip(*hovers, strict=True))
    if hover_w < _LEAST_W_KG * mass_kg:
        msg = (
            f"{quantity.mass(mass_kg)} cannot hover on {quantity.power(hover_w)}, "
            f"{quantity.power(hover_w / mass_kg)} for each kilogram: no multicopter hovers on less "
            f"than {quantity.power(_LEAST_W_KG)}; correct --mass or --payload"
        )
        raise IdentificationError(msg)


def _told(factor: NarrowedFactor) -> str:
    change = quantity.signed(factor.value - 1.0, quantity.percent)
    return (
        f"{factor.label} {change}, standard deviation {quantity.percent(factor.before)} before, "
        f"{quantity.percent(factor.after)} after"
    )


def _disagreements(factors: Sequence[NarrowedFactor], birge_ratio: float) -> list[Finding]:
    wider = ""
    if birge_ratio > _SHOWN_RATIO:
        wider = f"; all spreads are taken {quantity.decimals(birge_ratio, 1)} times as wide"
    return [
        PRIOR_DISAGREES.finding(
            f"{one.label} is {quantity.signed(one.value - 1.0, quantity.percent)} from where the model had "
            f"it, {abs(math.log(one.value)) / one.before:.1f} of its standard deviations{wider}"
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
        self.known = LawSpread.of_model(spread)
        self.names, self.prior = self.known.names, self.known.deviations
        self.whitened = np.linalg.inv(np.linalg.cholesky(self.known.covariance))
        self.steady = steady
        self.cells, self.flights = _cells(steady)
        self.measured = np.log([one.power_w for one in steady])
        errors = np.array([one.error_w / one.power_w for one in steady])
        self.counts = np.bincount(self.cells)
        noise = np.bincount(self.cells, errors**2) / self.counts**2
        self.sigma = np.sqrt(noise + THEORY_FRACTION**2)
        _, first = np.unique(self.cells, return_index=True)
        self.flight_of = self.flights[first]
        winds, self.wind_of = winds_of(steady)
        self.winds_m_s = np.zeros(len(winds))
        before = self._energy(self.rotor, self.known)
        apart = (spread.energy_fraction or 0.0) ** 2 - before.shared**2
        self.known_day_fraction = math.sqrt(max(apart, DAY_FRACTION**2))
        self.day_fraction, self.birge_ratio = self.known_day_fraction, 1.0
        self.narrowed, self.winds_m_s, self.covariance = self._most_likely()

    def moved(self, factors: FloatArray) -> Rotor:
        """Return the rotor with its factors multiplied."""
        return moved_rotor(self.rotor, dict(zip(self.names, factors.tolist(), strict=True)))

    def _log_powers(self, factors: FloatArray, winds_m_s: FloatArray) -> FloatArray:
        rotor, powers = self.moved(factors), np.empty(len(self.steady))
        # a wind against it would tell a drag below that of calm air, which it may not have had
        behind_m_s = np.abs(np.append(winds_m_s, 0.0))[self.wind_of]
        for row, one in enumerate(self.steady):
            powers[row] = momentum_power_w(
                max(one.airspeed_m_s - behind_m_s[row], 0.0),
                one.climb_rate_m_s,
                rotor,
                mass_kg=one.mass_kg or 0.0,
                air_density_kg_m3=one.air_density_kg_m3 or SEA_LEVEL_DENSITY_KG_M3,
            )
        return np.log(powers + self.avionics_w)

    def _residuals(self, unknown: FloatArray) -> FloatArray:
        factors, of_flights, winds_m_s = self._apart(unknown)
        off = self.measured - self._log_powers(factors, winds_m_s)
        of_cells = np.bincount(self.cells, off) / self.counts - of_flights[self.flight_of]
        return np.concatenate(
            (
                of_cells / self.sigma,
                self.whitened @ factors,
                of_flights / self.day_fraction,
                winds_m_s / UNTOLD_WIND_M_S,
            )
        )

    def _apart(self, unknown: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return factors, what flights are off by, and winds. [-], [-], [m s⁻¹]"""
        first, second = len(self.names), len(unknown) - len(self.winds_m_s)
        return unknown[:first], unknown[first:second], unknown[second:]

    def _most_likely(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the most likely logarithms of the factors, winds [m s⁻¹], and covariance of the first."""
        from scipy.optimize import least_squares

        count, flights = len(self.names), int(self.flights.max()) + 1
        unknown = np.zeros(count + flights + len(self.winds_m_s))
        unknown[count + flights :] = 1.0  # at no wind its magnitude has no slope
        for _ in range(_ROUNDS):
            found = least_squares(self._residuals, unknown, method="lm")
            unknown, covariance = found.x, np.linalg.inv(found.jac.T @ found.jac)
            # what all flights are off by is the vehicle's: only what sets them apart is the days'
            apart = np.eye(flights) - 1.0 / flights
            off, own = self._apart(unknown)[1], slice(count, count + flights)
            second = np.outer(off, off) + covariance[own, own]
            mean = (self.known_day_fraction**2 + float(np.sum(apart * second))) / flights
            self.day_fraction = max(math.sqrt(mean), self.known_day_fraction)
        covariance = covariance[:count, :count]
        self.birge_ratio = max(math.sqrt(2.0 * float(found.cost) / self.counts.size), 1.0)
        wider = np.minimum(self.birge_ratio, self.prior / np.sqrt(np.diag(covariance)))
        factors, _, winds_m_s = self._apart(unknown)
        return factors, np.abs(winds_m_s), np.asarray(covariance * np.outer(wider, wider))

    @property
    def residuals_w(self) -> FloatArray:
        """Power of each steady flight by the narrowed law, less what was measured. [W]"""
        measured = np.exp(self.measured)
        return np.asarray(np.exp(self._log_powers(self.narrowed, self.winds_m_s)) - measured)

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
    def law(self) -> LawSpread:
        """How far the factors may still be off."""
        return LawSpread(names=self.names, covariance=self.covariance)

    @property
    def energy(self) -> EnergyFractions:
        """How far the power may still be off."""
        return self._energy(self.moved(self.narrowed), self.law)

    def _energy(self, rotor: Rotor, law: LawSpread) -> EnergyFractions:
        return energy_fractions(rotor, law, mass_kg=self.mass_kg, avionics_w=self.avionics_w)


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
