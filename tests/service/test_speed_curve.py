"""The speed curve: every point is the check's own, and its valleys are the lowest there are."""

from __future__ import annotations

import numpy as np
import pytest
from fenced_missions import at, box
from made_missions import item, jump, mission, north, rtl, speed, takeoff, waypoint

import planner
from planner.errors import UsageError
from planner.flight.prediction import predict_flight
from planner.geo.fence import Fence
from planner.mission.convert import route_at_speed
from planner.physics.wind import Wind
from planner.service.speed import predict_speed_curve
from planner.values import replace
from planner.vehicle.battery import Battery

ARTICLE = planner.load_vehicle("falkowski-2023-quadrotor")
SURVEYOR = planner.load_vehicle("arducopter-sitl-quad")
TIMED = planner.load_vehicle("px4-sih-quad")

LONG = mission(takeoff(50.0), waypoint(2000.0, 50.0), waypoint(0.0, 50.0), rtl())
ZIGZAG = mission(
    takeoff(30.0),
    *(
        item(16, north(30.0 * (row % 4)), 30.0, longitude_deg=8.0 + 0.0006 * (row // 4))
        for row in range(12)
    ),
    rtl(),
)
"""Legs of 30 to 100 m: too short for the higher speeds."""


def test_a_longer_leg_costs_its_length_over_the_speed_at_hover_power() -> None:
    # Article: the speed reached is 0.03569 / 0.3588 * 10 = 0.9947 of the commanded one, and hover
    # power at 100 m is 119.49 * 100 ** 0.02 = 131.02 W, which cruise is taken to cost.
    near, far = (
        mission(takeoff(100.0), waypoint(metres, 100.0), item(21, north(metres), 0.0))
        for metres in (500.0, 1500.0)
    )
    for one in (4.0, 8.0):
        more_wh = (
            predict_speed_curve(far, ARTICLE, from_m_s=one, to_m_s=one).energy_wh
            - predict_speed_curve(near, ARTICLE, from_m_s=one, to_m_s=one).energy_wh
        )
        by_hand_wh = 131.02 * 1000.0 / (0.9947 * one) / 3600.0
        # north() is good to 1 m in a kilometre, the response settles to 1e-3 within 500 m
        assert more_wh == pytest.approx(by_hand_wh, rel=2e-3)


@pytest.mark.parametrize(("made", "low", "high"), [(LONG, 11.5, 12.9), (ZIGZAG, 6.0, 7.2)])
def test_the_best_speeds_are_those_of_a_scan_at_a_hundredth(
    made: planner.Mission, low: float, high: float
) -> None:
    curve = predict_speed_curve(made, SURVEYOR, from_m_s=low, to_m_s=high)
    tried = np.round(np.arange(low, high + 0.005, 0.01), 2)
    assessment = planner.check(made, SURVEYOR).assessment
    assert assessment is not None
    flights = [
        predict_flight(
            route_at_speed(assessment.route, float(one)), assessment.setup, assessment.returns.pilot
        )
        for one in tried
    ]
    energy_wh = np.array([flight.energy_j for flight in flights])
    mean_w = np.array([flight.energy_j / flight.time_s for flight in flights])
    assert curve.best_range is not None
    assert curve.best_endurance is not None
    for found, brute in ((curve.best_range, energy_wh), (curve.best_endurance, mean_w)):
        slowest_best = tried[np.flatnonzero(brute <= brute.min() * (1.0 + 1e-9))[0]]
        assert found.speed_m_s == slowest_best


def test_of_speeds_that_no_leg_is_long_enough_for_the_slowest_counts() -> None:
    short = mission(takeoff(30.0), *(waypoint(15.0 * (row % 2), 30.0) for row in range(4)), rtl())

    def energy_wh(speed_m_s: float) -> float:
        return planner.check(short, SURVEYOR, speed_m_s=speed_m_s).totals.energy_wh

    best = predict_speed_curve(short, SURVEYOR).best_range
    assert best is not None
    assert best.speed_m_s is not None
    # legs from rest to rest of 15 m: less than 10 m/s even at 5 m/s2 all along, v = sqrt(a L)
    assert best.speed_m_s < 10.0
    assert energy_wh(best.speed_m_s) == pytest.approx(energy_wh(15.0), rel=1e-9)
    assert energy_wh(round(best.speed_m_s - 0.01, 2)) > energy_wh(15.0) * (1.0 + 1e-9)


HELD = mission(
    takeoff(50.0),
    waypoint(200.0, 50.0),
    item(114, frame=2, params=(300.0, 0.0, 0.0, 0.0)),
    item(112, frame=2, params=(10.0, 0.0, 0.0, 0.0)),
    speed(3.0),
    waypoint(2000.0, 50.0),
    waypoint(0.0, 50.0),
    rtl(),
)
"""How far the vehicle is when its condition is met depends on its speed."""


@pytest.mark.parametrize("flown_mission", [LONG, HELD], ids=["long", "held"])
def test_a_point_of_the_curve_is_what_the_check_says(flown_mission: planner.Mission) -> None:
    wind = Wind(speed_m_s=4.0, from_deg=180.0)
    curve = predict_speed_curve(
        flown_mission, SURVEYOR, from_m_s=5.0, to_m_s=9.0, step_m_s=2.0, wind=wind, reserve=0.3
    )
    assert curve.speed_m_s.tolist() == [5.0, 7.0, 9.0]
    for flown in curve.points:
        result = planner.check(
            flown_mission, SURVEYOR, speed_m_s=flown.speed_m_s, wind=wind, reserve=0.3
        )
        assert result.battery is not None
        assert (flown.energy_wh, flown.time_s) == (result.totals.energy_wh, result.totals.time_s)
        assert (flown.margin_wh, flown.verdict) == (result.battery.margin_wh, result.verdict)


def test_a_headwind_makes_the_best_range_faster_over_the_air_and_dearer() -> None:
    there = mission(takeoff(50.0), waypoint(4000.0, 50.0), item(21, north(4000.0), 0.0))
    calm, windy = (
        predict_speed_curve(
            there, SURVEYOR, from_m_s=9.0, wind=Wind(speed_m_s=of, from_deg=0.0)
        ).best_range
        for of in (0.0, 4.0)
    )
    assert calm is not None
    assert windy is not None
    assert calm.speed_m_s is not None
    assert windy.speed_m_s is not None
    # Against 4 m/s the best ground speed falls by less than the wind: the airspeed rises.
    assert calm.speed_m_s - 4.0 < windy.speed_m_s < calm.speed_m_s
    assert (windy.energy_wh or 0.0) > (calm.energy_wh or 0.0)


def test_the_fastest_that_fits_is_the_last_hundredth_that_does() -> None:
    far = mission(takeoff(50.0), waypoint(3000.0, 50.0), waypoint(0.0, 50.0), rtl())
    light = replace(SURVEYOR, battery=None)  # a larger pack than its own would weigh more

    def needed_wh(speed_m_s: float) -> float:
        result = planner.check(far, light, speed_m_s=speed_m_s, battery=Battery(capacity_wh=300.0))
        assert result.battery is not None
        assert result.return_plan is not None
        margin_wh = min(result.battery.margin_wh, result.return_plan.margin_wh or 0.0)
        return 0.8 * 300.0 - margin_wh

    # beyond the best range, near 12 m/s, every faster speed takes more
    battery = Battery(capacity_wh=0.5 * (needed_wh(13.0) + needed_wh(15.0)) / 0.8)
    fastest = predict_speed_curve(far, light, battery=battery).fastest_fitting
    assert fastest is not None
    assert fastest.speed_m_s is not None
    assert 13.0 < fastest.speed_m_s < 15.0
    assert needed_wh(fastest.speed_m_s) <= 0.8 * battery.energy_wh
    assert needed_wh(fastest.speed_m_s + 0.01) > 0.8 * battery.energy_wh


def test_the_fastest_with_room_to_the_fence_is_told_apart_from_the_fastest_that_fits() -> None:
    # 400 m north, a stop there, and the fence 9.5 m behind it: the way of a second of reaction, what the
    # stop passes its end by (0.07687 s of the speed, swarm.md) and 2.5 m of position error, so that
    # 7 m / 1.07687 s of the 0.9947 commanded have room.
    items = (takeoff(20), at(0, 400), rtl())
    made = replace(mission(*items), fence=Fence(polygons=(box(-100.0, -100.0, 100.0, 409.5),)))
    curve = predict_speed_curve(made, ARTICLE, battery=Battery(capacity_wh=77.0))
    assert curve.fastest_fitting is not None
    assert curve.fastest_fitting.speed_m_s == 10.0
    assert curve.fastest_fitting.against == ("F102",)
    assert curve.fastest_clear is not None
    # 2 cm of the local frame move it a little
    assert curve.fastest_clear.speed_m_s == pytest.approx(7.0 / 1.07687 / 0.9947, abs=0.03)


def test_without_power_over_airspeed_no_best_speed_is_told() -> None:
    for vehicle in (ARTICLE, TIMED):
        curve = predict_speed_curve(LONG, vehicle, step_m_s=5.0)
        assert not curve.is_power_over_speed_known
        assert curve.best_range is None
        assert curve.best_endurance is None
    assert curve.fastest_fitting is None
    assert np.isnan(curve.energy_wh).all()


def test_the_present_speed_is_the_commanded_one_the_vehicles_own_or_several() -> None:
    slow_then_fast = mission(
        takeoff(50.0), speed(4.0), waypoint(500.0, 50.0), speed(8.0), waypoint(0.0, 50.0), rtl()
    )
    for made, vehicle, present_m_s in (
        (LONG, SURVEYOR, 10.0),
        (LONG, TIMED, 5.0),
        (slow_then_fast, SURVEYOR, None),
    ):
        curve = predict_speed_curve(made, vehicle, from_m_s=6.0, to_m_s=6.0)
        assert curve.present.speed_m_s == present_m_s


def test_the_range_ends_where_the_model_or_the_vehicle_does() -> None:
    assert predict_speed_curve(LONG, SURVEYOR, from_m_s=14.0).speed_m_s[-1] == 15.1
    assert predict_speed_curve(LONG, TIMED, from_m_s=11.0).speed_m_s[-1] == 12.0  # MPC_XY_VEL_MAX


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"from_m_s": 8.0, "to_m_s": 5.0}, "rises from above 0"),
        ({"from_m_s": 0.0}, "rises from above 0"),
        ({"step_m_s": 0.001}, "give 0.01 m/s or more"),
        ({"to_m_s": 90.0, "step_m_s": 0.01}, "no more than 500"),
        ({"speed_m_s": 5.0}, "give a range instead"),
    ],
)
def test_a_range_that_is_none_is_a_sentence(given: dict[str, float], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        predict_speed_curve(LONG, SURVEYOR, **given)


def test_a_mission_that_flies_nowhere_is_a_sentence() -> None:
    with pytest.raises(UsageError, match="nothing is flown"):
        predict_speed_curve(mission(jump(1, 2.0)), SURVEYOR)
