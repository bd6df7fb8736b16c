"""The state a mission has set by a point: camera, gimbal, place to look at, outputs, speeds.

A flight that is taken up there has to set it again, and one that is broken off there has to stop what
would go on: a trimmed mission that dropped it came home without photos (QGroundControl #5393).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.frozen import frozen
from planner.mission.commands import Command, Frame
from planner.mission.items import MissionItem

if TYPE_CHECKING:
    from collections.abc import Iterable

_RELAY, _SERVO, _ACTUATOR, _SPRAYER, _AUXILIARY = 181, 183, 187, 216, 218
_ROI_NONE = 197
_PARACHUTE, _RELEASED = 208, 2.0
_TRIGGER_INTERVAL, _TRIGGER, _OBLIQUE = 214, 2003, 260
_START_IMAGES, _STOP_IMAGES, _START_VIDEO, _STOP_VIDEO = 2000, 2001, 2500, 2501
_ONE_IMAGE = 1.0
_OF_AN_OUTPUT = frozenset({_RELAY, _SERVO, _AUXILIARY})
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
        for command in (200, 202, 204, 207, _PARACHUTE, 215, 405, 1001)
    },
    **{command: f"command {command}" for command in (530, 531, 532, 534)},
    **{command: f"output {command}" for command in (_ACTUATOR, _SPRAYER, *_OF_AN_OUTPUT)},
}
"""What each command that leaves a state behind sets; the last of a family counts."""
_PHOTOS = frozenset({203, _START_IMAGES, _STOP_IMAGES})
"""Commands that do no harm flown twice: a photo more."""


@frozen
class CarriedState:
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


def carried_state(items: Iterable[MissionItem], meaning: Autopilot | None) -> CarriedState:
    """Return the state that items leave behind, flown one after the other.

    Parameters
    ----------
    items : iterable of MissionItem
        In flown order.
    meaning : Autopilot, optional
        PX4 takes every DO_CHANGE_SPEED for the speed of level flight.
    """
    found: dict[object, MissionItem] = {}
    for item in items:
        family = _family(item, meaning)
        if family is not None:
            found.pop(family, None)
            found[family] = item
    return CarriedState(items=tuple(found.values()))


def is_output(item: MissionItem) -> bool:
    """Return whether an item moves a servo, a relay or the like."""
    return item.command in {_ACTUATOR, _SPRAYER, *_OF_AN_OUTPUT}


def is_relative_yaw(item: MissionItem) -> bool:
    """Return whether an item turns by an angle from the heading there is then."""
    return item.command == Command.CONDITION_YAW and bool(item.param4)


def is_repeatable(item: MissionItem) -> bool:
    """Return whether an item that is no flight may be flown twice and do no harm."""
    is_setting = item.command in _FAMILIES or item.command == Command.DO_CHANGE_SPEED
    is_setting = is_setting and not is_relative_yaw(item)
    return (is_setting and not is_output(item)) or item.command in _PHOTOS


def _family(item: MissionItem, meaning: Autopilot | None) -> object | None:
    if item.command == Command.DO_CHANGE_SPEED:
        kind = 1.0 if meaning is Autopilot.PX4 or not item.param1 else item.param1
        return ("speed", kind)
    if item.command == _START_IMAGES and item.param3 == _ONE_IMAGE:
        return None  # one photo, taken
    if is_relative_yaw(item) or (item.command == _PARACHUTE and item.param1 == _RELEASED):
        return None
    if item.command in _OF_AN_OUTPUT:
        return (item.command, item.param1)
    if item.command == _ACTUATOR:
        return (item.command, item.altitude_m)  # its index
    return _FAMILIES.get(item.command)


def bare_command(command: int) -> MissionItem:
    """Return a command with all its parameters 0: what switches off, or takes none."""
    return MissionItem(
        command=int(command),
        frame=int(Frame.MISSION),
        param1=0.0,
        param2=0.0,
        param3=0.0,
        param4=0.0,
        latitude_deg=0.0,
        longitude_deg=0.0,
        altitude_m=0.0,
    )
