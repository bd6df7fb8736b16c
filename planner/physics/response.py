r"""How a vehicle, or its power, answers a reference: linear systems of order up to three with delay.

.. math:: G(s) = e^{-s T} H(s), \qquad
          H(s) = \frac{b_m s^m + \dots + b_0}{a_n s^n + \dots + a_0}, \qquad m \le n \le 3

What is asked is one function of time, the impulse response of H integrated k times,

.. math:: I_k(t) = \mathcal{L}^{-1}\{ H(s) / s^k \}(t) :

the answer to a unit step is :math:`I_1`, its slope :math:`I_0`, its integral :math:`I_2`; an input of
order q that begins at :math:`t_e` adds :math:`a_e I_{q+1}(t - t_e - T)`.  `Modes` sums it in closed form,
exact at every time.  Order three is what flights can tell; more belongs to the ``control`` library
(`TransferFunction.to_control`), which is the reference in the tests.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.physics.modes import MAX_ORDER, Modes, derived, make_modes, modes_of
from planner.values import Value, force_setattr

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from planner.arrays import FloatArray


_UNDAMPED = 1e-12  # damping ratio that is lost in the rounding of the roots
_NEGLIGIBLE = 1e-12  # of the steady value
_RESIDENCES, _STOP_SAMPLES = 20.0, 1001
"""After so many mean residence times a response has ended; places looked at until then, and about the
greatest way. [-]"""
_MOST_TURNS = 4_000_000


class TransferFunction(Value, dict=True):
    """One linear system: a proper rational function of s and a delay.

    Raises
    ------
    ValueError
        If coefficients are missing, not finite, improper or of an order above `MAX_ORDER`, or the
        delay is negative.
    """

    numerator: tuple[float, ...]
    """Coefficients in descending powers of s; leading zeros are dropped."""

    denominator: tuple[float, ...]
    """Coefficients in descending powers of s, the first not zero."""

    delay_s: float = 0.0
    """Dead time. [s]"""

    def __post_init__(self) -> None:
        for name in ("numerator", "denominator"):
            coefficients = tuple(float(c) for c in getattr(self, name))
            if not coefficients or not all(map(math.isfinite, coefficients)):
                msg = f"the {name} of a transfer function needs finite coefficients, got {coefficients}"
                raise ValueError(msg)
            force_setattr(self, name, coefficients)
        while len(self.numerator) > 1 and self.numerator[0] == 0.0:
            force_setattr(self, "numerator", self.numerator[1:])
        if self.denominator[0] == 0.0:
            msg = f"the leading denominator coefficient must not be zero, got {self.denominator}"
            raise ValueError(msg)
        if not len(self.numerator) - 1 <= self.order <= MAX_ORDER:
            msg = (
                f"a transfer function has order {MAX_ORDER} at most and no more zeros than poles, got "
                f"degree {len(self.numerator) - 1} over degree {self.order}"
            )
            raise ValueError(msg)
        if not 0.0 <= self.delay_s < math.inf:
            msg = f"delay_s must be finite and not negative, got {self.delay_s}"
            raise ValueError(msg)

    @property
    def order(self) -> int:
        """Degree of the denominator."""
        return len(self.denominator) - 1

    @cached_property
    def modes(self) -> Modes:
        """Poles and partial fractions, computed once per system."""
        return modes_of(self.numerator, self.denominator)

    @property
    def poles(self) -> tuple[complex, ...]:
        """Roots of the denominator, imaginary parts descending, integrators last [rad s⁻¹]."""
        return tuple(self.modes.poles.tolist())

    @property
    def is_stable(self) -> bool:
        """Whether every pole has a negative real part, beyond the rounding of the roots."""
        return all(pole.real < -_UNDAMPED * abs(pole) for pole in self.poles)

    @property
    def dc_gain(self) -> float | None:
        """Gain at s = 0; None where a pole at the origin leaves none."""
        return self.numerator[-1] / self.denominator[-1] if self.denominator[-1] else None

    @property
    def natural_frequency_rad_s(self) -> float | None:
        """Undamped natural frequency √(a₀/a₂) of a second-order system, else None [rad s⁻¹]."""
        if self.order != 2 or self.denominator[2] / self.denominator[0] <= 0.0:
            return None
        return math.sqrt(self.denominator[2] / self.denominator[0])

    @property
    def damping_ratio(self) -> float | None:
        """Damping ratio a₁/(2√(a₀ a₂)) of a second-order system, else None [-]."""
        frequency = self.natural_frequency_rad_s
        return frequency and self.denominator[1] / self.denominator[0] / (2.0 * frequency)

    @property
    def damped_period_s(self) -> float | None:
        """Period of the oscillation of a second-order system; None if it does not swing [s]."""
        frequency, damping = self.natural_frequency_rad_s, self.damping_ratio
        if frequency is None or damping is None or abs(damping) >= 1.0:
            return None
        return math.tau / (frequency * math.sqrt((1.0 - damping) * (1.0 + damping)))

    @cached_property
    def mean_residence_time_s(self) -> float:
        r"""Delay plus the area between the steady answer and the step response [s].

        .. math:: \int_0^\infty \left(1 - \frac{y(t)}{G(0)}\right) dt
                  = T + \frac{a_1}{a_0} - \frac{b_1}{b_0}

        A speed of v0, commanded to zero, covers v0 times this before it has stopped; for a
        second-order system without zeros T + 2ζ/ω_n.

        Raises
        ------
        ValueError
            If the system is not stable or its gain at s = 0 is zero.
        """
        if not self.is_stable or self.numerator[-1] == 0.0:
            msg = f"only a stable system with a steady gain has a mean residence time, not {self}"
            raise ValueError(msg)
        (a1, a0), (b1, b0) = ((0.0, *c)[-2:] for c in (self.denominator, self.numerator))
        return self.delay_s + a1 / a0 - b1 / b0

    def to_control(self, *, pade_order: int = 0) -> Any:  # noqa: ANN401 - control is not typed
        """Return this system as a ``control.TransferFunction``.

        Its delay is a Padé approximation of ``pade_order``; 0 leaves the delay out, and the rest exact.
        """
        import control

        system = control.tf(list(self.numerator), list(self.denominator))
        if pade_order and self.delay_s:
            system *= control.tf(*control.pade(self.delay_s, pade_order))
        return system


class Edge(Value, kw_only=False):
    """One part of an input: amplitude · (t - start)^order / order! from its start on."""

    amplitude: float | FloatArray = 1.0
    """Its size. [input s^-order]"""
    start_s: float | FloatArray = 0.0
    """When it begins, not negative. [s]"""
    order: int = 0
    """0 for a step, 1 for a ramp, 2 for a parabola."""


class ShapedResponse(Value, eq=False):
    """Answer to an input made of edges, such as a jerk-limited reference, from rest."""

    system: TransferFunction
    edges: tuple[Edge, ...]
    """Starts and amplitudes broadcast against the times asked for."""

    def value(self, t_s: npt.ArrayLike) -> FloatArray:
        """Answer at times since the beginning of the input [output]."""
        return self._sum(t_s, 1)

    def integral(self, t_s: npt.ArrayLike) -> FloatArray:
        """Integral of the answer from 0 to each time [output·s]."""
        return self._sum(t_s, 2)

    def _sum(self, t_s: npt.ArrayLike, k: int) -> FloatArray:
        since = np.asarray(t_s, dtype=np.float64) - self.system.delay_s
        modes = self.system.modes
        parts = [
            edge.amplitude * modes.impulse_integral(since - edge.start_s, edge.order + k)
            for edge in self.edges
        ]
        return np.asarray(sum(parts))


class Extremum(Value, kw_only=False):
    """A point of a response."""

    time_s: float
    """Time since the beginning of the input. [s]"""
    value: float


class StepResponse(Value):
    """Answer of one system to a step at time 0, and its shape: peaks, settling, crossings."""

    system: TransferFunction
    amplitude: float = 1.0
    """Size of the step. [input]"""

    def value(self, t_s: npt.ArrayLike) -> FloatArray:
        """Answer at times of any shape [output]."""
        return np.asarray(self._integrals(t_s, 1)[0])

    def slope(self, t_s: npt.ArrayLike) -> FloatArray:
        """Rate of change of the answer, without the impulse of a feedthrough [output/s]."""
        return np.asarray(self._integrals(t_s, 0)[0])

    def integral(self, t_s: npt.ArrayLike) -> FloatArray:
        """Integral of the answer from 0 to each time [output·s]."""
        return np.asarray(self._integrals(t_s, 2)[0])

    def slope_and_value(self, t_s: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return both at the cost of little more than one."""
        slope, value = self._integrals(t_s, 0, 1)
        return slope, value

    def value_and_integral(self, t_s: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return both at the cost of little more than one."""
        value, integral = self._integrals(t_s, 1, 2)
        return value, integral

    def _integrals(self, t_s: npt.ArrayLike, *orders: int) -> FloatArray:
        since = np.asarray(t_s, dtype=np.float64) - self.system.delay_s
        return self.amplitude * self.system.modes.impulse_integrals(since, *orders)

    @property
    def final_value(self) -> float:
        """Value the answer tends to [output].

        Raises
        ------
        ValueError
            If it swings or grows for ever.
        """
        gain = self.system.dc_gain
        if gain is None or not self.system.is_stable:
            msg = f"the answer of a system that is not stable has no end: {self.system}"
            raise ValueError(msg)
        return self.amplitude * gain

    def extremum(self, window_s: float, *, highest: bool) -> Extremum:
        """Highest or lowest point in [0, window], ends included; the first of equals."""
        times = self._monotone_between(window_s)
        values = self.value(times)
        at = int(np.argmax(values if highest else -values))
        return Extremum(float(times[at]), float(values[at]))

    def peak_slope(self) -> Extremum:
        """Point of the largest slope, upward or downward, of a stable system; its sign is kept."""
        modes = self.system.modes
        if not self.system.is_stable:
            msg = f"the slope of a system that is not stable need have no peak: {self.system}"
            raise ValueError(msg)
        # where the envelope has fallen below one of the slopes no larger one comes
        some = np.abs(modes.impulse_integral(np.linspace(0.0, 8.0, 65) / modes.fastest_rad_s, 0))
        end_s = _quiet_after_s(modes, float(some.max(initial=1e-300)))
        slopes_slope = make_modes(derived(modes.numerator, modes.denominator), modes.denominator)
        times = self.system.delay_s + np.append(0.0, _sign_changes(slopes_slope, end_s))
        slopes = self.slope(times)
        at = int(np.argmax(np.abs(slopes)))
        return Extremum(float(times[at]), float(slopes[at]))

    def settling_times_s(self, tolerances: npt.ArrayLike) -> FloatArray:
        """Return the first times from which the answer stays within tolerances of its final value. [s]

        Tolerances are positive distances [output]; 0 where the answer is never farther away.
        """
        allowed = np.asarray(tolerances, dtype=np.float64)
        final = self.final_value
        if not np.all(allowed > 0.0):
            msg = f"a settling tolerance must be positive, got {allowed.tolist()}"
            raise ValueError(msg)
        times = self._monotone_between(self._near_end_s(float(allowed.min(initial=np.inf))))
        away = self.value(times) - final
        # how far the answer still goes from each of the times on, the last by the envelope not at all
        farthest = np.maximum.accumulate(np.abs(away[:-1])[::-1])[::-1]
        flat = allowed.ravel()
        last = np.searchsorted(-farthest, -flat, side="left") - 1
        settled = np.zeros(flat.size)
        some = last >= 0
        before = last[some]
        limit = final + np.copysign(flat[some], away[before])
        settled[some] = self._reached_s(limit, times[before], times[before + 1])
        return settled.reshape(allowed.shape)

    def first_crossing_s(self, level: float) -> float | None:
        """First time at which a level is reached; None where it never is.

        Everything rests at zero before time 0: a jump at the start reaches what lies between.
        """
        distance = abs(level - self.final_value)
        times = self._monotone_between(self._near_end_s(distance))
        reached = np.flatnonzero(np.copysign(1.0, level) * self.value(times) >= abs(level))
        if not reached.size:
            return None
        first = int(reached[0])
        if first == 0:
            return 0.0
        around = (times[first - 1 : first], times[first : first + 1])
        return float(self._reached_s(np.array([level]), *around)[0])

    def _monotone_between(self, window_s: float) -> FloatArray:
        """Return rising times from 0 to the window's end, between which the answer is monotone."""
        if not 0.0 < window_s < math.inf:
            msg = f"the window must be positive and finite, got {window_s}"
            raise ValueError(msg)
        modes, delay_s = self.system.modes, self.system.delay_s
        turns = delay_s + _sign_changes(modes, window_s - delay_s)
        # just before the delay has passed and at it: a feedthrough jumps
        times = [0.0, *np.nextafter([delay_s], -1.0), delay_s, *turns, window_s]
        return np.sort([time for time in times if 0.0 <= time <= window_s])

    def _near_end_s(self, distance: float) -> float:
        """Return a time from which the answer is nearer to its final value than a distance."""
        modes, final = self.system.modes, self.final_value
        # what is left of the answer is an impulse response too: that of (H(s) - H(0)) / s
        gain = (self.system.dc_gain or 0.0) - modes.feedthrough
        left = (np.append(0.0, modes.numerator) - gain * modes.denominator)[:-1]
        least = max(distance, _NEGLIGIBLE * abs(final), 1e-300) / (abs(self.amplitude) or 1.0)
        return self.system.delay_s + _quiet_after_s(make_modes(left, modes.denominator), least)

    def _reached_s(self, level: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
        def away_and_slope(t: FloatArray) -> tuple[FloatArray, FloatArray]:
            slope, value = self.slope_and_value(t)
            return value - level, slope

        return _bracketed_roots(away_and_slope, low, high)


def _quiet_after_s(modes: Modes, limit: float) -> float:
    """Time from which the impulse response of one stable system stays below a limit [s]."""
    if modes.is_close:
        # t^q / q! exp(σ t) is at most (2 / -σ)^q exp(σ t / 2)
        rate = float(modes.poles.real.max())
        sizes = [abs(c) * (-2.0 / rate) ** q for q, c in enumerate(modes.newton_form(0))]
        terms = [(float(size), 0.5 * rate) for size in sizes]
    else:
        terms = [(float(abs(residue)), float(rate)) for rate, _, residue in modes.fractions]
    log_limit = math.log(limit / len(terms)) if terms else 0.0
    times = [(math.log(size) - log_limit) / -rate for size, rate in terms if size > 0.0]
    return max([0.0, *times]) + 1e-9  # a little later, where rounding does not matter


def _sign_changes(modes: Modes, end_s: float) -> FloatArray:
    """Return the times in (0, end) at which the impulse response of one system changes its sign.

    With a real pole p, exp(-p t) times the response of a third-order system is monotone between the
    sign changes of its derivative, and that is exp(-p t) times a response of second order.
    """
    numerator, denominator = modes.numerator, modes.denominator
    if len(numerator) < 2 or end_s <= 0.0:
        return np.zeros(0)
    if len(numerator) == 2:
        return _second_order_sign_changes(numerator, denominator, end_s)
    pole = modes.poles[np.argmin(np.abs(modes.poles.imag))].real
    rest = np.array([1.0, denominator[1] + pole, 0.0])
    rest[2] = denominator[2] + pole * rest[1]
    reduced = (numerator - numerator[0] * rest)[1:]
    cuts = np.concatenate([[0.0], _second_order_sign_changes(reduced, rest, end_s), [end_s]])
    negative = modes.impulse_integral(cuts, 0) < 0.0
    changes = np.flatnonzero(negative[1:] != negative[:-1])
    return _bracketed_roots(
        lambda t: (modes.impulse_integral(t, 0), modes.impulse_integral(t, -1)),
        cuts[changes],
        cuts[changes + 1],
    )


def _second_order_sign_changes(
    numerator: FloatArray, denominator: FloatArray, end_s: float
) -> FloatArray:
    """Sign changes of exp(σ t) (b₁ cosh δt + (b₀ + b₁ σ) sinh(δt)/δ) in (0, end)."""
    (b1, b0), (_, a1, a0) = numerator.tolist(), denominator.tolist()
    sigma = -0.5 * a1
    across = b0 + b1 * sigma
    square = sigma * sigma - a0
    if square < 0.0:
        turning = math.sqrt(-square)
        if end_s * turning > math.pi * _MOST_TURNS:
            msg = f"{end_s:.6g} s hold too many oscillations to search; give a shorter window"
            raise ValueError(msg)
        first = math.atan2(-b1 * turning, across) % math.pi
        times = (first + math.pi * np.arange(math.ceil(end_s * turning / math.pi) + 1)) / turning
        return np.asarray(times[(times > 0.0) & (times < end_s)])
    delta = math.sqrt(square)
    ratio = -b1 / across if across else 0.0
    if not 0.0 < ratio * max(delta, 1e-300) < 1.0:
        return np.zeros(0)
    time = math.atanh(ratio * delta) / delta if delta > 0.0 else ratio
    return np.array([time] if time < end_s else [])


def _bracketed_roots(
    function: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Root of a monotone function, given with its slope, in each bracket.

    By Newton's rule inside the bracket, to a few units in the last place or 1e-12, and by bisection where a
    step is not half of the one before: slow progress cannot last.
    """
    rising = function(high)[0] > function(low)[0]
    root, step = 0.5 * (low + high), high - low
    for _ in range(200):
        value, slope = function(root)
        below = (value < 0.0) == rising
        low, high = np.where(below, root, low), np.where(below, high, root)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = root - value / slope
        inside = (newton >= low) & (newton <= high)
        tolerance = 1e-12 + 4e-16 * np.abs(root)
        done = (inside & (np.abs(newton - root) <= tolerance)) | (high - low <= tolerance)
        chosen = inside & (done | (np.abs(newton - root) <= 0.5 * step))
        before, root = root, np.where(chosen, newton, 0.5 * (low + high))
        step = np.abs(root - before)
        if done.all():
            break
    return root


@lru_cache(maxsize=64)
def farthest_stop_s(response: TransferFunction) -> float:
    """Return the greatest way of a stop over the speed it begins from. [s]

    The integral of what the response to a unit step lacks is greatest where the response first passes its
    steady value; without overshoot it grows to the mean residence time.
    """
    residence_s = response.mean_residence_time_s
    gain = response.dc_gain or 1.0
    least_s, most_s = 0.0, _RESIDENCES * residence_s
    for _ in range(2):  # about the greatest once more, closely
        time_s = np.linspace(least_s, most_s, _STOP_SAMPLES)
        way_s = time_s - _lost_s(response, time_s) / gain
        nearest = int(np.argmax(way_s))
        least_s, most_s = time_s[[max(nearest - 1, 0), min(nearest + 1, len(time_s) - 1)]]
    return max(float(way_s[nearest]), residence_s)


def _lost_s(response: TransferFunction, time_s: FloatArray) -> FloatArray:
    """Return the integral of the response to a unit step, up to times. [s]"""
    return np.asarray(
        response.modes.impulse_integral(np.maximum(time_s - response.delay_s, 0.0), 2)
    )
