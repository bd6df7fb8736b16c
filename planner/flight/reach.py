"""Reach: every situation a vehicle may be in, on its mission, holding anywhere, returning from anywhere.

Rules about wind, airspeed, climb rates and air iterate over these situations, never over legs: what is not
flown by the mission, a hover, a stop, a return, is judged like what is.  Rules about fence and ground do so
over lines: those of the flight (`planner.flight.path`) and the fan of its returns.
"""

from __future__ import annotations

import math
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.flight.motion.kinematics import KinematicState, Motion
    from planner.flight.prediction import Flight
    from planner.flight.returns.path import FlownReturns, ReturnPoints, Returns
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
    several = [
        SlowedSituations(
            item=part.items(slowed.item),
            kind=np.full(len(slowed.item), part.kind),
            commanded_m_s=slowed.commanded_m_s,
            held_m_s=slowed.held_m_s,
        )
        for part in _parts(returns)
        if (slowed := part.flight.motion.slowed) is not None
    ]
    return SlowedSituations.joined(several) if several else None


def situations(returns: Returns) -> Situations:
    """Return the situations of a flight, of holds at its points and of the returns from there."""
    mission, *back = (
        _of_state(
            part.flight.node_state,
            part.items(part.flight.motion.segments.item[part.flight.motion.piece_segment]),
            part.kind,
        )
        for part in _parts(returns)
    )
    sample = returns.sample
    holds = [] if sample is None else [_holds(sample.points, _items_of_points(returns, sample))]
    return Situations.joined([mission, *holds, *back])


def situations_flown(motion: Motion) -> Situations:
    """Return the situations of a flight alone, at the nodes of its pieces."""
    item = motion.segments.item[motion.piece_segment]
    return _of_state(motion.nodes.state, item, SituationKind.MISSION)


def climbs_flown_m_s(motion: Motion) -> FloatArray:
    """Return the vehicle's climb rates at the nodes of a flight's pieces, late by the lag of its climb.

    Of first order, linear between nodes.  (p k,) [m s⁻¹]
    """
    lag_s = motion.climb_lag_s
    time_s = (motion.piece_start_s[:, None] + motion.nodes.time_s).ravel()
    targets = motion.nodes.state.climb_m_s.ravel().tolist()
    flown, was = targets[0], targets[0]
    rates = [flown]
    for step_s, target in zip(np.diff(time_s).tolist(), targets[1:], strict=True):
        if step_s > 0.0:
            late = (target - was) / step_s * lag_s
            flown = target - late + (flown - was + late) * math.exp(-step_s / lag_s)
        rates.append(flown)
        was = target
    return np.array(rates)


class _Part(Value, kw_only=False, eq=False):
    """The flight of the mission, or the returns from its points."""

    flight: Flight
    kind: SituationKind
    items_of_points: IntArray | None = None
    """Of returns, which fly for the numbers of their points, the item each interrupts."""

    def items(self, flown_for: IntArray) -> IntArray:
        """Return mission items from what the motion flies for."""
        return flown_for if self.items_of_points is None else self.items_of_points[flown_for]


def _parts(returns: Returns) -> Iterator[_Part]:
    yield _Part(returns.flight, SituationKind.MISSION)
    if (sample := returns.sample) is not None:
        yield _Part(sample.flight, SituationKind.RETURN, _items_of_points(returns, sample))


def _items_of_points(returns: Returns, sample: FlownReturns) -> IntArray:
    """Return the mission item that a return from each point interrupts. (n,)"""
    return returns.flight.motion.segments.item[sample.points.segment]


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
