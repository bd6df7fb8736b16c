"""Circles as ArduPilot flies them: a target that turns at a steady rate, whatever becomes of the vehicle.

The next leg begins at once from the stopping point, while the vehicle still comes out of the turn.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.ardupilot.circle_path import circle_path
from planner.flight.motion.ardupilot.legs import SLOTS, start_delay_s
from planner.flight.motion.ardupilot.stages import places_about_m, vectors_about
from planner.flight.motion.kinematics import (
    CircleLaw,
    CirclesAtRate,
    FlightState,
    horizontal,
    lengths,
    make_manoeuvres,
    quotient,
)
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray, IntArray
    from planner.flight.motion.ardupilot.legs import ArduPilotLegs
    from planner.flight.motion.ardupilot.stages import StageColumns
    from planner.flight.motion.ardupilot.track_lag import TrackLag
    from planner.flight.motion.kinematics import Manoeuvres
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters


class Circles(Value, eq=False):
    """Circles that lead round something, one per row, and the vehicle in motion at their ends."""

    stage: IntArray
    entries: Manoeuvres
    """How each comes to its steady part, or to its end."""
    law: CircleLaw
    """Of the steady parts."""
    steady_s: FloatArray
    """Durations of the steady parts, zero where a circle is over before. (n,) [s]"""
    target_m_s: FloatArray
    """Speed of the target on the circle that is named. (n,) [m s⁻¹]"""
    last_m: FloatArray
    """Where the last turn ends. (n, 3) [m]"""
    last_m_s: FloatArray
    """Velocity there. (n, 3) [m s⁻¹]"""
    asked_m_s2: FloatArray
    """Acceleration asked for there. (n, 3) [m s⁻²]"""

    def at_rate(self, item: IntArray) -> CirclesAtRate | None:
        """Return what they ask of the vehicle, with the items of all stages; ``None``: there are none."""
        if not len(self.stage):
            return None
        return CirclesAtRate(
            item=item[self.stage],
            speed_m_s=self.target_m_s,
            turn_m_s2=np.abs(self.law.rate_rad_s) * self.target_m_s,
            height_m=self.law.start_m[:, 2],
        )

    @property
    def way_m(self) -> FloatArray:
        """Ways of the steady parts. (n,) [m]"""
        away = horizontal(self.law.start_m[:, :2] - self.law.centre_m)
        return np.asarray(np.abs(self.law.rate_rad_s) * away * self.steady_s)


def plan_circles(stages: StageColumns) -> Circles:
    """Return the circles that lead round something."""
    rows = [row for row, task in stages.circles.items() if task.leads_round]
    if not rows:
        return _no_circles()
    tasks = [stages.circles[row] for row in rows]
    paths = [circle_path(task) for task in tasks]
    longest = max(len(path.time_s) for path in paths)
    # A path of fewer nodes rests at its last for no time.
    nodes = np.zeros((3, len(rows), longest), np.complex128)
    for row, path in enumerate(paths):
        for column, values in zip(nodes[:, row], path[:3], strict=True):
            column[: len(values)], column[len(values) :] = values, values[-1]
    time, place, velocity = nodes
    lasts = np.array([path[3:6] for path in paths], np.complex128).reshape(len(rows), 3)
    stage = np.array(rows, np.intp)
    about = stages.edge_m[stage], stages.place_m[stage], stages.radius_m[stage]
    place_m = places_about_m(np.column_stack((place, lasts[:, 0])), *about)
    vectors = vectors_about(np.column_stack((velocity, lasts[:, 1:])), *about)
    rate = np.array([task.rate_rad_s for task in tasks])
    over_s = np.array([task.duration_s for task in tasks])
    return Circles(
        stage=stage,
        entries=make_manoeuvres(
            stage * SLOTS + 1,
            FlightState.CRUISE,
            position_m=place_m[:, :-1],
            velocity_m_s=vectors[:, :-2],
            duration_s=np.diff(time.real, axis=1),
        ),
        law=CircleLaw(
            start_m=place_m[:, -2],
            centre_m=stages.place_m[stage, :2],
            rate_rad_s=-np.copysign(rate, stages.radius_m[stage]),
        ),
        steady_s=over_s - time[:, -1].real,
        target_m_s=rate * np.abs(stages.radius_m[stage]),
        last_m=place_m[:, -1],
        last_m_s=vectors[:, -2],
        asked_m_s2=vectors[:, -1],
    )


@cache
def _no_circles() -> Circles:
    stage, number, place = np.zeros(0, np.intp), np.zeros(0), np.zeros((0, 3))
    return Circles(
        stage=stage,
        entries=make_manoeuvres(
            stage,
            FlightState.CRUISE,
            position_m=place[:, None],
            velocity_m_s=place[:, None],
            duration_s=number[:, None][:, :0],
        ),
        law=CircleLaw(start_m=place, centre_m=place[:, :2], rate_rad_s=number),
        steady_s=number,
        target_m_s=number,
        last_m=place,
        last_m_s=place,
        asked_m_s2=place,
    )


def leave_circles(
    stages: StageColumns,
    circles: Circles,
    legs: ArduPilotLegs,
    parameters: ArduPilotParameters,
    lag: TrackLag,
) -> tuple[ArduPilotLegs, tuple[Manoeuvres, ...]]:
    """Return the legs behind circles begun while the vehicle comes out of the turn, and how it does.

    Where no leg follows it brakes to its stopping point.

    Notes
    -----
    ``ModeAuto::wp_start``: ``wp_and_spline_init`` puts the reference to the stopping point, at rest, and
    the S-curve begins there at once.
    """
    count = len(circles.stage)
    if not count:
        return legs, ()
    ahead, speed = stages.end_m[circles.stage] - circles.last_m, lengths(circles.last_m_s)
    leaving_s = quotient(2.0 * lengths(ahead), speed)
    end_m, end_m_s = stages.end_m[circles.stage].copy(), np.zeros((count, 3))
    hidden, early, wait_s = legs.hidden_s.copy(), legs.early_s.copy(), legs.curves.wait_s.copy()
    if len(legs.key):
        last = len(legs.key) - 1
        first = np.minimum(np.searchsorted(legs.key, (circles.stage + 1) * SLOTS), last)
        second = np.minimum(first + 1, last)
        shown_s = legs.curves.duration_s - 2.0 * legs.half_overlap_s
        # A return climbs, if only by the centimetre its height is rounded to, and flies home behind that.
        is_short = shown_s[first] < leaving_s
        row, still_s = np.where(is_short, second, first), np.where(is_short, shown_s[first], 0.0)
        follows = (legs.key[first] // SLOTS == circles.stage + 1) & (
            legs.key[row] // SLOTS == circles.stage + 1
        )
        some = np.flatnonzero(follows & (still_s + shown_s[row] > leaving_s))
        first, row, still_s = first[some], row[some], still_s[some]
        lost_s = lag.lost_from_motion_s(
            legs.curves.up.select(row),
            legs.direction[row],
            still_s=still_s,
            ahead_m=ahead[some],
            velocity_m_s=circles.last_m_s[some],
            asked_m_s2=circles.asked_m_s2[some],
        )
        wait_s[row] = start_delay_s(legs.direction[row], parameters) + lost_s
        hidden[first], hidden[row] = still_s, leaving_s[some] - still_s
        early[first] = leaving_s[some]
        early[row] = np.where(row == first, leaving_s[some], hidden[row])
        legs = replace(
            legs, curves=replace(legs.curves, wait_s=wait_s), hidden_s=hidden, early_s=early
        )
        way, rate = legs.curves.at(hidden)
        end_m[some] = legs.start_m[row] + way[row, None] * legs.direction[row]
        end_m_s[some] = rate[row, None] * legs.direction[row]
    leaving = make_manoeuvres(
        circles.stage * SLOTS + 3,
        FlightState.BRAKE,
        position_m=np.stack((circles.last_m, end_m), axis=1),
        velocity_m_s=np.stack((circles.last_m_s, end_m_s), axis=1),
        duration_s=leaving_s[:, None],
        stopping_distance_m=lengths(ahead),
    )
    return legs, (leaving,)
