"""What algorithms and policies answer, which may be anybody's: refused where it cannot be flown."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import UsageError, shortened
from planner.fleet.swarm.zones import sizes

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.fleet.swarm.algorithms import Algorithm
    from planner.fleet.swarm.policies import Policy
    from planner.fleet.swarm.situation import SwarmSituation

_ROUNDING = 1e-6
"""By so much of its speed may a command be more. [-]"""


def refuse_without(given: object, what: str, needs: tuple[str, ...]) -> None:
    """Raise ``UsageError`` where an algorithm or a policy is none: a class, or one that lacks something."""
    missing = [name for name in needs if not hasattr(given, name)]
    if isinstance(given, type):
        why = f"is a class: make one of it, such as {given.__name__}()"
    elif missing:
        why = f"has no {missing[0]}"
    else:
        return
    msg = f"{what} must be an object with {', '.join(needs)}: {shortened(repr(given))} {why}"
    raise UsageError(msg)


def goals_m(algorithm: Algorithm, situation: SwarmSituation) -> FloatArray:
    """Return the goals an algorithm gives, as an array of its own. (n, 2) [m]

    Raises UsageError if it gives none that can be flown to.
    """
    name = f"{type(algorithm).__name__}.goals_m"
    goal = _array(algorithm.goals_m(situation), name, len(situation.place_m))
    bad: BoolArray = np.asarray(np.isinf(goal).any(axis=1))
    bad |= np.isnan(goal[:, 0]) != np.isnan(goal[:, 1])
    if bad.any():
        _refuse(
            name, goal, bad, "a place east and north in metres, or NaN twice for one that lands"
        )
    return goal


def commands_m_s(policy: Policy, situation: SwarmSituation) -> FloatArray:
    """Return the velocities a policy commands, as an array. (n, 2) [m s⁻¹]

    Raises UsageError if it commands none that can be flown.
    """
    name = f"{type(policy).__name__}.commands_m_s"
    command = _array(policy.commands_m_s(situation), name, len(situation.place_m))
    bad: BoolArray = np.asarray(~np.isfinite(command).all(axis=1))
    if bad.any():
        _refuse(name, command, bad, "a velocity east and north in m/s: NaN and infinity are none")
    fast: BoolArray = sizes(command) > situation.speed_m_s * (1.0 + _ROUNDING)
    if fast.any():
        most = float(situation.speed_m_s[np.argmax(fast)])
        _refuse(name, command, fast, f"no more than situation.speed_m_s, here {most:g} m/s")
    return command


def _array(answer: object, name: str, count: int) -> FloatArray:
    try:
        found = np.array(answer, np.float64)
    except (TypeError, ValueError):
        found = None
    if found is None or found.shape != (count, 2):
        got = shortened(repr(answer))
        if isinstance(answer, np.ndarray):
            got = f"an array of the shape {answer.shape}"
        shape = f"an array of the shape ({count}, 2), east and north of each agent"
        msg = f"{name} must return {shape}, got {got}"
        raise UsageError(msg)
    return found


def _refuse(name: str, answer: FloatArray, bad: BoolArray, expected: str) -> None:
    agent = int(np.argmax(bad))
    east, north = answer[agent].tolist()
    msg = f"{name} returned ({east:g}, {north:g}) for agent {agent}, counted from 0: expected {expected}"
    raise UsageError(msg)
