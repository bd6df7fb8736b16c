"""What agents of a swarm know of their batteries: who has to fly home."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.fleet.swarm.flights import BRAKE, first_landing, flight_states
from planner.fleet.swarm.simulation import MOST_SKIPPED, TICK_S, AgentPhase
from planner.fleet.swarm.zones import Capsules, near_pairs
from planner.flight.budget import flight_battery
from planner.units import JOULES_PER_WATT_HOUR, wh_from_j

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, FloatArray
    from planner.fleet.fleet import Fault
    from planner.fleet.swarm.simulation import Step
    from planner.service.swarm_bodies import SwarmBody

_BATTERY_S = 10.0
"""At least so often an agent asks whether its battery still brings it home. [s]"""
_LONGEST_S = MOST_SKIPPED * TICK_S
"""Of a step: it asks as long before. [s]"""
_GUSTS = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
"""Sizes of gusts whose power is known, in standard deviations. [-]"""
_EXPECTED = 1
"""Of those, what an agent expects on its way home: no less than what gusts take on average. [-]"""
_TURNS = 5.0
"""Ways of a stop that turning home and coming to rest there take the time of: each of the two stops lasts as
long as twice its way, evenly braked, and the first leads away from home. [-]"""


class SwarmBatteries:
    """What agents know of their batteries: who has to fly home now.

    Each counts its own energy as it goes, by the more of hovering and flying level, and every braking from
    the speed commanded before, into the gusts it meets; the energy of its flight is predicted from the
    whole of it afterwards.  On its way home it expects gusts of their standard deviation all along.  Its
    way home is as long as it would be alone, and as others in the air take to land beside it before: those
    whose pads are as near to its own as their stop zones reach.
    """

    def __init__(
        self,
        bodies: Sequence[SwarmBody],
        drops: Sequence[Fault | None],
        separation_m: float,
        *,
        gusts_m_s: Sequence[float],
        errors_m: Sequence[float] | FloatArray,
        uncounted: Sequence[float],
    ) -> None:
        self._home_m = np.array([(one.agent.east_m, one.agent.north_m) for one in bodies])
        self._speed = np.array([one.agent.speed_m_s for one in bodies])
        figures = [
            _figures(one, gust_m_s, 1.0 + more)
            for one, gust_m_s, more in zip(bodies, gusts_m_s, uncounted, strict=True)
        ]
        self._left_wh, self._power_w, self._brake_wh, self._landing_wh = (
            np.array([getattr(one, name) for one in figures])
            for name in ("left_wh", "power_w", "brake_wh", "landing_wh")
        )
        self._gusts_m_s = np.array(gusts_m_s)
        self._drops = [
            (row, drop.at_s, (drop.charge_left or 0.0) * one.usable_wh - one.reserve_wh)
            for row, (drop, one) in enumerate(zip(drops, figures, strict=True))
            if drop is not None
        ]
        self._landing_s = np.array([one.agent.landing_s for one in bodies])
        self._stop_m = np.array([one.stop_m for one in bodies])
        pads = Capsules.about(self._home_m, self._home_m, self._stop_m + np.array(errors_m))
        self._beside = near_pairs(pads, separation_m)
        self._asked_s = 0.0
        self._was_braking = np.zeros(len(bodies), np.bool_)
        self._asked_m_s = np.zeros((2, len(bodies)))
        """Speeds commanded in the last two steps: the last of a leg is commanded in part."""
        self._returns = np.zeros(len(bodies), np.bool_)

    def take(self, step: Step) -> BoolArray:
        """Take a step; return who has to fly home now. (n,)"""
        flies = step.phase == AgentPhase.FLIES
        state = flight_states(step.velocity_m_s, step.command_m_s, self._speed)
        brakes = flies & (state == BRAKE)
        begins = brakes & ~self._was_braking
        power_w = self._power_w[:, 0]
        if self._gusts_m_s.any():
            met = np.hypot(*step.against_m_s.T) / np.maximum(self._gusts_m_s, 1e-9)
            power_w = np.array(
                [np.interp(one, _GUSTS, row) for one, row in zip(met, self._power_w, strict=True)]
            )
        self._left_wh = self._left_wh - np.where(
            flies, power_w * (step.end_s - step.begin_s) / JOULES_PER_WATT_HOUR, 0.0
        )
        before = self._asked_m_s.max(axis=0) / self._speed
        self._left_wh = self._left_wh - np.where(begins, before * self._brake_wh, 0.0)
        self._was_braking = brakes
        self._asked_m_s = np.stack((self._asked_m_s[1], np.hypot(*step.command_m_s.T)))
        for row, at_s, most_wh in self._drops:
            if step.begin_s <= at_s < step.end_s:
                self._left_wh[row] = min(self._left_wh[row], most_wh)
        if step.end_s > self._asked_s + _BATTERY_S - _LONGEST_S:
            self._asked_s = step.end_s
            way_m = np.hypot(*(step.place_m - self._home_m).T)
            # until it asks again it may fly on, which it has to fly back
            away_s = step.end_s - step.begin_s + 2.0 * _BATTERY_S
            home_s = (way_m + _TURNS * self._stop_m) / self._speed + away_s
            home_s = home_s + self._others_land_s(step)
            needed_wh = (
                self._landing_wh
                + 2.0 * self._brake_wh
                + self._power_w[:, _EXPECTED] * home_s / JOULES_PER_WATT_HOUR
            )
            self._returns = self._returns | (flies & (self._left_wh < needed_wh))
        return self._returns

    def _others_land_s(self, step: Step) -> FloatArray:
        """Return how long those take that may land beside each, one after the other. (n,) [s]"""
        is_up = (step.phase > AgentPhase.WAITS) & (step.phase < AgentPhase.LANDED)
        landing_s = np.where(is_up, self._landing_s, 0.0)
        first, second = self._beside
        count = len(landing_s)
        return np.asarray(
            np.bincount(first, landing_s[second], count)
            + np.bincount(second, landing_s[first], count)
        )


class _Figures(NamedTuple):
    """What an agent counts its battery by."""

    left_wh: float = math.inf
    """For its level flight, above the reserve. [Wh]"""
    power_w: Sequence[float] = (0.0,) * len(_GUSTS)
    """At level flight in gusts of `_GUSTS`. [W]"""
    brake_wh: float = 0.0
    """Of one braking. [Wh]"""
    landing_wh: float = 0.0
    usable_wh: float = math.inf
    """At the take-off. [Wh]"""
    reserve_wh: float = 0.0


def _figures(body: SwarmBody, gusts_m_s: float, times: float) -> _Figures:
    """Return what an agent counts by, all of it so many times what its model counts."""
    flight, setup = body.vertical, body.setup
    segments = wh_from_j(flight.segment_energy_j)
    lands = first_landing(flight.motion)
    budget = flight_battery(flight, setup).budget
    if budget is None:
        return _Figures()
    speeds_m_s = (0.0, body.agent.speed_m_s)
    powers = [
        [_level_power_w(body, one, part * gusts_m_s) for one in speeds_m_s] for part in _GUSTS
    ]
    # a weaker gust takes as much where a stronger one takes less
    power_w = np.maximum.accumulate(np.max(powers, axis=1)).tolist()
    brake = setup.vehicle.responses.brake_power
    brake_wh = 0.0
    if brake is not None:
        joules = -body.agent.speed_m_s * float(brake.unit_step.integral(brake.window_s))
        brake_wh = max(float(wh_from_j(joules)), 0.0)
    return _Figures(
        left_wh=budget.above_reserve_wh - times * float(segments[:lands].sum()),
        power_w=[times * one for one in power_w],
        brake_wh=times * brake_wh,
        landing_wh=times * float(segments[lands:].sum()),
        usable_wh=budget.usable_wh,
        reserve_wh=budget.reserve_wh,
    )


def _level_power_w(body: SwarmBody, speed_m_s: float, gust_m_s: float) -> float:
    """Return the power of steady level flight in the plane, into the wind and a gust. [W]"""
    from planner.flight.motion.kinematics import STATE_INDEX, FlightState, KinematicState

    wind = body.setup.wind
    ahead = np.array([-wind.east_m_s, -wind.north_m_s])
    size = float(np.hypot(*ahead))
    unit = ahead / size if size else np.array([1.0, 0.0])
    one = np.ones(1)
    state = KinematicState.of(
        (0.0 * one, 0.0 * one, body.height_m * one),
        (*((speed_m_s + gust_m_s) * axis * one for axis in unit), 0.0 * one),
    )
    kind = np.array([STATE_INDEX[FlightState.CRUISE if speed_m_s else FlightState.HOVER]])
    return float(body.vertical.power.power_w(state, kind, np.array([speed_m_s]))[0])
