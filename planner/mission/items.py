"""A mission as the vehicle would receive it: MISSION_ITEM_INT-like items, each with its place."""

from __future__ import annotations

from enum import StrEnum
from functools import cached_property
from itertools import starmap
from typing import TYPE_CHECKING, Any

import msgspec

from planner.mission.commands import Command, Frame
from planner.values import Value, brief, field, replace

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence, Set

    from planner.autopilot import Autopilot
    from planner.fetched import FetchMark
    from planner.findings import Finding, Place, Remarks, Rule, Severity
    from planner.geo.fence import Fence, RallyPoint


MOST_ITEMS = 65_535
"""MISSION_COUNT is a 16-bit number: MAVLink can send no more."""


class MissionFormat(StrEnum):
    """The file formats a mission comes in."""

    PLAN = "plan"
    """QGroundControl's JSON, ``fileType`` "Plan"."""
    WPL = "wpl"
    """The text format with a ``QGC WPL`` header."""
    FOREIGN = "foreign"
    """A drawing or another maker's mission, which is only read."""


class VehicleKind(StrEnum):
    """What kind of vehicle a mission was written for."""

    MULTICOPTER = "multicopter"
    HELICOPTER = "helicopter"
    FIXED_WING = "fixed-wing"
    VTOL = "VTOL"
    ROVER = "rover"
    BOAT = "boat"
    SUBMARINE = "submarine"
    OTHER = "other"


class VehicleEvidence(Value):
    """A kind of vehicle and the evidence for it."""

    kind: VehicleKind
    is_certain: bool
    """``False`` where a multicopter's mission may look the same."""
    reason: str
    """What proves it, as after "because": ``item 1 is NAV_VTOL_TAKEOFF``."""
    is_weak: bool = False
    """Whether ground stations write the same for multicopters: a take-off pitch alone."""


class MissionItem(Value, kw_only=False, gc=False):
    """One item, with the meaning MAVLink gives its seven parameters.

    ``None`` means not specified: ``null`` or ``nan`` in the file.
    """

    command: int
    """MAV_CMD number."""
    frame: int
    """MAV_FRAME number."""
    param1: float | None
    param2: float | None
    param3: float | None
    param4: float | None
    latitude_deg: float | None
    """Fifth parameter; a latitude wherever the command has a position. [°]"""
    longitude_deg: float | None
    """Sixth parameter. [°]"""
    altitude_m: float | None
    """Seventh parameter, in the altitude reference of ``frame``. [m]"""
    autocontinue: bool = True
    jump_id: int | None = None
    """The id that DO_JUMP refers to: ``doJumpId`` of a plan, the row number of a WPL file."""
    place: Place | None = None
    unresolved_agl_m: float | None = None
    """The height above ground of an item without an altitude: QGroundControl computes that one
    from its terrain, and has not done so yet. [m]"""

    @property
    def names_place(self) -> bool:
        """Whether it names a place: 0°, 0° is none."""
        return bool(self.latitude_deg or self.longitude_deg)

    @property
    def sets_home_here(self) -> bool:
        """Whether a DO_SET_HOME takes the place where the vehicle is: if asked to, and for want of one."""
        return self.param1 == 1.0 or not self.names_place

    @property
    def parameters(self) -> tuple[float | None, ...]:
        """All seven."""
        places = (self.latitude_deg, self.longitude_deg, self.altitude_m)
        return (self.param1, self.param2, self.param3, self.param4, *places)


def bare_command(command: int) -> MissionItem:
    """Return a command with all its parameters 0: what switches off, or takes none."""
    return MissionItem(int(command), int(Frame.MISSION), *(0.0,) * 7)


def make_items(rows: Sequence[tuple[Any, ...]]) -> list[MissionItem]:
    """Return items from their values, each in the order of the fields of `MissionItem`."""
    return list(starmap(MissionItem, rows))


_NOWHERE = 0.0
"""No item has this number: a jump there stays one that leads nowhere."""


def numbered_in_order(items: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """Return items whose jump ids are 1, 2, 3 and so on, DO_JUMP targets renamed with them.

    That is the number ground stations give an item in a plan, and a row after the home row in a
    text file.  A jump whose target is missing keeps it, unless an item would now answer to it.
    """
    pairs = list(enumerate(items, start=1))
    number_of = {item.jump_id: number for number, item in reversed(pairs)}  # the first one counts
    number_of.pop(None, None)
    return tuple(
        replace(item, jump_id=number, param1=_target(item.param1, number_of, last=len(items)))
        if item.command == Command.DO_JUMP
        else replace(item, jump_id=number)
        for number, item in pairs
    )


def _target(named: float | None, number_of: Mapping[int | None, int], *, last: int) -> float | None:
    """Return the new number of what a jump names."""
    if named is None:
        return None
    number = number_of.get(int(named))
    if number is not None:
        return float(number)
    return _NOWHERE if 1 <= int(named) <= last else named


class ItemSequence(msgspec.Struct, kw_only=True, eq=False):
    """The items of one complex item, numbered on; all of them at its place in the file."""

    first_number: int
    """Number of the first item in flown order, which is its jump id too, as ground stations do."""
    place: Place
    remarks: Remarks
    items: list[MissionItem] = field(default_factory=list)

    def remark(self, rule: Rule, message: str, *, severity: Severity | None = None) -> None:
        """Report something about the complex item."""
        item, place = self.first_number, self.place
        self.remarks.add(rule, message, item=item, place=place, severity=severity)

    def add(
        self,
        command: int,
        *parameters: float | None,
        frame: int = Frame.MISSION,
        position: tuple[float, float, float | None] | None = None,
    ) -> None:
        """Add an item from its parameters; those not given are 0.

        A position is latitude [°], longitude [°] and altitude [m] of the frame.
        """
        values = [*parameters, *(0.0,) * (7 - len(parameters))]
        if position is not None:
            values[4:] = position
        p1, p2, p3, p4, p5, p6, p7 = values
        self.items.append(
            MissionItem(
                int(command),
                frame,
                *(p1, p2, p3, p4, p5, p6, p7),
                jump_id=self.first_number + len(self.items),
                place=self.place,
            )
        )

    def add_waypoint(
        self, position: tuple[float, float, float | None], *, frame: int, hold_s: float = 0.0
    ) -> None:
        """Add a waypoint with free yaw."""
        self.add(Command.NAV_WAYPOINT, hold_s, 0.0, 0.0, None, frame=frame, position=position)


class Home(Value, kw_only=False):
    """The planned home; the vehicle's own home at arming is what really counts."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float | None
    """``None`` where the file does not know it. [m AMSL]"""


class Mission(Value, dict=True):
    """A mission read from a file, in flown order, home not counted."""

    __repr__ = brief

    source: str
    """File name as the user gave it."""
    file_format: MissionFormat
    items: tuple[MissionItem, ...]
    """Item ``n`` of every report is ``items[n - 1]``."""
    home: Home | None = None
    autopilot: Autopilot | None = None
    """Firmware the file was written for; ``None`` where it does not say."""
    vehicle: VehicleEvidence | None = None
    """What it was written for; ``None`` where neither the file nor its commands decide."""
    fence: Fence | None = None
    rally: tuple[RallyPoint, ...] = ()
    unstated_wait_s: float = 0.0
    """What another maker's drone may wait at its points, at most, beyond what the items hold; infinite where
    nothing says how long. [s]"""
    return_height_m: float | None = None
    """Above home, to which another maker's drone climbs before it returns; ``None``: not known. [m]"""
    fetched: FetchMark | None = None
    """Where ``mavjoule fetch`` wrote the file."""
    findings: tuple[Finding, ...] = ()
    """What reading it brought to light."""
    document: Any = None
    """The file's own content, kept so that writing it back loses nothing."""

    @cached_property
    def _numbers_by_command(self) -> dict[int, list[int]]:
        numbers: dict[int, list[int]] = {}
        for number, item in enumerate(self.items, start=1):
            numbers.setdefault(item.command, []).append(number)
        return numbers

    @property
    def commands(self) -> Set[int]:
        """What the items command."""
        return self._numbers_by_command.keys()

    def numbered(self, *commands: int) -> list[tuple[int, MissionItem]]:
        """Return the items of some commands with their numbers, from 1."""
        known = self._numbers_by_command
        numbers = sorted(number for command in commands for number in known.get(command, ()))
        return [(number, self.items[number - 1]) for number in numbers]

    @property
    def vehicle_kind(self) -> VehicleKind | None:
        """The kind of vehicle it was certainly written for; ``None`` where nothing proves one."""
        return self.vehicle.kind if self.vehicle is not None and self.vehicle.is_certain else None
