r"""Motion of a vehicle that flies ramps of its own: constant acceleration, speed, constant braking.

Each leg begins and ends standing still.  A way L at speed v with acceleration a and braking b takes

.. math:: t = L / v + \tfrac{1}{2} v (1/a + 1/b), \quad L \ge \tfrac{1}{2} v^2 (1/a + 1/b),

and where it is shorter, the speed peaks at :math:`\sqrt{2 L a b / (a + b)}`.  Climbing comes before and
descending after the level leg, as for step responses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import (
    STATE_INDEX,
    CircleLaw,
    FlightState,
    Motion,
    PolynomialLaw,
    SegmentColumns,
)
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.steps import StepLegs
    from planner.vehicle.model import Ramps

_START, _CLIMB, _WAIT, _ACCELERATE, _CRUISE, _BRAKE, _CIRCLE, _DESCEND, _STOP, _HOLD, _SLOTS = (
    range(11)
)


class _Pieces(Value, eq=False):
    """Pieces in a straight line, one row per segment. (n, k)"""

    duration_s: FloatArray
    begins_m: FloatArray
    """Way at the beginning of each piece. [m]"""
    begins_m_s: FloatArray
    acceleration_m_s2: FloatArray

    def only(self, piece: int) -> _Pieces:
        """Return one piece of each row."""
        return _Pieces(
            duration_s=self.duration_s[:, [piece]],
            begins_m=self.begins_m[:, [piece]],
            begins_m_s=self.begins_m_s[:, [piece]],
            acceleration_m_s2=self.acceleration_m_s2[:, [piece]],
        )

    def followed_by(self, other: _Pieces) -> _Pieces:
        """Return both, one after the other."""
        return _Pieces(
            duration_s=np.hstack((self.duration_s, other.duration_s)),
            begins_m=np.hstack((self.begins_m, other.begins_m)),
            begins_m_s=np.hstack((self.begins_m_s, other.begins_m_s)),
            acceleration_m_s2=np.hstack((self.acceleration_m_s2, other.acceleration_m_s2)),
        )


class _Part(Value, eq=False):
    """Segments of one kind, one per row, each of k pieces in a straight line."""

    stage: IntArray
    slot: int
    state: IntArray
    start_m: FloatArray
    """(n, 3) [m]"""
    direction: FloatArray
    """(n, 3)"""
    pieces: _Pieces
    stopping_distance_m: FloatArray
    is_grounded: bool = False

    @property
    def way_m(self) -> FloatArray:
        """Way of each segment. (n,) [m]"""
        pieces, t = self.pieces, self.pieces.duration_s
        ways = t * (pieces.begins_m_s + 0.5 * pieces.acceleration_m_s2 * t)
        total: FloatArray = ways.sum(axis=1)
        return total

    @property
    def coefficients(self) -> FloatArray:
        """Rising powers of the pieces' own times, as `PolynomialLaw` has them. (n, k, 3, 4)"""
        pieces = self.pieces
        rows = np.zeros((*pieces.duration_s.shape, 3, 4))
        along = self.direction[:, None, :]
        rows[..., 0] = self.start_m[:, None, :] + along * pieces.begins_m[..., None]
        rows[..., 1] = along * pieces.begins_m_s[..., None]
        rows[..., 2] = 0.5 * along * pieces.acceleration_m_s2[..., None]
        return rows


def fly_ramps(legs: StepLegs, ramps: Ramps) -> Motion:
    """Return how a vehicle that flies ramps of its own follows legs.

    Parameters
    ----------
    legs : StepLegs
        At least one.
    ramps : Ramps
        Speeds, accelerations and waits.

    Returns
    -------
    Motion
        Segments and pieces in closed form.
    """
    parts = [*_vertical(legs, ramps), *_level(legs, ramps), *_standing(legs, ramps)]
    circles = np.flatnonzero(legs.turns > 0.0)
    return _joined(legs, parts, circles)


def _vertical(legs: StepLegs, ramps: Ramps) -> list[_Part]:
    """Return climbs, descents, and the two parts of landings."""
    rise = legs.end_m[:, 2] - legs.start_m[:, 2]
    up, down = np.flatnonzero(rise > 0.0), np.flatnonzero(rise < 0.0)
    place = legs.end_m[down].copy()
    place[:, 2] = legs.start_m[down, 2]
    is_landing = legs.descent_state[down] == STATE_INDEX[FlightState.LAND]
    slow_m = np.where(is_landing, np.minimum(-rise[down], ramps.landing_height_m), 0.0)
    fast_m = -rise[down] - slow_m
    climb = _ramp(rise[up], np.full(len(up), ramps.climb_m_s), ramps)
    descent = _ramp(fast_m, np.full(len(down), ramps.descent_m_s), ramps)
    speed = np.minimum(ramps.landing_m_s, np.sqrt(2.0 * ramps.acceleration_m_s2 * slow_m))
    gained_s = speed / ramps.acceleration_m_s2
    gained_m = 0.5 * speed * gained_s
    steady_s = np.divide(slow_m - gained_m, speed, out=np.zeros_like(speed), where=speed > 0.0)
    slow = _Pieces(
        duration_s=np.column_stack((gained_s, steady_s)),
        begins_m=np.column_stack((fast_m, fast_m + gained_m)),
        begins_m_s=np.column_stack((np.zeros_like(speed), speed)),
        acceleration_m_s2=np.tile((ramps.acceleration_m_s2, 0.0), (len(down), 1)),
    )
    return [
        _Part(
            stage=up,
            slot=_CLIMB,
            state=legs.climb_state[up],
            start_m=legs.start_m[up],
            direction=np.tile((0.0, 0.0, 1.0), (len(up), 1)),
            pieces=climb,
            stopping_distance_m=np.full(len(up), np.nan),
        ),
        _Part(
            stage=down,
            slot=_DESCEND,
            state=legs.descent_state[down],
            start_m=place,
            direction=np.tile((0.0, 0.0, -1.0), (len(down), 1)),
            pieces=descent.followed_by(slow),
            stopping_distance_m=np.full(len(down), np.nan),
        ),
    ]


def _ramp(way_m: FloatArray, speed_m_s: FloatArray, ramps: Ramps) -> _Pieces:
    """Return the three pieces from rest to rest."""
    a, b = ramps.acceleration_m_s2, ramps.braking_m_s2
    peak = np.minimum(speed_m_s, np.sqrt(2.0 * way_m * a * b / (a + b)))
    gained_m, lost_m = 0.5 * peak**2 / a, 0.5 * peak**2 / b
    steady_m = np.maximum(way_m - gained_m - lost_m, 0.0)
    steady_s = np.divide(steady_m, peak, out=np.zeros_like(peak), where=peak > 0.0)
    zero = np.zeros_like(peak)
    return _Pieces(
        duration_s=np.column_stack((peak / a, steady_s, peak / b)),
        begins_m=np.column_stack((zero, gained_m, gained_m + steady_m)),
        begins_m_s=np.column_stack((zero, peak, peak)),
        acceleration_m_s2=np.column_stack((zero + a, zero, zero - b)),
    )


def _level(legs: StepLegs, ramps: Ramps) -> list[_Part]:
    """Return accelerations, cruises and brakes of the level legs."""
    way = legs.end_m[:, :2] - legs.start_m[:, :2]
    length = np.hypot(way[:, 0], way[:, 1])
    stage = np.flatnonzero(length > 0.0)
    direction = np.zeros((len(stage), 3))
    direction[:, :2] = way[stage] / length[stage, None]
    start = legs.start_m[stage].copy()
    start[:, 2] = np.maximum(start[:, 2], legs.end_m[stage, 2])
    pieces = _ramp(length[stage], legs.speed_m_s[stage], ramps)
    stop_m = 0.5 * pieces.begins_m_s[:, 1] ** 2 / ramps.braking_m_s2
    states = (FlightState.ACCELERATE, FlightState.CRUISE, FlightState.BRAKE)
    return [
        _Part(
            stage=stage,
            slot=slot,
            state=np.full(len(stage), STATE_INDEX[state]),
            start_m=start,
            direction=direction,
            pieces=pieces.only(piece),
            stopping_distance_m=(
                np.full(len(stage), np.nan) if state is FlightState.ACCELERATE else stop_m
            ),
        )
        for piece, (slot, state) in enumerate(
            zip((_ACCELERATE, _CRUISE, _BRAKE), states, strict=True)
        )
    ]


def _standing(legs: StepLegs, ramps: Ramps) -> list[_Part]:
    """Return what is spent standing: on the ground, before legs, and as the mission asks."""
    way = legs.end_m - legs.start_m
    is_leg = np.hypot(way[:, 0], way[:, 1]) > 0.0
    climbs = way[:, 2] > 0.0
    has_climbed = climbs | np.concatenate(([False], (climbs & ~is_leg)[:-1]))
    wait_s = np.where(has_climbed, ramps.climb_wait_s, ramps.turn_wait_s)
    takes_off = climbs & (legs.climb_state == STATE_INDEX[FlightState.TAKEOFF])
    lands = legs.descent_state == STATE_INDEX[FlightState.LAND]
    aloft = legs.start_m.copy()
    aloft[:, 2] = np.maximum(aloft[:, 2], legs.end_m[:, 2])
    hover = np.full(len(is_leg), STATE_INDEX[FlightState.HOVER])
    return [
        _stand(takes_off, _START, legs.climb_state, legs.start_m, ramps.start_s, is_grounded=True),
        _stand(is_leg, _WAIT, hover, aloft, wait_s),
        _stand(lands, _STOP, legs.descent_state, legs.end_m, ramps.stop_s, is_grounded=True),
        _stand(legs.hold_s > 0.0, _HOLD, hover, legs.end_m, legs.hold_s),
    ]


def _stand(
    chosen: BoolArray,
    slot: int,
    state: IntArray,
    place_m: FloatArray,
    duration_s: FloatArray | float,
    *,
    is_grounded: bool = False,
) -> _Part:
    stage = np.flatnonzero(chosen)
    zero = np.zeros((len(stage), 1))
    return _Part(
        stage=stage,
        slot=slot,
        state=state[stage],
        start_m=place_m[stage],
        direction=np.zeros((len(stage), 3)),
        pieces=_Pieces(
            duration_s=np.broadcast_to(duration_s, chosen.shape)[stage][:, None],
            begins_m=zero,
            begins_m_s=zero,
            acceleration_m_s2=zero,
        ),
        stopping_distance_m=np.full(len(stage), np.nan),
        is_grounded=is_grounded,
    )


def _joined(legs: StepLegs, parts: list[_Part], circles: IntArray) -> Motion:
    """Return parts and circles in flown order."""
    radius = np.abs(legs.circle_m[circles])
    speed = legs.speed_m_s[circles]
    round_m = legs.turns[circles] * 2.0 * np.pi * radius
    count = len(circles)
    order = np.concatenate(
        [part.stage * _SLOTS + part.slot for part in parts] + [circles * _SLOTS + _CIRCLE]
    )
    flown = np.argsort(order, kind="stable")
    place = np.empty_like(flown)
    place[flown] = np.arange(len(flown))
    whole = [part.pieces.duration_s.sum(axis=1) for part in parts]
    columns: dict[str, list[FloatArray]] = {
        "duration_s": [*whole, round_m / speed],
        "distance_m": [
            *(part.way_m * np.hypot(part.direction[:, 0], part.direction[:, 1]) for part in parts),
            round_m,
        ],
        "climb_m": [*(part.way_m * part.direction[:, 2] for part in parts), np.zeros(count)],
        "speed_m_s": [*(_top_m_s(part) for part in parts), speed],
        "stopping_distance_m": [
            *(part.stopping_distance_m for part in parts),
            np.full(count, np.nan),
        ],
    }
    state = np.concatenate(
        [*(part.state for part in parts), np.full(count, STATE_INDEX[FlightState.CRUISE])]
    )
    segments = SegmentColumns(
        item=legs.item[order[flown] // _SLOTS],
        state=state[flown].astype(np.intp),
        **{name: np.concatenate(values)[flown] for name, values in columns.items()},
    )
    piece_segment, piece_law, piece_row, duration, grounded = [], [], [], [], []
    offset = row = 0
    for part in parts:
        n, k = part.pieces.duration_s.shape
        piece_segment.append(np.repeat(place[offset : offset + n], k))
        piece_law.append(np.zeros(n * k, np.intp))
        piece_row.append(np.arange(row, row + n * k))
        duration.append(part.pieces.duration_s.ravel())
        grounded.append(np.full(n * k, part.is_grounded))
        offset, row = offset + n, row + n * k
    piece_segment.append(place[offset:])
    piece_law.append(np.ones(count, np.intp))
    piece_row.append(np.arange(count))
    duration.append(round_m / speed)
    grounded.append(np.zeros(count, np.bool_))
    of_segment = np.concatenate(piece_segment)
    by_segment = np.argsort(of_segment, kind="stable")
    ordered = order[flown]
    first, last = legs.rows.T
    coefficients = np.concatenate([part.coefficients.reshape(-1, 3, 4) for part in parts])
    return Motion(
        segments=segments,
        laws=(
            PolynomialLaw(coefficients=coefficients),
            CircleLaw(
                start_m=legs.end_m[circles],
                centre_m=legs.centre_m[circles],
                rate_rad_s=-np.sign(legs.circle_m[circles]) * speed / radius,
            ),
        ),
        piece_segment=of_segment[by_segment],
        piece_law=np.concatenate(piece_law)[by_segment],
        piece_row=np.concatenate(piece_row)[by_segment],
        piece_offset_s=np.zeros(len(of_segment)),
        piece_duration_s=np.concatenate(duration)[by_segment],
        arrival_segment=np.searchsorted(ordered, first * _SLOTS + _HOLD) - 1,
        done_segment=np.searchsorted(ordered, (last + 1) * _SLOTS) - 1,
        piece_is_grounded=np.concatenate(grounded)[by_segment],
    )


def _top_m_s(part: _Part) -> FloatArray:
    """Return the highest speed of each segment. (n,) [m s⁻¹]"""
    pieces = part.pieces
    ends = pieces.begins_m_s + pieces.acceleration_m_s2 * pieces.duration_s
    top: FloatArray = np.maximum(pieces.begins_m_s, ends).max(axis=1, initial=0.0)
    return top
