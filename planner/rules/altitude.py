"""Rules on altitudes: what they count from, and whether that is meant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.catalogue.altitude import AMSL_SUSPECT, HOME_MISMATCH, MIXED_FRAMES
from planner.catalogue.terrain import BELOW_TERRAIN
from planner.findings import Remarks, Severity
from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    Command,
    is_destination,
)
from planner.mission.route.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.mission.items import MissionItem
    from planner.rules.assessment import Assessment

_SEA = "the sea"
_REFERENCES: Mapping[int, str] = {
    **dict.fromkeys(RELATIVE_FRAMES, "home"),
    **dict.fromkeys(AMSL_FRAMES, _SEA),
    **dict.fromkeys(TERRAIN_FRAMES, "the terrain"),
}
_ON_THE_GROUND = frozenset(
    {Command.NAV_TAKEOFF, Command.NAV_LAND, Command.NAV_VTOL_TAKEOFF, Command.NAV_VTOL_LAND}
)

HIGH_M = 500.0
"""No mission above home is meant to be so high without it being looked at. [m]"""
_UNUSUAL_M = 150.0
"""Above what the law allows nearly everywhere. [m]"""
_ABOVE_GROUND_M = 300.0
"""An altitude up to so much above that of home may have been meant AMSL. [m]"""
_TELLING_HOME_M = 30.0
"""Where home is lower, both references are nearly one. [m AMSL]"""
_GIVEN_APART_M = 3.0
_LEVEL_WITHIN_M = 1.0
"""Nearer to home's height, rounding may be meant. [m]"""
_IN_THE_AIR = frozenset(
    {
        StageKind.GO,
        StageKind.SPLINE,
        StageKind.LOITER,
        StageKind.CIRCLE,
        StageKind.CHANGE_HEIGHT,
    }
)
_GRID_APART_M = 10.0


def check_level_ground(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a place is under the ground that is taken to be level with home."""
    if a.terrain is not None:
        return
    low = [
        stage
        for stage in a.route.stages
        if stage.kind in _IN_THE_AIR and stage.height_m < -_LEVEL_WITHIN_M
    ]
    if low:
        lowest = min(low, key=lambda stage: stage.height_m)
        more = "" if len(low) == 1 else f"; {len(low)} places are"
        yield BELOW_TERRAIN.finding(
            f"{quantity.height(-lowest.height_m)} below the ground, which is taken to be level with "
            f"home{more}",
            item=lowest.item,
            place=a.mission.items[lowest.item - 1].place,
            fix="mend the altitude, or where the ground falls away give it with --terrain",
        )


def check_frames(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where places of a mission count their altitudes from several references."""
    if len({item.frame for item in a.mission.items} & _REFERENCES.keys()) < 2:
        return  # nearly every mission: its items need no second look
    first: dict[str, int] = {}
    count: dict[str, int] = {}
    for number, item in enumerate(a.mission.items, start=1):
        reference = _REFERENCES.get(item.frame)
        if reference is None or not item.altitude_m or not _is_place_in_the_air(item):
            continue
        first.setdefault(reference, number)
        count[reference] = count.get(reference, 0) + 1
    if len(count) < 2:
        return
    most, *others = sorted(count, key=lambda reference: (-count[reference], first[reference]))
    odd = min(first[other] for other in others)
    rest = " and ".join(
        f"from {other} ({count[other]}, first at item {first[other]})" for other in others
    )
    yield MIXED_FRAMES.finding(
        f"altitudes count from {most} ({count[most]}) and {rest}",
        item=odd,
        place=a.mission.items[odd - 1].place,
        # Terrain is followed by intent; a slip is between home and the sea.
        severity=None if _SEA in count else Severity.INFO,
    )


def _is_place_in_the_air(item: MissionItem) -> bool:
    return item.command not in _ON_THE_GROUND and is_destination(item.command)


def check_relative_altitudes(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for altitudes above home that look as if they were AMSL."""
    home_amsl_m = a.route.home_amsl_m
    remarks = Remarks()
    for number, item in enumerate(a.mission.items, start=1):
        altitude_m = item.altitude_m or 0.0
        if item.frame not in RELATIVE_FRAMES or altitude_m <= _UNUSUAL_M:
            continue
        if not is_destination(item.command):
            continue
        over_m = altitude_m - home_amsl_m
        if home_amsl_m > _TELLING_HOME_M and 0.0 <= over_m <= _ABOVE_GROUND_M:
            why = (
                f"home is at {quantity.height(home_amsl_m)} AMSL; {quantity.height(over_m)} above it "
                "may be meant"
            )
        elif altitude_m > HIGH_M:
            why = "an altitude AMSL may be meant"
        else:
            continue
        remarks.add(
            AMSL_SUSPECT,
            f"is at {quantity.height(altitude_m)} above home: {why}",
            item=number,
            place=item.place,
            severity=Severity.WARNING,
        )
    yield from remarks.findings()


def check_home(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where home was planned at another altitude than it has."""
    home = a.mission.home
    if home is None or home.altitude_amsl_m is None:
        return
    planned_m = home.altitude_amsl_m
    if planned_m == 0.0:  # what programs write who do not know
        return
    if a.given_home_amsl_m is not None:
        if abs(a.given_home_amsl_m - planned_m) <= _GIVEN_APART_M:
            return
        real_m, said = a.given_home_amsl_m, "the flight starts at"
    elif a.terrain is not None:
        ground = a.terrain.height_amsl_m(home.latitude_deg, home.longitude_deg)
        if ground.mask.any() or abs(float(ground) - planned_m) <= _GRID_APART_M:
            return
        real_m, said = float(ground), "the terrain grid has the place at"
    else:
        return
    yield HOME_MISMATCH.finding(
        f"the mission was planned from {quantity.height(planned_m)} AMSL, {said} "
        f"{quantity.height(real_m)}: {quantity.height(abs(real_m - planned_m))} apart"
    )
