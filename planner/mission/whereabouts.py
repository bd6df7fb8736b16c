"""Where a mission has got to, and where its items lie from there.

An item means what the autopilot that flies it makes of it (ArduPilot: 0°, 0° is "here", an altitude of
0 is "as before"; PX4: both are taken literally).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NoReturn

from planner import numbers
from planner.autopilot import Autopilot
from planner.catalogue.altitude import (
    ALTITUDE_FROM_TERRAIN,
    ALTITUDE_UNKNOWN,
    AMSL_SUSPECT,
    FRAME_NOT_RESOLVED,
    TERRAIN_ASSUMED_LEVEL,
    ZERO_ALTITUDE,
)
from planner.catalogue.mission import ZERO_POSITION
from planner.errors import MissionFileError
from planner.findings import Severity
from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    Command,
    Frame,
    command_name,
    frame_name,
)
from planner.mission.remarks import Remarks

if TYPE_CHECKING:
    from planner.findings import Rule
    from planner.geo.terrain import TerrainGrid
    from planner.mission.draft import Draft
    from planner.mission.items import MissionItem

HIGHEST_M = 10_000.0
"""No multicopter gets there; the air of the prediction ends not far above. [m]"""
TAKEOFFS = frozenset({Command.NAV_TAKEOFF, Command.NAV_VTOL_TAKEOFF})


_GOING = frozenset({Command.NAV_WAYPOINT, Command.NAV_SPLINE_WAYPOINT})
"""Commands that make no sense without a place; others are often meant 'here'."""


def is_on_earth(latitude_deg: float, longitude_deg: float) -> bool:
    """Return whether a latitude and a longitude are a place."""
    return abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0


def ground_amsl_m(terrain: TerrainGrid, latitude_deg: float, longitude_deg: float) -> float | None:
    """Return the ground's altitude at a place; ``None`` where the grid does not know it. [m AMSL]"""
    ground = terrain.height_amsl_m(latitude_deg, longitude_deg)
    return None if ground.mask.any() else float(ground)


@dataclass(slots=True)
class Whereabouts:
    """A place and a height, home, and what has been flown and told on the way there."""

    source: str
    meaning: Autopilot | None
    """Whose reading of the items counts; ``None`` where neither file nor vehicle says."""
    start_deg: tuple[float, float]
    """Where the flight starts. [°]"""
    home_deg: tuple[float, float]
    """Where a return leads, moved by DO_SET_HOME. [°]"""
    home_amsl_m: float | None
    terrain: TerrainGrid | None
    latitude_deg: float
    longitude_deg: float
    height_m: float = 0.0
    """Height above the home the flight started from. [m]"""
    datum_m: float = 0.0
    """Height of the present home, which relative altitudes count from, above the first. [m]"""
    ground_level_m: float = 0.0
    """Height of the ground above the first home, where no terrain tells it. [m]"""
    drafts: list[Draft] = field(default_factory=list)
    remarks: Remarks = field(default_factory=Remarks)
    amsl_items: list[int] = field(default_factory=list)

    def move_to(self, number: int, item: MissionItem) -> None:
        """Go to the place of an item, if it names one."""
        is_going = item.command in _GOING
        if is_going and (item.latitude_deg is None or item.longitude_deg is None):
            self.remark(
                ZERO_POSITION,
                number,
                item,
                f"{command_name(item.command)} has no position: taken as 'here'",
            )
        elif self.has_place(number, item):
            self.latitude_deg = item.latitude_deg or 0.0
            self.longitude_deg = item.longitude_deg or 0.0

    def has_place(self, number: int, item: MissionItem) -> bool:
        """Return whether an item names a place; 0°, 0° is taken as 'here', and said on PX4."""
        latitude, longitude = item.latitude_deg, item.longitude_deg
        if latitude is None or longitude is None:
            return False
        if not is_on_earth(latitude, longitude):
            self.refuse(number, item, f"{latitude:g}°, {longitude:g}° is no place on Earth")
        if latitude != 0.0 or longitude != 0.0:
            return True
        is_going = item.command in _GOING
        if self.meaning is Autopilot.PX4 or (is_going and self.meaning is None):
            # PX4 flies there, or returns there, and has no energy for it: the totals are not its flight
            is_lost = self.meaning is Autopilot.PX4
            self.remark(
                ZERO_POSITION,
                number,
                item,
                f"{command_name(item.command)} at 0°, 0°: PX4 takes this for a place; "
                "taken as 'here'",
                severity=Severity.ERROR if is_lost else None,
            )
        return False

    def height_of_m(self, number: int, item: MissionItem) -> float:
        """Return the item's altitude as a height above the home the flight started from."""
        altitude = item.altitude_m
        if altitude is None:
            return self._height_left_open_m(number, item)
        if not abs(altitude) <= HIGHEST_M:
            self.refuse(number, item, f"an altitude of {altitude:g} m cannot be flown")
        if altitude == 0.0 and self.drafts:
            if self.meaning is Autopilot.ARDUPILOT:
                return self.height_m
            if item.frame in RELATIVE_FRAMES | TERRAIN_FRAMES and item.command not in TAKEOFFS:
                return self._zero_height_m(number, item)
        return self._above_home_m(number, item, altitude)

    def _above_home_m(self, number: int, item: MissionItem, altitude: float) -> float:
        """Return an altitude in an item's frame as a height above the first home."""
        frame = item.frame
        if frame in RELATIVE_FRAMES:
            return altitude + self.datum_m
        if frame in AMSL_FRAMES or (frame == Frame.MISSION and self.meaning is Autopilot.ARDUPILOT):
            self.amsl_items.append(number)
            height_m = altitude - (self.home_amsl_m or 0.0)
            self._doubt_amsl(number, item, height_m)
            return height_m
        if frame in TERRAIN_FRAMES:
            return altitude + self._terrain_m(number, item)
        self.remark(
            FRAME_NOT_RESOLVED,
            number,
            item,
            f"frame {frame} ({frame_name(frame)}): its altitude is taken as height above home",
        )
        return altitude + self.datum_m

    def _height_left_open_m(self, number: int, item: MissionItem) -> float:
        """Return the height of an item without altitude: from the terrain, or as it was."""
        ground_m = (
            None
            if item.unresolved_agl_m is None
            else self._known_ground_m(self.latitude_deg, self.longitude_deg)
        )
        if ground_m is None or item.unresolved_agl_m is None:
            known = "" if item.unresolved_agl_m is None else " (--terrain would tell it)"
            message = f"has no altitude: the height before it is kept{known}"
            self.remark(ALTITUDE_UNKNOWN, number, item, message)
            return self.height_m
        height_m = ground_m + item.unresolved_agl_m
        self.remark(
            ALTITUDE_FROM_TERRAIN,
            number,
            item,
            f"has no altitude in the file: {numbers.height(item.unresolved_agl_m)} above the "
            f"terrain grid, {numbers.height(height_m)} above home",
        )
        return height_m

    def _zero_height_m(self, number: int, item: MissionItem) -> float:
        """Return the height of an item in the air with altitude 0, where not ArduPilot's is meant."""
        ways = "PX4 flies to home's level, ArduPilot keeps its height"
        if self.meaning is Autopilot.PX4:
            self.remark(ZERO_ALTITUDE, number, item, f"has altitude 0: {ways}")
            return self.datum_m
        message = f"has altitude 0: {ways}; the height is taken to be kept"
        self.remark(ZERO_ALTITUDE, number, item, message)
        return self.height_m

    def _doubt_amsl(self, number: int, item: MissionItem, height_m: float) -> None:
        """Tell of an AMSL altitude that is not above home, unless the ground is known to fall."""
        if self.home_amsl_m is None or height_m > 0.0:
            return
        ground_m = self._known_ground_m(self.latitude_deg, self.longitude_deg)
        if ground_m is not None and height_m > ground_m:
            return
        below = "at home's level" if height_m == 0.0 else f"{numbers.height(-height_m)} below home"
        self.remark(
            AMSL_SUSPECT,
            number,
            item,
            f"is at {numbers.height(item.altitude_m)} AMSL, {below}: probably meant above home",
        )

    def _terrain_m(self, number: int, item: MissionItem) -> float:
        """Return the ground's height above the first home at the present place."""
        ground_m = self._known_ground_m(self.latitude_deg, self.longitude_deg)
        if ground_m is not None:
            return ground_m
        self.remark(
            TERRAIN_ASSUMED_LEVEL,
            number,
            item,
            f"is {numbers.height(item.altitude_m)} above terrain that is not known: "
            "taken as height above home",
        )
        return self.datum_m

    def ground_m(self, latitude_deg: float, longitude_deg: float) -> float:
        """Return the height of the ground at a place; home's where it is not known. [m]"""
        ground_m = self._known_ground_m(latitude_deg, longitude_deg)
        return self.ground_level_m if ground_m is None else ground_m

    def _known_ground_m(self, latitude_deg: float, longitude_deg: float) -> float | None:
        if self.terrain is None or self.home_amsl_m is None:
            return None
        ground_m = ground_amsl_m(self.terrain, latitude_deg, longitude_deg)
        return None if ground_m is None else ground_m - self.home_amsl_m

    def remark(
        self,
        rule: Rule,
        number: int,
        item: MissionItem,
        message: str,
        *,
        severity: Severity | None = None,
    ) -> None:
        """Tell something about an item."""
        self.remarks.add(rule, message, item=number, place=item.place, severity=severity)

    def refuse(self, number: int, item: MissionItem, why: str) -> NoReturn:
        """Raise the error about a number of an item that no vehicle can fly."""
        message = f"item {number} {command_name(item.command)}: {why}; correct the item"
        raise MissionFileError(message, source=self.source, place=item.place)
