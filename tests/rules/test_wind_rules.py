"""The wind wherever the vehicle may be: on its mission, holding, returning; and what PX4 does of itself."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest
from fenced_missions import circle, rally
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import item, mission, north, rtl, speed, takeoff, waypoint
from made_terrain import ground
from rule_cases.case import ARDUPILOT, PLAIN, PX4, STEP, found, vehicle_of
from thinning import examples

from planner.findings import Severity
from planner.geo.fence import Fence
from planner.physics.wind import Wind
from planner.service.preflight import check
from planner.site_profile import SiteProfile
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.mission.items import Mission
    from planner.vehicle.model import VehicleModel

WARNING, ERROR = Severity.WARNING, Severity.ERROR
HOVER = mission(takeoff(30), waypoint(0, 30, hold_s=60.0), item(21, north(0), 0.0))
UP_AND_DOWN = mission(takeoff(30), item(21, north(0), 0.0))
QUAD = vehicle_of(ARDUPILOT)
"""Identified up to 15.1 m/s; flies its legs and its returns at 10 m/s."""
LIMITED = replace(QUAD, airspeed_limit_m_s=12.0)


def severities(
    code: str,
    one: Mission,
    vehicle: VehicleModel = QUAD,
    autopilot: Autopilot = ARDUPILOT,
    **more: Any,  # noqa: ANN401 - whatever check takes
) -> list[Severity]:
    return [f.severity for f in of(code, one, vehicle, autopilot, **more)]


def of(
    code: str,
    one: Mission,
    vehicle: VehicleModel = QUAD,
    autopilot: Autopilot = ARDUPILOT,
    **more: Any,  # noqa: ANN401 - whatever check takes
) -> list[Finding]:
    return [f for f in found(one, autopilot, vehicle=vehicle, **more) if f.code == code]


# Of 12 m/s in level flight the descent at 1.5 m/s, which both are delivered with, leaves
# 12 − 1.5 tan 30° = 11.13 m/s, and leaning 45° 12 − 1.5 = 10.5 m/s.
@pytest.mark.parametrize("one", [HOVER, UP_AND_DOWN], ids=["hover", "up and down"])
@pytest.mark.parametrize(
    ("autopilot", "speed_m_s", "sd_m_s", "fires"),
    [
        (ARDUPILOT, 13.0, 0.0, True),
        (ARDUPILOT, 11.2, 0.0, True),
        (ARDUPILOT, 11.1, 0.0, False),
        (ARDUPILOT, 10.0, 0.55, False),  # 11.1 in gusts
        (ARDUPILOT, 10.0, 0.6, True),  # 11.2
        (PX4, 13.0, 0.0, True),
        (PX4, 10.6, 0.0, True),
        (PX4, 10.4, 0.0, False),
        (PX4, 9.0, 0.7, False),  # 10.4 in gusts
        (PX4, 9.0, 0.8, True),  # 10.6
    ],
)
def test_wind_beyond_the_limit_of_a_vehicle_that_only_hovers_climbs_and_lands_is_an_error(
    one: Mission, autopilot: Autopilot, speed_m_s: float, sd_m_s: float, *, fires: bool
) -> None:
    wind = Wind(speed_m_s=speed_m_s, from_deg=180.0, speed_sd_m_s=sd_m_s)
    assert severities("W101", one, LIMITED, autopilot, wind=wind) == [ERROR] * fires


# By the balance of forces, of 10.24 m/s with 30°: v^0.4 (U + w tan 30°) = 10.24^1.4 = 25.97.
@pytest.mark.parametrize(
    ("parameters", "exponent", "held_m_s"),
    [
        ("", 1.4, 9.59),  # 9.710^0.4 (9.594 + 0.866) = 2.4825 * 10.460 = 25.97
        ("WPNAV_SPEED_DN,300\n", 1.4, 8.88),  # 9.371^0.4 (8.878 + 1.732) = 2.4474 * 10.610 = 25.97
        ("LAND_SPEED_HIGH,300\n", 1.4, 8.88),
        ("", None, 9.37),  # 10.24 - 0.866
        ("WPNAV_SPEED_DN,500\nWPNAV_ACCEL_Z,500\n", None, 7.35),  # 10.24 - 2.887
        ("WPNAV_SPEED_DN,50\nLAND_SPEED,200\n", None, 9.08),  # 10.24 - 1.155
        ("ANGLE_MAX,2000\n", None, 5.91),  # 10.24 tan 20° / tan 30° - 1.5 tan 20° = 6.455 - 0.546
    ],
)
def test_sinking_a_vehicle_holds_less_wind_than_in_level_flight(
    parameters: str, exponent: float | None, held_m_s: float
) -> None:
    """Flown: at 1.5 m/s of sink 9.6 m/s just drifts, 10.1 m/s drifts 0.6 m/s."""
    vehicle = replace(
        QUAD, airspeed_limit_m_s=10.24, airspeed_limit_lean_deg=30.0, drag_exponent=exponent
    )
    if exponent is None and "ANGLE_MAX" in parameters:
        vehicle = replace(vehicle, airspeed_limit_lean_deg=None)
    for off_m_s, fires in ((-0.02, False), (0.02, True)):
        wind = Wind(speed_m_s=held_m_s + off_m_s, from_deg=0.0)
        more: dict[str, Any] = {"wind": wind, "parameters": parameters}
        assert severities("W101", UP_AND_DOWN, vehicle, **more) == [ERROR] * fires


def test_what_is_held_in_a_descent_is_told_with_its_rate() -> None:
    given: dict[str, Any] = {"wind": Wind(speed_m_s=11.5), "parameters": "WPNAV_SPEED_DN,200\n"}
    [finding] = of("W101", UP_AND_DOWN, LIMITED, **given)
    assert finding.message == (
        "cannot hold its position at item 2: 11.5 m/s of wind; it holds 10.8 m/s while it sinks at 2.0 m/s, "
        "of an airspeed limit of 12.0 m/s"
    )
    # As strong as it flies at all: that is what is told.
    given["wind"] = Wind(speed_m_s=12.1)
    [finding] = of("W101", UP_AND_DOWN, LIMITED, **given)
    assert "12.1 m/s of wind against an airspeed limit of 12.0 m/s" in finding.message


def test_a_descent_on_the_way_and_one_on_a_return_are_descents_too() -> None:
    # 12 − 5 tan 30° = 9.11 m/s, down to 10 m and on the way home from 60 m; a climb leaves it all.
    slow = "WPNAV_SPEED_DN,500\nLAND_SPEED_HIGH,50\nRTL_ALT,0\n"
    down = mission(takeoff(60), waypoint(0, 60), waypoint(30, 10), item(21, north(30), 0.0))
    for wind_m_s, fires in ((9.0, False), (9.3, True)):
        wind = Wind(speed_m_s=wind_m_s, from_deg=90.0)
        assert severities("W101", down, LIMITED, wind=wind, parameters=slow) == [ERROR] * fires
    up = "WPNAV_SPEED_UP,500\nWPNAV_SPEED_DN,20\nLAND_SPEED,30\nLAND_SPEED_HIGH,20\n"
    assert not of("W101", UP_AND_DOWN, LIMITED, wind=Wind(speed_m_s=11.8), parameters=up)


@pytest.mark.parametrize(
    ("lean_deg", "wind_m_s", "fires"),
    [
        (None, 8.5, False),  # 10 − 1.4 tan 45° = 8.6
        (None, 8.7, True),
        (20.0, 9.4, False),  # 10 − 1.4 tan 20° = 9.49
        (20.0, 9.6, True),
    ],
)
def test_of_steps_the_lean_is_the_models_or_the_steepest_that_is_delivered(
    lean_deg: float | None, wind_m_s: float, *, fires: bool
) -> None:
    """The article's vehicle, with a limit of 10 m/s: asked for less it sinks at up to 1.4 m/s."""
    article = load_vehicle("falkowski-2023-quadrotor")
    vehicle = replace(article, airspeed_limit_m_s=10.0, airspeed_limit_lean_deg=lean_deg)
    wind = Wind(speed_m_s=wind_m_s)
    assert severities("W101", PLAIN, vehicle, STEP, wind=wind) == [ERROR] * fires


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize("limit_m_s", [8.0, 10.0, 15.0, 20.0])
def test_an_ordinary_breeze_is_no_error_for_its_descent(
    autopilot: Autopilot, limit_m_s: float
) -> None:
    """80 % of the limit, sinking at 1.5 m/s."""
    vehicle = replace(QUAD, airspeed_limit_m_s=limit_m_s)
    wind = Wind(speed_m_s=0.8 * limit_m_s)
    assert not of("W101", UP_AND_DOWN, vehicle, autopilot, wind=wind)


@pytest.mark.parametrize(
    ("wind_m_s", "from_deg", "fires"),
    [
        (11.89, 0.0, False),  # 0.11 m/s over ground are left of 12 against it
        (11.91, 0.0, True),  # 0.09: as good as none
        (11.91, 180.0, True),  # on the way home
    ],
)
def test_a_leg_without_headway_is_an_error_in_a_wind_that_a_hover_holds(
    wind_m_s: float, from_deg: float, *, fires: bool
) -> None:
    out = mission(takeoff(30), waypoint(300, 30), rtl())
    more: dict[str, Any] = {
        "wind": Wind(speed_m_s=wind_m_s, from_deg=from_deg),
        "parameters": "WPNAV_SPEED_DN,10\nLAND_SPEED,10\nLAND_SPEED_HIGH,10\n",
    }
    assert severities("W101", HOVER, LIMITED, **more) == []
    assert severities("W101", out, LIMITED, **more) == [ERROR] * fires


def test_a_wind_that_grows_with_height_is_met_at_the_top() -> None:
    # 8 m/s at 10 m and twice that at 40 m, with the root of the height: 12 m/s are met at 22.5 m.
    wind = Wind(speed_m_s=8.0, reference_height_m=10.0, shear_exponent=0.5)
    at = {height_m: mission(takeoff(height_m), rtl()) for height_m in (18.0, 27.0)}
    low = "RTL_ALT,0\n"
    assert severities("W101", at[18.0], LIMITED, wind=wind, parameters=low) == []
    [one] = of("W101", at[27.0], LIMITED, wind=wind, parameters=low)
    assert "with its profile" in one.message


AWAY = mission(takeoff(30), waypoint(3500, 30), item(21, north(3500), 0.0))
"""Lands 3.5 km north of home."""


@pytest.mark.parametrize(
    ("speed_m_s", "expected"),
    [
        (5.0, []),  # 15 m/s against it on a return south
        (5.4, []),  # 15.4: within 3 % of the 15.1 m/s identified
        (6.0, [WARNING]),  # 16, 6 % beyond
        (6.8, [WARNING]),
        (8.0, [ERROR]),  # 18: (18 / 15.1)³ times the power is more than the 170 Wh allow
    ],
)
@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_a_return_against_the_wind_is_judged_as_a_leg(
    autopilot: Autopilot, speed_m_s: float, expected: list[Severity]
) -> None:
    behind = Wind(speed_m_s=speed_m_s, from_deg=180.0)
    more = {"wind": behind, "speed_m_s": 6.0}
    if autopilot is PX4:
        more["parameters"] = "MPC_XY_CRUISE,10\n"
    beyond = of("E105", AWAY, QUAD, autopilot, **more)
    beyond = [one for one in beyond if "airspeed" in one.message]
    assert [one.severity for one in beyond] == expected
    assert all("on the return from item" in one.message for one in beyond)


@pytest.mark.parametrize(
    ("fraction", "expected"),
    [
        (None, []),
        (0.01, []),  # 11.8 m/s are certain: within 3 % of the 12 flown
        (0.02, [WARNING]),  # 11.5: 6.5 over ground for 7
        (0.2, [ERROR]),  # 7.2: 2.2 for 7, three times as long
    ],
)
def test_a_limit_flown_at_that_is_not_certain_costs_margin(
    fraction: float | None, expected: list[Severity]
) -> None:
    """10 m/s against 5 are asked of a vehicle that is held to 12, in a box that is wider than that."""
    limited = replace(LIMITED, airspeed_limit_fraction=fraction)
    wind = Wind(speed_m_s=5.0, from_deg=0.0)
    assert severities("E105", AWAY, limited, wind=wind) == expected


def test_a_return_to_a_rally_point_is_judged_by_the_way_there() -> None:
    """From 300 m on the vehicle flies to a point 4 km ahead: with the wind, at 10 m/s less 8."""
    behind = Wind(speed_m_s=8.0, from_deg=180.0)
    ahead = replace(AWAY, rally=(rally(0.0, 3500.0),))
    far = "RALLY_LIMIT_KM,0\nRALLY_INCL_HOME,0\n"
    given: dict[str, Any] = {"wind": behind, "speed_m_s": 6.0, "parameters": far}
    assert severities("E105", ahead, **given) == []
    assert severities("E105", replace(ahead, rally=(rally(0.0, -100.0),)), **given) == [ERROR]


@pytest.mark.parametrize(
    ("action", "expected", "does"),
    [
        (0, [WARNING], ""),
        (1, [WARNING], ""),
        (2, [ERROR], "holds its position"),
        (3, [ERROR], "returns"),
        (4, [ERROR], "cuts its motors"),
        (5, [ERROR], "lands where it is"),
    ],
)
def test_what_px4_does_of_itself_in_the_wind_and_off_its_position_decides(
    action: int, expected: list[Severity], does: str
) -> None:
    wind = Wind(speed_m_s=8.1)
    given = f"COM_WIND_MAX,8\nCOM_WIND_MAX_ACT,{action}\n"
    [one] = of("W104", PLAIN, QUAD, PX4, wind=wind, parameters=given)
    assert [one.severity] == expected
    assert one.message.endswith(does)
    given = f"COM_POS_LOW_EPH,5\nCOM_POS_LOW_ACT,{action}\n"
    assert of("T114", PLAIN, QUAD, PX4, parameters=given) == []
    wrong = of("T114", PLAIN, QUAD, PX4, parameters=given, position_error_m=5.5)
    assert [f.severity for f in wrong] == expected * (action > 0)


@pytest.mark.parametrize(
    ("action", "error_m", "expected", "is_open"),
    [
        (3, None, [WARNING], False),  # a return from anywhere is judged by itself
        (1, None, [WARNING], False),
        (0, None, [], False),
        (5, None, [], True),
        (2, None, [], True),
        (5, 0.9, [], False),
        (5, 1.1, [ERROR], False),
        (3, 1.1, [ERROR], False),
        (3, 2.5, [ERROR], False),  # as much as is assumed, but stated
        (5, 2.5, [ERROR], False),
    ],
)
def test_a_tight_limit_of_the_position_is_judged_by_what_is_stated_not_by_what_is_assumed(
    action: int, error_m: float | None, expected: list[Severity], *, is_open: bool
) -> None:
    given = f"COM_POS_LOW_EPH,1\nCOM_POS_LOW_ACT,{action}\n"
    more: dict[str, Any] = {} if error_m is None else {"position_error_m": error_m}
    reported = found(PLAIN, PX4, given, vehicle=QUAD, **more)
    assert [f.severity for f in reported if f.code == "T114"] == expected
    assert any(f.code == "X904" and "COM_POS_LOW_EPH" in f.message for f in reported) is is_open


def test_gusts_count_against_the_wind_px4_accepts() -> None:
    given = "COM_WIND_MAX,8\nCOM_WIND_MAX_ACT,3\n"
    for sd_m_s, fires in ((0.9, False), (1.1, True)):
        wind = Wind(speed_m_s=6.0, speed_sd_m_s=sd_m_s)
        assert severities("W104", PLAIN, QUAD, PX4, wind=wind, parameters=given) == [ERROR] * fires


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Draw a flight that goes here and there, waits, and lands somewhere or returns."""
    height_m = draw(st.floats(10.0, 90.0))
    legs = draw(st.lists(st.floats(-900.0, 900.0), min_size=0, max_size=3))
    last = draw(st.sampled_from((rtl(), item(21, north(legs[-1] if legs else 0.0), 0.0))))
    hold_s = draw(st.sampled_from((0.0, 20.0)))
    return mission(
        takeoff(height_m), *(waypoint(one, height_m, hold_s=hold_s) for one in legs), last
    )


@settings(max_examples=examples(25), deadline=None)
@given(
    one=missions(),
    autopilot=st.sampled_from((ARDUPILOT, PX4)),
    limit_m_s=st.floats(5.0, 14.0),
    excess_m_s=st.floats(0.01, 5.0),
    sd_m_s=st.floats(0.0, 3.0),
    from_deg=st.floats(0.0, 360.0),
)
def test_no_flight_is_a_go_in_wind_it_cannot_hold_its_place_in(
    *,
    one: Mission,
    autopilot: Autopilot,
    limit_m_s: float,
    excess_m_s: float,
    sd_m_s: float,
    from_deg: float,
) -> None:
    mean_m_s = max(limit_m_s + excess_m_s - 2.0 * sd_m_s, 0.0)
    sd_m_s = 0.5 * (limit_m_s + excess_m_s - mean_m_s)
    wind = Wind(speed_m_s=mean_m_s, from_deg=from_deg, speed_sd_m_s=sd_m_s)
    vehicle = replace(QUAD, airspeed_limit_m_s=limit_m_s)
    assert severities("W101", one, vehicle, autopilot, wind=wind) == [ERROR]


@settings(max_examples=examples(25), deadline=None)
@given(
    one=missions(),
    autopilot=st.sampled_from((ARDUPILOT, PX4)),
    wind_m_s=st.floats(0.0, 20.0),
    from_deg=st.floats(0.0, 360.0),
)
def test_no_wind_is_a_go_beyond_every_speed_the_model_was_identified_at(
    one: Mission, autopilot: Autopilot, wind_m_s: float, from_deg: float
) -> None:
    """A hover in the wind has its speed as airspeed, whatever else the mission does."""
    wind = Wind(speed_m_s=wind_m_s, from_deg=from_deg)
    codes = {f.code for f in found(one, autopilot, vehicle=QUAD, wind=wind) if f.severity is ERROR}
    if wind_m_s > 0.71 * 15.1:
        assert "W103" in codes
    if wind_m_s < 5.0:  # 10 m/s of ground speed and 5 of wind are within 15.1
        assert not codes & {"W103", "E105"}


# tan 10° / tan 30° = 0.305 of 12 m/s: 3.66 m/s, as drag that grows with the airspeed has it; of that, and
# of 12 m/s, 3.40 and 11.13 m/s are left while it sinks at 1.5 m/s.
@pytest.mark.parametrize(
    ("autopilot", "parameters", "wind_m_s", "fires"),
    [
        (ARDUPILOT, "ANGLE_MAX,1000\n", 3.8, True),
        (ARDUPILOT, "ANGLE_MAX,1000\n", 3.3, False),
        (ARDUPILOT, "ATC_ANGLE_MAX,10\n", 3.8, True),
        (ARDUPILOT, "ANGLE_MAX,3000\n", 11.0, False),
        (ARDUPILOT, "ANGLE_MAX,4500\n", 12.1, True),
        # ``AC_PosControl::get_lean_angle_max_rad``: PSC_ANGLE_MAX where it is above 0, whichever is less.
        (ARDUPILOT, "PSC_ANGLE_MAX,10\n", 3.8, True),
        (ARDUPILOT, "PSC_ANGLE_MAX,10\n", 3.3, False),
        (ARDUPILOT, "ANGLE_MAX,3000\nPSC_ANGLE_MAX,10\n", 3.8, True),
        (ARDUPILOT, "ANGLE_MAX,1000\nPSC_ANGLE_MAX,30\n", 11.0, False),
        (ARDUPILOT, "ANGLE_MAX,1000\nPSC_ANGLE_MAX,0\n", 3.8, True),
        # PX4's default is 45°: tan 20° / tan 45° = 0.364 of 12 m/s are 4.37 m/s, 3.82 m/s sinking.
        (PX4, "MPC_TILTMAX_AIR,20\n", 4.5, True),
        (PX4, "MPC_TILTMAX_AIR,20\n", 3.7, False),
    ],
)
def test_a_lower_limit_of_the_lean_angle_leaves_less_airspeed(
    autopilot: Autopilot,
    parameters: str,
    wind_m_s: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    limited = replace(vehicle_of(autopilot), airspeed_limit_m_s=12.0)
    wind = Wind(speed_m_s=wind_m_s, from_deg=0.0)
    found_ = found(HOVER, autopilot, parameters, vehicle=limited, wind=wind)
    assert ("W101" in {one.code for one in found_}) == fires


# Of 15.1 m/s and 12.1 m/s, identified leaning 30° and 45° at most, 0.305 are 4.61 m/s and 0.364 4.40 m/s;
# 0.7 of that are 3.23 m/s and 3.08 m/s.  A drag of 0.3/s takes g tan 8° at 4.59 m/s: 3.22 m/s.
@pytest.mark.parametrize(
    ("name", "parameters", "wind_m_s", "fires"),
    [
        ("arducopter-sitl-quad", "ANGLE_MAX,1000\n", 3.3, True),
        ("arducopter-sitl-quad", "ANGLE_MAX,1000\n", 3.1, False),
        ("arducopter-sitl-quad", "ANGLE_MAX,3000\n", 10.5, False),
        ("arducopter-sitl-quad", "ANGLE_MAX,4500\n", 10.6, True),
        ("px4-sih-quad", "MPC_TILTMAX_AIR,20\n", 3.2, True),
        ("px4-sih-quad", "MPC_TILTMAX_AIR,20\n", 3.0, False),
        ("holybro-x500-v2", "MPC_TILTMAX_AIR,8\n", 3.3, True),
        ("holybro-x500-v2", "MPC_TILTMAX_AIR,8\n", 3.1, False),
        ("holybro-x500-v2", "MPC_TILTMAX_AIR,25\n", 10.0, False),
    ],
)
def test_a_lower_lean_leaves_less_of_what_a_model_was_identified_at(
    name: str,
    parameters: str,
    wind_m_s: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    vehicle = load_vehicle(name)
    wind = Wind(speed_m_s=wind_m_s, from_deg=0.0)
    found_ = found(HOVER, vehicle.reference, parameters, vehicle=vehicle, wind=wind)
    assert ("W103" in {one.code for one in found_}) == fires


@pytest.mark.parametrize(
    ("wind_max_m_s", "wind_m_s", "fires"),
    [
        (None, 10.5, False),
        (None, 10.6, True),
        (12.0, 12.0, False),
        (12.0, 12.1, True),
        (8.0, 8.1, True),
    ],
)
def test_the_wind_that_a_maker_allows_is_what_its_vehicle_flies_in(
    wind_max_m_s: float | None,
    wind_m_s: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    """Else 0.7 of the 15.1 m/s that it was identified at."""
    vehicle = replace(QUAD, wind_max_m_s=wind_max_m_s)
    assert bool(of("W103", HOVER, vehicle, wind=Wind(speed_m_s=wind_m_s, from_deg=0.0))) == fires


@pytest.mark.parametrize(("lean", "fires"), [("1000", True), ("3000", False)])
def test_a_lower_lean_than_the_models_costs_margin_in_calm_air(
    lean: str,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    """It flies 10 m/s with the 30° of its model; 10° leave it 4.6 m/s for certain."""
    e105 = of("E105", PLAIN, autopilot=ARDUPILOT, parameters=f"ANGLE_MAX,{lean}\n")
    assert bool(e105) == fires
    assert all("more" in one.message for one in e105)


LIMIT_M_S = 15.0
LEAN_M_S2 = 9.80665 * math.tan(math.radians(30.0))
"""5.66 m/s²: what a lean of 30° pushes with; at 15 m/s drag takes all of it."""


def circling(
    wind_m_s: float, *circles: tuple[float, float], limit_m_s: float | None = LIMIT_M_S
) -> list[Finding]:
    """Return what is found of the lean of circles, by speed and radius."""
    items = [takeoff(20)]
    for number, (speed_m_s, radius_m) in enumerate(circles):
        there = replace(waypoint(100.0 * number, 20), command=18, param1=2.0, param3=radius_m)
        items += [replace(takeoff(0), command=178, param1=1.0, param2=speed_m_s), there]
    return of(
        "W105",
        mission(*items, rtl()),
        replace(QUAD, airspeed_limit_m_s=limit_m_s),
        wind=Wind(speed_m_s=wind_m_s, from_deg=90.0),
    )


@pytest.mark.parametrize(
    ("speed", "radius"),
    [
        (10.0, 20.0),  # flown at sqrt(0.5 · 2.5 · 20) = 5 m/s, 1.25 m/s² to the centre
        (4.0, 20.0),  # 0.8 m/s² to the centre
        (10.0, 60.0),  # sqrt(0.5 · 2.5 · 60) = 8.7 m/s
    ],
)
def test_a_circle_leans_for_its_turn_its_speed_and_the_wind_together(
    speed: float, radius: float
) -> None:
    flown = min(speed, math.sqrt(0.5 * 2.5 * radius))
    # Drag per airspeed is 5.66/15 per second: what pushes to the centre counts as so much airspeed.
    across = flown**2 / radius / (LEAN_M_S2 / LIMIT_M_S)
    most_m_s = LIMIT_M_S - math.hypot(flown, across)
    assert not circling(most_m_s - 0.01, (speed, radius))
    assert circling(most_m_s + 0.01, (speed, radius))


def test_of_several_circles_those_that_lean_too_far_are_told() -> None:
    # By the same sum a radius of 20 m takes 9.0 m/s of wind at 5 m/s, and 11.8 m/s at 3 m/s.
    [finding] = circling(9.5, (3.0, 20.0), (10.0, 20.0))
    assert finding.item == 5
    assert finding.message.startswith("1 circle from item 5 on: 5.0 m/s over ground")


def test_a_wind_faster_than_the_vehicle_is_no_question_of_circles() -> None:
    assert not circling(15.0, (10.0, 20.0))  # W101's


def test_without_a_circle_or_a_known_limit_nothing_is_said_of_circles() -> None:
    assert not circling(12.0)
    unshown = replace(QUAD, valid_for=replace(QUAD.valid_for, speed_m_s=None))
    assert not of("W105", _circle(), unshown, wind=Wind(speed_m_s=12.0, from_deg=90.0))
    # of a model that states no limit what it was seen to fly, 15.1 m/s: 6.0 m/s and the wind
    for wind_m_s, fires in ((8.9, False), (9.3, True)):
        found = of("W105", _circle(), QUAD, wind=Wind(speed_m_s=wind_m_s, from_deg=90.0))
        assert bool(found) is fires


def _circle() -> Mission:
    """Return a mission with a circle of 20 m around home, flown at 5 m/s."""
    there = replace(waypoint(0, 20), command=18, param1=2.0, param3=20.0)
    return mission(takeoff(20), there, rtl())


@pytest.mark.parametrize(
    ("at_m", "hill_m", "wind_m_s", "is_open"),
    [
        # it may be flown up to 34 m from its middle; the hill's foot is a cell, 10 m, before its top
        (46.0, 90.0, 9.3, False),
        (40.0, 90.0, 9.3, True),  # 30 m high there
        (40.0, 45.0, 9.3, False),  # 17 m
        (32.0, 22.0, 9.3, True),
        (32.0, 19.0, 9.3, False),
        (32.0, 22.0, 8.9, False),  # W105 is silent
    ],
)
def test_a_circle_that_is_not_flown_as_predicted_beside_a_hill_is_not_checked(
    at_m: float, hill_m: float, wind_m_s: float, *, is_open: bool
) -> None:
    """20 m high and 20 m wide, over level ground but for a wall across the north."""
    wind = Wind(speed_m_s=wind_m_s, from_deg=90.0)
    given: dict[str, Any] = {"terrain": ground(hill_m, at_m=at_m), "wind": wind, "clearance_m": 0.0}
    left_open = [one for one in of("X904", _circle(), **given) if "ground as high" in one.message]
    assert bool(left_open) is is_open


@pytest.mark.parametrize(
    ("limit_m", "wind_m_s", "is_open"),
    [(30.0, 9.3, True), (33.0, 9.3, True), (36.0, 9.3, False), (33.0, 8.9, False)],
)
def test_a_circle_that_is_not_flown_as_predicted_at_the_limit_of_a_site_is_not_checked(
    limit_m: float, wind_m_s: float, *, is_open: bool
) -> None:
    """20 m around home, and 15 m more at most."""
    wind = Wind(speed_m_s=wind_m_s, from_deg=90.0)
    profile = SiteProfile(source="site.toml", max_distance_m=limit_m)
    left_open = of("X904", _circle(), wind=wind, profile=profile)
    assert any("max_distance_m" in one.message for one in left_open) is is_open


@pytest.mark.parametrize(
    ("radius_m", "inclusion", "is_open"),
    [(32.5, True, True), (36.0, True, False), (6.0, False, True), (2.5, False, False)],
)
def test_a_circle_that_is_not_flown_as_predicted_near_a_fence_is_not_checked(
    radius_m: float,
    inclusion: bool,  # noqa: FBT001 - a table of cases
    is_open: bool,  # noqa: FBT001
) -> None:
    """Three quarters of 20 m are 15 m: inside from 35 m on, and around less than 5 m, it is clear, and a
    metre or two nearer as the vehicle flies inside of the circle its target is on."""
    fence = Fence(circles=(circle(0.0, 0.0, radius_m, inclusion=inclusion),))
    one = replace(_circle(), fence=fence)
    given: dict[str, Any] = {"wind": Wind(speed_m_s=9.3, from_deg=90.0)}
    open_ones = [f for f in of("X904", one, **given) if "F107" in f.message]
    assert bool(open_ones) is is_open
    assert not of("X904", one)


@pytest.mark.parametrize(
    ("autopilot", "wind_m_s", "speeds"),
    [(ARDUPILOT, 5.5, "6.5 m/s of 10.0 m/s"), (PX4, 8.0, "4.0 m/s of 5.0 m/s")],
)
def test_returns_slower_than_they_should_be_are_told_where_the_mission_is_not(
    autopilot: Autopilot, wind_m_s: float, speeds: str
) -> None:
    # Out as commanded, with the wind; back against it 12 m/s of airspeed less the wind are left.
    away = mission(takeoff(30), waypoint(300, 30), item(21, north(300), 0.0))
    [finding] = of("W102", away, LIMITED, autopilot, wind=Wind(speed_m_s=wind_m_s, from_deg=180.0))
    assert "returns from item" in finding.message
    assert f"down to {speeds}" in finding.message
    assert " leg" not in finding.message
    # A little less wind than 12 − 10 m/s holds them all.
    assert not of("W102", away, LIMITED, autopilot, wind=Wind(speed_m_s=1.9, from_deg=180.0))


# WP_NAVALT_MIN 2: a landing leans 7° at most below 2 m.  tan 7° / tan 30° = 0.2127 of 15 m/s: 3.19 m/s, its
# root 6.92 m/s; of a lean of 10°, which leaves 4.58 m/s, 0.6963 and its root: 3.19 and 3.82 m/s.
@pytest.mark.parametrize(
    ("parameters", "wind_m_s", "severity"),
    [
        ("WP_NAVALT_MIN,2\n", 3.1, None),
        ("WP_NAVALT_MIN,2\n", 3.3, Severity.WARNING),
        ("WP_NAVALT_MIN,2\n", 6.8, Severity.WARNING),
        ("WP_NAVALT_MIN,2\n", 7.0, Severity.ERROR),
        ("WP_NAVALT_MIN,0\n", 7.0, None),
        ("WP_NAVALT_MIN,2\nPSC_ANGLE_MAX,10\n", 3.1, None),
        ("WP_NAVALT_MIN,2\nPSC_ANGLE_MAX,10\n", 3.9, Severity.ERROR),
        ("WP_NAVALT_MIN,2\nPSC_ANGLE_MAX,6\n", 2.0, None),
    ],
)
def test_near_the_ground_a_landing_leans_little(
    parameters: str, wind_m_s: float, severity: Severity | None
) -> None:
    limited = replace(vehicle_of(ARDUPILOT), airspeed_limit_m_s=15.0)
    wind = Wind(speed_m_s=wind_m_s, from_deg=0.0)
    told = found(HOVER, ARDUPILOT, parameters, vehicle=limited, wind=wind)
    assert [one.severity for one in told if one.code == "W106"] == [severity] * bool(severity)


@pytest.mark.parametrize(
    ("charge", "sd_m_s", "code"),
    [(0.62, 2.0, "E124"), (0.62, 0.2, ""), (0.72, 2.0, "E119"), (0.72, 0.2, ""), (1.0, 2.0, "")],
)
def test_an_uncertain_wind_that_slows_the_vehicle_takes_the_time_too(
    charge: float, sd_m_s: float, code: str
) -> None:
    """At 14 m/s against 8 m/s 1.5 km take 250 s, against 12 m/s 750 s: 500 s more of some 450 W are 62 Wh
    over the 51 Wh of the flight.  110 Wh, 62 % of 178, are fewer, 128 Wh keep less than their reserve of 36.
    """
    there_and_back = mission(takeoff(30), waypoint(1500, 30), rtl())
    given: dict[str, Any] = {
        "vehicle": replace(load_vehicle("arducopter-sitl-quad"), airspeed_limit_m_s=14.0),
        "battery": Battery(capacity_ah=8.0, nominal_voltage_v=22.2),
        "charge": charge,
        "reserve": 0.2,
        "wind": Wind(speed_m_s=8.0, from_deg=0.0, speed_sd_m_s=sd_m_s),
    }
    codes = {one.code for one in found(there_and_back, ARDUPILOT, **given)}
    assert (codes & {"E101", "E102", "E119", "E124"} or {""}) >= {code}
    assert ("E124" in codes) is (code == "E124")
    # from where it blows may be what is uncertain: two deviations of 45° off a side it comes from ahead
    turned = given | {"wind": Wind(speed_m_s=12.0, from_deg=90.0, from_sd_deg=22.5 * sd_m_s)}
    from_side = {one.code for one in found(there_and_back, ARDUPILOT, **turned)}
    assert ("E124" in from_side) is (code == "E124" and sd_m_s > 1.0), from_side


@pytest.mark.parametrize(("sd_m_s", "low_mah", "acts"), [(2.5, 50.0, True), (0.1, 50.0, False)])
def test_a_wind_from_behind_may_be_missed(sd_m_s: float, low_mah: float, *, acts: bool) -> None:
    """3 km at 12 m/s take 250 s, at 7 m/s of airspeed and 300 W 21 Wh; in a calm, at 12 m/s and 370 W, 26 Wh:
    200 mAh more of 25 V.  What is low is 50 mAh below what 22.2 V leave, which are 150 mAh of 25 V."""
    away = mission(takeoff(30), speed(12.0), waypoint(3000, 30), item(21, north(3000), 0.0))
    wind = Wind(speed_m_s=5.0, from_deg=180.0)
    pack = Battery(capacity_ah=8.0, nominal_voltage_v=22.2)
    given: dict[str, Any] = {"vehicle": replace(QUAD, spread=None), "reserve": 0.0}
    flown = check(away, given["vehicle"], battery=pack, wind=wind)
    at_end = next(one.energy_used_wh for one in flown.items if one.item == 3)
    assert at_end is not None
    low = 8000.0 * (1.0 - at_end / pack.energy_wh) - low_mah
    text = f"BATT_MONITOR,4\nBATT_CAPACITY,8000\nBATT_LOW_MAH,{low}\nBATT_FS_LOW_ACT,1\n"
    uncertain = replace(wind, speed_sd_m_s=sd_m_s)
    told = of("E103", away, parameters=text, battery=pack, wind=uncertain, **given)
    assert bool([one for one in told if "0.0 m/s of wind" in one.message]) is acts


# The drag over the weight at 12 m/s is tan 30° = 0.5774: at a wind U and 0.5 m/s of sink a lean of
# atan(0.04811 U / (1 − 0.0241)): 15° at 0.2679 · 0.9759 / 0.04811 = 5.435 m/s.  Less two deviations of 2 %
# the limit is 11.52 m/s: 0.05012, 5.213 m/s.
STOCK = replace(
    QUAD,
    airspeed_limit_m_s=10.24,
    airspeed_limit_lean_deg=30.0,
    airspeed_limit_fraction=0.01,
    drag_exponent=1.4,
)
"""ArduCopter's simulated quad, as identified from its flights."""


@pytest.mark.parametrize(
    ("vehicle", "parameters", "wind_m_s", "fires"),
    [
        (LIMITED, "", 5.40, False),
        (LIMITED, "", 5.47, True),
        (LIMITED, "ANGLE_MAX,1400\n", 5.0, False),  # it leans no more than 14°
        (replace(LIMITED, airspeed_limit_fraction=0.02), "", 5.18, False),
        (replace(LIMITED, airspeed_limit_fraction=0.02), "", 5.25, True),
        # a drag of 0.3/s: 9.80665 tan 15° (1 − 0.5 · 0.3 / 9.80665) / 0.3 = 8.63 m/s
        (replace(QUAD, drag_per_s=0.3), "", 8.6, False),
        (replace(QUAD, drag_per_s=0.3), "", 8.7, True),
        (replace(QUAD, drag_per_s=None), "", 9.0, False),
        # flown, with as much wind down to the ground
        (STOCK, "", 5.5, False),  # disarmed 2 s after the touch-down
        (STOCK, "", 5.8, True),  # not within 3 minutes
    ],
)
def test_ardupilot_may_stay_armed_where_it_lands_leaning_more_than_15_degrees(
    vehicle: VehicleModel,
    parameters: str,
    wind_m_s: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    wind = Wind(speed_m_s=wind_m_s)
    given: dict[str, Any] = {"wind": wind, "parameters": parameters}
    assert severities("W107", UP_AND_DOWN, vehicle, **given) == [WARNING] * fires
    assert not of("W107", UP_AND_DOWN, vehicle, PX4, wind=wind)


def test_the_wind_a_landing_leans_against_is_that_a_metre_above_the_ground() -> None:
    # (1 m / 10 m)^0.2 = 0.631 of the wind at 10 m: 5.435 m/s of 8.61 m/s
    for speed_m_s, sd_m_s, fires in ((8.5, 0.0, False), (8.7, 0.0, True), (8.0, 0.35, True)):
        wind = Wind(
            speed_m_s=speed_m_s, speed_sd_m_s=sd_m_s, reference_height_m=10.0, shear_exponent=0.2
        )
        found_ = of("W107", UP_AND_DOWN, LIMITED, wind=wind)
        assert bool(found_) is fires
        assert all(one.item == 2 for one in found_)
