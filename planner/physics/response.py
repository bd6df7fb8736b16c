r"""Answers of a linear system with delay to steps, pulses, ramps and shaped references.

An input is a sum of edges, :math:`u(t) = \sum_e a_e (t - t_e)^{q_e} / q_e!` for :math:`t \ge t_e`:
a step is one edge of order 0, a pulse two, a ramp one of order 1, a jerk-limited reference a few of
order 3.  The answer is a sum of k-fold integrated impulse responses (`planner.physics.modes`),

.. math:: y(t) = \sum_e a_e\, I_{q_e + 1}(t - t_e - T), \quad
          \dot y = \sum_e a_e\, I_{q_e}, \quad
          \int_0^t y = \sum_e a_e\, I_{q_e + 2},

exact at every time, without sampling.  Nothing answers before the delay T.  At the very moment of a
jump the value after it is returned; the slope of a system with direct feedthrough leaves the
impulse at that moment out.

=============  ======  ======================================================================
name           symbol  meaning
=============  ======  ======================================================================
system         G(s)    transfer function with delay T, or a stack of them
edges          e       start t_e [s], order q_e, amplitude a_e [input/s^q] of the input's parts
value          y       answer [output]
slope          dy/dt   its derivative [output/s]
integral       ∫ y     its integral from 0 [output·s]
=============  ======  ======================================================================

Times and amplitudes broadcast against each other, and against the batch shape of a stack, by
numpy's rules.  Questions about the shape of one response (peaks, settling, crossings) are answered
by `planner.physics.extrema` and `planner.physics.settling`, for one system and plain numbers.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen
from planner.physics import extrema, settling

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.physics.extrema import Extremum
    from planner.physics.modes import FloatArray
    from planner.physics.transfer_function import TransferFunction, TransferFunctionStack

MAX_EDGE_ORDER = 3
"""Inputs grow with the cube of time at most."""


@frozen
class Edge:
    """One part of an input: amplitude · (t - start)^order / order! from its start on."""

    start_s: float | FloatArray = 0.0
    """When it begins, not negative. [s]"""

    order: int = 0
    """0 for a step, 1 for a ramp, up to `MAX_EDGE_ORDER`."""

    amplitude: float | FloatArray = 1.0
    """Its size. [input s^-order]"""


class Response(ABC):
    """Answer of a system to an input made of edges.

    Raises
    ------
    ValueError
        If the input is not finite, or has a part that begins before 0 or grows too fast.
    """

    __slots__ = ()

    system: TransferFunction | TransferFunctionStack

    def __post_init__(self) -> None:
        for edge in self.edges:
            if edge.order not in range(MAX_EDGE_ORDER + 1):
                msg = f"an edge of an input has order 0 to {MAX_EDGE_ORDER}, not {edge.order}"
                raise ValueError(msg)
            if not np.all(np.isfinite(edge.start_s) & np.greater_equal(edge.start_s, 0.0)):
                msg = f"an input begins and ends at finite times from 0 on, not {edge.start_s}"
                raise ValueError(msg)
            if not np.all(np.isfinite(edge.amplitude)):
                msg = f"the size of an input must be finite, got {edge.amplitude}"
                raise ValueError(msg)

    @property
    @abstractmethod
    def edges(self) -> tuple[Edge, ...]:
        """The parts of the input."""

    def derivative(self, t_s: npt.ArrayLike, order: int) -> FloatArray:
        """Return a derivative of the answer; order -1 is its integral.

        Parameters
        ----------
        t_s : array_like
            Time since the beginning of the input, broadcast against amplitudes and stack. [s]
        order : int
            0 for the value, 1 for the slope, -1 for the integral from 0.

        Returns
        -------
        ndarray
            Right-continuous, without impulses. [output s^-order]
        """
        since = np.asarray(t_s, dtype=np.float64) - self.system.delay_s
        modes = self.system.modes
        total: FloatArray | float = 0.0
        for edge in self.edges:
            part = modes.impulse_integral(since - edge.start_s, edge.order + 1 - order)
            total = total + edge.amplitude * part
        return np.asarray(total)

    def value(self, t_s: npt.ArrayLike) -> FloatArray:
        """Answer at times of any shape [output]."""
        return self.derivative(t_s, 0)

    def slope(self, t_s: npt.ArrayLike) -> FloatArray:
        """Rate of change of the answer, without the impulses of a feedthrough [output/s]."""
        return self.derivative(t_s, 1)

    def integral(self, t_s: npt.ArrayLike) -> FloatArray:
        """Integral of the answer from 0 to each time [output·s]."""
        return self.derivative(t_s, -1)

    @property
    def final_value(self) -> float | None:
        """Value the answer tends to; None where it swings or grows for ever [output]."""
        return settling.final_value(self)

    def extremum(self, window_s: float, *, highest: bool, derivative: int = 0) -> Extremum:
        """Highest or lowest point in [0, window], ends included; see `extrema.extremum`."""
        return extrema.extremum(self, window_s, highest=highest, derivative=derivative)

    def extrema(self, window_s: float, *, derivative: int = 0) -> tuple[Extremum, ...]:
        """Return the turning points in [0, window] by time; see `extrema.turning_points`."""
        return extrema.turning_points(self, window_s, derivative=derivative)

    def peak_slope(self, window_s: float | None = None) -> Extremum:
        """Steepest point, whichever way; see `settling.peak_slope`."""
        return settling.peak_slope(self, window_s)

    def overshoot(self) -> Extremum | None:
        """Farthest point beyond the final value; see `settling.overshoot`."""
        return settling.overshoot(self)

    def settling_time_s(self, tolerance: float, *, target: float | None = None) -> float | None:
        """First time from which the answer stays near; see `settling.settling_times_s`."""
        time_s = float(settling.settling_times_s(self, tolerance, target=target))
        return None if np.isinf(time_s) else time_s

    def first_crossing_s(
        self, level: float, *, window_s: float | None = None, derivative: int = 0
    ) -> float | None:
        """First time a level is reached; see `settling.first_crossings_s`."""
        time_s = float(
            settling.first_crossings_s(self, level, window_s=window_s, derivative=derivative)
        )
        return None if np.isinf(time_s) else time_s


@frozen
class StepResponse(Response):
    """Answer to a step of the input at time 0."""

    system: TransferFunction | TransferFunctionStack
    """What answers."""

    amplitude: float | FloatArray = 1.0
    """Size of the step. [input]"""

    @property
    def edges(self) -> tuple[Edge, ...]:
        """One step."""
        return (Edge(amplitude=self.amplitude),)


@frozen
class PulseResponse(Response):
    """Answer to an input held for a while and then withdrawn."""

    system: TransferFunction | TransferFunctionStack
    """What answers."""

    width_s: float | FloatArray
    """How long the input is held, not negative. [s]"""

    amplitude: float | FloatArray = 1.0
    """Height of the pulse. [input]"""

    @property
    def edges(self) -> tuple[Edge, ...]:
        """A step and the step back."""
        return (
            Edge(amplitude=self.amplitude),
            Edge(start_s=self.width_s, amplitude=-self.amplitude),
        )


@frozen
class RampResponse(Response):
    """Answer to an input that grows steadily from time 0, for ever or until it is held."""

    system: TransferFunction | TransferFunctionStack
    """What answers."""

    rate_per_s: float | FloatArray = 1.0
    """Growth of the input. [input/s]"""

    duration_s: float | FloatArray | None = None
    """When the input stops growing and is held; None for never. [s]"""

    @property
    def edges(self) -> tuple[Edge, ...]:
        """A ramp, and where it is held the opposite one."""
        ramp = Edge(order=1, amplitude=self.rate_per_s)
        if self.duration_s is None:
            return (ramp,)
        return (ramp, Edge(start_s=self.duration_s, order=1, amplitude=-self.rate_per_s))


@frozen
class ShapedResponse(Response):
    """Answer to a shaped reference, such as a jerk-limited one."""

    system: TransferFunction | TransferFunctionStack
    """What answers."""

    reference: tuple[Edge, ...]
    """The parts of the input."""

    @property
    def edges(self) -> tuple[Edge, ...]:
        """The parts of the input."""
        return self.reference
