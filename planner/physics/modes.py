r"""Poles, partial fractions and series of rational systems, from which their answers are summed.

`Modes` sums the impulse response of a system integrated k times, :math:`I_k`, in closed form, exact at
every time; `planner.physics.response` says what that answers.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy.typing as npt

    from planner.arrays import BoolArray, ComplexArray, FloatArray

MAX_ORDER = 3
"""Highest order of a system: what identification can tell."""
_MAX_INTEGRATIONS = 4  # the integral of the answer to an input that grows with the square of time
_CLOSE = 0.1  # poles nearer than this fraction of their modulus lose digits as partial fractions
_TAYLOR_TERMS = 27  # 2^27 / 27! is 1e-20
_MARKOV_TERMS = 21  # of series up to 1: 1 / 21! is 2e-20
_FACTORIALS = np.array(
    [math.factorial(j) for j in range(MAX_ORDER + _TAYLOR_TERMS + _MAX_INTEGRATIONS)], np.float64
)


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
def modes_of(numerator: tuple[float, ...], denominator: tuple[float, ...]) -> Modes:
    """Return the modes of one system, computed once."""
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
