"""Manoeuvres cut from records where a reference changes, each used or refused with its reason.

A command is a stretch in which a reference changes: one sample for a step, seconds for a reference
that an autopilot shapes.  Its manoeuvre reaches from the rest before it to the next command.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.identify.manoeuvre import Manoeuvre, ReferenceForm
from planner.identify.steady import speed_through_air_m_s

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]
    BoolArray = npt.NDArray[np.bool_]

_REST_S = 10.0
"""Rest that is kept before a command: more tells the offset no better."""
_LEAST_REST_S = 2.0
_LONGEST_S = 120.0
_PAUSE_S = 2.0
"""A reference that stands still for less is still on its way."""
_LEAST_STEP_M = 2.0
_LEAST_SPEED_M_S = 1.0
_STILL_M = 0.02
_STILL_M_S = 0.02
"""Change of a reference from sample to sample that is none."""
_STEPPED = 0.5
"""Share of the change in one sample from which on a reference is a step. [-]"""


class Answer(StrEnum):
    """What answers a command; the names of the responses of a vehicle model."""

    ALTITUDE = "altitude"
    CLIMB_POWER = "climb_power"
    DESCENT_POWER = "descent_power"
    SPEED = "speed"
    BRAKE_POWER = "brake_power"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """A command of a record, and the manoeuvre it gives for one answer, if any."""

    answer: Answer
    start_s: float
    """When the reference begins to change, in the record. [s]"""
    change: float
    """How far the reference changes. [m or m/s]"""
    duration_s: float
    """How long the reference changes. [s]"""
    log: str
    """File name of the log."""
    flight: int
    """Which flight of the log, from 1."""
    manoeuvre: Manoeuvre | None
    refusal: str = ""
    """Why there is no manoeuvre; empty where there is one."""

    @property
    def is_used(self) -> bool:
        """Whether there is a manoeuvre."""
        return self.manoeuvre is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Command:
    """A stretch in which a reference changes: sample before it, and sample it has ended at."""

    first: int
    end: int
    change: float
    form: ReferenceForm


class _Signal(NamedTuple):
    """Columns of a record: what was told, and what answers."""

    answer: Answer
    reference: FloatArray
    column: FloatArray


def cut_manoeuvres(
    record: FlightRecord, *, hover_power_w: FloatArray | None = None
) -> tuple[Cut, ...]:
    """Cut the manoeuvres of a record that its references tell.

    Parameters
    ----------
    record : FlightRecord
        One flight.
    hover_power_w : ndarray, shape (n,), optional
        Hover power at each sample, to be taken off the power; left out, powers are not cut. [W]

    Returns
    -------
    tuple of Cut
        Every command with every answer to it, used or refused.
    """
    step_s = float(record.time_s[1] - record.time_s[0])
    vertical = _commands(
        record.reference_height_m, record.is_landed, step_s, still=_STILL_M, least=_LEAST_STEP_M
    )
    level = _commands(
        record.reference_speed_m_s,
        record.is_landed,
        step_s,
        still=_STILL_M_S,
        least=_LEAST_SPEED_M_S,
    )
    all_commands = sorted([*vertical, *level], key=lambda command: command.first)
    height = _Signal(Answer.ALTITUDE, record.reference_height_m, record.height_above_home_m)
    speed = _Signal(Answer.SPEED, record.reference_speed_m_s, speed_through_air_m_s(record))
    wanted = [(command, height) for command in vertical] + [(command, speed) for command in level]
    if hover_power_w is not None:
        power_w = record.power_w - hover_power_w
        for command in vertical:
            kind = Answer.CLIMB_POWER if command.change > 0.0 else Answer.DESCENT_POWER
            wanted.append((command, _Signal(kind, record.reference_height_m, power_w)))
        brake = _Signal(Answer.BRAKE_POWER, record.reference_speed_m_s, power_w)
        wanted += [(command, brake) for command in level if command.change < 0.0]
    cuts = [_cut(record, command, all_commands, signal) for command, signal in wanted]
    return tuple(sorted(cuts, key=lambda cut: cut.start_s))


def hold_out(cuts: Sequence[Cut], *, every: int = 4) -> tuple[Cut, ...]:
    """Keep some of the manoeuvres of each answer from the fit.

    Parameters
    ----------
    cuts : sequence of Cut
        Of any number of flights.
    every : int
        Of as many manoeuvres of one answer and direction the last is held out.

    Returns
    -------
    tuple of Cut
        The same, some manoeuvres marked.
    """
    seen: dict[tuple[Answer, bool], int] = {}
    marked = []
    for cut in cuts:
        if cut.manoeuvre is None:
            marked.append(cut)
            continue
        kind = (cut.answer, cut.change > 0.0)
        seen[kind] = seen.get(kind, 0) + 1
        is_held_out = seen[kind] % every == 0
        manoeuvre = replace(cut.manoeuvre, is_held_out=is_held_out)
        marked.append(replace(cut, manoeuvre=manoeuvre))
    return tuple(marked)


def _commands(
    reference: FloatArray, is_landed: BoolArray, step_s: float, *, still: float, least: float
) -> list[_Command]:
    """Return the stretches in which a reference changes in flight."""
    steps = np.diff(reference)
    moving = np.flatnonzero(np.abs(np.nan_to_num(steps)) > still)
    if not moving.size:
        return []
    apart = np.flatnonzero(np.diff(moving) > _PAUSE_S / step_s)
    firsts = moving[np.concatenate([[0], apart + 1])]
    ends = moving[np.concatenate([apart, [moving.size - 1]])] + 1
    commands = []
    for first, end in zip(firsts.tolist(), ends.tolist(), strict=True):
        change = float(reference[end] - reference[first])
        largest = float(np.nanmax(np.abs(steps[first:end])))
        if not abs(change) >= least or is_landed[first : end + 1].all():
            continue
        form = ReferenceForm.HELD if largest >= _STEPPED * abs(change) else ReferenceForm.LINEAR
        commands.append(_Command(first=first, end=end, change=change, form=form))
    return commands


def _cut(
    record: FlightRecord,
    command: _Command,
    commands: Sequence[_Command],
    signal: _Signal,
) -> Cut:
    """Cut one answer to one command out of a record, or say why not."""
    step_s = float(record.time_s[1] - record.time_s[0])
    others = [other for other in commands if other is not command]
    last_end = max((o.end for o in others if o.first <= command.first), default=0)
    start = max(command.first - round(_REST_S / step_s), last_end)
    next_first = min(
        (o.first for o in others if o.first > command.first), default=record.time_s.size - 1
    )
    end = min(next_first, command.end + round(_LONGEST_S / step_s)) + 1
    part = slice(start, end)
    manoeuvre: Manoeuvre | None = None
    refusal = ""
    if record.is_landed[part].any():
        refusal = "begins or ends on the ground"
    elif last_end > command.first:
        refusal = "another reference changes at the same time"
    elif (command.first - start) * step_s < _LEAST_REST_S:
        refusal = f"less than {_LEAST_REST_S:g} s of rest before the command"
    elif next_first < command.end:
        refusal = "another reference changes before this one has arrived"
    elif not np.isfinite([signal.column[part], signal.reference[part]]).all():
        refusal = "the log does not tell the answer or the reference throughout"
    else:
        # what creeps by less than the limit before the command is rest
        shaped = signal.reference[part].copy()
        shaped[: command.first - start + 1] = shaped[command.first - start]
        manoeuvre = Manoeuvre(
            time_s=record.time_s[part],
            reference=shaped,
            answer=signal.column[part],
            reference_form=command.form,
            source=f"{record.source}#{record.number}",
        )
    return Cut(
        answer=signal.answer,
        start_s=float(record.time_s[command.first]),
        change=command.change,
        duration_s=(command.end - command.first) * step_s,
        log=record.source,
        flight=record.number,
        manoeuvre=manoeuvre,
        refusal=refusal,
    )
