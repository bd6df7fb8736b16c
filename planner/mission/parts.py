"""Parts of a mission: where it can be broken off and taken up again, and the items of each part."""

from __future__ import annotations

import math
from bisect import bisect_left
from itertools import pairwise
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.errors import SplitError
from planner.mission.commands import AMSL_FRAMES, TERRAIN_FRAMES, Command, Frame, command_name
from planner.mission.formats.plan import PlanDocument
from planner.mission.items import (
    Mission,
    MissionFormat,
    MissionItem,
    bare_command,
    numbered_in_order,
)
from planner.mission.route.stage import LANDED_STAGES, StageKind
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.mission.route.stage import Route, Stage


_RELAY, _SERVO, _ACTUATOR, _SPRAYER, _AUXILIARY = 181, 183, 187, 216, 218
_ROI_NONE = 197
_RELEASED = 2.0
_TRIGGER_INTERVAL, _TRIGGER, _OBLIQUE = 214, 2003, 260
_START_IMAGES, _STOP_IMAGES, _START_VIDEO, _STOP_VIDEO = 2000, 2001, 2500, 2501
_ONE_IMAGE = 1.0
_OF_AN_OUTPUT = frozenset({_RELAY, _SERVO, _AUXILIARY})
_REPEAT_RELAY, _REPEAT_SERVO = 182, 184
UNLOADING = frozenset(
    {
        *(Command.NAV_PAYLOAD_PLACE, Command.DO_GRIPPER, Command.DO_WINCH),
        *(_REPEAT_RELAY, _REPEAT_SERVO, _ACTUATOR, _SPRAYER, *_OF_AN_OUTPUT),
    }
)
"""Commands that may take up or let go what is carried."""
_PROTECTING = frozenset({Command.DO_FENCE_ENABLE, Command.DO_PARACHUTE})
"""Commands that set what the vehicle does on the way out too."""
_FAMILIES: dict[int, str] = {
    **dict.fromkeys((80, 195, 196, _ROI_NONE, 198, 201), "place to look at"),
    **dict.fromkeys((205, 220, 1000), "gimbal angles"),
    **dict.fromkeys((_START_IMAGES, _STOP_IMAGES), "images"),
    **dict.fromkeys((_START_VIDEO, _STOP_VIDEO), "video"),
    Command.CONDITION_YAW: "yaw",
    Command.DO_SET_CAM_TRIGG_DIST: "trigger distance",
    _TRIGGER_INTERVAL: "trigger interval",
    _TRIGGER: "trigger",
    _OBLIQUE: "oblique survey",
    **{
        command: f"command {command}"
        for command in (200, 202, 204, *_PROTECTING, 215, 405, 530, 531, 532, 534, 1001)
    },
    **{command: f"output {command}" for command in (_ACTUATOR, _SPRAYER, *_OF_AN_OUTPUT)},
}
"""What each command that leaves a state sets; the last of a family counts."""
_PHOTOS = frozenset({203, _START_IMAGES, _STOP_IMAGES})
"""Commands that do no harm flown twice: a photo more."""


class CarriedState(Value):
    """What is set at a point of a mission: the last item of each family, in the order set."""

    items: tuple[MissionItem, ...] = ()

    def speeds(self) -> tuple[MissionItem, ...]:
        """Return the items that command speeds."""
        return tuple(item for item in self.items if item.command == Command.DO_CHANGE_SPEED)

    def settings(self) -> tuple[MissionItem, ...]:
        """Return the items that set anything else."""
        return tuple(item for item in self.items if item.command != Command.DO_CHANGE_SPEED)

    def outputs(self) -> tuple[MissionItem, ...]:
        """Return the items that set servos, relays and the like."""
        return tuple(item for item in self.items if is_output(item))

    def protection(self) -> tuple[MissionItem, ...]:
        """Return the items that switch the fence or the parachute."""
        return tuple(item for item in self.items if item.command in _PROTECTING)

    def trigger_spacing_m(self, speed_m_s: float) -> float:
        """Return the way between two photos at a speed; 0 where no camera is triggered. [m]"""
        spacing_m = 0.0
        for item in self.items:
            if item.command in {Command.DO_SET_CAM_TRIGG_DIST, _OBLIQUE}:
                spacing_m = max(spacing_m, item.param1 or 0.0)
            elif item.command == _TRIGGER_INTERVAL:
                spacing_m = max(spacing_m, 1e-3 * (item.param1 or 0.0) * speed_m_s)
            elif item.command == _START_IMAGES:
                spacing_m = max(spacing_m, (item.param2 or 0.0) * speed_m_s)
        return spacing_m

    def stopping_items(self) -> tuple[MissionItem, ...]:
        """Return the items that stop what would go on: triggers, video, sprayer, a place looked at.

        Servos and relays stay as they are: what hangs on them is not known.
        """
        stops: dict[int, MissionItem] = {}
        for item in self.items:
            is_on = (item.param1 or 0.0) > 0.0
            match item.command:
                case Command.DO_SET_CAM_TRIGG_DIST | 260 | 216 if is_on:
                    stops[item.command] = bare_command(item.command)
                case 214 | 2003 if is_on:
                    stops[_TRIGGER] = bare_command(_TRIGGER)
                case 2000:
                    stops[_STOP_IMAGES] = bare_command(_STOP_IMAGES)
                case 2500:
                    stops[_STOP_VIDEO] = bare_command(_STOP_VIDEO)
                case 80 | 195 | 196 | 198 | 201:
                    stops[_ROI_NONE] = bare_command(_ROI_NONE)
        return tuple(stops.values())


def carried_state(items: Iterable[MissionItem], dialect: Autopilot | None) -> CarriedState:
    """Return the state that items leave, flown one after the other."""
    found: dict[object, MissionItem] = {}
    for item in items:
        family = _family(item, dialect)
        if family is not None:
            found.pop(family, None)
            found[family] = item
    return CarriedState(items=tuple(found.values()))


def is_output(item: MissionItem) -> bool:
    """Return whether an item moves a servo, a relay or the like."""
    return item.command in {_ACTUATOR, _SPRAYER, *_OF_AN_OUTPUT}


def keeps_load(mission: Mission, route: Route) -> bool:
    """Return whether a vehicle carries all the way what it carries: nothing lets go of it, nor lands."""
    starts = route.rows_of(StageKind.TAKEOFF)
    return len(starts) <= 1 and not mission.commands & UNLOADING


def is_relative_yaw(item: MissionItem) -> bool:
    """Return whether an item turns by an angle from the heading there is then."""
    return item.command == Command.CONDITION_YAW and bool(item.param4)


def is_repeatable(item: MissionItem) -> bool:
    """Return whether an item that is no flight may be flown twice and do no harm."""
    is_setting = item.command in _FAMILIES or item.command == Command.DO_CHANGE_SPEED
    is_setting = is_setting and not is_relative_yaw(item)
    return (is_setting and not is_output(item)) or item.command in _PHOTOS


def _family(item: MissionItem, dialect: Autopilot | None) -> object | None:
    if item.command == Command.DO_CHANGE_SPEED:
        # PX4 takes every one for the speed of level flight
        return ("speed", 1.0 if dialect is Autopilot.PX4 else item.param1 or 1.0)
    if item.command == _START_IMAGES and item.param3 == _ONE_IMAGE:
        return None  # one photo, taken
    if is_relative_yaw(item) or (item.command == Command.DO_PARACHUTE and item.param1 == _RELEASED):
        return None
    if item.command in _OF_AN_OUTPUT:
        return (item.command, item.param1)
    if item.command == _ACTUATOR:
        return (item.command, item.altitude_m)  # its index
    return _FAMILIES.get(item.command)


_JUMPS = frozenset({Command.DO_JUMP, Command.DO_JUMP_TAG, Command.JUMP_TAG})


class FlownItems(Value):
    """A mission in flown order, jumps written out, each step with the stage that it makes."""

    mission: Mission
    route: Route
    dialect: Autopilot | None
    items: tuple[MissionItem, ...]
    numbers: tuple[int, ...]
    """The item of the mission each step is, from 1."""
    stages: tuple[int | None, ...]
    """Position in the route's stages; ``None``: no flight."""
    states: tuple[CarriedState, ...]
    """What is set before each step, and after the last."""
    first: int
    """The first step after the take-off."""
    flying: tuple[int, ...]
    """The steps after the take-off that fly."""
    has_jumps: bool

    @property
    def ends(self) -> bool:
        """Whether the mission ends on the ground."""
        return self.route.stages[-1].kind in LANDED_STAGES

    def stage(self, step: int, before: int = 0) -> Stage:
        """Return the stage of a step that flies, or one so many before it."""
        number = self.stages[step]
        assert number is not None
        return self.route.stages[number - before]

    def length_m(self, step: int) -> float:
        """Return the length over ground of the leg to a step. [m]"""
        here, there = self.stage(step, before=1), self.stage(step)
        return math.hypot(there.east_m - here.east_m, there.north_m - here.north_m)


def flown_items(mission: Mission, route: Route, dialect: Autopilot | None) -> FlownItems:
    """Return a mission in flown order.

    Raises SplitError if it has no end, or parts of it would not mean what they do in it.
    """
    _refuse_unsuitable(mission, route)
    at = 1 if is_takeoff_assumed(route) else 0
    items: list[MissionItem] = []
    numbers: list[int] = []
    stages: list[int | None] = []
    states = [CarriedState()]
    for number in route.reached:
        item = mission.items[number - 1]
        flies = at < len(route.stages) and route.stages[at].item == number
        while flies and route.stages[at].is_underway:
            at += 1
        if item.command not in _JUMPS:
            items.append(item)
            numbers.append(number)
            stages.append(at if flies else None)
            before = states[-1]
            states.append(before if flies else carried_state((*before.items, item), dialect))
        at += flies
    first = next(step for step, stage in enumerate(stages) if stage is not None)
    if not is_takeoff_assumed(route):
        first += 1
    return FlownItems(
        mission=mission,
        route=route,
        dialect=dialect,
        items=tuple(items),
        numbers=tuple(numbers),
        stages=tuple(stages),
        states=tuple(states),
        first=first,
        flying=tuple(step for step in range(first, len(items)) if stages[step] is not None),
        has_jumps=any(
            item.command in {Command.DO_JUMP, Command.DO_JUMP_TAG} for item in mission.items
        ),
    )


def is_takeoff_assumed(route: Route) -> bool:
    """Return whether a route begins with a take-off that no item asks for."""
    stages = route.stages
    return len(stages) > 1 and stages[0].item == stages[1].item


def _refuse_unsuitable(mission: Mission, route: Route) -> None:
    why = None
    if mission.home is None:
        why = "where home is must be known, for every part comes back to it: set the planned home"
    elif route.lap is not None:
        why = f"item {route.lap.item} is an endless loop: give the jump a count"
    elif route.moved_homes:
        why = (
            "DO_SET_HOME moves home: heights and returns of the parts would count from another "
            "place; take it out of the mission"
        )
    elif len(route.stages) < 2:
        why = "there is no leg to divide"
    else:
        for stage in route.stages:
            command = mission.items[stage.item - 1].command
            if command == Command.NAV_LOITER_UNLIM:
                why = f"item {stage.item} {command_name(command)} never ends: give it a time"
    if why is not None:
        msg = f"{mission.source}: cannot be split: {why}"
        raise SplitError(msg)


OVERLAP_M = 10.0
"""Flown twice besides the way between two photos: autopilots count a waypoint as reached up to so far
before it, PX4's NAV_ACC_RAD. [m]"""
_STEP_M = 10.0
"""Between two places of a leg at which it may be cut. [m]"""
_MOST_CUTS_A_LEG = 2000
_SPEED_UNKNOWN_M_S = 15.0
"""Of legs flown at the vehicle's own speed, for photos by time: faster than surveys are. [m s⁻¹]"""
_SAME_HEIGHT_M = 1.0
_DELAYING = frozenset({Command.CONDITION_DELAY, Command.CONDITION_DISTANCE})
_STRAIGHT_COMMANDS = frozenset({Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME})
_UNCUT_BEFORE = frozenset({StageKind.SPLINE, StageKind.TAKEOFF, StageKind.RETURN})
_UNCUT_AFTER = frozenset({StageKind.SPLINE, StageKind.CIRCLE, StageKind.TAKEOFF})


class SplitPoint(Value):
    """A point of a mission: everything before a step is done, and a fraction of the leg to it."""

    step: int
    """Position among the flown."""
    fraction: float = 0.0
    """Of the leg to that step. [-]"""


class MissionPart(Value):
    """A part of a mission, as a mission of its own."""

    mission: Mission
    first_own: int
    """The first item that flies the whole's legs, from 1; those before lead there."""
    last_own: int
    """The last of them; those after it lead home."""


def split_points(flown: FlownItems, *, inside_legs: bool) -> list[SplitPoint]:
    """Return where a mission may be cut, in flown order; straight legs every 10 m, if they may be."""
    flying = flown.flying
    cuts: list[SplitPoint] = []
    for previous, step in pairwise(flying):
        if not _may_cut(flown, previous, step):
            continue
        if resumption(flown, SplitPoint(step=step)) is not None:
            cuts.append(SplitPoint(step=step))
        if inside_legs and _is_straight(flown, step):
            length_m = flown.length_m(step)
            count = min(int(length_m / _STEP_M), _MOST_CUTS_A_LEG)
            inside = (SplitPoint(step=step, fraction=number / count) for number in range(1, count))
            cuts += [cut for cut in inside if resumption(flown, cut) is not None]
    return cuts


def _may_cut(flown: FlownItems, previous: int, step: int) -> bool:
    """Return whether the flight may be broken off between two steps that fly."""
    between = flown.items[previous + 1 : step]
    return (
        flown.stage(step).kind not in _UNCUT_BEFORE
        and flown.stage(previous).kind not in _UNCUT_AFTER
        and not any(item.command in _DELAYING or is_relative_yaw(item) for item in between)
    )


def _is_straight(flown: FlownItems, step: int) -> bool:
    """Return whether the leg to a step is a straight line that can be cut anywhere.

    A spline leaves with the whole leg before it as its tangent: a shorter one would bend it otherwise.
    """
    here, there = flown.stage(step, before=1), flown.stage(step)
    after = bisect_left(flown.flying, step) + 1
    bends = after < len(flown.flying) and flown.stage(flown.flying[after]).kind is StageKind.SPLINE
    item = flown.items[step]
    before = flown.mission.items[here.item - 1]
    is_terrain = item.frame in TERRAIN_FRAMES
    return (
        there.kind in {StageKind.GO, StageKind.LOITER}
        and here.kind not in _UNCUT_AFTER
        and not bends
        and item.command in _STRAIGHT_COMMANDS
        and is_terrain is (before.frame in TERRAIN_FRAMES)
        and not (is_terrain and not (item.altitude_m and before.altitude_m))
    )


def resumption(flown: FlownItems, cut: SplitPoint) -> SplitPoint | None:
    """Return where the flight is taken up again after a cut; ``None`` where that is impossible.

    Where a camera is triggered on the way, it is so much before the cut that no photo is missing: the
    way between two photos, and `OVERLAP_M`.
    """
    flying = flown.flying
    step, fraction = cut.step, cut.fraction
    overlap_m = _spacing_m(flown, step)
    if overlap_m == 0.0:
        return cut
    overlap_m += OVERLAP_M
    while True:
        length_m = flown.length_m(step)
        room_m = fraction * length_m
        if room_m >= overlap_m:
            return SplitPoint(step=step, fraction=fraction - overlap_m / length_m)
        at = bisect_left(flying, step)
        if at == 0:
            return None
        previous = flying[at - 1]
        if _spacing_m(flown, previous) == 0.0:
            return SplitPoint(step=step)
        repeated = flown.items[previous + 1 : step]
        if (
            at == 1
            or not _is_straight(flown, previous)
            or not _may_cut(flown, flying[at - 2], previous)
            or not all(map(is_repeatable, repeated))
            or flown.items[previous].param1  # a hold
        ):
            return None
        overlap_m -= room_m
        step, fraction = previous, 1.0


def _spacing_m(flown: FlownItems, step: int) -> float:
    """Return the way between two photos on the leg to a step; 0 where none is taken. [m]"""
    speed_m_s = flown.stage(step).speed_m_s or _SPEED_UNKNOWN_M_S
    return flown.states[step].trigger_spacing_m(speed_m_s)


def mission_part(
    flown: FlownItems, start: SplitPoint | None, end: SplitPoint | None, *, name: str
) -> MissionPart:
    """Return one part: take-off, way to where it begins, its own items, return.

    It is taken up at ``start``, as `resumption` returns it, and broken off at ``end``; ``None`` is the
    beginning and the end of the mission.
    """
    if start is None:
        begin, items = flown.first, list(flown.items[: flown.first])
        if is_takeoff_assumed(flown.route):
            items.append(_takeoff(flown, 0.0))
    else:
        begin, items = start.step, _way_out(flown, start)
    before = len(items)
    items += flown.items[begin : len(flown.items) if end is None else end.step]
    if end is not None and end.fraction > 0.0:
        items.append(_waypoint(flown, end, flown.items[end.step]))
    returns = end is None and flown.route.stages[-1].kind is StageKind.RETURN
    last_own = len(items) - int(returns)
    if end is not None:
        items += flown.states[end.step].stopping_items()
    if end is not None or not flown.ends:
        items.append(bare_command(Command.NAV_RETURN_TO_LAUNCH))
    document = flown.mission.document
    mission = replace(
        flown.mission,
        source=name,
        file_format=MissionFormat.PLAN,
        items=numbered_in_order([replace(item, jump_id=None) for item in items]),
        findings=(),
        document=document if isinstance(document, PlanDocument) else None,
    )
    return MissionPart(mission=mission, first_own=before + 1, last_own=last_own)


def _way_out(flown: FlownItems, start: SplitPoint) -> list[MissionItem]:
    """Return what leads from home to where a part is taken up, and sets there what was set.

    The way is level: at the height of the take-off or of that place, whichever is higher.  A fence or a
    parachute that is set since before the take-off is set before that of the part, too.
    """
    before = flown.items[: start.step]
    state, at_takeoff = flown.states[start.step], flown.states[flown.first].items
    kept = [one for one in state.protection() if one in at_takeoff]
    place = _waypoint(flown, start, _item_before(flown, start.step))
    rise_m = _height_m(flown, start) - flown.route.stages[0].height_m
    items = [
        item
        for item, stage in zip(before[: flown.first], flown.stages, strict=False)
        if stage is None
        and item.command not in {Command.NAV_DELAY, *_DELAYING}
        and not (is_repeatable(item) or is_output(item))
    ]
    items += kept
    items.append(_takeoff(flown, max(rise_m, 0.0)))
    items += state.speeds()
    if rise_m < -_SAME_HEIGHT_M:
        items.append(replace(place, altitude_m=(place.altitude_m or 0.0) - rise_m))
    return [*items, place, *(one for one in state.settings() if one not in kept)]


def _takeoff(flown: FlownItems, higher_m: float) -> MissionItem:
    """Return the take-off of a part, from home, so much higher than that of the mission."""
    home = flown.mission.home
    assert home is not None  # else the mission is refused
    if is_takeoff_assumed(flown.route):
        own = replace(
            bare_command(Command.NAV_TAKEOFF),
            frame=int(Frame.GLOBAL_RELATIVE_ALT),
            param4=None,
            altitude_m=flown.route.stages[0].height_m,
        )
    else:
        own = flown.items[flown.first - 1]
    return replace(
        own,
        latitude_deg=home.latitude_deg,
        longitude_deg=home.longitude_deg,
        altitude_m=None if own.altitude_m is None else own.altitude_m + higher_m,
    )


def _item_before(flown: FlownItems, step: int) -> MissionItem:
    return next(flown.items[one] for one in range(step)[::-1] if flown.stages[one] is not None)


def _height_m(flown: FlownItems, cut: SplitPoint) -> float:
    here, there = flown.stage(cut.step, before=1), flown.stage(cut.step)
    return here.height_m + cut.fraction * (there.height_m - here.height_m)


def _waypoint(flown: FlownItems, cut: SplitPoint, like: MissionItem) -> MissionItem:
    """Return a waypoint at a cut, in the altitude reference and with the heading of an item."""
    here, there = flown.stage(cut.step, before=1), flown.stage(cut.step)
    before = _item_before(flown, cut.step)
    latitude_deg, longitude_deg = flown.route.frame.latitude_longitude_deg(
        here.east_m + cut.fraction * (there.east_m - here.east_m),
        here.north_m + cut.fraction * (there.north_m - here.north_m),
    )
    place = (float(latitude_deg), float(longitude_deg))
    if cut.fraction == 0.0 and before.latitude_deg and before.longitude_deg:
        place = (before.latitude_deg, before.longitude_deg)  # as in the file, to the last digit
    frame, altitude_m = int(Frame.GLOBAL_RELATIVE_ALT), _height_m(flown, cut)
    if before.frame in AMSL_FRAMES:
        frame, altitude_m = before.frame, altitude_m + flown.route.home_amsl_m
    elif before.frame in TERRAIN_FRAMES and before.altitude_m:
        above_m = flown.items[cut.step].altitude_m if cut.fraction > 0.0 else before.altitude_m
        frame = before.frame
        altitude_m = before.altitude_m + cut.fraction * ((above_m or 0.0) - before.altitude_m)
    return replace(
        bare_command(Command.NAV_WAYPOINT),
        frame=frame,
        param4=like.param4 if like.command in _STRAIGHT_COMMANDS else None,
        latitude_deg=place[0],
        longitude_deg=place[1],
        altitude_m=altitude_m,
    )
