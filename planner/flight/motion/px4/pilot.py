"""PX4 as a pilot: stages in, motion out; returns from any point; stops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.findings import Finding, Rule, Severity
from planner.flight.motion.batches import batches_of
from planner.flight.motion.headway import held_speeds_m_s
from planner.flight.motion.kinematics import (
    STATE_INDEX,
    FlightState,
    Motion,
    SegmentColumns,
    horizontal,
    rows_of,
)
from planner.flight.motion.px4.braking import (
    flown_acceleration_m_s2,
    passed_m,
    stopping_distance_m,
    turning_back,
)
from planner.flight.motion.px4.headings import waits_unknown
from planner.flight.motion.px4.lag import TrackingLag
from planner.flight.motion.px4.landing import (
    LANDED_LATER_S,
    LANDED_SOONER_S,
    add_landings,
    add_takeoffs,
)
from planner.flight.motion.px4.leg_profile import add_holds, add_legs, add_weaves, steep_moves
from planner.flight.motion.px4.legs import LEAST_REACH, fly_legs
from planner.flight.motion.px4.lift_off import RECORDED_DRAG_PER_S, lift_off
from planner.flight.motion.px4.moves import (
    Moves,
    heights_of_returns_m,
    moves_of_stages,
    return_moves,
)
from planner.flight.motion.px4.pieces import (
    BRAKE,
    CRUISE,
    HOLD,
    PAUSE,
    RAMP,
    SLOTS,
    Px4Pieces,
    TimeScale,
    in_flown_order,
)
from planner.flight.motion.px4.tilting import held_back
from planner.flight.motion.px4.weaving import weave_findings
from planner.flight.power import NO_TRANSIENTS
from planner.mission.route.stage import StageKind
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.legs import Px4Legs
    from planner.flight.motion.px4.pieces import Ordered
    from planner.flight.power import Transients
    from planner.flight.returns.destination import ReturnTargets
    from planner.mission.route.stage import Route, Stage
    from planner.physics.wind import Wind
    from planner.vehicle.parameters.px4 import Px4Parameters


_WORTH_SAYING_S = 0.5


def gap_findings(stages: Sequence[Stage], parameters: Px4Parameters) -> tuple[Finding, ...]:
    """Return a finding for each setting that the motion of these stages does not follow."""
    returning = next((stage for stage in stages if stage.kind is StageKind.RETURN), None)
    if returning is None:
        return ()
    if parameters.disarm_delay_s >= 0.0:
        return ()
    from planner.flight.returns.destination import SETTING_NOT_FOLLOWED

    message = (
        f"COM_DISARM_LAND {parameters.disarm_delay_s:g} s does not disarm: the flight is taken to end "
        "as it has landed"
    )
    return (SETTING_NOT_FOLLOWED.finding(message, item=returning.item),)


HEADING_ASSUMED = Rule(
    "T119 heading-assumed",
    Severity.INFO,
    summary="A time is taken to turn from a heading that is not known.",
    why="PX4 waits over a waypoint, or over home before it lands, until the vehicle has turned: half a "
    "turn takes 4.9 s at 60°/s and 20°/s², no turn none.  No mission says how the vehicle stands as it "
    "is armed, which is the heading it returns to; on the line the vehicle reports it.  The mean of "
    "all turns is taken; to the heading of home half a turn, since vehicles are set down looking where they "
    "are to fly and come home looking back.  p10 to p90 of time and energy has any turn.",
    how="The first waypoint with a heading, a return begun within RTL_MIN_DIST of home, and one that "
    "waits before it lands (RTL_LAND_DELAY), where the turn is not over when the vehicle is there, and "
    "MIS_YAW_TMT does not end the wait; with MPC_YAW_MODE 4 the first leg and any return's landing.",
    fix="give the heading the vehicle is armed with by --heading, or leave that of the waypoint free",
)


def _assumed_headings(
    moves: Moves, any_turn_s: FloatArray, taken_s: FloatArray
) -> Iterator[Finding]:
    """Yield each wait that is as long as it is only because a heading is not known."""
    most_s = np.maximum(any_turn_s.max(axis=0), taken_s)
    for move in rows_of(most_s >= _WORTH_SAYING_S).tolist():
        message = (
            f"{taken_s[move]:.1f} s taken to turn to the heading asked for, of 0 to {most_s[move]:.1f} s: "
            "the heading the vehicle is armed with is not known"
        )
        yield HEADING_ASSUMED.finding(message, item=int(moves.item[move]))


class Px4Pilot(Value):
    """PX4 with a vehicle's parameters.

    Ground speed is held against the wind until the tilt reaches its limit, at that airspeed.  Noise of the
    position slows PX4's time down, 0.3 m measured in simulation, and is refused (ValueError) where it stops
    it; so does the lag that drag causes.

    Notes
    -----
    Motion is that of the trajectory PX4 lets the vehicle follow.  What it leaves out was measured in ten
    stops and nearly cancels: braking, the vehicle is 0.4 m ahead of the trajectory (there 0.3 s sooner);
    starting from standing, it lags and the trajectory waits for it (0.2 s later).
    """

    parameters: Px4Parameters
    wind: Wind | None = None
    airspeed_limit_m_s: float | None = None
    """Airspeed at the greatest tilt; ``None``: not known. [m s⁻¹]"""
    noise_m: float = 0.0
    """Mean horizontal distance between where it should be and its own estimate in a hover. [m]"""
    drag_per_s: float | None = None
    """Deceleration by the air over airspeed; ``None``: it does not lag. [s⁻¹]"""
    heading_rad: float | None = None
    """That it is armed with; ``None``: not known. [rad]"""

    def fly(self, route: Route) -> tuple[Motion, Transients]:
        """Return the motion along a route; PX4 shapes its references, so nothing rings."""
        return self.flown(route.stages), NO_TRANSIENTS

    def fly_all(self, routes: Sequence[Route]) -> Iterator[tuple[Motion, Transients]]:
        """Yield the flights along routes, many at once."""
        for first, some in batches_of(routes):
            several, count = [], 0
            for position, route in enumerate(some, start=first):
                moves = self._moves(route.stages)
                item = np.full_like(moves.item, position)
                several.append(replace(moves, stage=moves.stage + count, item=item))
                count += len(route.stages)
            yield self._motion(Moves.joined(several), count)[0], NO_TRANSIENTS

    def fly_returns(
        self, points_m: FloatArray, targets: ReturnTargets, _route: Route | None = None
    ) -> tuple[Motion, Transients]:
        """Return the returns (RTL) from each point, (k, 3), a target each, from standing there.

        Those from one place to one target, as of legs flown to and fro or in laps, are flown once.
        """
        ground_m, above_m, paths = targets.ground_m, targets.above_ground_m, targets.paths
        rows, flight = _each_once(np.column_stack((points_m, ground_m, above_m)))
        is_once = len(rows) == len(flight) or any(path is not None for path in paths)
        if not is_once:
            points_m, ground_m, above_m, paths = points_m[rows], ground_m[rows], above_m[rows], ()
        moves = return_moves(points_m, ground_m, self.parameters, above_m, paths)
        motion, _ = self._motion(moves.armed_with(self.heading_rad), len(points_m))
        return motion if is_once else motion.flights(flight), NO_TRANSIENTS

    def flown(self, stages: Sequence[Stage]) -> Motion:
        """Return the motion of the stages of a route.

        The first of at least one stage begins at home, disarmed on the ground, with a heading that may not
        be known.
        """
        moves = self._moves(stages)
        motion, legs = self._motion(moves, len(stages))
        any_turn_s, taken_s = waits_unknown(moves, legs)
        assumed = _assumed_headings(moves, any_turn_s, taken_s)
        weaving = weave_findings(moves, legs)
        found = (*gap_findings(stages, self.parameters), *assumed, *weaving)
        motion = replace(motion, findings=motion.findings + found)
        turned = rows_of(taken_s)
        if not len(turned):
            return motion
        first = int(np.argmax(motion.segments.item == moves.item[turned[0]]))
        spread_s = any_turn_s.sum(axis=1) - taken_s.sum()
        return replace(motion, wait_spread_s=spread_s, wait_segment=first)

    def return_heights_m(self, points_m: FloatArray, targets: ReturnTargets) -> FloatArray:
        """Return the heights of RTL_RETURN_ALT and its cone."""
        return heights_of_returns_m(points_m, targets, self.parameters)

    def stop(self, speed_m_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the distance and the time until a vehicle in mid-leg turns back."""
        p = self.parameters
        return turning_back(speed_m_s, flown_acceleration_m_s2(p), p.jerk_m_s3)

    def farthest_stop_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return the distance until a vehicle in mid-leg turns back, which drag carries past it."""
        way_m, braking_s = self.stop(speed_m_s)
        return way_m + passed_m(speed_m_s, braking_s, self.parameters, self.drag_per_s or 0.0)

    def _moves(self, stages: Sequence[Stage]) -> Moves:
        drag_per_s = self.drag_per_s or RECORDED_DRAG_PER_S
        moves = moves_of_stages(stages, self.parameters, drag_per_s=drag_per_s)
        moves = moves.armed_with(self.heading_rad)
        if self.heading_rad is None:
            return moves
        return replace(moves, start_yaw_rad=np.full(len(moves.item), self.heading_rad))

    def _motion(self, moves: Moves, stages: int) -> tuple[Motion, Px4Legs]:
        """Return the motion of moves that serve a number of stages, and the moves as flown."""
        time_scale = TimeScale.of(self.noise_m, self.parameters)
        lag = None
        if self.drag_per_s:
            lag = TrackingLag(drag_per_s=self.drag_per_s, parameters=self.parameters)
            late_s = lift_off(self.parameters, self.drag_per_s).late_s
            moves = replace(moves, late_s=np.full(len(moves.item), late_s))
            # The lag that a known drag causes is not counted twice.
            time_scale = replace(time_scale, lag_s=0.0)
        begins = moves.beginnings_m()
        speed, slowed = held_speeds_m_s(
            moves.speed_m_s,
            (moves.target_m - begins)[:, :2],
            moves.item,
            height_m=np.stack((begins[:, 2], moves.target_m[:, 2]), axis=1),
            wind=self.wind,
            airspeed_limit_m_s=self.airspeed_limit_m_s,
        )
        moves = replace(moves, speed_m_s=speed)
        if lag is not None:
            moves = _reached_by(lag, moves, time_scale)
        legs = fly_legs(moves)
        ordered = in_flown_order(_pieces(moves, legs, time_scale, lands=moves.is_landing))
        # A lag leaves climbs as they are.
        climb_m = ordered.summed(ordered.law.climbs_m(ordered.duration_s))
        ordered = held_back(ordered, self.parameters)
        if lag is not None:
            ordered = lag.followed(ordered, moves)
        # PX4 reports an item after its hold.
        move_stage = moves.stage[ordered.segment_move]
        done = np.searchsorted(move_stage, np.arange(stages), side="right") - 1
        flying_s = np.where(ordered.is_grounded, 0.0, ordered.duration_s)
        landings = int(moves.is_landing.sum())
        segments = _segments(ordered, climb_m, moves, legs, self.drag_per_s)
        wandered_m = time_scale.wandered_m(ordered.summed(flying_s), segments.distance_m)
        laws, law, row = ordered.law.parted()
        motion = Motion(
            segments=segments,
            laws=laws,
            piece_segment=ordered.segment,
            piece_law=law,
            piece_row=row,
            piece_offset_s=ordered.offset_s,
            piece_duration_s=ordered.duration_s,
            arrival_segment=done,
            done_segment=done,
            piece_is_grounded=ordered.is_grounded,
            wander_m=float(wandered_m.sum()),
            noise_delay_s=ordered.noise_delay_s,
            landing_spread_s=(landings * LANDED_SOONER_S, landings * LANDED_LATER_S),
            slowed=slowed,
        )
        return motion, legs


def _each_once(values: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the first of the rows that are the same, of each, and which of these a row is. (m,), (n,)"""
    order = np.lexsort(values.T)  # `np.unique` loads all of `numpy.ma`
    is_new = np.append(True, (values[order[1:]] != values[order[:-1]]).any(axis=1))
    first, which = order[is_new], np.empty_like(order)
    rows = np.sort(first)  # in their order: further rows behind these move none of them
    which[order] = rows.searchsorted(first)[is_new.cumsum() - 1]
    return rows, which


def _reached_by(lag: TrackingLag, moves: Moves, time_scale: TimeScale) -> Moves:
    """Return moves that count as reached by the place of the vehicle, not that of its trajectory.

    What comes last decides nothing before: landings that end a flight, and the wait for a heading before
    them, are left out.
    """
    is_last = np.append(moves.is_first[1:], True)
    ends = moves.is_landing & is_last
    legs = fly_legs(moves, waits=~np.append(ends[1:], False))
    pieces = _pieces(moves, legs, time_scale, lands=moves.is_landing & ~is_last)
    if not pieces.parts:
        return moves
    ahead, beside, past = lag.off_m(in_flown_order(pieces), moves)
    chord = np.sqrt(np.maximum(moves.reach_m**2 - beside**2, 0.0))
    reach = np.maximum(chord + ahead, LEAST_REACH * moves.reach_m)
    return replace(moves, reach_m=reach, past_m=past)


def _pieces(moves: Moves, legs: Px4Legs, time_scale: TimeScale, *, lands: BoolArray) -> Px4Pieces:
    """Return the pieces of moves, of these landings alone, as a vehicle flies them that does not lag."""
    pieces = Px4Pieces(time_scale)
    add_takeoffs(pieces, legs)
    add_legs(pieces, legs)
    add_weaves(pieces, legs)
    add_holds(pieces, legs)
    add_landings(pieces, legs, lands=lands, is_return=moves.is_return)
    return pieces


_TAKING_OFF, _CLIMBING, _DESCENDING, _ACCELERATING, _BRAKING, _LANDING = (
    STATE_INDEX[FlightState(state)]
    for state in ("takeoff", "climb", "descend", "accelerate", "brake", "land")
)
_STATES = np.full(SLOTS, STATE_INDEX[FlightState.HOVER])
"""Of segments by their slots; of ramps it depends."""
_STATES[CRUISE], _STATES[BRAKE] = STATE_INDEX[FlightState.CRUISE], _BRAKING


def _segments(
    ordered: Ordered, climb_m: FloatArray, moves: Moves, legs: Px4Legs, drag_per_s: float | None
) -> SegmentColumns:
    """Return the segments of flown moves as columns."""
    planned, limits, parameters = legs.planned, legs.limits, legs.parameters
    move, slot = ordered.segment_move, ordered.segment_slot
    steep, upward = steep_moves(legs), limits.direction[:, 2]
    level, peak = horizontal(limits.direction), legs.straights.rise.peak_m_s
    top = peak * np.where(steep, np.abs(upward), level)
    top = np.where(moves.is_landing, parameters.descent_speed_m_s, top)
    ramp_state = np.where(peak < legs.straights.rise.from_m_s, _BRAKING, _ACCELERATING)
    ramp_state[steep] = np.where(upward[steep] > 0.0, _CLIMBING, _DESCENDING)
    ramp_state[planned.is_takeoff], ramp_state[moves.is_landing] = _TAKING_OFF, _LANDING
    state, ramps = _STATES[slot], rows_of(slot == RAMP)
    state[ramps] = ramp_state[move[ramps]]
    way_m = ordered.summed(ordered.ways_m(curves=bool(drag_per_s)))
    stopping_m, cruises = np.full(len(slot), np.nan), rows_of(slot == CRUISE)
    stopping_m[cruises] = stopping_distance_m(top[move[cruises]], parameters, drag_per_s)
    # A stop goes on beyond the place that counts as reached.
    beyond_m, stops = limits.tail_m * level, planned.is_leg & (planned.final_level_m_s == 0.0)
    # One that is reached within its turn has no braking of its own, and no direction left.
    turned = stops & (limits.length_m == 0.0) & ~steep
    beyond_m[turned] = (limits.tail_m * horizontal(planned.direction))[turned]
    ending = (slot == BRAKE) & stops[move] | (slot == RAMP) & turned[move]
    stopping_m[ending] = (way_m + beyond_m[move])[ending]
    return SegmentColumns(
        item=moves.item[move],
        state=state,
        duration_s=ordered.summed(ordered.duration_s),
        distance_m=way_m,
        climb_m=climb_m,
        speed_m_s=np.where((slot == HOLD) | (slot == PAUSE), 0.0, top[move]),
        stopping_distance_m=stopping_m,
    )
