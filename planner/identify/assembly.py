"""The model of a vehicle, put together from what was found, with what a base model gives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.catalogue.identification import (
    ARX_BIASED,
    MASS_UNKNOWN,
    STATE_LEFT_OUT,
    STATE_OF_BASE,
    VEHICLES_DIFFER,
)
from planner.errors import IdentificationError
from planner.findings import Severity
from planner.identify.commands import Answer
from planner.identify.discharges import identify_battery
from planner.identify.flight_spread import left_out_spread
from planner.identify.flown_parameters import flown_parameters
from planner.identify.outcome import Evidence, Identification, Status
from planner.identify.provenance import made_description, made_provenance, made_remarks
from planner.identify.ramp_spread import ramp_spread
from planner.identify.settings import Method
from planner.identify.validity import flown_box
from planner.vehicle.model import Responses, VehicleModel

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from planner.findings import Finding
    from planner.identify.outcome import StateOutcome
    from planner.identify.power_states import PowerIdentification
    from planner.identify.ramp_fit import RampIdentification
    from planner.identify.response_states import ResponseIdentification
    from planner.identify.settings import IdentificationSettings
    from planner.identify.steady import SteadyPower
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import Loads, ManoeuvreResponse, ModelSpread, Ramps
    from planner.vehicle.power import (
        CruiseLaw,
        HoverLaw,
        VerticalPower,
    )

_LEAST_DAMPING = 0.3
"""Of a response to a reference that was shaped to be followed. [-]"""
_MOTIONS = (Answer.ALTITUDE.value, Answer.SPEED.value)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parts:
    """What the two ways of identifying have in common."""

    power: PowerIdentification
    responses: tuple[ResponseIdentification, ...]
    steady: tuple[SteadyPower, ...]
    hovers: tuple[SteadyPower, ...] = ()
    loads: Loads | None = None
    ramps: RampIdentification | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Power:
    """The power of the model, wherever it comes from."""

    hover: HoverLaw | None
    cruise: CruiseLaw | None
    vertical: VerticalPower | None
    loads: Loads | None

    @property
    def is_known(self) -> bool:
        return self.hover is not None or self.cruise is not None


def assemble_model(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    parts: Parts,
    *,
    on_step: Callable[[str], None] = lambda _: None,
) -> Identification:
    """Put the model together, with what the base model gives, and say what is missing.

    Parameters
    ----------
    records : sequence of FlightRecord
        The flights.
    settings : IdentificationSettings
        What no log tells; its reference is known.
    parts : Parts
        What was found.
    on_step : callable
        Told what is done next.

    Returns
    -------
    Identification
        The model and what was found about each state.

    Raises
    ------
    IdentificationError
        If a model of step references lacks the motion.
    """
    base, reference = settings.base, settings.reference
    assert reference is not None
    power, outcomes = _power(parts, base)
    responses = _responses(parts, power, base, outcomes)
    ramps = _ramps(parts, base, outcomes)
    on_step("fitting the battery")
    pack = identify_battery(records, settings.pack)
    battery, of_battery = pack.battery, pack.outcome
    if battery is None and base is not None and base.battery is not None:
        battery, of_battery = base.battery, _of_base(of_battery, base)
    outcomes.append(of_battery)
    findings = list(dict.fromkeys(f for record in records for f in record.findings))
    parameters: tuple[tuple[str, float], ...] = ()
    if reference is Autopilot.STEP:
        if ramps is None:
            _refuse_lacking_motion(responses, outcomes)
    else:
        parameters, differing = flown_parameters(records, reference)
        findings += differing
    mass_kg = settings.mass_kg
    if mass_kg is None and base is not None:
        mass_kg = base.mass_kg
    findings += [*_said(outcomes, settings, mass_kg), *_vehicles(records)]
    readings = [
        *settings.readings,
        *parts.power.readings,
        *pack.readings,
        *_air_readings(records, settings, parts),
    ]
    model = VehicleModel(
        name=settings.name,
        source=f"{settings.name}.toml",
        kind="multicopter",
        reference=reference,
        description=settings.description or made_description(records, reference),
        mass_kg=mass_kg,
        position_noise_m=settings.position_noise_m,
        hover=power.hover,
        cruise=power.cruise,
        vertical=power.vertical,
        loads=power.loads,
        battery=battery,
        responses=Responses(**_applied(responses, reference)),
        ramps=ramps,
        default_speed_m_s=_default_speed_m_s(parts, responses, base, reference),
        parameters=parameters,
        valid_for=flown_box(records, parts, settings, mass_kg=mass_kg if power.is_known else None),
        provenance=made_provenance(records, settings, outcomes, readings),
    )
    spread: ModelSpread | None = None
    on_step("predicting each flight by the others")
    if reference is not Autopilot.STEP:
        spread = left_out_spread(model, records, parts.steady, settings)
    elif parts.ramps is not None and parts.ramps.ramps is not None:
        spread = ramp_spread(records, settings)
    model = replace(model, spread=spread)
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


def _power(parts: Parts, base: VehicleModel | None) -> tuple[_Power, list[StateOutcome]]:
    """Return the power the flights tell, else that of the base model."""
    found, outcomes = parts.power, list(parts.power.outcomes)
    if found.is_known:
        return _Power(
            hover=found.hover, cruise=found.cruise, vertical=found.vertical, loads=parts.loads
        ), outcomes
    if base is None or not base.is_power_known:
        return _Power(hover=None, cruise=None, vertical=None, loads=None), outcomes
    return _Power(hover=base.hover, cruise=base.cruise, vertical=base.vertical, loads=base.loads), [
        _of_base(outcome, base) for outcome in outcomes
    ]


def _responses(
    parts: Parts, power: _Power, base: VehicleModel | None, outcomes: list[StateOutcome]
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
) -> Mapping[str, ManoeuvreResponse | None]:
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
    """Return the ramps the flights tell, else those of the base model; add what was found."""
    if parts.ramps is None:
        return None
    ramps, outcome = parts.ramps.ramps, parts.ramps.outcome
    if ramps is None and base is not None and base.ramps is not None:
        ramps, outcome = base.ramps, _of_base(outcome, base)
    outcomes.append(outcome)
    if ramps is None:
        msg = (
            f"the logs tell no references, and the flights not how the vehicle moves ({outcome.said}): "
            "give flights with level legs at several heights, or name a base model with --base"
        )
        raise IdentificationError(msg)
    return ramps


def _refuse_lacking_motion(
    responses: Mapping[str, ManoeuvreResponse | None], outcomes: Sequence[StateOutcome]
) -> None:
    lacking = [o for o in outcomes if o.name in _MOTIONS and responses.get(o.name) is None]
    if lacking:
        why = "; ".join(f"{o.name}: {o.said}" for o in lacking)
        msg = (
            f"the flights do not tell how the vehicle moves ({why}): a model of step references "
            "needs both altitude and speed; fly them, or name a base model with --base"
        )
        raise IdentificationError(msg)


def _air_readings(
    records: Sequence[FlightRecord], settings: IdentificationSettings, parts: Parts
) -> list[str]:
    readings = []
    knows_density = any(f.air_density_kg_m3 is not None for f in parts.steady)
    if settings.temperature_c is None and knows_density:
        readings.append("Air density is that of the standard atmosphere at the altitude flown.")
    if parts.steady and any(not np.isfinite(r.airspeed_m_s).any() for r in records):
        readings.append("The logs tell no wind: the air is taken to have been calm.")
    return readings


def _of_base(outcome: StateOutcome, base: VehicleModel) -> StateOutcome:
    return replace(
        outcome, status=Status.BASE, said=f"taken from {base.name}: {outcome.said}", estimates=()
    )


def _said(
    outcomes: Sequence[StateOutcome], settings: IdentificationSettings, mass_kg: float | None
) -> list[Finding]:
    findings = []
    for outcome in outcomes:
        if outcome.status is Status.LEFT_OUT:
            # how closely an autopilot is followed is told, and predicted with by nobody
            is_beside = settings.reference is not Autopilot.STEP and outcome.name in _MOTIONS
            findings.append(
                STATE_LEFT_OUT.finding(
                    f"{outcome.name}: left out: {outcome.said}",
                    severity=Severity.INFO if is_beside else None,
                )
            )
        elif outcome.status is Status.BASE:
            findings.append(STATE_OF_BASE.finding(f"{outcome.name}: {outcome.said}"))
    if mass_kg is None:
        findings.append(
            MASS_UNKNOWN.finding("no log tells the mass: payload and air density are not modelled")
        )
    fitted = [o.name for o in outcomes if o.status is Status.IDENTIFIED and o.whiteness is not None]
    if settings.method is Method.ARX and fitted:
        findings.append(
            ARX_BIASED.finding(
                f"{', '.join(fitted)}: fitted by ARX alone; noise of the measurement biases the poles"
            )
        )
    return findings


def _vehicles(records: Sequence[FlightRecord]) -> list[Finding]:
    named = {r.vehicle: r.source for r in records if r.vehicle}
    if len(named) < 2:
        return []
    told = ", ".join(f"{source} is of {vehicle}" for vehicle, source in list(named.items())[:3])
    return [VEHICLES_DIFFER.finding(f"{told}: is this one vehicle?")]


def _default_speed_m_s(
    parts: Parts,
    responses: Mapping[str, ManoeuvreResponse | None],
    base: VehicleModel | None,
    reference: Autopilot,
) -> float | None:
    if reference is not Autopilot.STEP:
        return None
    if base is not None and base.default_speed_m_s is not None:
        return base.default_speed_m_s
    if parts.ramps is not None:
        return parts.ramps.default_speed_m_s
    speed = responses["speed"]
    return None if speed is None else speed.identified_speed_m_s
