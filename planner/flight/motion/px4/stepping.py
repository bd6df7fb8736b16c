"""PX4's trajectory stepped as PX4 steps it, where no formula says how a leg is begun."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.flight.motion.px4.moves import ALIGNED_COS, SHORTEST_L1_M, SLOWEST_TURN_M_S
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray

LONGEST_S = 200.0
"""Time after which it is given up to come onto a leg; beyond that of its way, where it is flown to its end.
[s]"""
PERIOD_S = 0.02
"""Period of PX4's trajectory. [s]"""
_KNOT_S = 0.2
"""Time from one place that is kept to the next. [s]"""
_CLAMPED_M_S = 0.5
"""Below it an axis is limited alone (``clampToXYNorm``, ``clampToZNorm``). [m s⁻¹]"""
_ZERO = 1e-7
_AT_REST = 1e-3
"""Speed [m s⁻¹] and acceleration [m s⁻²] that are none."""
_STEPPED = 1024
"""Legs remembered: a flight is planned in several rounds."""

Vector = tuple[float, float, float]
Knot = tuple[int, Vector, Vector]
"""Steps gone, place and velocity."""


class AxisLimits(NamedTuple):
    """Speed and acceleration of an axis, or of two."""

    speed_m_s: float
    acceleration_m_s2: float


class SteppedLeg(NamedTuple):
    """What a leg is stepped by; places are east, north, up from its target.

    Rounded: the corners of a survey are one.
    """

    place_m: Vector
    velocity_m_s: Vector
    acceleration_m_s2: Vector
    begins_m: Vector
    """Waypoint before, from which the line leads to the target."""
    held_m_s: float
    """Speed allowed before, which is held in a turn (``_max_speed_previous``)."""
    final_m_s: tuple[float, float]
    """Horizontal and vertical speed at the target."""
    radius_m: float
    reach_m: float
    band_m: float
    """Of the height: NAV_MC_ALT_RAD."""
    hold_s: float | None
    """How long it is flown on once the target counts as reached; None: only until it heads for the target."""
    level: AxisLimits
    up: AxisLimits
    down: AxisLimits
    jerk_m_s3: float
    period_s: float
    is_turn: bool = False
    """Whether it is over as soon as the vehicle speeds up towards its target no more."""
    back_m_s: float | None = None
    """Horizontal speed at the target once it is behind, flown to straight (``State::target_behind``); None:
    the line to it is kept."""
    waits_s: float = 0.0
    """How long its velocity is forced to zero first: MPC_YAW_MODE 4 waits for its heading
    (``_yaw_sp_aligned``). [s]"""

    @property
    def longest_s(self) -> float:
        """Time after which it is given up. [s]"""
        if self.hold_s is None:
            return LONGEST_S + self.waits_s
        east, north, up = self.place_m
        way_s = math.hypot(east, north) / self.level.speed_m_s
        rise_s = abs(up) / min(self.up.speed_m_s, self.down.speed_m_s)
        return LONGEST_S + max(way_s, rise_s) + self.hold_s

    @property
    def judged_s(self) -> float:
        """When in a step it is judged what to do in it: PX4's steps are shorter than those of turns. [s]"""
        return 0.5 * self.period_s if self.is_turn else 0.0


class Swung(Value, eq=False):
    """How a leg was stepped."""

    reached_s: float
    """When the target counted as reached, or the vehicle headed for it."""
    time_s: FloatArray
    """Of the k places kept, the last one after the hold. (k,) [s]"""
    place_m: FloatArray
    """From the target. (k, 3) [m]"""
    velocity_m_s: FloatArray
    """(k, 3) [m s⁻¹]"""
    acceleration_m_s2: Vector
    """At the end."""
    astray_m: float
    """How far across the leg, on the side it did not come from. [m]"""


@lru_cache(maxsize=_STEPPED)
def stepped(swing: SteppedLeg) -> Swung:
    """Return a leg stepped until it heads for its target, or for its hold once that is reached."""
    axes = tuple(
        _Axis(*state)
        for state in zip(swing.place_m, swing.velocity_m_s, swing.acceleration_m_s2, strict=True)
    )
    line = _unit(_minus(swing.begins_m))
    side = math.copysign(1.0, _across(line, _less(swing.place_m, swing.begins_m)))
    steps, held_m_s, is_upward = 0, swing.held_m_s, swing.place_m[2] < 0.0
    turned, astray_m, reached, knots, gained = 0, 0.0, -1, [], (0.0, 0.0)
    period_s = swing.period_s
    kept = round(_KNOT_S / period_s)
    waits, longest_s = round(swing.waits_s / period_s), swing.longest_s
    while steps * period_s < longest_s:
        place, velocity = _state(axes)
        astray_m = max(astray_m, -side * _across(line, _less(place, swing.begins_m)))
        is_new = reached < 0 and math.hypot(*place[:2]) <= swing.reach_m
        is_new = is_new and abs(place[2]) <= swing.band_m
        if is_new:
            reached = steps
        if is_new or steps % kept == 0 or steps == waits:
            knots.append((steps, place, velocity))
        if swing.hold_s is None:
            gained, before = _gained_m_s2(axes, velocity), gained
            if is_new or _is_turned(swing, steps - turned, gained, before[0]):
                break
        elif reached >= 0 and (steps - reached) * period_s >= swing.hold_s:
            break
        if steps < waits:
            still = steps % kept == 0 and not any(axis.v or axis.a for axis in axes)
            steps = turned = waits if still else steps + _brake(axes, swing)
            continue
        judged = _later(axes, swing.judged_s)
        wanted, held_m_s, is_turning = _wanted(swing, line, judged, held_m_s, is_upward=is_upward)
        turned = steps if is_turning else turned
        is_upward = wanted[2] > 0.0
        _advance(axes, wanted, swing, swing.up if is_upward else swing.down)
        steps += 1
    if knots[-1][0] != steps:
        knots.append((steps, *_state(axes)))
    if swing.is_turn and reached < 0:
        knots = _straightened(knots, kept, swing)
    east, north, height = axes
    return Swung(
        reached_s=(reached if reached >= 0 else steps) * period_s,
        time_s=np.array([one[0] for one in knots]) * period_s,
        place_m=np.array([one[1] for one in knots]),
        velocity_m_s=np.array([one[2] for one in knots]),
        acceleration_m_s2=(east.a, north.a, height.a),
        astray_m=astray_m,
    )


def _wanted(
    swing: SteppedLeg,
    line: Vector,
    state: tuple[Vector, Vector],
    held_m_s: float,
    *,
    is_upward: bool,
) -> tuple[Vector, float, bool]:
    """Return the velocity wanted at a place, the speed then held in turns, and whether it turns.

    As ``PositionSmoothing::_generateVelocitySetpoint`` does.
    """
    place, velocity = state
    to_go = _minus(place)
    left_m, speed = math.hypot(*to_go[:2]), math.hypot(*velocity[:2])
    vertical = swing.up if is_upward else swing.down
    is_past = swing.back_m_s is not None and line[0] * to_go[0] + line[1] * to_go[1] < 0.0
    final_m_s = swing.back_m_s if swing.back_m_s is not None and is_past else swing.final_m_s[0]
    level_m_s = _allowed_m_s(swing.level, swing.jerk_m_s3, left_m, final_m_s)
    upright_m_s = _allowed_m_s(vertical, swing.jerk_m_s3, abs(to_go[2]), swing.final_m_s[1])
    ahead = (velocity[0] * to_go[0] + velocity[1] * to_go[1]) / (speed * left_m + _ZERO)
    is_turning = speed > SLOWEST_TURN_M_S and ahead < ALIGNED_COS and left_m > swing.radius_m
    if is_turning:
        level_m_s = min(held_m_s, level_m_s)
        to_go = to_go if is_past else _less(_steered_m(swing, line, place), place)
    else:
        held_m_s = level_m_s
    return _clamped_m_s(_unit(to_go), level_m_s, upright_m_s), held_m_s, is_turning


def _brake(axes: tuple[_Axis, ...], swing: SteppedLeg) -> int:
    """Brake for a step, which is returned; what is next to nothing is none."""
    if any(axis.v or axis.a for axis in axes):
        _advance(axes, (0.0, 0.0, 0.0), swing, swing.up if axes[2].v < 0.0 else swing.down)
    for axis in axes:
        if abs(axis.v) + abs(axis.a) < _AT_REST:
            axis.v = axis.a = 0.0
    return 1


def _gained_m_s2(axes: tuple[_Axis, ...], velocity_m_s: Vector) -> tuple[float, float]:
    """Return the horizontal acceleration along a velocity, and how much of it is across."""
    east, north, _ = _unit((velocity_m_s[0], velocity_m_s[1], 0.0))
    along = east * axes[0].a + north * axes[1].a
    return along, abs(east * axes[1].a - north * axes[0].a)


def _is_turned(
    swing: SteppedLeg, steps: int, gained_m_s2: tuple[float, float], before_m_s2: float
) -> bool:
    """Return whether a leg goes on straight from where it has headed for its target for some steps.

    A velocity that swings past the target is aligned with it, too, but for less than a change of acceleration
    from one side to the other takes.  One that speeds up more than it turns does not swing past; it speeds up
    less only to keep its speed, or to brake again, which a straight knows from there on.
    """
    along, aside = gained_m_s2
    is_settled = steps * swing.period_s > 2.0 * swing.level.acceleration_m_s2 / swing.jerk_m_s3
    if not swing.is_turn:
        return is_settled
    return (is_settled and along >= 0.0) or (steps > 1 and aside < along < before_m_s2)


def _straightened(knots: list[Knot], kept: int, swing: SteppedLeg) -> list[Knot]:
    """Return places of which the last is left straight towards the target.

    What is across its way then dies away before, which takes the longer, the more it is.
    """
    steps, place, velocity = knots[-1]
    left_m = math.hypot(*place[:2]) + _ZERO
    speed = -(place[0] * velocity[0] + place[1] * velocity[1]) / left_m
    towards = -place[0] * speed / left_m, -place[1] * speed / left_m, -place[2] * speed / left_m
    dying_s = 2.0 * math.sqrt(math.dist(velocity, towards) / swing.jerk_m_s3)
    last = steps - max(kept, dying_s / swing.period_s)
    first = [one for one in knots[:-1] if one[0] <= last]
    return [*(first or knots[:1]), (steps, place, towards)]


def _later(axes: tuple[_Axis, ...], time_s: float) -> tuple[Vector, Vector]:
    """Return place and velocity after a time at the accelerations there are."""
    east, north, height = axes
    return (
        (
            east.x + time_s * (east.v + 0.5 * time_s * east.a),
            north.x + time_s * (north.v + 0.5 * time_s * north.a),
            height.x + time_s * (height.v + 0.5 * time_s * height.a),
        ),
        (east.v + time_s * east.a, north.v + time_s * north.a, height.v + time_s * height.a),
    )


def _state(axes: tuple[_Axis, ...]) -> tuple[Vector, Vector]:
    east, north, height = axes
    return (east.x, north.x, height.x), (east.v, north.v, height.v)


def _less(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def _minus(way: Vector) -> Vector:
    return -way[0], -way[1], -way[2]


def _unit(way: Vector) -> Vector:
    length = math.hypot(*way) + _ZERO
    return way[0] / length, way[1] / length, way[2] / length


def _across(line: Vector, place_m: Vector) -> float:
    level = math.hypot(*line[:2]) + _ZERO
    return (line[0] * place_m[1] - line[1] * place_m[0]) / level


def _steered_m(swing: SteppedLeg, line: Vector, place_m: Vector) -> Vector:
    """Return the point of the leg that is steered for (``_getL1Point``)."""
    from_m, begin = _less(place_m, swing.begins_m), swing.begins_m
    along = from_m[0] * line[0] + from_m[1] * line[1] + from_m[2] * line[2]
    beside = math.sqrt(max(math.hypot(*from_m) ** 2 - along**2, 0.0))
    along += math.sqrt(max(max(swing.radius_m, SHORTEST_L1_M) ** 2 - beside**2, 0.0))
    return begin[0] + along * line[0], begin[1] + along * line[1], begin[2] + along * line[2]


def _allowed_m_s(limits: AxisLimits, jerk_m_s3: float, left_m: float, final_m_s: float) -> float:
    a = limits.acceleration_m_s2
    half_b = 2.0 * a**2 / jerk_m_s3
    allowed = math.sqrt(half_b**2 + 2.0 * a * left_m + final_m_s**2) - half_b
    return min(max(allowed, final_m_s), limits.speed_m_s)


def _clamped_m_s(unit: Vector, level_m_s: float, upright_m_s: float) -> Vector:
    """Return the velocity in a direction that keeps to both limits (``_generateVelocitySetpoint``)."""
    whole = math.hypot(level_m_s, upright_m_s)
    east, north, upward = whole * unit[0], whole * unit[1], whole * unit[2]
    level = math.hypot(east, north)
    if level > level_m_s:
        part = level_m_s / level
        east, north = part * east, part * north
        if max(level_m_s, level) >= _CLAMPED_M_S:
            upward *= part
    if abs(upward) > upright_m_s:
        part = upright_m_s / abs(upward)
        if max(upright_m_s, abs(upward)) >= _CLAMPED_M_S:
            east, north = part * east, part * north
        upward *= part
    return east, north, upward


class _Axis:
    """One axis of a trajectory (``VelocitySmoothing``)."""

    __slots__ = ("a", "v", "x")

    def __init__(self, place_m: float, velocity_m_s: float, acceleration_m_s2: float) -> None:
        self.x, self.v, self.a = place_m, velocity_m_s, acceleration_m_s2

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

    def advance(self, times_s: tuple[float, float, float], jerk: float, period_s: float) -> None:
        """Move on by a step."""
        left = period_s
        for time_s, own in zip((*times_s, left), (jerk, 0.0, -jerk, 0.0), strict=True):
            t = min(time_s, left)
            if not t:
                continue
            self.x += t * (self.v + t * (0.5 * self.a + own * t / 6.0))
            self.v += t * (self.a + 0.5 * own * t)
            self.a += own * t
            left -= t


def _advance(
    axes: tuple[_Axis, ...], wanted_m_s: Vector, swing: SteppedLeg, vertical: AxisLimits
) -> None:
    """Move axes on by a step, all in the time of the slowest (``timeSynchronization``)."""
    level = swing.level.acceleration_m_s2
    rows = []
    for axis, wanted, most in zip(
        axes, wanted_m_s, (level, level, vertical.acceleration_m_s2), strict=True
    ):
        if not (wanted or axis.v or axis.a):
            continue
        jerk = swing.jerk_m_s3 * axis.direction(wanted, swing.jerk_m_s3)
        rows.append((axis, wanted, jerk, most, axis.quickest(wanted, jerk, most)))
    total_s = max(sum(row[-1]) for row in rows)
    for axis, wanted, jerk, most, times in rows:
        if sum(times) < total_s:
            axis.advance(axis.in_time(wanted, jerk, most, total_s), jerk, swing.period_s)
        else:
            axis.advance(times, jerk, swing.period_s)
