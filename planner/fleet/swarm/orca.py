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
    other, radius = neighbours.rows, neighbours.reach_m
    p_x, p_y = np.moveaxis(neighbours.apart_m, -1, 0)
    own_x, own_y = velocity_m_s.T[..., None]
    other_x, other_y = velocity_m_s.T[:, other]
    v_x, v_y = own_x - other_x, own_y - other_y
    square = p_x**2 + p_y**2
    overlaps = square < radius**2
    time_s = np.where(overlaps, tick_s, horizon_s)
    # to the disk that cuts the cone off
    w_x, w_y = v_x - p_x / time_s, v_y - p_y / time_s
    w_size = np.sqrt(w_x**2 + w_y**2)
    ahead = w_x * p_x + w_y * p_y
    on_disk = overlaps | ((ahead < 0.0) & (ahead**2 > radius**2 * w_size**2))
    w_least, p_least = np.maximum(w_size, _LEAST_M), np.maximum(square, _LEAST_M)
    # to one of its legs
    leg = np.sqrt(np.maximum(square - radius**2, 0.0))
    side = np.where(p_x * w_y - p_y * w_x > 0.0, 1.0, -1.0)
    leg_x = -side * ((side * p_x * radius + p_y * leg) / p_least)
    leg_y = side * ((p_x * leg - side * p_y * radius) / p_least)
    normal_x = np.where(on_disk, w_x / w_least, leg_x)
    normal_y = np.where(on_disk, w_y / w_least, leg_y)
    way = np.where(on_disk, radius / time_s - w_size, -(v_x * leg_x + v_y * leg_y))
    way = np.where(evades[other], 0.5, 1.0) * way
    point = np.array((own_x + way * normal_x, own_y + way * normal_y))
    normal = np.array((normal_x, normal_y))
    point[:, other < 0] = normal[:, other < 0] = 0.0
    return HalfPlanes(point_m_s=np.moveaxis(point, 0, -1), normal=np.moveaxis(normal, 0, -1))


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
    # east and north apart, one half-plane of all agents a row: sums of two are then no reductions
    points, normals = (
        np.ascontiguousarray(one.transpose(2, 1, 0)) for one in (planes.point_m_s, planes.normal)
    )
    for number in range(points.shape[1]):
        (x, y), (normal_x, normal_y) = points[:, number], normals[:, number]
        is_cut = (best[:, 0] - x) * normal_x + (best[:, 1] - y) * normal_y < 0.0
        cut = np.flatnonzero(possible & is_cut)
        if not len(cut):
            continue
        until = slice(number + 1)
        found, is_there = _on_edge(
            points[:, until, cut], normals[:, until, cut], wanted_m_s[cut], speed_m_s[cut]
        )
        possible[cut] = is_there
        best[cut[is_there]] = found[is_there]
    return best, possible


def _on_edge(
    points: FloatArray, normals: FloatArray, wanted_m_s: FloatArray, speed_m_s: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the best velocities on the edge of the last half-plane that keep those before it.

    Half-planes: (2, m, n).
    """
    (x, y), (normal_x, normal_y) = points[:, -1], normals[:, -1]
    along_x, along_y = normal_y, -normal_x
    middle = -(x * along_x + y * along_y)
    room = speed_m_s**2 - (x * normal_x + y * normal_y) ** 2
    half = np.sqrt(np.maximum(room, 0.0))
    (others_x, others_y), (its_x, its_y) = points[:, :-1], normals[:, :-1]
    slope = along_x * its_x + along_y * its_y
    lack = (others_x - x) * its_x + (others_y - y) * its_y
    parallel = np.abs(slope) <= _PARALLEL
    at = lack / np.where(parallel, 1.0, slope)
    from_ = np.where(~parallel & (slope > 0.0), at, -np.inf).max(axis=0, initial=-np.inf)
    until = np.where(~parallel & (slope < 0.0), at, np.inf).min(axis=0, initial=np.inf)
    low, high = np.maximum(middle - half, from_), np.minimum(middle + half, until)
    is_there = (room >= 0.0) & (low <= high) & ~(parallel & (lack > 0.0)).any(axis=0)
    best = (wanted_m_s[:, 0] - x) * along_x + (wanted_m_s[:, 1] - y) * along_y
    best = np.clip(best, low, np.maximum(low, high))
    return np.stack((x + best * along_x, y + best * along_y), axis=1), is_there
