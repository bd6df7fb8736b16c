"""MPC_TILTMAX_AIR below what MPC_ACC_HOR needs: PX4's trajectory waits for a vehicle that cannot follow."""

from __future__ import annotations

import math

import numpy as np
import pytest
from ardupilot_missions import go, stage, takeoff
from px4_flights import fly_px4

from planner.flight.motion.kinematics import STATE_INDEX, FlightState, Motion
from planner.flight.motion.px4.braking import stopping_distance_m
from planner.mission.route.stage import StageKind
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

PX4 = Px4Parameters()
DRAG_PER_S = 0.15
"""Of the vehicle flown."""


def zig_zag(parameters: Px4Parameters) -> Motion:
    """Return ten lanes of 45 m, 12 m apart, flown to and fro at 10 m/s."""
    places = [
        (12.0 * lane, 10.0 + north)
        for lane in range(10)
        for north in ((0.0, 45.0) if lane % 2 == 0 else (45.0, 0.0))
    ]
    stages = [takeoff(12.0)]
    stages += [replace(go(east, north), height_m=12.0, speed_m_s=10.0) for east, north in places]
    east, north = places[-1]
    stages.append(stage(StageKind.LAND, east_m=east, north_m=north, height_m=0.0))
    return fly_px4(tuple(stages), parameters, drag_per_s=DRAG_PER_S)


@pytest.mark.parametrize(
    ("acceleration", "jerk", "tilt_deg", "flown_s"),
    [
        (8.0, 15.0, 45.0, 123.4),
        (8.0, 15.0, 20.0, 144.0),
        (5.0, 8.0, 20.0, 148.1),
        (3.0, 4.0, 12.0, 178.4),
        (5.0, 8.0, 25.0, 141.0),
        (10.0, 20.0, 35.0, 123.9),
    ],
)
def test_a_zig_zag_takes_what_was_flown_at_a_low_tilt(
    acceleration: float, jerk: float, tilt_deg: float, flown_s: float
) -> None:
    # Flown in simulation from arming to disarming; without the tilt 119 s for the 144 s.
    parameters = replace(
        PX4,
        acceleration_m_s2=acceleration,
        jerk_m_s3=jerk,
        lean_angle_max_rad=math.radians(tilt_deg),
    )
    predicted_s = float(zig_zag(parameters).segments.duration_s.sum())
    assert predicted_s == pytest.approx(flown_s, rel=0.035)


@pytest.mark.parametrize(("tilted_m_s2", "speeds_up_s"), [(1.5, 4.0), (3.0, 2.0), (6.0, 2.0)])
def test_a_vehicle_speeds_up_by_what_its_tilt_allows(
    tilted_m_s2: float, speeds_up_s: float
) -> None:
    # 6 m/s at 3 m/s², almost without jerk: 2 s, at 1.5 m/s² 4 s.
    parameters = replace(PX4, jerk_m_s3=400.0, lean_angle_max_rad=math.atan(tilted_m_s2 / 9.80665))
    motion = fly_px4(
        (takeoff(12.0), replace(go(0.0, 90.0), height_m=12.0, speed_m_s=6.0)), parameters
    )
    gained = motion.segments.state == STATE_INDEX[FlightState.ACCELERATE]
    assert motion.segments.duration_s[np.flatnonzero(gained)[0]] == pytest.approx(
        speeds_up_s, abs=0.02
    )


@pytest.mark.parametrize(
    ("tilt_deg", "way_m"),
    # 8 (8/2a + 0.6) with a = 9.80665 tan 10° = 1.729 m/s², and with MPC_ACC_HOR 3 m/s².
    [(10.0, 23.31), (17.0, 15.47), (17.2, 15.47), (45.0, 15.47)],
)
def test_a_stop_is_no_harder_than_the_tilt_allows(tilt_deg: float, way_m: float) -> None:
    parameters = replace(PX4, lean_angle_max_rad=math.radians(tilt_deg))
    assert float(stopping_distance_m(8.0, parameters)) == pytest.approx(way_m, abs=0.02)
