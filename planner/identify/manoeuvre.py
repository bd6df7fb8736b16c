"""One manoeuvre of a flight: a reference that changes, and what answers it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.physics.response import Modes

FloatArray = npt.NDArray[np.float64]

_COLUMNS = ("time_s", "reference", "answer")
_UNEVEN = 1e-6  # of a sampling step: rounding of times in seconds since the epoch
_MANY_EDGES = 16
"""From so many edges on their answers are summed by Fourier transforms."""


class ReferenceForm(StrEnum):
    """What a reference does between two samples."""

    HELD = "held"
    """It keeps the value of the last sample: steps."""
    LINEAR = "linear"
    """It goes straight to the next sample: references shaped by the autopilot."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Manoeuvre:
    """Reference and answer at even steps of time, from rest before the reference changes.

    The system is taken to be at rest, except for constant offsets, until then.

    Raises
    ------
    ValueError
        If the arrays do not fit together or are not finite, the times are not evenly spaced, the
        reference never changes, or there is no sample before it does.
    """

    time_s: FloatArray
    """Sampling times, evenly spaced, on any clock. (n,) [s]"""
    reference: FloatArray
    """What was commanded. (n,) [input]"""
    answer: FloatArray
    """What was measured. (n,) [output]"""
    reference_form: ReferenceForm = ReferenceForm.HELD
    source: str = ""
    """Name of the log it was cut from; manoeuvres of one source share their noise."""
    is_held_out: bool = False
    """Kept from the fit, to test the model on."""

    def __post_init__(self) -> None:
        for name in _COLUMNS:
            column = np.array(getattr(self, name), dtype=np.float64)
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        if not self.time_s.shape == self.reference.shape == self.answer.shape:
            msg = (
                "time, reference and answer of a manoeuvre must have one length, got "
                f"{self.time_s.shape}, {self.reference.shape} and {self.answer.shape}"
            )
            raise ValueError(msg)
        if self.time_s.ndim != 1 or self.time_s.size < 3:
            msg = f"a manoeuvre needs three samples at least, got shape {self.time_s.shape}"
            raise ValueError(msg)
        if not all(np.isfinite(c).all() for c in (self.time_s, self.reference, self.answer)):
            msg = "time, reference and answer of a manoeuvre must be finite"
            raise ValueError(msg)
        steps = np.diff(self.time_s)
        if not steps[0] > 0.0 or np.ptp(steps) > _UNEVEN * max(1.0, abs(self.time_s).max()):
            msg = "the times of a manoeuvre must rise in even steps"
            raise ValueError(msg)
        if not self._changes.size:
            msg = "the reference of a manoeuvre must change"
            raise ValueError(msg)
        if self._changes[0] == 0 and self.reference_form is ReferenceForm.LINEAR:
            msg = "a manoeuvre needs a sample at rest before its reference leaves"
            raise ValueError(msg)

    @property
    def step_s(self) -> float:
        """Time between two samples [s]."""
        step_s = float(self.time_s[-1] - self.time_s[0]) / (self.time_s.size - 1)
        return round(step_s, 9)  # of two manoeuvres of one log it is the same number

    @property
    def _changes(self) -> npt.NDArray[np.intp]:
        return np.flatnonzero(np.diff(self.reference))

    @property
    def first_change(self) -> int:
        """Position of the first sample at which a reference held has changed, one linear leaves."""
        return int(self._changes[0]) + (self.reference_form is ReferenceForm.HELD)

    @property
    def command_s(self) -> float:
        """When the reference first changes [s]."""
        return float(self.time_s[self.first_change])

    @property
    def answer_before(self) -> float:
        """Mean answer before the reference changes: the offset the article removes [output]."""
        return float(self.answer[: self.first_change].mean())

    def up_to(self, window_s: float) -> Manoeuvre:
        """Return the manoeuvre up to a time after its command, inclusive.

        Parameters
        ----------
        window_s : float
            Time after the first change of the reference. [s]
        """
        return self._at(np.flatnonzero(self.time_s <= self.command_s + window_s + _UNEVEN))

    def every(self, count: int) -> Manoeuvre:
        """Return every so manieth sample, the one at the command among them."""
        return self._at(np.arange(self.first_change % count, self.time_s.size, count))

    def _at(self, positions: npt.NDArray[np.intp]) -> Manoeuvre:
        columns = {name: getattr(self, name)[positions] for name in _COLUMNS}
        return replace(self, **columns)

    def answer_from(self, answer_to_edge: FloatArray) -> FloatArray:
        r"""Answer of a linear system to the reference, from its answer to one edge.

        The reference is a sum of edges on the sampling times, steps or ramps, so that

        .. math:: y(t_i) = \sum_k \Delta_k\, s(t_i - t_k)

        is exact, without any approximation between the samples.

        Parameters
        ----------
        answer_to_edge : ndarray, shape (…, n)
            Answer s to a unit edge (:attr:`edge_order`) at 0, 1, 2, … sampling steps after it.

        Returns
        -------
        ndarray, shape (…, n)
            Answer, zero at rest. [output]
        """
        samples = self.time_s.size
        edges = self._edges()
        if len(edges) > _MANY_EDGES:
            train = np.zeros(samples)
            for position, size in edges:
                train[position] = size
            return _convolved(train, answer_to_edge[..., :samples])
        total = np.zeros((*answer_to_edge.shape[:-1], samples))
        for position, size in edges:
            total[..., position:] += size * answer_to_edge[..., : samples - position]
        return total

    @property
    def edge_order(self) -> int:
        """0 where the reference is made of steps, 1 where it is made of ramps."""
        return 0 if self.reference_form is ReferenceForm.HELD else 1

    def _edges(self) -> list[tuple[int, float]]:
        """Position and size of each edge of the reference. [input s^-order]"""
        if self.reference_form is ReferenceForm.HELD:
            sizes = np.diff(self.reference, prepend=self.reference[0])
        else:
            slopes = np.diff(self.reference) / self.step_s
            sizes = np.diff(slopes, prepend=0.0)
        return [(int(position), float(sizes[position])) for position in np.flatnonzero(sizes)]


def _convolved(train: FloatArray, answers: FloatArray) -> FloatArray:
    """Return the causal convolution of a train of edges (n,) with answers (…, n)."""
    samples = train.size
    size = 1 << (2 * samples - 1).bit_length()
    product = np.fft.rfft(train, size) * np.fft.rfft(answers, size)
    return np.asarray(np.fft.irfft(product, size)[..., :samples])


def simulated_answers(
    modes: Modes,
    delay_s: float | FloatArray,
    manoeuvres: Sequence[Manoeuvre],
    *,
    derivative: int = 0,
) -> list[FloatArray]:
    """Answers of a system to the references of manoeuvres, in closed form.

    Parameters
    ----------
    modes : Modes
        Of one system, or of a stack with batch shape (…, 1).
    delay_s : float or ndarray
        Its dead time, broadcast against the batch shape. [s]
    manoeuvres : sequence of Manoeuvre
        Their references, each taken from rest.
    derivative : int
        1 for the slopes of the answers.

    Returns
    -------
    list of ndarray, each shape (…, n)
        Answers without offset, at the times of each manoeuvre. [output s^-derivative]
    """
    longest: dict[tuple[float, int], int] = {}
    for manoeuvre in manoeuvres:
        kind = (manoeuvre.step_s, manoeuvre.edge_order)
        longest[kind] = max(longest.get(kind, 0), manoeuvre.time_s.size)
    edges = {
        (step_s, order): modes.impulse_integral(
            np.arange(samples) * step_s - delay_s, order + 1 - derivative
        )
        for (step_s, order), samples in longest.items()
    }
    return [m.answer_from(edges[m.step_s, m.edge_order]) for m in manoeuvres]
