"""The assessment: everything that is predicted of one flight, and all a rule may look at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.values import Value

if TYPE_CHECKING:
    import numpy as np

    from planner.autopilot import Autopilot, Target
    from planner.findings import Finding, Place, Rule
    from planner.flight.budget import BatteryBudget, Discharge, Totals
    from planner.flight.conditions import Conditions
    from planner.flight.prediction import Flight, ItemArrival
    from planner.flight.returns.path import Returns
    from planner.flight.returns.tightest import ReturnPlan
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission
    from planner.mission.route.stage import Route
    from planner.site_profile import SiteProfile
    from planner.vehicle.battery import Battery
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.files import ParameterSet
    from planner.vehicle.parameters.resolve import FlightParameters


class Assessment(Value, eq=False):
    """One mission, flown by one vehicle on one day, as predicted."""

    mission: Mission
    route: Route
    vehicle: VehicleModel
    autopilot: Autopilot
    """Who shapes the references in this prediction."""
    parameters: FlightParameters | None
    """What the autopilot is taken to fly with; ``None`` for reference steps."""
    conditions: Conditions
    flight: Flight
    totals: Totals
    items: tuple[ItemArrival, ...]
    pack: Battery | None
    """The battery that flies."""
    discharge: Discharge | None
    """What the flight takes out of it, where its curve is known."""
    battery: BatteryBudget | None
    return_plan: ReturnPlan | None
    charge: float
    """State of charge at the start. [-]"""
    returns: Returns
    """The returns from every point of the flight."""
    target: Target | None = None
    """Whose rules the mission has to meet: of what flies it, else of what it was written for."""
    fence_parameters: FlightParameters | None = None
    """Those of the vehicle's fence: ``parameters``, or of reference steps what their file says."""
    given_parameters: ParameterSet | None = None
    """The vehicle's parameter file."""
    terrain: TerrainGrid | None = None
    clearance_m: float = 0.0
    """Height over the terrain that has to be kept. [m]"""
    given_home_amsl_m: float | None = None
    """Altitude of the take-off place where the user gives it. [m AMSL]"""
    profile: SiteProfile | None = None
    """What a site asks for."""
    risk: float = 0.05
    """Chance of landing below the reserve above which it is told. [-]"""
    charge_sd: float = 0.0
    """Standard deviation of the state of charge at the start. [-]"""

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
