r"""Motion of a vehicle that flies ramps of its own: constant acceleration, speed, constant braking.

Each leg begins and ends standing still.  A way L at speed v with acceleration a and braking b takes

.. math:: t = L / v + \tfrac{1}{2} v (1/a + 1/b), \quad L \ge \tfrac{1}{2} v^2 (1/a + 1/b),

and where it is shorter, the speed peaks at :math:`\sqrt{2 L a b / (a + b)}`.  Climbing comes before and
descending after the level leg, as for step responses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import STATE_INDEX, FlightState, PolynomialLaw
from planner.flight.motion.steps import (
    ACCELERATE,
    BRAKE,
    CLIMB,
    CRUISE,
    DESCEND,
    HOLD,
    SLOTS,
    START,
    STOP,
    WAIT,
    StepPieces,
    fly_circles,
    join_parts,
    make_part,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion
    from planner.flight.motion.steps import StepLegs, StepPart
    from planner.vehicle.model import Ramps

_UP = np.array([0.0, 0.0, 1.0])


def fly_ramps(legs: StepLegs, ramps: Ramps) -> Motion:
    """Return how a vehicle that flies ramps of its own follows legs, at least one."""
    parts = [*_vertical(legs, ramps), *_level(legs, ramps), *_standing(legs, ramps)]
    return join_parts(legs, [*parts, fly_circles(legs)])[0]


def _vertical(legs: StepLegs, ramps: Ramps) -> Iterator[StepPart]:
    """Yield climbs, and descents with the two parts of landings."""
    rise = legs.end_m[:, 2] - legs.start_m[:, 2]
    up, down = np.flatnonzero(rise > 0.0), np.flatnonzero(rise < 0.0)
    climb = _ramp(rise[up], np.full(len(up), ramps.climb_m_s), ramps)
    yield _straight(up * SLOTS + CLIMB, legs.climb_state[up], legs.start_m[up], _UP, climb)
    place = legs.end_m[down].copy()
    place[:, 2] = legs.start_m[down, 2]
    is_landing = legs.descent_state[down] == STATE_INDEX[FlightState.LAND]
    slow_m = np.where(is_landing, np.minimum(-rise[down], ramps.landing_height_m), 0.0)
    fast_m = -rise[down] - slow_m
    descent = _ramp(fast_m, np.full(len(down), ramps.descent_m_s), ramps)
    speed = np.minimum(ramps.landing_m_s, np.sqrt(2.0 * ramps.acceleration_m_s2 * slow_m))
    gained_s = speed / ramps.acceleration_m_s2
    gained_m = 0.5 * speed * gained_s
    steady_s = np.divide(slow_m - gained_m, speed, out=np.zeros_like(speed), where=speed > 0.0)
    zero = np.zeros_like(speed)
    slow = _pieces(
        (gained_s, steady_s),
        begins_m=(fast_m, fast_m + gained_m),
        begins_m_s=(zero, speed),
        acceleration_m_s2=(zero + ramps.acceleration_m_s2, zero),
    )
    both = np.concatenate((descent, slow), axis=1)
    yield _straight(down * SLOTS + DESCEND, legs.descent_state[down], place, -_UP, both)


def _pieces(
    duration_s: tuple[FloatArray, ...],
    *,
    begins_m: tuple[FloatArray, ...],
    begins_m_s: tuple[FloatArray, ...],
    acceleration_m_s2: tuple[FloatArray, ...],
) -> FloatArray:
    """Return duration, way, speed and acceleration at the beginning of k pieces. (n, k, 4)"""
    columns = (duration_s, begins_m, begins_m_s, acceleration_m_s2)
    return np.stack([np.column_stack(column) for column in columns], axis=-1)


def _ramp(way_m: FloatArray, speed_m_s: FloatArray, ramps: Ramps) -> FloatArray:
    """Return the three pieces from rest to rest. (n, 3, 4)"""
    a, b = ramps.acceleration_m_s2, ramps.braking_m_s2
    peak = np.minimum(speed_m_s, np.sqrt(2.0 * way_m * a * b / (a + b)))
    gained_m, lost_m = 0.5 * peak**2 / a, 0.5 * peak**2 / b
    steady_m = np.maximum(way_m - gained_m - lost_m, 0.0)
    steady_s = np.divide(steady_m, peak, out=np.zeros_like(peak), where=peak > 0.0)
    zero = np.zeros_like(peak)
    return _pieces(
        (peak / a, steady_s, peak / b),
        begins_m=(zero, gained_m, gained_m + steady_m),
        begins_m_s=(zero, peak, peak),
        acceleration_m_s2=(zero + a, zero, zero - b),
    )


def _level(legs: StepLegs, ramps: Ramps) -> Iterator[StepPart]:
    """Yield accelerations, cruises and brakes of the level legs."""
    way = legs.end_m[:, :2] - legs.start_m[:, :2]
    length = np.hypot(way[:, 0], way[:, 1])
    stage = np.flatnonzero(length > 0.0)
    direction = np.zeros((len(stage), 3))
    direction[:, :2] = way[stage] / length[stage, None]
    start = legs.start_m[stage].copy()
    start[:, 2] = np.maximum(start[:, 2], legs.end_m[stage, 2])
    pieces = _ramp(length[stage], legs.speed_m_s[stage], ramps)
    stop_m = 0.5 * pieces[:, 1, 2] ** 2 / ramps.braking_m_s2
    for piece, (slot, state, stopping_m) in enumerate(
        (
            (ACCELERATE, FlightState.ACCELERATE, stop_m * np.nan),
            (CRUISE, FlightState.CRUISE, stop_m),
            (BRAKE, FlightState.BRAKE, stop_m),
        )
    ):
        order = stage * SLOTS + slot
        one = pieces[:, [piece]]
        yield _straight(order, state, start, direction, one, stopping_distance_m=stopping_m)


def _standing(legs: StepLegs, ramps: Ramps) -> Iterator[StepPart]:
    """Yield what is spent standing: on the ground, before legs, and as the mission asks."""
    way = legs.end_m - legs.start_m
    is_leg = np.hypot(way[:, 0], way[:, 1]) > 0.0
    climbs = way[:, 2] > 0.0
    has_climbed = climbs | np.concatenate(([False], (climbs & ~is_leg)[:-1]))
    wait_s = np.where(has_climbed, ramps.climb_wait_s, ramps.turn_wait_s)
    takes_off = climbs & (legs.climb_state == STATE_INDEX[FlightState.TAKEOFF])
    lands = legs.descent_state == STATE_INDEX[FlightState.LAND]
    aloft = legs.start_m.copy()
    aloft[:, 2] = np.maximum(aloft[:, 2], legs.end_m[:, 2])
    hover, zero = np.full(len(is_leg), STATE_INDEX[FlightState.HOVER]), np.zeros(len(is_leg))
    for chosen, slot, state, place_m, duration_s in (
        (takes_off, START, legs.climb_state, legs.start_m, zero + ramps.start_s),
        (is_leg, WAIT, hover, aloft, wait_s),
        (lands, STOP, legs.descent_state, legs.end_m, zero + ramps.stop_s),
        ((legs.hold_s > 0.0) & ~lands, HOLD, hover, legs.end_m, legs.hold_s),
        ((legs.hold_s > 0.0) & lands, HOLD, legs.descent_state, legs.end_m, legs.hold_s),
    ):
        stage = np.flatnonzero(chosen)
        pieces = np.zeros((len(stage), 1, 4))
        pieces[:, 0, 0] = duration_s[stage]
        order = stage * SLOTS + slot
        is_grounded = slot in {START, STOP} or state is legs.descent_state
        yield _straight(
            order, state[stage], place_m[stage], 0.0 * _UP, pieces, is_grounded=is_grounded
        )


def _straight(
    order: IntArray,
    state: IntArray | FlightState,
    start_m: FloatArray,
    direction: FloatArray,
    pieces: FloatArray,
    *,
    is_grounded: bool = False,
    **columns: FloatArray,
) -> StepPart:
    """Return segments straight ahead from places, each of k pieces (n, k, 4)."""
    along = np.broadcast_to(direction, start_m.shape)
    t, begins_m, speed, acceleration = np.moveaxis(pieces, -1, 0)
    coefficients = np.zeros((*t.shape, 3, 4))
    coefficients[..., 0] = start_m[:, None] + along[:, None] * begins_m[..., None]
    coefficients[..., 1] = along[:, None] * speed[..., None]
    coefficients[..., 2] = 0.5 * along[:, None] * acceleration[..., None]
    way_m = (t * (speed + 0.5 * acceleration * t)).sum(axis=1)
    top = np.maximum(speed, speed + acceleration * t).max(axis=1, initial=0.0)
    return make_part(
        PolynomialLaw(coefficients=coefficients.reshape(-1, 3, 4)),
        order,
        state,
        t.sum(axis=1),
        pieces=StepPieces(
            segment=np.repeat(np.arange(len(t)), t.shape[1]),
            row=np.arange(t.size),
            offset_s=np.zeros(t.size),
            duration_s=t.ravel(),
            is_grounded=np.full(t.size, is_grounded),
        ),
        distance_m=way_m * np.hypot(along[:, 0], along[:, 1]),
        climb_m=way_m * along[:, 2],
        speed_m_s=top,
        **columns,
    )
