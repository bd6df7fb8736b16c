"""A mission followed item by item, with what ArduPilot's queue of DO_ items makes of its legs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.mission.commands import TAKEOFFS, Command, command_name, is_navigation
from planner.mission.route import circles
from planner.mission.route.commanded import DESCENT, end_item
from planner.mission.route.landings import lands_at_m_s, named_ground_m, returning
from planner.mission.route.queue import (
    CONDITIONS,
    HELD,
    HELD_BACK,
    JUMPS,
    Firing,
    HeldItem,
    condition_of,
    is_queued,
    soonest,
)
from planner.mission.route.stage import (
    LANDED_STAGES,
    LEVEL_FIRST,
    RETURN_STAGES,
    FenceAction,
    Stage,
    StageKind,
)
from planner.mission.route.state import WAITS_FOR_EVER, MissionState
from planner.mission.route.walk import carry_out, remark_swing, remark_tangent, stop_before
from planner.mission.takers import NAME_IT
from planner.values import Value, field, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.mission.items import MissionItem

_DIVIDED = (
    frozenset({StageKind.GO, StageKind.LOITER, StageKind.CHANGE_HEIGHT})
    | LEVEL_FIRST
    | RETURN_STAGES
)
"""Straight legs."""
_UNITS_PER_DEGREE = 1e7
"""In which ArduPilot keeps latitudes and longitudes."""
_UNITS_PER_METRE = 100.0
"""In which it keeps heights."""
WAYPOINTS = frozenset({StageKind.GO, StageKind.SPLINE, StageKind.LOITER})
"""What ArduPilot flies to with its waypoint controller, which sets out from where the last one led."""

_OVER_AT_ONCE = frozenset({StageKind.TAKEOFF, StageKind.CHANGE_HEIGHT})
"""What is over as soon as the vehicle is there, too."""
_TURNS_S: Mapping[Autopilot, float] = {
    Autopilot.ARDUPILOT: 0.0025,
    Autopilot.PX4: 0.05,
    Autopilot.STEP: 0.05,
}
"""How long a turn of the loop takes in which the mission goes on: 400 Hz (SCHED_LOOP_RATE), and 20 Hz, at
which the navigator looks at the position (``orb_set_interval`` in ``Navigator::run``). [s]"""


def _part_of(ground_m: tuple[float, ...], begin: float, end: float) -> tuple[float, ...]:
    """Return the ground along a part of a leg, evenly spaced. [m AMSL]"""
    if not ground_m or (begin, end) == (0.0, 1.0):
        return ground_m
    every = np.linspace(0.0, 1.0, len(ground_m))
    return tuple(np.interp(np.linspace(begin, end, len(every)), every, ground_m).tolist())


def _off_line_m(ground_m: tuple[float, ...], fraction: float) -> float:
    """Return how far the ground on a leg is above the line between its ends. [m]"""
    if not ground_m:
        return 0.0
    own_m = float(np.interp(fraction, np.linspace(0.0, 1.0, len(ground_m)), ground_m))
    return own_m - (ground_m[0] + fraction * (ground_m[-1] - ground_m[0]))


def _acts_at_the_end(stage: Stage, one: HeldItem, item: MissionItem) -> bool:
    """Return whether an item that is carried out on the way counts from the end of its stage.

    A stage that is no straight leg is not divided: a fence is on for all of it.
    """
    if stage.kind in _DIVIDED:
        return False
    if one.command is Command.DO_FENCE_ENABLE:
        return int(item.param1 or 0.0) != FenceAction.ON
    return True


class _Commanded(Value):
    """What the items that ArduPilot has carried out so far command."""

    speeds_m_s: tuple[float | None, float | None, float | None]
    """Level, of climbing, of descending."""
    asked_m_s: tuple[float | None, float | None]
    """Of climbing, of descending, as commanded last."""
    fence_switches: int
    parachute_switches: int


class FollowedMission(MissionState, kw_only=True, eq=False):
    """A mission half followed, and the items of it that wait in the queue."""

    firings: Mapping[int, Firing] = field(default_factory=dict)
    """Where items held back are carried out, by their position among the reached; one that is not among
    them is dropped."""
    visit: int = -1
    """Position of the item being followed among the reached."""
    before: int = 0
    """The item that was followed last, but jumps."""
    first_commanded: _Commanded | None = None
    """What was commanded with the first of the queue; ``None``: there is no second."""
    held: list[HeldItem] = field(default_factory=list)

    def follow(self, number: int, item: MissionItem, *, is_last: bool = False) -> None:
        """Fly one item; raise the error about one that holds a number no vehicle can fly."""
        self.number, self.place = number, item.place
        comes_again = self._comes_again(item)
        self.visit += 1
        circles.remark_unknown_side(self, item)
        remark_tangent(self, item)
        remark_swing(self, item)
        stop_before(self, item)
        if self.queued == 1 and is_queued(item.command):
            self.first_commanded = self._commanded()
        if not self._is_held_back(item):
            begun, before = len(self.stages), (self.latitude_deg, self.longitude_deg, self.height_m)
            carry_out(self, item)
            if self._is_over_at_once(item, begun, before):
                self._drop_queue(item, begun)
            if len(self.stages) > begun:
                self._wait_a_turn(comes_again=comes_again)
                self.conditions.clear()
                if is_navigation(item.command):
                    if self.waiting:
                        self._fly_with_queue(item, begun, before)
                    end_item(self)
        if is_navigation(item.command):
            self.queued, self.first_commanded = 0, None
            self.is_speed_late = self.is_climb_late = self.is_descent_late = False
        elif is_queued(item.command):
            self.queued += 1
        # After a landing at the end, and a return, there is nothing to continue to.
        ends = self.is_over and (is_last or item.command == Command.NAV_RETURN_TO_LAUNCH)
        if not (item.autocontinue or ends or self.flies_as_ardupilot):
            other = "" if self.dialect is Autopilot.PX4 else ", ArduPilot continues"
            message = self.unless_named(
                f"autoContinue is off: PX4 holds here{other}; predicted without the wait"
            )
            severity = None if Autopilot.PX4 in self.may_fly else Severity.WARNING
            self.remark(WAITS_FOR_EVER, message, severity=severity)

    def _comes_again(self, item: MissionItem) -> bool:
        """Return whether a jump leads back to the item right before it, with nothing between."""
        before = self.before
        if item.command not in JUMPS:
            self.before = self.number
        return before == self.number

    def _wait_a_turn(self, *, comes_again: bool) -> None:
        """Count the turns of its loop in which an autopilot finds that it is there, and that a hold is over.

        Flown, 400 rounds of such a jump take PX4 19.0 s, and 42.7 with a hold of 0.01 s, 100 with one of 1 s
        take it 105.4 s; 5,000 rounds take it 271 s and ArduPilot 12.4 s.
        """
        if not comes_again:
            return
        turn_s = max(_TURNS_S[by] for by in self.may_fly or _TURNS_S)
        last = self.stages[-1]
        if last.kind in WAYPOINTS:
            turns = 1 + math.ceil(last.hold_s / turn_s)
            self.stages[-1] = replace(last, hold_s=turns * turn_s)
        elif last.kind in _OVER_AT_ONCE and StageKind.DELAY in [
            one.kind for one in self.stages[-2:-1]
        ]:
            # There already: all rounds are one wait, as the vehicle may still be coming to rest.
            self.stages.pop()
            self.places_deg.pop()
            waits = self.stages[-1]
            self.stages[-1] = replace(waits, hold_s=waits.hold_s + turn_s)
        elif last.kind in _OVER_AT_ONCE:
            self.add(self.stage(StageKind.DELAY, hold_s=turn_s))

    def _is_held_back(self, item: MissionItem) -> bool:
        """Return whether an item is a condition or waits for one; PX4 flies no mission with them.

        A home that is not the first of the queue waits until its leg has begun.
        """
        is_condition = item.command in CONDITIONS
        is_late_home = item.command == Command.DO_SET_HOME and self.queued > 0
        waits = is_condition or is_late_home or self.conditions
        if not waits or self.dialect is Autopilot.PX4:
            return False
        if is_condition:
            self.conditions.append(condition_of(item, self.habits.turn_deg_s))
            return True
        if item.command not in HELD:
            return False
        conditions = tuple(self.conditions)
        if item.command == Command.DO_FENCE_ENABLE and item.param1:
            conditions = soonest(conditions)
        one = HeldItem(
            visit=self.visit,
            item=self.number,
            command=Command(item.command),
            conditions=conditions,
            first_stage=0,
            last_stage=0,
        )
        self.waiting.append((one, item))
        return True

    def _is_over_at_once(
        self, item: MissionItem, begun: int, before: tuple[float, float, float]
    ) -> bool:
        """Return whether a navigation item is over in the loop after it begins, where PX4 does not fly.

        Notes
        -----
        ``AC_WPNav::set_wp_destination`` sets out from the destination before: to the same one the leg has no
        length.  Any other, 1 cm long, takes several loops (``SCurve``).  ``ModeAuto::takeoff_start`` takes no
        height below the present one.
        """
        if self.first_commanded is None or self.dialect is Autopilot.PX4:
            return False
        if item.command == Command.NAV_GUIDED_ENABLE:
            return self.in_air and not (item.param1 or 0.0) > 0.0
        if len(self.stages) == begun or begun == 0:
            return False
        stage = self.stages[-1]
        if item.command in TAKEOFFS:
            is_up = any(one.kind is not StageKind.DELAY for one in self.stages[:begun])
            has_landed = self.stages[begun - 1].kind in LANDED_STAGES
            return is_up and not has_landed and self.height_m <= before[2]
        flown = (one.kind for one in reversed(self.stages[:begun]))
        since = next((kind for kind in flown if kind is not StageKind.DELAY), None)
        after = (self.latitude_deg, self.longitude_deg, self.height_m)
        units = (_UNITS_PER_DEGREE, _UNITS_PER_DEGREE, _UNITS_PER_METRE)
        return (
            {stage.kind, since} <= WAYPOINTS
            and stage.hold_s == 0.0
            and all(
                round(a * unit) == round(b * unit)
                for a, b, unit in zip(before, after, units, strict=True)
            )
        )

    def _commanded(self) -> _Commanded:
        return _Commanded(
            speeds_m_s=(self.speed_m_s, self.climb_speed_m_s, self.descent_speed_m_s),
            asked_m_s=(self.asked_climb_m_s, self.asked_descent_m_s),
            fence_switches=len(self.fence_switches),
            parachute_switches=len(self.parachute_switches),
        )

    def _drop_queue(self, item: MissionItem, begun: int) -> None:
        """Take back all of the queue but its first item (``AP_Mission::advance_current_nav_cmd``)."""
        first = self.first_commanded
        if first is None:
            return
        if self.waiting or self._commanded() != first:
            is_known = self.flies_as_ardupilot
            self.remark(
                HELD_BACK,
                f"{command_name(item.command)} is over as it begins: ArduPilot drops the DO_ items before it "
                "but the first" + ("" if is_known else f"; {NAME_IT}"),
                severity=Severity.WARNING if is_known else Severity.ERROR,
            )
        self.speed_m_s, self.climb_speed_m_s, self.descent_speed_m_s = first.speeds_m_s
        self.asked_climb_m_s, self.asked_descent_m_s = first.asked_m_s
        del self.fence_switches[first.fence_switches :]
        del self.parachute_switches[first.parachute_switches :]
        self.waiting.clear()
        self.conditions.clear()
        self.is_speed_late = self.is_climb_late = self.is_descent_late = False
        self.stages[begun:] = (
            replace(
                stage,
                speed_m_s=self.speed_m_s,
                climb_speed_m_s=self.climb_speed_m_s,
                descent_speed_m_s=self.descent_speed_m_s,
                is_speed_late=False,
            )
            for stage in self.stages[begun:]
        )

    def _fly_with_queue(
        self, flown: MissionItem, begun: int, before: tuple[float, float, float]
    ) -> None:
        """Divide the stage just added where items held back are carried out on the way.

        Parameters
        ----------
        flown : MissionItem
            What it is of.
        begun : int
            Its position in the stages.
        before : tuple of float
            Latitude, longitude [°] and height [m] where it begins.
        """
        waiting, self.waiting = self.waiting, []
        own = (self.number, self.place)
        stage, place_deg = self.stages.pop(), self.places_deg.pop()
        after, ended_deg = (*place_deg, self.height_m), (self.latitude_deg, self.longitude_deg)
        last: list[tuple[HeldItem, MissionItem]] = []
        begin = early_s = 0.0
        for one, item in waiting:
            firing = self.firings.get(one.visit) if one.conditions else Firing(0.0)
            if firing is None:
                continue
            fraction = firing.fraction
            if fraction >= 1.0 or (fraction > 0.0 and _acts_at_the_end(stage, one, item)):
                last.append((one, item))
                if one.command is Command.DO_CHANGE_SPEED:
                    early_s = firing.early_s
                continue
            self.latitude_deg, self.longitude_deg, self.height_m = before
            if fraction > 0.0 and stage.kind in _DIVIDED:
                here = (a + fraction * (b - a) for a, b in zip(before, after, strict=True))
                self.latitude_deg, self.longitude_deg, self.height_m = here
                if stage.kind in LEVEL_FIRST | RETURN_STAGES:
                    self.height_m = before[2]
                self.height_m += _off_line_m(stage.followed_ground_m, fraction)
                if fraction > begin:  # two of one condition divide it once
                    self._add_part(stage, begin, fraction)
                begin = fraction
            switched = len(self.fence_switches)
            self._carry_out_held(one, item)
            self.fence_switches[switched:] = (
                replace(switch, is_late=True) for switch in self.fence_switches[switched:]
            )
        self.latitude_deg, self.longitude_deg, self.height_m = after
        parts = len(self.stages) - begun
        self.number, self.place = own
        now = returning(self) if stage.kind is StageKind.RETURN else self.stage(stage.kind)
        lands = stage.kind is StageKind.LAND
        self.add(
            replace(
                stage,
                speed_m_s=now.speed_m_s,
                is_speed_late=self.is_speed_late and not parts,
                next_early_s=early_s,
                climb_speed_m_s=now.climb_speed_m_s,
                descent_speed_m_s=now.descent_speed_m_s,
                lands_at_m_s=lands_at_m_s(self, stage.kind, is_here=stage.is_here),
                datum_m=self.datum_m if lands else stage.datum_m,
                named_ground_m=named_ground_m(self, flown) if lands else None,
                followed_ground_m=_part_of(stage.followed_ground_m, begin, 1.0),
            )
        )
        if stage.kind in LANDED_STAGES:
            self._slow_landing(item for _, item in last)
        self.latitude_deg, self.longitude_deg = ended_deg
        for one, item in last:
            self._carry_out_held(one, item)
        self.number, self.place = own
        self.held += (
            replace(one, first_stage=begun, last_stage=begun + parts)
            for one, _ in waiting
            if one.conditions
        )

    def _slow_landing(self, items: Iterable[MissionItem]) -> None:
        """Land all the way at the slowest speed commanded once the vehicle is over its place.

        ``Mode::land_run_vertical_control`` asks for the greatest speed down in every step.
        """
        speeds_m_s = [
            item.param2
            for item in items
            if item.command == Command.DO_CHANGE_SPEED and item.param1 == DESCENT and item.param2
        ]
        if not speeds_m_s:
            return
        own = self.stages[-1]
        if own.lands_at_m_s is None:
            own = replace(own, lands_at_m_s=min(speeds_m_s), may_slow_landing=True)
        else:
            own = replace(own, lands_at_m_s=min(own.lands_at_m_s, *speeds_m_s))
        self.stages[-1] = own

    def _carry_out_held(self, one: HeldItem, item: MissionItem) -> None:
        self.number, self.place = one.item, item.place
        level, climb, descent = self.speed_m_s, self.climb_speed_m_s, self.descent_speed_m_s
        carry_out(self, item)
        # Of what no autopilot is known of, ArduPilot alone has conditions: it commands returns too.
        self.is_speed_late |= self.speed_m_s != level
        self.is_climb_late |= self.climb_speed_m_s != climb
        self.is_descent_late |= self.descent_speed_m_s != descent

    def _add_part(self, whole: Stage, begin: float, end: float) -> None:
        """Add a part of a leg, flown through at the speeds commanded until then."""
        is_return = whole.kind is StageKind.RETURN
        part = replace(
            returning(self) if is_return else self.stage(StageKind.GO),
            kind=StageKind.RETURN_LEG if is_return else StageKind.GO,
            item=whole.item,
            is_underway=True,
            followed_ground_m=_part_of(whole.followed_ground_m, begin, end),
            follows_ground=whole.follows_ground,
        )
        self.add(part)
