"""Responses by their Taylor series in 150-digit arithmetic: slow, simple and independent."""

from __future__ import annotations

from decimal import Decimal, localcontext
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def impulse_integral(
    numerator: Sequence[float], denominator: Sequence[float], t_s: float, k: int
) -> float:
    """Impulse response of a rational system integrated k ≥ 0 times, from its power series.

    With H(s) = sum of M_j s^-j by long division, the k-fold integral is the sum of
    M_j t^(j+k-1) / (j+k-1)!; the impulse of M_0 (k = 0) is left out.
    """
    with localcontext() as context:
        context.prec = 150
        order = len(denominator) - 1
        a = [Decimal(float(c)) for c in denominator]
        b = [Decimal(0)] * (order + 1 - len(numerator)) + [Decimal(float(c)) for c in numerator]
        t = Decimal(float(t_s))
        markov: list[Decimal] = []
        total = Decimal(0)
        negligible = 0
        while negligible <= order + 3:
            j = len(markov)
            carried = sum((a[i] * markov[j - i] for i in range(1, min(j, order) + 1)), Decimal(0))
            markov.append(((b[j] if j <= order else Decimal(0)) - carried) / a[0])
            power = j + k - 1
            if power < 0:
                continue
            term = markov[j] * t**power
            for factor in range(2, power + 1):
                term /= factor
            total += term
            small = j > order and abs(term) <= Decimal(10) ** -40 * (
                abs(total) + Decimal(10) ** -40
            )
            negligible = negligible + 1 if small else 0
        return float(total)
