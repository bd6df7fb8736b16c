"""What each command makes of the flight: the state of a mission while its items are followed."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING, Any

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.geo.geodesy import distance_m, distance_m_and_azimuth_deg
from planner.mission.commands import (
    LANDINGS,
    PARACHUTE_OFF,
    PARACHUTE_ON,
    RELATIVE_FRAMES,
    TAKEOFFS,
    TERRAIN_FRAMES,
    Command,
    CommandEffect,
    Support,
    command_effect,
    command_name,
    goes_on_flying,
    is_destination,
    is_navigation,
    support,
)
from planner.mission.route.position import Position, is_amsl
from planner.mission.route.queue import TURN_DEG_S, HeldItem
from planner.mission.route.stage import (
    LANDED_STAGES,
    FenceAction,
    FenceSwitch,
    HomePlace,
    ParachuteSwitch,
    Stage,
    StageKind,
)
from planner.mission.storage import (
    LONGEST_STORED_HOLD_S,
    reads_as_place,
    stored_hold_s,
    stored_radius_m,
    stored_turns,
)
from planner.values import Value, field, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.mission.items import MissionItem
    from planner.mission.route.queue import Condition

LIFTS_OFF = TAKEOFFS | {Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME}
"""What PX4 takes off to after a landing."""
_FENCE_ACTIONS = {int(action): action for action in FenceAction}

DESCENT = 3.0
"""First parameter of DO_CHANGE_SPEED for that of a descent."""
_ROIS_BY_MODE = (Command.NAV_ROI, Command.DO_SET_ROI)
"""Commands of a region of interest whose first parameter is a MAV_ROI."""
_ROI_LOCATION = 3.0
_METRES_PER_DEGREE = 111_319.0
"""Of latitude, as ArduPilot has it."""
_AT_CENTRE_DEG = 0.5 / _METRES_PER_DEGREE
"""So near to a centre the vehicle is there. [°]"""
_AT_REST_S = 4.0
"""After so long in a place PX4 rests there: it enters it at 1.2 m/s, and loses that within 1.5 s times the
logarithm (MPC_ACC_HOR 3, MPC_JERK_AUTO 4), down to 0.2 m/s, below which it turns nowhere. [s]"""
_AT_ONE_HEIGHT_M = 0.8
"""Within this PX4 takes a height for reached (NAV_MC_ALT_RAD), and does not slow down for it. [m]"""
_LEVEL_PLACES = LANDINGS | {Command.NAV_PAYLOAD_PLACE}
_LED_TO = (
    _LEVEL_PLACES | TAKEOFFS | {Command.NAV_GUIDED_ENABLE, Command.NAV_CONTINUE_AND_CHANGE_ALT}
)
"""Towards whose place and altitude ArduPilot ends a spline; predicted is that it ends level, and towards the
places of the first alone."""
_LONGEST_TANGENTS = 4.0
"""``SplineCurve`` keeps the tangents at both ends of a spline together within so many times its length."""
_SWINGS = 4.0 / 27.0
"""How far a cubic that begins at rest leaves the line between its ends, of the tangent at its end. [-]"""
_LITTLE_SWING_M, _GREAT_SWING_M = 0.5, 5.0
"""Flown, 2 m do nothing; 5 m may be beyond a fence that the level flight is well inside of. [m]"""
_LOW_M = 10.0
"""Nearer to the ground a swing counts, whatever it is. [m]"""
EDGE_NEAR_M = 3.0
"""``ModeAuto::circle_movetoedge_start`` flies to a circle from farther away only. [m]"""
_SAME_HOME_M = 0.5
"""So near, and as high, a home is the one before. [m]"""

ZERO_ALTITUDE = Rule(
    "A111 zero-altitude",
    Severity.WARNING,
    summary="An item the vehicle flies to has the altitude 0.",
    why="To ArduPilot 0 means 'as before', in any frame; PX4 flies to the level of home or of the "
    "sea.  The same file means two flights.",
    how="The altitude of an item in the air is 0, and it is not flown as ArduPilot would.  An error where "
    "the autopilot is unknown: it may fly into the ground.",
    fix="write the altitude that is meant",
)

LONGEST_HOLD_S = 30.0 * 86400.0
FASTEST_M_S = 1000.0
MOST_TURNS = 100_000.0
LARGEST_RADIUS_M = 100_000.0
ENDLESS = Rule(
    "T101 endless-jump",
    Severity.ERROR,
    summary="The mission never ends: an endless jump, an unlimited loiter, a wait for what never comes.",
    why="Time and energy of an endless mission are infinite; only those of one lap are finite.",
    how="A DO_JUMP with an endless count, LOITER_UNLIM, or LOITER_TURNS on ArduPilot with CIRCLE_RATE 0 "
    "(ModeAuto::verify_circle waits for turns that are never flown), or a heading on PX4 with MIS_YAW_ERR 0 "
    "and MIS_YAW_TMT not above 0 (MissionBlock::is_mission_item_reached), or LOITER_TO_ALT on ArduPilot "
    "that climbs above FENCE_ALT_MAX less FENCE_MARGIN, or from 4.6 on descends below FENCE_ALT_MIN and "
    "FENCE_MARGIN, while that limit is on, with AVOID_ENABLE bit 0 (AC_Avoid::adjust_velocity_z), is reached "
    "in flown order; or ArduPilot's return where a DO_SET_HOME that is not the first DO_ item before it "
    "moves home up or down by more than 1 m as it begins (flown).",
    fix="give the jump a count, or end the mission with a return or a landing",
    instead="a count for the jump, turns that end, a return or a landing",
)

ITEM_NOT_MODELLED = Rule(
    "T102 item-not-modelled",
    Severity.WARNING,
    summary="An item's effect on time and energy is not predicted.",
    why="Planners that count such items as nothing do so without a message (QGroundControl #6445 asks "
    "at least for a warning).",
    how="The command is not among those whose flight is predicted; the message gives the assumption; what a "
    "step-response model flies faster up or down than DO_CHANGE_SPEED allows costs its time (E108).  An "
    "error where the vehicle may fly elsewhere, wait or stop for it: arcs, NAV_SCRIPT_TIME, parachutes, "
    "auxiliary functions but those of what it carries, unknown commands; where a step-response model "
    "flies a spline straight and there is a fence, a terrain or a limit of the site; where a gripper "
    "picks up a load after the take-off and no --payload is given; where DO_SET_HOME moves home up "
    "between two places that ArduPilot flies through, up or down right before a landing, a return or an item "
    "of altitude 0, or during a LOITER_TO_ALT, names a height but no place, or stands before the take-off "
    "of a vehicle that arms in AUTO; at what is here behind a circle that ArduPilot begins at its centre, "
    "or flies on while NAV_DELAY "
    "lasts; where LOITER_TURNS, or a hold, counts below zero on ArduPilot, which keeps no sign (AP_Mission), "
    "and flies turns without a radius until 4.6 as wide as those before; where 4.7 turns without one on the "
    "way to their place, by turns x 360°/CIRCLE_RATE shorter than that takes or at a height more than 1 m "
    "from the item's, or may, with a version that is not known, or any autopilot; where "
    "DO_CHANGE_SPEED has another type than 0 to 3, which older versions take for the level speed "
    "(ModeAuto::do_change_speed); where LOITER_TURNS has a part of a turn, which 4.7 flies to the side of "
    "CIRCLE_RATE's sign, others to that of the radius, and the version is unknown; at a DO_CHANGE_SPEED or a "
    "landing behind a CONDITION_GATE; behind a spline without a hold, which ArduPilot leads on to what it "
    "takes for the place of the next item (ModeAuto::get_spline_from_cmd), where that swings it more than "
    "0.5 m up or down: NAV_DELAY with an hour, minute or second other than 0, or parts of one, a landing or "
    "take-off with another altitude (a warning below 5 m, 10 m above the ground and without "
    "--terrain); on PX4 behind a LOITER_TIME of less than 4 s, or a LOITER_TO_ALT of "
    "another height, with parameter 4, and at a DO_CHANGE_SPEED taken back at once; where a "
    "CONDITION_ wait ends within 5 % of its leg's time, or CONDITION_DISTANCE within 1 m of where the leg is "
    "over, and holds back a speed, a home or the fence.  A note of a landing that ArduCopter from 4.7 on "
    "begins to fly slowly too high.",
    fix="allow for the item yourself, or replace it by one that is modelled",
    instead="items that are modelled",
)

WAIT_NOT_COUNTED = Rule(
    "T107 wait-not-counted",
    Severity.WARNING,
    summary="A wait of unknown length is not counted.",
    why="A wait until a time of day lasts as long as the clock demands (QGroundControl counts -1 s "
    "for it), in the air or with motors that idle.",
    how="NAV_DELAY with a time of day (an error, but on PX4, which has none), or in seconds before the "
    "take-off: an error where idling motors, 0.12 of the hover power where the model has none, take more "
    "than the flight and its returns leave above the reserve, or than 5 % of the battery, by which its "
    "voltage and its failsafes would be wrong; ArduPilot's "
    "return where RTL_LOIT_TIME is shorter than half a turn at ATC_RATE_WPY_MAX (ModeRTL, which waits "
    "for the heading it was armed with).",
    fix="use a delay in seconds, or allow for the wait yourself",
    instead="a delay in seconds",
)

WAITS_FOR_EVER = Rule(
    "T108 waits-for-ever",
    Severity.ERROR,
    summary="The vehicle waits at an item until a command continues the mission.",
    why="With autoContinue off PX4 holds at the item; ArduPilot continues.  At NAV_GUIDED_ENABLE "
    "ArduPilot waits for a companion computer.",
    how="An item with autoContinue off is reached in flown order on PX4, but a return and a landing at the "
    "end, or NAV_GUIDED_ENABLE on ArduPilot.  A warning where the autopilot is unknown.",
    fix="set autoContinue, unless a pilot will continue the mission",
    instead="autoContinue, or a mission without NAV_GUIDED_ENABLE",
)

ZERO_TAKEOFF = Rule(
    "A106 zero-takeoff",
    Severity.ERROR,
    summary="The take-off altitude is not above home.",
    why="A take-off to zero is refused, or flown to a height that is in no file (ArduPilot #33792).",
    how="The take-off item's altitude, resolved to a height above home, is 0 m or less.  PX4 refuses "
    "it, ArduPilot does not arm with it from 4.8 on.",
    fix="give the take-off item an altitude above home",
    instead="a take-off above home",
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

HEADING_NORTH = Rule(
    "M114 heading-north",
    Severity.INFO,
    summary="Waypoints ask PX4 for a heading of exactly 0°.",
    why="PX4 takes 0 in the fourth parameter for north, turns there and waits until it has; 'free' is "
    "null.  Text files and scripts write 0 and mean nothing by it.",
    how="NAV_WAYPOINT with a fourth parameter of exactly 0, flown as PX4 would.",
    fix="write null (nan in text) where the heading does not matter",
)


_DELIVERED_M_S = {"climb": 2.5, "descent": 1.5}
"""WPNAV_SPEED_UP and WPNAV_SPEED_DN as delivered."""
_ON_OR_OFF_THE_GROUND = frozenset({StageKind.TAKEOFF, *LANDED_STAGES})


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
    climb_speed_m_s: float = math.inf
    """Its own, by its parameters; infinite where they are not known. [m/s]"""
    descent_speed_m_s: float = math.inf


AS_DELIVERED = VehicleHabits()


class MissionState(Position, kw_only=True, eq=False):
    """A mission half followed: where it is, its speeds, homes, and the stages so far."""

    speed_m_s: float | None = None
    climb_speed_m_s: float | None = None
    descent_speed_m_s: float | None = None
    sped_at: int = -1
    """Number of stages there were as the last horizontal speed of PX4 was commanded."""
    is_over: bool = False
    is_behind_gate: bool = False
    """Whether a gate was the last item with a place."""
    unknown_side: str = ""
    """Why it is unknown where on the circle before the vehicle is; empty: it is known."""
    left_on_tangent: str = ""
    """The loiter before, where PX4 leaves it slowly by the tangent of a circle about it."""
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

    def _remark_unknown_side(self, item: MissionItem) -> None:
        """Tell what is "here" behind a circle that may be left on any side of it."""
        if not self.unknown_side:
            return
        goes, sets_home = is_destination(item.command), item.command == Command.DO_SET_HOME
        if not (goes or sets_home):
            return
        if item.sets_home_here if sets_home else not item.names_place:
            message = (
                f"{command_name(item.command)} here, behind LOITER_TURNS {self.unknown_side}: not "
                "predicted where that is: give it a place"
            )
            self.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)
        elif goes:
            self.unknown_side = ""

    def _remark_tangent(self, item: MissionItem) -> None:
        """Tell of a leg that PX4 begins far beside it, and how slowly.

        Notes
        -----
        ``MissionBlock::is_mission_item_reached_or_completed``: ``loiter_exit_xtrack`` moves the place of a
        LOITER_TIME, too, to where the tangent leads to the next one.  Flown: 0 s and 40 m, from 2 m before
        the place 39 m across it to that tangent, at the 1.3 m/s it had by then, 30 s; at rest it turns
        nowhere.  A LOITER_TO_ALT of 40 m that climbs 20 m comes as near, and slow, while it climbs, and
        keeps that speed while it turns (``PositionSmoothing::_generateVelocitySetpoint``,
        ``_max_speed_previous``): 36 m at 0.85 m/s.  At one height it leaves at full speed, as predicted.
        """
        if not self.left_on_tangent or not is_destination(item.command):
            return
        message = (
            f"{self.left_on_tangent} right before: PX4 takes that for leaving by the tangent of its "
            "radius, slowly, which is not predicted; write 0 there"
        )
        self.left_on_tangent = ""
        self.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)

    def _stop_before(self, item: MissionItem) -> None:
        """Let ArduPilot stop at the place before one whose altitude counts from elsewhere.

        ``AC_WPNav::set_wp_destination_next`` plans no next leg where only one of the two is above terrain,
        ``set_spline_destination`` no tangent.  Flown: five legs of 60 m in 159 s, in one frame 132 s.
        """
        if not is_destination(item.command):
            return
        before, self.is_above_terrain = self.is_above_terrain, item.frame in TERRAIN_FRAMES
        if self.stages and before != self.is_above_terrain and self.dialect is not Autopilot.PX4:
            self.stages[-1] = replace(self.stages[-1], is_next_unseen=True)

    def _remark_swing(self, item: MissionItem) -> None:
        """Tell of a spline that ArduPilot ends towards a place which is none, or is predicted without.

        Notes
        -----
        ``ModeAuto::get_spline_from_cmd`` asks the next item for its place, whatever that is;
        ``AC_WPNav::set_spline_destination`` leaves it out where only one of both is above terrain.  Flown:
        60 m, 25 m up, before a NAV_DELAY with -1 as hour, minute and second: into the ground; before a
        landing with altitude 100 m, 11 m down; before LOITER, take-off, circle 35 m higher, 5.2 m down.
        """
        if self.spline is None or not is_navigation(item.command):
            return
        (length_m, is_above_terrain), self.spline = self.spline, None
        way_m = 0.0
        if reads_as_place(item, above_terrain=is_above_terrain):
            way_m = math.inf
        elif item.command in _LED_TO and (item.frame in TERRAIN_FRAMES) == is_above_terrain:
            way_m = self._way_beyond_m(item)
        swing_m = _SWINGS * min(way_m, _LONGEST_TANGENTS * length_m)
        if swing_m <= _LITTLE_SWING_M:
            return
        takes = "reads its numbers as a place" if math.isinf(way_m) else "takes its altitude"
        is_delay = item.command == Command.NAV_DELAY
        write = "whole seconds, and 0 in parameters 2 to 4" if is_delay else "0 there"
        left_m = self.height_m - self.ground_m() - swing_m
        is_grave = swing_m >= _GREAT_SWING_M or left_m < _LOW_M or self.terrain is not None
        self.remark(
            ITEM_NOT_MODELLED,
            f"{command_name(item.command)} right behind a spline: ArduPilot {takes}, lets the spline lead on "
            f"to that and swings up to {quantity.height(swing_m)} up or down on it, which is not predicted; "
            f"write {write}, or hold for 1 s at the spline",
            severity=Severity.ERROR if is_grave else None,
        )

    def _way_beyond_m(self, item: MissionItem) -> float:
        """Return how far beyond its end a spline is led that is predicted level. [m]"""
        up_m = self.height_of_m(item) - self.height_m if item.altitude_m else 0.0
        level_m = 0.0
        if item.names_place and item.command not in _LEVEL_PLACES:
            there = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
            level_m = float(distance_m(self.latitude_deg, self.longitude_deg, *there))
        return math.hypot(level_m, up_m)

    def carry_out(self, item: MissionItem) -> None:
        """Make of the flight what the command of an item makes of it."""
        _HANDLERS.get(item.command, MissionState.pass_by)(self, item)

    def go(self, item: MissionItem) -> None:
        """Fly to a place in the manner of the command, and hold there."""
        if (
            item.param4 == 0.0
            and self.dialect is Autopilot.PX4
            and item.command == Command.NAV_WAYPOINT
        ):
            message = "NAV_WAYPOINT asks for heading 0°: PX4 turns north before it continues"
            self.remark(HEADING_NORTH, message)
        kind = StageKind.TAKEOFF if self.has_landed else _KINDS[item.command]
        hold_s = self._hold_s(item)
        begun = (self.latitude_deg, self.longitude_deg), self.height_m
        self._go(kind, item, hold_s=hold_s)
        if (
            kind is StageKind.SPLINE
            and not stored_hold_s(hold_s)
            and self.dialect is not Autopilot.PX4
        ):
            (from_deg, from_m), here_deg = begun, (self.latitude_deg, self.longitude_deg)
            level_m = float(distance_m(*from_deg, *here_deg))
            length_m = math.hypot(level_m, self.height_m - from_m)
            self.spline = length_m, item.frame in TERRAIN_FRAMES
        is_short = kind is StageKind.LOITER and hold_s < _AT_REST_S
        if self.dialect is Autopilot.PX4 and is_short and (item.param4 or 0.0) > 0.0:
            self.left_on_tangent = "NAV_LOITER_TIME, so short and with parameter 4 above 0,"

    @property
    def has_landed(self) -> bool:
        """Whether the vehicle stands where it has landed."""
        return bool(self.stages) and self.stages[-1].kind in LANDED_STAGES

    def loiter_for_ever(self, item: MissionItem) -> None:
        """Fly to a place and stay: the prediction ends."""
        self._go(StageKind.LOITER, item)
        self.remark(ENDLESS, "unlimited loiter: the vehicle stays here")
        self.is_over = True

    def change_height(self, item: MissionItem) -> None:
        """Fly to a place, then change height there."""
        from_m = self.height_m
        self._go(StageKind.CHANGE_HEIGHT, item)
        leaves_on_tangent = (item.param4 or 0.0) > 0.0
        climbs = abs(self.height_m - from_m) > _AT_ONE_HEIGHT_M
        if self.dialect is Autopilot.PX4 and leaves_on_tangent and climbs:
            self.left_on_tangent = "NAV_LOITER_TO_ALT with another height and parameter 4 above 0"
        radius_m = item.param2 or 0.0
        self.stages[-1] = replace(
            self.stages[-1],
            radius_m=max(min(radius_m, LARGEST_RADIUS_M), -LARGEST_RADIUS_M),
            leaves_on_tangent=leaves_on_tangent,
        )

    def return_home(self, _item: MissionItem) -> None:
        """Return and land: the flight is over."""
        self.latitude_deg, self.longitude_deg = self.home_deg
        self.height_m = self._home_ground_m()
        above_m = self.datum_m - self.height_m
        self._add(replace(self._returning(), above_ground_m=above_m, datum_m=self.datum_m))
        self._remark_late_return()
        self.is_over = True

    def _remark_late_return(self) -> None:
        """Tell what the queue changes of a return on ArduPilot alone, where it is not known who flies."""
        is_late = self.is_speed_late or self.is_climb_late or self.is_descent_late
        leads_elsewhere = any(
            one.command is Command.DO_SET_HOME and not one.conditions and self._is_elsewhere(item)
            for one, item in self.waiting
        )
        if self.dialect is None and (is_late or leads_elsewhere):
            does = "leads to the home before" if leads_elsewhere else "is flown at their speeds"
            self.remark(
                ITEM_NOT_MODELLED,
                "ArduPilot carries out all DO_ items before a return but the first when it has begun: it "
                f"{does}, as predicted, with PX4 not so; name who flies it (--target, --params)",
                severity=Severity.ERROR if leads_elsewhere else None,
            )

    def _is_elsewhere(self, item: MissionItem) -> bool:
        """Return whether a DO_SET_HOME names another place, or height, than that of the present home."""
        if item.sets_home_here:
            return True
        there = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
        up_m = item.altitude_m or 0.0
        if item.altitude_m is not None and item.frame not in RELATIVE_FRAMES:
            up_m -= self.datum_m + (self.home_amsl_m or 0.0)
        return float(distance_m(*self.home_deg, *there)) > _SAME_HOME_M or abs(up_m) > _SAME_HOME_M

    def _returning(self) -> Stage:
        """Return a return at the speeds set in the vehicle, or those the mission commands later.

        It starts from the parameters again (``ModeRTL::init``).
        """
        return replace(
            self._stage(StageKind.RETURN),
            speed_m_s=self.speed_m_s if self.is_speed_late else None,
            climb_speed_m_s=self.climb_speed_m_s if self.is_climb_late else None,
            descent_speed_m_s=None,
            lands_at_m_s=self._lands_at_m_s(StageKind.RETURN),
        )

    def _lands_at_m_s(self, kind: StageKind, *, is_here: bool = False) -> float | None:
        """Return the descent speed commanded during a return, or a landing where the vehicle is.

        A landing elsewhere starts from the parameters again when it gets there (``ModeAuto::land_start``).
        """
        lands = kind is StageKind.RETURN or (kind is StageKind.LAND and is_here)
        return self.descent_speed_m_s if lands and self.is_descent_late else None

    def _stage(self, kind: StageKind, **more: Any) -> Stage:  # noqa: ANN401 - fields of a stage
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

    def _add(self, stage: Stage) -> None:
        """Add a stage to the present place."""
        self.is_behind_gate = False
        self.stages.append(stage)
        self.places_deg.append((self.latitude_deg, self.longitude_deg))

    def _go(self, kind: StageKind, item: MissionItem, hold_s: float = 0.0) -> None:
        from_deg = (self.latitude_deg, self.longitude_deg)
        self.move_to(item)
        ground_m: tuple[float, ...] = ()
        if item.frame in TERRAIN_FRAMES and self.dialect is Autopilot.ARDUPILOT:
            ground_m = self._followed_ground_m(from_deg)
        self.height_m = self._height_to_m(item)
        if kind is StageKind.SPLINE:
            self._begin_spline()
        acceptance_radius_m = None
        if item.param2 is not None and item.param2 > 0.0 and kind is StageKind.GO:
            acceptance_radius_m = min(item.param2, LARGEST_RADIUS_M)
        self._add(
            self._stage(
                kind,
                hold_s=hold_s,
                acceptance_radius_m=acceptance_radius_m,
                yaw_deg=item.param4 if self.looks_at_deg is None else self._looks_deg(),
                needs_heading=self._needs_heading(item),
                followed_ground_m=ground_m,
                is_here=not item.names_place,
                follows_ground=bool(ground_m),
            )
        )

    def _looks_deg(self) -> float | None:
        """Return the heading from here to the region of interest; ``None`` where that is too near. [°]

        ``MissionBase::heading_sp_update`` writes it into the item, which is reached with that heading.
        Nearer it keeps the one it came with.
        """
        assert self.looks_at_deg is not None
        way_m, looks_deg = distance_m_and_azimuth_deg(
            self.latitude_deg, self.longitude_deg, *self.looks_at_deg
        )
        return float(looks_deg) if way_m > self.habits.looks_from_m else None

    def _needs_heading(self, item: MissionItem) -> bool:
        """Return whether PX4 gives the mission up where it does not look there in time (force_heading)."""
        asked: Mapping[int, float | None] = {
            Command.NAV_LOITER_TIME: item.param2,
            Command.NAV_LOITER_TO_ALT: item.param1,
        }
        return self.dialect is Autopilot.PX4 and (asked.get(item.command) or 0.0) > 0.0

    def look_at(self, item: MissionItem) -> None:
        """Turn to a region of interest from the next item on, or no more.

        Notes
        -----
        ``Navigator::run`` takes the place of DO_SET_ROI_LOCATION alone: that of DO_SET_ROI and NAV_ROI stays
        0°, 0°.  DO_SET_ROI_WPNEXT_OFFSET looks along the way, beside an offset that is not predicted.
        """
        if self.dialect is Autopilot.PX4:
            self.looks_at_deg = None
            if item.command == Command.DO_SET_ROI_LOCATION:
                self.looks_at_deg = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
            elif item.command in _ROIS_BY_MODE and item.param1 == _ROI_LOCATION:
                self.looks_at_deg = (0.0, 0.0)
        self.pass_by(item)

    def take_off(self, item: MissionItem) -> None:
        """Leave the ground."""
        if self.dialect is not Autopilot.ARDUPILOT:  # ArduPilot takes off where it is
            self.move_to(item)
        self.height_m = self._height_to_m(item)
        is_first = not any(d.kind is not StageKind.DELAY for d in self.stages)
        self._add(self._stage(StageKind.TAKEOFF, yaw_deg=item.param4))
        if is_first and self.height_m <= 0.0:
            height = quantity.height(self.height_m)
            self.remark(ZERO_TAKEOFF, f"take-off altitude {height} above home")

    def land(self, item: MissionItem) -> None:
        """Land at a place: the flight is over."""
        self._remark_gate("how PX4 lands behind a CONDITION_GATE")
        self.move_to(item)
        self.height_m = self.ground_m()
        is_here = not item.names_place
        lands_at_m_s = self._lands_at_m_s(StageKind.LAND, is_here=is_here)
        stage = self._stage(
            StageKind.LAND,
            yaw_deg=item.param4,
            is_here=is_here,
            datum_m=self.datum_m,
            named_ground_m=self._named_ground_m(item),
            lands_by_name=self._lands_by_name(item),
        )
        self._add(replace(stage, lands_at_m_s=lands_at_m_s))
        self._remark_named_ground(self.stages[-1])
        self.is_over = True

    def _remark_named_ground(self, landing: Stage) -> None:
        """Tell that a landing is slow from far above the ground."""
        named_m = landing.named_ground_m
        if named_m is None:
            return
        above_m = named_m - max(landing.height_m, landing.datum_m)
        if above_m <= 0.0:
            return
        by, older = ("", "") if landing.lands_by_name else (" from 4.7 on", "; the longer counts")
        height = quantity.height(above_m)
        self.remark(
            ITEM_NOT_MODELLED,
            f"a landing with an altitude {height} above the ground: ArduCopter{by} takes it for that of the "
            f"ground and is slow from 10 m (LAND_ALT_LOW) above it{older}",
            severity=Severity.INFO,
        )

    def _named_ground_m(self, item: MissionItem) -> float | None:
        """Return the height of the ground of a landing by the altitude of its item; ``None``: none counts.

        Notes
        -----
        ``ModeAuto::get_alt_above_ground_cm`` of ArduCopter from 4.7 on (ArduPilot #30195): without a
        rangefinder a landing at a place goes by its height above that item, in its own frame.  Before by that
        above the terrain, or above home, as a return and a load set down (``PayloadPlace``) do still.
        """
        by_altitude = self.habits.lands_by_altitude is not False
        if self.dialect is Autopilot.PX4 or not by_altitude or not item.names_place:
            return None
        if item.altitude_m is None:
            return None
        if item.frame in TERRAIN_FRAMES:
            ground_m = self._known_ground_m()
            return item.altitude_m + (self.datum_m if ground_m is None else ground_m)
        if not is_amsl(item.frame, self.dialect):
            return item.altitude_m + self.datum_m
        if self.number not in self.amsl_items:
            self.amsl_items.append(self.number)
        return item.altitude_m - (self.home_amsl_m or 0.0)

    def _lands_by_name(self, item: MissionItem) -> bool:
        """Return whether a landing is known to go by its altitude: above terrain only with its data."""
        return self.habits.lands_by_altitude is True and item.frame not in TERRAIN_FRAMES

    def circle(self, item: MissionItem) -> None:
        """Fly turns about a place; the vehicle is on their circle afterwards."""
        from_deg, from_m = (self.latitude_deg, self.longitude_deg), self.height_m
        self.move_to(item)
        self.height_m = self._height_to_m(item)
        turns, radius = abs(item.param1 or 0.0), item.param3 or 0.0
        if turns > MOST_TURNS or abs(radius) > LARGEST_RADIUS_M:
            self.refuse(item, f"{quantity.count(turns, 'turn')} of {radius:g} m cannot be flown")
        if self.dialect is not Autopilot.PX4:  # which refuses circles
            if (item.param1 or 0.0) < 0.0:
                message = (
                    f"{command_name(item.command)}: ArduPilot keeps its count of {item.param1:g} without a "
                    f"sign, as none or up to 255 turns by its board: predicted as {turns:g}"
                )
                self.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)
            kept_turns = stored_turns(turns)
            kept_radius = stored_radius_m(radius)
            written = f"{quantity.count(turns, 'turn')} of {radius:g} m"
            if (kept_turns, kept_radius) != (turns, radius):
                self._remark_stored(item, written, f"{kept_turns:g} of {kept_radius:g} m")
            if kept_radius == 0.0:
                way_m = float(distance_m(*from_deg, self.latitude_deg, self.longitude_deg))
                self._remark_no_radius(math.hypot(way_m, self.height_m - from_m))
            turns, radius = kept_turns, self._flown_radius_m(item, kept_radius, kept_turns)
        follows = item.frame in TERRAIN_FRAMES and self.dialect is Autopilot.ARDUPILOT
        ground_m = self._known_ground_m() if follows else None
        self._add(
            replace(
                self._stage(StageKind.CIRCLE),
                turns=turns,
                radius_m=radius,
                followed_ground_m=()
                if ground_m is None
                else (ground_m + (self.ground_datum_m or 0.0),),
                follows_ground=ground_m is not None,
            )
        )
        if radius and self.dialect is not Autopilot.PX4:
            self._leave_centre(from_deg, radius, turns)

    def _remark_no_radius(self, way_m: float) -> None:
        """Tell of turns without a radius ``way_m`` away, which versions of ArduPilot fly differently.

        Notes
        -----
        ``AC_Circle`` until 4.6 has no radius either until one is set, and ``circle_movetoedge_start`` goes to
        the centre then; no flight of those is known.
        """
        name = "NAV_LOITER_TURNS"
        if self.habits.circles_by_rate is None and way_m > EDGE_NEAR_M:
            message = (
                f"{name} has no radius: ArduCopter 4.7 turns at once, on the way to its place and at the "
                "height before, others fly there first, as predicted: give it a radius, or the version with "
                "--target"
            )
            severity = Severity.ERROR if self.dialect is None else None
            self.remark(ITEM_NOT_MODELLED, message, severity=severity)
        elif self.habits.circles_by_rate is False and self.circle_radius_m == 0.0:
            message = (
                f"{name} has no radius, nor has one before: ArduPilot may turn on the spot at its place, by "
                "its source; predicted is a circle of CIRCLE_RADIUS"
            )
            self.remark(ITEM_NOT_MODELLED, message)

    def _leave_centre(self, from_deg: tuple[float, float], radius_m: float, turns: float) -> None:
        """Go from the centre of a circle to where its turns end, begun nearest to where the vehicle was.

        On a plane: circles are small.  At the centre itself its heading tells, which is not known.
        """
        east_deg = math.cos(math.radians(self.latitude_deg))
        away = complex(
            from_deg[0] - self.latitude_deg,
            math.remainder(from_deg[1] - self.longitude_deg, 360.0) * east_deg,
        )
        is_at_centre = abs(away) <= _AT_CENTRE_DEG
        begun = "begun at its centre, which ArduPilot leaves straight behind, by its heading"
        self.unknown_side = begun if is_at_centre else ""
        away = complex(-1.0, 0.0) if is_at_centre else away / abs(away)
        away *= cmath.rect(
            abs(radius_m) / _METRES_PER_DEGREE, math.copysign(math.tau * turns, radius_m)
        )
        self.latitude_deg += away.real
        self.longitude_deg += away.imag / east_deg

    def _flown_radius_m(self, item: MissionItem, radius_m: float, turns: float) -> float:
        """Return the radius that ArduPilot gives a circle, negative for counter-clockwise; 0: on the spot.

        Notes
        -----
        ``ModeAuto::circle_movetoedge_start`` and ``circle_start``.  Until 4.6 the direction is the item's,
        and ``AC_Circle`` keeps its radius where the item has none; 4.7 takes 0 as it is, and turns by
        CIRCLE_RATE: ``AC_Circle::get_rate_degs`` returns that, no longer the rate whose sign was set.
        Flown with 4.7.0-dev: clockwise for a radius of -20 m, and on the spot behind it for 0.
        """
        habits = self.habits
        if radius_m == 0.0 and habits.circles_by_rate:
            return 0.0
        asked_m = self._circle_radius_m(item, radius_m)
        by_rate_m = math.copysign(asked_m, 1.0 if habits.circles_clockwise else -1.0)
        if habits.circles_by_rate is False or by_rate_m == asked_m:
            return asked_m
        way = "clockwise" if habits.circles_clockwise else "counter-clockwise"
        message = (
            f"{command_name(item.command)}: ArduCopter 4.7 turns {way}, by the sign of CIRCLE_RATE"
        )
        if habits.circles_by_rate:
            self.remark(
                ITEM_NOT_MODELLED, f"{message}, not by the item's radius, and is predicted so"
            )
            return by_rate_m
        is_part = turns % 1.0 != 0.0
        self.remark(
            ITEM_NOT_MODELLED,
            f"{message}, others by the item's radius, as predicted"
            + (": give the version with --target" if is_part else ""),
            severity=Severity.ERROR if is_part else Severity.WARNING,
        )
        return asked_m

    def _circle_radius_m(self, item: MissionItem, radius_m: float) -> float:
        """Return the radius of a circle until ArduCopter 4.6: where it has none, that of the one before."""
        if radius_m == 0.0 and self.circle_radius_m > 0.0:
            before = quantity.distance(self.circle_radius_m)
            message = (
                f"{command_name(item.command)} has no radius: ArduPilot flies the {before} of the "
            )
            self.remark(ITEM_NOT_MODELLED, message + "circle before")
            return self.circle_radius_m
        self.circle_radius_m = abs(radius_m)
        return radius_m or self.habits.circle_radius_m

    @property
    def _in_air(self) -> bool:
        return bool(self.stages) and not self.has_landed

    def delay(self, item: MissionItem) -> None:
        """Wait for a time, or until a time of day."""
        seconds = item.param1 or 0.0
        if seconds > LONGEST_HOLD_S:
            self.refuse(item, f"a delay of {seconds:g} s is longer than any flight")
        in_air = self._in_air
        if seconds <= 0.0:
            clock = [item.param2, item.param3, item.param4]
            if any(part is not None and part >= 0.0 for part in clock):
                until = ":".join("--" if p is None or p < 0.0 else f"{p:02.0f}" for p in clock)
                where = "in the air" if in_air else "on the ground"
                message = f"waits {where} until {until} UTC: not counted"
                severity: Severity | None = Severity.ERROR  # a hover, or idling, of any length
                if self.dialect is Autopilot.PX4:
                    message = f"PX4 has no time of day: it does not wait until {until} UTC"
                    severity = None
                self.remark(WAIT_NOT_COUNTED, message, severity=severity)
        elif self.has_landed:
            landing = self.stages[-1]
            self.stages[-1] = replace(landing, hold_s=landing.hold_s + seconds)
        elif not in_air:
            wait = quantity.duration(seconds)
            message = f"waits {wait} on the ground before the take-off: not counted"
            self.remark(WAIT_NOT_COUNTED, message)
        elif self._circles_on:
            self._circle_on(item, seconds)
        else:
            self._add(self._stage(StageKind.DELAY, hold_s=seconds))

    @property
    def _circles_on(self) -> bool:
        """Whether ArduPilot flies on round the circle behind it while it is delayed.

        ``ModeAuto::do_nav_delay`` starts nothing: ``circle_run`` goes on.  Flown: a quarter of a circle of
        20 m and 20 s of NAV_DELAY lead all round it.
        """
        circles = bool(self.stages) and self.stages[-1].kind is StageKind.CIRCLE
        return circles and self.dialect is not Autopilot.PX4 and self.stages[-1].radius_m != 0.0

    def _circle_on(self, item: MissionItem, seconds: float) -> None:
        circle = self.stages[-1]
        self.stages[-1] = replace(circle, hold_s=circle.hold_s + seconds)
        self.unknown_side = "and NAV_DELAY, while which ArduPilot circles on"
        if self.waiting:
            message = (
                f"{command_name(item.command)} behind LOITER_TURNS, and what conditions hold back: ArduPilot "
                "carries that out while it circles on, which is not predicted"
            )
            self.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)

    def set_down(self, item: MissionItem) -> None:
        """Lower a load to the ground."""
        self.move_to(item)
        above_m = self.height_m - self.ground_m()
        deepest_m = max(item.param1 or 0.0, 0.0)
        stage = self._stage(StageKind.SET_DOWN, above_ground_m=above_m)
        self._add(replace(stage, gives_up_m=deepest_m))
        known = self._known_ground_m() is not None
        level = "" if known else "touch the ground at home's level and to "
        message = f"NAV_PAYLOAD_PLACE: the load is assumed to {level}weigh nothing"
        self.remark(ITEM_NOT_MODELLED, message)

    def arc(self, item: MissionItem) -> None:
        """Fly straight to a place; the arc is only reported."""
        self._go(StageKind.GO, item)
        half_rad = 0.5 * math.radians(min(abs(item.param1 or 0.0), 359.0))
        longer = ""
        if half_rad > 0.0:  # arc over chord
            longer = f", {quantity.decimals(half_rad / math.sin(half_rad), 2)} times as long"
        self.remark(
            ITEM_NOT_MODELLED,
            "NAV_ARC_WAYPOINT is not modelled: a straight flight to its place is assumed, not the "
            f"arc of {abs(item.param1 or 0.0):g}°{longer}",
            severity=Severity.ERROR if longer else None,
        )

    def gate(self, item: MissionItem) -> None:
        """Leave out a gate, which no vehicle flies to.

        ``Mission::setActiveMissionItems`` of PX4 sets course for the next item with a place; what stands in
        between is carried out where the way there passes the gate.
        """
        if self.dialect is Autopilot.ARDUPILOT:
            self.pass_by(item)
            return
        self.is_behind_gate = True
        self.remark(
            ITEM_NOT_MODELLED,
            "CONDITION_GATE is not modelled: a straight flight past it to the next place is assumed, as PX4 "
            "flies",
        )

    def _remark_gate(self, message: str) -> None:
        if self.is_behind_gate:
            self.remark(ITEM_NOT_MODELLED, f"{message} is not predicted", severity=Severity.ERROR)

    def guided(self, item: MissionItem) -> None:
        """Hand over to a companion computer, which decides when the mission continues."""
        if self.dialect is not Autopilot.ARDUPILOT:
            self.pass_by(item)
        elif stored_hold_s(item.param1 or 0.0):  # below 0 it is on or off by its board
            self.remark(
                WAITS_FOR_EVER,
                "NAV_GUIDED_ENABLE: ArduPilot waits for a companion computer until it or "
                "DO_GUIDED_LIMITS ends it; predicted without the wait",
            )

    def change_speed(self, item: MissionItem) -> None:
        """Take a new speed for what follows."""
        self._remark_gate("where PX4 passes the CONDITION_GATE that this speed counts from")
        kind, speed = item.param1 or 0.0, item.param2
        if speed is not None and speed > FASTEST_M_S:
            self.refuse(item, f"a speed of {speed:g} m/s cannot be flown")
        if self.dialect is Autopilot.PX4:
            self._change_px4_speed(speed)
        elif speed is None or speed <= 0.0:
            return
        elif kind == 2.0:
            self.climb_speed_m_s = self._kept_m_s(speed, self.habits.climb_speed_m_s, "climb")
            self.is_climb_late = self.queued > 0
        elif kind == DESCENT:
            self.descent_speed_m_s = self._kept_m_s(speed, self.habits.descent_speed_m_s, "descent")
            self.is_descent_late = self.queued > 0
        elif kind in {0.0, 1.0}:
            self.speed_m_s = speed
            self.is_speed_late = self.queued > 0
        else:
            message = (
                f"DO_CHANGE_SPEED: no speed type {kind:g}; speed unchanged, by some versions and boards of "
                "ArduPilot flown as the level speed"
            )
            # 4.7 leaves the speed as it is, but for what has a sign, which boards keep otherwise.
            is_left = self.habits.circles_by_rate is True and kind > DESCENT
            self.remark(ITEM_NOT_MODELLED, message, severity=None if is_left else Severity.ERROR)

    def _kept_m_s(self, speed_m_s: float, own_m_s: float, what: str) -> float:
        """Return a climb or descent speed as ArduPilot keeps it: raised before its first leg it may not.

        Notes
        -----
        ``AC_WPNav`` takes a parameter other than delivered for a changed one as it first flies to a place
        (``update_wpnav``), and goes by it.  Flown by a build of 4.7: with WPNAV_SPEED_UP 100 it takes 30 %
        longer, with 250 it is kept.  Of a lowered one, lost too, the slower counts.
        """
        if (
            self.dialect is not Autopilot.ARDUPILOT
            or self._has_flown_leg()
            or math.isclose(own_m_s, _DELIVERED_M_S[what])
        ):
            return speed_m_s
        return self._own_m_s(speed_m_s, own_m_s, what)

    def _own_m_s(self, speed_m_s: float, own_m_s: float, what: str) -> float:
        """Return the vehicle's own speed for a raised one that is lost, and tell of it."""
        if speed_m_s <= own_m_s:
            return speed_m_s
        self.remark(
            ITEM_NOT_MODELLED,
            f"a {what} at {quantity.speed(speed_m_s)} set before the first leg: ArduPilot may not keep it; "
            f"predicted at {quantity.speed(own_m_s)} of its parameters; set it behind the first waypoint",
        )
        return own_m_s

    def _begin_spline(self) -> None:
        """Take the vehicle's own speeds for raised ones: a first leg that is a spline loses them (flown)."""
        if self.dialect is not Autopilot.ARDUPILOT or self._has_flown_leg():
            return
        own = self.habits
        if self.climb_speed_m_s is not None:
            self.climb_speed_m_s = self._own_m_s(self.climb_speed_m_s, own.climb_speed_m_s, "climb")
        if self.descent_speed_m_s is not None:
            self.descent_speed_m_s = self._own_m_s(
                self.descent_speed_m_s, own.descent_speed_m_s, "descent"
            )

    def _has_flown_leg(self) -> bool:
        """Return whether ArduPilot has flown to a place since it took off, by its controller for places."""
        for number in reversed(range(len(self.stages))):
            if self.stages[number].kind in _ON_OR_OFF_THE_GROUND:
                return False
            if self._is_leg(number):
                return True
        return False

    def _is_leg(self, number: int) -> bool:
        """Return whether it flies to the place of a stage: not to a circle nearby, nor to no place."""
        stage = self.stages[number]
        if stage.kind is not StageKind.CIRCLE:
            return stage.kind is not StageKind.DELAY and not (
                stage.kind is StageKind.CHANGE_HEIGHT and stage.is_here
            )
        if not number or not stage.radius_m:
            return False
        way_m = float(distance_m(*self.places_deg[number - 1], *self.places_deg[number]))
        rise_m = stage.height_m - self.stages[number - 1].height_m
        return math.hypot(way_m - abs(stage.radius_m), rise_m) > EDGE_NEAR_M

    def _change_px4_speed(self, speed_m_s: float | None) -> None:
        """Take a speed: PX4 does not look at the type, and nothing above zero resets to its own."""
        asked_m_s = speed_m_s if speed_m_s is not None and speed_m_s > 0.0 else None
        is_fresh = self.sped_at == len(self.stages) and self.speed_m_s is not None
        if asked_m_s is None and is_fresh:
            self.remark(
                ITEM_NOT_MODELLED,
                "DO_CHANGE_SPEED back to PX4's own speed, right behind one to "
                f"{quantity.speed(self.speed_m_s)}: PX4 flies the next leg at that all the same, which is "
                "not predicted; leave out the one that does not count",
                severity=Severity.ERROR,
            )
        self.speed_m_s, self.sped_at = asked_m_s, len(self.stages)

    def set_home(self, item: MissionItem) -> None:
        """Move the place a return leads to."""
        self._move_home(item)
        self.moved_homes.append(
            HomePlace(
                first_stage=len(self.stages),
                east_m=0.0,
                north_m=0.0,
                ground_m=self._home_ground_m(),
                datum_m=self.datum_m,
                item=self.number,
            )
        )
        self.homes_deg.append(self.home_deg)

    def _move_home(self, item: MissionItem) -> None:
        if (
            not item.names_place
            and item.altitude_m
            and item.param1 != 1.0
            and self.dialect is not Autopilot.PX4
        ):
            height = quantity.height(item.altitude_m)
            message = (
                f"DO_SET_HOME at 0°, 0° and {height}: ArduPilot moves home there, or refuses it, by its "
                "version; predicted as if it were refused"
            )
            self.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)
            return
        if item.param1 == 1.0 or not self.has_place(item):
            self.home_deg = (self.latitude_deg, self.longitude_deg)
            self.datum_m = self.height_m
            if self.height_m != self.ground_level_m:
                height = quantity.height(self.height_m)
                message = (
                    f"DO_SET_HOME: home is moved to where the vehicle flies, {height} up; the "
                    "return is predicted to end on the ground"
                )
                self.remark(ITEM_NOT_MODELLED, message)
            return
        self.home_deg = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
        if item.altitude_m is None:
            return
        if item.frame in RELATIVE_FRAMES:  # of the home there has been until now
            self.datum_m += item.altitude_m
        else:
            self.amsl_items.append(self.number)
            self.datum_m = item.altitude_m - (self.home_amsl_m or 0.0)
        self.ground_level_m = self.datum_m

    def switch_fence(self, item: MissionItem) -> None:
        """Switch the fence on or off, or its floor off; any other value does nothing."""
        action = _FENCE_ACTIONS.get(int(item.param1 or 0.0))
        if action is not None and self.dialect is not Autopilot.PX4:
            first = len(self.stages)
            self.fence_switches.append(
                FenceSwitch(
                    first_stage=first, action=action, item=self.number, is_late=self.queued > 0
                )
            )

    def switch_parachute(self, item: MissionItem) -> None:
        """Switch the parachute on or off: on at once, off only where no condition may hold it back."""
        is_on = item.param1 == PARACHUTE_ON
        if is_on or (item.param1 == PARACHUTE_OFF and not self.conditions):
            self.parachute_switches.append(
                ParachuteSwitch(first_stage=len(self.stages), is_on=is_on, item=self.number)
            )
        self.pass_by(item)

    def pass_by(self, item: MissionItem) -> None:
        """Follow an item that is no flight of its own, or none that is predicted."""
        wait_s = self.habits.payload_waits_s.get(item.command, 0.0) if self._in_air else 0.0
        if wait_s > 0.0:
            self._add(self._stage(StageKind.DELAY, hold_s=wait_s))
        effect = command_effect(item.command)
        if effect is CommandEffect.NO_EFFECT or item.command in {
            Command.DO_JUMP,
            Command.DO_JUMP_TAG,
            Command.JUMP_TAG,
        }:
            return
        name = command_name(item.command)
        if item.command == Command.DO_AUX_FUNCTION:
            name += f" {item.param1 or 0.0:g}"
        if self.dialect is not None and support(item.command, self.dialect) is Support.SKIPPED:
            assumed = f"{self.dialect.label} skips it, 0 s and 0 Wh are assumed"
        elif is_destination(item.command) and self.has_place(item):
            self._go(StageKind.GO, item)
            assumed = "a straight flight to its place is assumed"
        elif wait_s > 0.0:
            assumed = f"a wait of {quantity.duration(wait_s)} is predicted, no change of mass"
        else:
            assumed = "0 s and 0 Wh are assumed"
        self.remark(
            ITEM_NOT_MODELLED,
            f"{name} is not modelled: {assumed}",
            severity=None
            if goes_on_flying(item.command, item.param1, self.dialect)
            else Severity.ERROR,
        )

    def _hold_s(self, item: MissionItem) -> float:
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
            self._remark_stored(item, f"a hold of {hold:g} s", f"{kept:g} s")
        return kept

    def _remark_stored(self, item: MissionItem, written: str, kept: str) -> None:
        message = f"{command_name(item.command)}: ArduPilot keeps {written} as {kept}"
        self.remark(VALUE_STORED_OTHERWISE, message)

    def _height_to_m(self, item: MissionItem) -> float:
        """Return the height above the first home that an item leads to; 0 in the air may mean 'as before'.

        ``ModeAuto::do_loiter_to_alt`` takes the 0 as it is, when it is where it goes, as PX4 does.
        """
        is_as_before = item.altitude_m == 0.0 and item.command != Command.NAV_LOITER_TO_ALT
        if is_as_before and self.stages:
            if self.dialect is Autopilot.ARDUPILOT:
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
        message += ", as predicted; name who flies it (--target, --params)"
        self.remark(ZERO_ALTITUDE, message, severity=Severity.ERROR)
        return self.height_m


_KINDS: Mapping[int, StageKind] = {
    Command.NAV_WAYPOINT: StageKind.GO,
    Command.NAV_SPLINE_WAYPOINT: StageKind.SPLINE,
    Command.NAV_LOITER_TIME: StageKind.LOITER,
}
_HANDLERS: Mapping[int, Callable[[MissionState, MissionItem], None]] = {
    **dict.fromkeys(_KINDS, MissionState.go),
    Command.NAV_LOITER_TURNS: MissionState.circle,
    Command.NAV_LOITER_TO_ALT: MissionState.change_height,
    Command.NAV_LOITER_UNLIM: MissionState.loiter_for_ever,
    Command.NAV_TAKEOFF: MissionState.take_off,
    Command.NAV_VTOL_TAKEOFF: MissionState.take_off,
    Command.NAV_LAND: MissionState.land,
    Command.NAV_VTOL_LAND: MissionState.land,
    Command.NAV_RETURN_TO_LAUNCH: MissionState.return_home,
    Command.NAV_DELAY: MissionState.delay,
    Command.NAV_PAYLOAD_PLACE: MissionState.set_down,
    Command.NAV_ARC_WAYPOINT: MissionState.arc,
    Command.CONDITION_GATE: MissionState.gate,
    Command.NAV_GUIDED_ENABLE: MissionState.guided,
    Command.DO_CHANGE_SPEED: MissionState.change_speed,
    Command.DO_SET_HOME: MissionState.set_home,
    Command.DO_FENCE_ENABLE: MissionState.switch_fence,
    Command.DO_PARACHUTE: MissionState.switch_parachute,
    **dict.fromkeys(
        (
            *_ROIS_BY_MODE,
            Command.DO_SET_ROI_LOCATION,
            Command.DO_SET_ROI_WPNEXT_OFFSET,
            Command.DO_SET_ROI_NONE,
        ),
        MissionState.look_at,
    ),
}
"""How each command is followed; any other is passed by."""
