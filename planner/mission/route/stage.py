"""Stages: what a route asks of the vehicle, one thing after the other."""

from __future__ import annotations

import math
from enum import IntEnum, StrEnum
from functools import cached_property
from typing import TYPE_CHECKING

from planner.values import Value

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.geo.geodesy import LocalFrame
    from planner.mission.route.queue import HeldItem


class StageKind(StrEnum):
    """What a stage asks for."""

    TAKEOFF = "takeoff"
    """Climb vertically from the ground to a height, then go to the place, if it is another."""
    GO = "go"
    """Fly straight to a place; stop there only to hold, or where the autopilot always does."""
    SPLINE = "spline"
    """Fly to a place along a smooth curve through the places before and after."""
    LOITER = "loiter"
    """Fly straight to a place and stay there for a time."""
    DELAY = "delay"
    """Stay for a time where the vehicle is."""
    CIRCLE = "circle"
    """Fly to the edge of a circle about the place and follow it for a number of turns."""
    CHANGE_HEIGHT = "change-height"
    """Fly to a place at the present height, then climb or descend there; PX4 within a radius of it."""
    SET_DOWN = "set-down"
    """Fly to a place at the present height, descend until the load is down, climb back."""
    LAND = "land"
    """Fly level to a place and descend to the ground."""
    RETURN_LEG = "return-leg"
    """Begin to fly home by the vehicle's own rules, up to a place on the way; the rest is the next stage."""
    RETURN = "return"
    """Fly home by the vehicle's own rules and land there."""


LEVEL_FIRST = frozenset({StageKind.LAND, StageKind.SET_DOWN})
"""Stages that lead to their place at the present height; PX4's changes of height do so, too."""
RETURN_STAGES = frozenset({StageKind.RETURN_LEG, StageKind.RETURN})
"""Stages that lead home by the vehicle's own rules."""
LANDED_STAGES = frozenset({StageKind.LAND, StageKind.RETURN})
"""Stages that end on the ground."""


class Stage(Value, kw_only=False, gc=False):
    """One thing asked of the vehicle, in the frame of its home."""

    kind: StageKind
    item: int
    """Mission item from 1 that asks for it."""
    east_m: float
    north_m: float
    height_m: float
    """Height above home at the end of the stage; of the ground for a landing. [m]"""
    speed_m_s: float | None = None
    """Commanded horizontal speed; ``None``: the vehicle's own. [m s⁻¹]"""
    climb_speed_m_s: float | None = None
    """Commanded climb speed; ``None``: the vehicle's own. [m s⁻¹]"""
    descent_speed_m_s: float | None = None
    """Commanded descent speed, positive; ``None``: the vehicle's own. [m s⁻¹]"""
    lands_at_m_s: float | None = None
    """Descent speed commanded when its landing, or what leads to it, has begun, of a change of height that up
    or down at its place; ``None``: the vehicle's own. [m s⁻¹]"""
    may_slow_landing: bool = False
    """Whether that is commanded while it descends, and counts where it is slower than the vehicle's own."""
    hold_s: float = 0.0
    """Time to stay at the place; after a landing on the ground, after turns circling on. [s]"""
    acceptance_radius_m: float | None = None
    """Distance at which the place counts as reached; ``None``: the vehicle's own. [m]"""
    yaw_deg: float | None = None
    """Heading to take at the place, clockwise from north; ``None``: free. [°]"""
    needs_heading: bool = False
    """Whether PX4 gives the mission up where it does not take it in time."""
    looks_m: tuple[float, float] | None = None
    """East and north from the place, where the region of interest is that PX4 looks at on the way there;
    ``None``: there is none. [m]"""
    turns: float = 0.0
    """Turns of a circle. [-]"""
    radius_m: float = 0.0
    """Radius of a circle, negative for counter-clockwise; of a change of height that within which PX4
    begins it, and which it leaves by a tangent, 0 where not given. [m]"""
    leaves_on_tangent: bool = False
    """Whether PX4 leaves a change of height by the tangent of its circle that leads to the next place."""
    followed_ground_m: tuple[float, ...] = ()
    """Heights of the ground on the way, evenly spaced from its beginning to its end, where the vehicle
    follows it, of a circle that at its centre. [m AMSL]"""
    follows_ground: bool = False
    """Whether the height above the ground is kept on the way, which is known."""
    is_underway: bool = False
    """Whether the place is only one on the way to that of the next stage, which is of the same item."""
    is_speed_late: bool = False
    """Whether its horizontal speed is commanded when its first leg has begun already."""
    next_early_s: float = 0.0
    """How long before its end, for which ArduPilot brakes already, the speed of what comes next is commanded;
    0: there. [s]"""
    is_next_unseen: bool = False
    """Whether ArduPilot does not find there ahead of time where it leads on: it stops."""
    is_here: bool = False
    """Whether its item names no place: the vehicle stays where it is sent to already."""
    above_ground_m: float = 0.0
    """Height above its ground of the place a return leads to, as the autopilot has it: of a rally point,
    or of a home that DO_SET_HOME put elsewhere than on the ground; of where a load is set down from. [m]"""
    gives_up_m: float = 0.0
    """Way down after which the vehicle carries its load back up where it met no ground; 0: never. [m]"""
    datum_m: float = 0.0
    """Height above the first home of the home that counts during a return or a landing. [m]"""
    named_ground_m: float | None = None
    """Height above the first home of the ground of a landing, by the altitude of its item, where ArduPilot
    may go by that; ``None``: it does not. [m]"""
    lands_by_name: bool = False
    """Whether it is known to go by that where it names one, not by its home or the terrain."""
    return_ceiling_m: float | None = None
    """Height above that home at which the fence keeps a return; ``None``: as the parameters have it. [m]"""
    return_path: ReturnPath | None = None
    """The items a return flies along; ``None``: straight."""

    @property
    def lowered_m(self) -> float:
        """How far a load is lowered: to the ground, or until the vehicle gives up. [m]"""
        return min(self.above_ground_m, self.gives_up_m or math.inf)


class FenceAction(IntEnum):
    """First parameter of DO_FENCE_ENABLE (``AC_Fence::MavlinkFenceActions``)."""

    OFF = 0
    ON = 1
    FLOOR_OFF = 2


class ReturnPath(Value):
    """A return along items of the mission."""

    stages: tuple[Stage, ...]
    """Places flown to without holds; the last is a landing."""
    speed_m_s: float | None = None
    """Commanded before; ``None``: the vehicle's own. [m s⁻¹]"""
    other_speeds_m_s: tuple[float | None, ...] = ()
    """Those the vehicle may take instead; ``None``: its own. [m s⁻¹]"""
    climbs_over_m: float | None = None
    """Height above home over which the vehicle climbs to its return height before it sets out;
    ``None``: it does not climb. [m]"""
    height_chosen_m: tuple[float, float, float] | None = None
    """East, north, height above home of where that height is chosen; ``None``: where it begins. [m]"""


class Lap(Value):
    """The part of a route that an endless jump repeats; a route flies it once more, to its end."""

    item: int
    """The item that closes the endless loop."""
    first_stage: int
    """Where the repeated lap begins, as a position in the route's stages."""


class HomePlace(Value, kw_only=False):
    """Where a return leads from some stage of a route on."""

    first_stage: int
    """Position in the route's stages: it counts while this one is flown, and those after it."""
    east_m: float
    north_m: float
    ground_m: float
    """Height of the ground there above the home the flight started from. [m]"""
    datum_m: float
    """Its own altitude, as the item gave it, above that home: relative heights count from it. [m]"""
    item: int
    """DO_SET_HOME, from 1."""


class FenceSwitch(Value):
    """DO_FENCE_ENABLE, carried out."""

    first_stage: int
    """Position in the route's stages: it counts while this one is flown, and those after it."""
    action: FenceAction
    item: int
    is_late: bool = False
    """Whether that stage has begun by then: a return of the mission goes by the fence before."""


class ParachuteSwitch(Value):
    """DO_PARACHUTE that switches the parachute on or off, carried out."""

    first_stage: int
    """Position in the route's stages: it counts while this one is flown, and those after it."""
    is_on: bool
    item: int


class OtherRoute(Value):
    """A route that is as likely as the one predicted."""

    route: Route
    note: str
    """What makes the difference: ``if item 4 is never carried out``."""


class Route(Value, dict=True):
    """A mission laid out in space: jumps and altitudes resolved, speeds carried along."""

    stages: tuple[Stage, ...]
    frame: LocalFrame
    """Local frame at home; heights count from home as well."""
    home_amsl_m: float
    """0 where it is not known."""
    knows_home_amsl: bool = True
    ground_datum_m: float = 0.0
    """What heights of a terrain grid are above home from: its own height of home where heights count from
    home, else the lower of that and home's altitude. [m AMSL]"""
    amsl_items: tuple[int, ...] = ()
    """Items whose altitudes count from the sea, in flown order."""
    reached: tuple[int, ...] = ()
    """Items in the order they are reached, repeated where a jump leads back."""
    lap: Lap | None = None
    moved_homes: tuple[HomePlace, ...] = ()
    """The homes set by DO_SET_HOME, in flown order; the first home is where the frame begins."""
    fence_switches: tuple[FenceSwitch, ...] = ()
    """What the mission switches of the fence, in flown order."""
    parachute_switches: tuple[ParachuteSwitch, ...] = ()
    """Where the mission switches the parachute, in flown order."""
    return_height_m: float | None = None
    """Height above home that the mission's file states for returns. [m]"""
    held: tuple[HeldItem, ...] = ()
    """Items that conditions hold back, in flown order."""
    others: tuple[OtherRoute, ...] = ()
    """What may be flown as well, where speeds held back may be carried out or not."""
    findings: tuple[Finding, ...] = ()

    @cached_property
    def _rows_by_kind(self) -> dict[StageKind, list[int]]:
        rows: dict[StageKind, list[int]] = {}
        for row, stage in enumerate(self.stages):
            rows.setdefault(stage.kind, []).append(row)
        return rows

    def rows_of(self, *kinds: StageKind) -> list[int]:
        """Return the positions of the stages of some kinds, in flown order."""
        return sorted(row for kind in kinds for row in self._rows_by_kind.get(kind, ()))

    def stages_of(self, *kinds: StageKind) -> list[Stage]:
        """Return the stages of some kinds, in flown order."""
        return [self.stages[row] for row in self.rows_of(*kinds)]

    @property
    def return_spans(self) -> list[tuple[int, int]]:
        """The first and the last position of the stages of each return."""
        spans: list[tuple[int, int]] = []
        first = None
        for row in self.rows_of(*RETURN_STAGES):
            if first is None:
                first = row
            if self.stages[row].kind is StageKind.RETURN:
                spans.append((first, row))
                first = None
        return spans

    @property
    def fence_switched_on(self) -> FenceSwitch | None:
        """The first item that switches the fence on; ``None`` where none does."""
        on = (one for one in self.fence_switches if one.action is FenceAction.ON)
        return next(on, None)

    @property
    def ends_in_air(self) -> bool:
        """Whether nothing of the mission lands; an endless mission never ends."""
        ends = self.lap is None and bool(self.stages)
        return ends and self.stages[-1].kind not in LANDED_STAGES
