"""The state of a mission while its items are followed, and what is told of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.geo.geodesy import distance_m_and_azimuth_deg
from planner.mission.commands import (
    RELATIVE_FRAMES,
    TAKEOFFS,
    TERRAIN_FRAMES,
    Command,
    command_name,
)
from planner.mission.route.position import Position
from planner.mission.route.queue import TURN_DEG_S, HeldItem
from planner.mission.route.stage import (
    LANDED_STAGES,
    FenceSwitch,
    HomePlace,
    ParachuteSwitch,
    Stage,
    StageKind,
)
from planner.mission.storage import LONGEST_STORED_HOLD_S, stored_hold_s
from planner.mission.takers import NAME_IT
from planner.values import Value, field

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.mission.items import MissionItem
    from planner.mission.route.queue import Condition

ZERO_ALTITUDE = Rule(
    "A111 zero-altitude",
    Severity.WARNING,
    summary="An item the vehicle flies to has the altitude 0.",
    why="To ArduPilot 0 means 'as before', in any frame; PX4 flies to the level of home or of the "
    "sea.  The same file means two flights.",
    how="The altitude of an item in the air is 0, and it is not flown as ArduPilot would.  An error where "
    "nothing names the autopilot, unless PX4 refuses the upload: it may fly into the ground.",
    fix="write the altitude that is meant",
)

LONGEST_HOLD_S = 30.0 * 86400.0
LARGEST_RADIUS_M = 100_000.0

ITEM_NOT_MODELLED = Rule(
    "T102 item-not-modelled",
    Severity.WARNING,
    summary="An item's effect on time and energy is not predicted.",
    why="Planners that count such items as nothing do so without a message (QGroundControl #6445 asks "
    "at least for a warning).",
    how="The command is not among those whose flight is predicted; the message gives the assumption; what a "
    "step-response model flies faster up or down than DO_CHANGE_SPEED allows costs its time (E108).  An "
    "error where the vehicle may fly elsewhere, wait or stop for it: arcs, NAV_SCRIPT_TIME, parachutes, "
    "auxiliary functions but those of what it carries, unknown commands; where a step-response model flies "
    "a spline straight, or from the centre of a LOITER_TO_ALT with parameter 4, which PX4 leaves by a "
    "tangent, and there is a fence, a terrain or a limit of the site, or the place is within that circle; "
    "where a gripper picks up a load after the take-off and no --payload is given; where DO_SET_HOME moves "
    "home up between two places that ArduPilot flies through, up or down right before a landing, a return "
    "or an item of altitude 0, or during a LOITER_TO_ALT, names a height but no place, or on PX4 a place in"
    " frame 2, sent in whole degrees (MavlinkMissionManager::parse_mavlink_mission_item), or stands before "
    "the take-off of a vehicle that arms in AUTO; where NAV_DELAY follows a LOITER_TO_ALT with parameter 4,"
    " to whose tangent PX4 flies on meanwhile; where PX4 may fly in either of two ways (T125), passes a "
    "LOITER_TO_ALT by its radius with MPC_YAW_MODE 4 (5 of 53 drawn flights were 4 to 15 m beside) or "
    "turning from a heading that is not known (T119), and there is a fence, a terrain or a profile of the "
    "site; where a spline turns so fast that ArduPilot's target stands still while the vehicle leans fully,"
    " and there is a fence, a terrain or a profile of the site; at what is here behind a circle that "
    "ArduPilot begins at its centre, or flies on while NAV_DELAY lasts, or where WPNAV_ACCEL/WPNAV_JERK is "
    "shorter than 0.8 of the second or so that ArduPilot takes to fly there (a warning up to the whole of "
    "it, and at a return begun behind a stop, whose time may be so much longer); where LOITER_TURNS, or a "
    "hold, counts below zero on ArduPilot, which keeps no sign (AP_Mission), and flies turns without a "
    "radius until 4.6 as wide as those before; where 4.7 turns without one on the way to their place, by "
    "turns x 360°/CIRCLE_RATE shorter than that takes or at a height more than 1 m from the item's, or may,"
    " with a version that is not known, or any autopilot; where DO_CHANGE_SPEED has another type than 0 to "
    "3, which older versions take for the level speed (ModeAuto::do_change_speed); where LOITER_TURNS has a"
    " part of a turn, which 4.7 flies to the side of CIRCLE_RATE's sign, others to that of the radius, and "
    "the version is unknown; at a DO_CHANGE_SPEED or a landing behind a CONDITION_GATE; behind a spline "
    "without a hold, which ArduPilot leads on to what it takes for the place of the next item "
    "(ModeAuto::get_spline_from_cmd), where that swings it more than 0.5 m up or down: NAV_DELAY with an "
    "hour, minute or second other than 0, or parts of one, a landing or take-off with another altitude (a "
    "warning below 5 m, 10 m above the ground and without --terrain); on PX4 behind a LOITER_TIME of less "
    "than 4 s with parameter 4, and at a DO_CHANGE_SPEED taken back at once; where a CONDITION_ wait ends "
    "within 5 % of its leg's time, or CONDITION_DISTANCE within 1 m of where the leg is over, and holds "
    "back a home or the fence, two speeds of one leg or more than three speeds (a warning of fewer: T115)."
    "  A note of a landing that ArduCopter from 4.7 on begins to fly slowly too high.",
    fix="allow for the item yourself, or replace it by one that is modelled",
    instead="items that are modelled",
)

WAITS_FOR_EVER = Rule(
    "T108 waits-for-ever",
    Severity.ERROR,
    summary="The vehicle waits at an item until a command continues the mission.",
    why="With autoContinue off PX4 holds at the item; ArduPilot continues.  At NAV_GUIDED_ENABLE "
    "ArduPilot waits for a companion computer.",
    how="An item with autoContinue off is reached in flown order on PX4, but a return and a landing at the "
    "end, or NAV_GUIDED_ENABLE on ArduPilot.  Where nothing names the autopilot an error unless "
    "PX4 refuses the upload.",
    fix="set autoContinue, unless a pilot will continue the mission",
    instead="autoContinue, or a mission without NAV_GUIDED_ENABLE",
)

VALUE_STORED_OTHERWISE = Rule(
    "M113 value-stored-otherwise",
    Severity.INFO,
    summary="ArduPilot keeps a value of an item only roughly.",
    why="Its mission storage has 16 bits for it: it flies another value than the file's.",
    how="Holds of whole seconds; at most 255 whole turns; radii of whole metres up to 255 m, of tens "
    "of metres up to 2550 m (AP_Mission).  What is kept is flown here.",
    fix="write a value that it can keep",
)


class VehicleHabits(Value):
    """How the vehicle that flies carries out items, by its settings."""

    continues_after: frozenset[StageKind] | None = None
    """Stages that land and after which the mission goes on where a take-off comes next; ``None``: as its
    autopilot is delivered."""
    payload_waits_s: Mapping[int, float] = {}
    """How long it waits at items of what it carries, by their command. [s]"""
    keeps_counts: bool | None = None
    """Whether it keeps the count of a jump that was counted to its end; ``None``: not known."""
    turn_deg_s: float = TURN_DEG_S
    """How fast it turns to a heading that holds items back. [° s⁻¹]"""
    circles_by_rate: bool | None = None
    """Whether it circles as ArduCopter 4.7 does: which way round by the sign of CIRCLE_RATE, on the spot
    where the item has no radius; ``None``: not known."""
    lands_by_altitude: bool | None = None
    """Whether it takes the altitude of a landing for that of the ground there; ``None``: not known."""
    circle_radius_m: float = 10.0
    """Radius of circles whose items have none, nor has one before. [m]"""
    circles_clockwise: bool = True
    """Whether CIRCLE_RATE is positive."""
    looks_from_m: float = 2.0
    """How far from a region of interest PX4 turns to it (NAV_ACC_RAD). [m]"""
    waypoint_radius_m: float = 2.0
    """Within this of its place ArduPilot begins the change of height of a LOITER_TO_ALT. [m]"""
    climb_speed_m_s: float = math.inf
    """Its own, by its parameters; infinite where they are not known. [m/s]"""
    descent_speed_m_s: float = math.inf


AS_DELIVERED = VehicleHabits()


class MissionState(Position, kw_only=True, eq=False):
    """A mission half followed: where it is, its speeds, homes, and the stages so far."""

    speed_m_s: float | None = None
    climb_speed_m_s: float | None = None
    descent_speed_m_s: float | None = None
    asked_climb_m_s: float | None = None
    """Commanded last, whether ArduPilot goes by it or not. [m/s]"""
    asked_descent_m_s: float | None = None
    sped_at: int = -1
    """Number of stages there were as the last horizontal speed of PX4 was commanded."""
    is_over: bool = False
    is_behind_gate: bool = False
    """Whether a gate was the last item with a place."""
    unknown_side: str = ""
    """Why it is unknown where on the circle before the vehicle is; empty: it is known."""
    is_left_on_tangent: bool = False
    """Whether PX4 leaves the place before slowly, by the tangent of a circle about it."""
    spline: tuple[float, bool] | None = None
    """Length of the spline without a hold right before [m], and whether it is above terrain."""
    is_above_terrain: bool = False
    """Whether the altitude of the last place counts from the terrain."""
    circle_radius_m: float = 0.0
    """Radius of the circle before; 0: there is none. [m]"""
    moved_homes: list[HomePlace] = field(default_factory=list)
    """Set by DO_SET_HOME, still without east and north."""
    homes_deg: list[tuple[float, float]] = field(default_factory=list)
    """Latitude and longitude of each. [°]"""
    fence_switches: list[FenceSwitch] = field(default_factory=list)
    parachute_switches: list[ParachuteSwitch] = field(default_factory=list)
    habits: VehicleHabits = AS_DELIVERED
    looks_at_deg: tuple[float, float] | None = None
    """Latitude and longitude of the region of interest that PX4 turns to. [°]"""
    queued: int = 0
    """Items of ArduPilot's queue since the last place: it carries out the first before it sets out, the
    others when it is on its way (``AP_Mission::advance_current_nav_cmd``)."""
    is_speed_late: bool = False
    """Whether one of the others is the last to have commanded a horizontal speed."""
    is_climb_late: bool = False
    """Whether one of the others is the last to have commanded a speed of climbing."""
    is_descent_late: bool = False
    """And of descending."""
    conditions: list[Condition] = field(default_factory=list)
    """What holds back the next items of the queue."""
    waiting: list[tuple[HeldItem, MissionItem]] = field(default_factory=list)
    """Held back, their leg not yet known."""
    stages: list[Stage] = field(default_factory=list)
    """Still without east and north."""
    places_deg: list[tuple[float, float]] = field(default_factory=list)
    """Latitude and longitude of each stage. [°]"""

    @property
    def has_landed(self) -> bool:
        """Whether the vehicle stands where it has landed."""
        return bool(self.stages) and self.stages[-1].kind in LANDED_STAGES

    def stage(self, kind: StageKind, **more: Any) -> Stage:  # noqa: ANN401 - fields of a stage
        """Return a stage to the present height, at the speeds commanded."""
        return Stage(
            kind,
            self.number,
            0.0,
            0.0,
            self.height_m,
            self.speed_m_s,
            self.climb_speed_m_s,
            self.descent_speed_m_s,
            is_speed_late=self.is_speed_late,
            **more,
        )

    def add(self, stage: Stage) -> None:
        """Add a stage to the present place."""
        self.is_behind_gate = False
        self.stages.append(stage)
        self.places_deg.append((self.latitude_deg, self.longitude_deg))

    def go_to(self, kind: StageKind, item: MissionItem, hold_s: float = 0.0) -> None:
        """Add a stage to the place and height of an item."""
        from_deg = (self.latitude_deg, self.longitude_deg)
        self.move_to(item)
        ground_m: tuple[float, ...] = ()
        if item.frame in TERRAIN_FRAMES and self.dialect is Autopilot.ARDUPILOT:
            ground_m = self._followed_ground_m(from_deg)
        self.height_m = self.height_to_m(item)
        acceptance_radius_m = None
        if item.param2 is not None and item.param2 > 0.0 and kind is StageKind.GO:
            acceptance_radius_m = min(item.param2, LARGEST_RADIUS_M)
        self.add(
            self.stage(
                kind,
                hold_s=hold_s,
                acceptance_radius_m=acceptance_radius_m,
                needs_heading=self._needs_heading(item),
                **self._looks(item),
                followed_ground_m=ground_m,
                is_here=not item.names_place,
                follows_ground=bool(ground_m),
            )
        )

    def _looks(self, item: MissionItem) -> dict[str, Any]:
        """Return where a stage that ends here looks: as its item asks, or at the region of interest.

        ``MissionBase::heading_sp_update`` writes the heading to that into the item, which is reached with
        it.  Nearer it keeps the one it came with.  PX4 gives a LOITER_TO_ALT none, which is 0, north
        (``MavlinkMissionManager::parse_mavlink_mission_item``).
        """
        if self.looks_at_deg is None:
            is_north = self.dialect is Autopilot.PX4 and item.command == Command.NAV_LOITER_TO_ALT
            return {"yaw_deg": 0.0 if is_north else item.param4}
        way_m, looks_deg = distance_m_and_azimuth_deg(
            self.latitude_deg, self.longitude_deg, *self.looks_at_deg
        )
        looks_rad = math.radians(looks_deg)
        return {
            "yaw_deg": float(looks_deg) if way_m > self.habits.looks_from_m else None,
            "looks_m": (float(way_m * math.sin(looks_rad)), float(way_m * math.cos(looks_rad))),
        }

    def _needs_heading(self, item: MissionItem) -> bool:
        """Return whether PX4 gives the mission up where it does not look there in time (force_heading)."""
        asked = None
        if self.dialect is Autopilot.PX4 and item.command == Command.NAV_LOITER_TIME:
            asked = item.param2
        elif self.dialect is Autopilot.PX4 and item.command == Command.NAV_LOITER_TO_ALT:
            asked = item.param1
        return (asked or 0.0) > 0.0

    @property
    def in_air(self) -> bool:
        """Whether the vehicle has taken off, and has not landed."""
        return bool(self.stages) and not self.has_landed

    def remark_gate(self, message: str) -> None:
        """Tell of what counts from a gate right before."""
        if self.is_behind_gate:
            self.remark(ITEM_NOT_MODELLED, f"{message} is not predicted", severity=Severity.ERROR)

    def hold_s(self, item: MissionItem) -> float:
        """Return how long the vehicle holds at the place of an item, as its autopilot keeps that. [s]"""
        hold = item.param1 or 0.0
        if hold == 0.0:
            return 0.0
        if hold > LONGEST_HOLD_S:
            self.refuse(item, f"a hold of {hold:g} s is longer than any flight")
        if hold < 0.0:
            message = f"{command_name(item.command)}: its hold of {hold:g} s is predicted as 0 s"
            is_doubtful = hold <= -1.0 and self.dialect is not Autopilot.PX4
            if is_doubtful:  # a part of a second is kept as none
                message += "; ArduPilot keeps it without a sign, as none or up to 18 h by its board"
            severity = Severity.ERROR if is_doubtful else None
            self.remark(ITEM_NOT_MODELLED, message, severity=severity)
            return 0.0
        if self.dialect is not Autopilot.ARDUPILOT:
            return hold
        if hold > LONGEST_STORED_HOLD_S:
            self.refuse(item, f"ArduPilot cannot keep a hold of {hold:g} s")
        kept = stored_hold_s(hold)
        if kept != hold:
            self.remark_stored(item, f"a hold of {hold:g} s", f"{kept:g} s")
        return kept

    def remark_stored(self, item: MissionItem, written: str, kept: str) -> None:
        """Tell that ArduPilot keeps another value than the one written."""
        message = f"{command_name(item.command)}: ArduPilot keeps {written} as {kept}"
        self.remark(VALUE_STORED_OTHERWISE, message)

    def height_to_m(self, item: MissionItem) -> float:
        """Return the height above the first home that an item leads to; 0 in the air may mean 'as before'.

        ``ModeAuto::do_loiter_to_alt`` takes the 0 as it is, when it is where it goes, as PX4 does.
        """
        is_as_before = item.altitude_m == 0.0 and item.command != Command.NAV_LOITER_TO_ALT
        if is_as_before and self.stages:
            if self.flies_as_ardupilot:
                return self.height_m
            if item.frame in RELATIVE_FRAMES | TERRAIN_FRAMES and item.command not in TAKEOFFS:
                return self._zero_height_m()
        return self.height_of_m(item)

    def _zero_height_m(self) -> float:
        """Return the height of an item in the air with altitude 0, where not ArduPilot's is meant."""
        message = "altitude 0: PX4 flies to home's level, ArduPilot keeps its height"
        if self.dialect is Autopilot.PX4:
            self.remark(ZERO_ALTITUDE, message)
            return self.datum_m
        message += f", as predicted; {NAME_IT}"
        self.remark(ZERO_ALTITUDE, message, severity=Severity.ERROR)
        return self.height_m
