"""Verification: a recorded flight predicted from its mission alone, as the article's section 3.2."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Self

import numpy as np

from planner.autopilot import Autopilot, Target
from planner.errors import UsageError
from planner.findings import Rule, Severity
from planner.flight.held_items import QueueFlights, route_with_queue
from planner.flight.motion.kinematics import STATES, FlightState
from planner.flight.pilot import flight_parameters, habits_of, make_pilot
from planner.flight.prediction import predict_flight
from planner.identify.flown_mission import (
    BEGUN_IN_AIR,
    BROKEN_OFF_EARLY,
    FLIGHT_CUT,
    MISSION_LEFT,
    cut_record,
    flown_heading_deg,
    flown_home,
    flown_mission,
    flown_position_noise_m,
    flown_wind,
    flown_window,
    lift_off,
    record_parameters,
)
from planner.identify.leant_wind import leant_wind_readings, with_leant_wind
from planner.identify.segments import find_states, smoothed
from planner.logs.record import STEP_S
from planner.mission.route.route import make_route
from planner.physics.wind import Wind
from planner.presented import Shown
from planner.setup import Setup
from planner.units import wh_from_j
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.flight.prediction import Flight
    from planner.identify.flown_mission import FlownWindow
    from planner.identify.log_table import LogConditions
    from planner.identify.segments import StateSegment
    from planner.logs.record import FlightRecord
    from planner.mission.items import Mission
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.files import ParameterSet


_ON_GROUND_M = 0.05
"""Height under which a vehicle that does not climb is on the ground. [m]"""
_TOUCHED_DOWN_M = 2.0
"""Height under which a flight that ends has landed: step responses settle within 1 m. [m]"""
_STILL_M_S = 0.1


def predicted_record(flight: Flight, flown: FlightRecord) -> FlightRecord:
    """Return a predicted flight as the record a logger would make of it.

    Sampled every 0.1 s; what is not predicted is NaN.
    """
    motion = flight.motion
    time_s = np.arange(0.0, flight.time_s, STEP_S)
    state = motion.state_at_time(time_s)
    segment = np.minimum(
        np.searchsorted(motion.segments.end_s, time_s, side="right"),
        len(motion.segments.duration_s) - 1,
    )
    speed = state.ground_speed_m_s
    still = (np.abs(state.climb_m_s) < _STILL_M_S) & (speed < _STILL_M_S)
    is_landed = (np.abs(state.height_m) < _ON_GROUND_M) & still
    # A landing that ends as the flight does, or creeps to its end, leaves no time on the ground.
    is_down = (np.abs(state.height_m) < _TOUCHED_DOWN_M) & still
    is_down[-1] = abs(state.height_m[-1]) < _TOUCHED_DOWN_M
    is_landed |= np.logical_and.accumulate(is_down[::-1])[::-1]
    known = {
        "time_s": time_s,
        "north_m": state.north_m,
        "east_m": state.east_m,
        "height_above_home_m": state.height_m,
        "velocity_north_m_s": state.north_m_s,
        "velocity_east_m_s": state.east_m_s,
        "climb_m_s": state.climb_m_s,
        "ground_speed_m_s": speed,
        "power_w": flight.power_w(time_s),
        "mode": np.full(time_s.size, ""),
        "is_landed": is_landed,
        "mission_item": motion.segments.item[segment],
    }
    unknown = dict.fromkeys(flown.columns(), np.full(time_s.size, np.nan))
    return replace(
        flown, **{**unknown, **known}, duration_s=flight.time_s, quantities=(), findings=()
    )


_LEAST_SPEED_M_S = 1.5
"""Slower is hovering with noise, not flying. [m s⁻¹]"""
_STANDSTILL_M_S = 0.5
_PLATEAU = 0.98
"""A stop begins where the speed falls under this fraction of what it was. [-]"""
_KNEE = 0.9
"""Braking is well under way at this fraction of the speed; noise is not. [-]"""
_SMOOTHING_S = 0.5
"""Noise of a speed counts for little in the mean over so long. [s]"""
_SETTLED_S = 10.0
"""After which a vehicle that stopped swings no more. [s]"""
_STEADY_S = 3.0
"""A speed that has not risen for so long, looking back, is the one braked from. [s]"""


class Stop(Value):
    """A manoeuvre from a horizontal speed to standstill in the air, and the one predicted for it."""

    item: int
    """Mission item flown when it began, from 1; 0 where it is not known."""
    start_s: float
    speed_m_s: float
    """Speed braked from. [m s⁻¹]"""
    measured_m: float
    """Flown from 98 % of that speed to 0.5 m/s. [m]"""
    measured_farthest_m: float | None = None
    """How far it got the way it flew at the beginning, coming back counted: of a vehicle that swings more
    than where it comes to rest. [m]"""
    predicted_m: float | None = None
    """``None`` where none is predicted at this item."""
    predicted_farthest_m: float | None = None
    predicted_speed_m_s: float | None = None


def find_stops(record: FlightRecord) -> tuple[Stop, ...]:
    """Return the stops of a record, in the order flown.

    The speed braked from is the highest looked back to from the standstill until none higher comes
    for 3 s, or the median of the seconds before the knee where that was held; the stop begins where
    98 % of it was flown before the knee.
    """
    window = round(_STEADY_S / record.step_s)
    speed = smoothed(record.ground_speed_m_s, round(_SMOOTHING_S / record.step_s))
    found: list[Stop] = []
    stood = 0
    fast = False
    for at, value in enumerate(speed.tolist()):
        if value >= _LEAST_SPEED_M_S:
            fast = True
        elif value < _STANDSTILL_M_S and not record.is_landed[at]:
            if fast:
                found.append(_stop(record, speed, stood, at, window))
            fast, stood = False, at
    return tuple(found)


def _stop(record: FlightRecord, speed: FloatArray, first: int, end: int, window: int) -> Stop:
    peak = end
    for at in range(end - 1, first - 1, -1):
        if speed[at] > speed[peak]:
            peak = at
        elif peak - at > window and speed[peak] >= _LEAST_SPEED_M_S:
            break
    top = float(speed[peak])
    knee = peak + int(np.flatnonzero(speed[peak : end + 1] >= _KNEE * top)[-1])
    before = speed[max(knee - 2 * window, first) : max(knee - window // 2, first + 1)]
    steady = float(np.median(before))
    if steady >= _KNEE * top:
        # The highest of many noisy samples is higher than the speed that was held.
        top = steady
    start = knee - int(np.argmax(speed[knee::-1] >= _PLATEAU * top))
    braked = record.ground_speed_m_s[start : end + 1]
    return Stop(
        item=int(record.mission_item[start]),
        start_s=float(record.time_s[start]),
        speed_m_s=top,
        measured_m=float(np.trapezoid(braked, record.time_s[start : end + 1])),
        measured_farthest_m=_farthest_m(record, speed, start, end),
    )


def _farthest_m(record: FlightRecord, speed: FloatArray, start: int, end: int) -> float | None:
    """Return how far a stop gets along the velocity it begins with, until the vehicle leaves again."""
    leaves = np.flatnonzero(speed[end:] >= _LEAST_SPEED_M_S)
    until = end + min(
        int(leaves[0]) if leaves.size else speed.size, round(_SETTLED_S / record.step_s)
    )
    north, east = (
        column[start : until + 1] - column[start] for column in (record.north_m, record.east_m)
    )
    ahead = np.array([record.velocity_north_m_s[start], record.velocity_east_m_s[start]])
    along = (ahead[0] * north + ahead[1] * east) / np.hypot(*ahead)
    return float(np.nanmax(along)) if np.isfinite(along).any() else None


_VERTICAL = frozenset(
    (FlightState.TAKEOFF, FlightState.CLIMB, FlightState.DESCEND, FlightState.LAND)
)
_STEADY = frozenset((FlightState.HOVER, FlightState.CRUISE))


class StateComparison(Value):
    """Everything flown in one state, against everything predicted in it."""

    state: FlightState
    count: int
    """Times it was flown."""
    predicted_count: int
    time_s: float
    predicted_time_s: float
    energy_wh: float | None
    predicted_energy_wh: float | None
    fit_percent: float | None
    """Of ``fit_of``, each item's flight laid on the moment it began; of a steady state, where there
    is no change to describe, relative to the value itself. [%]"""
    fit_of: str | None
    """Column of the record that is fitted: height, speed, or power in hover."""

    @property
    def energy_fraction(self) -> float | None:
        """Predicted energy over flown energy, less one. [-]"""
        if not self.energy_wh or self.predicted_energy_wh is None:
            return None
        return self.predicted_energy_wh / self.energy_wh - 1.0


def energy_wh(record: FlightRecord, part: slice = slice(None)) -> float | None:
    """Return the energy of part of a record: trapezoids over the power that is known. [Wh]"""
    power_w, time_s = record.power_w[part], record.time_s[part]
    known = np.isfinite(power_w)
    if known.sum() < 2:
        return None
    return wh_from_j(float(np.trapezoid(power_w[known], time_s[known])))


def track_length_m(record: FlightRecord) -> float | None:
    """Return the horizontal length of the track, ``None`` where no position is known. [m]"""
    known = np.isfinite(record.north_m) & np.isfinite(record.east_m)
    if known.sum() < 2:
        return None
    north, east = np.diff(record.north_m[known]), np.diff(record.east_m[known])
    return float(np.hypot(north, east).sum())


def predicted_times_s(flown: FlightRecord, predicted: FlightRecord) -> FloatArray:
    """Return the time of the prediction that each sample of a flight is compared with.

    Each item's flight is laid on the moment it was begun, so that a second lost early is not counted
    again ever after; where an item took longer than predicted, its end is held.

    (n,), not falling within an item. [s]
    """
    anchors = [(0.0, 0.0), *begun_in_both(flown, predicted, (0.0, 0.0))]
    starts, origins = (np.array(column) for column in zip(*anchors, strict=True))
    ends = np.append(origins[1:], predicted.time_s[-1])
    leg = np.searchsorted(starts, flown.time_s, side="right") - 1
    own_s: FloatArray = np.minimum(origins[leg] + flown.time_s - starts[leg], ends[leg])
    return own_s


def items_begun(record: FlightRecord) -> dict[tuple[int, int], float]:
    """Return when each item was begun, by its number and how often it had been."""
    items = record.mission_item
    changes = np.flatnonzero(np.diff(items, prepend=0))
    begun: dict[tuple[int, int], float] = {}
    times: Counter[int] = Counter()
    for at in changes.tolist():
        number = int(items[at])
        if number:
            times[number] += 1
            begun[number, times[number]] = float(record.time_s[at])
    return begun


def begun_in_both(
    flown: FlightRecord, predicted: FlightRecord, after_s: tuple[float, float]
) -> list[tuple[float, float]]:
    """Return when each item was begun that a flight and its prediction both begin after given times. [s]"""
    begun, foreseen = items_begun(flown), items_begun(predicted)
    found: list[tuple[float, float]] = []
    for key, at_s in begun.items():
        last = found[-1] if found else after_s
        if key in foreseen and at_s > last[0] and foreseen[key] > last[1]:
            found.append((at_s, foreseen[key]))
    return found


class PartTime(Value):
    """How long part of a flight took, and was predicted to take."""

    part: str
    """One of ``PARTS``."""
    time_s: float
    predicted_time_s: float


PARTS = ("first item", "items between", "last item")


def compare_parts(flown: FlightRecord, predicted: FlightRecord) -> tuple[PartTime, ...]:
    """Return where a flight lost or gained time, none where it cannot be divided by its items."""
    cuts = begun_in_both(flown, predicted, (0.0, 0.0))
    if not cuts:
        return ()
    ends = [(0.0, 0.0), cuts[0], cuts[-1], (flown.duration_s, predicted.duration_s)]
    return tuple(
        PartTime(part=part, time_s=end[0] - start[0], predicted_time_s=end[1] - start[1])
        for part, start, end in zip(PARTS, ends[:-1], ends[1:], strict=True)
        if end != start
    )


def compare_states(flown: FlightRecord, predicted: FlightRecord) -> tuple[StateComparison, ...]:
    """Return a row for every state that was flown or predicted, in the order of the states.

    Of a log that never has the vehicle landed, take-offs and landings are told from climbs in neither.
    """
    if not flown.is_landed.any():
        predicted = replace(predicted, is_landed=flown.is_landed[:1].repeat(predicted.time_s.size))
    segments, foreseen = (find_states(record, as_of=flown) for record in (flown, predicted))
    at_s = predicted_times_s(flown, predicted)
    rows = []
    for state in STATES:
        own = [segment for segment in segments if segment.state is state]
        other = [segment for segment in foreseen if segment.state is state]
        if own or other:
            fit, fit_of = _fit(state, own, flown, predicted, at_s)
            rows.append(
                StateComparison(
                    state=state,
                    count=len(own),
                    predicted_count=len(other),
                    time_s=sum(segment.duration_s for segment in own),
                    predicted_time_s=sum(segment.duration_s for segment in other),
                    energy_wh=_sum_wh(flown, own),
                    predicted_energy_wh=_sum_wh(predicted, other),
                    fit_percent=fit,
                    fit_of=fit_of,
                )
            )
    return tuple(rows)


def _sum_wh(record: FlightRecord, segments: Sequence[StateSegment]) -> float | None:
    """Return the energy of spans, each up to the first sample of what follows."""
    if not np.isfinite(record.power_w).any():
        return None
    parts = (
        energy_wh(record, slice(segment.first, segment.end + 1)) or 0.0 for segment in segments
    )
    return sum(parts)


def _fit(
    state: FlightState,
    segments: Sequence[StateSegment],
    flown: FlightRecord,
    predicted: FlightRecord,
    at_s: FloatArray,
) -> tuple[float | None, str | None]:
    """Return the fit over all spans of a state, each about its own mean, and its column."""
    column = "ground_speed_m_s"
    if state in _VERTICAL:
        column = "height_above_home_m"
    elif state is FlightState.HOVER:
        column = "power_w"
    error, spread = 0.0, 0.0
    for segment in segments:
        measured = getattr(flown, column)[segment.samples]
        expected = np.interp(at_s[segment.samples], predicted.time_s, getattr(predicted, column))
        known = np.isfinite(measured) & np.isfinite(expected)
        measured, expected = measured[known], expected[known]
        if measured.size:
            level = 0.0 if state in _STEADY else measured.mean()
            error += float(np.sum((measured - expected) ** 2))
            spread += float(np.sum((measured - level) ** 2))
    if spread == 0.0:
        return None, None
    return 100.0 * (1.0 - float(np.sqrt(error / spread))), column


def compare_stops(flown: FlightRecord, predicted: FlightRecord) -> tuple[Stop, ...]:
    """Return the stops flown, each with the first one predicted at the same item, in order.

    Where as many are predicted as were flown, they are paired by their order.
    """
    stops, foreseen = find_stops(flown), list(find_stops(predicted))
    is_in_order = len(stops) == len(foreseen)
    rows = []
    for stop in stops:
        same = (one for one in foreseen if is_in_order or (one.item == stop.item and stop.item))
        expected = next(same, None)
        if expected is None:
            rows.append(stop)
            continue
        foreseen.remove(expected)
        rows.append(
            replace(
                stop,
                predicted_m=expected.measured_m,
                predicted_farthest_m=expected.measured_farthest_m,
                predicted_speed_m_s=expected.speed_m_s,
            )
        )
    return tuple(rows)


def rms_difference(
    flown: FlightRecord, predicted: FlightRecord, column: str, at_s: FloatArray
) -> float | None:
    """Return the root mean square difference of a column in the air. [unit of the column]"""
    measured = getattr(flown, column)
    expected = np.interp(at_s, predicted.time_s, getattr(predicted, column))
    known = np.isfinite(measured) & np.isfinite(expected) & ~flown.is_landed
    if not known.any():
        return None
    return float(np.sqrt(np.mean((measured[known] - expected[known]) ** 2)))


_LEAST_RECORDED = 0.5
"""Fraction of the predicted time up to which a flight is to be recorded to tell of whole flights. [-]"""
_WHOLE = 0.95
"""Fraction of the flight the power is known for, under which the energy is doubtful. [-]"""


class KnownConditions(Value):
    """What the user states of the flights; ``None``: as in the log."""

    mission: Mission | None = None
    parameters: ParameterSet | None = None
    wind: Wind | None = None
    home_amsl_m: float | None = None
    temperature_c: float | None = None
    payload_kg: float = 0.0
    position_noise_m: float | None = None

    def beside(self, own: LogConditions, vehicle: VehicleModel) -> Self:
        """Return these with what is known of one log, whose mass is the model's where it has none.

        Raises UsageError if it is lighter than the model.
        """
        payload_kg = self.payload_kg if own.payload_kg is None else own.payload_kg
        if own.mass_kg is not None and vehicle.mass_kg is not None:
            payload_kg += own.mass_kg - vehicle.mass_kg
            if payload_kg < 0.0:
                msg = (
                    f"{own.log}: {own.mass_kg:g} kg are less than the {vehicle.mass_kg:g} kg of "
                    f"{vehicle.name}: verify with a model of this vehicle"
                )
                raise UsageError(msg)
        temperature_c = self.temperature_c if own.temperature_c is None else own.temperature_c
        return replace(self, payload_kg=payload_kg, temperature_c=temperature_c)


class Figures(Value):
    """What a flight took."""

    time_s: float
    energy_wh: float | None
    """``None`` where no power was measured, or none can be predicted. [Wh]"""
    distance_m: float | None
    """Horizontal length of the track. [m]"""


NOT_FLOWN = frozenset((MISSION_LEFT.code, BEGUN_IN_AIR.code, BROKEN_OFF_EARLY.code))
"""Findings of flights that were not flown, or not recorded, by their mission: their errors are not the
model's."""


class Verification(Shown):
    """A flight as it was flown and as it was predicted."""

    log: str
    flight: int
    """Which flight of its log, from 1."""
    vehicle_name: str
    mission: str
    """Where the mission comes from."""
    parameters: str | None
    """Where the autopilot's parameters come from; ``None``: the model's own."""
    setup: Setup
    measured: Figures
    predicted: Figures
    cut_before_s: float
    """Time armed before the mission that is not compared. [s]"""
    cut_after_s: float
    """Time armed after the mission, or after what both begin of one broken off, that is not compared. [s]"""
    parts: tuple[PartTime, ...]
    states: tuple[StateComparison, ...]
    stops: tuple[Stop, ...]
    height_rms_m: float | None
    """Root mean square error of the height in the air, items laid on their beginnings. [m]"""
    speed_rms_m_s: float | None
    power_rms_w: float | None
    findings: tuple[Finding, ...]
    flown: FlightRecord
    """The flight, cut to what is compared."""
    foreseen: FlightRecord
    """The prediction in the same form."""
    breaks_off: bool = False
    """Whether the log ends in the air before the mission does: both end where their last item begins."""

    @property
    def is_of_mission(self) -> bool:
        """Whether what was flown is what the mission asks for, from the ground on, and was recorded."""
        return not any(finding.code in NOT_FLOWN for finding in self.findings)

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

    Nothing of how it was flown enters the prediction.

    Raises LogFileError if there is no mission to predict it from.
    Raises MissionFileError if the mission cannot be predicted.
    Raises UsageError if the model cannot be flown by the autopilot of the log, or nothing is flown.
    """
    home = flown_home(record)
    mission = known.mission or flown_mission(record)
    mission = mission if home is None else replace(mission, home=home)
    flown_by = _flown_by(record, vehicle)
    given = known.parameters or (None if flown_by is Autopilot.STEP else record_parameters(record))
    if record.autopilot not in {None, flown_by} and flown_by is not Autopilot.STEP:
        msg = (
            f"{record.source}: was flown by {record.autopilot.label if record.autopilot else ''}, "
            f"but {vehicle.name} answers {flown_by.label}: verify with a model of the same autopilot"
        )
        raise UsageError(msg)
    setup, assumed = _setup(record, vehicle, given, known)
    if flown_by is not vehicle.reference:
        setup = replace(setup, autopilot=flown_by)
    flown_with, findings = flight_parameters(setup)
    target = None if given is None or given.stack is None else Target(given.stack, given.version)
    pilot = make_pilot(setup, flown_with)
    route = route_with_queue(
        mission,
        lambda firings: make_route(
            mission,
            dialect=mission.autopilot if flown_by is Autopilot.STEP else flown_by,
            home_amsl_m=setup.home_amsl_m,
            firings=firings,
            habits=habits_of(flown_with, target),
        ),
        QueueFlights(pilots=(pilot,)),
    )
    if not route.stages:
        msg = f"{mission.source}: the mission holds no flight to compare with"
        raise UsageError(msg)
    flight = predict_flight(route, setup, pilot)
    window = flown_window(record, mission, route)
    foreseen = predicted_record(flight, window.flown)
    left_out_wh, distance_m = 0.0, float(flight.motion.segments.distance_m.sum())
    if window.is_begun_running:
        waited = max(lift_off(foreseen) - lift_off(window.flown), 0)
        left_out_wh = energy_wh(foreseen, slice(waited + 1)) or 0.0
        foreseen = cut_record(foreseen, waited, foreseen.time_s.size)
    if window.breaks_off:
        whole = foreseen
        window, foreseen = _up_to_last_begun(window, foreseen)
        left_out_wh += energy_wh(whole, slice(foreseen.time_s.size - 1, None)) or 0.0
        distance_m = track_length_m(foreseen) or 0.0
    at_s = predicted_times_s(window.flown, foreseen)
    if not vehicle.is_power_known:
        foreseen = replace(foreseen, power_w=np.full(foreseen.time_s.size, np.nan))
    return Verification(
        log=record.source,
        flight=record.number,
        vehicle_name=vehicle.name,
        mission=mission.source,
        parameters=None if given is None else given.source,
        setup=setup,
        measured=Figures(
            time_s=window.flown.duration_s,
            energy_wh=energy_wh(window.flown),
            distance_m=track_length_m(window.flown),
        ),
        predicted=Figures(
            time_s=foreseen.duration_s,
            energy_wh=wh_from_j(flight.energy_j) - left_out_wh if vehicle.is_power_known else None,
            distance_m=distance_m + flight.motion.wander_m * foreseen.duration_s / flight.time_s,
        ),
        cut_before_s=window.before_s,
        cut_after_s=window.after_s,
        parts=compare_parts(window.flown, foreseen),
        states=compare_states(window.flown, foreseen),
        stops=compare_stops(window.flown, foreseen),
        height_rms_m=rms_difference(window.flown, foreseen, "height_above_home_m", at_s),
        speed_rms_m_s=rms_difference(window.flown, foreseen, "ground_speed_m_s", at_s),
        power_rms_w=rms_difference(window.flown, foreseen, "power_w", at_s),
        findings=(
            *record.findings,
            *window.findings,
            *_energy_findings(window.flown),
            *_firmware_findings(record, given),
            *assumed,
            *mission.findings,
            *route.findings,
            *flight.motion.findings,
            *findings,
        ),
        flown=window.flown,
        foreseen=foreseen,
        breaks_off=window.breaks_off,
    )


def _up_to_last_begun(
    window: FlownWindow, foreseen: FlightRecord
) -> tuple[FlownWindow, FlightRecord]:
    """Return a flight that breaks off and its prediction up to the last item that both begin in the air.

    What was not recorded is no error of the prediction.  Both as they are where they begin none.
    """
    flown, whole_s = window.flown, foreseen.duration_s
    left_ground_s = float(flown.time_s[lift_off(flown)]), float(foreseen.time_s[lift_off(foreseen)])
    begun = begun_in_both(flown, foreseen, left_ground_s)
    findings = list(window.findings)
    after_s = window.after_s
    if begun:
        flown, foreseen = (
            replace(cut_record(one, 0, int(np.searchsorted(one.time_s, at_s)) + 1), duration_s=at_s)
            for one, at_s in zip((flown, foreseen), begun[-1], strict=True)
        )
        left_out_s = window.flown.duration_s - flown.duration_s
        after_s += left_out_s
        message = (
            f"{flown.source}: the log breaks off in the air: compared up to where item "
            f"{flown.mission_item[-1]} begins, {left_out_s:.1f} s from there on are left out"
        )
        findings.append(FLIGHT_CUT.finding(message))
    compared_s = begun[-1][1] if begun else 0.0
    if compared_s < _LEAST_RECORDED * whole_s:
        message = (
            f"{flown.source}: the log breaks off in the air: {compared_s:.1f} of {whole_s:.1f} s predicted "
            "can be compared"
        )
        findings.append(BROKEN_OFF_EARLY.finding(message))
    return replace(window, flown=flown, after_s=after_s, findings=tuple(findings)), foreseen


def _flown_by(record: FlightRecord, vehicle: VehicleModel) -> Autopilot:
    """Return who flies a prediction: the log's autopilot where the model only assumes its own."""
    if vehicle.reference_assumed and record.autopilot is not None:
        return record.autopilot
    return vehicle.reference


CONDITIONS_ASSUMED = Rule(
    "R204 conditions-assumed",
    Severity.INFO,
    summary="A log does not hold the conditions of its flight.",
    why="Wind and density of the air change the power; an error may be theirs, not the model's.",
    how="The log holds no wind, or no altitude of home, and none was given; a wind that the lean of the "
    "vehicle shows, by three standard errors and 1 m/s, is counted.",
    fix="give --wind or --home-amsl",
)


def _setup(
    record: FlightRecord,
    vehicle: VehicleModel,
    parameters: ParameterSet | None,
    known: KnownConditions,
) -> tuple[Setup, list[Finding]]:
    """Return what is known of the air, and what had to be assumed."""
    wind, home_amsl_m, noise_m = known.wind, known.home_amsl_m, known.position_noise_m
    messages: list[str] = []
    if wind is None:
        record = with_leant_wind(record)
        wind = flown_wind(record)
        messages += [] if wind is None else leant_wind_readings([record])
    home_amsl_m = record.home.altitude_amsl_m if home_amsl_m is None else home_amsl_m
    setup = Setup(
        vehicle,
        parameters=parameters,
        wind=wind or Wind(),
        home_amsl_m=home_amsl_m,
        temperature_c=known.temperature_c,
        payload_kg=known.payload_kg,
        position_noise_m=flown_position_noise_m(record) if noise_m is None else noise_m,
        heading_deg=flown_heading_deg(record),
    )
    assumed = ["wind in the log: calm assumed"] if wind is None else []
    assumed += ["altitude of home in the log"] if home_amsl_m is None else []
    if assumed:
        messages.append(f"{record.source}: no {' and no '.join(assumed)}")
    return setup, [CONDITIONS_ASSUMED.finding(message) for message in messages]


FIRMWARE_OLDER = Rule(
    "R208 firmware-older",
    Severity.WARNING,
    summary="A flight of firmware older than the one that is predicted.",
    why="Before 4.1 ArduCopter flew without S-curves: without a limit of jerk, and through each waypoint "
    "without delay, the one before a landing too.  Against that of 4.1 five runs of 3.5.7 over 100 m at "
    "5 m/s took 5.2 to 6.8 s less for their legs and 0.6 to 1.3 s less to take off, and 0.3 to 2.0 s more "
    "to land from 5 m/s, one 7.6 s.  Its errors are not the model's.",
    how="The log names a version of ArduCopter before 4.1; predictions are of 4.1 and later.",
    fix="verify with flights of the firmware that is to be predicted",
)
_S_CURVES = (4, 1)


def _firmware_findings(record: FlightRecord, given: ParameterSet | None) -> list[Finding]:
    version = None if given is None else given.version
    if record.autopilot is not Autopilot.ARDUPILOT or version is None or version >= _S_CURVES:
        return []
    message = f"{record.source}: flown by {record.firmware}, predicted as 4.1 and later fly"
    return [FIRMWARE_OLDER.finding(message)]


ENERGY_IN_PART = Rule(
    "R203 energy-measured-in-part",
    Severity.WARNING,
    summary="Power was not measured throughout a flight.",
    why="The energy over a gap is a straight line between its ends, whatever was flown there.",
    how="Power was measured for less than 95 % of the flight.",
    fix="compare energies of other flights",
)


def _energy_findings(flown: FlightRecord) -> list[Finding]:
    fraction = float(np.isfinite(flown.power_w).mean())
    if not 0.0 < fraction < _WHOLE:
        return []
    message = f"{flown.source}: power is known for {100.0 * fraction:.0f} % of the flight"
    return [ENERGY_IN_PART.finding(message)]
