"""The assessment: everything that is predicted of one flight, and all a rule may look at."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.flight.budget import item_arrivals, predict_return_discharge, stay_above
from planner.flight.pilot import airspeed_limit_m_s, limit_lean_rad, shown_airspeed_m_s
from planner.mission.takers import may_fly
from planner.quantity import mean_of
from planner.units import wh_from_j
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.arrays import FloatArray
    from planner.autopilot import Autopilot, Target
    from planner.findings import Finding, Place, Rule
    from planner.flight.budget import BatteryBudget, Discharge, ReturnDischarge, Totals
    from planner.flight.failsafe import BatteryProfile
    from planner.flight.motion.kinematics import Motion
    from planner.flight.motion.px4.pilot import Px4Pilot
    from planner.flight.path import FlownPath
    from planner.flight.pilot import ArduPilotPilot
    from planner.flight.power import Transients
    from planner.flight.prediction import Flight, ItemArrival
    from planner.flight.reach import Situations
    from planner.flight.returns.path import FlownReturns, Returns
    from planner.flight.returns.tightest import ReturnPlan
    from planner.flight.uncounted import Uncounted
    from planner.mission.items import Mission
    from planner.mission.route.stage import Route
    from planner.rules.fenced_flight import FencedFlight
    from planner.rules.lateness import Lateness, LateReturns
    from planner.setup import Setup
    from planner.vehicle.battery import Battery
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.resolve import FlightParameters


class Margin(Value, kw_only=False):
    """What is left above the reserve as predicted, and what is taken of it besides, at most. [Wh]"""

    predicted_wh: float
    late_wh: float
    """As the vehicle is later than its model of reference steps, at the power of a hover."""
    uncounted_wh: float
    """Where its model says nothing; infinite where it may not come forward at all."""

    @property
    def left_wh(self) -> float:
        """What is left with all of that, at least. [Wh]"""
        return self.predicted_wh - self.late_wh - self.uncounted_wh


class Assessment(Value, eq=False, dict=True):
    """One mission, flown by one vehicle on one day, as predicted."""

    mission: Mission
    setup: Setup
    """As the user gives it, with the position noise that counts."""
    route: Route
    target: Target | None
    """Whose rules the mission has to meet: of what flies it, of steps of its parameters or the file."""
    parameters: FlightParameters | None
    """What the autopilot is taken to fly with; ``None`` for reference steps."""
    own_parameters: FlightParameters | None
    """Those of the vehicle itself: ``parameters``, or of reference steps what their file holds."""
    flight: Flight
    totals: Totals
    pack: Battery | None
    """The battery that flies."""
    discharge: Discharge | None
    """What the flight takes out of it, where its curve is known."""
    battery: BatteryBudget | None
    return_plan: ReturnPlan | None
    returns: Returns
    """The returns from every point of the flight."""
    findings: tuple[Finding, ...]
    """What the mission's file and the prediction had to assume."""

    @cached_property
    def items(self) -> tuple[ItemArrival, ...]:
        """When every item is reached, and the energy used by then."""
        return item_arrivals(self.mission, self.route, self.flight)

    @property
    def named(self) -> Autopilot | None:
        """The autopilot that flies; ``None``: nobody named it, or the model only assumes it."""
        target = self.target
        return None if target is None or target.is_assumed else target.autopilot

    @cached_property
    def may_fly(self) -> frozenset[Autopilot]:
        """Which of the two autopilots may fly the mission: those that take its upload, if none is named."""
        return may_fly(self.mission, self.named)

    @cached_property
    def path(self) -> FlownPath:
        """The flight as straight lines, of which every rule on places takes what it looks at."""
        from planner.flight.path import flown_path

        return flown_path(self.flight.motion)

    @cached_property
    def reach(self) -> Situations:
        """Every situation the vehicle may be in: mission, holds, returns from anywhere."""
        return self.returns.situations

    @property
    def shown_airspeed_m_s(self) -> float | None:
        """Highest airspeed the model shows the vehicle to hold at its lean limit; ``None``: none. [m s⁻¹]"""
        return shown_airspeed_m_s(self.vehicle, self.own_parameters, self.setup.aloft)

    @property
    def certain_airspeed_m_s(self) -> float | None:
        """Highest airspeed the vehicle is certain to hold; ``None``: none is known. [m s⁻¹]"""
        from planner.flight.uncounted import held_airspeed_m_s

        identified = self.vehicle.valid_for.speed_m_s
        if identified is None:
            return None
        return held_airspeed_m_s(self.vehicle, identified.high, self.shown_airspeed_m_s)

    @property
    def highest_airspeed_m_s(self) -> float | None:
        """Airspeed limit of the model, else the highest that it shows; ``None``: none. [m s⁻¹]"""
        return self.airspeed_limit_m_s or self.shown_airspeed_m_s

    @property
    def airspeed_limit_m_s(self) -> float | None:
        """Highest airspeed of the vehicle at its lean limit, with what it carries; ``None``: not known."""
        return airspeed_limit_m_s(self.vehicle, self.own_parameters, self.setup.aloft)

    @property
    def limit_lean_rad(self) -> float:
        """Lean angle at which the vehicle holds that airspeed. [rad]"""
        return limit_lean_rad(self.vehicle, self.own_parameters)

    @property
    def holds_for_others(self) -> bool:
        """Whether it gives way to others: it holds on its way, and its returns are those without that."""
        return self.returns.flight.motion is not self.flight.motion

    @cached_property
    def uncounted(self) -> Uncounted:
        """What the flight may take above its prediction where the model says nothing."""
        from planner.flight.uncounted import Uncounted

        flight, route, planned = self.returns.flight, self.returns.route, self
        if self.holds_for_others:
            planned = replace(self, flight=flight, route=route)
        later_s = planned.lateness.in_all_s
        back, shown_m_s = self.returns.sample, self.shown_airspeed_m_s
        return Uncounted.of(flight, self.reach, shown_m_s, later_s=later_s, back=back)

    @cached_property
    def battery_profile(self) -> BatteryProfile | None:
        """The battery along the flight; ``None`` with none."""
        if self.pack is None:
            return None
        from planner.flight.failsafe import battery_profile

        return battery_profile(
            self.returns,
            self.pack,
            self.discharge,
            charge=self.charge,
            later_s=self.lateness.in_all_s,
        )

    @cached_property
    def lateness(self) -> Lateness:
        """How much longer the vehicle takes than its model of reference steps."""
        from planner.rules.lateness import lateness_of

        return lateness_of(self)

    @property
    def lost_s(self) -> FloatArray:
        """How much longer each segment may last for want of airspeed, at most. (s,) [s]

        Where it may not come forward at all E105 is an error.
        """
        lost_s = self.uncounted.late_s
        if not self.holds_for_others:
            return lost_s
        # Nobody knows where it is late.
        first_s = np.zeros(len(self.flight.motion.segments.item))
        first_s[0] = lost_s.sum()
        return first_s

    @property
    def passed_late_s(self) -> FloatArray:
        """How much later than predicted each segment may be passed, at most. (s,) [s]

        By its parameters, and for want of airspeed.
        """
        return self.lateness.passed_s[:, 1] + np.cumsum(self.lost_s)

    @cached_property
    def fenced(self) -> FencedFlight:
        """The flight and its fence, in one frame."""
        from planner.rules.fenced_flight import make_fenced_flight

        return make_fenced_flight(self)

    @cached_property
    def own_flown(self) -> tuple[ArduPilotPilot | Px4Pilot, tuple[Motion, Transients]] | None:
        """Who flies a vehicle of reference steps by its own autopilot, and how; ``None``: it is not known."""
        from planner.rules.lateness import own_flown_of

        return own_flown_of(self)

    @property
    def own_motion(self) -> Motion | None:
        """How the own autopilot of a model of reference steps flies; ``None``: it is not known."""
        return None if self.own_flown is None else self.own_flown[1][0]

    @cached_property
    def own(self) -> Assessment | None:
        """The flight of a model of reference steps as its own autopilot flies it; ``None``: not known."""
        from planner.rules.lateness import as_its_own_flies

        return as_its_own_flies(self, self.own_flown)

    @cached_property
    def late_returns(self) -> LateReturns:
        """How much longer the returns of the sample take than that has them."""
        from planner.rules.lateness import late_returns_of

        return late_returns_of(self, self.returns.sample)

    def hovered_wh(self, time_s: float) -> float:
        """Return the energy of a hover near home. [Wh]"""
        return wh_from_j(self.flight.hover_near_home_w * time_s)

    @property
    def late_wh(self) -> float:
        """What the flight takes above its prediction, as it is later, at the power of a hover. [Wh]"""
        return self.hovered_wh(float(self.lateness.in_all_s.sum()))

    def late_return_wh(self, flown: FlownReturns, late: LateReturns) -> FloatArray:
        """Return what returns take above their prediction for being later, with the way there. (n,) [Wh]"""
        before_s = np.cumsum(self.lateness.in_all_s)[flown.points.segment]
        return wh_from_j(self.flight.hover_near_home_w * (before_s + late.in_all_s))

    @cached_property
    def margins(self) -> tuple[Margin, ...]:
        """Of the flight, and of the return that leaves least; none without a battery."""
        if self.battery is None:
            return ()
        flown = Margin(self.battery.margin_wh, self.late_wh, self.uncounted.flown_wh)
        returned = self.return_margin(counts_uncounted=True)
        return (flown,) if returned is None else (flown, returned)

    @property
    def left_wh(self) -> float:
        """What is left of these at least; infinite without a battery. [Wh]"""
        return min((one.left_wh for one in self.margins), default=math.inf)

    def return_margin(self, *, counts_uncounted: bool) -> Margin | None:
        """Return that of the return that leaves least, with the way there; ``None``: there is none."""
        plan, sample = self.return_plan, self.returns.sample
        if plan is None or plan.margin_wh is None or sample is None:
            return None
        taken_wh = sample.points.used_wh + sample.energy_wh
        late_wh = self.late_return_wh(sample, self.late_returns)
        uncounted_wh = self.uncounted_returns_wh if counts_uncounted else np.zeros(len(taken_wh))
        row = int(np.argmax(taken_wh + late_wh + uncounted_wh))
        # The plan's is refined between the points of the sample.
        predicted_wh = plan.margin_wh + float(taken_wh.max() - taken_wh[row])
        return Margin(predicted_wh, float(late_wh[row]), float(uncounted_wh[row]))

    @cached_property
    def uncounted_returns_wh(self) -> FloatArray:
        """What the returns of the sample take besides that is not counted, with the way there. (n,) [Wh]"""
        sample = self.returns.sample
        if sample is None:
            return np.zeros(0)
        late_wh = wh_from_j(self.flight.hover_near_home_w * self.late_returns.in_all_s)
        return self.uncounted.returned_wh(sample.points.segment, late_wh)

    @cached_property
    def return_discharge(self) -> ReturnDischarge | None:
        """What holds and returns ask of the battery; ``None`` as for ``discharge``, or with none."""
        sample = self.returns.sample
        if self.discharge is None or sample is None:
            return None
        return predict_return_discharge(sample, self.discharge)

    def returns_stay_above(self, voltage_v: float) -> bool:
        """Return whether no hold and no return brings the battery below a voltage; if not, they may."""
        sample = self.returns.sample
        return sample is None or (
            self.discharge is not None and stay_above(sample, self.discharge, voltage_v)
        )

    @property
    def vehicle(self) -> VehicleModel:
        """The model that is flown."""
        return self.setup.vehicle

    @property
    def autopilot(self) -> Autopilot:
        """Who shapes the references in this prediction."""
        return self.setup.flown_by

    @property
    def charge(self) -> float:
        """State of charge at the start. [-]"""
        return mean_of(self.setup.charge)

    def finding(
        self,
        rule: Rule,
        message: str,
        *,
        item: int | None = None,
        place: Place | None = None,
        **given: Any,  # noqa: ANN401 - as `Rule.finding` takes them
    ) -> Finding:
        """Return a finding of a rule, at the place of its item in the mission file."""
        if item is not None:
            place = self.mission.items[item - 1].place
        return rule.finding(message, item=item, place=place, **given)

    def item_of(self, segment: int | np.intp) -> int:
        """Return the mission item that a segment of the flight belongs to, from 1."""
        return int(self.flight.motion.segments.item[segment])


def numbers(a: Assessment) -> Mapping[str, float]:
    """Return every parameter of --params that holds a number, in its own unit."""
    return {} if a.setup.parameters is None else a.setup.parameters.numbers()
