"""Legs that PX4 is not on as it begins them: it swings or weaves onto them, which is stepped in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.findings import Rule, Severity
from planner.flight.motion.kinematics import (
    Columns,
    clipped,
    dot,
    horizontal,
    lengths,
    quotient,
    rows_of,
)
from planner.flight.motion.px4.braking import STILL_M, allowed_speed_m_s, ramp_time_s
from planner.flight.motion.px4.moves import ALIGNED_COS, SHORTEST_L1_M, SLOWEST_TURN_M_S, directions
from planner.flight.motion.px4.stepping import (
    LONGEST_S,
    PERIOD_S,
    AxisLimits,
    SteppedLeg,
    Vector,
    stepped,
)
from planner.flight.motion.px4.turns import turning_legs
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray
    from planner.findings import Finding
    from planner.flight.motion.px4.legs import LegStarts, PlannedLegs, Px4Legs
    from planner.flight.motion.px4.moves import Moves
    from planner.flight.motion.px4.stepping import Swung
    from planner.flight.motion.px4.turns import Turns

_BESIDE_M = 3.0
"""Distance from a leg up to which turns onto it are not stepped. [m]"""
_NEAR = 4.0
"""Way to a target, in the distance steered for, from which a turn is over before it: flown 2.6 m off at 2.7,
11 m at 1.8. [-]"""
_WORTH_S = 0.5
"""Time by which a turn is longer than one that does not shoot across, from which it weaves. [s]"""
_SIMILAR = (0.97, 1.03)
"""Speeds by that, for which a turn is tried, too."""
_SLOW = (0.0, 2.0)
"""The same of a vehicle that has hardly begun to move: PX4's navigator went on sooner or later."""
_BY_CHANCE_S = 3.0
"""Difference of the times of those, from which how a turn ends is a matter of chance. [s]"""
_TWO_WAYS_S = 1.0
"""The same from which one is by the line and one straight: more than 3 % of the speed change. [s]"""
_TWO_WAYS_M = 3.0
"""The same of their places: farther apart than what is flown is from what is predicted. [m]"""
_TOO_FAR = 1.5
"""Way across a leg, in the distance steered for, from which it is not just overshot."""
_AT_REST_BESIDE_M = 1.0
"""Distance from a leg up to which it is straight from rest: from 3 m it gets 5.5 m off that. [m]"""
_STOPS_OFF_M = 0.5
"""By which a vehicle stops elsewhere: flown 0.5 m from where it was predicted. [m]"""
_DIGITS = 3
"""Of places and speeds stepped from."""
_TRIED_DIGITS = 1
"""The same of what is tried besides, which is no more exact."""
_NAVIGATED_S = 0.1
"""Time for which a LOITER_TO_ALT is flown that is reached at once: two runs of PX4's navigator. [s]"""
_COARSE_S = 0.1
"""Period that does for returns, of which there are many, and where nothing is left to chance. [s]"""
_FARTHEST_M = 10_000.0
"""Way up to which it is stepped how a waypoint is swung over at its end."""
_LOW_M = 3.0
"""Change of height up to which a LOITER_TO_ALT is over before its speed is steady. [m]"""


WEAVES = Rule(
    "T125 weaves",
    Severity.ERROR,
    summary="PX4 weaves across a leg that it begins too fast, or at rest, from too far beside it.",
    why="A waypoint passed at an acceptance radius that is greater than the next one's, or a LOITER_TO_ALT "
    "passed by its radius, leaves the vehicle beside its new leg.  PX4 steers straight at that from farther "
    "off than max(r, 5 m), at the speed it has (PositionSmoothing::_getL1Point), and shoots across where it "
    "cannot turn within that: flown at 8 m/s, from 20 m before a turn of 45° to a place with 2 m, it weaved "
    "18 m to either side, for 85 s longer and 600 m of way for 187 m.",
    how="The turn, with the wait for the heading before it (MPC_YAW_MODE 4), is stepped as PX4 steps its "
    "trajectory: an error where it gets farther across the leg than "
    "half as much again as the distance steered for, or where 3 % of the speed, or after a wait half a "
    "metre of its place, change its time by more than 3 s; a warning where a tenth of a second does so "
    "that a LOITER_TO_ALT reached at once is flown, where after a wait they change it by more than 1 s, or "
    "either its way by more than 3 m.  An error, too, behind a LOITER_TO_ALT with "
    "parameter 4, left by a tangent (a place within its circle has none, but a line from beyond it), where "
    "the vehicle comes to that from farther beside than the distance steered for, and less than that and the "
    "way to stop before its end, or beyond it: PX4 steers on along it (flown 2.4 km past the place).",
    fix="give the place flown to as large a radius, or the one before a smaller one, or fly slower; give a "
    "LOITER_TO_ALT a small radius (parameter 2), 0 as parameter 4, or another height than the vehicle has",
)


class Weaves(Columns, eq=False):
    """How legs are stepped that are, as columns of length n."""

    is_stepped: BoolArray
    is_held: BoolArray
    """Stepped through the hold at their end, too."""
    astray_m: FloatArray
    """How far across their legs those shoot that weave; 0 for others. [m]"""
    is_open: BoolArray
    """Whether it is open if they are flown to at once or beside their line first."""
    is_chance: BoolArray
    """Whether that is worth an error."""
    end_m: FloatArray
    """Where stepping ends. (n, 3) [m]"""
    end_m_s: FloatArray
    """(n, 3) [m s⁻¹]"""
    end_m_s2: FloatArray
    """Acceleration there. (n, 3) [m s⁻²]"""
    swung: npt.NDArray[Any]
    """`Swung` of those stepped."""

    @classmethod
    def none(cls, count: int) -> Weaves:
        """Return that of legs of which none is stepped."""
        end_m, end_m_s, end_m_s2 = np.zeros((3, count, 3))
        return cls(
            is_stepped=np.zeros(count, dtype=np.bool_),
            is_held=np.zeros(count, dtype=np.bool_),
            astray_m=np.zeros(count),
            is_open=np.zeros(count, dtype=np.bool_),
            is_chance=np.zeros(count, dtype=np.bool_),
            end_m=end_m,
            end_m_s=end_m_s,
            end_m_s2=end_m_s2,
            swung=np.full(count, None),
        )

    def step(self, row: int, relative: Swung, target_m: FloatArray, turns: Turns) -> None:
        """Overwrite the turn of a leg by how it was stepped."""
        swung = replace(relative, place_m=relative.place_m + target_m)
        reached = int(np.searchsorted(swung.time_s, swung.reached_s))
        self.is_stepped[row], self.swung[row] = True, swung
        self.end_m[row], self.end_m_s[row] = swung.place_m[-1], swung.velocity_m_s[-1]
        self.end_m_s2[row] = swung.acceleration_m_s2
        turns.duration_s[row], turns.end_m[row] = swung.reached_s, swung.place_m[reached]
        heading, _ = np.hsplit(swung.velocity_m_s[reached], [2])
        turns.speed_m_s[row] = speed_m_s = np.hypot(*heading)
        along_m_s2 = quotient(np.dot(heading, swung.acceleration_m_s2[:2]), speed_m_s)
        turns.acceleration_m_s2[row] = max(float(along_m_s2), 0.0)

    def tell(self, row: int, several: Sequence[Swung], too_far_m: float) -> None:
        """Let a leg be told of as an error: it is weaved across, or which way it is flown is open."""
        most_m = max(one.astray_m for one in several)
        if most_m > too_far_m:
            self.astray_m[row] = most_m
        else:
            self.is_open[row] = self.is_chance[row] = True


def weave(begun: LegStarts, turns: Turns) -> Weaves:
    """Overwrite turns of legs that vehicles begin beside, and return how these are stepped.

    Notes
    -----
    ``PositionSmoothing::_getL1Point`` steers straight at a leg farther off than max(r, 5 m), and the speed
    is held until the velocity is within 11.5° of the target (``_generateVelocitySetpoint``): what takes more
    than that way to turn the velocity shoots across, and back again.  A vehicle gets beside its leg where it
    leaves a waypoint at an acceptance radius that is greater than the next one's.  Flown by a build of PX4 at
    8 m/s, 20 m before a turn of 45°: 18 m beside, 600 m of way for 187 m.

    Slower it comes round, but not by a turn that a formula knows, nor where a target is so near that it is
    flown to straight from its acceptance radius on, before the turn is over: corners are cut by it.  So it is
    where the velocity swings round in more way than it is to the point steered for, as after waypoints with
    a radius of 5 m passed at 3 m/s and more, for which the vehicle still brakes: legs of 25 m at 10 m/s took
    0.45 s longer than by the formula.

    It does so, at any speed, where it leaves a LOITER_TO_ALT by its radius, far from its centre: its line
    begins there, in height as well, and the speed held is that allowed on the way to it.

    Over a waypoint that it is to pass it swings to and fro while it waits to look at a region of interest.
    """
    planned = begun.planned
    weaves = Weaves.none(len(turns.duration_s))
    astray = planned.swings | planned.circles | planned.leaves_circle | planned.leaves_swing
    astray |= horizontal(begun.velocity_m_s) > SLOWEST_TURN_M_S
    if not (astray | (planned.pause_s > 0.0)).any():
        return weaves  # nothing is turned
    flies = (planned.is_leg | planned.is_wait) & ~planned.is_takeoff & (planned.pause_s == 0.0)
    _stand(begun, weaves, turns)
    l1 = np.maximum(planned.radius_m, SHORTEST_L1_M)
    swings = planned.swings & (lengths(planned.target_m - begun.place_m) < _FARTHEST_M)
    for row in rows_of(flies & (swings | _circles(begun, l1))).tolist():
        hold_s = max(float(planned.hold_s[row]), _NAVIGATED_S)
        weaves.step(row, stepped(_swing(begun, row, hold_s=hold_s)), planned.target_m[row], turns)
        weaves.is_held[row] = True
    leaves = planned.is_leg & planned.leaves_circle & ~weaves.is_held
    leaves &= horizontal(begun.place_m - planned.begins_m) > l1
    slow = leaves & (horizontal(begun.velocity_m_s) <= SLOWEST_TURN_M_S)
    beside_m = _beside_m(begun)
    shoots = _shoots(begun, turns, l1, beside_m)
    flies &= ~weaves.is_held
    cuts = _cuts(begun, turns, l1, beside_m)
    turns_on = cuts & ~planned.leaves_circle
    for row in rows_of(flies & ~leaves & ~shoots & (planned.leaves_swing | cuts)).tolist():
        swing = _swing(begun, row, period_s=_COARSE_S)
        swung = stepped(_braking(begun, row, swing) if turns_on[row] else swing)
        weaves.step(row, swung, planned.target_m[row], turns)
    _step_paused(begun, weaves, turns)
    for row in rows_of(flies & (leaves | shoots)).tolist():
        factors = (1.0, *(_SLOW if slow[row] else _SIMILAR))
        several = [
            stepped(_swing(begun, row, factor))
            for factor in (factors if planned.is_from_ground[row] else factors[:1])
        ]
        arrivals_s = [_arrives_s(planned, row, one.reached_s, -one.place_m[-1]) for one in several]
        is_chance = max(arrivals_s) - min(arrivals_s) > _BY_CHANCE_S
        is_chance |= max(one.reached_s for one in several) >= LONGEST_S
        is_apart = slow[row] and _apart_m(several) > _TWO_WAYS_M
        swung = several[0]
        if is_chance or is_apart or not leaves[row]:
            swung = several[int(np.argmax(arrivals_s))]
        unstepped_s = _arrives_s(
            planned, row, turns.duration_s[row], planned.target_m[row] - turns.end_m[row]
        )
        if not leaves[row] and max(arrivals_s) - unstepped_s < _WORTH_S:
            weaves.step(row, several[0], planned.target_m[row], turns)
            continue
        weaves.step(row, swung, planned.target_m[row], turns)
        weaves.is_open[row] = slow[row] and (is_chance or is_apart)
        if (is_chance and not slow[row]) or several[0].astray_m > _TOO_FAR * l1[row]:
            weaves.tell(row, several, _TOO_FAR * l1[row])
    return weaves


def _step_paused(begun: LegStarts, weaves: Weaves, turns: Turns) -> None:
    """Step legs that are begun beside them where a heading is waited for, and what is far from its circle.

    Whether from rest a leg is flown straight or by its line hangs on the course of the first 0.2 m/s: both
    horizontal axes begin with all the jerk there is, at 45° to them (``VelocitySmoothing``), and the line is
    steered for where that is 11.5° off the target.  Flown by a build of PX4 at 8 m/s from 21 m beside: 22.5 m
    off the straight way, and 8 s more.
    """
    planned = begun.planned
    pausing = planned.is_leg & ~planned.is_takeoff & (planned.pause_s > 0.0)
    if not pausing.any():
        return
    there = begun.at_rest(turns.end_m)
    l1 = np.maximum(planned.radius_m, SHORTEST_L1_M)
    circles, beside_m = _circles(there, l1), _beside_m(there)
    slow = horizontal(begun.velocity_m_s) <= SLOWEST_TURN_M_S
    for row in rows_of(pausing & (circles | (beside_m > _AT_REST_BESIDE_M))).tolist():
        hold_s = max(float(planned.hold_s[row]), _NAVIGATED_S) if circles[row] else None
        is_tried = planned.is_from_ground[row] and beside_m[row] > l1[row] and not circles[row]
        several = [stepped(one) for one in _paused(begun, row, hold_s, is_tried=is_tried)]
        arrivals_s = [_arrives_s(planned, row, one.reached_s, -one.place_m[-1]) for one in several]
        differ_s = max(arrivals_s) - min(arrivals_s)
        is_open = differ_s > _TWO_WAYS_S or _apart_m(several) > _TWO_WAYS_M
        swung = several[int(np.argmax(arrivals_s)) if is_open else 0]
        weaves.is_open[row] = is_open
        sure_s = (
            arrivals_s[: len(arrivals_s) - len(_SLOW)] if slow[row] and is_tried else arrivals_s
        )
        if max(sure_s) - min(sure_s) > _BY_CHANCE_S or swung.astray_m > _TOO_FAR * l1[row]:
            weaves.tell(row, several, _TOO_FAR * l1[row])
        # What is tried from near by is flown from where the vehicle is.
        off_m = begun.place_m[row] - planned.target_m[row] - swung.place_m[0]
        left = 1.0 - swung.time_s / (swung.time_s[-1] or 1.0)
        swung = replace(swung, place_m=swung.place_m + left[:, None] * off_m)
        weaves.step(row, swung, planned.target_m[row], turns)
        weaves.is_held[row] = circles[row]


def _paused(
    begun: LegStarts, row: int, hold_s: float | None, *, is_tried: bool
) -> Iterator[SteppedLeg]:
    """Yield what a leg is stepped by that begins with a wait, and where it is tried from what is similar."""
    waits_s = round(float(begun.planned.pause_s[row]), _DIGITS)
    swing = _swing(begun, row, hold_s=hold_s)._replace(waits_s=waits_s)
    yield swing
    if not is_tried:
        return
    near, level = _near(swing), swing.level
    east, north, upward = near.place_m
    for by_m in (_STOPS_OFF_M, -_STOPS_OFF_M):
        yield near._replace(place_m=(east + by_m, north, upward))
        yield near._replace(place_m=(east, north + by_m, upward))
    for factor in _SIMILAR:
        speed_m_s = round(factor * level.speed_m_s, _DIGITS)
        similar = _swing(begun, row, factor)._replace(waits_s=waits_s)
        yield _near(similar)._replace(level=level._replace(speed_m_s=speed_m_s))
    for factor in _SLOW if horizontal(begun.velocity_m_s[row]) <= SLOWEST_TURN_M_S else ():
        yield _near(_swing(begun, row, factor)._replace(waits_s=waits_s))


def _near(swing: SteppedLeg) -> SteppedLeg:
    """Return a leg begun near by, which is the same in each round of a flight."""
    place, velocity, acceleration = (
        _vector(np.array(row), _TRIED_DIGITS)
        for row in (swing.place_m, swing.velocity_m_s, swing.acceleration_m_s2)
    )
    return swing._replace(
        place_m=place,
        velocity_m_s=velocity,
        acceleration_m_s2=acceleration,
        held_m_s=round(swing.held_m_s, _TRIED_DIGITS),
        reach_m=round(swing.reach_m, _TRIED_DIGITS),
        waits_s=round(swing.waits_s, _TRIED_DIGITS),
    )


def _stand(begun: LegStarts, weaves: Weaves, turns: Turns) -> None:
    """Step vehicles that stand at a LOITER_TO_ALT, far from its centre, until they look north.

    The navigator goes on a little after that, in which time the centre is flown to.
    """
    planned = begun.planned
    for row in rows_of(planned.stands).tolist():
        waits_s = float(planned.hold_s[row])
        swing = _swing(begun, row, hold_s=waits_s + _NAVIGATED_S)._replace(waits_s=waits_s)
        weaves.step(row, stepped(swing), planned.target_m[row], turns)
        weaves.is_held[row] = True


def _arrives_s(planned: PlannedLegs, row: int, turn_s: float, way_m: FloatArray) -> float:
    """Return when a vehicle arrives at its full speed after a turn, by the way left. [s]"""
    return turn_s + float(horizontal(way_m)) / float(planned.speed_m_s[row])


def _apart_m(several: Sequence[Swung]) -> float:
    """Return how far from the first way to a target others lead. [m]"""
    ways_m = [np.vstack((one.place_m[:, :2], np.zeros((1, 2)))) for one in several]
    first = ways_m[0]
    return max(
        (max(_off_m(first, other), _off_m(other, first)) for other in ways_m[1:]), default=0.0
    )


def _off_m(way_m: FloatArray, line_m: FloatArray) -> float:
    """Return how far places of a way are from a line through places at most. [m]"""
    parts = np.diff(line_m, axis=0)
    from_m = way_m[:, None] - line_m[:-1]
    along = quotient((from_m * parts).sum(axis=2), (parts * parts).sum(axis=1))
    off = from_m - clipped(along, 0.0, 1.0)[:, :, None] * parts
    return float(np.sqrt((off * off).sum(axis=2)).min(axis=1).max())


def _circles(begun: LegStarts, l1_m: FloatArray) -> BoolArray:
    """Return which legs change their height within a LOITER_TO_ALT's radius, far from its centre."""
    planned, way = begun.planned, begun.planned.target_m - begun.place_m
    low_m = _LOW_M + begun.parameters.altitude_acceptance_m
    low = np.abs(way[:, 2]) <= low_m
    return np.asarray(planned.circles & (horizontal(way) > l1_m) & low)


def _beside_m(begun: LegStarts) -> FloatArray:
    """Return how far beside their legs vehicles begin them. (n,) [m]"""
    begins = begun.planned.begins_m
    leg, from_m = (begun.planned.target_m - begins)[:, :2], (begun.place_m - begins)[:, :2]
    across = np.abs(leg[:, 0] * from_m[:, 1] - leg[:, 1] * from_m[:, 0])
    return quotient(across, horizontal(leg), above=STILL_M)


def _cuts(begun: LegStarts, turns: Turns, l1_m: FloatArray, beside_m: FloatArray) -> BoolArray:
    """Return which legs are begun by turns that no formula knows.

    They begin farther off than the point steered for, are not over before a target with a radius that
    shapes them is near, or swing for a longer way than it is to that point, which moves on meanwhile.
    """
    is_turning, _, speed_m_s = turning_legs(begun)
    planned = begun.planned
    left_m = horizontal(planned.target_m - begun.place_m)
    near = (planned.radius_m >= SHORTEST_L1_M) & (left_m < _NEAR * l1_m) & (beside_m > _BESIDE_M)
    swing_s = ramp_time_s(speed_m_s, begun.parameters.acceleration_m_s2, begun.parameters.jerk_m_s3)
    wide = speed_m_s * np.minimum(swing_s, turns.duration_s) > l1_m
    wide &= ~planned.leaves_circle
    return np.asarray(is_turning & planned.is_leg & (near | (beside_m > l1_m) | wide))


def _shoots(begun: LegStarts, turns: Turns, l1_m: FloatArray, beside_m: FloatArray) -> BoolArray:
    """Return which legs are begun beside them, too fast to stop across them."""
    speed = horizontal(begun.velocity_m_s)
    a, j = begun.parameters.acceleration_m_s2, begun.parameters.jerk_m_s3
    shoots = (turns.duration_s > 0.0) & begun.planned.is_leg & (beside_m > l1_m)
    return np.asarray(shoots & (0.5 * speed * ramp_time_s(speed, a, j) > l1_m))


def _swing(
    begun: LegStarts,
    row: int,
    factor: float = 1.0,
    hold_s: float | None = None,
    *,
    period_s: float = PERIOD_S,
) -> SteppedLeg:
    """Return what a leg is stepped by, begun at so much of its speed."""
    parameters, planned = begun.parameters, begun.planned
    a, j = parameters.acceleration_m_s2, parameters.jerk_m_s3
    velocity = factor * begun.velocity_m_s[row]
    before = (planned.begins_m[row] - begun.place_m[row])[:2]
    own_m_s, left_m = horizontal(begun.velocity_m_s[row]), horizontal(before)
    held_m_s = factor * float(own_m_s)
    is_aligned = np.dot(begun.velocity_m_s[row, :2], before) >= ALIGNED_COS * own_m_s * left_m
    if own_m_s <= SLOWEST_TURN_M_S or is_aligned:
        # It flew to the place before until then, or did not move: its speed is that allowed there.
        allowed_m_s = float(allowed_speed_m_s(left_m, 0.0, a, j))
        if own_m_s > SLOWEST_TURN_M_S:
            allowed_m_s = min(allowed_m_s, float(planned.cruise_before_m_s[row]))
        held_m_s = max(held_m_s, allowed_m_s)
    return SteppedLeg(
        place_m=_vector(begun.place_m[row] - planned.target_m[row]),
        velocity_m_s=_vector(velocity),
        acceleration_m_s2=_vector(factor * begun.acceleration_m_s2[row]),
        begins_m=_vector(planned.begins_m[row] - planned.target_m[row]),
        held_m_s=round(held_m_s, _DIGITS),
        final_m_s=(
            round(float(planned.final_level_m_s[row]), _DIGITS),
            round(float(planned.final_upright_m_s[row]), _DIGITS),
        ),
        radius_m=float(planned.radius_m[row]),
        reach_m=round(float(planned.reach_m[row]), _DIGITS),
        band_m=parameters.altitude_acceptance_m,
        hold_s=hold_s,
        level=AxisLimits(float(planned.speed_m_s[row]), a),
        up=AxisLimits(parameters.climb_speed_m_s, parameters.acceleration_up_m_s2),
        down=AxisLimits(parameters.descent_speed_m_s, parameters.acceleration_down_m_s2),
        jerk_m_s3=j,
        period_s=period_s if planned.is_from_ground[row] else _COARSE_S,
        back_m_s=float(planned.back_m_s[row]) if planned.swings[row] else None,
    )


def _braking(begun: LegStarts, row: int, swing: SteppedLeg) -> SteppedLeg:
    """Return a turn that is begun while the vehicle still brakes for the waypoint before.

    Held is the speed allowed as the turn begins (``_max_speed_previous``): the vehicle is above it until its
    deceleration is taken back.
    """
    parameters, planned = begun.parameters, begun.planned
    before, velocity = (planned.begins_m[row] - begun.place_m[row])[:2], begun.velocity_m_s[row]
    left_m, own_m_s = horizontal(before), horizontal(velocity)
    if np.dot(velocity[:2], before) < ALIGNED_COS * own_m_s * left_m:
        return swing
    allowed_m_s = allowed_speed_m_s(
        left_m, planned.before_m_s[row], parameters.acceleration_m_s2, parameters.jerk_m_s3
    )
    acceleration = begun.acceleration_m_s2[row]
    if not acceleration.any():
        slowing = begun.slowing_m_s2[row] / own_m_s
        acceleration = velocity * (-slowing, -slowing, 0.0)
    return swing._replace(
        is_turn=True,
        acceleration_m_s2=_vector(acceleration),
        held_m_s=round(min(float(allowed_m_s), swing.held_m_s), _DIGITS),
    )


def _vector(row: FloatArray, digits: int = _DIGITS) -> Vector:
    east, north, upward = np.round(row, digits).tolist()
    return east, north, upward


def _leads_past(moves: Moves, legs: Px4Legs) -> BoolArray:
    """Return which legs are begun so far beside the tangent of a circle that it may lead past them. (n,)

    Notes
    -----
    ``PositionSmoothing::_getL1Point`` steers along the line, whether its end is ahead or behind, until the
    place is straight ahead or within the radius.  Flown from 16 to 60 m beside: on for ever with 14 m left
    at 8 m/s, beyond the end at 5 m/s; there with 14 m left at 5 and 6 m/s.
    """
    parameters, planned = legs.parameters, legs.planned
    line, way = (planned.target_m - m for m in (planned.begins_m, legs.place_m))
    line[:, 2] = way[:, 2] = 0.0
    unit, length = directions(line)
    far_m, speed = horizontal(way), horizontal(legs.velocity_m_s)
    left_m = np.where(length > SHORTEST_L1_M, dot(way, unit), 0.0)
    is_ahead = dot(way, legs.velocity_m_s) >= ALIGNED_COS * far_m * speed
    l1 = np.maximum(planned.radius_m, SHORTEST_L1_M)
    is_beside = far_m**2 - left_m**2 > np.maximum(l1, planned.reach_m) ** 2
    fastest, a = np.maximum(speed, planned.speed_m_s), parameters.acceleration_m_s2
    turns_m = l1 + 0.5 * fastest * (fastest / a + a / parameters.jerk_m_s3)
    leads_past = is_beside & (left_m < turns_m) & ~is_ahead & (speed > SLOWEST_TURN_M_S)
    leads_past |= legs.weaves.is_stepped & (legs.turn_s >= LONGEST_S)
    return np.asarray(moves.leaves_tangent & planned.is_leg & leads_past)


def weave_findings(moves: Moves, legs: Px4Legs) -> Iterator[Finding]:
    """Yield each leg that leads past its place, is weaved across, or may be begun in two ways."""
    item, weaves, past = moves.item, legs.weaves, _leads_past(moves, legs)
    for move in rows_of(past).tolist():
        message = (
            "PX4 may fly past this place and on for ever: it leaves the NAV_LOITER_TO_ALT before by a "
            "tangent that leads away where the vehicle comes to it; write 0 in its parameter 4"
        )
        yield WEAVES.finding(message, item=int(item[move]))
    for move in rows_of(weaves.is_open & (weaves.astray_m == 0.0) & ~past).tolist():
        message = (
            "PX4 may fly straight to this place, or first to its line from the place before, which it leaves "
            "from afar and hardly moving: the longer way is predicted"
        )
        severity = None if weaves.is_chance[move] else Severity.WARNING
        yield WEAVES.finding(message, item=int(item[move]), severity=severity)
    for move in rows_of((weaves.astray_m > 0.0) & ~past).tolist():
        message = (
            f"PX4 weaves {weaves.astray_m[move]:.0f} m across its line to this place, for about "
            f"{legs.turn_s[move]:.0f} s: it leaves the place before from too far away"
        )
        yield WEAVES.finding(message, item=int(item[move]))
