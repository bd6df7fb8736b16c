"""From a mission to the route it asks for: places in metres, heights above home, speeds carried along."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NoReturn

from planner.catalogue.altitude import FRAME_UNSUPPORTED, HOME_ALTITUDE_UNKNOWN, ZERO_TAKEOFF
from planner.catalogue.mission import (
    HOME_UNKNOWN,
    LANDING_MISSING,
    NOTHING_TO_FLY,
    TAKEOFF_MISSING,
)
from planner.catalogue.time import ITEM_NOT_MODELLED, ITEMS_NOT_FLOWN
from planner.catalogue.tool import NO_TERRAIN_DATA
from planner.errors import MissionFileError
from planner.geo.local_frame import LocalFrame
from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    Command,
    command_name,
    frame_name,
)
from planner.mission.stage import Route, Stage, StageKind

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.mission.items import Mission, MissionItem

_LONGEST_HOLD_S = 30.0 * 86400.0
_FASTEST_M_S = 1000.0
_HIGHEST_M = 100_000.0


def make_route(mission: Mission, *, home_amsl_m: float | None = None) -> Route:
    """Return the route a mission asks for.

    Parameters
    ----------
    mission : Mission
        As read from its file.
    home_amsl_m : float, optional
        Altitude of the take-off place; default the mission's own. [m AMSL]

    Returns
    -------
    Route
        Stages in flown order with what had to be assumed as findings; no stages where the mission
        holds no flight.

    Raises
    ------
    MissionFileError
        If an item holds a number no vehicle can fly.
    """
    course = _Course.begin(mission, home_amsl_m)
    for number, item in enumerate(mission.items, start=1):
        if course.is_over:
            course.leave_out(number, len(mission.items))
            break
        course.follow(number, item)
    return course.end()


@dataclass(slots=True)
class _Draft:
    """A stage before its place is laid into the frame of home."""

    kind: StageKind
    item: int
    latitude_deg: float
    longitude_deg: float
    height_m: float
    speed_m_s: float | None
    hold_s: float


@dataclass(slots=True)
class _Course:
    """Where the mission has got to while its items are followed one by one."""

    mission: Mission
    home_deg: tuple[float, float]
    home_amsl_m: float | None
    latitude_deg: float
    longitude_deg: float
    height_m: float = 0.0
    speed_m_s: float | None = None
    is_over: bool = False
    drafts: list[_Draft] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    amsl_items: list[int] = field(default_factory=list)
    unresolved: list[tuple[int, MissionItem]] = field(default_factory=list)

    @classmethod
    def begin(cls, mission: Mission, home_amsl_m: float | None) -> _Course:
        """Return a course that stands at home."""
        findings: list[Finding] = []
        home = mission.home
        if home is not None:
            place = (home.latitude_deg, home.longitude_deg)
            amsl = home.altitude_amsl_m if home_amsl_m is None else home_amsl_m
        else:
            amsl = home_amsl_m
            placed = ((n, i) for n, i in enumerate(mission.items, start=1) if _has_place(i))
            first = next(placed, None)
            place = (0.0, 0.0)
            if first is not None:
                number, item = first
                place = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
                findings.append(
                    HOME_UNKNOWN.finding(
                        f"home unknown: the flight is taken to start at the place of item {number}",
                        item=number,
                        place=item.place,
                    )
                )
        return cls(
            mission=mission,
            home_deg=place,
            home_amsl_m=amsl,
            latitude_deg=place[0],
            longitude_deg=place[1],
            findings=findings,
        )

    def follow(self, number: int, item: MissionItem) -> None:
        """Take one item into the course."""
        match item.command:
            case Command.NAV_TAKEOFF:
                self._take_off(number, item)
            case Command.NAV_WAYPOINT | Command.NAV_LOITER_TIME:
                self._go(StageKind.GO, number, item, hold_s=self._hold_s(number, item))
            case Command.NAV_LAND:
                self._move_to(item)
                self.height_m = 0.0
                self._add(StageKind.LAND, number)
                self.is_over = True
            case Command.NAV_RETURN_TO_LAUNCH:
                self.latitude_deg, self.longitude_deg = self.home_deg
                self.height_m = 0.0
                self._add(StageKind.RETURN, number)
                self.is_over = True
            case Command.DO_CHANGE_SPEED:
                self._change_speed(number, item)
            case _:
                self._assume_nothing(number, item, "0 s and 0 Wh are assumed")

    def leave_out(self, first: int, last: int) -> None:
        """Say that items behind the end of the flight are not flown."""
        which = f"item {first} stands" if first == last else f"items {first} to {last} stand"
        self.findings.append(
            ITEMS_NOT_FLOWN.finding(
                f"{which} behind the end of the flight at item {self.drafts[-1].item}: not flown",
                item=first,
                place=self.mission.items[first - 1].place,
            )
        )

    def end(self) -> Route:
        """Return the finished route."""
        if not self.drafts:
            self.findings.append(
                NOTHING_TO_FLY.finding(f"none of the {len(self.mission.items)} items is a flight")
            )
        else:
            self._begin_with_takeoff()
            if not self.is_over:
                last = self.drafts[-1].item
                self.findings.append(
                    LANDING_MISSING.finding(
                        f"the mission ends in the air at item {last}: "
                        "the way home and the landing are not counted",
                        item=last,
                        place=self.mission.items[last - 1].place,
                    )
                )
        self._say_what_altitudes_assume()
        frame = LocalFrame(latitude_deg=self.home_deg[0], longitude_deg=self.home_deg[1])
        east, north = frame.east_north_m(
            [draft.latitude_deg for draft in self.drafts],
            [draft.longitude_deg for draft in self.drafts],
        )
        return Route(
            stages=tuple(
                Stage(
                    kind=draft.kind,
                    item=draft.item,
                    east_m=e,
                    north_m=n,
                    height_m=draft.height_m,
                    speed_m_s=draft.speed_m_s,
                    hold_s=draft.hold_s,
                )
                for draft, e, n in zip(self.drafts, east.tolist(), north.tolist(), strict=True)
            ),
            frame=frame,
            home_amsl_m=self.home_amsl_m or 0.0,
            findings=tuple(self.findings),
        )

    def _add(self, kind: StageKind, number: int, hold_s: float = 0.0) -> None:
        self.drafts.append(
            _Draft(
                kind,
                number,
                self.latitude_deg,
                self.longitude_deg,
                self.height_m,
                self.speed_m_s,
                hold_s,
            )
        )

    def _go(self, kind: StageKind, number: int, item: MissionItem, hold_s: float = 0.0) -> None:
        self._move_to(item)
        self.height_m = self._height_m(number, item)
        self._add(kind, number, hold_s)

    def _take_off(self, number: int, item: MissionItem) -> None:
        self._go(StageKind.TAKEOFF, number, item)
        if self.height_m <= 0.0 and len(self.drafts) == 1:
            self.findings.append(
                ZERO_TAKEOFF.finding(
                    f"item {number} takes off to {self.height_m:.1f} m above home",
                    item=number,
                    place=item.place,
                )
            )

    def _change_speed(self, number: int, item: MissionItem) -> None:
        kind, speed = item.param1 or 0.0, item.param2
        if kind not in {0.0, 1.0}:
            self._assume_nothing(number, item, "climb and descent speeds are left as they are")
        elif speed is not None and speed > 0.0:
            if speed > _FASTEST_M_S:
                self._refuse(number, item, f"a speed of {speed:g} m/s cannot be flown")
            self.speed_m_s = speed

    def _hold_s(self, number: int, item: MissionItem) -> float:
        hold = item.param1 or 0.0
        if hold > _LONGEST_HOLD_S:
            self._refuse(number, item, f"a hold of {hold:g} s is longer than any flight")
        if hold < 0.0:
            self._assume_nothing(number, item, f"its hold of {hold:g} s is taken as 0 s")
        return max(hold, 0.0)

    def _move_to(self, item: MissionItem) -> None:
        if _has_place(item):
            # _has_place has seen both; the narrowing does not reach here.
            self.latitude_deg = item.latitude_deg or 0.0
            self.longitude_deg = item.longitude_deg or 0.0

    def _height_m(self, number: int, item: MissionItem) -> float:
        """Return the item's altitude as a height above home."""
        altitude = item.altitude_m
        if altitude is None:
            self.unresolved.append((number, item))
            return self.height_m
        if not abs(altitude) <= _HIGHEST_M:
            self._refuse(number, item, f"an altitude of {altitude:g} m cannot be flown")
        if item.frame in AMSL_FRAMES:
            self.amsl_items.append(number)
            return altitude - (self.home_amsl_m or 0.0)
        if item.frame not in RELATIVE_FRAMES:
            self.unresolved.append((number, item))
        return altitude

    def _begin_with_takeoff(self) -> None:
        first = self.drafts[0]
        if first.kind is StageKind.TAKEOFF:
            return
        item = self.mission.items[first.item - 1]
        height = max(first.height_m, 0.0)
        self.findings.append(
            TAKEOFF_MISSING.finding(
                f"the flight begins with {command_name(item.command)} (item {first.item}): "
                f"a vertical take-off to {height:.1f} m is assumed",
                item=first.item,
                place=item.place,
            )
        )
        takeoff = _Draft(StageKind.TAKEOFF, first.item, *self.home_deg, height, None, 0.0)
        self.drafts.insert(0, takeoff)

    def _say_what_altitudes_assume(self) -> None:
        if self.amsl_items and self.home_amsl_m is None:
            first = self.amsl_items[0]
            self.findings.append(
                HOME_ALTITUDE_UNKNOWN.finding(
                    "home altitude unknown: 0 m AMSL is assumed for "
                    f"{len(self.amsl_items)} items with AMSL altitudes",
                    item=first,
                    place=self.mission.items[first - 1].place,
                )
            )
        for number, item in self.unresolved[:1]:
            more = f" (and {len(self.unresolved) - 1} more)" if len(self.unresolved) > 1 else ""
            what = (
                "has no altitude: the height before it is kept"
                if item.altitude_m is None
                else f"has frame {item.frame} ({frame_name(item.frame)}): "
                "its altitude is taken as height above home"
            )
            self.findings.append(
                FRAME_UNSUPPORTED.finding(
                    f"item {number}{more} {what}", item=number, place=item.place
                )
            )
        if self.drafts:
            level = "" if self.home_amsl_m is None else f" ({self.home_amsl_m:.1f} m AMSL)"
            self.findings.append(
                NO_TERRAIN_DATA.finding(
                    f"no terrain data: the ground is taken to be level with home{level}"
                )
            )

    def _assume_nothing(self, number: int, item: MissionItem, assumed: str) -> None:
        self.findings.append(
            ITEM_NOT_MODELLED.finding(
                f"item {number} {command_name(item.command)} is not modelled: {assumed}",
                item=number,
                place=item.place,
            )
        )

    def _refuse(self, number: int, item: MissionItem, why: str) -> NoReturn:
        raise MissionFileError(
            f"item {number} {command_name(item.command)}: {why}; correct the item",
            source=self.mission.source,
            place=item.place,
        )


def _has_place(item: MissionItem) -> bool:
    """Return whether an item names a place; 0°, 0° stands for 'here' in files."""
    return (
        item.latitude_deg is not None
        and item.longitude_deg is not None
        and (item.latitude_deg != 0.0 or item.longitude_deg != 0.0)
    )
