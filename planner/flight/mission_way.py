"""Returns along the mission: where PX4 leads them with RTL_TYPE 1 to 4.

After ``RTL::setRtlTypeAndDestination`` and the classes it chooses from, as of PX4 1.16.  The mission's
landing is its first landing item; it begins at the first DO_LAND_START before that, else at the landing
itself (``MavlinkMissionManager``).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.catalogue.time import RETURN_LANDS_HERE, SETTING_NOT_FOLLOWED
from planner.findings import Severity
from planner.frozen import frozen
from planner.mission.commands import RELATIVE_FRAMES, Command
from planner.mission.route.stage import (
    ReturnWay,
    Stage,
    StageKind,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.findings import Finding
    from planner.mission.items import Mission, MissionItem
    from planner.mission.route.stage import Route

_LANDINGS = frozenset({Command.NAV_LAND, Command.NAV_VTOL_LAND})
_TAKEOFFS = frozenset({Command.NAV_TAKEOFF, Command.NAV_VTOL_TAKEOFF})
_PLACES = (
    frozenset(
        {
            Command.NAV_WAYPOINT,
            Command.NAV_LOITER_UNLIM,
            Command.NAV_LOITER_TIME,
            Command.NAV_LOITER_TO_ALT,
        }
    )
    | _LANDINGS
    | _TAKEOFFS
)
"""Items that hold a place (``MissionBlock::item_contains_position``)."""
_JUMPS = frozenset({Command.DO_JUMP, Command.DO_JUMP_TAG})
_TO_LANDING = frozenset({1, 3})
_ALONG = frozenset({2, 4})
_STRAIGHT = frozenset({0, 5})
_RALLY_ONLY = 5
_ON_IF_IT_LANDS = 2
_HOME_IF_REACHED = 6


@frozen(eq=False)
class MissionWays:
    """Where returns lead that have to do with the mission."""

    landing: ReturnWay | None = None
    """Straight to the mission's landing, and down along it; ``None``: there is none, or the vehicle
    takes no notice."""
    along: tuple[ReturnWay, ...] = ()
    """Along the mission, forward or back, from each stage of the route; empty where the vehicle does
    not return so, or it is not predicted."""
    findings: tuple[Finding, ...] = ()


def make_mission_ways(
    mission: Mission,
    route: Route,
    return_type: int,
    *,
    home_of: Callable[[int], tuple[float, float, float]],
    ground_m: Callable[[float, float], float],
) -> MissionWays:
    """Return where returns lead that have to do with the mission.

    Parameters
    ----------
    mission : Mission
        Its items in file order.
    route : Route
        As they are flown.
    return_type : int
        RTL_TYPE.
    home_of : callable
        From a stage of the route to east, north and ground of the home that counts. [m]
    ground_m : callable
        From latitude and longitude to the height of the ground above the first home. [m]
    """
    if return_type in _STRAIGHT:
        lands_here = return_type == _RALLY_ONLY and not mission.rally
        return MissionWays(findings=_lands_here() if lands_here else ())
    if return_type not in _TO_LANDING | _ALONG:
        known = "home if it can be reached, else to a rally point"
        leads = known if return_type == _HOME_IF_REACHED else "somewhere not known here"
        return MissionWays(
            findings=_not_followed(return_type, leads, route, Severity.WARNING),
        )
    items = _Items(mission, route, ground_m)
    if return_type in _TO_LANDING:
        return _to_landing(items, return_type, route)
    if items.has_jump(0, len(mission.items) - 1):
        leads = "along the mission, whose jumps PX4 may take again and again on the way"
        return MissionWays(findings=_not_followed(return_type, leads, route, Severity.ERROR))
    along = []
    for number, stage in enumerate(route.stages):
        flown = stage.item - 1
        if items.goes_on(flown, always=return_type == _ON_IF_IT_LANDS):
            stages = items.stages_on(flown)
        else:
            stages = (*items.stages_back(flown), _landing_at(home_of(number), stage.item))
        along.append(ReturnWay(stages=stages, speed_m_s=items.speed_m_s(flown)))
    return MissionWays(along=tuple(along))


def _to_landing(items: _Items, return_type: int, route: Route) -> MissionWays:
    """Return the way to the mission's landing, if it has one."""
    if items.landing is None:
        return MissionWays()
    if items.has_jump(items.land_start, items.landing):
        leads = "to the mission's landing, on whose way the mission jumps"
        return MissionWays(findings=_not_followed(return_type, leads, route, Severity.ERROR))
    height_m = items.height_m(items.landing)
    way = ReturnWay(
        stages=items.stages_on(items.land_start),
        speed_m_s=items.speed_m_s(items.land_start),
        climbs_over_m=height_m,
    )
    return MissionWays(landing=way)


def _lands_here() -> tuple[Finding, ...]:
    message = "RTL_TYPE is 5 and there is no rally point: a return lands where the vehicle is"
    return (RETURN_LANDS_HERE.finding(message),)


def _not_followed(
    return_type: int, leads: str, route: Route, severity: Severity
) -> tuple[Finding, ...]:
    returning = next((one for one in route.stages if one.kind is StageKind.RETURN), None)
    return (
        SETTING_NOT_FOLLOWED.finding(
            f"RTL_TYPE {return_type} returns {leads}: time, energy and fence are those of the "
            "straight way home",
            item=None if returning is None else returning.item,
            severity=severity,
        ),
    )


def _landing_at(home_m: tuple[float, float, float], item: int) -> Stage:
    east_m, north_m, ground_m = home_m
    return Stage(kind=StageKind.LAND, item=item, east_m=east_m, north_m=north_m, height_m=ground_m)


class _Items:
    """The items of a mission as a return flies them; positions count from 0, in file order."""

    def __init__(
        self, mission: Mission, route: Route, ground_m: Callable[[float, float], float]
    ) -> None:
        self._items = mission.items
        self._route = route
        self._ground_m = ground_m
        # Of several stages of one item the last: the first may be a take-off put before it.
        flown = {stage.item: stage for stage in route.stages}
        self._stages = tuple(
            self._flown_to(at, item, flown.get(at + 1)) if item.command in _PLACES else None
            for at, item in enumerate(mission.items)
        )
        landings = [at for at, item in enumerate(mission.items) if item.command in _LANDINGS]
        self.landing = landings[0] if landings else None
        starts = [
            at for at, item in enumerate(mission.items) if item.command == Command.DO_LAND_START
        ]
        self.land_start = min([*starts[:1], *landings[:1]], default=0)

    def has_jump(self, first: int, last: int) -> bool:
        """Return whether an item from one to another, both included, jumps."""
        return any(item.command in _JUMPS for item in self._items[first : last + 1])

    def speed_m_s(self, before: int) -> float | None:
        """Return the speed last commanded before an item; ``None``: the vehicle's own."""
        for item in reversed(self._items[:before]):
            if item.command == Command.DO_CHANGE_SPEED:
                return item.param2 if item.param2 is not None and item.param2 > 0.0 else None
        return None

    def height_m(self, at: int) -> float:
        """Return the altitude of an item above home."""
        item = self._items[at]
        altitude_m = item.altitude_m or 0.0
        if item.frame in RELATIVE_FRAMES:
            return altitude_m
        return altitude_m - self._route.home_amsl_m

    def goes_on(self, flown: int, *, always: bool) -> bool:
        """Return whether a return leads on to the landing, and not back (``RTL::reverseIsFurther``)."""
        return self.landing is not None and (always or self.land_start - flown < flown)

    def stages_on(self, flown: int) -> tuple[Stage, ...]:
        """Return the places from an item to the landing, both included."""
        last = self.landing if self.landing is not None else len(self._stages) - 1
        ahead = self._stages[min(flown, last) : last + 1]
        return tuple(stage for stage in ahead if stage is not None)

    def stages_back(self, flown: int) -> tuple[Stage, ...]:
        """Return the places back from before an item to the take-off, or the first place there is."""
        back: list[Stage] = []
        # At the first item there is none before: that one is flown to.
        for at in range(max(flown - 1, 0), -1, -1):
            stage = self._stages[at]
            if stage is None:
                continue
            # A landing on the way back is a place like any other.
            back.append(replace(stage, kind=_passed(stage.kind)))
            if self._items[at].command in _TAKEOFFS:
                break
        return tuple(back)

    def _flown_to(self, at: int, item: MissionItem, stage: Stage | None) -> Stage:
        """Return a place of the mission as a return flies to it."""
        kind = _KINDS.get(item.command, StageKind.GO)
        if stage is not None:
            return replace(stage, kind=kind, hold_s=0.0, speed_m_s=None, way=None)
        latitude_deg, longitude_deg = item.latitude_deg or 0.0, item.longitude_deg or 0.0
        east, north = self._route.frame.east_north_m([latitude_deg], [longitude_deg])
        lands = kind is StageKind.LAND
        return Stage(
            kind=kind,
            item=at + 1,
            east_m=float(east[0]),
            north_m=float(north[0]),
            height_m=self._ground_m(latitude_deg, longitude_deg) if lands else self.height_m(at),
        )


_KINDS: Mapping[int, StageKind] = {
    Command.NAV_LAND: StageKind.LAND,
    Command.NAV_VTOL_LAND: StageKind.LAND,
    Command.NAV_LOITER_TO_ALT: StageKind.CHANGE_HEIGHT,
}


def _passed(kind: StageKind) -> StageKind:
    return StageKind.GO if kind is StageKind.LAND else kind
