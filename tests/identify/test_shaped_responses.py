"""How a vehicle follows the references its autopilot shapes, identified and used."""

from __future__ import annotations

import datetime as dt
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record
from scipy.signal import lsim

from planner.autopilot import Autopilot
from planner.identify.assembly import IdentificationSettings
from planner.identify.identification import identify_vehicle
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.reader import vehicle_from_toml
from planner.vehicle.writer import vehicle_text

if TYPE_CHECKING:
    from planner.vehicle.model import VehicleModel

LAG_S = 0.8
STEP_S = 0.1


@cache
def identified(
    autopilot: Autopilot, damping: float | None = None, base: VehicleModel | None = None
) -> VehicleModel:
    """Return the model of a vehicle behind its reference by a lag, or swinging about it."""
    time_s = np.arange(0.0, 420.0, STEP_S)
    # four times up to 8 m/s in 4 s, 40 s there, down in 4 s, 50 s of rest
    starts = np.arange(20.0, 420.0, 100.0)
    corners = np.concatenate([[s, s + 4.0, s + 44.0, s + 48.0] for s in starts])
    reference = np.interp(time_s, corners, np.tile([0.0, 8.0, 8.0, 0.0], starts.size))
    system = ([1.0], [LAG_S, 1.0])
    if damping is not None:
        system = ([4.0], [1.0, 4.0 * damping, 4.0])
    speed = lsim(system, reference, time_s)[1]
    noise = np.random.default_rng(9).normal(0.0, 0.05, time_s.size)
    record = replace(
        make_record(
            is_landed=(time_s < 5.0) | (time_s > 415.0),
            height_above_home_m=np.full(time_s.size, 30.0),
            climb_m_s=np.zeros(time_s.size),
            ground_speed_m_s=speed + noise,
            reference_speed_m_s=reference,
            reference_height_m=np.full(time_s.size, 30.0),
        ),
        autopilot=autopilot,
    )
    settings = IdentificationSettings(
        name="lagging", date=dt.date(2026, 1, 2), version="1", base=base
    )
    return identify_vehicle([record], settings).model


def test_how_ardupilot_is_followed_is_in_the_model_file() -> None:
    response = identified(Autopilot.ARDUPILOT).responses.speed
    assert response is not None
    system = response.transfer_function
    # mean residence time of a response of steady gain 1: a1/a0 less b1/b0, and the delay
    residence_s = system.denominator[-2] / system.denominator[-1] + system.delay_s
    assert residence_s == pytest.approx(LAG_S, abs=0.02)  # 0.05 m/s over 16 ramps of 40 samples
    model = identified(Autopilot.ARDUPILOT)
    assert (
        vehicle_from_toml(vehicle_text(model).encode(), name="lagging", source=model.source)
        == model
    )


def test_px4_is_taken_to_fly_its_references() -> None:
    assert identified(Autopilot.PX4).responses.speed is None


def test_what_swings_about_a_shaped_reference_is_not_used() -> None:
    assert identified(Autopilot.ARDUPILOT, 0.05).responses.speed is None


def test_the_drag_that_flights_do_not_tell_is_that_of_the_base() -> None:
    base = load_vehicle("px4-sih-quad")
    assert base.drag_per_s is None
    for drag_per_s in (None, 1.05):
        known = replace(base, drag_per_s=drag_per_s)
        assert identified(Autopilot.PX4, base=known).drag_per_s == drag_per_s
    assert identified(Autopilot.PX4).drag_per_s is None
