"""Circles as ArduPilot flies them: a target that turns at a steady rate, whatever becomes of the vehicle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.motion.ardupilot.legs import SLOTS, drag_per_s
from planner.flight.motion.ardupilot.stages import circle_rate_rad_s
from planner.flight.motion.kinematics import (
    CircleLaw,
    FlightState,
    horizontal,
    lengths,
    make_manoeuvres,
    quotient,
)
from planner.mission.route.stage import StageKind
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.motion.ardupilot.stages import StageColumns
    from planner.flight.motion.kinematics import Manoeuvres
    from planner.physics.wind import Wind
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_LEAST_ANGULAR_ACCELERATION_RAD_S2 = math.radians(2.0)
"""``AC_CIRCLE_ANGULAR_ACCEL_MIN``. [rad s⁻²]"""


class Circles(Value, eq=False):
    """Circles, one per row."""

    key: IntArray
    """Place in the order of the flight. (n,)"""
    law: CircleLaw
    duration_s: FloatArray
    speed_m_s: FloatArray


def circling_s(
    stages: StageColumns, rows: IntArray, parameters: ArduPilotParameters
) -> tuple[FloatArray, FloatArray]:
    """Return mean rates and durations of circles. (n,) [rad s⁻¹], (n,) [s]

    ``AC_Circle::update_ms``: the rate rises by A/R (2°/s² at least) to its limit, and the turns are
    counted by the rate.
    """
    rate = circle_rate_rad_s(stages.radius_m[rows], stages.speed_m_s[rows], parameters)
    rising = np.maximum(
        quotient(parameters.acceleration_m_s2, np.abs(stages.radius_m[rows]), rate),
        _LEAST_ANGULAR_ACCELERATION_RAD_S2,
    )
    angle = 2.0 * math.pi * stages.turns[rows]
    turning = np.where(angle > 0.0, rate, 0.0)
    duration = quotient(angle, turning) + 0.5 * turning / rising
    return quotient(angle, duration), duration


def plan_circles(stages: StageColumns, parameters: ArduPilotParameters) -> Circles:
    """Return the circles that lead round something."""
    rows = stages.where(StageKind.CIRCLE)
    rate, duration = circling_s(stages, rows, parameters)
    round_one = (stages.radius_m[rows] != 0.0) & (duration > 0.0)
    rows, rate, duration = rows[round_one], rate[round_one], duration[round_one]
    start, centre = stages.edge_m[rows], stages.place_m[rows, :2]
    return Circles(
        key=rows * SLOTS + 1,
        law=CircleLaw(
            start_m=start, centre_m=centre, rate_rad_s=-np.copysign(rate, stages.radius_m[rows])
        ),
        duration_s=duration,
        speed_m_s=rate * horizontal(start[:, :2] - centre),
    )


def leaving_circles(stages: StageColumns, circles: Circles) -> tuple[Manoeuvres, ...]:
    """Return how the vehicle brakes out of circles, along the tangent to its stopping point."""
    if not len(circles.key):
        return ()
    rows = circles.key // SLOTS
    last = circles.law.state_at(np.arange(len(rows)), circles.duration_s)
    end = stages.end_m[rows]
    way = lengths(end - last.place_m)
    velocity = last.velocity_m_s
    return (
        make_manoeuvres(
            rows * SLOTS + 2,
            FlightState.BRAKE,
            position_m=np.stack((last.place_m, end), axis=1),
            velocity_m_s=np.stack((velocity, np.zeros_like(velocity)), axis=1),
            duration_s=quotient(2.0 * way, circles.speed_m_s)[:, None],
            stopping_distance_m=way,
        ),
    )


CIRCLE_LEAN = Rule(
    "W105 circle-lean",
    Severity.WARNING,
    summary="A circle in this wind asks for more lean than the vehicle may take.",
    why="ArduPilot turns the target of a circle on at a steady rate and does not wait for the "
    "vehicle: one that cannot lean enough cuts the circle, or is blown off it to leeward, while its "
    "turns are counted.",
    how="At a ground speed v on a radius R in a wind w: sqrt(v² + (v²/cR)²) + w above the airspeed at "
    "the greatest lean angle U, with c = g tan(ATC_ANGLE_MAX)/U.  The time of the circle stays.",
    fix="fly the circle slower or wider, wait for less wind, or allow more lean (ATC_ANGLE_MAX)",
)


def circle_findings(
    stages: StageColumns,
    circles: Circles,
    parameters: ArduPilotParameters,
    *,
    wind: Wind | None,
    airspeed_limit_m_s: float | None,
) -> Iterator[Finding]:
    r"""Yield where circles ask for more lean than ANGLE_MAX.

    Notes
    -----
    ``AC_Circle::update_ms`` moves the target on by its rate and counts the turns by it; unlike along a
    leg nothing waits for the vehicle.  So a circle takes its time in any wind, and a vehicle that cannot
    lean enough cuts inside or is blown off.  At a ground speed v on a radius R it leans for v²/R across
    and, with c the drag per airspeed, for c v along and c w against the wind.  Somewhere on the circle
    both add up: with c U = g tan(ANGLE_MAX) at the airspeed limit U it needs

    .. math:: \sqrt{v^2 + (v^2 / c R)^2} + w \le U .
    """
    if airspeed_limit_m_s is None or not len(circles.key):
        return
    rows = circles.key // SLOTS
    rate = circle_rate_rad_s(stages.radius_m[rows], stages.speed_m_s[rows], parameters)
    speed = rate * circles.speed_m_s / np.abs(circles.law.rate_rad_s)
    across = rate * speed / drag_per_s(parameters, airspeed_limit_m_s)
    strength = np.zeros(len(rows))
    if wind is not None:
        strength = wind.speed_m_s * wind.speed_factor(circles.law.start_m[:, 2])
    needed = np.hypot(speed, across) + strength
    # A wind as strong as the limit is W101's.
    some = (needed > airspeed_limit_m_s) & (strength < airspeed_limit_m_s)
    if not some.any():
        return
    worst = int(np.argmax(np.where(some, needed, 0.0)))
    first = int(stages.item[rows[some][0]])
    count = quantity.count(int(some.sum()), "circle")
    yield CIRCLE_LEAN.finding(
        f"{count} from item {first} on: {speed[worst]:.1f} m/s over ground in "
        f"{strength[worst]:.1f} m/s of wind needs the lean of {needed[worst]:.1f} m/s of "
        f"airspeed; the limit is {airspeed_limit_m_s:.1f} m/s",
        item=first,
    )
