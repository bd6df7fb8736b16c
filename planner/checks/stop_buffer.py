"""The rule on the room to stop before the fence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.catalogue.fence import STOP_BUFFER
from planner.checks.fenced_flight import straight_legs
from planner.findings import Severity
from planner.geo.swept_area import SweptAreas, swept_areas

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.checks.fenced_flight import FencedFlight
    from planner.findings import Finding
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.geo.barrier import Barrier

_SLOWEST_M_S = 0.05
"""A slower speed is none to fly at. [m s⁻¹]"""
_ROOM_STEPS = 40
"""Halvings in looking for the free way ahead: 1e-9 of it."""


def check_stop_buffer(
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
    worst: tuple[float, int, Barrier] | None = None
    items: set[int] = set()
    severity = Severity.WARNING
    at_once_m: FloatArray | None = None
    for barrier in barriers:
        legs = flown.legs_near(barrier)
        legs = legs[~np.isin(flown.group[legs], list(crossing))]
        if not len(legs):
            continue
        legs = legs[_areas(flown, legs, flown.stopped_m).near(barrier, flown.margin_m)]
        if not len(legs):
            continue
        items.update(flown.path.item[legs].tolist())
        ends = np.unique(np.concatenate((legs, legs + 1)))
        clearance = barrier.leg_clearance(
            straight_legs(flown.points_m[ends], flown.stopped_m[ends])
        ).clearance_m
        nearest = int(np.argmin(clearance))
        if worst is None or clearance[nearest] < worst[0]:
            worst = (float(clearance[nearest]), int(ends[nearest]), barrier)
        if at_once_m is None:
            at_once_m = flown.ahead_m(flown.room.stopping_distance_m(flown.path.speed_m_s))
        if _areas(flown, legs, at_once_m).near(barrier, 0.0).any():
            severity = Severity.ERROR
    if worst is not None:
        yield _finding(flown, worst[1], worst[2], items, severity)


def _areas(flown: FencedFlight, legs: IntArray, ahead_m: FloatArray) -> SweptAreas:
    """Return what each leg passes over, straight ahead included."""
    return swept_areas(
        np.concatenate([p[rows] for p in (flown.points_m, ahead_m) for rows in (legs, legs + 1)]),
        np.tile(np.arange(len(legs)), 4),
    )


def _finding(
    flown: FencedFlight, point: int, barrier: Barrier, items: set[int], severity: Severity
) -> Finding:
    path, room = flown.path, flown.room
    leg = min(point, len(path.item) - 1)
    item = int(path.item[leg])
    if item not in items:  # the point ends the leg that is meant
        item = int(path.item[max(point - 1, 0)])
    speed = float(path.speed_m_s[point])
    tail = float(flown.tail_wind_m_s[point])
    start, end = flown.points_m[point], flown.stopped_m[point]
    error_m = flown.margin_m
    away_m = float(barrier.signed_distance_m(start[None])[0])
    needed_m = float(np.hypot(*(end - start)))
    fix = None
    if away_m < error_m or needed_m == 0.0:
        message = (
            f"the flight passes {barrier.label} at {_metres(away_m)}, nearer than the "
            f"{_metres(error_m)} its position may be wrong"
        )
    else:
        free_m = _free_way_m(barrier, start, end, error_m)
        fits = room.fitting_speed_m_s(free_m, at_most_m_s=speed, tail_wind_m_s=tail)
        stop_m = float(room.stopping_distance_m(speed))
        message = (
            f"to stand still from {numbers.speed(speed)} takes {_metres(needed_m + error_m)} "
            f"({_metres(needed_m - stop_m)} to react, {_metres(stop_m)} to stop, "
            f"{_metres(error_m)} of position error), {barrier.label} is "
            f"{_metres(free_m + error_m)} ahead"
        )
        fix = f"turn or stop {_metres(needed_m - free_m)} earlier"
        if fits is not None and fits > _SLOWEST_M_S:
            message += f": {numbers.speed(fits)} or less would fit"
            fix = f"fly {numbers.speed(fits)} or less there, or {fix}"
    if len(items) > 1:
        message += f"; at {numbers.count(len(items), 'item')} in all"
    return STOP_BUFFER.finding(
        message,
        fix=fix,
        item=item,
        place=flown.place(item),
        severity=severity,
        stretch=flown.stretch(start, end, needed_m + error_m),
    )


def _metres(length_m: float) -> str:
    return f"{numbers.decimals(length_m, 1)} m"


def _free_way_m(barrier: Barrier, start_m: FloatArray, end_m: FloatArray, margin_m: float) -> float:
    """Return how far on the way from one place to another the margin is kept."""
    low, high = 0.0, 1.0
    for _ in range(_ROOM_STEPS):
        middle = 0.5 * (low + high)
        way = straight_legs(start_m[None], (start_m + middle * (end_m - start_m))[None])
        if float(barrier.leg_clearance(way).clearance_m[0]) >= margin_m:
            low = middle
        else:
            high = middle
    return low * float(np.hypot(*(end_m - start_m)))
