"""How near the agents of a simulation come to each other."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.fleet.swarm.simulation import AgentPhase
from planner.fleet.swarm.zones import Capsules, near_pairs
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.fleet.swarm.flights import Record

WITHIN = 5.0
"""Pairs farther apart than this times the separation are in nobody's list. [-]"""


class Approach(Value):
    """Where two agents come nearest to each other."""

    first: str
    second: str
    distance_m: float
    """Through the air. [m]"""
    time_s: float
    above_m: float = 0.0
    """How far one is above the other then, of missions as filed. [m]"""

    @property
    def beside_m(self) -> float:
        """Level distance then. [m]"""
        return math.sqrt(max(self.distance_m**2 - self.above_m**2, 0.0))


class Kept(NamedTuple):
    """Where two come nearest for what they have to keep, beside or above each other."""

    approach: Approach
    beside_m: float
    above_m: float | None = None
    """``None``: they fly in one plane."""


class Distances(Value, eq=False):
    """How near agents come to each other in the air."""

    nearest: tuple[Approach, ...]
    """Of every pair that came within five times the separation, the nearest first."""
    least_m: FloatArray
    """Between any two during each step, as far as it is within that; NaN. (t,) [m]"""


def predict_distances(record: Record, names: tuple[str, ...], separation_m: float) -> Distances:
    """Return how near agents come to each other, both in the air: along the chords of the steps.

    ``separation_m`` is the greatest that any two have to keep, the errors of their places included. [m]
    """
    flies = (record.phase != AgentPhase.WAITS) & (record.phase != AgentPhase.LANDED)
    found: dict[tuple[int, int], tuple[float, float]] = {}
    least = np.full(len(flies), np.nan)
    for step in range(len(flies)):
        begin, end = record.place_m[step], record.place_m[step + 1]
        tracks = Capsules.about(begin, end, np.zeros(len(begin)))
        first, second = near_pairs(tracks, WITHIN * separation_m, flies[step])
        if not len(first):
            continue
        apart, part = closest_of_chords(begin[second] - begin[first], end[second] - end[first])
        least[step] = apart.min()
        width_s = record.begin_s[step + 1] - record.begin_s[step]
        for low, high, distance_m, share in zip(
            first.tolist(), second.tolist(), apart.tolist(), part.tolist(), strict=True
        ):
            if distance_m < found.get((low, high), (np.inf, 0.0))[0]:
                found[low, high] = distance_m, float(record.begin_s[step] + share * width_s)
    nearest = sorted((distance_m, time_s, pair) for pair, (distance_m, time_s) in found.items())
    return Distances(
        nearest=tuple(
            Approach(first=names[a], second=names[b], distance_m=distance_m, time_s=time_s)
            for distance_m, time_s, (a, b) in nearest
        ),
        least_m=least,
    )


def closest_of_chords(begin: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least length of vectors that change evenly, (n,) [m], and after which part, (n,) [-]."""
    change = end - begin
    square = np.maximum((change**2).sum(axis=1), 1e-18)
    part = np.clip(-(begin * change).sum(axis=1) / square, 0.0, 1.0)
    return np.hypot(*(begin + part[:, None] * change).T), part
