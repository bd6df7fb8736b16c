"""How a rule's function declares what it judges and what it cannot judge without."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar, overload

from planner.autopilot import Autopilot
from planner.errors import PathTooLongError
from planner.flight.pilot import is_of_ardupilot
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.autopilot import Target
    from planner.fetched import FetchMark
    from planner.findings import Finding, Rule
    from planner.flight.budget import BatteryBudget, Discharge
    from planner.flight.power import SteadyPower
    from planner.flight.prediction import Extremes
    from planner.geo.fence import Fence
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.rules.fence_settings import FenceLimits
    from planner.site_profile import SiteProfile
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters
    from planner.vehicle.parameters.resolve import FlightParameters

    Found: TypeAlias = "Finding | NotEvaluated"

T = TypeVar("T")
T1 = TypeVar("T1")
T2 = TypeVar("T2")
T3 = TypeVar("T3")


class Need(Value, Generic[T], kw_only=False):
    """Something without which a rule is not evaluated."""

    what: str
    """What it is and what gives it."""
    of: Callable[[Assessment], T | None]
    """Returns it; ``None`` where it is missing."""
    is_subject: bool = False
    """Whether it is what the rule is about: without it there is nothing to check."""


class NotEvaluated(Value):
    """A rule that could not be evaluated, though something in use asks for it."""

    rule: Rule
    needs: str
    """What it lacks, and what gives it."""
    asked_by: str
    """The parameter or item: ``BATT_LOW_VOLT of 21.0 V``."""
    item: int | None = None
    also: tuple[Rule, ...] = ()
    """Rules that lack the same: listed as not checked too."""


def _target(a: Assessment, autopilot: Autopilot) -> Target | None:
    return a.target if a.target is not None and a.target.autopilot is autopilot else None


def _fence_limits(a: Assessment) -> FenceLimits | None:
    is_switched_on = a.route.fence_switched_on is not None
    if not (a.mission.fence or is_switched_on) and a.own_parameters is None:
        return None
    from planner.rules.fence_settings import limits_in_use

    limits = limits_in_use(a.route, a.own_parameters)
    return limits if a.mission.fence or is_switched_on or limits else None


def _may_matter_on_other_ways(a: Assessment) -> bool:
    return a.autopilot is Autopilot.STEP and not (
        a.setup.terrain is None and FENCE.of(a) is None and a.setup.profile is None
    )


def _px4(a: Assessment) -> Px4Parameters | None:
    if a.own_parameters is None:
        return None
    from planner.vehicle.parameters.px4 import Px4Parameters

    return a.own_parameters if isinstance(a.own_parameters, Px4Parameters) else None


def _ardupilot(a: Assessment) -> ArduPilotParameters | None:
    return a.own_parameters if is_of_ardupilot(a.own_parameters) else None


def _fetch_marks(a: Assessment) -> tuple[FetchMark, FetchMark] | None:
    plan, parameters = a.mission.fetched, a.setup.parameters
    if plan is None or parameters is None or parameters.fetched is None:
        return None
    return plan, parameters.fetched


POWER: Need[SteadyPower] = Need(
    "the vehicle's power: a model with [hover]",
    lambda a: a.flight.power if a.vehicle.is_power_known else None,
)
PACK: Need[Battery] = Need("a battery: --battery", lambda a: a.pack)
BUDGET: Need[BatteryBudget] = Need("the vehicle's power and a battery", lambda a: a.battery)
DISCHARGE: Need[Discharge] = Need(
    "the battery's resistance and open-circuit voltage", lambda a: a.discharge
)
EXTREMES: Need[Extremes] = Need(
    "a flight that takes time", lambda a: a.flight.extremes, is_subject=True
)
PARAMETERS: Need[FlightParameters] = Need(
    "a vehicle that an autopilot flies, or its parameters: --params", lambda a: a.own_parameters
)
PX4: Need[Px4Parameters] = Need("a vehicle of PX4's", _px4, is_subject=True)
ARDUPILOT: Need[ArduPilotParameters] = Need("a vehicle of ArduPilot's", _ardupilot, is_subject=True)
TARGET: Need[Target] = Need("the autopilot the mission is for: --target", lambda a: a.target)
TERRAIN: Need[TerrainGrid] = Need("terrain: --terrain", lambda a: a.setup.terrain)
TERRAIN_ABOUT_UNKNOWN_HOME: Need[TerrainGrid] = Need(
    "terrain and a file without a home",
    lambda a: a.setup.terrain if a.mission.home is None else None,
    is_subject=True,
)
SEVERAL_TERRAINS: Need[TerrainGrid] = Need(
    "two terrain files or more",
    lambda a: a.setup.terrain if a.setup.terrain and len(a.setup.terrain.tiles) > 1 else None,
    is_subject=True,
)
PX4_TARGET: Need[Target] = Need(
    "a mission for PX4: --target", lambda a: _target(a, Autopilot.PX4), is_subject=True
)
ARDUPILOT_TARGET: Need[Target] = Need(
    "a mission for ArduPilot: --target", lambda a: _target(a, Autopilot.ARDUPILOT), is_subject=True
)
FENCE: Need[FenceLimits] = Need(
    "a fence in the mission or the parameters", _fence_limits, is_subject=True
)
DRAWN: Need[Fence] = Need(
    "areas of a drawing that may mean something else",
    lambda a: a.mission.fence if a.mission.fence is not None and a.mission.fence.readings else None,
    is_subject=True,
)
FETCHED: Need[tuple[FetchMark, FetchMark]] = Need(
    "a plan and parameters of mavjoule fetch", _fetch_marks, is_subject=True
)
PROFILE: Need[SiteProfile] = Need(
    "a profile of the site: --profile", lambda a: a.setup.profile, is_subject=True
)
OTHER_WAYS: Need[bool] = Need(
    "a model of reference steps, with a fence, terrain or a site beside its way",
    lambda a: _may_matter_on_other_ways(a) or None,
    is_subject=True,
)


class Check(Value, kw_only=False, eq=False):
    """A function of the rules it judges."""

    rules: tuple[Rule, ...]
    needs: tuple[Need[Any], ...]
    function: Callable[..., Iterator[Found]]

    def __call__(self, a: Assessment) -> Need[Any] | tuple[Found, ...]:
        """Return what the rules find, or the first thing that is missing for them."""
        given = []
        for need in self.needs:
            if (value := need.of(a)) is None:
                return need
            given.append(value)
        try:
            return tuple(self.function(a, *given))
        except PathTooLongError as error:
            needs = "a shorter mission, with fewer repeats"
            return tuple(
                NotEvaluated(rule=rule, asked_by=str(error), needs=needs) for rule in self.rules
            )


@overload
def judges(*rules: Rule) -> Callable[[Callable[[Assessment], Iterator[Found]]], Check]: ...
@overload
def judges(
    *rules: Rule, needs: tuple[Need[T1]]
) -> Callable[[Callable[[Assessment, T1], Iterator[Found]]], Check]: ...
@overload
def judges(
    *rules: Rule, needs: tuple[Need[T1], Need[T2]]
) -> Callable[[Callable[[Assessment, T1, T2], Iterator[Found]]], Check]: ...
@overload
def judges(
    *rules: Rule, needs: tuple[Need[T1], Need[T2], Need[T3]]
) -> Callable[[Callable[[Assessment, T1, T2, T3], Iterator[Found]]], Check]: ...
def judges(
    *rules: Rule, needs: tuple[Need[Any], ...] = ()
) -> Callable[[Callable[..., Iterator[Found]]], Check]:
    """Make a function the check of some rules; it is passed the assessment and what it needs."""
    return lambda function: Check(rules, needs, function)
