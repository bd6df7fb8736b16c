"""Motion of a vehicle that answers reference steps: the article's way of flying.

Every reference is a step and every leg stops at its waypoint.  A stage is flown as up to four
manoeuvres, one after the other: climb, level leg, descent, hold; climbing comes before and descending
after the level leg, so that the leg is flown at the greater height (clear of the ground, and never too
cheap).

Vertical manoeuvres follow the altitude response (G1) until the height stays within one metre of its
target.  A step longer than the identified one pauses at its peak climb rate for the extra metres.

A level leg of length L at commanded speed v is a pulse of the speed reference lasting L over the steady
speed, so that the response (G4) covers exactly L.  It accelerates until 98 % of the commanded speed,
cruises until the reference drops, and brakes until the speed stays within 2 % of the commanded one; what
then is left of the way, a few hundredths of the speed, is counted with the brake.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Motion, SegmentColumns
from planner.flight.motion.step_parts import (
    HOLD,
    SLOTS,
    fly_circles,
    fly_level,
    fly_vertical,
    given,
    hold_in_place,
    steepest,
)
from planner.flight.state import STATE_INDEX, FlightState
from planner.flight.transients import Transients

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray
    from planner.flight.motion.step_legs import Legs
    from planner.vehicle.model import Responses

_CLIMB_POWER, _DESCENT_POWER, _BRAKE_POWER = range(3)


def fly_step_references(legs: Legs, responses: Responses) -> tuple[Motion, Transients]:
    """Return how a vehicle that answers reference steps flies, and its power transients.

    Parameters
    ----------
    legs : Legs
        At least one stage.
    responses : Responses
        The identified responses, of altitude and speed at least; a power response that is not
        there adds nothing.

    Returns
    -------
    motion : Motion
        Segments and pieces in closed form.
    transients : Transients
        Windows of climb, descent and brake power.

    Notes
    -----
    Segments are ordered by stage and slot: climb, accelerate, cruise, brake, descend, hold.
    """
    vertical = fly_vertical(legs, given(responses.altitude))
    level = fly_level(legs, given(responses.speed))
    circles = fly_circles(legs, given(responses.speed))
    parts = (vertical, level, circles, hold_in_place(legs))

    order = np.concatenate([part.order for part in parts])
    flown = np.argsort(order, kind="stable")
    place = np.empty_like(flown)
    place[flown] = np.arange(len(flown))
    offsets = np.cumsum([0, *(len(part.order) for part in parts)])

    def joined(name: str) -> FloatArray:
        column: FloatArray = np.concatenate([getattr(part, name) for part in parts])[flown]
        return column

    segments = SegmentColumns(
        item=legs.item[order[flown] // SLOTS],
        state=joined("state").astype(np.intp),
        duration_s=joined("duration_s"),
        distance_m=joined("distance_m"),
        climb_m=joined("climb_m"),
        speed_m_s=joined("speed_m_s"),
        stopping_distance_m=joined("stopping_distance_m"),
    )
    piece_segment = np.concatenate(
        [place[part.piece_segment + offset] for part, offset in zip(parts, offsets, strict=False)]
    )
    by_segment = np.argsort(piece_segment, kind="stable")

    def pieces(name: str) -> FloatArray:
        column: FloatArray = np.concatenate([getattr(part, name) for part in parts])[by_segment]
        return column

    first, last = legs.rows.T
    ordered = order[flown]
    motion = Motion(
        segments=segments,
        laws=tuple(part.law for part in parts),
        piece_segment=piece_segment[by_segment],
        piece_law=np.repeat(np.arange(len(parts)), [len(part.piece_segment) for part in parts])[
            by_segment
        ],
        piece_row=pieces("piece_row").astype(np.intp),
        piece_offset_s=pieces("piece_offset_s"),
        piece_duration_s=pieces("piece_duration_s"),
        arrival_segment=np.searchsorted(ordered, first * SLOTS + HOLD) - 1,
        done_segment=np.searchsorted(ordered, (last + 1) * SLOTS) - 1,
    )
    return motion, _transients(segments, joined("step"), joined("pause_s"), responses)


def _transients(
    segments: SegmentColumns, step: FloatArray, pause_s: FloatArray, responses: Responses
) -> Transients:
    """Return the power windows of every climb, descent and brake, in the order of their start."""
    state = segments.state
    climbing = (state == STATE_INDEX[FlightState.TAKEOFF]) | (
        state == STATE_INDEX[FlightState.CLIMB]
    )
    braking = state == STATE_INDEX[FlightState.BRAKE]
    models = (responses.climb_power, responses.descent_power, responses.brake_power)
    kind = np.select([climbing, braking], [_CLIMB_POWER, _BRAKE_POWER], _DESCENT_POWER)
    begun = np.flatnonzero((step != 0.0) & np.array([m is not None for m in models])[kind])
    peak_s = steepest(given(responses.altitude)).time_s
    return Transients(
        responses=tuple(None if model is None else model.unit_step for model in models),
        window_s=tuple(0.0 if model is None else given(model.window_s) for model in models),
        segment=begun,
        response=kind[begun],
        amplitude=step[begun],
        start_s=segments.end_s[begun] - segments.duration_s[begun],
        pause_at_s=np.full(len(begun), peak_s),
        pause_s=pause_s[begun],
    )
