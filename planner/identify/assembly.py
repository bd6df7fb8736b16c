"""The model of a vehicle, put together from what was found, with what a base model gives."""

from __future__ import annotations

import datetime as dt
import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from planner import __version__, quantity
from planner.autopilot import Autopilot
from planner.errors import IdentificationError
from planner.findings import Rule, Severity
from planner.identify.arx import ARX_BIASED
from planner.identify.battery import PackSettings, identify_battery
from planner.identify.flown_mission import flown_parameters, flown_position_noise_m, loads_let_go
from planner.identify.lag import identify_drag, times_allow_drag
from planner.identify.lean import identified_lean, one_way_findings
from planner.identify.leant_wind import leant_wind_readings
from planner.identify.log_table import LogTable
from planner.identify.manoeuvres import ResponseKind
from planner.identify.refinement import shown_box
from planner.identify.segments import FitStatus, mean_air_density_kg_m3, record_air_density_kg_m3
from planner.identify.spread import left_out_spread, noise_fraction, ramp_spread, time_errors
from planner.identify.uncertainty import rounded
from planner.physics.rotor import Rotor
from planner.presented import Shown
from planner.values import Value, field, field_values, replace
from planner.vehicle.declared import Interval
from planner.vehicle.law_factors import LawSpread, energy_fractions
from planner.vehicle.model import (
    Basis,
    ModelSpread,
    Provenance,
    Responses,
    Speed,
    SpeedResponse,
    ValidFor,
    VehicleModel,
)
from planner.vehicle.repeatability import DAY_FRACTION

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.identify.battery import BatteryFit
    from planner.identify.lean import LeanFlight
    from planner.identify.log_table import LogConditions
    from planner.identify.power import PowerIdentification
    from planner.identify.power_laws import SteadyMap
    from planner.identify.ramps import RampIdentification
    from planner.identify.refinement import NarrowedPower
    from planner.identify.responses import ResponseEvidence, ResponseIdentification
    from planner.identify.segments import MeasuredPower, StateOutcome
    from planner.identify.uncertainty import Estimate
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import ManoeuvreResponse, Ramps


class Evidence(Value, eq=False):
    """What the model rests on, for figures."""

    records: tuple[FlightRecord, ...]
    steady: tuple[MeasuredPower, ...]
    hovers: tuple[MeasuredPower, ...]
    responses: tuple[ResponseEvidence, ...]
    steady_map: SteadyMap | None
    battery: BatteryFit | None


class Identification(Shown, eq=False):
    """A model made of flights, and how."""

    model: VehicleModel
    states: tuple[StateOutcome, ...]
    findings: tuple[Finding, ...]
    evidence: Evidence
    remarks: tuple[str, ...]
    """Comments for the top of the model file."""

    def state(self, name: str) -> StateOutcome:
        """Return the outcome of a state by its name."""
        return {outcome.name: outcome for outcome in self.states}[name]


_SHORT_FRACTION = 0.005
"""By which the mean of what was flown falls short of what was commanded. [-]"""
_DENSITY_MARGIN = 0.01
"""Fraction by which the air may be thinner or denser than in the flights. [-]"""


def flown_box(
    records: Sequence[FlightRecord],
    parts: Parts,
    settings: IdentificationSettings,
    lean: LeanFlight,
    *,
    mass_kg: float | None,
) -> ValidFor:
    """Return the box of what was flown, no larger.

    Airspeeds of a way with the wind, which the ``lean`` of other flights contradicts, reach no farther than
    that tells; those of flights one way are less by two deviations of a wind that nothing tells.
    ``mass_kg`` is that without payload, ``None`` where the power does not depend on it.

    Raises IdentificationError if neither a speed nor a height is known.
    """
    flown = [~r.is_landed for r in records]
    heights = _known([r.height_above_home_m for r in records], flown)
    steady = parts.steady
    speeds = [f.airspeed_m_s for f in steady]
    climbs = [f.climb_rate_m_s for f in steady]
    ramps = None if parts.ramps is None else parts.ramps.ramps
    if not steady or ramps is not None:  # means over manoeuvres are below the speeds flown in them
        speeds += [
            float(np.percentile(own, 99.0))
            for r, f in zip(records, flown, strict=True)
            if (own := _known([r.ground_speed_m_s], [f])).size
        ]
    speeds = [lean.shown_m_s(one) for one in speeds]
    if ramps is not None:
        climbs += [-ramps.descent_m_s, ramps.climb_m_s]
    if not speeds and not heights.size:
        msg = "the flights show neither speed nor height: the range a model holds for is unknown"
        raise IdentificationError(msg)
    is_mapped = parts.power.steady_map is not None or parts.power.vertical is not None
    densities = [f.air_density_kg_m3 for f in steady if f.air_density_kg_m3 is not None]
    steps = [
        abs(float(m.reference[-1] - m.reference[0]))
        for r in parts.responses
        if r.evidence is not None and r.evidence.name == ResponseKind.ALTITUDE.value
        for m in r.evidence.manoeuvres
    ]
    masses = [f.mass_kg for f in steady if f.mass_kg is not None]
    deviation_kg = settings.payload_deviation_kg
    is_stepped = steps and settings.reference is Autopilot.STEP
    return ValidFor(
        speed_m_s=Interval(low=0.0, high=_outward(max(speeds), 0.1)) if speeds else None,
        height_above_home_m=_interval([0.0, *heights.tolist()], 1.0) if heights.size else None,
        hover_height_above_home_m=_interval([h.height_above_home_m for h in parts.hovers], 1.0),
        altitude_step_m=Interval(low=0.0, high=round(max(steps), 1)) if is_stepped else None,
        climb_rate_m_s=_interval(climbs, 0.1) if is_mapped else None,
        mass_kg=(
            None
            if mass_kg is None
            else Interval(
                low=min([mass_kg, *masses]) - deviation_kg,
                high=max([mass_kg, *masses]) + deviation_kg,
            )
        ),
        air_density_kg_m3=(
            Interval(
                low=round(min(densities) * (1.0 - _DENSITY_MARGIN), 4),
                high=round(max(densities) * (1.0 + _DENSITY_MARGIN), 4),
            )
            if densities and mass_kg is not None
            else None
        ),
    )


def _known(columns: Sequence[FloatArray], where: Sequence[npt.NDArray[np.bool_]]) -> FloatArray:
    joined = np.concatenate([c[w] for c, w in zip(columns, where, strict=True)])
    known: FloatArray = joined[np.isfinite(joined)]
    return known


def _interval(values: Sequence[float], step: float) -> Interval | None:
    if not values:
        return None
    return Interval(low=-_outward(-min(values), step), high=_outward(max(values), step))


def _outward(value: float, step: float) -> float:
    """Round up, away from what was flown: a mean falls a little short of its command."""
    beyond = value + _SHORT_FRACTION * abs(value)
    return round(math.ceil(beyond / step - 1e-9) * step, 6)


def _named(names: Iterable[str]) -> str:
    return ", ".join(sorted(filter(None, set(names))))


def _minutes(records: Sequence[FlightRecord]) -> float:
    return sum(r.duration_s for r in records) / 60.0


def made_description(records: Sequence[FlightRecord], reference: Autopilot) -> str:
    """Return a description for a pilot, where none is given."""
    names = _named(r.vehicle for r in records) or "Multicopter"
    flights = quantity.count(len(records), "flight")
    return f"{names}, {reference.label}; identified from {flights} of {_minutes(records):.0f} min."


def made_provenance(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    outcomes: Sequence[StateOutcome],
    readings: Sequence[str],
    *,
    basis: Basis | None,
) -> Provenance:
    """Return logs, method and figures of the fit."""
    files = {record.sha256: record.source for record in records}
    named = (_named(r.firmware for r in records), _named(r.vehicle for r in records))
    origin = " of ".join(filter(None, named))
    source = f"{quantity.count(len(records), 'flight')} in {quantity.count(len(files), 'log')}"
    fit: list[tuple[str, float]] = [("flights", float(len(records)))]
    for outcome in outcomes:
        if outcome.status is not FitStatus.IDENTIFIED:
            continue
        name = outcome.name.replace(" ", "_")
        fit.append((f"{name}_segments", float(outcome.used)))
        if outcome.fit_percent is not None:
            fit.append((f"{name}_fit_percent", round(outcome.fit_percent, 2)))
        if outcome.rms is not None:
            unit = {"W": "w", "m": "m", "m/s": "m_s", "V": "v"}.get(outcome.unit, "")
            fit.append((f"{name}_rmse_{unit}".rstrip("_"), rounded(outcome.rms, 4)))
    return Provenance(
        source=", ".join(filter(None, (source, origin))),
        basis=basis,
        method=f"mavjoule identify {settings.version}, {settings.method}",
        date=settings.date,
        readings=tuple(readings),
        # a log's name with its folder's: logs of one logger are often called alike
        logs=tuple("/".join(Path(path).parts[-2:]) for path in files.values()),
        logs_sha256=tuple(files),
        fit=tuple(fit),
    )


def made_remarks(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    outcomes: Sequence[StateOutcome],
) -> tuple[str, ...]:
    """Return comments for the top of the file: each state with its numbers and their errors."""
    flights = f"{quantity.count(len(records), 'flight')}, {_minutes(records):.0f} min"
    lines = [f"Written by mavjoule identify {settings.version} from {flights}.", ""]
    for outcome in outcomes:
        lines.append(f"{outcome.name}: {outcome.summary}")
        lines += [
            f"    {e.name} = {e.value:.6g} +- {e.error:.2g}"
            + (", not shown" if e.name in outcome.not_shown else "")
            for e in outcome.estimates
            if np.isfinite(e.error)
        ]
    return tuple(lines)


class Method(StrEnum):
    """How responses are fitted."""

    OUTPUT_ERROR = "output-error"
    """In continuous time, by output error: consistent."""
    ARX = "arx"
    """As the article does: noise biases it."""


class IdentificationSettings(Value):
    """What no log holds, and how to go about it."""

    name: str
    """Of the model; also the stem of its file."""
    date: dt.date = field(default_factory=dt.date.today)
    """Day the model is made."""
    version: str = __version__
    """Of this program."""
    description: str | None = None
    readings: tuple[str, ...] = ()
    """What whoever uses the numbers has to know besides."""
    reference: Autopilot | None = None
    """Who shapes the reference; ``None``: as the logs report, step references where they do not."""
    logs: LogTable = LogTable()
    """Mass, payload, temperature, battery of the flights."""
    payload_deviation_kg: float = 0.0
    """Standard deviation of a payload that is not known from flight to flight. [kg]"""
    position_noise_m: float | None = None
    """What the model assumes of the position in a hover; ``None``: as measured in the flights. [m]"""
    pack: PackSettings = field(default_factory=PackSettings)
    method: Method = Method.OUTPUT_ERROR
    base: VehicleModel | None = None
    """Gives what the flights do not show."""

    @property
    def own_mass_kg(self) -> float | None:
        """Mass without payload: that of the logs, else the base model's. [kg]"""
        known = self.logs.mass_kg
        return known if known is not None or self.base is None else self.base.mass_kg

    def conditions_of(self, record: FlightRecord) -> LogConditions:
        """Return what is known of a flight beside its log.

        Raises UsageError if there is a table without one row for the log.
        """
        own = self.logs.of(record.source)
        return own if own.mass_kg is not None else replace(own, mass_kg=self.own_mass_kg)

    def flown_mass_kg(self, record: FlightRecord) -> float | None:
        """Return the mass that flew, with payload. [kg]"""
        own = self.conditions_of(record)
        return None if own.mass_kg is None else own.mass_kg + (own.payload_kg or 0.0)

    def mean_air_kg_m3(self, record: FlightRecord) -> float:
        """Return the mean density of the air of a flight. [kg m⁻³]"""
        temperature_c = self.conditions_of(record).temperature_c
        density = record_air_density_kg_m3(record, home_temperature_c=temperature_c)
        return mean_air_density_kg_m3(density)

    def times_heavier(self, record: FlightRecord) -> float:
        """Return the mass that flew over that of the model; one where they are not known. [-]"""
        flown_kg, own_kg = self.flown_mass_kg(record), self.own_mass_kg
        return flown_kg / own_kg if flown_kg and own_kg else 1.0


_LEAST_DAMPING = 0.3
"""Of a response to a reference that was shaped to be followed. [-]"""
_MOTIONS = (ResponseKind.ALTITUDE.value, ResponseKind.SPEED.value)


class Parts(Value, eq=False):
    """What the two ways of identifying have in common."""

    power: PowerIdentification
    responses: tuple[ResponseIdentification, ...]
    steady: tuple[MeasuredPower, ...]
    hovers: tuple[MeasuredPower, ...] = ()
    ramps: RampIdentification | None = None
    narrowed: NarrowedPower | None = None
    """The base model's power narrowed by the flights, where it is of a kind that can be."""


def assemble_model(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    parts: Parts,
    *,
    on_step: Callable[[str], None] = lambda _: None,
) -> Identification:
    """Put the model together, with what the base model gives, and report what is missing.

    The settings name a reference here; ``on_step`` receives what is done next.

    Raises IdentificationError if a model of step references lacks the motion.
    """
    base, reference = settings.base, settings.reference
    assert reference is not None
    power = _power(parts.power, base)
    outcomes = list(power.outcomes)
    responses = _responses(parts, power, base, outcomes)
    ramps = _ramps(parts, base, outcomes)
    on_step("fitting the battery")
    pack = identify_battery(records, settings.pack, list(map(settings.conditions_of, records)))
    battery, of_battery = pack.battery, pack.outcome
    if battery is None and base is not None and base.battery is not None:
        battery, of_battery = base.battery, _of_base(of_battery, base)
    outcomes.append(of_battery)
    findings = list(dict.fromkeys(f for record in records for f in record.findings))
    findings += pack.findings
    for record in records:
        findings += loads_let_go(record, settings.conditions_of(record).payload_kg)
    findings += one_way_findings(records)
    parameters: tuple[tuple[str, float], ...] = ()
    times_heavier = [settings.times_heavier(record) for record in records]
    if reference is Autopilot.STEP:
        if ramps is None:
            _refuse_lacking_motion(responses, outcomes)
    else:
        parameters, differing = flown_parameters(records, reference, times_heavier)
        findings += differing
    air_kg_m3 = [settings.mean_air_kg_m3(record) for record in records]
    lean = identified_lean(records, base, times_heavier=times_heavier, air_kg_m3=air_kg_m3)
    drag = (
        identify_drag(records, times_heavier=times_heavier) if reference is Autopilot.PX4 else None
    )
    of_base = base.drag_per_s if base is not None and reference is Autopilot.PX4 else None
    mass_kg = settings.own_mass_kg
    findings += [*_reported(outcomes, settings, mass_kg), *_vehicles(records)]
    readings = [
        *settings.readings,
        *parts.power.readings,
        *pack.readings,
        *_air_readings(records, settings, parts),
        *_contradicted_readings(records, lean),
    ]
    noise_m, noise_off, noise_readings = _position_noise(records, settings)
    readings += noise_readings
    model = VehicleModel(
        name=settings.name,
        source=f"{settings.name}.toml",
        kind="multicopter",
        reference=reference,
        description=settings.description or made_description(records, reference),
        mass_kg=mass_kg,
        mass_max_kg=None if base is None else base.mass_max_kg,
        ceiling_amsl_m=None if base is None else base.ceiling_amsl_m,
        wind_max_m_s=None if base is None else base.wind_max_m_s,
        thrust_max_n=None if base is None else base.thrust_max_n,
        airspeed_limit_m_s=lean.airspeed_limit_m_s,
        airspeed_limit_lean_deg=lean.limit_lean_deg,
        airspeed_limit_air_density_kg_m3=lean.limit_air_kg_m3,
        airspeed_limit_fraction=lean.limit_fraction,
        drag_exponent=lean.drag_exponent,
        position_noise_m=noise_m,
        drag_per_s=of_base if drag is None else float(f"{drag.value:.4g}"),
        hover=power.hover,
        cruise=power.cruise,
        vertical=power.vertical,
        loads=power.loads,
        battery=battery,
        responses=Responses(**_applied(responses, reference)),
        ramps=ramps,
        speed=_speed(parts, responses, base, reference),
        parameters=parameters,
        valid_for=flown_box(
            records, parts, settings, lean, mass_kg=mass_kg if power.is_known else None
        ),
        provenance=made_provenance(
            records, settings, outcomes, readings, basis=_basis(parts.power, base)
        ),
    )
    spread: ModelSpread | None = None
    on_step("predicting each flight by the others")
    if drag is not None:
        model = _with_drag_that_shows(model, drag, of_base, records, settings)
    if reference is not Autopilot.STEP:
        agreeing = [one for place, one in enumerate(records) if place not in lean.contradicted]
        spread = left_out_spread(model, agreeing, parts.steady, settings)
    elif parts.ramps is not None and parts.ramps.ramps is not None:
        spread = ramp_spread(records, settings)
    if spread is not None:
        spread = replace(spread, position_noise_fraction=noise_off)
    model = replace(model, spread=_with_law(spread, model, parts.power.steady_map))
    if parts.narrowed is not None and base is not None:
        findings += parts.narrowed.findings
        model = _narrowed(model, base, parts.narrowed, lean, settings)
    return Identification(
        model=model,
        states=tuple(outcomes),
        findings=tuple(findings),
        evidence=Evidence(
            records=tuple(records),
            steady=parts.steady,
            hovers=parts.hovers,
            responses=tuple(r.evidence for r in parts.responses if r.evidence is not None),
            steady_map=parts.power.steady_map,
            battery=pack.fit,
        ),
        remarks=made_remarks(records, settings, outcomes),
    )


def _position_noise(
    records: Sequence[FlightRecord], settings: IdentificationSettings
) -> tuple[float, float | None, list[str]]:
    """Return the noise of the position, how far that of a flight is from it, and where it is from."""
    if settings.position_noise_m is not None:
        return settings.position_noise_m, None, []
    shown_m = [one for record in records if (one := flown_position_noise_m(record)) > 0.0]
    if not shown_m:
        return 0.0, None, []
    noise_m = round(float(np.median(shown_m)), 3)
    reading = f"position_noise_m is {noise_m:g} m, as measured hovering and climbing"
    return noise_m, noise_fraction(shown_m), [reading]


def _with_law(
    spread: ModelSpread | None, model: VehicleModel, steady_map: SteadyMap | None
) -> ModelSpread | None:
    """Return the spread with how far the factors of the law may be off, which further flights narrow.

    Of flights that were not compared with others, that and the days are all that is known.
    """
    if steady_map is None or model.mass_kg is None:
        return spread
    rotor = Rotor(**field_values(steady_map.law))
    law = LawSpread.of_fit(rotor, steady_map.log_covariance)
    if spread is None or spread.energy_fraction is None:
        avionics_w = 0.0 if model.loads is None else model.loads.avionics_w
        energy = energy_fractions(rotor, law, mass_kg=model.mass_kg, avionics_w=avionics_w)
        if spread is None:
            source = (
                "compared with no other flight: what the fit leaves open, and what days differ by"
            )
            spread = ModelSpread(n_flights=1, source=source, energy_fraction=0.0)
        spread = replace(
            spread,
            energy_fraction=round(math.hypot(energy.shared, DAY_FRACTION), 4),
            energy_state_fraction=energy.of_states(),
        )
    return replace(spread, law_fraction=law.law_fraction, law_correlation=law.law_correlation)


_OF_POWER = (
    "energy_fraction",
    "energy_fraction_s_m",
    "energy_state_fraction",
    "law_fraction",
    "law_correlation",
    "n_flights",
    "source",
)


def _narrowed(
    model: VehicleModel,
    base: VehicleModel,
    power: NarrowedPower,
    lean: LeanFlight,
    settings: IdentificationSettings,
) -> VehicleModel:
    """Return a model whose power is the base's, narrowed: where it holds, and how uncertain, is as well."""
    spread = power.spread
    if model.spread is not None:
        spread = replace(model.spread, **{name: getattr(spread, name) for name in _OF_POWER})
    known, own = base.provenance, model.provenance
    logs = dict(zip(known.logs_sha256, known.logs, strict=True))
    logs |= dict(zip(own.logs_sha256, own.logs, strict=True))
    return replace(
        model,
        battery=power.battery if settings.pack == PackSettings() else model.battery,
        spread=spread,
        valid_for=shown_box(base.valid_for, power.steady, lean),
        provenance=replace(
            own,
            basis=Basis.REFINED,
            readings=(*known.readings, *own.readings),
            logs=tuple(logs.values()),
            logs_sha256=tuple(logs),
        ),
    )


def _with_drag_that_shows(
    model: VehicleModel,
    drag: Estimate,
    known_per_s: float | None,
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
) -> VehicleModel:
    """Return the model with its drag unless the times flown contradict it, else with that known.

    Asked without a limit of the airspeed: one flight held at it, predicted too slow with both, is not to
    decide.
    """
    free = replace(model, airspeed_limit_m_s=None, airspeed_limit_lean_deg=None, drag_exponent=None)
    errors = time_errors((free, replace(free, drag_per_s=known_per_s)), records, settings)
    with_it, without = errors or ((), ())
    is_kept = times_allow_drag(with_it, without)
    reading = (
        f"drag_per_s is {drag.value:.3f} ± {drag.error:.3f} 1/s, from how far the vehicle lags "
        "behind its trajectory"
    )
    if not is_kept:
        reading = f"left out: {reading}"
    if not errors:
        reading += "; no flight of a mission shows the times it takes"
    elif not is_kept or np.square(with_it).sum() > np.square(without).sum():
        means = " and ".join(f"{100.0 * np.mean(one):+.1f} %" for one in errors)
        reading += f"; flown less predicted times are {means} in the mean with it and without"
    return replace(
        model,
        drag_per_s=model.drag_per_s if is_kept else known_per_s,
        provenance=replace(model.provenance, readings=(*model.provenance.readings, reading)),
    )


def _basis(found: PowerIdentification, base: VehicleModel | None) -> Basis | None:
    """Return what the model rests on: the base model's basis where its power is all there is."""
    is_of_base = not found.is_known and base is not None and base.is_power_known
    return base.provenance.basis if is_of_base and base is not None else Basis.IDENTIFIED


def _power(found: PowerIdentification, base: VehicleModel | None) -> PowerIdentification:
    """Return the power the flights show, else that of the base model."""
    if found.is_known:
        return found
    if base is None or not base.is_power_known:
        return replace(found, loads=None)
    outcomes = tuple(_of_base(outcome, base) for outcome in found.outcomes)
    laws = {name: getattr(base, name) for name in ("hover", "cruise", "vertical", "loads")}
    return replace(found, **laws, outcomes=outcomes)


def _responses(
    parts: Parts,
    power: PowerIdentification,
    base: VehicleModel | None,
    outcomes: list[StateOutcome],
) -> dict[str, ManoeuvreResponse | None]:
    """Return the responses by name, and add what was found about each."""
    responses: dict[str, ManoeuvreResponse | None] = {}
    for found in parts.responses:
        outcome, response = found.outcome, found.response
        if response is None and base is not None:
            response = getattr(base.responses, outcome.name)
            outcome = outcome if response is None else _of_base(outcome, base)
        is_of_power = outcome.name.endswith("_power")
        responses[outcome.name] = None if is_of_power and not power.is_known else response
        outcomes.append(outcome)
    return responses


def _applied(
    responses: Mapping[str, ManoeuvreResponse | None], reference: Autopilot
) -> Mapping[str, Any]:
    """Return the responses that predictions use; how the others follow is reported only.

    Stops and stations of ArduPilot follow them; PX4 is taken to fly its references without lag.  A
    vehicle that follows a shaped reference does not swing: what swings was found in its noise.
    """
    if reference is Autopilot.STEP:
        return responses
    if reference is Autopilot.PX4:
        return {}
    return {
        name: response
        for name, response in responses.items()
        if response is not None
        and all(
            -pole.real >= _LEAST_DAMPING * abs(pole) for pole in response.transfer_function.poles
        )
    }


def _ramps(parts: Parts, base: VehicleModel | None, outcomes: list[StateOutcome]) -> Ramps | None:
    """Return the ramps the flights show, else those of the base model; add what was found."""
    if parts.ramps is None:
        return None
    ramps, outcome = parts.ramps.ramps, parts.ramps.outcome
    if ramps is None and base is not None and base.ramps is not None:
        ramps, outcome = base.ramps, _of_base(outcome, base)
    outcomes.append(outcome)
    if ramps is None:
        msg = (
            f"the logs hold no references, and the flights do not show how the vehicle moves "
            f"({outcome.summary}): "
            "log them, or fly level legs at several heights, or name a base model with --base"
        )
        raise IdentificationError(msg)
    return ramps


def _refuse_lacking_motion(
    responses: Mapping[str, ManoeuvreResponse | None], outcomes: Sequence[StateOutcome]
) -> None:
    lacking = [o for o in outcomes if o.name in _MOTIONS and responses.get(o.name) is None]
    if lacking:
        why = "; ".join(f"{o.name}: {o.summary}" for o in lacking)
        msg = (
            f"the flights do not show how the vehicle moves ({why}): a model of step references "
            "needs both altitude and speed; fly them, or name a base model with --base"
        )
        raise IdentificationError(msg)


def _contradicted_readings(records: Sequence[FlightRecord], lean: LeanFlight) -> list[str]:
    """Return what is said of the flights that lean too little for the drag of the others."""
    return [
        f"{Path(records[place].source).name}#{records[place].number}: it leans less than the drag of the "
        "other flights asks for: taken for flown with the wind, and left out of drag and deviations."
        for place in sorted(lean.contradicted)
    ]


def _air_readings(
    records: Sequence[FlightRecord], settings: IdentificationSettings, parts: Parts
) -> list[str]:
    readings: list[str] = []
    knows_density = any(f.air_density_kg_m3 is not None for f in parts.steady)
    if knows_density and any(settings.conditions_of(r).temperature_c is None for r in records):
        readings.append("Air density is that of the standard atmosphere at the altitude flown.")
    leant = leant_wind_readings(records)
    readings += leant
    if parts.steady and any(not np.isfinite(r.airspeed_m_s).any() for r in records):
        readings.append(f"No wind in the {'other logs' if leant else 'logs'}: calm air assumed.")
    return readings


def _of_base(outcome: StateOutcome, base: VehicleModel) -> StateOutcome:
    return replace(
        outcome,
        status=FitStatus.BASE,
        summary=f"taken from {base.name}: {outcome.summary}",
        estimates=(),
    )


STATE_LEFT_OUT = Rule(
    "I102 state-left-out",
    Severity.WARNING,
    summary="The flights do not cover a state of the model: it is left out.",
    why="What no flight shows cannot be identified, and nothing is invented: predictions by the model "
    "lack this state, or the model lacks its power altogether.",
    how="Every segment of the state is looked at; those refused are counted with their reasons.  How "
    "an autopilot is followed is only noted: predictions for it need no such response.",
    fix="record a flight with the missing manoeuvre, or name a base model with --base",
)


NUMBER_NOT_SHOWN = Rule(
    "I107 number-not-shown",
    Severity.WARNING,
    summary="The flights do not show a number of the model: its standard error exceeds it.",
    why="What is within its own error says nothing of the vehicle.  Predictions far from the flights, "
    "at another speed or payload, rest on what is usual for multirotors.",
    how="A coefficient of a response or a delay is left at 0, a resistance out, a number of momentum theory "
    "near what is usual, where the flights narrow that by less than a fifth; an exponent of hover power over "
    "mass or air density is that of momentum theory, 3/2 and -1/2; a wait, height or speed of ramps stays: "
    "without it flights would be shorter than flown.  A response of which neither the size nor the time is "
    "shown is no response (I102).  Powers of tables are not asked: a difference from hover may be none.",
    fix="record more flights that show it: faster legs for the drag, steps for a response, climbs for the "
    "resistance of the battery",
)


STATE_OF_BASE = Rule(
    "I103 state-of-base",
    Severity.WARNING,
    summary="A state that the flights do not cover is copied from the base model.",
    why="The base model is another vehicle's: its power and its motion need not be this one's.",
    how="With --base, states missing from the flights are copied from that model.",
    fix="record a flight with the missing manoeuvre",
)


MASS_UNKNOWN = Rule(
    "I105 mass-unknown",
    Severity.WARNING,
    summary="A model is made without the mass of the vehicle.",
    why="Logs do not hold the mass.  Without it payload cannot be predicted, nor air density counted.",
    how="Fires where neither --mass nor a base model gives one.",
    fix="weigh the vehicle with its battery and give --mass",
)


_ADVICE = {
    "no power in the log": "log battery current and voltage, or name a base model with --base for the power",
    "no flight has voltage and current": "log battery current and voltage",
    "battery capacity unknown": "give --capacity, or levels before and after the flights with --table",
    "of the charge was used": "log a longer flight, which uses more of the charge",
    "current hardly varies": "fly climbs or stops: the current has to change to show the resistance",
    "faster than the sampling": "log references and motion at a higher rate",
}
"""What helps, by what an outcome says: a manoeuvre more does not where a sensor is missing."""


def _advice(outcome: StateOutcome) -> str | None:
    return next((fix for why, fix in _ADVICE.items() if why in outcome.summary), None)


def _reported(
    outcomes: Sequence[StateOutcome], settings: IdentificationSettings, mass_kg: float | None
) -> list[Finding]:
    findings = []
    for outcome in outcomes:
        if outcome.not_shown:
            findings.append(
                NUMBER_NOT_SHOWN.finding(
                    f"{outcome.name}: not shown by the flights: {', '.join(outcome.not_shown)}"
                )
            )
        if outcome.status is FitStatus.LEFT_OUT:
            # how closely an autopilot is followed is reported; no prediction uses it
            is_beside = settings.reference is not Autopilot.STEP and outcome.name in _MOTIONS
            findings.append(
                STATE_LEFT_OUT.finding(
                    f"{outcome.name}: left out: {outcome.summary}",
                    severity=Severity.INFO if is_beside else None,
                    fix=_advice(outcome),
                )
            )
        elif outcome.status is FitStatus.BASE:
            findings.append(STATE_OF_BASE.finding(f"{outcome.name}: {outcome.summary}"))
    if mass_kg is None:
        findings.append(MASS_UNKNOWN.finding("mass unknown: payload and air density not modelled"))
    fitted = [
        o.name for o in outcomes if o.status is FitStatus.IDENTIFIED and o.whiteness is not None
    ]
    if settings.method is Method.ARX and fitted:
        findings.append(
            ARX_BIASED.finding(
                f"{', '.join(fitted)}: fitted by ARX alone; its errors are not known, noise may bias it"
            )
        )
    return findings


VEHICLES_DIFFER = Rule(
    "I106 vehicles-differ",
    Severity.WARNING,
    summary="The logs name different vehicles.",
    why="A model made of two vehicles is a model of neither.",
    how="The frames that the logs name are compared; logs of two autopilots are refused.",
    fix="identify each vehicle from its own logs",
)


def _vehicles(records: Sequence[FlightRecord]) -> list[Finding]:
    named = {r.vehicle: r.source for r in records if r.vehicle}
    if len(named) < 2:
        return []
    which = ", ".join(f"{source} is of {vehicle}" for vehicle, source in list(named.items())[:3])
    return [VEHICLES_DIFFER.finding(f"{which}: is this one vehicle?")]


def _speed(
    parts: Parts,
    responses: Mapping[str, ManoeuvreResponse | None],
    base: VehicleModel | None,
    reference: Autopilot,
) -> Speed | None:
    if reference is not Autopilot.STEP:
        return None
    if base is not None and base.speed is not None:
        return base.speed
    speed, default_m_s = responses.get("speed"), None
    if parts.ramps is not None:
        default_m_s = parts.ramps.default_speed_m_s
    elif isinstance(speed, SpeedResponse):
        default_m_s = speed.identified_speed_m_s
    return None if default_m_s is None else Speed(default_m_s=default_m_s)
