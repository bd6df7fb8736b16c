"""The rule on the room to stop before the fence."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.geo.barrier import SweptAreas, swept_areas
from planner.rules.fenced_flight import straight_legs
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.geo.barrier import Barrier
    from planner.rules.fenced_flight import FencedFlight

_SLOWEST_M_S = 0.05
"""A slower speed is none to fly at. [m s⁻¹]"""
_ALIKE_M = 0.1
"""Places that differ by less are as bad as each other. [m]"""
_TRIES, _ROUNDS = 64, 3
"""Tries at once, and how often, in looking for the free way ahead: 4e-6 of it."""

STOP_BUFFER = Rule(
    "F102 stop-buffer",
    Severity.WARNING,
    summary="There is no room to stop before the fence.",
    why="Fences act after they are passed: PX4 removed its predictive fence as dangerous and its "
    "maintainers ask for a buffer in which the vehicle can stop (PX4 #27465); braking at 14 m/s over a "
    "fence ended in a crash (ArduPilot #1971).",
    how="At every place of the flight, straight on in the direction of motion: speed × reaction time + the "
    "model's stopping distance from that speed + reaction time × tailwind; and within the position error (or "
    "ArduPilot's FENCE_MARGIN_XY, or FENCE_MARGIN where that is 0) of all of that.  An error where the path "
    "itself is within the position error of the fence, or a stop begun at once ends beyond it, or a full "
    "stop of ArduPilot is carried beyond it (1.2 m from 10 m/s, by the square of the speed); a warning where "
    "only the rest is not free.  --reaction-time is 1 s by default (an autopilot's own check takes "
    "some tenths of it, a hand on the switch all of it), --position-error 2.5 m (half of the fixes of a "
    "common single-frequency receiver are nearer).  Places where the vehicle is braking already count at the "
    "beginning and the end of the braking.",
    fix="fly slower there, or turn earlier",
    instead="--position-error or --reaction-time, or a mission farther from its fence",
)


def stop_buffer(
    flown: FencedFlight, barriers: list[Barrier], crossing: set[int]
) -> Iterator[Finding]:
    """Yield a finding where a vehicle that goes straight on could not stop before the fence.

    Parameters
    ----------
    flown : FencedFlight
        The flight and its fence.
    barriers : list
        Areas of the fence that may be in the way.
    crossing : set of int
        Groups of legs that are outside themselves: they have findings already.
    """
    found: list[tuple[Severity, _Narrow]] = []
    items: set[int] = set()
    for barrier in barriers:
        legs = flown.legs_near(barrier)
        legs = legs[~np.isin(flown.group[legs], list(crossing))]
        if not len(legs):
            continue
        legs = legs[_areas(flown, legs, flown.stopped_m).near(barrier, flown.margin_m)]
        if not len(legs):
            continue
        items.update(flown.path.item[legs].tolist())
        narrow = _narrowest(flown, barrier, legs)
        is_beyond = (
            narrow.path_m < flown.position_error_m
            or _areas(flown, legs, flown.at_once_m + flown.overshoot_m).near(barrier, 0.0).any()
        )
        found.append((Severity.ERROR if is_beyond else Severity.WARNING, narrow))
    if found:
        severity, worst = min(
            found, key=lambda one: (one[0] is not Severity.ERROR, one[1].clearance_m)
        )
        yield _finding(flown, worst, items, severity)


class _Narrow(Value, eq=False):
    """The place where the fence is nearest, or would be passed farthest."""

    clearance_m: float
    """The least there is, on the path or ahead of it. [m]"""
    leg: int
    place_m: FloatArray
    point: int | None
    """The point from which the vehicle goes straight on; ``None``: it passes beside the fence."""
    barrier: Barrier
    path_m: float
    """The least on the path. [m]"""


def _narrowest(flown: FencedFlight, barrier: Barrier, legs: IntArray) -> _Narrow:
    """Return the narrowest place of some legs: on their path, or straight ahead of it."""
    beside = barrier.leg_clearance(flown.legs(legs))
    row = _first_of_the_least(beside.clearance_m)
    leg = int(legs[row])
    points, owner = np.unique(np.concatenate((legs, legs + 1)), return_index=True)
    ways = straight_legs(flown.points_m[points], flown.stopped_m[points])
    ahead_m = barrier.leg_clearance(ways).clearance_m
    stop_m = float(ahead_m.min())
    point_row = _first_of_the_least(ahead_m)
    point = int(points[point_row])
    away_m = float(barrier.signed_distance_m(flown.points_m[[point]])[0])
    path_m = float(beside.clearance_m.min())
    # Where the way to a stop begins too near to the fence, the way flown there is to be mended.
    is_near = path_m < flown.position_error_m or away_m < flown.margin_m
    if is_near or path_m <= stop_m + _ALIKE_M:
        return _Narrow(
            clearance_m=min(path_m, stop_m),
            leg=leg,
            place_m=flown.along_m(leg, float(beside.along_m[row])),
            point=None,
            barrier=barrier,
            path_m=path_m,
        )
    return _Narrow(
        clearance_m=stop_m,
        leg=int(np.concatenate((legs, legs))[owner[point_row]]),
        place_m=flown.points_m[point],
        point=point,
        barrier=barrier,
        path_m=path_m,
    )


def _first_of_the_least(clearance_m: FloatArray) -> int:
    return int(np.argmax(clearance_m < clearance_m.min() + _ALIKE_M))


def _areas(flown: FencedFlight, legs: IntArray, ahead_m: FloatArray) -> SweptAreas:
    """Return what each leg passes over, straight ahead included."""
    return swept_areas(
        np.concatenate([p[rows] for p in (flown.points_m, ahead_m) for rows in (legs, legs + 1)]),
        np.tile(np.arange(len(legs)), 4),
    )


def _finding(flown: FencedFlight, narrow: _Narrow, items: set[int], severity: Severity) -> Finding:
    barrier, start, margin_m = narrow.barrier, narrow.place_m, flown.margin_m
    if narrow.point is None:
        end, about_m = start, margin_m
        message = (
            f"passes {barrier.label} at {quantity.beside(narrow.path_m, margin_m, _metres)}; the position "
            f"may be wrong by {_metres(margin_m)}"
        )
        if narrow.clearance_m < narrow.path_m - _ALIKE_M:
            side = "beyond" if narrow.clearance_m < 0.0 else "before"
            message += f"; straight on it stops {_metres(abs(narrow.clearance_m))} {side} it"
        short_m = math.ceil((margin_m - narrow.clearance_m) * 10.0) / 10.0
        fix = f"keep {_metres(short_m)} farther from the fence, or move it"
    else:
        end = flown.stopped_m[narrow.point]
        needed_m = float(np.hypot(*(end - start)))
        about_m = needed_m + margin_m
        free_m = _free_way_m(barrier, start, end, margin_m)
        message, fix = _ahead(flown, narrow, needed_m, free_m)
    of_item = flown.group == flown.group[narrow.leg]
    carried_m = float(np.hypot(*flown.overshoot_m[1:][of_item].T).max())
    rests = narrow.point is not None and flown.path.speed_m_s[narrow.point] <= _SLOWEST_M_S
    if severity is Severity.ERROR and carried_m > narrow.path_m and not rests:
        message += f"; it is carried {_metres(carried_m)} beyond the place it stops at"
    if len(items) > 1:
        message += f"; at {quantity.count(len(items), 'item')} in all"
    return flown.assessment.finding(
        STOP_BUFFER,
        message,
        fix=fix,
        item=int(flown.path.item[narrow.leg]),
        severity=severity,
        stretch=flown.stretch(start, end, about_m),
    )


def _ahead(flown: FencedFlight, narrow: _Narrow, needed_m: float, free_m: float) -> tuple[str, str]:
    """Return what is said of a place from which the vehicle goes straight on, and what to do."""
    assert narrow.point is not None
    margin_m, speed = flown.margin_m, float(flown.path.speed_m_s[narrow.point])
    is_ahead = f"{narrow.barrier.label} is {_metres(free_m + margin_m)} ahead"
    fix = f"turn or stop {_metres(needed_m - free_m)} earlier"
    if speed <= _SLOWEST_M_S:
        message = (
            f"passes the place it stops at by {_metres(needed_m)}, and the position may be wrong by "
            f"{_metres(margin_m)}; {is_ahead}"
        )
        return message, f"fly there more slowly, or {fix}"
    stop_m = float(flown.room.farthest_stop_m(speed))
    message = (
        f"stopping from {quantity.speed(speed)} takes {_metres(needed_m + margin_m)} "
        f"({_metres(needed_m - stop_m)} reaction, {_metres(stop_m)} braking, {_metres(margin_m)} "
        f"position error); {is_ahead}"
    )
    fits = flown.room.fitting_speed_m_s(
        free_m, at_most_m_s=speed, tail_wind_m_s=float(flown.tail_wind_m_s[narrow.point])
    )
    if fits is not None and fits > _SLOWEST_M_S:
        message += f": {quantity.speed(fits)} or less would fit"
        fix = f"fly {quantity.speed(fits)} or less there, or {fix}"
    if narrow.path_m < margin_m:
        fix += f"; the path itself is {_metres(narrow.path_m)} from the fence: keep {_metres(margin_m)}"
    return message, fix


def _metres(length_m: float) -> str:
    return f"{quantity.decimals(length_m, 1)} m"


def _free_way_m(barrier: Barrier, start_m: FloatArray, end_m: FloatArray, margin_m: float) -> float:
    """Return how far on the way from one place to another the margin is kept."""
    low, high = 0.0, 1.0
    owner = np.tile(np.arange(_TRIES), 2)
    for _ in range(_ROUNDS):
        fractions = np.linspace(low, high, _TRIES)
        ahead = start_m + fractions[:, None] * (end_m - start_m)
        starts = np.broadcast_to(start_m, ahead.shape)
        near = swept_areas(np.concatenate((starts, ahead)), owner).near(barrier, margin_m)
        first = int(np.argmax(near)) if near.any() else _TRIES - 1
        low, high = float(fractions[max(first - 1, 0)]), float(fractions[first])
    return low * float(np.hypot(*(end_m - start_m)))
