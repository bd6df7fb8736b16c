"""How a vehicle of reference steps moves: its altitude and speed responses along a path."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from planner.flight.motion.kinematics import (
    STATE_INDEX,
    CircleLaw,
    FlightState,
    KinematicState,
    Motion,
    PolynomialLaw,
    SegmentColumns,
)
from planner.flight.power import Transients
from planner.mission.route.stage import StageKind
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import MotionLaw
    from planner.mission.route.stage import Stage
    from planner.physics.response import Extremum, StepResponse
    from planner.vehicle.model import AltitudeResponse, ManoeuvreResponse, Responses


class VerticalStepLaw(Value, eq=False):
    """Answer of the altitude response to steps, pausing at the peak rate where a step is long."""

    response: StepResponse
    """Unit step of the altitude reference. [m/m]"""
    east_m: FloatArray
    north_m: FloatArray
    height_m: FloatArray
    """Height above home before the step. (rows,) [m]"""
    step_m: FloatArray
    """Size of the step as the response sees it, negative downwards. (rows,) [m]"""
    peak_s: float
    """Time of the peak rate. [s]"""
    peak_rate: float
    """The peak rate of the unit step. [(m/s)/m]"""
    pause_s: FloatArray

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        paused = np.clip(time_s - self.peak_s, 0.0, self.pause_s[row])
        own = time_s - paused
        rate = self.step_m[row] * self.response.slope(own)
        zero = np.zeros(row.shape)
        return KinematicState(
            east_m=self.east_m[row],
            north_m=self.north_m[row],
            height_m=self.height_m[row]
            + self.step_m[row] * self.response.value(own)
            + self.step_m[row] * self.peak_rate * paused,
            east_m_s=zero,
            north_m_s=zero,
            climb_m_s=rate,
        )


class SpeedPulseLaw(Value, eq=False):
    """Answer of the speed response to pulses of the speed reference, along straight level legs."""

    response: StepResponse
    """Unit step of the speed reference, input gain included. [(m/s)/(m/s)]"""
    east_m: FloatArray
    north_m: FloatArray
    height_m: FloatArray
    east: FloatArray
    """Eastward part of the direction. (rows,) [-]"""
    north: FloatArray
    speed_m_s: FloatArray
    """Commanded speed. (rows,) [m s⁻¹]"""
    pulse_s: FloatArray
    """Length of the pulse. (rows,) [s]"""

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        after = time_s - self.pulse_s[row]
        speed = self.speed_m_s[row]
        rate = speed * (self.response.value(time_s) - self.response.value(after))
        way = speed * (self.response.integral(time_s) - self.response.integral(after))
        return KinematicState(
            east_m=self.east_m[row] + way * self.east[row],
            north_m=self.north_m[row] + way * self.north[row],
            height_m=self.height_m[row],
            east_m_s=rate * self.east[row],
            north_m_s=rate * self.north[row],
            climb_m_s=np.zeros(row.shape),
        )


_LANDINGS = frozenset({StageKind.LAND, StageKind.RETURN})


class StepLegs(Value, eq=False):
    """Stages as columns, one row per stage; each begins and ends standing still."""

    item: IntArray
    """What the segments of each stage are counted under. (n,)"""
    start_m: FloatArray
    """East, north, height above home. (n, 3) [m]"""
    end_m: FloatArray
    speed_m_s: FloatArray
    hold_s: FloatArray
    centre_m: FloatArray
    """Centre of the circle to fly about, east and north. (n, 2) [m]"""
    circle_m: FloatArray
    """Radius of the circle to fly about, negative for counter-clockwise; 0 for none. (n,) [m]"""
    turns: FloatArray
    climb_state: IntArray
    descent_state: IntArray
    rows: IntArray
    """First and last row that serve each stage of the route. (stages, 2)"""

    @classmethod
    def of(cls, stages: Sequence[Stage], *, default_speed_m_s: float) -> StepLegs:
        """Return the stages of a route, each beginning where the one before ends.

        Setting down a load takes two rows: down to the level of home, and back up.
        """
        flown = [s for s in stages for _ in range(1 + (s.kind is StageKind.SET_DOWN))]
        end = np.array([(s.east_m, s.north_m, s.height_m) for s in flown])
        last = np.cumsum([1 + (s.kind is StageKind.SET_DOWN) for s in stages]) - 1
        first = np.concatenate(([0], last[:-1] + 1))
        end[first[last > first], 2] = 0.0
        centre = end[:, :2].copy()
        circling = [row for row, s in enumerate(flown) if s.kind is StageKind.CIRCLE]
        for row in circling:
            end[row, :2] = _edge_m(end[row, :2], end[row - 1, :2], abs(flown[row].radius_m))
        landing = np.array([s.kind in _LANDINGS for s in flown])
        takeoff = np.array([s.kind is StageKind.TAKEOFF for s in flown])
        return cls(
            item=np.array([s.item for s in flown]),
            start_m=np.vstack((np.zeros((1, 3)), end[:-1])),
            end_m=end,
            speed_m_s=np.array(
                [default_speed_m_s if s.speed_m_s is None else s.speed_m_s for s in flown]
            ),
            hold_s=np.array([s.hold_s for s in flown]),
            centre_m=centre,
            circle_m=np.array([s.radius_m for s in flown]),
            turns=np.array([s.turns if s.radius_m else 0.0 for s in flown]),
            climb_state=np.where(
                takeoff, STATE_INDEX[FlightState.TAKEOFF], STATE_INDEX[FlightState.CLIMB]
            ),
            descent_state=np.where(
                landing, STATE_INDEX[FlightState.LAND], STATE_INDEX[FlightState.DESCEND]
            ),
            rows=np.column_stack((first, last)),
        )

    @classmethod
    def home_from(cls, points_m: FloatArray, home_m: FloatArray, *, speed_m_s: float) -> StepLegs:
        """Return level legs from many points (n, 3) to home (n, 3), and landings, each on its own."""
        count = len(points_m)
        rows = np.arange(count)
        return cls(
            item=rows,
            start_m=points_m,
            end_m=np.array(home_m, np.float64),
            speed_m_s=np.full(count, speed_m_s),
            hold_s=np.zeros(count),
            centre_m=np.array(home_m[:, :2], np.float64),
            circle_m=np.zeros(count),
            turns=np.zeros(count),
            climb_state=np.full(count, STATE_INDEX[FlightState.CLIMB]),
            descent_state=np.full(count, STATE_INDEX[FlightState.LAND]),
            rows=np.column_stack((rows, rows)),
        )


def _edge_m(centre_m: FloatArray, from_m: FloatArray, radius_m: float) -> FloatArray:
    """Return the point of a circle that is nearest to where the vehicle comes from."""
    away = from_m - centre_m
    distance = float(np.hypot(*away))
    direction = away / distance if distance > 0.0 else np.array([1.0, 0.0])
    return centre_m + radius_m * direction


T = TypeVar("T")

VERTICAL_TOLERANCE_M = 1.0
"""A vertical manoeuvre is over when the height stays this near to its target. [m]"""
SMALL_STEP_TOLERANCE = 0.5
"""And when no more than this part of the change is left: a metre is no target for half a metre. [-]"""
SPEED_TOLERANCE = 0.02
"""A speed is reached, or lost, to within this fraction of the steady one. [-]"""

_CLIMB, _ACCELERATE, _CRUISE, _BRAKE, _CIRCLE, _DESCEND, HOLD, SLOTS = range(8)


class StepPart(Value, eq=False):
    """Segments of one kind with their pieces; ``order`` is stage times slots plus slot."""

    law: MotionLaw
    order: IntArray
    state: IntArray
    duration_s: FloatArray
    distance_m: FloatArray
    climb_m: FloatArray
    speed_m_s: FloatArray
    stopping_distance_m: FloatArray
    piece_segment: IntArray
    piece_row: IntArray
    piece_offset_s: FloatArray
    piece_duration_s: FloatArray
    step: FloatArray
    """Input step of the segment's power response. [m or m s⁻¹]"""
    pause_s: FloatArray


def _pieces_between(
    breaks_s: FloatArray, segment: IntArray, row: IntArray
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Return segment, row, offset and duration of the pieces between rising breaks (n, k)."""
    duration = np.diff(breaks_s, axis=1)
    kept = duration > 0.0
    # A segment of no duration keeps one empty piece, so that every segment has a place.
    kept[:, 0] |= ~kept.any(axis=1)
    shape = duration.shape
    return (
        np.broadcast_to(segment[:, None], shape)[kept],
        np.broadcast_to(row[:, None], shape)[kept],
        breaks_s[:, :-1][kept],
        duration[kept],
    )


class _SpeedAnswer(Value):
    """What a speed response tells of every leg, whatever its speed."""

    steady: float
    """Steady speed over commanded speed. [-]"""
    reached_s: float
    """Time to reach the steady speed, to within the tolerance. [s]"""
    stop_s: float
    """Time to lose it. [s]"""


# The same few responses are asked for every mission: these questions need root finding.
@lru_cache(maxsize=64)
def _speed_answer(speed_response: ManoeuvreResponse) -> _SpeedAnswer:
    unit = speed_response.unit_step
    steady = unit.final_value
    return _SpeedAnswer(
        steady=steady,
        reached_s=given(unit.first_crossing_s((1.0 - SPEED_TOLERANCE) * steady)),
        stop_s=float(unit.settling_times_s(SPEED_TOLERANCE * steady)),
    )


@lru_cache(maxsize=64)
def _settled_s(altitude: ManoeuvreResponse, steps_m: tuple[float, ...]) -> FloatArray:
    """Return the times after which the heights stay near the targets of steps. [s]"""
    sizes = np.array(steps_m)
    tolerances = np.minimum(VERTICAL_TOLERANCE_M / sizes, SMALL_STEP_TOLERANCE)
    return altitude.unit_step.settling_times_s(tolerances)


@lru_cache(maxsize=64)
def steepest(altitude: ManoeuvreResponse) -> Extremum:
    """Return the highest rate of the answer to a unit step, and when."""
    return altitude.unit_step.peak_slope()


def fly_vertical(legs: StepLegs, altitude: AltitudeResponse) -> StepPart:
    """Return the climbs and descents of all stages."""
    change = legs.end_m[:, 2] - legs.start_m[:, 2]
    stage = np.flatnonzero(change)
    rise = change[stage]
    size = np.abs(rise)
    unit = altitude.unit_step
    step = np.minimum(size, altitude.identified_step_m)
    rate = steepest(altitude)
    peak_s = rate.time_s
    pause = (size - step) / (rate.value * step)

    sizes = tuple(sorted(set(step.tolist())))
    end = _settled_s(altitude, sizes)[np.searchsorted(sizes, step)] + pause
    upward = rise > 0.0
    # The level leg is flown between the climb and the descent, at the start's or the end's place.
    place = np.where(upward[:, None], legs.start_m[stage, :2], legs.end_m[stage, :2])
    count = np.arange(len(stage))
    peak = np.full(len(stage), peak_s)
    breaks = np.column_stack(
        (np.zeros(len(stage)), np.full(len(stage), unit.system.delay_s), peak, peak + pause, end)
    )
    segment, row, offset, duration = _pieces_between(np.minimum(breaks, end[:, None]), count, count)
    return StepPart(
        law=VerticalStepLaw(
            response=unit,
            east_m=place[:, 0],
            north_m=place[:, 1],
            height_m=legs.start_m[stage, 2],
            step_m=np.sign(rise) * step,
            peak_s=peak_s,
            peak_rate=rate.value,
            pause_s=pause,
        ),
        order=stage * SLOTS + np.where(upward, _CLIMB, _DESCEND),
        state=np.where(upward, legs.climb_state[stage], legs.descent_state[stage]),
        duration_s=end,
        distance_m=np.zeros(len(stage)),
        climb_m=rise,
        speed_m_s=step * unit.slope(np.minimum(end, peak_s)),
        stopping_distance_m=np.full(len(stage), np.nan),
        piece_segment=segment,
        piece_row=row,
        piece_offset_s=offset,
        piece_duration_s=duration,
        step=np.sign(rise) * step,
        pause_s=pause,
    )


def fly_level(legs: StepLegs, speed_response: ManoeuvreResponse) -> StepPart:
    """Return the level legs of all stages: accelerate, cruise where there is time for it, brake."""
    way = legs.end_m[:, :2] - legs.start_m[:, :2]
    length = np.hypot(way[:, 0], way[:, 1])
    stage = np.flatnonzero(length > 0.0)
    way, length = way[stage], length[stage]
    speed = legs.speed_m_s[stage]
    unit = speed_response.unit_step
    answer = _speed_answer(speed_response)
    steady, stop_s = answer.steady, answer.stop_s
    pulse = length / (speed * steady)
    cruising = pulse > answer.reached_s
    end = pulse + stop_s

    climbing = legs.end_m[stage, 2] > legs.start_m[stage, 2]
    law = SpeedPulseLaw(
        response=unit,
        east_m=legs.start_m[stage, 0],
        north_m=legs.start_m[stage, 1],
        height_m=np.where(climbing, legs.end_m[stage, 2], legs.start_m[stage, 2]),
        east=way[:, 0] / length,
        north=way[:, 1] / length,
        speed_m_s=speed,
        pulse_s=pulse,
    )
    rows = np.arange(len(stage))
    reached = np.where(cruising, answer.reached_s, pulse)
    reached_m = speed * unit.integral(reached)
    pulse_m = speed * unit.integral(pulse)
    peak = _peak_speed_m_s(law, cruising, steady=steady, stop_s=stop_s)

    only = np.flatnonzero(cruising)
    row_of = np.concatenate((rows, rows[only], rows))
    slot = np.repeat([_ACCELERATE, _CRUISE, _BRAKE], [len(rows), len(only), len(rows)])
    start = np.concatenate((np.zeros(len(rows)), reached[only], pulse))
    stop = np.concatenate((reached, pulse[only], end))
    breaks = np.column_stack((start, np.minimum(start + unit.system.delay_s, stop), stop))
    segment, row, offset, duration = _pieces_between(breaks, np.arange(len(slot)), row_of)
    return StepPart(
        law=law,
        order=stage[row_of] * SLOTS + slot,
        state=np.choose(
            slot - _ACCELERATE,
            [
                STATE_INDEX[s]
                for s in (FlightState.ACCELERATE, FlightState.CRUISE, FlightState.BRAKE)
            ],
        ),
        duration_s=stop - start,
        distance_m=np.concatenate((reached_m, (pulse_m - reached_m)[only], length - pulse_m)),
        climb_m=np.zeros(len(slot)),
        speed_m_s=np.concatenate((speed * unit.value(reached), (speed * steady)[only], peak)),
        stopping_distance_m=np.concatenate(
            (
                np.full(len(rows), np.nan),
                (speed * steady)[only] * speed_response.transfer_function.mean_residence_time_s,
                length - pulse_m,
            )
        ),
        piece_segment=segment,
        piece_row=row,
        piece_offset_s=offset,
        piece_duration_s=duration,
        step=-np.where(slot == _BRAKE, speed[row_of] * (peak / (speed * steady))[row_of], 0.0),
        pause_s=np.zeros(len(slot)),
    )


def _peak_speed_m_s(
    law: SpeedPulseLaw, cruising: BoolArray, *, steady: float, stop_s: float
) -> FloatArray:
    """Return the highest speed while braking: steady after a cruise, else the pulse's peak."""
    peak = law.speed_m_s * steady
    short = np.flatnonzero(~cruising)
    if len(short):
        # The peak is flat: 64 samples with a parabola through the best three place it to 1e-5.
        time = law.pulse_s[short, None] + np.linspace(0.0, stop_s, 64)
        speed = law.state_at(short[:, None] + np.zeros(time.shape, np.intp), time).ground_speed_m_s
        best = np.clip(np.argmax(speed, axis=1), 1, 62)
        left, top, right = (speed[np.arange(len(short)), best + k] for k in (-1, 0, 1))
        bend = left - 2.0 * top + right
        lift = np.divide((left - right) ** 2, -8.0 * bend, out=np.zeros_like(bend), where=bend < 0)
        peak[short] = top + lift
    return peak


def fly_circles(legs: StepLegs, speed_response: ManoeuvreResponse) -> StepPart:
    """Return the circles of all stages, flown at the steady speed from the moment they are reached.

    The article identifies no turning flight; starting and stopping are in the leg to the circle.
    """
    stage = np.flatnonzero(legs.turns > 0.0)
    radius = np.abs(legs.circle_m[stage])
    speed = legs.speed_m_s[stage] * _speed_answer(speed_response).steady
    length = legs.turns[stage] * 2.0 * np.pi * radius
    law = CircleLaw(
        start_m=legs.end_m[stage],
        centre_m=legs.centre_m[stage],
        rate_rad_s=-np.sign(legs.circle_m[stage]) * speed / radius,
    )
    return replace(
        _steady(law, stage * SLOTS + _CIRCLE, FlightState.CRUISE, length / speed),
        distance_m=length,
        speed_m_s=speed,
        stopping_distance_m=speed * speed_response.transfer_function.mean_residence_time_s,
    )


def hold_in_place(legs: StepLegs) -> StepPart:
    """Return the holds of all stages."""
    stage = np.flatnonzero(legs.hold_s > 0.0)
    coefficients = np.zeros((len(stage), 3, 4))
    coefficients[:, :, 0] = legs.end_m[stage]
    law = PolynomialLaw(coefficients=coefficients)
    return _steady(law, stage * SLOTS + HOLD, FlightState.HOVER, legs.hold_s[stage])


def _steady(
    law: MotionLaw, order: IntArray, state: FlightState, duration_s: FloatArray
) -> StepPart:
    """Return segments of one piece each that go nowhere and begin no window of power."""
    rows, zero = np.arange(len(order)), np.zeros(len(order))
    return StepPart(
        law=law,
        order=order,
        state=np.full(len(order), STATE_INDEX[state]),
        duration_s=duration_s,
        distance_m=zero,
        climb_m=zero,
        speed_m_s=zero,
        stopping_distance_m=np.full(len(order), np.nan),
        piece_segment=rows,
        piece_row=rows,
        piece_offset_s=zero,
        piece_duration_s=duration_s,
        step=zero,
        pause_s=zero,
    )


def given(value: T | None) -> T:
    """Return what a model of step references is known to have."""
    if value is None:
        msg = "a model of step references has responses of altitude and speed"
        raise ValueError(msg)
    return value


_CLIMB_POWER, _DESCENT_POWER, _BRAKE_POWER = range(3)


def fly_step_references(legs: StepLegs, responses: Responses) -> tuple[Motion, Transients]:
    """Return how a vehicle that answers reference steps flies, and its power transients.

    Parameters
    ----------
    legs : StepLegs
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
        window_s=tuple(0.0 if model is None else model.window_s for model in models),
        segment=begun,
        response=kind[begun],
        amplitude=step[begun],
        start_s=segments.end_s[begun] - segments.duration_s[begun],
        pause_at_s=np.full(len(begun), peak_s),
        pause_s=pause_s[begun],
    )
