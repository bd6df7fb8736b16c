r"""Impulse responses of rational systems, integrated any number of times, in closed form.

Everything the planner asks of a linear model is one function of time,

.. math:: I_k(t) = \mathcal{L}^{-1}\{ H(s) / s^k \}(t),

the impulse response :math:`h = I_0` integrated k times (differentiated for k < 0): the answer to a
unit step is :math:`I_1`, its slope :math:`I_0`, its integral and the answer to a unit ramp
:math:`I_2`.  With :math:`H(s) = d + N(s) / (s^z \tilde D(s))`, :math:`\tilde D(0) \ne 0`:

Separated poles
    Partial fractions, residues by products of pole differences,

    .. math:: I_k(t) = \sum_i r_i p_i^{-(z+k)} e^{p_i t}
              + \sum_{j < z + k} m_j \frac{t^{z+k-1-j}}{(z+k-1-j)!},
              \qquad N / \tilde D = \sum_j m_j s^j .

Early times, t below the time constant of the fastest mode
    The Taylor series :math:`\sum_j M_j t^{j+k} / (j+k)!` of the Markov parameters
    :math:`M_j = h^{(j)}(0)`; the sum above would lose its digits to cancellation there.
Middle times, fast modes over, slow ones hardly begun
    Mode by mode, with :math:`\varphi_k(x) = \sum_j x^j / (j+k)!`,

    .. math:: I_k(t) = \sum_{j < z} M_j \frac{t^{j+k}}{(j+k)!}
              + \sum_i r_i t^{z+k} \varphi_{z+k}(p_i t) .

Clustered poles
    Repeated, nearly repeated and close poles are summed by `planner.physics.clusters` without
    dividing by their differences.

Against 150-digit arithmetic (``tests/physics/test_modes.py``), relative to the largest value so
far, from 0.001 to 30 time constants of the fastest mode: 1e-13 for systems up to the third order,
2e-9 for the worst of a thousand random ones of the sixth with repeated and nearly repeated poles.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from planner.frozen import frozen
from planner.physics.clusters import (
    ClusteredModes,
    DecayTerms,
    growth_rate,
    is_clustered,
    neighbours,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    FloatArray: TypeAlias = npt.NDArray[np.float64]
    ComplexArray: TypeAlias = npt.NDArray[np.complex128]
    ModeArray: TypeAlias = npt.NDArray[Any]  # real for real poles, else complex


MAX_INTEGRATIONS = 5
"""Highest k: the integral of the answer to an input that grows with the cube of time."""

_EARLY_RADIANS = 1.0  # of the fastest mode; before, the Taylor series is summed
_EARLY_TERMS = 20  # 1 / 20! is 4e-19; the order of the system is added


def roots(coefficients: FloatArray) -> ComplexArray:
    """Roots of real polynomials, each conjugate pair exactly conjugate.

    Parameters
    ----------
    coefficients : ndarray, shape (…, n + 1)
        Descending powers, leading and trailing coefficient not zero.

    Returns
    -------
    ndarray, shape (…, n)
        Roots, imaginary parts descending.
    """
    order = coefficients.shape[-1] - 1
    batch = coefficients.shape[:-1]
    if order == 0:
        return np.zeros((*batch, 0), dtype=np.complex128)
    monic = coefficients[..., 1:] / coefficients[..., :1]
    if order == 1:
        return -monic.astype(np.complex128)
    if order == 2:
        half = -0.5 * monic[..., 0]
        product = monic[..., 1]
        discriminant = half * half - product
        distance = np.sqrt(np.abs(discriminant))
        # the root of larger modulus first, the other from the product: no cancellation
        large = half + np.copysign(distance, half)
        small = product / np.where(large == 0.0, 1.0, large)
        complex_pair = discriminant < 0.0
        first = np.where(complex_pair, half + 1j * distance, large)
        second = np.where(complex_pair, half - 1j * distance, small)
        return np.stack([first, second], axis=-1)
    companion = np.zeros((*batch, order, order))
    companion[..., 0, :] = -monic
    rows = np.arange(1, order)
    companion[..., rows, rows - 1] = 1.0
    found = np.linalg.eigvals(companion).astype(np.complex128)
    ranking = np.argsort(-found.imag, axis=-1, kind="stable")
    return np.take_along_axis(found, ranking, axis=-1)


@frozen(eq=False)
class Modes:
    """The poles of one system or of a stack of systems, ready to be summed over time.

    Arrays carry the batch shape B of the stack (empty for one system) behind their own axis.
    """

    shape: tuple[int, ...]
    """Batch shape B."""

    feedthrough: FloatArray
    """Direct term d. [output/input], shape B"""

    integrators: int
    """Poles at the origin z, the same for all systems."""

    poles: tuple[ModeArray, ...]
    """Poles other than the origin, one of each conjugate pair. [rad s⁻¹], each of shape B"""

    residues: tuple[ModeArray, ...]
    """Residues of N/D̃, twice for a conjugate pair, each of shape B."""

    origin_series: tuple[FloatArray | float, ...]
    """Taylor coefficients m_j of N/D̃ about s = 0, each of shape B."""

    markov: tuple[FloatArray | float, ...]
    """Markov parameters M_j, each of shape B."""

    fastest_rad_s: FloatArray
    """Largest modulus of a pole. [rad s⁻¹], shape B"""

    slowest_rad_s: FloatArray
    """Smallest modulus of a pole other than the origin. [rad s⁻¹], shape B"""

    clusters: tuple[tuple[int, ClusteredModes], ...]
    """Systems with clustered poles by their flat index in B."""

    def impulse_integral(self, t_s: npt.ArrayLike, k: int) -> FloatArray:
        """Impulse response integrated k times, :math:`I_k`.

        Parameters
        ----------
        t_s : array_like
            Time since the impulse, broadcast against B; before it the result is 0. [s]
        k : int
            Number of integrations, at most `MAX_INTEGRATIONS`; negative for derivatives, from
            which impulses at t = 0 are left out.

        Returns
        -------
        ndarray
            :math:`I_k(t)`, right-continuous at 0, in the broadcast shape. [output/input · s^(k-1)]
        """
        if k > MAX_INTEGRATIONS:
            msg = f"an impulse response is integrated {MAX_INTEGRATIONS} times at most, not {k}"
            raise ValueError(msg)
        t = np.asarray(t_s, dtype=np.float64)
        before = t < 0.0
        if not self.shape and t.shape and before.any():
            result = np.zeros(t.shape)
            since = ~before
            result[since] = self._after_impulse(t[since], k)
            return result
        return np.where(before, 0.0, self._after_impulse(np.maximum(t, 0.0), k))

    def _after_impulse(self, since: FloatArray, k: int) -> FloatArray:
        """Impulse response integrated k times, at times since the impulse."""
        total = np.zeros(np.broadcast_shapes(since.shape, self.shape))
        if not self.clusters or self.shape:
            self._add_modes(total, since, k)
            self._replace_middle_times(total, since, k)
        self._replace_clusters(total, since, k)
        self._replace_early_times(total, since, k)
        if k > 0 and self.feedthrough.any():
            total += self.feedthrough * since ** (k - 1) / math.factorial(k - 1)
        return total

    def decay_terms(self, k: int) -> DecayTerms:
        """Bound of the exponential part of the k-fold integral; one system only."""
        if self.clusters:
            return self.clusters[0][1].decay_terms(k)
        return DecayTerms(
            rates=growth_rate(np.array(self.poles)),
            degrees=np.zeros(len(self.poles), dtype=np.int64),
            magnitudes=np.array(
                [
                    np.abs(r / p ** (self.integrators + k))
                    for p, r in zip(self.poles, self.residues, strict=True)
                ]
            ),
        )

    def polynomial_part(self, k: int) -> tuple[float, ...]:
        """Coefficients c_j of the part sum of c_j t^j / j! of the k-fold integral; one system."""
        powers = max(self.integrators + k, 0)
        coefficients = [float(m) for m in self.origin_series[:powers][::-1]]
        if k > 0:
            coefficients[k - 1] += float(self.feedthrough)
        return tuple(coefficients)

    def _add_modes(self, total: FloatArray, t: FloatArray, k: int) -> None:
        powers = self.integrators + k
        for pole, residue in zip(self.poles, self.residues, strict=True):
            weight = residue / pole**powers
            if np.iscomplexobj(weight):
                turn = pole.imag * t
                wave = weight.real * np.cos(turn) - weight.imag * np.sin(turn)
                total += np.exp(pole.real * t) * wave
            else:
                total += weight * np.exp(pole * t)
        if powers > 0:
            total += _power_sum(self.origin_series[:powers][::-1], t)

    def _replace_middle_times(self, total: FloatArray, t: FloatArray, k: int) -> None:
        """Sum mode by mode where slow modes have hardly begun and fast ones are over."""
        powers = self.integrators + k
        if powers <= 0 or len(self.poles) < 2:
            return
        middle = (t * self.slowest_rad_s < 1.0) & (t * self.fastest_rad_s >= _EARLY_RADIANS)
        if not middle.any():
            return
        middle = np.broadcast_to(middle, total.shape)
        times = np.broadcast_to(t, total.shape)[middle]
        # differentiated, the first terms are gone
        markov = self.markov[max(-k, 0) : self.integrators]
        here = self._picker(middle)
        whole = times ** max(k, 0) * _power_sum(markov, times, max(k, 0), here)
        for pole, residue in zip(self.poles, self.residues, strict=True):
            whole = whole + (here(residue) * _phi(here(pole) * times, powers)).real * times**powers
        total[middle] = whole

    def _picker(self, mask: npt.NDArray[np.bool_]) -> Callable[[Any], Any]:
        """Return what takes the masked elements of a column of shape B; one system has no B."""
        if not self.shape:
            return _itself
        return lambda column: np.broadcast_to(column, mask.shape)[mask]

    def _replace_clusters(self, total: FloatArray, t: FloatArray, k: int) -> None:
        if not self.clusters:
            return
        times = np.broadcast_to(t, total.shape).ravel()
        systems = np.arange(math.prod(self.shape)).reshape(self.shape)
        systems = np.broadcast_to(systems, total.shape).ravel()
        by_system = np.argsort(systems, kind="stable")
        indices = [index for index, _ in self.clusters]
        first = np.searchsorted(systems[by_system], indices, side="left")
        last = np.searchsorted(systems[by_system], indices, side="right")
        flat = total.reshape(-1)
        for (_, modes), i, j in zip(self.clusters, first, last, strict=True):
            mine = by_system[i:j]
            flat[mine] = modes.impulse_integral(times[mine], k)

    def _replace_early_times(self, total: FloatArray, t: FloatArray, k: int) -> None:
        early = t * self.fastest_rad_s < _EARLY_RADIANS
        if not early.any():
            return
        early = np.broadcast_to(early, total.shape)
        times = np.broadcast_to(t, total.shape)[early]
        series = _power_sum(self.markov[max(-k, 0) :], times, max(k, 0), self._picker(early))
        total[early] = times ** max(k, 0) * series


def make_modes(numerators: FloatArray, denominators: FloatArray) -> Modes:
    """Modes of one system or of a stack of systems of the same order.

    Parameters
    ----------
    numerators, denominators : ndarray, shapes (…, m + 1) and (…, n + 1)
        Coefficients in descending powers of s, m ≤ n, leading denominator coefficient not zero,
        the same number of poles at the origin in every system.

    Returns
    -------
    Modes
        Poles, residues and series of shape (…).
    """
    shape = denominators.shape[:-1]
    order = denominators.shape[-1] - 1
    leading = denominators[..., :1]
    monic = denominators / leading
    padded = np.zeros((*shape, order + 1))
    padded[..., order + 1 - numerators.shape[-1] :] = numerators / leading
    feedthrough = padded[..., 0]
    proper = padded[..., 1:] - feedthrough[..., None] * monic[..., 1:]

    integrators = 0
    while integrators < order and not np.any(monic[..., order - integrators]):
        integrators += 1
    rest = monic[..., : order + 1 - integrators]
    poles = roots(rest)
    clustered = np.asarray(is_clustered(poles))
    columns = _separated_modes(poles, proper, clustered)
    return Modes(
        shape=shape,
        feedthrough=feedthrough,
        integrators=integrators,
        poles=tuple(pole for pole, _ in columns),
        residues=tuple(residue for _, residue in columns),
        # about s = 0 the coefficients ascend
        origin_series=_quotient_series(
            proper[..., ::-1], rest[..., ::-1], integrators + MAX_INTEGRATIONS
        ),
        # about infinity, in powers of 1/s, they descend
        markov=_quotient_series(proper, monic, order + _EARLY_TERMS),
        fastest_rad_s=np.abs(poles).max(axis=-1, initial=0.0),
        slowest_rad_s=np.abs(poles).min(axis=-1, initial=np.inf),
        clusters=tuple(
            (
                flat,
                ClusteredModes(
                    numerator=proper[index],
                    groups=neighbours(poles[index]),
                    integrators=integrators,
                ),
            )
            for flat, index in enumerate(np.ndindex(shape))
            if clustered[index]
        )
        if np.any(clustered)
        else (),
    )


def _separated_modes(
    poles: ComplexArray,
    proper: FloatArray,
    clustered: npt.NDArray[np.bool_],
) -> list[tuple[ModeArray, ModeArray]]:
    """Pole and residue columns; those of lower conjugates only where a real pole shares them."""
    columns: list[tuple[ModeArray, ModeArray]] = []
    for i in range(poles.shape[-1]):
        pole = poles[..., i]
        # 2 for the upper pole of a pair, which stands for both, 0 for the lower
        weight = 1.0 + np.sign(pole.imag)
        weight = np.where(clustered, 0.0, weight)
        if not np.any(weight):
            continue
        residue = np.zeros(pole.shape, dtype=np.complex128)
        for b in range(proper.shape[-1]):
            residue = residue * pole + proper[..., b]
        divisor = np.ones(pole.shape, dtype=np.complex128)
        for j in range(poles.shape[-1]):
            if j != i:
                divisor = divisor * np.where(clustered, 1.0, pole - poles[..., j])
        residue = weight * residue / divisor
        pole = np.where(clustered, -1.0, pole)
        if np.any(pole.imag):
            columns.append((pole, residue))
        else:
            columns.append((pole.real.copy(), residue.real.copy()))
    return columns


def _quotient_series(
    numerator: FloatArray, denominator: FloatArray, length: int
) -> tuple[FloatArray | float, ...]:
    """First terms of the power series numerator / denominator, coefficients ascending."""
    terms: list[FloatArray] = []
    for j in range(length):
        term = numerator[..., j] if j < numerator.shape[-1] else np.zeros(numerator.shape[:-1])
        for i in range(1, min(j, denominator.shape[-1] - 1) + 1):
            term = term - denominator[..., i] * terms[j - i]
        terms.append(term / denominator[..., 0])
    return tuple(terms) if terms and terms[0].shape else tuple(float(term) for term in terms)


def _itself(column: ModeArray | float) -> ModeArray | float:
    return column


def _power_sum(
    coefficients: Sequence[ModeArray | float],
    t: ModeArray,
    offset: int = 0,
    here: Callable[[Any], Any] = _itself,
) -> ModeArray:
    """Sum of here(c_j) t^j / (j + offset)!, by Horner's rule."""
    total: ModeArray = np.zeros(())
    for j in range(len(coefficients) - 1, -1, -1):
        total = total * t + here(coefficients[j]) / math.factorial(j + offset)
    return total


def _phi(z: ModeArray, k: int) -> ModeArray:
    """Sum of z^j / (j + k)!, the unit exponential integrated k times over z^k."""
    near = np.abs(z) < 1.0
    one = np.ones(())
    series = _power_sum([one] * _EARLY_TERMS, np.where(near, z, 0.0), k)
    far = np.where(near, 1.0, z)
    closed = (np.exp(far) - _power_sum([one] * k, far)) / far**k
    return np.where(near, series, closed)
