"""How a noisy position slows PX4 down, and where the noise comes from."""

from __future__ import annotations

import numpy as np
import pytest
from ardupilot_missions import go, takeoff
from made_missions import mission, rtl, waypoint
from made_missions import takeoff as takeoff_item
from px4_flights import fly_px4

from planner.autopilot import Autopilot
from planner.flight.motion.px4.pilot import Px4Pilot
from planner.flight.pilot import make_pilot
from planner.service.preflight import check
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.px4 import Px4Parameters

PX4 = Px4Parameters()


def flown_with_m(given_m: float | None) -> float:
    """Return the noise a flight of PX4's simulated vehicle is flown with."""
    setup = Setup(load_vehicle("px4-sih-quad"), position_noise_m=given_m)
    pilot = make_pilot(setup, PX4)
    assert isinstance(pilot, Px4Pilot)
    return pilot.noise_m


def test_the_noise_is_the_models_unless_one_is_given() -> None:
    assert flown_with_m(None) == load_vehicle("px4-sih-quad").position_noise_m > 0.0
    assert flown_with_m(0.31) == 0.31
    assert flown_with_m(0.0) == 0.0


@pytest.mark.parametrize(("given_m", "says"), [(None, 1), (0.0, 0), (0.31, 0)])
def test_noise_that_was_assumed_is_said(given_m: float | None, says: int) -> None:
    flown = mission(takeoff_item(20), waypoint(100, 20), rtl(), autopilot=Autopilot.PX4)
    vehicle = load_vehicle("px4-sih-quad")
    result = check(flown, vehicle, position_noise_m=given_m)
    assert sum(finding.code == "T109" for finding in result.findings) == says
    assert result.setup.position_noise_m == (
        vehicle.position_noise_m if given_m is None else given_m
    )


@pytest.mark.parametrize("noise_m", [0.0, 0.31])
def test_a_take_off_near_the_ground_is_not_slowed(noise_m: float) -> None:
    # The trajectory's height is kept at the vehicle's there: 10 m after 11.7 s, as measured.
    motion = fly_px4((takeoff(60.0),), PX4, noise_m=noise_m)
    time_s = np.linspace(0.0, motion.segments.end_s[-1], 4001)
    height_m = motion.state_at_time(time_s).height_m
    assert time_s[np.argmax(height_m >= 10.0)] == pytest.approx(11.7, abs=0.05)


@pytest.mark.parametrize("height_m", [160.0, 10.0])
def test_climbs_and_descents_pay_for_noise_as_the_law_says(height_m: float) -> None:
    stages = (takeoff(60.0), go(0.0, 0.0, 60.0, hold=20.0), go(0.0, 0.0, height_m))
    quiet, noisy = (
        np.diff(fly_px4(stages, PX4, noise_m=noise).segments.end_s)[-1] for noise in (0.0, 0.3)
    )
    # Half of the time behind, at 1 − 0.3/2 of the pace: 1 − 0.075 in the mean.
    assert noisy / quiet == pytest.approx(1.0 / 0.925, rel=1e-3)


@pytest.mark.parametrize("error_max_m", [1.0, 2.0, 4.0])
def test_the_greatest_error_moves_what_noise_costs(error_max_m: float) -> None:
    parameters = replace(PX4, position_error_max_m=error_max_m)
    stages = (takeoff(60.0), go(0.0, 0.0, 60.0, hold=20.0), go(0.0, 0.0, 160.0))
    quiet, noisy = (
        np.diff(fly_px4(stages, parameters, noise_m=noise).segments.end_s)[-1]
        for noise in (0.0, 0.3)
    )
    # MPC_XY_ERR_MAX is the error at which time stands still.
    assert noisy / quiet == pytest.approx(1.0 / (1.0 - 0.5 * 0.3 / error_max_m), rel=1e-3)
