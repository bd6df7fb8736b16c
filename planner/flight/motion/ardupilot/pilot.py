"""How ArduPilot's Copter flies a route: S-curves, corners flown through, take-off, landing, return.

The autopilot moves a target along closed forms of time (``AC_WPNav``, ``SCurve``), and slows that
target's time down where the vehicle falls behind; the vehicle follows within decimetres.  Motion here is
that of the target.  Everything follows from the vehicle's parameters; constants are the source's own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.ardupilot.circles import leave_circles, plan_circles
from planner.flight.motion.ardupilot.legs import (
    SLOTS,
    StuckReturns,
    past_stops_m,
    plan_legs,
    planned_anew_spread_s,
    settling_waits_s,
    stopping_distance_m,
)
from planner.flight.motion.ardupilot.splines import plan_splines
from planner.flight.motion.ardupilot.stages import (
    StageColumns,
    is_kind,
    metres_of_autopilot,
    over_home_m,
    return_columns,
    return_findings,
    return_wait_s,
    stage_columns,
)
from planner.flight.motion.ardupilot.timeline import make_motion
from planner.flight.motion.ardupilot.track_lag import TrackLag
from planner.flight.motion.ardupilot.vertical import (
    change_of_height,
    landing,
    landing_level_m,
    set_down,
    takeoff,
)
from planner.flight.motion.kinematics import FlightState, SlowedLegs, hold
from planner.mission.route.stage import StageKind
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.flight.motion.ardupilot.legs import ArduPilotLegs
    from planner.flight.motion.ardupilot.splines import FlownSplines, Splines
    from planner.flight.motion.kinematics import Manoeuvres, Motion
    from planner.flight.returns.destination import ReturnTargets
    from planner.mission.route.stage import Stage
    from planner.physics.wind import Wind
    from planner.vehicle.model import Responses
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters


def fly_ardupilot(
    stages: Sequence[Stage],
    parameters: ArduPilotParameters,
    *,
    wind: Wind | None = None,
    airspeed_limit_m_s: float | None = None,
    home_latitude_deg: float | None = None,
    responses: Responses | None = None,
) -> Motion:
    """Return how ArduPilot's Copter flies the stages of a route.

    The first of at least one stage begins at home, disarmed on the ground.  Ground speed is held against
    the wind until the lean angle reaches its limit, at that airspeed.  The latitude of home decides what
    ArduPilot takes for a metre; without it metres are its own.  Stops and waits at waypoints depend on
    how the vehicle follows its references, by default without any lag.

    The motion is from arming to disarming.  A stage is arrived at when the autopilot announces it as
    reached: half-way through a corner, after a hold, after a landing when disarmed.
    """
    scale = metres_of_autopilot(home_latitude_deg)
    return _flown(
        stage_columns(
            stages, parameters, scale=scale, drag=TrackLag.of(parameters, airspeed_limit_m_s).drag
        ),
        parameters,
        wind=wind,
        airspeed_limit_m_s=airspeed_limit_m_s,
        scale=scale,
        responses=responses,
    )


def fly_ardupilot_flights(
    flights: Sequence[Sequence[Stage]],
    parameters: ArduPilotParameters,
    *,
    wind: Wind | None = None,
    airspeed_limit_m_s: float | None = None,
    home_latitude_deg: float | None = None,
    responses: Responses | None = None,
) -> Motion:
    """Return several flights as :func:`fly_ardupilot` has each, one after the other, as one motion.

    The item of a segment is the position of its flight.
    """
    scale = metres_of_autopilot(home_latitude_deg)
    drag = TrackLag.of(parameters, airspeed_limit_m_s).drag
    several = [stage_columns(stages, parameters, scale=scale, drag=drag) for stages in flights]
    return _flown(
        StageColumns.of_flights(several),
        parameters,
        wind=wind,
        airspeed_limit_m_s=airspeed_limit_m_s,
        scale=scale,
        responses=responses,
    )


def ardupilot_returns(
    points_m: FloatArray,
    targets: ReturnTargets,
    parameters: ArduPilotParameters,
    *,
    wind: Wind | None = None,
    airspeed_limit_m_s: float | None = None,
    home_latitude_deg: float | None = None,
    responses: Responses | None = None,
) -> Motion:
    """Return the return to launch (RTL) from each of many points as one motion.

    The vehicle starts from standing at the points (n, 3).  The rest is as in :func:`fly_ardupilot`.  The
    returns follow one another; the item of a segment is the position of its point.
    """
    scale = metres_of_autopilot(home_latitude_deg)
    return _flown(
        return_columns(points_m, targets, parameters, scale=scale),
        parameters,
        wind=wind,
        airspeed_limit_m_s=airspeed_limit_m_s,
        scale=scale,
        responses=responses,
    )


def _flown(
    stages: StageColumns,
    parameters: ArduPilotParameters,
    *,
    wind: Wind | None,
    airspeed_limit_m_s: float | None,
    scale: tuple[float, float],
    responses: Responses | None,
) -> Motion:
    """Return the motion of stages."""
    splines = plan_splines(stages, parameters, wind=wind, airspeed_limit_m_s=airspeed_limit_m_s)
    legs = plan_legs(stages, splines, parameters, wind=wind, airspeed_limit_m_s=airspeed_limit_m_s)
    circles = plan_circles(stages)
    lag = TrackLag.of(parameters, airspeed_limit_m_s)
    legs, leaving = leave_circles(stages, circles, legs, parameters, lag)
    speed_response = None if responses is None else responses.speed
    flown_splines = _flown_splines(stages, splines, legs)
    spline_findings = () if splines is None else splines.findings
    manoeuvres = [
        *_takeoffs(stages, parameters),
        *_holds(stages, parameters),
        *_landings(stages, parameters),
        *_changes_of_height(stages, parameters),
        *_set_down(stages, parameters),
        *((circles.entries,) if len(circles.stage) else ()),
        *leaving,
        *(() if flown_splines is None else (flown_splines.manoeuvres,)),
        *_settling(legs, responses, parameters, lag),
    ]
    standing = StuckReturns.of(legs, stages, parameters)
    anew_s, standing_s = planned_anew_spread_s(legs, parameters), standing.spread_s()
    motion = make_motion(
        legs,
        manoeuvres,
        circles,
        item=stages.item,
        scale=scale,
        stopping_distance_m=lambda speed: stopping_distance_m(speed, parameters, speed_response),
        findings=(
            *legs.findings,
            *spline_findings,
            *standing.findings(stages.item),
            *return_findings(parameters),
        ),
    )
    slowed = [
        one for one in (legs.slowed, None if splines is None else splines.slowed) if one is not None
    ]
    motion = replace(
        motion,
        wander_m=past_stops_m(legs, lag),
        wait_spread_s=anew_s if standing_s is None else standing_s,
        wait_segment=int(motion.done_segment[standing.stage[:1] - 1].sum()) + 1,
        slowed=SlowedLegs.joined(slowed) if slowed else None,
        circles=circles.at_rate(stages.item),
    )
    return motion if flown_splines is None else flown_splines.counted(motion, scale)


def _settling(
    legs: ArduPilotLegs, responses: Responses | None, parameters: ArduPilotParameters, lag: TrackLag
) -> list[Manoeuvres]:
    """Return the waits at the ends of legs until the vehicle has come near enough."""
    waits = settling_waits_s(legs, responses, parameters, lag)
    rows = np.flatnonzero(waits)
    if not len(rows):
        return []
    end = legs.start_m[rows] + legs.direction[rows] * legs.curves.length_m[rows][:, None]
    return [hold(legs.key[rows], FlightState.HOVER, place_m=end, duration_s=waits[rows])]


def _takeoffs(stages: StageColumns, parameters: ArduPilotParameters) -> list[Manoeuvres]:
    """Return the take-offs, from the ground and in the air."""
    rows = stages.where(StageKind.TAKEOFF)
    ground = stages.from_ground[rows]
    return [
        takeoff(
            some * SLOTS,
            stages.start_m[some],
            stages.end_m[some, 2],
            stages.climb_m_s[some],
            parameters,
            from_ground=grounded,
        )
        for some, grounded in ((rows[ground], True), (rows[~ground], False))
        if len(some)
    ]


def _holds(stages: StageColumns, parameters: ArduPilotParameters) -> list[Manoeuvres]:
    """Return the holds at places, delays, waits over home, and turns on the spot."""
    held = stages.where(StageKind.GO, StageKind.SPLINE, StageKind.LOITER, StageKind.DELAY)
    held, home = held[stages.hold_s[held] > 0.0], stages.where(StageKind.RETURN)
    spinning = stages.where(StageKind.CIRCLE)
    spinning = spinning[stages.radius_m[spinning] == 0.0]
    spinning_s = np.array([stages.circles[row].duration_s for row in spinning.tolist()])
    loiter_s = np.full(len(home), return_wait_s(parameters))
    holds = (
        (held * SLOTS + 1, stages.end_m[held], stages.hold_s[held]),
        (home * SLOTS + 2, over_home_m(stages, home, parameters), loiter_s),
        (spinning * SLOTS + 1, stages.edge_m[spinning], spinning_s),
    )
    return [
        hold(key, FlightState.HOVER, place_m=place, duration_s=duration)
        for key, place, duration in holds
        if len(key)
    ]


def _landings(stages: StageColumns, parameters: ArduPilotParameters) -> list[Manoeuvres]:
    """Return the landings of landing items and of returns, or a return's last descent."""
    land, home = stages.where(StageKind.LAND), stages.where(StageKind.RETURN)
    over = over_home_m(stages, home, parameters)
    manoeuvres: list[Manoeuvres] = []
    if len(land):
        place = stages.place_m[land].copy()
        place[:, 2] = stages.start_m[land, 2] + stages.rise_m[land]
        manoeuvres.append(
            landing(
                land * SLOTS + 1,
                place,
                stages.place_m[land, 2],
                parameters,
                commanded_m_s=stages.lands_at_m_s[land],
                level_m=landing_level_m(
                    stages.place_m[land, 2],
                    stages.datum_m[land],
                    parameters,
                    named_m=stages.named_ground_m[land],
                    is_named=stages.lands_by_name[land],
                ),
                wait_s=stages.hold_s[land],
            )
        )
    if len(home) and parameters.return_final_altitude_m <= 0.0:
        ground = stages.place_m[home, 2]
        manoeuvres.append(
            landing(
                home * SLOTS + 3,
                over,
                ground,
                parameters,
                commanded_m_s=stages.lands_at_m_s[home],
                level_m=landing_level_m(ground, stages.datum_m[home], parameters),
                wait_s=stages.hold_s[home],
            )
        )
    elif len(home):
        manoeuvres.append(
            change_of_height(
                home * SLOTS + 3,
                over,
                np.minimum(stages.end_m[home, 2], over[:, 2]),
                np.where(
                    np.isnan(stages.lands_at_m_s[home]),
                    parameters.descent_speed_m_s,
                    stages.lands_at_m_s[home],
                ),
                parameters,
                state=FlightState.DESCEND,
            )
        )
    return manoeuvres


def _changes_of_height(stages: StageColumns, parameters: ArduPilotParameters) -> list[Manoeuvres]:
    """Return the climbs and descents of LOITER_TO_ALT where the vehicle already is at the place."""
    rows = stages.where(StageKind.CHANGE_HEIGHT)
    start, end = stages.start_m[rows], stages.place_m[rows]
    rows = rows[(start[:, :2] == end[:, :2]).all(axis=1)]
    change = stages.place_m[rows, 2] - stages.start_m[rows, 2]
    return [
        change_of_height(
            some * SLOTS + 1,
            stages.start_m[some],
            stages.place_m[some, 2],
            speed[some],
            parameters,
            state=state,
        )
        for some, speed, state in (
            (rows[change > 0.0], stages.climb_m_s, FlightState.CLIMB),
            (rows[change < 0.0], stages.descent_m_s, FlightState.DESCEND),
        )
        if len(some)
    ]


def _set_down(stages: StageColumns, parameters: ArduPilotParameters) -> tuple[Manoeuvres, ...]:
    """Return how loads are set down."""
    rows = stages.where(StageKind.SET_DOWN)
    if not len(rows):
        return ()
    down_m, climb_m_s = stages.lowered_m[rows], stages.climb_m_s[rows]
    key, is_placed = rows * SLOTS + 1, down_m == stages.above_ground_m[rows]
    return set_down(key, stages.end_m[rows], down_m, climb_m_s, parameters, is_placed=is_placed)


def _flown_splines(
    stages: StageColumns, splines: Splines | None, legs: ArduPilotLegs
) -> FlownSplines | None:
    """Return the splines, as fast at their ends as the legs they join."""
    if splines is None:
        return None
    count, stage = len(stages.kind), splines.stage
    left, met = np.zeros(count), np.zeros(count)
    leg_stage, slot = np.divmod(legs.key, SLOTS)
    left[leg_stage] = legs.curves.end_m_s
    met[leg_stage[slot == 0]] = legs.curves.start_m_s[slot == 0]
    before, after = np.maximum(stage - 1, 0), np.minimum(stage + 1, count - 1)
    is_spline = is_kind(stages.kind, StageKind.SPLINE)
    start = np.where(is_spline[before], splines.speed_at_end_m_s[before], left[before])
    start = np.where((stage > 0) & stages.is_passed[before], start, 0.0)
    end = np.where(is_spline[after], splines.speed_at_start_m_s[after], met[after])
    end = np.where(stages.is_passed[stage], end, 0.0)
    return splines.flown(stage * SLOTS, start, end)
