"""Turns that PX4 does not come out of at once: it weaves across its new leg, which is stepped in time."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.findings import Rule, Severity
from planner.flight.motion.kinematics import horizontal
from planner.flight.motion.px4.braking import ramp_time_s, vertical_limits
from planner.flight.motion.px4.moves import SHORTEST_L1_M, SLOWEST_TURN_M_S
from planner.flight.motion.px4.turns import ALIGNED_COS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.motion.px4.legs import LegStarts
    from planner.flight.motion.px4.turns import Turns

_STEP_S = 0.02
"""Period of PX4's trajectory. [s]"""
_LONGEST_S = 200.0
"""Time after which it is given up to come onto a leg. [s]"""
_WORTH_S = 0.5
"""Time by which a turn is longer than one that does not shoot across, from which it is taken. [s]"""
_SIMILAR = (0.97, 1.03)
"""Speeds by that, for which a turn is tried, too."""
_BY_CHANCE_S = 3.0
"""Difference of the times of those, from which how a turn ends is a matter of chance. [s]"""
_TOO_FAR = 1.5
"""Way across a leg, in the distance steered for, from which it is not just overshot."""
_ZERO = 1e-7
_STEPPED = 1024
"""Turns remembered: a flight is planned in several rounds."""


WEAVES = Rule(
    "T125 weaves",
    Severity.ERROR,
    summary="PX4 weaves across a leg that it begins too fast from too far beside it.",
    why="A waypoint passed at an acceptance radius that is greater than the next one's leaves the vehicle "
    "beside its new leg.  PX4 steers straight at that from farther off than max(r, 5 m), at the speed it has "
    "(PositionSmoothing::_getL1Point), and shoots across where it cannot turn within that: flown at 8 m/s, "
    "from 20 m before a turn of 45° to a place with 2 m, it weaved 18 m to either side, for 85 s longer and "
    "600 m of way for 187 m.",
    how="The turn is stepped as PX4 steps its trajectory: an error where it gets farther across the leg than "
    "half as much again as the distance steered for, or where 3 % of the speed change its time by more "
    "than 3 s.",
    fix="give the place flown to as large a radius, or the one before a smaller one, or fly slower",
)


class _Swing(NamedTuple):
    """What a turn is stepped by; places from the waypoint before, east and north."""

    place_m: tuple[float, float]
    velocity_m_s: tuple[float, float]
    leg_m: tuple[float, float]
    speed_m_s: float
    final_m_s: float
    radius_m: float
    acceleration_m_s2: float
    jerk_m_s3: float


class _Swung(NamedTuple):
    duration_s: float
    place_m: tuple[float, float]
    speed_m_s: float
    astray_m: float
    """How far across the leg, on the side it did not come from. [m]"""


def weave(begun: LegStarts, turns: Turns) -> FloatArray:
    """Overwrite turns begun beside legs, too fast to stop across them; return how far some weave. (n,) [m]

    Notes
    -----
    ``PositionSmoothing::_getL1Point`` steers straight at a leg farther off than max(r, 5 m), and the speed
    is held until the velocity is within 11.5° of the target (``_generateVelocitySetpoint``): what takes more
    than that way to turn the velocity shoots across, and back again.  A vehicle gets beside its leg where it
    leaves a waypoint at an acceptance radius that is greater than the next one's.  Flown by a build of PX4 at
    8 m/s, 20 m before a turn of 45°: 18 m beside, 600 m of way for 187 m.
    """
    parameters, planned = begun.parameters, begun.planned
    astray_m = np.zeros_like(turns.duration_s)
    speed = horizontal(begun.velocity_m_s)
    leg = (planned.target_m - planned.begins_m)[:, :2]
    from_m = (begun.place_m - planned.begins_m)[:, :2]
    l1 = np.maximum(planned.radius_m, SHORTEST_L1_M)
    a, j = parameters.acceleration_m_s2, parameters.jerk_m_s3
    beside = np.abs(leg[:, 0] * from_m[:, 1] - leg[:, 1] * from_m[:, 0])
    shoots = (turns.duration_s > 0.0) & (planned.pause_s == 0.0) & planned.is_leg
    shoots &= ~planned.is_takeoff & (beside > l1 * horizontal(leg))
    shoots &= 0.5 * speed * ramp_time_s(speed, a, j) > l1
    for row in np.flatnonzero(shoots).tolist():
        swing = _Swing(
            _pair(from_m[row]),
            _pair(begun.velocity_m_s[row, :2]),
            _pair(leg[row]),
            float(planned.speed_m_s[row]),
            float(planned.final_level_m_s[row]),
            float(planned.radius_m[row]),
            a,
            j,
        )
        several = [_stepped(one) for one in _similar(swing)]
        durations_s = [one.duration_s for one in several]
        swung = several[int(np.argmax(durations_s))]
        end_m = planned.begins_m[row, :2] + swung.place_m
        ends_m = np.stack((end_m, turns.end_m[row, :2])) - planned.target_m[row, :2]
        nearer_m = float(np.subtract(*horizontal(ends_m)))
        later_s = swung.duration_s - turns.duration_s[row] + nearer_m / swing.speed_m_s
        if later_s < _WORTH_S:
            continue
        rise = planned.target_m[row, 2] - begun.place_m[row, 2]
        vertical_m_s, _ = vertical_limits(rise > 0.0, parameters)
        most_m = float(vertical_m_s) * swung.duration_s
        turns.duration_s[row] = swung.duration_s
        turns.end_m[row, :2] = end_m
        turns.end_m[row, 2] = begun.place_m[row, 2] + np.clip(rise, -most_m, most_m)
        turns.speed_m_s[row], turns.acceleration_m_s2[row] = swung.speed_m_s, 0.0
        is_chance = max(durations_s) - min(durations_s) > _BY_CHANCE_S
        if is_chance or several[0].astray_m > _TOO_FAR * l1[row]:
            astray_m[row] = max(one.astray_m for one in several)
    return astray_m


def weave_findings(item: IntArray, astray_m: FloatArray, turn_s: FloatArray) -> Iterator[Finding]:
    """Yield each leg that is weaved across."""
    for move in np.flatnonzero(astray_m).tolist():
        message = (
            f"PX4 weaves {astray_m[move]:.0f} m across its line to this place, for about "
            f"{turn_s[move]:.0f} s: it leaves the place before at a greater acceptance radius, too fast"
        )
        yield WEAVES.finding(message, item=int(item[move]))


def _similar(swing: _Swing) -> Iterator[_Swing]:
    for factor in (1.0, *_SIMILAR):
        east, north = swing.velocity_m_s
        yield swing._replace(velocity_m_s=(factor * east, factor * north))


def _pair(vector: FloatArray) -> tuple[float, float]:
    return float(vector[0]), float(vector[1])


@lru_cache(maxsize=_STEPPED)
def _stepped(swing: _Swing) -> _Swung:
    """Return a turn stepped until it heads for the target."""
    length = math.hypot(*swing.leg_m)
    along = swing.leg_m[0] / length, swing.leg_m[1] / length
    axes = [_Axis(*state) for state in zip(swing.place_m, swing.velocity_m_s, strict=True)]
    held_m_s = math.hypot(*swing.velocity_m_s)
    side = math.copysign(1.0, _across(along, swing.place_m))
    time_s, turned_s, astray_m, speed = 0.0, 0.0, 0.0, held_m_s
    # A velocity that swings past the target is aligned with it, too, but for less than that.
    settling_s = 2.0 * swing.acceleration_m_s2 / swing.jerk_m_s3
    while time_s < _LONGEST_S:
        place, velocity = (axes[0].x, axes[1].x), (axes[0].v, axes[1].v)
        to_go = swing.leg_m[0] - place[0], swing.leg_m[1] - place[1]
        left_m, speed = math.hypot(*to_go), math.hypot(*velocity)
        astray_m = max(astray_m, -side * _across(along, place))
        ahead = (velocity[0] * to_go[0] + velocity[1] * to_go[1]) / (speed * left_m + _ZERO)
        if left_m <= swing.radius_m or time_s - turned_s > settling_s:
            break
        wanted_m_s = _allowed_m_s(swing, left_m)
        if speed > SLOWEST_TURN_M_S and ahead < ALIGNED_COS:
            wanted_m_s = min(held_m_s, wanted_m_s)
            to_go = _steered(along, place, max(swing.radius_m, SHORTEST_L1_M))
            turned_s = time_s
        else:
            held_m_s = wanted_m_s
        part = wanted_m_s / (math.hypot(*to_go) + _ZERO)
        _turn(axes, (part * to_go[0], part * to_go[1]), swing)
        time_s += _STEP_S
    return _Swung(time_s, (axes[0].x, axes[1].x), speed, astray_m)


def _across(along: tuple[float, float], place_m: tuple[float, float]) -> float:
    return along[0] * place_m[1] - along[1] * place_m[0]


def _steered(
    along: tuple[float, float], place_m: tuple[float, float], l1_m: float
) -> tuple[float, float]:
    """Return the way to the point of the leg that is steered for. [m]"""
    beside = _across(along, place_m)
    ahead = math.sqrt(max(l1_m**2 - beside**2, 0.0))
    return ahead * along[0] + beside * along[1], ahead * along[1] - beside * along[0]


def _allowed_m_s(swing: _Swing, left_m: float) -> float:
    half_b = 2.0 * swing.acceleration_m_s2**2 / swing.jerk_m_s3
    square = half_b**2 + 2.0 * swing.acceleration_m_s2 * left_m + swing.final_m_s**2
    return min(max(math.sqrt(square) - half_b, swing.final_m_s), swing.speed_m_s)


class _Axis:
    """One axis of a trajectory (``VelocitySmoothing``)."""

    __slots__ = ("a", "v", "x")

    def __init__(self, place_m: float, velocity_m_s: float) -> None:
        self.x, self.v, self.a = place_m, velocity_m_s, 0.0

    def direction(self, wanted_m_s: float, jerk: float) -> float:
        """Return the sign of the first jerk (``computeDirection``)."""
        left = wanted_m_s - self.v - 0.5 * self.a * abs(self.a) / jerk
        return math.copysign(1.0, left) if abs(left) > _ZERO else math.copysign(1.0, self.a)

    def quickest(self, wanted_m_s: float, jerk: float, most: float) -> tuple[float, float, float]:
        """Return the times of jerk, no jerk and jerk back (``updateDurationsMinimizeTotalTime``). [s]"""
        square = 2.0 * self.a**2 + 4.0 * jerk * (wanted_m_s - self.v)
        first = (0.5 * math.copysign(math.sqrt(max(square, 0.0)), jerk) - self.a) / jerk
        first = max(min(first, (math.copysign(most, jerk) - self.a) / jerk), 0.0)
        peak = self.a + jerk * first
        last = max(peak / jerk, 0.0)
        gained = first * (self.a + 0.5 * jerk * first) + 0.5 * last * peak
        steady = max((wanted_m_s - self.v - gained) / peak, 0.0) if abs(peak) > _ZERO else 0.0
        return first, steady, last

    def in_time(
        self, wanted_m_s: float, jerk: float, most: float, total_s: float
    ) -> tuple[float, float, float]:
        """Return them for a time that is longer (``updateDurationsGivenTotalTime``). [s]"""
        b = jerk * total_s - self.a
        square = b * b + 4.0 * jerk * (self.a * total_s - (wanted_m_s - self.v)) - 2.0 * self.a**2
        if square < 0.0:
            return 0.0, total_s, max(self.a / jerk, 0.0)
        root = math.sqrt(square)
        for one in ((b - root) / (2.0 * jerk), (b + root) / (2.0 * jerk)):
            first = max(one, 0.0)
            last = self.a / jerk + first
            if last >= 0.0 and first + last <= total_s:
                break
        else:
            first = 0.0
        first = min(first, (math.copysign(most, jerk) - self.a) / jerk)
        last = max(self.a / jerk + first, 0.0)
        return first, max(total_s - first - last, 0.0), last

    def advance(self, times_s: tuple[float, float, float], jerk: float) -> None:
        """Move on by a step."""
        left = _STEP_S
        for time_s, own in zip((*times_s, left), (jerk, 0.0, -jerk, 0.0), strict=True):
            t = min(time_s, left)
            self.x += t * (self.v + t * (0.5 * self.a + own * t / 6.0))
            self.v += t * (self.a + 0.5 * own * t)
            self.a += own * t
            left -= t


def _turn(axes: list[_Axis], wanted_m_s: tuple[float, float], swing: _Swing) -> None:
    """Move axes on by a step, both in the time of the slower (``timeSynchronization``)."""
    most = swing.acceleration_m_s2
    jerks = [
        swing.jerk_m_s3 * axis.direction(wanted, swing.jerk_m_s3)
        for axis, wanted in zip(axes, wanted_m_s, strict=True)
    ]
    rows = list(zip(axes, wanted_m_s, jerks, strict=True))
    quickest = [axis.quickest(wanted, jerk, most) for axis, wanted, jerk in rows]
    total_s = max(map(sum, quickest))
    for (axis, wanted, jerk), times in zip(rows, quickest, strict=True):
        if sum(times) < total_s:
            axis.advance(axis.in_time(wanted, jerk, most, total_s), jerk)
        else:
            axis.advance(times, jerk)
