"""One manoeuvre of a flight: a reference that changes, and what answers it."""

from __future__ import annotations

from collections import Counter
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from planner.identify.lean import is_at_lean_limit
from planner.identify.segments import FlightPart, speed_along_m_s, speed_over_ground_m_s
from planner.values import Value, force_setattr, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, ComplexArray, FloatArray
    from planner.logs.record import FlightRecord
    from planner.physics.response import Modes


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


class Manoeuvre(Value, eq=False, dict=True):
    """Reference and answer at even steps of time, from rest before the reference changes.

    The system is taken to be at rest, except for constant offsets, until then.

    Raises ValueError if the arrays do not fit together or are not finite, the times are not evenly
    spaced, the reference never changes, or there is no sample before it does.
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
            force_setattr(self, name, column)
        shapes = self.time_s.shape, self.reference.shape, self.answer.shape
        if len(set(shapes)) > 1:
            msg = f"time, reference and answer of a manoeuvre must have one length, got {shapes}"
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

    @cached_property
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
        """Return the manoeuvre up to a time after its command, inclusive."""
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

        The edge (:attr:`edge_order`) is answered at 0, 1, 2, … sampling steps after it, (…, n).
        """
        samples = self.time_s.size
        if self.has_many_edges:
            return self.answer_from_transform(self.transform(answer_to_edge))
        total = np.zeros((*answer_to_edge.shape[:-1], samples))
        for position, size in self._edges:
            total[..., position:] += size * answer_to_edge[..., : samples - position]
        return total

    @property
    def has_many_edges(self) -> bool:
        """Whether its answer comes faster from a transform than from each edge."""
        return len(self._edges) > _MANY_EDGES

    def transform(self, answer_to_edge: FloatArray) -> ComplexArray:
        """Return the transform of an answer to one edge, that of all manoeuvres of one length."""
        samples = self.time_s.size
        answer: ComplexArray = np.fft.rfft(answer_to_edge[..., :samples], self._transform_size)
        return answer

    def answer_from_transform(self, transform: ComplexArray) -> FloatArray:
        """Answer of a linear system to the reference, from the transform of that to one edge."""
        convolved = np.fft.irfft(self._train * transform, self._transform_size)
        return np.asarray(convolved[..., : self.time_s.size])

    @property
    def _transform_size(self) -> int:
        return 1 << (2 * self.time_s.size - 1).bit_length()

    @cached_property
    def _train(self) -> ComplexArray:
        """The transform of the edges."""
        train = np.zeros(self.time_s.size)
        for position, size in self._edges:
            train[position] = size
        transform: ComplexArray = np.fft.rfft(train, self._transform_size)
        return transform

    @property
    def edge_order(self) -> int:
        """0 where the reference is made of steps, 1 where it is made of ramps."""
        return int(self.reference_form is ReferenceForm.LINEAR)

    @cached_property
    def _edges(self) -> list[tuple[int, float]]:
        """Position and size of each edge of the reference. [input s^-order]"""
        if self.reference_form is ReferenceForm.HELD:
            sizes = np.diff(self.reference, prepend=self.reference[0])
        else:
            slopes = np.diff(self.reference) / self.step_s
            sizes = np.diff(slopes, prepend=0.0)
        return [(int(position), float(sizes[position])) for position in np.flatnonzero(sizes)]


def simulated_answers(
    modes: Modes,
    delay_s: float | FloatArray,
    manoeuvres: Sequence[Manoeuvre],
    *,
    derivative: int = 0,
) -> list[FloatArray]:
    """Answers of a system to the references of manoeuvres, in closed form.

    A stack of systems has batch shape (…, 1), its delays broadcast against it. Answers (…, n) are
    without offset, at the times of each manoeuvre; ``derivative`` 1 gives their slopes. [output
    s^-derivative]
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
    transforms: dict[tuple[float, int, int], ComplexArray] = {}
    answers = []
    for one in manoeuvres:
        edge = edges[one.step_s, one.edge_order]
        if not one.has_many_edges:
            answers.append(one.answer_from(edge))
            continue
        like = (one.step_s, one.edge_order, one.time_s.size)
        if like not in transforms:
            transforms[like] = one.transform(edge)
        answers.append(one.answer_from_transform(transforms[like]))
    return answers


_HELD_OUT_EVERY = 4
_REST_S = 10.0
"""Rest that is kept before a command: more does not improve the offset."""
_LEAST_REST_S = 2.0
_LONGEST_S = 120.0
_HELD_S = 5.0
"""Longest that a vehicle which speeds up by itself leans as far as it may. [s]"""
_PAUSE_S = 2.0
"""A reference that does not move for less is still on its way."""
_LEAST_STEP_M = 2.0
_LEAST_SPEED_M_S = 1.0
_TAKE_OFF_S = 10.0
"""From the step of a height until the vehicle has left the ground: motors and delay. [s]"""
_STILL_M = 0.02
_STILL_M_S = 0.02
"""Change of a reference from sample to sample that is none."""
_STEPPED = 0.5
"""Fraction of the change in one sample from which on a reference is a step. [-]"""


class ResponseKind(StrEnum):
    """What answers a command; the names of the responses of a vehicle model."""

    ALTITUDE = "altitude"
    CLIMB_POWER = "climb_power"
    DESCENT_POWER = "descent_power"
    SPEED = "speed"
    BRAKE_POWER = "brake_power"


POWERS = (ResponseKind.CLIMB_POWER, ResponseKind.DESCENT_POWER, ResponseKind.BRAKE_POWER)


class ManoeuvreCut(FlightPart):
    """A command of a record while its reference changes, and the manoeuvre it gives for one answer."""

    answer: ResponseKind
    change: float
    """How far the reference changes. [m or m/s]"""
    manoeuvre: Manoeuvre | None
    refusal: str = ""
    """Why there is no manoeuvre; empty where there is one."""

    @property
    def is_used(self) -> bool:
        """Whether there is a manoeuvre."""
        return self.manoeuvre is not None


class _Command(Value):
    """A span in which a reference changes: sample before it, and sample it has ended at."""

    first: int
    end: int
    change: float
    form: ReferenceForm


class _Signal(NamedTuple):
    """Columns of a record: reference, and what answers it."""

    answer: ResponseKind
    reference: FloatArray
    column: FloatArray


def cut_manoeuvres(
    record: FlightRecord, *, hover_power_w: FloatArray | None = None
) -> tuple[ManoeuvreCut, ...]:
    """Cut the manoeuvres of a record by its references.

    Hover power at each sample, NaN where it is not known, is taken off the power; left out, powers are not
    cut. Every command is returned with every answer to it, used or refused.
    """
    vertical = _commands(record, record.reference_height_m, still=_STILL_M, least=_LEAST_STEP_M)
    level = _commands(record, record.reference_speed_m_s, still=_STILL_M_S, least=_LEAST_SPEED_M_S)
    all_commands = sorted([*vertical, *level], key=lambda command: command.first)
    height = _Signal(ResponseKind.ALTITUDE, record.reference_height_m, record.height_above_home_m)
    speed = _Signal(ResponseKind.SPEED, record.reference_speed_m_s, speed_over_ground_m_s(record))
    wanted = [(command, height) for command in vertical] + [(command, speed) for command in level]
    if hover_power_w is not None:
        power_w = record.power_w - hover_power_w
        for command in vertical:
            kind = ResponseKind.CLIMB_POWER if command.change > 0.0 else ResponseKind.DESCENT_POWER
            wanted.append((command, _Signal(kind, record.reference_height_m, power_w)))
        brake = _Signal(ResponseKind.BRAKE_POWER, record.reference_speed_m_s, power_w)
        wanted += [(command, brake) for command in level if command.change < 0.0]
    cuts = [_cut(record, command, all_commands, signal) for command, signal in wanted]
    return tuple(sorted(cuts, key=lambda cut: cut.start_s))


def hold_out(cuts: Sequence[ManoeuvreCut]) -> tuple[ManoeuvreCut, ...]:
    """Keep the last of every four manoeuvres of each answer and direction from the fit."""
    seen: Counter[tuple[ResponseKind, bool]] = Counter()
    marked = []
    for cut in cuts:
        manoeuvre = cut.manoeuvre
        if manoeuvre is not None:
            kind = (cut.answer, cut.change > 0.0)
            seen[kind] += 1
            manoeuvre = replace(manoeuvre, is_held_out=seen[kind] % _HELD_OUT_EVERY == 0)
        marked.append(replace(cut, manoeuvre=manoeuvre))
    return tuple(marked)


def _commands(
    record: FlightRecord, reference: FloatArray, *, still: float, least: float
) -> list[_Command]:
    steps = np.diff(reference)
    moving = np.flatnonzero(np.abs(np.nan_to_num(steps)) > still)
    if not moving.size:
        return []
    apart = np.flatnonzero(np.diff(moving) > _PAUSE_S / record.step_s)
    firsts = moving[np.concatenate([[0], apart + 1])]
    ends = moving[np.concatenate([apart, [moving.size - 1]])] + 1
    commands = []
    for first, end in zip(firsts.tolist(), ends.tolist(), strict=True):
        change = float(reference[end] - reference[first])
        largest = float(np.nanmax(np.abs(steps[first:end])))
        form = ReferenceForm.HELD if largest >= _STEPPED * abs(change) else ReferenceForm.LINEAR
        # who answers a step leaves the ground later
        waits = round(_TAKE_OFF_S / record.step_s) if form is ReferenceForm.HELD else 0
        if not abs(change) >= least or record.is_landed[first : end + waits + 1].all():
            continue
        commands.append(_Command(first=first, end=end, change=change, form=form))
    return commands


def _in_the_air(is_landed: BoolArray, start: int, first: int, end: int) -> tuple[int, int]:
    """Return where a step from the ground has lifted off, and where one to the ground has landed.

    A step in the air has done so at its command; the article's count from and to the ground.
    """
    flown = np.flatnonzero(~is_landed[first + 1 : end]) + first + 1
    if not flown.size:
        return first, end
    landed = np.flatnonzero(is_landed[flown[0] : end])
    lifted = int(flown[0]) if is_landed[start : first + 1].all() else first
    return lifted, int(flown[0] + landed[0]) if landed.size else end


def _cut(
    record: FlightRecord, command: _Command, commands: Sequence[_Command], signal: _Signal
) -> ManoeuvreCut:
    others = [other for other in commands if other is not command]
    last_end = max((o.end for o in others if o.first <= command.first), default=0)
    start = max(command.first - round(_REST_S / record.step_s), last_end)
    next_first = min(
        (o.first for o in others if o.first > command.first), default=record.time_s.size - 1
    )
    end = min(next_first, command.end + round(_LONGEST_S / record.step_s)) + 1
    lifted = command.first
    if command.form is ReferenceForm.HELD:
        lifted, end = _in_the_air(record.is_landed, start, command.first, end)
    part = slice(start, end)
    manoeuvre: Manoeuvre | None = None
    refusal = ""
    if record.is_landed[start if lifted == command.first else lifted : end].any():
        refusal = "begins or ends on the ground"
    elif last_end > command.first:
        refusal = "another reference changes at the same time"
    elif (command.first - start) * record.step_s < _LEAST_REST_S:
        refusal = f"less than {_LEAST_REST_S:g} s of rest before the command"
    elif next_first < command.end:
        refusal = "another reference changes before this one has arrived"
    elif signal.answer is ResponseKind.SPEED and (
        np.count_nonzero(is_at_lean_limit(record)[part]) * record.step_s > _HELD_S
    ):
        refusal = "held at the greatest lean angle, whatever speed is commanded"
    elif not np.isfinite(signal.column).any() and signal.answer in POWERS:
        has_power = np.isfinite(record.power_w).any()
        refusal = "no hover power to count from" if has_power else "no power in the log"
    elif not np.isfinite([signal.column[part], signal.reference[part]]).all():
        refusal = "the log does not hold the answer or the reference throughout"
    else:
        # what creeps by less than the limit before the command is rest
        shaped = signal.reference[part].copy()
        shaped[: command.first - start + 1] = shaped[command.first - start]
        is_speed = signal.answer is ResponseKind.SPEED
        answer = speed_along_m_s(record, part) if is_speed else signal.column[part].copy()
        if lifted > command.first and signal.answer is ResponseKind.CLIMB_POWER:
            answer[: lifted - start] = 0.0  # on the ground there is no power of a hover to be above
        manoeuvre = Manoeuvre(
            time_s=record.time_s[part],
            reference=shaped,
            answer=answer,
            reference_form=command.form,
            source=f"{record.source}#{record.number}",
        )
    return ManoeuvreCut.within(
        record,
        answer=signal.answer,
        start_s=float(record.time_s[command.first]),
        change=command.change,
        duration_s=(command.end - command.first) * record.step_s,
        manoeuvre=manoeuvre,
        refusal=refusal,
    )
