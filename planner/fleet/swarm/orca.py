r"""Reciprocal velocities: optimal reciprocal collision avoidance, for all agents at once.

Each agent :math:`i` takes half of what keeps it apart from :math:`j` for a time :math:`\tau`: with the
relative place :math:`p`, the relative velocity :math:`v` and the sum of the radii :math:`R`, velocities
that bring both nearer than :math:`R` within :math:`\tau` fill a truncated cone.  With :math:`u` the
shortest way from :math:`v` to its edge and :math:`n` the edge's normal there, agent :math:`i` keeps

.. math:: (v' - v_i - u / 2) \cdot n \ge 0 ,

and of all velocities that do so for its neighbours, within its own greatest speed, takes the one nearest
to what it wants (J. van den Berg, S. J. Guy, M. Lin, D. Manocha, Reciprocal n-body collision avoidance,
Robotics Research 70 (2011) 3-19).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IndexArray

_PARALLEL = 1e-9
_LEAST_M = 1e-12


class Neighbours(Value, eq=False):
    """Those that each of n agents keeps apart from, m of each, as disks that move."""

    rows: IndexArray
    """Which they are, -1 where there are fewer. (n, m)"""
    apart_m: FloatArray
    """From the agent to each. (n, m, 2) [m]"""
    reach_m: FloatArray
    """Sum of the radii of both. (n, m) [m]"""


class HalfPlanes(Value, eq=False):
    """Velocities v with (v - point) · normal ≥ 0, for m neighbours of each of n agents."""

    point_m_s: FloatArray
    """(n, m, 2) [m s⁻¹]"""
    normal: FloatArray
    """Unit vectors; zero where there is no neighbour. (n, m, 2)"""


def half_planes(
    neighbours: Neighbours,
    velocity_m_s: FloatArray,
    evades: BoolArray,
    *,
    horizon_s: float,
    tick_s: float,
) -> HalfPlanes:
    """Return what each agent keeps for its neighbours.

    Parameters
    ----------
    neighbours : Neighbours
    velocity_m_s : ndarray
        Of all agents. (n, 2) [m s⁻¹]
    evades : ndarray of bool
        Whether an agent does its half; else the others have all of it to do. (n,)
    horizon_s : float
        Time for which they keep apart. [s]
    tick_s : float
        Time in which those that are too near already come apart. [s]
    """
    other, p, radius = neighbours.rows, neighbours.apart_m, neighbours.reach_m
    own_m_s = velocity_m_s[:, None]
    v = own_m_s - velocity_m_s[other]
    square = (p**2).sum(axis=-1)
    overlaps = square < radius**2
    time_s = np.where(overlaps, tick_s, horizon_s)
    # to the disk that cuts the cone off
    w = v - p / time_s[..., None]
    w_size = np.sqrt((w**2).sum(axis=-1))
    ahead = (w * p).sum(axis=-1)
    on_disk = overlaps | ((ahead < 0.0) & (ahead**2 > radius**2 * w_size**2))
    w_unit = w / np.maximum(w_size, _LEAST_M)[..., None]
    # to one of its legs
    leg = np.sqrt(np.maximum(square - radius**2, 0.0))
    left = p[..., 0] * w[..., 1] - p[..., 1] * w[..., 0] > 0.0
    side = np.where(left, 1.0, -1.0)
    direction = (
        np.stack(
            (
                p[..., 0] * leg - side * p[..., 1] * radius,
                side * p[..., 0] * radius + p[..., 1] * leg,
            ),
            axis=-1,
        )
        / np.maximum(square, _LEAST_M)[..., None]
    )
    leg_normal = side[..., None] * np.stack((-direction[..., 1], direction[..., 0]), axis=-1)
    normal = np.where(on_disk[..., None], w_unit, leg_normal)
    way = np.where(on_disk, radius / time_s - w_size, -(v * leg_normal).sum(axis=-1))
    share = np.where(evades[other], 0.5, 1.0)
    point = own_m_s + (share * way)[..., None] * normal
    nobody = (other < 0)[..., None]
    return HalfPlanes(point_m_s=np.where(nobody, 0.0, point), normal=np.where(nobody, 0.0, normal))


def nearest_velocities_m_s(
    planes: HalfPlanes, wanted_m_s: FloatArray, speed_m_s: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the velocities nearest to those wanted, (n, 2) [m s⁻¹], and whether there is one, (n,).

    By adding one half-plane after the other: where it cuts off the best velocity so far, the new best lies
    on its edge.
    """
    size = np.hypot(*wanted_m_s.T)
    best = wanted_m_s * np.minimum(1.0, speed_m_s / np.maximum(size, _LEAST_M))[:, None]
    possible = np.ones(len(best), np.bool_)
    for number in range(planes.normal.shape[1]):
        point, normal = planes.point_m_s[:, number], planes.normal[:, number]
        cut = np.flatnonzero(possible & (((best - point) * normal).sum(axis=1) < 0.0))
        if not len(cut):
            continue
        found, is_there = _on_edge(planes, number, cut, wanted_m_s[cut], speed_m_s[cut])
        possible[cut] = is_there
        best[cut[is_there]] = found[is_there]
    return best, possible


def _on_edge(
    planes: HalfPlanes, number: int, rows: IndexArray, wanted_m_s: FloatArray, speed_m_s: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the best velocities on the edge of a half-plane that keep those before it."""
    point, normal = planes.point_m_s[rows, number], planes.normal[rows, number]
    along = np.stack((normal[:, 1], -normal[:, 0]), axis=1)
    middle = -(point * along).sum(axis=1)
    room = speed_m_s**2 - (point * normal).sum(axis=1) ** 2
    is_there = room >= 0.0
    half = np.sqrt(np.maximum(room, 0.0))
    low, high = middle - half, middle + half
    for earlier in range(number):
        other, its = planes.point_m_s[rows, earlier], planes.normal[rows, earlier]
        slope = (along * its).sum(axis=1)
        lack = ((other - point) * its).sum(axis=1)
        parallel = np.abs(slope) <= _PARALLEL
        is_there &= ~(parallel & (lack > 0.0))
        at = lack / np.where(parallel, 1.0, slope)
        low = np.where(~parallel & (slope > 0.0), np.maximum(low, at), low)
        high = np.where(~parallel & (slope < 0.0), np.minimum(high, at), high)
    is_there &= low <= high
    best = np.clip(((wanted_m_s - point) * along).sum(axis=1), low, np.maximum(low, high))
    return point + best[:, None] * along, is_there
