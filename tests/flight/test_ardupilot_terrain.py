"""ArduPilot over ground it follows: how much it slows down, by hand.

By default it climbs at 2.5 m/s, descends at 1.5 m/s, changes either by 1 m/s², flies at 10 m/s, and slows
down between 5 m and 10 m of error, half of WP_TER_MARGIN and all of it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import DEFAULTS, fly, go, states, takeoff, took_s
from made_missions import HOME, item, mission, north, rtl
from made_missions import takeoff as takeoff_item
from made_terrain import ground, hill, slope

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.flight.motion.ardupilot.stages import followed_speed_m_s
from planner.flight.motion.ardupilot.vertical import landing, landing_level_m, landing_speed_m_s
from planner.flight.motion.followed_ground import following_to_land
from planner.geo.geodesy import LocalFrame
from planner.service.preflight import CheckResult, assess, check
from planner.service.preparation import prepare
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters


def leg_s(
    ground_m: list[float], length_m: float, parameters: ArduPilotParameters = DEFAULTS
) -> float:
    """Return the time of one leg at 10 m/s over ground."""
    [speed] = followed_speed_m_s(
        np.array([1]),
        np.array([ground_m]),
        np.array([length_m]),
        np.array([10.0]),
        climb_m_s=np.array([parameters.climb_speed_m_s]),
        descent_m_s=np.array([parameters.descent_speed_m_s]),
        parameters=parameters,
    )
    return length_m / float(speed)


def steadily_s(rise_m: float, rate_m_s: float, slope: float, margin_m: float = 10.0) -> float:
    """A long slope: all of the rise at the vertical limit but the error it is flown at in the end.

    There the horizontal speed is limit/slope, of 10 m/s so much is left as 2 − e/(m/2); reaching the
    limit with 1 m/s² loses half of the time it takes.
    """
    error_m = (2.0 - rate_m_s / slope / 10.0) * 0.5 * margin_m
    return (rise_m - error_m) / rate_m_s + 0.5 * rate_m_s / 1.0


@pytest.mark.parametrize(("slope", "length_m"), [(0.4, 2000.0), (0.6, 1500.0)])
def test_a_long_rise_is_climbed_at_the_climb_speed(slope: float, length_m: float) -> None:
    rise_m = slope * length_m
    # Half a second: speeding up ends a little before the limit, along the square root.
    assert leg_s([0.0, rise_m], length_m) == pytest.approx(steadily_s(rise_m, 2.5, slope), abs=0.5)


def test_a_long_fall_is_descended_at_the_descent_speed() -> None:
    assert leg_s([800.0, 0.0], 2000.0) == pytest.approx(steadily_s(800.0, 1.5, 0.4), abs=0.5)


@pytest.mark.parametrize(
    ("parameters", "expected_s"),
    [
        (replace(DEFAULTS, climb_speed_m_s=2.0), steadily_s(800.0, 2.0, 0.4)),
        (replace(DEFAULTS, terrain_margin_m=20.0), steadily_s(800.0, 2.5, 0.4, 20.0)),
        (replace(DEFAULTS, terrain_margin_m=0.0), 200.0),  # it does not wait at all
    ],
    ids=["WP_SPD_UP", "WP_TER_MARGIN", "WP_TER_MARGIN 0"],
)
def test_each_parameter_moves_a_long_rise_as_the_law_says(
    parameters: ArduPilotParameters, expected_s: float
) -> None:
    assert leg_s([0.0, 800.0], 2000.0, parameters) == pytest.approx(expected_s, abs=0.6)


def test_a_slope_near_the_climb_speed_is_flown_at_the_error_it_needs() -> None:
    # Shaped at sqrt(2 · 0.5 (e − 0.04)) = 2.4 m/s · (2 − e/5): e = 5.25 m, 95 % of 10 m/s.
    assert leg_s([0.0, 2400.0], 10_000.0) == pytest.approx(10_000.0 / 9.5, rel=2e-3)


@pytest.mark.parametrize("slope", [0.1, 0.2])
def test_a_gentle_slope_costs_nothing(slope: float) -> None:
    # sqrt(5 − 0.04) = 2.23 m/s is climbed at an error of 5 m, where slowing down begins.
    assert leg_s([0.0, 1000.0 * slope], 1000.0) == pytest.approx(100.0)


def test_a_low_step_costs_nothing_however_steep() -> None:
    step = [0.0] * 32 + [4.9] * 33
    assert leg_s(step, 640.0) == pytest.approx(64.0)
    assert leg_s([2.0 * height for height in step], 640.0) > 64.5


def test_a_leg_begins_as_the_one_before_it_ended() -> None:
    # Two halves of a long rise take as long as the whole: 400 m up each.
    speeds = followed_speed_m_s(
        np.array([1, 2]),
        np.array([[0.0, 400.0], [400.0, 800.0]]),
        np.array([1000.0, 1000.0]),
        np.array([10.0, 10.0]),
        climb_m_s=np.array([2.5, 2.5]),
        descent_m_s=np.array([1.5, 1.5]),
        parameters=DEFAULTS,
    )
    assert (1000.0 / speeds).sum() == pytest.approx(leg_s([0.0, 800.0], 2000.0), abs=0.1)


def test_a_flight_over_a_ridge_takes_longer_and_a_level_one_does_not() -> None:
    ridge = (0.0,) * 20 + (10.0, 20.0, 30.0, 40.0, 50.0, 40.0, 30.0, 20.0, 10.0) + (0.0,) * 20
    there = go(1000.0, hold=1.0)
    flat, level, steep = (
        fly(takeoff(), replace(there, followed_ground_m=ground))
        for ground in ((), (100.0,) * 49, ridge)
    )
    assert took_s(level, 1) == took_s(flat, 1)
    # 50 m up at 2.5 m/s and down at 1.5 m/s, for 208 m at 10 m/s, less errors of some 8 m twice.
    longer_s = took_s(steep, 1) - took_s(flat, 1)
    assert longer_s == pytest.approx(42.0 / 2.5 + 42.0 / 1.5 - 20.8, rel=0.25)
    assert states(steep) == states(flat)


def test_a_checked_leg_over_terrain_is_slower_than_one_over_home() -> None:
    def took(frame: int) -> float:
        there = item(16, north(900.0), 30.0, frame=frame)
        one = mission(takeoff_item(30.0), there, rtl())
        vehicle = load_vehicle("arducopter-sitl-quad")
        return check(one, vehicle, terrain=ground(100.0)).totals.time_s

    # A wall of 100 m is overrun before the vehicle has slowed down; it then stands until it is over it.
    assert took(10) - took(3) > 30.0


def heights_over(one: Mission, grid: TerrainGrid) -> tuple[FloatArray, FloatArray]:
    """Return how high a checked flight is above home and above the ground, all along it."""
    assessment = check(one, load_vehicle("arducopter-sitl-quad"), terrain=grid).assessment
    assert assessment is not None
    flight = assessment.flight
    state = flight.motion.state_at_time(np.linspace(0.0, flight.time_s, 4000))
    frame = LocalFrame(latitude_deg=HOME.latitude_deg, longitude_deg=HOME.longitude_deg)
    where = frame.latitude_longitude_deg(state.east_m, state.north_m)
    ground_m = grid.height_amsl_m(*where).filled(np.nan) - 400.0
    return state.height_m, state.height_m - ground_m


def test_a_leg_keeps_its_height_above_a_ridge() -> None:
    there = item(16, north(900.0), 30.0, frame=10)
    one = mission(takeoff_item(30.0), there, item(21, north(900.0)))
    above_home_m, above_ground_m = heights_over(one, ground(40.0))
    # 30 m above the ridge of 40 m; nowhere lower than that but where it takes off and lands.
    assert above_home_m.max() == pytest.approx(70.0, abs=0.5)
    level = above_home_m > 29.9
    # Places a cell apart are looked at: a bend of 40 m in 10 m between two of them is cut by 5 m at most.
    assert 25.0 <= above_ground_m[level].min() <= 30.5


def test_a_circle_keeps_its_height_above_a_slope() -> None:
    circle = item(18, north(200.0), 25.0, frame=10, params=(2.0, None, 60.0, None))
    one = mission(takeoff_item(25.0), circle, rtl())
    above_home_m, above_ground_m = heights_over(one, slope(10.0))
    # From 140 m to 260 m north the ground falls by 0.176 a metre.
    assert above_home_m.min() <= 25.0 - 0.176 * 200.0 + 0.5
    on_circle = slice(1500, 2000)
    assert above_ground_m[on_circle] == pytest.approx(25.0, abs=0.5)


STEP = load_vehicle("falkowski-2023-quadrotor")
OVER_A_RIDGE = mission(
    takeoff_item(30.0),
    item(16, north(900.0), 30.0, frame=10),
    item(21, north(900.0)),
    autopilot=Autopilot.ARDUPILOT,
)


@pytest.mark.parametrize("ceiling_m", [69.0, 71.0])
def test_a_step_response_model_is_flown_over_the_ground_that_ardupilot_follows(
    ceiling_m: float,
) -> None:
    text = f"FENCE_ENABLE,1\nFENCE_TYPE,1\nFENCE_ALT_MAX,{ceiling_m}\nRTL_ALT,3000\n"
    result = check(
        OVER_A_RIDGE,
        STEP,
        battery=Battery(capacity_wh=77.0),
        terrain=hill(40.0),
        parameters=parameters_from_text(text.encode(), source="p.param"),
    )
    codes = {one.code for one in result.findings if one.severity is Severity.ERROR}
    assert ("F110" in codes) is (ceiling_m < 70.0)
    assert "A102" not in codes  # 30 m above the ridge, not 10 m below it


@pytest.mark.parametrize(("left", "severity"), [(1.03, Severity.WARNING), (0.9, Severity.ERROR)])
def test_climbs_that_a_step_response_model_does_not_count_fit_into_the_margin(
    left: float, severity: Severity
) -> None:
    def judged(capacity_wh: float) -> CheckResult:
        pack = Battery(capacity_wh=capacity_wh)
        return check(OVER_A_RIDGE, STEP, battery=pack, terrain=ground(40.0), reserve=0.0)

    first = judged(77.0)
    assert first.return_plan is not None
    assert first.return_plan.margin_wh is not None
    # m g h over an efficiency of 0.5, of what hovers 10 m up on 119.49 · 10^0.02 W with 80 W/kg.
    climbs_wh = 119.49 * 10.0**0.02 / 80.0 * 9.80665 * 40.0 / 0.5 / 3600.0
    margin_wh = min(first.return_plan.margin_wh, 77.0 - first.totals.energy_wh)
    # And for the air up to 470 m AMSL, 1.1707 kg/m³ for 1.225 (ISO 2533), which the model does not count;
    # what is flown lower costs less, a landing from there 0.1 %, some hundredths of what climbs take.
    needed_wh = (77.0 - margin_wh) * math.sqrt(1.225 / 1.1707)
    [one] = [f for f in judged(needed_wh + left * climbs_wh).findings if f.code == "E127"]
    assert one.severity is severity


@pytest.mark.parametrize(
    ("climb_cm_s", "severity"), [(500, Severity.WARNING), (30, Severity.ERROR)]
)
def test_climbs_along_the_ground_fit_beside_what_the_vehicle_takes_longer(
    climb_cm_s: int, severity: Severity
) -> None:
    """A take-off of 30 m at 0.3 m/s takes 100 s for some 25: 2.6 Wh of the 1 Wh left beside the climbs."""
    given = parameters_from_text(f"WPNAV_SPEED_UP,{climb_cm_s}\n".encode(), source="p.param")

    def judged(capacity_wh: float) -> CheckResult:
        pack = Battery(capacity_wh=capacity_wh)
        return check(
            OVER_A_RIDGE, STEP, battery=pack, terrain=ground(40.0), reserve=0.0, parameters=given
        )

    plan = judged(77.0).return_plan
    assert plan is not None
    assert plan.margin_wh is not None
    [one] = [f for f in judged(77.0 - plan.margin_wh + 1.34).findings if f.code == "E127"]
    assert one.severity is severity


INTO_A_VALLEY = mission(takeoff_item(60.0), item(16, north(100.0), 60.0), item(21, north(600.0)))
"""The ground falls from 17.6 m below home to 105.8 m below it on the leg to the landing."""


@pytest.mark.parametrize(
    ("enabled", "ceiling_m", "floor_m", "reported"),
    [
        (1, 63.0, -20.0, ["F110"]),  # 60 m above ground 88 m lower than home
        (1, 63.0, -30.0, []),
        (0, 63.0, -20.0, []),
        (1, 59.0, -30.0, ["F110"]),  # level, as without terrain data
    ],
)
def test_a_leg_to_a_landing_is_judged_level_and_over_the_ground(
    enabled: int, ceiling_m: float, floor_m: float, reported: list[str]
) -> None:
    # From 100 m to 600 m north the ground falls from −17.6 m to −105.8 m: 77.6 m above it all along.
    text = (
        f"TERRAIN_ENABLE,{enabled}\nFENCE_ENABLE,1\nFENCE_TYPE,9\nRTL_ALT,3000\n"
        f"FENCE_ALT_MAX,{ceiling_m}\nFENCE_ALT_MIN,{floor_m}\n"
    )
    found = check(
        INTO_A_VALLEY,
        load_vehicle("arducopter-sitl-quad"),
        terrain=slope(10.0),
        parameters=parameters_from_text(text.encode(), source="p.param"),
        clearance_m=0.0,
    ).findings
    assert [one.code for one in found if one.code == "F110"] == reported


def test_a_landing_leg_over_known_ground_keeps_its_height_above_it() -> None:
    quad = load_vehicle("arducopter-sitl-quad")
    prepared = prepare(INTO_A_VALLEY, Setup(vehicle=quad, terrain=slope(10.0)))
    route = following_to_land(prepared.route, slope(10.0))
    assert route is not None
    assessment = assess(replace(prepared, route=route))
    assert assessment is not None
    flight = assessment.flight
    state = flight.motion.state_at_time(np.linspace(0.0, flight.time_s, 2000))
    on_leg = (state.north_m > 150.0) & (state.north_m < 580.0)
    fall_m = math.tan(math.radians(10.0)) * (state.north_m[on_leg] - 100.0)
    assert state.height_m[on_leg] == pytest.approx(60.0 - fall_m, abs=0.5)
    assert flight.motion.state_at_time(np.array([flight.time_s])).height_m[0] == pytest.approx(
        -math.tan(math.radians(10.0)) * 600.0, abs=0.5
    )
    assert following_to_land(prepared.route, ground(0.0)) is None


@pytest.mark.parametrize(
    "given", [{"rangefinder_type": 8}, {"terrain_enable": 1}, {"terrain_enable": 0}]
)
def test_a_vehicle_that_measures_no_ground_slows_down_ten_metres_above_home(
    given: dict[str, int],
) -> None:
    # From 60 m above home to ground 150 m below it: the last 10 m at 0.5 m/s, or all below 10 m above home.
    start, ground_m = np.array([[0.0, 0.0, 60.0]]), np.array([-150.0])
    measured, own = (
        landing(
            np.array([0]), start, ground_m, one, level_m=landing_level_m(ground_m, np.zeros(1), one)
        ).duration_s.sum()
        for one in (replace(DEFAULTS, rangefinder_type=8), replace(DEFAULTS, **given))
    )
    longer_s = 0.0 if "rangefinder_type" in given else 150.0 / 0.5 - 150.0 / 1.5
    assert own - measured == pytest.approx(longer_s, abs=0.1)


@pytest.mark.parametrize(
    ("above_m", "speed_m_s"),
    # 10 m, and no more than 1 m higher in proportion to that; √(2 · 1 m/s² (e − 0.5 m)) above; 5 m/s at most.
    [(0.0, 0.5), (10.0, 0.5), (10.55, 0.55), (12.5, 2.0), (14.0, 7.0**0.5), (60.0, 5.0)],
)
def test_a_landing_is_as_fast_as_its_height_above_home_has_it(
    above_m: float, speed_m_s: float
) -> None:
    fast = replace(DEFAULTS, land_high_speed_m_s=5.0)
    found = landing_speed_m_s(np.array([above_m]), fast)
    assert found[0] == pytest.approx(speed_m_s, abs=1e-9)
