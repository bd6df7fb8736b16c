"""The energy of a vehicle in flight: what is left against what it takes to finish and to return."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.returns.tightest import sweep_returns
from planner.link.telemetry import BatteryState
from planner.physics.battery import BatteryCircuit
from planner.values import Value, replace
from planner.vehicle.pack import rest_curve

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.flight.returns.path import Returns
    from planner.link.telemetry import Telemetry, VehicleIdentity, VehiclePosition, VehicleState
    from planner.vehicle.battery import Battery


_SAMPLES = 400
"""Points looked at along what is flown for one item. [-]"""
_CLOCK_M_S = 0.1
"""A second by the clock counts as much as this distance: it only separates similar places. [m s⁻¹]"""
_BACK_S = 3.0
"""A place may turn out to be so much earlier than the one before. [s]"""


class Progress(Value):
    """A place on a predicted flight, and the energy of what is ahead, by the model."""

    item: int
    time_s: float
    """Of the predicted flight. [s]"""
    off_track_m: float
    """From the nearest place of the predicted flight. [m]"""
    used_wh: float
    """Energy of the predicted flight until here. [Wh]"""
    finish_wh: float
    """Energy from here to the end, back onto the track included. [Wh]"""
    return_wh: float
    """Energy to stop, return to where the vehicle itself would, and land. [Wh]"""
    return_s: float
    destination: int
    """0 for home, n for rally point n, below 0 as in `planner.flight.returns.destination`."""


def flight_progress(
    returns: Returns,
    item: int,
    place: VehiclePosition,
    *,
    before: Progress | None = None,
    elapsed_s: float = 0.0,
) -> Progress:
    """Return where on a predicted flight a vehicle is, which flies to an item, from 1.

    The nearest of points along what is flown for the item: among places that are alike, as in a hover,
    the one that fits the time elapsed since the progress before, else the earliest; a lap that is over
    does not come again.  The way back onto the track costs as much a metre as the whole flight does on
    the mean.
    """
    route, flight = returns.route, returns.flight
    east, north = route.frame.east_north_m([place.latitude_deg], [place.longitude_deg])
    place_m = np.array([float(east[0]), float(north[0]), place.height_above_home_m])
    after_s = 0.0 if before is None else max(before.time_s - _BACK_S, 0.0)
    begin_s, end_s = _window(returns, item, after_s)
    time_s = np.linspace(begin_s, end_s, _SAMPLES)
    state = flight.motion.state_at_time(time_s)
    along_m = state.place_m
    away_m = np.sqrt(np.square(along_m - place_m).sum(axis=1))
    fits_s = begin_s if before is None else before.time_s + elapsed_s
    at = int(np.argmin(np.square(away_m) + np.square(_CLOCK_M_S * (time_s - fits_s))))
    segment, fraction = returns.at(time_s[at : at + 1])
    points = returns.points(segment, fraction)
    # The vehicle stops and turns back where it is, not where the prediction has it.
    stand_m = points.stop_m - points.place_m + place_m
    chosen = returns.destinations.chosen(place_m[None, :], points.stage)
    return_s, return_wh = returns.fly(stand_m, points.stage, chosen)
    length_m = float(flight.motion.segments.distance_m.sum())
    total_wh, used_wh = float(returns.used_wh[-1]), float(points.used_wh[0])
    off_m = float(away_m[at])
    back_wh = off_m * total_wh / length_m if length_m > 0.0 else 0.0
    return Progress(
        item=item,
        time_s=float(time_s[at]),
        off_track_m=off_m,
        used_wh=used_wh,
        finish_wh=total_wh - used_wh + back_wh,
        return_wh=float(points.stop_wh[0] + return_wh[0]),
        return_s=float(points.stop_s[0] + return_s[0]),
        destination=int(chosen[0]),
    )


def _window(returns: Returns, item: int, after_s: float) -> tuple[float, float]:
    """Return from when to when an item is flown for the next time [s]."""
    items = np.array([stage.item for stage in returns.route.stages])[returns.segment_stage]
    end_s = returns.start_s + returns.flight.motion.segments.duration_s
    ahead = end_s > after_s
    same = np.flatnonzero(ahead & (items == item))
    if not len(same):  # an item that only sets something: what is flown next
        same = np.flatnonzero(ahead & (items > item))
    if not len(same):
        return min(after_s, float(end_s[-1])), float(end_s[-1])
    first = int(same[0])
    last = first
    while last + 1 < len(items) and items[last + 1] == items[first]:
        last += 1
    return max(float(returns.start_s[first]), after_s), float(end_s[last])


_STEP = 0.01
"""Batteries report their charge in whole percent. [-]"""


class EnergyLeft(Value):
    """Energy that a battery still gives, and by which measurement."""

    energy_wh: float
    source: str
    """Which measurement was trusted: the one that leaves least."""
    by_source: tuple[tuple[str, float], ...]
    """What each measurement leaves. [Wh]"""
    step_wh: float
    """Resolution of the trusted one. [Wh]"""

    @property
    def spread_wh(self) -> float:
        """How far the measurements are apart [Wh]."""
        left_wh = [one for _, one in self.by_source]
        return max(left_wh) - min(left_wh)


class BatteryMeter:
    """Turns readings into energies, from what the prediction starts with at a first reading."""

    def __init__(self, prediction: Prediction, start: BatteryState) -> None:
        self._battery = prediction.battery
        self._charge = prediction.charge
        self._usable_wh = prediction.usable_wh
        self._resistance_ohm = prediction.battery.resistance_ohm(prediction.temperature_c)
        self._start = start
        self._over = max((start.remaining_fraction or 0.0) - prediction.charge, 0.0)
        """What the vehicle's percentage counts from is above the charge by so much. [-]"""

    def energy_left(self, reading: BatteryState) -> EnergyLeft | None:
        """Return the energy left by a reading; ``None`` where it holds nothing.

        Counts of energy and of charge, and the vehicle's own percentage, are compared, and the least is
        taken.  The voltage is imprecise on a flat curve: it is used only where there is no other.
        """
        step_wh = self._usable_wh - self._at(self._charge - _STEP)
        found: list[tuple[str, float, float]] = []
        start = self._start
        if reading.consumed_wh is not None and start.consumed_wh is not None:
            left_wh = self._usable_wh - (reading.consumed_wh - start.consumed_wh)
            found.append(("energy count", left_wh, 0.0))
        capacity_ah = self._battery.charge_ah
        if (
            reading.consumed_ah is not None
            and start.consumed_ah is not None
            and capacity_ah is not None
        ):
            taken = (reading.consumed_ah - start.consumed_ah) / capacity_ah
            found.append(("charge count", self._at(self._charge - taken), 0.0))
        if reading.remaining_fraction is not None:
            left_wh = self._at(reading.remaining_fraction - self._over)
            found.append(("the vehicle's percentage", left_wh, step_wh))
        if not found:
            fraction = self._voltage_fraction(reading)
            if fraction is None:
                return None
            found.append(("voltage", self._at(fraction), 5.0 * step_wh))
        source, energy_wh, uncertain_wh = min(found, key=lambda one: one[1])
        return EnergyLeft(
            energy_wh=max(energy_wh, 0.0),
            source=source,
            by_source=tuple((name, left_wh) for name, left_wh, _ in found),
            step_wh=uncertain_wh,
        )

    def _at(self, fraction: float) -> float:
        """Return the energy left at a state of charge, of what was usable at the start [Wh]."""
        if self._charge <= 0.0 or fraction <= 0.0:
            return 0.0
        curve_soc, curve_v = self._battery.ocv_soc, self._battery.ocv_v
        if curve_soc is None or curve_v is None:
            return self._usable_wh * fraction / self._charge
        # What stays below the cut-off is as much now as at the start.
        circuit = BatteryCircuit(
            capacity_ah=self._battery.charge_ah or 1.0, ocv_soc=curve_soc, ocv_v=curve_v
        )
        taken_wh = [
            circuit.delivered_wh(0.0, one, 0.0) for one in (self._charge, min(fraction, 1.0))
        ]
        if self._battery.charge_ah is None:
            return self._usable_wh * taken_wh[1] / taken_wh[0]
        return max(self._usable_wh - (taken_wh[0] - taken_wh[1]), 0.0)

    def _voltage_fraction(self, reading: BatteryState) -> float | None:
        curve = rest_curve(self._battery)
        if reading.voltage_v is None or curve is None:
            return None
        sag_v = (self._resistance_ohm or 0.0) * (reading.current_a or 0.0)
        return float(np.interp(reading.voltage_v + sag_v, curve.voltage_v, curve.state_of_charge))


_LEAST_USED = 0.1
"""Fraction of the flight's energy after which the measurement is compared with the model. [-]"""
_STEPS_USED = 8.0
"""So many of the steps of the measurement have to be used by then. [-]"""
_DIFFERENCE = 0.1
"""Measurements that leave energies so different are not of the battery that was checked. [-]"""
_CALM_FACTOR = 1.5
"""A warning is over when so many times the lead is there again. [-]"""


class Concern(StrEnum):
    """What is wrong with the energy of a flight."""

    RETURN_SOON = "return-soon"
    """The point of no return is near."""
    NO_RETURN = "no-return"
    """A return uses part of the reserve."""
    NO_FINISH = "no-finish"
    """The mission cannot be finished above the reserve."""
    MEASURES_DIFFER = "measures-differ"
    """The measurements of the battery contradict each other."""


class Prediction(Value, eq=False):
    """What a check predicts of the flight of a vehicle on the line."""

    returns: Returns
    battery: Battery
    charge: float
    """State of charge at the start. [-]"""
    usable_wh: float
    """Energy in the battery at the start. [Wh]"""
    reserve_wh: float
    """Energy that is to stay. [Wh]"""
    temperature_c: float
    """Of the battery. [°C]"""


class EnergyState(Value):
    """Everything known of the energy of a flight at one time."""

    progress: Progress
    left: EnergyLeft
    reserve_wh: float
    ratio: float | None
    """Energy measured over energy of the model since it is followed; ``None`` while too little is
    flown. [-]"""
    finish_wh: float
    """Energy to finish, by the model times the ratio, where that is above 1. [Wh]"""
    return_wh: float
    """Energy to return, likewise. [Wh]"""
    lead_s: float | None
    """Time to the point of no return; ``None`` where there is none ahead. [s]"""
    is_joined: bool = False
    """Whether it was in the air before it was followed."""
    warnings: tuple[EnergyWarning, ...] = ()
    """What is wrong with it now, new or not."""

    @property
    def finish_margin_wh(self) -> float:
        """Energy above the reserve at the end of the mission [Wh]."""
        return self.left.energy_wh - self.reserve_wh - self.finish_wh

    @property
    def return_margin_wh(self) -> float:
        """Energy above the reserve after a return from here [Wh]."""
        return self.left.energy_wh - self.reserve_wh - self.return_wh

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is wrong now, worst first."""
        found = [
            _RULES[warning.concern].finding(warning.text, item=self.progress.item)
            for warning in self.warnings
        ]
        return tuple(sorted(found, key=lambda finding: -finding.severity))


class EnergyWarning(Value):
    """Something a pilot has to know now."""

    concern: Concern
    severity: int
    """MAV_SEVERITY."""
    headline: str
    """For the ground station, at most 50 characters."""
    text: str
    """One sentence with its numbers."""


class EnergyWatch:
    """Follows one flight, from a reading on the ground or, where it is joined, in the air."""

    def __init__(
        self,
        prediction: Prediction,
        *,
        start: BatteryState,
        warn_before_s: float = 60.0,
        is_joined: bool = False,
    ) -> None:
        self._prediction = prediction
        above_wh = prediction.usable_wh - prediction.reserve_wh
        self._sweep = sweep_returns(prediction.returns, above_wh)
        self._meter = BatteryMeter(prediction, start)
        self._warn_before_s = warn_before_s
        self._is_joined = is_joined
        self._missed_wh: float | None = None if is_joined else 0.0
        """What the model takes until the start; ``None`` until the vehicle was seen. [Wh]"""
        self._before: tuple[Progress, float] | None = None
        self._raised: set[Concern] = set()

    def take(
        self,
        item: int,
        place: VehiclePosition,
        reading: BatteryState,
        now_s: float,
        *,
        is_on_mission: bool = True,
    ) -> tuple[EnergyState | None, tuple[EnergyWarning, ...]]:
        """Return the state, unless nothing of the battery is measured, and the warnings that are new."""
        left = self._meter.energy_left(reading)
        before, before_s = self._before or (None, now_s)
        progress = flight_progress(
            self._prediction.returns, item, place, before=before, elapsed_s=now_s - before_s
        )
        self._before = (progress, now_s)
        if self._missed_wh is None:
            self._missed_wh = progress.used_wh
        if left is None:
            return None, ()
        ratio = self._ratio(progress.used_wh - self._missed_wh, left)
        # A vehicle that took less so far may meet the wind later: the model is never undercut.
        factor = 1.0 if ratio is None else max(ratio, 1.0)
        above_wh = left.energy_wh - self._prediction.reserve_wh
        state = EnergyState(
            progress=progress,
            left=left,
            reserve_wh=self._prediction.reserve_wh,
            ratio=ratio,
            finish_wh=factor * progress.finish_wh,
            return_wh=factor * progress.return_wh,
            lead_s=(
                self._sweep.lead_s(progress.time_s, progress.used_wh, above_wh / factor)
                if is_on_mission and self._sweep is not None
                else None
            ),
            is_joined=self._is_joined,
        )
        present, new = self._concerns(state, is_on_mission=is_on_mission)
        return (
            replace(state, warnings=tuple(_warning(concern, state) for concern in present)),
            tuple(_warning(concern, state) for concern in new),
        )

    def _ratio(self, modelled_wh: float, left: EnergyLeft) -> float | None:
        used_wh = self._prediction.usable_wh - left.energy_wh
        total_wh = float(self._prediction.returns.used_wh[-1])
        least_wh = max(_LEAST_USED * total_wh, _STEPS_USED * left.step_wh)
        if not modelled_wh > 0.0 or max(modelled_wh, used_wh) < least_wh:
            return None
        return max(used_wh - left.step_wh, 0.0) / modelled_wh

    def _concerns(
        self, state: EnergyState, *, is_on_mission: bool
    ) -> tuple[list[Concern], list[Concern]]:
        """Return what is wrong, and what of it was not before."""
        lead_s = math.inf if state.lead_s is None else state.lead_s
        is_short = state.return_margin_wh < 0.0
        finishes = state.finish_margin_wh >= 0.0 and is_on_mission
        # Where the rest of the mission costs less than the way home, finishing is the way home.
        present = {
            Concern.NO_RETURN: is_short and not finishes,
            Concern.RETURN_SOON: lead_s <= self._warn_before_s and not is_short and not finishes,
            Concern.NO_FINISH: not finishes and is_on_mission,
            Concern.MEASURES_DIFFER: state.left.spread_wh
            > _DIFFERENCE * self._prediction.usable_wh,
        }
        over = {
            Concern.NO_RETURN: not present[Concern.NO_RETURN],
            Concern.RETURN_SOON: finishes or lead_s > _CALM_FACTOR * self._warn_before_s,
            Concern.NO_FINISH: state.finish_margin_wh > 0.1 * self._prediction.reserve_wh,
            Concern.MEASURES_DIFFER: False,
        }
        new = [concern for concern in Concern if present[concern] and concern not in self._raised]
        self._raised |= set(new)
        self._raised -= {concern for concern in Concern if over[concern]}
        return [concern for concern in Concern if present[concern]], new


NO_RETURN_IN_FLIGHT = Rule(
    "V111 no-return-in-flight",
    Severity.ERROR,
    summary="The vehicle in flight cannot return above the reserve.",
    why="Every second on the mission uses more of the energy for the return.",
    how="measured energy left − energy of the return by the model × measured over modelled energy "
    "where that is above 1 − reserve < 0, and the rest of the mission is no shorter way to land.",
    fix="turn back now, or land at a rally point that is nearer",
)

RETURN_SOON_IN_FLIGHT = Rule(
    "V112 return-soon-in-flight",
    Severity.WARNING,
    summary="The point of no return is near, and the mission cannot be finished.",
    why="Beyond it the return uses part of the reserve.",
    how="The time until the margin of the return reaches zero along the mission is 60 s or less.",
    fix="turn back before then",
)

SHORT_IN_FLIGHT = Rule(
    "V113 short-in-flight",
    Severity.ERROR,
    summary="The mission in flight ends below the reserve.",
    why="A go on the ground becomes a no-go when wind, load or battery are not as given.",
    how="measured energy left − energy of the rest of the mission by the model × measured over "
    "modelled energy where that is above 1 − reserve < 0.",
    fix="end the mission earlier: skip items, or turn back",
)

MEASURES_DIFFER_IN_FLIGHT = Rule(
    "V114 measures-differ-in-flight",
    Severity.WARNING,
    summary="The measurements of the battery contradict each other.",
    why="Another battery flies than the one that was checked, or one of its measurements is wrong.",
    how="The energies left by charge count, energy count and percentage differ by more than 10 % of "
    "it.",
    fix="check with --battery as it is, and calibrate the power module",
)


_RULES = {
    Concern.NO_RETURN: NO_RETURN_IN_FLIGHT,
    Concern.RETURN_SOON: RETURN_SOON_IN_FLIGHT,
    Concern.NO_FINISH: SHORT_IN_FLIGHT,
    Concern.MEASURES_DIFFER: MEASURES_DIFFER_IN_FLIGHT,
}


def _warning(concern: Concern, state: EnergyState) -> EnergyWarning:
    left = f"{quantity.energy(state.left.energy_wh)} left by {state.left.source}"
    keep = f"a reserve of {quantity.energy(state.reserve_wh)}"
    home = quantity.energy(state.return_wh)
    match concern:
        case Concern.NO_RETURN:
            short = quantity.energy(-state.return_margin_wh)
            severity, headline = 2, f"RETURN NOW, {short} below reserve"
            text = f"a return now lands {short} below the reserve: {left}, {home} to return, {keep}"
        case Concern.RETURN_SOON:
            lead = quantity.duration(state.lead_s)
            severity, headline = 3, f"no return in {lead}, turn back"
            text = f"point of no return in {lead}: {left}, {home} to return now, {keep}"
        case Concern.NO_FINISH:
            short = quantity.energy(-state.finish_margin_wh)
            finish = quantity.energy(state.finish_wh)
            severity, headline = 4, f"mission short by {short}"
            text = f"the mission ends {short} below the reserve: {left}, {finish} to finish, {keep}"
        case Concern.MEASURES_DIFFER:
            by_source = ", ".join(
                f"{quantity.energy(left_wh)} by {source}"
                for source, left_wh in state.left.by_source
            )
            severity, headline = 4, "battery is not the one checked?"
            text = f"battery measurements differ (another battery than checked?): {by_source}"
    headline = f"mavjoule: {headline}"
    return EnergyWarning(concern=concern, severity=severity, headline=headline, text=text)


_FLYING_M = 1.0
"""A vehicle that does not report whether it has landed is in the air above this. [m]"""
_PX4_MISSION, _ARDUPILOT_AUTO = (4 << 16) | (4 << 24), 3
"""Custom mode of a vehicle that flies its mission."""


class FlightFollower:
    """Follows a vehicle from its arming to its landing."""

    def __init__(
        self, telemetry: Telemetry, identity: VehicleIdentity, *, warn_before_s: float
    ) -> None:
        self._telemetry = telemetry
        self._identity = identity
        self._warn_before_s = warn_before_s
        self._prediction: Prediction | None = None
        self._start: BatteryState | None = None
        self._watch: EnergyWatch | None = None
        self._was_on_ground = False
        self.is_flying = False

    def predict(self, prediction: Prediction | None) -> None:
        """Take what a check predicts, of this flight too where it has begun."""
        self._prediction = prediction
        if self._watch is not None:
            if not self._was_on_ground:
                self._start = self._battery()
            self._begin()

    def take_arming(self, *, is_armed: bool) -> None:
        """Take it that the vehicle has armed or disarmed."""
        self._watch, self._start = None, None
        if is_armed:
            self._start = self._battery()
            self._begin()

    def look(self, now_s: float) -> tuple[EnergyState | None, tuple[EnergyWarning, ...]]:
        """Return the energy in flight, and the warnings that are new; none on the ground."""
        state = self._telemetry.state()
        self.is_flying = _is_flying(state)
        self._was_on_ground |= state.is_armed is False
        position = state.position
        if not self.is_flying or position is None:
            return None, ()
        if self._watch is None:  # it was in the air before us
            self._start = self._battery()
            self._begin()
        if self._watch is None:
            return None, ()
        return self._watch.take(
            self._present_item(),
            position,
            self._battery(),
            now_s,
            is_on_mission=self._is_on_mission(),
        )

    def _begin(self) -> None:
        if self._prediction is not None and self._start is not None:
            self._watch = EnergyWatch(
                self._prediction,
                start=self._start,
                warn_before_s=self._warn_before_s,
                is_joined=not self._was_on_ground,
            )

    def _present_item(self) -> int:
        current = self._telemetry.latest("MISSION_CURRENT")
        number = 1 if current is None else int(current["seq"])
        return max(number if self._identity.has_home_slot else number + 1, 1)

    def _is_on_mission(self) -> bool:
        beat = self._telemetry.latest("HEARTBEAT")
        wanted = _ARDUPILOT_AUTO if self._identity.has_home_slot else _PX4_MISSION
        return beat is not None and bool(beat["custom_mode"] == wanted)

    def _battery(self) -> BatteryState:
        return self._telemetry.state().battery or BatteryState()


def _is_flying(state: VehicleState) -> bool:
    if not state.is_armed:
        return False
    if state.is_landed is not None:
        return not state.is_landed
    return state.position is not None and state.position.height_above_home_m > _FLYING_M
