"""From a mission to the route it asks for: items in flown order, places in metres, heights above home."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import MissionFileError, OtherVehicleError
from planner.findings import Rule, Severity
from planner.geo.geodesy import LocalFrame, distance_m
from planner.mission.commands import (
    LANDINGS,
    RELATIVE_FRAMES,
    TAKEOFFS,
    Command,
    command_name,
    is_destination,
    is_navigation,
    px4_takes_off_after,
)
from planner.mission.items import MissionFormat, VehicleKind
from planner.mission.route.followed import WAYPOINTS, FollowedMission
from planner.mission.route.order import FlownOrder, flown_order
from planner.mission.route.position import counts_from_sea, ground_amsl_m, is_on_earth
from planner.mission.route.queue import JUMPS
from planner.mission.route.stage import LANDED_STAGES, Lap, Route, Stage, StageKind
from planner.mission.route.state import AS_DELIVERED, ITEM_NOT_MODELLED, VehicleHabits
from planner.mission.route.walk import ENDLESS, LIFTS_OFF
from planner.mission.storage import stored_hold_s
from planner.mission.takers import may_fly
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Home, Mission, MissionItem
    from planner.mission.route.queue import Firing


_FLOWN_ON_TO = frozenset(
    {
        *(Command.NAV_WAYPOINT, Command.NAV_SPLINE_WAYPOINT, Command.NAV_LOITER_TIME),
        *(Command.NAV_LOITER_UNLIM, Command.NAV_PAYLOAD_PLACE),
    }
)
"""``ModeAuto::set_next_wp``: what ArduPilot flies on to through a waypoint."""
_LOWEST_HOME_M = -500.0
_HIGHEST_HOME_M = 9000.0


def make_route(
    mission: Mission,
    *,
    dialect: Autopilot | None = None,
    is_assumed: bool = False,
    home_amsl_m: float | None = None,
    terrain: TerrainGrid | None = None,
    firings: Mapping[int, Firing] | None = None,
    habits: VehicleHabits = AS_DELIVERED,
) -> Route:
    """Return the route a mission asks for; without stages where the mission holds no flight.

    Parameters
    ----------
    dialect : Autopilot, optional
        Whose reading of the items counts: of the vehicle that flies, else of the file's firmware.
    is_assumed : bool, optional
        Whether the vehicle's model only assumes it: nobody named it.
    home_amsl_m : float, optional
        Altitude of the take-off place; default the mission's own. [m AMSL]
    terrain : TerrainGrid, optional
        The ground; default level with home.
    firings : Mapping, optional
        Where on their legs items that conditions hold back are carried out, by position among the
        reached items; any other is dropped.
    habits : VehicleHabits, optional
        How the vehicle carries out items; default as its autopilot is delivered.

    Raises
    ------
    OtherVehicleError
        If the mission is certainly not a multicopter's.
    MissionFileError
        If an item holds a number no vehicle can fly.
    """
    able = may_fly(mission, None if is_assumed else dialect)
    order = flown_order(mission.items, dialect, keeps_counts=habits.keeps_counts, able=able)
    state, findings = _begin(mission, dialect, home_amsl_m, terrain, able=able)
    state.firings = firings or {}
    continues_after = habits.continues_after
    if continues_after is None:
        continues_after = frozenset() if dialect is None else CONTINUES_AFTER[dialect]
    state.habits = habits
    findings += _other_vehicle(mission)
    findings += order.findings
    reached: list[int] = []
    elsewhere: set[int] = set()
    lap_start: int | None = None
    for position, number in enumerate(order.visits):
        if state.is_over and state.stages[-1].kind in continues_after:
            ahead = (mission.items[n - 1] for n in order.visits[position:])
            state.is_over = not _takes_off_next(state, ahead)
        if state.is_over:
            goes_on = state.stages[-1].kind in continues_after
            findings += _left_out(mission, state, order.visits[position:], reached, goes_on=goes_on)
            break
        if position == order.lap_start:
            lap_start = len(state.stages)
        if position in order.foreseen:
            elsewhere |= _plan_ahead(state, order, mission.items, position)
        reached.append(number)
        is_last = position == len(order.visits) - 1
        datum_m = state.datum_m
        state.follow(number, mission.items[number - 1], is_last=is_last)
        if state.datum_m != datum_m:
            ahead = (mission.items[n - 1] for n in order.visits[position + 1 :])
            is_set_before = mission.items[number - 1].command == Command.DO_SET_HOME
            _remark_datum(state, state.datum_m - datum_m, ahead, is_set_before=is_set_before)
    flown = len(state.stages)
    findings += (
        FLOWN_ELSEWHERE.finding(
            f"{command_name(mission.items[jump - 1].command)} leads to an item that is not flown: ArduPilot "
            "flies to the place behind the jump, which is not predicted",
            item=jump,
            place=mission.items[jump - 1].place,
        )
        for jump in sorted(elsewhere)
    )
    findings += _boundaries(mission, state)
    assumed = len(state.stages) - flown  # a take-off put before everything
    findings += state.remarks.findings()
    findings += _assumed_levels(mission, state)
    lap = None
    if order.lap_item is not None and lap_start is not None and not state.is_over:
        lap = Lap(item=order.lap_item, first_stage=lap_start + assumed)
    laid_out = _laid_out(state, tuple(reached), lap, tuple(findings), assumed)
    return replace(laid_out, return_height_m=mission.return_height_m)


def _is_planned_already(state: FollowedMission, onward: MissionItem | None) -> bool:
    """Return whether ArduPilot has the next leg planned, above the home before, when home moves.

    Notes
    -----
    ``ModeAuto::set_next_wp`` hands the place after next on while the one before is flown to, as a place with
    an altitude; ``AC_WPNav::set_wp_destination`` then takes the leg that was planned to it.
    """
    if state.dialect is Autopilot.PX4 or not state.stages:
        return False
    before = state.stages[-1]
    if before.kind not in {StageKind.GO, StageKind.SPLINE} or stored_hold_s(before.hold_s):
        return False
    return onward is not None and onward.command in _FLOWN_ON_TO and onward.frame in RELATIVE_FRAMES


def _remark_datum(
    state: FollowedMission, change_m: float, ahead: Iterable[MissionItem], *, is_set_before: bool
) -> None:
    """Tell what ArduPilot flies next at a height by the home before; set on the way it is known by then."""
    onward = next((item for item in ahead if is_navigation(item.command)), None)
    change = quantity.height(abs(change_m))
    way, does = ("up", "climbs") if change_m > 0.0 else ("down", "descends")
    if abs(change_m) < _SAME_LEVEL_M:
        return
    if _is_planned_already(state, onward):
        state.remark(
            ITEM_NOT_MODELLED,
            f"DO_SET_HOME moves home {way} by {change} behind a place that is flown "
            "through: ArduPilot flies the next leg above the home before, predicted above the new one; hold "
            "for 1 s at that place",
            severity=Severity.ERROR
            if change_m > 0.0
            else Severity.WARNING,  # it flies lower, or higher
        )
    elif not is_set_before and _returns_for_ever(state, change_m):
        state.remark(
            ENDLESS,
            f"DO_SET_HOME moves home {way} by {change} as the return begins: ArduPilot hovers over the home "
            "before until the battery is empty; put a NAV_DELAY of 1 s behind it",
            severity=Severity.ERROR,
        )
    elif not is_set_before and _changes_to_height_of_home(state):
        state.remark(
            ITEM_NOT_MODELLED,
            f"DO_SET_HOME moves home {way} by {change} while NAV_LOITER_TO_ALT is flown: ArduPilot then "
            f"{does} to its height above the new home, which is not predicted; put a NAV_DELAY of 1 s behind "
            "it",
            severity=Severity.ERROR,
        )
    elif is_set_before and _keeps_height(state, onward):
        state.remark(
            ITEM_NOT_MODELLED,
            f"DO_SET_HOME moves home {way} by {change} where a landing, a return or an item of altitude 0 "
            f"comes next: ArduPilot {does} by as much before it, which is not predicted; put a NAV_DELAY of "
            "1 s behind it",
            severity=Severity.ERROR,
        )


def _keeps_height(state: FollowedMission, onward: MissionItem | None) -> bool:
    """Return whether ArduPilot sets out at the height it has, by the home before, when home moves.

    Notes
    -----
    ``Copter::current_loc`` still holds the height above the home before when what comes next begins in the
    same loop; ``ModeAuto::terrain_adjusted_location``, ``ModeRTL::compute_return_target`` and, where the
    altitude is 0, ``ModeAuto::loc_from_cmd`` take it for that above the new one.
    """
    if state.dialect is Autopilot.PX4 or onward is None or not state.stages or state.has_landed:
        return False
    if onward.command == Command.NAV_RETURN_TO_LAUNCH:
        return True
    if onward.command in LANDINGS | {Command.NAV_PAYLOAD_PLACE}:
        return onward.names_place
    if onward.altitude_m != 0.0 or onward.command in TAKEOFFS:
        return False
    if onward.command == Command.NAV_WAYPOINT and state.stages[-1].kind in WAYPOINTS:
        return False  # ModeAuto::do_nav_wp takes the height of the place before
    return is_destination(onward.command)


def _returns_for_ever(state: FollowedMission, change_m: float) -> bool:
    """Return whether a return began right before a DO_SET_HOME moved home up or down.

    Flown with ArduCopter 4.7.0-dev: by 3 m, 8 m, 20 m and 50 m it never came down, by 1 m it did.
    """
    if state.dialect is Autopilot.PX4 or state.stages[-1].kind is not StageKind.RETURN:
        return False
    first = state.moved_homes[-1].first_stage
    is_underway = state.stages[first - 1].kind is StageKind.RETURN_LEG
    return abs(change_m) > _RETURN_ENDS_M and not is_underway


def _changes_to_height_of_home(state: FollowedMission) -> bool:
    """Return whether home moved while a height above it was flown to.

    ``ModeAuto::do_loiter_to_alt`` keeps that height, ``loiter_to_alt_run`` compares it with one above the
    home there is then.
    """
    return state.dialect is not Autopilot.PX4 and state.stages[-1].kind is StageKind.CHANGE_HEIGHT


def _plan_ahead(
    state: FollowedMission, order: FlownOrder, items: Sequence[MissionItem], position: int
) -> set[int]:
    """Mark that the next place is not seen where it is not, and return the jump where a wrong one is."""
    if not state.stages:
        return set()
    jump, planned = order.foreseen[position]
    command = Command.NAV_RETURN_TO_LAUNCH if planned is None else items[planned - 1].command
    before = state.stages[-1]
    if command not in _FLOWN_ON_TO:
        state.stages[-1] = replace(before, is_next_unseen=True)
    elif before.kind in {StageKind.GO, StageKind.SPLINE} and not stored_hold_s(before.hold_s):
        ahead = (items[number - 1].command for number in order.visits[position:])
        comes = next((command for command in ahead if is_navigation(command)), None)
        # A return plans its path anew (ModeRTL::init) and drops the leg planned ahead.
        return set() if comes == Command.NAV_RETURN_TO_LAUNCH else {jump}
    return set()


FLOWN_ELSEWHERE = Rule(
    "T124 flown-elsewhere",
    Severity.ERROR,
    summary="A jump leads to an item that is no place: ArduPilot flies to the place behind the jump.",
    why="ArduCopter plans the leg after next ahead.  Where a jump leads to a DO_ item or a tag it finds the "
    "place behind the jump instead, flies there, and then on to places that are in no mission (ArduPilot "
    "#31021, 4.6 and 4.7).",
    how="A DO_JUMP to an item that is not flown, or a DO_JUMP_TAG, with a waypoint, spline or loiter as the "
    "next place behind it (ModeAuto::set_next_wp, AP_Mission::get_next_nav_cmd), and a place before it that "
    "is flown through.  Behind a hold, or before other items, the vehicle stops and plans anew, and so where "
    "a return to launch comes next.",
    fix="let the jump lead to a place, or hold for 1 s at the place before it",
    instead="a jump to a place",
)


CONTINUES_AFTER: Mapping[Autopilot, frozenset[StageKind]] = {
    Autopilot.ARDUPILOT: frozenset({StageKind.RETURN}),
    Autopilot.PX4: frozenset({StageKind.LAND}),
    Autopilot.STEP: frozenset(),
}
"""After what landings a mission goes on as the autopilots are delivered: ``ModeAuto::rtl_run`` does not
disarm, ``Commander::handleAutoDisarm`` not in the middle of a mission."""
_LOOKED_AHEAD = 16
"""Places in the list from which ArduPilot looks ahead for a take-off."""
_RETURN_ENDS_M = 1.0
"""A return begun before home moves up or down by no more still ends. [m]"""
_SAME_LEVEL_M = 0.5
"""Heights of home that differ by less are one. [m]"""
_AT_HOME_M = 50.0
"""A landing within this is one at home: one walks there and fetches it. [m]"""
_LANDS = LANDINGS | {Command.NAV_RETURN_TO_LAUNCH}
"""Where a flight is over; a take-off after it begins another one."""
_STRAIGHT_UP_M = 2.0
"""So far beside its landing place PX4 is sent straight up: NAV_ACC_RAD of multicopters, within which it
is there already. [m]"""


def _takes_off_next(state: FollowedMission, ahead: Iterable[MissionItem]) -> bool:
    """Return whether a take-off is the next navigation command but for delays.

    Notes
    -----
    ``AP_Mission::is_takeoff_next`` asks for the next navigation command from each place on: conditions and
    DO_ commands are looked past, and jumps are followed.  PX4 flies to whatever comes next straight from
    the ground, a take-off or not (``MissionBase::checkClimbRequired`` asks when the mission begins, not
    after a landing in it): up, where that is over where it stands.
    """
    places = (item for item in ahead if item.command not in JUMPS)
    last_delay = -1
    for place, item in enumerate(places):
        if state.dialect is Autopilot.PX4 and item.command in LIFTS_OFF:
            return _is_over(state, item)
        if item.command in TAKEOFFS:
            return last_delay + 1 < _LOOKED_AHEAD
        if item.command == Command.NAV_DELAY:
            last_delay = place
        elif is_navigation(item.command):
            return False
    return False


def _is_over(state: FollowedMission, item: MissionItem) -> bool:
    """Return whether an item is over where the vehicle stands."""
    north, east = item.latitude_deg, item.longitude_deg
    if north is None or east is None or not is_on_earth(north, east):
        return False
    return float(distance_m(state.latitude_deg, state.longitude_deg, north, east)) <= _STRAIGHT_UP_M


HOME_UNKNOWN = Rule(
    "M107 home-unknown",
    Severity.WARNING,
    summary="The file has no home.",
    why="The flight to the first item and the return depend on it.",
    how="No planned home; the first item with a position is taken as the take-off place.  An error where the "
    "margin does not hold the way from 500 m away, as far as a small multicopter is seen, and back: at the "
    "vehicle's own speed and the greater of the power of a hover and the flight's mean.  Where it does, a "
    "warning says from how far away it does: nobody has checked a take-off from farther.  With --terrain "
    "an error, too, where a flight from the lowest ground so near, or a return there, would be lower than "
    "--clearance, the way out or home over the highest of it, or that ground is not all known.",
    fix="set the planned home position in the mission",
    instead="a mission with its home",
)


def _begin(
    mission: Mission,
    dialect: Autopilot | None,
    home_amsl_m: float | None,
    terrain: TerrainGrid | None,
    *,
    able: frozenset[Autopilot],
) -> tuple[FollowedMission, list[Finding]]:
    """Return the state at home, and what had to be assumed about home."""
    findings: list[Finding] = []
    home = mission.home
    place = (0.0, 0.0)
    stated_m = None
    if home is not None:
        place = (home.latitude_deg, home.longitude_deg)
        if not is_on_earth(*place):
            message = f"home is at {place[0]:g}°, {place[1]:g}°: not a place on Earth"
            raise MissionFileError(message, source=mission.source)
        if home_amsl_m is None:
            stated_m = _home_amsl_m(mission.source, home)
    else:
        for number, item in enumerate(mission.items, start=1):
            there = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
            if is_destination(item.command) and any(there) and is_on_earth(*there):
                place = there
                message = (
                    "no home in the file: the flight is assumed to start at the "
                    f"place of item {number}"
                )
                findings.append(HOME_UNKNOWN.finding(message, item=number, place=item.place))
                break
        else:
            if mission.items:
                message = "no home and no other place in the file"
                findings.append(HOME_UNKNOWN.finding(message))
    amsl_m, datum_m = _levels_m(
        home_amsl_m,
        stated_m,
        None if terrain is None else ground_amsl_m(terrain, *place),
        counts_from_sea=counts_from_sea(mission.items, dialect),
    )
    state = FollowedMission(
        source=mission.source,
        dialect=dialect,
        may_fly=able,
        start_deg=place,
        home_deg=place,
        home_amsl_m=amsl_m,
        ground_datum_m=datum_m,
        terrain=terrain,
        latitude_deg=place[0],
        longitude_deg=place[1],
    )
    return state, findings


GRID_ERROR_M = 16.0
"""What a grid may be wrong by in height: the absolute accuracy SRTM was specified to, in 90 of 100 places
(Farr et al. 2007; Copernicus GLO-30 is specified to 4 m); geoids of 1996 and 2008 differ by 1 m. [m]"""


def _levels_m(
    given_m: float | None, stated_m: float | None, ground_m: float | None, *, counts_from_sea: bool
) -> tuple[float | None, float | None]:
    """Return the altitude of home, and what heights of the grid are above home from. [m AMSL]

    Both autopilots measure home where they arm: a flight whose heights count from home goes over ground
    that rises from where it stands, whatever number the file has for it, and whatever the grid is wrong by
    everywhere.  Altitudes from the sea are flown as the vehicle measures home: at the one given, else the
    file's; over the grid or above home, whichever is less.

    Parameters
    ----------
    given_m : float, optional
        Home by the user or by the vehicle itself.
    stated_m : float, optional
        Home by the file.
    ground_m : float, optional
        The ground at home by the grid.
    counts_from_sea : bool
        Whether altitudes of the mission do.
    """
    if given_m is None and ground_m is not None and (stated_m is None or not counts_from_sea):
        return ground_m, ground_m
    home_m = stated_m if given_m is None else given_m
    if home_m is None or ground_m is None:
        return home_m, home_m
    if given_m is not None and given_m - ground_m > GRID_ERROR_M:  # a roof: no error of the grid
        return home_m, home_m
    return home_m, min(home_m, ground_m)


def _home_amsl_m(source: str, home: Home) -> float | None:
    """Return the altitude that a mission gives its home; refuse one where nobody can be.

    Programs that do not know it write 0: a place at exactly 0 m is not taken from a file.
    """
    amsl_m = home.altitude_amsl_m or None
    if amsl_m is not None and not _LOWEST_HOME_M <= amsl_m <= _HIGHEST_HOME_M:
        message = (
            f"home is at {amsl_m:g} m AMSL, where no ground is: correct it, or give the "
            "altitude of the take-off place with --home-amsl"
        )
        raise MissionFileError(message, source=source)
    return amsl_m


OTHER_VEHICLE = Rule(
    "M111 other-vehicle",
    Severity.ERROR,
    summary="The mission may be one for another kind of vehicle.",
    why="A fixed-wing or VTOL mission timed as a multicopter's is wrong in every leg (QGroundControl "
    "#7662); text files do not name their vehicle.",
    how="The vehicle type of the file, else signs in its commands: a take-off pitch of 5° to 45°, a "
    "landing approach, VTOL items, depths.  What is certain is refused; PX4's own checks of landing "
    "patterns, which are for such vehicles, are not repeated.  All 22 public text files that this "
    "fires on are of aircraft.  A warning where a take-off pitch is all there is: multicopters take off "
    "without it, and fly the rest as predicted; so where --target is ArduCopter, which knows DO_LAND_START, "
    "or the parameters of --params are its own, or without them ArduPilot flies it (the model's own, or "
    "--autopilot), and where the file names a helicopter, or FRAME_CLASS (8 to 10) one or two rotors with "
    "flaps or tilt: flown as predicted, if the model is one of it.",
    fix="check that this is the file you meant to fly; save it as a plan, which names its vehicle",
    instead="a plan, which names its vehicle, ArduCopter's parameters with --params, or --target",
)

VEHICLE_ASSUMED = Rule(
    "M115 vehicle-assumed",
    Severity.INFO,
    summary="The file does not name its kind of vehicle.",
    why="QGC WPL text has no place for it, and an aircraft's mission is wrong in every leg.",
    how="No vehicle type is given; take-off pitch, landing approach, VTOL items, depths and the like "
    "are looked for and not found.",
    fix="save the mission as a plan, which names it",
)


def _other_vehicle(mission: Mission) -> list[Finding]:
    """Return that a mission is probably no multicopter's; refuse one that certainly is none."""
    vehicle = mission.vehicle
    if vehicle is None and mission.file_format is MissionFormat.WPL and mission.items:
        message = "no vehicle named in the file: no sign that it is not a multicopter"
        return [VEHICLE_ASSUMED.finding(message)]
    if vehicle is None or vehicle.kind is VehicleKind.MULTICOPTER:
        return []
    of = "mission for another kind of vehicle"
    if vehicle.kind is not VehicleKind.OTHER:
        of = f"{vehicle.kind} mission"
    kind = f"a {of} ({vehicle.reason})"
    if vehicle.is_certain:
        message = f"this is {kind}; mavjoule predicts multicopters only"
        raise OtherVehicleError(message, source=mission.source)
    message = f"possibly {kind}: predicted as a multicopter's"
    severity = Severity.WARNING if vehicle.is_weak else None
    return [OTHER_VEHICLE.finding(message, severity=severity)]


ITEMS_NOT_FLOWN = Rule(
    "T104 items-not-flown",
    Severity.INFO,
    summary="Items after the landing or return are not flown.",
    why="Items after the end of a mission are reached by a jump or a failsafe only, or never.",
    how="Items after the first LAND or RETURN_TO_LAUNCH in flown order are left out, unless the mission goes "
    "on there.  ArduPilot: a take-off is the next navigation command but for NAV_DELAY "
    "(AP_Mission::is_takeoff_next), after a return that lands, whatever MIS_OPTIONS (ModeAuto::verify_RTL), "
    "after a LAND where --params has bit 2 of MIS_OPTIONS set (4, continue after land).  PX4 after a LAND: "
    "it stays armed (Commander::handleAutoDisarm) and the next place is within 2 m of where it stands.  An "
    "error where a take-off is among those left out: a vehicle that is started again flies what is not "
    "counted; a landing more than 50 m from home is the end, and other places or a return follow: it stays "
    "where it landed (PX4 #20044; a warning of another maker's file); and on PX4 where the next "
    "place is elsewhere: it flies there at a slant from the ground, without climbing first "
    "(MissionBase::checkClimbRequired; tried).",
    fix="move the items before the landing, or delete them; to land and take off again, let a NAV_TAKEOFF "
    "follow it on ArduPilot, with MIS_OPTIONS 4, and fly two missions on PX4 (M101)",
    instead="a mission that ends with its landing",
)


def _left_out(
    mission: Mission,
    state: FollowedMission,
    after: Sequence[int],
    reached: list[int],
    *,
    goes_on: bool,
) -> list[Finding]:
    """Return that items after the end of the flight are not flown; where it ``goes_on`` there but cannot."""
    missed = sorted(set(after) - set(reached))
    if Autopilot.PX4 in state.may_fly and state.stages[-1].kind is StageKind.LAND:
        going = (n for n in after if is_destination(mission.items[n - 1].command))
        onward = next(going, None)
        # To a take-off it does not: it refuses the mission (M101).
        if onward is not None and mission.items[onward - 1].command not in TAKEOFFS:
            message = state.unless_named(
                "PX4 flies on from the landing at a slant from the ground, which is not predicted, and "
                "refuses a second take-off: fly what follows as a mission of its own"
            )
            place = mission.items[onward - 1].place
            return [
                ITEMS_NOT_FLOWN.finding(message, severity=Severity.ERROR, item=onward, place=place)
            ]
    if not missed:
        return []
    which = f"item {missed[0]}" if len(missed) == 1 else f"{len(missed)} items from {missed[0]} on"
    landing = any(
        mission.items[n - 1].command in {Command.DO_LAND_START, Command.DO_RETURN_PATH_START}
        for n in missed
    )
    # A vehicle set to continue after a landing, or started again, flies what comes after it.
    ahead = [mission.items[n - 1].command for n in after]
    is_flown = not landing and any(command == Command.NAV_TAKEOFF for command in ahead)
    said = f"{which} after the end of the flight at item {state.stages[-1].item}: not flown"
    stays = state.stages[-1].kind is StageKind.LAND and _is_away(state)
    severity = Severity.ERROR if is_flown else None
    if landing:
        said += ", reached by a failsafe only"
    elif stays and any(is_navigation(command) for command in ahead):
        said += ": the vehicle stays where it landed, away from home"
        is_asked = goes_on and state.dialect is Autopilot.ARDUPILOT
        said += "; MIS_OPTIONS 4 continues only to a take-off" * is_asked
        # Another maker's may fly on.
        severity = Severity.ERROR if is_flown or state.may_fly else Severity.WARNING
    return [
        ITEMS_NOT_FLOWN.finding(
            said, severity=severity, item=missed[0], place=mission.items[missed[0] - 1].place
        )
    ]


def _is_away(state: FollowedMission) -> bool:
    """Return whether a flight ends too far from home for whoever waits there."""
    here = state.latitude_deg, state.longitude_deg
    return float(distance_m(*here, *state.home_deg)) > _AT_HOME_M


TAKEOFF_MISSING = Rule(
    "M101 takeoff-missing",
    Severity.WARNING,
    summary="The mission does not begin with a take-off.",
    why="The vehicle does not leave the ground by itself, or in a way that is in no plan.",
    how="The first item with a flight in it is not NAV_TAKEOFF; a climb to its height is assumed.  An "
    "error on ArduPilot, which does not enter AUTO on the ground (ModeAuto::init: 'Missing Takeoff "
    "Cmd').  On PX4 an error where a take-off, the second one too, stands behind an item that it counts "
    "as a place (FeasibilityChecker::checkTakeoff; grippers, winches and actuators count, speeds, cameras "
    "and delays do not): it refuses the mission.  Both are errors where nothing names the autopilot, but of "
    "one that refuses the upload.",
    fix="add a take-off item at the start",
    instead="a take-off at the start of the mission",
)

NOTHING_TO_FLY = Rule(
    "M108 nothing-to-fly",
    Severity.ERROR,
    summary="The mission holds no flight.",
    why="An empty mission is not a 'go'; probably the wrong file was given.",
    how="No item before the first landing makes the vehicle move.",
    fix="check that this is the file you meant to fly",
    instead="a mission with a flight",
)


def _boundaries(mission: Mission, state: FollowedMission) -> list[Finding]:
    """Return what is missing at the beginning and the end; add the take-off that is assumed."""
    kinds = (stage.kind for stage in state.stages if stage.kind is not StageKind.DELAY)
    if next(kinds, StageKind.LAND) in LANDED_STAGES:  # no flight without a stage before them
        state.stages.clear()
        state.places_deg.clear()
        items = quantity.count(len(mission.items), "item")
        return [NOTHING_TO_FLY.finding(f"no flight in {items}")]
    findings: list[Finding] = []
    first = state.stages[0]
    refused = []
    if Autopilot.PX4 in state.may_fly:
        refused = [*_takeoffs_refused(mission, state, is_started=first.kind is StageKind.TAKEOFF)]
    if first.kind is not StageKind.TAKEOFF:
        item = mission.items[first.item - 1]
        height_m = max(first.height_m, 0.0)
        message = (
            f"the flight begins with {command_name(item.command)}: "
            f"a vertical take-off to {quantity.height(height_m)} is assumed"
        )
        severity = None
        if Autopilot.ARDUPILOT in state.may_fly:
            does = f"{message}; on the ground ArduPilot does not start it"
            message = does if refused else state.unless_named(does)
            severity = Severity.ERROR
        findings.append(
            TAKEOFF_MISSING.finding(message, item=first.item, place=item.place, severity=severity)
        )
        state.stages.insert(0, Stage(StageKind.TAKEOFF, first.item, 0.0, 0.0, height_m))
        state.places_deg.insert(0, state.start_deg)
    return [*findings, *refused]


def _takeoffs_refused(
    mission: Mission, state: FollowedMission, *, is_started: bool
) -> Iterator[Finding]:
    """Yield the first take-off behind something that PX4 counts as a place, another take-off too.

    If ArduPilot has not started the mission either, no name helps.
    """
    place: int | None = None
    for number, item in enumerate(mission.items, start=1):
        if place is not None and item.command in TAKEOFFS:
            before = command_name(mission.items[place - 1].command)
            message = (
                f"take-off behind {before} of item {place}: PX4 refuses a mission with a take-off that is "
                "not its first place"
            )
            yield TAKEOFF_MISSING.finding(
                state.unless_named(message) if is_started else message,
                item=number,
                place=item.place,
                severity=Severity.ERROR,
                fix=_without_takeoff(mission, place, number),
            )
            return
        if place is None and not px4_takes_off_after(item.command):
            place = number


def _without_takeoff(mission: Mission, place: int, takeoff: int) -> str:
    """Return what to do about a take-off behind a place, by what is flown between them."""
    if mission.items[place - 1].command not in TAKEOFFS:
        return f"move the take-off before item {place}"
    between = range(place, takeoff)
    landed = [n for n in between if mission.items[n - 1].command in _LANDS]
    if landed:
        return f"fly what follows item {landed[-1]} as a mission of its own"
    return "remove the take-off: PX4 climbs to the next item without it"


HOME_ALTITUDE_UNKNOWN = Rule(
    "A105 home-altitude-unknown",
    Severity.ERROR,
    summary="The altitude of home is needed but unknown.",
    why="AMSL altitudes mean nothing for a flight that starts at an unknown height; a guess would be "
    "a wrong 'go': scripts write 15 m AMSL for places 600 m up.",
    how="Items count from sea level, the file gives no home altitude or exactly 0 m (what programs write "
    "that do not know it), and neither --home-amsl nor --terrain gives it; 0 m AMSL is assumed.",
    fix="give the altitude of the take-off place with --home-amsl (0 where it is at sea level)",
    instead="--home-amsl or --terrain",
)

NO_TERRAIN_DATA = Rule(
    "X902 no-terrain-data",
    Severity.INFO,
    summary="No terrain grid: the ground is assumed level with home.",
    why="Clearances and landing heights away from home depend on it.",
    how="No terrain grid was given.  A flight lower than --clearance over such ground: A102; ground that a "
    "grid given has a hole at: X904.",
    fix="check clearances by other means, or give --terrain",
)


def _assumed_levels(mission: Mission, state: FollowedMission) -> list[Finding]:
    """Return what altitudes rest on that is not known: home's altitude, the terrain."""
    findings: list[Finding] = []
    if state.amsl_items and state.home_amsl_m is None:
        first = state.amsl_items[0]
        altitudes = quantity.count(len(state.amsl_items), "AMSL altitude")
        home = mission.home
        is_placeholder = home is not None and home.altitude_amsl_m is not None
        unknown = (
            "home is at exactly 0 m AMSL in the file, a placeholder"
            if is_placeholder
            else "altitude of home unknown"
        )
        message = f"{unknown}: 0 m AMSL assumed for {altitudes}"
        place = mission.items[first - 1].place
        findings.append(HOME_ALTITUDE_UNKNOWN.finding(message, item=first, place=place))
    if state.stages and state.terrain is None:
        level = "" if state.home_amsl_m is None else f" ({quantity.height(state.home_amsl_m)} AMSL)"
        message = f"ground assumed level with home{level}; clearance not checked"
        findings.append(NO_TERRAIN_DATA.finding(message))
    return findings


def _laid_out(
    state: FollowedMission,
    reached: tuple[int, ...],
    lap: Lap | None,
    findings: tuple[Finding, ...],
    assumed: int,
) -> Route:
    """Return the route, ``assumed`` stages put before it, laid into the local frame of home."""
    frame = LocalFrame(latitude_deg=state.start_deg[0], longitude_deg=state.start_deg[1])
    east, north = frame.east_north_m(*np.array(state.places_deg).reshape(-1, 2).T)
    homes = state.moved_homes
    home_east, home_north = frame.east_north_m(*np.array(state.homes_deg).reshape(-1, 2).T)
    return Route(
        moved_homes=tuple(
            replace(
                home,
                first_stage=home.first_stage + assumed if home.first_stage else 0,
                east_m=east_m,
                north_m=north_m,
            )
            for home, east_m, north_m in zip(
                homes, home_east.tolist(), home_north.tolist(), strict=True
            )
        ),
        stages=tuple(
            replace(stage, east_m=east_m, north_m=north_m)
            for stage, east_m, north_m in zip(
                state.stages, east.tolist(), north.tolist(), strict=True
            )
        ),
        frame=frame,
        home_amsl_m=state.home_amsl_m or 0.0,
        knows_home_amsl=state.home_amsl_m is not None,
        ground_datum_m=state.ground_datum_m or 0.0,
        amsl_items=tuple(state.amsl_items),
        fence_switches=tuple(
            replace(one, first_stage=one.first_stage + assumed if one.first_stage else 0)
            for one in state.fence_switches
        ),
        parachute_switches=tuple(
            replace(one, first_stage=one.first_stage + assumed if one.first_stage else 0)
            for one in state.parachute_switches
        ),
        held=tuple(
            replace(one, first_stage=one.first_stage + assumed, last_stage=one.last_stage + assumed)
            for one in state.held
        ),
        reached=reached,
        lap=lap,
        findings=findings,
    )
