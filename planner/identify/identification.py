"""From flight records to a vehicle model: the one way through identification.

A vehicle whose reference is a step is identified as in the article: responses G1 to G5, hover power over
height, cruise power over speed.  One whose autopilot shapes the reference is identified by the steady
power over airspeed and climb rate, by how it follows the logged setpoints, and by the autopilot's own
parameters.  What the flights do not show is taken from a base model or left out, and reported.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import IdentificationError, UsageError
from planner.identify.assembly import Method, Parts, assemble_model
from planner.identify.battery import PackSettings
from planner.identify.lean import is_one_way_in_unknown_wind, knows_wind
from planner.identify.leant_wind import with_leant_wind
from planner.identify.manoeuvres import ResponseKind, cut_manoeuvres
from planner.identify.power import (
    PowerIdentification,
    hover_powers_w,
    identify_cruise,
    identify_hover,
    identify_power,
    manoeuvre_powers,
    power_of_manoeuvres,
)
from planner.identify.ramps import has_references, identify_ramps
from planner.identify.refinement import narrowed_power, refuse_impossible_mass, refuse_other_cells
from planner.identify.responses import identify_response
from planner.identify.segments import (
    SegmentUse,
    StateOutcome,
    find_states,
    record_air_density_kg_m3,
    steady_flight,
    steady_spans,
)
from planner.identify.uncertainty import Estimate
from planner.identify.verification import verify_flight
from planner.units import GRAVITY_M_S2
from planner.values import replace
from planner.vehicle.law_factors import is_narrowable
from planner.vehicle.model import Loads
from planner.vehicle.power import AltitudeLaw, hover_power_w

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray
    from planner.identify.assembly import Identification, IdentificationSettings
    from planner.identify.manoeuvres import ManoeuvreCut
    from planner.identify.responses import ResponseIdentification
    from planner.identify.segments import MeasuredPower, SteadySpan
    from planner.identify.verification import KnownConditions, Verification
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import VehicleModel


_SAME_POWER = 0.05
"""Fraction of hover power by which that of cruise may differ for a stop to be counted from hover. [-]"""
_RINGING_S = 20.0
"""After a step the power of an identified response may ring for tens of seconds. [s]"""


def identify_vehicle(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    *,
    on_step: Callable[[str], None] = lambda _: None,
) -> Identification:
    """Identify a vehicle from its flights.

    ``on_step`` receives what is done next: a flight is cut, a response is fitted.

    Raises IdentificationError if the flights do not show enough for any model.
    Raises UsageError if the base model answers another reference.
    """
    if not records:
        msg = "there is no flight to identify a vehicle from"
        raise IdentificationError(msg)
    reference = settings.reference or _reference_of(records)
    base = settings.base
    if base is not None and base.reference is not reference:
        msg = (
            f"{base.name} answers {base.reference.label}, the flights {reference.label}: it cannot "
            "be their base model"
        )
        raise UsageError(msg)
    _refuse_mass_beyond(base, settings.own_mass_kg)
    identify = _identify_shaped
    if reference is Autopilot.STEP:
        is_logged = any(has_references(record) for record in records)
        identify = _identify_stepped if is_logged else _identify_unreferenced
    records = [with_leant_wind(record) for record in records]
    settings = replace(settings, reference=reference)
    parts = identify(records, settings, on_step)
    if base is not None and is_narrowable(base) and parts.steady:
        on_step(f"narrowing {base.name}")
        parts = _narrowed(parts, base, records, settings)
    return assemble_model(records, settings, parts, on_step=on_step)


def _refuse_mass_beyond(base: VehicleModel | None, mass_kg: float | None) -> None:
    """Raise UsageError for a mass that the limits of the base model, which are carried on, do not bear."""
    if base is None or mass_kg is None:
        return
    limits = []
    if base.mass_max_kg is not None and mass_kg > base.mass_max_kg:
        limits.append(f"{quantity.mass(base.mass_max_kg)}, its mass_max_kg")
    if base.thrust_max_n is not None and mass_kg * GRAVITY_M_S2 >= base.thrust_max_n:
        limits.append(
            f"{quantity.mass(base.thrust_max_n / GRAVITY_M_S2)} of thrust, its thrust_max_n"
        )
    if limits:
        msg = (
            f"{quantity.mass(mass_kg)} is beyond what {base.name} takes off with "
            f"({'; '.join(limits)}): correct --mass, or name a base model of this vehicle"
        )
        raise UsageError(msg)


def _narrowed(
    parts: Parts,
    base: VehicleModel,
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
) -> Parts:
    """Return the parts with the power of a base model that flights narrow, as ``vehicle refine`` does."""
    if settings.pack == PackSettings():  # else the battery that flew is stated
        for record in records:
            refuse_other_cells(record, base)
    conditions = list(map(settings.conditions_of, records))
    found = narrowed_power(base, records, conditions, parts.steady)
    loads = base.loads
    if loads is not None and parts.power.loads is not None:
        loads = replace(parts.power.loads, avionics_w=loads.avionics_w)
    outcome = StateOutcome(
        name="steady power",
        summary=f"{base.name} narrowed by {quantity.count(len(found.steady), 'steady span')}: {found.text}",
        unit="W",
        estimates=tuple(
            Estimate(
                name=f"{one.label}, over that of {base.name}",
                value=one.value,
                error=one.value * one.after,
            )
            for one in found.factors
        ),
        segments=tuple(one for outcome in parts.power.outcomes for one in outcome.segments),
        rms=float(np.sqrt(np.mean(found.residuals_w**2))),
        not_shown=tuple(one.label for one in found.factors if not one.is_shown),
    )
    power = PowerIdentification(cruise=found.law, loads=loads, outcomes=(outcome,))
    return replace(parts, power=power, narrowed=found)


def _reference_of(records: Sequence[FlightRecord]) -> Autopilot:
    autopilots = {record.autopilot for record in records}
    if len(autopilots) > 1:
        names = ", ".join(sorted("none" if a is None else a.label for a in autopilots))
        msg = f"the logs are of different autopilots ({names}): identify each by itself"
        raise IdentificationError(msg)
    return autopilots.pop() or Autopilot.STEP


def _identify_shaped(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    on_step: Callable[[str], None],
) -> Parts:
    steady: list[MeasuredPower] = []
    refusals: list[SegmentUse] = []
    cuts: list[ManoeuvreCut] = []
    for record in records:
        on_step(_flight_step(record))
        density, mass_kg = _flown_density_and_mass(record, settings)
        steady += steady_flight(
            record,
            air_density_kg_m3=density,
            mass_kg=mass_kg,
            is_one_way=is_one_way_in_unknown_wind(record),
        )
        refusals += _power_refusals(record)
        cuts += cut_manoeuvres(record)
    refuse_impossible_mass(steady)
    power = identify_power(
        steady,
        refusals=refusals,
        mass_deviation_kg=settings.payload_deviation_kg,
        is_wind_known=all(knows_wind(one) for one in records),
    )
    return Parts(
        power=replace(power, loads=_loads(records)),
        responses=_responses((ResponseKind.ALTITUDE, ResponseKind.SPEED), cuts, settings, on_step),
        steady=tuple(steady),
    )


def _identify_stepped(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    on_step: Callable[[str], None],
) -> Parts:
    spans: list[SteadySpan] = []
    refusals: list[SegmentUse] = []
    for record in records:
        on_step(_flight_step(record))
        own = steady_spans(record, find_states(record), settling_s=_RINGING_S)
        refusals += _power_refusals(record) or _span_refusals(record, own)
        spans += own
    hovers = [s.power for s in spans if s.power is not None and not s.power.airspeed_m_s]
    cruises = [s.power for s in spans if s.power is not None and s.power.airspeed_m_s]
    power = _stepped_power(hovers, cruises, tuple(refusals))
    cuts: list[ManoeuvreCut] = []
    for record in records:
        hover_w = np.full(record.time_s.size, np.nan)
        if isinstance(power.hover, AltitudeLaw):
            hover_w = hover_power_w(
                power.hover,
                height_above_home_m=record.height_above_home_m,
                mass_kg=None,
                air_density_kg_m3=1.0,
            )
        cuts += cut_manoeuvres(record, hover_power_w=hover_w)
    return Parts(
        power=power,
        responses=tuple(
            _counted_from_hover(found, cuts, hovers)
            for found in _responses(tuple(ResponseKind), cuts, settings, on_step)
        ),
        steady=(*hovers, *cruises),
        hovers=tuple(hovers),
    )


def _identify_unreferenced(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    on_step: Callable[[str], None],
) -> Parts:
    """Identify a vehicle that logs no references: ramps by durations, power by manoeuvres."""
    powers: list[tuple[MeasuredPower, ...]] = []
    refusals: list[SegmentUse] = []
    for record in records:
        on_step(_flight_step(record))
        density, mass_kg = _flown_density_and_mass(record, settings)
        powers.append(manoeuvre_powers(record, air_density_kg_m3=density, mass_kg=mass_kg))
        refusals += _power_refusals(record)
    power, means = power_of_manoeuvres(powers, settings.payload_deviation_kg, tuple(refusals))
    refuse_impossible_mass(means)
    return Parts(
        power=replace(power, loads=_loads(records)),
        responses=(),
        ramps=identify_ramps(records),
        steady=means,
    )


def _flown_density_and_mass(
    record: FlightRecord, settings: IdentificationSettings
) -> tuple[FloatArray, float | None]:
    """Return the density of the air along a flight, and the mass that flew. (n,) [kg m⁻³], [kg]"""
    temperature_c = settings.conditions_of(record).temperature_c
    density = record_air_density_kg_m3(record, home_temperature_c=temperature_c)
    return density, settings.flown_mass_kg(record)


def _flight_step(record: FlightRecord) -> str:
    return f"cutting flight {record.number} of {record.source}, {record.duration_s / 60.0:.0f} min"


def _responses(
    answers: Sequence[ResponseKind],
    cuts: Sequence[ManoeuvreCut],
    settings: IdentificationSettings,
    on_step: Callable[[str], None],
) -> tuple[ResponseIdentification, ...]:
    use_arx = settings.method is Method.ARX
    is_shaped = settings.reference is not Autopilot.STEP
    found = []
    for answer in answers:
        count = sum(cut.answer is answer for cut in cuts)
        on_step(f"fitting {answer.value} to {quantity.count(count, 'manoeuvre')}")
        found.append(identify_response(answer, cuts, use_arx=use_arx, is_shaped=is_shaped))
    return tuple(found)


def _counted_from_hover(
    found: ResponseIdentification, cuts: Sequence[ManoeuvreCut], hovers: Sequence[MeasuredPower]
) -> ResponseIdentification:
    """Return a brake response only where the power before it is that of hover, as in the article.

    A response is added to hover power.  Where cruise takes c watts more, one that is counted from the
    cruise ends c below hover, and the energy of every stop is short by c times its window: the cruise
    power, followed down with the speed, is nearer.
    """
    if found.response is None or found.outcome.name != ResponseKind.BRAKE_POWER.value or not hovers:
        return found
    brakes = [cut.manoeuvre for cut in cuts if cut.answer is ResponseKind.BRAKE_POWER]
    before_w = float(np.median([m.answer_before for m in brakes if m is not None]))
    hover_w = float(np.mean([hover.power_w for hover in hovers]))
    if abs(before_w) <= _SAME_POWER * hover_w:
        return found
    summary = (
        f"cruise before the stop takes {before_w:+.0f} W more than hover: braking is predicted by the "
        "cruise power at its speed, a response from hover would lose that"
    )
    outcome = StateOutcome.left_out(found.outcome.name, summary, found.outcome.segments)
    return replace(found, response=None, outcome=replace(outcome, unit=found.outcome.unit))


def _stepped_power(
    hovers: Sequence[MeasuredPower],
    cruises: Sequence[MeasuredPower],
    refusals: tuple[SegmentUse, ...],
) -> PowerIdentification:
    """Hover power over height and cruise power over speed, as in the article."""
    if not hovers:
        return identify_power((), refusals=refusals)
    hover, outcome, readings = identify_hover(hovers, refusals)
    cruise, cruise_outcome = identify_cruise(cruises, hover_powers_w(hover, cruises))
    return PowerIdentification(
        hover=hover, cruise=cruise, outcomes=(outcome, cruise_outcome), readings=readings
    )


def _power_refusals(record: FlightRecord) -> list[SegmentUse]:
    if np.isfinite(record.power_w).any():
        return []
    remark = next((q.remark for q in record.quantities if q.name == "current_a" and q.remark), "")
    why = f"no power in the log: {remark}" if remark else "no power in the log"
    return [SegmentUse.within(record, what="flight", refusal=why)]


def _span_refusals(record: FlightRecord, spans: Sequence[SteadySpan]) -> list[SegmentUse]:
    return [
        SegmentUse.within(
            record,
            what=str(s.segment.state),
            refusal=s.refusal,
            start_s=s.segment.start_s,
            duration_s=s.segment.duration_s,
        )
        for s in spans
        if s.refusal
    ]


_SPOOLS_S = 2.0
"""Before a lift-off and behind a touch-down: MOT_SPOOL_TIME and the ramp to the thrust of a hover. [s]"""
_IDLE_S = 1.0


def _is_idle(record: FlightRecord) -> BoolArray:
    """Return where a vehicle stands on the ground, away from its flights. (n,)"""
    near = round(_SPOOLS_S / record.step_s)
    flies = np.convolve(~record.is_landed, np.ones(2 * near + 1))[near : near + record.time_s.size]
    return np.asarray(flies < 0.5)


def _loads(records: Sequence[FlightRecord]) -> Loads | None:
    """Return the power on the ground, armed, by the mean of all flights.

    Next to a flight the motors spool up or down: where the rest is too short, by the least that was drawn.
    """
    powers = [np.where(r.is_landed, r.power_w, np.nan) for r in records]
    samples = np.concatenate([p[np.isfinite(p)] for p in powers])
    if not samples.size:
        return None
    idle = [p[_is_idle(r) & np.isfinite(p)] for r, p in zip(records, powers, strict=True)]
    idle_s = sum(one.size * r.step_s for r, one in zip(records, idle, strict=True))
    watts = np.concatenate(idle).mean() if idle_s >= _IDLE_S else samples.min()
    return Loads(avionics_w=0.0, ground_idle_w=round(max(float(watts), 0.0), 3))


def verify_left_out(
    logs: Sequence[Sequence[FlightRecord]],
    settings: IdentificationSettings,
    known_of: Callable[[FlightRecord], KnownConditions],
) -> Iterator[Verification]:
    """Identify a vehicle from all logs but one, and verify on that one, for each in turn.

    What the other logs do not cover is taken from the base of the settings, and reported; that base is
    never narrowed by them, since the log left out may have narrowed it before.

    Raises UsageError if there is one log only.
    """
    if len(logs) < 2:
        msg = "leaving one log out needs two logs at least"
        raise UsageError(msg)
    if settings.base is not None:
        settings = replace(settings, base=replace(settings.base, spread=None))
    for number, flights in enumerate(logs):
        others = [record for n, log in enumerate(logs) if n != number for record in log]
        identified = identify_vehicle(others, settings)
        for record in flights:
            verified = verify_flight(record, identified.model, known_of(record))
            own = [f for f in identified.findings if f.code.startswith("I")]
            yield replace(verified, findings=(*verified.findings, *own))
