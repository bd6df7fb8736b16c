"""Verification: a recorded flight predicted from its mission alone, as the article's section 3.2."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.catalogue.verification import CONDITIONS_ASSUMED, ENERGY_IN_PART
from planner.errors import UsageError
from planner.flight.conditions import Conditions
from planner.flight.pilot import flight_parameters, make_pilot
from planner.flight.prediction import predict_flight
from planner.identify.comparison import (
    compare_states,
    compare_stops,
    energy_wh,
    predicted_times_s,
    rms_difference,
    track_length_m,
)
from planner.identify.flown_mission import (
    flown_home,
    flown_mission,
    flown_parameters,
    flown_position_noise_m,
    flown_wind,
)
from planner.identify.flown_window import flown_window
from planner.identify.predicted_record import predicted_record
from planner.mission.route import make_route
from planner.physics.wind import Wind
from planner.units import wh_from_j

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.flight.prediction import Flight
    from planner.identify.comparison import StateComparison, StopComparison
    from planner.logs.record import FlightRecord
    from planner.mission.items import Mission
    from planner.mission.stage import Route
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.files import ParameterSet

_WHOLE = 0.95
"""Share of the flight the power is known for, under which the energy is doubtful. [-]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownConditions:
    """What the user says of the flights; ``None``: as the log tells."""

    mission: Mission | None = None
    parameters: ParameterSet | None = None
    wind: Wind | None = None
    home_amsl_m: float | None = None
    temperature_c: float | None = None
    payload_kg: float = 0.0
    position_noise_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """What a flight took."""

    time_s: float
    energy_wh: float | None
    """``None`` where no power was measured, or none can be predicted. [Wh]"""
    distance_m: float | None
    """Horizontal length of the track. [m]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """A flight as it was flown and as it was predicted."""

    log: str
    flight: int
    """Which flight of its log, from 1."""
    vehicle_name: str
    mission: str
    """Where the mission comes from."""
    parameters: str | None
    """Where the autopilot's parameters come from; ``None``: the model's own."""
    conditions: Conditions
    measured: Figures
    predicted: Figures
    cut_before_s: float
    """Time armed before the mission that is not compared. [s]"""
    cut_after_s: float
    """Time armed after the mission that is not compared. [s]"""
    states: tuple[StateComparison, ...]
    stops: tuple[StopComparison, ...]
    height_rms_m: float | None
    """Root mean square error of the height in the air, items laid on their beginnings. [m]"""
    speed_rms_m_s: float | None
    power_rms_w: float | None
    findings: tuple[Finding, ...]
    flown: FlightRecord
    """The flight, cut to what is compared."""
    foreseen: FlightRecord
    """The prediction in the same form."""

    @property
    def time_fraction(self) -> float:
        """Predicted time over flown time, less one. [-]"""
        return self.predicted.time_s / self.measured.time_s - 1.0

    @property
    def energy_fraction(self) -> float | None:
        """Predicted energy over measured energy, less one. [-]"""
        if not self.measured.energy_wh or self.predicted.energy_wh is None:
            return None
        return self.predicted.energy_wh / self.measured.energy_wh - 1.0


def verify_flight(
    record: FlightRecord, vehicle: VehicleModel, known: KnownConditions
) -> Verification:
    """Predict a recorded flight from its mission, parameters and conditions, and compare.

    Parameters
    ----------
    record : FlightRecord
        The flight; nothing of how it was flown enters the prediction.
    vehicle : VehicleModel
        The model to verify.
    known : KnownConditions
        What the log does not tell, or tells wrongly.

    Returns
    -------
    Verification
        Errors of time and energy, of the states and the stops.

    Raises
    ------
    LogFileError
        If there is no mission to predict it from.
    MissionFileError
        If the mission cannot be predicted.
    UsageError
        If the model cannot be flown by the autopilot of the log, or nothing is flown.
    """
    mission = _mission(record, known)
    flown_by = vehicle.reference
    given = known.parameters or (None if flown_by is Autopilot.STEP else flown_parameters(record))
    if record.autopilot not in {None, flown_by} and flown_by is not Autopilot.STEP:
        msg = (
            f"{record.source}: was flown by {record.autopilot.label if record.autopilot else ''}, "
            f"but {vehicle.name} answers {flown_by.label}: verify with a model of the same autopilot"
        )
        raise UsageError(msg)
    flown_with, findings = flight_parameters(vehicle, flown_by, given)
    conditions, assumed = _conditions(record, known)
    route = make_route(
        mission,
        meaning=mission.autopilot if flown_by is Autopilot.STEP else flown_by,
        home_amsl_m=conditions.home_amsl_m,
    )
    if not route.stages:
        msg = f"{mission.source}: the mission holds no flight to compare with"
        raise UsageError(msg)
    pilot = make_pilot(vehicle, flown_with, conditions)
    flight = predict_flight(route, vehicle, conditions, pilot)
    window = flown_window(record, mission, route)
    foreseen = predicted_record(flight, window.flown)
    at_s = predicted_times_s(window.flown, foreseen)
    has_power = vehicle.is_power_known
    if not has_power:
        foreseen = replace(foreseen, power_w=np.full(foreseen.time_s.size, np.nan))
    return Verification(
        log=record.source,
        flight=record.number,
        vehicle_name=vehicle.name,
        mission=mission.source,
        parameters=None if given is None else given.source,
        conditions=conditions,
        measured=Figures(
            time_s=window.flown.duration_s,
            energy_wh=energy_wh(window.flown),
            distance_m=track_length_m(window.flown),
        ),
        predicted=_predicted(flight, has_power=has_power),
        cut_before_s=window.before_s,
        cut_after_s=window.after_s,
        states=compare_states(window.flown, foreseen),
        stops=compare_stops(window.flown, foreseen),
        height_rms_m=rms_difference(window.flown, foreseen, "height_above_home_m", at_s),
        speed_rms_m_s=rms_difference(window.flown, foreseen, "ground_speed_m_s", at_s),
        power_rms_w=rms_difference(window.flown, foreseen, "power_w", at_s),
        findings=(
            *record.findings,
            *window.findings,
            *_energy_findings(window.flown),
            *assumed,
            *_said_of(mission, route, flight),
            *findings,
        ),
        flown=window.flown,
        foreseen=foreseen,
    )


def _mission(record: FlightRecord, known: KnownConditions) -> Mission:
    if known.mission is None:
        return flown_mission(record)
    home = flown_home(record)
    return known.mission if home is None else replace(known.mission, home=home)


def _conditions(record: FlightRecord, known: KnownConditions) -> tuple[Conditions, list[Finding]]:
    """Return what is known of the air, and what had to be assumed."""
    wind = known.wind or flown_wind(record)
    home_amsl_m = known.home_amsl_m
    if home_amsl_m is None:
        home_amsl_m = record.home.altitude_amsl_m
    assumed = [
        text
        for text, value in (("wind: calm is assumed", wind), ("altitude of home", home_amsl_m))
        if value is None
    ]
    conditions = Conditions(
        wind=wind or Wind(),
        home_amsl_m=home_amsl_m,
        temperature_c=known.temperature_c,
        payload_kg=known.payload_kg,
        position_noise_m=(
            flown_position_noise_m(record)
            if known.position_noise_m is None
            else known.position_noise_m
        ),
    )
    message = f"{record.source}: the log tells no {', and no '.join(assumed)}"
    return conditions, [CONDITIONS_ASSUMED.finding(message)] if assumed else []


def _predicted(flight: Flight, *, has_power: bool) -> Figures:
    return Figures(
        time_s=flight.time_s,
        energy_wh=wh_from_j(flight.energy_j) if has_power else None,
        distance_m=float(flight.motion.segments.distance_m.sum()) + flight.motion.wander_m,
    )


def _energy_findings(flown: FlightRecord) -> list[Finding]:
    share = float(np.isfinite(flown.power_w).mean())
    if not 0.0 < share < _WHOLE:
        return []
    message = f"{flown.source}: power is known for {100.0 * share:.0f} % of the flight"
    return [ENERGY_IN_PART.finding(message)]


def _said_of(mission: Mission, route: Route, flight: Flight) -> tuple[Finding, ...]:
    return (*mission.findings, *route.findings, *flight.motion.findings)
