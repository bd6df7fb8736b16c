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

from planner.values import Value, force_setattr

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    import numpy.typing as npt

    from planner.arrays import BoolArray, ComplexArray, FloatArray


MAX_ORDER = 3
"""Highest order of a system: what identification can tell."""
_MAX_INTEGRATIONS = 4  # the integral of the answer to an input that grows with the square of time
_CLOSE = 0.1  # poles nearer than this fraction of their modulus lose digits as partial fractions
_UNDAMPED = 1e-12  # damping ratio that is lost in the rounding of the roots
_TAYLOR_TERMS = 27  # 2^27 / 27! is 1e-20
_MARKOV_TERMS = 21  # of series up to 1: 1 / 21! is 2e-20
_FACTORIALS = np.array(
    [math.factorial(j) for j in range(MAX_ORDER + _TAYLOR_TERMS + _MAX_INTEGRATIONS)], np.float64
)
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
        return _modes(self.numerator, self.denominator)

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


class _Terms(Value, kw_only=False, eq=False):
    """What I_k of o orders k of a system, or of a stack of shape B, are made of."""

    weights: tuple[tuple[FloatArray, FloatArray | None], ...]
    """Re and Im of :math:`r_i p_i^{-(z+k)}`, a pair for each partial fraction, each of shape (o, …); no Im
    where none of the poles turns."""
    steady: tuple[FloatArray, ...]
    """Coefficients of their polynomials in t, ascending.  (z + k, …) each"""
    series: FloatArray
    """Taylor coefficients about t = 0, ascending, of I_k / t^k where k is above 0.  (…, terms, o)"""


class Modes(Value, eq=False, dict=True):
    r"""One rational system, or a stack of them of batch shape B, ready to be evaluated over time.

    With z poles at the origin and the others :math:`p_i`,

    .. math:: I_k(t) = \sum_i r_i p_i^{-(z+k)} e^{p_i t}
              + \sum_{j < z + k} m_j \frac{t^{z+k-1-j}}{(z+k-1-j)!} ,

    which loses its digits early, where the Taylor series of the Markov parameters
    :math:`h^{(j)}(0)` takes over, and where poles lie close together or a slow one has hardly begun
    to act, where divided differences of the exponential do (`_divided_exponentials`):

    .. math:: I_k(t) = \sum_m c_m t^{k+m-1} \exp[\underbrace{0, \dots, 0}_{k}, p_1 t, \dots, p_m t],
              \qquad H(s) = \sum_m \frac{c_m}{(s - p_1) \cdots (s - p_m)} .
    """

    feedthrough: FloatArray
    """Direct term d. [output/input], shape B"""
    numerator: FloatArray
    """Strictly proper part of the numerator, descending powers, shape (…, n)."""
    denominator: FloatArray
    """Monic, descending powers, shape (…, n + 1)."""
    poles: ComplexArray
    """Imaginary parts descending, those at the origin last. [rad s⁻¹], shape (…, n)"""
    integrators: int
    """Poles at the origin z, the same for all systems of a stack."""

    fractions: tuple[tuple[FloatArray, FloatArray, ComplexArray], ...]
    """Partial fractions, one of each conjugate pair: Re p_i, Im p_i, r_i, each of shape B."""
    steady_series: FloatArray
    """Taylor coefficients m_j about s = 0 of s^z H(s) without d, shape (terms, …)."""
    markov: FloatArray
    """Derivatives of the impulse response at 0, shape (terms, …)."""
    is_close: BoolArray
    """Whether poles are too close for partial fractions, shape B."""
    fastest_rad_s: FloatArray
    """Largest modulus of a pole. [rad s⁻¹], shape B"""
    slowest_rad_s: FloatArray
    """Smallest modulus of a pole other than the origin. [rad s⁻¹], shape B"""

    def impulse_integral(self, t_s: npt.ArrayLike, k: int) -> FloatArray:
        """Return the impulse response integrated k times, :math:`I_k`, right-continuous at 0.

        Times since the impulse broadcast against B; before it the result is 0. [s]  A negative k
        differentiates, without the impulses at t = 0.
        """
        return np.asarray(self.impulse_integrals(t_s, k)[0])

    def impulse_integrals(self, t_s: npt.ArrayLike, *orders: int) -> FloatArray:
        """Return :math:`I_k` of several k at the same times: they share their exponentials. (k, …)"""
        t = np.asarray(t_s, dtype=np.float64)
        before = t < 0.0
        if not np.count_nonzero(before):
            return self._after_impulse(t, orders)
        if t.ndim and not self.feedthrough.ndim:
            after, result = ~before, np.zeros((len(orders), *t.shape))
            # One by one: all at once they take eight times as long.
            for own, found in zip(result, self._after_impulse(t[after], orders), strict=True):
                own[after] = found
            return result
        return np.where(before, 0.0, self._after_impulse(np.maximum(t, 0.0), orders))

    def _after_impulse(self, t: FloatArray, orders: tuple[int, ...]) -> FloatArray:
        if self.feedthrough.ndim:
            t = np.broadcast_to(t, np.broadcast_shapes(t.shape, self.feedthrough.shape))
        terms = self._terms(orders)
        totals = self._by_fractions(t, terms.weights, len(orders))
        early = t * self.fastest_rad_s < 1.0
        some_early = np.count_nonzero(early)
        if some_early:
            soon = t[early]
            first = _polynomial(_series_at(early, terms.series), soon)
        some_close, passes = self._kinds
        slow = t * self.slowest_rad_s < 1.0 if len(self.fractions) > 1 else np.False_
        some_slow = np.count_nonzero(slow)
        for row, (k, steady) in enumerate(zip(orders, terms.steady, strict=True)):
            own = totals[row, ...]
            if len(steady):
                own += _polynomial(steady, t)
            is_slow = some_slow and len(steady) > 0
            if some_close or is_slow:
                mask = (self.is_close | slow if is_slow else self.is_close) & ~early
                own[mask] = self._by_differences(t[mask], mask, k)
            if some_early:
                own[early] = soon**k * first[row] if k > 0 else first[row]
            if k > 0 and passes:
                own += self.feedthrough * t ** (k - 1) / math.factorial(k - 1)
        return totals

    @cached_property
    def _kinds(self) -> tuple[bool, bool]:
        """Whether poles of any system are too close, and whether any has a direct term."""
        return bool(self.is_close.any()), bool(self.feedthrough.any())

    def _by_fractions(
        self, t: FloatArray, weights: tuple[tuple[FloatArray, FloatArray | None], ...], count: int
    ) -> FloatArray:
        """Return the sums over partial fractions, of so many orders. (count, …)"""
        lifted = (count, *(1,) * (t.ndim - self.feedthrough.ndim), *self.feedthrough.shape)
        totals = None if weights else np.zeros((count, *t.shape))
        for (rate, turning, _), (real, imaginary) in zip(self.fractions, weights, strict=True):
            own = real.reshape(lifted)
            if imaginary is not None:
                angle = turning * t
                own = own * np.cos(angle) - imaginary.reshape(lifted) * np.sin(angle)
            share = np.exp(rate * t) * own
            totals = share if totals is None else totals + share
        return np.asarray(totals)

    def _terms(self, orders: tuple[int, ...]) -> _Terms:
        """Return what the :math:`I_k` are made of; worked out once, as short flights ask for it often."""
        terms = self._known_terms.get(orders)
        if terms is None:
            powers = [self.integrators + k for k in orders]
            weights = [
                np.stack([one / (rate + 1j * turn) ** power for power in powers])
                for rate, turn, one in self.fractions
            ]
            series = [_over_factorials(self.markov[max(-k, 0) :], max(k, 0)) for k in orders]
            least = min(map(len, series))
            terms = _Terms(
                tuple(
                    (one.real, one.imag if turn.any() else None)
                    for one, (_, turn, _) in zip(weights, self.fractions, strict=True)
                ),
                tuple(
                    _over_factorials(self.steady_series[: max(power, 0)][::-1]) for power in powers
                ),
                np.moveaxis(
                    _in_blocks(np.stack([one[:least] for one in series], axis=1)), (0, 1), (-2, -1)
                ),
            )
            self._known_terms[orders] = terms
        return terms

    @cached_property
    def _known_terms(self) -> dict[tuple[int, ...], _Terms]:
        return {}

    def _by_differences(self, t: FloatArray, mask: BoolArray, k: int) -> FloatArray:
        zeros = max(k, 0)
        nodes = np.zeros((t.size, zeros + self.poles.shape[-1]), np.complex128)
        nodes[:, zeros:] = t[:, None] * _at(mask, self.poles, trailing=1)
        differences = _divided_exponentials(nodes)
        total = np.zeros(t.shape)
        for power, coefficient in enumerate(self.newton_form(min(k, 0)), start=zeros):
            total += t**power * (_at(mask, coefficient) * differences[:, power]).real
        return total

    def newton_form(self, k: int) -> tuple[ComplexArray, ...]:
        """Coefficients c_m of the impulse response, differentiated -k times, each of shape B."""
        numerator = self.numerator
        for _ in range(-k):
            numerator = derived(numerator, self.denominator)
        # division by one pole after the other, from the last on
        remainders: list[ComplexArray] = []
        quotient = numerator.astype(np.complex128)
        for i in range(self.poles.shape[-1] - 1, -1, -1):
            for j in range(1, i + 1):
                quotient[..., j] += quotient[..., j - 1] * self.poles[..., i]
            remainders.append(quotient[..., i])
        return tuple(reversed(remainders))


def make_modes(numerators: FloatArray, denominators: FloatArray) -> Modes:
    """Return the modes of one system or of a stack of systems of the same order.

    Coefficients (…, m + 1) and (…, n + 1) are in descending powers of s, m ≤ n, the leading one of the
    denominator not zero; every system has the same number of poles at the origin.
    """
    order = denominators.shape[-1] - 1
    monic = denominators / denominators[..., :1]
    whole = np.zeros(denominators.shape)
    whole[..., order + 1 - numerators.shape[-1] :] = numerators / denominators[..., :1]
    feedthrough = whole[..., 0]
    proper = whole[..., 1:] - feedthrough[..., None] * monic[..., 1:]

    integrators = 0
    while integrators < order and not np.any(monic[..., order - integrators]):
        integrators += 1
    rest = monic[..., : order + 1 - integrators]
    found = _roots(rest)
    moduli = np.abs(found)
    # of each pole to every other, 1 in the place of itself
    apart = found[..., :, None] - found[..., None, :] + np.eye(found.shape[-1])
    reach = _CLOSE * np.maximum(moduli[..., :, None], moduli[..., None, :])
    is_other = ~np.eye(found.shape[-1], dtype=np.bool_)
    is_close = np.asarray(((np.abs(apart) < reach) & is_other).any(axis=(-2, -1)))
    fractions = []
    for i in range(found.shape[-1]):
        pole = np.where(is_close, -1.0, found[..., i])
        # the upper pole of a pair is counted for both
        weight = np.where(is_close, 0.0, 1.0 + np.sign(pole.imag))
        if weight.any():
            top = np.polyval(np.moveaxis(proper, -1, 0), pole)
            divisor = np.where(is_close, 1.0, np.prod(apart[..., i, :], axis=-1))
            fractions.append((pole.real, pole.imag, weight * top / divisor))
    return Modes(
        feedthrough=feedthrough,
        numerator=proper,
        denominator=monic,
        poles=np.concatenate([found, np.zeros((*feedthrough.shape, integrators))], axis=-1),
        integrators=integrators,
        fractions=tuple(fractions),
        # about s = 0 the coefficients ascend, about infinity, in powers of 1/s, they descend
        steady_series=_quotient_series(
            proper[..., ::-1], rest[..., ::-1], integrators + _MAX_INTEGRATIONS
        ),
        markov=_quotient_series(proper, monic, order + _MARKOV_TERMS),
        is_close=is_close,
        fastest_rad_s=moduli.max(axis=-1, initial=0.0),
        slowest_rad_s=moduli.min(axis=-1, initial=np.inf),
    )


@lru_cache(maxsize=1024)
def _modes(numerator: tuple[float, ...], denominator: tuple[float, ...]) -> Modes:
    return make_modes(np.array(numerator), np.array(denominator))


def derived(numerator: FloatArray, denominator: FloatArray) -> FloatArray:
    """Return the numerator of the derivative of an impulse response, without the impulse: s N mod D.

    Numerators (…, n) are strictly proper, denominators (…, n + 1) monic, in descending powers.
    """
    shifted = np.concatenate([numerator[..., 1:], np.zeros_like(numerator[..., :1])], axis=-1)
    return np.asarray(shifted - numerator[..., :1] * denominator[..., 1:])


def _roots(monic: FloatArray) -> ComplexArray:
    """Roots of real polynomials (…, n + 1), each conjugate pair exactly conjugate, upper first."""
    order = monic.shape[-1] - 1
    if order <= 1:
        return -monic[..., 1:].astype(np.complex128)
    if order == 2:
        half = -0.5 * monic[..., 1]
        discriminant = half * half - monic[..., 2]
        distance = np.sqrt(np.abs(discriminant))
        # the root of larger modulus first, the other from the product: no cancellation
        large = half + np.copysign(distance, half)
        small = monic[..., 2] / np.where(large == 0.0, 1.0, large)
        pair = np.stack([half + 1j * distance, half - 1j * distance], axis=-1)
        apart = np.stack([large, small], axis=-1)
        return np.where(discriminant[..., None] < 0.0, pair, apart)
    companion = np.zeros((*monic.shape[:-1], order, order))
    companion[..., 0, :] = -monic[..., 1:]
    companion[..., range(1, order), range(order - 1)] = 1.0
    found = np.linalg.eigvals(companion).astype(np.complex128)
    return np.take_along_axis(found, np.argsort(-found.imag, axis=-1, kind="stable"), axis=-1)


def _quotient_series(numerator: FloatArray, denominator: FloatArray, length: int) -> FloatArray:
    """First terms of the power series numerator / denominator, coefficients ascending. (length, …)"""
    # Of one system plain numbers: as arrays without axes they take several times as long.
    is_one = denominator.ndim == 1
    given, divisors = (
        one.tolist() if is_one else [*np.moveaxis(one, -1, 0)] for one in (numerator, denominator)
    )
    first, *carried = divisors
    terms: list[Any] = []
    for j in range(length):
        term = given[j] if j < len(given) else 0.0 * first
        for i, coefficient in enumerate(carried[:j], start=1):
            term = term - coefficient * terms[j - i]
        terms.append(term / first)
    return np.array(terms)


def _over_factorials(coefficients: FloatArray, offset: int = 0) -> FloatArray:
    """Return c_j / (j + offset)!, j along the first axis."""
    divisors = _FACTORIALS[offset : offset + len(coefficients)]
    return np.asarray(coefficients / divisors.reshape(-1, *(1,) * (coefficients.ndim - 1)))


_BLOCK = 4
"""Terms of a polynomial that Horner's rule takes in a row, beside the other rows: calls cost most."""


def _polynomial(coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """Sum of c_j t^j by Horner's rule: to the bit the same in any batch, as a matrix product is not."""
    if len(coefficients) > _BLOCK:
        whole, shape = _in_blocks(coefficients), coefficients.shape[1:]
        whole = whole.reshape(len(whole), *(1,) * (t.ndim - len(shape)), *shape)
        blocks = _horner([whole[first::_BLOCK] for first in range(_BLOCK)], t)
        return _horner(blocks, np.square(np.square(t)))  # t⁴, for each block
    return _horner(coefficients, t)


def _in_blocks(coefficients: FloatArray) -> FloatArray:
    """Return coefficients with as many of 0 behind them as make whole blocks."""
    missing = -len(coefficients) % _BLOCK
    if not missing:
        return coefficients
    return np.concatenate((coefficients, np.zeros((missing, *coefficients.shape[1:]))))


def _horner(coefficients: Iterable[FloatArray], t: FloatArray) -> FloatArray:
    *lower, total = coefficients
    for term in reversed(lower):
        total = total * t + term
    return np.asarray(total)


def _series_at(mask: BoolArray, series: FloatArray) -> FloatArray:
    """Return series (…, terms, o) where the mask holds, or that of one system. (terms, o, …)"""
    some = _at(mask, series, trailing=2)
    return some[..., None] if some.ndim == 2 else np.moveaxis(some, 0, -1)


def _at(mask: BoolArray, column: npt.NDArray[Any], trailing: int = 0) -> npt.NDArray[Any]:
    """Return the elements of a column of shape B where the mask holds; one system has no B."""
    if column.ndim == trailing:
        return column
    return np.broadcast_to(column, mask.shape + column.shape[column.ndim - trailing :])[mask]


def _divided_exponentials(nodes: ComplexArray) -> ComplexArray:
    """Return divided differences exp[x_1 … x_j], j = 1 … m, of each row of nodes (rows, m), equal or not.

    They are the first row of the exponential of the bidiagonal matrix with the nodes on its diagonal
    and ones above (G. Opitz, Z. angew. Math. Mech. 44 (1964) T52), here by scaling and squaring.
    """
    # rows last: the matrices are small and many
    diagonal = np.ascontiguousarray((nodes if nodes.imag.any() else nodes.real).T)
    shift = diagonal.real.max(axis=0)
    diagonal = diagonal - shift
    squarings = np.ceil(np.log2(np.maximum(np.abs(diagonal).max(axis=0), 1.0))).astype(np.int64)
    scale = np.exp2(-squarings.astype(np.float64))
    diagonal *= scale
    term = np.zeros((len(diagonal), *diagonal.shape), diagonal.dtype)
    term[range(len(diagonal)), range(len(diagonal))] = 1.0
    total = term.copy()
    for degree in range(1, _TAYLOR_TERMS):
        product = term * diagonal
        product[:, 1:] += term[:, :-1] * scale
        term = product / degree
        total += term
    for done in range(int(squarings.max(initial=0))):
        rows = np.flatnonzero(squarings > done)
        unfinished = total[:, :, rows]
        total[:, :, rows] = np.einsum("ikr,kjr->ijr", unfinished, unfinished)
    return np.asarray((np.exp(shift) * total[0]).T)


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
        times = self.monotone_between(window_s)
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
        times = self.monotone_between(self._near_end_s(float(allowed.min(initial=np.inf))))
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
        times = self.monotone_between(self._near_end_s(distance))
        reached = np.flatnonzero(np.copysign(1.0, level) * self.value(times) >= abs(level))
        if not reached.size:
            return None
        first = int(reached[0])
        if first == 0:
            return 0.0
        around = (times[first - 1 : first], times[first : first + 1])
        return float(self._reached_s(np.array([level]), *around)[0])

    def monotone_between(self, window_s: float) -> FloatArray:
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
