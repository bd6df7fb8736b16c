"""The course: what each command makes of the flight while the items are followed one by one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planner import numbers
from planner.autopilot import Autopilot
from planner.catalogue.altitude import TERRAIN_NOT_FOLLOWED, ZERO_TAKEOFF
from planner.catalogue.mission import HEADING_NORTH, VALUE_STORED_OTHERWISE
from planner.catalogue.time import ENDLESS, ITEM_NOT_MODELLED, WAIT_NOT_COUNTED, WAITS_FOR_EVER
from planner.findings import Severity
from planner.mission import ardupilot_storage
from planner.mission.command_support import (
    CommandEffect,
    Support,
    command_effect,
    goes_on_flying,
    support,
)
from planner.mission.commands import (
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    Command,
    command_name,
    is_destination,
)
from planner.mission.draft import Draft
from planner.mission.stage import StageKind
from planner.mission.whereabouts import Whereabouts

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.mission.items import MissionItem

LONGEST_HOLD_S = 30.0 * 86400.0
FASTEST_M_S = 1000.0
MOST_TURNS = 100_000.0
LARGEST_RADIUS_M = 100_000.0
_GROUND_OFF_LINE_M = 2.0
"""Grids of the ground are no better than this. [m]"""


@dataclass(slots=True)
class Course(Whereabouts):
    """The state of a mission half followed: place, height, speeds, home."""

    speed_m_s: float | None = None
    climb_speed_m_s: float | None = None
    descent_speed_m_s: float | None = None
    is_over: bool = False
    moved_homes: list[tuple[int, float, float, float]] = field(default_factory=list)
    """Stages before DO_SET_HOME, latitude and longitude [°], height of the ground there [m]."""

    def follow(self, number: int, item: MissionItem) -> None:
        """Take one item into the course.

        Raises
        ------
        MissionFileError
            If the item holds a number no vehicle can fly.
        """
        _WAYS.get(item.command, Course.pass_by)(self, number, item)
        if not item.autocontinue and self.meaning is not Autopilot.ARDUPILOT:
            is_px4 = self.meaning is Autopilot.PX4
            other = "" if is_px4 else ", ArduPilot goes on"
            message = f"autoContinue is off: PX4 holds here{other}; the flight is taken to go on"
            severity = Severity.ERROR if is_px4 else Severity.WARNING
            self.remark(WAITS_FOR_EVER, number, item, message, severity=severity)

    def waypoint(self, number: int, item: MissionItem) -> None:
        """Fly to a place and hold there."""
        if item.param4 == 0.0 and self.meaning is Autopilot.PX4:
            message = "NAV_WAYPOINT asks for heading 0°: PX4 turns north before it goes on"
            self.remark(HEADING_NORTH, number, item, message)
        self._go(StageKind.GO, number, item, hold_s=self._hold_s(number, item))

    def loiter_time(self, number: int, item: MissionItem) -> None:
        """Fly to a place and stay for a time."""
        self._go(StageKind.LOITER, number, item, hold_s=self._hold_s(number, item))

    def loiter_for_ever(self, number: int, item: MissionItem) -> None:
        """Fly to a place and stay: the prediction ends."""
        self._go(StageKind.LOITER, number, item)
        self.remark(ENDLESS, number, item, "the vehicle stays here until it is told otherwise")
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
        has_moved = self.home_deg != self.start_deg
        self.height_m = self.ground_m(*self.home_deg) if has_moved else self.ground_level_m
        # The speed of a return is set in the vehicle: what the mission commanded ends here.
        self._add(StageKind.RETURN, number).speed_m_s = None
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
        from_deg = (self.latitude_deg, self.longitude_deg)
        self.move_to(number, item)
        ground_m: tuple[float, ...] = ()
        if item.frame in TERRAIN_FRAMES and self.meaning is Autopilot.ARDUPILOT:
            ground_m = self._followed_ground_m(number, item, from_deg)
        self.height_m = self.height_of_m(number, item)
        draft = self._add(kind, number)
        draft.followed_ground_m = ground_m
        draft.hold_s = hold_s
        draft.yaw_deg = item.param4
        if kind is StageKind.GO and item.param2 is not None and item.param2 > 0.0:
            draft.acceptance_radius_m = min(item.param2, LARGEST_RADIUS_M)

    def _followed_ground_m(
        self, number: int, item: MissionItem, from_deg: tuple[float, float]
    ) -> tuple[float, ...]:
        """Return the ground on the way; tell of it where a straight line does not follow it."""
        if self.terrain is None:
            return ()
        from planner.mission.terrain_following import ground_between

        ground = ground_between(self.terrain, from_deg, (self.latitude_deg, self.longitude_deg))
        if ground is None:
            return ()
        if ground.off_line_m > _GROUND_OFF_LINE_M:
            self.remark(
                TERRAIN_NOT_FOLLOWED,
                number,
                item,
                f"the ground on the way lies up to {numbers.height(ground.off_line_m)} off the line "
                f"predicted and is up to {numbers.percent(ground.steepest)} steep: ArduPilot follows "
                "it, more slowly where it cannot climb so fast; the energy of climbing and descending on "
                "the way is not counted",
            )
        return ground.height_amsl_m

    def take_off(self, number: int, item: MissionItem) -> None:
        """Leave the ground."""
        if self.meaning is not Autopilot.ARDUPILOT:  # ArduPilot takes off where it stands
            self.move_to(number, item)
        self.height_m = self.height_of_m(number, item)
        is_first = not any(d.kind is not StageKind.DELAY for d in self.drafts)
        self._add(StageKind.TAKEOFF, number).yaw_deg = item.param4
        if is_first and self.height_m <= 0.0:
            self.remark(
                ZERO_TAKEOFF,
                number,
                item,
                f"takes off to {numbers.height(self.height_m)} above home",
            )

    def land(self, number: int, item: MissionItem) -> None:
        """Land at a place: the flight is over."""
        self.move_to(number, item)
        self.height_m = self.ground_m(self.latitude_deg, self.longitude_deg)
        self._add(StageKind.LAND, number).yaw_deg = item.param4
        self.is_over = True

    def circle(self, number: int, item: MissionItem) -> None:
        """Fly turns about a place."""
        self.move_to(number, item)
        self.height_m = self.height_of_m(number, item)
        turns, radius = abs(item.param1 or 0.0), item.param3 or 0.0
        if turns > MOST_TURNS or abs(radius) > LARGEST_RADIUS_M:
            self.refuse(
                number, item, f"{numbers.count(turns, 'turn')} of {radius:g} m cannot be flown"
            )
        if self.meaning is Autopilot.ARDUPILOT:
            kept_turns = ardupilot_storage.stored_turns(turns)
            kept_radius = ardupilot_storage.stored_radius_m(radius)
            if (kept_turns, kept_radius) != (turns, radius):
                said, kept = (
                    f"{numbers.count(turns, 'turn')} of {radius:g} m",
                    f"{kept_turns:g} of {kept_radius:g} m",
                )
                self._remark_stored(number, item, said, kept)
            turns, radius = kept_turns, kept_radius
        draft = self._add(StageKind.CIRCLE, number)
        draft.turns = turns
        draft.radius_m = radius

    def delay(self, number: int, item: MissionItem) -> None:
        """Wait for a time, or until a time of day."""
        seconds = item.param1 or 0.0
        if seconds > LONGEST_HOLD_S:
            self.refuse(number, item, f"a delay of {seconds:g} s is longer than any flight")
        in_air = bool(self.drafts)
        if seconds <= 0.0:
            clock = [item.param2, item.param3, item.param4]
            if any(part is not None and part >= 0.0 for part in clock):
                until = ":".join("--" if p is None or p < 0.0 else f"{p:02.0f}" for p in clock)
                where = "in the air" if in_air else "on the ground"
                message = f"waits {where} until {until} UTC: not counted"
                severity = Severity.ERROR if in_air else None  # a hover of any length
                if self.meaning is Autopilot.PX4:
                    message = f"PX4 knows no time of day: it does not wait until {until} UTC"
                    severity = None
                self.remark(WAIT_NOT_COUNTED, number, item, message, severity=severity)
        elif seconds > 0.0 and not in_air:
            self.remark(
                WAIT_NOT_COUNTED,
                number,
                item,
                f"waits {numbers.duration(seconds)} on the ground before the take-off: not counted",
            )
        elif seconds > 0.0:
            self._add(StageKind.DELAY, number).hold_s = seconds

    def set_down(self, number: int, item: MissionItem) -> None:
        """Lower a load to the ground."""
        self.move_to(number, item)
        self._add(StageKind.SET_DOWN, number)
        message = (
            "NAV_PAYLOAD_PLACE: the load is taken to touch the ground at home's level and to weigh "
            "nothing"
        )
        deepest_m = item.param1 or 0.0
        if 0.0 < deepest_m < self.height_m:
            message += f"; the vehicle gives up {numbers.height(deepest_m)} down"
        self.remark(ITEM_NOT_MODELLED, number, item, message)

    def arc(self, number: int, item: MissionItem) -> None:
        """Fly to a place; the arc that is asked for is only told."""
        self._go(StageKind.GO, number, item)
        angle_rad = math.radians(min(abs(item.param1 or 0.0), 359.0))
        longer = "" if angle_rad == 0.0 else f", {self._arc_over_chord(angle_rad)} as long"
        self.remark(
            ITEM_NOT_MODELLED,
            number,
            item,
            "NAV_ARC_WAYPOINT is not modelled: a straight flight to its place is assumed, not the "
            f"arc of {abs(item.param1 or 0.0):g}°{longer}",
            severity=Severity.ERROR if longer else None,
        )

    @staticmethod
    def _arc_over_chord(angle_rad: float) -> str:
        """Return the length of an arc over that of its chord: θ/2 over sin θ/2."""
        half = 0.5 * angle_rad
        return f"{numbers.decimals(half / math.sin(half), 2)} times"

    def guided(self, number: int, item: MissionItem) -> None:
        """Hand over to a companion computer, which decides when the mission goes on."""
        if self.meaning is not Autopilot.ARDUPILOT:
            self.pass_by(number, item)
        elif item.param1 is not None and item.param1 > 0.0:
            message = (
                "NAV_GUIDED_ENABLE: ArduPilot waits for a companion computer until it or "
                "DO_GUIDED_LIMITS ends it; the flight is taken to go on"
            )
            self.remark(WAITS_FOR_EVER, number, item, message)

    def change_speed(self, number: int, item: MissionItem) -> None:
        """Take a new speed for what follows."""
        kind, speed = item.param1 or 0.0, item.param2
        if speed is not None and speed > FASTEST_M_S:
            self.refuse(number, item, f"a speed of {speed:g} m/s cannot be flown")
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
            self.remark(
                ITEM_NOT_MODELLED,
                number,
                item,
                f"DO_CHANGE_SPEED: there is no speed type {kind:g}; the speed is left as it is",
            )

    def set_home(self, number: int, item: MissionItem) -> None:
        """Move the place a return leads to."""
        self._move_home(number, item)
        ground_m = self.ground_m(*self.home_deg)
        self.moved_homes.append((len(self.drafts), *self.home_deg, ground_m))

    def _move_home(self, number: int, item: MissionItem) -> None:
        if item.param1 == 1.0 or not self.has_place(number, item):
            self.home_deg = (self.latitude_deg, self.longitude_deg)
            self.datum_m = self.height_m
            if self.height_m != self.ground_level_m:
                height = numbers.height(self.height_m)
                message = (
                    f"DO_SET_HOME: home is moved to where the vehicle flies, {height} up; the way "
                    "back is taken to end on the ground"
                )
                self.remark(ITEM_NOT_MODELLED, number, item, message)
            return
        self.home_deg = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
        if item.altitude_m is None:
            return
        if item.frame in RELATIVE_FRAMES:  # of the home there has been until now
            self.datum_m += item.altitude_m
        else:
            self.amsl_items.append(number)
            self.datum_m = item.altitude_m - (self.home_amsl_m or 0.0)
        self.ground_level_m = self.datum_m

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
        if self.meaning is not None and support(item.command, self.meaning) is Support.SKIPPED:
            assumed = f"{self.meaning.label} skips it, 0 s and 0 Wh are assumed"
        elif is_destination(item.command) and self.has_place(number, item):
            self._go(StageKind.GO, number, item)
            assumed = "a straight flight to its place is assumed"
        else:
            assumed = "0 s and 0 Wh are assumed"
        self.remark(
            ITEM_NOT_MODELLED,
            number,
            item,
            f"{name} is not modelled: {assumed}",
            severity=None if goes_on_flying(item.command, self.meaning) else Severity.ERROR,
        )

    def _hold_s(self, number: int, item: MissionItem) -> float:
        hold = item.param1 or 0.0
        if hold == 0.0:
            return 0.0
        if hold > LONGEST_HOLD_S:
            self.refuse(number, item, f"a hold of {hold:g} s is longer than any flight")
        if hold < 0.0:
            self.remark(
                ITEM_NOT_MODELLED,
                number,
                item,
                f"{command_name(item.command)}: its hold of {hold:g} s is taken as 0 s",
            )
            return 0.0
        if self.meaning is not Autopilot.ARDUPILOT:
            return hold
        if hold > ardupilot_storage.LONGEST_HOLD_S:
            self.refuse(number, item, f"ArduPilot cannot keep a hold of {hold:g} s")
        kept = ardupilot_storage.stored_hold_s(hold)
        if kept != hold:
            self._remark_stored(number, item, f"a hold of {hold:g} s", f"{kept:g} s")
        return kept

    def _remark_stored(self, number: int, item: MissionItem, said: str, kept: str) -> None:
        message = f"{command_name(item.command)}: ArduPilot keeps {said} as {kept}"
        self.remark(VALUE_STORED_OTHERWISE, number, item, message)


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
    Command.NAV_ARC_WAYPOINT: Course.arc,
    Command.NAV_GUIDED_ENABLE: Course.guided,
    Command.DO_CHANGE_SPEED: Course.change_speed,
    Command.DO_SET_HOME: Course.set_home,
}
"""How each command is followed; any other is passed by."""
