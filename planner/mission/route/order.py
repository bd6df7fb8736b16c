"""In which order the items of a mission are reached: jumps followed, DO_ items where they are carried out.

DO_JUMP names its target by id (``doJumpId`` of a plan, the row's number in a text file),
DO_JUMP_TAG by the tag of a JUMP_TAG item.  PX4 counts how often each jump was taken for the whole
mission: an outer loop does not start an inner one again (``do_jump_current_count``).  So did ArduPilot;
since April 2025 (#29763, Copter 4.7) the count starts again when a loop is over, unless bit 3 of
MIS_OPTIONS is set.  Where it is not known which, the newer, which is the longer flight, is predicted.

ArduPilot searches twice: for the next place, and beside it, from the last DO_ item on, for the next of
those (``AP_Mission::advance_current_nav_cmd``, ``advance_current_do_cmd``).  Where jumps stand between them
the two may go different ways.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.mission.commands import Command, command_name, is_navigation
from planner.mission.route.queue import HELD, JUMPS
from planner.mission.takers import NAME_IT
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Mapping, Sequence

    from planner.findings import Finding
    from planner.mission.items import MissionItem

MOST_VISITS = 20_000
"""A mission whose jumps lead past so many items again is cut here, with a finding."""
_MOST_FOUND = 255
"""Items in which ArduPilot looks for the next place before it ends the mission."""
_MOST_JUMPS = 64
"""That one search of ArduPilot follows."""
_LOOKED_FOR = 2
"""Places that PX4 looks ahead for (``Mission::setActiveMissionItems``)."""
_PX4_PLACES = frozenset(
    {
        Command.NAV_WAYPOINT,
        Command.NAV_LOITER_UNLIM,
        Command.NAV_LOITER_TIME,
        Command.NAV_LOITER_TO_ALT,
        Command.NAV_TAKEOFF,
        Command.NAV_LAND,
        Command.NAV_VTOL_TAKEOFF,
        Command.NAV_VTOL_LAND,
        Command.NAV_LOITER_TURNS,
        Command.NAV_SPLINE_WAYPOINT,
    }
)
"""What it takes for one (``MissionBlock::item_contains_position``); missions with the last two it refuses."""
_FOREVER = -1
_FOREVER_IN_16_BITS = 65_535  # PX4 keeps -1 as this, ArduPilot keeps this as -1
_ENDLESS = frozenset({_FOREVER, _FOREVER_IN_16_BITS})

CARRIED_OUT_EARLY = Rule(
    "T123 carried-out-early",
    Severity.WARNING,
    summary="ArduPilot carries out an item near a jump elsewhere than in flown order, or not at all.",
    why="ArduPilot carries out DO_ items beside the flight, and looks for the next one from the last on: "
    "where a jump is taken for the last time and a DO_ item stands before it, that look goes past the jump, "
    "and what stands behind it acts on the whole last lap (ArduPilot #30376).  From 4.7 on the jump counts "
    "anew behind the loop (#29763): that look then leads to the head of the loop.",
    how="DO_CHANGE_SPEED, DO_SET_HOME or DO_FENCE_ENABLE that AP_Mission finds on its look for DO_ items and "
    "not on the way to the next place, or the other way round: predicted as ArduPilot does it.  An error "
    "where that differs between versions and neither --target nor the parameter file names one; where "
    "no autopilot is named and both may fly; and "
    "where a loop without a place in it has items carried out in turn for as long as the next leg lasts, "
    "each undoing the other.",
    fix="put the DO_ items before the jump in front of the last place of the loop, or a place between the "
    "jump and those behind it",
    instead="--target, or DO_ items where no jump leads past them",
)
_ELSEWHERE = "is carried out on the way to item {place} already, where flown order does not lead"
_PASSED_OVER = "is not carried out on the way to item {place}, though flown order leads past it"
_OF_ONE_VERSION = (
    "; ArduCopter before 4.7 does otherwise than from 4.7 on: give the version with --target"
)
_IN_TURN = (
    "is carried out again and again on the way to item {place}, in turn with others of the loop, which has "
    "no place in it: not predicted"
)


class FlownOrder(Value):
    """The items of a mission in the order they are reached."""

    visits: tuple[int, ...]
    """Item numbers from 1, repeated where a jump leads back."""
    lap_start: int | None = None
    """Where the last lap of an endless loop begins, as a position in ``visits``; it is flown once
    more after the loop closed, to its end.  ``None`` where the mission ends."""
    lap_item: int | None = None
    """The item that closes the endless loop."""
    foreseen: Mapping[int, tuple[int, int | None]] = {}
    """Where ArduPilot plans another place ahead than the one that comes: the jump behind the place flown to,
    and the item planned, if any; by the position in ``visits`` of the first item behind that place."""
    findings: tuple[Finding, ...] = ()


JUMPS_TOO_LONG = Rule(
    "T106 jumps-too-long",
    Severity.ERROR,
    summary="The jumps of the mission lead past too many items to predict.",
    why="A count mistaken by a digit makes a mission of days, which is reported, not computed.",
    how="Items are followed in flown order, up to 20,000 more than there are in the file.",
    fix="give the jumps smaller counts",
    instead="jumps with smaller counts",
)


JUMP_WITHOUT_FLIGHT = Rule(
    "M121 jump-without-flight",
    Severity.ERROR,
    summary="A loop has no item to fly.",
    why="The autopilot follows such a loop and never finds what to fly next (ArduPilot #4701).  PX4 does not "
    "count the jumps on that look ahead (MissionBase::getNextPositionItems): flown, it does not take off, or "
    "flies past its waypoint and takes no command.",
    how="No item between the target of an endless jump and the jump is a flight or a wait; on PX4 the look "
    "from each item for the next two places, along jumps that have turns left, comes to one jump twice with "
    "no place (a CONDITION_GATE is none) between.",
    fix="add a waypoint to the loop, or write out what it repeats",
    instead="a loop with an item to fly",
)


def flown_order(
    items: tuple[MissionItem, ...],
    dialect: Autopilot | None,
    *,
    keeps_counts: bool | None = None,
    able: frozenset[Autopilot] = frozenset(),
) -> FlownOrder:
    """Return in which order items are reached, from the first to the end or once round an endless loop.

    PX4 has no jump tags.  ArduPilot counts a jump anew once it was counted to its end, unless it
    ``keeps_counts``; ``None``: it is not known whether it does.  Where the autopilot is unknown ArduPilot's
    order counts.  What the one does whose order counts is an error where the other one is ``able`` to fly the
    mission too, and so is what that does.
    """
    if not any(item.command in JUMPS for item in items):
        return FlownOrder(visits=tuple(range(1, len(items) + 1)))
    targets, findings = _targets(items, dialect)
    orders: dict[Autopilot, Callable[[], FlownOrder]] = {
        Autopilot.ARDUPILOT: lambda: _searched(items, targets, dialect, keeps_counts=keeps_counts),
        Autopilot.PX4: lambda: _in_turn(items, targets),
    }
    by = dialect or Autopilot.ARDUPILOT
    order = orders.pop(by)()
    for other, order_of in orders.items():
        if other in able:
            told = [_of_one_autopilot(one, by, other) for one in order.findings]
            told += [_of_one_autopilot(one, other, by) for one in order_of().findings]
            order = replace(order, findings=tuple(told))
    findings += order.findings
    most = len(items) + MOST_VISITS
    if len(order.visits) > most:
        message = (
            f"the jumps lead past more than {MOST_VISITS:,} items: "
            "the prediction ends there, the mission continues"
        )
        findings.append(JUMPS_TOO_LONG.finding(message))
    return replace(order, visits=order.visits[:most], findings=tuple(findings))


def _searched(
    items: tuple[MissionItem, ...],
    targets: Mapping[int, int],
    dialect: Autopilot | None,
    *,
    keeps_counts: bool | None,
) -> FlownOrder:
    """Return the order of ArduPilot, which looks for the next place and for DO_ items."""
    # PX4 takes a count of 40,000 as it is, ArduPilot as none: of unknown ones the longer.
    repeats_of = _repeats if dialect is None else _kept_repeats
    repeats = {at: repeats_of(items[at]) for at in targets}
    order = _Searches(items, targets, repeats, counts_anew=keeps_counts is not True).order()
    if keeps_counts is not None:
        return order
    kept = _Searches(items, targets, repeats, counts_anew=False).order()
    return replace(order, findings=_of_both(order.findings, kept.findings))


def _in_turn(items: tuple[MissionItem, ...], targets: Mapping[int, int]) -> FlownOrder:
    """Return the order of PX4, which goes from item to item."""
    visits: list[int] = []
    taken: dict[int, int] = {}
    closed: tuple[int, int] | None = None
    findings: dict[int, Finding] = {}

    def leads_on(at: int) -> bool:
        repeats = _repeats(items[at])
        return repeats in _ENDLESS or taken.get(at, 0) < repeats

    at = 0
    while at < len(items) and len(visits) <= len(items) + MOST_VISITS:
        visits.append(at + 1)
        target = targets.get(at)
        if target is None:
            at += 1
            stuck = _looks_round(items, targets, at, leads_on)
            if stuck is not None and stuck not in findings:
                findings[stuck] = _looks_without_end(items[stuck], stuck, targets[stuck])
        elif closed is not None and closed[0] == at:
            break
        elif not leads_on(at):
            at += 1
        elif _repeats(items[at]) in _ENDLESS and target <= at:
            closed = (at, len(visits))
            at = target
        else:
            taken[at] = taken.get(at, 0) + 1
            at = target
    return FlownOrder(
        visits=tuple(visits),
        lap_start=None if closed is None else closed[1],
        lap_item=None if closed is None else closed[0] + 1,
        findings=tuple(findings.values()),
    )


def _looks_round(
    items: tuple[MissionItem, ...],
    targets: Mapping[int, int],
    at: int,
    leads_on: Callable[[int], bool],
) -> int | None:
    """Return the jump that PX4 takes again and again on its look for its next places; ``None``: none.

    ``MissionBase::getNextPositionItems``: it takes the jumps whose count is not used up, and does not count.
    """
    for _ in range(_LOOKED_FOR):
        passed: set[int] = set()
        is_place = False
        while not is_place:
            if at >= len(items):
                return None
            if at in targets and leads_on(at):
                if at in passed:
                    return at
                passed.add(at)
                at = targets[at]
            else:
                is_place = items[at].command in _PX4_PLACES
                at += 1
    return None


def _looks_without_end(jump: MissionItem, at: int, target: int) -> Finding:
    message = (
        f"DO_JUMP to item {target + 1}: PX4 looks for its next place round that loop without end, past no "
        "item with one, and does not fly on"
    )
    return JUMP_WITHOUT_FLIGHT.finding(message, item=at + 1, place=jump.place)


class _Searches:
    """ArduPilot's two searches through a mission that runs; positions count from 0.

    Notes
    -----
    ``AP_Mission::get_next_cmd`` follows jumps, counting them on the way to the next place alone.
    """

    def __init__(
        self,
        items: tuple[MissionItem, ...],
        targets: Mapping[int, int],
        repeats: Mapping[int, int],
        *,
        counts_anew: bool,
    ) -> None:
        self.items = items
        self.targets = targets
        self.repeats = repeats
        self.counts_anew = counts_anew
        self.taken: dict[int, int] = {}
        self.closing: int | None = None
        """The endless jump back that was taken."""
        self.is_closed = False
        self.findings: dict[tuple[str, int], Finding] = {}

    def order(self) -> FlownOrder:
        """Return the order to the end of the mission, or once round an endless loop."""
        visits: list[int] = []
        foreseen: dict[int, tuple[int, int | None]] = {}
        lap_start: int | None = None
        at = 0
        while len(visits) <= len(self.items) + MOST_VISITS:
            planned = self._planned_from(at)
            known = self.closing
            path, place = self._way_from(at)
            jump = next((one for one in path if one in self.targets), None)
            if at and jump is not None and planned != place and not self.is_closed:
                foreseen[len(visits)] = (jump + 1, None if planned is None else planned + 1)
            reached = path if place is None else self._carried_out(path, place)
            if self.closing is not None and known is None:
                lap_start = len(visits) + reached.index(self.closing) + 1
            visits += (one + 1 for one in reached)
            if place is None:
                break
            at = place + 1
        return FlownOrder(
            visits=tuple(visits),
            lap_start=lap_start,
            lap_item=None if self.closing is None else self.closing + 1,
            foreseen=foreseen,
            findings=tuple(self.findings.values()),
        )

    def _way_from(self, at: int) -> tuple[list[int], int | None]:
        """Return the way to the next place, counting jumps (``advance_current_nav_cmd``), and that place.

        Jumps and DO_ items in the order the search meets them; no place where the mission ends there, or an
        endless loop closes.
        """
        path: list[int] = []
        for _ in range(_MOST_FOUND):
            found = self._next(at, path)
            if found is None or is_navigation(self.items[found].command):
                return path, found
            path.append(found)
            at = found + 1
        return path, None

    def _planned_from(self, at: int) -> int | None:
        """Return what is taken for the next place while the one before is flown to.

        Notes
        -----
        ``AP_Mission::get_next_nav_cmd`` goes from place to place in the list: where a jump leads to an item
        that is not flown, it looks on behind the jump.
        """
        for start in range(at, len(self.items)):
            found = self._next(start)
            if found is None or is_navigation(self.items[found].command):
                return found
        return None

    def _next(self, at: int, path: list[int] | None = None) -> int | None:
        """Return the next item that is no jump; jumps count where there is a path to put them on."""
        first: int | None = None
        jumps = 0
        while at < len(self.items):
            if self.items[at].command not in JUMPS:
                return at
            jumps += at in self.targets
            if jumps > _MOST_JUMPS or (path is None and first == at):
                return None
            first = at if first is None else first
            if path is not None:
                path.append(at)
            onward = self._onward(at, counts=path is not None)
            if onward is None:
                return None
            at = onward
        return None

    def _onward(self, at: int, *, counts: bool) -> int | None:
        """Return where a jump leads; ``None``: once more round an endless loop."""
        target = self.targets.get(at)
        if target is None:  # leads nowhere: predicted without it
            return at + 1
        repeats, taken = self.repeats[at], self.taken.get(at, 0)
        if repeats in _ENDLESS:
            if counts and target <= at:
                self.is_closed = self.closing == at
                self.closing = at if self.closing is None else self.closing
            return None if self.is_closed else target
        if taken < repeats:
            self.taken[at] = taken + counts
            return target
        if counts and self.counts_anew:
            self.taken[at] = 0
        return at + 1

    def _carried_out(self, path: list[int], place: int) -> list[int]:
        """Return what is reached up to a place: jumps, DO_ items where they are carried out, the place.

        Of what stands on the way the first is started, each further one by a look from the last on, which
        does not count jumps and ends at a place (``advance_current_do_cmd``).
        """
        on_way = [at for at in path if self.items[at].command not in JUMPS]
        found = on_way[:1]
        at = self._next(found[-1] + 1) if found else None
        while at is not None and not is_navigation(self.items[at].command) and at not in found:
            found.append(at)
            at = self._next(at + 1)
        if at in found:
            self._note_circle(found[found.index(at) :], place)
        self._note(set(found) - set(on_way), _ELSEWHERE, place)
        self._note(set(on_way) - set(found), _PASSED_OVER, place)
        reached: list[int] = []
        left = list(path)
        for one in found:
            if one in left:
                before = left[: left.index(one)]
                reached += (at for at in before if self.items[at].command in JUMPS)
                left = left[len(before) + 1 :]
            reached.append(one)
        return [*reached, *(at for at in left if self.items[at].command in JUMPS), place]

    def _note(
        self, positions: set[int], what: str, place: int, severity: Severity | None = None
    ) -> None:
        for at in sorted(positions):
            item = self.items[at]
            if item.command in HELD:
                message = f"{command_name(item.command)} {what.format(place=place + 1)}"
                self.findings.setdefault(
                    (what, at),
                    CARRIED_OUT_EARLY.finding(
                        message, item=at + 1, place=item.place, severity=severity
                    ),
                )

    def _note_circle(self, circle: list[int], place: int) -> None:
        """Note items of a circle that undo each other."""
        effects = {at: _effect_of(self.items[at]) for at in circle}
        values: dict[Hashable, set[Hashable]] = {}
        for what, value in effects.values():
            values.setdefault(what, set()).add(value)
        undone = {what for what, each in values.items() if len(each) > 1 or None in each}
        in_turn = {at for at, (what, _) in effects.items() if what in undone}
        self._note(in_turn, _IN_TURN, place, Severity.ERROR)


def _effect_of(item: MissionItem) -> tuple[Hashable, Hashable]:
    """Return what an item sets, and to what; ``None``: to wherever the vehicle is (``do_set_home``)."""
    if item.command == Command.DO_CHANGE_SPEED:
        return (item.command, item.param1), item.param2 or 0.0
    if item.command != Command.DO_SET_HOME:
        return item.command, item.param1 or 0.0
    if item.sets_home_here:
        return item.command, None
    return item.command, (item.latitude_deg, item.longitude_deg, item.altitude_m)


def _of_one_autopilot(found: Finding, who: Autopilot, other: Autopilot) -> Finding:
    """Return a finding on what one autopilot does, where it is not known who flies."""
    message = f"{who.label}: {found.message}, with {other.label} not so; {NAME_IT}"
    return replace(found, message=message, severity=Severity.ERROR)


def _of_both(anew: Sequence[Finding], kept: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the findings of either way to count; what is of one of them alone is an error."""
    of_kept, of_anew = ({one.message for one in found} for found in (kept, anew))
    return tuple(
        one
        if one.message in of_kept and one.message in of_anew
        else replace(one, message=one.message + _OF_ONE_VERSION, severity=Severity.ERROR)
        for one in (*anew, *(one for one in kept if one.message not in of_anew))
    )


JUMP_TARGET = Rule(
    "M103 jump-target",
    Severity.ERROR,
    summary="A jump leads nowhere.",
    why="A jump to a missing item ends the mission or makes the autopilot refuse it; a jump to itself "
    "once skipped the whole mission (ArduPilot #28604).",
    how="The target of DO_JUMP or DO_JUMP_TAG is no item of the mission, or the jump itself.",
    fix="give the jump the id of an item before or after it",
    instead="a jump to an item of the mission",
)


def _targets(
    items: tuple[MissionItem, ...], dialect: Autopilot | None
) -> tuple[dict[int, int], list[Finding]]:
    """Return for each jump that leads somewhere its target, both as positions in ``items``."""
    numbered = list(enumerate(items))[::-1]  # the first with an id or a tag counts
    by_id = {item.jump_id: at for at, item in numbered}
    by_tag = {item.param1: at for at, item in numbered if item.command == Command.JUMP_TAG}
    targets: dict[int, int] = {}
    findings: list[Finding] = []
    for at, item in enumerate(items):
        if item.command not in JUMPS:
            continue
        is_tag = item.command == Command.DO_JUMP_TAG
        named, target = item.param1, None
        if named is not None:
            target = by_tag.get(named) if is_tag else by_id.get(int(named))
        if is_tag and dialect is Autopilot.PX4:
            problem = "PX4 has no jump tags"
        elif target is None:
            which = "(not given)" if named is None else f"{named:g}"
            problem = f"no {'tag' if is_tag else 'item'} {which}"
        elif target == at:
            problem = "jumps to itself"
        else:
            targets[at] = target
            continue
        message = f"{command_name(item.command)}: {problem}; predicted without the jump"
        findings.append(JUMP_TARGET.finding(message, item=at + 1, place=item.place))
    return targets, findings


def is_counted(item: MissionItem) -> bool:
    """Return whether ArduPilot takes a jump a number of times, not endlessly."""
    return _kept_repeats(item) != _FOREVER


def _kept_repeats(item: MissionItem) -> int:
    """Return how often ArduPilot takes a jump: it keeps 16 bits with a sign, and -1 alone is endless."""
    repeats = 0.0 if item.param2 is None else item.param2
    kept = (
        int(max(min(repeats, _FOREVER_IN_16_BITS), -_FOREVER_IN_16_BITS)) + 2**15
    ) % 2**16 - 2**15
    return kept if kept == _FOREVER else max(kept, 0)


def _repeats(item: MissionItem) -> int:
    """Return how often PX4 takes a jump, and an unknown autopilot at most; any negative count is endless."""
    repeats = 0.0 if item.param2 is None else item.param2
    return _FOREVER if repeats < 0.0 else int(min(repeats, _FOREVER_IN_16_BITS))
