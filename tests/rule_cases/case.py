"""What a rule is tried on: a case where it fires, a near one where it does not, one on its limit."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from made_missions import mission, rtl, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.service.preflight import check
from planner.values import Value
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from planner.findings import Finding
    from planner.mission.items import Mission
    from planner.vehicle.model import VehicleModel

STEP, PX4, ARDUPILOT = Autopilot.STEP, Autopilot.PX4, Autopilot.ARDUPILOT
_NAMES = {STEP: "falkowski-2023-quadrotor", PX4: "px4-sih-quad", ARDUPILOT: "arducopter-sitl-quad"}
PLENTY = Battery(capacity_wh=170.0)
"""For more than any of the cases takes, and no heavier than the batteries of the models."""
PLAIN = mission(takeoff(20), waypoint(100, 20), rtl())
"""20 m up, 100 m north and back: nothing to be reported of."""


class RuleCases(Value):
    """Three cases of one rule, each of which returns what is found."""

    fires: Callable[[], Iterable[Finding]]
    silent: Callable[[], Iterable[Finding]]
    """Near to the case that fires."""
    boundary: Callable[[], Iterable[Finding]]
    """Exactly on the limit; of a rule without a number the nearest case that is allowed."""
    fires_at_boundary: bool = False
    """Whether the rule fires on the limit itself, as its text says."""
    shown: Callable[[], Iterable[Finding]] | None = None
    """A case whose message is a better example than that of ``fires``, just beyond the limit."""


@cache
def vehicle_of(autopilot: Autopilot) -> VehicleModel:
    """Return the shipped model that is flown so."""
    return load_vehicle(_NAMES[autopilot])


def found(
    one: Mission,
    autopilot: Autopilot = STEP,
    parameters: str = "",
    *,
    battery: Battery | None = PLENTY,
    vehicle: VehicleModel | None = None,
    **given: Any,  # noqa: ANN401 - whatever check takes
) -> tuple[Finding, ...]:
    """Return what a check of a mission tells."""
    return check(
        one,
        vehicle_of(autopilot) if vehicle is None else vehicle,
        autopilot=autopilot,
        battery=battery,
        parameters=parameters_from_text(parameters.encode(), source="p.param")
        if parameters
        else None,
        **given,
    ).findings
