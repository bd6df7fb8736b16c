"""How a vehicle of reference steps moves: its altitude and speed responses along a path."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import (
    STATE_INDEX,
    STATES,
    CircleLaw,
    Columns,
    FlightState,
    KinematicState,
    Motion,
    PolynomialLaw,
    SegmentColumns,
    greatest,
)
from planner.flight.power import Transients
from planner.mission.route.stage import LANDED_STAGES, RETURN_STAGES, StageKind
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
        paused = np.minimum(np.maximum(time_s - self.peak_s, 0.0), self.pause_s[row])
        own = time_s - paused
        slope, value = self.response.slope_and_value(own)
        step_m, zero = self.step_m[row], np.zeros(row.shape)
        height = self.height_m[row] + step_m * (value + self.peak_rate * paused)
        return KinematicState.of(
            (self.east_m[row], self.north_m[row], height), (zero, zero, step_m * slope)
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
        # the steps up and down, and what they have come to
        up_and_down_s = np.stack((time_s, time_s - self.pulse_s[row]))
        value, integral = self.response.value_and_integral(up_and_down_s)
        speed = self.speed_m_s[row]
        rate, way = speed * (value[0] - value[1]), speed * (integral[0] - integral[1])
        east, north = self.east[row], self.north[row]
        return KinematicState.of(
            (self.east_m[row] + way * east, self.north_m[row] + way * north, self.height_m[row]),
            (rate * east, rate * north, np.zeros(row.shape)),
        )


_TAKEOFF, _CLIMB, _BRAKE, _DESCEND, _LAND = (
    STATE_INDEX[FlightState(s)] for s in ("takeoff", "climb", "brake", "descend", "land")
)


_WINDOWS = np.array(
    [{_TAKEOFF: 0, _CLIMB: 0, _BRAKE: 2}.get(state, 1) for state in range(len(STATES))]
)
"""Whose window of power each state begins: 0 that of a climb, 1 of a descent, 2 of a brake."""


class StepSpeeds(Value, kw_only=False):
    """Level speeds of a vehicle of reference steps. [m s⁻¹]"""

    own_m_s: float
    """Where nothing commands one."""
    returning_m_s: float
    commanded_m_s: float = math.inf
    """The most that is flown where one is commanded."""

    def of(self, stage: Stage) -> float:
        """Return the level speed a stage is flown at."""
        if stage.kind in RETURN_STAGES:
            return (
                self.returning_m_s
                if stage.speed_m_s is None
                else min(stage.speed_m_s, self.returning_m_s)
            )
        return self.own_m_s if stage.speed_m_s is None else min(stage.speed_m_s, self.commanded_m_s)


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
    def of(
        cls,
        stages: Sequence[Stage],
        *,
        speeds: StepSpeeds,
        over_home: tuple[FloatArray, float] | None = None,
        set_down_s: float = 0.0,
    ) -> StepLegs:
        """Return the stages of a route, each beginning where the one before ends.

        Setting down a load takes two rows: down to the ground, and back up.  So do returns whose
        heights over home and wait there are known, ``over_home`` [m], [s]: to there, and down.
        """
        # Looked up once: of every stage they take as long as all the rest.
        set_down, circling, taking_off = StageKind.SET_DOWN, StageKind.CIRCLE, StageKind.TAKEOFF
        two = {set_down} if over_home is None else {set_down, StageKind.RETURN}
        count = [1 + (s.kind in two) for s in stages]
        flown = [s for s, times in zip(stages, count, strict=True) for _ in range(times)]
        end = np.array([(s.east_m, s.north_m, s.height_m) for s in flown])
        last = np.cumsum(count) - 1
        first = np.concatenate(([0], last[:-1] + 1))
        landing = np.array([s.kind in LANDED_STAGES for s in flown])
        hold_s = np.array([s.hold_s for s in flown])
        for stage, row in zip(stages, first.tolist(), strict=True):
            if stage.kind is set_down:
                is_placed = stage.lowered_m == stage.above_ground_m
                end[row, 2], hold_s[row] = stage.height_m - stage.lowered_m, is_placed * set_down_s
        if over_home is not None:
            home = np.array([s.kind for s in stages if s.kind in RETURN_STAGES]) == StageKind.RETURN
            rows = first[[s.kind in RETURN_STAGES for s in stages]]
            end[rows, 2], hold_s[rows[home]] = over_home
            landing[rows] = False
        centre = end[:, :2].copy()
        for row, s in enumerate(flown):
            if s.kind is circling:
                end[row, :2] = _edge_m(end[row, :2], end[row - 1, :2], abs(s.radius_m))
        speeds_m_s = [speeds.of(stage) for stage in flown]
        turns = [_turns(s, speed) for s, speed in zip(flown, speeds_m_s, strict=True)]
        hold_s = np.where([s.kind is circling for s in flown], 0.0, hold_s)
        takeoff = np.array([s.kind is taking_off for s in flown])
        return cls(
            item=np.array([s.item for s in flown]),
            start_m=np.vstack((np.zeros((1, 3)), end[:-1])),
            end_m=end,
            speed_m_s=np.array(speeds_m_s),
            hold_s=hold_s,
            centre_m=centre,
            circle_m=np.array([s.radius_m for s in flown]),
            turns=np.array(turns),
            climb_state=np.where(takeoff, _TAKEOFF, _CLIMB),
            descent_state=np.where(landing, _LAND, _DESCEND),
            rows=np.column_stack((first, last)),
        )

    @classmethod
    def home_from(
        cls,
        points_m: FloatArray,
        home_m: FloatArray,
        *,
        speed_m_s: float,
        over_home: tuple[FloatArray, float] | None = None,
    ) -> StepLegs:
        """Return level legs from many points (n, 3) to home (n, 3), and landings, each on its own.

        Where the heights they are flown at (n,) [m] and the wait over home [s] are known, ``over_home``,
        each takes two rows: to over home, and down.
        """
        rows = 1 if over_home is None else 2
        count = rows * len(points_m)
        start_m, end_m = (
            np.repeat(np.array(m, np.float64), rows, axis=0) for m in (points_m, home_m)
        )
        hold_s, lands = np.zeros(count), np.ones(count, np.bool_)
        if over_home is not None:
            end_m[::2, 2], hold_s[::2] = over_home
            start_m[1::2], lands[::2] = end_m[::2], False
        first = np.arange(0, count, rows)
        return cls(
            item=np.repeat(np.arange(len(points_m)), rows),
            start_m=start_m,
            end_m=end_m,
            speed_m_s=np.full(count, speed_m_s),
            hold_s=hold_s,
            centre_m=end_m[:, :2].copy(),
            circle_m=np.zeros(count),
            turns=np.zeros(count),
            climb_state=np.full(count, _CLIMB),
            descent_state=np.where(lands, _LAND, _DESCEND),
            rows=np.column_stack((first, first + rows - 1)),
        )


def _edge_m(centre_m: FloatArray, from_m: FloatArray, radius_m: float) -> FloatArray:
    """Return the point of a circle that is nearest to where the vehicle comes from."""
    away = from_m - centre_m
    distance = float(np.hypot(*away))
    direction = away / distance if distance > 0.0 else np.array([1.0, 0.0])
    return centre_m + radius_m * direction


def _turns(stage: Stage, speed_m_s: float) -> float:
    """Return the turns of a circle, and those it is circled on for."""
    if not stage.radius_m:
        return 0.0
    held_m = stage.hold_s * speed_m_s if stage.kind is StageKind.CIRCLE else 0.0
    return stage.turns + held_m / (2.0 * math.pi * abs(stage.radius_m))


VERTICAL_TOLERANCE_M = 1.0
"""A vertical manoeuvre is over when the height stays this near to its target. [m]"""
SMALL_STEP_TOLERANCE = 0.5
"""And when no more than this part of the change is left: a metre is no target for half a metre. [-]"""
SPEED_TOLERANCE = 0.02
"""A speed is reached, or lost, to within this fraction of the steady one. [-]"""

START, CLIMB, WAIT, ACCELERATE, CRUISE, BRAKE, CIRCLE, DESCEND, STOP, HOLD, SLOTS = range(11)
"""What is flown for a stage, in this order."""
_LEVEL_SLOTS = np.array((ACCELERATE, CRUISE, BRAKE))
_LEVEL_STATES = np.array([STATE_INDEX[FlightState(s)] for s in ("accelerate", "cruise", "brake")])
"""Of these those of a level leg."""


class StepSegments(SegmentColumns, eq=False):
    """Segments of one kind, one per row."""

    order: IntArray
    """Stage times slots plus slot."""
    step: FloatArray
    """Input step of the segment's power response. [m or m s⁻¹]"""
    pause_s: FloatArray


class StepPieces(Columns, eq=False):
    """Pieces of such segments, one per row."""

    segment: IntArray
    row: IntArray
    offset_s: FloatArray
    duration_s: FloatArray
    is_grounded: BoolArray


class StepPart(Value, kw_only=False, eq=False):
    """Segments of one kind with their pieces, which follow one law."""

    law: MotionLaw
    segments: StepSegments
    pieces: StepPieces


def make_part(
    law: MotionLaw,
    order: IntArray,
    state: IntArray | FlightState,
    duration_s: FloatArray,
    *,
    pieces: StepPieces | None = None,
    **columns: FloatArray,
) -> StepPart:
    """Return segments with some of their columns, by default of one piece each that goes nowhere."""
    rows, zero = np.arange(len(order)), np.zeros(len(order))
    if isinstance(state, FlightState):
        state = np.full(len(order), STATE_INDEX[state])
    others = ("distance_m", "climb_m", "speed_m_s", "step", "pause_s")
    given = dict.fromkeys(others, zero) | {"stopping_distance_m": zero + np.nan} | columns
    return StepPart(
        law,
        StepSegments(item=order, order=order, state=state, duration_s=duration_s, **given),
        pieces
        or StepPieces(
            segment=rows, row=rows, offset_s=zero, duration_s=duration_s, is_grounded=zero > 0.0
        ),
    )


def join_parts(legs: StepLegs, parts: Sequence[StepPart]) -> tuple[Motion, StepSegments]:
    """Return parts in flown order, and their segments."""
    segments = StepSegments.joined([part.segments for part in parts])
    flown = segments.order.argsort(kind="stable")
    segments = segments.select(flown)
    segments = replace(segments, item=legs.item[segments.order // SLOTS])
    pieces = StepPieces.joined([part.pieces for part in parts])
    law = np.repeat(np.arange(len(parts)), [len(part.pieces.row) for part in parts])
    counts = [len(part.segments.order) for part in parts]
    of_law = np.cumsum(counts) - counts  # the first segment of each, before they are in flown order
    segment = flown.argsort()[of_law[law] + pieces.segment]
    by_segment = segment.argsort(kind="stable")
    pieces = replace(pieces, segment=segment).select(by_segment)
    first, last = legs.rows.T
    motion = Motion(
        segments=segments,
        laws=tuple(part.law for part in parts),
        piece_segment=pieces.segment,
        piece_law=law[by_segment],
        piece_row=pieces.row,
        piece_offset_s=pieces.offset_s,
        piece_duration_s=pieces.duration_s,
        arrival_segment=segments.order.searchsorted(first * SLOTS + HOLD) - 1,
        done_segment=segments.order.searchsorted((last + 1) * SLOTS) - 1,
        piece_is_grounded=pieces.is_grounded if pieces.is_grounded.any() else None,
    )
    return motion, segments


def _pieces_between(breaks_s: FloatArray, row: IntArray) -> StepPieces:
    """Return the pieces between rising breaks (n, k) of n segments that follow rows of a law."""
    duration = breaks_s[:, 1:] - breaks_s[:, :-1]
    kept = duration > 0.0
    # A segment of no duration keeps one empty piece, so that every segment has a place.
    kept[:, 0] |= ~(greatest(duration) > 0.0)
    segment = np.nonzero(kept)[0]
    return StepPieces(
        segment=segment,
        row=row[segment],
        offset_s=breaks_s[:, :-1][kept],
        duration_s=duration[kept],
        is_grounded=np.zeros(len(segment), np.bool_),
    )


class _SpeedAnswer(Value, kw_only=False, eq=False):
    """How a speed response answers any speed commanded."""

    steady: float
    """Steady speed over commanded speed. [-]"""
    reached_s: float
    """Time to reach the steady speed, to within the tolerance. [s]"""
    stop_s: float
    """Time to lose it. [s]"""
    sampled_s: FloatArray
    """Times until then at which a speed that is not reached is sampled for its peak. (64,) [s]"""
    sampled: FloatArray
    """Speed over commanded speed at these times after a step. (64,) [-]"""


# The same few responses are asked for every mission: these questions need root finding.
@lru_cache(maxsize=64)
def _speed_answer(speed_response: ManoeuvreResponse) -> _SpeedAnswer:
    unit = speed_response.unit_step
    steady = unit.final_value
    reached_s = unit.first_crossing_s((1.0 - SPEED_TOLERANCE) * steady)
    assert reached_s is not None  # it settles: see the checks of the model
    stop_s = float(unit.settling_times_s(SPEED_TOLERANCE * steady))
    sampled_s = np.linspace(0.0, stop_s, 64)
    return _SpeedAnswer(
        steady=steady,
        reached_s=reached_s,
        stop_s=stop_s,
        sampled_s=sampled_s,
        sampled=unit.value(sampled_s),
    )


@lru_cache(maxsize=64)
def _settled_s(altitude: ManoeuvreResponse, steps_m: tuple[float, ...]) -> FloatArray:
    """Return the times after which the heights stay near the targets of steps. [s]"""
    sizes = np.array(steps_m)
    tolerances = np.minimum(VERTICAL_TOLERANCE_M / sizes, SMALL_STEP_TOLERANCE)
    return altitude.unit_step.settling_times_s(tolerances)


@lru_cache(maxsize=64)
def _steepest(altitude: ManoeuvreResponse) -> Extremum:
    """Return the highest rate of the answer to a unit step, and when."""
    return altitude.unit_step.peak_slope()


def _fly_vertical(legs: StepLegs, altitude: AltitudeResponse) -> StepPart:
    """Return the climbs and descents of all stages."""
    change = legs.end_m[:, 2] - legs.start_m[:, 2]
    stage = np.flatnonzero(change)
    rise = change[stage]
    size = np.abs(rise)
    unit = altitude.unit_step
    step = np.minimum(size, altitude.identified_step_m)
    rate = _steepest(altitude)
    pause = (size - step) / (rate.value * step)

    sizes = tuple(sorted(set(step.tolist())))
    end = _settled_s(altitude, sizes)[np.searchsorted(sizes, step)] + pause
    upward = rise > 0.0
    # The level leg is flown between the climb and the descent, at the start's or the end's place.
    place = np.where(upward[:, None], legs.start_m[stage, :2], legs.end_m[stage, :2])
    zero = np.zeros(len(stage))
    peak = zero + rate.time_s
    breaks = np.column_stack((zero, zero + unit.system.delay_s, peak, peak + pause, end))
    fastest = zero + rate.value
    before = np.flatnonzero(end < rate.time_s)
    if len(before):
        fastest[before] = unit.slope(end[before])
    return make_part(
        VerticalStepLaw(
            response=unit,
            east_m=place[:, 0],
            north_m=place[:, 1],
            height_m=legs.start_m[stage, 2],
            step_m=np.sign(rise) * step,
            peak_s=rate.time_s,
            peak_rate=rate.value,
            pause_s=pause,
        ),
        stage * SLOTS + np.where(upward, CLIMB, DESCEND),
        np.where(upward, legs.climb_state[stage], legs.descent_state[stage]),
        end,
        pieces=_pieces_between(np.minimum(breaks, end[:, None]), np.arange(len(stage))),
        climb_m=rise,
        speed_m_s=step * fastest,
        step=np.sign(rise) * step,
        pause_s=pause,
    )


def _fly_level(legs: StepLegs, speed_response: ManoeuvreResponse) -> StepPart:
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

    law = SpeedPulseLaw(
        response=unit,
        east_m=legs.start_m[stage, 0],
        north_m=legs.start_m[stage, 1],
        height_m=np.maximum(legs.start_m[stage, 2], legs.end_m[stage, 2]),
        east=way[:, 0] / length,
        north=way[:, 1] / length,
        speed_m_s=speed,
        pulse_s=pulse,
    )
    rows, only = np.arange(len(stage)), np.flatnonzero(cruising)
    reached = np.where(cruising, answer.reached_s, pulse)
    # what it comes to where the speed is reached, and at the end of the pulse
    values, integrals = unit.value_and_integral(np.stack((reached, pulse)))
    reached_m, pulse_m = speed * integrals
    steady_m_s = speed * steady
    peak = _peak_speed_m_s(law, cruising, answer)

    counts = [len(rows), len(only), len(rows)]
    row = np.concatenate((rows, rows[only], rows))
    start = np.concatenate((np.zeros(len(rows)), reached[only], pulse))
    stop = np.concatenate((reached, pulse[only], pulse + stop_s))
    step = np.concatenate((np.zeros(len(rows) + len(only)), -speed * (peak / steady_m_s)))
    stop_m = speed_response.transfer_function.mean_residence_time_s * steady_m_s[only]
    breaks = np.column_stack((start, np.minimum(start + unit.system.delay_s, stop), stop))
    return make_part(
        law,
        stage[row] * SLOTS + np.repeat(_LEVEL_SLOTS, counts),
        np.repeat(_LEVEL_STATES, counts),
        stop - start,
        pieces=_pieces_between(breaks, row),
        distance_m=np.concatenate((reached_m, (pulse_m - reached_m)[only], length - pulse_m)),
        speed_m_s=np.concatenate((speed * values[0], steady_m_s[only], peak)),
        stopping_distance_m=np.concatenate((reached * np.nan, stop_m, length - pulse_m)),
        step=step,
    )


def _peak_speed_m_s(law: SpeedPulseLaw, cruising: BoolArray, answer: _SpeedAnswer) -> FloatArray:
    """Return the highest speed while braking: steady after a cruise, else the pulse's peak."""
    peak = law.speed_m_s * answer.steady
    short = np.flatnonzero(~cruising)
    if len(short):
        # The peak is flat: 64 samples with a parabola through the best three place it to 1e-5.
        up = law.response.value(law.pulse_s[short, None] + answer.sampled_s)
        speed = law.speed_m_s[short, None] * np.abs(up - answer.sampled)
        best = np.clip(np.argmax(speed, axis=1), 1, 62)
        left, top, right = (speed[np.arange(len(short)), best + k] for k in (-1, 0, 1))
        bend = left - 2.0 * top + right
        lift = np.divide((left - right) ** 2, -8.0 * bend, out=np.zeros_like(bend), where=bend < 0)
        peak[short] = top + lift
    return peak


def fly_circles(legs: StepLegs, steady: float = 1.0, stopping_s: float = float("nan")) -> StepPart:
    """Return the circles of all stages, flown at the steady speed from the moment they are reached.

    The article identifies no turning flight; starting and stopping are in the leg to the circle.
    ``steady`` is the speed flown over that commanded, ``stopping_s`` the way to stop over the speed.
    """
    stage = np.flatnonzero(legs.turns > 0.0)
    radius = np.abs(legs.circle_m[stage])
    speed = legs.speed_m_s[stage] * steady
    length = legs.turns[stage] * 2.0 * np.pi * radius
    law = CircleLaw(
        start_m=legs.end_m[stage],
        centre_m=legs.centre_m[stage],
        rate_rad_s=-np.sign(legs.circle_m[stage]) * speed / radius,
    )
    return make_part(
        law,
        stage * SLOTS + CIRCLE,
        FlightState.CRUISE,
        length / speed,
        distance_m=length,
        speed_m_s=speed,
        stopping_distance_m=speed * stopping_s,
    )


def _hold_in_place(legs: StepLegs) -> StepPart:
    """Return the holds of all stages."""
    stage = np.flatnonzero(legs.hold_s > 0.0)
    coefficients = np.zeros((len(stage), 3, 4))
    coefficients[:, :, 0] = legs.end_m[stage]
    rows, hold_s = np.arange(len(stage)), legs.hold_s[stage]
    has_landed = legs.descent_state[stage] == _LAND
    return make_part(
        PolynomialLaw(coefficients=coefficients),
        stage * SLOTS + HOLD,
        np.where(has_landed, _LAND, STATE_INDEX[FlightState.HOVER]),
        hold_s,
        pieces=StepPieces(
            segment=rows,
            row=rows,
            offset_s=np.zeros(len(stage)),
            duration_s=hold_s,
            is_grounded=has_landed,
        ),
    )


def fly_step_references(legs: StepLegs, responses: Responses) -> tuple[Motion, Transients]:
    """Return how a vehicle that answers reference steps flies, and its power transients.

    Parameters
    ----------
    legs : StepLegs
        At least one.
    responses : Responses
        Of altitude and speed at least; a power response that is missing adds nothing.
    """
    altitude, speed = responses.altitude, responses.speed
    assert altitude is not None  # the model has both: see its checks
    assert speed is not None
    residence_s = speed.transfer_function.mean_residence_time_s
    parts = [_fly_vertical(legs, altitude), _fly_level(legs, speed)]
    if legs.turns.any():  # most flights have no circles, and returns no holds
        parts.append(fly_circles(legs, _speed_answer(speed).steady, residence_s))
    if legs.hold_s.any():
        parts.append(_hold_in_place(legs))
    motion, segments = join_parts(legs, parts)
    # Windows of power begin with every climb, descent and brake.
    models = (responses.climb_power, responses.descent_power, responses.brake_power)
    kind = _WINDOWS[segments.state]
    begun = np.flatnonzero((segments.step != 0.0) & np.array([m is not None for m in models])[kind])
    return motion, Transients(
        responses=tuple(None if model is None else model.unit_step for model in models),
        window_s=tuple(0.0 if model is None else model.window_s for model in models),
        segment=begun,
        response=kind[begun],
        amplitude=segments.step[begun],
        start_s=motion.segment_start_s[begun],
        pause_at_s=np.full(len(begun), _steepest(altitude).time_s),
        pause_s=segments.pause_s[begun],
    )
