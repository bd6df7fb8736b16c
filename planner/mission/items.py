"""A mission as the vehicle would receive it: MISSION_ITEM_INT-like items, each with its place."""

from __future__ import annotations

from enum import StrEnum
from itertools import starmap
from typing import TYPE_CHECKING, Any

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.autopilot import Autopilot
    from planner.findings import Finding, Place
    from planner.geo.fence import Fence, RallyPoint


MOST_ITEMS = 65_535
"""MISSION_COUNT is a 16-bit number: MAVLink can send no more."""


class MissionFormat(StrEnum):
    """The file formats a mission comes in."""

    PLAN = "plan"
    """QGroundControl's JSON, ``fileType`` "Plan"."""
    WPL = "wpl"
    """The text format with a ``QGC WPL`` header."""


class VehicleKind(StrEnum):
    """What kind of vehicle a mission was written for."""

    MULTICOPTER = "multicopter"
    FIXED_WING = "fixed-wing"
    VTOL = "VTOL"
    ROVER = "rover"
    BOAT = "boat"
    SUBMARINE = "submarine"
    OTHER = "other"


class VehicleEvidence(Value):
    """A kind of vehicle and what tells it."""

    kind: VehicleKind
    is_certain: bool
    """``False`` where a multicopter's mission may look the same."""
    reason: str
    """What tells it, fit to stand behind "because": ``item 1 is NAV_VTOL_TAKEOFF``."""


class MissionItem(Value, kw_only=False):
    """One item, with the meaning MAVLink gives its seven parameters.

    ``None`` stands where the file says ``null`` or ``nan``: not specified.
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


def make_items(rows: Sequence[tuple[Any, ...]]) -> list[MissionItem]:
    """Return items from their values, each in the order of the fields of `MissionItem`."""
    return list(starmap(MissionItem, rows))


class Home(Value):
    """The planned home; the vehicle's own home at arming is what really counts."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float | None
    """``None`` where the file does not know it. [m AMSL]"""


class Mission(Value):
    """A mission read from a file, in flown order, home not counted."""

    source: str
    """File name as the user gave it."""
    file_format: MissionFormat
    items: tuple[MissionItem, ...]
    """Item ``n`` of every report is ``items[n - 1]``."""
    home: Home | None
    autopilot: Autopilot | None
    """Firmware the file was written for; ``None`` where it does not say."""
    vehicle: VehicleEvidence | None
    """What it was written for; ``None`` where the file does not say and the commands do not tell."""
    fence: Fence | None = None
    rally: tuple[RallyPoint, ...] = ()
    findings: tuple[Finding, ...] = ()
    """What reading it brought to light."""
    document: Any = None
    """The file's own content, kept so that writing it back loses nothing."""

    @property
    def vehicle_kind(self) -> VehicleKind | None:
        """The kind of vehicle it was certainly written for; ``None`` where nothing proves one."""
        return self.vehicle.kind if self.vehicle is not None and self.vehicle.is_certain else None
