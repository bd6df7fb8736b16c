"""Power transients of identified responses, each over its own window.

The identified power responses (G2, G3, G5 of the article) describe a manoeuvre and nothing after it:
they are used over a window and then end.  A window that reaches into the next state is counted whole,
once, with the segment that began it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.physics.response import StepResponse


# The same few responses are asked for every mission: this question needs root finding.
@lru_cache(maxsize=64)
def _peak_s(unit: StepResponse, window_s: float, *, highest: bool) -> float:
    return unit.extremum(window_s, highest=highest).time_s


@frozen(eq=False)
class Transients:
    """Windows of power responses as columns, in the order of their start.

    A row may pause at ``pause_at_s`` for ``pause_s``: a climb longer than the identified step holds its
    peak rate there, and the power belonging to it.
    """

    responses: tuple[StepResponse | None, ...]
    """Answers to unit steps, W per unit of input; ``None`` where the model has none."""
    window_s: tuple[float, ...]
    """Window of each response, from the step on. [s]"""
    segment: IntArray
    """Segment that begins the window. (n,)"""
    response: IntArray
    """Position in ``responses``. (n,)"""
    amplitude: FloatArray
    """Size of the input step. (n,)"""
    start_s: FloatArray
    pause_at_s: FloatArray
    pause_s: FloatArray

    def end_s(self) -> FloatArray:
        """Return when each window ends. (n,) [s]"""
        window_s: FloatArray = np.asarray(self.window_s)[self.response]
        return self.start_s + self.pause_s + window_s

    def power_w(self, row: IntArray, time_s: FloatArray) -> FloatArray:
        """Return the power of windows ``row`` at times counted from their start; zero outside. [W]"""
        row, time_s = np.broadcast_arrays(row, time_s)
        paused = np.clip(time_s - self.pause_at_s[row], 0.0, self.pause_s[row])
        own = time_s - paused
        power = np.zeros(row.shape)
        for index, (unit, window) in enumerate(zip(self.responses, self.window_s, strict=True)):
            inside = (self.response[row] == index) & (own >= 0.0) & (own < window)
            if unit is not None and inside.any():
                power[inside] = self.amplitude[row[inside]] * unit.value(own[inside])
        return power

    def energy_j(self) -> FloatArray:
        """Return the energy of each whole window: integral of the response plus the pause. (n,) [J]"""
        energy = np.zeros(len(self.segment))
        for index, (unit, window) in enumerate(zip(self.responses, self.window_s, strict=True)):
            rows = self.response == index
            if unit is not None and rows.any():
                at_pause = np.zeros(rows.sum())
                pausing = self.pause_s[rows] > 0.0
                if pausing.any():
                    at_pause[pausing] = unit.value(self.pause_at_s[rows][pausing])
                energy[rows] = self.amplitude[rows] * (
                    float(unit.integral(window)) + at_pause * self.pause_s[rows]
                )
        return energy

    def peak_times_s(self) -> FloatArray:
        """Return when each window's power is highest, since the start of the flight. (n,) [s]"""
        times = np.zeros(len(self.segment))
        for index, (unit, window) in enumerate(zip(self.responses, self.window_s, strict=True)):
            rows = self.response == index
            if unit is None or not rows.any():
                continue
            for rising in (True, False):
                chosen = rows & ((self.amplitude > 0.0) == rising)
                times[chosen] = _peak_s(unit, window, highest=rising)
        late = times > self.pause_at_s
        return self.start_s + times + np.where(late, self.pause_s, 0.0)

    def total_power_w(self, time_s: FloatArray) -> FloatArray:
        """Return the sum of all windows at times since the start of the flight. [W]"""
        total = np.zeros(np.shape(time_s))
        if not len(self.start_s):
            return total
        newest = np.searchsorted(self.start_s, time_s, side="right") - 1
        end_s = self.end_s()
        # How far back a window can reach: the row whose end lies beyond the latest start.
        oldest = np.searchsorted(np.maximum.accumulate(end_s), self.start_s, side="right")
        depth = int((np.arange(len(end_s)) - oldest).max()) + 1
        for back in range(depth + 1):
            row = newest - back
            open_yet = (row >= 0) & (time_s <= end_s[np.maximum(row, 0)])
            if open_yet.any():
                chosen = row[open_yet]
                total[open_yet] += self.power_w(chosen, time_s[open_yet] - self.start_s[chosen])
        return total


NO_TRANSIENTS = Transients(
    responses=(),
    window_s=(),
    segment=np.zeros(0, dtype=np.intp),
    response=np.zeros(0, dtype=np.intp),
    amplitude=np.zeros(0),
    start_s=np.zeros(0),
    pause_at_s=np.zeros(0),
    pause_s=np.zeros(0),
)
"""What a vehicle has whose references are shaped."""
