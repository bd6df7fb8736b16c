"""How a vehicle of a fleet answers commanded velocities, as an agent of a swarm."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.fleet.swarm.dynamics import Dynamics
from planner.flight.pilot import StepPilot
from planner.physics.response import TransferFunction

if TYPE_CHECKING:
    from planner.flight.pilot import Pilot
    from planner.setup import Setup

_STEP_LIKE = 1e-3
"""Stops longer than in proportion to the speed by less than this are those of a linear system. [-]"""


def agent_dynamics(setup: Setup, pilot: Pilot) -> tuple[Dynamics, float]:
    """Return how a vehicle answers velocities, and its steady speed.

    A vehicle of reference steps by its own response; one whose reference is shaped by the acceleration and
    the lag that its stops from full and from half speed come from, s(v) = v² / 2a + τ v, and by its jerk,
    which takes a / 2j of that lag.
    """
    vehicle = setup.vehicle
    own_m_s = pilot.speeds.own_m_s if isinstance(pilot, StepPilot) else vehicle.default_speed_m_s
    speed_m_s = setup.speed_m_s or own_m_s
    if speed_m_s is None:
        speed_m_s = float(pilot.parameters.cruise_speed_m_s)  # type: ignore[attr-defined]
    if vehicle.responses.speed is not None and vehicle.ramps is None:
        response = vehicle.responses.speed.transfer_function
        gain = vehicle.responses.speed.unit_step.final_value
        if response.dc_gain and setup.flown_by is Autopilot.STEP:
            numerator = tuple(one / response.dc_gain for one in response.numerator)
            unit = TransferFunction(
                numerator=numerator, denominator=response.denominator, delay_s=response.delay_s
            )
            return Dynamics(response=unit), speed_m_s * gain
    full_m, half_m = pilot.farthest_stop_m(np.array([speed_m_s, 0.5 * speed_m_s])).tolist()
    bent_m = full_m - 2.0 * half_m
    if bent_m <= _STEP_LIKE * full_m:
        acceleration_m_s2, lag_s = math.inf, full_m / speed_m_s
    else:
        acceleration_m_s2 = speed_m_s**2 / (4.0 * bent_m)
        lag_s = max((full_m - speed_m_s**2 / (2.0 * acceleration_m_s2)) / speed_m_s, 0.0)
    smoothing_s = 0.0
    if setup.flown_by is not Autopilot.STEP and math.isfinite(acceleration_m_s2):
        smoothing_s = acceleration_m_s2 / pilot.parameters.jerk_m_s3  # type: ignore[attr-defined]
    lag_s = max(lag_s - 0.5 * smoothing_s, 0.0)
    denominator = (lag_s, 1.0) if lag_s > 0.0 else (1.0,)
    return (
        Dynamics(
            response=TransferFunction(numerator=(1.0,), denominator=denominator),
            acceleration_m_s2=acceleration_m_s2,
            smoothing_s=smoothing_s,
        ),
        speed_m_s,
    )
