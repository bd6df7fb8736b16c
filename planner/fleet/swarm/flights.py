"""What each agent of a simulated swarm flew, as a flight: with states, energy and transients."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.swarm.simulation import AgentPhase
from planner.flight.motion.kinematics import (
    STATE_INDEX,
    FlightState,
    Motion,
    PolynomialLaw,
    SegmentColumns,
)
from planner.flight.power import NO_TRANSIENTS, Transients
from planner.flight.prediction import make_flight
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.fleet.swarm.simulation import Step, Swarm
    from planner.flight.motion.kinematics import KinematicState, MotionLaw
    from planner.flight.prediction import Flight
    from planner.vehicle.model import VehicleModel

_ACCELERATE, _CRUISE, BRAKE, _HOVER, _LAND = (
    STATE_INDEX[FlightState(name)] for name in ("accelerate", "cruise", "brake", "hover", "land")
)
_REACHED, _LOST = 0.98, 0.02
"""Parts of the speed at which acceleration ends, and braking: as in legs of a mission. [-]"""


class Record(Value, eq=False):
    """A simulation as columns: t steps of n agents."""

    begin_s: FloatArray
    """(t + 1,), with the end of the last. [s]"""
    place_m: FloatArray
    """At the beginning of each, and at the end. (t + 1, n, 2) [m]"""
    velocity_m_s: FloatArray
    """By its own motion, without what carries it."""
    command_m_s: FloatArray
    """(t, n, 2) [m s⁻¹]"""
    phase: IntArray
    """(t, n)"""
    waits: BoolArray
    """(t, n)"""
    flies_s: FloatArray
    """When each was in the plane, (n,) [s], and when it left it; infinite: never."""
    lands_s: FloatArray
    has_landed: BoolArray
    """At the end. (n,)"""
    height_m: FloatArray | None = None
    """Above the home of the first, of missions as filed; ``None``: in one plane. (t + 1, n) [m]"""
    carried_m: FloatArray | float = 0.0
    """From where each reports to be to its place, by what nobody knows of. (t + 1, n, 2) [m]"""
    against_m_s: FloatArray | float = 0.0
    """The gusts that each flies against by now. (t + 1, n, 2) [m s⁻¹]"""

    @classmethod
    def of(cls, steps: Sequence[Step], swarm: Swarm) -> Record:
        """Return the columns of steps of a simulation, as it has ended."""
        place_m, velocity_m_s = swarm.places()
        return cls(
            flies_s=swarm.flies_s,
            lands_s=swarm.lands_s,
            has_landed=swarm.has_landed,
            begin_s=np.array([*(one.begin_s for one in steps), steps[-1].end_s]),
            place_m=np.array([*(one.place_m for one in steps), place_m]),
            velocity_m_s=np.array([*(one.velocity_m_s for one in steps), velocity_m_s]),
            command_m_s=np.array([one.command_m_s for one in steps]),
            phase=np.array([one.phase for one in steps]),
            waits=np.array([one.waits for one in steps]),
            carried_m=np.array([*(one.carried_m for one in steps), swarm.carried_m]),
            against_m_s=np.array([*(one.against_m_s for one in steps), swarm.against_m_s]),
        )

    @property
    def duration_s(self) -> FloatArray:
        """Of each step. (t,) [s]"""
        return np.diff(self.begin_s)


def agent_flight(
    record: Record, row: int, *, vertical: Flight, speed_m_s: float, height_m: float
) -> Flight | None:
    """Return what one agent flew, in the frame of its home; ``None``: it never took off.

    Parameters
    ----------
    record : Record
    row : int
        Of the agent.
    vertical : Flight
        Its take-off to the plane of the swarm, and its landing from there.
    speed_m_s : float
        Steady speed commanded. [m s⁻¹]
    height_m : float
        Of the plane above its home. [m]
    """
    phase = record.phase[:, row]
    if not (phase > AgentPhase.WAITS).any():
        return None
    carried_m = np.broadcast_to(record.carried_m, record.place_m.shape)[:, row]
    own_m = record.place_m[:, row] - record.place_m[0, row] - carried_m
    parts = [_part(vertical, lands=False)]
    flown = np.flatnonzero(phase == AgentPhase.FLIES)
    if len(flown):
        parts.append(
            _level(
                record, row, own_m, flown, vertical=vertical, speed_m_s=speed_m_s, height_m=height_m
            )
        )
    if (phase >= AgentPhase.LANDS).any():
        motion, transients = _part(vertical, lands=True)
        laws = tuple(_MovedLaw(law=law, from_home_m=own_m[-1]) for law in motion.laws)
        parts.append((replace(motion, laws=laws), transients))
    motion, transients = _joined(parts)
    return make_flight(motion, transients, vertical.power)


class _MovedLaw(Value, eq=False):
    """A motion of home, somewhere else."""

    law: MotionLaw
    from_home_m: FloatArray
    """East and north. (2,) [m]"""

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        state = self.law.state_at(row, time_s)
        east_m, north_m = self.from_home_m
        return replace(state, east_m=state.east_m + east_m, north_m=state.north_m + north_m)


def _part(vertical: Flight, *, lands: bool) -> tuple[Motion, Transients]:
    """Return the take-off, or the landing, of a flight up and down."""
    motion, transients = vertical.motion, vertical.transients
    first = first_landing(motion)
    count = len(motion.segments.item)
    kept = np.arange(first, count) if lands else np.arange(first)
    pieces = np.isin(motion.piece_segment, kept)
    rows = np.isin(transients.segment, kept)
    begun_s = float(motion.segments.duration_s[: kept[0]].sum()) if len(kept) else 0.0
    none = np.full(1, -1)
    return (
        replace(
            motion,
            segments=motion.segments.select(kept),
            piece_segment=motion.piece_segment[pieces] - (kept[0] if len(kept) else 0),
            piece_law=motion.piece_law[pieces],
            piece_row=motion.piece_row[pieces],
            piece_offset_s=motion.piece_offset_s[pieces],
            piece_duration_s=motion.piece_duration_s[pieces],
            piece_is_grounded=None
            if motion.piece_is_grounded is None
            else motion.piece_is_grounded[pieces],
            piece_fall_m_s=None if motion.piece_fall_m_s is None else motion.piece_fall_m_s[pieces],
            arrival_segment=none,
            done_segment=none,
        ),
        replace(
            transients,
            segment=transients.segment[rows] - (kept[0] if len(kept) else 0),
            response=transients.response[rows],
            amplitude=transients.amplitude[rows],
            start_s=transients.start_s[rows] - begun_s,
            pause_at_s=transients.pause_at_s[rows],
            pause_s=transients.pause_s[rows],
        ),
    )


def first_landing(motion: Motion) -> int:
    """Return the first segment of the landing of a flight up and down."""
    return int(np.argmax(motion.segments.state == _LAND))


def _level(
    record: Record,
    row: int,
    own_m: FloatArray,
    flown: IntArray,
    *,
    vertical: Flight,
    speed_m_s: float,
    height_m: float,
) -> tuple[Motion, Transients]:
    """Return the steps that an agent flew in the plane."""
    begin_s, duration_s = record.begin_s[flown], record.duration_s[flown]
    offset_s = np.zeros(len(flown))
    offset_s[0] = max(float(record.flies_s[row]) - float(begin_s[0]), 0.0)
    place, after = own_m[flown], own_m[flown + 1]
    velocity, then = record.velocity_m_s[flown, row], record.velocity_m_s[flown + 1, row]
    state = flight_states(velocity, record.command_m_s[flown, row], speed_m_s)
    width = duration_s[:, None]
    duration_s = duration_s - offset_s
    late_s = float(record.begin_s[flown[-1] + 1]) - float(record.lands_s[row])
    if np.isfinite(late_s):
        duration_s[-1] = max(duration_s[-1] - late_s, 0.0)
    coefficients = np.zeros((len(flown), 3, 4))
    coefficients[:, :2, 0], coefficients[:, :2, 1] = place, velocity
    coefficients[:, :2, 2] = 3.0 * (after - place) / width**2 - (2.0 * velocity + then) / width
    coefficients[:, :2, 3] = 2.0 * (place - after) / width**3 + (velocity + then) / width**2
    coefficients[:, 2, 0] = height_m
    begins = np.append(True, state[1:] != state[:-1])
    segment = np.cumsum(begins) - 1
    count = int(segment[-1]) + 1
    way_m = np.hypot(*(after - place).T)
    speeds = np.zeros(count)
    np.maximum.at(speeds, segment, np.hypot(*velocity.T))
    kind = state[begins]
    zero = np.zeros(count)
    rows = np.arange(len(flown))
    none = np.full(1, -1)
    motion = Motion(
        segments=SegmentColumns(
            item=np.ones(count, np.intp),
            state=kind,
            duration_s=np.bincount(segment, duration_s, count).astype(np.float64),
            distance_m=np.bincount(segment, way_m, count).astype(np.float64),
            climb_m=zero,
            speed_m_s=np.where(np.isin(kind, (_ACCELERATE, _CRUISE)), speed_m_s, speeds),
            stopping_distance_m=zero + np.nan,
        ),
        laws=(PolynomialLaw(coefficients=coefficients),),
        piece_segment=segment,
        piece_law=np.zeros(len(flown), np.intp),
        piece_row=rows,
        piece_offset_s=offset_s,
        piece_duration_s=duration_s,
        arrival_segment=none,
        done_segment=none,
    )
    brakes = np.flatnonzero(kind == BRAKE)
    first = np.flatnonzero(begins)[brakes]
    # the last tick of a leg is commanded in part
    asked = np.hypot(*record.command_m_s[flown, row].T)
    before = np.maximum(asked[np.maximum(first - 1, 0)], asked[np.maximum(first - 2, 0)])
    return motion, _brake_transients(
        vertical.power.vehicle, brakes, before, (begin_s - begin_s[0])[first]
    )


def flight_states(
    velocity: FloatArray, command: FloatArray, speed_m_s: FloatArray | float
) -> IntArray:
    """Return the flight states of steps: by what is commanded, and how much of it is flown yet."""
    speed, asked = np.hypot(*velocity.T), np.hypot(*command.T)
    going = asked > _LOST * speed_m_s
    slower = going & (asked < _REACHED * speed)
    return np.select(
        [~going & (speed > _LOST * speed_m_s), ~going, slower, speed < _REACHED * asked],
        [BRAKE, _HOVER, BRAKE, _ACCELERATE],
        _CRUISE,
    )


def _brake_transients(
    vehicle: VehicleModel, segment: IntArray, speed_m_s: FloatArray, start_s: FloatArray
) -> Transients:
    """Return the power of braking from steady speeds commanded, of a vehicle whose model has one."""
    model = vehicle.responses.brake_power
    if model is None or not len(segment):
        return NO_TRANSIENTS
    gain = 1.0
    if vehicle.responses.speed is not None:
        gain = vehicle.responses.speed.unit_step.final_value
    zero = np.zeros(len(segment))
    return Transients(
        responses=(model.unit_step,),
        window_s=(model.window_s,),
        segment=segment,
        response=np.zeros(len(segment), np.intp),
        amplitude=-speed_m_s / gain,
        start_s=start_s,
        pause_at_s=zero,
        pause_s=zero,
    )


def _joined(parts: Sequence[tuple[Motion, Transients]]) -> tuple[Motion, Transients]:
    """Return parts of a flight one after the other."""
    motions = [motion for motion, _ in parts]
    laws = np.cumsum([0, *(len(one.laws) for one in motions)])
    before = np.cumsum([0, *(len(one.segments.item) for one in motions)])
    begun_s = np.cumsum([0.0, *(float(one.segments.duration_s.sum()) for one in motions)])
    grounded = [
        np.zeros(len(one.piece_segment), np.bool_)
        if one.piece_is_grounded is None
        else one.piece_is_grounded
        for one in motions
    ]
    falls = [
        np.zeros(len(one.piece_segment)) if one.piece_fall_m_s is None else one.piece_fall_m_s
        for one in motions
    ]
    rows = [
        (transients, int(at), float(time_s))
        for (_, transients), at, time_s in zip(parts, before, begun_s, strict=False)
        if len(transients.segment)
    ]
    own = np.cumsum([0, *(len(one.responses) for one, _, _ in rows)])
    none = np.full(1, -1)

    def column(name: str) -> FloatArray:
        found = [getattr(one, name) for one, _, _ in rows]
        return np.concatenate(found) if found else np.zeros(0)

    return (
        Motion(
            segments=SegmentColumns.joined([one.segments for one in motions]),
            laws=tuple(law for one in motions for law in one.laws),
            piece_segment=np.concatenate(
                [one.piece_segment + at for one, at in zip(motions, before, strict=False)]
            ),
            piece_law=np.concatenate(
                [one.piece_law + at for one, at in zip(motions, laws, strict=False)]
            ),
            piece_row=np.concatenate([one.piece_row for one in motions]),
            piece_offset_s=np.concatenate([one.piece_offset_s for one in motions]),
            piece_duration_s=np.concatenate([one.piece_duration_s for one in motions]),
            piece_is_grounded=np.concatenate(grounded),
            piece_fall_m_s=np.concatenate(falls),
            arrival_segment=none,
            done_segment=none,
        ),
        Transients(
            responses=tuple(unit for one, _, _ in rows for unit in one.responses),
            window_s=tuple(window for one, _, _ in rows for window in one.window_s),
            segment=(
                np.concatenate([one.segment + at for one, at, _ in rows])
                if rows
                else np.zeros(0, np.intp)
            ),
            response=(
                np.concatenate(
                    [one.response + at for (one, _, _), at in zip(rows, own, strict=False)]
                )
                if rows
                else np.zeros(0, np.intp)
            ),
            amplitude=column("amplitude"),
            start_s=(
                np.concatenate([one.start_s + time_s for one, _, time_s in rows])
                if rows
                else np.zeros(0)
            ),
            pause_at_s=column("pause_at_s"),
            pause_s=column("pause_s"),
        ),
    )
