"""In which order ArduPilot carries out the items of a mission: its two queues, read from its source.

Written after ``AP_Mission::update``, ``advance_current_nav_cmd``, ``advance_current_do_cmd``,
``get_next_cmd`` and ``get_next_do_cmd`` (libraries/AP_Mission/AP_Mission.cpp), each told in the method of
its name.  They are alike from Copter 4.1 to 4.7, but that jump tags came with 4.4 and that a jump
counted to its end starts anew from 4.7 on (#29763), unless bit 3 of MIS_OPTIONS is set.

A leg to where the last one led, without a hold, is over before its queue goes on; what is left out: any
other is long enough for all that its queue holds; conditions are never met; no
more jumps are counted than there is room for.
"""

from __future__ import annotations

from typing import NamedTuple

from planner.mission.commands import Command, is_navigation

# Not the table of the planner: the oracle has its own.
_CONDITIONS = {112, 114, 115}
_DO_JUMP, _JUMP_TAG, _DO_JUMP_TAG = 177, 600, 601
_FOREVER = -1
_MOST_JUMPS = 64
"""That one search follows."""
_MOST_PASSED = 255
"""Items of one search for the next place."""


class Row(NamedTuple):
    """One row of a mission, as far as the order goes."""

    command: int
    target: int = 0
    """Number of the row that a jump leads to, the tag that it looks for, or the tag that a tag has."""
    times: int = 0
    spot: float | None = None
    """Where a waypoint lies."""
    holds: bool = False


class Place(NamedTuple):
    """A navigation item that is started."""

    item: int
    carried_out: tuple[int, ...]
    """Other items started since the one before, in order, up to a condition that holds the rest back."""
    again: tuple[int, ...] = ()
    """Those of them that are started again and again for as long as the place is flown to."""


class MissionQueue:
    """A mission that runs; rows count from 1.

    Parameters
    ----------
    starts_anew : bool
        Whether a jump counted to its end counts from 0 again: Copter 4.7 without bit 3 of MIS_OPTIONS.
    """

    def __init__(self, rows: list[Row], *, starts_anew: bool = True) -> None:
        self.rows = rows
        self.starts_anew = starts_anew
        self.times_run: dict[int, int] = {}
        self.place = 0
        self.last_do: int | None = None
        self.carried_out: list[int] = []
        self.again: tuple[int, ...] = ()

    def flown(self, most: int) -> list[Place]:
        """Return the places in the order they are flown to, up to the mission's end or a return."""
        places: list[Place] = []
        spot: float | None = None
        while len(places) < most and self.advance_current_nav_cmd():
            row = self.rows[self.place - 1]
            has_time = row.spot is None or row.spot != spot or row.holds
            spot = row.spot
            while has_time and self.advance_current_do_cmd():
                pass
            places.append(Place(self.place, tuple(self.carried_out), self.again))
            if self.rows[self.place - 1].command == Command.NAV_RETURN_TO_LAUNCH:
                break
        return places

    def advance_current_nav_cmd(self) -> bool:
        """Start the next place, and before it the first item of another kind on the way to it alone."""
        self.last_do, self.carried_out, self.again = None, [], ()
        start = self.place + 1
        for _ in range(_MOST_PASSED):
            at = self.get_next_cmd(start, counts=True)
            if at is None:
                return False
            if is_navigation(self.rows[at - 1].command):
                self.place = at
                return True
            if self.last_do is None:
                self._carry_out(at)
            start = at + 1
        return False

    def advance_current_do_cmd(self) -> bool:
        """Start the next item of another kind, searched for in the list behind the last one."""
        if self.last_do is None or self.rows[self.last_do - 1].command in _CONDITIONS:
            return False
        found = self.get_next_do_cmd(self.last_do + 1)
        if found is None:
            return False
        if found in self.carried_out:
            self.again = tuple(self.carried_out[self.carried_out.index(found) :])
            return False
        self._carry_out(found)
        return True

    def get_next_do_cmd(self, at: int) -> int | None:
        """Return the next item unless it is a place; jumps are followed without counting them."""
        found = self.get_next_cmd(at, counts=False)
        return None if found is None or is_navigation(self.rows[found - 1].command) else found

    def get_next_cmd(self, at: int, *, counts: bool) -> int | None:
        """Return the next item that is no jump; ``None``: the list is over, or a jump leads nowhere."""
        first_jump: int | None = None
        jumps = 0
        while at <= len(self.rows):
            row = self.rows[at - 1]
            if row.command not in {_DO_JUMP, _DO_JUMP_TAG}:
                return at
            target = self._tagged(row.target) if row.command == _DO_JUMP_TAG else row.target
            jumps += 1
            if jumps > _MOST_JUMPS or not 0 < target <= len(self.rows):
                return None
            if not counts and first_jump == at:
                return None
            first_jump = first_jump or at
            taken = self.times_run.get(at, 0)
            if row.times == _FOREVER or taken < row.times:
                self.times_run[at] = taken + counts
                at = target
            else:
                if counts and self.starts_anew:
                    self.times_run[at] = 0
                at += 1
        return None

    def _carry_out(self, at: int) -> None:
        self.last_do = at
        self.carried_out.append(at)

    def _tagged(self, tag: int) -> int:
        tags = (n for n, row in enumerate(self.rows, 1) if row == Row(_JUMP_TAG, tag))
        return next(tags, 0)
