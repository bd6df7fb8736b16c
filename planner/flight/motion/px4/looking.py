"""Looking at regions of interest: how PX4's heading follows one, and how long waypoints wait for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.flight.motion.kinematics import horizontal, lengths, quotient, rows_of

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.flight.motion.px4.legs import Px4Legs
    from planner.flight.motion.px4.moves import Moves
    from planner.vehicle.parameters.px4 import Px4Parameters

STEP_S = 0.05
"""Period in which headings are stepped. [s]"""
_LONGEST_S = 60.0
"""Longer than any turn takes that a region of interest which no longer moves asks for. [s]"""
_FORGETS = 4.0
"""Turns round, begun and ended at rest, after which no matter where a vehicle looked before. [-]"""
_ALIKE_RAD = math.radians(1.0)
"""Difference of headings [rad], and of their rates [rad s⁻¹], that is none."""
_CREEP_M_S = 0.5
"""Speed at least at which a vehicle closes in on the waypoint it waits at. [m s⁻¹]"""


class Look(NamedTuple):
    """Where a vehicle looks, and how fast that turns."""

    heading_rad: float
    rate_rad_s: float

    def followed(self, bearing_rad: list[float], parameters: Px4Parameters) -> Look:
        """Return the look after following a bearing, a step for each value.

        Notes
        -----
        ``HeadingSmoothing``: at MPC_YAWRAUTO_ACC and at most MPC_YAWRAUTO_MAX towards the bearing of each
        instant, as if it stood still: it lags v²/2a behind one that turns at v.
        """
        acceleration, most = parameters.yaw_acceleration_rad_s2, parameters.yaw_rate_rad_s
        change = acceleration * STEP_S
        heading, rate = self
        for bearing in bearing_rad:
            left = math.remainder(bearing - heading, math.tau)
            rate += change if left > 0.5 * rate * abs(rate) / acceleration else -change
            rate = min(max(rate, -most), most)
            heading += rate * STEP_S
        return Look(heading, rate)

    def is_off(self, bearing_rad: float, parameters: Px4Parameters) -> bool:
        """Return whether a waypoint is not reached with it (MIS_YAW_ERR)."""
        left = math.remainder(bearing_rad - self.heading_rad, math.tau)
        return abs(left) > parameters.yaw_acceptance_rad

    @property
    def rounded(self) -> tuple[int, int]:
        """The same of looks that are alike."""
        heading = math.remainder(self.heading_rad, math.tau)
        return round(heading / _ALIKE_RAD), round(self.rate_rad_s / _ALIKE_RAD)


def looking_waits_s(
    moves: Moves, courses: Courses, before_rad: FloatArray, waits_on: BoolArray
) -> FloatArray:
    """Return the waits for headings to a region of interest, at waypoints that wait for them. (k, n) [s]

    A row for each heading from which the vehicle may begin to look there. (k, n)

    Notes
    -----
    ``MissionBase::heading_sp_update`` looks there from where the vehicle is, not from the waypoint it flies
    to: on the way past, it turns as the region does, even the other way round at first.
    """
    waits, seen_s = np.zeros_like(before_rad), _seen_s(moves.parameters)
    last, looks, region_m = -2, list[Look](), courses.target_m[0]
    for row in rows_of((moves.looks | moves.is_delay) & ~moves.is_first).tolist():
        if moves.looks[row]:
            region_m = courses.target_m[row] + moves.looks_m[row]
        elif last != row - 1:
            continue
        if last != row - 1:
            looks = [Look(heading, 0.0) for heading in before_rad[:, row].tolist()]
        last = row
        hold_s = float(moves.hold_s[row])
        on_the_way = _seen_rad(courses.way_m(row, seen_s), region_m, moves.parameters)
        if courses.flown_s[row] > seen_s:
            looks = [Look(on_the_way[0], 0.0)] * len(looks)
        over_it = _seen_rad(courses.over_m(row, hold_s), region_m, moves.parameters)
        done: dict[tuple[int, int], tuple[float, Look]] = {}
        for number, look in enumerate(looks):
            if look.rounded not in done:
                arrived = look.followed(on_the_way, moves.parameters)
                wait_s, arrived = _waited(
                    arrived, over_it if waits_on[row] else [], moves.parameters
                )
                rest = over_it[round(wait_s / STEP_S) : round(hold_s / STEP_S)]
                done[look.rounded] = wait_s, arrived.followed(rest, moves.parameters)
            waits[number, row], looks[number] = done[look.rounded]
    return waits


def _seen_s(parameters: Px4Parameters) -> float:
    """Return the time of a way's end by which alone its last heading is."""
    most, acceleration = parameters.yaw_rate_rad_s, parameters.yaw_acceleration_rad_s2
    return max(_FORGETS * (math.tau / most + most / acceleration), _LONGEST_S)


def _waited(look: Look, bearing_rad: list[float], parameters: Px4Parameters) -> tuple[float, Look]:
    """Return how long a waypoint is waited at for a heading, and the look after that."""
    steps = 0
    while steps < len(bearing_rad) and look.is_off(bearing_rad[steps], parameters):
        look = look.followed(bearing_rad[steps : steps + 1], parameters)
        steps += 1
    return steps * STEP_S, look


def _seen_rad(place_m: FloatArray, region_m: FloatArray, parameters: Px4Parameters) -> list[float]:
    """Return the bearings of a region of interest; within NAV_ACC_RAD of it that of the place before."""
    way = region_m - place_m
    is_far = horizontal(way) > parameters.acceptance_radius_m
    known = np.maximum.accumulate(np.where(is_far, np.arange(len(way)), 0))
    bearing: list[float] = np.arctan2(way[known, 0], way[known, 1]).tolist()
    return bearing


class Courses:
    """The places of moves in time, which take ``flown_s`` from their beginnings to their arrivals."""

    def __init__(self, legs: Px4Legs, flown_s: FloatArray) -> None:
        self.weaves = legs.weaves
        limits, rise, braking = legs.limits, legs.straights.rise, legs.straights.braking
        ramp_s = np.maximum(rise.ramps(limits).duration_s - rise.begun_s, 0.0)
        cruise_s = quotient(legs.straights.cruise_m, rise.peak_m_s)
        self.time_s = np.cumsum(
            (legs.turn_s, ramp_s, cruise_s, braking.onset_s + braking.steady_s), axis=0
        )
        self.speed_m_s = np.array((rise.from_m_s, rise.peak_m_s, rise.peak_m_s, braking.joined_m_s))
        self.flown_s, self.end_m_s = flown_s, braking.end_m_s
        self.begin_m, self.straight_m = legs.place_m[:, :2], legs.straight_m[:, :2]
        self.end_m = self.straight_m + (limits.direction * limits.length_m[:, None])[:, :2]
        self.target_m = legs.planned.target_m[:, :2]

    def way_m(self, row: int, last_s: float) -> FloatArray:
        """Return places of a move, one each step: in its turn straight ahead, then at linear speeds.

        None but those of its last seconds.
        """
        whole_s = float(self.flown_s[row])
        first = max(round((whole_s - last_s) / STEP_S), 0)
        time_s = STEP_S * np.arange(first + 1.0, round(whole_s / STEP_S) + 1.0)
        turn_s = float(self.time_s[0, row])
        knots_s = np.append(self.time_s[:, row], whole_s)
        knots_m_s = np.append(self.speed_m_s[:, row], self.end_m_s[row])
        speed = np.interp(time_s, knots_s, knots_m_s)
        flown = np.cumsum(np.where(time_s > turn_s, speed, 0.0))
        if first:
            flown += float(np.trapezoid(knots_m_s, knots_s)) / STEP_S - flown[-1]
        part = quotient(flown, np.full_like(flown, flown[-1:].sum()), 1.0)[:, None]
        way_m = self.end_m[row] - self.straight_m[row]
        return np.asarray(self._turned_m(row, np.asarray(time_s), turn_s) + way_m * part)

    def over_m(self, row: int, hold_s: float) -> FloatArray:
        """Return places of a vehicle that waits at a waypoint: it closes in on it."""
        time_s = np.arange(0.0, max(_LONGEST_S, hold_s), STEP_S)
        if self.weaves.is_held[row]:
            return self._stepped_m(row, float(self.flown_s[row]) + time_s)
        off = self.end_m[row] - self.target_m[row]
        closing_s = float(lengths(off[None])[0]) / max(float(self.end_m_s[row]), _CREEP_M_S)
        left = np.exp(-time_s / closing_s) if closing_s > 0.0 else np.zeros_like(time_s)
        return np.asarray(self.target_m[row] + off * left[:, None])

    def _turned_m(self, row: int, time_s: FloatArray, turn_s: float) -> FloatArray:
        """Return places in the turn that a move begins with, after it where that ends."""
        if self.weaves.is_stepped[row]:
            return self._stepped_m(row, np.minimum(time_s, turn_s))
        part = np.minimum(quotient(time_s, np.full_like(time_s, turn_s), 1.0), 1.0)[:, None]
        begin_m = self.begin_m[row]
        return np.asarray(begin_m + (self.straight_m[row] - begin_m) * part)

    def _stepped_m(self, row: int, time_s: FloatArray) -> FloatArray:
        """Return places of a move that is stepped, after that where it ends."""
        swung = self.weaves.swung[row]
        east, north, _ = swung.place_m.T
        return np.column_stack([np.interp(time_s, swung.time_s, axis) for axis in (east, north)])
