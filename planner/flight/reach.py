"""Reach: every situation a vehicle may be in, on its mission, holding anywhere, returning from anywhere.

Rules about wind, airspeed, climb rates and air iterate over these situations, never over legs: what is not
flown by the mission, a hover, a stop, a return, is judged like what is.  Rules about fence and ground do so
over lines: those of the flight (`planner.flight.path`) and the fan of its returns.
"""

from __future__ import annotations

from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns

if TYPE_CHECKING:
    from planner.arrays import FloatArray, IntArray
    from planner.flight.motion.kinematics import KinematicState, SlowedLegs
    from planner.flight.returns.path import ReturnPoints, Returns
    from planner.physics.wind import Wind

GUST_SDS = 2.0
"""Standard deviations of the wind that count where it has to be withstood: 1 in 44 is stronger. [-]"""


class SituationKind(IntEnum):
    """What brings a vehicle into a situation."""

    MISSION = 0
    """Its mission: legs, hovers, climbs, descents, take-off, landing, its own return."""
    HOLD = 1
    """A stop and a hover, or a landing where it is, at any point of it."""
    RETURN = 2
    """A return from any point of it, home or to a rally point."""


class Situations(Columns, eq=False, dict=True):
    """n situations as columns: those of the mission first, in flown order."""

    east_m_s: FloatArray
    """Velocity over ground. (n,) [m s⁻¹]"""
    north_m_s: FloatArray
    climb_m_s: FloatArray
    height_m: FloatArray
    """Above home. (n,) [m]"""
    item: IntArray
    """Mission item that is flown, or that the stop or return interrupts, from 1. (n,)"""
    kind: IntArray
    """As `SituationKind`. (n,)"""

    @cached_property
    def ground_speed_m_s(self) -> FloatArray:
        """Speed over ground. (n,) [m s⁻¹]"""
        return np.hypot(self.east_m_s, self.north_m_s)

    def airspeed_m_s(self, wind: Wind) -> FloatArray:
        """Return the horizontal speeds through the air. (n,) [m s⁻¹]"""
        if wind.speed_m_s == 0.0:
            return self.ground_speed_m_s
        factor = wind.speed_factor(self.height_m)
        return np.hypot(
            self.east_m_s - wind.east_m_s * factor, self.north_m_s - wind.north_m_s * factor
        )

    def gust_m_s(self, wind: Wind) -> FloatArray:
        """Return the strongest winds to count on: mean and two standard deviations. (n,) [m s⁻¹]"""
        strongest_m_s = wind.speed_m_s + GUST_SDS * wind.speed_sd_m_s
        return strongest_m_s * wind.speed_factor(self.height_m)

    def where(self, row: int) -> str:
        """Return how a situation is named in a message."""
        item = int(self.item[row])
        match SituationKind(int(self.kind[row])):
            case SituationKind.MISSION:
                return f"at item {item}"
            case SituationKind.HOLD:
                return f"holding at item {item}"
            case SituationKind.RETURN:
                return f"on the return from item {item}"


class SlowedSituations(Columns, eq=False):
    """n legs of the mission, then of returns, flown slower than commanded for want of airspeed."""

    item: IntArray
    """Mission item that is flown, or that the return interrupts, from 1. (n,)"""
    kind: IntArray
    """As `SituationKind`. (n,)"""
    commanded_m_s: FloatArray
    """Over ground. (n,) [m s⁻¹]"""
    held_m_s: FloatArray
    """What the wind leaves of it. (n,) [m s⁻¹]"""


def slowed_situations(returns: Returns) -> SlowedSituations | None:
    """Return where a flight and the returns from it are slower than commanded; ``None``: nowhere."""
    motion, sample = returns.flight.motion, returns.sample
    parts: list[tuple[SlowedLegs | None, IntArray | None, SituationKind]]
    parts = [(motion.slowed, None, SituationKind.MISSION)]
    if sample is not None:
        item = motion.segments.item[sample.points.segment]
        parts.append((sample.flight.motion.slowed, item, SituationKind.RETURN))
    several = [
        SlowedSituations(
            item=slowed.item if of_point is None else of_point[slowed.item],
            kind=np.full(len(slowed.item), kind),
            commanded_m_s=slowed.commanded_m_s,
            held_m_s=slowed.held_m_s,
        )
        for slowed, of_point, kind in parts
        if slowed is not None
    ]
    return SlowedSituations.joined(several) if several else None


def situations(returns: Returns) -> Situations:
    """Return the situations of a flight, of holds at its points and of the returns from there."""
    flight = returns.flight
    columns = flight.motion.segments
    own = flight.node_state
    parts = [_of_state(own, columns.item[flight.motion.piece_segment], SituationKind.MISSION)]
    sample = returns.sample
    if sample is not None:
        item = columns.item[sample.points.segment]
        parts += [
            _holds(sample.points, item),
            _of_state(sample.flight.node_state, item[sample.piece_point], SituationKind.RETURN),
        ]
    return Situations.joined(parts)


def _of_state(state: KinematicState, item: IntArray, kind: SituationKind) -> Situations:
    """Return the situations at the nodes (p, k) of pieces that fly for items (p,)."""
    shape = state.height_m.shape
    return Situations(
        east_m_s=state.east_m_s.ravel(),
        north_m_s=state.north_m_s.ravel(),
        climb_m_s=state.climb_m_s.ravel(),
        height_m=state.height_m.ravel(),
        item=np.repeat(item, shape[1]),
        kind=np.full(shape[0] * shape[1], kind),
    )


def _holds(points: ReturnPoints, item: IntArray) -> Situations:
    """Return a vehicle that stands still over each point."""
    zero = np.zeros(len(item))
    return Situations(
        east_m_s=zero,
        north_m_s=zero,
        climb_m_s=zero,
        height_m=points.stop_m[:, 2],
        item=item,
        kind=np.full(len(zero), SituationKind.HOLD),
    )
