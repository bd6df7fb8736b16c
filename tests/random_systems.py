"""Hypothesis strategies of random rational systems, given by their poles."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from planner.physics.response import MAX_ORDER, TransferFunction


@st.composite
def poles(draw: st.DrawFn, *, damped: bool = True) -> list[complex]:
    """Poles of a stable system: real and complex, some repeated exactly or very nearly.

    Without ``damped`` there are undamped pairs and poles at the origin as well.
    """
    order = draw(st.integers(1, MAX_ORDER))
    found: list[complex] = []
    while len(found) < order:
        modulus = 10.0 ** draw(st.floats(-1.5, 1.0))
        if found and draw(st.integers(0, 3)) == 0:
            pole = found[-1] * (1.0 + draw(st.sampled_from([0.0, 1e-9, 1e-5, 1e-2])))
        elif not damped and draw(st.integers(0, 3)) == 0:
            pole = draw(st.sampled_from([0.0, 1j])) * modulus
        elif draw(st.booleans()):
            angle = draw(st.floats(0.05, 1.5))
            pole = complex(modulus * (-np.cos(angle) + 1j * np.sin(angle)))
        else:
            pole = complex(-modulus)
        if pole.imag == 0.0:
            found.append(pole)
        elif len(found) + 2 <= order:
            found += [pole.conjugate(), pole]
    return found


def denominator(of: list[complex]) -> tuple[float, ...]:
    """Coefficients of the monic polynomial with these roots; those at the origin exactly."""
    apart = [pole for pole in of if pole]
    return (*np.atleast_1d(np.poly(apart)).real.tolist(), *[0.0] * (len(of) - len(apart)))


@st.composite
def systems(draw: st.DrawFn, *, damped: bool = True) -> TransferFunction:
    """Random system with a numerator of any degree that is proper, and a delay."""
    of = draw(poles(damped=damped))
    coefficient = st.floats(-2.0, 2.0).map(lambda c: round(c, 3))
    numerator = draw(st.lists(coefficient, min_size=1, max_size=len(of) + 1))
    return TransferFunction(
        numerator=tuple(numerator),
        denominator=denominator(of),
        delay_s=draw(st.sampled_from([0.0, 0.5, 2.9])),
    )
