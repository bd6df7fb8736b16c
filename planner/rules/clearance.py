"""Height above the ground along lines, and how much of it is asked for."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.mission.route.stage import LANDED_STAGES, RETURN_STAGES
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.path import FlightLines
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment

PART_M = 2.5
"""Lines near home are judged in parts so long: the ground there may rise by 0.7 m in one. [m]"""
STRAIGHT_M = 1000.0
"""Lines so long are straight in degrees too, to 2 cm at 47°. [m]"""
STEEPEST_DEG = 15.0
"""Of ground that a vehicle stands on: the US Army lands no helicopter on steeper (FM 3-21.38, landing
sites). [°]"""
STEEPEST_RISE = math.tan(math.radians(STEEPEST_DEG))
"""Of the ground around where a vehicle can stand: 5 m in 19 m. [-]"""
_AROUND_HOME_M = 5.0 / STEEPEST_RISE
"""Within which less than the clearance is asked for: however much of it, a flight is up by then. [m]"""
SAME_PLACE_M = 1e-3
"""Lines shorter over ground go up and down. [m]"""
ROUNDING_M = 1e-4
"""Heights of grids are of single precision. [m]"""
_TINY_M = 1e-300
"""Divides nothing into nothing. [m]"""
_FALLS_SHORT_M = 0.8
"""NAV_MC_ALT_RAD as it is delivered: PX4 takes a height for reached so far below it, and flies on. [m]"""
_SHORT_SHARE = 0.2
"""What may be missing of a clearance so, at most: a small one is not used up by it. [-]"""
_CIRCLE_PARTS = 12
"""Chords of a circle: within 9 cm of one of 2.5 m."""
_BOX_PLACES = 5
"""Along each side of a box, and in it: enough for the box in a projection."""

GROUND_THERE = "a grid without holes there: --terrain, with several files where one ends"


class Clearance(Value, eq=False):
    """Height above the ground along lines, in parts in which it is straight."""

    line: IntArray
    """Line each part is of, rising. (k,)"""
    start: FloatArray
    """Where on its line each part begins and ends, 0 to 1. (k,)"""
    end: FloatArray
    length_m: FloatArray
    """Over ground. (k,) [m]"""
    at_m: FloatArray
    """At the beginning and the end; above home's level where the ground is not known. (k, 2)"""
    is_known: BoolArray
    """Whether the ground is. (k,)"""
    asked_m: FloatArray
    """What is to be kept. (k,) [m]"""
    is_missed: BoolArray
    """Whether the ground is not known where it matters: not by home, where the vehicle stood. (k,)"""

    def extremes_m(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the least and the greatest of each part, and where on the line the least is. (k,)"""
        falls = self.at_m[:, 1] < self.at_m[:, 0]
        return (self.at_m.min(axis=1), self.at_m.max(axis=1), np.where(falls, self.end, self.start))

    def length_too_low_m(self) -> FloatArray:
        """Return the length of each part that is lower than is asked for. (k,) [m]"""
        over_m = self.at_m - self.asked_m[:, None]
        below_m = np.maximum(-over_m, 0.0).sum(axis=1)
        share: FloatArray = below_m / np.maximum(np.abs(over_m).sum(axis=1), _TINY_M)
        return share * self.length_m


def led_heights_m(a: Assessment) -> FloatArray:
    """Return the least height above home at which the mission leads to each item, from 1. (items + 1,) [m]

    −∞ where it leads to the ground, or home.
    """
    led_m = np.full(len(a.mission.items) + 1, np.inf)
    from_m = math.inf  # a take-off is judged where it has ended
    for stage in a.route.stages:
        goes_down = stage.kind in LANDED_STAGES | RETURN_STAGES
        height_m = -math.inf if goes_down else min(from_m, stage.height_m)
        led_m[stage.item] = min(float(led_m[stage.item]), height_m)
        from_m = stage.height_m
    return led_m


def near_home_m(clearance_m: float) -> float:
    """Return within what of home less than the whole clearance is asked for. [m]"""
    return min(clearance_m / STEEPEST_RISE, _AROUND_HOME_M)


def asked_clearance_m(clearance_m: float, from_home_m: FloatArray) -> FloatArray:
    """Return what is asked for so far from home, where the vehicle stood: what ground there may rise. [m]"""
    rises_m = np.minimum(clearance_m, STEEPEST_RISE * from_home_m)
    return np.where(from_home_m < near_home_m(clearance_m), rises_m, clearance_m)


def falls_short_m(
    led_m: FloatArray, height_m: FloatArray, clearance_m: FloatArray | float
) -> FloatArray:
    """Return how far heights are below those led to, as far as these count as reached. (n,) [m]"""
    most_m = np.minimum(_FALLS_SHORT_M, _SHORT_SHARE * np.asarray(clearance_m))
    return np.clip(np.where(np.isinf(led_m), -np.inf, led_m) - height_m, 0.0, most_m)


def clearance_of(
    a: Assessment,
    terrain: TerrainGrid | None,
    lines: FlightLines,
    *,
    led_m: FloatArray,
    beside_m: float = 0.0,
    clearance_m: float | None = None,
) -> Clearance:
    """Return the height above the ground along lines no longer than what is straight.

    Of lines ``beside_m`` of the flight it is asked what is asked of the flight; of each, as where the mission
    leads it, at heights ``led_m`` above home.  What is asked is ``--clearance``, or another. [m]
    """
    if clearance_m is None:
        clearance_m = a.setup.clearance_m
    ends = np.stack((lines.start_m, lines.end_m), axis=1)
    if terrain is None or not a.route.knows_home_amsl:
        line = np.arange(len(ends))
        start, end = np.zeros(len(ends)), np.ones(len(ends))
        ground_m = np.full((len(ends), 2), np.nan)
    else:
        ground = terrain.under(*a.route.frame.latitude_longitude_deg(ends[..., 0], ends[..., 1]))
        line, start, end = ground.line, ground.start, ground.end
        ground_m = ground.ground_amsl_m - a.route.ground_datum_m
    along = np.stack((start, end), axis=1)
    place_m = ends[line, :1] + along[..., None] * (ends[line, 1:] - ends[line, :1])
    is_known = ~np.isnan(ground_m).any(axis=1)
    ground_m = np.where(is_known[:, None], ground_m, 0.0)
    from_home_m = np.hypot(place_m[..., 0], place_m[..., 1]).max(axis=1)
    from_home_m = np.maximum(from_home_m - beside_m, 0.0)
    asked_m = asked_clearance_m(clearance_m, from_home_m)
    short_m = falls_short_m(led_m[line], place_m[..., 2].min(axis=1), asked_m)
    return Clearance(
        line=line,
        start=start,
        end=end,
        length_m=lines.length_m[line] * (end - start),
        at_m=place_m[..., 2] - ground_m,
        is_known=is_known,
        asked_m=asked_m - ROUNDING_M - short_m,
        is_missed=~is_known & (from_home_m > near_home_m(clearance_m)),
    )


def near_home_cut(lines: FlightLines, clearance_m: float) -> FlightLines:
    """Return lines, those cut that begin or end where less than the whole clearance is asked for."""
    from planner.flight.path import FlightLines

    near_m = near_home_m(clearance_m)
    near = np.minimum(*(np.hypot(*end[:, :2].T) for end in (lines.start_m, lines.end_m))) < near_m
    if not near.any():
        return lines
    both = FlightLines.joined([lines.select(~near), lines.select(near).cut(PART_M)])
    return both.select(np.argsort(both.owner, kind="stable"))


def sides_of(lines: FlightLines, beside_m: float) -> list[FlightLines]:
    """Return lines so far to one side of others, and to the other side."""
    way_m = (lines.end_m - lines.start_m)[:, :2]
    across = np.column_stack((-way_m[:, 1], way_m[:, 0], np.zeros(len(way_m))))
    across *= beside_m / np.maximum(np.hypot(*way_m.T), SAME_PLACE_M)[:, None]
    return [
        replace(lines, start_m=lines.start_m + side, end_m=lines.end_m + side)
        for side in (-across, across)
    ]


class Lowest(Value, kw_only=False, eq=False):
    """The place where lines are nearest to the ground."""

    clearance_m: float
    row: int
    """Of the lines, or of the fan of returns; beyond it, on what they follow along the mission."""
    place_m: FloatArray
    """East, north, height above home. (3,) [m]"""


def nearest_m(
    place_m: FloatArray, start_m: FloatArray, end_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how far lines are from places on the map, and their heights there; of upright ones the least."""
    way_m = end_m - start_m
    squared = (way_m[:, :2] ** 2).sum(axis=1)
    along = ((place_m - start_m[:, :2]) * way_m[:, :2]).sum(axis=1)
    share = np.clip(along / np.maximum(squared, SAME_PLACE_M**2), 0.0, 1.0)
    nearest_m = start_m + share[:, None] * way_m
    lower_m = np.minimum(start_m[:, 2], end_m[:, 2])
    return (
        np.hypot(*(place_m - nearest_m[:, :2]).T),
        np.where(squared > SAME_PLACE_M**2, nearest_m[:, 2], lower_m),
    )


def box_places_m(places_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return east and north of places all around others, on the edge of their box. [m]"""
    low, high = places_m[:, :2].min(axis=0), places_m[:, :2].max(axis=0)
    shares = np.linspace(0.0, 1.0, _BOX_PLACES)
    east, north = np.meshgrid(*(low[:, None] + (high - low)[:, None] * shares))
    return east.ravel(), north.ravel()


def circle_m(radius_m: float) -> FloatArray:
    """Return east and north of places around the origin, the first of them last too. (n, 2) [m]"""
    angle = np.linspace(0.0, 2.0 * math.pi, _CIRCLE_PARTS + 1)
    return radius_m * np.column_stack((np.cos(angle), np.sin(angle)))


_LEVEL_M = 0.05
"""Heights below it read as 0.0 m, on whichever side they are. [m]"""


def above_text(clearance_m: float, what: str = "the ground") -> str:
    """Return how high above something, or how far below it, a flight is."""
    if abs(clearance_m) < _LEVEL_M:
        return f"level with {what}"
    side = "below" if clearance_m < 0.0 else "above"
    return f"{quantity.height(abs(clearance_m))} {side} {what}"


def too_near_text(a: Assessment, clearance_m: float, what: str = "the ground") -> str:
    """Return how high above the ground a flight is, and what was asked for where it does not meet it."""
    asked = "" if clearance_m < 0.0 else f" (--clearance {quantity.height(a.setup.clearance_m)})"
    return above_text(clearance_m, what) + asked
