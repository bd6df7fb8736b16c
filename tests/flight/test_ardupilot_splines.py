"""ArduPilot's splines: lines where they do not bend, joined by legs at speed."""

from __future__ import annotations

import numpy as np
import pytest
from ardupilot_missions import fly, go, stage, takeoff, time_s
from ardupilot_times import leg_s

from planner.mission.route.stage import StageKind


def test_a_spline_through_points_on_a_line_is_a_leg_with_half_the_acceleration() -> None:
    points = [stage(StageKind.SPLINE, 200.0 * k) for k in (1, 2, 3)]
    motion = fly(takeoff(), *points)
    # From rest to rest over 600 m at 10 m/s with 1.25 m/s².
    assert time_s(motion) - time_s(fly(takeoff())) == pytest.approx(60.0 + 10.0 / 1.25, rel=0.03)
    assert motion.segments.distance_m.sum() == pytest.approx(600.0, rel=1e-3)


def test_splines_keep_their_speed_where_they_hardly_bend() -> None:
    points = [stage(StageKind.SPLINE, 200.0 * k, 10.0 * (k % 2)) for k in range(1, 6)]
    motion = fly(takeoff(), *points)
    piece = np.arange(len(motion.piece_duration_s))
    begins = motion.piece_start_s()
    speed = motion.state_at(piece, 0.5 * motion.piece_duration_s).ground_speed_m_s
    first, last = (motion.segments.end_s[motion.arrival_segment[k]] for k in (1, 4))
    assert speed[(begins > first) & (begins < last)].min() > 9.0


def test_straight_legs_join_splines_at_speed() -> None:
    motion = fly(takeoff(), go(300.0), stage(StageKind.SPLINE, 600.0), go(900.0, hold=1.0))
    stopped = 3 * leg_s(300.0)
    assert motion.segments.duration_s[1:].sum() < stopped - 2 * 5.0
