"""Headway: the ground speeds a vehicle can hold against the wind."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.catalogue.wind import AIRSPEED_LIMIT, NO_HEADWAY

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.physics.wind import Wind

SLOWEST_M_S = 0.1
"""What is left of a speed without headway, so that the flight ends; a finding says it. [m s⁻¹]"""


def held_speeds_m_s(
    speed_m_s: FloatArray,
    way_m: FloatArray,
    item: IntArray,
    *,
    wind: Wind | None,
    airspeed_limit_m_s: float | None,
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Return the ground speeds that can be held on legs, and what has to be said of them.

    Parameters
    ----------
    speed_m_s : ndarray
        Commanded. (n,) [m s⁻¹]
    way_m : ndarray
        East and north way of each leg. (n, 2) [m]
    item : ndarray of int
        Mission item of each. (n,)
    wind : Wind, optional
        ``None``: none.
    airspeed_limit_m_s : float, optional
        Airspeed at the greatest tilt; ``None``: no limit. [m s⁻¹]

    Returns
    -------
    speed_m_s : ndarray
        (n,) [m s⁻¹]
    findings : tuple of Finding
        No headway, or less speed than commanded.

    Notes
    -----
    An autopilot holds its ground speed until the tilt reaches its limit; with the airspeed v_max there
    it is w_along + √(v_max² − w_across²).
    """
    length = np.hypot(way_m[:, 0], way_m[:, 1])
    if airspeed_limit_m_s is None or not len(length):
        return speed_m_s, ()
    east, north = (0.0, 0.0) if wind is None else (wind.east_m_s, wind.north_m_s)
    moves = length > 0.0
    safe = np.where(moves, length, 1.0)
    along = (east * way_m[:, 0] + north * way_m[:, 1]) / safe
    across = (north * way_m[:, 0] - east * way_m[:, 1]) / safe
    limit = along + np.sqrt(np.maximum(airspeed_limit_m_s**2 - across**2, 0.0))
    stuck = moves & ((limit <= SLOWEST_M_S) | (np.abs(across) >= airspeed_limit_m_s))
    slowed = moves & ~stuck & (limit < speed_m_s)
    findings: list[Finding] = []
    if stuck.any():
        first = int(item[stuck][0])
        findings.append(
            NO_HEADWAY.finding(
                f"no headway on {stuck.sum()} legs from item {first} on: "
                f"{np.hypot(east, north):.1f} m/s of wind against {airspeed_limit_m_s:.1f} m/s of "
                "airspeed",
                item=first,
            )
        )
    if slowed.any():
        first = int(item[slowed][0])
        slowest = np.flatnonzero(slowed)[np.argmin(limit[slowed])]
        findings.append(
            AIRSPEED_LIMIT.finding(
                f"{slowed.sum()} legs from item {first} on are slower than commanded, down to "
                f"{limit[slowest]:.1f} m/s of {speed_m_s[slowest]:.1f} m/s",
                item=first,
            )
        )
    held = np.where(moves, np.minimum(speed_m_s, np.maximum(limit, SLOWEST_M_S)), speed_m_s)
    return np.where(stuck, SLOWEST_M_S, held), tuple(findings)
