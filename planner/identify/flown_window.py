"""The part of a recorded flight that its mission predicts, and what in it no mission does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planner.catalogue.mission import LANDING_MISSING
from planner.catalogue.verification import BEGUN_IN_AIR, FLIGHT_CUT, MISSION_LEFT
from planner.logs.ardupilot_modes import AUTO
from planner.logs.px4_modes import AUTO_MISSION
from planner.mission.commands import Command

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.findings import Finding
    from planner.logs.record import FlightRecord
    from planner.mission.items import Mission
    from planner.mission.stage import Route

_MISSION_MODES = (AUTO, AUTO_MISSION, "AUTO_TAKEOFF")
_RETURNS = ("RTL", "AUTO_RTL", "AUTO_LAND", "LAND", "SMART_RTL")
"""Modes a mission that asks for a return or a landing may end in."""
_LEAST_S = 2.0
"""A shorter stretch in another mode is a switch passed over. [s]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlownWindow:
    """What is compared of a record."""

    flown: FlightRecord
    before_s: float
    """Left out before. [s]"""
    after_s: float
    """Left out behind. [s]"""
    findings: tuple[Finding, ...]


def flown_window(record: FlightRecord, mission: Mission, route: Route) -> FlownWindow:
    """Return the part of a flight to compare with the prediction of its mission.

    It begins with the record, or with the mission where that began on the ground later; it ends with
    the record, or with the mission where that ends in the air.

    Parameters
    ----------
    record : FlightRecord
        The whole flight.
    mission : Mission
        What it was flown by.
    route : Route
        The same laid out.

    Returns
    -------
    FlownWindow
        With findings of what was flown otherwise.
    """
    if not np.any(record.mode != ""):
        return FlownWindow(flown=record, before_s=0.0, after_s=0.0, findings=())
    in_mission = np.isin(record.mode, _MISSION_MODES)
    if not in_mission.any():
        message = f"{record.source}: no mission was flown in {record.duration_s:.1f} s of flight"
        return FlownWindow(
            flown=record, before_s=0.0, after_s=0.0, findings=(MISSION_LEFT.finding(message),)
        )
    findings: list[Finding] = []
    first, last = np.flatnonzero(in_mission)[[0, -1]].tolist()
    begin = 0
    if record.is_landed[first]:
        begin = first
    else:
        message = (
            f"{record.source}: the mission was begun in the air, after {record.time_s[first]:.1f} s"
        )
        findings.append(BEGUN_IN_AIR.finding(message))
    ends_in_air = any(one.code == LANDING_MISSING.code for one in route.findings)
    end = last + 1 if ends_in_air else record.time_s.size
    flown = _cut(record, begin, end)
    before_s = float(record.time_s[begin])
    after_s = record.duration_s - before_s - flown.duration_s
    cut = [(before_s, "before"), (after_s, "after")]
    told = " and ".join(f"{time_s:.1f} s {where}" for time_s, where in cut if time_s > _LEAST_S)
    if told:
        findings.append(FLIGHT_CUT.finding(f"{record.source}: {told} the mission are left out"))
    findings += _left(flown, mission)
    return FlownWindow(
        flown=flown, before_s=before_s, after_s=max(after_s, 0.0), findings=tuple(findings)
    )


def _cut(record: FlightRecord, begin: int, end: int) -> FlightRecord:
    if begin == 0 and end == record.time_s.size:
        return record
    begin_s = float(record.time_s[begin])
    end_s = record.duration_s if end == record.time_s.size else float(record.time_s[end - 1])
    columns: dict[str, npt.NDArray[np.generic]] = {
        name: column[begin:end] for name, column in record.columns().items()
    }
    columns["time_s"] = record.time_s[begin:end] - begin_s
    return replace(
        record,
        **columns,  # type: ignore[arg-type]  # a mapping of columns by their own names
        duration_s=end_s - begin_s,
        begins_in_log_s=record.begins_in_log_s + begin_s,
    )


def _left(flown: FlightRecord, mission: Mission) -> list[Finding]:
    """Return what was flown in modes that no mission flies in, in one finding."""
    elsewhere = ~np.isin(flown.mode, (*_MISSION_MODES, "")) & ~flown.is_landed
    returns = [
        number
        for number, item in enumerate(mission.items, start=1)
        if item.command == Command.NAV_RETURN_TO_LAUNCH
    ]
    if returns:
        # Where the log tells no items, a return is taken to be the one that is asked for.
        is_due = np.maximum.accumulate(flown.mission_item) >= returns[0] - 1
        asked_for = is_due | ~flown.mission_item.any()
        elsewhere &= ~(np.isin(flown.mode, _RETURNS) & asked_for)
    step_s = float(flown.time_s[1] - flown.time_s[0])
    lost_s = float(elsewhere.sum()) * step_s
    if lost_s <= _LEAST_S:
        return []
    modes = ", ".join(dict.fromkeys(flown.mode[elsewhere].tolist()))
    since_s = float(flown.time_s[np.flatnonzero(elsewhere)[0]])
    return [
        MISSION_LEFT.finding(
            f"{flown.source}: {modes} was flown for {lost_s:.1f} s from {since_s:.1f} s on: "
            "no mission predicts that"
        )
    ]
