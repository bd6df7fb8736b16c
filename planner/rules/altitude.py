"""Rules on altitudes: what they count from, and whether that is meant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Remarks, Rule, Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import (
    AMSL_FRAMES,
    LANDINGS,
    RELATIVE_FRAMES,
    TAKEOFFS,
    TERRAIN_FRAMES,
    is_destination,
)
from planner.mission.route.position import AMSL_SUSPECT, ground_amsl_m
from planner.mission.route.route import GRID_ERROR_M
from planner.rules.declaration import judges
from planner.rules.left_open import IN_SIGHT_M

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.mission.items import Home, MissionItem
    from planner.rules.assessment import Assessment

_SEA = "sea level"
_REFERENCES: Mapping[int, str] = {
    **dict.fromkeys(RELATIVE_FRAMES, "home"),
    **dict.fromkeys(AMSL_FRAMES, _SEA),
    **dict.fromkeys(TERRAIN_FRAMES, "the terrain"),
}
_ON_THE_GROUND = TAKEOFFS | LANDINGS
_HIGH_M = 500.0
"""No mission above home is meant to be so high without it being looked at. [m]"""
_UNUSUAL_M = 150.0
"""Above what the law allows nearly everywhere. [m]"""
_ABOVE_GROUND_M = 300.0
"""An altitude up to so much above that of home may have been meant AMSL. [m]"""
_TELLING_HOME_M = 30.0
"""Where home is lower, both references are nearly one. [m AMSL]"""
_GIVEN_APART_M = 3.0
_GRID_APART_M = 10.0

MIXED_FRAMES = Rule(
    "A101 mixed-frames",
    Severity.WARNING,
    summary="The items of one mission count their altitudes from different references.",
    why="Ground stations have lost the reference of single items on import and export (QGroundControl "
    "#10596, #9409, #7125: 'getting this wrong can lead to crashes').",
    how="Frames of the items flown to, take-offs and landings not counted: above home (3, 6), AMSL "
    "(0, 5), above terrain (10, 11).  Items at altitude 0 are not counted.  Home and terrain alone are "
    "only noted.",
    fix="write all altitudes in one reference, or ignore the code where the mix is meant",
)


@judges(MIXED_FRAMES)
def _mixed_frames(a: Assessment) -> Iterator[Finding]:
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
    rest = " and ".join(
        f"from {other} ({count[other]}, first at item {first[other]})" for other in others
    )
    yield a.finding(
        MIXED_FRAMES,
        f"altitudes count from {most} ({count[most]}) and {rest}",
        item=min(first[other] for other in others),
        # Terrain is followed by intent; a slip is between home and the sea.
        severity=None if _SEA in count else Severity.INFO,
    )


def _is_place_in_the_air(item: MissionItem) -> bool:
    return item.command not in _ON_THE_GROUND and is_destination(item.command)


@judges(AMSL_SUSPECT)
def _amsl_suspect(a: Assessment) -> Iterator[Finding]:
    # AMSL altitudes at or below home are found while the mission is walked.
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
                f"probably meant AMSL: {quantity.height(over_m)} above home, which is at "
                f"{quantity.height(home_amsl_m)} AMSL"
            )
        elif altitude_m > _HIGH_M:
            why = "possibly meant AMSL"
        else:
            continue
        remarks.add(
            AMSL_SUSPECT,
            f"{quantity.height(altitude_m)} above home, {why}",
            item=number,
            place=item.place,
            severity=Severity.WARNING,
        )
    yield from remarks.findings()


HOME_MISMATCH = Rule(
    "A115 home-mismatch",
    Severity.WARNING,
    summary="The mission was planned from another altitude of home than it is flown from.",
    why="Heights above home move with the place of take-off, AMSL altitudes do not: the planned home "
    "is not the home the vehicle uses (QGroundControl #5446, #7773; Skybrush live #185 requests a "
    "warning from 3 m on).",
    how="Planned home against --home-amsl, more than 3 m; else against --terrain at home, more than "
    "10 m, which grids err by in hills.  A planned home at exactly 0 m is ignored.  Heights above home are "
    "judged from the ground of the grid there, for the vehicle measures home where it arms; an error from "
    "16 m on, the accuracy SRTM is specified to, where altitudes of the mission count from the sea: one of "
    "the two is wrong, and with it every one of them.  --home-amsl, and homes of DO_SET_HOME with an "
    "altitude, more than 16 m from the grid are told.  A mission that is sent to a vehicle is asked of the "
    "home that reports, too, which is flown from then, and whether it is within 500 m of the planned one.",
    fix="set the planned home to the place of take-off, and check the heights again",
    instead="--home-amsl, or a planned home where the ground is",
)


@judges(HOME_MISMATCH)
def _home_mismatch(a: Assessment) -> Iterator[Finding]:
    home, given_m = a.mission.home, a.setup.home_amsl_m
    planned_m = (home and home.altitude_amsl_m) or None  # programs that do not know write 0
    frame, terrain = a.route.frame, a.setup.terrain
    ground_m = None
    if terrain is not None:
        ground_m = ground_amsl_m(terrain, frame.latitude_deg, frame.longitude_deg)
    if planned_m is not None and given_m is not None:
        if abs(given_m - planned_m) > _GIVEN_APART_M:
            yield a.finding(
                HOME_MISMATCH, f"home planned at {_apart(planned_m, given_m, 'as given')}"
            )
    elif planned_m is not None and ground_m is not None:
        apart_m = abs(ground_m - planned_m)
        if apart_m > _GRID_APART_M:
            decides = bool(a.route.amsl_items) and apart_m > GRID_ERROR_M
            yield a.finding(
                HOME_MISMATCH,
                f"home planned at {_apart(planned_m, ground_m, 'by the terrain grid')}"
                + ("; altitudes of the mission count from the sea" if decides else ""),
                severity=Severity.ERROR if decides else None,
                item=a.route.amsl_items[0] if decides else None,
            )
    if given_m is not None and ground_m is not None and abs(given_m - ground_m) > GRID_ERROR_M:
        yield a.finding(
            HOME_MISMATCH, f"home at {_apart(given_m, ground_m, 'by the terrain grid')}"
        )
    for one in a.route.moved_homes:
        off_m = one.datum_m - one.ground_m
        item = a.mission.items[one.item - 1]
        if terrain is not None and not item.sets_home_here and abs(off_m) > GRID_ERROR_M:
            side = "above" if off_m > 0.0 else "below"
            yield a.finding(
                HOME_MISMATCH,
                f"DO_SET_HOME puts home {quantity.height(abs(off_m))} {side} the ground there: heights "
                "of what follows, and of returns, count from it",
                item=one.item,
                fix="give the item the altitude of the ground",
            )


def planned_elsewhere(planned: Home | None, flown_from: Home) -> Iterator[Finding]:
    """Yield a finding where a mission was planned from another home than its vehicle has."""
    if planned is None or planned.latitude_deg == planned.longitude_deg == 0.0:
        return  # programs that do not know it write 0
    planned_m, own_m = planned.altitude_amsl_m or None, flown_from.altitude_amsl_m
    if planned_m is not None and own_m is not None and abs(own_m - planned_m) > _GIVEN_APART_M:
        message = f"home planned at {_apart(planned_m, own_m, 'as the vehicle reports it')}"
        yield HOME_MISMATCH.finding(message)
    here_deg = flown_from.latitude_deg, flown_from.longitude_deg
    beside_m = float(distance_m(planned.latitude_deg, planned.longitude_deg, *here_deg))
    if beside_m > IN_SIGHT_M:
        message = f"home planned {quantity.distance(beside_m)} from that of the vehicle"
        yield HOME_MISMATCH.finding(
            message, fix="plan from where the vehicle stands, or carry it there"
        )


def _apart(planned_m: float, real_m: float, by: str) -> str:
    return (
        f"{quantity.height(planned_m)} AMSL, {quantity.height(real_m)} {by}: "
        f"{quantity.height(abs(real_m - planned_m))} apart"
    )
