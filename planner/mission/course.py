"""The course: where a mission has got to while its items are followed one by one.

An item means what the autopilot that flies it makes of it (ArduPilot: 0°, 0° is "here", an altitude of
0 is "as before"; PX4: both are taken literally).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NoReturn

from planner import numbers
from planner.autopilot import Autopilot
from planner.catalogue.altitude import (
    ALTITUDE_UNKNOWN,
    FRAME_NOT_RESOLVED,
    TERRAIN_ASSUMED_LEVEL,
    ZERO_TAKEOFF,
)
from planner.catalogue.mission import ZERO_POSITION
from planner.catalogue.time import ENDLESS, ITEM_NOT_MODELLED, WAIT_NOT_COUNTED, WAITS_FOR_EVER
from planner.errors import MissionFileError
from planner.mission.command_support import CommandEffect, command_effect
from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    Command,
    Frame,
    command_name,
    frame_name,
    is_destination,
)
from planner.mission.remarks import Remarks
from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.findings import Rule
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import MissionItem

LONGEST_HOLD_S = 30.0 * 86400.0
FASTEST_M_S = 1000.0
HIGHEST_M = 100_000.0
MOST_TURNS = 100_000.0
LARGEST_RADIUS_M = 100_000.0


def ground_amsl_m(terrain: TerrainGrid, latitude_deg: float, longitude_deg: float) -> float | None:
    """Return the ground's altitude at a place; ``None`` where the grid does not know it. [m AMSL]"""
    ground = terrain.height_amsl_m(latitude_deg, longitude_deg)
    return None if ground.mask.any() else float(ground)


@dataclass(slots=True)
class Draft:
    """A stage before its place is laid into the frame of home."""

    kind: StageKind
    item: int
    latitude_deg: float
    longitude_deg: float
    height_m: float
    speed_m_s: float | None = None
    climb_speed_m_s: float | None = None
    descent_speed_m_s: float | None = None
    hold_s: float = 0.0
    acceptance_radius_m: float | None = None
    yaw_deg: float | None = None
    turns: float = 0.0
    radius_m: float = 0.0


@dataclass(slots=True)
class Course:
    """The state of a mission half followed: place, height, speeds, home."""

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
    speed_m_s: float | None = None
    climb_speed_m_s: float | None = None
    descent_speed_m_s: float | None = None
    is_over: bool = False
    drafts: list[Draft] = field(default_factory=list)
    remarks: Remarks = field(default_factory=Remarks)
    amsl_items: list[int] = field(default_factory=list)

    def follow(self, number: int, item: MissionItem) -> None:
        """Take one item into the course.

        Raises
        ------
        MissionFileError
            If the item holds a number no vehicle can fly.
        """
        _WAYS.get(item.command, Course.pass_by)(self, number, item)
        if not item.autocontinue and self.meaning is not Autopilot.ARDUPILOT:
            self._remark(
                WAITS_FOR_EVER,
                number,
                item,
                "autoContinue is off: PX4 holds here; the flight is taken to go on",
            )

    def waypoint(self, number: int, item: MissionItem) -> None:
        """Fly to a place and hold there."""
        self._go(StageKind.GO, number, item, hold_s=self._hold_s(number, item))

    def loiter_time(self, number: int, item: MissionItem) -> None:
        """Fly to a place and stay for a time."""
        self._go(StageKind.LOITER, number, item, hold_s=self._hold_s(number, item))

    def loiter_for_ever(self, number: int, item: MissionItem) -> None:
        """Fly to a place and stay: the prediction ends."""
        self._go(StageKind.LOITER, number, item)
        self._remark(ENDLESS, number, item, "the vehicle stays here until it is told otherwise")
        self.is_over = True

    def spline(self, number: int, item: MissionItem) -> None:
        """Fly to a place along a curve."""
        self._go(StageKind.SPLINE, number, item, hold_s=self._hold_s(number, item))

    def change_height(self, number: int, item: MissionItem) -> None:
        """Fly to a place, then change height there."""
        self._go(StageKind.CHANGE_HEIGHT, number, item)

    def return_home(self, number: int, _item: MissionItem) -> None:
        """Return and land: the flight is over."""
        self.latitude_deg, self.longitude_deg = self.home_deg
        self.height_m = self.datum_m
        self._add(StageKind.RETURN, number)
        self.is_over = True

    def _add(self, kind: StageKind, number: int) -> Draft:
        draft = Draft(
            kind,
            number,
            self.latitude_deg,
            self.longitude_deg,
            self.height_m,
            self.speed_m_s,
            self.climb_speed_m_s,
            self.descent_speed_m_s,
        )
        self.drafts.append(draft)
        return draft

    def _go(self, kind: StageKind, number: int, item: MissionItem, hold_s: float = 0.0) -> None:
        self._move_to(number, item)
        self.height_m = self._height_m(number, item)
        draft = self._add(kind, number)
        draft.hold_s = hold_s
        draft.yaw_deg = item.param4
        if kind is StageKind.GO and item.param2 is not None and item.param2 > 0.0:
            draft.acceptance_radius_m = min(item.param2, LARGEST_RADIUS_M)

    def take_off(self, number: int, item: MissionItem) -> None:
        """Leave the ground."""
        if self.meaning is not Autopilot.ARDUPILOT:  # ArduPilot takes off where it stands
            self._move_to(number, item)
        self.height_m = self._height_m(number, item)
        is_first = not any(d.kind is not StageKind.DELAY for d in self.drafts)
        self._add(StageKind.TAKEOFF, number).yaw_deg = item.param4
        if is_first and self.height_m <= 0.0:
            self._remark(
                ZERO_TAKEOFF,
                number,
                item,
                f"takes off to {numbers.height(self.height_m)} above home",
            )

    def land(self, number: int, item: MissionItem) -> None:
        """Land at a place: the flight is over."""
        self._move_to(number, item)
        self.height_m = self._ground_m()
        self._add(StageKind.LAND, number).yaw_deg = item.param4
        self.is_over = True

    def circle(self, number: int, item: MissionItem) -> None:
        """Fly turns about a place."""
        self._move_to(number, item)
        self.height_m = self._height_m(number, item)
        turns, radius = abs(item.param1 or 0.0), item.param3 or 0.0
        if turns > MOST_TURNS or abs(radius) > LARGEST_RADIUS_M:
            self._refuse(number, item, f"{turns:g} turns of {radius:g} m cannot be flown")
        draft = self._add(StageKind.CIRCLE, number)
        draft.turns = turns
        draft.radius_m = radius

    def delay(self, number: int, item: MissionItem) -> None:
        """Wait for a time, or until a time of day."""
        seconds = item.param1 or 0.0
        if seconds > LONGEST_HOLD_S:
            self._refuse(number, item, f"a delay of {seconds:g} s is longer than any flight")
        in_air = bool(self.drafts)
        if seconds <= 0.0 and self.meaning is not Autopilot.PX4:
            clock = [item.param2, item.param3, item.param4]
            if any(part is not None and part >= 0.0 for part in clock):
                until = ":".join("--" if p is None or p < 0.0 else f"{p:02.0f}" for p in clock)
                where = "in the air" if in_air else "on the ground"
                self._remark(
                    WAIT_NOT_COUNTED, number, item, f"waits {where} until {until} UTC: not counted"
                )
        elif seconds > 0.0 and not in_air:
            self._remark(
                WAIT_NOT_COUNTED,
                number,
                item,
                f"waits {numbers.duration(seconds)} on the ground before the take-off: not counted",
            )
        elif seconds > 0.0:
            self._add(StageKind.DELAY, number).hold_s = seconds

    def set_down(self, number: int, item: MissionItem) -> None:
        """Lower a load to the ground."""
        self._move_to(number, item)
        self._add(StageKind.SET_DOWN, number)
        self._remark(
            ITEM_NOT_MODELLED,
            number,
            item,
            "NAV_PAYLOAD_PLACE: the load is taken to touch the ground at home's level and to weigh "
            "nothing",
        )

    def change_speed(self, number: int, item: MissionItem) -> None:
        """Take a new speed for what follows."""
        kind, speed = item.param1 or 0.0, item.param2
        if speed is not None and speed > FASTEST_M_S:
            self._refuse(number, item, f"a speed of {speed:g} m/s cannot be flown")
        if self.meaning is Autopilot.PX4:
            # PX4 does not look at the type; nothing above zero resets to its own cruise speed.
            self.speed_m_s = speed if speed is not None and speed > 0.0 else None
        elif speed is None or speed <= 0.0:
            return
        elif kind == 2.0:
            self.climb_speed_m_s = speed
        elif kind == 3.0:
            self.descent_speed_m_s = speed
        elif kind in {0.0, 1.0}:
            self.speed_m_s = speed
        else:
            self._remark(
                ITEM_NOT_MODELLED,
                number,
                item,
                f"DO_CHANGE_SPEED: there is no speed type {kind:g}; the speed is left as it is",
            )

    def set_home(self, number: int, item: MissionItem) -> None:
        """Move the place a return leads to."""
        if item.param1 == 1.0 or not self._has_place(number, item):
            self.home_deg = (self.latitude_deg, self.longitude_deg)
            self.datum_m = self.height_m
            return
        self.home_deg = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
        if item.altitude_m is not None:
            self.amsl_items.append(number)
            self.datum_m = item.altitude_m - (self.home_amsl_m or 0.0)

    def pass_by(self, number: int, item: MissionItem) -> None:
        """Follow an item that is no flight of its own, or none that is predicted."""
        effect = command_effect(item.command)
        if effect is CommandEffect.NO_EFFECT or item.command in {
            Command.DO_JUMP,
            Command.DO_JUMP_TAG,
            Command.JUMP_TAG,
        }:
            return
        name = command_name(item.command)
        if is_destination(item.command) and self._has_place(number, item):
            self._go(StageKind.GO, number, item)
            assumed = "a straight flight to its place is assumed"
        else:
            assumed = "0 s and 0 Wh are assumed"
        self._remark(ITEM_NOT_MODELLED, number, item, f"{name} is not modelled: {assumed}")

    def _hold_s(self, number: int, item: MissionItem) -> float:
        hold = item.param1 or 0.0
        if hold == 0.0:
            return 0.0
        if hold > LONGEST_HOLD_S:
            self._refuse(number, item, f"a hold of {hold:g} s is longer than any flight")
        if hold < 0.0:
            self._remark(
                ITEM_NOT_MODELLED,
                number,
                item,
                f"{command_name(item.command)}: its hold of {hold:g} s is taken as 0 s",
            )
            return 0.0
        # ArduPilot keeps whole seconds (AP_Mission: p1 is a uint16).
        return float(int(hold)) if self.meaning is Autopilot.ARDUPILOT else hold

    def _move_to(self, number: int, item: MissionItem) -> None:
        if self._has_place(number, item):
            self.latitude_deg = item.latitude_deg or 0.0
            self.longitude_deg = item.longitude_deg or 0.0

    def _has_place(self, number: int, item: MissionItem) -> bool:
        """Return whether an item names a place; 0°, 0° is taken as 'here', and said on PX4."""
        latitude, longitude = item.latitude_deg, item.longitude_deg
        if latitude is None or longitude is None:
            return False
        if latitude != 0.0 or longitude != 0.0:
            return True
        if self.meaning is Autopilot.PX4:
            self._remark(
                ZERO_POSITION,
                number,
                item,
                f"{command_name(item.command)} at 0°, 0°: PX4 takes this for a place; "
                "taken as 'here'",
            )
        return False

    def _height_m(self, number: int, item: MissionItem) -> float:
        """Return the item's altitude as a height above the home the flight started from."""
        altitude = item.altitude_m
        if altitude is None:
            self._remark(
                ALTITUDE_UNKNOWN, number, item, "has no altitude: the height before it is kept"
            )
            return self.height_m
        if not abs(altitude) <= HIGHEST_M:
            self._refuse(number, item, f"an altitude of {altitude:g} m cannot be flown")
        if altitude == 0.0 and self.meaning is Autopilot.ARDUPILOT and self.drafts:
            return self.height_m
        frame = item.frame
        if frame in RELATIVE_FRAMES:
            return altitude + self.datum_m
        if frame in AMSL_FRAMES or (frame == Frame.MISSION and self.meaning is Autopilot.ARDUPILOT):
            self.amsl_items.append(number)
            return altitude - (self.home_amsl_m or 0.0)
        if frame in TERRAIN_FRAMES:
            return altitude + self._terrain_m(number, item)
        self._remark(
            FRAME_NOT_RESOLVED,
            number,
            item,
            f"frame {frame} ({frame_name(frame)}): its altitude is taken as height above home",
        )
        return altitude + self.datum_m

    def _terrain_m(self, number: int, item: MissionItem) -> float:
        """Return the ground's height above the first home at the present place."""
        ground_m = self._known_ground_m()
        if ground_m is not None:
            return ground_m
        self._remark(
            TERRAIN_ASSUMED_LEVEL,
            number,
            item,
            f"is {numbers.height(item.altitude_m)} above terrain that is not known: "
            "taken as height above home",
        )
        return self.datum_m

    def _ground_m(self) -> float:
        """Return the height of the ground at the present place; home's where it is not known."""
        ground_m = self._known_ground_m()
        return self.datum_m if ground_m is None else ground_m

    def _known_ground_m(self) -> float | None:
        if self.terrain is None or self.home_amsl_m is None:
            return None
        ground_m = ground_amsl_m(self.terrain, self.latitude_deg, self.longitude_deg)
        return None if ground_m is None else ground_m - self.home_amsl_m

    def _remark(self, rule: Rule, number: int, item: MissionItem, message: str) -> None:
        self.remarks.add(rule, message, item=number, place=item.place)

    def _refuse(self, number: int, item: MissionItem, why: str) -> NoReturn:
        message = f"item {number} {command_name(item.command)}: {why}; correct the item"
        raise MissionFileError(message, source=self.source, place=item.place)


_WAYS: Mapping[int, Callable[[Course, int, MissionItem], None]] = {
    Command.NAV_WAYPOINT: Course.waypoint,
    Command.NAV_SPLINE_WAYPOINT: Course.spline,
    Command.NAV_LOITER_TIME: Course.loiter_time,
    Command.NAV_LOITER_TURNS: Course.circle,
    Command.NAV_LOITER_TO_ALT: Course.change_height,
    Command.NAV_LOITER_UNLIM: Course.loiter_for_ever,
    Command.NAV_TAKEOFF: Course.take_off,
    Command.NAV_VTOL_TAKEOFF: Course.take_off,
    Command.NAV_LAND: Course.land,
    Command.NAV_VTOL_LAND: Course.land,
    Command.NAV_RETURN_TO_LAUNCH: Course.return_home,
    Command.NAV_DELAY: Course.delay,
    Command.NAV_PAYLOAD_PLACE: Course.set_down,
    Command.DO_CHANGE_SPEED: Course.change_speed,
    Command.DO_SET_HOME: Course.set_home,
}
"""How each command is followed; any other is passed by."""
