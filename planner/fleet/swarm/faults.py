r"""What goes wrong in a simulation: commands that are kept or late, places that are wrong, gusts.

Whatever carries an agent off the place it reports is a displacement :math:`d` that nobody knows of.  Of a
gust :math:`w` it is what the agent has not answered yet, with the answer :math:`G` to commands as that to
changes of the wind,

.. math:: D(s) = \frac{1 - G(s) e^{-s T}}{s} W(s) ,

so that an even wind ends up where the agent would have stopped from its speed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.fleet import FaultKind
from planner.fleet.swarm.clearing import clearing
from planner.fleet.swarm.zones import differ
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, FloatArray
    from planner.fleet.fleet import Fault
    from planner.fleet.swarm.dynamics import DynamicsStack
    from planner.fleet.swarm.situation import SwarmSituation

_FOOT_M = 0.3048
_LOW_FT, _HIGH_FT = 10.0, 1000.0
"""Heights that the model of gusts at low altitude holds for. [ft]"""
_LIKELY = 3.0
"""Gusts up to so many standard deviations are allowed for in the zones. [-]"""
_SETTLED_S = 120.0
"""An agent has answered by then. [s]"""


def gust_m_s(wind_m_s: float, height_m: float) -> tuple[float, float]:
    r"""Return the standard deviation of level gusts, [m s⁻¹], and their length, [m].

    Dryden's model at low altitude, MIL-F-8785C: :math:`\sigma_w = 0.1 u_{20}`,
    :math:`\sigma_u = \sigma_w / (0.177 + 0.000823 h)^{0.4}` and
    :math:`L_u = h / (0.177 + 0.000823 h)^{1.2}` with :math:`h` in feet.
    """
    height_ft = min(max(height_m / _FOOT_M, _LOW_FT), _HIGH_FT)
    base = 0.177 + 0.000823 * height_ft
    return 0.1 * wind_m_s / base**0.4, _FOOT_M * height_ft / base**1.2


class SwarmFaults:
    """What goes wrong for the agents of one simulation.

    Parameters
    ----------
    faults : sequence of Fault
    names : sequence of str
        Of the vehicles of the agents.
    dynamics : DynamicsStack
        Of the agents.
    height_m : float or ndarray
        Of their plane above the ground, or of each. [m]
    seed : int
        Of what is drawn.
    begins_s : ndarray, optional
        Before that nothing carries an agent: it stands on the ground. (n,) [s]
    """

    def __init__(
        self,
        faults: Sequence[Fault],
        names: Sequence[str],
        dynamics: DynamicsStack,
        *,
        height_m: FloatArray | float,
        seed: int,
        begins_s: FloatArray | None = None,
    ) -> None:
        heights_m = np.broadcast_to(height_m, len(names)).tolist()
        count, tick_s = len(names), dynamics.tick_s
        self._dynamics = dynamics
        self._keeps_s, self._late_s = np.full((2, count, 2), np.inf)
        """From when until when."""
        self._late_ticks = np.zeros(count, np.intp)
        self._gusts_s, self._drifts_s = np.full((2, count), np.inf)
        self._gust_m_s, self._length_s = np.zeros(count), np.ones(count)
        self._drift_m_s = np.zeros((count, 2))
        for number, one in enumerate(faults):
            rows = [row for row, name in enumerate(names) if one.vehicle in {None, name}]
            ends_s = math.inf if one.lasts_s is None else one.at_s + one.lasts_s
            match one.kind:
                case FaultKind.KEEPS_COMMAND:
                    self._keeps_s[rows] = one.at_s, ends_s
                case FaultKind.LINK_LATE:
                    assert one.late_s is not None  # the table sees to it
                    self._late_s[rows] = one.at_s, ends_s
                    self._late_ticks[rows] = math.ceil(one.late_s / tick_s - 1e-9)
                case FaultKind.LOSES_POSITION:
                    assert one.drift_m_s is not None  # the table sees to it
                    toward_deg = one.toward_deg
                    if toward_deg is None:
                        toward_deg = np.random.default_rng((seed, number)).uniform(0.0, 360.0)
                    angle = math.radians(toward_deg)
                    self._drifts_s[rows] = one.at_s
                    self._drift_m_s[rows] = (
                        one.drift_m_s * math.sin(angle),
                        one.drift_m_s * math.cos(angle),
                    )
                case FaultKind.GUSTS:
                    assert one.wind_m_s is not None  # the table sees to it
                    self._gusts_s[rows] = one.at_s
                    for row in rows:
                        sigma_m_s, length_m = gust_m_s(one.wind_m_s, heights_m[row])
                        self._gust_m_s[row] = sigma_m_s
                        self._length_s[row] = length_m / max(one.wind_m_s, 1e-9)
        if begins_s is not None:
            self._gusts_s = np.maximum(self._gusts_s, begins_s)
            self._drifts_s = np.maximum(self._drifts_s, begins_s)
        self._draws = [np.random.default_rng((seed, count + row)) for row in range(count)]
        self._wind_m_s, self._blown_m = np.zeros((2, count, 2))
        self._answer = dynamics.at_rest(np.zeros((count, 2)))
        self._decided: list[tuple[FloatArray, BoolArray]] = []
        self.carried_m = np.zeros((count, 2))
        """From where agents report to be to where they are. (n, 2) [m]"""
        self.gust_error_m = self._gust_error_m()
        """How far likely gusts carry each, which is known of the weather. (n,) [m]"""

    def is_deaf(self, time_s: float) -> BoolArray:
        """Return who keeps its command, whatever it is told. (n,)"""
        return _within(self._keeps_s, time_s)

    def disobeys(self, time_s: float) -> BoolArray:
        """Return who keeps its command, or does late what it has to do for others. (n,)"""
        return np.asarray(self.is_deaf(time_s) | _within(self._late_s, time_s))

    def is_lost(self, time_s: float) -> BoolArray:
        """Return who keeps it for ever. (n,)"""
        return np.asarray(self.is_deaf(time_s) & np.isinf(self._keeps_s[:, 1]))

    def evading(self, situation: SwarmSituation) -> SwarmSituation:
        """Return a situation in which those in the way of one that keeps its command want out of it."""
        wanted_m_s = np.where(situation.is_deaf[:, None], 0.0, situation.wanted_m_s)
        situation = replace(situation, wanted_m_s=wanted_m_s)
        for deaf in np.flatnonzero(situation.is_deaf & situation.is_there).tolist():
            situation = clearing(situation, deaf, situation.zones.select(np.array([deaf])))
        return situation

    def given_m_s(self, situation: SwarmSituation, command_m_s: FloatArray) -> FloatArray:
        """Return the commands by which agents fly, of those that a policy decided on."""
        wanted_m_s = situation.wanted_m_s
        self._decided.append((command_m_s, differ(command_m_s, wanted_m_s)))
        del self._decided[: -1 - int(self._late_ticks.max(initial=0))]
        command_m_s = command_m_s.copy()
        late = _within(self._late_s, situation.time_s) & situation.is_led
        for row in np.flatnonzero(late).tolist():
            before = len(self._decided) - 1 - int(self._late_ticks[row])
            decided, avoids = self._decided[max(before, 0)]
            is_held = before >= 0 and avoids[row]
            command_m_s[row] = decided[row] if is_held else wanted_m_s[row]
        return np.where(situation.is_deaf[:, None], situation.command_m_s, command_m_s)

    def go_on(self, end_s: float) -> None:
        """Carry agents until the end of a tick."""
        tick_s = self._dynamics.tick_s
        left = np.exp(-tick_s / self._length_s)
        blows = (self._gusts_s < end_s) & (self._gust_m_s > 0.0)
        for row in np.flatnonzero(blows).tolist():
            drawn = self._gust_m_s[row] * self._draws[row].standard_normal(2)
            if self._gusts_s[row] < end_s - tick_s:  # not the first
                fresh = math.sqrt(1.0 - left[row] ** 2)
                drawn = left[row] * self._wind_m_s[row] + fresh * drawn
            self._wind_m_s[row] = drawn
        self._answer = self._dynamics.advanced(self._answer, self._wind_m_s)
        self._blown_m = self._blown_m + tick_s * self._wind_m_s
        adrift_s = np.clip(end_s - self._drifts_s, 0.0, None)
        drifted_m = self._drift_m_s * np.where(np.isinf(self._drifts_s), 0.0, adrift_s)[:, None]
        self.carried_m = self._blown_m - self._answer.place_m + drifted_m

    @property
    def answered_m_s(self) -> FloatArray:
        """The gusts that agents fly against by now: what they are carried by is the rest. (n, 2) [m s⁻¹]"""
        return self._dynamics.velocity_m_s(self._answer)

    def _gust_error_m(self) -> FloatArray:
        """Return how far an even wind as strong as likely gusts carries each. (n,) [m]"""
        dynamics, likely_m_s = self._dynamics, _LIKELY * self._gust_m_s
        if not likely_m_s.any():
            return likely_m_s
        wind = np.stack((likely_m_s, np.zeros(len(likely_m_s))), axis=1)
        motions = self._answer
        for _ in range(round(_SETTLED_S / dynamics.tick_s)):
            motions = dynamics.advanced(motions, wind)
        return np.asarray(_SETTLED_S * likely_m_s - motions.place_m[:, 0])


def _within(spans_s: FloatArray, time_s: float) -> BoolArray:
    return np.asarray((spans_s[:, 0] <= time_s + 1e-9) & (time_s < spans_s[:, 1] - 1e-9))
