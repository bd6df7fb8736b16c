"""Where a mission half followed is: the place and the height that items stand for, home, and the ground."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import msgspec
import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import MissionFileError
from planner.findings import Remarks, Rule, Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import (
    AMSL_FRAMES,
    LANDINGS,
    RELATIVE_FRAMES,
    TAKEOFFS,
    TERRAIN_FRAMES,
    Command,
    Frame,
    command_name,
    frame_name,
    is_destination,
)
from planner.mission.takers import unless_named
from planner.values import field

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Place
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import MissionItem

_GROUND_SAMPLES, _MOST_GROUND_SAMPLES = 65, 1025
"""Of the ground along a leg: one a cell, but so many."""
_HIGHEST_M = 10_000.0
"""No multicopter gets there; the air of the prediction ends not far above. [m]"""
_GROUND_OFF_LINE_M = 2.0
"""Grids of the ground are no better than this. [m]"""
_GOING = frozenset({Command.NAV_WAYPOINT, Command.NAV_SPLINE_WAYPOINT})
"""Commands that make no sense without a place; others are often meant 'here'."""
_WITHOUT_PLACE = {
    Autopilot.PX4: "PX4 knows no 'here' and flies to whatever number is sent",
    Autopilot.ARDUPILOT: "ArduPilot refuses what is no number, 'here' is 0°, 0°",
}
"""What an autopilot makes of an item whose place is no number: ``AP_Mission::mavlink_int_to_mission_cmd``
refuses what ``check_lat`` holds for no latitude; at 0°, 0° ``ModeAuto::do_land`` lands where it is."""


def is_on_earth(latitude_deg: float, longitude_deg: float) -> bool:
    """Return whether a latitude and a longitude are a place."""
    return abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0


def ground_amsl_m(terrain: TerrainGrid, latitude_deg: float, longitude_deg: float) -> float | None:
    """Return the ground's altitude at a place; ``None`` where the grid does not know it. [m AMSL]"""
    ground = terrain.height_amsl_m(latitude_deg, longitude_deg)
    return None if ground.mask.any() else float(ground)


def is_amsl(frame: int, dialect: Autopilot | None) -> bool:
    """Return whether altitudes of a frame count from the sea."""
    return frame in AMSL_FRAMES or (frame == Frame.MISSION and dialect is Autopilot.ARDUPILOT)


def counts_from_sea(items: Sequence[MissionItem], dialect: Autopilot | None) -> bool:
    """Return whether an altitude that decides where a mission flies counts from the sea."""
    return any(
        item.command == Command.DO_SET_HOME
        or (
            is_amsl(item.frame, dialect)
            and item.altitude_m is not None
            and is_destination(item.command)
            and item.command not in LANDINGS
        )
        for item in items
        if item.frame not in RELATIVE_FRAMES
    )


FRAME_NOT_RESOLVED = Rule(
    "A103 frame-not-resolved",
    Severity.ERROR,
    summary="An item's altitude reference cannot be resolved.",
    why="Every ground station has lost a frame once; crashes followed (QGroundControl #10596).",
    how="The item's frame is none of those resolved to a height above home.",
    fix="use altitudes relative to home or AMSL",
    instead="altitudes above home or AMSL",
)

AMSL_SUSPECT = Rule(
    "A107 amsl-suspect",
    Severity.ERROR,
    summary="An altitude looks as if the other reference was meant, home or sea level.",
    why="Scripts, and Mission Planner before Copter 3.4 (#953), wrote heights above home in frame 0, "
    "which means AMSL: the vehicle would fly into the ground, or is refused.  The other way round it "
    "climbs by the altitude of home too high (MissionPlanner #1741, a crash).",
    how="An item in frame 0 or 5 is not above home's altitude, nor above the ground of the terrain "
    "grid at its place: an error.  A warning where one in frame 3 or 6 is more than 500 m above home, "
    "or more than 150 m and up to 300 m above home's own altitude, home being more than 30 m AMSL.",
    fix="write the altitude relative to home (frame 3), or give the terrain with --terrain",
    instead="--terrain, or altitudes above home",
)

TERRAIN_ASSUMED_LEVEL = Rule(
    "A108 terrain-assumed-level",
    Severity.WARNING,
    summary="Altitudes above terrain are flown without knowing the terrain.",
    why="A height above ground in a terrain frame is an altitude only with a terrain grid.",
    how="Items in frame 10 or 11 and no terrain grid: ground assumed level with home.",
    fix="give the terrain with --terrain",
)

ALTITUDE_UNKNOWN = Rule(
    "A109 altitude-unknown",
    Severity.ERROR,
    summary="An item has no altitude.",
    why="QGroundControl writes null where it has not yet worked out a height above terrain; such an "
    "item cannot be flown as it is.",
    how="The seventh parameter of an item the vehicle flies to is null or NaN.",
    fix="open the mission in the program that wrote it, wait for the terrain, and save it again",
    instead="a mission with its altitudes",
)

ALTITUDE_FROM_TERRAIN = Rule(
    "A110 altitude-from-terrain",
    Severity.WARNING,
    summary="An altitude that the file leaves open was computed from the terrain grid.",
    why="QGroundControl writes null for an altitude above terrain that it has not worked out yet: the "
    "prediction can fly the height meant, the vehicle cannot.",
    how="AltitudeMode 3, the seventh parameter null: ground of --terrain plus 'Altitude'.",
    fix="open the mission in QGroundControl, wait for the terrain, and save it again",
)

ZERO_POSITION = Rule(
    "M110 zero-position",
    Severity.WARNING,
    summary="An item lies at 0° north, 0° east, or has no position.",
    why="To ArduPilot this means 'here'; to PX4 it is a place in the Gulf of Guinea.  The same file "
    "means two flights.",
    how="Latitude and longitude of an item the vehicle flies to, or of a home that is set, are both "
    "zero, or not given.  Where PX4 flies this is an error: what is predicted is not its flight (it makes a "
    "place of any number, MavlinkMissionManager::parse_mavlink_mission_item; programs send 0 for none).  On "
    "ArduPilot 0°, 0° is 'here' (ModeAuto::do_land and its like); it is an error where no number is given: "
    "what is sent then is no latitude and the upload is refused (AP_Mission::mavlink_int_to_mission_cmd, "
    "check_lat), or is what the program that sends it makes of it.  Where nothing names the autopilot 0°, 0° "
    "is an error unless PX4 refuses the upload; of a take-off a note: texts of Mission Planner have every "
    "take-off there.",
    fix="give the item the place it should be flown to",
    instead="a mission whose items have their places",
)

TERRAIN_NOT_FOLLOWED = Rule(
    "A112 terrain-not-followed",
    Severity.WARNING,
    summary="ArduPilot follows the ground between two items, which is not straight.",
    why="Heights above terrain are kept all along a leg: over hills the vehicle climbs and descends "
    "more than its items show.  For models flown by ArduPilot that is predicted: climbs and descents along "
    "the ground, and slowing down where it rises faster than the vehicle can climb (AC_WPNav, "
    "WP_TER_MARGIN).",
    how="Legs to items in a terrain frame, flown by ArduPilot over the ground of --terrain where that "
    "lies more than 2 m off the line between the ground at both ends.",
    fix="put items where the ground bends, so that the legs lie along it",
)


class Position(msgspec.Struct, kw_only=True, eq=False):
    """Where the vehicle is while items are followed, and what their places and altitudes count from."""

    source: str
    dialect: Autopilot | None
    """Whose reading of the items counts; ``None`` where neither file nor vehicle decides."""
    may_fly: frozenset[Autopilot]
    """That one, or those that may where none is named."""
    start_deg: tuple[float, float]
    """Where the flight starts. [°]"""
    home_deg: tuple[float, float]
    """Where a return leads, moved by DO_SET_HOME. [°]"""
    home_amsl_m: float | None
    ground_datum_m: float | None
    """What heights of the terrain are above home from. [m AMSL]"""
    terrain: TerrainGrid | None
    latitude_deg: float
    longitude_deg: float
    height_m: float = 0.0
    """Height above the home the flight started from. [m]"""
    datum_m: float = 0.0
    """Height of the present home, which relative altitudes count from, above the first. [m]"""
    ground_level_m: float = 0.0
    """Height of the ground above the first home, where the terrain is unknown. [m]"""
    number: int = 0
    """The item being followed, from 1."""
    place: Place | None = None
    """Of that item, in its file."""
    remarks: Remarks = field(default_factory=Remarks)
    amsl_items: list[int] = field(default_factory=list)

    @property
    def flies_as_ardupilot(self) -> bool:
        """Whether none but ArduPilot may fly, and nobody assumes PX4."""
        return self.dialect is not Autopilot.PX4 and self.may_fly == {Autopilot.ARDUPILOT}

    def unless_named(self, message: str) -> str:
        """Return what one autopilot does, and what to do where the other one may be meant."""
        return unless_named(message, self.may_fly)

    def move_to(self, item: MissionItem) -> None:
        """Go to the place of an item, if it names one."""
        if self.has_place(item):
            self.latitude_deg = item.latitude_deg or 0.0
            self.longitude_deg = item.longitude_deg or 0.0
        elif item.latitude_deg is None or item.longitude_deg is None:
            does = ", ".join(does for by, does in _WITHOUT_PLACE.items() if by in self.may_fly)
            # A take-off goes up where it stands; what PX4 makes of its place then nobody has tried here.
            if item.command in _GOING or (does and item.command not in TAKEOFFS):
                said = f"{does}; " if does else ""
                message = f"{command_name(item.command)} has no position: {said}predicted as 'here'"
                self.remark(ZERO_POSITION, message, severity=Severity.ERROR if does else None)

    def has_place(self, item: MissionItem) -> bool:
        """Return whether an item names a place; 0°, 0° means 'here', reported unless only ArduPilot flies."""
        latitude, longitude = item.latitude_deg, item.longitude_deg
        if latitude is None or longitude is None:
            return False
        if not is_on_earth(latitude, longitude):
            self.refuse(item, f"{latitude:g}°, {longitude:g}°: not a place on Earth")
        if latitude != 0.0 or longitude != 0.0:
            return True
        if not self.flies_as_ardupilot:
            name = command_name(item.command)
            message = f"{name} at 0°, 0°: PX4 flies to that place; predicted as 'here'"
            severity = None
            if self.dialect is not Autopilot.PX4 and item.command in TAKEOFFS:
                severity = Severity.INFO
            elif Autopilot.PX4 in self.may_fly:
                # It flies there, or returns there, and has no energy for it: the totals are not its flight.
                message, severity = self.unless_named(message), Severity.ERROR
            self.remark(ZERO_POSITION, message, severity=severity)
        return False

    def height_of_m(self, item: MissionItem) -> float:
        """Return the item's altitude as a height above the home the flight started from."""
        altitude = item.altitude_m
        if altitude is None:
            return self._height_left_open_m(item)
        if not abs(altitude) <= _HIGHEST_M:
            self.refuse(item, f"an altitude of {altitude:g} m cannot be flown")
        frame = item.frame
        if frame in RELATIVE_FRAMES:
            return altitude + self.datum_m
        if is_amsl(frame, self.dialect):
            self.amsl_items.append(self.number)
            height_m = altitude - (self.home_amsl_m or 0.0)
            self._doubt_amsl(item, height_m)
            return height_m
        if frame in TERRAIN_FRAMES:
            return altitude + self._terrain_m(item)
        self.remark(
            FRAME_NOT_RESOLVED,
            f"frame {frame} ({frame_name(frame)}): its altitude is read as height above home",
        )
        return altitude + self.datum_m

    def _height_left_open_m(self, item: MissionItem) -> float:
        """Return the height of an item without altitude: from the terrain, or as it was."""
        agl_m, ground_m = item.unresolved_agl_m, self.known_ground_m()
        if ground_m is None or agl_m is None:
            known = "" if agl_m is None else " (give --terrain to compute it)"
            message = f"no altitude: the previous height is kept{known}"
            self.remark(ALTITUDE_UNKNOWN, message)
            return self.height_m
        height_m = ground_m + agl_m
        self.remark(
            ALTITUDE_FROM_TERRAIN,
            f"no altitude in the file: {quantity.height(agl_m)} above the terrain grid, "
            f"{quantity.height(height_m)} above home",
        )
        return height_m

    def _followed_ground_m(self, from_deg: tuple[float, float]) -> tuple[float, ...]:
        """Return the ground along the leg, evenly spaced; report it where a straight line leaves it.

        Empty where it is not known all along. [m AMSL]
        """
        to_deg = (self.latitude_deg, self.longitude_deg)
        if self.terrain is None or from_deg == to_deg:
            return ()
        length_m = float(distance_m(*from_deg, *to_deg))
        cells = int(length_m / self.terrain.cell_m) + 2
        count = min(max(cells, _GROUND_SAMPLES), _MOST_GROUND_SAMPLES)
        fraction = np.linspace(0.0, 1.0, count)
        ground = self.terrain.height_amsl_m(
            *(a + fraction * (b - a) for a, b in zip(from_deg, to_deg, strict=True))
        )
        if np.ma.getmaskarray(ground).any():
            return ()
        height = np.asarray(ground, np.float64)
        line = height[0] + fraction * (height[-1] - height[0])
        off_line_m = float(np.abs(height - line).max())
        if off_line_m > _GROUND_OFF_LINE_M:
            steepest = float(np.abs(np.diff(height)).max()) * (count - 1) / length_m
            self.remark(
                TERRAIN_NOT_FOLLOWED,
                f"the ground on the leg is up to {quantity.height(off_line_m)} off the line "
                f"between the items and is up to {quantity.percent(steepest)} steep: ArduPilot follows "
                "it, more slowly where it cannot climb so fast; of a step-response model the energy of these "
                "climbs is bounded (E127)",
            )
        return tuple(height.tolist())

    def home_ground_m(self) -> float:
        """Return the height of the ground at the present home above the first. [m]"""
        if self.home_deg == self.start_deg:
            return 0.0
        ground_m = self.known_ground_m(self.home_deg)
        return self.ground_level_m if ground_m is None else ground_m

    def _doubt_amsl(self, item: MissionItem, height_m: float) -> None:
        """Report an AMSL altitude that is not above home, unless the ground is known to fall."""
        if self.home_amsl_m is None or height_m > 0.0:
            return
        ground_m = self.known_ground_m()
        if ground_m is not None and height_m > ground_m:
            return
        below = "at home's level" if height_m == 0.0 else f"{quantity.height(-height_m)} below home"
        altitude = quantity.height(item.altitude_m)
        self.remark(AMSL_SUSPECT, f"{altitude} AMSL, {below}: probably meant above home")

    def _terrain_m(self, item: MissionItem) -> float:
        """Return the ground's height above the first home at the present place."""
        ground_m = self.known_ground_m()
        if ground_m is not None:
            return ground_m
        altitude = quantity.height(item.altitude_m)
        message = f"{altitude} above unknown terrain: read as height above home"
        self.remark(TERRAIN_ASSUMED_LEVEL, message)
        return self.datum_m

    def ground_m(self) -> float:
        """Return the height of the ground at the present place; home's where it is not known. [m]"""
        ground_m = self.known_ground_m()
        return self.ground_level_m if ground_m is None else ground_m

    def known_ground_m(self, place_deg: tuple[float, float] | None = None) -> float | None:
        """Return the height of the ground there, or here; ``None`` where no grid tells. [m]"""
        if self.terrain is None or self.ground_datum_m is None:
            return None
        place_deg = place_deg or (self.latitude_deg, self.longitude_deg)
        ground_m = ground_amsl_m(self.terrain, *place_deg)
        return None if ground_m is None else ground_m - self.ground_datum_m

    def remark(
        self, rule: Rule, message: str, *, severity: Severity | None = None, fix: str | None = None
    ) -> None:
        """Report something about the item being followed."""
        self.remarks.add(
            rule, message, item=self.number, place=self.place, severity=severity, fix=fix
        )

    def refuse(self, item: MissionItem, why: str) -> NoReturn:
        """Raise the error about a number that no vehicle can fly."""
        message = f"item {self.number} {command_name(item.command)}: {why}; correct the item"
        raise MissionFileError(message, source=self.source, place=self.place)
